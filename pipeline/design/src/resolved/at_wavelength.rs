// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design at one wavelength, or in one of its lights at one wavelength: what a trace sees of it.

use std::borrow::Cow;
use std::sync::Arc;

use serde::Serialize;

use super::films::Films;
use super::panel::SubPixel;
use super::sources::{CheckedSource, ONE_CHANNEL};
use super::{Design, medium};
use crate::check::Context;
use crate::error::ConfigError;
use crate::spectrum::Spectrum;
use crate::spectrum::lights::{Colour, Light, Lights};
use metrics::kinds::Weighting;

/// One of the lights of a design at one of its wavelengths, all other sources being dark.
#[derive(Debug, Clone, Serialize)]
pub struct LitSources {
    /// Names of the sources that shine.
    pub sources: Vec<String>,
    /// The wavelengths that the rays of a file are shared by, nm; of other sources none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shared_by_nm: Vec<f64>,
}

impl Design {
    /// The same design in monochromatic light of this wavelength; material files give index and
    /// absorption of silicone and solids, and indices of layers, there.
    ///
    /// # Errors
    /// A wavelength at which a material has no data. Within the range of the design's spectrum
    /// there are none.
    pub fn at(&self, wavelength_nm: f64) -> Result<Self, ConfigError> {
        Ok(Self { spectrum: None, lights: None, ..self.tuned(wavelength_nm)? })
    }

    /// The same design with one of its lights alone, at a wavelength of `nodes`, those that stand
    /// for it; the other sources are dark.
    ///
    /// # Errors
    /// Those of [`Self::at`], and a wavelength at which no ray has flux.
    pub fn lit_by(&self, light: &Light, nodes: &[f64], node: usize) -> anyhow::Result<Self> {
        let mut design = self.at(nodes[node])?;
        let mut shared_by_nm = Vec::new();
        for (number, (weight, emission)) in design.emitters_mut().enumerate() {
            if !light.emitters.contains(&number) {
                *weight = 0.0;
            } else if let Colour::Rays(rays) = &light.light {
                let rays = rays.at(nodes, node)?;
                let placed = match &*emission {
                    tracer::Emission::Rays(all) => rays.placed_as(all),
                    _ => rays,
                };
                *emission = tracer::Emission::Rays(Arc::new(placed));
                shared_by_nm = nodes.to_vec();
            }
        }
        design.lit = Some(LitSources { sources: light.sources.clone(), shared_by_nm });
        Ok(design)
    }

    /// The lights of all sources where they are more than one wavelength of the design: a spectrum,
    /// or what the sources state; or where every source is to have a ledger of its own. None where
    /// a medium converts light: all wavelengths are then one trace.
    pub fn all_lights(&self) -> Option<Cow<'_, Lights>> {
        if self.converts() {
            return None;
        }
        let together = || self.spectrum.as_ref().map(Lights::together).map(Cow::Owned);
        self.lights.as_ref().map(Cow::Borrowed).or_else(together)
    }

    /// The lights of all sources, of a single wavelength too.
    ///
    /// # Panics
    /// Never: the wavelength of a design is checked.
    pub fn colour_lights(&self) -> Lights {
        let line = || {
            let line = Spectrum::line(self.wavelength_nm, Weighting::Radiometric);
            Lights::together(&line.expect("a checked wavelength"))
        };
        let together = || self.spectrum.as_ref().map(Lights::together);
        self.lights.clone().or_else(together).unwrap_or_else(line)
    }

    /// Channels of the sources in the order of the design.
    pub fn channels(&self) -> Vec<&str> {
        let mut channels: Vec<&str> = Vec::new();
        for source in &self.sources {
            if !channels.contains(&source.channel()) {
                channels.push(source.channel());
            }
        }
        if channels.is_empty() { vec![ONE_CHANNEL] } else { channels }
    }

    /// Sub-pixels of the panel; none without one, or without filters of its own.
    pub fn sub_pixels(&self) -> &[SubPixel] {
        self.panel.as_ref().map_or(&[], |panel| &panel.sub_pixels)
    }

    /// X, Y and Z that each of `nodes` stands for in all of a light: open, then behind each sub-pixel.
    pub fn seen_by_panel(&self, light: &Light, nodes: &[f64]) -> Vec<Vec<[f64; 3]>> {
        let through = |filter: &dyn Fn(f64) -> f64| light.light.seen_through(nodes, filter);
        let behind = self.sub_pixels().iter().map(|sub_pixel| through(&|nm| sub_pixel.at(nm)));
        let all: Vec<_> = std::iter::once(through(&|_| 1.0)).chain(behind).collect();
        let of_node =
            |k: usize| all.iter().map(|xyz| xyz[k].map(|v| v * light.emitted_w)).collect();
        (0..nodes.len()).map(of_node).collect()
    }

    /// Number among [`Self::channels`] of the channel of a light.
    pub fn channel_of(&self, light: &Light) -> usize {
        let name = light.sources.first();
        let source = self.sources.iter().find(|source| Some(source.name()) == name.map(|n| &**n));
        let channel = source.map(CheckedSource::channel);
        self.channels().iter().position(|known| Some(*known) == channel).unwrap_or(0)
    }

    /// The same design with the sources of one channel alone, all others being dark.
    #[must_use]
    pub fn lit_by_channel(&self, channel: usize) -> Self {
        if self.channels().len() < 2 {
            return self.clone();
        }
        let lights = self.colour_lights().lights;
        let lit = || lights.iter().filter(|light| self.channel_of(light) == channel);
        let emitters: Vec<usize> = lit().flat_map(|light| light.emitters.clone()).collect();
        let mut design = self.clone();
        let dark = |(number, _): &(usize, _)| !emitters.contains(number);
        design.emitters_mut().enumerate().filter(dark).for_each(|(_, (weight, _))| *weight = 0.0);
        let sources = lit().flat_map(|light| light.sources.clone()).collect();
        design.lit = Some(LitSources { sources, shared_by_nm: Vec::new() });
        design
    }

    /// Weight and emission of each source of a package.
    fn emitters_mut(&mut self) -> impl Iterator<Item = (&mut f64, &mut tracer::Emission)> {
        let of_sources = self.sources.iter_mut().flat_map(|s| &mut s.emitters);
        let of_sources = of_sources.map(|emitter| &mut emitter.source);
        let of_sources = of_sources.map(|source| (&mut source.weight, &mut source.emission));
        let of_file = self.files.source.iter_mut().flat_map(|source| &mut source.parts);
        of_sources.chain(of_file.map(|part| (&mut part.share, &mut part.emission)))
    }

    /// The colours of the sources, unless that of the design is the only one.
    pub fn colours(&self) -> Option<Lights> {
        let lights = self.lights.as_ref().filter(|lights| lights.coloured)?;
        let colours = lights.by_colour().into_iter().map(|(light, _)| light);
        Some(Lights { lights: colours.collect(), ..lights.clone() })
    }

    /// [`Self::at`], with the spectrum.
    pub(crate) fn tuned(&self, wavelength_nm: f64) -> Result<Self, ConfigError> {
        let at = Context::new(&self.provenance.file);
        let films = self.films.as_ref();
        let solids = self.solids.iter().map(|solid| solid.tuned(wavelength_nm, &at));
        Ok(Self {
            wavelength_nm,
            silicone: medium::medium_at(&self.silicone.stated, wavelength_nm, &at)?,
            films: films.map(|of| Films::new(&of.stated, wavelength_nm, &at)).transpose()?,
            solids: solids.collect::<Result<_, _>>()?,
            ..self.clone()
        })
    }
}
