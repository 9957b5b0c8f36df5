// SPDX-License-Identifier: MIT OR Apache-2.0
//! How a command that did not succeed ends: one line on standard error, or none, and an exit code.

use std::io::Write;

use anyhow::Error;

use crate::interrupt::{self, Stopped};
use crate::progress::Closed;

/// Exit code for whatever the user can put right: the one message says how.
const REFUSED: u8 = 1;
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
