// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scrambled Sobol' points: low-discrepancy numbers for the first ray of each path.
//!
//! Path k of a group takes five numbers on [0, 1): two for the direction, two for the position, one
//! for the source. They are the point k of a Sobol' sequence (dimensions 1 to 5 of \[Joe, Kuo
//! 2008\]), scrambled anew for each group: each generating matrix is multiplied by a random lower
//! triangular one with a unit diagonal, and a random number is added to every point, both modulo 2
//! \[Matoušek 1998\].
//!
//! Every point is then uniform, so the mean of a group is unbiased. Groups are independent, so
//! their scatter gives the standard error. The variance is that of Owen's nested scrambling \[Owen
//! 2003\]. All later numbers of a path come from its own random stream.
//!
//! \[Joe, Kuo 2008\] S. Joe, F. Y. Kuo, *Constructing Sobol' sequences with better two-dimensional
//! projections*, SIAM J. Sci. Comput. 30, 2635.
//!
//! \[Matoušek 1998\] J. Matoušek, *On the L2-discrepancy for anchored boxes*, J. Complexity 14,
//! 527.
//!
//! \[Owen 2003\] A. B. Owen, *Variance with alternative scramblings of digital nets*, ACM Trans.
//! Model. Comput. Simul. 13, 363.
//!
//! \[Shirley, Chiu 1997\] P. Shirley, K. Chiu, *A low distortion map between disk and square*, J.
//! Graph. Tools 2, 45.

use rand::Rng;

use crate::random;

/// Numbers of a point.
const DIMENSIONS: usize = 5;
/// Bits of a number, and of the number of a point.
const BITS: usize = 64;
/// Bits of the number of a point that are looked up at once.
const LOW: u32 = 6;

/// One value for each dimension.
pub(crate) type Words<T> = [T; DIMENSIONS];

/// Points in a block: those whose numbers differ in the lowest bits alone.
pub(crate) const BLOCK: usize = 1 << LOW;

/// Degree, inner coefficients and first direction numbers of the primitive polynomials of
/// dimensions 2 to 5 \[Joe, Kuo 2008\].
const POLYNOMIALS: [(usize, u64, [u64; 3]); DIMENSIONS - 1] =
    [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1]), (3, 2, [1, 1, 1])];

/// Start of a path as numbers on [0, 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SobolPoint {
    pub direction: [f64; 2],
    pub position: [f64; 2],
    /// Chooses the source.
    pub turn: f64,
}

/// The points of one group.
#[derive(Debug, Clone)]
pub(crate) struct SobolSequence {
    /// Summand of bit j of the number of a point, of those bits that numbers have.
    columns: Vec<Words<u64>>,
    /// Sum over the lowest bits of the number, and the shift, for each dimension.
    low: Words<[u64; BLOCK]>,
    /// The higher bits of the last point, and what they add.
    block: u64,
    high: Words<u64>,
}

impl SobolSequence {
    /// So many points, scrambled by `rng`.
    pub fn new(points: u64, rng: &mut impl Rng) -> Self {
        let bits = (u64::BITS - points.leading_zeros()).max(LOW) as usize;
        let mut columns = vec![[0; DIMENSIONS]; bits];
        let mut shift = [0; DIMENSIONS];
        for dimension in 0..DIMENSIONS {
            let plain = directions(dimension);
            let mut scrambled = vec![0_u64; bits];
            for row in 0..BITS {
                // The digits before this one, the first ones being the highest bits, each by
                // chance; this one always.
                let before = !(u64::MAX >> row);
                let own = 1 << (BITS - 1 - row);
                let mask = (rng.next_u64() & before) | own;
                for (column, plain) in scrambled.iter_mut().zip(plain) {
                    if (plain & mask).count_ones() % 2 == 1 {
                        *column |= own;
                    }
                }
            }
            for (column, scrambled) in columns.iter_mut().zip(scrambled) {
                column[dimension] = scrambled;
            }
            shift[dimension] = rng.next_u64();
        }
        let mut sequence =
            Self { columns, low: [[0; BLOCK]; DIMENSIONS], block: 0, high: [0; DIMENSIONS] };
        for number in 0..BLOCK {
            let words = sequence.added(number as u64, shift);
            for (low, word) in sequence.low.iter_mut().zip(words) {
                low[number] = word;
            }
        }
        sequence
    }

    /// `words` and what the bits of `number` add to them.
    fn added(&self, mut number: u64, mut words: Words<u64>) -> Words<u64> {
        while number != 0 {
            add(&mut words, &self.columns[number.trailing_zeros() as usize]);
            number &= number - 1;
        }
        words
    }

    /// Words of all points in the block of point `number`, and the words to add to each of them
    /// modulo 2.
    ///
    /// # Panics
    /// If the block lies far beyond the last point.
    #[inline]
    pub fn block(&mut self, number: u64) -> (&Words<[u64; BLOCK]>, Words<u64>) {
        let block = number >> LOW;
        if block != self.block {
            self.high = self.added(block << LOW, [0; DIMENSIONS]);
            self.block = block;
        }
        (&self.low, self.high)
    }

    /// Point `number`, from 0 and below the number of points; quick where the one before was asked for last.
    #[inline]
    pub fn point(&mut self, number: u64) -> SobolPoint {
        let (low, high) = self.block(number);
        let k = (number % BLOCK as u64) as usize;
        let [a, b, c, d, turn] =
            [0, 1, 2, 3, 4].map(|axis| random::unit_from_word(low[axis][k] ^ high[axis]));
        SobolPoint { direction: [a, b], position: [c, d], turn }
    }
}

#[inline]
fn add(words: &mut Words<u64>, more: &Words<u64>) {
    for (word, more) in words.iter_mut().zip(more) {
        *word ^= more;
    }
}

/// Summand of each bit of the number of a point in its number of this dimension, from 0, without
/// scrambling.
fn directions(dimension: usize) -> [u64; BITS] {
    let mut numbers = [0; BITS];
    let Some((degree, inner, first)) = dimension.checked_sub(1).map(|d| POLYNOMIALS[d]) else {
        for (j, number) in numbers.iter_mut().enumerate() {
            *number = 1 << (BITS - 1 - j);
        }
        return numbers;
    };
    for j in 0..BITS {
        numbers[j] = if j < degree {
            first[j] << (BITS - 1 - j)
        } else {
            // The recurrence of the polynomial, whose outer coefficients are 1.
            let mut number = numbers[j - degree] ^ (numbers[j - degree] >> degree);
            for k in 1..degree {
                if inner >> (degree - 1 - k) & 1 == 1 {
                    number ^= numbers[j - k];
                }
            }
            number
        };
    }
    numbers
}

/// The point of the unit disc that a point of the unit square is mapped to: squares about the
/// middle become circles, areas stay in proportion \[Shirley, Chiu 1997\].
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
#[inline(always)]
pub(crate) fn concentric([u, v]: [f64; 2]) -> (f64, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let wide = a.abs() > b.abs();
    let (radius, other) = if wide { (a, b) } else { (b, a) };
    let ratio = if radius == 0.0 { 0.0 } else { other / radius };
    let (sin, cos) = eighth(std::f64::consts::FRAC_PI_4 * ratio);
    let (along, aside) = (radius * cos, radius * sin);
    if wide { (along, aside) } else { (aside, along) }
}

/// Sine and cosine of an angle of at most π/4, by their series, which are of the same bits on any
/// machine.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
#[inline(always)]
fn eighth(angle: f64) -> (f64, f64) {
    let square = angle * angle;
    let (mut sin, mut cos) = (1.0, 1.0);
    for k in (1..9).rev() {
        let even = f64::from(2 * k);
        sin = 1.0 - sin * square * (1.0 / (even * (even + 1.0)));
        cos = 1.0 - cos * square * (1.0 / (even * (even - 1.0)));
    }
    (angle * sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    fn numbers(point: &SobolPoint) -> [f64; DIMENSIONS] {
        let ([a, b], [c, d]) = (point.direction, point.position);
        [a, b, c, d, point.turn]
    }

    /// True if each of the 2^`total` boxes with sides of 2^-`bits` holds exactly one of the points.
    fn one_in_each(points: &[[f64; DIMENSIONS]], axes: &[usize], bits: &[u32]) -> bool {
        let mut seen = vec![false; points.len()];
        for point in points {
            let place = axes.iter().zip(bits).fold(0, |place, (&axis, &bits)| {
                (place << bits) + (point[axis] * f64::from(1 << bits)) as usize
            });
            if std::mem::replace(&mut seen[place], true) {
                return false;
            }
        }
        true
    }

    #[test]
    fn every_scrambling_is_a_net() {
        const ALL: u32 = 10;
        for group in 0..20 {
            let mut sequence = SobolSequence::new(u64::MAX, &mut stream(1, group));
            // Any aligned run of points, not only the first.
            let first = group << ALL;
            let points: Vec<_> =
                (first..first + (1 << ALL)).map(|k| numbers(&sequence.point(k))).collect();
            for axis in 0..DIMENSIONS {
                assert!(one_in_each(&points, &[axis], &[ALL]), "axis {axis}");
            }
            // The first two dimensions: a (0, 2)-sequence, every shape of box.
            for bits in 0..=ALL {
                assert!(one_in_each(&points, &[0, 1], &[bits, ALL - bits]), "{bits} bits");
            }
        }
    }

    #[test]
    fn points_do_not_depend_on_the_order_in_which_they_are_asked_for() {
        let mut sequence = SobolSequence::new(u64::MAX, &mut stream(2, 0));
        let forwards: Vec<SobolPoint> = (0..3000).map(|k| sequence.point(k)).collect();
        for k in (0..3000).rev().step_by(7) {
            assert_eq!(sequence.point(k), forwards[k as usize]);
        }
        let far = u64::MAX - 5;
        assert!(numbers(&sequence.point(far)).iter().all(|x| (0.0..1.0).contains(x)));
    }

    #[test]
    fn single_points_are_uniform_over_scramblings() {
        // Chi-square over 16 cells in each dimension, of one point of each of 8000 scramblings.
        const CELLS: usize = 16;
        const DRAWS: u64 = 8_000;
        let mut counts = [[0_f64; CELLS]; DIMENSIONS];
        for group in 0..DRAWS {
            let point = SobolSequence::new(u64::MAX, &mut stream(3, group)).point(11);
            for (count, number) in counts.iter_mut().zip(numbers(&point)) {
                count[(number * CELLS as f64) as usize] += 1.0;
            }
        }
        let expected = DRAWS as f64 / CELLS as f64;
        for count in counts {
            let chi2: f64 = count.iter().map(|n| (n - expected).powi(2) / expected).sum();
            // 15 degrees of freedom: 1 in 10^5 beyond 50.
            assert!(chi2 < 50.0, "{chi2}");
        }
    }

    #[test]
    fn pairs_of_points_are_as_far_apart_as_their_numbers_say() {
        // In the first dimension points k and k ^ 1 differ in the highest digit, whatever the
        // scrambling, and agree in none of the others but by chance.
        let mut agree = 0;
        for group in 0..4000 {
            let mut sequence = SobolSequence::new(u64::MAX, &mut stream(4, group));
            let [a, b] = [20, 21].map(|k| sequence.point(k).direction[0]);
            assert!((a < 0.5) != (b < 0.5));
            let second = |x: f64| (x * 4.0) as u32 % 2;
            agree += u32::from(second(a) == second(b));
        }
        // 4000 tosses: 2000 ± 32.
        assert!((1840..2160).contains(&agree), "{agree}");
    }

    #[test]
    fn series_are_sine_and_cosine() {
        for k in -1000..=1000 {
            let angle = f64::from(k) * 1e-3 * std::f64::consts::FRAC_PI_4;
            let (sin, cos) = eighth(angle);
            assert!((sin - angle.sin()).abs() < 2.5e-16 && (cos - angle.cos()).abs() < 2.5e-16);
        }
    }

    #[test]
    fn the_map_to_the_disc_keeps_areas() {
        // Within the unit circle, continuous across the diagonals, and a square of a quarter of the
        // area becomes a disc of a quarter.
        let mut sequence = SobolSequence::new(u64::MAX, &mut stream(5, 0));
        let mut inside = 0;
        for k in 0..1 << 12 {
            let at = sequence.point(k).direction;
            let (x, y) = concentric(at);
            let square = at.map(|u| (2.0 * u - 1.0).abs());
            assert!((x.hypot(y) - square[0].max(square[1])).abs() < 1e-15);
            inside += u32::from(x.atan2(y).abs() < 1.0 && x.hypot(y) < 0.8);
        }
        let share = f64::from(inside) / 4096.0;
        let expected = 0.64 / std::f64::consts::PI;
        assert!((share - expected).abs() < 0.01, "{share} {expected}");
        for side in [0.3, 0.7] {
            let (a, b) = (concentric([side, 0.3]), concentric([side, 0.3 + 1e-12]));
            assert!((a.0 - b.0).hypot(a.1 - b.1) < 1e-11);
        }
        assert_eq!(concentric([0.5, 0.5]), (0.0, 0.0));
    }
}
