// SPDX-License-Identifier: MIT OR Apache-2.0
//! The lights of a design: which sources shine in which spectrum, and what each of them emits in
//! watts and in lumens.

use serde::Serialize;

use super::rays::ColouredRays;
use super::{Sampling, SpectralPower, Spectrum, Weighting};

/// Light of one kind, from sources that share it.
#[derive(Debug, Clone, Serialize)]
pub struct Light {
    /// Names of the sources.
    pub sources: Vec<String>,
    /// Their numbers among all that a package has for the tracer.
    #[serde(skip)]
    pub emitters: Vec<usize>,
    /// Radiant power of them all, W; that of all lights together is 1 W.
    pub emitted_w: f64,
    /// Luminous flux of them all, lm.
    pub emitted_lm: f64,
    /// Content.
    pub light: Colour,
}

/// Origin of the wavelengths of a light.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Colour {
    /// A spectrum that all places and directions share.
    Spectrum(Spectrum),
    /// Rays of a file.
    Rays(ColouredRays),
}

/// All lights of a design.
#[derive(Debug, Clone, Serialize)]
pub struct Lights {
    /// Weighting of far fields, maps and figures.
    pub weighting: Weighting,
    /// At least one.
    pub lights: Vec<Light>,
    /// True if each is traced by itself, the sources of the others being dark.
    #[serde(skip)]
    pub apart: bool,
    /// True if any of them differs from the light of the design.
    #[serde(skip)]
    pub coloured: bool,
}

impl Lights {
    /// All sources in one spectrum.
    pub fn together(spectrum: &Spectrum) -> Self {
        Self {
            weighting: spectrum.weighting,
            lights: vec![Light {
                sources: Vec::new(),
                emitters: Vec::new(),
                emitted_w: 1.0,
                emitted_lm: spectrum.luminous_efficacy_lm_per_w,
                light: Colour::Spectrum(spectrum.clone()),
            }],
            apart: false,
            coloured: false,
        }
    }

    /// True if all light has one wavelength, or stands for others by a single one, so that it has no
    /// colour.
    pub fn is_one_wavelength(&self) -> bool {
        let is_one = |spectrum: &Spectrum| {
            spectrum.is_line() || spectrum.sampling == Some(Sampling::Samples(1))
        };
        matches!(&self.lights[..], [light] if light.light.spectrum().is_some_and(is_one))
    }

    /// One light for each colour, with the numbers of those that it stands for.
    pub fn by_colour(&self) -> Vec<(Light, Vec<usize>)> {
        let mut colours: Vec<(Light, Vec<usize>)> = Vec::new();
        for (number, light) in self.lights.iter().enumerate() {
            match colours.iter_mut().find(|(all, _)| all.light.is(&light.light)) {
                Some((all, numbers)) => {
                    all.sources.extend_from_slice(&light.sources);
                    all.emitters.extend_from_slice(&light.emitters);
                    all.emitted_w += light.emitted_w;
                    all.emitted_lm += light.emitted_lm;
                    numbers.push(number);
                }
                None => colours.push((light.clone(), vec![number])),
            }
        }
        colours
    }

    /// The same weighted by radiant power.
    #[must_use]
    pub fn radiometric(&self) -> Self {
        let mut lights = self.lights.clone();
        for light in &mut lights {
            light.light = match &light.light {
                Colour::Spectrum(spectrum) => Colour::Spectrum(spectrum.radiometric()),
                Colour::Rays(rays) => Colour::Rays(rays.radiometric()),
            };
        }
        Self { weighting: Weighting::Radiometric, lights, ..self.clone() }
    }

    /// Luminous flux of all sources together, which emit 1 W, lm.
    pub fn emitted_lm(&self) -> f64 {
        self.lights.iter().map(|light| light.emitted_lm).sum()
    }

    /// The share that a light has of the flux of all, weighted; 0 of nothing.
    pub fn share(&self, light: &Light, weighting: Weighting) -> f64 {
        let (part, whole) = match weighting {
            Weighting::Radiometric => (light.emitted_w, 1.0),
            Weighting::Photometric => (light.emitted_lm, self.emitted_lm()),
        };
        if self.lights.len() == 1 {
            1.0
        } else if whole > 0.0 {
            part / whole
        } else {
            0.0
        }
    }
}

impl Colour {
    /// True if two lights are one. Rays of files are each their own.
    pub fn is(&self, other: &Self) -> bool {
        self.spectrum().is_some_and(|own| Some(own) == other.spectrum())
    }

    /// The spectrum of all places and directions, if there is one.
    pub fn spectrum(&self) -> Option<&Spectrum> {
        match self {
            Self::Spectrum(spectrum) => Some(spectrum),
            Self::Rays(_) => None,
        }
    }

    /// Sampling; `None` where every wavelength is computed.
    pub fn sampling(&self) -> Option<Sampling> {
        match self {
            Self::Spectrum(spectrum) => spectrum.sampling,
            Self::Rays(rays) => rays.sampling,
        }
    }

    /// Lumens per watt.
    pub fn efficacy(&self) -> f64 {
        match self {
            Self::Spectrum(spectrum) => spectrum.luminous_efficacy_lm_per_w,
            Self::Rays(rays) => rays.luminous_efficacy_lm_per_w,
        }
    }

    /// First and last wavelength with power, nm.
    pub fn range_nm(&self) -> [f64; 2] {
        match self {
            Self::Spectrum(spectrum) => spectrum.range_nm,
            Self::Rays(rays) => rays.range_nm,
        }
    }

    /// Wavelengths (nm, ascending) and weights (adding up to 1) with `count` points where it is
    /// sampled.
    pub fn rule(&self, count: usize) -> Vec<(f64, f64)> {
        match self {
            Self::Spectrum(spectrum) => spectrum.rule(count),
            Self::Rays(rays) => {
                let nodes = rays.nodes(count);
                let weights = rays.weights(&nodes, rays.weighting);
                nodes.into_iter().zip(weights).collect()
            }
        }
    }

    /// The wavelength with half of the weighted power on either side, nm.
    pub fn median_nm(&self) -> f64 {
        match self {
            Self::Spectrum(spectrum) => spectrum.median_nm(),
            Self::Rays(rays) => rays.median_nm(),
        }
    }

    /// The shares of the flux, in any weighting, that wavelengths of a rule stand for.
    pub fn weights(&self, nodes: &[f64], weighting: Weighting) -> Vec<f64> {
        match self {
            Self::Spectrum(spectrum) => spectrum.weights(nodes, weighting),
            Self::Rays(rays) => rays.weights(nodes, weighting),
        }
    }

    /// As [`Spectrum::seen_through`].
    pub fn seen_through(&self, nodes: &[f64], filter: &dyn Fn(f64) -> f64) -> Vec<[f64; 3]> {
        match self {
            Self::Spectrum(spectrum) => spectrum.seen_through(nodes, filter),
            Self::Rays(rays) => rays.seen_through(nodes, filter),
        }
    }

    /// True if visible light passes a filter.
    pub fn passes(&self, filter: &dyn Fn(f64) -> f64) -> bool {
        self.seen_through(&[self.median_nm()], filter)[0].iter().sum::<f64>() > 0.0
    }

    /// One line for people.
    pub fn describe(&self) -> String {
        match self {
            Self::Spectrum(spectrum) => match spectrum.source {
                SpectralPower::Lines { .. } if spectrum.rule(1).len() == 1 => {
                    let [nm, _] = spectrum.range_nm;
                    format!("{nm} nm, {:.1} lm/W", self.efficacy())
                }
                _ => spectrum.describe(),
            },
            Self::Rays(rays) => rays.describe(),
        }
    }
}
