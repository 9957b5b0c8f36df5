// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films of a design: layers on the dome, and layers on the metal of the mirror, at the wavelength.

use std::path::Path;
use std::sync::Arc;

use num_complex::Complex64;
use rcwa::material::Material;
use serde::{Deserialize, Serialize};
use tracer::{Film, LayeredMirror, SurfaceModel};

use super::ConfigError;
use super::check::Context;
use super::schema::{self, Reflection};

/// `[[dome.coating]]`, `[[mirror.coating]]`: one layer.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Refractive index: n or [n, k].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<Index>,
    /// Material file in refractiveindex.info's YAML form, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<String>,
    /// Thickness, nm.
    pub thickness_nm: f64,
}

/// `[mirror.substrate]`: the metal under the layers.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Substrate {
    /// Refractive index: n or [n, k].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<Index>,
    /// Material file in refractiveindex.info's YAML form, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<String>,
}

/// A refractive index as written.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Index {
    /// n.
    Real(f64),
    /// [n, k].
    Complex([f64; 2]),
}

/// A layer at the wavelength.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coat {
    /// Refractive index [n, k].
    pub index: [f64; 2],
    /// Thickness, nm.
    pub thickness_nm: f64,
}

/// All films of a design at the wavelength.
#[derive(Debug, Clone, Serialize)]
pub struct Films {
    /// Layers on the dome, from the silicone outwards.
    pub dome: Vec<Coat>,
    /// Layers on the mirror, from the light towards the metal.
    pub mirror: Vec<Coat>,
    /// Index [n, k] of the metal.
    pub substrate: Option<[f64; 2]>,
    #[serde(skip)]
    stated: Arc<Stated>,
}

/// What the file says, whatever the wavelength.
#[derive(Debug)]
struct Stated {
    dome: Stack,
    mirror: Stack,
}

/// Layers, and the metal under them if there is one, whatever the wavelength.
#[derive(Debug, Default)]
pub(super) struct Stack {
    layers: Vec<(Source, f64)>,
    substrate: Option<Source>,
}

/// Layers and metal at the wavelength.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Coats {
    /// Layers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<Coat>,
    /// Index [n, k] of the metal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub substrate: Option<[f64; 2]>,
}

/// Where an index comes from.
#[derive(Debug)]
struct Source {
    /// Key of the index or the file.
    key: String,
    value: Given,
}

#[derive(Debug)]
enum Given {
    Fixed([f64; 2]),
    File { name: String, material: Material },
}

/// The films of `raw`, if there are any.
pub(super) fn resolve(
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
    let stated = Stated {
        dome: Stack::new("dome", dome, folder, at)?,
        mirror: metal,
    };
    films(Arc::new(stated), wavelength_nm, at).map(Some)
}

impl Stack {
    /// The layers `coating` of the table `table`.
    pub(super) fn new(
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
    pub(super) fn on_metal(
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

    /// At a wavelength.
    pub(super) fn at(&self, wavelength_nm: f64, at: &Context) -> Result<Coats, ConfigError> {
        let coat = |(source, thickness_nm): &(Source, f64)| {
            Ok(Coat {
                index: source.at(wavelength_nm, at)?,
                thickness_nm: *thickness_nm,
            })
        };
        let substrate = self.substrate.as_ref();
        Ok(Coats {
            layers: self
                .layers
                .iter()
                .map(coat)
                .collect::<Result<_, ConfigError>>()?,
            substrate: substrate.map(|s| s.at(wavelength_nm, at)).transpose()?,
        })
    }
}

impl Coats {
    /// An interface with the layers on it; `None` where there are none.
    pub fn interface(&self, wavelength_nm: f64) -> Result<Option<SurfaceModel>, tracer::Error> {
        if self.layers.is_empty() {
            return Ok(None);
        }
        let film = film(&self.layers, wavelength_nm)?;
        Ok(Some(SurfaceModel::Layered(Arc::new(film))))
    }

    /// The metal with its layers, of which `factor` is kept; `None` where no metal is given.
    pub fn mirror(
        &self,
        wavelength_nm: f64,
        factor: f64,
    ) -> Result<Option<SurfaceModel>, tracer::Error> {
        let Some([n, k]) = self.substrate else {
            return Ok(None);
        };
        let mirror = LayeredMirror {
            film: film(&self.layers, wavelength_nm)?,
            substrate: Complex64::new(n, k),
            factor,
        };
        Ok(Some(SurfaceModel::LayeredMirror(Arc::new(mirror))))
    }
}

fn source(
    key: &str,
    index: Option<Index>,
    file: Option<&String>,
    folder: &Path,
    at: &Context,
) -> Result<Source, ConfigError> {
    let (key, value) = match (index, file) {
        (Some(Index::Real(n)), None) => (format!("{key}.index"), Given::Fixed([n, 0.0])),
        (Some(Index::Complex(index)), None) => (format!("{key}.index"), Given::Fixed(index)),
        (None, Some(name)) => {
            let key = format!("{key}.material_file");
            let material = crate::material::read(&folder.join(name))
                .map_err(|e| at.value(&key, name, &format!("a readable material: {e:#}")))?;
            let name = name.clone();
            (key, Given::File { name, material })
        }
        _ => {
            let expected = "one of `index` and `material_file`";
            return Err(at.value(key, "both or neither", expected));
        }
    };
    Ok(Source { key, value })
}

impl Source {
    fn at(&self, wavelength_nm: f64, at: &Context) -> Result<[f64; 2], ConfigError> {
        let (index, got) = match &self.value {
            Given::Fixed(index) => (*index, format!("{index:?}")),
            Given::File { name, material } => {
                let (n, k) = crate::material::index(material, wavelength_nm).map_err(|e| {
                    at.value(&self.key, name, &format!("a readable material: {e:#}"))
                })?;
                ([n, k], format!("{name}: [{n}, {k}]"))
            }
        };
        let [n, k] = index;
        let good = n > 0.0 && k >= 0.0 && n < 100.0 && k < 1000.0;
        if good {
            Ok(index)
        } else {
            let expected = "a refractive index n or [n, k] with n above 0 and k not below 0";
            Err(at.value(&self.key, got, expected))
        }
    }
}

fn films(stated: Arc<Stated>, wavelength_nm: f64, at: &Context) -> Result<Films, ConfigError> {
    let mirror = stated.mirror.at(wavelength_nm, at)?;
    Ok(Films {
        dome: stated.dome.at(wavelength_nm, at)?.layers,
        mirror: mirror.layers,
        substrate: mirror.substrate,
        stated,
    })
}

impl Films {
    /// The same films at another wavelength.
    pub(super) fn tuned(&self, wavelength_nm: f64, at: &Context) -> Result<Self, ConfigError> {
        films(Arc::clone(&self.stated), wavelength_nm, at)
    }

    /// Whether the mirror is of metal.
    pub fn mirrors(&self) -> bool {
        self.substrate.is_some()
    }

    /// What light meets on the dome; `None` where it is bare.
    pub fn on_dome(&self, wavelength_nm: f64) -> Result<Option<SurfaceModel>, tracer::Error> {
        let coats = Coats {
            layers: self.dome.clone(),
            substrate: None,
        };
        coats.interface(wavelength_nm)
    }

    /// The mirror, of which `factor` is kept; `None` where no metal is given.
    pub fn mirror(
        &self,
        wavelength_nm: f64,
        factor: f64,
    ) -> Result<Option<SurfaceModel>, tracer::Error> {
        let coats = Coats {
            layers: self.mirror.clone(),
            substrate: self.substrate,
        };
        coats.mirror(wavelength_nm, factor)
    }
}

fn film(coats: &[Coat], wavelength_nm: f64) -> Result<Film, tracer::Error> {
    let layers = coats.iter().map(|coat| tracer::Layer {
        index: Complex64::new(coat.index[0], coat.index[1]),
        thickness_nm: coat.thickness_nm,
    });
    Film::new(wavelength_nm, layers.collect())
}
