// SPDX-License-Identifier: MIT OR Apache-2.0
//! Observations: receiver sums of a trace, group by group, and the figures of merit that follow
//! from them.

pub mod by_angle;
mod colour_readers;
pub mod colours;
mod known;
mod map_reader;
mod missing;
mod reader;
mod readers;

use std::borrow::Cow;
use std::iter::repeat;

use anyhow::Result;
use rayon::prelude::*;
use tracer::Outcome;
use tracer::ledger::{Lines, Loss};
use tracer::receiver::underscored;

use design::Design;
use metrics::extraction::flow;
use metrics::far_field::{AngularBins, BinPlacement, FarFieldReading};
use metrics::figures::{self, NamedFigure};
use metrics::hits::with_one_path;
use metrics::illuminance::{Grid, coarser, smoothed};
use metrics::layout::Layout;
use metrics::lit::LitBins;
use metrics::quantity::Curve;
use metrics::uniformity::ValleyReading;
use metrics::{Estimate, Grouped, JackknifedFigure};
use results::Figure;
use results::figure_entry::FigureEntry;
use results::ledger::Ledger;
use results::paired_figure::PairedFigure;
use results::schema::STOKES_LOSS;

use self::colours::Colours;
pub use self::known::{check_figure, is_comparable, unit_in_files, unit_of, why_absent};
use self::reader::{Column, Reader};
pub(super) use self::readers::of_one_path;
use self::readers::readers;
pub use super::lit::plane_grid;
use super::{lit, symmetry};

/// Values by the keys of figures.
pub type Keyed<T> = Vec<(Cow<'static, str>, T)>;

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
    /// Lumens of each account of the ledger over 683, of converted light that is counted in lumens. Map,
    /// far field and receivers then hold the same in place of watts.
    pub luminous: Option<Grouped>,
    /// Photons of each account, of converted light, in any unit.
    pub photons: Option<Grouped>,
    /// Names of surfaces and media that leave light unpolarised.
    pub depolarised_by: Vec<String>,
    /// Colours, where several wavelengths were put together.
    pub colours: Option<Colours>,
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

/// Number of bins of the map, the far field and all receivers of `design`.
pub(super) fn bins(design: &Design) -> usize {
    let (grid, sphere) = (plane_grid(design), sphere(design));
    let others = design.receivers.iter().map(|receiver| receiver.detector.bins());
    grid.columns * grid.rows + sphere.polar * sphere.azimuths + others.sum::<usize>()
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
        symmetry: symmetry::symmetry(design),
    }
}

/// Positions of the LEDs of `design`, and which of them are neighbours.
pub fn layout(design: &Design) -> Layout {
    let array = &design.array;
    let axes = array.places_mm();
    match array.rectangle() {
        Some([columns, rows]) => {
            let [x, y] = array.pitch_mm.along();
            let least = if columns == 1 {
                y
            } else if rows == 1 {
                x
            } else {
                x.min(y)
            };
            Layout::rectangular(axes, columns, rows, least)
        }
        None => Layout::of_places(axes),
    }
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
    /// Collects the readings of `outcome`, traced with a far field and a plane as first receivers, those of
    /// the design, and detectors of one bin for the accounts `between_films`.
    pub fn new(design: &Design, between_films: &[String], mut outcome: Outcome) -> Self {
        // The tracer scales every group to the whole power; here the groups add up to it.
        let share = 1.0 / outcome.groups.len() as f64;
        // Readings are moved out of the groups, so that none is in memory twice.
        let count = outcome.total.readings.len();
        outcome.total.readings.clear();
        let mut take = |which: usize| {
            let groups = outcome.groups.par_iter_mut().map(|group| {
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
        let films = receiver::OTHERS + design.receivers.len();
        let receivers = (receiver::OTHERS..films).map(&mut take).collect();
        let passed: Vec<Grouped> = (films..count).map(take).collect();
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
                lit::border(design).as_ref(),
                symmetry::of_maps(design),
                design.receiver.smoothing_sigma_mm,
            ),
            grid,
            far_field,
            sphere: sphere(design),
            accounts: [&accounts(&outcome.groups[0].ledger.lines), between_films].concat(),
            powers: powers(&outcome, &flows, &passed),
            receivers,
            depolarised_by: Vec::new(),
            luminous: None,
            photons: None,
            colours: None,
            flows,
        }
    }

    /// The weighted sum of observations of one design with the same groups. Weights add up to 1, so
    /// that sources still emit 1 W.
    ///
    /// # Panics
    /// Without parts, or with parts of other designs.
    pub fn weighted(parts: &[(f64, &Self)]) -> Self {
        let sum = |of: fn(&Self) -> &Grouped| {
            let parts: Vec<(f64, &Grouped)> = parts.iter().map(|(w, o)| (*w, of(o))).collect();
            Grouped::weighted(&parts)
        };
        let first = parts[0].1;
        let receivers = (0..first.receivers.len()).map(|number| {
            let parts = parts.iter().map(|(w, o)| (*w, &o.receivers[number]));
            Grouped::weighted(&parts.collect::<Vec<_>>())
        });
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
            receivers: receivers.collect(),
            depolarised_by: first.depolarised_by.clone(),
            // They are told of whole sums alone.
            luminous: None,
            photons: None,
            colours: None,
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

    /// The power ledger, as it was counted.
    pub fn ledger(&self) -> Ledger {
        Ledger::new(&self.accounts, &self.powers, flow::EMITTED)
    }

    /// The ledger of the photons of converted light, as shares of those emitted.
    pub fn photon_ledger(&self) -> Option<Ledger> {
        let mut ledger = Ledger::new(&self.accounts, self.photons.as_ref()?, flow::EMITTED);
        // Energy that photons lack is none of them.
        ledger.accounts.retain(|(name, _)| !name.ends_with(STOKES_LOSS));
        Some(ledger)
    }

    /// Mean power of a path, W.
    pub fn path_power(&self) -> f64 {
        self.powers.total()[flow::EMITTED] / self.paths as f64
    }

    /// Changes of the figures that are `wanted` from `coarse` to this observation, by key. Both were
    /// made of the same groups of paths. The peak of the illuminance counts as the largest bin.
    pub fn changes(
        &self,
        coarse: &Self,
        design: &Design,
        wanted: impl Fn(&str) -> bool,
    ) -> Keyed<Estimate> {
        let all = self.keyed(design, wanted, |reader| {
            let [from, to] = [reader.sums(coarse)?, reader.sums(self)?];
            let [from, to] = [&*from, &*to].map(|sums| reader.replicates(sums));
            let change = |(from, to): (&JackknifedFigure, &JackknifedFigure)| {
                let pairs = to.without.iter().zip(&from.without);
                let without = pairs.map(|(to, from)| to - from);
                JackknifedFigure::new(to.value - from.value, without.collect())
            };
            Some(from.iter().zip(&to).map(change).collect())
        });
        all.into_iter().map(|(key, change)| (key, change.estimate())).collect()
    }

    /// The figures that are `wanted`, read alike from all paths and without each group: key, value,
    /// replicates. The peak of the illuminance counts as the largest bin.
    pub fn replicated(
        &self,
        design: &Design,
        wanted: impl Fn(&str) -> bool,
    ) -> Keyed<JackknifedFigure> {
        self.keyed(design, wanted, |reader| {
            let mut all = reader.replicates(&*reader.sums(self)?);
            for (figure, power) in all.iter_mut().zip(reader.one_path(self.path_power())) {
                figure.standard_error = with_one_path(figure.estimate(), power).standard_error;
            }
            Some(all)
        })
    }

    /// The figures that are `wanted` as [`Observation::estimates`] reads them, with the replicates of
    /// [`Observation::replicated`] for paired changes.
    pub fn estimated_replicates(
        &self,
        design: &Design,
        wanted: impl Fn(&str) -> bool,
    ) -> Vec<(String, PairedFigure)> {
        let read = self.replicated(design, &wanted);
        let figures = self.estimates(design, wanted).into_iter().filter_map(|f| {
            let (_, found) = read.iter().find(|(key, _)| *key == f.key)?;
            let figure = PairedFigure { entry: f.entry, without: found.without.clone() };
            Some((f.key.into_owned(), figure))
        });
        figures.collect()
    }

    /// The figures of `results.json`, in the order in which they are shown.
    pub fn figures(&self, design: &Design) -> Vec<Figure> {
        let is_main = |key: &str| figures::find(key).is_some_and(|figure| figure.is_main());
        self.estimates(design, is_main)
    }

    /// The figures that are `wanted`, with their errors and states.
    pub fn estimates(&self, design: &Design, wanted: impl Fn(&str) -> bool) -> Vec<Figure> {
        let readers = readers(self, design, &wanted);
        let read = readers.par_iter().filter_map(|reader| {
            let entries = reader.entries(&*reader.sums(self)?);
            Some((reader, entries, reader.one_path(self.path_power())))
        });
        let read: Vec<_> = read.collect();
        let mut all = Vec::new();
        for (reader, entries, one_path) in read {
            let entries = entries.into_iter().zip(one_path.into_iter().chain(repeat(0.0)));
            for (Column { figure, factor }, (entry, power)) in
                reader.columns().into_iter().zip(entries)
            {
                let entry = match power {
                    0.0 => entry,
                    power => FigureEntry::new(with_one_path(entry.estimate(), power)),
                };
                let is_known = entry.value.is_finite() && entry.standard_error.is_finite();
                if is_known && wanted(&figure.key) {
                    let NamedFigure { key, label, definition } = figure;
                    all.push(Figure {
                        key,
                        label,
                        unit: definition.unit,
                        entry: entry.in_range(definition.unit).times(factor),
                    });
                }
            }
        }
        all
    }

    /// The figures that are `wanted`, by what `read` makes of each reader.
    fn keyed(
        &self,
        design: &Design,
        wanted: impl Fn(&str) -> bool,
        read: impl Fn(&dyn Reader) -> Option<Vec<JackknifedFigure>>,
    ) -> Keyed<JackknifedFigure> {
        let mut all = Vec::new();
        for reader in readers(self, design, &wanted) {
            let values = read(&*reader).unwrap_or_default();
            for (Column { figure, factor }, mut value) in reader.columns().into_iter().zip(values) {
                let is_known = value.value.is_finite() && value.standard_error.is_finite();
                if is_known && wanted(&figure.key) {
                    let numbers = [&mut value.value, &mut value.standard_error];
                    numbers.into_iter().chain(&mut value.without).for_each(|x| *x *= factor);
                    all.push((figure.key, value));
                }
            }
        }
        all
    }

    /// Whether any light went up through the map.
    pub fn lit(&self) -> bool {
        self.illuminance.total().iter().any(|value| *value > 0.0)
    }

    /// The map in bins of so many recorded ones along an edge, of whose bins these parts are lit.
    fn binned_map(&self, together: usize, lit: Option<&LitBins>) -> Cow<'_, Grouped> {
        match together {
            1 => Cow::Borrowed(&self.illuminance),
            _ => Cow::Owned(self.illuminance.map(|map| binned(map, self.grid, together, lit))),
        }
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

    /// Counters of the trace that a report shows.
    pub fn counters(&self) -> Vec<(String, f64)> {
        vec![("surfaces_per_path".to_owned(), self.surfaces_per_path)]
    }
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

/// A map in bins of so many recorded ones along an edge.
fn binned(map: &[f64], grid: Grid, together: usize, lit: Option<&LitBins>) -> Vec<f64> {
    match lit {
        Some(lit) => lit.coarser_map(map, grid, together),
        None => coarser(map, grid, together).0,
    }
}

/// Endings of the accounts of a luminophore: photons that it does not emit again, and energy that
/// emitted photons lack.
const CONVERSION_LOSSES: [&str; 2] = ["quantum_loss", STOKES_LOSS];

/// All accounts of the tracer's ledger: emitted = escaped + absorbed + lost; the two flows through
/// domes beside them.
fn accounts(lines: &Lines) -> Vec<String> {
    let key = |begin: &str, name: &str| format!("{begin}_{}", underscored(name));
    let mut names: Vec<String> =
        ["emitted", "out_of_domes", "back_into_domes", "escaped_up", "escaped_down"]
            .map(str::to_owned)
            .to_vec();
    names.extend(surface_names(lines).iter().map(|s| key("absorbed_by", s)));
    names.extend(lines.media.iter().map(|m| key("absorbed_in", m)));
    let losses = lines.luminophores.iter().map(|name| key("absorbed_in", name));
    names.extend(losses.flat_map(|key| CONVERSION_LOSSES.map(|loss| format!("{key}_{loss}"))));
    names.extend(Loss::ALL.iter().map(|l| key("lost", l.description())));
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

/// Powers of the [`accounts`] and through the planes between films, by groups.
fn powers(outcome: &Outcome, flows: &Grouped, passed: &[Grouped]) -> Grouped {
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
        let losses = l.luminophores.iter().flat_map(|of| [of.quantum_loss, of.stokes_loss]);
        powers.extend(losses.map(|loss| loss * share));
        powers.extend(l.lost.iter().map(|p| p * share));
        powers.extend(passed.iter().map(|passed| passed.group(g)[0]));
        powers
    });
    Grouped::new(powers.collect())
}
