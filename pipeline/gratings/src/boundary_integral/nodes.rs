// SPDX-License-Identifier: MIT OR Apache-2.0
//! Quadrature on the surface: nodes graded towards corners, and weights for a logarithmic kernel.
//!
//! In: an outline and how fine. Out: nodes at equal steps of a parameter s, 0 ≤ s < 2π for one
//! period. On a straight side the place is a polynomial-like function of s whose first derivatives
//! vanish at both corners, so that all that is integrated is smooth and periodic in s and the
//! trapezoidal rule converges fast, whatever happens at the corner; on a smooth surface it
//! converges exponentially. A kernel a(s,t) ln(4 sin²((s-t)/2)) is integrated with weights of its
//! own, exact for trigonometric polynomials \[Kress1990\].
//!
//! Nodes next to a corner lie within 1e-20 of it. Their places are kept relative to the corner, so
//! that distances across a corner keep all digits.

use super::error::IntegralError;
use super::outline::{Outline, Shape, height};
use super::sides::following;
use full_wave::Curve;
use std::f64::consts::{PI, TAU};

/// More nodes than any limit, of which sums do not overflow.
const COUNTLESS: f64 = 1e12;
/// Corners that turn by this, in radians, get all their nodes, others fewer, down to this share.
const SHARP: f64 = PI / 4.0;
const LEAST_SHARE: f64 = 0.4;

/// How finely the surface is resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Nodes per wavelength of the denser medium where they are sparsest, in the middle of a side;
    /// above 4.
    pub per_wavelength: f64,
    /// Nodes on every side beyond that, for its two corners, fewer at blunt ones; twice as many on a
    /// smooth surface.
    pub at_corners: usize,
    /// How strongly nodes crowd at corners: places near one go as the `grading`-th power of the
    /// parameter; 2 to 12.
    pub grading: u32,
}

impl Default for Fineness {
    fn default() -> Self {
        Self { per_wavelength: 6.0, at_corners: 60, grading: 8 }
    }
}

impl Fineness {
    /// `factor` times as many nodes.
    #[must_use]
    pub fn refined(self, factor: f64) -> Self {
        Self {
            per_wavelength: self.per_wavelength * factor,
            at_corners: (self.at_corners as f64 * factor).ceil() as usize,
            grading: self.grading,
        }
    }

    fn check(self) -> Result<(), IntegralError> {
        let range = |what, expected, got: f64, good| {
            if good { Ok(()) } else { Err(IntegralError::Fineness { what, expected, got }) }
        };
        let (dense, corners, grading) = (self.per_wavelength, self.at_corners, self.grading);
        range(
            "nodes per wavelength",
            "above 4 and finite",
            dense,
            dense > 4.0 && dense.is_finite(),
        )?;
        range("nodes at corners", "at least 10", corners as f64, corners >= 10)?;
        range("the grading", "2 to 12", grading.into(), (2..=12).contains(&grading))
    }
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Place relative to the origin `origin`, `lap` periods on.
    pub offset: [f64; 2],
    pub origin: usize,
    pub lap: i32,
    /// Number of the side between two corners.
    pub side: Option<usize>,
    /// Length per parameter, |dx/ds|.
    pub speed: f64,
    /// Unit normal, from the top medium into the bottom medium.
    pub normal: [f64; 2],
    /// normal · d²x/ds² / speed².
    pub bend: f64,
}

/// The nodes of one period.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    pub period: f64,
    pub origins: Vec<[f64; 2]>,
    pub list: Vec<Node>,
}

impl Nodes {
    /// On an outline of which lengths are multiplied by k0, with `index` that of the denser medium.
    ///
    /// # Errors
    /// A fineness out of range; more than `most` nodes.
    pub(super) fn new(
        outline: &Outline,
        index: f64,
        fineness: Fineness,
        most: usize,
    ) -> Result<Self, IntegralError> {
        fineness.check()?;
        let per_length = fineness.per_wavelength * index / TAU;
        let period = outline.period();
        match outline.shape() {
            Shape::Corners(all) => Self::graded(all, period, per_length, fineness, most),
            Shape::Fourier(all) => Self::smooth(all, period, per_length, fineness, most),
        }
    }

    fn smooth(
        coefficients: &[[f64; 2]],
        period: f64,
        per_length: f64,
        fineness: Fineness,
        most: usize,
    ) -> Result<Self, IntegralError> {
        let slope = |i: u32| height(coefficients, period, period * f64::from(i) / 1024.0)[1];
        let steepest = (0..1024).map(slope).fold(0.0, |a: f64, b| a.max(b.abs()));
        let wanted = per_length * period * steepest.hypot(1.0);
        let count =
            (wanted.min(COUNTLESS).ceil() as usize + 2 * fineness.at_corners).next_multiple_of(2);
        check_number(count, most)?;
        let stretch = period / TAU;
        let list = (0..count)
            .map(|i| {
                let x = period * (i as f64 + 0.5) / count as f64;
                let [z, dz, ddz] = height(coefficients, period, x);
                let metric = dz.hypot(1.0);
                Node {
                    offset: [x, z],
                    origin: 0,
                    lap: 0,
                    side: None,
                    speed: stretch * metric,
                    normal: [-dz / metric, 1.0 / metric],
                    bend: ddz / metric.powi(3),
                }
            })
            .collect();
        Ok(Self { period, origins: vec![[0.0; 2]], list })
    }

    fn graded(
        corners: &[([f64; 2], f64)],
        period: f64,
        per_length: f64,
        fineness: Fineness,
        most: usize,
    ) -> Result<Self, IntegralError> {
        let origins: Vec<[f64; 2]> = corners.iter().map(|corner| corner.0).collect();
        // Relative to the corner that it begins at, and seen from the other.
        let arc = |i: usize, sense: f64| {
            let (from, to) = (origins[i], following(&origins, period, i));
            let across = [sense * (to[0] - from[0]), sense * (to[1] - from[1])];
            Curve::between([0.0; 2], across, sense * corners[i].1)
        };
        let sides = corners.len();
        let length = |i: usize| arc(i, 1.0).1;
        let turn = |i: usize| {
            let (before, length) = arc((i + sides - 1) % sides, 1.0);
            let (into, out_of) = (before.tangent(length), arc(i, 1.0).0.tangent(0.0));
            (into[0] * out_of[0] + into[1] * out_of[1]).clamp(-1.0, 1.0).acos()
        };
        // Of many sides that make a curve each needs fewer nodes.
        let at_corners = |i: usize| {
            let sharpness = turn(i).max(turn((i + 1) % sides)) / SHARP;
            (fineness.at_corners as f64 * sharpness.clamp(LEAST_SHARE, 1.0)).ceil() as usize
        };
        // In the middle of a side nodes are half as dense as on average.
        let mut counts: Vec<usize> = (0..corners.len())
            .map(|i| (2.0 * per_length * length(i)).min(COUNTLESS).ceil() as usize + at_corners(i))
            .collect();
        let total: usize = counts.iter().sum();
        check_number(total, most)?;
        counts[0] += total % 2;
        let step = TAU / (total + total % 2) as f64;
        let mut list = Vec::with_capacity(total + 1);
        for (side, &count) in counts.iter().enumerate() {
            let ((from_left, along), (from_right, _)) = (arc(side, 1.0), arc(side, -1.0));
            for i in 0..count {
                let (from_start, from_end, slope) = grade(
                    (i as f64 + 0.5) / count as f64,
                    (count as f64 - i as f64 - 0.5) / count as f64,
                    fineness.grading,
                );
                let last = side + 1 == corners.len();
                let (origin, lap, offset) = if 2 * i < count {
                    (side, 0, from_left.point(along * from_start))
                } else {
                    let offset = from_right.point(along * from_end);
                    if last { (0, 1, offset) } else { (side + 1, 0, offset) }
                };
                let [tx, tz] = from_left.tangent(along * from_start);
                list.push(Node {
                    offset,
                    origin,
                    lap,
                    side: Some(side),
                    speed: along * slope / (count as f64 * step),
                    normal: [-tz, tx],
                    bend: from_left.curvature,
                });
            }
        }
        Ok(Self { period, origins, list })
    }

    /// Place of a node.
    pub(super) fn place(&self, node: &Node) -> [f64; 2] {
        let origin = self.origins[node.origin];
        [origin[0] + f64::from(node.lap) * self.period + node.offset[0], origin[1] + node.offset[1]]
    }

    /// From node `b`, `image` periods on, to node `a`, without cancellation near corners.
    pub(super) fn difference(&self, a: &Node, b: &Node, image: i32) -> [f64; 2] {
        let laps = f64::from(a.lap - b.lap - image) * self.period;
        let (p, q) = (self.origins[a.origin], self.origins[b.origin]);
        [
            p[0] - q[0] + laps + (a.offset[0] - b.offset[0]),
            p[1] - q[1] + (a.offset[1] - b.offset[1]),
        ]
    }

    /// Smallest and largest x and z.
    pub(super) fn extent(&self) -> ([f64; 2], [f64; 2]) {
        self.list.iter().map(|n| self.place(n)).fold(
            ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]),
            |(low, high), p| {
                ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])])
            },
        )
    }
}

/// # Errors
/// More than `most` nodes.
fn check_number(nodes: usize, most: usize) -> Result<(), IntegralError> {
    if nodes > most { Err(IntegralError::TooLarge { nodes, most }) } else { Ok(()) }
}

/// Kress's grading w = v^p/(v^p + v̄^p) at a share `t` of a side, `rest` = 1 - t: w, 1 - w and
/// dw/dt. v is the cubic with v(0) = 0, v(1) = 1 and such a slope that dw/dt = 2 in the middle.
fn grade(t: f64, rest: f64, p: u32) -> (f64, f64, f64) {
    let order = f64::from(p);
    let bent = 1.0 / order - 0.5;
    let v = |t: f64| t * (3.0 - 4.0 / order + bent * (12.0 - 8.0 * t) * t);
    let dv = |t: f64| 3.0 - 4.0 / order + bent * (24.0 - 24.0 * t) * t;
    let (near, far) = (v(t), v(rest));
    let power = p as i32;
    let (a, b) = (near.powi(power), far.powi(power));
    let slope =
        order * (near * far).powi(power - 1) * (dv(t) * far + near * dv(rest)) / (a + b).powi(2);
    (a / (a + b), b / (a + b), slope)
}

/// R_0 .. R_{N-1} with ∫ ln(4 sin²((s_i - t)/2)) f(t) dt = Σ_j R_{|i-j|} f(s_j) over 2π for
/// trigonometric polynomials f of degree below N/2 (N even), at nodes a step 2π/N apart.
pub(super) fn logarithmic_weights(count: usize) -> Vec<f64> {
    let half = count / 2;
    let cosines: Vec<f64> = (0..count).map(|i| (TAU * i as f64 / count as f64).cos()).collect();
    (0..count)
        .map(|j| {
            let sum: f64 = (1..half).map(|m| cosines[m * j % count] / m as f64).sum();
            let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
            -(TAU / half as f64) * sum - sign * PI / (half * half) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_integrate_the_logarithm_times_a_wave() {
        // ∫ ln(4 sin²(t/2)) cos(mt) dt over 2π is -2π/m, and 0 for m = 0.
        let weights = logarithmic_weights(24);
        for m in 0..12_u32 {
            let sum: f64 = (0..24_u32)
                .map(|j| weights[j as usize] * (TAU * f64::from(m * j) / 24.0).cos())
                .sum();
            let expected = if m == 0 { 0.0 } else { -TAU / f64::from(m) };
            assert!((sum - expected).abs() < 1e-13, "m = {m}: {sum} and {expected}");
        }
    }

    #[test]
    fn graded_nodes_cover_every_side_and_keep_distances_across_a_corner() {
        let outline = Outline::corners(10.0, &[[0.0, 0.0], [7.0, 3.0]]).expect("an outline");
        let nodes = Nodes::new(&outline, 1.41, Fineness::default(), 1000).expect("nodes");
        let step = TAU / nodes.list.len() as f64;
        for (side, length) in [58_f64.sqrt(), 18_f64.sqrt()].into_iter().enumerate() {
            let of_side = nodes.list.iter().filter(|n| n.side == Some(side));
            let sum: f64 = of_side.map(|n| n.speed * step).sum();
            assert!((sum - length).abs() < 1e-12, "side {side}: {sum} and {length}");
        }
        // The last node of the period and the first of the next lie around the corner at x = 10.
        let (first, last) = (&nodes.list[0], &nodes.list[nodes.list.len() - 1]);
        let [dx, dz] = nodes.difference(first, last, -1);
        let (ex, ez) = (first.offset[0] - last.offset[0], first.offset[1] - last.offset[1]);
        assert!(dx.hypot(dz) < 1e-12 && (dx - ex).hypot(dz - ez) == 0.0, "{dx:e} {dz:e}");
    }
}
