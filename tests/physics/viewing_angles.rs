// SPDX-License-Identifier: MIT OR Apache-2.0
//! Luminance at viewing angles: a Lambertian plane has E/π at every angle, and a cosⁿ emitter half
//! of its axial luminance where cosⁿ⁻¹ is a half.

use std::f64::consts::PI;
use std::path::Path;

use design::Design;
use metrics::Estimate;
use metrics::quantity::Curve;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::observation::by_angle::curves_by_angle;
use simulate::scene_check;
use simulate::trace::observe;
use simulate::units::Units;

const ROOM: &str = r#"
name = "room"
mirror = { kind = "absorbing", extent = "package" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing", power_w = 1.0 }
array = { columns = 1, rows = 1, pitch_mm = 60.0 }
receiver = { bin_mm = 1.0, plane_height_mm = 4.0 }
light = { wavelength_nm = 550.0 }
"#;

/// A design and what is seen of it.
fn seen(text: &str, paths: u64) -> (Design, Observation) {
    let design = design::parse("room.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let env = RunContext::quiet(&interrupt, 7);
    let seen = observe(&design, &surface, paths, "", env).expect("a trace");
    (design, seen)
}

/// Figures of receivers by key, with the interval of one that is not resolved.
fn figures(text: &str, paths: u64) -> impl Fn(&str) -> Option<(Estimate, Option<[f64; 2]>)> {
    let (design, seen) = seen(text, paths);
    let all = seen.estimates(&design, |key| key.contains('.'));
    move |key| {
        let found = all.iter().find(|figure| figure.key == key)?;
        Some((found.entry.estimate(), found.entry.interval))
    }
}

fn receiver(name: &str, keys: &str) -> String {
    format!(
        "[[receivers]]\nname = \"{name}\"\nkind = \"luminance\"\nposition_mm = [0.0, 0.0, 1.01]\n\
         size_mm = [20.0, 20.0]\nbins = [3, 3]\n{keys}\n"
    )
}

#[test]
fn a_lambertian_plane_has_one_luminance_at_every_angle() {
    let mut text = format!(
        "{ROOM}sources = [{{ name = \"plane\", kind = \"rectangle\", position_mm = [0.0, 0.0, 1.0], size_mm = [40.0, 40.0] }}]\n"
    );
    let views = [[0.0, 0.0], [30.0, 0.0], [45.0, 90.0], [60.0, 225.0], [75.0, -20.0]];
    for (k, [theta, phi]) in views.into_iter().enumerate() {
        text += &receiver(
            &format!("view{k}"),
            &format!(
                "view_deg = [{theta:?}, {phi:?}]\ntheta_max_deg = 10.0\ntheta_bin_deg = 5.0\nphi_bin_deg = 90.0"
            ),
        );
    }
    text += &receiver("all", "theta_bin_deg = 10.0\nphi_bin_deg = 360.0");
    text += &receiver("one", "theta_bin_deg = 10.0\nphi_bin_deg = 30.0")
        .replace("bins = [3, 3]", "bins = [1, 1]");
    let figure = figures(&text, 1_600_000);
    let expected = 1e6 / 1600.0 / PI;
    let keys = (0..views.len()).map(|k| format!("mean.view{k}"));
    for key in keys.chain(["mean.all", "axial.all"].map(str::to_owned)) {
        let (found, _) = figure(&key).expect("a figure");
        let off = (found.value - expected) / found.standard_error;
        assert!(off.abs() < 3.0, "{key}: {found:?} for {expected}");
        assert!(found.standard_error < 0.03 * expected, "{key}: {found:?}");
    }
    assert!(figure("nine_points.view1").expect("a figure").0.value > 0.7);
    // One place has no extremes.
    assert!(figure("mean.one").is_some() && figure("axial.one").is_some());
    assert_eq!(figure("min_to_max.one"), None);
    // It never falls to a half, and the reason says so.
    assert_eq!(figure("fwhm_u_deg.all"), None);
    let (design, seen) = seen(&text, 50_000);
    let why = |key: &str| seen.why_absent(&design, key);
    assert_eq!(why("fwhm_u_deg.all"), "the luminance does not fall to half of its peak");
    assert_eq!(why("nine_points.one"), "50,048 paths show too little light for it");
}

#[test]
fn half_of_the_axial_luminance_is_where_the_cosines_say() {
    // Luminance over the rectangle: intensity cos⁵ over the cosine.
    let text = format!(
        "{ROOM}sources = [{{ name = \"point\", kind = \"cosine\", exponent = 5.0, position_mm = [0.0, 0.0, 1.0] }}]\n{}{}",
        receiver("all", "theta_bin_deg = 2.0\nphi_bin_deg = 30.0"),
        receiver("quarters", "theta_bin_deg = 2.0\nphi_bin_deg = 90.0")
    );
    let figure = figures(&text, 1_600_000);
    let half = 2.0 * 0.5_f64.powf(0.25).acos().to_degrees();
    for key in ["fwhm_u_deg.all", "fwhm_v_deg.all"] {
        let (found, _) = figure(key).expect("a figure");
        assert!(found.standard_error > 0.0 && found.standard_error < 2.0, "{key}: {found:?}");
        let allowed = 0.3 + 3.0 * found.standard_error;
        assert!((found.value - half).abs() < allowed, "{key}: {found:?} for {half}");
    }
    // Quarters of the azimuth have no planes.
    assert!(figure("axial.quarters").is_some());
    assert_eq!(figure("fwhm_u_deg.quarters"), None);
    // Few paths do not resolve it, and say so.
    let few = figures(&text, 1000);
    let (_, interval) = few("fwhm_u_deg.all").expect("a figure");
    let [low, high] = interval.expect("an interval");
    assert!(low < half && half < high, "{low} {high}");
}

#[test]
fn curves_by_angle_are_those_of_the_emitter() {
    let text = format!(
        "{ROOM}sources = [{{ name = \"point\", kind = \"cosine\", exponent = 5.0, position_mm = [0.0, 0.0, 1.0] }}]\n{}",
        receiver("all", "theta_bin_deg = 5.0\nphi_bin_deg = 30.0")
    );
    let paths = 400_000;
    let (design, seen) = seen(&text, paths);
    let units = Units::from_design(&design, None);
    let one_path = 1.0 / paths as f64;
    let curves = curves_by_angle(&design.receivers[0], &seen.receivers[0], units, one_path);
    let curves = curves.expect("finite").expect("bins of angle");
    let names: Vec<&str> = curves.iter().map(Curve::label).collect();
    assert_eq!(names, ["mean over azimuth", "plane of u", "plane of v"]);
    // Of 6/(2π) cos⁵ W/sr, through 400 mm² that are seen at the cosine.
    let expected = |theta_deg: f64| {
        let [a, b] = [theta_deg - 2.5, theta_deg + 2.5].map(|edge| edge.to_radians().cos());
        let power = (a.powi(6) - b.powi(6)) / 6.0;
        6.0 / (2.0 * PI) * power / (0.5 * (a * a - b * b)) / 4e-4
    };
    for curve in &curves {
        let points = curve.x().iter().zip(curve.value()).zip(curve.standard_error());
        let lit: Vec<f64> = points
            .filter(|((theta, _), _)| **theta < 70.0)
            .map(|((theta, value), error)| (value - expected(*theta)) / error)
            .collect();
        let chi_square: f64 = lit.iter().map(|off| off * off).sum();
        // 14 bins: 0.1 % of chi-square lies above 36.
        assert!(lit.len() == 14 && chi_square < 36.0, "{}: {lit:?}", curve.label());
        assert!(curve.standard_error().iter().all(|error| *error > 0.0), "{}", curve.label());
    }
}
