// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light between two faces of a film stack.

use glam::DVec3;

use crate::receiver::PathHistory;

/// Light between two faces.
#[derive(Clone, Copy)]
pub(super) struct Traveller {
    /// Its place from where it met the stack, mm; z from the lowest face.
    pub at: DVec3,
    pub direction: DVec3,
    /// Number of the space between two faces, 0 below all of them.
    pub space: usize,
    pub weight: f64,
    /// Collisions in media.
    pub scatterings: u32,
    /// Number of its wavelength.
    pub wavelength: u16,
    pub history: PathHistory,
    /// Square of the farthest that it has been from where it met the stack, mm².
    pub reach2: f64,
}

impl Traveller {
    /// Records how far from where it met the stack the light has been.
    pub fn reach(&mut self, at: DVec3) {
        self.reach2 = self.reach2.max(at.truncate().length_squared());
    }
}
