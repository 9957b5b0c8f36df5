// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices of every order over the hemispheres on both sides.
//!
//! In: the arguments of [`hemisphere`](super::hemisphere()), for an interface that needs no
//! extrapolation (amplitudes of two runs have phases of their own). Out: for every node of
//! incidence with ky ≥ 0 and every order that leaves, the matrix between waves of unit power
//! through z = const, |element|² being an efficiency, in the bases of
//! `docs/explanation/conventions.md`. Nodes at -kx follow from reciprocity: reversing all waves
//! transposes the matrix and changes the sign of its elements between s and p, and the mirror y →
//! -y, which takes ky back, changes that sign once more.

use num_complex::Complex64;
use rayon::prelude::*;

use super::{Directions, Interface, Resolution};
use crate::error::Error;
use crate::jones::Matrix;
use crate::progress::Progress;
use crate::real_basis::solve::LineCache;
use crate::scattering::Scattering;
use crate::solve::Line;
use crate::wave::Side;

/// One direction of incidence and the matrices of all orders.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrices {
    /// Half-space that the light comes from.
    pub side: Side,
    /// Number i of its kx node; negative for kx < 0.
    pub kx_index: i64,
    /// Number of its ky node.
    pub ky_index: usize,
    /// (side, order relative to its own, rows out by columns in, s before p, between waves of unit
    /// power).
    pub orders: Vec<(Side, i32, Matrix)>,
}

/// Jones matrices of an interface for all directions; `None` if its efficiencies are extrapolated from
/// two runs.
///
/// # Errors
/// The errors of [`hemisphere`](super::hemisphere()).
pub fn hemisphere_matrices(
    interface: &Interface,
    directions: &Directions,
    resolution: &Resolution,
    progress: &Progress<'_>,
) -> Result<Option<Vec<Matrices>>, Error> {
    interface.check_orders(resolution.truncation)?;
    let (stack, None) = interface.stacks(resolution)? else {
        return Ok(None);
    };
    let lines: Vec<i64> = directions.lines().collect();
    let solved: Vec<Vec<Matrices>> = lines
        .into_par_iter()
        .map(|line| {
            let problems = Line::new(&stack, resolution.truncation, progress);
            let run = directions.solve(line, problems, &mut LineCache::none())?;
            Ok(collect(&run, line, directions))
        })
        .collect::<Result<_, Error>>()?;
    Ok(Some(solved.into_iter().flatten().collect()))
}

fn transposed(matrix: &Matrix) -> Matrix {
    [0, 1].map(|row| [0, 1].map(|column| matrix[column][row]))
}

fn collect(run: &[Scattering], line: i64, directions: &Directions) -> Vec<Matrices> {
    let mut all = Vec::new();
    let node = |m: i32| line + directions.kx_per_zone as i64 * i64::from(m);
    for (ky_index, scattering) in run.iter().enumerate() {
        let matrix = |from, to| {
            scattering
                .jones(from, to)
                .map_or([[Complex64::ZERO; 2]; 2], |jones| jones.power_normalised())
        };
        for side in Side::BOTH {
            for m in scattering.sources(side) {
                let (mut direct, mut reciprocal) = (Vec::new(), Vec::new());
                for other in Side::BOTH {
                    for n in scattering.orders(other) {
                        direct.push((other, n - m, matrix((side, m), (other, n))));
                        if scattering.source(other, n).is_some() {
                            let back = transposed(&matrix((other, n), (side, m)));
                            reciprocal.push((other, m - n, back));
                        }
                    }
                }
                let mut push = |kx_index, orders| {
                    all.push(Matrices { side, kx_index, ky_index, orders });
                };
                push(node(m), direct);
                if directions.mirrored(line).is_none() {
                    push(directions.mirror(node(m)), reciprocal);
                }
            }
        }
    }
    all
}
