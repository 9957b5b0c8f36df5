// SPDX-License-Identifier: MIT OR Apache-2.0
//! The checked design: every value lies in its range, every file it names was read.

pub mod array;
pub mod at_wavelength;
mod conversion;
pub mod dome;
pub mod files;
pub mod films;
pub mod footprint;
pub mod form;
pub(crate) mod haze;
pub mod incidence_grid;
pub mod led;
pub mod luminescence;
pub mod medium;
pub mod panel;
pub(crate) mod polariser;
pub mod prints;
pub mod receivers;
pub mod reflector;
pub mod scattering;
pub mod solids;
pub mod sources;
pub mod trace_key;

use std::collections::HashMap;
use std::ops::RangeInclusive;

use array::{Array, Pose};
use at_wavelength::LitSources;
use dome::Dome;
use films::Films;
use led::{BoxPlace, Led};
use medium::Medium;
use prints::CheckedPrint;
use receivers::CheckedReceiver;
use reflector::Reflector;
use serde::Serialize;
use solids::CheckedSolid;
use sources::CheckedSource;

use ::runtime::provenance::Provenance;
use files::Files;
use geometry::profile::{Elements, Shape, SphericalDome};
use geometry::{BaseSurface, GeometryError, Meridian};

use super::schema::solids::Per;
use super::schema::{self, Extent};
use crate::spectrum::Spectrum;
use crate::spectrum::lights::Lights;
use metrics::kinds::Carrying;

/// Allowed number of paths.
pub const PATHS: RangeInclusive<u64> = 1_000..=1_000_000_000_000;

/// Checks the number of paths that `key` states.
///
/// # Errors
/// One that is not allowed.
pub fn check_paths(key: &str, paths: u64) -> anyhow::Result<()> {
    let (low, high) = (PATHS.start(), PATHS.end());
    anyhow::ensure!(
        PATHS.contains(&paths),
        "{key}: expected a whole number from {low} to {high}, got {paths}"
    );
    Ok(())
}

/// A checked design.
#[derive(Debug, Clone, Serialize)]
pub struct Design {
    /// Short name, used for output files.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Origin and hash of the text.
    pub provenance: Provenance,
    /// The dome, if there is one.
    pub dome: Option<Dome>,
    /// Relief of the dome from the axis outwards; empty on a smooth dome.
    pub elements: Elements,
    /// Inside of the dome (air where there is none).
    pub silicone: Medium,
    /// Reflector in the plane z = 0.
    pub mirror: Mirror,
    /// The light source box.
    pub led: Led,
    /// Packages side by side.
    pub array: Array,
    /// Walls around them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub housing: Option<Housing>,
    /// Vacuum wavelength, nm; of a spectrum the one with half of the weighted power on either side.
    pub wavelength_nm: f64,
    /// Power over the wavelength, unless the light is monochromatic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// True if what leaves converted is counted in lumens: the stated weighting is photometric.
    #[serde(skip)]
    pub converts_in_lumens: bool,
    /// The lights of the sources, unless that of the design is the only one; with a light for each
    /// source where every source has a ledger of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lights: Option<Lights>,
    /// Flux of the sources of one package, where the design states it; without it all sources of
    /// all packages together emit 1 W.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emitted: Option<EmittedFlux>,
    /// Why its relief has no bands and no tables, of a design that does not ask for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_bands: Option<String>,
    /// Subset that shines, where not all do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lit: Option<LitSources>,
    /// Plane receiver.
    pub receiver: schema::Receiver,
    /// Far-field receiver.
    pub far_field: schema::FarFieldReceiver,
    /// Receivers beside these two.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub receivers: Vec<CheckedReceiver>,
    /// Sources in place of the top of the LED box.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<CheckedSource>,
    /// Further solids and sheets.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub solids: Vec<CheckedSolid>,
    /// Ink on the mirror and on faces of films.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub prints: Vec<CheckedPrint>,
    /// Panel before the backlight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panel: Option<panel::Panel>,
    /// Wave/ray hybrid and its tables.
    pub hybrid: schema::Hybrid,
    /// Monte Carlo.
    pub trace: schema::Trace,
    /// Bands, mirror and source from files of other programs.
    pub files: Files,
    /// Thin films on dome and mirror.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub films: Option<Films>,
    /// Step of the wavelengths of a trace in which a medium converts light, nm.
    pub step_nm: f64,
    /// True if rays carry their polarisation.
    #[serde(skip_serializing_if = "schema::is_default")]
    pub polarization: Carrying,
}

/// Reflector in the plane z = 0.
#[derive(Debug, Clone, Serialize)]
pub struct Mirror {
    /// Law of reflection.
    #[serde(flatten)]
    pub reflector: Reflector,
    /// Reach.
    pub extent: Extent,
}

/// Flux that the sources of one package emit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EmittedFlux {
    /// Radiant flux, W.
    pub radiant_w: f64,
    /// Luminous flux, lm; 0 of light beyond V(λ).
    pub luminous_lm: f64,
    /// Electrical power of the package, W, where it is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub electrical_w: Option<f64>,
}

/// Walls around the array.
#[derive(Debug, Clone, Serialize)]
pub struct Housing {
    /// From the outermost bodies of packages to the walls, mm, where it is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance_mm: Option<f64>,
    /// Lengths between the walls along x and y, mm, where they are stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inner_size_mm: Option<[f64; 2]>,
    /// Height of the walls above the bottom, mm.
    pub height_mm: f64,
    /// Thickness of the walls, mm.
    pub thickness_mm: f64,
    /// Law of reflection of the walls.
    #[serde(flatten)]
    pub reflector: Reflector,
    /// Bottom between the mirror and the walls; black if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<Reflector>,
}

/// True if no element has relief.
pub(crate) fn is_smooth(elements: &Elements) -> bool {
    elements.shapes.iter().all(|s| *s == Shape::Smooth)
}

/// These elements in steps of `hybrid.element_width_um`; as they are where it does not divide theirs,
/// which checks refuse.
pub(crate) fn rings(elements: &Elements, hybrid: &schema::Hybrid) -> Elements {
    elements.refined(hybrid.element_width_um * 1e-3).unwrap_or_else(|| elements.clone())
}

impl Design {
    /// True if thin layers lie on the dome.
    pub fn is_coated(&self) -> bool {
        self.films.as_ref().is_some_and(|f| !f.dome.layers.is_empty())
    }

    /// The key that says which light there is.
    pub(crate) fn light_key(&self) -> &'static str {
        if self.spectrum.is_some() { "light.spectrum" } else { "light.wavelength_nm" }
    }

    /// True if the dome carries relief, so that a hybrid makes sense.
    pub fn has_relief(&self) -> bool {
        !is_smooth(&self.elements)
    }

    /// The generating curve of the dome's surface; without pieces for a mesh and a bare package.
    ///
    /// # Errors
    /// Relief that crosses itself or leaves the half-plane.
    pub fn outline(&self) -> Result<Meridian, GeometryError> {
        match &self.dome {
            Some(dome) => dome.outline(&self.elements),
            None => Ok(Meridian { pieces: Vec::new() }),
        }
    }

    /// The smooth surface of the dome that may carry relief.
    pub fn base(&self) -> Option<BaseSurface<'_>> {
        self.dome.as_ref().and_then(Dome::base)
    }

    /// The sphere of the dome, if it is one.
    pub fn sphere(&self) -> Option<&SphericalDome> {
        self.dome.as_ref().and_then(Dome::sphere)
    }

    /// The rings of the hybrid: the relief in steps of `hybrid.element_width_um`.
    pub fn hybrid_rings(&self) -> Elements {
        rings(&self.elements, &self.hybrid)
    }

    /// Every place of a box in its package with the turn and the scale of the package once, and the
    /// number of that of each package.
    pub fn package_kinds(&self) -> (Vec<(BoxPlace, Pose)>, Vec<usize>) {
        let mut kinds: Vec<(BoxPlace, Pose)> = Vec::new();
        let mut known: HashMap<[u64; 6], usize> = HashMap::new();
        let number = |package: usize| {
            let (place, pose) = (self.led.place(package), self.array.pose(package));
            let ([a, b], [c, d]) = (place.offset_mm, place.tilt_deg);
            let key = [a, b, c, d, pose.turn_deg, pose.scale].map(f64::to_bits);
            *known.entry(key).or_insert_with(|| {
                kinds.push((place, pose));
                kinds.len() - 1
            })
        };
        let numbers = (0..self.array.count()).map(number).collect();
        (kinds, numbers)
    }

    /// From the axis of a package to the centre of the foot of its box, along x and y of the array, mm.
    pub fn led_offset_mm(&self, package: usize) -> [f64; 2] {
        let scale = self.array.scale(package);
        let [x, y] = self.led.place(package).offset_mm.map(|along| scale * along);
        let (sin, cos) = self.array.turn_deg(package).to_radians().sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Packages and walls.
    pub(crate) fn packages(&self) -> Packages<'_> {
        Packages {
            dome: self.dome.as_ref(),
            led: &self.led,
            array: &self.array,
            housing: self.housing.as_ref(),
            solids: &self.solids,
        }
    }

    /// Largest |x| and |y| of the places of packages, mm.
    pub fn half_extent_mm(&self) -> [f64; 2] {
        self.packages().half_extent_mm()
    }

    /// Lengths along x and y of the cells of the array together, mm.
    pub fn cells_mm(&self) -> [f64; 2] {
        self.packages().cells_mm()
    }

    /// True if its housing is a cell that repeats without end.
    pub fn is_periodic(&self) -> bool {
        self.packages().is_periodic()
    }

    /// Half the inner lengths of the housing, mm.
    pub fn housing_half_mm(&self) -> Option<[f64; 2]> {
        self.packages().housing_half_mm()
    }

    /// Farthest reach of a package from its axis along x (`axis` 0) or y, mm, and the body that
    /// reaches so far.
    pub fn outermost(&self, axis: usize) -> (f64, &str) {
        self.packages().outermost(axis)
    }
}

/// The packages of a design and the walls about them, by which what lies over them is placed.
#[derive(Clone, Copy)]
pub(crate) struct Packages<'a> {
    pub dome: Option<&'a Dome>,
    pub led: &'a Led,
    pub array: &'a Array,
    pub housing: Option<&'a Housing>,
    /// Solids of packages, and others.
    pub solids: &'a [CheckedSolid],
}

impl<'a> Packages<'a> {
    /// Largest |x| and |y| of the places of packages, mm.
    pub fn half_extent_mm(&self) -> [f64; 2] {
        let axes = self.array.places_mm();
        [0, 1].map(|k| axes.iter().map(|at| at[k].abs()).fold(0.0, f64::max))
    }

    /// Lengths along x and y of the cells of the array together, mm: those of a mirror under it.
    pub fn cells_mm(&self) -> [f64; 2] {
        let (half, pitch) = (self.half_extent_mm(), self.array.pitch_mm.along());
        [0, 1].map(|k| 2.0 * half[k] + pitch[k])
    }

    /// True if its housing is a cell that repeats without end.
    pub fn is_periodic(&self) -> bool {
        self.housing.is_some_and(|housing| housing.reflector == Reflector::Periodic)
    }

    /// Half the inner lengths of the housing, mm.
    pub fn housing_half_mm(&self) -> Option<[f64; 2]> {
        let housing = self.housing?;
        if let Some(size) = housing.inner_size_mm {
            return Some(size.map(|length| 0.5 * length));
        }
        let (half, distance_mm) = (self.half_extent_mm(), housing.distance_mm.unwrap_or_default());
        Some([0, 1].map(|k| half[k] + self.outermost(k).0 + distance_mm))
    }

    /// Farthest reach of a package from its axis along x (`axis` 0) or y, mm, and the body that
    /// reaches so far, in the turns and sizes that the file of the packages states. A box off the axis
    /// counts as one on it, so that walls stand still where boxes and packages are placed with
    /// deviations.
    pub fn outermost(&self, axis: usize) -> (f64, &'a str) {
        let Array { stated_scales, .. } = &self.array;
        let poses = (0..self.array.count()).map(|package| {
            let turn = self.array.stated_turns_deg().get(package).copied().unwrap_or(0.0);
            [turn, stated_scales.get(package).copied().unwrap_or(1.0)]
        });
        let mut poses: Vec<[f64; 2]> = poses.collect();
        poses.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        poses.dedup();
        let of_pose = |[degrees, scale]: [f64; 2]| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let [along, across] = [self.led.size_mm[axis], self.led.size_mm[1 - axis]];
            let own = match self.dome {
                Some(dome) => (dome.reach_mm(axis, degrees), "the dome"),
                None => (0.5 * (cos.abs() * along + sin.abs() * across), "the LED"),
            };
            let of_package = self.solids.iter().filter(|solid| solid.per() == Per::Package);
            let reaches = of_package.filter_map(move |solid| {
                let around = solid.form.turned(degrees).shape(0.0).ok()?.bounds();
                Some((around.low[axis].abs().max(around.high[axis].abs()), solid.name()))
            });
            [own].into_iter().chain(reaches).map(move |(far, body)| (scale * far, body))
        };
        let all = poses.into_iter().flat_map(of_pose);
        all.fold((0.0, ""), |far, other| if other.0 > far.0 { other } else { far })
    }
}

impl Design {
    /// Radiant flux that all sources of all packages emit together, W.
    pub fn emitted_w(&self) -> f64 {
        let stated = self.emitted.map(|flux| flux.radiant_w);
        stated.map_or(1.0, |w| w * self.array.axes_mm().len() as f64)
    }

    /// Electrical power of all packages, W, where the design states it.
    pub fn electrical_w(&self) -> Option<f64> {
        Some(self.emitted?.electrical_w? * self.array.axes_mm().len() as f64)
    }

    /// Luminous flux of all sources of all packages, lm, where the design states what they emit and
    /// the eye sees it. Of light that is converted none: lumens that leave are no share of them.
    pub fn emitted_lm(&self) -> Option<f64> {
        if self.converts() {
            return None;
        }
        let lumens = self.emitted?.luminous_lm * self.array.axes_mm().len() as f64;
        (lumens > 0.0).then_some(lumens)
    }

    /// Overall width of a package as stated, mm.
    pub fn package_width_mm(&self) -> f64 {
        match &self.dome {
            Some(dome) => 2.0 * dome.radius_mm(),
            None => self.led.size_mm[0].max(self.led.size_mm[1]),
        }
    }
}
