// SPDX-License-Identifier: MIT OR Apache-2.0
//! Gaps too thin to be one: light passes less than a tenth of a micrometre of air as if it were none.
//!
//! Bodies that touch keep a gap of air, as of bodies laid loosely on each other; those between that
//! and [`LEAST_MM`] are refused.

use anyhow::Result;
use tracer::Prototype;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::{Bounds, Closing, Placement};
use tracer::{Region, Shape};

use design::ConfigError;
use design::Design;
use design::resolved::array::Pose;
use design::resolved::solids::{self, CheckedSolid, LEAST_MM};
use design::schema::solids::Per;
use metrics::digits::shortest;

use super::touching::{Displacement, beside, gap, narrow_gaps};
use super::{Bottom, Placing, nested, nesting, refused};

/// Rounding of places, as a share of the sizes of both bodies.
const ROUNDING: f64 = 4e-9;

/// Refuses thin gaps between the solids of `design`, one of which light enters, and between them and
/// the packages, the walls and the bottom; `package` has no solids yet.
///
/// # Errors
/// The solid that stands so near to something; solids that do not fit.
pub fn check_gaps(design: &Design, package: &Prototype, bottom: &Bottom) -> Result<()> {
    let placing = Placing::new(design, bottom);
    for per in [Per::Package, Per::Array] {
        let own: Vec<&CheckedSolid> = design.solids.iter().filter(|s| s.per() == per).collect();
        if own.is_empty() {
            continue;
        }
        let body = if per == Per::Package { package.clone() } else { Prototype::default() };
        let regions = solids::regions(&design.solids, per, design.dome.is_some());
        let (objects, nest) = nested(design, &own, &regions, &body)?;
        let joined = Displacement::new(&placing, &own, &objects, &nest)?;
        let least = least_scale(design, per);
        for gap in narrow_gaps(&own, &objects, &nest, &joined, &body, LEAST_MM / least) {
            let [first, second] = &gap.names;
            if let Some(solid) = own.iter().find(|solid| solid.name() == second) {
                refuse(design, solid, &format!("{first:?}"), Some(least * gap.width_mm))?;
            }
        }
    }
    for solid in &design.solids {
        let shape = solid.form.shape(0.0)?;
        beside_housing(design, solid, &shape)?;
        beside_sheets(design, solid, &shape)?;
        beside_package(design, solid, &shape, package)?;
    }
    Ok(())
}

/// The least size of solids over the stated one: gaps in small packages are thinner than stated.
fn least_scale(design: &Design, per: Per) -> f64 {
    match per {
        Per::Package => design.array.scale_range()[0],
        Per::Array => 1.0,
    }
}

/// Refuses a solid at `width_mm` from something, if that is neither touching nor a gap; lengths as in
/// the smallest package.
fn refuse(
    design: &Design,
    solid: &CheckedSolid,
    from: &str,
    width_mm: Option<f64>,
) -> Result<(), ConfigError> {
    let size = solid.form.shape(0.0).map_or(0.0, |shape| shape.bounds().farthest());
    let size = least_scale(design, solid.per()) * size;
    let Some(width) = width_mm.filter(|width| (ROUNDING * size..LEAST_MM).contains(width)) else {
        return Ok(());
    };
    let (key, got) = solid.place();
    let width = format!("{width:.1e}").parse().unwrap_or(width);
    let expected = format!(
        "0 or at least {} mm between {:?} and {from}, not {} mm: light passes a thinner gap as if it \
         were none; let one reach into the other with `optical_contact`, or make one body of both",
        shortest(LEAST_MM),
        solid.name(),
        shortest(width)
    );
    Err(refused(design, key, got, expected))
}

/// Judges a solid that light enters beside the walls and above the bottom.
fn beside_housing(design: &Design, solid: &CheckedSolid, shape: &Shape) -> Result<()> {
    if solid.medium.is_none() {
        return Ok(());
    }
    let above_mm = least_scale(design, solid.per()) * shape.bounds().low.z;
    refuse(design, solid, "the bottom", Some(above_mm))?;
    let half = design.housing_half_mm().filter(|_| solid.form.upright_box().is_some());
    let axes = match solid.per() {
        Per::Array => vec![[0.0; 2]],
        Per::Package => design.array.axes_mm(),
    };
    for (package, at) in axes.into_iter().enumerate() {
        let Bounds { low, high } = posed_in(design, solid, package, shape)?.bounds();
        for (axis, half) in half.into_iter().flatten().enumerate() {
            for beyond in [half - high[axis] - at[axis], half + low[axis] + at[axis]] {
                refuse(design, solid, "the walls of the housing", Some(beyond))?;
            }
        }
    }
    Ok(())
}

/// The shape of a solid, turned and scaled as its package is.
fn posed_in(
    design: &Design,
    solid: &CheckedSolid,
    package: usize,
    shape: &Shape,
) -> Result<Shape, tracer::Error> {
    let Pose { turn_deg, scale } = design.array.pose(package);
    match solid.per() {
        Per::Package => solid.form.turned(turn_deg).shape(0.0)?.scaled(scale),
        Per::Array => Ok(shape.clone()),
    }
}

/// Judges a solid that light enters beside sheets of as many copies.
fn beside_sheets(design: &Design, solid: &CheckedSolid, shape: &Shape) -> Result<()> {
    let is_sheet = |other: &&CheckedSolid| {
        other.stated.kind.is_sheet() && other.per() == solid.per() && solid.medium.is_some()
    };
    let least = least_scale(design, solid.per());
    for sheet in design.solids.iter().filter(is_sheet) {
        let width = gap(&sheet.form.shape(0.0)?, shape, LEAST_MM / least);
        refuse(design, sheet, &format!("{:?}", solid.name()), width.map(|width| least * width))?;
    }
    Ok(())
}

/// Judges a solid of the array beside the packages near it, and one of a package beside the dome.
fn beside_package(
    design: &Design,
    solid: &CheckedSolid,
    shape: &Shape,
    package: &Prototype,
) -> Result<()> {
    let moved = |shape: &Shape, at: DVec3| {
        let closing = if shape.closed() { Closing::Closed } else { Closing::Open };
        Shape::placed(vec![shape.clone()], closing, &Placement::at(at))
    };
    let is_array = solid.per() == Per::Array;
    let axes = if is_array { design.array.axes_mm() } else { vec![[0.0; 2]] };
    // What light enters on neither side has no gap that counts.
    let skins = package.surfaces.iter().filter(|surface| {
        surface.outer == Region::World
            && surface.shape.bounds().is_finite()
            && (is_array || !nesting::is_box(surface))
            && (solid.medium.is_some() || surface.inner != Region::Opaque)
    });
    let mut bodies: Vec<(&str, Shape)> =
        skins.map(|surface| (surface.name(), surface.shape.clone())).collect();
    for other in design.solids.iter().filter(|other| is_array && other.per() == Per::Package) {
        if other.medium.is_some() || solid.medium.is_some() {
            bodies.push((other.name(), other.form.shape(0.0)?));
        }
    }
    let Bounds { low, high } = shape.bounds();
    let least = least_scale(design, solid.per());
    let reach_mm = LEAST_MM / least;
    let near = shape.bounds().padded(reach_mm);
    let is_upright = solid.form.upright_box().is_some();
    for (name, body) in &bodies {
        // An upright box is the same to all that its outline holds: one of them tells.
        let mut is_told = false;
        for (package, [x, y]) in axes.iter().enumerate() {
            let at = DVec3::new(*x, *y, 0.0);
            let Pose { turn_deg, scale } = design.array.pose(package);
            let is_posed = is_array && (turn_deg != 0.0 || design.array.is_scaled());
            let rotation = DMat3::from_rotation_z(turn_deg.to_radians());
            let posed = is_posed.then(|| body.turned(&rotation)?.scaled(scale)).transpose()?;
            let body = posed.as_ref().unwrap_or(body);
            let bounds = body.bounds().moved(at);
            let wide = bounds.padded(reach_mm);
            let is_held = (0..2).all(|k| low[k] <= wide.low[k] && wide.high[k] <= high[k]);
            let is_like_others = is_upright && is_held;
            if !near.overlaps(&bounds) || is_like_others && is_told {
                continue;
            }
            is_told |= is_like_others;
            let body = if is_array { moved(body, at)? } else { body.clone() };
            let width = beside(&body, shape, reach_mm).map(|width| least * width);
            refuse(design, solid, &format!("{name:?}"), width)?;
        }
    }
    Ok(())
}
