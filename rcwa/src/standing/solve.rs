// SPDX-License-Identifier: MIT OR Apache-2.0
//! A line in real arithmetic: each part from the bottom to the top, then all together to the orders of light.

use super::RealLine;
use super::ends::{HalfSpace, Part, close};
use super::functions::Functions;
use crate::error::Error;
use crate::march::march;
use crate::modes;
use crate::orders::{Bloch, Side, channels_at};
use crate::scattering::Scattering;
use crate::solve::{ENERGY_TOLERANCE, Progress};
use crate::stack::Stack;
use crate::stack::kept::Kept;
use crate::stack::state::State;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// |R + T - 1| at which a result in real arithmetic is not trusted, though it is far below what matters.
const SUSPECT: f64 = 0.2 * ENERGY_TOLERANCE;

/// What is kept of a line for further ky, for each of its parts.
pub(crate) struct KeptLine {
    parts: Vec<Kept<f64>>,
    bytes: usize,
}

impl KeptLine {
    /// Nothing yet, and so many bytes for what comes.
    pub(crate) fn within(bytes: usize) -> Self {
        Self {
            parts: Vec::new(),
            bytes,
        }
    }

    /// Of a line of so many parts.
    fn parts(&mut self, count: usize) -> &mut [Kept<f64>] {
        let each = self.bytes / count;
        self.parts.resize_with(count, || Kept::within(each));
        &mut self.parts
    }
}

/// What real numbers make of the problems of a line.
pub(crate) enum Found {
    /// Answers, `None` where they do not serve for one problem.
    Each(Vec<Option<Scattering>>),
    /// They serve for none, which was found after so many layers had been told of.
    Nothing(usize),
}

/// What is told of layers beyond so many that have been told of.
pub(crate) fn beyond<'a>(
    progress: &'a Progress<'a>,
    told: usize,
) -> impl Fn(usize) -> ControlFlow<()> + Sync + 'a {
    let passed = AtomicUsize::new(0);
    move |layers| {
        let before = passed.fetch_add(layers, Ordering::Relaxed);
        progress((before + layers).max(told) - before.max(told))
    }
}

/// Solves problems of one line.
pub(crate) fn solve_real(
    (stack, line): (&Stack, &RealLine),
    blochs: &[Bloch],
    kept: &mut KeptLine,
    progress: &Progress<'_>,
) -> Result<Found, Error> {
    let mut together = false;
    let mut states: Vec<Vec<State<f64>>> = Vec::with_capacity(2);
    // A layer counts once for all parts.
    let counted = AtomicUsize::new(0);
    let count = line.parts().len();
    let shared = |layers: usize| {
        let before = counted.fetch_add(layers, Ordering::Relaxed);
        progress((before + layers) / count - before / count)
    };
    for (functions, kept) in line.parts().iter().zip(kept.parts(count)) {
        let mut part: Vec<State<f64>> = blochs
            .iter()
            .map(|bloch| half_space(stack, functions, Side::Bottom, bloch).at_bottom())
            .collect();
        let marched = march(
            stack,
            part.iter_mut().collect(),
            functions,
            |layer| modes::real::modes(layer, functions),
            kept,
            &shared,
        )?;
        let Some(some_together) = marched else {
            return Ok(Found::Nothing(counted.load(Ordering::Relaxed) / count));
        };
        together |= some_together;
        states.push(part);
    }
    let each = blochs
        .par_iter()
        .enumerate()
        .map(|(number, bloch)| {
            let orders = || line.orders().iter().copied();
            let of = |side| channels_at(stack.index(side), *bloch, orders());
            let (above, below) = (of(Side::Top), of(Side::Bottom));
            let parts: Vec<Part<'_>> = line
                .parts()
                .iter()
                .zip(&states)
                .map(|(functions, states)| Part {
                    state: &states[number],
                    top: half_space(stack, functions, Side::Top, bloch),
                    bottom: half_space(stack, functions, Side::Bottom, bloch),
                })
                .collect();
            let matrix = close(&parts, *bloch, &above, &below);
            let scattering = Scattering::from_matrix(&matrix, *bloch, above, below);
            let balance = scattering.worst_balance().map_or(0.0, |w| w.3.abs());
            if balance < SUSPECT {
                return Ok(Some(scattering));
            }
            // A pole came too near. Layer by layer parameters are chosen elsewhere than where several were taken together.
            if together && blochs.len() > 1 {
                let (mut kept, told) = (KeptLine::within(0), beyond(progress, usize::MAX));
                let alone = solve_real((stack, line), &[*bloch], &mut kept, &told)?;
                return Ok(match alone {
                    Found::Each(mut one) => one.pop().flatten(),
                    Found::Nothing(_) => None,
                });
            }
            Ok(None)
        })
        .collect::<Result<_, Error>>()?;
    Ok(Found::Each(each))
}

fn half_space<'a>(
    stack: &Stack,
    functions: &'a Functions,
    side: Side,
    bloch: &Bloch,
) -> HalfSpace<'a> {
    HalfSpace::new(functions, stack.index(side).re, bloch.ky)
}
