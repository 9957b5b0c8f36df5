// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[prints]]`, checked: on which surface or in which film, and where the ink or the particles are.

use std::path::Path;
use std::sync::Arc;

use bsdf::DiffuseLaw;
use bsdf::analytic::linear;
use formats::level_image::LevelImage;
use tracer::{Marks, Pattern};

use super::solids::diffusing;
use crate::check::{Context, MAX_LENGTH_MM, whole_division};
use crate::error::ConfigError;
use crate::resolved::medium::Medium;
use crate::resolved::prints::CheckedPrint;
use crate::resolved::solids::{BOX_FACES, CheckedSolid};
use crate::resolved::{Design, Packages};
use crate::schema::prints::{Dots, Print};
use crate::schema::{self, Extent};
use metrics::digits::shortest;
use runtime::serde_arrays::List;

/// Most dots of a surface.
const MAX_DOTS: f64 = 4e6;

/// The prints of `raw`, on these films and on the mirror below its packages.
pub(crate) fn resolve(
    raw: &schema::Design,
    packages: &Packages,
    films: &[CheckedSolid],
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedPrint>, ConfigError> {
    let mut prints: Vec<CheckedPrint> = Vec::new();
    for (number, print) in raw.prints.iter().enumerate() {
        let table = format!("prints[{}]", number + 1);
        let shares = [print.reflected.unwrap_or_default(), print.transmitted];
        diffusing(&table, shares, [DiffuseLaw::Lambertian; 2], at)?;
        let prefix = format!("{table}.");
        let at = Context { prefix: &prefix, ..*at };
        let extent = raw.mirror.shared.extent;
        let size_mm = printed_mm(print, packages, (films, extent), &at)?;
        if prints.iter().any(|other| other.stated.on == print.on) {
            return Err(at.value("on", format!("{:?}", print.on), "no surface twice"));
        }
        let pattern = match (&print.dots, &print.picture_file) {
            (Some(stated), None) => dots(stated, size_mm, packages, &at)?,
            (None, Some(name)) => picture(&folder.join(name), size_mm, &at)?,
            _ => {
                let expected = "one of `dots` and `picture_file`";
                return Err(at.value("dots", "both or neither", expected));
            }
        };
        let (coverage, pattern) = (pattern.coverage(), Arc::new(pattern));
        prints.push(CheckedPrint { stated: print.clone(), coverage, pattern });
    }
    Ok(prints)
}

impl Design {
    /// The first print that does not repeat from package to package at these distances of columns and rows,
    /// mm: a picture, or dots whose pitch does not divide them.
    pub fn print_of_one_place(&self, pitch_mm: [f64; 2]) -> Option<&CheckedPrint> {
        let is_whole = |times: f64| (times - times.round()).abs() < 1e-9 * times;
        let repeats = |dots: &Dots| pitch_mm.iter().all(|pitch| is_whole(pitch / dots.pitch_mm));
        self.prints.iter().find(|print| !print.stated.dots.as_ref().is_some_and(repeats))
    }

    /// The prints by rule about the packages that there are now; `None` of pictures, or of more dots than
    /// a surface may have.
    pub(super) fn printed_again(&self) -> Option<Vec<CheckedPrint>> {
        let at = Context::new(&self.provenance.file);
        let films: Vec<CheckedSolid> =
            self.solids.iter().filter(|s| s.is_film()).cloned().collect();
        let (packages, surfaces) = (self.packages(), (&films[..], self.mirror.extent));
        let printed = |print: &CheckedPrint| {
            let size_mm = printed_mm(&print.stated, &packages, surfaces, &at).ok()?;
            let pattern = dots(print.stated.dots.as_ref()?, size_mm, &packages, &at).ok()?;
            let coverage = pattern.coverage();
            Some(CheckedPrint {
                coverage,
                pattern: Arc::new(pattern),
                stated: print.stated.clone(),
            })
        };
        self.prints.iter().map(printed).collect()
    }
}

/// Lengths of the printed surface along x and y, mm: a face of a film, the mirror of this extent, or a
/// film with particles.
fn printed_mm(
    print: &Print,
    packages: &Packages,
    (films, extent): (&[CheckedSolid], Extent),
    at: &Context,
) -> Result<[f64; 2], ConfigError> {
    let own = films.iter().find(|film| film.name() == print.on);
    if let (Some((_, size_mm)), Some(film)) = (own.and_then(CheckedSolid::film_mm), own) {
        let holds = |of: &Medium| of.scattering.is_some() || !of.luminophores.is_empty();
        if !film.medium.as_ref().is_some_and(holds) {
            let expected = "a film whose medium scatters or converts light, or one of its faces";
            return Err(at.value("on", format!("{:?}", print.on), expected));
        }
        let transmitted = Some(print.transmitted).filter(|share| *share != 0.0);
        let shares = [("reflected", print.reflected), ("transmitted", transmitted)];
        if let Some((key, Some(share))) = shares.into_iter().find(|(_, share)| share.is_some()) {
            return Err(at.value(key, share, "none of the density of a film, which has no ink"));
        }
        return Ok(size_mm);
    }
    if print.reflected.is_none() {
        return Err(at.value("reflected", "none", "a share from 0 to 1 of ink on a surface"));
    }
    if print.on == Print::MIRROR {
        if print.transmitted != 0.0 {
            let expected = "0 on the mirror, which light does not pass";
            return Err(at.value("transmitted", print.transmitted, expected));
        }
        if extent != Extent::Array {
            let expected = "a face of a film, or mirror.extent = \"array\"";
            return Err(at.value("on", "\"mirror\"", expected));
        }
        let walls = packages.housing_half_mm().unwrap_or([f64::INFINITY; 2]);
        let cells = packages.cells_mm();
        return Ok([0, 1].map(|k| cells[k].min(2.0 * walls[k])));
    }
    let faces = films.iter().enumerate().flat_map(|(number, film)| {
        let above = films.get(number + 1);
        let below = number.checked_sub(1).map(|below| &films[below]);
        let in_air = move |next: Option<&CheckedSolid>| next.is_none_or(|next| !next.joins(film));
        let faces = BOX_FACES.into_iter().zip([above, below]);
        let faces = faces.filter(move |(_, next)| in_air(*next));
        faces.map(move |((face, _), _)| (format!("{}.{face}", film.name()), film))
    });
    let faces: Vec<_> = faces.collect();
    let film = faces.iter().find(|(name, _)| *name == print.on).map(|(_, film)| film);
    if let Some((_, size_mm)) = film.and_then(|film| film.film_mm()) {
        return Ok(size_mm);
    }
    let names: Vec<String> = faces.iter().map(|(name, _)| format!(", {name:?}")).collect();
    let expected = format!(
        "{:?}{}: the mirror or a face before air, or a film",
        Print::MIRROR,
        names.concat()
    );
    Err(at.value("on", format!("{:?}", print.on), &expected))
}

/// Dots by rule over a surface of these lengths: as many as it has whole cells for.
fn dots(
    stated: &Dots,
    size_mm: [f64; 2],
    packages: &Packages,
    at: &Context,
) -> Result<Pattern, ConfigError> {
    let pitch_mm = at.within("dots.pitch_mm", stated.pitch_mm, 1e-3, MAX_LENGTH_MM)?;
    let counts = size_mm.map(|length| (length / pitch_mm * (1.0 + 1e-9)).floor());
    if !(1.0..=MAX_DOTS).contains(&(counts[0] * counts[1])) {
        let expected = format!(
            "1 to {MAX_DOTS} dots on the surface of {} by {} mm, not {} by {}",
            shortest(size_mm[0]),
            shortest(size_mm[1]),
            counts[0],
            counts[1]
        );
        return Err(at.value("dots.pitch_mm", pitch_mm, &expected));
    }
    if let (true, Some(half_mm)) = (packages.is_periodic(), packages.housing_half_mm()) {
        for half in half_mm {
            let key = "dots.pitch_mm";
            whole_division(at, key, 2.0 * half, pitch_mm)?;
        }
    }
    let rows: Vec<[f64; 2]> = stated.radius_mm.iter().map(|List(row)| *row).collect();
    let rises = rows.windows(2).all(|pair| pair[0][0] < pair[1][0]);
    let key = |number: usize| format!("dots.radius_mm[{}]", number + 1);
    if rows.is_empty() || !rises {
        let expected = "rows of distance and radius, the distance rising";
        return Err(at.value("dots.radius_mm", format!("{} rows", rows.len()), expected));
    }
    for (number, [distance, radius]) in rows.iter().enumerate() {
        at.within(&key(number), *distance, 0.0, MAX_LENGTH_MM)?;
        if !(0.0..=0.5 * pitch_mm).contains(radius) {
            let half = shortest(0.5 * pitch_mm);
            let expected = format!("a radius from 0 to {half} mm, half the pitch: dots overlap");
            return Err(at.value(&key(number), radius, &expected));
        }
    }
    let counts = counts.map(|count| count as usize);
    let far_mm = rows[rows.len() - 1][0];
    let distances = distances_mm(counts, pitch_mm, (&axes_mm(packages), far_mm));
    let radii = distances.iter().map(|distance| linear(&rows, *distance) as f32).collect();
    let pattern = Pattern::new([pitch_mm; 2], counts[0], Marks::Dots(radii));
    pattern.map_err(|error| at.of_files(&error.into()))
}

/// Axes of the packages, in a cell that repeats with those of the cells around it, mm.
fn axes_mm(packages: &Packages) -> Vec<[f64; 2]> {
    let own = packages.array.places_mm();
    let Some(half_mm) = packages.housing_half_mm().filter(|_| packages.is_periodic()) else {
        return own;
    };
    let cells = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [f64::from(i), f64::from(j)]));
    let moved = |cell: [f64; 2]| {
        own.iter().map(move |axis| [0, 1].map(|k| axis[k] + 2.0 * half_mm[k] * cell[k]))
    };
    cells.flat_map(moved).collect()
}

/// Distances of dots from the nearest of `axes`, at most `far_mm`.
fn distances_mm(counts: [usize; 2], pitch_mm: f64, (axes, far_mm): (&[[f64; 2]], f64)) -> Vec<f64> {
    let place = |k: usize, number: usize| (number as f64 + 0.5 - 0.5 * counts[k] as f64) * pitch_mm;
    let mut distances = vec![far_mm; counts[0] * counts[1]];
    for axis in axes {
        // Dots that may be nearer than the last row.
        let [columns, lines] = [0, 1].map(|k| {
            let number =
                |mm: f64| (mm / pitch_mm + 0.5 * counts[k] as f64).clamp(0.0, counts[k] as f64);
            number(axis[k] - far_mm).floor() as usize..number(axis[k] + far_mm).ceil() as usize
        });
        for line in lines {
            for column in columns.clone() {
                let nearest = &mut distances[line * counts[0] + column];
                let away = [place(0, column) - axis[0], place(1, line) - axis[1]];
                *nearest = nearest.min(away[0].hypot(away[1]));
            }
        }
    }
    distances
}

/// Shares of the area by a picture over a surface of these lengths.
fn picture(path: &Path, size_mm: [f64; 2], at: &Context) -> Result<Pattern, ConfigError> {
    let read = LevelImage::read(path);
    let (image, ..) =
        read.map_err(|error| at.of_files(&error.context(format!("{}picture_file", at.prefix))))?;
    let cell = [size_mm[0] / image.columns as f64, size_mm[1] / image.rows as f64];
    let shares = image.levels.iter().map(|level| *level as f32).collect();
    let pattern = Pattern::new(cell, image.columns, Marks::Shares(shares));
    pattern.map_err(|error| at.of_files(&error.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two packages, 4 mm apart, under two films in optical contact.
    const LIT: &str = r#"
name = "lit"
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflection = "absorbing" }
array = { columns = 2, rows = 1, pitch_mm = 4.0 }
light = { wavelength_nm = 450.0 }

[[films]]
name = "plate"
z_mm = 5.0
thickness_mm = 1.0
medium = { index = 1.5 }

[[films]]
name = "sheet"
gap_mm = 0.0
thickness_mm = 0.1
medium = { index = 1.6, scattering_per_mm = 5.0 }

[[prints]]
"#;

    fn parsed(print: &str) -> Result<Design, ConfigError> {
        crate::parse("lit.toml", &format!("{LIT}{print}"), Path::new(""))
    }

    #[test]
    fn radii_follow_the_nearest_package() {
        let dots = "on = \"mirror\"\nreflected = 0.9\n\
                    dots = { pitch_mm = 1.0, radius_mm = [[1.0, 0.5], [2.0, 0.1]] }\n";
        let design = parsed(dots).expect("valid");
        let rows = [[1.0, 0.5], [2.0, 0.1]];
        // 8 by 4 cells about packages at x = -2 and 2: in the lowest row from the left.
        let distances = distances_mm([8, 4], 1.0, (&axes_mm(&design.packages()), 2.0));
        let exact = [2.0, 1.5_f64.hypot(0.5), 1.5_f64.hypot(0.5), 2.0];
        for (distance, exact) in distances[..4].iter().zip(exact) {
            assert!((distance - exact).abs() < 1e-12, "{distances:?}");
        }
        let near = 0.5_f64.hypot(0.5);
        assert!((distances[8 + 1] - near).abs() < 1e-12, "{distances:?}");
        let radii = [near, 1.5_f64.hypot(0.5), 2.0, 7.0].map(|distance| linear(&rows, distance));
        assert_eq!(
            [radii[0], radii[2], radii[3]].map(f64::to_bits),
            [0.5, 0.1, 0.1].map(f64::to_bits)
        );
        assert!((radii[1] - (0.5 - 0.4 * (2.5_f64.sqrt() - 1.0))).abs() < 1e-12, "{radii:?}");
        assert!(design.prints[0].pattern.is_mirrored());
    }

    /// In a cell that repeats, dots on both sides of a border see the packages beyond it.
    #[test]
    fn radii_follow_packages_of_the_next_cell() {
        let cell = "on = \"mirror\"\nreflected = 0.9\n\
                    dots = { pitch_mm = 1.0, radius_mm = [[1.0, 0.5], [3.0, 0.1]] }\n\
                    [housing]\nkind = \"periodic\"\ninner_size_mm = [12.0, 4.0]\nheight_mm = 9.0\n";
        let design = parsed(cell).expect("valid");
        // 2 mm from the next axis at x = -2; the cell's left border is 4 mm away from it.
        let distances = distances_mm([12, 4], 1.0, (&axes_mm(&design.packages()), 9.0));
        let by_cell = |x: f64| {
            let axes = [-14.0, -10.0, -2.0, 2.0, 10.0, 14.0];
            axes.into_iter().map(|axis| (x - axis).hypot(0.5)).fold(f64::INFINITY, f64::min)
        };
        for (column, distance) in distances[12..24].iter().enumerate() {
            let exact = by_cell(column as f64 - 5.5);
            assert!((distance - exact).abs() < 1e-12, "{column}: {distance} {exact}");
        }
        let said = parsed(&cell.replace("pitch_mm = 1.0", "pitch_mm = 0.7")).expect_err("a seam");
        assert!(said.to_string().contains("prints[1].dots.pitch_mm"), "{said}");
        let alone = cell.replace("on = \"mirror\"", "on = \"plate.bottom\"");
        assert!(parsed(&alone).is_ok());
    }

    #[test]
    fn dots_of_more_packages_are_those_of_each() {
        let dots = |pitch: f64| {
            format!(
                "on = \"plate.top\"\nreflected = 0.4\ndots = {{ pitch_mm = {pitch}, radius_mm = [[1.0, 0.4], [2.5, 0.1]] }}\n"
            )
        };
        let lit = LIT.replace("name = \"sheet\"\ngap_mm = 0.0", "name = \"sheet\"\ngap_mm = 0.1");
        let parsed = |print: &str| {
            crate::parse("lit.toml", &format!("{lit}{print}"), Path::new("")).expect("valid")
        };
        let design = parsed(&dots(1.0));
        assert!(design.print_of_one_place([4.0; 2]).is_none());
        let wide = design.widened([5, 3], None).expect("it repeats");
        // Of the array as it would be stated.
        let stated = lit.replace("columns = 2, rows = 1", "columns = 5, rows = 3");
        let stated = format!("{stated}{}", dots(1.0));
        let stated = crate::parse("lit.toml", &stated, Path::new("")).expect("valid");
        assert_eq!(wide.prints[0].pattern, stated.prints[0].pattern);
        assert_eq!(
            parsed(&dots(0.9)).print_of_one_place([4.0; 2]).map(|p| &p.stated.on[..]),
            Some("plate.top")
        );
    }

    #[test]
    fn prints_that_cannot_be_are_refused() {
        let dots = "dots = { pitch_mm = 1.0, radius_mm = [[0.0, 0.3]] }";
        let on = |on: &str, more: &str| format!("on = {on:?}\n{more}\n");
        let faces = "\"mirror\", \"plate.bottom\", \"sheet.top\"";
        let cases = [
            (on("plate.top", &format!("reflected = 0.5\n{dots}")), "prints[1].on", faces),
            (on("glass", &format!("reflected = 0.5\n{dots}")), "prints[1].on", faces),
            (on("mirror", &format!("reflected = 1.5\n{dots}")), "prints[1].reflected", "0 to 1"),
            (
                on("mirror", &format!("reflected = 0.5\ntransmitted = 0.1\n{dots}")),
                "prints[1].transmitted",
                "0 on the mirror",
            ),
            (
                on("sheet.top", &format!("reflected = 0.5\ntransmitted = 0.6\n{dots}")),
                "prints[1].reflected",
                "at most 0.4",
            ),
            (on("mirror", "reflected = 0.5"), "prints[1].dots", "one of `dots`"),
            (on("mirror", dots), "prints[1].reflected", "a share from 0 to 1 of ink"),
            (on("plate", dots), "prints[1].on", "whose medium scatters or converts"),
            (
                on("sheet", &format!("reflected = 0.5\n{dots}")),
                "prints[1].reflected",
                "which has no ink",
            ),
            (
                on("sheet", &format!("transmitted = 0.5\n{dots}")),
                "prints[1].transmitted",
                "which has no ink",
            ),
            (
                on(
                    "mirror",
                    "reflected = 0.5\ndots = { pitch_mm = 1.0, radius_mm = [[0.0, 0.6]] }",
                ),
                "prints[1].dots.radius_mm[1]",
                "0 to 0.5 mm",
            ),
            (
                on("mirror", "reflected = 0.5\ndots = { pitch_mm = 1.0, radius_mm = [] }"),
                "prints[1].dots.radius_mm",
                "the distance rising",
            ),
            (
                on("mirror", "reflected = 0.5\ndots = { pitch_mm = 0.001, radius_mm = [[0, 0]] }"),
                "prints[1].dots.pitch_mm",
                "4000000 dots",
            ),
            (
                on("mirror", "reflected = 0.5\npicture_file = \"none.png\""),
                "prints[1].picture_file",
                "none.png",
            ),
            (
                on(
                    "mirror",
                    &format!(
                        "reflected = 0.5\n{dots}\n[[prints]]\non = \"mirror\"\nreflected = 0.1\n{dots}"
                    ),
                ),
                "prints[2].on",
                "no surface twice",
            ),
        ];
        for (print, key, expected) in cases {
            let said = parsed(&print).expect_err(&print).to_string();
            assert!(said.contains(key) && said.contains(expected), "{said}");
        }
    }
}
