// SPDX-License-Identifier: MIT OR Apache-2.0
//! Compiles a scene for batched tracing: recognises the package and collects its numbers.

use super::staircase::StaircaseTable;
use bsdf::Side;
use bsdf::order_table::{OrderTable, OrderTableBatch};

use super::kernels::PackageGeometry;
use super::lanes::{FlatCode, Mode};
use super::orders;
use super::strips::{self, Strips};
use super::{BatchTracer, Clearance, Dome, Exit, LeavesPackage, Primitive, Zones};
use crate::scene::{CompiledSurface, Location, Scene};
use crate::shape::{Bounds, Frustum, Shape, Shell};
use crate::surface::{Region, SurfaceModel};

impl<'a> Primitive<'a> {
    fn new(surface: &'a CompiledSurface, number: u32, line: [f64; 3]) -> Self {
        let patch = &surface.patches[surface.shape.patch(number) as usize];
        let table = orders::table(&patch.optics);
        let (mode, reflectance) = match patch.optics {
            SurfaceModel::Interface => (Mode::INTERFACE, 1.0),
            SurfaceModel::Mirror { reflectance } => (Mode::MIRROR, reflectance),
            _ if table.is_some() => (Mode::ORDERS, 1.0),
            _ => (Mode::OTHER, 1.0),
        };
        Self { surface, patch, number, mode, reflectance, table, line }
    }

    /// Samples its table by itself, without the batch of tables.
    fn sample_separately(&mut self) {
        if self.table.take().is_some() {
            self.mode = Mode::OTHER;
        }
    }
}

/// The surfaces of a package.
struct PackageSurfaces<'a> {
    /// From the axis outwards.
    dome: Vec<&'a CompiledSurface>,
    bottom: &'a CompiledSurface,
    side: Option<&'a CompiledSurface>,
    solid: Option<&'a CompiledSurface>,
}

impl<'a> PackageSurfaces<'a> {
    /// Sorts the surfaces of a body; `None` for other bodies.
    fn new(surfaces: &'a [CompiledSurface]) -> Option<Self> {
        const SKIN: [Region; 2] = [Region::Body(0), Region::World];
        const OPAQUE_PART: [Region; 2] = [Region::Opaque, Region::Body(0)];
        let (mut dome, mut bottom, mut side, mut solid) = (Vec::new(), None, None, None);
        for surface in surfaces {
            let place = match (&surface.shape, surface.regions) {
                (Shape::Frustum(frustum), SKIN) if frustum.cylinder_facing_out().is_some() => {
                    &mut side
                }
                (shape, SKIN) if strips::primitives(shape).is_some() => {
                    dome.push(surface);
                    continue;
                }
                (Shape::Frustum(frustum), OPAQUE_PART) if frustum.disc_facing_up().is_some() => {
                    &mut bottom
                }
                (Shape::Cuboid(_), OPAQUE_PART) => &mut solid,
                _ => return None,
            };
            if place.replace(surface).is_some() {
                return None;
            }
        }
        (!dome.is_empty()).then_some(())?;
        Some(Self { dome, bottom: bottom?, side, solid })
    }
}

/// A geometry of two media without surfaces.
fn empty(offset: f64, [inner, outer]: [f64; 2]) -> PackageGeometry {
    PackageGeometry {
        offset,
        inner,
        outer,
        level: 0.0,
        rim2: 0.0,
        side2: 0.0,
        side: [f64::INFINITY, f64::NEG_INFINITY],
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
        centre: 0.0,
        radius: 1.0,
        zone: [f64::INFINITY, f64::NEG_INFINITY],
        shell: Shell { centre_z: 0.0, inner: 0.0, outer: 0.0 },
        side_radius: 0.0,
        dome_mode: Mode::NOTHING,
        flat_mode: [Mode::NOTHING; FlatCode::COUNT],
        max_bounces: u32::MAX.into(),
        orders: [1.0; 2],
    }
}

/// The frustum of a surface.
fn frustum_of(surface: &CompiledSurface) -> Option<&Frustum> {
    match &surface.shape {
        Shape::Frustum(frustum) => Some(frustum),
        _ => None,
    }
}

/// The dome of a package with its primitives, and when light that leaves it never meets the package
/// again.
fn dome<'a>(
    members: &PackageSurfaces<'a>,
    geometry: &mut PackageGeometry,
    primitives: &mut Vec<Primitive<'a>>,
) -> Option<(Dome<'a>, LeavesPackage)> {
    if let [surface] = members.dome[..] {
        match &surface.shape {
            Shape::Sphere(sphere) => {
                (geometry.centre, geometry.radius, geometry.zone) = sphere.ball();
                let zones = 0..surface.shape.patches() as u32;
                primitives.extend(zones.map(|zone| Primitive::new(surface, zone, [0.0; 3])));
                let dome = Dome::Round(Zones::new(sphere.cuts(), geometry.zone));
                let leaves = match &members.side {
                    Some(side) if !continues_rim(geometry, side) => LeavesPackage::Opening,
                    _ => LeavesPackage::Always,
                };
                return Some((dome, leaves));
            }
            Shape::Revolution(relief) => {
                geometry.shell = relief.shell();
                for (number, frustum) in (0..).zip(relief.frusta()) {
                    primitives.push(Primitive::new(surface, number, frustum.line()));
                }
                let dome = StaircaseTable::new(relief).map_or(Dome::Relief(relief), Dome::Stairs);
                let leaves =
                    if relief.opening() { LeavesPackage::Opening } else { LeavesPackage::Unknown };
                return Some((dome, leaves));
            }
            _ => {}
        }
    }
    for surface in &members.dome {
        let numbers = 0..strips::primitives(&surface.shape)?;
        primitives.extend(numbers.map(|k| Primitive::new(surface, k, [0.0; 3])));
    }
    let strips = Strips::new(&members.dome)?;
    Some((Dome::Strips(strips), LeavesPackage::Unknown))
}

/// True if the upright `side` continues the rim of a cap, so that both bound a convex body.
fn continues_rim(geometry: &PackageGeometry, side: &CompiledSurface) -> bool {
    let below = geometry.zone[0] - geometry.centre;
    let rim2 = geometry.radius * geometry.radius - below * below;
    let radius = frustum_of(side).and_then(Frustum::cylinder_facing_out);
    radius.is_some_and(|(r, _)| below >= 0.0 && (rim2 - r * r).abs() <= 1e-8 * rim2)
}

impl<'a> BatchTracer<'a> {
    /// Compiles the scene, if it is of packages; paths are given up after `max_bounces` surfaces.
    pub fn new(scene: &'a Scene, max_bounces: u32) -> Option<Self> {
        let list = &scene.instances.list;
        let prototype = list.first()?.prototype;
        // Array solids, and instances in them, are no copies of the package.
        let alike =
            list.iter().all(|other| other.prototype == prototype) && scene.array_solids().is_none();
        let mut sources = scene.sources.iter();
        let inside =
            sources.all(|placed| matches!(placed.location, Location::Inside { medium: 0, .. }));
        let body = &scene.bodies[prototype as usize];
        let ([medium], false) = (&body.media[..], scene.world.absorption > 0.0) else {
            return None;
        };
        let members = PackageSurfaces::new(&body.surfaces)?;
        if !alike || !inside {
            return None;
        }

        let mut geometry = empty(scene.offset(), members.dome[0].indices);
        geometry.max_bounces = max_bounces.into();
        let mut primitives = Vec::new();
        let (dome, leaves_package) = dome(&members, &mut geometry, &mut primitives)?;
        let tables = set_orders(&mut geometry, &mut primitives);
        geometry.dome_mode = primitives[0].mode;
        let varied = primitives.iter().any(|primitive| primitive.mode != primitives[0].mode);
        let bottom = primitives.len();
        let (level, rim) = frustum_of(members.bottom)?.disc_facing_up()?;
        (geometry.level, geometry.rim2) = (level, rim * rim);
        primitives.push(Primitive::new(members.bottom, 0, [0.0, 1.0, level]));
        if let Some(surface) = members.side {
            let (radius, heights) = frustum_of(surface)?.cylinder_facing_out()?;
            (geometry.side2, geometry.side) = (radius * radius, heights);
            geometry.side_radius = radius;
            primitives.push(Primitive::new(surface, 0, [1.0, 0.0, radius]));
        }
        // Their tangents are not those of a dome.
        for primitive in &mut primitives[bottom..] {
            primitive.sample_separately();
        }
        geometry.flat_mode[1..=primitives.len() - bottom]
            .iter_mut()
            .zip(&primitives[bottom..])
            .for_each(|(mode, primitive)| *mode = primitive.mode);
        let faces = primitives.len() as f64 - FlatCode::face(0.0).0;
        if let Some(surface) = members.solid {
            add_box(&mut geometry, &mut primitives, surface);
        }
        Some(Self {
            scene,
            dome,
            primitives,
            flats: [bottom as f64 - FlatCode::BOTTOM.0, faces],
            medium,
            varied,
            tables,
            exit: Exit {
                leaves_package,
                alone: list.len() == 1 && scene.ground.surfaces.is_empty(),
                clearance: Clearance::new(scene, level),
            },
            geometry,
        })
    }
}

/// The tables of a dome as one batch, with their indices. `None` without tables, and where they
/// have different indices or do not fit together; each then samples by itself.
fn set_orders<'a>(
    geometry: &mut PackageGeometry,
    primitives: &mut [Primitive<'a>],
) -> Option<OrderTableBatch<'a>> {
    let indices = |table: &OrderTable| Side::BOTH.map(|side| table.grid().index(side));
    let all: Vec<[f64; 2]> = primitives.iter().filter_map(|p| p.table).map(indices).collect();
    geometry.orders = *all.first()?;
    let tables = all
        .iter()
        .flatten()
        .zip(geometry.orders.iter().cycle())
        .all(|(a, b)| a.to_bits() == b.to_bits())
        .then(|| OrderTableBatch::new(primitives.iter().map(|primitive| primitive.table).collect()))
        .flatten();
    if tables.is_none() {
        for primitive in primitives {
            primitive.sample_separately();
        }
    }
    tables
}

fn add_box<'a>(
    geometry: &mut PackageGeometry,
    primitives: &mut Vec<Primitive<'a>>,
    surface: &'a CompiledSurface,
) {
    let Bounds { low, high } = surface.shape.bounds();
    (geometry.low, geometry.high) = (low.to_array(), high.to_array());
    for face in 0..6 {
        let mut primitive = Primitive::new(surface, face, [0.0; 3]);
        primitive.sample_separately();
        geometry.flat_mode[FlatCode::face(face.into()).0 as usize] = primitive.mode;
        primitives.push(primitive);
    }
}
