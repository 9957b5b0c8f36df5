// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the solver takes for a hemisphere of incidence at a stated number of orders and slices,
//! without extrapolation: one half of what `benches/peers/time_peers.py` compares.
//!
//! The relief is a silicone (n = 1.41) triangle of 10 µm period and 3 µm height in air, light from
//! the silicone at 550 nm. Prints JSON: seconds of CPU of the whole process for all directions of
//! half the hemisphere (ky > 0, the other half has the same shares), for a single direction, and
//! for a table whose orders and slices are found for a tolerance; the worst energy residual; shares
//! of sample directions.
//!
//! ```sh
//! RAYON_NUM_THREADS=1 cargo run --release -p batwing-rcwa --example hemisphere_time -- --orders 121 --slices 32
//! ```
//!
//! `--what sample` leaves the whole hemisphere out. `--apex X` moves the apex (5 µm: isosceles),
//! `--tolerance T` adds the table, `--accuracy N:S,N:S` the error of N orders and S slices without
//! extrapolation, `--sample KX:KY,KX:KY` shares of these directions (units of k0) with a basis of
//! orders centred on each.

#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program that times and prints"
)]

#[path = "common/clock.rs"]
mod clock;

use clock::cpu_seconds;
use num_complex::Complex64;
use rcwa::accuracy::converge_hemisphere;
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::solve::solve_symmetric_line;
use rcwa::{Bloch, Pol, Scattering, Side, SymmetricBloch, Truncation, solve};
use serde_json::{Value, json};

type Failure = Box<dyn std::error::Error>;

const WAVELENGTH: f64 = 0.55;
const SILICONE: f64 = 1.41;
const PERIOD: f64 = 10.0;
const HEIGHT: f64 = 3.0;

/// kx in a Brillouin zone (0 and half an order spacing) and ky of the hemisphere.
const KX_PER_ZONE: usize = 2;
const KY: usize = 42;

struct Options {
    orders: usize,
    slices: usize,
    apex: f64,
    tolerance: Option<f64>,
    accuracy: Vec<(usize, usize)>,
    sample: Vec<(f64, f64)>,
    whole: bool,
}

fn pairs<A: std::str::FromStr, B: std::str::FromStr>(text: &str) -> Result<Vec<(A, B)>, Failure> {
    let pair = |pair: &str| {
        let (a, b) = pair.split_once(':')?;
        Some((a.parse().ok()?, b.parse().ok()?))
    };
    let all: Option<Vec<_>> = text.split(',').map(pair).collect();
    all.ok_or_else(|| format!("expected pairs A:B,A:B, got {text}").into())
}

fn options() -> Result<Options, Failure> {
    let mut options = Options {
        orders: 121,
        slices: 32,
        apex: 5.0,
        tolerance: None,
        accuracy: Vec::new(),
        sample: Vec::new(),
        whole: true,
    };
    let mut words = std::env::args().skip(1);
    while let Some(name) = words.next() {
        let value = words.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--orders" => options.orders = value.parse()?,
            "--slices" => options.slices = value.parse()?,
            "--apex" => options.apex = value.parse()?,
            "--tolerance" => options.tolerance = Some(value.parse()?),
            "--accuracy" => options.accuracy = pairs(&value)?,
            "--what" => options.whole = value != "sample",
            "--sample" => options.sample = pairs(&value)?,
            other => return Err(format!("unknown option {other}").into()),
        }
    }
    Ok(options)
}

fn interface(apex: f64) -> Result<Interface, Failure> {
    let materials = Materials::lossless(SILICONE, 1.0);
    Ok(Interface {
        relief: shapes::triangle(PERIOD, [apex, HEIGHT], materials)?,
        wavelength: WAVELENGTH,
        n_top: SILICONE.into(),
        n_bottom: Complex64::ONE,
    })
}

fn directions() -> Directions {
    let ky = (0..KY).map(|i| (i as f64 + 0.5) * SILICONE / KY as f64);
    Directions { kx_per_zone: KX_PER_ZONE, ky: ky.collect() }
}

fn odd(orders: usize) -> Result<Truncation, Failure> {
    if orders.is_multiple_of(2) {
        return Err(format!("orders are -M..M, an odd number; got {orders}").into());
    }
    Ok(Truncation::new(orders / 2)?)
}

/// The Bloch wavevectors of a line: both lines are their own mirror image, so that they hold kx and
/// -kx.
const LINES: [SymmetricBloch; KX_PER_ZONE] = [SymmetricBloch::Centre, SymmetricBloch::Edge];

/// All problems of the hemisphere, the directions from the silicone that they hold, and the worst
/// residual.
fn whole(
    interface: &Interface,
    truncation: Truncation,
    slices: usize,
) -> Result<(usize, usize, f64), Failure> {
    let stack = interface.stack(&interface.relief.slice_plan(slices))?;
    let (mut problems, mut found, mut worst) = (0, 0, 0.0_f64);
    for at in LINES {
        let line = solve_symmetric_line(&stack, at, &directions().ky, truncation, &no_progress)?;
        problems += line.len();
        for scattering in &line {
            worst = worst.max(scattering.worst_balance().map_or(0.0, |w| w.3.abs()));
            found += scattering.orders(Side::Top).count();
        }
    }
    Ok((problems, found, worst))
}

fn single(interface: &Interface, truncation: Truncation, slices: usize) -> Result<f64, Failure> {
    let plan = interface.relief.slice_plan(slices);
    let (theta, phi) = (25_f64.to_radians(), 40_f64.to_radians());
    let mut seconds = Vec::new();
    for _ in 0..5 {
        let before = cpu_seconds()?;
        let stack = interface.stack(&plan)?;
        solve(&stack, Bloch::from_angles(&stack, Side::Top, theta, phi), truncation)?;
        seconds.push(cpu_seconds()? - before);
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[2])
}

fn shares(scattering: &Scattering) -> Value {
    let of = |pol| {
        let from = (Side::Top, 0, pol);
        let by_order: Vec<(i32, f64)> = scattering
            .orders(Side::Bottom)
            .map(|m| (m, scattering.efficiency(from, (Side::Bottom, m))))
            .collect();
        json!({
            "reflected": scattering.total(from, Side::Top),
            "transmitted": scattering.total(from, Side::Bottom),
            "transmitted_by_order": by_order,
        })
    };
    json!({ "s": of(Pol::S), "p": of(Pol::P) })
}

/// What is transmitted of every wave from the silicone, with the flux that a Lambertian source
/// gives it: equal for all nodes.
fn transmitted(line: &[Scattering]) -> Vec<f64> {
    let each = line.iter().flat_map(|scattering| {
        scattering.orders(Side::Top).flat_map(move |m| {
            Pol::BOTH.map(|pol| scattering.total((Side::Top, m, pol), Side::Bottom))
        })
    });
    each.collect()
}

/// Errors of plain slices: of the mean (a hemisphere of diffuse light) and what 99 % of the waves
/// stay below.
fn accuracy(interface: &Interface, wanted: &[(usize, usize)]) -> Result<Vec<Value>, Failure> {
    let ky: Vec<f64> = directions().ky.into_iter().step_by(14).collect();
    let at = |orders: usize, slices: usize| -> Result<Vec<f64>, Failure> {
        let stack = interface.stack(&interface.relief.slice_plan(slices))?;
        let mut all = Vec::new();
        for at in LINES {
            let line = solve_symmetric_line(&stack, at, &ky, odd(orders)?, &no_progress)?;
            all.extend(transmitted(&line));
        }
        Ok(all)
    };
    // To thickness 0 by the square of it.
    let (coarse, fine) = (at(141, 384)?, at(141, 512)?);
    let truth = coarse.iter().zip(&fine).map(|(c, f)| (16.0 * f - 9.0 * c) / 7.0);
    let truth: Vec<f64> = truth.collect();
    let mut rows = Vec::new();
    for &(orders, slices) in wanted {
        let got = at(orders, slices)?;
        let mut errors: Vec<f64> = got.iter().zip(&truth).map(|(g, t)| (g - t).abs()).collect();
        errors.sort_by(f64::total_cmp);
        let mean: f64 = got.iter().zip(&truth).map(|(g, t)| g - t).sum();
        rows.push(json!({
            "orders": orders,
            "slices": slices,
            "waves": errors.len(),
            "error_of_mean": mean / errors.len() as f64,
            "error_99_percent": errors[(errors.len() - 1) * 99 / 100],
            "error_worst": errors[errors.len() - 1],
        }));
    }
    Ok(rows)
}

/// Search and table at a tolerance, on the same directions.
fn table(interface: &Interface, tolerance: f64) -> Result<Value, Failure> {
    let start = cpu_seconds()?;
    let (resolution, estimate): (Resolution, f64) =
        converge_hemisphere(interface, tolerance, &no_progress)?;
    let searched = cpu_seconds()?;
    let solved = hemisphere(interface, &directions(), &resolution, &no_progress)?;
    let done = cpu_seconds()?;
    let from_silicone = solved.incidences.iter().filter(|i| i.side == Side::Top);
    let count = from_silicone.count() / 2;
    Ok(json!({
        "tolerance": tolerance,
        "estimated_error": estimate,
        "orders": resolution.truncation.count(),
        "layers": interface.layers(&resolution),
        "directions": count,
        "search_cpu_seconds": searched - start,
        "table_cpu_seconds": done - searched,
        "cpu_seconds_per_direction": (done - start) / count as f64,
        "worst_energy_residual": solved.worst_balance,
    }))
}

fn main() -> Result<(), Failure> {
    let options = options()?;
    let interface = interface(options.apex)?;
    let truncation = odd(options.orders)?;
    let mut report = json!({
        "apex_um": options.apex,
        "orders": options.orders,
        "slices": options.slices,
        "threads": rayon::current_num_threads(),
    });
    if options.whole {
        // Threads are started and memory is touched before anything is timed.
        whole(&interface, Truncation::new(26)?, 2)?;
        let before = cpu_seconds()?;
        let (problems, directions, worst) = whole(&interface, truncation, options.slices)?;
        let seconds = cpu_seconds()? - before;
        report["problems"] = problems.into();
        report["directions"] = directions.into();
        report["polarisations"] = 2.into();
        report["cpu_seconds"] = seconds.into();
        report["cpu_seconds_per_direction"] = (seconds / directions as f64).into();
        report["worst_energy_residual"] = worst.into();
        report["single_direction_cpu_seconds"] =
            single(&interface, truncation, options.slices)?.into();
    }
    let mut samples = Vec::new();
    for &(kx, ky) in &options.sample {
        let stack = interface.stack(&interface.relief.slice_plan(options.slices))?;
        let scattering = solve(&stack, Bloch::new(kx, ky), truncation)?;
        samples.push(json!({ "kx": kx, "ky": ky, "shares": shares(&scattering) }));
    }
    report["sample"] = samples.into();
    report["accuracy"] = accuracy_or_none(&interface, &options.accuracy)?;
    if let Some(tolerance) = options.tolerance {
        report["table"] = table(&interface, tolerance)?;
    }
    println!("{report:#}");
    Ok(())
}

fn accuracy_or_none(interface: &Interface, wanted: &[(usize, usize)]) -> Result<Value, Failure> {
    if wanted.is_empty() {
        return Ok(Value::Null);
    }
    Ok(accuracy(interface, wanted)?.into())
}
