// SPDX-License-Identifier: MIT OR Apache-2.0
//! Order tables of several surfaces, sampled for many rays at once.
//!
//! In: tables, and up to [`OrderTableBatch::LANES`] rays as a structure of arrays. Out: the same
//! samples as [`OrderTable`] gives one by one. All arrays have fixed sizes, so the loops contain
//! neither branches nor bounds checks; a caller that runs them inside a function compiled for wide
//! instructions has them vectorised.

#![expect(
    clippy::inline_always,
    clippy::too_many_arguments,
    reason = "a call within a loop prevents wide instructions, and so do arrays that may alias: only \
              separate arguments are known not to"
)]

use super::OrderTable;
use super::alias_table::{BlochNodes, KyInterval};
use super::sample::{self, BinLocation};
use crate::direction::{Side, Wavevector};

/// Most tables; most intervals, Bloch nodes and lookup entries of all tables together.
const TABLES: usize = 512;
const INTERVALS: usize = 16_384;
const BLOCH_NODES: usize = 32_768;
const LOOKUP: usize = 65_536;

/// Rays of one batch.
const LANES: usize = 64;

/// One number for each ray.
type Lane = [f64; LANES];

/// Yes or no for a ray, kept as a real: loops over flags and reals need one kind of comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flag(f64);

impl Flag {
    /// Not set.
    pub const NO: Self = Self(0.0);
    /// Set.
    pub const YES: Self = Self(1.0);

    /// Set if `yes`.
    #[inline(always)]
    pub const fn new(yes: bool) -> Self {
        Self(if yes { 1.0 } else { 0.0 })
    }

    /// True if it is set.
    #[inline(always)]
    pub const fn is_set(self) -> bool {
        self.0 > 0.0
    }
}

/// Quantities of a table that do not depend on the node.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct TableConstants {
    lookup_per_ky: f64,
    /// First lookup entry, and first interval of the inner side; those of the outer side alternate
    /// with them.
    first_lookup: f64,
    first_interval: f64,
    nodes_per_kx: f64,
    kx_offset: f64,
    kx_per_zone: f64,
    zones_per_node: f64,
    zone: f64,
}

/// Order tables by the number of their surface.
#[derive(Debug)]
pub struct OrderTableBatch<'a> {
    tables: Vec<Option<&'a OrderTable>>,
    bins: Vec<&'a [u32]>,
    constants: Box<[TableConstants; TABLES]>,
    intervals: Box<[KyInterval; INTERVALS]>,
    bloch_nodes: Box<[BlochNodes; BLOCH_NODES]>,
    lookup: Box<[u32; LOOKUP]>,
}

/// A list padded to a fixed size; `None` if it is longer.
fn fixed<T: Copy + Default, const N: usize>(mut list: Vec<T>) -> Option<Box<[T; N]>> {
    if list.len() > N {
        return None;
    }
    list.resize(N, T::default());
    list.into_boxed_slice().try_into().ok()
}

impl<'a> OrderTableBatch<'a> {
    /// The tables of the surfaces that have one; `None` if they are too many, or their rows too
    /// unevenly spaced, for loops without branches.
    pub fn new(tables: Vec<Option<&'a OrderTable>>) -> Option<Self> {
        let (mut intervals, mut bloch_nodes, mut lookup) =
            (Vec::new(), Vec::new(), Vec::<u32>::new());
        let mut constants = Vec::new();
        let mut known: Vec<(&[u32], usize)> = Vec::new();
        for table in &tables {
            let Some(table) = table else {
                constants.push(TableConstants::default());
                continue;
            };
            let alias = &table.alias_table;
            if !alias.has_direct_lookup() {
                return None;
            }
            // Tables of one design often share their rows.
            let same = known.iter().find(|(other, _)| *other == &alias.ky_lookup[..]);
            let first_lookup = if let Some((_, first)) = same {
                *first
            } else {
                known.push((&alias.ky_lookup, lookup.len()));
                lookup.extend(&alias.ky_lookup);
                lookup.len() - alias.ky_lookup.len()
            };
            constants.push(TableConstants {
                lookup_per_ky: alias.lookup_per_ky,
                first_lookup: first_lookup as f64,
                first_interval: intervals.len() as f64,
                nodes_per_kx: table.layout.nodes_per_kx,
                kx_offset: table.layout.kx_offset,
                kx_per_zone: f64::from(alias.kx_per_zone),
                zones_per_node: 1.0 / f64::from(alias.kx_per_zone),
                zone: table.layout.zone,
            });
            let first = Side::BOTH.map(|side| {
                let first = bloch_nodes.len() as f64;
                bloch_nodes.extend(&alias.bloch_nodes[side.index()]);
                first
            });
            for pair in alias.ky_intervals[0].iter().zip(&alias.ky_intervals[1]) {
                for (interval, first) in <[&KyInterval; 2]>::from(pair).into_iter().zip(first) {
                    let bloch_nodes = interval.bloch_nodes.map(|own| first + own);
                    intervals.push(KyInterval { bloch_nodes, ..*interval });
                }
            }
        }
        let bins = |table: Option<&'a OrderTable>| table.map_or(&[][..], |t| &t.alias_table.bins);
        Some(Self {
            bins: tables.iter().copied().map(bins).collect(),
            tables,
            constants: fixed(constants)?,
            intervals: fixed(intervals)?,
            bloch_nodes: fixed(bloch_nodes)?,
            lookup: fixed(lookup)?,
        })
    }

    /// Rays of one batch.
    pub const LANES: usize = LANES;

    /// [`OrderTable::locate_bin`] for rays that meet the table of `surface`, from the inner side
    /// where `inside` is set, with tangential wavevectors (kx, ky) and two random numbers each.
    /// Rays that meet no table get meaningless locations.
    #[inline(always)]
    pub fn locate_bins(
        &self,
        surface: &[i64; LANES],
        inside: &[Flag; LANES],
        [kx, ky]: &[Lane; 2],
        [u, v]: &[Lane; 2],
        locations: &mut BinLocations,
    ) {
        locate_bins(
            (&self.constants, &self.lookup),
            &self.intervals,
            &self.bloch_nodes,
            surface,
            inside,
            (kx, ky),
            (u, v),
            locations,
        );
    }

    /// [`OrderTable::locate_bin`] for one ray, where not all nodes around its wavevector exist.
    #[cold]
    pub fn locate_bin(
        &self,
        surface: usize,
        side: Side,
        k: Wavevector,
        random: [f64; 2],
    ) -> BinLocation {
        let Some(table) = self.tables[surface] else {
            return BinLocation::default();
        };
        let mut location = table.locate_bin(side, k, random);
        let interval = self.constants[surface].first_interval as usize + side.index();
        let first = self.intervals[interval].bloch_nodes[0];
        location.bloch += first - table.alias_table.ky_intervals[side.index()][0].bloch_nodes[0];
        location
    }

    /// Reads a bin of the table of a surface.
    #[inline]
    pub fn bin(&self, surface: i64, bin: f64) -> u32 {
        self.bins[surface as usize][bin as i64 as usize]
    }

    /// The orders sampled from the bins that were read, and the kx to which they lead.
    #[inline(always)]
    pub fn orders(
        &self,
        surface: &[i64; LANES],
        locations: &BinLocations,
        bins: &[u32; LANES],
        kx: &Lane,
        sampled: &mut SampledOrders,
    ) {
        orders(&self.constants, &self.bloch_nodes, surface, locations, bins, kx, sampled);
    }

    /// The table of a surface.
    pub fn table(&self, surface: usize) -> Option<&'a OrderTable> {
        self.tables[surface]
    }
}

/// A [`BinLocation`] for every ray of a batch, as a structure of arrays.
#[derive(Clone, Debug)]
pub struct BinLocations {
    bin: Lane,
    own: Lane,
    fraction: Lane,
    bloch: Lane,
    zone: Lane,
    found: [Flag; LANES],
}

impl Default for BinLocations {
    fn default() -> Self {
        let zero = [0.0; LANES];
        Self {
            bin: zero,
            own: zero,
            fraction: zero,
            bloch: zero,
            zone: zero,
            found: [Flag::NO; LANES],
        }
    }
}

impl BinLocations {
    /// True if the location of a ray was found; if not, [`OrderTableBatch::locate_bin`] finds it.
    #[inline]
    pub fn found(&self, ray: usize) -> bool {
        self.found[ray].is_set()
    }

    /// Index of the bin of a ray.
    #[inline]
    pub fn bin(&self, ray: usize) -> f64 {
        self.bin[ray]
    }

    /// Sets the location of a ray.
    #[inline(always)]
    pub fn set(&mut self, ray: usize, location: BinLocation) {
        self.bin[ray] = location.bin;
        self.own[ray] = location.own;
        self.fraction[ray] = location.fraction;
        self.bloch[ray] = location.bloch;
        self.zone[ray] = location.zone;
    }
}

/// The sampled order of every ray of a batch.
#[derive(Clone, Debug)]
pub struct SampledOrders {
    /// Set if the light leaves on the inner side.
    pub inner: [Flag; LANES],
    /// Set if it is absorbed instead.
    pub absorbed: [Flag; LANES],
    /// The kx of the order.
    pub kx: Lane,
}

impl Default for SampledOrders {
    fn default() -> Self {
        Self { inner: [Flag::NO; LANES], absorbed: [Flag::NO; LANES], kx: [0.0; LANES] }
    }
}

#[inline(always)]
fn locate_bins(
    (constants, lookup): (&[TableConstants; TABLES], &[u32; LOOKUP]),
    intervals: &[KyInterval; INTERVALS],
    bloch_nodes: &[BlochNodes; BLOCH_NODES],
    surface: &[i64; LANES],
    inside: &[Flag; LANES],
    (kx, ky): (&Lane, &Lane),
    (u, v): (&Lane, &Lane),
    locations: &mut BinLocations,
) {
    for ray in 0..LANES {
        let constants = &constants[surface[ray] as usize & (TABLES - 1)];
        let (kx, ky) = (kx[ray], ky[ray].abs());
        let entry = (constants.first_lookup + (ky * constants.lookup_per_ky).floor()) as i64;
        let guess = i64::from(lookup[entry as usize & (LOOKUP - 1)]);
        let side = i64::from(!inside[ray].is_set());
        let place = constants.first_interval as i64 + 2 * guess + side;
        let next = intervals[place as usize & (INTERVALS - 1)].end <= ky;
        let place = place + if next { 2 } else { 0 };
        let interval = &intervals[place as usize & (INTERVALS - 1)];
        let position = kx * constants.nodes_per_kx - constants.kx_offset;
        let (exist, upper, node) = interval.sample_node(ky, position, u[ray]);
        let zone = sample::zone(node, constants.zones_per_node);
        let [lower_row, upper_row] = interval.bloch_nodes;
        let first = if upper { upper_row } else { lower_row };
        let bloch = first + node - zone * constants.kx_per_zone;
        let [bin, own, fraction] =
            bloch_nodes[bloch as i64 as usize & (BLOCH_NODES - 1)].sample_bin(zone, v[ray]);
        locations.bin[ray] = bin;
        locations.own[ray] = own;
        locations.fraction[ray] = fraction;
        locations.bloch[ray] = bloch;
        locations.zone[ray] = zone;
        locations.found[ray] = Flag::new(exist);
    }
}

#[inline(always)]
fn orders(
    constants: &[TableConstants; TABLES],
    bloch_nodes: &[BlochNodes; BLOCH_NODES],
    surface: &[i64; LANES],
    locations: &BinLocations,
    bins: &[u32; LANES],
    kx: &Lane,
    sampled: &mut SampledOrders,
) {
    for ray in 0..LANES {
        let location = BinLocation {
            bin: locations.bin[ray],
            own: locations.own[ray],
            fraction: locations.fraction[ray],
            bloch: locations.bloch[ray],
            zone: locations.zone[ray],
        };
        let bloch = &bloch_nodes[location.bloch as i64 as usize & (BLOCH_NODES - 1)];
        let order = bloch.order(&location, bins[ray]);
        sampled.inner[ray] = Flag::new(order.inner);
        sampled.absorbed[ray] = Flag::new(order.absorbed);
        sampled.kx[ray] =
            kx[ray] + order.order * constants[surface[ray] as usize & (TABLES - 1)].zone;
    }
}
