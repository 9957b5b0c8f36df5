// SPDX-License-Identifier: MIT OR Apache-2.0
//! A search from the present design, by the candidates in its log, and how it ended.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use serde_json::{Map, Value, json};

use results::figure_entry::FigureEntry;
use results::shown;
use runtime::interrupt::Interrupt;

/// A search and how far it is.
#[derive(Debug, Default)]
pub struct Search {
    /// Number in the session, from 1; 0 before the first.
    pub number: usize,
    /// Its folder.
    pub folder: PathBuf,
    /// Keys that are varied.
    pub keys: Vec<String>,
    /// Figures of goals and constraints.
    pub figures: Vec<String>,
    /// Raised to stop it.
    pub interrupt: Interrupt,
    /// True until it has ended.
    pub is_running: bool,
    /// True where the user has stopped it.
    pub is_stopped: bool,
    /// Values found, by key.
    pub found: Option<Vec<(String, Value)>>,
    /// How it ended, for people.
    pub note: Option<String>,
    /// Bytes of the log that were read.
    pub read: u64,
    /// As the page reads them.
    pub(crate) candidates: Vec<Value>,
    /// Whole generations.
    pub(crate) generations: usize,
    /// Candidates before the generation under way.
    pub(crate) before: usize,
    /// The feasible candidate of the least value.
    pub(crate) best: Option<usize>,
}

impl Search {
    /// Stops it; what is best so far is kept.
    pub fn stop(&mut self) {
        self.is_stopped = self.is_running;
        self.interrupt.flag().store(true, Ordering::SeqCst);
    }

    /// Takes whole lines of the log.
    pub fn follow(&mut self, lines: &str) {
        self.read += lines.len() as u64;
        for line in lines.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok()) {
            if line["kind"] == "candidate" {
                self.candidates.push(candidate(&line));
                self.best = self.least(self.best.into_iter().chain([self.candidates.len() - 1]));
            } else if line["kind"] == "generation" {
                if line["generation"] == 0 {
                    // The selection judges what was found by more paths.
                    self.best = self.least(self.before..self.candidates.len()).or(self.best);
                }
                // The selection is none.
                self.generations += usize::from(line["generation"] != 0);
                self.before = self.candidates.len();
            }
        }
    }

    /// The feasible one of the least value of these candidates.
    fn least(&self, among: impl Iterator<Item = usize>) -> Option<usize> {
        let value = |k: &usize| self.candidates[*k]["value"].as_f64();
        let feasible = among.filter(|k| self.candidates[*k]["feasible"] == true);
        let valued = feasible.filter_map(|k| Some((k, value(&k)?)));
        valued.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    /// Values of the best candidate by key.
    pub fn best(&self) -> Option<Vec<(String, Value)>> {
        let at = self.candidates[self.best?]["at"].as_array()?;
        Some(self.keys.iter().cloned().zip(at.iter().cloned()).collect())
    }

    /// Number of candidates.
    pub fn count(&self) -> usize {
        self.candidates.len()
    }

    /// Candidates from the number `from` on, from 0, as the page reads them.
    pub fn candidates(&self, from: usize) -> Value {
        json!({"number": self.number, "candidates": self.candidates.get(from..)})
    }

    /// As the page reads it.
    pub fn to_json(&self) -> Value {
        if self.number == 0 {
            return Value::Null;
        }
        json!({"number": self.number, "running": self.is_running, "keys": self.keys,
            "figures": self.figures, "candidates": self.candidates.len(), "best": self.best,
            "generations": self.generations, "found": self.found.is_some(), "note": self.note})
    }
}

/// A line of the log as the page reads it.
fn candidate(line: &Value) -> Value {
    let figures = line["figures"].as_object().into_iter().flatten();
    let figures = figures.filter_map(|(key, entry)| {
        let entry: FigureEntry = serde_json::from_value(entry.clone()).ok()?;
        let text = shown::text(&entry, shown::named(key).1);
        Some((key.clone(), json!({"value": entry.value, "text": text})))
    });
    json!({"at": line["coefficients"], "value": line["value"], "feasible": line["feasible"],
        "objective": line["objective"], "refused": line["refused"],
        "figures": figures.collect::<Map<String, Value>>()})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_is_feasible_and_that_of_the_selection_once_there_is_one() {
        let line = |at: f64, value: Option<f64>, feasible: bool| {
            let figures = json!({"uniformity": {"value": at, "standard_error": 0.01}});
            json!({"kind": "candidate", "coefficients": [at], "value": value,
                "feasible": feasible, "figures": figures})
        };
        let end = |generation: usize| json!({"kind": "generation", "generation": generation});
        let mut search = Search { number: 1, keys: vec!["a.b".to_owned()], ..Search::default() };
        let mut follow = |lines: &[Value]| {
            let text = lines.iter().map(|line| format!("{line}\n")).collect::<Vec<_>>().concat();
            search.follow(&text);
            (search.to_json()["best"].clone(), search.best())
        };
        let at = |value: f64| Some(vec![("a.b".to_owned(), json!(value))]);
        let first = [line(0.1, None, false), line(0.2, Some(-9.0), false)];
        assert_eq!(follow(&first), (Value::Null, None));
        assert_eq!(follow(&[line(0.3, Some(-3.0), true), end(1)]), (json!(2), at(0.3)));
        assert_eq!(follow(&[line(0.4, Some(-2.0), true)]), (json!(2), at(0.3)));
        // A lucky candidate is no better than what more paths say.
        let selection = [end(2), line(0.5, Some(-1.0), true), line(0.6, Some(-0.5), true)];
        follow(&selection);
        assert_eq!(follow(&[end(0)]), (json!(4), at(0.5)));
        assert_eq!(search.to_json()["generations"], 2);
        let shown = search.candidates(2)["candidates"][0]["figures"]["uniformity"].clone();
        assert_eq!(shown, json!({"value": 0.3, "text": "30.0 ± 1.0 %"}));
    }
}
