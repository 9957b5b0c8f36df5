// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of chosen rings, one after another, with the time and cost of each.
//!
//! Each table is handed over as soon as it is solved: a caller need not hold all of them, and a
//! stopped run loses one ring at most. Keys and cache are those of [`crate::tables`].

use std::fmt::{self, Display};
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use bsdf::OrderTable;
use rcwa::Truncation;
use rcwa::cost_model::{self, Operations};
use rcwa::hemisphere::Resolution;

use crate::cells::{band_cells, by_ring, has_bands};
use crate::tables::{Ring, cost, tables};
use arrays::cache::Cache;
use design::Design;
use geometry::Cell;
use gratings::interface::{directions, interface};
use runtime::key::Key;
use runtime::progress::Console;
use runtime::run_context::RunContext;

/// A choice of rings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RingChoice {
    /// The representative ring of each band.
    Representatives,
    /// All rings with relief.
    All,
    /// These rings, from 1, each once.
    Listed(Vec<usize>),
}

impl FromStr for RingChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "representatives" => return Ok(Self::Representatives),
            "all" => return Ok(Self::All),
            _ => {}
        }
        let expected = || {
            format!(
                "expected `representatives`, `all` or ring numbers from 1 such as `5,75,165`, got `{text}`"
            )
        };
        let mut rings: Vec<usize> = Vec::new();
        for part in text.split(',') {
            let ring: usize = part.trim().parse().map_err(|_| expected())?;
            if ring == 0 {
                return Err(expected());
            }
            if rings.contains(&ring) {
                return Err(format!("ring {ring} is listed twice"));
            }
            rings.push(ring);
        }
        Ok(Self::Listed(rings))
    }
}

impl Display for RingChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Representatives => f.write_str("representatives"),
            Self::All => f.write_str("all"),
            Self::Listed(rings) => {
                let rings: Vec<String> = rings.iter().map(ToString::to_string).collect();
                f.write_str(&rings.join(","))
            }
        }
    }
}

impl RingChoice {
    /// The rings of `design`, from 1, ascending or in the order listed.
    ///
    /// # Errors
    /// A listed ring that the design does not have or that is smooth; none at all; thin layers on
    /// the dome.
    pub fn rings(&self, design: &Design) -> Result<Vec<usize>> {
        has_bands(design)?;
        let cells = band_cells(&by_ring(design));
        let has_relief = |&ring: &usize| cells[ring - 1].is_some();
        let (size, stands) = (design.hybrid.rings_per_band, design.hybrid.representative);
        let rings: Vec<usize> = match self {
            Self::Representatives => (0..cells.len() / size)
                .map(|band| band * size + stands)
                .filter(has_relief)
                .collect(),
            Self::All => (1..=cells.len()).filter(has_relief).collect(),
            Self::Listed(rings) => {
                for &ring in rings {
                    ensure!(
                        (1..=cells.len()).contains(&ring),
                        "--rings: ring {ring}: expected rings from 1 to {}",
                        cells.len()
                    );
                    ensure!(has_relief(&ring), "--rings: ring {ring} is smooth, it has no table");
                }
                rings.clone()
            }
        };
        ensure!(!rings.is_empty(), "the dome is smooth, there are no tables to compute");
        Ok(rings)
    }
}

/// One ring's table and its cost.
#[derive(Debug, Clone)]
pub struct RingTable {
    /// Ring, from 1.
    pub ring: usize,
    /// Band that it lies in, from 1.
    pub band: usize,
    /// Its unit cell.
    pub cell: Cell,
    /// Key in the cache.
    pub key: Key,
    /// The table.
    pub table: Arc<OrderTable>,
    /// Whether it was found in the cache.
    pub from_cache: bool,
    /// Wall time, with the search for the resolution.
    pub time: Duration,
    /// Complex multiply-adds of the table at its resolution, without the search.
    pub operations: Operations,
}

/// The tables of `rings`, each from its own cell, for several processes to share.
pub fn of(design: &Design, rings: &[usize]) -> Vec<Ring> {
    let single = by_ring(design);
    let rings = rings.iter();
    rings.flat_map(|&ring| Ring::of_design(&single, Some(ring))).collect()
}

/// Finds or computes the tables of `rings` and hands each to `take`.
///
/// # Errors
/// Those of the solver, of the cache and of `take`; an interrupt.
pub fn each(
    design: &Design,
    rings: &[usize],
    cache: Option<&Cache>,
    context: RunContext,
    mut take: impl FnMut(RingTable) -> Result<()>,
) -> Result<()> {
    let single = by_ring(design);
    let cells = band_cells(&single);
    let cost = |ring: usize| cells[ring - 1].as_ref().map_or(0, |cell| cost(cell) as u64);
    let bar = context.console.progress(rings.iter().map(|&r| cost(r)).sum(), "tables of orders");
    let inner = RunContext {
        // This loop shows the progress itself.
        console: Console { quiet: true, ..context.console },
        ..context
    };
    for (done, &ring) in rings.iter().enumerate() {
        bar.set_message(&format!("ring {ring} ({} of {})", done + 1, rings.len()));
        context.interrupt.check()?;
        let begin = Instant::now();
        let found = tables(&[&single], cache, Some(ring), inner)?
            .remove(0)
            .bands
            .swap_remove(ring - 1)
            .with_context(|| format!("no table for ring {ring}"))?;
        let time = begin.elapsed();
        let table = RingTable {
            ring,
            band: (ring - 1) / design.hybrid.rings_per_band + 1,
            from_cache: cache.is_some_and(|c| !c.has_stored(&found.key)),
            operations: counted(&found.cell, &found.table)?,
            cell: found.cell,
            key: found.key,
            table: found.table,
            time,
        };
        bar.inc(cost(ring));
        bar.suspend(|| take(table))?;
    }
    bar.finish_and_clear();
    Ok(())
}

/// Multiply-adds of a table at the resolution in its header.
fn counted(cell: &Cell, table: &OrderTable) -> Result<Operations> {
    let (grid, header) = (table.grid(), table.header());
    let interface = interface(cell, grid.wavelength)?;
    let resolution = Resolution {
        truncation: Truncation::new(header.truncation)?,
        plan: interface.relief.slice_plan(header.slices),
    };
    Ok(cost_model::operations(&interface, &directions(grid), &resolution))
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::cells;
    use geometry::profile::Shape;

    fn design() -> Design {
        design::embedded("d1.toml").expect("valid")
    }

    #[test]
    fn choices_are_read_as_they_are_written() {
        assert_eq!("representatives".parse(), Ok(RingChoice::Representatives));
        assert_eq!("all".parse(), Ok(RingChoice::All));
        assert_eq!("5, 75,165".parse(), Ok(RingChoice::Listed(vec![5, 75, 165])));
        for bad in ["", "0", "5,,6", "some", "-3", "1.5", "7,7"] {
            assert!(bad.parse::<RingChoice>().is_err(), "{bad}");
        }
    }

    #[test]
    fn rings_of_a_design() {
        let mut design = design();
        let representatives = RingChoice::Representatives.rings(&design).expect("rings");
        assert_eq!(representatives.len(), 17);
        assert_eq!((representatives[0], representatives[16]), (5, 165));
        assert_eq!(RingChoice::All.rings(&design).expect("rings").len(), 170);
        let listed = |ring| RingChoice::Listed(vec![ring]);
        assert!(listed(170).rings(&design).is_ok() && listed(171).rings(&design).is_err());

        design.elements.shapes[0] = Shape::Smooth;
        assert_eq!(RingChoice::All.rings(&design).expect("rings").len(), 160);
        let error = listed(10).rings(&design).expect_err("smooth").to_string();
        assert!(error.contains("ring 10 is smooth"), "{error}");
        assert_eq!(RingChoice::Representatives.rings(&design).expect("rings")[0], 15);
        assert!(cells::ring(&design, 11).is_ok() && cells::ring(&design, 10).is_err());
        assert!(cells::ring(&design, 0).is_err() && cells::ring(&design, 171).is_err());
    }

    #[test]
    fn a_ring_by_itself_has_the_cell_of_its_band() {
        let design = design();
        let band = band_cells(&design)[7].clone().expect("relief");
        assert_eq!(cells::ring(&design, 75).expect("relief"), band);
    }
}
