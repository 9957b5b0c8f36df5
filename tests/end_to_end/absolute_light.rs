// SPDX-License-Identifier: MIT OR Apache-2.0
//! `led.power_w` and `led.power_lm`: figures and files in W, lm, cd, lx and cd/m².
//!
//! A Lambertian chip of flux Φ and area A has the intensity Φ/π on its axis and the luminance
//! Φ/(π A) everywhere; 683 lm/W times V(λ) make lumens of watts (`data/spectra/`).

use std::path::Path;

use crate::support::binary::{batwing, json};
use crate::support::runs::{estimate, run_text};
use serde_json::Value;
use std::f64::consts::PI;
use tempfile::tempdir;

/// A Lambertian chip in air before a black plane, `array` of them, with a stated flux.
fn chip(power: &str, columns: usize, light: &str) -> String {
    format!(
        r#"
name = "chip"
light = {{ {light} }}
mirror = {{ kind = "absorbing", extent = "package" }}
led = {{ size_mm = [0.4, 0.2], height_mm = 0.1, reflection = "absorbing", {power} }}
array = {{ columns = {columns}, rows = {columns}, pitch_mm = 8.0 }}
receiver = {{ bin_mm = 0.5 }}
trace = {{ paths = 200_000 }}

[[receivers]]
name = "chip"
kind = "luminance"
position_mm = [-4.0, -4.0, 0.11]
size_mm = [0.1, 0.1]
bins = [1, 1]
theta_bin_deg = 30
phi_bin_deg = 360

[[receivers]]
name = "above"
kind = "plane"
position_mm = [0.0, 0.0, 50.0]
size_mm = [1.0, 1.0]
bins = [1, 1]
"#
    )
}

fn model(folder: &Path, text: &str) -> Value {
    let found = run_text(folder, "chip", text, "out", &[]).unwrap_or_else(|e| panic!("{e}"));
    found["designs"]["chip"]["geometric"].clone()
}

/// Checks an estimate to within four of its standard errors and a thousandth.
fn close(of: &Value, expected: f64, what: &str) {
    let (value, error) = estimate(of);
    let off = (value - expected).abs();
    assert!(off <= 4.0 * error + 1e-3 * expected, "{what}: {of}, not {expected}");
}

#[test]
fn a_chip_of_known_flux_has_the_intensity_and_luminance_of_lamberts_law() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    // Photometric by itself, since lumens are stated.
    let text = chip("power_lm = 25.0", 2, "wavelength_nm = 555.0");
    let found = model(at, &text);
    let absolute = &found["absolute"];
    assert_eq!(absolute["packages"], 4);
    let emitted = |of: &str, unit: &str| absolute[of][unit].as_f64().expect("a flux");
    assert!((emitted("emitted", "emitted_lm") - 100.0).abs() < 1e-9);
    assert!((emitted("emitted_per_package", "emitted_w") - 25.0 / 683.0).abs() < 1e-9);
    let figure = |key: &str| &absolute["figures"][key];
    for (key, unit) in
        [("flux_up", "lm"), ("intensity_centre", "cd"), ("illuminance_above_leds", "lx")]
    {
        assert_eq!(figure(key)["unit"], unit, "{key}");
    }
    close(figure("flux_up"), 100.0, "flux");
    close(&figure("flux_up")["per_package"], 25.0, "flux of a package");
    close(figure("intensity_centre"), 100.0 / PI, "intensity");
    let of_package = &figure("intensity_centre")["per_package"];
    close(of_package, 25.0 / PI, "intensity of a package");
    // The cell far above: E = Φ / (π h²) cos⁴, the cosine 0.9936 from each of the four.
    let above = &found["receivers"]["above"];
    assert_eq!(above["unit"], "lx");
    let h: f64 = 50.0 - 0.1;
    let cosine = h / h.hypot(32.0f64.sqrt());
    let expected = 100.0 / PI / (h * h) * cosine.powi(4) * 1e6;
    let (lumens, error) = estimate(&above["flux"]);
    let off = (lumens * 1e6 - expected).abs();
    assert!(off <= 4e6 * error, "{lumens} lm on 1 mm², not {expected} lx");
    // Luminance of the first chip, straight up, from the file.
    assert_eq!(found["receivers"]["chip"]["unit"], "cd/m²");
    let csv = at.join("out/chip/geometric/receivers/chip.csv");
    let csv = std::fs::read_to_string(csv).expect("a file");
    let row: Vec<f64> = csv
        .lines()
        .nth(1)
        .expect("a bin")
        .split(',')
        .map(|n| n.parse().expect("a number"))
        .collect();
    let [value, error] = row[row.len() - 2..] else { panic!("{csv}") };
    let expected = 25.0 / (PI * 0.4e-3 * 0.2e-3);
    assert!((value - expected).abs() <= 4.0 * error, "{csv}, not {expected} cd/m²");
}

#[test]
fn luminance_times_pi_times_area_is_the_flux_at_any_cone() {
    // Places above the chip, far from its edges: all that comes within the cone starts on it.
    let folder = tempdir().expect("a folder");
    let text = chip("power_lm = 25.0", 1, "wavelength_nm = 555.0");
    let cone = |name: &str, end: f64| {
        format!(
            "\n[[receivers]]\nname = \"{name}\"\nkind = \"luminance\"\nposition_mm = [0.0, 0.0, 0.101]\nsize_mm = [0.3, 0.12]\nbins = [3, 3]\ntheta_max_deg = {end:?}\ntheta_bin_deg = {end:?}\nphi_bin_deg = 180\n"
        )
    };
    let cones = [("narrow", 10.0), ("wide", 40.0), ("most", 80.0)];
    let more: String = cones.map(|(name, end)| cone(name, end)).concat();
    let text = text.replace("[-4.0, -4.0, 0.11]", "[0.0, 0.0, 0.11]") + &more;
    let found = model(folder.path(), &text);
    let luminance = 25.0 / (PI * 0.4e-3 * 0.2e-3);
    for (name, end) in cones {
        let receiver = &found["receivers"][name];
        close(&receiver["mean"], luminance, name);
        // Its flux is that of the luminance within the cone.
        let flux = luminance * PI * end.to_radians().sin().powi(2) * 0.3e-3 * 0.12e-3;
        close(&receiver["flux"], flux, name);
        let (nine, error) = estimate(&receiver["nine_points"]);
        assert!(nine <= 1.0 + 4.0 * error && nine > 1.0 - 6.0 * error - 0.1, "{receiver}");
    }
    // A single bin has no points.
    assert!(found["receivers"]["chip"].get("nine_points").is_none());
}

#[test]
fn stated_watts_scale_what_is_otherwise_per_watt() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let per_watt = model(at, &chip("", 1, "wavelength_nm = 450.0").replace(",  }", " }"));
    assert!(per_watt.get("absolute").is_none());
    let stated = model(at, &chip("power_w = 0.25", 1, "wavelength_nm = 450.0"));
    assert_eq!(stated["power_ledger"], per_watt["power_ledger"]);
    assert_eq!(stated["peak_angle_deg"], per_watt["peak_angle_deg"]);
    let flux = |of: &Value| estimate(&of["receivers"]["above"]["flux"]).0;
    assert!((flux(&stated) / flux(&per_watt) - 0.25).abs() < 1e-12);
    close(&stated["absolute"]["figures"]["flux_up"], 0.25, "flux");
    assert_eq!(stated["absolute"]["figures"]["flux_up"]["unit"], "W");
}

#[test]
fn exports_state_the_flux_of_the_design() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let text = chip("power_lm = 25.0", 1, "wavelength_nm = 555.0");
    std::fs::write(at.join("chip.toml"), text).expect("written");
    let export = |flags: &[&str]| {
        let run = batwing(at).args(["export", "chip.toml", "--json"]).args(flags).output();
        let output = run.expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).expect("JSON")
    };
    let number = |of: &Value, key: &str| of[key].as_f64().expect("a number");
    let ies = export(&["--out", "chip.ies"]);
    assert!((number(&ies, "sources_lm") - 25.0).abs() < 1e-9);
    assert!((number(&ies, "flux_lm") - 25.0).abs() < 1e-3);
    // Lumens per lamp of -1 say that candelas are absolute.
    let text = std::fs::read_to_string(at.join("chip.ies")).expect("a file");
    assert!(text.contains("\n1 -1 1 "), "{text}");
    // Input watts are electrical: 0 for unknown, else those of all packages, of results too.
    assert!(text.lines().any(|line| line.trim() == "1 1 0"), "{text}");
    let text = chip("power_lm = 25.0, electrical_w = 0.3", 2, "wavelength_nm = 555.0");
    std::fs::write(at.join("two.toml"), &text).expect("written");
    run_text(at, "two", &text, "out", &[]).unwrap_or_else(|e| panic!("{e}"));
    for from in ["two.toml", "out/chip/geometric"] {
        for out in ["two.ies", "two.ldt"] {
            batwing(at).args(["export", from, "--out", out]).assert().success();
            let told = json(at, &["import", out]);
            assert!((number(&told, "power_w") - 1.2).abs() < 1e-9, "{from}, {out}: {told}");
        }
    }
    let stated = export(&["--out", "chip.ies", "--lumens", "1000"]);
    assert!((number(&stated, "sources_lm") - 1000.0).abs() < 1e-9);
    let rays = export(&["--out", "chip.tm25ray"]);
    let expected = 25.0 / 683.0;
    assert!((number(&rays, "flux_w") / expected - 1.0).abs() < 1e-6, "{rays}");
}
