// SPDX-License-Identifier: MIT OR Apache-2.0
//! From the bottom half-space to the top one: the states of all problems of a line through all layers.

use crate::error::Error;
use crate::modes::expansion::{Expansion, Field};
use crate::modes::{Basis, Correction, Modes, Upright};
use crate::relief::{Departure, Layer};
use crate::solve::Progress;
use crate::stack::Stack;
use crate::stack::interface::Interface;
use crate::stack::kept::Kept;
use crate::stack::propagate::{Coordinates, propagate};
use crate::stack::span::Span;
use crate::stack::state::State;
use crate::stack::transfer::{Shelf, Step, Transfer};
use rayon::prelude::*;

/// Modes that are kept in memory together.
const BASES_AT_A_TIME: usize = 24;

/// Takes all states through all layers, from the bottom up: modes and interface once, then all ky. Some layers at a time, so
/// that modes of several are found side by side and a problem goes through several without waiting for the others. States
/// begin and end in the functions of `space` themselves. Returns whether layers were taken together, or `None` if a layer has no modes of this kind.
pub(crate) fn march<T: Coordinates>(
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
    let fourier = Basis::fourier([Field::X, Field::Z].map(|of| space.count(of)));
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
        .then(|| Upright::new(space, &layers[0].0.segments, &modes.basis));
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
