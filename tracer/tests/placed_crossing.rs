// SPDX-License-Identifier: MIT OR Apache-2.0
//! Placed shapes that cut each other, share a face or reach into packages and walls are refused,
//! with both names; those that stand apart are not.

use crate::common::package::Dome;
use crate::common::placed::{at, brick, disc, turned};
use crate::common::*;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::{Closing, Element};
use tracer::{
    Emission, Emitter, Error, Medium, Meridian, PlaneMap, Prototype, Region, Scene, SceneBuilder,
    Shape, Source, Surface, SurfaceModel,
};

fn solid(name: &str, shape: Shape, inner: Region, outer: Region, optics: &SurfaceModel) -> Surface {
    Surface::new(name, shape, inner, outer, optics)
}

fn lit(surfaces: Vec<Surface>, media: usize) -> Result<Scene, Error> {
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: (0..media).map(|k| Medium::clear(format!("glass {k}"), 1.5)).collect(),
        surfaces,
        sources: Vec::new(),
    });
    scene.place(id, DVec3::ZERO);
    scene.source(Source::new(
        "lamp",
        DVec3::new(0.0, 0.0, 9.0),
        Region::World,
        Emitter::Point,
        Emission::Isotropic,
    ));
    scene.build()
}

#[test]
fn solids_that_cut_or_share_a_face_are_refused_and_those_with_an_inset_are_not() {
    let (one, two) = (Region::Body(0), Region::Body(1));
    let clear = SurfaceModel::Interface;
    let pair = |inset: f64, apart: f64| {
        let lower = brick([0.5, 0.5, 0.5], &at([0.0; 3], DMat3::IDENTITY, inset));
        let upper = brick([0.5, 0.5, 0.5], &at([0.0, 0.0, apart], DMat3::IDENTITY, inset));
        lit(
            vec![
                solid("lower", lower, one, Region::World, &clear),
                solid("upper", upper, two, Region::World, &clear),
            ],
            2,
        )
    };
    assert!(pair(0.0, 1.001).is_ok() && pair(1e-9, 1.0).is_ok());
    for (inset, apart) in [(0.0, 1.0), (0.0, 0.999), (1e-9, 0.9999)] {
        let error = pair(inset, apart).err().expect("refused");
        assert!(matches!(&error, Error::Crossing { .. }), "{error}");
        let said = error.to_string();
        assert!(said.contains("'lower'") && said.contains("'upper'"), "{said}");
    }
    // A sheet whose edge leaves the solid that it claims to lie in.
    let sheet = |radius: f64| {
        let block = brick([0.5; 3], &at([0.0; 3], turned(), 0.0));
        let place = at([0.0; 3], DMat3::IDENTITY, 0.0);
        lit(
            vec![
                solid("block", block, one, Region::World, &clear),
                solid("sheet", disc(radius, &place), one, one, &SurfaceModel::Absorber),
            ],
            1,
        )
    };
    assert!(sheet(0.45).is_ok());
    let said = sheet(0.75).err().expect("refused").to_string();
    assert!(said.contains("'sheet'") && said.contains("'block'"), "{said}");
    assert!(said.contains("air") && said.contains("glass 0"), "{said}");
}

#[test]
fn balls_that_cut_each_other_a_little_are_refused_and_those_that_touch_are_not() {
    let (one, two) = (Region::Body(0), Region::Body(1));
    let ball = |radius: f64, centre: DVec3| {
        let sphere = Shape::sphere(0.0, radius).unwrap();
        let place = at(centre.to_array(), DMat3::IDENTITY, 0.0);
        Shape::placed(vec![sphere], Closing::Closed, &place).unwrap()
    };
    let aside = DVec3::new(0.6, -0.3, 0.5).normalize();
    for overlap in [-1e-3, 0.0, 1e-4, 1e-3] {
        let second = ball(0.3, aside * (0.8 - overlap));
        let scene = lit(
            vec![
                solid(
                    "large",
                    ball(0.5, DVec3::ZERO),
                    one,
                    Region::World,
                    &SurfaceModel::Interface,
                ),
                solid("small", second, two, Region::World, &SurfaceModel::Interface),
            ],
            2,
        );
        assert_eq!(scene.is_err(), overlap > 0.0, "{overlap} mm");
        if let Err(error) = scene {
            let said = error.to_string();
            let named = said.contains("'large'") && said.contains("'small'");
            assert!(matches!(error, Error::Crossing { .. }) && named, "{said}");
        }
    }
}

/// Of forty bricks in a row two share a corner of a thousandth of their size.
#[test]
fn one_small_cut_among_many_solids_is_refused() {
    let bricks = |overlap: f64| {
        let brick_at = |k: u8| {
            let shift = if k == 20 { overlap } else { 0.0 };
            let place = [1.1 * f64::from(k) - 0.1 * f64::from(k / 20) - shift, shift, 0.0];
            let shape = brick([0.5; 3], &at(place, DMat3::IDENTITY, 1e-6));
            solid(
                &format!("brick {k}"),
                shape,
                Region::Body(k),
                Region::World,
                &SurfaceModel::Interface,
            )
        };
        lit((0..40).map(brick_at).collect(), 40)
    };
    assert!(bricks(0.0).is_ok());
    let said = bricks(1e-3).err().expect("refused").to_string();
    assert!(said.contains("'brick 19'") && said.contains("'brick 20'"), "{said}");
}

/// Solids about one axis, one above the other, has middles on a line that meets a tip or an
/// apex.
#[test]
fn a_cone_above_a_ball_and_a_brick_is_no_cut() {
    let cone = |tip: f64| {
        let points = vec![[0.0, tip], [0.4, 0.0], [0.0, 0.0]];
        Shape::revolution(&Meridian::new(&[Element { points }]).unwrap())
    };
    let place = at([0.0, 0.0, 2.0], DMat3::IDENTITY, 0.0);
    let (one, two, three) = (Region::Body(0), Region::Body(1), Region::Body(2));
    let clear = SurfaceModel::Interface;
    for steep in [0.05, 0.3, 1.0, 3.0] {
        let above = Shape::placed(vec![cone(steep)], Closing::Closed, &place).unwrap();
        let sphere = Shape::sphere(0.0, 0.3).unwrap();
        let middle = at([0.0, 0.0, 1.0], DMat3::IDENTITY, 0.0);
        let ball = Shape::placed(vec![sphere], Closing::Closed, &middle).unwrap();
        let brick = brick([0.5; 3], &at([0.0; 3], DMat3::IDENTITY, 0.0));
        let mut surfaces = vec![
            solid("cone", above, one, Region::World, &clear),
            solid("ball", ball, two, Region::World, &clear),
            solid("brick", brick, three, Region::World, &clear),
        ];
        assert!(lit(surfaces.clone(), 3).is_ok(), "{steep}");
        surfaces.reverse();
        assert!(lit(surfaces, 3).is_ok(), "{steep}");
    }
}

/// A package with what stands among all.
fn with_among(shape: Shape, wall: Option<Shape>, place: [f64; 3]) -> Result<Scene, Error> {
    let mut scene = SceneBuilder::new(Medium::air());
    let dome = package(N, Dome::smooth(&CAP), 0.95, 0.86).prototype().unwrap();
    let id = scene.prototype(dome);
    scene.place(id, DVec3::from_array(place));
    let among = scene.prototype(Prototype {
        media: vec![Medium::clear("lens", 1.5)],
        surfaces: vec![solid("lens", shape, BODY, Region::World, &SurfaceModel::Interface)],
        sources: Vec::new(),
    });
    scene.array_solids(among);
    if let Some(wall) = wall {
        let wall =
            Surface::new("wall", wall, Region::Opaque, Region::World, &SurfaceModel::Absorber);
        scene.surface(wall);
    }
    scene.build()
}

#[test]
fn what_stands_among_packages_cuts_neither_them_nor_walls() {
    let plate = |z: f64| brick([6.0, 6.0, 0.25], &at([0.0, 0.0, z], DMat3::IDENTITY, 0.0));
    let wall = Shape::cuboid(DVec3::new(5.0, -5.0, 0.0), DVec3::new(5.5, 5.0, 2.0)).unwrap();
    assert!(with_among(plate(3.0), Some(wall.clone()), [0.5, 0.0, 0.0]).is_ok());
    // A bowl over the dome: in the box around it, and free of it.
    let points = vec![[0.0, 2.5], [2.5, 2.5], [2.5, 0.2], [2.2, 0.2], [2.2, 2.2], [0.0, 2.2]];
    let bowl = Shape::revolution(&Meridian::new(&[Element { points }]).unwrap());
    let bowl = |by: f64| {
        let place = at([by, 0.0, 0.0], DMat3::IDENTITY, 0.0);
        Shape::placed(vec![bowl.clone()], Closing::Closed, &place).unwrap()
    };
    assert!(with_among(bowl(0.0), None, [0.0; 3]).is_ok());
    for (shape, wall) in [(plate(1.0), None), (plate(1.5), Some(wall)), (bowl(0.8), None)] {
        let walled = wall.is_some();
        let error = with_among(shape, wall, [0.0; 3]).err().expect("refused");
        let said = error.to_string();
        assert!(matches!(error, Error::Crossing { .. }), "{said}");
        let dome = ["'dome'", "'side'", "'bottom'"].iter().any(|n| said.contains(n));
        assert!(said.contains("'lens'"), "{said}");
        assert!(if walled { said.contains("'wall'") } else { dome }, "{said}");
    }
}

#[test]
fn a_plane_through_what_stands_among_packages_is_refused() {
    let plate = brick([1.0, 1.0, 0.25], &at([3.0, 0.0, 3.0], DMat3::IDENTITY, 0.0));
    let scene = with_among(plate, None, [0.0; 3]).unwrap();
    let plane = |height: f64, columns: usize| PlaneMap::centred(height, 0.1, columns, 20).unwrap();
    assert!(scene.admits(&plane(2.5, 100)).is_ok() && scene.admits(&plane(3.5, 100)).is_ok());
    assert!(scene.admits(&plane(3.0, 30)).is_ok());
    let error = scene.admits(&plane(3.0, 100)).expect_err("through the plate");
    assert!(matches!(error, Error::ReceiverCuts { .. }), "{error}");
    assert!(scene.admits(&plane(0.5, 10)).is_err());
    assert!((scene.top_mm() - 1.0).abs() < 1e-9 && scene.instances() == 1);
}
