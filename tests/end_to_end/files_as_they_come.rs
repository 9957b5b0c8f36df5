// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files as other programs write them: relative rays of LightTools, rays as text, scattering for
//! light from one side, names that steer terminals.

use std::path::Path;
use std::time::{Duration, SystemTime};

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
            for k in 0..2 {
                let [a, b] = [&back, &said].map(|file| file["wavelengths_nm"][k].as_f64());
                let same = a.zip(b).is_none_or(|(a, b)| (a - b).abs() < 1e-3);
                assert!(same && a.is_some() == b.is_some(), "{name} {out}");
            }
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
fn options_of_tables_are_refused_for_rays() {
    let folder = findings(&[ZEMAX]);
    for option in [["--samples", "5"], ["--index-inner", "1.4"], ["--from", "inner"]] {
        let arguments = ["import", ZEMAX, "--out", "a.dat"];
        let words = format!("expected a file of tables, got `{ZEMAX}`, Zemax text ray file");
        let words = format!("{}: {words}", option[0]);
        refused(folder.path(), &[&arguments[..], &option].concat(), &words);
        assert!(!folder.path().join("a.dat").exists());
    }
}

/// The flux in the header of a Speos file is that of its rays, whose powers are weights: in a file of the
/// vendor 4.017658 W and 450.082 lm, 112.03 lm/W as its wavelengths have, with weights that sum to 45 461.
#[test]
fn rays_of_speos_have_the_flux_of_their_header() {
    let folder = tempfile::tempdir().expect("a folder");
    let ray = |x: f32, nm: f32| [x, 0.0, 0.1, 0.0, 0.6, 0.8, nm, 1.0];
    let header = [0.003_f32, 2.0, 2.0, 2.0, 2.0, 2.0, 0.8];
    // The first ray is the damaged one of the second file.
    for (name, first) in [("three.ray", ray(0.0, 450.0)), ("bad.ray", [2.0; 8])] {
        let rows = [first, ray(0.1, 550.0), ray(0.2, 650.0)].concat();
        let bytes: Vec<u8> = header.iter().chain(&rows).flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let said = json(folder.path(), &["import", "three.ray"]);
    assert!((flux(&said) / 0.003 - 1.0).abs() < 1e-6, "{said}");
    let warning = said["warnings"][0].as_str().expect("a warning");
    assert!(warning.contains("scaled to the header"), "{warning}");
    let out = ["import", "three.ray", "--format", "zemax-ray", "--out", "a.sdf"];
    json(folder.path(), &out);
    assert!((flux(&json(folder.path(), &["import", "a.sdf"])) / 0.003 - 1.0).abs() < 1e-6);
    refused(folder.path(), &["import", "bad.ray"], "offset 40: expected a unit vector");
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
        ("2 4\n0 0 0 0 0 1 1\n", "expected 2 rays, as the first line says, got the end"),
        ("1 4\n0 0 0 0 0 1 1\n0 0 0 0 0 1 1\n", "line 3: expected 1 rays"),
        ("1 4\n0 0 0 0 0 1 1,5\n", "with a comma"),
        // A first ray by its angles, one without its power, and commas between numbers.
        ("1 4\n0.3 0.4 0 91.2 113.2 23.2 0.001\n", "line 2: expected a unit vector"),
        ("1 4\n0 0 0 0 0 1\n", "line 2: expected 7 or 8 numbers"),
        ("1, 4\n0,0,0,0,0,1,1\n", "line 1: expected number of rays and unit of length"),
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
    let grating = "{\"period\": 1.0, \"a\\u0007\": 1}";
    std::fs::write(at.join("grating.json"), grating).expect("written");
    refused(at, &["grating", "grating.json"], "expected text without control characters");
    // A file of that name is shown without its effect.
    refused(at, &["check", "a\u{1b}[31m.toml"], "a\\u001b[31m.toml");
    std::fs::write(at.join("b\u{1b}[2J.toml"), "name = 3").expect("written");
    refused(at, &["check", "b\u{1b}[2J.toml"], "b\\u001b[2J.toml");
    let out = "r\nrm -rf x";
    refused(at, &["run", "tiny.toml", "--out", out], "path of results: expected text without");
    let plan = ["plan", "--", "run", "tiny.toml", "--out", out];
    refused(at, &plan, "path of results: expected text without");
    let submit = ["submit", "--slurm", "--", "run", "tiny.toml", "--out", out];
    refused(at, &submit, "control characters");
    assert!(!at.join(out).exists());
}

#[test]
fn numbers_beyond_their_range_are_refused_by_check() {
    let names = ["receiver-1e308.toml", "spectrum-1e308.toml", "spectrum-1e308-rgb.toml"];
    let folder = findings(&names);
    let at = folder.path();
    // The glass of the third lies elsewhere.
    let rgb = std::fs::read_to_string(at.join(names[2])).expect("text");
    let rgb = rgb.replace("material_file = \"../materials/n-bk7.yml\"", "index = 1.5");
    std::fs::write(at.join(names[2]), rgb).expect("written");
    for (name, words) in names.into_iter().zip([
        "receivers[1].position_mm = 1",
        "light.spectrum.power = 1",
        "sources[2].spectrum.power = 1",
    ]) {
        let output = batwing(at).args(["check", name]).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(name) && said.contains(words), "{said}");
    }
    let tiny = workspace().join("tests/findings/tiny.toml");
    let tiny = tiny.to_str().expect("UTF-8");
    let export = ["export", tiny, "--out", "x.ies", "--lumens"];
    for lumens in ["1e308", "1e-300", "nan"] {
        let words = "--lumens: expected a flux from 1e-12 to 1e12 lm, got";
        refused(at, &[&export[..], &[lumens]].concat(), words);
    }
    assert!(!at.join("x.ies").exists());
}

#[test]
fn corners_apart_by_rounding_are_joined() {
    let folder = findings(&["noise.stl", "noise.toml"]);
    let at = folder.path();
    let output = batwing(at).args(["check", "noise.toml"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("noise.stl: 2 corners within 1e-9"), "{said}");
    // A gap that is none of rounding stays one.
    let stl = std::fs::read_to_string(at.join("noise.stl")).expect("text");
    std::fs::write(at.join("noise.stl"), stl.replace("1e-18", "1e-7")).expect("written");
    assert!(!batwing(at).args(["check", "noise.toml"]).output().expect("it runs").status.success());
    // The same body as an OBJ whose faces go on in the next line.
    let obj = "v 0 0 0\nv 0 1 0\nv 1 0 \\\n 0\nv 0 0 1\nf 1 2 \\\n3\nf 1 3 4\nf 1 4 2\nf 3 2 4\n";
    std::fs::write(at.join("noise.obj"), obj).expect("written");
    let design = std::fs::read_to_string(at.join("noise.toml")).expect("text");
    std::fs::write(at.join("obj.toml"), design.replace(".stl", ".obj")).expect("written");
    assert!(batwing(at).args(["check", "obj.toml"]).output().expect("it runs").status.success());
}

/// A Lambertian far field of 100 cd as XML, in the words of one version of the schema.
fn tm33(root: &str, holder: [&str; 2], row: impl Fn(u32, u32, f64) -> String) -> String {
    let rows = (0..=3).flat_map(|h| (0..=90).map(move |v| (30 * h, v)));
    let rows: String =
        rows.map(|(h, v)| row(h, v, 100.0 * f64::from(v).to_radians().cos())).collect();
    format!(
        "<?xml version=\"1.0\"?>\n<{root}><Header><Manufacturer>ACME</Manufacturer></Header>\
         <Emitter><RatedLumens>400</RatedLumens><InputWattage>4</InputWattage>{}{rows}{}\
         </Emitter></{root}>\n",
        holder[0], holder[1]
    )
}

#[test]
fn far_fields_as_xml_of_the_industry_are_read() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let short = |h, v, cd| format!("<IntData h=\"{h}\" v=\"{v}\">{cd}</IntData>\n");
    let long =
        |h, v, cd| format!("<IntensityData horz=\"{h}\" vert=\"{v}\">{cd}</IntensityData>\n");
    let nested = [
        "<LuminousData><LuminousIntensity><AbsolutePhotometry>true</AbsolutePhotometry>",
        "</LuminousIntensity></LuminousData>",
    ];
    let atla = [
        "<IntensityDistribution><PhotometryType>C</PhotometryType><Metric>Luminous</Metric>",
        "</IntensityDistribution>",
    ];
    let files = [
        tm33("IESTM33", nested, short),
        tm33("IESTM33-22", ["<LuminousData>", "</LuminousData>"], long),
        tm33("LuminaireOpticalData", atla, long),
    ];
    for file in &files {
        std::fs::write(at.join("led.xml"), file).expect("written");
        let said = json(at, &["import", "led.xml"]);
        assert_eq!(said["format"], "TM-33/ATLA XML");
        assert_eq!(said["photometry"], "absolute");
        assert_eq!(said["power_w"], 4.0);
        let flux = said["flux_lm"].as_f64().expect("a flux");
        assert!((flux / (100.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{flux}");
        json(at, &["import", "led.xml", "--out", "led.ies"]);
        let text = std::fs::read_to_string(at.join("led.ies")).expect("text");
        assert!(text.contains("[MANUFAC] ACME"), "{text}");
    }
    for (from, to, words) in [
        ("h=\"30\" v=\"7\"", "h=\"30\" v=\"6\"", "one intensity for each direction, got two"),
        ("<IntData h=\"30\" v=\"7\">", "<Other h=\"30\">", "expected well-formed XML"),
        (">100</IntData>", ">-1</IntData>", "expected an intensity: 0 or more"),
        ("IntData", "RadiantData", "expected luminous intensities"),
    ] {
        std::fs::write(at.join("bad.xml"), files[0].replace(from, to)).expect("written");
        refused(at, &["import", "bad.xml"], words);
    }
    // Planes around the circle need not repeat the first, and the type may stand elsewhere.
    let equipment = "<Equipment><Gonioradiometer><Model>x</Model><Type>CIE _ C</Type>\
                     </Gonioradiometer></Equipment><Emitter>";
    let round =
        [(30, 90), (60, 180), (90, 270)].iter().rev().fold(files[0].clone(), |text, turn| {
            text.replace(&format!("h=\"{}\"", turn.0), &format!("h=\"{}\"", turn.1))
        });
    std::fs::write(at.join("round.xml"), round.replace("<Emitter>", equipment)).expect("written");
    assert_eq!(json(at, &["import", "round.xml"])["planes"], 4);
    let kind = files[2].replace(">C<", ">TypeB<");
    std::fs::write(at.join("bad.xml"), kind).expect("written");
    refused(at, &["import", "bad.xml"], "photometry of type C, about the axis");
}

#[test]
fn binary_scattering_of_speos_is_read_as_far_as_it_is_known() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    for name in ["reflected.anisotropicbsdf", "binary.anisotropicbsdf"] {
        std::fs::copy(workspace().join("tests/formats/corpus").join(name), at.join(name))
            .expect("copied");
    }
    let [text, binary] = ["reflected", "binary"].map(|name| {
        let mut said = json(at, &["import", &format!("{name}.anisotropicbsdf")]);
        said.as_object_mut().expect("an object").remove("file");
        said
    });
    assert_eq!(text, binary);
    let head = b"OPTIS - brdf surface file v9.0\n1\x03\0\0\0\x01\0\0\0\0";
    std::fs::write(at.join("b.brdf"), head).expect("written");
    refused(at, &["import", "b.brdf"], "a binary Speos BSDF");
    refused(at, &["import", "b.brdf"], "save it as text");
}

#[test]
fn what_killed_writers_left_is_removed_by_the_next_command_there() {
    let folder = findings(&["tiny.toml"]);
    let at = folder.path();
    let left = at.join("out/.x.json.1-4294967295-0.partial");
    let old = SystemTime::now() - Duration::from_hours(48);
    for command in [
        &["bsdf", "tiny.toml", "--out", "out"][..],
        &["export", "tiny.toml", "--out", "out/tiny.stl"],
    ] {
        std::fs::create_dir_all(at.join("out")).expect("made");
        let file = std::fs::File::create(&left).expect("created");
        file.set_modified(old).expect("set");
        // However it ends.
        let _ = batwing(at).args(command).args(["--quiet"]).output().expect("it runs");
        assert!(!left.exists(), "{command:?}");
    }
}

/// Three rays of text: up, up at 60 degrees to the axis towards +x, and nearly along +x.
const THREE: &str = "3 4\n0 0 0 0 0 1 1\n0 0 0 0.8660254 0 0.5 2\n0 0 0 0.9998477 0 0.0174524 1\n";

#[test]
fn a_source_from_a_file_turns() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("three.txt"), THREE).expect("written");
    // A cone of 2 degrees about the axis, as a far field.
    let cone = "IESNA91\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 4\n0 1 2\n0\n100 100 0\n";
    std::fs::write(at.join("cone.ies"), cone).expect("written");
    std::fs::write(at.join("cone.csv"), "angle,intensity\n0,1\n1,1\n2,0\n").expect("written");
    let up = |file: &str, rotation: &str| {
        let kind = if file.ends_with("csv") { "table" } else { "file" };
        let text = format!(
            "name = \"turned\"\n[mirror]\nkind = \"absorbing\"\nextent = \"array\"\n[led]\n\
             size_mm = [0.02, 0.02]\nheight_mm = 0.01\nreflection = \"absorbing\"\n\
             [array]\ncolumns = 1\nrows = 1\npitch_mm = 2000.0\n[light]\nwavelength_nm = 550.0\n\
             [receiver]\nplane_height_mm = 20.0\nbin_mm = 50.0\n[trace]\npaths = 64000\n\
             [[sources]]\nname = \"s\"\nkind = \"{kind}\"\nposition_mm = [0.0, 0.0, 1.0]\n\
             file = \"{file}\"\n{rotation}\n"
        );
        std::fs::write(at.join("turned.toml"), text).expect("written");
        let run = json(at, &["run", "turned.toml", "--out", "r"]);
        let ledger = &run["designs"]["turned"]["geometric"]["power_ledger"];
        ledger["escaped_up"]["value"].as_f64().expect("a share")
    };
    // 100 degrees about y: +z goes below +x, +x goes down.
    for (file, rotation, share) in [
        ("three.txt", "rotation_deg = [0.0, 0.0, 90.0]", 1.0),
        ("three.txt", "rotation_deg = [0.0, 100.0, 0.0]", 0.0),
        ("three.txt", "rotation_deg = [0.0, -80.0, 0.0]", 1.0),
        ("three.txt", "rotation_deg = [0.0, 45.0, 0.0]", 0.25),
        ("cone.ies", "rotation_deg = [0.0, 80.0, 0.0]", 1.0),
        ("cone.ies", "rotation_deg = [100.0, 0.0, 0.0]", 0.0),
        ("cone.csv", "rotation_deg = [0.0, 80.0, 0.0]", 1.0),
        ("cone.csv", "rotation_deg = [100.0, 0.0, 0.0]", 0.0),
    ] {
        let got = up(file, rotation);
        assert!((got - share).abs() < 0.01, "{file} {rotation}: {got}");
    }
}

#[test]
fn a_part_of_the_rays_keeps_the_flux_without_bias() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let rows = (0..1000).map(|k| format!("{k} 0 0 0 0 1 {}\n", 1 + k % 7));
    let rows = rows.collect::<Vec<_>>().concat();
    std::fs::write(at.join("all.txt"), format!("1000 4\n{rows}")).expect("written");
    let all = json(at, &["import", "all.txt"]);
    let mean = |seed: &str| {
        let out = ["import", "all.txt", "--rays", "100", "--seed", seed, "--out", "part.ray"];
        json(at, &out);
        let part = json(at, &["import", "part.ray"]);
        assert_eq!(part["rays"], 100);
        assert!((flux(&part) / flux(&all) - 1.0).abs() < 1e-6);
        let bytes = std::fs::read(at.join("part.ray")).expect("rays");
        let rays = bytes[44..bytes.len() - 7].chunks_exact(28);
        let float = |ray: &[u8], k: usize| f32::from_le_bytes(ray[k..k + 4].try_into().expect("4"));
        let [moment, sum] = rays.fold([0.0_f64; 2], |[moment, sum], ray| {
            let [x, flux] = [0, 24].map(|k| f64::from(float(ray, k)));
            [moment + x * flux, sum + flux]
        });
        moment / sum
    };
    let expected: f64 = (0..1000).map(|k| f64::from(k * (1 + k % 7))).sum::<f64>() / flux(&all);
    for seed in ["1", "2", "3"] {
        assert!((mean(seed) - expected).abs() < 6.0, "{} {expected}", mean(seed));
    }
    assert!((mean("1") - mean("2")).abs() > 1e-9);
    let ies = "IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 4\n0 90\n0\n1 0\n";
    std::fs::write(at.join("a.ies"), ies).expect("written");
    let words = "--rays: expected a file of rays, got `a.ies`, IES LM-63";
    refused(at, &["import", "a.ies", "--rays", "9", "--out", "b.ies"], words);
}
