// SPDX-License-Identifier: MIT OR Apache-2.0
//! The design in whose scene responses are traced. Where packages stand for more, it has more of them
//! than stated, so that light far from its package is seen where it falls and is not sent back by walls.

use std::borrow::Cow;

use anyhow::{Result, ensure};

use design::Design;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::model::Model;
use simulate::trace::converted_fits;

use super::Request;
use super::map_receiver::MapReceiver;
use super::places::Places;
use super::responses::{ChannelLight, MAX_BYTES, groups_of};

/// Packages along a side of the traced array, where as many stand in the whole one. Chosen: behind the films
/// of the shipped RGB backlight 1.7 % of the light falls beyond 13 of them.
const TRACED: usize = 31;

/// The traced design, and what it stands for.
pub struct WideDesign<'a> {
    /// The design that is traced.
    pub design: Cow<'a, Design>,
    /// Columns and rows that were stated.
    pub(super) stated: Option<[usize; 2]>,
    /// Parts of the light where channels or the panel have colours.
    pub(super) parts: Option<Vec<ChannelLight>>,
}

impl<'a> WideDesign<'a> {
    /// Checks `request` against `design`, and adds packages where it asks for more.
    ///
    /// # Errors
    /// Packages or a receiver that do not fit; light that has no map by zones.
    pub fn new(design: &'a Design, model: Model, request: Request) -> Result<Self> {
        ensure!(
            !design.is_periodic(),
            "{}: housing.kind: expected walls or none for zones, got \"periodic\", a cell whose zones shine in all cells at once",
            design.provenance.file
        );
        let places = Places::new(design, request.packages, None)?;
        ensure!(
            request.zones.is_some() || !places.are_free(),
            "--zones: expected columns and rows of zones for packages in no rows, got none"
        );
        let has_colours = design.channels().len() > 1 || !design.sub_pixels().is_empty();
        let receiver = MapReceiver::new(design, request.receiver, &places, has_colours)?;
        let (step, _) = receiver.over(&places)?;
        let interrupt = Interrupt::default();
        let context = RunContext::quiet(&interrupt, 0);
        let parts =
            has_colours.then(|| ChannelLight::of_colours(design, model, context)).transpose()?;
        let count = parts.as_ref().map(Vec::len);
        let bytes = |traced: [usize; 2]| -> f64 {
            let of_axis = |k: usize| {
                let bins = receiver.frame.bins[k] + (traced[k] - places.stated[k]) * step[k];
                let is_copied = places.whole[k] > traced[k] || traced[k] > 2 * places.stated[k];
                let few = 2 * places.near_wall(k) + 2 - traced[k] % 2;
                (bins * if is_copied { few } else { traced[k] }) as f64
            };
            8.0 * of_axis(0) * of_axis(1) * (count.unwrap_or(1) * groups_of(count)) as f64
        };
        // Odd, so that one package stands in the middle, or the whole array.
        let along = |most: usize| {
            [0, 1].map(|k| match places.whole[k] {
                whole if !places.is_extended(k) => whole,
                whole if whole <= most => whole,
                _ => most.max(places.stated[k]),
            })
        };
        let sizes = (0..=TRACED / 2).map(|less| along(TRACED - 2 * less));
        let wide = sizes.filter(|traced| bytes(*traced) <= MAX_BYTES).find_map(|traced| {
            let is_more = (0..2).any(|k| traced[k] > places.stated[k]);
            let wide = is_more.then(|| design.widened(traced, request.receiver)).flatten();
            wide.filter(|wide| !(has_colours && wide.converts()) || converted_fits(wide).is_ok())
        });
        let stated = wide.as_ref().map(|_| places.stated);
        Ok(Self { design: wide.map_or(Cow::Borrowed(design), Cow::Owned), stated, parts })
    }
}
