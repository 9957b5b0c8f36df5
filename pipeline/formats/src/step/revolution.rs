// SPDX-License-Identifier: MIT OR Apache-2.0
//! Faces of a body of revolution.
//!
//! The inside lies to the right of the curve, so that the normal of a face points to its left. A
//! half runs from y = 0, x > 0 over y > 0 to x < 0; the other one from there on.

use anyhow::Result;
use glam::DVec3;

use geometry::{Curve, Meridian, Piece};

use super::{Entities, Id, Real};

/// Share of a length, of an arc's radius too, that is none.
const SAME: f64 = 1e-9;
/// Distance from the axis, mm, that is none; shorter pieces are left out.
const ON_AXIS_MM: f64 = 1e-9;

/// A circle about the axis: two half turns between two vertices, or a point of the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ring {
    vertices: [Id; 2],
    halves: Option<[Id; 2]>,
}

impl Ring {
    /// The whole turn, counter-clockwise from above or clockwise.
    pub(super) fn ways(&self, counterclockwise: bool) -> Vec<(Id, bool)> {
        let mut ways: Vec<(Id, bool)> =
            self.halves.iter().flatten().map(|half| (*half, counterclockwise)).collect();
        if !counterclockwise {
            ways.reverse();
        }
        ways
    }
}

/// The way from one ring to the next.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    start: [f64; 2],
    end: [f64; 2],
    circle: Option<Circle>,
}

/// Circle of an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Circle {
    /// (r, z), mm.
    centre: [f64; 2],
    radius: f64,
    clockwise: bool,
}

impl Stretch {
    fn from_piece(piece: &Piece) -> Self {
        let (centre, radius) = match piece.curve {
            Curve::Line => ([0.0; 2], None),
            Curve::Arc { radius_mm, centre_mm } => ([0.0, centre_mm], Some(radius_mm)),
            Curve::Bend { radius_mm, centre_mm, .. } => (centre_mm, Some(radius_mm)),
        };
        let clockwise = piece.clockwise();
        let circle = radius.map(|radius| Circle { centre, radius, clockwise });
        Self { start: piece.start, end: piece.end, circle }
    }

    /// Steps in r and z, and the length of its chord, mm.
    fn steps(&self) -> ([f64; 2], f64) {
        let step = [0, 1].map(|k| self.end[k] - self.start[k]);
        (step, step[0].hypot(step[1]))
    }

    fn is_level(&self) -> bool {
        let ([_, z], length) = self.steps();
        self.circle.is_none() && z.abs() <= SAME * length
    }
}

/// Stretches of a curve and of what closes it; neighbours on one sphere are one.
fn stretches(meridian: &Meridian) -> Vec<Stretch> {
    let mut all: Vec<Stretch> = Vec::new();
    for next in meridian.pieces.iter().map(Stretch::from_piece) {
        // Longer arcs of other circles might close.
        let is_spherical = next.circle.is_some_and(|circle| circle.centre[0].abs() <= 0.0);
        if let Some(last) = all.last_mut()
            && is_spherical
            && last.circle == next.circle
        {
            last.end = next.end;
        } else if next.steps().1 > ON_AXIS_MM {
            let start = all.last().map_or(next.start, |last| last.end);
            all.push(Stretch { start, ..next });
        }
    }
    if let Some(start) = all.last().map(|last| last.end).filter(|end| end[0] > ON_AXIS_MM) {
        all.push(Stretch { start, end: [0.0, start[1]], circle: None });
    }
    all
}

impl Entities<'_> {
    pub(super) fn ring(&mut self, [r, z]: [f64; 2]) -> Result<Ring> {
        if r <= ON_AXIS_MM {
            let vertex = self.vertex(DVec3::Z * z)?;
            return Ok(Ring { vertices: [vertex; 2], halves: None });
        }
        let [a, b] = [self.vertex(DVec3::new(r, 0.0, z))?, self.vertex(DVec3::new(-r, 0.0, z))?];
        let circle = self.circle(DVec3::Z * z, DVec3::Z, r)?;
        let halves = [self.edge([a, b], circle)?, self.edge([b, a], circle)?];
        Ok(Ring { vertices: [a, b], halves: Some(halves) })
    }

    /// The faces that a curve sweeps, and the plane that closes it.
    pub(super) fn revolution(&mut self, meridian: &Meridian) -> Result<Vec<Id>> {
        let stretches = stretches(meridian);
        let mut rings = Vec::with_capacity(stretches.len() + 1);
        for k in 0..=stretches.len() {
            let [before, after] = [k.checked_sub(1), Some(k)].map(|k| stretches.get(k?));
            let end = after.map(|next| next.start).or(before.map(|last| last.end));
            // A disc has no vertex in its middle.
            let is_needed = [before, after].into_iter().flatten().any(|s| !s.is_level());
            let end = end.filter(|end| is_needed || end[0] > ON_AXIS_MM);
            rings.push(end.map(|end| self.ring(end)).transpose()?);
        }
        let mut faces = Vec::new();
        for (stretch, ends) in stretches.iter().zip(rings.windows(2)) {
            match ends {
                [Some(start), Some(end)] if !stretch.is_level() => {
                    faces.extend(self.halves(stretch, [*start, *end])?);
                }
                _ => faces.push(self.level(stretch, [ends[0], ends[1]])?),
            }
        }
        Ok(faces)
    }

    /// A disc or an annulus.
    fn level(&mut self, stretch: &Stretch, [start, end]: [Option<Ring>; 2]) -> Result<Id> {
        let outwards = stretch.end[0] > stretch.start[0];
        let mut bounds = Vec::new();
        for (ring, forward) in [(end, true), (start, false)] {
            if let Some(ring) = ring.filter(|ring| ring.halves.is_some()) {
                bounds.push(self.bound(&ring.ways(forward), forward == outwards)?);
            }
        }
        let plane = self.plane(DVec3::Z * stretch.start[1], DVec3::Z, DVec3::X)?;
        self.face(&bounds, plane, outwards)
    }

    /// The two half turns of any other stretch.
    fn halves(&mut self, stretch: &Stretch, [start, end]: [Ring; 2]) -> Result<[Id; 2]> {
        let curves = [self.curve(stretch, 1.0)?, self.curve(stretch, -1.0)?];
        let mut meridian = |k: usize| self.edge([start.vertices[k], end.vertices[k]], curves[k]);
        let meridians = [meridian(0)?, meridian(1)?];
        let (surface, same) = self.surface(stretch, curves[0])?;
        let mut half = |k: usize| {
            let mut ways = vec![(meridians[k], true)];
            ways.extend(end.halves.map(|halves| (halves[k], true)));
            ways.push((meridians[1 - k], false));
            ways.extend(start.halves.map(|halves| (halves[k], false)));
            let bound = self.bound(&ways, true)?;
            self.face(&[bound], surface, same)
        };
        Ok([half(0)?, half(1)?])
    }

    /// The line or the circle of a stretch on the side x > 0 (1) or x < 0 (-1).
    fn curve(&mut self, stretch: &Stretch, side: f64) -> Result<Id> {
        let at = |[r, z]: [f64; 2]| DVec3::new(side * r, 0.0, z);
        match stretch.circle {
            None => self.line([stretch.start, stretch.end].map(at)),
            Some(Circle { centre, radius, clockwise }) => {
                // From z to x it turns about y.
                let normal = DVec3::Y * if clockwise { side } else { -side };
                self.circle(at(centre), normal, radius)
            }
        }
    }

    /// The surface that a stretch sweeps, `curve` on its side x > 0, and true where the normal of
    /// the surface points to the left of the stretch.
    fn surface(&mut self, stretch: &Stretch, curve: Id) -> Result<(Id, bool)> {
        let Stretch { start, end, circle } = *stretch;
        let Some(Circle { centre, radius, clockwise }) = circle else {
            let ([r, z], length) = stretch.steps();
            if r.abs() <= SAME * length {
                let frame = self.frame(DVec3::Z * start[1], DVec3::Z, DVec3::X)?;
                let cylinder = format_args!("CYLINDRICAL_SURFACE('',{frame},{})", Real(start[0]));
                return Ok((self.add(&cylinder)?, z < 0.0));
            }
            // The frame looks to where the cone gets wider.
            let wide = if r > 0.0 { end } else { start };
            let up = DVec3::Z * if r * z > 0.0 { 1.0 } else { -1.0 };
            let frame = self.frame(DVec3::Z * wide[1], up, DVec3::X)?;
            let half_angle = Real((r / z).abs().atan());
            let cone = format_args!("CONICAL_SURFACE('',{frame},{},{half_angle})", Real(wide[0]));
            return Ok((self.add(&cone)?, z < 0.0));
        };
        let [from_axis, z] = centre;
        let mut frame = || self.frame(DVec3::Z * z, DVec3::Z, DVec3::X);
        if from_axis.abs() <= SAME * radius {
            let frame = frame()?;
            let sphere = format_args!("SPHERICAL_SURFACE('',{frame},{})", Real(radius));
            return Ok((self.add(&sphere)?, clockwise));
        }
        if from_axis > (1.0 + SAME) * radius {
            let frame = frame()?;
            let [from_axis, radius] = [from_axis, radius].map(Real);
            let torus = format_args!("TOROIDAL_SURFACE('',{frame},{from_axis},{radius})");
            return Ok((self.add(&torus)?, clockwise));
        }
        // The whole circle would cross the axis.
        let [from, to] = [start, end].map(|[r, z]| DVec3::new(r, 0.0, z));
        let [from, to] = [self.point(from)?, self.point(to)?];
        let arc =
            self.add(&format_args!("TRIMMED_CURVE('',{curve},({from}),({to}),.T.,.CARTESIAN.)"))?;
        let (origin, along) = (self.point(DVec3::ZERO)?, self.direction(DVec3::Z)?);
        let axis = self.add(&format_args!("AXIS1_PLACEMENT('',{origin},{along})"))?;
        Ok((self.add(&format_args!("SURFACE_OF_REVOLUTION('',{arc},{axis})"))?, false))
    }
}
