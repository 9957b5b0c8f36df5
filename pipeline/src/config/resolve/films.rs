// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films, checked: layers on the dome, layers on the metal of the mirror.

use std::path::Path;
use std::sync::Arc;

use crate::config::check::Context;
use crate::config::design::films::{FilmStacks, Films, GivenIndex, IndexSource, Stack, films};
use crate::config::error::ConfigError;
use crate::config::schema::films::{Index, Layer, Substrate};
use crate::config::schema::{self, Reflection};
use crate::material;

/// The films of `raw`, if there are any.
pub(in crate::config) fn resolve(
    raw: &schema::Design,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Option<Films>, ConfigError> {
    let dome = raw.dome.as_ref().map_or(&[][..], |dome| &dome.coating);
    let mirror = &raw.mirror;
    let specular = mirror.kind == Reflection::Specular;
    let metal = Stack::on_metal(
        "mirror",
        (&mirror.coating, mirror.substrate.as_ref()),
        specular,
        folder,
        at,
    )?;
    if mirror.substrate.is_some() && raw.files.mirror.is_some() {
        let expected = "no such table beside [files.mirror]";
        return Err(at.value("mirror.substrate", "given", expected));
    }
    if dome.is_empty() && mirror.substrate.is_none() {
        return Ok(None);
    }
    let stated = FilmStacks {
        dome: Stack::new("dome", dome, folder, at)?,
        mirror: metal,
    };
    films(Arc::new(stated), wavelength_nm, at).map(Some)
}

impl Stack {
    /// The layers `coating` of the table `table`.
    pub(in crate::config) fn new(
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
        Ok(Self {
            layers: layers.collect::<Result<_, ConfigError>>()?,
            substrate: None,
        })
    }

    /// The layers and the metal under them of a reflector, which has to be `specular` with them.
    pub(in crate::config) fn on_metal(
        table: &str,
        (coating, substrate): (&[Layer], Option<&Substrate>),
        specular: bool,
        folder: &Path,
        at: &Context,
    ) -> Result<Self, ConfigError> {
        let key = format!("{table}.substrate");
        let Some(metal) = substrate else {
            if coating.is_empty() {
                return Ok(Self::default());
            }
            return Err(at.value(&key, "missing", "what the layers lie on"));
        };
        if !specular {
            let expected = format!("\"specular\" with {key}");
            return Err(at.value(&format!("{table}.kind"), "another", &expected));
        }
        let file = metal.material_file.as_ref();
        Ok(Self {
            substrate: Some(source(&key, metal.index, file, folder, at)?),
            ..Self::new(table, coating, folder, at)?
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
        (Some(Index::Complex(index)), None) => (format!("{key}.index"), GivenIndex::Fixed(index)),
        (None, Some(name)) => {
            let key = format!("{key}.material_file");
            let material = material::read(&folder.join(name))
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
