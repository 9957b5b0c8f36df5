// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]`, checked: what emits, in what medium, with what symmetry.
//!
//! Whether sources stand where they say is checked on the scene, see `stages::scene_check`.

use std::path::Path;

use tracer::glam::{DMat3, DVec3};
use tracer::{Emission, Emitter, Region};

use metrics::illuminance::Symmetry;
use metrics::kinds::Weighting;
use runtime::content_hash::sha256_of_file;

use super::source_spectra::Scope;
use super::{form, source_table};
use crate::check::{Context, MAX_LENGTH_MM};
use crate::error::ConfigError;
use crate::resolved::files::{SourceFile, is_own_image};
use crate::resolved::led::Led;
use crate::resolved::solids::{self, CheckedSolid};
use crate::resolved::sources::{CheckedEmitter, CheckedSource, EmitterLight, Part};
use crate::schema;
use crate::schema::solids::Per;
use crate::schema::sources::{ChipSource, FaceLaw, Source, SourceForm, SourceKeys};
use runtime::serde_arrays::List;

pub(crate) fn resolve(
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
        let table = format!("sources[{}].", number + 1);
        let at = &Context { file: at.file, prefix: &table };
        let SourceKeys { name, power, .. } = &source.shared;
        if name.is_empty() || checked.iter().any(|c| c.name() == name) {
            let expected = "a name, and none twice";
            return Err(at.value("name", format!("{name:?}"), expected));
        }
        at.within("power", *power, 1e-12, 1e12)?;
        if let Some(channel) = &source.shared.channel {
            at.file_name("channel", channel)?;
            let is_same = |other: &&CheckedSource| {
                other.channel() != channel
                    && other.channel().to_lowercase() == channel.to_lowercase()
            };
            if let Some(other) = checked.iter().find(is_same) {
                let expected = format!("{:?} as before, or another name", other.channel());
                return Err(at.value("channel", format!("{channel:?}"), &expected));
            }
        }
        let region = surroundings(source, domed, solids, at)?;
        let scope = Scope { at, weighting };
        let (emitters, symmetry) = emitters(source, led, region, folder, &scope)?;
        let sha256 = |name: &String| {
            sha256_of_file(&folder.join(name)).map_err(|e| {
                let expected = format!("a file that can be read: {e}");
                at.value("file", format!("{name:?}"), &expected)
            })
        };
        let file_sha256 = source.kind.file().map(sha256).transpose()?;
        checked.push(CheckedSource { stated: source.clone(), file_sha256, emitters, symmetry });
    }
    Ok(checked)
}

/// Emission of `[files.source]`, in the light that it or its file states.
pub(crate) fn of_files(
    raw: &schema::Design,
    weighting: Weighting,
    folder: &Path,
    at: &Context,
) -> Result<Option<SourceFile>, ConfigError> {
    let at = &Context { file: at.file, prefix: "files.source." };
    let scope = Scope { at, weighting };
    let source = raw.files.source.as_ref();
    source.map(|raw| scope.upward(raw, folder)).transpose()
}

/// Stated surroundings of a source.
fn surroundings(
    raw: &Source,
    domed: bool,
    solids: &[CheckedSolid],
    at: &Context,
) -> Result<Region, ConfigError> {
    match raw.kind.place().and_then(|(_, inside)| inside) {
        Some("silicone") if !domed => {
            let expected = "\"air\" without [dome]";
            Err(at.value("inside", "\"silicone\"", expected))
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
                at.value("inside", format!("{name:?}"), &expected)
            })
        }
    }
}

fn emitters(
    raw: &Source,
    led: &Led,
    region: Region,
    folder: &Path,
    scope: &Scope<'_>,
) -> Result<(Vec<CheckedEmitter>, Symmetry), ConfigError> {
    let at = scope.at;
    let (place, _) = raw.kind.place().unwrap_or_default();
    for v in place {
        at.within("position_mm", v, -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
    }
    let normal = match &raw.kind {
        SourceForm::Cosine(cosine) => cosine.normal,
        SourceForm::Rectangle(rectangle) => rectangle.normal,
        _ => None,
    };
    let normal = normal.map(|List(normal)| at.direction("normal", normal));
    let normal = normal.transpose()?.unwrap_or(DVec3::Z);
    let keys = &raw.shared;
    let one = |emitter: Emitter, emission: Emission| {
        let position = DVec3::from_array(place);
        let source = tracer::Source::new(&keys.name, position, region, emitter, emission);
        source.facing(normal).weighing(keys.power)
    };
    let centred = place[0] == 0.0 && place[1] == 0.0;
    let upright = centred && normal.x == 0.0 && normal.y == 0.0;
    let if_so = |so: bool, symmetry: Symmetry| if so { symmetry } else { Symmetry::None };
    let turned = |parts: Vec<Part>,
                  rotation: Option<List<f64, 3>>|
     -> Result<Vec<CheckedEmitter>, ConfigError> {
        let angles = rotation.map_or([0.0; 3], |List(angles)| angles);
        let turn = form::rotation(angles, "rotation_deg", at)?;
        let part = |part: Part| {
            let whole = if turn == DMat3::IDENTITY {
                one(Emitter::Point, part.emission)
            } else {
                let emission = match part.emission {
                    Emission::Rays(rays) => Emission::Rays(rays.turned(&turn).into()),
                    other => other,
                };
                one(Emitter::Point, emission).facing(turn.z_axis).lying_along(turn.x_axis)
            };
            CheckedEmitter { source: whole.weighing(keys.power * part.share), light: part.light }
        };
        Ok(parts.into_iter().map(part).collect())
    };
    let (emitters, symmetry) = match &raw.kind {
        SourceForm::File(file) => {
            let parts = scope.file(keys, file, folder)?;
            return Ok((turned(parts, file.rotation_deg)?, Symmetry::None));
        }
        SourceForm::Table(table) => {
            let (emission, symmetry) = source_table::emission(table, folder, at)?;
            let light = scope.stated(keys, None, folder)?.unwrap_or(EmitterLight::Design);
            let emitters = turned(vec![Part { emission, share: 1.0, light }], table.rotation_deg)?;
            return Ok((emitters, if_so(centred && table.rotation_deg.is_none(), symmetry)));
        }
        SourceForm::Isotropic(_) => {
            (vec![one(Emitter::Point, Emission::Isotropic)], if_so(centred, Symmetry::Square))
        }
        SourceForm::Cosine(cosine) => {
            let exponent = at.within("exponent", cosine.exponent, 0.0, 1e6)?;
            (
                vec![one(Emitter::Point, Emission::CosinePower { exponent })],
                if_so(upright, Symmetry::Square),
            )
        }
        SourceForm::Rectangle(rectangle) => {
            let size = rectangle.size_mm.0;
            for v in size {
                at.length("size_mm", v)?;
            }
            let emitter = Emitter::Rectangle { half_x: 0.5 * size[0], half_y: 0.5 * size[1] };
            let square = size[0].to_bits() == size[1].to_bits();
            let of_sides = if_so(square, Symmetry::Square).max(Symmetry::Rectangle);
            (vec![one(emitter, Emission::LAMBERTIAN)], if_so(upright, of_sides))
        }
        SourceForm::Chip(chip) => self::chip(keys, chip, led, region, scope)?,
    };
    let light = scope.stated(keys, None, folder)?;
    let light = light.unwrap_or(EmitterLight::Design);
    let emitter = |source| CheckedEmitter { source, light: light.clone() };
    Ok((emitters.into_iter().map(emitter).collect(), symmetry))
}

/// The top and the four sides of the box, those that emit anything.
fn chip(
    keys: &SourceKeys,
    stated: &ChipSource,
    led: &Led,
    region: Region,
    scope: &Scope<'_>,
) -> Result<(Vec<tracer::Source>, Symmetry), ConfigError> {
    let at = scope.at;
    let powers = stated.face_powers.0;
    for power in powers {
        at.within("face_powers", power, 0.0, 1e12)?;
    }
    let sum: f64 = powers.iter().sum();
    if sum <= 0.0 {
        let got = format!("{powers:?}");
        return Err(at.value("face_powers", got, "a power above 0 somewhere"));
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
    let law = |stated: Option<&FaceLaw>, table: &str| {
        let prefix = format!("{}{table}.", at.prefix);
        let at = Context { prefix: &prefix, ..*at };
        let law = stated.map(|law| source_table::of_face(law, &at)).transpose()?;
        Ok::<_, ConfigError>(law.unwrap_or((Emission::LAMBERTIAN, Symmetry::Square)))
    };
    let (top, of_top) = law(stated.top.as_ref(), "top")?;
    let (sides, _) = law(stated.sides.as_ref(), "sides")?;
    // Mirrors keep what is up, and turn the level plane round.
    let is_even = match &sides {
        Emission::Table(table) => is_own_image(table, |phi| 180.0 - phi),
        _ => true,
    };
    let emitting = faces.into_iter().zip(powers).filter(|(_, power)| *power > 0.0);
    let sources = emitting.map(|((middle, normal, [half_x, half_y]), power)| {
        let emitter = Emitter::Rectangle { half_x, half_y };
        let emission = if normal == DVec3::Z { &top } else { &sides };
        tracer::Source::new(&keys.name, middle, region, emitter, emission.clone())
            .facing(normal)
            .weighing(keys.power * power / sum)
    });
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
    let [_, right, left, back, front] = powers;
    let symmetry = if !(same(right, left) && same(back, front) && is_even) {
        Symmetry::None
    } else if same(right, back) && same(x, y) {
        Symmetry::Square
    } else {
        Symmetry::Rectangle
    };
    Ok((sources.collect(), symmetry.min(of_top)))
}
