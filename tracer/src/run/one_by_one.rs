// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths one after the other.

use super::long_paths::{LONG, LongPaths};
use super::walk::Walker;
use crate::optics::polarisation::{Light, Polarisation, Stokes, Unpolarised};
use crate::random::Streams;

/// Paths between two readings of the cancellation flag.
pub(super) const STRIDE: u64 = 4096;

/// Traces paths one after the other; returns how many surfaces they met, `None` if stopped.
pub(super) fn trace<W: Walker<Unpolarised> + Walker<Stokes>>(
    walker: &mut W,
    polarisation: Polarisation,
    paths: u64,
    streams: Streams,
    keep_going: impl FnMut(u64) -> bool,
) -> Option<u64> {
    match polarisation {
        Polarisation::Unpolarised => one_by_one::<Unpolarised>(walker, paths, streams, keep_going),
        Polarisation::Carried => one_by_one::<Stokes>(walker, paths, streams, keep_going),
    }
}

/// [`trace`] for one kind of light; paths of more than [`LONG`] surfaces go through the roulette of [`LongPaths`].
fn one_by_one<L: Light>(
    walker: &mut impl Walker<L>,
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
        let mut path = walker.begin(done, &mut rng);
        let mut light = L::default();
        let is_over = walker.walk_to(&mut path, &mut light, &mut rng, LONG);
        hits += u64::from(path.history.bounces);
        if !is_over {
            hits += long.take(walker, (path, light, rng));
        }
    }
    Some(hits + long.finish(walker))
}
