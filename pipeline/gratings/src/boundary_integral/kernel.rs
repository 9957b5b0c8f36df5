// SPDX-License-Identifier: MIT OR Apache-2.0
//! The single and the double layer of one medium as matrices over the nodes.
//!
//! (S ψ)(x) = ∫ G(x,y) v(y) dl and (D u)(x) = ∫ ∂G(x,y)/∂n(y) u(y) dl with the quasi-periodic
//! Green's function G of the medium; ψ = v |dx/ds| is what is unknown, since it is as smooth as the
//! grading makes it. Near images are summed as (i/4) H0; the nearest in the parameter carries the
//! logarithm, which is split off as -J0(kr)/4π ln(4 sin²((s-t)/2)) \[Kress1991\] within a smooth
//! window, so that the splitting is periodic. In an absorbing medium G decays and J0 grows: there
//! the window ends at [`REACH`] skin depths besides. Far images come from `lattice`.

use super::corner;
use super::cylinder::Cylinder;
use super::lattice::Far;
use super::nodes::{Nodes, logarithmic_weights};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use full_wave::bessel::EULER;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

pub(super) type CMat = Mat<Complex64>;

/// Skin depths, |Im k| r, within which the logarithm is split off.
const REACH: f64 = 8.0;
/// Skin depths beyond which nothing is left.
const GONE: f64 = 40.0;

/// S and D.
pub(super) struct Layers {
    pub single: CMat,
    pub double: CMat,
}

/// What depends on the number of the nodes between two nodes alone.
struct Split {
    /// Weight of the logarithmic part.
    weight: f64,
    /// ln(4 sin²).
    log: f64,
    /// Window.
    window: f64,
}

/// In a medium of index `n` (lengths times k0), with phase `alpha` per length and `far` images.
pub(super) fn layers(nodes: &Nodes, n: Complex64, alpha: f64, far: &Far) -> Layers {
    let count = nodes.list.len();
    let step = TAU / count as f64;
    let splits = splits(count);
    let phases: Vec<(i32, Complex64)> = (1 - far.first..far.first)
        .map(|image| (image, (Complex64::I * alpha * nodes.period * f64::from(image)).exp()))
        .collect();
    let column = |j: usize| -> Vec<[Complex64; 2]> {
        let source = &nodes.list[j];
        let entry = |i: usize| {
            let target = &nodes.list[i];
            let (split, nearest) = nearest(i, j, count);
            let mut sums = [Complex64::ZERO; 2];
            for &(image, phase) in &phases {
                let near = image == nearest;
                let [single, double] = if near && i == j {
                    on_itself(n, source.speed, source.bend, &splits[0], step)
                } else {
                    let [dx, dz] = nodes.difference(target, source, image);
                    let r = dx.hypot(dz);
                    let is_straight = source.side.is_some() && source.bend == 0.0;
                    let level = if image == 0 && is_straight && source.side == target.side {
                        0.0
                    } else {
                        (source.normal[0] * dx + source.normal[1] * dz) / r * source.speed
                    };
                    if n.im * r > GONE {
                        continue;
                    }
                    let local = if near { window(PI * n.im * r / REACH) } else { 0.0 };
                    let Cylinder { h, j } = Cylinder::at(n * r, local > 0.0);
                    let quarter = Complex64::new(0.0, 0.25 * step);
                    let (mut single, mut double) = (quarter * h[0], quarter * n * level * h[1]);
                    if near {
                        let Split { weight, log, window } = &splits[split];
                        let excess = (weight - step * log) * window * local / (4.0 * PI);
                        single -= excess * j[0];
                        double -= excess * n * level * j[1];
                    }
                    [single, double]
                };
                sums[0] += phase * single;
                sums[1] += phase * double;
            }
            sums
        };
        (0..count).map(entry).collect()
    };
    let columns: Vec<Vec<[Complex64; 2]>> = (0..count).into_par_iter().map(column).collect();
    let mut single = Mat::from_fn(count, count, |i, j| columns[j][i][0]);
    let mut double = Mat::from_fn(count, count, |i, j| columns[j][i][1]);
    drop(columns);
    for (i, missed) in corner::missed(nodes).into_iter().enumerate() {
        double[(i, i)] += missed;
    }
    add_far(nodes, far, step, &mut single, &mut double);
    Layers { single, double }
}

/// Adds the far images: a matrix of what the targets read times one of what the sources send.
fn add_far(nodes: &Nodes, far: &Far, step: f64, single: &mut CMat, double: &mut CMat) {
    let (count, waves) = (nodes.list.len(), far.waves.len());
    let places: Vec<[f64; 2]> = nodes.list.iter().map(|n| nodes.place(n)).collect();
    let reads: CMat =
        Mat::from_fn(count, 2 * waves, |i, q| far.reads(&far.waves[q / 2], places[i])[q % 2]);
    let sends = |what: usize| -> CMat {
        Mat::from_fn(2 * waves, count, |q, j| {
            let node = &nodes.list[j];
            let weight = if what == 0 { step } else { step * node.speed };
            weight * far.sources(&far.waves[q / 2], places[j], node.normal)[what][q % 2]
        })
    };
    let add = |into: &mut CMat, sends: MatRef<'_, Complex64>| {
        matmul(into.as_mut(), Accum::Add, reads.as_ref(), sends, Complex64::ONE, Par::Seq);
    };
    add(single, sends(0).as_ref());
    add(double, sends(1).as_ref());
}

/// The limit of both kernels with the weight of a node on itself: G → i/4 - (ln(kr/2) + γ)/2π.
fn on_itself(n: Complex64, speed: f64, bend: f64, split: &Split, step: f64) -> [Complex64; 2] {
    let smooth = -((0.5 * n * speed).ln() + EULER) / TAU;
    let single = step * (smooth + Complex64::new(0.0, 0.25)) - split.weight / (4.0 * PI);
    [single, Complex64::from(step * bend * speed / (4.0 * PI))]
}

/// Steps of the parameter from node j, of the nearest of its images, to node i; and which image
/// that is.
fn nearest(i: usize, j: usize, count: usize) -> (usize, i32) {
    let steps = i.abs_diff(j);
    if 2 * steps <= count { (steps, 0) } else { (count - steps, if i > j { 1 } else { -1 }) }
}

fn splits(count: usize) -> Vec<Split> {
    let weights = logarithmic_weights(count);
    (0..=count / 2)
        .map(|m| {
            let angle = PI * m as f64 / count as f64;
            Split {
                weight: weights[m],
                log: (4.0 * angle.sin().powi(2)).ln(),
                window: window(2.0 * angle),
            }
        })
        .collect()
}

/// 1 at 0, falling to 0 at π, with all derivatives continuous there when mirrored and repeated.
fn window(angle: f64) -> f64 {
    // π itself may come out of rounding on either side.
    let tangent = (angle.min(PI) - FRAC_PI_2).tan();
    1.0 / (1.0 + (3.0 * tangent).exp())
}
