// SPDX-License-Identifier: MIT OR Apache-2.0
//! Hazy faces: stated haze by another quadrature and by draws, shares, widths in both media.

use super::*;
use crate::direction::spherical;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

fn from(theta_deg: f64) -> DVec3 {
    spherical(theta_deg.to_radians(), 0.4)
}

/// A face that transmits 0.8 of the light, with this haze, into air.
fn face(haze: f64, width_deg: f64, index: f64) -> HazyFace {
    let lobe = GaussianLobe::new(width_deg).unwrap();
    let scattered = haze / lobe.share_beyond(HAZE_DEG);
    HazyFace::new([0.15, 0.8], (scattered, lobe), [index, 1.0]).unwrap()
}

/// By the midpoint rule over the density of what is transmitted.
#[test]
fn haze_is_the_share_beyond_the_angle() {
    for (haze, width) in [(0.5, 20.0), (0.9, 60.0), (0.02, 3.0), (0.3, 180.0)] {
        let face = face(haze, width, 1.5);
        let wi = -DVec3::Z;
        let from = HAZE_DEG.to_radians();
        let count = 20_000;
        let step = (0.5 * std::f64::consts::PI - from) / f64::from(count);
        let beyond: f64 = (0..count)
            .map(|k| from + step * (f64::from(k) + 0.5))
            .map(|theta| {
                let lobe = Lobe { transport: Transport::Transmission, kind: LobeKind::Gaussian };
                let sample = BsdfSample { wo: spherical(theta, 1.0), weight: 1.0, lobe };
                0.95 * face.pdf(wi, &sample).unwrap() * TAU * theta.sin() * step
            })
            .sum();
        assert_relative_eq!(beyond / 0.8, haze, max_relative = 1e-4);
    }
}

#[test]
fn draws_have_the_stated_shares() {
    let mut rng = Pcg64::seed_from_u64(5);
    let face = face(0.4, 15.0, 1.6);
    let count = 100_000;
    let (mut transmitted, mut beyond) = (0.0, 0.0);
    for _ in 0..count {
        let sample = face.sample(-DVec3::Z, &mut rng).unwrap();
        assert_abs_diff_eq!(sample.weight, 0.95, epsilon = 1e-12);
        assert!(face.pdf(-DVec3::Z, &sample).unwrap() > 0.0);
        if sample.lobe.transport == Transport::Transmission {
            transmitted += 1.0;
            beyond += f64::from(u8::from(sample.wo.z < HAZE_DEG.to_radians().cos()));
        } else {
            assert_eq!(sample.wo, -DVec3::Z);
        }
    }
    for (found, of, expected) in
        [(transmitted, f64::from(count), 0.8 / 0.95), (beyond, transmitted, 0.4)]
    {
        let error = (expected * (1.0 - expected) / of).sqrt();
        assert!((found / of - expected).abs() < 4.5 * error, "{found} of {of} for {expected}");
    }
}

#[test]
fn power_is_kept_at_every_incidence() {
    let mut rng = Pcg64::seed_from_u64(6);
    let face = face(0.4, 15.0, 1.6);
    for theta in [0.0, 30.0, 60.0, 89.9, 91.0, 120.0, 150.0, 180.0] {
        let wi = from(theta);
        let albedo = face.albedo(wi, Polarisation::Unpolarised);
        assert_abs_diff_eq!(albedo.total(), 0.95, epsilon = 1e-12);
        let is_total = theta > 90.0 && 1.6 * wi.x.hypot(wi.y) > 1.0;
        assert_abs_diff_eq!(albedo.transmitted, if is_total { 0.0 } else { 0.8 }, epsilon = 1e-12);
        for _ in 0..200 {
            let sample = face.sample(wi, &mut rng).unwrap();
            let side = sample.lobe.transport.exit_side(Side::from_direction(wi));
            assert!(sample.wo.z * side.sign() > 0.0 && face.pdf(wi, &sample).unwrap() > 0.0);
        }
    }
}

/// Of a narrow lobe exp(-θ²/(2σ²)) lies beyond θ, and the lobe of a share has it.
#[test]
fn lobes_follow_from_the_share_beyond_an_angle() {
    let narrow = GaussianLobe::new(3.0).unwrap();
    let ratio = HAZE_DEG.to_radians() / narrow.standard_deviation();
    assert_relative_eq!(
        narrow.share_beyond(HAZE_DEG),
        (-0.5 * ratio * ratio).exp(),
        max_relative = 2e-3
    );
    for share in [1e-6, 0.01, 0.5, 0.95, 0.998] {
        let lobe = GaussianLobe::with_share_beyond(HAZE_DEG, share);
        assert_relative_eq!(lobe.share_beyond(HAZE_DEG), share, max_relative = 1e-9);
    }
    let [_, widest] = GaussianLobe::WIDTHS_DEG.map(|width| GaussianLobe::new(width).unwrap());
    let most = GaussianLobe::with_share_beyond(HAZE_DEG, 1.0);
    assert_relative_eq!(
        most.standard_deviation(),
        widest.standard_deviation(),
        max_relative = 1e-9
    );
}

/// Light into the film and out of its smooth face has about the haze of light the other way.
#[test]
fn haze_is_about_that_of_the_sheet_turned_over() {
    let mut rng = Pcg64::seed_from_u64(7);
    let face = face(0.4, 8.0, 1.6);
    let (mut transmitted, mut beyond) = (0.0, 0.0);
    for _ in 0..100_000 {
        let sample = face.sample(DVec3::Z, &mut rng).unwrap();
        if sample.lobe.transport == Transport::Transmission {
            transmitted += 1.0;
            let out = 1.6 * sample.wo.x.hypot(sample.wo.y);
            beyond += f64::from(u8::from(out > HAZE_DEG.to_radians().sin()));
        }
    }
    assert!((beyond / transmitted - 0.4_f64).abs() < 0.01, "{beyond} of {transmitted}");
}

#[test]
fn shares_above_one_are_refused() {
    let lobe = GaussianLobe::new(10.0).unwrap();
    for (shares, scattered) in [([0.5, 0.6], 0.5), ([0.1, 0.5], 1.1), ([-0.1, 0.5], 0.1)] {
        assert!(HazyFace::new(shares, (scattered, lobe), [1.5, 1.0]).is_err());
    }
}
