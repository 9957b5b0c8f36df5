// SPDX-License-Identifier: MIT OR Apache-2.0
//! Drives that pixels of a picture need.

use metrics::gamut::{Matrix, apply};

/// Drives that pixels need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needs {
    /// From X, Y and Z, where white has Y = 1.
    pub matrix: Matrix,
    /// True if each row is a channel; else all channels need the largest row.
    pub by_channel: bool,
}

impl Needs {
    /// Of grey pictures, whose levels stand in place of X, Y and Z.
    pub const GREY: Self =
        Self { matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], by_channel: false };

    pub(super) fn of(&self, xyz: [f32; 3]) -> [f64; 3] {
        let all = apply(&self.matrix, xyz.map(f64::from)).map(|need| need.clamp(0.0, 1.0));
        if self.by_channel { all } else { [all.into_iter().fold(0.0, f64::max); 3] }
    }
}
