// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies of a design: what stands where, what touches, what holds the light, and the symmetries
//! that follow.

use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::binary::{batwing, json};
use crate::support::runs::{estimate, run_text};

/// A folder with files of `tests/findings`.
fn with_files(names: &[&str]) -> TempDir {
    let folder = tempdir().expect("a folder");
    for name in names {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/findings").join(name);
        std::fs::copy(&from, folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    folder
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("read")
}

/// Standard output and standard error of a command that succeeds.
fn said(folder: &Path, arguments: &[&str]) -> [String; 2] {
    let output = batwing(folder).args(arguments).output().expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let [out, error] = [text(&output.stdout), text(&output.stderr)];
    assert!(output.status.success(), "{arguments:?}: {error}");
    [out, error]
}

/// Message of a command that refuses.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = batwing(folder).args(arguments).output().expect("it runs");
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn model(results: &Value, design: &str) -> Value {
    results["designs"][design]["geometric"].clone()
}

fn account(model: &Value, name: &str) -> (f64, f64) {
    estimate(&model["power_ledger"][name])
}

#[test]
fn a_plate_within_the_housing_of_an_array_is_traced_and_drawn() {
    let folder = with_files(&["housing-plate.toml"]);
    let at = folder.path();
    let design = text(at, "housing-plate.toml");
    let results = run_text(at, "backlight", &design, "out", &["--paths", "20000"]).expect("runs");
    assert!(account(&model(&results, "backlight"), "escaped_up").0 > 0.1);
    let drawn = text(&at.join("out/backlight/geometric"), "package.json");
    let drawn: Value = serde_json::from_str(&drawn).expect("JSON");
    // The package stands at (-2, -2): walls 1.7 mm in front of it and 5.7 mm behind.
    let solids = drawn["drawing"]["solids"].as_array().expect("a list");
    let walls: Vec<&Value> = solids.iter().filter(|s| s["name"] == "wall").collect();
    assert_eq!(walls.len(), 4);
    let near =
        walls.iter().any(|w| (w["bounds_mm"][1][0].as_f64().expect("a number") + 1.7).abs() < 1e-3);
    assert!(near, "{walls:?}");
    let [checked, _] = said(at, &["check", "backlight.toml"]);
    assert!(checked.contains("housing     7.4 x 7.4 mm between the walls"), "{checked}");
    said(at, &["rays", "backlight.toml", "--count", "50"]);
}

#[test]
fn overlaps_name_both_bodies_their_depth_and_ways_out() {
    let folder = with_files(&["housing-plate.toml"]);
    let at = folder.path();
    let design = text(at, "housing-plate.toml");
    // 0.1 mm into the walls on every side.
    let wide = design.replace("[7.0, 7.0, 0.5]", "[7.6, 7.6, 0.5]");
    std::fs::write(at.join("wide.toml"), &wide).expect("written");
    let first = refused(at, &["check", "wide.toml"]);
    for words in [
        "'wall'",
        "'plate'",
        "overlap by up to 0.1 mm along ",
        "within the walls, which stand 7.4 x 7.4 mm apart",
        "housing.distance_mm",
        "by more than 0.1 mm",
    ] {
        assert!(first.contains(words), "{words}: {first}");
    }
    assert_eq!(first, refused(at, &["run", "wide.toml"]));
    // Two solids, 0.05 mm into each other.
    let two = design.replace("[housing]", "[[solids]]\nname = \"lens\"\nkind = \"box\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 3.7]\nsize_mm = [2.0, 2.0, 1.0]\nmedium = { index = 1.6 }\n\n[housing]");
    let two = two.replace("plane_height_mm = 5.0", "plane_height_mm = 6.0");
    std::fs::write(at.join("two.toml"), &two).expect("written");
    let refused = refused(at, &["check", "two.toml"]);
    for words in ["'lens'", "'plate'", "overlap by up to 0.05 mm along z", "optical_contact"] {
        assert!(refused.contains(words), "{words}: {refused}");
    }
}

#[test]
fn walls_are_placed_from_the_outermost_body_or_absolutely() {
    let folder = with_files(&["housing-plate.toml"]);
    let at = folder.path();
    let design = text(at, "housing-plate.toml");
    let checked = |name: &str, text: &str| {
        std::fs::write(at.join(name), text).expect("written");
        said(at, &["check", name])[0].clone()
    };
    let cup = "\n[[solids]]\nname = \"rim\"\nkind = \"box\"\nposition_mm = [0.5, 0.0, 0.05]\nsize_mm = [0.2, 0.2, 0.1]\nsurface = { kind = \"absorbing\" }\n";
    let outermost = checked("rim.toml", &format!("{design}{cup}"));
    assert!(outermost.contains("8.2 x 7.4 mm between the walls"), "{outermost}");
    let size = design.replace("distance_mm = 1.5", "inner_size_mm = [9.0, 8.0]");
    let size = checked("size.toml", &format!("{size}{cup}"));
    assert!(size.contains("9 x 8 mm between the walls; 4 mm high"), "{size}");
    for (from, to) in [
        ("distance_mm = 1.5", "distance_mm = 1.5\ninner_size_mm = [9.0, 8.0]"),
        ("distance_mm = 1.5", ""),
    ] {
        std::fs::write(at.join("bad.toml"), design.replace(from, to)).expect("written");
        let refused = refused(at, &["check", "bad.toml"]);
        assert!(refused.contains("one of this key and housing.inner_size_mm"), "{refused}");
    }
}

/// A moved LED: the bins hold 15.3 cd towards +x and 12.8 towards -x at 51 degrees.
#[test]
fn far_fields_without_symmetry_are_shown_half_plane_by_half_plane() {
    let folder = with_files(&["led-off-centre.toml", "lens240.csv"]);
    let at = folder.path();
    let design = text(at, "led-off-centre.toml");
    let flags = ["--paths", "400000"];
    run_text(at, "side240", &design, "out", &flags).expect("runs");
    let csv = text(&at.join("out/side240/geometric"), "far_field.csv");
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().expect("a heading").split(',').collect();
    let row = lines.find(|line| line.starts_with("51.0,")).expect("51 degrees");
    let row: Vec<f64> = row.split(',').map(|v| v.parse().expect("a number")).collect();
    let of = |begin: &str| {
        let column = head.iter().position(|name| name.starts_with(begin));
        let column = column.unwrap_or_else(|| panic!("{begin}: {head:?}"));
        // The standard error stands beside the value.
        (row[column], row[column + 1])
    };
    let [east, west] = ["azimuth_0_", "azimuth_180_"].map(of);
    for ((value, error), expected) in [(east, 15.3), (west, 12.8)] {
        assert!(error < 0.6 && (value - expected).abs() < 3.0 * error, "{east:?} {west:?}");
    }
    assert!(east.0 - west.0 > 2.5 * east.1.hypot(west.1), "{east:?} {west:?}");
    let [north, south] = ["azimuth_90_", "azimuth_270_"].map(of);
    assert!((north.0 - south.0).abs() < 3.5 * north.1.hypot(south.1), "{north:?} {south:?}");
    let [checked, _] = said(at, &["check", "side240.toml"]);
    assert!(checked.contains("symmetry    none (an LED off its axis or tilted)"), "{checked}");
    said(at, &["report", "out"]);
    let page = text(&at.join("out"), "report.html");
    assert!(page.contains("azimuth 0°, left azimuth 180°"), "no cross-section");
    // On its axis the LED leaves all symmetries.
    let centred = design.replace("offset_mm = [0.05, 0.0]", "");
    run_text(at, "side240", &centred, "centred", &["--paths", "5000"]).expect("runs");
    let csv = text(&at.join("centred/side240/geometric"), "far_field.csv");
    assert!(csv.contains("azimuth_45_") && !csv.contains("azimuth_180_"), "{csv}");
}

#[test]
fn rings_are_solved_as_designed_unless_copies_are_asked_for() {
    let folder = with_files(&["relief-20um.toml"]);
    let at = folder.path();
    let designed = text(at, "relief-20um.toml");
    std::fs::write(
        at.join("copies.toml"),
        format!("{designed}\n[hybrid]\nelement_width_um = 10.0\n"),
    )
    .expect("written");
    let [checked, _] = said(at, &["check", "relief-20um.toml"]);
    let words = "rings       solved as designed, 20 µm wide";
    assert!(checked.contains(words) && checked.contains("hybrid_20um"), "{checked}");
    let [checked, _] = said(at, &["check", "copies.toml"]);
    let words = "solved as copies of 10 µm (hybrid.element_width_um) in place of those of 20 µm";
    assert!(checked.contains(words) && checked.contains("hybrid_10um"), "{checked}");
    let [ran, _] = said(at, &["run", "copies.toml", "--model", "geometric", "--paths", "2000"]);
    assert!(ran.contains(words), "{ran}");
    let drawn = text(&at.join("results/blue20/geometric_20um"), "package.json");
    assert!(drawn.contains("solved as copies of 10 µm"), "results say nothing of copies");
}

const BLOCK: &str = r#"
name = "block"
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.6, 0.6], height_mm = 0.2, reflectance = 0.8, reflection = "lambertian" }
array = { columns = 1, rows = 1, pitch_mm = 6.0 }
light = { wavelength_nm = 550.0 }
receiver = { plane_height_mm = 3.0, bin_mm = 0.5 }
trace = { paths = 60_000 }
"#;

fn slab(name: &str, z: [f64; 2], index: f64, contact: &str) -> String {
    let [middle, height] = [0.5 * (z[0] + z[1]), z[1] - z[0]];
    format!(
        "[[solids]]\nname = {name:?}\nkind = \"box\"\nposition_mm = [0.0, 0.0, {middle:?}]\nsize_mm = [2.0, 2.0, {height:?}]\nmedium = {{ index = {index:?} }}\n{contact}\n"
    )
}

/// Two slabs of one index in contact are one slab; with the gap that is kept between them they are
/// not, and it is said.
#[test]
#[ignore = "slow: 4 s"]
fn slabs_in_contact_are_one_slab() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let up = |solids: &str| {
        let design = format!("{BLOCK}{solids}");
        let results = run_text(at, "block", &design, "out", &[]).expect("runs");
        let model = model(&results, "block");
        let lost = account(&model, "lost_leaked_out_of_a_closed_body").0;
        assert!(lost < 1e-6, "{lost}");
        account(&model, "escaped_up")
    };
    let lower = slab("lower", [0.0, 0.5], 1.5, "");
    let upper = |contact: &str| slab("upper", [0.5, 1.0], 1.5, contact);
    let whole = up(&slab("whole", [0.0, 1.0], 1.5, ""));
    let apart = up(&format!("{lower}{}", upper("")));
    assert!(whole.0 - apart.0 > 10.0 * whole.1.hypot(apart.1), "{whole:?} {apart:?}");
    for contact in ["\"lower\"", "[\"lower\"]", "\"all\""] {
        let joined = up(&format!("{lower}{}", upper(&format!("optical_contact = {contact}"))));
        assert!((joined.0 - whole.0).abs() < 4.0 * joined.1.hypot(whole.1), "{joined:?} {whole:?}");
    }
    // One reaches into the other, which displaces it.
    let deep = slab("upper", [0.4, 1.0], 1.5, "optical_contact = \"lower\"");
    let joined = up(&format!("{lower}{deep}"));
    assert!((joined.0 - whole.0).abs() < 4.0 * joined.1.hypot(whole.1), "{joined:?} {whole:?}");
    let dry = format!("{BLOCK}{lower}{}", upper(""));
    std::fs::write(at.join("dry.toml"), dry).expect("written");
    let words = "lower and upper: they touch, and a gap of air is kept; optical_contact = [\"lower\"] under upper closes it";
    let [checked, _] = said(at, &["check", "dry.toml"]);
    assert!(checked.contains(words), "{checked}");
    let [ran, _] = said(at, &["run", "dry.toml", "--paths", "2000"]);
    assert!(ran.contains(words), "{ran}");
    // Films have no such key: the solid below states it.
    let film =
        "\n[[films]]\nname = \"film\"\nz_mm = 0.5\nthickness_mm = 0.1\nmedium = { index = 1.5 }\n";
    let words = "optical_contact = \"all\" under lower closes it";
    for (contact, is_said) in [("", true), ("optical_contact = \"all\"", false)] {
        let below = slab("lower", [0.0, 0.5], 1.5, &format!("per = \"array\"\n{contact}"));
        std::fs::write(at.join("film.toml"), format!("{BLOCK}{below}{film}")).expect("written");
        let [checked, _] = said(at, &["check", "film.toml"]);
        assert_eq!(checked.contains(words), is_said, "{checked}");
        assert_eq!(checked.contains("they touch, and a gap"), is_said, "{checked}");
    }
    for (contact, expected) in [
        ("\"mirror\"", "\"bottom\", \"all\" or another solid with the same `per`, \"lower\""),
        ("[\"lower\", 3]", "solids[2].optical_contact"),
    ] {
        let text = format!("{BLOCK}{lower}{}", upper(&format!("optical_contact = {contact}")));
        std::fs::write(at.join("bad.toml"), text).expect("written");
        let refused = refused(at, &["check", "bad.toml"]);
        assert!(refused.contains(expected), "{refused}");
    }
    let far = slab("upper", [0.52, 1.0], 1.5, "optical_contact = \"lower\"");
    std::fs::write(at.join("far.toml"), format!("{BLOCK}{lower}{far}")).expect("written");
    let refused = refused(at, &["check", "far.toml"]);
    assert!(refused.contains("a gap of 0.02 mm lies between them"), "{refused}");
}

/// An encapsulant that wets its cup: as one that holds the whole cup, not as one beside it.
#[test]
fn an_encapsulant_wets_the_cup_that_it_reaches_into() {
    let beside = "encapsulant-beside-cup.toml";
    let folder = with_files(&[beside, "encapsulant-wetting-cup.toml", "cup.stl"]);
    let at = folder.path();
    let dry = text(at, beside);
    let [checked, _] = said(at, &["check", beside]);
    assert!(checked.contains("cup and encapsulant: a gap of air"), "{checked}");
    let up = |text: &str, name: &str| {
        let results = run_text(at, name, text, "out", &["--paths", "20000"]).expect("runs");
        account(&model(&results, name), "escaped_up")
    };
    let holding = up(&text(at, "encapsulant-wetting-cup.toml"), "wet");
    let apart = up(&dry, "b05");
    let contact = dry
        .replace("[1.23, 0.68], [0.89, 0.0]", "[1.35, 0.7], [0.97, 0.0]")
        .replace("[0, 0.68]", "[0, 0.7]")
        .replace("optical_contact = \"bottom\"", "optical_contact = [\"bottom\", \"cup\"]");
    let contact = up(&contact, "b05");
    assert!(apart.0 - holding.0 > 0.03, "{apart:?} {holding:?}");
    assert!((contact.0 - holding.0).abs() < 0.012, "{contact:?} {holding:?}");
}

#[test]
fn sources_over_an_edge_or_in_one_place_are_said() {
    let folder = with_files(&["source-over-edge.toml"]);
    let at = folder.path();
    let words = "sources[1] \"r\" hangs over the edge of the LED by 0.2 mm";
    let [_, warned] = said(at, &["check", "source-over-edge.toml"]);
    assert!(warned.contains(words), "{warned}");
    let design = text(at, "source-over-edge.toml");
    let model = ["--model", "geometric", "--paths", "2000"];
    let [_, warned] = said(at, &[&["run", "source-over-edge.toml"][..], &model].concat());
    assert!(warned.contains(words), "{warned}");
    let inside = design.replace("position_mm=[0.2,0,0.2]", "position_mm=[0.0,0,0.2]");
    std::fs::write(at.join("inside.toml"), &inside).expect("written");
    let [_, warned] = said(at, &["check", "inside.toml"]);
    assert!(warned.is_empty(), "{warned}");
    let twice = format!(
        "{inside}\n[[sources]]\nname=\"s\"\nkind=\"rectangle\"\nposition_mm=[0.1,0,0.2]\nsize_mm=[0.2,0.2]\n"
    );
    std::fs::write(at.join("twice.toml"), twice).expect("written");
    let [_, warned] = said(at, &["check", "twice.toml"]);
    assert!(
        warned.contains("sources[1] \"r\" and sources[2] \"s\" emit from one place"),
        "{warned}"
    );
}

#[test]
fn what_emits_on_the_box_moves_with_it() {
    let folder = with_files(&["chip-off-axis.toml"]);
    let [_, warned] = said(folder.path(), &["check", "chip-off-axis.toml"]);
    assert_eq!(warned, "");
    // A rectangle where the box was before, and where the moved chip emits.
    let chip = text(folder.path(), "chip-off-axis.toml");
    let lamp = "\n[[sources]]\nname = \"r\"\nkind = \"rectangle\"\nsize_mm = [0.4, 0.2]\n";
    for (place, words) in [
        ("[0.2, 0.1, 0.12]", "sources[1] \"chip\" and sources[2] \"r\" emit from one place"),
        ("[0.0, 0.0, 0.12]", "sources[2] \"r\" hangs over the edge of the LED by 0.15 mm"),
    ] {
        let twice = format!("{chip}{lamp}position_mm = {place}\n");
        std::fs::write(folder.path().join("twice.toml"), twice).expect("written");
        let [_, warned] = said(folder.path(), &["check", "twice.toml"]);
        assert!(warned.contains(words), "{warned}");
    }
}

#[test]
fn mirrors_that_repeat_something_else_are_said_by_check_and_run() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let cell = "name = \"cell\"\n\
        mirror = { kind = \"lambertian\", reflectance = 0.95, extent = \"array\" }\n\
        led = { size_mm = [0.5, 0.5], height_mm = 0.15, reflection = \"lambertian\", reflectance = 0.9 }\n\
        array = { columns = 1, rows = 1, pitch_mm = 5.0 }\n\
        housing = { kind = \"specular\", reflectance = 1.0, height_mm = 8.0, inner_size_mm = [5.0, 5.0] }\n\
        light = { wavelength_nm = 550.0 }\nreceiver = { plane_height_mm = 7.9, bin_mm = 0.5 }\n\
        [[films]]\nname = \"lower\"\nz_mm = 2.5\nthickness_mm = 0.2\nmedium = { index = 1.586 }\n\
        top = { kind = \"prisms\", direction_deg = 10 }\n";
    std::fs::write(at.join("cell.toml"), cell).expect("written");
    let words = "walls that mirror stand for an endless array only where everything is its own \
                 mirror image in x = 0 and in y = 0; here they turn into something else: \
                 films[1].top.direction_deg = 10";
    for command in [&["check", "cell.toml"][..], &["run", "cell.toml", "--paths", "2000"]] {
        let [_, warned] = said(at, command);
        assert!(warned.contains(words), "{warned}");
    }
}

#[test]
fn solids_stand_on_the_bottom_to_rounding() {
    let folder = with_files(&["cylinder.toml"]);
    let at = folder.path();
    let design = text(at, "cylinder.toml");
    for k in 1..=40 {
        let height = f64::from(k) * 0.05;
        let place = [("0.35]", 0.5 * height), ("height_mm = 0.7", height)];
        let text = design
            .replace(place[0].0, &format!("{:?}]", place[0].1))
            .replace(place[1].0, &format!("height_mm = {height:?}\noptical_contact = \"bottom\""));
        let text = text.replace("plane_height_mm = 4.0", "plane_height_mm = 4.5");
        std::fs::write(at.join("one.toml"), text).expect("written");
        said(at, &["check", "one.toml"]);
    }
    for (z, shown) in [("0.34", "-0.01 mm"), ("0.3499", "-0.0001 mm")] {
        std::fs::write(at.join("low.toml"), design.replace("0.35]", &format!("{z}]")))
            .expect("written");
        let refused = refused(at, &["check", "low.toml"]);
        assert!(refused.contains(&format!("it reaches down to {shown}")), "{refused}");
    }
}

#[test]
fn the_body_that_holds_the_light_is_said() {
    let folder = with_files(&["cusp.toml", "r.dat"]);
    let at = folder.path();
    let [_, warned] = said(at, &["run", "cusp.toml"]);
    assert!(warned.contains("\"q\" holds the light: a path meets some"), "{warned}");
    let [_, warned] = said(at, &["check", "cusp.toml"]);
    assert!(warned.contains("\"q\" holds the light"), "{warned}");
}

#[test]
fn exponents_make_whole_numbers_and_check_reads_every_kind_of_file() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let design = BLOCK.replace("60_000", "2e5").replace("columns = 1", "columns = 1e0");
    std::fs::write(at.join("block.toml"), &design).expect("written");
    let checked = json(at, &["check", "block.toml"]);
    assert_eq!(checked["design"]["trace"]["paths"], 200_000);
    for (value, expected) in [("2.5e0", "integer"), ("2.5", "integer"), ("1e-1", "integer")] {
        let text = design.replace("columns = 1e0", &format!("columns = {value}"));
        std::fs::write(at.join("bad.toml"), text).expect("written");
        let refused = refused(at, &["check", "bad.toml"]);
        assert!(refused.contains("array.columns") && !refused.contains(expected), "{refused}");
    }
    let study = "name = \"s\"\ndesigns = [\"block.toml\"]\nmodels = [\"geometric\"]\npaths = 2e4\n\n[[factors]]\nname = \"p\"\nkey = \"array.pitch_mm\"\nvalues = [6.0, 7.0]\n";
    let tolerance = "name = \"t\"\ndesign = \"block.toml\"\nsamples = 1e1\n\n[[tolerances]]\nkey = \"led.height_mm\"\ndeviation = 0.01\n";
    let problem = "name = \"found\"\ndesign = \"block.toml\"\n\n[[variables]]\nkey = \"array.pitch_mm\"\nfrom = 5.0\nto = 8.0\n\n[objective]\nterms = [{ figure = \"peak_angle_deg\" }]\n\n[[stages]]\nevaluations = 1e1\n";
    for (kind, text) in [("study", study), ("tolerances", tolerance), ("problem", problem)] {
        std::fs::write(at.join("file.toml"), text).expect("written");
        let checked = json(at, &["check", "file.toml"]);
        assert_eq!(checked["kind"], kind);
        std::fs::write(at.join("file.toml"), text.replace("block.toml", "none.toml"))
            .expect("written");
        let refused = refused(at, &["check", "file.toml"]);
        assert!(refused.contains("file.toml") && refused.contains("none.toml"), "{refused}");
    }
}

#[test]
fn a_film_that_cuts_a_cup_says_by_how_much() {
    let folder = with_files(&["encapsulant-beside-cup.toml", "cup.stl"]);
    let at = folder.path();
    let cup = text(at, "encapsulant-beside-cup.toml");
    let (from, to) = (cup.find("[housing]").expect("a key"), cup.find("[light.").expect("a key"));
    let film = "[[films]]\nname = \"plate\"\nthickness_mm = 1.0\nmedium = { index = 1.5 }\n";
    // The cup is 0.7 mm high.
    for (low_mm, deep_mm) in [("0.5", "0.2"), ("0.3", "0.4")] {
        let design = format!("{}{}\n{film}z_mm = {low_mm}\n", &cup[..from], &cup[to..]);
        std::fs::write(at.join("film.toml"), design).expect("written");
        let said = refused(at, &["check", "film.toml"]);
        for words in [
            format!("film.toml: films[1].z_mm = {low_mm}: expected a place where the solid cuts"),
            format!("they overlap by up to {deep_mm} mm along z"),
            format!("move \"plate\" by {deep_mm} mm along z, or \"cup\""),
        ] {
            assert!(said.contains(&words), "{words}: {said}");
        }
    }
}

#[test]
fn domes_that_are_nearly_flat_are_traced() {
    let folder = with_files(&["dome.toml"]);
    let at = folder.path();
    let up = |radius: &str| {
        let design = text(at, "dome.toml").replace("sphere_radius_mm = 1.6", radius);
        assert!(design.contains(radius), "{design}");
        let results = run_text(at, "flat", &design, "out", &["--paths", "50000"]).expect("runs");
        let model = model(&results, "dome");
        for (name, lost) in model["power_ledger"].as_object().expect("accounts") {
            assert!(!name.starts_with("lost") || lost["value"] == 0.0, "{radius}: {name} {lost}");
        }
        account(&model, "escaped_up")
    };
    // A cap of 2.8 mm on a sphere of 500 mm is 2 um high: all are planes to the eye of the light.
    let (reference, error) = up("sphere_radius_mm = 500.0");
    for radius in ["sphere_radius_mm = 1000.0", "sphere_radius_mm = 10000.0"] {
        let (value, other) = up(radius);
        let off = (value - reference).abs();
        assert!(off < 4.0 * error.hypot(other) + 1e-3, "{radius}: {value} {reference}");
    }
}
