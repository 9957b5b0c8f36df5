// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices of tables: against direct solves, against Fresnel's formulas, and in a run.

#![expect(
    clippy::print_stdout,
    reason = "the numbers found are what a reader of the test wants to see"
)]

use std::f64::consts::TAU;
use std::path::Path;

use bsdf::direction::{Wavevector, spherical};
use bsdf::order_table::{JonesRow, Mueller, OrderJones, OrderMueller, mueller};
use bsdf::{Grid, NodeId, OrderTable, Side};
use num_complex::Complex64;
use rand::RngExt;
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere_matrices};
use rcwa::relief::{Polygon, Relief};
use rcwa::{Bloch, no_progress};
use serde_json::Value;
use tempfile::tempdir;
use tracer::optics::thin_film::{End, Film};

use batwing_tests::tables::{
    SILICONE, on_silicone, order_table, resolution, scatter_side, solver_side,
};
use gratings::interface::interface;
use simulate::cells::band_cells;

use crate::support::runs::{estimate, run_text};

/// The table of `interface` with its matrices.
fn with_matrices(
    interface: &Interface,
    kx_per_zone: usize,
    ky: Vec<f64>,
    resolution: &Resolution,
) -> OrderTable {
    let table = order_table(interface, kx_per_zone, ky.clone(), resolution).expect("a table");
    let directions = Directions { kx_per_zone, ky };
    let solved = hemisphere_matrices(interface, &directions, resolution, &no_progress);
    let rows = solved.expect("solved").expect("one run").into_iter().map(|node| JonesRow {
        node: NodeId {
            side: scatter_side(node.side),
            kx_index: node.kx_index,
            ky_index: node.ky_index,
        },
        orders: node
            .orders
            .into_iter()
            .map(|(to, order, jones)| OrderJones { to: scatter_side(to), order, jones })
            .collect(),
    });
    table.with_jones(rows).expect("matrices of this table")
}

/// An asymmetric tooth of silicone, 2 µm wide: all orders and both sides of the zone differ.
fn tooth() -> Interface {
    // Silicone hangs down into the air.
    let tooth = Polygon {
        index: Complex64::from(SILICONE),
        points: vec![[0.0, 0.0], [1.3, 0.9], [1.9, 0.0]],
    };
    let air = Complex64::from(1.0);
    on_silicone(Relief::new(2.0, 0.9, air, vec![tooth]).expect("a relief"))
}

/// Mueller matrices of light with this wavevector, solved for itself with the orders about the
/// middle of its zone, as tables are.
fn direct(
    interface: &Interface,
    resolution: &Resolution,
    side: Side,
    k: Wavevector,
) -> Vec<(Side, i32, Mueller)> {
    let (stack, None) = interface.stacks(resolution).expect("stacks") else {
        panic!("two runs");
    };
    let zone = interface.order_spacing();
    let m = (k.kx / zone - 0.5).ceil() as i32;
    let bloch = Bloch::new(k.kx - f64::from(m) * zone, k.ky);
    let solved = rcwa::solve(&stack, bloch, resolution.truncation).expect("solved");
    let all = solved.jones_of_all((solver_side(side), m)).expect("propagates");
    all.iter()
        .map(|j| {
            let matrix = mueller(&j.power_normalised());
            (scatter_side(j.side), j.order - m, matrix)
        })
        .collect()
}

fn largest(a: &Mueller, b: &Mueller) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Nodes with kx of both signs and ky of both: half of them are known by reciprocity alone, and
/// negative ky by the mirror.
#[test]
fn matrices_at_nodes_are_those_of_direct_solves() {
    let interface = tooth();
    let resolution = resolution(&interface, 6, 12).expect("a resolution");
    for kx_per_zone in [3, 4] {
        let table = with_matrices(&interface, kx_per_zone, vec![0.0, 0.23, 0.8, 1.2], &resolution);
        let grid = table.grid();
        let mut compared = 0;
        for id in grid.nodes().step_by(5) {
            for sign in [1.0, -1.0] {
                let k = Wavevector { kx: grid.kx(id.kx_index), ky: sign * grid.ky[id.ky_index] };
                let expected = direct(&interface, &resolution, id.side, k);
                let got = table.mueller(id.side, k).expect("matrices");
                assert_eq!(got.len(), expected.len());
                for (OrderMueller { to, order, mueller: got }, (a, b, expected)) in
                    got.iter().zip(&expected)
                {
                    assert_eq!((to, order), (a, b));
                    // s of light along the normal may be any.
                    if k.kx.hypot(k.ky) < 1e-9 {
                        assert!((got[0][0] - expected[0][0]).abs() < 1e-6);
                        continue;
                    }
                    // At half a zone the orders kept there and here are one beside each other.
                    let half = (2.0 * k.kx / grid.zone()).rem_euclid(2.0);
                    let exact = (half - 1.0).abs() > 1e-9;
                    let off = largest(got, expected);
                    let allowed = if exact { 2e-6 } else { 5e-3 };
                    assert!(off < allowed, "{id:?} {sign} {to} {order}: {off:e}");
                    compared += usize::from(exact);
                }
            }
        }
        assert!(compared > 100, "{compared}");
    }
}

#[test]
fn a_flat_relief_has_the_matrices_of_fresnel_from_both_sides() {
    let air = Complex64::from(1.0);
    let flat = on_silicone(Relief::new(1.0, 0.2, air, Vec::new()).expect("a relief"));
    let resolution = resolution(&flat, 2, 1).expect("a resolution");
    let table = with_matrices(&flat, 2, vec![0.0, 0.3, 0.77, 0.95, 1.1, 1.3], &resolution);
    let film = Film::new(550.0, Vec::new()).expect("bare");
    let grid = table.grid();
    for id in grid.nodes() {
        let (kx, ky) = (grid.kx(id.kx_index), grid.ky[id.ky_index]);
        let (from, to) = (grid.index(id.side), grid.index(id.side.opposite()));
        let cos = (1.0 - (kx * kx + ky * ky) / (from * from)).sqrt();
        let met = film.amplitudes(End::First, from, to.into(), cos);
        let zero = Complex64::ZERO;
        let of = |[s, p]: [Complex64; 2]| mueller(&[[s, zero], [zero, p]]);
        for OrderMueller { to, order, mueller: got } in
            table.mueller(id.side, Wavevector { kx, ky }).expect("matrices")
        {
            let expected = match (order, to == id.side) {
                (0, true) => of(met.reflected),
                (0, false) => of(met.transmitted),
                _ => [[0.0; 4]; 4],
            };
            let off = largest(&got, &expected);
            assert!(off < 2e-6, "{id:?} {to} {order}: {got:?} {expected:?}");
        }
    }
}

/// D1's band 2 at a tolerance of 1e-2, off the nodes, over diffuse light; and next to the normal,
/// where s turns by any angle from node to node.
#[test]
#[ignore = "slow: a table against single solves (8 s)"]
fn interpolated_matrices_are_those_of_direct_solves_over_diffuse_light() {
    let design = design::embedded("d1.toml").expect("valid");
    let cell = band_cells(&design)[1].clone().expect("a relief");
    let interface = interface(&cell, 0.55).expect("a relief");
    let (resolution, _) =
        rcwa::accuracy::converge_hemisphere(&interface, 1e-2, &no_progress).expect("converges");
    let ky = Grid::ky_nodes(SILICONE, 1.0, 28);
    let table = with_matrices(&interface, 2, ky, &resolution);
    println!(
        "{} orders, {:.2} MiB of matrices",
        table.entry_count(),
        32.0 * table.entry_count() as f64 / 1_048_576.0
    );
    for (side, count, most) in
        [(Side::Inner, 32, 1.0), (Side::Outer, 16, 1.0), (Side::Inner, 10, 0.01)]
    {
        let mut rng = tracer::random::stream(8, side.index() as u64);
        let n = table.grid().index(side);
        // Sums over all orders that leave on a side, and squares of single elements.
        let mut differences: Vec<[Mueller; 2]> = Vec::new();
        let (mut square, mut shares, mut elements) = (0.0, 0.0, 0.0);
        for _ in 0..count {
            let sin2 = most * rng.random::<f64>();
            let wi = spherical(sin2.sqrt().asin(), TAU * rng.random::<f64>());
            let wi = if side == Side::Outer { wi } else { -wi };
            let k = Wavevector::incoming(wi, n);
            let expected = direct(&interface, &resolution, side, k);
            let got = table.mueller(side, k).expect("matrices");
            let mut sums = [[[0.0; 4]; 4]; 2];
            for (OrderMueller { to, order, mueller: got }, (a, b, expected)) in
                got.iter().zip(&expected)
            {
                assert_eq!((to, order), (a, b));
                for (r, row) in got.iter().enumerate() {
                    for (c, got) in row.iter().enumerate() {
                        let off = got - expected[r][c];
                        sums[to.index()][r][c] += off;
                        square += off * off;
                        elements += 1.0;
                    }
                }
                shares += (got[0][0] - expected[0][0]).powi(2);
            }
            differences.push(sums);
        }
        let of_all = f64::sqrt(square / elements);
        let of_shares = f64::sqrt(16.0 * shares / elements);
        let mut worst = 0.0f64;
        for to in 0..2 {
            for r in 0..4 {
                for c in 0..4 {
                    let all: tracer::statistics::Moments =
                        differences.iter().map(|d| d[to][r][c]).collect();
                    let mean = all.estimate();
                    worst = worst.max(mean.value.abs());
                    // As the shares of the table: the mean over diffuse light is within what is
                    // asked of it, or within its own error.
                    let allowed = 1e-2 + 4.0 * mean.standard_error;
                    assert!(mean.value.abs() < allowed, "{side} to {to}, {r}{c}: {mean:?}");
                }
            }
        }
        println!(
            "{side}, sin² up to {most}: elements off by {of_all:.1e} rms, first ones by {of_shares:.1e}; means over diffuse light of the sums {worst:.1e} at most"
        );
        assert!(of_all < 3.0 * of_shares, "{side}: {of_all} {of_shares}");
    }
}

/// One element of relief on a dome, with tables that take seconds.
const DESIGN: &str = r#"
name = "polar"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
silicone = { index = 1.41 }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.86, reflection = "LAW" }
mirror = { kind = "LAW", reflectance = 0.95, extent = "array" }
array = { columns = 1, rows = 1, pitch_mm = 8.3 }
elements = { count = 17, width_um = 100.0, shapes = [{ from = 1, to = 1, type = "OS1" }, { from = 2, to = 17, type = "smooth" }] }
receiver = { bin_mm = 0.5 }
trace = { paths = 400_000 }
"#;
const TABLES: &str =
    "hybrid = { element_width_um = 10.0, tolerance = 0.05, kx_per_zone = 2, ky_count = 8 }\n";

/// Tables are kept in the folder from run to run.
fn run_in(folder: &Path, text: &str, flags: &[&str]) -> Result<Value, String> {
    let flags = [&["--model", "hybrid"], flags].concat();
    let results = run_text(folder, "polar", text, "out", &flags)?;
    Ok(results["designs"]["polar"]["hybrid_10um"].clone())
}

#[test]
#[ignore = "slow: tables with matrices (7 s)"]
fn bands_pass_polarisation_on_where_the_design_asks_for_it() {
    let text = |law: &str, polarization: &str, tables: &str| {
        format!(
            "{}light = {{ wavelength_nm = 550.0, polarization = \"{polarization}\" }}\n{}",
            DESIGN.replace("LAW", law),
            TABLES.replace(" }", &format!("{tables} }}"))
        )
    };
    let matrices = ", tables = \"matrices\"";
    let folder = tempdir().expect("a folder");
    let run = |text: &str, flags: &[&str]| run_in(folder.path(), text, flags);
    let figure = |model: &Value, name: &str| estimate(&model[name]);
    let model = run(&text("specular", "carried", matrices), &["--threads", "1"]).expect("results");
    assert_eq!(model["polarization"]["depolarised_by"], serde_json::json!([]));
    let again = run(&text("specular", "carried", matrices), &["--threads", "2"]).expect("results");
    assert_eq!(model["power_ledger"], again["power_ledger"]);
    let sum: f64 = model["power_ledger"]
        .as_object()
        .expect("a ledger")
        .iter()
        .filter(|(name, _)| {
            !["emitted", "out_of_domes", "back_into_domes"].contains(&name.as_str())
        })
        .map(|(_, account)| estimate(account).0)
        .sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");

    let shares = run(&text("specular", "carried", ""), &[]).expect("results");
    assert_eq!(shares["polarization"]["depolarised_by"], serde_json::json!(["dome"]));
    // Each table says the same of itself but for its name in the cache.
    let without_key = |model: &Value| {
        let mut tables = model["tables"].clone();
        for table in tables.as_array_mut().expect("tables") {
            table.as_object_mut().expect("a table").remove("sha256");
        }
        tables
    };
    assert_eq!(without_key(&model), without_key(&shares));

    // Where mirror and LED depolarise, what is left is light that meets the dome twice on end:
    // hardly any.
    let matt = run(&text("lambertian", "carried", matrices), &[]).expect("results");
    let plain = run(&text("lambertian", "unpolarised", ""), &[]).expect("results");
    for name in ["extraction_efficiency", "centre_to_peak"] {
        let (a, b) = (figure(&matt, name), figure(&plain, name));
        assert!((a.0 - b.0).abs() < 5.0 * a.1.hypot(b.1) + 5e-4, "{name}: {a:?} {b:?}");
    }

    for (text, said) in [
        (
            text("specular", "unpolarised", matrices),
            "polar.toml: hybrid.tables = \"matrices\": expected \"shares\" without light.polarization = \"carried\"",
        ),
        (
            text("specular", "carried", &format!("{matrices}, polarization = \"s\"")),
            "expected \"shares\" without hybrid.polarization = \"unpolarised\"",
        ),
        (
            text("specular", "carried", ", tables = \"mueller\""),
            "hybrid.tables: expected shares or matrices, got \"mueller\"",
        ),
    ] {
        let error = run(&text, &[]).expect_err("refused");
        assert!(error.contains(said) && error.matches("batwing:").count() == 1, "{error}");
    }
    // Sides of dense domes are followed too.
    let dense = text("specular", "carried", matrices).replace("index = 1.41", "index = 2.8");
    let figures = run(&dense, &[]).expect("traced");
    let residual = &figures["tables"][0]["energy_residual"];
    assert!(residual.as_f64().is_some_and(|r| r < 1e-9), "{residual}");
}
