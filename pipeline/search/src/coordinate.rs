// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pattern search along the coordinates: the step halves after a round without gain.
//!
//! \[Kolda, Lewis, Torczon 2003\] T. G. Kolda, R. M. Lewis, V. Torczon, *Optimization by direct
//! search*, SIAM Rev. 45, 385: compass search with complete polling,
//! here with a trial of all moves that gain.

use super::record::Record;
use super::{BUDGET_SPENT, Evaluated, Minimiser, Point};

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
    pub max_evaluations: usize,
}

/// A centre with its neighbours at one step along each coordinate. Moves that gain are tried
/// together, as far as they add up, and the centre goes to the best candidate of the trial. The
/// centre is a candidate of every generation, so that noise that one generation shares decides
/// nothing.
#[derive(Debug, Clone)]
pub struct CoordinateSearch {
    smallest_step: f64,
    centre: Point,
    step: f64,
    /// Moves to try together: the points of neighbours that gained, best first.
    gains: Vec<Point>,
    record: Record,
}

impl CoordinateSearch {
    /// A search at its start. It draws no random numbers.
    ///
    /// # Panics
    ///
    /// A start without coordinates, a step that is not positive.
    pub fn new(settings: Settings) -> Self {
        let Settings { start, step, .. } = settings;
        assert!(!start.is_empty(), "a box of no dimension");
        assert!(step > 0.0 && settings.smallest_step > 0.0, "no step");
        Self {
            // A step below round-off has no neighbours.
            smallest_step: settings.smallest_step.max(f64::EPSILON),
            centre: start.iter().map(|u| u.clamp(0.0, 1.0)).collect(),
            step,
            gains: Vec::new(),
            record: Record::new(settings.max_evaluations),
        }
    }

    /// The best 1, 2, 4, ... gains together, and all of them; of two moves of one coordinate the
    /// better one counts.
    fn together(&self) -> Vec<Point> {
        let mut trials = Vec::new();
        let mut moved = self.centre.clone();
        for (number, gain) in (1_usize..).zip(&self.gains) {
            let changed =
                (0..moved.len()).filter(|&k| gain[k].to_bits() != self.centre[k].to_bits());
            for k in changed {
                if moved[k].to_bits() == self.centre[k].to_bits() {
                    moved[k] = gain[k];
                }
            }
            if number.is_power_of_two() || number == self.gains.len() {
                trials.push(moved.clone());
            }
        }
        trials.dedup();
        trials
    }

    /// Centre plus and minus one step along each coordinate, without those the box leaves in place.
    fn neighbours(&self) -> Vec<Point> {
        let mut neighbours = Vec::new();
        for k in 0..self.centre.len() {
            for step in [self.step, -self.step] {
                let mut point = self.centre.clone();
                point[k] = (point[k] + step).clamp(0.0, 1.0);
                if point != self.centre {
                    neighbours.push(point);
                }
            }
        }
        neighbours
    }
}

impl Minimiser for CoordinateSearch {
    fn ask(&mut self) -> Vec<Point> {
        if self.ended().is_some() {
            return Vec::new();
        }
        if !self.record.asked().is_empty() {
            return self.record.asked().to_vec();
        }
        let mut candidates = vec![self.centre.clone()];
        candidates.extend(if self.gains.is_empty() { self.neighbours() } else { self.together() });
        candidates.truncate(self.record.left());
        self.record.ask(candidates)
    }

    fn tell(&mut self, values: &[f64]) {
        let mut told = self.record.tell(values);
        let centre = told.remove(0).value;
        told.retain(|one| one.value < centre);
        told.sort_by(|a, b| a.value.total_cmp(&b.value));
        if self.gains.is_empty() {
            if told.is_empty() {
                self.step /= 2.0;
            }
            self.gains = told.into_iter().map(|one| one.point).collect();
            return;
        }
        self.gains.clear();
        match told.into_iter().next() {
            Some(best) => self.centre = best.point,
            // What gained alone was noise.
            None => self.step /= 2.0,
        }
    }

    fn favourite(&self) -> Point {
        self.centre.clone()
    }

    fn best(&self) -> Option<&Evaluated> {
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
