// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]` of a design: plates, slabs, balls and sheets against closed forms and laws.
//!
//! Sources: Fresnel's formulas with all inner reflections, the law of Beer and Lambert,
//! reciprocity; the same solid as a primitive and as a mesh.

use std::fmt::Write as _;
use std::path::Path;

use bsdf::Grid;
use bsdf::native;
use tempfile::tempdir;

use batwing_tests::judgement::{PATHS, account, alike, close};
use batwing_tests::tables::smooth;
use batwing_tests::tilted_box::{WEDGE, write_box};
use design::Design;
use metrics::{Estimate, jackknife};
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

const DOMED: &str = include_str!("../../data/designs/bare-dome.toml");

/// A box in air, all black: what the sources send is what arrives.
const BARE: &str = r#"
name = "bare"
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
"#;
const LIGHT: &str = "light = { wavelength_nm = 550.0 }\n";
const BEAM: &str = r#"
[[sources]]
name = "beam"
kind = "cosine"
exponent = 1e6
position_mm = [0.0, 0.0, 1.0]
"#;

fn parse(text: &str, folder: &Path) -> Design {
    let design = design::parse("solids.toml", text, folder).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    design
}

fn seen(design: &Design) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 31);
    let surface = dome_surface(design, Model::Geometric, None).expect("a surface");
    observe(design, &surface, PATHS, "", env).expect("a trace")
}

fn trace(text: &str) -> Observation {
    seen(&parse(text, Path::new("")))
}

/// The sum of the first `bins` bins of receiver `number`.
fn reading(seen: &Observation, number: usize, bins: usize) -> Estimate {
    jackknife(&seen.receivers[number], |all| all[..bins].iter().sum())
}

/// Reflectances of s and p from air to `n` at the cosine `c`.
fn fresnel(n: f64, c: f64) -> [f64; 2] {
    let t = (1.0 - (1.0 - c * c) / (n * n)).sqrt();
    [(c - n * t) / (c + n * t), (n * c - t) / (n * c + t)].map(|r| r * r)
}

/// A plate of 60 mm by 60 mm above everything, turned about x.
fn plate(name: &str, thickness: f64, tilt_deg: f64, medium: &str) -> String {
    format!(
        "[[solids]]\nname = {name:?}\nkind = \"box\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 25.0]\nsize_mm = [60.0, 60.0, {thickness:?}]\nrotation_deg = [{tilt_deg:?}, 0.0, 0.0]\nmedium = {medium}\n"
    )
}

#[test]
fn a_plate_transmits_as_both_faces_and_all_inner_reflections_say() {
    let n = 1.52;
    let glass = format!("{{ index = {n} }}");
    let upright = trace(&format!("{LIGHT}{BARE}{BEAM}{}", plate("plate", 2.0, 0.0, &glass)));
    let closed = 2.0 * n / (n * n + 1.0);
    close("upright", account(&upright, "escaped_up"), closed);
    // What comes back is absorbed by the floor and by the box.
    let tilt = 40.0_f64;
    let [s, p] = fresnel(n, tilt.to_radians().cos());
    let through = |r: f64| (1.0 - r) / (1.0 + r);
    let tilted = plate("plate", 2.0, tilt, &glass);
    let unpolarised = trace(&format!("{LIGHT}{BARE}{BEAM}{tilted}"));
    close("tilted", account(&unpolarised, "escaped_up"), through(0.5 * (s + p)));
    let carried = "light = { wavelength_nm = 550.0, polarization = \"carried\" }\n";
    let polarised = trace(&format!("{carried}{BARE}{BEAM}{tilted}"));
    let both = 0.5 * (through(s) + through(p));
    close("polarised", account(&polarised, "escaped_up"), both);
    assert!((both - through(0.5 * (s + p))).abs() > 1e-3);
    // Two plates with a gap, the faces of which all reflect into each other, by the sums of
    // incoherent stacks: n R/(1 + (2 n - 1) R) of 2 n faces.
    let second = plate("other", 1.0, 0.0, &glass).replace("25.0", "24.0");
    let pair = format!("{LIGHT}{BARE}{BEAM}{}{second}", plate("plate", 1.0, 0.0, &glass));
    let pair = trace(&pair);
    let r = ((n - 1.0) / (n + 1.0)).powi(2);
    close("pair", account(&pair, "escaped_up"), (1.0 - r) / (1.0 + 3.0 * r));
}

#[test]
fn a_slab_absorbs_as_beer_and_lambert_say() {
    let (alpha, thickness, tilt) = (0.3, 2.0, 35.0_f64);
    let gas = format!("{{ index = 1.0, absorption_per_mm = {alpha} }}");
    let seen = trace(&format!("{LIGHT}{BARE}{BEAM}{}", plate("gas", thickness, tilt, &gas)));
    let expected = (-alpha * thickness / tilt.to_radians().cos()).exp();
    close("through", account(&seen, "escaped_up"), expected);
    close("absorbed", account(&seen, "absorbed_in_gas"), 1.0 - expected);
    assert!(account(&seen, "absorbed_by_gas").value <= 0.0);
}

#[test]
fn a_coated_plate_reflects_as_its_quarter_waves_say() {
    // A single layer of index √n, a quarter wave thick, on both faces: nothing is reflected.
    let n = 1.7_f64;
    let layer = format!(
        "coating = [{{ index = {}, thickness_nm = {} }}]\n",
        n.sqrt(),
        550.0 / 4.0 / n.sqrt()
    );
    let glass = plate("plate", 2.0, 0.0, &format!("{{ index = {n} }}"));
    let seen = trace(&format!("{LIGHT}{BARE}{BEAM}{glass}{layer}"));
    assert!((account(&seen, "escaped_up").value - 1.0).abs() < 1e-5);
    let metal = "[[solids]]\nname = \"metal\"\nkind = \"disc\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 20.0]\nradius_mm = 9.0\nsurface = { kind = \"specular\", reflectance = 0.9, substrate = { index = [0.05, 3.6] } }\n";
    let seen = trace(&format!("{LIGHT}{BARE}{BEAM}{metal}"));
    let (re, im) = (0.05_f64, 3.6_f64);
    let r = ((re - 1.0).powi(2) + im * im) / ((re + 1.0).powi(2) + im * im);
    close("metal", account(&seen, "absorbed_by_metal"), 1.0 - 0.9 * r);
}

const GRAINS: &str = r#"
[[solids]]
name = "grain"
kind = "sphere"
position_mm = [0.75, 0.1, 0.5]
radius_mm = 0.2
medium = { index = 1.41 }
[[solids]]
name = "slab"
kind = "box"
position_mm = [0.0, 0.0, 0.25]
size_mm = [1.05, 1.3, 0.5]
medium = { index = 1.41 }
"#;

fn domed(more: &str) -> String {
    format!("{DOMED}\n{more}")
}

#[test]
fn solids_of_the_index_of_what_they_lie_in_change_nothing() {
    let (plain, grains) = (trace(&domed("")), trace(&domed(GRAINS)));
    for name in ["escaped_up", "absorbed_by_bottom", "absorbed_by_box_top", "out_of_domes"] {
        alike(name, account(&plain, name), account(&grains, name));
    }
    assert!(plain.far_field != grains.far_field, "the same draws");
    for name in ["lost_leaked_out_of_a_closed_body", "lost_too_many_bounces"] {
        assert!(account(&grains, name).value < 1e-9, "{name}");
    }
    // Another index does change something.
    let other = trace(&domed(&GRAINS.replace("1.41", "1.9")));
    let [a, b] = [&plain, &other].map(|o| account(o, "escaped_up"));
    assert!((a.value - b.value).abs() > 10.0 * a.standard_error, "{a:?} {b:?}");
}

/// A layer on the LED that holds a grain and an air bubble, a lens around the dome, a plate above
/// all with a rod in it, and fences.
const MANY: &str = r#"
[[solids]]
name = "lens"
kind = "meridian"
meridian_mm = [[0, 1.6], [2.2, 0.5, -0.3], [2.2, 0], [0, 0]]
medium = { index = 1.5 }
[[solids]]
name = "phosphor"
kind = "box"
position_mm = [0.0, 0.0, 0.3]
size_mm = [1.4, 1.4, 0.6]
medium = { index = 1.6 }
[[solids]]
name = "bubble"
kind = "sphere"
position_mm = [0.1, 0.1, 0.48]
radius_mm = 0.05
medium = { index = 1.0 }
[[solids]]
name = "grain"
kind = "cylinder"
position_mm = [-0.2, 0.1, 0.5]
axis = [1.0, 1.0, 0.5]
radius_mm = 0.03
height_mm = 0.1
surface = { kind = "mixed", reflectance = 1.0, specular_fraction = 0.5 }
[[solids]]
name = "plate"
kind = "box"
per = "array"
position_mm = [0.0, 0.0, 2.4]
size_mm = [20.0, 20.0, 0.8]
medium = { index = 1.5 }
[[solids]]
name = "rod"
kind = "cylinder"
per = "array"
position_mm = [1.0, 0.5, 2.4]
axis = [0.0, 1.0, 0.0]
radius_mm = 0.3
height_mm = 12.0
medium = { index = 1.8 }
[[solids]]
name = "fence"
kind = "rectangle"
per = "array"
position_mm = [0.0, 0.0, 0.95]
size_mm = [15.0, 1.8]
rotation_deg = [90.0, 0.0, 0.0]
surface = { kind = "lambertian", reflectance = 1.0 }
"#;

/// The same tables in the opposite order.
fn backwards(solids: &str) -> String {
    let tables: Vec<&str> = solids.split("[[solids]]").skip(1).collect();
    tables.iter().rev().fold(String::new(), |mut all, table| {
        let _ = write!(all, "[[solids]]{table}");
        all
    })
}

#[test]
fn nested_solids_without_loss_lose_nothing_in_whatever_order_they_stand() {
    let clear = DOMED
        .replace("reflectance = 0.95", "reflectance = 1.0")
        .replace("reflectance = 0.86", "reflectance = 1.0");
    let text = |solids: &str| format!("{clear}\n{solids}");
    let there = trace(&text(MANY));
    for name in ["lens", "phosphor", "bubble", "grain", "plate", "rod", "fence"] {
        assert!(account(&there, &format!("absorbed_by_{name}")).value.abs() < 1e-12, "{name}");
    }
    let out = account(&there, "escaped_up").value + account(&there, "absorbed_by_floor").value;
    let lost: f64 = ["leaked_out_of_a_closed_body", "not_finite_or_on_the_wrong_side"]
        .iter()
        .map(|cause| account(&there, &format!("lost_{cause}")).value)
        .sum();
    let trapped = account(&there, "lost_too_many_bounces").value;
    assert!((out + trapped - 1.0).abs() < 1e-9 && lost < 1e-9, "{out} {lost}");
    assert!(trapped < 1e-3, "{trapped}");
    let back = trace(&text(&backwards(MANY)));
    assert_eq!(there.far_field, back.far_field);
    assert_eq!(there.illuminance, back.illuminance);
}

#[test]
fn light_between_two_patches_is_the_same_both_ways() {
    let solids = r#"
[[solids]]
name = "ball"
kind = "sphere"
per = "array"
position_mm = [0.0, 0.1, 2.2]
radius_mm = 0.9
medium = { index = 1.5 }
[[solids]]
name = "core"
kind = "cylinder"
per = "array"
position_mm = [0.1, 0.1, 2.2]
axis = [1.0, 0.3, 0.2]
radius_mm = 0.3
height_mm = 0.9
medium = { index = 1.9 }
[[solids]]
name = "plate"
kind = "box"
per = "array"
position_mm = [0.0, 0.0, 3.5]
size_mm = [5.0, 5.0, 0.3]
rotation_deg = [8.0, -5.0, 20.0]
medium = { index = 1.6, absorption_per_mm = 0.2 }
[[solids]]
name = "stop"
kind = "disc"
per = "array"
position_mm = [0.5, -0.1, 4.0]
axis = [0.2, 0.0, 1.0]
radius_mm = 0.3
surface = { kind = "absorbing" }
"#;
    let (a, b) = ([0.3, 0.0, 0.8], [-0.2, 0.4, 4.4]);
    let (of_a, of_b) = ([1.0, 1.0], [1.4, 0.8]);
    let light = |at: [f64; 3], size: [f64; 2], normal: f64| {
        format!(
            "[[sources]]\nname = \"patch\"\nkind = \"rectangle\"\nposition_mm = {at:?}\nsize_mm = {size:?}\nnormal = [0.0, 0.0, {normal:?}]\n"
        )
    };
    let patch = |at: [f64; 3], size: [f64; 2], normal: &str| {
        format!(
            "[[receivers]]\nname = \"patch\"\nkind = \"plane\"\nposition_mm = {at:?}\nsize_mm = {size:?}\nbins = [1, 1]\nnormal = {normal:?}\n"
        )
    };
    let bare = BARE.replace("bin_mm = 0.5", "bin_mm = 0.5, plane_height_mm = 6.0");
    let up =
        trace(&format!("{LIGHT}{bare}{}{}{solids}", light(a, of_a, 1.0), patch(b, of_b, "+z")));
    let down =
        trace(&format!("{LIGHT}{bare}{}{}{solids}", light(b, of_b, -1.0), patch(a, of_a, "-z")));
    let area = |size: [f64; 2]| size[0] * size[1];
    let times = |e: Estimate, by: f64| Estimate {
        value: e.value * by,
        standard_error: e.standard_error * by,
        ..e
    };
    let (there, back) = (reading(&up, 0, 1), reading(&down, 0, 1));
    assert!(there.value > 0.01 && there.standard_error < 0.02 * there.value, "{there:?}");
    alike("étendue", times(there, area(of_a)), times(back, area(of_b)));
}

#[test]
fn a_box_and_its_mesh_are_one_solid() {
    let folder = tempdir().expect("a folder");
    write_box(&folder.path().join("box.obj"), [1.0, 0.7, 0.3]);
    let exact =
        format!("[[solids]]\nname = \"wedge\"\nkind = \"box\"\nsize_mm = [2.0, 1.4, 0.6]\n{WEDGE}");
    let mesh = format!(
        "[[solids]]\nname = \"wedge\"\nkind = \"mesh\"\nmesh = \"box.obj\"\nmesh_unit = \"mm\"\n{WEDGE}"
    );
    let more = "[[receivers]]\nname = \"wedge\"\nkind = \"surface\"\nsurface = \"wedge\"\n[[receivers]]\nname = \"last\"\nkind = \"far_field\"\ntheta_bin_deg = 30.0\nphi_bin_deg = 30.0\nonly = { last_surface = \"wedge\" }\n";
    let both = [exact, mesh].map(|solid| {
        let design = parse(&domed(&format!("{solid}{more}")), folder.path());
        seen(&design)
    });
    let [a, b] = &both;
    for name in ["escaped_up", "absorbed_by_floor", "absorbed_by_ground_mirror"] {
        alike(name, account(a, name), account(b, name));
    }
    // Rays meet the same faces, and what leaves from them last goes into the same directions.
    for bin in 0..6 {
        alike(
            "flux",
            jackknife(&a.receivers[0], |all| all[bin]),
            jackknife(&b.receivers[0], |all| all[bin]),
        );
    }
    for bin in 0..72 {
        let [a, b] = [a, b].map(|o| jackknife(&o.receivers[1], |all| all[bin]));
        alike("direction", a, b);
    }
    assert!(reading(a, 1, 72).value > 0.1);
}

#[test]
fn fluxes_and_filters_know_solids_by_their_names() {
    let only = |name: &str| {
        format!(
            "[[receivers]]\nname = \"{name}\"\nkind = \"far_field\"\ntheta_bin_deg = 90.0\nphi_bin_deg = 360.0\nonly = {{ last_surface = \"{name}\" }}\n"
        )
    };
    let flux = "[[receivers]]\nname = \"through\"\nkind = \"surface\"\nsurface = \"plate\"\n";
    let lossy = MANY.replace("reflectance = 1.0 }", "reflectance = 0.5 }");
    let of = ["plate", "dome", "fence", "wall", "lens", "ground mirror", "floor"];
    let known: Vec<&str> = of.into_iter().filter(|name| *name != "wall").collect();
    let filters: Vec<String> = known
        .iter()
        .map(|name| only(name).replace("name = \"ground mirror\"", "name = \"ground\""))
        .collect();
    let all = "[[receivers]]\nname = \"all\"\nkind = \"far_field\"\ntheta_bin_deg = 90.0\nphi_bin_deg = 360.0\n";
    let seen = trace(&domed(&format!("{lossy}{all}{}{flux}", filters.concat())));
    let total = reading(&seen, 0, 2);
    let parts: f64 = (1..=known.len()).map(|k| reading(&seen, k, 2).value).sum();
    assert!((parts - total.value).abs() < 1e-9, "{parts} {total:?}");
    let plate = reading(&seen, 1, 2);
    assert!(plate.value > 0.5 && plate.value < total.value);
    // Light goes up through the plate: out of it as much as into it, but for what the rod in it and
    // nothing else keeps, which is nothing.
    let last = known.len() + 1;
    let bin = |k: usize| jackknife(&seen.receivers[last], |all| all[k]).value;
    let (out, into) = (bin(2), bin(5));
    assert!(out > 0.5 && (out - into).abs() < 1e-9, "{out} {into}");
    assert!(account(&seen, "absorbed_by_fence").value > 1e-3);
}

/// A table that sends `share` of the light of any incidence into all directions by the cosine law,
/// from the side and to the side of `direction`.
fn cosine_law(share: f64, direction: &str) -> String {
    let tree = batwing_tests::read("tests/formats/corpus/small.isotropic.xml");
    let (start, end) = (tree.find('{').expect("a tree"), tree.rfind('}').expect("a tree"));
    let value = share / std::f64::consts::PI;
    let text = format!("{}{{ {value} }}{}", &tree[..start], &tree[end + 1..]);
    text.replace("Reflection Front", direction)
}

#[test]
fn a_bsdf_from_a_file_scatters_on_solids_and_sheets() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("paint.xml"), cosine_law(0.5, "Reflection Back")).expect("written");
    std::fs::write(at.join("film.xml"), cosine_law(0.6, "Transmission Front")).expect("written");
    let mut bytes = Vec::new();
    let table = smooth(2.75, 8, Grid::ky_nodes(1.41, 1.0, 40));
    native::write(&table, &mut bytes).expect("written");
    std::fs::write(at.join("smooth.bworders"), bytes).expect("written");
    let trace_here = |text: &str| seen(&parse(text, at));
    let target = |does: &str| {
        format!(
            "{LIGHT}{BARE}{BEAM}[[solids]]\nname = \"target\"\nkind = \"disc\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 20.0]\nradius_mm = 500.0\n{does}\n"
        )
    };

    // A paint on what light does not enter.
    let by_file = target("surface = { file = \"paint.xml\" }")
        .replace("\"disc\"", "\"sphere\"")
        .replace("500.0", "5.0");
    let design = parse(&by_file, at);
    assert_eq!(design.solids[0].files.len(), 1);
    assert!(design.provenance.named.iter().any(|i| i.file.ends_with("paint.xml")));
    let by_law =
        by_file.replace("{ file = \"paint.xml\" }", "{ kind = \"lambertian\", reflectance = 0.5 }");
    let (by_file, by_law) = (seen(&design), trace_here(&by_law));
    close("paint", account(&by_file, "absorbed_by_target"), 0.5);
    alike("box", account(&by_file, "absorbed_by_box_top"), account(&by_law, "absorbed_by_box_top"));

    // A film in the air that light passes.
    let film = trace_here(&target("scatter = { file = \"film.xml\" }"));
    close("film", account(&film, "absorbed_by_target"), 0.4);
    close("through", account(&film, "escaped_up"), 0.6);

    // The smooth face of a solid as a table of its orders, which is Fresnel's.
    let ball = "kind = \"sphere\"\nposition_mm = [0.0, 0.0, 2.0]\nradius_mm = 0.8\nmedium = { index = 1.41 }\n";
    let light = BEAM.replace("1e6", "60.0");
    let ball = format!("{LIGHT}{BARE}{light}[[solids]]\nname = \"ball\"\n{ball}");
    let (by_law, by_table) = (
        trace_here(&ball),
        trace_here(&format!("{ball}scatter = {{ file = \"smooth.bworders\" }}\n")),
    );
    alike("ball", account(&by_law, "escaped_up"), account(&by_table, "escaped_up"));
    let wrong = ball.replace("index = 1.41", "index = 1.5");
    let wrong = format!("{wrong}scatter = {{ file = \"smooth.bworders\" }}\n");
    let wrong = design::parse("solids.toml", &wrong, at).expect("valid by itself");
    let said = format!("{:#}", scene_check::check(&wrong).expect_err("another index"));
    assert!(
        said.contains("solids.toml: solids[1].scatter") && said.contains("index 1.5"),
        "{said}"
    );

    // A medium with that index at 550 nm, and others elsewhere: refused with every light that goes
    // beyond, before anything is traced.
    let glass = "DATA:\n  - type: tabulated n\n    data: |\n        0.5 1.41\n        0.56 1.41\n        0.6 1.45\n";
    std::fs::write(at.join("glass.yml"), glass).expect("written");
    let glass = ball.replace("index = 1.41", "material_file = \"glass.yml\"");
    let glass = format!("{glass}scatter = {{ file = \"smooth.bworders\" }}\n");
    let lit = |light: &str| {
        let text = glass.replace(LIGHT, &format!("light = {light}\n"));
        assert!(text.starts_with(&format!("light = {light}")));
        let design = design::parse("solids.toml", &text, at).expect("valid by itself");
        scene_check::check(&design).map_err(|error| format!("{error:#}"))
    };
    let lines = |nm: &str| {
        format!(
            "{{ spectrum = {{ kind = \"lines\", wavelength_nm = {nm}, power = [1.0, 1.0], weighting = \"radiometric\" }} }}"
        )
    };
    assert_eq!(lit("{ wavelength_nm = 550.0 }"), Ok(()));
    assert_eq!(lit(&lines("[520.0, 550.0]")), Ok(()));
    let said = lit(&lines("[550.0, 600.0]")).expect_err("another index");
    let expected = "solids.toml: solids[1].scatter: `smooth.bworders`: expected a table for index 1.45 on the inner side, got 1.41, at 600 nm";
    assert_eq!(said, expected);
}

#[test]
fn a_source_may_stand_in_a_solid() {
    // In the middle of an absorbing ball: the same way out in all directions.
    let text = format!(
        "{LIGHT}{BARE}[[solids]]\nname = \"ball\"\nkind = \"sphere\"\nposition_mm = [0.0, 0.0, 1.5]\nradius_mm = 1.0\nmedium = {{ index = 1.0, absorption_per_mm = 0.7 }}\n[[sources]]\nname = \"s\"\nkind = \"isotropic\"\nposition_mm = [0.0, 0.0, 1.5]\ninside = \"ball\"\n"
    );
    let seen = trace(&text);
    close("ball", account(&seen, "absorbed_in_ball"), 1.0 - (-0.7_f64).exp());
}
