// SPDX-License-Identifier: MIT OR Apache-2.0
//! Description of the file of an experiment, told from that of a design by its keys.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::Result;

use metrics::digits::thousands;
use metrics::plural::count;
use results::shown;
use runtime::provenance::FileRecord;

use crate::checked_file::Texts;
use crate::optimise::{cost, problem};
use crate::study::compute::shared_traces;
use crate::study::{self, definition::Study};
use crate::tolerance::definition::{self, Overrides, ToleranceAnalysis};
use crate::tolerance::deviations::Tolerance;
use crate::tolerance::shared_traces::trace_count;

/// Most entries of a line for people.
const LISTED: usize = 12;

/// A checked file of an experiment.
#[derive(Debug)]
pub struct Description {
    /// Kind of the experiment.
    pub kind: &'static str,
    /// Line for people.
    pub words: String,
    /// Lines on its parts, each with a name.
    pub lines: Vec<(&'static str, String)>,
    /// Files that go in.
    pub inputs: Vec<FileRecord>,
}

/// Checks the study, problem or tolerance file at `path`; `None` of any other file.
///
/// # Errors
/// Errors of the reader of its kind.
pub fn describe(path: &Path) -> Result<Option<Description>> {
    let texts = Texts::new();
    let text = design::read_text(path).unwrap_or_default();
    let keys: toml::Table = text.parse().unwrap_or_default();
    let has = |key: &str| keys.contains_key(key);
    let mut found = if has("designs") {
        let study = Arc::new(study::load(path, &texts, None)?);
        let words = format!("{}: {}", study.file.name, count(study.setups.len(), "set-up"));
        let (lines, inputs) = (of_study(&study), study.inputs.clone());
        Description { kind: "study", words, lines, inputs }
    } else if has("variables") {
        let problem = problem::load(path, &texts)?;
        let stages = count(problem.stages.len(), "stage");
        let words = format!("{}: {stages} from {}", problem.name, problem.design.name);
        let lines = cost::description(&problem);
        Description { kind: "problem", words, lines, inputs: problem.inputs }
    } else if has("tolerances") {
        let analysis = definition::load(path, &texts, Overrides::default())?;
        let packages = count(analysis.samples, "package");
        let words = format!("{}: {packages} of {}", analysis.name, analysis.design.name);
        let lines = of_tolerance(&analysis)?;
        Description { kind: "tolerances", words, lines, inputs: analysis.inputs }
    } else {
        return Ok(None);
    };
    found.lines.retain(|(_, value)| !value.is_empty());
    Ok(Some(found))
}

fn of_study(study: &Arc<Study>) -> Vec<(&'static str, String)> {
    let factors = study.factors.iter().map(|factor| {
        let levels = factor.levels.iter().map(|(name, _)| name.clone());
        format!("{}: {}", factor.name, listed(levels, ", "))
    });
    let models = study.setups[0].1.iter().flat_map(|design| {
        study.file.models.iter().map(move |model| format!("{} {}", design.name, model.key(design)))
    });
    let all = &study.targets;
    let targets = all.figures.iter().flat_map(move |(design, models)| {
        models.iter().flat_map(move |(model, figures)| {
            figures.keys().filter_map(move |figure| {
                let words = all.of(design, model, figure)?.words(shown::named(figure).1);
                Some(format!("{figure} of {design} {model}, {words}"))
            })
        })
    });
    let traces = shared_traces(study, 0);
    let paths: u64 = traces.iter().map(simulate::job::Task::paths).sum();
    let traced = count(thousands(traces.len() as u64), "trace");
    vec![
        ("traces of", listed(models, ", ")),
        ("factors", listed(factors, "; ")),
        ("targets", listed(targets, "; ")),
        ("paths", format!("{} in {traced}", thousands(paths))),
    ]
}

fn of_tolerance(analysis: &ToleranceAnalysis) -> Result<Vec<(&'static str, String)>> {
    let traces = trace_count(analysis)?;
    let bounds: BTreeMap<_, _> =
        analysis.constraints.iter().map(|c| (&c.figure, c.bounds())).collect();
    let bounds = bounds.into_iter().map(|(figure, bounds)| {
        format!("{figure} {}", shown::bounds(bounds, shown::named(figure).1))
    });
    let deviations = analysis.deviations.tolerances.iter().map(Tolerance::words);
    let paths = thousands(traces * analysis.paths);
    Ok(vec![
        ("deviations", listed(deviations, "; ")),
        ("figures", listed(analysis.figures.iter().cloned(), ", ")),
        ("constraints", listed(bounds, "; ")),
        ("paths", format!("{paths} in {} traces", thousands(traces))),
    ])
}

/// The first of `all`, and how many more there are.
fn listed(all: impl Iterator<Item = String>, between: &str) -> String {
    let mut all: Vec<String> = all.collect();
    let more = all.len().saturating_sub(LISTED);
    all.truncate(LISTED);
    all.extend((more > 0).then(|| format!("{more} more")));
    all.join(between)
}
