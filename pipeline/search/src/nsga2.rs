// SPDX-License-Identifier: MIT OR Apache-2.0
//! NSGA-II: the Pareto front of two objectives over the unit box, by ask and tell.
//!
//! \[Deb 2002\] K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, *A fast and elitist multiobjective
//! genetic algorithm: NSGA-II*, IEEE Trans. Evol. Comput. 6, 182: non-dominated ranks, crowding
//! distance, constrained domination. \[Deb, Agrawal 1995\] *Simulated binary crossover for continuous
//! search space*, Complex Systems 9, 115. Unlike there, parents are judged again in every generation,
//! together with their offspring: noisy values never keep a parent for its luck.

use std::cmp::Ordering;

use super::Point;
use super::normal::Normal;

/// Probability that two parents are crossed.
const CROSSED: f64 = 0.9;
/// Distribution index of the crossover.
const CROSSOVER_INDEX: f64 = 15.0;
/// Distribution index of the mutation; each coordinate is mutated with probability 1/n.
const MUTATION_INDEX: f64 = 20.0;

/// Objectives and miss of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// Both objectives, smaller is better.
    pub objectives: [f64; 2],
    /// Distance from meeting the constraints: 0 where it meets them, infinite without objectives.
    pub miss: f64,
}

impl Judgement {
    /// True where it is no worse in anything than `other`, and better in something; less of a miss
    /// comes before any objective.
    pub fn dominates(&self, other: &Self) -> bool {
        if self.miss > 0.0 || other.miss > 0.0 {
            return self.miss < other.miss;
        }
        let pairs = || self.objectives.iter().zip(&other.objectives);
        pairs().all(|(a, b)| a <= b) && pairs().any(|(a, b)| a < b)
    }
}

/// A population that approaches the Pareto front.
#[derive(Debug, Clone)]
pub struct Nsga2 {
    population: usize,
    random: Normal,
    left: usize,
    asked: Vec<Point>,
    /// Survivors of the last generation, the least rank and the least crowded first.
    parents: Vec<Point>,
    /// Number of parents that no other dominates.
    front: usize,
}

impl Nsga2 {
    /// A population of `population` about `start` and uniform in the box; at most
    /// `max_evaluations` candidates are judged, parents again in every generation.
    ///
    /// # Panics
    ///
    /// A `start` without coordinates, or a population below 4.
    pub fn new(start: &Point, population: usize, seed: u64, max_evaluations: usize) -> Self {
        assert!(!start.is_empty() && population >= 4, "nothing to cross");
        let mut random = Normal::new(seed);
        let mut asked = vec![start.clone()];
        asked.extend((1..population).map(|_| random.point(start.len())));
        Self { population, random, left: max_evaluations, asked, parents: Vec::new(), front: 0 }
    }

    /// Candidates of the next generation: parents first, then as many offspring; none once the budget
    /// is spent. Asked again before it is told, it gives the same ones.
    pub fn ask(&mut self) -> Vec<Point> {
        if self.asked.is_empty() {
            self.asked = self.parents.clone();
            while self.asked.len() < 2 * self.population {
                let pair = [self.tournament(), self.tournament()];
                self.breed(pair);
            }
        }
        if self.asked.len() > self.left {
            return Vec::new();
        }
        self.asked.clone()
    }

    /// Takes what came of the candidates asked last, in their order.
    ///
    /// # Panics
    ///
    /// Unless there is one for each candidate asked.
    pub fn tell(&mut self, judged: &[Judgement]) {
        let asked = std::mem::take(&mut self.asked);
        assert_eq!(asked.len(), judged.len(), "one for each candidate");
        self.left -= asked.len();
        let order = survivors(judged);
        let best = fronts(judged).remove(0).len();
        let kept = order.into_iter().take(self.population);
        self.parents = kept.map(|k| asked[k].clone()).collect();
        self.front = best.min(self.population);
    }

    /// Survivors that no candidate of the last generation dominates, the least crowded first.
    pub fn front(&self) -> &[Point] {
        &self.parents[..self.front]
    }

    /// The better one of two parents: they are kept in that order.
    fn tournament(&mut self) -> Point {
        let mut draw = || (self.random.uniform() * self.parents.len() as f64) as usize;
        let (a, b) = (draw(), draw());
        self.parents[a.min(b)].clone()
    }

    /// Adds two children: simulated binary crossover and polynomial mutation, both within the box.
    fn breed(&mut self, [mut first, mut second]: [Point; 2]) {
        if self.random.uniform() < CROSSED {
            for (a, b) in first.iter_mut().zip(&mut second) {
                if self.random.uniform() < 0.5 {
                    [*a, *b] = crossed([*a, *b], [self.random.uniform(), self.random.uniform()]);
                }
            }
        }
        let share = 1.0 / first.len() as f64;
        for mut child in [first, second] {
            for x in &mut child {
                if self.random.uniform() < share {
                    *x = mutated(*x, self.random.uniform());
                }
            }
            // A copy would be judged for nothing.
            if self.asked.len() < 2 * self.population && !self.asked.contains(&child) {
                self.asked.push(child);
            }
        }
    }
}

/// Two children of the numbers `a` and `b` [Deb, Agrawal 1995, bounded form of Deb 2002's code]:
/// their spread follows a polynomial law that is cut at the bounds; the second draw decides which
/// child is which.
fn crossed([a, b]: [f64; 2], [draw, turn]: [f64; 2]) -> [f64; 2] {
    let (low, high) = (a.min(b), a.max(b));
    let apart = high - low;
    if apart < 1e-14 {
        return [a, b];
    }
    let spread = |room: f64| {
        let beta = 1.0 + 2.0 * room / apart;
        let alpha = 2.0 - beta.powf(-(CROSSOVER_INDEX + 1.0));
        let base = if draw <= 1.0 / alpha { draw * alpha } else { 1.0 / (2.0 - draw * alpha) };
        base.powf(1.0 / (CROSSOVER_INDEX + 1.0))
    };
    let middle = 0.5 * (low + high);
    let children = [
        (middle - 0.5 * spread(low) * apart).clamp(0.0, 1.0),
        (middle + 0.5 * spread(1.0 - high) * apart).clamp(0.0, 1.0),
    ];
    if turn < 0.5 { children } else { [children[1], children[0]] }
}

/// A number near `x` by a polynomial law that is cut at the bounds [Deb 2002].
fn mutated(x: f64, draw: f64) -> f64 {
    let power = MUTATION_INDEX + 1.0;
    let step = if draw < 0.5 {
        let inner = 2.0 * draw + (1.0 - 2.0 * draw) * (1.0 - x).powf(power);
        inner.powf(1.0 / power) - 1.0
    } else {
        let inner = 2.0 * (1.0 - draw) + (2.0 * draw - 1.0) * x.powf(power);
        1.0 - inner.powf(1.0 / power)
    };
    (x + step).clamp(0.0, 1.0)
}

/// Numbers of all candidates, by rank and then by crowding distance, the least crowded first.
fn survivors(judged: &[Judgement]) -> Vec<usize> {
    let mut order = Vec::new();
    for front in fronts(judged) {
        let mut crowded = crowding(judged, &front);
        // Of equals the first stays first.
        crowded.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        order.extend(crowded.into_iter().map(|(k, _)| k));
    }
    order
}

/// Candidates by rank: those that nobody dominates, then those that only former ranks dominate.
pub fn fronts(judged: &[Judgement]) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..judged.len()).collect();
    let mut fronts = Vec::new();
    while !left.is_empty() {
        let free = |k: &usize| !left.iter().any(|j| judged[*j].dominates(&judged[*k]));
        let (front, rest) = left.iter().copied().partition(free);
        fronts.push(front);
        left = rest;
    }
    fronts
}

/// Crowding distance of each candidate of a front: the sides of the box between its neighbours,
/// relative to the front's; infinite at its ends.
fn crowding(judged: &[Judgement], front: &[usize]) -> Vec<(usize, f64)> {
    let mut distance: Vec<(usize, f64)> = front.iter().map(|k| (*k, 0.0)).collect();
    for objective in 0..2 {
        let value = |k: usize| judged[k].objectives[objective];
        let by_value =
            |a: &(usize, f64), b: &(usize, f64)| -> Ordering { value(a.0).total_cmp(&value(b.0)) };
        distance.sort_by(by_value);
        let last = distance.len() - 1;
        let range = value(distance[last].0) - value(distance[0].0);
        let values: Vec<f64> = distance.iter().map(|(k, _)| value(*k)).collect();
        for (k, (_, sum)) in distance.iter_mut().enumerate() {
            *sum += if k == 0 || k == last || range.is_nan() || range <= 0.0 {
                f64::INFINITY
            } else {
                (values[k + 1] - values[k - 1]) / range
            };
        }
    }
    distance
}
