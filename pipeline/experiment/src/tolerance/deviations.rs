// SPDX-License-Identifier: MIT OR Apache-2.0
//! Deviations of a design: random offsets of keys and of slopes of rings, and the settings that
//! they make.

use anyhow::{Context, Result, bail, ensure};
use nalgebra::DMatrix;
use toml::Value;

use design::dotted_keys::{self, Settings, bracketed, number, numbered};
use design::formulas;
use search::normal::Normal;
use simulate::seeds::mix;

use super::file::{CorrelationKeys, Distribution, ToleranceKeys};
use crate::design_file::DesignFile;
use crate::linked_keys::one_of_keys;
use crate::ring_slopes::{RingSlopes, Side};

/// Draws beyond the half width of a truncated law that are tried again.
const MOST_DRAWS: usize = 10_000;

/// A checked tolerance.
#[derive(Debug, Clone)]
pub struct Tolerance {
    /// Name in results.
    pub name: String,
    place: Place,
    law: Law,
    common: bool,
    relative: bool,
}

#[derive(Debug, Clone)]
enum Place {
    /// Keys, with `[*]` for every entry of a list; value of keys that the design does not state.
    Keys(Vec<String>, Option<f64>),
    Slopes(Side),
}

/// A law of offsets.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Law {
    Normal(f64),
    Uniform(f64),
    Truncated { deviation: f64, half_width: f64 },
}

impl Law {
    /// The offset that belongs to a standard normal number; of other laws a draw.
    fn offset(self, normal: f64, random: &mut Normal) -> f64 {
        match self {
            Self::Normal(deviation) => deviation * normal,
            Self::Uniform(half_width) => half_width * (2.0 * random.uniform() - 1.0),
            Self::Truncated { deviation, half_width } => {
                let mut drawn = deviation * normal;
                for _ in 0..MOST_DRAWS {
                    if drawn.abs() <= half_width {
                        break;
                    }
                    drawn = deviation * random.normal();
                }
                drawn.clamp(-half_width, half_width)
            }
        }
    }

    fn is_normal(self) -> bool {
        matches!(self, Self::Normal(_))
    }
}

/// Offset of one number of the design in a sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Offset {
    /// Number of the tolerance.
    pub tolerance: usize,
    /// Key or ring.
    pub place: String,
    /// In the unit of the key.
    pub value: f64,
}

/// All tolerances with their correlations.
#[derive(Debug, Clone)]
pub struct Deviations {
    /// In the order of the file.
    pub tolerances: Vec<Tolerance>,
    /// Lower triangle L of the correlations L Lᵀ between tolerances, entry by entry.
    factor: DMatrix<f64>,
}

impl Deviations {
    /// Checks `keys` against the design of `source`.
    ///
    /// # Errors
    /// Keys that the design does not have, widths of 0, correlations that cannot be.
    pub fn new(
        source: &DesignFile,
        keys: &[ToleranceKeys],
        correlations: &[CorrelationKeys],
    ) -> Result<Self> {
        ensure!(!keys.is_empty(), "tolerances: expected at least one, got none");
        let one = |(k, keys): (usize, &ToleranceKeys)| {
            tolerance(keys, source).with_context(|| format!("tolerances[{}]", k + 1))
        };
        let tolerances: Vec<Tolerance> = keys.iter().enumerate().map(one).collect::<Result<_>>()?;
        for (k, tolerance) in tolerances.iter().enumerate() {
            ensure!(
                tolerances[..k].iter().all(|other| other.name != tolerance.name),
                "tolerances[{}].name: expected one of its own, got {:?} twice",
                k + 1,
                tolerance.name
            );
        }
        // Keys that touch nothing are said before anything is traced.
        let counts: Vec<usize> = tolerances
            .iter()
            .enumerate()
            .map(|(k, tolerance)| {
                let at = || format!("tolerances[{}]", k + 1);
                let places = tolerance.places(source).with_context(at)?;
                Ok(tolerance.draws(places.len()))
            })
            .collect::<Result<_>>()?;
        let factor = factor(&tolerances, &counts, correlations)?;
        let all = Self { tolerances, factor };
        let drawn = all.draw(source, &mut Self::random(0))?;
        let nowhere: Vec<Offset> =
            drawn.into_iter().map(|offset| Offset { value: 0.0, ..offset }).collect();
        source
            .with(&all.settings(source, &nowhere)?)
            .context("tolerances: the design without deviations")?;
        Ok(all)
    }

    /// The random numbers of the deviations of a run with `seed`, beside those of its traces.
    pub fn random(seed: u64) -> Normal {
        const DEVIATIONS: u64 = 0x7013;
        Normal::new(mix(seed ^ DEVIATIONS))
    }

    /// Draws the offsets of one sample.
    ///
    /// # Errors
    /// Keys that the design does not have, correlated tolerances of different numbers of entries.
    pub fn draw(&self, source: &DesignFile, random: &mut Normal) -> Result<Vec<Offset>> {
        // First one number for each tolerance, so that offsets of single keys do not depend on how
        // many entries others have.
        let single: Vec<f64> = self.tolerances.iter().map(|_| random.normal()).collect();
        let mut normals: Vec<Vec<f64>> = Vec::new();
        let mut all = Vec::new();
        for (number, tolerance) in self.tolerances.iter().enumerate() {
            let places = tolerance.places(source)?;
            let count = tolerance.draws(places.len());
            normals.push(Vec::new());
            let mut values = Vec::new();
            for entry in 0..count {
                let normal = if count == 1 { single[number] } else { random.normal() };
                normals[number].push(normal);
                let correlated = self.correlated(&normals, entry)?;
                values.push(tolerance.law.offset(correlated, random));
            }
            let values = values.iter().cycle();
            all.extend(places.into_iter().zip(values).map(|(place, value)| Offset {
                tolerance: number,
                place,
                value: *value,
            }));
        }
        Ok(all)
    }

    /// The standard normal number of an entry of the last tolerance of `normals`, correlated with
    /// those of the same entry of the tolerances before it.
    fn correlated(&self, normals: &[Vec<f64>], entry: usize) -> Result<f64> {
        let last = normals.len() - 1;
        let mut sum = 0.0;
        for (k, normals) in normals.iter().enumerate() {
            let factor = self.factor[(last, k)];
            if factor != 0.0 {
                let [a, b] = [k, last].map(|k| &self.tolerances[k].name);
                let normal = normals.get(entry).with_context(|| {
                    format!("correlations: expected as many entries of {a:?} as of {b:?}")
                })?;
                sum += factor * normal;
            }
        }
        Ok(sum)
    }

    /// The offsets of one sample, those of a common tolerance once.
    pub fn independent<'a>(&self, drawn: &'a [Offset]) -> Vec<&'a Offset> {
        let repeats = |k: usize| {
            let tolerance = drawn[k].tolerance;
            self.tolerances[tolerance].common && k > 0 && drawn[k - 1].tolerance == tolerance
        };
        let first = |k: &usize| !repeats(*k);
        (0..drawn.len()).filter(first).map(|k| &drawn[k]).collect()
    }

    /// Keys of the design with these offsets.
    ///
    /// # Errors
    /// A key without a number in the design, rings that have no slopes.
    pub fn settings(&self, source: &DesignFile, offsets: &[Offset]) -> Result<Settings> {
        let mut settings = Settings::new();
        let mut slopes: Option<RingSlopes> = None;
        for offset in offsets {
            match &self.tolerances[offset.tolerance].place {
                Place::Keys(_, nominal) => {
                    let (key, is_share) =
                        (&offset.place, self.tolerances[offset.tolerance].relative);
                    let before = match settings.get(key).or(dotted_keys::get(&source.table, key)) {
                        Some(value) => number(value)
                            .or_else(|| formulas::number_at(&source.table, key))
                            .with_context(|| {
                                format!("{key}: expected a number in the design, got {value}")
                            })?,
                        None if formulas::number_at(&source.table, key).is_some() => bail!(
                            "{key}: expected a list of formulas in the design, got one for all entries"
                        ),
                        None => nominal.with_context(|| absent(&source.table, key))?,
                    };
                    let unit = if is_share { before } else { 1.0 };
                    settings.insert(key.clone(), Value::Float(before + unit * offset.value));
                }
                Place::Slopes(side) => {
                    if slopes.is_none() {
                        slopes = Some(RingSlopes::of(&source.with(&Settings::new())?)?);
                    }
                    if let (Some(slopes), Ok(ring)) = (&mut slopes, offset.place.parse()) {
                        let before = slopes.values(*side)[ring - 1];
                        slopes.set(*side, ring, before + offset.value);
                    }
                }
            }
        }
        if let Some(mut slopes) = slopes {
            // Slopes beyond 90° are clipped to 90°.
            slopes.clip(90.0, 0.0);
            settings.insert("elements.shapes".to_owned(), slopes.shapes());
        }
        Ok(settings)
    }
}

/// What is expected of a key that `design` does not state.
fn absent(design: &toml::Table, key: &str) -> String {
    let entry = key.strip_suffix(']').and_then(|key| key.rsplit_once('['));
    let list = entry.and_then(|(list, _)| dotted_keys::get(design, list)?.as_array());
    match (entry, list) {
        (Some((list, number)), Some(entries)) => {
            let last = entries.len();
            format!("{key}: expected an entry of {list} from 1 to {last}, got {number}")
        }
        _ => format!("{key}: expected `nominal`, as the design does not state it"),
    }
}

impl Tolerance {
    /// For people: name and law.
    pub fn words(&self) -> String {
        let law = match self.law {
            Law::Normal(deviation) => format!("deviation {deviation}"),
            Law::Uniform(half_width) => format!("within {half_width}"),
            Law::Truncated { deviation, half_width } => {
                format!("deviation {deviation} within {half_width}")
            }
        };
        let of = if self.relative { ", relative" } else { "" };
        format!("{}: {law}{of}", self.name)
    }

    /// Numbers that are drawn for so many `places`: a single one where they deviate alike.
    fn draws(&self, places: usize) -> usize {
        if self.common { places.min(1) } else { places }
    }

    /// Keys, or numbers of rings, that deviate.
    fn places(&self, source: &DesignFile) -> Result<Vec<String>> {
        match &self.place {
            Place::Slopes(_) => {
                let rings = RingSlopes::of(&source.with(&Settings::new())?)?.count();
                Ok((1..=rings).map(|ring| ring.to_string()).collect())
            }
            Place::Keys(keys, _) => {
                let mut keys = keys.clone();
                while keys.iter().any(|key| key.contains("[*]")) {
                    let all: Result<Vec<Vec<String>>> =
                        keys.iter().map(|key| with_entries(key, &source.table)).collect();
                    keys = all?.concat();
                }
                Ok(keys)
            }
        }
    }
}

/// `key` with every entry of the list before its first `[*]` in turn.
fn with_entries(key: &str, design: &toml::Table) -> Result<Vec<String>> {
    let Some((list, rest)) = key.split_once("[*]") else {
        return Ok(vec![key.to_owned()]);
    };
    let entries = dotted_keys::get(design, list).and_then(Value::as_array);
    let entries =
        entries.with_context(|| format!("{key}: expected a list at {list} in the design"))?;
    let of = |k: usize| format!("{list}[{k}]{rest}");
    Ok((1..=entries.len()).map(of).collect())
}

fn tolerance(keys: &ToleranceKeys, source: &DesignFile) -> Result<Tolerance> {
    let first = one_of_keys(keys.key.as_ref(), keys.keys.as_ref())?;
    let (place, label) = match (first, keys.profile) {
        (Some(key), None) => {
            let all = keys.keys.as_deref().unwrap_or(std::slice::from_ref(key)).iter();
            let all: Vec<String> = all.map(|key| numbered(&source.table, key)).collect();
            for (k, key) in all.iter().enumerate() {
                ensure!(!all[..k].contains(key), "keys: expected each once, got {key} twice");
            }
            let label = bracketed(key);
            (Place::Keys(all, keys.nominal), label)
        }
        (None, Some(side)) => (Place::Slopes(side), side.key().to_owned()),
        _ => bail!("expected one of `keys`, `key` and `profile`, got several or none"),
    };
    let positive = |key: &str, value: Option<f64>| -> Result<f64> {
        let value = value.with_context(|| format!("{key}: expected a number above 0"))?;
        ensure!(value > 0.0 && value.is_finite(), "{key}: expected a number above 0, got {value}");
        Ok(value)
    };
    let law = match keys.distribution {
        Distribution::Normal => Law::Normal(positive("deviation", keys.deviation)?),
        Distribution::Uniform => Law::Uniform(positive("half_width", keys.half_width)?),
        Distribution::Truncated => Law::Truncated {
            deviation: positive("deviation", keys.deviation)?,
            half_width: positive("half_width", keys.half_width)?,
        },
    };
    let unused = match keys.distribution {
        Distribution::Normal => keys.half_width.map(|_| "half_width"),
        Distribution::Uniform => keys.deviation.map(|_| "deviation"),
        Distribution::Truncated => None,
    };
    ensure!(
        unused.is_none(),
        "{}: expected no such key with this distribution",
        unused.unwrap_or_default()
    );
    ensure!(
        !keys.relative || first.is_some(),
        "relative: expected `key` or `keys` beside it, got `profile`, whose slopes deviate in degrees"
    );
    let common = keys.common || keys.keys.is_some();
    let name = keys.name.clone().unwrap_or(label);
    Ok(Tolerance { name, place, law, common, relative: keys.relative })
}

/// The lower triangle of the correlations of `tolerances`, for which `draws` numbers are drawn.
fn factor(
    tolerances: &[Tolerance],
    draws: &[usize],
    correlations: &[CorrelationKeys],
) -> Result<DMatrix<f64>> {
    let mut matrix = DMatrix::identity(tolerances.len(), tolerances.len());
    for (number, keys) in correlations.iter().enumerate() {
        let at = format!("correlations[{}]", number + 1);
        ensure!(
            keys.between.len() == 2,
            "{at}.between: expected the names of two tolerances, got {}",
            keys.between.len()
        );
        let places = keys.between.iter().map(|name| {
            let place = tolerances.iter().position(|t| t.name == *name);
            let by_key = || tolerances.iter().position(|t| t.name == bracketed(name));
            let place = place.or_else(by_key);
            place.with_context(|| {
                format!("{at}.between: expected names of tolerances, got {name:?}")
            })
        });
        let places: Vec<usize> = places.collect::<Result<_>>()?;
        let (a, b) = (places[0], places[1]);
        ensure!(a != b, "{at}.between: expected two tolerances, got one twice");
        ensure!(
            keys.coefficient.abs() < 1.0,
            "{at}.coefficient: expected a number between -1 and 1, got {}",
            keys.coefficient
        );
        for place in [a, b] {
            ensure!(
                tolerances[place].law.is_normal(),
                "{at}.between: expected normal distributions, got another one of {:?}",
                tolerances[place].name
            );
        }
        let [of_a, of_b] = [a, b].map(|k| {
            let entries = if draws[k] == 1 { "entry" } else { "entries" };
            let entries = format!("{} {entries}", draws[k]);
            let alike = if tolerances[k].common { " (common)" } else { "" };
            format!("{entries} of {:?}{alike}", tolerances[k].name)
        });
        ensure!(
            draws[a] == draws[b],
            "{at}.between: expected tolerances of as many entries, to correlate one by one, \
             got {of_a} and {of_b}"
        );
        matrix[(a, b)] = keys.coefficient;
        matrix[(b, a)] = keys.coefficient;
    }
    let cholesky = matrix.cholesky().context(
        "correlations: expected coefficients that can hold together (a positive definite matrix)",
    )?;
    Ok(cholesky.l())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn stars_stand_for_every_entry_of_lists_in_lists() {
        let table = "[led]\noffsets_mm = [[0.0, 1.0], [2.0, 3.0]]\nheight_mm = 1.0";
        let table: toml::Table = toml::from_str(table).expect("TOML");
        let source = DesignFile::new("design.toml".into(), table);
        let keys = |key: &str| Tolerance {
            name: key.to_owned(),
            place: Place::Keys(vec![bracketed(key)], None),
            law: Law::Normal(1.0),
            common: false,
            relative: false,
        };
        let places = keys("led.offsets_mm.*.*").places(&source).expect("lists");
        assert_eq!(
            places,
            ["[1][1]", "[1][2]", "[2][1]", "[2][2]"].map(|k| format!("led.offsets_mm{k}"))
        );
        let places = keys("led.offsets_mm.*.1").places(&source).expect("lists");
        assert_eq!(places, ["led.offsets_mm[1][2]", "led.offsets_mm[2][2]"]);
        let why = keys("led.height_mm.*").places(&source);
        let why = why.expect_err("a number").to_string();
        assert!(why.contains("expected a list at led.height_mm"), "{why}");

        let all = Deviations {
            tolerances: vec![keys("led.offsets_mm.*.*")],
            factor: DMatrix::identity(1, 1),
        };
        let drawn = all.draw(&source, &mut Deviations::random(1)).expect("drawn");
        let settings = all.settings(&source, &drawn).expect("numbers");
        for (offset, nominal) in drawn.iter().zip([0.0, 1.0, 2.0, 3.0]) {
            let value = settings[&offset.place].as_float();
            assert_eq!(value, Some(nominal + offset.value));
        }
        assert!(drawn[0].value.to_bits() != drawn[1].value.to_bits());
        assert_eq!(all.independent(&drawn).len(), 4);

        let linked = "keys = [\"led.height_mm\", \"led.offsets_mm.1.0\"]\ndeviation = 0.1";
        let linked: ToleranceKeys = toml::from_str(linked).expect("TOML");
        let all = Deviations {
            tolerances: vec![tolerance(&linked, &source).expect("keys")],
            factor: DMatrix::identity(1, 1),
        };
        let drawn = all.draw(&source, &mut Deviations::random(1)).expect("drawn");
        let moved = all.settings(&source, &drawn).expect("numbers");
        let [a, b] = ["led.height_mm", "led.offsets_mm[2][1]"].map(|key| moved[key].as_float());
        assert_eq!((a, b), (Some(1.0 + drawn[0].value), Some(2.0 + drawn[0].value)));
        assert_eq!(all.independent(&drawn).len(), 1);
        let both = "key = \"led.height_mm\"\nkeys = [\"led.height_mm\"]\ndeviation = 0.1";
        let both = toml::from_str(both).expect("TOML");
        let why = tolerance(&both, &source).expect_err("both").to_string();
        assert!(why.contains("`key` and `keys`, got both"), "{why}");

        let common = |key: &str| Tolerance { common: true, ..keys(key) };
        let all = Deviations {
            tolerances: vec![common("led.offsets_mm.*.*"), common("led.height_mm")],
            factor: DMatrix::identity(2, 2),
        };
        let drawn = all.draw(&source, &mut Deviations::random(1)).expect("drawn");
        assert_eq!(drawn[0].value.to_bits(), drawn[3].value.to_bits());
        // A regression on copies of one column has no answer.
        assert_eq!(all.independent(&drawn), [&drawn[0], &drawn[4]]);
    }

    #[test]
    fn a_relative_deviation_of_all_coordinates_scales_a_body() {
        let rows = [[0.0, 1.5], [0.8, 1.0], [2.0, -0.5], [0.0, -0.5]];
        let solid = format!("[[solids]]\nposition_mm = [0.0, 0.0, 3.0]\nmeridian_mm = {rows:?}");
        let table: toml::Table = toml::from_str(&solid).expect("TOML");
        let source = DesignFile::new("design.toml".into(), table);
        let keys = "key = \"solids[1].meridian_mm[*][*]\"\ndeviation = 0.01\nrelative = true";
        let of = |more: &str| {
            let keys: ToleranceKeys = toml::from_str(&format!("{keys}\n{more}")).expect("TOML");
            let tolerances = vec![tolerance(&keys, &source).expect("keys")];
            let all = Deviations { tolerances, factor: DMatrix::identity(1, 1) };
            let drawn = all.draw(&source, &mut Deviations::random(1)).expect("drawn");
            let moved = all.settings(&source, &drawn).expect("numbers");
            let at = |i: usize, k: usize| {
                let key = format!("solids[1].meridian_mm[{}][{}]", i + 1, k + 1);
                moved[&key].as_float().expect("a number")
            };
            let factors = (1..3).flat_map(|i| [0, 1].map(|k| at(i, k) / rows[i][k]));
            assert_eq!((at(0, 0), at(3, 0)), (0.0, 0.0));
            (factors.collect::<Vec<f64>>(), 1.0 + drawn[0].value)
        };
        let (factors, scale) = of("common = true");
        assert!(
            (scale - 1.0).abs() > 1e-6 && factors.iter().all(|f| (f / scale - 1.0).abs() < 1e-14)
        );
        let (factors, _) = of("");
        assert!(factors.windows(2).all(|pair| (pair[0] - pair[1]).abs() > 1e-6), "{factors:?}");
        let slopes = "profile = \"inner_slope_deg\"\ndeviation = 1.0\nrelative = true";
        let slopes = toml::from_str(slopes).expect("TOML");
        let why = tolerance(&slopes, &source).expect_err("slopes");
        assert!(why.to_string().starts_with("relative: expected `key` or `keys`"), "{why}");
    }

    /// Tolerances and correlations of design D3.
    fn of_d3(tolerances: &[&str], correlations: &[&str]) -> (DesignFile, Result<Deviations>) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/designs/d3.toml");
        let (source, _) = DesignFile::read(&path).expect("a design");
        let tolerances = tolerances.iter().map(|text| toml::from_str(text));
        let tolerances = tolerances.collect::<Result<Vec<_>, _>>().expect("TOML");
        let correlations = correlations.iter().map(|text| toml::from_str(text));
        let correlations = correlations.collect::<Result<Vec<_>, _>>().expect("TOML");
        let all = Deviations::new(&source, &tolerances, &correlations);
        (source, all)
    }

    const INNER: &str = "profile = \"inner_slope_deg\"\ndeviation = 1.0";
    const OUTER: &str = "profile = \"outer_slope_deg\"\ndeviation = 0.5";

    #[test]
    fn both_sides_of_each_ring_are_correlated_and_different_rings_are_not() {
        let coefficient = 0.8;
        let sides = "between = [\"inner_slope_deg\", \"outer_slope_deg\"]\ncoefficient = 0.8";
        let (source, all) = of_d3(&[INNER, OUTER], &[sides]);
        let all = all.expect("as many rings");
        let mut random = Deviations::random(1);
        let draws = 1000;
        let samples: Vec<Vec<f64>> = (0..draws)
            .map(|_| {
                let drawn = all.draw(&source, &mut random).expect("drawn");
                drawn.iter().map(|offset| offset.value).collect()
            })
            .collect();
        let rings = 17;
        assert_eq!(samples[0].len(), 2 * rings);
        let product = |a: usize, b: usize| samples.iter().map(|s| s[a] * s[b]).sum::<f64>();
        let correlation = |a, b| product(a, b) / (product(a, a) * product(b, b)).sqrt();
        for ring in 0..rings {
            // The standard error of a correlation r is (1 - r²) / √n.
            let found = correlation(ring, rings + ring);
            let error = (1.0 - coefficient * coefficient) / f64::from(draws).sqrt();
            assert!((found - coefficient).abs() < 4.5 * error, "{ring}: {found}");
            let outer = (product(rings + ring, rings + ring) / f64::from(draws)).sqrt();
            assert!((outer - 0.5).abs() < 4.5 * 0.5 / f64::from(2 * draws).sqrt());
            for other in (0..rings).filter(|other| *other != ring) {
                let found = correlation(ring, rings + other);
                assert!(found.abs() < 4.5 / f64::from(draws).sqrt(), "{ring} {other}");
            }
        }
    }

    #[test]
    fn correlations_between_different_numbers_of_entries_are_refused() {
        let common = format!("{OUTER}\ncommon = true");
        let index = "key = \"silicone.index\"\ndeviation = 0.005";
        let between = |a: &str, b: &str| format!("between = [{a:?}, {b:?}]\ncoefficient = 0.5");
        let (inner, outer) = ("inner_slope_deg", "outer_slope_deg");
        for (tolerances, between, got) in [
            (
                [INNER, index],
                between(inner, "silicone.index"),
                "17 entries of \"inner_slope_deg\" and 1 entry of \"silicone.index\"",
            ),
            (
                [INNER, &common],
                between(outer, inner),
                "1 entry of \"outer_slope_deg\" (common) and 17 entries of \"inner_slope_deg\"",
            ),
        ] {
            let (_, refused) = of_d3(&tolerances, &[&between]);
            let why = refused.expect_err(got).to_string();
            assert!(why.starts_with("correlations[1].between: expected"), "{why}");
            assert!(why.contains(got), "{why}");
        }
        // One that all rings have in common goes with a single key.
        let (source, all) = of_d3(&[&common, index], &[&between(outer, "silicone.index")]);
        let drawn = all.expect("one entry each").draw(&source, &mut Deviations::random(1));
        assert_eq!(drawn.expect("drawn").len(), 18);
    }
}
