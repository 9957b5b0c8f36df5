// SPDX-License-Identifier: MIT OR Apache-2.0
//! Faces of a stated haze: part of the transmitted light goes straight on, part in a Gaussian lobe.
//!
//! The haze is the share of the transmitted light that leaves more than 2.5° off the incident beam
//! \[ASTM D1003\], at normal incidence. What is reflected leaves as from a mirror, so that light along
//! the normal between this face and a smooth one stays along the normal until it passes this face.
//!
//! The width of the lobe is that in the medium of the lower index. In the other one it is narrower
//! by the ratio of the indices: for small angles refraction at a parallel face restores it.
//!
//! \[ASTM D1003\] *Standard test method for haze and luminous transmittance of transparent plastics*.

use glam::DVec3;
use rand::RngExt;

use super::diffuser::{GaussianLobe, check_shares};
use super::{SmoothInterface, mirrored, specular};
use crate::bsdf::{Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation, Transport};
use crate::direction::Side;
use crate::error::Error;

/// Largest angle to the incident beam of what is not haze, degrees.
pub const HAZE_DEG: f64 = 2.5;

/// A face that reflects as a mirror, and transmits straight on and in a Gaussian lobe about that
/// direction; it absorbs the rest. Beyond the critical angle all that it would transmit is reflected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HazyFace {
    /// Shares of the incident power: mirrored, straight on, in the lobe.
    shares: [f64; 3],
    /// The lobe on the inner and on the outer side.
    lobes: [GaussianLobe; 2],
    smooth: SmoothInterface,
}

impl HazyFace {
    /// A face with these shares of the incident power, of which `scattered` of what is transmitted
    /// goes into the lobe, between media of the refractive indices `[inner, outer]`.
    ///
    /// # Errors
    /// Shares that are no fractions or add up to more than 1; indices that are not positive.
    pub fn new(
        [reflected, transmitted]: [f64; 2],
        (scattered, lobe): (f64, GaussianLobe),
        indices: [f64; 2],
    ) -> Result<Self, Error> {
        check_shares([reflected, transmitted])?;
        Error::check_fraction("scattered share of a hazy face", scattered)?;
        let smooth = SmoothInterface::new(indices[0], indices[1])?;
        let lower = indices[0].min(indices[1]);
        Ok(Self {
            shares: [reflected, transmitted * (1.0 - scattered), transmitted * scattered],
            lobes: indices.map(|index| lobe.scaled(lower / index)),
            smooth,
        })
    }

    /// Directions of what is mirrored and of what is transmitted, and how the latter leaves.
    fn directions(&self, wi: DVec3) -> ([DVec3; 2], Transport) {
        let back = mirrored(wi);
        match self.smooth.refracted(wi) {
            Some(refracted) => ([back, refracted], Transport::Transmission),
            None => ([back, back], Transport::Reflection),
        }
    }
}

impl Bsdf for HazyFace {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let kept: f64 = self.shares.iter().sum();
        if kept <= 0.0 {
            return None;
        }
        let ([back, ahead], transport) = self.directions(wi);
        let [reflected, straight, _] = self.shares;
        let u = rng.random::<f64>() * kept;
        let (wo, lobe) = if u < reflected {
            (back, specular(Transport::Reflection))
        } else if u < reflected + straight {
            (ahead, specular(transport))
        } else {
            let side = Side::from_direction(ahead);
            let wo = self.lobes[side.index()].sample(ahead, side, rng);
            (wo, Lobe { transport, kind: LobeKind::Gaussian })
        };
        Some(BsdfSample { wo, weight: kept.min(1.0), lobe })
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        let ([_, ahead], transport) = self.directions(wi);
        let [reflected, straight, scattered] = self.shares;
        let share = |transports: Transport, share: f64| {
            if sample.lobe.transport == transports { share } else { 0.0 }
        };
        let part = if sample.lobe.kind == LobeKind::Gaussian {
            let side = Side::from_direction(ahead);
            scattered * self.lobes[side.index()].pdf(ahead, side, sample.wo)
        } else {
            share(Transport::Reflection, reflected) + share(transport, straight)
        };
        Some(part / self.shares.iter().sum::<f64>())
    }

    fn lobes(&self, wi: DVec3, _polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let ([back, ahead], transport) = self.directions(wi);
        let [reflected, straight, scattered] = self.shares;
        let all = [
            (back, reflected, specular(Transport::Reflection)),
            (ahead, straight, specular(transport)),
            (ahead, scattered, Lobe { transport, kind: LobeKind::Gaussian }),
        ];
        let some = all.into_iter().filter(|(_, power, _)| *power > 0.0);
        some.map(|(wo, power, lobe)| OutgoingLobe { wo, power, lobe }).collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.smooth.index(side)
    }
}

#[cfg(test)]
mod tests;
