// SPDX-License-Identifier: MIT OR Apache-2.0
//! One design has the same figures by `run`, `study`, `optimise --evaluate` and `tolerance`, at few
//! paths and at many: every route reads the same estimator, with an error that holds its bias.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::binary::batwing;

/// Four LEDs in a box of mirrors, in light of two lines, with figures of every source.
const DESIGN: &str = r#"
name = "four"
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.5, 0.5], height_mm = 0.15, reflectance = 0.8, reflection = "lambertian", power_w = 0.1 }
array = { columns = 2, rows = 2, pitch_mm = 4.0 }
housing = { kind = "specular", reflectance = 1.0, height_mm = 6.0, inner_size_mm = [8.0, 8.0] }
receiver = { plane_height_mm = 3.0, bin_mm = 0.25, smoothing_sigma_mm = 0.0, area_mm = [8.0, 8.0] }

[light.spectrum]
kind = "lines"
weighting = "radiometric"
wavelength_nm = [450.0, 600.0]
power = [1.0, 2.0]

[[receivers]]
name = "plane"
kind = "plane"
position_mm = [0.0, 0.0, 4.0]
size_mm = [8.0, 8.0]
bins = [8, 8]

[[receivers]]
name = "display"
kind = "luminance"
position_mm = [0.0, 0.0, 5.0]
size_mm = [8.0, 8.0]
bins = [4, 4]
theta_bin_deg = 10.0
phi_bin_deg = 45.0
"#;

/// Lowest and highest value that a figure may have: its ends, or five standard errors to each side.
type Ends = [f64; 2];

fn ends(value: f64, error: f64, interval: Option<Ends>) -> Ends {
    interval.unwrap_or([value - 5.0 * error, value + 5.0 * error])
}

fn of_entry(entry: &Value) -> Ends {
    let number = |key: &str| entry[key].as_f64().unwrap_or_else(|| panic!("{key}: {entry}"));
    let interval = entry["interval"].as_array().map(|ends| [0, 1].map(|k| ends[k].as_f64()));
    let interval = interval.map(|ends| ends.map(|end| end.expect("a number")));
    let bound = entry["upper_bound"].as_f64().map(|bound| [0.0, bound]);
    ends(number("value"), number("standard_error"), interval.or(bound))
}

/// Standard output of a command in `folder`.
fn output(folder: &Path, arguments: &[&str], input: &str) -> String {
    let output = batwing(folder).args(arguments).write_stdin(input).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Figures of the design by `study`, which lists all.
fn by_study(folder: &Path, paths: &str) -> BTreeMap<String, Ends> {
    let study = "name = \"all\"\ndesigns = [\"four.toml\"]\nmodels = [\"geometric\"]\n\
                 [[factors]]\nname = \"board\"\nkey = \"mirror.reflectance\"\nvalues = [0.9]\n";
    std::fs::write(folder.join("study.toml"), study).expect("written");
    output(folder, &["study", "study.toml", "--quiet", "--out", "studied", "--paths", paths], "");
    let table = std::fs::read_to_string(folder.join("studied/study.csv")).expect("a table");
    let of_base = table.lines().skip(1).filter(|line| line.starts_with("base,"));
    let of_line = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells[k].parse::<f64>().ok();
        let interval = number(7).zip(number(8)).map(Ends::from);
        let value = number(5).expect("a value");
        (cells[4].to_owned(), ends(value, number(6).expect("an error"), interval))
    };
    of_base.map(of_line).collect()
}

/// Asserts that two routes agree on every figure of both.
fn agree(route: &str, figures: &BTreeMap<String, Ends>, others: &BTreeMap<String, Ends>) {
    let mut compared = 0;
    for (key, [low, high]) in figures {
        let Some([from, to]) = others.get(key) else { continue };
        // Rounding of sums.
        let slack = 1e-9 * high.abs().max(to.abs());
        let is_met = *low <= to + slack && *from <= high + slack;
        assert!(is_met, "{route}: {key}: {low} to {high}, not {from} to {to}");
        compared += 1;
    }
    assert!(compared > 20, "{route}: {compared} figures");
}

fn routes_agree(paths: &str) {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("four.toml"), DESIGN).expect("written");
    let studied = by_study(at, paths);
    for key in ["escaped_up", "flux_up", "area_variation", "cell_variation", "min_to_max.display"] {
        assert!(studied.contains_key(key), "{key}: {:?}", studied.keys());
    }
    // The same paths by `run`.
    output(at, &["run", "four.toml", "--quiet", "--out", "run", "--paths", paths], "");
    let results = std::fs::read_to_string(at.join("run/results.json")).expect("results");
    let results: Value = serde_json::from_str(&results).expect("JSON");
    let model = &results["designs"]["four"]["geometric"];
    let is_entry = |entry: &Value| entry["value"].is_f64() && entry["standard_error"].is_f64();
    let mut run: BTreeMap<String, Ends> = BTreeMap::new();
    for (key, entry) in model.as_object().expect("a model") {
        if is_entry(entry) {
            run.insert(key.clone(), of_entry(entry));
        }
    }
    for (name, receiver) in model["receivers"].as_object().expect("receivers") {
        // Fluxes stand there in watts, elsewhere as shares.
        for (key, entry) in receiver.as_object().expect("a receiver") {
            if key != "flux" && is_entry(entry) {
                run.insert(format!("{key}.{name}"), of_entry(entry));
            }
        }
    }
    agree("run", &run, &studied);

    // Colours are those of all wavelengths, which searches see too.
    let keys: Vec<&String> = studied.keys().collect();
    let terms = keys.iter().map(|key| format!("[[objective.terms]]\nfigure = \"{key}\"\n"));
    let problem = format!(
        "name = \"sought\"\ndesign = \"four.toml\"\n[[variables]]\nkey = \"mirror.reflectance\"\n\
         from = 0.8\nto = 1.0\n{}",
        terms.collect::<String>()
    );
    std::fs::write(at.join("problem.toml"), problem).expect("written");
    let point = format!("{{\"point\": [0.5], \"paths\": {paths}, \"seed\": 7}}\n");
    let said = output(at, &["optimise", "problem.toml", "--evaluate", "--quiet"], &point);
    let answer: Value = serde_json::from_str(said.lines().nth(1).expect("a line")).expect("JSON");
    let figures = answer["figures"].as_object().unwrap_or_else(|| panic!("{answer}"));
    let judged = figures.iter().map(|(key, entry)| (key.clone(), of_entry(entry))).collect();
    agree("optimise", &judged, &studied);

    let listed: Vec<String> = keys.iter().map(|key| format!("\"{key}\"")).collect();
    let tolerance = format!(
        "name = \"near\"\ndesign = \"four.toml\"\nsamples = 8\npaths = {paths}\nfigures = [{}]\n\
         [[tolerances]]\nkey = \"mirror.reflectance\"\ndistribution = \"uniform\"\n\
         half_width = 1e-9\n",
        listed.join(", ")
    );
    std::fs::write(at.join("tolerance.toml"), tolerance).expect("written");
    output(at, &["tolerance", "tolerance.toml", "--quiet", "--out", "drawn"], "");
    let drawn = std::fs::read_to_string(at.join("drawn/tolerance.json")).expect("an analysis");
    let drawn: Value = serde_json::from_str(&drawn).expect("JSON");
    let figures = drawn["figures"].as_object().expect("figures").iter();
    let nominal = figures.map(|(key, entry)| (key.clone(), of_entry(&entry["nominal"])));
    agree("tolerance", &nominal.collect(), &studied);
}

#[test]
fn every_route_reads_the_same_figures_from_few_paths() {
    routes_agree("4096");
}

#[test]
#[ignore = "nightly: 13 traces of a million paths (60 s)"]
fn nightly_every_route_reads_the_same_figures_from_many_paths() {
    routes_agree("1000000");
}

/// 3 % of variation under a lone chip between mirrors: the noise of 1,024 bins of 16 paths each is
/// eight times that.
#[test]
fn searches_do_not_read_the_noise_of_bins_as_variation() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("four.toml"), DESIGN).expect("written");
    let problem = "name = \"even\"\ndesign = \"four.toml\"\n[[variables]]\nkey = \"mirror.reflectance\"\n\
                   from = 0.8\nto = 1.0\n[[objective.terms]]\nfigure = \"area_variation\"\n\
                   goal = \"minimise\"\n";
    std::fs::write(at.join("problem.toml"), problem).expect("written");
    let line = |paths: u64, seed: u64| {
        format!("{{\"point\": [0.5], \"paths\": {paths}, \"seed\": {seed}}}\n")
    };
    let input = [line(16_384, 1), line(16_384, 2), line(2_097_152, 3)].concat();
    let said = output(at, &["optimise", "problem.toml", "--evaluate", "--quiet"], &input);
    let judged = said.lines().skip(1).map(|line| {
        let answer: Value = serde_json::from_str(line).expect("JSON");
        let of = |key: &str| answer[key].as_f64().expect("a number");
        (of("value"), of("standard_error"))
    });
    let judged: Vec<(f64, f64)> = judged.collect();
    let (many, error) = judged[2];
    assert!(error < 0.1 * many, "{many} {error}");
    for (few, error) in &judged[..2] {
        assert!((few - many).abs() < 3.0 * error, "{few} ± {error}, not {many}");
        assert!(*error < 0.15, "{error}");
    }
}
