// SPDX-License-Identifier: MIT OR Apache-2.0
//! A body with its wavelength and indices, and what its solution needs.

use crate::FullWaveError;
use crate::bessel::Bessel;
use crate::compression::{CMat, PER_PANEL, compressed, for_each};
use crate::field::Field;
use crate::kernel::Media;
use crate::mesh::Mesh;
use crate::outline::{Outline, Surroundings, winding};
use crate::panel::{Block, Node, Panel, Reflection, add};
use crate::quadrature::NODES;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{solve_in_place, solve_in_place_scratch};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{MatMut, Par, Spec};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Polarisation of light in the plane of the outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarisation {
    /// The electric field is along y; so is the current of a line source.
    Te,
    /// The magnetic field is along y; a line source is a magnetic current.
    Tm,
}

/// Sign of what the mirror reflects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirror {
    /// A perfect conductor.
    Electric,
    /// The opposite sign. The mean power of both is that of the body and its image in free space,
    /// lit from one half, with the far field below the plane added to that above: light by way of
    /// the mirror adds as power.
    Magnetic,
}

/// Light that a body meets.
enum Light<'a> {
    /// Places of line sources inside.
    Lines(&'a [[f64; 2]]),
    /// Angles of plane waves from outside.
    Planes(&'a [f64]),
}

/// Fewer nodes per wavelength than this do not follow the field.
const MIN_NODES: f64 = 4.0;

/// Fineness of the panels and memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Nodes per wavelength in the denser medium, above 4.
    pub nodes_per_wavelength: f64,
    /// Bytes that the matrices may take.
    pub max_bytes: f64,
}

impl Default for Resolution {
    fn default() -> Self {
        Self { nodes_per_wavelength: 9.0, max_bytes: 8.0 * 1_073_741_824.0 }
    }
}

/// Size of a problem before it is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Unknowns of one matrix.
    pub unknowns: usize,
    /// Matrices for one polarisation: 2 where the body is symmetric.
    pub matrices: usize,
    /// Bytes of the matrices that are held at once.
    pub bytes: f64,
    /// Floating-point operations of the factorisations for one polarisation.
    pub operations: f64,
}

/// Dielectric body and the line sources in it.
#[derive(Clone, Debug)]
pub struct Body {
    outline: Outline,
    wavelength: f64,
    index: [f64; 2],
    mesh: Mesh,
}

impl Body {
    /// Panels of a body of index `inside` in a medium of index `outside`; `outline` and
    /// `wavelength` have one unit.
    ///
    /// # Errors
    /// Outlines that cross themselves, are open, or touch the mirror between their ends; numbers
    /// out of range; memory beyond the limit.
    pub fn new(
        outline: &Outline,
        wavelength: f64,
        [inside, outside]: [f64; 2],
        resolution: Resolution,
    ) -> Result<Self, FullWaveError> {
        let numbers = [
            ("wavelength", wavelength, 0.0),
            ("index inside", inside, 0.0),
            ("index outside", outside, 0.0),
            ("nodes per wavelength", resolution.nodes_per_wavelength, MIN_NODES),
        ];
        let refused = |(_, value, above): &(_, f64, f64)| !(*value > *above && value.is_finite());
        if let Some((name, got, above)) = numbers.into_iter().find(refused) {
            return Err(FullWaveError::Number { name, above, got });
        }
        outline.check()?;
        let scaled = outline.scaled(TAU / wavelength);
        let longest = NODES as f64 / resolution.nodes_per_wavelength * TAU / inside.max(outside);
        let mesh = Mesh::new(&scaled, longest);
        let body = Self { outline: scaled, wavelength, index: [inside, outside], mesh };
        let cost = body.cost();
        if cost.bytes > resolution.max_bytes {
            return Err(FullWaveError::Memory {
                limit: resolution.max_bytes / 1e9,
                needed: cost.bytes / 1e9,
                unknowns: cost.unknowns,
                width: outline.length() * inside / wavelength,
            });
        }
        Ok(body)
    }

    /// Size of the problem.
    pub fn cost(&self) -> Cost {
        let unknowns = self.mesh.panels.len() * PER_PANEL;
        let n = unknowns as f64;
        let matrices = self.parities().len();
        let held = matrices.min(rayon::current_num_threads()) as f64;
        Cost {
            unknowns,
            matrices,
            // The matrix and what a factorisation needs beside it.
            bytes: 16.0 * n * n * held * 1.05,
            operations: 8.0 / 3.0 * n * n * n * matrices as f64,
        }
    }

    /// Even and odd in x, or the one that has no symmetry.
    fn parities(&self) -> &'static [f64] {
        if self.mesh.images.iter().any(|image| image.x) { &[1.0, -1.0] } else { &[1.0] }
    }

    /// Field of each source by itself, of unit strength: (i/4) H0(k1 |x - s|) in the endless inner
    /// medium. Sources stand at (x, z) in the unit of the outline, all inside.
    ///
    /// # Errors
    /// Sources outside or closer to the outline than half a longest panel.
    pub fn solve(
        &self,
        polarisation: Polarisation,
        sources: &[[f64; 2]],
    ) -> Result<Field, FullWaveError> {
        self.solve_above(Mirror::Electric, polarisation, sources)
    }

    /// As [`solve`](Self::solve), above a mirror of either kind.
    ///
    /// # Errors
    /// Those of [`solve`](Self::solve).
    pub fn solve_above(
        &self,
        mirror: Mirror,
        polarisation: Polarisation,
        sources: &[[f64; 2]],
    ) -> Result<Field, FullWaveError> {
        let scale = TAU / self.wavelength;
        let scaled: Vec<[f64; 2]> = sources.iter().map(|s| [s[0] * scale, s[1] * scale]).collect();
        self.check_sources(&scaled)?;
        Ok(self.lit(mirror, polarisation, &Light::Lines(&scaled)).from_sources(scaled))
    }

    /// Field of plane waves of unit amplitude from outside that travel at `angles` from z towards
    /// x, and their reflection by a mirror. Amplitudes are those of the scattered field, the phase
    /// is 0 at the origin.
    pub fn scatter(&self, polarisation: Polarisation, angles: &[f64]) -> Field {
        self.lit(Mirror::Electric, polarisation, &Light::Planes(angles))
    }

    fn lit(&self, mirror: Mirror, polarisation: Polarisation, light: &Light) -> Field {
        let index = self.index;
        let weight = match polarisation {
            Polarisation::Te => [1.0, 1.0],
            Polarisation::Tm => index.map(|n| n * n),
        };
        let media = Media { index, weight };
        // The tangential electric field vanishes on the mirror.
        let mirror =
            match (self.outline.surroundings, polarisation, mirror) {
                (Surroundings::Free, ..) => 0.0,
                (_, Polarisation::Te, Mirror::Electric)
                | (_, Polarisation::Tm, Mirror::Magnetic) => -1.0,
                (_, Polarisation::Tm, Mirror::Electric)
                | (_, Polarisation::Te, Mirror::Magnetic) => 1.0,
            };
        let blocks = self.blocks(&media);
        let densities: Vec<CMat> = self
            .parities()
            .par_iter()
            .map(|&parity| self.densities(&media, &blocks, parity, mirror, light))
            .collect();
        let unit = TAU / self.wavelength;
        Field::new(self.mesh.clone(), media, mirror, unit, self.parities(), densities)
    }

    fn check_sources(&self, sources: &[[f64; 2]]) -> Result<(), FullWaveError> {
        let longest = self.mesh.panels.iter().map(Panel::length).fold(0.0, f64::max);
        let least = 0.5 * longest;
        let points = self.outline.points(0.25 * least);
        for (i, &[x, z]) in sources.iter().enumerate() {
            let scale = self.wavelength / TAU;
            let inside = (winding(&points, [x, z]) - 1.0).abs() < 0.5
                && (z > 0.0 || self.outline.surroundings == Surroundings::Free);
            let distance =
                points.iter().map(|p| (p[0] - x).hypot(p[1] - z)).fold(f64::INFINITY, f64::min);
            if !inside || distance < least {
                let got =
                    if inside { format!("{:.4}", distance * scale) } else { "outside".to_owned() };
                return Err(FullWaveError::Source {
                    number: i + 1,
                    x: x * scale,
                    z: z * scale,
                    distance: least * scale,
                    got,
                });
            }
        }
        Ok(())
    }

    /// The compressed block of each corner; corners of one kind share the work.
    fn blocks(&self, media: &Media) -> Vec<CMat> {
        let corners = &self.mesh.corners;
        let same = |a: usize, b: usize| {
            let (a, b) = (&corners[a], &corners[b]);
            (a.panel - b.panel).abs() < 1e-11
                && (a.turn - b.turn).abs() < 1e-11
                && (0..2).all(|i| (a.curvature[i] - b.curvature[i]).abs() < 1e-11)
        };
        let mut kinds: Vec<usize> = Vec::new();
        let kind_of: Vec<usize> = (0..corners.len())
            .map(|i| {
                kinds.iter().position(|&kind| same(kind, i)).unwrap_or_else(|| {
                    kinds.push(i);
                    kinds.len() - 1
                })
            })
            .collect();
        let made: Vec<CMat> = kinds.par_iter().map(|&i| compressed(media, &corners[i])).collect();
        kind_of.into_iter().map(|kind| made[kind].clone()).collect()
    }

    /// Densities ρ = R ρ' of all sources for one parity, weighted so that a sum over the coarse
    /// nodes integrates them.
    fn densities(
        &self,
        media: &Media,
        blocks: &[CMat],
        parity: f64,
        mirror: f64,
        light: &Light,
    ) -> CMat {
        let characters: Vec<(Reflection, f64)> =
            self.mesh.images.iter().map(|&image| (image, image.sign(parity, mirror))).collect();
        let folded: Vec<(Vec<usize>, CMat)> = (0..blocks.len())
            .map(|corner| self.folded(corner, &blocks[corner], parity, mirror))
            .collect();
        let count = self.mesh.panels.len() * PER_PANEL;
        let mut entries = self.kernel_matrix(media, &characters);
        let mut matrix = MatMut::from_column_major_slice_mut(&mut entries, count, count);
        for (panels, block) in &folded {
            multiply_columns(matrix.rb_mut(), panels, block);
        }
        for i in 0..count {
            matrix[(i, i)] += 1.0;
        }
        let mut densities = self.right_hand_side(media, parity, mirror, light);
        solve_in_memory(matrix, densities.as_mut());
        drop(entries);
        for (panels, block) in &folded {
            multiply_rows(densities.as_mut(), panels, block);
        }
        densities
    }

    /// A corner's block for the panels that the mesh holds: images are added with their sign.
    fn folded(&self, corner: usize, block: &CMat, parity: f64, mirror: f64) -> (Vec<usize>, CMat) {
        let corner = &self.mesh.corners[corner];
        let held: Vec<(usize, usize)> = corner
            .panels
            .iter()
            .enumerate()
            .filter_map(|(place, panel)| panel.map(|panel| (place, panel)))
            .collect();
        let sign = corner.reflection.map_or(0.0, |image| image.sign(parity, mirror));
        let opposite = |place: usize| corner.panels.len() - 1 - place;
        let size = held.len() * PER_PANEL;
        let mut folded = CMat::zeros(size, size);
        for (a, &(row, _)) in held.iter().enumerate() {
            for (b, &(column, _)) in held.iter().enumerate() {
                for i in 0..PER_PANEL {
                    for j in 0..PER_PANEL {
                        let mut value = block[(row * PER_PANEL + i, column * PER_PANEL + j)];
                        if sign != 0.0 {
                            // An image is travelled the other way.
                            let (density, node) = (j / NODES, j % NODES);
                            let reversed = density * NODES + (NODES - 1 - node);
                            let at = opposite(column) * PER_PANEL + reversed;
                            value += sign * block[(row * PER_PANEL + i, at)];
                        }
                        folded[(a * PER_PANEL + i, b * PER_PANEL + j)] = value;
                    }
                }
            }
        }
        (held.into_iter().map(|(_, panel)| panel).collect(), folded)
    }

    /// K° by columns.
    fn kernel_matrix(&self, media: &Media, characters: &[(Reflection, f64)]) -> Vec<Complex64> {
        let panels = &self.mesh.panels;
        let count = panels.len() * PER_PANEL;
        let mut entries = vec![Complex64::ZERO; count * count];
        entries.par_chunks_mut(count * PER_PANEL).enumerate().for_each(|(s, columns)| {
            for (t, target) in panels.iter().enumerate() {
                let mut block = Block::default();
                for &(image, sign) in characters {
                    if !self.mesh.is_one_corner(t, s, image) {
                        add(media, target, &panels[s], image, sign, &mut block);
                    }
                }
                for_each(&block, |row, column, value| {
                    columns[column * count + t * PER_PANEL + row] = value;
                });
            }
        });
        entries
    }

    /// Field of the light at the nodes and its normal derivative, of one parity.
    fn right_hand_side(&self, media: &Media, parity: f64, mirror: f64, light: &Light) -> CMat {
        let count = self.mesh.panels.len() * PER_PANEL;
        let share = 1.0 / self.parities().len() as f64;
        let columns = match light {
            Light::Lines(places) => places.len(),
            Light::Planes(angles) => angles.len(),
        };
        let at = |column: usize, image: Reflection, node: &Node| match light {
            Light::Lines(places) => {
                line_source(media.index[0], node.point, node.normal, image.of(places[column]))
            }
            Light::Planes(angles) => {
                let (x, z) = angles[column].sin_cos();
                plane_wave(media.index[1], node.point, node.normal, image.of([x, z]))
            }
        };
        let mut out = CMat::zeros(count, columns);
        for column in 0..columns {
            for (p, panel) in self.mesh.panels.iter().enumerate() {
                for (i, node) in panel.nodes.iter().enumerate() {
                    let mut sum = [Complex64::ZERO; 2];
                    for &image in &self.mesh.images {
                        let sign = image.sign(parity, mirror) * share;
                        let [field, derivative] = at(column, image, node);
                        sum[0] += sign * field;
                        sum[1] += sign * derivative;
                    }
                    out[(p * PER_PANEL + i, column)] = sum[0];
                    out[(p * PER_PANEL + NODES + i, column)] = sum[1] * media.second();
                }
            }
        }
        out
    }
}

/// exp(ik d·x) of unit direction d and its derivative along `normal` at x.
fn plane_wave(k: f64, x: [f64; 2], normal: [f64; 2], d: [f64; 2]) -> [Complex64; 2] {
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let wave = Complex64::from_polar(1.0, k * dot(d, x));
    [wave, Complex64::new(0.0, k * dot(d, normal)) * wave]
}

/// (i/4) H0(k|x - s|) and its derivative along `normal` at x.
fn line_source(k: f64, x: [f64; 2], normal: [f64; 2], s: [f64; 2]) -> [Complex64; 2] {
    let d = [x[0] - s[0], x[1] - s[1]];
    let r = d[0].hypot(d[1]);
    let b = Bessel::at(k * r);
    let along = (normal[0] * d[0] + normal[1] * d[1]) / r;
    [Complex64::new(-0.25 * b.y0, 0.25 * b.j0), Complex64::new(b.y1, -b.j1) * (0.25 * k * along)]
}

fn rows_of(panels: &[usize]) -> Vec<usize> {
    panels.iter().flat_map(|p| p * PER_PANEL..(p + 1) * PER_PANEL).collect()
}

/// M[:, panels] = M[:, panels] R.
fn multiply_columns(mut matrix: MatMut<Complex64>, panels: &[usize], block: &CMat) {
    let columns = rows_of(panels);
    let held = CMat::from_fn(matrix.nrows(), columns.len(), |i, j| matrix[(i, columns[j])]);
    let product = held * block;
    for (j, &column) in columns.iter().enumerate() {
        matrix.rb_mut().col_mut(column).copy_from(product.col(j));
    }
}

/// M[panels, :] = R M[panels, :].
fn multiply_rows(mut matrix: MatMut<Complex64>, panels: &[usize], block: &CMat) {
    let rows = rows_of(panels);
    let held = CMat::from_fn(rows.len(), matrix.ncols(), |i, j| matrix[(rows[i], j)]);
    let product = block * held;
    for (i, &row) in rows.iter().enumerate() {
        matrix.rb_mut().row_mut(row).copy_from(product.row(i));
    }
}

/// Factorises the matrix in its own memory and solves for all right-hand sides.
fn solve_in_memory(mut matrix: MatMut<Complex64>, mut right: MatMut<Complex64>) {
    let (n, k) = (matrix.nrows(), right.ncols());
    let (mut forward, mut backward) = (vec![0_usize; n], vec![0_usize; n]);
    let factor = lu_in_place_scratch::<usize, Complex64>(n, n, Par::Seq, Spec::default());
    let solve = solve_in_place_scratch::<usize, Complex64>(n, k, Par::Seq);
    let mut memory = MemBuffer::new(factor.or(solve));
    let stack = MemStack::new(&mut memory);
    let (_, permutation) =
        lu_in_place(matrix.rb_mut(), &mut forward, &mut backward, Par::Seq, stack, Spec::default());
    solve_in_place(matrix.rb(), matrix.rb(), permutation, right.rb_mut(), Par::Seq, stack);
}
