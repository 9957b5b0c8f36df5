// SPDX-License-Identifier: MIT OR Apache-2.0
//! Luminescence: substances of a medium that absorb light at one wavelength and emit it at others.
//!
//! A photon of wavelength λ that a [`Luminophore`] absorbs is emitted anew with the probability of
//! its quantum yield Y, in any direction, unpolarised, at a wavelength λ' that the emission
//! spectrum draws. The expected power of that is the share Y λ/λ' of the power absorbed: 1 - Y of it
//! is lost with photons that are not emitted, Y (1 - λ/λ') is Stokes' loss.
//!
//! \[Woodcock et al. 1965\] E. R. Woodcock, T. Murphy, P. J. Hemmings, T. C. Longworth, *Techniques used
//! in the GEM code for Monte Carlo neutronics calculations in reactors and other systems of complex
//! geometry*, ANL-7050, Argonne National Laboratory.

use std::sync::Arc;

use rand::Rng;

use super::phase::Scattering;
use crate::error::{Error, check, fraction};
use crate::pattern::Pattern;
use crate::random;
use crate::ray::Ray;

/// A luminescent substance of a medium, at one wavelength of several.
#[derive(Debug, Clone, PartialEq)]
pub struct Luminophore {
    /// Name under which the ledger lists its losses.
    pub name: String,
    /// Absorption coefficient, 1/mm.
    pub absorption_per_mm: f64,
    /// Photons emitted for each that is absorbed, 0 to 1.
    pub quantum_yield: f64,
    /// Sums of the shares of the photons that are emitted at each of the wavelengths of a run, the
    /// last of them 1.
    cumulated: Vec<f64>,
}

impl Luminophore {
    /// A substance that emits photons in proportion to `shares`, one for each wavelength of a run.
    ///
    /// # Errors
    /// Numbers outside of their ranges, and shares without a positive sum.
    pub fn new(
        name: impl Into<String>,
        absorption_per_mm: f64,
        quantum_yield: f64,
        shares: &[f64],
    ) -> Result<Self, Error> {
        let name = name.into();
        let number = "a finite number, 0 or more";
        let of = |what: &str| format!("{what} of '{name}'");
        check(&of("absorption per mm"), absorption_per_mm, number, absorption_per_mm >= 0.0)?;
        fraction(&of("quantum yield"), quantum_yield)?;
        for share in shares {
            check(&of("share of the emission"), *share, number, *share >= 0.0)?;
        }
        let whole: f64 = shares.iter().sum();
        check(&of("sum of the emission"), whole, "a finite number above 0", whole > 0.0)?;
        let mut sum = 0.0;
        let add = |share: &f64| {
            sum += share / whole;
            sum
        };
        Ok(Self {
            cumulated: shares.iter().map(add).collect(),
            name,
            absorption_per_mm,
            quantum_yield,
        })
    }

    /// Number of the wavelength of an emitted photon.
    pub(crate) fn emit(&self, rng: &mut impl Rng) -> usize {
        // Rounding may leave the last sum below 1.
        let last = self.cumulated.len() - 1;
        let end = self.cumulated[last];
        let pick = random::unit(rng) * end;
        self.cumulated.partition_point(|sum| *sum <= pick).min(last)
    }

    /// Expected power at the wavelength of this number for each power absorbed, at `shift` times the
    /// photons' energy.
    pub(crate) fn yields(&self, number: usize, shift: f64) -> f64 {
        let below = number.checked_sub(1).map_or(0.0, |below| self.cumulated[below]);
        self.quantum_yield * (self.cumulated[number] - below) * shift
    }

    pub(crate) fn wavelengths(&self) -> usize {
        self.cumulated.len()
    }
}

/// Event that ends a flight in a medium.
pub(crate) enum Collision<'a> {
    /// The light is scattered.
    Scatters(&'a Scattering),
    /// The luminophore with this line in the ledger absorbs it.
    Excites(&'a Luminophore, usize),
}

/// All that may happen to light on its way through a medium, beside absorption by the medium
/// itself.
#[derive(Debug, Clone)]
pub(crate) struct Collisions {
    /// Reciprocal of the mean free path, 1/mm, where the density is largest.
    per_mm: f64,
    scattering: Option<Scattering>,
    /// With their lines in the ledger.
    luminophores: Vec<(Luminophore, usize)>,
    /// That of the medium.
    density: Option<Arc<Pattern>>,
}

impl Collisions {
    /// `None` where nothing happens.
    pub fn new(
        scattering: Option<&Scattering>,
        luminophores: Vec<(Luminophore, usize)>,
        density: Option<Arc<Pattern>>,
    ) -> Option<Self> {
        let absorption: f64 = luminophores.iter().map(|(one, _)| one.absorption_per_mm).sum();
        let per_mm = scattering.map_or(0.0, |scattering| scattering.per_mm) + absorption;
        let scattering = scattering.cloned();
        (per_mm > 0.0).then(|| Self { per_mm, scattering, luminophores, density })
    }

    /// True if the medium scatters light.
    pub fn scatter(&self) -> bool {
        self.scattering.is_some()
    }

    /// Luminophores with their lines in the ledger.
    pub fn luminophores(&self) -> &[(Luminophore, usize)] {
        &self.luminophores
    }

    /// Draws the length of a flight along `ray`, mm; of one beyond `length` no more than that.
    #[inline]
    pub fn free_path(&self, ray: &Ray, length: f64, rng: &mut impl Rng) -> f64 {
        // 1 - u is never 0.
        let first = -(1.0 - random::unit(rng)).ln() / self.per_mm;
        match &self.density {
            None => first,
            Some(density) => self.to_particle(density, (ray, length), first, rng),
        }
    }

    /// Goes on from collisions that met no particle: at a place of density d, the share 1 - d of those
    /// that the largest density has \[Woodcock et al. 1965\]. What is left is exponential in the depth.
    fn to_particle(
        &self,
        density: &Pattern,
        (ray, length): (&Ray, f64),
        first: f64,
        rng: &mut impl Rng,
    ) -> f64 {
        let mut free = first;
        while free < length {
            let at = ray.at(free);
            if density.covers([at.x, at.y], rng) {
                break;
            }
            free -= (1.0 - random::unit(rng)).ln() / self.per_mm;
        }
        free
    }

    /// Draws the event that ends a flight.
    #[inline]
    pub fn event(&self, rng: &mut impl Rng) -> Collision<'_> {
        match (&self.scattering, &self.luminophores[..]) {
            (Some(scattering), []) => Collision::Scatters(scattering),
            _ => self.one_of_many(rng),
        }
    }

    fn one_of_many(&self, rng: &mut impl Rng) -> Collision<'_> {
        let mut pick = random::unit(rng) * self.per_mm;
        for (luminophore, line) in &self.luminophores {
            pick -= luminophore.absorption_per_mm;
            if pick < 0.0 {
                return Collision::Excites(luminophore, *line);
            }
        }
        match (&self.scattering, self.luminophores.last()) {
            (Some(scattering), _) => Collision::Scatters(scattering),
            // Rounding: the sum of the coefficients was not reached.
            (None, Some((last, line))) => Collision::Excites(last, *line),
            (None, None) => unreachable!("a collision needs a cause"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::phase::PhaseFunction;
    use crate::pattern::Marks;
    use glam::DVec3;

    /// Of light along x through cells of the densities d, exp(-Σ s d l) meets no particle.
    #[test]
    fn flights_through_cells_end_by_their_depth() {
        let shares = vec![1.0, 0.2, 0.0, 0.6];
        let pattern = Pattern::new([0.5, 4.0], 4, Marks::Shares(shares)).expect("a pattern");
        let scattering = Scattering { per_mm: 1.5, phase: PhaseFunction::ISOTROPIC };
        let of =
            |density| Collisions::new(Some(&scattering), Vec::new(), density).expect("a cause");
        let (patterned, plain) = (of(Some(Arc::new(pattern))), of(None));
        let ray = Ray { origin: DVec3::new(-1.0, 0.3, 0.0), direction: DVec3::X };
        let mut rng = random::stream(5, 0);
        let mut passing = |collisions: &Collisions, length: f64| {
            let count = 200_000;
            let free =
                (0..count).filter(|_| collisions.free_path(&ray, length, &mut rng) >= length);
            free.count() as f64 / f64::from(count)
        };
        let is_of = |share: f64, depth: f64| {
            let error = ((-depth).exp() * (1.0 - (-depth).exp()) / 200_000.0).sqrt();
            assert!((share - (-depth).exp()).abs() < 4.5 * error, "{depth}: {share}");
        };
        for (length, cells) in [(0.25, 0.25), (1.0, 0.6), (1.5, 0.6), (2.0, 0.9)] {
            is_of(passing(&patterned, length), 1.5 * cells);
            // The control.
            is_of(passing(&plain, length), 1.5 * length);
        }
    }
}
