// SPDX-License-Identifier: MIT OR Apache-2.0
//! The traces of a tolerance analysis as pieces of a job that several processes share.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use runtime::run_context::RunContext;
use simulate::job::{Cost, Task};
use simulate::model::Model;
use simulate::tables::Ring;

use super::definition::ToleranceAnalysis;
use super::drawn_samples::DrawnSamples;
use super::sample_tracer::{SampleTracer, entries};

/// Samples that tell what all have in common.
const FEW: usize = 16;

/// The traces of `analysis` with this seed, for several processes to share: those without
/// deviations and the samples.
///
/// # Errors
/// Deviations that set what the design does not have.
pub fn shared_traces(analysis: ToleranceAnalysis, seed: u64) -> Result<Vec<SharedTraces>> {
    let nominal = rings(&analysis, &analysis.design);
    // Every sample has about as many rings of its own as the first one that makes a design.
    let drawn = DrawnSamples::new(&analysis, seed)?;
    let of_design = 0..drawn.nominal();
    let of_samples = drawn.nominal()..drawn.traces();
    let mut designs = drawn.samples.iter().map(|of| analysis.source.with(&of.settings));
    let first = designs.find_map(Result::ok);
    let of_sample = first.map_or_else(Vec::new, |design| rings(&analysis, &design));
    let is_shared = |ring: &Ring| nominal.iter().any(|other| other.key == ring.key);
    let (shared, own): (Vec<&Ring>, Vec<&Ring>) = of_sample.iter().partition(|r| is_shared(r));
    let own = Cost::of_tables(own);
    let analysis = Arc::new(analysis);
    let traces = |numbers, needs_tables, own_tables| SharedTraces {
        analysis: Arc::clone(&analysis),
        seed,
        numbers,
        needs_tables,
        own_tables,
    };
    Ok(vec![
        traces(of_design, !nominal.is_empty(), Cost::default()),
        traces(of_samples, !shared.is_empty(), own),
    ])
}

/// Number of the traces of `analysis`; few samples tell whether they break symmetries.
///
/// # Errors
/// Deviations that set what the design does not have.
pub fn trace_count(analysis: &ToleranceAnalysis) -> Result<u64> {
    let few = ToleranceAnalysis { samples: analysis.samples.min(FEW), ..analysis.clone() };
    Ok(DrawnSamples::new(&few, 0)?.nominal() + analysis.samples as u64)
}

/// Rings whose tables a trace of `design` needs, each once.
fn rings(analysis: &ToleranceAnalysis, design: &Design) -> Vec<Ring> {
    // With several wavelengths, each has tables of its own.
    if analysis.model != Model::Hybrid || design.all_lights().is_some() {
        return Vec::new();
    }
    let all = Ring::of_design(design, None).into_iter();
    let distinct: BTreeMap<_, _> = all.map(|ring| (ring.key.clone(), ring)).collect();
    distinct.into_values().collect()
}

/// Some traces of an analysis, each a piece.
pub struct SharedTraces {
    analysis: Arc<ToleranceAnalysis>,
    /// Seed of all random numbers.
    seed: u64,
    /// Numbers of the traces.
    numbers: Range<u64>,
    /// True where they need tables of the design without deviations.
    needs_tables: bool,
    /// Tables that each of them needs beside these.
    own_tables: Cost,
}

impl Task for SharedTraces {
    fn label(&self) -> &str {
        &self.analysis.name
    }

    fn pieces(&self) -> u64 {
        self.numbers.end - self.numbers.start
    }

    fn paths(&self) -> u64 {
        self.analysis.paths
    }

    fn tables_of(&self) -> Option<&Design> {
        self.needs_tables.then_some(&self.analysis.design)
    }

    fn own_tables(&self) -> Cost {
        self.own_tables
    }

    fn missing(&self, _: &Cache, context: RunContext) -> Result<Vec<u64>> {
        let seed = self.seed;
        let entries = entries(&self.analysis, RunContext { seed, ..context });
        let missing = entries.map_or_else(Vec::new, |all| all.missing(self.numbers.clone()));
        let numbers = missing.into_iter();
        Ok(numbers.map(|number| number - self.numbers.start).collect())
    }

    fn compute(&self, pieces: Range<u64>, cache: &Cache, context: RunContext) -> Result<()> {
        let seed = self.seed;
        let context = RunContext { seed, ..context };
        let drawn = DrawnSamples::new(&self.analysis, seed)?;
        let mut tracer = SampleTracer::new(&self.analysis, &drawn, cache, context);
        for number in pieces.map(|piece| self.numbers.start + piece) {
            context.interrupt.check()?;
            if tracer.kept(number).is_none() {
                let _ = tracer.trace_and_keep(number)?;
            }
        }
        Ok(())
    }
}
