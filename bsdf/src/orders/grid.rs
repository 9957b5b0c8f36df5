// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which incident wavevectors a table holds, and where in its arrays each of them lies.
//!
//! In: period, wavelength, the two indices, kx nodes per Brillouin zone, ky nodes. Out: existence of nodes, orders that
//! propagate at them, ranges of array entries. All kx, incoming and outgoing, are multiples of the spacing, half a spacing beside them where a zone has an odd
//! number of nodes; so which order propagates where is decided in integers once the rim of each row is known.

use super::Row;
use crate::direction::Side;
use crate::error::Error;
use crate::scatter::Polarization;
use std::ops::Range;

/// Most nodes a table may have, and most orders of all nodes together: beyond any use, and small enough to allocate.
const MOST_NODES: f64 = 4e6;
const MOST_ENTRIES: f64 = 1e8;
/// Highest refractive index of any use.
const HIGHEST_INDEX: f64 = 100.0;
/// Cells of |ky| in which the search for its rows begins.
const KY_CELLS: usize = 512;
/// Highest relative order that the layout can number.
const HIGHEST_ORDER: f64 = 16_000.0;

/// Incident tangential wavevectors of a table, in units of the vacuum wavenumber.
///
/// Along t they are `kx_i = (i + offset) (λ/Λ) / kx_per_zone` for every integer i, with an offset of 0 for an even and 1/2
/// for an odd number of nodes per zone, so that half a zone is among them; along b those of `ky`, each standing for both signs. On a side of index n a node exists if and only if `kx² + ky² < n²`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Period of the relief, in any unit.
    pub period: f64,
    /// Vacuum wavelength, in the same unit.
    pub wavelength: f64,
    /// Refractive index of the inner side (z < 0).
    pub index_inner: f64,
    /// Refractive index of the outer side (z > 0).
    pub index_outer: f64,
    /// Nodes along kx in one Brillouin zone, that is per λ/Λ; at least 1.
    pub kx_per_zone: usize,
    /// Nodes along ky: ascending, not negative, none equal to the lower of the two indices.
    pub ky: Vec<f64>,
}

/// One incident wavevector of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId {
    /// Side the light comes from.
    pub side: Side,
    /// Index of kx, any sign.
    pub kx_index: i64,
    /// Index into the grid's `ky`.
    pub ky_index: usize,
}

impl Grid {
    /// Refractive index of a side.
    #[must_use]
    pub fn index(&self, side: Side) -> f64 {
        match side {
            Side::Inner => self.index_inner,
            Side::Outer => self.index_outer,
        }
    }

    /// Width of a Brillouin zone, λ/Λ: the step of kx from one order to the next.
    #[must_use]
    pub fn zone(&self) -> f64 {
        self.wavelength / self.period
    }

    /// Part of their spacing by which the nodes of kx lie beside 0: 0 for an even number to a zone, 1/2 for an odd one.
    #[must_use]
    pub fn kx_offset(&self) -> f64 {
        if self.kx_per_zone.is_multiple_of(2) {
            0.0
        } else {
            0.5
        }
    }

    /// Index of the node at -kx.
    #[must_use]
    pub fn mirror(&self, kx_index: i64) -> i64 {
        if self.kx_per_zone.is_multiple_of(2) {
            -kx_index
        } else {
            -1 - kx_index
        }
    }

    /// kx of the node index `kx_index`. Indices 0 to `kx_per_zone - 1` make up one zone, and order m of the Bloch
    /// wavevector `kx(i)` is the node `i + m · kx_per_zone`.
    #[must_use]
    pub fn kx(&self, kx_index: i64) -> f64 {
        (kx_index as f64 + self.kx_offset()) * self.zone() / self.kx_per_zone as f64
    }

    /// The |ky| at which the side of lower index closes; the interpolation is cut there.
    #[must_use]
    pub fn critical_ky(&self) -> f64 {
        self.index_inner.min(self.index_outer)
    }

    /// Indices of kx of the nodes in the row `ky_index` of `side`; may be empty.
    #[must_use]
    pub fn kx_indices(&self, side: Side, ky_index: usize) -> Range<i64> {
        let (n, ky) = (self.index(side), self.ky[ky_index]);
        let inside = |i: i64| {
            let kx = self.kx(i);
            kx * kx + ky * ky < n * n
        };
        let rim = (n * n - ky * ky).max(0.0).sqrt();
        // An estimate from the root, then the definition itself decides.
        let spacing = self.zone() / self.kx_per_zone as f64;
        let mut end = (rim / spacing + 1.0 - self.kx_offset()).floor() as i64;
        while end > 0 && !inside(end - 1) {
            end -= 1;
        }
        while inside(end) {
            end += 1;
        }
        if end == 0 {
            0..0
        } else {
            self.mirror(end - 1)..end
        }
    }

    /// Whether the node exists.
    #[must_use]
    pub fn exists(&self, node: NodeId) -> bool {
        node.ky_index < self.ky.len()
            && self
                .kx_indices(node.side, node.ky_index)
                .contains(&node.kx_index)
    }

    /// Number of nodes, both sides together.
    #[must_use]
    pub fn node_count(&self) -> usize {
        let rows = Side::BOTH
            .into_iter()
            .flat_map(|side| (0..self.ky.len()).map(move |j| (side, j)));
        rows.map(|(side, j)| self.kx_indices(side, j).count()).sum()
    }

    /// All nodes: inner side first, by ky, then by kx ascending.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> + '_ {
        Side::BOTH.into_iter().flat_map(move |side| {
            (0..self.ky.len()).flat_map(move |ky_index| {
                let each = self.kx_indices(side, ky_index);
                each.map(move |kx_index| NodeId {
                    side,
                    kx_index,
                    ky_index,
                })
            })
        })
    }

    /// Rows of the whole grid from a function of (side, kx, ky, polarisation): a closed form, or a solver asked
    /// one incidence at a time.
    pub fn rows<'a, F>(&'a self, mut shares: F) -> impl Iterator<Item = Row> + 'a
    where
        F: FnMut(Side, f64, f64, Polarization) -> Vec<(Side, i32, f64)> + 'a,
    {
        let both = [Polarization::S, Polarization::P];
        self.nodes()
            .flat_map(move |node| both.map(|polarization| (node, polarization)))
            .map(move |(node, polarization)| Row {
                side: node.side,
                kx_index: node.kx_index,
                ky_index: node.ky_index,
                polarization,
                shares: shares(
                    node.side,
                    self.kx(node.kx_index),
                    self.ky[node.ky_index],
                    polarization,
                ),
            })
    }

    /// `count` ≥ 2 useful ky nodes: shared out between the range below the critical ky and the one above it (if the indices
    /// differ), from 0 on, crowding where the shares vary as a square root: at the critical ky and at the rim.
    #[must_use]
    pub fn ky_nodes(index_inner: f64, index_outer: f64, count: usize) -> Vec<f64> {
        let (low, high) = (index_inner.min(index_outer), index_inner.max(index_outer));
        let above =
            (((high - low) / high * count as f64).round() as usize).min(count.saturating_sub(1));
        let below = count - above;
        let lower = (0..below)
            .map(|j| low * (std::f64::consts::FRAC_PI_2 * j as f64 / (below as f64 - 0.5)).sin());
        let upper = (0..above).map(|j| {
            let phase = std::f64::consts::PI * (j as f64 + 0.5) / above as f64;
            low + (high - low) * 0.5 * (1.0 - phase.cos())
        });
        lower.chain(upper).collect()
    }

    /// Checks everything that the rest of the crate relies on.
    ///
    /// # Errors
    /// If a length or an index is not positive and finite, the ky nodes are not ascending, or the grid is empty or too large.
    pub fn validate(&self) -> Result<(), Error> {
        Error::check_length("period of a table", self.period)?;
        Error::check_length("wavelength of a table", self.wavelength)?;
        Error::check_index("inner side of a table", self.index_inner)?;
        Error::check_index("outer side of a table", self.index_outer)?;
        let refuse = |text: String| Err(Error::Grid(text));
        let highest = self.index_inner.max(self.index_outer);
        if highest > HIGHEST_INDEX {
            return refuse(format!(
                "expected refractive indices up to {HIGHEST_INDEX}, got {highest}"
            ));
        }
        if self.kx_per_zone == 0 {
            return refuse("expected at least 1 kx node per zone, got 0".to_owned());
        }
        if self.ky.is_empty() || self.ky.len() > usize::from(u16::MAX) {
            return refuse(format!(
                "expected 1 to {} ky nodes, got {}",
                u16::MAX,
                self.ky.len()
            ));
        }
        if !self.ky.iter().all(|ky| ky.is_finite() && *ky >= 0.0)
            || !self.ky.is_sorted_by(|a, b| a < b)
        {
            return refuse(format!(
                "expected ky nodes not negative and ascending, got {:?}",
                self.ky
            ));
        }
        if self.ky.contains(&self.critical_ky()) {
            let critical = self.critical_ky();
            return refuse(format!(
                "expected no ky node at the critical {critical}, where one side closes"
            ));
        }
        let orders = 2.0 * highest / self.zone();
        if orders.is_nan() || orders >= HIGHEST_ORDER {
            return refuse(format!(
                "expected fewer than {HIGHEST_ORDER} propagating orders, got {orders}"
            ));
        }
        // Bounds from reals first: kx_indices walks, and must not walk far.
        let across = (orders + 2.0) * self.kx_per_zone as f64;
        let nodes = 2.0 * across * self.ky.len() as f64;
        if nodes >= MOST_NODES || nodes * 2.0 * (orders + 2.0) >= MOST_ENTRIES {
            return refuse(format!(
                "too large: about {nodes} nodes of up to {} orders",
                2.0 * orders
            ));
        }
        for side in Side::BOTH {
            if self.kx_indices(side, 0).is_empty() {
                let ky = self.ky[0];
                return refuse(format!(
                    "expected nodes from the {side} side, got none at the lowest ky {ky}"
                ));
            }
        }
        Ok(())
    }
}

/// Place of one node's orders in the arrays. Inner orders come first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// Entry of its first order.
    pub first: u32,
    /// Lowest relative order on the inner and the outer side.
    pub lowest: [i16; 2],
    /// Number of orders on the inner and the outer side.
    pub count: [u16; 2],
}

impl Node {
    /// Entries of the orders that leave on `side`.
    pub fn entries(&self, side: Side) -> Range<usize> {
        let inner_end = self.first as usize + usize::from(self.count[0]);
        match side {
            Side::Inner => self.first as usize..inner_end,
            Side::Outer => inner_end..inner_end + usize::from(self.count[1]),
        }
    }

    /// Entries of all orders.
    pub fn all(&self) -> Range<usize> {
        let first = self.first as usize;
        first..first + usize::from(self.count[0]) + usize::from(self.count[1])
    }

    /// Entry, side and relative order of all orders.
    pub fn orders(self) -> impl Iterator<Item = (usize, Side, i32)> {
        Side::BOTH.into_iter().flat_map(move |side| {
            self.entries(side).enumerate().map(move |(k, entry)| {
                (entry, side, i32::from(self.lowest[side.index()]) + k as i32)
            })
        })
    }

    /// Entry of relative order `order` on `side`, if it is stored.
    pub fn entry(&self, side: Side, order: i32) -> Option<usize> {
        let entries = self.entries(side);
        let k = i64::from(order) - i64::from(self.lowest[side.index()]);
        (0..entries.len() as i64)
            .contains(&k)
            .then(|| entries.start + k as usize)
    }
}

/// One row of a side: all nodes of one ky.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KyRow {
    pub ky: f64,
    /// 1 / distance to the next ky; 0 where interpolation ends.
    pub per_gap: f64,
    /// Index of its lowest kx, and one more than that of its highest.
    pub kx: [i32; 2],
    /// Position of the node kx index 0 in the list of nodes; where the row is empty, of the next.
    pub origin: u32,
}

/// Places of all nodes.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub nodes: Vec<Node>,
    /// Rows of the inner side, then of the outer side, by ky.
    pub rows: [Vec<KyRow>; 2],
    /// Number of ky nodes below the critical ky.
    pub below: usize,
    /// The critical ky.
    critical: f64,
    /// The ky nodes, and how many of them lie at or below the lower end of each of even cells.
    ky: Vec<f64>,
    ky_cells: Vec<u16>,
    cells_per_ky: f64,
    pub entries: usize,
    /// Width of a Brillouin zone.
    pub zone: f64,
    /// Nodes per unit of kx.
    pub nodes_per_kx: f64,
    /// [`Grid::kx_offset`].
    pub kx_offset: f64,
}

impl Layout {
    /// Layout of a grid that has been validated.
    pub fn new(grid: &Grid) -> Self {
        let per_zone = grid.kx_per_zone as i64;
        let mut nodes = Vec::new();
        let mut entries = 0;
        let indices: [Vec<Range<i64>>; 2] = Side::BOTH.map(|side| {
            (0..grid.ky.len())
                .map(|j| grid.kx_indices(side, j))
                .collect()
        });
        let below = grid.ky.partition_point(|ky| *ky < grid.critical_ky());
        let highest = grid.index_inner.max(grid.index_outer);
        let cells_per_ky = KY_CELLS as f64 / highest;
        let rows = Side::BOTH.map(|side| {
            (0..grid.ky.len())
                .map(|j| {
                    let own = indices[side.index()][j].clone();
                    let origin = (nodes.len() as i64 - own.start) as u32;
                    for i in own.clone() {
                        // Order l propagates if the node index i + l · per_zone is one of its side.
                        let range = [0, 1].map(|to: usize| {
                            let there = &indices[to][j];
                            (
                                -((i - there.start).div_euclid(per_zone)),
                                (there.end - 1 - i).div_euclid(per_zone),
                            )
                        });
                        let count = range.map(|(low, high)| (high - low + 1).max(0));
                        nodes.push(Node {
                            first: entries as u32,
                            lowest: range.map(|(low, _)| low as i16),
                            count: count.map(|c| c as u16),
                        });
                        entries += (count[0] + count[1]) as usize;
                    }
                    let next = if j + 1 == below {
                        None
                    } else {
                        grid.ky.get(j + 1)
                    };
                    KyRow {
                        ky: grid.ky[j],
                        per_gap: next.map_or(0.0, |next| 1.0 / (next - grid.ky[j])),
                        kx: [own.start as i32, own.end as i32],
                        origin,
                    }
                })
                .collect()
        });
        Self {
            nodes,
            rows,
            below,
            critical: grid.critical_ky(),
            ky_cells: (0..=KY_CELLS)
                .map(|cell| {
                    let from = cell as f64 / cells_per_ky;
                    grid.ky.partition_point(|ky| *ky <= from) as u16
                })
                .collect(),
            cells_per_ky,
            ky: grid.ky.clone(),
            entries,
            zone: grid.zone(),
            nodes_per_kx: grid.kx_per_zone as f64 / grid.zone(),
            kx_offset: grid.kx_offset(),
        }
    }

    /// The rows between which a |ky| lies; the same one twice where interpolation ends.
    #[inline]
    pub fn rows_around(&self, ky: f64) -> (usize, usize) {
        let cell = ((ky * self.cells_per_ky) as usize).min(KY_CELLS);
        let mut above = usize::from(self.ky_cells[cell]);
        while above < self.ky.len() && self.ky[above] <= ky {
            above += 1;
        }
        // The cell may begin above by rounding.
        while above > 0 && self.ky[above - 1] > ky {
            above -= 1;
        }
        // Rows on the query's side of the critical ky only.
        let (start, end) = if (ky < self.critical && self.below > 0) || self.below == self.ky.len()
        {
            (0, self.below)
        } else {
            (self.below, self.ky.len())
        };
        (above.max(start + 1) - 1, above.min(end - 1))
    }

    /// Position of a node in the list.
    pub fn find(&self, node: NodeId) -> Option<usize> {
        let row = self.rows[node.side.index()].get(node.ky_index)?;
        let [start, end] = row.kx.map(i64::from);
        (start..end)
            .contains(&node.kx_index)
            .then(|| (i64::from(row.origin) + node.kx_index) as usize)
    }

    /// Memory taken, in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Node>() * self.nodes.len()
            + size_of::<KyRow>() * (self.rows[0].len() + self.rows[1].len())
            + 2 * self.ky_cells.len()
            + 8 * self.ky.len()
    }
}
