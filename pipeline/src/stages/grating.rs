// SPDX-License-Identifier: MIT OR Apache-2.0
//! One grating and one incident wave → the efficiency of every order, as `batwing grating` prints them.
//!
//! Layers are solved as they are. A relief is cut into slices, solved on s and on 2s of them, and extrapolated (an even power
//! series in the thickness loses its first term); s grows until that is quiet. With a tolerance, the orders grow too.
//! The estimated error is what a third more orders, and a third more slices, would change, extended to all further steps.

mod jones;

use anyhow::Result;
use rcwa::convergence::{Range, converge, largest_change};
use rcwa::jones::Matrix;
use rcwa::relief::{Layer, Relief};
use rcwa::solve::highest_order;
use rcwa::{Bloch, Error, Pol, Scattering, Side, Stack, Truncation};
use serde_json::{Map, Value};

use crate::case::{Accuracy, Case, Polarization, Structure};

/// Error that slices may leave where orders are given instead of a tolerance.
const SLICE_TOLERANCE: f64 = 1e-6;
/// Most slices tried, per wavelength of depth.
const MOST_SLICES_PER_WAVELENGTH: f64 = 2000.0;

/// Efficiencies of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Efficiencies {
    /// One entry for each order that carries power away: half-space, order, part in TE, part in TM.
    pub orders: Vec<(Side, i32, f64, f64)>,
    /// Highest order kept.
    pub truncation: usize,
    /// Layers, or slices of the finer of the two runs.
    pub slices: usize,
    /// Largest error of an efficiency, estimated.
    pub estimated_error: f64,
    /// Highest order that propagates, if it was not kept.
    pub too_few_for: Option<usize>,
    /// Jones matrices of the orders in `orders`, if the case asks for them.
    pub jones: Option<Vec<Matrix>>,
}

/// The case, ready to be solved at any resolution.
struct Problem<'a> {
    case: &'a Case,
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

    fn solve(
        &self,
        layers: Vec<Layer>,
        truncation: Truncation,
    ) -> Result<Vec<(Side, i32, f64, f64)>, Error> {
        let stack = self.stack(layers)?;
        let scattering = rcwa::solve(&stack, self.bloch(&stack), truncation)?;
        // So close to grazing that rounding leaves it no wavevector along z.
        if scattering.source(Side::Top, 0).is_none() {
            return Err(Error::Evanescent {
                order: 0,
                side: Side::Top,
            });
        }
        Ok(self.read(&scattering))
    }

    /// The orders of `relief` on `slices` slices and on twice as many, extrapolated.
    fn solve_relief(
        &self,
        relief: &Relief,
        truncation: Truncation,
        slices: usize,
    ) -> Result<Vec<(Side, i32, f64, f64)>, Error> {
        let plan = relief.slice_plan(slices);
        let mut coarse = self.solve(relief.layers(&plan), truncation)?;
        if plan.is_exact() {
            return Ok(coarse);
        }
        let fine = self.solve(relief.layers(&plan.refined(2)), truncation)?;
        for (c, f) in coarse.iter_mut().zip(&fine) {
            c.2 = (4.0 * f.2 - c.2) / 3.0;
            c.3 = (4.0 * f.3 - c.3) / 3.0;
        }
        Ok(coarse)
    }

    fn read(&self, s: &Scattering) -> Vec<(Side, i32, f64, f64)> {
        let incident: &[(Pol, f64)] = match self.case.polarization {
            Polarization::S => &[(Pol::S, 1.0)],
            Polarization::P => &[(Pol::P, 1.0)],
            Polarization::Unpolarised => &[(Pol::S, 0.5), (Pol::P, 0.5)],
        };
        let part = |to: (Side, i32), pol| {
            incident
                .iter()
                .map(|&(p, share)| share * s.efficiency_in((Side::Top, 0, p), to, pol))
                .sum()
        };
        [Side::Top, Side::Bottom]
            .into_iter()
            .flat_map(|side| s.orders(side).map(move |m| (side, m)))
            .map(|(side, m)| (side, m, part((side, m), Pol::S), part((side, m), Pol::P)))
            .collect()
    }
}

/// Solves `case`.
pub fn solve(case: &Case) -> Result<Efficiencies> {
    let problem = Problem { case };
    let highest = {
        let stack = problem.stack(Vec::new())?;
        highest_order(&stack, problem.bloch(&stack))
    };
    let (relief, layers) = match &case.structure {
        Structure::Layers(layers) => (None, layers.clone()),
        Structure::Relief(relief) => (Some(relief), Vec::new()),
    };
    let at = |truncation: Truncation, slices: usize| match relief {
        Some(relief) => problem.solve_relief(relief, truncation, slices),
        None => problem.solve(layers.clone(), truncation),
    };
    let sliced = relief.filter(|r| !r.slice_plan(1).is_exact());
    let depth = relief.map_or(0.0, |r| r.depth() / case.wavelength);
    // At least three slices between two kinks: with fewer a step of the search would change hardly any.
    let kinks = sliced.map_or(0, |r| r.slice_plan(1).count());
    let (first, last) = (
        ((8.0 * depth).ceil() as usize + 8).max(3 * kinks),
        (MOST_SLICES_PER_WAVELENGTH * depth).ceil() as usize + 4000 + 10 * kinks,
    );
    let values = |orders: &[(Side, i32, f64, f64)]| {
        orders.iter().flat_map(|o| [o.2, o.3]).collect::<Vec<f64>>()
    };

    let (truncation, slices, slice_error, order_error) = match case.accuracy {
        Accuracy::Orders(n) => {
            let kept = Truncation::new(n)?;
            let (slices, slice_error) = match sliced {
                Some(_) => quiet(first, last, |s| Ok(values(&at(kept, s)?)))?,
                None => (1, 0.0),
            };
            let more = Truncation::new((n + n.div_ceil(3)).max(n + 1))?;
            (
                kept,
                slices,
                slice_error,
                change(&at(kept, slices)?, &at(more, slices)?),
            )
        }
        Accuracy::Tolerance(tolerance) => {
            let range = Range {
                first_order: highest + 2,
                last_order: (8 * highest + 400).min(Truncation::MAX),
                first_slices: sliced.map(|_| first),
                last_slices: last,
            };
            let found = converge(tolerance, range, largest_change, |truncation, slices| {
                Ok(values(&at(truncation, slices)?))
            })?;
            (found.truncation, found.slices, 0.0, found.estimated_error)
        }
    };
    let cut = relief.map(|r| r.slice_plan(slices));
    let jones = if case.jones {
        Some(problem.jones(relief, &layers, truncation, slices)?)
    } else {
        None
    };
    Ok(Efficiencies {
        jones,
        orders: at(truncation, slices)?,
        truncation: truncation.highest(),
        slices: cut.map_or(layers.len(), |plan| {
            if plan.is_exact() {
                plan.count()
            } else {
                plan.refined(2).count()
            }
        }),
        estimated_error: slice_error + order_error,
        too_few_for: (truncation.highest() < highest).then_some(highest),
    })
}

/// The first number of slices, growing by half each time, after which the values rest, with the last change.
fn quiet(
    first: usize,
    last: usize,
    mut evaluate: impl FnMut(usize) -> Result<Vec<f64>, Error>,
) -> Result<(usize, f64), Error> {
    let mut slices = first;
    let mut values = evaluate(slices)?;
    loop {
        let next = slices + slices.div_ceil(2);
        let finer = evaluate(next)?;
        let moved = values
            .iter()
            .zip(&finer)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        if moved <= SLICE_TOLERANCE || next > last {
            return Ok((next, moved));
        }
        (slices, values) = (next, finer);
    }
}

/// Largest difference of an efficiency between two lists; orders that only one of them has count in full.
fn change(a: &[(Side, i32, f64, f64)], b: &[(Side, i32, f64, f64)]) -> f64 {
    let of = |list: &[(Side, i32, f64, f64)], side, m| {
        list.iter()
            .find(|o| o.0 == side && o.1 == m)
            .map_or(0.0, |o| o.2 + o.3)
    };
    a.iter()
        .chain(b)
        .map(|o| (of(a, o.0, o.1) - of(b, o.0, o.1)).abs())
        .fold(0.0, f64::max)
}

impl Efficiencies {
    /// Sum over the orders of a half-space.
    pub fn total(&self, side: Side) -> f64 {
        self.orders
            .iter()
            .filter(|o| o.0 == side)
            .map(|o| o.2 + o.3)
            .sum()
    }

    /// What the command prints.
    pub fn to_json(&self) -> Value {
        let of = |side: Side, part: fn(&(Side, i32, f64, f64)) -> f64| -> Value {
            let entries = self.orders.iter().filter(|o| o.0 == side);
            entries
                .map(|o| (o.1.to_string(), Value::from(part(o))))
                .collect::<Map<_, _>>()
                .into()
        };
        let (reflected, transmitted) = (self.total(Side::Top), self.total(Side::Bottom));
        let mut json = serde_json::json!({
            "R": of(Side::Top, |o| o.2 + o.3),
            "T": of(Side::Bottom, |o| o.2 + o.3),
            "RTE": of(Side::Top, |o| o.2),
            "RTM": of(Side::Top, |o| o.3),
            "TTE": of(Side::Bottom, |o| o.2),
            "TTM": of(Side::Bottom, |o| o.3),
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

    pub(super) fn solved(text: &str) -> Efficiencies {
        solve(&Case::parse("case", text).expect("valid")).expect("solved")
    }

    #[test]
    fn grazing_light_that_rounding_stops_is_refused() {
        let text = r#"{"wavelength": 0.55, "period": 1, "n_top": [1, 0], "n_bottom": [1.5, 0], "layers_top_to_bottom": [], "theta_deg": 89.9999999999, "pol": "s", "N": 3}"#;
        let error = solve(&Case::parse("case", text).expect("valid")).expect_err("refused");
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
                .find(|l| l.0 == o.0 && l.1 == o.1)
                .expect("the same orders");
            assert!(
                (same.2 + same.3 - o.2 - o.3).abs() < 0.003 + tight.estimated_error,
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
