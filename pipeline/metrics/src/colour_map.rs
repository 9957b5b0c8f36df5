// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of the bins of a map, put together until they can be told from noise.

use super::Grouped;
use super::chromaticity::{Chromaticity, Tristimulus};

/// Radius of the smallest circle in which colours count as one, Δu'v': one step of ANSI C78.377.
const ONE_STEP: f64 = 0.0011;
/// Errors of a resolved bin fit so often into the root mean square difference over the map.
const DISTINCT: f64 = 3.0;
/// Largest part of the light in bins that are not resolved.
const MAX_UNRESOLVED: f64 = 0.05;
/// Fewest bins along the longer edge.
const MIN_BINS: usize = 8;

/// A bin of a [`ColourMap`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourBin {
    /// X, Y and Z: means over the bins put together.
    pub xyz: [f64; 3],
    /// Chromaticity; `None` of a bin that is not resolved.
    pub colour: Option<Chromaticity>,
}

/// A map of colours in bins of so many recorded ones that they are resolved, as far as that goes.
///
/// A bin is resolved where the error of its chromaticity is at most 0.0011, or a third of the root
/// mean square difference over the map.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourMap {
    /// Recorded bins in one of these along the columns and the rows; fewer at the ends.
    pub together: [usize; 2],
    /// Bins along the columns and the rows.
    pub size: [usize; 2],
    /// Bins, row by row.
    pub bins: Vec<ColourBin>,
    /// Chromaticity of all light together.
    pub mean: Chromaticity,
}

impl ColourMap {
    /// The map of X, Y and Z in `columns` times `rows` bins, densities that `measures` weighs;
    /// `None` of light too faint to state its colour.
    pub fn new(
        colours: &[Grouped; 3],
        [columns, rows]: [usize; 2],
        measures: &[f64],
    ) -> Option<Self> {
        let whole = |bins: &[f64]| vec![bins.iter().zip(measures).map(|(v, m)| v * m).sum()];
        let whole = [0, 1, 2].map(|k| colours[k].map(whole));
        let mean = Tristimulus::of_bins(&whole)[0].chromaticity()?;
        let mut together = 1;
        loop {
            let wide = [columns, rows].map(|count| together.min(count));
            let size = [columns.div_ceil(wide[0]), rows.div_ceil(wide[1])];
            let merged = merged(colours, columns, wide, size, measures);
            let (bins, dark) = resolved(&Tristimulus::of_bins(&merged), mean);
            let is_coarse = size[0].max(size[1]) < 2 * MIN_BINS;
            if dark <= MAX_UNRESOLVED || is_coarse {
                return Some(Self { together: wide, size, bins, mean });
            }
            together *= 2;
        }
    }

    /// Difference of a bin from the mean in u' and v'.
    pub fn difference(&self, bin: usize) -> Option<[f64; 2]> {
        let uv = self.bins[bin].colour?.uv;
        Some([0, 1].map(|k| uv[k] - self.mean.uv[k]))
    }
}

/// Means over the bins put together.
fn merged(
    colours: &[Grouped; 3],
    columns: usize,
    wide: [usize; 2],
    size: [usize; 2],
    measures: &[f64],
) -> [Grouped; 3] {
    let place = |bin: usize| bin / columns / wide[1] * size[0] + bin % columns / wide[0];
    let mut whole = vec![0.0; size[0] * size[1]];
    for (bin, measure) in measures.iter().enumerate() {
        whole[place(bin)] += measure;
    }
    [0, 1, 2].map(|k| {
        colours[k].map(|bins| {
            let mut means = vec![0.0; whole.len()];
            for (bin, (value, measure)) in bins.iter().zip(measures).enumerate() {
                means[place(bin)] += value * measure / whole[place(bin)];
            }
            means
        })
    })
}

/// The bins, and the part of the light in those that are not resolved.
fn resolved(all: &[Tristimulus], mean: Chromaticity) -> (Vec<ColourBin>, f64) {
    let colours: Vec<Option<Chromaticity>> = all.iter().map(Tristimulus::chromaticity).collect();
    let (mut squares, mut known, mut light) = (0.0, 0.0, 0.0);
    for (bin, colour) in all.iter().zip(&colours) {
        let luminance = bin.xyz[1].max(0.0);
        light += luminance;
        if let Some(colour) = colour {
            let off: f64 = (0..2).map(|k| (colour.uv[k] - mean.uv[k]).powi(2)).sum();
            // Noise adds its variance to the mean square.
            squares += luminance * (off - colour.error().powi(2));
            known += luminance;
        }
    }
    let difference = (squares / known.max(f64::MIN_POSITIVE)).max(0.0).sqrt();
    let limit = ONE_STEP.max(difference / DISTINCT);
    let mut unresolved = 0.0;
    let bins = all.iter().zip(colours).map(|(bin, colour)| {
        let colour = colour.filter(|colour| colour.error() <= limit);
        if colour.is_none() {
            unresolved += bin.xyz[1].max(0.0);
        }
        ColourBin { xyz: bin.xyz, colour }
    });
    let bins = bins.collect();
    (bins, unresolved / light.max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maps of 32 x 32 bins: X rises along the rows by `tilt` of itself, each bin with this relative
    /// noise in X, Y and Z.
    fn map(tilt: f64, noise: f64) -> ColourMap {
        let mut rng = tracer::random::stream(29, 0);
        let mut normal = || (0..12).map(|_| tracer::random::unit(&mut rng)).sum::<f64>() - 6.0;
        let colours = [0, 1, 2].map(|k| {
            let group = |_| {
                let bin = |bin: usize| {
                    let slope = if k == 0 { tilt * ((bin % 32) as f64 / 31.0 - 0.5) } else { 0.0 };
                    (1.0 + slope) * (1.0 + 4.0 * noise * normal()) / 16.0
                };
                (0..1024).map(bin).collect()
            };
            Grouped::new((0..16).map(group).collect())
        });
        ColourMap::new(&colours, [32, 32], &[1.0; 1024]).expect("lit")
    }

    #[test]
    fn clear_colours_stay_in_their_bins() {
        let map = map(0.2, 1e-4);
        assert_eq!((map.together, map.size), ([1, 1], [32, 32]));
        assert!(map.bins.iter().all(|bin| bin.colour.is_some()));
        // u' = 4 X / (X + 18): from X = 0.9 to 1.1.
        let expected = 4.4 / 19.1 - 3.6 / 18.9;
        let ends = [31, 0].map(|bin| map.difference(bin).expect("resolved")[0]);
        assert!((ends[0] - ends[1] - expected).abs() < 3e-4, "{ends:?}");
    }

    #[test]
    fn noise_is_put_together_and_never_shown() {
        // One bin errs by 0.01 · 0.21 in u', and 4 x 4 bins by a fourth of that.
        let even = map(0.0, 0.01);
        assert!(even.together[0] > 1 && even.together[0] < 8, "{:?}", even.together);
        for bin in 0..even.bins.len() {
            let Some([u, v]) = even.difference(bin) else { continue };
            assert!(u.hypot(v) < 4.0 * ONE_STEP, "{u} {v}");
        }
        // No size of bins resolves this.
        let noisy = map(0.0, 0.5);
        assert!(noisy.size[0] < 2 * MIN_BINS && noisy.bins.iter().all(|bin| bin.colour.is_none()));
        // A large difference is seen through more noise.
        assert!(map(0.8, 0.01).together[0] < even.together[0]);
    }
}
