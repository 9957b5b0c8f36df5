// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ctrl-C, and the signals that ask a process to end. The first one asks the running stage to stop
//! at its next safe point. A second one, or a stage that has not stopped within [`GRACE`], ends the
//! process. Either way one line says so and no further file appears.
//!
//! Files appear under their names only when they are whole ([`crate::atomic_file`]), so neither way
//! leaves a partial file.

use std::io::Write;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result};

use crate::atomic_file;

/// Number of the signal of Ctrl-C.
const SIGINT: u8 = 2;

/// Time that a stage may take to stop.
pub const GRACE: Duration = Duration::from_secs(2);

/// The error that a stopped stage returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// The error of an interrupted command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}")]
pub struct Stopped {
    /// The line for its user.
    pub line: String,
    /// Exit code: 128 and the number of the signal, 130 after Ctrl-C and 143 after SIGTERM, unless
    /// the command has one of its own.
    pub exit_code: u8,
}

/// Flag that Ctrl-C raises.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    raised: Arc<AtomicBool>,
    /// The signal that raised it; 0 before.
    signal: Arc<AtomicU8>,
    /// Continuation of the line for the user.
    note: Arc<Mutex<String>>,
    /// Exit code; 0 for that of the signal.
    exit_code: Arc<AtomicU8>,
}

impl Interrupt {
    /// A flag that Ctrl-C raises; called once in a process.
    pub fn install() -> Result<Self> {
        let interrupt = Self::default();
        interrupt.watch_signals()?;
        Ok(interrupt)
    }

    #[cfg(unix)]
    fn watch_signals(&self) -> Result<()> {
        use signal_hook::consts::{SIGINT as CTRL_C, SIGTERM};
        // Not SIGHUP, which `nohup` has the process ignore.
        let signals = signal_hook::iterator::Signals::new([CTRL_C, SIGTERM]);
        let mut signals = signals.context("cannot watch for Ctrl-C and SIGTERM")?;
        let interrupt = self.clone();
        std::thread::spawn(move || {
            for signal in signals.forever() {
                interrupt.raise(u8::try_from(signal).unwrap_or(SIGINT));
            }
        });
        Ok(())
    }

    #[cfg(not(unix))]
    fn watch_signals(&self) -> Result<()> {
        let pressed = self.clone();
        ctrlc::set_handler(move || pressed.raise(SIGINT)).context("cannot watch for Ctrl-C")
    }

    fn raise(&self, signal: u8) {
        // The first signal says how the process ends.
        let first = self.signal.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst);
        self.raised.store(true, Ordering::SeqCst);
        if first.is_err() {
            self.end();
        }
        atomic_file::close();
        let pressed = self.clone();
        std::thread::spawn(move || {
            std::thread::sleep(GRACE);
            pressed.end();
        });
    }

    /// The flag itself, for code that polls it.
    pub fn flag(&self) -> &AtomicBool {
        &self.raised
    }

    /// True once Ctrl-C was pressed.
    pub fn is_raised(&self) -> bool {
        self.raised.load(Ordering::SeqCst)
    }

    /// An error once Ctrl-C was pressed.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.is_raised() { Err(Interrupted) } else { Ok(()) }
    }

    /// Stops a solver between two layers once Ctrl-C was pressed.
    pub fn watch(&self) -> impl Fn(usize) -> ControlFlow<()> + Sync + '_ {
        move |_| {
            if self.is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }

    /// Sets what an interrupt from here on means to the user; the text follows the word
    /// `interrupted`.
    pub fn note(&self, note: impl Into<String>) {
        *self.note.lock().unwrap_or_else(PoisonError::into_inner) = note.into();
    }

    /// Sets the exit code of an interrupt from here on.
    pub fn exit_with(&self, code: u8) {
        self.exit_code.store(code, Ordering::SeqCst);
    }

    /// The exit code that [`Self::exit_with`] set.
    pub fn own_exit_code(&self) -> Option<u8> {
        let code = self.exit_code.load(Ordering::SeqCst);
        (code != 0).then_some(code)
    }

    /// The error that a command ends with: after Ctrl-C the line for its user, whatever a stage
    /// stopped with.
    pub fn explain(&self, error: anyhow::Error) -> anyhow::Error {
        if self.is_raised() || error.chain().any(<dyn std::error::Error>::is::<Interrupted>) {
            self.stopped().into()
        } else {
            error
        }
    }

    fn stopped(&self) -> Stopped {
        let note = self.note.lock().unwrap_or_else(PoisonError::into_inner);
        let line =
            if note.is_empty() { "interrupted".to_owned() } else { format!("interrupted {note}") };
        let signal = match self.signal.load(Ordering::SeqCst) {
            0 => SIGINT,
            signal => signal,
        };
        let exit_code = self.own_exit_code().unwrap_or(128 + signal);
        Stopped { line, exit_code }
    }

    /// Removes what is being written and ends the process.
    fn end(&self) -> ! {
        atomic_file::discard_pending();
        let stopped = self.stopped();
        say(&stopped);
        std::process::exit(i32::from(stopped.exit_code));
    }
}

/// Prints the line once in a process: the command that stops and the end of its grace may coincide.
pub fn say(stopped: &Stopped) {
    static SAID: Mutex<bool> = Mutex::new(false);
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if !*said {
        // Nothing can be done if standard error itself is gone.
        let _ = writeln!(std::io::stderr(), "batwing: {stopped}");
        *said = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_a_stage_stops_with_after_ctrl_c_becomes_one_line() {
        let interrupt = Interrupt::default();
        assert!(interrupt.check().is_ok());
        let kept = interrupt.explain(anyhow::anyhow!("no such file"));
        assert_eq!(kept.to_string(), "no such file");

        interrupt.flag().store(true, Ordering::SeqCst);
        let stopped = interrupt.check().unwrap_err();
        let error = Err::<(), _>(stopped).context("while tracing").unwrap_err();
        assert_eq!(
            interrupt.explain(error).downcast::<Stopped>().unwrap(),
            Stopped { line: "interrupted".to_owned(), exit_code: 130 }
        );
        interrupt.note("before results.json was written");
        let error = interrupt.explain(anyhow::anyhow!("stopped by the caller"));
        assert_eq!(format!("{error:#}"), "interrupted before results.json was written");
    }
}
