// SPDX-License-Identifier: MIT OR Apache-2.0
//! The inside of an LED package as a prototype: a reflecting bottom (a disc at z = 0) with an LED
//! box in the middle, whose top face carries the Lambertian source, and the cylinder below the
//! dome.

use glam::DVec3;

use crate::error::Error;
use crate::optics::media::Medium;
use crate::scene::Prototype;
use crate::shape::Shape;
use crate::source::{Emission, Emitter, Source};
use crate::surface::{Patch, Region, Surface, SurfaceModel};

/// The medium inside of the package.
pub const SILICONE: Region = Region::Body(0);

/// By how much surfaces reach beyond those that end them, as a share of their size, so that no seam
/// is open.
const REACH: f64 = 1e-9;

/// The LED: a box on the bottom whose whole top face emits.
#[derive(Debug, Clone)]
pub struct LedBox {
    /// Lengths along x, y and z, mm.
    pub size: DVec3,
    /// Optics of the four sides, under the name `box side`.
    pub side: SurfaceModel,
    /// Optics of the top for light that comes back, under the name `box top`.
    pub top: SurfaceModel,
}

/// A package without the surface of its dome, which may be any that ends at radius `rim` and height
/// `foot`. Ledger names: `side`, `bottom`, `box side`, `box top`.
#[derive(Debug, Clone)]
pub struct Interior {
    /// Radius at which the dome ends, and of the bottom, mm.
    pub rim: f64,
    /// Height at which the dome ends and a cylinder of radius `rim` begins, mm; 0 for none.
    pub foot: f64,
    /// A length of the order of the package's, of which surfaces reach a billionth beyond those
    /// that end them, mm.
    pub size: f64,
    /// Filling medium.
    pub silicone: Medium,
    /// Optics of the cylinder.
    pub side: SurfaceModel,
    /// Optics of the bottom disc, seen from inside.
    pub bottom: SurfaceModel,
    /// The LED.
    pub led: LedBox,
}

impl Interior {
    /// Cylinder, bottom, box and source; the dome's surface is to be added.
    ///
    /// # Errors
    /// Lengths that are not positive.
    pub fn prototype(&self) -> Result<Prototype, Error> {
        let led = &self.led;
        let mut surfaces = Vec::new();
        let reach = REACH * self.size;
        if self.foot > reach {
            let side = Shape::cylinder(self.rim, -reach, self.foot)?;
            surfaces.push(Surface::new("side", side, SILICONE, Region::World, &self.side));
        }
        let bottom = Shape::annulus(0.0, 0.0, self.rim + reach)?;
        surfaces.push(Surface::new("bottom", bottom, Region::Opaque, SILICONE, &self.bottom));
        let half = DVec3::new(0.5 * led.size.x, 0.5 * led.size.y, 0.0);
        let solid =
            Shape::cuboid(DVec3::new(-half.x, -half.y, -reach), half + DVec3::Z * led.size.z)?;
        let side = Patch::new("box side", led.side.clone());
        let patches = vec![side.clone(), Patch::new("box top", led.top.clone()), side];
        surfaces.push(Surface::zoned(solid, Region::Opaque, SILICONE, patches));

        let emitter = Emitter::Rectangle { half_x: half.x, half_y: half.y };
        let position = DVec3::new(0.0, 0.0, led.size.z);
        let source = Source::new("LED", position, SILICONE, emitter, Emission::LAMBERTIAN);
        Ok(Prototype { media: vec![self.silicone.clone()], surfaces, sources: vec![source] })
    }
}

/// The ground z = 0 of an array: `mirror` on the rectangle |x| ≤ `half_x`, |y| ≤ `half_y` (mm),
/// `floor` beyond it.
pub fn ground(
    half_x: f64,
    half_y: f64,
    mirror: SurfaceModel,
    floor: SurfaceModel,
) -> Result<Surface, Error> {
    let patches = vec![Patch::new("ground mirror", mirror), Patch::new("floor", floor)];
    Ok(Surface::zoned(Shape::ground(0.0, half_x, half_y)?, Region::Opaque, Region::World, patches))
}
