// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniform random search, the yardstick of every other one.

use super::normal::Normal;
use super::record::Record;
use super::{BUDGET_SPENT, Evaluated, Minimiser, Point};

/// Independent candidates, uniform in the box.
#[derive(Debug, Clone)]
pub struct RandomSearch {
    dimension: usize,
    population: usize,
    random: Normal,
    record: Record,
}

impl RandomSearch {
    /// At most `max_evaluations` candidates, `population` in a generation.
    ///
    /// # Panics
    ///
    /// A `dimension` or `population` of 0.
    pub fn new(dimension: usize, population: usize, seed: u64, max_evaluations: usize) -> Self {
        assert!(dimension > 0 && population > 0, "nothing to draw");
        Self {
            dimension,
            population,
            random: Normal::new(seed),
            record: Record::new(max_evaluations),
        }
    }
}

impl Minimiser for RandomSearch {
    fn ask(&mut self) -> Vec<Point> {
        if !self.record.asked().is_empty() {
            return self.record.asked().to_vec();
        }
        let count = self.population.min(self.record.left());
        let candidates = (0..count).map(|_| self.random.point(self.dimension)).collect();
        self.record.ask(candidates)
    }

    fn tell(&mut self, values: &[f64]) {
        self.record.tell(values);
    }

    /// The best candidate; the middle of the box where none is feasible.
    fn favourite(&self) -> Point {
        let middle = || vec![0.5; self.dimension];
        self.best().map_or_else(middle, |b| b.point.clone())
    }

    fn best(&self) -> Option<&Evaluated> {
        self.record.best()
    }

    fn evaluations(&self) -> usize {
        self.record.evaluations()
    }

    fn ended(&self) -> Option<&'static str> {
        (self.record.left() == 0).then_some(BUDGET_SPENT)
    }
}
