// SPDX-License-Identifier: MIT OR Apache-2.0
//! A search from the present design for what the user states: goals, constraints and variables.

use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use design::{Design, dotted_keys};
use experiment::checked_file::Texts;
use experiment::optimise::file::Goal;
use experiment::optimise::{log, problem};
use runtime::atomic_file::write_bytes;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::model::Model;

use crate::Actions;
use crate::draft;
use crate::fault::Fault;
use crate::search::Search;
use crate::session::Session;

/// Candidates of a generation, and most generations.
const POPULATION: usize = 16;
const MAX_GENERATIONS: usize = 1000;
/// Most paths of a candidate at first, and of the verification.
const PATHS: u64 = 65_536;
const VERIFIED: u64 = 1_048_576;

/// What the page asks for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Terms of the objective.
    goals: Vec<Term>,
    constraints: Vec<Bound>,
    variables: Vec<Variable>,
    generations: usize,
}

/// As `[[objective.terms]]`; no page names a file.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Term {
    figure: String,
    goal: Goal,
    target: Option<f64>,
    scale: Option<f64>,
}

/// As `[[constraints]]`.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Bound {
    figure: String,
    at_least: Option<f64>,
    at_most: Option<f64>,
}

/// As `[[variables]]`.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Variable {
    key: String,
    from: f64,
    to: f64,
    /// The present value.
    start: Option<f64>,
}

/// Reads what the log of the search of `session` has more than before.
pub fn follow(session: &Session) {
    let place = |search: &Search| search.is_running.then(|| (search.folder.clone(), search.read));
    while let Some((folder, read)) = session.peek(place) {
        let lines = lines_after(&folder.join(log::FILE), read).unwrap_or_default();
        if lines.is_empty() {
            return;
        }
        session.search(|search| {
            // Another one may have read some of them meanwhile; the rest is read next.
            if search.folder == folder && search.read == read {
                search.follow(&lines);
            }
        });
    }
}

/// Whole lines of a file after so many bytes.
fn lines_after(path: &Path, read: u64) -> std::io::Result<String> {
    let (mut file, mut text) = (File::open(path)?, Vec::new());
    file.seek(SeekFrom::Start(read))?;
    file.read_to_end(&mut text)?;
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// A search that has begun.
#[derive(Debug)]
pub struct Begun {
    folder: PathBuf,
    problem: PathBuf,
    file: String,
    text: String,
    keys: Vec<String>,
    interrupt: Interrupt,
}

/// Begins a search in a new folder under `out`, once its problem is checked as `optimise` does.
///
/// # Errors
/// What is asked for is no problem: nothing is written; a search that is running.
pub fn begin(session: &Session, request: &Request, out: &Path) -> Result<Begun, Fault> {
    let (design, model, text) = session.present()?;
    let refuse = |error: anyhow::Error| Fault::new(format!("{error:#}"));
    let file = std::path::absolute(session.path()).map_err(|e| refuse(e.into()))?;
    let file = file.display().to_string();
    let words = problem_text(request, &design, &file, model).map_err(refuse)?;
    let folder = free_folder(out, &design.name).map_err(refuse)?;
    let problem = folder.join("problem.toml");
    let name = problem.display().to_string();
    let texts = Texts::from([(name.clone(), words.clone()), (file.clone(), text.clone())]);
    problem::load(&problem, &texts).map_err(|error| {
        let message = format!("{error:#}");
        Fault::new(request.named(message.strip_prefix(&format!("{name}: ")).unwrap_or(&message)))
    })?;
    for Variable { key, from, .. } in &request.variables {
        // What is found is set in the same way: no formula is.
        draft::set(&text, key, &json!(from)).map_err(refuse)?;
    }
    let keys: Vec<String> = request.variables.iter().map(|one| one.key.clone()).collect();
    let interrupt = Interrupt::default();
    let before = session.search(|search| {
        let next = Search {
            number: search.number + 1,
            folder: folder.clone(),
            keys: keys.clone(),
            figures: request.figures(),
            interrupt: interrupt.clone(),
            is_running: true,
            ..Search::default()
        };
        (!search.is_running).then(|| std::mem::replace(search, next))
    });
    let before = before.ok_or_else(|| Fault::new("a search is running; stop it first"))?;
    // No other server has the folder.
    let written = fs::create_dir_all(out)
        .and_then(|()| fs::create_dir(&folder))
        .with_context(|| format!("`{}` cannot be made", folder.display()))
        .and_then(|()| write_bytes(&problem, words.as_bytes()));
    if let Err(error) = written {
        session.search(|search| *search = before);
        return Err(refuse(error));
    }
    Ok(Begun { folder, problem, file, text, keys, interrupt })
}

impl Request {
    /// Figures of goals and constraints, each once.
    fn figures(&self) -> Vec<String> {
        let goals = self.goals.iter().map(|one| &one.figure);
        let mut figures: Vec<String> = Vec::new();
        for figure in goals.chain(self.constraints.iter().map(|one| &one.figure)) {
            if !figures.contains(figure) {
                figures.push(figure.clone());
            }
        }
        figures
    }

    /// A message about the problem with keys and figures in place of their numbers.
    fn named(&self, message: &str) -> String {
        let goals = self.goals.iter().zip(1..).map(|(one, k)| ("objective.terms", k, &one.figure));
        let bounds =
            self.constraints.iter().zip(1..).map(|(one, k)| ("constraints", k, &one.figure));
        let keys = self.variables.iter().zip(1..).map(|(one, k)| ("variables", k, &one.key));
        let mut all = goals.chain(bounds).chain(keys);
        let named = all.find_map(|(list, number, name)| {
            let rest = message.strip_prefix(&format!("{list}[{number}]"))?;
            Some(format!("{name}{rest}"))
        });
        named.unwrap_or_else(|| message.to_owned())
    }
}

impl Begun {
    /// Searches, and leaves what was found or why not in `session`; the best of a search that the
    /// user stops is the draft.
    pub fn run(self, session: &Session, actions: &dyn Actions, context: RunContext) {
        let context = RunContext { interrupt: &self.interrupt, ..context.mute() };
        let texts = (&*self.file, &*self.text);
        let searched = actions.optimise(&self.problem, texts, &self.folder, context);
        let searched = searched
            .and_then(|(found, missed)| Ok((values(&found, &self.keys)?, missed.join("; "))));
        follow(session);
        if !self.folder.join(log::FILE).exists() {
            // It has not begun: nothing of it stays.
            let _ = fs::remove_dir_all(&self.folder);
        }
        let is_kept = session.search(|search| {
            match searched {
                Ok((found, missed)) => {
                    search.found = Some(found);
                    let ended = search.is_stopped.then(|| {
                        "the search ended before the stop: the values of the design found are in \
                         the draft, and Undo takes it back"
                            .to_owned()
                    });
                    let missed = (!missed.is_empty())
                        .then(|| format!("a design was found that misses constraints: {missed}"));
                    let words: Vec<String> = missed.into_iter().chain(ended).collect();
                    search.note = (!words.is_empty()).then(|| words.join("; "));
                }
                Err(error) if !self.interrupt.is_raised() => {
                    search.note = Some(format!("{error:#}"));
                }
                Err(_) => {
                    search.found = search.best();
                    let count = search.count();
                    search.note = Some(match search.found {
                        Some(_) => format!(
                            "stopped: the values of the best of {count} candidates, by few \
                             paths, are in the draft; it may be worse than before, and Undo takes \
                             it back"
                        ),
                        None => format!(
                            "stopped: expected a candidate that meets the constraints, got \
                             none in {count}; the design stays"
                        ),
                    });
                }
            }
            search.is_stopped && search.found.is_some()
        });
        if is_kept && let Err(fault) = take(session) {
            let note = format!("stopped; the design does not take the best: {}", fault.message());
            session.search(|search| search.note = Some(note));
        }
        session.search(|search| search.is_running = false);
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

/// The path of a folder under `out` that is not there yet.
fn free_folder(out: &Path, name: &str) -> Result<PathBuf> {
    let mut numbered = (1..10_000).map(|number| out.join(format!("{name}-search-{number}")));
    let free = numbered.find(|folder| !folder.exists());
    free.with_context(|| format!("`{}`: expected fewer than 10 000 searches", out.display()))
}

/// The problem file.
fn problem_text(request: &Request, design: &Design, file: &str, model: Model) -> Result<String> {
    let generations = request.generations;
    ensure!(
        (1..=MAX_GENERATIONS).contains(&generations),
        "generations: expected 1 to {MAX_GENERATIONS}, got {generations}"
    );
    // No more than the user takes for enough.
    let [paths, verified] = [PATHS, VERIFIED].map(|most| most.min(design.trace.paths));
    let stage = json!({"model": model.word(), "population": POPULATION, "restarts": 1,
        "evaluations": POPULATION * generations, "paths": paths, "most_paths": verified});
    let head = json!({
        "name": format!("{}-found", design.name),
        "design": file,
        "stages": [stage],
        "verification": {"paths": verified},
    });
    let mut table = toml::Table::try_from(head)?;
    let terms =
        toml::Table::from_iter([("terms".to_owned(), toml::Value::try_from(&request.goals)?)]);
    table.insert("variables".to_owned(), toml::Value::try_from(&request.variables)?);
    table.insert("objective".to_owned(), toml::Value::Table(terms));
    table.insert("constraints".to_owned(), toml::Value::try_from(&request.constraints)?);
    Ok(format!(
        "# A search that `batwing explore` began from its draft, which the design file may not \
         hold.\n\n{}",
        toml::to_string(&table)?
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(more: &Value) -> Request {
        let mut request = json!({
            "goals": [{"figure": "uniformity", "goal": "maximise", "scale": 0.03}],
            "constraints": [{"figure": "extraction_efficiency", "at_least": 0.5}],
            "variables": [{"key": "array.pitch_mm", "from": 4, "to": 6.5}],
            "generations": 3,
        });
        for (key, value) in more.as_object().expect("keys") {
            request[key] = value.clone();
        }
        serde_json::from_value(request).expect("a request")
    }

    #[test]
    fn problem_files_hold_what_was_asked_for() {
        let design = design::embedded("d1.toml").expect("a design");
        let text = |request: &Request| {
            let text = problem_text(request, &design, "/a \"b\"/own.toml", Model::Geometric);
            text.expect("a text").parse::<toml::Table>().expect("TOML")
        };
        let table = text(&request(&json!({})));
        assert_eq!(table["design"].as_str(), Some("/a \"b\"/own.toml"));
        assert_eq!(table["variables"][0]["to"].as_float(), Some(6.5));
        assert_eq!(table["stages"][0]["evaluations"].as_integer(), Some(48));
        assert_eq!(table["objective"]["terms"][0].get("target"), None);
        assert_eq!(table["constraints"][0]["at_least"].as_float(), Some(0.5));
        let near = json!({"goals": [{"figure": "beam_angle_deg", "goal": "target", "target": 90}]});
        assert_eq!(text(&request(&near))["objective"]["terms"][0]["target"].as_float(), Some(90.0));
        let found = values("[array]\npitch_mm = 5.5\n", &["array.pitch_mm".to_owned()]);
        assert_eq!(found.expect("found"), [("array.pitch_mm".to_owned(), json!(5.5))]);
    }

    #[test]
    fn what_is_no_problem_is_refused_by_its_name_before_anything_is_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("own.toml");
        let formula = design::NEW_DESIGN.replace("NAME", "own");
        let formula =
            formula.replace("width_mm = 2.8", "width_mm = \"1.75 * dome.sphere_radius_mm\"");
        std::fs::write(&path, formula).expect("written");
        let session = Session::open(&path).expect("a session");
        let out = folder.path().join("explored");
        let varied = |key: &str, from: f64, to: f64| json!({"variables": [{"key": key, "from": from, "to": to}]});
        let near = json!([{"figure": "uniformity", "goal": "target"}]);
        for (more, expected) in [
            (
                varied("array.pitch_mm", 6.0, 5.0),
                "array.pitch_mm: from, to: expected a number and a larger one, got 6 and 5",
            ),
            (
                varied("array.pitch_mm", 6.0, 6.0),
                "array.pitch_mm: from, to: expected a number and a larger one, got 6 and 6",
            ),
            (
                varied("array.columns", 2.2, 2.4),
                "array.columns: from, to: expected bounds with a whole number",
            ),
            (
                json!({"variables": [{"key": "array.pitch_mm", "from": 6, "to": 7, "start": 5}]}),
                "array.pitch_mm: start: expected a number from 6 to 7, got 5",
            ),
            (varied("array.no", 1.0, 2.0), "array.no: "),
            (varied("dome.width_mm", 1.0, 2.0), "dome.width_mm: expected a number to change, got"),
            (json!({"variables": []}), "variables: expected at least one, got none"),
            (json!({"goals": []}), "objective.terms: expected at least one, got none"),
            (json!({"goals": near}), "uniformity: target: expected it with goal"),
            (json!({"goals": [{"figure": "glow", "goal": "maximise"}]}), "glow: figure"),
            (
                json!({"constraints": [{"figure": "uniformity", "at_least": 2, "at_most": 1}]}),
                "uniformity: ",
            ),
            (json!({"constraints": [{"figure": "uniformity"}]}), "uniformity: "),
            (json!({"generations": 0}), "generations: expected 1 to 1000, got 0"),
        ] {
            let fault = begin(&session, &request(&more), &out).expect_err("refused");
            assert!(fault.message().starts_with(expected), "{more}: {}", fault.message());
            assert!(!fault.message().contains("problem.toml"), "{}", fault.message());
            assert!(!out.exists() && session.peek(|search| search.number) == 0);
        }
        begin(&session, &request(&json!({})), &out).expect("a problem");
        assert!(out.join("own-search-1/problem.toml").exists());
    }
}
