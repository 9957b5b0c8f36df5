// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]`: media by wavelength, traces that follow the content of files, pictures, examples.
//!
//! Source: `docs/reference/design-file.md`.

use std::path::Path;

use bsdf::Grid;
use bsdf::native;
use tempfile::tempdir;

use batwing_tests::tables::smooth;
use batwing_tests::tilted_box::{WEDGE, write_box};
use simulate::scene_check;

use crate::support::binary::batwing;

const DOMED: &str = include_str!("../../data/designs/bare-dome.toml");

/// The bare dome with these tables; lists in one line have to stand before its tables.
fn domed(solids: &str) -> String {
    let lines = solids.lines().filter(|line| !line.starts_with('#'));
    let (lists, tables): (Vec<&str>, Vec<&str>) = lines.partition(|line| line.contains(" = [{"));
    let lists = lists.join("\n") + "\n";
    let name = "name = \"bare-dome\"\n";
    format!("{}\n{}\n", DOMED.replacen(name, &format!("{name}{lists}"), 1), tables.join("\n"))
}

#[test]
fn media_follow_the_wavelength() {
    let folder = tempdir().expect("a folder");
    let glass =
        "DATA:\n  - type: tabulated nk\n    data: |\n        0.42 1.55 0\n        0.70 1.50 1e-6\n";
    std::fs::write(folder.path().join("glass.yml"), glass).expect("written");
    let medium = "{ material_file = \"glass.yml\", absorption_per_mm = 0.01 }";
    let solid = format!(
        "solids = [{{ name = \"a\", kind = \"box\", position_mm = [0.0, 0.0, 4.5], size_mm = [1.0, 1.0, 1.0], medium = {medium} }}]"
    );
    let design = design::parse("a.toml", &domed(&solid), folder.path()).expect("valid");
    let at = |nm: f64| {
        let tuned = design.at(nm).expect("covered");
        let medium = tuned.solids[0].medium.clone().expect("a medium");
        [medium.index, medium.absorption_per_mm]
    };
    let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9;
    assert!(close(at(420.0), [1.55, 0.01]), "{:?}", at(420.0));
    let absorbed = 0.01 + 4.0 * std::f64::consts::PI * 1e-6 / 700e-6;
    assert!(close(at(700.0), [1.5, absorbed]), "{:?}", at(700.0));
    assert!(design.at(701.0).is_err());
}

/// Tables of files are for relief in the air.
#[test]
fn relief_by_files_stays_in_the_air() {
    let folder = tempdir().expect("a folder");
    let mut bytes = Vec::new();
    let table = smooth(10.0, 4, Grid::ky_nodes(1.41, 1.0, 6));
    native::write(&table, &mut bytes).expect("written");
    std::fs::write(folder.path().join("band.bworders"), bytes).expect("written");
    let relief = include_str!("../../data/designs/d1.toml");
    let lens = "[[solids]]\nname = \"lens\"\nkind = \"cylinder\"\nposition_mm = [0.0, 0.0, 1.0]\nradius_mm = 2.5\nheight_mm = 2.0\nmedium = { index = 1.5 }\n";
    let bands = "[[files.bands]]\nfrom = 1\nto = 2\nfile = \"band.bworders\"\n";
    for (solids, wrong) in [("", false), (lens, true)] {
        let text = format!("{relief}\n{bands}{solids}");
        let design = design::parse("d1.toml", &text, folder.path()).expect("valid by itself");
        let said = scene_check::check(&design).map_or_else(|e| e.to_string(), |()| String::new());
        assert_eq!(said.contains("d1.toml: files.bands"), wrong, "{said}");
        assert_eq!(said.contains("index 1.5"), wrong, "{said}");
    }
}

/// A study keeps its traces; a mesh that changes under its name makes others.
#[test]
fn a_changed_mesh_makes_a_new_trace() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    write_box(&at.join("box.obj"), [1.0, 0.7, 0.3]);
    let mesh = format!(
        "[[solids]]\nname = \"wedge\"\nkind = \"mesh\"\nmesh = \"box.obj\"\nmesh_unit = \"mm\"\n{WEDGE}"
    );
    std::fs::write(at.join("design.toml"), domed(&mesh)).expect("written");
    let study = "name = \"small\"\ndesigns = [\"design.toml\"]\nmodels = [\"geometric\"]\npaths = 20000\n[[factors]]\nname = \"box\"\nkey = \"led.reflectance\"\nvalues = [0.5]\n";
    std::fs::write(at.join("study.toml"), study).expect("written");
    let run = || {
        let output =
            batwing(at).args(["study", "study.toml", "--out", "out"]).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        let text = std::fs::read_to_string(at.join("out/study.json")).expect("study.json");
        let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        json["setups"][0]["figures"].to_string()
    };
    let (first, again) = (run(), run());
    assert_eq!(first, again);
    write_box(&at.join("box.obj"), [1.0, 0.7, 0.2]);
    assert_ne!(first, run());
}

#[test]
fn pictures_show_solids_and_the_examples_can_be_run() {
    for name in ["solids", "potted"] {
        can_be_run(name);
    }
}

/// A design of the examples is drawn with its solids, traced, and its ledger knows them.
fn can_be_run(name: &str) {
    let folder = tempdir().expect("a folder");
    let data = batwing_tests::workspace().join("data/designs");
    let example = data.join(format!("{name}.toml"));
    let path = example.display().to_string();
    let out = folder.path().join("out");
    let out = out.display().to_string();
    for arguments in [
        &["check", &path][..],
        &["rays", &path, "--count", "50", "--out", &out],
        &["run", &path, "--paths", "20000", "--out", &out],
    ] {
        let output = batwing(folder.path()).args(arguments).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {said}");
    }
    let design = design::load(&example).expect("valid");
    let files: Vec<_> = std::fs::read_dir(&out).expect("a folder").flatten().collect();
    let svg = files
        .iter()
        .map(std::fs::DirEntry::path)
        .find(|p| p.extension().is_some_and(|e| e == "svg"));
    let svg = std::fs::read_to_string(svg.expect("a picture")).expect("text");
    // The fence stands between the rows, beside the plane of the picture.
    for solid in design.solids.iter().filter(|s| s.name() != "fence") {
        assert!(svg.contains(&format!("<title>{}</title>", solid.name())), "{}", solid.name());
    }
    let results = std::fs::read_to_string(Path::new(&out).join("results.json")).expect("results");
    let results: serde_json::Value = serde_json::from_str(&results).expect("JSON");
    let ledger = &results["designs"][name]["geometric"]["power_ledger"];
    for solid in &design.solids {
        let key = format!("absorbed_by_{}", solid.name());
        assert!(ledger[&key]["value"].is_number(), "{key} in {ledger}");
    }
}

/// `check` says what a diffuser does, studies set its width and its shares, and results do not
/// depend on the number of threads.
#[test]
fn a_diffuser_is_described_and_varied() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let plate = "[[solids]]\nname = \"plate\"\nkind = \"disc\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 4.0]\nradius_mm = 9.0\nscatter = { kind = \"gaussian\", transmitted = 0.7, reflected = 0.25, width_deg = 30.0 }\n";
    std::fs::write(at.join("design.toml"), domed(plate)).expect("written");
    let said = |arguments: &[&str]| {
        let output = batwing(at).args(arguments).output().expect("it runs");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {error}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let checked = said(&["check", "design.toml"]);
    let expected = "plate: disc, sheet, once, Gaussian diffuser of 30° full width at half maximum: 0.7 transmitted, 0.25 reflected, 0.05 absorbed";
    assert!(checked.contains(expected), "{checked}");

    let results = ["1", "2"].map(|threads| {
        let run =
            ["run", "design.toml", "--paths", "20000", "--threads", threads, "--out", threads];
        said(&run);
        let text = std::fs::read_to_string(at.join(threads).join("results.json"));
        let mut json: serde_json::Value =
            serde_json::from_str(&text.expect("results")).expect("JSON");
        json["designs"]["bare-dome"]["geometric"]["power_ledger"].take()
    });
    assert_eq!(results[0], results[1]);
    assert!(results[0]["absorbed_by_plate"]["value"].as_f64() > Some(0.01));

    let study = "name = \"small\"\ndesigns = [\"design.toml\"]\nmodels = [\"geometric\"]\npaths = 20000\n[[factors]]\nname = \"width\"\nkey = \"solids.0.scatter.width_deg\"\nvalues = [5.0, 90.0]\n[[factors]]\nname = \"lost\"\nkey = \"solids.0.scatter.reflected\"\nvalues = [0.0]\n";
    std::fs::write(at.join("study.toml"), study).expect("written");
    said(&["study", "study.toml", "--out", "out"]);
    let text = std::fs::read_to_string(at.join("out/study.json")).expect("study.json");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let setups: Vec<String> = (0..4).map(|k| json["setups"][k]["figures"].to_string()).collect();
    for (number, one) in setups.iter().enumerate() {
        assert!(one != "null" && !setups[..number].contains(one), "{setups:?}");
    }
}

/// `check` and `run` say what stands on the bottom and how; contact changes what the board takes,
/// and the number of threads nothing.
#[test]
fn gaps_and_contacts_are_stated() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let potted = include_str!("../../data/designs/potted.toml");
    let slab = "name = \"slab\"\n";
    assert!(potted.contains(slab));
    let wet = potted.replace(slab, &format!("{slab}optical_contact = \"bottom\"\n"));
    std::fs::write(at.join("dry.toml"), potted).expect("written");
    std::fs::write(at.join("wet.toml"), wet).expect("written");
    let said = |arguments: &[&str]| {
        let output = batwing(at).args(arguments).output().expect("it runs");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {error}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let [dry, wet] = [
        ("dry", "slab stands above a gap of air"),
        ("wet", "slab is in optical contact with ground mirror and floor"),
    ]
    .map(|(name, words)| {
        let design = format!("{name}.toml");
        let checked = said(&["check", &design]);
        assert!(checked.contains(words), "{checked}");
        let ledgers = ["1", "2"].map(|threads| {
            let out = format!("{name}-{threads}");
            let paths = ["--paths", "20000", "--threads", threads, "--out", &out];
            let ran = said(&[&["run", &design][..], &paths].concat());
            assert!(ran.contains(&format!("on the bottom: {words}\n")), "{ran}");
            let text = std::fs::read_to_string(at.join(&out).join("results.json"));
            let json: serde_json::Value =
                serde_json::from_str(&text.expect("results")).expect("JSON");
            json["designs"]["potted"]["geometric"]["power_ledger"].clone()
        });
        assert_eq!(ledgers[0], ledgers[1]);
        let of = |key: &str| ledgers[0][key]["value"].as_f64().expect("a number");
        of("absorbed_by_ground_mirror")
    });
    assert!(wet > 1.2 * dry, "{wet} {dry}");
    let rays = ["rays", "wet.toml", "--count", "50", "--out", "rays"];
    said(&rays);
}
