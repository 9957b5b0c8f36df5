// SPDX-License-Identifier: MIT OR Apache-2.0
//! One model of a design in the light of a spectrum, or of sources that each have their own: tables and traces at a few wavelengths, put together by weight.
//!
//! Every light ([`crate::spectrum::lights`]) is traced by itself at each of its wavelengths, all other sources being dark: a path has the wavelength of its
//! trace. Where all sources share one light, it is that of the design. The spectrum gives nested rules of 1, 3, 7, ... wavelengths ([`crate::spectrum`]). Every wavelength has its own tables, index and
//! absorption of the silicone and paths, in the proportion of its weight; far field, map and ledger are added up group by group, so that
//! the jackknife over groups gives the statistical error of what is added. Wavelengths are added until the figures change by no more than
//! the tolerance from one rule to the next, or by no more than that change's own statistical error allows to see. Where nothing depends on
//! the wavelength (rays, bare silicone and solids without dispersion) one trace serves all.

mod account;
mod labels;
mod sweep;

use std::path::Path;

use anyhow::Result;
use serde_json::json;

use super::model::Model;
use super::observation::Observation;
use super::output;
use super::stopping_rule::Until;
use super::units::Units;
use crate::cache::Cache;
use crate::config::design::Design;
use crate::metrics::Estimate;
use crate::plural::count;
use crate::report::plots::Heading;
use crate::results::{Figure, ModelResult};
use crate::run_context::RunContext;
use crate::spectrum::Sampling;
use crate::spectrum::lights::{Colour, Light, Lights};
use crate::spectrum::quadrature::COUNTS;
use sweep::Sweep;

/// Files beside those of one wavelength: the far field at each, and all together.
pub const BY_WAVELENGTH: [&str; 2] = ["far_field_by_wavelength.csv", "far_field_by_wavelength.png"];

/// Figures whose change decides whether wavelengths are added.
const DECISIVE: [&str; 4] = [
    "peak_angle_deg",
    "centre_to_peak",
    "uniformity",
    "extraction_efficiency",
];
/// A change within this many of its standard errors is none that could be seen.
const UNSEEN: f64 = 2.0;
/// Degrees that count as much as a fraction of 1.
const DEGREES: f64 = 100.0;
/// A wavelength of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    /// Number of the light.
    light: usize,
    /// Wavelengths that stand for the light, of which this is one.
    of: usize,
    /// Vacuum wavelength, nm.
    nm: f64,
    /// Its part of the flux of all lights, weighted.
    weight: f64,
}

/// Wavelengths of all lights; those of a light beside each other, ascending.
type Rule = Vec<Node>;

/// Why no more wavelengths were added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    /// Every line was computed.
    Lines,
    /// Nothing depends on the wavelength.
    NoDispersion,
    /// The number that was asked for.
    Samples,
    /// Figures change by no more than the tolerance.
    Tolerance,
    /// Changes beyond the tolerance are within their statistical errors.
    Statistics,
    /// There is no larger rule, or no memory for it.
    Limit,
}

impl Stop {
    fn name(self) -> &'static str {
        match self {
            Self::Lines => "lines",
            Self::NoDispersion => "no_dispersion",
            Self::Samples => "samples",
            Self::Tolerance => "tolerance",
            Self::Statistics => "statistics",
            Self::Limit => "limit",
        }
    }
}

/// Traces `model` of `design` in the light of `lights`, writes its files and returns its figures. Tables come from `cache` or go there. With `until`, the
/// wavelengths are those that the first batch of paths asks for, and batches of all of them follow until a figure is known.
///
/// # Errors
/// Those of the solver, the tracer and the files; too many bins for the memory; too many wavelengths for tables; an interrupt.
pub fn model(
    design: &Design,
    lights: &Lights,
    model: Model,
    until: Option<&Until>,
    cache: Option<&Cache>,
    out: &Path,
    context: RunContext,
) -> Result<ModelResult> {
    let mut sweep = Sweep::new(design, lights, model, cache, context);
    let (rule, coarse, stop) = refine(&mut sweep)?;
    let until = until.map(|until| sweep.go_on(&rule, until)).transpose()?;
    let mut observation = sweep.combined(&rule);
    let mut result = output::result(design, model, &observation);
    result.until_error = until;
    let changes = coarse.as_ref().map(|coarse| {
        let coarse = sweep.compared(coarse);
        observation.changes(&coarse, design)
    });
    for figure in &mut result.figures {
        figure.wavelength_error = match (&changes, stop) {
            (Some(changes), _) => changes
                .iter()
                .find(|(key, _)| *key == figure.key)
                .map(|(_, e)| Estimate::new(e.value.abs(), e.standard_error)),
            (None, Stop::NoDispersion) => Some(Estimate::new(0.0, 0.0)),
            (None, _) => None,
        };
    }
    let units = Units::of(lights);
    let light = match &lights.lights[0].light {
        Colour::Spectrum(spectrum) if !lights.apart => json!(spectrum),
        _ => json!({"weighting": lights.weighting, "sources": sweep.account(&rule)}),
    };
    let mut description = json!({
        "light": light,
        "units": {
            "intensity": units.intensity().unit().symbol(),
            "map": units.irradiance().unit().symbol(),
        },
        "emitted": units.emitted(),
        "stopped_by": stop.name(),
        "wavelengths": sweep.describe(&rule),
    });
    if let Some(coarse) = &coarse {
        description["compared_with"] = coarse.len().into();
    }
    if lights.apart {
        description["efficiency"] = sweep.efficiency(&rule);
    }
    if design.by_source.is_some() {
        description["by_source"] = sweep.by_source(&rule);
    }
    result.spectrum = Some(description);

    result.files = output::files(design, &mut result, &mut observation, units, out, context)?;
    if stop != Stop::NoDispersion {
        let folder = output::folder(design, model);
        let heading = Heading::new(
            "Far field by wavelength",
            format!("{}, {}", design.name, result.label),
        );
        sweep.far_fields(&rule, &observation, &heading, &out.join(&folder))?;
        let by_wavelength = BY_WAVELENGTH.map(|file| folder.join(file));
        result.files.extend(by_wavelength);
    }
    Ok(result)
}

/// What the receivers see of `model` of `design` in the light of `lights`, all wavelengths together; nothing is written.
///
/// # Errors
/// Those of [`model`], but for files.
pub fn seen(
    design: &Design,
    lights: &Lights,
    model: Model,
    cache: Option<&Cache>,
    context: RunContext,
) -> Result<Observation> {
    let mut sweep = Sweep::new(design, lights, model, cache, context);
    let (rule, ..) = refine(&mut sweep)?;
    Ok(sweep.combined(&rule).into_owned())
}

/// Refuses, before anything is traced, more wavelengths than there are tables or memory for in one of `models`.
///
/// # Errors
/// How many there are, and how many there may be.
pub fn check(
    design: &Design,
    lights: &Lights,
    models: &[Model],
    context: RunContext,
) -> Result<()> {
    for &model in models {
        let sweep = Sweep::new(design, lights, model, None, context);
        if sweep.disperses()? {
            sweep.fits(&least(lights), compares(lights))?;
        } else if lights.apart {
            sweep.fits(&medians(lights), false)?;
        }
    }
    Ok(())
}

/// The wavelengths of all lights; those that are sampled to a tolerance have `count`. With `lower` those of a stated number have the number before.
fn rule(lights: &Lights, count: usize, lower: bool) -> Rule {
    let of = |(number, light): (usize, &Light)| {
        let count = match light.light.sampling() {
            Some(Sampling::Samples(stated)) if lower => before(stated).unwrap_or(stated),
            Some(Sampling::Samples(stated)) => stated,
            Some(Sampling::Tolerance(_)) | None => count,
        };
        let share = lights.share(light, lights.weighting);
        nodes(number, light.light.rule(count), share)
    };
    lights.lights.iter().enumerate().flat_map(of).collect()
}

/// One wavelength for each light, where nothing depends on it.
fn medians(lights: &Lights) -> Rule {
    let all = lights.lights.iter().enumerate();
    let of = |(number, light): (usize, &Light)| {
        let median = vec![(light.light.median_nm(), 1.0)];
        nodes(number, median, lights.share(light, lights.weighting))
    };
    all.flat_map(of).collect()
}

/// Nodes of a light that has this share of the flux.
fn nodes(light: usize, rule: Vec<(f64, f64)>, share: f64) -> Rule {
    let of = rule.len();
    let node = |(nm, weight): (f64, f64)| Node {
        light,
        of,
        nm,
        weight: share * weight,
    };
    rule.into_iter().map(node).collect()
}

/// The number of wavelengths before `count`.
fn before(count: usize) -> Option<usize> {
    COUNTS.iter().copied().rfind(|&n| n < count)
}

/// The fewest wavelengths that a run may take.
fn least(lights: &Lights) -> Rule {
    rule(lights, COUNTS[1], false)
}

/// Whether a light is sampled in a way.
fn any(lights: &Lights, is: impl Fn(Sampling) -> bool) -> bool {
    let mut all = lights.lights.iter();
    all.any(|light| light.light.sampling().is_some_and(&is))
}

/// Whether the sum is compared with that of fewer wavelengths.
fn compares(lights: &Lights) -> bool {
    any(lights, |sampling| match sampling {
        Sampling::Tolerance(_) => true,
        Sampling::Samples(count) => before(count).is_some(),
    })
}

/// The smallest tolerance that a light is sampled to.
fn tolerance(lights: &Lights) -> Option<f64> {
    let tolerances = lights.lights.iter().filter_map(|light| {
        let Some(Sampling::Tolerance(tolerance)) = light.light.sampling() else {
            return None;
        };
        Some(tolerance)
    });
    tolerances.min_by(f64::total_cmp)
}

/// Computes as many wavelengths as it takes: the rule, the one to compare it with, and why it is no larger.
fn refine(sweep: &mut Sweep<'_>) -> Result<(Rule, Option<Rule>, Stop)> {
    let lights = sweep.lights;
    if !sweep.disperses()? {
        let rule = medians(lights);
        if lights.apart {
            sweep.fits(&rule, false)?;
        }
        sweep.cover(&rule)?;
        return Ok((rule, None, Stop::NoDispersion));
    }
    let Some(tolerance) = tolerance(lights) else {
        let rule = self::rule(lights, 1, false);
        sweep.fits(&rule, compares(lights))?;
        sweep.cover(&rule)?;
        if !any(lights, |sampling| matches!(sampling, Sampling::Samples(_))) {
            return Ok((rule, None, Stop::Lines));
        }
        let coarse = compares(lights).then(|| self::rule(lights, 1, true));
        if let Some(coarse) = &coarse {
            sweep.cover(coarse)?;
        }
        return Ok((rule, coarse, Stop::Samples));
    };
    sweep.fits(&least(lights), true)?;
    for pair in COUNTS.windows(2) {
        let [coarse, rule] = [pair[0], pair[1]].map(|n| self::rule(lights, n, false));
        sweep.cover(&rule)?;
        sweep.cover(&coarse)?;
        let (design, context) = (sweep.design, sweep.context);
        let (worst, stop) = {
            let observation = sweep.compared(&rule);
            let figures = observation.figures(design);
            let changes = observation.changes(&sweep.compared(&coarse), design);
            verdict(&figures, &changes, tolerance)
        };
        context.console.say(&format!(
            "{} {}: {}, figures changed by up to {worst:.2e}",
            design.name,
            sweep.model.key(design),
            count(rule.len(), "wavelength")
        ));
        let larger = COUNTS.iter().find(|&&n| n > pair[1]);
        let possible =
            larger.is_some_and(|&n| sweep.fits(&self::rule(lights, n, false), true).is_ok());
        if stop.is_none() && !possible {
            context.console.warn(&format!(
                "{}: {} = {tolerance} was not reached: with {} instead of {} figures change by up to {worst:.2e}",
                design.name,
                if lights.apart { "tolerance" } else { "light.spectrum.tolerance" },
                count(rule.len(), "wavelength"),
                coarse.len()
            ));
        }
        if let Some(stop) = stop.or((!possible).then_some(Stop::Limit)) {
            return Ok((rule, Some(coarse), stop));
        }
        sweep.forget(&rule);
    }
    unreachable!("the last of the rules ends the loop")
}

/// The largest change of a decisive figure, and whether it ends the search.
fn verdict(
    figures: &[Figure],
    changes: &[(&'static str, Estimate)],
    tolerance: f64,
) -> (f64, Option<Stop>) {
    let decisive =
        |key: &str| DECISIVE.contains(&key) && figures.iter().any(|f| f.key == key && !f.on_axis);
    let (mut worst, mut within, mut unseen) = (0.0f64, true, true);
    for (key, change) in changes.iter().filter(|(key, _)| decisive(key)) {
        let scale = if key.ends_with("_deg") { DEGREES } else { 1.0 };
        let size = change.value.abs() / scale;
        worst = worst.max(size);
        within &= size <= tolerance;
        unseen &= size <= tolerance.max(UNSEEN * change.standard_error / scale);
    }
    let stop = match (within, unseen) {
        (true, _) => Some(Stop::Tolerance),
        (false, true) => Some(Stop::Statistics),
        (false, false) => None,
    };
    (worst, stop)
}

#[cfg(test)]
mod tests;
