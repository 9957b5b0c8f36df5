// SPDX-License-Identifier: MIT OR Apache-2.0
//! The variables of a problem: from a point of the unit box to settings of the design.
//!
//! Keys are set first. Profiles follow on the design that they make: slopes of the two sides of
//! every ring, or heights of a smooth dome.

use anyhow::{Context, Result, bail, ensure};

use design::Design;
use design::dotted_keys::{
    self, Settings, bracketed, check_entries_stay, contains, number, numbered,
};
use design::formulas::number_at;
use design::json_schema::{NumberKind, number_kind};
use metrics::digits::shortest;
use runtime::serde_arrays::List;

use super::file::{Profile, VariableKeys};
use super::heights;
use super::limits::Limits;
use super::range::Range;
use super::spline::BSpline;
use crate::design_file::DesignFile;
use crate::linked_keys::one_of_keys;
use crate::ring_slopes::{RingSlopes, Side};

/// Key of the shapes of rings.
const SHAPES: &str = "elements.shapes";

/// Most variables of a point that are listed for people.
const LISTED: usize = 8;
/// Distance from a bound below which a coefficient counts as at it, as a share of its range.
const AT_BOUND: f64 = 1e-3;

/// A checked variable.
#[derive(Debug, Clone)]
pub(super) struct Variable {
    /// Key or profile, for people.
    pub label: String,
    place: Place,
    range: Range,
    /// Coefficients in the unit box.
    pub count: usize,
    start: Option<f64>,
}

#[derive(Debug, Clone)]
enum Place {
    /// A key, and others that keep their distances from it.
    Key(String, Vec<(String, f64)>),
    Rings(Side, [usize; 2]),
    Height,
}

impl Place {
    /// True where a profile here sets what stands under `key`.
    fn sets(&self, key: &str) -> bool {
        let within = |whole: &str| contains(whole, key) || contains(key, whole);
        match self {
            // Coatings of the dome are kept.
            Self::Height => within("dome") && !contains("dome.coating", key),
            Self::Rings(..) => within(SHAPES),
            Self::Key(own, linked) => {
                within(own) || linked.iter().any(|(linked, _)| within(linked))
            }
        }
    }
}

/// All variables of a problem with what they act on.
#[derive(Debug, Clone)]
pub(super) struct Variables {
    /// The design to begin with.
    pub source: DesignFile,
    /// In the order of the file.
    pub all: Vec<Variable>,
    /// Limits that clip slopes.
    pub limits: Limits,
}

impl Variables {
    /// Checks `keys` against the design of `source`.
    ///
    /// # Errors
    /// Bounds that cross, keys that the design does not have, profiles that do not fit.
    pub fn new(source: DesignFile, keys: &[VariableKeys], limits: Limits) -> Result<Self> {
        ensure!(!keys.is_empty(), "variables: expected at least one, got none");
        let design = source.with(&Settings::new())?;
        let variable = |(k, keys): (usize, &VariableKeys)| {
            variable(keys, &source, &design).with_context(|| format!("variables[{}]", k + 1))
        };
        let all = keys.iter().enumerate().map(variable);
        let all: Vec<Variable> = all.collect::<Result<_>>()?;
        for (k, variable) in all.iter().enumerate() {
            let other = all[..k].iter().find(|other| other.overlaps(variable));
            if let Some(other) = other {
                bail!(
                    "variables[{}]: expected keys and profiles that set different parts of the \
                     design, got {} beside {}",
                    k + 1,
                    variable.label,
                    other.label
                );
            }
        }
        ensure!(
            all.iter().any(|variable| variable.count > 0),
            "variables: expected at least one with `from` and `to`, or `choices`, got `value` alone"
        );
        Ok(Self { source, all, limits })
    }

    /// True where the key is one of a variable.
    pub fn is_set(&self, key: &str) -> bool {
        let key = numbered(&self.source.table, key);
        self.all.iter().any(|variable| variable.is_set_by(&key))
    }

    /// Number of coefficients of all variables.
    pub fn dimension(&self) -> usize {
        self.all.iter().map(|variable| variable.count).sum()
    }

    /// [`Variables::dimension`] with `knots` coefficients in each profile over rings.
    pub fn resumed_dimension(&self, knots: Option<usize>) -> usize {
        self.all.iter().map(|variable| variable.count_with(knots)).sum()
    }

    /// The same variables with `knots` coefficients in each profile over rings, from the design
    /// that `settings` make.
    ///
    /// # Errors
    /// Settings that make no design.
    pub fn resumed(&self, settings: &Settings, knots: Option<usize>) -> Result<Self> {
        let table = self.source.table_with(settings)?;
        let mut next = self.clone();
        next.source = DesignFile::new(self.source.path.clone(), table);
        for variable in &mut next.all {
            variable.count = variable.count_with(knots);
            if !settings.is_empty() {
                variable.start = None;
            }
        }
        Ok(next)
    }

    /// The point of the design to begin with, moved into the bounds.
    ///
    /// # Errors
    /// A key without a value in the design.
    pub fn start(&self) -> Result<Vec<f64>> {
        let design = self.source.with(&Settings::new())?;
        let mut slopes = None;
        let mut point = Vec::new();
        for variable in &self.all {
            let spline = BSpline::new(variable.count);
            let values: Vec<f64> = match (&variable.place, variable.start) {
                (_, Some(start)) => vec![start; variable.count],
                // A key that follows others.
                (Place::Key(..), None) if variable.count == 0 => Vec::new(),
                (Place::Key(key, _), None) => vec![variable.at_present(key, &self.source.table)?],
                (Place::Height, None) => heights::of_design(&design, variable.count)?,
                (Place::Rings(side, [first, last]), None) => {
                    if slopes.is_none() {
                        slopes = Some(RingSlopes::of(&design)?);
                    }
                    let all = slopes.as_ref().map(|s| s.values(*side));
                    let all = &all.unwrap_or_default()[first - 1..*last];
                    let nearest =
                        |share: f64| all[(share * (all.len() - 1) as f64).round() as usize];
                    if variable.count == all.len() {
                        all.to_vec()
                    } else {
                        spline.abscissae().into_iter().map(nearest).collect()
                    }
                }
            };
            point.extend(values.into_iter().map(|value| variable.range.coordinate(value)));
        }
        Ok(point)
    }

    /// Names of the coordinates of a point, for people.
    pub fn labels(&self) -> Vec<String> {
        let of = |variable: &Variable| -> Vec<String> {
            match variable.count {
                1 => vec![variable.label.clone()],
                count => (1..=count).map(|k| format!("{} {k}", variable.label)).collect(),
            }
        };
        self.all.iter().flat_map(of).collect()
    }

    /// The range of every coordinate of a point.
    fn ranges(&self) -> impl Iterator<Item = &Range> {
        let all = self.all.iter();
        all.flat_map(|v| std::iter::repeat_n(&v.range, v.count))
    }

    /// True where the coordinate `k` is a number, no choice.
    pub fn is_number(&self, k: usize) -> bool {
        let range = self.ranges().nth(k);
        range.is_some_and(|range| matches!(range, Range::Between { .. }))
    }

    /// Coefficients that stand at a bound at `point`, for people.
    pub fn at_bounds(&self, point: &[f64]) -> Vec<String> {
        let all = self.labels().into_iter().zip(self.ranges()).zip(point);
        let at_bound = all.filter_map(|((label, range), &x)| match range {
            Range::Between { .. } if x.min(1.0 - x) < AT_BOUND => {
                Some(format!("{label} at {}", range.number(x.round())))
            }
            _ => None,
        });
        at_bound.collect()
    }

    /// Values of the coefficients at `point`, in the units of the design; shares of choices.
    pub fn coefficients(&self, point: &[f64]) -> Vec<f64> {
        self.ranges().zip(point).map(|(r, x)| r.number(*x)).collect()
    }

    /// Choices at `point`, by the names of their variables.
    pub fn choices(&self, point: &[f64]) -> impl Iterator<Item = (String, serde_json::Value)> {
        let all = self.labels().into_iter().zip(self.ranges()).zip(point);
        all.filter_map(|((label, range), x)| match range {
            Range::Choices(_) => Some((label, serde_json::to_value(range.value(*x)).ok()?)),
            Range::Between { .. } => None,
        })
    }

    /// Names and values of the first coefficients at `point` for people, and how many more there are.
    pub fn listed(&self, point: &[f64]) -> Vec<String> {
        let all = self.labels().into_iter().zip(self.ranges()).zip(point);
        let more = point.len().saturating_sub(LISTED);
        let words = all.take(LISTED).map(|((label, range), x)| match range {
            Range::Choices(_) => format!("{label} = {}", range.value(*x)),
            Range::Between { .. } => format!("{label} = {}", shortest(range.number(*x))),
        });
        let mut words: Vec<String> = words.collect();
        words.extend((more > 0).then(|| format!("{more} more")));
        words
    }

    /// Variables with their ranges, for people.
    pub fn ranges_words(&self) -> Vec<String> {
        let words = |variable: &Variable| {
            let linked = match &variable.place {
                Place::Key(_, linked) if !linked.is_empty() => {
                    let keys: Vec<&str> = linked.iter().map(|(key, _)| key.as_str()).collect();
                    format!(" with {}", keys.join(", "))
                }
                _ if variable.count > 1 => format!(" ({} coefficients)", variable.count),
                _ => String::new(),
            };
            format!("{}{linked}: {}", variable.label, variable.range.words())
        };
        self.all.iter().map(words).collect()
    }

    /// What tells the design at `point` from that at any other.
    pub fn values(&self, point: &[f64]) -> Vec<String> {
        self.ranges().zip(point).map(|(range, x)| range.value(*x).to_string()).collect()
    }

    /// Keys of the design at `point`.
    ///
    /// # Errors
    /// Keys that make no design that profiles could stand on.
    pub fn settings(&self, point: &[f64]) -> Result<Settings> {
        let mut settings = Settings::new();
        let mut rest = point;
        let mut profiles = Vec::new();
        for variable in &self.all {
            let (own, others) = rest.split_at(variable.count);
            rest = others;
            match &variable.place {
                Place::Key(key, linked) => {
                    let value = variable.range.value(own.first().copied().unwrap_or(0.0));
                    let first = number(&value).unwrap_or(0.0);
                    let linked = linked
                        .iter()
                        .map(|(key, distance)| (key.clone(), toml::Value::Float(first + distance)));
                    settings.extend(linked);
                    settings.insert(key.clone(), value);
                }
                _ => profiles.push((variable, own)),
            }
        }
        if profiles.is_empty() {
            return Ok(settings);
        }
        let mut design = self.source.with(&settings)?;
        let rings = profiles.iter().any(|(v, _)| matches!(v.place, Place::Rings(..)));
        let mut slopes = rings.then(|| RingSlopes::of(&design)).transpose()?;
        for (variable, own) in &profiles {
            if matches!(variable.place, Place::Height) {
                let values: Vec<f64> = own.iter().map(|x| variable.range.number(*x)).collect();
                let dome = heights::dome(&values, &design, &self.source.table)?;
                settings.insert("dome".to_owned(), dome);
                if let Some(slopes) = &slopes {
                    // Rings of the former dome need not fit this one.
                    settings.insert(SHAPES.to_owned(), slopes.smooth());
                }
                design = self.source.with(&settings)?;
            }
        }
        if let Some(slopes) = &mut slopes {
            for (variable, own) in &profiles {
                if let Place::Rings(side, rings) = &variable.place {
                    variable.set_slopes(own, *side, *rings, slopes)?;
                }
            }
            slopes.place_on(&design)?;
            slopes.clip(90.0 - self.limits.draft_deg, self.limits.apex_deg);
            settings.insert(SHAPES.to_owned(), slopes.shapes());
        }
        Ok(settings)
    }
}

impl Variable {
    /// Coefficients with `knots` in each profile over rings.
    fn count_with(&self, knots: Option<usize>) -> usize {
        match (&self.place, knots) {
            (Place::Rings(_, [first, last]), Some(knots)) => knots.clamp(1, last - first + 1),
            _ => self.count,
        }
    }

    /// True where the key, by numbers of entries, is one of this variable.
    fn is_set_by(&self, key: &str) -> bool {
        match &self.place {
            Place::Key(own, linked) => {
                *own == key || linked.iter().any(|(linked, _)| *linked == key)
            }
            _ => self.label == key,
        }
    }

    fn overlaps(&self, other: &Self) -> bool {
        match (&self.place, &other.place) {
            (Place::Rings(a, [first, last]), Place::Rings(b, [from, to])) => {
                a == b && first <= to && from <= last
            }
            (Place::Height, Place::Height) => true,
            (Place::Key(key, linked), place) | (place, Place::Key(key, linked)) => {
                place.sets(key) || linked.iter().any(|(key, _)| place.sets(key))
            }
            _ => false,
        }
    }

    /// The value of `key` in `table`.
    fn at_present(&self, key: &str, table: &toml::Table) -> Result<f64> {
        let value = dotted_keys::get(table, key);
        match (&self.range, value) {
            (Range::Choices(choices), value) => {
                let place = choices.iter().position(|choice| Some(choice) == value);
                Ok((place.unwrap_or(0) as f64 + 0.5) / choices.len() as f64)
            }
            (Range::Between { .. }, Some(value)) => number_at(table, key)
                .with_context(|| format!("{key}: expected a number in the design, got {value}")),
            (Range::Between { .. }, None) if number_at(table, key).is_some() => {
                bail!("{key}: expected a list of formulas in the design, got one for all entries")
            }
            (Range::Between { .. }, None) => {
                bail!("{key}: expected `start`, as the design does not state the key")
            }
        }
    }

    fn set_slopes(
        &self,
        own: &[f64],
        side: Side,
        [first, last]: [usize; 2],
        slopes: &mut RingSlopes,
    ) -> Result<()> {
        ensure!(
            last <= slopes.count(),
            "{}: expected {last} rings, got {}",
            self.label,
            slopes.count()
        );
        let count = last - first + 1;
        let numbers: Vec<f64> = own.iter().map(|x| self.range.number(*x)).collect();
        let spline = BSpline::new(self.count);
        for ring in first..=last {
            let value = if self.count == count {
                numbers[ring - first]
            } else {
                let share = (ring - first) as f64 / (count.max(2) - 1) as f64;
                self.range.rounded(spline.value(&numbers, share))
            };
            slopes.set(side, ring, value);
        }
        Ok(())
    }
}

/// Keys after the first with their distances from it.
fn distances(keys: &[String], source: &DesignFile) -> Result<Vec<(String, f64)>> {
    let stated = |key: &String| {
        let value = number_at(&source.table, key);
        let value = value.filter(|_| number_kind(key) == Some(NumberKind::Real));
        value.with_context(|| {
            format!("expected keys of real numbers that the design states, got {key}")
        })
    };
    let first = stated(&keys[0])?;
    let by_number = |key: &String| numbered(&source.table, key);
    let all = keys.iter().enumerate().skip(1).map(|(k, key)| {
        let twice = keys[..k].iter().any(|other| by_number(other) == by_number(key));
        ensure!(!twice, "expected each key once, got {key} twice");
        Ok((by_number(key), stated(key)? - first))
    });
    all.collect()
}

fn variable(keys: &VariableKeys, source: &DesignFile, design: &Design) -> Result<Variable> {
    let key = one_of_keys(keys.key.as_ref(), keys.keys.as_ref())?;
    let (label, place, count) = match (key, keys.profile) {
        (Some(key), None) => {
            ensure!(
                keys.knots.is_none() && keys.rings.is_none(),
                "expected `knots` and `rings` of a profile alone, got them beside `key`"
            );
            let linked = match &keys.keys {
                Some(keys) => distances(keys, source).context("keys")?,
                None => Vec::new(),
            };
            let place = Place::Key(numbered(&source.table, key), linked);
            (bracketed(key), place, usize::from(keys.value.is_none()))
        }
        (None, Some(Profile::HeightMm)) => {
            heights::radius_mm(design)?;
            let count = keys.knots.unwrap_or(8);
            ensure!((3..=40).contains(&count), "knots: expected 3 to 40, got {count}");
            ("height_mm".to_owned(), Place::Height, count)
        }
        (None, Some(profile)) => {
            let rings = RingSlopes::of(design)?.count();
            let [first, last] = keys.rings.map_or([1, rings], |List(ends)| ends);
            ensure!(
                first >= 1 && first <= last && last <= rings,
                "rings: expected a first and a last ring from 1 to {rings}, got [{first}, {last}]"
            );
            let all = last - first + 1;
            let count = keys.knots.unwrap_or(all);
            ensure!(
                (1..=all).contains(&count),
                "knots: expected 1 to {all}, one for each ring, got {count}"
            );
            let side = match profile {
                Profile::InnerSlopeDeg => Side::Inner,
                _ => Side::Outer,
            };
            let place = Place::Rings(side, [first, last]);
            (side.key().to_owned(), place, count)
        }
        _ => bail!("expected one of `keys`, `key` and `profile`, got several or none"),
    };
    let range = Range::new(keys, matches!(place, Place::Key(_, _)))?;
    let follows = keys.value.clone().map(toml::Value::String);
    for value in keys.choices.iter().flatten().chain(&follows) {
        let set = keys.key.iter().map(|key| (key.clone(), value.clone())).collect();
        check_entries_stay(&source.table, &set)?;
    }
    ensure!(
        keys.keys.is_none() || matches!(range, Range::Between { .. }),
        "keys: expected them with `from` and `to`, got them with `choices`"
    );
    ensure!(
        keys.start.is_none() || matches!(range, Range::Between { .. }),
        "start: expected it with `from` and `to` alone, got it with `choices`"
    );
    if let (Some(start), Range::Between { from, to, .. }) = (keys.start, &range) {
        ensure!(
            (*from..=*to).contains(&start),
            "start: expected a number from {from} to {to}, got {start}"
        );
    }
    let range = match &place {
        Place::Key(key, _) => range.of_key(key, source)?,
        _ => range,
    };
    Ok(Variable { label, place, range, count, start: keys.start })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_set_their_part_of_the_design_alone() {
        let rings = Place::Rings(Side::Inner, [1, 2]);
        for (place, key, sets) in [
            (&Place::Height, "dome.height_mm", true),
            (&Place::Height, "dome", true),
            (&Place::Height, "dome.coating.0.thickness_nm", false),
            (&Place::Height, "domes", false),
            (&rings, "elements.shapes.0.apex_angle_deg", true),
            (&rings, "elements", true),
            (&rings, "elements.tip_radius_um", false),
        ] {
            assert_eq!(place.sets(key), sets, "{place:?} {key}");
        }
    }
}
