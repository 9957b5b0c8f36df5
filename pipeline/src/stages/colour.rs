// SPDX-License-Identifier: MIT OR Apache-2.0
//! One model of a design in the light of a spectrum: tables and traces at a few wavelengths, put together by weight.
//!
//! The spectrum gives nested rules of 1, 3, 7, ... wavelengths ([`crate::spectrum`]). Every wavelength has its own tables, index and
//! absorption of the silicone and paths, in the proportion of its weight; far field, map and ledger are added up group by group, so that
//! the jackknife over groups gives the statistical error of what is added. Wavelengths are added until the figures change by no more than
//! the tolerance from one rule to the next, or by no more than that change's own statistical error allows to see. Where nothing depends on
//! the wavelength (rays, silicone without dispersion) one trace serves all.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::{Map, Value, json};

use super::model::Model;
use super::observation::{Observation, plane_grid, sphere};
use super::output;
use super::scene::Skin;
use super::tables::tables;
use super::trace::{Environment, GROUPS, ingredients, mix, observe, skin};
use super::units::Units;
use super::until::{Batches, Until};
use crate::cache::Cache;
use crate::config::resolved::{Design, PATHS};
use crate::metrics::Estimate;
use crate::report::atomic::write_bytes;
use crate::report::data::{Curve, Heading, Quantity, Unit};
use crate::report::plots::{FarField, LineColours, far_field_cartesian};
use crate::report::table;
use crate::results::{Figure, ModelResult};
use crate::spectrum::quadrature::COUNTS;
use crate::spectrum::{Sampling, Spectrum};

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
/// What all observations together may take, bytes.
const MOST_MEMORY: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;

/// Most wavelengths in a picture.
const MOST_CURVES: usize = 8;

/// Wavelengths (nm) and weights, ascending.
type Rule = Vec<(f64, f64)>;

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

/// Traces `model` of `design` in the light of `spectrum`, writes its files and returns its figures. Tables come from `cache` or go there. With `until`, the
/// wavelengths are those that the first batch of paths asks for, and batches of all of them follow until a figure is known.
///
/// # Errors
/// Those of the solver, the tracer and the files; too many bins for the memory; an interrupt.
pub fn model(
    design: &Design,
    spectrum: &Spectrum,
    model: Model,
    until: Option<&Until>,
    cache: Option<&Cache>,
    out: &Path,
    env: Environment,
) -> Result<ModelResult> {
    let mut sweep = Sweep::new(design, model, cache, env);
    let (rule, coarse, stop) = sweep.refine(spectrum)?;
    let until = until.map(|until| sweep.go_on(&rule, until)).transpose()?;
    let observation = sweep.combined(&rule);
    let mut result = output::result(design, model, &observation);
    result.until_error = until;
    let changes = coarse.as_ref().map(|coarse| {
        let coarse = sweep.combined(coarse);
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
    let units = Units::of(spectrum);
    let mut description = json!({
        "light": spectrum,
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
    result.spectrum = Some(description);

    let folder = output::folder(design, model);
    let written = output::files(
        design,
        &mut result,
        &observation,
        units,
        &out.join(&folder),
        env,
    )?;
    result.files = written.into_iter().map(|file| folder.join(file)).collect();
    if stop != Stop::NoDispersion {
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

/// What the receivers see of `model` of `design` in the light of `spectrum`, all wavelengths together; nothing is written.
///
/// # Errors
/// Those of [`model`], but for files.
pub fn seen(
    design: &Design,
    spectrum: &Spectrum,
    model: Model,
    cache: Option<&Cache>,
    env: Environment,
) -> Result<Observation> {
    let mut sweep = Sweep::new(design, model, cache, env);
    let (rule, ..) = sweep.refine(spectrum)?;
    Ok(sweep.combined(&rule))
}

/// One wavelength.
struct Traced {
    design: Design,
    observation: Observation,
    tables: Vec<Value>,
    skin: Skin,
    /// Paths asked for.
    paths: u64,
}

/// The wavelengths computed so far.
struct Sweep<'a> {
    design: &'a Design,
    model: Model,
    cache: Option<&'a Cache>,
    env: Environment<'a>,
    /// By the bits of the wavelength in nm, which order positive numbers as the numbers themselves.
    seen: BTreeMap<u64, Traced>,
}

impl<'a> Sweep<'a> {
    /// Without any wavelength yet.
    fn new(
        design: &'a Design,
        model: Model,
        cache: Option<&'a Cache>,
        env: Environment<'a>,
    ) -> Self {
        Self {
            design,
            model,
            cache,
            env,
            seen: BTreeMap::new(),
        }
    }

    /// Computes as many wavelengths as it takes: the rule, the one to compare it with, and why it is no larger.
    fn refine(&mut self, spectrum: &Spectrum) -> Result<(Rule, Option<Rule>, Stop)> {
        if !self.disperses(spectrum)? {
            let rule = vec![(spectrum.median_nm(), 1.0)];
            self.cover(&rule)?;
            return Ok((rule, None, Stop::NoDispersion));
        }
        let Some(sampling) = spectrum.sampling else {
            let rule = spectrum.rule(1);
            self.fits(rule.len())?;
            self.cover(&rule)?;
            return Ok((rule, None, Stop::Lines));
        };
        let tolerance = match sampling {
            Sampling::Samples(count) => {
                self.fits(count)?;
                let rule = spectrum.rule(count);
                self.cover(&rule)?;
                let before = COUNTS.iter().rfind(|&&n| n < count);
                return Ok((rule, before.map(|&n| spectrum.rule(n)), Stop::Samples));
            }
            Sampling::Tolerance(tolerance) => tolerance,
        };
        self.fits(COUNTS[1])?;
        for pair in COUNTS.windows(2) {
            let [coarse, rule] = [pair[0], pair[1]].map(|n| spectrum.rule(n));
            self.cover(&rule)?;
            let observation = self.combined(&rule);
            let figures = observation.figures(self.design);
            let changes = observation.changes(&self.combined(&coarse), self.design);
            let (worst, stop) = verdict(&figures, &changes, tolerance);
            self.env.console.say(&format!(
                "{} {}: {} wavelengths, figures changed by up to {worst:.2e}",
                self.design.name,
                self.model.key(self.design),
                rule.len()
            ));
            let larger = COUNTS.iter().find(|&&n| n > pair[1]);
            let possible = larger.is_some_and(|&n| self.fits(n).is_ok());
            if stop.is_none() && !possible {
                self.env.console.warn(&format!(
                    "{}: light.spectrum.tolerance = {tolerance} was not reached: with {} wavelengths instead of {} figures change by up to {worst:.2e}",
                    self.design.name,
                    pair[1],
                    pair[0]
                ));
            }
            if let Some(stop) = stop.or((!possible).then_some(Stop::Limit)) {
                return Ok((rule, Some(coarse), stop));
            }
        }
        unreachable!("the last of the rules ends the loop")
    }

    /// Whether anything depends on the wavelength: tables of orders always, rays if the silicone differs between wavelengths that may be
    /// asked for.
    fn disperses(&self, spectrum: &Spectrum) -> Result<bool> {
        if self.model == Model::Hybrid || self.design.films.is_some() {
            return Ok(true);
        }
        for (nm, _) in spectrum.rule(COUNTS[COUNTS.len() - 1]) {
            let (here, silicone) = (&self.design.silicone, self.design.at(nm)?.silicone);
            if (silicone.index, silicone.absorption_per_mm) != (here.index, here.absorption_per_mm)
            {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Refuses more wavelengths than there is memory for.
    fn fits(&self, count: usize) -> Result<()> {
        let (grid, sphere) = (plane_grid(self.design), sphere(self.design));
        let others = self.design.receivers.iter().map(|r| r.detector.bins());
        let bins =
            grid.columns * grid.rows + sphere.polar * sphere.azimuths + others.sum::<usize>();
        // The sum and what it is compared with stand beside them.
        let bytes = 8.0 * (bins * GROUPS * (count + 2)) as f64;
        ensure!(
            bytes <= MOST_MEMORY,
            "{}: {bins} bins at {count} wavelengths: expected at most 2 GiB for them, got {:.1} GiB; larger bins or fewer wavelengths take less",
            self.design.provenance.file,
            bytes / MOST_MEMORY * 2.0
        );
        Ok(())
    }

    /// Computes the wavelengths of `rule` that are missing.
    fn cover(&mut self, rule: &Rule) -> Result<()> {
        for &(nm, weight) in rule {
            if self.seen.contains_key(&nm.to_bits()) {
                continue;
            }
            self.env.interrupt.check()?;
            let traced = self
                .trace(nm, weight, rule.len() == 1)
                .with_context(|| format!("{} at {nm} nm", self.design.name))?;
            self.seen.insert(nm.to_bits(), traced);
        }
        Ok(())
    }

    fn trace(&self, nm: f64, weight: f64, alone: bool) -> Result<Traced> {
        let design = self.design.at(nm)?;
        let tables = match self.model {
            Model::Hybrid => Some(tables(&[&design], self.cache, None, self.env)?.remove(0)),
            _ => None,
        };
        let paths = (weight * design.trace.paths as f64).ceil() as u64;
        let paths = paths.clamp(*PATHS.start(), design.trace.paths);
        let skin = skin(&design, self.model, tables.as_ref())?;
        let observation = self.observe((&design, &skin), paths, nm, alone, self.env)?;
        Ok(Traced {
            observation,
            tables: tables.map_or_else(Vec::new, |t| t.describe()),
            skin,
            paths,
            design,
        })
    }

    /// Traces one wavelength, with random numbers of its own unless there is no other.
    fn observe(
        &self,
        (design, skin): (&Design, &Skin),
        paths: u64,
        nm: f64,
        alone: bool,
        env: Environment,
    ) -> Result<Observation> {
        let seed = if alone { env.seed } else { seed(env.seed, nm) };
        let what = format!("{} {} {nm:.0} nm", design.name, self.model.key(design));
        observe(design, skin, paths, &what, Environment { seed, ..env })
    }

    /// Traces further batches at the wavelengths of `rule`, which are all that there are, until a figure is known; what was seen is then the mean of all
    /// batches. Returns what `results.json` says.
    fn go_on(&mut self, rule: &Rule, until: &Until) -> Result<Value> {
        let first = rule.iter().map(|&(nm, _)| self.at(nm).observation.clone());
        let first: Vec<Observation> = first.collect();
        let what = format!("{} {}", self.design.name, self.model.key(self.design));
        let wavelengths: Vec<Value> = rule
            .iter()
            .map(|&(nm, weight)| {
                let traced = self.at(nm);
                let by = (traced.paths, self.env.seed);
                let of = ingredients((&traced.design, &traced.skin), &what, by)?;
                Ok(json!({"nm": nm, "weight": weight, "trace": of}))
            })
            .collect::<Result<_>>()?;
        let sweep = &*self;
        let batches = Batches {
            design: sweep.design,
            until,
            what: &what,
            env: sweep.env,
            ingredients: wavelengths.into(),
            count: rule.len(),
            mean: |means: &[Observation]| {
                let weights = rule.iter().map(|(_, weight)| *weight);
                Observation::weighted(&weights.zip(means).collect::<Vec<_>>())
            },
            trace: |env| {
                let each = rule.iter().map(|&(nm, _)| {
                    let Traced {
                        design,
                        skin,
                        paths,
                        ..
                    } = sweep.at(nm);
                    sweep.observe((design, skin), *paths, nm, rule.len() == 1, env)
                });
                each.collect()
            },
        };
        let (means, said) = batches.run(Some(first))?;
        for (&(nm, _), mean) in rule.iter().zip(means) {
            if let Some(traced) = self.seen.get_mut(&nm.to_bits()) {
                traced.observation = mean;
            }
        }
        Ok(said)
    }

    /// The wavelength that was computed before.
    fn at(&self, nm: f64) -> &Traced {
        &self.seen[&nm.to_bits()]
    }

    fn combined(&self, rule: &Rule) -> Observation {
        let parts: Vec<(f64, &Observation)> = rule
            .iter()
            .map(|&(nm, weight)| (weight, &self.at(nm).observation))
            .collect();
        Observation::weighted(&parts)
    }

    /// What `results.json` says of every wavelength.
    fn describe(&self, rule: &Rule) -> Vec<Value> {
        let one = |&(nm, weight): &(f64, f64)| {
            let traced = self.at(nm);
            let mut entry = Map::from_iter([
                ("wavelength_nm".to_owned(), json!(nm)),
                ("weight".to_owned(), json!(weight)),
                ("paths".to_owned(), traced.observation.paths.into()),
                (
                    "silicone_index".to_owned(),
                    traced.design.silicone.index.into(),
                ),
                (
                    "silicone_absorption_per_mm".to_owned(),
                    traced.design.silicone.absorption_per_mm.into(),
                ),
            ]);
            for figure in traced.observation.figures(self.design) {
                let mut value = json!(figure.estimate);
                if figure.on_axis {
                    value["on_axis"] = true.into();
                }
                entry.insert(figure.key.to_owned(), value);
            }
            if !traced.tables.is_empty() {
                entry.insert("tables".to_owned(), traced.tables.clone().into());
            }
            Value::Object(entry)
        };
        rule.iter().map(one).collect()
    }

    /// Azimuthal means at every wavelength and of all together, each per flux that the sources emit there: as a table and a picture.
    fn far_fields(
        &self,
        rule: &Rule,
        sum: &Observation,
        heading: &Heading,
        folder: &Path,
    ) -> Result<()> {
        let mut curves: Vec<Curve> = rule
            .iter()
            .map(|&(nm, _)| {
                output::azimuthal_mean(&self.at(nm).observation, &format!("{nm:.1} nm"))
            })
            .collect::<Result<_>>()?;
        curves.push(output::azimuthal_mean(sum, "all wavelengths")?);
        let quantity = Quantity::new("intensity per emitted flux", Unit::PerSteradian);
        let theta = Quantity::new("theta", Unit::Degree);
        table::write_curves_csv(&folder.join(BY_WAVELENGTH[0]), &theta, &quantity, &curves)?;
        // A picture of many wavelengths shows every second, fourth ... of them, so that their curves and names can be told apart.
        let last = curves.len() - 1;
        let step = last.div_ceil(MOST_CURVES).next_power_of_two();
        let chosen = (step / 2..last).step_by(step).chain([last]);
        let shown: Vec<Curve> = chosen
            .map(|i| curves[i].mirrored())
            .collect::<Result<_>>()?;
        let picture = FarField {
            heading,
            quantity: &quantity,
            curves: &shown,
            colours: LineColours::OrderedAndSum,
        };
        write_bytes(
            &folder.join(BY_WAVELENGTH[1]),
            &far_field_cartesian(&picture)?,
        )
    }
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

/// The seed of a wavelength's paths: those of neighbours have nothing in common, so that their errors average out, and the order in which
/// wavelengths are computed does not matter.
fn seed(seed: u64, nm: f64) -> u64 {
    mix(mix(seed) ^ nm.to_bits())
}

#[cfg(test)]
mod tests;
