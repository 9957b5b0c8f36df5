// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sampling of order tables for a batch: each step for all rays before the next, so that waits for
//! memory overlap.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    clippy::needless_range_loop,
    reason = "codes are small whole numbers kept beside the rest; a branch or a call within a \
        loop would keep it from being compiled to wide instructions"
)]

use bsdf::Side;
use bsdf::direction::Wavevector;
use bsdf::order_table::{BinLocations, Flag, OrderTable, OrderTableBatch, SampledOrders};
use pulp::{Arch, Simd, WithSimd};

use super::kernels::PackageGeometry;
use super::lanes::{Course, LANES, Lanes, Mode};
use super::{BatchTracer, PathBatch};
use crate::surface::SurfaceModel;

/// The table of a primitive.
pub(super) fn table(optics: &SurfaceModel) -> Option<&OrderTable> {
    match optics {
        SurfaceModel::Scatter(scatter) => OrderTable::downcast(scatter.as_ref()),
        _ => None,
    }
}

/// The samples of all rays.
pub(super) struct OrderSamples {
    locations: BinLocations,
    read: [u32; LANES],
    orders: SampledOrders,
    /// Set where the sampled order does not propagate.
    stray: [Flag; LANES],
}

impl OrderSamples {
    pub fn new() -> Self {
        Self {
            locations: BinLocations::default(),
            read: [0; LANES],
            orders: SampledOrders::default(),
            stray: [Flag::NO; LANES],
        }
    }
}

impl BatchTracer<'_> {
    /// Samples an order for every ray that has met a table.
    pub(super) fn sample(
        &self,
        tables: &OrderTableBatch<'_>,
        batch: &mut PathBatch,
        active: usize,
    ) {
        let (lanes, samples) = (&mut batch.lanes, &mut batch.samples);
        let arch = Arch::new();
        arch.dispatch(Locate { tables, lanes: &*lanes, locations: &mut samples.locations });
        let mut waiting = [0_u8; LANES];
        let mut count = 0;
        for lane in 0..active {
            waiting[count & (LANES - 1)] = lane as u8;
            count += usize::from(lanes.mode[lane] == Mode::ORDERS);
        }
        let waiting = &waiting[..count];
        for &lane in waiting {
            let lane = usize::from(lane);
            if !samples.locations.found(lane) {
                let chances = [lanes.chance[0][lane], lanes.chance[1][lane]];
                let primitive = lanes.dome_primitive[lane] as usize;
                let location =
                    tables.locate_bin(primitive, from(lanes, lane), wave(lanes, lane), chances);
                samples.locations.set(lane, location);
            }
        }
        for &lane in waiting {
            let lane = usize::from(lane) & (LANES - 1);
            samples.read[lane] =
                tables.bin(lanes.dome_primitive[lane], samples.locations.bin(lane));
        }
        arch.dispatch(ReadOrders { tables, geometry: &self.geometry, lanes, samples });
        for &lane in waiting {
            if samples.stray[usize::from(lane)].is_set() {
                self.resample(tables, lanes, usize::from(lane));
            }
        }
    }

    /// Samples again for a ray whose order does not propagate: its power goes to orders that
    /// do.
    #[cold]
    fn resample(&self, tables: &OrderTableBatch<'_>, lanes: &mut Lanes, lane: usize) {
        let from = from(lanes, lane);
        let to = if lanes.to[lane] < 0.0 { Side::Inner } else { Side::Outer };
        let mut stream = lanes.stream(lane);
        let sample = tables
            .table(lanes.dome_primitive[lane] as usize)
            .and_then(|table| table.resample_propagating(from, to, wave(lanes, lane), &mut stream));
        lanes.keep(lane, stream);
        lanes.event[lane] = Flag::YES;
        let Some(sample) = sample else {
            (lanes.course[lane], lanes.to[lane]) = (Course::ABSORBED, 0.0);
            return;
        };
        let to = Side::from_direction(sample.wo);
        lanes.wave[0][lane] = sample.wo.x * self.geometry.orders[to.index()];
        lanes.to[lane] = to.sign();
        let back = to == from;
        lanes.course[lane] = if back { Course::BACK } else { Course::THROUGH };
        if back && to == Side::Inner && lanes.bounces[lane] < self.geometry.max_bounces {
            lanes.event[lane] = Flag::NO;
        }
    }
}

/// The side that a ray comes from.
#[inline]
fn from(lanes: &Lanes, lane: usize) -> Side {
    if lanes.inside[lane].is_set() { Side::Inner } else { Side::Outer }
}

/// The tangential wavevector of the incident ray.
fn wave(lanes: &Lanes, lane: usize) -> Wavevector {
    Wavevector { kx: lanes.wave[0][lane], ky: lanes.wave[1][lane] }
}

/// Finds the alias tables of all rays that have met a table; for the others, any.
struct Locate<'a, 'b> {
    tables: &'a OrderTableBatch<'b>,
    lanes: &'a Lanes,
    locations: &'a mut BinLocations,
}

impl WithSimd for Locate<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { tables, lanes, locations } = self;
        tables.locate_bins(
            &lanes.dome_primitive,
            &lanes.inside,
            &lanes.wave,
            &lanes.chance,
            locations,
        );
    }
}

/// Reads the sampled order of all rays.
struct ReadOrders<'a, 'b> {
    tables: &'a OrderTableBatch<'b>,
    geometry: &'a PackageGeometry,
    lanes: &'a mut Lanes,
    samples: &'a mut OrderSamples,
}

impl WithSimd for ReadOrders<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let OrderSamples { locations, read, orders, stray } = self.samples;
        let lanes = self.lanes;
        self.tables.orders(&lanes.dome_primitive, locations, read, &lanes.wave[0], orders);
        turn(*self.geometry, lanes, orders, stray);
    }
}

#[inline(always)]
fn turn(
    geometry: PackageGeometry,
    lanes: &mut Lanes,
    orders: &SampledOrders,
    stray: &mut [Flag; LANES],
) {
    for lane in 0..LANES {
        let ordered = lanes.mode[lane] == Mode::ORDERS;
        let (inner, absorbed) = (orders.inner[lane].is_set(), orders.absorbed[lane].is_set());
        let (kx, ky) = (orders.kx[lane], lanes.wave[1][lane]);
        let index = if inner { geometry.orders[0] } else { geometry.orders[1] };
        let kept = ordered & !absorbed;
        let propagates = kx * kx + ky * ky < index * index;
        stray[lane] = Flag::new(kept & !propagates);
        let before = lanes.wave[0][lane];
        lanes.wave[0][lane] = if kept & propagates { kx } else { before };
        let to = if inner { -1.0 } else { 1.0 };
        lanes.to[lane] = if kept { to } else { 0.0 };
        let back = inner == lanes.inside[lane].is_set();
        let course = if back { Course::BACK } else { Course::THROUGH };
        let course = if absorbed { Course::ABSORBED } else { course };
        let (before, event) = (lanes.course[lane], lanes.event[lane]);
        lanes.course[lane] = if ordered { course } else { before };
        let plain = kept & back & inner & (lanes.bounces[lane] < geometry.max_bounces);
        lanes.event[lane] = if plain { Flag::NO } else { event };
    }
}
