// SPDX-License-Identifier: MIT OR Apache-2.0
//! Domes given by a generating curve: the paper's domes, and arcs against fine polylines.
//!
//! Sources: the same domes by sphere and steps; closed forms of geometry.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use design::Design;
use design::resolved::dome::Dome;
use metrics::far_field::PeakMethod;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::trace::observe;

use crate::support::binary::batwing;

const D1: &str = include_str!("../../data/designs/d1.toml");
const BARE: &str = include_str!("../../data/designs/bare-dome.toml");

/// A design of the paper with everything between two of its tables replaced.
fn with(text: &str, from: &str, to: &str, by: &str) -> String {
    let (begin, end) = (text.find(from).expect(from), text.find(to).expect(to));
    format!("{}{by}\n\n{}", &text[..begin], &text[end..])
}

fn with_curve(text: &str, rows: &str) -> String {
    with(text, "[dome]", "[silicone]", &format!("[dome]\nmeridian_mm = [{rows}]"))
}

fn parse(text: &str, folder: &Path) -> Design {
    design::parse("curve.toml", text, folder).expect("a valid design")
}

fn seen(design: &Design, paths: u64) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 11);
    let surface = dome_surface(design, Model::Geometric, None).expect("a dome");
    observe(design, &surface, paths, "", env).expect("a trace")
}

/// Differences of the figures of two designs in standard errors, with peaks between bins: the
/// largest bin has no error to judge by.
fn apart(a: &Design, b: &Design, paths: u64) -> Vec<(String, f64)> {
    let [a, b] = [a, b].map(|design| {
        let mut design = design.clone();
        design.far_field.peak = PeakMethod::Parabola;
        seen(&design, paths).figures(&design)
    });
    let pairs = a.iter().zip(&b);
    let pairs = pairs.filter(|(a, _)| a.key != "uniformity");
    pairs
        .map(|(a, b)| {
            assert_eq!(a.key, b.key);
            let (key, a, b) = (a.key.to_string(), a.entry, b.entry);
            (key, (a.value - b.value) / a.standard_error.hypot(b.standard_error))
        })
        .collect()
}

/// The corners of D1's steps, every number to its last digit.
fn rows_of_d1() -> Vec<[f64; 2]> {
    let design = design::embedded("d1.toml").expect("valid");
    let meridian = design.outline().expect("steps");
    let first = meridian.pieces[0].start;
    let ends = meridian.pieces.iter().map(|piece| piece.end);
    std::iter::once(first).chain(ends).collect()
}

#[test]
fn d1_written_as_a_curve_gives_the_same_bits() {
    let folder = tempdir().expect("a folder");
    let (mut rows, mut lines) = (String::new(), String::from("r_mm; z_mm\n# corners\n"));
    for [r, z] in rows_of_d1() {
        let _ = write!(rows, "[{r:?}, {z:?}], ");
        let _ = writeln!(lines, "{r:?}; {z:?}");
    }
    std::fs::write(folder.path().join("d1.csv"), lines).expect("written");
    let steps = design::embedded("d1.toml").expect("valid");
    let expected = seen(&steps, 200_000);
    let of_file = with(D1, "[dome]", "[silicone]", "[dome]\nmeridian_file = \"d1.csv\"");
    for text in [with_curve(D1, &rows), of_file] {
        let design = parse(&text, folder.path());
        assert!(
            matches!(design.dome, Some(Dome::Meridian(_))) && design.elements.shapes.is_empty()
        );
        assert_eq!(Model::all_of(&design), [Model::Geometric]);
        let found = seen(&design, 200_000);
        assert_eq!(found.far_field, expected.far_field);
        assert_eq!(found.powers, expected.powers);
    }
}

#[test]
fn a_sphere_as_one_arc_is_the_smooth_dome() {
    let smooth = design::embedded("bare-dome.toml").expect("valid");
    let dome = smooth.sphere().expect("a sphere");
    let foot = dome.height_at(1.7);
    let bulge = -(0.85f64.asin() / 4.0).tan();
    for last in [format!("{bulge:?}"), "0, -1".to_owned()] {
        let rows = format!("[0, 1], [1.7, {foot:?}, {last}], [1.7, 0]");
        let design = parse(&with_curve(BARE, &rows), Path::new(""));
        let stated = design.dome.as_ref().expect("a dome");
        assert!(
            (stated.height_mm() - 1.0).abs() < 1e-15 && (stated.radius_mm() - 1.7).abs() < 1e-15
        );
        for (key, apart) in apart(&design, &smooth, 400_000) {
            assert!(apart.abs() < 4.5, "{key}: {apart} standard errors");
        }
    }
}

#[test]
#[ignore = "nightly: 5 s"]
fn nightly_arcs_off_the_axis_give_what_fine_polylines_give() {
    // A hollow, a shoulder, a foot that draws in.
    let arcs = "[0, 0.7], [0.8, 1.1, 0, 1.7], [1.8, 0.6, 1.0, 0.25], [1.6, 0]";
    let exact = parse(&with_curve(BARE, arcs), Path::new(""));
    let pieces = &exact.outline().expect("a curve").pieces;
    let mut rows = String::from("[0, 0.7]");
    for piece in pieces {
        for [r, z] in piece.points(if piece.sweep() > 0.0 { 400 } else { 1 }) {
            let _ = write!(rows, ", [{r:?}, {z:?}]");
        }
    }
    let fine = parse(&with_curve(BARE, &rows), Path::new(""));
    // The shoulder is highest above the middle of its circle.
    let dome = exact.dome.as_ref().expect("a dome");
    assert!((dome.height_mm() - (0.25 + 0.8f64.hypot(0.35))).abs() < 1e-12);
    assert!((dome.radius_mm() - 1.8).abs() < 1e-12);
    for (key, apart) in apart(&exact, &fine, 400_000) {
        assert!(apart.abs() < 4.5, "{key}: {apart} standard errors");
    }
    for (account, value) in seen(&exact, 100_000).ledger().accounts {
        assert!(!account.starts_with("lost") || value.value == 0.0, "{account}");
    }
}

#[test]
fn rays_and_drawings_know_the_curve() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let arcs = "[0, 0.7], [0.8, 1.1, 0, 1.7], [1.8, 0.6, 1.0, 0.25], [1.6, 0]";
    std::fs::write(at.join("curve.toml"), with_curve(BARE, arcs)).expect("written");
    let run = |arguments: &[&str]| {
        let output = batwing(at).args(arguments).output().expect("it runs");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{text}");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    assert!(run(&["check", "curve.toml"]).contains("curve of 3 pieces"));
    run(&["rays", "curve.toml", "--out", "rays", "--count", "50"]);
    let picture = std::fs::read_to_string(at.join("rays/bare-dome-geometric-rays.svg"));
    // Two arcs and their mirror images, in many short stretches.
    assert!(picture.expect("a picture").matches(" L ").count() > 150);
    let list = std::fs::read_to_string(at.join("rays/bare-dome-geometric-rays.json"));
    let list: Value = serde_json::from_str(&list.expect("a list")).expect("JSON");
    assert_eq!(list["paths"].as_array().map(Vec::len), Some(50));
    for format in ["svg", "dxf", "stl"] {
        let out = format!("curve.{format}");
        run(&["export", "curve.toml", "--format", format, "--out", &out]);
    }
    let drawn = std::fs::read_to_string(at.join("curve.dxf")).expect("a drawing");
    assert_eq!(drawn.matches("\nARC\n").count(), 2);
    let drawn = std::fs::read_to_string(at.join("curve.svg")).expect("a drawing");
    assert!(drawn.contains("A 0.873212460 0.873212460 0 0 0 1.8"), "{drawn}");
    // What is left of the volume by 0.1 µm of chord error: compared with Pappus' integral over a
    // fine polyline.
    let said = run(&["export", "curve.toml", "--format", "stl", "--out", "c.stl", "--json"]);
    let said: Value = serde_json::from_str(&said).expect("JSON");
    let volume = said["bodies"][0]["volume_mm3"].as_f64().expect("a volume");
    let design = parse(&with_curve(BARE, arcs), Path::new(""));
    let meridian = design.outline().expect("a curve");
    let mut points = vec![meridian.pieces[0].start];
    for piece in &meridian.pieces {
        points.extend(piece.points(10_000));
    }
    let frustum = |p: &[[f64; 2]]| {
        let [[a, from], [b, to]] = [p[0], p[1]];
        std::f64::consts::PI / 3.0 * (a * a + a * b + b * b) * (from - to)
    };
    let expected: f64 = points.windows(2).map(frustum).sum();
    assert!((volume / expected - 1.0).abs() < 1e-3, "{volume} {expected}");
}

/// An oval dome below a solid under a height map: `check` says how they are traced; meshes and pictures
/// hold them as other meshes.
#[test]
#[ignore = "nightly: 5 s"]
fn nightly_surfaces_that_are_not_round_are_said_and_exported() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let run = |arguments: &[&str]| {
        let output = batwing(at).args(arguments).output().expect("it runs");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {text}");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let rows: Vec<String> = (0..5).map(|row| format!("0.1,0.2,{}.3,0.2,0.1\n", row % 2)).collect();
    let map = rows.concat();
    std::fs::write(at.join("map.csv"), map).expect("written");
    let oval = "[0, 1], [1.7, 0.053565375285274, 0, -1], [1.7, 0]]\n\
                meridian_y_mm = [[0, 1], [1.3, 0.2, 0, -0.45625], [1.3, 0]";
    let solid = "[[solids]]\nname = \"top\"\nkind = \"height_map\"\nsize_mm = [2.0, 1.0]\n\
                 map_file = \"map.csv\"\nscale_mm = 0.03\nbase_mm = 0.2\n\
                 position_mm = [0.0, 0.0, 1.5]\nmedium = { index = 1.5 }\n";
    let text = format!("{}\n{solid}", with_curve(BARE, oval));
    std::fs::write(at.join("oval.toml"), &text).expect("written");
    let said = run(&["check", "oval.toml"]);
    for words in ["oval surface, traced as ", "top: height_map, traced as ", "degrees of it"] {
        assert!(said.contains(words), "{said}");
    }
    run(&["rays", "oval.toml", "--out", "rays", "--count", "50"]);
    for format in ["stl", "obj", "step"] {
        let out = format!("oval.{format}");
        run(&["export", "oval.toml", "--format", format, "--out", &out]);
    }
    // Volumes of the smooth surfaces: ellipses over the height, and the mean height of the map.
    let said = run(&["export", "oval.toml", "--format", "stl", "--out", "o.stl", "--json"]);
    let said: Value = serde_json::from_str(&said).expect("JSON");
    let area = |z: f64| {
        let [x, y] =
            [(1.0, 0.053_565_375_285_274), (0.456_25, 0.2)].map(|(low, foot): (f64, f64)| {
                ((1.0 + low).powi(2) - (z.max(foot) + low).powi(2)).sqrt()
            });
        std::f64::consts::PI * x * y
    };
    let steps = 200_000;
    let volume: f64 = (0..steps).map(|k| area((f64::from(k) + 0.5) / f64::from(steps))).sum();
    let found = said["bodies"][0]["volume_mm3"].as_f64().expect("a volume");
    assert!((found / (volume / f64::from(steps)) - 1.0).abs() < 1e-3, "{found}");
    // The round dome is another one.
    let round = with_curve(BARE, "[0, 1], [1.7, 0.053565375285274, 0, -1], [1.7, 0]");
    std::fs::write(at.join("round.toml"), round).expect("written");
    assert!(!run(&["check", "round.toml"]).contains("traced as"));
    let refused = batwing(at).args(["full-wave", "oval.toml"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("by two meridians"), "{said}");
}
