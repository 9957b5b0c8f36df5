// SPDX-License-Identifier: MIT OR Apache-2.0
//! Drives of zones from the picture that they stand behind.
//!
//! A pixel of the colour XYZ (Y = 1 for white) needs the drives n = max(0, min(1, N XYZ)) of the
//! channels. With three channels behind red, green and blue sub-pixels N is the inverse of the matrix
//! of X, Y and Z that each channel alone shows on the open panel; with other numbers of channels all
//! need the largest of the picture's own red, green and blue. The drive of a zone is, over the n of
//! the pixels whose middles lie in it,
//!
//! | rule | drive |
//! |---|---|
//! | max | max n |
//! | mean | Σ n / number |
//! | rms | (Σ n² / number)^½ |
//! | percentile p | the smallest n that p % of the pixels do not exceed |
//!
//! Where the power, a sum over channels by the light that each emits at full white, exceeds its
//! limit, one factor lowers all drives.

use anyhow::{Result, ensure};
use rayon::prelude::*;

use super::MIN_DRIVE;
pub use super::needs::Needs;
use super::picture::PictureLight;

/// How pixels of a zone give its drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// The largest.
    Max,
    /// The mean.
    Mean,
    /// The root of the mean square.
    Rms,
    /// The drive that this percentage of the pixels do not exceed.
    Percentile(f64),
}

impl Rule {
    fn drive(self, needs: &mut [f64]) -> f64 {
        let count = needs.len() as f64;
        match self {
            Self::Max => needs.iter().copied().fold(0.0, f64::max),
            Self::Mean => needs.iter().sum::<f64>() / count,
            Self::Rms => (needs.iter().map(|n| n * n).sum::<f64>() / count).sqrt(),
            Self::Percentile(p) => {
                let rank = (0.01 * p * count - 1e-9).ceil().max(1.0) as usize;
                *needs.select_nth_unstable_by(rank - 1, f64::total_cmp).1
            }
        }
    }
}

/// Drives of `zones` for each of the channels, whose shares of the power at full white are `powers`;
/// at most `limit` of it. There are no fewer pixels than zones ([`check_size`]).
pub fn from_picture(
    picture: &PictureLight,
    zones: [usize; 2],
    (rule, needs): (Rule, Needs),
    (powers, limit): (&[f64], f64),
) -> Vec<Vec<f64>> {
    let size = [picture.columns, picture.rows];
    // Pixels from the first to the last whose middle lies in a zone.
    let range = |k: usize, zone: usize| {
        let first = |zone: usize| ((zone * size[k]) as f64 / zones[k] as f64 - 0.5).ceil() as usize;
        first(zone)..first(zone + 1)
    };
    let channels = powers.len();
    let of_zone = |zone: usize| -> Vec<f64> {
        let mut needs_of = vec![Vec::new(); if needs.by_channel { channels } else { 1 }];
        for j in range(1, zone / zones[0]) {
            for i in range(0, zone % zones[0]) {
                let need = needs.of(picture.xyz[j * size[0] + i]);
                needs_of.iter_mut().zip(need).for_each(|(all, need)| all.push(need));
            }
        }
        let drives: Vec<f64> = needs_of.iter_mut().map(|needs| rule.drive(needs)).collect();
        (0..channels).map(|channel| drives[channel % drives.len()]).collect()
    };
    let by_zone: Vec<Vec<f64>> = (0..zones[0] * zones[1]).into_par_iter().map(of_zone).collect();
    let mut drives: Vec<Vec<f64>> =
        (0..channels).map(|c| by_zone.iter().map(|zone| zone[c]).collect()).collect();
    let power = power_share(&drives, powers);
    let factor = if power > limit { limit / power } else { 1.0 };
    for drive in drives.iter_mut().flatten() {
        *drive *= factor;
        if *drive < MIN_DRIVE {
            *drive = 0.0;
        }
    }
    drives
}

/// Refuses a picture from `file` with a zone without pixels.
///
/// # Errors
/// Fewer pixels than zones along an axis.
pub fn check_size(size: [usize; 2], zones: [usize; 2], file: &str) -> Result<()> {
    ensure!(
        (0..2).all(|k| size[k] >= zones[k]),
        "`{file}`: --levels: expected a pixel or more in every zone of {} x {}, got {} x {} pixels",
        zones[0],
        zones[1],
        size[0],
        size[1]
    );
    Ok(())
}

/// Power of these drives of each channel over that of full white.
pub fn power_share(drives: &[Vec<f64>], powers: &[f64]) -> f64 {
    let mean = |drives: &Vec<f64>| drives.iter().sum::<f64>() / drives.len() as f64;
    let part = drives.iter().zip(powers).map(|(drives, power)| power * mean(drives));
    part.sum::<f64>() / powers.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Zones of two by two pixels: what the formulas give by hand.
    #[test]
    fn rules_are_their_formulas() {
        let levels = [0.0f32, 0.2, 0.6, 0.4, 1.0, 0.0, 0.0, 0.0];
        let xyz = levels.map(|level| [level; 3]).to_vec();
        let picture = PictureLight { columns: 4, rows: 2, xyz };
        let drives_of = |rule, limit| {
            from_picture(&picture, [2, 1], (rule, Needs::GREY), (&[1.0], limit)).concat()
        };
        for (rule, expected) in [
            (Rule::Max, [1.0, 0.6]),
            (Rule::Mean, [0.3, 0.25]),
            (Rule::Rms, [0.26f64.sqrt(), 0.13f64.sqrt()]),
            (Rule::Percentile(75.0), [0.2, 0.4]),
            (Rule::Percentile(100.0), [1.0, 0.6]),
        ] {
            let drives = drives_of(rule, 1.0);
            let is_near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-7;
            assert!(drives.iter().zip(expected).all(is_near), "{rule:?}: {drives:?}");
        }
        // Half of the power: the mean of 1.0 and 0.6 is 0.8.
        let drives = drives_of(Rule::Max, 0.4);
        assert!((drives[0] - 0.5).abs() < 1e-7 && (drives[1] - 0.3).abs() < 1e-7, "{drives:?}");
        let few = check_size([4, 2], [2, 4], "p");
        assert!(few.expect_err("too few").to_string().contains("got 4 x 2 pixels"));
    }
}
