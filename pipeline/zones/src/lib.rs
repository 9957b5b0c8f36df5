// SPDX-License-Identifier: MIT OR Apache-2.0
//! Dimming zones of a backlight: the response of one package of each kind of place, traced once,
//! and any pattern of drives by superposition.
//!
//! In: a design, columns and rows of zones and of packages, a pattern. Out: maps of the backlight
//! and of what a panel before it shows, halo, spread of a zone's light, all with errors from the
//! groups of paths of the responses.
//!
//! Sources of several channels, and panels with sub-pixels, make it a pattern for each channel, and
//! colours ([`full_drive`], [`picture`], [`pattern_colours`]).
//!
//! The light of a pattern is B(x) = Σ d_p r_p(x) over the packages p at drives d_p. Their responses
//! r_p are those of the traced array, shifted by whole bins ([`places`]) and folded at the walls of a
//! larger one (`walls`). Light farther out than the traced array is missing, and the law of the walls
//! is off beside them: ε, the shares of both of an inner package's light ([`reference::Beyond`]). No place
//! then lacks or has more than ε W max d_p, with W the mean at full drive, nor more than what the lit
//! packages together send so far: the smaller one bounds the bias of every value, and a mean over the panel
//! has the mean of these bounds. Figures in colours have an ε and W of each channel.

mod cells;
pub mod colour_estimates;
mod estimates;
pub mod full_drive;
pub mod levels;
pub mod map_receiver;
mod needs;
mod panel;
mod panel_colour;
pub mod pattern_colours;
pub mod picture;
pub mod places;
pub mod reference;
mod responses;
mod superposition;
mod walls;
pub mod wide;

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use arrays::cache::Cache;
use design::Design;
use design::spectrum::Sampling;
use formats::level_image::LevelImage;
use metrics::glare::Viewing;
use metrics::{Estimate, JackknifedFigure};
use runtime::key::Key;
use runtime::run_context::RunContext;
use runtime::store::Store;

use self::cells::Cells;
use self::estimates::biased;
use self::full_drive::FullDrive;
use self::map_receiver::{Frame, MapReceiver};
use self::panel::PanelBeforeZones;
use self::pattern_colours::PatternColours;
use self::picture::PictureOnPanel;
use self::places::Places;
use self::reference::{LightOff, Reference, sum_of};
use self::responses::{ChannelLight, Responses, direct};
use self::superposition::{ANYWHERE, Block, Piece, Turn};
use self::walls::Walls;
use self::wide::WideDesign;
use simulate::model::Model;
use simulate::trace::GROUPS;

/// Folder of kept references in the cache.
const FOLDER: &str = "zones";
/// Smallest drive of a zone that shines.
const MIN_DRIVE: f64 = 1e-12;
/// Largest number of bins of a map, and of one in colours.
const MAX_BINS: usize = 16_000_000;
const MAX_COLOUR_BINS: usize = 2_000_000;
/// Memory of the light of zones, row by row of bins and in all, bytes.
const MAX_HELD: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;
/// Memory of the light of zones that occurs more than once, bytes.
const MAX_SHARED: usize = 1 << 30;

/// An array with its zones and the receiver that reads it.
pub struct ZonedDesign<'a> {
    /// The design.
    pub design: &'a Design,
    model: Model,
    /// Places of the packages.
    pub places: Places,
    /// Columns and rows of zones.
    pub zones: [usize; 2],
    /// The receiver of the maps.
    pub receiver: MapReceiver<'a>,
    /// Bins from a package to the next, where the array is larger than the traced one.
    step: [usize; 2],
    /// Bins of the maps.
    pub frame: Frame,
    /// Parts of the light where channels or the panel have colours.
    parts: Option<Vec<ChannelLight>>,
}

/// Choices of a command beside the design.
#[derive(Debug, Clone, Copy, Default)]
pub struct Request<'a> {
    /// Columns and rows of zones; a zone for each package without.
    pub zones: Option<[usize; 2]>,
    /// Columns and rows of packages, where they are more than those of the design.
    pub packages: Option<[usize; 2]>,
    /// Name of the receiver; the plane of the design without.
    pub receiver: Option<&'a str>,
}

/// Drives of zones and the picture on the panel.
#[derive(Clone, Copy)]
pub struct Pattern<'a> {
    /// Drives of the zones, for each channel.
    pub drives: &'a [Vec<f64>],
    /// The picture.
    pub picture: PatternPicture<'a>,
    /// Columns and rows of zones in or beside which black is that of the halo; those of the design without.
    pub halo_zones: Option<[usize; 2]>,
    /// An eye whose own glare hides a part of the halo.
    pub viewing: Option<Viewing>,
    /// Full drive, of designs with colours.
    pub full: Option<&'a FullDrive>,
}

/// The picture on a panel.
#[derive(Clone, Copy)]
pub enum PatternPicture<'a> {
    /// Levels as luminance, on a panel of this largest over smallest transmittance.
    Grey(&'a LevelImage, f64),
    /// Colours, on a panel of sub-pixels.
    Coloured(&'a PictureOnPanel<'a>),
}

/// Light that places may lack or have too much.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BeyondLight {
    /// Of each part of the light, in the pattern.
    pub parts: Vec<LightOff>,
    /// Luminance at full drive, over that of white.
    pub of_white: f64,
}

/// Light of a pattern, in the quantity of the receiver.
pub struct Dimmed {
    /// Number of responses.
    pub responses: usize,
    /// Figures that do not depend on the pattern.
    pub reference: Reference,
    /// Backlight and light behind the panel by bins, with standard errors.
    pub maps: [(Vec<f64>, Vec<f64>); 2],
    /// The same by zones.
    pub zones: [Vec<Estimate>; 2],
    /// Mean of black beside bright, of bright, and of the first over the second.
    pub halo: Option<[Estimate; 3]>,
    /// The share of black beside bright that lies below the veil of the eye.
    pub hidden: Option<Estimate>,
    /// The mean of the light behind the panel.
    pub mean: Estimate,
    /// The mean of the panel at full drive.
    pub white: Estimate,
    /// How far a direct trace lies from the superposition.
    pub direct: Option<DirectTrace>,
    /// Colours behind the panel, where parts of the light have some.
    pub colours: Option<PatternColours>,
}

/// Distance of a direct trace from the superposition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectTrace {
    /// Sum over zones of squared differences, in squared standard errors.
    pub chi_square: f64,
    /// Largest difference, in standard errors.
    pub largest: f64,
}

impl<'a> ZonedDesign<'a> {
    /// Checks `request` against the design that is traced.
    ///
    /// # Errors
    /// Packages, zones or a receiver that do not fit.
    pub fn new(wide: &'a WideDesign, model: Model, request: Request) -> Result<Self> {
        let WideDesign { design, stated, parts } = wide;
        let mut places = Places::new(design, request.packages, *stated)?;
        let zones = request.zones.unwrap_or(places.whole);
        let has_colours = parts.is_some();
        let receiver = MapReceiver::new(design, request.receiver, &places, has_colours)?;
        let (step, frame) = receiver.over(&places)?;
        for (k, name) in ["x", "y"].into_iter().enumerate() {
            let ([low, length], bin) = (places.area_mm(k), frame.bin_mm[k]);
            let (from, to) = (frame.low_mm[k], frame.low_mm[k] + frame.bins[k] as f64 * bin);
            ensure!(
                from < low + 1e-6 * bin && to > low + length - 1e-6 * bin,
                "--receiver: expected one over all packages, {name} from {low} to {} mm, got {:?} from {from} to {to} mm",
                low + length,
                receiver.name()
            );
            ensure!(
                !frame.middles_within(k, [low, length]).is_empty(),
                "--receiver: expected bins with a middle on the panel, {name} from {low} to {} mm, got {:?} with bins of {bin} mm",
                low + length,
                receiver.name()
            );
        }
        let max_bins = if has_colours { MAX_COLOUR_BINS } else { MAX_BINS };
        ensure!(
            frame.count() <= max_bins,
            "--packages: expected at most {max_bins} bins over all of them, got {} x {}; larger bins take less",
            frame.bins[0],
            frame.bins[1]
        );
        let held = 2.0 * 8.0 * (GROUPS + 1) as f64 * (zones[0] * (frame.bins[1] + zones[1])) as f64;
        ensure!(
            held <= MAX_HELD,
            "--zones: expected at most 2 GiB for the light of zones, got {:.1} GiB; fewer zones or larger bins take less",
            held / MAX_HELD * 2.0
        );
        places.divide(zones)?;
        Ok(Self { design, model, places, zones, receiver, step, frame, parts: parts.clone() })
    }

    /// True where lights with a stated tolerance are traced at wavelengths whose number does not follow
    /// from it.
    pub fn passes_over_tolerance(&self) -> bool {
        let lights = &self.design.colour_lights().lights;
        let has_tolerance = lights
            .iter()
            .any(|light| matches!(light.light.sampling(), Some(Sampling::Tolerance(_))));
        has_tolerance
            && !self.design.converts()
            && self.parts.as_ref().is_some_and(|parts| parts.len() > lights.len())
    }

    /// True where channels or the panel have colours.
    pub fn has_colours(&self) -> bool {
        self.parts.is_some()
    }

    /// Checks the drives of zones, read from `file`; those of one of several channels may be dark.
    ///
    /// # Errors
    /// Drives of another number than there are zones; none that shines; one so small that the squares
    /// of what it lights are lost.
    pub fn check_drives(&self, drives: &LevelImage, file: &str, may_be_dark: bool) -> Result<()> {
        let [columns, rows] = self.zones;
        ensure!(
            [drives.columns, drives.rows] == self.zones,
            "`{file}`: --pattern: expected {columns} x {rows} drives, one for each zone (--zones), got {} x {}",
            drives.columns,
            drives.rows
        );
        ensure!(
            may_be_dark || drives.levels.iter().any(|drive| *drive > 0.0),
            "`{file}`: --pattern: expected a drive above 0 in a zone, got none"
        );
        let tiny = drives.levels.iter().find(|drive| **drive > 0.0 && **drive < MIN_DRIVE);
        ensure!(
            tiny.is_none(),
            "`{file}`: --pattern: expected drives of 0 or from {MIN_DRIVE:e} to 1, got {:e}",
            tiny.copied().unwrap_or_default()
        );
        Ok(())
    }

    /// Traces what is missing of the responses, or finds them in `cache`.
    ///
    /// # Errors
    /// Those of a trace; too many bins; an interrupt; a cache that cannot be written.
    pub fn light(&self, cache: &Cache, context: RunContext) -> Result<Array<'_>> {
        let parts = self.parts.as_ref().map(Vec::len);
        let how = (self.model, parts);
        let responses =
            Responses::new(self.design, &self.places, &self.receiver, how, cache, context)?;
        let mut array = Array {
            places: &self.places,
            receiver: &self.receiver,
            responses,
            zones: self.zones,
            step: self.step,
            frame: self.frame,
            parts: self.parts.clone().unwrap_or_else(ChannelLight::whole),
            walls: Walls::new(self.design, &self.places, (self.step, self.frame)),
        };
        array.find_returned();
        Ok(array)
    }

    /// Adds up the responses.
    ///
    /// # Errors
    /// Those of [`Self::light`].
    pub fn dim(
        &self,
        array: &Array,
        pattern: Pattern,
        directly: bool,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Dimmed> {
        let groups = array.responses.groups;
        let mut reference = array.kept_reference(cache, context)?;
        let area = [0, 1].map(|axis| self.places.area_mm(axis));
        // The bound of the bias at full drive, and in the pattern.
        let beyond = reference.beyond.as_ref().map_or(0.0, reference::Beyond::bound_of_mean);
        let light_beyond = if let Some(full) = pattern.full {
            let share = |(lot, of): (usize, &Option<_>)| {
                array.light_off(of.as_ref(), &pattern.drives[full.channel_of(lot)])
            };
            let lots = full.beyond.iter().enumerate();
            full.beyond_light(&lots.map(share).collect::<Vec<LightOff>>())
        } else {
            let share = array.light_off(reference.beyond.as_ref(), &pattern.drives[0]);
            let parts = vec![share.times(reference.white[groups])];
            BeyondLight { parts, of_white: beyond }
        };
        let light = (&array.parts[..], light_beyond);
        let zones = [self.zones, pattern.halo_zones.unwrap_or(self.zones)];
        let panel = PanelBeforeZones::new(self.frame, (zones, area), light, pattern.picture);
        let (shown, hidden) = array.with_pieces(pattern.drives, |pieces| {
            let shown = panel.show(pieces, &reference.white);
            let hidden = pattern.viewing.and_then(|viewing| {
                panel.hidden(pieces, &reference.white, &shown.maps[1].0, viewing)
            });
            (shown, hidden)
        });
        let direct = if directly {
            let packages = array.drives_of_packages(&pattern.drives[0]);
            let driven = (&self.places, &packages[..]);
            let block = direct(self.design, driven, &self.receiver, self.model, cache, context)?;
            let whole = Piece {
                block: &block,
                turn: Turn::default(),
                at: [0; 2],
                within: ANYWHERE,
                weight: 1.0,
            };
            let traced = panel.show(&[vec![whole]], &reference.white);
            Some(distance(&traced.zones[0], &shown.zones[0]))
        } else {
            None
        };
        let factor = self.receiver.factor();
        let without = &reference.white[..groups];
        let white = JackknifedFigure::new(reference.white[groups], without.to_vec()).estimate();
        let zones = [0, 1].map(|k| {
            let one = |(figure, bias): (&JackknifedFigure, &f64)| {
                biased(figure.estimate(), *bias).times(factor)
            };
            shown.zones[k].iter().zip(&shown.bias.zones[k]).map(one).collect()
        });
        let mean = shown.mean().times(factor);
        let halo = shown.halo.map(|[black, bright]| {
            let ratio = |black: f64, bright: f64| black / bright;
            let without = black.without.iter().zip(&bright.without);
            let contrast = JackknifedFigure::new(
                ratio(black.value, bright.value),
                without.map(|(black, bright)| ratio(*black, *bright)).collect(),
            );
            let [of_black, of_bright] = shown.bias.halo;
            let of_ratio = (of_black + contrast.value * of_bright) / bright.value;
            [
                biased(black.estimate(), of_black).times(factor),
                biased(bright.estimate(), of_bright).times(factor),
                biased(contrast.estimate(), of_ratio),
            ]
        });
        let mut maps = shown.maps;
        for ((values, errors), bias) in maps.iter_mut().zip(&shown.bias.bins) {
            for value in values.iter_mut() {
                *value *= factor;
            }
            for (error, bias) in errors.iter_mut().zip(bias) {
                *error = factor * error.hypot(bias / 3f64.sqrt());
            }
        }
        reference.scale(factor);
        let colours = shown.colours.map(|sums| sums.figures(factor));
        Ok(Dimmed {
            responses: array.responses.count(),
            colours,
            maps,
            zones,
            halo,
            hidden,
            mean,
            white: biased(white, beyond * white.value).times(factor),
            reference,
            direct,
        })
    }
}

/// Chi-square and largest difference of two readings of the same zones.
fn distance(traced: &[JackknifedFigure], summed: &[JackknifedFigure]) -> DirectTrace {
    let differences = traced.iter().zip(summed).map(|(a, b)| {
        let error = a.standard_error.hypot(b.standard_error);
        if error > 0.0 { (a.value - b.value).abs() / error } else { 0.0 }
    });
    let differences: Vec<f64> = differences.collect();
    DirectTrace {
        chi_square: differences.iter().map(|d| d * d).sum(),
        largest: differences.iter().copied().fold(0.0, f64::max),
    }
}

/// Light of zones of one kind.
struct Shared {
    block: Block,
    /// First bin of the zone that it was summed for.
    at: [isize; 2],
    /// That zone.
    first: [usize; 2],
}

/// Responses at the places of an array.
pub struct Array<'a> {
    places: &'a Places,
    receiver: &'a MapReceiver<'a>,
    responses: Responses,
    zones: [usize; 2],
    step: [usize; 2],
    frame: Frame,
    /// Parts of the light, at full drive.
    parts: Vec<ChannelLight>,
    walls: Walls,
}

impl Array<'_> {
    /// Columns and rows of the packages in a zone.
    fn dealt(&self, [i, j]: [usize; 2]) -> &[[usize; 2]] {
        &self.places.packages_by_zone()[j * self.zones[0] + i]
    }

    fn zone_cells(&self, axis: usize) -> Cells {
        let [low_mm, length_mm] = self.places.area_mm(axis);
        Cells { low_mm, length_mm, count: self.zones[axis] }
    }

    /// Drives of packages in columns and rows.
    fn drives_of_packages(&self, drives: &[f64]) -> Vec<f64> {
        let mut of_packages = vec![0.0; self.places.count()];
        for (packages, drive) in self.places.packages_by_zone().iter().zip(drives) {
            for [i, j] in packages {
                of_packages[j * self.places.whole[0] + i] = *drive;
            }
        }
        of_packages
    }

    /// Traced columns and rows that stand for the packages of a zone.
    fn stand_ins(&self, zone: [usize; 2]) -> Vec<[usize; 2]> {
        let stand_in = |package: &[usize; 2]| [0, 1].map(|k| self.places.stand_in(k, package[k]));
        self.dealt(zone).iter().map(stand_in).collect()
    }

    /// Light of the packages of a zone in a part, as of an endless array.
    fn endless_pieces(&self, zone: [usize; 2], part: usize) -> Vec<Piece<'_>> {
        let piece = |(package, traced): (&[usize; 2], [usize; 2])| {
            let step = self.step.map(|step| step as isize);
            let at = [0, 1].map(|k| (package[k] as isize - traced[k] as isize) * step[k]);
            Piece { at, ..self.responses.at(traced, part) }
        };
        self.dealt(zone).iter().zip(self.stand_ins(zone)).map(piece).collect()
    }

    /// Light of the packages of a zone in a part.
    fn zone_pieces(&self, zone: [usize; 2], part: usize, weight: f64) -> Vec<Piece<'_>> {
        let pieces = self.endless_pieces(zone, part).into_iter();
        pieces.flat_map(|piece| self.walls.folded(Piece { weight, ..piece }, part)).collect()
    }

    /// All parts together by their luminance.
    fn luminous<'p>(&self, parts: impl IntoIterator<Item = Vec<Piece<'p>>>) -> Vec<Piece<'p>> {
        let weighted = parts.into_iter().zip(&self.parts).flat_map(|(pieces, part)| {
            let y = part.xyz[1];
            pieces.into_iter().map(move |piece| Piece { weight: y * piece.weight, ..piece })
        });
        weighted.collect()
    }

    /// Hands the light of zones at these drives of each channel to `read`, part by part: zones of one
    /// kind, which differ by a shift alone, are summed once.
    fn with_pieces<T>(&self, drives: &[Vec<f64>], read: impl FnOnce(&[Vec<Piece>]) -> T) -> T {
        let all = 0..self.zones[0] * self.zones[1];
        let lit = all.filter(|k| drives.iter().any(|drives| drives[*k] > 0.0));
        let lit: Vec<(usize, [usize; 2])> =
            lit.map(|k| (k, [k % self.zones[0], k / self.zones[0]])).collect();
        let mut kinds: BTreeMap<Vec<[usize; 2]>, Vec<[usize; 2]>> = BTreeMap::new();
        for (_, zone) in &lit {
            kinds.entry(self.stand_ins(*zone)).or_default().push(*zone);
        }
        let mut left = MAX_SHARED;
        let mut shared: BTreeMap<Vec<[usize; 2]>, Vec<Shared>> = BTreeMap::new();
        let groups = self.responses.groups;
        for (kind, zones) in kinds {
            if zones.len() < 2 || kind.len() < 2 {
                continue;
            }
            let first = zones[0];
            let of_part = |part: usize| {
                let (block, at) = sum_of(&self.endless_pieces(first, part), groups);
                Shared { block, at, first }
            };
            let one = of_part(0);
            let bytes = 8 * groups * one.block.bins[0] * one.block.bins[1] * self.parts.len();
            if bytes > left {
                break;
            }
            left -= bytes;
            let others = (1..self.parts.len()).map(of_part);
            shared.insert(kind, std::iter::once(one).chain(others).collect());
        }
        let mut pieces = vec![Vec::new(); self.parts.len()];
        for (number, zone) in lit {
            let kind = shared.get(&self.stand_ins(zone));
            for (k, part) in self.parts.iter().enumerate() {
                let weight = drives[part.channel][number];
                match kind.map(|kind| &kind[k]) {
                    _ if weight <= 0.0 => {}
                    Some(Shared { block, at, first }) => {
                        let begin =
                            |k: usize, zone| (self.dealt(zone)[0][k] * self.step[k]) as isize;
                        let at = [0, 1].map(|k| at[k] + begin(k, zone) - begin(k, *first));
                        let turn = Turn::default();
                        let piece = Piece { block, turn, at, within: ANYWHERE, weight };
                        pieces[k].extend(self.walls.folded(piece, k));
                    }
                    None => pieces[k].extend(self.zone_pieces(zone, k, weight)),
                }
            }
        }
        read(&pieces)
    }

    /// Full drive of all channels.
    fn full_drive(&self) -> Vec<Vec<f64>> {
        let channels = self.parts.iter().map(|part| part.channel).max().unwrap_or(0) + 1;
        vec![vec![1.0; self.zones[0] * self.zones[1]]; channels]
    }

    /// The figures that do not depend on a pattern, from the cache or computed.
    fn kept_reference(&self, cache: &Cache, context: RunContext) -> Result<Reference> {
        let luminous: Vec<f64> = self.parts.iter().map(|part| part.xyz[1]).collect();
        self.kept(&json!(luminous), cache, context, || self.reference())
    }

    /// What follows from the responses, and from `more` that is stated, from the cache or computed.
    fn kept<T: Serialize + DeserializeOwned>(
        &self,
        more: &Value,
        cache: &Cache,
        context: RunContext,
        compute: impl FnOnce() -> T,
    ) -> Result<T> {
        let store = Store::lasting(cache.directory(), FOLDER, context.console);
        let mut fields = json!({
            "responses": self.responses.key.hex(),
            "packages": self.places.whole,
            "zones": self.zones,
            "bins": self.frame.bins,
        });
        // All light has the fields of designs without colours.
        if *more != json!([1.0]) {
            fields["of"] = more.clone();
        }
        let entries = store.entries(Key::of(&fields));
        if let Some(known) = entries.find_value(0) {
            return Ok(known);
        }
        let computed = compute();
        entries.keep_value(0, &computed)?;
        Ok(computed)
    }
}
