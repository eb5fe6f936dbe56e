//! Parses, runs and exits.

use std::process::ExitCode;

use clap::Parser;
use isolume::cli::{Cli, Command, message};
use isolume::error::Result;
use isolume::output::say;
#[cfg(feature = "window")]
use isolume::view;
use isolume::{interrupt, job, panic_guard};

fn main() -> ExitCode {
    panic_guard::silence_guarded_panics();
    match run(Cli::parse().command) {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            // One sentence, whatever names of files have in them.
            say(format!("isolume: {}", message(&error)).replace('\n', "\\n"));
            ExitCode::from(interrupt::status_of(&error))
        }
    }
}

/// Returns the exit status.
fn run(command: Command) -> Result<u8> {
    #[cfg(feature = "window")]
    let has_window = matches!(command, Command::View(_));
    #[cfg(not(feature = "window"))]
    let has_window = false;
    // The window has its own way to end.
    if !has_window {
        interrupt::catch_signals();
    }
    match command {
        Command::Render(args) => job::render(&args),
        #[cfg(feature = "window")]
        Command::View(args) => view::view(&args),
        Command::Plan(args) => job::plan(&args),
        Command::Bench(args) => job::bench(&args),
        Command::Scene(args) => job::scene(&args),
        Command::Merge(args) => job::merge(&args),
        Command::Compare(args) => job::compare(&args),
        Command::Doctor(args) => job::doctor(&args),
        Command::Info(args) => job::info(&args),
        Command::Clean(args) => job::clean(&args),
    }
}
