// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones` where a medium converts light: channels behind filters.

use serde_json::Value;

use metrics::colour_matching;

use crate::support::runs::{estimate, run_text};
use crate::zone_colours::{folder, value, zones};
use crate::zones::boxed;

/// 3 x 3 packages of a blue and a red die. The plate makes light of 600 nm of the blue; the red passes it.
/// Two filters share the light up to 500 nm, one hands on `red` of that from 560 nm on.
fn converted(red: f64) -> String {
    let die = |name: &str, nm: f64| {
        format!(
            "[[sources]]\nname = \"{name} die\"\nchannel = \"{name}\"\nkind = \"rectangle\"\n\
             position_mm = [0.0, 0.0, 0.15]\nsize_mm = [0.1, 0.1]\n\
             spectrum = {{ kind = \"lines\", wavelength_nm = [{nm}], power = [1.0] }}\n\n"
        )
    };
    let filter = |[from, to]: [f64; 2], share: f64| {
        format!(
            "[[panel.sub_pixels]]\nwavelength_nm = [{from}, {to}]\ntransmittance = [{share}, {share}]\n\n"
        )
    };
    let dye = "medium = { index = 1.49, luminophores = [{ name = \"dye\", absorption_per_mm = [[440, 0.4], [460, 0.4]], \
               quantum_yield = 0.9, emission = { wavelength_nm = [599, 600, 601], power = [0, 1, 0] } }] }";
    boxed(3)
        .replace("medium = { index = 1.49 }", dye)
        .replace(
            "wavelength_nm = 550.0",
            "wavelength_nm = 550.0, step_nm = 1.0, weighting = \"photometric\"",
        )
        .replace("power_lm = 8.0", "power_w = 0.03")
        + &die("blue", 450.0)
        + &die("red", 640.0)
        + "[panel]\ncontrast = 1e9\n\n"
        + &filter([560.5, 700.0], red)
        + &filter([400.0, 500.0], 0.5)
        + &filter([400.0, 500.0], 0.5)
}

/// Light that a plate converts: the share of each colour in a channel by its place on the line between
/// both colours, and by a filter that halves one of them.
#[test]
fn channels_of_converted_light_are_mixtures_of_what_is_emitted() {
    let folder = folder();
    let at = folder.path();
    let found = |red: f64, out: &str| {
        std::fs::write(at.join("rgb.toml"), converted(red)).expect("written");
        zones(at, "--pattern full.csv", out)
    };
    let of = |found: &Value, channel: usize| {
        let light = &found["colour"]["channels"][channel]["light"];
        let [x, y] = [0, 1].map(|k| value(&light["xy"][k]));
        let luminance = value(&light["luminance"]);
        [x / y, 1.0, (1.0 - x - y) / y].map(|value| value * luminance)
    };
    let whole = found(1.0, "whole");
    // The red die is seen as it shines.
    let is_of = |[x, y, z]: [f64; 3], of: [f64; 3], rounding: f64| {
        let near = |value: f64, of: f64| (value - of).abs() < rounding;
        near(x / y, of[0] / of[1]) && near(z / y, of[2] / of[1])
    };
    let red = of(&whole, 1);
    assert!(is_of(red, colour_matching::xyz(640.0), 1e-9), "{red:?}");
    // The same paths behind a filter of a half: twice the difference is what is emitted again, and the
    // rest the blue die.
    let (all, half) = (of(&whole, 0), of(&found(0.5, "half"), 0));
    let amber = [0, 1, 2].map(|k| 2.0 * (all[k] - half[k]));
    let blue = [0, 1, 2].map(|k| all[k] - amber[k]);
    assert!(is_of(blue, colour_matching::xyz(450.0), 1e-6), "{blue:?}");
    // Wavelengths of a triangle are drawn.
    assert!(is_of(amber, colour_matching::xyz(600.0), 5e-3), "{amber:?}");
    assert!(amber[1] > blue[1], "{amber:?} {blue:?}");
    // Both channels together are the light of a run, lumens and colour.
    let run = run_text(at, "run", &converted(1.0), "run", &["--paths", "200000"]).expect("results");
    let front = &run["designs"]["boxed"]["geometric"]["receivers"]["front"];
    let white = &whole["colour"]["white"];
    for (name, ours) in
        [("u_prime", &white["uv"][0]), ("v_prime", &white["uv"][1]), ("mean", &white["luminance"])]
    {
        let [(ours, error), (other, noise)] = [ours, &front[name]].map(estimate);
        assert!(error > 0.0 && noise > 0.0, "{white} {front}");
        assert!((ours - other).abs() < 3.5 * error.hypot(noise), "{name}: {ours} {other}");
    }
    // Together the filters pass all light: white of the panel is the light itself. Two are alike, so that
    // no colour lies between the primaries.
    for name in ["u_prime", "v_prime"] {
        let [open, behind] =
            [name.to_owned(), format!("white_{name}")].map(|name| value(&front[&name]));
        assert!((open - behind).abs() < 1e-9, "{name}: {open} {behind}");
    }
    assert!(value(&front["coverage_bt709_xy"]) < 1e-9, "{front}");
    // Three filters that differ: the gamut of a run is that of the zones.
    let text = converted(0.5).replace("[560.5,", "[620.0,");
    let (before, _) = text.rsplit_once("wavelength_nm").expect("a filter");
    let third = "wavelength_nm = [590.0, 650.0]\ntransmittance = [0.5, 0.5]\n";
    let text = format!("{before}{third}");
    std::fs::write(at.join("rgb.toml"), &text).expect("written");
    let ours = zones(at, "--pattern full.csv", "three");
    let run = run_text(at, "three", &text, "run-three", &["--paths", "200000"]).expect("results");
    let front = &run["designs"]["boxed"]["geometric"]["receivers"]["front"];
    for (k, name) in ["coverage_bt2020_xy", "coverage_dci_p3_xy"].into_iter().enumerate() {
        let gamut = &ours["colour"]["gamut"][k]["xy"][1];
        let [(ours, error), (other, noise)] = [gamut, &front[name]].map(estimate);
        assert!(ours > 1e-3 && error > 0.0 && noise > 0.0, "{name}: {gamut} {front}");
        assert!((ours - other).abs() < 3.5 * error.hypot(noise), "{name}: {ours} {other}");
    }
}
