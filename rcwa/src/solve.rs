// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe: orders, modes of each layer, stacking from the bottom up, scattering matrix.

use crate::error::Error;
use crate::modes::{self, Basis, Modes, modes};
use crate::orders::{Bloch, Channel, Side, Truncation, channels, highest_propagating, outgoing_kz};
use crate::relief::Layer;
use crate::scattering::Scattering;
use crate::stack::Stack;
use crate::stack::interface::Interface;
use crate::stack::propagate::propagate;
use crate::stack::state::State;
use num_complex::Complex64;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Told the number of layers just taken in, each counted once for every ky; may say to stop.
pub type Progress<'a> = dyn Fn(usize) -> ControlFlow<()> + Sync + 'a;

/// A [`Progress`] that never stops anything.
pub fn no_progress(_: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Largest |R + T - 1| of a lossless stack, and largest R + T - 1 of an absorbing one.
pub const ENERGY_TOLERANCE: f64 = 1e-10;

/// Layers whose modes are kept in memory together.
const LAYERS_AT_A_TIME: usize = 8;

/// kz that stands for 0 in a half-space. Next to a cut-off kz² moves in steps of round-off, kz in steps of 1e-8.
const BARELY_EVANESCENT: Complex64 = Complex64::new(0.0, 1e-12);

/// Solves one Bloch wavevector: all directions of incidence that share it, from both sides, in s and p.
///
/// # Errors
/// Wavevectors that are not finite, eigenproblems that fail, an energy balance that does not close.
pub fn solve(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Result<Scattering, Error> {
    let mut line = solve_blochs(stack, &[bloch], truncation, &no_progress)?;
    Ok(line.remove(0))
}

/// Solves several ky at one kx0; the modes of the layers are found once for all of them.
///
/// # Errors
/// As [`solve`]; [`Error::Stopped`] if `progress` says so.
pub fn solve_line(
    stack: &Stack,
    kx0: f64,
    ky: &[f64],
    truncation: Truncation,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    let blochs: Vec<Bloch> = ky.iter().map(|&ky| Bloch::new(kx0, ky)).collect();
    solve_blochs(stack, &blochs, truncation, progress)
}

/// Highest order that propagates in either half-space: the least truncation that keeps every order of light.
pub fn highest_order(stack: &Stack, bloch: Bloch) -> usize {
    let of = |side| highest_propagating(stack.index(side), stack.period_per_wavelength(), bloch);
    of(Side::Top).max(of(Side::Bottom))
}

/// One problem of a line: the state so far and what closes it.
struct Problem {
    bloch: Bloch,
    top: Vec<Channel>,
    bottom: Vec<Channel>,
    state: State,
}

/// All `blochs` must share kx0.
fn solve_blochs(
    stack: &Stack,
    blochs: &[Bloch],
    truncation: Truncation,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    let Some(first) = blochs.first() else {
        return Ok(Vec::new());
    };
    if let Some(bad) = blochs
        .iter()
        .find(|b| !(b.kx0.is_finite() && b.ky.is_finite()))
    {
        return Err(Error::Bloch {
            kx0: bad.kx0,
            ky: bad.ky,
        });
    }
    let ratio = stack.period_per_wavelength();
    let kx: Vec<f64> = truncation
        .orders()
        .map(|m| first.kx0 + f64::from(m) / ratio)
        .collect();

    // The bottom half-space.
    let mut problems: Vec<Problem> = blochs
        .iter()
        .map(|&bloch| {
            let of = |side| channels(stack.index(side), ratio, bloch, truncation);
            let (top, bottom) = (of(Side::Top), of(Side::Bottom));
            let n = stack.index(Side::Bottom);
            let state = State::at_bottom(n, &kx, &half_space_kz(n, &kx, bloch.ky), bloch, &bottom);
            Problem {
                bloch,
                top,
                bottom,
                state,
            }
        })
        .collect();

    // Each layer from the bottom up: modes and interface once, then all ky. Some layers at a time, so that modes of
    // several are found side by side and a problem goes through several without waiting for the others.
    let fourier = Basis::fourier(kx.len());
    let mut below = fourier.clone();
    let bottom_up: Vec<&Layer> = stack.layers().iter().rev().collect();
    for some in bottom_up.chunks(LAYERS_AT_A_TIME) {
        let found: Vec<Modes> = some
            .par_iter()
            .map(|layer| modes(layer, &kx))
            .collect::<Result<_, _>>()?;
        let steps: Vec<(Interface, &Modes, f64)> = (0..some.len())
            .into_par_iter()
            .map(|i| {
                let under = if i == 0 { &below } else { &found[i - 1].basis };
                let interface = Interface::new(&found[i].basis, under);
                (interface, &found[i], stack.optical_thickness(some[i]))
            })
            .collect();
        problems.par_iter_mut().for_each(|problem| {
            for (interface, modes, thickness) in &steps {
                problem.state.cross(interface);
                propagate(&mut problem.state, modes, *thickness);
            }
        });
        drop(steps);
        if progress(problems.len() * some.len()).is_break() {
            return Err(Error::Stopped);
        }
        if let Some(last) = found.into_iter().next_back() {
            below = last.basis;
        }
    }

    // The top half-space.
    let interface = Interface::new(&fourier, &below);
    let n = stack.index(Side::Top);
    problems
        .into_par_iter()
        .map(|mut problem| {
            problem.state.cross(&interface);
            let kz = half_space_kz(n, &kx, problem.bloch.ky);
            let Problem {
                bloch,
                top,
                bottom,
                state,
            } = problem;
            let scattering = Scattering::close(&state, n, (&kx, &kz), bloch, top, bottom);
            check_energy(stack, &kx, &scattering)?;
            Ok(scattering)
        })
        .collect()
}

/// kz of every order. An order exactly at its cut-off counts as barely evanescent: between half-spaces of one index
/// kz = 0 would be a wave without a source, and evanescent waves of any kz keep energy and reciprocity exact.
pub(crate) fn half_space_kz(n: Complex64, kx: &[f64], ky: f64) -> Vec<Complex64> {
    kx.iter()
        .map(|k| {
            let kz = outgoing_kz(n * n - k * k - ky * ky);
            if kz == Complex64::ZERO {
                BARELY_EVANESCENT
            } else {
                kz
            }
        })
        .collect()
}

/// R + T must be 1 without loss and must not exceed 1 with it, whatever the truncation.
fn check_energy(stack: &Stack, kx: &[f64], scattering: &Scattering) -> Result<(), Error> {
    let Some((side, order, pol, residual)) = scattering.worst_balance() else {
        return Ok(());
    };
    let broken = if stack.is_lossless() {
        residual.is_nan() || residual.abs() > ENERGY_TOLERANCE
    } else {
        residual.is_nan() || residual > ENERGY_TOLERANCE
    };
    if !broken {
        return Ok(());
    }
    let (layer, mode_residual) = worst_modes(stack, kx)?;
    let ky = scattering.bloch().ky;
    Err(Error::Energy {
        layer,
        order,
        pol,
        side,
        ky,
        residual,
        allowed: ENERGY_TOLERANCE,
        mode_residual,
    })
}

fn worst_modes(stack: &Stack, kx: &[f64]) -> Result<(usize, f64), Error> {
    let mut worst = (0, 0.0);
    for (number, layer) in stack.layers().iter().enumerate() {
        let residual = modes::residual(layer, kx)?;
        if residual > worst.1 {
            worst = (number, residual);
        }
    }
    Ok(worst)
}
