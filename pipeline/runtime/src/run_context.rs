// SPDX-License-Identifier: MIT OR Apache-2.0
//! The run context: console, interrupt flag, seed and checkpoints, which every stage of one run
//! shares.

use crate::interrupt::Interrupt;
use crate::progress::Console;
use crate::store::Store;

/// The context of one run.
#[derive(Clone, Copy)]
pub struct RunContext<'a> {
    /// Progress and messages.
    pub console: Console,
    /// Ctrl-C.
    pub interrupt: &'a Interrupt,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Store of finished groups of paths, if there is one.
    pub checkpoints: Option<&'a Store>,
}

impl<'a> RunContext<'a> {
    /// The same, storing finished groups of paths in `checkpoints`, if there are some.
    #[must_use]
    pub fn storing(self, checkpoints: Option<&'a Store>) -> Self {
        Self { checkpoints: checkpoints.or(self.checkpoints), ..self }
    }

    /// True if all pieces of a job are merged, so that nothing may be computed.
    pub fn is_merging(self) -> bool {
        self.checkpoints.is_some_and(Store::is_merging)
    }

    /// The same, with warnings alone on the console.
    #[must_use]
    pub fn silent(self) -> Self {
        let console = Console { quiet: true, ..self.console };
        Self { console, ..self }
    }

    /// The same without progress, messages, results and warnings on the console.
    #[must_use]
    pub fn mute(self) -> Self {
        Self { console: Console { quiet: true, json: false, warns: false }, ..self }
    }

    /// A context that prints warnings alone, for programs that call a stage themselves.
    pub fn quiet(interrupt: &'a Interrupt, seed: u64) -> Self {
        let console = Console { quiet: true, json: false, warns: true };
        Self { console, interrupt, seed, checkpoints: None }
    }
}
