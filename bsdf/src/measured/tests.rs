// SPDX-License-Identifier: MIT OR Apache-2.0
//! Measured tables reproduce their data, by sampling and as lobes.

mod sampling;

use super::*;
use crate::angular_basis::{AngularBasis, OrientedBasis};
use crate::direction::spherical;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Light at 40 degrees goes into the cells around one direction; isotropic.
fn one_lobe(tilt: f64, value: impl Fn(DVec3) -> f64, axis: Option<DVec3>) -> ScatterTable {
    let azimuths: Vec<f64> = (0..72).map(|k| f64::from(k) * 5.0).collect();
    let radials: Vec<f64> = (0..18).map(|k| 2.5 + f64::from(k) * 5.0).collect();
    let cells = Arc::new(AngularBasis::around_points(&azimuths, &radials, 90.0));
    let basis = axis.map_or_else(
        || OrientedBasis::about_normal(&cells),
        |axis| OrientedBasis::about(&cells, axis, DVec3::X),
    );
    let values: Vec<f64> = (0..cells.len()).map(|c| value(basis.centre(c))).collect();
    let wi = spherical(tilt.to_radians(), 0.0);
    let distribution = CellDistribution::new(basis, values, Some(0.6));
    ScatterTable::Grid {
        thetas: vec![tilt.to_radians()],
        phis: vec![0.0],
        nodes: vec![IncidentNode { wi, distribution }],
        end: FRAC_PI_2,
    }
}

fn phong(towards: DVec3) -> impl Fn(DVec3) -> f64 {
    move |wo| towards.dot(wo).max(0.0).powi(40)
}

#[test]
fn draws_follow_the_listed_shares() {
    let mirror = spherical(0.7, PI);
    for axis in [None, Some(mirror)] {
        let reflected = one_lobe(40.0, phong(mirror), axis);
        let passed = one_lobe(40.0, |_| 1.0, None);
        // 0.6 and half of it: 0.1 are absorbed.
        let ScatterTable::Grid { thetas, phis, nodes, end } = passed else { panic!("a grid") };
        let nodes = nodes
            .into_iter()
            .map(|n| IncidentNode { distribution: n.distribution.scaled(0.5), ..n })
            .collect();
        let passed = ScatterTable::Grid { thetas, phis, nodes, end };
        let surface = MeasuredBsdf::new(
            [1.0, 1.0],
            LobeMotion::Fixed,
            [
                (Side::Outer, Transport::Reflection, reflected),
                (Side::Outer, Transport::Transmission, passed),
            ],
        )
        .unwrap();
        let wi = spherical(0.7, 0.4);
        let lobes = surface.lobes(wi, Polarisation::Unpolarised);
        let mean = |transport: Transport| {
            lobes
                .iter()
                .filter(|l| l.lobe.transport == transport)
                .fold(DVec3::ZERO, |sum, l| sum + l.wo * l.power)
        };
        let (count, mut rng) = (100_000, Pcg64::seed_from_u64(8));
        let (mut sums, mut squares, mut absorbed) = ([DVec3::ZERO; 2], DVec3::ZERO, 0);
        let mut inverse_density = 0.0;
        for _ in 0..count {
            let Some(sample) = surface.sample(wi, &mut rng) else {
                absorbed += 1;
                continue;
            };
            assert!((sample.wo.length() - 1.0).abs() < 1e-9);
            assert_eq!(
                Side::from_direction(sample.wo) == Side::Outer,
                sample.lobe.transport == Transport::Reflection
            );
            sums[sample.lobe.transport.index()] += sample.wo;
            squares += sample.wo * sample.wo;
            let pdf = surface.pdf(wi, &sample).unwrap();
            if sample.lobe.transport == Transport::Transmission {
                inverse_density += 1.0 / pdf;
            }
        }
        let n = f64::from(count);
        let error = 1.0 / n.sqrt();
        assert!((f64::from(absorbed) / n - 0.1).abs() < 5.0 * 0.3 * error);
        for transport in Transport::BOTH {
            // Middles of cells stand for cells 5 degrees wide: their means differ by up to 0.001.
            let off = (sums[transport.index()] / n - mean(transport)).length();
            assert!(off < 5.0 * error + 2e-3, "{transport:?} {off}");
        }
        assert!(squares.length() > 0.0);
        // The mean of 1/pdf over what is drawn is the solid angle it is drawn in; its variance is
        // large at the rim.
        assert!((inverse_density / n / (2.0 * PI) - 1.0).abs() < 0.1, "{inverse_density}");
    }
}

#[test]
fn a_shifted_mirror_lobe_follows_the_law_of_reflection() {
    let mirror = spherical(40_f64.to_radians(), PI);
    let reflected = one_lobe(40.0, phong(mirror), Some(mirror));
    let surface = |between| {
        let response = (Side::Inner, Transport::Reflection, reflected.clone());
        MeasuredBsdf::new([1.41, 1.0], between, [response]).unwrap()
    };
    let wi = spherical(PI - 0.5, 1.0);
    let expected = DVec3::new(-wi.x, -wi.y, wi.z);
    let away = |between| {
        let lobes = surface(between).lobes(wi, Polarisation::S);
        let mean = lobes.iter().fold(DVec3::ZERO, |sum, l| sum + l.wo * l.power);
        mean.normalize().angle_between(expected)
    };
    // The table is 11.4 degrees from this incidence.
    assert!(away(LobeMotion::Fixed) > 0.15, "{}", away(LobeMotion::Fixed));
    assert!(away(LobeMotion::Shifted) < 0.03, "{}", away(LobeMotion::Shifted));
}

#[test]
fn more_power_out_than_in_is_refused_and_twice_the_same_too() {
    let response = || one_lobe(40.0, |_| 1.0, None);
    let both = |first, second| {
        let responses = [(Side::Outer, first, response()), (Side::Outer, second, response())];
        MeasuredBsdf::new([1.0, 1.0], LobeMotion::Fixed, responses).unwrap_err().to_string()
    };
    let message = both(Transport::Reflection, Transport::Transmission);
    assert!(message.contains("at 40.00 degrees") && message.contains("got 1.2"), "{message}");
    let message = both(Transport::Reflection, Transport::Reflection);
    assert!(message.contains("one table for each side and type"), "{message}");
}

/// Transmission of light from the outer side, 0.3 of it, more at some azimuths than at others.
fn passing(turns: bool) -> ScatterTable {
    let degrees = |n: u32, step: f64| (0..n).map(move |k| f64::from(k) * step);
    let azimuths: Vec<f64> = degrees(36, 10.0).collect();
    let radials: Vec<f64> = degrees(19, 5.0).collect();
    let cells = Arc::new(AngularBasis::around_points(&azimuths, &radials, 90.0));
    let basis = OrientedBasis::about_normal(&cells);
    let thetas: Vec<f64> = degrees(19, 5.0).map(|t| t.min(89.0).to_radians()).collect();
    let phis: Vec<f64> = degrees(if turns { 1 } else { 12 }, 30.0).map(f64::to_radians).collect();
    let node = |theta: f64, phi: f64| {
        let wi = spherical(theta, phi);
        let value = |cell: usize| {
            let wo = cells.centre(cell);
            let along = 1.0 + 0.5 * (wi.x * wo.x + wi.y * wo.y) + 0.3 * wi.z;
            0.06 * along * if turns { 1.0 } else { 1.0 + 0.2 * wo.x + 0.1 * wi.y }
        };
        let values: Vec<f64> = (0..cells.len()).map(value).collect();
        IncidentNode { wi, distribution: CellDistribution::new(basis.clone(), values, None) }
    };
    let nodes = thetas.iter().flat_map(|t| phis.iter().map(|p| node(*t, *p))).collect();
    ScatterTable::Grid { thetas, phis, nodes, end: FRAC_PI_2 }
}

#[test]
fn transmission_of_one_side_gives_that_of_the_other() {
    for turns in [true, false] {
        let given = [(Side::Outer, Transport::Transmission, passing(turns))];
        let indices = [1.5, 1.0];
        let surface = MeasuredBsdf::new(indices, LobeMotion::Fixed, given).unwrap();
        let albedo = |s: &MeasuredBsdf, wi| s.albedo(wi, Polarisation::Unpolarised).transmitted;
        let inside = -spherical(0.3, 1.0);
        assert_eq!((albedo(&surface, inside), surface.derived()), (0.0, None));
        let surface = surface.reciprocal();
        assert_eq!(surface.derived(), Some(Side::Inner));
        let lobe = Lobe { transport: Transport::Transmission, kind: LobeKind::Cell };
        // BTDF of light from `wi`.
        let value = |wi: DVec3, wo: DVec3| {
            surface.pdf(wi, &BsdfSample { wo, weight: 1.0, lobe }).unwrap() / wo.z.abs()
        };
        for k in 0..40 {
            let angle = f64::from(k);
            let a = spherical(0.03 * angle, 0.7 * angle);
            let b = -spherical(0.02 * angle + 0.1, 1.1 * angle);
            let (there, back) = (value(a, b), value(b, a));
            // f(a → b)/n_b² = f(b → a)/n_a², but for cells of 5 and 10 degrees.
            let expected = there / 2.25;
            assert!((back / expected - 1.0).abs() < 0.12, "{turns} {k}: {back} {expected}");
        }
        // The étendue that passes is the same both ways.
        let mean = |sign: f64| {
            let at = |k: u32| (f64::from(k) + 0.5) / 40.0;
            let points = (0..40).flat_map(|i| (0..40).map(move |k| (at(i), at(k))));
            let direction = |(u, v): (f64, f64)| sign * spherical(u.sqrt().asin(), 2.0 * PI * v);
            points.map(|p| albedo(&surface, direction(p))).sum::<f64>() / 1600.0
        };
        let [out, inner] = [mean(1.0), mean(-1.0)];
        assert!((2.25 * inner / out - 1.0).abs() < 5e-3, "{turns}: {out} {inner}");
    }
}
