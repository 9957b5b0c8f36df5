// SPDX-License-Identifier: MIT OR Apache-2.0
//! The checked design: every value lies in its range, every file it names was read.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use rcwa::convergence::{LARGEST_TOLERANCE, SMALLEST_TOLERANCE};
use rcwa::material::Material;
use serde::Serialize;

use super::ConfigError;
use super::at_wavelength::Lit;
use super::check::{Context, divides, whole_division, whole_multiple};
use super::dome_mesh::DomeMesh;
pub use super::dome_shape::Dome;
use super::dome_shape::{self, Stated as StatedDome};
use super::films::{self, Films};
use super::input_files;
use super::light;
use super::package::{self, SAME_LENGTH};
use super::positions;
use super::receivers::{self, Checked};
use super::schema::{self, Arrangement, Extent, Reference, Reflection};
use super::solids;
use super::source_spectra;
use super::sources;
use super::tables;
use crate::content_hash::sha256_hex;
use crate::formats::keys::Files;
use crate::geometry::{self, GeometryError};
use crate::metrics::far_field::{BinPlacement, PeakMethod};
use crate::provenance::Provenance;
use crate::spectrum::Spectrum;
use crate::spectrum::lights::Lights;

/// Largest height of the receiver's plane, mm: ten metres.
const MOST_HEIGHT_MM: f64 = 1e4;

/// Paths of use: fewer give no standard error worth the name, more take weeks.
pub const PATHS: RangeInclusive<u64> = 1_000..=1_000_000_000_000;
/// Most bins of the plane: 64 groups of them in double precision are half a gigabyte.
const MOST_BINS: f64 = 1e6;

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
    /// The solid that stands in place of the sphere and the cylinder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<DomeMesh>,
    /// The generating curve that stands in their place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meridian: Option<geometry::Meridian>,
    /// Relief of the dome from the axis outwards; empty on a smooth dome.
    pub elements: Elements,
    /// Inside of the dome (air where there is none).
    pub silicone: Silicone,
    /// Reflector in the plane z = 0.
    pub mirror: Mirror,
    /// The light source box.
    pub led: Led,
    /// Packages side by side. Where a file gives their positions, they count as columns of one row.
    pub array: schema::Array,
    /// Walls around them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub housing: Option<schema::Housing>,
    /// Positions from a file, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub positions_mm: Option<Vec<[f64; 2]>>,
    /// Vacuum wavelength, nm; of a spectrum the one with half of the weighted power on either side.
    pub wavelength_nm: f64,
    /// Power over the wavelength, unless the light is monochromatic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// The lights of the sources, unless that of the design is the only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lights: Option<Lights>,
    /// The same with a light for each source, where every source has a ledger of its own.
    #[serde(skip)]
    pub by_source: Option<Lights>,
    /// What shines of them, where not all do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lit: Option<Lit>,
    /// Plane receiver.
    pub receiver: schema::Receiver,
    /// Far-field receiver.
    pub far_field: schema::FarField,
    /// Receivers beside these two.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub receivers: Vec<Checked>,
    /// What emits, in place of the top of the LED box.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<sources::Checked>,
    /// Further solids and sheets.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub solids: Vec<solids::Checked>,
    /// Wave/ray hybrid and its tables.
    pub hybrid: schema::Hybrid,
    /// Monte Carlo.
    pub trace: schema::Trace,
    /// What comes from files of other programs.
    pub files: Files,
    /// Thin films on dome and mirror.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub films: Option<Films>,
    /// Whether rays carry their polarisation.
    #[serde(skip_serializing_if = "schema::is_default")]
    pub polarization: schema::Carrying,
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
        /// Angle at the base corner nearer the axis, degrees.
        inner_base_deg: f64,
        /// Interior angle at the apex, degrees.
        apex_deg: f64,
        /// Line from which the base angle is measured.
        reference: Reference,
    },
    /// Vertices between the base corners, in chords.
    Polyline(Vec<[f64; 2]>),
    /// The sphere itself.
    Smooth,
}

/// The material of the dome, or of a solid, at the wavelength.
#[derive(Debug, Clone, Serialize)]
pub struct Silicone {
    /// Refractive index, real part.
    pub index: f64,
    /// Absorption coefficient for power, 1/mm.
    pub absorption_per_mm: f64,
    /// From which both follow at other wavelengths.
    #[serde(skip)]
    pub(super) stated: Arc<Stated>,
}

/// What the file says of a medium, whatever the wavelength.
#[derive(Debug)]
pub(super) struct Stated {
    /// Key of its table.
    pub(super) table: String,
    /// Index, unless a material is given.
    pub(super) index: f64,
    /// Absorption beside that of the material, 1/mm.
    pub(super) absorption_per_mm: f64,
    /// Index and absorption over the wavelength.
    pub(super) material: Option<Dispersive>,
}

/// A material and where it came from.
#[derive(Debug)]
pub(super) struct Dispersive {
    /// Name in the design.
    pub(super) file: String,
    /// The file that was read.
    pub(super) path: String,
    /// Its content.
    pub(super) material: Material,
}

/// Reflector in the plane z = 0.
#[derive(Debug, Clone, Serialize)]
pub struct Mirror {
    /// Law of reflection.
    pub kind: Reflection,
    /// Reflectance.
    pub reflectance: f64,
    /// Share of what is reflected that goes on as from a mirror, where the kind is mixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
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
    /// Share of what is reflected that goes on as from a mirror, where the kind is mixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
}

impl Design {
    /// Checks `raw`, read from `text` of `file`; material files are relative to `folder`.
    pub(super) fn resolve(
        raw: &schema::Design,
        file: &str,
        text: &str,
        folder: &Path,
    ) -> Result<Self, ConfigError> {
        let at = Context { file };
        at.file_name("name", &raw.name)?;
        let light = light::resolve(&raw.light, folder, &at)?;
        let wavelength_nm = light.wavelength_nm;
        let StatedDome {
            dome,
            meridian,
            mesh,
        } = dome_shape::shape(raw, folder, &at)?;
        let elements = package::elements(raw.elements.as_ref(), dome.as_ref(), &at)?;
        let of_files = |error: anyhow::Error| ConfigError::Files {
            file: file.to_owned(),
            message: format!("{error:#}"),
        };
        let silicone = package::inside(raw, dome.as_ref(), wavelength_nm, folder, &at)?;
        let given = &raw.mirror;
        let law = (given.kind, given.reflectance, given.specular_fraction);
        package::reflector(["mirror", "mirror.kind"], law, &at)?;
        let mirror = Mirror {
            kind: given.kind,
            reflectance: given.reflectance,
            specular_fraction: given.specular_fraction,
            extent: given.extent,
        };
        let bounds = (dome.as_ref(), meridian.as_ref(), mesh.as_ref());
        let led = package::led(&raw.led, bounds, &at)?;
        let mut array = package::array(&raw.array, dome.as_ref(), &led, &at)?;
        let positions_mm = positions::load(&raw.array, folder).map_err(of_files)?;
        if let Some(positions) = &positions_mm {
            (array.columns, array.rows) = (positions.len(), 1);
        }
        let housing = raw.housing.as_ref();
        let housing = housing.map(|h| package::housing(h, &at)).transpose()?;
        let solids = solids::resolve(&raw.solids, wavelength_nm, folder, &at)?;
        let lit = (&led, dome.is_some(), &*solids);
        let sources = sources::resolve(raw, lit, light.weighting(), folder, &at)?;
        let shining = sources::of_files(raw, light.weighting(), folder, &at)?;
        let whole = light.whole(&at)?;
        let lights = source_spectra::lights(&sources, shining.as_ref(), &whole, false);
        let by_source = source_spectra::by_source(&raw.trace, &sources, &whole, &at)?;
        let mut design = Self {
            name: raw.name.clone(),
            description: raw.description.clone(),
            provenance: Provenance {
                file: file.to_owned(),
                sha256: sha256_hex(text.as_bytes()),
                named: Vec::new(),
            },
            dome,
            mesh,
            meridian,
            elements,
            silicone,
            mirror,
            led,
            array,
            housing,
            positions_mm,
            wavelength_nm,
            spectrum: light.spectrum,
            lights,
            by_source,
            lit: None,
            receiver: schema::Receiver {
                margin_mm: Some(raw.receiver.margin_mm(raw.array.pitch_mm)),
                ..raw.receiver.clone()
            },
            far_field: raw.far_field.clone(),
            receivers: Vec::new(),
            sources,
            solids,
            hybrid: raw.hybrid.clone(),
            trace: raw.trace.clone(),
            files: Files::default(),
            films: films::resolve(raw, wavelength_nm, folder, &at)?,
            polarization: raw.light.polarization,
        };
        design.check_observation(&at)?;
        let scale = receivers::Scale::of(&design, shining.as_ref());
        design.receivers = receivers::resolve(&raw.receivers, &scale, &at)?;
        design.check_relief(&at)?;
        light::check_ends(&design, raw, &at)?;
        let bands = if design.has_relief() {
            design.hybrid_rings().shapes.len() / design.hybrid.rings_per_band
        } else {
            0
        };
        let indices = [design.silicone.index, 1.0];
        design.files =
            Files::load(&raw.files, shining, folder, indices, bands).map_err(of_files)?;
        // Last: files that cannot be read were refused with their keys.
        design.provenance.named = input_files::inputs(raw, folder).map_err(of_files)?;
        Ok(design)
    }

    /// Whether thin layers lie on the dome.
    pub fn is_coated(&self) -> bool {
        self.films.as_ref().is_some_and(|f| !f.dome.is_empty())
    }

    /// The key that says which light there is.
    pub(super) fn light_key(&self) -> &'static str {
        if self.spectrum.is_some() {
            "light.spectrum"
        } else {
            "light.wavelength_nm"
        }
    }

    /// Whether the dome carries relief, so that a hybrid makes sense.
    pub fn has_relief(&self) -> bool {
        self.elements.shapes.iter().any(|s| *s != Shape::Smooth)
    }

    /// The generating curve of the surface that `dome` has: the stated one, or the relief; without pieces for a mesh, which has none.
    ///
    /// # Errors
    /// Relief that crosses itself or leaves the half-plane.
    pub fn outline(&self, dome: &Dome) -> Result<geometry::Meridian, GeometryError> {
        match &self.meridian {
            Some(meridian) => Ok(meridian.clone()),
            None if self.mesh.is_some() => Ok(geometry::Meridian { pieces: Vec::new() }),
            None => geometry::Meridian::stepped(dome, &self.elements),
        }
    }

    /// The rings of the hybrid: the relief in steps of `hybrid.element_width_um`.
    pub fn hybrid_rings(&self) -> Elements {
        // Checked when the design was made: the ring's width divides the element's.
        self.elements
            .refined(self.hybrid.element_width_um * 1e-3)
            .unwrap_or_else(|| self.elements.clone())
    }

    /// Where the axes of the packages stand, (x, y) in mm, row after row.
    pub fn axes_mm(&self) -> Vec<[f64; 2]> {
        if let Some(positions) = &self.positions_mm {
            return positions.clone();
        }
        let array = &self.array;
        let middle = |k: usize, n: usize| k as f64 - 0.5 * (n as f64 - 1.0);
        let at = |i: usize, j: usize| {
            let (x, y) = (middle(i, array.columns), middle(j, array.rows));
            match array.arrangement {
                Arrangement::Square => [x * array.pitch_mm, y * array.pitch_mm],
                Arrangement::Hexagonal => {
                    // A quarter of a pitch to either side, so that the array stays centred.
                    let shift = if array.rows == 1 {
                        0.0
                    } else if j.is_multiple_of(2) {
                        -0.25
                    } else {
                        0.25
                    };
                    [
                        (x + shift) * array.pitch_mm,
                        y * array.pitch_mm * 0.75_f64.sqrt(),
                    ]
                }
            }
        };
        (0..array.rows)
            .flat_map(|j| (0..array.columns).map(move |i| at(i, j)))
            .collect()
    }

    /// Largest |x| and |y| of the axes, mm.
    pub fn half_extent_mm(&self) -> [f64; 2] {
        let axes = self.axes_mm();
        [0, 1].map(|k| axes.iter().map(|at| at[k].abs()).fold(0.0, f64::max))
    }

    /// Whether columns and rows stand at right angles, as the symmetries and the figures of uniformity take for granted.
    pub fn is_rectangular(&self) -> bool {
        self.positions_mm.is_none() && self.array.arrangement == Arrangement::Square
    }

    /// Half the inner lengths of the housing, mm: the packages' outlines and the distance beyond.
    pub fn housing_half_mm(&self) -> Option<[f64; 2]> {
        let distance_mm = self.housing.as_ref()?.distance_mm;
        let width = match self.dome {
            Some(dome) => [2.0 * dome.radius_mm; 2],
            None => self.led.size_mm,
        };
        let half = self.half_extent_mm();
        Some([0, 1].map(|k| half[k] + 0.5 * width[k] + distance_mm))
    }

    /// Overall width of a package, mm.
    pub fn package_width_mm(&self) -> f64 {
        self.dome
            .map_or(self.led.size_mm[0].max(self.led.size_mm[1]), |d| {
                2.0 * d.radius_mm
            })
    }

    fn check_observation(&self, at: &Context) -> Result<(), ConfigError> {
        let (r, f, h) = (&self.receiver, &self.far_field, &self.hybrid);
        let margin_mm = r.margin_mm(self.array.pitch_mm);
        at.length("receiver.plane_height_mm", r.plane_height_mm)?;
        at.length("receiver.bin_mm", r.bin_mm)?;
        at.within("receiver.bin_mm", r.bin_mm, 1e-3, self.array.pitch_mm / 4.0)?;
        if let Some(read) = r.read_bin_mm {
            let most = self.array.pitch_mm / 4.0;
            at.within("receiver.read_bin_mm", read, r.bin_mm, most)?;
            whole_multiple(
                at,
                "receiver.read_bin_mm",
                read,
                ("receiver.bin_mm", r.bin_mm),
            )?;
        }
        at.within(
            "receiver.smoothing_sigma_mm",
            r.smoothing_sigma_mm,
            0.0,
            self.array.pitch_mm / 4.0,
        )?;
        at.within(
            "receiver.margin_mm",
            margin_mm,
            0.5 * self.array.pitch_mm,
            package::MOST_MARGIN_MM,
        )?;
        let across = |half: f64| 2.0 * (half + margin_mm) / r.bin_mm;
        let bins: f64 = self.half_extent_mm().map(across).iter().product();
        if bins > MOST_BINS {
            return Err(at.value(
                "receiver.bin_mm",
                r.bin_mm,
                &format!("at most {MOST_BINS} bins on the plane, not {bins:.1e}"),
            ));
        }
        at.within("receiver.full_scale", r.full_scale, 2.0, 1e9)?;
        at.within("far_field.bin_deg", f.bin_deg, 0.1, 15.0)?;
        whole_division(at, "far_field.bin_deg", 90.0, f.bin_deg)?;
        at.within("far_field.azimuth_bin_deg", f.azimuth_bin_deg, 1.0, 45.0)?;
        whole_division(at, "far_field.azimuth_bin_deg", 90.0, f.azimuth_bin_deg)?;
        let read = f.read_bin_deg();
        at.within("far_field.read_bin_deg", read, f.bin_deg, 15.0)?;
        whole_division(at, "far_field.read_bin_deg", 90.0, read)?;
        // The innermost bin that is read reaches from the axis to `inner`.
        let (bin, inner) = match f.read_bins {
            BinPlacement::Between => (("far_field.bin_deg", f.bin_deg), read),
            BinPlacement::About => (("twice far_field.bin_deg", 2.0 * f.bin_deg), 0.5 * read),
        };
        whole_multiple(at, "far_field.read_bin_deg", read, bin)?;
        at.within("far_field.centre_deg", f.centre_deg, inner, 45.0)?;
        if !divides(read, f.centre_deg - inner) {
            let expected = format!(
                "{inner} and any multiple of {read} more, where the bins that are read end"
            );
            return Err(at.value("far_field.centre_deg", f.centre_deg, &expected));
        }
        let least = if f.peak == PeakMethod::Parabola {
            read
        } else {
            0.0
        };
        at.within("far_field.peak_fit_deg", f.peak_fit_deg, least, 45.0)?;
        if let Some(cut) = f.cut_deg {
            at.within("far_field.cut_deg", cut, 0.0, 90.0)?;
        }
        at.length("hybrid.element_width_um", h.element_width_um)?;
        at.count("hybrid.rings_per_band", h.rings_per_band, 1, 100_000)?;
        at.count(
            "hybrid.representative",
            h.representative,
            1,
            h.rings_per_band,
        )?;
        if let Some(count) = h.kx_per_zone {
            at.count("hybrid.kx_per_zone", count, 1, tables::MOST_KX)?;
        }
        if let Some(count) = h.ky_count {
            at.count("hybrid.ky_count", count, 2, 1024)?;
        }
        if !(SMALLEST_TOLERANCE..=LARGEST_TOLERANCE).contains(&h.tolerance) {
            let expected = format!("a number from {SMALLEST_TOLERANCE:e} to {LARGEST_TOLERANCE}");
            return Err(at.value("hybrid.tolerance", h.tolerance, &expected));
        }
        at.within("hybrid.memory_gib", h.memory_gib, 0.001, 1e6)?;
        if let Some(stairs) = h.stairs_um {
            at.within("hybrid.stairs_um", stairs, 1e-3, 1e3)?;
        }
        at.within("hybrid.spread_deg", h.spread_deg, 0.0, 45.0)?;
        if h.spread_deg > 0.0 {
            whole_division(at, "hybrid.spread_deg", 90.0, h.spread_deg)?;
        }
        self.check_trace(at)
    }

    fn check_trace(&self, at: &Context) -> Result<(), ConfigError> {
        let t = &self.trace;
        if !PATHS.contains(&t.paths) {
            let expected = format!("a whole number from {} to {}", PATHS.start(), PATHS.end());
            return Err(at.value("trace.paths", t.paths, &expected));
        }
        at.count(
            "trace.max_interactions",
            t.max_interactions as usize,
            10,
            10_000_000,
        )?;
        if let Some(split) = t.split {
            at.count("trace.split", split as usize, 2, 64)?;
        }
        Ok(())
    }

    pub(super) fn check_relief(&self, at: &Context) -> Result<(), ConfigError> {
        let above = |top_mm: f64| {
            let plane_mm = self.receiver.plane_height_mm;
            if plane_mm > top_mm {
                let most_mm = MOST_HEIGHT_MM;
                at.within("receiver.plane_height_mm", plane_mm, 0.0, most_mm)?;
                return Ok(());
            }
            Err(at.value(
                "receiver.plane_height_mm",
                self.receiver.plane_height_mm,
                &format!("a plane above the package, which ends at {top_mm} mm"),
            ))
        };
        let Some(dome) = &self.dome else {
            return above(self.led.height_mm);
        };
        let meridian = self
            .outline(dome)
            .map_err(|e| at.value("elements.shapes", e, "rings that neither cross nor overlap"))?;
        above(match self.mesh {
            Some(_) => dome.height_mm,
            None => meridian.top_mm(),
        })?;
        if self.has_relief() {
            tables::check(self, dome, at)?;
        }
        Ok(())
    }
}
