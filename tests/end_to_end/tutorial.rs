// SPDX-License-Identifier: MIT OR Apache-2.0
//! `docs/tutorial.md` and the design of one's own of `README.md`: every command runs, in its order, on the files that it
//! writes, and the figures that are quoted are those that come out.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use batwing_tests::{read, workspace};
use metrics::digits::format_value_with_error;

use crate::support::binary::batwing;

/// What the page asks its reader to do.
enum Step {
    /// A command that begins with `batwing`.
    Batwing(Vec<String>),
    /// `cp FROM TO`.
    Copy(String, String),
    /// A file with this text.
    Write(String, String),
    /// More text at the end of a file.
    Append(String, String),
}

/// The last file that a text names: `` `NAME.toml` ``.
fn named(text: &str) -> String {
    let is_file = |word: &&str| word.strip_suffix(".toml").is_some_and(|name| !name.contains(' '));
    let name = text.split('`').rev().find(is_file);
    name.expect("a name of a file").to_owned()
}

fn steps(page: &str) -> Vec<Step> {
    let (mut steps, mut said) = (Vec::new(), String::new());
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let words = || line.split_whitespace().map(str::to_owned);
        if line.starts_with("    batwing ") {
            steps.push(Step::Batwing(words().skip(1).collect()));
        } else if line.starts_with("    cp ") {
            let words: Vec<String> = words().collect();
            steps.push(Step::Copy(words[1].clone(), words[2].clone()));
        } else if line == "```toml" {
            let text: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            let (file, text) = (named(&said), text.join("\n") + "\n");
            steps.push(if said.contains("Append to") {
                Step::Append(file, text)
            } else {
                Step::Write(file, text)
            });
        } else {
            if line.is_empty() && !said.is_empty() {
                said.push('\n');
            }
            if line.starts_with('#') {
                said.clear();
            }
            said.push_str(line);
        }
    }
    steps
}

/// All `value ± error` of a text.
fn quoted(text: &str) -> BTreeSet<String> {
    let words: Vec<&str> = text.split([' ', '\n', '|', '(', ')', ',']).collect();
    let end = |word: &str| word.trim_end_matches(['.', ';', '%']).to_owned();
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let numbers = words.windows(3).filter(|three| three[1] == "±" && is_number(three[0]));
    numbers.map(|three| format!("{} ± {}", three[0], end(three[2]))).collect()
}

/// All figures of a study as the program writes numbers.
fn of_study(file: &Path) -> BTreeSet<String> {
    let study: Value = serde_json::from_str(&read(file)).expect("JSON");
    let setups = study["setups"].as_array().expect("set-ups");
    let figures = setups.iter().flat_map(|setup| setup["figures"].as_array().expect("figures"));
    let number = |figure: &Value, key: &str| figure[key].as_f64().expect("a number");
    let shown = |figure: &Value| {
        let [value, error] = ["value", "standard_error"].map(|key| number(figure, key));
        format_value_with_error(value, error)
    };
    figures.map(shown).collect()
}

/// Does what the page asks for in a folder: how many commands ran, and the figures that they printed.
fn follow(page: &str, at: &Path) -> (usize, BTreeSet<String>) {
    let mut printed = BTreeSet::new();
    let mut ran = 0;
    for step in steps(page) {
        match step {
            Step::Batwing(arguments) => {
                let output = batwing(at).args(&arguments).output().expect("it runs");
                let said = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{arguments:?}: {said}");
                printed.extend(quoted(&String::from_utf8_lossy(&output.stdout)));
                ran += 1;
            }
            Step::Copy(from, to) => {
                std::fs::copy(at.join(from), at.join(to)).expect("copied");
            }
            Step::Write(file, text) => {
                let path = at.join(&file);
                if file == "my-package.toml" {
                    // What `new` wrote, with the line that the page takes the comment from.
                    let parsed = |text: &str| text.parse::<toml::Table>().expect("TOML");
                    let own = read(&path).replace("# power_lm", "power_lm");
                    assert_eq!(parsed(&own), parsed(&text), "{text}");
                }
                std::fs::write(path, text).expect("written");
            }
            Step::Append(file, text) => {
                let path = at.join(file);
                std::fs::write(&path, read(&path) + "\n" + &text).expect("written");
            }
        }
    }
    (ran, printed)
}

/// Judges whether all figures of a page are among those that came out.
fn judge(page: &str, printed: &BTreeSet<String>) {
    let unknown: Vec<String> = quoted(page).difference(printed).cloned().collect();
    assert!(unknown.is_empty(), "{unknown:?} of the page are not among {printed:?}");
}

#[test]
fn the_own_design_of_the_readme_gives_the_quoted_figures() {
    let folder = tempdir().expect("a folder");
    let readme = read("README.md");
    let (_, page) = readme.split_once("## A design of your own").expect("the section");
    let page = page.split("\n## ").next().unwrap_or_default();
    let (ran, printed) = follow(page, folder.path());
    assert_eq!((ran, quoted(page).len()), (3, 7));
    judge(page, &printed);
}

#[test]
#[ignore = "nightly: six runs, tables and a study (65 s)"]
fn nightly_every_command_of_the_tutorial_runs_and_gives_the_quoted_figures() {
    let folder = tempdir().expect("a folder");
    let page = read(workspace().join("docs/tutorial.md"));
    let (ran, mut printed) = follow(&page, folder.path());
    printed.extend(of_study(&folder.path().join("study/study.json")));
    assert!(ran >= 8, "{ran} commands");
    judge(&page, &printed);
}
