// SPDX-License-Identifier: MIT OR Apache-2.0
//! A search from the present design, with the numbers that have sliders as its variables.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde_json::{Value, json};

use design::dotted_keys;
use metrics::figures;
use results::figure_entry::FigureEntry;
use results::shown;
use runtime::atomic_file::write_bytes;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::model::Model;

use crate::Actions;
use crate::draft;
use crate::fault::Fault;
use crate::search::Search;
use crate::session::Session;

/// Log of a search in its folder.
const LOG: &str = "log.jsonl";
/// Candidates of a generation, and most generations.
const POPULATION: usize = 16;
const MAX_GENERATIONS: usize = 1000;
/// Paths of a candidate, and of the verification.
const PATHS: u64 = 65_536;
const VERIFIED: u64 = 1_048_576;
/// Lines of progress that the page shows.
const MAX_LINES: usize = 12;

/// What the page asks for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Figure that is to grow or, where the smaller value is better, to fall.
    figure: String,
    /// Keys that are varied.
    paths: Vec<String>,
    /// Bounds of each.
    ranges: std::collections::BTreeMap<String, [f64; 2]>,
    generations: usize,
}

/// Reads how far the search of `session` is.
pub fn follow(session: &Session) {
    let (folder, figure, seen) = session.peek(|search| {
        let folder = search.folder.clone().filter(|_| search.is_running);
        (folder, search.figure.clone(), search.lines.clone())
    });
    let Some(folder) = folder else { return };
    let text = fs::read_to_string(folder.join(LOG)).unwrap_or_default();
    let mut shown = progress(&text, &figure);
    let from = shown.len().saturating_sub(MAX_LINES);
    let shown = shown.split_off(from);
    if shown != seen {
        session.search(|search| search.lines = shown);
    }
}

/// A line for each generation in the log of a search: its best candidate's `figure`, and why others
/// were refused.
fn progress(log: &str, figure: &str) -> Vec<String> {
    let (mut shown, mut best) = (Vec::new(), None::<(f64, String)>);
    let (mut refused, mut reason) = (0, String::new());
    for line in log.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok()) {
        if let Some(why) = line["refused"].as_str() {
            refused += 1;
            why.clone_into(&mut reason);
        }
        let entry = serde_json::from_value::<FigureEntry>(line["figures"][figure].clone());
        if let (Some(value), Ok(entry)) = (line["value"].as_f64(), entry)
            && best.as_ref().is_none_or(|(least, _)| value < *least)
        {
            best = Some((value, shown::text(&entry, shown::named(figure).1)));
        }
        if line["kind"] == "generation" {
            let number = shown.len() + 1;
            let found = best.as_ref().map_or("no design that can be built", |(_, text)| text);
            let why = match refused {
                0 => String::new(),
                count => format!("; {count} refused so far, the last: {reason}"),
            };
            shown.push(format!("generation {number}: {found}{why}"));
        }
    }
    shown
}

/// A search that has begun.
#[derive(Debug)]
pub struct Begun {
    folder: PathBuf,
    problem: PathBuf,
    file: String,
    text: String,
    paths: Vec<String>,
    interrupt: Interrupt,
}

/// Begins a search in a new folder under `out`.
///
/// # Errors
/// What is asked for cannot be searched; a search that is running.
pub fn begin(session: &Session, request: Request, out: &Path) -> Result<Begun, Fault> {
    let (design, model, text) = session.present()?;
    let refuse = |error: anyhow::Error| Fault::new(format!("{error:#}"));
    let file = std::path::absolute(session.path()).map_err(|e| refuse(e.into()))?;
    let file = file.display().to_string();
    let words = problem_text(&request, &design.name, &file, model).map_err(refuse)?;
    let interrupt = Interrupt::default();
    let before = session.search(|search| {
        let (figure, interrupt) = (request.figure.clone(), interrupt.clone());
        let next = Search { figure, interrupt, is_running: true, ..Search::default() };
        (!search.is_running).then(|| std::mem::replace(search, next))
    });
    let before = before.ok_or_else(|| Fault::new("a search is running; stop it first"))?;
    let begun = new_folder(out, &design.name).and_then(|folder| {
        let problem = folder.join("problem.toml");
        write_bytes(&problem, words.as_bytes())?;
        Ok((folder, problem))
    });
    session.search(|search| match &begun {
        Ok((folder, _)) => search.folder = Some(folder.clone()),
        Err(_) => *search = before,
    });
    let (folder, problem) = begun.map_err(refuse)?;
    Ok(Begun { folder, problem, file, text, paths: request.paths, interrupt })
}

impl Begun {
    /// Searches, and leaves what was found or why not in `session`.
    pub fn run(self, session: &Session, actions: &dyn Actions, context: RunContext) {
        let context = RunContext { interrupt: &self.interrupt, ..context.mute() };
        let texts = (&*self.file, &*self.text);
        let searched = actions.optimise(&self.problem, texts, &self.folder, context);
        let searched = searched.and_then(|found| values(&found, &self.paths));
        follow(session);
        session.search(|search| {
            search.is_running = false;
            match searched {
                Ok(found) => search.found = Some(found),
                Err(_) if self.interrupt.is_raised() => search.error = Some("stopped".to_owned()),
                Err(error) => search.error = Some(format!("{error:#}")),
            }
        });
    }
}

/// Puts the values that were found into the draft.
///
/// # Errors
/// Nothing found; a draft that no longer takes them.
pub fn take(session: &Session) -> Result<(), Fault> {
    let found = session.peek(|search| search.found.clone());
    let found = found.ok_or_else(|| Fault::new("no search has found a design"))?;
    let edit = |text: String, (path, value): &(String, Value)| draft::set(&text, path, value);
    session.rewrite(|text| found.iter().try_fold(text, edit))
}

/// Values of the keys in the text of a design.
fn values(text: &str, paths: &[String]) -> Result<Vec<(String, Value)>> {
    let table: toml::Table = text.parse()?;
    let value = |path: &String| {
        let value = dotted_keys::get(&table, path).and_then(dotted_keys::number);
        let value =
            value.with_context(|| format!("{path}: expected a number in the design found"))?;
        Ok((path.clone(), json!(value)))
    };
    paths.iter().map(value).collect()
}

/// A folder under `out` that is not there yet.
fn new_folder(out: &Path, name: &str) -> Result<PathBuf> {
    let numbered = (1..10_000).map(|number| out.join(format!("{name}-search-{number}")));
    for folder in numbered {
        if !folder.exists() {
            fs::create_dir_all(&folder)
                .with_context(|| format!("`{}` cannot be made", folder.display()))?;
            return Ok(folder);
        }
    }
    anyhow::bail!("`{}`: expected fewer than 10 000 searches", out.display())
}

/// The problem file.
fn problem_text(request: &Request, name: &str, file: &str, model: Model) -> Result<String> {
    let Request { figure, paths, ranges, generations } = request;
    ensure!(!paths.is_empty(), "expected at least one number to vary: give one a slider");
    ensure!(
        (1..=MAX_GENERATIONS).contains(generations),
        "generations: expected 1 to {MAX_GENERATIONS}, got {generations}"
    );
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let mut words = format!(
        "# A search that `batwing explore` began.\n\nname = {}\ndesign = {}\n",
        quoted(&format!("{name}-found")),
        quoted(file)
    );
    for path in paths {
        let [from, to] = ranges.get(path).with_context(|| format!("{path}: expected a range"))?;
        // Writing to a string cannot fail.
        let _ = write!(
            words,
            "\n[[variables]]\nkey = {}\nfrom = {}\nto = {}\n",
            quoted(path),
            toml::Value::from(*from),
            toml::Value::from(*to)
        );
    }
    let falls = figures::find(figure).and_then(|figure| figure.larger_is_better) == Some(false);
    let goal = if falls { ", goal = \"minimise\"" } else { "" };
    let _ = write!(
        words,
        "\n[objective]\nterms = [{{ figure = {}{goal} }}]\n\n[[stages]]\nmodel = {}\npopulation = {POPULATION}\nevaluations = {}\npaths = {PATHS}\n\n[verification]\npaths = {VERIFIED}\n",
        quoted(figure),
        quoted(model.word()),
        POPULATION * generations
    );
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_told_in_the_figure_that_is_sought() {
        let log = [
            json!({"kind": "candidate", "refused": "dome.width_mm = 9: too wide"}),
            json!({"kind": "generation"}),
            json!({"kind": "candidate", "value": -0.8, "figures": {"uniformity": {"value": 0.8, "standard_error": 0.01}}}),
            json!({"kind": "candidate", "value": -0.9, "figures": {"uniformity": {"value": 0.9, "standard_error": 0.01}}}),
            json!({"kind": "generation"}),
        ];
        let log = log.map(|line| line.to_string()).join("\n");
        let said = progress(&log, "uniformity");
        let refused = "1 refused so far, the last: dome.width_mm = 9: too wide";
        assert_eq!(said[0], format!("generation 1: no design that can be built; {refused}"));
        assert_eq!(said[1], format!("generation 2: 90.0 ± 1.0 %; {refused}"));
    }

    #[test]
    fn problem_files_hold_what_was_asked_for() {
        let request: Request = serde_json::from_value(json!({
            "figure": "uniformity", "paths": ["array.pitch_mm"],
            "ranges": {"array.pitch_mm": [4, 6.5]}, "generations": 3,
        }))
        .expect("a request");
        let text =
            problem_text(&request, "own", "/a \"b\"/own.toml", Model::Geometric).expect("a text");
        let table: toml::Table = text.parse().expect("TOML");
        assert_eq!(table["design"].as_str(), Some("/a \"b\"/own.toml"));
        assert_eq!(table["variables"][0]["to"].as_float(), Some(6.5));
        assert_eq!(table["stages"][0]["evaluations"].as_integer(), Some(48));
        assert_eq!(table["objective"]["terms"][0].get("goal"), None);
        // A figure of which less is better.
        let request = Request { figure: "cell_variation".to_owned(), ..request };
        let text = problem_text(&request, "own", "own.toml", Model::Geometric).expect("a text");
        let table: toml::Table = text.parse().expect("TOML");
        assert_eq!(table["objective"]["terms"][0]["goal"].as_str(), Some("minimise"));
        assert!(
            problem_text(&Request { paths: Vec::new(), ..request }, "", "", Model::Hybrid).is_err()
        );
        let found = values("[array]\npitch_mm = 5.5\n", &["array.pitch_mm".to_owned()]);
        assert_eq!(found.expect("found"), [("array.pitch_mm".to_owned(), json!(5.5))]);
    }
}
