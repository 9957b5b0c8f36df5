// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of several surfaces, asked for many rays at once.
//!
//! In: tables, and up to [`OrderDeck::MANY`] rays, number by number. Out: the same draws as [`OrderTable`] gives. The arrays have fixed sizes, so that
//! the loops need neither a branch nor a check; whoever calls them within a function for wide instructions has them compiled to such.

#![expect(
    clippy::inline_always,
    clippy::too_many_arguments,
    reason = "a call within a loop keeps it from being compiled to wide instructions, and so do arrays that might overlap: only those that are arguments of their own are known not to"
)]

use super::OrderTable;
use super::draw::{self, OrderSpot};
use super::urns::{Gap, Stack};
use crate::direction::{Side, Tangential};

/// Most tables, gaps and stacks of all of them, both sides, and cells of |ky|.
const TABLES: usize = 512;
const GAPS: usize = 16_384;
const STACKS: usize = 32_768;
const CELLS: usize = 65_536;

/// Rays that are asked for together.
const MANY: usize = 64;

/// One number for each ray.
type Lane = [f64; MANY];

/// The numbers of a table that do not depend on the node.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Numbers {
    cells_per_ky: f64,
    /// First cell, and first gap of the inner side; those of the outer side alternate with them.
    first_cell: f64,
    first_gap: f64,
    nodes_per_kx: f64,
    kx_offset: f64,
    per_zone: f64,
    zones_per_node: f64,
    zone: f64,
}

/// Tables of orders by the number of their surface.
#[derive(Debug)]
pub struct OrderDeck<'a> {
    tables: Vec<Option<&'a OrderTable>>,
    urns: Vec<&'a [u32]>,
    numbers: Box<[Numbers; TABLES]>,
    gaps: Box<[Gap; GAPS]>,
    stacks: Box<[Stack; STACKS]>,
    cells: Box<[u32; CELLS]>,
}

/// A full array of fixed size from the beginning of one; `None` if it has more.
fn fixed<T: Copy + Default, const N: usize>(mut list: Vec<T>) -> Option<Box<[T; N]>> {
    if list.len() > N {
        return None;
    }
    list.resize(N, T::default());
    list.into_boxed_slice().try_into().ok()
}

impl<'a> OrderDeck<'a> {
    /// The tables of the surfaces that have one; `None` if they are too many, or their rows too unevenly spaced, for such loops.
    #[must_use]
    pub fn new(tables: Vec<Option<&'a OrderTable>>) -> Option<Self> {
        let (mut gaps, mut stacks, mut cells) = (Vec::new(), Vec::new(), Vec::<u32>::new());
        let mut numbers = Vec::new();
        let mut known: Vec<(&[u32], usize)> = Vec::new();
        for table in &tables {
            let Some(table) = table else {
                numbers.push(Numbers::default());
                continue;
            };
            let urns = &table.urns;
            if !urns.single() {
                return None;
            }
            // Tables of one design often share their rows.
            let same = known.iter().find(|(other, _)| *other == &urns.cells[..]);
            let first_cell = if let Some((_, first)) = same {
                *first
            } else {
                known.push((&urns.cells, cells.len()));
                cells.extend(&urns.cells);
                cells.len() - urns.cells.len()
            };
            numbers.push(Numbers {
                cells_per_ky: urns.cells_per_ky,
                first_cell: first_cell as f64,
                first_gap: gaps.len() as f64,
                nodes_per_kx: table.layout.nodes_per_kx,
                kx_offset: table.layout.kx_offset,
                per_zone: f64::from(urns.per_zone),
                zones_per_node: 1.0 / f64::from(urns.per_zone),
                zone: table.layout.zone,
            });
            let first = Side::BOTH.map(|side| {
                let first = stacks.len() as f64;
                stacks.extend(&urns.stacks[side.index()]);
                first
            });
            for pair in urns.gaps[0].iter().zip(&urns.gaps[1]) {
                for (gap, first) in <[&Gap; 2]>::from(pair).into_iter().zip(first) {
                    let stacks = gap.stacks.map(|stack| first + stack);
                    gaps.push(Gap { stacks, ..*gap });
                }
            }
        }
        let urns = |table: Option<&'a OrderTable>| table.map_or(&[][..], |t| &t.urns.list);
        Some(Self {
            urns: tables.iter().copied().map(urns).collect(),
            tables,
            numbers: fixed(numbers)?,
            gaps: fixed(gaps)?,
            stacks: fixed(stacks)?,
            cells: fixed(cells)?,
        })
    }

    /// Rays that are asked for together.
    pub const MANY: usize = MANY;

    /// As [`OrderTable::locate`] for rays that meet the table of `surface`, from the inner side where `inside` is above 0, with tangential wavevectors
    /// (kx, ky) and two numbers each. Rays that meet no table get spots without meaning.
    #[inline(always)]
    pub fn locate(
        &self,
        surface: &[i64; MANY],
        inside: &Lane,
        [kx, ky]: &[Lane; 2],
        [u, v]: &[Lane; 2],
        spots: &mut OrderSpots,
    ) {
        locate(
            (&self.numbers, &self.cells),
            &self.gaps,
            &self.stacks,
            surface,
            inside,
            (kx, ky),
            (u, v),
            spots,
        );
    }

    /// The same where not all nodes around the wavevector exist.
    #[cold]
    #[must_use]
    pub fn locate_alone(
        &self,
        surface: usize,
        side: Side,
        k: Tangential,
        chances: [f64; 2],
    ) -> OrderSpot {
        let Some(table) = self.tables[surface] else {
            return OrderSpot::default();
        };
        let mut spot = table.locate(side, k, chances);
        let first = self.gaps[self.numbers[surface].first_gap as usize + side.index()].stacks[0];
        spot.stack += first - table.urns.gaps[side.index()][0].stacks[0];
        spot
    }

    /// Reads the urn of a spot of the table of a surface.
    #[inline]
    #[must_use]
    pub fn urn(&self, surface: i64, urn: f64) -> u32 {
        self.urns[surface as usize][urn as i64 as usize]
    }

    /// The orders drawn from the urns that were read, and the kx to which they lead.
    #[inline(always)]
    pub fn orders(
        &self,
        surface: &[i64; MANY],
        spots: &OrderSpots,
        read: &[u32; MANY],
        kx: &Lane,
        drawn: &mut DrawnOrders,
    ) {
        orders(&self.numbers, &self.stacks, surface, spots, read, kx, drawn);
    }

    /// The table of a surface.
    #[must_use]
    pub fn table(&self, surface: usize) -> Option<&'a OrderTable> {
        self.tables[surface]
    }
}

/// Where the draws of many rays have come to: an [`OrderSpot`] each, number by number.
#[derive(Clone, Debug)]
pub struct OrderSpots {
    urn: Lane,
    own: Lane,
    part: Lane,
    stack: Lane,
    zone: Lane,
    found: Lane,
}

impl Default for OrderSpots {
    fn default() -> Self {
        let zero = [0.0; MANY];
        Self {
            urn: zero,
            own: zero,
            part: zero,
            stack: zero,
            zone: zero,
            found: zero,
        }
    }
}

impl OrderSpots {
    /// Whether the spot of a ray was found; if not, [`OrderDeck::locate_alone`] finds it.
    #[inline]
    #[must_use]
    pub fn found(&self, ray: usize) -> bool {
        self.found[ray] > 0.0
    }

    /// Place of the urn of a ray.
    #[inline]
    #[must_use]
    pub fn urn(&self, ray: usize) -> f64 {
        self.urn[ray]
    }

    /// Keeps the spot of a ray.
    #[inline(always)]
    pub fn keep(&mut self, ray: usize, spot: OrderSpot) {
        self.urn[ray] = spot.urn;
        self.own[ray] = spot.own;
        self.part[ray] = spot.part;
        self.stack[ray] = spot.stack;
        self.zone[ray] = spot.zone;
    }
}

/// What was drawn for many rays.
#[derive(Clone, Debug)]
pub struct DrawnOrders {
    /// 1 if the light leaves on the inner side, 0 if on the outer one.
    pub inner: Lane,
    /// 1 if it is absorbed instead, else 0.
    pub absorbed: Lane,
    /// The kx of the order.
    pub kx: Lane,
}

impl Default for DrawnOrders {
    fn default() -> Self {
        let zero = [0.0; MANY];
        Self {
            inner: zero,
            absorbed: zero,
            kx: zero,
        }
    }
}

#[inline(always)]
fn locate(
    (numbers, cells): (&[Numbers; TABLES], &[u32; CELLS]),
    gaps: &[Gap; GAPS],
    stacks: &[Stack; STACKS],
    surface: &[i64; MANY],
    inside: &Lane,
    (kx, ky): (&Lane, &Lane),
    (u, v): (&Lane, &Lane),
    spots: &mut OrderSpots,
) {
    for ray in 0..MANY {
        let numbers = &numbers[surface[ray] as usize & (TABLES - 1)];
        let (kx, ky) = (kx[ray], ky[ray].abs());
        let cell = (numbers.first_cell + (ky * numbers.cells_per_ky).floor()) as i64;
        let guess = i64::from(cells[cell as usize & (CELLS - 1)]);
        let side = i64::from(inside[ray] <= 0.0);
        let place = numbers.first_gap as i64 + 2 * guess + side;
        let next = gaps[place as usize & (GAPS - 1)].end <= ky;
        let place = place + if next { 2 } else { 0 };
        let gap = &gaps[place as usize & (GAPS - 1)];
        let position = kx * numbers.nodes_per_kx - numbers.kx_offset;
        let (exist, upper, node) = gap.corner(ky, position, u[ray]);
        let zone = draw::zone(node, numbers.zones_per_node);
        let stack =
            if upper { gap.stacks[1] } else { gap.stacks[0] } + node - zone * numbers.per_zone;
        let [urn, own, part] = stacks[stack as i64 as usize & (STACKS - 1)].pick(zone, v[ray]);
        spots.urn[ray] = urn;
        spots.own[ray] = own;
        spots.part[ray] = part;
        spots.stack[ray] = stack;
        spots.zone[ray] = zone;
        spots.found[ray] = if exist { 1.0 } else { 0.0 };
    }
}

#[inline(always)]
fn orders(
    numbers: &[Numbers; TABLES],
    stacks: &[Stack; STACKS],
    surface: &[i64; MANY],
    spots: &OrderSpots,
    read: &[u32; MANY],
    kx: &Lane,
    drawn: &mut DrawnOrders,
) {
    for ray in 0..MANY {
        let spot = OrderSpot {
            urn: spots.urn[ray],
            own: spots.own[ray],
            part: spots.part[ray],
            stack: spots.stack[ray],
            zone: spots.zone[ray],
        };
        let stack = &stacks[spot.stack as i64 as usize & (STACKS - 1)];
        let order = stack.order(&spot, read[ray]);
        drawn.inner[ray] = if order.inner { 1.0 } else { 0.0 };
        drawn.absorbed[ray] = if order.absorbed { 1.0 } else { 0.0 };
        drawn.kx[ray] = kx[ray] + order.order * numbers[surface[ray] as usize & (TABLES - 1)].zone;
    }
}
