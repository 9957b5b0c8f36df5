// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prototypes compiled for tracing: surfaces listed by the region that they border, names replaced
//! by ledger lines.

use bsdf::Side;

use super::lines::Lines;
use crate::optics::luminescence::Collisions;
use crate::optics::media::Medium;
use crate::ray::Ray;
use crate::shape::{Bounds, Intersection, PacketTraversal, Reach, Shape, Sides};
use crate::surface::{Region, Surface, SurfaceModel};

/// A medium with its line in the ledger.
#[derive(Debug, Clone)]
pub(crate) struct CompiledMedium {
    pub index: f64,
    pub absorption: f64,
    pub line: usize,
    pub collisions: Option<Collisions>,
}

impl CompiledMedium {
    fn new(medium: &Medium, lines: &mut Lines) -> Self {
        let line = lines.medium(&medium.name);
        let luminophores = medium.luminophores.iter().map(|luminophore| {
            let line = lines.luminophore(&luminophore.name);
            (luminophore.clone(), line)
        });
        let (scattering, density) = (medium.scattering.as_ref(), medium.density.clone());
        let collisions = Collisions::new(scattering, luminophores.collect(), density);
        let Medium { index, absorption_per_mm: absorption, .. } = *medium;
        Self { index, absorption, line, collisions }
    }
}

/// A patch of a surface with its line in the ledger.
#[derive(Debug, Clone)]
pub(crate) struct CompiledPatch {
    pub optics: SurfaceModel,
    pub line: usize,
}

/// A surface with the regions and refractive indices on both sides, inner first.
#[derive(Debug, Clone)]
pub(crate) struct CompiledSurface {
    pub shape: Shape,
    pub regions: [Region; 2],
    /// 0 where opaque: never read there.
    pub indices: [f64; 2],
    pub patches: Vec<CompiledPatch>,
}

/// Surfaces to test in a region.
type Bordering = Vec<Border>;

/// A surface that borders a region.
#[derive(Debug, Clone, Copy)]
struct Border {
    surface: u32,
    /// The sides from which it counts.
    sides: Sides,
    /// Heights between which it lies, with a slack far above rounding.
    low: f64,
    high: f64,
    /// Factor on the negative smallest distance of a hit: 1 where the side tells a surface just
    /// left from one ahead, 0 where the same region lies on both sides.
    before: f64,
}

impl Border {
    /// The interval in which hits on it are looked for.
    #[inline]
    fn reach(&self, reach: Reach) -> Reach {
        Reach { from: reach.from * self.before, to: reach.to }
    }

    /// True if a ray begins above it and does not fall, or below it and does not rise.
    #[inline]
    fn passed_by(&self, ray: &Ray) -> bool {
        let (z, dz) = (ray.origin.z, ray.direction.z);
        (z > self.high && dz >= 0.0) || (z < self.low && dz <= 0.0)
    }
}

/// A prototype, or the surfaces of the world itself.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub surfaces: Vec<CompiledSurface>,
    pub media: Vec<CompiledMedium>,
    from_world: Bordering,
    from_media: Vec<Bordering>,
    /// Ledger line of the medium around it.
    pub outside: usize,
    /// Box around its skin, infinite where that is; a body that does not border the world has its
    /// other surfaces for a skin.
    pub bounds: Bounds,
    /// True if only one surface borders the world and that is of a convex solid: a ray that leaves
    /// into the world then does not meet the body again before something else.
    pub convex: bool,
    /// Distance from the axis that it fills, if it is made of bodies of revolution and placed
    /// shapes only.
    pub radius: Option<f64>,
    /// True if it is a body of revolution about its axis.
    pub round: bool,
    /// Boxes around its skin: one for each placed shape, and one for all the rest.
    pub boxes: Vec<Bounds>,
}

/// The medium around a body.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub medium: &'a Medium,
    /// True if it is that of an array solid.
    pub enclosed: bool,
}

/// A hit on a surface of one body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyHit {
    pub surface: u32,
    pub at: Intersection,
}

/// The surface that a ray sees first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstSeen {
    pub distance: f64,
    /// The region on the side from which it is seen.
    pub faces: Region,
    /// Ledger line of the patch.
    pub line: usize,
}

impl Body {
    /// Compiles valid surfaces.
    pub(super) fn new(
        media: &[Medium],
        surfaces: &[Surface],
        around: Around<'_>,
        lines: &mut Lines,
    ) -> Self {
        let index = |region: Region| match region {
            Region::World => around.medium.index,
            Region::Body(number) => media[usize::from(number)].index,
            Region::Opaque => 0.0,
        };
        let ready: Vec<CompiledSurface> = surfaces
            .iter()
            .map(|surface| CompiledSurface {
                shape: surface.shape.clone(),
                regions: [surface.inner, surface.outer],
                indices: [index(surface.inner), index(surface.outer)],
                patches: surface
                    .patches
                    .iter()
                    .map(|patch| CompiledPatch {
                        optics: patch.optics.plain(),
                        line: lines.surface(&patch.name, is_skin(surface) && !around.enclosed),
                    })
                    .collect(),
            })
            .collect();
        let bordering = |region: Region| -> Bordering {
            let sides = |surface: &CompiledSurface| match surface.regions.map(|side| side == region)
            {
                [true, true] => Some(Sides::Both),
                [true, false] => Some(Sides::Inner),
                [false, true] => Some(Sides::Outer),
                [false, false] => None,
            };
            ready
                .iter()
                .enumerate()
                .filter_map(|(number, surface)| {
                    let Bounds { low, high } = surface.shape.bounds();
                    let slack = 1e-9 * (low.z.abs() + high.z.abs());
                    let sides = sides(surface)?;
                    Some(Border {
                        surface: number as u32,
                        sides,
                        low: low.z - slack,
                        high: high.z + slack,
                        before: if sides == Sides::Both { 0.0 } else { 1.0 },
                    })
                })
                .collect()
        };
        let from_world = bordering(Region::World);
        let skin: Vec<&CompiledSurface> = if from_world.is_empty() {
            ready.iter().collect()
        } else {
            from_world.iter().map(|border| &ready[border.surface as usize]).collect()
        };
        let bounds = Bounds::union_of(skin.iter().map(|surface| surface.shape.bounds()));
        let radii: Option<Vec<f64>> = skin.iter().map(|surface| surface.shape.radius()).collect();
        let radius = radii.map(|radii| radii.into_iter().fold(0.0, f64::max));
        let round = skin.iter().all(|surface| surface.shape.round());
        let placed = |surface: &&&CompiledSurface| matches!(surface.shape, Shape::Placed(_));
        let rest = skin
            .iter()
            .filter(|surface| !placed(surface))
            .map(|surface| surface.shape.bounds())
            .reduce(Bounds::union);
        let placed = skin.iter().filter(placed).map(|s| s.shape.bounds());
        let boxes = rest.into_iter().chain(placed).collect();
        let convex = match &from_world[..] {
            [only] => {
                let surface = &ready[only.surface as usize];
                only.sides == Sides::Outer && surface.shape.convex()
            }
            _ => false,
        };
        let outside = lines.medium(&around.medium.name);
        Self {
            convex,
            outside,
            from_world,
            from_media: (0..media.len())
                .map(|number| bordering(Region::Body(number as u8)))
                .collect(),
            media: media.iter().map(|medium| CompiledMedium::new(medium, lines)).collect(),
            bounds,
            radius,
            round,
            boxes,
            surfaces: ready,
        }
    }

    /// The surfaces that border the world; all, if none does.
    pub fn skin(&self) -> impl Iterator<Item = &CompiledSurface> {
        self.surfaces
            .iter()
            .filter(|s| self.from_world.is_empty() || s.regions.contains(&Region::World))
    }

    /// The nearest surface that borders the medium of this number, or the world.
    #[expect(
        clippy::inline_always,
        reason = "one copy of the loop over a path for each kind of light and observer: left \
            alone, the compiler calls it, a tenth slower"
    )]
    #[inline(always)]
    pub fn nearest(&self, medium: Option<u8>, ray: &Ray, mut reach: Reach) -> Option<BodyHit> {
        let bordering = match medium {
            Some(number) => &self.from_media[usize::from(number)],
            None => &self.from_world,
        };
        let mut found = None;
        for border in bordering {
            if border.passed_by(ray) {
                continue;
            }
            let surface = border.surface;
            let shape = &self.surfaces[surface as usize].shape;
            if let Some(at) = shape.intersect(ray, border.reach(reach), border.sides) {
                reach.to = at.distance;
                found = Some(BodyHit { surface, at });
            }
        }
        found
    }

    /// The nearest surfaces that border medium `number`, for up to [`PACKET`](crate::shape::PACKET)
    /// rays.
    pub fn nearest_of_many(
        &self,
        number: u8,
        rays: &[Ray],
        mut reach: Vec<Reach>,
        traversal: &mut PacketTraversal,
    ) -> Vec<Option<BodyHit>> {
        let mut found = vec![None; rays.len()];
        for border in &self.from_media[usize::from(number)] {
            let (surface, sides) = (border.surface, border.sides);
            let shape = &self.surfaces[surface as usize].shape;
            let within: Vec<Reach> = reach.iter().map(|reach| border.reach(*reach)).collect();
            let hits = if let Shape::Mesh(mesh) = shape {
                mesh.intersect_many(traversal, rays, &within, sides)
            } else {
                rays.iter()
                    .zip(&within)
                    .map(|(ray, reach)| shape.intersect(ray, *reach, sides))
                    .collect()
            };
            for ((found, reach), hit) in found.iter_mut().zip(&mut reach).zip(hits) {
                if let Some(at) = hit {
                    reach.to = at.distance;
                    *found = Some(BodyHit { surface, at });
                }
            }
        }
        found
    }

    /// The nearest surface from any side.
    pub fn first_seen(&self, ray: &Ray, mut reach: Reach) -> Option<FirstSeen> {
        let mut found = None;
        for surface in &self.surfaces {
            if let Some(at) = surface.shape.intersect(ray, reach, Sides::Both) {
                reach.to = at.distance;
                found = Some(FirstSeen {
                    distance: at.distance,
                    faces: surface.regions[at.side.index()],
                    line: surface.patches[surface.shape.patch(at.primitive) as usize].line,
                });
            }
        }
        found
    }
}

/// True if a surface separates a body from the world.
fn is_skin(surface: &Surface) -> bool {
    matches!(
        (surface.inner, surface.outer),
        (Region::Body(_), Region::World) | (Region::World, Region::Body(_))
    )
}

impl CompiledSurface {
    /// True if it is a solid box of the world that light does not enter.
    pub fn is_wall(&self) -> bool {
        matches!(self.shape, Shape::Cuboid(_)) && self.regions[0] == Region::Opaque
    }

    /// Region on `side`.
    #[inline]
    pub fn region(&self, side: Side) -> Region {
        self.regions[side.index()]
    }

    /// Refractive index on `side`.
    #[inline]
    pub fn index(&self, side: Side) -> f64 {
        self.indices[side.index()]
    }
}
