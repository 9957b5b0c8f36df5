// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers of wavelengths that stand for a spectrum, and their places in it.
//!
//! n = 2^k - 1 places part a distribution into n + 1 equal shares: the places of one n are among
//! those of the next, so that a finer rule uses all that was computed for a coarser one.

/// Numbers of points, each rule containing the one before.
pub const COUNTS: [usize; 5] = [1, 3, 7, 15, 31];

/// Places in (0, 1), ascending, of the rule of `count` points, one of [`COUNTS`].
pub fn places(count: usize) -> impl Iterator<Item = f64> {
    (1..=count).map(move |k| k as f64 / (count as f64 + 1.0))
}
