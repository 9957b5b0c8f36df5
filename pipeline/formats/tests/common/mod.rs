// SPDX-License-Identifier: MIT OR Apache-2.0
//! What tests of photometric files and of ray files share.

use tracer::glam::DVec3;
use tracer::{Emission, Emitter, FarField, Medium, Region, SceneBuilder, Settings, Source, run};

/// Power by direction, in bins of 10 by 30 degrees, of a point source in air, of 200 000 paths.
pub fn source_power_by_direction(emission: Emission) -> Vec<f64> {
    let far = FarField::new(10.0, 30.0).unwrap();
    let mut scene = SceneBuilder::new(Medium::air());
    let source = Source::new("s", DVec3::ZERO, Region::World, Emitter::Point, emission);
    scene.source(source);
    let outcome = run(&scene.build().unwrap(), &[&far], &Settings::new(200_000, 3)).unwrap();
    outcome.total.readings[0].clone()
}
