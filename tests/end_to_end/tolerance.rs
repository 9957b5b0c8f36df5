// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing tolerance`: the same bytes at any number of threads, a figure that depends on a
//! deviation by a straight line, and files that are refused.

use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::binary::batwing;

const TOLERANCE: &str = r#"
name = "mirror"
design = "bare-dome.toml"
samples = 64
paths = 8192
figures = ["extraction_efficiency"]

[[tolerances]]
key = "mirror.reflectance"
distribution = "uniform"
half_width = 0.04

[[constraints]]
figure = "extraction_efficiency"
at_least = 0.99
"#;

fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    let data = batwing_tests::workspace().join("data/designs/bare-dome.toml");
    std::fs::copy(data, folder.path().join("bare-dome.toml")).expect("copied");
    std::fs::write(folder.path().join("tolerance.toml"), TOLERANCE).expect("written");
    folder
}

/// The bytes of `tolerance.json` and of the table of samples.
fn tolerance(folder: &Path, flags: &[&str]) -> [Vec<u8>; 2] {
    let output = batwing(folder)
        .args(["tolerance", "tolerance.toml", "--quiet", "--out", "out"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    ["tolerance.json", "samples.csv"]
        .map(|name| std::fs::read(folder.join("out").join(name)).expect(name))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

#[test]
fn samples_are_the_same_at_any_number_of_threads() {
    let folder = folder();
    let flags = ["--samples", "8", "--paths", "4096"];
    let with = |threads: &str| {
        let flags = [&flags[..], &["--threads", threads]].concat();
        tolerance(folder.path(), &flags)
    };
    assert!(with("1") == with("2"));
}

/// The light that the mirror absorbs is in proportion to what it does not reflect, to first order:
/// a uniform deviation of half width h shifts no mean and scatters by slope · h / √3.
#[test]
fn a_straight_dependence_has_the_scatter_of_its_slope() {
    let folder = folder();
    let [json, table] = tolerance(folder.path(), &[]);
    let json: Value = serde_json::from_slice(&json).expect("JSON");
    assert!(folder.path().join("out/distribution.png").exists());
    let figure = &json["figures"]["extraction_efficiency"];
    let shift = &figure["shift"];
    assert!(number(&shift["value"]).abs() < 3.0 * number(&shift["standard_error"]), "{shift}");

    // The slope out of two designs of other reflectances.
    let text = std::fs::read_to_string(folder.path().join("bare-dome.toml")).expect("a design");
    let extraction = |reflectance: &str| {
        let given = "reflectance = 0.95\n";
        assert_eq!(text.matches(given).count(), 1);
        let changed = text.replace(given, &format!("reflectance = {reflectance}\n"));
        let path = folder.path().join("changed.toml");
        std::fs::write(path, changed).expect("written");
        let output = batwing(folder.path())
            .args(["run", "changed.toml", "--quiet", "--json", "--paths", "262144"])
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let figure = &json["designs"]["bare-dome"]["geometric"]["extraction_efficiency"];
        [number(&figure["value"]), number(&figure["standard_error"])]
    };
    let (low, high) = (extraction("0.91"), extraction("0.99"));
    let slope = (high[0] - low[0]) / 0.08;
    let error = low[1].hypot(high[1]) / 0.08;
    let per_slope = 0.04 / 3.0_f64.sqrt();
    let deviation = &figure["deviation"];
    let expected = slope * per_slope;
    let error = number(&deviation["standard_error"]).hypot(error * per_slope);
    assert!(
        (number(&deviation["value"]) - expected).abs() < 3.0 * error && expected > 5.0 * error,
        "{deviation} against {expected} ± {error}"
    );

    // The yield counts the lines of the table that keep the limit.
    let table = String::from_utf8(table).expect("UTF-8");
    let good = table.lines().skip(1).filter(|line| {
        let value = line.split(',').nth(1).expect("a figure");
        value.parse::<f64>().expect("a number") >= 0.99
    });
    let good = good.count();
    let yielded = &json["yield"];
    assert!(0 < good && good < 64, "{good}");
    assert_eq!((&yielded["good"], &yielded["of"]), (&good.into(), &64.into()));
    let [low, high] = [0, 1].map(|k| number(&yielded["interval_95"][k]));
    assert!(low < number(&yielded["share"]) && number(&yielded["share"]) < high);
}

/// Three tolerances of which each two go together, and two against each other.
const IMPOSSIBLE: &str = r#"
[[tolerances]]
name = "a"
key = "led.reflectance"
deviation = 0.01
[[tolerances]]
name = "b"
key = "array.pitch_mm"
deviation = 0.01
[[tolerances]]
name = "c"
key = "dome.height_mm"
deviation = 0.01
[[correlations]]
between = ["a", "b"]
coefficient = 0.9
[[correlations]]
between = ["a", "c"]
coefficient = 0.9
[[correlations]]
between = ["b", "c"]
coefficient = -0.9

[[constraints]]"#;

/// A second tolerance of the same name.
const SECOND: &str =
    "[[tolerances]]\nkey = \"mirror.reflectance\"\ndeviation = 0.01\n\n[[constraints]]";
/// A correlation with a tolerance that there is not.
const ALONE: &str = "[[correlations]]\n\
                 between = [\"mirror.reflectance\", \"x\"]\ncoefficient = 0.9\n\n[[constraints]]";

/// What is written in place of what, and words of the message.
const BAD: &[(&str, &str, &[&str])] = &[
    ("half_width = 0.04", "half_width = 0.0", &["tolerances[1]: half_width", "got 0"]),
    (
        "half_width = 0.04",
        "half_width = 4.0",
        &["tolerances", "without a design", "mirror.reflectance"],
    ),
    ("half_width = 0.04", "half_width = 0.04\ndeviation = 0.1", &["tolerances[1]: deviation"]),
    ("\"uniform\"", "\"flat\"", &["tolerances[1].distribution", "flat"]),
    ("mirror.reflectance", "mirror.reflection", &["mirror.reflection", "nominal"]),
    ("mirror.reflectance", "mirror.kind", &["mirror.kind", "specular"]),
    ("mirror.reflectance", "mirror.*.x", &["tolerances[1]: mirror[*].x", "a list at mirror"]),
    (
        "mirror.reflectance",
        "array.scales[5]",
        &["array.scales[5]: expected an entry of array.scales from 1 to 4, got 5"],
    ),
    (
        "mirror.reflectance",
        "array.offsets_mm",
        &["array.offsets_mm: expected entries of it, as in array.offsets_mm[*][*]"],
    ),
    (
        "key = \"mirror.reflectance\"",
        "profile = \"inner_slope_deg\"",
        &["tolerances[1]", "[elements]"],
    ),
    ("[[constraints]]", SECOND, &["tolerances[2].name", "twice"]),
    ("[[constraints]]", ALONE, &["correlations[1].between", "\"x\""]),
    ("[[constraints]]", IMPOSSIBLE, &["correlations", "positive definite"]),
    (
        "figure = \"extraction_efficiency\"",
        "figure = \"uniformity\"",
        &["constraints[1]: figure", "uniformity"],
    ),
    ("[[constraints]]", "[[limits]]", &["limits: expected it to be called `constraints`"]),
    ("at_least = 0.99", "", &["constraints[1]", "got neither"]),
    (
        "at_least = 0.99",
        "at_least = 0.9\nat_most = 0.8",
        &["constraints[1]: at_least, at_most", "got 0.9 and 0.8"],
    ),
    ("[\"extraction_efficiency\"]", "[\"extraction\"]", &["figures", "\"extraction\""]),
    ("[\"extraction_efficiency\"]", "[]", &["figures: expected at least one"]),
    ("samples", "sample", &["line 4, column 1: sample"]),
    ("samples = 64", "samples = 2", &["samples", "got 2"]),
    ("paths = 8192", "paths = 2", &["paths", "got 2"]),
    ("design = \"bare-dome.toml\"", "", &["design"]),
    ("bare-dome.toml", "none.toml", &["design: `none.toml`"]),
];

#[test]
fn bad_files_end_in_one_message_and_write_nothing() {
    let folder = folder();
    for (before, after, words) in BAD {
        assert!(TOLERANCE.contains(before), "{before}");
        let text = TOLERANCE.replacen(before, after, 1);
        std::fs::write(folder.path().join("tolerance.toml"), text).expect("written");
        let output = batwing(folder.path())
            .args(["tolerance", "tolerance.toml", "--quiet", "--out", "out"])
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{after}: {said}");
        assert!(said.starts_with("batwing: tolerance.toml: "), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        for word in *words {
            assert!(said.contains(word), "no `{word}` in: {said}");
        }
        assert!(!folder.path().join("out/tolerance.json").exists(), "{after}");
        assert!(!folder.path().join("out/samples.csv").exists(), "{after}");
    }
}

/// A box that is moved by nanometres shifts nothing, though its maps are no longer averaged over the
/// mirrors of the array and their extremes are those of more noise.
#[test]
#[ignore = "slow: 6 s"]
fn broken_symmetries_shift_no_figure_by_themselves() {
    let folder = folder();
    let text = TOLERANCE
        .replace("\"extraction_efficiency\"]", "\"illuminance_valley_to_peak\"]")
        .replace(
            "figure = \"extraction_efficiency\"\nat_least = 0.99",
            "figure = \"illuminance_valley_to_peak\"\nat_least = 0.0",
        )
        .replace("key = \"mirror.reflectance\"", "key = \"led.offset_mm.*\"")
        .replace("half_width = 0.04", "half_width = 1e-6");
    let text =
        text.replace("samples = 64", "samples = 64\nset = { \"led.offset_mm\" = [0.0, 0.0] }");
    let analysed = |text: &str| {
        std::fs::write(folder.path().join("tolerance.toml"), text).expect("written");
        let [json, _] = tolerance(folder.path(), &["--paths", "65536"]);
        let json: Value = serde_json::from_slice(&json).expect("JSON");
        let figure = &json["figures"]["illuminance_valley_to_peak"];
        [&figure["nominal"], &figure["shift"]]
            .map(|of| (number(&of["value"]), number(&of["standard_error"])))
    };
    let [(averaged, of_averaged), (shift, error)] = analysed(&text);
    assert!(shift.abs() < 4.0 * error, "{shift} ± {error}");
    // Without averages the design itself reads the same: extremes of noisier maps are not biased.
    let without = text.replace("[0.0, 0.0] }", "[0.0, 0.0], \"receiver.average\" = \"none\" }");
    let [(plain, of_plain), _] = analysed(&without);
    let error = of_averaged.hypot(of_plain);
    assert!((averaged - plain).abs() < 4.0 * error, "{averaged} {plain} ± {error}");
}

fn report(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let output = batwing(folder).arg("report").args(arguments).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.success(), said)
}

/// The page of an analysis alone holds its table, yield, causes and distribution; a run of the design
/// in the same folder has both.
#[test]
fn an_analysis_becomes_a_page_alone_or_beside_a_run() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let second = "[[tolerances]]\nkey = \"led.reflectance\"\ndeviation = 0.01\n\n[[constraints]]";
    let text = TOLERANCE.replace("[[constraints]]", second);
    std::fs::write(at("tolerance.toml"), text).expect("written");
    let [json, _] = tolerance(folder.path(), &[]);
    let (done, said) = report(folder.path(), &["out"]);
    assert!(done && said.is_empty(), "{said}");
    let page = std::fs::read_to_string(at("out/report.html")).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    let json: Value = serde_json::from_slice(&json).expect("JSON");
    let good = json["yield"]["good"].to_string();
    let shown = [
        "What deviations do to bare-dome: mirror",
        "<th scope=\"row\">extraction</th>",
        "<th scope=\"col\">95 % quantile</th>",
        &format!("Yield: {good} of 64 packages, "),
        "with extraction at least 99 %",
        "<th scope=\"row\">mirror.reflectance</th>",
        "<th scope=\"row\">led.reflectance</th>",
        "<th scope=\"row\">not by straight lines</th>",
        "packages at or below",
        "samples.csv",
    ];
    for words in shown {
        assert!(page.contains(words), "no `{words}`");
    }
    let (done, said) = report(folder.path(), &["out", "--out", "again.html"]);
    assert!(done, "{said}");
    assert!(page == std::fs::read_to_string(at("again.html")).expect("a page"));
    let (done, said) = report(folder.path(), &["out", "--out", "out/samples.csv"]);
    assert!(!done && said.contains("belongs to them"), "{said}");

    // A run beside it.
    batwing(folder.path())
        .args(["run", "bare-dome.toml", "--quiet", "--paths", "8192"])
        .args(["--out", "out"])
        .assert()
        .success();
    let (done, said) = report(folder.path(), &["out", "--out", "both.html"]);
    assert!(done, "{said}");
    let both = std::fs::read_to_string(at("both.html")).expect("a page");
    assert!(both.contains("What deviations do to bare-dome: mirror"));
    assert!(both.contains("Figures of merit"));

    // What was touched since is refused.
    let path = at("out/samples.csv");
    let table = std::fs::read_to_string(&path).expect("a table");
    std::fs::write(&path, table.clone() + "\n").expect("written");
    let (done, said) = report(folder.path(), &["out"]);
    assert!(!done && said.contains("samples.csv` was altered"), "{said}");
    std::fs::write(&path, table).expect("written");
    std::fs::remove_file(at("out/results.json")).expect("removed");
    let path = at("out/tolerance.json");
    let text = std::fs::read_to_string(&path).expect("results");
    let touched = text.replacen("\"samples\": 64", "\"samples\": 65", 1);
    assert_ne!(text, touched);
    std::fs::write(&path, touched).expect("written");
    let (done, said) = report(folder.path(), &["out"]);
    assert!(!done && said.contains("content_sha256: it was altered after the analysis"), "{said}");
    let old = text.replacen("\"schema_version\": 3", "\"schema_version\": 1", 1);
    std::fs::write(&path, old).expect("written");
    let (done, said) = report(folder.path(), &["out"]);
    assert!(!done && said.contains("tolerance.json`: schema_version: expected 3, got 1"), "{said}");
}

/// Each package moves, turns and scales by itself, without lists in the design.
#[test]
fn packages_move_turn_and_scale_one_by_one() {
    let folder = folder();
    let at = folder.path();
    let head = "name = \"mounted\"\ndesign = \"bare-dome.toml\"\nsamples = 8\npaths = 4096\nfigures = [\"extraction_efficiency\"]\n";
    let keys = "[[tolerances]]\nkey = \"array.offsets_mm[*][*]\"\ndeviation = 0.05\n\
                [[tolerances]]\nkey = \"array.turns_deg[*]\"\ndeviation = 2.0\n\
                [[tolerances]]\nkey = \"array.scales[*]\"\ndeviation = 0.01\n";
    std::fs::write(at.join("tolerance.toml"), format!("{head}{keys}")).expect("written");
    let [_, table] = tolerance(at, &[]);
    let table = String::from_utf8(table).expect("UTF-8");
    let heading = table.lines().next().expect("a heading");
    for column in ["array.offsets_mm[4][2]", "array.turns_deg[4]", "array.scales[4]"] {
        assert!(heading.contains(column), "{heading}");
    }

    // Light past the end of an oblong chip, by either alone; hardly any deviation is the control.
    let chips = "name = \"chips\"\n\
        mirror = { kind = \"absorbing\", reflectance = 0.0, extent = \"array\" }\n\
        led = { size_mm = [1.5, 0.3], height_mm = 0.15, reflectance = 0.8, reflection = \"specular\" }\n\
        array = { columns = 1, rows = 1, pitch_mm = 8.0 }\n\
        light = { wavelength_nm = 550.0 }\nreceiver = { bin_mm = 0.5 }\n\
        [[receivers]]\nname = \"end\"\nkind = \"plane\"\nposition_mm = [0.7, 0.0, 0.4]\n\
        size_mm = [0.4, 0.3]\nbins = [1, 1]\n";
    std::fs::write(at.join("bare-dome.toml"), chips).expect("written");
    let chi_square = |key: &str, deviation: f64| {
        let head = head.replace("extraction_efficiency", "flux.end");
        let keys = format!("[[tolerances]]\nkey = \"{key}\"\ndeviation = {deviation:?}\n");
        std::fs::write(at.join("tolerance.toml"), head + &keys).expect("written");
        let [_, table] = tolerance(at, &[]);
        let table = String::from_utf8(table).expect("UTF-8");
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let heading = lines.next().expect("a heading");
        let column = |name: &str| heading.iter().position(|known| *known == name).expect(name);
        let [value, error] = ["flux.end", "flux.end_standard_error"].map(column);
        let of = |row: &Vec<&str>, k: usize| row[k].parse::<f64>().expect("a number");
        let rows: Vec<[f64; 2]> = lines.map(|row| [of(&row, value), of(&row, error)]).collect();
        let mean = rows.iter().map(|row| row[0]).sum::<f64>() / rows.len() as f64;
        rows.iter().map(|row| ((row[0] - mean) / row[1]).powi(2)).sum::<f64>()
    };
    let deviations =
        [("array.offsets_mm[*][*]", 0.3), ("array.turns_deg[*]", 20.0), ("array.scales[*]", 0.15)];
    for (key, deviation) in deviations {
        let (moved, control) = (chi_square(key, deviation), chi_square(key, 1e-6));
        // Of 7 degrees of freedom 24.3 is the quantile of 99.9 %.
        assert!(moved > 100.0 && control < 24.3, "{key}: {moved} {control}");
    }
}
