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

/// Changes when a package is installed.
const PACKAGES: &str = "/var/lib/dpkg/status";

fn main() {
    println!("cargo::rerun-if-changed=tools/build.rs");
    let architecture = std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
    let folder = format!("/usr/lib/{architecture}-linux-gnu");
    let path_of = |archive: &str| format!("{folder}/lib{archive}.a");
    let holds = |archive: &str| Path::new(&path_of(archive)).exists();
    if holds("glslang") {
        println!("cargo::rerun-if-changed={}", path_of("glslang"));
        println!("cargo::rustc-link-search=native={folder}");
        for archive in ARCHIVES.into_iter().filter(|archive| holds(archive)) {
            println!("cargo::rustc-link-lib=static={archive}");
        }
        println!("cargo::rustc-link-lib=dylib=stdc++");
    } else if Path::new(PACKAGES).exists() {
        println!("cargo::rerun-if-changed={PACKAGES}");
    }
}
