// SPDX-License-Identifier: MIT OR Apache-2.0
//! Groups of paths: taken from the checkpoints that keep them, traced and kept where none do.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::Ordering;

use super::control::Control;
use super::one_by_one::STRIDE;
use crate::checkpoint;
use crate::error::Error;
use crate::outcome::{Outcome, Totals};
use crate::path::Tracer;
use crate::random::{self, Streams};
use crate::settings::{Sampling, Settings};
use crate::source_picker::SourcePicker;

/// Totals of all channels, and surfaces met.
pub(super) type Group = (Vec<Totals>, u64);

/// Groups of these numbers in order, as far as `settings` has them: from the checkpoints, or by
/// `trace`, whose groups the checkpoints keep. `like` makes totals of one of the `channels`; stored
/// bytes of others are passed over.
pub(super) fn resumed(
    settings: &Settings,
    control: Control<'_>,
    numbers: Range<u64>,
    channels: usize,
    like: impl Fn() -> Totals + Sync,
    trace: impl Fn(u64) -> Result<Group, Error> + Sync,
) -> Result<Vec<Group>, Error> {
    let one = |number: u64| {
        if let Some(stored) = stored(control, number, channels, &like) {
            if let Some(progress) = control.progress {
                progress(settings.in_group());
            }
            return Ok(stored);
        }
        let done = trace(number)?;
        if let Some(checkpoints) = control.checkpoints {
            let bytes: Vec<u8> =
                done.0.iter().flat_map(|totals| checkpoint::to_bytes(totals, done.1)).collect();
            checkpoints.keep(number, &bytes);
        }
        Ok(done)
    };
    let numbers = numbers.start..numbers.end.min(settings.groups as u64);
    numbers.into_par_iter().map(one).collect()
}

/// A group from the checkpoints, the channels one after the other.
fn stored(
    control: Control<'_>,
    number: u64,
    channels: usize,
    like: impl Fn() -> Totals,
) -> Option<Group> {
    let bytes = control.checkpoints?.find(number)?;
    let (like, size) = (like(), bytes.len() / channels);
    let all: Option<Vec<(Totals, u64)>> = (0..channels)
        .map(|k| checkpoint::from_bytes(bytes.get(k * size..(k + 1) * size)?, &like))
        .collect();
    let all = all?;
    let hits = all.first()?.1;
    Some((all.into_iter().map(|(totals, _)| totals).collect(), hits))
}

/// The outcome of each channel.
pub(super) fn outcomes(settings: &Settings, channels: usize, groups: Vec<Group>) -> Vec<Outcome> {
    let paths = settings.in_group() * groups.len() as u64;
    let hits = groups.iter().map(|(_, hits)| hits).sum();
    let mut of_channels: Vec<Vec<Totals>> = vec![Vec::new(); channels];
    for (totals, _) in groups {
        of_channels.iter_mut().zip(totals).for_each(|(channel, of_group)| channel.push(of_group));
    }
    of_channels.into_iter().map(|groups| Outcome::new(paths, hits, groups)).collect()
}

/// The choice of sources and the streams of a group of `paths` paths.
pub(super) fn begin<'a>(
    tracer: &Tracer<'a>,
    (seed, group): (u64, u64),
    paths: u64,
) -> (SourcePicker<'a>, Streams) {
    let mut rng = random::stream(seed, group);
    let mut picker = SourcePicker::new(&tracer.scene.sources, &mut rng);
    let streams = Streams::new(&mut rng);
    if tracer.sampling == Sampling::Sobol {
        picker.scramble(paths, &mut rng);
    }
    (picker, streams)
}

/// Progress of a group.
pub(super) struct Progress<'a> {
    control: Control<'a>,
    reported: u64,
}

impl<'a> Progress<'a> {
    pub fn new(control: Control<'a>) -> Self {
        Self { control, reported: 0 }
    }

    /// Reports now and then how many paths are done, and tells whether to go on.
    pub fn keep_going(&mut self, done: u64) -> bool {
        if done >= self.reported + STRIDE {
            self.report(done);
        }
        !self.control.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// Reports how many paths are done.
    pub fn report(&mut self, done: u64) {
        if let Some(progress) = self.control.progress {
            progress(done - self.reported);
        }
        self.reported = done;
    }
}
