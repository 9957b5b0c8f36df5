// SPDX-License-Identifier: MIT OR Apache-2.0
//! The page of a film stack: what it sends back and lets through over the angle.

use anyhow::Result;
use serde_json::{Value, json};

use metrics::Estimate;
use metrics::digits::{shortest, thousands};
use metrics::quantity::{Curve, Quantity, Unit};
use results::film_stack::{FilmStackFile, StackShares};
use results::shown;

use super::pictures::Album;
use crate::plots::{FarField, Heading, LineColours, far_field_cartesian};

/// Pictures and table of `file` for the template.
///
/// # Errors
/// Curves that cannot be drawn.
pub fn film_stack(album: &mut Album, file: &FilmStackFile) -> Result<Value> {
    let heading = |title: &str| {
        let nm = shortest(file.wavelength_nm);
        Heading::new(format!("{}: {title}", file.design), format!("film stack by rays, {nm} nm"))
    };
    let mut drawn = |title: &str, quantity: Quantity, curves: Vec<Curve>, caption: &str| {
        let picture = far_field_cartesian(&FarField {
            heading: &heading(title),
            quantity: &quantity,
            curves: &curves,
            colours: LineColours::Models,
            numbers: &[],
            peaks: &[],
        })?;
        anyhow::Ok(album.fixed(&picture, caption))
    };
    let (mut shares, mut intensities) = (Vec::new(), Vec::new());
    for (side, own) in file.over_angle.each() {
        let angles = || own.iter().map(|row| row.theta_deg);
        let transmitted: Vec<Estimate> = own.iter().map(|row| row.shares.transmittance).collect();
        let reflected = own.iter().map(|row| row.shares.reflectance).collect();
        for (part, all) in [("transmitted", transmitted), ("reflected", reflected)] {
            shares.push(curve(&format!("{part}, from {side}"), angles(), all.into_iter())?);
        }
    }
    for (side, own) in file.normal_incidence.each() {
        for (part, bins) in [("transmitted", &own.transmitted), ("reflected", &own.reflected)] {
            let step = 90.0 / bins.len() as f64;
            let middles = (0..bins.len()).map(|bin| step * (bin as f64 + 0.5));
            intensities.push(curve(
                &format!("{part}, from {side}"),
                middles,
                bins.iter().copied(),
            )?);
        }
    }
    let over_angle = drawn(
        "over the angle of incidence",
        Quantity::new("share of the incident power", Unit::Fraction),
        shares,
        "What the stack lets through and sends back over the angle of incidence, the mean over all azimuths, with two standard errors.",
    )?;
    let normal = drawn(
        "light along the normal",
        Quantity::new("intensity of what leaves", Unit::PerSteradian),
        intensities,
        "Intensity of what leaves for unit power along the normal, the mean over all azimuths, with two standard errors. Light that passes straight lies in the first bin.",
    )?;
    Ok(json!({
        "design": file.design,
        "wavelength": shortest(file.wavelength_nm),
        "paths": thousands(file.paths_of_an_incidence),
        "error": format!("{:.1e}", file.largest_standard_error),
        "pictures": [over_angle, normal],
        "rows": rows(file),
    }))
}

fn curve(
    label: &str,
    at: impl Iterator<Item = f64>,
    all: impl Iterator<Item = Estimate>,
) -> Result<Curve> {
    let (values, errors) = all.map(|one| (one.value, one.standard_error)).unzip();
    Curve::new(label, at.collect(), values, errors)
}

/// Diffuse light, then each angle: name, and transmittance, reflectance and absorptance from below and
/// from above.
fn rows(file: &FilmStackFile) -> Vec<Value> {
    let texts = |both: [&StackShares; 2]| {
        let each = both.map(|own| [own.transmittance, own.reflectance, own.absorptance]);
        let each = each.into_iter().flatten();
        each.map(|share| shown::estimate(share, Unit::Fraction)).collect::<Vec<_>>()
    };
    let diffuse = file.diffuse_light.each().map(|(_, own)| own);
    let [below, above] = file.over_angle.each().map(|(_, own)| own);
    let angles = below.iter().zip(above).map(|(below, above)| {
        let texts = texts([&below.shares, &above.shares]);
        json!({"name": format!("{}°", shortest(below.theta_deg)), "shares": texts})
    });
    let first = json!({"name": "diffuse", "shares": texts(diffuse)});
    std::iter::once(first).chain(angles).collect()
}
