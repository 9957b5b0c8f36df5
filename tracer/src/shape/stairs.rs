// SPDX-License-Identifier: MIT OR Apache-2.0
//! Staircases turned about the z axis: level treads and upright risers that fall outwards.
//!
//! At height z the solid is a disc, whose squared radius S(z) only grows downwards, in steps. Along
//! a ray that is not level, the squared distance from the axis is a convex quadratic ρ of z.
//!
//! Light inside (ρ < S) that rises leaves at the first tread level h where ρ(h) is above the S
//! beyond that level: through the tread if ρ(h) is still below the S before it, else through the
//! riser under that tread. Light that falls leaves through a riser only. For light outside it is
//! the reverse; as ρ may dip between two levels, its least value between them counts.
//!
//! So comparisons at one level after another give the primitive, and only then is a distance
//! computed. Every ray that is on the wrong side of S beyond some level has met the primitive
//! there: there is no seam to slip through.

use super::Frustum;
use super::frustum::{Axial, quadratic_root};
use super::shell::Passage;

/// |d_z| below which a ray is level.
const LEVEL: f64 = 1e-200;
/// Cells of the search for the level at a height, for each tread.
const CELLS_A_TREAD: usize = 4;

/// One tread and the riser at its outer end.
#[derive(Debug, Clone, Copy)]
struct Step {
    /// Height of the tread.
    height: f64,
    /// Radius of the riser and its square.
    radius: f64,
    square: f64,
}

/// The steps of a staircase from the axis outwards. Primitive 2k is tread k, primitive 2k + 1 the
/// riser at its outer end.
#[derive(Debug, Clone)]
pub(crate) struct Stairs {
    steps: Vec<Step>,
    top: f64,
    foot: f64,
    /// Number of levels at or above the upper end of each cell; cells are even in the root of the
    /// depth below the top, as treads of one width on a sphere are.
    cells: Vec<u32>,
    cells_per_root: f64,
}

/// A ray against a staircase: a stretch of it begins at height `z` and ends at height `stop`.
#[derive(Debug, Clone, Copy)]
struct Climb {
    axial: Axial,
    z: f64,
    stop: f64,
}

impl Climb {
    /// Squared distance from the axis at a height.
    #[inline]
    fn square(&self, height: f64) -> f64 {
        self.axial.r2((height - self.axial.z) / self.axial.dz)
    }

    /// Height at which the ray is nearest to the axis.
    #[inline]
    fn turn(&self) -> f64 {
        self.axial.z(-self.axial.b / self.axial.a)
    }
}

impl Stairs {
    /// The staircase that these segments of a meridian are, if they are one.
    pub fn from_frusta(frusta: &[Frustum]) -> Option<Self> {
        let mut steps: Vec<Step> = Vec::new();
        let mut foot = f64::NAN;
        for pair in frusta.chunks(2) {
            let [tread, riser] = pair else { return None };
            let ([[r0, z0], [r1, z1]], [[r2, z2], [r3, z3]]) = (tread.ends(), riser.ends());
            let before = steps.last().map_or(0.0, |step| step.radius);
            let joined = r0.to_bits() == before.to_bits()
                && (steps.is_empty() || z0.to_bits() == foot.to_bits());
            let level = z0.to_bits() == z1.to_bits() && r1 > r0;
            let upright = r2.to_bits() == r3.to_bits() && z3 < z2;
            if !(joined && level && upright) {
                return None;
            }
            steps.push(Step { height: z0, radius: r2, square: r2 * r2 });
            foot = z3;
        }
        let top = steps.first()?.height;
        let count = CELLS_A_TREAD * steps.len();
        let cells_per_root = count as f64 / (top - foot).sqrt();
        let cells = (0..=count)
            .map(|cell| {
                let root = cell as f64 / cells_per_root;
                steps.partition_point(|step| step.height >= top - root * root) as u32
            })
            .collect();
        Some(Self { steps, top, foot, cells, cells_per_root })
    }

    /// Height of every tread with the squared radius of the riser at its outer end.
    pub fn levels(&self) -> Vec<(f64, f64)> {
        self.steps.iter().map(|step| (step.height, step.square)).collect()
    }

    /// Height at which the last riser ends.
    pub fn foot(&self) -> f64 {
        self.foot
    }

    /// Number of levels at or above a height.
    #[inline]
    fn level(&self, z: f64) -> usize {
        let below = self.top - z;
        let root = if below > 0.0 { below.sqrt() } else { 0.0 };
        let cell = ((root * self.cells_per_root) as usize).min(self.cells.len() - 1);
        let mut level = self.cells[cell] as usize;
        while level < self.steps.len() && self.steps[level].height >= z {
            level += 1;
        }
        while level > 0 && self.steps[level - 1].height < z {
            level -= 1;
        }
        level
    }

    /// Exit of light from inside, with the passage of its ray through the shell: within the inner
    /// ball there is nothing to meet.
    #[inline]
    pub fn leave_through(&self, passage: &Passage, axial: Axial) -> Option<(f64, u32)> {
        let [from, to] = passage.gap;
        if from > 0.0 {
            // Light that falls and comes nearer to the axis on its way to the inner ball leaves
            // nowhere.
            let idle = axial.dz < 0.0 && axial.a * from + axial.b <= 0.0;
            if !idle {
                let climb = Climb { axial, z: axial.z, stop: axial.z(from) };
                if let Some(found) = self.leave(&climb) {
                    return Some(found);
                }
            }
        }
        let stop = if axial.dz > 0.0 { f64::INFINITY } else { f64::NEG_INFINITY };
        self.leave(&Climb { axial, z: axial.z(to.max(0.0)), stop })
    }

    /// Entry of light from outside, with the passage of its ray through the shell: outside of the
    /// outer ball there is nothing to meet.
    #[inline]
    pub fn enter_through(&self, passage: &Passage, axial: Axial) -> Option<(f64, u32)> {
        let [from, to] = passage.whole;
        if to < 0.0 || (axial.dz >= 0.0 && axial.b >= 0.0) {
            return None;
        }
        self.enter(&Climb { axial, z: axial.z(from.max(0.0)), stop: axial.z(to) })
    }

    /// Exit of light from inside: distance and primitive.
    #[inline]
    fn leave(&self, climb: &Climb) -> Option<(f64, u32)> {
        let axial = &climb.axial;
        let count = self.steps.len();
        if axial.dz > LEVEL {
            if climb.z < self.foot && climb.square(self.foot) > self.steps[count - 1].square {
                return None;
            }
            for number in (0..self.level(climb.z)).rev() {
                let step = &self.steps[number];
                let square = climb.square(step.height);
                let above = if number > 0 { self.steps[number - 1].square } else { -1.0 };
                if square > above {
                    return Some(if square > step.square {
                        self.riser(axial, number, 1.0)
                    } else {
                        self.tread(axial, number)
                    });
                }
                if step.height >= climb.stop {
                    return None;
                }
            }
            return None;
        }
        if climb.z <= self.foot {
            return None;
        }
        let level = self.level(climb.z).max(1);
        if axial.dz >= -LEVEL {
            return Some(self.riser(axial, level - 1, 1.0));
        }
        for number in level - 1..count {
            let below = self.below(number);
            if climb.square(below) > self.steps[number].square {
                return Some(self.riser(axial, number, 1.0));
            }
            if below <= climb.stop {
                return None;
            }
        }
        None
    }

    /// Entry of light from outside: distance and primitive.
    #[inline]
    fn enter(&self, climb: &Climb) -> Option<(f64, u32)> {
        let axial = &climb.axial;
        let count = self.steps.len();
        let turn = climb.turn();
        if axial.dz > LEVEL {
            // Through a riser, while the ray comes nearer to the axis.
            if turn <= climb.z {
                return None;
            }
            if climb.z < self.foot
                && (climb.stop <= self.foot
                    || climb.square(self.foot) < self.steps[count - 1].square)
            {
                return None;
            }
            for number in (0..self.level(climb.z)).rev() {
                let step = &self.steps[number];
                if climb.square(step.height.min(turn)) < step.square {
                    return Some(self.riser(axial, number, -1.0));
                }
                if step.height >= turn || step.height >= climb.stop {
                    return None;
                }
            }
            return None;
        }
        if climb.z <= self.foot {
            return None;
        }
        let level = self.level(climb.z);
        if axial.dz >= -LEVEL {
            let within = level > 0
                && axial.b < 0.0
                && axial.c - axial.b * axial.b / axial.a < self.steps[level - 1].square;
            return within.then(|| self.riser(axial, level - 1, -1.0));
        }
        let mut z = climb.z;
        for number in level..=count {
            // The riser above the next tread, then the tread.
            let next = if number < count { self.steps[number].height } else { self.foot };
            if number > 0
                && turn < z
                && climb.square(next.max(turn)) < self.steps[number - 1].square
            {
                return Some(self.riser(axial, number - 1, -1.0));
            }
            if number < count && climb.square(next) < self.steps[number].square {
                return Some(self.tread(axial, number));
            }
            if next <= climb.stop {
                return None;
            }
            z = next;
        }
        None
    }

    /// Height at which the riser `number` ends.
    #[inline]
    fn below(&self, number: usize) -> f64 {
        self.steps.get(number + 1).map_or(self.foot, |step| step.height)
    }

    #[inline]
    fn tread(&self, axial: &Axial, number: usize) -> (f64, u32) {
        let distance = (self.steps[number].height - axial.z) / axial.dz;
        (distance.max(0.0), 2 * number as u32)
    }

    /// The far (`sign` 1) or near (-1) root of ρ = R². A start that is beyond by rounding has met
    /// it at once.
    #[inline]
    fn riser(&self, axial: &Axial, number: usize, sign: f64) -> (f64, u32) {
        let c = axial.c - self.steps[number].square;
        let s = (axial.b * axial.b - axial.a * c).max(0.0).sqrt() * sign;
        let distance = quadratic_root([axial.a, axial.b, c], s);
        (distance.max(0.0), 2 * number as u32 + 1)
    }
}
