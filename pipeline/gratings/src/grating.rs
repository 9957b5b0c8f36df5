// SPDX-License-Identifier: MIT OR Apache-2.0
//! One grating and one incident wave: the efficiency of every order.
//!
//! Orders solve layers as they are. With a tolerance, `rcwa::accuracy` finds orders and slices; those
//! of a dielectric relief follow its slanted walls. A relief with a given number of orders is solved
//! on s and on 2s slices as stairs and extrapolated: an even power series in the thickness loses its
//! first term. Boundary integrals solve, in the plane across the grooves, one surface between the
//! half-spaces: profiles, reliefs whose walls orders cannot follow, and reliefs of which they miss the
//! tolerance.

mod jones;

use anyhow::{Context, Result, bail, ensure};
use rcwa::accuracy::{self, Found, NOTHING_KNOWN, Waves, converge_waves, settle_slices, unsettled};
use rcwa::error::kept_orders;
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::jones::Matrix;
use rcwa::relief::{Layer, Relief, extrapolate};
use rcwa::solve::{highest_order, solve_line};
use rcwa::{Bloch, Error, Pol, Progress, Scattering, Side, Stack, Truncation};
use serde_json::{Map, Value};

use metrics::plural::count;

use crate::boundary_integral::{Converged, Grating, Outline};
use crate::grating_case::{Accuracy, Case, Polarization, Structure};
use crate::methods::{choose, missed};

/// Error that slices may leave where orders are given instead of a tolerance: absolute, and as a
/// part of the error of the orders.
const SLICE_TOLERANCE: f64 = 1e-6;
const SLICE_PART: f64 = 0.01;
/// That part where walls cannot be followed: their stairs and orders converge alike.
const SLICE_PART_OF_STAIRS: f64 = 0.1;
/// Orders on either side that may propagate; beyond, directions merge.
const MAX_PROPAGATING: usize = 1_000_000;

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
    /// Direction that it leaves in, degrees: angle to the normal, and azimuth from x.
    pub angles_deg: [f64; 2],
}

impl OrderEfficiency {
    fn total(&self) -> f64 {
        self.te + self.tm
    }
}

/// The orders of incident light in s and in p.
type Answer = [Vec<OrderEfficiency>; 2];

/// How a case was solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// By orders.
    Orders {
        /// Highest order kept.
        truncation: usize,
        /// Layers, or slices of the finer of the two runs.
        slices: usize,
    },
    /// By boundary integrals.
    BoundaryIntegral {
        /// Nodes on a period of the surface.
        nodes: usize,
    },
}

impl Method {
    /// The name that results state.
    pub fn name(self) -> &'static str {
        match self {
            Self::Orders { .. } => "orders",
            Self::BoundaryIntegral { .. } => "boundary integral",
        }
    }
}

/// Efficiencies of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Efficiencies {
    /// One entry for each order that carries power away.
    pub orders: Vec<OrderEfficiency>,
    /// The method, with what it took.
    pub method: Method,
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

/// One stack, or two that are extrapolated from n and n + 1 slices, with n.
type Runs = (Stack, Option<(Stack, f64)>);

/// Stacks at a resolution: stairs of s and 2s slices where orders are given.
fn runs(of: accuracy::Structure<'_>, at: &Resolution, to: Accuracy) -> Result<Runs, Error> {
    match (of, to) {
        (accuracy::Structure::Layers(stack), _) => Ok((stack.clone(), None)),
        (accuracy::Structure::Relief(interface), Accuracy::Tolerance(_)) => {
            let (coarse, fine) = interface.stacks(at)?;
            Ok((coarse, fine.map(|fine| (fine, 3.0))))
        }
        (accuracy::Structure::Relief(interface), Accuracy::Orders(_)) => {
            let fine = (!at.plan.is_exact()).then(|| interface.stack(&at.plan.refined(2)));
            let fine = fine.transpose()?.map(|fine| (fine, 1.0));
            Ok((interface.stack(&at.plan)?, fine))
        }
    }
}

/// Layers, or slices of the finer of the two runs.
fn slices(of: accuracy::Structure<'_>, at: &Resolution, to: Accuracy) -> usize {
    match (of, to) {
        (accuracy::Structure::Layers(stack), _) => stack.layers().len(),
        (accuracy::Structure::Relief(_), Accuracy::Orders(_)) => at.plan.refined(2).count(),
        (accuracy::Structure::Relief(interface), _) if interface.follows_walls() => at.plan.count(),
        _ => at.plans().1.unwrap_or_else(|| at.plan.clone()).count(),
    }
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
        Ok(Pol::BOTH.map(|incident| read(&scattering, incident, self.case)))
    }

    /// Orders at a resolution, extrapolated where there are two runs.
    fn solve_runs(&self, (coarse, fine): &Runs, truncation: Truncation) -> Result<Answer, Error> {
        let mut answer = self.solve(coarse, truncation)?;
        if let Some((fine, n)) = fine {
            let finer = self.solve(fine, truncation)?;
            for (c, f) in answer.iter_mut().flatten().zip(finer.iter().flatten()) {
                c.te = extrapolate(c.te, f.te, *n);
                c.tm = extrapolate(c.tm, f.tm, *n);
            }
        }
        Ok(answer)
    }

    /// Largest difference between two answers in the case's own polarisation.
    fn change(&self, a: &Answer, b: &Answer) -> f64 {
        change(&own(self.case, a), &own(self.case, b))
    }
}

/// Orders of the case's own polarisation.
fn own(case: &Case, [s, p]: &Answer) -> Vec<OrderEfficiency> {
    match case.polarization {
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

/// True for light along the normal with s and p turned about it.
fn turned_at_normal(case: &Case) -> bool {
    case.theta_deg.abs() <= 0.0 && case.phi_deg.abs() > 0.0
}

/// Wavevector of the incident light along x and y, in units of k0.
fn tangential(case: &Case) -> [f64; 2] {
    let (theta, phi) = (case.theta_deg.to_radians(), case.phi_deg.to_radians());
    [phi.cos(), phi.sin()].map(|part| case.n_top.re * theta.sin() * part)
}

/// Direction that an order leaves in, degrees.
fn angles_deg(case: &Case, (side, order): (Side, i32)) -> [f64; 2] {
    let [kx, ky] = tangential(case);
    let kx = kx + f64::from(order) * case.wavelength / case.period;
    let index = if side == Side::Top { case.n_top.re } else { case.n_bottom.re };
    [(kx.hypot(ky) / index).min(1.0).asin(), ky.atan2(kx)].map(f64::to_degrees)
}

fn read(scattering: &Scattering, incident: Pol, case: &Case) -> Vec<OrderEfficiency> {
    let part = |to, pol| scattering.efficiency_in((Side::Top, 0, incident), to, pol);
    Side::BOTH
        .into_iter()
        .flat_map(|side| scattering.orders(side).map(move |m| (side, m)))
        .map(|to| OrderEfficiency {
            side: to.0,
            order: to.1,
            te: part(to, Pol::S),
            tm: part(to, Pol::P),
            angles_deg: angles_deg(case, to),
        })
        .collect()
}

/// Solves `case`; `progress` may stop it between two layers.
///
/// # Errors
/// Errors of the solver; a tolerance out of reach.
pub fn solve(case: &Case, progress: &Progress<'_>) -> Result<Efficiencies> {
    let Accuracy::Tolerance(tolerance) = case.accuracy else {
        return by_orders(case, progress);
    };
    let is_classical = case.phi_deg % 180.0 == 0.0;
    let relief = match &case.structure {
        Structure::Profile(outline) if is_classical && !case.jones => {
            return by_integrals(case, outline, tolerance, progress).context("profile");
        }
        Structure::Relief(relief) if is_classical && !case.jones => relief,
        _ => return by_orders(case, progress),
    };
    // `None` where the relief is not one surface, or an order is at its cut-off.
    let integrals = || {
        let outline = Outline::of_relief(relief, case.n_top, case.n_bottom).ok()?;
        let found = by_integrals(case, &outline, tolerance, progress).ok()?;
        Some((found.estimated_error, found))
    };
    let orders = || by_orders(case, progress).map(|found| (found.estimated_error, found));
    choose(&interface(case, relief), tolerance, integrals, orders).map(|(_, found)| found)
}

fn interface(case: &Case, relief: &Relief) -> Interface {
    let (relief, wavelength) = (relief.clone(), case.wavelength);
    Interface { relief, wavelength, n_top: case.n_top, n_bottom: case.n_bottom }
}

/// Solves `case` by boundary integrals on this surface, in the plane across the grooves.
fn by_integrals(
    case: &Case,
    outline: &Outline,
    tolerance: f64,
    progress: &Progress<'_>,
) -> Result<Efficiencies> {
    let grating = Grating::new(outline.clone(), case.wavelength, case.n_top, case.n_bottom)?;
    let [kx0, _] = tangential(case);
    let Converged { solution, error } = grating.converge(kx0, tolerance, progress)?;
    let nodes = solution.nodes();
    let missed = missed(tolerance, nodes, error);
    if let Some(missed) = missed.as_ref().filter(|_| error >= NOTHING_KNOWN) {
        bail!("{missed}");
    }
    let read = |incident: Pol| -> Vec<OrderEfficiency> {
        let each = Side::BOTH
            .into_iter()
            .flat_map(|side| solution.orders(side).iter().map(move |o| (side, o.order)));
        each.map(|to| {
            let share = solution.efficiency((Side::Top, 0, incident), to);
            let [te, tm] = if incident == Pol::S { [share, 0.0] } else { [0.0, share] };
            OrderEfficiency { side: to.0, order: to.1, te, tm, angles_deg: angles_deg(case, to) }
        })
        .collect()
    };
    Ok(Efficiencies {
        orders: own(case, &Pol::BOTH.map(read)),
        method: Method::BoundaryIntegral { nodes },
        estimated_error: error,
        too_few_for: None,
        coarse_slices: None,
        missed,
        jones: None,
    })
}

/// Solves `case` by orders.
fn by_orders(case: &Case, progress: &Progress<'_>) -> Result<Efficiencies> {
    let problem = Problem { case, progress };
    let highest = {
        let stack = problem.stack(Vec::new())?;
        highest_order(&stack, problem.bloch(&stack))
    };
    ensure!(
        highest <= MAX_PROPAGATING,
        "period: expected a length at which at most {MAX_PROPAGATING} orders propagate, got {} at a wavelength of {}",
        case.period,
        case.wavelength
    );
    let (stack, of_relief);
    let structure = match &case.structure {
        Structure::Layers(layers) => {
            stack = problem.stack(layers.clone())?;
            accuracy::Structure::Layers(&stack)
        }
        Structure::Relief(relief) => {
            of_relief = interface(case, relief);
            accuracy::Structure::Relief(&of_relief)
        }
        Structure::Profile(_) => bail!(
            "profile: expected `tolerance`, no `jones` and light in the plane across the grooves (phi_deg 0 or 180), since boundary integrals solve it; a relief of polygons takes any"
        ),
    };
    let runs = |at: &Resolution| runs(structure, at, case.accuracy);
    let waves = Waves {
        solve: &|at: &Resolution| problem.solve_runs(&runs(at)?, at.truncation),
        distance: &|a: &Answer, b: &Answer| problem.change(a, b),
        highest_order: highest,
        first: None,
    };
    let slice_part = if structure.is_of_stairs() { SLICE_PART_OF_STAIRS } else { SLICE_PART };
    let found = match case.accuracy {
        Accuracy::Orders(n) => {
            // Both polarisations decide the slices, so that s, p and unpolarised light are solved
            // on one structure. Errors are those of the case's polarisation.
            let either = |[s, p]: &Answer, [t, q]: &Answer| change(s, t).max(change(p, q));
            settle_slices(structure, &waves, n, (SLICE_TOLERANCE, slice_part), &either)?
        }
        Accuracy::Tolerance(tolerance) => {
            ensure!(
                highest + 2 <= Truncation::MAX,
                "tolerance: expected a period at which at most {} orders propagate, got {highest}; `N` solves with fewer",
                Truncation::MAX - 2
            );
            converge_waves(structure, &waves, tolerance, progress)?
        }
    };
    let at = &found.resolution;
    let slices = slices(structure, at, case.accuracy);
    let (missed, coarse_slices) = match case.accuracy {
        Accuracy::Tolerance(tolerance) => (found.missed(tolerance, slices), None),
        Accuracy::Orders(_) => (None, coarse_slices(&found, slice_part)),
    };
    if let Some(missed) = missed.as_ref().filter(|_| found.errors.sum() >= NOTHING_KNOWN) {
        bail!("{missed}");
    }
    let matrices = || problem.jones(&runs(at)?, at.truncation);
    Ok(Efficiencies {
        jones: case.jones.then(matrices).transpose()?,
        orders: own(case, &found.answer),
        method: Method::Orders { truncation: at.truncation.highest(), slices },
        estimated_error: found.errors.sum(),
        too_few_for: (at.truncation.highest() < highest).then_some(highest),
        coarse_slices,
        missed,
    })
}

/// Error of the slices of given orders, where it is above the aim.
fn coarse_slices(found: &Found<Answer>, part: f64) -> Option<f64> {
    let errors = found.errors;
    let enough = SLICE_TOLERANCE.max(part * errors.orders);
    (found.limit.is_some() && errors.slices > enough).then_some(errors.slices)
}

/// Largest difference of an efficiency or of a part of it between two lists; orders that only one
/// of them has count in full.
fn change(a: &[OrderEfficiency], b: &[OrderEfficiency]) -> f64 {
    let parts = |list: &[OrderEfficiency], like: &OrderEfficiency| {
        let same = |o: &&OrderEfficiency| (o.side, o.order) == (like.side, like.order);
        list.iter().find(same).map_or([0.0, 0.0], |o| [o.te, o.tm])
    };
    let differences = a.iter().chain(b).map(|o| {
        let (a, b) = (parts(a, o), parts(b, o));
        let [te, tm] = [a[0] - b[0], a[1] - b[1]];
        te.abs().max(tm.abs()).max((te + tm).abs())
    });
    differences.fold(0.0, f64::max)
}

/// JSON whose objects of numbered entries list them in numerical order.
///
/// # Errors
/// None that is known.
pub fn in_numerical_order(value: &Value) -> serde_json::Result<String> {
    struct Numbered<'a>(&'a Value);
    impl serde::Serialize for Numbered<'_> {
        fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
            let Value::Object(map) = self.0 else {
                return self.0.serialize(to);
            };
            let mut entries: Vec<(&String, Numbered<'_>)> =
                map.iter().map(|(key, value)| (key, Numbered(value))).collect();
            // Sorted already where keys are words.
            entries.sort_by_key(|(key, _)| key.parse::<i64>().unwrap_or_default());
            to.collect_map(entries)
        }
    }
    serde_json::to_string_pretty(&Numbered(value))
}

impl Efficiencies {
    /// Sum over the orders of a half-space.
    pub fn total(&self, side: Side) -> f64 {
        self.orders.iter().filter(|o| o.side == side).map(OrderEfficiency::total).sum()
    }

    /// Warnings of results that are not what they were asked to be.
    pub fn warnings(&self) -> Vec<String> {
        let Method::Orders { truncation, slices } = self.method else {
            return self.missed.iter().cloned().collect();
        };
        let too_few = self.too_few_for.map(|highest| {
            format!(
                "{}, but orders up to ±{highest} propagate; the result is that of the truncated problem",
                kept_orders(truncation)
            )
        });
        let coarse = self.coarse_slices.map(|left| {
            format!(
                "an error of {left:.1e} is left with {}, more than aimed at; more of them are too much work",
                count(slices, "slice")
            )
        });
        let unsettled = unsettled(self.estimated_error, truncation);
        [too_few, self.missed.clone(), coarse, unsettled].into_iter().flatten().collect()
    }

    /// The JSON that `batwing grating` prints.
    pub fn to_json(&self) -> Value {
        fn of<T: Into<Value>>(
            orders: &[OrderEfficiency],
            side: Side,
            part: impl Fn(&OrderEfficiency) -> T,
        ) -> Value {
            let entries = orders.iter().filter(|o| o.side == side);
            let entries = entries.map(|o| (o.order.to_string(), part(o).into()));
            entries.collect::<Map<_, _>>().into()
        }
        let of_side = |side: Side, part: fn(&OrderEfficiency) -> f64| of(&self.orders, side, part);
        let angles = |side: Side| of(&self.orders, side, |o| o.angles_deg.to_vec());
        let (reflected, transmitted) = (self.total(Side::Top), self.total(Side::Bottom));
        let mut json = serde_json::json!({
            "R": of_side(Side::Top, OrderEfficiency::total),
            "T": of_side(Side::Bottom, OrderEfficiency::total),
            "RTE": of_side(Side::Top, |o| o.te),
            "RTM": of_side(Side::Top, |o| o.tm),
            "TTE": of_side(Side::Bottom, |o| o.te),
            "TTM": of_side(Side::Bottom, |o| o.tm),
            "R_angles_deg": angles(Side::Top),
            "T_angles_deg": angles(Side::Bottom),
            "R_total": reflected,
            "T_total": transmitted,
            "absorbed": 1.0 - reflected - transmitted,
            "method": self.method.name(),
            "estimated_error": self.estimated_error,
        });
        match self.method {
            Method::Orders { truncation, slices } => {
                json["N"] = truncation.into();
                json["slices"] = slices.into();
            }
            Method::BoundaryIntegral { nodes } => json["nodes"] = nodes.into(),
        }
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

    /// Equal half-spaces have equal angles, and those of the orders are by the grating equation.
    #[test]
    fn orders_have_their_angles_and_come_in_numerical_order() {
        let e = solved(
            r#"{"wavelength": 0.5, "period": 1.2, "n_top": [1, 0], "n_bottom": [1.5, 0], "layers_top_to_bottom": [], "theta_deg": 20, "phi_deg": 30, "pol": "s", "N": 4}"#,
        );
        let json = e.to_json();
        let (s, azimuth) = (20_f64.to_radians().sin(), 30_f64.to_radians());
        for (key, index) in [("R_angles_deg", 1.0), ("T_angles_deg", 1.5)] {
            let orders = json[key].as_object().expect("orders");
            assert!(orders.len() >= 4);
            for (order, angles) in orders {
                let order: f64 = order.parse().expect("a number");
                let [theta, phi] =
                    [0, 1].map(|k| angles[k].as_f64().expect("an angle").to_radians());
                let [kx, ky] = [phi.cos(), phi.sin()].map(|part| index * theta.sin() * part);
                assert!((kx - s * azimuth.cos() - order * 0.5 / 1.2).abs() < 1e-12);
                assert!((ky - s * azimuth.sin()).abs() < 1e-12);
            }
        }
        let text = in_numerical_order(&json).expect("text");
        let place = |order: &str| text.find(&format!("\n    \"{order}\": ")).expect(order);
        let places = ["-3", "-2", "-1", "0", "1"].map(place);
        assert!(places.is_sorted(), "{places:?}");
        let back: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(back, json);
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
    #[ignore = "slow: 6 s"]
    fn tolerance_finds_orders_and_slices() {
        let case = |accuracy: &str| {
            format!(
                r#"{{"wavelength": 0.55, "period": 2, "n_top": [1.41, 0], "n_bottom": [1, 0], "relief": {{"depth": 0.7, "background": [1, 0],
                "polygons": [{{"n": [1.41, 0], "points": [[0, 0], [1.7, 0.7], [2, 0]]}}]}}, "theta_deg": 10, "pol": "unpolarised", {accuracy}}}"#
            )
        };
        let loose = solved(&case(r#""tolerance": 0.003"#));
        let tight = solved(&case(r#""N": 40"#));
        let Method::Orders { slices, .. } = loose.method else { panic!("{:?}", loose.method) };
        assert!(loose.estimated_error <= 0.003 && slices > 8);
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
