// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests of sampling: lobes against their powers, directions against a density.
//!
//! Cells with fewer than 5 expected samples are pooled. The probability of a chi-square at least as
//! large is the regularised upper incomplete gamma function Q(dof/2, chi²/2). A family of m tests
//! at level α uses 1 - (1 - α)^(1/m) for each (Šidák).

use crate::angular_basis::AngularBasis;
use crate::bsdf::{Bsdf, BsdfSample, OutgoingLobe, Polarisation};
use crate::direction::Side;
use glam::DVec3;
use rand::RngExt;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Patches of a hemisphere: rings even in θ, 3.75 degrees wide, and sectors of 7.5 degrees.
const PATCHES: [usize; 2] = [24, 48];
/// Points of a patch in θ and in azimuth for the integral of its probability: cell borders
/// within it are off by half a point.
const POINTS: [usize; 2] = [12, 60];

/// Level of a test in a family of `tests` at overall level 0.01.
pub(crate) fn sidak_level(tests: usize) -> f64 {
    1.0 - (1.0_f64 - 0.01).powf(1.0 / tests as f64)
}

/// Result of a chi-square test of lobes.
pub(crate) struct LobeTest {
    /// Probability of a deviation at least as large, if the powers are right.
    pub p_value: f64,
    /// Samples in unlisted directions, pooled with the rarest lobes.
    pub unlisted: u64,
}

/// Tests [`Bsdf::sample`] against the powers of [`Bsdf::lobes`]; the rest to 1 must come out as
/// `None`.
pub(crate) fn test_lobes(
    surface: &impl Bsdf,
    wi: DVec3,
    draws: usize,
    rng: &mut dyn rand::Rng,
) -> LobeTest {
    // Lobes in one direction are indistinguishable.
    let mut lobes: Vec<OutgoingLobe> = Vec::new();
    for lobe in surface.lobes(wi, Polarisation::Unpolarised) {
        match lobes.iter_mut().find(|l| (l.wo - lobe.wo).length() < 1e-7) {
            Some(same) => same.power += lobe.power,
            None => lobes.push(lobe),
        }
    }
    let mut counts = vec![0_u64; lobes.len() + 1];
    let mut unlisted = 0;
    for _ in 0..draws {
        let cell = surface.sample(wi, rng).map_or(Some(lobes.len()), |sample| {
            let side = Side::from_direction(sample.wo);
            lobes.iter().position(|l| {
                Side::from_direction(l.wo) == side && (l.wo - sample.wo).length() < 1e-7
            })
        });
        match cell {
            Some(cell) => counts[cell] += 1,
            None => unlisted += 1,
        }
    }
    let absorbed = 1.0 - lobes.iter().map(|l| l.power).sum::<f64>();
    let efficiencies: Vec<f64> = lobes.iter().map(|l| l.power).chain([absorbed.max(0.0)]).collect();
    LobeTest { p_value: chi_square_p_value(&counts, unlisted, &efficiencies, draws), unlisted }
}

/// p-value of [`Bsdf::sample`] against a density of directions, in 1/sr, over [`PATCHES`] of either
/// side; the rest to 1 must come out as `None`.
pub(crate) fn density_p_value(
    surface: &dyn Bsdf,
    density: &dyn Fn(DVec3) -> f64,
    wi: DVec3,
    draws: usize,
    rng: &mut dyn rand::Rng,
) -> f64 {
    let [rings, sectors] = PATCHES;
    let patches = rings * sectors;
    let mut counts = vec![0_u64; 2 * patches + 1];
    for _ in 0..draws {
        let patch = surface.sample(wi, rng).map_or(2 * patches, |sample| {
            let wo = sample.wo;
            let fall = wo.z.abs().min(1.0).acos() / FRAC_PI_2;
            let turn = (wo.y.atan2(wo.x) / TAU).rem_euclid(1.0);
            let ring = ((fall * rings as f64) as usize).min(rings - 1);
            let sector = ((turn * sectors as f64) as usize).min(sectors - 1);
            Side::from_direction(wo).index() * patches + ring * sectors + sector
        });
        counts[patch] += 1;
    }
    // Midpoints in (θ, φ), of which dΩ is sin θ times the product.
    let probability = |side: Side, ring: usize, sector: usize| {
        let part = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        let [inwards, around] = POINTS;
        let points = (0..inwards).flat_map(|i| (0..around).map(move |j| (i, j)));
        let sum: f64 = points
            .map(|(i, j)| {
                let theta = FRAC_PI_2 * (ring as f64 + part(i, inwards)) / rings as f64;
                let phi = TAU * (sector as f64 + part(j, around)) / sectors as f64;
                let (r, z) = (theta.sin(), theta.cos() * side.sign());
                r * density(DVec3::new(r * phi.cos(), r * phi.sin(), z))
            })
            .sum();
        sum * FRAC_PI_2 * TAU / (rings * sectors * inwards * around) as f64
    };
    let mut efficiencies: Vec<f64> = Side::BOTH
        .into_iter()
        .flat_map(|side| {
            let all = (0..rings).flat_map(move |r| (0..sectors).map(move |s| (r, s)));
            all.map(move |(ring, sector)| probability(side, ring, sector))
        })
        .collect();
    efficiencies.push((1.0 - efficiencies.iter().sum::<f64>()).max(0.0));
    chi_square_p_value(&counts, 0, &efficiencies, draws)
}

/// A sampler that is wrong by a cosine: it moves every direction within its cell, uniform in solid
/// angle instead of cos θ dΩ.
pub(crate) struct WithoutCosine {
    pub surface: Arc<dyn Bsdf>,
    pub cells: AngularBasis,
}

impl Bsdf for WithoutCosine {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let mut sample = self.surface.sample(wi, rng)?;
        let upper = DVec3::new(sample.wo.x, sample.wo.y, sample.wo.z.abs());
        let cell = self.cells.locate(upper).expect("a cell of the hemisphere");
        let moved = self.cells.sample_solid_angle(cell, rng.random(), rng.random());
        sample.wo = DVec3::new(moved.x, moved.y, moved.z.copysign(sample.wo.z));
        Some(sample)
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        self.surface.pdf(wi, sample)
    }

    fn lobes(&self, wi: DVec3, polarisation: Polarisation) -> Vec<OutgoingLobe> {
        self.surface.lobes(wi, polarisation)
    }

    fn index(&self, side: Side) -> f64 {
        self.surface.index(side)
    }
}

/// p-value of counts against expected probabilities; `unlisted` counts belong to the pool of rare
/// cells.
fn chi_square_p_value(counts: &[u64], unlisted: u64, efficiencies: &[f64], draws: usize) -> f64 {
    let (mut chi2, mut cells) = (0.0, 0);
    let mut pool = (unlisted as f64, 0.0);
    let mut add = |observed: f64, expected: f64| {
        chi2 += (observed - expected).powi(2) / expected;
        cells += 1;
    };
    for (count, efficiency) in counts.iter().zip(efficiencies) {
        let (observed, expected) = (*count as f64, efficiency * draws as f64);
        if expected < 5.0 {
            pool = (pool.0 + observed, pool.1 + expected);
        } else {
            add(observed, expected);
        }
    }
    if pool.1 > 0.5 {
        add(pool.0, pool.1);
    } else if pool.0 >= 10.0 {
        return 0.0;
    }
    if cells < 2 { 1.0 } else { upper_gamma(0.5 * f64::from(cells - 1), 0.5 * chi2) }
}

/// Regularised upper incomplete gamma function Q(a, x).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // Series of the lower function.
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > 1e-16 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - scale * sum
    } else {
        // Continued fraction from its far end.
        let mut fraction = 0.0;
        for n in (1..2000).rev() {
            let n = f64::from(n);
            fraction = n * (n - a) / (x + 2.0 * n + 1.0 - a - fraction);
        }
        scale / (x + 1.0 - a - fraction)
    }
}

/// ln Γ by Stirling's series, after a shift of the argument to 15 or more.
fn ln_gamma(mut a: f64) -> f64 {
    let mut shift = 0.0;
    while a < 15.0 {
        shift -= a.ln();
        a += 1.0;
    }
    let inverse = 1.0 / a;
    let i2 = inverse * inverse;
    let series = inverse * (1.0 / 12.0 - i2 * (1.0 / 360.0 - i2 * (1.0 / 1260.0 - i2 / 1680.0)));
    shift + (a - 0.5) * a.ln() - a + 0.5 * std::f64::consts::TAU.ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn tail_of_chi_square_agrees_with_closed_forms() {
        // Two degrees of freedom: exp(-x/2). Four: (1 + x/2) exp(-x/2).
        for x in [0.1_f64, 1.0, 5.0, 20.0, 60.0] {
            assert_relative_eq!(upper_gamma(1.0, 0.5 * x), (-0.5 * x).exp(), max_relative = 1e-12);
            assert_relative_eq!(
                upper_gamma(2.0, 0.5 * x),
                (1.0 + 0.5 * x) * (-0.5 * x).exp(),
                max_relative = 1e-11
            );
        }
        assert_relative_eq!(ln_gamma(0.5), std::f64::consts::PI.sqrt().ln(), max_relative = 1e-13);
    }

    #[test]
    fn wrong_shares_are_found_out() {
        assert!(chi_square_p_value(&[500, 500], 0, &[0.5, 0.5], 1000) > 0.99);
        assert!(chi_square_p_value(&[600, 400], 0, &[0.5, 0.5], 1000) < 1e-9);
        assert!(chi_square_p_value(&[500, 480], 20, &[0.5, 0.5], 1000) < 1e-9);
    }
}
