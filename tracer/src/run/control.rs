// SPDX-License-Identifier: MIT OR Apache-2.0
//! What goes with a trace beside scene, receivers and settings: progress, cancellation, checkpoints,
//! and the table of a film stack.

use std::sync::atomic::AtomicBool;

use crate::checkpoint::CheckpointStore;
use crate::film_stack::TabulatedFilms;

/// Callbacks of a running trace, and tables for it.
#[derive(Clone, Copy, Default)]
pub struct Control<'a> {
    /// Called now and then, from any thread, with the number of paths done since its last call.
    pub progress: Option<&'a (dyn Fn(u64) + Sync)>,
    /// Raise it to stop the run, which then returns [`crate::Error::Cancelled`].
    pub cancel: Option<&'a AtomicBool>,
    /// Keeps finished groups and gives them back; asked by all runs
    /// but [`super::run_rays`].
    pub checkpoints: Option<&'a dyn CheckpointStore>,
    /// Table of the film stack of the scene; without it light is traced film by film. All runs but
    /// [`super::run_rays`] take it.
    pub films: Option<TabulatedFilms<'a>>,
}
