// SPDX-License-Identifier: MIT OR Apache-2.0
//! The trait [`Bsdf`]: what a ray tracer asks of a surface.
//!
//! `wi` is the unit vector towards the light's origin and `wo` the one towards its destination,
//! both in the local frame of the surface (z is the outward normal; `wi.z < 0` is light from the
//! inner side). Rays carry power, so refraction brings no factor n². Diffraction orders are
//! discrete: their power belongs to a direction, not to a solid angle, and their [`Lobe`] says so.
//! Sampling is for unpolarised light, the mean of s and p; lists of lobes keep s and p apart.

use crate::direction::Side;
use glam::DVec3;
use std::any::Any;

/// Largest power of one incidence above 1 that is taken for an error of measurement. Such a sum is
/// scaled down to 1 where it is sampled.
pub const GAIN_TOLERANCE: f64 = 0.1;

/// Polarisation of the incident light.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Polarisation {
    /// E perpendicular to the plane of incidence.
    S,
    /// E in the plane of incidence.
    P,
    /// Equal powers of both, incoherent.
    Unpolarised,
}

/// Reflection or transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Transport {
    /// Back into the side it came from.
    Reflection,
    /// Into the other side.
    Transmission,
}

impl Transport {
    /// Reflection, then transmission: the order in which arrays store them.
    pub const BOTH: [Self; 2] = [Self::Reflection, Self::Transmission];

    /// Index into arrays with one value for each: 0 reflection, 1 transmission.
    pub const fn index(self) -> usize {
        match self {
            Self::Reflection => 0,
            Self::Transmission => 1,
        }
    }

    /// The side on which light from the side `from` leaves.
    pub const fn exit_side(self, from: Side) -> Side {
        match self {
            Self::Reflection => from,
            Self::Transmission => from.opposite(),
        }
    }

    /// Transport from the side `from` to the side `to`.
    pub fn between(from: Side, to: Side) -> Self {
        if from == to { Self::Reflection } else { Self::Transmission }
    }
}

/// Kind of the lobe that a direction belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LobeKind {
    /// One direction, by the law of reflection or refraction of the surface itself.
    Specular,
    /// One direction: diffraction order l, with kx + l λ/Λ.
    Order(i32),
    /// One direction, reached by ray optics through the facets of a unit cell.
    Facets,
    /// Cosine (Lambertian) distribution about the normal of the side it leaves on.
    Diffuse,
    /// Gaussian distribution of intensity over the angle to its direction.
    Gaussian,
    /// Binned over one cell of direction of a table; its direction is the middle of the cell.
    Cell,
}

/// The lobe that an outgoing direction belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lobe {
    /// Reflected or transmitted.
    pub transport: Transport,
    /// Kind.
    pub kind: LobeKind,
}

/// One sampled outgoing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit vector towards the light's destination, local frame, away from the surface.
    pub wo: DVec3,
    /// Factor on the ray's power, 0 < weight ≤ 1; the rest to 1 is absorbed.
    pub weight: f64,
    /// The lobe it belongs to.
    pub lobe: Lobe,
}

/// One outgoing lobe with its power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutgoingLobe {
    /// Direction (unit, local frame); for a diffuse lobe, the normal of the side it leaves on.
    pub wo: DVec3,
    /// Power in the lobe per incident power, 0 to 1.
    pub power: f64,
    /// Identity of the lobe.
    pub lobe: Lobe,
}

/// Power that leaves a surface per incident power; the rest to 1 is absorbed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Albedo {
    /// Reflected power, 0 to 1.
    pub reflected: f64,
    /// Transmitted power, 0 to 1.
    pub transmitted: f64,
}

impl Albedo {
    /// Reflected and transmitted power.
    pub fn total(self) -> f64 {
        self.reflected + self.transmitted
    }
}

/// A surface with a known effect on polarisation.
///
/// Light is described by Q/I, U/I and V/I, with Q = |E_s|² - |E_p|², U = 2 Re E_s E_p*,
/// V = -2 Im E_s E_p*. s lies along [`s_axis`] of the direction, in either sense, and p = s × k/|k|
/// for light that travels along k.
pub trait PolarisedBsdf: Send + Sync {
    /// Samples an outgoing direction for `light` from `wi`, and returns the light that leaves along
    /// it. `None` means that the ray is absorbed.
    fn sample_polarised(
        &self,
        wi: DVec3,
        light: [f64; 3],
        rng: &mut dyn rand::Rng,
    ) -> Option<(BsdfSample, [f64; 3])>;
}

/// Axis of s = z × k∥/|k∥|, up to its sign, for light along the unit vector `direction` of the
/// local frame; y for light along the normal.
pub fn s_axis(direction: DVec3) -> DVec3 {
    let across = DVec3::new(-direction.y, direction.x, 0.0);
    across.try_normalize().unwrap_or(DVec3::Y)
}

/// A surface that scatters light: bidirectional scattering distribution function.
pub trait Bsdf: Any + Send + Sync {
    /// Samples an outgoing direction for unpolarised light from `wi`; `None` means absorption.
    ///
    /// The expected weight that falls into a lobe is the lobe's power in [`Bsdf::lobes`] for
    /// [`Polarisation::Unpolarised`].
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample>;

    /// Probability with which [`Bsdf::sample`] returns the direction of `sample` at `wi`: a
    /// probability for a discrete lobe (weight · pdf = power), a density in 1/sr for others. `None`
    /// where it is unknown: rays traced through a unit cell.
    ///
    /// It is no part of the sample, because a tracer needs the weight alone and a table would spend
    /// as much time on the pdf as on the sample.
    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64>;

    /// All outgoing lobes for light from `wi`. Their powers sum to at most 1, up to rounding.
    fn lobes(&self, wi: DVec3, polarisation: Polarisation) -> Vec<OutgoingLobe>;

    /// Refractive index of the medium that the BSDF assumes on `side`.
    fn index(&self, side: Side) -> f64;

    /// True if light on the reversed path has the same share: with f the BSDF, f(wi, wo)/n² of the medium
    /// of wo is that of f(wo, wi).
    fn is_reciprocal(&self) -> bool {
        false
    }

    /// The same surface for polarised light, if its effect on polarisation is known.
    fn as_polarised(&self) -> Option<&dyn PolarisedBsdf> {
        None
    }

    /// Reflected and transmitted power, summed over the lobes.
    fn albedo(&self, wi: DVec3, polarisation: Polarisation) -> Albedo {
        let mut albedo = Albedo::default();
        for lobe in self.lobes(wi, polarisation) {
            match lobe.lobe.transport {
                Transport::Reflection => albedo.reflected += lobe.power,
                Transport::Transmission => albedo.transmitted += lobe.power,
            }
        }
        albedo
    }
}
