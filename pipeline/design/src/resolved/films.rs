// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films at a wavelength: layers on the dome, on the metal of the mirror, on solids.

use std::sync::Arc;

use bsdf::{AxisShares, Polariser};
use num_complex::Complex64;
use rcwa::material::Material;
use serde::{Serialize, Serializer};
use serde_json::json;
use tracer::{Film, LayeredMirror, SurfaceModel};

use super::polariser::StatedShares;
use crate::check::Context;
use crate::error::ConfigError;

/// A layer at the wavelength.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coat {
    /// Refractive index [n, k].
    pub index: [f64; 2],
    /// Thickness, nm.
    pub thickness_nm: f64,
}

/// All films of a design at the wavelength.
#[derive(Debug, Clone)]
pub struct Films {
    /// Layers on the dome, from the silicone outwards.
    pub dome: Coats,
    /// Layers on the mirror, from the light towards the metal, and the metal.
    pub mirror: Coats,
    /// The same of the top of the LED.
    pub led_top: Coats,
    /// The same of its sides.
    pub led_sides: Coats,
    pub(crate) stated: Arc<FilmStacks>,
}

impl Serialize for Films {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { dome, mirror, led_top, led_sides, stated } = self;
        let Coats { layers, substrate, reflectance } = mirror;
        let mut films = json!({"dome": dome.layers, "mirror": layers, "substrate": substrate});
        if let Some(rows) = reflectance {
            films["mirror_reflectance"] = json!(rows);
        }
        // Other designs have the fields of those that cannot say otherwise.
        if [led_top, led_sides].into_iter().any(|coats| *coats != Coats::default()) {
            films["led"] = json!([led_top, led_sides]);
        }
        // One trace may have light of many wavelengths.
        let FilmStacks { dome: _, mirror, led_top, led_sides } = &**stated;
        let of_led = [Some(led_top), led_sides.as_ref()];
        let filters = [Some(mirror)].into_iter().chain(of_led);
        let filters: Vec<_> = filters.map(|stack| stack?.filter.as_ref()).collect();
        if filters.iter().any(Option::is_some) {
            films["filters"] = json!(filters);
        }
        films.serialize(serializer)
    }
}

/// Film as stated, whatever the wavelength.
#[derive(Debug)]
pub(crate) struct FilmStacks {
    pub(crate) dome: Stack,
    pub(crate) mirror: Stack,
    /// On the top of the LED.
    pub(crate) led_top: Stack,
    /// On its sides, where they are not as the top.
    pub(crate) led_sides: Option<Stack>,
}

/// Layers, and the metal under them if there is one, whatever the wavelength.
#[derive(Debug, Default)]
pub(crate) struct Stack {
    pub(crate) layers: Vec<(IndexSource, f64)>,
    pub(crate) substrate: Option<IndexSource>,
    /// The table in their place.
    pub(crate) filter: Option<StatedShares>,
}

impl Stack {
    /// True of a mirror by metal or by a table.
    pub(crate) fn is_mirror(&self) -> bool {
        self.substrate.is_some() || self.filter.is_some()
    }

    /// At a wavelength.
    pub(crate) fn at(&self, wavelength_nm: f64, at: &Context) -> Result<Coats, ConfigError> {
        let coat = |(source, thickness_nm): &(IndexSource, f64)| {
            Ok(Coat { index: source.at(wavelength_nm, at)?, thickness_nm: *thickness_nm })
        };
        let substrate = self.substrate.as_ref();
        Ok(Coats {
            layers: self.layers.iter().map(coat).collect::<Result<_, ConfigError>>()?,
            substrate: substrate.map(|s| s.at(wavelength_nm, at)).transpose()?,
            reflectance: self
                .filter
                .as_ref()
                .map(|filter| filter.reflectance_at(wavelength_nm, at))
                .transpose()?,
        })
    }
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
    /// Rows (angle in degrees, reflected share) of a table in their place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<Vec<[f64; 2]>>,
}

/// Origin of an index.
#[derive(Debug)]
pub(crate) struct IndexSource {
    /// Key of the index or the file.
    pub(crate) key: String,
    pub(crate) value: GivenIndex,
}

#[derive(Debug)]
pub(crate) enum GivenIndex {
    Fixed([f64; 2]),
    File { name: String, material: Material },
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

    /// The metal with its layers, or the table, of whose light `factor` is kept; `None` where neither
    /// is given.
    ///
    /// # Errors
    /// None that the checks have left.
    pub fn mirror(&self, wavelength_nm: f64, factor: f64) -> anyhow::Result<Option<SurfaceModel>> {
        if let Some(rows) = &self.reflectance {
            let kept: Vec<[f64; 2]> =
                rows.iter().map(|[angle, share]| [*angle, factor * share]).collect();
            let shares = AxisShares::new(&[[0.0, 0.0]], &kept)?;
            // Alike indices on both sides: angles are those of the light that it meets.
            let table = Polariser::of_unpolarised(&shares, [1.0; 2])?;
            return Ok(Some(SurfaceModel::Coating(Arc::new(table))));
        }
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

impl IndexSource {
    fn at(&self, wavelength_nm: f64, at: &Context) -> Result<[f64; 2], ConfigError> {
        let (index, got) = match &self.value {
            GivenIndex::Fixed(index) => (*index, format!("{index:?}")),
            GivenIndex::File { name, material } => {
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

impl Films {
    /// At a wavelength.
    pub(crate) fn new(
        stated: &Arc<FilmStacks>,
        wavelength_nm: f64,
        at: &Context,
    ) -> Result<Self, ConfigError> {
        let mirror = stated.mirror.at(wavelength_nm, at)?;
        let dome = stated.dome.at(wavelength_nm, at)?;
        let led_top = stated.led_top.at(wavelength_nm, at)?;
        let led_sides = match &stated.led_sides {
            Some(sides) => sides.at(wavelength_nm, at)?,
            None => led_top.clone(),
        };
        Ok(Self { dome, mirror, led_top, led_sides, stated: Arc::clone(stated) })
    }
}

fn film(coats: &[Coat], wavelength_nm: f64) -> Result<Film, tracer::Error> {
    let layers = coats.iter().map(|coat| tracer::Layer {
        index: Complex64::new(coat.index[0], coat.index[1]),
        thickness_nm: coat.thickness_nm,
    });
    Film::new(wavelength_nm, layers.collect())
}
