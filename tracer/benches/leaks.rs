// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays lost in closed bodies: `cargo bench -p batwing-tracer --bench leaks [-- PATHS [BODY]]`, 10⁶
//! paths unless told otherwise, in every body or in those whose name contains a word; each body
//! with many paths at a time, as runs trace it, and one path after the other.
//!
//! A ray that meets nothing inside of a body is lost by a leak and booked so; anything lost makes
//! the program fail. Prints paths, surfaces met and the power lost of each body.

#![expect(clippy::print_stdout, reason = "the lines are what the program is run for")]

#[path = "../tests/common/closed.rs"]
mod closed;
#[path = "../tests/common/mod.rs"]
mod common;

use common::single;
use tracer::{Control, Settings, run, run_rays};

fn main() {
    // The harness of cargo adds flags of its own.
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let paths = words.first().and_then(|word| word.parse().ok());
    let settings = Settings::new(paths.unwrap_or(1_000_000), 1);
    let asked = |name: &str| words.get(1).is_none_or(|word| name.contains(word.as_str()));
    let mut lost = 0.0;
    for (name, body) in closed::bodies(200_000) {
        if !asked(name) {
            continue;
        }
        let scene = single(body);
        for one_by_one in [false, true] {
            let outcome = if one_by_one {
                run_rays(&scene, &settings, Control::default(), |_, _| Ok(()))
            } else {
                run(&scene, &[], &settings)
            };
            let outcome = outcome.expect("a run");
            let ledger = &outcome.total.ledger;
            println!(
                "{name}{}: {} paths, {} surfaces met, {:e} W lost of 1 W",
                if one_by_one { ", one by one" } else { "" },
                outcome.paths,
                outcome.hits,
                ledger.lost_total()
            );
            lost += ledger.lost_total();
        }
    }
    assert!(lost <= 0.0, "{lost:e} W lost");
}
