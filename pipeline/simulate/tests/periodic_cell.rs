// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells that repeat by translation: any cell stands for an endless array of it.

use std::path::Path;

use design::Design;
use design::schema::FilmTracing;
use metrics::Estimate;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::trace::observe;

/// Reflective polariser and panel at 45 degrees over plate and board; crossed prisms at 10 and 100
/// degrees; a clear plate that absorbs, in carried light.
const POLARISERS: &str = include_str!("../../../tests/findings/cell-polariser-45.toml");
const PRISMS: &str = include_str!("../../../tests/findings/cell-prisms-10.toml");
const PLATE: &str = include_str!("../../../tests/findings/cell-plate-carried.toml");

/// One LED on a board, open above, in a cell of 5 by 4 mm.
const CELL: &str = r#"
name = "cell"
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.5, 0.4], height_mm = 0.15, reflection = "lambertian", reflectance = 0.8 }
array = { columns = 1, rows = 1, pitch_mm = [5.0, 4.0] }
housing = { kind = "periodic", height_mm = 6.0, inner_size_mm = [5.0, 4.0] }
receiver = { plane_height_mm = 5.9, bin_mm = 0.5 }
light = { wavelength_nm = 550.0 }

[[films]]
name = "plate"
z_mm = 3.0
thickness_mm = 1.0
medium = { index = 1.49, absorption_per_mm = 0.05 }
top = { kind = "prisms", direction_deg = 20.0 }
"#;

fn parsed(text: &str) -> Design {
    design::parse("own.toml", text, Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

/// Figures of this key, by the table of the films and film by film.
fn both(text: &str, paths: u64, key: &str) -> [Estimate; 2] {
    let design = parsed(text);
    let mut traced = design.clone();
    traced.trace.films = FilmTracing::Traced;
    [design, traced].map(|design| {
        let interrupt = Interrupt::default();
        let surface = dome_surface(&design, Model::Geometric, None).expect("no dome");
        let context = RunContext::quiet(&interrupt, 5);
        let seen = observe(&design, &surface, paths, "", context).expect("a trace");
        let figures = seen.estimates(&design, |known| known == key);
        let found = figures.iter().find(|figure| figure.key == key);
        found.unwrap_or_else(|| panic!("no {key}")).entry.estimate()
    })
}

fn agrees(what: &str, found: Estimate, right: Estimate) {
    let error = found.standard_error.hypot(right.standard_error);
    let off = (found.value - right.value) / error;
    assert!(off.abs() < 4.5, "{what}: {found:?}, right {right:?}: {off:.1} errors");
}

/// Values of films whose axes walls do not turn, at 0 and 90 degrees between mirrors and over 9 by 9
/// packages (a turn of all films over board and plate that scatter changes nothing), and the closed
/// form of the absorbing plate.
#[test]
#[ignore = "slow: three cells by table and film by film (12 s)"]
fn cells_without_mirror_symmetry_are_those_of_wide_ones() {
    for (name, text, right) in [
        ("polarisers", POLARISERS, Estimate::new(0.059_21, 0.000_1)),
        ("prisms", PRISMS, Estimate::new(0.643, 0.000_7)),
        ("plate", PLATE, Estimate::new(0.503_57, 0.0)),
    ] {
        for (how, up) in ["table", "traced"].iter().zip(both(text, 100_000, "escaped_up")) {
            agrees(&format!("{name}, {how}"), up, right);
        }
    }
}

/// Where the LED stands in its cell changes nothing, nor how many packages a cell holds.
#[test]
fn a_cell_is_the_same_wherever_it_is_cut() {
    let up = |text: &str| both(text, 200_000, "escaped_up");
    let base = up(CELL);
    let moved = CELL.replace("height_mm = 0.15,", "height_mm = 0.15, offset_mm = [1.9, -1.2],");
    let wide = CELL
        .replace("columns = 1, rows = 1", "columns = 2, rows = 3")
        .replace("inner_size_mm = [5.0, 4.0]", "inner_size_mm = [10.0, 12.0]");
    for (what, text) in [("moved", moved), ("of six", wide)] {
        for (found, right) in up(&text).into_iter().zip(base) {
            agrees(what, found, right);
        }
    }
    agrees("table", base[0], base[1]);
}

/// A lens whose LED stands off its axis, and rows half a pitch apart, in cells of one and two packages and
/// of four times as many.
#[test]
fn cells_of_lenses_and_of_staggered_rows_are_those_of_four() {
    let four = |text: &str, from: &str, to: &str| {
        let text = text.replace(from, to);
        text.replace("inner_size_mm = [5.0, 4.0]", "inner_size_mm = [10.0, 8.0]")
    };
    let lens = CELL.replace("height_mm = 0.15,", "height_mm = 0.15, offset_mm = [0.35, 0.1],")
        + "\n[dome]\nsphere_radius_mm = 1.0\nheight_mm = 0.8\nwidth_mm = 1.8\n[silicone]\nindex = 1.41\n";
    let staggered = CELL
        .replace("columns = 1, rows = 1", "columns = 1, rows = 2, arrangement = \"hexagonal\"")
        .replace("pitch_mm = [5.0, 4.0]", "pitch_mm = [5.0, 2.0]");
    for (what, text, from, to) in [
        ("lens", &lens, "columns = 1, rows = 1", "columns = 2, rows = 2"),
        ("staggered", &staggered, "columns = 1, rows = 2", "columns = 2, rows = 4"),
    ] {
        let up = |text: &str| both(text, 100_000, "escaped_up");
        for (found, right) in up(&four(text, from, to)).into_iter().zip(up(text)) {
            agrees(what, found, right);
        }
    }
}

/// Smoothing goes on in the next cell, whatever walls would be thick, and the map of one LED is that of
/// four.
#[test]
fn the_uniformity_of_a_cell_is_that_of_an_endless_array() {
    let smooth = CELL
        .replace("bin_mm = 0.5", "bin_mm = 0.5, smoothing_sigma_mm = 1.0, area_mm = [5.0, 4.0]")
        .replace("z_mm = 3.0", "z_mm = 1.0")
        .replace("plane_height_mm = 5.9", "plane_height_mm = 2.5");
    let thick = smooth.replace("height_mm = 6.0,", "height_mm = 6.0, thickness_mm = 4.0,");
    let wide = smooth
        .replace("columns = 1, rows = 1", "columns = 3, rows = 3")
        .replace("inner_size_mm = [5.0, 4.0]", "inner_size_mm = [15.0, 12.0]");
    let uniformity = |text: &str| both(text, 200_000, "area_min_to_mean")[1];
    let right = uniformity(&smooth);
    assert!(right.value < 0.95, "{right:?}");
    assert!((uniformity(&thick).value - right.value).abs() < 1e-6);
    agrees("nine packages", uniformity(&wide), right);
}

/// A board that mirrors all light and nothing above: all of it goes up, however it goes round.
#[test]
fn light_is_neither_lost_nor_made_where_it_goes_round() {
    let text = CELL.split("[[films]]").next().expect("a head");
    let white = text
        .replace("reflectance = 0.9", "reflectance = 1.0")
        .replace("reflectance = 0.8", "reflectance = 1.0");
    for up in both(&white, 20_000, "escaped_up") {
        assert!((up.value - 1.0).abs() < 1e-9, "{up:?}");
    }
}

/// A cell that is lower or narrower than what it holds is refused, by key.
#[test]
fn a_cell_holds_what_is_in_it() {
    let low = |text: &str| text.replace("height_mm = 6.0", "height_mm = 3.5");
    let narrow = CELL.replace("inner_size_mm = [5.0, 4.0]", "inner_size_mm = [5.0, 0.3]");
    let alone = CELL.replace("pitch_mm = [5.0, 4.0]", "pitch_mm = [5.0, 4.0], crossing = false");
    let plane = CELL.replace("plane_height_mm = 5.9", "plane_height_mm = 6.1");
    for (text, key) in [
        (low(CELL), "housing.height_mm"),
        (plane, "housing.height_mm"),
        (narrow, "housing.inner_size_mm"),
        (alone, "array.crossing"),
        (CELL.replace("columns = 1", "columns = 3"), "a package at (-5, 0) mm"),
        (
            format!(
                "{CELL}\n[[sources]]\nname = \"lamp\"\nkind = \"isotropic\"\nposition_mm = [3.0, 0.0, 1.0]\n"
            ),
            "source \"lamp\" at (3, 0) mm",
        ),
        (
            format!(
                "{CELL}\n[[solids]]\nname = \"ball\"\nkind = \"sphere\"\nper = \"array\"\nradius_mm = 0.2\nposition_mm = [4.0, 0.0, 1.0]\nmedium = {{ index = 1.5 }}\n"
            ),
            "solid \"ball\" at (4, 0) mm",
        ),
        (
            format!(
                "{CELL}\n[[receivers]]\nname = \"front\"\nkind = \"plane\"\nposition_mm = [9.0, 0.0, 2.0]\nsize_mm = [2.0, 2.0]\nbins = [1, 1]\n"
            ),
            "receiver \"front\" at (9, 0) mm",
        ),
        (
            CELL.replace("\"periodic\"", "\"specular\", reflectance = 0.9")
                .replace("columns = 1", "columns = 3"),
            "walls around all",
        ),
    ] {
        let refused = simulate::scene_check::check(&parsed(&text)).expect_err(key).to_string();
        assert!(refused.starts_with("own.toml") && refused.contains(key), "{refused}");
    }
    assert!(simulate::scene_check::check(&parsed(CELL)).is_ok());
}
