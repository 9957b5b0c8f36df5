// SPDX-License-Identifier: MIT OR Apache-2.0
//! Separating planes between bodies that are not round about their axes.
//!
//! [`Solid::apart_from`] returns true only where it is certain: a plane separates every surface of
//! one skin from every surface of the other (by their convex hulls), and points of every surface
//! lie outside of the other body. Hollow or hooked bodies may be taken to overlap where they do
//! not.
//!
//! The distance of the hulls gives the plane: the point of their Minkowski difference nearest to
//! the origin is its normal \[Gilbert, Johnson, Keerthi 1988\], and the point farthest along that
//! normal is the proof.
//!
//! \[Gilbert, Johnson, Keerthi 1988\] E. G. Gilbert, D. W. Johnson, S. S. Keerthi, *A fast
//! procedure for computing the distance between complex objects in three-dimensional space*, IEEE
//! J. Robot. Autom. 4(2), 193.

use glam::{DMat3, DVec3};

use crate::ray::Ray;
use crate::scene::compiled::Body;
use crate::scene::prototype::LOOKS;
use crate::shape::{Bounds, Hull, Reach, Shape};
use crate::surface::Region;

/// Overlap relative to the size of both bodies that rounding may give to touching ones.
const TOUCH: f64 = 1e-9;
/// Most iterations.
const STEPS: usize = 64;
/// Depth of test points within a surface, relative to its size.
const DEEP: f64 = 1e-6;

/// A surface of the skin of a body.
struct SurfaceHulls {
    hulls: Vec<Hull>,
    bounds: Bounds,
}

/// The skin of a body as convex hulls.
pub(super) struct Solid<'a> {
    body: &'a Body,
    surfaces: Vec<SurfaceHulls>,
}

impl<'a> Solid<'a> {
    /// The hulls of a body with a finite skin.
    pub fn new(body: &'a Body) -> Option<Self> {
        let skin = body.skin();
        let hulls = |shape: &Shape| {
            let bounds = shape.bounds();
            bounds.is_finite().then(|| SurfaceHulls { hulls: shape.hulls(), bounds })
        };
        let surfaces: Option<Vec<SurfaceHulls>> =
            skin.map(|surface| hulls(&surface.shape)).collect();
        surfaces.map(|surfaces| Self { body, surfaces })
    }

    /// True if it certainly does not overlap another body at `at` from it.
    pub fn apart_from(&self, other: &Self, at: DVec3) -> bool {
        let uncut = self.surfaces.iter().all(|a| {
            other.surfaces.iter().all(|b| {
                !b.bounds.moved(at).overlaps(&a.bounds)
                    || apart(&a.hulls, &b.hulls, at)
                    || a.hulls.iter().all(|one| {
                        let one = std::slice::from_ref(one);
                        b.hulls.iter().map(std::slice::from_ref).all(|two| apart(one, two, at))
                    })
            })
        });
        uncut && other.lies_outside(self.body, at) && self.lies_outside(other.body, -at)
    }

    /// True if points of all its surfaces lie outside of a body; it stands at `at` from that.
    fn lies_outside(&self, body: &Body, at: DVec3) -> bool {
        self.surfaces.iter().all(|surface| {
            let middle = surface.bounds.middle();
            let mut towards = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
            towards.all(|direction| {
                let far = farthest(&surface.hulls, direction);
                let point = far + (middle - far) * DEEP;
                outside(body, point + at)
            })
        })
    }
}

/// True if a point lies outside of a body: two of three directions decide.
fn outside(body: &Body, point: DVec3) -> bool {
    let free = |look: &&DVec3| {
        let ray = Ray { origin: point, direction: look.normalize() };
        let seen = body.first_seen(&ray, Reach::AHEAD);
        seen.is_none_or(|met| met.faces == Region::World)
    };
    LOOKS.iter().filter(free).count() >= 2
}

/// Support point of several hulls: the farthest along a direction.
fn farthest(hulls: &[Hull], direction: DVec3) -> DVec3 {
    let points = hulls.iter().map(|hull| hull.farthest(direction));
    let farthest = points.max_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction)));
    farthest.unwrap_or_default()
}

/// True if a plane separates the convex hull of all `a` from that of all `b`, which stand at `at`
/// from them.
fn apart(a: &[Hull], b: &[Hull], at: DVec3) -> bool {
    let support = |d: DVec3| farthest(a, d) - farthest(b, -d) - at;
    let widths = DVec3::AXES.map(|axis| support(axis).dot(axis) + support(-axis).dot(-axis));
    let size = widths.into_iter().fold(0.0, f64::max);
    // Their own plane separates two coplanar sheets even where they overlap: touching counts only
    // where one of them has a thickness.
    let thick = |hulls: &[Hull], d: DVec3| {
        (farthest(hulls, d) - farthest(hulls, -d)).dot(d) > 2.0 * TOUCH * size
    };
    let divides = |d: DVec3| {
        let over = support(d).dot(d);
        over < -TOUCH * size || (over <= TOUCH * size && (thick(a, d) || thick(b, d)))
    };

    // Directions that are exact for boxes and rods, which may touch.
    let axes = |hulls: &[Hull]| hulls.first().map(Hull::axes).unwrap_or_default();
    let (of_a, of_b) = (axes(a), axes(b));
    let crossed = of_a.into_iter().flat_map(|one| of_b.into_iter().map(move |two| one.cross(two)));
    let aside =
        of_a.into_iter().chain(of_b).map(|axis| at - axis * (at.dot(axis) / axis.length_squared()));
    let mut likely = of_a.into_iter().chain(of_b).chain(crossed).chain(aside);
    if likely.any(|d| {
        let unit = d.normalize_or_zero();
        unit != DVec3::ZERO && (divides(unit) || divides(-unit))
    }) {
        return true;
    }

    // The nearest point v of the difference to the origin; -v points away from all of it where it
    // does not hold the origin.
    let mut simplex = vec![support(DVec3::X)];
    for _ in 0..STEPS {
        let nearest = nearest(&mut simplex);
        let length = nearest.length();
        if length <= 1e-3 * TOUCH * size {
            return false;
        }
        let d = -nearest / length;
        let next = support(d);
        if divides(d) {
            return true;
        }
        if simplex.len() > 3 || simplex.contains(&next) {
            return false;
        }
        simplex.push(next);
    }
    false
}

/// The point of a simplex nearest to the origin; only the corners that span it are kept.
fn nearest(simplex: &mut Vec<DVec3>) -> DVec3 {
    let mut best: Option<(DVec3, u32)> = None;
    for chosen in 1..1u32 << simplex.len() {
        let points: Vec<DVec3> = simplex
            .iter()
            .enumerate()
            .filter(|(k, _)| chosen >> k & 1 == 1)
            .map(|(_, p)| *p)
            .collect();
        if let Some(point) = nearest_within(&points)
            && best.is_none_or(|(known, _)| point.length_squared() < known.length_squared())
        {
            best = Some((point, chosen));
        }
    }
    let (point, chosen) = best.unwrap_or((simplex[0], 1));
    let mut k = 0;
    simplex.retain(|_| {
        k += 1;
        chosen >> (k - 1) & 1 == 1
    });
    point
}

/// The point nearest to the origin of the flat through all corners, if it lies in the simplex.
fn nearest_within(points: &[DVec3]) -> Option<DVec3> {
    let first = points[0];
    // Barycentric coordinates of that point from the normal equations.
    let mut ways = [DVec3::ZERO; 3];
    let mut gram = DMat3::IDENTITY;
    let mut right = DVec3::ZERO;
    for (k, point) in points[1..].iter().enumerate() {
        ways[k] = *point - first;
        right[k] = -first.dot(ways[k]);
    }
    for k in 0..points.len() - 1 {
        for l in 0..points.len() - 1 {
            gram.col_mut(k)[l] = ways[k].dot(ways[l]);
        }
    }
    let shares = gram.inverse() * right;
    let between = shares.is_finite() && shares.min_element() >= 0.0 && shares.element_sum() <= 1.0;
    between.then(|| first + ways[0] * shares.x + ways[1] * shares.y + ways[2] * shares.z)
}
