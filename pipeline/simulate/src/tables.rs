// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of diffraction orders: every distinct ring of a design, from the cache or from the
//! solver.
//!
//! A ring's unit cell in the frame of its chord becomes the solver's relief; orders and slices are
//! found for the design's tolerance; the shares of all orders over both hemispheres become an
//! [`OrderTable`]. Designs that share a ring share its table. The hand-over is plain data: the
//! solver's top half-space is the table's inner side.

mod matrices;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use bsdf::{EfficiencyRow, Grid, OrderTable, Polarisation, TableHeader};
use rayon::prelude::*;
use rcwa::accuracy::converge_hemisphere;
use rcwa::hemisphere::{Directions, Hemisphere, Interface, Resolution, hemisphere};
use rcwa::incidence_grid::{GridRequest, solve_adaptive};
use rcwa::relief::{Polygon, Relief};
use rcwa::{Truncation, cost_model};
use serde_json::{Map, Value, json};

use arrays::cache::{Cache, CacheEntry, HEADER_KEY};
use design::Design;
use design::resolved::incidence_grid::{MAX_KX, MAX_KY, first_ky, grid};
use design::schema::{Hybrid, TableContent};
use geometry::Cell;
use gratings::interface::{directions, efficiency_rows, interface};
use results::schema::TableEntry;
use runtime::key::{Key, SOLVER_VERSION};
use runtime::run_context::RunContext;

use super::cells::band_cells;

/// One band's table.
#[derive(Debug, Clone)]
pub struct BandTable {
    /// Key in the cache.
    pub key: Key,
    /// The cell it was computed for.
    pub cell: Cell,
    /// The table.
    pub table: Arc<OrderTable>,
}

/// The tables of all bands of a design; `None` for a smooth band.
#[derive(Debug, Clone)]
pub struct DesignTables {
    /// By band, from the axis; where light is converted at the first of several wavelengths.
    pub bands: Vec<Option<BandTable>>,
    /// The same at its other wavelengths.
    pub others: Vec<Vec<Option<BandTable>>>,
}

impl DesignTables {
    /// Entries of the tables in `results.json`.
    pub fn describe(&self) -> Vec<TableEntry> {
        let wavelengths = std::iter::once(&self.bands).chain(&self.others);
        wavelengths
            .flat_map(|bands| bands.iter().enumerate())
            .filter_map(|(i, band)| band.as_ref().map(|b| (i, b)))
            .map(|(i, b)| {
                let header = b.table.header();
                let more = |key: &str| header.more.get(key).and_then(Value::as_f64);
                TableEntry {
                    band: i + 1,
                    ring: b.cell.ring,
                    wavelength_nm: Some((b.table.grid().wavelength * 1e6).round() * 1e-3),
                    period_um: b.cell.period_um,
                    depth_um: b.cell.depth_um,
                    orders: header.truncation,
                    slices: header.slices,
                    estimated_error: header.estimated_error,
                    energy_residual: header.energy_residual,
                    kx_per_zone: b.table.grid().kx_per_zone,
                    ky: b.table.grid().ky.len(),
                    grid_error: more("grid_error"),
                    kx_error: more("kx_error"),
                    sha256: b.key.hex().to_owned(),
                }
            })
            .collect()
    }
}

/// Rings whose orders and slices are searched for side by side; what is found is lost if the run is
/// stopped before their tables are.
const SEARCHED_TOGETHER: usize = 8;

/// A ring whose table is needed, with everything that it depends on.
#[derive(Debug, Clone)]
pub struct Ring {
    /// Key of its table in the cache.
    pub key: Key,
    /// Design and number, for people.
    pub label: String,
    cell: Cell,
    /// The grid of incidence, or the one to begin with.
    grid: Grid,
    hybrid: Hybrid,
}

/// A resolution found for a tolerance.
struct Converged {
    resolution: Resolution,
    estimated_error: f64,
}

/// The efficiencies of all nodes of a grid.
struct Solved {
    grid: Grid,
    hemisphere: Hemisphere,
    /// Estimated error of the grid in ky, where it was chosen by error.
    grid_error: Option<f64>,
    /// Estimated error of the grid in kx.
    kx_error: Option<f64>,
}

impl Ring {
    /// The rings of all bands of `design`, or of the band `only` (from 1).
    pub fn of_design(design: &Design, only: Option<usize>) -> Vec<Self> {
        rings(design, only).into_iter().flatten().flatten().collect()
    }

    fn new(design: &Design, cell: Cell) -> Self {
        let hybrid = design.hybrid.clone();
        let mut ring = Self {
            key: Key::of(&Value::Null),
            label: format!("{}, ring {}", design.name, cell.ring),
            grid: grid(design, &cell, first_ky(hybrid.tolerance)),
            cell,
            hybrid,
        };
        ring.key = ring.key();
        ring
    }

    /// The key of the table: everything that it depends on, by name.
    fn key(&self) -> Key {
        let mut fields = json!({
            "polygons": [{"index": self.cell.inner_index, "points_um": self.cell.points_um}],
            "depth_um": self.cell.depth_um,
            "background_index": self.cell.background_index,
            "grid": self.grid,
            "ky_by_error": self.ky_by_error(),
            "tolerance": self.hybrid.tolerance,
        });
        if let Some(orders) = self.hybrid.orders {
            fields["orders"] = orders.into();
        }
        if let Some(stairs) = self.hybrid.stairs_um {
            fields["stairs_um"] = stairs.into();
        }
        if self.kx_by_error() {
            fields["kx_by_error"] = true.into();
        }
        if self.matrices() {
            fields["matrices"] = true.into();
        }
        Key::of(&fields)
    }

    /// True if more ky are added until the tolerance is met.
    fn ky_by_error(&self) -> bool {
        self.hybrid.ky_count.is_none()
    }

    /// True if more kx are.
    fn kx_by_error(&self) -> bool {
        self.hybrid.kx_per_zone.is_none() && self.ky_by_error()
    }

    /// True if the table holds Jones matrices.
    fn matrices(&self) -> bool {
        self.hybrid.tables == TableContent::Matrices
    }

    /// Input of the solver.
    fn interface(&self) -> Result<Interface> {
        let mut interface = interface(&self.cell, self.grid.wavelength)?;
        if let Some(height) = self.hybrid.stairs_um {
            interface.relief = staircase(&interface.relief, height)?;
        }
        Ok(interface)
    }

    /// Orders and slices for the tolerance, with the estimated error.
    fn resolve(&self, context: RunContext) -> Result<Converged> {
        let interface = self.interface()?;
        let (tolerance, watch) = (self.hybrid.tolerance, context.interrupt.watch());
        let (mut resolution, estimated_error) = converge_hemisphere(&interface, tolerance, &watch)?;
        if let Some(orders) = self.hybrid.orders {
            let needed = resolution.truncation.highest();
            if orders < needed {
                return Err(anyhow!(
                    "hybrid.orders: expected at least {needed}, which a tolerance of {tolerance} takes, got {orders}"
                ));
            }
            resolution.truncation = Truncation::new(orders)?;
        }
        Ok(Converged { resolution, estimated_error })
    }

    /// The efficiencies at a resolution, on the grid given or on one chosen by error.
    fn shares(&self, resolution: &Resolution, context: RunContext) -> Result<Solved> {
        let interface = self.interface()?;
        let mut grid = self.grid.clone();
        let directions = directions(&grid);
        let bytes = self.memory(&interface, &directions, resolution);
        self.fits(bytes, &directions, resolution)?;
        if !self.ky_by_error() {
            let watch = context.interrupt.watch();
            return Ok(Solved {
                hemisphere: hemisphere(&interface, &directions, resolution, &watch)?,
                grid,
                grid_error: None,
                kx_error: None,
            });
        }
        let request = GridRequest {
            kx_per_zone: grid.kx_per_zone,
            max_kx: self.kx_by_error().then_some(MAX_KX),
            ky: grid.ky.clone(),
            critical_ky: grid.critical_ky(),
            tolerance: self.hybrid.tolerance,
            max_ky: MAX_KY,
        };
        let found = solve_adaptive(&interface, &request, resolution, &context.interrupt.watch())?;
        grid.kx_per_zone = found.directions.kx_per_zone;
        grid.ky = found.directions.ky;
        Ok(Solved {
            grid,
            hemisphere: found.solved,
            grid_error: Some(found.grid_error),
            kx_error: found.kx_error,
        })
    }

    /// Bytes that the shares take while they are computed.
    fn memory(
        &self,
        interface: &Interface,
        directions: &Directions,
        resolution: &Resolution,
    ) -> f64 {
        if !self.ky_by_error() {
            return cost_model::memory(directions, resolution);
        }
        // The middles between those to begin with are solved with them.
        let mut at_once = directions.clone();
        at_once.ky.extend(directions.ky.iter().skip(1));
        cost_model::memory_with_cache(interface, &at_once, resolution)
    }

    /// Refuses what would take too much memory, before it is begun.
    fn fits(&self, bytes: f64, directions: &Directions, resolution: &Resolution) -> Result<()> {
        let gib = bytes / f64::from(1 << 30);
        if gib > self.hybrid.memory_gib {
            return Err(anyhow!(
                "hybrid.memory_gib: expected at least {gib:.3} for orders up to {} and {} ky at a time, got {}; a looser hybrid.tolerance or \
                 fewer hybrid.ky_count take less",
                resolution.truncation.highest(),
                directions.ky.len(),
                self.hybrid.memory_gib
            ));
        }
        Ok(())
    }

    /// Solves the ring at a resolution.
    fn solve(&self, converged: &Converged, context: RunContext) -> Result<OrderTable> {
        let resolution = &converged.resolution;
        let solved = self.shares(resolution, context)?;
        let header = TableHeader {
            design: String::new(),
            ring: self.cell.ring.to_string(),
            band: String::new(),
            length_unit: "um".to_owned(),
            truncation: resolution.truncation.highest(),
            slices: resolution.plan.count(),
            estimated_error: converged.estimated_error,
            energy_residual: solved.hemisphere.worst_balance,
            more: Map::from_iter([
                ("solver_version".to_owned(), SOLVER_VERSION.into()),
                ("tolerance".to_owned(), self.hybrid.tolerance.into()),
                (HEADER_KEY.to_owned(), self.key.hex().into()),
                ("grid_error".to_owned(), solved.grid_error.into()),
                ("kx_error".to_owned(), solved.kx_error.into()),
            ]),
        };
        let rows = efficiency_rows(solved.hemisphere.incidences);
        let table = OrderTable::build(header, solved.grid, rows)?;
        if !self.matrices() {
            return Ok(table);
        }
        let directions = directions(table.grid());
        let bytes = cost_model::memory(&directions, resolution);
        self.fits(bytes, &directions, resolution)?;
        matrices::add(table, &self.interface()?, resolution, context)
    }

    /// Complex multiply-adds of the table at the resolution that it may be expected to take.
    pub fn operations(&self) -> f64 {
        let counted = self.interface().map(|interface| {
            let resolution = expected_resolution(self, &interface);
            let directions = directions(&self.grid);
            resolution.map(|at| cost_model::operations(&interface, &directions, &at).total())
        });
        // A relief that cannot be solved is refused when it is solved.
        counted.and_then(|operations| operations).unwrap_or(0.0)
    }
}

/// The relief with its slanted sides replaced by stairs not higher than `height`, each as wide as
/// the relief at the middle of its height.
fn staircase(relief: &Relief, height: f64) -> Result<Relief> {
    let (period, background) = (relief.period(), relief.background());
    let plan = relief.slice_plan((relief.depth() / height).ceil().max(1.0) as usize);
    let mut polygons = Vec::new();
    let mut z0 = 0.0;
    for layer in relief.layers(&plan) {
        let z1 = z0 + layer.thickness;
        for segment in layer.segments.iter().filter(|s| s.index != background) {
            let (x0, x1) = (segment.x0 * period, segment.x1 * period);
            polygons.push(Polygon {
                index: segment.index,
                points: vec![[x0, z0], [x1, z0], [x1, z1], [x0, z1]],
            });
        }
        z0 = z1;
    }
    Ok(Relief::new(period, relief.depth(), background, polygons)?)
}

/// Rough cost of a table: period³ × height.
pub fn cost(cell: &Cell) -> f64 {
    cell.period_um.powi(3) * cell.depth_um
}

/// The resolution that a ring may be expected to take: orders that propagate and those beyond, and
/// slices, by the root of the height in half wavelengths. Found orders differ by a tenth, found
/// slices by a third.
fn expected_resolution(ring: &Ring, interface: &Interface) -> Result<Resolution> {
    let index = interface.n_top.re.max(interface.n_bottom.re);
    let waves = index / ring.grid.wavelength;
    let height = (2.0 * waves * ring.cell.depth_um).sqrt();
    let finer = (1e-3 / ring.hybrid.tolerance).powf(0.12);
    let orders = waves * ring.cell.period_um + 3.0 + 1.2 * height * finer;
    let slices = (6.0 * height * finer).ceil().max(1.0);
    Ok(Resolution {
        truncation: Truncation::new(orders as usize)?,
        plan: interface.relief.slice_plan(slices as usize),
    })
}

/// Solves those of `rings` that the cache lacks, and stores their tables.
///
/// # Errors
/// Errors of the solver and of the cache; an interrupt.
pub fn solve_rings(rings: &[&Ring], cache: &Cache, context: RunContext) -> Result<()> {
    let distinct = rings.iter().map(|ring| (&ring.key, *ring)).collect();
    let (_, missing) = look_up(distinct, Some(cache), context);
    solve_missing(missing, Some(cache), context).map(drop)
}

/// Names in the cache of all tables that `design` needs, from the axis.
pub fn keys(design: &Design) -> Vec<Key> {
    Ring::of_design(design, None).into_iter().map(|ring| ring.key).collect()
}

/// The tables of all `designs`, in order. Those that the cache lacks are solved and stored at once,
/// so that a run that is stopped goes on from there. Without a cache everything is solved; with
/// `only`, only that band (from 1).
///
/// # Errors
/// Errors of the solver and of the cache; an interrupt.
pub fn tables(
    designs: &[&Design],
    cache: Option<&Cache>,
    only: Option<usize>,
    context: RunContext,
) -> Result<Vec<DesignTables>> {
    let designs: Vec<Rings> = designs.iter().map(|design| rings(design, only)).collect();
    let all = designs.iter().flatten().flatten().flatten();
    let distinct: BTreeMap<&Key, &Ring> = all.map(|ring| (&ring.key, ring)).collect();
    let (mut ready, missing) = look_up(distinct, cache, context);
    ready.extend(solve_missing(missing, cache, context)?);
    designs.into_iter().map(|rings| of_rings(rings, &ready)).collect()
}

/// The tables of a design out of those that are ready.
fn of_rings(rings: Rings, ready: &BTreeMap<Key, Arc<OrderTable>>) -> Result<DesignTables> {
    let table = |ring: Ring| {
        let table = ready.get(&ring.key).map(Arc::clone);
        Ok(BandTable {
            table: table.ok_or_else(|| anyhow!("no table for {}", ring.label))?,
            key: ring.key,
            cell: ring.cell,
        })
    };
    let mut wavelengths = rings.into_iter().map(|bands| {
        let bands = bands.into_iter().map(|ring| ring.map(table).transpose());
        bands.collect::<Result<Vec<_>>>()
    });
    let bands = wavelengths.next().unwrap_or_else(|| Ok(Vec::new()))?;
    Ok(DesignTables { bands, others: wavelengths.collect::<Result<_>>()? })
}

/// Tables held in memory for many designs that share rings.
#[derive(Debug)]
pub struct HeldTables {
    max_held: usize,
    held: BTreeMap<Key, Arc<OrderTable>>,
    /// Tables solved so far.
    pub solved: usize,
}

impl HeldTables {
    /// No tables; where more than `max_held` are held, those that a design does not need go.
    pub fn new(max_held: usize) -> Self {
        Self { max_held, held: BTreeMap::new(), solved: 0 }
    }

    /// The tables of `design`: held ones, else those of the cache, else solved ones, which the
    /// cache keeps.
    ///
    /// # Errors
    /// Same as [`tables`].
    pub fn of_design(
        &mut self,
        design: &Design,
        cache: Option<&Cache>,
        context: RunContext,
    ) -> Result<DesignTables> {
        let rings = rings(design, None);
        let all = rings.iter().flatten().flatten().map(|ring| (&ring.key, ring));
        let needed: BTreeMap<&Key, &Ring> = all.collect();
        if self.held.len() > self.max_held {
            self.held.retain(|key, _| needed.contains_key(key));
        }
        let mut unknown = needed;
        unknown.retain(|key, _| !self.held.contains_key(*key));
        let (ready, missing) = look_up(unknown, cache, context);
        self.solved += missing.len();
        self.held.extend(ready);
        self.held.extend(solve_missing(missing, cache, context)?);
        of_rings(rings, &self.held)
    }
}

/// The rings of the bands of a design that are to be solved, by wavelength; `None` for a smooth band
/// and one whose BSDF a file gives.
type Rings = Vec<Vec<Option<Ring>>>;

fn rings(design: &Design, only: Option<usize>) -> Rings {
    let of_band = |design: &Design, (band, cell): (usize, Option<Cell>)| {
        let wanted = match only {
            Some(only) => only == band + 1,
            None => !design.files.covers(band),
        };
        cell.filter(|_| wanted).map(|cell| Ring::new(design, cell))
    };
    let at = |design: Cow<'_, Design>| -> Vec<Option<Ring>> {
        let cells = band_cells(&design).into_iter().enumerate();
        cells.map(|cell| of_band(&design, cell)).collect()
    };
    design.at_tables().into_iter().map(at).collect()
}

/// Tables that the cache holds, and the rings that it lacks.
fn look_up<'a>(
    rings: BTreeMap<&Key, &'a Ring>,
    cache: Option<&Cache>,
    context: RunContext,
) -> (BTreeMap<Key, Arc<OrderTable>>, Vec<&'a Ring>) {
    let (mut ready, mut missing) = (BTreeMap::new(), Vec::new());
    for (key, ring) in rings {
        match cache.map_or(CacheEntry::Nothing, |c| c.find(key)) {
            CacheEntry::Table(table) => {
                ready.insert(key.clone(), Arc::new(*table));
            }
            CacheEntry::Nothing => missing.push(ring),
            CacheEntry::Unusable(why) => {
                context.console.warn(&format!("{why}; computing it anew"));
                missing.push(ring);
            }
        }
    }
    (ready, missing)
}

/// Solves the rings, the largest first, and stores each in the cache. Where a job is merged there
/// may be none.
fn solve_missing(
    mut rings: Vec<&Ring>,
    cache: Option<&Cache>,
    context: RunContext,
) -> Result<Vec<(Key, Arc<OrderTable>)>> {
    if let Some(ring) = rings.first().filter(|_| context.is_merging()) {
        bail!("expected the table of {} in the cache", ring.label);
    }
    let cost = |ring: &Ring| cost(&ring.cell);
    rings.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
    let all = rings.iter().map(|ring| cost(ring) as u64).sum();
    let bar = context.console.progress(all, "tables of orders");
    let search_part = |ring: &Ring| (0.25 * cost(ring)) as u64;
    let converge = |ring: &&Ring| -> Result<Converged> {
        let converged = ring.resolve(context);
        bar.inc(search_part(ring));
        converged.with_context(|| format!("orders and slices of {}", ring.label))
    };
    let solve = |ring: &Ring, converged: &Converged| -> Result<(Key, Arc<OrderTable>)> {
        let table = ring.solve(converged, context);
        let table = table.with_context(|| format!("table of {}", ring.label))?;
        if let Some(cache) = cache {
            cache.store(&ring.key, &table)?;
        }
        bar.inc(cost(ring) as u64 - search_part(ring));
        Ok((ring.key.clone(), Arc::new(table)))
    };
    // A search uses few ky, so rings are searched side by side. A table has many, which keep all
    // threads busy: one table after another, so that each is stored as soon as it can be.
    let together = |rings: &[&Ring]| -> Result<Vec<_>> {
        let converged: Vec<Converged> = rings.par_iter().map(converge).collect::<Result<_>>()?;
        rings.iter().zip(&converged).map(|(ring, found)| solve(ring, found)).collect()
    };
    let solved: Result<Vec<Vec<_>>> = rings.chunks(SEARCHED_TOGETHER).map(together).collect();
    bar.finish_and_clear();
    context.interrupt.check()?;
    Ok(solved?.into_iter().flatten().collect())
}

/// A copy of `table` whose header says whose it is: a table in the cache serves every design that
/// has such a ring.
pub fn labelled(
    table: &OrderTable,
    design: &Design,
    band: usize,
    ring: usize,
) -> Result<OrderTable> {
    let header = TableHeader {
        design: design.name.clone(),
        ring: ring.to_string(),
        band: band.to_string(),
        ..table.header().clone()
    };
    let mut rows = Vec::with_capacity(2 * table.node_count());
    for node in table.grid().nodes() {
        for polarisation in [Polarisation::S, Polarisation::P] {
            rows.push(EfficiencyRow {
                node,
                polarisation,
                orders: table.node_efficiencies(node, polarisation)?,
            });
        }
    }
    let labelled = OrderTable::build(header, table.grid().clone(), rows)?;
    match table.jones_rows() {
        Some(rows) => Ok(labelled.with_jones(rows)?),
        None => Ok(labelled),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_keep_the_area_of_the_relief_and_are_exact_for_the_solver() {
        let d2 = design::embedded("d2.toml").expect("valid");
        for cell in [0, 3, 9].map(|band| band_cells(&d2)[band].clone().expect("a relief")) {
            let smooth = interface(&cell, 0.55).expect("a relief").relief;
            let area = |relief: &Relief, slices: usize| -> f64 {
                let filled = |l: &rcwa::relief::Layer| -> f64 {
                    let dense = l.segments.iter().filter(|s| s.index.re > 1.2);
                    l.thickness * dense.map(rcwa::relief::Segment::width).sum::<f64>()
                };
                relief.slices(slices).iter().map(filled).sum()
            };
            let stairs = staircase(&smooth, 0.4).expect("a relief");
            assert!(stairs.slice_plan(1).is_exact());
            let highest = stairs.slice_plan(1);
            assert!(highest.slices().all(|(_, thickness)| thickness < 0.41));
            // The middle of its height is the mean width of a slanted side.
            let (a, b) = (area(&smooth, 7), area(&stairs, 1));
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn designs_share_the_tables_of_their_common_rings() {
        let keys = |name| {
            let design = design::embedded(name).expect("valid");
            let keys: Vec<Key> = band_cells(&design)
                .into_iter()
                .flatten()
                .map(|cell| Ring::new(&design, cell).key)
                .collect();
            keys
        };
        let (d1, d2, d3) = (keys("d1.toml"), keys("d2.toml"), keys("d3.toml"));
        assert_eq!((d1.len(), d2.len(), d3.len()), (17, 17, 17));
        assert!(d1[..6].iter().zip(&d2[..6]).all(|(a, b)| a != b));
        assert_eq!(d1[6..], d2[6..]);
        assert_eq!(d2[..5], d3[..5]);
        assert_ne!(d2[5], d3[5]);
        assert_eq!(d1[6..], d3[6..]);
    }
}
