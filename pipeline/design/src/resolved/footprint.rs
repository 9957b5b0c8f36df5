// SPDX-License-Identifier: MIT OR Apache-2.0
//! The flat face with which a solid stands on the bottom.

use tracer::glam::DVec2;

/// Rounding of directions.
const ROUNDING: f64 = 1e-9;

/// A rectangle in the plane z = 0, turned about z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnedRectangle {
    /// Middle, mm.
    pub centre: DVec2,
    /// Unit vector along its first side.
    pub along: DVec2,
    /// Half its lengths along and across, mm.
    pub half: DVec2,
}

/// The flat face with which a solid stands on the bottom.
#[derive(Debug, Clone, PartialEq)]
pub enum Footprint {
    /// A rectangle.
    Rectangle(TurnedRectangle),
    /// Discs and rings about one point.
    Rings {
        /// Their middle, mm.
        centre: DVec2,
        /// Inner and outer radius of each, mm.
        rings: Vec<[f64; 2]>,
    },
}

impl TurnedRectangle {
    /// Unit vector across the first side.
    pub fn across(&self) -> DVec2 {
        DVec2::new(-self.along.y, self.along.x)
    }

    /// A point in the coordinates of the rectangle, mm.
    fn within(&self, point: DVec2) -> DVec2 {
        let off = point - self.centre;
        DVec2::new(off.dot(self.along), off.dot(self.across()))
    }
}

impl Footprint {
    /// The same with all lengths times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        match &mut self {
            Self::Rectangle(TurnedRectangle { centre, half, .. }) => {
                *centre *= factor;
                *half *= factor;
            }
            Self::Rings { centre, rings } => {
                *centre *= factor;
                rings.iter_mut().flatten().for_each(|radius| *radius *= factor);
            }
        }
        self
    }

    /// Middle and half lengths of the box around it, mm.
    pub fn bounding_box(&self) -> [DVec2; 2] {
        match self {
            Self::Rectangle(r) => {
                let half = r.along.abs() * r.half.x + r.across().abs() * r.half.y;
                [r.centre, half]
            }
            Self::Rings { centre, rings } => [*centre, DVec2::splat(outer_radius(rings))],
        }
    }

    /// True if it is a rectangle with sides along x and y.
    pub fn is_axis_aligned(&self) -> bool {
        match self {
            Self::Rectangle(r) => r.along.abs().min_element() < ROUNDING,
            Self::Rings { .. } => false,
        }
    }

    /// True if it holds a point; one with a hole is taken to hold none.
    pub fn holds(&self, point: DVec2) -> bool {
        match self {
            Self::Rectangle(r) => r.within(point).abs().cmple(r.half).all(),
            Self::Rings { centre, rings } => match rings[..] {
                [[inner, outer]] => inner <= 0.0 && point.distance(*centre) <= outer,
                _ => false,
            },
        }
    }

    /// True if it meets the rectangle between two corners, which its own bounding box meets.
    pub fn meets(&self, low: DVec2, high: DVec2) -> bool {
        match self {
            // No side of it lies between both (separating axes).
            Self::Rectangle(r) => {
                let corners = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)];
                let corners = corners.map(|corner| r.within(corner));
                let least = corners.into_iter().fold(DVec2::INFINITY, DVec2::min);
                let most = corners.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
                least.cmplt(r.half).all() && most.cmpgt(-r.half).all()
            }
            Self::Rings { centre, rings } => {
                centre.clamp(low, high).distance(*centre) < outer_radius(rings)
            }
        }
    }
}

fn outer_radius(rings: &[[f64; 2]]) -> f64 {
    rings.iter().map(|ring| ring[1]).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOW: DVec2 = DVec2::new(-1.0, -1.0);
    const HIGH: DVec2 = DVec2::new(1.0, 1.0);

    #[test]
    fn a_disc_beside_a_corner_meets_nothing() {
        let disc = |x: f64| Footprint::Rings { centre: DVec2::new(x, x), rings: vec![[0.0, 1.0]] };
        // Its bounding box reaches the corner (1, 1) in both cases.
        assert!(!disc(1.8).meets(LOW, HIGH));
        assert!(disc(1.7).meets(LOW, HIGH));
        assert!(disc(0.0).holds(DVec2::new(0.7, 0.7)) && !disc(0.0).holds(HIGH));
    }

    #[test]
    fn a_turned_rectangle_meets_what_its_sides_reach() {
        let root = 0.5f64.sqrt();
        let turned = |x: f64| {
            Footprint::Rectangle(TurnedRectangle {
                centre: DVec2::new(x, x),
                along: DVec2::new(root, root),
                half: DVec2::new(1.0, 2.0),
            })
        };
        // Along the diagonal it reaches 1 from its middle, and the corner lies √2 from the origin.
        assert!(!turned(1.8).meets(LOW, HIGH));
        assert!(turned(1.6).meets(LOW, HIGH));
        assert!(!turned(0.0).is_axis_aligned());
        let [_, half] = turned(0.0).bounding_box();
        assert!((half - DVec2::splat(3.0 * root)).length() < 1e-12);
    }
}
