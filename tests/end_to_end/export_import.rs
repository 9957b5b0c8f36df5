// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing export` and `batwing import`, and designs that take bands, mirror and source from
//! files.

use std::path::{Path, PathBuf};

use crate::support::binary::{batwing, json};
use batwing_tests::{read, tables::smooth};
use bsdf::formats::native;
use bsdf::{Grid, OrderTable};

fn table() -> OrderTable {
    smooth(2.75, 8, Grid::ky_nodes(1.41, 1.0, 40))
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a directory");
    let path = folder.path().to_path_buf();
    let mut bytes = Vec::new();
    native::write(&table(), &mut bytes).expect("written");
    std::fs::write(path.join("smooth.bworders"), bytes).expect("written");
    (folder, path)
}

/// Runs and returns the one line of complaint.
fn complaint(at: &Path, arguments: &[&str]) -> String {
    let output = batwing(at).args(arguments).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    assert!(!output.status.success(), "{arguments:?} succeeds");
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

#[test]
fn a_table_goes_into_every_format_and_comes_back_with_its_energy() {
    let (_keep, at) = folder();
    for (format, out, read) in [
        ("json", "t.json", "t.json"),
        ("npz", "t.npz", "t.npz"),
        ("klems", "k.xml", "k.xml"),
        ("tensortree", "t.xml", "t.xml"),
        ("lighttools", "l.bsdf", "l.bsdf"),
        ("zemax", "z.bsdf", "z-inner-brdf.bsdf"),
    ] {
        let export = [
            "export",
            "smooth.bworders",
            "--format",
            format,
            "--out",
            out,
        ];
        let coarse = ["--scatter-step", "3", "--samples", "8", "--tree-log2", "3"];
        let said = json(&at, &[&export[..], &coarse[..]].concat());
        for file in said["files"].as_array().into_iter().flatten() {
            let worst = file["worst_energy_difference"].as_f64().expect("a number");
            assert!(worst < 1e-3, "{format}: {worst}");
            assert!(file["cell_width_deg"].as_f64().expect("a width") >= 3.0);
            assert!(!file["incidences"].as_array().expect("a list").is_empty());
        }
        let back = json(&at, &["import", read]);
        if let Some(most) = back["most_power"].as_f64() {
            assert!((most - 1.0).abs() < 2e-3, "{format}: {most}");
        } else {
            assert_eq!(back["nodes"], table().node_count(), "{format}");
        }
    }
    // Between formats of others, by way of cells.
    let out = [
        "import",
        "l.bsdf",
        "--format",
        "klems",
        "--out",
        "again.xml",
    ];
    let said = json(&at, &[&out[..], &["--index-inner", "1.41"]].concat());
    let worst = said["files"][0]["worst_energy_difference"].as_f64();
    assert!(worst.expect("a number") < 1e-6);
}

/// Extraction and uniformity with their errors, of the one model run.
fn figures(at: &Path, design: &str, model: &str) -> [[f64; 2]; 2] {
    let arguments = [
        "run", design, "--model", model, "--paths", "200000", "--out", "r",
    ];
    let said = json(at, &arguments);
    let models = said["designs"][design.trim_end_matches(".toml")].clone();
    let models = models.as_object().expect("models");
    let one = models.values().next().expect("a model").clone();
    ["extraction_efficiency", "uniformity"].map(|key| {
        let figure = &one[key];
        [figure["value"].clone(), figure["standard_error"].clone()]
            .map(|v| v.as_f64().expect("a number"))
    })
}

fn agree([a, ea]: [f64; 2], [b, eb]: [f64; 2], more: f64) -> bool {
    (a - b).abs() < 5.0 * ea.hypot(eb) + more
}

/// The bare dome under another name.
fn bare(name: &str) -> String {
    let bare = read("data/designs/bare-dome.toml");
    let line = bare
        .lines()
        .find(|l| l.starts_with("name"))
        .expect("a name");
    bare.replace(line, &format!("name = \"{name}\""))
}

fn write(at: &Path, name: &str, text: &str) {
    std::fs::write(at.join(name), text).expect("written");
}

#[test]
fn bands_of_a_smooth_interface_are_the_bare_dome() {
    let (_keep, at) = folder();
    let d1 = read("data/designs/d1.toml").replace("name = \"D1\"", "name = \"bands\"");
    let files = "\n[[files.bands]]\nfrom = 1\nto = 17\nfile = \"smooth.bworders\"\n";
    write(&at, "bands.toml", &format!("{d1}{files}"));
    write(&at, "bare.toml", &bare("bare"));
    let banded = figures(&at, "bands.toml", "hybrid");
    let smooth = figures(&at, "bare.toml", "geometric");
    for (a, b) in banded.into_iter().zip(smooth) {
        assert!(agree(a, b, 2e-3), "{a:?} {b:?}");
    }
}

#[test]
fn a_cosine_from_a_file_is_the_lambertian_source() {
    let (_keep, at) = folder();
    let cosine: Vec<String> = (0..=90)
        .map(|t| format!("{:.6}", f64::from(t).to_radians().cos()))
        .collect();
    let angles: Vec<String> = (0..=90).map(|t| t.to_string()).collect();
    let text = format!(
        "IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 -1 1 91 1 1 2 0 0 0\n1 1 1\n{}\n0\n{}\n",
        angles.join("\n"),
        cosine.join("\n")
    );
    write(&at, "cosine.ies", &text);
    let source = "\n[files.source]\nfile = \"cosine.ies\"\n";
    write(&at, "lit.toml", &format!("{}{source}", bare("lit")));
    write(&at, "bare.toml", &bare("bare"));
    let lit = figures(&at, "lit.toml", "geometric");
    let own = figures(&at, "bare.toml", "geometric");
    assert!(agree(lit[0], own[0], 2e-4), "{lit:?} {own:?}");

    // Rays that leave, written and counted.
    let rays = [
        "export",
        "lit.toml",
        "--format",
        "tm25",
        "--paths",
        "100000",
        "--out",
        "r.tm25ray",
    ];
    let said = json(&at, &rays);
    let [flux, escaped] = ["flux_w", "escaped_w"].map(|k| said[k].as_f64().expect("a number"));
    assert!((flux - escaped).abs() < 1e-6 && flux > 0.9);
    // They lie around the package, not on the LED: as its source they are refused.
    let wrong = "\n[files.source]\nfile = \"r.tm25ray\"\n";
    write(&at, "wrong.toml", &format!("{}{wrong}", bare("wrong")));
    let run = ["run", "wrong.toml", "--paths", "10000", "--out", "r"];
    let text = complaint(&at, &run);
    assert!(text.contains("source 'LED'"), "{text}");
}

#[test]
fn a_white_table_from_a_file_is_the_lambertian_reflector() {
    let (_keep, at) = folder();
    let value = 0.8 / std::f64::consts::PI;
    let tree = read("tests/formats/corpus/small.isotropic.xml");
    let (start, end) = (
        tree.find('{').expect("a tree"),
        tree.rfind('}').expect("a tree"),
    );
    let paint = format!("{}{{ {value} }}{}", &tree[..start], &tree[end + 1..]);
    write(
        &at,
        "paint.xml",
        &paint.replace("Reflection Front", "Reflection Back"),
    );
    let design = bare("matt");
    let line = |key: &str| {
        let line = design.lines().find(|l| l.starts_with(key));
        line.expect("a key").to_owned()
    };
    let matt = design
        .replacen(&line("kind"), "kind = \"lambertian\"", 1)
        .replacen(&line("reflectance"), "reflectance = 0.8", 1);
    write(&at, "matt.toml", &matt);
    let files = "\n[files.mirror]\nfile = \"paint.xml\"\n";
    write(&at, "painted.toml", &format!("{}{files}", bare("painted")));
    let matt = figures(&at, "matt.toml", "geometric");
    let painted = figures(&at, "painted.toml", "geometric");
    for (a, b) in matt.into_iter().zip(painted) {
        assert!(agree(a, b, 0.0), "{a:?} {b:?}");
    }
}
