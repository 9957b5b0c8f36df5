// SPDX-License-Identifier: MIT OR Apache-2.0
//! A run: a scene, receivers and a seed in, totals for each group of paths out.
//!
//! The paths are cut into a fixed number of groups. Each group has its own random stream, chosen by
//! (seed, group), and its own totals. Groups run in parallel on the current rayon pool and are
//! collected in order, so the same seed gives the same bits on any number of threads.
//!
//! Every path has a stream of its own, chosen by its number in the group. Path k of a seed begins
//! the same in scenes that differ elsewhere, and what two scenes have in common cancels in the
//! difference of their results (common random numbers).

mod control;
mod groups;
mod long_paths;
mod observed;
mod one_by_one;
mod walk;
mod wavelengths;

pub use control::Control;
pub use observed::trace_observed;
pub use wavelengths::WavelengthRun;

use rayon::prelude::*;
use std::ops::Range;

use groups::{Group, Progress};
use walk::SceneWalker;

use crate::batch::BatchTracer;
use crate::batch::mesh_packets::MeshPackets;
use crate::error::Error;
use crate::film_stack::{BoundStack, StackWalker};
use crate::observer::{Fate, Observer};
use crate::optics::polarisation::Polarisation;
use crate::outcome::{Outcome, Totals};
use crate::path::Tracer;
use crate::ray::Ray;
use crate::receiver::{Receiver, Tally};
use crate::scene::Scene;
use crate::settings::Settings;

/// Traces a scene.
pub fn run(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
) -> Result<Outcome, Error> {
    run_with(scene, receivers, settings, Control::default())
}

/// Traces a scene with progress and cancellation.
pub fn run_with(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
    control: Control<'_>,
) -> Result<Outcome, Error> {
    let found = trace_groups(scene, receivers, settings, control, 0..u64::MAX)?;
    Ok(groups::outcomes(settings, 1, found).swap_remove(0))
}

/// Traces those of `groups` that the checkpoints of `control` lack, and hands them to the
/// checkpoints: a part of what [`run_with`] traces, for one of several processes. There are none
/// beyond those of `settings`.
///
/// # Errors
/// Same as [`run_with`].
pub fn run_groups(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
    control: Control<'_>,
    groups: Range<u64>,
) -> Result<(), Error> {
    trace_groups(scene, receivers, settings, control, groups).map(drop)
}

/// Those of `groups` that `settings` has, in order.
fn trace_groups(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
    control: Control<'_>,
    groups: Range<u64>,
) -> Result<Vec<Group>, Error> {
    settings.check()?;
    for receiver in receivers {
        scene.admits(*receiver)?;
    }

    let mut tracer = Tracer::new(scene, receivers, settings);
    let bound = control.films.map(|films| BoundStack::new(films, &[scene], &[], settings));
    let films = bound.transpose()?;
    if let Some(films) = &films {
        films.relieve(&mut tracer);
    }
    let many = match settings.polarisation {
        Polarisation::Unpolarised if control.films.is_none() && !scene.is_periodic() => {
            Strategy::new(scene, settings.max_bounces)
        }
        Polarisation::Unpolarised | Polarisation::Carried => Strategy::PathByPath,
    };
    let like = || Tally::new(&tracer.receivers).totals;
    groups::resumed(settings, control, groups, 1, like, |group| {
        let at = (settings.seed, group);
        let (totals, hits) = trace_group(
            &tracer,
            (&many, films.as_ref()),
            settings.in_group(),
            at,
            control,
            &mut (),
        )?;
        Ok((vec![totals], hits))
    })
}

/// Rays with their powers, W.
type Leaving = Vec<(Ray, f64)>;

/// Keeps what leaves the scene.
struct Escapes {
    rays: Leaving,
    /// Power of a weight of 1, W.
    scale: f64,
}

impl Observer for Escapes {
    fn ends(&mut self, ray: &Ray, fate: Fate, weight: f64) {
        if matches!(fate, Fate::EscapedUp | Fate::EscapedDown) {
            self.rays.push((*ray, weight * self.scale));
        }
    }
}

/// Groups whose rays are kept at once by [`run_rays`].
const BLOCK: u64 = 16;
/// Paths of one group of [`run_rays`].
const IN_GROUP: u64 = 16_384;

/// Traces a scene and hands every ray that leaves it for good to `take`, with its power in W, in an
/// order that does not depend on the number of threads. Groups have 16 384 paths each, whatever
/// `settings` asks for, and 16 of them are kept in memory; their number follows from
/// `settings.paths`. The sum of the powers is the escaped power of the outcome.
pub fn run_rays(
    scene: &Scene,
    settings: &Settings,
    control: Control<'_>,
    mut take: impl FnMut(&Ray, f64) -> Result<(), Error>,
) -> Result<Outcome, Error> {
    settings.check()?;
    let tracer = Tracer::new(scene, &[], settings);
    let count = settings.paths.div_ceil(IN_GROUP).max(2);
    let paths = settings.paths.div_ceil(count);
    let scale = scene.power() / (paths * count) as f64;
    let (mut totals, mut hits) = (Vec::new(), 0);
    for begin in (0..count).step_by(BLOCK as usize) {
        let batch: Vec<(Totals, u64, Leaving)> = (begin..(begin + BLOCK).min(count))
            .into_par_iter()
            .map(|group| {
                let mut escapes = Escapes { rays: Vec::new(), scale };
                let (totals, hits) = trace_group(
                    &tracer,
                    (&Strategy::PathByPath, None),
                    paths,
                    (settings.seed, group),
                    control,
                    &mut escapes,
                )?;
                Ok((totals, hits, escapes.rays))
            })
            .collect::<Result<_, Error>>()?;
        for (group, met, rays) in batch {
            hits += met;
            totals.push(group);
            for (ray, power) in &rays {
                take(ray, *power)?;
            }
        }
    }
    Ok(Outcome::new(paths * count, hits, totals))
}

/// Strategy by which the paths of a scene are traced.
enum Strategy<'a> {
    BatchTracer(Box<BatchTracer<'a>>),
    /// By the walker, sorted by what they meet.
    MeshPackets(MeshPackets),
    /// By the walker, one after the other.
    PathByPath,
}

impl<'a> Strategy<'a> {
    fn new(scene: &'a Scene, max_bounces: u32) -> Self {
        if let Some(batch) = BatchTracer::new(scene, max_bounces) {
            return Self::BatchTracer(Box::new(batch));
        }
        MeshPackets::new(scene).map_or(Self::PathByPath, Self::MeshPackets)
    }
}

/// Traces one group, given by seed and number.
fn trace_group<'a>(
    tracer: &Tracer<'a>,
    (many, films): (&Strategy<'_>, Option<&BoundStack<'a>>),
    paths: u64,
    at: (u64, u64),
    control: Control<'_>,
    observer: &mut impl Observer,
) -> Result<(Totals, u64), Error> {
    let (picker, streams) = groups::begin(tracer, at, paths);
    let mut tally = Tally::new(&tracer.receivers);
    let mut progress = Progress::new(control);
    let keep_going = |done: u64| progress.keep_going(done);
    let hits = match many {
        Strategy::BatchTracer(batch) => {
            batch.trace(tracer, paths, (streams, picker), &mut tally, keep_going)
        }
        Strategy::MeshPackets(mesh_packets) => {
            mesh_packets.trace(tracer, paths, (streams, picker), &mut tally, keep_going)
        }
        Strategy::PathByPath => {
            let films = films.map(|films| StackWalker::new(films, at.1));
            let mut walker = SceneWalker { tracer, picker, tally: &mut tally, films, observer };
            let polarisation = tracer.polarisation;
            let hits = one_by_one::trace(&mut walker, polarisation, paths, streams, keep_going);
            let SceneWalker { films, tally, .. } = walker;
            if let Some(films) = films {
                films.close(&mut [tally]);
            }
            hits
        }
    };
    let hits = hits.ok_or(Error::Cancelled)?;
    progress.report(paths);
    let mut totals = tally.close();
    totals.scale(tracer.scene.power() / paths as f64);
    Ok((totals, hits))
}
