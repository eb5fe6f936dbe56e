//! Runs the program with one of its calls made to fail: of the kernel's for files, or of Vulkan's.
//!
//! The failing is done by a library that is preloaded into the program (`faults.c`), which is compiled here by the C compiler
//! that any machine with Rust has. It also lists the calls of a sound run, so that a test knows the places where one may fail.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::folder::Folder;

/// Nothing here takes nearly as long: a program that does hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// One call of the program's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// Such as "write", or a function of Vulkan's.
    pub kind: String,
    /// The file below the program's folder that the call is about; empty for Vulkan's.
    pub name: String,
    pub has_failed: bool,
}

/// A call that is to fail.
#[derive(Debug, Clone)]
pub struct Fault {
    pub kind: String,
    /// Counted from 0 among the calls of this kind.
    pub number: usize,
    /// A number of errno, a `VkResult`, or one of the words in `faults.c`.
    pub how: String,
    /// All later calls of the kind fail as well.
    pub lasts: bool,
}

/// A run that has ended.
#[derive(Debug)]
pub struct Ended {
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
    pub calls: Vec<Call>,
}

impl Ended {
    /// The calls that failed.
    pub fn failed(&self) -> impl Iterator<Item = &Call> {
        self.calls.iter().filter(|call| call.has_failed)
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let lasts = if self.lasts { "+" } else { "" };
        write!(f, "{} {}{lasts} {}", self.kind, self.number, self.how)
    }
}

/// Runs the program in a folder, with a fault or without one.
///
/// # Panics
///
/// If it hangs.
#[track_caller]
pub fn run(folder: &Folder, arguments: &str, fault: Option<&Fault>) -> Ended {
    run_command(&mut folder.isolume(arguments), folder, fault)
}

/// The same of a command that a test has changed.
#[track_caller]
pub fn run_command(command: &mut Command, folder: &Folder, fault: Option<&Fault>) -> Ended {
    static LIBRARY: LazyLock<Library> = LazyLock::new(Library::compile);
    let aside = TempDir::new().expect("a folder for what it says");
    let path = |name: &str| aside.path().join(name);
    let pipe = |name: &str| Stdio::from(File::create(path(name)).expect("a file"));
    let below = fs::canonicalize(folder.path("")).expect("the folder");
    command
        .env("LD_PRELOAD", LIBRARY.path())
        .env("FAULT_BELOW", below)
        .env("FAULT_LOG", path("calls"))
        .stdout(pipe("stdout"))
        .stderr(pipe("stderr"));
    if let Some(fault) = fault {
        command.env("FAULT", fault.to_string());
    }
    let mut process = command.spawn().expect("the program starts");
    let began = Instant::now();
    let status = loop {
        match process.try_wait().expect("a process") {
            Some(status) => break status,
            None if began.elapsed() > PATIENCE => {
                process.kill().expect("it is killed");
                process.wait().expect("it has ended");
                panic!("{fault:?}: it hangs");
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let read = |name: &str| String::from_utf8_lossy(&fs::read(path(name)).expect(name)).into();
    let calls: String = read("calls");
    Ended {
        status,
        stdout: read("stdout"),
        stderr: read("stderr"),
        calls: calls.lines().map(call).collect(),
    }
}

fn call(line: &str) -> Call {
    let (kind, name) = line.split_once(' ').unwrap_or((line, ""));
    let name = name.trim_start_matches("./");
    Call {
        kind: kind.trim_start_matches('!').to_string(),
        name: name.to_string(),
        has_failed: kind.starts_with('!'),
    }
}

struct Library(TempDir);

impl Library {
    fn compile() -> Library {
        let library = Library(TempDir::new().expect("a folder for a library"));
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/support/faults.c");
        let compiled = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror"])
            .arg("-o")
            .args([&library.path(), &source])
            .status();
        assert!(compiled.expect("a C compiler").success());
        library
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("faults.so")
    }
}
