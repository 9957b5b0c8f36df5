// SPDX-License-Identifier: MIT OR Apache-2.0
//! Events of traced paths: where each begins, what it meets, how it ends.
//!
//! An [`Observer`] is a type parameter of the loop that follows a path: methods that it leaves
//! empty are gone from the machine code.

use bsdf::Side;
use glam::DVec3;

use crate::ledger::Loss;
use crate::ray::Ray;

/// An interaction of a path with a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interaction {
    /// Point in the frame of the world, mm.
    pub point: DVec3,
    /// The line of the surface in the ledger, see [`crate::scene::Lines::surfaces`].
    pub line: usize,
    /// The instance met; `None` for a surface of the world.
    pub instance: Option<u32>,
    /// Unit direction along which it came.
    pub direction: DVec3,
    /// The side from which it came.
    pub from: Side,
    /// The side on which it goes on, if it does.
    pub to: Side,
    /// Weight with which it came, 0 to 1.
    pub arrived: f64,
    /// Weight that goes on.
    pub weight: f64,
}

/// End of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    /// It left the scene with direction z ≥ 0.
    EscapedUp,
    /// It left the scene with direction z < 0.
    EscapedDown,
    /// The surface of this line of the ledger absorbed what was left.
    Surface(usize),
    /// The medium of this line of the ledger absorbed what was left, on a flight of this length
    /// (mm, infinite where nothing was met).
    Medium(usize, f64),
    /// It was given up.
    Lost(Loss),
}

/// Receives the events of paths. Every method does nothing by default.
pub trait Observer {
    /// A path of weight 1 begins; the ray is in the frame of the world.
    #[inline]
    fn begins(&mut self, _ray: &Ray) {}

    /// It met a surface; the last interaction of a path has weight 0 where the surface absorbed
    /// all.
    #[inline]
    fn meets(&mut self, _interaction: &Interaction) {}

    /// The medium of this line of the ledger has scattered it; the ray with which it goes on is in
    /// the frame of the world.
    #[inline]
    fn scatters(&mut self, _ray: &Ray, _line: usize) {}

    /// It has met a periodic face and goes on from the opposite one; both points are in the frame of
    /// the world.
    #[inline]
    fn goes_round(&mut self, _from: DVec3, _to: DVec3) {}

    /// It ends, with what was left of its weight before; the ray is its last flight, in the frame
    /// of the world.
    #[inline]
    fn ends(&mut self, _ray: &Ray, _fate: Fate, _weight: f64) {}
}

/// Ignores all events.
impl Observer for () {}
