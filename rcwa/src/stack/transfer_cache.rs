// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cache of the transfers of a line, from one call to the next.

use super::arithmetic::Arithmetic;
use super::ky_batch::KyBatch;
use super::state::State;
use super::transfer::{Transfer, Workspace};
use crate::modes::Basis;

/// Transfers through the lowest layers of a stack, kept for further ky.
pub(crate) struct TransferCache<T> {
    /// From the bottom up.
    transfers: Vec<Transfer<T>>,
    /// Number of layers they pass.
    layers: usize,
    /// Basis above the highest of them.
    basis: Option<Basis<T>>,
    /// The ky they hold for.
    span: Option<KyBatch>,
    /// True where the next layers may be added.
    grows: bool,
    /// Bytes for them.
    bytes: usize,
}

impl<T: Arithmetic> TransferCache<T> {
    /// A cache that keeps nothing.
    pub(crate) fn none() -> Self {
        Self::with_capacity(0)
    }

    /// An empty cache of so many bytes.
    pub(crate) fn with_capacity(bytes: usize) -> Self {
        Self { transfers: Vec::new(), layers: 0, basis: None, span: None, grows: bytes > 0, bytes }
    }

    /// Takes states through the cached layers. Returns how many, and the coordinates above the
    /// highest.
    pub(crate) fn pass(
        &self,
        states: &mut [&mut State<T>],
        span: &KyBatch,
        shelf: &Workspace<T>,
    ) -> (usize, Option<Basis<T>>) {
        if !self.span.as_ref().is_some_and(|own| own.holds(span)) {
            return (0, None);
        }
        for transfer in &self.transfers {
            transfer.pass(states, shelf);
        }
        (self.layers, self.basis.clone())
    }

    /// Adds transfers through further `layers` with `basis` above them, if they fit and all layers
    /// below are cached; `None` if the layers did not pass together.
    pub(crate) fn add(
        &mut self,
        found: Option<Vec<Transfer<T>>>,
        span: &KyBatch,
        layers: usize,
        basis: &Basis<T>,
    ) {
        if self.span.as_ref().is_some_and(|own| !own.holds(span)) {
            // The cached transfers are for other ky, and nothing passed by them.
            self.bytes += self.transfers.iter().map(Transfer::bytes).sum::<usize>();
            (self.transfers, self.layers, self.span) = (Vec::new(), 0, None);
        }
        let fitting = found.filter(|some| {
            let bytes: usize = some.iter().map(Transfer::bytes).sum();
            self.grows && bytes <= self.bytes
        });
        let Some(some) = fitting else {
            self.grows = false;
            return;
        };
        self.bytes -= some.iter().map(Transfer::bytes).sum::<usize>();
        self.transfers.extend(some);
        self.layers += layers;
        self.basis = Some(basis.clone());
        self.span = Some(*span);
    }
}
