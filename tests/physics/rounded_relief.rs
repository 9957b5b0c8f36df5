// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rounded tips and valleys of relief: areas in closed form, and rays on arcs beside cells of
//! polygons.

use batwing_tests::judgement::{PATHS, account, alike};
use batwing_tests::traces::{parsed, trace};
use design::Design;
use geometry::profile::{Elements, Reference, Rounding, Shape};
use geometry::{Cell, Curve, Meridian, ring_cell};
use gratings::interface::interface;
use simulate::model::Model;
use simulate::observation::Observation;

const DESIGN: &str = r#"
name = "own"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
silicone = { index = 1.41 }
mirror = { kind = "specular", reflectance = 0.9, extent = "package" }
led = { size_mm = [0.5, 0.5], height_mm = 0.2, reflectance = 0.5, reflection = "lambertian" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
far_field = { bin_deg = 5.0 }
"#;

fn parse(more: &str) -> Design {
    parsed(&format!("{DESIGN}{more}"))
}

fn relief(shape: Shape, width_mm: f64, [tip_mm, valley_mm]: [f64; 2]) -> Elements {
    Elements {
        width_mm,
        shapes: vec![shape; (1.7 / width_mm).round() as usize],
        rounding: Rounding { tip_mm, valley_mm },
    }
}

/// Silicone above the chord in one period, µm²; a shift of the lowest point aside.
fn area(cell: &Cell, level_um: f64) -> f64 {
    let points = &cell.points_um;
    let next = points.iter().cycle().skip(1);
    let twice: f64 = points.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum();
    0.5 * twice.abs() + level_um * cell.period_um
}

#[test]
fn arcs_change_the_area_of_a_cell_by_the_closed_form() {
    // An arc of radius ρ in a corner of opening γ covers ρ² (cot(γ/2) - (π - γ)/2) of it.
    let covered = |radius: f64, opening: f64| {
        radius * radius * (1.0 / (0.5 * opening).tan() - 0.5 * (std::f64::consts::PI - opening))
    };
    let design = parse("");
    let sphere = design.sphere().expect("a sphere");
    let (inner, apex) = (50f64, 70f64);
    let shape =
        Shape::Triangle { inner_base_deg: inner, apex_deg: apex, reference: Reference::Chord };
    let cell = |radii: [f64; 2]| {
        let rings = relief(shape.clone(), 0.02, radii);
        ring_cell(sphere, &rings, 30, 1.41).expect("they fit").expect("relief")
    };
    let sharp = area(&cell([0.0; 2]), 0.0);
    // The opening of the valley between two triangles is that of the apex: their sides are
    // parallel. Its lowest point lies on the bisector turned to the normal.
    let (tip, valley) = (3.0, 2.0);
    let opening = apex.to_radians();
    let lean = 0.5 * (inner - (180.0 - inner - apex)).to_radians();
    let level = valley * (lean.cos() / (0.5 * opening).sin() - 1.0);
    for (radii, change, level) in [
        ([tip, 0.0], -covered(tip, opening), 0.0),
        ([0.0, valley], covered(valley, opening), level),
        ([tip, valley], covered(valley, opening) - covered(tip, opening), level),
    ] {
        let rounded = cell(radii.map(|um| 1e-3 * um));
        let found = area(&rounded, level) - sharp;
        // Within 5 nm of arcs of some 6 µm, and of the lowest point over a period.
        assert!((found - change).abs() < 0.15, "{radii:?}: {found} for {change}");
        let lowest = rounded.points_um.iter().map(|p| p[1]).fold(9.0, f64::min);
        assert!(lowest.abs() < 1e-12);
        interface(&rounded, 0.55).expect("a relief that is solved");
    }
}

#[test]
fn corners_of_steps_are_quarter_circles() {
    let design = parse("");
    let sphere = design.sphere().expect("a sphere");
    // The riser of the first step is 2.5 µm high.
    let radii = [1.4e-3, 1e-3];
    let meridian = Meridian::stepped(sphere, &relief(Shape::Os1, 0.1, radii)).expect("it fits");
    for pair in meridian.pieces.windows(2) {
        for axis in 0..2 {
            assert_eq!(pair[0].end[axis].to_bits(), pair[1].start[axis].to_bits());
        }
    }
    let [mut tips, mut valleys] = [0.0; 2];
    for piece in &meridian.pieces {
        if let Curve::Bend { radius_mm, clockwise, .. } = piece.curve {
            let expected = radii[usize::from(!clockwise)];
            assert!((radius_mm - expected).abs() < 1e-15);
            *if clockwise { &mut tips } else { &mut valleys } += piece.sweep();
        }
    }
    // 17 tips, and 16 valleys between steps; the last riser stands on the cylinder.
    let quarter = std::f64::consts::FRAC_PI_2;
    assert!((tips - 17.0 * quarter).abs() < 1e-9, "{tips}");
    assert!((valleys - 16.0 * quarter).abs() < 1e-9, "{valleys}");
}

/// Values of figures of two models agree to 2e-3 and 4.5 standard errors.
fn near(what: &str, a: &Observation, b: &Observation) {
    for name in ["escaped_up", "absorbed_by_bottom", "absorbed_by_box_top"] {
        let (a, b) = (account(a, name), account(b, name));
        let error = a.standard_error.hypot(b.standard_error);
        let off = (a.value - b.value).abs();
        assert!(off < 2e-3 + 4.5 * error, "{what}, {name}: {a:?} {b:?}");
    }
}

const RINGS: &str =
    "hybrid = { element_width_um = 20.0, rings_per_band = 1, representative = 1 }\n";

fn rounded(kind: &str, radii: [f64; 2]) -> String {
    let [tip, valley] = radii;
    format!(
        "elements = {{ count = 85, width_um = 20.0, tip_radius_um = {tip:?}, \
         valley_radius_um = {valley:?}, shapes = [{{ from = 1, to = 85, {kind} }}] }}\n{RINGS}"
    )
}

#[test]
fn rays_on_arcs_are_rays_in_cells_of_polygons() {
    let triangle = "type = \"triangle\", inner_base_angle_deg = 50, apex_angle_deg = 70";
    for (kind, radii) in [(triangle, [3.0, 2.0]), (triangle, [0.0, 4.0])] {
        let design = parse(&rounded(kind, radii));
        let arcs = trace(&design, Model::Geometric, PATHS / 4, 7);
        assert!(
            arcs.ledger()
                .accounts
                .iter()
                .all(|(name, power)| { !name.starts_with("lost_") || power.value < 1e-4 })
        );
        let cells = trace(&design, Model::Control, PATHS / 2, 8);
        near(&format!("{radii:?}"), &arcs, &cells);
    }
}

#[test]
fn small_radii_are_sharp_corners() {
    let kind = "type = \"triangle\", inner_base_angle_deg = 50, apex_angle_deg = 70";
    let [sharp, round] = [[0.0; 2], [0.02, 0.02]].map(|radii| {
        let design = parse(&rounded(kind, radii));
        trace(&design, Model::Geometric, PATHS / 4, 9)
    });
    for name in ["escaped_up", "absorbed_by_bottom", "absorbed_by_box_top"] {
        alike(name, account(&sharp, name), account(&round, name));
    }
}
