// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far fields of the three models, and the distances between them.

use crate::dome::{Section, Surface};
use crate::tables::{TableRequest, Tables};
use crate::trace::{Scene, Trial, trace};
use anyhow::Result;
use full_wave::{Body, Polarisation, Resolution};
use results::full_wave::{Comparison, Distance, FarField, Model};
use serde::Serialize;

/// Bins of the finest far field, degrees.
pub const FINE_DEG: f64 = 0.5;
/// Widths of the bins that far fields are compared in, degrees.
pub const WIDTHS_DEG: [f64; 3] = [1.0, 2.5, 5.0];

/// Sources in the dome.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceRequest {
    /// Number of line sources.
    pub count: usize,
    /// Width of the chip over the diameter of the dome.
    pub width: f64,
    /// Middle of the chip over the radius of the dome.
    pub offset: f64,
    /// Height of the chip over the height of the dome.
    pub height: f64,
}

impl Default for SourceRequest {
    /// The chip of the paper's package.
    fn default() -> Self {
        Self { count: 60, width: 1.0 / 3.4, offset: 0.0, height: 0.35 }
    }
}

impl SourceRequest {
    /// Places (x, z) in µm: evenly over the width of the chip, and within one wavelength above its
    /// top, so that the interference of each source with its own image is averaged.
    pub fn places(&self, section: &Section) -> Vec<[f64; 2]> {
        // The golden section spreads heights evenly whatever the number.
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        (0..self.count)
            .map(|i| {
                let part = (i as f64 + 0.5) / self.count as f64 - 0.5;
                let above = (golden * (i as f64 + 0.5)).fract();
                [
                    section.radius_um() * (self.offset + 2.0 * self.width * part),
                    section.height_um() * self.height + above * section.wavelength_um,
                ]
            })
            .collect()
    }
}

/// Request for a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Sources.
    pub sources: SourceRequest,
    /// Panels of full wave, and its memory.
    pub resolution: Resolution,
    /// Tables of the hybrid.
    pub tables: TableRequest,
    /// Paths of each ray model in each polarisation.
    pub paths: usize,
    /// Seed.
    pub seed: u64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            sources: SourceRequest::default(),
            resolution: Resolution::default(),
            tables: TableRequest::default(),
            paths: 1 << 20,
            seed: 1,
        }
    }
}

/// Figures of one far field in bins of 5 degrees, both sides averaged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Middles of the first and the last bin that the largest does not exceed by two standard
    /// errors, degrees from the axis: one number twice where the peak is resolved.
    pub peak_deg: [f64; 2],
    /// Bins beside the axis over the largest.
    pub centre_to_peak: f64,
    /// Standard error of that.
    pub centre_to_peak_error: f64,
}

pub(crate) fn edges() -> Vec<f64> {
    let count = (180.0 / FINE_DEG) as usize;
    (0..=count).map(|i| (-90.0 + FINE_DEG * i as f64).to_radians()).collect()
}

/// The body of full wave.
///
/// # Errors
/// Relief that crosses itself, memory beyond the limit.
pub fn body(section: &Section, resolution: Resolution) -> Result<Body> {
    let outline = section.outline()?;
    Ok(Body::new(&outline, section.wavelength_um, section.index, resolution)?)
}

/// Computes the three far fields. `progress` is told what begins, and may stop it.
///
/// # Errors
/// Those of [`body`] and of the tables; sources outside the dome; what `progress` returns.
pub fn compare(
    section: &Section,
    request: &Request,
    progress: impl Fn(&str) -> Result<()>,
) -> Result<Comparison> {
    let body = body(section, request.resolution)?;
    let places = request.sources.places(section);
    let mut solved = Vec::new();
    for polarisation in [Polarisation::Te, Polarisation::Tm] {
        progress(&format!("full wave, {polarisation}"))?;
        let field = body.solve(polarisation, &places)?;
        solved.push(BySource {
            rows: field.bins(&edges()),
            emitted: field.emitted(),
            radiated: field.radiated(),
        });
    }
    progress("tables of the rings")?;
    let tables = Tables::solve(section, request.tables)?;
    progress("rays")?;
    let (relief, bands) = (section.relief()?, section.bands());
    let mut far_fields = vec![of_sources(&solved)];
    for (model, surfaces, tables) in
        [(Model::Hybrid, &bands, Some(&tables)), (Model::Rays, &relief, None)]
    {
        let trial = Trial::default();
        far_fields.push(traced(model, section, request, (surfaces, tables), trial).0);
    }
    let distances = WIDTHS_DEG
        .into_iter()
        .flat_map(|width| far_fields[1..].iter().map(move |other| (width, other)))
        .map(|(width, other)| distance(&far_fields[0], other, width))
        .collect();
    Ok(Comparison {
        rings: section.rings(),
        radius_um: section.radius_um(),
        unknowns: body.cost().unknowns,
        balance: far_fields[0].missing,
        far_fields,
        distances,
    })
}

/// Powers of one polarisation by full wave.
pub(crate) struct BySource {
    /// A row a bin, a column a source.
    pub rows: Vec<Vec<f64>>,
    pub emitted: Vec<f64>,
    pub radiated: Vec<f64>,
}

/// Far field of rays, mean of TE and TM, and the share of power that meets surfaces again.
pub(crate) fn traced(
    model: Model,
    section: &Section,
    request: &Request,
    (surfaces, tables): (&[Surface], Option<&Tables>),
    trial: Trial,
) -> (FarField, f64) {
    let places = request.sources.places(section);
    // Seeds of their own: with equal ones the errors of both polarisations would not be independent.
    let [te, tm] = [(Polarisation::Te, 0), (Polarisation::Tm, 1)].map(|(polarisation, number)| {
        let scene = Scene { surfaces, tables, index: section.index, polarisation, trial };
        let seed = request.seed.wrapping_mul(2).wrapping_add(number);
        trace(scene, &places, &edges(), request.paths, seed)
    });
    let pairs = |a: &[f64], b: &[f64], mean: fn(f64, f64) -> f64| {
        a.iter().zip(b).map(|(a, b)| mean(*a, *b)).collect()
    };
    let far = FarField {
        model,
        bins: pairs(&te.bins, &tm.bins, |a, b| 0.5 * (a + b)),
        errors: pairs(&te.errors, &tm.errors, |a, b| 0.5 * a.hypot(b)),
        missing: te.lost.max(tm.lost),
    };
    (far, 0.5 * (te.met_again + tm.met_again))
}

/// Far field of full wave, with the scatter among its sources: polarisations of one source are
/// added first, as their speckle is alike.
pub(crate) fn of_sources(parts: &[BySource]) -> FarField {
    let n = parts.len() as f64;
    let totals: Vec<f64> = parts.iter().map(|part| n * part.emitted.iter().sum::<f64>()).collect();
    let joined = |values: &dyn Fn(&BySource) -> &[f64]| {
        let count = parts[0].emitted.len();
        let sum = |source| parts.iter().zip(&totals).map(|(p, all)| values(p)[source] / all).sum();
        (0..count).map(sum).collect::<Vec<f64>>()
    };
    let emitted = joined(&|part| &part.emitted);
    let rows: Vec<Vec<f64>> =
        (0..parts[0].rows.len()).map(|bin| joined(&|part| &part.rows[bin])).collect();
    let bins: Vec<f64> = rows.iter().map(|row| row.iter().sum()).collect();
    let count = emitted.len() as f64;
    let error = |(row, share): (&Vec<f64>, &f64)| {
        let squares: f64 =
            row.iter().zip(&emitted).map(|(power, all)| (power - share * all).powi(2)).sum();
        (squares * count / (count - 1.0).max(1.0)).sqrt()
    };
    let lacks = |part: &BySource| {
        let sources = part.radiated.iter().zip(&part.emitted);
        sources.map(|(radiated, emitted)| (radiated / emitted - 1.0).abs()).fold(0.0, f64::max)
    };
    FarField {
        model: Model::FullWave,
        errors: rows.iter().zip(&bins).map(error).collect(),
        bins,
        missing: parts.iter().map(lacks).fold(0.0, f64::max),
    }
}

/// Peak and centre in bins of 5 degrees.
pub fn figures(far: &FarField) -> Figures {
    let (bins, errors) = far.in_bins(5.0);
    let half = bins.len() / 2;
    let folded: Vec<f64> = (0..half).map(|i| bins[half + i] + bins[half - 1 - i]).collect();
    let error: Vec<f64> = (0..half).map(|i| errors[half + i].hypot(errors[half - 1 - i])).collect();
    let peak = (0..half).max_by(|&a, &b| folded[a].total_cmp(&folded[b])).unwrap_or(0);
    let tied: Vec<usize> = (0..half)
        .filter(|&i| folded[peak] - folded[i] <= 2.0 * error[peak].hypot(error[i]))
        .collect();
    let middle = |i: Option<&usize>| 5.0 * *i.unwrap_or(&peak) as f64 + 2.5;
    let ratio = folded[0] / folded[peak];
    let relative = (error[0] / folded[0]).hypot(error[peak] / folded[peak]);
    Figures {
        peak_deg: [middle(tied.first()), middle(tied.last())],
        centre_to_peak: ratio,
        centre_to_peak_error: ratio * relative,
    }
}

pub(crate) fn distance(reference: &FarField, other: &FarField, width_deg: f64) -> Distance {
    let (a, ea) = reference.in_bins(width_deg);
    let (b, eb) = other.in_bins(width_deg);
    let largest_bin = a.iter().copied().fold(0.0, f64::max);
    let n = a.len() as f64;
    let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).collect();
    let noise: f64 = ea.iter().zip(&eb).map(|(a, b)| a * a + b * b).sum();
    Distance {
        model: other.model,
        bin_deg: width_deg,
        rms: (differences.iter().map(|d| d * d).sum::<f64>() / n).sqrt() / largest_bin,
        largest: differences.iter().copied().fold(0.0, f64::max) / largest_bin,
        l1: differences.iter().sum(),
        noise: (noise / n).sqrt() / largest_bin,
    }
}
