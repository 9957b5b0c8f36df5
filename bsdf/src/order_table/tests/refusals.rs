// SPDX-License-Identifier: MIT OR Apache-2.0
//! Invalid rows and grids.

use super::*;

#[test]
fn bad_rows_are_refused() {
    let grid = grid(2, 4);
    let build = |rows: Vec<EfficiencyRow>| {
        OrderTable::build(TableHeader::default(), grid.clone(), rows).unwrap_err()
    };
    let rows = || grid.rows(smooth).collect::<Vec<_>>();
    let message = |error: Error| error.to_string();

    let mut missing = rows();
    missing.pop();
    let missing = build(missing);
    assert!(matches!(missing, Error::NodeMissing { .. }));
    let missing = message(missing);
    assert!(
        missing.starts_with("no row for side outer, ") && missing.contains(", P: expected one"),
        "{missing}"
    );
    let mut twice = rows();
    twice.push(twice[3].clone());
    assert!(matches!(build(twice), Error::NodeTwice { .. }));
    let mut outside = rows();
    outside[0].node.kx_index = -1000;
    assert!(message(build(outside)).contains("kx index -1000"));
    let mut mixed = rows();
    mixed[0].polarisation = Polarisation::Unpolarised;
    assert!(matches!(build(mixed), Error::UnpolarisedRow));
    for (order, text) in [
        (
            OrderEfficiency::new(Side::Inner, 0, f64::NAN),
            "expected an efficiency between 0 and 1, got NaN",
        ),
        (
            OrderEfficiency::new(Side::Inner, 0, -0.1),
            "expected an efficiency between 0 and 1, got -0.1",
        ),
        (
            OrderEfficiency::new(Side::Inner, 500, 0.1),
            "expected no power in an order that does not propagate, got 0.1",
        ),
    ] {
        let mut bad = rows();
        bad[40].orders = vec![order];
        let text = text.to_owned();
        assert!(message(build(bad)).contains(&text), "{text}");
    }
    let mut doubled = rows();
    doubled[40].orders =
        vec![OrderEfficiency::new(Side::Inner, 0, 0.1), OrderEfficiency::new(Side::Inner, 0, 0.1)];
    assert!(message(build(doubled)).contains("each order once"));
    let mut gain = rows();
    gain[40].orders = vec![
        OrderEfficiency::new(Side::Inner, 0, 0.75),
        OrderEfficiency::new(Side::Inner, 1, 0.75),
    ];
    assert!(message(build(gain)).contains("sum to 1.5"));
    let nan = TableHeader { estimated_error: f64::NAN, ..TableHeader::default() };
    assert!(matches!(OrderTable::build(nan, grid.clone(), rows()), Err(Error::Header { .. })));
}

#[test]
fn bad_grids_are_refused() {
    let good = grid(2, 4);
    let bad = [
        Grid { period: 0.0, ..good.clone() },
        Grid { wavelength: f64::NAN, ..good.clone() },
        Grid { index_outer: -1.0, ..good.clone() },
        Grid { index_inner: 1e200, ..good.clone() },
        Grid { kx_per_zone: 0, ..good.clone() },
        Grid { kx_per_zone: usize::MAX, ..good.clone() },
        Grid { period: 1e9, ..good.clone() },
        Grid { wavelength: 1e3, kx_per_zone: 1, ..good.clone() },
        Grid { ky: vec![], ..good.clone() },
        Grid { ky: vec![0.2, 0.1], ..good.clone() },
        Grid { ky: vec![0.1, 1.0], ..good.clone() },
        Grid { ky: vec![1.1], ..good.clone() },
    ];
    for grid in bad {
        assert!(grid.validate().is_err(), "{grid:?}");
    }
}
