// SPDX-License-Identifier: MIT OR Apache-2.0
//! Meridians: generating curves of bodies of revolution, polylines in (r, z) cut into elements with
//! their own surface models.

use super::Frustum;
use crate::error::Error;

/// A stretch of a meridian with its own surface model, for example one step of a stepped dome.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Points [r, z] in mm, at least two, in the direction away from the axis: the outer side
    /// lies to the left (r to the right, z up). The first point is the last one of the element
    /// before.
    pub points: Vec<[f64; 2]>,
}

/// A continuous polyline. Overhangs (r going back) are allowed; crossing itself is the caller's to
/// avoid.
#[derive(Debug, Clone, PartialEq)]
pub struct Meridian {
    frusta: Vec<(Frustum, u32)>,
    elements: usize,
}

impl Meridian {
    /// Joins `elements` in order; each must begin within 1e-9 of the size where the one before
    /// ends.
    pub fn new(elements: &[Element]) -> Result<Self, Error> {
        if elements.is_empty() {
            return Err(Error::TooFew { what: "elements of a meridian", expected: 1, got: 0 });
        }
        let mut frusta = Vec::new();
        let mut last: Option<[f64; 2]> = None;
        for (number, Element { points }) in elements.iter().enumerate() {
            if points.len() < 2 {
                return Err(Error::TooFew {
                    what: "points of a meridian element",
                    expected: 2,
                    got: points.len(),
                });
            }
            let mut from = points[0];
            if let Some(end) = last {
                let gap = (from[0] - end[0]).hypot(from[1] - end[1]);
                if gap > 1e-9 * (end[0].abs() + end[1].abs()) {
                    return Err(Error::Meridian(format!(
                        "element {number} begins at r = {}, z = {}, but the one before ends at r \
                            = {}, z = {}",
                        from[0], from[1], end[0], end[1]
                    )));
                }
                // Exactly one vertex, so that neighbours leave no gap.
                from = end;
            }
            for &to in &points[1..] {
                frusta.push((Frustum::new(from, to)?, number as u32));
                from = to;
            }
            last = Some(from);
        }
        Ok(Self { frusta, elements: elements.len() })
    }

    /// The meridian of these segments with the numbers of their elements, all coordinates times
    /// `factor`.
    pub(super) fn scaled(
        segments: impl Iterator<Item = (Frustum, u32)>,
        elements: usize,
        factor: f64,
    ) -> Result<Self, Error> {
        let scaled = segments.map(|(frustum, element)| Ok((frustum.scaled(factor)?, element)));
        Ok(Self { frusta: scaled.collect::<Result<_, Error>>()?, elements })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.elements
    }

    /// The last point, [r, z] in mm.
    pub fn end(&self) -> [f64; 2] {
        self.frusta[self.frusta.len() - 1].0.ends()[1]
    }

    /// Segments in order, each with the number of its element.
    pub fn frusta(&self) -> &[(Frustum, u32)] {
        &self.frusta
    }
}
