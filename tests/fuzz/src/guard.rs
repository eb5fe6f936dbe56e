//! What makes an input a finding, besides hanging, which libFuzzer sees itself.

use std::alloc::System;
use std::backtrace::Backtrace;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// The last panic: it is only told if nothing catches it.
static LAST: Mutex<Option<(String, Backtrace)>> = Mutex::new(None);

/// Begins a target. Its seeds become files in the folder that `FUZZ_SEEDS` names.
pub fn start(seeds: impl FnOnce() -> Vec<Vec<u8>>) {
    if let Some(folder) = std::env::var_os("FUZZ_SEEDS").map(PathBuf::from) {
        for (n, seed) in seeds().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{n}")), seed).expect("the seeds' folder");
        }
    }
    // libFuzzer's own hook would end the program at each panic, also at those that the library catches.
    set_hook(Box::new(remember));
}

fn remember(info: &PanicHookInfo<'_>) {
    let last = (info.to_string(), Backtrace::force_capture());
    // The library guards decoders of other people. What panics in its own code is a finding, also behind the guard.
    let is_elsewhere = |file: &str| file.contains("/registry/") || file.starts_with("/rustc/");
    if !info.location().is_some_and(|at| is_elsewhere(at.file())) {
        end(&format!("{}\n{}", last.0, last.1));
    }
    *LAST.lock().unwrap_or_else(PoisonError::into_inner) = Some(last);
}

/// Runs a parser. All bytes that it ever asks for, not just those held at once, must be within `allowed`.
pub fn run<T>(allowed: usize, parse: impl FnOnce() -> T) -> T {
    let region = Region::new(ALLOCATOR);
    let outcome = catch_unwind(AssertUnwindSafe(parse));
    let allocated = region.change().bytes_allocated;
    let Ok(parsed) = outcome else {
        match &*LAST.lock().unwrap_or_else(PoisonError::into_inner) {
            Some((panic, trace)) => end(&format!("{panic}\n{trace}")),
            None => end("it panicked"),
        }
    };
    if allocated > allowed {
        end(&format!(
            "{allocated} bytes were allocated, allowed are {allowed}"
        ));
    }
    parsed
}

/// libFuzzer keeps the input of a program that ends like this.
fn end(finding: &str) -> ! {
    eprintln!("finding: {finding}");
    std::process::abort()
}
