// SPDX-License-Identifier: MIT OR Apache-2.0
//! The LED box off the axis of its package and tilted.
//!
//! Sources: view factors of a Lambertian face in closed form; the same box as a solid with a source
//! on it; the package moved in place of the box; mirrors of the whole package.

use batwing_tests::judgement::{PATHS, account, alike, close};
use batwing_tests::traces::{parsed, trace};
use design::Design;
use design::resolved::array::PackagePositions;
use metrics::{Estimate, jackknife};
use simulate::model::Model;
use simulate::observation::Observation;

/// A box in air without reflections.
const BARE: &str = r#"
name = "bare"
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing", MOVED }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
"#;

/// A box in a smooth dome on a black bottom.
const DOMED: &str = r#"
name = "domed"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
silicone = { index = 1.41 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
"#;

fn bare(moved: &str) -> Design {
    parsed(&BARE.replace("MOVED", moved))
}

fn seen(design: &Design) -> Observation {
    trace(design, Model::Geometric, PATHS, 29)
}

/// Power that goes up on the side of positive x.
fn to_the_right(seen: &Observation) -> Estimate {
    let azimuths = seen.sphere.azimuths;
    jackknife(&seen.far_field, |powers| {
        let upper = powers.chunks(azimuths).take(seen.sphere.polar / 2);
        let right = |ring: &[f64]| {
            let quarter = azimuths / 4;
            ring[..quarter].iter().chain(&ring[3 * quarter..]).sum::<f64>()
        };
        upper.map(right).sum()
    })
}

#[test]
fn an_offset_in_air_is_a_package_elsewhere() {
    let plane = "\n[[receivers]]\nname = \"a\"\nkind = \"plane\"\nposition_mm = [0, 0, 2.5]\n\
                 size_mm = [12, 12]\nbins = [12, 12]\n";
    let text = format!("{BARE}{plane}");
    let moved = parsed(&text.replace("MOVED", "offset_mm = [1.3, -0.7]"));
    let mut elsewhere = parsed(&text.replace("MOVED", ""));
    elsewhere.array.positions = PackagePositions::List {
        positions_mm: vec![[1.3, -0.7]],
        turns_deg: Vec::new(),
        file: String::new(),
    };
    let mut displaced = parsed(&text.replace("MOVED", ""));
    displaced.array.offsets_mm = vec![[1.3, -0.7]];
    let [a, b, c] = [&moved, &elsewhere, &displaced].map(seen);
    assert_eq!(b.receivers[0].total(), c.receivers[0].total());
    let bins = a.receivers[0].total().iter().zip(b.receivers[0].total());
    let differ: f64 = bins.map(|(a, b)| (a - b).abs()).sum();
    assert!(differ < 20.0 / PATHS as f64, "{differ}");
    // The map is not averaged over mirrors that the package no longer has.
    let map = &moved_map(&a);
    assert!(map[0] > 0.2 && map[1] < -0.1, "{map:?}");
}

/// A package that is turned is the one whose parts are stated where the turn takes them.
#[test]
fn a_turned_package_is_all_that_is_in_it_elsewhere() {
    let wall = |place: &str, size: &str| {
        format!(
            "\n[[solids]]\nname = \"post\"\nkind = \"box\"\nsize_mm = {size}\nposition_mm = {place}\n\
             surface = {{ kind = \"lambertian\", reflectance = 0.8 }}\n"
        )
    };
    let text = format!("{BARE}{}", wall("[0.9, 0.1, 0.5]", "[0.2, 0.8, 1.0]"));
    let text = text.replace("MOVED", "offset_mm = [0.1, 0.0]");
    let mut turned = parsed(&text);
    turned.array.turns_deg = vec![90.0];
    let by_hand = format!("{BARE}{}", wall("[-0.1, 0.9, 0.5]", "[0.8, 0.2, 1.0]"));
    let by_hand = by_hand.replace("[1.0, 0.6]", "[0.6, 1.0]");
    let by_hand = parsed(&by_hand.replace("MOVED", "offset_mm = [0.0, 0.1]"));
    let [plain, turned, by_hand] = [&parsed(&text), &turned, &by_hand].map(seen);
    let all = [&plain, &turned, &by_hand].map(|seen| {
        let wall = account(seen, "absorbed_by_post");
        [to_the_right(seen), wall]
    });
    let off = |a: Estimate, b: Estimate| {
        (a.value - b.value).abs() / a.standard_error.hypot(b.standard_error)
    };
    for (found, expected) in all[1].into_iter().zip(all[2]) {
        assert!(off(found, expected) < 4.5, "{found:?} {expected:?}");
    }
    // The wall stands in the way of what goes to the right where nothing is turned.
    assert!(off(all[0][0], all[1][0]) > 20.0, "{all:?}");
}

/// A package with all that there may be in it, its lengths times `factor`; a relief of `count` rings of
/// `ring` micrometres.
fn package(factor: f64, [ring, count]: [f64; 2]) -> Design {
    let mm = |lengths: &[f64]| {
        let scaled = lengths.iter().map(|length| format!("{:?}", factor * length));
        format!("[{}]", scaled.collect::<Vec<_>>().join(", "))
    };
    let one = |length: f64| format!("{:?}", factor * length);
    parsed(&format!(
        "name = \"whole\"\n\
         dome = {{ sphere_radius_mm = {}, height_mm = {}, width_mm = {} }}\n\
         silicone = {{ index = 1.41, absorption_per_mm = 0.2 }}\n\
         elements = {{ count = {count}, width_um = {ring:?}, shapes = [{{ from = 1, to = {count}, type = \"OS1\" }}] }}\n\
         mirror = {{ kind = \"specular\", reflectance = 0.8, extent = \"array\" }}\n\
         led = {{ size_mm = {}, height_mm = {}, reflection = \"lambertian\", reflectance = 0.5, offset_mm = {} }}\n\
         array = {{ columns = 1, rows = 1, pitch_mm = 8.0 }}\n\
         light = {{ wavelength_nm = 550.0 }}\n\
         receiver = {{ bin_mm = 0.5, plane_height_mm = 4.0 }}\n\
         [[sources]]\nname = \"spot\"\nkind = \"rectangle\"\nposition_mm = {}\nsize_mm = {}\ninside = \"silicone\"\n\
         [[sources]]\nname = \"chip\"\nkind = \"chip\"\nface_powers = [1, 1, 1, 1, 1]\n\
         [[solids]]\nname = \"post\"\nkind = \"box\"\nsize_mm = {}\nposition_mm = {}\n\
         rotation_deg = [0, 10, 30]\nsurface = {{ kind = \"lambertian\", reflectance = 0.5 }}\n\
         [[solids]]\nname = \"ball\"\nkind = \"sphere\"\nradius_mm = {}\nposition_mm = {}\n\
         medium = {{ index = 1.6, absorption_per_mm = 1.0 }}\n",
        one(2.0),
        one(1.0),
        one(3.4),
        mm(&[1.0, 0.6]),
        one(0.2),
        mm(&[0.1, -0.1]),
        mm(&[0.4, 0.5, 0.5]),
        mm(&[0.2, 0.1]),
        mm(&[0.2, 0.6, 0.5]),
        mm(&[2.2, 0.2, 0.6]),
        one(0.3),
        mm(&[0.0, 0.1, 1.5]),
    ))
}

/// A package that is scaled is the one whose lengths are all stated so much longer, about its foot.
#[test]
fn a_scaled_package_is_all_of_its_lengths_longer() {
    let stated = package(1.6, [160.0, 17.0]);
    let (plain, mut scaled) = (package(1.0, [100.0, 17.0]), package(1.0, [100.0, 17.0]));
    scaled.array.scales = vec![1.6];
    let [plain, scaled, stated] = [&plain, &scaled, &stated].map(|design| {
        let seen = seen(design);
        let all = ["escaped_up", "absorbed_by_post", "absorbed_in_silicone", "absorbed_in_ball"];
        let mut all: Vec<Estimate> = all.map(|name| account(&seen, name)).into();
        all.push(to_the_right(&seen));
        let map = moved_map(&seen);
        (all, map)
    });
    for (k, (a, b)) in scaled.0.iter().zip(&stated.0).enumerate() {
        alike(&format!("{k}"), *a, *b);
    }
    // Some millimetres of scatter over the root of the paths on the map.
    let off = (0..2).map(|axis| (scaled.1[axis] - stated.1[axis]).abs()).fold(0.0, f64::max);
    assert!(off < 0.04, "{:?} {:?}", scaled.1, stated.1);
    // The media absorb more in the larger package.
    let [large, small] = [&scaled, &plain].map(|(all, _)| all[2]);
    let error = large.standard_error.hypot(small.standard_error);
    assert!(large.value - small.value > 20.0 * error, "{large:?} {small:?}");
}

/// Packages of unequal size are those of single ones, whether a file or the design scales them.
#[test]
fn sizes_of_packages_are_those_of_single_ones() {
    let of = |columns: usize, file: &[f64], own: &[f64]| {
        let text = DOMED
            .replace("columns = 1", &format!("columns = {columns}"))
            .replace("pitch_mm = 8.0", "pitch_mm = 8.0, crossing = false")
            .replace("index = 1.41", "index = 1.41, absorption_per_mm = 0.3");
        let led = "led = { size_mm = [0.8, 0.8], height_mm = 0.3, reflection = \"absorbing\" }\n";
        let mut design = parsed(&format!("{text}{led}"));
        (design.array.stated_scales, design.array.scales) = (file.to_vec(), own.to_vec());
        seen(&design)
    };
    let up = |seen: &Observation| account(seen, "escaped_up");
    let [small, large] = [0.6, 1.8].map(|scale| up(&of(1, &[], &[scale])));
    let both = of(2, &[0.6, 0.9], &[1.0, 2.0]);
    let error = small.standard_error.hypot(large.standard_error);
    alike("both", up(&both), Estimate::new(0.5 * (small.value + large.value), 0.5 * error));
    assert!(small.value - large.value > 20.0 * error, "{small:?} {large:?}");
    assert_eq!(up(&of(1, &[2.0], &[0.5])), up(&of(1, &[], &[])));
}

/// Mean x and y of the light on the map, mm.
fn moved_map(seen: &Observation) -> [f64; 2] {
    let map = seen.illuminance.total();
    let all: f64 = map.iter().sum();
    [0, 1].map(|axis| {
        let bins = map.iter().enumerate();
        bins.map(|(k, value)| seen.grid.middle_mm(k)[axis] * value / all).sum()
    })
}

#[test]
fn a_tilted_face_shares_its_light_by_view_factors() {
    // Of a Lambertian face the share (1 + n·e)/2 goes to the half-space along e; the box lies
    // below its own face.
    for [x, y] in [[0.0f64, 8.0], [0.0, -8.0], [9.0, 0.0], [6.0, -5.0]] {
        let seen = seen(&bare(&format!("tilt_deg = [{x:?}, {y:?}]")));
        let up = 0.5 * (1.0 + x.to_radians().cos() * y.to_radians().cos());
        close("floor", account(&seen, "absorbed_by_floor"), 1.0 - up);
        close("up", account(&seen, "escaped_up"), up);
        if x == 0.0 {
            let sine = y.to_radians().sin();
            // All that goes down goes to the side that the face looks to.
            let down = if y > 0.0 { 1.0 - up } else { 0.0 };
            let right = 0.5 * (1.0 + sine) - down;
            close("right", to_the_right(&seen), right);
        }
    }
}

#[test]
fn a_tilted_box_in_a_dome_is_the_same_solid_with_a_source_on_it() {
    let tilted = parsed(&format!(
        "{DOMED}led = {{ size_mm = [1.0, 0.6], height_mm = 0.35, reflection = \"absorbing\", \
         offset_mm = [0.2, -0.1], tilt_deg = [0.0, 6.0] }}\n"
    ));
    // On a black bottom nothing tells a box on a wedge from one above a gap.
    let (sin, cos) = 6f64.to_radians().sin_cos();
    let lift = 0.5 * sin + 1e-6;
    let along = |height: f64| [0.2 + height * sin, -0.1, lift + height * cos];
    let solid = parsed(&format!(
        "{DOMED}led = {{ size_mm = [1e-3, 1e-3], height_mm = 1e-3, reflection = \"absorbing\", \
         offset_mm = [-1.0, 1.0] }}\n\
         [[solids]]\nname = \"chip\"\nkind = \"box\"\nsize_mm = [1.0, 0.6, 0.35]\n\
         position_mm = {:?}\nrotation_deg = [0.0, 6.0, 0.0]\n\
         surface = {{ kind = \"absorbing\" }}\n\
         [[sources]]\nname = \"top\"\nkind = \"rectangle\"\nposition_mm = {:?}\n\
         normal = [{sin:?}, 0.0, {cos:?}]\nsize_mm = [0.6, 1.0]\n",
        along(0.175),
        along(0.35)
    ));
    let [a, b] = [&tilted, &solid].map(seen);
    for name in ["escaped_up", "absorbed_by_bottom", "absorbed_by_floor"] {
        alike(name, account(&a, name), account(&b, name));
    }
    alike("right", to_the_right(&a), to_the_right(&b));
    let box_and_chip = [
        account(&a, "absorbed_by_box_side").value + account(&a, "absorbed_by_box_top").value,
        account(&b, "absorbed_by_chip").value,
    ];
    let error = account(&b, "absorbed_by_chip").standard_error;
    assert!((box_and_chip[0] - box_and_chip[1]).abs() < 6.5 * error, "{box_and_chip:?} {error}");
}

#[test]
fn sources_on_the_box_move_with_it() {
    let led = "led = { size_mm = [1.0, 0.6], height_mm = 0.35, reflection = \"lambertian\", \
               reflectance = 0.8, offset_mm = [0.2, -0.1], tilt_deg = [4.0, 6.0] }\n";
    let chip = "[[sources]]\nname = \"chip\"\nkind = \"chip\"\nface_powers = [1, 0, 0, 0, 0]\n";
    let [top, chip] = [String::new(), chip.to_owned()].map(|more| {
        let design = parsed(&format!("{DOMED}{led}{more}"));
        trace(&design, Model::Geometric, PATHS, 31)
    });
    assert_eq!(top.far_field.total(), chip.far_field.total());
}

#[test]
fn offsets_of_packages_are_those_of_single_ones() {
    let of = |columns: usize, moved: &str| {
        let text = DOMED
            .replace("columns = 1", &format!("columns = {columns}"))
            .replace("pitch_mm = 8.0", "pitch_mm = 8.0, crossing = false");
        seen(&parsed(&format!(
            "{text}led = {{ size_mm = [0.8, 0.8], height_mm = 0.3, reflection = \"specular\", \
             reflectance = 0.8, {moved} }}\n"
        )))
    };
    let tilted = of(2, "tilt_deg = [0.0, 2.0], tilts_deg = [[0.0, 4.0], [0.0, -8.0]]");
    // Mirrored in x = 0, a box tilted by -6° is one tilted by 6°.
    let [right, left] = ["[0.0, 6.0]", "[0.0, -6.0]"]
        .map(|tilt| to_the_right(&of(1, &format!("tilt_deg = {tilt}"))));
    close("tilts", to_the_right(&tilted), 0.5 * (right.value + left.value));
    assert!(right.value - left.value > 6.0 * right.standard_error.hypot(left.standard_error));
    let same = of(2, "offsets_mm = [[0.3, 0.1], [0.3, 0.1]]");
    let all = of(2, "offset_mm = [0.3, 0.1]");
    assert_eq!(same.far_field.total(), all.far_field.total());
    let added = of(2, "offset_mm = [0.2, 0.0], offsets_mm = [[0.1, 0.1], [0.1, 0.1]]");
    alike("sum", account(&added, "escaped_up"), account(&all, "escaped_up"));
    // Mirrored in x = 0, two packages are one; a box in a corner sends out another share.
    let mirrored = of(2, "offsets_mm = [[0.5, 0.0], [-0.5, 0.0]]");
    let [single, centred] = ["offset_mm = [0.5, 0.0]", ""].map(|moved| of(1, moved));
    let up = |seen: &Observation| account(seen, "escaped_up");
    alike("mirrored", up(&mirrored), up(&single));
    let error = up(&single).standard_error.hypot(up(&centred).standard_error);
    let change = (up(&single).value - up(&centred).value).abs();
    assert!(change > 6.0 * error, "{change} {error}");
    // Half of the light goes to either side, where one box sends more to one.
    close("right", to_the_right(&mirrored), 0.5 * up(&mirrored).value);
}
