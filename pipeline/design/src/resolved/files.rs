// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bands, mirror and source of a checked design that come from files of other programs.

use std::sync::Arc;

use bsdf::Bsdf;
use serde::Serialize;
use tracer::{Distribution, Emission, Emitter, Prototype, SurfaceModel};

use metrics::illuminance::Symmetry;

use super::sources::Part;
use crate::schema;

/// A file that went in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UsedFile {
    /// Name as given.
    pub file: String,
    /// Hexadecimal SHA-256.
    pub sha256: String,
    /// For a source: the share of its flux that leaves the top of the LED box upwards; the rest is
    /// left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flux_used: Option<f64>,
}

/// Bands, mirror and source of a design from files.
#[derive(Clone, Default, Serialize)]
pub struct Files {
    /// As written.
    #[serde(skip)]
    pub(crate) stated: schema::files::Files,
    /// All files, in the order of the keys.
    pub used: Vec<UsedFile>,
    #[serde(skip)]
    pub(crate) bands: Vec<Option<Arc<dyn Bsdf>>>,
    #[serde(skip)]
    pub(crate) mirror: Option<Arc<dyn Bsdf>>,
    #[serde(skip)]
    pub(crate) mirror_turns: bool,
    #[serde(skip)]
    pub(crate) source: Option<SourceFile>,
}

impl std::fmt::Debug for Files {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Files").field("used", &self.used).finish_non_exhaustive()
    }
}

/// Emission of `[files.source]`.
#[derive(Debug, Clone)]
pub struct SourceFile {
    /// File.
    pub used: UsedFile,
    /// A part for each of its lights: a far field, from every point of the top of the box, or rays
    /// with their own starts.
    pub parts: Vec<Part>,
}

impl Files {
    /// Name of the file that the source comes from, if there is one; it is the last that is read.
    pub fn source_file(&self) -> Option<&str> {
        let last = self.used.last().filter(|_| self.source.is_some());
        last.map(|used| used.file.as_str())
    }

    /// True if band `band` (from 0) comes from a file.
    pub fn covers(&self, band: usize) -> bool {
        self.band_bsdf(band).is_some()
    }

    /// The table of band `band` (from 0).
    pub fn band_bsdf(&self, band: usize) -> Option<Arc<dyn Bsdf>> {
        self.bands.get(band).cloned().flatten()
    }

    /// Symmetries that mirror and source leave to the light of an array. A mirror that is not
    /// isotropic leaves none, nor do rays of a file; bands stand around the axis of a package, each
    /// in its own direction, and leave all.
    pub fn symmetry(&self) -> Symmetry {
        if self.mirror.is_some() && !self.mirror_turns {
            return Symmetry::None;
        }
        match self.parts() {
            [] => Symmetry::Square,
            [Part { emission: Emission::Table(table), .. }] => symmetry_of(table),
            _ => Symmetry::None,
        }
    }

    /// Emission of the file of the source, light by light; empty without one.
    pub fn parts(&self) -> &[Part] {
        self.source.as_ref().map_or(&[], |source| &source.parts)
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
            tracer::Source { emitter, emission: part.emission.clone(), ..source.clone() }
                .weighing(source.weight * part.share)
        };
        let sources = prototype.sources.iter();
        let all = sources.flat_map(|s| self.parts().iter().map(move |part| lit(s, part)));
        prototype.sources = all.collect();
    }
}

/// The symmetries of a far field, to a millionth of its peak.
pub fn symmetry_of(table: &Distribution) -> Symmetry {
    // Mirrored in y = 0, x = 0, x = y.
    if !(is_own_image(table, |phi| -phi) && is_own_image(table, |phi| 180.0 - phi)) {
        Symmetry::None
    } else if is_own_image(table, |phi| 90.0 - phi) {
        Symmetry::Square
    } else {
        Symmetry::Rectangle
    }
}

/// True if a far field is the same where azimuths are those of their images, in degrees, to a
/// millionth of its peak.
pub fn is_own_image(table: &Distribution, image: fn(f64) -> f64) -> bool {
    let (thetas, phis) = (table.thetas_deg(), table.phis_deg());
    let at = |theta: f64, phi: f64| {
        let (sin, cos) = theta.to_radians().sin_cos();
        let phi = phi.to_radians();
        table.intensity(glam::DVec3::new(sin * phi.cos(), sin * phi.sin(), cos))
    };
    let pairs = || (0..phis.len()).flat_map(|p| (0..thetas.len()).map(move |t| (p, t)));
    let peak = pairs().map(|(p, t)| table.value(p, t)).fold(0.0, f64::max);
    // Angles kept off the ends of the table, beyond which it is 0.
    let (first, last) = (thetas[0], thetas[thetas.len() - 1]);
    pairs().all(|(p, t)| {
        let theta = thetas[t].clamp(first + 1e-9, last - 1e-9);
        (at(theta, phis[p]) - at(theta, image(phis[p]))).abs() <= 1e-6 * peak
    })
}
