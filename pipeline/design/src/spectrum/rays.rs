// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays of a file, each with its wavelength → a few wavelengths, and what is traced at each.
//!
//! Where the rays have few wavelengths, all of them are computed. Else wavelengths lie as those of a
//! table of the rays' flux do, and the flux of a ray between two of them is shared by both, the nearer
//! one getting more; beyond the first and the last it is theirs. Whatever is seen is so interpolated linearly over the wavelength,
//! each ray at its own place and in its own direction: exact where it is linear between neighbours,
//! and off by h²/8 of its second derivative at most where they are h apart.

use std::sync::Arc;

use serde::Serialize;
use tracer::RayRecord;
use tracer::RaySet;

use metrics::photopic;
use metrics::plural::count;

use super::density::Density;
use super::quadrature::places;
use super::{Sampling, SpectralPower, Weighting, shares};

/// Most wavelengths that are all computed.
pub const MAX_EXACT: usize = 31;
/// Files hold single precision: wavelengths are rounded to this many to a nanometre.
const PER_NM: f64 = 1e4;

/// The wavelength of a file as a number of nm, without the digits that single precision makes up.
pub fn nanometres(stated: f32) -> f64 {
    (f64::from(stated) * PER_NM).round() / PER_NM
}

/// Rays with wavelengths.
#[derive(Debug, Clone, Serialize)]
pub struct ColouredRays {
    /// Rays with flux.
    pub rays: usize,
    /// Different wavelengths among them.
    pub wavelengths: usize,
    /// The first and the last of them, nm.
    pub range_nm: [f64; 2],
    /// Lumens per watt of radiant power; V counts as 0 beyond its table.
    pub luminous_efficacy_lm_per_w: f64,
    /// Sampling; `None` where all are computed.
    pub sampling: Option<Sampling>,
    #[serde(skip)]
    pub(super) weighting: Weighting,
    #[serde(skip)]
    records: Arc<Vec<RayRecord>>,
    /// Wavelengths, ascending, nm, and radiant flux at each.
    #[serde(skip)]
    flux: Arc<Vec<(f64, f64)>>,
}

impl ColouredRays {
    /// Rays whose flux is radiant, in any unit, and whose wavelengths were checked; those without
    /// flux say nothing. With more than [`MAX_EXACT`] wavelengths they are sampled as `sampling`
    /// says.
    pub fn new(records: Vec<RayRecord>, weighting: Weighting, sampling: Sampling) -> Self {
        let lit = records.iter().filter(|ray| ray.flux > 0.0);
        let mut flux: Vec<(f64, f64)> =
            lit.map(|ray| (nanometres(ray.wavelength), f64::from(ray.flux))).collect();
        let rays = flux.len();
        flux.sort_by(|a, b| a.0.total_cmp(&b.0));
        flux.dedup_by(|next, kept| {
            let same = next.0.to_bits() == kept.0.to_bits();
            if same {
                kept.1 += next.1;
            }
            same
        });
        let watts: f64 = flux.iter().map(|(_, w)| w).sum();
        let seen: f64 = flux.iter().map(|(nm, w)| w * photopic::v(*nm)).sum();
        let end = |at: Option<&(f64, f64)>| at.map_or(f64::NAN, |(nm, _)| *nm);
        Self {
            rays,
            wavelengths: flux.len(),
            range_nm: [end(flux.first()), end(flux.last())],
            luminous_efficacy_lm_per_w: photopic::LUMENS_PER_WATT * seen / watts,
            sampling: (flux.len() > MAX_EXACT).then_some(sampling),
            weighting,
            records: Arc::new(records),
            flux: Arc::new(flux),
        }
    }

    /// Flux at every wavelength, weighted.
    fn weighted(&self, weighting: Weighting) -> Vec<(f64, f64)> {
        let weight = |nm: f64| match weighting {
            Weighting::Radiometric => 1.0,
            Weighting::Photometric => photopic::v(nm),
        };
        let flux = self.flux.iter();
        flux.map(|&(nm, w)| (nm, w * weight(nm))).collect()
    }

    /// The same weighted by radiant flux.
    pub(super) fn radiometric(&self) -> Self {
        Self { weighting: Weighting::Radiometric, ..self.clone() }
    }

    /// The wavelength with half of the weighted flux on either side, nm.
    pub fn median_nm(&self) -> f64 {
        let weighted = self.weighted(self.weighting);
        let half = 0.5 * weighted.iter().map(|(_, flux)| flux).sum::<f64>();
        let mut below = 0.0;
        let place = weighted.iter().position(|(_, flux)| {
            below += flux;
            below >= half
        });
        weighted[place.unwrap_or(weighted.len() - 1)].0
    }

    /// At most `count` wavelengths, ascending, nm: all of them where there are few.
    pub fn nodes(&self, count: usize) -> Vec<f64> {
        if self.sampling.is_none() {
            return self.flux.iter().map(|(nm, _)| *nm).collect();
        }
        let photometric = self.weighting == Weighting::Photometric;
        let density = Density::of_wavelengths(&self.spread(), photometric);
        // A node has rays of its own.
        let nearest = |nm: f64| {
            let above = self.flux.partition_point(|(known, _)| *known < nm);
            let beside = self.flux[above.saturating_sub(1)..].iter().take(2).map(|(nm, _)| *nm);
            beside.min_by(|a, b| (a - nm).abs().total_cmp(&(b - nm).abs())).unwrap_or(nm)
        };
        let mut nodes: Vec<f64> = places(count).map(|u| nearest(density.quantile_nm(u))).collect();
        nodes.dedup();
        nodes
    }

    /// The flux of all rays as a table, by equal parts of the range.
    fn spread(&self) -> SpectralPower {
        const PARTS: usize = 128;
        let [low, high] = self.range_nm;
        let mut flux = vec![0.0; PARTS];
        for (nm, watts) in self.flux.iter() {
            let part = (nm - low) / (high - low) * PARTS as f64;
            flux[(part as usize).min(PARTS - 1)] += watts;
        }
        let middle = |part: usize| low + (high - low) * (part as f64 + 0.5) / PARTS as f64;
        let middles = (0..PARTS).map(middle);
        let [first, last] = [flux[0], flux[PARTS - 1]];
        SpectralPower::Table {
            wavelength_nm: [low].into_iter().chain(middles).chain([high]).collect(),
            power: [first].into_iter().chain(flux).chain([last]).collect(),
        }
    }

    /// The share of the flux that each of `nodes` stands for; zeros where there is none.
    pub fn weights(&self, nodes: &[f64], weighting: Weighting) -> Vec<f64> {
        shares::of_nodes(nodes, self.weighted(weighting))
    }

    /// As [`super::Spectrum::tristimulus`], for 1 W of all rays.
    pub(super) fn seen_through(&self, nodes: &[f64], filter: &dyn Fn(f64) -> f64) -> Vec<[f64; 3]> {
        shares::tristimulus(nodes, self.flux.iter().copied(), filter)
    }

    /// The rays that are traced at `nodes[node]`, with their part of the flux there.
    ///
    /// # Errors
    /// If none has any.
    pub fn at(&self, nodes: &[f64], node: usize) -> Result<RaySet, tracer::Error> {
        let photometric = self.weighting == Weighting::Photometric;
        RaySet::new(self.records.iter().map(|ray| {
            let nm = nanometres(ray.wavelength);
            let mut part = shares::part(nodes, node, nm);
            if photometric {
                part *= photopic::v(nm);
            }
            RayRecord { flux: (f64::from(ray.flux) * part) as f32, ..*ray }
        }))
    }

    /// One line for people.
    pub fn describe(&self) -> String {
        let [low, high] = self.range_nm;
        let sampling = match self.sampling {
            None => "all of which are computed".to_owned(),
            Some(Sampling::Tolerance(t)) => {
                format!("shared by as many as a tolerance of {t} takes")
            }
            Some(Sampling::Samples(n)) => format!("shared by {n}"),
        };
        format!(
            "{} of a file, {} from {low} to {high} nm, {sampling}; {:.1} lm/W",
            count(self.rays, "ray"),
            count(self.wavelengths, "wavelength"),
            self.luminous_efficacy_lm_per_w
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(of: impl Iterator<Item = (f32, f32)>) -> Vec<RayRecord> {
        of.map(|(wavelength, flux)| RayRecord {
            position: [0.0; 3],
            direction: [0.0, 0.0, 1.0],
            flux,
            wavelength,
        })
        .collect()
    }

    #[test]
    fn few_wavelengths_are_all_computed() {
        let of = [(632.8, 1.0), (450.0, 3.0), (632.8, 2.0), (700.0, 0.0)];
        let found =
            ColouredRays::new(rays(of.into_iter()), Weighting::Radiometric, Sampling::Samples(3));
        assert_eq!(found.nodes(1), [450.0, 632.8]);
        assert_eq!((found.rays, found.sampling), (3, None));
        let nodes = found.nodes(1);
        assert_eq!(found.weights(&nodes, Weighting::Radiometric), [0.5, 0.5]);
        let v = [450.0, 632.8].map(photopic::v);
        let seen = found.weights(&nodes, Weighting::Photometric);
        assert!((seen[0] - v[0] / (v[0] + v[1])).abs() < 1e-15);
        let lumens = 683.0 * 0.5 * (v[0] + v[1]);
        assert!((found.luminous_efficacy_lm_per_w - lumens).abs() < 1e-10);
        // As they stand in the file, those of the other wavelength left out.
        let red = found.at(&nodes, 1).expect("rays");
        assert_eq!((red.len(), red.flux()), (2, 3.0));
    }

    #[test]
    fn flux_between_two_wavelengths_is_shared_without_moving_its_middle() {
        let of = (0..1001).map(|k| (400.0 + 0.3 * k as f32, 1.0 + (k % 7) as f32));
        for weighting in [Weighting::Radiometric, Weighting::Photometric] {
            let found = ColouredRays::new(rays(of.clone()), weighting, Sampling::Samples(7));
            assert_eq!(found.sampling, Some(Sampling::Samples(7)));
            let nodes = found.nodes(7);
            assert_eq!(nodes.len(), 7);
            let weights = found.weights(&nodes, weighting);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            // The sets that are traced carry these shares.
            let flux: Vec<f64> =
                (0..7).map(|k| found.at(&nodes, k).expect("rays").flux()).collect();
            let whole: f64 = flux.iter().sum();
            for (flux, weight) in flux.iter().zip(&weights) {
                assert!((flux / whole - weight).abs() < 1e-6, "{flux} {weight}");
            }
            // A linear function of the wavelength has its mean, but for the ends, which are drawn
            // in.
            let weighted = found.weighted(weighting);
            let mean = |of: &[(f64, f64)]| {
                let whole: f64 = of.iter().map(|p| p.1).sum();
                of.iter().map(|p| p.0 * p.1).sum::<f64>() / whole
            };
            let clamped: Vec<(f64, f64)> =
                weighted.iter().map(|&(nm, w)| (nm.clamp(nodes[0], nodes[6]), w)).collect();
            let traced: Vec<(f64, f64)> = nodes.iter().copied().zip(weights).collect();
            assert!((mean(&traced) - mean(&clamped)).abs() < 1e-9);
        }
    }
}
