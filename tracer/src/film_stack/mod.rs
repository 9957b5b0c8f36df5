// SPDX-License-Identifier: MIT OR Apache-2.0
//! A stack of films as one layer: what becomes of light that meets it is drawn once, kept, and used
//! for many rays.
//!
//! A stack is the same everywhere along x and y, so that what it does to a ray depends on the
//! direction from which it comes, and on nothing else. For each cell of incidence ([`cells`]) the
//! table holds outcomes that the walker itself has drawn through the films alone: the side on which
//! light leaves, its direction, weight, wavelength and polarisation, how far from where it came, and
//! all that was booked on the way. For a ray that meets the stack all outcomes of its cell stand
//! together, each with its part of the weight, whatever the number of surfaces that they have met; a
//! weak ray takes one. Near an end only outcomes that have stayed nearer stand together; one that has
//! been farther is drawn again up to the end, and traced film by film from there. Energy is exact:
//! weights and bookings are those of paths.
//!
//! The direction with which an outcome began is drawn evenly from its cell. Light that fills a cell
//! evenly is treated exactly; the error for other light is of second order in the width of the
//! cell, and a run with cells of twice the width shows it ([`TabulatedFilms::widened`]). Light that
//! passes straight, or is mirrored by level faces, keeps the direction of the ray.
//!
//! Receivers that look into a narrow cone are reached by few outcomes. Where all faces of the films are
//! reciprocal they read light that is traced backwards from the cone ([`backward`]).
//!
//! Every group of paths draws from outcomes of its own. Groups share nothing, and their scatter
//! holds the noise of the table. Outcome k of a cell of a group is a function of the films, the
//! seed, cell, group and k alone: whether it is drawn or read changes no bit.

mod backward;
mod cells;
mod layers;
mod near;
mod part;
mod surface;
mod traveller;
mod walker;

pub use cells::StackSymmetry;
pub use surface::{StackLight, StackShares, StackSurface};
pub(crate) use walker::{BoundStack, Exits, StackWalker};

use layers::Layers;

use crate::checkpoint::CheckpointStore;
use crate::receiver::Sense;
use crate::scene::Scene;

/// What ends a stack of films along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StackBorder {
    /// The films end here; light that comes to the end on its way through them goes on film by film
    /// from there.
    Edge,
    /// A wall that mirrors all light, and of which the stack is its own mirror image.
    Mirror,
    /// The stack goes on without end: light that leaves a cell on one side enters it on the other.
    Periodic,
}

/// Light that passes a gap between films in one way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// Number of the receiver of the run that reads it.
    pub receiver: usize,
    /// Number of the gap, the lowest 0.
    pub gap: usize,
    /// Height of its plane over the lowest face of the films, mm.
    pub z_mm: f64,
    /// The way.
    pub sense: Sense,
}

/// A level receiver that looks into a narrow cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewer {
    /// Number of the receiver of the run.
    pub receiver: usize,
    /// Its ends along x and y, mm.
    pub ends_mm: [[f64; 2]; 2],
    /// Its height, mm.
    pub z_mm: f64,
}

/// What tabulated outcomes of a film stack are drawn from, and where the stack lies.
pub struct FilmTable {
    /// The films alone, without ends along x and y and the lowest face at the height 0, at each
    /// wavelength of the run: one instance.
    pub scenes: Vec<Scene>,
    /// Receivers of the run, of one bin each, for light that passes gaps between films.
    pub passages: Vec<Passage>,
    /// Height of the lowest face in the scene of the run, mm.
    pub low_mm: f64,
    /// Symmetry of all films.
    pub symmetry: StackSymmetry,
    /// Half the lengths of the films along x and y, mm.
    pub half_mm: [f64; 2],
    /// What ends them there; edges on both axes or on none.
    pub borders: [StackBorder; 2],
    /// Sine squared of the half angle of a cone about z that receivers above look into, 0 without one:
    /// light into it is followed as a share of its own, or traced backwards.
    pub seen_sin2: f64,
    /// Receivers above the films that look into this cone or a narrower one about z, and read no
    /// polarisation.
    pub viewers: Vec<Viewer>,
}

/// A table as a run uses it.
#[derive(Clone, Copy)]
pub struct TabulatedFilms<'a> {
    /// Films and place.
    pub table: &'a FilmTable,
    /// Keeps the outcomes of each group, of the same films, planes and seed.
    pub parts: Option<&'a dyn CheckpointStore>,
    /// True for cells of twice the width, from the same outcomes.
    pub widened: bool,
}

impl FilmTable {
    /// True if light into the cone of receivers is traced backwards: all faces are reciprocal.
    pub fn looks_back(&self) -> bool {
        let are_reciprocal = || self.scenes.iter().all(|scene| Layers::new(scene).are_reciprocal());
        self.seen_sin2 > 0.0 && !self.viewers.is_empty() && are_reciprocal()
    }

    /// Distance of the lowest and the highest face, mm.
    pub(crate) fn height_mm(&self) -> f64 {
        self.scenes[0].bodies[0].bounds.high.z
    }

    /// Heights of the lowest and of the highest face in the scene of the run, mm.
    pub(crate) fn ends_mm(&self) -> [f64; 2] {
        [self.low_mm, self.low_mm + self.height_mm()]
    }
}
