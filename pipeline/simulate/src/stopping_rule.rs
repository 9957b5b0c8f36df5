// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tracing until a figure is known well enough.
//!
//! Batches of as many paths as the design asks for are traced, each with random numbers of its own,
//! and added up group by group, until the standard error of one figure of merit is as small as wanted
//! (of a sum that no path has reached, its bound) or the paths allowed are used up. The first batch
//! is the run without any of this, to the last bit. The decision looks at the error and not at the
//! value, so that the value stays unbiased but for what error and value have in common. The sum is
//! kept from time to time, so that an interrupted run goes on to the same bits.

use std::borrow::Cow;
use std::str::FromStr;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use design::Design;
use design::resolved::check_paths;
use metrics::digits::significant;
use metrics::far_field::PeakPlace;
use metrics::figures::{self, Source};
use metrics::plural::count;
use metrics::quantity::Unit;
use results::figure_entry::FigureEntry;
use results::schema::UntilError;
use runtime::key::Key;
use runtime::progress::warn_once;
use runtime::run_context::RunContext;
use runtime::store::{MIN_PATHS, Store};

use super::observation::{Observation, check_figure};
use super::scenes::{channels, counted, put_together};
use super::seeds;
use super::snapshot::{from_bytes, to_bytes};
use super::trace::{GROUPS, TraceJob};

/// Batches after which a figure without any light, or one that does not vary, is given up.
const STILL_BATCHES: u32 = 8;
/// Errors below this part of a value are rounding.
const ROUNDING: f64 = 1e-14;

/// A figure of merit and the standard error that it may keep.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorTarget {
    /// Key of the figure in the registry, with the name of a receiver or of an account in it.
    pub figure: String,
    /// Largest standard error, in the unit of the figure whatever its value: a fraction of 1 (of
    /// flux, of what all sources emit), degrees of an angle. Of a relative one a share of the value.
    pub error: f64,
    /// True of an error that is a share of the value.
    pub is_relative: bool,
}

impl FromStr for ErrorTarget {
    type Err = String;

    /// `uniformity=0.1%`, `uniformity=0.001` or `peak_angle_deg=0.2`; of the value
    /// `illuminance_peak=1%` or, of figures in per cent too, `uniformity=1%rel`.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            let keys = figures::keys_of(|figure| !figure.source.is_of_colours());
            format!("expected FIGURE=ERROR, such as uniformity=0.1%, with one of {keys}")
        };
        let (text, warnings) = figures::with_names_of_today(text);
        for warning in &warnings {
            warn_once(warning);
        }
        let (figure, error) = text.split_once('=').ok_or_else(expected)?;
        let unit = figures::find(figure).ok_or_else(expected)?.unit;
        let is_share = unit.is_percentage() || unit == Unit::Relative;
        let (number, is_relative) = match error.strip_suffix("%rel") {
            Some(number) => (Some(number), true),
            None => (error.strip_suffix('%'), !is_share),
        };
        let (number, unit, is_relative) = match number {
            Some(number) => (number, 0.01, is_relative),
            None => (error, 1.0, false),
        };
        let error = number.trim().parse().ok().map(|e: f64| e * unit);
        let error = error.filter(|e| *e > 0.0 && e.is_finite());
        Ok(Self {
            figure: figure.to_owned(),
            error: error.ok_or_else(|| format!("expected an error above 0, got {number:?}"))?,
            is_relative,
        })
    }
}

/// When to stop.
#[derive(Debug, Clone, PartialEq)]
pub struct StoppingRule {
    /// The figure and its error.
    pub target: ErrorTarget,
    /// Paths after which no further batch begins.
    pub most_paths: u64,
}

impl StoppingRule {
    /// Paths of the first batch, and of each after it, of a design that asks for `stated`: no more
    /// than there may be of all, in whole paths of every group.
    ///
    /// # Errors
    /// A number of paths that no run may have.
    pub fn batch(&self, stated: u64) -> Result<u64> {
        let most = self.most_paths;
        check_paths("--most-paths", most)?;
        let groups = GROUPS as u64;
        Ok(if most < stated.next_multiple_of(groups) { most / groups * groups } else { stated })
    }
}

impl ErrorTarget {
    /// The error that a figure of this value may keep.
    fn allowed(&self, value: f64) -> f64 {
        if self.is_relative { self.error * value.abs() } else { self.error }
    }

    /// The error in words.
    fn words(&self) -> String {
        if self.is_relative {
            format!("{} % of its value", significant(100.0 * self.error))
        } else {
            format!("{:.2e}", self.error)
        }
    }

    /// Refuses a figure that the design does not have, and one of all wavelengths together.
    ///
    /// # Errors
    /// Those of [`check_figure`].
    pub fn check(&self, design: &Design) -> Result<()> {
        let figure = self.figure.as_str();
        let at = || format!("--until-error: {}", design.provenance.file);
        ensure!(
            !figures::find(figure).is_some_and(|known| known.source.is_of_colours()),
            "{}: expected a figure of the batches of paths, got {figure}, which needs all wavelengths",
            at()
        );
        check_figure(design, figure).with_context(at).map(drop)
    }

    /// The figure of what was seen, if the design has it.
    fn of(&self, seen: &Observation, design: &Design) -> Option<FigureEntry> {
        let found = seen.estimates(design, |key| key == self.figure).pop()?;
        Some(found.entry)
    }
}

/// Makes the observation of all light of those of a batch.
type Whole<'a> = Box<dyn for<'o> Fn(&'o [Observation]) -> Cow<'o, Observation> + 'a>;

/// A trace that is done batch by batch; a batch is one observation or, in the light of many
/// wavelengths, several.
pub(super) struct Batches<'a, T> {
    pub design: &'a Design,
    pub rule: &'a StoppingRule,
    /// Shown beside warnings.
    pub what: &'a str,
    pub context: RunContext<'a>,
    /// All that a batch depends on.
    pub key_fields: Value,
    /// Number of observations of a batch.
    pub count: usize,
    /// The observation of all light that those of a batch make.
    pub whole: Whole<'a>,
    /// Traces a batch.
    pub trace: T,
}

impl<'a, T> Batches<'a, T>
where
    T: FnMut(RunContext<'a>) -> Result<Vec<Observation>>,
{
    /// Traces until the figure is known; `first` is the first batch, if it is traced. Returns the
    /// means over all batches and what `results.json` says.
    pub fn run(
        mut self,
        first: Option<Vec<Observation>>,
    ) -> Result<(Vec<Observation>, UntilError)> {
        let ErrorTarget { figure, error, is_relative } = &self.rule.target;
        let checkpoints = self.context.checkpoints;
        let groups = checkpoints.map(|kept| {
            let until =
                json!({"figure": figure, "error": error, "is_relative": is_relative, "most_paths": self.rule.most_paths});
            kept.entries(Key::of(&json!({"until": until, "batch": self.key_fields})))
        });
        let snapshot = checkpoints.map(Store::snapshot);
        let found = groups.as_ref().and_then(|groups| groups.find(0));
        let found = found.and_then(|bytes| from_bytes(&bytes, self.design, self.count));
        let (mut batches, mut sums) = match (found, first) {
            (Some(found), _) => found,
            (None, Some(first)) => (1, first),
            (None, None) => (1, (self.trace)(self.context)?),
        };
        let mut kept_paths = 0;
        loop {
            let share = 1.0 / f64::from(batches);
            let means: Vec<Observation> = sums.iter().map(|sum| sum.scaled(share)).collect();
            let mean = (self.whole)(&means);
            let Some(estimate) = self.rule.target.of(&mean, self.design) else {
                let is_of_map =
                    figures::find(figure).is_some_and(|known| known.source == Source::Map);
                let why = mean.without_uniformity(self.design).filter(|_| is_of_map);
                let why = why.unwrap_or_else(|| mean.why_absent(self.design, figure));
                anyhow::bail!(
                    "--until-error: {}: expected a figure that the design has, got {figure}: {why}",
                    self.design.provenance.file
                )
            };
            let left = match estimate.peak_place {
                // An angle that is noise tells nothing by its error.
                PeakPlace::NotResolved => f64::INFINITY,
                PeakPlace::OffAxis | PeakPlace::OnAxis => estimate.error_left(figure),
            };
            let left = if left <= ROUNDING * estimate.value.abs() { 0.0 } else { left };
            // A sum that no path can reach is 0. Another figure at the end of its range, such as a
            // uniformity of 0, does not vary and says nothing of how well it is known.
            let is_sum = figures::find(figure).is_some_and(|known| known.is_sum());
            let is_nothing = is_sum && estimate.value == 0.0 && left <= 0.0;
            let allowed = self.rule.target.allowed(estimate.value);
            let reached = is_nothing || left > 0.0 && left <= allowed;
            let is_still = left <= 0.0 && batches >= STILL_BATCHES;
            let paths = mean.paths;
            drop(mean);
            let bound = estimate.bound_of_sum(figure);
            if let Some(bound) = bound.filter(|_| batches == 1) {
                self.context.console.warn(&self.dark(bound, paths));
            }
            // The bound falls as one over the paths.
            let is_out_of_reach = bound.is_some_and(|bound| {
                !is_relative && paths as f64 * bound > *error * self.rule.most_paths as f64
            });
            let of_batch = paths / u64::from(batches);
            if reached
                || is_still
                || is_out_of_reach
                || paths.saturating_add(of_batch) > self.rule.most_paths
            {
                if !reached {
                    let why = if is_still {
                        "further batches would not change that"
                    } else if is_out_of_reach {
                        "with --most-paths its bound cannot fall so far"
                    } else {
                        "--most-paths allows no further batch"
                    };
                    self.context.console.warn(&self.unmet(left, paths, why));
                }
                let said = UntilError {
                    figure: figure.clone(),
                    error: *error,
                    is_relative: *is_relative,
                    reached,
                    batches,
                };
                return Ok((means, said));
            }
            // What follows takes the memory that they have had.
            drop(means);
            if let (Some(groups), Some(snapshot)) = (&groups, &snapshot)
                && paths >= kept_paths + MIN_PATHS
            {
                groups.keep(0, &to_bytes(batches, &sums));
                kept_paths = paths;
                // What is in the sum needs no groups of its own.
                if let Some(kept) = checkpoints {
                    kept.discard_newer(snapshot);
                }
            }
            let seed = seeds::of_batch(self.context.seed, batches);
            let more = (self.trace)(RunContext { seed, ..self.context })?;
            for (sum, more) in sums.iter_mut().zip(&more) {
                sum.add(more);
            }
            batches += 1;
        }
    }

    /// Says that the figure is known to `left` after so many paths, and why no more follow.
    fn unmet(&self, left: f64, paths: u64, why: &str) -> String {
        let figure = &self.rule.target.figure;
        let known = if left.is_infinite() {
            "not resolved".to_owned()
        } else if left > 0.0 {
            format!("known to {left:.2e}")
        } else {
            "at the end of its range, where it does not vary,".to_owned()
        };
        let paths = count(paths, "path");
        let wanted = self.rule.target.words();
        format!("{}: {figure} is {known} after {paths}, not to {wanted}; {why}", self.what)
    }

    /// Says that no path has reached the figure.
    fn dark(&self, bound: f64, paths: u64) -> String {
        let (figure, wanted) = (&self.rule.target.figure, self.rule.target.words());
        let file = &self.design.provenance.file;
        format!(
            "--until-error: {file}: {figure}: none of {} has arrived, so it lies below {bound:.1e} (95 % confidence), asked {wanted}; if light is expected there, check where it lies and which way it faces",
            count(paths, "path")
        )
    }
}

/// Traces batches of `job` until `rule` is met; returns the mean over the batches and what
/// `results.json` says of them.
///
/// # Errors
/// A figure that this design does not have, and those of a trace.
pub(super) fn observe_until(
    job: &TraceJob,
    rule: &StoppingRule,
    context: RunContext,
) -> Result<(Observation, UntilError)> {
    let batches = Batches {
        design: job.design,
        rule,
        what: job.what,
        context,
        key_fields: job.key_fields(context.seed),
        count: channels(job.design),
        whole: Box::new(|channels| counted(job.design, channels)),
        trace: |context| job.observe_channels(context),
    };
    let (means, said) = batches.run(None)?;
    Ok((put_together(job.design, means), said))
}

#[cfg(test)]
mod tests {
    use super::*;

    use design::schema::Pitch;
    use runtime::interrupt::Interrupt;

    use crate::dome_surface::dome_surface;
    use crate::model::Model;
    use crate::scene::DomeSurface;
    use crate::trace::observe;

    #[test]
    fn targets_are_read_with_their_units() {
        let of = |text: &str| text.parse::<ErrorTarget>();
        assert!((of("uniformity=0.1%").expect("valid").error - 1e-3).abs() < 1e-18);
        assert!((of("peak_angle_deg=0.2").expect("valid").error - 0.2).abs() < 1e-18);
        // A per cent of what is no percentage is one of the value.
        for (text, value, allowed) in [
            ("uniformity=1%", 0.5, 0.01),
            ("uniformity=1%rel", 0.5, 0.005),
            ("peak_angle_deg=1%", 40.0, 0.4),
            ("flux_up=2%", 150.0, 3.0),
        ] {
            let found = of(text).expect("valid").allowed(value);
            assert!((found - allowed).abs() < 1e-12, "{text}: {found}");
        }
        for bad in [
            "uniformity",
            "brightness=1",
            "uniformity=0",
            "uniformity=-1%",
            "uniformity=nan",
            "uniformity=x",
            "uniformity=0%rel",
        ] {
            assert!(of(bad).is_err(), "{bad}");
        }
    }

    fn job<'a>(design: &'a Design, surface: &'a DomeSurface) -> TraceJob<'a> {
        TraceJob::new(design, surface, "")
    }

    #[test]
    fn batches_are_added_until_the_error_is_small_enough() {
        let mut design = design::embedded("d1.toml").expect("valid");
        design.trace.paths = 20_000;
        let surface = dome_surface(&design, Model::Geometric, None).expect("a dome");
        let interrupt = Interrupt::default();
        let context = RunContext::quiet(&interrupt, 2);
        let run = |error: f64, most_paths: u64| {
            let figure = "extraction_efficiency".to_owned();
            let target = ErrorTarget { figure, error, is_relative: false };
            observe_until(&job(&design, &surface), &StoppingRule { target, most_paths }, context)
                .expect("a trace")
        };
        let error = |o: &Observation| {
            let figures = o.figures(&design);
            let found = figures.iter().find(|f| f.key == "extraction_efficiency");
            found.expect("the figure").entry.standard_error
        };
        // One batch is the run without it.
        let plain = observe(&design, &surface, 20_000, "", context).expect("a trace");
        let (one, said) = run(1.0, 1_000_000);
        assert_eq!((&one.far_field, one.paths), (&plain.far_field, plain.paths));
        assert_eq!((said.batches, said.reached), (1, true));

        let wanted = 0.4 * error(&plain);
        let (many, said) = run(wanted, 10_000_000);
        let batches = u64::from(said.batches);
        assert!(error(&many) <= wanted && batches > 1);
        assert_eq!(many.paths, batches * plain.paths);
        // Errors fall as 1/√n: (1/0.4)² batches, give or take what 64 groups tell of an error.
        assert!((3..=14).contains(&batches), "{batches}");
        let emitted: f64 = many.flows.total()[0];
        assert!((emitted - 1.0).abs() < 1e-12, "{emitted}");

        let (few, said) = run(1e-9, 50_000);
        assert_eq!((said.reached, few.paths), (false, 2 * plain.paths));
    }

    #[test]
    fn a_figure_that_is_clipped_is_not_known() {
        let mut design = design::embedded("d1.toml").expect("valid");
        design.trace.paths = 5000;
        // Packages so far apart that nothing lies between them: the uniformity of all batches is 0.
        design.array.pitch_mm = Pitch::Same(60.0);
        let receiver = &mut design.receiver;
        (receiver.bin_mm, receiver.read_bin_mm, receiver.margin_mm) = (1.0, None, Some(30.0));
        let surface = dome_surface(&design, Model::Geometric, None).expect("a dome");
        let interrupt = Interrupt::default();
        let context = RunContext::quiet(&interrupt, 2);
        let target = "uniformity=1%".parse::<ErrorTarget>().expect("a target");
        let until = StoppingRule { target, most_paths: 16_000 };
        let (seen, said) =
            observe_until(&job(&design, &surface), &until, context).expect("a trace");
        let figures = seen.figures(&design);
        let uniformity = figures.iter().find(|f| f.key == "uniformity");
        let estimate = uniformity.expect("the figure").entry;
        assert_eq!((estimate.value, estimate.standard_error), (0.0, 0.0));
        assert_eq!((said.reached, said.batches), (false, 3));
    }
}
