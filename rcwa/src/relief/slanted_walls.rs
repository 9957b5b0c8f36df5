// SPDX-License-Identifier: MIT OR Apache-2.0
//! Layers of a relief that follow its slanted walls (4.1).
//!
//! In: a relief of real indices and a plan. Out: for every slice of the plan its section half-way
//! up, as two layers of half its height, each with the corrections for the sections at the nodes of
//! Gauss: strips along the sides, and walls that are not vertical.
//!
//! The fields obey F' = M(z) F. With M₀ of the section half-way up, its walls taken as vertical, a
//! slice of height h is passed by the flows of M₀ from node to node and, at each node, by the flow
//! of M(z) - M₀ over its weight. First-order effects of M - M₀ within a slice are so right to the
//! eighth order in h, second-order ones to the second; but strips are narrow and walls are
//! corrected little. M₀ is the same for both halves, and M - M₀ is of small rank, so that nodes
//! cost little beside modes and interfaces. [McLachlan 1995] treats splittings into the exact flow
//! of the larger part and a quadrature of the smaller.

use num_complex::Complex64;

use super::layer::intervals_between;
use super::{Layer, Relief, Segment, SlicePlan, geometry};

/// The four nodes of Gauss on either side of the middle: distance from it in units of half the
/// slice, and weight.
const NODES: [(f64, f64); 2] = [
    (0.861_136_311_594_052_6, 0.173_927_422_568_726_9),
    (0.339_981_043_584_856_3, 0.326_072_577_431_273_1),
];

/// Nodes of a slice, both halves together.
pub(crate) const NODES_OF_A_SLICE: usize = 2 * NODES.len();

/// Sides closer than this part of the period to a border of a section are its walls.
const AT_BORDER: f64 = 1e-9;

/// A border between materials at one height, and the direction of its normal n = (nx, nz).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wall {
    /// Place, a fraction of the period, in 0 ≤ x < 1.
    pub(crate) x: f64,
    /// nx².
    pub(crate) xx: f64,
    /// nx nz.
    pub(crate) xz: f64,
}

/// A stretch in which a section has another permittivity than the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Strip {
    /// Begin, a fraction of the period.
    pub(crate) x0: f64,
    /// End, a fraction of the period.
    pub(crate) x1: f64,
    /// ε of the section less that of the layer.
    pub(crate) rise: f64,
}

/// The difference of a section of a relief from the layer of vertical walls whose modes are used.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WallCorrection {
    /// Height of the section above the bottom of the layer, in units of the layer's thickness.
    pub(crate) place: f64,
    /// Weight in the quadrature, as a height.
    pub(crate) height: f64,
    /// The materials of the section.
    pub(crate) segments: Vec<Segment>,
    /// Borders between materials, ascending.
    pub(crate) borders: Vec<Wall>,
    /// The strips in which its ε differs.
    pub(crate) strips: Vec<Strip>,
}

/// The layers of `plan`, from top to bottom, each with its corrections from its bottom to its top.
pub(crate) fn layers(relief: &Relief, plan: &SlicePlan) -> Vec<(Layer, Vec<WallCorrection>)> {
    let mut layers = Vec::with_capacity(2 * plan.count());
    for interval in plan.intervals() {
        let depth = interval.z1 - interval.z0;
        if !interval.slanted {
            let segments = relief.layer_at(0.5 * (interval.z0 + interval.z1));
            let layer = Layer { thickness: depth, segments };
            layers.push((layer, Vec::new()));
            continue;
        }
        let height = depth / interval.count as f64;
        for i in 0..interval.count {
            let middle = interval.z0 + (i as f64 + 0.5) * height;
            let segments = relief.layer_at(middle);
            // Node, its place in its half from the bottom up, weight.
            let at = |(node, place, weight): (f64, f64, f64)| {
                let z = middle + 0.5 * node * height;
                wall_correction(relief, z, &segments).map(|(section, borders, strips)| {
                    WallCorrection {
                        place,
                        height: weight * height,
                        segments: section,
                        borders,
                        strips,
                    }
                })
            };
            let half = |nodes: [(f64, f64, f64); 2]| {
                let layer = Layer { thickness: 0.5 * height, segments: segments.clone() };
                (layer, nodes.into_iter().filter_map(at).collect())
            };
            let [(outer, small), (inner, large)] = NODES;
            layers.push(half([(-inner, inner, large), (-outer, outer, small)]));
            layers.push(half([(outer, 1.0 - outer, small), (inner, 1.0 - inner, large)]));
        }
    }
    layers
}

/// The section at height `z`, its walls and its strips; `None` where it is the layer and all walls
/// are vertical.
fn wall_correction(
    relief: &Relief,
    z: f64,
    layer: &[Segment],
) -> Option<(Vec<Segment>, Vec<Wall>, Vec<Strip>)> {
    let segments = relief.layer_at(z);
    let walls = walls(relief, &segments, z)?;
    let strips = strips(&segments, layer);
    let counts = !strips.is_empty() || walls.iter().any(|w| w.xz != 0.0);
    counts.then_some((segments, walls, strips))
}

/// The strips in which the ε of a section is not that of a layer.
fn strips(section: &[Segment], layer: &[Segment]) -> Vec<Strip> {
    let borders: Vec<f64> = section.iter().chain(layer).map(|s| s.x1).collect();
    let index = |segments: &[Segment], x: f64| {
        let found = segments.iter().find(|s| x < s.x1).or(segments.last());
        found.map_or(Complex64::ONE, |s| s.index)
    };
    let of = |[x0, x1]: [f64; 2]| {
        let middle = 0.5 * (x0 + x1);
        let (here, there) = (index(section, middle), index(layer, middle));
        let rise = (here * here - there * there).re;
        (here != there).then_some(Strip { x0, x1, rise })
    };
    intervals_between(borders).into_iter().filter_map(of).collect()
}

/// The walls of a section at height `z`, or `None` if it is of one material.
fn walls(relief: &Relief, segments: &[Segment], z: f64) -> Option<Vec<Wall>> {
    let (first, last) = (segments.first()?, segments.last()?);
    let border = (first.index != last.index).then_some(0.0);
    let inner = segments[..segments.len() - 1].iter().map(|s| s.x1);
    let walls: Vec<Wall> = border
        .into_iter()
        .chain(inner)
        .map(|x| {
            let slope = slope(relief, x, z);
            let xx = 1.0 / (1.0 + slope * slope);
            Wall { x, xx, xz: -slope * xx }
        })
        .collect();
    (walls.len() > 1).then_some(walls)
}

/// dx/dz of the side that makes the border at `x` (a fraction of the period) at height `z`: of the
/// last polygon painted there.
fn slope(relief: &Relief, x: f64, z: f64) -> f64 {
    let mut found = 0.0;
    for polygon in relief.polygons() {
        for (a, b) in geometry::sides(&polygon.points) {
            if (a[1] <= z) == (b[1] <= z) {
                continue;
            }
            let slope = (b[0] - a[0]) / (b[1] - a[1]);
            let here = (a[0] + slope * (z - a[1])) / relief.period() - x;
            if (here - here.round()).abs() < AT_BORDER {
                found = slope;
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relief::Polygon;

    #[test]
    fn sections_stand_for_the_whole_height_from_the_bottom_up() {
        let tooth = Polygon {
            index: Complex64::from(1.41),
            points: vec![[0.2, 0.0], [2.9, 0.0], [2.2, 1.2], [0.5, 0.7]],
        };
        let relief = Relief::new(3.0, 1.5, Complex64::from(1.0), vec![tooth]).unwrap();
        let layers = layers(&relief, &relief.slice_plan(9));
        let whole: f64 = layers.iter().map(|(layer, _)| layer.thickness).sum();
        assert!((whole - 1.5).abs() < 1e-12);
        let mut z = 0.0;
        let mut heights = 0.0;
        for (layer, wall_corrections) in &layers {
            assert!(wall_corrections.is_sorted_by(|a, b| a.place < b.place));
            for correction in wall_corrections {
                // Counted from the bottom of the layer, which is at the larger z.
                let at = z + (1.0 - correction.place) * layer.thickness;
                let expected = relief.layer_at(at);
                assert_eq!(correction.segments.len(), expected.len());
                for (a, b) in correction.segments.iter().zip(&expected) {
                    assert!((a.x1 - b.x1).abs() < 1e-12 && a.index == b.index, "{at}");
                }
                heights += correction.height;
            }
            z += layer.thickness;
        }
        // Below 1.2 there is nothing.
        assert!((heights - 1.2).abs() < 1e-12, "{heights}");
    }
}
