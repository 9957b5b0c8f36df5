// SPDX-License-Identifier: MIT OR Apache-2.0
//! Problems that `batwing optimise` refuses, and searches that find nothing: one message, and nothing
//! half-written.

use std::path::Path;

use crate::optimise::{PROBLEM, folder};
use crate::support::binary::batwing;

/// Changes to [`PROBLEM`], and words of the message against it.
type Case = (&'static [(&'static str, &'static str)], &'static [&'static str]);

/// Problems that are refused before anything is written.
const REFUSED: &[Case] = &[
    (&[("from = 4.5", "from = 14.5")], &["variables[1]: from, to", "14.5", "12"]),
    (&[("array.pitch_mm", "array.pich_mm")], &["variables[1]: array.pich_mm", "no such key"]),
    (&[("array.pitch_mm", "led.reflection")], &["variables[1]: led.reflection", "specular"]),
    (&[("key = \"array.pitch_mm\"", "")], &["variables[1]", "`key` and `profile`"]),
    (&[("to = 12.0", "to = 12.0\nstart = 13.0")], &["variables[1]: start", "13"]),
    (&[("from = 4.5\nto = 12.0", "choices = [5.0]")], &["variables[1]: choices", "got 1"]),
    (
        &[("from = 4.5\nto = 12.0", "value = \"2 * array.pitch_mm\"")],
        &["variables[1]: array.pitch_mm", "which leads back to array.pitch_mm"],
    ),
    (&[("from = 4.5\nto = 12.0", "value = \"5\"")], &["variables: expected", "`value` alone"]),
    (&[("to = 12.0", "value = \"5\"")], &["variables[1]: value", "a `key` alone beside it"]),
    (
        &[("key = \"array.pitch_mm\"", "profile = \"inner_slope_deg\"")],
        &["variables[1]", "[elements]"],
    ),
    (
        &[(
            "[[objective",
            "[[variables]]\nkey = \"array.pitch_mm\"\nfrom = 5.0\nto = 6.0\n\n[[objective",
        )],
        &["variables[2]", "array.pitch_mm beside array.pitch_mm"],
    ),
    (
        &[(
            "from = 4.5\nto = 12.0",
            "from = 4.5\nto = 12.0\n\n[[variables]]\nkey = \"dome.height_mm\"\nfrom = 0.8\nto = 1.0\n\n\
             [[variables]]\nprofile = \"height_mm\"\nfrom = 0.1\nto = 1.2",
        )],
        &["variables[3]", "height_mm beside dome.height_mm"],
    ),
    (
        &[("from = 4.5\nto = 12.0", "choices = [5.0, 6.0]\nstart = 5.0")],
        &["variables[1]: start", "`choices`"],
    ),
    (
        &[("restarts = 2", "restarts = 2\nmethod = \"bipop\"")],
        &["stages[1]: restarts", "cma_es", "bipop"],
    ),
    (
        &[("paths = 65536", "paths = 65536\nsamples = 8")],
        &["verification.samples", "objective.tolerances"],
    ),
    (&[("\"uniformity\"", "\"uniformness\"")], &["objective.terms[1]: figure", "uniformness"]),
    (&[("\"uniformity\"", "\"receiver.wall\"")], &["objective.terms[1]: figure", "wall"]),
    (
        &[("\"uniformity\"", "\"flux_up\"")],
        &["objective.terms[1]: figure", "flux_up", "led.power_w"],
    ),
    (
        &[("\"uniformity\"", "\"absorbed_by_wall\"")],
        &["objective.terms[1]: figure", "absorbed_by_ground_mirror", "absorbed_by_wall"],
    ),
    (
        &[("\"uniformity\"", "\"uniformity\"\nweight = 0.0")],
        &["objective.terms[1]: weight", "got 0"],
    ),
    (&[("\"uniformity\"", "\"uniformity\"\ngoal = \"target\"")], &["objective.terms[1]: target"]),
    (
        &[("\"uniformity\"", "\"far_field_distance\"")],
        &["objective.terms[1]: file", "the target of far_field_distance"],
    ),
    (
        &[(
            "\"uniformity\"",
            "\"illuminance_distance\"\ngoal = \"minimise\"\nfile = \"bare-dome.toml\"",
        )],
        &["objective.terms[1]", "bare-dome.toml", "expected x and y"],
    ),
    (
        &[("evaluations = 24", "evaluations = 5")],
        &["stages[1]: evaluations", "6, one generation", "got 5"],
    ),
    (&[("restarts = 2", "restarts = 9")], &["stages[1]: restarts", "got 9"]),
    (&[("restarts = 2", "step = 0.0")], &["stages[1]: step", "got 0"]),
    (&[("most_paths = 4096", "most_paths = 2048")], &["stages[1]", "most_paths", "2048"]),
    (
        &[("[verification]", "[stages.set]\n\"array.pitch_mm\" = 5.0\n\n[verification]")],
        &["stages[1]: set", "array.pitch_mm"],
    ),
    (
        &[(
            "[verification]",
            "[[constraints]]\nfigure = \"extraction_efficiency\"\nat_least = 0.9\n\
             at_most = 0.8\n\n[verification]",
        )],
        &["constraints[1]: at_least, at_most", "got 0.9 and 0.8"],
    ),
    (
        &[(
            "[verification]",
            "[[constraints]]\nfigure = \"extraction_efficiency\"\n\n[verification]",
        )],
        &["constraints[1]", "got neither"],
    ),
    (
        &[("[verification]", "[limits]\ndraft_deg = 50.0\n\n[verification]")],
        &["limits.draft_deg", "got 50"],
    ),
    (&[("paths = 65536", "paths = 1")], &["verification.paths", "got 1"]),
    (&[("\"closer\"", "\"bare-dome\"")], &["name: expected another name"]),
    (&[("\"closer\"", "\"../closer\"")], &["name: ", "../closer"]),
    (&[("\"closer\"", "\"design.toml\"")], &["name: ", "design.toml"]),
    (
        &[("\"uniformity\"", "\"cell_colour_difference\"\ngoal = \"minimise\"")],
        &["objective.terms[1]: figure", "several wavelengths"],
    ),
    (
        &[("\"uniformity\"", "\"uniformity\"\nweight = 1e300")],
        &["objective.terms[1]: weight", "1e300"],
    ),
    (
        &[("\"uniformity\"", "\"uniformity\"\ngoal = \"target\"\ntarget = nan")],
        &["objective.terms[1]: target", "NaN"],
    ),
    (
        &[("array.pitch_mm\"\nfrom = 4.5\nto = 12.0", "led.power_w\"\nfrom = 0.5\nto = 2.0")],
        &["variables: led.power_w", "`start`"],
    ),
    (
        &[("\"uniformity\"", "\"design.array.pitch_um\"")],
        &["objective.terms[1]: figure", "array.pitch_um"],
    ),
    (&[("restarts = 2", "method = \"nsga2\"")], &["stages[1].method", "two terms"]),
    (&[("name =", "nam =")], &["line 2, column 1: nam"]),
    (&[("bare-dome.toml", "none.toml")], &["design: `none.toml`"]),
];

/// Problems whose searches find nothing; the log says why.
const FRUITLESS: &[Case] = &[
    (
        &[(
            "[verification]",
            "[[constraints]]\nfigure = \"extraction_efficiency\"\nat_least = 1.5\n\n[verification]",
        )],
        &[
            "constraints",
            "nearest, extraction_efficiency is 99.",
            "expected at least 150 % by 2 standard errors: missed by 5",
            "24 candidates",
        ],
    ),
    (
        &[("[verification]", "[limits]\ntotal_height_mm = 0.5\n\n[verification]")],
        &["stages[1]", "limits.total_height_mm: 1.0000 above 0.5", "24 candidates"],
    ),
];

/// What the binary says against a changed problem.
fn refusal(folder: &Path, (changes, words): &Case) {
    let mut text = PROBLEM.to_owned();
    for (before, after) in *changes {
        assert!(text.contains(before), "{before}");
        text = text.replacen(before, after, 1);
    }
    std::fs::write(folder.join("problem.toml"), text).expect("written");
    let output = batwing(folder)
        .args(["optimise", "problem.toml", "--quiet", "--out", "out"])
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{changes:?}: {said}");
    assert!(said.starts_with("batwing: problem.toml: "), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    for word in *words {
        assert!(said.contains(word), "no `{word}` in: {said}");
    }
}

#[test]
fn bad_problems_end_in_one_message_and_write_nothing() {
    let folder = folder();
    for case in REFUSED {
        refusal(folder.path(), case);
        assert!(!folder.path().join("out").exists(), "{case:?}");
    }
}

#[test]
fn searches_that_find_nothing_say_why_and_leave_the_log_alone() {
    for case in FRUITLESS {
        let folder = folder();
        refusal(folder.path(), case);
        let left = std::fs::read_dir(folder.path().join("out")).expect("a folder");
        let left: Vec<_> = left.map(|e| e.expect("a file").file_name()).collect();
        assert_eq!(left, ["log.jsonl"], "{case:?}");
    }
}

#[test]
fn times_without_unit_or_sense_are_refused() {
    let folder = folder();
    for time in ["5", "0s", "-3min", "1e9h", "nan", "infs", "5days"] {
        let budget = format!("--budget={time}");
        let output = batwing(folder.path())
            .args(["optimise", "problem.toml", "--out", "out", &budget])
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("--budget") && said.contains(time), "{said}");
        assert!(!folder.path().join("out").exists(), "{time}");
    }
}
