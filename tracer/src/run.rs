// SPDX-License-Identifier: MIT OR Apache-2.0
//! A run: a scene, receivers and a seed in, totals for each group of paths out.
//!
//! The paths are cut into a fixed number of groups. Each has its own random stream, chosen by (seed, group), and its own
//! totals; groups are computed in parallel on the current rayon pool and collected in order. So the same seed
//! gives the same bits on any number of threads.

use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, check};
use crate::ledger::Ledger;
use crate::outcome::{Outcome, Totals};
use crate::path::Tracer;
use crate::random;
use crate::ray::Ray;
use crate::receiver::Receiver;
use crate::scene::Scene;

/// Paths between two looks at the cancellation flag.
const STRIDE: u64 = 4096;

/// Fractional part of the golden ratio: steps of it spread evenly over [0, 1) however many are taken.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// How much to trace, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Number of paths; rounded up to a multiple of `groups`.
    pub paths: u64,
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of groups, at least 2; standard errors come from their scatter.
    pub groups: usize,
    /// Flights between surfaces that a path may make before it is given up.
    pub max_bounces: u32,
    /// Weight, from 0 to 1, below which absorption takes all or nothing.
    pub roulette_below: f64,
}

impl Settings {
    /// 64 groups, 10 000 bounces, all or nothing below a weight of 0.1.
    pub fn new(paths: u64, seed: u64) -> Self {
        Self {
            paths,
            seed,
            groups: 64,
            max_bounces: 10_000,
            roulette_below: 0.1,
        }
    }
}

/// How a running trace speaks with its caller.
#[derive(Clone, Copy, Default)]
pub struct Control<'a> {
    /// Called now and then, from any thread, with the number of paths done since its last call.
    pub progress: Option<&'a (dyn Fn(u64) + Sync)>,
    /// Raise it to stop the run, which then returns [`Error::Cancelled`].
    pub cancel: Option<&'a AtomicBool>,
}

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
    validate(settings)?;
    for receiver in receivers {
        receiver.check(scene.top_mm())?;
    }

    let tracer = Tracer {
        scene,
        receivers,
        max_bounces: settings.max_bounces,
        roulette_below: settings.roulette_below,
    };
    let in_group = settings.paths.div_ceil(settings.groups as u64);
    let groups: Vec<(Totals, u64)> = (0..settings.groups as u64)
        .into_par_iter()
        .map(|group| {
            trace_group(
                &tracer,
                in_group,
                settings.seed,
                group,
                control,
                &mut |_, _| {},
            )
        })
        .collect::<Result<_, _>>()?;
    let hits = groups.iter().map(|(_, hits)| hits).sum();
    let totals = groups.into_iter().map(|(totals, _)| totals).collect();
    Ok(Outcome::new(
        in_group * settings.groups as u64,
        hits,
        totals,
    ))
}

/// Checks the settings.
fn validate(settings: &Settings) -> Result<(), Error> {
    if settings.groups < 2 {
        return Err(Error::TooFew {
            what: "groups of paths",
            expected: 2,
            got: settings.groups,
        });
    }
    for (what, value) in [
        ("paths", settings.paths as f64),
        ("bounces", f64::from(settings.max_bounces)),
    ] {
        check(what, value, "at least 1", value >= 1.0)?;
    }
    crate::error::fraction("threshold of the roulette", settings.roulette_below).map(|_| ())
}

/// Rays with their powers, W.
type Leaving = Vec<(Ray, f64)>;

/// Groups whose rays are kept at once by [`run_rays`].
const AT_ONCE: u64 = 16;
/// Paths of one group of [`run_rays`].
const IN_GROUP: u64 = 16_384;

/// Traces a scene and hands every ray that leaves it for good to `take`, with its power in W, in an order that does not depend on the number of
/// threads. Groups have 16 384 paths each, whatever `settings` asks for, and 16 of them are kept in memory; their number follows from
/// `settings.paths`. The sum of the powers is the escaped power of the outcome.
pub fn run_rays(
    scene: &Scene,
    settings: &Settings,
    control: Control<'_>,
    mut take: impl FnMut(&Ray, f64) -> Result<(), Error>,
) -> Result<Outcome, Error> {
    validate(settings)?;
    let tracer = Tracer {
        scene,
        receivers: &[],
        max_bounces: settings.max_bounces,
        roulette_below: settings.roulette_below,
    };
    let count = settings.paths.div_ceil(IN_GROUP).max(2);
    let paths = settings.paths.div_ceil(count);
    let scale = scene.power() / (paths * count) as f64;
    let (mut totals, mut hits) = (Vec::new(), 0);
    for begin in (0..count).step_by(AT_ONCE as usize) {
        let batch: Vec<(Totals, u64, Leaving)> = (begin..(begin + AT_ONCE).min(count))
            .into_par_iter()
            .map(|group| {
                let mut rays = Vec::new();
                let mut keep = |ray: &Ray, weight: f64| rays.push((*ray, weight * scale));
                let (totals, hits) =
                    trace_group(&tracer, paths, settings.seed, group, control, &mut keep)?;
                Ok((totals, hits, rays))
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

fn trace_group(
    tracer: &Tracer<'_>,
    paths: u64,
    seed: u64,
    group: u64,
    control: Control<'_>,
    escaped: &mut impl FnMut(&Ray, f64),
) -> Result<(Totals, u64), Error> {
    let mut rng = random::stream(seed, group);
    let mut totals = Totals {
        ledger: Ledger::new(&tracer.scene.lines),
        readings: tracer
            .receivers
            .iter()
            .map(|receiver| vec![0.0; receiver.bins()])
            .collect(),
    };
    let mut hits = 0;
    let slots = &tracer.scene.slots;
    let mut pick = random::unit(&mut rng);
    for done in 0..paths {
        if done % STRIDE == 0 {
            if control
                .cancel
                .is_some_and(|cancel| cancel.load(Ordering::Relaxed))
            {
                return Err(Error::Cancelled);
            }
            if done > 0
                && let Some(progress) = control.progress
            {
                progress(STRIDE);
            }
        }
        // Sources take turns in proportion to their weights: a random start, then golden steps.
        pick = (pick + GOLDEN).fract();
        let slot = &slots[slots
            .partition_point(|slot| slot.cumulated <= pick)
            .min(slots.len() - 1)];
        let ray = slot.source.sample(tracer.scene.offset(), &mut rng);
        hits += tracer.follow(ray, slot.place, &mut rng, &mut totals, escaped);
    }
    if let Some(progress) = control.progress {
        progress((paths - 1) % STRIDE + 1);
    }
    let scale = tracer.scene.power() / paths as f64;
    totals.scale(scale);
    Ok((totals, hits))
}
