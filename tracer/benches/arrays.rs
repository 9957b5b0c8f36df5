// SPDX-License-Identifier: MIT OR Apache-2.0
//! List or hierarchy: paths per second and core over arrays of n × n smooth packages.

use divan::Bencher;
use divan::counter::ItemsCount;
use tracer::glam::DVec3;
use tracer::package::ground;
use tracer::scene::Search;
use tracer::{Cap, Dome, LedBox, Medium, Optics, Package, SceneBuilder, Settings, run};

fn main() {
    divan::main();
}

fn measure(bencher: Bencher, side: usize, search: Search) {
    const PATHS: u64 = 100_000;
    let cap = Cap {
        radius: 2.0,
        apex: 1.0,
        rim: 1.7,
    };
    let package = Package {
        cap,
        silicone: Medium::clear("silicone", 1.41),
        dome: Dome::smooth(&cap),
        side: Optics::Interface,
        bottom: Optics::Mirror { reflectance: 0.95 },
        led: LedBox {
            size: DVec3::new(1.0, 1.0, 0.35),
            side: Optics::Mirror { reflectance: 0.86 },
            top: Optics::Mirror { reflectance: 0.86 },
        },
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let package = scene.prototype(package.prototype().unwrap());
    scene.place_array(package, side, side, 4.0).search(search);
    let half = 2.0 * side as f64;
    scene.surface(
        ground(
            half,
            half,
            Optics::Mirror { reflectance: 0.95 },
            Optics::Absorber,
        )
        .unwrap(),
    );
    let scene = scene.build().unwrap();
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let mut settings = Settings::new(PATHS, 1);
    settings.groups = 4;
    bencher
        .counter(ItemsCount::new(PATHS))
        .bench_local(|| one.install(|| run(&scene, &[], &settings).unwrap()));
}

#[divan::bench(args = [1, 2, 3, 4, 5, 6, 8, 16, 32], sample_count = 5, sample_size = 1)]
fn linear(bencher: Bencher, side: usize) {
    measure(bencher, side, Search::Linear);
}

#[divan::bench(args = [1, 2, 3, 4, 5, 6, 8, 16, 32], sample_count = 5, sample_size = 1)]
fn hierarchy(bencher: Bencher, side: usize) {
    measure(bencher, side, Search::Hierarchy);
}
