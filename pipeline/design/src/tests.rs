// SPDX-License-Identifier: MIT OR Apache-2.0
//! Good designs pass, bad ones are refused with the key, what was found and what was expected.

use std::path::Path;

use geometry::profile::{Reference, Shape};
use metrics::illuminance::Symmetry;
use tracer::glam::DVec3;
use tracer::{Distribution, Emission};

use super::Design;
use super::{ConfigError, EMBEDDED, embedded, parse};
use crate::spectrum::Sampling;

const D2: &str = include_str!("../../../data/designs/d2.toml");

/// D2 with one passage replaced.
fn edited(from: &str, to: &str) -> Result<Design, ConfigError> {
    assert_eq!(D2.matches(from).count(), 1, "`{from}` must stand once in d2.toml");
    parse("d2.toml", &D2.replacen(from, to, 1), Path::new(""))
}

fn refused(from: &str, to: &str, words: &[&str]) {
    let message = match edited(from, to) {
        Ok(_) => panic!("`{to}` was accepted"),
        Err(error) => error.to_string(),
    };
    for word in words.iter().chain(&["d2.toml"]) {
        assert!(message.contains(word), "message for `{to}` lacks `{word}`: {message}");
    }
}

#[test]
fn embedded_designs_are_valid() {
    for (name, _) in EMBEDDED {
        embedded(name).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn designs_of_the_paper_have_their_shapes() {
    let os2 = Shape::Triangle { inner_base_deg: 50.0, apex_deg: 60.0, reference: Reference::Chord };
    let os3 =
        Shape::Triangle { inner_base_deg: 45.0, apex_deg: 125.0, reference: Reference::Chord };
    let shapes = |name| embedded(name).expect("valid").elements.shapes;
    assert_eq!(shapes("d1.toml"), vec![Shape::Os1; 17]);
    assert_eq!(shapes("d2.toml"), [vec![os2.clone(); 6], vec![Shape::Os1; 11]].concat());
    assert_eq!(shapes("d3.toml"), [vec![os2; 5], vec![os3], vec![Shape::Os1; 11]].concat());
}

#[test]
fn rings_take_the_shape_of_their_element() {
    let d3 = embedded("d3.toml").expect("valid");
    let rings = d3.hybrid_rings();
    assert_eq!(rings.shapes.len(), 170);
    for ring in 1..=170usize {
        assert_eq!(rings.shapes[ring - 1], d3.elements.shapes[(ring - 1) / 10], "ring {ring}");
    }
}

#[test]
fn lengths_must_be_positive() {
    refused("height_mm = 1.0", "height_mm = -1.0", &["dome.height_mm = -1", "from 1e-6"]);
    refused("sphere_radius_mm = 2.0", "sphere_radius_mm = 0.0", &["dome.sphere_radius_mm = 0"]);
    refused("width_um = 100.0", "width_um = nan", &["elements.width_um = NaN"]);
    refused("wavelength_nm = 550.0", "wavelength_nm = 0.0", &["light.wavelength_nm"]);
    refused("size_mm = [1.0, 1.0]", "size_mm = [1.0, -1.0]", &["led.size_mm = -1"]);
    refused("bin_mm = 0.1", "bin_mm = 0.0", &["receiver.bin_mm"]);
    let many = "expected at least 0.122 mm, for 1000000 bins on the plane, not ";
    refused("columns = 2", "columns = 100", &["receiver.bin_mm", many]);
}

#[test]
fn indices_and_reflectances_have_a_range() {
    refused("index = 1.41", "index = 0.0", &["silicone.index = 0", "above 1"]);
    refused("index = 1.41", "index = nan", &["silicone.index = NaN"]);
    refused(
        "reflectance = 0.95",
        "reflectance = 1.5",
        &["mirror.reflectance = 1.5", "from 0 to 1"],
    );
    refused("reflectance = 0.86", "reflectance = -0.1", &["led.reflectance"]);
    refused("index = 1.41", "index = 1.41\nmaterial_file = \"x.yml\"", &["silicone", "one of"]);
    refused(
        "index = 1.41",
        "material_file = \"nowhere.yml\"",
        &["silicone.material_file = nowhere.yml"],
    );
}

/// `spectrum` in place of D2's wavelength, every key one assignment.
fn lit(spectrum: &str) -> Result<Design, ConfigError> {
    edited("wavelength_nm = 550.0", &format!("[light.spectrum]\n{spectrum}\n"))
}

const LED: &str = "kind = \"white_led\"\nblue_nm = 450.0\nblue_fwhm_nm = 20.0\nphosphor_nm = 560.0\nphosphor_fwhm_nm = 120.0\nblue_part = 0.25\nweighting = \"photometric\"";

#[test]
fn spectra_take_the_place_of_the_wavelength() {
    let design = lit(LED).expect("valid");
    let spectrum = design.spectrum.as_ref().expect("a spectrum");
    assert_eq!(spectrum.sampling, Some(Sampling::Tolerance(5e-3)));
    assert_eq!(design.wavelength_nm.to_bits(), spectrum.median_nm().to_bits());
    let blue = design.at(450.0).expect("no dispersion");
    assert!(blue.spectrum.is_none() && (blue.wavelength_nm - 450.0).abs() < 1e-12);
    assert_eq!(blue.silicone.index.to_bits(), design.silicone.index.to_bits());
    let lines =
        "kind = \"lines\"\nwavelength_nm = [550.0]\npower = [1.0]\nweighting = \"radiometric\"";
    let line = lit(lines).expect("valid");
    assert_eq!(line.spectrum.expect("a spectrum").sampling, None);
}

#[test]
fn bad_spectra_are_named() {
    let rows = |nm: &str, power: &str| {
        format!(
            "kind = \"table\"\nwavelength_nm = {nm}\npower = {power}\nweighting = \"photometric\""
        )
    };
    let with = |more: &str| format!("{LED}\n{more}");
    for (spectrum, words) in [
        (
            rows("[450.0, 650.0]", "[1.0, -2.0]"),
            "light.spectrum.power = -2: expected finite numbers from 0",
        ),
        (rows("[]", "[]"), "light.spectrum.wavelength_nm = 0 wavelengths"),
        (rows("[650.0, 450.0]", "[1.0, 2.0]"), "light.spectrum.wavelength_nm = 450 after 650"),
        (
            rows("[350.0, 650.0]", "[1.0, 2.0]"),
            "light.spectrum.weighting = photometric for power from 350.0",
        ),
        (with("tolerance = 0.01\nsamples = 7"), "light.spectrum.samples = beside `tolerance`"),
        (with("samples = 4"), "light.spectrum.samples = 4: expected one of 1, 3, 7"),
        (
            with("power = [1.0]"),
            "light.spectrum.power: no such key for \"white_led\", expected one of blue_nm",
        ),
        (with("colour = 1"), "light.spectrum.colour: no such key"),
        (
            LED.replace("blue_part = 0.25\n", ""),
            "light.spectrum.blue_part: expected a value, got none",
        ),
        (
            LED.replace("0.25", "1.25"),
            "light.spectrum.blue_part = 1.25: expected a number from 0 to 1",
        ),
        (
            LED.replace("photometric", "scotopic"),
            "light.spectrum.weighting: expected radiometric or photometric, got \"scotopic\"",
        ),
        (LED.replace("\nweighting = \"photometric\"", ""), "light.spectrum.weighting = missing"),
        (
            "kind = \"table\"\nfile = \"nowhere.csv\"\nweighting = \"photometric\"".to_owned(),
            "light.spectrum.file = nowhere.csv: expected a file of two columns: cannot read",
        ),
        (
            "kind = \"table\"\nweighting = \"photometric\"".to_owned(),
            "either `wavelength_nm` and `power`, or `file`",
        ),
    ] {
        let message = match lit(&spectrum) {
            Ok(_) => panic!("accepted: {spectrum}"),
            Err(error) => error.to_string(),
        };
        assert!(
            message.contains(words) && message.contains("d2.toml"),
            "no `{words}` in: {message}"
        );
    }
    refused("wavelength_nm = 550.0", "", &["light = neither", "one of `wavelength_nm`"]);
    let both = format!("wavelength_nm = 550.0\n[light.spectrum]\n{LED}\n");
    refused("wavelength_nm = 550.0", &both, &["light = both"]);
}

#[test]
fn spectra_stay_within_the_material_and_the_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(
        at("glass.yml"),
        "DATA:\n  - type: tabulated n\n    data: |\n        0.42 1.45\n        0.70 1.40\n",
    )
    .expect("written");
    std::fs::write(at("led.csv"), "# a comment\nnm,power\n430,1\n690,1\n").expect("written");
    std::fs::write(at("bad.csv"), "430,1\n690,-1\n").expect("written");
    let parsed = |spectrum: &str| {
        let text = D2
            .replacen("wavelength_nm = 550.0", &format!("[light.spectrum]\n{spectrum}\n"), 1)
            .replacen("index = 1.41", "material_file = \"glass.yml\"", 1);
        parse("d2.toml", &text, folder.path())
    };
    let file =
        |name: &str| format!("kind = \"table\"\nfile = \"{name}\"\nweighting = \"photometric\"");
    let design = parsed(&file("led.csv")).expect("valid");
    assert!((design.at(420.0).expect("covered").silicone.index - 1.45).abs() < 1e-12);
    assert!((design.at(700.0).expect("covered").silicone.index - 1.40).abs() < 1e-12);
    assert!(design.at(701.0).is_err());
    let refused = |spectrum: &str, words: &str| {
        let message = parsed(spectrum).expect_err("refused").to_string();
        assert!(message.contains(words), "no `{words}` in: {message}");
    };
    // The phosphor's tail reaches beyond the material's data.
    refused(LED, "silicone.material_file = glass.yml");
    refused(
        &file("bad.csv"),
        "light.spectrum.file = bad.csv: expected power with finite numbers from 0 to 1e30, got -1",
    );
    // Infrared for which the narrowest ring has no table: an odd number of nodes has none at kx =
    // 0, an even one always does.
    let far = "kind = \"lines\"\nwavelength_nm = [550.0, 60000.0]\npower = [1.0, 1.0]\nweighting = \"radiometric\"";
    assert!(lit(far).is_ok());
    let text = D2
        .replacen("wavelength_nm = 550.0", &format!("[light.spectrum]\n{far}\n"), 1)
        .replacen("kx_per_zone = 2", "kx_per_zone = 1", 1);
    let message = parse("d2.toml", &text, folder.path()).expect_err("refused").to_string();
    assert!(message.contains("light.spectrum = 60000"), "{message}");
}

#[test]
fn unknown_and_missing_keys_are_named() {
    refused("width_mm = 3.4", "widht_mm = 3.4", &["widht_mm"]);
    refused("pitch_mm = 8.3", "", &["pitch_mm"]);
    refused("[light]", "[lihgt]", &["lihgt"]);
    refused("kind = \"specular\"", "kind = \"shiny\"", &["shiny", "specular"]);
    refused("columns = 2", "columns = \"two\"", &["two"]);
}

#[test]
fn packages_must_fit() {
    refused("pitch_mm = 8.3", "pitch_mm = 3.3", &["array.pitch_mm = 3.3", "width of a package"]);
    refused("width_mm = 3.4", "width_mm = 4.2", &["dome.width_mm = 4.2"]);
    refused("height_mm = 0.35", "height_mm = 0.95", &["led.height_mm", "inside the dome"]);
    refused(
        "plane_height_mm = 3.0",
        "plane_height_mm = 1.05",
        &["receiver.plane_height_mm", "above the package"],
    );
}

/// Ellipses are clear where circles are in stretched coordinates, whichever their long axis is.
#[test]
fn oval_domes_in_staggered_rows_stand_as_near_as_they_are_clear() {
    let bare = include_str!("../../../data/designs/bare-dome.toml");
    let (_, rest) = bare.split_once("[silicone]").expect("a table");
    let said = |[x, y]: [f64; 2], pitch: &str, rows: usize| {
        let dome = format!(
            "name = \"oval\"\n[dome]\nmeridian_mm = [[0, 1], [{x:?}, 0.5], [{x:?}, 0]]\n\
             meridian_y_mm = [[0, 1], [{y:?}, 0.5], [{y:?}, 0]]\n[silicone]"
        );
        let array = format!("rows = {rows}\narrangement = \"hexagonal\"\npitch_mm = {pitch}");
        let text = format!("{dome}{rest}").replacen("rows = 2\npitch_mm = 8.3", &array, 1);
        parse("oval.toml", &text, Path::new("")).map_or_else(|e| e.to_string(), |_| String::new())
    };
    for (radii, pitch, rows, words) in [
        ([1.0, 2.0], "[3.8, 1.5]", 2, ""),
        ([1.0, 2.0], "[3.8, 1.5]", 3, "packages of all rows: 2 mm"),
        ([2.0, 1.0], "[4.0, 1.0]", 2, "packages of all rows: 1.732051 mm"),
        ([2.0, 1.0], "[4.0, 1.732051]", 2, ""),
        // Of one pitch: at half of it along x and 0.866 of it along y.
        ([1.0, 2.0], "3.1", 2, ""),
        ([1.0, 2.0], "3.0", 2, "packages of all rows: 3.023716 mm"),
        ([2.0, 2.0], "4.0", 2, ""),
    ] {
        let found = said(radii, pitch, rows);
        assert_eq!(found.is_empty(), words.is_empty(), "{radii:?} {pitch} {found}");
        assert!(found.contains(words), "{found}");
    }
}

/// Walls and neighbours of an oval dome stand by its reach along each axis, in turned packages too.
#[test]
fn an_oval_dome_reaches_less_far_along_its_short_axis() {
    let folder = tempfile::tempdir().expect("a folder");
    let bare = include_str!("../../../data/designs/bare-dome.toml");
    let (_, rest) = bare.split_once("[silicone]").expect("a table");
    let of = |y: f64, pitch: &str, turn: Option<f64>| {
        let dome = format!(
            "name = \"oval\"\n[dome]\nmeridian_mm = [[0, 1], [2.0, 0.5], [2.0, 0]]\n\
             meridian_y_mm = [[0, 1], [{y:?}, 0.5], [{y:?}, 0]]\n[silicone]"
        );
        let mut array = format!("pitch_mm = {pitch}");
        if let Some(turn) = turn {
            let places = format!("x_mm y_mm turn_deg\n0 0 {turn}\n0 9 {turn}\n");
            std::fs::write(folder.path().join("places.txt"), places).expect("written");
            array = "positions_file = \"places.txt\"\npitch_mm = 5.0".to_owned();
        }
        let grid = if turn.is_some() { "columns = 2\nrows = 2\npitch_mm" } else { "pitch_mm" };
        let text = format!("{dome}{rest}").replacen(&format!("{grid} = 8.3"), &array, 1);
        let walls = "[housing]\ndistance_mm = 0.5\nheight_mm = 5.0\nkind = \"absorbing\"\n";
        parse("oval.toml", &format!("{text}\n{walls}"), folder.path())
    };
    let half = |design: Result<Design, ConfigError>| {
        let design = design.unwrap_or_else(|error| panic!("{error}"));
        let (half, places) = (design.housing_half_mm().expect("walls"), design.half_extent_mm());
        [0, 1].map(|k| half[k] - places[k])
    };
    let turned = 30_f64.to_radians();
    let reach = |x: f64, y: f64| (2.0 * x).hypot(1.2 * y);
    for (y, turn, expected) in [
        (2.0, None, [2.0, 2.0]),
        (1.2, None, [2.0, 1.2]),
        (1.2, Some(90.0), [1.2, 2.0]),
        (1.2, Some(30.0), [reach(turned.cos(), turned.sin()), reach(turned.sin(), turned.cos())]),
    ] {
        let found = half(of(y, "8.3", turn));
        for k in 0..2 {
            // Corners of the triangles are within the surface.
            let off = expected[k] + 0.5 - found[k];
            assert!((-1e-9..4e-4).contains(&off), "{y} {turn:?}: {found:?}");
        }
    }
    assert!(of(1.2, "[4.2, 2.5]", None).is_ok());
    for pitch in ["[3.9, 2.5]", "[4.2, 2.3]"] {
        let said = of(1.2, pitch, None).map(|_| ()).expect_err(pitch).to_string();
        assert!(said.contains("array.pitch_mm") && said.contains("width of a package"), "{said}");
    }
}

#[test]
fn the_margin_of_the_map_is_at_least_half_a_pitch() {
    let margin = |pitch: &str, margin: &str| {
        let text = D2.replacen("pitch_mm = 8.3", pitch, 1);
        let text = text.replacen("margin_mm = 4.75", margin, 1);
        parse("d2.toml", &text, Path::new(""))
            .map(|design| design.receiver.margin_mm)
            .map_err(|error| error.to_string())
    };
    assert_eq!(margin("pitch_mm = 8.3", ""), Ok(Some(6.0)));
    assert_eq!(margin("pitch_mm = 13.0", ""), Ok(Some(6.5)));
    let refused = margin("pitch_mm = 13.0", "margin_mm = 6.0").expect_err("less than half a pitch");
    assert!(
        refused.contains("receiver.margin_mm = 6: expected a number from 6.5 to 1000"),
        "{refused}"
    );
}

#[test]
fn rings_must_not_overlap() {
    refused("from = 7", "from = 6", &["element 6 overlaps"]);
    refused("from = 7", "from = 8", &["element 7"]);
    refused("to = 17", "to = 18", &["elements.shapes[2].to = 18"]);
    refused("count = 17", "count = 18", &["elements.count = 18"]);
    refused(
        "apex_angle_deg = 60.0",
        "apex_angle_deg = 135.0",
        &["apex_angle_deg = 135", "less than 130"],
    );
    refused(
        "inner_base_angle_deg = 50.0",
        "inner_base_angle_deg = 115.0",
        &["elements.shapes", "r ="],
    );
}

#[test]
fn triangles_take_any_two_of_their_angles() {
    let shape = |angles: &str| {
        let text = D2.replacen("inner_base_angle_deg = 50.0", angles, 1).replacen(
            "apex_angle_deg = 60.0",
            "",
            1,
        );
        parse("t.toml", &text, Path::new("")).map(|d| d.elements.shapes[0].clone())
    };
    let os2 = |reference| Shape::Triangle { inner_base_deg: 50.0, apex_deg: 60.0, reference };
    for angles in [
        "inner_base_angle_deg = 50.0\napex_angle_deg = 60.0",
        "inner_base_angle_deg = 50.0\nouter_base_angle_deg = 70.0",
        "outer_base_angle_deg = 70.0\napex_angle_deg = 60.0\nreference = \"chord\"",
    ] {
        assert_eq!(shape(angles).expect(angles), os2(Reference::Chord));
    }
    let level = "outer_base_angle_deg = 70.0\napex_angle_deg = 60.0\nreference = \"horizontal\"";
    assert_eq!(shape(level).expect(level), os2(Reference::Horizontal));
    for (angles, word) in [
        ("inner_base_angle_deg = 50.0", "two of the three angles"),
        (
            "inner_base_angle_deg = 50.0\napex_angle_deg = 60.0\nouter_base_angle_deg = 70.0",
            "two of the three angles",
        ),
        ("inner_base_angle_deg = 50.0\nouter_base_angle_deg = 130.0", "less than 130"),
        (
            "inner_base_angle_deg = 169.0\nouter_base_angle_deg = 4.0\nreference = \"horizontal\"",
            "steeper than the dome",
        ),
    ] {
        let error = shape(angles).expect_err(angles).to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn polygons_that_cross_themselves_or_are_too_wide_are_refused() {
    let polyline = |points: &str| {
        D2.replacen(
            "type = \"triangle\"",
            &format!("type = \"polyline\"\npoints_chords = {points} #"),
            1,
        )
        .lines()
        .filter(|l| !l.contains("angle_deg"))
        .collect::<Vec<_>>()
        .join("\n")
    };
    let message = |points: &str| match parse("p.toml", &polyline(points), Path::new("")) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    };
    assert_eq!(message("[[0.5, 0.3]]"), "");
    assert!(message("[[0.8, 0.5], [0.2, 0.5], [0.9, 0.1], [0.1, 0.1]]").contains("crosses"));
    assert!(message("[[2.4, 0.5]]").contains("at most two chords"));
    assert!(message("[[0.5, -0.3]]").contains("above the chord"));
}

#[test]
fn hybrid_rings_divide_elements_and_bands() {
    refused(
        "element_width_um = 10.0",
        "element_width_um = 30.0",
        &["hybrid.element_width_um = 30", "divides"],
    );
    refused("rings_per_band = 10", "rings_per_band = 9", &["hybrid.rings_per_band = 9", "170"]);
    refused("representative = 5", "representative = 11", &["hybrid.representative = 11"]);
    refused("\nbin_deg = 2.5", "\nbin_deg = 0.7", &["far_field.bin_deg"]);
    for width in ["0.25", "0.05", "2.5"] {
        let wrong = format!("\nmargin_mm = 4.75\nread_bin_mm = {width}");
        refused("\nmargin_mm = 4.75", &wrong, &["receiver.read_bin_mm", width]);
    }
    for width in ["4.0", "6.0", "2.5", "2.0"] {
        let wrong = format!("read_bin_deg = {width}");
        refused("read_bin_deg = 5.0", &wrong, &["far_field.read_bin_deg"]);
    }
    refused("read_bins = \"about\"", "read_bins = \"off\"", &["off", "about"]);
    refused("peak = \"bin\"", "peak = \"middle\"", &["middle", "parabola"]);
    // Bins about multiples end half way between them.
    let ends = ["far_field.centre_deg = 5", "2.5 and any multiple of 5 more"];
    refused("\ncentre_deg = 2.5", "\ncentre_deg = 5.0", &ends);
    edited("\ncentre_deg = 2.5", "\ncentre_deg = 7.5").expect("a bin ends at 7.5 degrees");
    let cut = "read_bin_deg = 5.0\ncut_deg = 91.0";
    refused("read_bin_deg = 5.0", cut, &["far_field.cut_deg", "91"]);
    refused("zero = \"smallest\"", "zero = \"dim\"", &["dim", "smallest"]);
}

#[test]
fn ways_of_tracing_are_checked() {
    let old = "max_interactions = 10_000";
    let with = |line: &str| format!("{old}\n{line}");
    refused(old, &with("split = 2"), &["trace.split: removed", "splitting"]);
    for key in ["incidence", "scattering", "spread_deg"] {
        let removed = format!("[hybrid]\n{key} = 0");
        refused("[hybrid]", &removed, &[&format!("hybrid.{key}: removed"), "reproduction"]);
    }
    let net = "\nsampling = \"sobol\"";
    assert_eq!(D2.matches(net).count(), 1);
    refused(net, "\nsampling = \"halton\"", &["halton", "random", "sobol"]);
    // What is not asked for is not written down: the traces of older designs stay what they were.
    let plain = super::embedded("bare-dome.toml").expect("valid");
    let said = serde_json::to_value(&plain.trace).expect("JSON");
    assert_eq!(said.as_object().map(serde_json::Map::len), Some(2), "{said}");
}

#[test]
fn a_missing_file_is_named() {
    let error = super::load(Path::new("no/such/design.toml")).expect_err("no such file");
    assert!(error.to_string().contains("no/such/design.toml"), "{error}");
}

#[test]
fn a_material_file_gives_index_and_absorption() {
    let folder = tempfile::tempdir().expect("a directory");
    let rows = "DATA:\n  - type: tabulated nk\n    data: |\n        0.5 1.42 1e-6\n        0.6 1.40 3e-6\n";
    std::fs::write(folder.path().join("gel.yml"), rows).expect("written");
    let text = D2.replacen("index = 1.41", "material_file = \"gel.yml\"", 1);
    let silicone = parse("d2.toml", &text, folder.path()).expect("valid").silicone;
    assert!((silicone.index - 1.41).abs() < 1e-12);
    // 4π k / λ with k = 2e-6 at 550 nm.
    assert!(
        (silicone.absorption_per_mm - 4.0 * std::f64::consts::PI * 2e-6 / 550e-6).abs() < 1e-12
    );
    let far = text.replacen("wavelength_nm = 550.0", "wavelength_nm = 700.0", 1);
    let error = parse("d2.toml", &far, folder.path()).expect_err("beyond the data").to_string();
    assert!(error.contains("silicone.material_file") && error.contains("0.7"), "{error}");
}

/// N-BK7 with the coefficients of its maker, who states n_d = 1.5168, beside another glass.
const GLASSES: &str = "NM N-BK7 2 517642 1.5168 64.17\nCD 1.03961212 6.00069867E-03 2.31792344E-01 \
    2.00179144E-02 1.01046945 1.03560653E+02\nLD 0.3 2.5\nIT 0.3 0.05 25\nIT 2.5 0.36 25\nNM B 2 0 1.4\n\
    CD 1 0\nLD 0.3 2.5\n";

#[test]
fn a_medium_names_the_glass_of_a_catalogue() {
    let folder = tempfile::tempdir().expect("a directory");
    let at = folder.path();
    let utf16: Vec<u8> = GLASSES.encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(at.join("a.agf"), GLASSES).expect("written");
    std::fs::write(at.join("b.AGF"), [&[0xff, 0xfe][..], &utf16].concat()).expect("written");
    let with = |keys: &str| {
        let text = D2.replacen("index = 1.41", keys, 1);
        parse("d2.toml", &text.replacen("550.0", "587.5618", 1), at)
    };
    for file in ["a.agf", "b.AGF"] {
        let silicone = with(&format!("material_file = \"{file}\"\nglass = \"n-bk7\"")).expect(file);
        assert!((silicone.silicone.index - 1.5168).abs() < 1e-6);
        assert!(silicone.silicone.absorption_per_mm > 0.0);
    }
    for (keys, words) in [
        ("material_file = \"a.agf\"", "the name of one of 2 glasses, N-BK7, B, got none"),
        ("index = 1.41\nglass = \"B\"", "silicone.glass = B: expected no such key without"),
    ] {
        let error = with(keys).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn tables_of_data_sheets_are_straight_lines_in_every_plane() {
    let folder = tempfile::tempdir().expect("a directory");
    let oval = "angle along across\n0 1 1\n60 0.5 0\n";
    std::fs::write(folder.path().join("oval.txt"), oval).expect("written");
    std::fs::write(folder.path().join("empty.txt"), "").expect("written");
    let light = |keys: &str| {
        let source = "[[sources]]\nname = \"s\"\nkind = \"table\"\nposition_mm = [0.0, 0.0, 0.6]\n";
        let found = parse("d2.toml", &format!("{D2}\n{source}{keys}\n"), folder.path());
        let found = found.map_err(|error| error.to_string())?.sources.swap_remove(0);
        match &found.emitters[0].source.emission {
            Emission::Table(table) => Ok((table.clone(), found.symmetry)),
            other => Err(format!("{other:?}")),
        }
    };
    let at = |table: &Distribution, theta: f64, phi: f64| {
        let (theta, phi) = (theta.to_radians(), phi.to_radians());
        let across = theta.sin();
        table.intensity(DVec3::new(across * phi.cos(), across * phi.sin(), theta.cos()))
    };
    let sheet = "angle_deg = [0, 30, 60, 90]\nintensity = [1.0, 1.2, 0.6, 0.0]";
    let (round, symmetry) = light(sheet).expect("a table");
    assert_eq!(symmetry, Symmetry::Square);
    for (theta, phi, expected) in
        [(0.0, 0.0, 1.0), (45.0, 77.0, 0.9), (75.0, 200.0, 0.3), (91.0, 0.0, 0.0)]
    {
        assert!((at(&round, theta, phi) - expected).abs() < 1e-12, "{theta} {phi}");
    }
    // ∫ sin θ (a + b θ) dθ over 2π of the three pieces, by the middle of a thousand strips.
    let strips = (0..90_000).map(|k| (f64::from(k) + 0.5) * 1e-3);
    let flux: f64 = strips.map(|t| at(&round, t, 0.0) * t.to_radians().sin()).sum::<f64>();
    assert!(
        (round.flux() / (std::f64::consts::TAU * flux * 1e-3_f64.to_radians()) - 1.0).abs() < 1e-8
    );
    let (halves, symmetry) =
        light("angle_deg = [-60, 0, 60]\nintensity = [0, 2, 1]").expect("halves");
    assert_eq!(symmetry, Symmetry::None);
    for (theta, phi, expected) in
        [(30.0, 0.0, 1.5), (30.0, 180.0, 1.0), (30.0, 90.0, 1.25), (61.0, 0.0, 0.0)]
    {
        assert!((at(&halves, theta, phi) - expected).abs() < 1e-9, "{theta} {phi}");
    }
    let (oval, symmetry) = light("file = \"oval.txt\"").expect("a file");
    assert_eq!(symmetry, Symmetry::Rectangle);
    for (theta, phi, expected) in
        [(30.0, 0.0, 0.75), (30.0, 180.0, 0.75), (30.0, 270.0, 0.5), (30.0, 45.0, 0.625)]
    {
        assert!((at(&oval, theta, phi) - expected).abs() < 1e-9, "{theta} {phi}");
    }
    let turned = light(&format!("{sheet}\nrotation_deg = [10.0, 0.0, 0.0]")).expect("turned");
    assert_eq!(turned.1, Symmetry::None);
    for (keys, words) in [
        ("angle_deg = [0, 90]", "sources[1].angle_deg = other keys: expected either `angle_deg`"),
        (
            "angle_deg = [0, 90]\nintensity = [1]",
            "sources[1].angle_deg = 2 angles: expected angles asc",
        ),
        ("angle_deg = [0, 0]\nintensity = [1, 1]", "expected angles ascending from -180 to 180"),
        ("angle_deg = [-90, 80]\nintensity = [1, 1]", "both halves to one end, got -90 to 80"),
        (
            "angle_deg = [0, 90]\nintensity = [0, -1]",
            "expected a table of intensities: intensity: expected 0 to 1e100, got -1",
        ),
        ("angle_deg = [0]\nintensity = [1]", "expected a table of intensities"),
        (
            "file = \"none.txt\"",
            "sources[1].file = \"none.txt\": expected a file of two or three columns",
        ),
        ("file = \"empty.txt\"", "expected angles ascending from -180 to 180"),
        (
            "file = \"oval.txt\"\nintensity = [1]",
            "`angle_deg`, `intensity` and perhaps `across`, or `file`",
        ),
    ] {
        let error = light(keys).map(|_| ()).expect_err(words);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn tables_of_kinds_are_shown_as_they_are_written() {
    let ball = "[[solids]]\nname = \"a\"\nkind = \"sphere\"\nradius_mm = 0.2\n\
                position_mm = [0.8, 0.0, 0.4]\nsurface = { kind = \"absorbing\" }\n";
    let design = parse("d2.toml", &format!("{D2}\n{ball}"), Path::new("")).expect("valid");
    assert_eq!(
        serde_json::to_value(&design.solids[0].stated).expect("JSON"),
        serde_json::json!({
            "name": "a", "kind": "sphere", "radius_mm": 0.2, "position_mm": [0.8, 0.0, 0.4],
            "surface": {"kind": "absorbing"},
        })
    );
}

#[test]
fn every_piece_of_a_section_is_a_path_of_its_svg() {
    for (name, _) in EMBEDDED {
        let design = embedded(name).expect("valid");
        if design.dome.is_none() {
            continue;
        }
        let meridian = design.outline().expect("a meridian");
        let mut bytes = Vec::new();
        let curves = [(formats::body::DOME.to_owned(), meridian.clone())];
        formats::svg::write(&curves, "a <b> & c", &mut bytes).expect("written");
        let text = String::from_utf8(bytes).expect("text");
        assert!(text.contains("<title>a &lt;b&gt; &amp; c</title>"));
        let count = |what: &str| text.matches(what).count();
        assert_eq!(count("<path "), meridian.pieces.len() + 2, "{name}");
        let arcs = meridian.pieces.iter().filter(|p| p.curve != geometry::Curve::Line);
        assert_eq!(count(" A "), arcs.count(), "{name}");
        assert_eq!(count("<g"), count("</g>"), "{name}");
    }
}
