// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field of the sources: power emitted, far field, power by angle.

use crate::bessel::sin_cos;
use crate::compression::{CMat, PER_PANEL};
use crate::kernel::{Media, Pair, radial};
use crate::mesh::Mesh;
use crate::panel::{Node, Reflection};
use crate::quadrature::{NODES, rule};
use num_complex::Complex64;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::f64::consts::{FRAC_2_PI, TAU};

/// Angles of the far field that are computed together.
const ANGLES: usize = 64;

/// Plane waves exp(-ik d·x) of the images of a node, and their derivatives along the normal, in all
/// directions d: the same operations lane by lane.
struct PlaneWaves<'a> {
    k: f64,
    /// x and z.
    directions: &'a [[f64; ANGLES]; 2],
    node: &'a Node,
    /// With their sign.
    images: &'a [(Reflection, f64)],
}

impl WithSimd for PlaneWaves<'_> {
    /// Sums over images times the weight of the node, the part real or imaginary: `[same side of the
    /// axis or other][derivative or wave][part][angle]`.
    type Output = [[[[f64; ANGLES]; 2]; 2]; 2];

    #[expect(clippy::inline_always, reason = "compiled for the instructions that were found")]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { k, directions: [dx, dz], node, images } = self;
        let [x, z] = node.point;
        let (mut across, mut up) = ([[0.0; ANGLES]; 2], [[0.0; ANGLES]; 2]);
        for i in 0..ANGLES {
            (across[1][i], across[0][i]) = sin_cos(k * dx[i] * x);
            (up[1][i], up[0][i]) = sin_cos(k * dz[i] * z);
        }
        let mut sums = [[[[0.0; ANGLES]; 2]; 2]; 2];
        for (image, sign) in images {
            let [nx, nz] = image.of(node.normal);
            let weight = sign * node.weight;
            let [turn_x, turn_z] = image.of([1.0, 1.0]);
            let [derivatives, waves] = &mut sums[usize::from(image.x)];
            for i in 0..ANGLES {
                let (sx, sz) = (turn_x * across[1][i], turn_z * up[1][i]);
                let re = weight * (across[0][i] * up[0][i] - sx * sz);
                let im = -weight * (sx * up[0][i] + across[0][i] * sz);
                let along = k * (dx[i] * nx + dz[i] * nz);
                derivatives[0][i] += along * im;
                derivatives[1][i] -= along * re;
                waves[0][i] += re;
                waves[1][i] += im;
            }
        }
        sums
    }
}

/// Solution for all sources.
#[derive(Clone, Debug)]
pub struct Field {
    mesh: Mesh,
    media: Media,
    mirror: f64,
    /// Places of line sources; none for plane waves.
    sources: Vec<[f64; 2]>,
    /// Parity and densities, a column a source.
    parts: Vec<(f64, CMat)>,
}

impl Field {
    pub(crate) fn new(
        mesh: Mesh,
        media: Media,
        mirror: f64,
        parities: &[f64],
        densities: Vec<CMat>,
    ) -> Self {
        let parts = parities.iter().copied().zip(densities).collect();
        Self { mesh, media, mirror, sources: Vec::new(), parts }
    }

    pub(crate) fn with_sources(self, sources: Vec<[f64; 2]>) -> Self {
        Self { sources, ..self }
    }

    /// Power that each source gives to the field around it, over that of the same source in the
    /// endless inner medium: 1 + 4 Im of the scattered field at its place.
    pub fn emitted(&self) -> Vec<f64> {
        (0..self.sources.len())
            .into_par_iter()
            .map(|source| 1.0 + 4.0 * self.scattered(source, self.sources[source]).im)
            .collect()
    }

    /// Field of the source numbered `from` at the place of the source numbered `to`: the same as
    /// the reverse, by reciprocity.
    pub fn between(&self, from: usize, to: usize) -> Complex64 {
        let [x, z] = self.sources[to];
        let [sx, sz] = self.sources[from];
        let own = 0.25 * radial(self.media.index[0] * (x - sx).hypot(z - sz)).0.h;
        Complex64::I * own + self.scattered(from, [x, z])
    }

    /// Field of a source at a place in the body, less that of the source in the endless medium.
    fn scattered(&self, source: usize, place: [f64; 2]) -> Complex64 {
        let inside = self.media.index[0];
        let mut field = Complex64::ZERO;
        for image in self.mesh.images.iter().filter(|image| image.z && !image.x) {
            let [x, z] = image.of(self.sources[source]);
            field += radial(inside * (place[0] - x).hypot(place[1] - z)).0.h * self.mirror;
        }
        // By Green's theorem the outline's share is S q - D u of the inner medium.
        self.sum(source, |node, [u, q]| {
            let pair = Pair::apart(place, [1.0, 0.0], node.point, node.normal);
            let waves = radial(inside * pair.r).0;
            let double = (waves.a - Complex64::new(0.0, FRAC_2_PI)) * pair.source;
            field += self.media.weight[0] * waves.h * q - double * u;
        });
        Complex64::new(0.0, 0.25) * field
    }

    /// Visits all nodes of the whole outline with the densities times the weight.
    fn sum(&self, source: usize, mut visit: impl FnMut(&Node, [Complex64; 2])) {
        for &image in &self.mesh.images {
            for (p, panel) in self.mesh.panels.iter().enumerate() {
                for (i, node) in panel.nodes.iter().enumerate() {
                    let mut densities = [Complex64::ZERO; 2];
                    for (parity, columns) in &self.parts {
                        let sign = image.sign(*parity, self.mirror) * node.weight;
                        densities[0] += sign * columns[(p * PER_PANEL + i, source)];
                        densities[1] += sign * columns[(p * PER_PANEL + NODES + i, source)];
                    }
                    let there = Node {
                        point: image.of(node.point),
                        normal: image.of(node.normal),
                        ..*node
                    };
                    visit(&there, densities);
                }
            }
        }
    }

    /// Power per radian at angles from z towards x, over the power of the source in the endless
    /// inner medium: a row an angle, a column a source.
    pub fn intensity(&self, angles: &[f64]) -> Vec<Vec<f64>> {
        self.amplitudes(angles)
            .into_iter()
            .map(|row| row.into_iter().map(|f| f.norm_sqr() * self.per_amplitude()).collect())
            .collect()
    }

    /// |F|² / (8π w2) over 1/(4 w1).
    fn per_amplitude(&self) -> f64 {
        let [w1, w2] = self.media.weight;
        w1 / (TAU * w2)
    }

    /// F with the far field (i/4) sqrt(2/(πkr)) exp(i(kr - π/4)) F, a row an angle.
    pub fn amplitudes(&self, angles: &[f64]) -> Vec<Vec<Complex64>> {
        self.amplitudes_of_parts(angles)
            .into_iter()
            .map(|row| row.into_iter().map(|[even, odd]| even + odd).collect())
            .collect()
    }

    /// F of the parts even and odd in x; without symmetry all is in the first.
    fn amplitudes_of_parts(&self, angles: &[f64]) -> Vec<Vec<[Complex64; 2]>> {
        let (size, count) = (self.parts[0].1.nrows(), self.parts[0].1.ncols());
        let rows: Vec<Vec<Vec<[Complex64; 2]>>> = angles
            .par_chunks(ANGLES)
            .map(|angles| {
                let mut waves = vec![CMat::zeros(angles.len(), size); self.parts.len()];
                self.plane_waves(angles, |part, column, values| {
                    let column = waves[part].col_as_slice_mut(column);
                    column.copy_from_slice(&values[..angles.len()]);
                });
                let parts = waves.into_iter().zip(&self.parts);
                let parts: Vec<CMat> = parts.map(|(waves, (_, columns))| waves * columns).collect();
                let at = |row: usize, column: usize| {
                    let part = |part: usize| parts.get(part).map(|part| part[(row, column)]);
                    [0, 1].map(|number| part(number).unwrap_or_default())
                };
                let row = |row: usize| (0..count).map(|column| at(row, column)).collect();
                (0..angles.len()).map(row).collect()
            })
            .collect();
        rows.into_iter().flatten().collect()
    }

    /// Factors of the densities in the far field at angles, for each part and unknown.
    fn plane_waves(
        &self,
        angles: &[f64],
        mut visit: impl FnMut(usize, usize, &[Complex64; ANGLES]),
    ) {
        let mut directions = [[0.0; ANGLES]; 2];
        for (i, angle) in angles.iter().enumerate() {
            (directions[0][i], directions[1][i]) = angle.sin_cos();
        }
        let [_, k] = self.media.index;
        let sign = |image: &Reflection| (*image, image.sign(1.0, self.mirror));
        let images: Vec<(Reflection, f64)> = self.mesh.images.iter().map(sign).collect();
        for (p, panel) in self.mesh.panels.iter().enumerate() {
            for (i, node) in panel.nodes.iter().enumerate() {
                let waves = PlaneWaves { k, directions: &directions, node, images: &images };
                let [same, other] = Arch::new().dispatch(waves);
                for (number, (parity, _)) in self.parts.iter().enumerate() {
                    // The derivative belongs to the field, the wave to its derivative.
                    for (density, factor) in [1.0, -self.media.weight[1]].into_iter().enumerate() {
                        let [re, im] =
                            [0, 1].map(|part| (&same[density][part], &other[density][part]));
                        let sum = |(same, other): (&[f64; ANGLES], &[f64; ANGLES]), i: usize| {
                            factor * (same[i] + parity * other[i])
                        };
                        let values =
                            std::array::from_fn(|i| Complex64::new(sum(re, i), sum(im, i)));
                        visit(number, p * PER_PANEL + density * NODES + i, &values);
                    }
                }
            }
        }
    }

    /// Power in bins between the `edges` (radians from z, ascending), over the power of the source
    /// in the endless inner medium: a row a bin, a column a source. The far field is integrated by
    /// Gauss-Legendre panels that follow its fringes.
    pub fn bins(&self, edges: &[f64]) -> Vec<Vec<f64>> {
        let rule = rule();
        let size = self
            .mesh
            .panels
            .iter()
            .flat_map(|p| &p.nodes)
            .fold(0.0, |size: f64, node| size.max(node.point[0].hypot(node.point[1])));
        // A panel of 16 nodes holds three periods of the finest fringe, exp(2ik size θ).
        let fringe = TAU / (2.0 * self.media.index[1] * size);
        let count = edges.len().saturating_sub(1);
        // Even and odd light of one side are those of the other.
        let mirrored =
            edges.iter().zip(edges.iter().rev()).all(|(a, b)| (a + b).abs() < f64::EPSILON);
        let folded = self.parts.len() == 2 && mirrored && count.is_multiple_of(2);
        let first = if folded { count / 2 } else { 0 };
        let mut angles = Vec::new();
        let mut weights = Vec::new();
        for (bin, pair) in edges.windows(2).enumerate().skip(first) {
            let panels = ((pair[1] - pair[0]) / (3.0 * fringe)).ceil().max(1.0) as usize;
            let half = 0.5 * (pair[1] - pair[0]) / panels as f64;
            for panel in 0..panels {
                let mid = pair[0] + (2 * panel + 1) as f64 * half;
                for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
                    angles.push(mid + half * node);
                    weights.push((bin, half * weight * self.per_amplitude()));
                }
            }
        }
        let mut bins = vec![vec![0.0; self.parts[0].1.ncols()]; count];
        for (row, (bin, weight)) in self.amplitudes_of_parts(&angles).iter().zip(weights) {
            for (source, [even, odd]) in row.iter().enumerate() {
                bins[bin][source] += weight * (even + odd).norm_sqr();
                if folded {
                    bins[count - 1 - bin][source] += weight * (even - odd).norm_sqr();
                }
            }
        }
        bins
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, Outline, Polarisation, Resolution};

    /// The field that the densities make at a place by Green's theorem for the outer medium.
    fn outer(field: &Field, place: [f64; 2]) -> Complex64 {
        let mut sum = Complex64::ZERO;
        field.sum(0, |node, [u, q]| {
            let pair = Pair::apart(place, [1.0, 0.0], node.point, node.normal);
            let waves = radial(field.media.index[1] * pair.r).0;
            let double = (waves.a - Complex64::new(0.0, FRAC_2_PI)) * pair.source;
            sum += double * u - field.media.weight[1] * waves.h * q;
        });
        Complex64::new(0.0, 0.25) * sum
    }

    /// The same for the inner medium, with the source.
    fn inner(field: &Field, place: [f64; 2]) -> Complex64 {
        let [x, z] = field.sources[0];
        let own = radial(field.media.index[0] * (place[0] - x).hypot(place[1] - z)).0.h;
        Complex64::new(0.0, 0.25) * own + field.scattered(0, place)
    }

    /// Checks at places in units of the outline that the field of the inner medium vanishes outside
    /// and that of the outer medium inside. The equations hold the sum of both alone, and densities
    /// for which both vanish are the traces of one solution: nothing else is left to check.
    fn check(outline: &Outline, source: [f64; 2], within: &[[f64; 2]], beyond: &[[f64; 2]]) {
        let k = TAU / 0.55;
        let scaled = |[x, z]: [f64; 2]| [x * k, z * k];
        for polarisation in [Polarisation::Te, Polarisation::Tm] {
            let resolution = Resolution { nodes_per_wavelength: 12.0, ..Resolution::default() };
            let body = Body::new(outline, 0.55, [1.41, 1.0], resolution).unwrap();
            let field = body.solve(polarisation, &[source]).unwrap();
            let size = within.iter().map(|p| inner(&field, scaled(*p)).norm()).fold(0.0, f64::max);
            let outside = beyond.iter().map(|p| inner(&field, scaled(*p)));
            for rest in outside.chain(within.iter().map(|p| outer(&field, scaled(*p)))) {
                assert!(rest.norm() < 1e-8 * size, "{polarisation:?}: {:e}", rest.norm() / size);
            }
        }
    }

    #[test]
    fn either_field_vanishes_beyond_a_square() {
        let corners = [[1.5, 2.5], [-0.5, 2.5], [-0.5, 0.5]];
        let square = corners.into_iter().fold(Outline::closed([1.5, 0.5]), Outline::line_to);
        let square = square.line_to([1.5, 0.5]);
        let beyond = [[2.4, 1.0], [0.5, 3.4], [-1.4, -0.3], [9.0, -7.0]];
        check(&square, [0.3, 1.3], &[[0.9, 1.8], [0.4, 1.2]], &beyond);
    }

    #[test]
    fn either_field_vanishes_beyond_steps_on_a_mirror() {
        let right = [[3.0, 0.0], [3.0, 1.6], [2.2, 1.5], [2.4, 2.4], [1.0, 2.4], [1.0, 3.0]];
        let steps = right[1..].iter().fold(Outline::on_mirror(right[0]), |o, p| o.line_to(*p));
        let steps = right.iter().rev().fold(steps, |o, [x, z]| o.line_to([-x, *z]));
        let beyond = [[3.6, 0.2], [2.1, 3.4], [0.0, 3.8], [-4.0, 9.0]];
        check(&steps, [0.4, 1.1], &[[-1.0, 0.4], [1.2, 1.4]], &beyond);
    }
}
