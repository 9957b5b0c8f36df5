// SPDX-License-Identifier: MIT OR Apache-2.0
//! Optical contact with the bottom: the mirror or the floor as the lower face of a solid.
//!
//! A plate at z = 0 with the optics of the bottom closes the medium of the solid, as it does below
//! a dome. The footprint of the solid itself is sunk below the plate, so that its walls leave no
//! gap. Where the footprint covers several parts of the bottom, each has a plate, the inner ones
//! above.

use anyhow::Result;
use tracer::glam::{DMat3, DVec2, DVec3};
use tracer::shape::{Closing, Extent, Placement, Plane};
use tracer::{Region, Shape, Surface, SurfaceModel};

use design::resolved::footprint::Footprint;

/// Rounding of positions, as a share of the lengths that are compared.
const ROUNDING: f64 = 1e-9;

/// A part of the bottom, between the rectangle of the part before it and its own.
#[derive(Debug, Clone)]
pub struct BottomPart {
    /// Ledger name.
    pub name: &'static str,
    /// Half lengths of its rectangle about the origin of the array, mm; `None` for all the rest.
    pub half_mm: Option<[f64; 2]>,
    /// Surface that light meets there.
    pub optics: SurfaceModel,
}

/// Base that solids stand on.
#[derive(Debug, Clone)]
pub struct Bottom {
    /// Inside the domes.
    pub in_dome: BottomPart,
    /// Outside of them, from the middle outwards; the last part has no end.
    pub outside: Vec<BottomPart>,
}

/// Share of a part of the bottom that a footprint covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Coverage {
    /// All of the footprint that parts before have left.
    Whole,
    /// A rectangle, from its lowest to its highest corner.
    Rectangle(DVec2, DVec2),
}

/// Numbers of parts, each with its coverage.
pub(super) type Covered = Vec<(usize, Coverage)>;

/// The parts of the bottom that a footprint covers when it is moved by `offset`, innermost first;
/// `None` where a border between two parts cuts it in another way than along its sides.
pub(super) fn covered(
    footprint: &Footprint,
    outside: &[BottomPart],
    offset: DVec2,
) -> Option<Covered> {
    let [centre, half] = footprint.bounding_box();
    let [low, high] = [centre - half, centre + half];
    let slack = ROUNDING * (half.max_element() + (centre + offset).abs().max_element());
    let mut covered = Covered::new();
    for (number, part) in outside.iter().enumerate() {
        let Some(limit) = part.half_mm else {
            covered.push((number, Coverage::Whole));
            break;
        };
        let limit = DVec2::from_array(limit);
        let [from, to] = [-limit - offset, limit - offset];
        if low.cmpge(from - slack).all() && high.cmple(to + slack).all() {
            covered.push((number, Coverage::Whole));
            break;
        }
        let [from_shared, to_shared] = [low.max(from), high.min(to)];
        if !(to_shared - from_shared).cmpgt(DVec2::splat(slack)).all() {
            continue;
        }
        if !footprint.meets(from, to) {
            continue;
        }
        let corners = [from, to, DVec2::new(from.x, to.y), DVec2::new(to.x, from.y)];
        let corner_within = |corner: &DVec2| footprint.holds(*corner);
        if !footprint.is_axis_aligned() && !corners.iter().all(corner_within) {
            return None;
        }
        covered.push((number, Coverage::Rectangle(from_shared, to_shared)));
    }
    Some(covered)
}

/// Plates below a footprint: those of `covered`, each lower than the one before by `step_mm`,
/// between opaque ground and `medium`.
///
/// # Errors
/// Never for a footprint of a checked design.
pub(super) fn plates(
    footprint: &Footprint,
    covered: &[(&BottomPart, Coverage)],
    medium: Region,
    step_mm: f64,
) -> Result<Vec<Surface>> {
    let mut plates = Vec::new();
    for (number, (part, coverage)) in covered.iter().enumerate() {
        let z = -step_mm * number as f64;
        let shapes = match coverage {
            Coverage::Whole => whole(footprint, z)?,
            Coverage::Rectangle(low, high) => {
                let half = 0.5 * (*high - *low);
                vec![rectangle((0.5 * (*low + *high)).extend(z), half)?]
            }
        };
        let surface = |shape| Surface::new(part.name, shape, Region::Opaque, medium, &part.optics);
        plates.extend(shapes.into_iter().map(surface));
    }
    Ok(plates)
}

/// A level rectangle along x and y.
fn rectangle(middle: DVec3, half: DVec2) -> Result<Shape, tracer::Error> {
    let extent = Extent::Rectangle { half_u: half.x, half_v: half.y };
    Plane::new(middle, DVec3::Z, extent).map(Shape::Plane)
}

/// The footprint itself at height `z`.
fn whole(footprint: &Footprint, z: f64) -> Result<Vec<Shape>, tracer::Error> {
    match footprint {
        Footprint::Rectangle(r) => {
            let plane = rectangle(DVec3::ZERO, r.half)?;
            let [along, across] = [r.along, r.across()].map(|side| side.extend(0.0));
            let placement = Placement {
                rotation: DMat3::from_cols(along, across, DVec3::Z),
                ..Placement::at(r.centre.extend(z))
            };
            Ok(vec![Shape::placed(vec![plane], Closing::Open, &placement)?])
        }
        Footprint::Rings { centre, rings } => {
            let ring = |[inner, outer]: &[f64; 2]| {
                let ring = Shape::annulus(0.0, *inner, *outer)?;
                let placement = Placement::at(centre.extend(z));
                Shape::placed(vec![ring], Closing::Open, &placement)
            };
            rings.iter().map(ring).collect()
        }
    }
}
