// SPDX-License-Identifier: MIT OR Apache-2.0
//! Layers that follow slanted sides, to fourth order in their thickness, or to second where indices differ much.
//!
//! In: a relief of real indices and a plan. Out: two layers for every slice of the plan, and with the lower one the slopes of the walls at the middle
//! of the slice, where the two meet.
//! The fields obey F' = M(z) F. Between two planes h apart they are taken through
//!
//! - exp(½h [½ M₁ + ½ M₂ + (M₂ - M₁)/√3]) exp(½h [½ M₁ + ½ M₂ - (M₂ - M₁)/√3]),
//!
//! M₁ and M₂ at the two nodes of Gauss, which is right to the fourth order \[Blanes & Moan 2006\]. M is linear in ε but for what
//! is of the order of the error, so each factor is a layer whose ε is that mean of two sections: 1.08 parts of the nearer one and -0.08 parts of the
//! other. Where walls are slanted this ε exceeds that of the materials by so much, in a strip as wide as the wall moves.

use num_complex::Complex64;

use super::layer::{between, push_merged};
use super::{Layer, Relief, Segment, SlicePlan, geometry};

/// How a slice is passed: where its two layers are cut, and what they are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rule {
    /// Distance of the two sections from the middle, in units of the slice.
    node: f64,
    /// Part of the nearer section in a layer.
    nearer: f64,
}

impl Rule {
    /// Half the distance of the two nodes of Gauss; ½ + 1/√3.
    const FOURTH: Self = Self {
        node: 0.288_675_134_594_812_87,
        nearer: 1.077_350_269_189_625_8,
    };
    const SECOND: Self = Self {
        node: 0.25,
        nearer: 1.0,
    };

    fn of(relief: &Relief) -> Self {
        let indices = || {
            let polygons = relief.polygons().iter().map(|p| p.index.re);
            polygons.chain([relief.background().re])
        };
        let low = indices().fold(f64::INFINITY, f64::min);
        let high = indices().fold(0.0, f64::max);
        let all = Self::FOURTH.nearer;
        // The least ε of a mean stays above half of that of the thinnest material.
        if all * low * low + (1.0 - all) * high * high > 0.5 * low * low {
            Self::FOURTH
        } else {
            Self::SECOND
        }
    }
}

/// Power of the thickness of slices with which they err.
pub(crate) fn order(relief: &Relief) -> i32 {
    if Rule::of(relief) == Rule::FOURTH {
        4
    } else {
        2
    }
}

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

/// The section of a relief at one height, and the normals of its walls.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Walls {
    /// What fills the period there.
    pub(crate) segments: Vec<Segment>,
    /// Where they meet, ascending: at least two, not all upright.
    pub(crate) borders: Vec<Wall>,
    /// Height that they stand for.
    pub(crate) height: f64,
}

/// The layers of `plan`, from top to bottom, with the walls that belong to their tops; `None` where a mean of two sections is no dielectric.
pub(crate) fn layers(relief: &Relief, plan: &SlicePlan) -> Option<Vec<(Layer, Option<Walls>)>> {
    let rule = Rule::of(relief);
    let mut layers = Vec::with_capacity(2 * plan.count());
    for interval in plan.intervals() {
        let thickness = (interval.z1 - interval.z0) / interval.count as f64;
        if !interval.slanted {
            let segments = relief.layer_at(0.5 * (interval.z0 + interval.z1));
            let thickness = interval.z1 - interval.z0;
            layers.push((
                Layer {
                    thickness,
                    segments,
                },
                None,
            ));
            continue;
        }
        for i in 0..interval.count {
            let at = |part: f64| interval.z0 + (i as f64 + part) * thickness;
            let (upper, lower) = (
                relief.layer_at(at(0.5 - rule.node)),
                relief.layer_at(at(0.5 + rule.node)),
            );
            let half = |nearer, farther| {
                Some(Layer {
                    thickness: 0.5 * thickness,
                    segments: blended(nearer, farther, rule.nearer)?,
                })
            };
            layers.push((half(&upper, &lower)?, None));
            layers.push((half(&lower, &upper)?, walls(relief, at(0.5), thickness)));
        }
    }
    Some(layers)
}

/// `part` of the ε of one section and the rest of the other, if that is real and positive.
fn blended(nearer: &[Segment], farther: &[Segment], part: f64) -> Option<Vec<Segment>> {
    let borders: Vec<f64> = nearer.iter().chain(farther).map(|s| s.x1).collect();
    let index = |segments: &[Segment], x: f64| {
        segments
            .iter()
            .find(|s| x < s.x1)
            .or(segments.last())
            .map(|s| s.index)
    };
    let mut blended: Vec<Segment> = Vec::with_capacity(borders.len());
    for [x0, x1] in between(borders) {
        let middle = 0.5 * (x0 + x1);
        let (a, b) = (index(nearer, middle)?, index(farther, middle)?);
        let index = if a == b {
            a
        } else {
            (part * (a * a) + (1.0 - part) * (b * b)).sqrt()
        };
        if index.im != 0.0 || index.re <= 0.0 {
            return None;
        }
        push_merged(&mut blended, Segment { x0, x1, index });
    }
    Some(blended)
}

/// The section at height `z` with its normals, which stand for a slice of some height, or `None` where all walls are upright.
fn walls(relief: &Relief, z: f64, height: f64) -> Option<Walls> {
    let segments = relief.layer_at(z);
    let (first, last) = (segments.first()?, segments.last()?);
    let border = (first.index != last.index).then_some(0.0);
    let inner = segments[..segments.len() - 1].iter().map(|s| s.x1);
    let walls: Vec<Wall> = border
        .into_iter()
        .chain(inner)
        .map(|x| {
            let slope = slope(relief, x, z);
            let xx = 1.0 / (1.0 + slope * slope);
            Wall {
                x,
                xx,
                xz: -slope * xx,
            }
        })
        .collect();
    let slanted = walls.iter().any(|w| w.xz != 0.0);
    (slanted && walls.len() > 1).then_some(Walls {
        segments,
        borders: walls,
        height,
    })
}

/// dx/dz of the side that makes the border at `x` (a fraction of the period) at height `z`: of the last polygon painted there.
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

/// Whether `relief` consists of dielectrics alone.
pub(crate) fn serves(relief: &Relief) -> bool {
    let indices = relief.polygons().iter().map(|p| p.index);
    let mut all = indices.chain([relief.background()]);
    all.all(|n: Complex64| n.im == 0.0 && n.re > 0.0)
}
