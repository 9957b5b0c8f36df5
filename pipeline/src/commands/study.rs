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
use experiment::study::study_results::{FigureRow, StudyResults};
use experiment::study::trace_figures::TraceId;
use metrics::Bounds;
use metrics::plural::count;
use report::study as study_pictures;
use results::figure_entry::COLUMNS;
use results::shown;
use results::study::{FILE, LeftOutEntry, StudyFile};
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
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = paths)]
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

    fn run(&self, context: RunContext) -> Result<()> {
        run(self, context)
    }
}

/// Computes the study and writes JSON, CSV and pictures, `study.json` last.
pub fn run(arguments: &StudyArgs, context: RunContext) -> Result<()> {
    let study = study::load(&arguments.study, &arguments.texts, arguments.paths)?;
    let cache = cache(arguments.cache.as_deref(), &arguments.out);
    writable(&arguments.out)?;
    writable(cache.directory())?;
    context.interrupt.note(format!(
        "before {FILE} was written; finished traces and tables stay in `{}`, a new run goes on from there",
        cache.directory().display()
    ));
    let found = compute(&study, &cache, context)?;
    let outcome = StudyResults { study: &study, found, seed: context.seed };
    let path = |name: &str| arguments.out.join(name);
    atomic_file::supersede(&path(FILE))?;
    let headings: Vec<&str> = [&PLACE[..], &COLUMNS, &CHANGE, &TARGET].concat();
    csv::write_text_csv(&path(TABLE), &headings, &rows(&outcome))?;
    let json = outcome.to_json(&[FileRecord::of_output(&arguments.out, TABLE)?]);
    let file: StudyFile = serde_json::from_value(json.clone())?;
    if let Some(picture) = study_pictures::misfit_picture(&file)? {
        atomic_file::write_bytes(&path("misfit.png"), &picture.png()?)?;
    }
    for figure in study_pictures::figures(&file) {
        if let Some(picture) = study_pictures::change_picture(&file, figure)? {
            atomic_file::write_bytes(&path(&format!("change-{figure}.png")), &picture.png()?)?;
        }
    }
    let json = sealed(json)?;
    atomic_file::write_json(&path(FILE), &json)?;
    context.console.result(&json, || {
        format!("{}\nwritten to {}", describe(&outcome, &file), arguments.out.display())
    })
}

/// Headings before those of the figure, and after them; the change has the same without a place.
const PLACE: [&str; 5] = ["setup", "levels", "design", "model", "figure"];
const TARGET: [&str; 5] = ["target", "scale", "at_least", "at_most", "verdict"];
const CHANGE: [&str; 4] = ["change", "change_standard_error", "change_low", "change_high"];

const NO_BOUNDS: Bounds = Bounds { at_least: None, at_most: None };

fn rows(outcome: &StudyResults) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for (i, (setup, _)) in outcome.study.setups.iter().enumerate() {
        let levels: Vec<String> = setup.levels.iter().map(|(f, l)| format!("{f}={l}")).collect();
        let place = |place: &TraceId, figure: &str| {
            [&setup.name, &levels.join("; "), &place.design, &place.model, figure]
                .map(str::to_owned)
        };
        for line in outcome.lines(i) {
            let change = line.change.map(|change| change.columns()).unwrap_or_default();
            let verdict = line.verdict().map_or("", Verdict::words);
            rows.push(
                [
                    &place(line.place, line.figure)[..],
                    &line.value.columns(),
                    &change[..CHANGE.len()],
                    &target_columns(line.target, verdict),
                ]
                .concat(),
            );
        }
        for absent in outcome.absent(i) {
            let none = vec![String::new(); COLUMNS.len() + CHANGE.len()];
            let verdict = format!("no figure: {}", absent.why);
            let target = target_columns(Some(absent.target), &verdict);
            rows.push([&place(absent.place, absent.figure)[..], &none, &target].concat());
        }
    }
    rows
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
    let (study, ranking) = (outcome.study, outcome.ranking());
    let mut text = count(study.setups.len(), "set-up");
    for LeftOutEntry { setup, why } in &study.impossible {
        // Writing to a string cannot fail.
        let _ = write!(text, "\nimpossible: {setup}: {why}");
    }
    if ranking.is_empty() {
        return text;
    }
    // Writing to a string cannot fail.
    let _ = writeln!(text, "; root mean square of misses in units of their scales:");
    for ranked in ranking.iter().take(study_pictures::SHOWN) {
        let misfit = ranked.misfit;
        let number = shown::with_error(misfit);
        let name = &study.setups[ranked.setup].0.name;
        let _ = writeln!(text, "{number:>18}  {name}: {}", verdicts(outcome, ranked.setup));
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
    let first = ranking[0].setup;
    let _ = writeln!(text, "targets of {}:", study.setups[first].0.name);
    for line in outcome.lines(first) {
        let Some(target) = line.target else {
            continue;
        };
        let (place, figure) = (line.place, line.figure);
        let unit = line.unit;
        let reached = shown::text(&line.value, unit);
        let verdict = target.judge(&line.value).words();
        let _ = writeln!(
            text,
            "{reached:>18}  {figure} of {} {}, {}: {verdict}",
            place.design,
            place.model,
            target.words(unit)
        );
    }
    text
}

/// Numbers of targets of a set-up by their verdicts.
fn verdicts(outcome: &StudyResults, setup: usize) -> String {
    let lines: Vec<FigureRow> = outcome.lines(setup).collect();
    let all = lines.iter().filter_map(FigureRow::verdict);
    let all: Vec<Verdict> = all.collect();
    let counted = [Verdict::Met, Verdict::NotMet, Verdict::NotResolved].map(|verdict| {
        let number = all.iter().filter(|other| **other == verdict).count();
        (number > 0).then(|| format!("{number} {}", verdict.words()))
    });
    counted.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
