// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe: orders, modes of each layer, stacking from the bottom up, scattering matrix.

use crate::error::Error;
use crate::modes::slanted::{Expansion, Orders};
use crate::modes::standing::Harmonics;
use crate::modes::{self, Basis, Correction, Modes, Upright, modes};
use crate::orders::{
    Bloch, Channel, Side, Truncation, channels, highest_propagating, outgoing_kz, tangent,
};
use crate::relief::{Departure, Layer};
use crate::scattering::Scattering;
use crate::stack::Stack;
use crate::stack::interface::Interface;
use crate::stack::planar;
use crate::stack::propagate::{Coordinates, propagate};
use crate::stack::state::State;
use crate::stack::transfer::{Kept, Shelf, Span, Step, Transfer};
use crate::standing::ends::{HalfSpace, close};
use crate::standing::{self, Mirrored};
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

/// |R + T - 1| at which a result in real arithmetic is not trusted, though it is far below what matters.
const SUSPECT: f64 = 0.2 * ENERGY_TOLERANCE;

/// Modes that are kept in memory together.
const BASES_AT_A_TIME: usize = 24;

/// kz that stands for 0 in a half-space. Next to a cut-off kz² moves in steps of round-off, kz in steps of 1e-8.
pub(crate) const BARELY_EVANESCENT: Complex64 = Complex64::new(0.0, 1e-12);

/// Solves one Bloch wavevector: all directions of incidence that share it, from both sides, in s and p.
///
/// # Errors
/// Wavevectors that are not finite, eigenproblems that fail, an energy balance that does not close.
pub fn solve(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Result<Scattering, Error> {
    let mut line = solve_blochs(stack, &[bloch], truncation, &no_progress)?;
    Ok(line.remove(0))
}

/// As [`solve`], but for light from the top alone: the result has no source at the bottom. That takes less of every layer, and in the
/// plane of incidence (ky = 0) a fraction, since TE and TM are then solved apart.
///
/// # Errors
/// As [`solve`].
pub fn solve_from_top(
    stack: &Stack,
    bloch: Bloch,
    truncation: Truncation,
) -> Result<Scattering, Error> {
    let mut line = solve_lit(stack, &[bloch], (truncation, Light::Top), &no_progress)?;
    Ok(line.remove(0))
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
    solve_blochs(stack, &blochs, truncation, progress)
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
    solve_again((stack, at, truncation), ky, &mut Kept::within(0), progress)
}

/// As [`solve_mirrored_line`], with what former calls for the same line have `kept`.
pub(crate) fn solve_again(
    (stack, at, truncation): (&Stack, Mirrored, Truncation),
    ky: &[f64],
    kept: &mut Kept<f64>,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    let blochs = standing::blochs(stack, at, ky);
    check_finite(&blochs)?;
    match standing::harmonics(stack, at, truncation) {
        Some(harmonics) => {
            let solved = solve_standing(stack, &blochs, (truncation, &harmonics), kept, progress)?;
            solved.map_or_else(|| solve_blochs(stack, &blochs, truncation, progress), Ok)
        }
        None => solve_blochs(stack, &blochs, truncation, progress),
    }
}

/// `None` where the modes of a layer are not to be had in real numbers.
fn solve_standing(
    stack: &Stack,
    blochs: &[Bloch],
    (truncation, harmonics): (Truncation, &Harmonics),
    kept: &mut Kept<f64>,
    progress: &Progress<'_>,
) -> Result<Option<Vec<Scattering>>, Error> {
    let half_space =
        |side, bloch: &Bloch| HalfSpace::new(harmonics, stack.index(side).re, bloch.ky);
    let mut states: Vec<State<f64>> = blochs
        .iter()
        .map(|bloch| half_space(Side::Bottom, bloch).at_bottom())
        .collect();
    let marched = march(
        stack,
        states.iter_mut().collect(),
        harmonics,
        |layer| modes::standing::modes(layer, harmonics),
        kept,
        progress,
    )?;
    let Some(together) = marched else {
        return Ok(None);
    };
    let ratio = stack.period_per_wavelength();
    let orders = harmonics.orders();
    states
        .into_par_iter()
        .zip(blochs)
        .map(|(state, &bloch)| {
            let of = |side| channels(stack.index(side), ratio, bloch, orders.clone());
            let (top, bottom) = (of(Side::Top), of(Side::Bottom));
            let matrix = close(
                &state,
                bloch,
                (&half_space(Side::Top, &bloch), &top),
                (&half_space(Side::Bottom, &bloch), &bottom),
            );
            let scattering = Scattering::from_matrix(&matrix, bloch, top, bottom);
            let balance = scattering.worst_balance().map_or(0.0, |w| w.3.abs());
            if balance < SUSPECT {
                return Ok(scattering);
            }
            // A pole came too near. Layer by layer parameters are chosen elsewhere than where several were taken together.
            let alone = if together && blochs.len() > 1 {
                let with = (truncation, harmonics);
                solve_standing(stack, &[bloch], with, &mut Kept::within(0), progress)?
            } else {
                None
            };
            let mut again = match alone {
                Some(solved) => solved,
                None => solve_blochs(stack, &[bloch], truncation, progress)?,
            };
            Ok(again.remove(0))
        })
        .collect::<Result<_, _>>()
        .map(Some)
}

/// Takes all states through all layers, from the bottom up: modes and interface once, then all ky. Some layers at a time, so
/// that modes of several are found side by side and a problem goes through several without waiting for the others. States
/// begin and end in the coordinates of the half-spaces. Returns whether layers were taken together, or `None` if a layer has no modes of this kind.
fn march<T: Coordinates>(
    stack: &Stack,
    mut states: Vec<&mut State<T>>,
    space: &(impl Expansion<T> + Sync),
    modes: impl Fn(&Layer) -> Result<Option<Modes<T>>, Error> + Sync,
    kept: &mut Kept<T>,
    progress: &Progress<'_>,
) -> Result<Option<bool>, Error> {
    if states.is_empty() {
        return Ok(Some(false));
    }
    let fourier = Basis::fourier(space.count());
    let span = Span::of(states.iter().map(|s| s.ky));
    let shelf = Shelf::new();
    let (passed, above) = kept.pass(&mut states, &span, &shelf);
    let mut together = passed > 0;
    let mut below: Basis<T> = above.unwrap_or_else(|| fourier.clone());
    let bottom_up: Vec<(&Layer, &[Departure])> = stack
        .layers()
        .iter()
        .zip(stack.departures().iter().map(Vec::as_slice))
        .rev()
        .collect();
    if progress(states.len() * passed).is_break() {
        return Err(Error::Stopped);
    }
    // As many parts as that takes, of equal size; layers alike have the same modes and stay together.
    let alike: Vec<&[(&Layer, &[Departure])]> = bottom_up[passed..]
        .chunk_by(|a, b| a.0.segments == b.0.segments)
        .collect();
    let parts = alike.len().div_ceil(BASES_AT_A_TIME).max(1);
    for some in alike.chunks(alike.len().div_ceil(parts).max(1)) {
        let found = some
            .par_iter()
            .map(|layers| modes(layers[0].0))
            .collect::<Result<Option<Vec<Modes<T>>>, Error>>()?;
        let Some(found) = found else {
            return Ok(None);
        };
        let steps: Vec<Step<'_, T>> = (0..some.len())
            .into_par_iter()
            .map(|i| {
                let under = if i == 0 { &below } else { &found[i - 1].basis };
                stacked(stack, space, some[i], (&found[i], under))
            })
            .collect::<Result<Vec<_>, Error>>()?
            .into_iter()
            .flatten()
            .collect();
        let mut transfers = Some(Vec::new());
        for group in span.groups(&steps) {
            let layers = &steps[group.layers];
            if group.together {
                together = true;
                let transfer = Transfer::new(layers, &span, &shelf);
                transfer.pass(&mut states, &shelf);
                if let Some(some) = &mut transfers {
                    some.push(transfer);
                }
                continue;
            }
            transfers = None;
            states.par_iter_mut().for_each(|state| {
                for step in layers {
                    if let Some(interface) = &step.interface {
                        state.cross(interface);
                    }
                    propagate(state, step.modes, &step.corrections, step.thickness);
                }
            });
        }
        let count = steps.len();
        drop(steps);
        if progress(states.len() * count).is_break() {
            return Err(Error::Stopped);
        }
        if let Some(last) = found.into_iter().next_back() {
            kept.add(transfers, &span, count, &last.basis);
            below = last.basis;
        }
    }
    let interface = Interface::new(&fourier, &below);
    states
        .par_iter_mut()
        .for_each(|state| state.cross(&interface));
    Ok(Some(together))
}

/// Layers with the same modes, the lowest first, above a layer with other ones.
fn stacked<'a, T: Coordinates>(
    stack: &Stack,
    space: &impl Expansion<T>,
    layers: &[(&Layer, &[Departure])],
    (modes, below): (&'a Modes<T>, &Basis<T>),
) -> Result<Vec<Step<'a, T>>, Error> {
    let upright = layers
        .iter()
        .any(|(_, departures)| !departures.is_empty())
        .then(|| Upright::new(space, &layers[0].0.segments));
    let mut interface = Some(Interface::new(&modes.basis, below));
    let mut step = |(layer, departures): &(&Layer, &[Departure])| {
        let correction = |section: &Departure, upright| {
            let height = stack.in_waves(section.height);
            Correction::new(space, section, (upright, &modes.basis), height)
        };
        let corrections = upright.iter().flat_map(|upright| {
            departures
                .iter()
                .map(move |section| correction(section, upright))
        });
        Ok(Step {
            interface: interface.take(),
            modes,
            corrections: corrections.collect::<Result<_, Error>>()?,
            thickness: stack.optical_thickness(layer),
        })
    };
    layers.iter().map(&mut step).collect()
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
fn wavevectors(bloch: Bloch, period_per_wavelength: f64, truncation: Truncation) -> Vec<f64> {
    let of = |m| bloch.kx0 + f64::from(m) / period_per_wavelength;
    truncation.orders().map(of).collect()
}

/// All `blochs` must share kx0.
fn solve_blochs(
    stack: &Stack,
    blochs: &[Bloch],
    truncation: Truncation,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    solve_lit(stack, blochs, (truncation, Light::Both), progress)
}

/// The same for light from both sides or from one.
fn solve_lit(
    stack: &Stack,
    blochs: &[Bloch],
    (truncation, light): (Truncation, Light),
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    let Some(first) = blochs.first() else {
        return Ok(Vec::new());
    };
    check_finite(blochs)?;
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
        let is_in_plane = kx.iter().all(|&k| tangent(k, problem.bloch).1 == 0.0);
        if !planar::through(&mut problem.state, stack, &kx, is_in_plane)? {
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
