// SPDX-License-Identifier: MIT OR Apache-2.0
//! Observations: receiver sums of a trace, group by group, and the figures of merit that follow
//! from them.

mod map_reader;
mod missing;

use std::borrow::Cow;

use anyhow::Result;
use map_reader::MapReader;
use metrics::figures::{
    self, CENTRE_TO_PEAK, COLOUR_DIFFERENCE, Definition, EXTRACTION, FAR_FIELD, PAPERS_MAP,
    PARABOLA, PEAK_ANGLE, Source, UNIFORMITY, UNIFORMITY_DIAGONAL,
};
use rayon::prelude::*;
use tracer::Outcome;
use tracer::ledger::{Lines, Loss};

use design::Design;
use design::schema::{Average, Zero};
use metrics::extraction::{self, Ledger, flow};
use metrics::far_field::{AngularBins, BinPlacement, FarFieldReading, PeakPlace};
use metrics::illuminance::{Grid, Symmetry, coarser, smoothed};
use metrics::layout::Layout;
use metrics::quantity::Curve;
use metrics::uniformity::{Places, ValleyReading, bin_by_bin};
use metrics::uniformity_forms::nine_points;
use metrics::{Estimate, Grouped, JackknifedFigure, changes, colour_difference};
use results::{Extremes, Figure};

/// Receiver sums of one trace, by groups of paths.
#[derive(Debug, Clone)]
pub struct Observation {
    /// Paths traced.
    pub paths: u64,
    /// Mean number of surfaces that a path meets.
    pub surfaces_per_path: f64,
    /// Irradiance on the plane, W/mm², averaged over symmetries and smoothed.
    pub illuminance: Grouped,
    /// Bins of the plane.
    pub grid: Grid,
    /// Power by direction, W.
    pub far_field: Grouped,
    /// Bins of the far field.
    pub sphere: AngularBins,
    /// Emitted, outward, inward power (positions of [`flow`]), W.
    pub flows: Grouped,
    /// Names of the ledger's accounts.
    pub accounts: Vec<String>,
    /// Power of each account, W.
    pub powers: Grouped,
    /// Power in the bins of each receiver of `[[receivers]]`, W.
    pub receivers: Vec<Grouped>,
    /// Names of surfaces that leave light unpolarised.
    pub depolarised_by: Vec<String>,
    /// X, Y and Z (CIE 1931) at the nine points of the cell, in any one unit, where several
    /// wavelengths were put together.
    pub tristimulus: Option<Grouped>,
}

/// Positions of the receivers in a trace.
pub mod receiver {
    /// Far field.
    pub const FAR_FIELD: usize = 0;
    /// Plane.
    pub const PLANE: usize = 1;
    /// The first of `[[receivers]]`.
    pub const OTHERS: usize = 2;
}

/// Bins of the plane: centred on the array, up to the margin beyond the outermost axes. Their
/// number is even, or makes whole bins of those that are read.
pub fn plane_grid(design: &Design) -> Grid {
    let r = &design.receiver;
    let margin_mm = r.margin_mm(design.array.pitch_mm);
    let whole = |length: f64, bin: f64| (length / bin - 1e-9).ceil() as usize;
    let [columns, rows] = design.half_extent_mm().map(|half| match r.read_bin_mm {
        Some(read) => whole(2.0 * (half + margin_mm), read) * r.read_together(),
        None => 2 * whole(half + margin_mm, r.bin_mm),
    });
    Grid { columns, rows, bin_mm: r.bin_mm }
}

/// Bins of the far field of `design`.
pub fn sphere(design: &Design) -> AngularBins {
    let f = &design.far_field;
    AngularBins {
        bin_deg: f.bin_deg,
        polar: (180.0 / f.bin_deg).round() as usize,
        azimuths: (360.0 / f.azimuth_bin_deg).round() as usize,
        bins: BinPlacement::Between,
    }
}

/// How the figures of the far field of `design` are read.
pub fn far_field_reading(design: &Design) -> FarFieldReading {
    let f = &design.far_field;
    FarFieldReading {
        recorded: sphere(design),
        read_bin_deg: f.read_bin_deg(),
        read_bins: f.read_bins,
        centre_deg: f.centre_deg,
        peak: f.peak,
        peak_fit_deg: f.peak_fit_deg,
        cut_deg: f.cut_deg,
    }
}

/// Positions of the LEDs of `design`, and which of them are neighbours.
pub fn layout(design: &Design) -> Layout {
    let array = &design.array;
    let axes = array.axes_mm();
    match array.rectangle() {
        Some([columns, rows]) => Layout::rectangular(axes, columns, rows, array.pitch_mm),
        None => Layout::by_distance(axes, array.pitch_mm),
    }
}

/// The symmetries that maps of `design` are averaged over.
pub fn symmetry(design: &Design) -> Symmetry {
    if design.receiver.average == Average::None {
        return Symmetry::None;
    }
    let [led_x, led_y] = design.led.size_mm;
    let array = match design.array.rectangle() {
        // A box off its axis, or tilted, leaves none of the mirrors of the array.
        _ if !design.led.is_centred() => Symmetry::None,
        None => Symmetry::None,
        Some([columns, rows]) if columns == rows && (led_x / led_y - 1.0).abs() < 1e-12 => {
            Symmetry::Square
        }
        Some(_) => Symmetry::Rectangle,
    };
    let sources = design.sources.iter().map(|source| source.symmetry);
    let solids = design.solids.iter().map(|solid| solid.symmetry);
    sources.chain(solids).fold(array.min(design.files.symmetry()), Symmetry::min)
}

/// How the valley of the map of `design` is read.
fn reading(design: &Design) -> ValleyReading {
    match design.receiver.read_bin_mm {
        Some(_) => ValleyReading::Bins,
        None => ValleyReading::Fit,
    }
}

/// Whether a weight is exactly 1.
pub(super) fn is_one(weight: f64) -> bool {
    weight.to_bits() == 1.0f64.to_bits()
}

impl Observation {
    /// Collects the readings of `outcome`, traced with a far field and a plane as first receivers.
    pub fn new(design: &Design, mut outcome: Outcome) -> Self {
        // The tracer scales every group to the whole power; here the groups add up to it.
        let share = 1.0 / outcome.groups.len() as f64;
        // Readings are moved out of the groups, so that none is in memory twice.
        let count = outcome.total.readings.len();
        outcome.total.readings.clear();
        let mut take = |which: usize| {
            let groups = outcome.groups.iter_mut().map(|group| {
                let mut reading = std::mem::take(&mut group.readings[which]);
                for power in &mut reading {
                    *power *= share;
                }
                reading
            });
            Grouped::new(groups.collect())
        };
        let plane = take(receiver::PLANE);
        let far_field = take(receiver::FAR_FIELD);
        let receivers = (receiver::OTHERS..count).map(take).collect();
        let grid = plane_grid(design);
        let flows = Grouped::new(
            outcome
                .groups
                .iter()
                .map(|g| {
                    let mut flows = vec![0.0; 3];
                    flows[flow::EMITTED] = g.ledger.emitted * share;
                    for (name, line) in g.ledger.named_surfaces() {
                        if super::scene::is_skin(name) {
                            flows[flow::OUTWARD] += line.outward * share;
                            flows[flow::INWARD] += line.inward * share;
                        }
                    }
                    flows
                })
                .collect(),
        );
        Self {
            paths: outcome.paths,
            surfaces_per_path: outcome.hits as f64 / outcome.paths as f64,
            illuminance: smoothed(
                plane,
                grid,
                symmetry(design),
                design.receiver.smoothing_sigma_mm,
            ),
            grid,
            far_field,
            sphere: sphere(design),
            accounts: accounts(&outcome),
            powers: powers(&outcome, &flows),
            receivers,
            depolarised_by: Vec::new(),
            tristimulus: None,
            flows,
        }
    }

    /// The weighted sum of observations of one design with the same groups. Weights add up to 1, so
    /// that sources still emit 1 W.
    ///
    /// # Panics
    /// Without parts, or with parts of other designs.
    #[must_use]
    pub fn weighted(parts: &[(f64, &Self)]) -> Self {
        let receivers = 0..parts[0].1.receivers.len();
        let of = |number: usize| {
            let parts = parts.iter().map(|(w, o)| (*w, &o.receivers[number]));
            Grouped::weighted(&parts.collect::<Vec<_>>())
        };
        let receivers = receivers.map(of).collect();
        Self { receivers, ..Self::weighted_figures(parts) }
    }

    /// [`Observation::weighted`] without the receivers of `[[receivers]]`, on which no figure of
    /// merit depends.
    ///
    /// # Panics
    /// As [`Observation::weighted`].
    #[must_use]
    pub fn weighted_figures(parts: &[(f64, &Self)]) -> Self {
        let sum = |of: fn(&Self) -> &Grouped| {
            let parts: Vec<(f64, &Grouped)> = parts.iter().map(|(w, o)| (*w, of(o))).collect();
            Grouped::weighted(&parts)
        };
        let first = parts[0].1;
        Self {
            paths: parts.iter().map(|(_, o)| o.paths).sum(),
            surfaces_per_path: parts.iter().map(|(w, o)| w * o.surfaces_per_path).sum(),
            illuminance: sum(|o| &o.illuminance),
            grid: first.grid,
            far_field: sum(|o| &o.far_field),
            sphere: first.sphere,
            flows: sum(|o| &o.flows),
            accounts: first.accounts.clone(),
            powers: sum(|o| &o.powers),
            receivers: Vec::new(),
            depolarised_by: first.depolarised_by.clone(),
            tristimulus: None,
        }
    }

    /// [`Observation::weighted`]; a single part of weight 1 is borrowed, not copied.
    ///
    /// # Panics
    /// As [`Observation::weighted`].
    pub fn sum<'a>(parts: &[(f64, &'a Self)]) -> Cow<'a, Self> {
        match parts {
            [(weight, seen)] if is_one(*weight) => Cow::Borrowed(*seen),
            _ => Cow::Owned(Self::weighted(parts)),
        }
    }

    /// Adds `other`, of the same design and groups, in place: the bits of [`Observation::weighted`]
    /// of both with weights of 1.
    pub fn add(&mut self, other: &Self) {
        self.paths += other.paths;
        self.surfaces_per_path += other.surfaces_per_path;
        self.illuminance.add(&other.illuminance);
        self.far_field.add(&other.far_field);
        self.flows.add(&other.flows);
        self.powers.add(&other.powers);
        for (receiver, more) in self.receivers.iter_mut().zip(&other.receivers) {
            receiver.add(more);
        }
    }

    /// All powers times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self::weighted(&[(factor, self)])
    }

    /// The power ledger.
    pub fn ledger(&self) -> Ledger {
        Ledger::new(&self.accounts, &self.powers, flow::EMITTED)
    }

    /// How much each figure changes from `coarse` to this observation, by key. Both were made of
    /// the same groups of paths. The peak of the illuminance counts as the largest bin.
    pub fn changes(&self, coarse: &Self, design: &Design) -> Vec<(&'static str, Estimate)> {
        let reading = far_field_reading(design);
        let far = changes(&coarse.far_field, &self.far_field, |p| reading.plain(p));
        let extracted = changes(&coarse.flows, &self.flows, |p| vec![extraction::of_powers(p)]);
        let map = self.lit().then(|| {
            let reader = self.map_reader(design);
            let (from, to) = (coarse.binned_map(design), self.binned_map(design));
            reader.keyed(changes(&from, &to, |map| reader.values(map)))
        });
        let mut all = by_key(far, map.unwrap_or_default(), extracted);
        if let (Some(from), Some(to)) = (&coarse.tristimulus, &self.tristimulus) {
            let change = changes(from, to, largest_colour_difference);
            all.extend(change.into_iter().map(|e| (COLOUR_DIFFERENCE.key, e)));
        }
        all
    }

    /// Every figure without each group of paths in turn, by key; the peak of the illuminance counts
    /// as the largest bin.
    pub fn without(&self, design: &Design) -> Vec<(&'static str, Vec<f64>)> {
        let reading = far_field_reading(design);
        let of = |seen: &Grouped, figures: &(dyn Fn(&[f64]) -> Vec<f64> + Sync)| -> Vec<Vec<f64>> {
            let groups = (0..seen.count()).into_par_iter();
            let rows: Vec<Vec<f64>> = groups.map(|g| figures(&seen.without(g))).collect();
            let count = rows.iter().map(Vec::len).min().unwrap_or(0);
            (0..count).map(|i| rows.iter().map(|row| row[i]).collect()).collect()
        };
        let map = self.lit().then(|| {
            let reader = self.map_reader(design);
            reader.keyed(of(&self.binned_map(design), &|map| reader.values(map)))
        });
        let colours = self.tristimulus.as_ref().into_iter();
        let colours = colours.flat_map(|seen| of(seen, &largest_colour_difference));
        let colours = colours.map(|rows| (COLOUR_DIFFERENCE.key, rows));
        by_key(
            of(&self.far_field, &|p| reading.plain(p)),
            map.unwrap_or_default(),
            of(&self.flows, &|p| vec![extraction::of_powers(p)]),
        )
        .into_iter()
        .chain(colours)
        .collect()
    }

    /// The figures that are `wanted`, read alike from all paths and without each group: key, value,
    /// replicates. The peak of the illuminance counts as the largest bin.
    pub fn replicated(
        &self,
        design: &Design,
        wanted: impl Fn(&str) -> bool,
    ) -> Vec<(&'static str, JackknifedFigure)> {
        let mut all = Vec::new();
        if FAR_FIELD.iter().any(|figure| wanted(figure.key)) {
            let reading = far_field_reading(design);
            let read = replicates(&self.far_field, &|powers| reading.plain(powers));
            all.extend(FAR_FIELD.iter().map(|figure| figure.key).zip(read));
        }
        if design.dome.is_some() && wanted(EXTRACTION.key) {
            let read = replicates(&self.flows, &|p| vec![extraction::of_powers(p)]);
            all.extend([EXTRACTION.key].into_iter().zip(read));
        }
        if self.lit() && figures::all().any(|f| f.source == Source::Map && wanted(f.key)) {
            let reader = self.map_reader(design);
            let read = replicates(&self.binned_map(design), &|map| reader.values(map));
            all.extend(reader.keyed(read));
        }
        if let Some(seen) = self.tristimulus.as_ref().filter(|_| wanted(COLOUR_DIFFERENCE.key)) {
            let read = replicates(seen, &largest_colour_difference);
            all.extend([COLOUR_DIFFERENCE.key].into_iter().zip(read));
        }
        all.retain(|(key, _)| wanted(key));
        all
    }

    /// The map at the nine points of the cell of `design`, W/mm²; `None` without a cell.
    pub fn nine_points(&self, design: &Design) -> Option<Grouped> {
        let layout = layout(design);
        let read = |map: &[f64]| nine_points(self.grid, &layout, map);
        read(self.illuminance.total())?;
        let of_group = |map: &[f64]| read(map).map_or_else(Vec::new, Vec::from);
        Some(self.illuminance.map(of_group))
    }

    /// Figures of short runs of about `paths` paths each, cut from this trace in whole groups and
    /// read bin by bin, by key.
    pub fn short_runs(&self, design: &Design, paths: u64) -> Vec<(&'static str, Vec<f64>)> {
        let of_each = self.groups_of_run(paths);
        let far_field_reading = far_field_reading(design);
        let far: Vec<[f64; 2]> =
            self.far_field.runs(of_each).iter().map(|p| far_field_reading.bin_by_bin(p)).collect();
        let layout = layout(design);
        let map = self.illuminance.runs(of_each);
        let read = |map: &Vec<f64>| {
            let (map, grid) = coarser(map, self.grid, design.receiver.read_together());
            let map = above_zero(&map, design.receiver.zero);
            bin_by_bin(&map, grid, &layout, design.receiver.full_scale)
        };
        let map: Option<Vec<f64>> = map.iter().map(read).collect();
        let map = map.filter(|_| self.lit());
        let mut all = vec![
            (PEAK_ANGLE.key, far.iter().map(|f| f[0]).collect()),
            (CENTRE_TO_PEAK.key, far.iter().map(|f| f[1]).collect()),
        ];
        all.extend(map.map(|values| (UNIFORMITY.key, values)));
        all
    }

    /// Paths in a short run of about `paths`, in whole groups.
    pub fn paths_of_run(&self, paths: u64) -> f64 {
        let share = self.groups_of_run(paths) as f64 / self.far_field.count() as f64;
        share * self.paths as f64
    }

    fn groups_of_run(&self, paths: u64) -> usize {
        let groups = self.far_field.count();
        let of_run = (paths as f64 * groups as f64 / self.paths as f64).round() as usize;
        of_run.clamp(1, groups)
    }

    /// Whether any light went up through the map.
    pub fn lit(&self) -> bool {
        self.illuminance.total().iter().any(|value| *value > 0.0)
    }

    /// The map in the bins that are read.
    fn binned_map(&self, design: &Design) -> Cow<'_, Grouped> {
        match design.receiver.read_together() {
            1 => Cow::Borrowed(&self.illuminance),
            together => Cow::Owned(self.illuminance.map(|map| coarser(map, self.grid, together).0)),
        }
    }

    /// What reads the figures of maps of `design`, with windows and zero from this one.
    fn map_reader(&self, design: &Design) -> MapReader {
        MapReader::new(design, self.grid, &self.binned_map(design))
    }

    /// Azimuthal mean of the far field from 0 to 90°, with errors.
    ///
    /// # Errors
    /// Values that are no curve.
    pub fn azimuthal_mean(&self, label: &str) -> Result<Curve> {
        let sphere = self.sphere;
        let mean = self.far_field.map(|p| sphere.profile(p));
        curve(label, &mean, &sphere.centres_deg(), 90.0)
    }

    /// The figures of merit, in the order of the paper's tables.
    pub fn figures(&self, design: &Design) -> Vec<Figure> {
        let figure = |figure: Definition, estimate| Figure {
            key: figure.key,
            label: figure.label,
            unit: figure.unit,
            estimate,
            peak_place: PeakPlace::OffAxis,
            peak_range_deg: None,
            extremes: None,
            wavelength_error: None,
        };
        let far = far_field_reading(design).figures(&self.far_field);
        let mut figures = Vec::new();
        // Nothing is read from a far field without light.
        if far.peak_w_per_sr.value > 0.0 {
            let angle =
                |of, estimate| Figure { peak_place: far.peak_place, ..figure(of, estimate) };
            figures.extend([
                Figure {
                    peak_range_deg: far.peak_range_deg,
                    ..angle(PEAK_ANGLE, far.peak_angle_deg)
                },
                figure(CENTRE_TO_PEAK, far.centre_to_peak),
            ]);
            let between = far.peak_angle_parabola_deg;
            figures.extend(between.map(|e| angle(PARABOLA, e)));
        }
        if self.lit() {
            let map = self.binned_map(design);
            let reader = MapReader::new(design, self.grid, &map);
            let places = reader.places(map.total());
            let of_map = reader.estimates(&map).into_iter();
            figures.extend(of_map.map(|(of, estimate)| Figure {
                extremes: places.and_then(|places| extremes(of, places)),
                ..figure(of, estimate)
            }));
        }
        if design.dome.is_some() {
            let extracted = extraction::extraction(&self.flows);
            figures.push(figure(EXTRACTION, extracted));
        }
        let colours = self.tristimulus.as_ref();
        if let Some(estimate) = colours.and_then(colour_difference::estimate) {
            figures.push(figure(COLOUR_DIFFERENCE, estimate));
        }
        figures
    }

    /// Counters of the trace that a report shows.
    pub fn counters(&self) -> Vec<(String, f64)> {
        vec![("surfaces_per_path".to_owned(), self.surfaces_per_path)]
    }
}

/// The colour difference of these tristimulus values, or none.
fn largest_colour_difference(values: &[f64]) -> Vec<f64> {
    colour_difference::plain(values).into_iter().collect()
}

/// Figures of the totals and without each group.
fn replicates(
    seen: &Grouped,
    figures: &(dyn Fn(&[f64]) -> Vec<f64> + Sync),
) -> Vec<JackknifedFigure> {
    let groups = (0..seen.count()).into_par_iter();
    let rows: Vec<Vec<f64>> = groups.map(|g| figures(&seen.without(g))).collect();
    let all = figures(seen.total()).into_iter().enumerate();
    all.map(|(i, value)| {
        let without = rows.iter().map(|row| row.get(i).copied().unwrap_or(value));
        JackknifedFigure::new(value, without.collect())
    })
    .collect()
}

/// Places where the paper's figure is read.
fn extremes(figure: Definition, places: Places) -> Option<Extremes> {
    let is_papers = PAPERS_MAP.contains(&figure);
    let is_diagonal = figure == UNIFORMITY_DIAGONAL;
    let valley_mm = if is_diagonal { places.diagonal_mm } else { places.straight_mm };
    is_papers.then_some(Extremes { valley_mm, peak_mm: places.peak_mm })
}

/// The curve of `values` at `x` up to `last`.
pub fn curve(label: &str, values: &Grouped, x: &[f64], last: f64) -> Result<Curve> {
    let count = x.iter().take_while(|&&x| x <= last).count();
    Curve::new(
        label,
        x[..count].to_vec(),
        values.total()[..count].to_vec(),
        values.standard_errors()[..count].to_vec(),
    )
}

/// Values of the figures of far field, map and extraction with their keys.
fn by_key<T>(
    far: Vec<T>,
    map: Vec<(&'static str, T)>,
    extracted: Vec<T>,
) -> Vec<(&'static str, T)> {
    let far = FAR_FIELD.iter().map(|figure| figure.key).zip(far);
    far.chain(map).chain([EXTRACTION.key].into_iter().zip(extracted)).collect()
}

/// A map above darkness, or above its own smallest bin.
fn above_zero(map: &[f64], zero: Zero) -> Vec<f64> {
    let least = match zero {
        Zero::Dark => 0.0,
        Zero::Smallest => map.iter().copied().fold(f64::INFINITY, f64::min),
    };
    map.iter().map(|l| l - least).collect()
}

/// All accounts of the tracer's ledger: emitted = escaped + absorbed + lost; the two flows through
/// domes beside them.
fn accounts(outcome: &Outcome) -> Vec<String> {
    let first = &outcome.groups[0].ledger;
    let key = |name: &str| name.replace([' ', ','], "_");
    let mut names: Vec<String> =
        ["emitted", "out_of_domes", "back_into_domes", "escaped_up", "escaped_down"]
            .map(str::to_owned)
            .to_vec();
    let surfaces = surface_names(&first.lines);
    names.extend(surfaces.iter().map(|s| format!("absorbed_by_{}", key(s))));
    names.extend(first.lines.media.iter().map(|m| format!("absorbed_in_{}", key(m))));
    names.extend(Loss::ALL.iter().map(|l| format!("lost_{}", key(l.description()))));
    names
}

/// Names of surfaces, each once: a surface in air in some packages and in a solid in others has two
/// lines in the ledger.
fn surface_names(lines: &Lines) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for name in &lines.surfaces {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names
}

/// Powers of the [`accounts`] by groups.
fn powers(outcome: &Outcome, flows: &Grouped) -> Grouped {
    let share = 1.0 / outcome.groups.len() as f64;
    let names = surface_names(&outcome.groups[0].ledger.lines);
    let powers = outcome.groups.iter().enumerate().map(|(g, group)| {
        let l = &group.ledger;
        let mut powers = flows.group(g).to_vec();
        powers.extend([l.escaped_up * share, l.escaped_down * share]);
        powers.extend(names.iter().map(|name| {
            let lines = l.named_surfaces().filter(|(known, _)| known == name);
            lines.map(|(_, line)| line.absorbed * share).sum::<f64>()
        }));
        powers.extend(l.media.iter().map(|m| m * share));
        powers.extend(l.lost.iter().map(|p| p * share));
        powers
    });
    Grouped::new(powers.collect())
}
