// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cuts through reliefs against hand-made ones, slice plans, and a refusal for each way of being
//! wrong.

#![expect(clippy::float_cmp, reason = "borders, heights and counts here are exact by construction")]

use approx::assert_abs_diff_eq;
use num_complex::Complex64;

use super::shapes::{self, Materials};
use super::{Layer, Polygon, Relief, ReliefError, Segment, extrapolate};

const AIR: Complex64 = Complex64::new(1.0, 0.0);
const SILICONE: Complex64 = Complex64::new(1.41, 0.0);
const SILVER: Complex64 = Complex64::new(0.06, 3.586);

fn polygon(index: Complex64, points: &[[f64; 2]]) -> Polygon {
    Polygon { index, points: points.to_vec() }
}

fn relief(polygons: Vec<Polygon>) -> Result<Relief, ReliefError> {
    Relief::new(10.0, 4.0, AIR, polygons)
}

fn one(points: &[[f64; 2]]) -> Result<Relief, ReliefError> {
    relief(vec![polygon(SILICONE, points)])
}

/// Share of the period filled with `index`.
fn share(segments: &[Segment], index: Complex64) -> f64 {
    segments.iter().filter(|s| s.index == index).map(Segment::width).sum()
}

fn assert_segments(got: &[Segment], expected: &[(f64, f64, Complex64)]) {
    assert_eq!(got.len(), expected.len(), "{got:?}");
    for (s, &(x0, x1, index)) in got.iter().zip(expected) {
        assert_abs_diff_eq!(s.x0, x0, epsilon = 1e-14);
        assert_abs_diff_eq!(s.x1, x1, epsilon = 1e-14);
        assert_eq!(s.index, index);
    }
}

/// From 0 to 1, without gap, without neighbours of one index.
fn assert_covers(segments: &[Segment]) {
    assert_eq!(segments[0].x0, 0.0);
    assert_eq!(segments[segments.len() - 1].x1, 1.0);
    for pair in segments.windows(2) {
        assert_eq!(pair[0].x1, pair[1].x0);
        assert_ne!(pair[0].index, pair[1].index);
    }
    assert!(segments.iter().all(|s| s.x1 > s.x0));
}

#[test]
fn a_triangle_is_cut_between_its_sides() {
    let tooth = one(&[[0.0, 0.0], [10.0, 0.0], [8.0, 4.0]]).unwrap();
    assert_segments(
        &tooth.layer_at(1.0),
        &[(0.0, 0.2, AIR), (0.2, 0.95, SILICONE), (0.95, 1.0, AIR)],
    );
    assert_segments(&tooth.layer_at(0.0), &[(0.0, 1.0, SILICONE)]);
    // At the very tip the last representable height is cut, where the tooth is a point.
    assert_segments(&tooth.layer_at(4.0), &[(0.0, 1.0, AIR)]);
}

#[test]
fn an_overhang_is_wrapped_into_the_period() {
    // The apex lies 3 beyond the chord: at z = 3 silicone spans 9.75 to 12.25.
    let overhang = one(&[[0.0, 0.0], [10.0, 0.0], [13.0, 4.0]]).unwrap();
    assert_segments(
        &overhang.layer_at(3.0),
        &[(0.0, 0.225, SILICONE), (0.225, 0.975, AIR), (0.975, 1.0, SILICONE)],
    );
    // The same tooth drawn in another period, and closed with its first point.
    let elsewhere = one(&[[-20.0, 0.0], [-10.0, 0.0], [-7.0, 4.0], [-20.0, 0.0]]).unwrap();
    assert_segments(
        &elsewhere.layer_at(3.0),
        &[(0.0, 0.225, SILICONE), (0.225, 0.975, AIR), (0.975, 1.0, SILICONE)],
    );
    // A blade that leans over three neighbours stands a period beside theirs at every height.
    let blade = one(&[[0.0, 0.0], [10.0, 0.0], [35.0, 4.0]]).unwrap();
    assert_segments(
        &blade.layer_at(2.0),
        &[(0.0, 0.25, SILICONE), (0.25, 0.75, AIR), (0.75, 1.0, SILICONE)],
    );
    // Teeth wider than the period overlap, and fill it near their foot.
    let wide = one(&[[0.0, 0.0], [20.0, 0.0], [10.0, 4.0]]).unwrap();
    assert_segments(&wide.layer_at(1.0), &[(0.0, 1.0, SILICONE)]);
    assert_segments(
        &wide.layer_at(3.0),
        &[(0.0, 0.25, SILICONE), (0.25, 0.75, AIR), (0.75, 1.0, SILICONE)],
    );
}

#[test]
fn a_later_polygon_lies_over_an_earlier_one() {
    let ridge = polygon(SILICONE, &[[2.0, 0.0], [8.0, 0.0], [8.0, 4.0], [2.0, 4.0]]);
    let coat = polygon(SILVER, &[[4.0, 0.0], [6.0, 0.0], [6.0, 4.0], [4.0, 4.0]]);
    let over = relief(vec![ridge.clone(), coat.clone()]).unwrap();
    let expected = [
        (0.0, 0.2, AIR),
        (0.2, 0.4, SILICONE),
        (0.4, 0.6, SILVER),
        (0.6, 0.8, SILICONE),
        (0.8, 1.0, AIR),
    ];
    assert_segments(&over.layer_at(2.0), &expected);
    let under = relief(vec![coat, ridge]).unwrap();
    assert_segments(
        &under.layer_at(2.0),
        &[(0.0, 0.2, AIR), (0.2, 0.8, SILICONE), (0.8, 1.0, AIR)],
    );
}

#[test]
fn concave_polygons_have_several_stretches() {
    let comb = one(&[
        [0.0, 0.0],
        [10.0, 0.0],
        [10.0, 4.0],
        [6.0, 4.0],
        [6.0, 2.0],
        [4.0, 2.0],
        [4.0, 4.0],
        [0.0, 4.0],
    ]);
    let comb = comb.unwrap();
    assert_segments(&comb.layer_at(1.0), &[(0.0, 1.0, SILICONE)]);
    assert_segments(
        &comb.layer_at(3.0),
        &[(0.0, 0.4, SILICONE), (0.4, 0.6, AIR), (0.6, 1.0, SILICONE)],
    );
}

#[test]
fn every_cut_covers_the_period_and_the_slices_keep_the_area() {
    for dx in [0.0, 0.3, 3.7, -12.1] {
        let tooth = one(&[[dx, 0.0], [10.0 + dx, 0.0], [13.0 + dx, 4.0]]).unwrap();
        let layers = tooth.slices(37);
        for layer in &layers {
            assert_covers(&layer.segments);
        }
        let depth: f64 = layers.iter().map(|l| l.thickness).sum();
        assert_abs_diff_eq!(depth, 4.0, epsilon = 1e-14);
        // Widths are linear in z, so that mid-height slices give the area exactly.
        let area: f64 = layers.iter().map(|l| l.thickness * share(&l.segments, SILICONE)).sum();
        assert_abs_diff_eq!(area * 10.0, 20.0, epsilon = 1e-12);
    }
}

#[test]
fn the_mirror_image_is_the_mirror_image_of_every_cut() {
    let tooth = one(&[[0.0, 0.0], [10.0, 0.0], [13.0, 4.0]]).unwrap();
    let mirrored = one(&[[0.0, 0.0], [-10.0, 0.0], [-13.0, 4.0]]).unwrap();
    for z in [0.1, 1.7, 3.9] {
        let mut expected: Vec<_> =
            tooth.layer_at(z).iter().map(|s| (1.0 - s.x1, 1.0 - s.x0, s.index)).collect();
        expected.reverse();
        assert_segments(&mirrored.layer_at(z), &expected);
    }
}

#[test]
fn plans_cut_at_every_kink_and_refine_evenly() {
    // Kinks at 1 (corner), 3 (corner); below 1 vertical sides.
    let tooth =
        one(&[[1.0, 0.0], [9.0, 0.0], [9.0, 1.0], [7.0, 3.0], [6.0, 4.0], [4.0, 4.0], [1.0, 1.0]])
            .unwrap();
    let plan = tooth.slice_plan(20);
    let heights: Vec<_> = plan.intervals().iter().map(|i| (i.z0, i.z1, i.slanted)).collect();
    assert_eq!(heights, [(0.0, 1.0, false), (1.0, 3.0, true), (3.0, 4.0, true)]);
    assert_eq!(plan.intervals()[0].count, 1, "vertical sides need one slice");
    assert_eq!(plan.count(), 20);
    assert!(!plan.is_exact());
    let fine = plan.refined(2);
    assert_eq!(fine.count(), 1 + 2 * 19);
    for (coarse, fine) in plan.intervals().iter().zip(fine.intervals()) {
        assert_eq!(fine.count, if coarse.slanted { 2 * coarse.count } else { 1 });
    }
    let layers = tooth.layers(&fine);
    assert_eq!(layers.len(), fine.count());
    assert_eq!(layers[0].thickness, 1.0);
    // Few slices asked for: still one each.
    assert_eq!(tooth.slice_plan(0).count(), 3);
}

#[test]
fn steeper_to_the_light_means_more_slices() {
    // Two halves of equal height; the lower one's side leans four times as far.
    let tooth = one(&[[0.0, 0.0], [10.0, 0.0], [9.0, 2.0], [1.0, 4.0]]).unwrap();
    let plan = tooth.slice_plan(50);
    assert_eq!(plan.intervals().len(), 2);
    assert!(plan.intervals()[1].count > 2 * plan.intervals()[0].count, "{plan:?}");
    assert_eq!(plan.count(), 50);
}

#[test]
fn extrapolation_takes_away_what_goes_as_the_square_of_the_thickness() {
    let at = |slices: f64| 0.25 + 3.0 / (slices * slices);
    for (n, times) in [(1.0, 1.0), (1.0, 7.0), (3.0, 1.0), (4.0, 20.0)] {
        let found = extrapolate(at(times * n), at(times * (n + 1.0)), n);
        assert_abs_diff_eq!(found, 0.25, epsilon = 1e-14);
    }
}

#[test]
fn vertical_sides_are_exact_in_one_slice() {
    let lamellar = shapes::lamellar(10.0, 4.0, 0.3, Materials::lossless(1.41, 1.0)).unwrap();
    let plan = lamellar.slice_plan(64);
    assert!(plan.is_exact());
    assert_eq!(plan.count(), 1);
    assert_eq!(plan.refined(3), plan);
    assert_segments(&lamellar.layers(&plan)[0].segments, &[(0.0, 0.3, SILICONE), (0.3, 1.0, AIR)]);
}

#[test]
fn crossing_outlines_are_kinks() {
    // A horizontal slab over a tooth crosses it nowhere but at its own corners; a wedge over it
    // does.
    let tooth = polygon(SILICONE, &[[0.0, 0.0], [10.0, 0.0], [5.0, 4.0]]);
    let wedge = polygon(SILVER, &[[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]);
    let plan = relief(vec![tooth.clone(), wedge]).unwrap().slice_plan(10);
    // Sides x = 5z/4 and x = 4 - z meet at z = 16/9.
    assert_eq!(plan.intervals().len(), 2);
    assert_abs_diff_eq!(plan.intervals()[0].z1, 16.0 / 9.0, epsilon = 1e-14);
    // A wide tooth meets its own neighbour half-way up.
    let wide = one(&[[0.0, 0.0], [20.0, 0.0], [10.0, 4.0]]).unwrap().slice_plan(10);
    assert_eq!(wide.intervals().len(), 2);
    assert_abs_diff_eq!(wide.intervals()[0].z1, 2.0, epsilon = 1e-14);
    // A coat that shares a side with the tooth adds no kink.
    let tooth = polygon(SILICONE, &[[1.0, 0.0], [9.0, 0.0], [5.0, 4.0]]);
    let coat = polygon(SILVER, &[[1.0, 0.0], [5.0, 4.0], [4.5, 4.0], [0.5, 0.0]]);
    assert_eq!(relief(vec![tooth, coat]).unwrap().slice_plan(10).intervals().len(), 1);
}

#[test]
fn shapes_have_the_geometry_they_are_named_by() {
    let materials = Materials::lossless(1.41, 1.0);
    // A ring of the dome: tread 10, chord 10 / cos(slope), apex (10 cos, 10 sin) of the slope.
    let slope = 0.38_f64;
    let step = shapes::step(10.0, 10.0 * slope.tan(), materials).unwrap();
    assert_abs_diff_eq!(step.period(), 10.0 / slope.cos(), epsilon = 1e-13);
    assert_abs_diff_eq!(step.depth(), 10.0 * slope.sin(), epsilon = 1e-13);
    assert_abs_diff_eq!(step.polygons()[0].points[2][0], 10.0 * slope.cos(), epsilon = 1e-13);

    let sinusoid = shapes::sinusoid(10.0, 2.0, 400, materials).unwrap();
    for z in [0.3_f64, 1.0, 1.6] {
        // Filled where 1 - cos 2πx > z, at depth 2: a share acos(1 - z)/π of the period is groove.
        let expected = 1.0 - (1.0 - z).acos() / std::f64::consts::PI;
        assert_abs_diff_eq!(share(&sinusoid.layer_at(z), SILICONE), expected, epsilon = 3e-5);
    }
    // Corners come in pairs of equal height, so that each pair is one kink.
    assert_eq!(sinusoid.slice_plan(0).intervals().len(), 200);
}

#[test]
fn shapes_out_of_range_are_refused() {
    let m = Materials::lossless(1.41, 1.0);
    for fill in [0.0, 1.0, -0.1, f64::NAN] {
        assert!(matches!(shapes::lamellar(1.0, 1.0, fill, m), Err(ReliefError::Shape { .. })));
    }
    assert!(matches!(
        shapes::step(0.0, 1.0, m),
        Err(ReliefError::Length { what: "the tread", .. })
    ));
    assert!(matches!(
        shapes::step(1.0, -1.0, m),
        Err(ReliefError::Length { what: "the riser", .. })
    ));
    assert!(matches!(shapes::sinusoid(1.0, 1.0, 3, m), Err(ReliefError::Shape { .. })));
}

#[test]
fn impossible_lengths_and_indices_are_refused() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let period = Relief::new(bad, 1.0, AIR, Vec::new());
        assert!(matches!(period, Err(ReliefError::Length { what: "the period", .. })));
        let depth = Relief::new(1.0, bad, AIR, Vec::new());
        assert!(matches!(depth, Err(ReliefError::Length { what: "the depth", .. })));
    }
    let triangle = [[0.0, 0.0], [10.0, 0.0], [5.0, 4.0]];
    for (n, k) in [(0.0, 0.0), (-1.0, 0.0), (1.0, -1e-9), (f64::NAN, 0.0), (1.0, f64::INFINITY)] {
        let index = Complex64::new(n, k);
        let background = Relief::new(1.0, 1.0, index, Vec::new());
        assert!(matches!(background, Err(ReliefError::Index { .. })));
        let inside = relief(vec![polygon(AIR, &triangle), polygon(index, &triangle)]).unwrap_err();
        assert!(inside.to_string().starts_with("polygon 2: a refractive index"), "{inside}");
    }
}

#[test]
fn polygons_that_are_none_are_refused() {
    let two = one(&[[0.0, 0.0], [10.0, 0.0], [10.0, 0.0], [0.0, 0.0]]);
    assert_eq!(two, Err(ReliefError::TooFewPoints { polygon: 0, got: 2 }));
    let flat = one(&[[0.0, 0.0], [10.0, 0.0], [5.0, 0.0]]);
    assert!(matches!(flat, Err(ReliefError::SelfCrossing { .. })));
    let infinite = one(&[[0.0, 0.0], [f64::INFINITY, 0.0], [5.0, 4.0]]);
    assert!(matches!(infinite, Err(ReliefError::Coordinate { point: 1, .. })));
    for z in [-0.1, 4.1] {
        let outside = one(&[[0.0, 1.0], [10.0, 1.0], [5.0, z]]);
        assert!(matches!(outside, Err(ReliefError::OutsideDepth { point: 2, .. })));
    }
    let wide = one(&[[0.0, 0.0], [160.1, 0.0], [5.0, 4.0]]).unwrap_err();
    assert_eq!(wide.to_string(), "polygon 1: may be at most 16 periods (160) wide, got 160.1");
}

#[test]
fn points_a_rounding_outside_are_moved_in() {
    let tooth = one(&[[0.0, -1e-12], [10.0, 0.0], [8.0, 4.0 + 1e-12]]).unwrap();
    assert_eq!(tooth.polygons()[0].points, [[0.0, 0.0], [10.0, 0.0], [8.0, 4.0]]);
}

#[test]
fn polygons_that_cross_or_touch_themselves_are_refused() {
    for (points, first, second) in [
        // A bow tie.
        (vec![[0.0, 0.0], [10.0, 4.0], [10.0, 0.0], [0.0, 4.0]], 0, 2),
        // A corner on a side.
        (vec![[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [5.0, 0.0], [0.0, 4.0]], 0, 2),
        // A spike that folds back.
        (vec![[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [10.0, 2.0], [0.0, 2.0]], 1, 2),
        // A side that runs along another.
        (vec![[0.0, 0.0], [9.0, 0.0], [9.0, 2.0], [6.0, 0.0], [3.0, 0.0], [0.0, 4.0]], 0, 2),
        // The last side folds back onto the first.
        (vec![[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [5.0, 0.0]], 0, 2),
    ] {
        let refused = one(&points);
        assert_eq!(
            refused,
            Err(ReliefError::SelfCrossing { polygon: 0, first, second }),
            "{points:?}"
        );
    }
}

#[test]
fn layers_are_joined_merged_and_checked() {
    let segment = |x0, x1, index| Segment { x0, x1, index };
    let layer = Layer::new(
        0.0,
        vec![
            segment(1e-13, 0.3, AIR),
            segment(0.3 + 1e-13, 0.5, AIR),
            segment(0.5, 1.0 - 1e-13, SILVER),
        ],
    )
    .unwrap();
    assert_covers(&layer.segments);
    assert_eq!(layer.segments, [segment(0.0, 0.5, AIR), segment(0.5, 1.0, SILVER)]);
    assert_eq!(layer.uniform_index(), None);
    assert!(!layer.is_lossless());
    let film = Layer::uniform(1.0, SILICONE).unwrap();
    assert_eq!(film.uniform_index(), Some(SILICONE));
    assert!(film.is_lossless());

    assert!(matches!(Layer::uniform(-1.0, AIR), Err(ReliefError::Thickness { .. })));
    assert!(matches!(Layer::uniform(f64::NAN, AIR), Err(ReliefError::Thickness { .. })));
    assert!(matches!(Layer::uniform(1.0, Complex64::ZERO), Err(ReliefError::Index { .. })));
    assert!(matches!(Layer::new(1.0, Vec::new()), Err(ReliefError::OpenEnd { .. })));
    for (x0, x1) in [(0.1, 1.0), (f64::NAN, 1.0), (-0.1, 1.0)] {
        let refused = Layer::new(1.0, vec![segment(x0, x1, AIR)]);
        assert!(matches!(refused, Err(ReliefError::Uncovered { segment: 0, .. })), "{x0} {x1}");
    }
    for x1 in [0.0, -1.0, f64::NAN] {
        let refused = Layer::new(1.0, vec![segment(0.0, x1, AIR)]);
        assert!(matches!(refused, Err(ReliefError::EmptySegment { .. })), "{x1}");
    }
    let overlap = Layer::new(1.0, vec![segment(0.0, 0.6, AIR), segment(0.5, 1.0, SILVER)]);
    assert!(matches!(overlap, Err(ReliefError::Uncovered { segment: 1, .. })));
    let long = Layer::new(1.0, vec![segment(0.0, 1.1, AIR)]);
    assert!(matches!(long, Err(ReliefError::OpenEnd { .. })));
}
