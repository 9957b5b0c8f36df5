// SPDX-License-Identifier: MIT OR Apache-2.0
//! Maps of the receiver plane and profiles through them: axes, LEDs and marks. The page's script
//! paints the bins and draws the profiles.

use anyhow::Result;
use metrics::figures::VALLEY_TO_PEAK;
use serde_json::{Value, json};

use metrics::quantity::{Axis, Curve, Map, Quantity, Unit};
use results::package::{MAP, PackageFile};

use super::models::{Contents, Model, Plane};
use super::pictures::Album;
use crate::plots::{
    BinImage, Heading, IlluminanceMap, LedOutline, LineColours, MapScale, Mark, Section,
    cross_section, map_on_scale, palette,
};

impl Album {
    /// Axes of the maps, linear and logarithmic, and of profiles through them. Those of models of
    /// one design have one range.
    ///
    /// # Errors
    /// A map without extent.
    pub fn maps(&mut self, of: Contents) -> Result<[Vec<Value>; 2]> {
        let (mut maps, mut profiles) = (Vec::new(), Vec::new());
        for (i, (model, plane)) in of.models.iter().zip(of.maps).enumerate() {
            let range = shared_range(model, of);
            let leds = of.packages[i].as_ref().map_or(Vec::new(), leds);
            let quantity = Quantity::new(&plane.quantity, plane.unit);
            let subtitle = format!("{}, {}", model.design, model.label());
            let [across, along] = plane.bin_mm.map(|mm| (mm * 1e4).round() / 1e4);
            let merged = match plane.merged {
                1 => String::new(),
                n => format!("; {n} × {n} bins of the file are one here"),
            };
            for (scale, name) in
                [(MapScale::Linear, "linear"), (MapScale::Logarithmic, "logarithmic")]
            {
                let picture = map_on_scale(
                    &IlluminanceMap {
                        heading: &Heading::new(
                            Quantity::new(&plane.quantity, Unit::Relative).label(),
                            &subtitle,
                        ),
                        map: &frame(plane, range)?,
                        leds: &leds,
                        range: Some(range),
                        image: BinImage::Omitted,
                        marks: &marks(model),
                        section: None,
                    },
                    scale,
                )?;
                let caption = format!(
                    "{subtitle}: {}, {name} scale, bins of {across} × {along} mm{merged}.",
                    plane.quantity
                );
                let keys = json!({"model": i.to_string(), "scale": name});
                maps.push(self.add(&picture, &caption, &keys, i == 0));
            }
            let [x, y] = plane.ends_mm();
            let curve = |name: &str, [low, high]: [f64; 2]| {
                Curve::new(name, vec![low, high], range.to_vec(), vec![0.0; 2])
            };
            let picture = cross_section(&Section {
                heading: &Heading::new("Profiles through the cross", &subtitle),
                position: &Quantity::new("position", Unit::Millimetre),
                quantity: &quantity,
                curves: &[curve("along x", x)?, curve("along y", y)?],
                leds: &[],
                marks: &[],
                level: None,
                colours: LineColours::OfModel(palette::model_number(model.key).unwrap_or(0)),
                range: Some(range),
            })?;
            let caption =
                format!("{subtitle}: profiles along x and y through the cross on the map.");
            profiles.push(self.add(&picture, &caption, &json!({"model": i.to_string()}), i == 0));
        }
        Ok([maps, profiles])
    }
}

/// Sentences on the maps: how that of each design is averaged and smoothed, and where marks stand.
pub fn words(of: Contents) -> String {
    let all = of.models.iter().zip(of.packages).map(|(model, package)| {
        let said = package.iter().flat_map(|package| &package.simulated);
        let said = said.clone().find(|(name, _)| name == MAP).map(|(_, words)| words.as_str());
        let figure = model.entry.figures.get(VALLEY_TO_PEAK.key);
        let is_marked = figure.is_some_and(|f| f.valley_at_mm.is_some() && f.peak_at_mm.is_some());
        (model.design, said, is_marked)
    });
    sentences(&all.collect::<Vec<_>>())
}

/// Sentences on maps of designs, each with what is said of it and whether its marks stand.
fn sentences(maps: &[(&str, Option<&str>, bool)]) -> String {
    let mut said: Vec<(&str, Vec<&str>)> = Vec::new();
    for (design, words) in maps.iter().filter_map(|(design, words, _)| Some((*design, (*words)?))) {
        match said.iter_mut().find(|(known, _)| *known == words) {
            Some((_, designs)) if designs.contains(&design) => {}
            Some((_, designs)) => designs.push(design),
            None => said.push((words, vec![design])),
        }
    }
    let is_one = said.len() == 1;
    let mut all: Vec<String> = said
        .into_iter()
        .map(|(words, designs)| {
            let of = if is_one { String::new() } else { format!(" of {}", designs.join(", ")) };
            format!("The map{of} is {words}.")
        })
        .collect();
    let marked = maps.iter().filter(|(.., is_marked)| *is_marked);
    let mut designs: Vec<&str> = marked.map(|(design, ..)| *design).collect();
    designs.dedup();
    let is_all = maps.iter().all(|(design, ..)| designs.contains(design));
    if is_all && !designs.is_empty() {
        all.push("Triangles stand where valley and peak were read.".to_owned());
    } else if !designs.is_empty() {
        let designs = designs.join(", ");
        all.push(format!("Triangles stand where valley and peak of {designs} were read."));
    }
    all.join(" ")
}

/// Smallest positive and largest value of the maps of all models of the design of `model`.
pub fn shared_range(model: &Model, of: Contents) -> [f64; 2] {
    let all = of.models.iter().zip(of.maps);
    let same = all.filter(|(other, _)| other.design == model.design);
    // A dark map has no range of its own.
    let lit = same.filter(|(_, plane)| plane.is_lit());
    let ranges = lit.map(|(_, plane)| plane.range());
    let range = ranges.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
    range.unwrap_or([1.0, 2.0])
}

/// A map of one bin, for its axes.
fn frame(plane: &Plane, [_, most]: [f64; 2]) -> Result<Map> {
    let [x, y] = plane.ends_mm();
    let axis = |name, [low, high]: [f64; 2]| {
        Axis::uniform(Quantity::new(name, Unit::Millimetre), low, high, 1)
    };
    let quantity = Quantity::new(&plane.quantity, plane.unit);
    Map::new(quantity, axis("y", y)?, axis("x", x)?, vec![most], vec![0.0])
}

/// Outlines of the LEDs of all packages.
pub(super) fn leds(package: &PackageFile) -> Vec<LedOutline> {
    let [width, depth, _] = package.drawing.led_mm;
    let offsets = package.drawing.led_offsets_mm.iter().copied();
    let offsets = offsets.chain(std::iter::repeat([0.0; 2]));
    let turns = package.drawing.turns_deg.iter().copied().chain(std::iter::repeat(0.0));
    let scales = package.drawing.scales.iter().copied().chain(std::iter::repeat(1.0));
    let axes = package.drawing.axes_mm.iter().zip(offsets).zip(turns).zip(scales);
    axes.map(|(((axis, offset), turn_deg), scale)| LedOutline {
        centre: [0, 1].map(|k| axis[k] + offset[k]),
        size: [width, depth].map(|length| scale * length),
        turn_deg,
    })
    .collect()
}

/// Marks at the places of valley and peak.
pub(super) fn marks(model: &Model) -> Vec<Mark> {
    let Some(figure) = model.entry.figures.get(VALLEY_TO_PEAK.key) else {
        return Vec::new();
    };
    let valley = figure.valley_at_mm.map(|at| Mark::valley(at, figure));
    let peak = figure.peak_at_mm.map(Mark::peak);
    valley.into_iter().chain(peak).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_said_to_be_what_their_designs_ask_for() {
        let (averaged, plain) = (Some("averaged"), Some("not averaged"));
        let marks = "Triangles stand where valley and peak";
        assert_eq!(
            sentences(&[("a", averaged, true), ("a", averaged, false)]),
            format!("The map is averaged. {marks} were read.")
        );
        assert_eq!(sentences(&[("a", plain, false)]), "The map is not averaged.");
        assert_eq!(
            sentences(&[("a", averaged, true), ("b", plain, false)]),
            format!(
                "The map of a is averaged. The map of b is not averaged. {marks} of a were read."
            )
        );
        // Of results of an earlier version nothing is known.
        assert_eq!(sentences(&[("a", None, false)]), "");
    }
}
