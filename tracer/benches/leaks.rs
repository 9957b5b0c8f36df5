// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays lost in closed bodies: `cargo bench -p batwing-tracer --bench leaks [-- PATHS [BODY]]`, 10⁶ paths unless told otherwise, in every body or in those whose name
//! contains a word.
//!
//! Every body has a mirror for a bottom and absorbs a little on the way, so that a path meets many surfaces and yet ends. A ray that meets nothing inside of a body is lost by a leak
//! and booked so; anything lost makes the program fail. Prints paths, surfaces met and the power lost of each body.

#![expect(
    clippy::print_stdout,
    reason = "the lines are what the program is run for"
)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{CAP, N, meshed_cap, package, single, staircase, teeth};
use tracer::{Dome, Emission, Prototype, Settings, run};

fn dome(dome: Dome) -> Prototype {
    package(N, dome, 0.99, 0.99).prototype().expect("a package")
}

fn main() {
    // The harness of cargo adds flags of its own.
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
        .collect();
    let paths = words.first().and_then(|word| word.parse().ok());
    let paths: u64 = paths.unwrap_or(1_000_000);
    let bodies = [
        ("smooth dome, side, box", dome(Dome::smooth(&CAP))),
        ("17 steps", dome(Dome::relief(staircase(17)))),
        ("170 steps", dome(Dome::relief(staircase(170)))),
        ("17 teeth", dome(Dome::relief(teeth(17, 50.0, 70.0)))),
        (
            "mesh of 200,000 triangles",
            meshed_cap(200_000, Emission::Isotropic),
        ),
    ];
    let mut lost = 0.0;
    for (name, mut body) in bodies {
        if words
            .get(1)
            .is_some_and(|word| !name.contains(word.as_str()))
        {
            continue;
        }
        for medium in &mut body.media {
            *medium = medium.clone().absorbing(1e-3);
        }
        let outcome = run(&single(body), &[], &Settings::new(paths, 1)).expect("a run");
        let ledger = &outcome.total.ledger;
        println!(
            "{name}: {} paths, {} surfaces met, {:e} W lost of 1 W",
            outcome.paths,
            outcome.hits,
            ledger.lost_total()
        );
        lost += ledger.lost_total();
    }
    assert!(lost <= 0.0, "{lost:e} W lost");
}
