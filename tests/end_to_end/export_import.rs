// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing export` and `batwing import`, and designs that take bands, mirror and source from
//! files.

use std::path::{Path, PathBuf};

use crate::support::binary::{batwing, json};
use batwing_tests::{read, tables::smooth};
use bsdf::native;
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
        ("speos", "s.anisotropicbsdf", "s-outer.anisotropicbsdf"),
    ] {
        let export = ["export", "smooth.bworders", "--format", format, "--out", out];
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
    let out = ["import", "l.bsdf", "--format", "klems", "--out", "again.xml"];
    let said = json(&at, &[&out[..], &["--index-inner", "1.41"]].concat());
    let worst = said["files"][0]["worst_energy_difference"].as_f64();
    assert!(worst.expect("a number") < 1e-6);
}

/// A file of the corpus in `at`.
fn copied(at: &Path, name: &str) {
    let from = batwing_tests::workspace().join("tests/formats/corpus");
    std::fs::copy(from.join(name), at.join(name)).expect("copied");
}

#[test]
fn the_ending_of_out_is_the_format() {
    let (_keep, at) = folder();
    for (from, out) in [("smooth.bworders", "a.npz"), ("a.npz", "b.json"), ("b.json", "c.NPZ")] {
        json(&at, &["import", from, "--out", out]);
        json(&at, &["export", from, "--out", &format!("export-{out}")]);
    }
    let bytes = |name: &str| std::fs::read(at.join(name)).expect("a file");
    assert_eq!(bytes("export-a.npz"), bytes("a.npz"));
    let back = json(&at, &["import", "c.NPZ"]);
    assert_eq!(back["nodes"], table().node_count());
}

#[test]
fn far_fields_keep_names_and_flux_there_and_back() {
    let (_keep, at) = folder();
    let ies = "IESNA:LM-63-95\r\n[TEST] R 12\r\n[MANUFAC] Maker & Co\r\n[LUMCAT] 47-11\r\n[LUMINAIRE] Lamp, white\r\n[LAMP] two LEDs\r\n\
               TILT=NONE\r\n1 500 1 3 1 1 2 0 0 0\r\n1 1 5\r\n0 45 90\r\n0\r\n100 70 0\r\n";
    write(&at, "a.ies", ies);
    let flux = json(&at, &["import", "a.ies"])["flux_lm"].clone();
    for (from, out) in [("a.ies", "b.ldt"), ("b.ldt", "c.ies"), ("c.ies", "d.ldt")] {
        json(&at, &["import", from, "--out", out]);
        let now = json(&at, &["import", out]);
        let [a, b] = [&flux, &now["flux_lm"]].map(|f| f.as_f64().expect("a flux"));
        assert!((a / b - 1.0).abs() < 1e-6, "{out}: {a} {b}");
        assert_eq!(now["lamps_lm"], 500.0, "{out}");
    }
    let text = |name: &str| std::fs::read_to_string(at.join(name)).expect("a text");
    for line in [
        "[TEST] R 12\r\n",
        "[MANUFAC] Maker & Co\r\n",
        "[LUMCAT] 47-11\r\n",
        "[LUMINAIRE] Lamp, white\r\n",
        "[LAMP] two LEDs\r\n",
    ] {
        assert!(text("c.ies").contains(line), "{line}");
    }
    assert_eq!(text("b.ldt"), text("d.ldt"));
    // Where a file names no luminaire, its own name is taken, not its path.
    write(&at, "e.ies", &ies.replace("[LUMINAIRE] Lamp, white\r\n", ""));
    json(&at, &["import", "./e.ies", "--out", "e.ldt"]);
    assert_eq!(text("e.ldt").lines().nth(8), Some("e"));
}

#[test]
fn rays_pass_through_every_format_that_has_room_for_them() {
    let (_keep, at) = folder();
    for name in ["small.speos.ray", "colour.sdf", "lumens.dat", "plain.ray"] {
        copied(&at, name);
    }
    let figures = |name: &str| {
        let said = json(&at, &["import", name]);
        let flux = said["flux"].as_f64().expect("a flux");
        (said["rays"].clone(), flux, said["unit"].clone(), said["wavelengths_nm"].clone())
    };
    for (from, format, out) in [
        ("small.speos.ray", "zemax-ray", "a.sdf"),
        ("a.sdf", "speos-ray", "b.ray"),
        ("colour.sdf", "speos-ray", "c.ray"),
        ("lumens.dat", "zemax-ray", "d.dat"),
        ("plain.ray", "tm25", "e.tm25ray"),
        ("small.speos.ray", "tm25", "k.tm25ray"),
        ("k.tm25ray", "zemax-ray", "k.sdf"),
        ("plain.ray", "zemax-ray", "e.dat"),
        ("e.dat", "ray", "f.ray"),
        ("small.speos.ray", "ray", "g.ray"),
        ("small.speos.ray", "ray-text", "h.txt"),
        ("lumens.dat", "ray-text", "i.ray"),
        ("colour.sdf", "zemax-ray-text", "j.txt"),
    ] {
        json(&at, &["import", from, "--format", format, "--out", out]);
        let (a, b) = (figures(from), figures(out));
        assert_eq!((&a.0, &a.2), (&b.0, &b.2), "{out}");
        assert!((a.1 / b.1 - 1.0).abs() < 1e-6, "{out}");
        match (a.3.as_array(), b.3.as_array()) {
            (Some(a), Some(b)) => {
                for (a, b) in a.iter().zip(b) {
                    let [a, b] = [a, b].map(|v| v.as_f64().expect("a wavelength"));
                    assert!((a - b).abs() < 1e-2, "{out}: {a} {b}");
                }
            }
            (a, b) => assert_eq!(a, b, "{out}"),
        }
    }
    for (from, format, out, expected) in [
        ("small.speos.ray", "zemax-ray", "x.dat", "expected a file that ends in .sdf"),
        (
            "lumens.dat",
            "tm25",
            "x.tm25ray",
            "got lm, which is written into LightTools, LightTools text and Zemax ray files alone",
        ),
        ("plain.ray", "speos-ray", "x.ray", "expected a wavelength for every ray, got NaN"),
    ] {
        let got = complaint(&at, &["import", from, "--format", format, "--out", out]);
        assert!(got.contains(expected) && got.contains(from), "{got}");
        assert!(!at.join(out).exists(), "{out}");
    }
}

/// Extraction and uniformity with their errors, of the one model run.
fn figures(at: &Path, design: &str, model: &str) -> [[f64; 2]; 2] {
    let arguments = ["run", design, "--model", model, "--paths", "200000", "--out", "r"];
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
    let line = bare.lines().find(|l| l.starts_with("name")).expect("a name");
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
    let cosine: Vec<String> =
        (0..=90).map(|t| format!("{:.6}", f64::from(t).to_radians().cos())).collect();
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
    let rays =
        ["export", "lit.toml", "--format", "tm25", "--paths", "100000", "--out", "r.tm25ray"];
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
    let (start, end) = (tree.find('{').expect("a tree"), tree.rfind('}').expect("a tree"));
    let paint = format!("{}{{ {value} }}{}", &tree[..start], &tree[end + 1..]);
    write(&at, "paint.xml", &paint.replace("Reflection Front", "Reflection Back"));
    let design = bare("matt");
    let line = |key: &str| {
        let line = design.lines().find(|l| l.starts_with(key));
        line.expect("a key").to_owned()
    };
    let matt = design.replacen(&line("kind"), "kind = \"lambertian\"", 1).replacen(
        &line("reflectance"),
        "reflectance = 0.8",
        1,
    );
    write(&at, "matt.toml", &matt);
    let files = "\n[files.mirror]\nfile = \"paint.xml\"\n";
    write(&at, "painted.toml", &format!("{}{files}", bare("painted")));
    let matt = figures(&at, "matt.toml", "geometric");
    let painted = figures(&at, "painted.toml", "geometric");
    // The same as a Speos file: 80 % of the light, in all directions alike.
    let speos = "OPTIS - brdf surface file v8.0\n0\n\n0\n\n1\t0\n1\n2\t1\n0 60\n550\n80\n2 2\n\t0 360\n0 1 1\n90 1 1\n80\n2 2\n\t0 360\n0 1 1\n90 1 1\n";
    write(&at, "paint.brdf", speos);
    let files = "\n[files.mirror]\nfile = \"paint.brdf\"\n";
    write(&at, "speos.toml", &format!("{}{files}", bare("speos")));
    let speos = figures(&at, "speos.toml", "geometric");
    for (a, b) in painted.into_iter().zip(speos) {
        assert!(agree(a, b, 0.0), "{a:?} {b:?}");
    }
    for (a, b) in matt.into_iter().zip(painted) {
        assert!(agree(a, b, 0.0), "{a:?} {b:?}");
    }
}

#[test]
fn geometry_of_a_design_holds_its_solids() {
    let (_keep, at) = folder();
    let from = batwing_tests::workspace().join("data/designs/solids.toml");
    std::fs::copy(from, at.join("solids.toml")).expect("copied");
    let names = |said: &serde_json::Value, key: &str, of: &str| -> Vec<String> {
        let all = said[key].as_array().expect("a list").iter();
        let name = |one: &serde_json::Value| one.get(of).unwrap_or(one).as_str().map(str::to_owned);
        all.map(|one| name(one).expect("a name")).collect()
    };
    let export = |out: &str| json(&at, &["export", "solids.toml", "--out", out]);

    let step = export("s.step");
    let copies = |name: &str| {
        let bodies = step["bodies"].as_array().expect("a list");
        bodies.iter().find(|body| body["body"] == name).expect("the body")["copies"].clone()
    };
    for name in ["dome", "led", "phosphor", "bubble", "baffle", "lens"] {
        assert_eq!(copies(name), 4, "{name}");
    }
    for name in ["plate", "pipe", "fence", "mirror"] {
        assert_eq!(copies(name), 1, "{name}");
    }
    let text = read(at.join("s.step"));
    assert_eq!(text.matches("=NEXT_ASSEMBLY_USAGE_OCCURRENCE(").count(), 28);
    assert_eq!(text.matches("=MANIFOLD_SOLID_BREP(").count(), 8);
    assert_eq!(text.matches("=OPEN_SHELL(").count(), 2);
    export("again.stp");
    assert_eq!(text, read(at.join("again.stp")));

    let stl = export("s.stl");
    assert_eq!(names(&stl, "bodies", "body"), ["dome", "phosphor", "bubble", "lens"]);
    assert_eq!(names(&stl, "left_out", ""), ["baffle", "plate", "pipe", "fence"]);
    let volume = |k: usize| stl["bodies"][k]["volume_mm3"].as_f64().expect("a volume");
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.06_f64.powi(3);
    assert!((volume(1) / (1.6 * 1.6 * 0.6) - 1.0).abs() < 1e-12, "{}", volume(1));
    assert!((0.0..0.05).contains(&(1.0 - volume(2) / ball)), "{} {ball}", volume(2));
    let obj = export("s.obj");
    assert_eq!(names(&obj, "bodies", "body"), ["dome", "led", "phosphor", "bubble", "lens"]);
    // The ball stands where the design puts it.
    let text = read(at.join("s.obj"));
    let ball = text.split("o bubble\n").nth(1).and_then(|rest| rest.split("o lens").next());
    let top = ball.expect("the ball").lines().filter_map(|line| line.strip_prefix("v "));
    let top = top.filter_map(|v| v.split(' ').nth(2)?.parse().ok()).fold(0.0, f64::max);
    assert!((top - 0.53).abs() < 1e-9, "{top}");

    let dxf = export("s.dxf");
    let others = ["phosphor", "bubble", "baffle", "plate", "pipe", "fence"];
    assert_eq!(names(&dxf, "left_out", ""), others);
    let text = read(at.join("s.dxf"));
    // The lens: an arc and two lines, from its place up.
    assert_eq!(text.matches("\n8\nSOLID_LENS\n").count(), 3);
    assert!(text.contains("\n8\nSOLID_LENS\n10\n2.000000000\n20\n1.800000000\n"), "{text}");
    export("s.svg");
    assert_eq!(read(at.join("s.svg")).matches("<g id=\"SOLID_LENS\">").count(), 1);

    // A dome of the triangles that were written.
    let bare = read(batwing_tests::workspace().join("data/designs/bare-dome.toml"));
    std::fs::write(at.join("bare.toml"), &bare).expect("written");
    let said = json(&at, &["export", "bare.toml", "--out", "dome.stl", "--chord-error", "20"]);
    let sphere = "sphere_radius_mm = 2.0\nheight_mm = 1.0\nwidth_mm = 3.4\n";
    let meshed = bare.replace(sphere, "mesh = \"dome.stl\"\nmesh_unit = \"mm\"\n");
    assert_ne!(meshed, bare);
    std::fs::write(at.join("mesh.toml"), meshed).expect("written");
    json(&at, &["export", "mesh.toml", "--out", "mesh.step"]);
    let triangles = said["bodies"][0]["triangles"].as_u64().expect("a number") as usize;
    let faces = read(at.join("mesh.step")).matches("=ADVANCED_FACE(").count();
    // Those of the box, and the mirror under the array.
    let mirror = usize::from(bare.contains("extent = \"array\""));
    assert_eq!(faces, triangles + 6 + mirror);
    assert!(
        complaint(&at, &["export", "mesh.toml", "--out", "m.dxf"]).contains("generating curve")
    );
}

/// Flux at every wavelength, in nm, of rays as text for Zemax.
fn flux_by_wavelength(text: &str) -> std::collections::BTreeMap<u32, f64> {
    let mut flux = std::collections::BTreeMap::new();
    for line in text.lines().skip(1) {
        let row: Vec<f64> =
            line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
        *flux.entry((1e3 * row[7]).round() as u32).or_default() += row[6];
    }
    flux
}

#[test]
fn white_ray_sets_have_a_wavelength_for_each_ray_in_every_format() {
    let (_keep, at) = folder();
    let lines = "spectrum = { kind = \"lines\", wavelength_nm = [450.0, 600.0], power = [1.0, 3.0], weighting = \"photometric\" }";
    let bare = bare("white");
    let line = bare.lines().find(|l| l.starts_with("wavelength_nm")).expect("a wavelength");
    write(&at, "white.toml", &bare.replace(line, lines));
    let mut found = Vec::new();
    for (format, out) in [
        ("tm25", "a.tm25ray"),
        ("ray", "b.ray"),
        ("ray-text", "c.txt"),
        ("zemax-ray", "d.sdf"),
        ("speos-ray", "e.ray"),
        ("zemax-ray-text", "f.txt"),
    ] {
        let export = ["export", "white.toml", "--format", format, "--paths", "60000", "--out", out];
        let said = json(&at, &export);
        let read = json(&at, &["import", out]);
        assert_eq!(read["rays"], said["rays"], "{format}");
        let [flux, written] = [&read["flux"], &said["flux_w"]].map(|v| v.as_f64().expect("W"));
        let escaped = said["escaped_w"].as_f64().expect("W");
        assert!((flux / written - 1.0).abs() < 1e-5, "{format}: {flux} {written}");
        assert!((written / escaped - 1.0).abs() < 1e-5, "{format}: {written} {escaped}");
        json(&at, &["import", out, "--format", "zemax-ray-text", "--out", "back.txt"]);
        let back = std::fs::read_to_string(at.join("back.txt")).expect("rays");
        found.push(flux_by_wavelength(&back));
    }
    // A watt of each line leaves alike, as nothing depends on the wavelength.
    let [blue, red] = [450, 600].map(|nm| found[0][&nm]);
    assert!((blue / (blue + red) - 0.25).abs() < 5e-3, "{blue} {red}");
    for other in &found {
        assert_eq!(other.len(), 2, "{other:?}");
        for (nm, flux) in other {
            assert!((flux / found[0][nm] - 1.0).abs() < 1e-5, "{other:?}");
        }
    }
    let zemax = ["export", "white.toml", "--paths", "2000", "--format", "zemax-ray"];
    let got = complaint(&at, &[&zemax[..], &["--out", "x.dat"]].concat());
    assert!(got.contains("ends in .sdf") && !at.join("x.dat").exists(), "{got}");
    let got = complaint(&at, &[&zemax[..], &["--out", "x.sdf", "--lumens", "100"]].concat());
    assert!(got.starts_with("batwing: --lumens: expected none"), "{got}");
}
