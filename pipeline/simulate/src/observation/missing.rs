// SPDX-License-Identifier: MIT OR Apache-2.0
//! The warning of a run without figures of uniformity.

use design::Design;
use metrics::digits::shortest;
use metrics::plural::count;
use metrics::valley;

use super::map_reader::MapReader;
use super::{Observation, layout, plane_grid};

impl Observation {
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
            valley::fits(plane_grid(&design), &layout.straight(), layout.pitch_mm)
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
