// SPDX-License-Identifier: MIT OR Apache-2.0
//! One grating and one incident wave: the efficiency of every order.
//!
//! Layers are solved as they are. With a tolerance, a dielectric relief is solved as tables are:
//! its slices follow its slanted walls, at a resolution that suits the whole hemisphere (`walls`).
//! Any other relief, and any with a given number of orders, is solved on s and on 2s slices as
//! stairs and extrapolated: an even power series in the thickness loses its first term. s grows
//! until the result is stable; with a tolerance the orders grow too (`search`). The estimated error
//! extends what more orders and more slices change to all further steps.

mod jones;
mod search;
mod walls;

use std::cell::RefCell;
use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};
use rcwa::jones::Matrix;
use rcwa::relief::{Layer, Relief, extrapolate};
use rcwa::solve::{highest_order, solve_line};
use rcwa::{Bloch, Error, Pol, Progress, Scattering, Side, Stack, Truncation};
use serde_json::{Map, Value};

use metrics::plural::count;
use search::{Range, Resolution, Search, SearchResult};

use crate::grating_case::{Accuracy, Case, Polarization, Structure};

/// Error that slices may leave where orders are given instead of a tolerance: absolute, and as a
/// share of the error of the orders.
const SLICE_TOLERANCE: f64 = 1e-6;
const SLICE_SHARE: f64 = 0.01;
/// Most slices tried, per wavelength of depth.
const MOST_SLICES_PER_WAVELENGTH: f64 = 2000.0;
/// Most orders on either side that may propagate; beyond it directions merge.
const MOST_PROPAGATING: usize = 1_000_000;
/// Cost of a complex eigenproblem relative to a real one.
const ABSORBING: f64 = 10.0;

/// The efficiency of an order that carries power away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderEfficiency {
    /// Half-space that it leaves into.
    pub side: Side,
    /// Number of the order.
    pub order: i32,
    /// Part in TE.
    pub te: f64,
    /// Part in TM.
    pub tm: f64,
}

impl OrderEfficiency {
    fn total(&self) -> f64 {
        self.te + self.tm
    }
}

/// The orders of incident light in s and in p.
type Answer = [Vec<OrderEfficiency>; 2];

/// Efficiencies of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Efficiencies {
    /// One entry for each order that carries power away.
    pub orders: Vec<OrderEfficiency>,
    /// Highest order kept.
    pub truncation: usize,
    /// Layers, or slices of the finer of the two runs.
    pub slices: usize,
    /// Largest error of an efficiency, estimated.
    pub estimated_error: f64,
    /// Highest order that propagates, if it was not kept.
    pub too_few_for: Option<usize>,
    /// Error of the slices, where it is above the aim.
    pub coarse_slices: Option<f64>,
    /// Why the estimated error is above the tolerance, where it is.
    pub missed: Option<String>,
    /// Jones matrices of the orders in `orders`, if the case asks for them.
    pub jones: Option<Vec<Matrix>>,
}

/// A case to be solved at several resolutions.
struct Problem<'a> {
    case: &'a Case,
    progress: &'a Progress<'a>,
}

impl Problem<'_> {
    fn stack(&self, layers: Vec<Layer>) -> Result<Stack, Error> {
        let c = self.case;
        Stack::new(c.wavelength, c.period, c.n_top, c.n_bottom, layers)
    }

    fn bloch(&self, stack: &Stack) -> Bloch {
        Bloch::from_angles(
            stack,
            Side::Top,
            self.case.theta_deg.to_radians(),
            self.case.phi_deg.to_radians(),
        )
    }

    fn solve(&self, stack: &Stack, truncation: Truncation) -> Result<Answer, Error> {
        let bloch = self.bloch(stack);
        let scattering = if turned_at_normal(self.case) {
            rcwa::solve(stack, bloch, truncation)?
        } else {
            solve_line(stack, bloch.kx0, &[bloch.ky], truncation, self.progress)?.remove(0)
        };
        // Rounding leaves a wave so close to grazing no wavevector along z.
        if scattering.source(Side::Top, 0).is_none() {
            return Err(Error::Evanescent { order: 0, side: Side::Top });
        }
        Ok(Pol::BOTH.map(|incident| read(&scattering, incident)))
    }

    /// The orders of `relief` on `slices` slices and on twice as many, extrapolated.
    fn solve_relief(
        &self,
        relief: &Relief,
        truncation: Truncation,
        slices: usize,
    ) -> Result<Answer, Error> {
        let plan = relief.slice_plan(slices);
        let mut coarse = self.solve(&self.stack(relief.layers(&plan))?, truncation)?;
        if plan.is_exact() {
            return Ok(coarse);
        }
        let fine = relief.layers(&plan.refined(2));
        let fine = self.solve(&self.stack(fine)?, truncation)?;
        for (c, f) in coarse.iter_mut().flatten().zip(fine.iter().flatten()) {
            c.te = extrapolate(c.te, f.te, 1.0);
            c.tm = extrapolate(c.tm, f.tm, 1.0);
        }
        Ok(coarse)
    }

    /// The orders of the case's own polarisation.
    fn own(&self, [s, p]: &Answer) -> Vec<OrderEfficiency> {
        match self.case.polarization {
            Polarization::S => s.clone(),
            Polarization::P => p.clone(),
            Polarization::Unpolarised => s
                .iter()
                .zip(p)
                .map(|(s, p)| OrderEfficiency {
                    te: 0.5 * (s.te + p.te),
                    tm: 0.5 * (s.tm + p.tm),
                    ..*s
                })
                .collect(),
        }
    }

    /// Largest difference between two answers in the case's own polarisation.
    fn change(&self, a: &Answer, b: &Answer) -> f64 {
        change(&self.own(a), &self.own(b))
    }
}

/// True if light comes along the normal with s and p turned about it.
fn turned_at_normal(case: &Case) -> bool {
    case.theta_deg.abs() <= 0.0 && case.phi_deg.abs() > 0.0
}

fn read(scattering: &Scattering, incident: Pol) -> Vec<OrderEfficiency> {
    let part = |to, pol| scattering.efficiency_in((Side::Top, 0, incident), to, pol);
    [Side::Top, Side::Bottom]
        .into_iter()
        .flat_map(|side| scattering.orders(side).map(move |m| (side, m)))
        .map(|to| OrderEfficiency {
            side: to.0,
            order: to.1,
            te: part(to, Pol::S),
            tm: part(to, Pol::P),
        })
        .collect()
}

/// Solves `case`; `progress` may stop it between two layers.
///
/// # Errors
/// Errors of the solver; a tolerance out of reach.
pub fn solve(case: &Case, progress: &Progress<'_>) -> Result<Efficiencies> {
    let problem = Problem { case, progress };
    let highest = {
        let stack = problem.stack(Vec::new())?;
        highest_order(&stack, problem.bloch(&stack))
    };
    ensure!(
        highest <= MOST_PROPAGATING,
        "period: expected a length at which at most {MOST_PROPAGATING} orders propagate, got {} at a wavelength of {}",
        case.period,
        case.wavelength
    );
    if let Some((interface, tolerance)) = walls::followed(case) {
        return problem.follow_walls(&interface, tolerance, highest);
    }
    let (relief, layers) = match &case.structure {
        Structure::Layers(layers) => (None, layers.clone()),
        Structure::Relief(relief) => (Some(relief), Vec::new()),
    };
    // A search asks for its last steps again at its end.
    let made: RefCell<BTreeMap<Resolution, Answer>> = RefCell::default();
    let at = |resolution: Resolution| -> Result<Answer, Error> {
        if let Some(answer) = made.borrow().get(&resolution) {
            return Ok(answer.clone());
        }
        let truncation = Truncation::new(resolution.order)?;
        let answer = match relief {
            Some(relief) => problem.solve_relief(relief, truncation, resolution.slices)?,
            None => problem.solve(&problem.stack(layers.clone())?, truncation)?,
        };
        made.borrow_mut().insert(resolution, answer.clone());
        Ok(answer)
    };
    let range = range(case, relief, highest)?;
    let (found, coarse_slices) = match case.accuracy {
        Accuracy::Orders(n) => given_orders(&problem, range, n, at)?,
        Accuracy::Tolerance(tolerance) => {
            let own = |a: &Answer, b: &Answer| problem.change(a, b);
            let found = Search::new(range, own, at).both(tolerance)?;
            if let Some(limit) = found.limit.filter(|_| found.errors.orders.is_infinite()) {
                bail!("tolerance: {tolerance:e} is out of reach: the first step takes {limit}");
            }
            (found, None)
        }
    };
    let orders = problem.own(&at(found.at)?);
    let slices = match relief.map(|r| r.slice_plan(found.at.slices)) {
        None => layers.len(),
        Some(plan) if plan.is_exact() => plan.count(),
        Some(plan) => plan.refined(2).count(),
    };
    let jones = if case.jones {
        let truncation = Truncation::new(found.at.order)?;
        Some(problem.jones(relief, &layers, truncation, found.at.slices)?)
    } else {
        None
    };
    Ok(Efficiencies {
        jones,
        orders,
        truncation: found.at.order,
        slices,
        estimated_error: found.errors.slices + found.errors.orders,
        too_few_for: (found.at.order < highest).then_some(highest),
        coarse_slices,
        missed: match case.accuracy {
            Accuracy::Tolerance(tolerance) => missed(&found, tolerance),
            Accuracy::Orders(_) => None,
        },
    })
}

/// Slices for `n` as the highest order, and their error where it is above the aim. Both
/// polarisations decide the slices, so that s, p and unpolarised light are solved on one structure.
/// The errors are those of the case's polarisation.
fn given_orders(
    problem: &Problem,
    range: Range,
    n: usize,
    at: impl Fn(Resolution) -> Result<Answer, Error>,
) -> Result<(SearchResult, Option<f64>)> {
    let either = |[s, p]: &Answer, [t, q]: &Answer| change(s, t).max(change(p, q));
    let mut found = if range.sliced {
        Search::new(range, either, &at).slices(SLICE_TOLERANCE, SLICE_SHARE)?
    } else {
        SearchResult::at_first(range)
    };
    let here = at(found.at)?;
    let order = (n + n.div_ceil(3)).max(n + 1);
    let more = at(Resolution { order, ..found.at })?;
    found.errors.orders = search::left_by_orders(problem.change(&here, &more), n, order);
    if !range.sliced {
        return Ok((found, None));
    }
    found.errors.slices = search::left(problem.change(&here, &at(found.at.more_slices())?), None);
    let enough = SLICE_TOLERANCE.max(SLICE_SHARE * found.errors.orders);
    let too_much = found.limit.is_some() && found.errors.slices > enough;
    let coarse = too_much.then_some(found.errors.slices);
    Ok((found, coarse))
}

/// Range of the search for `case`, of which orders up to `highest` propagate.
fn range(case: &Case, relief: Option<&Relief>, highest: usize) -> Result<Range> {
    let (first_order, last_order) = match case.accuracy {
        Accuracy::Orders(n) => (n, Truncation::MAX),
        Accuracy::Tolerance(_) => (highest + 2, (8 * highest + 400).min(Truncation::MAX)),
    };
    ensure!(
        first_order <= Truncation::MAX,
        "tolerance: expected a period at which at most {} orders propagate, got {highest}; `N` solves with fewer",
        Truncation::MAX - 2
    );
    let coarsest = relief.map(|r| r.slice_plan(1));
    let sliced = coarsest.as_ref().is_some_and(|plan| !plan.is_exact());
    // At least three slices between two kinks: with fewer, a step of the search changes little.
    let kinks = coarsest.map_or(0, |plan| plan.count());
    let depth = relief.map_or(0.0, |r| r.depth() / case.wavelength);
    let (first_slices, last_slices) = if sliced {
        (
            ((8.0 * depth).ceil() as usize + 8).max(3 * kinks),
            (MOST_SLICES_PER_WAVELENGTH * depth).ceil() as usize + 4000 + 10 * kinks,
        )
    } else {
        (1, 1)
    };
    let lossless = match &case.structure {
        Structure::Layers(layers) => layers.iter().all(Layer::is_lossless),
        Structure::Relief(relief) => {
            relief.background().im == 0.0 && relief.polygons().iter().all(|p| p.index.im == 0.0)
        }
    };
    Ok(Range {
        first: Resolution { order: first_order, slices: first_slices },
        last: Resolution { order: last_order, slices: last_slices },
        sliced,
        weight: if lossless { 1.0 } else { ABSORBING },
    })
}

/// Why the error of a search is above `tolerance`, where it is.
fn missed(found: &SearchResult, tolerance: f64) -> Option<String> {
    let (at, errors) = (found.at, found.errors);
    let limit = found.limit?;
    if errors.orders + errors.slices <= tolerance {
        return None;
    }
    let slices = match errors.slices {
        0.0 => String::new(),
        e if e.is_infinite() => format!(", unknown by {}", count(at.slices, "slice")),
        e => format!(", {e:.1e} by {}", count(at.slices, "slice")),
    };
    Some(format!(
        "tolerance: {tolerance:e} was not reached, the next step takes {limit}; reached: an error of {:.1e} by orders -{m}..{m}{slices}",
        errors.orders,
        m = at.order
    ))
}

/// Largest difference of an efficiency or of a part of it between two lists; orders that only one
/// of them has count in full.
fn change(a: &[OrderEfficiency], b: &[OrderEfficiency]) -> f64 {
    let of = |list: &[OrderEfficiency], like: &OrderEfficiency| {
        let same = |o: &&OrderEfficiency| (o.side, o.order) == (like.side, like.order);
        list.iter().find(same).map_or([0.0, 0.0], |o| [o.te, o.tm])
    };
    let differences = a.iter().chain(b).map(|o| {
        let (a, b) = (of(a, o), of(b, o));
        let [te, tm] = [a[0] - b[0], a[1] - b[1]];
        te.abs().max(tm.abs()).max((te + tm).abs())
    });
    differences.fold(0.0, f64::max)
}

impl Efficiencies {
    /// Sum over the orders of a half-space.
    pub fn total(&self, side: Side) -> f64 {
        self.orders.iter().filter(|o| o.side == side).map(OrderEfficiency::total).sum()
    }

    /// The JSON that `batwing grating` prints.
    pub fn to_json(&self) -> Value {
        let of = |side: Side, part: fn(&OrderEfficiency) -> f64| -> Value {
            let entries = self.orders.iter().filter(|o| o.side == side);
            entries
                .map(|o| (o.order.to_string(), Value::from(part(o))))
                .collect::<Map<_, _>>()
                .into()
        };
        let (reflected, transmitted) = (self.total(Side::Top), self.total(Side::Bottom));
        let mut json = serde_json::json!({
            "R": of(Side::Top, OrderEfficiency::total),
            "T": of(Side::Bottom, OrderEfficiency::total),
            "RTE": of(Side::Top, |o| o.te),
            "RTM": of(Side::Top, |o| o.tm),
            "TTE": of(Side::Bottom, |o| o.te),
            "TTM": of(Side::Bottom, |o| o.tm),
            "R_total": reflected,
            "T_total": transmitted,
            "absorbed": 1.0 - reflected - transmitted,
            "N": self.truncation,
            "slices": self.slices,
            "estimated_error": self.estimated_error,
        });
        if let Some(matrices) = &self.jones {
            json["JR"] = jones::to_json(&self.orders, matrices, Side::Top);
            json["JT"] = jones::to_json(&self.orders, matrices, Side::Bottom);
        }
        json
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rcwa::no_progress;

    pub(super) fn solved(text: &str) -> Efficiencies {
        solve(&Case::parse("case", text).expect("valid"), &no_progress).expect("solved")
    }

    #[test]
    fn grazing_light_that_rounding_stops_is_refused() {
        let text = r#"{"wavelength": 0.55, "period": 1, "n_top": [1, 0], "n_bottom": [1.5, 0], "layers_top_to_bottom": [], "theta_deg": 89.9999999999, "pol": "s", "N": 3}"#;
        let error =
            solve(&Case::parse("case", text).expect("valid"), &no_progress).expect_err("refused");
        assert!(error.to_string().contains("does not propagate"), "{error}");
    }

    #[test]
    fn bare_interface_reflects_as_fresnel_says() {
        let e = solved(
            r#"{"wavelength": 0.55, "period": 1, "n_top": [1.41, 0], "n_bottom": [1, 0], "layers_top_to_bottom": [], "theta_deg": 40, "phi_deg": 25, "pol": "p", "N": 3}"#,
        );
        assert!((e.total(Side::Top) - 0.015_622_804_8).abs() < 1e-9, "{e:?}");
        assert!(
            (e.to_json()["RTM"]["0"].as_f64().expect("a number") - 0.015_622_804_8).abs() < 1e-9
        );
        assert!(e.estimated_error < 1e-12);
        assert_eq!(e.too_few_for, None);
    }

    /// Along the normal s at azimuth 90 degrees is p at azimuth 0, and half of each at 45 degrees,
    /// on layers and on slanted walls.
    #[test]
    fn polarisation_turns_with_the_azimuth_at_normal_incidence() {
        let structures = [
            r#""layers_top_to_bottom": [{"thickness": 0.4, "segments": [{"x0": 0, "x1": 0.4, "n": [1.41, 0]}, {"x0": 0.4, "x1": 1, "n": [1, 0]}]}]"#,
            r#""relief": {"depth": 0.7, "background": [1, 0], "polygons": [{"n": [1.41, 0], "points": [[0, 0], [1.7, 0.7], [2, 0]]}]}"#,
        ];
        for structure in structures {
            let total = |phi: f64, pol: &str| {
                let text = format!(
                    r#"{{"wavelength": 0.55, "period": 2, "n_top": [1.41, 0], "n_bottom": [1, 0], {structure}, "theta_deg": 0, "phi_deg": {phi}, "pol": "{pol}", "N": 12}}"#
                );
                solved(&text).total(Side::Top)
            };
            let [s, p] = ["s", "p"].map(|pol| total(0.0, pol));
            assert!((s - p).abs() > 1e-3, "{s} {p}");
            assert!((total(90.0, "s") - p).abs() < 1e-9);
            assert!((total(90.0, "p") - s).abs() < 1e-9);
            assert!((total(45.0, "s") - 0.5 * (s + p)).abs() < 1e-9);
        }
    }

    #[test]
    fn tolerance_finds_orders_and_slices() {
        let case = |accuracy: &str| {
            format!(
                r#"{{"wavelength": 0.55, "period": 2, "n_top": [1.41, 0], "n_bottom": [1, 0], "relief": {{"depth": 0.7, "background": [1, 0],
                "polygons": [{{"n": [1.41, 0], "points": [[0, 0], [1.7, 0.7], [2, 0]]}}]}}, "theta_deg": 10, "pol": "unpolarised", {accuracy}}}"#
            )
        };
        let loose = solved(&case(r#""tolerance": 0.003"#));
        let tight = solved(&case(r#""N": 40"#));
        assert!(loose.estimated_error <= 0.003 && loose.slices > 8);
        for o in &tight.orders {
            let same = loose
                .orders
                .iter()
                .find(|l| (l.side, l.order) == (o.side, o.order))
                .expect("the same orders");
            assert!(
                (same.te + same.tm - o.te - o.tm).abs() < 0.003 + tight.estimated_error,
                "{o:?} {same:?}"
            );
        }
        assert!((tight.total(Side::Top) + tight.total(Side::Bottom) - 1.0).abs() < 1e-10);
    }

    #[test]
    fn fewer_orders_than_propagate_are_noticed() {
        let e = solved(
            r#"{"wavelength": 0.5, "period": 2, "n_top": [1, 0], "n_bottom": [1.5, 0], "layers_top_to_bottom": [], "theta_deg": 0, "pol": "s", "N": 2}"#,
        );
        assert_eq!(e.too_few_for, Some(6));
    }
}
