// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing study`: its files, the reuse of traces, and errors of paired differences.
//!
//! Source: `docs/reference/study-file.md`.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::binary::batwing;
use crate::support::runs::files;
use crate::zone_colours::coloured;

const STUDY: &str = r#"
name = "small"
designs = ["d1.toml"]
models = ["geometric"]
paths = 20000

[[factors]]
name = "box"
key = "led.reflectance"
values = [0.5, 0.9]

[[factors]]
name = "centre"
key = "far_field.centre_deg"
values = [12.5]

[[probes]]
design = "D1"
element = 6
ranges_deg = [[0, 30], [50, 90]]
target = 1.0

[[probes]]
design = "D1"
element = 6
ranges_deg = [[30, 50]]

[[probes]]
design = "D1"
element = 6
ranges_deg = [[0, 90]]

[targets.D1.geometric_100um]
extraction_efficiency = 0.95
"#;

fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    let data = batwing_tests::workspace().join("data/designs/d1.toml");
    std::fs::copy(data, folder.path().join("d1.toml")).expect("copied");
    std::fs::write(folder.path().join("study.toml"), STUDY).expect("written");
    folder
}

/// Runs the study and returns `study.json` and what was said meanwhile.
fn run(folder: &Path, flags: &[&str]) -> (Value, String) {
    let output = batwing(folder)
        .args(["study", "study.toml", "--out", "out"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(output.status.success(), "{said}");
    let text = std::fs::read(folder.join("out/study.json")).expect("study.json");
    (serde_json::from_slice(&text).expect("JSON"), said)
}

/// Figures of a set-up by name.
fn figures(study: &Value, setup: &str) -> BTreeMap<String, Value> {
    let setups = study["setups"].as_array().expect("set-ups");
    let setup = setups.iter().find(|s| s["name"] == setup).expect("the set-up");
    let figures = setup["figures"].as_array().expect("figures");
    figures.iter().map(|f| (f["figure"].as_str().expect("a name").to_owned(), f.clone())).collect()
}

#[test]
fn set_ups_are_computed_once_and_changes_have_errors_of_differences() {
    let folder = folder();
    let (first, said) = run(folder.path(), &["--threads", "1"]);
    // Base and two boxes, with the element alone for each; the centre is read from the base's
    // light.
    assert_eq!(said.matches("traces").count(), 6, "{said}");
    let bytes = std::fs::read(folder.path().join("out/study.csv")).expect("study.csv");
    let (again, said) = run(folder.path(), &["--threads", "2"]);
    assert_eq!(said.matches("traces").count(), 0, "{said}");
    assert_eq!(first, again);
    assert_eq!(bytes, std::fs::read(folder.path().join("out/study.csv")).expect("study.csv"));
    for picture in ["misfit.png", "change-uniformity.png"] {
        assert!(folder.path().join("out").join(picture).exists(), "{picture}");
    }
    // A table that cannot be replaced leaves none that lists the one before.
    let table = folder.path().join("out/study.csv");
    std::fs::remove_file(&table).expect("removed");
    std::fs::create_dir_all(table.join("in the way")).expect("a folder");
    let failed = batwing(folder.path())
        .args(["study", "study.toml", "--out", "out"])
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&failed.stderr);
    assert!(!failed.status.success() && said.contains("study.csv"), "{said}");
    assert!(!folder.path().join("out/study.json").exists());

    let (base, wide) = (figures(&first, "base"), figures(&first, "centre = 12.5"));
    let number = |figure: &Value, key: &str| figure[key].as_f64().expect("a number");
    // The wider cone is quieter; what does not depend on it stays to the last bit, without error.
    let changed = &wide["centre_to_peak"];
    assert!(number(changed, "standard_error") < number(&base["centre_to_peak"], "standard_error"));
    assert_eq!(wide["uniformity"]["change"]["value"], 0.0);
    assert_eq!(wide["uniformity"]["change"]["standard_error"], 0.0);
    // All light of one element goes up; ranges are counted together.
    let share = |name: &str| number(&base[&format!("share_{name}_deg")], "value");
    let lobes = share("0_to_30_and_50_to_90");
    assert!((share("0_to_90") - 1.0).abs() < 0.2);
    assert!((lobes + share("30_to_50") - share("0_to_90")).abs() < 1e-12);
    assert!(lobes > 0.0 && share("30_to_50") > 0.0);

    // More light comes back from a brighter box: by the ledger, not by chance.
    let (dark, bright) = (figures(&first, "box = 0.5"), figures(&first, "box = 0.9"));
    let extraction = |f: &BTreeMap<String, Value>| number(&f["extraction_efficiency"], "value");
    assert!(extraction(&dark) < extraction(&base) && extraction(&base) < extraction(&bright));
    let slope = first["sensitivities"]
        .as_array()
        .expect("sensitivities")
        .iter()
        .find(|s| s["figure"] == "extraction_efficiency" && s["factor"] == "box")
        .expect("a slope");
    let expected = (extraction(&bright) - extraction(&dark)) / 0.4;
    assert!((number(&slope["change_per_unit"], "value") - expected).abs() < 1e-12);

    let ranking = first["ranking"].as_array().expect("a ranking");
    let misfits: Vec<f64> = ranking.iter().map(|r| number(&r["misfit"], "value")).collect();
    assert!(misfits.is_sorted() && misfits.len() == 4, "{misfits:?}");
    let miss = (extraction(&base) - 0.95).abs() / 0.01;
    let of_base = ranking.iter().find(|r| r["setup"] == "base").expect("the base");
    let missing = (1.0 - lobes) / 0.25;
    let both = (0.5 * (miss * miss + missing * missing)).sqrt();
    assert!((number(&of_base["misfit"], "value") - both).abs() < 1e-12);
}

/// Bins that are read of finer ones need no light of their own, and a set-up that reads them says
/// what a design that states them says.
#[test]
fn bins_that_are_read_take_no_trace_of_their_own() {
    let folder = folder();
    let factor =
        "[[factors]]\nname = \"centre\"\nkey = \"far_field.centre_deg\"\nvalues = [12.5]\n";
    let level = |width: &str| {
        format!(
            "[[factors.levels]]\nname = \"{width}\"\nset = {{ \"far_field.read_bin_deg\" = {width}, \"far_field.read_bins\" = \"between\", \"far_field.centre_deg\" = {width}, \"far_field.peak\" = \"parabola\", \"far_field.peak_fit_deg\" = 10.0 }}\n"
        )
    };
    let bins = format!("[[factors]]\nname = \"bins\"\n{}{}", level("5.0"), level("10.0"));
    assert!(STUDY.contains(factor));
    std::fs::write(folder.path().join("study.toml"), STUDY.replace(factor, &bins))
        .expect("written");
    let (read, said) = run(folder.path(), &[]);
    assert_eq!(said.matches("traces").count(), 6, "{said}");
    let text = std::fs::read_to_string(folder.path().join("d1.toml")).expect("the design");
    for width in ["5.0", "10.0"] {
        let of_set_up = figures(&read, &format!("bins = {width}"));
        let mut design = text.clone();
        for (stated, key, value) in [
            ("read_bin_deg = 5.0 ", "read_bin_deg", width),
            ("read_bins = \"about\" ", "read_bins", "\"between\""),
            ("\ncentre_deg = 2.5 ", "\ncentre_deg", width),
            ("peak = \"bin\"\n", "peak", "\"parabola\"\n"),
            ("peak_fit_deg = 7.5 ", "peak_fit_deg", "10.0"),
        ] {
            assert_eq!(design.matches(stated).count(), 1, "{stated}");
            design = design.replace(stated, &format!("{key} = {value} "));
        }
        std::fs::write(folder.path().join("d1.toml"), design).expect("written");
        let (of_design, said) = run(folder.path(), &[]);
        // The two boxes alone were never read in these bins.
        let traced = said.lines().filter(|line| line.contains("traces"));
        assert!(traced.clone().all(|line| line.contains("box = ")), "{said}");
        assert_eq!(traced.count(), 4, "{said}");
        let of_design = figures(&of_design, "base");
        for (name, figure) in &of_design {
            assert_eq!(figure["value"], of_set_up[name]["value"], "{width} {name}");
        }
        assert_ne!(
            of_design["peak_angle_deg"]["value"],
            figures(&read, "base")["peak_angle_deg"]["value"]
        );
    }
}

#[test]
fn what_is_no_toml_is_said_in_one_line_with_its_place() {
    let folder = folder();
    let said = |name: &str, text: &str| {
        let path = folder.path().join(name);
        let good = std::fs::read_to_string(&path).expect("readable");
        std::fs::write(&path, text).expect("written");
        let output = batwing(folder.path())
            .args(["study", "study.toml", "--out", "out"])
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(1), "{name}");
        std::fs::write(&path, good).expect("written");
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    for (name, begins) in [
        ("study.toml", "batwing: study.toml: line 2, column 9: "),
        ("d1.toml", "batwing: study.toml: designs: `d1.toml`: line 2, column 9: "),
    ] {
        let said = said(name, "name = \"a\"\nother = = 3\n");
        assert!(said.starts_with(begins) && said.contains("expected"), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    }
}

#[test]
fn studies_that_come_along_can_be_read() {
    let folder = batwing_tests::workspace().join("data/studies");
    let mut read = 0;
    for entry in std::fs::read_dir(&folder).expect("studies") {
        let path = entry.expect("a file").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let study = experiment::study::load(&path, &BTreeMap::new(), None).expect("a study");
        assert_eq!(path.file_stem().expect("a name"), study.file.name.as_str());
        assert!(study.setups.len() > 1, "{}", study.file.name);
        read += 1;
    }
    assert!(read >= 7, "{read} studies");
}

/// Targets of the ledger, of flux and of receivers are read and compared like all others.
#[test]
fn targets_may_be_any_figure_of_the_design() {
    let folder = folder();
    let at = folder.path();
    let design = std::fs::read_to_string(at.join("d1.toml")).expect("the design");
    let receiver = "\n[[receivers]]\nname = \"sky\"\nkind = \"far_field\"\ntheta_bin_deg = 90\nphi_bin_deg = 360\n";
    let design = design.replacen("[led]", "[led]\npower_w = 0.5\n", 1) + receiver;
    std::fs::write(at.join("d1.toml"), design).expect("written");
    let study = |targets: &str| {
        let text = format!(
            "name = \"all\"\ndesigns = [\"d1.toml\"]\nmodels = [\"geometric\"]\npaths = 4096\n[scales]\nflux_up = 0.1\n[targets.D1.geometric_100um]\n{targets}"
        );
        std::fs::write(at.join("study.toml"), text).expect("written");
    };
    // The second time the first trace is stored, without the further figures.
    study("escaped_up = 0.8\n");
    run(at, &[]);
    study("escaped_up = 0.8\nabsorbed_by_ground_mirror = 0.1\nflux_up = 1.6\n\"flux.sky\" = 0.8\n");
    let (all, _) = run(at, &[]);
    let found = figures(&all, "base");
    let value = |key: &str| found[key]["value"].as_f64().expect("a number");
    assert!((value("flux_up") / 2.0 / value("escaped_up") - 1.0).abs() < 1e-9);
    assert!((value("flux.sky") / value("escaped_up") - 1.0).abs() < 1e-9);
    assert!((0.002..0.005).contains(&value("absorbed_by_ground_mirror")));
    for key in ["escaped_up", "absorbed_by_ground_mirror", "flux_up", "flux.sky"] {
        assert!(found[key]["target"].is_number(), "{key}: {}", found[key]);
    }
    for (wrong, word) in [
        ("absorbed_by_nothing = 0.1", "absorbed_by_ground_mirror"),
        ("\"flux.ground\" = 0.1", "flux.sky"),
        ("intensity_peak = 0.1", "scales.intensity_peak"),
        ("flux_up = -1", "from 0"),
    ] {
        study(wrong);
        let output = batwing(at).args(["study", "study.toml"]).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(word), "{said}");
    }
}

#[test]
fn bad_studies_end_in_one_message_and_write_nothing() {
    let folder = folder();
    for (wrong, words) in [
        (
            STUDY.replace("led.reflectance", "led.colour"),
            &["study.toml", "box = 0.5", "colour"][..],
        ),
        (
            STUDY.replace("extraction_efficiency = 0.95", "extraction_efficiency = \"high\""),
            &["targets.D1.geometric_100um", "number"],
        ),
        (STUDY.replace("[targets", "[tragets"), &["study.toml", "tragets"]),
        (STUDY.replace("d1.toml", "d9.toml"), &["designs", "d9.toml"]),
    ] {
        std::fs::write(folder.path().join("study.toml"), wrong).expect("written");
        let output =
            batwing(folder.path()).args(["study", "study.toml"]).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        for word in words {
            assert!(said.contains(word), "no `{word}` in: {said}");
        }
        assert!(
            !folder.path().join("study").exists() && !folder.path().join(".batwing-cache").exists()
        );
    }
    // A damaged trace is computed anew.
    std::fs::write(folder.path().join("study.toml"), STUDY).expect("written");
    let (first, _) = run(folder.path(), &[]);
    let traces = folder.path().join(".batwing-cache/traces");
    let traces = files(&traces);
    let other = std::fs::read(&traces[1]).expect("readable");
    for (bytes, why) in
        [(&b"{"[..], "is damaged"), (&other, "holds paths of another trace or group")]
    {
        std::fs::write(&traces[0], bytes).expect("written");
        let (again, said) = run(folder.path(), &[]);
        assert!(said.contains("traced anew") && said.contains(why), "{said}");
        assert_eq!(first, again);
    }
}

/// A figure of a receiver by its former name is read, with a warning that says that of today.
#[test]
fn former_names_of_figures_are_read_with_a_warning() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let design = r#"
name = "bare"
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflection = "absorbing" }
mirror = { kind = "absorbing", extent = "array" }
array = { columns = 1, rows = 1, pitch_mm = 6.0 }
light = { wavelength_nm = 550.0 }
receiver = { plane_height_mm = 3.0, bin_mm = 0.5 }
trace = { paths = 4096 }
receivers = [{ name = "glow", kind = "luminance", position_mm = [0.0, 0.0, 3.0], size_mm = [6.0, 6.0], bins = [1, 1], theta_bin_deg = 5.0, phi_bin_deg = 30.0 }]
"#;
    std::fs::write(at.join("bare.toml"), design).expect("written");
    let study = r#"
name = "widths"
designs = ["bare.toml"]
models = ["geometric"]
[targets.bare.geometric]
"half_angle_u_deg.glow" = { at_most = 170.0 }
[scales]
"half_angle_u_deg.glow" = 1.0
"#;
    std::fs::write(at.join("study.toml"), study).expect("written");
    let output = batwing(at).args(["study", "study.toml", "--out", "study"]).output();
    let output = output.expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let warning = "study.toml: half_angle_u_deg is called fwhm_u_deg, and read as that";
    assert_eq!(said.matches(warning).count(), 1, "{said}");
    let table = std::fs::read_to_string(at.join("study/study.csv")).expect("study.csv");
    assert!(table.contains("fwhm_u_deg.glow") && !table.contains("half_angle"), "{table}");
}

/// A set-up in which a figure with a target cannot be read stands below the ranking with the reason,
/// on terminal, in JSON, in CSV and on the page.
#[test]
fn set_ups_without_a_figure_with_a_target_stand_below_the_ranking() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let design = r#"
name = "bare"
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.5, reflection = "specular" }
mirror = { kind = "specular", reflectance = 0.95, extent = "array" }
array = { columns = 2, rows = 2, pitch_mm = 6.0 }
light = { wavelength_nm = 550.0 }
receiver = { plane_height_mm = 3.0, bin_mm = 0.25 }
trace = { paths = 4096 }
"#;
    std::fs::write(at.join("bare.toml"), design).expect("written");
    let study = r#"
name = "bins"
designs = ["bare.toml"]
models = ["geometric"]
[[factors]]
name = "bin"
key = "receiver.bin_mm"
values = [0.25, 0.5]
[[factors]]
name = "height"
key = "receiver.plane_height_mm"
values = [9000.0]
[targets.bare.geometric]
uniformity = 0.9
escaped_up = 0.9
"#;
    std::fs::write(at.join("study.toml"), study).expect("written");
    let output = batwing(at).args(["study", "study.toml", "--out", "study"]).output();
    let output = output.expect("it runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(at.join("study/study.json")).expect("study.json");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    let [ranked, unranked] =
        ["ranking", "unranked"].map(|list| json[list].as_array().expect("a list").clone());
    // Of a Lambertian source at the middle 1e-6 reach a map of 14 mm at 9 m: it is dark.
    let why = [
        (
            "bin = 0.5",
            "no uniformity of bare geometric: the design does not have it, and receiver.bin_mm is too wide for a fit to the valley between neighbours",
        ),
        (
            "height = 9000.0",
            "no uniformity of bare geometric: 4,096 paths show too little light for it",
        ),
    ];
    assert_eq!(ranked.len() + unranked.len(), json["setups"].as_array().expect("a list").len());
    assert!(ranked.iter().all(|one| why.iter().all(|(name, _)| one["setup"] != *name)));
    let table = std::fs::read_to_string(at.join("study/study.csv")).expect("study.csv");
    batwing(at).args(["report", "study", "--out", "page.html"]).assert().success();
    let page = std::fs::read_to_string(at.join("page.html")).expect("a page");
    let page = page.replace("&#x27;", "'");
    assert_eq!(unranked.len(), why.len(), "{unranked:?}");
    for (entry, (name, why)) in unranked.iter().zip(why) {
        assert_eq!((&entry["setup"], &entry["why"]), (&name.into(), &why.into()));
        assert!(said.contains(&format!("not ranked: {name}: {why}")), "{said}");
        assert!(page.contains(&format!("<dt>{name}</dt><dd>{why}</dd>")), "{name}");
        let of = |row: &&str| row.starts_with(name) && row.contains(",uniformity,");
        let row = table.lines().find(of).unwrap_or_else(|| panic!("{name}: {table}"));
        let why = why.split_once(": ").expect("a reason").1;
        assert!(
            row.contains(",uniformity,,,") && row.contains(&format!("no figure: {why}")),
            "{row}"
        );
    }
}

/// Panels behind one trace are told apart, their contrast as well as their filters.
#[test]
fn set_ups_that_differ_in_the_panel_have_figures_of_their_own() {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("rgb.toml"), coloured()).expect("written");
    let factor = |name: &str, key: &str, value: f64| {
        format!("[[factors]]\nname = \"{name}\"\nkey = \"{key}\"\nvalues = [{value}]\n\n")
    };
    let study =
        "name = \"panels\"\ndesigns = [\"rgb.toml\"]\nmodels = [\"geometric\"]\npaths = 20000\n\n"
            .to_owned()
            + &factor("contrast", "panel.contrast", 4.0)
            + &factor("red", "panel.sub_pixels[1].black", 0.5)
            + "[targets.boxed.geometric]\n\"coverage_bt709_xy.front\" = 1.0\n";
    std::fs::write(folder.path().join("study.toml"), study).expect("written");
    let (found, _) = run(folder.path(), &[]);
    let coverage = |setup: &str| {
        let figure = &figures(&found, setup)["coverage_bt709_xy.front"];
        figure["value"].as_f64().expect("a number")
    };
    let [base, grey, red] = ["base", "contrast = 4", "red = 0.5"].map(coverage);
    assert!(
        grey < base - 0.2 && red < base - 0.1 && (grey - red).abs() > 0.02,
        "{base} {grey} {red}"
    );
}
