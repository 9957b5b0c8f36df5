// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finished groups of paths as bytes, so that a run that was stopped goes on where it was.
//!
//! A group is a function of scene, receivers, settings and its number; what it found is a list of
//! numbers. [`crate::run_with`] shows every finished group to a [`CheckpointStore`], and asks it
//! for each before it traces it. Numbers go to bytes and back without a change, and groups are
//! added up in order in any case, so that a run put together from kept and new groups is the same
//! to the last bit. Where the bytes go, and whether they are still those of this run, is the
//! store's affair.

use crate::outcome::Totals;

/// Keeps finished groups.
pub trait CheckpointStore: Sync {
    /// The bytes of group `group`, if they were kept by a run of the same scene, receivers,
    /// settings and program.
    fn find(&self, group: u64) -> Option<Vec<u8>>;

    /// Takes the bytes of a finished group; called from any thread, each group once.
    fn keep(&self, group: u64, bytes: &[u8]);
}

/// Bytes of a group: the number of surfaces met, how many numbers follow, and these,
/// each in eight bytes, the lowest first.
pub(crate) fn to_bytes(totals: &Totals, hits: u64) -> Vec<u8> {
    let mut totals = totals.clone();
    let numbers: Vec<f64> = totals.powers().map(|power| *power).collect();
    let mut bytes = Vec::with_capacity(8 * (numbers.len() + 2));
    bytes.extend(hits.to_le_bytes());
    bytes.extend((numbers.len() as u64).to_le_bytes());
    for number in numbers {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}

/// Reads what [`to_bytes`] made into totals of the same lines and bins as `like`; `None` where the
/// bytes are not those of such a group.
pub(crate) fn from_bytes(bytes: &[u8], like: &Totals) -> Option<(Totals, u64)> {
    let mut words = bytes.chunks_exact(8);
    if !words.remainder().is_empty() {
        return None;
    }
    let mut next = || -> Option<[u8; 8]> { words.next()?.try_into().ok() };
    let hits = u64::from_le_bytes(next()?);
    let count = u64::from_le_bytes(next()?);
    let mut totals = like.clone();
    if totals.powers().count() as u64 != count || bytes.len() as u64 != 8 * (count + 2) {
        return None;
    }
    for power in totals.powers() {
        *power = f64::from_le_bytes(next()?);
    }
    Some((totals, hits))
}
