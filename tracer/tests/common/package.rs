// SPDX-License-Identifier: MIT OR Apache-2.0
//! A whole package: a silicone dome, a spherical cap that is smooth in zones or has a relief, over
//! an [`Interior`].

use tracer::package::SILICONE;
use tracer::{
    Error, Interior, LedBox, Medium, Meridian, Patch, Prototype, Region, Shape, Surface,
    SurfaceModel,
};

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
        let (dome, foot) = self.dome_surface()?;
        let interior = Interior {
            rim: cap.rim,
            foot,
            // The sphere of a flat dome is far larger than the package.
            size: cap.rim.max(cap.apex),
            silicone: self.silicone.clone(),
            side: self.side.clone(),
            bottom: self.bottom.clone(),
            led: self.led.clone(),
        };
        let mut prototype = interior.prototype()?;
        prototype.surfaces.insert(0, dome);
        Ok(prototype)
    }

    /// The dome, and the height at which it ends.
    fn dome_surface(&self) -> Result<(Surface, f64), Error> {
        let cap = &self.cap;
        let (shape, patches, foot) = match &self.dome {
            Dome::Zones(zones) => {
                let heights = zones.iter().map(|(outer, _)| cap.height(*outer));
                let bounds: Vec<f64> = std::iter::once(cap.apex).chain(heights).collect();
                let shape = Shape::sphere_zones(cap.centre_z(), cap.radius, &bounds)?;
                let patches = zones.iter().map(|(_, patch)| patch.clone()).collect();
                (shape, patches, cap.height(cap.rim))
            }
            Dome::Relief(meridian, patches) => {
                (Shape::revolution(meridian), patches.clone(), meridian.end()[1])
            }
        };
        Ok((Surface::zoned(shape, SILICONE, Region::World, patches), foot))
    }
}
