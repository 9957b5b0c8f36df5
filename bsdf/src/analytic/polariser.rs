// SPDX-License-Identifier: MIT OR Apache-2.0
//! Polarising sheets, reflective or absorbing: transmittance and reflectance of two axes by the
//! angle of incidence.
//!
//! The block axis c lies in the sheet; the pass axis is at right angles to it. For light along k
//! the block direction is the projection of c onto the plane at right angles to k, and the pass
//! direction is o = c × k/|c × k|: light with E along o is the ordinary ray of a uniaxial sheet
//! whose axis is c and does not know the sheet's anisotropy (an O-type polariser \[Yeh 1982\]).
//! Stretched dichroic sheets, stretched multilayers and wire grids block along c. Between ideal
//! crossed sheets the pass directions are at right angles in the planes of both axes alone; elsewhere
//! the share ½ k_x² k_y²/((1 - k_x²)(1 - k_y²)) of unpolarised light leaks.
//!
//! E along the pass direction is multiplied by √T_pass in transmission and √R_pass in reflection, E
//! along the block direction by √T_block and -√R_block, the sign of a mirror: there is no
//! retardation between the axes. What T and R leave of 1 is absorbed. Angles are those in the medium
//! of the lower index. Beyond the critical angle what would be transmitted at 90° is reflected.
//!
//! \[Yeh 1982\] P. Yeh, *Extended Jones matrix method*, J. Opt. Soc. Am. 72, 507.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};
use num_complex::Complex64;
use rand::RngExt;

use super::{SmoothInterface, mirrored, specular};
use crate::bsdf::{Bsdf, BsdfSample, OutgoingLobe, Polarisation, PolarisedBsdf, Transport, s_axis};
use crate::direction::Side;
use crate::error::Error;
use crate::stokes;

/// Rounding of a sum of shares.
const ROUNDING: f64 = 1e-12;

/// Transmittance and reflectance over the angle of incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisShares {
    /// Angle in degrees, transmittance, reflectance; straight lines between, constant beyond.
    knots: Vec<[f64; 3]>,
}

impl AxisShares {
    /// Shares by rows (angle in degrees, share), ascending; straight lines between, constant beyond.
    ///
    /// # Errors
    /// No rows, angles that do not ascend from 0 to 90, shares that are no fractions or that give
    /// more power than comes in.
    pub fn new(transmittance: &[[f64; 2]], reflectance: &[[f64; 2]]) -> Result<Self, Error> {
        for rows in [transmittance, reflectance] {
            let ascends = rows.windows(2).all(|pair| pair[0][0] < pair[1][0]);
            let is_angle = |row: &[f64; 2]| (0.0..=90.0).contains(&row[0]);
            if rows.is_empty() || !ascends || !rows.iter().all(is_angle) {
                return Err(Error::Angles);
            }
            for row in rows {
                Error::check_fraction("share of an axis of a polariser", row[1])?;
            }
        }
        let mut angles: Vec<f64> =
            transmittance.iter().chain(reflectance).map(|row| row[0]).collect();
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        let knot = |angle: f64| [angle, linear(transmittance, angle), linear(reflectance, angle)];
        let knots: Vec<[f64; 3]> = angles.into_iter().map(knot).collect();
        match knots.iter().find(|[_, t, r]| t + r > 1.0 + ROUNDING) {
            Some([angle, transmitted, reflected]) => Err(Error::AxisGain {
                angle: *angle,
                transmitted: *transmitted,
                reflected: *reflected,
            }),
            None => Ok(Self { knots }),
        }
    }

    /// Transmittance and reflectance.
    fn at(&self, angle: f64) -> [f64; 2] {
        let column = |k: usize| interpolated(&self.knots, angle, |knot| [knot[0], knot[k]]);
        [column(1), column(2)]
    }
}

/// Value of rows (x, value), ascending, at x: straight lines between, constant beyond; of no rows 0.
pub fn linear(rows: &[[f64; 2]], x: f64) -> f64 {
    interpolated(rows, x, |row| *row)
}

fn interpolated<T>(rows: &[T], x: f64, row: impl Fn(&T) -> [f64; 2]) -> f64 {
    let beyond = rows.partition_point(|at| row(at)[0] <= x);
    let Some([a, from]) = rows.get(beyond.saturating_sub(1)).map(&row) else {
        return 0.0;
    };
    if beyond == 0 || beyond == rows.len() {
        return from;
    }
    let [b, to] = row(&rows[beyond]);
    from + (x - a) / (b - a) * (to - from)
}

/// A polarising sheet, which reflects and transmits without scattering.
#[derive(Clone, Debug)]
pub struct Polariser {
    /// Of light along the pass and along the block direction.
    axes: [AxisShares; 2],
    /// Unit vector along the block axis; `None` of a sheet that is stated for unpolarised light
    /// alone and leaves it so.
    block: Option<DVec3>,
    smooth: SmoothInterface,
}

/// Response at one incidence.
struct PolariserIncidence {
    /// Shares (transmitted, reflected) of both axes.
    shares: [[f64; 2]; 2],
    /// Direction of what is transmitted; `None` beyond the critical angle.
    refracted: Option<DVec3>,
}

impl Polariser {
    /// A sheet between media of the indices `[inner, outer]` whose pass axis lies at `angle` from t
    /// towards b, in radians.
    ///
    /// # Errors
    /// Indices that are not positive.
    pub fn new(
        [pass, block]: [AxisShares; 2],
        angle: f64,
        indices: [f64; 2],
    ) -> Result<Self, Error> {
        let block_axis = DVec2::from_angle(angle).perp().extend(0.0);
        Ok(Self { axes: [pass, block], block: Some(block_axis), ..Self::of(indices)? })
    }

    /// A sheet of which only the shares of unpolarised light are known. Light leaves it unpolarised.
    ///
    /// # Errors
    /// Indices that are not positive.
    pub fn of_unpolarised(shares: &AxisShares, indices: [f64; 2]) -> Result<Self, Error> {
        Ok(Self { axes: [shares.clone(), shares.clone()], ..Self::of(indices)? })
    }

    fn of([inner, outer]: [f64; 2]) -> Result<Self, Error> {
        let none = AxisShares { knots: vec![[0.0; 3]] };
        let smooth = SmoothInterface::new(inner, outer)?;
        Ok(Self { axes: [none.clone(), none], block: None, smooth })
    }

    fn at(&self, wi: DVec3) -> PolariserIncidence {
        let from = Side::from_direction(wi);
        let [index, other] = [from, from.opposite()].map(|side| self.index(side));
        let refracted = self.smooth.refracted(wi);
        let in_lower = if index <= other { Some(wi) } else { refracted };
        let angle = in_lower.map_or(FRAC_PI_2, |ray| ray.x.hypot(ray.y).atan2(ray.z.abs()));
        let shares = [0, 1].map(|axis| {
            let [transmitted, reflected] = self.axes[axis].at(angle.to_degrees());
            match refracted {
                Some(_) => [transmitted, reflected],
                None => [0.0, transmitted + reflected],
            }
        });
        PolariserIncidence { shares, refracted }
    }

    /// Draws whether light, of which these shares are transmitted and reflected, goes on.
    fn drawn(
        [transmitted, reflected]: [f64; 2],
        refracted: Option<DVec3>,
        wi: DVec3,
        rng: &mut dyn rand::Rng,
    ) -> Option<BsdfSample> {
        let sum = transmitted + reflected;
        if sum <= 0.0 {
            return None;
        }
        let (wo, transport) = match refracted {
            Some(wo) if rng.random::<f64>() * sum >= reflected => (wo, Transport::Transmission),
            _ => (mirrored(wi), Transport::Reflection),
        };
        Some(BsdfSample { wo, weight: sum.min(1.0), lobe: specular(transport) })
    }

    /// The pass direction of light along `k`.
    fn pass(block: DVec3, k: DVec3) -> DVec3 {
        block.cross(k).try_normalize().unwrap_or_else(|| k.any_orthonormal_vector())
    }

    /// Light from `wi` referred to the pass direction, and its transmitted and reflected share.
    fn met(
        &self,
        incidence: &PolariserIncidence,
        wi: DVec3,
        light: [f64; 3],
    ) -> ([f64; 3], [f64; 2]) {
        let light = self
            .block
            .map_or(light, |block| stokes::turned(light, -wi, s_axis(wi), Self::pass(block, -wi)));
        let [pass, block] = incidence.shares;
        let q = if self.block.is_some() { light[0] } else { 0.0 };
        (light, [0, 1].map(|k| 0.5 * (pass[k] * (1.0 + q) + block[k] * (1.0 - q))))
    }
}

impl Bsdf for Polariser {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let incidence = self.at(wi);
        let (_, shares) = self.met(&incidence, wi, [0.0; 3]);
        Self::drawn(shares, incidence.refracted, wi, rng)
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        let (_, [transmitted, reflected]) = self.met(&self.at(wi), wi, [0.0; 3]);
        let part = match sample.lobe.transport {
            Transport::Reflection => reflected,
            Transport::Transmission => transmitted,
        };
        Some(part / (transmitted + reflected))
    }

    fn lobes(&self, wi: DVec3, polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let incidence = self.at(wi);
        let q = match polarisation {
            Polarisation::S => 1.0,
            Polarisation::P => -1.0,
            Polarisation::Unpolarised => 0.0,
        };
        let (_, [transmitted, reflected]) = self.met(&incidence, wi, [q, 0.0, 0.0]);
        let back = Some((mirrored(wi), reflected, Transport::Reflection));
        let through = incidence.refracted.map(|wo| (wo, transmitted, Transport::Transmission));
        let all = [back, through].into_iter().flatten().filter(|(_, power, _)| *power > 0.0);
        all.map(|(wo, power, transport)| OutgoingLobe { wo, power, lobe: specular(transport) })
            .collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.smooth.index(side)
    }

    /// Shares are those of the angle in the medium of the lower index, on both sides.
    fn is_reciprocal(&self) -> bool {
        true
    }

    fn as_polarised(&self) -> Option<&dyn PolarisedBsdf> {
        self.block.is_some().then_some(self)
    }
}

impl PolarisedBsdf for Polariser {
    fn sample_polarised(
        &self,
        wi: DVec3,
        light: [f64; 3],
        rng: &mut dyn rand::Rng,
    ) -> Option<(BsdfSample, [f64; 3])> {
        let block = self.block?;
        let incidence = self.at(wi);
        let (met, shares) = self.met(&incidence, wi, light);
        let sample = Self::drawn(shares, incidence.refracted, wi, rng)?;
        let (which, sign) = match sample.lobe.transport {
            Transport::Transmission => (0, 1.0),
            Transport::Reflection => (1, -1.0),
        };
        let [pass, blocked] = incidence.shares.map(|axis| Complex64::from(axis[which].sqrt()));
        let (left, _) = stokes::passed(met, [pass, blocked * sign]);
        let wo = sample.wo;
        Some((sample, stokes::turned(left, wo, Self::pass(block, wo), s_axis(wo))))
    }
}

#[cfg(test)]
mod tests;
