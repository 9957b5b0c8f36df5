// SPDX-License-Identifier: MIT OR Apache-2.0
//! Real functions of a line: cosines and sines, those of one parity, or orders about a centre of
//! symmetry.

use super::{Expansion, FieldGroup};
use crate::linalg::RMat;
use crate::orders::SymmetricBloch;
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};
use std::ops::Range;

/// The shape of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FunctionKind {
    /// √2 cos κx, or 1 where κ = 0.
    Cosine,
    /// √2 sin κx.
    Sine,
    /// exp(i κx).
    Order,
}

/// One function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RealFunction {
    pub(crate) shape: FunctionKind,
    /// κ in units of k0; of orders with its sign.
    pub(crate) kappa: f64,
    /// Twice κ in units of 2π over the period; of orders twice their number.
    twice: i64,
}

impl RealFunction {
    /// κ in units of 2π over the period; of orders their number.
    pub(crate) fn periods(self) -> f64 {
        0.5 * self.twice as f64
    }

    /// The factor of cosines and sines.
    fn scale(self) -> f64 {
        if self.twice == 0 { 1.0 } else { SQRT_2 }
    }

    /// Value at a distance from the origin, in periods; of orders the cosine.
    fn at(self, x: f64) -> f64 {
        let (sin, cos) = (TAU * self.periods() * x).sin_cos();
        self.scale() * if self.shape == FunctionKind::Sine { sin } else { cos }
    }
}

/// The set of functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FunctionSet {
    /// All cosines, then all sines, for X and for Z.
    Standing,
    /// Cosines for X and sines for Z, or the reverse.
    Parity,
    /// The orders, for X and for Z.
    FourierOrders,
}

/// The functions of X and those of Z.
#[derive(Clone, Debug)]
pub(crate) struct RealFunctions {
    pub(crate) kind: FunctionSet,
    /// Their origin, a fraction of the period.
    pub(crate) origin: f64,
    x: Vec<RealFunction>,
    z: Vec<RealFunction>,
    /// The derivative of each function of X: its place in Z and its factor.
    slopes: Vec<Option<(usize, f64)>>,
    reach: usize,
}

impl RealFunctions {
    fn new(kind: FunctionSet, origin: f64, [x, z]: [Vec<RealFunction>; 2], reach: usize) -> Self {
        // ∂ √2cos κx = -κ √2sin κx, ∂ √2sin κx = κ √2cos κx.
        let slope = |wave: &RealFunction| {
            let (shape, factor) = match wave.shape {
                FunctionKind::Cosine => (FunctionKind::Sine, -wave.kappa),
                FunctionKind::Sine => (FunctionKind::Cosine, wave.kappa),
                FunctionKind::Order => (FunctionKind::Order, wave.kappa),
            };
            let place = z.iter().position(|w| w.shape == shape && w.twice == wave.twice);
            place.map(|place| (place, factor))
        };
        Self { kind, origin, slopes: x.iter().map(slope).collect(), x, z, reach }
    }

    /// Cosines and sines of the orders ±κ of a self-mirror line, about 0.
    pub(crate) fn standing(at: SymmetricBloch, highest: usize, period_per_wavelength: f64) -> Self {
        let odd = match at {
            SymmetricBloch::Centre => 0,
            SymmetricBloch::Edge => 1,
        };
        let wave = |shape| {
            move |m: i64| RealFunction {
                shape,
                kappa: 0.5 * (2 * m + odd) as f64 / period_per_wavelength,
                twice: 2 * m + odd,
            }
        };
        let highest = highest as i64;
        let cosines = (0..=highest).map(wave(FunctionKind::Cosine));
        let sines = (1 - odd..=highest).map(wave(FunctionKind::Sine));
        let waves: Vec<RealFunction> = cosines.chain(sines).collect();
        let reach = (2 * highest + odd) as usize;
        Self::new(FunctionSet::Standing, 0.0, [waves.clone(), waves], reach)
    }

    /// Of all standing waves: those of either parity about a centre.
    pub(crate) fn parities(&self, centre: f64) -> [Self; 2] {
        self.halves().map(|[x, z]| {
            let waves = [self.x[x].to_vec(), self.z[z].to_vec()];
            Self::new(FunctionSet::Parity, centre, waves, self.reach)
        })
    }

    /// Places of either parity among all standing waves: of X and of Z.
    pub(crate) fn halves(&self) -> [[Range<usize>; 2]; 2] {
        let cosines = self.x.partition_point(|w| w.shape == FunctionKind::Cosine);
        let (even, odd) = (0..cosines, cosines..self.x.len());
        [[even.clone(), odd.clone()], [odd, even]]
    }

    /// Orders with these kx, the middle one of which is order 0, about a centre.
    pub(crate) fn orders(kx: &[f64], centre: f64) -> Self {
        let middle = (kx.len() / 2) as i64;
        let wave = |(m, &kappa): (usize, &f64)| RealFunction {
            shape: FunctionKind::Order,
            kappa,
            twice: 2 * (m as i64 - middle),
        };
        let waves: Vec<RealFunction> = kx.iter().enumerate().map(wave).collect();
        let reach = kx.len() - 1;
        Self::new(FunctionSet::FourierOrders, centre, [waves.clone(), waves], reach)
    }

    pub(crate) fn functions_of(&self, field: FieldGroup) -> &[RealFunction] {
        match field {
            FieldGroup::X => &self.x,
            FieldGroup::Z => &self.z,
        }
    }

    /// The largest κ.
    pub(crate) fn steepest(&self) -> f64 {
        self.x.iter().fold(0.0, |most, w| most.max(w.kappa))
    }

    /// The orders ±κ of standing waves and their kx, ascending.
    pub(crate) fn pairs(&self, at: SymmetricBloch) -> Vec<(i32, f64)> {
        let cosines = self.x.iter().filter(|w| w.shape == FunctionKind::Cosine);
        let (odd, numbered) = (i32::from(at == SymmetricBloch::Edge), cosines.zip(0..));
        let mut orders: Vec<(i32, f64)> = numbered
            .flat_map(|(wave, m)| {
                let pair = (wave.twice != 0).then_some((-m - odd, -wave.kappa));
                std::iter::once((m, wave.kappa)).chain(pair)
            })
            .collect();
        orders.sort_by_key(|o| o.0);
        orders
    }

    /// The derivative of a function of X: its place in Z and its factor.
    pub(crate) fn slope(&self, place: usize) -> Option<(usize, f64)> {
        self.slopes[place]
    }

    /// The place in X whose slope is a function of Z, and its factor.
    pub(crate) fn slope_to(&self, place: usize) -> Option<(usize, f64)> {
        self.slopes.iter().enumerate().find_map(|(from, slope)| {
            slope.and_then(|(to, factor)| (to == place).then_some((from, factor)))
        })
    }

    /// Transpose of [`Expansion::derivative`]: from Z to X.
    pub(crate) fn derivative_transposed(&self, m: &RMat) -> RMat {
        let mut out = Mat::zeros(self.x.len(), m.ncols());
        for j in 0..m.ncols() {
            let (to, from) = (out.col_as_slice_mut(j), m.col_as_slice(j));
            for (to, slope) in to.iter_mut().zip(&self.slopes) {
                *to = slope.map_or(0.0, |(place, factor)| factor * from[place]);
            }
        }
        out
    }

    /// Standing waves about `centre` as standing waves about the origin.
    pub(crate) fn moved(&self, m: &RMat, centre: f64) -> RMat {
        let mut out = m.clone();
        for (i, wave) in self.x.iter().enumerate() {
            let Some((sine, _)) = self.slope(i).filter(|_| wave.shape == FunctionKind::Cosine)
            else {
                continue;
            };
            let (sin, cos) = (TAU * wave.periods() * centre).sin_cos();
            for j in 0..m.ncols() {
                let (c, s) = (m[(i, j)], m[(sine, j)]);
                out[(i, j)] = cos * c - sin * s;
                out[(sine, j)] = sin * c + cos * s;
            }
        }
        out
    }
}

/// Element of the product with a real function of coefficients c, c(n) at place n + reach, between
/// two functions.
fn element(a: RealFunction, b: RealFunction, c: &[Complex64], mixes: bool) -> f64 {
    let reach = (c.len() - 1) as i64 / 2;
    let at = |twice: i64| c[(reach + twice / 2) as usize];
    let difference = at(a.twice - b.twice);
    if a.shape == FunctionKind::Order {
        // The product from X to Z is odd about the centre, and Z is counted in units of i.
        return if mixes { difference.im } else { difference.re };
    }
    let sum = at(a.twice + b.twice);
    let value = match (a.shape == FunctionKind::Sine, b.shape == FunctionKind::Sine) {
        (false, false) => difference.re + sum.re,
        (true, true) => difference.re - sum.re,
        (false, true) => difference.im - sum.im,
        (true, false) => -difference.im - sum.im,
    };
    let scale = |wave: RealFunction| if wave.twice == 0 { FRAC_1_SQRT_2 } else { 1.0 };
    value * scale(a) * scale(b)
}

impl Expansion<f64> for RealFunctions {
    fn count(&self, of: FieldGroup) -> usize {
        self.functions_of(of).len()
    }

    fn reach(&self) -> usize {
        self.reach
    }

    fn origin(&self) -> f64 {
        self.origin
    }

    fn multiplication(&self, to: FieldGroup, from: FieldGroup, c: &[Complex64]) -> RMat {
        let (rows, columns) = (self.functions_of(to), self.functions_of(from));
        Mat::from_fn(rows.len(), columns.len(), |i, j| element(rows[i], columns[j], c, to != from))
    }

    fn adjoint_sign(&self) -> Option<f64> {
        match self.kind {
            FunctionSet::Standing => Some(1.0),
            FunctionSet::Parity => None,
            FunctionSet::FourierOrders => Some(-1.0),
        }
    }

    fn derivative(&self, m: &RMat) -> RMat {
        let mut out = Mat::zeros(self.z.len(), m.ncols());
        for j in 0..m.ncols() {
            let (to, from) = (out.col_as_slice_mut(j), m.col_as_slice(j));
            for (from, slope) in from.iter().zip(&self.slopes) {
                if let Some((place, factor)) = slope {
                    to[*place] = factor * from;
                }
            }
        }
        out
    }

    fn point_values(&self, x: f64) -> Vec<Vec<f64>> {
        let beside = x - self.origin;
        match self.kind {
            FunctionSet::Standing => vec![self.z.iter().map(|w| w.at(beside)).collect()],
            // x and its mirror image together.
            FunctionSet::Parity => vec![self.z.iter().map(|w| SQRT_2 * w.at(beside)).collect()],
            FunctionSet::FourierOrders => {
                let phases = self.z.iter().map(|w| TAU * w.periods() * beside);
                let (sines, cosines) =
                    phases.map(f64::sin_cos).map(|(sin, cos)| (SQRT_2 * sin, SQRT_2 * cos)).unzip();
                vec![sines, cosines]
            }
        }
    }

    fn counts_mirror_image(&self) -> bool {
        self.kind != FunctionSet::Standing
    }

    fn random_vector(&self, column: usize, number: &mut dyn FnMut() -> f64) -> Vec<f64> {
        if self.kind == FunctionSet::FourierOrders {
            // Even in X and odd in Z, or the reverse: reversal of k leaves the span of all.
            let half = self.reach / 2;
            let sign = if column.is_multiple_of(2) { 1.0 } else { -1.0 };
            let mut both = vec![0.0; 2 * (self.reach + 1)];
            for (c, sign) in both.chunks_mut(self.reach + 1).zip([sign, -sign]) {
                for i in 1..=half {
                    let value = number();
                    (c[half + i], c[half - i]) = (value, sign * value);
                }
                let middle = number();
                c[half] = if sign > 0.0 { middle } else { 0.0 };
            }
            return both;
        }
        // The same functions as in orders: c exp(-iκx) + c* exp(iκx) = √2 Re c √2cos κx + √2 Im c
        // √2sin κx.
        let each = |waves: &[RealFunction], number: &mut dyn FnMut() -> f64| -> Vec<f64> {
            let mut c = vec![0.0; waves.len()];
            let cosines = waves.partition_point(|w| w.shape == FunctionKind::Cosine);
            let highest = waves.iter().map(|w| w.twice).max().unwrap_or(0);
            for twice in (0..=highest).rev() {
                let places = [FunctionKind::Cosine, FunctionKind::Sine].map(|shape| {
                    let among = match shape {
                        FunctionKind::Sine => cosines..waves.len(),
                        _ => 0..cosines,
                    };
                    let start = among.start;
                    let found = waves[among].binary_search_by_key(&twice, |w| w.twice);
                    found.ok().map(|i| start + i)
                });
                for place in places.into_iter().flatten() {
                    c[place] = waves[place].scale() * number();
                }
            }
            c
        };
        let mut both = each(&self.x, number);
        both.extend(each(&self.z, number));
        both
    }

    fn step_factors(&self) -> (f64, f64) {
        (1.0, -1.0)
    }
}
