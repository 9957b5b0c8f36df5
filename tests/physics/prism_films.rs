// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prism films over a Lambertian emitter: transmittance, luminance, views and gain in a cavity.
//!
//! Sources: an independent Monte Carlo of ideal films (symmetric prisms of 90° up, lateral places
//! independent between the faces, flat lower face, air on both sides), 1e6 rays each, standard error
//! 5e-4; gain = T0/(1 - R (1 - Th)). Conservation of energy; rotation of the whole.

use std::path::Path;

use batwing_tests::judgement::account;
use batwing_tests::validation_report::{Row, hold};
use design::Design;
use metrics::{Estimate, jackknife};
use results::film_light;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::{self, Observation};
use simulate::scene_check;
use simulate::trace::observe;

/// A small emitter in a wide black room.
const EMITTER: &str = r#"
name = "emitter"
mirror = { kind = "absorbing", extent = "array" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 10.0 }
receiver = { bin_mm = 0.5, plane_height_mm = 4.0 }
light = { wavelength_nm = 550.0 }
far_field = { bin_deg = 1.0, azimuth_bin_deg = 10.0 }
"#;

/// One film more, with prisms along this direction.
fn film(name: &str, place: &str, direction_deg: f64) -> String {
    format!(
        "[[films]]\nname = \"{name}\"\n{place}\nsize_mm = [5000.0, 5000.0]\nthickness_mm = 0.25\n\
         medium = {{ index = 1.586 }}\ntop = {{ kind = \"prisms\", direction_deg = {direction_deg:?} }}\n"
    )
}

fn single(direction_deg: f64) -> String {
    format!("{EMITTER}{}", film("film", "z_mm = 1.0", direction_deg))
}

fn crossed() -> String {
    format!("{}{}", single(0.0), film("upper", "gap_mm = 0.01", 90.0))
}

fn trace(text: &str, paths: u64) -> (Design, Observation) {
    let design = design::parse("film.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let env = RunContext::quiet(&interrupt, 31);
    let seen = observe(&design, &surface, paths, "", env).expect("a trace");
    assert!(seen.ledger().surplus().abs() < 1e-9);
    (design, seen)
}

/// Luminance over that of the emitter, from `low` to `high` degrees, in the azimuths that `keep`.
fn luminance(
    (design, seen): &(Design, Observation),
    [low, high]: [f64; 2],
    keep: impl Fn(f64) -> bool,
) -> Estimate {
    let bins = observation::sphere(design);
    let width = 360.0 / bins.azimuths as f64;
    let polar = (low / bins.bin_deg).round() as usize..(high / bins.bin_deg).round() as usize;
    let kept: Vec<usize> = (0..bins.azimuths).filter(|k| keep((*k as f64 + 0.5) * width)).collect();
    // A Lambertian emitter sends sin² θ of its power within θ.
    let within = |theta: f64| theta.to_radians().sin().powi(2);
    let lambertian = (within(high) - within(low)) * kept.len() as f64 / bins.azimuths as f64;
    jackknife(&seen.far_field, |all| {
        let rows = polar.clone();
        let sum: f64 =
            rows.flat_map(|row| kept.iter().map(move |k| all[row * bins.azimuths + k])).sum();
        sum / lambertian
    })
}

/// Judges an estimate by a value of a stated tolerance.
fn within(what: &str, found: Estimate, expected: f64, tolerance: f64) {
    let allowed = tolerance + 4.5 * found.standard_error;
    assert!((found.value - expected).abs() < allowed, "{what}: {found:?} for {expected}");
}

#[test]
fn diffuse_light_passes_one_film_and_two_crossed_ones() {
    let [one, two] = [single(30.0), crossed()].map(|text| trace(&text, 400_000));
    let axis = |seen: &(Design, Observation)| luminance(seen, [0.0, 6.0], |_| true);
    let rows = [
        ("one film, transmittance", account(&one.1, "escaped_up"), 0.4628, 0.002),
        ("one film, luminance near the axis", axis(&one), 0.9474, 0.004),
        ("two crossed films, transmittance", account(&two.1, "escaped_up"), 0.2074, 0.002),
        ("two crossed films, luminance near the axis", axis(&two), 0.905, 0.004),
    ]
    .map(|(what, found, expected, tolerance)| {
        within(what, found, expected, tolerance);
        Row::estimate(what, (expected, 4), found, (4.5, tolerance))
    });
    hold("prism films", &rows);
}

#[test]
#[ignore = "slow: four million paths (8 s)"]
fn views_are_those_of_another_program() {
    let seen = trace(&single(0.0), 4_000_000);
    within("axis", luminance(&seen, [0.0, 4.0], |_| true), 0.9474, 0.002);
    // Prisms run along x.
    let near = |azimuth: f64, axis: f64| ((azimuth - axis) / 180.0).fract().abs() < 10.0 / 180.0;
    let about =
        |azimuth: f64, axis: f64| near(azimuth + 180.0, axis) || near(azimuth + 190.0, axis);
    for (theta, axis, expected) in
        [(15.0, 90.0, 0.9209), (15.0, 0.0, 0.9442), (30.0, 90.0, 0.8018), (30.0, 0.0, 0.9314)]
    {
        let found = luminance(&seen, [theta - 1.0, theta + 1.0], |a| about(a, axis));
        within(&format!("{theta} about {axis}"), found, expected, 0.003);
    }
}

#[test]
fn a_cavity_gains_by_what_comes_back() {
    let cavity = single(0.0)
        .replace("\"absorbing\", extent", "\"lambertian\", reflectance = 0.83, extent")
        .replace("pitch_mm = 10.0", "pitch_mm = 1000.0")
        .replace("bin_mm = 0.5", "bin_mm = 10.0");
    let seen = trace(&cavity, 400_000);
    within("gain", luminance(&seen, [0.0, 8.0], |_| true), 1.71, 0.012);
}

/// A film turned by any angle passes the same light, and the pattern above it turns along.
#[test]
fn a_film_turns_with_its_pattern() {
    let seen = [0.0, 37.0].map(|direction| trace(&single(direction), 400_000));
    let [still, turned] = [0, 1].map(|k| account(&seen[k].1, "escaped_up"));
    within("both", still, turned.value, 4.5 * turned.standard_error);
    // About 60° more light leaves across the prisms than along them.
    let at = |k: usize, azimuth: f64| {
        luminance(&seen[k], [50.0, 70.0], |a| ((a - azimuth).abs() % 180.0 - 90.0).abs() > 78.0)
    };
    let (still, turned) = (at(0, 5.0), at(1, 42.0));
    within("along", still, turned.value, 0.02);
    assert!(at(0, 5.0).value + 0.1 < at(0, 95.0).value, "{:?} {:?}", at(0, 5.0), at(0, 95.0));
}

/// A diffuser that sends 0.4 back stands over a white board of reflectance 0.9: geometric series.
#[test]
fn light_between_films_is_that_of_a_cavity() {
    let text = EMITTER.replace(
        "mirror = { kind = \"absorbing\", extent = \"array\" }",
        "mirror = { kind = \"lambertian\", reflectance = 0.9, extent = \"array\" }\n\
         housing = { kind = \"specular\", reflectance = 1.0, inner_size_mm = [10.0, 10.0], height_mm = 3.0 }",
    ) + "[[films]]\nname = \"my_plate\"\nz_mm = 1.0\nthickness_mm = 0.25\nmedium = { index = 1.0 }\n\
         top = { kind = \"lambertian\", transmitted = 0.6, reflected = 0.4 }\n\
         [[films]]\nname = \"clear\"\nthickness_mm = 0.25\nmedium = { index = 1.0 }\n";
    let (_, seen) = trace(&text, 200_000);
    let series = 1.0 / (1.0 - 0.4 * 0.9);
    for (account_key, expected) in [
        ("passed_1_up_below_my_plate", series),
        ("passed_1_down_below_my_plate", 0.4 * series),
        ("passed_2_up_below_clear", 0.6 * series),
        ("passed_2_down_below_clear", 0.0),
        ("passed_3_up_above_clear", 0.6 * series),
        ("escaped_up", 0.6 * series),
    ] {
        let found = account(&seen, account_key);
        // The emitter takes a part of what comes back.
        let allowed = 4.0 * found.standard_error + 1e-3;
        assert!(
            (found.value - expected).abs() < allowed,
            "{account_key}: {found:?} for {expected}"
        );
    }
    let planes = film_light::planes(&seen.ledger());
    let names: Vec<&str> = planes.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["below my_plate", "below clear", "above clear"]);
}

/// Films near to what lies below and above have the planes that there is room for.
#[test]
fn planes_between_films_cut_nothing() {
    let film = |z_mm: f64| {
        format!(
            "{EMITTER}[[films]]\nname = \"film\"\nz_mm = {z_mm:?}\nthickness_mm = 0.25\n\
             medium = {{ index = 1.0 }}\n"
        )
    };
    let spacer = "[[solids]]\nname = \"spacer\"\nkind = \"box\"\nper = \"array\"\n\
        position_mm = [2.0, 0.0, 0.4995]\nsize_mm = [0.5, 0.5, 0.999]\nmedium = { index = 1.0 }\n";
    let planes = |text: &str| -> Vec<String> {
        let (_, seen) = trace(text, 2000);
        film_light::planes(&seen.ledger()).into_iter().map(|(name, _)| name).collect()
    };
    assert_eq!(planes(&film(1.0)), ["below film", "above film"]);
    assert_eq!(planes(&(film(1.0) + spacer)), ["above film"]);
    assert_eq!(planes(&film(0.103)), ["above film"]);
}

/// Films between perfect mirrors neither gain nor lose, whatever their grooves.
#[test]
fn a_white_cell_keeps_all_light() {
    let cell = EMITTER
        .replace("\"absorbing\", extent", "\"lambertian\", reflectance = 1.0, extent")
        .replace(
            "reflectance = 0.0, reflection = \"absorbing\"",
            "reflectance = 1.0, reflection = \"lambertian\"",
        )
        .replace("pitch_mm = 10.0", "pitch_mm = 4.0")
        + "housing = { kind = \"specular\", reflectance = 1.0, inner_size_mm = [4.0, 4.0], height_mm = 3.0 }\n\
           [[films]]\nname = \"plate\"\nz_mm = 1.0\nthickness_mm = 1.0\nmedium = { index = 1.49 }\n\
           top = { kind = \"lambertian\", transmitted = 0.5, reflected = 0.5 }\n\
           bottom = { kind = \"grooves\", profile_um = [[0.0, 0.0], [5.0, 8.0], [30.0, 2.0], [40.0, 0.0]], direction_deg = 20.0 }\n\
           [[films]]\nname = \"prisms\"\nthickness_mm = 0.2\nmedium = { index = 1.586 }\n\
           top = { kind = \"prisms\", pitch_um = 24.0, tip_radius_um = 3.0 }\n";
    let (_, seen) = trace(&cell, 40_000);
    let out = account(&seen, "escaped_up");
    assert!((out.value - 1.0).abs() < 1e-4, "{out:?}");
}
