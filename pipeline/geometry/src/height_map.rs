// SPDX-License-Identifier: MIT OR Apache-2.0
//! Solids under a height map: upright sides, a flat bottom, a smooth top.
//!
//! The top is the bicubic spline through the heights \[deBoor1962\]: twice continuously
//! differentiable, so that normals and curvatures are continuous. Its slopes at the edges are those of
//! the cubic through the four nearest heights.
//!
//! \[deBoor1962\] C. de Boor, *Bicubic spline interpolation*, J. Math. Phys. 41, 212.

use glam::DVec3;

use crate::tessellation::{Cells, MAX_TRIANGLES, Refusal, Tessellation};

/// Fewest heights along x and y: slopes at the edges take so many.
const MIN_NODES: usize = 4;

/// Heights at the nodes of a grid from edge to edge of a rectangle about the origin.
#[derive(Debug, Clone)]
pub struct HeightMap {
    /// Number of nodes along x and y.
    pub counts: [usize; 2],
    /// Lengths of the rectangle along x and y, mm.
    pub size_mm: [f64; 2],
    /// Heights above the bottom, z = 0, row after row from the smallest y, mm.
    pub heights_mm: Vec<f64>,
}

/// Slopes at equidistant nodes of the cubic spline through values, per step.
fn slopes(f: &[f64]) -> Vec<f64> {
    let last = f.len() - 1;
    let end = |[a, b, c, d]: [f64; 4]| (-11.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / 6.0;
    let mut slopes = vec![0.0; f.len()];
    slopes[0] = end([f[0], f[1], f[2], f[3]]);
    slopes[last] = -end([f[last], f[last - 1], f[last - 2], f[last - 3]]);
    // m_{i-1} + 4 m_i + m_{i+1} = 3 (f_{i+1} - f_{i-1}), by elimination.
    let mut next = vec![0.0; f.len()];
    for i in 1..last {
        next[i] = 1.0 / (4.0 - next[i - 1]);
        slopes[i] = (3.0 * (f[i + 1] - f[i - 1]) - slopes[i - 1]) * next[i];
    }
    for i in (1..last).rev() {
        slopes[i] -= next[i] * slopes[i + 1];
    }
    slopes
}

/// Factors of value and slope at the start, then at the end of a step, for the cubic between and for
/// its derivative.
fn hermite(t: f64) -> [[f64; 4]; 2] {
    let u = 1.0 - t;
    [
        [(1.0 + 2.0 * t) * u * u, t * u * u, t * t * (3.0 - 2.0 * t), -t * t * u],
        [-6.0 * t * u, u * (1.0 - 3.0 * t), 6.0 * t * u, t * (3.0 * t - 2.0)],
    ]
}

impl HeightMap {
    /// The solid.
    ///
    /// # Errors
    /// Too few or too many heights, a top that is not above the bottom everywhere, too many triangles.
    pub fn solid(&self) -> Result<Tessellation, Refusal> {
        let [nx, ny] = self.counts;
        if nx.min(ny) < MIN_NODES {
            let expected = format!("at least {MIN_NODES} by {MIN_NODES}");
            return Err([format!("{nx} by {ny} heights"), expected]);
        }
        let most = MAX_TRIANGLES / 4;
        if (nx - 1).saturating_mul(ny - 1) > most {
            let expected = format!("at most {most} cells between them, as of about 700 by 700");
            return Err([format!("{nx} by {ny} heights"), expected]);
        }
        let by_row = |values: &[f64]| values.chunks(nx).flat_map(slopes).collect::<Vec<_>>();
        let by_column = |values: &[f64]| {
            let mut found = vec![0.0; values.len()];
            for i in 0..nx {
                let column: Vec<f64> = (0..ny).map(|j| values[j * nx + i]).collect();
                for (j, slope) in slopes(&column).into_iter().enumerate() {
                    found[j * nx + i] = slope;
                }
            }
            found
        };
        let (fx, fy) = (by_row(&self.heights_mm), by_column(&self.heights_mm));
        let fxy = by_column(&fx);
        // [f, f_x; f_y, f_xy] of a node.
        let node = |k: usize| [[self.heights_mm[k], fx[k]], [fy[k], fxy[k]]];
        let step = [0, 1].map(|k| self.size_mm[k] / (self.counts[k] - 1) as f64);
        let at = |[i, j]: [usize; 2], [s, t]: [f64; 2]| {
            let nodes = [0, 1].map(|b| [0, 1].map(|a| node((j + b) * nx + i + a)));
            let ([p, dp], [q, dq]) = (hermite(s), hermite(t));
            let sum = |p: [f64; 4], q: [f64; 4]| -> f64 {
                let terms = (0..16).map(|n| {
                    let [b, dy, a, dx] = [n >> 3, n >> 2 & 1, n >> 1 & 1, n & 1];
                    q[2 * b + dy] * p[2 * a + dx] * nodes[b][a][dy][dx]
                });
                terms.sum()
            };
            let x = (i as f64 + s) * step[0] - 0.5 * self.size_mm[0];
            let y = (j as f64 + t) * step[1] - 0.5 * self.size_mm[1];
            let normal = DVec3::new(-sum(dp, q) / step[0], -sum(p, dq) / step[1], 1.0);
            (DVec3::new(x, y, sum(p, q)), normal.normalize())
        };
        let width_mm = self.size_mm[0].max(self.size_mm[1]);
        let counts = [nx - 1, ny - 1];
        let mut solid = Cells { counts, is_round: false, width_mm, at: &at }.tessellated()?;
        let heights = solid.triangles.iter().flatten().map(|corner| corner.z);
        let low_mm = heights.fold(f64::MAX, f64::min);
        if low_mm <= 0.0 {
            let expected = "one above the bottom, z = 0, with `base_mm` and `scale_mm`".to_owned();
            return Err([format!("a map whose lowest point lies at {low_mm} mm"), expected]);
        }
        // Sides and bottom below each edge of the border, which is run through counter-clockwise.
        let half = DVec3::new(self.size_mm[0], self.size_mm[1], 0.0) * (0.5 - 1e-9);
        let edges = solid.triangles.iter().filter(|[p, q, _]| {
            (0..2).any(|k| p[k].abs() > half[k] && q[k].abs() > half[k] && p[k] * q[k] > 0.0)
        });
        let below = |[p, q, _]: &[DVec3; 3]| {
            let [p0, q0] = [*p, *q].map(|top| top.with_z(0.0));
            [[*p, p0, *q], [p0, q0, *q], [DVec3::ZERO, q0, p0]]
        };
        let flats: Vec<[DVec3; 3]> = edges.flat_map(below).collect();
        let normal = |[a, b, c]: &[DVec3; 3]| [(*b - *a).cross(*c - *a).normalize(); 3];
        solid.normals.extend(flats.iter().map(normal));
        solid.triangles.extend(flats);
        solid.deviation.triangles = solid.triangles.len();
        Ok(solid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A saddle, straight along both axes, is as far off its triangles as is stated.
    #[test]
    fn triangles_follow_a_twist() {
        let height = |x: f64, y: f64| 1.0 + 0.05 * x * y;
        let at = |k: usize| 2.0 * k as f64 - 3.0;
        let heights_mm = (0..16).map(|n| height(at(n % 4), at(n / 4))).collect();
        let map = HeightMap { counts: [4, 4], size_mm: [6.0, 6.0], heights_mm };
        let solid = map.solid().expect("a solid");
        let (mut most, mut turn) = (0.0_f64, 0.0_f64);
        for ([a, b, c], normals) in solid.triangles.iter().zip(&solid.normals) {
            if normals[0].z < 0.5 {
                continue;
            }
            for (i, j) in (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (i, j))) {
                let [i, j, k] = [i, j, 8 - i - j].map(|part| f64::from(part) / 8.0);
                let at = *a * i + *b * j + *c * k;
                let expected = DVec3::new(-0.05 * at.y, -0.05 * at.x, 1.0).normalize();
                most = most.max((at.z - height(at.x, at.y)).abs() * expected.z);
                let normal = normals[0] * i + normals[1] * j + normals[2] * k;
                turn = turn.max(normal.angle_between(expected).to_degrees());
            }
        }
        let stated = solid.deviation;
        assert!(stated.surface_mm < 6.0 * crate::tessellation::SURFACE, "{stated}");
        assert!(most > 0.9 * stated.surface_mm && most < 1.05 * stated.surface_mm, "{most}");
        assert!(turn < 1.05 * stated.normal_deg, "{turn} {stated}");
    }

    /// A map of `counts` nodes over 2 mm by 1 mm.
    fn map(counts: [usize; 2], height: impl Fn(f64, f64) -> f64) -> HeightMap {
        let at = |k: usize, n: usize, size: f64| size * (k as f64 / (n - 1) as f64 - 0.5);
        let rows = (0..counts[1]).map(|j| at(j, counts[1], 1.0));
        let row = |y: f64| (0..counts[0]).map(move |i| (at(i, counts[0], 2.0), y));
        let heights_mm = rows.flat_map(row).map(|(x, y)| height(x, y)).collect();
        HeightMap { counts, size_mm: [2.0, 1.0], heights_mm }
    }

    /// Cubics along both axes are met exactly, whatever the number of nodes.
    #[test]
    fn the_top_is_a_bicubic_surface() {
        let height = |x: f64, y: f64| 1.0 + 0.1 * x - 0.2 * x * y * y + 0.05 * x * x * x * y;
        let slopes = |x: f64, y: f64| {
            [0.1 - 0.2 * y * y + 0.15 * x * x * y, -0.4 * x * y + 0.05 * x * x * x]
        };
        let solid = map([7, 5], height).solid().expect("a solid");
        let (mut tops, mut flats, mut volume) = (0, 0, 0.0);
        for (corners, normals) in solid.triangles.iter().zip(&solid.normals) {
            let [a, b, c] = *corners;
            let own = (b - a).cross(c - a).normalize();
            volume += a.dot(b.cross(c)) / 6.0;
            for (at, normal) in corners.iter().zip(normals) {
                assert!(own.dot(*normal) > 0.999, "{own} {normal}");
                let [along_x, along_y] = slopes(at.x, at.y);
                let expected = DVec3::new(-along_x, -along_y, 1.0).normalize();
                if own.z > 0.5 {
                    tops += 1;
                    assert!((at.z - height(at.x, at.y)).abs() < 1e-12, "{at}");
                    assert!((*normal - expected).length() < 1e-11, "{at}: {normal}");
                } else {
                    flats += 1;
                    assert!((*normal - own).length() < 1e-12);
                }
            }
        }
        assert!(tops > 100 && flats > 50);
        // Odd terms cancel.
        assert!((volume / 2.0 - 1.0).abs() < 1e-4, "{volume}");
        assert_eq!(solid.deviation.triangles, solid.triangles.len());
    }

    /// A rough map takes more triangles than there may be.
    #[test]
    fn a_map_that_triangles_do_not_follow_is_refused() {
        let rough = |x: f64, y: f64| 2.0 + (50.0 * x).sin() * (50.0 * y).cos();
        let [got, _] = map([120, 120], rough).solid().expect_err("too rough");
        assert!(got.starts_with("a surface of "), "{got}");
        assert!(map([120, 120], |x, _| 2.0 + 0.1 * x).solid().is_ok());
    }
}
