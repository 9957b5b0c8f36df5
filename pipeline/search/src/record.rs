// SPDX-License-Identifier: MIT OR Apache-2.0
//! What every search keeps: budget, candidates asked last, best candidate.

use super::{Point, Told};

/// Candidates asked and values told.
#[derive(Debug, Clone)]
pub(super) struct Record {
    most_evaluations: usize,
    evaluations: usize,
    asked: Vec<Point>,
    best: Option<Told>,
}

impl Record {
    pub(super) fn new(most_evaluations: usize) -> Self {
        Self { most_evaluations, evaluations: 0, asked: Vec::new(), best: None }
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
    pub(super) fn tell(&mut self, values: &[f64]) -> Vec<Told> {
        let asked = std::mem::take(&mut self.asked);
        assert_eq!(asked.len(), values.len(), "one value for each candidate");
        self.evaluations += values.len();
        let read = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        let told: Vec<Told> = asked
            .into_iter()
            .zip(values)
            .map(|(point, &value)| Told { point, value: read(value) })
            .collect();
        for one in &told {
            let bar = self.best.as_ref().map_or(f64::INFINITY, |b| b.value);
            if one.value < bar {
                self.best = Some(one.clone());
            }
        }
        told
    }

    pub(super) fn best(&self) -> Option<&Told> {
        self.best.as_ref()
    }

    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Evaluations that the budget still allows.
    pub(super) fn left(&self) -> usize {
        self.most_evaluations.saturating_sub(self.evaluations)
    }
}
