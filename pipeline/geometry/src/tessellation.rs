// SPDX-License-Identifier: MIT OR Apache-2.0
//! Triangles in the place of a smooth surface, with its normals at their corners.
//!
//! In: cells of a surface, smooth each, by point and normal. Out: every cell in quads, every quad in
//! four triangles about its middle, as many as keep points and normals of the surface within
//! [`SURFACE`] and [`NORMAL_DEG`]. On small cells the triangles together are farthest off in the
//! middle of an edge: both are measured there, first on the edges of all quads, then on the spokes
//! from their corners to their middles, which alone see a twist.

use std::fmt;

use glam::DVec3;
use serde::Serialize;

/// Largest distance of triangles from their surface, as a share of its width.
pub const SURFACE: f64 = 1e-4;
/// Largest angle between the normals of a surface and those that light turns by, degrees.
pub const NORMAL_DEG: f64 = 0.02;
/// Most triangles of a surface.
pub const MAX_TRIANGLES: usize = 2_000_000;

/// Triangles, counter-clockwise as seen from outside.
#[derive(Debug, Clone)]
pub struct Tessellation {
    /// Corners, mm.
    pub triangles: Vec<[DVec3; 3]>,
    /// Unit normals of the surface at them.
    pub normals: Vec<[DVec3; 3]>,
    /// What triangles are off the surface.
    pub deviation: Deviation,
}

/// What is found and what is expected of a surface that cannot be.
pub type Refusal = [String; 2];

/// What triangles are off the surface that they stand for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// Number of the triangles.
    pub triangles: usize,
    /// Largest distance from the surface, mm.
    pub surface_mm: f64,
    /// Largest angle between normals, degrees.
    pub normal_deg: f64,
}

impl fmt::Display for Deviation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles, surface_mm, normal_deg } = self;
        let um = 1e3 * surface_mm;
        write!(f, "{triangles} triangles within {um:.3} um and {normal_deg:.4} degrees of it")
    }
}

impl Deviation {
    fn max(self, other: Self) -> Self {
        Self {
            triangles: self.triangles,
            surface_mm: self.surface_mm.max(other.surface_mm),
            normal_deg: self.normal_deg.max(other.normal_deg),
        }
    }

    /// The parts into which an edge is divided for it to be within the tolerances: deviations fall
    /// with the square of their number.
    fn parts(self, width_mm: f64) -> usize {
        let excess = (self.surface_mm / (SURFACE * width_mm)).max(self.normal_deg / NORMAL_DEG);
        if excess > 1.0 { (1.1 * excess.sqrt()).ceil() as usize } else { 1 }
    }
}

/// Cells of a surface, along two directions that with the outward normal are right-handed.
pub(super) struct Cells<'a> {
    pub counts: [usize; 2],
    /// True if the last cells along the second direction border the first ones.
    pub is_round: bool,
    /// Width of the surface, mm.
    pub width_mm: f64,
    /// Point and unit normal at shares of a cell.
    pub at: &'a dyn Fn([usize; 2], [f64; 2]) -> (DVec3, DVec3),
}

/// Quads of each cell: along the first direction by its row, along the second one the same in all.
struct Quads {
    rows: Vec<usize>,
    columns: usize,
}

impl Quads {
    /// Shares of a cell in row `i` at places in units of its quads.
    fn shares(&self, i: usize, [k, l]: [f64; 2]) -> [f64; 2] {
        [k / self.rows[i] as f64, l / self.columns as f64]
    }
}

impl Cells<'_> {
    /// Triangles within the tolerances.
    ///
    /// # Errors
    /// A surface that takes more than [`MAX_TRIANGLES`].
    pub fn tessellated(&self) -> Result<Tessellation, Refusal> {
        let mut quads = Quads { rows: vec![1; self.counts[0]], columns: 1 };
        loop {
            let count = 4 * quads.rows.iter().sum::<usize>() * quads.columns * self.counts[1];
            if count > MAX_TRIANGLES {
                let expected = format!(
                    "one that at most {MAX_TRIANGLES} triangles follow within {SURFACE:e} of its width and {NORMAL_DEG} degrees: fewer points or a smoother one"
                );
                return Err([format!("a surface of {count} triangles"), expected]);
            }
            let (mut along, mut across) = self.deviations(&quads);
            let most = |of: &[Deviation], across| of.iter().fold(across, |all, one| one.max(all));
            let edges = most(&along, across);
            if edges.parts(self.width_mm) == 1 {
                // A twist falls by dividing either way: both, so that quads keep their form.
                along = self.spokes(&quads);
                across = most(&along, across);
                if across.parts(self.width_mm) == 1 {
                    return Ok(self.triangles(&quads, across.max(edges)));
                }
            }
            for (row, of_row) in quads.rows.iter_mut().zip(along) {
                *row *= of_row.parts(self.width_mm);
            }
            quads.columns *= across.parts(self.width_mm);
        }
    }

    /// The cell of every quad and its place there; `more` places at the ends of each cell.
    fn places(&self, quads: &Quads, more: usize) -> impl Iterator<Item = ([usize; 2], [usize; 2])> {
        let (rows, columns) = (quads.rows.clone(), quads.columns + more);
        let [count, across] = self.counts;
        (0..count * across).flat_map(move |n| {
            let cell = [n / across, n % across];
            let places = 0..(rows[cell[0]] + more) * columns;
            places.map(move |n| (cell, [n / columns, n % columns]))
        })
    }

    /// Deviations along the first direction by row, and along the second one.
    fn deviations(&self, quads: &Quads) -> (Vec<Deviation>, Deviation) {
        let mut across = Deviation::default();
        let mut along = vec![across; quads.rows.len()];
        for (cell, [k, l]) in self.places(quads, 1) {
            let (i, [u, v]) = (cell[0], [k as f64, l as f64]);
            let [here, on, aside] =
                [[u, v], [u + 1.0, v], [u, v + 1.0]].map(|place| quads.shares(i, place));
            if k < quads.rows[i] {
                along[i] = along[i].max(self.edge(cell, [here, on]));
            }
            if l < quads.columns {
                across = across.max(self.edge(cell, [here, aside]));
            }
        }
        (along, across)
    }

    /// Deviations of the edges from the corners of quads to their middles, by row.
    fn spokes(&self, quads: &Quads) -> Vec<Deviation> {
        let mut found = vec![Deviation::default(); quads.rows.len()];
        for (cell, [k, l]) in self.places(quads, 0) {
            let (i, [u, v]) = (cell[0], [k as f64, l as f64]);
            let middle = quads.shares(i, [u + 0.5, v + 0.5]);
            for corner in [[u, v], [u + 1.0, v], [u + 1.0, v + 1.0], [u, v + 1.0]] {
                found[i] = found[i].max(self.edge(cell, [quads.shares(i, corner), middle]));
            }
        }
        found
    }

    /// Deviation in the middle of an edge of triangles.
    fn edge(&self, cell: [usize; 2], [from, to]: [[f64; 2]; 2]) -> Deviation {
        let middle = [0, 1].map(|axis| 0.5 * (from[axis] + to[axis]));
        let [start, end, middle] = [from, to, middle].map(|share| (self.at)(cell, share));
        if start.0 == end.0 {
            return Deviation::default();
        }
        let off = middle.0 - 0.5 * (start.0 + end.0);
        // The angle of two unit vectors by their difference: its cosine knows none below 1e-8.
        let turn = (start.1 + end.1).normalize_or(middle.1) - middle.1;
        let normal_deg = 2.0 * (0.5 * turn.length()).asin().to_degrees();
        Deviation { triangles: 0, surface_mm: off.dot(middle.1).abs(), normal_deg }
    }

    /// Point and normal at a corner of the quads of a cell: points of neighbouring cells are equal to
    /// the last bit.
    fn corner(&self, quads: &Quads, own: [usize; 2], [k, l]: [usize; 2]) -> (DVec3, DVec3) {
        let shares = quads.shares(own[0], [k as f64, l as f64]);
        let ([mut i, mut j], [mut s, mut t]) = (own, shares);
        if k == quads.rows[i] && i + 1 < self.counts[0] {
            (i, s) = (i + 1, 0.0);
        }
        if l == quads.columns && (self.is_round || j + 1 < self.counts[1]) {
            (j, t) = ((j + 1) % self.counts[1], 0.0);
        }
        ((self.at)([i, j], [s, t]).0, (self.at)(own, shares).1)
    }

    fn triangles(&self, quads: &Quads, deviation: Deviation) -> Tessellation {
        let mut made = Tessellation { triangles: Vec::new(), normals: Vec::new(), deviation };
        for (cell, [k, l]) in self.places(quads, 0) {
            let around = [[k, l], [k + 1, l], [k + 1, l + 1], [k, l + 1]]
                .map(|place| self.corner(quads, cell, place));
            let middle = quads.shares(cell[0], [k as f64 + 0.5, l as f64 + 0.5]);
            let middle = (self.at)(cell, middle);
            for side in 0..4 {
                let [from, to] = [around[side], around[(side + 1) % 4]];
                if from.0 != to.0 {
                    made.triangles.push([from.0, to.0, middle.0]);
                    made.normals.push([from.1, to.1, middle.1]);
                }
            }
        }
        made.deviation.triangles = made.triangles.len();
        made
    }
}
