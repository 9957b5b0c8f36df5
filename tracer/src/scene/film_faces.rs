// SPDX-License-Identifier: MIT OR Apache-2.0
//! The outer faces of a film stack in a scene, where light takes an outcome of the table of the stack.

use super::{CompiledSurface, Location, Scene};
use crate::error::{Error, check};
use crate::ray::Ray;
use crate::surface::Region;

/// Tolerance of heights at which the films of the scene and of the table lie, mm, and as a share of the
/// size of films: scenes draw their faces in.
const LEVEL_MM: f64 = 1e-5;
const LEVEL: f64 = 1e-8;

/// Tolerance of the heights of a film, mm.
fn slack_mm(film: &CompiledSurface) -> f64 {
    LEVEL_MM + LEVEL * film.shape.bounds().farthest()
}

/// The outer faces of the stack in one scene, and where light that meets them takes an outcome.
pub(crate) struct FilmFaces {
    /// The instance of the films, if it is of them alone.
    films: Option<u32>,
    low: f64,
    high: f64,
    /// The regions of the films, the lowest first.
    regions: Vec<Location>,
    /// Half the lengths of the rectangle in which it does, mm.
    within: [f64; 2],
}

impl FilmFaces {
    /// Those of so many films between two heights, mm, which with their contacts make so many surfaces.
    ///
    /// # Errors
    /// Films that the scene does not have.
    pub fn new(
        scene: &Scene,
        [low, high]: [f64; 2],
        [count, with_contacts]: [usize; 2],
        within: [f64; 2],
    ) -> Result<Self, Error> {
        let surfaces = scene.array_solids().map_or(&[][..], |body| &body.surfaces);
        let at = |z: f64, end: fn(&CompiledSurface) -> f64| {
            let off = |one: &&CompiledSurface| (end(one) - z).abs();
            let nearest = surfaces.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            let near = |one: &&CompiledSurface| off(one) < slack_mm(one);
            nearest.filter(near).map(end).ok_or(Error::Number {
                what: "height of a face of tabulated films, mm".to_owned(),
                expected: "that of a film of the scene",
                got: z,
            })
        };
        let mut films: Vec<&CompiledSurface> = surfaces
            .iter()
            .filter(|one| {
                let bounds = one.shape.bounds();
                bounds.low.z > low - slack_mm(one) && bounds.high.z < high + slack_mm(one)
            })
            .filter(|one| one.regions[1] == Region::World)
            .collect();
        films.sort_by(|a, b| a.shape.bounds().low.z.total_cmp(&b.shape.bounds().low.z));
        let location = |film: &&CompiledSurface| match (film.regions[0], scene.array_solids) {
            (Region::Body(medium), Some(instance)) => Location::Inside { instance, medium },
            _ => Location::World,
        };
        let what = "number of tabulated films";
        check(what, films.len() as f64, "that of the scene", films.len() == count)?;
        let are_all = surfaces.len() == with_contacts;
        Ok(Self {
            films: scene.array_solids.filter(|_| are_all),
            low: at(low, |one| one.shape.bounds().low.z)?,
            high: at(high, |one| one.shape.bounds().high.z)?,
            regions: films.iter().map(location).collect(),
            within,
        })
    }

    /// Distance at which a ray of the world that begins below or above the stack meets it where it
    /// takes an outcome, if nothing stands before it.
    #[inline]
    pub fn ahead(&self, ray: &Ray) -> Option<f64> {
        let (z, dz) = (ray.origin.z, ray.direction.z);
        let face = if dz > 0.0 && z < self.low {
            self.low
        } else if dz < 0.0 && z > self.high {
            self.high
        } else {
            return None;
        };
        let distance = (face - z) / dz;
        let at = ray.at(distance);
        (at.x.abs() <= self.within[0] && at.y.abs() <= self.within[1]).then_some(distance)
    }

    /// The region of a film, the lowest 0.
    pub fn inside(&self, film: u8) -> Location {
        self.regions[usize::from(film)]
    }

    /// The instance of the films, which needs no test before that distance.
    #[inline]
    pub fn instance(&self) -> Option<u32> {
        self.films
    }
}
