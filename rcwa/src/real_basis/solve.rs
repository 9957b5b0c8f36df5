// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe in real arithmetic: each part of the basis from the bottom to the top, then all parts
//! to the orders of light.

use super::RealBasis;
use super::half_space::{HalfSpace, PartFields, match_half_spaces};
use crate::error::Error;
use crate::expansion::real::RealFunctions;
use crate::orders::{Bloch, channels_at};
use crate::progress::{Progress, Shared, beyond};
use crate::scattering::{ENERGY_TOLERANCE, Scattering};
use crate::stack::Stack;
use crate::stack::recursion::{Passage, carry_to_top};
use crate::stack::state::State;
use crate::stack::transfer_cache::TransferCache;
use crate::wave::Side;
use rayon::prelude::*;

/// Largest |R + T - 1| of a result in real arithmetic; beyond, far below [`ENERGY_TOLERANCE`], it
/// is solved again.
const SUSPECT: f64 = 0.2 * ENERGY_TOLERANCE;

/// Transfers of a line for further ky, for each part of its basis.
pub(crate) struct LineCache {
    parts: Vec<TransferCache<f64>>,
    bytes: usize,
}

impl LineCache {
    /// An empty cache of so many bytes.
    pub(crate) fn with_capacity(bytes: usize) -> Self {
        Self { parts: Vec::new(), bytes }
    }

    /// A cache that keeps nothing.
    pub(crate) fn none() -> Self {
        Self::with_capacity(0)
    }

    /// The caches of so many parts.
    fn parts(&mut self, count: usize) -> &mut [TransferCache<f64>] {
        let each = self.bytes / count;
        self.parts.resize_with(count, || TransferCache::with_capacity(each));
        &mut self.parts
    }
}

/// Answers of real arithmetic to the problems of a line.
pub(crate) enum RealSolutions {
    /// One for each problem, `None` where it cannot be trusted.
    Each(Vec<Option<Scattering>>),
    /// None: a layer has no real modes, found after `reported` layers.
    NoModes { reported: usize },
}

/// Solves problems of one line.
pub(crate) fn solve_real(
    stack: &Stack,
    basis: &RealBasis,
    blochs: &[Bloch],
    cache: &mut LineCache,
    progress: &Progress<'_>,
) -> Result<RealSolutions, Error> {
    let half_space = |functions, side, bloch: &Bloch| {
        let functions: &RealFunctions = functions;
        HalfSpace::new(functions, stack.index(side).re, bloch.ky)
    };
    let mut together = false;
    let mut states: Vec<Vec<State<f64>>> = Vec::with_capacity(2);
    let parts = basis.parts();
    // A layer counts once for all parts.
    let shared = Shared::new(progress, parts.len());
    for (functions, cache) in parts.iter().zip(cache.parts(parts.len())) {
        let bottom = |bloch| half_space(functions, Side::Bottom, bloch).at_bottom();
        let mut part: Vec<State<f64>> = blochs.iter().map(bottom).collect();
        let report = |layers| shared.report(layers);
        match carry_to_top(stack, part.iter_mut().collect(), functions, cache, &report)? {
            Passage::Single => {}
            Passage::Together => together = true,
            Passage::NoModes => {
                let reported = shared.reported();
                return Ok(RealSolutions::NoModes { reported });
            }
        }
        states.push(part);
    }
    let solved = blochs.par_iter().enumerate().map(|(number, bloch)| {
        let orders = || basis.orders().iter().copied();
        let [above, below] =
            Side::BOTH.map(|side| channels_at(stack.index(side), *bloch, orders()));
        let parts: Vec<PartFields<'_>> = parts
            .iter()
            .zip(&states)
            .map(|(functions, states)| PartFields {
                state: &states[number],
                top: half_space(functions, Side::Top, bloch),
                bottom: half_space(functions, Side::Bottom, bloch),
            })
            .collect();
        let matrix = match_half_spaces(&parts, *bloch, &above, &below);
        let scattering = Scattering::from_matrix(&matrix, *bloch, [above, below]);
        let balance = scattering.worst_balance().map_or(0.0, |w| w.3.abs());
        if balance < SUSPECT {
            return Ok(Some(scattering));
        }
        // A pole came too near. Layer by layer the parameters change elsewhere than where layers
        // pass together.
        if together && blochs.len() > 1 {
            let (mut cache, reported) = (LineCache::none(), beyond(progress, usize::MAX));
            let alone = solve_real(stack, basis, &[*bloch], &mut cache, &reported)?;
            return Ok(match alone {
                RealSolutions::Each(mut one) => one.pop().flatten(),
                RealSolutions::NoModes { .. } => None,
            });
        }
        Ok(None)
    });
    Ok(RealSolutions::Each(solved.collect::<Result<_, Error>>()?))
}
