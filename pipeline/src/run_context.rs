// SPDX-License-Identifier: MIT OR Apache-2.0
//! What every stage needs of the command that runs it: messages, Ctrl-C, the seed, checkpoints.

use crate::checkpoint::Checkpoints;
use crate::interrupt::Interrupt;
use crate::progress::Console;

/// The context of a run.
#[derive(Clone, Copy)]
pub struct Environment<'a> {
    /// Progress and messages.
    pub console: Console,
    /// Ctrl-C.
    pub interrupt: &'a Interrupt,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where finished groups of paths are kept, if they are.
    pub checkpoints: Option<&'a Checkpoints>,
}

impl<'a> Environment<'a> {
    /// The same, keeping finished groups of paths.
    #[must_use]
    pub fn keeping(self, checkpoints: Option<&'a Checkpoints>) -> Self {
        Self {
            checkpoints,
            ..self
        }
    }

    /// One that says nothing, for programs that call a stage themselves.
    pub fn quiet(interrupt: &'a Interrupt, seed: u64) -> Self {
        let console = Console {
            quiet: true,
            json: false,
        };
        Self {
            console,
            interrupt,
            seed,
            checkpoints: None,
        }
    }
}
