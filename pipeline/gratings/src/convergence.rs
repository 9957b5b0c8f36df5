// SPDX-License-Identifier: MIT OR Apache-2.0
//! Convergence study of one ring: error and cost over orders and over slices.
//!
//! Each resolution is compared with a finer run that differs in the swept number alone. Its cost is
//! counted in multiply-adds and timed. The directions are those of one Bloch line at ky in the
//! middle of equal strips, from both sides and in both polarisations. Evenly spaced tangential
//! wavevectors carry equal shares of the flux of diffuse light, so a plain mean over them is
//! weighted by flux.

use std::time::Instant;

use anyhow::{Context, Result, ensure};
use rcwa::guard::MAX_SLICES;
use rcwa::hemisphere::{
    Directions, Hemisphere, Incidence, Interface, Resolution, hemisphere, work,
};
use rcwa::{Truncation, cost_model};
use serde::Serialize;

use crate::interface::interface;
use geometry::Cell;
use metrics::plural::count;
use runtime::progress::Progress;
use runtime::run_context::RunContext;

/// Strips of ky.
const KY_STRIPS: usize = 4;
/// Nodes of kx in a zone; reciprocity makes one line of problems of two.
const KX_PER_ZONE: usize = 2;
/// Slices per wavelength of depth at which orders are swept.
const SLICES_PER_WAVELENGTH: f64 = 8.0;

/// Most slices to try: those of the reference are more than twice as many.
pub const MAX_SWEPT: usize = MAX_SLICES / 5 * 2;

/// Resolutions of a convergence study; [`SweepPlan::new`] completes it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepPlan {
    /// Highest orders M to try, ascending.
    pub orders: Vec<usize>,
    /// Numbers of slices to try, ascending; empty where the relief is exact as it is.
    pub slices: Vec<usize>,
    /// Slices while orders are swept.
    pub fixed_slices: usize,
    /// Highest order while slices are swept.
    pub fixed_orders: usize,
    /// Highest order of the reference of the sweep over orders, at `fixed_slices`.
    pub reference_orders: usize,
    /// Slices of the reference of the sweep over slices, at `fixed_orders`.
    pub reference_slices: usize,
}

impl SweepPlan {
    /// The given lists, or defaults that reach from the fewest possible orders to errors far below
    /// 1e-3.
    ///
    /// # Errors
    /// Empty lists; fewer orders than propagate.
    pub fn new(
        interface: &Interface,
        orders: Option<Vec<usize>>,
        slices: Option<Vec<usize>>,
    ) -> Result<Self> {
        let least = interface.highest_order();
        let depth = interface.relief.depth() / interface.wavelength;
        let exact = interface.relief.slice_plan(1).is_exact();
        let orders = ascending(
            "--orders",
            orders.unwrap_or_else(|| {
                let share = |s: f64| least + (s * least as f64).round() as usize;
                [0.0, 0.07, 0.14, 0.25, 0.4, 0.6, 0.85].map(share).to_vec()
            }),
        )?;
        ensure!(
            orders[0] >= least,
            "--orders: orders up to ±{least} propagate, expected at least {least}, got {}",
            orders[0]
        );
        let slices = ascending(
            "--slices",
            slices.unwrap_or_else(|| {
                let at = |s: f64| (s * depth).ceil() as usize + 2;
                [1.0, 2.0, 3.0, 4.5, 6.5, 9.5, 14.0].map(at).to_vec()
            }),
        )?;
        let most = |list: &[usize]| list[list.len() - 1];
        Ok(Self {
            fixed_slices: (SLICES_PER_WAVELENGTH * depth).ceil() as usize + 2,
            fixed_orders: least + least.div_ceil(4),
            reference_orders: most(&orders) + (least / 2).max(6),
            reference_slices: most(&slices) * 5 / 2,
            orders,
            slices: if exact { Vec::new() } else { slices },
        })
    }
}

fn ascending(argument: &str, mut list: Vec<usize>) -> Result<Vec<usize>> {
    list.sort_unstable();
    list.dedup();
    ensure!(
        list.first().is_some_and(|&least| least > 0),
        "{argument}: expected numbers of at least 1"
    );
    Ok(list)
}

/// Differences of order efficiencies from those of the reference, over all directions, sides and
/// polarisations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShareErrors {
    /// Root mean square over directions; the error of a direction is the larger difference of its R
    /// and T.
    pub rms: f64,
    /// 99th percentile over directions.
    pub percentile_99: f64,
    /// Largest over directions.
    pub max: f64,
    /// Mean over the directions, weighted by flux.
    pub flux_weighted_mean: f64,
    /// Difference of R under diffuse light, the larger of both sides.
    pub diffuse: f64,
    /// Largest difference of any order's efficiency.
    pub largest_order: f64,
}

/// One resolution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SweepPoint {
    /// Highest order kept, M.
    pub orders: usize,
    /// Slices asked for.
    pub slices: usize,
    /// Errors of the point.
    pub errors: ShareErrors,
    /// Complex multiply-adds of one problem (kx0, ky), with its part of the modes.
    pub operations_per_problem: f64,
    /// Wall time of all problems of this study at this resolution.
    pub seconds: f64,
}

/// Both sweeps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConvergenceSweep {
    /// Orders or slices that were tried.
    pub plan: SweepPlan,
    /// ky of the problems, in units of k0.
    pub ky: Vec<f64>,
    /// Incident waves compared.
    pub incident_waves: usize,
    /// Largest |R + T - 1| of all runs.
    pub worst_energy_residual: f64,
    /// Over orders, at `plan.fixed_slices`.
    pub by_orders: Vec<SweepPoint>,
    /// Over slices, at `plan.fixed_orders`.
    pub by_slices: Vec<SweepPoint>,
}

/// The incident directions of a study, solved at one resolution after another.
struct SweepRuns<'a> {
    interface: Interface,
    directions: Directions,
    context: RunContext<'a>,
    bar: Progress,
    worst: f64,
}

impl SweepRuns<'_> {
    fn resolution(&self, (orders, slices): (usize, usize)) -> Result<Resolution> {
        Ok(Resolution {
            truncation: Truncation::new(orders)?,
            plan: self.interface.relief.slice_plan(slices),
        })
    }

    fn solve(&mut self, at: (usize, usize)) -> Result<Hemisphere> {
        let resolution = self.resolution(at)?;
        let (bar, context) = (&self.bar, self.context);
        let weight = weight(at.0);
        let stop = context.interrupt.watch();
        let watch = |layers: usize| {
            bar.inc(layers as u64 * weight);
            stop(layers)
        };
        let solved = hemisphere(&self.interface, &self.directions, &resolution, &watch);
        self.context.interrupt.check()?;
        let solved = solved.with_context(|| {
            format!("orders -{m}..{m} on {s}", m = at.0, s = count(at.1, "slice"))
        })?;
        self.worst = self.worst.max(solved.worst_balance);
        Ok(solved)
    }

    fn point(&mut self, at: (usize, usize), reference: &Hemisphere) -> Result<SweepPoint> {
        let begin = Instant::now();
        let solved = self.solve(at)?;
        let seconds = begin.elapsed().as_secs_f64();
        let counted =
            cost_model::operations(&self.interface, &self.directions, &self.resolution(at)?);
        Ok(SweepPoint {
            orders: at.0,
            slices: at.1,
            errors: compare(&solved.incidences, &reference.incidences)?,
            operations_per_problem: counted.total() / self.directions.ky.len() as f64,
            seconds,
        })
    }
}

/// Progress of one layer: its cost.
fn weight(orders: usize) -> u64 {
    (orders as u64).pow(3)
}

/// Sweeps the orders and the slices of `plan` for a cell at a wavelength.
///
/// # Errors
/// Errors of the solver; an interrupt.
pub fn study(
    cell: &Cell,
    wavelength_um: f64,
    plan: SweepPlan,
    context: RunContext,
) -> Result<ConvergenceSweep> {
    let interface = interface(cell, wavelength_um)?;
    let highest = interface.n_top.re.max(interface.n_bottom.re);
    let strip = |i: usize| highest * (i as f64 + 0.5) / KY_STRIPS as f64;
    let directions =
        Directions { kx_per_zone: KX_PER_ZONE, ky: (0..KY_STRIPS).map(strip).collect() };
    let mut runs =
        SweepRuns { bar: Progress::hidden(), worst: 0.0, interface, directions, context };
    let by_orders = |m: &usize| (*m, plan.fixed_slices);
    let by_slices = |s: &usize| (plan.fixed_orders, *s);
    let all: Vec<(usize, usize)> = plan
        .orders
        .iter()
        .chain([&plan.reference_orders])
        .map(by_orders)
        .chain(plan.slices.iter().chain([&plan.reference_slices]).map(by_slices))
        .collect();
    let mut length = 0;
    for &at in &all {
        length +=
            work(&runs.interface, &runs.directions, &runs.resolution(at)?) as u64 * weight(at.0);
    }
    runs.bar = context.console.progress(length, "orders and slices");

    let reference = runs.solve(by_orders(&plan.reference_orders))?;
    let incident_waves = reference.incidences.len();
    let over =
        |list: &[usize], at: &dyn Fn(&usize) -> (usize, usize), runs: &mut SweepRuns, reference| {
            list.iter().map(|i| runs.point(at(i), reference)).collect::<Result<Vec<SweepPoint>>>()
        };
    let swept_orders = over(&plan.orders, &by_orders, &mut runs, &reference)?;
    let swept_slices = if plan.slices.is_empty() {
        Vec::new()
    } else {
        let reference = runs.solve(by_slices(&plan.reference_slices))?;
        over(&plan.slices, &by_slices, &mut runs, &reference)?
    };
    runs.bar.finish_and_clear();
    Ok(ConvergenceSweep {
        ky: runs.directions.ky,
        incident_waves,
        worst_energy_residual: runs.worst,
        by_orders: swept_orders,
        by_slices: swept_slices,
        plan,
    })
}

/// Errors of `solved` against `reference`; both hold the same incident waves in the same order.
fn compare(solved: &[Incidence], reference: &[Incidence]) -> Result<ShareErrors> {
    let key = |i: &Incidence| (i.side, i.kx_index, i.ky_index, i.pol, i.efficiencies.len());
    ensure!(
        solved.iter().map(key).eq(reference.iter().map(key)) && !solved.is_empty(),
        "the runs to be compared have different incident waves"
    );
    let mut errors = Vec::with_capacity(solved.len());
    let mut largest_order = 0.0_f64;
    // Sum of the differences of R, and their number, for each side of incidence.
    let mut reflected = [(0.0, 0.0_f64); 2];
    for (a, b) in solved.iter().zip(reference) {
        let total = |i: &Incidence, back: bool| -> f64 {
            let of = i.efficiencies.iter().filter(|s| (s.0 == i.side) == back);
            of.map(|s| s.2).sum()
        };
        let [r, t] = [true, false].map(|back| total(a, back) - total(b, back));
        errors.push(r.abs().max(t.abs()));
        let side = &mut reflected[usize::from(a.side == rcwa::Side::Bottom)];
        *side = (side.0 + r, side.1 + 1.0);
        for (x, y) in a.efficiencies.iter().zip(&b.efficiencies) {
            largest_order = largest_order.max((x.2 - y.2).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    let (count, last) = (errors.len() as f64, errors.len() - 1);
    Ok(ShareErrors {
        rms: (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
        percentile_99: errors[(last * 99).div_ceil(100)],
        max: errors[last],
        flux_weighted_mean: errors.iter().sum::<f64>() / count,
        diffuse: reflected
            .iter()
            .map(|(sum, count)| (sum / count.max(1.0)).abs())
            .fold(0.0, f64::max),
        largest_order,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rcwa::{Pol, Side};

    fn wave(kx_index: i64, side: Side, reflected: f64, orders: [f64; 2]) -> Incidence {
        let other = match side {
            Side::Top => Side::Bottom,
            Side::Bottom => Side::Top,
        };
        Incidence {
            side,
            kx_index,
            ky_index: 0,
            pol: Pol::S,
            efficiencies: vec![(side, 0, reflected), (other, 0, orders[0]), (other, 1, orders[1])],
        }
    }

    #[test]
    fn errors_are_those_of_directions_and_of_orders() {
        let reference = [
            wave(0, Side::Top, 0.2, [0.5, 0.3]),
            wave(1, Side::Top, 0.1, [0.6, 0.3]),
            wave(0, Side::Bottom, 0.4, [0.3, 0.3]),
        ];
        let solved = [
            // R and T right, but power in the wrong order.
            wave(0, Side::Top, 0.2, [0.45, 0.35]),
            wave(1, Side::Top, 0.13, [0.57, 0.3]),
            wave(0, Side::Bottom, 0.38, [0.32, 0.3]),
        ];
        let e = compare(&solved, &reference).expect("the same waves");
        let near = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-12, "{e:?}");
        near(e.max, 0.03);
        near(e.percentile_99, 0.03);
        near(e.rms, ((0.0009f64 + 0.0004) / 3.0).sqrt());
        near(e.flux_weighted_mean, 0.05 / 3.0);
        // 0.015 from the top, 0.02 from the bottom.
        near(e.diffuse, 0.02);
        near(e.largest_order, 0.05);
        assert!(compare(&solved[..2], &reference).is_err());
        assert!(compare(&[], &[]).is_err());
    }

    #[test]
    fn plans_hold_what_is_asked_for_and_references_are_finer() {
        let cell = crate::cell_of_ring(75);
        let interface = interface(&cell, 0.55).expect("valid");
        let plan = SweepPlan::new(&interface, None, None).expect("a plan");
        assert_eq!(plan.orders[0], interface.highest_order());
        for list in [&plan.orders, &plan.slices] {
            assert!(list.len() >= 6 && list.is_sorted_by(|a, b| a < b), "{list:?}");
        }
        assert!(plan.reference_orders > plan.orders[plan.orders.len() - 1]);
        assert!(plan.reference_slices > 2 * plan.slices[plan.slices.len() - 1]);

        let plan =
            SweepPlan::new(&interface, Some(vec![40, 30, 40]), Some(vec![9])).expect("a plan");
        assert_eq!((plan.orders, plan.slices), (vec![30, 40], vec![9]));
        for (orders, slices) in [(vec![27], vec![9]), (vec![30], vec![0]), (vec![], vec![9])] {
            assert!(SweepPlan::new(&interface, Some(orders), Some(slices)).is_err());
        }
    }
}
