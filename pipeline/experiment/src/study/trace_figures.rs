// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of the traces of a study, with their jackknife replicates and short runs.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use metrics::Estimate;
use results::paired_figure::PairedFigure;
use results::target::{Sought, Target, Verdict};

/// Figures of one trace, in the order of the tables.
pub type NamedFigures = Vec<(String, PairedFigure)>;

/// One figure of the short runs cut from a trace.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShortRuns {
    /// Name of the figure.
    pub figure: String,
    /// Paths of a run.
    pub paths: f64,
    /// The figure of each run.
    pub values: Vec<f64>,
}

impl ShortRuns {
    fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len() as f64
    }

    /// Standard deviation of single runs.
    fn deviation(&self) -> f64 {
        let mean = self.mean();
        let squares: f64 = self.values.iter().map(|v| (v - mean).powi(2)).sum();
        (squares / (self.values.len() as f64 - 1.0)).sqrt()
    }

    pub(super) fn to_json(&self, place: &TraceId, target: Option<Target>) -> Value {
        let extreme = |pick: fn(f64, f64) -> f64| self.values.iter().copied().reduce(pick);
        let mut line = json!({
            "design": place.design,
            "model": place.model,
            "figure": self.figure,
            "paths": self.paths,
            "runs": self.values.len(),
            "mean": self.mean(),
            "standard_deviation": self.deviation(),
            "smallest": extreme(f64::min),
            "largest": extreme(f64::max),
            "values": self.values,
        });
        if let Some(target) = target {
            let exact = |v: &&f64| target.verdict(Estimate::new(**v, 0.0)) == Verdict::Met;
            let within = self.values.iter().filter(exact);
            if let Sought::Near(value) = target.sought {
                line["target"] = value.into();
            }
            line["share_within_scale"] = (within.count() as f64 / self.values.len() as f64).into();
        }
        line
    }
}

/// Everything read from one trace.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TraceFigures {
    /// From all of its paths.
    pub figures: NamedFigures,
    /// From short runs.
    pub short_runs: Vec<ShortRuns>,
}

/// Design and model of a trace.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct TraceId {
    /// Name of the design.
    pub design: String,
    /// Model, or the element of a probe.
    pub model: String,
}

/// All traces of a set-up.
pub type SetupFigures = BTreeMap<TraceId, TraceFigures>;

/// A figure of one trace.
pub(super) fn find<'a>(
    found: &'a SetupFigures,
    place: &TraceId,
    figure: &str,
) -> Option<&'a PairedFigure> {
    let judged = found.get(place)?;
    judged.figures.iter().find(|(name, _)| name == figure).map(|f| &f.1)
}
