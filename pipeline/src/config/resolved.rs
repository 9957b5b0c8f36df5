// SPDX-License-Identifier: MIT OR Apache-2.0
//! The checked design: every value lies in its range, every file it names was read.

use std::fmt::Display;
use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::raw::{self, Extent, Reflection};
use super::{ConfigError, shapes};
use crate::geometry;

/// Tolerance for lengths that must agree, relative.
const SAME_LENGTH: f64 = 1e-9;

/// A checked design.
#[derive(Debug, Clone, Serialize)]
pub struct Design {
    /// Short name, used for output files.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Where it came from and the hash of that text.
    pub provenance: Provenance,
    /// The dome, if there is one.
    pub dome: Option<Dome>,
    /// Relief of the dome from the axis outwards; empty on a smooth dome.
    pub elements: Elements,
    /// Inside of the dome (air where there is none).
    pub silicone: Silicone,
    /// Reflector in the plane z = 0.
    pub mirror: Mirror,
    /// The light source box.
    pub led: Led,
    /// Packages side by side.
    pub array: raw::Array,
    /// Vacuum wavelength, nm.
    pub wavelength_nm: f64,
    /// Plane receiver.
    pub receiver: raw::Receiver,
    /// Far-field receiver.
    pub far_field: raw::FarField,
    /// Wave/ray hybrid and its tables.
    pub hybrid: raw::Hybrid,
    /// Monte Carlo.
    pub trace: raw::Trace,
}

/// Where a design came from.
#[derive(Debug, Clone, Serialize)]
pub struct Provenance {
    /// File as given.
    pub file: String,
    /// Hexadecimal SHA-256 of its text.
    pub sha256: String,
}

/// Truncated sphere z(r) = √(R² - r²) - (R - H) on a short cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Dome {
    /// Radius R of the sphere, mm.
    pub sphere_radius_mm: f64,
    /// Height H of the pole, mm.
    pub height_mm: f64,
    /// Largest radius, mm.
    pub radius_mm: f64,
}

impl Dome {
    /// Height of the sphere at radius `r_mm` from the axis, mm.
    pub fn height_at(&self, r_mm: f64) -> f64 {
        (self.sphere_radius_mm.powi(2) - r_mm.powi(2))
            .max(0.0)
            .sqrt()
            + self.centre_mm()
    }

    /// Height of the sphere's centre, mm (usually negative).
    pub fn centre_mm(&self) -> f64 {
        self.height_mm - self.sphere_radius_mm
    }
}

/// Rings of relief of one width.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Elements {
    /// Radial width, mm.
    pub width_mm: f64,
    /// Shapes from the axis outwards.
    pub shapes: Vec<Shape>,
}

impl Elements {
    /// The same relief in rings of `width_mm`: each ring takes the shape of the element it lies in.
    /// `None` if the width does not divide that of an element.
    pub fn refined(&self, width_mm: f64) -> Option<Self> {
        let ratio = (self.width_mm / width_mm).round();
        if ratio < 1.0 || (ratio * width_mm / self.width_mm - 1.0).abs() > SAME_LENGTH {
            return None;
        }
        let shapes = self
            .shapes
            .iter()
            .flat_map(|s| std::iter::repeat_n(s.clone(), ratio as usize))
            .collect();
        Some(Self { width_mm, shapes })
    }
}

/// Cross-section of one element, standing on its chord.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Shape {
    /// Horizontal tread, vertical riser.
    Os1,
    /// Triangle on the chord.
    Triangle {
        /// Interior angle at the base corner nearer the axis, degrees.
        inner_base_deg: f64,
        /// Interior angle at the apex, degrees.
        apex_deg: f64,
    },
    /// Vertices between the base corners, in chords.
    Polyline(Vec<[f64; 2]>),
    /// The sphere itself.
    Smooth,
}

/// The material of the dome at the wavelength.
#[derive(Debug, Clone, Serialize)]
pub struct Silicone {
    /// Refractive index, real part.
    pub index: f64,
    /// Absorption coefficient for power, 1/mm.
    pub absorption_per_mm: f64,
}

/// Reflector in the plane z = 0.
#[derive(Debug, Clone, Serialize)]
pub struct Mirror {
    /// Law of reflection.
    pub kind: Reflection,
    /// Reflectance.
    pub reflectance: f64,
    /// How far it extends.
    pub extent: Extent,
}

/// The light source box.
#[derive(Debug, Clone, Serialize)]
pub struct Led {
    /// Width along x and y, mm.
    pub size_mm: [f64; 2],
    /// Height of the top face, mm.
    pub height_mm: f64,
    /// Reflectance of the box.
    pub reflectance: f64,
    /// Law of reflection of the box.
    pub reflection: Reflection,
}

/// Names the file in every complaint.
pub(super) struct Context<'a> {
    file: &'a str,
}

impl Context<'_> {
    pub(super) fn value(&self, key: &str, got: impl Display, expected: &str) -> ConfigError {
        ConfigError::Value {
            file: self.file.to_owned(),
            key: key.to_owned(),
            got: got.to_string(),
            expected: expected.to_owned(),
        }
    }

    fn length(&self, key: &str, value: f64) -> Result<f64, ConfigError> {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(self.value(key, value, "a finite length above 0"))
        }
    }

    fn within(&self, key: &str, value: f64, low: f64, high: f64) -> Result<f64, ConfigError> {
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, value, &format!("a number from {low} to {high}")))
        }
    }

    fn count(
        &self,
        key: &str,
        value: usize,
        low: usize,
        high: usize,
    ) -> Result<usize, ConfigError> {
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, value, &format!("a whole number from {low} to {high}")))
        }
    }
}

impl Design {
    /// Checks `raw`, read from `text` of `file`; material files are relative to `folder`.
    pub(super) fn resolve(
        raw: &raw::Design,
        file: &str,
        text: &str,
        folder: &Path,
    ) -> Result<Self, ConfigError> {
        let at = Context { file };
        let usable = !raw.name.is_empty()
            && raw
                .name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
            && !raw.name.starts_with('.');
        if !usable {
            return Err(at.value(
                "name",
                format!("{:?}", raw.name),
                "letters, digits, '-', '_' and '.' only: it names output files",
            ));
        }
        let wavelength_nm = at.length("light.wavelength_nm", raw.light.wavelength_nm)?;
        let dome = raw.dome.as_ref().map(|d| dome(d, &at)).transpose()?;
        let elements = elements(raw.elements.as_ref(), dome.as_ref(), &at)?;
        let silicone = match (&dome, &raw.silicone) {
            (Some(_), Some(s)) => silicone(s, wavelength_nm, folder, &at)?,
            (Some(_), None) => {
                return Err(at.value(
                    "silicone",
                    "missing",
                    "a table with `index` or `material_file` for the dome",
                ));
            }
            (None, Some(_)) => {
                return Err(at.value("silicone", "given", "no such table without [dome]"));
            }
            (None, None) => Silicone {
                index: 1.0,
                absorption_per_mm: 0.0,
            },
        };
        let mirror = Mirror {
            kind: raw.mirror.kind,
            reflectance: at.within("mirror.reflectance", raw.mirror.reflectance, 0.0, 1.0)?,
            extent: raw.mirror.extent,
        };
        let led = led(&raw.led, dome.as_ref(), &at)?;
        let array = array(&raw.array, dome.as_ref(), &led, &at)?;
        let design = Self {
            name: raw.name.clone(),
            description: raw.description.clone(),
            provenance: Provenance {
                file: file.to_owned(),
                sha256: sha256_hex(text.as_bytes()),
            },
            dome,
            elements,
            silicone,
            mirror,
            led,
            array,
            wavelength_nm,
            receiver: raw.receiver.clone(),
            far_field: raw.far_field.clone(),
            hybrid: raw.hybrid.clone(),
            trace: raw.trace.clone(),
        };
        design.check_observation(&at)?;
        design.check_relief(&at)?;
        Ok(design)
    }

    /// Whether the dome carries relief, so that a hybrid makes sense.
    pub fn has_relief(&self) -> bool {
        self.elements.shapes.iter().any(|s| *s != Shape::Smooth)
    }

    /// The rings of the hybrid: the relief in steps of `hybrid.element_width_um`.
    pub fn hybrid_rings(&self) -> Elements {
        // Checked when the design was made: the ring's width divides the element's.
        self.elements
            .refined(self.hybrid.element_width_um * 1e-3)
            .unwrap_or_else(|| self.elements.clone())
    }

    /// Overall width of a package, mm.
    pub fn package_width_mm(&self) -> f64 {
        self.dome
            .map_or(self.led.size_mm[0].max(self.led.size_mm[1]), |d| {
                2.0 * d.radius_mm
            })
    }

    fn check_observation(&self, at: &Context) -> Result<(), ConfigError> {
        let (r, f, h, t) = (&self.receiver, &self.far_field, &self.hybrid, &self.trace);
        at.length("receiver.plane_height_mm", r.plane_height_mm)?;
        at.length("receiver.bin_mm", r.bin_mm)?;
        at.within("receiver.bin_mm", r.bin_mm, 1e-3, self.array.pitch_mm / 4.0)?;
        at.within(
            "receiver.smoothing_sigma_mm",
            r.smoothing_sigma_mm,
            0.0,
            self.array.pitch_mm / 4.0,
        )?;
        at.within(
            "receiver.margin_mm",
            r.margin_mm,
            0.5 * self.array.pitch_mm,
            1e3,
        )?;
        at.within("receiver.full_scale", r.full_scale, 2.0, 1e9)?;
        at.within("far_field.bin_deg", f.bin_deg, 0.1, 15.0)?;
        whole_division(at, "far_field.bin_deg", 90.0, f.bin_deg)?;
        at.within("far_field.azimuth_bin_deg", f.azimuth_bin_deg, 1.0, 45.0)?;
        whole_division(at, "far_field.azimuth_bin_deg", 90.0, f.azimuth_bin_deg)?;
        at.within("far_field.centre_deg", f.centre_deg, f.bin_deg, 45.0)?;
        whole_division(at, "far_field.centre_deg", f.centre_deg, f.bin_deg)?;
        at.within("far_field.peak_fit_deg", f.peak_fit_deg, f.bin_deg, 45.0)?;
        at.length("hybrid.element_width_um", h.element_width_um)?;
        at.count("hybrid.rings_per_band", h.rings_per_band, 1, 100_000)?;
        at.count(
            "hybrid.representative",
            h.representative,
            1,
            h.rings_per_band,
        )?;
        at.count("hybrid.kx_per_zone", h.kx_per_zone, 1, 64)?;
        at.count("hybrid.ky_count", h.ky_count, 2, 1024)?;
        at.within("hybrid.tolerance", h.tolerance, 1e-6, 0.5)?;
        if t.paths < 1_000 {
            return Err(at.value("trace.paths", t.paths, "at least 1000"));
        }
        at.count(
            "trace.max_interactions",
            t.max_interactions as usize,
            10,
            10_000_000,
        )?;
        Ok(())
    }

    fn check_relief(&self, at: &Context) -> Result<(), ConfigError> {
        let Some(dome) = &self.dome else {
            return Ok(());
        };
        let meridian = geometry::Meridian::stepped(dome, &self.elements)
            .map_err(|e| at.value("elements.shapes", e, "rings that neither cross nor overlap"))?;
        if self.receiver.plane_height_mm <= meridian.top_mm() {
            return Err(at.value(
                "receiver.plane_height_mm",
                self.receiver.plane_height_mm,
                &format!(
                    "a plane above the package, which ends at {} mm",
                    meridian.top_mm()
                ),
            ));
        }
        if !self.has_relief() {
            return Ok(());
        }
        let width = self.hybrid.element_width_um;
        let rings = self.elements.refined(width * 1e-3).ok_or_else(|| {
            at.value(
                "hybrid.element_width_um",
                width,
                &format!(
                    "a width that divides elements.width_um = {}",
                    self.elements.width_mm * 1e3
                ),
            )
        })?;
        if !rings
            .shapes
            .len()
            .is_multiple_of(self.hybrid.rings_per_band)
        {
            return Err(at.value(
                "hybrid.rings_per_band",
                self.hybrid.rings_per_band,
                &format!("a divisor of the {} rings", rings.shapes.len()),
            ));
        }
        geometry::Meridian::stepped(dome, &rings).map_err(|e| {
            at.value(
                "hybrid.element_width_um",
                e,
                "rings that neither cross nor overlap",
            )
        })?;
        Ok(())
    }
}

fn whole_division(at: &Context, key: &str, whole: f64, part: f64) -> Result<(), ConfigError> {
    let ratio = whole / part;
    if (ratio - ratio.round()).abs() < 1e-9 {
        Ok(())
    } else {
        Err(at.value(key, part, &format!("a divisor of {whole}")))
    }
}

fn dome(raw: &raw::Dome, at: &Context) -> Result<Dome, ConfigError> {
    let sphere_radius_mm = at.length("dome.sphere_radius_mm", raw.sphere_radius_mm)?;
    let height_mm = at.length("dome.height_mm", raw.height_mm)?;
    let radius_mm = 0.5 * at.length("dome.width_mm", raw.width_mm)?;
    if height_mm > 2.0 * sphere_radius_mm {
        return Err(at.value(
            "dome.height_mm",
            height_mm,
            "at most the diameter of the sphere",
        ));
    }
    let dome = Dome {
        sphere_radius_mm,
        height_mm,
        radius_mm,
    };
    if radius_mm > sphere_radius_mm || dome.height_at(radius_mm) < 0.0 {
        return Err(at.value(
            "dome.width_mm",
            raw.width_mm,
            "a width at which the sphere is still above the bottom",
        ));
    }
    Ok(dome)
}

fn elements(
    raw: Option<&raw::Elements>,
    dome: Option<&Dome>,
    at: &Context,
) -> Result<Elements, ConfigError> {
    let Some(raw) = raw else {
        return Ok(Elements {
            width_mm: 0.0,
            shapes: Vec::new(),
        });
    };
    let Some(dome) = dome else {
        return Err(at.value("elements", "given", "no such table without [dome]"));
    };
    at.count("elements.count", raw.count, 1, 2_000)?;
    let width_mm = 1e-3 * at.length("elements.width_um", raw.width_um)?;
    if raw.count as f64 * width_mm > dome.radius_mm * (1.0 + SAME_LENGTH) {
        return Err(at.value(
            "elements.count",
            raw.count,
            &format!(
                "at most {} elements of {} um on a dome {} mm wide",
                (dome.radius_mm / width_mm * (1.0 + SAME_LENGTH)).floor(),
                raw.width_um,
                2.0 * dome.radius_mm
            ),
        ));
    }
    Ok(Elements {
        width_mm,
        shapes: shapes::resolve(raw, at)?,
    })
}

fn silicone(
    raw: &raw::Silicone,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Silicone, ConfigError> {
    let stated = at.within(
        "silicone.absorption_per_mm",
        raw.absorption_per_mm,
        0.0,
        1e6,
    )?;
    let (key, index, extinction) = match (raw.index, &raw.material_file) {
        (Some(index), None) => ("silicone.index", index, 0.0),
        (None, Some(name)) => {
            let (n, k) =
                crate::material::index(&folder.join(name), wavelength_nm).map_err(|e| {
                    at.value(
                        "silicone.material_file",
                        name,
                        &format!("a readable material: {e}"),
                    )
                })?;
            ("silicone.material_file", n, k)
        }
        _ => {
            return Err(at.value(
                "silicone",
                "both or neither",
                "one of `index` and `material_file`",
            ));
        }
    };
    if !(index.is_finite() && index > 1.0 && index < 10.0) {
        return Err(at.value(
            key,
            index,
            "a refractive index above 1 (the air outside) and below 10",
        ));
    }
    // α = 4πk/λ for power.
    let absorption_per_mm =
        stated + 4.0 * std::f64::consts::PI * extinction / (wavelength_nm * 1e-6);
    Ok(Silicone {
        index,
        absorption_per_mm,
    })
}

fn led(raw: &raw::Led, dome: Option<&Dome>, at: &Context) -> Result<Led, ConfigError> {
    for v in raw.size_mm {
        at.length("led.size_mm", v)?;
    }
    let height_mm = at.length("led.height_mm", raw.height_mm)?;
    if let Some(dome) = dome {
        let corner = 0.5 * raw.size_mm[0].hypot(raw.size_mm[1]);
        if corner >= dome.radius_mm || height_mm >= dome.height_at(corner) {
            return Err(at.value(
                "led.height_mm",
                height_mm,
                "a box whose corners lie inside the dome",
            ));
        }
    }
    Ok(Led {
        size_mm: raw.size_mm,
        height_mm,
        reflectance: at.within("led.reflectance", raw.reflectance, 0.0, 1.0)?,
        reflection: raw.reflection,
    })
}

fn array(
    raw: &raw::Array,
    dome: Option<&Dome>,
    led: &Led,
    at: &Context,
) -> Result<raw::Array, ConfigError> {
    at.count("array.columns", raw.columns, 1, 64)?;
    at.count("array.rows", raw.rows, 1, 64)?;
    let width = dome.map_or(led.size_mm[0].max(led.size_mm[1]), |d| 2.0 * d.radius_mm);
    at.length("array.pitch_mm", raw.pitch_mm)?;
    if raw.pitch_mm < width {
        return Err(at.value(
            "array.pitch_mm",
            raw.pitch_mm,
            &format!("at least the width of a package, {width} mm"),
        ));
    }
    Ok(raw.clone())
}

/// Hexadecimal SHA-256.
pub fn sha256_hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    Sha256::digest(bytes)
        .iter()
        .fold(String::with_capacity(64), |mut s, b| {
            let _ = write!(s, "{b:02x}");
            s
        })
}
