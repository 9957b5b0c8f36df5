// SPDX-License-Identifier: MIT OR Apache-2.0
//! Zones of a sphere by height, for all rays together: a guess from a table and one comparison.

#![expect(
    clippy::inline_always,
    reason = "a call within the loop would keep it from being compiled to wide instructions"
)]

use pulp::{Simd, WithSimd};

use super::lanes::{LANES, Lane, Lanes};
use crate::conversion::whole;

/// Most cuts between zones that are compared together, and cells of the root of the depth below the
/// top.
const CUTS: usize = 512;
const CELLS: usize = 4096;

/// Zones of a sphere from top to bottom.
pub(super) struct Zones {
    /// Lower bounds of all but the last.
    cuts: Vec<f64>,
    per_root: f64,
    top: f64,
    table: Option<Table>,
}

/// The cuts, the unused ones below everything, and the number of those surely above each cell.
struct Table {
    cuts: Box<[f64; CUTS]>,
    cells: Box<[u32; CELLS]>,
}

impl Zones {
    pub fn new(cuts: &[f64], [low, top]: [f64; 2]) -> Self {
        let mut zones = Self {
            cuts: cuts.to_vec(),
            per_root: (CELLS - 1) as f64 / (top - low).sqrt(),
            top,
            table: None,
        };
        zones.table = zones.table();
        zones
    }

    /// `None` if a cell holds more than one cut.
    fn table(&self) -> Option<Table> {
        if self.cuts.len() >= CUTS {
            return None;
        }
        let mut cuts = Box::new([f64::NEG_INFINITY; CUTS]);
        cuts[..self.cuts.len()].copy_from_slice(&self.cuts);
        // A little higher, so that rounding never begins too low.
        let at = |cell: usize, slack: f64| {
            let root = cell as f64 * slack / self.per_root;
            self.alone(self.top - root * root) as u32
        };
        let cells = Box::new(std::array::from_fn(|cell| at(cell, 1.0 - 1e-12)));
        let mut cells_below = (1..CELLS).map(|cell| at(cell, 1.0 + 1e-12));
        let single = cells
            .iter()
            .all(|cell| cells_below.next().is_none_or(|below| below.saturating_sub(*cell) <= 1));
        single.then_some(Table { cuts, cells })
    }

    /// The zone at a height, by itself.
    fn alone(&self, z: f64) -> usize {
        self.cuts.partition_point(|cut| z < *cut)
    }

    /// The zones at the heights at which all rays meet the dome, as their primitives.
    pub fn find(&self, lanes: &mut Lanes) {
        match &self.table {
            _ if self.cuts.is_empty() => {}
            Some(table) => pulp::Arch::new().dispatch(Find { zones: self, table, lanes }),
            None => {
                for lane in 0..LANES {
                    lanes.dome_primitive[lane] = self.alone(lanes.height[lane]) as i64;
                }
            }
        }
    }
}

/// Finds the zones of all rays.
struct Find<'a> {
    zones: &'a Zones,
    table: &'a Table,
    lanes: &'a mut Lanes,
}

impl WithSimd for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let (zones, table) = (self.zones, self.table);
        find(
            (zones.top, zones.per_root),
            &table.cuts,
            &table.cells,
            &self.lanes.height,
            &mut self.lanes.dome_primitive,
        );
    }
}

/// Arrays that are arguments of their own are known not to overlap.
#[inline(always)]
fn find(
    (top, per_root): (f64, f64),
    cuts: &[f64; CUTS],
    cells: &[u32; CELLS],
    height: &Lane,
    zone: &mut [i64; LANES],
) {
    let max = (CELLS - 1) as f64;
    for lane in 0..LANES {
        let depth = top - height[lane];
        let root = if depth > 0.0 { depth.sqrt() } else { 0.0 } * per_root;
        zone[lane] = whole(if root < max { root } else { max });
    }
    for lane in 0..LANES {
        let guess = i64::from(cells[zone[lane] as usize & (CELLS - 1)]);
        let next = height[lane] < cuts[guess as usize & (CUTS - 1)];
        zone[lane] = guess + i64::from(next);
    }
}
