// SPDX-License-Identifier: MIT OR Apache-2.0
//! The adaptive grid of incidence of a table: intervals of ky are bisected where linear
//! interpolation is worst, and nodes of kx doubled, until the reflected hemispherical flux is
//! known.
//!
//! In: an interface, kx nodes per zone and ky to begin with, a tolerance. Out: the nodes used, all
//! efficiencies at them, and estimates of the interpolation error in ky and in kx of the
//! hemispherical reflectance, from either side, in s and p. About half of the defect at the middle
//! of an interval is left when it is bisected, since efficiencies bend most at cut-offs, as square
//! roots. The estimate states one and a half times that, since defects are a sample of those of
//! grids at other places.

use crate::cost_model::cache_per_line;
use crate::error::{Error, Limit};
use crate::hemisphere::{BlochLines, Directions, Hemisphere, Incidence, Interface, Resolution};
use crate::progress::Progress;
use crate::wave::Side;
use std::f64::consts::PI;

mod kx_refinement;

/// The request for a grid of incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct GridRequest {
    /// Nodes of kx in one Brillouin zone, ≥ 1; those to begin with if they are chosen by error, and
    /// then an even number.
    pub kx_per_zone: usize,
    /// Largest number of nodes of kx, if they are chosen by error.
    pub max_kx: Option<usize>,
    /// ky to begin with: ascending, at least two; in units of k0.
    pub ky: Vec<f64>,
    /// ky between which nothing is interpolated, the lower index.
    pub critical_ky: f64,
    /// Error allowed in the hemispherical efficiencies.
    pub tolerance: f64,
    /// Largest number of ky.
    pub max_ky: usize,
}

/// A hemisphere on a grid chosen by error.
#[derive(Clone, Debug)]
pub struct AdaptiveHemisphere {
    /// The directions used; ky ascending.
    pub directions: Directions,
    /// Efficiencies, `ky_index` counting in `directions`.
    pub solved: Hemisphere,
    /// Estimated error of the hemispherical efficiencies by interpolation in ky.
    pub grid_error: f64,
    /// The same by interpolation in kx; none for an odd number of nodes in the zone, of which no
    /// half is a grid of its own.
    pub kx_error: Option<f64>,
}

/// One ky and its solution.
struct KyRow {
    ky: f64,
    incidences: Vec<Incidence>,
    /// Mean transmittance: from the top in s and p, from the bottom in s and p; 0 where nothing
    /// comes from that side.
    means: [f64; 4],
    /// Half the width in kx of each side at this ky.
    widths: [f64; 2],
    /// Defects of the interpolation between its neighbours when it was added, for each of the
    /// means, times their weight as parts of a hemisphere; 0 for those at the start.
    defects: [f64; 4],
}

/// Solves an interface on ky chosen by error.
///
/// # Errors
/// The errors of the hemisphere's solution; [`Error::NotConverged`] if `max_ky` or `max_kx` are too
/// few.
pub fn solve_adaptive(
    interface: &Interface,
    request: &GridRequest,
    resolution: &Resolution,
    progress: &Progress<'_>,
) -> Result<AdaptiveHemisphere, Error> {
    // Those to begin with and the middles between them in one go: they share the modes of their
    // lines.
    let begin = &request.ky;
    let middles: Vec<f64> = begin.windows(2).filter_map(|w| middle(request, w[0], w[1])).collect();
    let mut both = [begin.as_slice(), &middles].concat();
    both.sort_by(f64::total_cmp);
    let first = Directions { kx_per_zone: request.kx_per_zone, ky: both };
    let bytes = cache_per_line(&first, resolution) as usize;
    let mut lines = BlochLines::new(interface, &first, resolution, bytes)?;
    let mut worst_balance = 0.0_f64;
    let mut problems = 0;
    let mut solve = |lines: &mut BlochLines, ky: &[f64]| -> Result<Vec<KyRow>, Error> {
        let solved = lines.solve(ky, progress)?;
        worst_balance = worst_balance.max(solved.worst_balance);
        problems += solved.problems;
        Ok(rows(interface, ky, solved))
    };
    let (mut all, mut added): (Vec<KyRow>, Vec<KyRow>) =
        solve(&mut lines, &first.ky)?.into_iter().partition(|row| begin.contains(&row.ky));
    loop {
        for mut row in added {
            let at = all.partition_point(|r| r.ky < row.ky);
            row.defects = defects(interface, &all[at - 1], &row, &all[at]);
            all.insert(at, row);
        }
        let grid_error = left(&all);
        if grid_error <= request.tolerance {
            let ky: Vec<f64> = all.iter().map(|r| r.ky).collect();
            let (kx_per_zone, kx_error) =
                kx_refinement::refined(interface, request, &mut all, resolution, || {
                    lines.refine_kx();
                    solve(&mut lines, &ky)
                })?;
            let incidences = all
                .into_iter()
                .enumerate()
                .flat_map(|(ky_index, row)| {
                    row.incidences.into_iter().map(move |i| Incidence { ky_index, ..i })
                })
                .collect();
            let solved = Hemisphere { incidences, worst_balance, problems };
            return Ok(AdaptiveHemisphere {
                directions: Directions { kx_per_zone, ky },
                solved,
                grid_error,
                kx_error,
            });
        }
        // The two halves of the worst intervals, until so little would be left that the new defects
        // may add some.
        let largest = |row: &KyRow| row.defects.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
        let mut worst: Vec<usize> = (0..all.len()).filter(|&i| largest(&all[i]) > 0.0).collect();
        worst.sort_by(|&a, &b| largest(&all[b]).total_cmp(&largest(&all[a])));
        let mut next = Vec::new();
        for i in worst {
            if left(&all) < 0.6 * request.tolerance {
                break;
            }
            next.extend(middle(request, all[i - 1].ky, all[i].ky));
            next.extend(middle(request, all[i].ky, all[i + 1].ky));
            all[i].defects = [0.0; 4];
        }
        next.sort_by(f64::total_cmp);
        next.dedup();
        if next.is_empty() || all.len() + next.len() > request.max_ky {
            let tolerance = request.tolerance;
            return Err(resolution.not_converged(Limit::Ky, tolerance, tolerance, grid_error));
        }
        added = solve(&mut lines, &next)?;
    }
}

/// The ky half-way between two, unless the critical one lies between them.
fn middle(request: &GridRequest, a: f64, b: f64) -> Option<f64> {
    let apart = a < request.critical_ky && b >= request.critical_ky;
    (!apart).then_some(0.5 * (a + b))
}

/// Deviation of each of the four fluxes through `row` from the interpolation between its
/// neighbours, over the interval between them, as a part of the hemisphere's.
fn defects(interface: &Interface, before: &KyRow, row: &KyRow, after: &KyRow) -> [f64; 4] {
    let weight = 0.5 * (after.ky - before.ky);
    std::array::from_fn(|i| {
        let n = [interface.n_top.re, interface.n_bottom.re][i / 2];
        let expected = 0.5 * (before.means[i] + after.means[i]);
        // Both signs of kx, both of ky.
        let part = 4.0 * row.widths[i / 2] * weight / (PI * n * n);
        part * (row.means[i] - expected)
    })
}

/// Part of the defects that may be left after bisection.
const LEFT: f64 = 0.75;

/// Estimate of the defects left after bisection. Their signs are partly random and partly the bend
/// of the curves, so that their sum and the root of their squares both count.
fn left(rows: &[KyRow]) -> f64 {
    (0..4)
        .map(|i| {
            let sum: f64 = rows.iter().map(|r| r.defects[i]).sum();
            let squares: f64 = rows.iter().map(|r| r.defects[i].powi(2)).sum();
            LEFT * (sum.abs() + squares.sqrt())
        })
        .fold(0.0, f64::max)
}

/// Place of an incidence in arrays of kinds of light (from the top in s and p, from the bottom in s
/// and p), and its transmittance.
fn kind_and_transmittance(incidence: &Incidence) -> (usize, f64) {
    let through = incidence.efficiencies.iter().filter(|s| s.0 == Side::Bottom);
    (2 * incidence.side.number() + incidence.pol.number(), through.map(|s| s.2).sum())
}

fn rows(interface: &Interface, ky: &[f64], solved: Hemisphere) -> Vec<KyRow> {
    let width = |n: f64, ky: f64| (n * n - ky * ky).max(0.0).sqrt();
    let mut rows: Vec<KyRow> = ky
        .iter()
        .map(|&ky| KyRow {
            ky,
            incidences: Vec::new(),
            means: [0.0; 4],
            widths: [width(interface.n_top.re, ky), width(interface.n_bottom.re, ky)],
            defects: [0.0; 4],
        })
        .collect();
    let mut counts = vec![[0_u32; 4]; rows.len()];
    for incidence in solved.incidences {
        let (kind, transmitted) = kind_and_transmittance(&incidence);
        let row = &mut rows[incidence.ky_index];
        row.means[kind] += transmitted;
        counts[incidence.ky_index][kind] += 1;
        row.incidences.push(incidence);
    }
    for (row, counts) in rows.iter_mut().zip(counts) {
        for (mean, count) in row.means.iter_mut().zip(counts) {
            *mean /= f64::from(count.max(1));
        }
    }
    rows
}
