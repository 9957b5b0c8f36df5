// SPDX-License-Identifier: MIT OR Apache-2.0
//! Diffusers: shares, densities, widths, and what is refused.

use super::*;
use crate::direction::spherical;
use crate::tests::chi_square::{density_p_value, sidak_level};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use rand::SeedableRng;
use rand_pcg::Pcg64;

const WIDTHS_DEG: [f64; 7] = [0.001, 0.5, 10.0, 30.0, 60.0, 120.0, 180.0];
/// From straight to grazing, degrees.
const INCIDENCES_DEG: [f64; 6] = [0.0, 30.0, 60.0, 85.0, 89.999, 90.0];

fn gaussian(width_deg: f64) -> DiffuseLaw {
    DiffuseLaw::Gaussian(GaussianLobe::new(width_deg).unwrap())
}

/// Both lobes by one law.
fn diffuser(law: DiffuseLaw, [reflected, transmitted]: [f64; 2], index: [f64; 2]) -> Diffuser {
    let lobe = |share| DiffuseLobe { share, law };
    Diffuser::new(lobe(reflected), lobe(transmitted), index).unwrap()
}

fn from(theta_deg: f64) -> DVec3 {
    spherical(theta_deg.to_radians(), 0.4)
}

#[test]
fn shares_hold_at_every_incidence() {
    let mut rng = Pcg64::seed_from_u64(1);
    let laws = WIDTHS_DEG.map(gaussian).into_iter().chain([DiffuseLaw::Lambertian]);
    for law in laws {
        for index in [[1.0, 1.0], [1.5, 1.0], [1.0, 1.7]] {
            let surface = diffuser(law, [0.25, 0.5], index);
            for theta in INCIDENCES_DEG {
                for wi in [from(theta), from(180.0 - theta)] {
                    let albedo = surface.albedo(wi, Polarisation::S);
                    assert_abs_diff_eq!(albedo.total(), 0.75);
                    let total = albedo.transmitted <= 0.0;
                    let beyond = surface.smooth.refracted(wi).is_none();
                    assert_eq!(total, beyond && law != DiffuseLaw::Lambertian);
                    for _ in 0..50 {
                        let sample = surface.sample(wi, &mut rng).unwrap();
                        let side = sample.lobe.transport.exit_side(Side::from_direction(wi));
                        assert!(sample.wo.z * side.sign() > 0.0, "{law:?} {wi} {}", sample.wo);
                        assert!((sample.wo.length() - 1.0).abs() < 1e-14);
                        assert_abs_diff_eq!(sample.weight, 0.75);
                        assert!(surface.pdf(wi, &sample).unwrap() > 0.0);
                    }
                }
            }
        }
    }
    let dark = diffuser(DiffuseLaw::Lambertian, [0.0, 0.0], [1.0, 1.0]);
    assert!(
        dark.sample(DVec3::Z, &mut rng).is_none()
            && dark.lobes(DVec3::Z, Polarisation::S).is_empty()
    );
    let clear = diffuser(gaussian(20.0), [0.3, 0.7], [1.0, 1.0]);
    assert_abs_diff_eq!(clear.sample(DVec3::Z, &mut rng).unwrap().weight, 1.0);
}

/// The density integrates to 1: over θ, and evenly over φ about the normal.
#[test]
fn densities_integrate_to_one() {
    for width in [30.0, 60.0, 120.0, 180.0] {
        let lobe = GaussianLobe::new(width).unwrap();
        for theta in INCIDENCES_DEG {
            let axis = from(theta);
            let sectors = 3000;
            let ring = |theta: f64| {
                let around = (0..sectors).map(|k| TAU * f64::from(k) / f64::from(sectors));
                let sum: f64 = around
                    .map(|phi| {
                        let wo = spherical(theta, phi);
                        let alpha = 2.0 * (wo - axis).length().atan2((wo + axis).length());
                        lobe.gaussian(alpha)
                    })
                    .sum();
                sum * TAU / f64::from(sectors) * theta.sin()
            };
            let integral = double_exponential(0.0, FRAC_PI_2, ring);
            assert_relative_eq!(lobe.integral(axis.z), integral, max_relative = 1e-9);
            let at = lobe.pdf(axis, Side::Outer, DVec3::Z) * integral;
            assert_relative_eq!(at, lobe.gaussian(theta.to_radians()), max_relative = 1e-9);
            assert_abs_diff_eq!(lobe.pdf(axis, Side::Outer, -DVec3::Z), 0.0);
        }
    }
}

/// Narrow lobes: N = 2πσ² from the normal, half of it at grazing incidence; no draw is rarer than
/// two of five.
#[test]
fn integrals_of_lobes_have_their_limits() {
    for width in WIDTHS_DEG {
        let lobe = GaussianLobe::new(width).unwrap();
        let drawn = -TAU * lobe.variance * lobe.below_zero;
        assert!(lobe.integral(0.0) > 0.4 * drawn, "{width}");
        // By symmetry, half of the sphere.
        let whole = lobe.integral(0.0);
        let sphere = double_exponential(0.0, PI.min(9.0 * lobe.standard_deviation()), |alpha| {
            TAU * lobe.gaussian(alpha) * alpha.sin()
        });
        assert_relative_eq!(2.0 * whole, sphere, max_relative = 1e-12);
    }
    let narrow = GaussianLobe::new(0.001).unwrap();
    assert_relative_eq!(narrow.integral(1.0), TAU * narrow.variance, max_relative = 1e-9);
    assert_relative_eq!(
        narrow.standard_deviation().to_degrees(),
        0.001 / 2.354_820_045_030_949,
        max_relative = 1e-12
    );
}

/// The density of all directions from `wi`, with the integrals of its lobes taken once.
fn density(surface: &Diffuser, wi: DVec3) -> impl Fn(DVec3) -> f64 {
    let parts = surface.lobes_at(wi);
    let sum: f64 = parts.iter().map(|part| part.share).sum();
    let integrals = parts.each_ref().map(|part| match part.law {
        DiffuseLaw::Lambertian => PI,
        DiffuseLaw::Gaussian(lobe) => lobe.integral(part.axis.z.abs()),
    });
    move |wo| {
        let of = |(part, integral): (&LobeAtIncidence, f64)| {
            let shape = match part.law {
                _ if Side::from_direction(wo) != part.side => 0.0,
                DiffuseLaw::Lambertian => wo.z.abs(),
                DiffuseLaw::Gaussian(lobe) => lobe.gaussian(part.axis.angle_between(wo)),
            };
            part.share / sum * shape / integral
        };
        parts.iter().zip(integrals).map(of).sum()
    }
}

#[test]
#[ignore = "slow: 4 s"]
fn draws_follow_their_density() {
    let mut rng = Pcg64::seed_from_u64(3);
    let laws = [12.0, 40.0, 90.0, 180.0].map(gaussian).into_iter();
    let directions = [0.0, 40.0, 80.0, 89.9, 100.0, 150.0];
    let level = sidak_level(5 * directions.len());
    for law in laws.chain([DiffuseLaw::Lambertian]) {
        let surface = diffuser(law, [0.3, 0.5], [1.4, 1.0]);
        for wi in directions.map(from) {
            let density = density(&surface, wi);
            // As the trait states it.
            for _ in 0..20 {
                let sample = surface.sample(wi, &mut rng).unwrap();
                let stated = surface.pdf(wi, &sample).unwrap();
                assert_relative_eq!(stated, density(sample.wo), max_relative = 1e-9);
            }
            let p = density_p_value(&surface, &density, wi, 200_000, &mut rng);
            assert!(p > level, "{law:?} wi {wi}: p = {p}");
        }
    }
    // The lobe of another width does not pass.
    let [surface, other] = [40.0, 42.0].map(|w| diffuser(gaussian(w), [0.3, 0.5], [1.4, 1.0]));
    let wi = from(40.0);
    let p = density_p_value(&surface, &density(&other, wi), wi, 200_000, &mut rng);
    assert!(p < 1e-6, "{p}");
}

/// Of a narrow lobe half of the light lies within half of the width, and ⟨α²⟩ = 2σ².
#[test]
fn narrow_lobes_have_the_stated_width() {
    let mut rng = Pcg64::seed_from_u64(4);
    let draws = 100_000;
    for (width, theta, index) in [(0.001, 70.0, [1.0, 1.0]), (0.3, 50.0, [1.0, 1.5])] {
        let surface = diffuser(gaussian(width), [0.0, 1.0], index);
        let wi = from(180.0 - theta);
        let straight = surface.smooth.refracted(wi).unwrap();
        let (mut within, mut squares) = (0_u32, 0.0);
        for _ in 0..draws {
            let wo = surface.sample(wi, &mut rng).unwrap().wo;
            let alpha = 2.0 * (0.5 * (wo - straight).length()).asin();
            within += u32::from(2.0 * alpha.to_degrees() < width);
            squares += alpha * alpha;
        }
        let n = f64::from(draws);
        assert!((f64::from(within) / n - 0.5).abs() < 4.0 * (0.25 / n).sqrt());
        // α² is exponential: its deviation is its mean.
        let sigma = width.to_radians() / 2.354_820_045;
        let expected = 2.0 * sigma * sigma;
        assert!((squares / n / expected - 1.0).abs() < 4.0 / n.sqrt(), "{width}");
    }
}

#[test]
fn cosine_laws_are_reciprocal_between_equal_media() {
    let surface = diffuser(DiffuseLaw::Lambertian, [0.3, 0.6], [1.2, 1.2]);
    let directions = [0.1, 0.9, 1.5, 1.7, 2.9].map(|theta| spherical(theta, 3.0 * theta));
    // f cos θ_o = power · pdf.
    let f = |wi: DVec3, wo: DVec3| {
        let transport = Transport::between(Side::from_direction(wi), Side::from_direction(wo));
        let kind = LobeKind::Diffuse;
        let lobe = Lobe { transport, kind };
        let pdf = surface.pdf(wi, &BsdfSample { wo, weight: 0.9, lobe }).unwrap();
        0.9 * pdf / wo.z.abs()
    };
    for wi in directions {
        for wo in directions {
            assert_relative_eq!(f(wi, wo), f(wo, wi), max_relative = 1e-14);
        }
    }
}

/// Beyond the critical angle the transmitted share turns back about the mirrored direction.
#[test]
fn totally_reflected_light_keeps_its_share_and_its_width() {
    let narrow = DiffuseLobe { share: 0.6, law: gaussian(0.01) };
    let matt = DiffuseLobe { share: 0.2, law: DiffuseLaw::Lambertian };
    let surface = Diffuser::new(matt, narrow, [1.5, 1.0]).unwrap();
    let wi = from(180.0 - 60.0);
    let mut rng = Pcg64::seed_from_u64(5);
    let draws = 20_000;
    let mirror = mirrored(wi);
    let mut near = 0_u32;
    for _ in 0..draws {
        let sample = surface.sample(wi, &mut rng).unwrap();
        assert_eq!(sample.lobe.transport, Transport::Reflection);
        near += u32::from((sample.wo - mirror).length() < 1e-3);
    }
    let n = f64::from(draws);
    let sigma = (0.75 * 0.25 / n).sqrt();
    assert!((f64::from(near) / n - 0.75).abs() < 4.0 * sigma);
    let albedo = surface.albedo(wi, Polarisation::Unpolarised);
    assert_abs_diff_eq!(albedo.reflected, 0.8);
}

#[test]
fn impossible_diffusers_are_refused() {
    let lobe = |share, law| DiffuseLobe { share, law };
    let matt = DiffuseLaw::Lambertian;
    for (reflected, transmitted, index, expected) in [
        (-0.1, 0.5, 1.0, "reflected share of a diffuser must lie between 0 and 1, got -0.1"),
        (0.1, 1.5, 1.0, "transmitted share of a diffuser must lie between 0 and 1, got 1.5"),
        (0.1, f64::NAN, 1.0, "transmitted share of a diffuser must lie between 0 and 1, got NaN"),
        (
            0.6,
            0.5,
            1.0,
            "shares of a diffuser must add up to at most 1, got 0.6 reflected and 0.5 transmitted",
        ),
        (0.5, 0.5, 0.0, "refractive index of outer side must be positive and finite, got 0"),
    ] {
        let made = Diffuser::new(lobe(reflected, matt), lobe(transmitted, matt), [1.0, index]);
        assert_eq!(made.expect_err("refused").to_string(), expected);
    }
    assert!(Diffuser::new(lobe(0.7, matt), lobe(0.3, matt), [1.0, 1.0]).is_ok());
    for width in [0.0, -3.0, 1e-4, 180.1, f64::INFINITY, f64::NAN] {
        let said = GaussianLobe::new(width).expect_err("refused").to_string();
        let expected = "full width at half maximum of a Gaussian lobe must lie between 0.001 and 180 degrees, got";
        assert!(said.starts_with(expected), "{said}");
    }
}
