// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing study`: figures of many set-ups of designs, their changes against the base and their
//! misfits to targets.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use clap::Args;

use arrays::csv;
use experiment::checked_file::Texts;
use experiment::study;
use experiment::study::compute::{compute, shared_traces};
use experiment::study::study_results::StudyResults;
use metrics::Bounds;
use metrics::plural::count;
use report::study as study_pictures;
use results::figure_entry::COLUMNS;
use results::shown;
use results::study::{FILE, LeftOutEntry, SetupEntry, StudyFigureEntry, StudyFile};
use results::target::{Sought, Target, Verdict};
use runtime::atomic_file;
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use simulate::job::{Job, SharedWork, Task};

use super::arguments::{cache, paths};
use super::outputs::writable;
use super::shardable::{CommandLine, JobOptions, Shardable, Sharing};

/// Table of the figures, a line each.
const TABLE: &str = "study.csv";

/// `batwing study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Study file
    #[arg(value_name = "STUDY.toml")]
    pub study: PathBuf,
    /// Paths of each trace, instead of those of the study or its designs
    #[arg(long, value_name = "N", value_parser = paths)]
    pub paths: Option<u64>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "study")]
    pub out: PathBuf,
    /// Directory that keeps tables and traces for later runs [default: .batwing-cache beside the
    /// results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Shards.
    #[command(flatten)]
    pub sharing: Sharing,
    /// Texts in place of files.
    #[arg(skip)]
    pub texts: Texts,
}

impl Shardable for StudyArgs {
    fn job_options(&self) -> JobOptions<'_> {
        JobOptions::new(&self.out, self.cache.as_deref(), &self.sharing)
    }

    fn words(&self) -> Vec<String> {
        CommandLine::new("study", &self.study).option("--paths", self.paths).all()
    }

    fn work(&self, context: RunContext) -> Result<Box<dyn SharedWork>> {
        let study = Arc::new(study::load(&self.study, &self.texts, self.paths)?);
        let traces = shared_traces(&study, context.seed).into_iter();
        let tasks = traces.map(|trace| Box::new(trace) as Box<dyn Task>);
        Ok(Box::new(Job::new(Vec::new(), tasks.collect(), study.inputs.clone())))
    }

    /// Computes the study and writes JSON, CSV and pictures, `study.json` last.
    fn run(&self, context: RunContext) -> Result<()> {
        let study = study::load(&self.study, &self.texts, self.paths)?;
        let cache = cache(self.cache.as_deref(), &self.out);
        writable(&self.out)?;
        writable(cache.directory())?;
        context.interrupt.note(format!(
            "before {FILE} was written; finished traces and tables stay in `{}`, a new run goes on from there",
            cache.directory().display()
        ));
        let found = compute(&study, &cache, context)?;
        let outcome = StudyResults { study: &study, found, seed: context.seed };
        let path = |name: &str| self.out.join(name);
        atomic_file::supersede(&path(FILE))?;
        let headings: Vec<&str> = [&PLACE[..], &COLUMNS, &CHANGE, &TARGET].concat();
        let mut file = outcome.to_file();
        csv::write_text_csv(&path(TABLE), &headings, &rows(&outcome, &file))?;
        file.files = vec![FileRecord::of_output(&self.out, TABLE)?];
        if let Some(picture) = study_pictures::misfit_picture(&file)? {
            atomic_file::write_bytes(&path("misfit.png"), &picture.png()?)?;
        }
        for figure in study_pictures::figures(&file) {
            if let Some(picture) = study_pictures::change_picture(&file, figure)? {
                atomic_file::write_bytes(&path(&format!("change-{figure}.png")), &picture.png()?)?;
            }
        }
        let json = sealed(serde_json::to_value(&file)?)?;
        atomic_file::write_json(&path(FILE), &json)?;
        context.console.result(&json, || {
            format!("{}\nwritten to {}", describe(&outcome, &file), self.out.display())
        })
    }
}

/// Headings before those of the figure, and after them; the change has the same without a place.
const PLACE: [&str; 5] = ["setup", "levels", "design", "model", "figure"];
const TARGET: [&str; 5] = ["target", "scale", "at_least", "at_most", "verdict"];
const CHANGE: [&str; 4] = ["change", "change_standard_error", "change_low", "change_high"];

const NO_BOUNDS: Bounds = Bounds { at_least: None, at_most: None };

fn rows(outcome: &StudyResults, file: &StudyFile) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for (index, setup) in file.setups.iter().enumerate() {
        let levels: Vec<String> = setup.levels.iter().map(|(f, l)| format!("{f}={l}")).collect();
        let place = |design: &str, model: &str, figure: &str| {
            [&setup.name, &levels.join("; "), design, model, figure].map(str::to_owned)
        };
        for entry in &setup.figures {
            let change = entry.change.map(|change| change.columns()).unwrap_or_default();
            let verdict = entry.verdict.map_or("", Verdict::words);
            rows.push(
                [
                    &place(&entry.design, &entry.model, &entry.figure)[..],
                    &entry.value.columns(),
                    &change[..CHANGE.len()],
                    &target_columns(target(outcome, entry), verdict),
                ]
                .concat(),
            );
        }
        for absent in outcome.absent(index) {
            let none = vec![String::new(); COLUMNS.len() + CHANGE.len()];
            let verdict = format!("no figure: {}", absent.why);
            let target = target_columns(Some(absent.target), &verdict);
            let place = place(&absent.place.design, &absent.place.model, absent.figure);
            rows.push([&place[..], &none, &target].concat());
        }
    }
    rows
}

/// Target of a figure.
fn target(outcome: &StudyResults, entry: &StudyFigureEntry) -> Option<Target> {
    outcome.study.targets.of(&entry.design, &entry.model, &entry.figure)
}

/// Cells under [`TARGET`].
fn target_columns(target: Option<Target>, verdict: &str) -> [String; 5] {
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    let (near, bounds) = match target.map(|target| target.sought) {
        Some(Sought::Near(value)) => (Some(value), NO_BOUNDS),
        Some(Sought::Within(bounds)) => (None, bounds),
        None => (None, NO_BOUNDS),
    };
    [
        number(near),
        number(target.map(|target| target.scale)),
        number(bounds.at_least),
        number(bounds.at_most),
        verdict.to_owned(),
    ]
}

fn describe(outcome: &StudyResults, file: &StudyFile) -> String {
    let ranking = &file.ranking;
    let mut text = count(file.setups.len(), "set-up");
    for LeftOutEntry { setup, why } in &file.impossible {
        // Writing to a string cannot fail.
        let _ = write!(text, "\nimpossible: {setup}: {why}");
    }
    let by_name = |name: &str| file.setups.iter().find(|setup| setup.name == name);
    let Some(first) = ranking.first().and_then(|first| by_name(&first.setup)) else {
        return text;
    };
    // Writing to a string cannot fail.
    let _ = writeln!(text, "; root mean square of misses in units of their scales:");
    for ranked in ranking.iter().take(study_pictures::SHOWN) {
        let number = shown::with_error(ranked.misfit);
        let verdicts = by_name(&ranked.setup).map(verdicts).unwrap_or_default();
        let _ = writeln!(text, "{number:>18}  {}: {verdicts}", ranked.setup);
    }
    if ranking.len() > study_pictures::SHOWN {
        let _ = writeln!(text, "and {} more", ranking.len() - study_pictures::SHOWN);
    }
    if ranking.len() > 1 {
        let _ = writeln!(text, "{}", study_pictures::tied(file));
    }
    for left_out in &file.unranked {
        let _ = writeln!(text, "not ranked: {}: {}", left_out.setup, left_out.why);
    }
    let _ = writeln!(text, "targets of {}:", first.name);
    for entry in &first.figures {
        let (Some(target), Some(verdict)) = (target(outcome, entry), entry.verdict) else {
            continue;
        };
        let StudyFigureEntry { design, model, figure, .. } = entry;
        let unit = entry.unit();
        let reached = shown::text(&entry.value, unit);
        let _ = writeln!(
            text,
            "{reached:>18}  {figure} of {design} {model}, {}: {}",
            target.words(unit),
            verdict.words()
        );
    }
    text
}

/// Numbers of targets of a set-up by their verdicts.
fn verdicts(setup: &SetupEntry) -> String {
    let counted = [Verdict::Met, Verdict::NotMet, Verdict::NotResolved].map(|verdict| {
        let number = setup.figures.iter().filter(|entry| entry.verdict == Some(verdict)).count();
        (number > 0).then(|| format!("{number} {}", verdict.words()))
    });
    counted.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
