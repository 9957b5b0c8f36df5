// SPDX-License-Identifier: MIT OR Apache-2.0
//! Runs over a spectrum: single lines, weighted sums, dispersion, reproducibility, interruption.
//!
//! Sources: `docs/reference/design-file.md`, `docs/reference/results-schema.md`; 683 lm/W, CIE
//! 018:2019 for V.

use std::path::Path;

use crate::support::binary::batwing;
use crate::support::runs::{changed, contents, estimate, files, results, run_text};
use batwing_tests::bad_input::good;
use serde_json::Value;
use tempfile::{TempDir, tempdir};

/// A folder with a design for each light: the innermost element alone carries relief, so that a
/// table takes a second.
fn lit(lights: &[(&str, &str)]) -> TempDir {
    let folder = tempdir().expect("a folder");
    let design = good(include_str!("../bad_input/design.toml"));
    let replaced = |text: &str, from: &str, to: &str| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    };
    let every = "shapes = [{ from = 1, to = 17, type = \"OS1\" }]";
    let one =
        "shapes = [{ from = 1, to = 1, type = \"OS1\" }, { from = 2, to = 17, type = \"smooth\" }]";
    let design = replaced(&replaced(&design, every, one), "\"bad\"", "\"lit\"");
    for (name, light) in lights {
        let text = replaced(&design, "light = { wavelength_nm = 550.0 }", light);
        std::fs::write(folder.path().join(format!("{name}.toml")), text).expect("written");
    }
    folder
}

/// Runs `<name>.toml` into `<name>`, tables in `cache`.
fn run(folder: &Path, name: &str, flags: &[&str]) {
    run_paths(folder, name, "32000", flags);
}

fn run_paths(folder: &Path, name: &str, paths: &str, flags: &[&str]) {
    let mut command = batwing(folder);
    let design = format!("{name}.toml");
    command
        .args(["run", &design, "--paths", paths, "--out", name])
        .args(["--cache", "cache"])
        .args(flags);
    let output = command.output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn model<'a>(results: &'a Value, key: &str) -> &'a Value {
    &results["designs"]["lit"][key]
}

fn wavelengths(model: &Value) -> &[Value] {
    model["spectrum"]["wavelengths"].as_array().expect("a list")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// The numbers at the end of an `.npy` file of f64.
fn numbers(path: &Path) -> Vec<f64> {
    let bytes = std::fs::read(path).expect("readable");
    let header = u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
    let chunks = bytes[10 + header..].chunks_exact(8);
    chunks.map(|c| f64::from_le_bytes(c.try_into().expect("eight bytes"))).collect()
}

const FIGURES: [&str; 6] = [
    "peak_angle_deg",
    "centre_to_peak",
    "uniformity",
    "uniformity_diagonal",
    "illuminance_valley_to_peak",
    "extraction_efficiency",
];

#[test]
fn a_single_line_is_the_monochromatic_run() {
    let line = |weighting: &str| {
        format!(
            "light.spectrum = {{ kind = \"lines\", wavelength_nm = [550.0], power = [3.0], weighting = \"{weighting}\" }}"
        )
    };
    let (watts, lumens) = (line("radiometric"), line("photometric"));
    let folder = lit(&[
        ("plain", "light = { wavelength_nm = 550.0 }"),
        ("watts", &watts),
        ("lumens", &lumens),
    ]);
    for name in ["plain", "watts", "lumens"] {
        run(folder.path(), name, &["--model", "hybrid", "--seed", "3"]);
    }
    assert_eq!(files(&folder.path().join("cache")).len(), 1, "a table of 550 nm only");
    let [plain, watts, lumens] =
        ["plain", "watts", "lumens"].map(|n| results(&folder.path().join(n)));
    let [plain, watts, lumens] = [&plain, &watts, &lumens].map(|r| model(r, "hybrid_10um"));
    for figure in FIGURES.iter().chain(&["power_ledger", "counters", "paths"]) {
        assert_eq!(plain[figure], watts[figure], "{figure}");
        assert_eq!(plain[figure], lumens[figure], "{figure}");
    }
    assert_eq!(watts["spectrum"]["stopped_by"], "lines");
    assert!(watts["uniformity"].get("wavelength_error").is_none());

    let data = |name: &str, file: &str| {
        numbers(&folder.path().join(name).join("lit/hybrid_10um").join(file))
    };
    // V(550 nm) of the table, times 683 lm/W.
    let efficacy = 683.0 * 0.994_950_1;
    for (file, unit) in [("far_field.npy", 1.0), ("illuminance.npy", 1e6)] {
        let [plain, watts, lumens] = ["plain", "watts", "lumens"].map(|n| data(n, file));
        assert!(plain.len() > 1000 && plain.iter().any(|&v| v > 0.0));
        assert!(plain.iter().zip(&watts).all(|(a, b)| a.to_bits() == b.to_bits()), "{file}");
        for (a, b) in plain.iter().zip(&lumens) {
            assert!((a * efficacy * unit - b).abs() <= 1e-12 * b.abs(), "{file}: {a} W and {b} lm");
        }
    }
    assert_eq!(lumens["spectrum"]["units"]["intensity"], "cd");
    assert_eq!(lumens["spectrum"]["units"]["map"], "lx");
    assert_eq!(watts["spectrum"]["units"]["intensity"], "W/sr");
    assert!((number(&lumens["spectrum"]["emitted"]["emitted_lm"]) - efficacy).abs() < 1e-9);
}

#[test]
fn sums_follow_from_their_wavelengths_in_any_company() {
    let lines = |nm: &str, power: &str| {
        format!(
            "light.spectrum = {{ kind = \"lines\", wavelength_nm = {nm}, power = {power}, weighting = \"radiometric\" }}"
        )
    };
    let (two, three) =
        (lines("[500.0, 600.0]", "[1.0, 3.0]"), lines("[500.0, 550.0, 600.0]", "[2.0, 5.0, 1.0]"));
    let folder = lit(&[("two", &two), ("three", &three)]);
    for name in ["two", "three"] {
        run(folder.path(), name, &["--model", "hybrid"]);
    }
    assert_eq!(files(&folder.path().join("cache")).len(), 3);
    let [two, three] = ["two", "three"].map(|n| results(&folder.path().join(n)));
    let [two, three] = [&two, &three].map(|r| model(r, "hybrid_10um"));
    // The line of 500 nm has a quarter of the power and of the paths in both: what stands beside it
    // does not matter.
    assert_eq!(wavelengths(two)[0], wavelengths(three)[0]);
    assert_eq!(wavelengths(two)[0]["paths"], 8000);
    // 600 nm has other paths in both, and other weights.
    assert_ne!(wavelengths(two)[1], wavelengths(three)[2]);

    for model in [two, three] {
        // Extraction is power over power with the same power emitted: the sum is the weighted mean,
        // its error that of independent parts.
        let (mut mean, mut variance) = (0.0, 0.0);
        for part in wavelengths(model) {
            let (value, error) = estimate(&part["extraction_efficiency"]);
            mean += number(&part["weight"]) * value;
            variance += (number(&part["weight"]) * error).powi(2);
        }
        let (value, error) = estimate(&model["extraction_efficiency"]);
        assert!((value - mean).abs() < 1e-12, "{value} and {mean}");
        // An error from 64 groups is itself known to 9 %.
        assert!((error / variance.sqrt() - 1.0).abs() < 0.36, "{error} and {}", variance.sqrt());
        let emitted = estimate(&model["power_ledger"]["emitted"]);
        assert!((emitted.0 - 1.0).abs() < 1e-12);
        // Every share is rounded up to whole paths in every group.
        assert!((32000.0..=32000.0 + 3.0 * 64.0).contains(&number(&model["paths"])));
    }
}

const WHITE: &str = "light.spectrum = { kind = \"white_led\", blue_nm = 450.0, blue_fwhm_nm = 20.0, phosphor_nm = 560.0, \
    phosphor_fwhm_nm = 120.0, blue_part = 0.25, weighting = \"photometric\", samples = 3 }";

#[test]
#[ignore = "slow: 4 s"]
fn white_light_gives_the_same_bytes_on_any_number_of_threads_and_after_a_stop() {
    let folder = lit(&[("white", WHITE)]);
    let out = folder.path().join("white");
    let flags = ["--model", "hybrid", "--seed", "5"];
    run(folder.path(), "white", &[&flags[..], &["--threads", "2"]].concat());
    let first = contents(&out);
    let json = results(&out);
    let white = model(&json, "hybrid_10um");
    assert_eq!(wavelengths(white).len(), 3);
    assert_eq!(white["spectrum"]["compared_with"], 1);
    for figure in FIGURES {
        let error = estimate(&white[figure]["wavelength_error"]);
        assert!(error.0 >= 0.0 && error.1 > 0.0, "{figure}");
    }
    let weights: f64 = wavelengths(white).iter().map(|w| number(&w["weight"])).sum();
    assert!((weights - 1.0).abs() < 1e-14);
    for file in ["far_field_by_wavelength.csv", "far_field_by_wavelength.png"] {
        assert!(first.contains_key(&Path::new("lit/hybrid_10um").join(file)), "{file}");
    }

    // As after Ctrl-C: some tables are there, others are not.
    let cache = folder.path().join("cache");
    let tables = files(&cache);
    assert_eq!(tables.len(), 3);
    let (kept, lost) = tables.split_at(1);
    let times: Vec<_> = kept.iter().map(|t| changed(t)).collect();
    let before: Vec<_> = lost.iter().map(|t| std::fs::read(t).expect("readable")).collect();
    for table in lost {
        std::fs::remove_file(table).expect("removed");
    }
    std::fs::remove_dir_all(&out).expect("removed");
    run(folder.path(), "white", &[&flags[..], &["--threads", "1"]].concat());
    assert!(contents(&out) == first, "other bytes");
    assert!(kept.iter().zip(times).all(|(t, time)| changed(t) == time), "tables were solved again");
    for (table, bytes) in lost.iter().zip(before) {
        assert!(std::fs::read(table).expect("readable") == bytes, "another table");
    }
}

#[test]
fn rays_disperse_only_in_materials_that_do() {
    let folder = lit(&[("white", WHITE)]);
    let path = folder.path();
    run(path, "white", &["--model", "geometric"]);
    let white = results(&path.join("white"));
    let white = model(&white, "geometric_100um");
    assert_eq!(white["spectrum"]["stopped_by"], "no_dispersion");
    assert_eq!((wavelengths(white).len(), number(&white["paths"])), (1, 32000.0));
    assert_eq!(estimate(&white["uniformity"]["wavelength_error"]), (0.0, 0.0));

    // An index of 1.41 written as a table is no dispersion either; 1.5 in the blue and 1.3 in the
    // red is.
    let text = std::fs::read_to_string(path.join("white.toml")).expect("readable");
    assert_eq!(text.matches("index = 1.41").count(), 1);
    for (name, rows) in
        [("even", "0.3 1.41\n        1.1 1.41"), ("steep", "0.4 1.5\n        0.8 1.3")]
    {
        let yaml = format!("DATA:\n  - type: tabulated n\n    data: |\n        {rows}\n");
        std::fs::write(path.join(format!("{name}.yml")), yaml).expect("written");
        let file = format!("material_file = \"{name}.yml\"");
        std::fs::write(path.join(format!("{name}.toml")), text.replace("index = 1.41", &file))
            .expect("written");
        run(path, name, &["--model", "geometric"]);
    }
    let even = results(&path.join("even"));
    let even = model(&even, "geometric_100um");
    assert_eq!(even["spectrum"]["stopped_by"], "no_dispersion");
    assert_eq!(even["extraction_efficiency"], white["extraction_efficiency"]);
    let steep = results(&path.join("steep"));
    let steep = model(&steep, "geometric_100um");
    assert_eq!(steep["spectrum"]["stopped_by"], "samples");
    let mut extracted = Vec::new();
    for part in wavelengths(steep) {
        let expected = 1.5 - 0.2 * (number(&part["wavelength_nm"]) - 400.0) / 400.0;
        assert!((number(&part["silicone_index"]) - expected).abs() < 1e-9);
        extracted.push(estimate(&part["extraction_efficiency"]));
    }
    // A lower index lets more out: red more than blue, by more than five standard errors.
    let [blue, _, red] = extracted[..] else { panic!("three wavelengths") };
    assert!(red.0 - blue.0 > 5.0 * red.1.hypot(blue.1), "{extracted:?}");
}

#[test]
#[ignore = "slow: 8 s"]
fn wavelengths_are_added_until_noise_hides_what_they_change() {
    let light = |sampling: &str| {
        format!(
            "light.spectrum = {{ kind = \"table\", wavelength_nm = [400.0, 700.0], power = [1.0, 1.0], weighting = \"radiometric\", {sampling} }}"
        )
    };
    let (grown, fine) = (light("tolerance = 1e-6"), light("samples = 31"));
    let folder = lit(&[("grown", &grown), ("fine", &fine)]);
    let path = folder.path();
    // An index that falls from 1.6 to 1.41, ever more slowly: extraction is not linear over the
    // spectrum.
    let yaml = "DATA:\n  - type: tabulated n\n    data: |\n        0.4 1.6\n        0.45 1.5\n        0.5 1.45\n        0.7 1.41\n";
    std::fs::write(path.join("steep.yml"), yaml).expect("written");
    for name in ["grown", "fine"] {
        let file = path.join(format!("{name}.toml"));
        let text = std::fs::read_to_string(&file).expect("readable");
        let text = text.replace("index = 1.41", "material_file = \"steep.yml\"");
        std::fs::write(file, text).expect("written");
        run_paths(path, name, "60000", &["--model", "geometric"]);
    }
    let [grown, fine] = ["grown", "fine"].map(|n| results(&path.join(n)));
    // The material is on record as well as the design.
    let recorded: Vec<&str> = grown["inputs"]
        .as_array()
        .expect("inputs")
        .iter()
        .filter_map(|i| i["file"].as_str())
        .collect();
    assert_eq!(recorded, ["grown.toml", "steep.yml"]);
    let [grown, fine] = [&grown, &fine].map(|r| model(r, "geometric_100um"));
    assert_eq!(wavelengths(fine).len(), 31);
    let count = wavelengths(grown).len();
    assert!(count >= 7, "{count} wavelengths");
    assert_eq!(grown["spectrum"]["stopped_by"], "statistics");
    assert_eq!(grown["spectrum"]["compared_with"], count / 2);
    // The change from 1 to 3 wavelengths, from what stands in the file, is far beyond noise; the
    // last one is not.
    // Of three, which are among all: the flat spectrum from 400 to 700 nm parted in their middles.
    let of = |quarter: usize| {
        let node = &wavelengths(grown)[quarter * (count + 1) / 4 - 1];
        (number(&node["wavelength_nm"]), estimate(&node["extraction_efficiency"]).0)
    };
    let [a, b, c] = [1, 2, 3].map(of);
    let ends = [400.0, 0.5 * (a.0 + b.0), 0.5 * (b.0 + c.0), 700.0];
    let parts = [a, b, c].into_iter().zip(ends.windows(2));
    let three: f64 = parts.map(|((_, value), end)| value * (end[1] - end[0]) / 300.0).sum();
    let (error, noise) = estimate(&grown["extraction_efficiency"]["wavelength_error"]);
    assert!((three - b.1).abs() > 3.0 * (error + noise), "{three}, {error}");
    for figure in ["uniformity", "centre_to_peak", "extraction_efficiency"] {
        let (a, b) = (estimate(&grown[figure]), estimate(&fine[figure]));
        let sampling = estimate(&grown[figure]["wavelength_error"]).0;
        assert!(
            (a.0 - b.0).abs() < sampling + 5.0 * a.1.hypot(b.1),
            "{figure}: {a:?} {b:?} {sampling}"
        );
    }
}

#[test]
fn a_study_sees_what_a_run_sees() {
    let two = "{ kind = \"lines\", wavelength_nm = [500.0, 600.0], power = [1.0, 3.0], weighting = \"radiometric\" }";
    let lines = format!("light.spectrum = {two}");
    let folder = lit(&[("mono", "light = { wavelength_nm = 550.0 }"), ("lines", &lines)]);
    let study = format!(
        "name = \"colour\"\ndesigns = [\"mono.toml\"]\nmodels = [\"hybrid\"]\n[[factors]]\nname = \"light\"\n[[factors.levels]]\nname = \"two lines\"\nset = {{ \"light.wavelength_nm\" = \"\", \"light.spectrum\" = {two} }}\n"
    );
    std::fs::write(folder.path().join("study.toml"), study).expect("written");
    let output = batwing(folder.path())
        .args(["study", "study.toml", "--paths", "32000", "--out", "study"])
        .args(["--cache", "cache"])
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    run(folder.path(), "lines", &["--model", "hybrid"]);
    let text = std::fs::read(folder.path().join("study/study.json")).expect("study.json");
    let study: Value = serde_json::from_slice(&text).expect("JSON");
    let seen = study["setups"][1]["figures"].as_array().expect("figures");
    let results = results(&folder.path().join("lines"));
    let run = model(&results, "hybrid_10um");
    for key in ["extraction_efficiency", "centre_to_peak", "peak_angle_deg"] {
        let of_study = seen.iter().find(|f| f["figure"] == key).expect(key);
        assert_eq!(of_study["value"], run[key]["value"], "{key}");
        assert_eq!(of_study["standard_error"], run[key]["standard_error"], "{key}");
        // Other wavelengths than the base's, so something must have moved.
        assert_ne!(of_study["change"]["value"], 0.0, "{key}");
    }
}

#[test]
fn what_a_spectrum_cannot_do_is_refused_before_any_work() {
    let folder = lit(&[("white", WHITE)]);
    let path = folder.path();
    let text = std::fs::read_to_string(path.join("white.toml")).expect("readable");
    let fine = text.replace("samples = 3", "samples = 31") + "\n[receiver]\nbin_mm = 0.025\n";
    std::fs::write(path.join("fine.toml"), fine).expect("written");
    for (arguments, words) in [
        (
            "export white.toml --format ies --model geometric --out white.ies",
            ["white.toml: light.spectrum: expected light.wavelength_nm", "batwing run"],
        ),
        (
            "run fine.toml --model hybrid --out fine",
            ["fine.toml: ", "bins at 31 wavelengths: expected at most 2 GiB"],
        ),
    ] {
        let mut command = batwing(path);
        let output = command.args(arguments.split(' ')).output().expect("it runs");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{arguments}");
        assert_eq!(message.lines().count(), 1, "{message}");
        for word in words {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
    }
    assert!(files(&path.join("fine")).is_empty() && files(&path.join(".batwing-cache")).is_empty());
}

#[test]
fn the_white_design_is_d1_in_other_light() {
    let white = batwing_tests::read("data/designs/d1-white.toml");
    let parsed = |text: &str| -> toml::Table { text.parse().expect("valid TOML") };
    let (mut white, mut d1) =
        (parsed(&white), parsed(&batwing_tests::read("data/designs/d1.toml")));
    for design in [&mut white, &mut d1] {
        for key in ["name", "description", "light"] {
            assert!(design.remove(key).is_some());
        }
    }
    assert_eq!(white, d1);
    let mut command = batwing(batwing_tests::workspace());
    let output = command.args(["check", "data/designs/d1-white.toml"]).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success());
    for word in ["white LED, 25 % at 450 nm", "photometric", "lm/W", "tolerance of 0.005"] {
        assert!(text.contains(word), "no `{word}` in: {text}");
    }
}

/// A collimated beam of a white LED through 2.5 mm of a dye: the integral over the spectrum of
/// (1 - R)² T / (1 - R² T²), with T by Beer's law and R by Fresnel's formula.
#[test]
fn light_through_a_dye_is_the_integral_over_the_spectrum() {
    const EXACT: f64 = 0.51574;
    let findings = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/findings");
    let folder = tempdir().expect("a folder");
    let path = folder.path();
    std::fs::copy(findings.join("dye.yml"), path.join("dye.yml")).expect("copied");
    let text = std::fs::read_to_string(findings.join("dye-white.toml")).expect("readable");
    let receiver = "[[receivers]]\nname = \"above\"\nkind = \"plane\"\nposition_mm = [0.0, 0.0, 9.0]\nsize_mm = [20.0, 20.0]\nbins = [2, 2]\n";
    let text =
        text.replace("reflection = \"absorbing\"", "reflection = \"absorbing\"\npower_w = 2.0");
    let text = text.replace("[[sources]]", &format!("{receiver}[[sources]]"));
    std::fs::write(path.join("dye.toml"), text).expect("written");
    run_paths(path, "dye", "400000", &[]);
    let all = results(&path.join("dye"));
    let models = all["designs"]["dye"].as_object().expect("models");
    let model = models.values().next().expect("a model");
    assert_eq!(wavelengths(model).len(), 31);
    let up = &model["power_ledger"]["escaped_up"];
    let flux = &model["absolute"]["figures"]["flux_up"];
    for (figure, exact) in
        [(up, EXACT), (flux, 2.0 * EXACT), (&model["receivers"]["above"]["flux"], 2.0 * EXACT)]
    {
        let ((value, error), (wavelengths, _)) =
            (estimate(figure), estimate(&figure["wavelength_error"]));
        assert!(wavelengths > 0.0 && wavelengths < 4e-3 * exact, "{figure}");
        assert!((value - exact).abs() < wavelengths + 3.0 * error, "{figure}: {exact}");
        assert!((value - exact).abs() < 1e-3 * exact + 3.0 * error, "{figure}: {exact}");
    }
    let absorbed = &model["power_ledger"]["absorbed_in_plate"];
    assert!(estimate(&absorbed["wavelength_error"]).0 > 0.0, "{absorbed}");
}

/// A plate over bare chips that absorbs blue more than its fewest wavelengths show. Its uniformity is
/// noise at these paths.
const PLATE: &str = r#"
name = "plate"
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.3, reflectance = 0.5, reflection = "lambertian" }
array = { columns = 2, rows = 2, pitch_mm = 6.0 }
receiver = { plane_height_mm = 6.0, bin_mm = 0.25 }
trace = { paths = 20_000 }
films = [{ name = "plate", z_mm = 4.0, thickness_mm = 1.0, medium = { material_file = "glass.yml" } }]

[[receivers]]
name = "front"
kind = "plane"
position_mm = [0.0, 0.0, 6.0]
size_mm = [8.0, 8.0]
bins = [4, 4]
"#;

#[test]
fn wavelengths_are_added_until_light_that_leaves_and_its_colour_stay() {
    let folder = tempdir().expect("a folder");
    let path = folder.path();
    let rows = "0.38 1.6 2e-4\n        0.46 1.55 5e-5\n        0.52 1.5 1e-5\n        0.8 1.4 0\n";
    let yaml = format!("DATA:\n  - type: tabulated nk\n    data: |\n        {rows}");
    std::fs::write(path.join("glass.yml"), yaml).expect("written");
    let run = |name: &str, sampling: &str| {
        let text = format!("{PLATE}[light]\n{}\n", WHITE.trim_start_matches("light."));
        let text = text.replace("samples = 3", sampling);
        let found = run_text(path, "plate", &text, name, &[]);
        found.unwrap_or_else(|e| panic!("{e}"))["designs"]["plate"]["geometric"].take()
    };
    let (three, found) = (run("three", "samples = 3"), run("found", "tolerance = 0.005"));
    let fine = run("fine", "samples = 31");
    assert!(wavelengths(&found).len() >= 7, "{} wavelengths", wavelengths(&found).len());
    let read = |model: &Value, key: &str| match key.split_once('.') {
        Some((figure, receiver)) => model["receivers"][receiver][figure].clone(),
        None if key == "escaped_up" => model["power_ledger"][key].clone(),
        None => model[key].clone(),
    };
    let mut is_far = false;
    for key in [
        "escaped_up",
        "plane_u_prime",
        "plane_v_prime",
        "far_field_u_prime",
        "far_field_v_prime",
        "u_prime.front",
        "v_prime.front",
        "mean.front",
    ] {
        let exact = estimate(&read(&fine, key));
        for model in [&three, &found] {
            let figure = read(model, key);
            let (value, noise) = estimate(&figure);
            let error = estimate(&figure["wavelength_error"]);
            let off = (value - exact.0).abs();
            // The change that made it bounds what others make, within its noise.
            assert!(off < error.0 + 5.0 * noise.hypot(error.1).hypot(exact.1), "{key}: {figure}");
        }
        let (coarse, noise) = estimate(&read(&three, key));
        is_far |= (coarse - exact.0).abs() > 0.005 + 5.0 * noise.hypot(exact.1);
    }
    assert!(is_far, "three wavelengths are as good");
}
