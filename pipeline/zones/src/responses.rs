// SPDX-License-Identifier: MIT OR Apache-2.0
//! Responses: the map of one package alone, lit among all its neighbours, for one place of each kind.

use anyhow::{Result, ensure};
use serde_json::json;

use arrays::cache::Cache;
use design::Design;
use design::resolved::trace_key::ReliefModel;
use metrics::illuminance::Symmetry;
use runtime::key::Key;
use runtime::run_context::RunContext;
use runtime::store::{Store, program_sha256};

use super::map_receiver::MapReceiver;
use super::places::Places;
use super::superposition::{Block, Piece, Turn};
use simulate::model::Model;
use simulate::model_traces::ModelTraces;
use simulate::seeds;
use simulate::trace::GROUPS;
use simulate::trace_plan::DomeChoice;

/// Folder of kept responses in the cache.
const FOLDER: &str = "responses";
/// Memory of all responses, bytes.
const MAX_BYTES: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;

/// A traced response.
struct Traced {
    /// Map of each group.
    groups: Vec<Vec<f64>>,
    /// What one path adds to a bin.
    one_path: f64,
}

impl Traced {
    /// All numbers one after the other, as they are kept.
    fn to_bytes(&self) -> Vec<u8> {
        let all = std::iter::once(&self.one_path).chain(self.groups.iter().flatten());
        all.flat_map(|number| number.to_le_bytes()).collect()
    }

    /// The response of so many bins that these bytes hold; `None` where they hold another.
    fn from_bytes(bytes: &[u8], bins: usize) -> Option<Self> {
        let (all, rest) = bytes.as_chunks();
        let (one_path, values) = all.split_first()?;
        if !rest.is_empty() || values.len() != GROUPS * bins {
            return None;
        }
        let group = |bytes: &[[u8; 8]]| bytes.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let groups = values.chunks(bins).map(group).collect();
        Some(Self { groups, one_path: f64::from_le_bytes(*one_path) })
    }
}

/// Responses of all places of the traced array.
pub struct Responses {
    blocks: Vec<Block>,
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
        model: Model,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Self> {
        let symmetry = receiver.symmetry(design, places);
        let [columns, rows] = places.traced;
        let mut traced: Vec<[usize; 2]> = Vec::new();
        let mut images = Vec::with_capacity(columns * rows);
        for place in (0..rows).flat_map(|j| (0..columns).map(move |i| [i, j])) {
            let (first, turn) = image(place, places.traced, symmetry);
            let number = traced.iter().position(|known| *known == first).unwrap_or_else(|| {
                traced.push(first);
                traced.len() - 1
            });
            images.push((number, turn));
        }
        let bytes = 8.0 * (traced.len() * GROUPS * receiver.frame.count()) as f64;
        ensure!(
            bytes <= MAX_BYTES,
            "{}: {} responses of {} bins: expected at most 2 GiB for them, got {:.1} GiB; larger bins, or fewer packages and --packages, take less",
            design.provenance.file,
            traced.len(),
            receiver.frame.count(),
            bytes / MAX_BYTES * 2.0
        );
        let store = Store::lasting(cache.directory(), FOLDER, context.console);
        let mut traces = ModelTraces::of_study(cache);
        let mut blocks = Vec::with_capacity(traced.len());
        let mut keys = Vec::with_capacity(traced.len());
        for (count, place) in traced.iter().enumerate() {
            context.interrupt.check()?;
            let number = places.number(*place);
            let lit = lit(design, number);
            let seed = seeds::of_package(context.seed, number);
            let key = key(&lit, receiver, model, seed)?;
            let entries = store.entries(key.clone());
            let known = entries.find(0);
            let known = known.and_then(|bytes| Traced::from_bytes(&bytes, receiver.frame.count()));
            let kept = if let Some(known) = known {
                known
            } else {
                let (name, of) = (&design.name, traced.len());
                let what = format!("{name} {}, response {} of {of}", model.key(design), count + 1);
                let at = RunContext { seed, ..context };
                let kept = trace(&mut traces, &lit, (receiver, model), &what, at)?;
                entries.keep(0, &kept.to_bytes());
                store.take_error()?;
                kept
            };
            blocks.push(Block::new(receiver.frame.bins, &kept.groups, kept.one_path));
            keys.push(key.hex().to_owned());
        }
        let key = Key::of(&json!({"responses": keys, "images": places.traced}));
        Ok(Self { blocks, images, columns, key })
    }

    /// Number of responses that were traced.
    pub fn count(&self) -> usize {
        self.blocks.len()
    }

    /// The response of a place of the traced array, where that place stands.
    pub fn at(&self, [i, j]: [usize; 2]) -> Piece<'_> {
        let (number, turn) = self.images[j * self.columns + i];
        Piece { block: &self.blocks[number], turn, at: [0; 2], weight: 1.0 }
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
fn key(lit: &Design, receiver: &MapReceiver, model: Model, seed: u64) -> Result<Key> {
    let relief = match model {
        Model::Geometric => ReliefModel::Elements,
        Model::Fine => ReliefModel::Rings,
        Model::Control => ReliefModel::RayTables,
        Model::Hybrid => ReliefModel::OrderTables,
    };
    Ok(Key::of(&json!({
        "program": program_sha256()?,
        "design": lit.trace_fields(relief),
        "model": model.key(lit),
        "map": receiver.key_fields(),
        "seed": seed,
    })))
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
        let back = Traced::from_bytes(&bytes, 3).expect("the same bins");
        assert_eq!(back.to_bytes(), bytes);
        assert_eq!((back.groups[2][0], back.one_path), (2.0 / 3.0, 0.1));
        assert!(Traced::from_bytes(&bytes, 4).is_none());
        assert!(Traced::from_bytes(&bytes[1..], 3).is_none());
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
