// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of `reproduce`: convergence, energy, reciprocity, exact files, interpolation error.
//!
//! Claim: halving the thickness of the slices or adding a third more orders moves no direction's R
//! or T by more than 3e-3. The relief is that of D1's band 8, ring 75: period 10.78 µm, height 3.73
//! µm.

#![expect(
    clippy::print_stdout,
    reason = "the numbers found are what a reader of the test wants to see"
)]

use std::collections::BTreeMap;
use std::sync::OnceLock;

use bsdf::direction::Wavevector;
use bsdf::native;
use bsdf::validate::{self, InterpolationReport};
use bsdf::{Grid, OrderEfficiency, OrderTable, Polarisation, Side};
use num_complex::Complex64;
use rcwa::accuracy::converge_hemisphere;
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere};
use rcwa::relief::Relief;
use rcwa::{Pol, Truncation, no_progress};

use batwing_tests::tables::{Shares, direct, on_silicone, order_table, scatter_side, solver_side};
use design::Design;
use gratings::interface::interface;
use simulate::cells::band_cells;

/// What moves no direction's R or T when the resolution is raised.
const CONVERGED: f64 = 3e-3;

fn design() -> Design {
    design::embedded("d1.toml").expect("a valid design")
}

/// The relief of `band` (from 1) of D1 between silicone and air.
fn band(band: usize) -> Interface {
    let design = design();
    let cell = band_cells(&design)[band - 1].clone().expect("a relief");
    interface(&cell, design.wavelength_nm * 1e-3).expect("a valid relief")
}

/// The resolution that a table of D1 has, and its estimated error.
fn found(interface: &Interface) -> (Resolution, f64) {
    converge_hemisphere(interface, design().hybrid.tolerance, &no_progress).expect("converges")
}

/// R and T of every direction and polarisation.
type Totals = BTreeMap<(bool, i64, usize, bool), [f64; 2]>;

fn shares(interface: &Interface, directions: &Directions, resolution: &Resolution) -> Totals {
    let solved = hemisphere(interface, directions, resolution, &no_progress).expect("solved");
    let of = |i: &rcwa::hemisphere::Incidence, same: bool| {
        i.efficiencies.iter().filter(|s| (s.0 == i.side) == same).map(|s| s.2).sum()
    };
    solved
        .incidences
        .iter()
        .map(|i| {
            (
                (i.side == rcwa::Side::Top, i.kx_index, i.ky_index, i.pol == Pol::S),
                [of(i, true), of(i, false)],
            )
        })
        .collect()
}

/// Largest change of R or T, and how many directions change by more than the claim.
fn change(a: &Totals, b: &Totals) -> (f64, usize) {
    assert!(a.keys().eq(b.keys()));
    let moved: Vec<f64> =
        a.iter().map(|(k, [r, t])| (r - b[k][0]).abs().max((t - b[k][1]).abs())).collect();
    (moved.iter().copied().fold(0.0, f64::max), moved.iter().filter(|m| **m > CONVERGED).count())
}

#[test]
fn no_direction_moves_when_slices_are_halved_or_orders_added() {
    for (number, kx_per_zone, ky) in [(2, 2, vec![0.03, 0.4, 0.85, 1.2]), (8, 1, vec![0.25, 0.93])]
    {
        let interface = band(number);
        let (resolution, estimate) = found(&interface);
        let highest = resolution.truncation.highest();
        println!(
            "band {number}: orders -{highest}..{highest}, {} slices, estimated error {estimate:.1e}",
            resolution.plan.count()
        );
        // Bloch vectors other than those the resolution was judged at.
        let directions = Directions { kx_per_zone, ky };
        let table = shares(&interface, &directions, &resolution);
        let halved = Resolution { plan: resolution.plan.refined(2), ..resolution.clone() };
        let wider = Resolution {
            truncation: Truncation::new(highest + highest.div_ceil(3)).expect("orders"),
            ..resolution.clone()
        };
        for (what, finer) in [("slices halved", halved), ("a third more orders", wider)] {
            let (worst, beyond) = change(&table, &shares(&interface, &directions, &finer));
            println!(
                "band {number}, {what}: {worst:.2e} at most over {} directions, {beyond} beyond 3e-3",
                table.len()
            );
            assert!(
                worst <= CONVERGED,
                "band {number}, {what}: {worst:.2e}, {beyond} of {} directions",
                table.len()
            );
        }
    }
}

/// The table of D1's band 2, made once for all tests.
fn table() -> &'static (Interface, Resolution, OrderTable) {
    static TABLE: OnceLock<(Interface, Resolution, OrderTable)> = OnceLock::new();
    TABLE.get_or_init(|| {
        let (interface, hybrid) = (band(2), design().hybrid);
        let (resolution, _) = found(&interface);
        let ky = Grid::ky_nodes(interface.n_top.re, interface.n_bottom.re, 40);
        let table = order_table(&interface, hybrid.kx_per_zone.unwrap_or(2), ky, &resolution)
            .expect("a table");
        (interface, resolution, table)
    })
}

#[test]
fn energy_and_reciprocity_hold_and_files_keep_every_bit() {
    let (_, _, table) = table();
    assert!(table.header().energy_residual < 1e-10, "{}", table.header().energy_residual);
    // Shares are stored as f32: sums of some hundred are right to 1e-6.
    let energy = validate::energy(table);
    assert!(energy.deviation.worst < 2e-6, "{energy:?}");
    let reciprocity = validate::reciprocity(table);
    // Both lines of the table are their own mirror images, so that the solver is tested. Shares
    // that the extrapolation in the slices puts below 0 are set to 0 and the rest of their node is
    // scaled, which is no more than what slices leave.
    println!(
        "reciprocity: {:.1e} rms, {:.1e} worst",
        reciprocity.deviation.rms, reciprocity.deviation.worst
    );
    assert!(
        reciprocity.deviation.worst < 5e-4 && reciprocity.deviation.rms < 1e-5,
        "{reciprocity:?}"
    );
    let albedo = validate::albedo(table, 500, &mut tracer::random::stream(1, 0));
    assert!(
        (albedo.lowest - 1.0).abs() < 2e-6 && (albedo.highest - 1.0).abs() < 2e-6,
        "{albedo:?}"
    );

    let mut bytes = Vec::new();
    native::write(table, &mut bytes).expect("written");
    let back = native::read(&bytes[..]).expect("read");
    assert_eq!((back.header(), back.grid()), (table.header(), table.grid()));
    for node in table.grid().nodes() {
        for polarisation in [Polarisation::S, Polarisation::P] {
            let bits = |t: &OrderTable| -> Vec<(Side, i32, u64)> {
                t.node_efficiencies(node, polarisation)
                    .expect("a node")
                    .into_iter()
                    .map(|o| (o.to, o.order, o.efficiency.to_bits()))
                    .collect()
            };
            assert_eq!(bits(&back), bits(table), "{node:?}");
        }
    }
    let mut again = Vec::new();
    native::write(&back, &mut again).expect("written");
    assert!(again == bytes, "the copy of the copy is the file");
}

/// From air, beyond the last nodes of the table.
#[test]
fn reflectance_at_grazing_incidence_is_that_of_direct_solves() {
    let (interface, resolution, table) = table();
    for azimuth in [0.0, 1.0, 1.57] {
        let mut before = 0.0;
        for degrees in [87.0, 89.0, 89.8] {
            let tangential = f64::to_radians(degrees).sin();
            let k = Wavevector {
                kx: tangential * f64::cos(azimuth),
                ky: tangential * f64::sin(azimuth),
            };
            let [s, p] =
                direct(interface, rcwa::Side::Bottom, (k.kx, k.ky), resolution).expect("solved");
            let back = |shares: &Shares| -> f64 {
                shares.iter().filter(|o| o.0 == rcwa::Side::Bottom).map(|o| o.2).sum()
            };
            let expected = 0.5 * (back(&s) + back(&p));
            let orders = table.efficiencies(Side::Outer, k, Polarisation::Unpolarised);
            let own = orders.iter().filter(|o| o.to == Side::Outer);
            let reflected: f64 = own.map(|o| o.efficiency).sum();
            println!("{degrees} degrees, azimuth {azimuth}: {reflected:.3}, solver {expected:.3}");
            assert!((reflected - expected).abs() < 0.06, "{reflected} {expected}");
            assert!(reflected > before);
            before = reflected;
        }
    }
}

#[test]
#[ignore = "nightly: 15 s"]
fn nightly_interpolated_shares_are_those_of_direct_solves() {
    let (interface, resolution, table) = table();
    for (side, count) in [(Side::Inner, 40), (Side::Outer, 20)] {
        let mut rng = tracer::random::stream(2, side.index() as u64);
        // s and p of one incidence are asked one after the other and solved together.
        let mut last: Option<(Wavevector, [Shares; 2])> = None;
        let solve = |side, k: Wavevector, polarisation| {
            let solved = match last.take() {
                Some((known, solved)) if known == k => solved,
                _ => direct(interface, solver_side(side), (k.kx, k.ky), resolution)?,
            };
            let chosen = &solved[usize::from(polarisation == Polarisation::P)];
            let shares =
                chosen.iter().map(|s| OrderEfficiency::new(scatter_side(s.0), s.1, s.2)).collect();
            last = Some((k, solved));
            Ok::<Vec<OrderEfficiency>, anyhow::Error>(shares)
        };
        let report = validate::interpolation(table, side, count, &mut rng, solve).expect("solved");
        let InterpolationReport { reflected, transmitted, orders, order_means } = &report;
        let worst_mean = order_means.iter().map(|m| m.efficiency.abs()).fold(0.0, f64::max);
        println!(
            "{side}: R off by {:.1e} rms, {:.1e} worst, mean {:+.1e} +- {:.1e}; T {:.1e} rms; single orders {:.1e} rms, {:.1e} worst; means over diffuse light {worst_mean:.1e} worst",
            reflected.rms,
            reflected.worst,
            reflected.mean,
            reflected.mean_error,
            transmitted.rms,
            orders.rms,
            orders.worst
        );
        // A ray meets many directions, so that what counts is the mean over diffuse light: it must
        // be within what the design asks of slices and orders, or within its own standard error.
        // Single directions between nodes of a 10 µm relief are off by more: the shares turn with
        // the phase of its depth.
        let allowed = CONVERGED + 4.0 * reflected.mean_error;
        assert!(reflected.mean.abs() < allowed, "{side}: {reflected:?}");
        assert!(
            (reflected.mean + transmitted.mean).abs() < 1e-5,
            "{side}: {reflected:?} {transmitted:?}"
        );
        // What the table says of itself, from its nodes alone.
        let stated = validate::leave_one_out(table, side);
        println!("{side}: {stated:.1e} stated between nodes");
        // From air the few nodes next to the rim, where all light is reflected, weigh most in it.
        let most = if side == Side::Inner { 2.5 } else { 10.0 };
        assert!(
            (0.4..most).contains(&(stated / reflected.rms)),
            "{side}: {stated:.1e} stated, {reflected:?}"
        );
        assert!(reflected.rms < 0.05 && orders.rms < 0.02, "{side}: {reflected:?} {orders:?}");
    }
}

#[test]
fn tables_with_too_few_orders_are_refused() {
    // From the solver, which every table comes from: 2.0 um at 0.55 um lets orders up to ±5
    // propagate in silicone.
    let relief = Relief::new(2.0, 0.1, Complex64::new(1.2, 0.0), Vec::new()).expect("a relief");
    let interface = on_silicone(relief);
    let solve = |highest: usize| {
        let resolution = Resolution {
            truncation: Truncation::new(highest).expect("a truncation"),
            plan: interface.relief.slice_plan(1),
        };
        let directions = Directions { kx_per_zone: 2, ky: vec![0.1] };
        hemisphere(&interface, &directions, &resolution, &no_progress)
    };
    let message = solve(4).expect_err("too few").to_string();
    assert!(message.contains("orders -4..4 are kept, but orders up to ±5 propagate"), "{message}");
    assert!(solve(5).is_ok());
}
