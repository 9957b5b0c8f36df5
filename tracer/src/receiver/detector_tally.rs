// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fills the bins of detectors while it looks on at the paths of a group.

use bsdf::Side;
use glam::DVec3;

use super::detector::{Detector, Filter, Measurement, STOKES, lines};
use crate::observer::{Fate, Interaction, Observer};
use crate::optics::polarization::Stokes;
use crate::ray::Ray;
use crate::scene::Scene;

/// A detector with names replaced by lines of the ledger.
struct Ready<'a> {
    detector: &'a Detector,
    /// Lines of the last surface that the filter asks for.
    last: Option<Vec<usize>>,
    /// Lines of the surfaces whose flux is read.
    flux: Vec<usize>,
}

/// Where the light of a path has been.
#[derive(Clone, Copy)]
struct Past {
    source: usize,
    bounces: u32,
    /// Line of the last surface, and the distance of the interaction from the axis of its body, mm.
    last: Option<(usize, f64)>,
}

impl Past {
    fn passes(&self, filter: &Filter, lines: Option<&[usize]>) -> bool {
        let [least, most] = filter.bounces;
        let of_last = |test: &dyn Fn(usize, f64) -> bool| {
            self.last.is_some_and(|(line, radius)| test(line, radius))
        };
        (least..=most).contains(&self.bounces)
            && lines.is_none_or(|lines| of_last(&|line, _| lines.contains(&line)))
            && filter
                .last_radii_mm
                .is_none_or(|[low, high]| of_last(&|_, radius| radius > low && radius <= high))
            && filter
                .sources
                .as_ref()
                .is_none_or(|sources| sources.contains(&self.source))
    }
}

/// The sums of all detectors for one group of paths.
pub(crate) struct DetectorTally<'a> {
    scene: &'a Scene,
    detectors: Vec<Ready<'a>>,
    readings: Vec<Vec<f64>>,
    past: Past,
    /// Where the flight under way began, and with which weight.
    start: DVec3,
    weight: f64,
    /// Its polarisation.
    light: Stokes,
    /// What was before the path divided.
    divided: (Past, DVec3, Stokes),
}

/// Adds a reading of light along `direction` to a bin; `axis` × direction is s.
#[inline]
fn read(
    detector: &Detector,
    bins: &mut [f64],
    bin: usize,
    (weight, light, direction): (f64, &Stokes, DVec3),
    axis: DVec3,
) {
    bins[bin] += weight;
    if !detector.stokes {
        return;
    }
    let s = axis.cross(direction);
    let s = s
        .try_normalize()
        .unwrap_or_else(|| direction.any_orthonormal_vector());
    let light = light.turned(direction, s);
    let places = bins.len() / STOKES.len();
    for (number, parameter) in (1..).zip([light.q, light.u, light.v]) {
        bins[number * places + bin] += weight * parameter;
    }
}

impl<'a> DetectorTally<'a> {
    /// Of detectors that fit the scene.
    pub fn new(scene: &'a Scene, detectors: &'a [Detector]) -> Self {
        let ready = |detector: &'a Detector| Ready {
            last: detector
                .filter
                .last_surface
                .as_ref()
                .map(|name| lines(&scene.lines, name)),
            flux: match &detector.measurement {
                Measurement::Flux(name) => lines(&scene.lines, name),
                Measurement::Plane(_) | Measurement::FarField(_) | Measurement::Luminance(..) => {
                    Vec::new()
                }
            },
            detector,
        };
        let past = Past {
            source: 0,
            bounces: 0,
            last: None,
        };
        Self {
            scene,
            detectors: detectors.iter().map(ready).collect(),
            readings: Self::empty(detectors),
            past,
            start: DVec3::ZERO,
            weight: 0.0,
            light: Stokes::default(),
            divided: (past, DVec3::ZERO, Stokes::default()),
        }
    }

    /// Bins without light.
    pub fn empty(detectors: &[Detector]) -> Vec<Vec<f64>> {
        detectors.iter().map(|d| vec![0.0; d.bins()]).collect()
    }

    /// The sums, times `scale`.
    pub fn close(self, scale: f64) -> impl Iterator<Item = Vec<f64>> {
        self.readings.into_iter().map(move |mut bins| {
            for power in &mut bins {
                *power *= scale;
            }
            bins
        })
    }

    /// Calls `read` for every detector that reads this light, with its bins.
    fn show(&mut self, mut read: impl FnMut(&Ready<'_>, &mut [f64])) {
        for (ready, bins) in self.detectors.iter().zip(&mut self.readings) {
            if self
                .past
                .passes(&ready.detector.filter, ready.last.as_deref())
            {
                read(ready, bins);
            }
        }
    }

    /// A flight of `length` mm; rectangles lie where no body is.
    fn flies(&mut self, direction: DVec3, length: f64) {
        let (weight, light) = (self.weight, self.light);
        let seen = (weight, &light, direction);
        let ray = Ray {
            origin: self.start,
            direction,
        };
        self.show(|ready, bins| match &ready.detector.measurement {
            Measurement::Plane(rectangle) => {
                if let Some(passage) = rectangle.passed(&ray, length) {
                    read(ready.detector, bins, passage.bin, seen, rectangle.axes()[1]);
                }
            }
            Measurement::Luminance(rectangle, angles) => {
                if let Some(passage) = rectangle.passed(&ray, length)
                    && let Some(bin) = angles.bin(passage.direction)
                {
                    let bin = passage.bin * angles.bins() + bin;
                    read(ready.detector, bins, bin, seen, rectangle.axes()[2]);
                }
            }
            Measurement::FarField(_) | Measurement::Flux(_) => {}
        });
    }
}

impl Observer for DetectorTally<'_> {
    fn chooses(&mut self, source: usize) {
        self.past.source = source;
    }

    fn begins(&mut self, ray: &Ray) {
        (self.past.bounces, self.past.last) = (0, None);
        (self.start, self.weight) = (ray.origin, 1.0);
        self.light = Stokes::default();
    }

    fn divides(&mut self, first: bool, weight: f64) {
        if first {
            self.divided = (self.past, self.start, self.light);
        }
        (self.past, self.start, self.light) = self.divided;
        self.weight = weight;
    }

    fn meets(&mut self, interaction: &Interaction) {
        self.flies(
            interaction.direction,
            (interaction.point - self.start).length(),
        );
        let first = match interaction.from {
            Side::Inner => 0,
            Side::Outer => 3,
        };
        self.show(|ready, bins| {
            if ready.flux.contains(&interaction.line) {
                bins[first] += interaction.arrived;
                bins[first + 1] += interaction.arrived - interaction.weight;
                if interaction.from != interaction.to {
                    bins[first + 2] += interaction.weight;
                }
            }
        });
        let local = interaction.point - self.scene.position(interaction.instance);
        self.past.last = Some((interaction.line, local.x.hypot(local.y)));
        self.past.bounces += 1;
        (self.start, self.weight) = (interaction.point, interaction.weight);
    }

    fn carries(&mut self, light: &Stokes) {
        self.light = *light;
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, weight: f64) {
        if !matches!(fate, Fate::EscapedUp | Fate::EscapedDown) {
            return;
        }
        self.flies(ray.direction, f64::INFINITY);
        let light = self.light;
        let seen = (weight, &light, ray.direction);
        let direction = ray.direction.to_array();
        self.show(|ready, bins| {
            if let Measurement::FarField(angles) = &ready.detector.measurement
                && let Some(bin) = angles.bin(direction)
            {
                read(ready.detector, bins, bin, seen, DVec3::Z);
            }
        });
    }
}
