// SPDX-License-Identifier: MIT OR Apache-2.0
//! Faces of films with thin layers, traced, against quarter-wave stacks in closed form.
//!
//! A stack of quarter waves of the indices a (on the film) and b (outside) on a film of index n has
//! the admittance Y = b² n/a² at normal incidence, and the reflectance ((1 - Y)/(1 + Y))². A plate
//! of two faces, whose reflections do not interfere, transmits
//! (1 - R)(1 - R')/(1 - R R').

use std::path::Path;

use metrics::{Estimate, jackknife};
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::film_table::{FilmTreatment, treatment};
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

/// A beam straight up over a black floor, film by film: cells of a table would widen it.
const BEAM: &str = r#"
name = "beam"
mirror = { kind = "absorbing", extent = "array" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 1000.0 }
receiver = { bin_mm = 10.0, plane_height_mm = 40.0 }
light = { wavelength_nm = 552.0 }
trace = { films = "traced" }
sources = [{ name = "beam", kind = "cosine", exponent = 1e6, position_mm = [3.0, 0.0, 0.2] }]
"#;

/// Paths of a trace, by which powers without scatter are judged too.
const PATHS: u64 = 200_000;

/// One account of the ledger, as a share of what is emitted.
fn account(seen: &Observation, name: &str) -> Estimate {
    let ledger = seen.ledger();
    let found = ledger.accounts.iter().find(|(known, _)| known == name);
    found.unwrap_or_else(|| panic!("{name} among {:?}", ledger.accounts)).1.estimate()
}

/// Judges in standard errors whether an estimate is what it should be.
fn close(what: &str, found: Estimate, expected: f64) {
    let error = found.standard_error.max(2.0 / PATHS as f64);
    let off = (found.value - expected) / error;
    assert!(off.abs() < 4.5, "{what}: {found:?} for {expected}: {off}");
}

fn trace(text: &str) -> Observation {
    let design = design::parse("film.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let env = RunContext::quiet(&interrupt, 37);
    let seen = observe(&design, &surface, PATHS, "", env).expect("a trace");
    assert!(seen.ledger().surplus().abs() < 1e-9);
    seen
}

/// A film of index 1.5 with these faces.
fn film(faces: &str) -> String {
    format!(
        "[[films]]\nname = \"film\"\nz_mm = 1.0\nthickness_mm = 0.1\nsize_mm = [500.0, 500.0]\n\
         medium = {{ index = 1.5 }}\n{faces}\n"
    )
}

#[test]
fn layers_lie_on_faces_from_the_film_outwards() {
    let quarter =
        |index: f64| format!("{{ index = {index:?}, thickness_nm = {:?} }}", 138.0 / index);
    let plain = 0.04;
    for (inner, outer) in [(1.0, 1.38), (2.35, 1.38), (1.38, 2.35)] {
        let admittance: f64 = outer * outer * 1.5 / (inner * inner);
        let coated = ((1.0 - admittance) / (1.0 + admittance)).powi(2);
        let layers = format!("coating = [{}, {}]", quarter(inner), quarter(outer));
        for face in ["top", "bottom"] {
            let seen = trace(&format!(
                "{BEAM}{}",
                film(&format!("{face} = {{ kind = \"coated\", {layers} }}"))
            ));
            let through = (1.0 - plain) * (1.0 - coated) / (1.0 - plain * coated);
            close(face, account(&seen, "escaped_up"), through);
        }
    }
}

#[test]
fn what_layers_absorb_is_that_of_the_film() {
    // A layer of 20 nm of metal: what is neither transmitted nor reflected.
    let metal =
        "top = { kind = \"coated\", coating = [{ index = [0.06, 3.6], thickness_nm = 20.0 }] }";
    let seen = trace(&format!("{BEAM}{}", film(metal)));
    let [up, film, floor] = ["escaped_up", "absorbed_by_film", "absorbed_by_ground_mirror"]
        .map(|name| account(&seen, name).value);
    assert!(film > 0.005, "{film}");
    assert!((up + film + floor - 1.0).abs() < 1e-9, "{up} {film} {floor}");
}

/// Films in optical contact, each of an index, the lowest at z = 1 mm.
fn laminate(indices: &[f64]) -> String {
    let film = |(k, index): (usize, &f64)| {
        let place = if k == 0 { "z_mm = 1.0" } else { "gap_mm = 0.0" };
        format!(
            "[[films]]\nname = \"film{k}\"\n{place}\nthickness_mm = 0.1\nsize_mm = [500.0, 500.0]\n\
             medium = {{ index = {index:?} }}\n"
        )
    };
    indices.iter().enumerate().map(film).collect()
}

/// Reflectances for s and p of an interface of light with n sin θ = `sin`.
fn fresnel([from, to]: [f64; 2], sin: f64) -> [f64; 2] {
    let [a, b] = [from, to].map(|n| (1.0 - (sin / n).powi(2)).sqrt());
    let s = (from * a - to * b) / (from * a + to * b);
    let p = (to * a - from * b) / (to * a + from * b);
    [s * s, p * p]
}

/// Transmittance in air at `degrees` of plates in contact, whose reflections add up without
/// interference: T = T₁T₂/(1 - R₁R₂), R = R₁ + T₁²R₂/(1 - R₁R₂). Of unpolarised light that is
/// depolarised by every surface, or that keeps its polarisation.
fn through(indices: &[f64], degrees: f64, is_carried: bool) -> f64 {
    let all: Vec<f64> = [&[1.0], indices, &[1.0]].concat();
    let of = |weights: [f64; 2]| {
        let (mut passed, mut back) = (1.0, 0.0);
        for pair in all.windows(2) {
            let [s, p] = fresnel([pair[0], pair[1]], degrees.to_radians().sin());
            let r = weights[0] * s + weights[1] * p;
            // Of no loss the reflectance from above is that from below.
            let again = 1.0 / (1.0 - back * r);
            passed *= (1.0 - r) * again;
            back = 1.0 - passed;
        }
        passed
    };
    if is_carried { 0.5 * (of([1.0, 0.0]) + of([0.0, 1.0])) } else { of([0.5, 0.5]) }
}

#[test]
fn laminates_reflect_at_the_interfaces_of_their_media() {
    for indices in [&[1.6, 1.3][..], &[1.6, 1.35, 1.9]] {
        for degrees in [0.0_f64, 70.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let beam = BEAM.replace("exponent", &format!("normal = [{sin}, 0.0, {cos}], exponent"));
            let carried = beam.replace("552.0", "552.0, polarization = \"carried\"");
            for (beam, is_carried) in [(&beam, false), (&carried, true)] {
                let seen = trace(&format!("{beam}{}", laminate(indices)));
                let expected = through(indices, degrees, is_carried);
                let what = format!("{indices:?} at {degrees}");
                close(&what, account(&seen, "escaped_up"), expected);
                close(&what, account(&seen, "absorbed_by_ground_mirror"), 1.0 - expected);
            }
        }
    }
}

/// An interface of one index is none: a face that scatters into films that trap light, and prisms.
#[test]
fn films_of_one_index_in_contact_are_one_film() {
    let text = |films: &str| {
        let lamp = BEAM.replace("exponent = 1e6", "exponent = 1.0");
        trace(&format!("{lamp}{films}"))
    };
    let film = |name: &str, place: &str, keys: &str| {
        format!(
            "[[films]]\nname = \"{name}\"\n{place}\nsize_mm = [20.0, 20.0]\n\
             medium = {{ index = 1.6, absorption_per_mm = 0.05, scattering_per_mm = 0.3, g = 0.7 }}\n{keys}\n"
        )
    };
    let bottom = "bottom = { kind = \"lambertian\", transmitted = 0.9, reflected = 0.1 }";
    let top = "top = { kind = \"prisms\" }";
    let one = text(&film("film", "z_mm = 1.0\nthickness_mm = 0.5", &format!("{bottom}\n{top}")));
    let two = text(
        &(film("low", "z_mm = 1.0\nthickness_mm = 0.2", bottom)
            + &film("high", "gap_mm = 0.0\nthickness_mm = 0.3", top)),
    );
    let alike = |what: &str, a: Estimate, b: Estimate| {
        let error = a.standard_error.hypot(b.standard_error);
        assert!((a.value - b.value).abs() < 4.5 * error, "{what}: {a:?} {b:?}");
    };
    for name in ["escaped_up", "absorbed_by_ground_mirror"] {
        alike(name, account(&one, name), account(&two, name));
    }
    let absorbed = |name: &str, seen: &Observation| account(seen, &format!("absorbed_in_{name}"));
    let [low, high] = ["low", "high"].map(|name| absorbed(name, &two));
    let sum = Estimate::new(low.value + high.value, low.standard_error.hypot(high.standard_error));
    alike("medium", absorbed("film", &one), sum);
    // What lies between the films of one index is met on the way, whichever face carries it.
    let filter = "kind = \"filter\", transmittance = 0.5, reflectance = 0.2";
    let plates = laminate(&[1.6, 1.6]);
    for (face, marker) in [("top", "[[films]]\nname = \"film1\""), ("bottom", "")] {
        let carrier = format!("{face} = {{ {filter} }}\n");
        let films = if marker.is_empty() {
            format!("{plates}{carrier}")
        } else {
            plates.replace(marker, &format!("{carrier}{marker}"))
        };
        let seen = trace(&format!("{BEAM}{films}"));
        // The outer faces, then the filter between them.
        let (outer, t, r) = ((0.6_f64 / 2.6).powi(2), 0.5, 0.2);
        let (half, back) =
            ((1.0 - outer) * t / (1.0 - outer * r), r + t * t * outer / (1.0 - outer * r));
        close(face, account(&seen, "escaped_up"), half * (1.0 - outer) / (1.0 - back * outer));
    }
}

/// What a data sheet says is read back in a beam along the normal: of a plate of any index that absorbs
/// or not, of a sheet in air.
#[test]
fn hazy_films_have_the_values_of_their_data_sheet() {
    let rings = "[[receivers]]\nname = \"rings\"\nkind = \"far_field\"\ntheta_bin_deg = 2.5\nphi_bin_deg = 360.0\n";
    let judge = |what: &str, sheet: &str, transmittance: f64, haze: f64, reflectance: f64| {
        let seen = trace(&format!("{BEAM}{rings}{sheet}"));
        close(what, account(&seen, "escaped_up"), transmittance);
        close(what, account(&seen, "absorbed_by_ground_mirror"), reflectance);
        let straight = jackknife(&seen.receivers[0], |all| all[0]);
        close(what, straight, transmittance * (1.0 - haze));
    };
    let film = |index: f64, absorption: f64, keys: &str| {
        format!(
            "[[films]]\nname = \"film\"\nz_mm = 1.0\nthickness_mm = 0.5\nsize_mm = [500.0, 500.0]\n\
             medium = {{ index = {index:?}, absorption_per_mm = {absorption:?} }}\n\
             top = {{ kind = \"haze\", {keys} }}\n"
        )
    };
    let plain = film(1.5, 0.0, "total_transmittance = 0.92, haze = 0.5");
    judge("plain", &plain, 0.92, 0.5, 0.08);
    let wide = "total_transmittance = 0.9, haze = 0.3, scattered_width_deg = 40.0";
    judge("wide", &film(1.59, 0.0, wide), 0.9, 0.3, 0.1);
    let grey = "total_transmittance = 0.6, haze = 0.8, total_reflectance = 0.2";
    judge("grey", &film(1.59, 0.3, grey), 0.6, 0.8, 0.2);
    judge("in air", &film(1.0, 0.0, grey), 0.6, 0.8, 0.2);
    let clear = "total_transmittance = 0.92, haze = 0.0";
    judge("clear", &film(1.49, 0.0, clear), 0.92, 0.0, 0.08);
    // A face without loss on a film that absorbs: T, and what the faces leave of the rest.
    let seen = trace(&format!("{BEAM}{}", film(1.5, 0.3, "total_transmittance = 0.7, haze = 0.4")));
    close("absorbing", account(&seen, "escaped_up"), 0.7);
    let face = account(&seen, "absorbed_by_film");
    assert!(face.value < 1e-12, "{face:?}");
    let sheet = format!(
        "[[solids]]\nname = \"sheet\"\nkind = \"disc\"\nper = \"array\"\nradius_mm = 300.0\n\
         position_mm = [0.0, 0.0, 2.0]\nscatter = {{ kind = \"haze\", {grey} }}\n"
    );
    judge("sheet", &sheet, 0.6, 0.8, 0.2);
}

/// In a cell that repeats, the outcomes of a table and what is traced film by film have the same accounts,
/// none of which leaks.
#[test]
#[ignore = "slow: a laminate by table and film by film (9 s)"]
fn laminates_by_a_table_are_those_traced_film_by_film() {
    let cell = r#"
name = "cell"
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.5, 0.4], height_mm = 0.15, reflection = "lambertian", reflectance = 0.8 }
array = { columns = 1, rows = 1, pitch_mm = [5.0, 4.0] }
housing = { kind = "periodic", height_mm = 6.0, inner_size_mm = [5.0, 4.0] }
receiver = { plane_height_mm = 5.9, bin_mm = 0.5 }
light = { wavelength_nm = 550.0, polarization = "carried" }

[[films]]
name = "plate"
z_mm = 3.0
thickness_mm = 1.0
medium = { index = 1.49, absorption_per_mm = 0.03, scattering_per_mm = 3.0, g = 0.8 }

[[films]]
name = "glue"
gap_mm = 0.0
thickness_mm = 0.05
medium = { index = 1.41, absorption_per_mm = 0.5 }

[[films]]
name = "base"
gap_mm = 0.0
thickness_mm = 0.2
medium = { index = 1.65 }
bottom = { kind = "polariser", axis_deg = 30.0, pass = { transmittance = 0.9, reflectance = 0.05 }, block = { reflectance = 0.8 } }
top = { kind = "coated", coating = [{ index = [2.0, 0.3], thickness_nm = 50.0 }] }

[[films]]
name = "prisms"
gap_mm = 0.0
thickness_mm = 0.1
medium = { index = 1.586 }
top = { kind = "prisms", direction_deg = 20.0 }

[[films]]
name = "cover"
thickness_mm = 0.2
medium = { index = 1.5 }
top = { kind = "polariser", axis_deg = 75.0, pass = { transmittance = 0.9 } }
"#;
    let design = design::parse("cell.toml", cell, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
    assert!(matches!(treatment(&design), FilmTreatment::Table(_)));
    let [table, films] = ["", "trace = { films = \"traced\" }\n"].map(|keys| {
        let text = cell.replacen("light = ", &format!("{keys}light = "), 1);
        trace(&text)
    });
    let names = |seen: &Observation| -> Vec<String> {
        seen.ledger().accounts.into_iter().map(|(name, _)| name).collect()
    };
    assert_eq!(names(&table), names(&films));
    assert!(names(&table).iter().any(|name| name.ends_with("below_cover")));
    assert!(!names(&table).iter().any(|name| name.ends_with("below_glue")));
    for name in names(&table) {
        let [a, b] = [&table, &films].map(|seen| account(seen, &name));
        let error = a.standard_error.hypot(b.standard_error).max(2.0 / PATHS as f64);
        assert!((a.value - b.value).abs() < 4.5 * error, "{name}: {a:?} {b:?}");
        assert!(!name.starts_with("lost") || a.value.max(b.value) < 1e-5, "{name}: {a:?} {b:?}");
    }
}

#[test]
fn tips_in_glue_let_light_straight_through() {
    // Along the normal, prisms of 90 degrees return all light but where the glue touches them: there
    // nothing parts the media, tips/height of the area. The last face lets all light out; the first
    // reflects R of what comes from either side: (1 - R) f / (1 - R (1 - f)).
    let glued = |tips_um: f64| {
        let tips = if tips_um > 0.0 { format!(", tips_um = {tips_um:?}") } else { String::new() };
        let gap = if tips_um > 0.0 { 0.0 } else { 0.01 };
        let open = "kind = \"filter\", transmittance = 1.0, reflectance = 0.0";
        format!(
            "{BEAM}{}[[films]]\nname = \"glue\"\ngap_mm = {gap:?}\nthickness_mm = 0.03\n\
             size_mm = [500.0, 500.0]\nmedium = {{ index = 1.5 }}\ntop = {{ {open} }}\n",
            film(&format!("top = {{ kind = \"prisms\", pitch_um = 50.0{tips} }}"))
        )
    };
    let first = 0.04;
    for tips_um in [2.5, 10.0, 25.0] {
        let seen = trace(&glued(tips_um));
        let share = tips_um / 25.0;
        let up = (1.0 - first) * share / (1.0 - first * (1.0 - share));
        close(&format!("{tips_um} um"), account(&seen, "escaped_up"), up);
    }
    // The control: without glue nothing passes, but for light that the beam's width sends along the
    // lowest part of the grooves, level through the film to its ends.
    let up = account(&trace(&glued(0.0)), "escaped_up").value;
    assert!(up < 1e-3, "{up}");
}
