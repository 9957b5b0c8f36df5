// SPDX-License-Identifier: MIT OR Apache-2.0
//! Angular bases: partitions of the hemisphere of directions into cells.
//!
//! In: the angles of a file, or the name of a basis. Out: the projected solid angle (integral of
//! cos θ dΩ) of every cell, its centre, sampled directions, and the cell of any direction.
//! Directions lie in the upper hemisphere (z ≥ 0); the caller knows the side of the surface. Rings
//! of constant θ cut at azimuths cover the Klems basis of WINDOW [Klems 1994] and the scatter
//! angles of tabular formats. Tensor trees use the concentric map of a square onto a disc [Shirley,
//! Chiu 1997], whose cells all have the same projected solid angle.
//!
//! \[Klems 1994\] J. H. Klems, *ASHRAE Transactions* 100(1), 1065. \[Shirley, Chiu 1997\] *Journal
//! of Graphics Tools* 2(3), 45.

use crate::direction::{Frame, spherical};
use glam::DVec3;
use rand::RngExt;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};
use std::sync::Arc;

/// Tries to sample a direction above the horizon in a cell that reaches below it. A cell with
/// little of it above needs many, but it is sampled as rarely: the mean over all cells stays
/// bounded.
const TRIES: usize = 1 << 20;
/// Points along each edge of a cell for its integral above the horizon.
const POINTS: usize = 6;
/// Polar bounds (degrees) and cells per ring of the full Klems basis.
const KLEMS_THETAS: [f64; 10] = [0.0, 5.0, 15.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 90.0];
const KLEMS_PHIS: [usize; 9] = [1, 8, 16, 20, 24, 24, 24, 16, 12];

/// One ring of cells between two polar angles.
#[derive(Clone, Debug, PartialEq)]
struct Ring {
    theta: [f64; 2],
    /// Azimuthal bounds of the cells, ascending over a whole turn; radians.
    phi: Arc<[f64]>,
    /// Number of its first cell.
    first: usize,
}

/// Partition of the directions about an axis into cells.
#[derive(Clone, Debug, PartialEq)]
pub struct AngularBasis {
    rings: Vec<Ring>,
    /// Step of the cell numbers within a ring: 1, or the number of rings.
    stride: usize,
    count: usize,
}

impl AngularBasis {
    fn from_rings(rings: impl IntoIterator<Item = ([f64; 2], Arc<[f64]>)>) -> Self {
        let mut count = 0;
        let rings = rings
            .into_iter()
            .map(|(theta, phi)| {
                let first = count;
                count += phi.len() - 1;
                Ring { theta, phi, first }
            })
            .collect();
        Self { rings, stride: 1, count }
    }

    /// The full Klems basis: 145 cells, azimuth 0 in the middle of the first cell of each ring.
    pub fn klems() -> Self {
        Self::from_rings(KLEMS_THETAS.windows(2).zip(KLEMS_PHIS).map(|(theta, n)| {
            let phi = (0..=n).map(|k| (k as f64 - 0.5) / n as f64 * TAU).collect();
            ([theta[0].to_radians(), theta[1].to_radians()], phi)
        }))
    }

    /// Cells around the points at all combinations of `azimuths` and `radials` (degrees, both
    /// ascending), cell number = azimuth · number of radials + radial.
    ///
    /// A cell reaches half-way to its neighbours. The outermost cells extend half a step beyond
    /// their points, up to `last_deg`. Azimuths are cyclic; where 360 stands beside 0, both have
    /// half a cell.
    pub fn around_points(azimuths: &[f64], radials: &[f64], last_deg: f64) -> Self {
        let theta = bounds(radials, last_deg);
        let phi = azimuth_bounds(azimuths);
        let rings =
            theta.windows(2).map(|t| ([t[0].to_radians(), t[1].to_radians()], Arc::clone(&phi)));
        let mut cells = Self::from_rings(rings);
        // Cells are numbered azimuth by azimuth.
        cells.stride = cells.rings.len();
        for (k, ring) in cells.rings.iter_mut().enumerate() {
            ring.first = k;
        }
        cells
    }

    /// The same cells rotated about their axis by `angle` radians.
    #[must_use]
    pub fn rotated(mut self, angle: f64) -> Self {
        for ring in &mut self.rings {
            ring.phi = ring.phi.iter().map(|p| p + angle).collect();
        }
        self
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Polar bounds and azimuthal bounds of a cell, radians.
    pub fn bounds(&self, cell: usize) -> [[f64; 2]; 2] {
        let (ring, column) = if self.stride > 1 {
            (&self.rings[cell % self.stride], cell / self.stride)
        } else {
            let ring = self.rings.partition_point(|r| r.first <= cell) - 1;
            (&self.rings[ring], cell - self.rings[ring].first)
        };
        [ring.theta, [ring.phi[column], ring.phi[column + 1]]]
    }

    /// The cell that a direction lies in; `None` beyond the last ring.
    pub fn locate(&self, direction: DVec3) -> Option<usize> {
        let theta = direction.z.clamp(-1.0, 1.0).acos();
        let ring = self.rings.partition_point(|r| r.theta[1] <= theta);
        let at_end = ring == self.rings.len();
        let ring = self.rings.get(ring).or_else(|| {
            self.rings.last().filter(|last| at_end && theta <= last.theta[1] * (1.0 + 1e-12))
        })?;
        if theta < ring.theta[0] {
            return None;
        }
        let start = ring.phi[0];
        let phi = start + (direction.y.atan2(direction.x) - start).rem_euclid(TAU);
        let columns = ring.phi.len() - 1;
        let column = (ring.phi.partition_point(|b| *b <= phi).max(1) - 1).min(columns - 1);
        Some(ring.first + column * self.stride)
    }

    /// Integral of cos θ dΩ over a cell about the normal, sr; 0 beyond 90°.
    pub fn projected_solid_angle(&self, cell: usize) -> f64 {
        let [theta, phi] = self.bounds(cell);
        let sin2 = |t: f64| t.min(FRAC_PI_2).sin().powi(2);
        0.5 * (phi[1] - phi[0]) * (sin2(theta[1]) - sin2(theta[0]))
    }

    /// Solid angle of a cell, sr.
    pub fn solid_angle(&self, cell: usize) -> f64 {
        let [theta, phi] = self.bounds(cell);
        (phi[1] - phi[0]) * (theta[0].cos() - theta[1].cos())
    }

    /// The centre of a cell in θ and φ; the axis for a cap around it.
    pub fn centre(&self, cell: usize) -> DVec3 {
        let [theta, phi] = self.bounds(cell);
        let whole = phi[1] - phi[0] > TAU - 1e-9;
        let theta = if whole && theta[0] == 0.0 { 0.0 } else { 0.5 * (theta[0] + theta[1]) };
        spherical(theta, 0.5 * (phi[0] + phi[1]))
    }

    /// Samples a direction in a cell, uniform in cos θ dΩ for `u` and `v` uniform on 0..1.
    pub fn sample_projected(&self, cell: usize, u: f64, v: f64) -> DVec3 {
        let [theta, phi] = self.bounds(cell);
        let [a, b] = theta.map(|t| t.min(FRAC_PI_2).sin().powi(2));
        let sin2 = a + u * (b - a);
        disc(sin2.sqrt(), phi[0] + v * (phi[1] - phi[0]))
    }

    /// Samples a direction in a cell, uniform in solid angle.
    pub fn sample_solid_angle(&self, cell: usize, u: f64, v: f64) -> DVec3 {
        let [theta, phi] = self.bounds(cell);
        let [a, b] = theta.map(f64::cos);
        let cos = a + u * (b - a);
        let (sin, azimuth) = ((1.0 - cos * cos).max(0.0).sqrt(), phi[0] + v * (phi[1] - phi[0]));
        DVec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos)
    }

    /// The larger of the polar and the azimuthal extent of a cell, radians.
    pub fn angular_width(&self, cell: usize) -> f64 {
        let [theta, phi] = self.bounds(cell);
        let largest_sin = if theta[0] <= FRAC_PI_2 && theta[1] >= FRAC_PI_2 {
            1.0
        } else {
            theta[0].sin().max(theta[1].sin())
        };
        (theta[1] - theta[0]).max((phi[1] - phi[0]).min(PI) * largest_sin)
    }

    /// The largest [`AngularBasis::angular_width`] of all cells, radians.
    pub fn widest(&self) -> f64 {
        (0..self.len()).map(|c| self.angular_width(c)).fold(0.0, f64::max)
    }
}

/// Cells about the normal or about another axis. Directions are in the frame of the surface.
#[derive(Clone, Debug)]
pub struct OrientedBasis {
    cells: Arc<AngularBasis>,
    /// Frame whose normal is the axis; none for cells about the normal of the surface.
    frame: Option<Frame>,
}

impl OrientedBasis {
    /// Cells about the normal.
    pub fn about_normal(cells: &Arc<AngularBasis>) -> Self {
        Self { cells: Arc::clone(cells), frame: None }
    }

    /// Cells about `axis` (unit, z ≥ 0), azimuth 0 towards the normal; for an axis along the
    /// normal, towards the tangential direction `zero`.
    pub fn about(cells: &Arc<AngularBasis>, axis: DVec3, zero: DVec3) -> Self {
        let towards_normal = DVec3::Z - axis * axis.z;
        let t = if towards_normal.length() > 1e-9 {
            towards_normal.normalize()
        } else {
            (zero - axis * axis.dot(zero)).normalize()
        };
        let b = axis.cross(t);
        Self { cells: Arc::clone(cells), frame: Some(Frame { t, b, n: axis }) }
    }

    /// The cells about their axis.
    pub fn cells(&self) -> &AngularBasis {
        &self.cells
    }

    /// The cell that a direction lies in; `None` beyond the last ring.
    pub fn locate(&self, direction: DVec3) -> Option<usize> {
        let local = self.frame.map_or(direction, |f| f.to_local(direction));
        self.cells.locate(local)
    }

    /// The centre of a cell; may lie below the horizon.
    pub fn centre(&self, cell: usize) -> DVec3 {
        let centre = self.cells.centre(cell);
        self.frame.map_or(centre, |f| f.to_world(centre))
    }

    /// Integral of cos θ dΩ over the part of a cell above the horizon, θ from the normal; sr.
    pub fn projected_solid_angle(&self, cell: usize) -> f64 {
        let Some(frame) = self.frame else {
            return self.cells.projected_solid_angle(cell);
        };
        let at = |k: usize| (k as f64 + 0.5) / POINTS as f64;
        let mut sum = 0.0;
        for i in 0..POINTS {
            for j in 0..POINTS {
                let direction = frame.to_world(self.cells.sample_solid_angle(cell, at(i), at(j)));
                sum += direction.z.max(0.0);
            }
        }
        self.cells.solid_angle(cell) * sum / (POINTS * POINTS) as f64
    }

    /// Samples a direction above the horizon in a cell, uniform in cos θ dΩ, θ from the normal.
    pub fn sample(&self, cell: usize, rng: &mut dyn rand::Rng) -> DVec3 {
        let Some(frame) = self.frame else {
            return self.cells.sample_projected(cell, rng.random(), rng.random());
        };
        for _ in 0..TRIES {
            let local = self.cells.sample_solid_angle(cell, rng.random(), rng.random());
            let direction = frame.to_world(local);
            if direction.z > rng.random::<f64>() {
                return direction;
            }
        }
        raised(frame.to_world(self.cells.centre(cell)))
    }
}

/// A direction raised above the horizon.
pub(crate) fn raised(direction: DVec3) -> DVec3 {
    DVec3::new(direction.x, direction.y, direction.z.max(1e-9)).normalize()
}

/// Direction over the point of the unit disc at radius `r` and azimuth `phi`.
fn disc(r: f64, phi: f64) -> DVec3 {
    DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - r * r).max(0.0).sqrt())
}

/// Bounds half-way between ascending points, and half a step beyond the ends, within 0 and `last`.
fn bounds(points: &[f64], last: f64) -> Vec<f64> {
    let n = points.len();
    let mut bounds = Vec::with_capacity(n + 1);
    let step = |k: usize| 0.5 * (points[k + 1] - points[k]);
    bounds.push(if n > 1 { (points[0] - step(0)).max(0.0) } else { 0.0 });
    bounds.extend(points.windows(2).map(|p| 0.5 * (p[0] + p[1])));
    bounds.push(if n > 1 { (points[n - 1] + step(n - 2)).min(last) } else { last });
    bounds
}

/// Azimuthal bounds (radians, a whole turn) around ascending points from 0 to 360 degrees.
fn azimuth_bounds(points: &[f64]) -> Arc<[f64]> {
    let n = points.len();
    let (first, last) = (points[0], points[n - 1]);
    let mut bounds: Vec<f64> = Vec::with_capacity(n + 1);
    if n > 1 && last - first >= 360.0 - 1e-9 {
        bounds.push(first);
        bounds.extend(points.windows(2).map(|p| 0.5 * (p[0] + p[1])));
        bounds.push(last);
    } else {
        let seam = 0.5 * (last - 360.0 + first);
        bounds.push(seam);
        bounds.extend(points.windows(2).map(|p| 0.5 * (p[0] + p[1])));
        bounds.push(seam + 360.0);
    }
    bounds.into_iter().map(f64::to_radians).collect()
}

/// Concentric map of the unit square onto the unit disc: squares become circles, and areas keep
/// their proportions [Shirley, Chiu 1997].
pub fn square_to_disc([u, v]: [f64; 2]) -> [f64; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    // The larger coordinate is the radius; the ratio of the other to it is the azimuth.
    let (r, phi) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * b / a) } else { (b, FRAC_PI_2 - FRAC_PI_4 * a / b) };
    [r * phi.cos(), r * phi.sin()]
}

/// The direction above the point (x, y) of the unit disc.
pub fn above([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// Inverse of [`square_to_disc`], for points of the unit disc.
pub fn disc_to_square([x, y]: [f64; 2]) -> [f64; 2] {
    let r = x.hypot(y);
    if r == 0.0 {
        return [0.5, 0.5];
    }
    let (a, b) = if x.abs() > y.abs() {
        let r = r.copysign(x);
        (r, r * (y / x).atan() / FRAC_PI_4)
    } else {
        let r = r.copysign(y);
        (r * (x / y).atan() / FRAC_PI_4, r)
    };
    [0.5 * (a + 1.0), 0.5 * (b + 1.0)].map(|c| c.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    fn partitions() -> [AngularBasis; 4] {
        let every = |step: f64, n: usize, from: f64| -> Vec<f64> {
            (0..n).map(|k| from + step * k as f64).collect()
        };
        [
            AngularBasis::klems(),
            AngularBasis::around_points(&every(10.0, 36, 5.0), &every(2.0, 45, 1.0), 90.0),
            AngularBasis::around_points(&every(30.0, 13, 0.0), &every(10.0, 10, 0.0), 90.0),
            AngularBasis::around_points(&every(90.0, 4, 0.0), &every(5.0, 19, 0.0), 90.0),
        ]
    }

    #[test]
    fn cells_cover_the_hemisphere_once() {
        for cells in partitions() {
            let projected: f64 = (0..cells.len()).map(|c| cells.projected_solid_angle(c)).sum();
            assert!((projected - PI).abs() < 1e-12, "{projected}");
            let solid: f64 = (0..cells.len()).map(|c| cells.solid_angle(c)).sum();
            assert!((solid - TAU).abs() < 1e-12, "{solid}");
        }
        assert_eq!(AngularBasis::klems().len(), 145);
    }

    #[test]
    fn what_is_drawn_in_a_cell_is_found_in_it() {
        let mut rng = Pcg64::seed_from_u64(3);
        for cells in partitions() {
            for cell in 0..cells.len() {
                for _ in 0..8 {
                    let (u, v) =
                        (0.001 + 0.998 * rng.random::<f64>(), 0.001 + 0.998 * rng.random::<f64>());
                    assert_eq!(cells.locate(cells.sample_projected(cell, u, v)), Some(cell));
                    let direction = cells.sample_solid_angle(cell, u, v);
                    assert_eq!(cells.locate(direction), Some(cell));
                    assert!((direction.length() - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn squares_and_discs_map_onto_each_other_and_keep_areas() {
        let mut rng = Pcg64::seed_from_u64(4);
        let mut inside = 0;
        for _ in 0..20_000 {
            let square = [rng.random::<f64>(), rng.random::<f64>()];
            let [x, y] = square_to_disc(square);
            assert!(x.hypot(y) <= 1.0 + 1e-12);
            let back = disc_to_square([x, y]);
            assert!((back[0] - square[0]).abs() < 1e-12 && (back[1] - square[1]).abs() < 1e-12);
            inside += i32::from((x - 0.3).hypot(y + 0.2) < 0.5);
        }
        // A quarter of the disc's area; standard error 0.003.
        assert!((f64::from(inside) / 20_000.0 - 0.25).abs() < 0.013, "{inside}");
    }
}
