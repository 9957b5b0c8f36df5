// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing grating`: reference cases, given orders, given tolerances, warnings, output.
//!
//! Sources: `data/reference/published.json` (RETICOLO V10, to 1e-9) and `truncated.json` (several
//! codes, to 1e-8); energy conservation; finer runs of the command where it states its own error.

#![expect(
    clippy::print_stdout,
    reason = "the numbers found are what a reader of the test wants to see"
)]

use std::collections::BTreeSet;

use crate::support::binary::batwing;
use crate::support::grating::{Answer, grating};
use batwing_tests::reference_cases::cases;
use batwing_tests::validation_report::{Row, hold};
use serde_json::{Value, json};
use tempfile::tempdir;

const KEYS: [&str; 6] = ["R", "T", "RTE", "RTM", "TTE", "TTM"];

/// Every order of every case is there, and none besides, each within the case's tolerance. The report shows of
/// each case the order that is farthest off, or the strongest where none is off by more than rounding.
fn check(file: &str, prefix: &str, count: usize) {
    let folder = tempdir().expect("a folder");
    let all = cases(file, prefix);
    assert_eq!(all.len(), count, "cases {prefix}* in {file}");
    let mut rows = Vec::new();
    for case in &all {
        let mut compared = Vec::new();
        let answer = grating(folder.path(), case);
        let tolerance = case["tolerance"]["abs"].as_f64().expect("a tolerance");
        assert_eq!(answer.json["N"], case["inputs"]["N"], "{}", case["id"]);
        for (key, expected) in case["outputs"].as_object().expect("outputs") {
            let (ours, expected) = (answer.orders(key), expected.as_object().expect("orders"));
            // Nothing propagates in a metal: what crosses its surface may be listed or not.
            let lossless = key.starts_with('R') || case["inputs"]["n_bottom"][1] == json!(0.0);
            if lossless {
                let present: BTreeSet<String> = ours.keys().map(ToString::to_string).collect();
                let wanted: BTreeSet<String> = expected.keys().cloned().collect();
                assert_eq!(present, wanted, "orders in {key} of {}", case["id"]);
            }
            for (order, reference) in expected {
                let reference = reference.as_f64().expect("a number");
                let value = ours[&order.parse().expect("an order")];
                assert!(
                    (value - reference).abs() <= tolerance,
                    "{}, {key} of order {order}: {value}, expected {reference}",
                    case["id"]
                );
                compared.push((format!("{key} of order {order}"), reference, value));
            }
        }
        let off = |(_, reference, value): &(String, f64, f64)| (value - reference).abs().max(1e-10);
        let shown = compared
            .iter()
            .max_by(|a, b| off(a).total_cmp(&off(b)).then(a.1.total_cmp(&b.1)))
            .expect("an order");
        let name = case["id"].as_str().expect("a name").trim_start_matches(prefix);
        let what = format!("`{name}`, {} of {} values", shown.0, compared.len());
        rows.push(Row::near(&what, shown.1, shown.2, tolerance, 10));
    }
    hold(prefix.trim_end_matches('/'), &rows);
}

#[test]
fn reticolo_cases_agree_as_they_are() {
    check("published.json", "reticolo/", 35);
}

#[test]
#[ignore = "slow: 13 s"]
fn truncated_cases_agree_as_they_are() {
    check("truncated.json", "truncated/", 40);
}

#[test]
fn inputs_alone_are_a_case_too() {
    let folder = tempdir().expect("a folder");
    let case = &cases("published.json", "reticolo/con-loss-s")[0];
    let (whole, inputs) = (grating(folder.path(), case), grating(folder.path(), &case["inputs"]));
    assert_eq!(whole.text, inputs.text);
}

/// A silicone relief under light from the silicone.
fn relief(polygons: &Value, depth: f64, theta: f64, phi: f64) -> Value {
    json!({
        "wavelength": 0.55, "period": 2.0, "n_top": [1.41, 0.0], "n_bottom": [1.0, 0.0],
        "relief": {"depth": depth, "background": [1.0, 0.0], "polygons": polygons},
        "theta_deg": theta, "phi_deg": phi, "pol": "unpolarised",
    })
}

fn with(case: &Value, key: &str, value: Value) -> Value {
    let mut case = case.clone();
    case[key] = value;
    case
}

/// Largest difference of an efficiency of an order.
fn difference(a: &Answer, b: &Answer) -> f64 {
    let mut worst = 0.0_f64;
    for key in ["R", "T"] {
        let (a, b) = (a.orders(key), b.orders(key));
        assert!(a.keys().eq(b.keys()));
        worst = a.iter().fold(worst, |w, (m, v)| w.max((v - b[m]).abs()));
    }
    worst
}

fn reliefs() -> [(&'static str, Value); 4] {
    [
        (
            "triangle",
            relief(
                &json!([{"n": [1.41, 0.0], "points": [[0, 0], [2, 0], [1.6, 0.7]]}]),
                0.7,
                35.0,
                50.0,
            ),
        ),
        (
            "overhang across the border of the period",
            relief(
                &json!([{"n": [1.41, 0.0], "points": [[0, 0], [2, 0], [2.6, 0.5]]}]),
                0.5,
                -20.0,
                0.0,
            ),
        ),
        (
            "core in a coat",
            relief(
                &json!([{"n": [1.41, 0.0], "points": [[0, 0], [2, 0], [1.5, 0.6], [0.5, 0.6]]}, {"n": [2.0, 0.0], "points": [[0.8, 0.1], [1.3, 0.1], [1.0, 0.4]]}]),
                0.6,
                0.0,
                0.0,
            ),
        ),
        (
            "silver ridge",
            relief(
                &json!([{"n": [0.06, 3.6], "points": [[0.3, 0], [1.1, 0], [1.1, 0.1], [0.3, 0.1]]}]),
                0.1,
                15.0,
                30.0,
            ),
        ),
    ]
}

#[test]
#[ignore = "nightly: eleven gratings (30 s)"]
fn nightly_tolerances_are_kept() {
    let folder = tempdir().expect("a folder");
    for (name, case) in reliefs() {
        let tolerance = 3e-3;
        let answer = grating(folder.path(), &with(&case, "tolerance", json!(tolerance)));
        let estimate = answer.number("estimated_error");
        assert!(estimate > 0.0 && estimate <= tolerance, "{name}: estimate {estimate}");
        // Twice the orders on stairs, with slices until 1e-6: another method for dielectrics, whose
        // own error counts.
        let orders = answer.json["N"].as_u64().expect("a number of orders");
        let finer = grating(folder.path(), &with(&case, "N", json!(2 * orders)));
        let error = difference(&answer, &finer);
        let own = finer.number("estimated_error");
        println!(
            "{name}: estimated {estimate:.1e}, off by {error:.1e} from one known to {own:.1e}"
        );
        assert!(error <= estimate + own, "{name}: off by {error}");
        if name != "silver ridge" {
            let finer = grating(folder.path(), &with(&case, "tolerance", json!(tolerance / 30.0)));
            let error = difference(&answer, &finer);
            assert!(error <= estimate, "{name}: off by {error}");
        }
    }
}

/// Dielectric, absorbing and metallic gratings whose limit for infinitely many orders is known from
/// other formulations.
#[test]
#[ignore = "slow: 8 s"]
fn stated_errors_bound_the_departure_from_known_limits() {
    let folder = tempdir().expect("a folder");
    let mut judged = 0;
    for case in cases("published.json", "reticolo/") {
        let limit = &case["converged"];
        if limit.is_null() {
            continue;
        }
        let mut given = case["inputs"].clone();
        let mut questions = vec![given.clone()];
        given.as_object_mut().expect("inputs").remove("N");
        let is_slit_in_metal = case["id"] == json!("reticolo/eot-1.5");
        for tolerance in [1e-2, 1e-3, 1e-4] {
            // What metal in TM and absorption in conical mount need there is more work than one
            // case is allowed.
            let easy = !is_slit_in_metal && case["id"] != json!("reticolo/con-loss-s");
            if tolerance > 5e-3 || easy {
                questions.push(with(&given, "tolerance", json!(tolerance)));
            }
        }
        for question in questions {
            let answer = grating(folder.path(), &question);
            let estimate = answer.number("estimated_error");
            let mut error = 0.0_f64;
            for key in ["R", "T"] {
                let ours = answer.orders(key);
                for (order, known) in limit[key].as_object().expect("orders") {
                    let whole = known[0].as_f64().expect("a number");
                    let own = ours[&order.parse().expect("an order")];
                    error = error.max((own - whole).abs());
                }
            }
            assert!(
                error <= estimate,
                "{}, {}: off by {error:.2e}, stated {estimate:.2e}",
                case["id"],
                question["tolerance"]
            );
            if let Some(tolerance) = question["tolerance"].as_f64() {
                assert!(estimate <= tolerance);
            }
            judged += 1;
        }
    }
    assert!(judged == 40, "{judged}");
}

/// An echelette of aluminium in the mount of Littrow.
fn echelette(index: [f64; 2], pol: &str) -> Value {
    let depth = 0.257_670_164_732_314_24;
    let points = [[0.0, depth], [0.744_107_038_823_084_2, 0.0], [1.0 / 1.2, depth]];
    json!({
        "wavelength": 0.5461, "period": 1.0 / 1.2, "n_top": [1, 0], "n_bottom": index,
        "relief": {"depth": depth, "background": [1, 0], "polygons": [{"n": index, "points": points}]},
        "theta_deg": 19.126_808_407_783_94, "pol": pol,
    })
}

/// Where orders make stairs of metal, boundary integrals answer a tolerance, and say so. The sinusoid
/// has the value of the C method; those of the echelette are recorded from this solver, whose limit
/// `tests/physics/boundary_integral.rs` judges.
#[test]
fn metal_is_solved_by_boundary_integrals() {
    let folder = tempdir().expect("a folder");
    let mut cases = vec![
        (with(&echelette([0.7, 5.7], "p"), "tolerance", json!(1e-2)), -1, 0.8912),
        (with(&echelette([0.7, 5.7], "s"), "tolerance", json!(1e-2)), -1, 0.6654),
    ];
    let sinusoid = json!({
        "wavelength": 0.633, "period": 1.0 / 1.2, "n_top": [1, 0], "n_bottom": [0.0562, 4.2776],
        "profile": {"sinusoid": 0.1}, "theta_deg": 10, "pol": "p", "tolerance": 1e-5,
    });
    cases.push((sinusoid, 1, 0.268_048));
    for (case, order, expected) in cases {
        let answer = grating(folder.path(), &case);
        assert_eq!(answer.json["method"], json!("boundary integral"), "{}", answer.text);
        assert!(answer.json["nodes"].as_u64() > Some(20) && answer.json["N"].is_null());
        assert!(answer.warnings.is_empty(), "{}", answer.warnings);
        let estimate = answer.number("estimated_error");
        assert!(estimate <= case["tolerance"].as_f64().expect("a tolerance"));
        let error = (answer.orders("R")[&order] - expected).abs();
        // The values have four and six digits.
        assert!(error < estimate + 5e-5, "off by {error:.1e}, stated {estimate:.1e}");
        assert!(answer.number("absorbed") > 1e-3, "{}", answer.text);
    }
    let lossless = with(&echelette([0.0, 5.7], "unpolarised"), "tolerance", json!(1e-4));
    let lossless = grating(folder.path(), &lossless);
    assert!((lossless.number("R_total") - 1.0).abs() < 1e-4, "{}", lossless.text);
    for key in ["RTE", "RTM"] {
        let half: f64 = lossless.orders(key).values().sum();
        assert!((half - 0.5).abs() < 1e-4, "{key}: {half}");
    }
}

/// Asserts that a case is solved by orders.
fn assert_by_orders(case: &Value) {
    let folder = tempdir().expect("a folder");
    let answer = grating(folder.path(), case);
    assert_eq!(answer.json["method"], json!("orders"), "{case}");
    assert!(answer.json["slices"].is_u64() && answer.json["nodes"].is_null());
}

/// A dielectric, and metal with given orders, are solved by orders.
#[test]
#[ignore = "nightly: 28 s"]
fn nightly_orders_solve_what_they_are_asked_for() {
    assert_by_orders(&with(&reliefs()[1].1, "tolerance", json!(0.01)));
    assert_by_orders(&with(&echelette([0.7, 5.7], "s"), "N", json!(8)));
}

#[test]
#[ignore = "nightly: a tolerance of metal by stairs (25 s)"]
fn nightly_orders_solve_metal_in_conical_mount() {
    let conical = with(&echelette([0.7, 5.7], "s"), "phi_deg", json!(30));
    assert_by_orders(&with(&conical, "tolerance", json!(0.05)));
}

/// The profile of a triangle and its relief are one grating, by the two methods.
#[test]
fn a_dielectric_profile_agrees_with_the_orders_of_its_relief() {
    let folder = tempdir().expect("a folder");
    let (name, case) = &reliefs()[1];
    let by_orders = grating(folder.path(), &with(case, "tolerance", json!(1e-3)));
    let mut profile = with(case, "tolerance", json!(1e-5));
    profile.as_object_mut().expect("an object").remove("relief");
    profile["profile"] = json!({"points": [[0, 0], [2.6, 0.5]]});
    let by_integrals = grating(folder.path(), &profile);
    assert_eq!(by_integrals.json["method"], json!("boundary integral"));
    let error = difference(&by_orders, &by_integrals);
    let stated = by_orders.number("estimated_error") + by_integrals.number("estimated_error");
    assert!(error <= stated, "{name}: off by {error:.1e}, stated {stated:.1e}");
    assert!(by_integrals.number("absorbed").abs() < 1e-5);
}

#[test]
fn a_relief_takes_a_number_of_orders() {
    let folder = tempdir().expect("a folder");
    for (name, case) in reliefs() {
        let answer = grating(folder.path(), &with(&case, "N", json!(12)));
        assert_eq!(answer.json["N"], json!(12), "{name}");
        let upright = name == "silver ridge";
        assert_eq!(answer.number("slices") <= 1.0, upright, "{name}");
        assert!(answer.warnings.is_empty(), "{name}: {}", answer.warnings);
        let (r, t) = (answer.number("R_total"), answer.number("T_total"));
        let absorbed = answer.number("absorbed");
        assert!((r + t + absorbed - 1.0).abs() < 1e-12, "{name}");
        for (total, key) in [(r, "R"), (t, "T")] {
            let sum: f64 = answer.orders(key).values().sum();
            assert!((sum - total).abs() < 1e-12, "{name}: {key}");
        }
        if upright {
            assert!(absorbed > 0.005, "silver absorbs, got {absorbed}");
        } else {
            assert!(absorbed.abs() < 1e-10, "{name}: {absorbed}");
        }
    }
}

/// A glass triangle on glass with its face to the air and its tip on the glass.
#[test]
fn a_relief_upside_down_is_warned_of() {
    let folder = tempdir().expect("a folder");
    let case = |points: Value| {
        json!({"n_top": [1, 0], "n_bottom": [1.5, 0], "period": 1.0, "wavelength": 0.633, "theta_deg": 20, "pol": "p", "N": 8,
            "relief": {"background": [1, 0], "depth": 0.3, "polygons": [{"n": [1.5, 0], "points": points}]}})
    };
    let upside_down = grating(folder.path(), &case(json!([[0, 0], [1, 0], [0.5, 0.3]])));
    for words in ["case.json", "relief.polygons", "float", "bottom half-space"] {
        assert!(upside_down.warnings.contains(words), "`{words}` in {}", upside_down.warnings);
    }
    let upright = grating(folder.path(), &case(json!([[0, 0.3], [1, 0.3], [0.5, 0]])));
    assert!(upright.warnings.is_empty(), "{}", upright.warnings);
}

#[test]
fn an_upright_relief_is_its_layer() {
    let folder = tempdir().expect("a folder");
    let points = json!([[0.2, 0], [1.0, 0], [1.0, 0.5], [0.2, 0.5]]);
    let as_relief = relief(&json!([{"n": [1.41, 0.0], "points": points}]), 0.5, 25.0, 40.0);
    let mut as_layer = as_relief.clone();
    as_layer.as_object_mut().expect("an object").remove("relief");
    as_layer["layers_top_to_bottom"] = json!([{"thickness": 0.5, "segments": [
        {"x0": 0.0, "x1": 0.1, "n": [1.0, 0.0]}, {"x0": 0.1, "x1": 0.5, "n": [1.41, 0.0]}, {"x0": 0.5, "x1": 1.0, "n": [1.0, 0.0]}]}]);
    let [a, b] = [as_relief, as_layer].map(|c| grating(folder.path(), &with(&c, "N", json!(10))));
    assert!(difference(&a, &b) < 1e-12);
    assert_eq!((&a.json["slices"], &b.json["slices"]), (&json!(1), &json!(1)));
}

#[test]
fn unpolarised_light_is_the_mean_of_s_and_p() {
    let folder = tempdir().expect("a folder");
    let case = with(&reliefs()[0].1, "N", json!(9));
    let [s, p, both] = ["s", "p", "unpolarised"]
        .map(|pol| grating(folder.path(), &with(&case, "pol", json!(pol))));
    for key in KEYS {
        let (s, p) = (s.orders(key), p.orders(key));
        for (m, value) in both.orders(key) {
            assert!((value - 0.5 * (s[&m] + p[&m])).abs() < 1e-13, "{key} of order {m}");
        }
    }
}

#[test]
fn too_few_orders_are_solved_with_a_warning() {
    let folder = tempdir().expect("a folder");
    let answer = grating(folder.path(), &with(&reliefs()[0].1, "N", json!(3)));
    assert_eq!(answer.json["N"], json!(3));
    for words in ["warning", "case.json", "-3..3", "propagate"] {
        assert!(answer.warnings.contains(words), "`{words}` in: {}", answer.warnings);
    }
    assert!(answer.orders("R").keys().all(|m| m.abs() <= 3));
    assert!(answer.number("absorbed").abs() < 1e-10);
    // The energy balance of a truncated problem says nothing of its error; the estimate does.
    let whole = grating(folder.path(), &with(&reliefs()[0].1, "N", json!(24)));
    assert!(
        answer.number("estimated_error") > 100.0 * whole.number("estimated_error"),
        "{} and {}",
        answer.text,
        whole.text
    );
}

/// Digits do not suffice for the orders of such a period: order 0 alone is its effective medium.
#[test]
fn a_period_far_below_the_wavelength_is_an_effective_medium_and_warned_of() {
    let folder = tempdir().expect("a folder");
    let text = include_str!("../findings/g05-deep-subwavelength.json");
    let mut case: Value = serde_json::from_str(text).expect("JSON");
    std::fs::write(folder.path().join("case.json"), text).expect("written");
    let output = batwing(folder.path()).args(["grating", "case.json"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    for words in ["another unit", "tolerance: 1e-5 was not reached within the digits"] {
        assert!(said.contains(words), "`{words}` in: {said}");
    }
    case.as_object_mut().expect("inputs").remove("tolerance");
    let answer = grating(folder.path(), &with(&case, "N", json!(0)));
    assert!((answer.number("R_total") - 0.088_278).abs() < 1e-6, "{}", answer.text);
    assert!(answer.warnings.contains("another unit"), "{}", answer.warnings);
}

#[test]
fn numbers_are_printed_in_their_shortest_form() {
    let folder = tempdir().expect("a folder");
    let answer = grating(folder.path(), &with(&reliefs()[0].1, "N", json!(9)));
    let mut seen = 0;
    for line in answer.text.lines() {
        let Some((_, value)) = line.split_once(": ") else {
            continue;
        };
        let value = value.trim_end_matches(',');
        if let Ok(number) = value.parse::<f64>() {
            let shortest = serde_json::from_str::<Value>(value).expect("JSON").to_string();
            assert_eq!(value, shortest);
            assert_eq!(shortest.parse::<f64>().expect("a number").to_bits(), number.to_bits());
            seen += 1;
        }
    }
    assert!(seen > 40, "{seen} numbers");
}

#[test]
fn common_flags_do_not_change_the_answer() {
    let folder = tempdir().expect("a folder");
    let plain = grating(folder.path(), &with(&reliefs()[1].1, "N", json!(8)));
    for flags in [&["--json"][..], &["--quiet"], &["--threads", "1", "--seed", "9"]] {
        let output = batwing(folder.path())
            .args(["grating", "case.json"])
            .args(flags)
            .output()
            .expect("it runs");
        assert_eq!(String::from_utf8_lossy(&output.stdout), plain.text, "{flags:?}");
    }
}
