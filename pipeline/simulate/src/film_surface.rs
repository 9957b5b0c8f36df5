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
/// A design without films, or with films that convert light; scattering that does not fit the media.
pub fn surface(design: &Design, paths: u64, seed: u64) -> Result<StackSurface> {
    let file = &design.provenance.file;
    let mut films = design.solids.iter().filter(|solid| solid.is_film());
    let lowest = films.clone().find_map(CheckedSolid::film_mm);
    let ([low, _], _) =
        lowest.with_context(|| format!("{file}: films: expected at least one table, got none"))?;
    let converts = |film: &&CheckedSolid| {
        film.medium.as_ref().is_some_and(|medium| !medium.luminophores.is_empty())
    };
    if let Some(film) = films.find(converts) {
        bail!(
            "{file}: {}.medium.luminophores: expected films that keep the wavelength of light, which \
             a scattering file does not change, got {:?}",
            film.table,
            film.name()
        );
    }
    Ok(StackSurface::new(film_table::alone(design, low)?, scene::settings(design, paths, seed))?)
}
