// SPDX-License-Identifier: MIT OR Apache-2.0
//! The search for orders and slices of a whole hemisphere.
//!
//! Judged at one Bloch wavevector, half a zone, which is its own mirror image, and a few ky that
//! stand for the others. Where few orders propagate, or none half a zone from the normal, light in
//! the plane of the grooves and light beside it are judged too.
//!
//! Slices that follow slanted walls and orders are each compared with about a third more, and the
//! difference continued by the laws of `law`. Errors fall faster than these where they are of the
//! order of a thousandth. What slices leave hardly depends on the orders nor what orders leave on
//! the slices, so that each is looked for where the other is cheap.
//!
//! Where walls become stairs, what both leave together does depend on both: `converge_waves` raises
//! them in turns, over the same sample.

use super::largest_change;
use super::law::{
    Law, NEIGHBOURS, ORDERS, SLICES_EXPONENT, followed_law, is_of_high_contrast, unfollowed_law,
};
use crate::error::{Error, Limit};
use crate::hemisphere::{Interface, Resolution};
use crate::orders::{SymmetricBloch, Truncation};
use crate::progress::Progress;
use crate::relief::{SlicePlan, extrapolate};
use crate::scattering::Scattering;
use crate::solve::{rounding_error, solve_line, solve_symmetric_line};
use crate::wave::{Pol, Side};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Part of the tolerance that slices may take; orders may take the rest.
const SLICES_PART: f64 = 0.3;
/// Exponent by which the highest order may grow in a slice that follows the walls, at low contrast
/// and at high: beyond, what sections depart from its middle by is no small correction.
const MAX_EXPONENT: f64 = 6.0;
const MAX_EXPONENT_AT_HIGH_CONTRAST: f64 = 2.5;
/// Below a thousandth that exponent goes as this power of the tolerance.
const EXPONENT_BY_TOLERANCE: f64 = 0.3;
/// Slices and orders beyond those that propagate go about as the root of the depth in half
/// wavelengths: so many of each suit a thousandth.
const FIRST_SLICES: f64 = 6.0;
const FIRST_ORDERS: f64 = 1.2;
/// Part of the slices found with which orders are looked for; on fewer, single waves hardly
/// converge in them.
const FOR_ORDERS: f64 = 0.85;

/// Ratio of the orders of the reference run to those compared with it, and the smallest ratio that
/// will do.
const REFERENCE: f64 = 1.35;
const MIN_REFERENCE: f64 = 1.22;
/// Ratio of slices in a comparison, where they follow the walls.
const FOLLOWED_REFERENCE: f64 = 1.33;
/// Ratio of orders in a comparison, where slices follow the walls.
const FOLLOWED_ORDERS: f64 = 1.28;
/// Orders, of all ky together, that are looked at at least.
const WAVES: usize = 120;
/// A few ky stand for all: no error below this part of the tolerance is ever claimed.
pub(super) const MIN_CLAIM: f64 = 1.0 / 3.0;
/// Periods, in wavelengths of the denser half-space, below which light off half a zone is judged
/// too, and above which light at half a zone is.
const FEW_ORDERS: f64 = 1.0;
const EDGE_PROPAGATES: f64 = 0.55;
/// kx of such light, in units of the smaller index.
const OFF_NORMAL: f64 = 0.45;

/// Distance between two results of a hemisphere: the value that 99 % of the components stay below,
/// or a third of the largest, whichever is more. The rest are directions at grazing incidence,
/// which carry next to no power. Infinite where there is nothing to compare.
pub fn hemisphere_change(a: &[f64], b: &[f64]) -> f64 {
    let mut changes: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect();
    changes.sort_by(f64::total_cmp);
    let last = changes.len().saturating_sub(1);
    let nearly_all = last * 99 / 100;
    match (changes.get(nearly_all), changes.get(last)) {
        (Some(nearly_all), Some(largest)) => nearly_all.max(largest / 3.0),
        _ => f64::INFINITY,
    }
}

/// Efficiencies of all incident waves of the sample.
pub(super) struct SampleEfficiencies {
    /// Transmittance of each wave.
    totals: Vec<f64>,
    /// Efficiency of each order, of each wave.
    orders: Vec<f64>,
    /// Ends of the orders of each wave in `orders`.
    ends: Vec<usize>,
}

impl SampleEfficiencies {
    fn new(sample: &[Scattering]) -> Self {
        let (mut totals, mut orders, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for scattering in sample {
            for side in Side::BOTH {
                for m in scattering.sources(side) {
                    for pol in Pol::BOTH {
                        let from = (side, m, pol);
                        totals.push(scattering.total(from, Side::Bottom));
                        for to in Side::BOTH {
                            // In an absorbing half-space every order kept carries power, more of
                            // them the more are kept.
                            let each = scattering.sources(to);
                            orders.extend(each.map(|n| scattering.efficiency(from, (to, n))));
                        }
                        ends.push(orders.len());
                    }
                }
            }
        }
        Self { totals, orders, ends }
    }

    /// To thickness 0 from `self` on `n` slices and `finer` on n + 1.
    fn extrapolated(&self, finer: &Self, n: f64) -> Self {
        let each =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(&a, &b)| extrapolate(a, b, n)).collect();
        Self {
            totals: each(&self.totals, &finer.totals),
            orders: each(&self.orders, &finer.orders),
            ends: self.ends.clone(),
        }
    }

    /// [`hemisphere_change`] of the transmittance; a third of the root mean square, over the
    /// waves, of the largest change of an order, if that is more.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        let squares: f64 = begins
            .zip(&self.ends)
            .map(|(a, &b)| largest_change(&self.orders[a..b], &other.orders[a..b]).powi(2))
            .sum();
        let order = (squares / self.ends.len().max(1) as f64).sqrt();
        hemisphere_change(&self.totals, &other.totals).max(order / 3.0)
    }
}

/// kx0 of a line of the sample, in units of k0.
#[derive(Clone, Copy)]
enum LinePlace {
    Symmetric(SymmetricBloch),
    At(f64),
}

/// The sample of problems that all searches solve.
pub(super) struct Probe<'a> {
    pub(super) interface: &'a Interface,
    pub(super) tolerance: f64,
    lines: Vec<LinePlace>,
    ky: Vec<f64>,
    pub(super) progress: &'a Progress<'a>,
}

impl<'a> Probe<'a> {
    pub(super) fn new(
        interface: &'a Interface,
        tolerance: f64,
        progress: &'a Progress<'a>,
    ) -> Self {
        let (lines, ky) = (probed_lines(interface), probed_ky(interface));
        Self { interface, tolerance, lines, ky, progress }
    }

    fn sample(
        &self,
        truncation: Truncation,
        plan: &SlicePlan,
    ) -> Result<SampleEfficiencies, Error> {
        let stack = match self.interface.wall_following_stack(plan)? {
            Some(stack) => stack,
            None => self.interface.stack(plan)?,
        };
        let mut all = Vec::new();
        for &line in &self.lines {
            all.extend(match line {
                LinePlace::Symmetric(at) => {
                    solve_symmetric_line(&stack, at, &self.ky, truncation, self.progress)?
                }
                LinePlace::At(kx0) => solve_line(&stack, kx0, &self.ky, truncation, self.progress)?,
            });
        }
        let sample = SampleEfficiencies::new(&all);
        // Nothing compared is nothing known.
        if sample.totals.is_empty() {
            let Interface { n_top, n_bottom, .. } = *self.interface;
            return Err(Error::NoLight { n_top, n_bottom });
        }
        Ok(sample)
    }

    /// The sample by stairs, extrapolated.
    pub(super) fn by_stairs(&self, at: &Resolution) -> Result<SampleEfficiencies, Error> {
        let run = |n: usize| self.sample(at.truncation, &at.plan.thirds(n));
        let (coarse, fine) = both(|| run(3), || run(4))?;
        Ok(coarse.extrapolated(&fine, 3.0))
    }
}

/// Indices of the half-spaces that send light, the smaller and the larger; an absorbing one sends
/// none.
fn clear_indices(interface: &Interface) -> (f64, f64) {
    let clear = [interface.n_top, interface.n_bottom].map(|n| (n.im == 0.0).then_some(n.re));
    let all = || clear.into_iter().flatten();
    (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max))
}

/// Lines that stand for all: half a zone, where many orders propagate at once; with a period of
/// few orders the normal and light beside it, since half a zone may send none.
fn probed_lines(interface: &Interface) -> Vec<LinePlace> {
    let (low, high) = clear_indices(interface);
    let period = high / interface.order_spacing();
    let edge = LinePlace::Symmetric(SymmetricBloch::Edge);
    if period >= FEW_ORDERS || high == 0.0 {
        return vec![edge];
    }
    let mut lines =
        vec![LinePlace::Symmetric(SymmetricBloch::Centre), LinePlace::At(OFF_NORMAL * low)];
    if period > EDGE_PROPAGATES {
        lines.push(edge);
    }
    lines
}

/// ky that stand for all, below the critical one and, if there is anything there, above it: four
/// where many orders propagate, more where few do, so that about as many waves are looked at.
fn probed_ky(interface: &Interface) -> Vec<f64> {
    let (low, high) = clear_indices(interface);
    let count = 2 * WAVES.div_ceil(2 * (2 * interface.highest_order() + 1)).clamp(2, 8);
    let spread = |from: f64, to: f64, count: usize| {
        (0..count).map(move |i| from + (to - from) * (i as f64 + 0.5) / count as f64)
    };
    if high > 1.05 * low {
        let few = count / 4;
        let (below, above) = (spread(0.0, low, count - few), spread(low, high, few));
        below.chain(above).collect()
    } else {
        spread(0.0, 0.95 * high, count).collect()
    }
}

/// Orders and slices where walls are vertical or followed, with the estimated error.
pub(super) fn search(probe: &Probe<'_>) -> Result<(Resolution, f64), Error> {
    let Probe { interface, tolerance, .. } = *probe;
    let coarsest = interface.relief.slice_plan(1);
    let highest = interface.highest_order();
    let last_order = (3 * highest + 100).min(Truncation::MAX);
    let (first, plan, longest, slices_error) = if coarsest.is_exact() {
        let first = highest + 4 + highest / 16;
        (first + 1 + first / 12, coarsest.clone(), coarsest, 0.0)
    } else {
        let (plan, slices_error) = slices(probe, Truncation::new(highest + 1)?, &coarsest)?;
        let more = FIRST_ORDERS * depth(interface).sqrt() * (1e-3 / tolerance).powf(0.4);
        let count = (FOR_ORDERS * plan.count() as f64).ceil() as usize;
        let longest = interface.relief.slice_plan(count);
        (highest + 4 + more.round() as usize, plan, longest, slices_error)
    };
    let allowed = (tolerance - slices_error).min(0.95 * tolerance);
    let range = first.min(last_order)..=last_order;
    let (truncation, orders_error) = orders(probe, range, &longest, allowed)?;
    let plan = fine_enough(interface, &plan, truncation, tolerance);
    let found = Resolution { truncation, plan };
    let rounding = rounding_error(interface.order_spacing(), truncation);
    if rounding > tolerance {
        return Err(found.not_converged(Limit::Digits, tolerance, tolerance, rounding));
    }
    let estimate = (slices_error + orders_error).max(MIN_CLAIM * tolerance).max(rounding);
    Ok((found, estimate))
}

/// Slices beyond which none are tried.
fn max_slices(coarsest: &SlicePlan, half_wavelengths: f64) -> usize {
    400 + 30 * coarsest.count() + (100.0 * half_wavelengths) as usize
}

/// `plan`, its slices cut where slanted walls are followed so that their corrections stay small
/// for all orders at `tolerance`.
pub(super) fn fine_enough(
    interface: &Interface,
    plan: &SlicePlan,
    truncation: Truncation,
    tolerance: f64,
) -> SlicePlan {
    if !interface.follows_walls() || plan.is_exact() {
        return plan.clone();
    }
    let max =
        if is_of_high_contrast(interface) { MAX_EXPONENT_AT_HIGH_CONTRAST } else { MAX_EXPONENT };
    let steepest = truncation.highest() as f64 * interface.order_spacing();
    let max = max * (tolerance / 1e-3).min(1.0).powf(EXPONENT_BY_TOLERANCE);
    let height = max * interface.wavelength / (TAU * steepest);
    let coarsest = interface.relief.slice_plan(1);
    plan.no_higher(height, max_slices(&coarsest, half_wavelengths(interface, &coarsest)))
}

/// Half wavelengths of the densest medium on the sides that are cut.
fn half_wavelengths(interface: &Interface, plan: &SlicePlan) -> f64 {
    2.0 * densest(interface) * plan.stairs() / interface.wavelength
}

/// Half wavelengths of the densest medium on the depth of the relief.
fn depth(interface: &Interface) -> f64 {
    2.0 * densest(interface) * interface.relief.depth() / interface.wavelength
}

fn densest(interface: &Interface) -> f64 {
    let outside = interface.n_top.re.max(interface.n_bottom.re);
    outside.max(interface.relief.densest())
}

/// A plan of slices that follow the sides, and the error that they leave: the difference to a third
/// more, continued by their law.
fn slices(
    probe: &Probe<'_>,
    truncation: Truncation,
    coarsest: &SlicePlan,
) -> Result<(SlicePlan, f64), Error> {
    let tolerance = probe.tolerance;
    let relief = &probe.interface.relief;
    let allowed = SLICES_PART * tolerance;
    let safety = followed_law(probe.interface, tolerance).safety;
    let law = Law { exponent: SLICES_EXPONENT, safety };
    let half_wavelengths = half_wavelengths(probe.interface, coarsest);
    let usual = FIRST_SLICES * depth(probe.interface).sqrt();
    let effort = (1e-3 / tolerance).powf(0.2) * usual.min(1.1 * half_wavelengths);
    let mut count = (effort.ceil() as usize).max(2 * coarsest.count());
    let max = max_slices(coarsest, half_wavelengths);
    loop {
        let plans = [count, (count as f64 * FOLLOWED_REFERENCE).ceil() as usize + 1]
            .map(|count| relief.slice_plan(count));
        let raised = fine_enough(probe.interface, &plans[0], truncation, tolerance);
        let plans = if raised == plans[0] {
            plans
        } else {
            let finer = raised.scaled(FOLLOWED_REFERENCE);
            [raised, finer]
        };
        let (here, there) =
            both(|| probe.sample(truncation, &plans[0]), || probe.sample(truncation, &plans[1]))?;
        let counts = plans.each_ref().map(|plan| plan.count() as f64);
        let ratio = counts[0] / counts[1];
        let estimate = law.left_by_coarser(here.distance(&there), ratio);
        let growth = law.growth(estimate, allowed).max(1.0);
        if growth * ratio <= 1.0 {
            let plan = relief.slice_plan((counts[0] * growth).ceil() as usize);
            let left = estimate * law.fall(counts[0] / plan.count() as f64);
            return Ok((plan, left));
        }
        count = (counts[0] * growth.min(1.4)).ceil() as usize;
        if count > max {
            let [plan, _] = plans;
            let last = Resolution { truncation, plan };
            return Err(last.not_converged(Limit::Slices, tolerance, allowed, estimate));
        }
    }
}

/// Orders out of a growing sequence, and the error they leave. Each is compared with about a third
/// more, and the difference continued by the law M⁻² or slower, which corners and jumps of the
/// fields make it follow, or M⁻³ or M⁻² where slanted walls are followed. Of the tolerance,
/// `allowed` is theirs.
fn orders(
    probe: &Probe<'_>,
    range: RangeInclusive<usize>,
    plan: &SlicePlan,
    allowed: f64,
) -> Result<(Truncation, f64), Error> {
    // All on the slices that the finest asks for.
    let slices = |finest: usize| {
        let truncation = Truncation::new(finest)?;
        Ok::<_, Error>(fine_enough(probe.interface, plan, truncation, probe.tolerance))
    };
    let at = |m: usize, plan: &SlicePlan| probe.sample(Truncation::new(m)?, plan);
    let grown = |m: usize, by: f64| (m as f64 * by).ceil() as usize;
    let follows_walls = probe.interface.follows_walls() && !plan.is_exact();
    let (law, reference_by) = if follows_walls {
        (followed_law(probe.interface, probe.tolerance), FOLLOWED_ORDERS)
    } else {
        (unfollowed_law(probe.interface), REFERENCE)
    };
    let mut m = *range.start();
    let mut finest = grown(m, reference_by);
    let mut plan = slices(finest)?;
    let (mut here, mut reference) = both(|| at(m, &plan), || at(finest, &plan))?;
    loop {
        let ratio = m as f64 / finest as f64;
        let mut estimate = law.left_by_coarser(here.distance(&reference), ratio);
        if estimate <= allowed && !follows_walls && law != ORDERS {
            for neighbour in m + 1..=m + NEIGHBOURS {
                estimate = estimate.max(law.safety * here.distance(&at(neighbour, &plan)?));
            }
        }
        if estimate <= allowed {
            return Ok((Truncation::new(m)?, estimate));
        }
        let growth = law.growth(estimate, allowed);
        if follows_walls && growth * ratio <= 1.0 {
            // Between the two the law need not be trusted far.
            let enough = grown(m, growth).min(finest);
            let left = estimate * law.fall(m as f64 / enough as f64);
            return Ok((Truncation::new(enough)?, left));
        }
        // As far as the law says, but never far at once.
        m = grown(m, growth.clamp(1.06, 1.15)).max(m + 1);
        if m > *range.end() {
            return Err(Error::NotConverged {
                limit: Limit::Orders,
                tolerance: probe.tolerance,
                allowed,
                estimate,
                truncation: m,
                slices: plan.count(),
            });
        }
        if grown(m, MIN_REFERENCE) <= finest {
            here = at(m, &plan)?;
        } else {
            finest = grown(m, reference_by);
            plan = slices(finest)?;
            (here, reference) = both(|| at(m, &plan), || at(finest, &plan))?;
        }
    }
}

/// Two samples side by side.
fn both(
    a: impl FnOnce() -> Result<SampleEfficiencies, Error> + Send,
    b: impl FnOnce() -> Result<SampleEfficiencies, Error> + Send,
) -> Result<(SampleEfficiencies, SampleEfficiencies), Error> {
    let (a, b) = rayon::join(a, b);
    Ok((a?, b?))
}
