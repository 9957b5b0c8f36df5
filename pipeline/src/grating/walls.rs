// SPDX-License-Identifier: MIT OR Apache-2.0
//! One direction of a dielectric relief, with slices that follow its slanted walls.
//!
//! The search begins at the resolution of a table, which suits the hemisphere as a whole and leaves
//! up to twenty times its tolerance in single orders of single directions. First it raises the
//! slices, whose error hardly depends on the orders, then the orders. It keeps the finer of the
//! last two results. The error of that one follows from the last change and the slowest law that
//! errors obey.

use anyhow::Result;
use rcwa::convergence::{converge_hemisphere, fine_enough, is_of_high_contrast};
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::relief::SlicePlan;
use rcwa::{Error, Truncation};

use metrics::plural::count;

use super::{Answer, Efficiencies, Problem};
use crate::grating_case::{Accuracy, Case, Structure};

/// Ratio of the orders of a step of the search.
const ORDERS: f64 = 1.28;
/// Ratio of the slices.
const SLICES: f64 = 4.0 / 3.0;
/// Errors go as this power of the thickness of a slice, or faster.
const LAW_OF_SLICES: i32 = 2;
/// Errors go as this power of 1/M, or faster; the second at high contrast.
const LAW_OF_ORDERS: [i32; 2] = [3, 2];
/// Efficiencies swing about their limit.
const SAFETY: f64 = 2.0;
/// Part of the tolerance that slices may take.
const SLICES_PART: f64 = 0.4;
/// Least tolerance of the hemisphere that the search begins with.
const FIRST_TOLERANCE: f64 = 1e-4;
/// Work after which no further step of slices and of orders begins, in eigenproblems of size 1.
const MOST_WORK: [f64; 2] = [2e9, 1e10];

/// The relief of `case` and its tolerance, if slices may follow its walls.
pub(super) fn followed(case: &Case) -> Option<(Interface, f64)> {
    let (Structure::Relief(relief), Accuracy::Tolerance(tolerance)) =
        (&case.structure, case.accuracy)
    else {
        return None;
    };
    let interface = Interface {
        relief: relief.clone(),
        wavelength: case.wavelength,
        n_top: case.n_top,
        n_bottom: case.n_bottom,
    };
    let sliced = !relief.slice_plan(1).is_exact();
    let turned = super::turned_at_normal(case);
    (sliced && !turned && interface.follows_walls()).then_some((interface, tolerance))
}

/// A search in progress: the finest result so far, and what orders and slices leave of it.
struct Search<'a> {
    problem: &'a Problem<'a>,
    interface: &'a Interface,
    tolerance: f64,
    work: f64,
    at: Resolution,
    answer: Answer,
    by_orders: f64,
    by_slices: f64,
}

impl Search<'_> {
    /// Raises slices, then orders, each until its part of the tolerance is kept, its work is used
    /// up, or there are no more orders.
    fn run(&mut self) -> Result<(), Error> {
        let [slices_work, orders_work] = MOST_WORK;
        // Each has one step at least, which gives its error.
        while self.by_slices > SLICES_PART * self.tolerance
            && (self.by_slices.is_infinite() || self.work < slices_work)
        {
            let plan = self.at.plan.scaled(SLICES);
            let ratio = self.at.plan.count() as f64 / plan.count() as f64;
            let change = self.step(self.at.truncation.highest(), &plan)?;
            self.by_slices = left(change, ratio.powi(LAW_OF_SLICES));
        }
        let law = LAW_OF_ORDERS[usize::from(is_of_high_contrast(self.interface))];
        // Where slices alone miss the tolerance, orders need not be much better.
        while self.by_orders + self.by_slices > self.tolerance
            && (self.by_slices < self.tolerance || self.by_orders > 0.1 * self.by_slices)
            && (self.by_orders.is_infinite() || self.work < orders_work)
        {
            let order = self.at.truncation.highest();
            let raised = ((order as f64 * ORDERS).ceil() as usize).min(Truncation::MAX);
            if raised == order {
                break;
            }
            let change = self.step(raised, &self.at.plan.clone())?;
            self.by_orders = left(change, (order as f64 / raised as f64).powi(law));
        }
        Ok(())
    }

    /// Goes on to another resolution; returns how much the result changes.
    fn step(&mut self, order: usize, plan: &SlicePlan) -> Result<f64, Error> {
        let truncation = Truncation::new(order)?;
        let plan = fine_enough(self.interface, plan, truncation, self.tolerance);
        let at = Resolution { truncation, plan };
        self.work += (2 * order + 1).pow(3) as f64 * 2.0 * at.plan.count() as f64;
        let answer = self.problem.solve_at(self.interface, &at)?;
        let change = self.problem.change(&self.answer, &answer);
        (self.at, self.answer) = (at, answer);
        Ok(change)
    }
}

/// Remainder after a change, if all further ones are smaller by `ratio` each.
fn left(change: f64, ratio: f64) -> f64 {
    SAFETY * change * ratio / (1.0 - ratio)
}

impl Problem<'_> {
    /// Solves `interface` to `tolerance`; orders up to `highest` propagate.
    ///
    /// # Errors
    /// Errors of the solver, and of the search over the hemisphere that it begins with.
    pub(super) fn follow_walls(
        &self,
        interface: &Interface,
        tolerance: f64,
        highest: usize,
    ) -> Result<Efficiencies> {
        let first = tolerance.max(FIRST_TOLERANCE);
        let (at, _) = converge_hemisphere(interface, first, self.progress)?;
        let mut search = Search {
            problem: self,
            interface,
            tolerance,
            work: 0.0,
            answer: self.solve_at(interface, &at)?,
            at,
            by_orders: f64::INFINITY,
            by_slices: f64::INFINITY,
        };
        search.run()?;
        self.read(&search, highest)
    }

    fn solve_at(&self, interface: &Interface, at: &Resolution) -> Result<Answer, Error> {
        let (stack, _) = interface.stacks(at)?;
        self.solve(&stack, at.truncation)
    }

    fn read(&self, search: &Search<'_>, highest: usize) -> Result<Efficiencies> {
        let Resolution { truncation, plan } = &search.at;
        let (order, slices) = (truncation.highest(), plan.count());
        let error = search.by_orders + search.by_slices;
        let jones = self.case.jones.then(|| {
            let (stack, _) = search.interface.stacks(&search.at)?;
            let all = self.jones_on(&stack, *truncation)?;
            Ok::<_, Error>(all.iter().map(|jones| jones.matrix).collect())
        });
        let missed = (error > search.tolerance).then(|| {
            format!(
                "tolerance: {:e} was not reached with the work and the orders that one case may take; reached: an error of {:.1e} by orders -{order}..{order}, {:.1e} by {}",
                search.tolerance,
                search.by_orders,
                search.by_slices,
                count(slices, "slice")
            )
        });
        Ok(Efficiencies {
            orders: self.own(&search.answer),
            truncation: order,
            slices,
            estimated_error: error,
            too_few_for: (order < highest).then_some(highest),
            coarse_slices: None,
            missed,
            jones: jones.transpose()?,
        })
    }
}
