// SPDX-License-Identifier: MIT OR Apache-2.0
//! Criteria that end CMA-ES by themselves: \[Hansen 2016\], section B.3.

use nalgebra::{DMatrix, DVector};

use super::Settings;

/// Largest condition number of the covariance matrix.
const CONDITION: f64 = 1e14;

/// Largest number of generations that stagnation looks back on.
const MAX_SPAN: usize = 20_000;

/// Best and median values of past generations.
#[derive(Debug, Clone, Default)]
pub(super) struct History {
    best: Vec<f64>,
    median: Vec<f64>,
}

/// The distribution as the criteria see it.
pub(super) struct Distribution<'a> {
    pub(super) mean: &'a DVector<f64>,
    pub(super) sigma: f64,
    pub(super) covariance: &'a DMatrix<f64>,
    /// Eigenvectors of the covariance, in columns.
    pub(super) axes: &'a DMatrix<f64>,
    /// Square roots of its eigenvalues.
    pub(super) lengths: &'a DVector<f64>,
    /// Evolution path of the covariance.
    pub(super) path: &'a DVector<f64>,
}

impl History {
    /// Adds the feasible values of a generation, in ascending order.
    pub(super) fn add(&mut self, ascending: &[f64]) {
        self.best.push(ascending[0]);
        self.median.push(ascending[ascending.len() / 2]);
    }

    /// The criterion that the values meet; `ascending` are those of the last generation.
    pub(super) fn ended(&self, ascending: &[f64], settings: &Settings) -> Option<&'static str> {
        let per_generation = 30.0 * settings.start.len() as f64 / settings.population as f64;
        let window = 10 + per_generation.ceil() as usize;
        if self.best.len() >= window {
            let recent = &self.best[self.best.len() - window..];
            let range = range(recent);
            if range == 0.0 {
                return Some("the best values of the last generations are equal");
            }
            let all = recent.iter().chain(ascending).copied().collect::<Vec<_>>();
            if self::range(&all) < settings.smallest_change {
                return Some("values change by less than the smallest change");
            }
        }
        let generations = self.best.len();
        let span = (generations / 5).max(120 + per_generation as usize).min(MAX_SPAN);
        let stagnant = generations >= span
            && [&self.best, &self.median]
                .iter()
                .all(|values| stagnates(&values[generations - span..]));
        stagnant.then_some("values stagnate")
    }
}

impl Distribution<'_> {
    /// The criterion that the distribution of generation `generation` meets.
    pub(super) fn ended(&self, generation: usize, settings: &Settings) -> Option<&'static str> {
        let deviation = |k: usize| self.sigma * self.covariance[(k, k)].sqrt();
        let n = self.mean.len();
        let small = |k| {
            deviation(k) < settings.smallest_step
                && (self.sigma * self.path[k]).abs() < settings.smallest_step
        };
        if (0..n).all(small) {
            return Some("the step size is below the smallest step");
        }
        let (shortest, longest) = (self.lengths.min(), self.lengths.max());
        if longest.powi(2) > CONDITION * shortest.powi(2) {
            return Some("the covariance matrix is ill-conditioned");
        }
        let axis = generation % n;
        let along = self.axes.column(axis) * (0.1 * self.sigma * self.lengths[axis]);
        let still = |k: usize| self.mean[k] + 0.2 * deviation(k) <= self.mean[k];
        if self.mean + along == *self.mean || (0..n).any(still) {
            return Some("steps vanish in round-off");
        }
        None
    }
}

fn range(values: &[f64]) -> f64 {
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    max - values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// True where the median of the last 30 % is not better than that of the first 30 %.
fn stagnates(values: &[f64]) -> bool {
    let part = (values.len() * 3 / 10).max(1);
    median(&values[values.len() - part..]) >= median(&values[..part])
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
