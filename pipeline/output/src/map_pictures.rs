// SPDX-License-Identifier: MIT OR Apache-2.0
//! The map of the receiver plane: its files, its picture, and the cross-section along the line on
//! which its valley was read.

use anyhow::Result;
use metrics::figures::VALLEY_TO_PEAK;

use arrays::{csv, exr};
use design::resolved::array::Pose;
use metrics::Grouped;
use metrics::illuminance::Grid;
use metrics::quantity::{Axis, Curve, Map, Quantity, Unit};
use report::plots::{
    IlluminanceMap, LedOutline, LineColours, Mark, Picture, Section, cross_section,
    illuminance_map, palette,
};
use results::figure_entry::FigureEntry;
use runtime::atomic_file::write_bytes;
use simulate::observation::{curve, layout};
use simulate::units::Units;

use super::{ModelFiles, capitalised, scaled};

/// Lowest value of the map over the largest, and the places (x, y) of both in mm.
struct Extremes {
    valley_to_peak: FigureEntry,
    valley_mm: [f64; 2],
    /// Middle of the largest bin.
    peak_mm: [f64; 2],
}

/// A straight line through the map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MapLine {
    /// Quantity of the positions along it.
    name: &'static str,
    /// The point at position 0, mm.
    start: [f64; 2],
    /// Unit vector.
    along: [f64; 2],
    /// Positions of its samples, mm.
    positions: Vec<f64>,
}

impl MapLine {
    /// Along x at this y, through the middles of bins.
    fn row(grid: Grid, y: f64) -> Self {
        let middles = (0..grid.columns).map(|i| grid.centre_mm(i, grid.columns));
        Self { name: "x", start: [0.0, y], along: [1.0, 0.0], positions: middles.collect() }
    }

    /// Along the line through `a` and `b`, over the whole map.
    fn through(grid: Grid, [a, b]: [[f64; 2]; 2]) -> Self {
        const LEVEL: f64 = 1e-9;
        let d = [b[0] - a[0], b[1] - a[1]];
        if d[1].abs() <= LEVEL * d[0].abs() {
            return Self::row(grid, a[1]);
        }
        if d[0].abs() <= LEVEL * d[1].abs() {
            let middles = (0..grid.rows).map(|j| grid.centre_mm(j, grid.rows));
            return Self {
                name: "y",
                start: [a[0], 0.0],
                along: [0.0, 1.0],
                positions: middles.collect(),
            };
        }
        let length = d[0].hypot(d[1]);
        let mut line = Self {
            name: "distance from the first LED",
            start: a,
            along: d.map(|d| d / length),
            positions: Vec::new(),
        };
        let size = [grid.columns, grid.rows].map(|n| (n - 1) as f64 * grid.bin_mm);
        let map = LedOutline { centre: [0.0; 2], size, turn_deg: 0.0 };
        if let Some([from, to]) = line.within(&map) {
            let count = ((to - from) / grid.bin_mm).floor() as usize;
            line.positions = (0..=count).map(|k| from + k as f64 * grid.bin_mm).collect();
        }
        line
    }

    /// The line on which the valley was read: that of a segment between neighbours, or without one
    /// the row of the first LED.
    fn of_valley(grid: Grid, segments: &[[[f64; 2]; 2]], valley: [f64; 2]) -> Option<Self> {
        let lines = segments.iter().map(|ends| Self::through(grid, *ends));
        let mut near = lines.filter(|line| {
            line.positions.len() >= 2 && line.distance(valley) <= 0.51 * grid.bin_mm
        });
        let first = near.next()?;
        // A row, where the valley lies on a row and a column.
        let row = near.find(|line| line.name == "x");
        Some(row.filter(|_| first.name != "x").unwrap_or(first))
    }

    fn at(&self, position: f64) -> [f64; 2] {
        [0, 1].map(|k| self.start[k] + position * self.along[k])
    }

    fn position(&self, at: [f64; 2]) -> f64 {
        (0..2).map(|k| (at[k] - self.start[k]) * self.along[k]).sum()
    }

    fn distance(&self, at: [f64; 2]) -> f64 {
        let d = [at[0] - self.start[0], at[1] - self.start[1]];
        (d[0] * self.along[1] - d[1] * self.along[0]).abs()
    }

    /// Positions between which it lies in a rectangle.
    fn within(&self, area: &LedOutline) -> Option<[f64; 2]> {
        let (sin, cos) = area.turn_deg.to_radians().sin_cos();
        let in_frame = |[x, y]: [f64; 2]| [x * cos + y * sin, y * cos - x * sin];
        let from = in_frame([0, 1].map(|k| area.centre[k] - self.start[k]));
        let along = in_frame(self.along);
        let mut span = [f64::NEG_INFINITY, f64::INFINITY];
        for k in 0..2 {
            let half = 0.5 * area.size[k];
            if along[k] == 0.0 {
                if from[k].abs() >= half {
                    return None;
                }
                continue;
            }
            let ends = [-half, half].map(|h| (from[k] + h) / along[k]);
            span = [span[0].max(ends[0].min(ends[1])), span[1].min(ends[0].max(ends[1]))];
        }
        (span[0] < span[1]).then_some(span)
    }

    fn ends(&self) -> [[f64; 2]; 2] {
        let last = self.positions.len() - 1;
        [self.at(self.positions[0]), self.at(self.positions[last])]
    }
}

/// The light of a map along `line`.
pub(super) fn section(map: &Grouped, grid: Grid, units: &Units, line: &MapLine) -> Result<Curve> {
    let factor = units.per_irradiance();
    let values = map.map(|m| {
        let m = scaled(m, factor);
        let at = |s: &f64| {
            let [x, y] = line.at(*s);
            grid.at(&m, x, y)
        };
        line.positions.iter().map(at).collect()
    });
    curve("through LED axes", &values, &line.positions, f64::INFINITY)
}

impl ModelFiles<'_> {
    /// The map, its cross-section, and pictures of both.
    pub(super) fn illuminance(&self) -> Result<()> {
        let map = self.map()?;
        let path = self.folder.join("illuminance.exr");
        exr::write_map(&path, &map, &self.provenance())?;
        csv::write_map_npy(&self.folder.join("illuminance.npy"), &map)?;
        let line = self.line();
        let position = Quantity::new(line.name, Unit::Millimetre);
        let section = self.section(&line)?;
        let path = self.folder.join("illuminance_cross_section.csv");
        let curves = std::slice::from_ref(&section);
        csv::write_curves_csv(&path, &position, map.quantity(), curves)?;
        let path = self.folder.join("illuminance_cross_section.npy");
        csv::write_curve_npy(&path, &section)?;
        let section = self.section_picture(&line, &[section], self.colours())?;
        write_bytes(&self.folder.join("illuminance_cross_section.png"), &section.png()?)?;
        let map = self.map_picture(&map, &line, illuminance_map)?;
        write_bytes(&self.folder.join("illuminance.png"), &map.png()?)
    }

    pub(super) fn map(&self) -> Result<Map> {
        let grid = self.observation.grid;
        let factor = self.units.per_irradiance();
        let (value, error) = self.observation.illuminance.each(|_, e| e * factor);
        let axis = |name: &str, count: usize| {
            let half = 0.5 * count as f64 * grid.bin_mm;
            Axis::uniform(Quantity::new(name, Unit::Millimetre), -half, half, count)
        };
        let [x, y] = [axis("x", grid.columns)?, axis("y", grid.rows)?];
        Map::new(self.units.irradiance(), y, x, value, error)
    }

    fn extremes(&self) -> Option<Extremes> {
        let entry = self.result.figure(VALLEY_TO_PEAK.key)?.entry;
        let (valley_mm, peak_mm) = (entry.valley_at_mm?, entry.peak_at_mm?);
        Some(Extremes { valley_to_peak: entry, valley_mm, peak_mm })
    }

    pub(super) fn line(&self) -> MapLine {
        let grid = self.observation.grid;
        let segments = layout(self.design).straight();
        let of_valley =
            |extremes: Extremes| MapLine::of_valley(grid, &segments, extremes.valley_mm);
        self.extremes()
            .and_then(of_valley)
            .unwrap_or_else(|| MapLine::row(grid, self.design.array.places_mm()[0][1]))
    }

    pub(super) fn section(&self, line: &MapLine) -> Result<Curve> {
        section(&self.observation.illuminance, self.observation.grid, &self.units, line)
    }

    /// The sections `curves` along `line`, with valley and peak of the first.
    pub(super) fn section_picture(
        &self,
        line: &MapLine,
        curves: &[Curve],
        colours: LineColours,
    ) -> Result<Picture> {
        let (marks, level) = self.marks_on(line, &curves[0]);
        let leds: Vec<[f64; 2]> =
            self.led_outlines().iter().filter_map(|led| line.within(led)).collect();
        let [x, y] = line.start.map(|mm| (mm * 1e3).round() / 1e3);
        let title = match line.name {
            "x" => format!("Cross-section along x at y = {y} mm"),
            "y" => format!("Cross-section along y at x = {x} mm"),
            _ => format!("Cross-section from the LED at ({x}, {y}) mm"),
        };
        cross_section(&Section {
            heading: &self.heading(&title.replace('-', "−").replace("Cross−", "Cross-")),
            position: &Quantity::new(line.name, Unit::Millimetre),
            quantity: &self.units.irradiance(),
            curves,
            leds: &leds,
            marks: &marks,
            level: level.as_ref().map(|(value, name)| (*value, name.as_str())),
            colours,
            range: None,
        })
    }

    /// Valley and peak on the section, and the level of a peak that lies beside it.
    fn marks_on(&self, line: &MapLine, section: &Curve) -> (Vec<Mark>, Option<(f64, String)>) {
        let Some(Extremes { valley_to_peak, valley_mm, peak_mm }) = self.extremes() else {
            return (Vec::new(), None);
        };
        let valley = line.position(valley_mm);
        let places = section.x().iter().zip(section.value());
        let nearest = places.min_by(|a, b| (a.0 - valley).abs().total_cmp(&(b.0 - valley).abs()));
        let value = nearest.map_or(0.0, |(_, value)| *value);
        let mut marks = vec![Mark::valley([valley, value], &valley_to_peak)];
        let seen = self.observation.illuminance.total();
        let largest = seen.iter().copied().fold(0.0, f64::max);
        let peak = largest * self.units.per_irradiance();
        if let Some(position) = self.peak_on(line, largest, peak_mm) {
            marks.push(Mark::peak([position, peak]));
            return (marks, None);
        }
        let [x, y] = peak_mm.map(|mm| format!("{mm:.2}").replace('-', "−"));
        let level = (peak, format!("peak of the map, at ({x}, {y}) mm"));
        (marks, Some(level))
    }

    /// Position on the line of the largest bin or, by symmetry, of one that is as large.
    fn peak_on(&self, line: &MapLine, largest: f64, peak_mm: [f64; 2]) -> Option<f64> {
        const EQUAL: f64 = 1e-9;
        let grid = self.observation.grid;
        let reach = 0.76 * grid.bin_mm * self.design.receiver.read_together() as f64;
        let near = |at: &[f64; 2]| line.distance(*at) <= reach;
        let seen = self.observation.illuminance.total();
        let bins = seen.iter().enumerate();
        let as_large = bins.filter(|(_, v)| **v >= largest * (1.0 - EQUAL));
        let mut places = as_large.map(|(k, _)| grid.middle_mm(k));
        let on_line = Some(peak_mm).filter(near);
        on_line.or_else(|| places.find(near)).map(|at| line.position(at))
    }

    /// The map with LEDs, valley and peak, as `draw` draws it.
    pub(super) fn map_picture(
        &self,
        map: &Map,
        line: &MapLine,
        draw: impl Fn(&IlluminanceMap) -> Result<Picture>,
    ) -> Result<Picture> {
        let marks = self.extremes().map_or(Vec::new(), |at| {
            vec![Mark::valley(at.valley_mm, &at.valley_to_peak), Mark::peak(at.peak_mm)]
        });
        let name = capitalised(map.quantity().name());
        let title = format!("{name} at z = {} mm", self.design.receiver.plane_height_mm);
        draw(&IlluminanceMap {
            leds: &self.led_outlines(),
            marks: &marks,
            section: Some(line.ends()),
            ..IlluminanceMap::plain(&self.heading(&title), map)
        })
    }

    /// Curves of this model.
    pub(super) fn colours(&self) -> LineColours {
        LineColours::OfModel(palette::model_number(&self.result.key).unwrap_or(0))
    }

    /// LEDs as maps show them.
    pub(super) fn led_outlines(&self) -> Vec<LedOutline> {
        let axes = self.design.array.axes_mm().into_iter().enumerate();
        let outline = |(package, axis): (usize, [f64; 2])| {
            let offset = self.design.led_offset_mm(package);
            let Pose { turn_deg, scale } = self.design.array.pose(package);
            LedOutline {
                centre: [0, 1].map(|k| axis[k] + offset[k]),
                size: self.design.led.size_mm.map(|length| scale * length),
                turn_deg,
            }
        };
        axes.map(outline).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { columns: 20, rows: 10, bin_mm: 0.5 };

    #[test]
    fn the_section_runs_where_the_valley_was_read() {
        let segments =
            [[[-3.0, -1.0], [3.0, -1.0]], [[-3.0, -1.0], [-3.0, 1.0]], [[-3.0, 1.0], [3.0, 1.0]]];
        let line = |valley| MapLine::of_valley(GRID, &segments, valley).expect("a line");
        assert_eq!(line([0.3, 1.0]), MapLine::row(GRID, 1.0));
        let column = line([-3.0, 0.2]);
        assert_eq!((column.name, column.positions.len()), ("y", 10));
        assert!((column.position([-3.0, 0.2]) - 0.2).abs() < 1e-12);
        // At the corner of both, the row.
        assert_eq!(line([-3.0, -1.0]).name, "x");
        assert_eq!(MapLine::of_valley(GRID, &segments, [0.0, 0.0]), None);
    }

    #[test]
    fn slanted_lines_stay_on_the_map_and_cross_leds() {
        let line = MapLine::through(GRID, [[0.0, 0.0], [1.0, 1.0]]);
        let [a, b] = line.ends();
        assert!(a[1] >= -2.25 - 1e-9 && b[1] <= 2.25 + 1e-9 && line.positions.len() > 10);
        let led = |centre, size, turn_deg| line.within(&LedOutline { centre, size, turn_deg });
        let root = 2.0f64.sqrt();
        let crossed = |span: Option<[f64; 2]>, half: f64| {
            let [from, to] = span.expect("crossed");
            (from - root + half).abs() < 1e-12 && (to - root - half).abs() < 1e-12
        };
        assert!(crossed(led([1.0, 1.0], [1.0, 1.0], 0.0), 0.5 * root));
        assert_eq!(led([3.0, 0.0], [1.0, 1.0], 0.0), None);
        // Turned into the line, and across it.
        assert!(crossed(led([1.0, 1.0], [1.0, 0.2], 45.0), 0.5));
        assert!(crossed(led([1.0, 1.0], [1.0, 0.2], -45.0), 0.1));
    }
}
