// SPDX-License-Identifier: MIT OR Apache-2.0
//! Callbacks of a running trace: progress, cancellation, checkpoints.

use std::sync::atomic::AtomicBool;

use crate::checkpoint::CheckpointStore;

/// Callbacks of a running trace.
#[derive(Clone, Copy, Default)]
pub struct Control<'a> {
    /// Called now and then, from any thread, with the number of paths done since its last call.
    pub progress: Option<&'a (dyn Fn(u64) + Sync)>,
    /// Raise it to stop the run, which then returns [`crate::Error::Cancelled`].
    pub cancel: Option<&'a AtomicBool>,
    /// Keeps finished groups and gives them back; asked by all runs
    /// but [`super::run_rays`].
    pub checkpoints: Option<&'a dyn CheckpointStore>,
}
