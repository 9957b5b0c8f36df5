// SPDX-License-Identifier: MIT OR Apache-2.0
//! A housing: four upright walls around an array and the floor between them, open at the top.
//!
//! The walls are opaque boxes, so light meets them from either side. The floor z = 0 is cut into
//! rectangles: the mirror in the middle and the floor around it up to the walls. A black plane lies
//! outside of the walls, lower by a billionth of the size of the housing.

use glam::DVec3;

use crate::error::{Error, check, positive};
use crate::shape::{Extent, Plane, Shape};
use crate::surface::{Patch, Region, Surface, SurfaceModel};

/// By how much pieces reach beyond those that end them, as a share of the size of the housing, so
/// that no seam is open.
const REACH: f64 = 1e-9;

/// A housing around the z axis. Ledger names: `wall`, `ground mirror`, `housing floor`, `floor`.
#[derive(Debug, Clone)]
pub struct Housing {
    /// Half the inner lengths along x and y, mm.
    pub half: [f64; 2],
    /// Height of the walls above z = 0, mm.
    pub height: f64,
    /// Thickness of the walls, mm.
    pub thickness: f64,
    /// Optics of the walls, all over.
    pub walls: SurfaceModel,
    /// Optics of the bottom between the walls, where there is no mirror.
    pub floor: SurfaceModel,
    /// Half lengths of a mirror in the middle of the bottom (mm) and its optics; the walls may cut
    /// it.
    pub mirror: Option<([f64; 2], SurfaceModel)>,
}

impl Housing {
    /// Surfaces, for [`crate::SceneBuilder::surface`].
    pub fn surfaces(&self) -> Result<Vec<Surface>, Error> {
        let [x, y] = self.half;
        positive("half the inner length of the housing, mm", x)?;
        positive("half the inner length of the housing, mm", y)?;
        positive("height of the housing, mm", self.height)?;
        positive("thickness of the walls, mm", self.thickness)?;
        let reach = REACH * (x.max(y).max(self.height) + self.thickness);
        check(
            "thickness of the walls, mm",
            self.thickness,
            "more than a millionth of the size of the housing",
            self.thickness > 1e3 * reach,
        )?;

        let mut surfaces = Vec::new();
        let bottom = |name: &str, low: [f64; 2], high: [f64; 2], optics: &SurfaceModel| {
            let half = |axis: usize| 0.5 * (high[axis] - low[axis]) + reach;
            let point = DVec3::new(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.0);
            let extent = Extent::Rectangle { half_u: half(0), half_v: half(1) };
            let shape = Shape::Plane(Plane::new(point, DVec3::Z, extent)?);
            Ok::<_, Error>(Surface::new(name, shape, Region::Opaque, Region::World, optics))
        };
        // Coplanar pieces overlap by the reach; the first one counts there.
        let (mut a, mut b) = (0.0, 0.0);
        if let Some((half, optics)) = &self.mirror {
            (a, b) = (half[0].min(x), half[1].min(y));
            surfaces.push(bottom("ground mirror", [-a, -b], [a, b], optics)?);
        }
        let strips =
            [([-x, b], [x, y]), ([-x, -y], [x, -b]), ([a, -b], [x, b]), ([-x, -b], [-a, b])];
        for (low, high) in strips {
            if high[0] > low[0] && high[1] > low[1] {
                surfaces.push(bottom("housing floor", low, high, &self.floor)?);
            }
        }

        let (far_x, far_y) = (x + self.thickness, y + self.thickness);
        // The walls along x reach into those along y, which close the corners.
        let walls = [
            ([x, -far_y], [far_x, far_y]),
            ([-far_x, -far_y], [-x, far_y]),
            ([-x - reach, y], [x + reach, far_y]),
            ([-x - reach, -far_y], [x + reach, -y]),
        ];
        for (low, high) in walls {
            let solid = Shape::cuboid(
                DVec3::new(low[0], low[1], -2.0 * reach),
                DVec3::new(high[0], high[1], self.height),
            )?;
            // Light comes round at the sides alone.
            let ends = match self.walls {
                SurfaceModel::Periodic => SurfaceModel::Absorber,
                ref walls => walls.clone(),
            };
            let patches =
                [&self.walls, &ends, &ends].map(|optics| Patch::new("wall", optics.clone()));
            let (inner, outer) = (Region::Opaque, Region::World);
            surfaces.push(Surface::zoned(solid, inner, outer, patches.to_vec()));
        }
        surfaces.push(Surface::new(
            "floor",
            Shape::horizontal(-reach)?,
            Region::Opaque,
            Region::World,
            &SurfaceModel::Absorber,
        ));
        Ok(surfaces)
    }
}
