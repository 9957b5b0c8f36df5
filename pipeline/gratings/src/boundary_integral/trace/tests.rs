// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfaces of reliefs whose corners are plain to see, and reliefs that are no single surface.

use super::super::{IntegralError, Outline};
use num_complex::Complex64;
use rcwa::relief::{Polygon, Relief};

const SILICONE: f64 = 1.41;
const AIR: f64 = 1.0;

fn polygon(index: f64, points: &[[f64; 2]]) -> Polygon {
    Polygon { index: index.into(), points: points.to_vec() }
}

fn relief(background: f64, polygons: Vec<Polygon>) -> Relief {
    Relief::new(4.0, 1.0, background.into(), polygons).expect("a relief")
}

fn outline(relief: &Relief) -> Result<Outline, IntegralError> {
    Outline::of_relief(relief, SILICONE, AIR)
}

/// The corners, in whatever place the list begins and the period is counted from.
#[track_caller]
fn assert_corners(relief: &Relief, expected: &[[f64; 2]]) {
    let outline = outline(relief).expect("a surface");
    let got = outline.points();
    assert_eq!(got.len(), expected.len(), "{got:?}");
    let fits = |first: usize| {
        let lap = ((got[first][0] - expected[0][0]) / 4.0).round();
        (0..got.len()).all(|i| {
            let wrapped = (first + i) / got.len();
            let p = got[(first + i) % got.len()];
            let x = p[0] + 4.0 * (wrapped as f64 - lap);
            (x - expected[i][0]).abs() < 1e-7 && (p[1] - expected[i][1]).abs() < 1e-7
        })
    };
    assert!((0..got.len()).any(fits), "{got:?}, expected {expected:?}");
}

#[test]
fn a_triangle_on_the_chord_has_two_corners() {
    let triangle = polygon(SILICONE, &[[0.0, 0.0], [3.0, 1.0], [4.0, 0.0]]);
    assert_corners(&relief(AIR, vec![triangle]), &[[0.0, 0.0], [3.0, 1.0]]);
}

#[test]
fn a_triangle_that_leans_over_its_neighbours_foot_hides_nothing() {
    let triangle = polygon(SILICONE, &[[0.5, 0.0], [4.9, 1.0], [4.5, 0.0]]);
    assert_corners(&relief(AIR, vec![triangle]), &[[0.5, 0.0], [4.9, 1.0]]);
}

#[test]
fn a_ridge_leaves_the_flats_beside_it() {
    let ridge = polygon(SILICONE, &[[3.5, 0.0], [4.5, 0.0], [4.5, 1.0], [3.5, 1.0]]);
    assert_corners(&relief(AIR, vec![ridge]), &[[3.5, 0.0], [3.5, 1.0], [4.5, 1.0], [4.5, 0.0]]);
}

#[test]
fn a_groove_in_silicone_is_the_same_as_the_ridge_beside_it() {
    let groove = polygon(AIR, &[[1.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0]]);
    let ridge = polygon(SILICONE, &[[3.0, 0.0], [5.0, 0.0], [5.0, 1.0], [3.0, 1.0]]);
    let expected = [[1.0, 1.0], [1.0, 0.0], [3.0, 0.0], [3.0, 1.0]];
    assert_corners(&relief(SILICONE, vec![groove]), &expected);
    assert_corners(&relief(AIR, vec![ridge]), &expected);
}

#[test]
fn later_polygons_lie_over_earlier_ones_and_parts_of_one_medium_are_one() {
    let block = polygon(SILICONE, &[[0.0, 0.0], [4.0, 0.0], [4.0, 0.5], [0.0, 0.5]]);
    let tooth = polygon(SILICONE, &[[1.0, 0.2], [3.0, 0.2], [2.0, 1.0]]);
    let notch = polygon(AIR, &[[3.5, 0.25], [4.5, 0.25], [4.0, 0.8], [3.6, 0.8]]);
    let got = outline(&relief(AIR, vec![block, tooth, notch])).expect("a surface");
    // Notch: floor at 0.25 with two corners, two more where it meets the block; tooth: feet and
    // apex.
    assert_eq!(got.points().len(), 7, "{:?}", got.points());
    let lowest = got.points().iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    assert!((lowest - 0.25).abs() < 1e-8);
}

#[test]
fn a_plane_has_no_corners_wherever_it_lies() {
    let block = polygon(SILICONE, &[[0.0, 0.0], [4.0, 0.0], [4.0, 0.5], [0.0, 0.5]]);
    for relief in [relief(AIR, vec![]), relief(SILICONE, vec![]), relief(AIR, vec![block])] {
        assert_eq!(outline(&relief), Outline::fourier(4.0, vec![]));
    }
}

#[test]
fn islands_are_refused() {
    let bubble = polygon(AIR, &[[1.0, 0.3], [2.0, 0.3], [1.5, 0.7]]);
    let error = outline(&relief(SILICONE, vec![bubble])).expect_err("a bubble");
    assert_eq!(error, IntegralError::Islands { closed: 1, period: 4.0 });
    let film = polygon(SILICONE, &[[0.0, 0.5], [4.0, 0.5], [4.0, 0.6], [0.0, 0.6]]);
    let error = outline(&relief(AIR, vec![film])).expect_err("a film");
    assert_eq!(error, IntegralError::Islands { closed: 2, period: 4.0 });
}

#[test]
fn other_media_are_refused() {
    let glass = polygon(1.5, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
    let error = outline(&relief(AIR, vec![glass])).expect_err("glass");
    assert!(
        error.to_string().starts_with(
            "polygon 0: expected the index of a half-space, [1.41, 0] or [1, 0], got [1.5, 0]"
        ),
        "{error}"
    );
    let absorbing = Relief::new(4.0, 1.0, Complex64::new(1.0, 0.1), vec![]).expect("a relief");
    let error = outline(&absorbing).expect_err("an absorbing background");
    assert!(
        error.to_string().starts_with("the background: expected the index of a half-space"),
        "{error}"
    );
    let error = Outline::of_relief(&relief(AIR, vec![]), AIR, AIR).expect_err("one medium");
    assert_eq!(error, IntegralError::NoSurface { index: AIR.into() });
}

#[test]
fn surfaces_that_touch_themselves_are_refused() {
    // Two triangles tip to tip: four sides meet at (2, 0.5).
    let down = polygon(SILICONE, &[[1.0, 0.0], [3.0, 0.0], [2.0, 0.5]]);
    let up = polygon(SILICONE, &[[1.0, 1.0], [3.0, 1.0], [2.0, 0.5]]);
    let error = outline(&relief(AIR, vec![down, up])).expect_err("touching tips");
    assert!(
        matches!(error, IntegralError::Touching { at } if (at[0] - 2.0).abs() < 1e-6),
        "{error}"
    );
    for crossing in [
        vec![[0.0, 0.0], [3.0, 1.0], [1.0, 1.0], [2.0, 0.0]],
        // Overhangs so far that it runs into the next period.
        vec![[0.0, 0.0], [5.0, 1.0], [2.0, 0.5], [3.0, 0.0]],
        // Runs back on itself.
        vec![[0.0, 0.0], [3.0, 0.0], [2.0, 0.0], [2.0, 1.0]],
    ] {
        let error = Outline::corners(4.0, &crossing).expect_err("crossing");
        assert!(matches!(error, IntegralError::Touching { .. }), "{crossing:?}: {error}");
    }
    Outline::corners(4.0, &[[0.0, 0.0], [4.5, 1.0], [5.0, 1.0], [3.0, 0.0]]).expect("overhanging");
}
