// SPDX-License-Identifier: MIT OR Apache-2.0
//! Radiometric and photometric names of what the receivers saw, and the factors from watts.
//!
//! A trace emits 1 W from all sources of all packages together. Where the design states what its
//! LEDs emit, readings are scaled by that; otherwise they are per watt. In photometric units the
//! flux is the radiant one times the luminous efficacy of the light, of all lights by their powers;
//! observations weighted by P V(λ) are shares of it, so that the factor is the same for every
//! direction and place.

use design::Design;
use design::spectrum::lights::Lights;
use metrics::kinds::Weighting;
use metrics::photopic::LUMENS_PER_WATT;
use metrics::quantity::{Quantity, Unit};
use results::schema::Emitted;

/// Units of far fields and maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    weighting: Weighting,
    /// Radiant flux that all sources emit, W.
    emitted_w: f64,
    /// Flux that they emit, W or lm; of converted light in lumens that of as much at 555 nm.
    emitted: f64,
    /// Flux that they emit, lm, where readings are shares of it.
    emitted_lm: Option<f64>,
}

impl Units {
    /// Units of `design`, in the weighting that its `lights` ask for; without lights radiometric.
    pub fn from_design(design: &Design, lights: Option<&Lights>) -> Self {
        let units = Self::new(design.emitted_w(), lights);
        if design.converts_in_lumens { units.of_colours() } else { units }
    }

    fn new(emitted_w: f64, lights: Option<&Lights>) -> Self {
        let photometric = lights.filter(|lights| lights.weighting == Weighting::Photometric);
        let emitted_lm = photometric.map(|lights| emitted_w * lights.emitted_lm());
        Self {
            weighting: photometric.map_or(Weighting::Radiometric, |lights| lights.weighting),
            emitted_w,
            emitted: emitted_lm.unwrap_or(emitted_w),
            emitted_lm,
        }
    }

    /// Units of X, Y and Z, of which Y is the luminous quantity in any weighting.
    #[must_use]
    pub fn of_colours(&self) -> Self {
        Self {
            weighting: Weighting::Photometric,
            emitted: self.emitted_w * LUMENS_PER_WATT,
            ..*self
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

    /// Factor from W/(mm² sr).
    pub fn per_radiance(&self) -> f64 {
        self.emitted * 1e6
    }

    /// Factor from W.
    pub fn per_flux(&self) -> f64 {
        self.emitted
    }

    /// Factor from W/sr.
    pub fn per_intensity(&self) -> f64 {
        self.emitted
    }

    /// Factor from W/mm².
    pub fn per_irradiance(&self) -> f64 {
        match self.weighting {
            Weighting::Radiometric => self.emitted,
            // A lux is a lumen on a square metre.
            Weighting::Photometric => self.emitted * 1e6,
        }
    }

    /// Unit in which a radiometric quantity is stated, and the factor from the quantity per watt.
    pub fn of_unit(&self, unit: Unit) -> (Unit, f64) {
        match unit {
            Unit::Watt => (self.flux().unit(), self.per_flux()),
            Unit::WattPerSteradian => (self.intensity().unit(), self.per_intensity()),
            Unit::WattPerSquareMillimetre => (self.irradiance().unit(), self.per_irradiance()),
            Unit::WattPerSquareMetreSteradian => (self.radiance().unit(), self.per_radiance()),
            // All light together is 1 W, or 1 lm.
            Unit::CandelaPerKilolumen => (unit, 1000.0),
            other => (other, 1.0),
        }
    }

    /// Flux that all sources emit; luminous flux in photometric units only.
    pub fn emitted(&self) -> Emitted {
        Emitted { emitted_w: self.emitted_w, emitted_lm: self.emitted_lm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use design::spectrum::{SpectralPower, Spectrum};

    #[test]
    fn a_watt_of_green_is_683_lumens() {
        let source = SpectralPower::Lines { wavelength_nm: vec![555.0], power: vec![1.0] };
        let green = Spectrum::new(source, Weighting::Photometric, None).expect("valid");
        let lights = Lights::together(&green);
        let units = Units::new(1.0, Some(&lights));
        assert!((units.per_intensity() - 683.0).abs() < 1e-9);
        assert!((units.per_irradiance() - 683e6).abs() < 1e-3);
        assert_eq!(units.intensity().key(), "luminous_intensity_cd");
        assert_eq!(units.irradiance().key(), "illuminance_lx");
        assert_eq!(units.radiance().key(), "luminance_cd_per_m2");
        assert_eq!(units.flux().key(), "luminous_flux_lm");
        assert!((units.per_radiance() - 683e6).abs() < 1e-3);
        assert!(units.emitted().emitted_lm.is_some());
        let watt = Emitted { emitted_w: 1.0, emitted_lm: None };
        assert_eq!(Units::new(1.0, None).emitted(), watt);
        let half = Units::new(0.5, Some(&lights));
        assert!((half.per_intensity() - 341.5).abs() < 1e-9);
        assert!((half.emitted().emitted_w - 0.5).abs() < 1e-15);
    }
}
