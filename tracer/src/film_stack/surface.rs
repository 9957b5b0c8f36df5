// SPDX-License-Identifier: MIT OR Apache-2.0
//! A stack of films as one surface in air: what becomes of light from a direction, without regard to
//! where it leaves.

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

/// Shares of diffuse light from one side.
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

    /// Shares of `paths` rays from `side` that fill the hemisphere as diffuse light does, with errors
    /// from the scatter of groups.
    pub fn shares(&self, side: Side, paths: u64) -> StackShares {
        let groups = self.settings.groups as u64;
        let count = paths.div_ceil(groups);
        let of_group = |group: u64| {
            let seed = self.settings.seed ^ SALT;
            let streams = Streams::new(&mut random::stream(seed, 2 * group + side.index() as u64));
            let mut shares = [0.0; 3];
            let begin = &mut |rng: &mut PathStream| {
                random::cosine(rng, 1.0) * DVec3::new(1.0, 1.0, -side.sign())
            };
            let ledger = self.follow(count, &streams, begin, &mut |_, outcome| {
                if outcome.course != Course::Ended {
                    let to = Side::from_direction(outcome.exit().direction);
                    shares[Transport::between(side, to).index()] += outcome.weight;
                }
            });
            shares[2] = ledger.absorbed() + ledger.lost_total();
            shares.map(|share| share / count as f64)
        };
        let all: Vec<[f64; 3]> = (0..groups).into_par_iter().map(of_group).collect();
        // One ray more or less is always possible.
        let least = 1.0 / (count * groups) as f64;
        let estimate = |k: usize| {
            let own = all.iter().map(|own| own[k]).collect::<Moments>().estimate();
            Estimate { standard_error: own.standard_error.max(least), ..own }
        };
        StackShares {
            reflected: estimate(Transport::Reflection.index()),
            transmitted: estimate(Transport::Transmission.index()),
            absorbed: estimate(2),
        }
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
