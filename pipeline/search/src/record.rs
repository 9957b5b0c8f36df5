// SPDX-License-Identifier: MIT OR Apache-2.0
//! What every search keeps: budget, candidates asked last, best candidate.

use super::{Evaluated, Point};

/// Candidates asked and values told.
#[derive(Debug, Clone)]
pub(super) struct Record {
    max_evaluations: usize,
    evaluations: usize,
    asked: Vec<Point>,
    best: Option<Evaluated>,
}

impl Record {
    pub(super) fn new(max_evaluations: usize) -> Self {
        Self { max_evaluations, evaluations: 0, asked: Vec::new(), best: None }
    }

    /// Candidates that wait for their values.
    pub(super) fn asked(&self) -> &[Point] {
        &self.asked
    }

    /// Lets `candidates` wait for their values.
    pub(super) fn ask(&mut self, candidates: Vec<Point>) -> Vec<Point> {
        self.asked.clone_from(&candidates);
        candidates
    }

    /// Pairs the waiting candidates with their values, NaN read as infinity.
    pub(super) fn tell(&mut self, values: &[f64]) -> Vec<Evaluated> {
        let asked = std::mem::take(&mut self.asked);
        assert_eq!(asked.len(), values.len(), "one value for each candidate");
        self.evaluations += values.len();
        let read = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        let told: Vec<Evaluated> = asked
            .into_iter()
            .zip(values)
            .map(|(point, &value)| Evaluated { point, value: read(value) })
            .collect();
        for one in &told {
            let bar = self.best.as_ref().map_or(f64::INFINITY, |b| b.value);
            if one.value < bar {
                self.best = Some(one.clone());
            }
        }
        told
    }

    pub(super) fn best(&self) -> Option<&Evaluated> {
        self.best.as_ref()
    }

    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Evaluations that the budget still allows.
    pub(super) fn left(&self) -> usize {
        self.max_evaluations.saturating_sub(self.evaluations)
    }
}
