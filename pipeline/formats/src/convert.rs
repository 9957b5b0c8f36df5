// SPDX-License-Identifier: MIT OR Apache-2.0
//! Conversion of BSDFs to the tables of other programs, with the loss of resolution, and back.
//!
//! In: any [`Bsdf`], such as a table of diffraction orders, and a resolution; or the content of a
//! file. Out: the content of a file with a [`Smearing`]; or a
//! [`MeasuredBsdf`](bsdf::MeasuredBsdf). An order is a direction, a cell is not: all power of an
//! order goes into the cell that it falls into. The file keeps the power and loses the position
//! within the cell. A program that reads the file spreads the power over the cell or, where it
//! interpolates, over its neighbours too.

use bsdf::Error;
use bsdf::angular_basis::OrientedBasis;
use bsdf::direction::{Side, lattice_point, spherical};
use bsdf::{Bsdf, LobeKind, OutgoingLobe, Polarisation, Transport};
use glam::DVec3;
use std::collections::BTreeMap;

/// Least power of an order that counts for the distance of neighbours.
pub(crate) const COUNTS: f64 = 0.01;
/// Most values of a file: about 1 GB of text.
pub(crate) const MAX_VALUES: usize = 200_000_000;

/// Angular steps of a table on angles, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Between polar angles of incidence.
    pub incidence_deg: f64,
    /// Between azimuths of incidence; divides 360.
    pub azimuth_deg: f64,
    /// Between angles of scatter, polar and azimuthal; divides 90.
    pub scatter_deg: f64,
    /// Incidences over which the power of each order is averaged, evenly spread half-way to the
    /// neighbouring nodes; 1 for the node alone. Efficiencies vary within a few degrees, which
    /// coarse steps of incidence would sample by chance. The directions are those at the node.
    pub samples: usize,
}

impl Resolution {
    /// Polar angles of incidence, degrees: from 0 in steps, and 89 at the end.
    pub fn incidences(&self) -> Vec<f64> {
        let mut angles = steps(90.0, self.incidence_deg, 0.0);
        angles.retain(|a| *a < 88.5);
        angles.push(89.0);
        angles
    }

    /// Azimuths of incidence, degrees, from 0.
    pub fn azimuths(&self) -> Vec<f64> {
        steps(360.0, self.azimuth_deg, 0.0)
    }

    /// Checks the steps and the number of values in `blocks` tables.
    ///
    /// # Errors
    /// If a step does not divide its range, or there are too many values.
    pub(crate) fn check(&self, blocks: usize) -> Result<(), Error> {
        for (name, step, range) in [
            ("incidence", self.incidence_deg, 90.0),
            ("azimuth of incidence", self.azimuth_deg, 360.0),
            ("scatter", self.scatter_deg, 90.0),
        ] {
            let count = range / step;
            if !(step > 0.0 && step <= range && (count - count.round()).abs() < 1e-9 * count) {
                return Err(Error::Resolution(format!(
                    "step of {name}: expected degrees that divide {range}, got {step}"
                )));
            }
        }
        if self.samples == 0 {
            return Err(Error::Resolution(
                "expected at least one incidence at a node, got 0".to_owned(),
            ));
        }
        let scatter = (360.0 / self.scatter_deg) * (180.0 / self.scatter_deg);
        let count = (90.0 / self.incidence_deg + 1.0) * (360.0 / self.azimuth_deg) * scatter;
        if count * blocks as f64 > MAX_VALUES as f64 {
            return Err(Error::Resolution(format!(
                "expected at most {MAX_VALUES} values in a file, got {:.0}",
                count * blocks as f64
            )));
        }
        Ok(())
    }
}

/// Lobes for light from `node` on `side`, mirrored into the upper hemisphere. The power of each
/// order is its mean over incidences from `below` to `above` degrees; its direction is that at the
/// node.
pub(crate) fn averaged(
    surface: &dyn Bsdf,
    side: Side,
    node: DVec3,
    [below, above]: [f64; 2],
    resolution: &Resolution,
) -> Vec<OutgoingLobe> {
    let count = resolution.samples;
    if count == 1 {
        return upper_lobes(surface, side, node);
    }
    let phi = node.y.atan2(node.x);
    let [low, high] = [below, above].map(|t| t.to_radians().sin().powi(2));
    let mut orders: BTreeMap<(Transport, LobeKind), OutgoingLobe> = BTreeMap::new();
    let mut cells = Vec::new();
    for k in 0..count {
        let [u, v] = lattice_point(k, count);
        let theta = (low + u * (high - low)).sqrt().asin();
        let turn = (v - 0.5) * resolution.azimuth_deg.to_radians();
        let wi = spherical(theta, phi + turn);
        for mut lobe in upper_lobes(surface, side, wi) {
            let to = lobe.lobe.transport.exit_side(side);
            // Shifted back by the change of the tangential wavevector of the incidence.
            let ratio = surface.index(side) / surface.index(to);
            let x = lobe.wo.x + ratio * (wi.x - node.x);
            let y = lobe.wo.y + ratio * (wi.y - node.y);
            let z2 = 1.0 - x * x - y * y;
            if z2 > 0.0 {
                lobe.wo = DVec3::new(x, y, z2.sqrt());
            }
            lobe.power /= count as f64;
            if lobe.lobe.kind == LobeKind::Cell || z2 <= 0.0 {
                cells.push(lobe);
            } else {
                let key = (lobe.lobe.transport, lobe.lobe.kind);
                orders.entry(key).and_modify(|o| o.power += lobe.power).or_insert(lobe);
            }
        }
    }
    orders.into_values().chain(cells).collect()
}

/// Intervals half-way from each of ascending angles to its neighbours, from 0 to 89.9 degrees.
pub(crate) fn halfway(angles: &[f64]) -> Vec<[f64; 2]> {
    (0..angles.len())
        .map(|k| {
            let low = if k == 0 { 0.0 } else { 0.5 * (angles[k - 1] + angles[k]) };
            let high = angles.get(k + 1).map_or(89.9, |next| 0.5 * (next + angles[k]));
            [low, high]
        })
        .collect()
}

/// `from`, `from` + `step`, ... below `range`.
pub(crate) fn steps(range: f64, step: f64, from: f64) -> Vec<f64> {
    let count = (range / step).round() as usize;
    (0..count).map(|k| from + step * k as f64).collect()
}

/// Power of one incidence before and after binning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncidenceLoss {
    /// Side that light comes from.
    pub side: Side,
    /// Reflected or transmitted.
    pub transport: Transport,
    /// Polar angle of the incidence, degrees from the normal.
    pub theta_deg: f64,
    /// Azimuth of `wi`, degrees.
    pub phi_deg: f64,
    /// Power before: the sum over the orders, averaged over the same incidences.
    pub before: f64,
    /// Power in the file: the sum over its cells of value times projected solid angle.
    pub after: f64,
    /// Power in cells that hold more than one order, which the file merges.
    pub merged: f64,
}

/// Loss of resolution by binning orders into cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Smearing {
    /// Widest cell, degrees: the width over which an order is spread.
    pub width_deg: f64,
    /// Mean angle between an order and the middle of its cell, weighted with power; degrees.
    pub mean_shift_deg: f64,
    /// Smallest angle between two orders of one incidence with at least a hundredth of the power
    /// each; degrees, infinite without such orders.
    pub closest_deg: f64,
    /// Every incidence of the file.
    pub incidences: Vec<IncidenceLoss>,
    /// Sums of power times shift, and of power.
    shifts: [f64; 2],
}

impl Smearing {
    /// Of cells up to `width` radians wide.
    pub(crate) fn new(width: f64) -> Self {
        Self {
            width_deg: width.to_degrees(),
            mean_shift_deg: 0.0,
            closest_deg: f64::INFINITY,
            incidences: Vec::new(),
            shifts: [0.0; 2],
        }
    }

    /// Records that `power` went into a cell whose centre lies `shift` radians off.
    pub(crate) fn shifted(&mut self, power: f64, shift: f64) {
        self.shifts[0] += power * shift.to_degrees();
        self.shifts[1] += power;
        self.mean_shift_deg = self.shifts[0] / self.shifts[1].max(f64::MIN_POSITIVE);
    }

    /// Records the distances of neighbouring orders.
    pub(crate) fn neighbours(&mut self, lobes: &[&OutgoingLobe]) {
        let is_order = |l: &&&OutgoingLobe| l.power >= COUNTS && l.lobe.kind != LobeKind::Cell;
        let strong: Vec<DVec3> = lobes.iter().filter(is_order).map(|l| l.wo).collect();
        for pair in strong.windows(2) {
            let angle = 2.0 * (0.5 * (pair[0] - pair[1]).length()).min(1.0).asin();
            if angle > 1e-9 {
                self.closest_deg = self.closest_deg.min(angle.to_degrees());
            }
        }
    }

    /// Largest difference of the powers before and after, over all incidences.
    pub fn worst_energy(&self) -> f64 {
        self.incidences.iter().map(|i| (i.after - i.before).abs()).fold(0.0, f64::max)
    }

    /// Mean fraction of the power in cells that hold more than one order.
    pub fn merged(&self) -> f64 {
        let (sum, all) =
            self.incidences.iter().fold((0.0, 0.0), |(s, a), i| (s + i.merged, a + i.before));
        if all > 0.0 { sum / all } else { 0.0 }
    }

    /// Width of cells, in degrees, that would separate all orders of a hundredth of the power: half
    /// the closest distance.
    pub fn resolving_deg(&self) -> f64 {
        0.5 * self.closest_deg
    }
}

/// Power of one incidence: before binning, after it, and merged in cells with several orders.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PowerBalance {
    pub(crate) before: f64,
    pub(crate) after: f64,
    pub(crate) merged: f64,
}

impl PowerBalance {
    /// Record for light from `wi` (upper hemisphere) on `side`.
    pub(crate) fn at(self, side: Side, transport: Transport, wi: DVec3) -> IncidenceLoss {
        let theta_deg = wi.z.clamp(-1.0, 1.0).acos().to_degrees();
        let phi_deg = wi.y.atan2(wi.x).to_degrees().rem_euclid(360.0);
        self.at_angles(side, transport, [theta_deg, phi_deg])
    }

    /// Record for light from a polar angle and an azimuth in degrees.
    pub(crate) fn at_angles(
        self,
        side: Side,
        transport: Transport,
        [theta_deg, phi_deg]: [f64; 2],
    ) -> IncidenceLoss {
        IncidenceLoss {
            side,
            transport,
            theta_deg,
            phi_deg,
            before: self.before,
            after: self.after,
            merged: self.merged,
        }
    }
}

/// BSDF of every cell from the lobes of one incidence, and its power balance.
pub(crate) fn bin_lobes(
    basis: &OrientedBasis,
    lobes: &[&OutgoingLobe],
    smearing: &mut Smearing,
) -> (Vec<f64>, PowerBalance) {
    smearing.neighbours(lobes);
    let mut powers = vec![0.0; basis.cells().len()];
    let mut orders = vec![0_u8; powers.len()];
    let mut balance = PowerBalance::default();
    for lobe in lobes {
        balance.before += lobe.power;
        if let Some(cell) = basis.locate(lobe.wo) {
            powers[cell] += lobe.power;
            orders[cell] = orders[cell].saturating_add(1);
            smearing.shifted(lobe.power, basis.centre(cell).angle_between(lobe.wo));
        }
    }
    let shared = powers.iter().zip(&orders).filter(|(_, n)| **n > 1);
    balance.merged = shared.map(|(power, _)| power).sum();
    let mut values = vec![0.0; powers.len()];
    for (cell, power) in powers.into_iter().enumerate().filter(|(_, p)| *p > 0.0) {
        let projected = basis.projected_solid_angle(cell);
        // A cell that only touches the horizon keeps a finite value.
        values[cell] = power / projected.max(1e-6 * basis.cells().solid_angle(cell));
        balance.after += values[cell] * projected;
    }
    (values, balance)
}

/// Lobes of unpolarised light from `wi` on `side`; `wi` and the lobes are mirrored into the upper
/// hemisphere.
pub(crate) fn upper_lobes(surface: &dyn Bsdf, side: Side, wi: DVec3) -> Vec<OutgoingLobe> {
    let wi = DVec3::new(wi.x, wi.y, side.sign() * wi.z);
    let mut lobes = surface.lobes(wi, Polarisation::Unpolarised);
    for lobe in &mut lobes {
        lobe.wo.z = lobe.wo.z.abs();
    }
    lobes
}

/// Lobes of one transport that carry power.
pub(crate) fn of_transport(lobes: &[OutgoingLobe], transport: Transport) -> Vec<&OutgoingLobe> {
    lobes.iter().filter(|l| l.lobe.transport == transport && l.power > 0.0).collect()
}

/// Checks that the surface has no lobe by a formula, which has no one direction to bin.
pub(crate) fn check_discrete(surface: &dyn Bsdf) -> Result<(), Error> {
    let wi = DVec3::new(0.1, 0.2, 0.95_f64).normalize();
    let diffuse = surface
        .lobes(wi, Polarisation::Unpolarised)
        .iter()
        .any(|l| matches!(l.lobe.kind, LobeKind::Diffuse | LobeKind::Gaussian));
    if diffuse {
        return Err(Error::Measured(
            "expected orders or cells to export, got a cosine or Gaussian lobe".to_owned(),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
