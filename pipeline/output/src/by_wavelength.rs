// SPDX-License-Identifier: MIT OR Apache-2.0
//! The far field at each wavelength of a spectral run, and of all wavelengths together.

use std::path::Path;

use anyhow::Result;

use arrays::csv;
use metrics::quantity::{Curve, Quantity, Unit};
use report::plots::{FarField, Heading, LineColours, far_field_cartesian};
use runtime::atomic_file::write_bytes;
use simulate::observation::Observation;

use super::labels::labels;

/// Table and picture of the same curves.
pub(super) const FILES: [&str; 2] = ["far_field_by_wavelength.csv", "far_field_by_wavelength.png"];

/// Most wavelengths in a picture.
const MAX_CURVES: usize = 8;

/// Writes [`FILES`] into `folder`: azimuthal means of `nodes` (source, wavelength in nm,
/// observation) and of their `sum`.
pub(super) fn write(
    folder: &Path,
    heading: &Heading,
    nodes: &[(Option<&str>, f64, &Observation)],
    sum: &Observation,
) -> Result<()> {
    let labels = labels(&nodes.iter().map(|(source, nm, _)| (*source, *nm)).collect::<Vec<_>>());
    let mut curves: Vec<Curve> = nodes
        .iter()
        .zip(&labels)
        .map(|((.., observation), label)| observation.azimuthal_mean(label))
        .collect::<Result<_>>()?;
    curves.push(sum.azimuthal_mean("all wavelengths")?);
    let quantity = Quantity::new("intensity per emitted flux", Unit::PerSteradian);
    let theta = Quantity::new("theta", Unit::Degree);
    csv::write_curves_csv(&folder.join(FILES[0]), &theta, &quantity, &curves)?;
    // A picture shows every second, fourth ... of many wavelengths, so that curves can be told
    // apart.
    let last = curves.len() - 1;
    let step = last.div_ceil(MAX_CURVES).next_power_of_two();
    let chosen = (step / 2..last).step_by(step).chain([last]);
    let shown: Vec<Curve> = chosen.map(|i| curves[i].mirrored()).collect::<Result<_>>()?;
    let picture = FarField {
        heading,
        quantity: &quantity,
        curves: &shown,
        colours: LineColours::OrderedAndSum,
        numbers: &[],
        peaks: &[],
    };
    write_bytes(&folder.join(FILES[1]), &far_field_cartesian(&picture)?.png()?)
}
