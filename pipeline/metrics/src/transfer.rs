// SPDX-License-Identifier: MIT OR Apache-2.0
//! Transfer functions of pictures: light of a level, and the level of light.
//!
//! | transfer | light of level v |
//! |---|---|
//! | sRGB | v/12.92 up to v = 0.04045, then ((v + 0.055)/1.055)^2.4 (IEC 61966-2-1) |
//! | linear | v |
//! | gamma g | v^g |
//! | PQ | (max(v^(1/m₂) - c₁, 0) / (c₂ - c₃ v^(1/m₂)))^(1/m₁) of 10 000 cd/m² (ITU-R BT.2100, table 4) |

/// Luminance of the level 1 of PQ, cd/m².
pub const PQ_PEAK: f64 = 10_000.0;
/// Constants m₁, m₂, c₁, c₂ and c₃ of PQ.
const M1: f64 = 2610.0 / 16_384.0;
const M2: f64 = 2523.0 / 4096.0 * 128.0;
const C1: f64 = 3424.0 / 4096.0;
const C2: f64 = 2413.0 / 4096.0 * 32.0;
const C3: f64 = 2392.0 / 4096.0 * 32.0;

/// How levels of a picture, from 0 to 1, stand for light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transfer {
    /// That of sRGB.
    Srgb,
    /// Levels are light.
    Linear,
    /// A power of the level.
    Gamma(f64),
    /// Perceptual quantiser, of absolute luminance.
    Pq,
}

impl Transfer {
    /// Light of a level from 0 to 1, over that of level 1.
    pub fn light(self, level: f64) -> f64 {
        match self {
            Self::Srgb if level <= 0.040_45 => level / 12.92,
            Self::Srgb => ((level + 0.055) / 1.055).powf(2.4),
            Self::Linear => level,
            Self::Gamma(gamma) => level.powf(gamma),
            Self::Pq => {
                let root = level.powf(1.0 / M2);
                ((root - C1).max(0.0) / (C2 - C3 * root)).powf(1.0 / M1)
            }
        }
    }

    /// The level from 0 to 1 of light over that of level 1.
    pub fn level(self, light: f64) -> f64 {
        let light = light.max(0.0);
        match self {
            Self::Srgb if light <= 0.003_130_8 => 12.92 * light,
            Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
            Self::Linear => light,
            Self::Gamma(gamma) => light.powf(1.0 / gamma),
            Self::Pq => {
                let power = light.powf(M1);
                ((C1 + C2 * power) / (1.0 + C3 * power)).powf(M2)
            }
        }
    }

    /// Luminance of level 1, cd/m², of a transfer that states it.
    pub fn peak_cd_m2(self) -> Option<f64> {
        (self == Self::Pq).then_some(PQ_PEAK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PQ of BT.2100, as ITU-R BT.2408 prints it to a tenth of a percent; sRGB at the levels of IEC
    /// 61966-2-1.
    #[test]
    fn levels_and_light_are_the_published_ones() {
        for (nits, percent) in
            [(0.0, 0.0), (1.0, 15.0), (10.0, 30.0), (100.0, 50.8), (203.0, 58.1), (1000.0, 75.2)]
        {
            let found = 100.0 * Transfer::Pq.level(nits / PQ_PEAK);
            assert!((found - percent).abs() < 0.06, "{nits}: {found}");
        }
        assert!((Transfer::Pq.light(1.0) - 1.0).abs() < 1e-12);
        assert!((Transfer::Srgb.light(0.5) - 0.214_041).abs() < 1e-6);
        assert!((Transfer::Gamma(2.2).light(0.5) - 0.217_638).abs() < 1e-6);
        let stated = [Transfer::Pq, Transfer::Srgb].map(Transfer::peak_cd_m2);
        assert_eq!(stated, [Some(10_000.0), None]);
    }

    #[test]
    fn every_level_comes_back() {
        for transfer in [Transfer::Srgb, Transfer::Linear, Transfer::Gamma(2.4), Transfer::Pq] {
            for code in 0..=1023 {
                let level = f64::from(code) / 1023.0;
                let back = transfer.level(transfer.light(level));
                // The two parts of sRGB meet at 0.04045 to 1e-7; below 1e-6 PQ is flat.
                assert!((back - level).abs() < 2e-6, "{transfer:?} {level}: {back}");
            }
        }
    }
}
