// SPDX-License-Identifier: MIT OR Apache-2.0
//! Power ledgers of single lights and sources, and efficiencies in watts and in lumens, for sources
//! with spectra of their own.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use design::resolved::sources::CheckedSource;
use design::spectrum::lights::Light;
use metrics::extraction::{extraction, flow};
use metrics::kinds::Weighting;
use metrics::{Grouped, jackknife};
use results::ledger::Ledger;
use results::schema::{EfficiencyEntry, SourceEntry};

use super::rule::{Node, Rule};
use super::sweep::Sweep;
use crate::observation::colours::Part;
use crate::observation::{Observation, of_one_path};

/// The nodes of some lights.
fn of_lights(rule: &Rule, numbers: &[usize]) -> Rule {
    let nodes = rule.iter().copied();
    nodes.filter(|node| numbers.contains(&node.light)).collect()
}

impl Sweep<'_> {
    /// Every light with its emitted flux and its ledger, in shares of that flux. Sources of one
    /// spectrum are one light here, even if each is traced by itself.
    pub(super) fn account(&self, rule: &Rule) -> Vec<Value> {
        let watts = self.job.design.emitted_w();
        let one = self.job.lights.by_colour().into_iter().map(|(light, numbers)| {
            let mut entry = json!(Light {
                emitted_w: light.emitted_w * watts,
                emitted_lm: light.emitted_lm * watts,
                ..light
            });
            entry["power_ledger"] = json!(self.ledger(&of_lights(rule, &numbers)));
            entry
        });
        one.collect()
    }

    /// Every source with its emitted flux and its ledger, in shares of that flux, where each is
    /// traced by itself.
    pub(super) fn by_source(&self, rule: &Rule) -> BTreeMap<String, SourceEntry> {
        let names = self.job.design.sources.iter().map(CheckedSource::name);
        let is_of = |light: &Light, name: &str| light.sources.iter().any(|source| source == name);
        self.by_part(rule, names, is_of)
    }

    /// The same of every channel, where there are several.
    pub(super) fn by_channel(&self, rule: &Rule) -> Option<BTreeMap<String, SourceEntry>> {
        let (design, channels) = (self.job.design, self.job.design.channels());
        let is_of = |light: &Light, name: &str| channels[design.channel_of(light)] == name;
        (channels.len() > 1).then(|| self.by_part(rule, channels.iter().copied(), is_of))
    }

    fn by_part<'n>(
        &self,
        rule: &Rule,
        names: impl Iterator<Item = &'n str>,
        is_of: impl Fn(&Light, &str) -> bool,
    ) -> BTreeMap<String, SourceEntry> {
        let watts = self.job.design.emitted_w();
        let of_part = |name: &str| {
            let all = self.job.lights.lights.iter().enumerate();
            let own = all.filter(|(_, light)| is_of(light, name));
            let (numbers, lights): (Vec<usize>, Vec<&Light>) = own.unzip();
            let sum = |of: fn(&Light) -> f64| lights.iter().map(|light| of(light)).sum::<f64>();
            SourceEntry {
                emitted_w: sum(|light| light.emitted_w) * watts,
                emitted_lm: sum(|light| light.emitted_lm) * watts,
                power_ledger: self.ledger(&of_lights(rule, &numbers)),
            }
        };
        names.map(|name| (name.to_owned(), of_part(name))).collect()
    }

    /// The ledger of some nodes together, in shares of their flux.
    fn ledger(&self, nodes: &[Node]) -> Ledger {
        let whole: f64 = nodes.iter().map(|node| node.weight).sum();
        let parts = nodes.iter().map(|node| (node.weight / whole, &self.observation(node).powers));
        let powers = Grouped::weighted(&parts.collect::<Vec<_>>());
        let paths: u64 = nodes.iter().map(|node| self.observation(node).paths).sum();
        let one_path = 1.0 / paths as f64;
        let ledger = Ledger::new(&self.observation(&nodes[0]).accounts, &powers, flow::EMITTED);
        ledger.with_one_path(|account| of_one_path(self.job.design, account, one_path))
    }

    /// Flux out over flux in, in watts and in lumens. The weighting that is not the design's
    /// interpolates linearly between wavelengths.
    pub(super) fn efficiency(&self, rule: &Rule) -> BTreeMap<Weighting, EfficiencyEntry> {
        let watts = self.job.design.emitted_w();
        let mut efficiency = BTreeMap::new();
        for (unit, weighting, emitted) in [
            ("W/W", Weighting::Radiometric, watts),
            ("lm/lm", Weighting::Photometric, watts * self.job.lights.emitted_lm()),
        ] {
            if emitted <= 0.0 {
                continue;
            }
            let parts = self.weighted(rule, weighting);
            let sum = |of: fn(&Observation) -> &Grouped| {
                let parts = parts.iter().map(|(w, seen)| (*w, of(seen)));
                Grouped::weighted(&parts.collect::<Vec<_>>())
            };
            let accounts = &self.observation(&rule[0]).accounts;
            let up = accounts.iter().position(|name| name == "escaped_up");
            let escaped_up = up.map(|up| {
                let powers = sum(|seen| &seen.powers);
                jackknife(&powers, |p| p[up] / p[flow::EMITTED])
            });
            let domed = self.job.design.dome.is_some();
            let entry = EfficiencyEntry {
                unit: unit.to_owned(),
                emitted,
                extraction_efficiency: domed.then(|| extraction(&sum(|seen| &seen.flows))),
                escaped_up,
            };
            efficiency.insert(weighting, entry);
        }
        efficiency
    }

    /// The nodes of `rule` with weights that add up to 1 in any weighting.
    fn weighted(&self, rule: &Rule, weighting: Weighting) -> Vec<(f64, &Observation)> {
        let own = weighting == self.job.lights.weighting;
        let of_light = rule.chunk_by(|a, b| a.light == b.light);
        let parts = of_light.flat_map(|nodes| {
            let light = &self.job.lights.lights[nodes[0].light];
            let share = self.job.lights.share(light, weighting);
            let nm: Vec<f64> = nodes.iter().map(|node| node.nm).collect();
            let weights = light.light.weights(&nm, weighting);
            let pairs = nodes.iter().zip(weights);
            let weighted = pairs.map(move |(node, weight)| {
                let weight = if own { node.weight } else { share * weight };
                (weight, self.observation(node))
            });
            weighted.collect::<Vec<_>>()
        });
        parts.collect()
    }

    /// The observations of `rule`, with weights that make X, Y and Z for 1 W of all lights.
    pub(super) fn tristimulus(&self, rule: &Rule) -> Vec<Part<'_>> {
        let mut parts = Vec::with_capacity(rule.len());
        for nodes in rule.chunk_by(|a, b| a.light == b.light) {
            let light = &self.job.lights.lights[nodes[0].light];
            let nm: Vec<f64> = nodes.iter().map(|node| node.nm).collect();
            let seen_by = self.job.design.seen_by_panel(light, &nm);
            parts.extend(nodes.iter().zip(seen_by).map(|(node, mut xyz)| {
                let behind = xyz.split_off(1);
                Part { weights: xyz[0], behind, seen: self.observation(node) }
            }));
        }
        parts
    }
}
