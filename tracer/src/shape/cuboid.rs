// SPDX-License-Identifier: MIT OR Apache-2.0
//! Axis-aligned boxes, intersected by slabs [Kay, Kajiya 1986].

use bsdf::Side;
use glam::DVec3;

use super::{Bounds, Intersection, Reach, Sides};
use crate::error::{Error, check, finite};
use crate::ray::Ray;

/// A box between two corners. Primitives are faces: 2·axis for the lower, 2·axis + 1 for the higher
/// one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid(Bounds);

/// Entry and exit of a ray through the box between two corners: distances and numbers of the faces,
/// the entry beyond the exit where it passes by. `inverse` holds the reciprocals of its direction.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
#[inline(always)]
pub(crate) fn box_passage(
    [low, high]: [[f64; 3]; 2],
    origin: [f64; 3],
    inverse: [f64; 3],
) -> [(f64, f64); 2] {
    // Latest entry and earliest exit. A ray along a face divides 0 by 0: comparisons drop the NaN.
    let (mut enter, mut enter_face) = (f64::NEG_INFINITY, 0.0);
    let (mut leave, mut leave_face) = (f64::INFINITY, 0.0);
    for axis in 0..3 {
        let to_low = (low[axis] - origin[axis]) * inverse[axis];
        let to_high = (high[axis] - origin[axis]) * inverse[axis];
        // By the sign bit: the inverse of -0 is -∞.
        let forward = inverse[axis] >= 0.0;
        let near = if forward { to_low } else { to_high };
        let far = if forward { to_high } else { to_low };
        let (lower, upper) = (2.0 * axis as f64, 2.0 * axis as f64 + 1.0);
        let near_face = if forward { lower } else { upper };
        let far_face = if forward { upper } else { lower };
        let later = near > enter;
        enter_face = if later { near_face } else { enter_face };
        enter = if later { near } else { enter };
        let sooner = far < leave;
        leave_face = if sooner { far_face } else { leave_face };
        leave = if sooner { far } else { leave };
    }
    [(enter, enter_face), (leave, leave_face)]
}

impl Cuboid {
    /// The box from corner `low` to corner `high`, mm.
    pub fn new(low: DVec3, high: DVec3) -> Result<Self, Error> {
        for axis in 0..3 {
            finite("corner of a box, mm", low[axis])?;
            finite("corner of a box, mm", high[axis])?;
            check(
                "length of a box, mm",
                high[axis] - low[axis],
                "a finite number above 0",
                high[axis] > low[axis],
            )?;
        }
        Ok(Self(Bounds { low, high }))
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Result<Self, Error> {
        Self::new(factor * self.0.low, factor * self.0.high)
    }

    pub(crate) fn patch(primitive: u32) -> u32 {
        match primitive {
            5 => 1,
            4 => 2,
            _ => 0,
        }
    }

    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        let (low, high) = (self.0.low.to_array(), self.0.high.to_array());
        let inverse = ray.direction.recip().to_array();
        let ends = box_passage([low, high], ray.origin.to_array(), inverse);
        let [(enter, enter_face), (leave, leave_face)] = ends;
        if enter > leave {
            return None;
        }
        if sides.admit(Side::Outer) && reach.holds(enter) {
            return Some(Intersection {
                distance: enter,
                primitive: enter_face as u32,
                side: Side::Outer,
            });
        }
        if sides.admit(Side::Inner) && reach.holds(leave) {
            return Some(Intersection {
                distance: leave,
                primitive: leave_face as u32,
                side: Side::Inner,
            });
        }
        None
    }

    #[inline]
    pub(super) fn settle(&self, mut at: DVec3, primitive: u32) -> (DVec3, DVec3) {
        let axis = (primitive / 2) as usize;
        let mut normal = DVec3::ZERO;
        if primitive.is_multiple_of(2) {
            at[axis] = self.0.low[axis];
            normal[axis] = -1.0;
        } else {
            at[axis] = self.0.high[axis];
            normal[axis] = 1.0;
        }
        (at, normal)
    }

    /// Faces by primitive, corners in a row.
    pub(super) fn faces(&self) -> [(u32, [DVec3; 4]); 6] {
        std::array::from_fn(|primitive| {
            let (axis, upper) = (primitive / 2, primitive % 2);
            let corner = |[u, v]: [usize; 2]| {
                let mut at = [self.0.low, self.0.high][upper];
                for (along, end) in [((axis + 1) % 3, u), ((axis + 2) % 3, v)] {
                    at[along] = [self.0.low, self.0.high][end][along];
                }
                at
            };
            (primitive as u32, [[0, 0], [1, 0], [1, 1], [0, 1]].map(corner))
        })
    }

    /// Edges, from end to end.
    pub(crate) fn edges(&self) -> Vec<[DVec3; 2]> {
        let corners = self.0.corners();
        let along = |axis: usize| {
            let begins = (0..8).filter(move |number| number >> axis & 1 == 0);
            begins.map(move |number| [corners[number], corners[number | 1 << axis]])
        };
        (0..3).flat_map(along).collect()
    }

    pub(crate) fn bounds(&self) -> Bounds {
        self.0
    }
}
