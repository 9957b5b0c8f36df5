// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sums of one group of paths: the ledger, and the readings of all receivers.
//!
//! The tally takes segments and interactions in the order in which a tracer finds them. It sorts
//! segments into bins many at a time, in that order, so each bin is the same sum as one taken
//! segment by segment.

use bsdf::Side;
use glam::DVec3;

use super::filter::{CompiledFilter, lines_named};
use super::ray_buffer::{NO_BIN, RAY_BUFFER, RayBuffer};
use super::{Needs, PathHistory, Receiver, STOKES};
use crate::ledger::{Booking, Ledger, Loss};
use crate::observer::Fate;
use crate::optics::polarisation::Light;
use crate::outcome::Totals;
use crate::ray::Ray;
use crate::scene::Scene;

/// A receiver with names replaced by lines of the ledger.
struct CompiledReceiver<'a> {
    receiver: &'a dyn Receiver,
    bins: usize,
    /// Lines of the surfaces that it reads; `None` for one that reads segments.
    surfaces: Option<Vec<usize>>,
    filter: Option<CompiledFilter<'a>>,
    stokes_axis: Option<DVec3>,
    /// True if no segment of the run can reach it.
    is_idle: bool,
    /// True if it reads light traced backwards, and passes over the same light traced forwards.
    is_viewer: bool,
}

/// All receivers of a run.
pub(crate) struct Receivers<'a> {
    scene: &'a Scene,
    all: Vec<CompiledReceiver<'a>>,
    /// Length from which segments are read: 0, or infinite where all read escapes alone; NaN for
    /// none.
    read_from: f64,
    /// True if any reads surfaces.
    surfaces: bool,
    /// True if any asks for the past of light.
    history: bool,
    light: bool,
}

impl<'a> Receivers<'a> {
    /// Passes over the receivers of these numbers, which no segment can reach.
    pub fn leave_out(&mut self, numbers: impl IntoIterator<Item = usize>) {
        numbers.into_iter().for_each(|number| self.all[number].is_idle = true);
    }

    /// Has the receivers of these numbers read light traced backwards.
    pub fn look_back(&mut self, numbers: impl IntoIterator<Item = usize>) {
        numbers.into_iter().for_each(|number| self.all[number].is_viewer = true);
        self.history = true;
    }

    /// True if any reads segments that end at a surface.
    pub fn read_segments(&self) -> bool {
        self.read_from <= 0.0
    }

    /// True if any needs every interaction.
    pub fn observe_interactions(&self) -> bool {
        self.surfaces || self.all.iter().any(|receiver| receiver.filter.is_some())
    }

    /// Receivers that fit the scene.
    pub fn new(scene: &'a Scene, receivers: &[&'a dyn Receiver]) -> Self {
        let compiled = |receiver: &&'a dyn Receiver| CompiledReceiver {
            receiver: *receiver,
            bins: receiver.bins(),
            surfaces: match receiver.needs() {
                Needs::Surface(name) => Some(lines_named(&scene.lines, name)),
                Needs::Segments | Needs::Escapes => None,
            },
            filter: receiver.filter().map(|filter| CompiledFilter::new(filter, &scene.lines)),
            stokes_axis: receiver.stokes_axis(),
            is_idle: false,
            is_viewer: false,
        };
        let all: Vec<_> = receivers.iter().map(compiled).collect();
        let needs = |wanted: fn(Needs<'_>) -> bool| receivers.iter().any(|r| wanted(r.needs()));
        Self {
            scene,
            read_from: if needs(|needs| needs == Needs::Segments) {
                0.0
            } else if needs(|needs| needs == Needs::Escapes) {
                f64::INFINITY
            } else {
                f64::NAN
            },
            surfaces: needs(|needs| matches!(needs, Needs::Surface(_))),
            history: all.iter().any(|receiver| receiver.filter.is_some()),
            light: all.iter().any(|receiver| receiver.stokes_axis.is_some()),
            all,
        }
    }
}

/// Bins without light, written at once: pages of zeros that are read before they are written would
/// be mapped twice.
fn dark(bins: usize) -> Vec<f64> {
    let mut readings = Vec::with_capacity(bins);
    readings.resize(bins, 0.0);
    readings
}

/// The sums of a group of paths, and the segments that wait to be sorted into them.
pub(crate) struct Tally<'a> {
    pub totals: Totals,
    receivers: &'a Receivers<'a>,
    segments: RayBuffer,
}

impl<'a> Tally<'a> {
    /// Without light.
    pub fn new(receivers: &'a Receivers<'a>) -> Self {
        Self {
            totals: Totals {
                ledger: Ledger::new(&receivers.scene.lines),
                readings: receivers.all.iter().map(|r| dark(r.bins)).collect(),
            },
            receivers,
            segments: RayBuffer::default(),
        }
    }

    /// Everything sorted.
    pub fn close(mut self) -> Totals {
        self.sort();
        self.totals
    }

    /// Shows light that travels `length` mm through the world to the receivers, infinite where it
    /// leaves the scene for good.
    #[inline]
    pub fn segment<L: Light>(
        &mut self,
        ray: &Ray,
        length: f64,
        weight: f64,
        history: &PathHistory,
        light: &L,
    ) {
        let receivers = self.receivers;
        let read = length >= receivers.read_from;
        if !read {
            return;
        }
        self.segments.push(ray, length, weight);
        if receivers.history {
            self.segments.history.push(*history);
        }
        if receivers.light {
            self.segments.light.push(light.stokes());
        }
        if self.segments.count == RAY_BUFFER {
            self.sort();
        }
    }

    /// Shows light traced backwards to the receivers that read it.
    pub fn view(&mut self, ray: &Ray, length: f64, weight: f64, history: &PathHistory) {
        for (receiver, readings) in self.receivers.all.iter().zip(&mut self.totals.readings) {
            let filter = &receiver.filter;
            if receiver.is_viewer
                && filter.as_ref().is_none_or(|filter| filter.passes(history))
                && let Some(bin) = receiver.receiver.bin(ray, length)
            {
                readings[bin] += weight;
            }
        }
    }

    /// Books an event in the ledger.
    #[expect(clippy::inline_always, reason = "part of the loop over a path")]
    #[inline(always)]
    pub fn book(&mut self, event: Booking) {
        self.totals.ledger.book(event);
    }

    /// Books light that leaves the scene for good.
    #[inline]
    pub fn escape(&mut self, direction: DVec3, weight: f64) -> Fate {
        let upward = direction.z >= 0.0;
        self.book(Booking::Escape { upward, weight });
        if upward { Fate::EscapedUp } else { Fate::EscapedDown }
    }

    /// Books light that is given up.
    #[inline]
    pub fn lose(&mut self, cause: Loss, weight: f64) -> Fate {
        self.book(Booking::Loss { cause, weight });
        Fate::Lost(cause)
    }

    /// Adds the weights of all segments to the bins that the receivers name.
    fn sort(&mut self) {
        let segments = &mut self.segments;
        let mut bins = [NO_BIN; RAY_BUFFER];
        for (receiver, readings) in self.receivers.all.iter().zip(&mut self.totals.readings) {
            if receiver.surfaces.is_some() || receiver.is_idle {
                continue;
            }
            receiver.receiver.bin_many(segments, &mut bins);
            let needs_past = receiver.filter.is_some() || receiver.is_viewer;
            if !needs_past && receiver.stokes_axis.is_none() {
                add_all(&bins[..segments.count], &segments.weight, readings);
                continue;
            }
            for (k, bin) in bins.iter().enumerate().take(segments.count) {
                let past = || &segments.history[k];
                let filtered = receiver.filter.as_ref().is_some_and(|f| !f.passes(past()))
                    || (receiver.is_viewer && past().is_seen);
                if *bin == NO_BIN || filtered {
                    continue;
                }
                readings[*bin as usize] += segments.weight[k];
                if let Some(axis) = receiver.stokes_axis {
                    read_stokes(segments, k, axis, readings, *bin as usize);
                }
            }
        }
        segments.clear();
    }

    /// Shows an interaction with the surface of this line of the ledger to the receivers: the
    /// weight that arrives and the weight that goes on.
    #[inline]
    pub fn interaction(
        &mut self,
        line: usize,
        sides: [Side; 2],
        weights: [f64; 2],
        history: &PathHistory,
    ) {
        if self.receivers.surfaces {
            self.read_surface(line, sides, weights, history);
        }
    }

    #[inline(never)]
    fn read_surface(
        &mut self,
        line: usize,
        [from, to]: [Side; 2],
        [arrived, weight]: [f64; 2],
        history: &PathHistory,
    ) {
        let first = match from {
            Side::Inner => 0,
            Side::Outer => 3,
        };
        for (receiver, bins) in self.receivers.all.iter().zip(&mut self.totals.readings) {
            let read = receiver.surfaces.as_ref().is_some_and(|s| s.contains(&line));
            if !read || receiver.filter.as_ref().is_some_and(|f| !f.passes(history)) {
                continue;
            }
            bins[first] += arrived;
            bins[first + 1] += arrived - weight;
            if from != to {
                bins[first + 2] += weight;
            }
        }
    }
}

/// Adds the weights of rays to their bins.
fn add_all(bins: &[u32], weights: &[f64], readings: &mut [f64]) {
    for (&bin, &weight) in bins.iter().zip(weights) {
        // Bin 0 takes nothing from a ray without a bin: a branch here would be left to chance.
        let (bin, weight) = if bin == NO_BIN { (0, 0.0) } else { (bin, weight) };
        readings[bin as usize] += weight;
    }
}

/// Adds Q, U and V of segment `k`, referred to s = `axis` × k, to their bins.
fn read_stokes(segments: &RayBuffer, k: usize, axis: DVec3, readings: &mut [f64], bin: usize) {
    let direction = segments.ray(k).direction;
    let s =
        axis.cross(direction).try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
    let light = segments.light[k].turned(direction, s);
    let bins = readings.len() / STOKES.len();
    for (number, parameter) in (1..).zip([light.q, light.u, light.v]) {
        readings[number * bins + bin] += segments.weight[k] * parameter;
    }
}
