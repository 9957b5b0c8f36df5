// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shapes at any place, turned.

use tracer::glam::{DMat3, DVec3};
use tracer::shape::{Closing, Placement};
use tracer::{Emission, Emitter, Outcome, Region, SceneBuilder, Settings, Shape, Source};

use super::{furnace_wall, many, trace};

/// A turn about all three axes.
pub fn turned() -> DMat3 {
    DMat3::from_rotation_z(0.7) * DMat3::from_rotation_y(-0.4) * DMat3::from_rotation_x(1.9)
}

pub fn at(origin: [f64; 3], rotation: DMat3, inset: f64) -> Placement {
    Placement { rotation, inset, ..Placement::at(DVec3::from_array(origin)) }
}

/// A box of these half lengths.
pub fn brick(half: [f64; 3], placement: &Placement) -> Shape {
    let half = DVec3::from_array(half);
    let cuboid = Shape::cuboid(-half, half).unwrap();
    Shape::placed(vec![cuboid], Closing::Closed, placement).unwrap()
}

pub fn disc(radius: f64, placement: &Placement) -> Shape {
    let annulus = Shape::annulus(0.0, 0.0, radius).unwrap();
    Shape::placed(vec![annulus], Closing::Open, placement).unwrap()
}

/// Outcome of a scene within a sphere that emits all over its inside; nothing may be lost.
pub fn in_furnace(mut scene: SceneBuilder, radius: f64) -> Outcome {
    scene.surface(furnace_wall(radius));
    scene.source(Source::new(
        "wall",
        DVec3::ZERO,
        Region::World,
        Emitter::Enclosure { radius },
        Emission::LAMBERTIAN,
    ));
    let settings = Settings { max_bounces: 1_000_000, ..Settings::new(many() / 4, 29) };
    let outcome = trace(&scene.build().unwrap(), &[], &settings);
    let ledger = &outcome.total.ledger;
    assert!(ledger.lost_total() < 1e-9, "{:?}", ledger.lost);
    outcome
}
