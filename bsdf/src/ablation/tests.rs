// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ablated BSDFs: single incident waves, and the power of their samples.

mod sampling;

use super::*;
use crate::direction::spherical;
use crate::{Mirror, SmoothInterface};
use rand::SeedableRng;

fn interface() -> Arc<dyn Bsdf> {
    Arc::new(SmoothInterface::new(1.41, 1.0).expect("valid"))
}

/// Sends everything at a fixed angle along x: what a relief across y does.
struct AlongX;

impl Bsdf for AlongX {
    fn sample(&self, wi: DVec3, _: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let lobe = self.lobes(wi, Polarization::Unpolarized)[0];
        Some(BsdfSample { wo: lobe.wo, weight: 1.0, lobe: lobe.lobe })
    }

    fn pdf(&self, _: DVec3, _: &BsdfSample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, _: Polarization) -> Vec<OutgoingLobe> {
        let kx = -wi.x + 0.2;
        let wo = DVec3::new(kx, -wi.y, (1.0 - kx * kx - wi.y * wi.y).sqrt().copysign(wi.z));
        let lobe =
            crate::Lobe { transport: crate::Transport::Reflection, kind: LobeKind::Order(1) };
        vec![OutgoingLobe { wo, power: 1.0, lobe }]
    }

    fn index(&self, _: Side) -> f64 {
        1.0
    }
}

const ALL: [IncidenceMap; 5] = [
    IncidenceMap::InPlane,
    IncidenceMap::FromPositiveX,
    IncidenceMap::FromNegativeX,
    IncidenceMap::HalfTurn,
    IncidenceMap::AzimuthMean,
];

fn along_x(map: IncidenceMap) -> RemappedIncidence {
    let bsdf: Arc<dyn Bsdf> = Arc::new(AlongX);
    RemappedIncidence { bsdf, map }
}

#[test]
fn a_rotationally_symmetric_surface_stays_what_it_is() {
    let exact = interface();
    for map in ALL {
        let bsdf = interface();
        let substituted = RemappedIncidence { bsdf, map };
        for (theta, phi) in [(2.9, 0.3), (2.0, 4.0), (0.7, 2.0), (3.1, 6.0)] {
            let wi = spherical(theta, phi);
            for polarization in [Polarization::S, Polarization::P] {
                let found = substituted.lobes(wi, polarization);
                for lobe in exact.lobes(wi, polarization) {
                    let same = found.iter().filter(|l| (l.wo - lobe.wo).length() < 1e-12);
                    let share: f64 = same.map(|l| l.power).sum();
                    assert!((share - lobe.power).abs() < 1e-12, "{map:?} {theta} {phi}");
                }
            }
        }
    }
}

#[test]
fn light_of_one_plane_stays_in_its_plane_of_incidence() {
    let in_plane = along_x(IncidenceMap::InPlane);
    for phi in [0.0, 0.8, 2.5, 4.0, 5.5] {
        let wi = spherical(0.5, phi);
        let wo = in_plane.lobes(wi, Polarization::Unpolarized)[0].wo;
        assert!((wi.x * wo.y - wi.y * wo.x).abs() < 1e-12, "{wi} {wo}");
        assert!((wo.length() - 1.0).abs() < 1e-12);
        // As in the plane x-z: the tangential part changes by 0.2 towards +x.
        let along = wi.x.hypot(wi.y).copysign(wi.x);
        let expected = (-along + 0.2).abs();
        assert!((wo.x.hypot(wo.y) - expected).abs() < 1e-12);
    }
}

/// The tangential part grows by 0.2 along x; by its mirror image, or after half a turn, it shrinks.
#[test]
fn substitutes_from_one_side_or_turned_change_the_sign_of_the_step() {
    let (left, right) = (spherical(0.5, 2.8), spherical(0.5, 0.4));
    for (map, of_left, of_right) in [
        (IncidenceMap::FromPositiveX, -0.2, 0.2),
        (IncidenceMap::FromNegativeX, 0.2, -0.2),
        (IncidenceMap::HalfTurn, -0.2, -0.2),
    ] {
        for (wi, step) in [(left, of_left), (right, of_right)] {
            let wo = along_x(map).lobes(wi, Polarization::Unpolarized)[0].wo;
            assert!((wo.x + wi.x - step).abs() < 1e-12, "{map:?} {wi} {wo}");
            assert!((wo.y + wi.y).abs() < 1e-12 && wo.z > 0.0);
        }
    }
}

#[test]
fn the_mean_over_azimuths_goes_all_ways_alike() {
    let scatter = along_x(IncidenceMap::AzimuthMean);
    let wi = spherical(0.5, 0.9);
    let lobes = scatter.lobes(wi, Polarization::Unpolarized);
    let share: f64 = lobes.iter().map(|l| l.power).sum();
    assert!((share - 1.0).abs() < 1e-12);
    // Steps of 0.2 in all directions about what a mirror does.
    let step = |wo: DVec3| (wo + wi).truncate();
    let mean = lobes.iter().fold(glam::DVec2::ZERO, |sum, l| sum + l.power * step(l.wo));
    assert!(mean.length() < 1e-12, "{mean}");
    assert!(lobes.iter().all(|l| (step(l.wo).length() - 0.2).abs() < 1e-12));
    // What is drawn is one of them, each as often as any: variance of the mean of n steps is 0.02 /
    // n in either component.
    let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
    let count = 20_000;
    let mut drawn = glam::DVec2::ZERO;
    for _ in 0..count {
        let wo = scatter.sample(wi, &mut rng).expect("a direction").wo;
        assert!(lobes.iter().any(|l| (l.wo - wo).length() < 1e-12));
        drawn += step(wo) / f64::from(count);
    }
    assert!(drawn.length() < 4.0 * (0.04 / f64::from(count)).sqrt());
}

#[test]
fn a_part_is_what_remains_when_the_rest_is_absorbed() {
    let whole = interface();
    let of = |part| Masked { bsdf: interface(), mask: part };
    for theta in [0.4, 1.1, 2.2, 2.9] {
        let wi = spherical(theta, 0.7);
        let all = whole.lobes(wi, Polarization::S);
        let power = |transport| -> f64 {
            let these = all.iter().filter(|l| l.lobe.transport == transport);
            these.map(|l| l.power).sum()
        };
        let transmitted = power(Transport::Transmission);
        let reflected = power(Transport::Reflection);
        for (part, expected) in [
            (Mask::Transmission, transmitted),
            (Mask::FromInside, if wi.z < 0.0 { 1.0 } else { 0.0 }),
            (Mask::SpecularReflection, transmitted + reflected),
        ] {
            let left = of(part).lobes(wi, Polarization::S);
            let sum: f64 = left.iter().map(|l| l.power).sum();
            assert!((sum - expected).abs() < 1e-12, "{part:?} {theta} {sum}");
        }
    }
}

#[test]
fn drawn_parts_have_the_power_of_their_lobes() {
    // A relief that sends what it reflects elsewhere.
    let wi = spherical(0.5, 0.3);
    let specular = Masked { bsdf: Arc::new(AlongX), mask: Mask::SpecularReflection };
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    let wo = specular.sample(wi, &mut rng).expect("all is kept").wo;
    assert!((wo - DVec3::new(-wi.x, -wi.y, wi.z)).length() < 1e-15);
    let transmission = Masked { bsdf: interface(), mask: Mask::Transmission };
    let wi = spherical(2.5, 0.3);
    let lobes = transmission.lobes(wi, Polarization::Unpolarized);
    let share: f64 = lobes.iter().map(|l| l.power).sum();
    assert!(lobes.iter().all(|l| l.wo.z > 0.0) && share < 0.99);
    let count = 40_000;
    let kept = (0..count).filter(|_| transmission.sample(wi, &mut rng).is_some());
    let drawn = kept.count() as f64 / f64::from(count);
    let error = (share * (1.0 - share) / f64::from(count)).sqrt();
    assert!((drawn - share).abs() < 4.0 * error, "{drawn} {share}");
    let inside = Masked { bsdf: interface(), mask: Mask::FromInside };
    assert!(inside.sample(spherical(0.5, 0.3), &mut rng).is_none());
    assert!(inside.sample(wi, &mut rng).is_some());
}

#[test]
fn spreading_moves_by_less_than_a_cell_and_keeps_power_and_mean() {
    let mirror: Arc<dyn Bsdf> = Arc::new(Mirror::new(1.0, 1.0).expect("valid"));
    let spread = Binned::new(Arc::clone(&mirror), 5.0);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
    let wi = spherical(0.6, 1.0);
    let exact = mirror.lobes(wi, Polarization::Unpolarized)[0];
    let (mut mean, count) = (DVec3::ZERO, 20_000);
    for _ in 0..count {
        let sample = spread.sample(wi, &mut rng).expect("a direction");
        assert!((sample.weight - 1.0).abs() < 1e-15 && sample.wo.z > 0.0);
        assert!((sample.wo.length() - 1.0).abs() < 1e-12);
        assert!(sample.wo.angle_between(exact.wo).to_degrees() < 7.1);
        mean += sample.wo / f64::from(count);
    }
    let lobe = spread.lobes(wi, Polarization::Unpolarized)[0];
    assert!(lobe.lobe.kind == LobeKind::Cell && (lobe.power - exact.power).abs() < 1e-15);
    // Uniform over a cell about 0.09 wide: the mean lies at its middle to five standard errors of
    // 0.03 / √20000.
    assert!((mean - lobe.wo).length() < 2e-3, "{mean} {}", lobe.wo);
}
