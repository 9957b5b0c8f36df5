// SPDX-License-Identifier: MIT OR Apache-2.0
//! The Monte Carlo run of one model of one design: a scene is traced, its receivers are read.

use std::ops::Range;

use anyhow::Result;
use serde_json::{Value, json};
use tracer::{CheckpointStore, Control, FarField, PlaneMap, Receiver, Settings, TabulatedFilms};

use design::Design;
use design::resolved::medium::Medium;
use design::resolved::trace_key::ReliefModel;
use metrics::digits::significant;
use metrics::extraction::flow;
use runtime::interrupt::Interrupted;
use runtime::key::Key;
use runtime::progress::is_news;
use runtime::run_context::RunContext;
use runtime::store::{Entries, Store};

use super::film_parts::FilmParts;
use super::film_planes::FilmPlanes;
use super::film_table::{BUILT_IN, FilmTreatment, treatment};
use super::observation::{Observation, plane_grid};
use super::scene::{self, DomeSurface};
use super::scenes::{self, Scenes};
pub use super::scenes::{GROUPS, converted_fits};

/// Folder of the cache with the tables of films.
const FILMS: &str = "films";
/// Bytes of all of them, beyond which the oldest go.
const MAX_FILM_BYTES: u64 = 4 << 30;
/// Account of the paths that met too many surfaces.
const TOO_MANY: &str = "lost_too_many_bounces";
/// Share of the power that may be given up without a word.
const NEGLIGIBLE: f64 = 1e-5;

/// One trace, beside its seed.
#[derive(Clone, Copy)]
pub(super) struct TraceJob<'a> {
    pub design: &'a Design,
    pub surface: &'a DomeSurface,
    pub paths: u64,
    /// Shown beside the progress and in warnings.
    pub what: &'a str,
    /// Groups that errors are told from; they divide [`GROUPS`].
    pub error_groups: usize,
    /// True for cells of twice the width in the table of films.
    pub widened: bool,
}

impl<'a> TraceJob<'a> {
    /// A trace of the own number of paths of `design`.
    pub fn new(design: &'a Design, surface: &'a DomeSurface, what: &'a str) -> Self {
        let (paths, error_groups) = (design.trace.paths, GROUPS);
        Self { design, surface, paths, what, error_groups, widened: false }
    }
}

/// Traces `paths` paths of `design` with `surface` on its domes; `what` is shown beside the
/// progress.
///
/// # Errors
/// A scene that cannot be built, those of the tracer; an interrupt.
pub fn observe(
    design: &Design,
    surface: &DomeSurface,
    paths: u64,
    what: &str,
    context: RunContext,
) -> Result<Observation> {
    TraceJob { paths, ..TraceJob::new(design, surface, what) }.observe(context)
}

impl TraceJob<'_> {
    /// Builds the scene, traces it and reads its receivers; warns of power given up.
    pub fn observe(&self, context: RunContext) -> Result<Observation> {
        Ok(scenes::put_together(self.design, self.observe_channels(context)?))
    }

    /// The same with cells of twice the width in the table of films, and a quarter of the paths.
    pub fn observe_widened(&self, context: RunContext) -> Result<Observation> {
        let what = format!("{}, wide cells of the table of films", self.what);
        let paths = self.paths.div_ceil(4);
        TraceJob { widened: true, what: &what, paths, ..*self }.observe(context)
    }

    /// The same before [`scenes::put_together`].
    pub fn observe_channels(&self, context: RunContext) -> Result<Vec<Observation>> {
        let bar = context.console.progress(self.paths, self.what);
        let observed = self.trace(&|done| bar.inc(done), context);
        bar.finish_and_clear();
        let observations = observed?;
        for (account, share) in given_up(&observations[0]) {
            let file = &self.design.provenance.file;
            // Traces of searches and studies have no name of their own, and are many.
            let is_one_of_many = self.what.is_empty();
            let kind = kind_of(&self.design.name);
            if !context.console.warns
                || is_one_of_many && !is_news(&format!("{file}, {kind}, {account}"), share)
            {
                continue;
            }
            let (of, rule) = if is_one_of_many {
                (&*self.design.name, "; said again where it is twice as much")
            } else {
                (self.what, "")
            };
            let how = account.trim_start_matches("lost_").replace('_', " ");
            let cure = if account == TOO_MANY { cure(self.design) } else { String::new() };
            context.console.warn(&format!(
                "{file}, {of}: {} % of the power is lost ({how}), and no figure holds it{cure}{rule}",
                significant(100.0 * share)
            ));
        }
        Ok(observations)
    }

    fn trace(
        &self,
        progress: &(dyn Fn(u64) + Sync),
        context: RunContext,
    ) -> Result<Vec<Observation>> {
        let (scenes, planes, outcomes) = self.prepared(progress, context, Scenes::run)?;
        context.interrupt.check()?;
        context.checkpoints.map_or(Ok(()), Store::take_error)?;
        let outcomes = uninterrupted(outcomes)?.into_iter();
        let outcomes = outcomes.map(|outcome| outcome.merged(self.error_groups)).collect();
        Ok(scenes.observations(self.design, &planes, outcomes))
    }

    /// Traces the groups `wanted` for the checkpoints of `context` alone.
    ///
    /// # Errors
    /// A scene that cannot be built, those of the tracer; a group that cannot be kept; an interrupt.
    pub fn keep_groups(&self, wanted: Range<u64>, context: RunContext) -> Result<()> {
        let count = wanted.end - wanted.start;
        let bar = context.console.progress(count * self.paths.div_ceil(GROUPS as u64), self.what);
        let progress = |done| bar.inc(done);
        let (.., done) =
            self.prepared(&progress, context, |scenes, receivers, settings, control| {
                scenes.run_groups(receivers, settings, control, wanted)
            })?;
        bar.finish_and_clear();
        context.interrupt.check()?;
        uninterrupted(done)?;
        context.checkpoints.map_or(Ok(()), Store::take_error)
    }

    /// Builds scenes, planes between films and the table of films, and hands them to `run`.
    fn prepared<T>(
        &self,
        progress: &(dyn Fn(u64) + Sync),
        context: RunContext,
        run: impl FnOnce(&Scenes, &[&dyn Receiver], &Settings, Control<'_>) -> T,
    ) -> Result<(Scenes, FilmPlanes, T)> {
        let design = self.design;
        let scenes = Scenes::new(design, self.surface)?;
        context.interrupt.check()?;
        let planes = FilmPlanes::new(design, scenes.first())?;
        let groups = self.groups(context);
        let lasting;
        let (mut table, mut parts) = (None, None);
        if let FilmTreatment::Table(stack) = treatment(design) {
            let designs = scenes.designs(design)?;
            // After the far field, the plane and the receivers of the design.
            let numbers = BUILT_IN + design.receivers.len()..;
            let levels =
                numbers.zip(&planes.levels_mm).map(|(number, (z, way))| (number, *z, *way));
            table = Some(stack.table(&designs, &levels.collect::<Vec<_>>())?);
            let key = Key::of(&stack.key_fields(&designs, context.seed)?);
            let cache = context.checkpoints;
            lasting = cache.map(|store| store.lasting_beside(FILMS, MAX_FILM_BYTES));
            let cache = lasting.as_ref().map(|store| store.entries(key.clone()));
            parts = Some(FilmParts::new(key, cache));
        }
        let films = table.as_ref().map(|table| TabulatedFilms {
            table,
            parts: parts.as_ref().map(|parts| parts as &dyn CheckpointStore),
            widened: self.widened,
        });
        let done = self.with_receivers(&planes, |receivers| {
            let settings = self.settings(context.seed);
            let control = control(progress, groups.as_ref(), context);
            run(&scenes, receivers, &settings, Control { films, ..control })
        })?;
        Ok((scenes, planes, done))
    }

    /// Hands far field, plane, the design's own receivers and `planes` between films to `trace`.
    fn with_receivers<T>(
        &self,
        planes: &FilmPlanes,
        trace: impl FnOnce(&[&dyn Receiver]) -> T,
    ) -> Result<T> {
        let design = self.design;
        let plane = plane(design)?;
        let far = FarField::new(design.far_field.bin_deg, design.far_field.azimuth_bin_deg)?;
        let between_films = planes.detectors.iter().map(|detector| detector as &dyn Receiver);
        let detectors = design.receivers.iter().map(|receiver| &receiver.detector as &dyn Receiver);
        let built_in: [&dyn Receiver; BUILT_IN] = [&far, &plane];
        let receivers: Vec<_> =
            built_in.into_iter().chain(detectors).chain(between_films).collect();
        Ok(trace(&receivers))
    }

    fn settings(&self, seed: u64) -> Settings {
        Settings { groups: GROUPS, ..scene::settings(self.design, self.paths, seed) }
    }

    /// Store of finished groups, if they are kept.
    fn groups<'c>(&self, context: RunContext<'c>) -> Option<Groups<'c>> {
        let checkpoints = context.checkpoints.filter(|all| all.keeps(self.paths))?;
        Some(Groups(checkpoints.entries(Key::of(&self.key_fields(context.seed)))))
    }

    /// All that the groups of this trace depend on, beside the program. Tables follow from the
    /// design and the model, which `what` names.
    pub fn key_fields(&self, seed: u64) -> Value {
        let (kind, open) = match self.surface {
            DomeSurface::Refracting(_) => ("refracting", None),
            DomeSurface::Only(_, open) => ("only", Some(*open)),
            DomeSurface::Banded(..) | DomeSurface::ByWavelength(_, 0) => ("banded", None),
            DomeSurface::ByWavelength(..) => ("banded, second nearest wavelength", None),
        };
        json!({
            "what": self.what,
            "design": self.design.trace_fields(ReliefModel::OrderTables),
            "surface": {"kind": kind, "open": open, "meridian": self.surface.meridian()},
            "paths": self.paths,
            "seed": seed,
            "widened": self.widened,
        })
    }
}

/// Groups of paths of one trace in a store.
struct Groups<'a>(Entries<'a>);

impl CheckpointStore for Groups<'_> {
    fn find(&self, group: u64) -> Option<Vec<u8>> {
        self.0.find(group)
    }

    fn keep(&self, group: u64, bytes: &[u8]) {
        self.0.keep(group, bytes);
    }
}

fn control<'a>(
    progress: &'a (dyn Fn(u64) + Sync),
    groups: Option<&'a Groups<'_>>,
    context: RunContext<'a>,
) -> Control<'a> {
    Control {
        progress: Some(progress),
        cancel: Some(context.interrupt.flag()),
        checkpoints: groups.map(|groups| groups as &dyn CheckpointStore),
        films: None,
    }
}

fn uninterrupted<T>(done: Result<T, tracer::Error>) -> Result<T> {
    match done {
        Err(tracer::Error::Cancelled) => Err(Interrupted.into()),
        other => Ok(other?),
    }
}

/// What numbered traces share in their name: `candidate 3 (height = 2)` has that of all candidates.
fn kind_of(name: &str) -> String {
    let name = name.split_once(" (").map_or(name, |(name, _)| name);
    name.chars().filter(|c| !c.is_ascii_digit()).collect()
}

/// Accounts of power given up that hold more than [`NEGLIGIBLE`] of what was emitted, and their
/// share of it.
fn given_up(seen: &Observation) -> Vec<(&str, f64)> {
    let totals = seen.powers.total();
    let emitted = totals[flow::EMITTED];
    let shares = seen.accounts.iter().zip(totals);
    shares
        .filter(|(account, _)| account.starts_with("lost_"))
        .map(|(account, power)| (account.as_str(), power / emitted))
        .filter(|(_, share)| *share > NEGLIGIBLE)
        .collect()
}

/// What ends paths that meet too many surfaces, of a design with clear bodies that convert light:
/// beyond the critical angle it is reflected from one clear face to the next.
fn cure(design: &Design) -> String {
    let films = design.solids.iter().filter(|solid| solid.stated_faces == [None, None]);
    let named = films.filter_map(|solid| {
        Some((format!("{} {:?}", solid.table, solid.name()), solid.medium.as_ref()?))
    });
    let media = [("silicone".to_owned(), &design.silicone)].into_iter().chain(named);
    let holds = |of: &Medium| {
        let reflects_all = of.index > 1.0 + 1e-9;
        let is_clear = of.absorption_per_mm <= 0.0 && of.scattering.is_none();
        !of.luminophores.is_empty() && is_clear && reflects_all
    };
    let names: Vec<String> = media.filter(|(_, of)| holds(of)).map(|(name, _)| name).collect();
    if names.is_empty() {
        return String::new();
    }
    format!(
        ": light that {} converts stays between clear faces by total reflection; scattering_per_mm \
         or absorption_per_mm of the medium, or a face that scatters, lets it out or ends it",
        names.join(" and ")
    )
}

/// The plane on which uniformity is judged.
///
/// # Errors
/// More bins than a plane may have.
pub(super) fn plane(design: &Design) -> Result<PlaneMap, tracer::Error> {
    let grid = plane_grid(design);
    PlaneMap::centred(design.receiver.plane_height_mm, grid.bin_mm, grid.columns, grid.rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::borrow::Cow;

    use design::resolved::array::PackagePositions;
    use design::schema::{Pitch, Sampling};
    use metrics::far_field::{BinPlacement, PeakMethod};
    use runtime::interrupt::Interrupt;

    use crate::dome_surface::dome_surface;
    use crate::model::Model;

    fn seen(change: impl Fn(&mut Design)) -> Observation {
        let mut design = design::embedded("d1.toml").expect("valid");
        change(&mut design);
        let interrupt = Interrupt::default();
        let context = RunContext::quiet(&interrupt, 3);
        let surface = dome_surface(&design, Model::Geometric, None).expect("a dome");
        observe(&design, &surface, 160_000, "", context).expect("a trace")
    }

    #[test]
    fn a_package_alone_does_not_care_about_crossing() {
        let alone = |crossing: bool| {
            seen(|d| {
                d.array.positions = PackagePositions::SINGLE;
                d.array.crossing = crossing;
            })
        };
        assert_eq!(alone(true).far_field, alone(false).far_field);
    }

    #[test]
    fn what_is_given_up_is_named_with_its_share() {
        let short = seen(|d| d.trace.max_interactions = 3);
        let found = given_up(&short);
        let [(account, share)] = found[..] else { panic!("{found:?}") };
        assert!(account.contains("bounces"), "{account}");
        let ledger = short.ledger();
        let booked = ledger.accounts.iter().find(|(name, _)| name == account);
        assert!(share > 0.01 && (share - booked.expect("an account").1.value).abs() < 1e-12);
        assert_eq!(given_up(&seen(|_| {})), []);
    }

    #[test]
    fn sobol_points_find_the_same() {
        let figures = |change: &dyn Fn(&mut Design)| {
            let changed = |d: &mut Design| {
                change(d);
                (d.receiver.bin_mm, d.receiver.read_bin_mm) = (0.5, None);
                let far = &mut d.far_field;
                (far.read_bin_deg, far.centre_deg, far.peak_fit_deg) = (Some(5.0), 5.0, 10.0);
                (far.read_bins, far.peak) = (BinPlacement::Between, PeakMethod::Parabola);
                d.trace.paths = 160_000;
            };
            let seen = seen(changed);
            let mut design = design::embedded("d1.toml").expect("valid");
            changed(&mut design);
            let figures = seen.figures(&design).into_iter();
            figures.map(|f| (f.key, f.entry.estimate())).collect::<Vec<_>>()
        };
        let at_random = |d: &mut Design| d.trace.sampling = Sampling::Random;
        let plain = figures(&at_random);
        let net = figures(&|d| d.trace.sampling = Sampling::Sobol);
        for key in ["centre_to_peak", "extraction_efficiency", "peak_angle_deg"] {
            let of = |figures: &[(Cow<str>, metrics::Estimate)]| {
                let found = figures.iter().find(|(name, _)| *name == key);
                found.expect("a figure").1
            };
            let (a, b) = (of(&plain), of(&net));
            let error = a.standard_error.hypot(b.standard_error);
            let difference = (a.value - b.value).abs();
            // Neither the same draws nor another result.
            assert!(difference > 0.0 && difference < 4.5 * error, "{key}: {a:?} {b:?}");
        }
        let error = |figures: &[(Cow<str>, metrics::Estimate)]| figures[1].1.scatter();
        assert!(plain[1].0 == "centre_to_peak" && error(&net) < 0.6 * error(&plain));
    }

    #[test]
    fn without_crossing_every_package_is_one_that_stands_alone() {
        // On the mirror of all of them: the mean of single packages at the four places is what all
        // together send out.
        let change = |d: &mut Design| {
            d.array.pitch_mm = Pitch::Same(3.5);
            d.array.crossing = false;
            (d.receiver.bin_mm, d.receiver.read_bin_mm) = (0.5, None);
        };
        let apart = seen(change);
        let single = seen(|d| {
            change(d);
            d.array.positions = PackagePositions::SINGLE;
        });
        // What leaves the dome does not see the mirror's edge.
        let out = |o: &Observation| metrics::jackknife(&o.flows, |p| p[flow::OUTWARD]);
        let (a, b) = (out(&apart), out(&single));
        let error = a.standard_error.hypot(b.standard_error);
        assert!((a.value - b.value).abs() < 4.5 * error, "{a:?} {b:?}");
        assert_eq!(apart.paths, single.paths);
    }

    #[test]
    fn without_crossing_nothing_comes_back_into_domes_from_others() {
        let back = |crossing: bool| {
            let seen = seen(|d| {
                d.array.pitch_mm = Pitch::Same(3.5);
                d.array.crossing = crossing;
            });
            let inward = metrics::extraction::flow::INWARD;
            let flow = metrics::jackknife(&seen.flows, |p| p[inward]);
            let total: f64 = seen.far_field.total().iter().sum();
            assert!(total > 0.8 && total < 1.0, "{total}");
            flow
        };
        let (with, without) = (back(true), back(false));
        let error = with.standard_error.hypot(without.standard_error);
        // Nearly touching, a package sends a good part of its light into the others.
        assert!(with.value - without.value > 5.0 * error, "{with:?} {without:?}");
    }
}
