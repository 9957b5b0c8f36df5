// SPDX-License-Identifier: MIT OR Apache-2.0
//! A checked study: reads the study file and its designs, makes every set-up's designs and checks
//! them.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use design::Design;
use results::study::LeftOutEntry;
use runtime::provenance::FileRecord;

use super::checks;
use super::file::{Level, StudyFile};
use super::setups::{self, FactorLevels, Setup};
use super::targets::Targets;
use crate::checked_file::{CheckedFile, Texts};
use crate::design_file::DesignFile;

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Keys of the file as written; factors, set-ups and targets are checked below.
    pub file: StudyFile,
    /// Factors and their levels.
    pub factors: Vec<FactorLevels>,
    /// Set-ups with the designs they make, the base first.
    pub setups: Vec<(Setup, Vec<Design>)>,
    /// Set-ups without a valid design, and why.
    pub impossible: Vec<LeftOutEntry>,
    /// Target figures.
    pub targets: Targets,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
}

/// Reads and checks the study at `path` and all its designs; `paths` replaces its own number of
/// paths.
///
/// # Errors
/// A file that cannot be read; a set-up whose design is invalid.
pub fn load(path: &Path, texts: &Texts, paths: Option<u64>) -> Result<Study> {
    CheckedFile::load(path, texts, |file| check(file, paths))
}

fn check(mut head: CheckedFile<StudyFile>, paths: Option<u64>) -> Result<Study> {
    let file = head.keys.clone();
    let paths = paths.or(file.paths);
    checks::head(&file, paths)?;
    let sources = file.designs.iter().map(|name| head.design("designs", name));
    let sources: Vec<DesignFile> = sources.collect::<Result<_>>()?;
    checks::sources(&sources)?;
    let targets = match (&file.targets, &file.targets_file) {
        (Some(_), Some(_)) => {
            bail!("targets: expected one of `targets` and `targets_file`, got both")
        }
        (Some(table), None) => Targets::new(table, &file.scales)?,
        (None, Some(name)) => {
            let (path, table) = head.toml("targets_file", name)?;
            Targets::new(&table, &file.scales)
                .with_context(|| format!("targets_file: `{}`", path.display()))?
        }
        (None, None) => Targets::new(&toml::Table::new(), &file.scales)?,
    };
    let targets = targets.with_probes(&file.probes);
    let factors = setups::factors(&file)?;
    let (setups, impossible) = designs(&file, &factors, &sources, paths)?;
    for (setup, designs) in &setups {
        checks::designs(designs, &file.models)
            .with_context(|| format!("set-up {:?}", setup.name))?;
    }
    checks::targets(&file, &targets, &setups[0].1, &file.models)?;
    for probe in &file.probes {
        checks::probe(probe, &setups[0].1)?;
    }
    for design in setups.iter().flat_map(|(_, designs)| designs) {
        head.record(design.provenance.all_named());
    }
    Ok(Study { file, factors, setups, impossible, targets, inputs: head.inputs })
}

/// Set-ups with their designs.
type Possible = Vec<(Setup, Vec<Design>)>;

/// The designs of every set-up; set-ups without valid designs apart.
fn designs(
    file: &StudyFile,
    factors: &[FactorLevels],
    sources: &[DesignFile],
    paths: Option<u64>,
) -> Result<(Possible, Vec<LeftOutEntry>)> {
    let (mut possible, mut impossible) = (Possible::new(), Vec::new());
    for setup in setups::setups(file, factors, sources)? {
        if paths.is_some() {
            let key = "trace.paths";
            let sets = |level: &Level| {
                level.set.contains_key(key) || level.set_of.values().any(|s| s.contains_key(key))
            };
            ensure!(
                !setup.settings.iter().any(sets),
                "set-up {:?}: {key}: expected no such key, as `paths` of the study or the command holds for all of its traces",
                setup.name
            );
        }
        let named = setup.settings.iter().flat_map(|level| level.set_of.keys());
        for design in named {
            ensure!(
                sources.iter().any(|s| s.name == *design),
                "set-up {:?}: set_of.{design}: expected the name of a design of the study",
                setup.name
            );
        }
        let designs: Result<Vec<Design>> = sources.iter().map(|s| make(s, &setup, paths)).collect();
        match designs {
            Ok(designs) => {
                check_effects(&setup, sources)
                    .with_context(|| format!("set-up {:?}", setup.name))?;
                possible.push((setup, designs));
            }
            Err(why) if file.skip_impossible && !possible.is_empty() => {
                impossible.push(LeftOutEntry { setup: setup.name, why: format!("{why:#}") });
            }
            Err(why) => return Err(why.context(format!("set-up {:?}", setup.name))),
        }
    }
    Ok((possible, impossible))
}

/// Refuses levels that move no package, also where another level states the places.
fn check_effects(setup: &Setup, sources: &[DesignFile]) -> Result<()> {
    for source in sources {
        let table = source.table_with(&setup.of(source)?)?;
        for level in &setup.settings {
            let of_design = level.set_of.get(&source.name);
            for settings in [Some(&level.set), of_design].into_iter().flatten() {
                source.check_effect(settings, &table)?;
            }
        }
    }
    Ok(())
}

/// The design that `setup` makes of `source`.
fn make(source: &DesignFile, setup: &Setup, paths: Option<u64>) -> Result<Design> {
    let mut design = source.with(&setup.of(source)?)?;
    if let Some(paths) = paths {
        design.trace.paths = paths;
    }
    Ok(design)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in design::EMBEDDED {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        folder
    }

    fn refused(text: &str) -> String {
        let folder = folder();
        let path = folder.path().join("study.toml");
        std::fs::write(&path, text).expect("written");
        format!("{:#}", load(&path, &Texts::new(), None).expect_err(text))
    }

    const HEAD: &str = "name = \"s\"\ndesigns = [\"d1.toml\", \"d2.toml\"]\nmodels = [\"geometric\", \"hybrid\"]\n";

    #[test]
    fn every_set_up_has_the_designs_it_should() {
        let folder = folder();
        let path = folder.path().join("study.toml");
        let text = format!(
            "{HEAD}paths = 5000\n[base.set]\n\"led.reflectance\" = 0.5\n[[factors]]\nname = \"angle\"\n[[factors.levels]]\nname = \"A\"\nset_of.D2 = {{ \"elements.shapes.0.apex_angle_deg\" = 50.0 }}"
        );
        std::fs::write(&path, text).expect("written");
        let study = load(&path, &Texts::new(), None).expect("valid");
        assert_eq!(study.setups.len(), 2);
        let [d1, d2] = &study.setups[1].1[..] else { panic!("two designs") };
        assert!((d1.led.reflector.reflectance() - 0.5).abs() < 1e-15 && d2.trace.paths == 5000);
        let apex = |d: &Design| match d.elements.shapes[0] {
            geometry::profile::Shape::Triangle { apex_deg, .. } => apex_deg,
            _ => 0.0,
        };
        assert!((apex(d2) - 50.0).abs() < 1e-15 && apex(d1).abs() < 1e-15);
        assert!((apex(&study.setups[0].1[1]) - 60.0).abs() < 1e-15);
        assert_eq!(study.inputs.len(), 3);
        assert_eq!(
            load(&path, &Texts::new(), Some(7000)).expect("valid").setups[0].1[0].trace.paths,
            7000
        );
    }

    /// A study of a backlight whose walls are two formulas.
    fn backlight(rest: &str) -> Result<Study> {
        let folder = tempfile::tempdir()?;
        let walls = "inner_size_mm = \"5 * array.pitch_mm\"";
        let text = design::NEW_BACKLIGHT.replace("NAME", "own");
        let text = text.replace("inner_size_mm = [32.0, 24.0]", walls);
        std::fs::write(folder.path().join("own.toml"), text)?;
        let path = folder.path().join("study.toml");
        let head = "name = \"s\"\ndesigns = [\"own.toml\"]\nmodels = [\"geometric\"]";
        std::fs::write(&path, format!("{head}\n{rest}"))?;
        load(&path, &Texts::new(), None)
    }

    #[test]
    fn studies_name_films_and_state_formulas() {
        let study = backlight(
            "[[factors]]\nname = \"stack\"\nkey = \"films\"\n\
             values = [[\"plate\", \"upper_prisms\", \"lower_prisms\"], [\"upper_prisms\", \"plate\"]]\n\
             [[factors]]\nname = \"without\"\nkey = \"films.lower_prisms\"\nvalues = [\"\"]\n\
             [[factors]]\nname = \"pitch\"\nkey = \"array.pitch_mm\"\nvalues = [9.0, \"14 * led.size_mm[1]\"]\n\
             [[factors]]\nname = \"thick\"\nkey = \"films.plate.thickness_mm\"\nvalues = [2.0]",
        );
        let study = study.expect("valid");
        let [plate, lower, upper] = ["plate", "lower_prisms", "upper_prisms"];
        let expected: [(&[(&str, f64)], f64); 7] = [
            (&[(plate, 5.0), (lower, 6.51), (upper, 6.72)], 40.0),
            (&[(plate, 5.0), (upper, 6.51), (lower, 6.72)], 40.0),
            (&[(upper, 5.0), (plate, 5.21)], 40.0),
            (&[(plate, 5.0), (upper, 6.51)], 40.0),
            (&[(plate, 5.0), (lower, 6.51), (upper, 6.72)], 45.0),
            (&[(plate, 5.0), (lower, 6.51), (upper, 6.72)], 35.0),
            (&[(plate, 5.0), (lower, 7.01), (upper, 7.22)], 40.0),
        ];
        assert_eq!(study.setups.len(), expected.len());
        for ((setup, designs), (films, walls_mm)) in study.setups.iter().zip(expected) {
            let [design] = &designs[..] else { panic!("one design") };
            let at = &setup.name;
            assert_eq!(design.housing_half_mm(), Some([0.5 * walls_mm; 2]), "{at}");
            assert_eq!(design.solids.len(), films.len(), "{at}");
            for (film, (name, z_mm)) in design.solids.iter().zip(films) {
                let ([low_mm, _], _) = film.film_mm().expect("a film");
                assert_eq!(film.name(), *name, "{at}");
                assert!((low_mm - z_mm).abs() < 1e-9, "{at}: {name} at {low_mm} mm");
            }
        }
        for (text, words) in [
            ("[base.set]\nfilms = [\"plate\", \"prisms\"]", "got \"prisms\""),
            ("[base.set]\n\"films.prisms.gap_mm\" = 1", "got `prisms`"),
            (
                "[base.set]\n\"films.plate.thickness_mm\" = 1\n\"films[1]\" = \"\"",
                "got films[1] taken away",
            ),
            (
                "arrangement = \"grid\"\n[[factors]]\nname = \"a\"\nkey = \"films[2]\"\nvalues = [\"\"]\n\
                 [[factors]]\nname = \"b\"\nkey = \"films.lower_prisms\"\nvalues = [\"\"]",
                "got films[2] in",
            ),
            ("[base.set]\n\"array.pitch_mm\" = \"8 / 2\"", "array.pitch_mm: expected a number, or"),
        ] {
            let said = format!("{:#}", backlight(text).expect_err(text));
            assert!(said.contains(words) && said.contains("study.toml"), "{said}");
        }
    }

    #[test]
    fn bad_studies_name_set_up_file_and_key() {
        for (text, words) in [
            (
                "[base.set]\n\"led.reflectance\" = 2.0",
                &["base", "d1.toml", "led.reflectance", "0 to 1"][..],
            ),
            ("[base.set]\n\"led.colour\" = 2.0", &["d1.toml", "led.colour", "no such key"]),
            ("[base.set]\n\"led.reflectance\" = \"high\"", &["d1.toml", "expected"]),
            ("paths = 5000\n[base.set]\n\"trace.paths\" = 6000", &["base", "trace.paths", "paths"]),
            (
                "[targets.D9.geometric_100um]\nuniformity = 0.8",
                &["targets.D9.geometric_100um", "D1.geometric_100um"],
            ),
            (
                "[targets.D1.geometric_100m]\nuniformity = 0.8",
                &["targets.D1.geometric_100m", "D2.hybrid_10um"],
            ),
            ("[targets]", &["targets", "at least one"]),
            (
                "[targets.D1.geometric_100um]\nuniformity = 75.0",
                &["targets.D1.geometric_100um.uniformity", "0 to 1", "75"],
            ),
            (
                "arrangement = \"grid\"\n[[factors]]\nname = \"f\"\nkey = \"led.reflectance\"\nvalues = [0.5]\n[[factors]]\nname = \"g\"\nkey = \"led.reflectance\"\nvalues = [0.6]",
                &["factors", "led.reflectance", "\"f\"", "\"g\""],
            ),
            ("[base]\nset_of.D9 = { a = 1 }", &["set_of.D9"]),
            ("colour = 1", &["colour: no such key"]),
            ("paths = 3", &["paths", "1000"]),
            ("targets_file = \"none.toml\"", &["targets_file", "none.toml"]),
            (
                "[[probes]]\ndesign = \"D1\"\nelement = 40\nranges_deg = [[20, 30]]",
                &["probes", "element 40"],
            ),
            (
                "[[probes]]\ndesign = \"D1\"\nelement = 4\nranges_deg = [[20, 30], [25, 90]]",
                &["probes.ranges_deg", "25.0, 90.0"],
            ),
            (
                "[[probes]]\ndesign = \"D1\"\nelement = 4\nranges_deg = []",
                &["probes.ranges_deg", "got []"],
            ),
            (
                "[[probes]]\ndesign = \"D1\"\nelement = 4\nranges_deg = [[20, 30]]\ntarget = 1.5",
                &["probes.target", "1.5"],
            ),
            (
                "[[probes]]\ndesign = \"D1\"\nelement = 4\nranges_deg = [[20, 30]]\nscale = 0",
                &["probes.scale", "above 0"],
            ),
        ] {
            let error = refused(&format!("{HEAD}{text}"));
            for word in words.iter().chain(&["study.toml"]) {
                assert!(error.contains(word), "no {word} in: {error}");
            }
        }
        assert!(
            refused("name = \"\"\ndesigns = [\"d1.toml\"]\nmodels = [\"hybrid\"]").contains("name")
        );
        let twice = "name = \"s\"\ndesigns = [\"d1.toml\", \"d1.toml\"]\nmodels = [\"hybrid\"]";
        assert!(refused(twice).contains("\"D1\" twice"));
        assert!(refused("name = \"s\"\ndesigns = []\nmodels = [\"hybrid\"]").contains("designs"));
        assert!(
            refused("name = \"s\"\ndesigns = [\"bare-dome.toml\"]\nmodels = [\"hybrid\"]")
                .contains("smooth")
        );
    }
}
