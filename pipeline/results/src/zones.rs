// SPDX-License-Identifier: MIT OR Apache-2.0
//! `zones.json` as a file: a backlight with dimming zones, and what a panel before it shows.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use metrics::figures::OF_RECEIVER;
use metrics::quantity::{Quantity, Unit};
use runtime::provenance::FileRecord;

use crate::figure_entry::FigureEntry;
use crate::sealed_file::SealedFile;
use crate::shown;

/// File under the directory of results.
pub const FILE: &str = "zones.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 1;
/// Table of the light of one zone.
pub const SPREAD: &str = "light_spread.csv";
/// Files of the maps, without their endings: backlight, and light behind the panel.
pub const MAPS: [&str; 2] = ["backlight", "panel"];
/// Pictures in colour, where there are such, without their ending: picture, backlight and panel as
/// they look beside D65; ΔE_ITP of what the panel shows where the picture is black; that of what it
/// shows against the picture.
pub const COLOUR_PICTURES: [&str; 3] = ["seen", "halo", "error"];
/// Table of several pictures.
pub const FILM_TABLE: &str = "film.csv";
/// Folder of what the panel shows of them.
pub const FILM_FOLDER: &str = "film";

/// Figures in [`FILM_TABLE`] where the receiver reads this `light`; all but the first have errors.
pub fn film_figures(light: &Quantity) -> [Quantity; 7] {
    let of_light = |name: &str| Quantity::new(format!("{name} {}", light.name()), light.unit());
    let share = |name: &str| Quantity::new(name, Unit::Fraction);
    [
        share("power share"),
        of_light("panel mean"),
        of_light("panel largest zone"),
        of_light("halo black"),
        share("halo contrast"),
        share("missing"),
        share("leaking"),
    ]
}

/// The whole file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ZonesFile {
    /// Version of the layout, 1.
    pub schema_version: u32,
    /// Version of the program that wrote it.
    pub version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// Files that came out.
    pub files: Vec<FileRecord>,
    /// Name of the design.
    pub design: String,
    /// Key of the model.
    pub model: String,
    /// Receiver that was read: `plane` or the name of one of `[[receivers]]`.
    pub receiver: String,
    /// Quantity of all levels.
    pub quantity: String,
    /// Unit of all levels.
    pub unit: String,
    /// Columns and rows of packages; of packages in no rows their number and 1.
    pub packages: [usize; 2],
    /// True of packages in no rows: their number and 1.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free_places: bool,
    /// Columns and rows of the packages among which responses were traced.
    pub traced_packages: [usize; 2],
    /// Columns and rows of zones.
    pub zones: [usize; 2],
    /// Paths of each response.
    pub paths: u64,
    /// Number of responses.
    pub responses: usize,
    /// Light of an inner package that its response does not show in place: `packages` to the walls of the
    /// traced array; the `share` beyond them, null where it does not fall off; and what lies wrong beside
    /// `walls` that packages are moved to, null where none is. All are null where all packages are traced.
    pub beyond_reach: Option<BeyondReach>,
    /// Contrast of the panel: largest over smallest transmittance.
    pub contrast: f64,
    /// Mean of the backlight over the panel at full drive.
    pub white: FigureEntry,
    /// Figures of the backlight at full drive, by keys of receivers, of bins at least half on the
    /// panel; a `bias_bound` is that of `beyond_reach`.
    pub uniformity: BTreeMap<String, FigureEntry>,
    /// Groups of paths behind the errors of extremes in `uniformity`: 64, or 16 of maps of more
    /// than 312 500 bins.
    pub groups_of_extremes: usize,
    /// Means of `black` bins beside bright ones and of the `bright` ones; `contrast`, the first over the
    /// second; with `--distance` what of the halo is `hidden`. Null without black beside bright.
    pub halo: Option<Halo>,
    /// Light of the zone nearest to the middle: `zone` (column from the left, row from the top, from 1),
    /// `centre_mm`, and `radii`. Each of these has the `share` of the largest ring and `radius_mm`, null
    /// where the rings do not tell.
    pub light_spread: LightSpread,
    /// With `--direct`, comparison with a trace of the pattern itself: number of `zones`,
    /// `chi_square`, and the `largest` difference in standard errors.
    pub direct: Option<Direct>,
    /// Of designs with channels or a panel of sub-pixels: levels of the `channels` at full drive, `white` of
    /// the panel there, `gamut` of its primaries; of the pattern `power_share` and `power_w`, light that is
    /// `missing` and `leaking`, `halo_itp` and `halo_uv`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<ColourEntry>,
    /// With `--compare-zones`, the same picture in each number of `zones`, the fewest first: `contrast` and
    /// `hidden` of its halo, in or beside the bright ones of the fewest zones, light that is `missing`,
    /// `power_share`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub by_zones: Vec<ZoneCount>,
    /// The fewest zones of `by_zones` from which on the eye hides the halo: `surely` and `possibly`, two
    /// standard errors and the bounds apart; null where none does. Absent without `--distance`, and without
    /// a halo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub halo_hidden_from: Option<HiddenFrom>,
}

impl SealedFile for ZonesFile {
    const FILE: &'static str = FILE;
    const VERSION: u32 = SCHEMA_VERSION;
    const WORK: &'static str = "sum of zones";
    const AGAIN: &'static str = "run zones again";

    fn files(&self) -> &[FileRecord] {
        &self.files
    }
}

impl ZonesFile {
    /// Names and values for people.
    pub fn lines(&self) -> Vec<(String, String)> {
        let unit = Unit::from_name(&self.unit).unwrap_or(Unit::Relative);
        let size = |[columns, rows]: [usize; 2]| format!("{columns} x {rows}");
        let packages = match self.packages {
            [count, _] if self.free_places => format!("of {count} packages"),
            packages => format!("of {} packages", size(packages)),
        };
        let mut responses =
            format!("{} {packages}; {} responses", size(self.zones), self.responses);
        if self.beyond_reach.is_some() {
            write!(responses, ", traced among {}", size(self.traced_packages)).unwrap_or_default();
        }
        let mut lines = vec![("zones".to_owned(), responses)];
        let mut line = |name: String, words: String| lines.push((name, words));
        if let Some(BeyondReach { packages, share, walls }) = &self.beyond_reach {
            let words = |share| shown::text(share, Unit::Fraction);
            let share = share.as_ref().map_or_else(|| "does not fall off".to_owned(), words);
            line(format!("light beyond {packages} packages"), share);
            if let Some(walls) = walls {
                line("light wrong beside walls".to_owned(), shown::text(walls, Unit::Fraction));
            }
        }
        line(format!("{} at full drive, mean", self.quantity), shown::text(&self.white, unit));
        for figure in OF_RECEIVER.into_iter().filter(|figure| figure.unit == Unit::Fraction) {
            if let Some(entry) = self.uniformity.get(figure.key) {
                let value = shown::text(entry, Unit::Fraction);
                line(format!("at full drive, {}", figure.label), value);
            }
        }
        for Radius { share, radius_mm } in &self.light_spread.radii {
            let words = |radius| shown::text(radius, Unit::Millimetre);
            let radius = radius_mm.as_ref().map_or_else(|| "not reached".to_owned(), words);
            line(format!("light of one zone, {} % at", 100.0 * share), radius);
        }
        match &self.halo {
            Some(halo) => {
                line("black beside bright".to_owned(), shown::text(&halo.black, unit));
                line("bright".to_owned(), shown::text(&halo.bright, unit));
                let contrast = shown::text(&halo.contrast, Unit::Relative);
                line("halo contrast".to_owned(), contrast);
                if let Some((hidden, eye)) = halo.hidden.as_ref().zip(halo.viewing) {
                    let name = format!("halo hidden by the eye at {} mm", eye.distance_mm);
                    line(name, shown::text(hidden, Unit::Fraction));
                }
            }
            None => line("halo contrast".to_owned(), "no black beside bright".to_owned()),
        }
        if let Some(colour) = &self.colour {
            colour.lines(unit, &mut line);
            let is_drawn = |k: usize| {
                let name = format!("{}.png", COLOUR_PICTURES[k]);
                self.files.iter().any(|file| file.file == name)
            };
            if is_drawn(2) && !is_drawn(1) {
                line(
                    "picture of the halo".to_owned(),
                    "none: no light where the picture is black".to_owned(),
                );
            }
        }
        for (name, words) in self.by_zones.iter().map(ZoneCount::line) {
            line(name, words);
        }
        if let Some(hidden) = &self.halo_hidden_from {
            let name = format!("{} % of the halo hidden from", 100.0 * hidden.share);
            line(name, hidden.words(&self.by_zones));
        }
        if let Some(direct) = &self.direct {
            let words = format!(
                "chi-square {:.1} over {} zones, at most {:.1} standard errors off",
                direct.chi_square, direct.zones, direct.largest
            );
            line("direct trace".to_owned(), words);
        }
        lines
    }
}

/// A picture in so many zones.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ZoneCount {
    /// Columns and rows.
    pub zones: [usize; 2],
    /// As [`Halo::contrast`]; null without black beside bright.
    pub contrast: Option<FigureEntry>,
    /// As [`Halo::hidden`]; null without `--distance`.
    pub hidden: Option<FigureEntry>,
    /// As [`ColourEntry::missing`]; null without colours.
    pub missing: Option<FigureEntry>,
    /// Power over that of full white.
    pub power_share: f64,
}

impl ZoneCount {
    fn count(&self) -> usize {
        self.zones.iter().product()
    }

    /// Name and values for people.
    fn line(&self) -> (String, String) {
        let fraction = |entry: &FigureEntry| shown::text(entry, Unit::Fraction);
        let mut parts = vec![format!("power {:.2} %", 100.0 * self.power_share)];
        let contrast = self.contrast.as_ref().map(|entry| shown::text(entry, Unit::Relative));
        // Other places than those of the halo in the file's own zones.
        parts.extend(
            contrast.map(|contrast| format!("halo in the same places: contrast {contrast}")),
        );
        parts.extend(self.hidden.as_ref().map(|entry| format!("hidden {}", fraction(entry))));
        parts.extend(self.missing.as_ref().map(|entry| format!("missing {}", fraction(entry))));
        let [columns, rows] = self.zones;
        (format!("in {columns} x {rows} zones"), parts.join(", "))
    }
}

/// Number of zones from which on a halo is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct HiddenFrom {
    /// Share of its light that is enough, [`Self::ENOUGH`].
    pub share: f64,
    /// The fewest zones whose share is that or more by two standard errors and its bounds, as are those of
    /// all larger numbers; null where none is.
    pub surely: Option<usize>,
    /// The fewest that may be by these errors; null where none is.
    pub possibly: Option<usize>,
}

impl HiddenFrom {
    /// Share of a halo that is hidden where little of it shows. Chosen.
    pub const ENOUGH: f64 = 0.95;

    /// Of numbers of zones, the fewest first; `None` where one has no share.
    pub fn new(by_zones: &[ZoneCount]) -> Option<Self> {
        let shares = by_zones.iter().map(|of| Some((of.count(), of.hidden?)));
        let shares = shares.collect::<Option<Vec<_>>>().filter(|all| !all.is_empty())?;
        let from = |side: f64| {
            let is_enough = |entry: &FigureEntry| {
                let of_chance = entry.value + side * 2.0 * entry.standard_error;
                let [low, high] = entry.ends().unwrap_or([of_chance; 2]);
                let end = if side > 0.0 { of_chance.max(high) } else { of_chance.min(low) };
                end >= Self::ENOUGH
            };
            let failing = shares.iter().rev().find(|(_, entry)| !is_enough(entry));
            let most = failing.map_or(0, |(count, _)| *count);
            shares.iter().map(|(count, _)| *count).find(|count| *count > most)
        };
        Some(Self { share: Self::ENOUGH, surely: from(-1.0), possibly: from(1.0) })
    }

    /// Words for people: between two of the numbers of `by_zones`.
    fn words(&self, by_zones: &[ZoneCount]) -> String {
        let below = |most: Option<usize>| {
            let counts = by_zones.iter().map(ZoneCount::count);
            counts.filter(|count| most.is_none_or(|most| *count < most)).max()
        };
        match (below(self.possibly), self.surely) {
            (Some(least), Some(most)) => format!("more than {least}, at most {most} zones"),
            (None, Some(most)) => format!("at most {most} zones"),
            (Some(least), None) => format!("more than {least} zones"),
            (None, None) => "not resolved".to_owned(),
        }
    }
}

/// Light of an inner package beyond the traced ones.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct BeyondReach {
    /// Packages from the inner one to the walls of the traced array.
    pub packages: usize,
    /// Share of its light; null where it does not fall off.
    pub share: Option<FigureEntry>,
    /// Light that lies wrong beside the walls of the whole array, over the mean at full drive: what walls
    /// send back is found from packages near them, and this is the error for another. Null where no light
    /// is moved towards walls.
    #[serde(default)]
    pub walls: Option<FigureEntry>,
}

/// Black bins of the picture in or beside zones with its brightest bins, and these.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct Halo {
    /// Mean of black bins.
    pub black: FigureEntry,
    /// Mean of the brightest bins.
    pub bright: FigureEntry,
    /// The first over the second.
    pub contrast: FigureEntry,
    /// Share of the black bins' light below the veil that the eye's own glare lays there (CIE 146).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hidden: Option<FigureEntry>,
    /// The eye, of `hidden`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viewing: Option<ViewingEntry>,
}

/// An eye before the middle of the panel.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ViewingEntry {
    /// Distance, mm.
    pub distance_mm: f64,
    /// Age, years.
    pub age_years: f64,
    /// Pigment: 0 black, 0.5 brown, 1.2 light blue.
    pub pigment: f64,
}

/// Light of the zone nearest to the middle.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct LightSpread {
    /// Column from the left and row from the top, from 1.
    pub zone: [usize; 2],
    /// Its middle, mm.
    pub centre_mm: [f64; 2],
    /// Radii of shares of the largest ring.
    pub radii: Vec<Radius>,
}

/// Where a zone's light has fallen to a share.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct Radius {
    /// Share of the largest ring.
    pub share: f64,
    /// Radius, mm; `None` where the rings do not tell.
    pub radius_mm: Option<FigureEntry>,
}

/// Distance of a trace of the pattern itself from the superposition, in the means of the zones.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct Direct {
    /// Number of zones.
    pub zones: usize,
    /// Sum of squared differences in squared standard errors.
    pub chi_square: f64,
    /// Largest difference in standard errors.
    pub largest: f64,
}

/// Colours of channels and panel.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ColourEntry {
    /// Channels in the order of the design.
    pub channels: Vec<ChannelEntry>,
    /// All of them at these levels, behind the open panel.
    pub white: ColourOfLight,
    /// x and y of `--white`; null where all channels are at 1, so that the powers of the sources make
    /// the white.
    pub stated_white: Option<[f64; 2]>,
    /// Largest Δu'v' of it between cells of a twelfth of the panel's sides, or bins that are larger;
    /// null of a dark one.
    pub white_difference: Option<FigureEntry>,
    /// Primaries and transfer of the picture: `BT.709, sRGB` or `grey, linear`; null of a panel without
    /// sub-pixels.
    pub picture: Option<String>,
    /// Luminance of the white of `panel_picture.png`, its largest level.
    pub exposure: Option<f64>,
    /// Gamut of the primaries as displayed at full drive, over that of each standard.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gamut: Vec<GamutEntry>,
    /// How the picture gives the drives of the zones.
    pub levels: Option<LevelsEntry>,
    /// Power of the pattern over that at full drive of all channels at their levels.
    pub power_share: f64,
    /// The same in W, where `led.electrical_w` states that of a package with all channels at
    /// full drive, shared among them by the light that they emit.
    pub power_w: Option<f64>,
    /// With `--test-patterns`, a window of 10 % of the area, a single zone, a checkerboard of zones, a grey
    /// ramp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test_patterns: Option<TestPatterns>,
    /// Luminance that the picture asks for and the panel does not show, over all that it asks for;
    /// null where it asks for none.
    pub missing: Option<FigureEntry>,
    /// Luminance that the panel shows beyond what is asked for, likewise.
    pub leaking: Option<FigureEntry>,
    /// Largest ΔE_ITP (ITU-R BT.2124) from black of the mean black of a zone beside bright; null
    /// without any, and in units that are not absolute.
    pub halo_itp: Option<FigureEntry>,
    /// ΔE_ITP from black of the panel's own black at full drive, below which a halo shows little; null
    /// without sub-pixels, and in units that are not absolute.
    pub black_itp: Option<FigureEntry>,
    /// Largest Δu'v' of the same from white; null without any, and without sub-pixels.
    pub halo_uv: Option<FigureEntry>,
}

/// Test patterns. Zones of white and black are at 1 where they hold any white and at 0 elsewhere.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct TestPatterns {
    /// A white window of 10 % of the area, in the middle and of its shape.
    pub window: LitPattern,
    /// The white zone nearest to the middle.
    pub zone: LitPattern,
    /// Mean black over mean white of zones that are white and black by turns; null of a single zone.
    pub checkerboard: Option<FigureEntry>,
    /// Largest Δu'v' from white of a grey ramp: up to 12 equal steps of columns of zones, driven by the
    /// greys that they show, which rise to white; null of a single column of zones.
    pub grey_ramp: Option<FigureEntry>,
}

/// White on black.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct LitPattern {
    /// Mean of the bins that lie whole in the white; null of no such bin or no black beside it.
    pub luminance: Option<FigureEntry>,
    /// Power over that of full white.
    pub power_share: f64,
    /// The same in W, as of the pattern.
    pub power_w: Option<f64>,
}

/// A channel.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ChannelEntry {
    /// Name.
    pub name: String,
    /// Level at full drive, of which the largest is 1: that channel limits the light of white.
    pub level: f64,
    /// Its light alone at that level, behind the open panel.
    pub light: ColourOfLight,
}

/// A colour and its luminance.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ColourOfLight {
    /// x and y (CIE 1931); null of light that no eye sees.
    pub xy: Option<[FigureEntry; 2]>,
    /// u' and v' (CIE 1976); null likewise.
    pub uv: Option<[FigureEntry; 2]>,
    /// Correlated colour temperature, K; null where it names no colour.
    pub cct: Option<FigureEntry>,
    /// Distance from the Planckian locus.
    pub duv: Option<FigureEntry>,
    /// Luminance or illuminance.
    pub luminance: FigureEntry,
}

/// Gamut over that of a standard.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct GamutEntry {
    /// Name of the standard.
    pub standard: String,
    /// Area and coverage in x, y.
    pub xy: [FigureEntry; 2],
    /// Area and coverage in u', v'.
    pub uv: [FigureEntry; 2],
}

/// How a picture gives the drives of zones.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct LevelsEntry {
    /// `max`, `mean`, `rms` or `percentile=P` of what the pixels of a zone need.
    pub rule: String,
    /// Rows of N: a pixel needs the drives max(0, min(1, N XYZ)), with Y = 1 for white.
    pub matrix: [[f64; 3]; 3],
    /// True if each row is that of a channel; else all channels need the largest of the three.
    pub by_channel: bool,
    /// Largest `power_share`.
    pub power_limit: f64,
}

impl ColourOfLight {
    fn xy_text(&self) -> String {
        let words = |v: &FigureEntry| shown::text(v, Unit::Relative);
        let both = |[x, y]: &[FigureEntry; 2]| format!("x {}, y {}", words(x), words(y));
        self.xy.as_ref().map_or_else(|| "dark".to_owned(), both)
    }
}

impl ColourEntry {
    /// Names and values for people.
    fn lines(&self, unit: Unit, line: &mut impl FnMut(String, String)) {
        for channel in &self.channels {
            let luminance = shown::text(&channel.light.luminance, unit);
            let words =
                format!("level {:.4}, {}, {luminance}", channel.level, channel.light.xy_text());
            line(format!("channel {}", channel.name), words);
        }
        let of_powers = ", of all channels at 1, by the powers of the sources";
        let made = if self.stated_white.is_some() { "" } else { of_powers };
        line("white behind the panel".to_owned(), format!("{}{made}", self.white.xy_text()));
        if let (Some(cct), Some(duv)) = (&self.white.cct, &self.white.duv) {
            let [cct, duv] =
                [(cct, Unit::Kelvin), (duv, Unit::Relative)].map(|(v, u)| shown::text(v, u));
            line("its temperature, Duv".to_owned(), format!("{cct}, {duv}"));
        }
        let luminance = shown::text(&self.white.luminance, unit);
        line("its luminance".to_owned(), luminance);
        for (name, entry) in [
            ("white over the panel, Δu'v'", &self.white_difference),
            ("halo against white, Δu'v'", &self.halo_uv),
        ] {
            if let Some(entry) = entry {
                line(name.to_owned(), shown::text(entry, Unit::Relative));
            }
        }
        for GamutEntry { standard, xy, uv } in &self.gamut {
            let [xy, uv] = [xy, uv].map(|[_, coverage]| shown::text(coverage, Unit::Fraction));
            line(format!("coverage of {standard}"), format!("x, y {xy}; u', v' {uv}"));
        }
        let watts = self.power_w.map_or_else(String::new, |w| format!(", {w:.4} W"));
        line(
            "power of the pattern".to_owned(),
            format!("{:.2} % of full white{watts}", 100.0 * self.power_share),
        );
        for (name, entry) in [("missing light", &self.missing), ("leaking light", &self.leaking)] {
            if let Some(entry) = entry {
                line(name.to_owned(), shown::text(entry, Unit::Fraction));
            }
        }
        for (name, entry) in [
            ("halo, largest difference (ITP)", &self.halo_itp),
            ("black at full drive (ITP)", &self.black_itp),
        ] {
            if let Some(entry) = entry {
                line(name.to_owned(), shown::text(entry, Unit::Relative));
            }
        }
        if let Some(TestPatterns { window, zone, checkerboard, grey_ramp }) = &self.test_patterns {
            for (name, lit) in [("window of 10 %", window), ("a single zone", zone)] {
                let luminance = lit.luminance.as_ref();
                let luminance =
                    luminance.map_or_else(|| "no bin".to_owned(), |l| shown::text(l, unit));
                let watts = lit.power_w.map_or_else(String::new, |w| format!(", {w:.4} W"));
                let share = 100.0 * lit.power_share;
                line(name.to_owned(), format!("{luminance}, {share:.2} % of full white{watts}"));
            }
            if let Some(contrast) = checkerboard {
                let words = shown::text(contrast, Unit::Relative);
                line("checkerboard, black over white".to_owned(), words);
            }
            if let Some(shift) = grey_ramp {
                let words = shown::text(shift, Unit::Relative);
                line("grey ramp, Δu'v' from white".to_owned(), words);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use metrics::Estimate;

    use super::*;

    #[test]
    fn a_halo_is_hidden_from_the_number_that_errors_allow() {
        let of = |shares: &[(f64, f64)]| {
            let one = |(k, (value, error)): (usize, &(f64, f64))| ZoneCount {
                zones: [k + 1, 10],
                contrast: None,
                hidden: Some(FigureEntry::share(Estimate::new(*value, *error))),
                missing: None,
                power_share: 1.0,
            };
            let all: Vec<_> = shares.iter().enumerate().map(one).collect();
            let found = HiddenFrom::new(&all).expect("shares");
            (found.possibly, found.surely, found.words(&all))
        };
        let more = |words: &str| words.to_owned();
        let clear = of(&[(0.5, 0.01), (0.8, 0.01), (0.97, 0.004), (0.99, 0.001)]);
        assert_eq!(clear, (Some(30), Some(30), more("more than 20, at most 30 zones")));
        // More zones that hide less: from behind them alone.
        let back = of(&[(0.99, 0.001), (0.9, 0.001), (0.99, 0.001)]);
        assert_eq!(back, (Some(30), Some(30), more("more than 20, at most 30 zones")));
        let noisy = of(&[(0.5, 0.01), (0.94, 0.01), (0.96, 0.01), (0.99, 0.001)]);
        assert_eq!(noisy, (Some(20), Some(40), more("more than 10, at most 40 zones")));
        let open = of(&[(0.5, 0.01), (0.94, 0.01)]);
        assert_eq!(open, (Some(20), None, more("more than 10 zones")));
        let none = of(&[(0.5, 0.01), (0.7, 0.01)]);
        assert_eq!(none, (None, None, more("more than 20 zones")));
        let few = of(&[(0.99, 0.001), (0.99, 0.001)]);
        assert_eq!(few, (Some(10), Some(10), more("at most 10 zones")));
        assert_eq!(of(&[(0.94, 0.1)]), (Some(10), None, more("not resolved")));
        // As many zones in another shape count together.
        let count = |columns: usize, value: f64| ZoneCount {
            zones: [columns, 12 / columns],
            contrast: None,
            hidden: Some(FigureEntry::share(Estimate::new(value, 0.001))),
            missing: None,
            power_share: 1.0,
        };
        for shapes in [[count(3, 0.99), count(4, 0.9)], [count(4, 0.9), count(3, 0.99)]] {
            assert_eq!(HiddenFrom::new(&shapes).expect("shares").surely, None);
        }
        assert!(HiddenFrom::new(&[]).is_none());
    }
}
