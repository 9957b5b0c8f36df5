// SPDX-License-Identifier: MIT OR Apache-2.0
//! A ray: a point and a unit direction, in the frame of the region where it flies.

use glam::DVec3;

/// A half-line. Inside a body its coordinates are those of the body's prototype, elsewhere those of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts, mm.
    pub origin: DVec3,
    /// Where it goes, a unit vector.
    pub direction: DVec3,
}

impl Ray {
    /// The point at `distance` mm along the ray.
    #[inline]
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}
