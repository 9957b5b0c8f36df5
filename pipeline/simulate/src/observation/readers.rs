// SPDX-License-Identifier: MIT OR Apache-2.0
//! One reader for each source of figures.

use std::borrow::Cow;

use design::Design;
use design::resolved::luminescence::MediumLuminophore;
use design::resolved::medium::Medium;
use design::resolved::receivers::CheckedReceiver;
use design::schema::receivers::{Normal, StatedRectangle};
use metrics::bins::{Bins, largest};
use metrics::extraction::{self, flow};
use metrics::far_field::{FarFieldFigures, FarFieldReading, PeakPlace, PlainFarField};
use metrics::figures::{
    ABOVE_LEDS, BEAM_ANGLE, CELL_MEAN, CENTRE_TO_PEAK, Definition, ESCAPED_DOWN, ESCAPED_UP,
    EXTRACTION, FIELD_ANGLE, FLUX_DOWN, FLUX_UP, ILLUMINANCE_PEAK, INTENSITY_CENTRE,
    INTENSITY_PEAK, INTENSITY_PER_KILOLUMEN, OF_SURFACE, PARABOLA, PEAK_ANGLE, Source, receiver,
};
use metrics::illuminance::Grid;
use metrics::kinds::Weighting;
use metrics::layout::Layout;
use metrics::quantity::Unit;
use metrics::uniformity_forms::MapMean;
use metrics::{Estimate, Grouped};
use results::figure_entry::FigureEntry;
use results::film_light::PASSED;
use tracer::Measurement;
use tracer::receiver::{FLUX_BINS, underscored};

use super::by_angle::{AngleReader, figures_by_angle};
use super::colour_readers::{ColourReader, ReceiverColourReader};
use super::map_reader::MapReader;
use super::reader::{Column, Reader, of_width, unit_of_receiver};
use super::{CONVERSION_LOSSES, Observation, far_field_reading, layout};
use crate::lit;
use crate::units::Units;

/// The readers of `seen` that read a figure which is `wanted`.
pub(super) fn readers<'a>(
    seen: &'a Observation,
    design: &'a Design,
    wanted: &dyn Fn(&str) -> bool,
) -> Vec<Box<dyn Reader + 'a>> {
    let units = Units::from_design(design, design.all_lights().as_deref());
    let any = |source: Source| {
        let mut all = metrics::figures::all().filter(|figure| figure.source == source);
        all.any(|figure| wanted(figure.key))
    };
    let mut all: Vec<Box<dyn Reader + 'a>> = Vec::new();
    if any(Source::FarField) {
        all.push(Box::new(FarFieldReader::new(design, units)));
    }
    if any(Source::Map) && seen.lit() {
        all.push(Box::new(MapReader::new(design, seen)));
    }
    if any(Source::Domes) && design.dome.is_some() {
        all.push(Box::new(DomeReader));
    }
    if any(Source::Colours)
        && let Some(reader) = ColourReader::new(seen)
    {
        all.push(Box::new(reader));
    }
    if any(Source::Ledger) || seen.accounts.iter().any(|account| wanted(account)) {
        let accounts = &seen.accounts;
        let share = |account: &str| Definition::of_account(account).map(Column::plain);
        all.push(Box::new(LedgerReader::new(design, accounts, false, share)));
        if design.emitted.is_some() {
            let flux = |account: &str| {
                let all = [(ESCAPED_UP, FLUX_UP), (ESCAPED_DOWN, FLUX_DOWN)];
                let (_, flux) = all.into_iter().find(|(end, _)| end.key == account)?;
                Some(Column::new(flux, flux.unit, &units))
            };
            let is_luminous = seen.luminous.is_some();
            all.push(Box::new(LedgerReader::new(design, accounts, is_luminous, flux)));
        }
    }
    if any(Source::Illuminance) && design.emitted.is_some() {
        all.push(Box::new(IlluminanceReader::new(seen.grid, design, units)));
    }
    for (k, receiver) in design.receivers.iter().enumerate() {
        let of_bins = ReceiverReader::new(k, receiver, design, units);
        let of_bins = of_bins.map(|reader| Box::new(reader) as Box<dyn Reader + 'a>);
        let of_sides = matches!(receiver.detector.measurement, Measurement::Flux(_))
            .then(|| Box::new(SurfaceReader { number: k, receiver }) as Box<dyn Reader + 'a>);
        let by_angle = AngleReader::new(k, receiver, units);
        let by_angle = by_angle.map(|reader| Box::new(reader) as Box<dyn Reader + 'a>);
        let colours = ReceiverColourReader::new(k, design, seen);
        let colours = colours.map(|reader| Box::new(reader) as Box<dyn Reader + 'a>);
        let readers = [of_bins, of_sides, by_angle, colours].into_iter().flatten();
        all.extend(
            readers
                .filter(|reader| reader.columns().iter().any(|column| wanted(&column.figure.key))),
        );
    }
    all
}

/// A figure with its value and its entry in a far field.
type OfFarField = (Definition, fn(&PlainFarField) -> f64, fn(&FarFieldFigures) -> FigureEntry);
const OF_FAR_FIELD: [OfFarField; 8] = [
    (
        PEAK_ANGLE,
        |far| far.peak_angle_deg,
        |far| FigureEntry {
            peak_range_deg: far.peak_range_deg,
            interval: far.peak_edges_deg,
            ..angle(far, far.peak_angle_deg)
        },
    ),
    (
        CENTRE_TO_PEAK,
        |far| far.centre_to_peak,
        // A ratio to a peak that is noise is noise as well.
        |far| FigureEntry {
            peak_place: match far.peak_place {
                PeakPlace::NotResolved => PeakPlace::NotResolved,
                PeakPlace::OffAxis | PeakPlace::OnAxis => PeakPlace::OffAxis,
            },
            ..FigureEntry::new(far.centre_to_peak)
        },
    ),
    (
        PARABOLA,
        |far| far.peak_angle_parabola_deg,
        |far| FigureEntry {
            interval: far.parabola_edges_deg,
            ..angle(far, far.peak_angle_parabola_deg.unwrap_or(Estimate::new(f64::NAN, 0.0)))
        },
    ),
    (BEAM_ANGLE, |far| far.widths_deg[0], |far| of_width(far.widths_deg[0])),
    (FIELD_ANGLE, |far| far.widths_deg[1], |far| of_width(far.widths_deg[1])),
    (INTENSITY_CENTRE, |far| far.centre_w_per_sr, |far| FigureEntry::new(far.centre_w_per_sr)),
    (INTENSITY_PEAK, |far| far.peak_w_per_sr, |far| FigureEntry::new(far.peak_w_per_sr)),
    (INTENSITY_PER_KILOLUMEN, |far| far.peak_w_per_sr, |far| FigureEntry::new(far.peak_w_per_sr)),
];

/// Angle of a peak.
fn angle(far: &FarFieldFigures, angle: Estimate) -> FigureEntry {
    FigureEntry { peak_place: far.peak_place, upper_bound: None, ..FigureEntry::new(angle) }
}

struct FarFieldReader {
    reading: FarFieldReading,
    read: Vec<OfFarField>,
    units: Units,
}

impl FarFieldReader {
    fn new(design: &Design, units: Units) -> Self {
        let has = |(figure, ..): &OfFarField| match figure.unit {
            Unit::CandelaPerKilolumen => has_lumens(design),
            _ => !figure.is_absolute || design.emitted.is_some(),
        };
        let read = OF_FAR_FIELD.into_iter().filter(has).collect();
        Self { reading: far_field_reading(design), read, units }
    }
}

impl Reader for FarFieldReader {
    fn columns(&self) -> Vec<Column> {
        let all = self.read.iter();
        all.map(|(figure, ..)| Column::new(*figure, figure.unit, &self.units)).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        Some(Cow::Borrowed(&seen.far_field))
    }

    fn values(&self, powers: &[f64]) -> Vec<f64> {
        let far = self.reading.plain(powers);
        self.read.iter().map(|(_, value, _)| value(&far)).collect()
    }

    fn entries(&self, powers: &Grouped) -> Vec<FigureEntry> {
        let far = self.reading.figures(powers);
        // Nothing is read from a far field without light.
        if far.peak_w_per_sr.value <= 0.0 {
            return Vec::new();
        }
        self.read.iter().map(|(.., entry)| entry(&far)).collect()
    }
}

/// True if the lumens emitted are stated and the far field is one of lumens: of one wavelength, or
/// weighted by V(λ).
pub(super) fn has_lumens(design: &Design) -> bool {
    let lights = design.all_lights();
    let is_weighted = lights.is_none_or(|all| all.weighting == Weighting::Photometric);
    is_weighted && design.emitted_lm().is_some()
}

struct DomeReader;

impl Reader for DomeReader {
    fn columns(&self) -> Vec<Column> {
        vec![Column::plain(EXTRACTION)]
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        Some(Cow::Borrowed(&seen.flows))
    }

    fn values(&self, flows: &[f64]) -> Vec<f64> {
        vec![extraction::of_powers(flows)]
    }
}

/// Shares of the ledger's ends of light, or flux upwards and downwards, W or lm.
struct LedgerReader<'a> {
    design: &'a Design,
    /// Position and name of accounts, and what they are read as.
    ends: Vec<(usize, &'a str, Column)>,
    /// True where the lumens of the accounts are read, which are of 1 W emitted.
    is_luminous: bool,
}

impl<'a> LedgerReader<'a> {
    /// Those of `accounts` that `column` makes a figure of.
    fn new(
        design: &'a Design,
        accounts: &'a [String],
        is_luminous: bool,
        column: impl Fn(&str) -> Option<Column>,
    ) -> Self {
        let all = accounts.iter().enumerate();
        let ends = all.filter_map(|(k, account)| Some((k, account.as_str(), column(account)?)));
        Self { design, ends: ends.collect(), is_luminous }
    }
}

impl Reader for LedgerReader<'_> {
    fn columns(&self) -> Vec<Column> {
        self.ends.iter().map(|(.., column)| column.clone()).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        let luminous = seen.luminous.as_ref().filter(|_| self.is_luminous);
        Some(Cow::Borrowed(luminous.unwrap_or(&seen.powers)))
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        let emitted = if self.is_luminous { 1.0 } else { sums[flow::EMITTED] };
        self.ends.iter().map(|(k, ..)| sums[*k] / emitted).collect()
    }

    fn one_path(&self, power: f64) -> Vec<f64> {
        let ends = self.ends.iter();
        ends.map(|(_, account, _)| of_one_path(self.design, account, power)).collect()
    }
}

/// Power of one path in this account: 0 if none of `design` can end there, below the plane
/// without a housing or in a medium that does not absorb.
pub fn of_one_path(design: &Design, account: &str, power: f64) -> f64 {
    let solids = design.solids.iter();
    let solids = solids.filter_map(|solid| Some((solid.name(), solid.medium.as_ref()?)));
    let mut media = solids.chain([("silicone", &design.silicone)]);
    let is_reachable = match account.strip_prefix("absorbed_in_") {
        Some(medium) => {
            let is_loss = |of: &MediumLuminophore| {
                CONVERSION_LOSSES.iter().any(|loss| medium == format!("{}_{loss}", of.name))
            };
            // Of converted light a medium may absorb other wavelengths than that of the design.
            let absorbs = |of: &Medium| of.absorption_per_mm > 0.0 || design.converts();
            media.any(|(name, of)| underscored(name) == medium && absorbs(of))
                || design.luminophores().any(is_loss)
        }
        None if account == ESCAPED_DOWN.key => design.housing.is_some(),
        None => extraction::is_end(account) || account.starts_with(PASSED),
    };
    if is_reachable { power } else { 0.0 }
}

/// Illuminance above the LEDs, at its peak, and over the cell.
struct IlluminanceReader {
    grid: Grid,
    leds: usize,
    above: MapMean,
    cell: Option<MapMean>,
    /// Shares of the bins that figures count; all without.
    counted: Option<Vec<f64>>,
    units: Units,
}

impl IlluminanceReader {
    fn new(grid: Grid, design: &Design, units: Units) -> Self {
        let (layout, counted) = (layout(design), lit::of_plane(design).map(|lit| lit.counted));
        let above = MapMean::of_points(grid, counted.as_deref(), &layout.axes_mm);
        let cell = MapMean::of_cell(grid, counted.as_deref(), &layout);
        Self { grid, leds: layout.axes_mm.len(), above, cell, counted, units }
    }

    /// Illuminance of a bin by so much power.
    fn of_bin(&self, power: f64) -> f64 {
        power / (self.grid.bin_mm * self.grid.bin_mm)
    }

    /// A map that is dark where figures count nothing.
    fn counted_map<'a>(&self, map: &'a [f64]) -> Cow<'a, [f64]> {
        let Some(counted) = &self.counted else { return Cow::Borrowed(map) };
        map.iter()
            .zip(counted)
            .map(|(value, part)| if *part > 0.0 { *value } else { 0.0 })
            .collect()
    }
}

/// A figure of a map with its value, and what the power of one path changes it by.
type OfMap =
    (Definition, fn(&IlluminanceReader, &[f64]) -> f64, fn(&IlluminanceReader, f64) -> f64);
const OF_MAP: [OfMap; 3] = [
    (
        ABOVE_LEDS,
        |reader, map| reader.above.of(map),
        |reader, power| reader.of_bin(power) / reader.leds as f64,
    ),
    (
        ILLUMINANCE_PEAK,
        |reader, map| reader.counted_map(map).iter().copied().fold(0.0, f64::max),
        IlluminanceReader::of_bin,
    ),
    (
        CELL_MEAN,
        |reader, map| reader.cell.as_ref().map_or(f64::NAN, |cell| cell.of(map)),
        |_, _| 0.0,
    ),
];

impl Reader for IlluminanceReader {
    fn columns(&self) -> Vec<Column> {
        OF_MAP.map(|(figure, ..)| Column::new(figure, figure.unit, &self.units)).into()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        Some(Cow::Borrowed(&seen.illuminance))
    }

    fn values(&self, map: &[f64]) -> Vec<f64> {
        OF_MAP.map(|(_, value, _)| value(self, map)).into()
    }

    fn entries(&self, map: &Grouped) -> Vec<FigureEntry> {
        let all = OF_MAP.into_iter().zip(self.replicates(map));
        all.map(|((figure, ..), read)| {
            FigureEntry::new(match &self.counted {
                _ if figure != ILLUMINANCE_PEAK => read.estimate(),
                Some(_) => largest(&map.map(|group| self.counted_map(group).into_owned())),
                None => largest(map),
            })
        })
        .collect()
    }

    fn one_path(&self, power: f64) -> Vec<f64> {
        OF_MAP.map(|(.., one_path)| one_path(self, power)).into()
    }
}

/// Figures of a receiver that has one flux. Of a luminance receiver mean and extremes are those
/// over places, of the mean over its directions.
struct ReceiverReader<'a> {
    number: usize,
    receiver: &'a CheckedReceiver,
    units: Units,
    /// Directions of each place.
    directions: usize,
    bins: Bins,
    figures: Vec<Definition>,
}

impl<'a> ReceiverReader<'a> {
    /// `None` of surfaces, whose bins hold one another.
    fn new(
        number: usize,
        receiver: &'a CheckedReceiver,
        design: &Design,
        units: Units,
    ) -> Option<Self> {
        let detector = &receiver.detector;
        let directions = match &detector.measurement {
            Measurement::Flux(_) => return None,
            Measurement::Luminance(_, angles) => angles.bins(),
            Measurement::Plane(_) | Measurement::FarField(_) => 1,
        };
        let measures = summed(&detector.measures()[..detector.places()], directions);
        let counted = lit::counted_places(design, receiver);
        let mut bins = Bins::new(&measures, counted.as_deref());
        if let Some(rectangle) = rectangle_of_points(receiver) {
            bins = with_points(bins, &rectangle, design, counted.as_deref());
        }
        let figures = figures_of_bins(receiver).collect();
        Some(Self { number, receiver, units, directions, bins, figures })
    }

    /// What was read of each figure, `none` where nothing was.
    fn in_order<T: Copy>(&self, read: &[(Definition, T)], none: T) -> Vec<T> {
        let of = |figure: &Definition| read.iter().find(|(of, _)| of.key == figure.key);
        self.figures.iter().map(|figure| of(figure).map_or(none, |(_, value)| *value)).collect()
    }
}

/// Least bins along each side of a rectangle for points of a display: nine points lie in three rows.
const MIN_BINS_OF_POINTS: usize = 3;

/// The rectangle of a receiver that has nine and thirteen points.
fn rectangle_of_points(receiver: &CheckedReceiver) -> Option<StatedRectangle> {
    let rectangle = receiver.stated.kind.rectangle();
    rectangle.filter(|r| r.bins.iter().all(|count| *count >= MIN_BINS_OF_POINTS))
}

/// The figures that a receiver has.
pub(super) fn figures_of(receiver: &CheckedReceiver) -> impl Iterator<Item = Definition> {
    let by_angle = figures_by_angle(receiver);
    let is_surface = matches!(receiver.detector.measurement, Measurement::Flux(_));
    let of_sides = is_surface.then(figures_of_sides).into_iter().flatten();
    figures_of_bins(receiver).filter(move |_| !is_surface).chain(by_angle).chain(of_sides)
}

/// Fluxes on a surface, in the order of its bins.
fn figures_of_sides() -> impl Iterator<Item = Definition> {
    let named = |key: &str| OF_SURFACE.into_iter().find(|figure| figure.key == key);
    FLUX_BINS.into_iter().filter_map(named)
}

/// Reads the fluxes on a surface.
struct SurfaceReader<'a> {
    number: usize,
    receiver: &'a CheckedReceiver,
}

impl Reader for SurfaceReader<'_> {
    fn columns(&self) -> Vec<Column> {
        let name = self.receiver.name();
        figures_of_sides().map(|figure| Column::plain(figure.of_receiver(name))).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        seen.receivers.get(self.number).map(Cow::Borrowed)
    }

    fn values(&self, powers: &[f64]) -> Vec<f64> {
        powers.to_vec()
    }

    fn one_path(&self, power: f64) -> Vec<f64> {
        vec![power; FLUX_BINS.len()]
    }
}

/// Those that are read from its bins: flux and mean alone of one place, which has no extremes.
fn figures_of_bins(receiver: &CheckedReceiver) -> impl Iterator<Item = Definition> {
    let directions = match &receiver.detector.measurement {
        Measurement::Luminance(_, angles) => angles.bins(),
        _ => 1,
    };
    let has_extremes = receiver.detector.places() / directions > 1;
    let has_points = has_extremes && rectangle_of_points(receiver).is_some();
    let extremes = [receiver::MIN, receiver::MAX, receiver::MIN_TO_MAX].into_iter();
    let points = [receiver::NINE_POINTS, receiver::THIRTEEN_POINTS].into_iter();
    [receiver::FLUX, receiver::MEAN]
        .into_iter()
        .chain(extremes.filter(move |_| has_extremes))
        .chain(points.filter(move |_| has_points))
}

/// `bins` with the points of this rectangle; one that lies level sees the packages below.
fn with_points(
    bins: Bins,
    rectangle: &StatedRectangle,
    design: &Design,
    counted: Option<&[f64]>,
) -> Bins {
    let bin_mm = [0, 1].map(|k| rectangle.size_mm[k] / rectangle.bins[k] as f64);
    let [x, y, _] = rectangle.position_mm;
    let layout = match rectangle.normal {
        Normal::Up | Normal::Down => layout(design).seen_from([x, y], bin_mm),
        _ => Layout::of_places(Vec::new()),
    };
    let spot = rectangle.spot_mm.map(|mm| bin_mm.map(|bin| mm / bin));
    bins.with_points(rectangle.bins, &layout, spot, counted)
}

/// Sums of `count` neighbours each.
fn summed(bins: &[f64], count: usize) -> Vec<f64> {
    bins.chunks(count).map(|bins| bins.iter().sum()).collect()
}

impl Reader for ReceiverReader<'_> {
    fn columns(&self) -> Vec<Column> {
        let of = |figure: Definition| {
            let unit = unit_of_receiver(figure, self.receiver.kind());
            Column::new(figure.of_receiver(self.receiver.name()), unit, &self.units)
        };
        self.figures.iter().map(|figure| of(*figure)).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        let powers = seen.receivers.get(self.number)?;
        let places = self.receiver.detector.places();
        if self.directions == 1 && powers.total().len() == places {
            return Some(Cow::Borrowed(powers));
        }
        Some(Cow::Owned(powers.map(|bins| summed(&bins[..places], self.directions))))
    }

    fn values(&self, powers: &[f64]) -> Vec<f64> {
        self.in_order(&self.bins.values(powers), f64::NAN)
    }

    fn entries(&self, powers: &Grouped) -> Vec<FigureEntry> {
        let read = self.bins.figures(powers);
        let read = self.in_order(&read, Estimate::new(f64::NAN, 0.0)).into_iter();
        read.map(FigureEntry::new).collect()
    }

    fn one_path(&self, power: f64) -> Vec<f64> {
        self.in_order(&self.bins.one_path(power), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use metrics::figures::{FAR_FIELD, ILLUMINANCE};

    use super::*;

    #[test]
    fn every_figure_of_the_registry_has_a_reader() {
        assert_eq!(OF_FAR_FIELD.map(|(figure, ..)| figure), FAR_FIELD);
        assert_eq!(OF_MAP.map(|(figure, ..)| figure), ILLUMINANCE);
        assert_eq!(figures_of_sides().collect::<Vec<_>>(), OF_SURFACE);
    }
}
