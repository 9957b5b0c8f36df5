// SPDX-License-Identifier: MIT OR Apache-2.0
//! Detectors: irradiance, intensity, radiance and flux on surfaces, of all light or of the part
//! that a filter lets pass.

use glam::DVec3;

use super::filter::{lines_named, underscored};
use super::ray_buffer::{Bins, RayBuffer};
use super::{Angles, DetectorRectangle, Filter, Needs, Receiver, bin_each};
use crate::error::Error;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::shape::Bounds;

/// Light that a detector looks at.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurement {
    /// Light that passes a rectangle in the air: irradiance by place.
    Plane(DetectorRectangle),
    /// Light that leaves the scene for good: intensity by direction, the polar axis along +z.
    FarField(Angles),
    /// Light that passes a rectangle in the air by place and direction: radiance. Polar angles are
    /// those to the normal, azimuths go from u to v; or both about a view. Bin number = bin of the
    /// place · number of directions + bin of the direction.
    Luminance(DetectorRectangle, Angles),
    /// Light that meets the surfaces of this name in the ledger, in words or with underscores
    /// between them: bins as [`FLUX_BINS`] names them.
    Flux(String),
}

/// Bins of [`Measurement::Flux`]: of the power that comes from the inner side what comes, what is
/// absorbed and what goes through; then the same of the outer side. The rest is sent back.
pub const FLUX_BINS: [&str; 6] = [
    "from_inside",
    "from_inside_absorbed",
    "from_inside_passed",
    "from_outside",
    "from_outside_absorbed",
    "from_outside_passed",
];

/// A measurement behind a filter.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    /// Name, for messages.
    pub name: String,
    /// Light that it looks at.
    pub measurement: Measurement,
    /// Filter of the light that it reads.
    pub filter: Filter,
    /// True if it reads I, Q, U and V, as [`Detector::stokes`] says, and not the power alone.
    pub stokes: bool,
}

/// Names of what [`Detector::stokes`] reads, in the order of its bins.
pub const STOKES: [&str; 4] = ["I", "Q", "U", "V"];

impl Detector {
    /// A detector of all light.
    pub fn new(name: impl Into<String>, measurement: Measurement) -> Self {
        Self { name: name.into(), measurement, filter: Filter::default(), stokes: false }
    }

    /// The same, with the Stokes parameters of the light: all bins of I (the power), then those of
    /// Q, of U and of V, in watts. Fluxes on surfaces stay as they are.
    ///
    /// s, to which Q and U refer, is at right angles to the light's direction k, and p = s × k
    /// (`docs/explanation/conventions.md`). Far field: s = z × k, level. Radiance: s = n × k with
    /// the normal n of the rectangle. A rectangle by place: s = v × k, along u for light along the
    /// normal. In either sense of s.
    #[must_use]
    pub fn stokes(mut self) -> Self {
        self.stokes = !matches!(self.measurement, Measurement::Flux(_));
        self
    }

    /// Number of readings in a bin: 4 for Stokes parameters.
    pub fn parameters(&self) -> usize {
        if self.stokes { STOKES.len() } else { 1 }
    }

    /// The same with a filter.
    #[must_use]
    pub fn filtered(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    /// Number of bins, those of all parameters together.
    pub fn bins(&self) -> usize {
        self.parameters() * self.places()
    }

    /// Number of bins of each parameter.
    pub fn places(&self) -> usize {
        match &self.measurement {
            Measurement::Plane(rectangle) => rectangle.bins().iter().product(),
            Measurement::FarField(angles) => angles.bins(),
            Measurement::Luminance(rectangle, angles) => {
                rectangle.bins().iter().product::<usize>() * angles.bins()
            }
            Measurement::Flux(_) => FLUX_BINS.len(),
        }
    }

    /// Divisor of the power in every bin: mm² for irradiance, sr for intensity, mm² sr for
    /// radiance, 1 for flux.
    pub fn measures(&self) -> Vec<f64> {
        let spread = |rows: Vec<f64>, phis: usize| -> Vec<f64> {
            rows.iter().flat_map(|row| std::iter::repeat_n(*row, phis)).collect()
        };
        let of_each = match &self.measurement {
            Measurement::Plane(rectangle) => vec![rectangle.bin_mm2(); self.places()],
            Measurement::FarField(angles) => spread(angles.solid_angles(), angles.phis()),
            Measurement::Luminance(rectangle, angles) => {
                let directions = angles.projected_solid_angles();
                let places = rectangle.bins().iter().product();
                let scaled: Vec<f64> = directions.iter().map(|d| d * rectangle.bin_mm2()).collect();
                scaled.repeat(places)
            }
            Measurement::Flux(_) => vec![1.0; FLUX_BINS.len()],
        };
        of_each.repeat(self.parameters())
    }

    fn clear(&self, rectangle: &DetectorRectangle, scene: &Scene) -> Result<(), Error> {
        let Bounds { low, high } = rectangle.bounds();
        // Touching is no cutting, also where positions are rounded.
        let slack = 1e-9 * (high - low).max_element();
        for Bounds { low: from, high: to } in scene.filled() {
            if (from + slack).cmplt(high).all() && (to - slack).cmpgt(low).all() {
                return Err(Error::ReceiverCuts {
                    receiver: self.name.clone(),
                    low_mm: from.to_array(),
                    high_mm: to.to_array(),
                });
            }
        }
        rectangle.stands_alone(&self.name, scene)
    }
}

impl Receiver for Detector {
    fn bins(&self) -> usize {
        Self::bins(self)
    }

    fn needs(&self) -> Needs<'_> {
        match &self.measurement {
            Measurement::Plane(_) | Measurement::Luminance(..) => Needs::Segments,
            Measurement::FarField(_) => Needs::Escapes,
            Measurement::Flux(name) => Needs::Surface(name),
        }
    }

    fn bin(&self, ray: &Ray, length: f64) -> Option<usize> {
        match &self.measurement {
            Measurement::Plane(rectangle) => Some(rectangle.crossing(ray, length)?.bin),
            Measurement::FarField(angles) => {
                (length == f64::INFINITY).then(|| angles.bin(ray.direction.to_array())).flatten()
            }
            Measurement::Luminance(rectangle, angles) => {
                let crossing = rectangle.crossing(ray, length)?;
                Some(crossing.bin * angles.bins() + angles.bin(crossing.direction)?)
            }
            Measurement::Flux(_) => None,
        }
    }

    fn bin_many(&self, rays: &RayBuffer, bins: &mut Bins) {
        match &self.measurement {
            Measurement::Plane(rectangle) => rectangle.bin_many(rays, bins),
            _ => bin_each(self, rays, bins),
        }
    }

    fn filter(&self) -> Option<&Filter> {
        (self.filter != Filter::default()).then_some(&self.filter)
    }

    fn stokes_axis(&self) -> Option<DVec3> {
        let axis = match &self.measurement {
            Measurement::Plane(rectangle) => rectangle.axes()[1],
            Measurement::Luminance(rectangle, _) => rectangle.axes()[2],
            Measurement::FarField(_) | Measurement::Flux(_) => DVec3::Z,
        };
        self.stokes.then_some(axis)
    }

    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let named = [
            self.filter.last_surface.as_ref(),
            match &self.measurement {
                Measurement::Flux(name) => Some(name),
                Measurement::Plane(_) | Measurement::FarField(_) | Measurement::Luminance(..) => {
                    None
                }
            },
        ];
        for name in named.into_iter().flatten() {
            if lines_named(&scene.lines, name).is_empty() {
                let mut known: Vec<String> = Vec::new();
                for line in &scene.lines.surfaces {
                    let line = underscored(line);
                    if !known.contains(&line) {
                        known.push(line);
                    }
                }
                return Err(Error::NoSurface {
                    receiver: self.name.clone(),
                    surface: name.clone(),
                    known: known.join(", "),
                });
            }
        }
        let sources = scene.sources.len();
        for source in self.filter.sources.iter().flatten() {
            if *source >= sources {
                return Err(Error::NoSuchSource {
                    receiver: self.name.clone(),
                    source_number: source + 1,
                    sources,
                });
            }
        }
        match &self.measurement {
            Measurement::Plane(rectangle) | Measurement::Luminance(rectangle, _) => {
                self.clear(rectangle, scene)
            }
            Measurement::FarField(_) | Measurement::Flux(_) => Ok(()),
        }
    }
}
