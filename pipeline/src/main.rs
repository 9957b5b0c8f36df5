// SPDX-License-Identifier: MIT OR Apache-2.0
//! The binary `batwing`: parses the command line, runs the command, turns its error into one
//! message and an exit code.

use std::process::ExitCode;

use clap::Parser;
use pipeline::cli::Cli;
use pipeline::exit;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return ExitCode::from(exit::of_command_line(&error)),
    };
    match cli.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(exit::report(&error)),
    }
}
