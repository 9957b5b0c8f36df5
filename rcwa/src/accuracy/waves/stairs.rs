// SPDX-License-Identifier: MIT OR Apache-2.0
//! The search over stairs: reliefs of metal or of absorbing media.
//!
//! In TM the edges of stairs leave an error that only orders and slices together take away, as 1/M.
//! Both are raised in turns, whichever leave more; what both leave together follows from the results
//! in which both were coarser. A search that will not get to its tolerance by far ends early.

use super::{Halt, MAX_WORK, SLICES, Search, TOGETHER, WORK_IN_VAIN, work};
use crate::error::Limit;
use crate::hemisphere::Resolution;
use crate::solve::rounding_error;

/// Part of an earlier error that a later one does not fall below: changes swing.
const KEPT_OF_BEFORE: f64 = 0.5;
/// Results of fewer orders and fewer stairs that a result is compared with.
const COARSER: usize = 2;
/// Steps of the orders, or of the stairs, after which the other is raised whatever it leaves.
const IN_A_ROW: usize = 2;
/// Work, in units of all that is allowed, beyond which a tolerance is hopeless, and the power of 1/M
/// by which errors are taken to fall there.
const HOPELESS: f64 = 10.0;
const EXPONENT_OF_HOPE: f64 = 1.5;

impl<A> Search<'_, A> {
    /// Raises orders or stairs, whichever leave more, until the error of all is within the
    /// tolerance or will not come there.
    pub(super) fn raise_stairs_and_orders(&mut self) -> Result<(), Halt> {
        let (mut in_a_row, mut last_raised_orders, mut compared) = (0, false, 0);
        while self.errors.sum() > self.tolerance || compared < COARSER {
            let raises_orders = if in_a_row == IN_A_ROW {
                !last_raised_orders
            } else {
                self.errors.orders >= self.errors.slices
            };
            in_a_row = if raises_orders == last_raised_orders { in_a_row + 1 } else { 1 };
            last_raised_orders = raises_orders;
            let before = (self.at.truncation.highest(), self.at.plan.count());
            let next = if raises_orders {
                Resolution { truncation: self.more_orders()?, ..self.at.clone() }
            } else {
                Resolution { plan: self.more_slices(), ..self.at.clone() }
            };
            let answer = self.step(next)?;
            self.steps.insert(0, (before.0, before.1, answer));
            self.steps.truncate(4 * COARSER);
            compared = self.judge_step(raises_orders);
            self.check_hope()?;
        }
        Ok(())
    }

    /// Errors after a step of the orders or of the stairs; returns the number of results coarser in
    /// both with which the last one is compared.
    fn judge_step(&mut self, of_orders: bool) -> usize {
        let (highest, count) = (self.at.truncation.highest() as f64, self.at.plan.count() as f64);
        let change = |answer: &A| (self.waves.distance)(answer, &self.answer);
        let ratios = self.steps.iter().map(|(order, slices, answer)| {
            (*order as f64 / highest, *slices as f64 / count, answer)
        });
        let mut coarser =
            ratios.clone().filter(|r| r.0 < 1.0 && r.1 < 1.0).take(COARSER).peekable();
        let is_known = coarser.peek().is_some();
        let mut compared = 0;
        let together = coarser.fold(0.0, |most: f64, (by_orders, by_slices, answer)| {
            compared += 1;
            most.max(TOGETHER.left_by_finer(change(answer), by_orders.max(by_slices)))
        });
        let law = if of_orders { self.orders_law } else { SLICES };
        let single = ratios.take(1).fold(0.0, |_, (by_orders, by_slices, answer)| {
            law.left_by_finer(change(answer), by_orders.min(by_slices))
        });
        let rounding = rounding_error(self.structure.order_spacing(), self.at.truncation);
        let kept = |before: f64| if before.is_finite() { KEPT_OF_BEFORE * before } else { 0.0 };
        let errors = &mut self.errors;
        if of_orders {
            errors.orders = single.max(kept(errors.orders)).max(rounding);
        } else {
            errors.slices = single.max(kept(errors.slices));
        }
        if is_known {
            errors.together = together.max(kept(errors.together));
        }
        compared
    }

    /// # Errors
    /// The limit of the work, where much of it is spent and the law of the errors asks for far more.
    fn check_hope(&self) -> Result<(), Halt> {
        let growth = (self.errors.sum() / self.tolerance).powf(4.0 / EXPONENT_OF_HOPE);
        let needed = self.weight * work(self.structure, &self.at) * growth;
        let is_spent = self.spent > WORK_IN_VAIN * MAX_WORK;
        if growth.is_finite() && is_spent && needed > HOPELESS * MAX_WORK {
            return Err(Halt::Limit(Limit::Work));
        }
        Ok(())
    }
}
