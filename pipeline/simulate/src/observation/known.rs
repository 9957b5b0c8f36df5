// SPDX-License-Identifier: MIT OR Apache-2.0
//! The figures that a design has, told before anything is traced.

use anyhow::{Result, bail, ensure};
use design::Design;
use design::resolved::receivers::CheckedReceiver;
use metrics::digits::thousands;
use metrics::extraction::is_end;
use metrics::far_field::PeakMethod;
use metrics::figures::{
    self, BEAM_ANGLE, CENTRE_TO_PEAK, Definition, FAR_FIELD_COLOUR, FIELD_ANGLE, INTENSITY_PEAK,
    INTENSITY_PER_KILOLUMEN, PANEL_WHITE, PARABOLA, PEAK_ANGLE, PLANE_COLOUR, RECEIVER_COLOUR,
    Source, colours_of_receiver, receiver,
};
use metrics::kinds::ReceiverKind;
use metrics::layout::Layout;
use metrics::plural::count;
use metrics::quantity::Unit;
use metrics::uniformity_forms::cell;
use metrics::valley;
use results::shown;

use super::reader::unit_of_receiver;
use super::readers::{figures_of, has_lumens};
use super::{Observation, accounts, layout, plane_grid};
use crate::dome_surface::dome_surface;
use crate::lit;
use crate::model::Model;
use crate::scene;
use crate::units::Units;

/// The figure under `key`, if `design` has it.
///
/// # Errors
/// A key of no figure, with all keys; a receiver or account that the design has not, with those
/// that it has; why the design has no such figure.
pub fn check_figure(design: &Design, key: &str) -> Result<Definition> {
    let Some(figure) = figures::find(key) else {
        bail!("expected one of {}, got {key:?}", figures::keys());
    };
    if let Some(why) = missing(design, &figure) {
        bail!("expected a figure that the design has, got {key}, {why}");
    }
    let known = match figure.source {
        Source::Receiver | Source::ReceiverColours | Source::PanelColours => {
            let of = |r: &CheckedReceiver| {
                let is_known = |figure: &Definition| {
                    r.kind() != ReceiverKind::Surface && missing(design, figure).is_none()
                };
                let named = |figure: Definition| figure.of_receiver(r.name()).key.into_owned();
                let all = figures_of(r).chain(colours_of_receiver().filter(is_known));
                all.map(named).collect::<Vec<_>>()
            };
            design.receivers.iter().flat_map(of).collect()
        }
        Source::Ledger if figures::all().all(|known| known.key != key) => ends(design)?,
        _ => return Ok(figure),
    };
    ensure!(
        known.iter().any(|name| name == key),
        "expected one of {}, got {key:?}",
        if known.is_empty() { "the figures of [[receivers]]".to_owned() } else { known.join(", ") }
    );
    Ok(figure)
}

/// Figures that some light has not, each by the beginning of its key; that of a figure which all such
/// light has; and why.
const UNREADABLE: [(&str, &str, &str); 15] = [
    (receiver::WIDTH_U.key, receiver::AXIAL.key, NO_HALF),
    (receiver::WIDTH_V.key, receiver::AXIAL.key, NO_HALF),
    (BEAM_ANGLE.key, PEAK_ANGLE.key, "the intensity does not fall to half of its peak"),
    (FIELD_ANGLE.key, PEAK_ANGLE.key, "the intensity does not fall to a tenth of its peak"),
    (CENTRE_TO_PEAK.key, PEAK_ANGLE.key, NARROW),
    (INTENSITY_PER_KILOLUMEN.key, PEAK_ANGLE.key, NARROW),
    (INTENSITY_PEAK.key, PEAK_ANGLE.key, NARROW),
    (RECEIVER_COLOUR.cct_k.key, RECEIVER_COLOUR.u_prime.key, NO_RADIATOR),
    (RECEIVER_COLOUR.duv.key, RECEIVER_COLOUR.u_prime.key, NO_RADIATOR),
    (PANEL_WHITE.cct_k.key, PANEL_WHITE.u_prime.key, NO_RADIATOR),
    (PANEL_WHITE.duv.key, PANEL_WHITE.u_prime.key, NO_RADIATOR),
    (PLANE_COLOUR.cct_k.key, PLANE_COLOUR.u_prime.key, NO_RADIATOR),
    (PLANE_COLOUR.duv.key, PLANE_COLOUR.u_prime.key, NO_RADIATOR),
    (FAR_FIELD_COLOUR.cct_k.key, FAR_FIELD_COLOUR.u_prime.key, NO_RADIATOR),
    (FAR_FIELD_COLOUR.duv.key, FAR_FIELD_COLOUR.u_prime.key, NO_RADIATOR),
];
const NO_HALF: &str = "the luminance does not fall to half of its peak";
const NARROW: &str = "the peak is as narrow as a bin of the far field (far_field.bin_deg)";
const NO_RADIATOR: &str =
    "the colour is too far from that of a black body from 1000 to 20,000 K (|Duv| above 0.05)";

/// Why a trace of `design` by so many paths that shows the figures `is_shown` does not show that under `key`: its
/// design, its light, or too little of it.
pub fn why_absent(
    design: &Design,
    paths: u64,
    key: &str,
    is_shown: impl Fn(&str) -> bool,
) -> String {
    let Some(figure) = figures::find(key) else { return "no such figure".to_owned() };
    if let Some(why) = missing(design, &figure) {
        return format!("the design does not have it, {why}");
    }
    for (own, companion, why) in UNREADABLE {
        let rest = key.strip_prefix(own);
        if rest.is_some_and(|rest| is_shown(&format!("{companion}{rest}"))) {
            return why.to_owned();
        }
    }
    format!("{} show too little light for it", count(thousands(paths), "path"))
}

impl Observation {
    /// Why the figure under `key` of `design` is not shown here.
    pub fn why_absent(&self, design: &Design, key: &str) -> String {
        why_absent(design, self.paths, key, |key| {
            !self.replicated(design, |other| other == key).is_empty()
        })
    }
}

/// Unit of the figure under `key` in the light of `design`.
pub fn unit_of(design: &Design, key: &str) -> Unit {
    let Some(figure) = figures::find(key) else { return shown::named(key).1 };
    let name = key.split_once('.').map(|(_, name)| name);
    let receiver = design.receivers.iter().find(|receiver| Some(receiver.name()) == name);
    let unit = receiver.map_or(figure.unit, |of| unit_of_receiver(figure, of.kind()));
    Units::from_design(design, design.all_lights().as_deref()).of_unit(unit).0
}

/// True where the figure under `key` has one meaning in the light of two designs, so that its values
/// may be subtracted: watts are not subtracted from lumens, nor shares of watts from shares of lumens
/// of converted light.
pub fn is_comparable(a: &Design, b: &Design, key: &str) -> bool {
    let is_share_of_light = figures::find(key).is_some_and(|figure| figure.key == "flux");
    unit_of(a, key) == unit_of(b, key)
        && (a.converts_in_lumens == b.converts_in_lumens || !is_share_of_light)
}

/// Symbol of that unit for files, whose keys say others; empty where the key says it.
pub fn unit_in_files(design: &Design, key: &str) -> String {
    match (shown::named(key).1, unit_of(design, key)) {
        (Unit::Relative, unit) if unit != Unit::Relative => unit.symbol().to_owned(),
        _ => String::new(),
    }
}

/// Why `design` has no such figure.
fn missing(design: &Design, figure: &Definition) -> Option<&'static str> {
    let layout = layout(design);
    let bin_mm = design.receiver.read_bin_mm.unwrap_or(design.receiver.bin_mm);
    let has_cell = || {
        let corners = cell(&layout).into_iter();
        corners.flat_map(|[low, high]| [0, 1].map(|k| high[k] - low[k])).all(|w| w >= 2.0 * bin_mm)
    };
    let between_neighbours = !figure.key.starts_with("cell_");
    let why = match figure.source {
        Source::Map if figure.key.starts_with("area_") && design.receiver.area_mm.is_some() => {
            return None;
        }
        Source::Map if figure.key.starts_with("area_") => "which needs an area (receiver.area_mm)",
        Source::Map if between_neighbours && layout.straight().is_empty() => {
            "which compares neighbouring LEDs, of which there are none"
        }
        Source::Map if between_neighbours && !fits(design, &layout) => {
            "and receiver.bin_mm is too wide for a fit to the valley between neighbours"
        }
        Source::Map if figure.key.starts_with("diagonal_") && layout.diagonal().is_empty() => {
            "and there is no square of four LEDs"
        }
        Source::Map | Source::Illuminance | Source::Colours
            if figure.key.contains("cell_") && !has_cell() =>
        {
            "and there is no cell between LEDs of several rows and columns"
        }
        Source::Domes if design.dome.is_none() => "and there is no dome",
        of if of.is_of_colours() && !has_wavelengths(design) => {
            "which needs light of several wavelengths ([light.spectrum] or sources of their own)"
        }
        Source::PanelColours if design.sub_pixels().is_empty() => {
            "which needs the sub-pixels of a panel (panel.sub_pixels)"
        }
        _ if *figure == PARABOLA && design.far_field.peak != PeakMethod::Bin => {
            "and far_field.peak is no bin: peak_angle_deg is that of the parabola"
        }
        _ if *figure == INTENSITY_PER_KILOLUMEN && design.converts() => {
            "whose light is converted: lumens that leave are no share of those emitted"
        }
        _ if figure.is_absolute && design.emitted.is_none() && design.converts() => {
            "which needs the power that the LEDs emit (led.power_w)"
        }
        _ if figure.is_absolute && design.emitted.is_none() => {
            "which needs the flux that the LEDs emit (led.power_w, led.power_lm)"
        }
        _ if *figure == INTENSITY_PER_KILOLUMEN && !has_lumens(design) => {
            "which needs visible light of one wavelength, or weighting = \"photometric\""
        }
        _ => return None,
    };
    Some(why)
}

/// False with bins too wide for a fit to the valley.
pub(super) fn fits(design: &Design, layout: &Layout) -> bool {
    let counted = lit::of_plane(design).map(|lit| lit.counted);
    let bins = (plane_grid(design), counted.as_deref());
    design.receiver.read_bin_mm.is_some() || valley::fits(bins, &layout.straight(), layout.pitch_mm)
}

fn has_wavelengths(design: &Design) -> bool {
    design.all_lights().is_some_and(|all| !all.is_one_wavelength()) || design.converts()
}

/// The ends of light of `design`, which all of its models share.
fn ends(design: &Design) -> Result<Vec<String>> {
    let scene = scene::build(design, &dome_surface(design, Model::Geometric, None)?)?;
    Ok(accounts(scene.lines()).into_iter().filter(|account| is_end(account)).collect())
}
