// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of maps, far fields and receivers: against sums over the spectrum, laws and scatter.
//!
//! Sources: `docs/reference/results-schema.md`; colour-matching functions of `data/spectra/` (CIE
//! 1931).

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use design::Design;
use metrics::colour_matching;
use metrics::estimate::Estimate;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::model::Model;
use simulate::spectral::{SpectralJob, SpectralTrace};

use crate::support::binary::batwing;
use crate::support::runs::{estimate, files, run_text};
use crate::zone_colours::coloured;

/// A dome of a glass that disperses and absorbs blue, in the light of a white LED.
const WHITE: &str = r#"
name = "white"
dome = { sphere_radius_mm = 2.0, height_mm = 1.2, width_mm = 3.4 }
silicone = { material_file = "glass.yml" }
mirror = { kind = "specular", reflectance = 0.95, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.5, reflection = "specular" }
array = { columns = 2, rows = 2, pitch_mm = 6.0 }
receiver = { plane_height_mm = 3.0, bin_mm = 0.25 }
far_field = { bin_deg = 2.0, azimuth_bin_deg = 30.0, centre_deg = 10.0, peak_fit_deg = 10.0 }
trace = { paths = 60_000 }
[light.spectrum]
kind = "white_led"
blue_nm = 450.0
blue_fwhm_nm = 20.0
phosphor_nm = 560.0
phosphor_fwhm_nm = 120.0
blue_part = 0.25
weighting = "photometric"
samples = 7
[[receivers]]
name = "plate"
kind = "plane"
position_mm = [0.0, 0.0, 4.0]
size_mm = [8.0, 8.0]
bins = [4, 4]
"#;

/// n and k fall from 400 to 800 nm: 1.6 to 1.4, 1e-5 to 0.
const GLASS: &str =
    "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.6 1e-5\n        0.8 1.4 0\n";

fn uv([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = x + 15.0 * y + 3.0 * z;
    [4.0 * x / sum, 9.0 * y / sum]
}

/// Traces `text` and gives the trace to `read`.
fn traced<T>(
    text: &str,
    paths: u64,
    seed: u64,
    read: impl FnOnce(&Design, &SpectralTrace) -> T,
) -> T {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("glass.yml"), GLASS).expect("written");
    let text = text.replace("60_000", &paths.to_string());
    let design = design::parse("white.toml", &text, folder.path());
    let design = design.unwrap_or_else(|e| panic!("{e}"));
    let interrupt = Interrupt::default();
    let context = RunContext::quiet(&interrupt, seed);
    let lights = design.all_lights().expect("lights");
    let (design, lights) = (&design, &*lights);
    let job = SpectralJob { design, lights, model: Model::Geometric, cache: None, context };
    let trace = job.trace(None).unwrap_or_else(|e| panic!("{e:#}"));
    read(design, &trace)
}

/// Figures of colours by their keys.
fn figures(design: &Design, trace: &SpectralTrace) -> Vec<(String, Estimate)> {
    let is_colour =
        |key: &str| metrics::figures::find(key).is_some_and(|f| f.source.is_of_colours());
    let all = trace.observation().estimates(design, is_colour).into_iter();
    all.map(|figure| (figure.key.into_owned(), figure.entry.estimate())).collect()
}

fn figure(all: &[(String, Estimate)], key: &str) -> Estimate {
    all.iter().find(|(known, _)| known == key).unwrap_or_else(|| panic!("no {key}: {all:?}")).1
}

/// The part of the spectrum nearest to each wavelength, weighed by hand: Gaussians over 0.5 nm, whose
/// light falls linearly from one traced wavelength to the next.
#[test]
fn colours_are_the_sum_over_the_spectrum() {
    let gauss = |nm: f64, peak: f64, width: f64| {
        let sigma = width / (2.0 * (2.0 * 2f64.ln()).sqrt());
        let off = (nm - peak) / sigma;
        if off.abs() > 3.0 { 0.0 } else { (-0.5 * off * off).exp() / sigma }
    };
    let density = |nm: f64| 0.25 * gauss(nm, 450.0, 20.0) + 0.75 * gauss(nm, 560.0, 120.0);
    traced(WHITE, 60_000, 3, |design, trace| {
        let parts = trace.by_wavelength();
        let nodes: Vec<f64> = parts.iter().map(|(_, nm, _)| *nm).collect();
        let mut weights = vec![[0.0; 3]; nodes.len()];
        let last = nodes.len() - 1;
        for step in 0..800 {
            let nm = 380.25 + 0.5 * f64::from(step);
            let matching = colour_matching::xyz(nm);
            let after = nodes.partition_point(|node| *node < nm);
            let (low, high) = (after.saturating_sub(1), after.min(last));
            let share =
                if low == high { 0.0 } else { (nm - nodes[low]) / (nodes[high] - nodes[low]) };
            for (node, share) in [(low, 1.0 - share), (high, share)] {
                for k in 0..3 {
                    weights[node][k] += 0.5 * density(nm) * share * matching[k];
                }
            }
        }
        let sum = |of: &dyn Fn(&simulate::observation::Observation) -> f64| {
            let mut sum = [0.0; 3];
            for ((_, _, seen), weight) in parts.iter().zip(&weights) {
                for k in 0..3 {
                    sum[k] += weight[k] * of(seen);
                }
            }
            uv(sum)
        };
        let all = figures(design, trace);
        for (place, expected) in [
            ("plane_", sum(&|seen| seen.illuminance.total().iter().sum())),
            ("", sum(&|seen| seen.receivers[0].total().iter().sum())),
        ] {
            let name = if place.is_empty() { ".plate" } else { "" };
            for (k, key) in ["u_prime", "v_prime"].into_iter().enumerate() {
                let found = figure(&all, &format!("{place}{key}{name}"));
                let off = (found.value - expected[k]).abs();
                assert!(off < 1e-4, "{place}{key}{name}: {found:?}, not {}", expected[k]);
                assert!(found.standard_error > 1e-6 && found.standard_error < 5e-3, "{found:?}");
            }
        }
        // White of a glass that absorbs blue: cooler light than it lets out.
        let kelvin = figure(&all, "cct_k.plate");
        assert!((4000.0..9000.0).contains(&kelvin.value), "{kelvin:?}");
        // Y is what V(λ) weighs, by another quadrature.
        let seen = trace.observation();
        let colours = seen.colours.as_ref().and_then(|c| c.arrays.as_ref()).expect("arrays");
        let lumens = design.all_lights().expect("lights").emitted_lm();
        for (y, whole) in [
            (&colours.illuminance[1], &seen.illuminance),
            (&colours.far_field[1], &seen.far_field),
            (&colours.receivers[0][1], &seen.receivers[0]),
        ] {
            let largest = whole.total().iter().copied().fold(0.0, f64::max) * lumens;
            for (y, seen) in y.total().iter().zip(whole.total()) {
                assert!((683.0 * y - lumens * seen).abs() < 1e-3 * largest, "{y} {seen}");
            }
        }
    });
}

/// The jackknife's errors beside the scatter over seeds.
#[test]
fn errors_of_colours_are_the_scatter_over_seeds() {
    const SEEDS: u64 = 24;
    let text = WHITE.replace("samples = 7", "samples = 3");
    let runs: Vec<_> = (0..SEEDS).map(|seed| traced(&text, 16_384, 100 + seed, figures)).collect();
    for key in [
        "plane_u_prime",
        "plane_v_prime",
        "plane_cct_k",
        "plane_duv",
        "far_field_u_prime",
        "far_field_cct_k",
        "u_prime.plate",
        "cct_k.plate",
        "duv.plate",
    ] {
        let all: Vec<Estimate> = runs.iter().map(|run| figure(run, key)).collect();
        let count = SEEDS as f64;
        let mean = all.iter().map(|e| e.value).sum::<f64>() / count;
        let scatter = all.iter().map(|e| (e.value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let stated = all.iter().map(|e| e.standard_error.powi(2)).sum::<f64>() / count;
        // A scatter of 24 values is known to 1/√46 of itself.
        let ratio = (scatter / stated).sqrt();
        assert!((ratio - 1.0).abs() < 4.0 / (2.0 * (count - 1.0)).sqrt(), "{key}: {ratio}");
    }
}

/// A red and a blue and green beam, each on a plate of its own, and a plate that none meets.
const BEAMS: &str = r#"
name = "beams"
light = { wavelength_nm = 550.0, weighting = "photometric" }
mirror = { kind = "absorbing", extent = "package" }
led = { size_mm = [0.2, 0.2], height_mm = 0.1, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { plane_height_mm = 3.0, bin_mm = 0.5 }
trace = { paths = 20_000 }
[[sources]]
name = "red"
kind = "cosine"
exponent = 1e6
position_mm = [-1.0, 0.0, 0.2]
power = 2.0
wavelength_nm = 620.0
[[sources]]
name = "cyan"
kind = "cosine"
exponent = 1e6
position_mm = [1.0, 0.0, 0.2]
spectrum = { kind = "lines", wavelength_nm = [470.0, 530.0], power = [1.0, 3.0], weighting = "photometric" }
[[receivers]]
name = "left"
kind = "plane"
position_mm = [-1.0, 0.0, 2.0]
size_mm = [1.0, 1.0]
bins = [2, 2]
[[receivers]]
name = "right"
kind = "plane"
position_mm = [1.0, 0.0, 2.0]
size_mm = [1.0, 1.0]
bins = [1, 1]
[[receivers]]
name = "dark"
kind = "plane"
position_mm = [0.0, 3.0, 2.0]
size_mm = [0.5, 0.5]
bins = [1, 1]
"#;

/// Numbers of a column of a table.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().expect("headings");
    let at = heads.iter().position(|head| *head == name);
    let at = at.unwrap_or_else(|| panic!("no {name}: {heads:?}"));
    lines.map(|fields| fields[at].parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn light_of_one_source_has_its_chromaticity() {
    let folder = tempdir().expect("a folder");
    let found = run_text(folder.path(), "beams", BEAMS, "out", &[]);
    let found = found.unwrap_or_else(|e| panic!("{e}"));
    let model = &found["designs"]["beams"]["geometric"];
    let lines = |parts: &[(f64, f64)]| {
        let mut sum = [0.0; 3];
        for (nm, power) in parts {
            for (sum, value) in sum.iter_mut().zip(colour_matching::xyz(*nm)) {
                *sum += power * value;
            }
        }
        sum
    };
    let folder = folder.path().join("out/beams/geometric");
    for (name, sum) in
        [("left", lines(&[(620.0, 1.0)])), ("right", lines(&[(470.0, 1.0), (530.0, 3.0)]))]
    {
        let receiver = &model["receivers"][name];
        let table = folder.join(format!("receivers/{name}.csv"));
        // Of equal numbers of lumens the one with more paths a watt may have other paths.
        let limit = if name == "left" { 1e-12 } else { 2e-3 };
        for (k, key) in ["u_prime", "v_prime"].into_iter().enumerate() {
            let (value, error) = estimate(&receiver[key]);
            assert!((value - uv(sum)[k]).abs() < limit, "{name} {key}: {value}, {:?}", uv(sum));
            assert!(error < limit, "{name} {key}: {error}");
            let bins = column(&table, key);
            assert!(bins.iter().all(|bin| (bin - uv(sum)[k]).abs() < limit), "{bins:?}");
        }
        let (lux, luminous) =
            (column(&table, "tristimulus_y_lx"), column(&table, "illuminance_lx"));
        for (y, lux) in lux.iter().zip(luminous) {
            assert!(lux > 0.0 && (y / lux - 1.0).abs() < 1e-9, "{name}: {y} {lux}");
        }
        let array = folder.join(format!("colour/receivers/{name}.npy"));
        assert!(array.exists(), "{name}");
    }
    // 620 nm has no colour temperature.
    assert_eq!(model["receivers"]["left"]["cct_k"], Value::Null);
    for key in ["u_prime", "v_prime", "cct_k", "duv"] {
        assert_eq!(model["receivers"]["dark"][key], Value::Null, "{key}");
    }
    assert!(column(&folder.join("receivers/dark.csv"), "u_prime")[0].is_nan());
    assert!(model["plane_u_prime"]["value"].is_number());
    // One package has no cell, and beams leave in one direction.
    assert_eq!(model["cell_colour_difference_parts"], Value::Null);
}

#[test]
fn files_and_page_of_a_run_show_its_colours() {
    let folder = tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("glass.yml"), GLASS).expect("written");
    let text = WHITE.replace("60_000", "200_000");
    let found = run_text(path, "white", &text, "out", &[]).unwrap_or_else(|e| panic!("{e}"));
    let model = &found["designs"]["white"]["geometric"];
    assert_eq!(model["units"]["plane_cct_k"], "k");
    assert!(estimate(&model["plane_u_prime"]["wavelength_error"]).0 > 0.0);
    assert!(estimate(&model["receivers"]["plate"]["u_prime"]["wavelength_error"]).0 > 0.0);
    let difference = estimate(&model["far_field_colour_difference"]).0;
    assert!(difference > 0.0, "{model}");
    let colours = files(&path.join("out/white/geometric/colour"));
    let mut names: Vec<String> = colours
        .iter()
        .map(|file| file.file_name().expect("a name").to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "far_field.csv",
            "far_field.npy",
            "far_field.png",
            "illuminance.npy",
            "illuminance.png",
            "plate.npy",
            "plate.png"
        ]
    );
    let output = batwing(path).args(["report", "out", "--out", "page.html"]).output();
    let output = output.expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(path.join("page.html")).expect("a page");
    for words in
        ["id=\"colours\"", "colours of the map", "colours over the polar angle", "colours of plate"]
    {
        assert!(page.contains(words), "no {words}");
    }

    // One wavelength has no colours, and nobody asks why.
    let (head, _) = text.split_once("[light.spectrum]").expect("a spectrum");
    let plain = format!("light = {{ wavelength_nm = 550.0 }}\n{head}");
    let found = run_text(path, "white", &plain, "plain", &[]).unwrap_or_else(|e| panic!("{e}"));
    let model = &found["designs"]["white"]["geometric"];
    assert_eq!(model["plane_u_prime"], Value::Null);
    assert!(files(&path.join("plain/white/geometric/colour")).is_empty());
    let output = batwing(path).args(["report", "plain", "--out", "plain.html"]).output();
    assert!(output.expect("it runs").status.success());
    let page = std::fs::read_to_string(path.join("plain.html")).expect("a page");
    assert!(!page.contains("id=\"colours\""));
}

/// Light whose ways do not depend on the wavelength has the colour of its source everywhere, exactly.
#[test]
fn light_without_dispersion_has_the_colour_of_its_source() {
    let folder = tempdir().expect("a folder");
    let even = WHITE.replace("material_file = \"glass.yml\"", "index = 1.41");
    let start = even.find("[light.spectrum]").expect("a spectrum");
    let end = even.find("[[receivers]]").expect("a receiver");
    let spectrum = even[start..end].replace("[light.spectrum]\n", "");
    let keys: Vec<&str> = spectrum.lines().filter(|line| !line.starts_with("weighting")).collect();
    let source = |name: &str, x: f64| {
        format!(
            "[[sources]]\nname = \"{name}\"\nkind = \"rectangle\"\nspectrum = {{ {} }}\nsize_mm = [0.4, 0.4]\nposition_mm = [{x}, 0.0, 0.35]\n",
            keys.join(", ")
        )
    };
    // Two lights of one spectrum, each traced by itself.
    let pair = format!(
        "{}[light]\nwavelength_nm = 550.0\nweighting = \"photometric\"\n{}{}{}",
        even[..start].replace("paths = 60_000", "paths = 20_000, ledger_by_source = true"),
        source("a", -0.25),
        source("b", 0.25),
        &even[end..],
    );
    let find = |text: &str, name: &str| {
        let found = run_text(folder.path(), name, text, name, &["--model", "geometric"]);
        found.unwrap_or_else(|e| panic!("{e}"))["designs"]["white"]["geometric"].take()
    };
    let gauss = |nm: f64, peak: f64, width: f64| {
        let sigma = width / (2.0 * (2.0 * 2f64.ln()).sqrt());
        let off = (nm - peak) / sigma;
        if off.abs() > 3.0 { 0.0 } else { (-0.5 * off * off).exp() / sigma }
    };
    let mut sum = [0.0; 3];
    for step in 0..4500 {
        let nm = 380.05 + 0.1 * f64::from(step);
        let power = 0.25 * gauss(nm, 450.0, 20.0) + 0.75 * gauss(nm, 560.0, 120.0);
        let matching = colour_matching::xyz(nm);
        for k in 0..3 {
            sum[k] += power * matching[k];
        }
    }
    let exact = uv(sum);
    for (name, text) in [("one", &even), ("pair", &pair)] {
        let found = find(text, name);
        let of_plate = &found["receivers"]["plate"];
        for [u, v] in [
            [&found["plane_u_prime"], &found["plane_v_prime"]],
            [&found["far_field_u_prime"], &found["far_field_v_prime"]],
            [&of_plate["u_prime"], &of_plate["v_prime"]],
        ] {
            for (figure, exact) in [u, v].into_iter().zip(exact) {
                let (value, error) = estimate(figure);
                assert!((value - exact).abs() < 2e-4 && error == 0.0, "{name}: {figure} {exact}");
                assert_eq!(estimate(&figure["wavelength_error"]), (0.0, 0.0), "{name}");
            }
        }
        for key in [
            "cell_colour_difference",
            "cell_colour_difference_parts",
            "far_field_colour_difference",
        ] {
            assert_eq!(estimate(&found[key]), (0.0, 0.0), "{name}: {key}");
            assert!(found[key].get("interval").is_none(), "{name}: {key}");
        }
        assert!(estimate(&found["plane_cct_k"]).1 == 0.0, "{}", found["plane_cct_k"]);
    }
}

/// Deep red alone, which no z sees, before a panel.
#[test]
fn light_without_z_has_a_white_behind_the_panel() {
    let folder = tempdir().expect("a folder");
    let deeper = [
        ("[610.0, 630.0, 650.0]", 660),
        ("[500.0, 530.0, 560.0]", 670),
        ("[440.0, 455.0, 470.0]", 680),
    ];
    let text = deeper.iter().fold(coloured(), |text, (die, nm)| {
        text.replacen(die, &format!("[{}.0, {nm}.0, {}.0]", nm - 5, nm + 5), 1)
    });
    let run = run_text(folder.path(), "red", &text, "out", &["--paths", "9000"]).expect("results");
    let front = &run["designs"]["boxed"]["geometric"]["receivers"]["front"];
    let value = |name: &str| front[name]["value"].as_f64().expect(name);
    // All beyond 650 nm lies near the red end of the locus.
    assert!((value("white_u_prime") - 0.62).abs() < 0.01, "{front}");
    assert!((value("white_v_prime") - 0.507).abs() < 0.01, "{front}");
    assert!(value("coverage_bt709_xy") < 0.01, "{front}");
}
