// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field of the sources: power emitted, far field, power by angle.

use crate::compression::{CMat, PER_PANEL};
use crate::kernel::{Media, Pair, radial};
use crate::mesh::Mesh;
use crate::panel::Node;
use crate::quadrature::{NODES, rule};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::{FRAC_2_PI, PI, TAU};

/// Solution for all sources.
#[derive(Clone, Debug)]
pub struct Field {
    mesh: Mesh,
    media: Media,
    mirror: f64,
    /// The scale that multiplies lengths of the outline.
    unit: f64,
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
        unit: f64,
        parities: &[f64],
        densities: Vec<CMat>,
    ) -> Self {
        let parts = parities.iter().copied().zip(densities).collect();
        Self { mesh, media, mirror, unit, sources: Vec::new(), parts }
    }

    pub(crate) fn from_sources(self, sources: Vec<[f64; 2]>) -> Self {
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
        self.amplitudes_of(angles, &|_| true)
    }

    /// Share of the amplitudes that comes from the parts of the outline whose x is `kept`.
    fn amplitudes_of(
        &self,
        angles: &[f64],
        kept: &(impl Fn(f64) -> bool + Sync),
    ) -> Vec<Vec<Complex64>> {
        let k = self.media.index[1];
        let sides: &[f64] = if self.parts.len() > 1 { &[1.0, -1.0] } else { &[1.0] };
        let panels: Vec<usize> = (0..self.mesh.panels.len())
            .filter(|&p| {
                let mut nodes = self.mesh.panels[p].nodes.iter();
                nodes.any(|node| sides.iter().any(|side| kept(side * node.point[0])))
            })
            .collect();
        let count = self.parts[0].1.ncols();
        let chosen: Vec<(f64, CMat)> = self
            .parts
            .iter()
            .map(|(parity, columns)| {
                let row = |i: usize| panels[i / PER_PANEL] * PER_PANEL + i % PER_PANEL;
                let size = panels.len() * PER_PANEL;
                (*parity, CMat::from_fn(size, count, |i, j| columns[(row(i), j)]))
            })
            .collect();
        let rows: Vec<Vec<Vec<Complex64>>> = angles
            .par_chunks(64)
            .map(|angles| {
                let mut sum = CMat::zeros(angles.len(), count);
                for (parity, columns) in &chosen {
                    let mut waves = CMat::zeros(angles.len(), panels.len() * PER_PANEL);
                    for (row, angle) in angles.iter().enumerate() {
                        let (x, z) = angle.sin_cos();
                        self.plane_wave(k, [x, z], *parity, &panels, kept, |column, value| {
                            waves[(row, column)] = value;
                        });
                    }
                    sum += waves * columns;
                }
                (0..angles.len())
                    .map(|row| (0..count).map(|column| sum[(row, column)]).collect())
                    .collect()
            })
            .collect();
        rows.into_iter().flatten().collect()
    }

    /// Factors of the densities in the far field along a direction.
    fn plane_wave(
        &self,
        k: f64,
        direction: [f64; 2],
        parity: f64,
        panels: &[usize],
        kept: &impl Fn(f64) -> bool,
        mut put: impl FnMut(usize, Complex64),
    ) {
        for (p, &panel) in panels.iter().enumerate() {
            for (i, node) in self.mesh.panels[panel].nodes.iter().enumerate() {
                let (mut field, mut derivative) = (Complex64::ZERO, Complex64::ZERO);
                for &image in &self.mesh.images {
                    let (point, normal) = (image.of(node.point), image.of(node.normal));
                    if !kept(point[0]) {
                        continue;
                    }
                    let sign = image.sign(parity, self.mirror) * node.weight;
                    let phase = -k * (direction[0] * point[0] + direction[1] * point[1]);
                    let wave = Complex64::new(phase.cos(), phase.sin()) * sign;
                    let along = direction[0] * normal[0] + direction[1] * normal[1];
                    field += wave * Complex64::new(0.0, -k * along);
                    derivative -= wave * self.media.weight[1];
                }
                put(p * PER_PANEL + i, field);
                put(p * PER_PANEL + NODES + i, derivative);
            }
        }
    }

    /// Power in bins between the `edges` (radians from z, ascending), over the power of the source
    /// in the endless inner medium: a row a bin, a column a source. The far field is integrated by
    /// Gauss-Legendre panels that follow its fringes.
    pub fn bins(&self, edges: &[f64]) -> Vec<Vec<f64>> {
        self.integrated(edges, |angles| self.intensity(angles))
    }

    /// As [`bins`](Self::bins), with the waves from the parts of the outline between the `breaks`
    /// (x, ascending) added as powers, as if they had no common phase. Parts beside each other
    /// interfere, so that the total is not that of all.
    pub fn bins_apart(&self, edges: &[f64], breaks: &[f64]) -> Vec<Vec<f64>> {
        let breaks: Vec<f64> = breaks.iter().map(|x| x * self.unit).collect();
        self.integrated(edges, |angles| {
            let mut sum = vec![vec![0.0; self.parts[0].1.ncols()]; angles.len()];
            for part in 0..=breaks.len() {
                let kept = |x: f64| breaks.partition_point(|b| *b < x) == part;
                for (row, amplitudes) in sum.iter_mut().zip(self.amplitudes_of(angles, &kept)) {
                    for (power, f) in row.iter_mut().zip(amplitudes) {
                        *power += f.norm_sqr() * self.per_amplitude();
                    }
                }
            }
            sum
        })
    }

    fn integrated(
        &self,
        edges: &[f64],
        intensity: impl Fn(&[f64]) -> Vec<Vec<f64>>,
    ) -> Vec<Vec<f64>> {
        let rule = rule();
        let size = self
            .mesh
            .panels
            .iter()
            .flat_map(|p| &p.nodes)
            .fold(0.0, |size: f64, node| size.max(node.point[0].hypot(node.point[1])));
        // Two panels of 16 nodes hold some four periods of the finest fringe, exp(2ik size θ).
        let fringe = TAU / (2.0 * self.media.index[1] * size);
        let mut angles = Vec::new();
        let mut weights = Vec::new();
        for (bin, pair) in edges.windows(2).enumerate() {
            let panels = ((pair[1] - pair[0]) / (2.0 * fringe)).ceil().max(1.0) as usize;
            let half = 0.5 * (pair[1] - pair[0]) / panels as f64;
            for panel in 0..panels {
                let mid = pair[0] + (2 * panel + 1) as f64 * half;
                for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
                    angles.push(mid + half * node);
                    weights.push((bin, half * weight));
                }
            }
        }
        let mut bins = vec![vec![0.0; self.parts[0].1.ncols()]; edges.len().saturating_sub(1)];
        for (row, (bin, weight)) in intensity(&angles).iter().zip(weights) {
            for (sum, value) in bins[bin].iter_mut().zip(row) {
                *sum += weight * value;
            }
        }
        bins
    }

    /// Power that leaves to all sides, over that of the source in the endless inner medium: with
    /// no loss it is what the source emits, which nothing enforces.
    pub fn radiated(&self) -> Vec<f64> {
        let range = if self.mirror == 0.0 { PI } else { 0.5 * PI };
        self.bins(&[-range, range]).pop().unwrap_or_default()
    }
}
