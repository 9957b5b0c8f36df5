// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]`, checked: what emits, in what medium, with what symmetry.
//!
//! Whether sources stand where they say is checked on the scene, see `stages::scene_check`.

use std::path::Path;

use tracer::glam::DVec3;
use tracer::{Emission, Emitter, Region};

use super::source_spectra::Scope;
use crate::config::check::{Context, shown};
use crate::config::design::Led;
use crate::config::design::files::Shining;
use crate::config::design::solids::{self, CheckedSolid};
use crate::config::design::sources::{CheckedSource, Own};
use crate::config::error::ConfigError;
use crate::config::schema;
use crate::config::schema::solids::Per;
use crate::config::schema::sources::{Source, SourceKind};
use crate::content_hash::sha256_hex;
use crate::metrics::illuminance::Symmetry;
use crate::spectrum::Weighting;

pub(in crate::config) fn resolve(
    raw: &schema::Design,
    (led, domed, solids): (&Led, bool, &[CheckedSolid]),
    weighting: Weighting,
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedSource>, ConfigError> {
    if !raw.sources.is_empty() && raw.files.source.is_some() {
        let expected = "no such table beside [[sources]], which have files of their own";
        return Err(at.value("files.source", "given", expected));
    }
    let mut checked: Vec<CheckedSource> = Vec::new();
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
        checked.push(CheckedSource {
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
pub(in crate::config) fn of_files(
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
    solids: &[CheckedSolid],
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
            let known: Vec<(&CheckedSolid, Region)> =
                of_package.into_iter().chain(around).collect();
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
    let of = |kinds: &[SourceKind]| kinds.contains(&raw.kind);
    let faces = of(&[SourceKind::Cosine, SourceKind::Rectangle]);
    let given = [
        (
            "position_mm",
            shown(raw.position_mm.as_ref()),
            !of(&[SourceKind::Chip]),
        ),
        (
            "size_mm",
            shown(raw.size_mm.as_ref()),
            of(&[SourceKind::Rectangle]),
        ),
        (
            "exponent",
            shown(raw.exponent.as_ref()),
            of(&[SourceKind::Cosine]),
        ),
        (
            "face_powers",
            shown(raw.face_powers.as_ref()),
            of(&[SourceKind::Chip]),
        ),
        ("file", shown(raw.file.as_ref()), of(&[SourceKind::File])),
        ("normal", shown(raw.normal.as_ref()), faces),
        (
            "inside",
            shown(raw.inside.as_ref()),
            !of(&[SourceKind::Chip]),
        ),
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
    if raw.kind == SourceKind::File {
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
        SourceKind::Isotropic => (
            vec![one(Emitter::Point, Emission::Isotropic)],
            if_so(centred, Symmetry::Square),
        ),
        SourceKind::Cosine => {
            let exponent = raw.exponent.unwrap_or_default();
            at.within(&key("exponent"), exponent, 0.0, 1e6)?;
            (
                vec![one(Emitter::Point, Emission::CosinePower { exponent })],
                if_so(upright, Symmetry::Square),
            )
        }
        SourceKind::Rectangle => {
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
        SourceKind::Chip => chip(raw, led, region, key, at)?,
        SourceKind::File => (Vec::new(), Symmetry::None),
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
