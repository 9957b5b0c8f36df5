// SPDX-License-Identifier: MIT OR Apache-2.0
//! The log of a search: a line of JSON for each candidate as it is judged, and for each generation. A
//! search is resumed from the generations that are whole; a log may be cut anywhere.

use std::collections::{BTreeMap, VecDeque};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use results::figure_entry::FigureEntry;
use runtime::atomic_file;
use search::Point;

use super::evaluate::Evaluator;
use super::outcome::Outcome;

/// File under the directory of results.
pub const FILE: &str = "log.jsonl";

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Line {
    /// Problem that the log belongs to.
    Problem {
        /// Hash of all that the search depends on.
        key: String,
        /// Version of the program.
        version: String,
    },
    /// A candidate.
    Candidate(Candidate),
    /// The end of a generation.
    Generation(GenerationEnd),
}

/// A candidate with what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Candidate {
    /// In the unit box.
    pub point: Vec<f64>,
    /// Values of the variables' coefficients, in the units of the design.
    pub coefficients: Vec<f64>,
    /// Choices that coefficients are shares of, by the names of their variables.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub choices: BTreeMap<String, Value>,
    /// Value that the search minimises; absent for refused candidates.
    pub value: Option<f64>,
    /// Objective, whether or not constraints are met.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objective: Option<f64>,
    /// Standard error of the objective.
    pub standard_error: Option<f64>,
    /// Ends of the objective, where a figure of it is known between ends alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Figures of objective and constraints.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub figures: BTreeMap<String, FigureEntry>,
    /// True where all constraints are met.
    pub feasible: bool,
    /// Reason of a refusal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

impl Candidate {
    pub fn new(point: &[f64], evaluator: &Evaluator<'_>, outcome: &Outcome) -> Self {
        let variables = evaluator.variables;
        let (judged, refused) = match outcome {
            Outcome::Evaluated(judged) => (Some(judged), None),
            Outcome::Refused(why) => (None, Some(why.clone())),
        };
        let figures = judged.into_iter().flat_map(|judged| &judged.figures);
        Self {
            point: point.to_vec(),
            coefficients: variables.coefficients(point),
            choices: variables.choices(point).collect(),
            value: Some(outcome.value()).filter(|value| value.is_finite()),
            objective: judged
                .map(|judged| judged.objective.value)
                .filter(|value| value.is_finite()),
            standard_error: judged.map(|judged| judged.objective.estimate().standard_error),
            interval: judged.and_then(|judged| evaluator.objective.entry(judged).interval),
            figures: figures.map(|(k, f)| (k.clone(), f.entry)).collect(),
            feasible: judged.is_some_and(|judged| judged.miss <= 0.0),
            refused,
        }
    }

    /// Value that the search minimises.
    pub fn value(&self) -> f64 {
        self.value.unwrap_or(f64::INFINITY)
    }
}

/// A whole generation, by its place in the search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct GenerationEnd {
    /// Stage, from 1.
    pub stage: usize,
    /// Generation of the stage, from 1; 0 for those from which the best is chosen at its end.
    pub generation: usize,
    /// Number of candidates.
    pub candidates: usize,
    /// Paths of each trace.
    pub paths: u64,
    /// Paths of the traces of the next generation.
    pub next_paths: u64,
    /// Standard error of its values, as a share of their scatter.
    pub noise: Option<f64>,
    /// Tables of orders solved so far.
    pub tables: usize,
    /// Seconds since the search began or was resumed.
    pub seconds: f64,
}

/// A generation with its candidates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Generation {
    pub candidates: Vec<Candidate>,
    pub end: GenerationEnd,
}

/// The log of one search, read and written.
pub(super) struct Log {
    /// None where a search is not logged.
    file: Option<File>,
    /// Generations of an earlier part of the search that are still to be replayed.
    known: VecDeque<Generation>,
    /// Bytes of the file before them.
    replayed: u64,
    /// Candidates of the generation under way that stand in the file.
    begun: usize,
}

impl Log {
    /// Begins the log at `path`, or goes on with it where `resume` is set.
    ///
    /// # Errors
    /// A log of another problem, seed or version; a file that cannot be written.
    pub fn open(path: &Path, key: &str, resume: bool) -> Result<Self> {
        let at = || format!("`{}`", path.display());
        let known = if resume && path.exists() {
            read(path, key).with_context(at)?
        } else {
            VecDeque::new()
        };
        let head =
            Line::Problem { key: key.to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() };
        // What is not whole goes, so that the log reads as if the search had not been stopped.
        let mut text = line(&head)?;
        let replayed = text.len() as u64;
        for generation in &known {
            text.push_str(&lines(generation)?);
        }
        atomic_file::write_bytes(path, text.as_bytes())?;
        let file = OpenOptions::new().append(true).open(path);
        Ok(Self { file: Some(file.with_context(at)?), known, replayed, begun: 0 })
    }

    /// No log: a search whose evaluations are kept elsewhere.
    pub fn none() -> Self {
        Self { file: None, known: VecDeque::new(), replayed: 0, begun: 0 }
    }

    /// Generation `number` of an earlier part of the search, if it holds the candidates `points`.
    ///
    /// Where the earlier part made its selection instead, a budget of time had ended it: the rest of
    /// the log is dropped, and the search goes on.
    ///
    /// # Errors
    /// A log whose generations are not those of this search; those of the file.
    pub fn replayed(&mut self, number: usize, points: &[Point]) -> Result<Option<Generation>> {
        let Some(generation) = self.known.pop_front() else {
            return Ok(None);
        };
        if number > 0 && generation.end.generation == 0 {
            self.known.clear();
            let cut = self.file.as_ref().map(|file| file.set_len(self.replayed));
            cut.transpose().with_context(|| format!("{FILE}: cannot be written"))?;
            return Ok(None);
        }
        let same = generation.candidates.iter().map(|c| &c.point).eq(points);
        ensure!(
            same,
            "{FILE}: expected the candidates of this search in generation {} of stage {}, got others",
            generation.end.generation,
            generation.end.stage
        );
        self.replayed += lines(&generation)?.len() as u64;
        Ok(Some(generation))
    }

    /// Adds the first `count` candidates of the generation under way, as far as they are not there.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn begin(&mut self, count: usize, candidate: impl Fn(usize) -> Candidate) -> Result<()> {
        if self.file.is_none() {
            return Ok(());
        }
        let new = (self.begun..count).map(|k| line(&Line::Candidate(candidate(k))));
        self.write(&new.collect::<Result<String>>()?)?;
        self.begun = self.begun.max(count);
        Ok(())
    }

    /// Adds a generation, or what is not there of it.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn add(&mut self, generation: &Generation) -> Result<()> {
        self.begin(generation.candidates.len(), |k| generation.candidates[k].clone())?;
        self.begun = 0;
        self.write(&line(&Line::Generation(generation.end.clone()))?)
    }

    fn write(&mut self, text: &str) -> Result<()> {
        let Some(file) = &mut self.file else {
            return Ok(());
        };
        let written = file.write_all(text.as_bytes());
        written.and_then(|()| file.flush()).with_context(|| format!("{FILE}: cannot be written"))
    }
}

fn line(line: &Line) -> Result<String> {
    Ok(serde_json::to_string(line)? + "\n")
}

fn lines(generation: &Generation) -> Result<String> {
    let mut text = String::new();
    for candidate in &generation.candidates {
        text.push_str(&line(&Line::Candidate(candidate.clone()))?);
    }
    text.push_str(&line(&Line::Generation(generation.end.clone()))?);
    Ok(text)
}

/// The whole generations of the log at `path`.
fn read(path: &Path, key: &str) -> Result<VecDeque<Generation>> {
    let text = std::fs::read(path).context("cannot be read")?;
    let text = String::from_utf8_lossy(&text);
    let mut lines = text.split_inclusive('\n').map(serde_json::from_str::<Line>);
    match lines.next() {
        // Cut before its first line was whole.
        None | Some(Err(_)) => return Ok(VecDeque::new()),
        Some(Ok(Line::Problem { key: found, .. })) => ensure!(
            found == key,
            "expected the log of this problem, design, seed and version, got that of another; \
             without --resume the search begins anew"
        ),
        Some(Ok(_)) => anyhow::bail!("expected the line of the problem first"),
    }
    let (mut generations, mut candidates) = (VecDeque::new(), Vec::new());
    for line in lines {
        match line {
            Ok(Line::Candidate(candidate)) => candidates.push(candidate),
            Ok(Line::Generation(end)) if end.candidates == candidates.len() => {
                generations
                    .push_back(Generation { candidates: std::mem::take(&mut candidates), end });
            }
            _ => break,
        }
    }
    Ok(generations)
}
