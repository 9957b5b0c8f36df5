// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a section of a relief departs from the layer by whose modes are taken: strips along its sides, and walls that are not upright.
//!
//! Half of the strips acts before the walls and half after. Where ky is not 0 they do not commute, and one after the other would leave an error that falls as the square of the height
//! of a slice only (on the step of ring 75 by 40 slices, six times as much as this way).

use super::Basis;
use super::slanted::{Expansion, Slant, Upright};
use super::strips::Strips;
use crate::error::Error;
use crate::linalg::Scalar;
use crate::relief::Departure;
use faer::Mat;

/// A change of coordinates at one height of a layer.
#[derive(Clone, Debug)]
pub(crate) struct Correction<T> {
    /// Height above the bottom of the layer, in units of its thickness.
    pub(crate) place: f64,
    walls: Option<Slant<T>>,
    /// Over half the height.
    strips: Option<Strips<T>>,
}

impl<T: Scalar> Correction<T> {
    /// Of a section that stands for the height `d` (times k0), beside a layer with these coordinates.
    pub(crate) fn new(
        space: &impl Expansion<T>,
        section: &Departure,
        (upright, basis): (&Upright<T>, &Basis<T>),
        d: f64,
    ) -> Result<Self, Error> {
        Ok(Self {
            place: section.place,
            walls: Slant::new(space, section, (upright, basis), d)?,
            strips: Strips::new(space, &section.strips, basis, 0.5 * d),
        })
    }

    /// Adds to fields, a row for each parameter, what it adds.
    pub(crate) fn add(&self, e: &mut Mat<T>, h: &mut Mat<T>, ky: f64) {
        let strips = |e: &Mat<T>, h: &mut Mat<T>| {
            if let Some(strips) = &self.strips {
                strips.add(e, h, ky);
            }
        };
        strips(e, h);
        if let Some(walls) = &self.walls {
            walls.add(e, h, ky);
        }
        strips(e, h);
    }
}
