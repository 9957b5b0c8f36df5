// SPDX-License-Identifier: MIT OR Apache-2.0
//! The linear equations of a body for one polarisation.

use crate::compression::{CMat, PER_PANEL};
use crate::coupling::Coupling;
use crate::mesh::Mesh;
use crate::quadrature::NODES;
use crate::tile::{Skeletons, Tile};

/// Equations (1 + K° R) ρ' = f of one polarisation, for light of each parity in x.
pub(crate) struct System<'a> {
    pub coupling: Coupling<'a>,
    pub parities: &'static [f64],
    pub groups: Vec<Group>,
    pub tiles: &'a [Tile],
    pub skeletons: &'a [Skeletons],
    /// Error of the solution, relative to its norm, at which refinement ends.
    pub target: f64,
}

/// Panels of one corner with its block R for each parity.
pub(crate) struct Group {
    pub panels: Vec<usize>,
    pub blocks: Vec<CMat>,
}

impl<'a> System<'a> {
    /// Joins the kernels, the compressed `blocks` of the corners, and tiles with their skeletons.
    pub fn new(
        coupling: Coupling<'a>,
        parities: &'static [f64],
        blocks: &[CMat],
        (tiles, skeletons): (&'a [Tile], &'a [Skeletons]),
        target: f64,
    ) -> Self {
        let mesh = coupling.mesh;
        let group = |(corner, block): (usize, &CMat)| Group {
            panels: mesh.corners[corner].panels.into_iter().flatten().collect(),
            blocks: parities
                .iter()
                .map(|&parity| folded(mesh, corner, block, parity, coupling.mirror))
                .collect(),
        };
        let groups = blocks.iter().enumerate().map(group).collect();
        Self { coupling, parities, groups, tiles, skeletons, target }
    }

    /// Number of unknowns of one parity.
    pub fn size(&self) -> usize {
        self.coupling.mesh.panels.len() * PER_PANEL
    }
}

/// Folds a corner's block to the panels that the mesh holds: images are added with their sign.
fn folded(mesh: &Mesh, corner: usize, block: &CMat, parity: f64, mirror: f64) -> CMat {
    let corner = &mesh.corners[corner];
    let held: Vec<usize> =
        (0..corner.panels.len()).filter(|&place| corner.panels[place].is_some()).collect();
    let sign = corner.reflection.map_or(0.0, |image| image.sign(parity, mirror));
    let size = held.len() * PER_PANEL;
    CMat::from_fn(size, size, |i, j| {
        let row = held[i / PER_PANEL] * PER_PANEL + i % PER_PANEL;
        let (place, column) = (held[j / PER_PANEL], j % PER_PANEL);
        let mut value = block[(row, place * PER_PANEL + column)];
        if sign != 0.0 {
            // An image is travelled the other way.
            let (density, node) = (column / NODES, column % NODES);
            let reversed = density * NODES + (NODES - 1 - node);
            let opposite = corner.panels.len() - 1 - place;
            value += sign * block[(row, opposite * PER_PANEL + reversed)];
        }
        value
    })
}
