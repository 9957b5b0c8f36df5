// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[films]]`, checked: each film is a box over the array whose upper and lower face may do more
//! than refract.

use std::path::Path;

use metrics::digits::shortest;

use super::form::SolidTable;
use super::solids::resolve_one;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::Packages;
use crate::resolved::solids::{CheckedSolid, LEAST_MM, MAX_SOLIDS};
use crate::schema;
use crate::schema::film_stack::Film;
use crate::schema::solids::{
    Contacts, Flat, Per, ScatterLaw, Solid, SolidForm, SolidKeys, SolidScatter,
};
use metrics::kinds::Carrying;
use runtime::serde_arrays::List;

/// Rounding of lengths that are equal, mm.
const ROUNDING_MM: f64 = 1e-9;
/// Air between films, mm.
const GAP_MM: f64 = 0.01;

/// The films of `raw` over its packages, as they are at this wavelength.
pub(crate) fn resolve(
    raw: &schema::Design,
    packages: &Packages,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedSolid>, ConfigError> {
    let max_films = MAX_SOLIDS - packages.solids.len();
    if raw.films.len() > max_films {
        let expected = format!("at most {MAX_SOLIDS} tables of solids and films together");
        return Err(at.value("films", raw.films.len(), &expected));
    }
    let mut films: Vec<CheckedSolid> = Vec::new();
    let mut below_mm = None;
    for (number, film) in raw.films.iter().enumerate() {
        let table = format!("films[{}]", number + 1);
        let is_polarised = raw.light.polarization == Carrying::Carried;
        let read = SolidTable { name: &table, folder, is_polarised, at };
        let thickness_mm = read.length("thickness_mm", film.thickness_mm)?;
        let low_mm = lower_face_mm(film, below_mm, &read)?;
        let is_contact = film.gap_mm == Some(0.0);
        below_mm = Some(low_mm + thickness_mm);
        let [x, y] = lengths_mm(film, packages, &read)?;
        let stated = Solid {
            shared: SolidKeys {
                name: film.name.clone(),
                per: Per::Array,
                position_mm: List([0.0, 0.0, low_mm + 0.5 * thickness_mm]),
                medium: Some(film.medium.clone()),
                ..SolidKeys::default()
            },
            kind: SolidForm::Box(Flat { size_mm: List([x, y, thickness_mm]), rotation_deg: None }),
        };
        let known = packages.solids.iter().chain(&films).map(CheckedSolid::name);
        read.check_name(&film.name, known)?;
        let faces = [film.top.as_ref(), film.bottom.as_ref()].map(Option::<&SolidScatter>::cloned);
        let mut film = resolve_one(&stated, faces, wavelength_nm, &read)?;
        holds_relief(&film, thickness_mm, &read)?;
        if is_contact && let Some(below) = films.last_mut() {
            join(below, &mut film, &read)?;
        }
        films.push(film);
    }
    tips_in_glue(&raw.films, at)?;
    Ok(films)
}

/// Refuses relief that is cut deeper into a film than it is thick.
fn holds_relief(
    film: &CheckedSolid,
    thickness_mm: f64,
    read: &SolidTable,
) -> Result<(), ConfigError> {
    let depths_um = film.depths_of_faces_um();
    let most_um = 1e3 * thickness_mm;
    if depths_um.iter().sum::<f64>() <= most_um * (1.0 + ROUNDING_MM) {
        return Ok(());
    }
    let face = usize::from(depths_um[1] > depths_um[0]);
    let name = ["top", "bottom"][face];
    let got = format!("relief {} um deep", shortest(depths_um[face]));
    let other = shortest(depths_um[1 - face]);
    let expected =
        format!("at most {} um, the film, with {other} um on its other face", shortest(most_um));
    Err(read.at.value(&read.key(name), got, &expected))
}

/// Refuses tips that are to stand in a film which is not there, or too thin for them.
fn tips_in_glue(raw: &[Film], at: &Context) -> Result<(), ConfigError> {
    let touches_below = |film: &&Film| film.gap_mm == Some(0.0);
    for (number, film) in raw.iter().enumerate() {
        let above = raw.get(number + 1).filter(touches_below);
        let below = number.checked_sub(1).and_then(|below| raw.get(below));
        let below = below.filter(|_| touches_below(&film));
        for (face, glue, stated) in [("top", above, &film.top), ("bottom", below, &film.bottom)] {
            let Some(tips_um) = stated.as_ref().and_then(|face| face.kind.tips_um()) else {
                continue;
            };
            let most_um = glue.map(|glue| 1e3 * glue.thickness_mm);
            if most_um.is_some_and(|most_um| tips_um <= most_um * (1.0 + ROUNDING_MM)) {
                continue;
            }
            let expected = match most_um {
                Some(most_um) => format!("at most {} um, the film in contact", shortest(most_um)),
                None => {
                    "no such key without a film in optical contact there (gap_mm = 0)".to_owned()
                }
            };
            let key = format!("films[{}].{face}.tips_um", number + 1);
            return Err(at.value(&key, tips_um, &expected));
        }
    }
    Ok(())
}

/// Puts two films in optical contact. One interface is left between them: that of the film whose
/// face says what light meets there, which displaces the other film.
fn join(
    below: &mut CheckedSolid,
    film: &mut CheckedSolid,
    read: &SolidTable,
) -> Result<(), ConfigError> {
    let lengths_mm = [&*below, &*film].map(|film| film.film_mm().map(|(_, lengths)| lengths));
    if let [Some(expected), Some(got)] = lengths_mm
        && (0..2).any(|k| (expected[k] - got[k]).abs() > ROUNDING_MM)
    {
        let expected =
            format!("{expected:?}, as of the film below in optical contact (gap_mm = 0)");
        return Err(read.at.value(&read.key("size_mm"), format!("{got:?}"), &expected));
    }
    let key = format!("{}.top", below.table);
    let faces = [(&key, &below.stated_faces[0]), (&read.key("bottom"), &film.stated_faces[1])];
    for (key, face) in faces {
        if let Some(face) = face
            && face.kind.tips_um().is_none()
            && !matches!(
                face.kind,
                ScatterLaw::File(_)
                    | ScatterLaw::Lambertian(_)
                    | ScatterLaw::Gaussian(_)
                    | ScatterLaw::Polariser(_)
                    | ScatterLaw::Filter(_)
                    | ScatterLaw::Coated(_)
            )
        {
            let expected = "file, lambertian, gaussian, polariser, filter, coated, or grooves with \
                            tips_um where two films are in optical contact (gap_mm = 0): other \
                            relief and haze are those before air";
            let key = format!("{key}.kind");
            return Err(read.at.value(&key, format!("{:?}", face.kind_name()), expected));
        }
    }
    if faces.iter().all(|(_, face)| face.is_some()) {
        let expected =
            format!("no such table beside {key}: one interface is left in optical contact");
        return Err(read.at.value(&read.key("bottom"), "given", &expected));
    }
    let (displaced, displacer) =
        if film.stated_faces[1].is_some() { (below, &*film) } else { (film, &*below) };
    let Contacts(names) = &mut displaced.stated.shared.optical_contact;
    names.push(displacer.name().to_owned());
    Ok(())
}

/// Height of the lower face of a film over one that ends at `below_mm`.
fn lower_face_mm(
    film: &Film,
    below_mm: Option<f64>,
    read: &SolidTable,
) -> Result<f64, ConfigError> {
    // Without the rounding of sums.
    let is_thin = |gap_mm: f64| gap_mm < LEAST_MM * (1.0 - 1e-6);
    let thin = "light passes a thinner gap as if it were none; gap_mm = 0 is optical contact";
    match (film.z_mm, film.gap_mm, below_mm) {
        (Some(z_mm), None, below_mm) if is_thin(z_mm - below_mm.unwrap_or(0.0)) => {
            let below = below_mm.map_or("the bottom".to_owned(), |top_mm| {
                format!("{} mm, where the film below ends", shortest(top_mm))
            });
            let expected = format!("at least {} mm above {below}: {thin}", shortest(LEAST_MM));
            Err(read.at.value(&read.key("z_mm"), z_mm, &expected))
        }
        (Some(z_mm), None, _) => read.length("z_mm", z_mm),
        (None, Some(0.0), Some(top_mm)) => Ok(top_mm),
        (None, Some(gap_mm), Some(_)) if is_thin(gap_mm) => {
            let expected = format!("at least {} mm: {thin}", shortest(LEAST_MM));
            Err(read.at.value(&read.key("gap_mm"), gap_mm, &expected))
        }
        (None, gap_mm, Some(top_mm)) => {
            Ok(top_mm + read.length("gap_mm", gap_mm.unwrap_or(GAP_MM))?)
        }
        (Some(_), Some(_), _) => {
            Err(read.at.value(&read.key("gap_mm"), "given", "no such key beside `z_mm`"))
        }
        (None, _, None) => {
            Err(read.at.value(&read.key("z_mm"), "missing", "the height of the lowest film, mm"))
        }
    }
}

/// Lengths of a film along x and y.
fn lengths_mm(
    film: &Film,
    packages: &Packages,
    read: &SolidTable,
) -> Result<[f64; 2], ConfigError> {
    if let Some(List(stated)) = film.size_mm {
        for length in stated {
            read.length("size_mm", length)?;
        }
        return Ok(stated);
    }
    if let Some(half) = packages.housing_half_mm() {
        return Ok(half.map(|half| 2.0 * half));
    }
    Ok(packages.cells_mm())
}
