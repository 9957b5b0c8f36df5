// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[files]` of a design: bands, mirror and source that come from files of other programs.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use bsdf::{Bsdf, LobeMotion};
use serde::{Deserialize, Serialize};
use tracer::formats::rays::RayRecord;
use tracer::{Distribution, Emission, Emitter, Prototype, SurfaceModel};

use super::content::{self, Content};
use super::ray_files::{self, Lit};
use super::scattering::{self, Scattering};
use crate::config::source_spectra::{Part, Whose};
use crate::content_hash::sha256_hex;
use crate::metrics::illuminance::Symmetry;

/// `[files]` as it is written.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RawFiles {
    /// `[[files.bands]]`.
    #[serde(default)]
    pub bands: Vec<RawBands>,
    /// `[files.mirror]`.
    pub mirror: Option<RawMirror>,
    /// `[files.source]`.
    pub source: Option<RawSource>,
}

/// `[[files.bands]]`: the hybrid's bands `from..=to` scatter by tables from files.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RawBands {
    /// First band, from 1.
    pub from: usize,
    /// Last band, included.
    pub to: usize,
    /// A file that says itself which side is meant; `{band}` in its name stands for the number of the band.
    pub file: Option<String>,
    /// Zemax files for light from the inner side.
    #[serde(default)]
    pub inner: Vec<String>,
    /// Zemax files for light from the outer side.
    #[serde(default)]
    pub outer: Vec<String>,
    /// How lobes move between the incidences of the files.
    #[serde(default)]
    pub between: LobeMotion,
}

/// `[files.mirror]`: the reflector in the plane z = 0 scatters by a table for light from its outer side.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RawMirror {
    /// The file.
    pub file: String,
    /// How lobes move between the incidences of the file.
    #[serde(default)]
    pub between: LobeMotion,
}

/// `[files.source]`: the light of the LED.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RawSource {
    /// An `.ies`, `.ldt`, `.tm25ray` or `.ray` file; its axis is +z, rays start about the middle of the top of the LED box.
    pub file: String,
    /// Whose light it shines in: that of the file where it has wavelengths, else that of the design.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Whose>,
    /// Light of the file: largest change of a figure from one number of wavelengths to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Light of the file: number of wavelengths instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

/// A file that went in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Used {
    /// Its name as given.
    pub file: String,
    /// Hexadecimal SHA-256.
    pub sha256: String,
    /// For a source: the share of its flux that leaves the top of the LED box upwards; the rest is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flux_used: Option<f64>,
}

/// What a design takes from files.
#[derive(Clone, Default, Serialize)]
pub struct Files {
    /// All files, in the order of the keys.
    pub used: Vec<Used>,
    #[serde(skip)]
    bands: Vec<Option<Arc<dyn Bsdf>>>,
    #[serde(skip)]
    mirror: Option<Arc<dyn Bsdf>>,
    #[serde(skip)]
    mirror_turns: bool,
    #[serde(skip)]
    source: Option<Shining>,
}

impl std::fmt::Debug for Files {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Files")
            .field("used", &self.used)
            .finish_non_exhaustive()
    }
}

/// What `[files.source]` emits.
#[derive(Debug, Clone)]
pub struct Shining {
    /// Its file.
    pub used: Used,
    /// A part for each of its lights: a far field, from every point of the top of the box, or rays with their own starts.
    pub parts: Vec<Part>,
}

impl Files {
    /// Reads the files of `raw` but for the source, which is `source`; they lie in `folder`, `indices` are those of dome and surroundings, `bands` the number of bands.
    ///
    /// # Errors
    /// With the dotted key in front: a band that there is not, a file that cannot be used.
    pub fn load(
        raw: &RawFiles,
        source: Option<Shining>,
        folder: &Path,
        indices: [f64; 2],
        bands: usize,
    ) -> Result<Self> {
        let mut files = Self {
            bands: vec![None; bands],
            ..Self::default()
        };
        for (number, entry) in raw.bands.iter().enumerate() {
            let key = || format!("files.bands[{number}]");
            ensure!(
                entry.from >= 1 && entry.from <= entry.to && entry.to <= bands,
                "{}: from {} to {}: expected bands from 1 to {bands}",
                key(),
                entry.from,
                entry.to
            );
            for band in entry.from..=entry.to {
                let scatter = files.band(entry, band, folder, indices).with_context(key)?;
                ensure!(
                    files.bands[band - 1].replace(scatter).is_none(),
                    "{}: band {band}: expected files for it in one entry, got two",
                    key()
                );
            }
        }
        if let Some(mirror) = &raw.mirror {
            let key = "files.mirror.file";
            let content = files.open(&mirror.file, folder).context(key)?;
            let (scatter, turns) = scattering::reflector(&content, &mirror.file, mirror.between)
                .with_context(|| key.to_owned())?;
            files.mirror_turns = turns;
            files.mirror = Some(scatter);
        }
        files.used.extend(source.iter().map(|s| s.used.clone()));
        files.source = source;
        Ok(files)
    }

    /// Reads a file and notes it.
    fn open(&mut self, name: &str, folder: &Path) -> Result<Content> {
        let path = folder.join(name);
        self.used.push(note(name, &path, "scattering")?);
        content::read(&path)
    }

    fn band(
        &mut self,
        entry: &RawBands,
        band: usize,
        folder: &Path,
        indices: [f64; 2],
    ) -> Result<Arc<dyn Bsdf>> {
        let name = |file: &String| file.replace("{band}", &band.to_string());
        let [inner, outer] =
            [&entry.inner, &entry.outer].map(|list| list.iter().map(name).collect::<Vec<_>>());
        let file = entry.file.as_ref().map(name);
        let scattering =
            Scattering::load(file.as_deref(), [&inner, &outer], entry.between, folder)?;
        let used = scattering.files.iter().map(|input| Used {
            file: input.file.clone(),
            sha256: input.sha256.clone(),
            flux_used: None,
        });
        self.used.extend(used);
        scattering.scatter(indices)
    }

    /// Name of the file that the source comes from, if there is one; it is the last that is read.
    pub fn source_file(&self) -> Option<&str> {
        let last = self.used.last().filter(|_| self.source.is_some());
        last.map(|used| used.file.as_str())
    }

    /// Whether band `band` (from 0) comes from a file.
    pub fn covers(&self, band: usize) -> bool {
        self.band_scatter(band).is_some()
    }

    /// The table of band `band` (from 0).
    pub fn band_scatter(&self, band: usize) -> Option<Arc<dyn Bsdf>> {
        self.bands.get(band).cloned().flatten()
    }

    /// What symmetries mirror and source leave to the light of an array. A mirror that is not isotropic leaves none, nor do rays of a file; bands stand
    /// around the axis of a package, each in its own direction, and leave all.
    pub fn symmetry(&self) -> Symmetry {
        if self.mirror.is_some() && !self.mirror_turns {
            return Symmetry::None;
        }
        match self.parts() {
            [] => Symmetry::Square,
            [
                Part {
                    emission: Emission::Table(table),
                    ..
                },
            ] => symmetry_of(table),
            _ => Symmetry::None,
        }
    }

    /// What the file of the source emits, light by light; nothing where there is none.
    pub fn parts(&self) -> &[Part] {
        self.source.as_ref().map_or(&[], |source| &source.parts)
    }

    /// The same, to be changed.
    pub fn parts_mut(&mut self) -> &mut [Part] {
        self.source
            .as_mut()
            .map_or(&mut [], |source| &mut source.parts)
    }

    /// The reflector, where a file gives it.
    pub fn mirror(&self) -> Option<SurfaceModel> {
        self.mirror.clone().map(SurfaceModel::Coating)
    }

    /// Lets the sources of `prototype` emit what the file says.
    pub fn light_up(&self, prototype: &mut Prototype) {
        if self.source.is_none() {
            return;
        }
        let lit = |source: &tracer::Source, part: &Part| {
            let emitter = match part.emission {
                Emission::Rays(_) => Emitter::Point,
                _ => source.emitter,
            };
            tracer::Source {
                emitter,
                emission: part.emission.clone(),
                ..source.clone()
            }
            .weighing(source.weight * part.share)
        };
        let sources = prototype.sources.iter();
        let all = sources.flat_map(|s| self.parts().iter().map(move |part| lit(s, part)));
        prototype.sources = all.collect();
    }
}

/// A file as it is noted, which should hold what is `expected`.
fn note(name: &str, path: &Path, expected: &str) -> Result<Used> {
    let bytes = std::fs::read(path)
        .with_context(|| format!("{}: expected {expected}, cannot read it", path.display()))?;
    Ok(Used {
        file: name.to_owned(),
        sha256: sha256_hex(&bytes),
        flux_used: None,
    })
}

/// What leaves the top of a box upwards, of a file of `[files.source]`.
pub enum Upward {
    /// The upper part of a far field.
    Table(Distribution),
    /// Rays; those left out have no flux.
    Rays(Lit),
}

/// Reads the file `name` of `[files.source]`.
///
/// # Errors
/// A file that cannot be read, of another format, or that emits nothing upwards.
pub fn upward(name: &str, folder: &Path) -> Result<(Used, Upward)> {
    let path = folder.join(name);
    let mut used = note(name, &path, "a far field or rays")?;
    let (share, found) = match content::read(&path)? {
        content @ (Content::Ies(_) | Content::Ldt(_)) => {
            let whole = content.distribution()?;
            let table = upper(&whole).with_context(|| path.display().to_string())?;
            (table.flux() / whole.flux(), Upward::Table(table))
        }
        Content::Rays(summary) => {
            let mut lit = ray_files::lit(&path)?;
            lit.rays = lit.rays.into_iter().map(above).collect();
            let fluxes = lit.rays.iter().map(|ray| f64::from(ray.flux));
            let flux: f64 = fluxes.filter(|flux| *flux > 0.0).sum();
            ensure!(
                flux > 0.0,
                "{}: expected rays with flux that go up from z = 0 or above, got none",
                path.display()
            );
            (flux / summary.flux, Upward::Rays(lit))
        }
        other => bail!(
            "expected an .ies, .ldt, .tm25ray or .ray file, got {}",
            other.format()
        ),
    };
    used.flux_used = Some(share);
    Ok((used, found))
}

/// The symmetries of a far field, to a millionth of its peak.
fn symmetry_of(table: &Distribution) -> Symmetry {
    let (thetas, phis) = (table.thetas_deg(), table.phis_deg());
    let at = |theta: f64, phi: f64| {
        let (sin, cos) = theta.to_radians().sin_cos();
        let phi = phi.to_radians();
        table.intensity(glam::DVec3::new(sin * phi.cos(), sin * phi.sin(), cos))
    };
    let pairs = || (0..phis.len()).flat_map(|p| (0..thetas.len()).map(move |t| (p, t)));
    let peak = pairs().map(|(p, t)| table.value(p, t)).fold(0.0, f64::max);
    // Mirrored in y = 0, x = 0, x = y; angles kept off the ends of the table, beyond which it is 0.
    let (first, last) = (thetas[0], thetas[thetas.len() - 1]);
    let same = |image: fn(f64) -> f64| {
        pairs().all(|(p, t)| {
            let theta = thetas[t].clamp(first + 1e-9, last - 1e-9);
            (at(theta, phis[p]) - at(theta, image(phis[p]))).abs() <= 1e-6 * peak
        })
    };
    if !(same(|phi| -phi) && same(|phi| 180.0 - phi)) {
        Symmetry::None
    } else if same(|phi| 90.0 - phi) {
        Symmetry::Square
    } else {
        Symmetry::Rectangle
    }
}

/// The part of a distribution above the plane of the source: an LED box does not emit downwards.
fn upper(table: &Distribution) -> Result<Distribution> {
    let (thetas, phis) = (table.thetas_deg(), table.phis_deg());
    let kept: Vec<usize> = (0..thetas.len()).filter(|t| thetas[*t] <= 90.0).collect();
    ensure!(
        kept.len() >= 2,
        "expected intensities at two angles up to 90 degrees at least, got {}",
        kept.len()
    );
    let values = (0..phis.len())
        .flat_map(|p| kept.iter().map(move |t| (p, *t)))
        .map(|(p, t)| table.value(p, t))
        .collect();
    let thetas: Vec<f64> = kept.iter().map(|t| thetas[*t]).collect();
    Ok(Distribution::new(&thetas, &phis, values)?)
}

/// A ray that leaves the top of the box upwards; another keeps its place in the file, without flux.
fn above(mut ray: RayRecord) -> RayRecord {
    // A thousandth of a millimetre is how exactly ray files place the surface of a source.
    if ray.direction[2] <= 0.0 || ray.position[2] < -1e-3 {
        ray.flux = 0.0;
    }
    ray.position[2] = ray.position[2].max(1e-6);
    ray
}
