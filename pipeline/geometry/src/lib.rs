// SPDX-License-Identifier: MIT OR Apache-2.0
//! From profiles to plain geometry: the generating curve of a dome, and the unit cell of a ring.
//!
//! In: a dome and its rings of relief. Out: a [`Meridian`] (pieces of line and arc from the axis to
//! the bottom, for the ray tracer) and a [`Cell`] for each ring (one period of the relief in the
//! frame of its chord, for the wave solver and for its control by ray optics). Ring i of width w
//! spans r from w(i-1) to wi; its base corners lie on the smooth surface that carries the relief
//! ([`BaseSurface`]), and everything on it stands on the chord between them.
//!
//! ```
//! use geometry::profile::{Elements, Rounding, Shape, SphericalDome};
//! use geometry::ring_cell;
//!
//! let dome = SphericalDome { sphere_radius_mm: 2.0, height_mm: 1.0, radius_mm: 1.7 };
//! let rings =
//!     Elements { width_mm: 0.01, shapes: vec![Shape::Os1; 170], rounding: Rounding::default() };
//! let cell = ring_cell(&dome, &rings, 75, 1.41)?.expect("a step");
//! // The chord of ring 75 of the paper's dome.
//! assert!((cell.period_um - 10.78).abs() < 0.005);
//! # Ok::<(), geometry::GeometryError>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`profile`] | profiles of a dome and of its rings |
//! | `base_surface`, `relief`, `rounding` | smooth surface, elements on it, rounded corners |
//! | `meridian`, [`outline`], `planar` | generating curves, stated ones, and where pieces meet |
//! | `cell` | one period in the frame of its chord |
//! | [`oval`], [`height_map`], [`tessellation`] | surfaces that are not round, and triangles for them |

mod base_surface;
mod cell;
pub mod height_map;
mod meridian;
pub mod outline;
pub mod oval;
mod planar;
pub mod profile;
mod relief;
mod rounding;
pub mod tessellation;

pub use base_surface::BaseSurface;
pub use cell::Cell;
pub use meridian::{Curve, Meridian, Piece, Role};
pub use rounding::Corner;

#[cfg(test)]
use profile::SphericalDome;
use profile::{Elements, Reference, Shape};

/// The dome of the paper, for tests.
#[cfg(test)]
const DOME: SphericalDome = SphericalDome { sphere_radius_mm: 2.0, height_mm: 1.0, radius_mm: 1.7 };

/// Why a generating curve cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// The curve goes below the bottom or across the axis.
    #[error(
        "element {element} has a vertex at r = {r_mm} mm, z = {z_mm} mm, off the half-plane r >= 0, z >= 0"
    )]
    OutOfBounds {
        /// Element, from 1.
        element: usize,
        /// Radius, mm.
        r_mm: f64,
        /// Height, mm.
        z_mm: f64,
    },
    /// Two pieces cross.
    #[error("element {first} crosses element {second}")]
    Crossing {
        /// Element, from 1.
        first: usize,
        /// Element, from 1 (one more than the last is the cylinder).
        second: usize,
    },
    /// A corner is rounded by more than its sides hold.
    #[error(
        "a {corner} radius of {radius_um} um at element {element}, where at most {most_um} um fit"
    )]
    Radius {
        /// Element, from 1.
        element: usize,
        /// Which radius.
        corner: Corner,
        /// The radius, µm.
        radius_um: f64,
        /// The largest that fits everywhere, µm.
        most_um: f64,
    },
}

/// The chord of one ring and the frame that stands on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    /// Corner nearer the axis, (r, z), mm.
    pub inner: [f64; 2],
    /// Corner farther out, (r, z), mm.
    pub outer: [f64; 2],
}

impl Chord {
    /// The chord of ring `ring` (from 1) of width `width_mm`.
    pub fn of<'a>(base: impl Into<BaseSurface<'a>>, width_mm: f64, ring: usize) -> Self {
        let base = base.into();
        let (r0, r1) = (width_mm * (ring - 1) as f64, width_mm * ring as f64);
        // Rounding must not push the last ring beyond the cylinder.
        let r1 = r1.min(base.reach_mm());
        Self { inner: [r0, base.height_at(r0)], outer: [r1, base.height_at(r1)] }
    }

    /// Length, mm.
    pub fn length_mm(&self) -> f64 {
        (self.outer[0] - self.inner[0]).hypot(self.outer[1] - self.inner[1])
    }

    /// Inclination against the horizontal, radians; positive where the dome falls outwards.
    pub fn slope(&self) -> f64 {
        (self.inner[1] - self.outer[1]).atan2(self.outer[0] - self.inner[0])
    }

    /// (r, z) of the point `along` the chord and `above` it, both mm.
    pub fn point(&self, along: f64, above: f64) -> [f64; 2] {
        // t = (cos s, -sin s) outward and down, n = (sin s, cos s).
        let (sin, cos) = self.slope().sin_cos();
        [self.inner[0] + along * cos + above * sin, self.inner[1] - along * sin + above * cos]
    }
}

/// Vertices of `shape` between the base corners of `chord`: (along, above), mm. Empty for a smooth
/// element.
pub fn vertices(shape: &Shape, chord: &Chord) -> Vec<[f64; 2]> {
    let length = chord.length_mm();
    match shape {
        Shape::Smooth => Vec::new(),
        Shape::Os1 => {
            // Horizontal tread: at the inner corner the angle between tread and chord is the slope.
            let (sin, cos) = chord.slope().sin_cos();
            let tread = length * cos;
            if sin > 0.0 { vec![[tread * cos, tread * sin]] } else { Vec::new() }
        }
        Shape::Triangle { inner_base_deg, apex_deg, reference } => {
            // The chord falls outwards by its slope, so that a side makes as much more with it than
            // with the horizontal.
            let turn = match reference {
                Reference::Chord => 0.0,
                Reference::Horizontal => chord.slope(),
            };
            // Law of sines: |inner corner, apex| = chord · sin γ / sin β, γ at the outer corner.
            let (alpha, beta) = (inner_base_deg.to_radians() + turn, apex_deg.to_radians());
            let side = length * (alpha + beta).sin() / beta.sin();
            vec![[side * alpha.cos(), side * alpha.sin()]]
        }
        Shape::Polyline(points) => points.iter().map(|p| [p[0] * length, p[1] * length]).collect(),
    }
}

/// The cell of ring `ring` (from 1), or `None` where the ring is smooth.
///
/// # Errors
/// Radii of corners that do not fit.
pub fn ring_cell<'a>(
    base: impl Into<BaseSurface<'a>>,
    rings: &Elements,
    ring: usize,
    index: f64,
) -> Result<Option<Cell>, GeometryError> {
    let chord = Chord::of(base, rings.width_mm, ring);
    let vertices = vertices(&rings.shapes[ring - 1], &chord);
    Cell::standing_on(&chord, &vertices, rings.rounding, (ring, index))
}
