// SPDX-License-Identifier: MIT OR Apache-2.0
//! A traced far field as a photometric file.
//!
//! In: power in bins of direction for 1 W emitted. Out: an intensity at points of angle, in cd for a stated luminous flux of the sources. Bins hold means, files
//! hold values between which readers interpolate: polar angles are the middles of the bins, with 0 and 180 added; azimuths are the edges of the bins, where the two
//! neighbours are averaged. A common factor then makes the interpolated flux that of the bins. The axis of the package (+z) is γ = 0.

use crate::metrics::far_field::AngularBins;
use anyhow::{Result, bail, ensure};
use std::path::Path;
use tracer::Distribution;
use tracer::formats::{eulumdat, ies};

/// How a file states intensities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Photometry {
    /// Luminous flux of the sources, lm.
    pub lumens: f64,
    /// Absolute, else relative to the flux of the sources.
    pub absolute: bool,
}

/// A far field, and the factor that brought its interpolated flux to that of the bins.
pub struct FarField {
    /// Intensity in W/sr for 1 W emitted.
    pub table: Distribution,
    /// The factor, near 1.
    pub factor: f64,
}

/// Intensity from the power in the bins of `sphere`, W for 1 W emitted.
///
/// # Errors
/// If there is no power at all.
pub fn distribution(powers: &[f64], sphere: &AngularBins) -> Result<FarField> {
    let (polar, azimuths) = (sphere.polar, sphere.azimuths);
    ensure!(
        powers.len() == polar * azimuths,
        "far field: expected {polar} x {azimuths} bins, got {}",
        powers.len()
    );
    let intensity =
        |i: usize, j: usize| powers[i * azimuths + j] / sphere.ring_sr(i) * azimuths as f64;
    let mean = |i: usize| (0..azimuths).map(|j| intensity(i, j)).sum::<f64>() / azimuths as f64;
    let mut thetas = vec![0.0];
    thetas.extend(sphere.centres_deg());
    thetas.push(180.0);
    let phis: Vec<f64> = (0..azimuths)
        .map(|j| 360.0 * j as f64 / azimuths as f64)
        .collect();
    let mut values = Vec::with_capacity(thetas.len() * azimuths);
    for j in 0..azimuths {
        // The edge between the bins before and behind it; on the axis all azimuths are one.
        let before = (j + azimuths - 1) % azimuths;
        values.push(mean(0));
        values.extend((0..polar).map(|i| 0.5 * (intensity(i, before) + intensity(i, j))));
        values.push(mean(polar - 1));
    }
    let table = Distribution::new(&thetas, &phis, values)?;
    let factor = powers.iter().sum::<f64>() / table.flux();
    Ok(FarField {
        table: table.scaled(factor),
        factor,
    })
}

/// The text of a file, by the ending of `path`; `table` in cd for a source of `photometry.lumens`.
///
/// # Errors
/// If the ending is another than `.ies` and `.ldt`.
pub fn text(
    path: &Path,
    name: &str,
    table: &Distribution,
    photometry: Photometry,
    watts: f64,
) -> Result<String> {
    let maker = format!("batwing {}", env!("CARGO_PKG_VERSION"));
    match path.extension().and_then(|e| e.to_str()) {
        Some("ies") => {
            let keywords = [
                ("TEST", name),
                ("TESTLAB", &maker),
                ("ISSUEDATE", "not stated"),
                ("MANUFAC", &maker),
                ("LUMINAIRE", name),
                (
                    "OTHER",
                    "simulated; vertical angle 0 is the axis of the package",
                ),
            ]
            .map(|(k, v)| (k.to_owned(), v.to_owned()))
            .to_vec();
            let lumens = if photometry.absolute {
                -1.0
            } else {
                photometry.lumens
            };
            let file = ies::Ies::from_distribution(table, keywords, lumens, watts);
            Ok(ies::write(&file))
        }
        Some("ldt") => {
            let texts = [maker.as_str(), "", name, "", "", "simulated"].map(str::to_owned);
            // Absolute photometry knows no lamps: the flux stated is that of the luminaire, its light output ratio 100 %.
            let (count, flux) = if photometry.absolute {
                (-1, table.flux())
            } else {
                (1, photometry.lumens)
            };
            let lamps = eulumdat::Lamps { count, flux, watts };
            let file = eulumdat::Ldt::from_distribution(table, texts, lamps);
            Ok(eulumdat::write(&file))
        }
        _ => bail!(
            "`{}`: expected a file ending in .ies or .ldt",
            path.display()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::far_field::BinPlacement;

    #[test]
    fn a_lambertian_far_field_keeps_its_flux_and_its_shape() {
        let sphere = AngularBins {
            bin_deg: 2.0,
            polar: 90,
            azimuths: 36,
            bins: BinPlacement::Between,
        };
        let edge = |i: usize| (2.0 * i as f64).min(90.0).to_radians().sin().powi(2);
        let powers: Vec<f64> = (0..90 * 36)
            .map(|k| (edge(k / 36 + 1) - edge(k / 36)) / 36.0)
            .collect();
        let far = distribution(&powers, &sphere).expect("a far field");
        assert!((far.table.flux() - 1.0).abs() < 1e-12);
        assert!((far.factor - 1.0).abs() < 1e-3, "{}", far.factor);
        for theta in [0.0_f64, 10.0, 45.0, 80.0] {
            let d =
                tracer::glam::DVec3::new(theta.to_radians().sin(), 0.0, theta.to_radians().cos());
            let expected = theta.to_radians().cos() / std::f64::consts::PI;
            assert!((far.table.intensity(d) - expected).abs() < 1e-3);
        }
        for name in ["a.ies", "a.ldt"] {
            for absolute in [false, true] {
                let photometry = Photometry {
                    lumens: 250.0,
                    absolute,
                };
                let table = far.table.clone().scaled(250.0);
                let text = text(Path::new(name), "x", &table, photometry, 1.0).expect("a text");
                let back = if name == "a.ies" {
                    ies::read(&text).expect("valid").distribution()
                } else {
                    eulumdat::read(&text).expect("valid").distribution()
                };
                let flux = back.expect("a table").flux();
                assert!((flux / 250.0 - 1.0).abs() < 1e-6, "{name}: {flux}");
            }
        }
    }
}
