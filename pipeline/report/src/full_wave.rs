// SPDX-License-Identifier: MIT OR Apache-2.0
//! The picture of `full_wave.json`.

use anyhow::{Context, Result};

use metrics::quantity::{Curve, Quantity, Unit};
use results::full_wave::{FILE, FarField, FullWaveFile, Model, VERDICT_DEG};

use super::plots::{self, Heading, LineColours, Picture, far_field_cartesian};

/// Number of a model's colour: hybrid and rays as in runs.
fn number(model: Model) -> usize {
    match model {
        Model::Rays => 0,
        Model::FullWave => 2,
        Model::Hybrid => 3,
    }
}

/// Quantity of the curves.
pub fn quantity() -> Quantity {
    Quantity::new("share of the power per degree", Unit::Relative)
}

/// Far fields in bins of the verdict.
///
/// # Errors
/// Bins that are no whole number of those of the file.
pub fn curves(file: &FullWaveFile) -> Result<Vec<Curve>> {
    let curve = |far: &FarField| {
        let per_degree = |all: Vec<f64>| all.into_iter().map(|v| v / VERDICT_DEG).collect();
        let (bins, errors) = far.in_bins(VERDICT_DEG);
        let [bins, errors]: [Vec<f64>; 2] = [per_degree(bins), per_degree(errors)];
        let middle = |i: usize| -90.0 + VERDICT_DEG * (i as f64 + 0.5);
        let x = (0..bins.len()).map(middle).collect();
        Curve::new(far.model.name(), x, bins, errors)
    };
    let curves = file.comparison.far_fields.iter().map(curve).collect::<Result<Vec<_>>>();
    curves.with_context(|| format!("`{FILE}`: comparison.far_fields"))
}

/// The far fields of the models in one picture.
///
/// # Errors
/// Curves that cannot be drawn.
pub fn far_field_picture(file: &FullWaveFile) -> Result<Picture> {
    let models = file.comparison.far_fields.iter().map(|far| far.model);
    far_field_cartesian(&plots::FarField {
        heading: &Heading::new(
            format!("{}: section by three models", file.design),
            format!("{}; bins of {VERDICT_DEG}°, mean of TE and TM", file.size()),
        ),
        quantity: &quantity(),
        curves: &curves(file)?,
        colours: LineColours::Models,
        numbers: &models.map(number).collect::<Vec<_>>(),
        peaks: &[],
    })
}
