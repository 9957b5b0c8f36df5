// SPDX-License-Identifier: MIT OR Apache-2.0
//! What of a halo the glare of the eye itself hides.

use metrics::glare::{Glare, Viewing};
use metrics::{Estimate, JackknifedFigure};

use super::{PanelBeforeZones, Role, light_of};
use crate::estimates::biased;
use crate::panel_colour::Account;
use crate::superposition::{Piece, RowOfGroups, rows_of_parts};

impl PanelBeforeZones<'_> {
    /// The share of the halo that lies below the veil of the eye which looks at what is wanted of this
    /// `luminance` ([`metrics::glare`]); `None` without black beside bright, or without a halo. Light is
    /// that of [`Self::show`].
    pub(in super::super) fn hidden(
        &self,
        pieces: &[Vec<Piece>],
        white: &[f64],
        luminance: &[f64],
        viewing: Viewing,
    ) -> Option<Estimate> {
        let (bins, groups) = (self.frame.bins, white.len() - 1);
        let Viewing { distance_mm, observer } = viewing;
        // Without the halo, which is what may be hidden.
        let wanted = |(bin, shown): (usize, &f64)| shown.min(self.wanted_y((bin, groups), white));
        let wanted: Vec<f64> = luminance.iter().enumerate().map(wanted).collect();
        let glare = Glare::new(&wanted, bins, self.frame.bin_mm, distance_mm, observer);
        let veil = glare.veils(|bin| self.roles[bin] == Role::Black);
        // Sums of the halo and of what of it lies below the veil, by readings.
        let read = |y: usize, rows: &[RowOfGroups]| {
            let totals: Vec<Vec<f64>> = rows.iter().map(RowOfGroups::total).collect();
            let mut sums = vec![[0.0; 2]; groups + 3];
            let mut light = vec![0.0; rows.len()];
            for x in (0..bins[0]).filter(|x| self.roles[y * bins[0] + x] == Role::Black) {
                let bin = y * bins[0] + x;
                for (number, sum) in sums.iter_mut().enumerate() {
                    let reading = number.min(groups);
                    light_of(rows, &totals, (x, reading), &mut light);
                    // The last two have more light before less veil, and less before more.
                    let more = [0.0, 1.0, -1.0][number - reading];
                    let light = self.with_beyond((bin, &light), more, None);
                    let veil = veil[bin] * (1.0 - more * self.beyond.of_white);
                    let at = (bin, reading);
                    let halo = self.shown(at, &light, white[reading], &mut Account::default())[1];
                    sum[0] += halo.max(0.0);
                    sum[1] += halo.max(0.0).min(veil);
                }
            }
            sums
        };
        let mut sums = vec![[0.0; 2]; groups + 3];
        for row in rows_of_parts(bins, groups, pieces, read) {
            sums.iter_mut().zip(row).for_each(|(sum, row)| *sum = [0, 1].map(|k| sum[k] + row[k]));
        }
        let mut shares: Vec<f64> = sums.iter().map(|[halo, below]| below / halo).collect();
        let ends = shares.split_off(groups + 1);
        let share = shares.pop().filter(|share| share.is_finite())?;
        // Of no light at all nothing is hidden, or all.
        let off = |end: &f64| if end.is_nan() { 1.0 } else { (end - share).abs() };
        let estimate = JackknifedFigure::new(share, shares).estimate();
        Some(biased(estimate, ends.iter().map(off).fold(0.0, f64::max)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::level_image::LevelImage;
    use metrics::glare::Observer;

    use crate::map_receiver::Frame;
    use crate::reference::LightOff;
    use crate::responses::ChannelLight;
    use crate::superposition::{ANYWHERE, Block, Turn};
    use crate::{BeyondLight, PatternPicture};

    /// Columns and rows of bins of half a millimetre: a telephone, seen from 300 mm.
    const BINS: [usize; 2] = [256, 144];
    const DISTANCE_MM: f64 = 300.0;
    /// Bins of a side of a bright window.
    const WINDOW: usize = 8;

    /// Share of the halo that is hidden where a square zone of so many bins about the window shines, on a
    /// panel of this contrast.
    fn share(window: usize, zone: usize, contrast: f64) -> f64 {
        let square = |side: usize| {
            let is_in = |k: usize, bin: usize| {
                let first = (BINS[k] - side) / 2;
                (first..first + side).contains(&bin)
            };
            let level =
                |k: usize| f64::from(u8::from(is_in(0, k % BINS[0]) && is_in(1, k / BINS[0])));
            (0..BINS[0] * BINS[1]).map(level).collect::<Vec<f64>>()
        };
        let image = LevelImage { columns: BINS[0], rows: BINS[1], levels: square(window) };
        let frame = Frame { bins: BINS, bin_mm: [0.5; 2], low_mm: [0.0; 2] };
        let light = ChannelLight::whole();
        let none = BeyondLight { parts: vec![LightOff::anywhere(0.0, BINS)], of_white: 0.0 };
        let whole = ([[1, 1]; 2], BINS.map(|bins| [0.0, 0.5 * bins as f64]));
        let picture = PatternPicture::Grey(&image, contrast);
        let panel = PanelBeforeZones::new(frame, whole, (&light, none), picture);
        let half: Vec<f64> = square(zone).iter().map(|level| 0.5 * level).collect();
        let block = Block::new(BINS, &[half.clone(), half], 0.0);
        let turn = Turn::default();
        let piece = Piece { block: &block, turn, at: [0; 2], within: ANYWHERE, weight: 1.0 };
        let observer = Observer { age_years: 25.0, pigment: 0.5 };
        let viewing = Viewing { distance_mm: DISTANCE_MM, observer };
        let white = [1.0; 3];
        let seen = panel.hidden(&[vec![piece]], &white, &vec![1.0; image.levels.len()], viewing);
        seen.expect("black beside bright").value
    }

    /// Zones by which the panel is parted, if the largest that hide all of the halo part it.
    fn zones(window: usize, contrast: f64) -> f64 {
        let hides = |half: usize| share(window, 2 * half, contrast) > 1.0 - 1e-9;
        // Halves of sides: one that hides its halo, and one that does not.
        let [mut small, mut large] = [window / 2 + 1, BINS[1] / 2];
        assert!(hides(small) && !hides(large));
        while large - small > 1 {
            let half = usize::midpoint(small, large);
            if hides(half) { small = half } else { large = half }
        }
        let side = 2.0 * small as f64;
        (BINS[0] * BINS[1]) as f64 / (side * side)
    }

    /// A halo of 1 over the contrast is hidden as far as the window's veil is brighter: the zone's corner
    /// lies where E (10/θ³ + 5.13/θ² + ...) is that. So 2000:1 asks for 2.5^⅔ to 2.5 times the zones of
    /// 5000:1, whatever the window. (G. Tan et al., Opt. Express 26, 16572 (2018), state 15 times, from
    /// 200 to 3000, by another criterion.)
    #[test]
    fn zones_that_hide_a_halo_are_those_of_the_veil() {
        let [good, poor] = [5000.0, 2000.0].map(|contrast| zones(WINDOW, contrast));
        for (contrast, found) in [(5000.0, good), (2000.0, poor)] {
            let solid_angle = (0.5 * WINDOW as f64 / DISTANCE_MM).powi(2);
            let by_age = 1.0 + 0.4f64.powi(4);
            let veil = |deg: f64| {
                let near = 10.0 / deg.powi(3) + (5.0 / deg.powi(2) + 0.05 / deg) * by_age + 0.00125;
                solid_angle * near
            };
            let mut deg = 0.2;
            while veil(deg) > 1.0 / contrast {
                deg += 1e-3;
            }
            let side = 2f64.sqrt() * DISTANCE_MM * deg.to_radians().tan();
            let expected = 0.25 * (BINS[0] * BINS[1]) as f64 / (side * side);
            assert!((found / expected - 1.0).abs() < 0.12, "{contrast}: {found} {expected}");
        }
        assert!((1.7..2.6).contains(&(poor / good)), "{good} {poor}");
        // Control: the veil of twice the window hides larger zones.
        assert!(zones(2 * WINDOW, 5000.0) < 0.6 * good);
    }
}
