// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniformity in the forms that display and lighting engineers quote, over segments, diagonals and
//! the whole cell, with darkness as zero.
//!
//! | form | formula |
//! |---|---|
//! | valley/peak | L_min / L_max |
//! | min/mean | L_min / L_mean, "U0" of EN 12464-1 |
//! | coefficient of variation | σ / L_mean, σ² the variance of L over the region |
//! | logarithmic | max(0, 1 + ln(L_min / L_max) / ln `full_scale`) ([`logarithmic`]) |
//! | nine points | L_min / L_max of the middles of 3 × 3 equal parts of cell or area (ANSI/NAPM IT7.228) |
//! | thirteen points | the same with a point in each corner, a tenth of the way to the centre |
//!
//! Segments join LEDs next to each other and diagonals those across a square of four; both refer
//! their lowest value to the largest of the whole map. The cell is the rectangle between the
//! outermost LED axes, the area the rectangle that a design states; bins on their border count by the
//! part inside, and for extremes if their middle lies inside. Points are read as means over spots
//! where the design states their diameter. Where nine or thirteen points see one phase of the pitch,
//! each is read over all phases ([`sees_one_phase`]).
//!
//! Extremes, their biases and errors: `super::sampled`.

mod cell;

pub(crate) use self::cell::cell_on;
pub use self::cell::{MapMean, PHASES, cell, nine_points, sees_one_phase};
pub(crate) use self::cell::{POINTS, samples};
use super::illuminance::largest;
use super::sampled::{LevelEstimates, Levels, Sampled};
use super::uniformity::{MapReading, Uniformity, logarithmic, ratio};
use super::valley::Valley;
use super::{Estimate, Grouped, JackknifedFigure};

/// Where a form is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// Straight lines between LEDs next to each other.
    Segment,
    /// Diagonals of four LEDs.
    Diagonal,
    /// Rectangle between the outermost LED axes.
    Cell,
    /// Nine points of the cell.
    NinePoints,
    /// Thirteen points of the cell.
    ThirteenPoints,
    /// The area that the design states.
    Area,
    /// Nine points of that area.
    AreaNinePoints,
    /// Thirteen points of that area.
    AreaThirteenPoints,
}

/// What is computed there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Smallest over largest.
    ValleyToPeak,
    /// Smallest over mean.
    MinToMean,
    /// Standard deviation over mean.
    Variation,
    /// Logarithm of smallest over largest on a scale from 0 to 1.
    Logarithmic,
}

/// A form over a region, with its key in results and its name for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegionForm {
    /// Where.
    pub region: Region,
    /// What.
    pub form: Form,
    /// Key in `results.json`.
    pub key: &'static str,
    /// Name for people.
    pub label: &'static str,
}

impl RegionForm {
    /// Meaning in a sentence.
    pub(crate) fn meaning(self) -> String {
        let form = match self.form {
            Form::ValleyToPeak => "Smallest over largest illuminance",
            Form::MinToMean => "Smallest over mean illuminance (U0 of EN 12464-1)",
            Form::Variation => "Standard deviation over mean of the illuminance",
            Form::Logarithmic => "Smallest over largest illuminance on a logarithmic scale",
        };
        let region = match self.region {
            Region::Segment => "the straight lines between LEDs next to each other",
            Region::Diagonal => "the diagonals of four LEDs",
            Region::Cell => "the rectangle between the outermost LEDs",
            Region::NinePoints => "nine points of the rectangle between the outermost LEDs",
            Region::ThirteenPoints => "thirteen points of the rectangle between the outermost LEDs",
            Region::Area => "the area that the design states",
            Region::AreaNinePoints => "nine points of the area that the design states",
            Region::AreaThirteenPoints => "thirteen points of the area that the design states",
        };
        format!("{form} on {region}.")
    }
}

const fn form(region: Region, form: Form, key: &'static str, label: &'static str) -> RegionForm {
    RegionForm { region, form, key, label }
}

/// Every form that is reported.
pub const FORMS: [RegionForm; 20] = {
    use Form::{Logarithmic, MinToMean, ValleyToPeak, Variation};
    use Region::{
        Area, AreaNinePoints, AreaThirteenPoints, Cell, Diagonal, NinePoints, Segment,
        ThirteenPoints,
    };
    [
        form(Segment, ValleyToPeak, "segment_valley_to_peak", "valley/peak, segment"),
        form(Segment, MinToMean, "segment_min_to_mean", "min/mean, segment"),
        form(Segment, Variation, "segment_variation", "coefficient of variation, segment"),
        form(Segment, Logarithmic, "segment_logarithmic", "logarithmic, segment"),
        form(Diagonal, ValleyToPeak, "diagonal_valley_to_peak", "valley/peak, diagonal"),
        form(Diagonal, MinToMean, "diagonal_min_to_mean", "min/mean, diagonal"),
        form(Diagonal, Variation, "diagonal_variation", "coefficient of variation, diagonal"),
        form(Diagonal, Logarithmic, "diagonal_logarithmic", "logarithmic, diagonal"),
        form(Cell, ValleyToPeak, "cell_valley_to_peak", "valley/peak, cell"),
        form(Cell, MinToMean, "cell_min_to_mean", "min/mean, cell"),
        form(Cell, Variation, "cell_variation", "coefficient of variation, cell"),
        form(Cell, Logarithmic, "cell_logarithmic", "logarithmic, cell"),
        form(NinePoints, ValleyToPeak, "cell_nine_points", "nine points, cell"),
        form(ThirteenPoints, ValleyToPeak, "cell_thirteen_points", "thirteen points, cell"),
        form(Area, ValleyToPeak, "area_valley_to_peak", "valley/peak, area"),
        form(Area, MinToMean, "area_min_to_mean", "min/mean, area"),
        form(Area, Variation, "area_variation", "coefficient of variation, area"),
        form(Area, Logarithmic, "area_logarithmic", "logarithmic, area"),
        form(AreaNinePoints, ValleyToPeak, "area_nine_points", "nine points, area"),
        form(AreaThirteenPoints, ValleyToPeak, "area_thirteen_points", "thirteen points, area"),
    ]
};

/// The `form` of these levels.
fn figure(levels: &Levels, form: Form, full_scale: f64) -> f64 {
    match form {
        Form::ValleyToPeak => ratio(levels.low, levels.high),
        Form::MinToMean => ratio(levels.low, levels.mean),
        Form::Variation => ratio(levels.variance.max(0.0).sqrt(), levels.mean),
        Form::Logarithmic => logarithmic(ratio(levels.low, levels.high), full_scale),
    }
}

/// The regions of a map of one design.
#[derive(Debug, Clone)]
pub struct Regions {
    names: Vec<Region>,
    sampled: Vec<Sampled>,
    full_scale: f64,
}

impl Regions {
    /// Segments and diagonals that the layout has.
    pub fn between_neighbours(reading: &MapReading) -> Self {
        let lines = |region, valley: &Option<Valley>, segments: Vec<_>| {
            let counted = reading.counted.as_deref();
            Some((region, Sampled::lines(reading.grid, counted, &segments, valley.clone()?)))
        };
        let regions = [
            lines(Region::Segment, &reading.straight, reading.layout.straight()),
            lines(Region::Diagonal, &reading.diagonal, reading.layout.diagonal()),
        ];
        let (names, sampled) = regions.into_iter().flatten().unzip();
        Self { names, sampled, full_scale: reading.full_scale }
    }

    /// [`Regions::between_neighbours`], the cell, and the stated area.
    pub fn new(reading: &MapReading) -> Self {
        let mut all = Self::between_neighbours(reading);
        let (grid, layout) = (reading.grid, &reading.layout);
        let counted = reading.counted.as_deref();
        let spot = reading.spot_mm.map(|diameter_mm| [diameter_mm; 2]);
        let points =
            |area, points| Sampled::points(samples((grid, counted), layout, area, (points, spot)));
        let cell = [Region::Cell, Region::NinePoints, Region::ThirteenPoints];
        let area = [Region::Area, Region::AreaNinePoints, Region::AreaThirteenPoints];
        for (regions, corners) in [(cell, cell_on(grid, layout)), (area, reading.area)] {
            if let Some(corners) = corners {
                all.names.extend(regions);
                all.sampled.extend([
                    Sampled::rectangle(grid, counted, corners),
                    points(corners, &POINTS[..9]),
                    points(corners, &POINTS),
                ]);
            }
        }
        all
    }

    /// The forms of [`FORMS`] that this map has, without errors; the peaks are largest bins.
    pub fn plain(&self, map: &[f64]) -> Vec<(RegionForm, f64)> {
        let peak = largest(map).1;
        let levels: Vec<Levels> = self.sampled.iter().map(|r| r.levels(map, peak)).collect();
        self.each(|k, form| figure(&levels[k], form, self.full_scale))
    }

    /// The forms of [`FORMS`] of `map` (W/mm² by groups) with their errors.
    pub fn estimates(&self, map: &Grouped) -> Vec<(RegionForm, Estimate)> {
        let levels = LevelEstimates::new(&self.sampled, map);
        self.each(|k, form| match form {
            Form::Variation => levels.variation(k),
            Form::Logarithmic => {
                let ratio = levels.share(k, |levels| ratio(levels.low, levels.high));
                ratio.mapped(|ratio| logarithmic(ratio, self.full_scale))
            }
            Form::ValleyToPeak | Form::MinToMean => {
                levels.share(k, |levels| figure(levels, form, self.full_scale))
            }
        })
    }

    /// Coefficients of variation of `map` without the noise of their bins, and without each group of
    /// paths; `None` of other forms. In the order of [`Regions::forms`].
    pub fn variations(&self, map: &Grouped) -> Vec<Option<JackknifedFigure>> {
        let root = |square: f64| square.max(0.0).sqrt();
        let variation = |k: usize| {
            let JackknifedFigure { value, without, .. } = self.sampled[k].squared_variation(map);
            JackknifedFigure::new(root(value), without.into_iter().map(root).collect())
        };
        let figures = self.each(|k, form| (form == Form::Variation).then(|| variation(k)));
        figures.into_iter().map(|(_, figure)| figure).collect()
    }

    /// The forms that maps have.
    pub fn forms(&self) -> Vec<RegionForm> {
        let all = self.each(|_, _| ());
        all.into_iter().map(|(form, ())| form).collect()
    }

    fn each<T>(&self, mut value: impl FnMut(usize, Form) -> T) -> Vec<(RegionForm, T)> {
        let mut all = Vec::new();
        for form in FORMS {
            if let Some(k) = self.names.iter().position(|region| *region == form.region) {
                all.push((form, value(k, form.form)));
            }
        }
        all
    }
}

impl Uniformity {
    /// Out of all forms of a map; `None` where it has none of neighbours.
    pub fn of(forms: &[(RegionForm, Estimate)]) -> Option<Self> {
        let find = |region: Region, form: Form| {
            let mut all = forms.iter();
            let found = all.find(|(f, _)| f.region == region && f.form == form)?;
            Some(found.1)
        };
        let straight = find(Region::Segment, Form::Logarithmic)?;
        Some(Self {
            straight,
            diagonal: find(Region::Diagonal, Form::Logarithmic).unwrap_or(straight),
            valley_to_peak: find(Region::Segment, Form::ValleyToPeak)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::illuminance::Grid;
    use crate::layout::{Area, Layout};
    use crate::uniformity::ValleyReading;

    const PITCH: f64 = 8.0;
    const GRID: Grid = Grid { columns: 160, rows: 160, bin_mm: 0.1 };

    fn layout() -> Layout {
        let axes = [[-4.0, -4.0], [4.0, -4.0], [-4.0, 4.0], [4.0, 4.0]];
        Layout::rectangular(axes.to_vec(), 2, 2, PITCH)
    }

    /// 1 + c sin²(π x / pitch) sin²(π y / pitch), brightest on the LED axes.
    fn wave(contrast: f64, x: f64, y: f64) -> f64 {
        let of = |v: f64| 0.5 * (1.0 - (2.0 * PI * v / PITCH).cos());
        1.0 + contrast * of(x) * of(y)
    }

    fn map(contrast: f64, noise: f64, groups: usize) -> Grouped {
        let mut rng = tracer::random::stream(7, 0);
        let mut normal = || {
            let twelve = (0..12).map(|_| tracer::random::unit(&mut rng));
            twelve.sum::<f64>() - 6.0
        };
        let group = |_| {
            (0..GRID.columns * GRID.rows)
                .map(|k| {
                    let x = GRID.centre_mm(k % GRID.columns, GRID.columns);
                    let y = GRID.centre_mm(k / GRID.columns, GRID.rows);
                    let exact = wave(contrast, x, y);
                    let noise = noise * (groups as f64).sqrt() * normal();
                    exact * (1.0 + noise) / groups as f64
                })
                .collect()
        };
        Grouped::new((0..groups).map(group).collect())
    }

    fn reading_of(layout: Layout, valley: ValleyReading) -> MapReading {
        MapReading::new(GRID, layout, 256.0, valley)
    }

    fn estimates(map: &Grouped, reading: ValleyReading) -> Vec<(RegionForm, Estimate)> {
        Regions::new(&reading_of(layout(), reading)).estimates(map)
    }

    fn value(all: &[(RegionForm, Estimate)], key: &str) -> Estimate {
        let found = all.iter().find(|(form, _)| form.key == key);
        found.unwrap_or_else(|| panic!("no {key}")).1
    }

    #[test]
    fn forms_of_a_wave_are_its_closed_forms() {
        // With s = sin²(π v / 8): along a segment 1 + c s, mean 1 + c/2, variance c²/8; over the
        // cell 1 + c s t, mean 1 + c/4, variance c² (9/64 - 1/16) = 5 c² / 64.
        let c = 3.0;
        for reading in [ValleyReading::Fit, ValleyReading::Bins] {
            let cell = [[-4.0; 2], [4.0; 2]];
            let reading_of_area = reading_of(layout(), reading).with_area(Some(cell), None);
            let all = Regions::new(&reading_of_area).estimates(&map(c, 0.0, 4));
            assert_eq!(all.len(), FORMS.len());
            // An area that is the cell.
            for (form, of_area) in all.iter().filter(|(form, _)| form.key.starts_with("area_")) {
                let of_cell = value(&all, &form.key.replace("area_", "cell_"));
                assert_eq!(*of_area, of_cell, "{}", form.key);
            }
            let near = |key: &str, expected: f64, tolerance: f64| {
                let got = value(&all, key);
                assert!(
                    (got.value - expected).abs() < tolerance,
                    "{reading:?} {key}: {} {expected}",
                    got.value
                );
                assert!(got.standard_error < 1e-6, "{key}: {got:?}");
            };
            near("segment_valley_to_peak", 1.0 / (1.0 + c), 2e-3);
            near("segment_min_to_mean", 1.0 / (1.0 + 0.5 * c), 6e-3);
            near("segment_variation", (c * c / 8.0).sqrt() / (1.0 + 0.5 * c), 6e-3);
            near("segment_logarithmic", 1.0 - (1.0 + c).ln() / 256.0f64.ln(), 1e-3);
            // Along a diagonal 1 + c s²: mean 1 + 3 c / 8, variance c² (35/128 - 9/64).
            near("diagonal_valley_to_peak", 1.0 / (1.0 + c), 2e-3);
            near("diagonal_min_to_mean", 1.0 / (1.0 + 0.375 * c), 2e-2);
            let variance: f64 = 35.0 / 128.0 - 9.0 / 64.0;
            near("diagonal_variation", c * variance.sqrt() / (1.0 + 0.375 * c), 2e-2);
            near("diagonal_logarithmic", 1.0 - (1.0 + c).ln() / 256.0f64.ln(), 1e-3);
            near("cell_valley_to_peak", 1.0 / (1.0 + c), 2e-3);
            near("cell_min_to_mean", 1.0 / (1.0 + 0.25 * c), 1e-3);
            near("cell_variation", c * (5.0f64 / 64.0).sqrt() / (1.0 + 0.25 * c), 2e-3);
            near("cell_logarithmic", 1.0 - (1.0 + c).ln() / 256.0f64.ln(), 1e-3);
            // Nine points lie 8/3 mm from the middle: s = 3/4, the smallest is the middle, where
            // s = 0. Corners of thirteen lie at 3.6 mm.
            near("cell_nine_points", 1.0 / (1.0 + c * 9.0 / 16.0), 2e-3);
            let s = (PI * 3.6 / PITCH).sin().powi(2);
            near("cell_thirteen_points", 1.0 / (1.0 + c * s * s), 2e-3);
        }
    }

    #[test]
    fn noise_adds_nothing_to_a_variation() {
        // Noise of half of each bin, beside a variation of √(5/64) / 1.25.
        let exact = (5.0f64 / 64.0).sqrt() / 1.25;
        let regions = Regions::new(&reading_of(layout(), ValleyReading::Fit));
        for groups in [8, 64] {
            let noisy = map(1.0, 0.5, groups);
            let found = value(&regions.estimates(&noisy), "cell_variation");
            let off = (found.value - exact).abs();
            assert!(off < 4.0 * found.standard_error, "{groups}: {found:?} {exact}");
            assert!(found.standard_error < 0.15 * exact, "{groups}: {found:?}");
            // Replicates are those of the same value.
            let place = regions.forms().iter().position(|form| form.key == "cell_variation");
            let replicated = regions.variations(&noisy).swap_remove(place.expect("a form"));
            let replicated = replicated.expect("a variation").estimate();
            assert!((replicated.value - found.value).abs() < 1e-12, "{replicated:?} {found:?}");
            let errors = replicated.standard_error / found.standard_error;
            assert!((errors - 1.0).abs() < 0.1, "{replicated:?} {found:?}");
        }
    }

    #[test]
    fn border_bins_count_by_their_area_in_the_cell() {
        // 83 bins, of which the middles of 84 lie within or on the border of a cell that ends in
        // the middle of bins; the wave of pitch 8.3 mm about LEDs 4.15 mm off the axis.
        let (pitch, contrast) = (8.3, 3.0);
        let of = |v: f64| 0.5 * (1.0 - (2.0 * PI * v / pitch).cos());
        let values = (0..GRID.columns * GRID.rows).map(|k| {
            let [x, y] = GRID.middle_mm(k);
            1.0 + contrast * of(x) * of(y)
        });
        let map = Grouped::new(vec![values.collect(); 2]);
        let at = 0.5 * pitch;
        let axes = vec![[-at, -at], [at, -at], [-at, at], [at, at]];
        let layout = Layout::rectangular(axes, 2, 2, pitch);
        let all = Regions::new(&reading_of(layout, ValleyReading::Fit)).estimates(&map);
        let expected = contrast * (5.0f64 / 64.0).sqrt() / (1.0 + 0.25 * contrast);
        let got = value(&all, "cell_variation").value;
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} {expected}");
    }

    /// 6 x 6 LEDs of pitch 8 mm under a wave that is brightest above them.
    fn backlight(area: Area, spot_mm: Option<f64>) -> (MapReading, Vec<f64>) {
        let grid = Grid { columns: 520, rows: 520, bin_mm: 0.1 };
        let at = |k: usize| (k as f64 - 2.5) * PITCH;
        let axes = (0..36).map(|k| [at(k % 6), at(k / 6)]);
        let layout = Layout::rectangular(axes.collect(), 6, 6, PITCH);
        let map = (0..grid.columns * grid.rows).map(|k| {
            let [x, y] = grid.middle_mm(k);
            wave(3.0, x, y)
        });
        let reading = MapReading::new(grid, layout, 256.0, ValleyReading::Fit);
        (reading.with_area(Some(area), spot_mm), map.collect())
    }

    fn plain(reading: &MapReading, map: &[f64], key: &str) -> f64 {
        let all = Regions::new(reading).plain(map);
        all.iter().find(|(form, _)| form.key == key).expect("a form of the area").1
    }

    #[test]
    fn points_of_an_area_are_means_over_spots() {
        // Points at 0 and ±40/3 mm: s = 0 and sin²(5π/3) = 3/4.
        let area = [[-20.0; 2], [20.0; 2]];
        let (reading, map) = backlight(area, None);
        let found = plain(&reading, &map, "area_nine_points");
        let expected = 1.0 / (1.0 + 3.0 * 9.0 / 16.0);
        assert!((found - expected).abs() < 2e-3, "{found} {expected}");
        // Over a disc of radius r the mean of a cosine of wavenumber k is 2 J1(k r)/(k r) of its
        // value in the middle; of cos a cos b, with wavenumber √2 k.
        let spot_mm = 3.0;
        let (reading, map) = backlight(area, Some(spot_mm));
        let found = plain(&reading, &map, "area_nine_points");
        let airy = |k: f64| {
            let x = 0.25 * (k * 0.5 * spot_mm).powi(2);
            let terms = (0..12).scan(1.0, |term, n| {
                let now = *term;
                *term *= -x / f64::from((n + 1) * (n + 2));
                Some(now)
            });
            terms.sum::<f64>()
        };
        let k = 2.0 * PI / PITCH;
        let (one, both) = (airy(k), airy(2f64.sqrt() * k));
        // Of 1 + 3/4 (1 - cos kx)(1 - cos ky), where both cosines are c.
        let mean = |c: f64| 1.0 + 0.75 * (1.0 - 2.0 * c * one + c * c * both);
        let expected = mean(1.0) / mean(-0.5);
        assert!((found - expected).abs() < 2e-3, "{found} {expected}");
    }

    #[test]
    fn an_area_whose_points_see_one_phase_is_read_over_all() {
        let whole = 1.0 / 4.0;
        for (area, is_one) in [
            // Points in the middles of four, 16 mm apart; above LEDs; an area on the axes.
            ([[-24.0; 2], [24.0; 2]], true),
            ([[-20.0, -20.0], [28.0, 28.0]], true),
            ([[-20.0; 2], [20.0; 2]], false),
        ] {
            let (reading, map) = backlight(area, None);
            assert_eq!(sees_one_phase(&reading.layout, area), is_one, "{area:?}");
            let found = plain(&reading, &map, "area_nine_points");
            assert_eq!((found - whole).abs() < 2e-3, is_one, "{area:?}: {found}");
        }
        // So it is with positions in any order.
        let (reading, _) = backlight([[-24.0; 2], [24.0; 2]], None);
        let mut axes = reading.layout.axes_mm.clone();
        axes.reverse();
        assert!(sees_one_phase(&Layout::of_places(axes), [[-24.0; 2], [24.0; 2]]));
    }

    #[test]
    fn noise_biases_no_form_beyond_its_error() {
        let exact = estimates(&map(0.5, 0.0, 4), ValleyReading::Fit);
        let noisy = estimates(&map(0.5, 0.05, 64), ValleyReading::Fit);
        for ((form, expected), (_, got)) in exact.iter().zip(&noisy) {
            let bound = 4.0 * got.standard_error + got.bias_bound.unwrap_or(0.0);
            assert!(
                (got.value - expected.value).abs() < bound,
                "{}: {got:?} {expected:?}",
                form.key
            );
        }
        // Noise alone would give a coefficient of variation of 0.05.
        let even = estimates(&map(0.0, 0.05, 64), ValleyReading::Fit);
        let variation = value(&even, "cell_variation");
        assert!(variation.value < 0.02, "{variation:?}");
        assert!(variation.value < 4.0 * variation.standard_error, "{variation:?}");
    }

    #[test]
    fn a_row_has_no_diagonal_and_no_cell() {
        let row = Layout::rectangular(vec![[-4.0, 0.0], [4.0, 0.0]], 2, 1, PITCH);
        let seen = map(0.5, 0.0, 2);
        let regions = Regions::new(&reading_of(row, ValleyReading::Fit));
        let found = regions.plain(seen.total());
        assert_eq!(found.len(), 4);
        assert!(found.iter().all(|(form, _)| form.region == Region::Segment));
        let one = Layout::rectangular(vec![[0.0, 0.0]], 1, 1, PITCH);
        let none = Regions::new(&reading_of(one, ValleyReading::Fit));
        assert!(none.plain(seen.total()).is_empty());
    }
}
