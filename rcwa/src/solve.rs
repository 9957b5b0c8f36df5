// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe: orders, modes of each layer, stacking from the bottom up, scattering matrix.

use crate::error::Error;
use crate::march::march;
use crate::modes::expansion::Orders;
use crate::modes::{self, modes};
use crate::orders::{Bloch, Channel, Side, Truncation, channels, highest_propagating, outgoing_kz};
use crate::scattering::Scattering;
use crate::stack::Stack;
use crate::stack::kept::Kept;
use crate::stack::planar;
use crate::stack::state::State;
use crate::standing::solve::{Found, KeptLine, beyond, solve_real};
use crate::standing::{self, Mirrored, RealLine};
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

/// kz that stands for 0 in a half-space. Next to a cut-off kz² moves in steps of round-off, kz in steps of 1e-8.
pub(crate) const BARELY_EVANESCENT: Complex64 = Complex64::new(0.0, 1e-12);

/// Solves one Bloch wavevector: all directions of incidence that share it, from both sides, in s and p.
///
/// # Errors
/// Wavevectors that are not finite, eigenproblems that fail, an energy balance that does not close.
pub fn solve(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Result<Scattering, Error> {
    let task = Task::new(stack, truncation, &no_progress);
    Ok(task.solve(&[bloch])?.remove(0))
}

/// As [`solve`], but for light from the top alone: the result has no source at the bottom. Where [`solve`] takes complex numbers, that takes less of
/// every layer, and in the plane of incidence (ky = 0) a fraction, since TE and TM are then solved apart; a dielectric that is its own mirror image takes
/// as long as there.
///
/// # Errors
/// As [`solve`].
pub fn solve_from_top(
    stack: &Stack,
    bloch: Bloch,
    truncation: Truncation,
) -> Result<Scattering, Error> {
    let task = Task {
        light: Light::Top,
        ..Task::new(stack, truncation, &no_progress)
    };
    Ok(task.solve(&[bloch])?.remove(0))
}

/// Where light comes from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Light {
    Both,
    Top,
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
    let task = Task::new(stack, truncation, progress);
    task.solve(&blochs)
}

/// Highest order that propagates in either half-space: the least truncation that keeps every order of light.
pub fn highest_order(stack: &Stack, bloch: Bloch) -> usize {
    let of = |side| highest_propagating(stack.index(side), stack.period_per_wavelength(), bloch);
    of(Side::Top).max(of(Side::Bottom))
}

/// As [`solve_line`] at a Bloch wavevector that is its own mirror image: in real arithmetic, several times as fast, where there is
/// no loss, no metal and no thick layer, otherwise as [`solve_line`]. At [`Mirrored::Edge`] the orders kept, but for the
/// others, are -M-1..=M.
///
/// # Errors
/// As [`solve_line`].
pub fn solve_mirrored_line(
    stack: &Stack,
    at: Mirrored,
    ky: &[f64],
    truncation: Truncation,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    let mut kept = KeptLine::within(0);
    solve_again((stack, at, truncation), ky, &mut kept, progress)
}

/// As [`solve_mirrored_line`], with what former calls for the same line have `kept`.
pub(crate) fn solve_again(
    (stack, at, truncation): (&Stack, Mirrored, Truncation),
    ky: &[f64],
    kept: &mut KeptLine,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    let blochs = standing::blochs(stack, at, ky);
    check_finite(&blochs)?;
    let task = Task::new(stack, truncation, progress);
    match RealLine::mirrored(stack, at, truncation) {
        Some(line) => task.solve_real(&line, &blochs, kept),
        None => task.solve(&blochs),
    }
}

/// One problem of a line: the state so far and what closes it.
struct Problem {
    bloch: Bloch,
    top: Vec<Channel>,
    bottom: Vec<Channel>,
    state: State,
}

fn check_finite(blochs: &[Bloch]) -> Result<(), Error> {
    match blochs
        .iter()
        .find(|b| !(b.kx0.is_finite() && b.ky.is_finite()))
    {
        Some(bad) => Err(Error::Bloch {
            kx0: bad.kx0,
            ky: bad.ky,
        }),
        None => Ok(()),
    }
}

/// kx of the orders kept.
pub(crate) fn wavevectors(
    bloch: Bloch,
    period_per_wavelength: f64,
    truncation: Truncation,
) -> Vec<f64> {
    let of = |m| bloch.kx0 + f64::from(m) / period_per_wavelength;
    truncation.orders().map(of).collect()
}

/// What is asked of the problems of a line.
#[derive(Clone, Copy)]
struct Task<'a> {
    stack: &'a Stack,
    truncation: Truncation,
    light: Light,
    progress: &'a Progress<'a>,
}

impl<'a> Task<'a> {
    /// For light from both sides.
    fn new(stack: &'a Stack, truncation: Truncation, progress: &'a Progress<'a>) -> Self {
        Self {
            stack,
            truncation,
            light: Light::Both,
            progress,
        }
    }

    /// Solves `blochs`, which must share kx0.
    fn solve(self, blochs: &[Bloch]) -> Result<Vec<Scattering>, Error> {
        let Self {
            stack, truncation, ..
        } = self;
        let Some(first) = blochs.first() else {
            return Ok(Vec::new());
        };
        check_finite(blochs)?;
        let kx = wavevectors(*first, stack.period_per_wavelength(), truncation);
        // TE and TM apart cost about as much as orders in real numbers, and more than parities.
        let is_planar = self.light == Light::Top
            && blochs
                .iter()
                .all(|&bloch| planar::serves(stack, bloch, &kx));
        let line = RealLine::running(stack, first.kx0, truncation)
            .filter(|line| !is_planar || line.parts().len() > 1);
        match line {
            Some(line) => self.solve_real(&line, blochs, &mut KeptLine::within(0)),
            None => self.solve_running(blochs),
        }
    }

    /// In real numbers; what is missing then in running waves. Layers are told of once.
    fn solve_real(
        self,
        line: &RealLine,
        blochs: &[Bloch],
        kept: &mut KeptLine,
    ) -> Result<Vec<Scattering>, Error> {
        let mut found = match solve_real((self.stack, line), blochs, kept, self.progress)? {
            Found::Each(found) => found,
            Found::Nothing(told) => {
                let progress = &beyond(self.progress, told);
                return Task { progress, ..self }.solve_running(blochs);
            }
        };
        if self.light == Light::Top {
            for solved in found.iter_mut().flatten() {
                solved.darken_bottom();
            }
        }
        let missing: Vec<Bloch> = blochs
            .iter()
            .zip(&found)
            .filter_map(|(&bloch, found)| found.is_none().then_some(bloch))
            .collect();
        let progress = &beyond(self.progress, usize::MAX);
        let again = Task { progress, ..self }.solve_running(&missing)?;
        let mut again = again.into_iter();
        Ok(found
            .into_iter()
            .filter_map(|solved| solved.or_else(|| again.next()))
            .collect())
    }

    /// In running waves, whatever the stack.
    fn solve_running(self, blochs: &[Bloch]) -> Result<Vec<Scattering>, Error> {
        let Self {
            stack,
            truncation,
            light,
            progress,
        } = self;
        let Some(first) = blochs.first() else {
            return Ok(Vec::new());
        };
        let ratio = stack.period_per_wavelength();
        let kx = wavevectors(*first, ratio, truncation);

        // The bottom half-space.
        let mut problems: Vec<Problem> = blochs
            .iter()
            .map(|&bloch| {
                let of = |side| channels(stack.index(side), ratio, bloch, truncation.orders());
                let (top, bottom) = (of(Side::Top), of(Side::Bottom));
                let n = stack.index(Side::Bottom);
                let kz = half_space_kz(n, &kx, bloch.ky);
                let state = State::at_bottom(n, &kx, &kz, bloch, (&bottom, light == Light::Both));
                Problem {
                    bloch,
                    top,
                    bottom,
                    state,
                }
            })
            .collect();

        let mut rest = Vec::with_capacity(problems.len());
        for problem in &mut problems {
            let serves = light == Light::Top && planar::serves(stack, problem.bloch, &kx);
            if !(serves && planar::through(&mut problem.state, stack, &kx)?) {
                rest.push(&mut problem.state);
            }
        }
        march(
            stack,
            rest,
            &Orders(&kx),
            |layer| modes(layer, &kx).map(Some),
            &mut Kept::within(0),
            progress,
        )?;

        // The top half-space.
        let n = stack.index(Side::Top);
        problems
            .into_par_iter()
            .map(|problem| {
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
}

/// A line in running waves.
#[cfg(test)]
pub(crate) fn solve_running_line(
    stack: &Stack,
    kx0: f64,
    ky: &[f64],
    truncation: Truncation,
) -> Result<Vec<Scattering>, Error> {
    let blochs: Vec<Bloch> = ky.iter().map(|&ky| Bloch::new(kx0, ky)).collect();
    let task = Task::new(stack, truncation, &no_progress);
    task.solve_running(&blochs)
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
