// SPDX-License-Identifier: MIT OR Apache-2.0
//! BIPOP: restarts of CMA-ES with large and with small populations, by turns.
//!
//! \[Hansen 2009\] N. Hansen, *Benchmarking a BI-population CMA-ES on the BBOB-2009 function
//! testbed*, GECCO 2009 companion, 2389-2396.

use super::cma_es::{CmaEs, Settings};
use super::normal::Normal;
use super::{BUDGET_SPENT, Evaluated, Minimiser, Point};

/// Largest number of doublings of the population.
const MAX_DOUBLINGS: u32 = 9;

/// Account of the budget of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Regime {
    /// Population doubled with each restart, step size of the settings.
    Large,
    /// Population and step size drawn; the first run too, as in pycma.
    Small,
}

/// State of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Evaluations of this run.
    pub evaluations: usize,
    /// Smallest value, or infinity where no candidate was feasible.
    pub best_value: f64,
    /// Candidate of that value; the favourite where none was feasible.
    pub best_point: Point,
    /// Mean of the last distribution.
    pub favourite: Point,
    /// Candidates of a generation.
    pub population: usize,
    /// Reason of its end, or that it goes on.
    pub why: &'static str,
}

/// Runs of CMA-ES until a budget is spent.
#[derive(Debug, Clone)]
pub struct Bipop {
    settings: Settings,
    random: Normal,
    run: CmaEs,
    regime: Regime,
    doublings: u32,
    /// Evaluations of finished runs in each regime.
    large: usize,
    small: usize,
    /// Evaluations of the last run with a large population.
    last_large: usize,
    runs: Vec<Run>,
    best: Option<Evaluated>,
    ended: Option<&'static str>,
}

impl Bipop {
    /// The first run starts as `settings` say, later ones at uniform points of the box;
    /// `max_evaluations` is the budget of all together.
    ///
    /// # Panics
    ///
    /// Those of [`CmaEs::new`].
    pub fn new(settings: Settings) -> Self {
        let mut random = Normal::new(settings.seed);
        let run = CmaEs::new(Settings { seed: random.seed(), ..settings.clone() });
        let ended = run.ended();
        Self {
            settings,
            random,
            run,
            regime: Regime::Small,
            doublings: 0,
            large: 0,
            small: 0,
            last_large: 0,
            runs: Vec::new(),
            best: None,
            ended,
        }
    }

    /// Runs that have ended, and what the run under way has found so far.
    pub fn runs(&self) -> Vec<Run> {
        let mut runs = self.runs.clone();
        if self.run.evaluations() > 0 {
            runs.push(self.state("it goes on"));
        }
        runs
    }

    fn left(&self) -> usize {
        (self.settings.max_evaluations).saturating_sub(self.large + self.small)
    }

    /// Files the run that has ended.
    fn finish(&mut self, why: &'static str) {
        let evaluations = self.run.evaluations();
        match self.regime {
            Regime::Large => {
                self.large += evaluations;
                self.last_large = evaluations;
            }
            Regime::Small => self.small += evaluations,
        }
        let state = self.state(why);
        self.runs.push(state);
    }

    /// State of the run under way.
    fn state(&self, why: &'static str) -> Run {
        let run = &self.run;
        let favourite = run.favourite();
        let best = run.best();
        Run {
            evaluations: run.evaluations(),
            best_value: best.map_or(f64::INFINITY, |b| b.value),
            best_point: best.map_or_else(|| favourite.clone(), |b| b.point.clone()),
            favourite,
            population: run.population(),
            why,
        }
    }

    /// Begins a run in the regime that has spent less.
    fn restart(&mut self) {
        let start = self.random.point(self.settings.start.len());
        let seed = self.random.seed();
        let mut settings =
            Settings { start, seed, max_evaluations: self.left(), ..self.settings.clone() };
        if self.small < self.large {
            self.regime = Regime::Small;
            let ratio = 2f64.powi(self.doublings as i32) / 2.0;
            let exponent = self.random.uniform().powi(2);
            let population = (self.settings.population as f64 * ratio.powf(exponent)).floor();
            settings.population = (population as usize).max(2);
            settings.sigma *= 10f64.powf(-2.0 * self.random.uniform());
            let max = (self.last_large / 2).max(settings.population);
            settings.max_evaluations = max.min(settings.max_evaluations);
        } else {
            self.regime = Regime::Large;
            self.doublings = (self.doublings + 1).min(MAX_DOUBLINGS);
            settings.population <<= self.doublings;
        }
        self.run = CmaEs::new(settings);
        // Its first generation no longer fits.
        self.ended = self.run.ended().map(|_| BUDGET_SPENT);
    }
}

impl Minimiser for Bipop {
    fn ask(&mut self) -> Vec<Point> {
        self.run.ask()
    }

    fn tell(&mut self, values: &[f64]) {
        self.run.tell(values);
        let bar = self.best.as_ref().map_or(f64::INFINITY, |b| b.value);
        if let Some(best) = self.run.best().filter(|b| b.value < bar) {
            self.best = Some(best.clone());
        }
        if let Some(why) = self.run.ended() {
            self.finish(why);
            self.restart();
        }
    }

    /// Favourite of the run that has told the smallest value.
    fn favourite(&self) -> Point {
        let finished = self.runs.iter().min_by(|a, b| a.best_value.total_cmp(&b.best_value));
        let current = self.run.best().map_or(f64::INFINITY, |b| b.value);
        match finished {
            Some(run) if run.best_value <= current => run.favourite.clone(),
            _ => self.run.favourite(),
        }
    }

    fn best(&self) -> Option<&Evaluated> {
        self.best.as_ref()
    }

    fn found(&self) -> Vec<(Point, Option<Evaluated>)> {
        let found = |run: Run| {
            (run.favourite, Some(Evaluated { point: run.best_point, value: run.best_value }))
        };
        self.runs().into_iter().map(found).collect()
    }

    fn evaluations(&self) -> usize {
        self.large + self.small + self.run.evaluations()
    }

    fn ended(&self) -> Option<&'static str> {
        self.ended
    }

    fn reuses_population(&self) -> bool {
        self.run.reuses_population()
    }
}
