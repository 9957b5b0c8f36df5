// SPDX-License-Identifier: MIT OR Apache-2.0
//! One model of a design in the light of a spectrum, or of sources that each have their own: tables
//! and traces at a few wavelengths, put together by weight.
//!
//! Every light ([`design::spectrum::lights`]) is traced by itself at each of its wavelengths, all
//! other sources being dark: a path has the wavelength of its trace. Where all sources share one
//! light, it is that of the design. The spectrum gives nested rules of 1, 3, 7, ... wavelengths
//! ([`design::spectrum`]). Every wavelength has its own tables, index and absorption of the silicone
//! and paths, in the proportion of its weight; far field, map and ledger are added up group by
//! group, so that the jackknife over groups gives the statistical error of what is added.
//! Wavelengths are added until the figures change by no more than the tolerance from one rule to
//! the next, or by no more than that change's own statistical error allows to see. Where nothing
//! depends on the wavelength (rays, bare silicone and solids without dispersion) one trace serves
//! all.

mod account;
mod rule;
mod sweep;

use std::borrow::Cow;

use anyhow::{Result, ensure};
use serde_json::json;

use design::spectrum::Sampling;
use design::spectrum::lights::{Colour, Lights};
use design::spectrum::quadrature::COUNTS;
use metrics::Estimate;
use metrics::figures::{self, PEAK_ANGLE, Source};
use metrics::plural::count;
use results::Figure;
use results::schema::{FileUnits, SpectrumEntry, StoppedBy, UntilError};
use runtime::run_context::RunContext;

use self::rule::{Node, Rule, any, compares, medians, smallest_rule, tolerance};
pub use self::sweep::SpectralJob;
use self::sweep::Sweep;
use super::added_errors::AddedErrors;
use super::film_table::{FilmTreatment, treatment};
use super::observation::Observation;
use super::paths_3d::WavelengthScene;
use super::stopping_rule::StoppingRule;
use super::trace_plan::TracePlan;
use super::units::Units;

/// A change within this many of its standard errors is none that could be seen.
const UNSEEN: f64 = 2.0;
/// Degrees that count as much as a fraction of 1.
const DEGREES: f64 = 100.0;
impl<'a> SpectralJob<'a> {
    /// Refuses, before anything is traced, more wavelengths than there are tables or memory for.
    ///
    /// # Errors
    /// Number of wavelengths, and the largest number allowed.
    pub fn check(self) -> Result<()> {
        let sweep = Sweep::new(self);
        if sweep.disperses()? {
            sweep.fits(&smallest_rule(self.lights), compares(self.lights))
        } else if self.lights.apart {
            sweep.fits(&medians(self.lights), false)
        } else {
            Ok(())
        }
    }

    /// The traces at all wavelengths, for several processes to share.
    ///
    /// # Errors
    /// Lights whose wavelengths follow from what has been traced at others; too many wavelengths.
    pub fn plans(self) -> Result<Vec<TracePlan>> {
        self.check()?;
        let sweep = Sweep::new(self);
        if !sweep.disperses()? {
            return sweep.plans(&[medians(self.lights)]);
        }
        ensure!(
            tolerance(self.lights).is_none(),
            "{}: expected stated wavelengths (`samples`, `lines`) for shards, got a `tolerance`, by which they follow from what is traced",
            self.design.provenance.file
        );
        let (rule, coarse) = stated(self.lights);
        let rules: Vec<Rule> = std::iter::once(rule).chain(coarse).collect();
        sweep.plans(&rules)
    }

    /// The traces at the wavelengths of lights weighted by radiant power, each with its share of it:
    /// the stated number of wavelengths, or the largest of lights that are sampled to a tolerance.
    ///
    /// # Errors
    /// Too many wavelengths.
    pub fn shares(self) -> Result<Vec<(TracePlan, f64)>> {
        let sweep = Sweep::new(self);
        let rule = rule::rule(self.lights, COUNTS[COUNTS.len() - 1], false);
        sweep.fits(&rule, false)?;
        rule.iter().map(|node| Ok((sweep.plan(&rule, node)?, node.weight))).collect()
    }

    /// Wavelengths, with the numbers of their lights, at which [`Self::apart`] traces: the stated
    /// ones, three of a light that is sampled to a tolerance, one where nothing depends on them.
    ///
    /// # Errors
    /// A wavelength at which a material has no data.
    pub fn nodes(self) -> Result<Vec<(usize, f64)>> {
        let rule = Sweep::new(self).fixed_rule()?;
        Ok(rule.iter().map(|node| (node.light, node.nm)).collect())
    }

    /// An observation of each light alone at each of its wavelengths, per watt there; paths are
    /// dealt out by power.
    ///
    /// # Errors
    /// Those of [`Self::observe`].
    pub fn apart(self) -> Result<Vec<Observation>> {
        let mut sweep = Sweep::new(self);
        let rule = sweep.fixed_rule()?;
        sweep.fits(&rule, false)?;
        sweep.cover(&rule)?;
        Ok(sweep.into_observations(&rule))
    }

    /// Observation of all wavelengths together.
    ///
    /// # Errors
    /// Errors of the solver and the tracer; too many bins for the memory; too many wavelengths for
    /// tables; an interrupt.
    pub fn observe(self) -> Result<Observation> {
        let mut sweep = Sweep::new(self);
        let (rule, _, stop) = refine(&mut sweep)?;
        let seen = match stop {
            StoppedBy::NoDispersion => sweep.of_whole_light(&rule),
            _ => sweep.combined(&rule, false),
        };
        Ok(seen.into_owned())
    }

    /// Traces at as many wavelengths as the lights ask for. With `stopping_rule` these are the
    /// wavelengths of the first batch of paths, and batches of all of them follow.
    ///
    /// # Errors
    /// Errors of [`Self::observe`].
    pub fn trace(self, stopping_rule: Option<&StoppingRule>) -> Result<SpectralTrace<'a>> {
        let mut sweep = Sweep::new(self);
        let (rule, coarse, stop) = refine(&mut sweep)?;
        let until_error = stopping_rule.map(|until| sweep.go_on(&rule, until));
        Ok(SpectralTrace { until_error: until_error.transpose()?, sweep, rule, coarse, stop })
    }
}

/// Traces at all wavelengths of a rule.
pub struct SpectralTrace<'a> {
    /// Entry of the stopping rule in `results.json`.
    pub until_error: Option<UntilError>,
    sweep: Sweep<'a>,
    rule: Rule,
    /// The rule of fewer wavelengths that the last one is compared with.
    coarse: Option<Rule>,
    stop: StoppedBy,
}

impl SpectralTrace<'_> {
    /// The sum over all wavelengths, with the colours of all bins.
    pub fn observation(&self) -> Cow<'_, Observation> {
        match self.stop {
            // All bins are of one colour, which figures state.
            StoppedBy::NoDispersion if self.rule.len() == 1 => {
                self.sweep.of_whole_light(&self.rule)
            }
            _ => self.sweep.combined(&self.rule, true),
        }
    }

    /// How much all figures, accounts of the ledger and figures of receivers of `observation`, which
    /// is the sum, changed from fewer wavelengths.
    pub fn wavelength_errors(&self, observation: &Observation) -> AddedErrors {
        if self.stop == StoppedBy::NoDispersion {
            return AddedErrors::none();
        }
        match &self.coarse {
            Some(coarse) => {
                let coarse = self.sweep.of_whole_light(coarse);
                AddedErrors::of_wavelengths(observation, &coarse, self.sweep.job.design)
            }
            None => AddedErrors::unknown(),
        }
    }

    /// Errors of all that `observation`, the sum, holds by the cells of the table of films; none where
    /// light is traced film by film. Batches saw other paths, so that the first of them is compared.
    ///
    /// # Errors
    /// Those of the tracer; an interrupt.
    pub fn film_table_errors(
        &self,
        observation: &Observation,
        context: RunContext,
    ) -> Result<Option<AddedErrors>> {
        let design = self.sweep.job.design;
        if !matches!(treatment(design), FilmTreatment::Table(_)) {
            return Ok(None);
        }
        let again = |widened| self.sweep.once_more(&self.rule, widened, context);
        let wide = again(true)?;
        let wide = wide.of_whole_light(&self.rule);
        let errors = |seen: &Observation| AddedErrors::of_film_table(seen, &wide, design);
        Ok(Some(match self.until_error {
            None => errors(observation),
            Some(_) => errors(&again(false)?.of_whole_light(&self.rule)),
        }))
    }

    /// Entry of light and wavelengths in `results.json`.
    pub fn describe(&self) -> serde_json::Result<SpectrumEntry> {
        let (sweep, rule) = (&self.sweep, &self.rule);
        let (design, lights) = (sweep.job.design, sweep.job.lights);
        let units = Units::from_design(design, Some(lights));
        let light = match &lights.lights[0].light {
            Colour::Spectrum(spectrum) if !lights.apart => json!(spectrum),
            _ => json!({"weighting": lights.weighting, "sources": sweep.account(rule)}),
        };
        Ok(SpectrumEntry {
            light: serde_json::from_value(light)?,
            units: FileUnits {
                intensity: units.intensity().unit().symbol().to_owned(),
                map: units.irradiance().unit().symbol().to_owned(),
            },
            emitted: units.emitted(),
            stopped_by: self.stop,
            wavelengths: sweep.describe(rule),
            compared_with: self.coarse.as_ref().map(Vec::len),
            efficiency: lights.apart.then(|| sweep.efficiency(rule)),
            by_channel: sweep.by_channel(rule),
            by_source: design.trace.ledger_by_source.then(|| sweep.by_source(rule)),
        })
    }

    /// Source (where lights have some), wavelength in nm and observation of every node; none where
    /// nothing depends on the wavelength.
    pub fn by_wavelength(&self) -> Vec<(Option<&str>, f64, &Observation)> {
        let nodes = self.rule.iter().filter(|_| self.stop != StoppedBy::NoDispersion);
        let lights = &self.sweep.job.lights.lights;
        let of = |node: &Node| {
            let source = lights[node.light].sources.first();
            (source.map(String::as_str), node.nm, self.sweep.observation(node))
        };
        nodes.map(of).collect()
    }

    /// Share of the flux, design and dome of every node.
    pub(super) fn surfaces(&self) -> Vec<WavelengthScene<'_>> {
        self.rule.iter().map(|node| self.sweep.surface(node)).collect()
    }
}

/// The rule of lights whose numbers of wavelengths are stated, and the one to compare it with.
fn stated(lights: &Lights) -> (Rule, Option<Rule>) {
    let coarse = compares(lights).then(|| rule::rule(lights, 1, true));
    (rule::rule(lights, 1, false), coarse)
}

/// Computes as many wavelengths as it takes: the rule, the one to compare it with, and why it is no
/// larger.
fn refine(sweep: &mut Sweep<'_>) -> Result<(Rule, Option<Rule>, StoppedBy)> {
    let lights = sweep.job.lights;
    if !sweep.disperses()? {
        let rule = medians(lights);
        if lights.apart {
            sweep.fits(&rule, false)?;
        }
        sweep.cover(&rule)?;
        return Ok((rule, None, StoppedBy::NoDispersion));
    }
    let Some(tolerance) = tolerance(lights) else {
        let (rule, coarse) = stated(lights);
        sweep.fits(&rule, compares(lights))?;
        sweep.cover(&rule)?;
        if !any(lights, |sampling| matches!(sampling, Sampling::Samples(_))) {
            return Ok((rule, None, StoppedBy::Lines));
        }
        if let Some(coarse) = &coarse {
            sweep.cover(coarse)?;
        }
        return Ok((rule, coarse, StoppedBy::Samples));
    };
    sweep.fits(&smallest_rule(lights), true)?;
    for pair in COUNTS.windows(2) {
        let [coarse, rule] = [pair[0], pair[1]].map(|n| rule::rule(lights, n, false));
        sweep.cover(&rule)?;
        sweep.cover(&coarse)?;
        let (design, context) = (sweep.job.design, sweep.job.context);
        let (worst, stop) = {
            let observation = sweep.combined(&rule, false);
            let figures = observation.estimates(design, adds_wavelengths);
            let changes =
                observation.changes(&sweep.of_whole_light(&coarse), design, adds_wavelengths);
            verdict(&figures, &changes, tolerance)
        };
        context.console.say(&format!(
            "{} {}: {}, figures changed by up to {worst:.2e}",
            design.name,
            sweep.job.model.key(design),
            count(rule.len(), "wavelength")
        ));
        let larger = COUNTS.iter().find(|&&n| n > pair[1]);
        let possible =
            larger.is_some_and(|&n| sweep.fits(&rule::rule(lights, n, false), true).is_ok());
        if stop.is_none() && !possible {
            context.console.warn(&format!(
                "{}: {} = {tolerance} was not reached: with {} instead of {} figures of {} change by up to {worst:.2e}",
                design.provenance.file,
                if lights.apart { "spectrum.tolerance of [[sources]]" } else { "light.spectrum.tolerance" },
                count(rule.len(), "wavelength"),
                coarse.len(),
                sweep.job.model.key(design)
            ));
        }
        if let Some(stop) = stop.or((!possible).then_some(StoppedBy::Limit)) {
            return Ok((rule, Some(coarse), stop));
        }
        sweep.forget(&rule);
    }
    unreachable!("the last of the rules ends the loop")
}

/// True of a figure whose change decides whether wavelengths are added.
fn adds_wavelengths(key: &str) -> bool {
    figures::find(key).is_some_and(|figure| figure.adds_wavelengths)
}

/// The largest change of a decisive figure, and whether it ends the search.
fn verdict(
    figures: &[Figure],
    changes: &[(Cow<'static, str>, Estimate)],
    tolerance: f64,
) -> (f64, Option<StoppedBy>) {
    // What a change of the figure counts by; none of one that decides nothing.
    let scale = |key: &str| {
        let definition = figures::find(key).filter(|known| known.adds_wavelengths)?;
        let entry = figures.iter().find(|figure| figure.key == key)?.entry;
        match definition.source {
            // An angle of noise decides nothing.
            _ if key == PEAK_ANGLE.key => entry.peak_place.is_off_axis().then_some(DEGREES),
            // A receiver may see little of the light.
            Source::Receiver => (entry.value > 0.0).then_some(entry.value),
            _ => Some(1.0),
        }
    };
    let (mut worst, mut within, mut unseen) = (0.0f64, true, true);
    for (key, change) in changes {
        let Some(scale) = scale(key) else { continue };
        let size = change.value.abs() / scale;
        worst = worst.max(size);
        within &= size <= tolerance;
        unseen &= size <= tolerance.max(UNSEEN * change.standard_error / scale);
    }
    let stop = match (within, unseen) {
        (true, _) => Some(StoppedBy::Tolerance),
        (false, true) => Some(StoppedBy::Statistics),
        (false, false) => None,
    };
    (worst, stop)
}

#[cfg(test)]
mod tests;
