// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering events per second and core: a matched slab of albedo 1, optical depth 10 and g = 0.8,
//! and a package whose dome scatters.

#[path = "../tests/common/mod.rs"]
mod common;

use common::CAP;
use common::package::Dome;
use divan::Bencher;
use divan::counter::ItemsCount;
use tracer::glam::DVec3;
use tracer::observer::Observer;
use tracer::run::trace_observed;
use tracer::{
    Emission, Emitter, Medium, PhaseFunction, Prototype, Ray, Region, Scattering, Scene,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

fn main() {
    divan::main();
}

#[derive(Default)]
struct Count(u64);

impl Observer for Count {
    fn scatters(&mut self, _ray: &Ray, _line: usize) {
        self.0 += 1;
    }
}

fn milky(medium: Medium) -> Medium {
    let phase = PhaseFunction::HenyeyGreenstein(0.8);
    medium.scattering(Some(Scattering { per_mm: 10.0, phase }))
}

fn measure(bencher: Bencher, scene: &Scene) {
    const PATHS: u64 = 20_000;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let settings = Settings { groups: 2, ..Settings::new(PATHS, 1) };
    let mut count = Count::default();
    trace_observed(scene, &settings, |ray| ray, &mut count).unwrap();
    // As many events on average as of other paths of the same scene.
    bencher
        .counter(ItemsCount::new(count.0))
        .bench_local(|| one.install(|| run(scene, &[], &settings).unwrap()));
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn slab(bencher: Bencher) {
    let plane = |name: &str, z: f64, [inner, outer]: [Region; 2]| {
        let shape = Shape::horizontal(z).unwrap();
        Surface::new(name, shape, inner, outer, &SurfaceModel::Interface)
    };
    let (body, world) = (Region::Body(0), Region::World);
    let mut scene = SceneBuilder::new(Medium::air());
    let slab = scene.prototype(Prototype {
        media: vec![milky(Medium::clear("slab", 1.0))],
        surfaces: vec![plane("top", 0.0, [body, world]), plane("bottom", -1.0, [world, body])],
        sources: Vec::new(),
    });
    scene.place(slab, DVec3::ZERO);
    let beam = Emission::Beam { direction: -DVec3::Z };
    scene.source(Source::new("lamp", DVec3::Z, world, Emitter::Point, beam));
    measure(bencher, &scene.build().unwrap());
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn dome(bencher: Bencher) {
    let mut package = common::package(1.41, Dome::smooth(&CAP), 0.95, 0.86);
    package.silicone = milky(package.silicone);
    measure(bencher, &common::single(package.prototype().unwrap()));
}
