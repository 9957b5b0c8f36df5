// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films, checked: layers on the dome, layers on the metal of the mirror and of the LED.

use std::path::Path;
use std::sync::Arc;

use super::polariser;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::films::{FilmStacks, Films, GivenIndex, IndexSource, Stack};
use crate::schema::films::{Index, Layer};
use crate::schema::reflectors::{Law, Metal};
use crate::{material, schema};
use runtime::serde_arrays::List;

/// The films of `raw`, if there are any.
pub(crate) fn resolve(
    raw: &schema::Design,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Option<Films>, ConfigError> {
    let dome = raw.dome.as_ref();
    let dome = dome.map_or(&[][..], |dome| &dome.shared.coating);
    let mirror = on_metal("mirror", &raw.mirror.kind, folder, at)?;
    if mirror.is_mirror() && raw.files.mirror.is_some() {
        let key = if mirror.filter.is_some() { "mirror.filter" } else { "mirror.substrate" };
        let expected = "no such table beside [files.mirror]";
        return Err(at.value(key, "given", expected));
    }
    let led_top = on_metal("led", &raw.led.kind.0, folder, at)?;
    let sides = raw.led.shared.sides.as_ref();
    let led_sides =
        sides.map(|sides| on_metal("led.sides", &sides.kind, folder, at)).transpose()?;
    let has_mirror = [&mirror, &led_top].into_iter().chain(&led_sides).any(Stack::is_mirror);
    if dome.is_empty() && !has_mirror {
        return Ok(None);
    }
    let dome = Stack::new("dome", dome, folder, at)?;
    let stated = FilmStacks { dome, mirror, led_top, led_sides };
    Films::new(&Arc::new(stated), wavelength_nm, at).map(Some)
}

/// The layers and the metal under them, or the table, of the reflector of the table `table`; without
/// metal none.
fn on_metal(
    table: &str,
    law: &Law<Metal>,
    folder: &Path,
    at: &Context,
) -> Result<Stack, ConfigError> {
    match law {
        Law::Specular(metal) => Stack::on_metal(table, metal, folder, at),
        _ => Ok(Stack::default()),
    }
}

impl Stack {
    /// The layers `coating` of the table `table`.
    pub(crate) fn new(
        table: &str,
        coating: &[Layer],
        folder: &Path,
        at: &Context,
    ) -> Result<Self, ConfigError> {
        let layers = coating.iter().enumerate().map(|(number, layer)| {
            let key = format!("{table}.coating[{}]", number + 1);
            let thickness_key = format!("{key}.thickness_nm");
            let thickness = at.within(&thickness_key, layer.thickness_nm, 1e-3, 1e9)?;
            let file = layer.material_file.as_ref();
            Ok((source(&key, layer.index, file, folder, at)?, thickness))
        });
        Ok(Self { layers: layers.collect::<Result<_, ConfigError>>()?, ..Self::default() })
    }

    /// The layers and the metal under them, or the table, of a specular reflector.
    pub(crate) fn on_metal(
        table: &str,
        stated: &Metal,
        folder: &Path,
        at: &Context,
    ) -> Result<Self, ConfigError> {
        if let Some(filter) = &stated.filter {
            if stated.substrate.is_some() || !stated.coating.is_empty() {
                let expected = "no such table beside `filter`, which says what is reflected";
                let key = if stated.substrate.is_some() { "substrate" } else { "coating" };
                return Err(at.value(&format!("{table}.{key}"), "given", expected));
            }
            let filter = Some(polariser::filter_shares(filter, &format!("{table}.filter"), at)?);
            return Ok(Self { filter, ..Self::default() });
        }
        let key = format!("{table}.substrate");
        let Some(metal) = &stated.substrate else {
            if stated.coating.is_empty() {
                return Ok(Self::default());
            }
            return Err(at.value(&key, "missing", "what the layers lie on"));
        };
        let file = metal.material_file.as_ref();
        Ok(Self {
            substrate: Some(source(&key, metal.index, file, folder, at)?),
            ..Self::new(table, &stated.coating, folder, at)?
        })
    }
}

fn source(
    key: &str,
    index: Option<Index>,
    file: Option<&String>,
    folder: &Path,
    at: &Context,
) -> Result<IndexSource, ConfigError> {
    let (key, value) = match (index, file) {
        (Some(Index::Real(n)), None) => (format!("{key}.index"), GivenIndex::Fixed([n, 0.0])),
        (Some(Index::Complex(List(index))), None) => {
            (format!("{key}.index"), GivenIndex::Fixed(index))
        }
        (None, Some(name)) => {
            let key = format!("{key}.material_file");
            let material = material::read(&folder.join(name), None)
                .map_err(|e| at.value(&key, name, &format!("a readable material: {e:#}")))?;
            let name = name.clone();
            (key, GivenIndex::File { name, material })
        }
        _ => {
            let expected = "one of `index` and `material_file`";
            return Err(at.value(key, "both or neither", expected));
        }
    };
    Ok(IndexSource { key, value })
}
