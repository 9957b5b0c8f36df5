// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the table of a ring takes, and what its operations would take at the rate of this machine's
//! matrix products, measured in the same run by faer.
//!
//! The relief is a step of 10 µm by 4.03 µm, that of ring 75 of D1, silicone (n = 1.41) in air at
//! 550 nm, whole hemispheres from both sides, two lines of kx, ky chosen by error. Prints one line
//! of JSON: seconds of CPU for the search of orders and slices and for the table, the operations
//! counted ([`rcwa::cost_model`], complex multiply-adds, a real one a quarter), real and complex
//! products of the size of the matrices, seconds each (median), and how many times the seconds at
//! the rate of real products all of it takes.
//!
//! ```sh
//! RAYON_NUM_THREADS=1 cargo run --release -p batwing-rcwa --example floor -- [TOLERANCE]
//! ```

#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program that times and prints"
)]

#[path = "common/clock.rs"]
mod clock;

use clock::cpu_seconds;
use faer::linalg::matmul::matmul;
use faer::traits::ComplexField;
use faer::{Accum, Mat, Par, c64};
use num_complex::Complex64;
use rcwa::accuracy::converge_hemisphere;
use rcwa::cost_model;
use rcwa::hemisphere::Interface;
use rcwa::incidence_grid::{GridRequest, solve_adaptive};
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use serde_json::json;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

const SILICONE: f64 = 1.41;
/// ky to begin with, as tables have them.
const KY: usize = 12;

/// Numbers that a processor holds in whole registers whatever their width.
const REGISTERS: usize = 16;

/// Seconds that a product of this size takes on one thread: median of those of the next size that
/// fills registers, less what it is larger by. (Registers that are filled in part can hold anything
/// beside, and some processors take ten times as long where that is denormal.)
fn product<T: ComplexField>(size: usize, fill: impl Fn(f64) -> T) -> f64 {
    let wanted = size as f64;
    let size = size.next_multiple_of(REGISTERS);
    let matrix = |by: f64| Mat::from_fn(size, size, |i, j| fill((by * (i * 7 + j) as f64).sin()));
    let (a, b) = (matrix(0.7), matrix(1.3));
    let mut out = matrix(0.1);
    let mut seconds: Vec<f64> = (0..401)
        .map(|_| {
            let begin = Instant::now();
            matmul(&mut out, Accum::Replace, &a, &b, fill(1.0), Par::Seq);
            begin.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2] * (wanted / size as f64).powi(3)
}

fn main() -> Result<(), Failure> {
    let tolerance = std::env::args().nth(1).map_or(Ok(1e-3), |text| text.parse())?;
    let relief = shapes::step(10.0, 4.03, Materials::lossless(SILICONE, 1.0))?;
    let interface = Interface {
        relief,
        wavelength: 0.55,
        n_top: Complex64::new(SILICONE, 0.0),
        n_bottom: Complex64::new(1.0, 0.0),
    };
    let begin = cpu_seconds()?;
    let (resolution, estimate) = converge_hemisphere(&interface, tolerance, &no_progress)?;
    let search = cpu_seconds()? - begin;
    let below = KY - KY / 4;
    let lower =
        (0..below).map(|j| (std::f64::consts::FRAC_PI_2 * j as f64 / (below as f64 - 0.5)).sin());
    let upper = (0..KY / 4).map(|j| {
        let phase = std::f64::consts::PI * (j as f64 + 0.5) / (KY / 4) as f64;
        1.0 + (SILICONE - 1.0) * 0.5 * (1.0 - phase.cos())
    });
    let request = GridRequest {
        kx_per_zone: 2,
        max_kx: None,
        ky: lower.chain(upper).collect(),
        critical_ky: 1.0,
        tolerance,
        max_ky: 400,
    };
    let found = solve_adaptive(&interface, &request, &resolution, &no_progress)?;
    let table = cpu_seconds()? - begin - search;
    let counted = cost_model::operations(&interface, &found.directions, &resolution).total();
    let size = 2 * resolution.truncation.count();
    let real = product(size, |x| x);
    let complex = product(size, |x| c64::new(x, 0.5 * x));
    let floor = 4.0 * counted * real / (size as f64).powi(3);
    println!(
        "{}",
        json!({
            "tolerance": tolerance,
            "estimated_error": estimate,
            "grid_error": found.grid_error,
            "orders": resolution.truncation.count(),
            "slices": resolution.plan.count(),
            "ky": found.directions.ky.len(),
            "worst_balance": found.solved.worst_balance,
            "search_cpu_seconds": search,
            "table_cpu_seconds": table,
            "operations": counted,
            "size": size,
            "real_product_seconds": real,
            "complex_product_seconds": complex,
            "floor_seconds": floor,
            "ratio": (search + table) / floor,
            "ratio_of_table": table / floor,
        })
    );
    Ok(())
}
