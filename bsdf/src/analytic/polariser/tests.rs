// SPDX-License-Identifier: MIT OR Apache-2.0
//! The polariser against Malus, Yeh's leak of crossed sheets, and a mirror.

use std::f64::consts::PI;

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::*;
use crate::direction::spherical;

const AIR: [f64; 2] = [1.0, 1.0];

fn shares(transmittance: f64, reflectance: f64) -> AxisShares {
    AxisShares::new(&[[0.0, transmittance]], &[[0.0, reflectance]]).unwrap()
}

fn absorbing(angle: f64) -> Polariser {
    Polariser::new([shares(1.0, 0.0), shares(0.0, 0.0)], angle, AIR).unwrap()
}

/// Share of light from `wi` that a sheet transmits, and the light behind it.
fn through(sheet: &Polariser, wi: DVec3, light: [f64; 3]) -> (f64, [f64; 3]) {
    let mut rng = Pcg64::seed_from_u64(1);
    let drawn = sheet.sample_polarised(wi, light, &mut rng);
    drawn.map_or((0.0, light), |(sample, light)| (sample.weight, light))
}

#[test]
fn two_sheets_follow_malus_and_leak_where_yeh_says() {
    for degrees in [0.0_f64, 20.0, 45.0, 77.0, 90.0] {
        let (first, second) = (absorbing(0.3), absorbing(0.3 + degrees.to_radians()));
        let wi = DVec3::NEG_Z;
        let (half, light) = through(&first, wi, [0.0; 3]);
        let (share, _) = through(&second, wi, light);
        assert!((half - 0.5).abs() < 1e-15);
        assert!((share - degrees.to_radians().cos().powi(2)).abs() < 1e-14, "{degrees}: {share}");
    }
    let crossed = [absorbing(0.0), absorbing(0.5 * PI)];
    for (theta, phi) in [(0.7, 0.0), (0.7, PI / 4.0), (1.2, 1.0), (1.5, 0.6)] {
        let wi = spherical(PI - theta, phi);
        let (first, light) = through(&crossed[0], wi, [0.0; 3]);
        let (second, _) = through(&crossed[1], wi, light);
        let [x2, y2] = [wi.x * wi.x, wi.y * wi.y];
        let leak = 0.5 * x2 * y2 / ((1.0 - x2) * (1.0 - y2));
        assert!((first * second - leak).abs() < 1e-14, "{theta} {phi}: {}", first * second);
    }
}

#[test]
fn a_sheet_that_reflects_both_axes_is_a_mirror() {
    let mirror = Polariser::new([shares(0.0, 1.0), shares(0.0, 1.0)], 0.4, AIR).unwrap();
    let mut rng = Pcg64::seed_from_u64(2);
    for (theta, phi) in [(3.0, 0.1), (2.2, 1.9), (0.8, 4.0), (PI, 0.0)] {
        let wi = spherical(theta, phi);
        let light = [0.5, 0.5, 0.5_f64.sqrt()];
        let (sample, after) = mirror.sample_polarised(wi, light, &mut rng).unwrap();
        assert_eq!(sample.wo, mirrored(wi));
        // Amplitudes -1 and 1 of s and p.
        for (found, expected) in after.into_iter().zip([light[0], -light[1], -light[2]]) {
            assert!((found - expected).abs() < 1e-12, "{after:?}");
        }
    }
}

#[test]
fn a_sheet_without_effect_leaves_light_alone() {
    let clear = Polariser::new([shares(1.0, 0.0), shares(1.0, 0.0)], 1.1, AIR).unwrap();
    let light = [0.5, -0.5, 0.5_f64.sqrt()];
    for wi in [spherical(2.5, 0.3), spherical(0.4, 5.0), DVec3::Z] {
        let (share, after) = through(&clear, wi, light);
        assert!((share - 1.0).abs() < 1e-15);
        assert!(after.iter().zip(light).all(|(a, b)| (a - b).abs() < 1e-12), "{after:?}");
    }
}

/// Angles count in the medium of the lower index; beyond the critical angle nothing gets through.
#[test]
fn angles_are_those_in_air() {
    let falling = AxisShares::new(&[[0.0, 0.9], [60.0, 0.3]], &[[0.0, 0.1]]).unwrap();
    let sheet = Polariser::of_unpolarised(&falling, [1.5, 1.0]).unwrap();
    let of = |wi: DVec3| sheet.albedo(wi, Polarisation::Unpolarised);
    let outside = spherical(40.0_f64.to_radians(), 0.2);
    let inside = DVec3::new(-outside.x / 1.5, -outside.y / 1.5, 0.0);
    let inside = inside - DVec3::Z * (1.0 - inside.length_squared()).sqrt();
    for wi in [outside, inside] {
        assert!((of(wi).transmitted - 0.5).abs() < 1e-12, "{:?}", of(wi));
        assert!((of(wi).reflected - 0.1).abs() < 1e-12);
    }
    let beyond = of(spherical(PI - 60.0_f64.to_radians(), 0.0));
    assert!(beyond.transmitted == 0.0 && (beyond.reflected - 0.4).abs() < 1e-12);
    assert!(sheet.as_polarised().is_none());
}

#[test]
fn shares_that_gain_are_refused() {
    assert!(AxisShares::new(&[[0.0, 0.5], [90.0, 0.9]], &[[0.0, 0.2]]).is_err());
    assert!(AxisShares::new(&[[30.0, 0.5], [10.0, 0.5]], &[[0.0, 0.2]]).is_err());
    assert!(AxisShares::new(&[[0.0, 1.5]], &[[0.0, 0.0]]).is_err());
    assert!(AxisShares::new(&[], &[[0.0, 0.0]]).is_err());
}
