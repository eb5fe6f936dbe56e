//! Compiles the GLSL in `glsl/`, which is embedded in the program, and keeps the SPIR-V for the next start
//! (`compiled.rs`). A file is included once, however many others ask for it, so that each includes what it uses.
//!
//! `ISOLUME_GLSL=DIR` reads it from disk instead, so that a shader can be changed without a rebuild.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

use include_dir::{Dir, DirEntry, include_dir};
use shaderc::{
    CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind,
    SpirvVersion, TargetEnv,
};
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::compiled::Compiled;
use crate::error::{DeviceError, Error, Result};
use crate::locked::locked;

static EMBEDDED: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/glsl");

/// One compiler for the whole process: a fresh one costs 0.1 s with its first shader, a warm one
/// milliseconds a shader.
static COMPILER: LazyLock<shaderc::Result<Compiler>> = LazyLock::new(Compiler::new);

/// The description from which a pass is made.
pub struct PassDesc<'a> {
    /// The shader's file name without `.comp`; also the name in timings and messages.
    pub name: &'static str,
    /// Values of the specialization constants 0, 1, …
    pub specialization: &'a [u32],
    /// `Shared::PUSH` of the struct that it takes as push constants.
    pub push: &'static str,
    /// Macros and their definitions.
    pub macros: &'a [(&'static str, String)],
}

/// The shaders' text, and the state of their compilation.
pub struct Shaders {
    /// The text for which `#include "shared.glsl"` stands: the data that CPU and GPU share.
    shared: String,
    folder: Option<PathBuf>,
    /// Files beside those of `glsl/`, or in their place, by name: a test's own passes.
    added: HashMap<String, String>,
    /// The time spent on all passes so far.
    spent: Mutex<Duration>,
}

impl Shaders {
    pub fn new(shared: String) -> Shaders {
        Shaders {
            shared,
            folder: std::env::var_os("ISOLUME_GLSL").map(PathBuf::from),
            added: HashMap::new(),
            spent: Mutex::default(),
        }
    }

    /// Adds a file, or puts `text` in the place of one of `glsl/`: `name` is relative to it.
    pub fn with_file(mut self, name: &str, text: &str) -> Shaders {
        self.added.insert(name.into(), text.into());
        self
    }

    /// The whole text, file after file: a program with another text may render another picture.
    pub fn text(&self) -> Result<String> {
        let mut text = self.shared.clone();
        let mut files: Vec<_> = EMBEDDED.files().collect();
        files.extend(EMBEDDED.dirs().flat_map(Dir::files));
        files.sort_by_key(|file| file.path());
        for file in files {
            let path = file.path().to_string_lossy();
            text += &self
                .source(&path)
                .map_err(|problem| unfit(&path, problem))?;
        }
        Ok(text)
    }

    pub(super) fn spend(&self, time: Duration) {
        *locked(&self.spent) += time;
    }

    /// The time that compiling has taken so far, the driver's share included. Where two threads compile at once, both
    /// count.
    pub fn time_spent(&self) -> Duration {
        *locked(&self.spent)
    }

    /// SPIR-V of `glsl/NAME.comp` for a device with these macros of its own (`Device::macros`).
    pub(super) fn compile(
        &self,
        desc: &PassDesc<'_>,
        of_device: &[(&'static str, &'static str)],
    ) -> Result<Vec<u32>> {
        let of_pass = desc
            .macros
            .iter()
            .map(|(name, text)| (*name, text.as_str()));
        let macros: Vec<_> = of_pass.chain(of_device.iter().copied()).collect();
        let file = format!("{}.comp", desc.name);
        self.compile_file(file, ShaderKind::Compute, desc.push, &macros)
    }

    /// SPIR-V of `glsl/NAME.vert` and `glsl/NAME.frag`.
    pub fn compile_drawing(&self, name: &str, macros: &[(&str, &str)]) -> Result<[Vec<u32>; 2]> {
        Ok([
            self.compile_file(format!("{name}.vert"), ShaderKind::Vertex, "", macros)?,
            self.compile_file(format!("{name}.frag"), ShaderKind::Fragment, "", macros)?,
        ])
    }

    fn compile_file(
        &self,
        file: String,
        kind: ShaderKind,
        push: &str,
        macros: &[(&str, &str)],
    ) -> Result<Vec<u32>> {
        // Text that is not embedded in the program may change at any time, so its SPIR-V is not kept.
        if self.folder.is_some() || !self.added.is_empty() {
            return self.compile_text(file, kind, push, macros);
        }
        let inputs = format!("{file}\n{macros:?}\n{}\n{push}", self.shared);
        let name = format!("{file}-{:032x}", xxh3_128(inputs.as_bytes()));
        let compiled = compiled();
        if let Some(code) = compiled.load(&name) {
            return Ok(bytemuck::pod_collect_to_vec(&code));
        }
        let code = self.compile_text(file, kind, push, macros)?;
        compiled.store(&name, bytemuck::cast_slice(&code));
        Ok(code)
    }

    fn compile_text(
        &self,
        file: String,
        kind: ShaderKind,
        push: &str,
        macros: &[(&str, &str)],
    ) -> Result<Vec<u32>> {
        let failed = |problem: String| unfit(&file, problem);
        let source = self.source(&file).map_err(failed)?;
        let included = RefCell::new(HashSet::new());
        let mut options = CompileOptions::new().map_err(|e| failed(e.to_string()))?;
        // Newer targets emit LocalSizeId, which reflection does not read.
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
        options.set_target_spirv(SpirvVersion::V1_5);
        // Drivers optimise anyway: here it would cost a second for a large shader, and strip the names
        // that passes bind by.
        options.set_optimization_level(OptimizationLevel::Zero);
        // Shaders name their resources and do not number them: `number_resources` in reflection.rs does.
        options.set_auto_bind_uniforms(true);
        options.set_warnings_as_errors();
        for (name, text) in macros {
            options.add_macro_definition(name, Some(text));
        }
        options.set_include_callback(|wanted, _, _, _| {
            let is_new = included.borrow_mut().insert(wanted.to_string());
            let content = match wanted {
                _ if !is_new => String::new(),
                "shared.glsl" => self.shared.clone(),
                "push.glsl" => push.to_string(),
                _ => self.source(&format!("include/{wanted}"))?,
            };
            Ok(ResolvedInclude {
                resolved_name: wanted.to_string(),
                content,
            })
        });
        let artifact = compiler()?
            .compile_into_spirv(&source, kind, &file, "main", Some(&options))
            .map_err(|e| failed(in_one_sentence(&e.to_string())))?;
        Ok(artifact.as_binary().to_vec())
    }

    fn source(&self, path: &str) -> Result<String, String> {
        if let Some(text) = self.added.get(path) {
            return Ok(text.clone());
        }
        if let Some(folder) = &self.folder {
            let path = folder.join(path);
            return std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()));
        }
        let file = EMBEDDED.get_file(path).and_then(|f| f.contents_utf8());
        file.map(str::to_string)
            .ok_or_else(|| format!("glsl/{path} does not exist"))
    }
}

/// The SPIR-V that is kept for this version of the shaders, of the program, and of this file, which decides how they are
/// compiled.
pub(super) fn compiled() -> Compiled {
    static VERSION: LazyLock<u128> = LazyLock::new(|| {
        let mut hash = Xxh3::new();
        hash.update(env!("CARGO_PKG_VERSION").as_bytes());
        hash.update(include_bytes!("shader.rs"));
        add(&mut hash, &EMBEDDED);
        hash.digest128()
    });
    Compiled::of_version(*VERSION)
}

fn add(hash: &mut Xxh3, folder: &Dir<'_>) {
    for entry in folder.entries() {
        hash.update(entry.path().as_os_str().as_encoded_bytes());
        match entry {
            DirEntry::Dir(folder) => add(hash, folder),
            DirEntry::File(file) => hash.update(file.contents()),
        }
    }
}

fn compiler() -> Result<&'static Compiler> {
    let started = COMPILER.as_ref();
    started.map_err(|e| {
        let what = "the shader compiler did not start".into();
        let why = e.to_string();
        DeviceError::Call { what, why }.into()
    })
}

fn unfit(file: &str, problem: String) -> Error {
    let part = format!("shader {file}");
    DeviceError::Program { part, problem }.into()
}

/// What a compiler says on several lines.
fn in_one_sentence(said: &str) -> String {
    let lines: Vec<&str> = said.lines().map(str::trim).collect();
    lines.join(" ").trim().to_string()
}
