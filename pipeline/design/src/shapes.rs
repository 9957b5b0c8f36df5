// SPDX-License-Identifier: MIT OR Apache-2.0
//! A generating curve as the tracer's shapes, turned about the axis: exact, nothing is tessellated.

use tracer::Shape;
use tracer::shape::{Bend, Element, Meridian as TracerMeridian};

use geometry::{Curve, Meridian, Piece, Role};

/// One shape for each stretch of straight pieces, each stretch of arcs of one sphere, and each
/// other arc, in order, with the roles of its parts.
///
/// # Errors
/// Pieces that the tracer refuses.
pub fn runs(pieces: &[&Piece]) -> Result<Vec<(Shape, Vec<Role>)>, tracer::Error> {
    pieces
        .chunk_by(|a, b| a.curve == b.curve && !matches!(a.curve, Curve::Bend { .. }))
        .map(|run| match run[0].curve {
            Curve::Line => relief(run),
            Curve::Bend { centre_mm, clockwise, .. } => {
                let bend = if clockwise { Bend::Clockwise } else { Bend::Counterclockwise };
                let shape = Shape::arc(run[0].start, run[0].end, centre_mm, bend)?;
                Ok((shape, vec![run[0].role]))
            }
            Curve::Arc { radius_mm, centre_mm } => {
                let mut heights = vec![run[0].start[1]];
                heights.extend(run.iter().map(|p| p.end[1]));
                let shape = Shape::sphere_zones(centre_mm, radius_mm, &heights)?;
                Ok((shape, run.iter().map(|p| p.role).collect()))
            }
        })
        .collect()
}

/// The shapes of a whole curve.
///
/// # Errors
/// Pieces that the tracer refuses.
pub fn of(meridian: &Meridian) -> Result<Vec<Shape>, tracer::Error> {
    let pieces: Vec<&Piece> = meridian.pieces.iter().collect();
    let runs = runs(&pieces)?.into_iter();
    Ok(runs.map(|(shape, _)| shape).collect())
}

/// The body of revolution of a run of straight pieces, and the roles of its elements.
fn relief(run: &[&Piece]) -> Result<(Shape, Vec<Role>), tracer::Error> {
    let mut elements = Vec::new();
    let mut roles = Vec::new();
    for element in run.chunk_by(|a, b| a.role == b.role) {
        let mut points = vec![element[0].start];
        points.extend(element.iter().map(|p| p.end));
        elements.push(Element { points });
        roles.push(element[0].role);
    }
    Ok((Shape::revolution(&TracerMeridian::new(&elements)?), roles))
}
