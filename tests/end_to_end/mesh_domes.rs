// SPDX-License-Identifier: MIT OR Apache-2.0
//! Domes given by a mesh, hexagonal arrays, arrays from a file, and `batwing rays`.
//!
//! Sources: the same dome as an exact shape, which the mesh follows to a tenth of a micrometre;
//! geometry for the arrays.

use std::path::Path;

use glam::DVec3;
use serde_json::Value;
use tempfile::tempdir;

use formats::{obj, stl};
use simulate::bodies::bodies;

use crate::support::binary::batwing;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/designs");

/// The dome of the bare package by its sphere.
const SPHERE: &str = "sphere_radius_mm = 2.0\nheight_mm = 1.0\nwidth_mm = 3.4\n";

fn bare() -> String {
    std::fs::read_to_string(Path::new(FOLDER).join("bare-dome.toml")).expect("the design")
}

/// The bare dome as a solid, in an STL file in millimetres and an OBJ file in inches.
fn write_meshes(folder: &Path, error_mm: f64) {
    let design = design::load(&Path::new(FOLDER).join("bare-dome.toml")).expect("valid");
    let mut dome = bodies(&design, error_mm).expect("a mesh");
    dome.truncate(1);
    let mut bytes = Vec::new();
    stl::write(&dome, "dome", &mut bytes).expect("written");
    std::fs::write(folder.join("dome.stl"), bytes).expect("written");
    for vertex in &mut dome[0].vertices {
        *vertex = vertex.map(|v| v / 25.4);
    }
    let mut bytes = Vec::new();
    obj::write(&dome, "dome", &mut bytes).expect("written");
    std::fs::write(folder.join("dome.obj"), bytes).expect("written");
}

fn figures(folder: &Path, name: &str, text: &str) -> Value {
    std::fs::write(folder.join(name), text).expect("written");
    let output = batwing(folder)
        .args(["run", name, "--paths", "60000", "--quiet", "--out", "out"])
        .output()
        .expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let bytes = std::fs::read(folder.join("out/results.json")).expect("results");
    let results: Value = serde_json::from_slice(&bytes).expect("JSON");
    results["designs"]["bare-dome"]["geometric"].clone()
}

fn refused(folder: &Path, text: &str, says: &[&str]) {
    std::fs::write(folder.join("bad.toml"), text).expect("written");
    let output = batwing(folder).args(["check", "bad.toml"]).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{text}");
    for word in says {
        assert!(stderr.contains(word), "{stderr} lacks {word}");
    }
}

fn with_mesh(file: &str, unit: &str) -> String {
    let text = bare();
    assert!(text.contains(SPHERE));
    text.replace(SPHERE, &format!("mesh = \"{file}\"\nmesh_unit = \"{unit}\"\n"))
}

/// The measures of a mesh are its own.
#[test]
fn a_mesh_alone_says_how_high_and_wide_the_dome_is() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    write_meshes(at, 1e-3);
    let load = |text: &str| {
        std::fs::write(at.join("mesh.toml"), text).expect("written");
        design::load(&at.join("mesh.toml"))
    };
    for (file, unit, scale) in
        [("dome.stl", "mm", 1.0), ("dome.obj", "inch", 1.0), ("dome.stl", "inch", 25.4)]
    {
        let (pitch, plane, margin) = (8.3 * scale, 3.0 * scale, 4.75 * scale);
        let text = with_mesh(file, unit)
            .replace("pitch_mm = 8.3", &format!("pitch_mm = {pitch}"))
            .replace("bin_mm = 0.1 ", "bin_mm = 2.0 ")
            .replace("smoothing_sigma_mm = 0.1", "smoothing_sigma_mm = 0.0")
            .replace("margin_mm = 4.75", &format!("margin_mm = {margin}"));
        let high = |plane: f64| {
            text.replace("plane_height_mm = 3.0", &format!("plane_height_mm = {plane}"))
        };
        let design = load(&high(plane)).expect("valid");
        let dome = design.dome.as_ref().expect("a dome");
        // Corners lie on the curve: the pole and the rim are met to the rounding of the file.
        assert!((dome.height_mm() / scale - 1.0).abs() < 1e-6, "{dome:?}");
        assert!((dome.radius_mm() / scale - 1.7).abs() < 1e-6, "{dome:?}");
        assert!((design.package_width_mm() - 2.0 * dome.radius_mm()).abs() < 1e-12);
        let json = serde_json::to_value(&design).expect("JSON");
        assert!(json["dome"].get("sphere_radius_mm").is_none(), "{json}");
        let said = load(&high(0.99 * scale)).expect_err("a plane in the dome");
        let said = said.to_string();
        assert!(
            said.contains("receiver.plane_height_mm") && said.contains("above the package"),
            "{said}"
        );
        let near = high(plane)
            .replace(&format!("pitch_mm = {pitch}"), &format!("pitch_mm = {}", 3.3 * scale));
        let said = load(&near).expect_err("packages in each other").to_string();
        assert!(said.contains("array.pitch_mm") && said.contains("width of a package"), "{said}");
    }
    // A box that is too wide for the mesh, and one that holds all of it.
    for [size, height] in [["3.0, 1.0", "0.35"], ["3.6, 3.6", "1.2"], ["1.0, 1.0", "0.95"]] {
        let text = with_mesh("dome.stl", "mm")
            .replace("size_mm = [1.0, 1.0]", &format!("size_mm = [{size}]"))
            .replace("height_mm = 0.35", &format!("height_mm = {height}"));
        let said = load(&text).expect_err("a box that is not inside").to_string();
        assert!(said.contains("led.") && said.contains("inside the dome"), "{said}");
    }
    for key in ["sphere_radius_mm = 2.0", "height_mm = 1.0", "width_mm = 3.4"] {
        let name = key.split(' ').next().unwrap_or_default();
        let says = format!(
            "dome.{name}: no such key for \"mesh\", expected one of mesh, mesh_unit, smooth_deg"
        );
        let beside = with_mesh("dome.stl", "mm").replace("mesh_unit", &format!("{key}\nmesh_unit"));
        refused(at, &beside, &[&says]);
    }
    let unit = bare().replace(SPHERE, &format!("{SPHERE}mesh_unit = \"mm\"\n"));
    refused(at, &unit, &["dome.mesh_unit: no such key for \"sphere\""]);
}

#[test]
#[ignore = "slow: 4 s"]
fn a_dome_from_a_file_emits_as_the_exact_one() {
    let folder = tempdir().expect("a folder");
    write_meshes(folder.path(), 1e-4);
    let exact = figures(folder.path(), "exact.toml", &bare());
    for (file, unit) in [("dome.stl", "mm"), ("dome.obj", "inch")] {
        let mesh = figures(folder.path(), "mesh.toml", &with_mesh(file, unit));
        for key in ["extraction_efficiency", "uniformity"] {
            let [a, b] = [&mesh, &exact].map(|f| {
                let number = |name: &str| f[key][name].as_f64().expect("a number");
                [number("value"), number("standard_error")]
            });
            assert!((a[0] - b[0]).abs() < 5.0 * a[1].hypot(b[1]), "{file} {key}: {a:?} {b:?}");
        }
        for (name, entry) in mesh["power_ledger"].as_object().expect("a ledger") {
            if name.starts_with("lost") {
                assert!(entry["value"].as_f64().expect("a number") < 1e-9, "{name}");
            }
        }
    }
}

#[test]
fn open_inverted_and_short_meshes_are_refused() {
    let folder = tempdir().expect("a folder");
    write_meshes(folder.path(), 1e-2);
    let at = folder.path();
    let whole = std::fs::read(at.join("dome.stl")).expect("bytes");

    // One triangle less: a hole, named by its edge.
    let mut open = whole[..whole.len() - 50].to_vec();
    let count = u32::from_le_bytes([open[80], open[81], open[82], open[83]]) - 1;
    open[80..84].copy_from_slice(&count.to_le_bytes());
    std::fs::write(at.join("open.stl"), open).expect("written");
    refused(at, &with_mesh("open.stl", "mm"), &["bad.toml", "open.stl", "open edge of triangle"]);

    // One with two corners exchanged.
    let mut turned = whole.clone();
    let corners = 84 + 12;
    let first: Vec<u8> = turned[corners..corners + 12].to_vec();
    turned.copy_within(corners + 12..corners + 24, corners);
    turned[corners + 12..corners + 24].copy_from_slice(&first);
    std::fs::write(at.join("turned.stl"), turned).expect("written");
    refused(at, &with_mesh("turned.stl", "mm"), &["inverted"]);

    std::fs::write(at.join("short.stl"), &whole[..whole.len() - 7]).expect("written");
    refused(at, &with_mesh("short.stl", "mm"), &["short.stl", "bytes"]);
}

/// STL as text, OBJ with polygons and relative numbers.
#[test]
fn readers_take_every_notation() {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid a\n";
    let expected = vec![[DVec3::ZERO, DVec3::X * 10.0, DVec3::Y * 10.0]];
    assert_eq!(stl::read(text.as_bytes(), 10.0).expect("a triangle"), expected);
    assert!(stl::read(text.replace("vertex 1 0 0\n", "").as_bytes(), 1.0).is_err());
    assert!(stl::read(text.replace("1e0", "one").as_bytes(), 1.0).is_err());
    assert!(stl::read(b"nothing", 1.0).is_err());
    let capitals = text.to_uppercase().replace("1E0", "1e0");
    let capitals = stl::read(capitals.as_bytes(), 10.0);
    assert_eq!(capitals.expect("a triangle"), expected);
    for end in ["endsolid", "endfacet", "endloop"] {
        let cut = &text[..text.rfind(end).expect("an end")];
        let wrong = stl::read(cut.as_bytes(), 1.0).expect_err("cut").to_string();
        let said = "STL: expected `endsolid` on the last line";
        assert!(wrong.starts_with(said) && wrong.ends_with("the file was cut off"), "{wrong}");
    }

    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf -4//1 -3//1 3/2/1 4\n";
    let found = obj::read(square.as_bytes(), 1.0).expect("a square");
    assert_eq!(found.len(), 2);
    assert_eq!(found[1], [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]);
    for bad in
        ["v 0 0\n", "v 0 0 0\nf 1 1 9\n", "v 0 0 0\nf 0 1 1\n", "v 0 0 0\nf 1 1\n", "curv 0 1 1\n"]
    {
        assert!(obj::read(bad.as_bytes(), 1.0).is_err(), "{bad}");
    }
}

#[test]
fn arrays_of_any_arrangement() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let load = |text: &str| {
        std::fs::write(at.join("array.toml"), text).expect("written");
        design::load(&at.join("array.toml")).expect("valid")
    };
    let array = "columns = 2\nrows = 2\npitch_mm = 8.3\n";
    let hexagonal = "columns = 5\nrows = 4\npitch_mm = 8.0\narrangement = \"hexagonal\"\n";
    let hexagonal = bare().replace(array, hexagonal);
    let axes = load(&hexagonal).array.axes_mm();
    assert_eq!(axes.len(), 20);
    let near = |a: [f64; 2]| {
        let distance = |b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        axes.iter().filter(|b| (distance(b) - 8.0).abs() < 1e-9).count()
    };
    // Six neighbours within, and the middle of all at the origin.
    assert_eq!(near(axes[7]), 6);
    assert_eq!(near(axes[0]), 2);
    let sum = axes.iter().fold([0.0; 2], |s, a| [s[0] + a[0], s[1] + a[1]]);
    assert!(sum[0].abs() + sum[1].abs() < 1e-9, "{sum:?}");

    // The same places by a file are the same light, to the last bit but for the order of the axes.
    let lines: Vec<String> = axes.iter().map(|[x, y]| format!("{x:?}, {y:?}")).collect();
    let lines = lines.join("\n");
    std::fs::write(at.join("places.csv"), format!("x_mm, y_mm\n{lines}")).expect("written");
    let by_file = "positions_file = \"places.csv\"\npitch_mm = 7.9999\n";
    let by_file = bare().replace(array, by_file);
    assert_eq!(load(&by_file).array.axes_mm(), axes);
    let coarse = |text: &str| text.replace("bin_mm = 0.1 ", "bin_mm = 0.2 ");
    let a = figures(at, "hexagonal.toml", &coarse(&hexagonal));
    let b = figures(at, "places.toml", &coarse(&by_file));
    // Neighbours are known in both, so that there is a valley between them.
    assert!(a["uniformity"]["value"].is_number() && b["extraction_efficiency"].is_object());
    let extraction = |f: &Value| {
        let number = |name: &str| f["extraction_efficiency"][name].as_f64().expect("a number");
        [number("value"), number("standard_error")]
    };
    let (a, b) = (extraction(&a), extraction(&b));
    assert!((a[0] - b[0]).abs() < 5.0 * a[1].hypot(b[1]), "{a:?} {b:?}");

    refused(at, &by_file.replace("7.9999", "8.1"), &["places.csv", "array.pitch_mm", "lines"]);
    let both = by_file.replace("positions_file", "columns = 2\npositions_file");
    refused(at, &both, &["array.positions_file", "columns"]);
    refused(at, &by_file.replace("places", "nowhere"), &["nowhere.csv"]);
    for (text, words) in [
        ("x_mm y_mm tilt_deg\n0 0 1\n", "line 1: expected numbers, or names of columns"),
        ("0 0 1 2 3\n", "line 1: expected 2 numbers in all lines (x_mm, y_mm), got 5"),
    ] {
        std::fs::write(at.join("places.csv"), text).expect("written");
        refused(at, &by_file, &["array.positions_file", "places.csv", words]);
    }
}

#[test]
fn rays_are_drawn_and_listed() {
    let folder = tempdir().expect("a folder");
    let design = Path::new(FOLDER).join("d1.toml");
    let run = |out: &str| {
        let output = batwing(folder.path())
            .arg("rays")
            .arg(&design)
            .args(["--count", "80", "--json", "--out", out])
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let file = |ending: &str| {
            let name = format!("{out}/D1-geometric_100um-rays.{ending}");
            std::fs::read_to_string(folder.path().join(name)).expect("written")
        };
        (said, file("svg"), file("json"))
    };
    let (said, picture, json) = run("a");
    let whole: Value = serde_json::from_str(&json).expect("JSON");
    let paths = whole["paths"].as_array().expect("paths");
    assert_eq!(paths.len(), 80);
    assert_eq!(whole["fates"], said["fates"]);
    let counted: u64 =
        said["fates"].as_object().expect("fates").values().filter_map(Value::as_u64).sum();
    assert_eq!(counted, 80);
    // A trail for each path, one line of legend for each fate that occurs.
    assert_eq!(picture.matches("stroke-opacity").count(), 80);
    assert!(picture.starts_with("<svg ") && picture.trim_end().ends_with("</svg>"));
    let again = run("b");
    assert_eq!((picture, json), (again.1, again.2));

    let refusal = |arguments: &[&str], says: &str| {
        let output = batwing(folder.path()).arg("rays").args(arguments).output().expect("it runs");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && stderr.contains(says), "{stderr}");
    };
    let design = design.to_str().expect("a path");
    refusal(&[design, "--model", "all"], "--model");
    refusal(&[design, "--count", "0"], "--count");
    refusal(&["nowhere.toml"], "nowhere.toml");
}
