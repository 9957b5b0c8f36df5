// SPDX-License-Identifier: MIT OR Apache-2.0
//! Radiometric and photometric names of what the receivers saw, and the factors from watts.
//!
//! All sources together emit 1 W of radiant power in any case. In photometric units that is the
//! luminous efficacy of their light in lumens, of all lights by their powers; observations weighted
//! by P V(λ) are shares of this flux, so that the factor is the same for every direction and place.

use crate::quantity::{Quantity, Unit};
use crate::results::schema::Emitted;
use crate::spectrum::Weighting;
use crate::spectrum::lights::Lights;

/// Units of far fields and maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    weighting: Weighting,
    /// Flux that all sources emit, W or lm.
    emitted: f64,
}

impl Units {
    /// Watts.
    pub const RADIOMETRIC: Self = Self {
        weighting: Weighting::Radiometric,
        emitted: 1.0,
    };

    /// Those that the lights ask for.
    pub fn of(lights: &Lights) -> Self {
        match lights.weighting {
            Weighting::Radiometric => Self::RADIOMETRIC,
            Weighting::Photometric => Self {
                weighting: Weighting::Photometric,
                emitted: lights.emitted_lm(),
            },
        }
    }

    /// Radiant intensity or luminous intensity.
    pub fn intensity(&self) -> Quantity {
        match self.weighting {
            Weighting::Radiometric => Quantity::new("intensity", Unit::WattPerSteradian),
            Weighting::Photometric => Quantity::new("luminous intensity", Unit::Candela),
        }
    }

    /// Irradiance or illuminance.
    pub fn irradiance(&self) -> Quantity {
        match self.weighting {
            Weighting::Radiometric => Quantity::new("irradiance", Unit::WattPerSquareMillimetre),
            Weighting::Photometric => Quantity::new("illuminance", Unit::Lux),
        }
    }

    /// Radiance or luminance.
    pub fn radiance(&self) -> Quantity {
        match self.weighting {
            Weighting::Radiometric => Quantity::new("radiance", Unit::WattPerSquareMetreSteradian),
            Weighting::Photometric => Quantity::new("luminance", Unit::CandelaPerSquareMetre),
        }
    }

    /// Radiant or luminous flux.
    pub fn flux(&self) -> Quantity {
        match self.weighting {
            Weighting::Radiometric => Quantity::new("flux", Unit::Watt),
            Weighting::Photometric => Quantity::new("luminous flux", Unit::Lumen),
        }
    }

    /// What W/(mm² sr) are multiplied by.
    pub fn per_radiance(&self) -> f64 {
        self.emitted * 1e6
    }

    /// What W/sr and W are multiplied by.
    pub fn per_intensity(&self) -> f64 {
        self.emitted
    }

    /// What W/mm² are multiplied by.
    pub fn per_irradiance(&self) -> f64 {
        match self.weighting {
            Weighting::Radiometric => self.emitted,
            // A lux is a lumen on a square metre.
            Weighting::Photometric => self.emitted * 1e6,
        }
    }

    /// Flux that all sources emit; luminous flux in photometric units only.
    pub fn emitted(&self) -> Emitted {
        let photometric = self.weighting == Weighting::Photometric;
        Emitted {
            emitted_w: 1.0,
            emitted_lm: photometric.then_some(self.emitted),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::{SpectralPower, Spectrum};

    #[test]
    fn a_watt_of_green_is_683_lumens() {
        let source = SpectralPower::Lines {
            wavelength_nm: vec![555.0],
            power: vec![1.0],
        };
        let green = Spectrum::new(source, Weighting::Photometric, None).expect("valid");
        let units = Units::of(&Lights::together(&green));
        assert!((units.per_intensity() - 683.0).abs() < 1e-9);
        assert!((units.per_irradiance() - 683e6).abs() < 1e-3);
        assert_eq!(units.intensity().key(), "luminous_intensity_cd");
        assert_eq!(units.irradiance().key(), "illuminance_lx");
        assert_eq!(units.radiance().key(), "luminance_cd_per_m2");
        assert_eq!(units.flux().key(), "luminous_flux_lm");
        assert!((units.per_radiance() - 683e6).abs() < 1e-3);
        assert!(units.emitted().emitted_lm.is_some());
        let watt = Emitted {
            emitted_w: 1.0,
            emitted_lm: None,
        };
        assert_eq!(Units::RADIOMETRIC.emitted(), watt);
    }
}
