// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pattern search along the coordinates: the step halves after a sweep without gain.
//!
//! \[Kolda, Lewis, Torczon 2003\] T. G. Kolda, R. M. Lewis, V. Torczon, *Optimization by direct
//! search*, SIAM Rev. 45, 385: compass search with complete polling.

use super::record::Record;
use super::{BUDGET_SPENT, Point, Search, Told};

/// Settings of a [`CoordinateSearch`].
#[derive(Debug, Clone)]
pub struct Settings {
    /// First centre, inside the box.
    pub start: Point,
    /// First step, as a fraction of the box.
    pub step: f64,
    /// The search ends below this step.
    pub smallest_step: f64,
    /// Budget of evaluations.
    pub most_evaluations: usize,
}

/// A centre that moves to the best of its neighbours at one step along each coordinate.
#[derive(Debug, Clone)]
pub struct CoordinateSearch {
    smallest_step: f64,
    centre: Told,
    step: f64,
    record: Record,
}

impl CoordinateSearch {
    /// A search at its start. It draws no random numbers.
    ///
    /// # Panics
    ///
    /// Where the start has no coordinates or a step is not positive.
    pub fn new(settings: Settings) -> Self {
        let Settings { start, step, .. } = settings;
        assert!(!start.is_empty(), "a box of no dimension");
        assert!(step > 0.0 && settings.smallest_step > 0.0, "no step");
        Self {
            // A step below round-off has no neighbours.
            smallest_step: settings.smallest_step.max(f64::EPSILON),
            centre: Told {
                point: start.iter().map(|u| u.clamp(0.0, 1.0)).collect(),
                value: f64::INFINITY,
            },
            step,
            record: Record::new(settings.most_evaluations),
        }
    }

    /// Centre plus and minus one step along each coordinate, without those the box leaves in place.
    fn neighbours(&self) -> Vec<Point> {
        let mut neighbours = Vec::new();
        for k in 0..self.centre.point.len() {
            for step in [self.step, -self.step] {
                let mut point = self.centre.point.clone();
                point[k] = (point[k] + step).clamp(0.0, 1.0);
                if point != self.centre.point {
                    neighbours.push(point);
                }
            }
        }
        neighbours
    }
}

impl Search for CoordinateSearch {
    fn ask(&mut self) -> Vec<Point> {
        if self.ended().is_some() {
            return Vec::new();
        }
        if !self.record.asked().is_empty() {
            return self.record.asked().to_vec();
        }
        let mut candidates = match self.record.evaluations() {
            0 => vec![self.centre.point.clone()],
            _ => self.neighbours(),
        };
        candidates.truncate(self.record.left());
        self.record.ask(candidates)
    }

    fn tell(&mut self, values: &[f64]) {
        let first = self.record.evaluations() == 0;
        let told = self.record.tell(values);
        let best = told
            .into_iter()
            .min_by(|a, b| a.value.total_cmp(&b.value))
            .filter(|best| best.value < self.centre.value);
        match best {
            Some(best) => self.centre = best,
            None if first => {}
            None => self.step /= 2.0,
        }
    }

    fn favourite(&self) -> Point {
        self.centre.point.clone()
    }

    fn best(&self) -> Option<&Told> {
        self.record.best()
    }

    fn evaluations(&self) -> usize {
        self.record.evaluations()
    }

    fn ended(&self) -> Option<&'static str> {
        if self.record.left() == 0 {
            return Some(BUDGET_SPENT);
        }
        (self.step < self.smallest_step).then_some("the step is below the smallest one")
    }
}
