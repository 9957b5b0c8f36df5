// SPDX-License-Identifier: MIT OR Apache-2.0
//! List or hierarchy: paths per second and core over arrays of n × n smooth packages; and the same
//! where packages do not see each other.

#[path = "../tests/common/mod.rs"]
mod common;

use common::CAP;
use common::package::Dome;
use divan::Bencher;
use divan::counter::ItemsCount;
use tracer::scene::InstanceSearch;
use tracer::{Settings, run};

fn main() {
    divan::main();
}

fn measure(bencher: Bencher, side: usize, search: InstanceSearch, apart: bool) {
    const PATHS: u64 = 100_000;
    let package = common::package(1.41, Dome::smooth(&CAP), 0.95, 0.86);
    let mut scene = common::array(&package, side, 4.0);
    scene.search(search).isolated(apart);
    let scene = scene.build().unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut settings = Settings::new(PATHS, 1);
    settings.groups = 4;
    bencher
        .counter(ItemsCount::new(PATHS))
        .bench_local(|| one.install(|| run(&scene, &[], &settings).unwrap()));
}

#[divan::bench(args = [1, 2, 3, 4, 5, 6, 8, 16, 32], sample_count = 5, sample_size = 1)]
fn linear(bencher: Bencher, side: usize) {
    measure(bencher, side, InstanceSearch::Linear, false);
}

#[divan::bench(args = [1, 2, 3, 4, 5, 6, 8, 16, 32, 100], sample_count = 5, sample_size = 1)]
fn hierarchy(bencher: Bencher, side: usize) {
    measure(bencher, side, InstanceSearch::Hierarchy, false);
}

#[divan::bench(args = [2, 5, 10, 32, 100], sample_count = 5, sample_size = 1)]
fn apart(bencher: Bencher, side: usize) {
    measure(bencher, side, InstanceSearch::Automatic, true);
}
