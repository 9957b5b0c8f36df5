// SPDX-License-Identifier: MIT OR Apache-2.0
//! Diffusers by their haze, checked: the lobe, and the share of the transmitted light in it.

use bsdf::{GaussianLobe, HAZE_DEG};

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::haze::StatedHaze;
use crate::schema::solids::HazeKeys;
use metrics::digits::shortest;

/// What the table `table` states.
pub(super) fn resolve(
    stated: &HazeKeys,
    table: &str,
    at: &Context,
) -> Result<StatedHaze, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let share = |name: &str, value: f64| at.within(&key(name), value, 0.0, 1.0);
    let haze = share("haze", stated.haze)?;
    let lobe = match stated.scattered_width_deg {
        None => GaussianLobe::with_share_beyond(HAZE_DEG, haze),
        Some(width_deg) => {
            let [least, most] = GaussianLobe::WIDTHS_DEG;
            at.within(&key("scattered_width_deg"), width_deg, least, most)?;
            let lobe = GaussianLobe::new(width_deg);
            lobe.map_err(|error| at.of_files(&anyhow::Error::new(error)))?
        }
    };
    let most = lobe.share_beyond(HAZE_DEG);
    if haze > most * (1.0 + 1e-9) {
        let lobe = stated.scattered_width_deg.map_or("the widest lobe".to_owned(), |width_deg| {
            format!("a lobe {} degrees wide", shortest(width_deg))
        });
        let expected = format!(
            "at most {most:.4}, which {lobe} sends more than {HAZE_DEG} degrees off the beam"
        );
        return Err(at.value(&key("haze"), haze, &expected));
    }
    Ok(StatedHaze {
        table: table.to_owned(),
        transmittance: share("total_transmittance", stated.total_transmittance)?,
        reflectance: stated
            .total_reflectance
            .map(|value| share("total_reflectance", value))
            .transpose()?,
        scattered: if haze > 0.0 { (haze / most).min(1.0) } else { 0.0 },
        lobe,
    })
}
