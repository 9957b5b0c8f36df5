// SPDX-License-Identifier: MIT OR Apache-2.0
//! The picture of a tolerance analysis, from `tolerance.json`.

use anyhow::Result;

use metrics::Bounds;
use metrics::plural::count;
use results::shown::{self, named};
use results::tolerance::{BoundEntry, ToleranceResultsFile};

use super::plots::{Heading, MarkedValue, Picture, sample_distribution};

/// The distribution of the first figure over the packages, without the noise of the traces;
/// none where it has no scatter.
///
/// # Errors
/// Values that cannot be drawn.
pub fn distribution_picture(file: &ToleranceResultsFile) -> Result<Option<Picture>> {
    let Some(distribution) = &file.distribution else {
        return Ok(None);
    };
    let Some(figure) = file.figures.get(&distribution.figure) else {
        return Ok(None);
    };
    let nominal =
        MarkedValue { label: "without deviations".to_owned(), value: figure.nominal.value };
    let words = format!(
        "{}, {}; noise of the traces taken out",
        file.design,
        count(distribution.packages, "package")
    );
    sample_distribution(
        &Heading::new("Distribution over the tolerances", words),
        (&named(&distribution.figure).0, file.unit(&distribution.figure)),
        &distribution.shares,
        &nominal,
        &bounds(file, &distribution.figure),
    )
    .map(Some)
}

/// Bounds of a figure.
fn bounds(file: &ToleranceResultsFile, key: &str) -> Vec<MarkedValue> {
    let constraints = file.constraints.iter();
    let of_figure = constraints.filter(|constraint| constraint.figure == key);
    let unit = file.unit(key);
    let bounds = of_figure.flat_map(|&BoundEntry { at_least, at_most, .. }| {
        let both = [Bounds { at_least, at_most: None }, Bounds { at_least: None, at_most }];
        both.into_iter().filter_map(|bounds| {
            let value = bounds.at_least.or(bounds.at_most)?;
            Some(MarkedValue {
                label: format!("constraint: {}", shown::bounds(bounds, unit)),
                value,
            })
        })
    });
    bounds.collect()
}
