// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colour filters before a backlight of several channels: the light that each sub-pixel passes, and
//! the levels that come nearest to a wanted colour.
//!
//! Where channel c sends the light b_c, sub-pixels at the levels l_s show
//!
//! XYZ = Σ_c b_c Σ_s F_cs (k_cs + (1 - k_cs) l_s),  F_cs = Σ p_c(λ) T_s(λ) (x̄, ȳ, z̄)(λ) / Σ p_c(λ),
//!
//! with the spectrum p_c of the channel, the transmittance T_s of the open sub-pixel on its part of
//! the panel, and what it passes closed over open, k_cs. So black leaks in the colour of the backlight.
//!
//! Levels are those of the least Σ (ΔX² + ΔY² + ΔZ²) within 0 to 1: the wanted colour itself where it
//! can be shown. Each level by itself, held within 0 to 1, would do as well beside white light; before
//! zones of one channel, where all sub-pixels show nearly one colour, it would open and close them
//! at random.

use metrics::gamut::{Matrix, Primaries, apply, inverse};
use metrics::transfer::Transfer;
use metrics::{chromaticity, colour_matching};
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
    /// Sub-pixels before `channels`: wavelengths (nm) and power of each, in steps in which products
    /// with colour-matching functions and `filters` are linear, and by which factor its light is
    /// counted: 683 where light is in W and X, Y and Z in photometric units. `closed` is what sub-pixel
    /// s passes of channel c closed, over open.
    pub fn new(
        channels: &[(Vec<(f64, f64)>, f64)],
        filters: [&dyn Fn(f64) -> f64; SUB_PIXELS],
        closed: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let of_channel = |(light, factor): &(Vec<(f64, f64)>, f64)| -> Matrix {
            let whole: f64 = light.iter().map(|(_, power)| power).sum();
            let columns = filters.map(|filter| {
                let mut xyz = [0.0; 3];
                for (nm, power) in light {
                    let passed = factor * power * filter(*nm) / whole;
                    let matching = colour_matching::xyz(*nm);
                    (0..3).for_each(|k| xyz[k] += passed * matching[k]);
                }
                xyz
            });
            [0, 1, 2].map(|k| columns.map(|column| column[k]))
        };
        let open: Vec<Matrix> = channels.iter().map(of_channel).collect();
        let leaks = |(c, open): (usize, &Matrix)| open.map(|row| times(row, |s| closed(c, s)));
        Self { closed: open.iter().enumerate().map(leaks).collect(), open }
    }

    /// Sub-pixels that pass these X, Y and Z (rows: sub-pixels) of light of 1 of each channel; `closed`
    /// is what each passes closed, over open.
    pub fn of_open(channels: &[Matrix], closed: [f64; SUB_PIXELS]) -> Self {
        let columns = |open: &Matrix| [0, 1, 2].map(|k| [0, 1, 2].map(|s| open[s][k]));
        let open: Vec<Matrix> = channels.iter().map(columns).collect();
        let leaks = |open: &Matrix| open.map(|row| times(row, |s| closed[s]));
        Self { closed: open.iter().map(leaks).collect(), open }
    }

    /// The panel before `light` of the channels.
    pub fn before(&self, light: &[f64]) -> Place {
        let (mut dark, mut span) = ([0.0; 3], [[0.0; 3]; 3]);
        for ((light, open), closed) in light.iter().zip(&self.open).zip(&self.closed) {
            for k in 0..3 {
                for s in 0..SUB_PIXELS {
                    dark[k] += light * closed[k][s];
                    span[k][s] += light * (open[k][s] - closed[k][s]);
                }
            }
        }
        Place { dark, span }
    }
}

fn times(row: [f64; 3], factor: impl Fn(usize) -> f64) -> [f64; 3] {
    [0, 1, 2].map(|s| row[s] * factor(s))
}

/// Sub-pixels before the light of one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// X, Y and Z of black, with all sub-pixels closed.
    pub dark: [f64; 3],
    /// X, Y and Z (rows) that each sub-pixel (columns) adds from closed to open.
    span: Matrix,
}

/// What sub-pixels show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Levels from 0 to 1, as light.
    pub levels: [f64; SUB_PIXELS],
    /// X, Y and Z.
    pub xyz: [f64; 3],
    /// True where the wanted colour is out of reach.
    pub is_clipped: bool,
}

impl Place {
    /// X, Y and Z at these levels.
    pub fn at(&self, levels: [f64; SUB_PIXELS]) -> [f64; 3] {
        let light = apply(&self.span, levels);
        [0, 1, 2].map(|k| self.dark[k] + light[k])
    }

    /// X, Y and Z of white, with all sub-pixels open.
    pub fn white(&self) -> [f64; 3] {
        self.at([1.0; SUB_PIXELS])
    }

    /// x and y of the primaries as displayed, each with the others closed; `None` in the dark.
    pub fn primaries(&self) -> Option<[[f64; 2]; SUB_PIXELS]> {
        let of = |s: usize| chromaticity::xy(self.at([0, 1, 2].map(|k| f64::from(k == s))));
        Some([of(0)?, of(1)?, of(2)?])
    }

    /// Levels that come nearest to `wanted`, X, Y and Z, and what they show.
    pub fn show(&self, wanted: [f64; 3]) -> Shown {
        let light = [0, 1, 2].map(|k| wanted[k] - self.dark[k]);
        /// Levels beyond 0 and 1 by so little are rounding.
        const ROUNDING: f64 = 1e-9;
        let levels = inverse(&self.span).map(|inverse| apply(&inverse, light));
        let is_within = |level: &f64| (-ROUNDING..=1.0 + ROUNDING).contains(level);
        if let Some(levels) = levels.filter(|levels| levels.iter().all(is_within)) {
            let levels = levels.map(|level| level.clamp(0.0, 1.0));
            return Shown { levels, xyz: self.at(levels), is_clipped: false };
        }
        let levels = nearest(&self.span, light);
        Shown { levels, xyz: self.at(levels), is_clipped: true }
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

/// Colours of a picture: levels to X, Y and Z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureColours {
    to_xyz: Matrix,
    transfer: Transfer,
}

impl PictureColours {
    /// Pictures of these primaries and this white (x, y). Level 1 of all has the luminance
    /// `white_y`, in the unit of the backlight; a transfer of absolute luminance states its own.
    pub fn new(primaries: &Primaries, white: [f64; 2], transfer: Transfer, white_y: f64) -> Self {
        let peak = transfer.peak_cd_m2().unwrap_or(white_y);
        let to_xyz = primaries.to_xyz(white).map(|row| row.map(|v| peak * v));
        Self { to_xyz, transfer }
    }

    /// Pictures whose levels are those of the panel itself, of the place `full`: level 1 is what
    /// each sub-pixel adds there.
    pub fn of_panel(full: &Place, transfer: Transfer) -> Self {
        Self { to_xyz: full.span, transfer }
    }

    /// X, Y and Z of red, green and blue levels from 0 to 1.
    pub fn xyz(&self, levels: [f64; 3]) -> [f64; 3] {
        apply(&self.to_xyz, levels.map(|level| self.transfer.light(level)))
    }
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
    /// Places out of reach.
    pub clipped: usize,
    /// Places.
    pub places: usize,
}

impl Account {
    /// Adds a place.
    pub fn add(&mut self, wanted: [f64; 3], shown: &Shown) {
        let more = shown.xyz[1] - wanted[1];
        self.wanted += wanted[1];
        self.missing += (-more).max(0.0);
        self.leaking += more.max(0.0);
        self.clipped += usize::from(shown.is_clipped);
        self.places += 1;
    }

    /// Adds the places of another.
    pub fn join(&mut self, other: &Self) {
        self.wanted += other.wanted;
        self.missing += other.missing;
        self.leaking += other.leaking;
        self.clipped += other.clipped;
        self.places += other.places;
    }
}

/// The panel before bins of a backlight, which pixels see linearly between the middles of bins.
pub struct Backlight {
    size: [usize; 2],
    places: Vec<Place>,
}

impl Backlight {
    /// The panel before `columns` times `rows` places over its whole area, row by row.
    ///
    /// # Panics
    /// If there are not so many places, or none.
    pub fn new([columns, rows]: [usize; 2], places: Vec<Place>) -> Self {
        assert!(places.len() == columns * rows && !places.is_empty(), "places of another size");
        Self { size: [columns, rows], places }
    }

    /// Shows a picture of `columns` times `rows` pixels over the panel, of which `wanted` gives X, Y and
    /// Z at a column and a row. `read` is handed each row, with what was wanted and is shown.
    pub fn show<T: Send>(
        &self,
        [columns, rows]: [usize; 2],
        wanted: impl Fn(usize, usize) -> [f64; 3] + Sync,
        read: impl Fn(usize, &[([f64; 3], Shown)]) -> T + Sync,
    ) -> Vec<T> {
        let across: Vec<(usize, f64)> = (0..columns).map(|i| self.bin(0, i, columns)).collect();
        let row = |j: usize| {
            let (below, part) = self.bin(1, j, rows);
            let count = self.size[0];
            let above = (below + 1).min(self.size[1] - 1);
            let of_row = |row: usize| &self.places[row * count..(row + 1) * count];
            let pairs = of_row(below).iter().zip(of_row(above));
            let places: Vec<Place> = pairs.map(|(a, b)| a.between(b, part)).collect();
            let shown = across.iter().enumerate().map(|(i, (left, part))| {
                let right = (left + 1).min(count - 1);
                let wanted = wanted(i, j);
                (wanted, places[*left].between(&places[right], *part).show(wanted))
            });
            read(j, &shown.collect::<Vec<_>>())
        };
        (0..rows).into_par_iter().map(row).collect()
    }

    /// The bin whose middle lies before that of a pixel, and the part of the next; the outermost
    /// bins reach to the edge.
    fn bin(&self, axis: usize, pixel: usize, pixels: usize) -> (usize, f64) {
        let count = self.size[axis];
        let at = (pixel as f64 + 0.5) * count as f64 / pixels as f64 - 0.5;
        let at = at.clamp(0.0, (count - 1) as f64);
        (at as usize, at.fract())
    }
}
