// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of single sources, checked: a wavelength or a spectrum that a source states, or the
//! wavelengths of a file of rays.
//!
//! In: the table of a source. Out: what the tracer emits, one part for each light, and that light;
//! then all lights of the design, where they are not one.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use tracer::RayRecord;
use tracer::{Distribution, Emission, RaySet};

use ::formats::content::{self, Content};
use ::formats::ray_files::{self, HeaderWavelengths, RayLight};
use metrics::kinds::Weighting;
use metrics::{colour_matching, photopic};

use super::files::{self, Upward};
use super::light;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::files::SourceFile;
use crate::resolved::sources::{CheckedSource, EmitterLight, Part};
use crate::schema;
use crate::schema::files::FileSource;
use crate::schema::sources::{LightOf, SourceKeys, SourceOfFile};
use crate::spectrum::lights::{Colour, Light, Lights};
use crate::spectrum::rays::{ColouredRays, nanometres};
use crate::spectrum::{self, Sampling, Spectrum, WAVELENGTHS_NM};

/// The name of what emits where there are no `[[sources]]`.
const LED: &str = "LED";

/// Context of messages, and the weighting of all lights.
pub(crate) struct Scope<'a> {
    pub(crate) at: &'a Context<'a>,
    pub(crate) weighting: Weighting,
}

impl Scope<'_> {
    fn refuse<T>(
        &self,
        key: &str,
        got: impl std::fmt::Display,
        expected: &str,
    ) -> Result<T, ConfigError> {
        Err(self.at.value(key, got, expected))
    }

    /// The light that a source states, one by a `file`; `None` where it is left to the file or the
    /// design.
    pub(crate) fn stated(
        &self,
        keys: &SourceKeys,
        file: Option<&FileSource>,
        folder: &Path,
    ) -> Result<Option<EmitterLight>, ConfigError> {
        let given = [keys.light.is_some(), keys.wavelength_nm.is_some(), keys.spectrum.is_some()];
        if given.into_iter().filter(|given| *given).count() > 1 {
            let expected = "one of `light`, `wavelength_nm` and `spectrum`";
            return self.refuse("light", "several lights", expected);
        }
        let own = given[1] || given[2] || keys.light == Some(LightOf::Design);
        if let Some((name, got)) = file.filter(|_| own).and_then(sampling_key) {
            return self.refuse(name, got, "no such key but with the light of a file");
        }
        if let Some(wavelength_nm) = keys.wavelength_nm {
            let key = "wavelength_nm";
            let [low, high] = WAVELENGTHS_NM;
            self.at.within(key, wavelength_nm, low, high)?;
            let line = light::line(wavelength_nm, self.weighting, key, self.at)?;
            return Ok(Some(EmitterLight::from_colour(Colour::Spectrum(line))));
        }
        if let Some(spectrum) = &keys.spectrum {
            let weighting = spectrum.shared.weighting;
            if weighting.is_some_and(|w| w != self.weighting) {
                let expected = "that of [light]: all sources are weighted alike";
                return self.refuse("spectrum.weighting", "another", expected);
            }
            let of = ("spectrum", self.weighting);
            let spectrum = light::resolve_spectrum(spectrum, of, folder, self.at)?;
            return Ok(Some(EmitterLight::from_colour(Colour::Spectrum(spectrum))));
        }
        match keys.light {
            Some(LightOf::Design) => Ok(Some(EmitterLight::Design)),
            Some(LightOf::File) if file.is_none() => {
                self.refuse("light", "\"file\"", "\"design\" for this kind")
            }
            Some(LightOf::File) | None => Ok(None),
        }
    }

    /// Emission of the file of a source, light by light.
    pub(crate) fn file(
        &self,
        keys: &SourceKeys,
        raw: &SourceOfFile,
        folder: &Path,
    ) -> Result<Vec<Part>, ConfigError> {
        let path = folder.join(&raw.file);
        let unusable = |error: anyhow::Error| {
            let is_table =
                path.extension().is_some_and(|ending| ending == "csv" || ending == "txt");
            let table = if is_table {
                "; columns of angle and intensity take kind = \"table\""
            } else {
                ""
            };
            let expected = format!("a far field or a file of rays: {error:#}{table}");
            let got = format!("{:?}", raw.file);
            self.at.value("file", got, &expected)
        };
        let source = FileSource {
            file: raw.file.clone(),
            light: keys.light,
            tolerance: raw.tolerance,
            samples: raw.samples,
        };
        let stated = self.stated(keys, Some(&source), folder)?;
        match content::read(&path).map_err(unusable)? {
            Content::FarField(far) => {
                let table = (far.distribution)().map_err(|e| unusable(e.into()))?;
                self.far(&source, stated, table)
            }
            Content::Rays(_) => {
                let lit = ray_files::with_wavelengths(&path).map_err(unusable)?;
                self.rays(&source, stated, lit)
            }
            other => Err(unusable(anyhow::anyhow!(
                "expected a far field or a file of rays, got {}",
                other.format()
            ))),
        }
    }

    /// Emission of the file of `[files.source]`, light by light.
    pub(crate) fn upward(
        &self,
        raw: &FileSource,
        folder: &Path,
    ) -> Result<SourceFile, ConfigError> {
        let own = raw.light == Some(LightOf::Design);
        if let Some((name, got)) = sampling_key(raw).filter(|_| own) {
            return self.refuse(name, got, "no such key but with the light of a file");
        }
        let stated = own.then_some(EmitterLight::Design);
        let read = files::upward(&raw.file, folder);
        let (used, upward) = read
            .map_err(|error| self.at.of_files(&error.context(format!("{}file", self.at.prefix))))?;
        let parts = match upward {
            Upward::Table(table) => self.far(raw, stated, table)?,
            Upward::Rays(lit) => self.rays(raw, stated, lit)?,
        };
        Ok(SourceFile { used, parts })
    }

    /// A far field, which states no wavelengths.
    fn far(
        &self,
        source: &FileSource,
        stated: Option<EmitterLight>,
        table: Distribution,
    ) -> Result<Vec<Part>, ConfigError> {
        if source.light == Some(LightOf::File) || sampling_key(source).is_some() {
            let expected = "a file of rays, which far fields are not, for light = \"file\"";
            return self.refuse("file", format!("{:?}", source.file), expected);
        }
        Ok(vec![Part {
            emission: Emission::Table(Arc::new(table)),
            share: 1.0,
            light: stated.unwrap_or(EmitterLight::Design),
        }])
    }

    /// Rays in the light that is stated, or in that of their file.
    fn rays(
        &self,
        source: &FileSource,
        stated: Option<EmitterLight>,
        lit: RayLight,
    ) -> Result<Vec<Part>, ConfigError> {
        match stated {
            Some(own) => Ok(vec![one(lit.rays, own).map_err(|error| {
                let expected = format!("a far field or a file of rays: {error}");
                let got = format!("{:?}", source.file);
                self.at.value("file", got, &expected)
            })?]),
            None => self.of_rays(source, lit),
        }
    }

    /// Rays in the light that their file states.
    fn of_rays(&self, source: &FileSource, lit: RayLight) -> Result<Vec<Part>, ConfigError> {
        let name = &source.file;
        let unusable = |expected: String| {
            let expected = format!("{expected}; light = \"design\" passes the file's over");
            self.at.value("file", format!("{name:?}"), &expected)
        };
        let of_tracer = |error: tracer::Error| unusable(error.to_string());
        let sampling = self.sampling(source)?;
        let whole = |rays, own| Ok(vec![one(rays, own).map_err(of_tracer)?]);
        match lit.stated {
            HeaderWavelengths::Nothing if source.light == Some(LightOf::File) => {
                let expected = format!("\"design\": {name:?} says nothing of wavelengths");
                self.refuse("light", "\"file\"", &expected)
            }
            HeaderWavelengths::Nothing => whole(lit.rays, EmitterLight::Design),
            HeaderWavelengths::One(nm) => {
                possible(nm, "all rays").map_err(unusable)?;
                whole(lit.rays, self.line(nanometres(nm), &unusable)?)
            }
            HeaderWavelengths::Tables(tables, false) => {
                let first =
                    tables.first().ok_or_else(|| unusable("no spectral table".to_owned()))?;
                let spectrum = self.table(first, 1, sampling, &unusable)?;
                whole(lit.rays, EmitterLight::from_colour(Colour::Spectrum(spectrum)))
            }
            HeaderWavelengths::PerRay => self.coloured(lit, sampling, &unusable),
            HeaderWavelengths::Tables(tables, true) => {
                let of_table = by_table(lit.rays, &lit.tables, tables.len()).map_err(unusable)?;
                let mut found = Vec::new();
                for (number, rays) in of_table {
                    let spectrum = self.table(&tables[number - 1], number, sampling, &unusable)?;
                    let flux: f64 = rays.iter().map(|ray| f64::from(ray.flux)).sum();
                    let efficacy = spectrum.luminous_efficacy_lm_per_w;
                    if !lit.radiant && efficacy <= 0.0 {
                        return Err(unusable(format!(
                            "spectral table {number} with light that is seen, since flux is in lm"
                        )));
                    }
                    let own = EmitterLight::from_colour(Colour::Spectrum(spectrum));
                    let mut part = one(rays, own).map_err(of_tracer)?;
                    part.share = if lit.radiant { flux } else { flux / efficacy };
                    found.push(part);
                }
                let power: f64 = found.iter().map(|part| part.share).sum();
                for part in &mut found {
                    part.share /= power;
                }
                Ok(found)
            }
        }
    }

    /// Sampling of the light of a file.
    fn sampling(&self, source: &FileSource) -> Result<Sampling, ConfigError> {
        let sampling = light::sampling(source.tolerance, source.samples, "", self.at)?;
        spectrum::check_sampling(sampling)
            .map_err(|error| self.at.value(error.key, error.got, &error.expected))?;
        Ok(sampling)
    }

    /// Rays that each have a wavelength.
    fn coloured(
        &self,
        lit: RayLight,
        sampling: Sampling,
        unusable: &impl Fn(String) -> ConfigError,
    ) -> Result<Vec<Part>, ConfigError> {
        let of_tracer = |error: tracer::Error| unusable(error.to_string());
        let mut rays = lit.rays;
        let needs_v = !lit.radiant || self.weighting == Weighting::Photometric;
        let mut only = None;
        let mut several = false;
        for (k, ray) in rays.iter().enumerate().filter(|(_, ray)| ray.flux > 0.0) {
            possible(ray.wavelength, &format!("ray {}", k + 1)).map_err(unusable)?;
            let nm = nanometres(ray.wavelength);
            several |= only.is_some_and(|other: f64| other.to_bits() != nm.to_bits());
            only = Some(nm);
            if needs_v && photopic::v(nm) <= 0.0 {
                let [first, last] = colour_matching::range_nm();
                return Err(unusable(format!(
                    "wavelengths from {first} to {last} nm only, where V(lambda) turns watts and \
                     lumens into each other, got {nm} nm for ray {}",
                    k + 1
                )));
            }
        }
        if let (Some(nm), false) = (only, several) {
            let own = self.line(nm, unusable)?;
            return Ok(vec![one(rays, own).map_err(of_tracer)?]);
        }
        if !lit.radiant {
            for ray in rays.iter_mut().filter(|ray| ray.flux > 0.0) {
                let seen = photopic::v(nanometres(ray.wavelength));
                ray.flux = (f64::from(ray.flux) / seen) as f32;
            }
        }
        let set = RaySet::new(rays.iter().copied()).map_err(of_tracer)?;
        let coloured = ColouredRays::new(rays, self.weighting, sampling);
        Ok(vec![Part {
            emission: Emission::Rays(Arc::new(set)),
            share: 1.0,
            light: EmitterLight::from_colour(Colour::Rays(coloured)),
        }])
    }

    /// Light of one wavelength of a file.
    fn line(
        &self,
        wavelength_nm: f64,
        unusable: &impl Fn(String) -> ConfigError,
    ) -> Result<EmitterLight, ConfigError> {
        let line = Spectrum::line(wavelength_nm, self.weighting)
            .map_err(|error| unusable(error.to_string()))?;
        Ok(EmitterLight::from_colour(Colour::Spectrum(line)))
    }

    /// A spectral table of a file.
    fn table(
        &self,
        rows: &[[f32; 2]],
        number: usize,
        sampling: Sampling,
        unusable: &impl Fn(String) -> ConfigError,
    ) -> Result<Spectrum, ConfigError> {
        let source = spectrum::SpectralPower::Table {
            wavelength_nm: rows.iter().map(|row| nanometres(row[0])).collect(),
            power: rows.iter().map(|row| f64::from(row[1])).collect(),
        };
        Spectrum::new(source, self.weighting, Some(sampling)).map_err(|error| {
            unusable(format!(
                "spectral table {number}: {} with {}, got {}",
                error.key, error.expected, error.got
            ))
        })
    }
}

/// The first key of the sampling of a file that is given, and its value.
fn sampling_key(source: &FileSource) -> Option<(&'static str, String)> {
    let tolerance = source.tolerance.map(|value| ("tolerance", value.to_string()));
    tolerance.or(source.samples.map(|value| ("samples", value.to_string())))
}

/// Refuses a wavelength that is none, of some rays.
fn possible(stated: f32, of: &str) -> Result<(), String> {
    let [low, high] = WAVELENGTHS_NM;
    if (low..=high).contains(&nanometres(stated)) {
        Ok(())
    } else {
        Err(format!(
            "a file whose wavelengths lie from {low} to {high} nm, got {stated} nm for {of}"
        ))
    }
}

/// Rays with flux by the numbers, from 1, of their spectral tables, of which there are `tables`.
fn by_table(
    rays: Vec<RayRecord>,
    of_ray: &[f32],
    tables: usize,
) -> Result<BTreeMap<usize, Vec<RayRecord>>, String> {
    let mut found: BTreeMap<usize, Vec<RayRecord>> = BTreeMap::new();
    let numbered = rays.into_iter().zip(of_ray).enumerate();
    for (k, (ray, &number)) in numbered.filter(|(_, (ray, _))| ray.flux > 0.0) {
        if !(number >= 1.0 && number <= tables as f32 && number.fract() == 0.0) {
            return Err(format!(
                "rays that name one of the {tables} spectral tables, got number {number} \
                 for ray {}",
                k + 1
            ));
        }
        found.entry(number as usize).or_default().push(ray);
    }
    if found.is_empty() {
        return Err("rays with flux, got none".to_owned());
    }
    Ok(found)
}

/// All rays in one light.
fn one(rays: Vec<RayRecord>, own: EmitterLight) -> Result<Part, tracer::Error> {
    Ok(Part { emission: Emission::Rays(Arc::new(RaySet::new(rays)?)), share: 1.0, light: own })
}

/// The lights of all sources, or of the file that stands for them; `None` where that of the design
/// is the only one. Where every source is to have a ledger of its own, no two share a light, and
/// there is none without.
pub(crate) fn lights(
    trace: &schema::Trace,
    sources: &[CheckedSource],
    file: Option<&SourceFile>,
    design: &Spectrum,
    at: &Context,
) -> Result<Option<Lights>, ConfigError> {
    let by_source = trace.ledger_by_source;
    if by_source && sources.is_empty() {
        let expected = "[[sources]] beside it: without them there is one source";
        return Err(at.value("trace.ledger_by_source", true, expected));
    }
    let of_sources = sources.iter().flat_map(|source| {
        let emitters = source.emitters.iter();
        emitters.map(|emitter| (source.name(), emitter.source.weight, &emitter.light))
    });
    let of_file = file.iter().flat_map(|file| &file.parts);
    let of_file = of_file.map(|part| (LED, part.share, &part.light));
    let all: Vec<(&str, f64, &EmitterLight)> = of_sources.chain(of_file).collect();
    let whole: f64 = all.iter().map(|(_, weight, _)| weight).sum();
    let channel = |name: &str| {
        let source = sources.iter().find(|source| source.name() == name);
        source.map(CheckedSource::channel)
    };
    let has_channels = sources.iter().any(|source| source.channel() != sources[0].channel());
    let of_design = Colour::Spectrum(design.clone());
    let mut lights: Vec<Light> = Vec::new();
    for (number, (name, weight, own)) in all.into_iter().enumerate() {
        let light = match own {
            EmitterLight::Design => &of_design,
            EmitterLight::Colour(colour) => colour,
        };
        let place = lights.iter().position(|known| {
            known.light.is(light)
                && (!by_source || known.sources.iter().any(|s| s == name))
                && channel(&known.sources[0]) == channel(name)
        });
        let place = place.unwrap_or_else(|| {
            lights.push(Light {
                sources: Vec::new(),
                emitters: Vec::new(),
                emitted_w: 0.0,
                emitted_lm: 0.0,
                light: light.clone(),
            });
            lights.len() - 1
        });
        let light = &mut lights[place];
        if light.sources.last().is_none_or(|last| last != name) {
            light.sources.push(name.to_owned());
        }
        light.emitters.push(number);
        light.emitted_w += weight / whole;
    }
    for light in &mut lights {
        light.emitted_lm = light.emitted_w * light.light.efficacy();
    }
    let coloured = lights.iter().any(|light| !light.light.is(&of_design));
    Ok((by_source || coloured || has_channels).then_some(Lights {
        weighting: design.weighting,
        lights,
        apart: true,
        coloured,
    }))
}
