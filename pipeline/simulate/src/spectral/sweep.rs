// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces at the wavelengths of all lights, and their weighted sum.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use arrays::cache::Cache;
use design::Design;
use design::resolved::PATHS;
use design::resolved::medium::Medium;
use design::resolved::scattering::MediumScattering;
use design::resolved::solids::CheckedSolid;
use design::schema::Zero;
use design::spectrum::lights::{Colour, Lights};
use design::spectrum::quadrature::COUNTS;
use metrics::plural;
use results::schema::{TableEntry, UntilError, WavelengthEntry};
use runtime::run_context::RunContext;

use super::rule::{Node, Rule, medians, smallest_rule};
use crate::dome_surface::dome_surface;
use crate::model::Model;
use crate::observation::colours::{ColourArrays, Colours};
use crate::observation::{Observation, bins, is_one, plane_grid};
use crate::paths_3d::WavelengthScene;
use crate::scene::DomeSurface;
use crate::seeds;
use crate::stopping_rule::{Batches, StoppingRule};
use crate::tables::tables;
use crate::trace::{GROUPS, TraceJob};
use crate::trace_plan::{DomeChoice, TracePlan};

/// Memory of all observations together, bytes.
const MAX_BYTES: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;
/// Most wavelengths with tables of orders, for sources of several lights.
const MAX_WAVELENGTHS_WITH_TABLES: usize = 64;

/// A model of a design in the light of several wavelengths.
#[derive(Clone, Copy)]
pub struct SpectralJob<'a> {
    /// The design.
    pub design: &'a Design,
    /// Lights of its sources.
    pub lights: &'a Lights,
    /// Treatment of the relief.
    pub model: Model,
    /// Cache of tables.
    pub cache: Option<&'a Cache>,
    /// The run's context.
    pub context: RunContext<'a>,
}

/// Dome surface and tables of one wavelength, shared by all lights.
struct Prepared {
    surface: DomeSurface,
    tables: Vec<TableEntry>,
}

/// One wavelength of one light.
struct Traced {
    design: Design,
    /// Observation; moved out while batches are added to it.
    observation: Option<Observation>,
    prepared: Arc<Prepared>,
    /// Paths asked for.
    paths: u64,
}

impl Traced {
    fn job<'a>(&'a self, what: &'a str) -> TraceJob<'a> {
        let job = TraceJob::new(&self.design, &self.prepared.surface, what);
        TraceJob { paths: self.paths, ..job }
    }
}

/// A light, the bits of its wavelength in nm (positive numbers keep their order), and the number of
/// wavelengths that share the rays of a file.
type NodeKey = (usize, u64, usize);

/// The wavelengths computed so far.
pub(super) struct Sweep<'a> {
    pub(super) job: SpectralJob<'a>,
    seen: BTreeMap<NodeKey, Traced>,
    /// By the bits of the wavelength.
    prepared: BTreeMap<u64, Arc<Prepared>>,
}

impl<'a> Sweep<'a> {
    /// Without any wavelength yet.
    pub(super) fn new(job: SpectralJob<'a>) -> Self {
        Self { job, seen: BTreeMap::new(), prepared: BTreeMap::new() }
    }

    /// True if anything depends on the wavelength: tables and thin films always do, rays if the
    /// silicone or a solid is of a medium that changes over the wavelengths of the lights.
    pub(super) fn disperses(&self) -> Result<bool> {
        let coated = self.job.design.solids.iter().any(CheckedSolid::is_coated);
        if self.job.model == Model::Hybrid || self.job.design.films.is_some() || coated {
            return Ok(true);
        }
        let here = media(self.job.design);
        for light in &self.job.lights.lights {
            for (nm, _) in light.light.rule(COUNTS[COUNTS.len() - 1]) {
                if media(&self.job.design.at(nm)?) != here {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Refuses more wavelengths than memory or tables allow; `compared` if the sum is compared with
    /// a coarser one.
    pub(super) fn fits(&self, rule: &Rule, compared: bool) -> Result<()> {
        let file = &self.job.design.provenance.file;
        let count = rule.len();
        let (grid, bins) = (plane_grid(self.job.design), bins(self.job.design));
        let map = grid.columns * grid.rows;
        let read = self.job.design.receiver.read_together();
        let zero = self.job.design.receiver.zero;
        // Copies of the map that uniformity is read from.
        let judged = match (read, zero) {
            (1, Zero::Dark) => 0,
            (1, Zero::Smallest) => map,
            (_, Zero::Dark) => map / (read * read),
            (_, Zero::Smallest) => 2 * map / (read * read),
        };
        let sum = if alone(rule) { 0 } else { bins };
        // The coarser sum, and rays of files as fewer wavelengths shared them.
        let beside = if compared {
            let shared = rule.iter().filter(|node| self.key(node).2 != 0).count();
            bins * (shared / 2 + 1) + judged
        } else {
            0
        };
        let colours = if count > 1 { ColourArrays::count(self.job.design, GROUPS) } else { 0 };
        let doubles = (bins * count + sum + judged + beside) * (GROUPS + 1) + colours;
        let bytes = 8.0 * doubles as f64;
        ensure!(
            bytes <= MAX_BYTES,
            "{file}: {bins} bins at {}: expected at most 2 GiB for them, got {:.1} GiB; larger bins or fewer wavelengths take less",
            plural::count(count, "wavelength"),
            bytes / MAX_BYTES * 2.0
        );
        if self.job.model == Model::Hybrid && self.job.lights.apart {
            let mut all: Vec<u64> = rule.iter().map(|node| node.nm.to_bits()).collect();
            all.sort_unstable();
            all.dedup();
            ensure!(
                all.len() <= MAX_WAVELENGTHS_WITH_TABLES,
                "{file}: [[sources]] at {} wavelengths: expected at most {MAX_WAVELENGTHS_WITH_TABLES} in the hybrid, whose tables are solved at each; fewer lines or `samples` take fewer",
                all.len()
            );
        }
        Ok(())
    }

    /// Computes the wavelengths of `rule` that are missing.
    pub(super) fn cover(&mut self, rule: &Rule) -> Result<()> {
        for node in rule {
            let key = self.key(node);
            if self.seen.contains_key(&key) {
                continue;
            }
            self.job.context.interrupt.check()?;
            let traced = self
                .trace(rule, node)
                .with_context(|| format!("{} at {} nm", self.job.design.name, node.nm))?;
            self.seen.insert(key, traced);
        }
        Ok(())
    }

    /// The traces of `rules`, each node once.
    pub(super) fn plans(&self, rules: &[Rule]) -> Result<Vec<TracePlan>> {
        let mut nodes: BTreeMap<NodeKey, (&Rule, &Node)> = BTreeMap::new();
        for (rule, node) in rules.iter().flat_map(|rule| rule.iter().map(move |n| (rule, n))) {
            nodes.entry(self.key(node)).or_insert((rule, node));
        }
        let nodes = nodes.into_values();
        nodes.map(|(rule, node)| self.plan(rule, node)).collect()
    }

    /// Drops rays of files that were shared by fewer wavelengths than `rule` has.
    pub(super) fn forget(&mut self, rule: &Rule) {
        let kept: Vec<NodeKey> = rule.iter().map(|node| self.key(node)).collect();
        self.seen.retain(|key, _| key.2 == 0 || kept.contains(key));
    }

    fn key(&self, node: &Node) -> NodeKey {
        let shared = match self.job.lights.lights[node.light].light {
            Colour::Spectrum(_) => 0,
            Colour::Rays(_) => node.of,
        };
        (node.light, node.nm.to_bits(), shared)
    }

    /// The trace of a node that is missing.
    pub(super) fn plan(&self, rule: &Rule, node: &Node) -> Result<TracePlan> {
        let (design, paths) = self.at_wavelength(rule, node)?;
        let plan = TracePlan {
            what: self.what(&design, node),
            dome: DomeChoice::Model(self.job.model),
            design,
            paths,
            seed: self.seed(node, rule.len() == 1, self.job.context.seed),
        };
        Ok(plan)
    }

    /// The design at a node alone, and the number of its paths.
    fn at_wavelength(&self, rule: &Rule, node: &Node) -> Result<(Design, u64)> {
        let design = if self.job.lights.apart {
            let of_light = rule.iter().filter(|other| other.light == node.light);
            let nodes: Vec<f64> = of_light.map(|other| other.nm).collect();
            let place = nodes.iter().position(|nm| *nm >= node.nm);
            let light = &self.job.lights.lights[node.light];
            let place = place.context("expected a wavelength of the light")?;
            self.job.design.lit_by(light, &nodes, place)?
        } else {
            self.job.design.at(node.nm)?
        };
        let paths = (node.weight * design.trace.paths as f64).ceil() as u64;
        let paths = paths.clamp(*PATHS.start(), design.trace.paths);
        Ok((design, paths))
    }

    fn trace(&mut self, rule: &Rule, node: &Node) -> Result<Traced> {
        let (design, paths) = self.at_wavelength(rule, node)?;
        let bits = node.nm.to_bits();
        if !self.prepared.contains_key(&bits) {
            let tables = match self.job.model {
                Model::Hybrid => {
                    Some(tables(&[&design], self.job.cache, None, self.job.context)?.remove(0))
                }
                _ => None,
            };
            let surface = dome_surface(&design, self.job.model, tables.as_ref())?;
            let tables = tables.map_or_else(Vec::new, |t| t.describe());
            self.prepared.insert(bits, Arc::new(Prepared { surface, tables }));
        }
        let prepared = Arc::clone(&self.prepared[&bits]);
        let alone = rule.len() == 1;
        let mut traced = Traced { design, observation: None, prepared, paths };
        traced.observation = Some(self.observe(&traced, node, alone, self.job.context)?);
        Ok(traced)
    }

    /// Share of the flux, design and dome of a node.
    pub(super) fn surface(&self, node: &Node) -> WavelengthScene<'_> {
        let traced = self.at(node);
        WavelengthScene {
            design: &traced.design,
            surface: &traced.prepared.surface,
            share: node.weight,
        }
    }

    /// Traces one wavelength, with random numbers of its own unless there is no other.
    fn observe(
        &self,
        traced: &Traced,
        node: &Node,
        alone: bool,
        context: RunContext,
    ) -> Result<Observation> {
        let seed = self.seed(node, alone, context.seed);
        let what = self.what(&traced.design, node);
        traced.job(&what).observe(RunContext { seed, ..context })
    }

    /// The wavelengths of `rule` traced once more, with cells of the table of films `widened` or not.
    pub(super) fn once_more(
        &self,
        rule: &Rule,
        widened: bool,
        context: RunContext,
    ) -> Result<Self> {
        let mut seen = BTreeMap::new();
        for node in rule {
            let Traced { design, prepared, paths, .. } = self.at(node);
            let (design, prepared) = (design.clone(), Arc::clone(prepared));
            let mut traced = Traced { design, observation: None, prepared, paths: *paths };
            let what = self.what(&traced.design, node);
            let seed = self.seed(node, rule.len() == 1, context.seed);
            let (job, context) = (traced.job(&what), RunContext { seed, ..context });
            let seen_now =
                if widened { job.observe_widened(context) } else { job.observe(context) };
            traced.observation = Some(seen_now?);
            seen.insert(self.key(node), traced);
        }
        Ok(Self { job: self.job, seen, prepared: BTreeMap::new() })
    }

    fn seed(&self, node: &Node, alone: bool, seed: u64) -> u64 {
        let first = self.job.lights.lights[node.light].sources.first();
        match (alone, first) {
            (true, _) => seed,
            (false, None) => seeds::of_wavelength(seed, node.nm),
            (false, Some(source)) => seeds::of_light(seeds::of_wavelength(seed, node.nm), source),
        }
    }

    fn what(&self, design: &Design, node: &Node) -> String {
        let (name, model) = (&design.name, self.job.model.key(design));
        match self.job.lights.lights[node.light].sources.first() {
            None => format!("{name} {model} {:.0} nm", node.nm),
            Some(source) => format!("{name} {model} {source} {:.0} nm", node.nm),
        }
    }

    /// Traces further batches at all wavelengths of `rule` until `stopping_rule` is met;
    /// observations are then means over the batches. Returns the entry of `results.json`.
    pub(super) fn go_on(
        &mut self,
        rule: &Rule,
        stopping_rule: &StoppingRule,
    ) -> Result<UntilError> {
        // Moved out, so that each is in memory once.
        let keys: Vec<NodeKey> = rule.iter().map(|node| self.key(node)).collect();
        let mut take = |key: &NodeKey| self.seen.get_mut(key)?.observation.take();
        let first: Vec<Observation> = keys.iter().filter_map(&mut take).collect();
        let what = format!("{} {}", self.job.design.name, self.job.model.key(self.job.design));
        let wavelengths: Vec<Value> = rule
            .iter()
            .map(|node| {
                let traced = self.at(node);
                let of = traced.job(&what).key_fields(self.job.context.seed);
                json!({"nm": node.nm, "weight": node.weight, "trace": of})
            })
            .collect();
        let sweep = &*self;
        let batches = Batches {
            design: sweep.job.design,
            rule: stopping_rule,
            what: &what,
            context: sweep.job.context,
            key_fields: wavelengths.into(),
            count: rule.len(),
            whole: Box::new(|nodes| {
                let weights = rule.iter().map(|node| node.weight);
                Observation::sum(&weights.zip(nodes).collect::<Vec<_>>())
            }),
            trace: |context| {
                let each = rule
                    .iter()
                    .map(|node| sweep.observe(sweep.at(node), node, rule.len() == 1, context));
                each.collect()
            },
        };
        let (means, said) = batches.run(Some(first))?;
        for (key, mean) in keys.iter().zip(means) {
            if let Some(traced) = self.seen.get_mut(key) {
                traced.observation = Some(mean);
            }
        }
        Ok(said)
    }

    /// The wavelength that was computed before.
    fn at(&self, node: &Node) -> &Traced {
        &self.seen[&self.key(node)]
    }

    /// Observation at a wavelength that was computed before.
    pub(super) fn observation(&self, node: &Node) -> &Observation {
        let seen = self.at(node).observation.as_ref();
        seen.expect("lent out only while batches are added")
    }

    /// The rule whose size follows from the design alone.
    pub(super) fn fixed_rule(&self) -> Result<Rule> {
        let lights = self.job.lights;
        Ok(if self.disperses()? { smallest_rule(lights) } else { medians(lights) })
    }

    /// The observations of `rule`, moved out.
    pub(super) fn into_observations(mut self, rule: &Rule) -> Vec<Observation> {
        let keys: Vec<NodeKey> = rule.iter().map(|node| self.key(node)).collect();
        let take = |key: &NodeKey| self.seen.remove(key)?.observation;
        keys.iter().filter_map(take).collect()
    }

    /// The sum over the wavelengths of `rule`, with colours where there are several: those of
    /// figures, and with `arrays` of all bins.
    pub(super) fn combined(&self, rule: &Rule, arrays: bool) -> Cow<'_, Observation> {
        match rule.len() {
            1 => Observation::sum(&self.parts(rule)),
            _ => self.coloured(rule, arrays),
        }
    }

    /// The same of light whose ways do not depend on the wavelength, or as what a larger rule is
    /// compared with: a single wavelength then has the colours of the whole light.
    pub(super) fn of_whole_light(&self, rule: &Rule) -> Cow<'_, Observation> {
        if self.job.lights.is_one_wavelength() {
            return self.combined(rule, false);
        }
        self.coloured(rule, false)
    }

    fn coloured(&self, rule: &Rule, arrays: bool) -> Cow<'_, Observation> {
        let mut sum = Observation::sum(&self.parts(rule));
        sum.to_mut().colours = Colours::new(self.job.design, &self.tristimulus(rule), arrays);
        sum
    }

    fn parts(&self, rule: &Rule) -> Vec<(f64, &Observation)> {
        let parts = rule.iter().map(|node| (node.weight, self.observation(node)));
        parts.collect()
    }

    /// Entries of `results.json`, one for each wavelength.
    pub(super) fn describe(&self, rule: &Rule) -> Vec<WavelengthEntry> {
        let one = |node: &Node| {
            let traced = self.at(node);
            let observation = self.observation(node);
            let figures = observation.figures(self.job.design).into_iter();
            let figures = figures.map(|figure| (figure.key.into_owned(), figure.entry));
            WavelengthEntry {
                wavelength_nm: node.nm,
                weight: node.weight,
                paths: observation.paths,
                silicone_index: traced.design.silicone.index,
                silicone_absorption_per_mm: traced.design.silicone.absorption_per_mm,
                sources: self.job.lights.lights[node.light].sources.clone(),
                tables: traced.prepared.tables.clone(),
                figures: figures.collect(),
            }
        };
        rule.iter().map(one).collect()
    }
}

/// True if a single wavelength is the whole light.
fn alone(rule: &[Node]) -> bool {
    matches!(rule, [node] if is_one(node.weight))
}

/// Index, absorption and scattering of the silicone and of all solids that light enters.
fn media(design: &Design) -> Vec<([f64; 2], Option<MediumScattering>)> {
    let solids = design.solids.iter().filter_map(|solid| solid.medium.as_ref());
    let media = [&design.silicone].into_iter().chain(solids);
    let of =
        |medium: &Medium| ([medium.index, medium.absorption_per_mm], medium.scattering.clone());
    media.map(of).collect()
}
