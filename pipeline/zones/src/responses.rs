// SPDX-License-Identifier: MIT OR Apache-2.0
//! Responses: the map of one package alone, lit among all its neighbours, for one place of each kind.
//!
//! A design whose channels or panel have colours has one for each wavelength of each channel, from
//! one trace, in the groups of colours ([`GROUPS_TOGETHER`]). Where a medium converts light it has, from
//! one trace of each channel, one for X, one for Y, one for Z, and three more behind each sub-pixel.

use anyhow::{Result, ensure};
use serde_json::json;

use arrays::cache::Cache;
use design::Design;
use design::resolved::panel::SubPixel;
use design::resolved::trace_key::ReliefModel;
use metrics::Grouped;
use metrics::colour_matching;
use metrics::illuminance::Symmetry;
use runtime::key::Key;
use runtime::run_context::RunContext;
use runtime::store::{Store, program_sha256};

use super::map_receiver::MapReceiver;
use super::places::Places;
use super::superposition::{ANYWHERE, Block, Piece, Turn};
use simulate::model::Model;
use simulate::model_traces::ModelTraces;
use simulate::observation::Observation;
use simulate::observation::colours::GROUPS_TOGETHER;
use simulate::seeds;
use simulate::spectral::SpectralJob;
use simulate::trace::GROUPS;
use simulate::trace_plan::DomeChoice;

/// Folder of kept responses in the cache.
const FOLDER: &str = "responses";
/// Memory of all responses, bytes.
pub(super) const MAX_BYTES: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;

/// Light of a channel at one of its wavelengths, X, Y or Z of it, or all light.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelLight {
    /// Number of the channel.
    pub channel: usize,
    /// Number of the light whose bounds of bias move together: a channel, or X, Y or Z of one that a medium
    /// converts, which changes its colour with the distance.
    pub lot: usize,
    /// X, Y and Z of light of 1; all light counts as Y.
    pub xyz: [f64; 3],
    /// The same behind each open sub-pixel.
    pub behind: Vec<[f64; 3]>,
}

impl ChannelLight {
    /// All light as it is counted.
    pub fn whole() -> Vec<Self> {
        vec![Self { channel: 0, lot: 0, xyz: [0.0, 1.0, 0.0], behind: Vec::new() }]
    }

    /// Parts of the light of `design`, for 1 W of all lights.
    ///
    /// # Errors
    /// A wavelength at which a material has no data.
    pub fn of_colours(design: &Design, model: Model, context: RunContext) -> Result<Vec<Self>> {
        if design.converts() {
            return Ok(Self::of_converted(design));
        }
        let lights = &design.colour_lights().radiometric();
        let nodes = SpectralJob { design, lights, model, cache: None, context }.nodes()?;
        let mut parts = Vec::with_capacity(nodes.len());
        for nodes in nodes.chunk_by(|a, b| a.0 == b.0) {
            let light = &lights.lights[nodes[0].0];
            let nm: Vec<f64> = nodes.iter().map(|node| node.1).collect();
            let channel = design.channel_of(light);
            for mut xyz in design.seen_by_panel(light, &nm) {
                let behind = xyz.split_off(1);
                parts.push(Self { channel, lot: channel, xyz: xyz[0], behind });
            }
        }
        Ok(parts)
    }

    /// The same of light that is converted: X, Y and Z of each channel, open and behind each sub-pixel.
    fn of_converted(design: &Design) -> Vec<Self> {
        let mut emitted_w = vec![0.0; design.channels().len()];
        for light in &design.colour_lights().lights {
            emitted_w[design.channel_of(light)] += light.emitted_w;
        }
        let sub_pixels = design.sub_pixels().len();
        let part = |channel: usize, place: usize, k: usize| {
            let mut seen = vec![[0.0; 3]; 1 + sub_pixels];
            seen[place][k] = emitted_w[channel];
            Self { channel, lot: 3 * channel + k, xyz: seen[0], behind: seen.split_off(1) }
        };
        let places =
            (0..emitted_w.len()).flat_map(|c| (0..=sub_pixels).map(move |place| (c, place)));
        places.flat_map(|(c, place)| [0, 1, 2].map(|k| part(c, place, k))).collect()
    }

    /// Weight among the parts of its lot: Y, or where that is 0 all that is counted of it.
    pub(super) fn weight(&self) -> f64 {
        let all = || self.xyz.iter().chain(self.behind.iter().flatten()).sum();
        if self.xyz[1] > 0.0 { self.xyz[1] } else { all() }
    }
}

/// Groups of paths of a response in so many parts of the light, or as a whole.
pub(super) fn groups_of(parts: Option<usize>) -> usize {
    if parts.is_some() { GROUPS / GROUPS_TOGETHER } else { GROUPS }
}

/// A traced response.
struct Traced {
    /// Map of each group.
    groups: Vec<Vec<f64>>,
    /// What one path adds to a bin.
    one_path: f64,
}

impl Traced {
    /// What `receiver` saw of a part of the light, of which one path has this `power`.
    fn of_part(seen: &Observation, receiver: &MapReceiver, power: f64) -> Self {
        let map = receiver.map(seen);
        let map = Grouped::weighted_merged(&[(1.0, &map)], receiver.frame.count(), GROUPS_TOGETHER);
        let groups = (0..map.count()).map(|g| map.group(g).to_vec()).collect();
        Self { groups, one_path: receiver.one_path(power) }
    }

    /// All numbers one after the other, as they are kept.
    fn to_bytes(&self) -> Vec<u8> {
        let all = std::iter::once(&self.one_path).chain(self.groups.iter().flatten());
        all.flat_map(|number| number.to_le_bytes()).collect()
    }

    /// The response in so many groups of bins that these bytes hold; `None` where they hold another.
    fn from_bytes(bytes: &[u8], groups: usize, bins: usize) -> Option<Self> {
        let (all, rest) = bytes.as_chunks();
        let (one_path, values) = all.split_first()?;
        if !rest.is_empty() || values.len() != groups * bins {
            return None;
        }
        let group = |bytes: &[[u8; 8]]| bytes.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let groups = values.chunks(bins).map(group).collect();
        Some(Self { groups, one_path: f64::from_le_bytes(*one_path) })
    }
}

/// Responses of all places of the traced array.
pub struct Responses {
    /// Of each place that was traced, one for each part.
    blocks: Vec<Vec<Block>>,
    /// Groups of paths.
    pub groups: usize,
    /// Response and image of each place, row after row.
    images: Vec<(usize, Turn)>,
    columns: usize,
    /// Hash of all that they depend on.
    pub key: Key,
}

impl Responses {
    /// Traces the responses of `design` in `model`, or finds them in `cache`.
    ///
    /// # Errors
    /// Responses beyond the memory; those of a trace; an interrupt; a cache that cannot be written.
    pub fn new(
        design: &Design,
        places: &Places,
        receiver: &MapReceiver,
        (model, parts): (Model, Option<usize>),
        cache: &Cache,
        context: RunContext,
    ) -> Result<Self> {
        let groups = groups_of(parts);
        let count = parts.unwrap_or(1);
        let symmetry = receiver.symmetry(design, places);
        let [columns, rows] = places.traced;
        let mut traced: Vec<[usize; 2]> = Vec::new();
        let mut images = Vec::with_capacity(columns * rows);
        for place in (0..rows).flat_map(|j| (0..columns).map(move |i| [i, j])) {
            if !(0..2).all(|k| places.is_traced(k, place[k])) {
                images.push((usize::MAX, Turn::default()));
                continue;
            }
            let (first, turn) = image(place, places.traced, symmetry);
            let number = traced.iter().position(|known| *known == first).unwrap_or_else(|| {
                traced.push(first);
                traced.len() - 1
            });
            images.push((number, turn));
        }
        let bytes = 8.0 * (traced.len() * count * groups * receiver.frame.count()) as f64;
        ensure!(
            bytes <= MAX_BYTES,
            "{}: {} responses of {} bins: expected at most 2 GiB for them, got {:.1} GiB; larger bins, or fewer packages and --packages, take less",
            design.provenance.file,
            traced.len() * count,
            receiver.frame.count(),
            bytes / MAX_BYTES * 2.0
        );
        let store = Store::lasting(cache.directory(), FOLDER, context.console);
        let mut traces = ModelTraces::of_study(cache);
        let mut blocks = Vec::with_capacity(traced.len());
        let mut keys = Vec::with_capacity(traced.len());
        for (response, place) in traced.iter().enumerate() {
            context.interrupt.check()?;
            let number = places.number(*place);
            let lit = lit(design, number);
            let seed = seeds::of_package(context.seed, number);
            let key = key(&lit, receiver, model, (seed, parts))?;
            let entries = store.entries(key.clone());
            let known = (0..count).map(|part| {
                Traced::from_bytes(&entries.find(part as u64)?, groups, receiver.frame.count())
            });
            let kept = if let Some(known) = known.collect::<Option<Vec<Traced>>>() {
                known
            } else {
                let (name, of) = (&design.name, traced.len());
                let what =
                    format!("{name} {}, response {} of {of}", model.key(design), response + 1);
                let at = RunContext { seed, ..context };
                let kept = match parts {
                    None => vec![trace(&mut traces, &lit, (receiver, model), &what, at)?],
                    Some(_) if lit.converts() => {
                        trace_converted(&mut traces, &lit, (receiver, model), &what, at)?
                    }
                    Some(_) => trace_apart(&lit, (receiver, model), cache, at)?,
                };
                let numbered = kept.iter().enumerate();
                numbered.for_each(|(part, kept)| entries.keep(part as u64, &kept.to_bytes()));
                store.take_error()?;
                kept
            };
            let block =
                |kept: &Traced| Block::new(receiver.frame.bins, &kept.groups, kept.one_path);
            blocks.push(kept.iter().map(block).collect());
            keys.push(key.hex().to_owned());
        }
        let key = json!({"responses": keys, "images": places.traced, "stated": places.stated});
        let key = Key::of(&key);
        Ok(Self { blocks, groups, images, columns, key })
    }

    /// These blocks of all light, of the places that `images` name, row after row of so many columns.
    #[cfg(test)]
    pub fn of_blocks(blocks: Vec<Block>, images: &[usize], columns: usize) -> Self {
        let groups = blocks[0].groups;
        let blocks = blocks.into_iter().map(|block| vec![block]).collect();
        let images = images.iter().map(|number| (*number, Turn::default())).collect();
        Self { blocks, groups, images, columns, key: Key::of(&json!({})) }
    }

    /// Number of responses that were traced.
    pub fn count(&self) -> usize {
        self.blocks.len()
    }

    /// The response of a place of the traced array in a part of the light, where that place stands.
    pub fn at(&self, [i, j]: [usize; 2], part: usize) -> Piece<'_> {
        let (number, turn) = self.images[j * self.columns + i];
        Piece { block: &self.blocks[number][part], turn, at: [0; 2], within: ANYWHERE, weight: 1.0 }
    }
}

/// `design` with one package lit.
fn lit(design: &Design, number: usize) -> Design {
    let mut lit = design.clone();
    let mut drives = vec![0.0; design.array.count()];
    drives[number] = 1.0;
    lit.array.drives = Some(drives);
    lit
}

/// The map of `design` as its packages are driven.
fn trace(
    traces: &mut ModelTraces,
    design: &Design,
    (receiver, model): (&MapReceiver, Model),
    what: &str,
    context: RunContext,
) -> Result<Traced> {
    let seen = traces.observe(design, DomeChoice::Model(model), what, context)?;
    let map = receiver.map(&seen);
    let groups = (0..map.count()).map(|g| map.group(g).to_vec()).collect();
    Ok(Traced { groups, one_path: receiver.one_path(seen.path_power()) })
}

/// The maps of `design` in each of its lights at each wavelength.
fn trace_apart(
    design: &Design,
    (receiver, model): (&MapReceiver, Model),
    cache: &Cache,
    context: RunContext,
) -> Result<Vec<Traced>> {
    let lights = &design.colour_lights().radiometric();
    let job = SpectralJob { design, lights, model, cache: Some(cache), context };
    let of_part = |seen: &Observation| Traced::of_part(seen, receiver, seen.path_power());
    Ok(job.apart()?.iter().map(of_part).collect())
}

/// The maps of `design` in X, Y and Z of each channel alone, open and behind each sub-pixel.
fn trace_converted(
    traces: &mut ModelTraces,
    design: &Design,
    (receiver, model): (&MapReceiver, Model),
    what: &str,
    context: RunContext,
) -> Result<Vec<Traced>> {
    let (traced_nm, filters) = (design.traced_nm(), design.sub_pixels());
    // The largest weight of a path, which a bin without any may have missed.
    let largest = |filter: Option<&SubPixel>, k: usize| {
        let seen = |nm: &f64| colour_matching::xyz(*nm)[k] * filter.map_or(1.0, |of| of.at(*nm));
        traced_nm.iter().map(seen).fold(0.0, f64::max)
    };
    let places = std::iter::once(None).chain(filters.iter().map(Some));
    let largest: Vec<f64> =
        places.flat_map(|filter| [0, 1, 2].map(|k| largest(filter, k))).collect();
    let mut all = Vec::new();
    for channel in 0..design.channels().len() {
        let lit = design.lit_by_channel(channel);
        let (dome, name) = (DomeChoice::Model(model), design.channels()[channel]);
        let context = RunContext { seed: seeds::of_light(context.seed, name), ..context };
        let what = format!("{what}, {name}");
        let seen = traces.observe_channels(&lit, dome, &what, context)?;
        let power = seen[0].path_power();
        let colours = seen[1..4].iter().chain(&seen[5..]).enumerate();
        let of_part = |(k, seen)| Traced::of_part(seen, receiver, power * largest[k]);
        all.extend(colours.map(of_part));
    }
    Ok(all)
}

/// The map of `design` with its packages at these `drives`, in columns and rows, traced as a whole.
///
/// # Errors
/// Those of a trace; an interrupt.
pub fn direct(
    design: &Design,
    (places, drives): (&Places, &[f64]),
    receiver: &MapReceiver,
    model: Model,
    cache: &Cache,
    context: RunContext,
) -> Result<Block> {
    let mut driven = design.clone();
    driven.array.drives = Some(places.in_order(drives));
    let what = format!("{} {}, all packages", design.name, model.key(design));
    // Beyond the seeds of responses.
    let seed = seeds::of_package(context.seed, places.count());
    let mut traces = ModelTraces::of_study(cache);
    let context = RunContext { seed, ..context };
    let seen = trace(&mut traces, &driven, (receiver, model), &what, context)?;
    Ok(Block::new(receiver.frame.bins, &seen.groups, seen.one_path))
}

/// All that a response depends on.
fn key(
    lit: &Design,
    receiver: &MapReceiver,
    model: Model,
    (seed, parts): (u64, Option<usize>),
) -> Result<Key> {
    let relief = match model {
        Model::Geometric => ReliefModel::Elements,
        Model::Fine => ReliefModel::Rings,
        Model::Control => ReliefModel::RayTables,
        Model::Hybrid => ReliefModel::OrderTables,
    };
    let mut fields = json!({
        "program": program_sha256()?,
        "design": lit.trace_fields(relief),
        "model": model.key(lit),
        "map": receiver.key_fields(),
        "seed": seed,
    });
    if let Some(parts) = parts {
        fields["parts"] = json!({"count": parts, "channels": lit.channels()});
    }
    Ok(Key::of(&fields))
}

/// The place whose response is traced for `place`, and which image of it is that of `place`.
fn image(place: [usize; 2], count: [usize; 2], symmetry: Symmetry) -> ([usize; 2], Turn) {
    if symmetry == Symmetry::None {
        return (place, Turn::default());
    }
    let mirror = [0, 1].map(|k| place[k] > count[k] - 1 - place[k]);
    let near = [0, 1].map(|k| if mirror[k] { count[k] - 1 - place[k] } else { place[k] });
    let swap = symmetry == Symmetry::Square && near[0] > near[1];
    (if swap { [near[1], near[0]] } else { near }, Turn { swap, mirror })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_responses_come_back_to_the_bit() {
        let groups = (0..GROUPS).map(|g| vec![g as f64 / 3.0, -0.0, 1e-310]).collect();
        let traced = Traced { groups, one_path: 0.1 };
        let bytes = traced.to_bytes();
        let back = Traced::from_bytes(&bytes, GROUPS, 3).expect("the same bins");
        assert_eq!(back.to_bytes(), bytes);
        assert_eq!((back.groups[2][0], back.one_path), (2.0 / 3.0, 0.1));
        assert!(Traced::from_bytes(&bytes, GROUPS, 4).is_none());
        assert!(Traced::from_bytes(&bytes[1..], GROUPS, 3).is_none());
    }

    #[test]
    fn one_place_of_each_kind_is_traced() {
        let traced = |count: [usize; 2], symmetry| {
            let all = (0..count[1]).flat_map(|j| (0..count[0]).map(move |i| [i, j]));
            let mut all: Vec<[usize; 2]> = all.map(|at| image(at, count, symmetry).0).collect();
            all.sort_unstable();
            all.dedup();
            all.len()
        };
        // Corner, two of the edge, two on the diagonal, one beside it.
        assert_eq!(traced([5, 5], Symmetry::Square), 6);
        assert_eq!(traced([5, 5], Symmetry::Rectangle), 9);
        assert_eq!(traced([6, 4], Symmetry::Rectangle), 6);
        assert_eq!(traced([6, 4], Symmetry::None), 24);
        let (first, turn) = image([4, 1], [5, 5], Symmetry::Square);
        assert_eq!((first, turn), ([0, 1], Turn { swap: false, mirror: [true, false] }));
        let (first, turn) = image([1, 4], [5, 5], Symmetry::Square);
        assert_eq!((first, turn), ([0, 1], Turn { swap: true, mirror: [false, true] }));
    }
}
