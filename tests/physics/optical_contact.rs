// SPDX-License-Identifier: MIT OR Apache-2.0
//! Solids in optical contact with the bottom, beside the same ones above a gap of air.
//!
//! Sources: Fresnel's formulas with all inner reflections; the reflectance of a paint below a clear
//! layer [Saunderson 1942]; a dome, whose bottom has always touched the mirror.
//!
//! \[Saunderson 1942\] J. L. Saunderson, *Calculation of the color of pigmented plastics*, J. Opt.
//! Soc. Am. 32, 727.

use std::path::Path;

use batwing_tests::judgement::{PATHS, account, alike, close};
use design::Design;
use metrics::jackknife;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

const CONTACT: &str = "optical_contact = \"bottom\"\n";
const INDEX: f64 = 1.5;

/// A small black box in air on this mirror, of this width.
fn bare(mirror: &str, width: f64) -> String {
    format!(
        r#"
name = "bare"
mirror = {{ extent = "array", {mirror} }}
led = {{ size_mm = [0.1, 0.1], height_mm = 0.05, reflectance = 0.0, reflection = "absorbing" }}
array = {{ columns = 1, rows = 1, pitch_mm = {width:?} }}
receiver = {{ bin_mm = 0.5, plane_height_mm = 4.0 }}
light = {{ wavelength_nm = 550.0 }}
"#
    )
}

/// A square slab on the bottom: its place along x, width, height, absorption.
fn slab([x, width, height, absorption]: [f64; 4], more: &str) -> String {
    format!(
        "[[solids]]\nname = \"slab\"\nkind = \"box\"\nper = \"array\"\nposition_mm = [{x:?}, 0.0, {:?}]\nsize_mm = [{width:?}, {width:?}, {height:?}]\nmedium = {{ index = {INDEX:?}, absorption_per_mm = {absorption:?} }}\n{more}",
        0.5 * height
    )
}

fn parse(text: &str) -> Design {
    let design = design::parse("slab.toml", text, Path::new(""));
    let design = design.unwrap_or_else(|error| panic!("{error}"));
    scene_check::check(&design).unwrap_or_else(|error| panic!("{error:#}"));
    design
}

fn trace(text: &str) -> Observation {
    let design = parse(text);
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 31);
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let seen = observe(&design, &surface, PATHS, "", env).expect("a trace");
    let surplus = seen.ledger().surplus();
    assert!(surplus.abs() < 1e-9, "{surplus}");
    seen
}

/// Reflectance for unpolarised light from index `n1` to `n2` at the cosine `c`.
fn fresnel(n1: f64, n2: f64, c: f64) -> f64 {
    let sin2 = (n1 / n2).powi(2) * (1.0 - c * c);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin2).sqrt();
    let s = (n1 * c - n2 * t) / (n1 * c + n2 * t);
    let p = (n2 * c - n1 * t) / (n2 * c + n1 * t);
    0.5 * (s * s + p * p)
}

/// The mean of a function over (0, 1).
fn mean(f: impl Fn(f64) -> f64) -> f64 {
    let n = 200_000;
    let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
    (0..n).map(|k| f(at(k))).sum::<f64>() / f64::from(n)
}

/// A point within a slab above a black bottom. In contact all that goes down is absorbed; across a
/// gap what lies beyond the critical angle is reflected, and stays in the slab.
#[test]
#[ignore = "slow: 9 s"]
fn a_black_bottom_takes_what_a_gap_reflects() {
    const HEIGHT: f64 = 0.1;
    const PLACE: f64 = 0.07;
    const ABSORPTION: f64 = 0.02;
    let text = |more: &str| {
        let source = format!(
            "[[sources]]\nname = \"s\"\nkind = \"isotropic\"\nposition_mm = [300.0, 0.0, {PLACE:?}]\ninside = \"slab\"\n"
        );
        let slab = slab([0.0, 2000.0, HEIGHT, ABSORPTION], more);
        format!("{}{source}{slab}", bare("kind = \"absorbing\"", 8.0))
    };
    let inner = |c: f64| fresnel(INDEX, 1.0, c);
    // Transmittances from the point to the top, to the bottom, and from face to face.
    let ways = |c: f64| [HEIGHT - PLACE, PLACE, HEIGHT].map(|d| (-ABSORPTION * d / c).exp());

    let touching = trace(&text(CONTACT));
    let up = mean(|c| (1.0 - inner(c)) * ways(c)[0]);
    let down = mean(|c| {
        let [top, foot, across] = ways(c);
        foot + top * inner(c) * across
    });
    close("up", account(&touching, "escaped_up"), 0.5 * up);
    // At 300 mm from the mirror, which is 8 mm wide.
    close("down", account(&touching, "absorbed_by_floor"), 0.5 * down);

    let apart = trace(&text(""));
    // All inner reflections between two faces that reflect alike.
    let face = |c: f64, [near, far, across]: [f64; 3]| {
        let r = inner(c);
        (1.0 - r) * (near + far * r * across) / (1.0 - (r * across).powi(2))
    };
    let up = mean(|c| face(c, ways(c)));
    let down = mean(|c| {
        let [top, foot, across] = ways(c);
        face(c, [foot, top, across])
    });
    close("up across", account(&apart, "escaped_up"), 0.5 * up);
    close("down across", account(&apart, "absorbed_by_floor"), 0.5 * down);
    assert!(account(&apart, "absorbed_in_slab").value > 0.7);
}

/// White paint below a clear layer: with contact Saunderson's formula, with a gap that of a slab
/// above a paint in air.
#[test]
fn a_paint_below_a_layer_reflects_as_saunderson_says() {
    const PAINT: f64 = 0.9;
    let text = |more: &str| {
        let beam = "[[sources]]\nname = \"beam\"\nkind = \"cosine\"\nexponent = 1e6\nnormal = [0.0, 0.0, -1.0]\nposition_mm = [30.0, 0.0, 1.0]\ninside = \"air\"\n";
        let paint = format!("kind = \"lambertian\", reflectance = {PAINT:?}");
        format!("{}{beam}{}", bare(&paint, 120.0), slab([30.0, 50.0, 0.1, 0.0], more))
    };
    let straight = fresnel(1.0, INDEX, 1.0);
    let diffuse = |f: &dyn Fn(f64) -> f64| mean(|c| 2.0 * c * f(c));
    let inner = diffuse(&|c| fresnel(INDEX, 1.0, c));
    // The same by reciprocity: 1 - r_inner = (1 - r_outer)/n².
    let outer = diffuse(&|c| fresnel(1.0, INDEX, c));
    assert!((1.0 - inner - (1.0 - outer) / (INDEX * INDEX)).abs() < 1e-6);
    let expected = straight + (1.0 - straight) * (1.0 - inner) * PAINT / (1.0 - inner * PAINT);
    let touching = trace(&text(CONTACT));
    close("contact", account(&touching, "escaped_up"), expected);
    let absorbed = account(&touching, "absorbed_by_ground_mirror");
    close("paint", absorbed, 1.0 - expected);

    let through = |r: f64| (1.0 - r) / (1.0 + r);
    let slab_diffuse = diffuse(&|c| through(fresnel(1.0, INDEX, c)));
    let back = 1.0 - slab_diffuse;
    let apart =
        1.0 - through(straight) + through(straight) * PAINT * slab_diffuse / (1.0 - PAINT * back);
    close("gap", account(&trace(&text("")), "escaped_up"), apart);
    assert!((apart - expected).abs() > 0.02);
}

/// Metal in contact reflects by the index of the slab: at normal incidence
/// R = r + (1 - r)² m/(1 - r m), m = |(n - ñ)/(n + ñ)|².
#[test]
fn metal_reflects_by_the_index_of_what_touches_it() {
    let metal = "kind = \"specular\", reflectance = 1.0, substrate = { index = [0.6, 2.5] }";
    let beam = "[[sources]]\nname = \"beam\"\nkind = \"cosine\"\nexponent = 1e6\nnormal = [0.0, 0.0, -1.0]\nposition_mm = [30.0, 0.0, 1.0]\ninside = \"air\"\n";
    let r = fresnel(1.0, INDEX, 1.0);
    for (more, before) in [(CONTACT, INDEX), ("", 1.0)] {
        let seen =
            trace(&format!("{}{beam}{}", bare(metal, 120.0), slab([30.0, 50.0, 0.1, 0.0], more)));
        let m = ((before - 0.6).powi(2) + 6.25) / ((before + 0.6).powi(2) + 6.25);
        // Across the gap the slab has two faces.
        let [r, t] = if more.is_empty() {
            [2.0 * r / (1.0 + r), (1.0 - r) / (1.0 + r)]
        } else {
            [r, 1.0 - r]
        };
        let expected = r + t * t * m / (1.0 - r * m);
        close(more, account(&seen, "escaped_up"), expected);
    }
}

/// The same body as a dome and as a solid around the LED.
#[test]
fn a_solid_in_contact_is_a_dome() {
    let common = r#"
name = "body"
mirror = { kind = "mixed", reflectance = 0.9, specular_fraction = 0.5, extent = "array" }
led = { size_mm = [0.8, 0.6], height_mm = 0.3, reflectance = 0.5, reflection = "lambertian" }
array = { columns = 2, rows = 1, pitch_mm = 5.0 }
receiver = { bin_mm = 0.5, plane_height_mm = 4.0 }
light = { wavelength_nm = 550.0 }
"#;
    let rows = "[[0.0, 1.2], [0.7, 1.0], [1.0, 0.4], [1.0, 0.0]";
    let dome = trace(&format!(
        "{common}silicone = {{ index = {INDEX:?} }}\ndome = {{ meridian_mm = {rows}] }}\n"
    ));
    let closed = format!("{rows}, [0.0, 0.0]]");
    let solid = format!(
        "[[solids]]\nname = \"body\"\nkind = \"meridian\"\nmeridian_mm = {closed}\nmedium = {{ index = {INDEX:?} }}\n"
    );
    let touching = trace(&format!("{common}{solid}{CONTACT}"));
    for name in ["escaped_up", "absorbed_by_box_top", "absorbed_by_box_side"] {
        alike(name, account(&dome, name), account(&touching, name));
    }
    for bin in 0..dome.far_field.group(0).len() {
        let of = |seen: &Observation| jackknife(&seen.far_field, |all| all[bin]);
        alike("direction", of(&dome), of(&touching));
    }
    // The mirror below the body counts with that beside it.
    let below = account(&dome, "absorbed_by_bottom").value
        + account(&dome, "absorbed_by_ground_mirror").value;
    let all = account(&touching, "absorbed_by_ground_mirror");
    assert!((all.value - below).abs() < 6.0 * all.standard_error, "{all:?} {below}");
    // A gap holds light back, which this would show.
    let apart = trace(&format!("{common}{solid}"));
    let [a, b] = [&touching, &apart].map(|seen| account(seen, "absorbed_by_ground_mirror"));
    let error = a.standard_error.hypot(b.standard_error);
    assert!((a.value - b.value).abs() > 6.0 * error, "{a:?} {b:?}");
}

/// A slab beyond the edge of the mirror touches the floor there; box or cylinder, alone or with the
/// packages in it.
#[test]
fn mirror_and_floor_each_take_their_part() {
    let mirror = bare("kind = \"absorbing\"", 4.0);
    let source = "[[sources]]\nname = \"s\"\nkind = \"isotropic\"\nposition_mm = [0.3, 0.2, 0.5]\ninside = \"slab\"\n";
    let text = |slab: &str| format!("{mirror}{source}{slab}{CONTACT}");
    let wide = slab([0.0, 12.0, 1.0, 0.0], "");
    let round = wide
        .replace("kind = \"box\"", "kind = \"cylinder\"")
        .replace("size_mm = [12.0, 12.0, 1.0]", "radius_mm = 6.0\nheight_mm = 1.0");
    let [a, b] = [&wide, &round].map(|slab| trace(&text(slab)));
    let of = |seen: &Observation| account(seen, "absorbed_by_ground_mirror");
    alike("mirror", of(&a), of(&b));
    // Straight down through the square of 4 mm, half a millimetre below: by the solid angle of its
    // four corners.
    let corner = |x: f64, y: f64| {
        let z = 0.5;
        (x * y / (z * (x * x + y * y + z * z).sqrt())).atan()
    };
    let direct = corner(1.7, 1.8) + corner(2.3, 1.8) + corner(1.7, 2.2) + corner(2.3, 2.2);
    let direct = direct / (4.0 * std::f64::consts::PI);
    assert!(of(&a).value > direct && account(&a, "absorbed_by_floor").value > 0.05);

    // One in each package, within a dome: the mirror below the dome.
    let domed = include_str!("../../data/designs/bare-dome.toml");
    let ring = "[[solids]]\nname = \"phosphor\"\nkind = \"box\"\nposition_mm = [0.0, 0.0, 0.3]\nsize_mm = [1.6, 1.6, 0.6]\nmedium = { index = 1.41 }\n";
    let [without, with] = ["", CONTACT].map(|more| trace(&format!("{domed}\n{ring}{more}")));
    // Of the index of the silicone, so that a gap of it changes nothing.
    for name in ["escaped_up", "absorbed_by_bottom", "absorbed_by_box_top"] {
        alike(name, account(&without, name), account(&with, name));
    }
}
