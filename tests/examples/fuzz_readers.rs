// SPDX-License-Identifier: MIT OR Apache-2.0
//! A million altered files for each reader: `cargo run --release -p batwing-tests --example
//! fuzz_readers [INPUTS] [READER]`.

#![expect(clippy::print_stdout, reason = "the table is what the program is run for")]

use batwing_tests::fuzz::{bombard, peak_megabytes, targets};
use std::time::Instant;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let inputs: u64 =
        arguments.next().map_or(1_000_000, |n| n.parse().expect("a number of inputs"));
    let only = arguments.next();
    for target in targets() {
        if only.as_ref().is_some_and(|name| name != target.name) {
            continue;
        }
        let begin = Instant::now();
        let report = bombard(&target, 0..inputs);
        println!(
            "{:12} {inputs} inputs, {} accepted, {:.1} s, slowest {:.1} ms, peak {:.0} MB",
            target.name,
            report.accepted,
            begin.elapsed().as_secs_f64(),
            report.slowest.as_secs_f64() * 1e3,
            peak_megabytes().unwrap_or(f64::NAN)
        );
    }
}
