// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a ray tracer sees of a surface: draw an outgoing direction, list the outgoing lobes, give the albedo.
//!
//! In: `wi`, the unit vector towards where light came from, in the local frame of the surface (z is the outward
//! normal; `wi.z < 0` is light from the inner side). Out: `wo`, unit vectors towards where it goes, with the shares of the
//! incident *power* they carry. Rays carry power, so refraction brings no factor n². Diffraction orders are
//! discrete: a share belongs to a direction, not to a solid angle, and is marked so by its [`Lobe`].
//! Sampling is for unpolarised light (the mean of the shares of s and p); lists of lobes keep s and p apart.

use crate::direction::Side;
use glam::DVec3;
use std::any::Any;

/// Polarisation of the incident light: s is perpendicular to the plane of incidence, p lies in it.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Polarization {
    /// E perpendicular to the plane of incidence.
    S,
    /// E in the plane of incidence.
    P,
    /// Equal parts of both, without phase relation.
    Unpolarized,
}

/// Whether light leaves on the side it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Transport {
    /// Back into the side it came from.
    Reflection,
    /// Into the other side.
    Transmission,
}

impl Transport {
    /// Transport from the side `from` to the side `to`.
    #[must_use]
    pub fn between(from: Side, to: Side) -> Self {
        if from == to {
            Self::Reflection
        } else {
            Self::Transmission
        }
    }
}

/// What kind of lobe a direction belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LobeKind {
    /// One direction, by the law of reflection or refraction of the surface itself.
    Specular,
    /// One direction: the diffraction order with `kx + l · wavelength/period`, l the relative order.
    Order(i32),
    /// One direction, reached through the facets of a unit cell by ray optics.
    Facets,
    /// Cosine (Lambertian) distribution about the normal of the side it leaves on.
    Diffuse,
    /// Binned over one cell of direction of a table; its direction is the middle of the cell.
    Cell,
}

impl LobeKind {
    /// Whether all of the lobe's power goes into one direction.
    #[must_use]
    pub fn is_discrete(self) -> bool {
        !matches!(self, Self::Diffuse | Self::Cell)
    }
}

/// The lobe of an outgoing direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lobe {
    /// Reflected or transmitted.
    pub transport: Transport,
    /// Discrete or diffuse, and which.
    pub kind: LobeKind,
}

/// One drawn outgoing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit vector towards where light goes, local frame, away from the surface.
    pub wo: DVec3,
    /// Factor on the ray's power, 0 < weight ≤ 1; 1 for a lossless surface. What is missing to 1 was absorbed.
    pub weight: f64,
    /// The lobe it belongs to.
    pub lobe: Lobe,
}

/// One outgoing lobe with its share of the incident power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutgoingLobe {
    /// Its direction (unit, local frame); for a diffuse lobe the normal of the side it leaves on.
    pub wo: DVec3,
    /// Power in the lobe per incident power, 0 to 1.
    pub power: f64,
    /// Which lobe this is.
    pub lobe: Lobe,
}

/// Shares of the incident power that leave a surface; what is missing to 1 is absorbed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Albedo {
    /// Share that goes back to the side it came from, 0 to 1.
    pub reflected: f64,
    /// Share that goes on to the other side, 0 to 1.
    pub transmitted: f64,
}

impl Albedo {
    /// Share that leaves at all.
    #[must_use]
    pub fn total(self) -> f64 {
        self.reflected + self.transmitted
    }
}

/// A surface that knows what it does to polarisation.
///
/// Light is Q/I, U/I and V/I with Q = |E_s|² - |E_p|², U = 2 Re E_s E_p*, V = -2 Im E_s E_p*, where s lies along [`s_axis`] of the direction, in either sense,
/// and p = s × k/|k| for light that travels along k.
pub trait PolarizedBsdf: Send + Sync {
    /// Draws an outgoing direction for `light` coming from `wi`, with the light that leaves along it. `None` means that the ray was absorbed.
    fn sample_polarized(
        &self,
        wi: DVec3,
        light: [f64; 3],
        rng: &mut dyn rand::Rng,
    ) -> Option<(BsdfSample, [f64; 3])>;
}

/// Direction, or its opposite, of s = z × k∥/|k∥| for light along the unit vector `direction` of the local frame, either way; y along the normal.
#[must_use]
pub fn s_axis(direction: DVec3) -> DVec3 {
    let across = DVec3::new(-direction.y, direction.x, 0.0);
    across.try_normalize().unwrap_or(DVec3::Y)
}

/// A surface that scatters rays: a Lambertian paint, a smooth interface and a table of diffraction orders
/// are the same to a ray tracer.
pub trait Bsdf: Any + Send + Sync {
    /// Draws an outgoing direction for unpolarised light coming from `wi`.
    ///
    /// `None` means that the ray was absorbed. Averaged over draws, the weights that fall into a lobe give its share in
    /// [`Bsdf::lobes`] for [`Polarization::Unpolarized`].
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample>;

    /// With what probability [`Bsdf::sample`] draws the direction of `sample` at `wi`: a probability for a discrete lobe
    /// (weight · pdf = share), a density in 1/sr for a diffuse one. `None` where it is not known without drawing: rays
    /// followed through a unit cell. Apart from the sample because a tracer needs only the weight, and a table would look it
    /// up at twice the cost of the draw.
    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64>;

    /// All outgoing lobes for light from `wi`, with their shares. Their sum is at most 1, to rounding.
    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe>;

    /// Refractive index of the medium that the surface assumes on `side`.
    fn index(&self, side: Side) -> f64;

    /// The same surface for light of a known polarisation, if it knows what becomes of it.
    fn as_polarized(&self) -> Option<&dyn PolarizedBsdf> {
        None
    }

    /// Shares reflected and transmitted, summed over the lobes.
    fn albedo(&self, wi: DVec3, polarization: Polarization) -> Albedo {
        let mut albedo = Albedo::default();
        for lobe in self.lobes(wi, polarization) {
            match lobe.lobe.transport {
                Transport::Reflection => albedo.reflected += lobe.power,
                Transport::Transmission => albedo.transmitted += lobe.power,
            }
        }
        albedo
    }
}
