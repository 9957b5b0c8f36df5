// SPDX-License-Identifier: MIT OR Apache-2.0
//! The picture of `full_wave.json`.

use anyhow::{Context, Result};

use metrics::quantity::{Curve, Quantity, Unit};
use results::full_wave::{Comparison, FILE, FarField, FullWaveFile, Model, VERDICT_DEG};

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

/// Far fields of a comparison in bins of the verdict, whose names begin with that of the `dome`.
///
/// # Errors
/// A far field without these bins.
pub fn curves(dome: &str, comparison: &Comparison) -> Result<Vec<Curve>> {
    let curve = |far: &FarField| {
        let binned = far.of_verdict().with_context(|| format!("bins of {VERDICT_DEG}°"))?;
        let [shares, errors] = [&binned.shares, &binned.errors]
            .map(|values| values.iter().map(|v| v / VERDICT_DEG).collect::<Vec<f64>>());
        let middle = |i: usize| -90.0 + VERDICT_DEG * (i as f64 + 0.5);
        let x = (0..shares.len()).map(middle).collect();
        Curve::new(format!("{dome}{}", far.model.name()), x, shares, errors)
    };
    let curves = comparison.far_fields.iter().map(curve).collect::<Result<Vec<_>>>();
    curves.with_context(|| format!("`{FILE}`: far_fields"))
}

/// The far fields of the models in one picture.
///
/// # Errors
/// Curves that cannot be drawn.
pub fn far_field_picture(file: &FullWaveFile) -> Result<Picture> {
    let models = file.comparison.far_fields.iter().map(|far| far.model);
    far_field_cartesian(&plots::FarField {
        heading: &Heading::new(
            format!("{}: section by full wave and rays", file.design),
            format!("{}; bins of {VERDICT_DEG}°, mean of TE and TM", file.size()),
        ),
        quantity: &quantity(),
        curves: &curves("", &file.comparison)?,
        colours: LineColours::Models,
        numbers: &models.map(number).collect::<Vec<_>>(),
        peaks: &[],
    })
}
