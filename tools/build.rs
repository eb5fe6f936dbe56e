//! Links the static libraries that Debian's shaderc archive needs but does not hold.
//!
//! `shaderc-sys` with `prefer-static-linking` finds shaderc alone; glslang and SPIRV-Tools
//! are packaged apart (glslang-dev, spirv-tools). Building shaderc from source instead takes about
//! 19 CPU-minutes, which nobody should wait for before a first picture.

use std::path::Path;

/// Later glslang has folded some of these into others: those that are there are linked.
const ARCHIVES: [&str; 8] = [
    "glslang",
    "MachineIndependent",
    "GenericCodeGen",
    "OSDependent",
    "OGLCompiler",
    "SPIRV",
    "SPIRV-Tools-opt",
    "SPIRV-Tools",
];

fn main() {
    println!("cargo::rerun-if-changed=tools/build.rs");
    for folder in ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu"] {
        let holds = |archive: &str| Path::new(folder).join(format!("lib{archive}.a")).exists();
        if holds("glslang") {
            println!("cargo::rustc-link-search=native={folder}");
            for archive in ARCHIVES.into_iter().filter(|archive| holds(archive)) {
                println!("cargo::rustc-link-lib=static={archive}");
            }
            println!("cargo::rustc-link-lib=dylib=stdc++");
        }
    }
}
