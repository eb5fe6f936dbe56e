//! What the tests of transport share: renders in process under validation ([`common`]), a picture against numbers known
//! in closed form ([`exact`]), an independent path tracer on the CPU ([`oracle`]), when two pictures count as the same
//! ([`equivalence`]), scenes for both ([`small_scenes`]), volumes whose voxels follow a formula ([`fields`]), the shaders'
//! functions run one by one ([`probe`], with its shaders in `glsl/`), and what a process holds as time goes by ([`curve`]).
//! Beside them stand a folder for the program's files (`folder.rs`), numbers in its JSON (`number.rs`) and writers of
//! volume files (`volume_files.rs`), which other crates take by their paths.

pub mod common;
pub mod curve;
pub mod equivalence;
pub mod exact;
pub mod fields;
pub mod oracle;
pub mod probe;
pub mod small_scenes;
