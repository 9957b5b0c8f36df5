// SPDX-License-Identifier: MIT OR Apache-2.0
//! States of figures in studies, tolerance analyses and searches, as a run has them: between two ends,
//! below a bound, not resolved. No sampled figure has an error of exactly 0.

use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::verdicts::{change, fields, folder, json, number, says};

/// Four chips whose neighbours are 6 and 5 mm apart, none of them one pitch.
fn apart() -> TempDir {
    let folder = folder(&["chips.toml"]);
    let at = folder.path();
    std::fs::write(at.join("places.txt"), "0 0\n6 0\n0 5\n6 5\n").expect("written");
    let places = "positions_file = \"places.txt\"\npitch_mm = 4.0";
    let pairs = [
        ("columns = 2\nrows = 2\npitch_mm = 5.0", places),
        ("bin_mm = 0.1", "bin_mm = 0.5"),
        ("smoothing_sigma_mm = 0.1", "smoothing_sigma_mm = 0.5"),
    ];
    change(&at.join("chips.toml"), &pairs);
    folder
}

fn write(at: &Path, name: &str, text: &str) {
    std::fs::write(at.join(name), text).expect("written");
}

fn succeeds(at: &Path, arguments: &[&str]) -> String {
    let (done, text, said) = says(at, arguments);
    assert!(done, "{said}");
    text
}

/// True of a figure or a change that states what it does not know.
fn is_honest(figure: &Value) -> bool {
    figure["standard_error"].as_f64().is_some_and(|error| error > 0.0)
        || figure["interval"].is_array()
}

#[test]
fn cell_figures_have_errors_where_no_neighbours_are_one_pitch_apart() {
    let folder = apart();
    let at = folder.path();
    let study = "name = \"s\"\ndesigns = [\"chips.toml\"]\nmodels = [\"geometric\"]\npaths = 2e4\n\
                 [[factors]]\nname = \"plane\"\nkey = \"receiver.plane_height_mm\"\nvalues = [3.5]\n\
                 [targets.chips.geometric]\ncell_variation = { at_most = 0.9 }\n";
    write(at, "study.toml", study);
    succeeds(at, &["study", "study.toml", "--out", "study"]);
    let found = json(&at.join("study/study.json"));
    let figures = found["setups"][1]["figures"].as_array().expect("figures");
    let cells = figures.iter().filter(|f| f["figure"].as_str().unwrap_or("").starts_with("cell_"));
    let cells: Vec<&Value> = cells.collect();
    assert_eq!(cells.len(), 6, "{cells:?}");
    for figure in cells {
        assert!(is_honest(figure) && is_honest(&figure["change"]), "{figure}");
    }
    // A search reads the same figures in its candidates as in its verification.
    let problem = "name = \"p\"\ndesign = \"chips.toml\"\n[[variables]]\n\
                   key = \"receiver.plane_height_mm\"\nfrom = 2.9\nto = 3.1\n\
                   [[objective.terms]]\nfigure = \"cell_min_to_mean\"\n\
                   [[stages]]\nmethod = \"random\"\nevaluations = 4\npopulation = 4\n\
                   paths = 2e4\nmost_paths = 2e4\n[verification]\npaths = 1e5\n";
    write(at, "problem.toml", problem);
    succeeds(at, &["optimise", "problem.toml", "--out", "found"]);
    let verified = json(&at.join("found/optimise.json"));
    let after = number(&verified["figures"]["cell_min_to_mean"]["after"]["value"]);
    let log = std::fs::read_to_string(at.join("found/log.jsonl")).expect("a log");
    let candidate: Value =
        serde_json::from_str(log.lines().nth(1).expect("a candidate")).expect("JSON");
    let searched = number(&candidate["figures"]["cell_min_to_mean"]["value"]);
    assert!(0.2 * after < searched && searched < 2.0 * after, "{searched} {after}");
}

/// A peak that is read as a bin is known between its edges, and so are its changes.
#[test]
fn peaks_that_are_bins_are_between_their_edges_everywhere() {
    let folder = folder(&[]);
    let at = folder.path();
    let d1 = design::EMBEDDED.iter().find(|(name, _)| *name == "d1.toml").expect("a design").1;
    write(at, "d1.toml", d1);
    let study = "name = \"s\"\ndesigns = [\"d1.toml\"]\nmodels = [\"geometric\"]\npaths = 1e5\n\
                 [[factors]]\nname = \"LED\"\nkey = \"led.reflectance\"\nvalues = [0.5]\n\
                 [targets.D1.geometric_100um]\npeak_angle_deg = 20.0\n[scales]\n\
                 peak_angle_deg = 1.0\n";
    write(at, "study.toml", study);
    let text = succeeds(at, &["study", "study.toml", "--out", "study"]);
    assert!(text.contains(" to ") && !text.contains("± 0 "), "{text}");
    assert!(
        text.contains("peak_angle_deg of D1 geometric_100um, near 20 ° by 1 °: not "),
        "{text}"
    );
    let found = json(&at.join("study/study.json"));
    let figure = |setup: usize| {
        let all = found["setups"][setup]["figures"].as_array().expect("figures").iter();
        all.clone().find(|f| f["figure"] == "peak_angle_deg").expect("a peak")
    };
    let [low, high] = [0, 1].map(|k| number(&figure(0)["interval"][k]));
    assert!(low < high, "{}", figure(0));
    assert!(figure(1)["change"]["interval"].is_array(), "{}", figure(1));
    for ranked in found["ranking"].as_array().expect("a ranking") {
        assert!(number(&ranked["misfit"]["standard_error"]) > 0.0, "{ranked}");
    }
    let table = std::fs::read_to_string(at.join("study/study.csv")).expect("a table");
    let head = fields(table.lines().next().expect("a heading"));
    let column = |name: &str| head.iter().position(|h| h == name).expect("a column");
    let row = table.lines().find(|line| line.contains(",peak_angle_deg,")).expect("a row");
    let row = fields(row);
    assert_eq!(row[column("low")].parse(), Ok(low));
    assert_eq!(row[column("high")].parse(), Ok(high));
    succeeds(at, &["report", "study"]);
    let page = std::fs::read_to_string(at.join("study/report.html")).expect("a page");
    // In the digits of the terminal.
    let line = text.lines().find(|line| line.contains("peak_angle_deg of D1")).expect("a target");
    let words = line.trim().split("  ").next().unwrap_or_default();
    assert!(page.contains(words) && !page.contains("± 0 "), "{words}");

    let tolerance = "name = \"t\"\ndesign = \"d1.toml\"\nsamples = 8\npaths = 1e5\n\
                     figures = [\"peak_angle_deg\", \"lost_too_many_bounces\"]\n\
                     [[tolerances]]\nkey = \"led.height_mm\"\ndeviation = 1e-6\n";
    write(at, "tolerance.toml", tolerance);
    let text = succeeds(at, &["tolerance", "tolerance.toml", "--out", "tolerance"]);
    assert!(text.contains(" to ") && text.contains("below ") && !text.contains("± 0 "), "{text}");
    let found = json(&at.join("tolerance/tolerance.json"));
    let peak = &found["figures"]["peak_angle_deg"];
    assert!(peak["nominal"]["interval"].is_array() && peak["shift"]["interval"].is_array());
    assert!(peak["deviation"].is_null() && number(&peak["deviation_below"]) > 0.0, "{peak}");
    let lost = &found["figures"]["lost_too_many_bounces"];
    let bound = number(&lost["nominal"]["upper_bound"]);
    // Three of the paths of 16 traces.
    assert!((bound * 16.0 * 1e5 / 3.0 - 1.0).abs() < 0.01, "{bound}");
    assert!(number(&lost["deviation_below"]) > 0.0 && number(&lost["noise_of_a_trace"]) < 1e-4);
    let noise = text.lines().find(|line| line.starts_with("lost_too_many_bounces"));
    assert!(noise.is_some_and(|line| line.contains("0.0010 points")), "{text}");
    // The table of samples has the columns of a study.
    let table = std::fs::read_to_string(at.join("tolerance/samples.csv")).expect("a table");
    let rows: Vec<Vec<String>> = table.lines().map(fields).collect();
    let number = |row: &[String], name: &str| {
        let column = rows[0].iter().position(|head| head == name).expect("a column");
        row[column].parse::<f64>().expect("a number")
    };
    for row in &rows[1..] {
        let names = ["peak_angle_deg_low", "peak_angle_deg", "peak_angle_deg_high"];
        let [low, value, high] = names.map(|name| number(row, name));
        assert!(low < value && value < high && high - low > 2.0, "{row:?}");
        let [low, high] = ["low", "high"].map(|end| format!("lost_too_many_bounces_{end}"));
        let [low, high] = [low, high].map(|name| number(row, &name));
        assert!(low == 0.0 && (high * 1e5 / 3.0 - 1.0).abs() < 0.01, "{row:?}");
    }
}

/// The table says why the best candidate failed, the log which choice each was, and one design is one
/// trace.
#[test]
fn a_search_says_what_its_best_candidate_missed() {
    let folder = folder(&["chips.toml"]);
    let at = folder.path();
    let problem = "name = \"p\"\ndesign = \"chips.toml\"\n[[variables]]\n\
                   key = \"receiver.plane_height_mm\"\nchoices = [2.0, 3.01, 4.0]\n\
                   [[objective.terms]]\nfigure = \"design.receiver.plane_height_mm\"\n\
                   [[constraints]]\nfigure = \"design.receiver.plane_height_mm\"\nat_most = 3.5\n\
                   [[stages]]\nmethod = \"random\"\nevaluations = 12\npopulation = 12\n\
                   paths = 2000\nmost_paths = 2000\n[verification]\npaths = 2e4\n";
    write(at, "problem.toml", problem);
    let text = succeeds(at, &["optimise", "problem.toml", "--out", "found"]);
    let said = "a better objective, -4, misses constraints: design.receiver.plane_height_mm is 4, \
                expected at most 3.5 by 2 standard errors: missed by 0.50; with \
                receiver.plane_height_mm = 4.0";
    assert!(text.contains(said), "{text}");
    assert!(text.contains(" other figures: ") && !text.contains("± 0 "), "{text}");
    assert!(text.contains("the objective did not change"), "{text}");
    let found = json(&at.join("found/optimise.json"));
    assert_eq!(found["stages"][0]["missed"]["objective"]["value"], -4.0);
    assert_eq!(found["coefficients"][0]["choices"], serde_json::json!([3.01, 3.01]));
    let log = std::fs::read_to_string(at.join("found/log.jsonl")).expect("a log");
    let lines = log.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let candidates: Vec<Value> = lines.filter(|line| line["kind"] == "candidate").collect();
    let chosen = |one: &Value| number(&one["choices"]["receiver.plane_height_mm"]);
    assert!(candidates.iter().any(|one| chosen(one) >= 4.0 && one["feasible"] == false));
    for one in &candidates {
        assert!((number(&one["objective"]) + chosen(one)).abs() < f64::EPSILON, "{one}");
    }
}

/// Of set-ups that miss nothing the one that meets its targets beyond errors comes first.
#[test]
fn of_equal_misfits_more_targets_met_come_first() {
    let folder = folder(&["tiny.toml"]);
    let at = folder.path();
    let study = |least: f64| {
        format!(
            "name = \"s\"\ndesigns = [\"tiny.toml\"]\nmodels = [\"geometric\"]\npaths = 2e4\n\
             [base.set]\n\"receiver.bin_mm\" = 0.1\n\
             [[factors]]\nname = \"mirror\"\nkey = \"mirror.reflectance\"\nvalues = [0.99]\n\
             [targets.tiny.geometric_100um]\nextraction_efficiency = {{ at_least = {least} }}\n"
        )
    };
    let run = |least: f64| {
        write(at, "study.toml", &study(least));
        let text = succeeds(at, &["study", "study.toml", "--out", "out"]);
        (json(&at.join("out/study.json")), text)
    };
    let (found, _) = run(0.5);
    let base = found["setups"][0]["figures"].as_array().expect("figures");
    let base = base.iter().find(|f| f["figure"] == "extraction_efficiency").expect("a figure");
    let (value, error) = (number(&base["value"]), number(&base["standard_error"]));
    let (found, text) = run(value - 0.01 * error);
    assert_eq!(found["ranking"][0]["setup"], "mirror = 0.99", "{}", found["ranking"]);
    let misfits = [0, 1].map(|k| number(&found["ranking"][k]["misfit"]["value"]));
    assert!(misfits.iter().all(|misfit| *misfit == 0.0), "{misfits:?}");
    assert!(text.contains("mirror = 0.99: 1 met") && text.contains("base: 1 not resolved"));
}

#[test]
fn warnings_of_an_analysis_name_the_sample() {
    let folder = folder(&["tiny.toml"]);
    let at = folder.path();
    let tolerance = "name = \"t\"\ndesign = \"tiny.toml\"\nsamples = 8\npaths = 2000\n\
                     figures = [\"extraction_efficiency\"]\n\
                     set = { \"receiver.bin_mm\" = 0.1, \"trace.max_interactions\" = 10 }\n\
                     [[tolerances]]\nkeys = [\"led.size_mm[1]\", \"led.size_mm.1\"]\n\
                     deviation = 1e-3\n";
    write(at, "tolerance.toml", tolerance);
    let (done, _, said) = says(at, &["tolerance", "tolerance.toml", "--out", "out"]);
    assert!(done, "{said}");
    assert!(said.contains("warning: tiny.toml, t, sample "), "{said}");
    assert!(said.contains("warning: tiny.toml, t, without deviations: "), "{said}");
    // Both sides of the LED moved by one amount, under the names that messages use.
    let table = std::fs::read_to_string(at.join("out/samples.csv")).expect("a table");
    let rows: Vec<Vec<String>> = table.lines().map(fields).collect();
    assert!(rows[0][..2] == ["led.size_mm[1]", "led.size_mm[1] led.size_mm[2]"], "{:?}", rows[0]);
    assert!(rows[1..].iter().all(|row| row[0] == row[1]), "{table}");
}

#[test]
fn warnings_of_a_search_name_the_candidate_and_its_values() {
    let folder = folder(&["tiny.toml"]);
    let at = folder.path();
    let problem = "name = \"p\"\ndesign = \"tiny.toml\"\n[[variables]]\n\
                   key = \"mirror.reflectance\"\nchoices = [0.91, 0.93]\n\
                   [[objective.terms]]\nfigure = \"extraction_efficiency\"\n\
                   [[stages]]\nmethod = \"random\"\nevaluations = 6\npopulation = 6\n\
                   paths = 2000\nmost_paths = 2000\n\
                   set = { \"receiver.bin_mm\" = 0.1, \"trace.max_interactions\" = 10 }\n\
                   [verification]\npaths = 2e4\n";
    write(at, "problem.toml", problem);
    let (done, text, said) = says(at, &["optimise", "problem.toml", "--out", "found"]);
    assert!(done, "{said}");
    let named = "warning: tiny.toml, stage 1, generation 1, candidate ";
    assert!(said.contains(&format!("{named}1 (mirror.reflectance = 0.9")), "{said}");
    // Others lose about as much.
    assert_eq!(said.matches(named).count(), 1, "{said}");
    assert!(said.contains("said again where it is twice as much"), "{said}");
    // Figures and changes stand as a run prints them.
    let line = text.lines().find(|line| line.starts_with("extraction_efficiency"));
    assert!(line.is_some_and(|line| line.contains(" %") && line.contains(" points")), "{text}");
}

/// What `run` prints is accepted wherever a figure is asked for.
#[test]
fn figures_that_a_run_states_may_be_asked_for() {
    let folder = apart();
    let at = folder.path();
    succeeds(at, &["run", "chips.toml", "--paths", "20000", "--out", "run"]);
    let found = json(&at.join("run/results.json"));
    let model = found["designs"]["chips"]["geometric"].as_object().expect("a model");
    let is_figure = |entry: &Value| entry["value"].is_number();
    let keys = |of: &serde_json::Map<String, Value>| -> Vec<String> {
        of.iter().filter(|(_, entry)| is_figure(entry)).map(|(key, _)| key.clone()).collect()
    };
    let mut all = keys(model);
    all.extend(keys(model["absolute"]["figures"].as_object().expect("figures")));
    let ledger = model["power_ledger"].as_object().expect("a ledger").keys();
    let is_end =
        |key: &&String| ["escaped_", "absorbed_", "lost_"].iter().any(|b| key.starts_with(b));
    all.extend(ledger.filter(is_end).cloned());
    all.extend(["flux", "mean", "min", "max", "min_to_max"].map(|key| format!("{key}.ff")));
    assert!(all.len() > 30 && all.iter().any(|key| key == "cell_nine_points"), "{all:?}");
    let quoted: Vec<String> = all.iter().map(|key| format!("{key:?}")).collect();
    let lines =
        |line: &str| -> String { quoted.iter().map(|key| line.replace("KEY", key)).collect() };
    let tolerance = format!(
        "name = \"t\"\ndesign = \"chips.toml\"\nsamples = 8\npaths = 20000\nfigures = [{}]\n\
         [[tolerances]]\nkey = \"led.height_mm\"\ndeviation = 1e-4\n",
        quoted.join(", ")
    );
    write(at, "tolerance.toml", &tolerance);
    let study = format!(
        "name = \"s\"\ndesigns = [\"chips.toml\"]\nmodels = [\"geometric\"]\npaths = 20000\n\
         [targets.chips.geometric]\n{}[scales]\n{}",
        lines("KEY = { at_least = 0 }\n"),
        lines("KEY = 0.1\n")
    );
    write(at, "study.toml", &study);
    let problem = format!(
        "name = \"p\"\ndesign = \"chips.toml\"\n[[variables]]\nkey = \"led.height_mm\"\n\
         from = 0.009\nto = 0.011\n{}{}[[stages]]\nmethod = \"random\"\nevaluations = 4\n\
         population = 4\npaths = 20000\nmost_paths = 20000\n[verification]\npaths = 20000\n",
        lines("[[objective.terms]]\nfigure = KEY\n"),
        lines("[[constraints]]\nfigure = KEY\nat_least = -1\nmargin = 0\n")
    );
    write(at, "problem.toml", &problem);
    for (command, file) in
        [("tolerance", "tolerance.toml"), ("study", "study.toml"), ("optimise", "problem.toml")]
    {
        succeeds(at, &["check", file]);
        let text = succeeds(at, &[command, file, "--out", command]);
        assert!(!text.contains("± 0 "), "{text}");
    }
    for figure in ["cell_variation=90%", "cell_nine_points=90%", "flux.ff=90%"] {
        let arguments = ["run", "chips.toml", "--paths", "20000", "--out", "rule", "--quiet"];
        succeeds(at, &[&arguments[..], &["--until-error", figure]].concat());
    }
}
