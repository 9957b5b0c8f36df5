// SPDX-License-Identifier: MIT OR Apache-2.0
//! The samples of a tolerance analysis by their offsets, and the order of all traces.

use anyhow::Result;

use design::dotted_keys::Settings;
use simulate::symmetry::of_maps;

use super::definition::ToleranceAnalysis;
use super::deviations::{Deviations, Offset};

/// Traces of the design without deviations, each with a seed of its own: its error hardly counts
/// beside that of the samples.
const NOMINAL_TRACES: u64 = 16;

/// Object of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Traced {
    /// The design.
    Nominal,
    /// The design, read without averaging over symmetries.
    Unaveraged,
    /// A sample by its number.
    Sample(usize),
}

/// Offsets of a sample, and the keys that they set.
pub(super) struct Drawn {
    pub offsets: Vec<Offset>,
    pub settings: Settings,
}

/// The offsets of all samples, in order. Traces are numbered, those of the design first.
pub(super) struct DrawnSamples {
    pub samples: Vec<Drawn>,
    /// True where any of them lacks a symmetry of the design.
    pub breaks_symmetry: bool,
}

impl DrawnSamples {
    /// Draws the samples of `analysis` by the random numbers of `seed`.
    ///
    /// # Errors
    /// Deviations that set what the design does not have.
    pub fn new(analysis: &ToleranceAnalysis, seed: u64) -> Result<Self> {
        let mut random = Deviations::random(seed);
        let draw = |_| {
            let of = &analysis.deviations;
            let offsets = of.draw(&analysis.source, &mut random)?;
            let settings = of.settings(&analysis.source, &offsets)?;
            Ok(Drawn { offsets, settings })
        };
        let samples: Vec<Drawn> = (0..analysis.samples).map(draw).collect::<Result<_>>()?;
        let of_design = of_maps(&analysis.design);
        let lacks = |drawn: &Drawn| {
            let sample = analysis.source.with(&drawn.settings);
            sample.is_ok_and(|sample| of_maps(&sample) < of_design)
        };
        let breaks_symmetry = samples.iter().any(lacks);
        Ok(Self { samples, breaks_symmetry })
    }

    /// Traces of the design.
    pub fn nominal(&self) -> u64 {
        NOMINAL_TRACES * (1 + u64::from(self.breaks_symmetry))
    }

    /// Traces of all.
    pub fn traces(&self) -> u64 {
        self.nominal() + self.samples.len() as u64
    }

    /// Object of the trace `number`.
    pub fn traced(&self, number: u64) -> Traced {
        match number.checked_sub(self.nominal()) {
            Some(sample) => Traced::Sample(sample as usize),
            None if number < NOMINAL_TRACES => Traced::Nominal,
            None => Traced::Unaveraged,
        }
    }
}
