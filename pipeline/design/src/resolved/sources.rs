// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sources of a checked design.

use serde::Serialize;
use tracer::Emission;

use metrics::illuminance::Symmetry;

use crate::schema::sources::Source;
use crate::spectrum::lights::Colour;

/// Channel of sources that state none.
pub const ONE_CHANNEL: &str = "all";

/// A source of a checked design.
#[derive(Debug, Clone, Serialize)]
pub struct CheckedSource {
    /// As written.
    pub stated: Source,
    /// SHA-256 of its file, so that what is kept of a trace tells another file of the same name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file_sha256: Option<String>,
    /// As the tracer takes it.
    #[serde(skip)]
    pub emitters: Vec<CheckedEmitter>,
    /// The symmetry of its light about the axis of the package.
    #[serde(skip)]
    pub symmetry: Symmetry,
}

impl CheckedSource {
    /// Name.
    pub fn name(&self) -> &str {
        &self.stated.shared.name
    }

    /// Channel that drives it.
    pub fn channel(&self) -> &str {
        self.stated.shared.channel.as_deref().unwrap_or(ONE_CHANNEL)
    }
}

/// Source and its light.
#[derive(Debug, Clone)]
pub struct CheckedEmitter {
    /// As the tracer takes it.
    pub source: tracer::Source,
    /// Light.
    pub light: EmitterLight,
}

/// The light of an emitter.
#[derive(Debug, Clone)]
pub enum EmitterLight {
    /// That of the design.
    Design,
    /// Another one.
    Colour(Box<Colour>),
}

impl EmitterLight {
    /// That of a colour.
    pub fn from_colour(colour: Colour) -> Self {
        Self::Colour(Box::new(colour))
    }
}

/// Emission of a file in one light.
#[derive(Debug, Clone)]
pub struct Part {
    /// The directions, and for rays the places.
    pub emission: Emission,
    /// Share of the power of the source; 0 where it is dark.
    pub share: f64,
    /// Light.
    pub light: EmitterLight,
}

/// Number of the tracer's sources in a package whose sources are these: one, the top of the box,
/// where there are none.
pub fn per_package(sources: &[CheckedSource]) -> usize {
    let emitters: usize = sources.iter().map(|source| source.emitters.len()).sum();
    emitters.max(1)
}

/// The numbers of the tracer's sources of this name within a package.
pub fn numbers(sources: &[CheckedSource], name: &str) -> Option<std::ops::Range<usize>> {
    let mut first = 0;
    for source in sources {
        let end = first + source.emitters.len();
        if source.name() == name {
            return Some(first..end);
        }
        first = end;
    }
    None
}
