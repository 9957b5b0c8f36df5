// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prototypes, and the region or closed shape that holds a point.
//!
//! The surface seen first from a point faces it with the region of the point. Two of three
//! directions decide, because one may pass between two surfaces that share an edge.

use glam::{DMat3, DVec3};

use crate::error::Error;
use crate::optics::media::Medium;
use crate::ray::Ray;
use crate::shape::{Reach, Shape, Sides};
use crate::source::Source;
use crate::surface::{Region, Surface};

/// Directions in which a point looks for what holds it.
pub(super) const LOOKS: [DVec3; 3] = [
    DVec3::new(0.267_261, 0.534_522, 0.801_784),
    DVec3::new(-0.842_701, 0.337_080, -0.420_350),
    DVec3::new(0.169_031, -0.912_871, 0.371_675),
];
/// A body described once, in its own frame (its axis is z).
#[derive(Debug, Clone, Default)]
pub struct Prototype {
    /// The media inside; `Region::Body(k)` is the k-th.
    pub media: Vec<Medium>,
    /// All surfaces.
    pub surfaces: Vec<Surface>,
    /// Sources that every instance carries.
    pub sources: Vec<Source>,
}

fn ray(point: DVec3, look: DVec3) -> Ray {
    Ray { origin: point, direction: look.normalize() }
}

/// The first surface that is seen from a point, and the region with which it faces it.
pub(super) fn first_seen(
    body: &Prototype,
    point: DVec3,
    look: DVec3,
) -> Option<(&Surface, Region)> {
    let ray = ray(point, look);
    let (mut reach, mut found) = (Reach::AHEAD, None);
    for surface in &body.surfaces {
        if let Some(met) = surface.shape.intersect(&ray, reach, Sides::Both) {
            reach.to = met.distance;
            let faces = match met.side {
                bsdf::Side::Inner => surface.inner,
                bsdf::Side::Outer => surface.outer,
            };
            found = Some((surface, faces));
        }
    }
    found
}

impl Prototype {
    /// The same turned about its axis, counterclockwise as seen from above.
    ///
    /// # Errors
    /// Surfaces that reach to infinity.
    pub fn turned(mut self, angle_deg: f64) -> Result<Self, Error> {
        if angle_deg == 0.0 {
            return Ok(self);
        }
        let rotation = DMat3::from_rotation_z(angle_deg.to_radians());
        for surface in &mut self.surfaces {
            surface.shape = surface.shape.turned(&rotation)?;
        }
        self.sources = self.sources.into_iter().map(|source| source.turned(&rotation)).collect();
        Ok(self)
    }

    /// The same with all lengths times `factor` (above 0) about its origin. Media keep what they do
    /// per length, surfaces what they do to light, and sources their power.
    ///
    /// # Errors
    /// Surfaces that reach to infinity.
    pub fn scaled(mut self, factor: f64) -> Result<Self, Error> {
        if factor.to_bits() == 1.0_f64.to_bits() {
            return Ok(self);
        }
        for surface in &mut self.surfaces {
            surface.shape = surface.shape.scaled(factor)?;
        }
        self.sources = self.sources.into_iter().map(|source| source.scaled(factor)).collect();
        Ok(self)
    }

    /// The region in which a point (mm, in the frame of the body) lies: that of the first surface
    /// seen from there, [`Region::World`] where none is. Two of three directions decide; of a point
    /// in a surface nothing is promised.
    pub fn region_at(&self, point_mm: DVec3) -> Region {
        let seen = LOOKS
            .map(|look| first_seen(self, point_mm, look).map_or(Region::World, |(_, seen)| seen));
        if seen[1] == seen[2] { seen[1] } else { seen[0] }
    }
}

impl Shape {
    /// True if a point (mm) lies within this shape, which must be closed. Two of three directions
    /// decide; of a point in the surface nothing is promised.
    pub fn holds(&self, point_mm: DVec3) -> bool {
        let inside = |look: &&DVec3| {
            let met = self.intersect(&ray(point_mm, **look), Reach::AHEAD, Sides::Both);
            met.is_some_and(|met| met.side == bsdf::Side::Inner)
        };
        LOOKS.iter().filter(inside).count() >= 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SurfaceModel;
    use crate::shape::Cuboid;

    #[test]
    fn points_of_a_ball_about_a_box_are_in_what_holds_them() {
        let ball = Shape::sphere(0.0, 2.0).expect("a sphere");
        let half = DVec3::new(0.5, 0.6, 0.7);
        let cuboid = Shape::Cuboid(Cuboid::new(-half, half).expect("a box"));
        let glass = Region::Body(0);
        let body = Prototype {
            media: vec![crate::Medium::clear("glass", 1.5)],
            surfaces: vec![
                Surface::new("box", cuboid.clone(), Region::Opaque, glass, &SurfaceModel::Absorber),
                Surface::new("ball", ball.clone(), glass, Region::World, &SurfaceModel::Interface),
            ],
            sources: Vec::new(),
        };
        let mut rng = crate::random::stream(7, 0);
        let mut met = [0; 3];
        for _ in 0..10_000 {
            let mut along = || 5.0 * crate::random::unit(&mut rng) - 2.5;
            let point = DVec3::new(along(), along(), along());
            let (in_box, in_ball) = (point.abs().cmplt(half).all(), point.length() < 2.0);
            let expected = match (in_box, in_ball) {
                (true, _) => Region::Opaque,
                (false, true) => glass,
                (false, false) => Region::World,
            };
            met[usize::from(in_box) + usize::from(in_ball)] += 1;
            assert_eq!(body.region_at(point), expected, "{point}");
            assert_eq!(cuboid.holds(point), in_box, "{point}");
            assert_eq!(ball.holds(point), in_ball, "{point}");
        }
        assert!(met.iter().all(|count| *count > 50), "{met:?}");
    }

    /// What a point lies in scales with the body, of every shape; the body that is not scaled holds
    /// other points.
    #[test]
    fn a_scaled_body_holds_the_scaled_points() {
        use crate::shape::{Bend, Element, Meridian};
        let glass = Region::Body(0);
        let corners = vec![[0.0, 4.0], [1.5, 3.0], [1.0, 2.0], [0.0, 2.0]];
        let cone = Meridian::new(&[Element { points: corners }]).expect("a curve");
        let aside = crate::shape::Placement::at(DVec3::new(2.5, 0.3, 0.4));
        let cuboid = Shape::cuboid(DVec3::splat(-0.7), DVec3::splat(0.4)).expect("a box");
        let beside = Shape::placed(vec![cuboid.clone()], crate::shape::Closing::Closed, &aside);
        let half = Shape::arc([0.0, 1.8], [0.9, 0.9], [0.0, 0.9], Bend::Clockwise);
        let shapes = [
            Shape::revolution(&cone),
            half.expect("a cap"),
            Shape::cylinder(0.9, 0.6, 0.9).expect("a side"),
            Shape::frustum([0.9, 0.6], [0.0, 0.6]).expect("a foot"),
            Shape::sphere(-1.5, 0.7).expect("a ball"),
            beside.expect("a box"),
        ];
        let skin = |shape: Shape| {
            Surface::new("skin", shape, glass, Region::World, &SurfaceModel::Interface)
        };
        let emitter = crate::Emitter::Rectangle { half_x: 0.5, half_y: 1.0 };
        let body = Prototype {
            media: vec![crate::Medium::clear("glass", 1.5)],
            surfaces: shapes.map(skin).into(),
            sources: vec![Source::new(
                "top",
                DVec3::new(2.0, 0.0, 0.7),
                Region::World,
                emitter,
                crate::Emission::LAMBERTIAN,
            )],
        };
        let scaled = body.clone().scaled(1.7).expect("finite");
        let mut rng = crate::random::stream(10, 0);
        let mut met = [0; 2];
        for _ in 0..10_000 {
            let mut along = || 8.0 * crate::random::unit(&mut rng) - 4.0;
            let point = DVec3::new(along(), along(), along());
            assert_eq!(scaled.region_at(1.7 * point), body.region_at(point), "{point}");
            met[0] += usize::from(body.region_at(point) == glass);
            met[1] += usize::from(scaled.region_at(point) != body.region_at(point));
        }
        assert!(met.iter().all(|count| *count > 50), "{met:?}");
        let [plain, wide] = [&body, &scaled].map(|of| {
            let mut rng = crate::random::stream(9, 0);
            of.sources[0].sample(0.0, &mut rng)
        });
        assert!((1.7 * plain.origin - wide.origin).length() < 1e-12);
        assert_eq!(plain.direction, wide.direction);
    }

    /// What a point lies in turns with the body; the body that is not turned holds other points.
    #[test]
    fn a_turned_body_holds_the_turned_points() {
        let half = DVec3::new(0.5, 1.0, 0.7);
        let cuboid = Shape::Cuboid(Cuboid::new(-half, half).expect("a box"));
        let aside = crate::shape::Placement::at(DVec3::new(2.0, 0.0, 0.0));
        let beside = Shape::placed(vec![cuboid.clone()], crate::shape::Closing::Closed, &aside);
        let black = |shape: Shape| {
            Surface::new("box", shape, Region::Opaque, Region::World, &SurfaceModel::Absorber)
        };
        let (emitter, emission) =
            (crate::Emitter::Rectangle { half_x: 0.5, half_y: 1.0 }, crate::Emission::LAMBERTIAN);
        let top = Source::new("top", DVec3::new(2.0, 0.0, 0.7), Region::World, emitter, emission);
        let body = Prototype {
            surfaces: vec![black(cuboid), black(beside.expect("a box"))],
            sources: vec![top],
            ..Prototype::default()
        };
        let rotation = DMat3::from_rotation_z(30_f64.to_radians());
        let turned = body.clone().turned(30.0).expect("finite");
        let mut rng = crate::random::stream(8, 0);
        let mut others = 0;
        for _ in 0..10_000 {
            let mut along = || 6.0 * crate::random::unit(&mut rng) - 3.0;
            let point = DVec3::new(along(), along(), 0.3 * along());
            assert_eq!(turned.region_at(rotation * point), body.region_at(point), "{point}");
            others += usize::from(turned.region_at(point) != body.region_at(point));
        }
        assert!(others > 100, "{others}");
        let [plain, moved] = [&body, &turned].map(|of| {
            let mut rng = crate::random::stream(9, 0);
            of.sources[0].sample(0.0, &mut rng)
        });
        assert!((rotation * plain.origin - moved.origin).length() < 1e-12);
        let rise = |ray: &Ray| ray.direction.z;
        assert!((rise(&plain) - rise(&moved)).abs() < 1e-12);
        assert!((plain.origin - moved.origin).length() > 0.5);
    }
}
