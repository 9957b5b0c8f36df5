// SPDX-License-Identifier: MIT OR Apache-2.0
//! Diffusers by formula: stated shares of the light are transmitted and reflected, by the cosine
//! law or in a Gaussian lobe.
//!
//! The shares hold at every incidence, from either side; what they leave of 1 is absorbed. With σ
//! the standard deviation and α the angle to the axis of a lobe, its intensity is
//!
//! I(α) = exp(-α²/(2σ²))/N above the surface, 0 below it,
//!
//! and N the integral of the exponential over the hemisphere, which makes the power of the lobe its
//! share. The full width at half maximum is 2σ√(2 ln 2). The axis of what is reflected is the
//! mirrored direction, that of what is transmitted the refracted one.
//!
//! Sampling draws α of the density exp(-(1 - cos α)/σ²) by inversion [Jakob 2012], which bounds the
//! Gaussian from above, as α²/2 ≥ 1 - cos α. A draw stays with the ratio of both, and where it lies
//! above the surface. As half of the sphere about an axis above the surface lies above it too, two
//! draws of five stay at least, for any width and incidence.
//!
//! Reflection by the cosine law is reciprocal, and so is transmission by it between media of one
//! index. A Gaussian lobe is not: its intensity depends on α alone, and light on the reversed path
//! meets another cosine and another N.
//!
//! \[Jakob 2012\] W. Jakob, *Numerically stable sampling of the von Mises-Fisher distribution on S²
//! (and other tricks)*, Cornell University.
//!
//! \[Takahasi 1974\] H. Takahasi, M. Mori, *Double exponential formulas for numerical integration*,
//! Publ. RIMS 9, 721.

use std::f64::consts::{FRAC_PI_2, LN_2, PI, TAU};

use glam::DVec3;
use rand::RngExt;

use super::{SmoothInterface, mirrored, sample_cosine_hemisphere};
use crate::bsdf::{Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation, Transport};
use crate::direction::Side;
use crate::error::Error;

/// Draws of a Gaussian lobe at most; each fails with a probability below 0.6.
const MAX_DRAWS: usize = 128;
/// Rounding of a sum of shares.
const ROUNDING: f64 = 1e-12;
/// Standard deviations beyond which a Gaussian is below rounding.
const TAIL: f64 = 9.0;

/// Distribution of the directions of scattered light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DiffuseLaw {
    /// Intensity ∝ the cosine to the normal, whatever the incidence.
    Lambertian,
    /// Gaussian intensity about the direction of a smooth surface.
    Gaussian(GaussianLobe),
}

/// A Gaussian of intensity over the angle to an axis, cut off at the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianLobe {
    /// σ², rad².
    variance: f64,
    /// exp(-2/σ²) - 1: minus the probability of all angles to 180°.
    below_zero: f64,
}

impl GaussianLobe {
    /// Widths that are accepted, degrees.
    pub const WIDTHS_DEG: [f64; 2] = [0.001, 180.0];

    /// A lobe of the full width at half maximum `width_deg`, in degrees.
    ///
    /// # Errors
    /// A width outside [`GaussianLobe::WIDTHS_DEG`].
    pub fn new(width_deg: f64) -> Result<Self, Error> {
        let [min, max] = Self::WIDTHS_DEG;
        if !(min..=max).contains(&width_deg) {
            return Err(Error::Width { min, max, value: width_deg });
        }
        Ok(Self::of_width(width_deg))
    }

    fn of_width(width_deg: f64) -> Self {
        let sigma = 0.5 * width_deg.to_radians() / (2.0 * LN_2).sqrt();
        Self::of_variance(sigma * sigma)
    }

    fn of_variance(variance: f64) -> Self {
        Self { variance, below_zero: (-2.0 / variance).exp_m1() }
    }

    /// Standard deviation σ, radians.
    pub fn standard_deviation(self) -> f64 {
        self.variance.sqrt()
    }

    /// The lobe with this factor on its width.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self::of_variance(self.variance * factor * factor)
    }

    /// Share of its power, about the normal, beyond an angle in degrees.
    pub fn share_beyond(self, angle_deg: f64) -> f64 {
        let end = (TAIL * self.standard_deviation()).min(FRAC_PI_2);
        let beyond = double_exponential(angle_deg.to_radians(), end, |alpha| self.circle(alpha));
        (beyond / self.integral(1.0)).min(1.0)
    }

    /// The lobe that has this share of its power beyond an angle in degrees; the widest one, if even
    /// that has less.
    pub fn with_share_beyond(angle_deg: f64, share: f64) -> Self {
        let [min, max] = Self::WIDTHS_DEG.map(Self::of_width);
        // The share grows with the width; sixty halvings are below rounding.
        let (mut low, mut factor) = (min, (max.variance / min.variance).sqrt());
        for _ in 0..60 {
            factor = factor.sqrt();
            if low.scaled(factor).share_beyond(angle_deg) < share {
                low = low.scaled(factor);
            }
        }
        low
    }

    /// Draws a direction above the surface on `side` about `axis`, a unit vector that does not
    /// point below it.
    pub(super) fn sample(self, axis: DVec3, side: Side, rng: &mut dyn rand::Rng) -> DVec3 {
        let (u, v) = axis.any_orthonormal_pair();
        for _ in 0..MAX_DRAWS {
            // 1 - cos α is exponential with mean σ², cut off at 2.
            let rise = -self.variance * (rng.random::<f64>() * self.below_zero).ln_1p();
            let rise = rise.clamp(0.0, 2.0);
            let half = (0.5 * rise).sqrt().asin();
            let stays = ((rise - 2.0 * half * half) / self.variance).exp();
            let phi = TAU * rng.random::<f64>();
            let (sin_phi, cos_phi) = phi.sin_cos();
            let across = (rise * (2.0 - rise)).sqrt();
            let wo = axis * (1.0 - rise) + (u * cos_phi + v * sin_phi) * across;
            if rng.random::<f64>() < stays && wo.z * side.sign() > 0.0 {
                return wo.normalize();
            }
        }
        // With a probability below 1e-28.
        if axis.z * side.sign() > 0.0 { axis } else { DVec3::Z * side.sign() }
    }

    /// Density of [`GaussianLobe::sample`] in the direction `wo`, 1/sr; 0 below the surface.
    pub(super) fn pdf(self, axis: DVec3, side: Side, wo: DVec3) -> f64 {
        if wo.z * side.sign() <= 0.0 {
            return 0.0;
        }
        let alpha = 2.0 * (wo - axis).length().atan2((wo + axis).length());
        self.gaussian(alpha) / self.integral(axis.z.abs())
    }

    /// exp(-α²/(2σ²)).
    fn gaussian(self, alpha: f64) -> f64 {
        (-0.5 * alpha * alpha / self.variance).exp()
    }

    /// The Gaussian over the circle of all directions at an angle to the axis.
    fn circle(self, alpha: f64) -> f64 {
        TAU * self.gaussian(alpha) * alpha.sin()
    }

    /// N: the integral of the Gaussian over the hemisphere, for an axis of cosine `cos_axis` to the
    /// normal.
    ///
    /// The circle of all directions at α to the axis, at θ to the normal, lies above the surface up
    /// to α = π/2 - θ, and with the part arccos(-cot α cot θ)/π up to π/2 + θ.
    fn integral(self, cos_axis: f64) -> f64 {
        let cos = cos_axis.min(1.0);
        let sin = (1.0 - cos * cos).sqrt();
        let theta = sin.atan2(cos);
        let tail = TAIL * self.standard_deviation();
        let whole = (FRAC_PI_2 - theta).min(tail);
        let cut = (FRAC_PI_2 + theta).min(tail);
        let circle = |alpha: f64| self.circle(alpha);
        let part = |alpha: f64| {
            let edge = -alpha.cos() * cos / (alpha.sin() * sin);
            edge.clamp(-1.0, 1.0).acos() / PI
        };
        let above = double_exponential(0.0, whole, circle);
        above + double_exponential(whole, cut, |alpha| circle(alpha) * part(alpha))
    }
}

/// The integral of `f` from `a` to `b`, whatever its derivatives at the ends [Takahasi 1974].
fn double_exponential(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEP: f64 = 1.0 / 16.0;
    const STEPS: i32 = 54;
    if b - a <= 0.0 {
        return 0.0;
    }
    let half = 0.5 * (b - a);
    let at = |k: i32| {
        let t = STEP * f64::from(k);
        let inner = FRAC_PI_2 * t.sinh();
        // The distance to the nearer end, which does not cancel.
        let near = half * (-inner.abs()).exp() / inner.cosh();
        let weight = FRAC_PI_2 * t.cosh() / inner.cosh().powi(2);
        let x = if k < 0 { a + near } else { b - near };
        weight * f(x)
    };
    half * STEP * (-STEPS..=STEPS).map(at).sum::<f64>()
}

/// Transmitted or reflected light of a diffuser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseLobe {
    /// Share of the incident power, 0 to 1, at every incidence.
    pub share: f64,
    /// Directions.
    pub law: DiffuseLaw,
}

/// A surface that transmits and reflects stated shares of the light by formulas; it absorbs the
/// rest.
///
/// Beyond the critical angle no direction is refracted. What a Gaussian lobe would transmit then is
/// reflected, in a lobe of the same width about the mirrored direction. A Lambertian diffuser has
/// no critical angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuser {
    reflection: DiffuseLobe,
    transmission: DiffuseLobe,
    smooth: SmoothInterface,
}

/// Refuses shares, reflected and transmitted, that are none or more than all.
pub(super) fn check_shares([reflected, transmitted]: [f64; 2]) -> Result<(), Error> {
    Error::check_fraction("reflected share of a diffuser", reflected)?;
    Error::check_fraction("transmitted share of a diffuser", transmitted)?;
    if reflected + transmitted > 1.0 + ROUNDING {
        return Err(Error::Shares { reflected, transmitted });
    }
    Ok(())
}

/// One lobe at one incidence.
struct LobeAtIncidence {
    transport: Transport,
    share: f64,
    law: DiffuseLaw,
    /// Of a Lambertian lobe the normal of the side it leaves on.
    axis: DVec3,
    side: Side,
}

impl LobeAtIncidence {
    fn lobe(&self) -> Lobe {
        Lobe {
            transport: self.transport,
            kind: match self.law {
                DiffuseLaw::Lambertian => LobeKind::Diffuse,
                DiffuseLaw::Gaussian(_) => LobeKind::Gaussian,
            },
        }
    }

    fn sample(&self, rng: &mut dyn rand::Rng) -> DVec3 {
        match self.law {
            DiffuseLaw::Lambertian => {
                sample_cosine_hemisphere(rng) * DVec3::new(1.0, 1.0, self.side.sign())
            }
            DiffuseLaw::Gaussian(lobe) => lobe.sample(self.axis, self.side, rng),
        }
    }

    fn pdf(&self, wo: DVec3) -> f64 {
        match self.law {
            DiffuseLaw::Lambertian => (wo.z * self.side.sign()).max(0.0) / PI,
            DiffuseLaw::Gaussian(lobe) => lobe.pdf(self.axis, self.side, wo),
        }
    }
}

impl Diffuser {
    /// A diffuser between media of the refractive indices `[inner, outer]`.
    ///
    /// # Errors
    /// Shares that are no fractions or add up to more than 1; indices that are not positive.
    pub fn new(
        reflection: DiffuseLobe,
        transmission: DiffuseLobe,
        [inner, outer]: [f64; 2],
    ) -> Result<Self, Error> {
        check_shares([reflection.share, transmission.share])?;
        Ok(Self { reflection, transmission, smooth: SmoothInterface::new(inner, outer)? })
    }

    /// Share of the incident power that is not absorbed.
    fn kept(&self) -> f64 {
        (self.reflection.share + self.transmission.share).min(1.0)
    }

    /// Both lobes for light from `wi`, reflection first.
    fn lobes_at(&self, wi: DVec3) -> [LobeAtIncidence; 2] {
        let from = Side::from_direction(wi);
        let part = |lobe: DiffuseLobe, transport: Transport, smooth: DVec3| {
            let side = transport.exit_side(from);
            LobeAtIncidence {
                transport,
                share: lobe.share,
                law: lobe.law,
                axis: match lobe.law {
                    DiffuseLaw::Lambertian => DVec3::Z * side.sign(),
                    DiffuseLaw::Gaussian(_) => smooth,
                },
                side,
            }
        };
        let mirrored = mirrored(wi);
        let refracted = match (self.smooth.refracted(wi), self.transmission.law) {
            (Some(refracted), _) => (Transport::Transmission, refracted),
            (None, DiffuseLaw::Lambertian) => (Transport::Transmission, mirrored),
            (None, DiffuseLaw::Gaussian(_)) => (Transport::Reflection, mirrored),
        };
        let (transport, axis) = refracted;
        [
            part(self.reflection, Transport::Reflection, mirrored),
            part(self.transmission, transport, axis),
        ]
    }
}

impl Bsdf for Diffuser {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let kept = self.kept();
        if kept <= 0.0 {
            return None;
        }
        let [reflection, transmission] = self.lobes_at(wi);
        let sum = reflection.share + transmission.share;
        let part =
            if rng.random::<f64>() * sum < reflection.share { reflection } else { transmission };
        Some(BsdfSample { wo: part.sample(rng), weight: kept, lobe: part.lobe() })
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        let parts = self.lobes_at(wi);
        let sum: f64 = parts.iter().map(|part| part.share).sum();
        let of_transport =
            parts.iter().filter(|part| part.transport == sample.lobe.transport && part.share > 0.0);
        Some(of_transport.map(|part| part.share / sum * part.pdf(sample.wo)).sum())
    }

    fn lobes(&self, wi: DVec3, _polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let parts = self.lobes_at(wi).into_iter().filter(|part| part.share > 0.0);
        let lobes =
            parts.map(|part| OutgoingLobe { wo: part.axis, power: part.share, lobe: part.lobe() });
        lobes.collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.smooth.index(side)
    }

    fn is_reciprocal(&self) -> bool {
        let is_even = |lobe: &DiffuseLobe| lobe.law == DiffuseLaw::Lambertian || lobe.share == 0.0;
        let [inner, outer] = Side::BOTH.map(|side| self.smooth.index(side));
        let is_level = inner.to_bits() == outer.to_bits() || self.transmission.share == 0.0;
        is_even(&self.reflection) && is_even(&self.transmission) && is_level
    }
}

#[cfg(test)]
mod tests;
