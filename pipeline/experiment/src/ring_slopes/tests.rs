// SPDX-License-Identifier: MIT OR Apache-2.0
use std::path::Path;

use super::*;
use design::dotted_keys::Settings;
use geometry::Meridian;

use crate::design_file::DesignFile;

fn file(name: &str) -> DesignFile {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let path = root.join("data/designs").join(name);
    let text = std::fs::read_to_string(&path).expect("a design");
    DesignFile::new(path, toml::from_str(&text).expect("TOML"))
}

fn ends(outline: &Meridian) -> Vec<[f64; 2]> {
    outline.pieces.iter().map(|piece| piece.end).collect()
}

#[test]
fn shapes_of_the_slopes_of_a_design_give_its_outline() {
    let file = file("d3.toml");
    let design = file.with(&Settings::new()).expect("valid");
    let slopes = RingSlopes::of(&design).expect("triangles and steps");
    assert_eq!(slopes.count(), 17);
    let settings = Settings::from([("elements.shapes".to_owned(), slopes.shapes())]);
    let same = file.with(&settings).expect("valid");
    let [before, after] = [&design, &same].map(|d| ends(&d.outline().expect("an outline")));
    assert_eq!(before.len(), after.len());
    for (a, b) in before.iter().zip(&after) {
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9, "{a:?} {b:?}");
    }
}

#[test]
fn steps_have_level_treads_and_upright_risers() {
    let design = file("d3.toml").with(&Settings::new()).expect("valid");
    let slopes = RingSlopes::of(&design).expect("triangles and steps");
    for ring in 6..17 {
        assert!(slopes.values(Side::Inner)[ring].abs() < 1e-9);
        assert!((slopes.values(Side::Outer)[ring] - 90.0).abs() < 1e-9);
    }
}

#[test]
fn clipped_slopes_keep_draft_apex_and_the_surface_below() {
    let design = file("d3.toml").with(&Settings::new()).expect("valid");
    let mut slopes = RingSlopes::of(&design).expect("triangles and steps");
    for ring in 1..=slopes.count() {
        slopes.set(Side::Inner, ring, 80.0);
        slopes.set(Side::Outer, ring, -40.0);
    }
    slopes.set(Side::Outer, 3, 89.0);
    slopes.clip(85.0, 60.0);
    let (inner, outer) = (slopes.values(Side::Inner), slopes.values(Side::Outer));
    assert!((outer[2] - 85.0).abs() < 1e-12);
    assert!((inner[2] - 35.0).abs() < 1e-12, "{}", inner[2]);
    for (k, (inner, outer)) in inner.iter().zip(&outer).enumerate() {
        assert!(*outer > slopes.falls[k][1] && *inner > -slopes.falls[k][0]);
        assert!(180.0 - inner - outer > 60.0 - 1e-9);
    }
    // Clipping twice changes nothing.
    let once = slopes.clone();
    slopes.clip(85.0, 60.0);
    assert_eq!(once, slopes);
}

#[test]
fn packages_without_rings_have_no_slopes() {
    let design = file("bare-dome.toml").with(&Settings::new()).expect("valid");
    let said = RingSlopes::of(&design).expect_err("no rings").to_string();
    assert!(said.contains("[elements]"), "{said}");
}
