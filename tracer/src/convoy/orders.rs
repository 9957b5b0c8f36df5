// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of orders for the rays of a convoy: each step of a draw for all rays before the next one, so that the waits for memory overlap.

use bsdf::Side;
use bsdf::direction::Tangential;
use bsdf::orders::{OrderSearch, OrderTable};

use super::step::{LANES, Lanes, mode};
use super::{Convoy, Piece};
use crate::surface::Optics;

/// The table of a piece.
pub(super) fn table(optics: &Optics) -> Option<&OrderTable> {
    match optics {
        Optics::Scatter(scatter) => scatter.orders(),
        _ => None,
    }
}

/// What became of a draw, as [`Lanes::back`] tells it.
pub(super) const ABSORBED: f64 = -1.0;

/// A ray whose order is being drawn.
#[derive(Clone, Copy)]
struct Draw<'a> {
    lane: usize,
    table: &'a OrderTable,
    from: Side,
    node: usize,
}

impl Convoy<'_> {
    /// Draws an order for every ray that has met a table.
    pub(super) fn draw(&self, lanes: &mut Lanes, flying: usize) {
        let Some(first) = self.pieces.iter().find_map(|piece| piece.table) else {
            return;
        };
        let mut draws = [Draw {
            lane: 0,
            table: first,
            from: Side::Inner,
            node: 0,
        }; LANES];
        let mut count = 0;
        for lane in 0..flying {
            lanes.to[lane] = 0.0;
            if lanes.mode[lane] != mode::ORDERS {
                continue;
            }
            let Piece {
                table: Some(table), ..
            } = self.pieces[self.met(lanes, lane)]
            else {
                continue;
            };
            let from = if lanes.inside[lane] > 0.0 {
                Side::Inner
            } else {
                Side::Outer
            };
            let node = table.locate(from, wave(lanes, lane), lanes.chance[0][lane]);
            draws[count] = Draw {
                lane,
                table,
                from,
                node,
            };
            count += 1;
        }
        let draws = &draws[..count];
        let mut searches = [OrderSearch::NONE; LANES];
        let mut steps = 0;
        let mut firsts = [0; LANES];
        for (first, draw) in firsts.iter_mut().zip(draws) {
            *first = draw.table.first(draw.node);
        }
        for ((search, first), draw) in searches.iter_mut().zip(firsts).zip(draws) {
            *search = draw
                .table
                .search(draw.node, first, lanes.chance[1][draw.lane]);
        }
        for search in &searches[..count] {
            steps = steps.max(search.steps());
        }
        for _ in 0..steps {
            for (search, draw) in searches.iter_mut().zip(draws) {
                draw.table.narrow(search);
            }
        }
        for (draw, search) in draws.iter().zip(&searches) {
            let (lane, from) = (draw.lane, draw.from);
            let order = draw.table.found(search);
            let Some((to, order)) = order else {
                lanes.back[lane] = ABSORBED;
                continue;
            };
            let before = wave(lanes, lane);
            let kx = before.kx + f64::from(order) * draw.table.zone();
            let index = self.frame.orders[to.index()];
            let (kx, to) = if kx * kx + before.ky * before.ky < index * index {
                (kx, to)
            } else {
                // Its power goes to orders that propagate.
                let mut stream = lanes.stream(lane);
                let sample = draw.table.redraw((from, to), before, &mut stream);
                lanes.keep(lane, stream);
                let Some(sample) = sample else {
                    lanes.back[lane] = ABSORBED;
                    continue;
                };
                let to = Side::of(sample.wo);
                (sample.wo.x * self.frame.orders[to.index()], to)
            };
            lanes.wave[0][lane] = kx;
            lanes.to[lane] = to.sign();
            let back = to == from;
            lanes.back[lane] = if back { 1.0 } else { 0.0 };
            if back && lanes.bounces[lane] < self.frame.most {
                lanes.event[lane] = 0.0;
            }
        }
    }
}

/// The tangential wavevector of a ray before it is sent on.
#[inline]
fn wave(lanes: &Lanes, lane: usize) -> Tangential {
    Tangential {
        kx: lanes.wave[0][lane],
        ky: lanes.wave[1][lane],
    }
}
