// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing converge` and `batwing near-field`: files, and agreement with the solver.
//!
//! Sources: README.md and `docs/guide/near-fields.md` for the files; R and T from a direct solve;
//! the solver's bound of 1e-10 on the energy balance.

use std::path::Path;

use rcwa::{Bloch, Pol, Side, Truncation, solve};
use serde_json::Value;
use tempfile::tempdir;

use gratings::interface::interface;
use simulate::cells;

use crate::support::binary::batwing;

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/designs/d1.toml");

/// The JSON document that a command prints; everything else it says must be nothing.
fn printed(folder: &Path, arguments: &[&str]) -> Value {
    let output =
        batwing(folder).args(arguments).args(["--json", "--quiet"]).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.is_empty(), "{stderr}");
    serde_json::from_slice(&output.stdout).expect("one JSON document")
}

fn written(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn errors_fall_with_orders_and_slices_and_cost_grows() {
    let folder = tempdir().expect("a folder");
    let json = printed(
        folder.path(),
        &[
            "converge", DESIGN, "--ring", "15", "--orders", "28,34,42", "--slices", "4,12,24",
            "--out", "out",
        ],
    );
    let study = &json["study"];
    assert!(study["worst_energy_residual"].as_f64().expect("a number") < 1e-10);
    for (sweep, what, file) in [
        ("by_orders", "orders", "D1-ring-015-convergence-orders.csv"),
        ("by_slices", "slices", "D1-ring-015-convergence-slices.csv"),
    ] {
        let points = study[sweep].as_array().expect("points");
        let of = |key: &str| -> Vec<f64> {
            points
                .iter()
                .map(|p| p[key].as_f64().or(p["errors"][key].as_f64()).expect("a number"))
                .collect()
        };
        assert_eq!(points.len(), 3);
        assert!(of(what).is_sorted_by(|a, b| a < b));
        assert!(of("operations_per_problem").is_sorted_by(|a, b| a < b));
        for key in ["rms", "percentile_99", "flux_weighted_mean", "largest_order"] {
            let errors = of(key);
            assert!(errors[2] < 0.5 * errors[0], "{sweep}, {key}: {errors:?}");
        }
        for (mean, rest) in of("flux_weighted_mean")
            .iter()
            .zip(of("rms").iter().zip(of("percentile_99").iter().zip(of("max"))))
        {
            let (rms, (most, max)) = rest;
            assert!(mean <= rms && rms <= &max && *most <= max);
        }
        let csv = String::from_utf8(written(folder.path(), &format!("out/{file}"))).expect("text");
        assert!(csv.starts_with("orders,slices,error_flux_weighted_mean,"));
        assert_eq!(csv.lines().count(), 4);
    }
    let png = written(folder.path(), "out/D1-ring-015-convergence.png");
    assert!(png.starts_with(b"\x89PNG"));
    let file: Value =
        serde_json::from_slice(&written(folder.path(), "out/D1-ring-015-convergence.json"))
            .expect("JSON");
    assert_eq!(file, json, "--json prints what is written");
}

#[test]
fn a_field_has_the_solvers_reflectance_and_the_files_that_are_promised() {
    let folder = tempdir().expect("a folder");
    let json = printed(
        folder.path(),
        &[
            // The name of earlier versions.
            "field",
            DESIGN,
            "--ring",
            "15",
            "--theta-deg",
            "-25",
            "--phi-deg",
            "40",
            "--pol",
            "p",
            "--side",
            "outer",
            "--orders",
            "30",
            "--slices",
            "6",
            "--margin-um",
            "0.4",
            "--out",
            "out",
        ],
    );
    let number = |key: &str| json[key].as_f64().unwrap_or_else(|| panic!("{key}: {json}"));
    assert!(number("energy_residual").abs() < 1e-10 && number("flux_residual") < 1e-10);

    let design = design::embedded("d1.toml").expect("valid");
    let interface = interface(&cells::ring(&design, 15).expect("relief"), 0.55).expect("valid");
    let stack = interface.stack(&interface.relief.slice_plan(6)).expect("a stack");
    let bloch = Bloch::from_angles(&stack, Side::Bottom, (-25f64).to_radians(), 40f64.to_radians());
    let scattering = solve(&stack, bloch, Truncation::new(30).expect("orders")).expect("solved");
    let from = (Side::Bottom, 0, Pol::P);
    assert!((number("R") - scattering.total(from, Side::Bottom)).abs() < 1e-10);
    assert!((number("T") - scattering.total(from, Side::Top)).abs() < 1e-10);

    let stem = "out/D1-ring-015-field-outer-p-theta-25-phi40";
    for picture in ["intensity", "poynting"] {
        assert!(written(folder.path(), &format!("{stem}-{picture}.png")).starts_with(b"\x89PNG"));
    }
    let exr = written(folder.path(), &format!("{stem}.exr"));
    assert!(exr.starts_with(&[0x76, 0x2f, 0x31, 0x01]), "the magic number of OpenEXR");
    for name in ["intensity", "poynting_z", "ex_re", "hz_im", "index"] {
        let found = exr.windows(name.len()).any(|w| w == name.as_bytes());
        assert!(found, "channel {name}");
    }
    let file: Value =
        serde_json::from_slice(&written(folder.path(), &format!("{stem}.json"))).expect("JSON");
    assert_eq!(file, json);
}
