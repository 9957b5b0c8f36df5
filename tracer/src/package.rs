// SPDX-License-Identifier: MIT OR Apache-2.0
//! An LED package as a prototype: a silicone dome over a reflecting bottom with an LED box in the
//! middle.
//!
//! The dome is a spherical cap, smooth in zones or with a relief, on a short cylinder that stands
//! on z = 0. Inside lie the bottom (a disc at z = 0) and the box, whose top face carries the
//! Lambertian source.

use glam::DVec3;

use crate::error::{Error, check, positive};
use crate::optics::media::Medium;
use crate::scene::Prototype;
use crate::shape::{Meridian, Shape};
use crate::source::{Emission, Emitter, Source};
use crate::surface::{Patch, Region, Surface, SurfaceModel};

/// The medium inside of the package.
pub const SILICONE: Region = Region::Body(0);

/// By how much surfaces reach beyond those that end them, as a share of their size, so that no seam
/// is open.
const REACH: f64 = 1e-9;

/// The sphere from which a dome is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cap {
    /// Radius of the sphere, mm.
    pub radius: f64,
    /// Height of its highest point above the bottom, mm.
    pub apex: f64,
    /// Radius at which the cap ends and the cylinder begins, mm.
    pub rim: f64,
}

impl Cap {
    /// Height of the centre of the sphere, mm.
    pub fn centre_z(&self) -> f64 {
        self.apex - self.radius
    }

    /// Height of the cap at distance `r` from the axis, mm.
    pub fn height(&self, r: f64) -> f64 {
        self.centre_z() + (self.radius * self.radius - r * r).max(0.0).sqrt()
    }
}

/// The emitting surface of a package.
#[derive(Debug, Clone)]
pub enum Dome {
    /// The smooth cap, cut into rings: each with its outer radius (mm, ascending, the last one is
    /// the rim) and its optics.
    Zones(Vec<(f64, Patch)>),
    /// A real relief, from the axis to the rim: one patch for each element of the meridian.
    Relief(Meridian, Vec<Patch>),
}

impl Dome {
    /// The smooth cap as a dielectric interface, under the name `dome`.
    pub fn smooth(cap: &Cap) -> Self {
        Self::Zones(vec![(cap.rim, Patch::new("dome", SurfaceModel::Interface))])
    }

    /// A relief that is a dielectric interface all over; its elements are `element 1`, `element 2`,
    /// ...
    pub fn relief(meridian: Meridian) -> Self {
        let patches = (1..=meridian.elements())
            .map(|k| Patch::new(format!("element {k}"), SurfaceModel::Interface))
            .collect();
        Self::Relief(meridian, patches)
    }
}

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

/// A package. Ledger names: those of the dome's parts, `side`, `bottom`, `box side`, `box top`.
#[derive(Debug, Clone)]
pub struct Package {
    /// The sphere of the dome.
    pub cap: Cap,
    /// Filling medium.
    pub silicone: Medium,
    /// Emitting surface.
    pub dome: Dome,
    /// Optics of the cylinder between cap and bottom.
    pub side: SurfaceModel,
    /// Optics of the bottom disc, seen from inside.
    pub bottom: SurfaceModel,
    /// The LED.
    pub led: LedBox,
}

impl Package {
    /// The prototype to place in a scene; its origin is the middle of the bottom.
    pub fn prototype(&self) -> Result<Prototype, Error> {
        let cap = &self.cap;
        positive("radius of the dome's sphere, mm", cap.radius)?;
        positive("height of the dome, mm", cap.apex)?;
        check(
            "rim of the dome, mm",
            cap.rim,
            "above 0, at most the radius of the sphere",
            cap.rim > 0.0 && cap.rim <= cap.radius,
        )?;
        check(
            "height of the rim of the dome, mm",
            cap.height(cap.rim),
            "0 or more",
            cap.height(cap.rim) >= 0.0,
        )?;
        let led = &self.led;
        check(
            "height of the LED box, mm",
            led.size.z,
            "above 0 and below the apex of the dome",
            led.size.z > 0.0 && led.size.z < cap.apex,
        )?;
        check(
            "half diagonal of the LED box, mm",
            0.5 * led.size.x.hypot(led.size.y),
            "less than the rim of the dome",
            0.5 * led.size.x.hypot(led.size.y) < cap.rim,
        )?;

        let (dome, foot) = self.dome_surface()?;
        let interior = Interior {
            rim: cap.rim,
            foot,
            // The sphere of a flat dome is far larger than the package.
            size: cap.rim.max(cap.apex),
            silicone: self.silicone.clone(),
            side: self.side.clone(),
            bottom: self.bottom.clone(),
            led: led.clone(),
        };
        let mut prototype = interior.prototype()?;
        prototype.surfaces.insert(0, dome);
        Ok(prototype)
    }

    /// The dome, and the height at which it ends.
    fn dome_surface(&self) -> Result<(Surface, f64), Error> {
        let cap = &self.cap;
        let at_rim = |what: &str, r: f64| {
            check(what, r, "the rim of the dome", (r - cap.rim).abs() <= 1e-9 * cap.rim).map(|_| ())
        };
        match &self.dome {
            Dome::Zones(zones) => {
                let last = zones.last().ok_or(Error::TooFew {
                    what: "zones of the dome",
                    expected: 1,
                    got: 0,
                })?;
                at_rim("outer radius of the last zone, mm", last.0)?;
                let mut bounds = vec![cap.apex];
                for (outer, _) in &zones[..zones.len() - 1] {
                    check(
                        "outer radius of a zone, mm",
                        *outer,
                        "below the rim",
                        *outer > 0.0 && *outer < cap.rim,
                    )?;
                    bounds.push(cap.height(*outer));
                }
                let foot = cap.height(cap.rim);
                bounds.push(foot);
                let shape = Shape::sphere_zones(cap.centre_z(), cap.radius, &bounds)?;
                let patches = zones.iter().map(|(_, patch)| patch.clone()).collect();
                Ok((Surface::zoned(shape, SILICONE, Region::World, patches), foot))
            }
            Dome::Relief(meridian, patches) => {
                let [r, foot] = meridian.end();
                at_rim("radius at which the relief ends, mm", r)?;
                check("height at which the relief ends, mm", foot, "0 or more", foot >= 0.0)?;
                let start = meridian.frusta()[0].0.ends()[0][0];
                check("radius at which the relief begins, mm", start, "0", start == 0.0)?;
                let shape = Shape::revolution(meridian);
                Ok((Surface::zoned(shape, SILICONE, Region::World, patches.clone()), foot))
            }
        }
    }
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
