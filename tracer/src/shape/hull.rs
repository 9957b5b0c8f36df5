// SPDX-License-Identifier: MIT OR Apache-2.0
//! Convex hulls of shapes, given by their support function: the point farthest along a direction.

use glam::{DMat3, DVec3};

use super::{Shape, Torus};

/// A convex set in its own frame.
#[derive(Debug, Clone)]
enum Form {
    /// The convex hull of points.
    Corners(Vec<DVec3>),
    /// The convex hull of circles about the z axis, given by radius and height.
    Circles(Vec<[f64; 2]>),
    /// A ball about the origin between two heights.
    Ball {
        radius: f64,
        heights: [f64; 2],
    },
    Arc(Torus),
}

/// A convex set, rotated, scaled and moved.
#[derive(Debug, Clone)]
pub(crate) struct Hull {
    form: Form,
    matrix: DMat3,
    origin: DVec3,
}

impl Hull {
    fn new(form: Form) -> Self {
        Self { form, matrix: DMat3::IDENTITY, origin: DVec3::ZERO }
    }

    fn corners(edges: impl IntoIterator<Item = [DVec3; 2]>) -> Self {
        Self::new(Form::Corners(edges.into_iter().flatten().collect()))
    }

    /// The same in a frame in which its point p is `matrix` p + `origin`.
    pub fn within(mut self, matrix: DMat3, origin: DVec3) -> Self {
        self.matrix = matrix * self.matrix;
        self.origin = matrix * self.origin + origin;
        self
    }

    /// The point farthest along a direction of any length above 0.
    pub fn farthest(&self, direction: DVec3) -> DVec3 {
        let d = self.matrix.transpose() * direction;
        let across = d.truncate().length();
        // A point of the meridian, on the side of the axis that lies farther.
        let turned = |[r, z]: [f64; 2]| {
            let aside =
                if across > 0.0 { d.truncate() * (r / across) } else { glam::DVec2::new(r, 0.0) };
            aside.extend(z)
        };
        let of_meridian = |points: &mut dyn Iterator<Item = [f64; 2]>| {
            let measure = |[r, z]: [f64; 2]| r * across + z * d.z;
            let farthest = points.max_by(|a, b| measure(*a).total_cmp(&measure(*b)));
            turned(farthest.unwrap_or_default())
        };
        let local = match &self.form {
            Form::Corners(corners) => {
                let farthest = corners.iter().max_by(|a, b| a.dot(d).total_cmp(&b.dot(d)));
                farthest.copied().unwrap_or_default()
            }
            Form::Circles(circles) => of_meridian(&mut circles.iter().copied()),
            Form::Ball { radius, heights } => {
                let z = (radius * d.z / d.length()).clamp(heights[0], heights[1]);
                turned([(radius * radius - z * z).max(0.0).sqrt(), z])
            }
            Form::Arc(arc) => of_meridian(&mut arc.farthest([across, d.z]).into_iter()),
        };
        self.matrix * local + self.origin
    }

    /// Axes, of any length.
    pub fn axes(&self) -> [DVec3; 3] {
        [self.matrix.x_axis, self.matrix.y_axis, self.matrix.z_axis]
    }
}

impl Shape {
    /// Convex hulls that together hold the surface of a finite shape.
    pub(crate) fn hulls(&self) -> Vec<Hull> {
        let circles = |ends: [[f64; 2]; 2]| Hull::new(Form::Circles(ends.to_vec()));
        match self {
            Self::Plane(plane) => vec![Hull::corners(plane.edges())],
            Self::Frustum(frustum) => vec![circles(frustum.ends())],
            Self::Cuboid(cuboid) => vec![Hull::corners(cuboid.edges())],
            Self::Mesh(mesh) => vec![Hull::corners(mesh.edges())],
            Self::Torus(arc) => vec![Hull::new(Form::Arc(**arc))],
            Self::Revolution(all) => all.frusta().iter().map(|e| circles(e.ends())).collect(),
            Self::Sphere(sphere) => {
                let (centre, radius, heights) = sphere.ball();
                let ball = Form::Ball {
                    radius,
                    heights: heights.map(|z| (z - centre).clamp(-radius, radius)),
                };
                vec![Hull::new(ball).within(DMat3::IDENTITY, DVec3::Z * centre)]
            }
            Self::Placed(placed) => placed.hulls(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;
    use crate::shape::{Bend, Closing, Placement, Reach, Sides};

    #[test]
    fn hulls_reach_as_far_as_their_shapes_and_no_farther() {
        let rod = vec![
            Shape::annulus(1.0, 0.0, 0.5).expect("a disc"),
            Shape::cylinder(0.5, -1.0, 1.0).expect("a cylinder"),
        ];
        let shapes = [
            Shape::cuboid(DVec3::new(-0.3, 0.1, 0.2), DVec3::ONE).expect("a box"),
            Shape::frustum([0.3, 1.0], [1.2, -0.5]).expect("a cone"),
            Shape::sphere_zones(-0.2, 1.5, &[1.0, 0.3]).expect("a zone"),
            Shape::sphere(-0.2, 1.5).expect("a ball"),
            Shape::arc([0.2, 1.0], [1.4, 0.0], [0.2, -0.22], Bend::Clockwise).expect("an arc"),
            Shape::placed(
                rod,
                Closing::Open,
                &Placement { inset: 0.1, ..Placement::at(DVec3::new(0.3, 0.2, 0.1)) }
                    .along(DVec3::new(1.0, 2.0, 2.0))
                    .expect("an axis"),
            )
            .expect("a rod"),
        ];
        let mut rng = crate::random::stream(31, 0);
        for (number, shape) in shapes.iter().enumerate() {
            let hulls = shape.hulls();
            let mut points = Vec::new();
            for _ in 0..40_000 {
                let direction = crate::random::isotropic(&mut rng);
                let through = crate::random::isotropic(&mut rng) * 1.3;
                let ray = Ray { origin: through - direction * 10.0, direction };
                let mut reach = Reach::AHEAD;
                while let Some(hit) = shape.intersect(&ray, reach, Sides::Both) {
                    points.push(ray.at(hit.distance));
                    reach.from = hit.distance + 1e-9;
                }
            }
            assert!(points.len() > 2000, "{number}");
            for _ in 0..200 {
                let d = crate::random::isotropic(&mut rng);
                let far = hulls.iter().map(|h| h.farthest(d).dot(d)).fold(f64::MIN, f64::max);
                let farthest = points.iter().map(|p| p.dot(d)).fold(f64::MIN, f64::max);
                assert!(
                    farthest <= far + 1e-9 && farthest > far - 0.1,
                    "{number}: {farthest} {far}"
                );
            }
        }
    }
}
