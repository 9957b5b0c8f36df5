// SPDX-License-Identifier: MIT OR Apache-2.0
//! The number of kx in a Brillouin zone.
//!
//! In: the rows of a hemisphere at an even number of kx to a zone. Out: an estimate of the
//! interpolation error in kx of the transmitted hemispherical flux, and the lines half-way between
//! until it is below the tolerance.
//!
//! Every second kx is a grid of its own, half as dense, so that the estimate costs nothing: the
//! difference of the whole grid from its half, as sum over ky or as root of the squares, whichever
//! is more. A part of it is the error: with 2 to 16 kx to a zone against many more, on periods of
//! 0.6 to 11 µm, 0.1 to 0.61 of it.

use super::{GridRequest, KyRow, kind_and_transmittance};
use crate::error::{Error, Limit};
use crate::hemisphere::{Incidence, Interface, Resolution};
use std::f64::consts::PI;

/// Part of the difference to half as many kx that remains as error.
const LEFT: f64 = 0.7;

/// Adds lines of kx to all rows until the tolerance is met, if the request asks for it; `between`
/// solves those half-way between the present ones. Returns the number of kx, and the estimate.
pub(super) fn refined(
    interface: &Interface,
    request: &GridRequest,
    all: &mut [KyRow],
    resolution: &Resolution,
    mut between: impl FnMut() -> Result<Vec<KyRow>, Error>,
) -> Result<(usize, Option<f64>), Error> {
    let mut kx_per_zone = request.kx_per_zone;
    loop {
        let left = left(interface, all, kx_per_zone);
        let (Some(estimate), Some(max)) = (left, request.max_kx) else {
            return Ok((kx_per_zone, left));
        };
        if estimate <= request.tolerance {
            return Ok((kx_per_zone, left));
        }
        if 2 * kx_per_zone > max {
            let tolerance = request.tolerance;
            return Err(resolution.not_converged(Limit::Kx, tolerance, tolerance, estimate));
        }
        kx_per_zone *= 2;
        for (row, added) in all.iter_mut().zip(between()?) {
            let before = std::mem::take(&mut row.incidences);
            let doubled = before.into_iter().map(|i| Incidence { kx_index: 2 * i.kx_index, ..i });
            row.incidences = doubled.chain(added.incidences).collect();
        }
    }
}

/// Estimate of the error from the difference between all kx and every second one.
fn left(interface: &Interface, all: &[KyRow], kx_per_zone: usize) -> Option<f64> {
    if !kx_per_zone.is_multiple_of(2) {
        return None;
    }
    let last = interface.n_top.re.max(interface.n_bottom.re);
    let at = |j: usize| all.get(j).map_or(last, |row| row.ky);
    // Of each kind of light: sum and sum of squares.
    let mut totals = [[0.0_f64; 2]; 4];
    for (j, row) in all.iter().enumerate() {
        let lower = if j == 0 { 0.0 } else { 0.5 * (at(j - 1) + row.ky) };
        let upper = if j + 1 == all.len() { last } else { 0.5 * (row.ky + at(j + 1)) };
        let steps = steps(&row.incidences);
        for (kind, (total, step)) in totals.iter_mut().zip(steps).enumerate() {
            let n = [interface.n_top.re, interface.n_bottom.re][kind / 2];
            let part = 4.0 * row.widths[kind / 2] * (upper - lower) / (PI * n * n);
            total[0] += part * step;
            total[1] += (part * step).powi(2);
        }
    }
    let largest =
        totals.iter().map(|[sum, squares]| sum.abs().max(squares.sqrt())).fold(0.0, f64::max);
    Some(LEFT * largest)
}

/// Mean transmittance over all kx, less that over every second one: from the top in s and p,
/// from the bottom in s and p.
fn steps(incidences: &[Incidence]) -> [f64; 4] {
    // Sum and number, of even and of odd kx.
    let mut sums = [[[0.0_f64; 2]; 2]; 4];
    for incidence in incidences {
        let (kind, transmitted) = kind_and_transmittance(incidence);
        let sum = &mut sums[kind][incidence.kx_index.rem_euclid(2) as usize];
        sum[0] += transmitted;
        sum[1] += 1.0;
    }
    // Where no kx of one half carries light, that half knows of none.
    let mean = |[sum, count]: [f64; 2]| sum / count.max(1.0);
    sums.map(|[even, odd]| {
        let all = [even[0] + odd[0], even[1] + odd[1]];
        mean(all) - mean(even)
    })
}
