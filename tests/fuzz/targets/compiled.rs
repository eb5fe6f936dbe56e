//! What is kept of compiled shaders and pipelines: an input is a file in the folder of such, or the SPIR-V in it.
//!
//! The modules are the library's own, which keeps them to itself. `tools/fuzz` names their folder by `XDG_CACHE_HOME`.

#![no_main]
#![allow(dead_code)] // The library uses more of them.

#[path = "../../../src/cache_dir.rs"]
mod cache_dir;
#[path = "../../../src/gpu/compiled.rs"]
mod compiled;
#[path = "../../../src/gpu/dead_branches.rs"]
mod dead_branches;
#[path = "../../../src/locked.rs"]
mod locked;
#[path = "../../../src/gpu/reflection.rs"]
mod reflection;
#[path = "../../../src/gpu/spirv.rs"]
mod spirv;
#[path = "../../../src/temporary.rs"]
mod temporary;

use std::sync::LazyLock;

use compiled::Compiled;
use dead_branches::without_dead_branches;
use isolume_fuzz::{guard, target};
use reflection::{Reflection, number_resources};

const NAME: &str = "spirv";

static COMPILED: LazyLock<Compiled> = LazyLock::new(|| Compiled::of_version(1));

const SHADER: &str = "#version 460
layout(local_size_x = 8, local_size_y = 4) in;
layout(constant_id = 0) const bool has_picture = true;
layout(constant_id = 1) const uint terms = 1;
layout(push_constant) uniform Push { uvec2 size; float x[3]; } push;
layout(rgba32f) uniform image2D picture;
uniform sampler3D volume;
buffer Sums { vec4 sums[]; };
void main() {
    if (has_picture && push.size.x > 0 || terms == 2)
    imageStore(picture, ivec2(gl_GlobalInvocationID.xy), push.x[1] * sums[push.size.x] + textureLod(volume, vec3(0), 0));
}";

fn seeds() -> Vec<Vec<u8>> {
    let mut options = shaderc::CompileOptions::new().expect("options");
    options.set_auto_bind_uniforms(true);
    let kind = shaderc::ShaderKind::Compute;
    let code = shaderc::Compiler::new()
        .and_then(|compiler| {
            compiler.compile_into_spirv(SHADER, kind, "seed", "main", Some(&options))
        })
        .expect("SPIR-V");
    COMPILED.store(NAME, code.as_binary_u8());
    let path = file().expect("the file");
    let file = std::fs::read(path).expect("the file");
    vec![
        [b"0", &file[..]].concat(),
        [b"1", code.as_binary_u8()].concat(),
    ]
}

fn file() -> Option<std::path::PathBuf> {
    Some(
        cache_dir::cache_dir()?
            .join("pipelines")
            .join(format!("{:032x}", 1))
            .join(NAME),
    )
}

fn parse(bytes: &[u8]) {
    let allowed = (1 << 20) + 256 * bytes.len();
    match bytes.split_first() {
        Some((b'0', file_bytes)) => {
            std::fs::write(file().expect("a folder"), file_bytes).expect("a file");
            guard::run(allowed, || COMPILED.load(NAME));
        }
        Some((b'1', code)) => {
            let mut code: Vec<u32> = bytemuck::pod_collect_to_vec(&code[..code.len() / 4 * 4]);
            guard::run(allowed, || {
                let _ = Reflection::read(&code);
                let _ = without_dead_branches(&code, &[0, 1]);
                let _ = number_resources(&mut code);
            });
        }
        _ => {}
    }
}

target!(seeds, parse);
