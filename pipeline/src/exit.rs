// SPDX-License-Identifier: MIT OR Apache-2.0
//! How a command that did not succeed ends: one line on standard error, or none, and an exit code.

use std::io::Write;

use anyhow::Error;
use clap::CommandFactory;
use clap::error::ErrorKind;

use crate::cli::Cli;
use crate::cli_errors;
use crate::interrupt::{self, Stopped};
use crate::progress::Closed;

/// Exit code for whatever the user can put right: the one message says how.
const REFUSED: u8 = 1;
/// Exit code for a command line that is none, as of most programs.
const UNUSABLE: u8 = 2;
/// Exit code where the reader of standard output went away (128 + SIGPIPE), as of any program that such a reader ends.
pub const CLOSED: u8 = 141;

/// Says what `error` is, and returns the exit code. A reader that stops reading (`batwing ... | head`) needs no message.
pub fn report(error: &Error) -> u8 {
    if let Some(stopped) = error.downcast_ref::<Stopped>() {
        interrupt::say(stopped);
        interrupt::EXIT_CODE
    } else if error.chain().any(<dyn std::error::Error>::is::<Closed>) {
        CLOSED
    } else {
        // Nothing can be done if standard error itself is gone.
        let _ = writeln!(std::io::stderr(), "batwing: {error:#}");
        REFUSED
    }
}

/// Says what is wrong with the command line, in one line, and returns the exit code; or prints the help or the version that was asked for.
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
                cli_errors::message(error, &Cli::command())
            );
            UNUSABLE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn exit_codes_follow_the_cause() {
        assert_eq!(report(&anyhow::anyhow!("no such file")), 1);
        assert_eq!(report(&Stopped("interrupted".to_owned()).into()), 130);
        let closed = Err::<(), _>(Closed).context("while printing").unwrap_err();
        assert_eq!(report(&closed), 141);
    }
}
