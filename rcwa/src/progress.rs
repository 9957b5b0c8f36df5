// SPDX-License-Identifier: MIT OR Apache-2.0
//! Progress of a computation, reported to the caller, who may stop it.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Receives the number of layers just passed, each counted once for every ky; may stop the
/// computation.
pub type Progress<'a> = dyn Fn(usize) -> ControlFlow<()> + Sync + 'a;

/// A [`Progress`] that never stops anything.
pub fn no_progress(_: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Reports only the layers beyond the first `reported`, for work that repeats earlier work.
pub(crate) fn beyond<'a>(
    progress: &'a Progress<'a>,
    reported: usize,
) -> impl Fn(usize) -> ControlFlow<()> + Sync + 'a {
    let passed = AtomicUsize::new(0);
    move |layers| {
        let before = passed.fetch_add(layers, Ordering::Relaxed);
        progress((before + layers).max(reported) - before.max(reported))
    }
}

/// Reports every `parts`-th layer, for work that passes the same layers in several parts.
pub(crate) struct Shared<'a> {
    progress: &'a Progress<'a>,
    parts: usize,
    counted: AtomicUsize,
}

impl<'a> Shared<'a> {
    pub(crate) fn new(progress: &'a Progress<'a>, parts: usize) -> Self {
        Self { progress, parts, counted: AtomicUsize::new(0) }
    }

    pub(crate) fn report(&self, layers: usize) -> ControlFlow<()> {
        let before = self.counted.fetch_add(layers, Ordering::Relaxed);
        (self.progress)((before + layers) / self.parts - before / self.parts)
    }

    /// Layers reported so far.
    pub(crate) fn reported(&self) -> usize {
        self.counted.load(Ordering::Relaxed) / self.parts
    }
}
