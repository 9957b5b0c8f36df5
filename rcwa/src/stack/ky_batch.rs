// SPDX-License-Identifier: MIT OR Apache-2.0
//! The ky of one kx0 as a batch: which layers they pass together, and at which nodes of ky.

use super::arithmetic::{Arithmetic, MAX_EXPONENT};
use super::propagate::{LayerStep, decay_of_modes};
use std::f64::consts::PI;
use std::ops::Range;

/// Largest error of the interpolated transfer.
const ACCURACY: f64 = 5e-14;
/// Most nodes: beyond, nothing is gained.
const MAX_NODES: usize = 20;

/// Neighbouring layers.
pub(crate) struct LayerGroup {
    /// Which.
    pub(crate) layers: Range<usize>,
    /// True where one [`Transfer`](super::transfer::Transfer) takes them together.
    pub(crate) together: bool,
}

/// Range and number of the ky of a line.
#[derive(Clone, Copy)]
pub(crate) struct KyBatch {
    /// Smallest and largest ky².
    squares: [f64; 2],
    count: usize,
}

impl KyBatch {
    pub(crate) fn new(ky: impl Iterator<Item = f64>) -> Self {
        let mut span = Self { squares: [f64::INFINITY, 0.0], count: 0 };
        for ky in ky {
            span.squares = [span.squares[0].min(ky * ky), span.squares[1].max(ky * ky)];
            span.count += 1;
        }
        span
    }

    /// True where it holds all ky of another one.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        self.squares[0] <= other.squares[0] && other.squares[1] <= self.squares[1]
    }

    /// Nodes that a thickness (times k0) needs: the coefficients fall as 2 (L/4)^k/(2k)!.
    fn nodes(&self, d: f64) -> usize {
        let quarter = 0.25 * (self.squares[1] - self.squares[0]) * d * d;
        let mut term = 2.0;
        let mut k = 0;
        while term > ACCURACY && k <= MAX_NODES {
            k += 1;
            term *= quarter / ((2 * k) as f64 * (2 * k - 1) as f64);
        }
        k.max(1)
    }

    /// Splits the layers into groups that pass together and groups that pass one by one.
    pub(crate) fn groups<T: Arithmetic>(&self, steps: &[LayerStep<'_, T>]) -> Vec<LayerGroup> {
        let growth: Vec<f64> =
            steps.iter().map(|s| decay_of_modes(s.modes, self.squares[1]) * s.thickness).collect();
        let mut groups: Vec<LayerGroup> = Vec::new();
        let mut from = 0;
        while from < steps.len() {
            // The rest in groups of equal growth.
            let whole: f64 = growth[from..].iter().sum();
            let share = whole / (whole / MAX_EXPONENT).ceil().max(1.0) * 1.000_001;
            let (mut to, mut sum) = (from, 0.0);
            while to < steps.len() && (to == from || sum + growth[to] <= share) {
                sum += growth[to];
                to += 1;
            }
            let thickness: f64 = steps[from..to].iter().map(|s| s.thickness).sum();
            // At ky = 0 alone odd parts over ky are not to be had.
            let pays = 2 * self.count > 3 * self.nodes(thickness)
                && sum <= MAX_EXPONENT
                && self.squares[1] > 0.0;
            match groups.last_mut() {
                Some(LayerGroup { layers, together: false }) if !pays => layers.end = to,
                _ => groups.push(LayerGroup { layers: from..to, together: pays }),
            }
            from = to;
        }
        groups
    }

    /// Nodes of Chebyshev in ky², as ky.
    pub(crate) fn places(&self, d: f64) -> Vec<f64> {
        let count = self.nodes(d);
        let [low, high] = self.squares;
        (0..count)
            .map(|j| {
                let x = ((2 * j + 1) as f64 / (2 * count) as f64 * PI).cos();
                (0.5 * (low + high) + 0.5 * (high - low) * x).sqrt()
            })
            .collect()
    }
}
