// SPDX-License-Identifier: MIT OR Apache-2.0
//! Truncated results of other solvers: the same Fourier coefficients, the same factorisation and
//! the same orders must give the same numbers, so these test the implementation to round-off (not
//! the physics: see the converged cases).
//!
//! Source: `data/reference/`, RETICOLO V10 cases to 1e-9, multi-code cases to 1e-8.

use num_complex::Complex64;
use rcwa::relief::{Layer, Segment};
use rcwa::{Bloch, Pol, Side, Stack, Truncation, solve};
use serde_json::Value;
use std::collections::BTreeMap;

#[expect(clippy::disallowed_methods, reason = "tests read the reference cases from their files")]
fn read(file: &str) -> Vec<Value> {
    let path = format!("{}/../data/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let document: Value = serde_json::from_str(&text).unwrap();
    document["cases"].as_array().unwrap().clone()
}

fn complex(value: &Value) -> Complex64 {
    Complex64::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap())
}

fn stack(inputs: &Value) -> Stack {
    let layers = inputs["layers_top_to_bottom"]
        .as_array()
        .unwrap()
        .iter()
        .map(|layer| {
            let segments = layer["segments"]
                .as_array()
                .unwrap()
                .iter()
                .map(|s| Segment {
                    x0: s["x0"].as_f64().unwrap(),
                    x1: s["x1"].as_f64().unwrap(),
                    index: complex(&s["n"]),
                })
                .collect();
            Layer::new(layer["thickness"].as_f64().unwrap(), segments).unwrap()
        })
        .collect();
    let length = |key: &str| inputs[key].as_f64().unwrap();
    Stack::new(
        length("wavelength"),
        length("period"),
        complex(&inputs["n_top"]),
        complex(&inputs["n_bottom"]),
        layers,
    )
    .unwrap()
}

/// Largest difference between our orders and those of the case.
fn worst_difference(case: &Value) -> f64 {
    let inputs = &case["inputs"];
    let stack = stack(inputs);
    let angle = |key: &str| inputs[key].as_f64().unwrap().to_radians();
    let bloch = Bloch::from_angles(&stack, Side::Top, angle("theta_deg"), angle("phi_deg"));
    let truncation = Truncation::new(inputs["N"].as_u64().unwrap() as usize).unwrap();
    let scattering =
        solve(&stack, bloch, truncation).unwrap_or_else(|e| panic!("{}: {e}", case["id"]));
    let pol = match inputs["pol"].as_str().unwrap() {
        "s" => Pol::S,
        "p" => Pol::P,
        other => panic!("polarisation {other}"),
    };
    let from = (Side::Top, 0, pol);
    let parts = |to: (Side, i32), key: &str| match &key[1..] {
        "" => scattering.efficiency(from, to),
        "TE" => scattering.efficiency_in(from, to, Pol::S),
        "TM" => scattering.efficiency_in(from, to, Pol::P),
        other => panic!("output {other}"),
    };
    let mut worst = 0.0_f64;
    for (key, orders) in case["outputs"].as_object().unwrap() {
        let side = if key.starts_with('R') { Side::Top } else { Side::Bottom };
        for (order, value) in orders.as_object().unwrap() {
            let ours = parts((side, order.parse().unwrap()), key);
            worst = worst.max((ours - value.as_f64().unwrap()).abs());
        }
    }
    worst
}

fn check(file: &str, prefix: &str, at_least: usize) {
    let cases: Vec<Value> =
        read(file).into_iter().filter(|c| c["id"].as_str().unwrap().starts_with(prefix)).collect();
    assert!(cases.len() >= at_least, "{} cases of {prefix} in {file}", cases.len());
    let failures: BTreeMap<String, (f64, f64)> = cases
        .iter()
        .filter_map(|case| {
            let (worst, allowed) =
                (worst_difference(case), case["tolerance"]["abs"].as_f64().unwrap());
            (worst.is_nan() || worst > allowed)
                .then(|| (case["id"].as_str().unwrap().to_owned(), (worst, allowed)))
        })
        .collect();
    assert!(failures.is_empty(), "worst difference and tolerance: {failures:#?}");
}

#[test]
fn reticolo_cases_agree_to_1e_9() {
    check("published.json", "reticolo/", 31);
}

#[test]
fn multi_code_cases_agree_to_1e_8() {
    check("truncated.json", "truncated/", 40);
}
