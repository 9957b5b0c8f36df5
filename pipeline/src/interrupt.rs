// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ctrl-C: asks the running stage to stop at its next safe point; a stage that has none within [`GRACE`], or a second Ctrl-C,
//! ends the process there and then.
//!
//! Files appear under their names only when they are whole ([`crate::report::atomic`]), so neither way leaves a partial one.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};

use crate::report::atomic;

/// Exit code of a process ended by Ctrl-C (128 + SIGINT).
pub const EXIT_CODE: u8 = 130;

/// How long a stage may take to stop.
pub const GRACE: Duration = Duration::from_secs(2);

/// The error that a stopped stage returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted; finished tables stay in the cache, a new run goes on from there")]
pub struct Interrupted;

/// Flag that Ctrl-C raises.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// A flag wired to Ctrl-C. To be called once in a process.
    pub fn install() -> Result<Self> {
        let flag = Arc::new(AtomicBool::new(false));
        let raised = Arc::clone(&flag);
        ctrlc::set_handler(move || {
            if raised.swap(true, Ordering::SeqCst) {
                end();
            }
            std::thread::spawn(|| {
                std::thread::sleep(GRACE);
                end();
            });
        })
        .context("cannot watch for Ctrl-C")?;
        Ok(Self(flag))
    }

    /// The flag itself, for code that polls it.
    pub fn flag(&self) -> &AtomicBool {
        &self.0
    }

    /// Whether Ctrl-C was pressed.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// An error once Ctrl-C was pressed.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.is_raised() {
            Err(Interrupted)
        } else {
            Ok(())
        }
    }
}

/// Removes what is being written and ends the process.
fn end() -> ! {
    atomic::discard_pending();
    std::process::exit(i32::from(EXIT_CODE));
}

/// 130 for an interrupt, 1 for every other error.
pub fn exit_code(error: &anyhow::Error) -> u8 {
    if error
        .chain()
        .any(<dyn std::error::Error>::is::<Interrupted>)
    {
        EXIT_CODE
    } else {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interrupt_keeps_its_exit_code_under_context() {
        let interrupt = Interrupt::default();
        assert!(interrupt.check().is_ok());
        interrupt.flag().store(true, Ordering::SeqCst);
        let error = Err::<(), _>(interrupt.check().unwrap_err())
            .context("while tracing")
            .unwrap_err();
        assert_eq!(exit_code(&error), 130);
        assert_eq!(exit_code(&anyhow::anyhow!("no such file")), 1);
    }
}
