// SPDX-License-Identifier: MIT OR Apache-2.0
//! Kernels of Müller's equations between a target and a source point, and their logarithmic parts.
//!
//! With G_k(x, y) = (i/4) H0(kr), d = x - y and r = |d|, every kernel is linear in H0(kr) and in
//! A(kr) = kr H1(kr) + 2i/π, whose singular part is taken away: what the two media share cancels
//! exactly, not by subtraction of large numbers. The part that multiplies log r is the same
//! expression of (2i/π) J0 and (2i/π) kr J1.

#![expect(clippy::inline_always, reason = "compiled for the instructions that were found")]

use crate::bessel::{
    ASYMPTOTIC_FROM, Bessel, EULER, FEW_TERMS, FEW_TERMS_FROM, FEWEST_TERMS, FEWEST_TERMS_FROM,
    TERMS,
};
use crate::quadrature::{NODES, PerNode};
use num_complex::Complex64;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI, PI};

/// From here on A(z) is computed from H1, below by its power series.
const SERIES_BELOW: f64 = 1.0;

/// Indices and weights of the transmission conditions; lengths are multiplied by k0, so that a
/// wavenumber is an index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Media {
    /// Index inside and outside.
    pub index: [f64; 2],
    /// The normal derivative of the field is this times the second density: 1 in TE, n² in TM.
    pub weight: [f64; 2],
}

impl Media {
    /// Factor of the second equation, so that its diagonal is 1.
    #[inline(always)]
    pub fn second(&self) -> f64 {
        2.0 / (self.weight[0] + self.weight[1])
    }
}

/// H0 and A at one argument, or their factors of log r.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Radial {
    pub h: Complex64,
    pub a: Complex64,
}

/// Returns the functions at z = kr and their factors of log r.
pub(crate) fn radial(z: f64) -> (Radial, Radial) {
    let (j0, z_j1, y0, z_y1) = if z < SERIES_BELOW {
        series(z)
    } else {
        let Bessel { j0, j1, y0, y1 } = Bessel::at(z);
        (j0, z * j1, y0, z * y1 + FRAC_2_PI)
    };
    let log = |j: f64| Complex64::new(0.0, FRAC_2_PI * j);
    (
        Radial { h: Complex64::new(j0, y0), a: Complex64::new(z_j1, z_y1) },
        Radial { h: log(j0), a: log(z_j1) },
    )
}

/// J0, z J1, Y0 and z Y1 + 2/π by their power series \[DLMF 10.2.2, 10.8.1, 10.8.2\].
fn series(z: f64) -> (f64, f64, f64, f64) {
    let q = 0.25 * z * z;
    let log = (0.5 * z).ln();
    // term = (-q)^m / (m!)²; harmonic = 1 + ... + 1/m.
    let (mut term, mut harmonic) = (1.0, 0.0);
    let (mut j0, mut j1, mut y0, mut y1) = (0.0, 0.0, 0.0, 0.0);
    let mut m = 0.0;
    loop {
        let lower = term / (m + 1.0);
        j0 += term;
        j1 += lower;
        y0 -= harmonic * term;
        y1 += (2.0 * (harmonic - EULER) + 1.0 / (m + 1.0)) * lower;
        m += 1.0;
        term *= -q / (m * m);
        harmonic += 1.0 / m;
        if term.abs() < 1e-18 {
            break;
        }
    }
    let z_j1 = 2.0 * q * j1;
    (
        j0,
        z_j1,
        FRAC_2_PI * ((log + EULER) * j0 + y0),
        FRAC_2_PI * log * z_j1 - 2.0 * q * FRAC_1_PI * y1,
    )
}

/// Place of a target relative to a source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Distance.
    pub r: f64,
    /// n(y)·d / r².
    pub source: f64,
    /// n(x)·d / r².
    pub target: f64,
    /// n(x)·n(y).
    pub normals: f64,
}

impl Pair {
    /// Two points anywhere.
    pub fn apart(x: [f64; 2], nx: [f64; 2], y: [f64; 2], ny: [f64; 2]) -> Self {
        let d = [x[0] - y[0], x[1] - y[1]];
        let r2 = d[0] * d[0] + d[1] * d[1];
        Self {
            r: r2.sqrt(),
            source: (ny[0] * d[0] + ny[1] * d[1]) / r2,
            target: (nx[0] * d[0] + nx[1] * d[1]) / r2,
            normals: nx[0] * ny[0] + nx[1] * ny[1],
        }
    }

    /// Two points of one line or arc, `along` apart by arc length: nothing cancels.
    pub fn along(curvature: f64, along: f64) -> Self {
        Self {
            r: along.abs() * sinc(0.5 * curvature * along),
            source: -0.5 * curvature,
            target: 0.5 * curvature,
            normals: (curvature * along).cos(),
        }
    }
}

/// sin(x)/x.
pub(crate) fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

/// Kernels of the two equations (rows) for the field and its derivative (columns).
pub(crate) type Entry = [[Complex64; 2]; 2];

/// Returns the kernels from the functions of the two media. `constant` is 2i/π for the kernels
/// themselves and 0 for their logarithmic part.
#[inline(always)]
fn entry(media: &Media, pair: &Pair, waves: [Radial; 2], constant: Complex64) -> Entry {
    let [inside, outside] = waves;
    let [w1, w2] = media.weight;
    let quarter = Complex64::new(0.0, 0.25);
    let r2 = pair.r * pair.r;
    let a = inside.a - outside.a;
    // z² H2 + 4i/π = 2 A - z² H0.
    let z2_inside = media.index[0] * media.index[0] * r2;
    let z2_outside = media.index[1] * media.index[1] * r2;
    let b = 2.0 * a - z2_inside * inside.h + z2_outside * outside.h;
    let second = quarter * media.second();
    [
        [quarter * a * pair.source, -quarter * (w1 * inside.h - w2 * outside.h)],
        [
            second * (pair.normals * a / r2 - b * pair.target * pair.source),
            second * (w1 * (inside.a - constant) - w2 * (outside.a - constant)) * pair.target,
        ],
    ]
}

/// Returns the kernels at two different points, and their factors of log r.
pub(crate) fn kernels(media: &Media, pair: &Pair) -> (Entry, Entry) {
    let [inside, outside] = media.index.map(|index| radial(index * pair.r));
    (
        entry(media, pair, [inside.0, outside.0], Complex64::new(0.0, FRAC_2_PI)),
        entry(media, pair, [inside.1, outside.1], Complex64::ZERO),
    )
}

/// Places of the nodes of a panel relative to one point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pairs {
    r: PerNode,
    source: PerNode,
    target: PerNode,
    normals: PerNode,
}

impl Pairs {
    pub fn new(pair: impl Fn(usize) -> Pair) -> Self {
        let mut pairs = Self::default();
        for i in 0..NODES {
            let Pair { r, source, target, normals } = pair(i);
            pairs.r[i] = r;
            pairs.source[i] = source;
            pairs.target[i] = target;
            pairs.normals[i] = normals;
        }
        pairs
    }

    #[inline(always)]
    fn pair(&self, i: usize) -> Pair {
        let (r, normals) = (self.r[i], self.normals[i]);
        Pair { r, source: self.source[i], target: self.target[i], normals }
    }

    /// Least distance of the nodes.
    pub fn min_distance(&self) -> f64 {
        self.r.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Kernels at the nodes of a panel, the part real or imaginary: `[row][column][part][node]`.
pub(crate) type Entries = [[[PerNode; 2]; 2]; 2];

/// Returns the kernels of [`kernels`] at all nodes of a panel.
pub(crate) fn kernels_of_panel(media: &Media, pairs: &Pairs) -> Entries {
    let least = pairs.min_distance() * media.index[0].min(media.index[1]);
    if least >= FEWEST_TERMS_FROM {
        Arch::new().dispatch(HankelLanes::<FEWEST_TERMS> { media, pairs })
    } else if least >= FEW_TERMS_FROM {
        Arch::new().dispatch(HankelLanes::<FEW_TERMS> { media, pairs })
    } else if least >= ASYMPTOTIC_FROM {
        Arch::new().dispatch(HankelLanes::<TERMS> { media, pairs })
    } else {
        let mut entries = Entries::default();
        for i in 0..NODES {
            set_lane(&mut entries, i, &kernels(media, &pairs.pair(i)).0);
        }
        entries
    }
}

/// Kernels at the nodes of a panel by `COUNT` pairs of terms of Hankel's series: the same operations
/// lane by lane, with the widest instructions that the machine has. No bit depends on them.
struct HankelLanes<'a, const COUNT: usize> {
    media: &'a Media,
    pairs: &'a Pairs,
}

impl<const COUNT: usize> WithSimd for HankelLanes<'_, COUNT> {
    type Output = Entries;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Entries {
        let Self { media, pairs } = self;
        let mut waves = [Waves::default(); 2];
        for (waves, index) in waves.iter_mut().zip(media.index) {
            for i in 0..NODES {
                let z = index * pairs.r[i];
                let Bessel { j0, j1, y0, y1 } = Bessel::asymptotic::<COUNT>(z);
                (waves.h[0][i], waves.h[1][i]) = (j0, y0);
                (waves.a[0][i], waves.a[1][i]) = (z * j1, z * y1 + FRAC_2_PI);
            }
        }
        let constant = Complex64::new(0.0, FRAC_2_PI);
        let mut entries = Entries::default();
        for i in 0..NODES {
            let waves = [waves[0].at(i), waves[1].at(i)];
            set_lane(&mut entries, i, &entry(media, &pairs.pair(i), waves, constant));
        }
        entries
    }
}

/// H0 and A at the nodes of a panel, real and imaginary part.
#[derive(Clone, Copy, Default)]
struct Waves {
    h: [PerNode; 2],
    a: [PerNode; 2],
}

impl Waves {
    #[inline(always)]
    fn at(&self, i: usize) -> Radial {
        let complex = |parts: &[PerNode; 2]| Complex64::new(parts[0][i], parts[1][i]);
        Radial { h: complex(&self.h), a: complex(&self.a) }
    }
}

#[inline(always)]
fn set_lane(entries: &mut Entries, i: usize, entry: &Entry) {
    for row in 0..2 {
        for column in 0..2 {
            entries[row][column][0][i] = entry[row][column].re;
            entries[row][column][1][i] = entry[row][column].im;
        }
    }
}

/// Returns the limit at one point of a curve of the kernels less their logarithmic part times
/// log(r / `unit`), and the logarithmic part.
pub(crate) fn diagonal(media: &Media, curvature: f64, unit: f64) -> (Entry, Entry) {
    let [w1, w2] = media.weight;
    let quarter = Complex64::new(0.0, 0.25);
    let second = quarter * media.second();
    let h = |index: f64| Complex64::new(1.0, FRAC_2_PI * ((0.5 * index * unit).ln() + EULER));
    // A/r² and B/r² in the limit.
    let a = |index: f64| {
        let log = (0.5 * index * unit).ln() + EULER - 0.5;
        index * index * Complex64::new(0.5, log / PI)
    };
    let [h1, h2] = media.index.map(h);
    let [a1, a2] = media.index.map(a);
    let square = media.index[0].powi(2) - media.index[1].powi(2);
    let constant = Complex64::new(0.0, FRAC_2_PI);
    let log = Complex64::new(0.0, FRAC_2_PI);
    let zero = Complex64::ZERO;
    (
        [
            [zero, -quarter * (w1 * h1 - w2 * h2)],
            [second * (a1 - a2), -second * (w1 - w2) * constant * 0.5 * curvature],
        ],
        [[zero, -quarter * log * (w1 - w2)], [second * log * 0.5 * square, zero]],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_meets_the_functions() {
        for i in 1..60 {
            let z = 0.05 * f64::from(i);
            let (j0, z_j1, y0, z_y1) = series(z);
            let b = Bessel::at(z);
            for (got, expected) in
                [(j0, b.j0), (z_j1, z * b.j1), (y0, b.y0), (z_y1, z * b.y1 + FRAC_2_PI)]
            {
                assert!((got - expected).abs() < 2e-15, "z = {z}: {got:e} and {expected:e}");
            }
        }
    }

    /// A -> z²/2 + i z²/π (log(z/2) + γ - 1/2).
    #[test]
    fn the_reduced_function_is_right_to_the_last_digit_at_small_arguments() {
        for z in [1e-3, 1e-7, 1e-15_f64] {
            let got = radial(z).0.a;
            let log = (0.5 * z).ln() + EULER - 0.5;
            let expected = z * z * Complex64::new(0.5, log * FRAC_1_PI);
            assert!((got - expected).norm() < (1e-14 + z * z) * expected.norm(), "z = {z}");
        }
    }

    /// Lanes hold the kernels of each node, whatever the series and the instructions.
    #[test]
    fn lanes_are_the_kernels_of_each_node() {
        let media = Media { index: [1.41, 1.0], weight: [1.41 * 1.41, 1.0] };
        for nearest in [0.3, 20.0, 24.5, 50.0, 59.5, 280.0, 301.0, 900.0] {
            let pairs = Pairs::new(|i| {
                let x = [nearest + 0.7 * i as f64, 0.1 * i as f64];
                Pair::apart(x, [0.6, 0.8], [0.0, 0.0], [0.28, -0.96])
            });
            let lanes = kernels_of_panel(&media, &pairs);
            for i in 0..NODES {
                let alone = kernels(&media, &pairs.pair(i)).0;
                for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let parts = &lanes[row][column];
                    let lane = Complex64::new(parts[0][i], parts[1][i]);
                    assert!((lane - alone[row][column]).norm() < 1e-14, "{nearest} {i}");
                }
            }
            let few = || HankelLanes::<FEW_TERMS> { media: &media, pairs: &pairs };
            let scalar = few().with_simd(pulp::Scalar::new());
            assert_eq!(Arch::new().dispatch(few()), scalar);
        }
    }

    /// The kernels of a circle near their diagonal approach the limit.
    #[test]
    fn the_diagonal_is_the_limit() {
        let media = Media { index: [1.41, 1.0], weight: [1.41 * 1.41, 1.0] };
        let (curvature, unit) = (0.3, 0.7);
        let (limit, limit_log) = diagonal(&media, curvature, unit);
        let (near, near_log) = kernels(&media, &Pair::along(curvature, 1e-5));
        for row in 0..2 {
            for column in 0..2 {
                let log = (1e-5_f64 / unit).ln();
                let got = near[row][column] - near_log[row][column] * log;
                assert!((got - limit[row][column]).norm() < 1e-8, "{row} {column}: {got}");
                assert!((near_log[row][column] - limit_log[row][column]).norm() < 1e-8);
            }
        }
    }
}
