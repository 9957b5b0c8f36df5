// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colour filters before a backlight of several channels: the light that each sub-pixel passes, and
//! how far to open it to come nearest to a wanted colour.
//!
//! Where channel c sends the light b_c, sub-pixels that are open by l_s show
//!
//! XYZ = Σ_c b_c Σ_s F_cs (k_s + (1 - k_s) l_s),
//!
//! with X, Y and Z of its light behind the open sub-pixel, F_cs, and what that passes closed over
//! open, k_s. So black leaks in the colour of the backlight.
//!
//! Openings are those of the least Σ (ΔX² + ΔY² + ΔZ²) within 0 to 1: the wanted colour itself where it
//! can be shown. Each one by itself, held within 0 to 1, would do as well beside white light; before
//! zones of one channel, where all sub-pixels show nearly one colour, it would open and close them
//! at random.

use metrics::chromaticity;
use metrics::gamut::{Matrix, apply, inverse};
use rayon::prelude::*;

/// Sub-pixels: red, green and blue, or in any order.
pub const SUB_PIXELS: usize = 3;

/// Light of all sub-pixels for each channel of the backlight.
#[derive(Debug, Clone, PartialEq)]
pub struct SubPixels {
    /// X, Y and Z (rows) of each open sub-pixel (columns) for light of 1 of each channel.
    open: Vec<Matrix>,
    /// The same of closed ones.
    closed: Vec<Matrix>,
}

impl SubPixels {
    /// Sub-pixels that pass these X, Y and Z (rows: sub-pixels) of light of 1 of each channel; `closed`
    /// is what each passes closed, over open.
    pub fn of_open(channels: &[Matrix], closed: [f64; SUB_PIXELS]) -> Self {
        let columns = |open: &Matrix| [0, 1, 2].map(|k| [0, 1, 2].map(|s| open[s][k]));
        let open: Vec<Matrix> = channels.iter().map(columns).collect();
        let leaks = |open: &Matrix| open.map(|row| [0, 1, 2].map(|s| row[s] * closed[s]));
        Self { closed: open.iter().map(leaks).collect(), open }
    }

    /// The panel before `light` of the channels.
    pub fn before(&self, light: &[f64]) -> LitPixel {
        let (mut dark, mut span) = ([0.0; 3], [[0.0; 3]; 3]);
        for ((light, open), closed) in light.iter().zip(&self.open).zip(&self.closed) {
            for k in 0..3 {
                for s in 0..SUB_PIXELS {
                    dark[k] += light * closed[k][s];
                    span[k][s] += light * (open[k][s] - closed[k][s]);
                }
            }
        }
        LitPixel { dark, span }
    }
}

/// The sub-pixels of one place before its light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitPixel {
    /// X, Y and Z of black, with all sub-pixels closed.
    pub dark: [f64; 3],
    /// X, Y and Z (rows) that each sub-pixel (columns) adds from closed to open.
    span: Matrix,
}

impl LitPixel {
    /// X, Y and Z of sub-pixels that are open so far, from 0 to 1 as light.
    pub fn at(&self, openings: [f64; SUB_PIXELS]) -> [f64; 3] {
        let light = apply(&self.span, openings);
        [0, 1, 2].map(|k| self.dark[k] + light[k])
    }

    /// x and y of the primaries as displayed, each with the others closed; `None` in the dark.
    pub fn primaries(&self) -> Option<[[f64; 2]; SUB_PIXELS]> {
        let of = |s: usize| chromaticity::xy(self.at([0, 1, 2].map(|k| f64::from(k == s))));
        Some([of(0)?, of(1)?, of(2)?])
    }

    /// What comes nearest to `wanted`, both X, Y and Z.
    pub fn show(&self, wanted: [f64; 3]) -> [f64; 3] {
        self.at(self.openings(wanted))
    }

    /// Openings of the sub-pixels, from 0 to 1 as light, that come nearest to `wanted`.
    fn openings(&self, wanted: [f64; 3]) -> [f64; SUB_PIXELS] {
        /// Openings beyond 0 and 1 by so little are rounding.
        const ROUNDING: f64 = 1e-9;
        let light = [0, 1, 2].map(|k| wanted[k] - self.dark[k]);
        let openings = inverse(&self.span).map(|inverse| apply(&inverse, light));
        let is_within = |opening: &f64| (-ROUNDING..=1.0 + ROUNDING).contains(opening);
        match openings.filter(|openings| openings.iter().all(is_within)) {
            Some(openings) => openings.map(|opening| opening.clamp(0.0, 1.0)),
            None => nearest(&self.span, light),
        }
    }

    /// The mean of two, with this part of the second.
    fn between(&self, other: &Self, part: f64) -> Self {
        let mix = |a: f64, b: f64| a + part * (b - a);
        let row = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| mix(a[k], b[k]));
        Self {
            dark: row(self.dark, other.dark),
            span: [0, 1, 2].map(|k| row(self.span[k], other.span[k])),
        }
    }
}

/// The levels within 0 to 1 of the least squares of `span` · levels - `wanted`, where the wanted light
/// is out of reach. Each level is 0, 1 or free, and free ones solve their normal equations: the best
/// of these combinations is the answer. Where columns are parallel, one with fewer free levels is as
/// good.
fn nearest(span: &Matrix, wanted: [f64; 3]) -> [f64; SUB_PIXELS] {
    let column = |s: usize| [span[0][s], span[1][s], span[2][s]];
    let product = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let columns = [0, 1, 2].map(column);
    let gram = columns.map(|a| columns.map(|b| product(a, b)));
    let right = columns.map(|a| product(a, wanted));
    // Slopes of half the squares at black and at white: nothing helps beyond these corners.
    if right.iter().all(|v| *v <= 0.0) {
        return [0.0; 3];
    }
    if (0..3).all(|s| gram[s].iter().sum::<f64>() <= right[s]) {
        return [1.0; 3];
    }
    let mut best = (f64::INFINITY, [0.0; 3]);
    let mut judge = |levels: [f64; 3]| {
        if levels.iter().all(|level| (0.0..=1.0).contains(level)) {
            // Half the squares less a constant.
            let squares: f64 =
                (0..3).map(|s| levels[s] * (0.5 * product(gram[s], levels) - right[s])).sum();
            if squares < best.0 {
                best = (squares, levels);
            }
        }
    };
    for corner in 0..8 {
        let bound = [0, 1, 2].map(|s| f64::from(corner >> s & 1));
        // What is left of the normal equation of s, with s and `other` at 0.
        let rest = |s: usize, other: usize| {
            let fixed = (0..3).filter(|k| *k != s && *k != other);
            right[s] - fixed.map(|k| gram[s][k] * bound[k]).sum::<f64>()
        };
        judge(bound);
        for s in (0..3).filter(|s| bound[*s] == 0.0) {
            let mut levels = bound;
            levels[s] = rest(s, s) / gram[s][s];
            judge(levels);
            let t = (s + 1) % 3;
            let determinant = gram[s][s] * gram[t][t] - gram[s][t] * gram[s][t];
            if bound[t] == 0.0 && determinant > 1e-12 * gram[s][s] * gram[t][t] {
                let (of_s, of_t) = (rest(s, t), rest(t, s));
                levels[s] = (of_s * gram[t][t] - of_t * gram[s][t]) / determinant;
                levels[t] = (of_t * gram[s][s] - of_s * gram[s][t]) / determinant;
                judge(levels);
            }
        }
    }
    best.1
}

/// What a panel did to a picture, as sums of luminance over its places.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Account {
    /// Luminance of the picture.
    pub wanted: f64,
    /// Luminance that is wanted and not shown.
    pub missing: f64,
    /// Luminance that is shown and not wanted.
    pub leaking: f64,
}

impl Account {
    /// Adds a place, both luminances.
    pub fn add(&mut self, wanted: f64, shown: f64) {
        self.wanted += wanted;
        self.missing += (wanted - shown).max(0.0);
        self.leaking += (shown - wanted).max(0.0);
    }

    /// Adds the places of another.
    pub fn join(&mut self, other: &Self) {
        self.wanted += other.wanted;
        self.missing += other.missing;
        self.leaking += other.leaking;
    }
}

/// The panel before bins of a backlight, which pixels see linearly between the middles of bins.
pub struct Backlight {
    size: [usize; 2],
    /// Lower end of the panel and its length along x and y, in bins from the lower edge of the first.
    area: [[f64; 2]; 2],
    places: Vec<LitPixel>,
}

impl Backlight {
    /// The panel over this `area` (lower end and length along x and y, in bins from the lower edge of
    /// the first) before `columns` times `rows` places, row by row.
    ///
    /// # Panics
    /// If there are not so many places, or none.
    pub fn new([columns, rows]: [usize; 2], area: [[f64; 2]; 2], places: Vec<LitPixel>) -> Self {
        assert!(places.len() == columns * rows && !places.is_empty(), "places of another size");
        Self { size: [columns, rows], area, places }
    }

    /// Shows a picture of `columns` times `rows` pixels over the panel, of which `wanted` gives X, Y and
    /// Z at a column and a row; rows of what `read` makes of X, Y and Z of a pixel.
    pub fn show<T: Send>(
        &self,
        [columns, rows]: [usize; 2],
        wanted: impl Fn(usize, usize) -> [f64; 3] + Sync,
        read: impl Fn([f64; 3]) -> T + Sync,
    ) -> Vec<Vec<T>> {
        let across: Vec<(usize, f64)> = (0..columns).map(|i| self.bin(0, i, columns)).collect();
        let row = |j: usize| {
            let (below, part) = self.bin(1, j, rows);
            let count = self.size[0];
            let above = (below + 1).min(self.size[1] - 1);
            let of_row = |row: usize| &self.places[row * count..(row + 1) * count];
            let pairs = of_row(below).iter().zip(of_row(above));
            let places: Vec<LitPixel> = pairs.map(|(a, b)| a.between(b, part)).collect();
            let pixel = |(i, (left, part)): (usize, &(usize, f64))| {
                let right = (left + 1).min(count - 1);
                read(places[*left].between(&places[right], *part).show(wanted(i, j)))
            };
            across.iter().enumerate().map(pixel).collect()
        };
        (0..rows).into_par_iter().map(row).collect()
    }

    /// The bin whose middle lies before that of a pixel, and the part of the next; the outermost
    /// bins reach to the edge.
    fn bin(&self, axis: usize, pixel: usize, pixels: usize) -> (usize, f64) {
        let count = self.size[axis];
        let [low, length] = self.area[axis];
        let at = low + (pixel as f64 + 0.5) * length / pixels as f64 - 0.5;
        let at = at.clamp(0.0, (count - 1) as f64);
        (at as usize, at.fract())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use metrics::colour_matching;
    use metrics::gamut::{BT709, BT2020, D65, shares};
    use metrics::transfer::Transfer;
    use tracer::random::{stream, unit};

    /// Lasers at the primaries of BT.2020, in three channels of 1 W, behind filters that pass 0.9 of one
    /// and `rest` of the others.
    fn lasers(rest: f64, closed: f64) -> SubPixels {
        let bands = [[580.0, 780.0], [490.0, 580.0], [380.0, 490.0]];
        let behind = |nm: f64| {
            let open = |[low, high]: [f64; 2]| if (low..high).contains(&nm) { 0.9 } else { rest };
            bands.map(|band| colour_matching::xyz(nm).map(|v| 683.0 * open(band) * v))
        };
        SubPixels::of_open(&[630.0, 532.0, 467.0].map(behind), [closed; 3])
    }

    /// X, Y and Z of white.
    fn white(pixel: &LitPixel) -> [f64; 3] {
        pixel.at([1.0; SUB_PIXELS])
    }

    /// True if all sub-pixels are open for this light.
    fn is_open(pixel: &LitPixel, wanted: [f64; 3]) -> bool {
        pixel.openings(wanted).iter().all(|opening| *opening >= 1.0)
    }

    /// Channels of lasers that make the white D65.
    fn white_light(panel: &SubPixels, luminance: f64) -> Vec<f64> {
        let columns =
            [0, 1, 2].map(|c| white(&panel.before(&[0, 1, 2].map(|k| f64::from(k == c)))));
        let matrix = [0, 1, 2].map(|k| columns.map(|column| column[k]));
        let wanted = chromaticity::xyz_of_xy(D65).map(|v| luminance * v);
        apply(&inverse(&matrix).expect("three colours"), wanted).to_vec()
    }

    /// X, Y and Z of a laser are those of its wavelength times 683 lm/W and the filter. Behind perfect
    /// filters the primaries are those of BT.2020, which are monochromatic to three digits; behind
    /// filters that pass a tenth of the others they cover less.
    #[test]
    fn lasers_behind_filters_reach_what_their_spectra_say() {
        let panel = lasers(0.0, 0.0);
        let found = white(&panel.before(&[0.0, 2.0, 0.0]));
        let expected = colour_matching::xyz(532.0).map(|v| 2.0 * 683.0 * 0.9 * v);
        assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-9 * expected[1]), "{found:?}");
        let coverage = |panel: &SubPixels| {
            let place = panel.before(&white_light(panel, 500.0));
            let [in_xy, in_uv] = shares(place.primaries().expect("lit"), &BT2020);
            [in_xy.coverage, in_uv.coverage]
        };
        assert!(coverage(&panel).iter().all(|share| *share > 0.995), "{:?}", coverage(&panel));
        assert!(coverage(&lasers(0.09, 0.0)).iter().all(|share| *share < 0.8));
        // The light of channels adds up.
        let leaky = lasers(0.02, 1e-3);
        let whole = leaky.before(&[3.0, 1.0, 2.0]).at([0.2, 0.7, 0.4]);
        let parts = [[3.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
        let parts = parts.map(|light| leaky.before(&light).at([0.2, 0.7, 0.4]));
        for k in 0..3 {
            let sum: f64 = parts.iter().map(|part| part[k]).sum();
            assert!((sum - whole[k]).abs() < 1e-12 * whole[k]);
        }
        assert_eq!(panel.before(&[0.0; 3]).primaries(), None);
    }

    /// The picture of a flat backlight is the wanted one: no code of 8 bits changes where contrast is
    /// high; with 5000 only black is off, by the light that leaks.
    #[test]
    fn a_flat_backlight_shows_the_wanted_picture() {
        let code = |v: f64| (255.0 * v).round();
        for (transfer, closed, largest) in [
            (Transfer::Srgb, 0.0, 0.0),
            (Transfer::Srgb, 1e-6, 0.0),
            (Transfer::Gamma(2.2), 0.0, 0.0),
            (Transfer::Linear, 0.0, 0.0),
            (Transfer::Pq, 0.0, 0.0),
            (Transfer::Srgb, 1.0 / 5000.0, 1.0),
        ] {
            let panel = lasers(0.01, closed);
            let full = panel.before(&white_light(&panel, 1.02e4));
            let peak = transfer.peak_cd_m2().unwrap_or(1e4);
            let to_xyz = BT709.to_xyz(D65).map(|row| row.map(|value| peak * value));
            let back = inverse(&to_xyz).expect("primaries");
            let (mut worst, mut account) = (0.0f64, Account::default());
            for k in 0..18 * 18 * 18 {
                let codes = [k % 18, k / 18 % 18, k / 324].map(|c| f64::from(15 * c));
                let wanted = apply(&to_xyz, codes.map(|code| transfer.light(code / 255.0)));
                let shown = full.show(wanted);
                account.add(wanted[1], shown[1]);
                let seen = apply(&back, shown).map(|light| code(transfer.level(light)));
                worst = (0..3).map(|k| (seen[k] - codes[k]).abs()).fold(worst, f64::max);
            }
            assert!(worst <= largest, "{transfer:?} {closed}: {worst}");
            let share = (account.missing + account.leaking) / account.wanted;
            assert!(share < 1e-4, "{transfer:?} {closed}: {share}");
        }
        // Openings by themselves come back.
        let full = lasers(0.01, 0.0).before(&white_light(&lasers(0.01, 0.0), 300.0));
        let openings = full.openings(full.at([0.25, 0.5, 0.75]));
        assert!((0..3).all(|k| (openings[k] - 0.25 * (k as f64 + 1.0)).abs() < 1e-12));
    }

    #[test]
    fn black_leaks_in_the_colour_of_the_backlight() {
        let panel = lasers(0.0, 1e-3);
        let place = panel.before(&white_light(&panel, 400.0));
        assert!(place.openings([0.0; 3]).iter().all(|opening| *opening == 0.0));
        let full = white(&place);
        for (full, dark) in full.iter().zip(place.dark) {
            assert!((full / dark - 1000.0).abs() < 1e-9);
        }
        let mut account = Account::default();
        account.add(0.0, place.show([0.0; 3])[1]);
        let bright = full.map(|v| 2.0 * v);
        account.add(bright[1], place.show(bright)[1]);
        assert!(is_open(&place, bright));
        let expected =
            Account { wanted: bright[1], missing: bright[1] - full[1], leaking: place.dark[1] };
        let mut joined = Account::default();
        joined.join(&account);
        assert_eq!((account, joined), (expected, expected));
    }

    /// Levels out of reach against steepest descent within the box, also of parallel columns: before
    /// one channel alone, and in the dark.
    #[test]
    fn levels_out_of_reach_are_the_least_squares() {
        let mut rng = stream(41, 0);
        let mut draw = || unit(&mut rng);
        for k in 0..400 {
            let mut span = [0, 1, 2].map(|_| [0, 1, 2].map(|_| draw()));
            match k % 4 {
                1 => span = span.map(|[a, ..]| [a, 0.02 * a, 0.01 * a]),
                2 => span = span.map(|[a, b, _]| [a, b, 0.0]),
                _ => {}
            }
            let wanted = [0, 1, 2].map(|_| 4.0 * draw() - 1.5);
            let place = LitPixel { dark: [0.0; 3], span };
            let squares = |levels: [f64; 3]| -> f64 {
                let seen = place.at(levels);
                (0..3).map(|k| (seen[k] - wanted[k]).powi(2)).sum()
            };
            let found = place.openings(wanted);
            let mut levels = [0.5; 3];
            for _ in 0..20_000 {
                let seen = place.at(levels);
                for s in 0..3 {
                    let slope: f64 = (0..3).map(|k| span[k][s] * (seen[k] - wanted[k])).sum();
                    levels[s] = (levels[s] - 0.1 * slope).clamp(0.0, 1.0);
                }
            }
            let (best, reached) = (squares(found), squares(levels));
            assert!(best <= reached + 1e-12, "{k}: {best} {reached}");
            assert!(found.iter().all(|opening| (0.0..=1.0).contains(opening)));
        }
        let night = LitPixel { dark: [0.0; 3], span: [[0.0; 3]; 3] }.show([1.0; 3]);
        assert!(night.iter().all(|v| *v == 0.0));
        // A red zone shows a wanted white as bright as it can, and a red as wanted.
        let panel = lasers(0.01, 1e-4);
        let red = panel.before(&[1.0, 0.0, 0.0]);
        assert!(is_open(&red, [500.0; 3]));
        let wanted = white(&red).map(|v| 0.5 * v);
        let shown = red.show(wanted);
        assert!((0..3).all(|k| (shown[k] - wanted[k]).abs() < 1e-9 * wanted[0]), "{shown:?}");
    }

    /// A backlight linear over the panel is seen so by every pixel within the middles of its bins.
    #[test]
    fn pixels_see_the_backlight_between_bins() {
        let panel = lasers(0.0, 0.0);
        let bins = [5, 3];
        let light = |x: f64, y: f64| [1.0 + x, 2.0 + y, 1.0];
        let places = (0..15).map(|k| {
            let middle = |k: usize, count: usize| (k as f64 + 0.5) / count as f64;
            panel.before(&light(middle(k % 5, 5), middle(k / 5, 3)))
        });
        let whole = [[0.0, 5.0], [0.0, 3.0]];
        let backlight = Backlight::new(bins, whole, places.collect());
        let bright = |_, _| [1e9; 3];
        let rows = backlight.show([20, 12], bright, |xyz| xyz);
        assert_eq!(rows.len(), 12);
        for (row, shown) in rows.iter().enumerate() {
            for (column, shown) in shown.iter().enumerate() {
                let clamp = |at: f64, count: f64| at.clamp(0.5 / count, 1.0 - 0.5 / count);
                let x = clamp((column as f64 + 0.5) / 20.0, 5.0);
                let y = clamp((row as f64 + 0.5) / 12.0, 3.0);
                let expected = white(&panel.before(&light(x, y)));
                for (shown, expected) in shown.iter().zip(expected) {
                    assert!((shown / expected - 1.0).abs() < 1e-12, "{column} {row}");
                }
            }
        }
        // The edges of a panel may lie within bins: pixels see the light of their own place.
        let places = (0..5).map(|i| panel.before(&light(f64::from(i) + 0.5, 0.0)));
        let cut = Backlight::new([5, 1], [[0.4, 4.0], [0.0, 1.0]], places.collect());
        let shown = cut.show([40, 1], bright, |xyz| xyz).concat();
        for (column, shown) in shown.iter().enumerate() {
            let x = (0.4 + (column as f64 + 0.5) / 10.0).clamp(0.5, 4.5);
            let expected = white(&panel.before(&light(x, 0.0)));
            let is_near = |k: usize| (shown[k] / expected[k] - 1.0).abs() < 1e-12;
            assert!((0..3).all(is_near), "{column}");
        }
        // One bin lights all.
        let whole = [[0.0, 1.0]; 2];
        let one = Backlight::new([1, 1], whole, vec![panel.before(&[1.0; 3])]);
        let [left, right] = one.show([2, 1], bright, |xyz| xyz).concat()[..] else { panic!("two") };
        assert!((0..3).all(|k| (left[k] / right[k] - 1.0).abs() < 1e-12), "{left:?} {right:?}");
    }
}
