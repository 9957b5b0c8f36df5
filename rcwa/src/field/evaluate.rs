// SPDX-License-Identifier: MIT OR Apache-2.0
//! E and H at points, from coefficients on a plane.
//!
//! In: tangential coefficients of a slab or a half-space, as [`super::planes`] comes by them. Out:
//! samples. The normal components follow from the curls: ε Ez = -(Kx Hy - ky Hx) and Hz = Kx Ey -
//! ky Ex.

use super::slab::{Medium, Slab, Tangential};
use super::waves::Waves;
use super::{Grid, Sample};
use crate::linalg::CMat;
use crate::relief::Layer;
use crate::stack::Stack;
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// The points of a grid and the fields found there.
pub(super) struct Points<'a> {
    stack: &'a Stack,
    /// Positions along x, as fractions of the period from 0 to 1.
    places: Vec<f64>,
    /// exp(i kx_m x), orders of one x together.
    phases: Vec<Complex64>,
    z: &'a [f64],
    /// Depths of the tops of the layers, and of the last plane.
    planes: Vec<f64>,
    /// Power of the incident wave.
    incident: f64,
    kx: Vec<f64>,
    ky: f64,
    pub(super) samples: Vec<Sample>,
    pub(super) flux: Vec<f64>,
}

/// Coefficients of all six components at one z; the first is εEx where `divide` says so.
struct Components {
    electric: [Vec<Complex64>; 3],
    magnetic: [Vec<Complex64>; 3],
    divide: bool,
}

impl<'a> Points<'a> {
    pub(super) fn new(
        stack: &'a Stack,
        waves: &Waves,
        Grid { x, z }: &'a Grid,
        incident: f64,
    ) -> Self {
        let k0 = TAU / stack.wavelength();
        let phases = x
            .iter()
            .flat_map(|x| waves.kx.iter().map(move |kx| Complex64::cis(k0 * kx * x)))
            .collect();
        let mut planes = vec![0.0];
        for layer in stack.layers() {
            planes.push(planes[planes.len() - 1] + layer.thickness);
        }
        let nothing = Sample {
            index: Complex64::ZERO,
            electric: [Complex64::ZERO; 3],
            magnetic: [Complex64::ZERO; 3],
        };
        Self {
            places: x.iter().map(|x| (x / stack.period()).rem_euclid(1.0)).collect(),
            phases,
            planes,
            incident,
            kx: waves.kx.clone(),
            ky: waves.ky,
            samples: vec![nothing; x.len() * z.len()],
            flux: vec![0.0; z.len()],
            stack,
            z,
        }
    }

    fn k0(&self) -> f64 {
        TAU / self.stack.wavelength()
    }

    /// Rows of points whose z lies in `from <= z < to`.
    fn rows(&self, from: f64, to: f64) -> Vec<usize> {
        let inside = |&row: &usize| from <= self.z[row] && self.z[row] < to;
        (0..self.z.len()).filter(inside).collect()
    }

    /// The top half-space: the incident wave and the waves upward from the first plane.
    pub(super) fn above(&mut self, top: &Tangential, incident: &Tangential, waves: &Waves) {
        let epsilon = waves.index[0] * waves.index[0];
        for row in self.rows(f64::NEG_INFINITY, 0.0) {
            let d = self.k0() * self.z[row];
            let at = |total: &CMat, coming: &CMat| -> CMat {
                Mat::from_fn(total.nrows(), 1, |m, _| {
                    let (total, coming, kz) = (total[(m, 0)], coming[(m, 0)], waves.kz[0][m]);
                    let (down, up) =
                        ((Complex64::I * kz * d).exp(), (-Complex64::I * kz * d).exp());
                    let arriving =
                        if coming == Complex64::ZERO { Complex64::ZERO } else { coming * down };
                    arriving + (total - coming) * up
                })
            };
            let fields = Tangential {
                ex: at(&top.ex, &incident.ex),
                ey: at(&top.ey, &incident.ey),
                hy: at(&top.hy, &incident.hy),
                hx: at(&top.hx, &incident.hx),
            };
            self.uniform(row, &fields, epsilon, waves.index[0]);
        }
    }

    /// The bottom half-space: the waves downward from the last plane.
    pub(super) fn below(&mut self, bottom: &Tangential, waves: &Waves) {
        let epsilon = waves.index[1] * waves.index[1];
        let last = self.planes[self.planes.len() - 1];
        for row in self.rows(last, f64::INFINITY) {
            let d = self.k0() * (self.z[row] - last);
            let at = |there: &CMat| -> CMat {
                let wave = |m: usize| (Complex64::I * waves.kz[1][m] * d).exp();
                Mat::from_fn(there.nrows(), 1, |m, _| there[(m, 0)] * wave(m))
            };
            let fields = Tangential {
                ex: at(&bottom.ex),
                ey: at(&bottom.ey),
                hy: at(&bottom.hy),
                hx: at(&bottom.hx),
            };
            self.uniform(row, &fields, epsilon, waves.index[1]);
        }
    }

    fn uniform(&mut self, row: usize, fields: &Tangential, epsilon: Complex64, index: Complex64) {
        let ez = self.displacement_z(fields).iter().map(|d| d / epsilon).collect();
        let components = self.components(fields, None, ez);
        self.flux[row] = fields.power() / self.incident;
        self.fill(row, &components, |_| index);
    }

    /// A slab, from the coordinates at its bottom.
    pub(super) fn within(&mut self, slab: &Slab, medium: &Medium, own: &Tangential) {
        let layer = &self.stack.layers()[slab.layer];
        let [upper, lower] =
            slab.extent().map(|part| self.planes[slab.layer] + part * layer.thickness);
        // The last slab of a layer ends where the next layer begins, to the last bit.
        let lower = if slab.is_lowest() { self.planes[slab.layer + 1] } else { lower };
        for row in self.rows(upper, lower) {
            let height = (self.k0() * (lower - self.z[row])).clamp(0.0, slab.thickness);
            let raised = medium.raised(own, height);
            let displacement = medium.displacement(&raised);
            let fields = medium.to_fourier(raised);
            let ez = medium.divided_by_permittivity(&self.displacement_z(&fields));
            let components = self.components(&fields, Some(displacement), ez);
            self.flux[row] = fields.power() / self.incident;
            self.fill(row, &components, |place| index_at(layer, place));
        }
    }

    /// εEz.
    fn displacement_z(&self, fields: &Tangential) -> Vec<Complex64> {
        let [hy, minus_hx] = [&fields.hy, &fields.hx].map(|h| h.col_as_slice(0));
        let waves = self.kx.iter().zip(hy.iter().zip(minus_hx));
        waves.map(|(kx, (hy, minus_hx))| -(kx * hy + self.ky * minus_hx)).collect()
    }

    fn components(
        &self,
        fields: &Tangential,
        displacement_x: Option<Vec<Complex64>>,
        ez: Vec<Complex64>,
    ) -> Components {
        let columns = [&fields.ex, &fields.ey, &fields.hy, &fields.hx];
        let [ex, ey, hy, minus_hx] = columns.map(|column| column.col_as_slice(0));
        let hz = self
            .kx
            .iter()
            .zip(ex.iter().zip(ey))
            .map(|(kx, (ex, ey))| kx * ey - self.ky * ex)
            .collect();
        let divide = displacement_x.is_some();
        Components {
            electric: [displacement_x.unwrap_or_else(|| ex.to_vec()), ey.to_vec(), ez],
            magnetic: [minus_hx.iter().map(|h| -h).collect(), hy.to_vec(), hz],
            divide,
        }
    }

    /// Sums the orders at every x of a row.
    fn fill(&mut self, row: usize, of: &Components, index: impl Fn(f64) -> Complex64) {
        let (orders, width) = (self.kx.len(), self.places.len());
        for column in 0..width {
            let phases = &self.phases[column * orders..(column + 1) * orders];
            let sum = |c: &Vec<Complex64>| -> Complex64 {
                c.iter().zip(phases).map(|(c, phase)| c * phase).sum()
            };
            let index = index(self.places[column]);
            let mut sample = Sample {
                index,
                electric: [0, 1, 2].map(|i| sum(&of.electric[i])),
                magnetic: [0, 1, 2].map(|i| sum(&of.magnetic[i])),
            };
            if of.divide {
                sample.electric[0] /= index * index;
            }
            self.samples[row * width + column] = sample;
        }
    }
}

/// Index of a layer at a place from 0 to 1.
fn index_at(layer: &Layer, place: f64) -> Complex64 {
    let next = layer.segments.partition_point(|s| s.x1 <= place);
    layer.segments[next.min(layer.segments.len() - 1)].index
}
