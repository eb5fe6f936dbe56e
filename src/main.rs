//! Parses, runs and exits.

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match isolume::job::run(isolume::cli::Cli::parse()) {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            eprintln!("isolume: {error}");
            ExitCode::from(error.exit_status())
        }
    }
}
