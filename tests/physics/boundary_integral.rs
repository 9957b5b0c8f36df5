// SPDX-License-Identifier: MIT OR Apache-2.0
//! The boundary-integral solver against closed forms, laws, published numbers and RCWA.

use batwing_tests::reference_cases::cases;
use batwing_tests::validation_report::{Row, hold};
use full_wave::Curve;
use gratings::boundary_integral::{Fineness, Grating, IntegralError, Outline, Solution};
use num_complex::Complex64;
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::relief::shapes::{Materials, sinusoid};
use rcwa::relief::{Polygon, Relief};
use rcwa::{Bloch, Pol, Scattering, Side, Stack, Truncation, no_progress};
use serde_json::Value;
use std::f64::consts::TAU;

const SILICONE: f64 = 1.41;
const SIDES: [Side; 2] = [Side::Top, Side::Bottom];

fn real(n: f64) -> Complex64 {
    Complex64::from(n)
}

fn case(id: &str) -> Value {
    let found = cases("published.json", id);
    found.into_iter().find(|c| c["id"] == id).expect("a case of this name")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// The members of an object, keys as orders.
fn entries(value: &Value) -> Vec<(i32, Value)> {
    let object = value.as_object().unwrap_or_else(|| panic!("{value} is no object"));
    object.iter().map(|(k, v)| (k.parse().unwrap(), v.clone())).collect()
}

#[track_caller]
fn assert_near(what: &str, got: f64, expected: f64, allowed: f64) {
    assert!(
        (got - expected).abs() <= allowed,
        "{what}: got {got:.15e}, expected {expected:.15e}, allowed {allowed:.0e}"
    );
}

fn solve(stack: &Stack, bloch: Bloch, highest: usize) -> Scattering {
    rcwa::solve(stack, bloch, Truncation::new(highest).unwrap()).unwrap()
}

fn integral(outline: Outline, wavelength: f64, n: [f64; 2], kx0: f64) -> Solution {
    let grating = Grating::new(outline, wavelength, n[0], n[1]).unwrap();
    grating.solve(kx0, Fineness::default()).unwrap()
}

/// Every (side, order, polarisation).
fn waves(solution: &Solution) -> Vec<(Side, i32, Pol)> {
    let mut all = Vec::new();
    for side in SIDES {
        for order in solution.orders(side) {
            all.extend(Pol::BOTH.map(|pol| (side, order.order, pol)));
        }
    }
    all
}

/// Largest difference of any efficiency from `other`, after checking that the channels are the
/// same.
fn largest_difference(
    solution: &Solution,
    other: impl Fn((Side, i32, Pol), (Side, i32)) -> f64,
) -> f64 {
    let all = waves(solution);
    let pairs = all.iter().flat_map(|&from| {
        all.iter().filter(move |to| to.2 == from.2).map(move |to| (from, (to.0, to.1)))
    });
    pairs
        .map(|(from, to)| (solution.efficiency(from, to) - other(from, to)).abs())
        .fold(0.0, f64::max)
}

/// From RCWA on few and on twice as many slices: the error in the thickness of the slices is
/// quadratic.
fn extrapolated(
    interface: (&Relief, f64),
    kx0: f64,
    highest: usize,
    slices: usize,
) -> impl Fn((Side, i32, Pol), (Side, i32)) -> f64 {
    let (relief, wavelength) = interface;
    let plan = relief.slice_plan(slices);
    let run = |plan| -> Scattering {
        let layers = relief.layers(plan);
        let stack =
            Stack::new(wavelength, relief.period(), real(SILICONE), real(1.0), layers).unwrap();
        solve(&stack, Bloch::new(kx0, 0.0), highest)
    };
    let (coarse, fine) = (run(&plan), run(&plan.refined(2)));
    move |from, to| (4.0 * fine.efficiency(from, to) - coarse.efficiency(from, to)) / 3.0
}

/// Fresnel reflectance at kx from index `a` to index `b`.
fn fresnel(a: f64, b: f64, kx: f64, pol: Pol) -> f64 {
    let kz = |n: f64| Complex64::from(n * n - kx * kx).sqrt();
    let weight = |n: f64| if pol == Pol::S { 1.0 } else { 1.0 / (n * n) };
    let (p, q) = (kz(a) * weight(a), kz(b) * weight(b));
    ((p - q) / (p + q)).norm_sqr()
}

#[test]
fn a_plane_reflects_as_fresnel_says_also_beyond_the_critical_angle() {
    let mut total = 0;
    for (period, kx0) in [(0.7, 0.1), (9.0, 0.02)] {
        let plane = Outline::fourier(period, Vec::new()).unwrap();
        let solution = integral(plane, 0.55, [SILICONE, 1.0], kx0);
        for (side, order, pol) in waves(&solution) {
            let [a, b] = if side == Side::Top { [SILICONE, 1.0] } else { [1.0, SILICONE] };
            let kx = kx0 + f64::from(order) * 0.55 / period;
            let expected = fresnel(a, b, kx, pol);
            total += i32::from(expected > 1.0 - 1e-12);
            let got = solution.efficiency((side, order, pol), (side, order));
            assert_near(&format!("period {period}, kx {kx}, {pol:?}"), got, expected, 1e-10);
        }
        assert!(solution.worst_balance() < 1e-10);
    }
    assert!(total > 10, "waves that are reflected totally: {total}");
}

#[test]
fn smooth_sinusoid_by_the_c_method() {
    let case = case("derived/sinusoid_n1.41_inside");
    let surface = Outline::fourier(0.8, vec![[-0.05, 0.0]]).unwrap();
    let solution = integral(surface, 0.55, [SILICONE, 1.0], SILICONE * 20f64.to_radians().sin());
    let outputs = &case["outputs"]["theta20_phi0"];
    let mut rows = Vec::new();
    for (pol, key) in [(Pol::S, "s"), (Pol::P, "p")] {
        for (side, name) in [(Side::Top, "R"), (Side::Bottom, "T")] {
            for (order, value) in entries(&outputs[key][name]) {
                let got = solution.efficiency((Side::Top, 0, pol), (side, order));
                let what = format!("{key}, {name} of order {order}");
                // Half a unit of the last digit in the table.
                assert_near(&what, got, number(&value), 6e-9);
                rows.push(Row::near(&what, number(&value), got, 6e-9, 8));
            }
        }
    }
    assert_eq!(rows.len(), 14);
    hold("sinusoid by the C method", &rows);
}

/// Lamellae twice as deep as their period, from above at several angles: limits of RCWA with
/// adaptive spatial resolution.
#[test]
fn deep_lamellae_by_adaptive_rcwa() {
    let mut rows = Vec::new();
    for (id, pol) in
        [("ex1-s-40", Pol::S), ("ex1-p-40", Pol::P), ("ex6-15", Pol::P), ("ex6-80", Pol::P)]
    {
        let case = case(&format!("reticolo/{id}"));
        let input = |key: &str| number(&case["inputs"][key]);
        let (period, theta) = (input("period"), input("theta_deg"));
        let ridge = Outline::corners(
            period,
            &[[0.4 * period, 20.0], [0.4 * period, 0.0], [0.6 * period, 0.0], [0.6 * period, 20.0]],
        );
        let solution =
            integral(ridge.unwrap(), input("wavelength"), [1.0, 1.5], theta.to_radians().sin());
        for (side, name) in [(Side::Top, "R"), (Side::Bottom, "T")] {
            for (order, parts) in entries(&case["converged"][name]) {
                let got = solution.efficiency((Side::Top, 0, pol), (side, order));
                let what = format!("{id}, {name} of order {order}");
                assert_near(&what, got, number(&parts[0]), 2e-7);
                rows.push(Row::near(&what, number(&parts[0]), got, 2e-7, 7));
            }
        }
        assert!(solution.worst_balance() < 1e-8);
    }
    hold("deep lamellae", &rows);
}

/// Period, wavelength and angle of an echelette of aluminium in the mount of Littrow, with its two
/// corners: 1200/mm, 19.1 degrees at 546.1 nm.
const ECHELETTE: [f64; 3] = [1.0 / 1.2, 0.5461, 19.126_808_407_783_94];
const CORNERS: [[f64; 2]; 2] = [[0.0, 0.257_670_164_732_314_24], [0.744_107_038_823_084_2, 0.0]];

/// A grating to a tolerance, and its reflected orders in the light of order 0 from the top.
fn converged(
    grating: &Grating,
    theta: f64,
    tolerance: f64,
) -> (Solution, impl Fn(Pol, i32) -> f64) {
    let kx0 = theta.to_radians().sin();
    let found = grating.converge(kx0, tolerance, &no_progress).unwrap();
    assert!(found.error <= tolerance, "{:.1e}", found.error);
    let solution = found.solution.clone();
    (solution, move |pol, order| found.solution.efficiency((Side::Top, 0, pol), (Side::Top, order)))
}

/// A sinusoid of silver in TM by the C method of Chandezon.
#[test]
fn metals_by_the_c_method() {
    let surface = Outline::fourier(1.0 / 1.2, vec![[0.05, 0.0]]).unwrap();
    let silver = Grating::new(surface, 0.633, 1.0, Complex64::new(0.0562, 4.2776)).unwrap();
    let (_, reflected) = converged(&silver, 10.0, 1e-6);
    let rows = [(-1, 0.278_582), (0, 0.440_264), (1, 0.268_048)].map(|(order, expected)| {
        let got = reflected(Pol::P, order);
        assert_near("silver", got, expected, 1e-6);
        Row::near(&format!("p, R of order {order}"), expected, got, 1e-6, 6)
    });
    hold("sinusoid of silver", &rows);
}

/// Lamellae with sharp corners, by modes \[Granet1996; LalanneHugonin2000\].
#[test]
#[ignore = "slow: a groove as deep as a wavelength (6 s)"]
fn metal_lamellae_by_modes() {
    let mut rows = Vec::new();
    for (height, values) in [
        (0.1, &[(Pol::P, -1, 0.3408, 3e-4), (Pol::P, 0, 0.6312, 3e-4)][..]),
        (1.0, &[(Pol::P, 0, 0.848_48, 1e-5), (Pol::S, -1, 0.734_28, 1e-5)]),
    ] {
        let corners = [[0.0, height], [0.0, 0.0], [0.5, 0.0], [0.5, height]];
        let lamella = Outline::corners(1.0, &corners).unwrap();
        let grating = Grating::new(lamella, 1.0, 1.0, Complex64::new(0.22, 6.71)).unwrap();
        let (_, reflected) = converged(&grating, 30.0, 5e-6);
        for &(pol, order, expected, allowed) in values {
            let what = format!("height {height}, {pol:?}, R of order {order}");
            let got = reflected(pol, order);
            assert_near(&what, got, expected, allowed);
            rows.push(Row::near(&what, expected, got, allowed, 5));
        }
    }
    hold("lamellae of metal", &rows);
}

/// Aluminium with sharp corners is the limit of its Fourier series; the C method, whose orders cut the
/// profile short, gives 0.90 to 0.91 in TM and 0.668 in TE of it.
#[test]
#[ignore = "slow: four profiles to 1e-6 (10 s)"]
fn sharp_edges_of_metal_are_the_limit_of_smooth_ones() {
    let [period, wavelength, theta] = ECHELETTE;
    let aluminium = Complex64::new(0.7, 5.7);
    let reflected = |outline: Outline| {
        let grating = Grating::new(outline, wavelength, 1.0, aluminium).unwrap();
        let (_, reflected) = converged(&grating, theta, 1e-6);
        Pol::BOTH.map(|pol| reflected(pol, -1))
    };
    // The second derivative of z is -kink at x = 0 and kink at the other corner.
    let [[_, depth], [x, _]] = CORNERS;
    let kink = depth / x + depth / (period - x);
    let series = |harmonics: u32| {
        let coefficient = |m: u32| {
            let k = TAU * f64::from(m) / period;
            let each = 2.0 * kink / (period * k * k);
            [each * (1.0 - (k * x).cos()), -each * (k * x).sin()]
        };
        Outline::fourier(period, (1..=harmonics).map(coefficient).collect()).unwrap()
    };
    let echelette = || Outline::corners(period, &CORNERS).unwrap();
    let sharp = reflected(echelette());
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let grating = Grating::new(echelette(), wavelength, 1.0, aluminium).unwrap();
        let kx0 = theta.to_radians().sin();
        let found = grating.converge(kx0, tolerance, &no_progress).unwrap();
        for (pol, exact) in Pol::BOTH.into_iter().zip(sharp) {
            let share = found.solution.efficiency((Side::Top, 0, pol), (Side::Top, -1));
            assert_near("the stated error", share, exact, found.error + 1e-6);
        }
    }
    assert_near("TE", sharp[0], 0.668, 4e-3);
    let smooth = [10, 20, 40].map(|harmonics| reflected(series(harmonics)));
    assert_near("TM, 10 harmonics", smooth[0][1], 0.905, 0.01);
    for pol in [0, 1] {
        let off = smooth.map(|found| (found[pol] - sharp[pol]).abs());
        assert!(off.is_sorted_by(|a, b| *b < 0.5 * a) && off[2] < 1e-3, "{sharp:?}: {off:?}");
    }
}

/// Of a metal without loss all light comes back, whatever its shape; nothing enforces it.
#[test]
fn metals_without_loss_reflect_all() {
    let [period, wavelength, theta] = ECHELETTE;
    for k in [5.7, 4.0] {
        let outline = Outline::corners(period, &CORNERS).unwrap();
        let grating = Grating::new(outline, wavelength, 1.0, Complex64::new(0.0, k)).unwrap();
        let (solution, _) = converged(&grating, theta, 1e-6);
        assert!(solution.worst_balance() < 1e-6, "k {k}: {:.1e}", solution.worst_balance());
        for pol in Pol::BOTH {
            let total = solution.total((Side::Top, 0, pol), Side::Top);
            assert_near(&format!("k {k} {pol:?}"), total, 1.0, 1e-6);
        }
    }
}

/// An arc is one arc or two halves of it, and the limit of its chords.
#[test]
fn arcs_are_the_limit_of_their_chords() {
    let ends = ([0.0, 0.2], [0.6, 0.2]);
    let (arc, length) = Curve::between(ends.0, ends.1, 1.5);
    let middle = arc.point(0.5 * length);
    let solved = |outline: Outline| integral(outline, 0.63, [1.0, 1.5], 0.2079);
    let whole = solved(Outline::arcs(1.0, &[(ends.0, 1.5), (ends.1, 0.0)]).unwrap());
    let halves = [(ends.0, 0.75), (middle, 0.75), (ends.1, 0.0)];
    let halves = solved(Outline::arcs(1.0, &halves).unwrap());
    let off = largest_difference(&whole, |from, to| halves.efficiency(from, to));
    assert!(whole.worst_balance() < 1e-9 && off < 1e-9, "{off:.1e}");
    // A bulb, whose side is seen under more than half a turn.
    let bulb = solved(Outline::arcs(1.0, &[([0.3, 0.2], 4.0), ([0.7, 0.2], 0.0)]).unwrap());
    assert!(bulb.worst_balance() < 1e-8, "{:.1e}", bulb.worst_balance());
    let chords = [4, 8].map(|count| {
        let points = (0..=count).map(|i| arc.point(length * f64::from(i) / f64::from(count)));
        let points: Vec<_> = points.collect();
        let chords = solved(Outline::corners(1.0, &points).unwrap());
        largest_difference(&whole, |from, to| chords.efficiency(from, to))
    });
    let ratio = chords[0] / chords[1];
    assert!(chords[1] > 1e-6 && (3.0..5.0).contains(&ratio), "{chords:?}");
}

fn triangle(period: f64, apex: [f64; 2]) -> Relief {
    let points = vec![[0.0, 0.0], apex, [period, 0.0]];
    let silicone = Polygon { index: real(SILICONE), points };
    Relief::new(period, apex[1], real(1.0), vec![silicone]).unwrap()
}

fn by_integrals(relief: &Relief, kx0: f64) -> Solution {
    let grating = Grating::of_relief(relief, 0.55, SILICONE, 1.0).unwrap();
    grating.solve(kx0, Fineness::default()).unwrap()
}

/// Largest difference of any efficiency of one polarisation.
fn difference_of(
    pol: Pol,
    solution: &Solution,
    other: impl Fn((Side, i32, Pol), (Side, i32)) -> f64,
) -> f64 {
    let of_other = |from: (Side, i32, Pol), to| {
        if from.2 == pol { other(from, to) } else { solution.efficiency(from, to) }
    };
    largest_difference(solution, of_other)
}

/// In TE the slices' error is quadratic and extrapolated away; in TM the stairs' edges leave one
/// that falls about as fast as the slices grow in number, and the orders.
#[test]
#[ignore = "nightly: 13 s"]
fn nightly_the_rcwa_approaches_the_same_efficiencies() {
    // Level tread and upright riser; a triangle; one that leans over its neighbour's foot.
    for apex in [[1.2, 0.6], [0.6, 0.7], [1.8, 0.5]] {
        let relief = triangle(1.5, apex);
        let exact = by_integrals(&relief, 0.17);
        assert!(exact.worst_balance() < 1e-9, "{:.1e}", exact.worst_balance());
        let steps = [(12, 12), (24, 24), (48, 48)];
        let runs =
            steps.map(|(highest, slices)| extrapolated((&relief, 0.55), 0.17, highest, slices));
        let te = [0, 1, 2].map(|i| difference_of(Pol::S, &exact, &runs[i]));
        let tm = [0, 1, 2].map(|i| difference_of(Pol::P, &exact, &runs[i]));
        assert!(te.is_sorted_by(|a, b| a > b) && te[2] < 2e-6, "{apex:?}: {te:?}");
        assert!(tm.is_sorted_by(|a, b| a > b) && tm[2] < 2e-3, "{apex:?}: {tm:?}");
    }
}

/// With slanted walls followed TE needs no extrapolation, and TM is several times nearer than by
/// stairs of the same orders.
#[test]
#[ignore = "slow: 4 s"]
fn slices_that_follow_the_sides_reach_the_same_efficiencies_in_both_polarisations() {
    for apex in [[1.2, 0.6], [0.6, 0.7], [1.8, 0.5]] {
        let relief = triangle(1.5, apex);
        let exact = by_integrals(&relief, 0.17);
        let interface =
            Interface { relief, wavelength: 0.55, n_top: real(SILICONE), n_bottom: real(1.0) };
        let errors = [(10, 10), (20, 20), (40, 40)].map(|(highest, slices)| {
            let resolution = Resolution {
                truncation: Truncation::new(highest).unwrap(),
                plan: interface.relief.slice_plan(slices),
            };
            let (stack, other) = interface.stacks(&resolution).unwrap();
            assert!(other.is_none());
            let run = solve(&stack, Bloch::new(0.17, 0.0), highest);
            Pol::BOTH.map(|pol| {
                difference_of(pol, &exact, |from, to| run.efficiency_in(from, to, from.2))
            })
        });
        let stairs = extrapolated((&interface.relief, 0.55), 0.17, 40, 40);
        let by_stairs = difference_of(Pol::P, &exact, &stairs);
        assert!(errors[2][1] < 0.3 * by_stairs, "{apex:?}: {errors:?}, {by_stairs:.1e}");
        for (pol, most) in [(0, 1e-5), (1, 5e-4)] {
            let of = errors.map(|e| e[pol]);
            assert!(of.is_sorted_by(|a, b| a > b) && of[2] < most, "{apex:?}: {errors:?}");
        }
    }
}

#[test]
fn the_rcwa_approaches_a_smooth_sinusoid() {
    let (period, depth, kx0) = (1.5, 0.5, 0.17);
    // The relief reaches from 0 to its depth, its crests at the middle of the period; the mean
    // height shifts phases only.
    let surface = Outline::fourier(period, vec![[-0.5 * depth, 0.0]]).unwrap();
    let exact = integral(surface, 0.55, [SILICONE, 1.0], kx0);
    assert!(exact.worst_balance() < 1e-9, "{:.1e}", exact.worst_balance());
    let sided = |sides: usize| {
        let relief = sinusoid(period, depth, sides, Materials::lossless(SILICONE, 1.0)).unwrap();
        let run = extrapolated((&relief, 0.55), kx0, 30, sides);
        Pol::BOTH.map(|pol| difference_of(pol, &exact, &run))
    };
    let (coarse, fine) = (sided(20), sided(60));
    assert!(fine[0] < coarse[0] / 5.0 && fine[0] < 1e-3, "TE: {coarse:?}, {fine:?}");
    assert!(fine[1] < coarse[1] && fine[1] < 3e-3, "TM: {coarse:?}, {fine:?}");
}

#[test]
fn energy_reciprocity_and_mirrors() {
    let relief = triangle(3.0, [2.1, 1.1]);
    let kx0 = 0.0613;
    let solution = by_integrals(&relief, kx0);
    assert!(solution.worst_balance() < 1e-10, "{:.1e}", solution.worst_balance());
    let reversed = by_integrals(&relief, -kx0);
    let back = |from: (Side, i32, Pol), to: (Side, i32)| {
        reversed.efficiency((to.0, -to.1, from.2), (from.0, -from.1))
    };
    assert!(largest_difference(&solution, back) < 1e-10);
    let mirrored = by_integrals(&triangle(3.0, [0.9, 1.1]), -kx0);
    let mirror = |from: (Side, i32, Pol), to: (Side, i32)| {
        mirrored.efficiency((from.0, -from.1, from.2), (to.0, -to.1))
    };
    assert!(largest_difference(&solution, mirror) < 1e-10);
    let along = |p: &Polygon| {
        let points = p.points.iter().map(|[x, z]| [x + 1.7, *z]).collect();
        Polygon { index: p.index, points }
    };
    let polygons = relief.polygons().iter().map(along).collect();
    let shifted = Relief::new(relief.period(), relief.depth(), relief.background(), polygons);
    let shifted = by_integrals(&shifted.unwrap(), kx0);
    assert!(largest_difference(&solution, |from, to| shifted.efficiency(from, to)) < 1e-10);
}

#[test]
fn finer_nodes_change_what_they_are_said_to_change() {
    let grating = Grating::of_relief(&triangle(3.0, [2.1, 1.1]), 0.55, SILICONE, 1.0).unwrap();
    let fineness = Fineness { per_wavelength: 4.5, at_corners: 24, grading: 6 };
    let [coarse, solution] =
        [fineness, fineness.refined(1.5)].map(|f| grating.solve(0.0613, f).unwrap());
    let estimate = solution.largest_difference(&coarse);
    let exact = by_integrals(&triangle(3.0, [2.1, 1.1]), 0.0613);
    let error = largest_difference(&solution, |from, to| exact.efficiency(from, to));
    assert!(error < estimate && estimate < 1e-4, "{error:.1e}, estimated {estimate:.1e}");
    assert!(error > 1e-12, "coarse enough to show an error: {error:.1e}");
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let plane = || Outline::fourier(1.0, Vec::new()).unwrap();
    assert_eq!(
        Grating::new(plane(), 0.5, 1.5, 1.5),
        Err(IntegralError::NoSurface { index: real(1.5) })
    );
    let positive = |what, got| Err(IntegralError::Positive { what, got });
    assert_eq!(Grating::new(plane(), -0.5, 1.5, 1.0), positive("the wavelength", -0.5));
    let no_medium = Grating::new(plane(), 0.5, 0.0, 1.0).unwrap_err().to_string();
    assert!(no_medium.starts_with("the top half-space: a refractive index n + ik"), "{no_medium}");
    let grating = Grating::new(plane(), 0.8, 1.5, 1.0).unwrap();
    let refused = |kx0: f64, fineness| grating.solve(kx0, fineness).unwrap_err().to_string();
    let usual = Fineness::default();
    // kx of order 1 is 0.2 + 0.8, grazing in air.
    let cut_off = refused(0.2, usual);
    assert!(cut_off.starts_with("order 1 in the bottom half-space has |kz| = "), "{cut_off}");
    assert_eq!(refused(f64::INFINITY, usual), "kx0: expected a finite number, got inf");
    let few = Fineness { per_wavelength: 3.0, ..usual };
    assert_eq!(refused(0.1, few), "nodes per wavelength: expected above 4 and finite, got 3");
    let many = refused(0.1, usual.refined(1e3));
    assert!(many.contains("nodes on the surface are more than 6000"), "{many}");
}
