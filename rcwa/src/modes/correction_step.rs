// SPDX-License-Identifier: MIT OR Apache-2.0
//! The flow of M(z) - M₀ at one node of a slice (4.1): strips along the sides, and walls that are
//! not vertical.
//!
//! Half of the strips acts before the walls and half after. Where ky is not 0 the two do not
//! commute, and one after the other leaves an error that falls only as the square of the height of
//! a slice (on the step of ring 75 by 40 slices, six times as much as this way).

use super::normal_vector::{NormalVectorFlow, VerticalLayer};
use super::strips::StripFlow;
use crate::error::Error;
use crate::expansion::Expansion;
use crate::linalg::{Accum, Scalar, combined, mul, product};
use crate::relief::WallCorrection;
use faer::Mat;
use faer::prelude::ReborrowMut;

/// A change of coordinates of small rank at one height of a layer.
///
/// Strips add e P W to h, with P = (-ky P₁; P₀) and W = (-ky W₁, W₀). Walls add g E to e and g M to
/// h, with g = (e X + h H) φ. Strips, walls and strips again are then e + g E and h + (2 e P + ky g
/// K) W + g M with g = (e X + h H + ky e P L) φ, where L and K are small.
#[derive(Clone, Debug)]
pub(crate) struct CorrectionStep<T> {
    /// Height above the bottom of the layer, in units of its thickness.
    pub(crate) place: f64,
    /// Number of columns of strips.
    strips: usize,
    /// P₁ beside X, by ex.
    by_ex: Mat<T>,
    /// P₀, by ey.
    by_ey: Mat<T>,
    /// H by hy, and by ky hx.
    by_hy: Mat<T>,
    by_hx: Mat<T>,
    /// W₁ above M, to hy.
    to_hy: Mat<T>,
    /// W₀, to hx.
    to_hx: Mat<T>,
    /// E to ex, and, times ky, to ey.
    to_ex: Mat<T>,
    to_ey: Mat<T>,
    /// L, φ and K.
    onward: Mat<T>,
    gains: Mat<T>,
    back: Mat<T>,
}

impl<T: Scalar> CorrectionStep<T> {
    /// Of a section with the weight `d` (times k0), in the coordinates of a layer.
    pub(crate) fn new(
        expansion: &impl Expansion<T>,
        section: &WallCorrection,
        vertical: &VerticalLayer<'_, T>,
        d: f64,
    ) -> Result<Self, Error> {
        let walls = NormalVectorFlow::new(expansion, section, vertical, d)?;
        let basis = vertical.basis();
        let strips = StripFlow::new(expansion, &section.strips, basis, 0.5 * d);
        let sizes = [basis.g.nrows(), basis.f.nrows()];
        Ok(Self::from_flows(
            section.place,
            strips.unwrap_or_else(|| StripFlow::none(sizes)),
            walls.unwrap_or_else(|| NormalVectorFlow::none(sizes)),
        ))
    }

    /// Step of strips over half the height, twice, and walls between.
    pub(super) fn from_flows(place: f64, strips: StripFlow<T>, walls: NormalVectorFlow<T>) -> Self {
        let [electric, magnetic] = walls.steps;
        let scaled = |m: &Mat<T>, by: T| Mat::from_fn(m.nrows(), m.ncols(), |i, j| by * m[(i, j)]);
        let StripFlow { reads: [p0, p1], writes: [w0, w1] } = strips;
        let NormalVectorFlow {
            reads: [ex, hy, hx],
            writes: [from_ex, from_hy, from_hx],
            gains,
            ..
        } = walls;
        let (to_ex, to_ey) = (scaled(&from_hy, electric), scaled(&from_hx, electric));
        let (points, rank) = (p0.ncols(), gains.nrows());
        Self {
            place,
            strips: points,
            onward: combined(&mul(&w0, &hx), &mul(&w1, &hy), -1.0),
            back: combined(&mul(&to_ey, &p0), &mul(&to_ex, &p1), -1.0),
            by_ex: Mat::from_fn(ex.nrows(), points + rank, |i, j| {
                j.checked_sub(points).map_or_else(|| p1[(i, j)], |j| ex[(i, j)])
            }),
            by_ey: p0,
            by_hy: hy,
            by_hx: hx,
            to_hy: Mat::from_fn(points + rank, w1.ncols(), |i, j| {
                i.checked_sub(points).map_or_else(|| w1[(i, j)], |i| magnetic * from_ex[(i, j)])
            }),
            to_hx: w0,
            to_ex,
            to_ey,
            gains,
        }
    }

    /// Adds the correction to fields with a row for each parameter.
    pub(crate) fn add(&self, e: &mut Mat<T>, h: &mut Mat<T>, ky: f64) {
        if e.nrows() == 0 || self.by_ex.ncols() == 0 {
            return;
        }
        let taken = self.taken(e, h, ky);
        let (strips, walls) = taken.as_ref().split_at_col(self.strips);
        let by_ky = T::ONE.scaled(ky);
        let mut given: Mat<T> = Mat::zeros(taken.nrows(), taken.ncols());
        let (mut to_strips, mut to_walls) = given.as_mut().split_at_col_mut(self.strips);
        let (gains, back) = (self.gains.as_ref(), self.back.as_ref());
        product(to_walls.rb_mut(), Accum::Replace, T::ONE, walls, gains);
        let to_walls = to_walls.as_ref();
        product(to_strips.rb_mut(), Accum::Replace, by_ky, to_walls, back);
        for j in 0..self.strips {
            for i in 0..strips.nrows() {
                to_strips[(i, j)] += strips[(i, j)].scaled(2.0);
            }
        }
        self.give(&mut given, e, h, ky);
    }

    /// e P beside e X + h H + ky e P L.
    fn taken(&self, e: &Mat<T>, h: &Mat<T>, ky: f64) -> Mat<T> {
        let (one, by_ky) = (T::ONE, T::ONE.scaled(ky));
        let (ex, ey) = e.as_ref().split_at_col(self.by_ex.nrows());
        let (hy, hx) = h.as_ref().split_at_col(self.by_ex.nrows());
        let mut taken: Mat<T> = Mat::zeros(e.nrows(), self.by_ex.ncols());
        product(taken.as_mut(), Accum::Replace, one, ex, self.by_ex.as_ref());
        scale(&mut taken, self.strips, -ky);
        let (mut strips, mut walls) = taken.as_mut().split_at_col_mut(self.strips);
        product(strips.rb_mut(), Accum::Add, one, ey, self.by_ey.as_ref());
        let onward = self.onward.as_ref();
        product(walls.rb_mut(), Accum::Add, one, hy, self.by_hy.as_ref());
        product(walls.rb_mut(), Accum::Add, by_ky, hx, self.by_hx.as_ref());
        product(walls, Accum::Add, by_ky, strips.as_ref(), onward);
        taken
    }

    /// Adds the outputs `given` to fields: columns of strips, then of walls.
    fn give(&self, given: &mut Mat<T>, e: &mut Mat<T>, h: &mut Mat<T>, ky: f64) {
        let (one, by_ky) = (T::ONE, T::ONE.scaled(ky));
        let (ex, ey) = e.as_mut().split_at_col_mut(self.by_ex.nrows());
        let (hy, hx) = h.as_mut().split_at_col_mut(self.by_ex.nrows());
        let (strips, walls) = given.as_ref().split_at_col(self.strips);
        product(ex, Accum::Add, one, walls, self.to_ex.as_ref());
        product(ey, Accum::Add, by_ky, walls, self.to_ey.as_ref());
        product(hx, Accum::Add, one, strips, self.to_hx.as_ref());
        scale(given, self.strips, -ky);
        product(hy, Accum::Add, one, given.as_ref(), self.to_hy.as_ref());
    }
}

/// The first `count` columns, scaled.
fn scale<T: Scalar>(m: &mut Mat<T>, count: usize, by: f64) {
    for j in 0..count {
        for x in m.col_as_slice_mut(j) {
            *x = x.scaled(by);
        }
    }
}
