// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures of a model in memory, of its light alone or beside that of another design or model that
//! was traced with the same random numbers.

use std::borrow::Cow;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use rayon::prelude::*;

use metrics::Grouped;
use metrics::illuminance::Grid;
use metrics::quantity::{Curve, Map};
use report::plots::{LineColours, MapScale, Picture, map_on_scale};
use results::ModelResult;
use results::figure_entry::FigureEntry;
use results::paired_figure::PairedFigure;
use results::shown;
use runtime::run_context::RunContext;
use simulate::model_writer::{ModelWriter, Output};
use simulate::observation::Observation;
use simulate::units::Units;

use super::map_pictures::section;
use super::{ModelFiles, receivers, take_receivers};

/// A picture with the word that names its kind, and its caption.
#[derive(Debug)]
pub struct LivePicture {
    /// `map`, `map_log`, `map_colours`, `difference`, `cross_section`, `far_field` or `far_field_polar`.
    pub id: &'static str,
    /// Words below it.
    pub caption: String,
    /// The picture.
    pub picture: Picture,
}

/// Light of a model that another is compared with.
#[derive(Debug)]
pub struct Beside {
    units: Units,
    grid: Grid,
    illuminance: Grouped,
    /// Mean of the far field over azimuth, both sides.
    far_field: Curve,
    replicates: Vec<(String, PairedFigure)>,
}

/// Light of a model, to be seen.
#[derive(Debug, Default)]
pub struct LiveLight {
    /// Pictures.
    pub pictures: Vec<LivePicture>,
    /// Changes of figures from what stands beside, by key.
    pub changes: Vec<(String, FigureEntry)>,
    /// Intensity over polar angle and azimuth.
    pub far_field: Option<Map>,
}

/// Light to be seen, or what another is compared with.
#[derive(Debug, Default)]
struct Drawn {
    light: LiveLight,
    beside: Option<Beside>,
}

/// Draws a model and writes no file.
#[derive(Debug, Default)]
pub struct LiveWriter<'a> {
    beside: Option<&'a Beside>,
    keeps: bool,
    drawn: Mutex<Drawn>,
}

/// Beginning of the keys of fluxes of receivers, which traces have as shares.
const FLUX_OF_RECEIVER: &str = "flux.";
/// Name of the curves of what stands beside.
const KEPT: &str = "kept";

impl<'a> LiveWriter<'a> {
    /// A writer of pictures, with the light `beside` in them.
    pub fn drawing(beside: Option<&'a Beside>) -> Self {
        Self { beside, ..Self::default() }
    }

    /// A writer that draws nothing and keeps what another model is compared with.
    pub fn keeping() -> Self {
        Self { keeps: true, ..Self::default() }
    }

    /// What [`Self::drawing`] drew.
    pub fn into_light(self) -> LiveLight {
        self.drawn.into_inner().unwrap_or_else(PoisonError::into_inner).light
    }

    /// What [`Self::keeping`] kept.
    pub fn into_beside(self) -> Option<Beside> {
        self.drawn.into_inner().unwrap_or_else(PoisonError::into_inner).beside
    }
}

impl ModelWriter for LiveWriter<'_> {
    fn draws_package(&self) -> bool {
        false
    }

    fn write(
        &self,
        output: Output,
        result: &mut ModelResult,
        observation: &mut Cow<'_, Observation>,
        context: RunContext,
    ) -> Result<()> {
        let design = output.design;
        let is_paired = self.keeps || self.beside.is_some();
        let replicates = if is_paired {
            in_units(observation.estimated_replicates(design, |_| true), &output.units)
        } else {
            Vec::new()
        };
        let (of_receivers, seen) = take_receivers(design, result, observation);
        let files = ModelFiles::new(output, result, observation, Path::new(""), context.seed);
        files.check_ledger()?;
        let mut drawn = Drawn::default();
        if self.keeps {
            drawn.beside = Some(files.beside(replicates)?);
        } else {
            drawn.light.pictures = files.live_pictures(self.beside)?;
            drawn.light.far_field = Some(files.far_field_map()?);
            let before = self.beside.into_iter().flat_map(|beside| &beside.replicates);
            let change = |(key, before): &(String, PairedFigure)| {
                let (_, now) = replicates.iter().find(|(other, _)| other == key)?;
                let unit = shown::named(key).1;
                Some((key.clone(), now.change(before).in_range_of_changes(unit)))
            };
            drawn.light.changes = before.filter_map(change).collect();
        }
        if !design.receivers.is_empty() {
            let provenance = files.provenance();
            let shared = files.of_receivers(&of_receivers, &provenance);
            let (_, said) = receivers::keep(design, seen, &shared)?;
            result.receivers = Some(said);
        }
        *self.drawn.lock().unwrap_or_else(PoisonError::into_inner) = drawn;
        Ok(())
    }
}

/// Replicates with the fluxes of receivers in the units in which results state them.
fn in_units(
    mut replicates: Vec<(String, PairedFigure)>,
    units: &Units,
) -> Vec<(String, PairedFigure)> {
    let factor = units.per_flux();
    let fluxes = replicates.iter_mut().filter(|(key, _)| key.starts_with(FLUX_OF_RECEIVER));
    for (_, flux) in fluxes {
        flux.entry = flux.entry.times(factor);
        flux.without.iter_mut().for_each(|value| *value *= factor);
    }
    replicates
}

impl ModelFiles<'_> {
    fn beside(&self, replicates: Vec<(String, PairedFigure)>) -> Result<Beside> {
        Ok(Beside {
            units: self.units,
            grid: self.observation.grid,
            illuminance: self.observation.illuminance.clone(),
            far_field: self.far_field_curves(90.0, &[])?[0].mirrored()?.labelled(KEPT),
            replicates,
        })
    }

    fn live_pictures(&self, beside: Option<&Beside>) -> Result<Vec<LivePicture>> {
        // Curves in watts and in lumens have no axis in common.
        let beside = beside.filter(|kept| kept.units.intensity() == self.units.intensity());
        let (plane, far) =
            rayon::join(|| self.plane_pictures(beside), || self.live_far_field(beside));
        let (mut pictures, [straight, polar]) = (plane?, far?);
        let far = "Far field, with bands of two standard errors to each side.";
        pictures.extend(
            [("far_field", straight), ("far_field_polar", polar)]
                .map(|(id, picture)| LivePicture { id, caption: far.to_owned(), picture }),
        );
        Ok(pictures)
    }

    fn live_far_field(&self, beside: Option<&Beside>) -> Result<[Picture; 2]> {
        let Some(kept) = beside else {
            return self.far_field_pictures(&self.shown_far_field()?, self.colours());
        };
        let now = self.far_field_curves(90.0, &[])?[0].mirrored()?.labelled("now");
        self.far_field_pictures(&[now, kept.far_field.clone()], LineColours::Neutral)
    }

    fn plane_pictures(&self, beside: Option<&Beside>) -> Result<Vec<LivePicture>> {
        let (map, line) = (self.map()?, self.line());
        let live =
            |id, caption: &str, picture| LivePicture { id, caption: caption.to_owned(), picture };
        let drawn = |(id, scale, caption)| -> Result<LivePicture> {
            let picture = self.map_picture(&map, &line, |map| map_on_scale(map, scale))?;
            Ok(live(id, caption, picture))
        };
        let scales = [
            ("map", MapScale::Linear, "Light on the receiver plane, linear."),
            ("map_log", MapScale::Logarithmic, "Light on the receiver plane, logarithmic."),
        ];
        let mut pictures: Vec<LivePicture> =
            scales.into_par_iter().map(drawn).collect::<Result<_>>()?;
        if let Some(colours) = self.arrays() {
            let caption = "Colours of the light on the receiver plane.";
            let picture = self.map_of_colours(colours)?;
            pictures.extend(picture.map(|picture| live("map_colours", caption, picture)));
        }
        let mut add = |id, caption: &str, picture| pictures.push(live(id, caption, picture));
        let now = self.section(&line)?;
        let (curves, colours) = match beside {
            None => (vec![now], self.colours()),
            Some(kept) => {
                let other = section(&kept.illuminance, kept.grid, &kept.units, &line)?;
                (vec![now.labelled("now"), other.labelled(KEPT)], LineColours::Neutral)
            }
        };
        let caption = "Cross-section along the line on which the valley is read.";
        add("cross_section", caption, self.section_picture(&line, &curves, colours)?);
        if let Some(difference) = beside.and_then(|kept| self.difference(&map, kept)) {
            let caption = "Map less the kept one; within two errors it has the colour of 0.";
            add(
                "difference",
                caption,
                self.map_picture(&difference?, &line, |map| {
                    map_on_scale(map, MapScale::Difference)
                })?,
            );
        }
        Ok(pictures)
    }

    /// The map less that of `kept`, with paired errors; `None` over another plane.
    fn difference(&self, map: &Map, kept: &Beside) -> Option<Result<Map>> {
        let now = &self.observation.illuminance;
        if kept.grid != self.observation.grid || kept.illuminance.count() != now.count() {
            return None;
        }
        let [plus, minus] = [self.units, kept.units].map(|units| units.per_irradiance());
        let change = Grouped::weighted(&[(plus, now), (-minus, &kept.illuminance)]);
        let (value, error) = change.each(|_, e| e);
        let axes = (map.rows().clone(), map.columns().clone());
        Some(Map::new(map.quantity().clone(), axes.0, axes.1, value, error))
    }
}
