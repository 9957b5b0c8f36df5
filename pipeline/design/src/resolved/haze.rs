// SPDX-License-Identifier: MIT OR Apache-2.0
//! Faces of a checked design that have the haze and the transmittance of a data sheet.
//!
//! A film in air has a smooth face of the reflectance R₀, a medium that lets a pass along the normal,
//! and the face in question with the transmittance t and the reflectance r. All light between the
//! faces goes along the normal, as the face mirrors what it reflects. So
//!
//! T = (1 - R₀) a t/(1 - a² R₀ r), R = R₀ + (1 - R₀)² a² r/(1 - a² R₀ r),
//!
//! which give t and r for a stated T and R, or T and a face without loss, r = 1 - t.

use bsdf::GaussianLobe;
use metrics::digits::shortest;

use crate::check::Context;
use crate::error::ConfigError;

/// Rounding of a sum of shares.
const ROUNDING: f64 = 1e-12;

/// A face as stated.
#[derive(Debug, Clone)]
pub(crate) struct StatedHaze {
    /// Key of its table.
    pub(crate) table: String,
    /// Transmittance of the film in air.
    pub(crate) transmittance: f64,
    /// Its reflectance, if it is stated.
    pub(crate) reflectance: Option<f64>,
    /// Share of the transmitted light in the lobe.
    pub(crate) scattered: f64,
    /// The lobe in air.
    pub(crate) lobe: GaussianLobe,
}

impl StatedHaze {
    /// Reflectance and transmittance of the face on a film of this index, whose medium lets
    /// `internal` pass along the normal.
    ///
    /// # Errors
    /// Values that no face gives.
    pub(crate) fn shares(
        &self,
        (index, internal): (f64, f64),
        at: &Context,
    ) -> Result<[f64; 2], ConfigError> {
        let smooth = ((index - 1.0) / (index + 1.0)).powi(2);
        let twice = internal * internal;
        let enters = (1.0 - smooth) * internal;
        let key = |name: &str| format!("{}.{name}", self.table);
        let of_index = format!("a smooth face of index {}", shortest(index));
        // Of light that goes to and fro, what passes in all per what passes at once.
        let again = |reflected: f64| 1.0 / (1.0 - twice * smooth * reflected);
        let reflected = match self.reflectance {
            Some(stated) => {
                let range = [smooth, smooth + enters * enters * again(1.0)];
                if !(range[0] - ROUNDING..=range[1] + ROUNDING).contains(&stated) {
                    let [least, most] = range;
                    let expected = format!("{least:.4} to {most:.4}, of a film with {of_index}");
                    return Err(at.value(&key("total_reflectance"), stated, &expected));
                }
                let gain = (stated - smooth).max(0.0) / (enters * enters);
                (gain / (1.0 + twice * smooth * gain)).min(1.0)
            }
            None => 0.0,
        };
        let most = (1.0 - reflected) * enters * again(reflected);
        if self.transmittance > most + ROUNDING {
            let others = self.reflectance.map_or("", |_| ", and `total_reflectance`");
            let expected =
                format!("at most {most:.4}, what {of_index} and the medium{others} leave");
            return Err(at.value(&key("total_transmittance"), self.transmittance, &expected));
        }
        if self.reflectance.is_some() {
            return Ok([reflected, self.transmittance / (enters * again(reflected))]);
        }
        if self.transmittance == 0.0 {
            return Ok([1.0, 0.0]);
        }
        let passed = self.transmittance * (1.0 - twice * smooth)
            / (enters - twice * smooth * self.transmittance);
        Ok([1.0 - passed, passed])
    }
}
