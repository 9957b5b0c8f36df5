// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fuzz test of every reader of other programs' files, with a fixed seed.
//!
//! `cargo run --release -p batwing-tests --example fuzz_readers` reads a million inputs for each.

use std::time::Duration;

use batwing_tests::fuzz::{bombard, peak_megabytes, targets};

#[test]
fn readers_survive_altered_files() {
    for target in targets() {
        for (number, file) in target.corpus.iter().enumerate() {
            assert!((target.read)(file), "{}: file {number} of the corpus", target.name);
        }
        let report = bombard(&target, 0..10_000);
        assert!(report.slowest < Duration::from_secs(5), "{}: {report:?}", target.name);
        // Some alterations do no harm, most do.
        let share = report.accepted as f64 / 10_000.0;
        assert!(share > 0.0 && share < 0.9, "{}: {report:?}", target.name);
    }
    // The largest files of the corpus have 45 kB.
    if let Some(megabytes) = peak_megabytes() {
        assert!(megabytes < 250.0, "{megabytes} MB");
    }
}
