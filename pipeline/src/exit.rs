// SPDX-License-Identifier: MIT OR Apache-2.0
//! Exit codes and the one line on standard error of a command that fails.

use std::io::Write;

use anyhow::Error;
use clap::CommandFactory;
use clap::error::ErrorKind;

use runtime::control_characters::{bounded, printable};
use runtime::interrupt::{self, Stopped};
use runtime::progress::Closed;

use crate::cli::Cli;
use crate::cli_errors;

/// Exit code of a refused input or a failed computation.
const REFUSED: u8 = 1;
/// Exit code of a command line that cannot be parsed.
const UNUSABLE: u8 = 2;
/// Exit code where standard output was closed by its reader (128 + SIGPIPE).
pub const CLOSED: u8 = 141;

/// Prints `error` and returns the exit code. A reader that stops reading (`batwing ... | head`)
/// needs no message.
pub fn report(error: &Error) -> u8 {
    if let Some(stopped) = error.downcast_ref::<Stopped>() {
        interrupt::say(stopped);
        stopped.exit_code
    } else if error.chain().any(<dyn std::error::Error>::is::<Closed>) {
        CLOSED
    } else {
        // Nothing can be done if standard error itself is gone.
        let _ = writeln!(std::io::stderr(), "batwing: {}", printable(&message(error)));
        REFUSED
    }
}

/// The error and its causes; one whose text the message before it holds already is left out.
pub fn message(error: &Error) -> String {
    let mut parts: Vec<String> = Vec::new();
    for cause in error.chain() {
        let text = cause.to_string();
        if parts.last().is_none_or(|before| !before.contains(&text)) {
            parts.push(text);
        }
    }
    bounded(&parts.join(": "))
}

/// Prints the help or version that was asked for, or one line on what is wrong with the command
/// line; returns the exit code.
pub fn of_command_line(error: &clap::Error) -> u8 {
    // Nothing can be done if the stream itself is gone.
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let _ = error.print();
            0
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            UNUSABLE
        }
        _ => {
            let _ = writeln!(
                std::io::stderr(),
                "batwing: {}",
                printable(&bounded(&cli_errors::message(error, &Cli::command())))
            );
            UNUSABLE
        }
    }
}
