// SPDX-License-Identifier: MIT OR Apache-2.0
//! Conclusions of studies, tolerance analyses and searches: what noise hides is not resolved, what
//! is paired is judged by paired errors, and what cannot be had is refused before anything is traced.
//!
//! Inputs lie in `tests/findings/`.

use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::binary::batwing;
use crate::support::runs::{files, interrupted};

/// A folder with `names` of `tests/findings/`.
pub fn folder(names: &[&str]) -> TempDir {
    let folder = tempdir().expect("a folder");
    for name in names {
        let from = batwing_tests::workspace().join("tests/findings").join(name);
        std::fs::copy(from, folder.path().join(name)).expect("copied");
    }
    folder
}

/// Replaces parts of a file, each of which it holds.
pub fn change(path: &Path, pairs: &[(&str, &str)]) {
    let mut text = std::fs::read_to_string(path).expect("a file");
    for (before, after) in pairs {
        assert!(text.contains(before), "{before}");
        text = text.replace(before, after);
    }
    std::fs::write(path, text).expect("written");
}

/// What a command says on standard output and on standard error.
pub fn says(at: &Path, arguments: &[&str]) -> (bool, String, String) {
    let output = batwing(at).args(arguments).output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.success(), text(output.stdout), text(output.stderr))
}

pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// Fields of a line of CSV.
pub fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            c => fields.last_mut().expect("a field").push(c),
        }
    }
    fields
}

#[test]
fn names_with_commas_head_their_own_column() {
    let folder = folder(&["tolerance-comma.toml", "tiny.toml"]);
    let (done, _, said) = says(folder.path(), &["tolerance", "tolerance-comma.toml"]);
    assert!(done, "{said}");
    let table = std::fs::read_to_string(folder.path().join("tolerance/samples.csv"));
    let table = table.expect("a table");
    let rows: Vec<Vec<String>> = table.lines().map(fields).collect();
    assert_eq!(rows[0][0], "inner, beta led.height_mm");
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{table}");
}

#[test]
fn a_third_name_of_a_pair_is_refused() {
    let folder = folder(&["tolerance-between3.toml", "tiny.toml"]);
    let (done, _, said) = says(folder.path(), &["tolerance", "tolerance-between3.toml"]);
    assert!(!done && said.contains("correlations[1].between"), "{said}");
    assert!(said.contains("two tolerances, got 3"), "{said}");
}

/// Deviations of nanometres.
const NOTHING: &str = r#"
name = "noise"
design = "tiny.toml"
samples = 16
paths = 20000
figures = ["illuminance_valley_to_peak", "extraction_efficiency"]
set = { "receiver.bin_mm" = 0.1 }
[[tolerances]]
key = "led.height_mm"
deviation = 1e-7
[[tolerances]]
key = "mirror.reflectance"
deviation = 1e-7
[[constraints]]
figure = "illuminance_valley_to_peak"
at_least = 0.5
"#;

/// Traces differ by their noise alone: no scatter, no quantiles, no causes, and no yield, but of a
/// bound that noise does not reach.
#[test]
fn a_yield_of_noise_is_not_resolved() {
    let folder = folder(&["tiny.toml"]);
    let at = folder.path();
    let path = at.join("tolerance.toml");
    let analysed = |bound: &str| {
        std::fs::write(&path, NOTHING.replace("0.5", bound)).expect("written");
        let (done, text, said) = says(at, &["tolerance", "tolerance.toml"]);
        assert!(done, "{said}");
        (json(&at.join("tolerance/tolerance.json")), text)
    };
    let (found, _) = analysed("0.5");
    let figure = &found["figures"]["illuminance_valley_to_peak"];
    let nominal = number(&figure["nominal"]["value"]);
    assert!(figure["deviation"].is_null() && figure["contributions"].is_null(), "{figure}");
    assert_eq!(figure["quantiles"].as_array().map(Vec::len), Some(0));
    let (below, noise) = (number(&figure["deviation_below"]), number(&figure["noise_of_a_trace"]));
    assert!(0.0 < below && below < 2.0 * noise, "{figure}");
    assert!(found["distribution"].is_null());

    let (found, text) = analysed(&nominal.to_string());
    let yielded = &found["yield"];
    assert!(yielded["share"].is_null() && yielded["good"].is_null(), "{yielded}");
    let why = yielded["not_resolved"].as_str().expect("a reason");
    assert!(why.contains("noise of a trace of illuminance_valley_to_peak"), "{why}");
    assert!(text.contains("yield: not resolved: ") && !text.contains("interval"), "{text}");
    let (done, _, said) = says(at, &["report", "tolerance"]);
    assert!(done, "{said}");
    let page = std::fs::read_to_string(at.join("tolerance/report.html")).expect("a page");
    assert!(page.contains("Yield: not resolved: ") && !page.contains("95 % interval"));

    let (found, text) = analysed(&(nominal - 1.0).to_string());
    assert_eq!(found["yield"]["share"], 1.0, "{}", found["yield"]);
    assert!(text.contains("16 of 16 packages, 100.0 %"), "{text}");
}

/// Extremes of a cell that few paths do not resolve scatter by more than their halves tell.
#[test]
fn the_noise_of_open_extremes_is_no_scatter() {
    let folder = folder(&["side-lens.toml"]);
    let at = folder.path();
    let text = "name = \"noise\"\ndesign = \"side-lens.toml\"\nsamples = 16\npaths = 20000\n\
                figures = [\"cell_valley_to_peak\", \"cell_logarithmic\", \"beam_angle_deg\"]\n\
                [[tolerances]]\nkey = \"silicone.index\"\ndeviation = 1e-9\n\
                [[constraints]]\nfigure = \"cell_valley_to_peak\"\nat_least = 0.2\n";
    std::fs::write(at.join("tolerance.toml"), text).expect("written");
    let (done, text, said) = says(at, &["tolerance", "tolerance.toml"]);
    assert!(done, "{said}");
    let found = json(&at.join("tolerance/tolerance.json"));
    for (key, figure) in found["figures"].as_object().expect("figures") {
        let noise = number(&figure["noise_of_a_trace"]);
        let below = number(&figure["deviation_below"]);
        assert!(figure["deviation"].is_null() && below > 0.5 * noise, "{key} {figure}");
    }
    assert!(text.contains("yield: not resolved: "), "{text}");
    // Bounds in their range, and errors that hold them.
    let table = std::fs::read_to_string(at.join("tolerance/samples.csv")).expect("a table");
    let rows: Vec<Vec<String>> = table.lines().map(fields).collect();
    let column = |name: &str| rows[0].iter().position(|head| head == name).expect("a column");
    let [value, error, low, high] = ["", "_standard_error", "_low", "_high"]
        .map(|end| column(&format!("cell_valley_to_peak{end}")));
    for row in &rows[1..] {
        let [value, error, low, high] = [value, error, low, high]
            .map(|column| row[column].parse::<f64>().expect("an open figure"));
        assert!(0.0 <= low && low < value && value < high && high <= 1.0, "{row:?}");
        assert!(error > 0.2 * (value - low).min(high - value), "{row:?}");
    }
}

#[test]
#[ignore = "slow: 4 s"]
fn an_interrupted_analysis_goes_on_to_the_same_bytes() {
    let folder = folder(&["tiny.toml"]);
    let at = folder.path();
    let text = NOTHING.replace("samples = 16", "samples = 60");
    std::fs::write(at.join("tolerance.toml"), text).expect("written");
    let kept = || files(&at.join("cache/checkpoints")).len();
    let arguments = ["tolerance", "tolerance.toml", "--quiet", "--cache", "cache", "--out"];
    let with = |more: &[&'static str]| [&arguments[..], more].concat();
    let (code, said) = interrupted(at, &with(&["again"]), || kept() > 20);
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("finished samples") && said.contains("--resume"), "{said}");
    let done = kept();
    // One of those seen may have been half written.
    assert!((20..76).contains(&done), "{done}");
    let (resumed, _, said) = says(at, &with(&["again", "--resume"]));
    assert!(resumed, "{said}");
    assert!(!at.join("cache/checkpoints").exists());
    let (whole, _, said) = says(at, &with(&["whole"]));
    assert!(whole, "{said}");
    for name in ["tolerance.json", "samples.csv"] {
        let read = |out: &str| std::fs::read(at.join(out).join(name)).expect("a file");
        assert!(read("again") == read("whole"), "{name}");
    }
}

/// The full scale of a map moves its uniformity by 0.0018, which noise of 0.005 in both traces hides
/// only from who forgets that it is the same noise. All other figures are listed with their verdicts.
#[test]
fn a_small_gain_is_told_by_paired_errors() {
    let folder = folder(&["s01b-small-gain.toml", "chips.toml"]);
    let at = folder.path();
    change(&at.join("s01b-small-gain.toml"), &[("evaluations = 40", "evaluations = 2.1e1")]);
    let (done, text, said) = says(at, &["optimise", "s01b-small-gain.toml", "--out", "out"]);
    assert!(done, "{said}");
    assert!(said.contains("at most 21 candidates with "), "{said}");
    let found = json(&at.join("out/optimise.json"));
    let change = &found["objective"]["change"];
    let error = number(&change["standard_error"]);
    assert!(number(&change["value"]) < -5.0 * error && error < 5e-4, "{change}");
    assert!(number(&found["objective"]["after"]["standard_error"]) > 4.0 * error);
    assert_eq!(found["objective"]["verdict"], "better");
    assert!(!text.contains("not better"), "{text}");
    let figures = found["figures"].as_object().expect("figures");
    assert!(figures.len() > 15, "{figures:?}");
    assert_eq!(figures["cell_variation"]["verdict"], "unchanged");
    assert_eq!(figures["diagonal_logarithmic"]["verdict"], "better");
    // The table lists what changed and what was asked for, and counts the rest.
    for (key, figure) in figures {
        let is_listed = key == "uniformity"
            || !["unchanged", "not_resolved"].contains(&figure["verdict"].as_str().expect("words"));
        let stands = text.lines().any(|line| line.split_whitespace().next() == Some(key));
        assert_eq!(stands, is_listed, "{key} in {text}");
    }
    assert!(text.contains(" other figures: ") && text.contains(" unchanged"), "{text}");
}

/// A search for more light between packages costs light out of them: the page and the terminal say so.
#[test]
fn what_a_search_makes_worse_is_said() {
    let folder = folder(&["dome.toml", "s04b-middle-of-range.toml"]);
    let at = folder.path();
    let pairs = [
        (
            "key = \"array.pitch_mm\"\nfrom = 0.5\nto = 4.0",
            "key = \"mirror.reflectance\"\nfrom = 0.2\nto = 0.5",
        ),
        (
            "figure = \"illuminance_valley_to_peak\"",
            "figure = \"design.mirror.reflectance\"\ngoal = \"minimise\"",
        ),
        (
            "key = \"led.size_mm.0\"\nfrom = 0.2\nto = 6.0",
            "key = \"led.height_mm\"\nfrom = 0.2\nto = 0.3",
        ),
        ("evaluations = 80", "evaluations = 12"),
    ];
    change(&at.join("s04b-middle-of-range.toml"), &pairs);
    let (done, text, said) = says(at, &["optimise", "s04b-middle-of-range.toml", "--out", "out"]);
    assert!(done, "{said}");
    let found = json(&at.join("out/optimise.json"));
    assert_eq!(found["figures"]["extraction_efficiency"]["verdict"], "worse");
    assert_eq!(found["figures"]["design.mirror.reflectance"]["verdict"], "better");
    assert!(text.contains("worse than dome beyond errors: "), "{text}");
    let (done, _, said) = says(at, &["report", "out"]);
    assert!(done, "{said}");
    let page = std::fs::read_to_string(at.join("out/report.html")).expect("a page");
    assert!(page.contains("<b>worse</b>") && page.contains(" other figure"));
}

/// The middle of a range that cannot be built says nothing of the others, nor of their type.
#[test]
fn candidates_that_cannot_be_built_are_refused_one_by_one() {
    let folder = folder(&["dome.toml", "s04-whole-numbers.toml", "s04b-middle-of-range.toml"]);
    let at = folder.path();
    for (problem, coordinate) in [("s04-whole-numbers.toml", 0), ("s04b-middle-of-range.toml", 1)] {
        let few = [
            ("evaluations = 60", "evaluations = 12"),
            ("evaluations = 80", "evaluations = 12"),
            ("paths = 50000", "paths = 10000"),
        ];
        let text = std::fs::read_to_string(at.join(problem)).expect("a problem");
        let few: Vec<_> = few.into_iter().filter(|(before, _)| text.contains(before)).collect();
        change(&at.join(problem), &few);
        let out = format!("{problem}.out");
        let (done, text, said) = says(at, &["optimise", problem, "--out", &out]);
        assert!(done, "{said}");
        assert!(text.contains("  refused "), "{text}");
        let log = std::fs::read_to_string(at.join(out).join("log.jsonl")).expect("a log");
        let values = log.lines().filter_map(|line| {
            let line: Value = serde_json::from_str(line).expect("JSON");
            line["coefficients"][coordinate].as_f64()
        });
        let fractions = values.filter(|value| value.fract() != 0.0).count();
        assert!(fractions > 5, "{log}");
    }
}

/// Nine designs in all, of which a front of twenty points holds each but once.
#[test]
fn equal_designs_of_a_front_are_written_once() {
    let folder = folder(&["s05-few-designs.toml", "chips.toml"]);
    let at = folder.path();
    let few = [
        ("evaluations = 160", "evaluations = 60"),
        ("paths = 40000", "paths = 8000"),
        ("most_paths = 80000", "most_paths = 8000"),
        ("paths = 200000", "paths = 20000"),
    ];
    change(&at.join("s05-few-designs.toml"), &few);
    let (done, _, said) = says(at, &["optimise", "s05-few-designs.toml", "--out", "out"]);
    assert!(done, "{said}");
    let found = json(&at.join("out/optimise.json"));
    let front = found["front"]["designs"].as_array().expect("a front");
    let of = |entry: &Value| {
        let file = entry["design"].as_str().expect("a file");
        let text = std::fs::read_to_string(at.join("out").join(file)).expect("a design");
        let design: toml::Table = text.parse().expect("TOML");
        (design["receiver"]["plane_height_mm"].to_string(), design["array"]["pitch_mm"].to_string())
    };
    let designs: std::collections::BTreeSet<_> = front.iter().map(of).collect();
    assert!(designs.len() == front.len() && front.len() <= 9, "{found}");
    let selected = found["stages"][0]["final_candidates"].as_array().expect("candidates");
    assert!(selected.len() <= 10, "{}", selected.len());
    // The design that is found has one state, in the table and in the front.
    let after = &found["figures"]["illuminance_valley_to_peak"]["after"];
    let same = front.iter().find(|entry| entry["figures"][0]["value"] == after["value"]);
    let same = &same.expect("the design that is found")["figures"][0];
    assert!(
        after["interval"].is_array() && same["interval"] == after["interval"],
        "{after} {same}"
    );
}

const MATERIAL: &str =
    "DATA:\n  - type: tabulated n\n    data: |\n        0.4 1.43\n        0.7 1.40\n";

/// Files that lie elsewhere, or are called as an output is, are copied under names of their own.
#[test]
fn files_that_a_design_names_are_copied_beside_the_one_that_is_found() {
    let folder = folder(&["chips.toml", "optimise-outside.toml"]);
    let at = folder.path();
    for name in ["designs", "x", "materials"] {
        std::fs::create_dir(at.join(name)).expect("a folder");
    }
    std::fs::write(at.join("materials/glass.yml"), MATERIAL).expect("written");
    std::fs::write(at.join("designs/log.jsonl"), "0 0\n5 0\n0 5\n5 5\n").expect("written");
    std::fs::rename(at.join("chips.toml"), at.join("designs/rgb-dome.toml")).expect("moved");
    std::fs::rename(at.join("optimise-outside.toml"), at.join("x/p.toml")).expect("moved");
    let design = at.join("designs/rgb-dome.toml");
    change(
        &design,
        &[
            ("columns = 2\nrows = 2\n", "positions_file = \"log.jsonl\"\n"),
            ("size_mm = [0.02, 0.02]", "size_mm = [0.5, 0.5]"),
            ("height_mm = 0.01", "height_mm = 0.35"),
            (
                "[mirror]",
                "[dome]\nsphere_radius_mm = 2.0\nheight_mm = 1.0\nwidth_mm = 3.4\n\
                 [silicone]\nmaterial_file = \"../materials/glass.yml\"\n[mirror]",
            ),
        ],
    );
    let (done, _, said) = says(at, &["optimise", "x/p.toml", "--out", "out"]);
    assert!(done, "{said}");
    let out = at.join("out");
    let found = std::fs::read_to_string(out.join("design.toml")).expect("a design");
    let found: toml::Table = found.parse().expect("TOML");
    let read = |name: &toml::Value| {
        std::fs::read_to_string(out.join(name.as_str().expect("a name"))).expect("a copy")
    };
    assert_eq!(read(&found["silicone"]["material_file"]), MATERIAL);
    assert!(read(&found["array"]["positions_file"]).starts_with("0 0\n"));
    let log = std::fs::read_to_string(out.join("log.jsonl")).expect("a log");
    assert!(log.starts_with("{\"kind\":\"problem\""), "{log}");
    // Moved away, it needs nothing of where it was searched.
    let moved = tempdir().expect("a folder");
    std::fs::rename(&out, moved.path().join("out")).expect("moved");
    batwing(moved.path()).args(["check", "out/design.toml"]).assert().success();
}

/// Chips without domes have no extraction, a single one no neighbours: searches, analyses and studies
/// that ask for it say so first.
#[test]
fn figures_that_a_design_does_not_have_are_refused_first() {
    let folder = folder(&["chips.toml", "s01b-small-gain.toml"]);
    let at = folder.path();
    let single = std::fs::read_to_string(at.join("chips.toml")).expect("a design");
    let single = single.replace("columns = 2\nrows = 2", "columns = 1\nrows = 1");
    std::fs::write(at.join("single.toml"), single).expect("written");
    let problem = std::fs::read_to_string(at.join("s01b-small-gain.toml")).expect("a problem");
    let constraint = "[[constraints]]\nfigure = \"FIGURE\"\nat_least = 0.1\n[[stages]]";
    let tolerance = "name = \"t\"\ndesign = \"DESIGN\"\nsamples = 8\npaths = 2000\n\
                     figures = [\"FIGURE\"]\n[[tolerances]]\nkey = \"led.height_mm\"\ndeviation = 1e-3\n";
    let study = "name = \"s\"\ndesigns = [\"DESIGN\"]\nmodels = [\"geometric\"]\npaths = 2000\n\
                 [targets.chips.geometric]\nFIGURE = { at_least = 0.5 }\n";
    for (design, figure) in [
        ("chips.toml", "extraction_efficiency"),
        ("single.toml", "segment_valley_to_peak"),
        ("single.toml", "uniformity"),
    ] {
        let in_terms = problem.replace("\"uniformity\"", "\"FIGURE\"");
        let in_constraints = problem
            .replace("\"uniformity\"", "\"peak_angle_deg\"")
            .replace("[[stages]]", constraint);
        for (command, text, key) in [
            ("optimise", in_terms.replace("chips.toml", "DESIGN"), "objective.terms[1]"),
            ("optimise", in_constraints.replace("chips.toml", "DESIGN"), "constraints[1]"),
            ("tolerance", tolerance.to_owned(), "figures"),
            ("study", study.to_owned(), "targets.chips.geometric"),
        ] {
            let text = text.replace("DESIGN", design).replace("FIGURE", figure);
            std::fs::write(at.join("file.toml"), text).expect("written");
            let (done, _, said) = says(at, &[command, "file.toml", "--quiet", "--out", "out"]);
            assert!(!done, "{command} {figure}");
            for word in ["file.toml", key, figure] {
                assert!(said.contains(word), "no {word} in: {said}");
            }
            assert!(files(&at.join("out")).is_empty(), "{command} {figure}");
        }
    }
}

/// Bounds and values are met, missed or not resolved by their errors, alike in JSON, CSV and text.
#[test]
fn targets_of_studies_have_verdicts() {
    let folder = folder(&["tiny.toml"]);
    let at = folder.path();
    let study = "name = \"s\"\ndesigns = [\"tiny.toml\"]\nmodels = [\"geometric\"]\npaths = 2e4\n\
                 [base.set]\n\"receiver.bin_mm\" = 0.1\n[targets.tiny.geometric_100um]\n\
                 extraction_efficiency = { at_least = 0.5 }\npeak_angle_deg = { at_most = 0.5 }\n\
                 uniformity = 0.5\n";
    std::fs::write(at.join("study.toml"), study).expect("written");
    let (done, text, said) = says(at, &["study", "study.toml", "--out", "out"]);
    assert!(done, "{said}");
    let found = json(&at.join("out/study.json"));
    let figures = found["setups"][0]["figures"].as_array().expect("figures");
    let figure = |name: &str| figures.iter().find(|f| f["figure"] == name).expect("a figure");
    let extraction = figure("extraction_efficiency");
    assert_eq!(extraction["verdict"], "met");
    assert_eq!(extraction["at_least"], 0.5);
    assert!(number(&extraction["miss"]).abs() <= 0.0);
    let angle = figure("peak_angle_deg");
    assert!(number(&angle["miss"]) > 0.0, "{angle}");
    assert_eq!(figure("uniformity")["target"], 0.5);
    assert!(
        text.contains("extraction_efficiency of tiny geometric_100um, at least 50 %: met"),
        "{text}"
    );
    let table = std::fs::read_to_string(at.join("out/study.csv")).expect("a table");
    let head = fields(table.lines().next().expect("a heading"));
    let column = |name: &str| head.iter().position(|h| h == name).expect("a column");
    let row = table.lines().find(|line| line.contains("extraction_efficiency")).expect("a row");
    let row = fields(row);
    assert_eq!((&*row[column("verdict")], &*row[column("at_least")]), ("met", "0.5"));
}

/// Files of experiments are checked as designs are, and are as large at most.
#[test]
fn files_of_experiments_are_checked_and_of_limited_size() {
    let folder =
        folder(&["tiny.toml", "tolerance-comma.toml", "chips.toml", "s01b-small-gain.toml"]);
    let at = folder.path();
    for (file, kind) in
        [("tolerance-comma.toml", "tolerances"), ("s01b-small-gain.toml", "problem")]
    {
        let (done, text, said) = says(at, &["check", file]);
        assert!(done && text.starts_with(kind), "{text}{said}");
        let parts: &[&str] = match kind {
            "problem" => &[
                "variables",
                "receiver.full_scale: 200 to 300",
                "uniformity, larger",
                "40 candidates by cma_es in geometric",
                "at most 40 candidates with 800,000 to",
            ],
            _ => &["deviations", "inner, beta: deviation", "figures", " traces"],
        };
        for part in parts {
            assert!(text.contains(part), "no {part} in {text}");
        }
    }
    change(&at.join("s01b-small-gain.toml"), &[("from = 200.0", "from = 400.0")]);
    let (done, _, said) = says(at, &["check", "s01b-small-gain.toml"]);
    assert!(!done && said.contains("variables[1]: from, to"), "{said}");

    let long = format!("colour = \"{}\"\n", "a".repeat(4_000_001));
    std::fs::write(at.join("long.toml"), &long).expect("written");
    for arguments in [["tolerance", "long.toml"], ["study", "long.toml"], ["optimise", "long.toml"]]
    {
        let (done, _, said) = says(at, &arguments);
        assert!(!done && said.contains("at most 4 MB"), "{arguments:?} {said}");
        assert!(said.contains("long.toml") && said.len() < 1000, "{}", said.len());
    }
}
