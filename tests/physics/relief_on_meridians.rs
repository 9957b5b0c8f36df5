// SPDX-License-Identifier: MIT OR Apache-2.0
//! Relief on generating curves: cells, bands and figures.
//!
//! Sources: the same dome as a sphere; the curve without elements; rays on the true relief beside
//! bands that scatter like its cells, on a disc, part of a torus and a cone.

use batwing_tests::judgement::{PATHS, account, alike};
use batwing_tests::statistics::agree;
use batwing_tests::traces::{parsed, trace};
use design::Design;
use geometry::ring_cell;
use metrics::Grouped;
use simulate::model::Model;
use simulate::observation::Observation;

const DESIGN: &str = r#"
name = "own"
silicone = { index = 1.41 }
mirror = { kind = "specular", reflectance = 0.9, extent = "package" }
led = { size_mm = [0.5, 0.5], height_mm = 0.2, reflectance = 0.5, reflection = "lambertian" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
far_field = { bin_deg = 5.0 }
"#;
const SPHERE: &str = "dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }\n";
/// A disc, part of a torus that joins it smoothly, a cone and a cylinder.
const CURVE: &str = "dome = { meridian_mm = [[0, 0.9], [0.4, 0.9], \
     [1.0, 0.7281479, 0.4, -0.2333333], [1.4, 0.35], [1.4, 0]] }\n";

fn parse(dome: &str, elements: &str) -> Design {
    parsed(&format!("{DESIGN}{dome}{elements}"))
}

/// The sphere of [`SPHERE`] in three arcs, and its cylinder.
fn sphere_by_rows() -> String {
    let height = |r: f64| (4.0 - r * r).sqrt() - 1.0;
    let rows = [0.5, 1.13, 1.7].map(|r| format!("[{r:?}, {:?}, 0.0, -1.0]", height(r)));
    format!("dome = {{ meridian_mm = [[0, 1], {}, [1.7, 0]] }}\n", rows.join(", "))
}

fn rings(seen: &Observation) -> Grouped {
    let sphere = seen.sphere;
    seen.far_field.map(|powers| {
        let rows = powers.chunks(sphere.azimuths).take(sphere.polar / 2);
        rows.map(|row| row.iter().sum()).collect()
    })
}

fn same_light(what: &str, a: &Observation, b: &Observation) {
    for name in ["out_of_domes", "escaped_up", "absorbed_by_bottom"] {
        alike(what, account(a, name), account(b, name));
    }
    agree(what, &rings(a), &rings(b), 4.0 / PATHS as f64);
}

#[test]
#[ignore = "slow: 4 s"]
fn a_sphere_by_rows_carries_the_relief_of_the_sphere() {
    let elements = "elements = { count = 17, width_um = 100.0, shapes = [\
         { from = 1, to = 8, type = \"OS1\" }, \
         { from = 9, to = 12, type = \"smooth\" }, \
         { from = 13, to = 17, type = \"triangle\", inner_base_angle_deg = 50, \
         apex_angle_deg = 70, reference = \"horizontal\" }] }\n\
         hybrid = { element_width_um = 10.0 }\n";
    let [sphere, rows] = [SPHERE, &sphere_by_rows()].map(|dome| parse(dome, elements));
    let cells = |design: &Design| {
        let (base, rings) = (design.base().expect("a dome"), design.hybrid_rings());
        let cell = |ring| ring_cell(base, &rings, ring, 1.41).expect("sharp corners");
        (1..=rings.shapes.len()).map(cell).collect::<Vec<_>>()
    };
    let mut compared = 0;
    for pair in cells(&sphere).into_iter().zip(cells(&rows)) {
        let (Some(a), Some(b)) = pair else {
            assert_eq!(pair, (None, None));
            continue;
        };
        let points = |cell: &geometry::Cell| cell.points_um.concat();
        for (x, y) in points(&a).into_iter().zip(points(&b)) {
            assert!((x - y).abs() < 1e-9, "{a:?} {b:?}");
        }
        assert!((a.slope_deg - b.slope_deg).abs() < 1e-9);
        compared += 1;
    }
    assert_eq!(compared, 130);
    for model in [Model::Geometric, Model::Fine, Model::Control] {
        let a = trace(&sphere, model, PATHS, 3);
        let b = trace(&rows, model, PATHS, 4);
        same_light(&model.label(&sphere), &a, &b);
    }
}

#[test]
fn smooth_elements_leave_the_curve_as_it_is() {
    let smooth = "elements = { count = 140, width_um = 10.0, \
                  shapes = [{ from = 1, to = 140, type = \"smooth\" }] }\n";
    let plain = trace(&parse(CURVE, ""), Model::Geometric, PATHS, 5);
    let zoned = trace(&parse(CURVE, smooth), Model::Geometric, PATHS, 6);
    same_light("smooth", &plain, &zoned);
}

#[test]
fn bands_on_a_curve_scatter_like_its_relief() {
    // Triangles that lean outwards: a frame turned about n, or the other way round, is another
    // surface.
    let elements = "elements = { count = 140, width_um = 10.0, shapes = [{ from = 1, to = 140, \
                    type = \"triangle\", inner_base_angle_deg = 25, apex_angle_deg = 90 }] }\n\
                    hybrid = { element_width_um = 10.0, rings_per_band = 1, representative = 1 }\n";
    let design = parse(CURVE, elements);
    let steps = trace(&design, Model::Geometric, PATHS, 7);
    let bands = trace(&design, Model::Control, PATHS, 8);
    let out = |seen: &Observation| account(seen, "escaped_up");
    // Bands differ from the relief by its height, a hundredth of the dome.
    let off = (out(&steps).value - out(&bands).value).abs();
    let error = out(&steps).standard_error.hypot(out(&bands).standard_error);
    assert!(off < 3e-3 + 4.5 * error, "{:?} {:?}", out(&steps), out(&bands));
    let (a, b) = (rings(&steps), rings(&bands));
    let most = a.total().iter().copied().fold(0.0, f64::max);
    let errors = a.standard_errors().into_iter().zip(b.standard_errors());
    let bins = a.total().iter().zip(b.total()).zip(errors);
    for (k, ((x, y), (ex, ey))) in bins.enumerate() {
        let beyond = (x - y).abs() - 4.5 * ex.hypot(ey);
        assert!(beyond < 0.03 * most, "ring {k}: {x} {y} of {most}");
    }
}
