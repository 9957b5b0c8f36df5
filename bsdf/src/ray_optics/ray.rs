// SPDX-License-Identifier: MIT OR Apache-2.0
//! One ray in the periodic cell: its next event, and its reflection and refraction at a facet.
//!
//! In: a ray and the facets. Out: the next step. The sign of one cross product decides on which
//! side of a corner a ray passes. Both facets at the corner use the same number, so no ray slips
//! between them. A facet knows the media on both sides; a ray that arrives in another medium was
//! lost to rounding and is reported so.

use super::UnitCell;
use super::crossing::Crossing;
use super::outline::Facet;
use crate::direction::Side;
use glam::{DVec2, DVec3};

/// Steps after which a ray counts as lost.
pub(super) const MAX_STEPS: usize = 100_000;
/// Path in units of the period below which an intersection is due to rounding.
const ROUNDING: f64 = 1e-12;

/// A ray in the cell. Wavevectors in units of the vacuum wavenumber.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub x: f64,
    pub z: f64,
    pub kx: f64,
    pub kz: f64,
    pub ky: f64,
    /// Refractive index of the medium it is in.
    pub index: f64,
    /// Line of the facet it starts from, which it cannot hit next.
    pub last: Option<u32>,
}

impl Ray {
    /// Unit vector along the ray.
    pub fn direction(&self) -> DVec3 {
        DVec3::new(self.kx, self.ky, self.kz).normalize()
    }

    /// Point at parameter `t`, in units of length per wavenumber.
    pub fn at(&self, t: f64) -> DVec2 {
        DVec2::new(self.x + t * self.kx, self.z + t * self.kz)
    }

    /// Component of (kx, kz) × (point - start) along y: its sign tells the side of the ray.
    pub fn cross(&self, point: DVec2) -> f64 {
        self.kx * (point.y - self.z) - self.kz * (point.x - self.x)
    }
}

/// Next event of a ray, at parameter `t`.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// It hits a facet.
    Hit { facet: usize, t: f64 },
    /// It crosses the border of the period.
    Wrap { t: f64 },
    /// It leaves the cell.
    Leave,
    /// Rounding put it into an inconsistent medium.
    Lost,
}

/// Reflection and refraction of a ray at a facet.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetInteraction {
    /// Reflected power, 1 for total reflection.
    pub reflectance: f64,
    pub reflected: Ray,
    /// Meaningless for total reflection.
    pub refracted: Ray,
    /// Unit normal of the facet in x and z, in either sense.
    pub normal: DVec2,
    pub crossing: Crossing,
}

impl UnitCell {
    /// Next step of a ray.
    pub(super) fn step(&self, ray: &Ray) -> Step {
        let wall = if ray.kx > 0.0 {
            (self.period - ray.x) / ray.kx
        } else if ray.kx < 0.0 {
            -ray.x / ray.kx
        } else {
            f64::INFINITY
        };
        let to = if ray.kz > 0.0 { Side::Outer } else { Side::Inner };
        let exit =
            if ray.kz == 0.0 { f64::INFINITY } else { (self.limits[to.index()] - ray.z) / ray.kz };

        let rounding = ROUNDING * self.period;
        let mut nearest = (wall.min(exit), None, false);
        for (k, facet) in self.facets.iter().enumerate() {
            if ray.last == Some(facet.line) {
                continue;
            }
            let (a, b) = (ray.cross(facet.a), ray.cross(facet.b));
            if (a <= 0.0) == (b <= 0.0) {
                continue;
            }
            let t = facet.cross_from(ray) / (b - a);
            let expected = if b > a { facet.left } else { facet.right };
            let consistent = expected.to_bits() == ray.index.to_bits();
            // Within rounding of a corner only a consistent intersection counts.
            let valid = if consistent { t > -rounding } else { t > rounding };
            // A facet at the border of the period comes before the border.
            if valid && t <= nearest.0 {
                nearest = (t, Some(k), !consistent);
            }
        }
        match nearest {
            (_, Some(_), true) => Step::Lost,
            (t, Some(facet), false) => Step::Hit { facet, t },
            (t, None, _) if t.is_infinite() => Step::Lost,
            (_, None, _) if exit <= wall => {
                if ray.index.to_bits() == self.index[to.index()].to_bits() {
                    Step::Leave
                } else {
                    Step::Lost
                }
            }
            (t, None, _) => Step::Wrap { t },
        }
    }

    /// Moves a ray across the border of the period to the other end.
    pub(super) fn wrap(&self, ray: &mut Ray, t: f64) {
        ray.z += t * ray.kz;
        ray.x = if ray.kx > 0.0 { 0.0 } else { self.period };
        // The next period holds another copy of a slanted facet; a level one continues as the same
        // line.
        ray.last =
            ray.last.filter(|line| self.facets.iter().any(|f| f.line == *line && f.is_level()));
    }

    /// Reflection and refraction of a ray at a facet that it hits at `t`.
    pub(super) fn interact(&self, ray: &Ray, facet: usize, t: f64) -> FacetInteraction {
        let facet = &self.facets[facet];
        let (x, z) = ray.at(t).into();
        let (nx, nz) = facet.normal.into();
        let normal = ray.kx * nx + ray.kz * nz;
        let tangent = ray.kx * nz - ray.kz * nx;
        let (n1, n2) =
            if normal < 0.0 { (facet.left, facet.right) } else { (facet.right, facet.left) };
        let start = Ray { x, z, last: Some(facet.line), ..*ray };
        let reflected =
            Ray { kx: ray.kx - 2.0 * normal * nx, kz: ray.kz - 2.0 * normal * nz, ..start };
        // The tangential wavevector is conserved along b and along the facet.
        let q2_squared = n2 * n2 - ray.ky * ray.ky - tangent * tangent;
        let crossing = Crossing { media: [n1, n2], across: [normal.abs(), q2_squared] };
        let along = q2_squared.max(0.0).sqrt().copysign(normal);
        let refracted = Ray {
            kx: tangent * nz + along * nx,
            kz: -tangent * nx + along * nz,
            index: n2,
            ..start
        };
        FacetInteraction {
            reflectance: crossing.reflectance(),
            reflected,
            refracted,
            normal: facet.normal,
            crossing,
        }
    }
}

impl Facet {
    /// (a - start) × (b - a), the numerator of the parameter of the intersection.
    fn cross_from(&self, ray: &Ray) -> f64 {
        (self.a - DVec2::new(ray.x, ray.z)).perp_dot(self.b - self.a)
    }
}
