// SPDX-License-Identifier: MIT OR Apache-2.0
//! The binary `batwing`: parses the command line, runs the command, turns its error into one message and an exit code.

use std::process::ExitCode;

use clap::Parser;
use pipeline::{cli, commands, exit};

fn main() -> ExitCode {
    let arguments = match cli::Cli::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return ExitCode::from(exit::of_command_line(&error)),
    };
    match commands::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(exit::report(&error)),
    }
}
