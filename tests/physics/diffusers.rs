// SPDX-License-Identifier: MIT OR Apache-2.0
//! Diffusers by formula in traced designs: stated shares, far fields and sums of reflections in
//! closed form, and energy.

use std::path::Path;

use batwing_tests::judgement::{PATHS, account, alike, close};
use metrics::jackknife;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

/// A box in air, all black, under a beam that goes up.
const BLACK: &str = r#"
name = "bare"
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
sources = [{ name = "beam", kind = "cosine", exponent = 1e6, position_mm = [0.0, 0.0, 1.0] }]
receivers = [{ name = "rings", kind = "far_field", theta_bin_deg = 10.0, phi_bin_deg = 360.0 }]
"#;
const LIGHT: &str = "light = { wavelength_nm = 550.0 }\n";
/// 2√(2 ln 2).
const WIDTH_OVER_DEVIATION: f64 = 2.354_820_045_030_949;

fn trace(text: &str) -> Observation {
    let design = design::parse("diffuser.toml", text, Path::new(""));
    let design = design.unwrap_or_else(|error| panic!("{error}"));
    scene_check::check(&design).unwrap_or_else(|error| panic!("{error:#}"));
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 31);
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    observe(&design, &surface, PATHS, "", env).expect("a trace")
}

/// A sheet across the beam, of three lines.
fn sheet(scatter: &str) -> String {
    format!(
        "solids = [\n{{ name = \"plate\", kind = \"disc\", per = \"array\", position_mm = [0.0, 0.0, 20.0], radius_mm = 500.0, scatter = {scatter} }},\n]\n"
    )
}

/// Judges the rings above the plate, whose power up to an angle is `cumulated`.
fn judge_rings(seen: &Observation, cumulated: impl Fn(f64) -> f64) {
    for ring in 0..9_u32 {
        let [low, high] = [ring, ring + 1].map(|k| (10.0 * f64::from(k)).to_radians());
        let found = jackknife(&seen.receivers[0], |all| all[ring as usize]);
        close("ring", found, cumulated(high) - cumulated(low));
    }
}

#[test]
fn light_behind_a_lambertian_sheet_follows_the_cosine_law() {
    let plate = sheet("{ kind = \"lambertian\", transmitted = 0.6, reflected = 0.3 }");
    let seen = trace(&format!("{LIGHT}{BLACK}{plate}"));
    close("through", account(&seen, "escaped_up"), 0.6);
    close("absorbed", account(&seen, "absorbed_by_plate"), 0.1);
    judge_rings(&seen, |theta| 0.6 * theta.sin().powi(2));
}

/// ∫ exp(-α²/(2σ²)) sin α dα from 0, by Simpson's rule.
fn gaussian_up_to(alpha: f64, width_deg: f64) -> f64 {
    let sigma = width_deg.to_radians() / WIDTH_OVER_DEVIATION;
    let steps = 400;
    let h = alpha / f64::from(steps);
    let at = |k: i32| {
        let x = h * f64::from(k);
        let weight = match k {
            _ if k == 0 || k == steps => 1.0,
            _ if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        weight * (-0.5 * (x / sigma).powi(2)).exp() * x.sin()
    };
    h / 3.0 * (0..=steps).map(at).sum::<f64>()
}

#[test]
fn light_behind_a_gaussian_sheet_has_the_stated_width() {
    for width in [15.0, 60.0, 180.0] {
        let plate = sheet(&format!(
            "{{ kind = \"gaussian\", transmitted = 0.75, reflected = 0.2, width_deg = {width:?} }}"
        ));
        let seen = trace(&format!("{LIGHT}{BLACK}{plate}"));
        close("through", account(&seen, "escaped_up"), 0.75);
        close("absorbed", account(&seen, "absorbed_by_plate"), 0.05);
        let whole = gaussian_up_to(0.5 * std::f64::consts::PI, width);
        judge_rings(&seen, |theta| 0.75 * gaussian_up_to(theta, width) / whole);
    }
}

/// From the middle of a convex body that reflects r inwards and absorbs a, the share a/(1 - r) is
/// absorbed, whatever the directions.
#[test]
fn reflections_within_a_ball_add_up_to_a_geometric_series() {
    let source = "sources = [{ name = \"s\", kind = \"isotropic\", position_mm = [0.0, 0.0, 5.0], inside = \"ball\" }]\n";
    let black = BLACK.replace("sources", "#");
    let black = black.replace("bin_mm", "plane_height_mm = 7.0, bin_mm");
    for (law, index) in [
        ("kind = \"lambertian\"", 1.0),
        ("kind = \"lambertian\"", 1.6),
        ("kind = \"gaussian\", width_deg = 35.0", 1.0),
        ("kind = \"gaussian\", width_deg = 35.0, reflected_width_deg = 0.001", 1.0),
    ] {
        let ball = format!(
            "solids = [{{ name = \"ball\", kind = \"sphere\", position_mm = [0.0, 0.0, 5.0], radius_mm = 1.0, medium = {{ index = {index:?} }}, scatter = {{ {law}, transmitted = 0.4, reflected = 0.5 }} }}]\n"
        );
        let seen = trace(&format!("{LIGHT}{source}{black}{ball}"));
        close(law, account(&seen, "absorbed_by_ball"), 0.2);
    }
}

/// White walls, a white box and diffusers with shares that add up to one: all light leaves upwards.
#[test]
fn diffusers_of_whole_shares_keep_all_light() {
    let white = r#"
name = "white"
mirror = { kind = "lambertian", reflectance = 1.0, extent = "array" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 1.0, reflection = "lambertian" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
housing = { distance_mm = 4.0, height_mm = 12.0, kind = "specular", reflectance = 1.0, floor = { kind = "lambertian", reflectance = 1.0 } }
solids = [
    { name = "plate", kind = "rectangle", per = "array", position_mm = [0.0, 0.0, 9.0], size_mm = [8.0, 8.0], rotation_deg = [3.0, 0.0, 0.0], scatter = { kind = "gaussian", transmitted = 0.3, reflected = 0.7, width_deg = 25.0 } },
    { name = "block", kind = "box", per = "array", position_mm = [0.0, 0.0, 5.0], size_mm = [5.0, 5.0, 2.0], medium = { index = 1.5 }, scatter = { kind = "gaussian", transmitted = 0.9, reflected = 0.1, width_deg = 50.0 } },
    { name = "ball", kind = "sphere", per = "array", position_mm = [0.0, 0.0, 5.0], radius_mm = 0.8, medium = { index = 1.2 }, scatter = { kind = "lambertian", transmitted = 0.58, reflected = 0.42 } },
]
"#;
    let carried = "light = { wavelength_nm = 550.0, polarization = \"carried\" }\n";
    let [plain, polarised] = [LIGHT, carried].map(|light| {
        let seen = trace(&format!("{light}{white}trace = {{ max_interactions = 100000 }}\n"));
        close("up", account(&seen, "escaped_up"), 1.0);
        for name in ["plate", "block", "ball"] {
            let absorbed = account(&seen, &format!("absorbed_by_{name}"));
            assert!(absorbed.value.abs() < 1e-12, "{name}: {absorbed:?}");
        }
        seen
    });
    for bin in 0..10 {
        let of = |seen: &Observation| jackknife(&seen.far_field, |all| all[bin]);
        alike("far field", of(&plain), of(&polarised));
    }
    assert!(polarised.depolarised_by.iter().any(|name| name == "plate"));
}
