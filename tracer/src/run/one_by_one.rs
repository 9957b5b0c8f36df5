// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths one after the other.

use super::long_paths::{LONG, LongPaths};
use super::walk::Walk;
use crate::optics::polarisation::{Light, Polarisation, Stokes, Unpolarised};
use crate::random::Streams;

/// Paths between two readings of the cancellation flag.
pub(super) const STRIDE: u64 = 4096;

/// Traces paths one after the other; returns how many surfaces they met, `None` if stopped.
pub(super) fn trace<W: Walk<Unpolarised> + Walk<Stokes>>(
    walk: &mut W,
    polarisation: Polarisation,
    paths: u64,
    streams: Streams,
    keep_going: impl FnMut(u64) -> bool,
) -> Option<u64> {
    match polarisation {
        Polarisation::Unpolarised => one_by_one::<Unpolarised>(walk, paths, streams, keep_going),
        Polarisation::Carried => one_by_one::<Stokes>(walk, paths, streams, keep_going),
    }
}

fn one_by_one<L: Light>(
    walk: &mut impl Walk<L>,
    paths: u64,
    streams: Streams,
    mut keep_going: impl FnMut(u64) -> bool,
) -> Option<u64> {
    let mut hits = 0;
    let mut long = LongPaths::default();
    for done in 0..paths {
        if done % STRIDE == 0 && !keep_going(done) {
            return None;
        }
        let mut rng = streams.path(done);
        let mut path = walk.begin(done, &mut rng);
        let mut light = L::default();
        let is_over = walk.walk_to(&mut path, &mut light, &mut rng, LONG);
        hits += u64::from(path.history.bounces);
        if !is_over {
            hits += long.take(walk, (path, light, rng));
        }
    }
    Some(hits + long.finish(walk))
}
