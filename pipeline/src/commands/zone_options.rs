// SPDX-License-Identifier: MIT OR Apache-2.0
//! Options of `batwing zones` with their parsers.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use metrics::chromaticity;
use metrics::gamut::{BT709, BT2020, DCI_P3, Primaries};
use metrics::glare::{Observer, Viewing};
use metrics::transfer::Transfer;
use zones::levels::Rule;

use super::arguments::{ModelChoice, paths};

/// Shares of the power of full white.
const SHARES: RangeInclusive<f64> = f64::MIN_POSITIVE..=1.0;

/// `batwing zones`.
#[derive(Debug, Args)]
pub struct ZonesArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Drives of the zones from 0 to 1: rows of numbers, or a PNG; the first row is the top. Once for
    /// all channels, or CHANNEL=FILE for each
    #[arg(long, value_name = "FILE", required_unless_present = "levels")]
    pub pattern: Vec<String>,
    /// White of the panel at full drive, which the levels of three channels give with the most light:
    /// x and y, or a temperature of daylight, below 4000K of a radiator [default: all channels at 1]
    #[arg(long, value_name = "X,Y|KELVIN", allow_hyphen_values = true, value_parser = white)]
    pub white: Option<[f64; 2]>,
    /// Drives from the picture in place of a pattern: max, mean, rms or percentile=P of what the
    /// pixels of a zone need
    #[arg(
        long,
        value_name = "RULE",
        requires = "picture",
        conflicts_with = "pattern",
        value_parser = rule
    )]
    pub levels: Option<Rule>,
    /// Largest power of these drives over that of full white, which lowers them all
    #[arg(long, value_name = "SHARE", requires = "levels", default_value_t = 1.0, value_parser = within(SHARES, "a share of full white above 0, up to 1"))]
    pub power_limit: f64,
    /// Zones, which divide the packages evenly [default: one for each package]
    #[arg(
        long,
        value_name = "COLUMNSxROWS",
        allow_hyphen_values = true,
        value_parser = columns_and_rows
    )]
    pub zones: Option<[usize; 2]>,
    /// Another number of zones in which the same picture is compared, with --picture and --levels; once
    /// for each
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = columns_and_rows)]
    pub compare_zones: Vec<[usize; 2]>,
    /// Packages of a larger array, for which those of the design stand [default: those of the
    /// design]
    #[arg(
        long,
        value_name = "COLUMNSxROWS",
        allow_hyphen_values = true,
        value_parser = columns_and_rows
    )]
    pub packages: Option<[usize; 2]>,
    /// Plane or luminance receiver of the design [default: the plane of `[receiver]`]
    #[arg(long, value_name = "NAME")]
    pub receiver: Option<String>,
    /// Largest over smallest transmittance of the panel [default: that of `panel`, else 5000]
    #[arg(long, value_name = "C", value_parser = within(1.0..=f64::MAX, "a number of at least 1"))]
    pub contrast: Option<f64>,
    /// Picture that the panel shows, in a form of the pattern and of any size, with sub-pixels in
    /// colours; of a folder all PNG files by name [default: the pattern]
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Light of the levels of a picture on sub-pixels: srgb, linear, pq or gamma=G [default: that of
    /// the file, else srgb; linear of grey that states none]
    #[arg(long, value_name = "NAME", value_parser = transfer)]
    pub transfer: Option<Transfer>,
    /// Primaries of a picture on sub-pixels [default: those of the file, else bt709]
    #[arg(long, value_enum)]
    pub gamut: Option<PictureGamut>,
    /// Distance of an eye before the middle of the panel, mm, whose own glare hides a part of the halo
    #[arg(long, value_name = "MM", value_parser = within(10.0..=1e6, "millimetres from 10 to 1e6"))]
    pub distance: Option<f64>,
    /// Its age, years
    #[arg(long, value_name = "YEARS", requires = "distance", default_value_t = 25.0, value_parser = within(0.0..=120.0, "years from 0 to 120"))]
    pub age: f64,
    /// Its pigment: 0 black, 0.5 brown, 1.2 light blue
    #[arg(long, value_name = "P", requires = "distance", default_value_t = 0.5, value_parser = within(0.0..=1.2, "a number from 0 (black) to 1.2 (light blue)"))]
    pub pigment: f64,
    /// Also show a white window of 10 % of the area, a single zone, a checkerboard of zones and a grey
    /// ramp
    #[arg(long)]
    pub test_patterns: bool,
    /// How to compute the responses
    #[arg(long, value_enum, default_value = "geometric")]
    pub model: ModelChoice,
    /// Paths of each response, instead of the design's trace.paths
    #[arg(long, value_name = "N", value_parser = paths)]
    pub paths: Option<u64>,
    /// Also trace the pattern itself, and compare
    #[arg(long, conflicts_with_all = ["packages", "compare_zones"])]
    pub direct: bool,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "zones")]
    pub out: PathBuf,
    /// Directory that keeps responses for later patterns [default: .batwing-cache beside the
    /// results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

impl ZonesArgs {
    /// The eye that looks, if its distance is stated.
    pub fn viewing(&self) -> Option<Viewing> {
        let observer = Observer { age_years: self.age, pigment: self.pigment };
        self.distance.map(|distance_mm| Viewing { distance_mm, observer })
    }
}

/// Primaries of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PictureGamut {
    /// BT.709 and sRGB
    Bt709,
    /// DCI-P3 and Display P3
    DciP3,
    /// BT.2020 and BT.2100
    Bt2020,
}

impl PictureGamut {
    /// Its primaries.
    pub fn primaries(self) -> Primaries {
        match self {
            Self::Bt709 => BT709,
            Self::DciP3 => DCI_P3,
            Self::Bt2020 => BT2020,
        }
    }
}

/// A parser of columns and rows: `48x27`.
pub fn columns_and_rows(text: &str) -> Result<[usize; 2], String> {
    let number = |text: &str| text.trim().parse().ok().filter(|n: &usize| (1..=10_000).contains(n));
    let both = text.split_once(['x', 'X', '×', ',']);
    let both = both.and_then(|(columns, rows)| Some([number(columns)?, number(rows)?]));
    both.ok_or_else(|| "expected columns and rows from 1 to 10000, such as 48x27".to_owned())
}

/// A parser of numbers within `range`, which messages call so.
fn within(
    range: RangeInclusive<f64>,
    expected: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text: &str| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("expected {expected}"))
    }
}

/// A parser of whites: `0.3127,0.3290` or `6504K`.
pub fn white(text: &str) -> Result<[f64; 2], String> {
    let found = match text.strip_suffix(['K', 'k']) {
        Some(kelvin) => kelvin.trim().parse().ok().and_then(chromaticity::white_of),
        None => text.split_once(',').and_then(|(x, y)| {
            let [x, y]: [Option<f64>; 2] = [x, y].map(|number| number.trim().parse().ok());
            Some([x?, y?]).filter(|[x, y]| *x > 0.0 && *y > 0.0 && x + y < 1.0)
        }),
    };
    found.ok_or_else(|| {
        "expected x and y with a sum below 1, such as 0.3127,0.3290, or a temperature from 1000K to 25000K"
            .to_owned()
    })
}

/// A parser of rules of levels.
pub fn rule(text: &str) -> Result<Rule, String> {
    let percentile = within(f64::MIN_POSITIVE..=100.0, "");
    match (text, text.strip_prefix("percentile=")) {
        ("max", _) => Some(Rule::Max),
        ("mean", _) => Some(Rule::Mean),
        ("rms", _) => Some(Rule::Rms),
        ("percentile", _) => Some(Rule::Percentile(95.0)),
        (_, Some(p)) => percentile(p).ok().map(Rule::Percentile),
        _ => None,
    }
    .ok_or_else(|| {
        "expected max, mean, rms, percentile or percentile=P with P above 0, up to 100".to_owned()
    })
}

/// A parser of transfer functions.
pub fn transfer(text: &str) -> Result<Transfer, String> {
    let gamma = within(0.1..=10.0, "");
    match (text, text.strip_prefix("gamma=")) {
        ("srgb", _) => Some(Transfer::Srgb),
        ("linear", _) => Some(Transfer::Linear),
        ("pq", _) => Some(Transfer::Pq),
        (_, Some(g)) => gamma(g).ok().map(Transfer::Gamma),
        _ => None,
    }
    .ok_or_else(|| "expected srgb, linear, pq or gamma=G with G from 0.1 to 10".to_owned())
}

/// The name of a rule, as it is written.
pub fn rule_name(rule: Rule) -> String {
    match rule {
        Rule::Max => "max".to_owned(),
        Rule::Mean => "mean".to_owned(),
        Rule::Rms => "rms".to_owned(),
        Rule::Percentile(p) => format!("percentile={p}"),
    }
}

/// Name of a transfer function for people.
pub fn transfer_name(transfer: Transfer) -> String {
    match transfer {
        Transfer::Srgb => "sRGB".to_owned(),
        Transfer::Linear => "linear".to_owned(),
        Transfer::Gamma(gamma) => format!("gamma {gamma}"),
        Transfer::Pq => "PQ".to_owned(),
    }
}
