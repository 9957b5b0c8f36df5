// SPDX-License-Identifier: MIT OR Apache-2.0
//! CMA-ES: evolution strategy with adapted covariance matrix and step size.
//!
//! Weighted recombination, step size by cumulated path length, rank-one and rank-μ update with
//! negative weights (active). Numbers of equations are those of \[Hansen 2016\] N. Hansen, *The CMA
//! evolution strategy: a tutorial*, arXiv:1604.00772. The distribution lives in free coordinates;
//! a smooth map takes them into the box. Only the ranks of values count.
//!
//! Infeasible candidates never move the mean. A generation with fewer feasible candidates than
//! parents is filled up from the same distribution; one without any enlarges the step size.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use self::stopping::{Distribution, History};
use self::strategy::Strategy;
use super::box_transform::{from_box, into_box};
use super::normal::Normal;
use super::record::Record;
use super::{BUDGET_SPENT, Evaluated, Minimiser, Point};

mod stopping;
mod strategy;

/// Largest standard deviation of a coordinate, as a fraction of the box (pycma's
/// `maxstd_boundrange`): beyond it the mirrored box looks the same everywhere.
const MAX_DEVIATION: f64 = 1.0 / 3.0;

/// Rounds that fill up a generation before the mean jumps to the best feasible candidate.
const ROUNDS: usize = 5;

/// Consecutive rounds without a feasible candidate that end the search.
const INFEASIBLE_ROUNDS: usize = 100;

/// Factor of the step size after a round without a feasible candidate.
const ENLARGED: f64 = 1.5;

/// Settings of [`CmaEs`].
#[derive(Debug, Clone)]
pub struct Settings {
    /// First mean, inside the box; its length is the dimension.
    pub start: Point,
    /// First step size, as a fraction of the box.
    pub sigma: f64,
    /// Candidates of a generation, at least 2.
    pub population: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Budget of evaluations.
    pub max_evaluations: usize,
    /// The search ends when all standard deviations are below this (TolX).
    pub smallest_step: f64,
    /// The search ends when the values of recent generations differ by less (TolFun).
    pub smallest_change: f64,
}

impl Settings {
    /// Defaults: step size 0.3, population 4 + ⌊3 ln n⌋ (48), smallest step and change 1e-12.
    ///
    /// # Panics
    ///
    /// A `start` without coordinates.
    pub fn new(start: Point, seed: u64, max_evaluations: usize) -> Self {
        assert!(!start.is_empty(), "a box of no dimension");
        Self {
            population: strategy::default_population(start.len()),
            start,
            sigma: 0.3,
            seed,
            max_evaluations,
            smallest_step: 1e-12,
            smallest_change: 1e-12,
        }
    }
}

/// A step from the mean, in units of the step size.
#[derive(Debug, Clone)]
struct Step {
    /// Normal vector z.
    z: DVector<f64>,
    /// y = B D z.
    y: DVector<f64>,
}

/// A candidate that a generation keeps.
#[derive(Debug, Clone)]
struct Ranked {
    step: Step,
    value: f64,
}

/// One run of CMA-ES.
#[derive(Debug, Clone)]
pub struct CmaEs {
    settings: Settings,
    strategy: Strategy,
    random: Normal,
    record: Record,
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    /// B: eigenvectors of the covariance.
    axes: DMatrix<f64>,
    /// D: square roots of its eigenvalues.
    lengths: DVector<f64>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    generation: usize,
    /// Steps of the candidates asked last.
    asked: Vec<Step>,
    /// Feasible candidates of earlier rounds of this generation.
    kept: Vec<Ranked>,
    rounds: usize,
    infeasible_rounds: usize,
    history: History,
    ended: Option<&'static str>,
}

impl CmaEs {
    /// A run at its start.
    ///
    /// # Panics
    ///
    /// A start without coordinates, a step size that is not positive, a population below 2.
    pub fn new(settings: Settings) -> Self {
        let n = settings.start.len();
        assert!(n > 0, "a box of no dimension");
        assert!(settings.sigma > 0.0, "no step size");
        assert!(settings.population >= 2, "no population");
        let mut run = Self {
            strategy: Strategy::new(n, settings.population),
            random: Normal::new(settings.seed),
            record: Record::new(settings.max_evaluations),
            mean: DVector::from_iterator(n, settings.start.iter().map(|&u| from_box(u))),
            sigma: settings.sigma,
            covariance: DMatrix::identity(n, n),
            axes: DMatrix::identity(n, n),
            lengths: DVector::repeat(n, 1.0),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            generation: 0,
            asked: Vec::new(),
            kept: Vec::new(),
            rounds: 0,
            infeasible_rounds: 0,
            history: History::default(),
            ended: None,
            settings,
        };
        run.limit_step_size();
        run.check_budget();
        run
    }

    /// Candidates of a full generation.
    pub fn population(&self) -> usize {
        self.settings.population
    }

    /// z normal, y = B D z (38, 39).
    fn step(&mut self) -> Step {
        let z = DVector::from_fn(self.mean.len(), |_, _| self.random.normal());
        let y = &self.axes * self.lengths.component_mul(&z);
        Step { z, y }
    }

    fn missing(&self) -> usize {
        self.settings.population - self.kept.len()
    }

    fn check_budget(&mut self) {
        if self.ended.is_none() && self.record.left() < self.missing() {
            self.ended = Some(BUDGET_SPENT);
        }
    }

    /// Too few feasible candidates: keeps them and lets the next round draw the others.
    fn fill_up(&mut self, round: Vec<Ranked>) {
        self.rounds += 1;
        self.infeasible_rounds += 1;
        for candidate in round.into_iter().filter(|c| c.value.is_finite()) {
            self.kept.push(candidate);
            self.infeasible_rounds = 0;
        }
        if self.kept.is_empty() {
            self.sigma *= ENLARGED;
            self.limit_step_size();
            if self.infeasible_rounds == INFEASIBLE_ROUNDS {
                self.ended = Some("no candidate is feasible");
            }
        } else if self.rounds >= ROUNDS {
            // Around a feasible point more candidates are feasible than around the mean.
            let best = self.kept.iter().min_by(|a, b| a.value.total_cmp(&b.value));
            if let Some(best) = best {
                self.mean += self.sigma * &best.step.y;
            }
            self.kept.clear();
            self.rounds = 0;
        }
    }

    /// Moves mean, step size and covariance by the candidates of a generation, best first.
    fn update(&mut self, ranked: &[Ranked]) {
        let n = self.mean.len() as f64;
        let s = &self.strategy;
        self.generation += 1;
        let weights = tied_weights(&s.weights, ranked);
        let mut y_mean = DVector::zeros(self.mean.len());
        let mut z_mean = y_mean.clone();
        for (candidate, weight) in ranked.iter().zip(&weights) {
            y_mean += weight.positive * &candidate.step.y;
            z_mean += weight.positive * &candidate.step.z;
        }
        self.mean += self.sigma * &y_mean; // (42)
        // (43): C^-1/2 y = B z.
        self.path_sigma *= 1.0 - s.c_sigma;
        self.path_sigma +=
            (s.c_sigma * (2.0 - s.c_sigma) * s.mu_eff).sqrt() * (&self.axes * z_mean);
        let length = self.path_sigma.norm();
        // Below (45): the path of the covariance stalls while the step size grows fast.
        let settled = 1.0 - (1.0 - s.c_sigma).powi(2 * self.generation.min(1 << 20) as i32);
        let stalled = length / settled.sqrt() >= (1.4 + 2.0 / (n + 1.0)) * s.chi;
        self.path_c *= 1.0 - s.c_c; // (45)
        if !stalled {
            self.path_c += (s.c_c * (2.0 - s.c_c) * s.mu_eff).sqrt() * y_mean;
        }
        let lost = if stalled { s.c_c * (2.0 - s.c_c) } else { 0.0 };
        let total: f64 = weights.iter().map(|w| w.signed).sum();
        // (46, 47)
        self.covariance *= 1.0 + s.c_1 * lost - s.c_1 - s.c_mu * total;
        self.covariance.ger(s.c_1, &self.path_c, &self.path_c, 1.0);
        for (candidate, weight) in ranked.iter().zip(&weights) {
            let Step { z, y } = &candidate.step;
            // (46): a negative weight counts by direction, not by length.
            let scale =
                if weight.signed < 0.0 { n / z.norm_squared().max(f64::MIN_POSITIVE) } else { 1.0 };
            self.covariance.ger(s.c_mu * scale * weight.signed, y, y, 1.0);
        }
        self.sigma *= (s.c_sigma / s.d_sigma * (length / s.chi - 1.0)).min(1.0).exp(); // (44)
    }

    /// C = B D² Bᵀ.
    fn decompose(&mut self) {
        self.covariance.fill_upper_triangle_with_lower_triangle();
        let SymmetricEigen { eigenvalues, eigenvectors } =
            SymmetricEigen::new(self.covariance.clone());
        self.axes = eigenvectors;
        self.lengths = eigenvalues.map(|square| square.max(0.0).sqrt());
    }

    fn limit_step_size(&mut self) {
        let longest = self.covariance.diagonal().max().sqrt();
        self.sigma = self.sigma.min(MAX_DEVIATION / longest);
    }

    fn check_criteria(&mut self, ranked: &[Ranked]) {
        let values = ranked.iter().map(|c| c.value);
        let feasible: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        self.history.add(&feasible);
        let distribution = Distribution {
            mean: &self.mean,
            sigma: self.sigma,
            covariance: &self.covariance,
            axes: &self.axes,
            lengths: &self.lengths,
            path: &self.path_c,
        };
        let by_values = self.history.ended(&feasible, &self.settings);
        self.ended = by_values.or(distribution.ended(self.generation, &self.settings));
    }
}

impl Minimiser for CmaEs {
    fn ask(&mut self) -> Vec<Point> {
        if self.ended.is_some() {
            return Vec::new();
        }
        if !self.record.asked().is_empty() {
            return self.record.asked().to_vec();
        }
        self.asked = (0..self.missing()).map(|_| self.step()).collect();
        let candidate = |step: &Step| boxed(&(&self.mean + self.sigma * &step.y));
        let candidates = self.asked.iter().map(candidate).collect();
        self.record.ask(candidates)
    }

    fn tell(&mut self, values: &[f64]) {
        let told = self.record.tell(values);
        let steps = std::mem::take(&mut self.asked).into_iter();
        let round: Vec<Ranked> =
            steps.zip(&told).map(|(step, told)| Ranked { step, value: told.value }).collect();
        let feasible = round.iter().filter(|c| c.value.is_finite()).count();
        if self.kept.len() + feasible < self.strategy.parents {
            self.fill_up(round);
        } else {
            let mut ranked = std::mem::take(&mut self.kept);
            ranked.extend(round);
            // Stable: the order of equal values does not depend on the sort.
            ranked.sort_by(|a, b| a.value.total_cmp(&b.value));
            (self.rounds, self.infeasible_rounds) = (0, 0);
            self.update(&ranked);
            self.decompose();
            self.limit_step_size();
            self.check_criteria(&ranked);
        }
        self.check_budget();
    }

    fn favourite(&self) -> Point {
        boxed(&self.mean)
    }

    fn best(&self) -> Option<&Evaluated> {
        self.record.best()
    }

    fn evaluations(&self) -> usize {
        self.record.evaluations()
    }

    fn ended(&self) -> Option<&'static str> {
        self.ended
    }

    fn reuses_population(&self) -> bool {
        !self.kept.is_empty()
    }
}

fn boxed(free: &DVector<f64>) -> Point {
    free.iter().map(|&x| into_box(x)).collect()
}

/// Weight of one rank.
#[derive(Debug, Clone, Copy)]
struct Weight {
    /// For the mean: 0 beyond the parents.
    positive: f64,
    /// For the covariance.
    signed: f64,
}

/// Weights of ranked candidates. Equal values share theirs: their order is no information.
fn tied_weights(weights: &[f64], ranked: &[Ranked]) -> Vec<Weight> {
    let mut tied = Vec::with_capacity(weights.len());
    for group in ranked.chunk_by(|a, b| a.value.total_cmp(&b.value).is_eq()) {
        let of_group = &weights[tied.len()..tied.len() + group.len()];
        let count = group.len() as f64;
        let weight = Weight {
            positive: of_group.iter().map(|w| w.max(0.0)).sum::<f64>() / count,
            signed: of_group.iter().sum::<f64>() / count,
        };
        tied.resize(tied.len() + group.len(), weight);
    }
    tied
}
