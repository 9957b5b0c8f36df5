// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media that scatter, through the design file: slabs of others, furnaces, every model, every
//! wavelength.
//!
//! Sources: H. C. van de Hulst, *Multiple Light Scattering*, Table 35, as quoted by L. Wang, S. L.
//! Jacques, L. Zheng, *MCML*, Comput. Methods Programs Biomed. 47, 131 (1995); discrete ordinates
//! for a quantum-dot film; conservation of power.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::runs::{estimate, run_small, run_text, small};
use batwing_tests::tilted_box::{WEDGE, write_box};

/// A black box and floor below a wide plate, lit from below; what is not transmitted or absorbed in
/// the plate is absorbed below.
const BELOW: &str = r#"
name = "slab"
light = { wavelength_nm = 550.0 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5, plane_height_mm = 8.0 }

[[sources]]
name = "lamp"
kind = "cosine"
position_mm = [0.0, 0.0, 1.0]
"#;

fn plate(thickness: f64, medium: &str) -> String {
    format!(
        "[[solids]]\nname = \"plate\"\nkind = \"box\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 5.0]\nsize_mm = [5000.0, 5000.0, {thickness:?}]\nmedium = {{ {medium} }}\n"
    )
}

/// The ledger of a run of 100 000 paths; all power is in it.
fn ledger(text: &str, model: &str, folder: &Path) -> Value {
    let out = format!("run {}", std::fs::read_dir(folder).expect("a folder").count());
    let flags = ["--paths", "100000", "--model", model];
    let run = run_text(folder, "design", text, &out, &flags).unwrap_or_else(|e| panic!("{e}"));
    let models = run["designs"].as_object().expect("designs").values().next().expect("one");
    let ledger =
        models.as_object().expect("models").values().next().expect("one")["power_ledger"].clone();
    let ends = ledger.as_object().expect("a ledger").iter();
    let is_end = |name: &str| ["escaped", "absorbed", "lost"].iter().any(|b| name.starts_with(b));
    let spent: f64 = ends.filter(|(name, _)| is_end(name)).map(|(_, v)| estimate(v).0).sum();
    assert!((spent - 1.0).abs() < 1e-9, "{spent}");
    ledger
}

#[track_caller]
fn assert_account(ledger: &Value, key: &str, expected: f64) {
    let (value, error) = estimate(&ledger[key]);
    assert!((value - expected).abs() < 5.0 * error + 2e-5, "{key}: {value} ± {error}, {expected}");
}

#[test]
fn slabs_of_the_design_file_transmit_and_absorb_as_published() {
    let folder = tempdir().expect("a folder");
    let mcml = "index = 1.0, absorption_per_mm = 1.0, scattering_per_mm = 9.0, g = 0.75";
    let film = "index = 1.0, absorption_per_mm = 3.7, scattering_per_mm = 2.9382, g = [[500, 0.3918], [600, 0.5918]]";
    let beam = BELOW.to_owned() + "exponent = 1e6\n";
    let diffuse = BELOW.to_owned() + "exponent = 1.0\n";
    for (light, thickness, medium, [reflected, transmitted]) in [
        (&beam, 0.2, mcml, [0.09739, 0.66096]),
        (&beam, 0.1, film, [0.026_921, 0.634_482]),
        (&diffuse, 0.1, film, [0.056_573, 0.474_543]),
    ] {
        let found =
            ledger(&format!("{light}{}", plate(thickness, medium)), "geometric", folder.path());
        assert_account(&found, "escaped_up", transmitted);
        assert_account(&found, "absorbed_in_plate", 1.0 - reflected - transmitted);
    }
}

/// A dome that scatters but absorbs nothing, over perfect mirrors, lets everything out.
#[test]
fn a_dome_that_absorbs_nothing_lets_all_light_out() {
    let folder = tempdir().expect("a folder");
    let text = include_str!("../../data/designs/bare-dome.toml");
    let text = text
        .lines()
        .map(|line| if line.starts_with("reflectance") { "reflectance = 1.0" } else { line })
        .collect::<Vec<_>>()
        .join("\n");
    for keys in [
        "scattering_per_mm = 2.0\ng = 0.7",
        "particles = { diameter_um = 2.0, index = 1.6, volume_fraction = 0.002 }",
        "scattering_per_mm = [[400, 3], [700, 1]]\nphase_table = [[0, 1.0], [90, 0.5], [180, 1.0]]",
    ] {
        let text = text.replacen("index = 1.41", &format!("index = 1.41\n{keys}"), 1);
        let found = ledger(&text, "geometric", folder.path());
        for (account, value) in found.as_object().expect("a ledger") {
            let expected = !account.starts_with("absorbed_by_floor");
            let is_loss = account.starts_with("absorbed") || account.starts_with("lost");
            assert!(!(is_loss && expected) || estimate(value).0 < 1e-9, "{account}: {value}");
        }
    }
}

/// Relief by rays, by tables of ray optics and by tables of diffraction orders around silicone
/// that scatters and absorbs: all keep the books, and all see the medium.
#[test]
fn every_model_scatters_in_the_silicone() {
    let folder = small();
    let file = folder.path().join("small.toml");
    let text = std::fs::read_to_string(&file).expect("a design");
    let absorbed = |more: &str, out: &str| -> Vec<(String, (f64, f64))> {
        let text = text.replacen("index = 1.41", &format!("index = 1.41, {more}"), 1);
        assert!(text.contains(more));
        std::fs::write(&file, text).expect("written");
        run_small(folder.path(), out, &["--quiet"]);
        let run = crate::support::runs::results(&folder.path().join(out));
        let models = run["designs"]["small"].as_object().expect("models").clone();
        let of = |model: &Value| estimate(&model["power_ledger"]["absorbed_in_silicone"]);
        models
            .iter()
            .filter(|(_, m)| m["power_ledger"].is_object())
            .map(|(name, m)| (name.clone(), of(m)))
            .collect()
    };
    let clear = absorbed("absorption_per_mm = 0.05", "clear");
    let milky = absorbed("absorption_per_mm = 0.05, scattering_per_mm = 4.0", "milky");
    assert!(clear.len() >= 3, "{clear:?}");
    // Scattering lengthens the ways of light.
    for ((name, (clear, a)), (_, (milky, b))) in clear.iter().zip(&milky) {
        assert!(milky - clear > 5.0 * a.hypot(*b), "{name}: {clear} {milky}");
    }
    let values = milky.iter().map(|(_, milky)| milky.0);
    let [low, high] = values.fold([1.0_f64, 0.0], |[a, b], x| [a.min(x), b.max(x)]);
    assert!(high - low < 0.02, "{milky:?}");
}

/// A box that scatters is the same as a primitive and as a mesh.
#[test]
fn a_mesh_scatters_as_the_box_that_it_is() {
    let folder = tempdir().expect("a folder");
    write_box(&folder.path().join("box.obj"), [1.0, 0.7, 0.3]);
    let light = BELOW.to_owned() + "exponent = 4.0\n";
    let medium = "index = 1.6, absorption_per_mm = 0.3, scattering_per_mm = 4.0, g = 0.5";
    let wedge = WEDGE.replace("index = 1.6", medium);
    let of = |form: &str| {
        let text = format!("{light}[[solids]]\nname = \"wedge\"\n{form}\n{wedge}");
        let found = ledger(&text, "geometric", folder.path());
        ["escaped_up", "absorbed_in_wedge"].map(|key| estimate(&found[key]))
    };
    let whole = of("kind = \"box\"\nsize_mm = [2.0, 1.4, 0.6]");
    let mesh = of("kind = \"mesh\"\nmesh = \"box.obj\"\nmesh_unit = \"mm\"");
    for ((a, ea), (b, eb)) in whole.into_iter().zip(mesh) {
        assert!(a > 0.01 && (a - b).abs() < 5.0 * ea.hypot(eb), "{a} ± {ea}, {b} ± {eb}");
    }
}

/// Values over the wavelength are read at that of the light.
#[test]
fn coefficients_follow_the_wavelength() {
    let medium = "index = 1.5, absorption_per_mm = [[500, 0.1], [600, 0.3]], scattering_per_mm = [[500, 4], [550, 2], [600, 1]], g = [[400, 0.8], [800, 0.4]]";
    let text = format!("{BELOW}exponent = 1.0\n{}", plate(1.0, medium));
    let design = design::parse("a.toml", &text, Path::new("")).expect("valid");
    let at = |nm: f64| {
        let tuned = design.at(nm).expect("covered");
        let medium = tuned.solids[0].medium.clone().expect("a medium");
        let scattering = medium.scattering.expect("it scatters");
        [medium.absorption_per_mm, scattering.per_mm, scattering.optics.phase.mean_cosine()]
    };
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(at(500.0), [0.1, 4.0, 0.7]) && near(at(600.0), [0.3, 1.0, 0.6]));
    assert!(near(at(560.0), [0.22, 1.8, 0.64]), "{:?}", at(560.0));
    let error = design.at(601.0).expect_err("beyond").to_string();
    assert!(
        error.contains("solids[1].medium.absorption_per_mm") && error.contains("500 to 600"),
        "{error}"
    );
}

/// Spheres that are too near to scatter independently are traced, and that is said.
#[test]
fn dense_particles_are_said() {
    let said = |share: f64| -> bool {
        let medium = format!(
            "index = 1.41, particles = {{ diameter_um = 0.5, index = 1.6, volume_fraction = {share} }}"
        );
        let text = format!("{BELOW}exponent = 1.0\n{}", plate(0.01, &medium));
        let design = design::parse("a.toml", &text, Path::new("")).expect("valid");
        let warnings = simulate::warnings::warnings(&design).expect("a scene");
        warnings
            .iter()
            .any(|w| w.contains("solids[1].medium.particles") && w.contains("independently"))
    };
    assert!(said(0.3) && !said(0.01) && !said(0.005));
}
