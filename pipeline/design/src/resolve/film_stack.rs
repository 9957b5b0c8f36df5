// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[films]]`, checked: each film is a box over the array whose upper and lower face may do more
//! than refract.

use std::path::Path;

use metrics::digits::shortest;

use super::form::SolidTable;
use super::solids::resolve_one;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::Design;
use crate::resolved::solids::{CheckedSolid, LEAST_MM};
use crate::schema::film_stack::Film;
use crate::schema::solids::{Flat, Per, Solid, SolidForm, SolidKeys, SolidScatter};
use metrics::kinds::Carrying;
use runtime::serde_arrays::List;

/// Air between films, mm.
const GAP_MM: f64 = 0.01;

/// The films of a design whose other parts are checked.
pub(crate) fn resolve(
    raw: &[Film],
    design: &Design,
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedSolid>, ConfigError> {
    let mut films = Vec::new();
    let mut below_mm = None;
    for (number, film) in raw.iter().enumerate() {
        let table = format!("films[{}]", number + 1);
        let is_polarised = design.polarization == Carrying::Carried;
        let read = SolidTable { name: &table, folder, is_polarised, at };
        let thickness_mm = read.length("thickness_mm", film.thickness_mm)?;
        let low_mm = lower_face_mm(film, below_mm, &read)?;
        below_mm = Some(low_mm + thickness_mm);
        let [x, y] = lengths_mm(film, design, &read)?;
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
        let known = design.solids.iter().chain(&films).map(CheckedSolid::name);
        read.check_name(&film.name, known)?;
        let faces = [film.top.as_ref(), film.bottom.as_ref()].map(Option::<&SolidScatter>::cloned);
        films.push(resolve_one(&stated, faces, design.wavelength_nm, &read)?);
    }
    Ok(films)
}

/// Height of the lower face of a film over one that ends at `below_mm`.
fn lower_face_mm(
    film: &Film,
    below_mm: Option<f64>,
    read: &SolidTable,
) -> Result<f64, ConfigError> {
    // Without the rounding of sums.
    let is_thin = |gap_mm: f64| gap_mm < LEAST_MM * (1.0 - 1e-6);
    let thin =
        "light passes a thinner gap as if it were none; state films without a gap as one film";
    match (film.z_mm, film.gap_mm, below_mm) {
        (Some(z_mm), None, below_mm) if is_thin(z_mm - below_mm.unwrap_or(0.0)) => {
            let below = below_mm.map_or("the bottom".to_owned(), |top_mm| {
                format!("{} mm, where the film below ends", shortest(top_mm))
            });
            let expected = format!("at least {} mm above {below}: {thin}", shortest(LEAST_MM));
            Err(read.at.value(&read.key("z_mm"), z_mm, &expected))
        }
        (Some(z_mm), None, _) => read.length("z_mm", z_mm),
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
fn lengths_mm(film: &Film, design: &Design, read: &SolidTable) -> Result<[f64; 2], ConfigError> {
    if let Some(List(stated)) = film.size_mm {
        for length in stated {
            read.length("size_mm", length)?;
        }
        return Ok(stated);
    }
    if let Some(half) = design.housing_half_mm() {
        return Ok(half.map(|half| 2.0 * half));
    }
    let (half, pitch) = (design.half_extent_mm(), design.array.pitch_mm.along());
    Ok([0, 1].map(|k| 2.0 * half[k] + pitch[k]))
}
