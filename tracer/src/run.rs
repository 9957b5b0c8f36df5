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
use std::sync::atomic::Ordering;

use one_by_one::{STRIDE, one_by_one};
use walk::SceneWalk;

use crate::batch::BatchTracer;
use crate::batch::mesh_packets::MeshPackets;
use crate::checkpoint;
use crate::error::Error;
use crate::observer::{Fate, Observer};
use crate::optics::polarisation::{Polarisation, Stokes, Unpolarised};
use crate::outcome::{Outcome, Totals};
use crate::path::Tracer;
use crate::random::{self, Streams};
use crate::ray::Ray;
use crate::receiver::{Receiver, Tally};
use crate::scene::Scene;
use crate::settings::{Sampling, Settings};
use crate::source_picker::SourcePicker;

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
    let groups = 0..settings.groups as u64;
    let found = trace_groups(scene, receivers, settings, control, groups)?;
    let hits = found.iter().map(|(_, hits)| hits).sum();
    let totals: Vec<Totals> = found.into_iter().map(|(totals, _)| totals).collect();
    let in_group = settings.paths.div_ceil(settings.groups as u64);
    Ok(Outcome::new(in_group * totals.len() as u64, hits, totals))
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
    let groups = groups.start..groups.end.min(settings.groups as u64);
    trace_groups(scene, receivers, settings, control, groups).map(drop)
}

/// Totals and surfaces met of `groups`, in order.
fn trace_groups(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
    control: Control<'_>,
    groups: Range<u64>,
) -> Result<Vec<(Totals, u64)>, Error> {
    settings.check()?;
    for receiver in receivers {
        scene.admits(*receiver)?;
    }

    let tracer = Tracer::new(scene, receivers, settings);
    let many = match settings.polarisation {
        Polarisation::Unpolarised => Strategy::new(scene, settings.max_bounces),
        Polarisation::Carried => Strategy::PathByPath,
    };
    let in_group = settings.paths.div_ceil(settings.groups as u64);
    groups
        .into_par_iter()
        .map(|group| {
            if let Some(stored) = stored_group(&tracer, group, in_group, control) {
                return Ok(stored);
            }
            let at = (settings.seed, group);
            let done = trace_group(&tracer, &many, in_group, at, control, &mut ())?;
            if let Some(checkpoints) = control.checkpoints {
                checkpoints.keep(group, &checkpoint::to_bytes(&done.0, done.1));
            }
            Ok(done)
        })
        .collect()
}

/// A group of `paths` paths from the checkpoints; `None` as well where its bytes are not those of
/// such a group, which is then traced anew.
fn stored_group(
    tracer: &Tracer<'_>,
    group: u64,
    paths: u64,
    control: Control<'_>,
) -> Option<(Totals, u64)> {
    let bytes = control.checkpoints?.find(group)?;
    let like = Tally::new(&tracer.receivers).totals;
    let stored = checkpoint::from_bytes(&bytes, &like)?;
    if let Some(progress) = control.progress {
        progress(paths);
    }
    Some(stored)
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
                    &Strategy::PathByPath,
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

/// Traces one group.
fn trace_group(
    tracer: &Tracer<'_>,
    many: &Strategy<'_>,
    paths: u64,
    (seed, group): (u64, u64),
    control: Control<'_>,
    observer: &mut impl Observer,
) -> Result<(Totals, u64), Error> {
    let mut rng = random::stream(seed, group);
    let mut picker = SourcePicker::new(&tracer.scene.sources, &mut rng);
    let streams = Streams::new(&mut rng);
    if tracer.sampling == Sampling::Sobol {
        picker.scramble(paths, &mut rng);
    }
    let mut tally = Tally::new(&tracer.receivers);
    let mut reported = 0;
    // Reports progress, and tells whether to go on.
    let mut keep_going = |done: u64| {
        if done >= reported + STRIDE {
            if let Some(progress) = control.progress {
                progress(done - reported);
            }
            reported = done;
        }
        !control.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    };
    let hits = match many {
        Strategy::BatchTracer(batch) => {
            batch.trace(tracer, paths, (streams, picker), &mut tally, &mut keep_going)
        }
        Strategy::MeshPackets(mesh_packets) => {
            mesh_packets.trace(tracer, paths, (streams, picker), &mut tally, &mut keep_going)
        }
        Strategy::PathByPath => {
            let mut walk = SceneWalk { tracer, picker, tally: &mut tally, observer };
            match tracer.polarisation {
                Polarisation::Unpolarised => {
                    one_by_one::<Unpolarised>(&mut walk, paths, streams, &mut keep_going)
                }
                Polarisation::Carried => {
                    one_by_one::<Stokes>(&mut walk, paths, streams, &mut keep_going)
                }
            }
        }
    };
    let hits = hits.ok_or(Error::Cancelled)?;
    if let Some(progress) = control.progress {
        progress(paths - reported);
    }
    let mut totals = tally.close();
    totals.scale(tracer.scene.power() / paths as f64);
    Ok((totals, hits))
}
