// SPDX-License-Identifier: MIT OR Apache-2.0
//! Description of the file of an experiment, told from that of a design by its keys.

use std::path::Path;

use anyhow::Result;

use files::provenance::FileRecord;
use metrics::plural::count;

use crate::checked_file::Texts;
use crate::optimise::problem;
use crate::study;
use crate::tolerance::definition::{self, Overrides};

/// A checked file of an experiment.
#[derive(Debug)]
pub struct Description {
    /// Kind of the experiment.
    pub kind: &'static str,
    /// Line for people.
    pub words: String,
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
    let found = if has("designs") {
        let study = study::load(path, &texts, None)?;
        let words = format!("{}: {}", study.name, count(study.setups.len(), "set-up"));
        Description { kind: "study", words, inputs: study.inputs }
    } else if has("variables") {
        let problem = problem::load(path, &texts)?;
        let stages = count(problem.stages.len(), "stage");
        let words = format!("{}: {stages} from {}", problem.name, problem.design.name);
        Description { kind: "problem", words, inputs: problem.inputs }
    } else if has("tolerances") {
        let analysis = definition::load(path, &texts, Overrides::default())?;
        let packages = count(analysis.samples, "package");
        let words = format!("{}: {packages} of {}", analysis.name, analysis.design.name);
        Description { kind: "tolerances", words, inputs: analysis.inputs }
    } else {
        return Ok(None);
    };
    Ok(Some(found))
}
