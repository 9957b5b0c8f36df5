// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prints the table "What the periodic cell leaves out" of `docs/validation/periodic-cell.md`:
//! rings among their true neighbours, and single teeth on a plane, against the endless gratings
//! that stand for them.
//!
//! `cargo run --release -p batwing-tests --example single_ring [RING]...`, minutes of CPU; without
//! rings, all of [`CASES`].

#![expect(clippy::print_stdout, reason = "a table on the terminal is what it is for")]

use anyhow::{Context, Result};
use batwing_tests::supercell::effect::{Effect, Gathered, effect};
use batwing_tests::supercell::surface::{Neighbours, Ring, Surface};
use batwing_tests::supercell::waves::{Lines, Wave, grating, of_one_tooth, supercell};
use batwing_tests::tables::{SILICONE, WAVELENGTH_UM};
use rcwa::Side;
use rcwa::relief::SlicePlan;

/// A ring and the sizes of its supercells, in chords.
struct Case {
    file: &'static str,
    ring: usize,
    in_line: &'static [usize],
    among: &'static [usize],
    on_plane: &'static [usize],
}

const fn case(file: &'static str, ring: usize, more: [&'static [usize]; 2]) -> Case {
    Case { file, ring, in_line: &[3], among: more[0], on_plane: more[1] }
}

/// What is computed.
const CASES: [Case; 4] = [
    case("d1.toml", 5, [&[3, 5], &[3, 5, 7]]),
    case("d1.toml", 75, [&[3, 5], &[3, 5, 7]]),
    case("d1.toml", 165, [&[3], &[3]]),
    case("d2.toml", 25, [&[3, 5], &[3]]),
];
/// Solved once more with three times as many orders beyond those that propagate and slices half as
/// thick.
const FINER: (&str, usize) = ("d1.toml", 75);
/// Orders kept beyond those that propagate in silicone, in orders of the grating of one tooth.
const MORE_ORDERS: usize = 8;
/// Thickness of slices, µm.
const SLICE_UM: f64 = 0.1;
/// Light less oblique than this is compared by itself, degrees.
const STEEP_DEG: f64 = 40.0;
/// Ranges of incidence, degrees.
const RANGE_DEG: f64 = 10.0;

/// A ring and how finely everything about it is solved.
struct Solver {
    ring: Ring,
    name: String,
    /// Highest order of the grating of one tooth.
    highest: usize,
    slice_um: f64,
    lines: Lines,
}

impl Solver {
    fn new(file: &str, number: usize, more: usize, slice_um: f64) -> Result<Self> {
        let ring = Ring::of(file, number)?;
        let propagate = (SILICONE * ring.period_um() / WAVELENGTH_UM) as usize;
        Ok(Self {
            name: format!("{} {number}", &file[..2]),
            highest: propagate + more,
            ring,
            slice_um,
            lines: Lines::passing(),
        })
    }

    fn surface(&self, teeth: usize, neighbours: Neighbours) -> Result<(Surface, SlicePlan)> {
        let surface = self.ring.supercell(teeth, neighbours)?;
        let plan = surface.plan(self.slice_um);
        println!(
            "{}, {neighbours:?}, {teeth} chords: orders ±{} for each, {} slices; ends {:.1e} um apart in height, length off by {:.1e}",
            self.name,
            self.highest,
            plan.count(),
            surface.mismatch_um,
            surface.stretched,
        );
        Ok((surface, plan))
    }

    fn solved(&self, surface: &Surface, plan: &SlicePlan) -> Result<Vec<Wave>> {
        supercell(&surface.stack(plan)?, surface.teeth, self.highest, &self.lines)
    }

    /// The ring's endless grating, at the height and with the slices of `beside`.
    fn grating(&self, beside: &Surface, plan: &SlicePlan) -> Result<Vec<Wave>> {
        let alone = self.ring.grating(beside)?;
        grating(&alone.stack(plan)?, beside.teeth, self.highest, &self.lines)
    }

    fn print(&self, what: &str, first: &[Wave], second: &[Wave]) {
        for (side, name) in [(Side::Top, "silicone"), (Side::Bottom, "air")] {
            let of = |how| effect(first, second, side, how);
            let (all, range) = (of(Gathered::Diffuse), of(Gathered::Ranges(RANGE_DEG)));
            let single = of(Gathered::Single);
            println!("| {} | {what} | {name} | {} |", self.name, cells(&all, &range, &single));
        }
    }

    fn among_neighbours(&self, teeth: usize, neighbours: Neighbours) -> Result<()> {
        let (surface, plan) = self.surface(teeth, neighbours)?;
        let (together, alone) = (self.solved(&surface, &plan)?, self.grating(&surface, &plan)?);
        self.print(&format!("{neighbours:?} {teeth}"), &alone, &together);
        Ok(())
    }

    fn one_tooth(&self, sizes: &[usize]) -> Result<()> {
        for &teeth in sizes {
            let (surface, plan) = self.surface(teeth, Neighbours::Plane)?;
            let plane = supercell(&surface.plane()?, teeth, self.highest, &self.lines)?;
            let tooth = of_one_tooth(&self.solved(&surface, &plan)?, &plane, teeth);
            let alone = self.grating(&surface, &plan)?;
            self.print(&format!("one tooth {teeth}"), &alone, &tooth);
            let [alone, tooth] = [alone, tooth].map(|mut waves| {
                waves.retain(|w| w.angle_deg.abs() < STEEP_DEG);
                waves
            });
            self.print(&format!("one tooth {teeth}, within {STEEP_DEG} deg"), &alone, &tooth);
        }
        Ok(())
    }
}

/// Diffuse light, ranges of incidence, plane waves.
fn cells(all: &Effect, range: &Effect, single: &Effect) -> String {
    let points = |x: f64| 100.0 * x;
    format!(
        "{:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2}",
        points(all.passes[0]),
        points(all.passes[1]),
        points(all.moved),
        all.turn_deg,
        points(range.total),
        points(range.worst_total),
        points(range.moved),
        range.turn_deg,
        points(single.total),
        points(single.worst_total),
    )
}

fn main() -> Result<()> {
    let chosen: Vec<usize> = std::env::args()
        .skip(1)
        .map(|a| a.parse().with_context(|| format!("a ring, got `{a}`")))
        .collect::<Result<_>>()?;
    println!(
        "| ring | what | from | diffuse: grating | this | moved | turn | ranges: total | worst | moved | turn | waves: total | worst |"
    );
    for Case { file, ring, in_line, among, on_plane } in CASES {
        if !chosen.is_empty() && !chosen.contains(&ring) {
            continue;
        }
        let solver = Solver::new(file, ring, MORE_ORDERS, SLICE_UM)?;
        for &teeth in in_line {
            solver.among_neighbours(teeth, Neighbours::InLine)?;
        }
        for &teeth in among {
            solver.among_neighbours(teeth, Neighbours::True)?;
        }
        solver.one_tooth(on_plane)?;
        if (file, ring) == FINER {
            let finer = Solver::new(file, ring, 3 * MORE_ORDERS, 0.5 * SLICE_UM)?;
            finer.among_neighbours(3, Neighbours::True)?;
            finer.one_tooth(&[3])?;
        }
    }
    Ok(())
}
