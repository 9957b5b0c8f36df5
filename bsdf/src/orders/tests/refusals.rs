// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rows and grids that cannot be a table.

use super::*;

#[test]
fn bad_rows_are_refused() {
    let grid = grid(2, 4);
    let build =
        |rows: Vec<Row>| OrderTable::build(TableHeader::default(), grid.clone(), rows).unwrap_err();
    let rows = || grid.rows(smooth).collect::<Vec<_>>();
    let message = |error: Error| error.to_string();

    let mut missing = rows();
    missing.pop();
    assert!(matches!(
        build(missing),
        Error::NodeMissing {
            side: Side::Outer,
            polarization: Polarization::P,
            ..
        }
    ));
    let mut twice = rows();
    twice.push(twice[3].clone());
    assert!(matches!(build(twice), Error::NodeTwice { .. }));
    let mut outside = rows();
    outside[0].kx_index = -1000;
    assert!(message(build(outside)).contains("kx index -1000"));
    let mut mixed = rows();
    mixed[0].polarization = Polarization::Unpolarized;
    assert!(matches!(build(mixed), Error::UnpolarizedRow));
    for (share, text) in [
        (
            (Side::Inner, 0, f64::NAN),
            "expected a share between 0 and 1, got NaN",
        ),
        (
            (Side::Inner, 0, -0.1),
            "expected a share between 0 and 1, got -0.1",
        ),
        (
            (Side::Inner, 500, 0.1),
            "expected no power in an order that does not propagate, got 0.1",
        ),
    ] {
        let mut bad = rows();
        bad[40].shares = vec![share];
        let text = text.to_owned();
        assert!(message(build(bad)).contains(&text), "{text}");
    }
    let mut doubled = rows();
    doubled[40].shares = vec![(Side::Inner, 0, 0.1), (Side::Inner, 0, 0.1)];
    assert!(message(build(doubled)).contains("each order once"));
    let mut gain = rows();
    gain[40].shares = vec![(Side::Inner, 0, 0.75), (Side::Inner, 1, 0.75)];
    assert!(message(build(gain)).contains("sum to 1.5"));
    let nan = TableHeader {
        estimated_error: f64::NAN,
        ..TableHeader::default()
    };
    assert!(matches!(
        OrderTable::build(nan, grid.clone(), rows()),
        Err(Error::Header { .. })
    ));
}

#[test]
fn bad_grids_are_refused() {
    let good = grid(2, 4);
    let bad = [
        Grid {
            period: 0.0,
            ..good.clone()
        },
        Grid {
            wavelength: f64::NAN,
            ..good.clone()
        },
        Grid {
            index_outer: -1.0,
            ..good.clone()
        },
        Grid {
            index_inner: 1e200,
            ..good.clone()
        },
        Grid {
            kx_per_zone: 0,
            ..good.clone()
        },
        Grid {
            kx_per_zone: usize::MAX,
            ..good.clone()
        },
        Grid {
            period: 1e9,
            ..good.clone()
        },
        Grid {
            wavelength: 1e3,
            kx_per_zone: 1,
            ..good.clone()
        },
        Grid {
            ky: vec![],
            ..good.clone()
        },
        Grid {
            ky: vec![0.2, 0.1],
            ..good.clone()
        },
        Grid {
            ky: vec![0.1, 1.0],
            ..good.clone()
        },
        Grid {
            ky: vec![1.1],
            ..good.clone()
        },
    ];
    for grid in bad {
        assert!(grid.validate().is_err(), "{grid:?}");
    }
}
