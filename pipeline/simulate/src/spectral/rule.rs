// SPDX-License-Identifier: MIT OR Apache-2.0
//! Quadrature over wavelength: the nodes at which the lights of a design are traced, and their
//! weights.

use design::spectrum::Sampling;
use design::spectrum::lights::{Light, Lights};
use design::spectrum::quadrature::COUNTS;

/// A wavelength of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// Number of the light.
    pub light: usize,
    /// Number of wavelengths of the light.
    pub of: usize,
    /// Vacuum wavelength, nm.
    pub nm: f64,
    /// Weight: a share of the flux of all lights.
    pub weight: f64,
}

/// Nodes of all lights; those of one light are adjacent and ascend.
pub(super) type Rule = Vec<Node>;

/// Nodes of all lights. Lights sampled to a tolerance have `count` wavelengths; others have their
/// stated number, or with `lower` the number before it.
pub(super) fn rule(lights: &Lights, count: usize, lower: bool) -> Rule {
    let of = |(number, light): (usize, &Light)| {
        let count = match light.light.sampling() {
            Some(Sampling::Samples(stated)) if lower => before(stated).unwrap_or(stated),
            Some(Sampling::Samples(stated)) => stated,
            Some(Sampling::Tolerance(_)) | None => count,
        };
        let share = lights.share(light, lights.weighting);
        nodes(number, light.light.rule(count), share)
    };
    lights.lights.iter().enumerate().flat_map(of).collect()
}

/// One wavelength for each light, where nothing depends on it.
pub(super) fn medians(lights: &Lights) -> Rule {
    let all = lights.lights.iter().enumerate();
    let of = |(number, light): (usize, &Light)| {
        let median = vec![(light.light.median_nm(), 1.0)];
        nodes(number, median, lights.share(light, lights.weighting))
    };
    all.flat_map(of).collect()
}

/// Nodes of a light with this share of the flux.
fn nodes(light: usize, rule: Vec<(f64, f64)>, share: f64) -> Rule {
    let of = rule.len();
    let node = |(nm, weight): (f64, f64)| Node { light, of, nm, weight: share * weight };
    rule.into_iter().map(node).collect()
}

/// The next smaller number of wavelengths.
pub(super) fn before(count: usize) -> Option<usize> {
    COUNTS.iter().copied().rfind(|&n| n < count)
}

/// The fewest wavelengths that a run may take.
pub(super) fn smallest_rule(lights: &Lights) -> Rule {
    rule(lights, COUNTS[1], false)
}

/// True if any light's sampling satisfies `is`.
pub(super) fn any(lights: &Lights, is: impl Fn(Sampling) -> bool) -> bool {
    let mut all = lights.lights.iter();
    all.any(|light| light.light.sampling().is_some_and(&is))
}

/// True if the sum is compared with a rule of fewer wavelengths.
pub(super) fn compares(lights: &Lights) -> bool {
    any(lights, |sampling| match sampling {
        Sampling::Tolerance(_) => true,
        Sampling::Samples(count) => before(count).is_some(),
    })
}

/// The smallest tolerance that a light is sampled to.
pub(super) fn tolerance(lights: &Lights) -> Option<f64> {
    let tolerances = lights.lights.iter().filter_map(|light| {
        let Some(Sampling::Tolerance(tolerance)) = light.light.sampling() else {
            return None;
        };
        Some(tolerance)
    });
    tolerances.min_by(f64::total_cmp)
}
