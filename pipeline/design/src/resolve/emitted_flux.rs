// SPDX-License-Identifier: MIT OR Apache-2.0
//! `led.power_w`, `led.power_lm` and `led.electrical_w`: what the sources of one package emit and take.

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::EmittedFlux;
use crate::schema::reflectors::LedKeys;
use crate::spectrum::Spectrum;
use crate::spectrum::lights::Lights;

/// Least and largest flux of a package, W or lm.
const FLUX: [f64; 2] = [1e-12, 1e9];

/// The flux in watts and in lumens; `None` where the design states neither. `lights` are those of
/// the sources, `design` is the light of all where there are none.
pub(crate) fn resolve(
    led: &LedKeys,
    lights: Option<&Lights>,
    design: &Spectrum,
    at: &Context,
) -> Result<Option<EmittedFlux>, ConfigError> {
    // All lights together emit 1 W.
    let lm_per_w = lights.map_or(design.luminous_efficacy_lm_per_w, Lights::emitted_lm);
    let within = |key: &str, flux: f64| at.within(key, flux, FLUX[0], FLUX[1]);
    let radiant_w = match (led.power_w, led.power_lm) {
        (None, None) => {
            let beside = "it beside `power_w` or `power_lm`";
            let alone = led.electrical_w.map(|watts| at.value("led.electrical_w", watts, beside));
            return alone.map_or(Ok(None), Err);
        }
        (Some(_), Some(_)) => {
            return Err(at.value("led.power_lm", "beside `power_w`", "one of the two"));
        }
        (Some(w), None) => within("led.power_w", w)?,
        (None, Some(lm)) => {
            within("led.power_lm", lm)?;
            if lm_per_w <= 0.0 {
                let expected = "light between 360 and 830 nm, of which lumens can be stated, or \
                                `power_w`";
                return Err(at.value("led.power_lm", lm, expected));
            }
            lm / lm_per_w
        }
    };
    let of_light = |watts: f64| at.within("led.electrical_w", watts, radiant_w, FLUX[1]);
    let electrical_w = led.electrical_w.map(of_light).transpose()?;
    Ok(Some(EmittedFlux { radiant_w, luminous_lm: radiant_w * lm_per_w, electrical_w }))
}
