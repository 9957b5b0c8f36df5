// SPDX-License-Identifier: MIT OR Apache-2.0
//! Polarising films: Malus, unpolarised light, crossed sheets in diffuse light, Fresnel at Brewster's
//! angle, and recycling over white and over specular mirrors.
//!
//! Sources: Malus; P. Yeh, J. Opt. Soc. Am. 72, 507 (1982); Fresnel with all inner reflections. Of
//! light that goes up a sheet transmits t and returns r; a white mirror sends R of that up again,
//! unpolarised: t/(1 - r R) gets through.

use std::f64::consts::PI;
use std::path::Path;

use batwing_tests::judgement::{PATHS, account, alike, close};
use metrics::{Estimate, jackknife};
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

/// A small Lambertian emitter on a wide floor.
const EMITTER: &str = r#"
name = "emitter"
mirror = { kind = "absorbing", extent = "array" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 1000.0 }
receiver = { bin_mm = 10.0, plane_height_mm = 40.0 }
light = { wavelength_nm = 550.0, polarization = "carried" }
"#;
const BEAM: &str = "sources = [{ name = \"beam\", kind = \"cosine\", exponent = 1e6, position_mm = [0.0, 0.0, 0.2] }]\n";
const IDEAL: &str = "pass = { transmittance = 1.0 }, block = { reflectance = 1.0 }";

/// A sheet in air.
fn sheet(name: &str, z_mm: f64, keys: &str) -> String {
    format!(
        "[[films]]\nname = \"{name}\"\nz_mm = {z_mm:?}\nthickness_mm = 0.1\nsize_mm = [5000.0, 5000.0]\n\
         medium = {{ index = 1.0 }}\ntop = {{ kind = \"polariser\", {keys} }}\n"
    )
}

/// A filter in air.
fn filter(keys: &str) -> String {
    sheet("film", 1.0, keys).replace("polariser", "filter")
}

/// A sheet that absorbs what it does not pass.
fn absorbing(name: &str, z_mm: f64, axis_deg: f64) -> String {
    sheet(name, z_mm, &format!("axis_deg = {axis_deg:?}, pass = {{ transmittance = 1.0 }}"))
}

fn trace(text: &str) -> Observation {
    trace_paths(text, PATHS)
}

fn trace_paths(text: &str, paths: u64) -> Observation {
    let design = design::parse("film.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let env = RunContext::quiet(&interrupt, 31);
    let seen = observe(&design, &surface, paths, "", env).expect("a trace");
    assert!(seen.ledger().surplus().abs() < 1e-9);
    seen
}

fn up(text: &str) -> Estimate {
    account(&trace(text), "escaped_up")
}

#[test]
fn unpolarised_light_sees_the_mean_of_both_axes() {
    let keys = "axis_deg = 20.0, pass = { transmittance = 0.9, reflectance = 0.05 }, \
                block = { transmittance = 0.02, reflectance = 0.93 }";
    let seen = trace(&format!("{EMITTER}{}", sheet("film", 1.0, keys)));
    close("through", account(&seen, "escaped_up"), 0.46);
    close("absorbed", account(&seen, "absorbed_by_film"), 0.05);
    // Two numbers for unpolarised light say the same, without polarised light.
    let plain = EMITTER.replace(", polarization = \"carried\"", "");
    let seen = trace(&format!("{plain}{}", filter("transmittance = 0.46, reflectance = 0.49")));
    close("through", account(&seen, "escaped_up"), 0.46);
    close("absorbed", account(&seen, "absorbed_by_film"), 0.05);
    // The mean over Lambert's law of what falls from 0.8 to 0 along straight lines in the angle:
    // the integral of 0.8 (1 - θ/(π/2)) sin 2θ over θ is 0.8/2.
    let keys = "pass = { transmittance = [[0.0, 0.8], [90.0, 0.0]] }, \
                block = { transmittance = [[500.0, 0.0, 0.4], [600.0, 0.0, 0.2]] }";
    close("by angle", up(&format!("{EMITTER}{}", sheet("film", 1.0, keys))), 0.5 * (0.4 + 0.3));
}

#[test]
fn two_sheets_follow_malus() {
    for degrees in [0.0_f64, 30.0, 45.0, 60.0, 90.0] {
        let pair = absorbing("low", 1.0, 12.0) + &absorbing("high", 2.0, 12.0 + degrees);
        let cos = degrees.to_radians().cos();
        close("Malus", up(&format!("{EMITTER}{BEAM}{pair}")), 0.5 * cos * cos);
    }
}

#[test]
fn crossed_sheets_leak_diffuse_light_as_yeh_says() {
    // Mean over Lambert's law by the midpoint rule, even in sin² θ and φ.
    let steps = 400_u32;
    let mut leak = 0.0;
    for i in 0..steps {
        let sin2 = (f64::from(i) + 0.5) / f64::from(steps);
        for j in 0..steps {
            let (sin, cos) = (0.5 * PI * (f64::from(j) + 0.5) / f64::from(steps)).sin_cos();
            let (x2, y2) = (sin2 * cos * cos, sin2 * sin * sin);
            leak += 0.5 * x2 * y2 / ((1.0 - x2) * (1.0 - y2)) / f64::from(steps * steps);
        }
    }
    let pair = absorbing("low", 1.0, 0.0) + &absorbing("high", 2.0, 90.0);
    assert!(leak > 0.01);
    close("leak", up(&format!("{EMITTER}{pair}")), leak);
}

/// A tilted plate at Brewster's angle lets p through and returns a part of s.
#[test]
fn a_sheet_selects_p_at_brewsters_angle() {
    let n: f64 = 1.5;
    let tilt = n.atan().to_degrees();
    let plate = format!(
        "[[solids]]\nname = \"plate\"\nkind = \"box\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 25.0]\n\
         size_mm = [20.0, 20.0, 1.0]\nrotation_deg = [{tilt:?}, 0.0, 0.0]\nmedium = {{ index = {n:?} }}\n"
    );
    // What the plate returns passes beside.
    let above = "[[receivers]]\nname = \"above\"\nkind = \"plane\"\nposition_mm = [0.0, 0.0, 35.0]\n\
                 size_mm = [12.0, 12.0]\nbins = [1, 1]\n";
    let r = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
    for (axis_deg, through) in [(90.0, 1.0), (0.0, (1.0 - r) / (1.0 + r))] {
        let text = format!("{EMITTER}{BEAM}{plate}{above}{}", absorbing("film", 2.0, axis_deg));
        let found = jackknife(&trace(&text).receivers[0], |all| all[0]);
        close("plate", found, 0.5 * through);
    }
}

#[test]
#[ignore = "slow: 4 s"]
fn what_a_sheet_returns_gains_over_white_and_not_over_a_mirror() {
    let over = |kind: &str, reflectance: f64, film: &str| {
        let floor = format!("\"{kind}\", reflectance = {reflectance:?}, extent");
        let of_box = format!("reflectance = {reflectance:?}, reflection = \"{kind}\"");
        let text = EMITTER.replace("\"absorbing\", extent", &floor);
        let text = text.replace("reflectance = 0.0, reflection = \"absorbing\"", &of_box);
        // Light comes back often: few paths take long.
        let seen = trace_paths(&format!("{text}{film}"), PATHS / 4);
        account(&seen, "escaped_up")
    };
    for reflectance in [0.5, 0.95] {
        let closed = 0.5 / (1.0 - 0.5 * reflectance);
        let ideal = sheet("film", 1.0, IDEAL);
        close("white", over("lambertian", reflectance, &ideal), closed);
        // A mirror sends back what the sheet has refused, in the same polarisation.
        close("mirror", over("specular", reflectance, &ideal), 0.5);
    }
    let real = "axis_deg = 33.0, pass = { transmittance = 0.9, reflectance = 0.06 }, \
                block = { transmittance = 0.03, reflectance = 0.95 }";
    close("real", over("lambertian", 0.9, &sheet("film", 1.0, real)), 0.465 / (1.0 - 0.505 * 0.9));
    // Two numbers hold at every pass.
    let two = filter("transmittance = 0.465, reflectance = 0.505");
    close("two numbers", over("lambertian", 0.9, &two), 0.465 / (1.0 - 0.505 * 0.9));
}

/// A film between two sheets in the same direction: one that scatters, or of a medium that does,
/// leaves half of its light for the upper one; clear plates and gaps keep all.
#[test]
#[ignore = "slow: 4 s"]
fn diffusers_depolarise_and_plates_do_not() {
    let between = |film: &str| {
        let low = absorbing("low", 1.0, 40.0);
        let film = format!(
            "[[films]]\nname = \"between\"\nz_mm = 1.5\nthickness_mm = 0.1\nsize_mm = [5000.0, 5000.0]\n{film}\n"
        );
        let high = absorbing("high", 2.0, 40.0);
        up(&format!("{EMITTER}{BEAM}{low}{film}{high}"))
    };
    let diffuser = "medium = { index = 1.0 }\ntop = { kind = \"lambertian\", transmitted = 0.8, reflected = 0.0 }";
    close("diffuser", between(diffuser), 0.5 * 0.8 * 0.5);
    // Five scatterings, nearly straight on.
    let milk = "medium = { index = 1.0, scattering_per_mm = 50.0, g = 0.999 }";
    let unscattered = (-5.0_f64).exp();
    let milky = between(milk);
    let expected = 0.5 * (unscattered + 0.5 * (1.0 - unscattered));
    // A thousandth of the light is scattered back.
    assert!((milky.value - expected).abs() < 1e-3, "{milky:?} for {expected}");
    let plate = "medium = { index = 1.5 }";
    let r = 0.04_f64;
    close("plate", between(plate), 0.5 * (1.0 - r) / (1.0 + r));
    // Light up the axis leaves a plate with shallow prisms as p and s: each prism is a Fresnel
    // interface whose plane of incidence is across its ridges.
    let n: f64 = 1.5;
    let flank = 15.0_f64.to_radians();
    let out = (n * flank.sin()).asin();
    let [s, p] = [
        (n * flank.cos() - out.cos()) / (n * flank.cos() + out.cos()),
        (flank.cos() - n * out.cos()) / (flank.cos() + n * out.cos()),
    ];
    let prisms = |direction_deg: f64| {
        between(&format!(
            "medium = {{ index = {n} }}\ntop = {{ kind = \"prisms\", apex_deg = 150.0, direction_deg = {direction_deg:?} }}"
        ))
    };
    // Ridges along the pass axis: E is along the ridges, s; across them p. Their difference is that of
    // the transmittances but for what comes back once more.
    let (along, across) = (prisms(40.0), prisms(130.0));
    assert!(along.value > 0.44, "{along:?}");
    let difference = 0.5 * (1.0 - r) * (s * s - p * p);
    let found = across.value - along.value;
    assert!((found - difference).abs() < 0.15 * difference + 0.002, "{found} for {difference}");
}

/// Films of all kinds between white walls lose nothing and gain nothing.
#[test]
fn a_white_cell_keeps_all_polarised_light() {
    let cell = EMITTER
        .replace("\"absorbing\", extent", "\"lambertian\", reflectance = 1.0, extent")
        .replace(
            "reflectance = 0.0, reflection = \"absorbing\"",
            "reflectance = 1.0, reflection = \"lambertian\"",
        )
        .replace("pitch_mm = 1000.0", "pitch_mm = 4.0")
        .replace("bin_mm = 10.0", "bin_mm = 0.5")
        + "housing = { kind = \"specular\", reflectance = 1.0, inner_size_mm = [4.0, 4.0], height_mm = 3.0 }\n\
           [[films]]\nname = \"prisms\"\nz_mm = 1.0\nthickness_mm = 0.2\nmedium = { index = 1.586 }\n\
           top = { kind = \"prisms\", pitch_um = 24.0, tip_radius_um = 3.0 }\n\
           [[films]]\nname = \"sheet\"\nthickness_mm = 0.2\nmedium = { index = 1.5 }\n\
           top = { kind = \"polariser\", axis_deg = 25.0, pass = { transmittance = 0.93, reflectance = 0.07 }, \
           block = { transmittance = 0.02, reflectance = 0.98 } }\n";
    let out = up(&cell);
    assert!((out.value - 1.0).abs() < 1e-4, "{out:?}");
}

/// Any number of threads gives the same bits.
#[test]
fn threads_change_no_bit() {
    let text = format!(
        "{}{}",
        EMITTER.replace("\"absorbing\", extent", "\"lambertian\", reflectance = 0.9, extent"),
        sheet("film", 1.0, IDEAL)
    );
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| trace(&text))
    };
    let [one, two] = [1, 2].map(of);
    assert_eq!(one.far_field, two.far_field);
    assert_eq!(one.powers, two.powers);
    alike("up", account(&one, "escaped_up"), account(&two, "escaped_up"));
}
