// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light between two faces of a film stack.

use glam::DVec3;

use crate::receiver::PathHistory;

/// Light between two faces.
#[derive(Clone, Copy)]
pub(super) struct Traveller {
    pub at: DVec3,
    pub direction: DVec3,
    pub space: usize,
    pub weight: f64,
    pub scatterings: u32,
    pub wavelength: u16,
    pub history: PathHistory,
    pub reach2: f64,
}

impl Traveller {
    /// Records how far from where it met the stack the light has been.
    pub fn reach(&mut self, at: DVec3) {
        self.reach2 = self.reach2.max(at.truncate().length_squared());
    }
}
