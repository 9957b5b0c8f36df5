// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks of media, surfaces and sources before a scene is compiled.

use super::SceneBuilder;
use crate::error::{Error, check, finite};
use crate::optics::media::Medium;
use crate::surface::{Region, Surface};

impl SceneBuilder {
    /// Checks media, surfaces, positions and sources one by one; `outside` is the medium that an
    /// instance stands in.
    pub(super) fn check<'a>(&'a self, outside: impl Fn(usize) -> &'a Medium) -> Result<(), Error> {
        self.world.validate()?;
        if let Some(scattering) = &self.world.scattering {
            // Light could not leave it.
            check("scattering of the world per mm", scattering.per_mm, "none", false)?;
        }
        if let Some(luminophore) = self.world.luminophores.first() {
            let absorption = luminophore.absorption_per_mm;
            check("luminescence of the world per mm", absorption, "none", false)?;
        }
        for (number, prototype) in self.prototypes.iter().enumerate() {
            for medium in &prototype.media {
                medium.validate()?;
            }
            // Prototypes that stand nowhere, and the array solids, are judged as in
            // the world.
            let mut around: Vec<&Medium> = Vec::new();
            for instance in 0..self.instances.len() {
                let medium = outside(instance);
                if self.prototype_of(instance) == number && !around.contains(&medium) {
                    around.push(medium);
                }
            }
            if around.is_empty() {
                around.push(&self.world);
            }
            for medium in around {
                for surface in &prototype.surfaces {
                    check_surface(surface, &prototype.media, medium)?;
                }
            }
            for source in &prototype.sources {
                source.validate()?;
                check_region(&source.name, source.region, &prototype.media, Role::Source)?;
            }
        }
        for surface in &self.surfaces {
            check_surface(surface, &[], &self.world)?;
        }
        for source in &self.sources {
            source.validate()?;
            check_region(&source.name, source.region, &[], Role::Source)?;
        }
        for (_, position) in &self.instances {
            for value in position.to_array() {
                finite("position of an instance, mm", value)?;
            }
        }
        Ok(())
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Side,
    Source,
}

fn check_region(name: &str, region: Region, media: &[Medium], role: Role) -> Result<(), Error> {
    let exists = match region {
        Region::World => true,
        Region::Body(number) => usize::from(number) < media.len(),
        Region::Opaque => role == Role::Side,
    };
    if exists {
        return Ok(());
    }
    Err(Error::Region {
        surface: name.to_owned(),
        region: region.to_string(),
        available: media.len(),
    })
}

fn check_surface(surface: &Surface, media: &[Medium], world: &Medium) -> Result<(), Error> {
    check_region(surface.name(), surface.inner, media, Role::Side)?;
    check_region(surface.name(), surface.outer, media, Role::Side)?;
    let index = |region: Region| match region {
        Region::World => Some(world.index),
        Region::Body(number) => Some(media[usize::from(number)].index),
        Region::Opaque => None,
    };
    surface.validate(index(surface.inner), index(surface.outer))
}
