// SPDX-License-Identifier: MIT OR Apache-2.0
//! Warnings of a run without figures of uniformity, and of one whose figures of the far field are means
//! over unlike azimuths.

use design::Design;
use metrics::Estimate;
use metrics::digits::shortest;
use metrics::estimate::DISTINCT;
use metrics::far_field::{FarFieldReading, PeakPlace};
use metrics::plural::count;
use metrics::quantity::Unit;
use results::shown;

use super::map_reader::MapReader;
use super::{Observation, far_field_reading, known, layout};
use crate::symmetry::{cuts, symmetry};

/// Least difference of an angle between half-planes that is told, as a part of the larger.
const UNLIKE: f64 = 0.05;

impl Observation {
    /// Says that the light is not the same all around the axis, by the half-planes in which the beam
    /// or the peak angle is smallest and largest; `None` where they cannot be told apart, or where the
    /// design asks for one of them.
    pub fn unlike_half_planes(&self, design: &Design) -> Option<String> {
        let reading = far_field_reading(design);
        if reading.cut_deg.is_some() {
            return None;
        }
        let azimuths = cuts(symmetry(design)).into_iter().map(|(_, images)| images[0]);
        let read = azimuths.map(|azimuth| {
            let cut = FarFieldReading { cut_deg: Some(azimuth), ..reading };
            (azimuth, cut.figures(&self.far_field))
        });
        let read: Vec<_> = read.collect();
        let beams = read.iter().filter_map(|(azimuth, far)| {
            let (beam, ends) = far.widths_deg[0];
            (ends.is_none() && beam.is_resolved()).then_some((*azimuth, beam))
        });
        let peaks = read.iter().filter_map(|(azimuth, far)| {
            let is_known = far.peak_place == PeakPlace::OffAxis && far.peak_edges_deg.is_none();
            is_known.then_some((*azimuth, far.peak_angle_deg))
        });
        let unlike = unlike("beam angle", beams.collect());
        let unlike = unlike.or_else(|| self::unlike("peak angle", peaks.collect()))?;
        Some(format!(
            "the light is not the same all around the axis: {unlike}; peak, beam and field angle, intensities and centre/peak are those of the mean over azimuth (far_field.cut_deg reads them in a half-plane)"
        ))
    }

    /// Why figures of the map are missing, in the words of the design file; `None` where they
    /// exist, or where no neighbours do.
    pub fn without_uniformity(&self, design: &Design) -> Option<String> {
        let receiver = &design.receiver;
        if !self.lit() {
            return Some(format!(
                "receiver.plane_height_mm = {}: no light of {} goes up through the map there; the map is dark, and figures of uniformity are left out",
                receiver.plane_height_mm,
                count(self.paths, "path")
            ));
        }
        let layout = layout(design);
        if layout.straight().is_empty() || MapReader::new(design, self).has_valley() {
            return None;
        }
        let fits = |bin_mm: f64| {
            let mut design = design.clone();
            design.receiver.bin_mm = bin_mm;
            known::fits(&design, &layout)
        };
        let decades = (-3..=3).rev().map(|power| 10f64.powi(power));
        let widths = decades.flat_map(|decade| [5.0, 2.5, 2.0, 1.0].map(|w| w * decade));
        let mut narrower = widths.filter(|width| *width < receiver.bin_mm);
        let advice = narrower.find(|width| fits(*width)).map_or_else(String::new, |width| {
            format!("with bins of {width} mm they are read, and ")
        });
        Some(format!(
            "receiver.bin_mm = {}: too wide for a fit to the valley between neighbours {} mm apart, and figures along segments and diagonals are left out; {advice}with receiver.read_bin_mm bins themselves are read",
            receiver.bin_mm,
            shortest(layout.pitch_mm)
        ))
    }
}

/// Words for the smallest and the largest of angles in half-planes, where they can be told apart.
fn unlike(name: &str, mut angles: Vec<(f64, Estimate)>) -> Option<String> {
    angles.retain(|(_, angle)| angle.value.is_finite() && angle.standard_error.is_finite());
    angles.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let [(at, least), .., (end, most)] = angles[..] else { return None };
    let error = DISTINCT * least.standard_error.hypot(most.standard_error);
    let words = |angle: Estimate, azimuth: f64| {
        format!("{} at an azimuth of {azimuth}°", shown::estimate(angle, Unit::Degree))
    };
    (most.value - least.value > error.max(UNLIKE * most.value))
        .then(|| format!("{name} {}, {}", words(least, at), words(most, end)))
}
