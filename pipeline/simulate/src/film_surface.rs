// SPDX-License-Identifier: MIT OR Apache-2.0
//! The films of a design as one surface, without regard to where light leaves.

use anyhow::{Context, Result, bail};
use tracer::StackSurface;

use design::Design;
use design::resolved::solids::CheckedSolid;

use super::{film_table, scene};

/// The films of `design` as one surface at its wavelength, of which `paths` rays stand for an incidence.
///
/// # Errors
/// A design without films, with films that convert light, of different lengths or with bodies between
/// them; scattering that does not fit the media.
pub fn surface(design: &Design, paths: u64, seed: u64) -> Result<StackSurface> {
    let file = &design.provenance.file;
    let films: Vec<&CheckedSolid> = design.solids.iter().filter(|solid| solid.is_film()).collect();
    let mut ends = films.iter().filter_map(|film| film.film_mm());
    let ([low, top], size_mm) = ends
        .next()
        .with_context(|| format!("{file}: films: expected at least one table, got none"))?;
    let high = ends.next_back().map_or(top, |([_, high], _)| high);
    let is_no_stack = film_table::other_lengths(&films, size_mm)
        .or_else(|| film_table::printed_film(design))
        .or_else(|| film_table::body_in_stack(design, [low, high]));
    if let Some(why) = is_no_stack {
        bail!(
            "{file}: films: expected a stack of films of one size with nothing between, got: {why}"
        );
    }
    let converts = |film: &&CheckedSolid| {
        film.medium.as_ref().is_some_and(|medium| !medium.luminophores.is_empty())
    };
    if let Some(film) = films.iter().find(|film| converts(film)) {
        bail!(
            "{file}: {}.medium.luminophores: expected films that keep the wavelength of light, which \
             a scattering file does not change, got {:?}",
            film.table,
            film.name()
        );
    }
    Ok(StackSurface::new(film_table::alone(design, low)?, scene::settings(design, paths, seed))?)
}
