// SPDX-License-Identifier: MIT OR Apache-2.0
//! A stack of films as one surface in air: what becomes of light from a direction, without regard to
//! where it leaves.

use std::f64::consts::{FRAC_PI_2, TAU};

use bsdf::direction::spherical;
use bsdf::{
    Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation as LobePolarisation, Side,
    Transport,
};
use glam::DVec3;
use rand::Rng;
use rayon::prelude::*;

use super::layers::{LayerWalk, Layers};
use super::part::{Course, FilmOutcome};
use crate::error::Error;
use crate::ledger::Ledger;
use crate::optics::polarisation::{Light, Polarisation, Stokes, Unpolarised};
use crate::path::Tracer;
use crate::random::{self, PathStream, Streams};
use crate::receiver::Tally;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::statistics::{Estimate, Moments};

/// Added to the seed of shares, which share no ray with lobes.
const SALT: u64 = 0x7368_6172_6573;

/// Films that have no ends, as a surface. Its lobes are rays that the walker of film tables follows,
/// unpolarised as they come; [`Settings::paths`] of them stand for one incidence.
pub struct StackSurface {
    scene: Scene,
    settings: Settings,
}

/// Light that falls on the films.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StackLight {
    /// It fills the hemisphere as diffuse light does.
    Diffuse,
    /// It comes at this angle to the normal, degrees below 90, from all azimuths alike.
    Angle(f64),
}

impl StackLight {
    /// Tells random numbers of one light from those of others.
    fn salt(self) -> u64 {
        match self {
            Self::Diffuse => 0,
            Self::Angle(deg) => deg.to_bits().rotate_left(16) | 1,
        }
    }

    /// A way of it, upwards.
    fn sample(self, rng: &mut PathStream) -> DVec3 {
        match self {
            Self::Diffuse => random::cosine(rng, 1.0),
            Self::Angle(deg) => spherical(deg.to_radians(), TAU * random::unit(rng)),
        }
    }
}

/// Shares of light from one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StackShares {
    /// Comes back.
    pub reflected: Estimate,
    /// Goes through.
    pub transmitted: Estimate,
    /// Ends in the films, by their own account.
    pub absorbed: Estimate,
}

impl StackSurface {
    /// The films of a scene that has nothing else, the lowest face at the height 0, at one
    /// wavelength.
    ///
    /// # Errors
    /// Settings that are none.
    pub fn new(scene: Scene, settings: Settings) -> Result<Self, Error> {
        settings.check()?;
        Ok(Self { scene, settings })
    }

    /// Follows `count` rays, each of which `begin` gives a way; shows each with its outcome, and
    /// returns what the films have booked.
    fn follow(
        &self,
        count: u64,
        streams: &Streams,
        begin: &mut dyn FnMut(&mut PathStream) -> DVec3,
        show: &mut dyn FnMut(DVec3, &FilmOutcome),
    ) -> Ledger {
        match self.settings.polarisation {
            Polarisation::Unpolarised => {
                self.follow_light::<Unpolarised>(count, streams, begin, show)
            }
            Polarisation::Carried => self.follow_light::<Stokes>(count, streams, begin, show),
        }
    }

    fn follow_light<L: Light>(
        &self,
        count: u64,
        streams: &Streams,
        begin: &mut dyn FnMut(&mut PathStream) -> DVec3,
        show: &mut dyn FnMut(DVec3, &FilmOutcome),
    ) -> Ledger {
        let tracers = [Tracer::new(&self.scene, &[], &self.settings)];
        let layers = [Layers::new(&self.scene)];
        let mut tallies = [Tally::new(&tracers[0].receivers)];
        let mut passed = [vec![[0.0; 2]; layers[0].gaps()]];
        let mut walk = LayerWalk::new((&layers, &tracers), (&mut tallies, &mut passed));
        for number in 0..count {
            let mut rng = streams.path(number);
            let direction = begin(&mut rng);
            let ray = (direction, false);
            let outcome = walk.follow(ray, 0, &mut L::default(), &mut rng);
            show(direction, &outcome);
        }
        let [tally] = tallies;
        tally.close().ledger
    }

    /// Shares of `paths` rays of `light` from `side`, with errors from the scatter of groups.
    pub fn shares(&self, side: Side, light: StackLight, paths: u64) -> StackShares {
        let all = self.sorted(side, light, paths, 2, &|transport, _| transport.index());
        StackShares {
            reflected: all[Transport::Reflection.index()],
            transmitted: all[Transport::Transmission.index()],
            absorbed: all[2],
        }
    }

    /// Shares of `light` for each steradian, in `bins` equal bins of the angle to the normal at which it
    /// leaves, up to 90 degrees: what goes through, and what comes back.
    pub fn intensity(
        &self,
        side: Side,
        light: StackLight,
        paths: u64,
        bins: usize,
    ) -> [Vec<Estimate>; 2] {
        let step = FRAC_PI_2 / bins as f64;
        let bin = |transport: Transport, wo: DVec3| {
            let number = (wo.z.abs().min(1.0).acos() / step) as usize;
            transport.index() * bins + number.min(bins - 1)
        };
        let shares = self.sorted(side, light, paths, 2 * bins, &bin);
        [Transport::Transmission, Transport::Reflection].map(|transport| {
            let own = shares.iter().skip(transport.index() * bins).take(bins).enumerate();
            let each = own.map(|(number, share)| {
                let [near, far] = [0.0, 1.0].map(|more| (step * (number as f64 + more)).cos());
                let per_sr = 1.0 / (TAU * (near - far));
                Estimate {
                    value: share.value * per_sr,
                    standard_error: share.standard_error * per_sr,
                }
            });
            each.collect()
        })
    }

    /// Sorts `paths` rays of `light` from `side` into `bins` by transport and direction: the share in
    /// each, and last what ends in the films.
    fn sorted(
        &self,
        side: Side,
        light: StackLight,
        paths: u64,
        bins: usize,
        bin: &(dyn Fn(Transport, DVec3) -> usize + Sync),
    ) -> Vec<Estimate> {
        let groups = self.settings.groups as u64;
        let count = paths.div_ceil(groups);
        let of_group = |group: u64| {
            let seed = self.settings.seed ^ SALT ^ light.salt();
            let streams = Streams::new(&mut random::stream(seed, 2 * group + side.index() as u64));
            let mut shares = vec![0.0; bins + 1];
            let begin =
                &mut |rng: &mut PathStream| light.sample(rng) * DVec3::new(1.0, 1.0, -side.sign());
            let ledger = self.follow(count, &streams, begin, &mut |_, outcome| {
                if outcome.course != Course::Ended {
                    let wo = outcome.exit().direction;
                    let transport = Transport::between(side, Side::from_direction(wo));
                    shares[bin(transport, wo)] += outcome.weight;
                }
            });
            shares[bins] = ledger.absorbed() + ledger.lost_total();
            for share in &mut shares {
                *share /= count as f64;
            }
            shares
        };
        let all: Vec<Vec<f64>> = (0..groups).into_par_iter().map(of_group).collect();
        // One ray more or less is always possible.
        let least = 1.0 / (count * groups) as f64;
        let estimate = |k: usize| {
            let own = all.iter().map(|own| own[k]).collect::<Moments>().estimate();
            Estimate { standard_error: own.standard_error.max(least), ..own }
        };
        (0..=bins).map(estimate).collect()
    }

    /// Outcomes of `count` rays from `wi` that leave: direction, weight and lobe.
    fn leaving(&self, wi: DVec3, count: u64, streams: &Streams) -> Vec<BsdfSample> {
        let from = Side::from_direction(wi);
        let mut samples = Vec::new();
        self.follow(count, streams, &mut |_| -wi, &mut |_, outcome| {
            if outcome.course != Course::Ended {
                // Kept in single precision.
                let wo = outcome.exit().direction.normalize();
                let transport = Transport::between(from, Side::from_direction(wo));
                let lobe = Lobe { transport, kind: LobeKind::Cell };
                samples.push(BsdfSample { wo, weight: outcome.weight, lobe });
            }
        });
        samples
    }
}

impl Bsdf for StackSurface {
    fn sample(&self, wi: DVec3, mut rng: &mut dyn Rng) -> Option<BsdfSample> {
        self.leaving(wi, 1, &Streams::new(&mut rng)).pop()
    }

    /// Unknown without tracing all rays.
    fn pdf(&self, _wi: DVec3, _sample: &BsdfSample) -> Option<f64> {
        None
    }

    /// The rays that leave of those followed for this incidence, unpolarised as they come: the same
    /// ones whenever it is asked for.
    fn lobes(&self, wi: DVec3, _polarisation: LobePolarisation) -> Vec<OutgoingLobe> {
        let bits = wi.to_array().map(f64::to_bits);
        let number = bits
            .into_iter()
            .fold(0_u64, |all, own| (all ^ own).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let streams = Streams::new(&mut random::stream(self.settings.seed, number));
        let share = 1.0 / self.settings.paths as f64;
        let leaving = self.leaving(wi, self.settings.paths, &streams).into_iter();
        leaving
            .map(|BsdfSample { wo, weight, lobe }| OutgoingLobe { wo, power: weight * share, lobe })
            .collect()
    }

    fn index(&self, _side: Side) -> f64 {
        1.0
    }
}
