// SPDX-License-Identifier: MIT OR Apache-2.0
//! Phase functions: the distribution of the angle θ by which a medium scatters, uniform in
//! azimuth.
//!
//! Henyey and Greenstein's is p(cos θ) = (1 - g²)/(2 (1 + g² - 2 g cos θ)^(3/2)), of mean cosine g
//! and second moment ⟨P₂(cos θ)⟩ = g² \[Henyey, Greenstein 1941\]. With s uniform on [-1, 1) its
//! inverse is
//!
//! cos θ = (s + g (3 + s²)/2 + g² s - g³ (1 - s²)/2)/(1 + g s)²,
//!
//! the usual formula multiplied out, so that nothing is divided by g.
//!
//! \[Henyey, Greenstein 1941\] L. G. Henyey, J. L. Greenstein, *Diffuse radiation in the galaxy*,
//! Astrophys. J. 93, 70.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use glam::DVec3;
use rand::Rng;

use super::mie::{Mie, Sphere};
use crate::error::{Error, check};
use crate::random;
use crate::ray::unit;

/// Distribution of the scattering angle.
#[derive(Debug, Clone, PartialEq)]
pub enum PhaseFunction {
    /// Henyey-Greenstein's function of this mean cosine g, from -1 to 1.
    HenyeyGreenstein(f64),
    /// A table.
    Table(Arc<PhaseTable>),
    /// That of a sphere in unpolarised light.
    Sphere(Arc<SpherePhase>),
}

/// The phase function of a sphere, whose table is made when it is first asked for: of large spheres
/// it takes milliseconds, and spectra have a thousand wavelengths of which a trace meets few.
#[derive(Debug)]
pub struct SpherePhase {
    mie: Mie,
    table: OnceLock<PhaseTable>,
}

impl PartialEq for SpherePhase {
    fn eq(&self, other: &Self) -> bool {
        self.mie == other.mie
    }
}

/// Phase functions in use by the bits of size parameter and relative index: designs that differ in
/// something else share them.
static IN_USE: Mutex<Option<HashMap<[u64; 2], Weak<SpherePhase>>>> = Mutex::new(None);

impl SpherePhase {
    /// Of a series.
    fn of(mie: Mie) -> Arc<Self> {
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        let in_use = in_use.get_or_insert_default();
        let key = mie.key();
        if let Some(known) = in_use.get(&key).and_then(Weak::upgrade) {
            return known;
        }
        let made = Arc::new(Self { mie, table: OnceLock::new() });
        in_use.retain(|_, phase| phase.strong_count() > 0);
        in_use.insert(key, Arc::downgrade(&made));
        made
    }

    fn table(&self) -> &PhaseTable {
        // A sphere too small for its intensity to be a number scatters nothing.
        self.table.get_or_init(|| {
            PhaseTable::of_sphere(&self.mie).unwrap_or_else(|_| PhaseTable::isotropic())
        })
    }
}

impl PhaseFunction {
    /// All directions alike.
    pub const ISOTROPIC: Self = Self::HenyeyGreenstein(0.0);

    /// Mean of cos θ.
    pub fn mean_cosine(&self) -> f64 {
        match self {
            Self::HenyeyGreenstein(g) => *g,
            Self::Table(table) => table.mean_cosine(),
            Self::Sphere(sphere) => sphere.mie.mean_cosine(),
        }
    }

    /// Draws cos θ.
    #[inline]
    pub fn sample_cosine(&self, rng: &mut impl Rng) -> f64 {
        let chance = random::unit(rng);
        match self {
            Self::HenyeyGreenstein(g) => henyey_greenstein(*g, 2.0 * chance - 1.0),
            Self::Table(table) => table.cosine(chance),
            Self::Sphere(sphere) => sphere.table().cosine(chance),
        }
    }

    /// Draws the direction of light that came along `direction`, both unit vectors.
    #[inline]
    pub(crate) fn sample(&self, direction: DVec3, rng: &mut impl Rng) -> DVec3 {
        let cosine = self.sample_cosine(rng);
        // The azimuth of a point of the unit disc: no sine.
        let (mut x, mut y) = random::disc(rng, 1.0);
        let s = x * x + y * y;
        if s == 0.0 {
            (x, y) = (1.0, 0.0);
        }
        let aside = ((1.0 - cosine * cosine) / if s == 0.0 { 1.0 } else { s }).max(0.0).sqrt();
        let (u, v) = direction.any_orthonormal_pair();
        unit(direction * cosine + u * (x * aside) + v * (y * aside))
    }

    pub(crate) fn validate(&self, medium: &str) -> Result<(), Error> {
        match self {
            Self::HenyeyGreenstein(g) => check(
                &format!("g of '{medium}'"),
                *g,
                "a number from -1 to 1",
                (-1.0..=1.0).contains(g),
            )
            .map(drop),
            Self::Table(_) | Self::Sphere(_) => Ok(()),
        }
    }
}

/// The cosine below which Henyey-Greenstein's function holds the share (1 + `s`)/2.
#[inline]
fn henyey_greenstein(g: f64, s: f64) -> f64 {
    let below = 1.0 + g * s;
    if below <= 0.0 {
        // Of the light that |g| = 1 sends straight on or back.
        return g;
    }
    let s2 = s * s;
    let above = s + g * (0.5 * (3.0 + s2) + g * (s - 0.5 * g * (1.0 - s2)));
    (above / (below * below)).clamp(-1.0, 1.0)
}

/// A phase function by its values at some angles, linear in cos θ between them.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseTable {
    /// Cosines, ascending from -1 to 1.
    cosines: Vec<f64>,
    /// Values there, such that the integral over cos θ is 1.
    values: Vec<f64>,
    /// Share of the light below each cosine.
    below: Vec<f64>,
}

/// Highest value of a table; sums of it stay far from overflow.
const HIGHEST: f64 = 1e100;

/// Steps of the table of a sphere for each wave around it, and the fewest.
const STEPS_PER_SIZE: f64 = 32.0;
const MIN_STEPS: f64 = 720.0;

impl PhaseTable {
    /// Values in any unit per steradian at angles in degrees, which ascend from 0 to 180.
    ///
    /// # Errors
    /// Angles of another kind, values that are negative or all 0.
    pub fn new(angles_deg: &[f64], values: &[f64]) -> Result<Self, Error> {
        if angles_deg.len() < 2 {
            let (what, got) = ("angles of a phase function", angles_deg.len());
            return Err(Error::TooFew { what, expected: 2, got });
        }
        check(
            "number of values of a phase function",
            values.len() as f64,
            "one for each angle",
            values.len() == angles_deg.len(),
        )?;
        let last = angles_deg.len() - 1;
        for (k, angle) in angles_deg.iter().enumerate() {
            let fits = match k {
                0 => *angle == 0.0,
                _ => *angle > angles_deg[k - 1] && *angle <= 180.0 && (k < last || *angle >= 180.0),
            };
            let expected = "angles that ascend from 0 to 180";
            check("angle of a phase function, degrees", *angle, expected, fits)?;
        }
        for value in values {
            let range = 0.0..=HIGHEST;
            check("value of a phase function", *value, "0 to 1e100", range.contains(value))?;
        }
        Self::of_cosines(angles_deg.iter().map(|angle| angle.to_radians().cos()), values)
    }

    /// All directions alike.
    fn isotropic() -> Self {
        Self { cosines: vec![-1.0, 1.0], values: vec![0.5; 2], below: vec![0.0, 1.0] }
    }

    /// The phase function of a sphere in unpolarised light.
    pub(crate) fn of_sphere(mie: &Mie) -> Result<Self, Error> {
        let steps = (STEPS_PER_SIZE * mie.size()).max(MIN_STEPS).ceil();
        let cosine = |k: f64| (std::f64::consts::PI * k / steps).cos();
        let cosines: Vec<f64> = (0..=steps as usize).map(|k| cosine(k as f64)).collect();
        let values: Vec<f64> = cosines.iter().map(|cosine| mie.intensity(*cosine)).collect();
        Self::of_cosines(cosines.into_iter(), &values)
    }

    /// Values at descending cosines.
    fn of_cosines(
        cosines: impl DoubleEndedIterator<Item = f64>,
        values: &[f64],
    ) -> Result<Self, Error> {
        let cosines: Vec<f64> = cosines.rev().collect();
        let mut values: Vec<f64> = values.iter().rev().copied().collect();
        let (mut sum, mut below) = (0.0, vec![0.0]);
        for k in 1..cosines.len() {
            sum += 0.5 * (values[k - 1] + values[k]) * (cosines[k] - cosines[k - 1]);
            below.push(sum);
        }
        check("integral of a phase function", sum, "a finite number above 0", sum > 0.0)?;
        values.iter_mut().chain(&mut below).for_each(|value| *value /= sum);
        Ok(Self { cosines, values, below })
    }

    /// The cosine below which the share `chance` of the light lies.
    #[inline]
    fn cosine(&self, chance: f64) -> f64 {
        let last = self.below.len() - 1;
        let k = self.below.partition_point(|below| *below <= chance).clamp(1, last);
        let (from, to) = (self.below[k - 1], self.below[k]);
        let (p, q) = (self.values[k - 1], self.values[k]);
        // p t + (q - p) t²/2 = v (p + q)/2, with t and v from 0 to 1.
        let v = ((chance - from) / (to - from)).clamp(0.0, 1.0);
        let root = (p * p + v * (q * q - p * p)).max(0.0).sqrt();
        let t = if p + root > 0.0 { v * (p + q) / (p + root) } else { v };
        self.cosines[k - 1] + t.min(1.0) * (self.cosines[k] - self.cosines[k - 1])
    }

    /// Mean of cos θ, exact.
    pub fn mean_cosine(&self) -> f64 {
        let pieces = self.cosines.windows(2).zip(self.values.windows(2));
        let mean = |(c, p): (&[f64], &[f64])| {
            let step = c[1] - c[0];
            step * (c[0] * (p[0] + p[1]) / 2.0 + step * (p[0] + 2.0 * p[1]) / 6.0)
        };
        pieces.map(mean).sum()
    }
}

/// Scattering of a medium at one wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Scattering {
    /// Scattering coefficient in 1/mm: the reciprocal of the mean free path.
    pub per_mm: f64,
    /// Distribution of the scattering angle.
    pub phase: PhaseFunction,
}

impl Scattering {
    /// Spheres that fill the share `volume_fraction` of a medium of index `index`, which scatter
    /// independently: 3 f Q_sca/(2 d) by Mie's theory.
    ///
    /// # Errors
    /// A size parameter beyond the range of [`Mie`], or indices that are no positive numbers.
    pub fn of_spheres(
        sphere: &Sphere,
        volume_fraction: f64,
        index: f64,
        wavelength_nm: f64,
    ) -> Result<Self, Error> {
        crate::error::fraction("volume fraction of spheres", volume_fraction)?;
        let mie = Mie::new(sphere, index, wavelength_nm)?;
        let diameter_mm = 1e-3 * sphere.diameter_um;
        Ok(Self {
            per_mm: 1.5 * volume_fraction * mie.scattering_efficiency() / diameter_mm,
            phase: PhaseFunction::Sphere(SpherePhase::of(mie)),
        })
    }

    pub(crate) fn validate(&self, medium: &str) -> Result<(), Error> {
        check(
            &format!("scattering of '{medium}' per mm"),
            self.per_mm,
            "a finite number, 0 or more",
            self.per_mm >= 0.0,
        )?;
        self.phase.validate(medium)
    }
}
