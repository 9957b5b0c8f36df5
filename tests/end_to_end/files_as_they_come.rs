// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files as other programs write them: relative rays of LightTools, rays as text, scattering for
//! light from one side, names that steer terminals.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use batwing_tests::workspace;

use crate::support::binary::{batwing, json};

/// Copies files of `tests/findings/` into a new folder.
fn findings(names: &[&str]) -> tempfile::TempDir {
    let folder = tempdir().expect("a folder");
    for name in names {
        let from = workspace().join("tests/findings").join(name);
        std::fs::copy(from, folder.path().join(name)).expect("copied");
    }
    folder
}

const LIGHTTOOLS: [&str; 3] = [
    "RayFileConverter_ThreeRays_PowerOnly.1.ray",
    "RayFileConverter_ThreeRays_Wavelength.1.ray",
    "RayFileConverter_ThreeRays_Wavelength.1.txt",
];
const ZEMAX: &str = "TestRayFiles_ZemaxText.txt";

fn flux(said: &Value) -> f64 {
    said["flux"].as_f64().expect("a flux")
}

#[test]
fn rays_of_lighttools_have_the_flux_of_their_header() {
    let folder = findings(&LIGHTTOOLS);
    for name in LIGHTTOOLS {
        let said = json(folder.path(), &["import", name]);
        assert_eq!(said["rays"], 3, "{name}");
        assert!((flux(&said) / 0.003_106_601 - 1.0).abs() < 1e-6, "{name}: {said}");
        let warning = said["warnings"][0].as_str().expect("a warning");
        assert!(warning.contains("relative") && warning.contains("header"), "{warning}");
        let coloured = name.contains("Wavelength");
        let range = serde_json::json!([450.0, 620.0]);
        assert_eq!(said["wavelengths_nm"], if coloured { range } else { Value::Null });

        for (format, out) in [
            ("ray", "o.ray"),
            ("ray-text", "t.ray"),
            ("zemax-ray", "o.sdf"),
            ("zemax-ray-text", "t.txt"),
        ] {
            json(folder.path(), &["import", name, "--format", format, "--out", out]);
            let back = json(folder.path(), &["import", out]);
            assert!((flux(&back) / flux(&said) - 1.0).abs() < 1e-6, "{out}: {back}");
            assert_eq!(back["wavelengths_nm"], said["wavelengths_nm"], "{name} {out}");
            assert_eq!([&back["low_mm"], &back["rays"]], [&said["low_mm"], &said["rays"]]);
            assert_eq!(back["warnings"], serde_json::json!([]), "{out}");
        }
    }
}

#[test]
fn rays_as_text_for_zemax_are_read() {
    let folder = findings(&[ZEMAX]);
    let said = json(folder.path(), &["import", ZEMAX]);
    assert_eq!([&said["rays"], &said["flux_in_header"]], [&Value::from(9), &Value::Null]);
    assert!((flux(&said) - 138.865_938).abs() < 1e-4, "{said}");
    // Lengths in centimetres and wavelengths in micrometres.
    let rows = "2 2\n1 0 0.5 0 0 1 3 0.45\n0 0 0 0 0.6 0.8 1 0.62\n";
    std::fs::write(folder.path().join("cm.dat"), rows).expect("written");
    let said = json(folder.path(), &["import", "cm.dat"]);
    assert_eq!(said["high_mm"], serde_json::json!([10.0, 0.0, 5.0]));
    let wavelengths = said["wavelengths_nm"].as_array().expect("a range");
    assert!((wavelengths[0].as_f64().expect("nm") - 450.0).abs() < 1e-3);
    let design = |name: &str, file: &str| {
        let text = format!(
            "name = \"{name}\"\n[mirror]\nkind = \"absorbing\"\nextent = \"array\"\n[led]\n\
             size_mm = [0.02, 0.02]\nheight_mm = 0.01\nreflection = \"absorbing\"\n\
             [array]\ncolumns = 1\nrows = 1\npitch_mm = 2000.0\n[light]\nwavelength_nm = 550.0\n\
             [receiver]\nplane_height_mm = 20.0\nbin_mm = 50.0\n[trace]\npaths = 20000\n\
             [[sources]]\nname = \"s\"\nkind = \"file\"\nposition_mm = [0.0, 0.0, 1.0]\n\
             file = \"{file}\"\n"
        );
        std::fs::write(folder.path().join(format!("{name}.toml")), text).expect("written");
        json(folder.path(), &["run", &format!("{name}.toml"), "--out", name])
    };
    let run = design("lit", "cm.dat");
    let ledger = &run["designs"]["lit"]["geometric"]["power_ledger"];
    assert!((ledger["escaped_up"]["value"].as_f64().expect("a share") - 1.0).abs() < 1e-9);
}

#[test]
fn damaged_text_rays_are_refused_by_their_line() {
    let folder = findings(&LIGHTTOOLS);
    let good = std::fs::read_to_string(folder.path().join(LIGHTTOOLS[2])).expect("text");
    for (from, to, words) in [
        ("lt_endofdata", "", "expected lt_endofdata after the rays, got the end"),
        ("radiant_power", "power", "line 5: expected lt_datatype: radiant_power or luminous_flux"),
        ("wavelength", "tristimulus", "line 7: expected lt_color_info: none or wavelength"),
        ("millimeters", "ells", "line 8: expected lt_length_units"),
        ("0.25", "0.95", "line 14: expected a unit vector"),
        ("            620", "", "line 14: expected 8 numbers"),
        ("0.001553301", "-1", "line 14: expected a flux of 0 or more"),
    ] {
        let text = good.replace(from, to);
        assert_ne!(text, good, "{from}");
        std::fs::write(folder.path().join("bad.txt"), text).expect("written");
        refused(folder.path(), &["import", "bad.txt"], words);
    }
    for (text, words) in [
        ("2 4\n0 0 0 0 0 1 1\n", "line 2: expected 2 rays, as the first line says, got the end"),
        ("1 4\n0 0 0 0 0 1 1\n0 0 0 0 0 1 1\n", "line 3: expected 1 rays"),
        ("1 4\n0 0 0 0 0 1 1,5\n", "with a comma"),
    ] {
        std::fs::write(folder.path().join("bad.dat"), text).expect("written");
        refused(folder.path(), &["import", "bad.dat"], words);
    }
}

/// Runs a command that must fail in one line with `words`.
fn refused(at: &Path, arguments: &[&str], words: &str) {
    let output = batwing(at).args(arguments).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{arguments:?}");
    assert!(said.contains(words) && said.trim().lines().count() == 1, "{words}: {said}");
}

/// A Klems matrix of one value for one direction, as files of one side have it.
fn klems(direction: &str, value: f64) -> String {
    let basis = "LBNL/Klems Full";
    let row = format!("{value}, ").repeat(145 * 145);
    format!(
        "<WindowElement xmlns=\"http://windows.lbl.gov\"><Optical><Layer><Material><Name>x</Name>\
         </Material><DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure>\
         <AngleBasis><AngleBasisName>{basis}</AngleBasisName></AngleBasis></DataDefinition>\
         <WavelengthData><Wavelength unit=\"Integral\">Visible</Wavelength><WavelengthDataBlock>\
         <WavelengthDataDirection>{direction}</WavelengthDataDirection>\
         <ColumnAngleBasis>{basis}</ColumnAngleBasis><RowAngleBasis>{basis}</RowAngleBasis>\
         <ScatteringData>{row}</ScatteringData></WavelengthDataBlock></WavelengthData></Layer>\
         </Optical></WindowElement>"
    )
}

#[test]
fn transmission_of_one_side_is_that_of_the_other() {
    let folder = findings(&["f07-one-sided.toml"]);
    for direction in ["Transmission Back", "Transmission Front"] {
        let file = klems(direction, 0.3 / std::f64::consts::PI);
        std::fs::write(folder.path().join("f07-one-sided.xml"), file).expect("written");
        let output = batwing(folder.path())
            .args(["run", "f07-one-sided.toml", "--out", "r", "--json"])
            .output()
            .expect("it runs");
        let run: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let ledger = &run["designs"]["f07"]["geometric"]["power_ledger"];
        let up = ledger["escaped_up"]["value"].as_f64().expect("a share");
        assert!((up - 0.3).abs() < 0.01, "{direction}: {up}");
        let said = String::from_utf8_lossy(&output.stderr);
        let derived = direction == "Transmission Back";
        let side = if derived { "inner" } else { "outer" };
        let words = format!("transmission of light from the {side} side is not given");
        assert!(said.contains(&words) && said.contains("by reciprocity"), "{said}");
        let import = json(folder.path(), &["import", "f07-one-sided.xml"]);
        assert!(import["warnings"][0].as_str().expect("a warning").contains(&words), "{import}");
        assert_eq!(import["tables"].as_array().map(Vec::len), Some(1));
    }
    let file = klems("Reflection Back", 0.1);
    std::fs::write(folder.path().join("f07-one-sided.xml"), file).expect("written");
    let import = json(folder.path(), &["import", "f07-one-sided.xml"]);
    let said = import["warnings"][0].as_str().expect("a warning");
    assert!(said.contains("nothing is given for light from the inner side"), "{said}");
}

#[test]
fn names_that_steer_the_terminal_are_refused_or_escaped() {
    let folder = findings(&["study-control.toml", "tiny.toml"]);
    let at = folder.path();
    let words = "factors[1].name: expected text without control characters";
    refused(at, &["study", "study-control.toml", "--out", "r"], words);
    let tiny = std::fs::read_to_string(at.join("tiny.toml")).expect("text");
    let dark = tiny.replace("Tiny stepped", "Tiny \\u001b[31m");
    std::fs::write(at.join("dark.toml"), dark).expect("written");
    for command in ["check", "run"] {
        let words = "description: expected text without control characters, got \"Tiny \\u{1b}[31m";
        refused(at, &[command, "dark.toml"], words);
    }
    let grating = std::fs::read_to_string(workspace().join("tests/bad_input/grating.json"));
    let grating = grating.expect("text").replace("\"pol\"", "\"a\\u0007\": 1, \"pol\"");
    std::fs::write(at.join("grating.json"), grating).expect("written");
    refused(at, &["grating", "grating.json"], "expected text without control characters");
    // A file of that name is shown without its effect.
    refused(at, &["check", "a\u{1b}[31m.toml"], "a\\u001b[31m.toml");
    std::fs::write(at.join("b\u{1b}[2J.toml"), "name = 3").expect("written");
    refused(at, &["check", "b\u{1b}[2J.toml"], "b\\u001b[2J.toml");
    let out = "r\nrm -rf x";
    refused(at, &["run", "tiny.toml", "--out", out], "path of results: expected text without");
    let submit = ["submit", "--slurm", "--", "run", "tiny.toml", "--out", out];
    refused(at, &submit, "control characters");
    assert!(!at.join(out).exists());
}
