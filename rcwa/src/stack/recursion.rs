// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recursion over the layers, from the bottom half-space to the top one, for all ky of one kx0.
//!
//! In: the fields (3.1) just above the bottom half-space, in the functions of an expansion. Out:
//! the fields just below the top half-space, in the same functions. Modes and interfaces are found
//! once and serve every ky.

use super::Stack;
use super::arithmetic::Arithmetic;
use super::interface::InterfaceMatrices;
use super::ky_batch::KyBatch;
use super::propagate::LayerStep;
use super::state::State;
use super::transfer::{Transfer, Workspace};
use super::transfer_cache::TransferCache;
use crate::error::Error;
use crate::expansion::FieldGroup;
use crate::modes::{Basis, CorrectionStep, ModeExpansion, Modes, VerticalLayer};
use crate::progress::Progress;
use crate::relief::{Layer, WallCorrection};
use rayon::prelude::*;

/// Modes that are held in memory together.
const BASES_AT_A_TIME: usize = 24;

/// Outcome of passing the layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passage {
    /// One by one.
    Single,
    /// Some of them together, by transfers interpolated in ky.
    Together,
    /// Not at all: a layer has no modes in this expansion, and the states are of no use.
    NoModes,
}

/// A layer with the corrections for its slanted walls.
type Corrected<'a> = (&'a Layer, &'a [WallCorrection]);

/// Takes all states through all layers, from the bottom up.
pub(crate) fn carry_to_top<T: Arithmetic>(
    stack: &Stack,
    states: Vec<&mut State<T>>,
    expansion: &(impl ModeExpansion<T> + Sync),
    cache: &mut TransferCache<T>,
    progress: &Progress<'_>,
) -> Result<Passage, Error> {
    if states.is_empty() {
        return Ok(Passage::Single);
    }
    let half_space = Basis::fourier([FieldGroup::X, FieldGroup::Z].map(|of| expansion.count(of)));
    let mut fields = Fields::new(states);
    let (cached, above) = cache.pass(&mut fields.states, &fields.batch, &fields.workspace);
    let mut below: Basis<T> = above.unwrap_or_else(|| half_space.clone());
    fields.together |= cached > 0;
    fields.report(cached, progress)?;

    let bottom_up: Vec<Corrected<'_>> = stack.bottom_up().skip(cached).collect();
    for part in parts(&bottom_up).iter().map(Vec::as_slice) {
        // One pair of eigenproblems of size N for all ky (1.1).
        let modes = part.par_iter().map(|layers| expansion.modes(layers[0].0));
        let Some(modes) = modes.collect::<Result<Option<Vec<Modes<T>>>, Error>>()? else {
            return Ok(Passage::NoModes);
        };
        // Five matrices for each interface (3.2), and the flows of the slanted walls (4.1).
        let steps = (0..part.len()).into_par_iter().map(|i| {
            let under = if i == 0 { &below } else { &modes[i - 1].basis };
            steps(stack, expansion, part[i], &modes[i], under)
        });
        let steps = steps.collect::<Result<Vec<_>, Error>>()?;
        let steps: Vec<LayerStep<'_, T>> = steps.into_iter().flatten().collect();
        // Across the interfaces and through the layers (3.3).
        let transfers = fields.pass(&steps);
        let count = steps.len();
        drop(steps);
        fields.report(count, progress)?;
        if let Some(last) = modes.into_iter().next_back() {
            cache.add(transfers, &fields.batch, count, &last.basis);
            below = last.basis;
        }
    }
    fields.cross(&InterfaceMatrices::new(&half_space, &below));
    Ok(if fields.together { Passage::Together } else { Passage::Single })
}

/// The states of a line, with the memory they share.
struct Fields<'a, T> {
    states: Vec<&'a mut State<T>>,
    batch: KyBatch,
    workspace: Workspace<T>,
    /// True where some layers have been passed together.
    together: bool,
}

impl<'a, T: Arithmetic> Fields<'a, T> {
    fn new(states: Vec<&'a mut State<T>>) -> Self {
        Self {
            batch: KyBatch::new(states.iter().map(|s| s.ky)),
            states,
            workspace: Workspace::new(),
            together: false,
        }
    }

    /// Takes all states through layers. Returns the transfers, if all layers passed by transfers.
    fn pass(&mut self, steps: &[LayerStep<'_, T>]) -> Option<Vec<Transfer<T>>> {
        let mut transfers = Some(Vec::new());
        for group in self.batch.groups(steps) {
            let layers = &steps[group.layers];
            if group.together {
                let transfer = Transfer::new(layers, &self.batch, &self.workspace);
                transfer.pass(&mut self.states, &self.workspace);
                self.together = true;
                if let Some(transfers) = &mut transfers {
                    transfers.push(transfer);
                }
            } else {
                transfers = None;
                self.states.par_iter_mut().for_each(|state| {
                    for step in layers {
                        step.pass(state);
                    }
                });
            }
        }
        transfers
    }

    fn cross(&mut self, interface: &InterfaceMatrices<T>) {
        let states = self.states.par_iter_mut();
        states.for_each(|state| state.cross(interface));
    }

    /// Reports layers, once for each state.
    fn report(&self, layers: usize, progress: &Progress<'_>) -> Result<(), Error> {
        if progress(self.states.len() * layers).is_break() {
            return Err(Error::Stopped);
        }
        Ok(())
    }
}

/// The layers in parts of equal size whose modes fit into memory; neighbours alike share their
/// modes and stay together.
fn parts<'a, 'b>(layers: &'b [Corrected<'a>]) -> Vec<Vec<&'b [Corrected<'a>]>> {
    let alike: Vec<&[Corrected<'a>]> =
        layers.chunk_by(|a, b| a.0.segments == b.0.segments).collect();
    let count = alike.len().div_ceil(BASES_AT_A_TIME).max(1);
    let size = alike.len().div_ceil(count).max(1);
    alike.chunks(size).map(<[_]>::to_vec).collect()
}

/// The steps through layers with the same modes, the lowest first, above a layer with other ones.
fn steps<'a, T: Arithmetic>(
    stack: &Stack,
    expansion: &impl ModeExpansion<T>,
    layers: &[Corrected<'_>],
    modes: &'a Modes<T>,
    below: &Basis<T>,
) -> Result<Vec<LayerStep<'a, T>>, Error> {
    let vertical = layers
        .iter()
        .any(|(_, corrections)| !corrections.is_empty())
        .then(|| VerticalLayer::new(expansion, &layers[0].0.segments, &modes.basis));
    let mut interface = Some(InterfaceMatrices::new(&modes.basis, below));
    let step = |(layer, corrections): &Corrected<'_>| {
        let flow = |(section, vertical): (&WallCorrection, _)| {
            let height = stack.in_waves(section.height);
            CorrectionStep::new(expansion, section, vertical, height)
        };
        let sections = vertical
            .iter()
            .flat_map(|vertical| corrections.iter().map(move |section| (section, vertical)));
        Ok(LayerStep {
            interface: interface.take(),
            modes,
            corrections: sections.map(flow).collect::<Result<_, Error>>()?,
            thickness: stack.optical_thickness(layer),
        })
    };
    layers.iter().map(step).collect()
}
