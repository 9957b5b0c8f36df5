// SPDX-License-Identifier: MIT OR Apache-2.0
//! The symmetries of a design: every average, drawing and symmetrised figure asks here.
//!
//! They follow from everything that light starts from or meets. Walls, mirror and floor are
//! rectangles about the array and leave what the array leaves; rings and bands stand around the axis
//! of a package; sources are unpolarised, so that light that carries its polarisation has the
//! symmetries of the rest.

use std::collections::HashSet;

use design::Design;
use design::resolved::dome::Dome;
use design::schema::{Average, Extent};
use metrics::illuminance::Symmetry;

use super::scene::mirror_half_mm;

/// The symmetries of the light of `design`.
pub fn symmetry(design: &Design) -> Symmetry {
    parts(design).into_iter().map(|(_, symmetry)| symmetry).fold(Symmetry::Square, Symmetry::min)
}

/// The symmetries that maps of `design` are averaged over.
pub fn of_maps(design: &Design) -> Symmetry {
    match design.receiver.average {
        Average::None => Symmetry::None,
        Average::Symmetries => symmetry(design),
    }
}

/// The part of `design` that leaves its light no mirror symmetry, in words; `None` where it has
/// one.
pub fn broken_by(design: &Design) -> Option<String> {
    let broken = |(_, symmetry): &(String, Symmetry)| *symmetry == Symmetry::None;
    parts(design).into_iter().find(broken).map(|(name, _)| name)
}

/// Half-planes that a far field is shown in, by what each is averaged over.
pub fn cuts(symmetry: Symmetry) -> Vec<(String, Vec<f64>)> {
    let azimuths: &[f64] = match symmetry {
        Symmetry::Square => &[0.0, 45.0],
        Symmetry::Rectangle => &[0.0, 45.0, 90.0],
        Symmetry::None => &[0.0, 90.0, 180.0, 270.0],
    };
    let cut = |azimuth: &f64| (format!("azimuth {azimuth}°"), symmetry.azimuths(*azimuth));
    azimuths.iter().map(cut).collect()
}

/// Names and symmetries of all that shapes the light.
fn parts(design: &Design) -> Vec<(String, Symmetry)> {
    let none_if = |broken: bool| if broken { Symmetry::None } else { Symmetry::Square };
    let [x, y] = design.led.size_mm;
    let led = if !design.led.is_centred() {
        Symmetry::None
    } else if (x / y - 1.0).abs() < 1e-12 {
        Symmetry::Square
    } else {
        Symmetry::Rectangle
    };
    let is_square = |[x, y]: [f64; 2]| (x / y - 1.0).abs() < 1e-12;
    let mirror = (design.mirror.extent == Extent::Array).then(|| mirror_half_mm(design));
    let around = [mirror, design.housing_half_mm()].into_iter().flatten();
    let around =
        if around.into_iter().all(is_square) { Symmetry::Square } else { Symmetry::Rectangle };
    let dome = match &design.dome {
        Some(Dome::Mesh(mesh)) if mesh.file.is_some() => Symmetry::None,
        Some(Dome::Mesh(_)) => Symmetry::Rectangle,
        _ => Symmetry::Square,
    };
    let mut parts = vec![
        ("an LED off its axis or tilted".to_owned(), led),
        ("the places of the packages".to_owned(), of_places(&design.array.axes_mm())),
        ("walls and mirror".to_owned(), around),
        ("packages of unequal drive".to_owned(), none_if(design.array.drives.is_some())),
        ("turned packages".to_owned(), none_if(design.array.is_turned())),
        ("packages of unequal size".to_owned(), {
            let [least, most] = design.array.scale_range();
            none_if(least < most)
        }),
        ("a dome by a mesh or two meridians".to_owned(), dome),
        ("a file of [files]".to_owned(), design.files.symmetry()),
    ];
    let sources = design.sources.iter();
    parts.extend(sources.map(|s| (format!("source {:?}", s.name()), s.symmetry)));
    let solids = design.solids.iter();
    parts.extend(solids.map(|s| (format!("solid {:?}", s.name()), s.symmetry)));
    let prints = design.prints.iter();
    parts.extend(prints.map(|print| (print.name(), print.symmetry())));
    parts
}

/// The symmetries of the places of packages.
pub(super) fn of_places(axes_mm: &[[f64; 2]]) -> Symmetry {
    let extent = axes_mm.iter().flatten().fold(0.0, |far: f64, v| far.max(v.abs()));
    if extent == 0.0 {
        return Symmetry::Square;
    }
    let step = 1e-9 * extent;
    let key = |[x, y]: [f64; 2]| [x, y].map(|v| (v / step).round() as i64);
    let places: HashSet<[i64; 2]> = axes_mm.iter().map(|at| key(*at)).collect();
    // Rounding may lie on either side of a step.
    let holds = |at: [f64; 2]| {
        let [x, y] = key(at);
        (-1..=1).any(|i| (-1..=1).any(|j| places.contains(&[x + i, y + j])))
    };
    let same = |image: fn([f64; 2]) -> [f64; 2]| axes_mm.iter().all(|at| holds(image(*at)));
    if !(same(|[x, y]| [-x, y]) && same(|[x, y]| [x, -y])) {
        Symmetry::None
    } else if same(|[x, y]| [y, x]) {
        Symmetry::Square
    } else {
        Symmetry::Rectangle
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn every_part_of_a_design_can_break_the_symmetry() {
        let own = design::NEW_DESIGN.replace("NAME", "own");
        let of = |edits: &[(&str, &str)], more: &str| {
            let mut text = format!("{own}{more}");
            for (old, new) in edits {
                assert!(text.contains(old), "{old}");
                text = text.replace(old, new);
            }
            let parsed = design::parse("own.toml", &text, Path::new(""));
            parsed.unwrap_or_else(|error| panic!("{edits:?} {more}: {error}"))
        };
        let led = "size_mm = [0.6, 0.6]";
        assert_eq!(symmetry(&of(&[], "")), Symmetry::Square);
        assert_eq!(symmetry(&of(&[("columns = 2", "columns = 3")], "")), Symmetry::Rectangle);
        assert_eq!(symmetry(&of(&[(led, "size_mm = [0.6, 0.4]")], "")), Symmetry::Rectangle);
        let moved = of(&[(led, "size_mm = [0.6, 0.6]\noffset_mm = [0.05, 0.0]")], "");
        assert_eq!(symmetry(&moved), Symmetry::None);
        assert!(broken_by(&moved).expect("a part").contains("LED"));
        for tilted in ["tilt_deg = [0.0, 1.0]", "offsets_mm = [[0,0],[0,0],[0,0],[0,0.1]]"] {
            let led = format!("size_mm = [0.6, 0.6]\n{tilted}");
            assert_eq!(symmetry(&of(&[("size_mm = [0.6, 0.6]", &led)], "")), Symmetry::None);
        }
        let array = "pitch_mm = 5.0";
        let turned = of(&[(array, "pitch_mm = 5.0\nturns_deg = [0, 0, 0, 1]")], "");
        assert_eq!(broken_by(&turned).as_deref(), Some("turned packages"));
        let scaled = of(&[(array, "pitch_mm = 5.0\nscales = [1, 1, 1, 1.1]")], "");
        assert_eq!(broken_by(&scaled).as_deref(), Some("packages of unequal size"));
        let alike = of(&[(array, "pitch_mm = 5.0\nscales = [1.1, 1.1, 1.1, 1.1]")], "");
        assert_eq!(symmetry(&alike), Symmetry::Square);
        let offsets = "pitch_mm = 5.0\noffsets_mm = [[0, 0], [0, 0], [0, 0], [0, 0.1]]";
        let moved = of(&[(array, offsets)], "");
        assert_eq!(broken_by(&moved).as_deref(), Some("the places of the packages"));
        let lamp = "\n[[sources]]\nname = \"lamp\"\nkind = \"isotropic\"\n";
        let at = |x: f64| of(&[], &format!("{lamp}position_mm = [{x:?}, 0.0, 0.5]\n"));
        assert_eq!(symmetry(&at(0.0)), Symmetry::Square);
        assert!(broken_by(&at(0.1)).expect("a part").contains("lamp"));
        let wire = "\n[[solids]]\nname = \"wire\"\nkind = \"sphere\"\nradius_mm = 0.1\nposition_mm = [0.5, 0.0, 0.5]\nsurface = { kind = \"absorbing\" }\n";
        assert!(broken_by(&of(&[], wire)).expect("a part").contains("wire"));
        // Two meridians leave the mirror images in x and in y, where they are not turned.
        let [dome, silicone] = ["[dome]", "[silicone]"].map(|table| own.find(table).expect(table));
        let curves =
            "[dome]\nmeridian_mm = [[0, 1], [1.4, 0]]\nmeridian_y_mm = [[0, 1], [1.2, 0]]\n";
        let oval = of(&[(&own[dome..silicone], curves)], "");
        assert_eq!(symmetry(&oval), Symmetry::Rectangle);
        let lens = "\n[[solids]]\nname = \"lens\"\nkind = \"meridian\"\nposition_mm = [0, 0, 1.3]\nmeridian_mm = [[0, 0.2], [1, 0], [0, 0]]\nmeridian_y_mm = [[0, 0.2], [0.8, 0], [0, 0]]\nmedium = { index = 1.5 }\n";
        assert_eq!(symmetry(&of(&[], lens)), Symmetry::Rectangle);
        let turned = of(&[], &format!("{lens}rotation_deg = [0, 0, 30]\n"));
        assert!(broken_by(&turned).expect("a part").contains("lens"));
        let hexagonal = of(&[("columns = 2", "arrangement = \"hexagonal\"\ncolumns = 2")], "");
        assert_eq!(symmetry(&hexagonal), Symmetry::None);
        // Maps are averaged less than they could be where the design asks for it.
        let plain = of(&[("[receiver] ", "[receiver]\naverage = \"none\" ")], "");
        assert_eq!((symmetry(&plain), of_maps(&plain)), (Symmetry::Square, Symmetry::None));
    }

    #[test]
    fn places_of_packages_have_the_symmetries_of_their_pattern() {
        let third = 1.0 / 3.0;
        assert_eq!(of_places(&[[0.0; 2]]), Symmetry::Square);
        assert_eq!(of_places(&[[-third, 0.0], [third, 0.0]]), Symmetry::Rectangle);
        let plus = [[third, 0.0], [-third, 0.0], [0.0, third], [0.0, -third]];
        assert_eq!(of_places(&plus), Symmetry::Square);
        assert_eq!(of_places(&plus[..3]), Symmetry::None);
        assert_eq!(of_places(&[[1.0, 0.0]]), Symmetry::None);
    }
}
