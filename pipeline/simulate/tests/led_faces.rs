// SPDX-License-Identifier: MIT OR Apache-2.0
//! Metal and thin layers on the LED, traced, against normal incidence in closed form: quarter waves
//! of the indices a (towards the light) and b on a metal of index m have the admittance
//! Y = a² m/b² and the reflectance |(1 - Y)/(1 + Y)|².

use std::path::Path;

use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::scene_check;
use simulate::trace::observe;

const PATHS: u64 = 100_000;

/// A narrow beam onto an LED of 2 x 2 x 1 mm over a black floor.
const BEAM: &str = r#"
name = "beam"
mirror = { kind = "absorbing", extent = "array" }
array = { columns = 1, rows = 1, pitch_mm = 40.0 }
receiver = { plane_height_mm = 4.0, bin_mm = 1.0 }
light = { wavelength_nm = 552.0 }
"#;

/// Shares of the light that go up, that the top takes and that the sides take.
fn shares(led: &str, beam: &str) -> [f64; 3] {
    let text = format!(
        "{BEAM}led = {{ size_mm = [2.0, 2.0], height_mm = 1.0, {led} }}\n\
         sources = [{{ name = \"beam\", kind = \"cosine\", exponent = 1e6, {beam} }}]\n"
    );
    let design = design::parse("led.toml", &text, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let env = RunContext::quiet(&interrupt, 43);
    let seen = observe(&design, &surface, PATHS, "", env).expect("a trace");
    ["escaped_up", "absorbed_by_box_top", "absorbed_by_box_side"].map(|name| {
        let accounts = &seen.ledger().accounts;
        accounts.iter().find(|(known, _)| known == name).expect("an account").1.value
    })
}

/// True if all shares are the same.
fn same(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
}

const DOWN: &str = "position_mm = [0.0, 0.0, 3.0], normal = [0.0, 0.0, -1.0]";
const ASIDE: &str = "position_mm = [3.0, 0.0, 0.5], normal = [-1.0, 0.0, 0.0]";

#[test]
fn layers_on_the_led_reflect_as_their_stack() {
    let reflectance = |factor: f64| {
        let [n, k] = [0.06, 3.6].map(|part| factor * part);
        ((1.0 - n).powi(2) + k * k) / ((1.0 + n).powi(2) + k * k)
    };
    let substrate =
        "reflection = \"specular\", reflectance = 1.0, substrate = { index = [0.06, 3.6] }";
    let bare = reflectance(1.0);
    let [up, top, side] = shares(substrate, DOWN);
    let error = (bare * (1.0 - bare) / PATHS as f64).sqrt();
    assert!((up - bare).abs() < 5.0 * error, "{up} for {bare}");
    assert!((up + top - 1.0).abs() < 1e-9 && side == 0.0);
    let quarter =
        |index: f64| format!("{{ index = {index:?}, thickness_nm = {:?} }}", 138.0 / index);
    let (a, b) = (2.35, 1.38);
    let layered = reflectance(a * a / (b * b));
    let coating = format!("{substrate}, coating = [{}, {}]", quarter(a), quarter(b));
    let [up, ..] = shares(&coating, DOWN);
    let error = (layered * (1.0 - layered) / PATHS as f64).sqrt();
    assert!(
        (up - layered).abs() < 5.0 * error && (layered - bare).abs() > 20.0 * error,
        "{up} for {layered}"
    );
}

#[test]
fn sides_of_the_led_have_a_law_of_their_own() {
    let black = "reflection = \"absorbing\"";
    let white = "reflection = \"specular\", reflectance = 1.0";
    let sides = "sides = { kind = \"specular\", reflectance = 1.0 }";
    assert!(same(shares(&format!("{black}, {sides}"), DOWN), [0.0, 1.0, 0.0]));
    let [_, top, side] = shares(&format!("{black}, {sides}"), ASIDE);
    assert!(top <= 0.0 && side <= 0.0);
    assert!(same(shares(black, ASIDE), [0.0, 0.0, 1.0]));
    let dark_sides = "sides = { kind = \"absorbing\" }";
    assert!(same(shares(&format!("{white}, {dark_sides}"), ASIDE), [0.0, 0.0, 1.0]));
    assert!(same(shares(&format!("{white}, {dark_sides}"), DOWN), [1.0, 0.0, 0.0]));
}

/// A table of reflectance is the number where it is constant; else it follows angle and wavelength.
#[test]
fn a_table_on_the_led_reflects_by_angle_and_wavelength() {
    let mirror = |filter: &str| {
        format!("reflection = \"specular\", reflectance = 1.0, filter = {{ {filter} }}")
    };
    let number =
        |share: f64| shares(&format!("reflection = \"specular\", reflectance = {share:?}"), DOWN);
    let constant = shares(&mirror("reflectance = 0.7, transmittance = 0.3"), DOWN);
    assert!(same(constant, number(0.7)) && !same(constant, number(0.6)), "{constant:?}");
    // At 552 nm and 45 degrees; the beam spreads by a tenth of a degree.
    let rows = "reflectance = [[500, 0, 0.2], [500, 5, 0.2], [500, 85, 0.6], [600, 0, 0.4], [600, 5, 0.4], [600, 85, 0.8]]";
    let aslant = "position_mm = [-2.0, 0.0, 3.0], normal = [1.0, 0.0, -1.0]";
    let at_500 = |angle: f64| 0.2 + 0.4 * (angle - 5.0).max(0.0) / 80.0;
    for (beam, angle) in [(DOWN, 0.0), (aslant, 45.0)] {
        let [up, ..] = shares(&mirror(rows), beam);
        let expected = at_500(angle) + 0.52 * 0.2;
        assert!((up - expected).abs() < 1e-3, "{up} for {expected}");
    }
    let kept = mirror(rows).replace("reflectance = 1.0", "reflectance = 0.5");
    let [up, ..] = shares(&kept, DOWN);
    assert!((up - 0.5 * (0.2 + 0.52 * 0.2)).abs() < 1e-3, "{up}");
    let sides = "reflection = \"absorbing\", sides = { kind = \"specular\", reflectance = 1.0, filter = { reflectance = 0.25 } }";
    let [_, top, side] = shares(sides, ASIDE);
    assert!((side - 0.75).abs() < 1e-12 && top <= 0.0, "{side}");
}
