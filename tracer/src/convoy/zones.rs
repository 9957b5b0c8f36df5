// SPDX-License-Identifier: MIT OR Apache-2.0
//! In which zone of a sphere a height lies.

/// Zones of a sphere from top to bottom.
pub(super) struct Zones {
    /// Lower bounds of all but the last.
    cuts: Vec<f64>,
    /// The zone at the upper end of each cell of the root of the depth below the top.
    cells: Vec<u32>,
    per_root: f64,
    top: f64,
}

impl Zones {
    pub fn new(cuts: &[f64], [low, top]: [f64; 2]) -> Self {
        let count = 8 * (cuts.len() + 1);
        let per_root = count as f64 / (top - low).sqrt();
        let cells = (0..=count).map(|cell| {
            let root = cell as f64 / per_root;
            cuts.partition_point(|&cut| top - root * root < cut) as u32
        });
        Self {
            cells: cells.collect(),
            cuts: cuts.to_vec(),
            per_root,
            top,
        }
    }

    /// The zone at a height.
    #[inline]
    pub fn find(&self, z: f64) -> usize {
        let cell = ((self.top - z).max(0.0).sqrt() * self.per_root) as usize;
        let mut zone = self.cells[cell.min(self.cells.len() - 1)] as usize;
        while zone < self.cuts.len() && z < self.cuts[zone] {
            zone += 1;
        }
        while zone > 0 && z >= self.cuts[zone - 1] {
            zone -= 1;
        }
        zone
    }
}
