// SPDX-License-Identifier: MIT OR Apache-2.0
//! Every figure of a design over seeds: scatter over the stated error, and how often an interval in
//! place of an error holds the figure of all paths together.

use std::collections::BTreeMap;

use design::Design;
use results::figure_entry::FigureEntry;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::spectral::SpectralJob;
use simulate::trace::observe;

/// A figure over seeds.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// Key in the registry.
    pub key: String,
    /// Seeds that have it.
    pub seeds: usize,
    /// Seeds that call it resolved.
    pub resolved: usize,
    /// Mean of the resolved.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
    /// Root mean square of their stated errors.
    pub stated: f64,
    /// Value of all paths of all seeds together; of colours, which are not added, the mean.
    pub truth: f64,
    /// Seeds that state an interval or a bound, and those whose interval holds that value.
    pub bounds: [usize; 2],
}

impl Scatter {
    /// `truth` is the figure of all paths together, where it is known.
    fn new(key: String, entries: &[FigureEntry], truth: Option<FigureEntry>) -> Self {
        let resolved: Vec<&FigureEntry> = entries.iter().filter(|e| is_resolved(e)).collect();
        let n = resolved.len() as f64;
        let mean = resolved.iter().map(|e| e.value).sum::<f64>() / n;
        let squares: f64 = resolved.iter().map(|e| (e.value - mean).powi(2)).sum();
        let stated: f64 = resolved.iter().map(|e| e.standard_error.powi(2)).sum();
        // Of all paths together it may not be resolved either.
        let of_all = entries.iter().map(|e| e.value).sum::<f64>() / entries.len() as f64;
        let (truth, ends) = truth.map_or((of_all, None), |entry| (entry.value, interval(&entry)));
        let [least, most] = ends.unwrap_or([truth; 2]);
        let rounding = 1e-12 * truth.abs();
        let bounds = || entries.iter().filter_map(interval);
        let holds = |[low, high]: &[f64; 2]| low - rounding <= most && least <= high + rounding;
        Self {
            key,
            seeds: entries.len(),
            resolved: resolved.len(),
            mean,
            deviation: (squares / (n - 1.0)).sqrt(),
            stated: (stated / n).sqrt(),
            truth,
            bounds: [bounds().count(), bounds().filter(holds).count()],
        }
    }

    /// Scatter over stated error; 1 where neither is above rounding.
    pub fn ratio(&self) -> f64 {
        let rounding = 1e-12 * self.mean.abs();
        if self.deviation.max(self.stated) <= rounding { 1.0 } else { self.deviation / self.stated }
    }

    /// True if nine seeds in ten call it resolved, so that the choice of seeds hardly matters.
    pub fn is_resolved(&self) -> bool {
        10 * self.resolved >= 9 * self.seeds
    }

    /// Share of stated intervals and bounds that hold the figure of all paths; 1 where they are few.
    pub fn coverage_of_intervals(&self) -> f64 {
        let [count, holding] = self.bounds;
        if 10 * count < self.seeds { 1.0 } else { holding as f64 / count as f64 }
    }
}

/// True of a figure that has a value with an error.
fn is_resolved(entry: &FigureEntry) -> bool {
    let is_bound = entry.interval.is_some() || entry.upper_bound.is_some();
    !is_bound && entry.peak_place.is_off_axis()
}

/// The interval of 95 % confidence in place of a value with an error.
fn interval(entry: &FigureEntry) -> Option<[f64; 2]> {
    entry.interval.or(entry.upper_bound.map(|bound| [0.0, bound]))
}

/// All figures of `design`, traced by rays, over so many seeds from 1 on, each of `paths` paths.
///
/// # Panics
/// If the design cannot be traced.
pub fn over_seeds(design: &Design, paths: u64, seeds: u64) -> Vec<Scatter> {
    let mut entries: BTreeMap<String, Vec<FigureEntry>> = BTreeMap::new();
    let mut all: Option<Observation> = None;
    for seed in 1..=seeds {
        let seen = observed(design, paths, seed);
        for figure in seen.estimates(design, |_| true) {
            entries.entry(figure.key.into_owned()).or_default().push(figure.entry);
        }
        match &mut all {
            Some(all) => all.add(&seen),
            None => all = Some(seen),
        }
    }
    let all = all.expect("a seed").scaled(1.0 / seeds as f64);
    let truths = all.estimates(design, |_| true);
    let truth = |key: &str| truths.iter().find(|f| f.key == key).map(|f| f.entry);
    let of = |(key, entries): (String, Vec<FigureEntry>)| {
        let truth = truth(&key);
        Scatter::new(key, &entries, truth)
    };
    entries.into_iter().map(of).collect()
}

fn observed(design: &Design, paths: u64, seed: u64) -> Observation {
    let model = Model::Geometric;
    let interrupt = Interrupt::default();
    let context = RunContext::quiet(&interrupt, seed);
    let Some(lights) = design.all_lights() else {
        let surface = dome_surface(design, model, None).expect("a surface");
        return observe(design, &surface, paths, "", context).expect("a trace");
    };
    let mut design = design.clone();
    design.trace.paths = paths;
    let job = SpectralJob { design: &design, lights: &lights, model, cache: None, context };
    job.observe().expect("a trace")
}
