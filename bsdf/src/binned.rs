// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of one incidence on cells of outgoing direction: what plots show and other programs exchange.
//!
//! In: any [`Bsdf`], `wi`, a polarisation, the number of cells in θ and φ. Out: the power in every cell and its BSDF.
//! A cell's BSDF is its power per incident power and per projected solid angle, the integral of |cos θ| dΩ over the cell, so
//! that a Lambertian of reflectance ρ has ρ/π everywhere. Discrete orders put all their power into one
//! cell: their BSDF grows as the cells shrink, while the power stays.

use crate::bsdf::{Bsdf, LobeKind, Polarization};
use crate::error::Error;
use glam::DVec3;
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Power over cells of outgoing direction; θ from +z (0 to π, both hemispheres), φ from +x towards +y.
#[derive(Clone, Debug, PartialEq)]
pub struct AngularPower {
    theta_cells: usize,
    phi_cells: usize,
    /// Shape (theta, phi).
    power: Vec<f64>,
}

impl AngularPower {
    /// Power of all lobes for light from `wi`, on `theta_cells` × `phi_cells` equal steps in angle.
    ///
    /// # Errors
    /// If there are no cells or `theta_cells` is odd, so that a cell would lie on both sides of the surface.
    pub fn new(
        surface: &(impl Bsdf + ?Sized),
        wi: DVec3,
        polarization: Polarization,
        theta_cells: usize,
        phi_cells: usize,
    ) -> Result<Self, Error> {
        if theta_cells == 0 || phi_cells == 0 || !theta_cells.is_multiple_of(2) {
            return Err(Error::Grid(format!(
                "expected cells of direction, an even number of them in theta, got {theta_cells} x {phi_cells}"
            )));
        }
        let mut cells = Self {
            theta_cells,
            phi_cells,
            power: vec![0.0; theta_cells * phi_cells],
        };
        for lobe in surface.lobes(wi, polarization) {
            if lobe.lobe.kind == LobeKind::Diffuse {
                // Cosine about the normal on one side: share / π per projected solid angle.
                let outer = lobe.wo.z > 0.0;
                for i in 0..theta_cells {
                    if (i < theta_cells / 2) == outer {
                        let power = lobe.power * FRAC_1_PI * cells.projected_solid_angle(i);
                        cells.power[i * phi_cells..(i + 1) * phi_cells]
                            .iter_mut()
                            .for_each(|p| *p += power);
                    }
                }
            } else {
                let (i, j) = cells.cell(lobe.wo);
                cells.power[i * phi_cells + j] += lobe.power;
            }
        }
        Ok(cells)
    }

    /// AngularBasis in θ and in φ.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        (self.theta_cells, self.phi_cells)
    }

    /// Cell that a direction falls into; a direction along the surface belongs to the outer side.
    #[must_use]
    pub fn cell(&self, wo: DVec3) -> (usize, usize) {
        let half = self.theta_cells / 2;
        let theta = wo.z.clamp(-1.0, 1.0).acos();
        let i = (theta / PI * self.theta_cells as f64) as usize;
        let i = if wo.z < 0.0 {
            i.clamp(half, self.theta_cells - 1)
        } else {
            i.min(half - 1)
        };
        let phi = wo.y.atan2(wo.x).rem_euclid(TAU);
        let j = (phi / TAU * self.phi_cells as f64) as usize;
        (i, j.min(self.phi_cells - 1))
    }

    /// Polar angle and azimuth of the middle of a cell, radians.
    #[must_use]
    pub fn centre(&self, theta_cell: usize, phi_cell: usize) -> (f64, f64) {
        let at = |k: usize, n: usize, whole: f64| (k as f64 + 0.5) / n as f64 * whole;
        (
            at(theta_cell, self.theta_cells, PI),
            at(phi_cell, self.phi_cells, TAU),
        )
    }

    /// Share of the incident power in a cell.
    #[must_use]
    pub fn power(&self, theta_cell: usize, phi_cell: usize) -> f64 {
        self.power[theta_cell * self.phi_cells + phi_cell]
    }

    /// Shares of all cells, shape (theta, phi).
    #[must_use]
    pub fn powers(&self) -> &[f64] {
        &self.power
    }

    /// Mean BSDF over a cell, 1/sr: share per projected solid angle.
    #[must_use]
    pub fn bsdf(&self, theta_cell: usize, phi_cell: usize) -> f64 {
        self.power(theta_cell, phi_cell) / self.projected_solid_angle(theta_cell)
    }

    /// Integral of |cos θ| dΩ over a cell, sr.
    #[must_use]
    pub fn projected_solid_angle(&self, theta_cell: usize) -> f64 {
        let sin2 = |k: usize| (k as f64 / self.theta_cells as f64 * PI).sin().powi(2);
        0.5 * TAU / self.phi_cells as f64 * (sin2(theta_cell + 1) - sin2(theta_cell)).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direction::spherical;
    use crate::{Lambertian, SmoothInterface};
    use approx::assert_abs_diff_eq;

    #[test]
    fn lambertian_has_one_bsdf_on_its_side_and_none_on_the_other() {
        let matt = Lambertian::new(0.8, 1.0).unwrap();
        let cells = AngularPower::new(
            &matt,
            spherical(0.5, 1.0),
            Polarization::Unpolarized,
            36,
            24,
        )
        .unwrap();
        for i in 0..36 {
            for j in 0..24 {
                assert_abs_diff_eq!(
                    cells.bsdf(i, j),
                    if i < 18 { 0.8 / PI } else { 0.0 },
                    epsilon = 1e-12
                );
            }
        }
        assert_abs_diff_eq!(cells.powers().iter().sum::<f64>(), 0.8, epsilon = 1e-13);
        assert_abs_diff_eq!(
            (0..36)
                .map(|i| 24.0 * cells.projected_solid_angle(i))
                .sum::<f64>(),
            TAU,
            epsilon = 1e-12
        );
    }

    #[test]
    fn interface_fills_the_two_cells_of_its_directions() {
        let interface = SmoothInterface::new(1.41, 1.0).unwrap();
        let wi = spherical(PI - 0.5, 0.3);
        let cells = AngularPower::new(&interface, wi, Polarization::P, 180, 360).unwrap();
        assert_eq!(cells.powers().iter().filter(|p| **p > 0.0).count(), 2);
        for lobe in interface.lobes(wi, Polarization::P) {
            let (i, j) = cells.cell(lobe.wo);
            assert_abs_diff_eq!(cells.power(i, j), lobe.power);
            let (theta, phi) = cells.centre(i, j);
            assert!((spherical(theta, phi) - lobe.wo).length() < 0.02);
        }
    }

    #[test]
    fn edges_of_the_sphere_fall_into_cells() {
        let matt = Lambertian::new(0.8, 1.0).unwrap();
        let cells = AngularPower::new(&matt, DVec3::Z, Polarization::S, 4, 4).unwrap();
        assert_eq!(cells.cell(DVec3::Z).0, 0);
        assert_eq!(cells.cell(-DVec3::Z).0, 3);
        assert_eq!(cells.cell(DVec3::X), (1, 0));
        assert_eq!(cells.cell(DVec3::new(1.0, -1e-300, -1e-300)).0, 2);
        assert!(AngularPower::new(&matt, DVec3::Z, Polarization::S, 5, 4).is_err());
    }
}
