// SPDX-License-Identifier: MIT OR Apache-2.0
//! A scatterer with something left out or blurred on purpose: what simpler tables would have kept of it.
//!
//! In: any [`Scatter`]. Out: another one, which sends every incident wave where the first sends
//!
//! - [`Substituted`]: another wave in its place, turned or mirrored about the normal, and the light that it makes turned or mirrored back: what tables know that were
//!   measured or computed for some incidences alone, or were laid on the wrong way round.
//! - [`Partial`]: only a part of it: what is transmitted, or what comes from the inner side; or all of it with what is reflected turned into the specular direction.
//!   Tables of transmission alone are common, and so are those solved from one side.
//! - [`Spread`]: it, but each direction moved to a random place in its cell of a grid of directions, as tables over angular bins do.
//!
//! All but the first two parts of [`Partial`] keep the power. They are for finding out what such a simplification costs; none is reciprocal, and none knows the probability of a direction.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;
use rand::RngExt;

use crate::cells::Cells;
use crate::direction::Side;
use crate::scatter::{LobeKind, OutgoingLobe, Polarization, Sample, Scatter, Transport};

/// Below this tangential part of a direction there is no plane of incidence to speak of.
const NORMAL: f64 = 1e-12;

/// Which wave stands for another at the same angle to the normal and on the same side of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Substitute {
    /// The one in the plane x-z with the same sign of x, turned into the plane of incidence: tables of one plane. A relief then spreads light in the plane of
    /// incidence, wherever its grooves lie.
    InPlane,
    /// Of waves from x > 0 themselves, of others their mirror images at x = 0: tables of one side, taken as symmetric.
    FromPositiveX,
    /// Of waves from x < 0 themselves, of others their mirror images.
    FromNegativeX,
    /// The wave after half a turn about the normal: tables laid on the wrong way round.
    HalfTurn,
    /// Waves from all azimuths with equal probability: tables of the polar angle alone.
    Azimuths,
}

/// Azimuths that stand for all.
const AZIMUTHS: usize = 72;

/// Scatters each wave as another one.
pub struct Substituted {
    /// What scatters.
    pub scatter: Arc<dyn Scatter>,
    /// What stands for what.
    pub by: Substitute,
}

/// A rotation about the normal, after x → -x if it mirrors.
#[derive(Clone, Copy)]
struct Map {
    cos: f64,
    sin: f64,
    mirrors: bool,
}

impl Map {
    const NONE: Self = Self {
        cos: 1.0,
        sin: 0.0,
        mirrors: false,
    };

    const HALF_TURN: Self = Self {
        cos: -1.0,
        ..Self::NONE
    };

    const MIRROR: Self = Self {
        mirrors: true,
        ..Self::NONE
    };

    /// From the plane x-z to that of `wi`, at the same sign of x.
    fn from_plane(wi: DVec3) -> Self {
        let tangential = wi.x.hypot(wi.y).copysign(wi.x);
        if tangential.abs() < NORMAL {
            return Self::NONE;
        }
        Self {
            cos: wi.x / tangential,
            sin: wi.y / tangential,
            mirrors: false,
        }
    }

    fn mirrored(self, v: DVec3) -> DVec3 {
        if self.mirrors {
            DVec3::new(-v.x, v.y, v.z)
        } else {
            v
        }
    }

    /// From a direction to that of its substitute.
    fn back(self, v: DVec3) -> DVec3 {
        self.mirrored(DVec3::new(
            self.cos * v.x + self.sin * v.y,
            self.cos * v.y - self.sin * v.x,
            v.z,
        ))
    }

    /// From light of the substitute to light of the wave.
    fn forth(self, v: DVec3) -> DVec3 {
        let v = self.mirrored(v);
        DVec3::new(
            self.cos * v.x - self.sin * v.y,
            self.cos * v.y + self.sin * v.x,
            v.z,
        )
    }
}

impl Substituted {
    /// Number of waves that stand for one.
    fn count(&self) -> usize {
        match self.by {
            Substitute::Azimuths => AZIMUTHS,
            _ => 1,
        }
    }

    /// The map to the wave of this number.
    fn map(&self, wi: DVec3, number: usize) -> Map {
        match self.by {
            Substitute::InPlane => Map::from_plane(wi),
            Substitute::FromPositiveX if wi.x < 0.0 => Map::MIRROR,
            Substitute::FromNegativeX if wi.x > 0.0 => Map::MIRROR,
            Substitute::FromPositiveX | Substitute::FromNegativeX => Map::NONE,
            Substitute::HalfTurn => Map::HALF_TURN,
            Substitute::Azimuths => {
                let (sin, cos) = (TAU * (number as f64 + 0.5) / AZIMUTHS as f64).sin_cos();
                Map {
                    cos,
                    sin,
                    mirrors: false,
                }
            }
        }
    }
}

impl Scatter for Substituted {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<Sample> {
        let number = match self.count() {
            1 => 0,
            count => rng.random_range(0..count),
        };
        let map = self.map(wi, number);
        let mut sample = self.scatter.sample(map.back(wi), rng)?;
        sample.wo = map.forth(sample.wo);
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &Sample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let count = self.count();
        let of = |number| {
            let map = self.map(wi, number);
            let lobes = self.scatter.lobes(map.back(wi), polarization);
            lobes.into_iter().map(move |mut lobe| {
                lobe.wo = map.forth(lobe.wo);
                lobe.share /= count as f64;
                lobe
            })
        };
        (0..count).flat_map(of).collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.scatter.index(side)
    }
}

/// What is left of the light that a surface scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What is transmitted; reflected light is absorbed.
    Transmission,
    /// Light from the inner side; what comes from the outer one is absorbed.
    FromInside,
    /// All of it, but everything reflected leaves in the specular direction.
    SpecularReflection,
}

/// Scatters a part of the light.
pub struct Partial {
    /// What the whole is scattered by.
    pub scatter: Arc<dyn Scatter>,
    /// The part that is kept.
    pub part: Part,
}

impl Partial {
    /// Where light from `wi` that the whole sends to `wo` goes; `None` if it is absorbed.
    fn kept(&self, wi: DVec3, wo: DVec3, transport: Transport) -> Option<DVec3> {
        let reflected = transport == Transport::Reflection;
        match self.part {
            Part::Transmission => (!reflected).then_some(wo),
            Part::FromInside => (Side::of(wi) == Side::Inner).then_some(wo),
            Part::SpecularReflection if reflected => Some(DVec3::new(-wi.x, -wi.y, wi.z)),
            Part::SpecularReflection => Some(wo),
        }
    }
}

impl Scatter for Partial {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<Sample> {
        let mut sample = self.scatter.sample(wi, rng)?;
        sample.wo = self.kept(wi, sample.wo, sample.lobe.transport)?;
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &Sample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let mut lobes = self.scatter.lobes(wi, polarization);
        lobes.retain_mut(|lobe| {
            let kept = self.kept(wi, lobe.wo, lobe.lobe.transport);
            lobe.wo = kept.unwrap_or(lobe.wo);
            kept.is_some()
        });
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.scatter.index(side)
    }
}

/// Spreads every direction over its cell.
pub struct Spread {
    scatter: Arc<dyn Scatter>,
    cells: Cells,
}

impl Spread {
    /// Cells `width_deg` wide in polar angle and azimuth, from the normal on; `width_deg` divides 90.
    #[must_use]
    pub fn new(scatter: Arc<dyn Scatter>, width_deg: f64) -> Self {
        let every = |from: f64, to: f64| -> Vec<f64> {
            let count = ((to - from) / width_deg).round().max(1.0) as usize;
            (0..count).map(|k| from + width_deg * k as f64).collect()
        };
        let half = 0.5 * width_deg;
        Self {
            scatter,
            cells: Cells::around(&every(0.0, 360.0), &every(half, 90.0 + half), 90.0),
        }
    }

    /// The cell of a direction on either side, and the direction with `place` in it.
    fn moved(&self, wo: DVec3, place: impl FnOnce(&Cells, usize) -> DVec3) -> DVec3 {
        let upper = DVec3::new(wo.x, wo.y, wo.z.abs());
        self.cells.locate(upper).map_or(wo, |cell| {
            let moved = place(&self.cells, cell);
            DVec3::new(
                moved.x,
                moved.y,
                moved.z.max(f64::MIN_POSITIVE).copysign(wo.z),
            )
        })
    }
}

impl Scatter for Spread {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<Sample> {
        let mut sample = self.scatter.sample(wi, rng)?;
        let (u, v) = (rng.random(), rng.random());
        sample.wo = self.moved(sample.wo, |cells, cell| cells.inside(cell, u, v));
        if sample.lobe.kind.is_discrete() {
            sample.lobe.kind = LobeKind::Cell;
        }
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &Sample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let mut lobes = self.scatter.lobes(wi, polarization);
        for lobe in lobes.iter_mut().filter(|l| l.lobe.kind.is_discrete()) {
            lobe.wo = self.moved(lobe.wo, Cells::middle);
            lobe.lobe.kind = LobeKind::Cell;
        }
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.scatter.index(side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direction::spherical;
    use crate::{Mirror, SmoothInterface};
    use rand::SeedableRng;

    fn interface() -> Arc<dyn Scatter> {
        Arc::new(SmoothInterface::new(1.41, 1.0).expect("valid"))
    }

    /// Sends everything at a fixed angle along x: what a relief across y does.
    struct AlongX;

    impl Scatter for AlongX {
        fn sample(&self, wi: DVec3, _: &mut dyn rand::Rng) -> Option<Sample> {
            let lobe = self.lobes(wi, Polarization::Unpolarized)[0];
            Some(Sample {
                wo: lobe.wo,
                weight: 1.0,
                lobe: lobe.lobe,
            })
        }

        fn pdf(&self, _: DVec3, _: &Sample) -> Option<f64> {
            None
        }

        fn lobes(&self, wi: DVec3, _: Polarization) -> Vec<OutgoingLobe> {
            let kx = -wi.x + 0.2;
            let wo = DVec3::new(
                kx,
                -wi.y,
                (1.0 - kx * kx - wi.y * wi.y).sqrt().copysign(wi.z),
            );
            let lobe = crate::Lobe {
                transport: crate::Transport::Reflection,
                kind: LobeKind::Order(1),
            };
            vec![OutgoingLobe {
                wo,
                share: 1.0,
                lobe,
            }]
        }

        fn index(&self, _: Side) -> f64 {
            1.0
        }
    }

    const ALL: [Substitute; 5] = [
        Substitute::InPlane,
        Substitute::FromPositiveX,
        Substitute::FromNegativeX,
        Substitute::HalfTurn,
        Substitute::Azimuths,
    ];

    fn along_x(by: Substitute) -> Substituted {
        let scatter: Arc<dyn Scatter> = Arc::new(AlongX);
        Substituted { scatter, by }
    }

    #[test]
    fn a_rotationally_symmetric_surface_stays_what_it_is() {
        let exact = interface();
        for by in ALL {
            let scatter = interface();
            let substituted = Substituted { scatter, by };
            for (theta, phi) in [(2.9, 0.3), (2.0, 4.0), (0.7, 2.0), (3.1, 6.0)] {
                let wi = spherical(theta, phi);
                for polarization in [Polarization::S, Polarization::P] {
                    let found = substituted.lobes(wi, polarization);
                    for lobe in exact.lobes(wi, polarization) {
                        let same = found.iter().filter(|l| (l.wo - lobe.wo).length() < 1e-12);
                        let share: f64 = same.map(|l| l.share).sum();
                        assert!((share - lobe.share).abs() < 1e-12, "{by:?} {theta} {phi}");
                    }
                }
            }
        }
    }

    #[test]
    fn light_of_one_plane_stays_in_its_plane_of_incidence() {
        let in_plane = along_x(Substitute::InPlane);
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
        for (by, of_left, of_right) in [
            (Substitute::FromPositiveX, -0.2, 0.2),
            (Substitute::FromNegativeX, 0.2, -0.2),
            (Substitute::HalfTurn, -0.2, -0.2),
        ] {
            for (wi, step) in [(left, of_left), (right, of_right)] {
                let wo = along_x(by).lobes(wi, Polarization::Unpolarized)[0].wo;
                assert!((wo.x + wi.x - step).abs() < 1e-12, "{by:?} {wi} {wo}");
                assert!((wo.y + wi.y).abs() < 1e-12 && wo.z > 0.0);
            }
        }
    }

    #[test]
    fn the_mean_over_azimuths_goes_all_ways_alike() {
        let scatter = along_x(Substitute::Azimuths);
        let wi = spherical(0.5, 0.9);
        let lobes = scatter.lobes(wi, Polarization::Unpolarized);
        let share: f64 = lobes.iter().map(|l| l.share).sum();
        assert!((share - 1.0).abs() < 1e-12);
        // Steps of 0.2 in all directions about what a mirror does.
        let step = |wo: DVec3| (wo + wi).truncate();
        let mean = lobes
            .iter()
            .fold(glam::DVec2::ZERO, |sum, l| sum + l.share * step(l.wo));
        assert!(mean.length() < 1e-12, "{mean}");
        assert!(
            lobes
                .iter()
                .all(|l| (step(l.wo).length() - 0.2).abs() < 1e-12)
        );
        // What is drawn is one of them, each as often as any: variance of the mean of n steps is 0.02 / n in either component.
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
        let of = |part| Partial {
            scatter: interface(),
            part,
        };
        for theta in [0.4, 1.1, 2.2, 2.9] {
            let wi = spherical(theta, 0.7);
            let all = whole.lobes(wi, Polarization::S);
            let power = |transport| -> f64 {
                let these = all.iter().filter(|l| l.lobe.transport == transport);
                these.map(|l| l.share).sum()
            };
            let transmitted = power(Transport::Transmission);
            let reflected = power(Transport::Reflection);
            for (part, expected) in [
                (Part::Transmission, transmitted),
                (Part::FromInside, if wi.z < 0.0 { 1.0 } else { 0.0 }),
                (Part::SpecularReflection, transmitted + reflected),
            ] {
                let left = of(part).lobes(wi, Polarization::S);
                let sum: f64 = left.iter().map(|l| l.share).sum();
                assert!((sum - expected).abs() < 1e-12, "{part:?} {theta} {sum}");
            }
        }
    }

    #[test]
    fn drawn_parts_have_the_power_of_their_lobes() {
        // A relief that sends what it reflects elsewhere.
        let wi = spherical(0.5, 0.3);
        let specular = Partial {
            scatter: Arc::new(AlongX),
            part: Part::SpecularReflection,
        };
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let wo = specular.sample(wi, &mut rng).expect("all is kept").wo;
        assert!((wo - DVec3::new(-wi.x, -wi.y, wi.z)).length() < 1e-15);
        let transmission = Partial {
            scatter: interface(),
            part: Part::Transmission,
        };
        let wi = spherical(2.5, 0.3);
        let lobes = transmission.lobes(wi, Polarization::Unpolarized);
        let share: f64 = lobes.iter().map(|l| l.share).sum();
        assert!(lobes.iter().all(|l| l.wo.z > 0.0) && share < 0.99);
        let count = 40_000;
        let kept = (0..count).filter(|_| transmission.sample(wi, &mut rng).is_some());
        let drawn = kept.count() as f64 / f64::from(count);
        let error = (share * (1.0 - share) / f64::from(count)).sqrt();
        assert!((drawn - share).abs() < 4.0 * error, "{drawn} {share}");
        let inside = Partial {
            scatter: interface(),
            part: Part::FromInside,
        };
        assert!(inside.sample(spherical(0.5, 0.3), &mut rng).is_none());
        assert!(inside.sample(wi, &mut rng).is_some());
    }

    #[test]
    fn spreading_moves_by_less_than_a_cell_and_keeps_power_and_mean() {
        let mirror: Arc<dyn Scatter> = Arc::new(Mirror::new(1.0, 1.0).expect("valid"));
        let spread = Spread::new(Arc::clone(&mirror), 5.0);
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
        assert!(lobe.lobe.kind == LobeKind::Cell && (lobe.share - exact.share).abs() < 1e-15);
        // Uniform over a cell about 0.09 wide: the mean lies at its middle to five standard errors of 0.03 / √20000.
        assert!((mean - lobe.wo).length() < 2e-3, "{mean} {}", lobe.wo);
    }
}
