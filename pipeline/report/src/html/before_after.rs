// SPDX-License-Identifier: MIT OR Apache-2.0
//! Section, map and far field of the design at the beginning of a search and of the one found, each
//! kind on one scale.

use anyhow::Result;
use metrics::quantity::{Curve, Quantity};
use results::optimisation::OptimisationFile;
use serde_json::Value;

use super::maps::{leds, marks};
use super::models::{Contents, Model};
use super::optimisation::searched;
use super::package::FEW;
use super::pictures::Album;
use crate::path_picture::compact_picture;
use crate::plots::{
    FarField, Heading, IlluminanceMap, LineColours, MapScale, far_field_cartesian, map_on_scale,
};

impl Album {
    /// Rows of pictures of `search`; none where the folder lacks one of both designs.
    ///
    /// # Errors
    /// Maps and curves that cannot be drawn.
    pub fn before_after(
        &mut self,
        search: Option<&OptimisationFile>,
        of: Contents,
    ) -> Result<Vec<Vec<Value>>> {
        let Some((search, [before, after])) = search.and_then(|file| Some((file, pair(file, of)?)))
        else {
            return Ok(Vec::new());
        };
        let both = [("before", before), ("after", after)];
        let named = |model: &Model| format!("{}, {}", model.design, model.label());
        let names = both.map(|(when, i)| format!("{when}: {}", named(&of.models[i])));
        let mut rows = Vec::new();

        let drawn = both.map(|(_, i)| of.packages[i].as_ref());
        if let [Some(a), Some(b)] = drawn {
            let row = [a, b].into_iter().zip(&names).map(|(package, name)| {
                let paths = &package.section_paths[..package.section_paths.len().min(FEW)];
                let heading = Heading::new(name, "plane y = 0");
                let drawings = [&a.drawing, &b.drawing];
                let picture = compact_picture(&package.drawing, &heading, paths, &drawings);
                self.fixed(&picture, &format!("Section, {name}."))
            });
            rows.push(row.collect());
        }

        let ranges = both.map(|(_, i)| of.maps[i].range());
        let range = [ranges[0][0].min(ranges[1][0]), ranges[0][1].max(ranges[1][1])];
        let mut row = Vec::new();
        for ((_, i), name) in both.into_iter().zip(&names) {
            let map = of.maps[i].to_map()?;
            let leds = of.packages[i].as_ref().map_or(Vec::new(), leds);
            let heading = Heading::new(map.quantity().label(), name);
            let picture = IlluminanceMap {
                leds: &leds,
                range: Some(range),
                marks: &marks(&of.models[i]),
                ..IlluminanceMap::plain(&heading, &map)
            };
            let picture = map_on_scale(&picture, MapScale::Linear)?;
            row.push(self.fixed(&picture, &format!("Map of the receiver plane, {name}.")));
        }
        rows.push(row);

        let mut curves = Vec::new();
        for ((when, i), field) in both.map(|both| (both, &of.fields[both.1])) {
            if let Some(mean) = field.curves.first() {
                let upper = mean.x().iter().filter(|theta| **theta <= 90.0).count();
                let cut = |list: &[f64]| list[..upper].to_vec();
                let [x, value, error] = [mean.x(), mean.value(), mean.standard_error()].map(cut);
                let name = format!("{when}, {}", of.models[i].design);
                curves.push(Curve::new(&name, x, value, error)?.mirrored()?);
            }
        }
        let subtitle =
            format!("{} from {}, {}", search.name, search.design, of.models[after].label());
        let picture = far_field_cartesian(&FarField {
            heading: &Heading::new("Far field", subtitle),
            quantity: &Quantity::new("intensity", of.fields[after].unit),
            curves: &curves,
            colours: LineColours::Neutral,
            numbers: &[],
            peaks: &[],
        })?;
        rows.push(vec![self.fixed(&picture, "Far fields before and after, means over azimuth.")]);
        Ok(rows)
    }
}

/// Numbers of the design at the beginning and of the one found, in the model that was searched.
fn pair(file: &OptimisationFile, of: Contents) -> Option<[usize; 2]> {
    let place = |design: &str, key: &str| {
        of.models.iter().position(|model| model.design == design && model.key == key)
    };
    let key = searched(file, of.models, &file.name)?.key;
    let after = place(&file.name, key)?;
    let before = place(&file.design, key)?;
    let same_unit = of.fields[before].unit == of.fields[after].unit
        && of.maps[before].unit == of.maps[after].unit;
    (same_unit && before != after).then_some([before, after])
}
