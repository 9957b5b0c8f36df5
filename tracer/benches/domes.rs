// SPDX-License-Identifier: MIT OR Apache-2.0
//! What users wait for: paths per second and core through one package over a mirror, smooth and stepped.

use divan::Bencher;
use divan::counter::ItemsCount;
use tracer::glam::DVec3;
use tracer::package::ground;
use tracer::{
    Cap, Dome, FarField, LedBox, Medium, Meridian, Optics, Package, PlaneMap, Scene, SceneBuilder,
    Settings, run,
};

fn main() {
    divan::main();
}

const CAP: Cap = Cap {
    radius: 2.0,
    apex: 1.0,
    rim: 1.7,
};

fn scene(dome: Dome) -> Scene {
    let package = Package {
        cap: CAP,
        silicone: Medium::clear("silicone", 1.41),
        dome,
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
    scene.place_array(package, 2, 2, 8.3);
    scene.surface(
        ground(
            8.3,
            8.3,
            Optics::Mirror { reflectance: 0.95 },
            Optics::Absorber,
        )
        .unwrap(),
    );
    scene.build().unwrap()
}

fn measure(bencher: Bencher, scene: &Scene, seed: u64) {
    const PATHS: u64 = 100_032;
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
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
    let meridian = Meridian::staircase(CAP.centre_z(), CAP.radius, CAP.rim, steps).unwrap();
    measure(bencher, &scene(Dome::relief(meridian)), 1);
}
