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

    pub(crate) fn patch(primitive: u32) -> u32 {
        match primitive {
            5 => 1,
            4 => 2,
            _ => 0,
        }
    }

    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        let inverse = ray.direction.recip();
        let to_low = (self.0.low - ray.origin) * inverse;
        let to_high = (self.0.high - ray.origin) * inverse;

        // Latest entry and earliest exit. A ray along a face divides 0 by 0: min and max drop the
        // NaN.
        let (mut enter, mut enter_face) = (f64::NEG_INFINITY, 0);
        let (mut leave, mut leave_face) = (f64::INFINITY, 0);
        for axis in 0..3 {
            // By the sign bit: the inverse of -0 is -∞.
            let forward = inverse[axis] > 0.0;
            let (near, far) = if forward {
                (to_low[axis], to_high[axis])
            } else {
                (to_high[axis], to_low[axis])
            };
            if near > enter {
                (enter, enter_face) = (near, 2 * axis as u32 + u32::from(!forward));
            }
            if far < leave {
                (leave, leave_face) = (far, 2 * axis as u32 + u32::from(forward));
            }
        }
        if enter > leave {
            return None;
        }
        if sides.admit(Side::Outer) && reach.holds(enter) {
            return Some(Intersection {
                distance: enter,
                primitive: enter_face,
                side: Side::Outer,
            });
        }
        if sides.admit(Side::Inner) && reach.holds(leave) {
            return Some(Intersection {
                distance: leave,
                primitive: leave_face,
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

    /// Its faces by primitive, corners in a row.
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
            (
                primitive as u32,
                [[0, 0], [1, 0], [1, 1], [0, 1]].map(corner),
            )
        })
    }

    /// Its edges, from end to end.
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
