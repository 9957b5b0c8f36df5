// SPDX-License-Identifier: MIT OR Apache-2.0
//! Kernels K° between parts of the outline, with all images, by side of the axis.
//!
//! Unknowns of nodes stand in groups of 16, first the fields of a group and then its derivatives: the
//! order of a panel.

use crate::compression::{CMat, PER_PANEL};
use crate::kernel::{Media, Pair, Pairs, kernels_of_panel};
use crate::mesh::Mesh;
use crate::panel::{Block, Node, add, for_each_column};
use crate::quadrature::NODES;
use num_complex::Complex64;
use rayon::prelude::*;

/// Matrices from images on the same side of the axis, and on the other: for light of a parity in x the
/// first and the parity times the second are added.
pub(crate) type Sides = [CMat; 2];

/// Outline, media and sign of the mirror's image, which make the kernels.
#[derive(Clone, Copy)]
pub(crate) struct Coupling<'a> {
    pub mesh: &'a Mesh,
    pub media: &'a Media,
    pub mirror: f64,
}

impl Coupling<'_> {
    /// Kernels from panel `source` to panel `target` without what joins two panels of one corner.
    pub fn sides(&self, target: usize, source: usize) -> Vec<Block> {
        let panels = &self.mesh.panels;
        let mut sides = vec![Block::default(); 2];
        for &image in &self.mesh.images {
            if !self.mesh.is_one_corner(target, source, image) {
                let sign = image.sign(1.0, self.mirror);
                let side = &mut sides[usize::from(image.x)];
                add(self.media, &panels[target], &panels[source], image, sign, side);
            }
        }
        sides
    }

    /// Kernels between panels, near or far.
    pub fn of_panels(&self, targets: &[usize], sources: &[usize]) -> Sides {
        let mut out = zeros(targets.len(), sources.len());
        let strips = sources.par_iter().map(|&source| self.strip(targets, source));
        for (number, strips) in strips.collect::<Vec<Sides>>().iter().enumerate() {
            for (out, strip) in out.iter_mut().zip(strips) {
                out.as_mut().subcols_mut(number * PER_PANEL, PER_PANEL).copy_from(strip);
            }
        }
        out
    }

    fn strip(&self, targets: &[usize], source: usize) -> Sides {
        let mut out = zeros(targets.len(), 1);
        for (t, &target) in targets.iter().enumerate() {
            for (out, block) in out.iter_mut().zip(&self.sides(target, source)) {
                for_each_column(block, |row, column, [re, im]| {
                    let rows = &mut out.col_as_slice_mut(column)[t * PER_PANEL + row..][..NODES];
                    for (i, value) in rows.iter_mut().enumerate() {
                        *value = Complex64::new(re[i], im[i]);
                    }
                });
            }
        }
        out
    }

    /// Kernels between nodes whose panels are far from each other and from each other's images. What
    /// an incomplete group lacks is 0.
    pub fn of_nodes(&self, targets: &[Node], sources: &[Node]) -> Sides {
        let mut out = zeros(targets.len().div_ceil(NODES), sources.len().div_ceil(NODES));
        for (j, from) in sources.iter().enumerate() {
            for &image in &self.mesh.images {
                let (point, normal) = (image.of(from.point), image.of(from.normal));
                let weight = image.sign(1.0, self.mirror) * from.weight;
                let out = &mut out[usize::from(image.x)];
                for (group, lanes) in targets.chunks(NODES).enumerate() {
                    let pairs = Pairs::new(|i| {
                        let to = &lanes[i.min(lanes.len() - 1)];
                        Pair::apart(to.point, to.normal, point, normal)
                    });
                    let entries = kernels_of_panel(self.media, &pairs);
                    for (row, columns) in entries.iter().enumerate() {
                        for (column, [re, im]) in columns.iter().enumerate() {
                            let column = out.col_as_slice_mut(place(j, column));
                            let rows = &mut column[place(group * NODES, row)..][..lanes.len()];
                            for (i, value) in rows.iter_mut().enumerate() {
                                *value += weight * Complex64::new(re[i], im[i]);
                            }
                        }
                    }
                }
            }
        }
        out
    }
}

fn zeros(targets: usize, sources: usize) -> Sides {
    [0, 1].map(|_| CMat::zeros(targets * PER_PANEL, sources * PER_PANEL))
}

/// Place of the field (0) or derivative (1) of a node among the unknowns.
pub(crate) fn place(node: usize, density: usize) -> usize {
    node / NODES * PER_PANEL + density * NODES + node % NODES
}
