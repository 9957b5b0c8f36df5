// SPDX-License-Identifier: MIT OR Apache-2.0
//! The assumptions of the hybrid one at a time: variants of full wave that make one of them, and
//! variants of the hybrid that drop one, each against full wave.

use crate::compare::{BySource, Request, body, distance, edges, of_sources, traced};
use crate::dome::{Section, Surface};
use crate::tables::Tables;
use crate::trace::Trial;
use anyhow::Result;
use full_wave::{Body, Mirror, Polarisation};
use results::full_wave::{FarField, Model};
use serde::Serialize;

/// Bins of the distances, degrees.
pub const BIN_DEG: f64 = 2.5;

/// Variant of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// Full wave with every second source alone.
    HalfOfTheSources,
    /// Full wave; light by way of the mirror adds as power.
    MirrorAsPower,
    /// Full wave; light from each ring's part of the outline adds as power.
    RingsAsPowers,
    /// Full wave; light from each group of neighbours of one shape adds as power.
    GroupsAsPowers,
    /// Rays on the relief.
    Rays,
    /// The hybrid as it is.
    Hybrid,
    /// Rings are their chords, not arcs.
    Chords,
    /// Light leaves a ring anywhere on it.
    RandomExit,
    /// Light that meets the surface again meets a smooth one.
    SmoothAgain,
    /// Orders leave with the spread of their ring's width.
    RingAperture,
    /// Orders leave with the spread of the width of neighbours of one shape.
    GroupAperture,
    /// On chords, with the spread of that width.
    ChordsGroupAperture,
}

/// Distance of a variant from full wave, r.m.s. over the largest bin.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Separated {
    /// Variant.
    pub variant: Variant,
    /// Distance from full wave.
    pub rms: f64,
    /// Distance from full wave whose light by way of the mirror adds as power.
    pub rms_mirror_as_power: f64,
    /// Noise of `rms` by sources and paths; none between variants of full wave, which have the same
    /// sources: how far those would move with others is not known.
    pub noise: Option<f64>,
    /// Share of the power that meets the surface more than once, of variants that are traced.
    pub met_again: Option<f64>,
}

/// Computes the distances. `progress` is told what begins, and may stop it.
///
/// # Errors
/// Those of [`compare`](crate::compare::compare).
pub fn separate(
    section: &Section,
    request: &Request,
    progress: impl Fn(&str) -> Result<()>,
) -> Result<Vec<Separated>> {
    let body = body(section, request.resolution)?;
    let mut waves: [Vec<BySource>; 5] = Default::default();
    for polarisation in [Polarisation::Te, Polarisation::Tm] {
        progress(&format!("full wave in parts, {polarisation}"))?;
        for (all, one) in waves.iter_mut().zip(in_parts(&body, section, request, polarisation)?) {
            all.push(one);
        }
    }
    let waves = waves.map(|parts| of_sources(&parts));
    let [full, without_mirror, ..] = &waves;
    let names = [
        Variant::MirrorAsPower,
        Variant::RingsAsPowers,
        Variant::GroupsAsPowers,
        Variant::HalfOfTheSources,
    ];
    let between = |variant, far: &FarField| Separated {
        variant,
        rms: distance(full, far, BIN_DEG).rms,
        rms_mirror_as_power: distance(without_mirror, far, BIN_DEG).rms,
        noise: None,
        met_again: None,
    };
    let mut found: Vec<Separated> =
        names.into_iter().zip(&waves[1..]).map(|(name, far)| between(name, far)).collect();
    progress("variants of the hybrid")?;
    let tables = Tables::solve(section, request.tables)?;
    let (relief, bands, chords) = (section.relief()?, section.bands(), section.chords());
    let [ring, group] = [false, true].map(|together| section.apertures(together));
    let sharp = Trial::default();
    let through = |apertures| Trial { apertures: Some(apertures), ..sharp };
    let variants: [(Variant, &[Surface], Trial); 8] = [
        (Variant::Rays, &relief, sharp),
        (Variant::Hybrid, &bands, sharp),
        (Variant::Chords, &chords, sharp),
        (Variant::RandomExit, &bands, Trial { random_exit: true, ..sharp }),
        (Variant::SmoothAgain, &bands, Trial { smooth_again: true, ..sharp }),
        (Variant::RingAperture, &bands, through(&ring)),
        (Variant::GroupAperture, &bands, through(&group)),
        (Variant::ChordsGroupAperture, &chords, through(&group)),
    ];
    for (variant, surfaces, trial) in variants {
        let tables = (variant != Variant::Rays).then_some(&tables);
        let (far, again) = traced(Model::Hybrid, section, request, (surfaces, tables), trial);
        let apart = distance(full, &far, BIN_DEG);
        found.push(Separated {
            variant,
            rms: apart.rms,
            rms_mirror_as_power: distance(without_mirror, &far, BIN_DEG).rms,
            noise: Some(apart.noise),
            met_again: Some(again),
        });
    }
    Ok(found)
}

/// Full wave of one polarisation: as it is, with the mirror as power, rings as powers, groups as
/// powers, with half of the sources.
fn in_parts(
    body: &Body,
    section: &Section,
    request: &Request,
    polarisation: Polarisation,
) -> Result<[BySource; 5]> {
    let places = request.sources.places(section);
    let electric = body.solve(polarisation, &places)?;
    let (rows, emitted) = (electric.bins(&edges()), electric.emitted());
    // What is compared is the pattern: the balance is judged elsewhere.
    let alone = |rows, emitted: Vec<f64>| BySource { rows, radiated: emitted.clone(), emitted };
    // A riser at the border belongs to the ring inside it; the last ring holds what follows it.
    let apart = |together| {
        let mut borders = section.borders_um(together);
        borders.pop();
        let outside = borders.iter().map(|x| x * (1.0 + 1e-9));
        let breaks: Vec<f64> =
            borders.iter().rev().map(|x| -x * (1.0 + 1e-9)).chain([0.0]).chain(outside).collect();
        let rows = electric.bins_apart(&edges(), &breaks);
        let total: Vec<f64> =
            (0..places.len()).map(|source| rows.iter().map(|row| row[source]).sum()).collect();
        alone(rows, total)
    };
    let half = |values: &[f64]| values.iter().step_by(2).copied().collect::<Vec<f64>>();
    let half_rows: Vec<Vec<f64>> = rows.iter().map(|row| half(row)).collect();
    let half_emitted = half(&emitted);
    let parts = [apart(false), apart(true)];
    let magnetic = body.solve_above(Mirror::Magnetic, polarisation, &places)?;
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
    let both: Vec<Vec<f64>> =
        rows.iter().zip(magnetic.bins(&edges())).map(|(a, b)| sum(a, &b)).collect();
    let both_emitted = sum(&emitted, &magnetic.emitted());
    let [rings, groups] = parts;
    Ok([
        alone(rows, emitted),
        alone(both, both_emitted),
        rings,
        groups,
        alone(half_rows, half_emitted),
    ])
}
