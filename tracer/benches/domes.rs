// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths per second and core through one package over a mirror, smooth and
//! stepped.

#[path = "../tests/common/mod.rs"]
mod common;

use common::package::Dome;
use common::{CAP, staircase};
use divan::Bencher;
use divan::counter::ItemsCount;
use tracer::{FarField, PlaneMap, Scene, Settings, run};

fn main() {
    divan::main();
}

fn scene(dome: Dome) -> Scene {
    let package = common::package(1.41, dome, 0.95, 0.86);
    common::array(&package, 2, 8.3).build().unwrap()
}

fn measure(bencher: Bencher, scene: &Scene, seed: u64) {
    const PATHS: u64 = 100_032;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let far = FarField::default();
    let plane = PlaneMap::centred(3.0, 0.1, 240, 240).unwrap();
    let mut settings = Settings::new(PATHS, seed);
    settings.groups = 4;
    bencher
        .counter(ItemsCount::new(PATHS))
        .bench_local(|| one.install(|| run(scene, &[&far, &plane], &settings).unwrap()));
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn smooth(bencher: Bencher) {
    measure(bencher, &scene(Dome::smooth(&CAP)), 1);
}

#[divan::bench(args = [17, 170], sample_count = 10, sample_size = 1)]
fn stepped(bencher: Bencher, steps: usize) {
    measure(bencher, &scene(Dome::relief(staircase(steps))), 1);
}
