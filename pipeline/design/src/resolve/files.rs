// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[files]`, read and checked.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use bsdf::Bsdf;
use tracer::Distribution;
use tracer::RayRecord;

use formats::content::{self, Content};
use formats::ray_files::{self, RayLight};
use formats::scattering::{self, Scattering};
use runtime::content_hash::sha256_of_file;

use crate::resolved::files::{Files, SourceFile, UsedFile};
use crate::schema;
use crate::schema::files::FileBands;

impl Files {
    /// Reads the files of `raw` but for the source, which is `source`; they lie in `folder`,
    /// `indices` are those of dome and surroundings, `bands` the number of bands.
    ///
    /// # Errors
    /// With the dotted key in front: a band that there is not, a file that cannot be used.
    pub fn load(
        raw: &schema::files::Files,
        source: Option<SourceFile>,
        folder: &Path,
        indices: [f64; 2],
        bands: usize,
    ) -> Result<Self> {
        let mut files = Self { stated: raw.clone(), bands: vec![None; bands], ..Self::default() };
        for (number, entry) in raw.bands.iter().enumerate() {
            let key = || format!("files.bands[{}]", number + 1);
            ensure!(
                entry.from >= 1 && entry.from <= entry.to && entry.to <= bands,
                "{}: from {} to {}: expected bands from 1 to {bands}",
                key(),
                entry.from,
                entry.to
            );
            for band in entry.from..=entry.to {
                let bsdf = files.band(entry, band, folder, indices).with_context(key)?;
                ensure!(
                    files.bands[band - 1].replace(bsdf).is_none(),
                    "{}: band {band}: expected files for it in one entry, got two",
                    key()
                );
            }
        }
        if let Some(mirror) = &raw.mirror {
            let key = "files.mirror.file";
            let content = files.open(&mirror.file, folder).context(key)?;
            let (bsdf, turns) = scattering::reflector(&content, &mirror.file, mirror.between)
                .with_context(|| key.to_owned())?;
            files.mirror_turns = turns;
            files.mirror = Some(bsdf);
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
        entry: &FileBands,
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
        let used = scattering.files.iter().map(|input| UsedFile {
            file: input.file.clone(),
            sha256: input.sha256.clone(),
            flux_used: None,
        });
        self.used.extend(used);
        scattering.bsdf(indices)
    }
}

/// A file as it is noted, which should hold what is `expected`.
fn note(name: &str, path: &Path, expected: &str) -> Result<UsedFile> {
    let sha256 = sha256_of_file(path)
        .with_context(|| format!("{}: expected {expected}, cannot read it", path.display()))?;
    Ok(UsedFile { file: name.to_owned(), sha256, flux_used: None })
}

/// Upward part of the emission, of a file of `[files.source]`.
pub enum Upward {
    /// The upper part of a far field.
    Table(Distribution),
    /// Rays; those left out have no flux.
    Rays(RayLight),
}

/// Reads the file `name` of `[files.source]`.
///
/// # Errors
/// A file that cannot be read, of another format, or that emits nothing upwards.
pub fn upward(name: &str, folder: &Path) -> Result<(UsedFile, Upward)> {
    let path = folder.join(name);
    let mut used = note(name, &path, "a far field or rays")?;
    let (share, found) = match content::read(&path)? {
        Content::FarField(file) => {
            let whole = (file.distribution)()?;
            let table = upper(&whole).with_context(|| path.display().to_string())?;
            (table.flux() / whole.flux(), Upward::Table(table))
        }
        Content::Rays(summary) => {
            let mut lit = ray_files::with_wavelengths(&path)?;
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
        other => bail!("expected a far field or a file of rays, got {}", other.format()),
    };
    used.flux_used = Some(share);
    Ok((used, found))
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
