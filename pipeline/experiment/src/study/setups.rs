// SPDX-License-Identifier: MIT OR Apache-2.0
//! Set-ups: combinations of the levels of factors, and the keys that each sets.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, bail, ensure};
use serde::Serialize;

use design::dotted_keys::{
    Settings, contains, entries_left_out, number, numbered, removed_entries, settings_by_number,
};

use super::file::{Factor, FactorArrangement, Level, StudyFile};
use crate::design_file::DesignFile;

/// Most set-ups of one study.
const MOST: usize = 10_000;

/// A factor with its levels.
#[derive(Debug, Clone, PartialEq)]
pub struct FactorLevels {
    /// Name of the factor.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// The key, for a factor of one key.
    pub key: Option<String>,
    /// Levels in the order of the file.
    pub levels: Vec<(String, Level)>,
    /// The key's values, where all of them are numbers.
    pub numbers: Option<Vec<f64>>,
}

/// One way to set the keys of all designs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setup {
    /// Name, unique in the study.
    pub name: String,
    /// Factor → level, where it is not that of the base.
    pub levels: BTreeMap<String, String>,
    /// Settings in order: later entries win.
    #[serde(skip)]
    pub settings: Vec<Level>,
}

impl Setup {
    /// Settings of the design `source`, with entries of lists by number. An entry that a level takes
    /// away takes along what the base sets in it.
    ///
    /// # Errors
    /// A key that is set in an entry that is taken away.
    pub fn of(&self, source: &DesignFile) -> Result<Settings> {
        let merged = |levels: &[Level]| {
            let mut all = Settings::new();
            for level in levels {
                let own = level.set_of.get(&source.name);
                for settings in [Some(&level.set), own].into_iter().flatten() {
                    all.extend(settings_by_number(&source.table, settings));
                }
            }
            all
        };
        let (mut all, levels) = (merged(&self.settings[..1]), merged(&self.settings[1..]));
        let within = |entry: &str, key: &str| contains(entry, key) && entry != key;
        let gone = |settings: &Settings| -> Result<Vec<String>> {
            let left_out = entries_left_out(&source.table, settings)?;
            Ok(removed_entries(settings).chain(left_out).collect())
        };
        let taken = gone(&levels)?;
        all.retain(|key, _| !taken.iter().any(|entry| within(entry, key)));
        all.extend(levels);
        for entry in gone(&all)? {
            if let Some(key) = all.keys().find(|key| within(&entry, key)) {
                bail!("{key}: expected a key of an entry that is there, got {entry} taken away");
            }
        }
        Ok(all)
    }
}

/// The factors of `file`, checked.
pub fn factors(file: &StudyFile) -> Result<Vec<FactorLevels>> {
    let mut names = BTreeSet::new();
    for factor in &file.factors {
        let name = &factor.name;
        ensure!(
            names.insert(name),
            "factors: expected a name of its own for each, got {name:?} twice"
        );
    }
    file.factors.iter().map(levels).collect()
}

fn levels(factor: &Factor) -> Result<FactorLevels> {
    let name = factor.name.clone();
    let (levels, numbers) = match (&factor.key, &factor.values, factor.levels.is_empty()) {
        (Some(key), Some(values), true) => {
            let level = |value: &toml::Value| {
                let label = match value.as_str() {
                    Some("") => "none".to_owned(),
                    Some(text) => text.to_owned(),
                    None => value.to_string(),
                };
                let set = Settings::from([(key.clone(), value.clone())]);
                let set_of = BTreeMap::new();
                (label, Level { set, set_of })
            };
            (
                values.iter().map(level).collect::<Vec<_>>(),
                values.iter().map(number).collect::<Option<Vec<f64>>>(),
            )
        }
        (None, None, false) => {
            let level = |l: &super::file::NamedLevel| {
                let (set, set_of) = (l.set.clone(), l.set_of.clone());
                (l.name.clone(), Level { set, set_of })
            };
            (factor.levels.iter().map(level).collect(), None)
        }
        _ => bail!(
            "factors: expected `key` with `values`, or `levels`, got neither or both in {name:?}"
        ),
    };
    ensure!(!levels.is_empty(), "factors: expected at least one level, got none in {name:?}");
    let mut known = BTreeSet::new();
    let twice = levels.iter().find(|(label, _)| !known.insert(label));
    if let Some((label, _)) = twice {
        bail!(
            "factors: expected a name of its own for each level, got {label:?} twice in {name:?}"
        );
    }
    Ok(FactorLevels {
        name,
        description: factor.description.clone(),
        key: factor.key.clone(),
        levels,
        numbers,
    })
}

/// Refuses a grid whose factors set the same key: the later would win silently.
fn check_keys(factors: &[FactorLevels], sources: &[DesignFile]) -> Result<()> {
    let keys = |factor: &FactorLevels, source: &DesignFile| -> BTreeSet<String> {
        let levels = factor.levels.iter().map(|(_, level)| level);
        let sets = levels.flat_map(|level| [Some(&level.set), level.set_of.get(&source.name)]);
        sets.flatten().flat_map(Settings::keys).map(|key| numbered(&source.table, key)).collect()
    };
    for (number, factor) in factors.iter().enumerate() {
        let others = factors[..number].iter();
        for (other, source) in others.flat_map(|other| sources.iter().map(move |s| (other, s))) {
            if let Some(key) = keys(factor, source).intersection(&keys(other, source)).next() {
                bail!(
                    "factors: expected keys of their own in a grid, got {key} in {:?} and in {:?}",
                    other.name,
                    factor.name
                );
            }
        }
    }
    Ok(())
}

/// All set-ups of the designs `sources`, the base first.
pub fn setups(
    file: &StudyFile,
    factors: &[FactorLevels],
    sources: &[DesignFile],
) -> Result<Vec<Setup>> {
    let base = Setup {
        name: "base".to_owned(),
        levels: BTreeMap::new(),
        settings: vec![file.base.clone()],
    };
    let with = |setup: &Setup, factor: &FactorLevels, (label, level): &(String, Level)| {
        let mut setup = setup.clone();
        let own = format!("{} = {label}", factor.name);
        setup.name = if setup.levels.is_empty() { own } else { format!("{}, {own}", setup.name) };
        setup.levels.insert(factor.name.clone(), label.clone());
        setup.settings.push(level.clone());
        setup
    };
    let mut all = vec![base.clone()];
    match file.arrangement {
        FactorArrangement::OneAtATime => {
            for factor in factors {
                all.extend(factor.levels.iter().map(|level| with(&base, factor, level)));
            }
        }
        FactorArrangement::Grid => {
            check_keys(factors, sources)?;
            let count = factors
                .iter()
                .try_fold(1usize, |n, f| n.checked_mul(f.levels.len()))
                .filter(|&n| n <= MOST);
            ensure!(count.is_some(), "factors: expected at most {MOST} combinations");
            let mut grid = vec![base.clone()];
            for factor in factors {
                let extended = grid.iter().flat_map(|setup| {
                    factor.levels.iter().map(move |level| with(setup, factor, level))
                });
                grid = extended.collect();
            }
            if !factors.is_empty() {
                all.extend(grid);
            }
        }
    }
    for combination in &file.setups {
        let mut setup = base.clone();
        for (factor, level) in &combination.levels {
            let found = factors.iter().find(|f| f.name == *factor).and_then(|f| {
                let found = f.levels.iter().find(|l| l.0 == *level);
                found.map(|l| (f, l))
            });
            let Some((factor, level)) = found else {
                bail!(
                    "setups: {:?}: expected a factor and one of its levels, got {factor:?} = {level:?}",
                    combination.name
                );
            };
            setup = with(&setup, factor, level);
        }
        setup.name.clone_from(&combination.name);
        setup
            .settings
            .push(Level { set: combination.set.clone(), set_of: combination.set_of.clone() });
        all.push(setup);
    }
    let mut names = BTreeSet::new();
    for setup in &all {
        ensure!(
            names.insert(&setup.name),
            "setups: expected a name of its own for each, got {:?} twice",
            setup.name
        );
    }
    ensure!(all.len() <= MOST, "setups: expected at most {MOST}, got {}", all.len());
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(rest: &str) -> StudyFile {
        let text =
            format!("name = \"s\"\ndesigns = [\"d1.toml\"]\nmodels = [\"geometric\"]\n{rest}");
        toml::from_str(&text).expect("valid")
    }

    fn named(name: &str) -> DesignFile {
        let text = format!("name = \"{name}\"");
        DesignFile::of_text("own.toml".as_ref(), &text).expect("TOML").0
    }

    const TWO: &str = r#"
        [base.set]
        "mirror.reflectance" = 0.9
        [[factors]]
        name = "box"
        key = "led.reflectance"
        values = [0.8, 0.9]
        [[factors]]
        name = "reading"
        [[factors.levels]]
        name = "A"
        set_of.D2 = { "elements.shapes.0.apex_angle_deg" = 50.0 }
        set_of.D3 = { "mirror.reflectance" = 0.5 }
        [[factors.levels]]
        name = "B"
        set = { "mirror.reflectance" = 0.7 }
    "#;

    #[test]
    fn one_at_a_time_and_grids_have_the_set_ups_they_should() {
        let names = |file: &StudyFile| -> Vec<String> {
            let factors = factors(file).expect("valid");
            setups(file, &factors, &[]).expect("valid").into_iter().map(|s| s.name).collect()
        };
        let one = ["base", "box = 0.8", "box = 0.9", "reading = A", "reading = B"];
        assert_eq!(names(&file(TWO)), one);
        let grid = names(&file(&format!("arrangement = \"grid\"\n{TWO}")));
        assert_eq!(grid.len(), 5);
        assert_eq!(grid[2], "box = 0.8, reading = B");
    }

    #[test]
    fn later_settings_win_and_designs_have_their_own() {
        let file = file(&format!(
            "{TWO}\n[[setups]]\nname = \"mine\"\nlevels = {{ reading = \"A\" }}\nset = {{ \"led.height_mm\" = 0.2 }}"
        ));
        let all = setups(&file, &factors(&file).expect("valid"), &[]).expect("valid");
        let mine = all.last().expect("a set-up");
        let of = |design| mine.of(&named(design)).expect("settings");
        let reflectance = |design| of(design)["mirror.reflectance"].as_float();
        assert_eq!((reflectance("D2"), reflectance("D3")), (Some(0.9), Some(0.5)));
        assert_eq!(of("D2").len(), 3);
        assert_eq!(of("D1").len(), 2);
    }

    /// Films that are taken away, with keys of theirs before and after.
    #[test]
    fn an_entry_takes_its_keys_along_and_has_none_afterwards() {
        let file = file(
            "[base.set]\n\"films[2].gap_mm\" = 0.1\n[[factors]]\nname = \"film\"\nkey = \"films[2]\"\n\
             values = [\"\"]\n[[factors]]\nname = \"apex\"\nkey = \"films.1.top.apex_deg\"\nvalues = [90]\n\
             [[setups]]\nname = \"both\"\nlevels = { film = \"none\", apex = \"90\" }",
        );
        let all = setups(&file, &factors(&file).expect("valid"), &[]).expect("valid");
        let of =
            |name: &str| all.iter().find(|s| s.name == name).expect("a set-up").of(&named("D1"));
        let none = of("film = none").expect("settings");
        assert_eq!(none.into_keys().collect::<Vec<_>>(), ["films[2]"]);
        assert_eq!(of("apex = 90").expect("settings").len(), 2);
        let error = all.last().expect("both").of(&named("D1")).expect_err("no film").to_string();
        assert!(error.contains("got films[2] taken away"), "{error}");
    }

    #[test]
    fn factors_and_set_ups_that_are_none_are_refused() {
        for (text, word) in [
            ("[[factors]]\nname = \"a\"", "neither or both"),
            ("[[factors]]\nname = \"a\"\nkey = \"k\"\nvalues = []", "at least one level"),
            ("[[factors]]\nname = \"a\"\nkey = \"k\"\nvalues = [1, 1]", "twice"),
            ("[[setups]]\nname = \"x\"\nlevels = { y = \"z\" }", "one of its levels"),
            ("[[setups]]\nname = \"base\"", "twice"),
        ] {
            let file = file(text);
            let error = factors(&file).and_then(|f| setups(&file, &f, &[])).expect_err(text);
            assert!(error.to_string().contains(word), "{error}");
        }
    }
}
