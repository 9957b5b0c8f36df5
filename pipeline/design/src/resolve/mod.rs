// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design as written → the checked design.
//!
//! Every check names file, key, what was found and what was expected.

pub(crate) mod defaults;
mod dome;
mod dome_mesh;
mod elements;
mod emitted_flux;
mod files;
mod film_stack;
mod films;
mod form;
mod grooves;
mod haze;
mod input_files;
mod led;
mod light;
mod luminescence;
mod package;
mod panel;
mod polariser;
mod positions;
mod prints;
mod receivers;
mod relief;
mod scattering;
mod solids;
mod source_spectra;
mod source_table;
mod sources;
pub mod tables;
mod widened;

pub use dome::rows_in_file;

use std::path::Path;

use rcwa::accuracy::{MAX_TOLERANCE, MIN_TOLERANCE};

use ::runtime::content_hash::sha256_hex;
use ::runtime::provenance::Provenance;
use metrics::digits::shortest;
use metrics::far_field::{BinPlacement, PeakMethod};
use metrics::kinds::Carrying;

use super::check::{Context, MAX_LENGTH_MM, divides, whole_division, whole_multiple};
use super::error::ConfigError;
use super::resolved::dome::Dome;
use super::resolved::files::Files;
use super::resolved::incidence_grid::MAX_KX;
use super::resolved::{Design, Mirror, PATHS, Packages, is_smooth, rings};
use super::schema;
use runtime::serde_arrays::List;

/// Most bins of the plane: 64 groups of them in double precision are half a gigabyte.
const MAX_BINS: f64 = 1e6;
/// Most bins across a spot: nine points at all phases of the pitch are 1296 spots.
const MAX_SPOT_BINS: f64 = 100.0;

/// Usual step of the wavelengths of a trace in which light is converted, nm.
const STEP_NM: f64 = 5.0;

impl Design {
    /// Checks `raw`, read from the text of a file; the files that it names lie in `folder`. Bands
    /// that cannot be made are refused where the design asks for them, and left out where it does
    /// not.
    pub(crate) fn resolve(
        raw: &schema::Design,
        (file, text): (&str, &str),
        folder: &Path,
        asks_for_bands: bool,
    ) -> Result<Self, ConfigError> {
        let at = Context::new(file);
        at.file_name("name", &raw.name)?;
        let light = light::resolve(raw, folder, &at)?;
        let wavelength_nm = light.wavelength_nm;
        let dome = dome::resolve(raw, folder, &at)?;
        let base = dome.as_ref().and_then(Dome::base);
        let elements = elements::resolve(raw.elements.as_ref(), base, &at)?;
        let of_files = |error| at.of_files(&error);
        let silicone = package::inside(raw, dome.is_some(), wavelength_nm, folder, &at)?;
        let mirror = Mirror {
            reflector: package::reflector("mirror", &raw.mirror.kind, &at)?,
            extent: raw.mirror.shared.extent,
        };
        let led = led::resolve(&raw.led, dome.as_ref(), &at)?;
        let array = package::array(&raw.array, dome.as_ref(), &led, folder, &at)?;
        at.one_for_each("led.offsets_mm", led.offsets_mm.len(), array.count())?;
        at.one_for_each("led.tilts_deg", led.tilts_deg.len(), array.count())?;
        let housing = raw.housing.as_ref();
        let housing = housing.map(|h| package::housing(h, &at)).transpose()?;
        let is_polarised = raw.light.polarization == Carrying::Carried;
        let mut solids = solids::resolve(&raw.solids, (wavelength_nm, is_polarised), folder, &at)?;
        let lit = (&led, dome.is_some(), &*solids);
        let sources = sources::resolve(raw, lit, light.weighting(), folder, &at)?;
        let source_file = sources::of_files(raw, light.weighting(), folder, &at)?;
        let whole = light.whole(&at)?;
        let lights =
            source_spectra::lights(&raw.trace, &sources, source_file.as_ref(), &whole, &at)?;
        let step_nm = raw.light.step_nm.unwrap_or(STEP_NM);
        let emitted = emitted_flux::resolve(&raw.led.shared, lights.as_ref(), &whole, &at)?;
        let thin_films = films::resolve(raw, wavelength_nm, folder, &at)?;
        let step_nm = at.within("light.step_nm", step_nm, 0.5, 50.0)?;
        let packages = Packages {
            dome: dome.as_ref(),
            led: &led,
            array: &array,
            housing: housing.as_ref(),
            solids: &solids,
        };
        let films = film_stack::resolve(raw, &packages, wavelength_nm, folder, &at)?;
        let prints = prints::resolve(raw, &packages, &films, folder, &at)?;
        let receiver = schema::Receiver {
            margin_mm: Some(raw.receiver.margin_mm(raw.array.pitch_mm)),
            ..raw.receiver.clone()
        };
        check_observation(raw, &receiver, &packages, &at)?;
        let light_of_receivers = receivers::FilteredLight {
            elements: &elements,
            sources: &sources,
            packages: array.count(),
            file: source_file.as_ref(),
        };
        let receivers = receivers::resolve(raw, light_of_receivers, &at)?;
        let bands = if is_smooth(&elements) {
            0
        } else {
            rings(&elements, &raw.hybrid).shapes.len() / raw.hybrid.rings_per_band
        };
        let indices = [silicone.index, 1.0];
        let files =
            Files::load(&raw.files, source_file, folder, indices, bands).map_err(of_files)?;
        // Last: files that cannot be read were refused with their keys.
        let [named, of_panel] = input_files::inputs(raw, folder).map_err(of_files)?;
        solids.extend(films);
        let design = Self {
            name: raw.name.clone(),
            description: raw.description.clone(),
            provenance: Provenance {
                file: file.to_owned(),
                sha256: sha256_hex(text.as_bytes()),
                named,
                of_panel,
            },
            dome,
            elements,
            silicone,
            mirror,
            led,
            array,
            housing,
            wavelength_nm,
            spectrum: light.spectrum,
            converts_in_lumens: light.converts_in_lumens,
            lights,
            emitted,
            without_bands: None,
            lit: None,
            receiver,
            far_field: raw.far_field.clone(),
            receivers,
            sources,
            solids,
            prints,
            panel: None,
            hybrid: raw.hybrid.clone(),
            trace: raw.trace.clone(),
            files,
            films: thin_films,
            step_nm,
            polarization: raw.light.polarization,
        };
        design.finish(raw, folder, asks_for_bands, &at)
    }

    /// Checks what all parts have to do with each other, and adds the panel, whose filters look at the
    /// light of all sources.
    fn finish(
        self,
        raw: &schema::Design,
        folder: &Path,
        asks_for_bands: bool,
        at: &Context,
    ) -> Result<Self, ConfigError> {
        self.check_relief(at)?;
        let mut lights = self.colour_lights();
        lights.lights.extend(self.converted_lights());
        let panel = raw
            .panel
            .as_ref()
            .map(|raw| panel::resolve(raw, (&lights, self.converts()), folder, at));
        let design = Self { panel: panel.transpose()?, ..self };
        luminescence::check(&design, raw, at)?;
        light::check_ends(&design, raw, Self::check_relief, at)?;
        let tables = luminescence::check_tables(&design, at)
            .and_then(|()| design.check_tables(at))
            .and_then(|()| light::check_ends(&design, raw, Self::check_tables, at));
        match tables {
            Err(error) if !asks_for_bands => {
                Ok(Self { without_bands: Some(error.without_file()), ..design })
            }
            others => others.map(|()| design),
        }
    }

    pub(crate) fn check_relief(&self, at: &Context) -> Result<(), ConfigError> {
        let above = |top_mm: f64| {
            let plane_mm = self.receiver.plane_height_mm;
            if plane_mm > top_mm {
                return Ok(());
            }
            let expected = format!("a plane above the package, which ends at {top_mm} mm");
            Err(at.value("receiver.plane_height_mm", plane_mm, &expected))
        };
        let Some(dome) = &self.dome else {
            let tops = self.led.stated_places().map(|place| self.led.at(place).top_mm());
            return above(tops.fold(0.0, f64::max));
        };
        let meridian = self.outline().map_err(|e| elements::refused(&e, "elements.shapes", at))?;
        above(match dome {
            Dome::Mesh(mesh) => mesh.height_mm,
            Dome::Sphere(_) | Dome::Meridian(_) => meridian.top_mm(),
        })
    }

    /// True if the bands of relief can have tables.
    pub(crate) fn check_tables(&self, at: &Context) -> Result<(), ConfigError> {
        match self.base() {
            Some(base) if self.has_relief() => tables::check(self, base, at),
            _ => Ok(()),
        }
    }
}

/// The area that uniformity is stated of lies on the map, and its spots in it.
fn check_area(r: &schema::Receiver, packages: &Packages, at: &Context) -> Result<(), ConfigError> {
    let bin_mm = r.read_bin_mm.unwrap_or(r.bin_mm);
    if r.area_mm.is_none() && r.area_centre_mm.is_some() {
        let expected = "an area beside it (receiver.area_mm)";
        return Err(at.value("receiver.area_centre_mm", "given", expected));
    }
    let mut width_mm = packages.array.pitch_mm.min();
    if let (Some(List(size)), Some([low, high])) = (r.area_mm, r.area_corners_mm()) {
        let margin_mm = r.margin_mm(packages.array.pitch_mm);
        let centre = r.area_centre_mm.map_or([0.0; 2], |List(centre)| centre);
        for (k, half) in packages.half_extent_mm().into_iter().enumerate() {
            at.within("receiver.area_mm", size[k], 2.0 * bin_mm, MAX_LENGTH_MM)?;
            at.within("receiver.area_centre_mm", centre[k], -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
            let edge = half + margin_mm;
            if low[k].min(-high[k]) < -edge * (1.0 + 1e-9) {
                let axis = ["x", "y"][k];
                let got = format!("from {axis} = {} to {} mm", low[k], high[k]);
                let expected = format!(
                    "an area on the map, which reaches to ±{} mm; receiver.margin_mm widens it",
                    shortest(edge)
                );
                return Err(at.value("receiver.area_mm", got, &expected));
            }
        }
        width_mm = size[0].min(size[1]);
    }
    if let Some(spot_mm) = r.spot_mm {
        let max_mm = (width_mm / 3.0).min(MAX_SPOT_BINS * bin_mm);
        at.within("receiver.spot_mm", spot_mm, 1e-3, max_mm)?;
    }
    Ok(())
}

/// Checks what is recorded and how, and the numbers of tables and paths.
fn check_observation(
    raw: &schema::Design,
    r: &schema::Receiver,
    packages: &Packages,
    at: &Context,
) -> Result<(), ConfigError> {
    let (f, h) = (&raw.far_field, &raw.hybrid);
    let margin_mm = r.margin_mm(packages.array.pitch_mm);
    at.length("receiver.plane_height_mm", r.plane_height_mm)?;
    at.length("receiver.bin_mm", r.bin_mm)?;
    let most = packages.array.pitch_mm.min() / 4.0;
    at.within("receiver.bin_mm", r.bin_mm, 1e-3, most)?;
    if let Some(read) = r.read_bin_mm {
        at.within("receiver.read_bin_mm", read, r.bin_mm, most)?;
        whole_multiple(at, "receiver.read_bin_mm", read, ("receiver.bin_mm", r.bin_mm))?;
    }
    at.within("receiver.smoothing_sigma_mm", r.smoothing_sigma_mm, 0.0, most)?;
    let half = 0.5 * packages.array.pitch_mm.max();
    at.within("receiver.margin_mm", margin_mm, half, package::MAX_MARGIN_MM)?;
    let across = |half: f64| 2.0 * (half + margin_mm) / r.bin_mm;
    let bins: f64 = packages.half_extent_mm().map(across).iter().product();
    if bins > MAX_BINS {
        // Rounded up to micrometres.
        let least_mm = (1e3 * r.bin_mm * (bins / MAX_BINS).sqrt()).ceil() / 1e3;
        return Err(at.value(
            "receiver.bin_mm",
            r.bin_mm,
            &format!("at least {least_mm} mm, for {MAX_BINS} bins on the plane, not {bins:.0}"),
        ));
    }
    at.within("receiver.full_scale", r.full_scale, 2.0, 1e9)?;
    check_area(r, packages, at)?;
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
        let expected =
            format!("{inner} and any multiple of {read} more, where the bins that are read end");
        return Err(at.value("far_field.centre_deg", f.centre_deg, &expected));
    }
    let least = if f.peak == PeakMethod::Parabola { read } else { 0.0 };
    at.within("far_field.peak_fit_deg", f.peak_fit_deg, least, 45.0)?;
    if let Some(cut) = f.cut_deg {
        at.within("far_field.cut_deg", cut, 0.0, 90.0)?;
    }
    at.length_um("hybrid.element_width_um", h.element_width_um)?;
    at.count("hybrid.rings_per_band", h.rings_per_band, 1, 100_000)?;
    at.count("hybrid.representative", h.representative, 1, h.rings_per_band)?;
    if let Some(count) = h.kx_per_zone {
        at.count("hybrid.kx_per_zone", count, 1, MAX_KX)?;
    }
    if let Some(count) = h.ky_count {
        at.count("hybrid.ky_count", count, 2, 1024)?;
    }
    if !(MIN_TOLERANCE..=MAX_TOLERANCE).contains(&h.tolerance) {
        let expected = format!("a number from {MIN_TOLERANCE:e} to {MAX_TOLERANCE}");
        return Err(at.value("hybrid.tolerance", h.tolerance, &expected));
    }
    at.within("hybrid.memory_gib", h.memory_gib, 0.001, 1e6)?;
    if let Some(stairs) = h.stairs_um {
        at.within("hybrid.stairs_um", stairs, 1e-3, 1e3)?;
    }
    let t = &raw.trace;
    if !PATHS.contains(&t.paths) {
        let expected = format!("a whole number from {} to {}", PATHS.start(), PATHS.end());
        return Err(at.value("trace.paths", t.paths, &expected));
    }
    at.count("trace.max_interactions", t.max_interactions as usize, 10, 10_000_000)?;
    Ok(())
}
