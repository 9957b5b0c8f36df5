// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sheets on other surfaces, gaps that are none, and the side to which grooves run.
//!
//! Sources: a sheet on the bottom is one a micrometre above it; the form factor of a disc from a
//! Lambertian point; Fresnel's formulas at the long facet of a sawtooth.

use std::path::Path;

use batwing_tests::judgement::account;
use design::Design;
use metrics::jackknife;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::{self, Observation};
use simulate::scene_check;
use simulate::trace::observe;

/// A Lambertian point 2 mm above a white board, in a cell of 6 mm between mirrors, 4 mm high.
const CELL: &str = r#"
name = "dots"
mirror = { kind = "lambertian", reflectance = 1.0, extent = "array" }
led = { size_mm = [0.5, 0.5], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 6.0 }
housing = { kind = "specular", reflectance = 1.0, height_mm = 4.0, inner_size_mm = [6.0, 6.0] }
light = { wavelength_nm = 550.0 }
receiver = { plane_height_mm = 3.5, bin_mm = 0.5 }
sources = [{ name = "pt", kind = "cosine", exponent = 1.0, position_mm = [0.0, 0.0, 2.0], normal = [0.0, 0.0, -1.0] }]
"#;

fn checked(text: &str) -> Result<Design, String> {
    let design = design::parse("a.toml", text, Path::new("")).map_err(|e| e.to_string())?;
    scene_check::check(&design).map_err(|e| format!("{e:#}"))?;
    Ok(design)
}

fn refused(text: &str) -> String {
    checked(text).expect_err("a refusal")
}

fn trace(text: &str, paths: u64) -> (Design, Observation) {
    let design = checked(text).unwrap_or_else(|e| panic!("{e}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let seen = observe(&design, &surface, paths, "", RunContext::quiet(&interrupt, 5));
    (design, seen.expect("a trace"))
}

/// A black disc of 1 mm radius at a place, with more keys.
fn dot(place: &str, more: &str) -> String {
    format!(
        "[[solids]]\nname = \"dot\"\nkind = \"disc\"\nradius_mm = 1.0\nposition_mm = {place}\n\
         surface = {{ kind = \"absorbing\" }}\n{more}\n"
    )
}

/// Distance from what is right in standard errors.
fn deviations(found: metrics::Estimate, right: f64) -> f64 {
    (found.value - right).abs() / found.standard_error
}

fn absorbed(text: &str) -> metrics::Estimate {
    let (_, seen) = trace(text, 100_000);
    account(&seen, "absorbed_by_dot")
}

#[test]
fn a_sheet_on_the_bottom_is_seen_like_one_above_it() {
    let above = absorbed(&format!("{CELL}{}", dot("[1.5, 0.0, 0.001]", "")));
    assert!((above.value - 0.121).abs() < 0.003, "{above:?}");
    for place in ["[1.5, 0.0, 0.0]", "[1.5, 0.0, 1e-15]"] {
        for more in ["", "per = \"array\""] {
            let on = absorbed(&format!("{CELL}{}", dot(place, more)));
            let error = on.standard_error.hypot(above.standard_error);
            assert!((on.value - above.value).abs() < 4.0 * error, "{more} {on:?} {above:?}");
        }
    }
    // Straight below the point a disc of radius r at the distance d takes r²/(r² + d²) at once.
    let black = CELL
        .replace("kind = \"lambertian\", reflectance = 1.0", "kind = \"absorbing\"")
        .replace("kind = \"specular\", reflectance = 1.0", "kind = \"absorbing\"");
    let led = black.replace(
        "size_mm = [0.5, 0.5], height_mm = 0.1",
        "size_mm = [0.01, 0.01], height_mm = 0.001",
    );
    let below = absorbed(&format!("{led}{}", dot("[0.0, 0.0, 0.0]", "")));
    let led_mm2 = 0.01 * 0.01;
    let expected = 1.0 / 5.0 - led_mm2 / (std::f64::consts::PI * 4.0);
    assert!(deviations(below, expected) < 4.0, "{below:?} {expected}");
}

#[test]
fn a_sheet_on_the_bottom_lies_in_what_touches_the_bottom() {
    let black = CELL.replace("kind = \"lambertian\", reflectance = 1.0", "kind = \"absorbing\"");
    let cell = black
        .replace(
            "size_mm = [0.5, 0.5], height_mm = 0.1",
            "size_mm = [0.01, 0.01], height_mm = 0.001",
        )
        .replace(
            "position_mm = [0.0, 0.0, 2.0]",
            "inside = \"plate\", position_mm = [0.0, 0.0, 0.5]",
        );
    let plate = |contact: &str| {
        format!(
            "[[solids]]\nname = \"plate\"\nkind = \"box\"\nsize_mm = [5.0, 5.0, 1.0]\n\
             position_mm = [0.0, 0.0, 0.5]\nmedium = {{ index = 1.5 }}\n{contact}\n"
        )
    };
    let dot = dot("[0.0, 0.0, 0.0]", "");
    let wet = absorbed(&format!("{cell}{}{dot}", plate("optical_contact = \"bottom\"")));
    // All within the angle of the disc, but for the box.
    let expected = 1.0 / 1.25 - 1e-4 / (std::f64::consts::PI * 0.25);
    assert!(deviations(wet, expected) < 4.0, "{wet:?} {expected}");
    // Across the gap light passes within the critical angle alone.
    let dry = absorbed(&format!("{cell}{}{dot}", plate("")));
    assert!(dry.value < 1.0 / 2.25, "{dry:?}");
    // Half within the foot.
    let apart = dot.replace("[0.0, 0.0, 0.0]", "[2.5, 0.0, 0.0]");
    let said = refused(&format!("{cell}{}{apart}", plate("optical_contact = \"bottom\"")));
    assert!(said.contains("wholly within or wholly beside the foot of \"plate\""), "{said}");
}

#[test]
fn sheets_in_other_faces_are_refused() {
    let second = dot("[0.5, 0.0, 1.0]", "").replace("\"dot\"", "\"other\"");
    for (more, words) in [
        (format!("{}{second}", dot("[1.5, 0.0, 1.0]", "")), "solids[2].position_mm"),
        (format!("{}{second}", dot("[1.5, 0.0, 1.0]", "per = \"array\"")), ".position_mm"),
        // Larger than the top of the LED's box.
        (dot("[0.0, 0.0, 0.1]", ""), "solids[1].position_mm"),
        (dot("[0.0, 0.0, 0.1]", "per = \"array\""), "lies in the plane of 'box top'"),
        (
            dot("[3.0, 0.0, 2.0]", "per = \"array\"\naxis = [1.0, 0.0, 0.0]"),
            "move it by 0.001 mm towards the side from which it is seen",
        ),
        (dot("[3.0, 0.0, 4.0]", "per = \"array\""), "lies in the plane of 'wall'"),
    ] {
        let said = refused(&format!("{CELL}{more}"));
        assert!(said.contains(words), "{more} {said}");
    }
    // A source that would begin below the sheet.
    let low = CELL.replace("[0.0, 0.0, 2.0], normal = [0.0, 0.0, -1.0]", "[1.5, 0.0, 0.0]");
    let said = refused(&format!("{low}{}", dot("[1.5, 0.0, 0.0]", "")));
    assert!(said.contains("sources[1].position_mm"), "{said}");
    assert!(checked(&format!("{low}{}", dot("[-1.5, 0.0, 0.0]", ""))).is_ok());
}

#[test]
fn gaps_thinner_than_a_tenth_of_a_micrometre_are_refused() {
    let film = |name: &str, place: &str| {
        format!(
            "[[films]]\nname = \"{name}\"\n{place}\nthickness_mm = 0.5\nmedium = {{ index = 1.5 }}\n"
        )
    };
    let solid = |name: &str, size: &str, position: &str, more: &str| {
        format!(
            "[[solids]]\nname = \"{name}\"\nkind = \"box\"\nsize_mm = {size}\nposition_mm = {position}\n\
             medium = {{ index = 1.5 }}\n{more}\n"
        )
    };
    let block = |z: f64| solid("block", "[1.0, 1.0, 0.5]", &format!("[1.5, 0.0, {z:?}]"), "");
    let upper = |z: f64| solid("upper", "[1.0, 1.0, 0.5]", &format!("[1.5, 0.0, {z:?}]"), "");
    let turned = |away: f64| {
        let place = |d: f64| format!("[{:?}, 0.0, {:?}]", 0.5 - 0.6 * d, 1.5 + 0.8 * d);
        let angle = "rotation_deg = [0.0, -36.86989764584402, 0.0]";
        let first = solid("block", "[1.0, 1.0, 0.2]", &place(0.0), angle);
        format!("{first}{}", solid("upper", "[1.0, 1.0, 0.2]", &place(0.2 + away), angle))
    };
    // The point above all films.
    let cell = CELL.replace("[0.0, 0.0, 2.0]", "[0.0, 0.0, 3.0]");
    for (design, is_thin) in [
        (film("a", "z_mm = 1.0") + &film("b", "gap_mm = 1e-6"), true),
        (film("a", "z_mm = 1.0") + &film("b", "gap_mm = 9e-5"), true),
        (film("a", "z_mm = 1.0") + &film("b", "gap_mm = 1e-4"), false),
        (film("a", "z_mm = 1.0") + &film("b", "z_mm = 1.50001"), true),
        (film("a", "z_mm = 0.5").replace("0.5\nmedium", "5e-5\nmedium"), true),
        (block(0.25001), true),
        (block(0.25), false),
        (block(0.2502), false),
        (block(0.25) + &upper(0.750_001), true),
        (block(0.25) + &upper(0.750_05), true),
        (block(0.25) + &upper(0.75), false),
        (block(0.25) + &upper(0.7502), false),
        (block(0.25) + &film("a", "z_mm = 0.50001"), true),
        (block(0.25) + &film("a", "z_mm = 0.5"), false),
        (turned(2e-5), true),
        (turned(0.0), false),
        (block(0.25) + &dot("[1.5, 0.0, 0.50002]", ""), true),
        (block(0.25) + &dot("[1.5, 0.0, 0.5]", ""), false),
        (film("a", "z_mm = 1.0\nsize_mm = [5.9999, 5.9999]"), true),
        (film("a", "z_mm = 1.0\nsize_mm = [5.99, 5.99]"), false),
    ] {
        let said = checked(&format!("{cell}{design}")).err();
        assert_eq!(said.is_some(), is_thin, "{design} {said:?}");
        assert!(said.is_none_or(|said| said.contains("at least 0.0001 mm")), "{design}");
    }
}

/// Gaps of a package are judged in its own size: those as wide as the limit allows are too thin in a
/// package of half the size, and those too thin as stated are wide enough in one of twice the size.
#[test]
fn gaps_are_as_thin_as_packages_are_small() {
    let cell = CELL.replace("[0.0, 0.0, 2.0]", "[0.0, 0.0, 0.8]");
    let block = |name: &str, z: f64| {
        format!(
            "[[solids]]\nname = \"{name}\"\nkind = \"box\"\nsize_mm = [0.4, 0.4, 0.5]\n\
             position_mm = [0.7, 0.0, {z:?}]\nmedium = {{ index = 1.5 }}\n"
        )
    };
    let dot = |z: f64| dot(&format!("[0.7, 0.0, {z:?}]"), "").replace("1.0\n", "0.2\n");
    let with_gap = |mm: f64| {
        [
            block("block", 0.25 + mm),
            block("block", 0.25) + &block("upper", 0.75 + mm),
            block("block", 0.25) + &dot(0.5 + mm),
            block("block", 0.25)
                + &block("upper", 0.75 + mm).replace("size", "per = \"array\"\nsize"),
        ]
    };
    for (mm, scale, is_thin) in [
        (1.5e-4, 1.0, [false; 4]),
        (1.5e-4, 0.5, [true, true, true, false]),
        (0.7e-4, 1.0, [true; 4]),
        (0.7e-4, 2.0, [false; 4]),
    ] {
        let cell = cell.replace("pitch_mm = 6.0", &format!("pitch_mm = 6.0, scales = [{scale:?}]"));
        for (design, is_thin) in with_gap(mm).iter().zip(is_thin) {
            let said = checked(&format!("{cell}{design}")).err();
            assert_eq!(said.is_some(), is_thin, "{mm} {scale} {design} {said:?}");
            assert!(said.is_none_or(|said| said.contains("at least 0.0001 mm")), "{design}");
        }
    }
}

#[test]
fn asymmetric_grooves_run_to_the_left_of_their_direction() {
    let n: f64 = 1.5;
    let slope = (10.0f64 / 49.0).atan();
    // A wedge turns light towards its thick side: from below through its flat face, and its flat
    // face above.
    let upper = (n * slope.sin()).asin() - slope;
    let lower = (n * (slope - (slope.sin() / n).asin()).sin()).asin();
    for (face, turned) in [("top", upper), ("bottom", lower)] {
        let polar = turned.to_degrees();
        assert!(polar > 5.5 && polar < 5.99, "{polar}");
        for direction in [0.0, 30.0, 90.0, -120.0] {
            let text = format!(
                "name = \"beam\"\nmirror = {{ kind = \"absorbing\", extent = \"array\" }}\n\
                 led = {{ size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = \"absorbing\" }}\n\
                 array = {{ columns = 1, rows = 1, pitch_mm = 10.0 }}\n\
                 receiver = {{ bin_mm = 0.5, plane_height_mm = 4.0 }}\nlight = {{ wavelength_nm = 550.0 }}\n\
                 far_field = {{ bin_deg = 1.0, azimuth_bin_deg = 10.0 }}\n\
                 sources = [{{ name = \"beam\", kind = \"cosine\", exponent = 1e6, position_mm = [0.0, 0.0, 0.2] }}]\n\
                 [[films]]\nname = \"saw\"\nz_mm = 1.0\nthickness_mm = 0.2\nmedium = {{ index = 1.5 }}\n\
                 {face} = {{ kind = \"grooves\", direction_deg = {direction:?}, profile_um = [[0, 0], [49, 10], [50, 0]] }}\n"
            );
            let (design, seen) = trace(&text, 4000);
            let bins = observation::sphere(&design);
            let left = (direction + 90.0f64).rem_euclid(360.0);
            let width = 360.0 / bins.azimuths as f64;
            let is_beside = |k: &usize| {
                let azimuth = ((k % bins.azimuths) as f64 + 0.5) * width;
                let apart = (azimuth - left).rem_euclid(360.0);
                (5..=6).contains(&(k / bins.azimuths)) && apart.min(360.0 - apart) <= 10.0
            };
            let share = jackknife(&seen.far_field, |light| {
                (0..light.len()).filter(is_beside).map(|k| light[k]).sum::<f64>()
            });
            assert!(share.value > 0.85, "{face} {direction} {share:?}");
        }
    }
}
