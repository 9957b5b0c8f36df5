// SPDX-License-Identifier: MIT OR Apache-2.0
//! `trace.ledger_by_source`: the power ledger of each source, and their sum.
//!
//! Sources: Beer's law; the weighted sum of the ledgers.

use crate::support::runs::{estimate, run_text};
use batwing_tests::ray_files::dome::{DOME, folder, source, write_two_tables};
use serde_json::{Value, json};
use tempfile::tempdir;

/// A ball of one index with the air, which absorbs, over a black floor; in its middle a source of 3
/// W, above it a beam of 1 W that goes up.
const BALL: &str = r#"
name = "ball"
light = { wavelength_nm = 550.0 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5, plane_height_mm = 6.0 }
trace = { paths = 200_000, ledger_by_source = true }

[[solids]]
name = "ball"
kind = "sphere"
position_mm = [0.0, 0.0, 1.5]
radius_mm = 1.0
medium = { index = 1.0, absorption_per_mm = 0.7 }
"#;

const SOURCES: &str = r#"
[[sources]]
name = "inner"
kind = "isotropic"
position_mm = [0.0, 0.0, 1.5]
inside = "ball"
power = 3.0

[[sources]]
name = "beam"
kind = "cosine"
exponent = 1e6
position_mm = [0.0, 0.0, 3.0]
"#;

fn entry<'a>(ledger: &'a Value, key: &str) -> &'a Value {
    let found = &ledger[key];
    assert!(found.is_object(), "no {key} in {ledger}");
    found
}

#[track_caller]
fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-9, "{a} for {b}");
}

/// Escaped, absorbed and lost of a ledger: all that was emitted.
fn ends(ledger: &Value) -> f64 {
    let entries = ledger.as_object().expect("a ledger").iter();
    let ends = entries.filter(|(name, _)| {
        let begins = ["escaped", "absorbed", "lost"];
        begins.iter().any(|begin| name.starts_with(begin))
    });
    ends.map(|(_, value)| estimate(value).0).sum()
}

#[test]
fn each_of_two_sources_has_the_ledger_of_its_closed_form() {
    let folder = tempdir().expect("a folder");
    let text = format!("{BALL}{SOURCES}");
    let run = run_text(folder.path(), "ball", &text, "r", &[]).expect("it runs");
    let model = &run["designs"]["ball"]["geometric"];
    let of = |name: &str| &model["spectrum"]["by_source"][name];
    let (inner, beam) = (of("inner"), of("beam"));
    near(inner["emitted_w"].as_f64().expect("W"), 0.75);
    near(beam["emitted_w"].as_f64().expect("W"), 0.25);
    // By Beer's law over the radius; half of what is left goes up, and the floor takes the rest.
    let passes = (-0.7_f64).exp();
    let (inner, beam) = (&inner["power_ledger"], &beam["power_ledger"]);
    for (key, expected) in [("absorbed_in_ball", 1.0 - passes), ("escaped_up", 0.5 * passes)] {
        let (value, error) = estimate(entry(inner, key));
        let off = (value - expected).abs();
        assert!(
            off < 5.0 * error.max(1e-9) && error < 3e-3,
            "{key}: {value} ± {error} for {expected}"
        );
    }
    near(ends(inner), 1.0);
    near(estimate(entry(beam, "escaped_up")).0, 1.0);
    near(estimate(entry(beam, "absorbed_in_ball")).0, 0.0);
    near(ends(beam), 1.0);
    // One light, as without the key, and the ledger of all: the parts by power.
    let lights = model["spectrum"]["light"]["sources"].as_array().expect("a list");
    assert_eq!((lights.len(), &lights[0]["sources"]), (1, &json!(["inner", "beam"])));
    for (key, whole) in model["power_ledger"].as_object().expect("a ledger") {
        assert_eq!(estimate(entry(&lights[0]["power_ledger"], key)), estimate(whole), "{key}");
    }
    for (key, whole) in model["power_ledger"].as_object().expect("a ledger") {
        let [inner, beam] = [inner, beam].map(|ledger| estimate(entry(ledger, key)).0);
        near(estimate(whole).0, 0.75 * inner + 0.25 * beam);
    }

    let without = text.replace(", ledger_by_source = true", "");
    let run = run_text(folder.path(), "ball", &without, "w", &[]).expect("it runs");
    let plain = &run["designs"]["ball"]["geometric"];
    assert!(plain.get("spectrum").is_none());
    let (whole, parts) = (&plain["power_ledger"], &model["power_ledger"]);
    let [a, b] = [whole, parts].map(|ledger| estimate(entry(ledger, "absorbed_in_ball")));
    assert!((a.0 - b.0).abs() < 5.0 * a.1.hypot(b.1), "{a:?} {b:?}");

    let said = run_text(folder.path(), "ball", BALL, "n", &[]).expect_err("without sources");
    let expected = "ball.toml: trace.ledger_by_source = true: expected [[sources]] beside it";
    assert!(said.contains(expected), "{said}");
}

#[test]
fn sources_of_several_lights_and_those_that_share_one_have_ledgers_each() {
    let folder = folder();
    let at = folder.path();
    write_two_tables(&at.join("both.tm25ray"));
    let point = |name: &str, x: f64| {
        format!(
            "[[sources]]\nname = \"{name}\"\nkind = \"isotropic\"\nposition_mm = [{x:?}, 0.0, 0.5]\n"
        )
    };
    let both = source("both", "both.tm25ray", "power = 2.0\nsamples = 1");
    let text = DOME.replace("256_000", "64_000, ledger_by_source = true");
    let text = format!("{text}{}{both}{}", point("a", 0.8), point("b", -0.8));
    let run = run_text(at, "rays", &text, "r", &[]).expect("it runs");
    let model = &run["designs"]["rays"]["geometric"];
    let lights = model["spectrum"]["light"]["sources"].as_array().expect("a list");
    let names: Vec<&Value> = lights.iter().map(|light| &light["sources"]).collect();
    assert_eq!(names, [&json!(["a", "b"]), &json!(["both"]), &json!(["both"])]);
    let of = model["spectrum"]["by_source"].as_object().expect("sources");
    assert_eq!(of.keys().collect::<Vec<_>>(), ["a", "b", "both"]);
    for (name, power) in [("a", 0.25), ("both", 0.5), ("b", 0.25)] {
        near(of[name]["emitted_w"].as_f64().expect("W"), power);
        near(estimate(entry(&of[name]["power_ledger"], "emitted")).0, 1.0);
        near(ends(&of[name]["power_ledger"]), 1.0);
    }
    for key in ["escaped_up", "out_of_domes", "absorbed_by_floor"] {
        let Some(whole) = model["power_ledger"].get(key) else {
            continue;
        };
        let parts = of.values().map(|source| {
            let power = source["emitted_w"].as_f64().expect("W");
            power * estimate(entry(&source["power_ledger"], key)).0
        });
        near(parts.sum(), estimate(whole).0);
    }
}
