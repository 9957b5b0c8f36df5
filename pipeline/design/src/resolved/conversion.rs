// SPDX-License-Identifier: MIT OR Apache-2.0
//! Designs in which a medium converts light: all wavelengths are one trace.
//!
//! Light is traced at whole multiples of `light.step_nm` that hold the ranges of all spectra, and at
//! the lines of the sources. Power between two of these wavelengths belongs to both, by nearness, so
//! that means over the wavelength are kept.

use std::borrow::Cow;

use super::Design;
use super::luminescence::{MediumLuminophore, StatedLuminophore};
use super::medium::Medium;
use crate::error::ConfigError;
use crate::spectrum::lights::{Colour, Light, Lights};
use crate::spectrum::{SpectralPower, Spectrum};
use metrics::kinds::Weighting;

impl Design {
    /// True if a medium converts light to other wavelengths.
    pub fn converts(&self) -> bool {
        self.luminophores().next().is_some()
    }

    /// Substances of all media, those of the silicone first.
    pub fn luminophores(&self) -> impl Iterator<Item = &MediumLuminophore> {
        self.media().flat_map(|medium| &medium.luminophores)
    }

    /// What each luminophore emits, as lights without power of their own.
    pub(crate) fn converted_lights(&self) -> impl Iterator<Item = Light> {
        let stated = self.media().flat_map(|medium| &medium.stated.luminophores);
        stated.map(|luminophore| Light {
            sources: vec![luminophore.name.clone()],
            emitters: Vec::new(),
            emitted_w: 0.0,
            emitted_lm: 0.0,
            light: Colour::Spectrum(luminophore.emission.clone()),
        })
    }

    fn media(&self) -> impl Iterator<Item = &Medium> {
        let of_solids = self.solids.iter().filter_map(|solid| solid.medium.as_ref());
        std::iter::once(&self.silicone).chain(of_solids)
    }

    /// Spectra of the sources, by the numbers of the sources of a package; a single one for all.
    fn source_spectra(&self) -> Vec<Spectrum> {
        let own = || {
            let line = || Spectrum::line(self.wavelength_nm, Weighting::Radiometric);
            self.spectrum.clone().unwrap_or_else(|| line().expect("a checked wavelength"))
        };
        let Some(Lights { lights, .. }) = &self.lights else { return vec![own()] };
        let count = lights.iter().map(|light| light.emitters.len()).sum();
        let mut spectra: Vec<Option<Spectrum>> = vec![None; count];
        for light in lights {
            for number in &light.emitters {
                spectra[*number] = light.light.spectrum().cloned();
            }
        }
        spectra.into_iter().map(|spectrum| spectrum.unwrap_or_else(own)).collect()
    }

    /// Wavelengths of a trace of all light, nm, ascending.
    pub fn traced_nm(&self) -> Vec<f64> {
        let mut nodes = Vec::new();
        let stated = self.media().flat_map(|medium| &medium.stated.luminophores);
        let emissions = stated.map(|luminophore| luminophore.emission.clone());
        for spectrum in self.source_spectra().into_iter().chain(emissions) {
            if let SpectralPower::Lines { wavelength_nm, .. } = &spectrum.source {
                nodes.extend_from_slice(wavelength_nm);
                continue;
            }
            let [low, high] = spectrum.range_nm.map(|nm| nm / self.step_nm);
            // The ends hold the range between them: none of its power belongs to other light.
            let steps = low.floor() as u64..=high.ceil() as u64;
            nodes.extend(steps.map(|k| k as f64 * self.step_nm));
        }
        nodes.sort_by(f64::total_cmp);
        nodes.dedup();
        nodes
    }

    /// The design at one of `nodes`, the wavelengths of a trace of all light.
    ///
    /// # Errors
    /// A wavelength at which a material has no data.
    pub fn converting_at(&self, nodes: &[f64], node: usize) -> Result<Self, ConfigError> {
        let mut design = self.tuned(nodes[node])?;
        design.silicone.luminesce(nodes, node);
        for solid in &mut design.solids {
            if let Some(medium) = &mut solid.medium {
                medium.luminesce(nodes, node);
            }
        }
        Ok(design)
    }

    /// Wavelengths at which rings are solved, nm: that of the design, or several where a medium
    /// converts light.
    pub fn tables_nm(&self) -> Vec<f64> {
        if !self.converts() {
            return vec![self.wavelength_nm];
        }
        if let Some(stated) = &self.hybrid.tables_nm {
            return stated.clone();
        }
        let sources = self.source_spectra().into_iter().map(|spectrum| spectrum.median_nm());
        let stated = self.media().flat_map(|medium| &medium.stated.luminophores);
        let emissions = stated.map(|luminophore| luminophore.emission.median_nm());
        let mut all: Vec<f64> = sources.chain(emissions).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// The design at each wavelength at which rings are solved.
    ///
    /// # Panics
    /// Of a design that was not checked.
    pub fn at_tables(&self) -> Vec<Cow<'_, Self>> {
        if !self.converts() {
            return vec![Cow::Borrowed(self)];
        }
        let tuned = |nm| Cow::Owned(self.tuned(nm).expect("a checked wavelength"));
        self.tables_nm().into_iter().map(tuned).collect()
    }

    /// Shares of the power of each source of a package at `nodes`; a single row for all alike.
    pub fn emitted_at(&self, nodes: &[f64]) -> Vec<Vec<f64>> {
        let spectra = self.source_spectra().into_iter();
        spectra.map(|spectrum| spectrum.weights(nodes, Weighting::Radiometric)).collect()
    }

    /// For each luminophore, those of the silicone first, the number of the shortest wavelength of
    /// `nodes` at which it absorbs light, of the sources or of others that this excites; `None` of one
    /// that no light reaches.
    pub(crate) fn excited(&self, nodes: &[f64]) -> Vec<(&StatedLuminophore, Option<usize>)> {
        let sources = self.emitted_at(nodes);
        let is_lit = |node: usize| sources.iter().any(|shares| shares[node] > 0.0);
        let mut lit: Vec<bool> = (0..nodes.len()).map(is_lit).collect();
        let stated: Vec<&StatedLuminophore> =
            self.media().flat_map(|medium| &medium.stated.luminophores).collect();
        loop {
            let absorbs = |of: &&StatedLuminophore| {
                (0..nodes.len()).find(|&k| lit[k] && of.absorption_at(nodes[k]) > 0.0)
            };
            let first: Vec<Option<usize>> = stated.iter().map(absorbs).collect();
            let before = lit.clone();
            for (of, first) in stated.iter().zip(&first) {
                let emitted = first.map_or_else(Vec::new, |first| of.photons(nodes, first));
                lit.iter_mut().zip(emitted).for_each(|(lit, photons)| *lit |= photons > 0.0);
            }
            if lit == before {
                return stated.into_iter().zip(first).collect();
            }
        }
    }

    /// Share of the photons of each luminophore that have more energy than any that it absorbs, with
    /// its table in the design file and its name.
    pub fn anti_stokes(&self) -> Vec<([&str; 2], f64)> {
        if !self.converts() {
            return Vec::new();
        }
        let nodes = self.traced_nm();
        let share = |of: &StatedLuminophore, first: usize| {
            let photons = of.photons(&nodes, first);
            let whole: f64 = photons.iter().sum();
            photons[..first].iter().sum::<f64>() / whole.max(f64::MIN_POSITIVE)
        };
        let all = self.excited(&nodes).into_iter();
        all.filter_map(|(of, first)| Some(([of.table(), &of.name], share(of, first?)))).collect()
    }
}
