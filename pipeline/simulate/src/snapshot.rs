// SPDX-License-Identifier: MIT OR Apache-2.0
//! Snapshots: sums of finished batches as bytes, and back to the last bit.
//!
//! Numbers take eight bytes, lowest first; texts their length and UTF-8. Bins follow from the
//! design and are not stored.

use design::Design;
use metrics::Grouped;

use super::observation::{Observation, plane_grid, sphere};

/// The bytes of the sums of `batches` batches.
pub(super) fn to_bytes(batches: u32, sums: &[Observation]) -> Vec<u8> {
    let mut out = SnapshotWriter(Vec::new());
    out.number(u64::from(batches));
    out.number(sums.len() as u64);
    for sum in sums {
        out.number(sum.paths);
        out.number(sum.surfaces_per_path.to_bits());
        out.texts(&sum.accounts);
        out.texts(&sum.depolarised_by);
        for grouped in [&sum.illuminance, &sum.far_field, &sum.flows, &sum.powers] {
            out.grouped(grouped);
        }
        out.number(sum.receivers.len() as u64);
        for receiver in &sum.receivers {
            out.grouped(receiver);
        }
    }
    out.0
}

/// Number of batches and sums; `None` where the bytes are no snapshot of `count` observations of
/// `design`.
pub(super) fn from_bytes(
    bytes: &[u8],
    design: &Design,
    count: usize,
) -> Option<(u32, Vec<Observation>)> {
    let mut from = SnapshotReader(bytes);
    let batches = u32::try_from(from.number()?).ok()?;
    if from.number()? != count as u64 {
        return None;
    }
    let mut sums = Vec::new();
    for _ in 0..count {
        let (grid, sphere) = (plane_grid(design), sphere(design));
        let (paths, surfaces) = (from.number()?, f64::from_bits(from.number()?));
        let (accounts, depolarised_by) = (from.texts()?, from.texts()?);
        let illuminance = from.grouped(grid.columns * grid.rows)?;
        let far_field = from.grouped(sphere.polar * sphere.azimuths)?;
        let (flows, powers) = (from.grouped(3)?, from.grouped(accounts.len())?);
        if from.number()? != design.receivers.len() as u64 {
            return None;
        }
        let receivers = design.receivers.iter();
        let receivers = receivers
            .map(|receiver| from.grouped(receiver.detector.bins()))
            .collect::<Option<_>>()?;
        sums.push(Observation {
            paths,
            surfaces_per_path: surfaces,
            illuminance,
            grid,
            far_field,
            sphere,
            flows,
            accounts,
            powers,
            receivers,
            depolarised_by,
            luminous: None,
            photons: None,
            colours: None,
        });
    }
    from.0.is_empty().then_some((batches, sums))
}

struct SnapshotWriter(Vec<u8>);

impl SnapshotWriter {
    fn number(&mut self, number: u64) {
        self.0.extend(number.to_le_bytes());
    }

    fn texts(&mut self, texts: &[String]) {
        self.number(texts.len() as u64);
        for text in texts {
            self.number(text.len() as u64);
            self.0.extend(text.as_bytes());
        }
    }

    fn grouped(&mut self, grouped: &Grouped) {
        self.number(grouped.count() as u64);
        self.number(grouped.total().len() as u64);
        for group in 0..grouped.count() {
            for value in grouped.group(group) {
                self.number(value.to_bits());
            }
        }
    }
}

struct SnapshotReader<'a>(&'a [u8]);

impl<'a> SnapshotReader<'a> {
    fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn number(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.bytes(8)?.try_into().ok()?))
    }

    fn texts(&mut self) -> Option<Vec<String>> {
        let count = self.number()?;
        (0..count)
            .map(|_| {
                let length = usize::try_from(self.number()?).ok()?;
                String::from_utf8(self.bytes(length)?.to_vec()).ok()
            })
            .collect()
    }

    /// Groups of this many bins.
    fn grouped(&mut self, bins: usize) -> Option<Grouped> {
        let groups = usize::try_from(self.number()?).ok()?;
        let length = usize::try_from(self.number()?).ok()?;
        if groups < 2 || bins != length {
            return None;
        }
        let groups = (0..groups).map(|_| {
            let bytes = self.bytes(length.checked_mul(8)?)?;
            let values = bytes.as_chunks().0.iter();
            Some(values.map(|eight| f64::from_le_bytes(*eight)).collect())
        });
        Some(Grouped::new(groups.collect::<Option<_>>()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use runtime::interrupt::Interrupt;
    use runtime::run_context::RunContext;

    use crate::dome_surface::dome_surface;
    use crate::model::Model;
    use crate::trace::observe;

    #[test]
    fn sums_come_back_to_the_bit_and_nothing_else_does() {
        let mut design = design::embedded("d1.toml").expect("valid");
        (design.receiver.bin_mm, design.receiver.read_bin_mm) = (1.0, None);
        let surface = dome_surface(&design, Model::Geometric, None).expect("a dome");
        let interrupt = Interrupt::default();
        let seen = |seed| {
            let context = RunContext::quiet(&interrupt, seed);
            observe(&design, &surface, 2000, "", context).expect("a trace")
        };
        let mut sums = vec![seen(1), seen(2)];
        sums[1].depolarised_by = vec!["bottom".to_owned()];
        let bytes = to_bytes(7, &sums);
        let (batches, back) = from_bytes(&bytes, &design, 2).expect("sums");
        assert_eq!(batches, 7);
        // NaN would not be equal to itself: there is none.
        for (a, b) in sums.iter().zip(&back) {
            assert_eq!(
                (a.paths, &a.accounts, &a.depolarised_by),
                (b.paths, &b.accounts, &b.depolarised_by)
            );
            assert_eq!(a.surfaces_per_path.to_bits(), b.surfaces_per_path.to_bits());
            let all = |o: &Observation| {
                [&o.illuminance, &o.far_field, &o.flows, &o.powers].map(Clone::clone)
            };
            assert_eq!(all(a), all(b));
        }
        assert_eq!(to_bytes(7, &back), bytes);
        for wrong in [&bytes[..bytes.len() - 1], &bytes[..40], &[]] {
            assert!(from_bytes(wrong, &design, 2).is_none());
        }
        assert!(from_bytes(&bytes, &design, 1).is_none());
        let mut other = design.clone();
        other.far_field.bin_deg = 5.0;
        assert!(from_bytes(&bytes, &other, 2).is_none());
    }
}
