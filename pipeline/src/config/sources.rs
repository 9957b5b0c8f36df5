// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]`, checked: what emits, where, in which directions, and with which share of the power.
//!
//! In: the tables of the design. Out: the tracer's sources of one package, in the order of the tables; the five faces of a chip are five of them. Whether they
//! stand where they say is judged by the scene, see `stages::scene_check`.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tracer::glam::DVec3;
use tracer::{Emission, Emitter, Region};

use super::check::{Context, shown};
use super::design::Led;
use super::solids::{self, Checked as Solid, Per};
use super::source_spectra::{Own, Scope, Whose};
use super::{ConfigError, schema};
use crate::content_hash::sha256_hex;
use crate::formats::keys::Shining;
use crate::metrics::illuminance::Symmetry;
use crate::spectrum::Weighting;

/// `[[sources]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Its name, by which receivers tell its light from other.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Its middle, mm, in the package; not of a chip.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub position_mm: Option<[f64; 3]>,
    /// What surrounds it: `silicone`, `air`, or a solid of the package by its name; silicone where there is a dome, else air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<String>,
    /// Cosine, rectangle: the direction that it faces, of any length; +z if absent.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub normal: Option<[f64; 3]>,
    /// Rectangle: lengths along u and v, mm.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub size_mm: Option<[f64; 2]>,
    /// Cosine: the power of the cosine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exponent: Option<f64>,
    /// Chip: power of the top and of the sides towards +x, -x, +y and -y, in any unit.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub face_powers: Option<[f64; 5]>,
    /// File: a far field or a file of rays, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Power beside the other sources, in any unit.
    #[serde(default = "one")]
    pub power: f64,
    /// Whose light it shines in: that of the file where it has wavelengths, else that of the design.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Whose>,
    /// A wavelength of its own, nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<f64>,
    /// A spectrum of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<schema::Spectrum>,
    /// Light of a file: largest change of a figure from one number of wavelengths to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Light of a file: number of wavelengths instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

fn one() -> f64 {
    1.0
}

impl Source {
    /// One that emits what a file says.
    pub(super) fn of_file(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            kind: Kind::File,
            position_mm: None,
            inside: None,
            normal: None,
            size_mm: None,
            exponent: None,
            face_powers: None,
            file: None,
            power: 1.0,
            light: None,
            wavelength_nm: None,
            spectrum: None,
            tolerance: None,
            samples: None,
        }
    }
}

/// Kinds of source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A point with the same intensity everywhere.
    Isotropic,
    /// A point with an intensity in proportion to a power of the cosine.
    Cosine,
    /// A Lambertian rectangle.
    Rectangle,
    /// The top and the four sides of the LED box, Lambertian.
    Chip,
    /// A point that emits a far field, or the rays of a file.
    File,
}

/// A source of a checked design.
#[derive(Debug, Clone, Serialize)]
pub struct Checked {
    /// As written.
    pub stated: Source,
    /// SHA-256 of its file, so that what is kept of a trace tells another file of the same name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file_sha256: Option<String>,
    /// As the tracer takes it.
    #[serde(skip)]
    pub emitters: Vec<tracer::Source>,
    /// The light of each of them.
    #[serde(skip)]
    pub own: Vec<Own>,
    /// The symmetry of its light about the axis of the package.
    #[serde(skip)]
    pub symmetry: Symmetry,
}

/// Number of the tracer's sources in a package whose sources are these: one, the top of the box, where there are none.
pub fn per_package(sources: &[Checked]) -> usize {
    let emitters: usize = sources.iter().map(|source| source.emitters.len()).sum();
    emitters.max(1)
}

/// The numbers of the tracer's sources of this name within a package.
pub fn numbers(sources: &[Checked], name: &str) -> Option<std::ops::Range<usize>> {
    let mut first = 0;
    for source in sources {
        let end = first + source.emitters.len();
        if source.stated.name == name {
            return Some(first..end);
        }
        first = end;
    }
    None
}

pub(super) fn resolve(
    raw: &schema::Design,
    (led, domed, solids): (&Led, bool, &[Solid]),
    weighting: Weighting,
    folder: &Path,
    at: &Context,
) -> Result<Vec<Checked>, ConfigError> {
    if !raw.sources.is_empty() && raw.files.source.is_some() {
        let expected = "no such table beside [[sources]], which have files of their own";
        return Err(at.value("files.source", "given", expected));
    }
    let mut checked: Vec<Checked> = Vec::new();
    for (number, source) in raw.sources.iter().enumerate() {
        let key = |name: &str| format!("sources[{}].{name}", number + 1);
        if source.name.is_empty() || checked.iter().any(|c| c.stated.name == source.name) {
            let expected = "a name, and none twice";
            return Err(at.value(&key("name"), format!("{:?}", source.name), expected));
        }
        foreign(source, &key, at)?;
        at.within(&key("power"), source.power, 1e-12, 1e12)?;
        let region = surroundings(source, domed, solids, &key, at)?;
        let scope = Scope {
            key: &key,
            at,
            weighting,
        };
        let (emitters, own, symmetry) = emitters(source, led, region, folder, &scope)?;
        let file_sha256 = match &source.file {
            Some(name) => Some(hash(&folder.join(name)).map_err(|e| {
                let expected = format!("a file that can be read: {e}");
                at.value(&key("file"), format!("{name:?}"), &expected)
            })?),
            None => None,
        };
        checked.push(Checked {
            stated: source.clone(),
            file_sha256,
            emitters,
            own,
            symmetry,
        });
    }
    Ok(checked)
}

/// What `[files.source]` emits, in the light that it or its file states.
pub(super) fn of_files(
    raw: &schema::Design,
    weighting: Weighting,
    folder: &Path,
    at: &Context,
) -> Result<Option<Shining>, ConfigError> {
    let key = &|name: &str| format!("files.source.{name}");
    let scope = Scope { key, at, weighting };
    let source = raw.files.source.as_ref();
    source.map(|raw| scope.upward(raw, folder)).transpose()
}

fn hash(path: &Path) -> std::io::Result<String> {
    Ok(sha256_hex(&std::fs::read(path)?))
}

/// What a source says that it lies in.
fn surroundings(
    raw: &Source,
    domed: bool,
    solids: &[Solid],
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<Region, ConfigError> {
    match raw.inside.as_deref() {
        Some("silicone") if !domed => {
            let expected = "\"air\" without [dome]";
            Err(at.value(&key("inside"), "\"silicone\"", expected))
        }
        Some("silicone") => Ok(tracer::package::SILICONE),
        None if domed => Ok(tracer::package::SILICONE),
        Some("air") | None => Ok(Region::World),
        Some(name) => {
            let of_package = solids::regions(solids, Per::Package, domed);
            // What holds packages is what lies around them.
            let of_array = solids::regions(solids, Per::Array, domed).into_iter();
            let around = of_array.map(|(solid, _)| (solid, Region::World));
            let known: Vec<(&Solid, Region)> = of_package.into_iter().chain(around).collect();
            let found = known.iter().find(|(solid, _)| solid.name() == name);
            found.map(|(_, region)| *region).ok_or_else(|| {
                let known = known.iter().map(|(s, _)| format!(", {:?}", s.name()));
                let expected = format!(
                    "\"silicone\", \"air\" or a solid that light enters{}",
                    known.collect::<String>()
                );
                at.value(&key("inside"), format!("{name:?}"), &expected)
            })
        }
    }
}

fn foreign(raw: &Source, key: &impl Fn(&str) -> String, at: &Context) -> Result<(), ConfigError> {
    let of = |kinds: &[Kind]| kinds.contains(&raw.kind);
    let faces = of(&[Kind::Cosine, Kind::Rectangle]);
    let given = [
        (
            "position_mm",
            shown(raw.position_mm.as_ref()),
            !of(&[Kind::Chip]),
        ),
        (
            "size_mm",
            shown(raw.size_mm.as_ref()),
            of(&[Kind::Rectangle]),
        ),
        (
            "exponent",
            shown(raw.exponent.as_ref()),
            of(&[Kind::Cosine]),
        ),
        (
            "face_powers",
            shown(raw.face_powers.as_ref()),
            of(&[Kind::Chip]),
        ),
        ("file", shown(raw.file.as_ref()), of(&[Kind::File])),
        ("normal", shown(raw.normal.as_ref()), faces),
        ("inside", shown(raw.inside.as_ref()), !of(&[Kind::Chip])),
    ];
    at.of_kind(key, &given, &["normal", "inside"])
}

fn emitters<K: Fn(&str) -> String>(
    raw: &Source,
    led: &Led,
    region: Region,
    folder: &Path,
    scope: &Scope<'_, K>,
) -> Result<(Vec<tracer::Source>, Vec<Own>, Symmetry), ConfigError> {
    let (key, at) = (scope.key, scope.at);
    let place = raw.position_mm.unwrap_or_default();
    for v in place {
        at.within(&key("position_mm"), v, -1e4, 1e4)?;
    }
    let position = DVec3::from_array(place);
    let normal = DVec3::from_array(raw.normal.unwrap_or([0.0, 0.0, 1.0]));
    if !(normal.is_finite() && normal.length() > 0.0) {
        let got = format!("{:?}", normal.to_array());
        return Err(at.value(&key("normal"), got, "a direction, of any length above 0"));
    }
    let one = |emitter: Emitter, emission: Emission| {
        let source = tracer::Source::new(&raw.name, position, region, emitter, emission);
        source.facing(normal).weighing(raw.power)
    };
    let centred = place[0] == 0.0 && place[1] == 0.0;
    let upright = centred && normal.x == 0.0 && normal.y == 0.0;
    let if_so = |so: bool, symmetry: Symmetry| if so { symmetry } else { Symmetry::None };
    if raw.kind == Kind::File {
        let (mut emitters, mut lights) = (Vec::new(), Vec::new());
        for part in scope.file(raw, folder)? {
            let whole = one(Emitter::Point, part.emission);
            emitters.push(whole.weighing(raw.power * part.share));
            lights.push(part.own);
        }
        return Ok((emitters, lights, Symmetry::None));
    }
    let own = scope.stated(raw, folder)?.unwrap_or(Own::Design);
    let (emitters, symmetry) = match raw.kind {
        Kind::Isotropic => (
            vec![one(Emitter::Point, Emission::Isotropic)],
            if_so(centred, Symmetry::Square),
        ),
        Kind::Cosine => {
            let exponent = raw.exponent.unwrap_or_default();
            at.within(&key("exponent"), exponent, 0.0, 1e6)?;
            (
                vec![one(Emitter::Point, Emission::CosinePower { exponent })],
                if_so(upright, Symmetry::Square),
            )
        }
        Kind::Rectangle => {
            let size = raw.size_mm.unwrap_or_default();
            for v in size {
                at.length(&key("size_mm"), v)?;
            }
            let emitter = Emitter::Rectangle {
                half_x: 0.5 * size[0],
                half_y: 0.5 * size[1],
            };
            let square = size[0].to_bits() == size[1].to_bits();
            let of_sides = if_so(square, Symmetry::Square).max(Symmetry::Rectangle);
            (
                vec![one(emitter, Emission::LAMBERTIAN)],
                if_so(upright, of_sides),
            )
        }
        Kind::Chip => chip(raw, led, region, key, at)?,
        Kind::File => (Vec::new(), Symmetry::None),
    };
    let lights = vec![own; emitters.len()];
    Ok((emitters, lights, symmetry))
}

/// The top and the four sides of the box, those that emit anything.
fn chip(
    raw: &Source,
    led: &Led,
    region: Region,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<(Vec<tracer::Source>, Symmetry), ConfigError> {
    let powers = raw.face_powers.unwrap_or_default();
    for power in powers {
        at.within(&key("face_powers"), power, 0.0, 1e12)?;
    }
    let sum: f64 = powers.iter().sum();
    if sum <= 0.0 {
        let got = format!("{powers:?}");
        return Err(at.value(&key("face_powers"), got, "a power above 0 somewhere"));
    }
    let [x, y] = led.size_mm.map(|length| 0.5 * length);
    let z = 0.5 * led.height_mm;
    // Middle, normal and half lengths of every face; u is level on the sides, and v rises.
    let faces = [
        (DVec3::new(0.0, 0.0, 2.0 * z), DVec3::Z, [x, y]),
        (DVec3::new(x, 0.0, z), DVec3::X, [y, z]),
        (DVec3::new(-x, 0.0, z), -DVec3::X, [y, z]),
        (DVec3::new(0.0, y, z), DVec3::Y, [x, z]),
        (DVec3::new(0.0, -y, z), -DVec3::Y, [x, z]),
    ];
    let emitting = faces
        .into_iter()
        .zip(powers)
        .filter(|(_, power)| *power > 0.0);
    let sources = emitting.map(|((middle, normal, [half_x, half_y]), power)| {
        let emitter = Emitter::Rectangle { half_x, half_y };
        tracer::Source::new(&raw.name, middle, region, emitter, Emission::LAMBERTIAN)
            .facing(normal)
            .weighing(raw.power * power / sum)
    });
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
    let [_, right, left, back, front] = powers;
    let symmetry = if !(same(right, left) && same(back, front)) {
        Symmetry::None
    } else if same(right, back) && same(x, y) {
        Symmetry::Square
    } else {
        Symmetry::Rectangle
    };
    Ok((sources.collect(), symmetry))
}
