// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests across the modules of an optimisation, on the designs of the paper.

use std::collections::BTreeMap;
use std::path::Path;

use design::dotted_keys::{self, Settings, number};
use metrics::{Estimate, spread};
use results::figure_entry::FigureEntry;
use results::paired_figure::PairedFigure;

use super::file::{ConstraintKeys, LimitKeys, TermKeys, VariableKeys};
use super::heights;
use super::limits::Limits;
use super::log::{Candidate, Generation, GenerationEnd, Log};
use super::objective::Objective;
use super::spline::BSpline;
use super::variables::Variables;
use crate::design_file::DesignFile;
use crate::ring_slopes::{RingSlopes, Side};

fn design(name: &str) -> DesignFile {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let path = root.join("data/designs").join(name);
    let text = std::fs::read_to_string(&path).expect("a design");
    DesignFile::new(path, toml::from_str(&text).expect("TOML"))
}

fn limits(text: &str) -> Limits {
    let keys: LimitKeys = toml::from_str(text).expect("TOML");
    Limits::new(&keys).expect("limits")
}

fn variables(name: &str, tables: &[&str]) -> Variables {
    let keys: Vec<VariableKeys> =
        tables.iter().map(|text| toml::from_str(text).expect("TOML")).collect();
    Variables::new(design(name), &keys, limits("")).expect("variables")
}

/// A backlight with walls by a formula.
fn backlight() -> DesignFile {
    let walls = "inner_size_mm = [\"6 * array.pitch_mm\", \"4 * array.pitch_mm + 1\"]";
    let text = design::NEW_BACKLIGHT.replace("NAME", "own");
    let text = text.replace("inner_size_mm = [32.0, 24.0]", walls);
    DesignFile::of_text(Path::new("own.toml"), &text).expect("TOML").0
}

fn backlight_variables(tables: &[&str]) -> Variables {
    let keys = tables.iter().map(|text| toml::from_str(text).expect("TOML"));
    let keys: Vec<VariableKeys> = keys.collect();
    Variables::new(backlight(), &keys, limits("")).expect("variables")
}

#[test]
fn walls_follow_a_pitch_that_a_search_moves() {
    const PITCH: &str = "key = \"array.pitch_mm\"\nfrom = 6.0\nto = 12.0";
    let variables = backlight_variables(&[PITCH]);
    assert!((variables.start().expect("a start")[0] - 1.0 / 3.0).abs() < 1e-15);
    for (coordinate, pitch_mm) in [(0.0, 6.0), (0.25, 7.5), (1.0, 12.0)] {
        let settings = variables.settings(&[coordinate]).expect("settings");
        let design = variables.source.with(&settings).expect("a design");
        let expected = [3.0 * pitch_mm, 2.0 * pitch_mm + 0.5];
        assert_eq!(design.housing_half_mm(), Some(expected), "{pitch_mm}");
        // The search reads the same number of the design.
        let file = DesignFile::new(
            "own.toml".into(),
            variables.source.table_with(&settings).expect("set"),
        );
        let key = "housing.inner_size_mm[2]";
        assert_eq!(design::formulas::number_at(&file.table, key), Some(4.0 * pitch_mm + 1.0));
    }

    // A formula of the problem in place of that of the design.
    let follows = "key = \"housing.inner_size_mm[2]\"\nvalue = \"3.5 * array.pitch_mm\"";
    let film = "key = \"films.plate.thickness_mm\"\nfrom = 1.0\nto = 2.0";
    let variables = backlight_variables(&[follows, PITCH, film]);
    assert_eq!((variables.dimension(), variables.start().expect("a start").len()), (2, 2));
    assert_eq!(variables.labels(), ["array.pitch_mm", "films.plate.thickness_mm"]);
    assert!(
        variables.is_set("films[1].thickness_mm") && !variables.is_set("films[2].thickness_mm")
    );
    let settings = variables.settings(&[0.5, 0.5]).expect("settings");
    let design = variables.source.with(&settings).expect("a design");
    assert_eq!(design.housing_half_mm(), Some([27.0, 15.75]));

    // A key by a formula starts where the formula is, and is then free of it.
    let walls = "key = \"housing.inner_size_mm[1]\"\nfrom = 40.0\nto = 60.0";
    let variables = backlight_variables(&[walls]);
    assert!((variables.start().expect("a start")[0] - 0.4).abs() < 1e-15);
    let settings = variables.settings(&[0.25]).expect("settings");
    let design = variables.source.with(&settings).expect("a design");
    assert_eq!(design.housing_half_mm(), Some([22.5, 16.5]));
}

const INNER: &str = "profile = \"inner_slope_deg\"\nfrom = -40.0\nto = 80.0";
const OUTER: &str = "profile = \"outer_slope_deg\"\nfrom = 0.0\nto = 90.0";

/// Linked keys keep their distances from the first, by names in either form.
#[test]
fn linked_keys_move_by_one_amount() {
    let keys = "keys = [\"array.pitch_mm\", \"led.size_mm.1\"]\nfrom = 4.0\nto = 12.0";
    let variables = variables("bare-dome.toml", &[keys]);
    let number = |key: &str| dotted_keys::get(&variables.source.table, key).and_then(number);
    let before = ["array.pitch_mm", "led.size_mm[2]"].map(|key| number(key).expect("a number"));
    let settings = variables.settings(&[0.25]).expect("settings");
    let after = ["array.pitch_mm", "led.size_mm[2]"].map(|key| settings[key].as_float());
    assert_eq!(after[0], Some(6.0));
    let moved = after[1].expect("a number") - before[1];
    assert!((moved - (6.0 - before[0])).abs() < 1e-12, "{moved}");
    let design = design("bare-dome.toml");
    let refused = |keys: &[&str]| {
        let keys: Vec<VariableKeys> =
            keys.iter().map(|text| toml::from_str(text).expect("TOML")).collect();
        let refused = Variables::new(design.clone(), &keys, limits(""));
        format!("{:#}", refused.expect_err("refused"))
    };
    let other = "key = \"led.size_mm[2]\"\nfrom = 0.1\nto = 0.2";
    assert!(refused(&[keys, other]).contains("led.size_mm[2] beside array.pitch_mm"));
    for (text, words) in [
        ("keys = []\nfrom = 1.0\nto = 2.0", "keys: expected at least one"),
        (
            "keys = [\"array.pitch_mm\", \"array.pitch_mm\"]\nfrom = 4.0\nto = 5.0",
            "array.pitch_mm twice",
        ),
        (
            "keys = [\"array.pitch_mm\", \"array.columns\"]\nfrom = 4.0\nto = 5.0",
            "real numbers that the design states, got array.columns",
        ),
        ("keys = [\"array.pitch_mm\"]\nchoices = [4.0, 5.0]", "keys: expected them with `from`"),
        ("key = \"films[1]\"\nchoices = [\"\", \"x\"]", "studies alone take entries of lists away"),
    ] {
        let said = refused(&[text]);
        assert!(said.contains("variables[1]") && said.contains(words), "{said}");
    }
}

/// One coefficient for each ring reproduces the slopes of every ring that is not clipped.
#[test]
fn the_start_is_the_design() {
    let variables = variables("d3.toml", &[INNER, OUTER]);
    assert_eq!(variables.dimension(), 34);
    let point = variables.start().expect("a start");
    let settings = variables.settings(&point).expect("settings");
    let [before, after] = [Settings::new(), settings].map(|settings| {
        let design = variables.source.with(&settings).expect("valid");
        RingSlopes::of(&design).expect("slopes")
    });
    let mut clipped = before.clone();
    clipped.clip(90.0, 0.0);
    let mut same = 0;
    for side in [Side::Inner, Side::Outer] {
        let before = clipped.values(side).into_iter().zip(before.values(side));
        for ((clipped, before), after) in before.zip(after.values(side)) {
            assert!((clipped - after).abs() < 1e-9, "{side:?} {clipped} {after}");
            same += usize::from((before - after).abs() < 1e-9);
        }
    }
    assert!(same >= 32, "{same} of 34 unclipped");
}

#[test]
fn profiles_of_few_coefficients_are_splines_over_the_rings() {
    let outer = format!("{OUTER}\nknots = 4\nrings = [6, 16]");
    let variables = variables("d3.toml", &[&outer]);
    let point = [0.5, 0.9, 0.7, 0.8];
    let coefficients = variables.coefficients(&point);
    let settings = variables.settings(&point).expect("settings");
    let made = variables.source.with(&settings).expect("valid");
    let found = RingSlopes::of(&made).expect("slopes").values(Side::Outer);
    for ring in 6..=16 {
        let share = f64::from(ring - 6) / 10.0;
        let expected = BSpline::new(4).value(&coefficients, share);
        let found = found[ring as usize - 1];
        assert!((found - expected).abs() < 1e-9, "{ring}: {found} {expected}");
    }
    // Rings outside keep their own.
    assert!((found[16] - 90.0).abs() < 1e-9);
    let labels = variables.labels();
    assert_eq!(labels[3], "outer_slope_deg 4");
}

#[test]
fn keys_are_rounded_counted_and_chosen() {
    let variables = variables(
        "bare-dome.toml",
        &[
            "key = \"array.pitch_mm\"\nfrom = 5.0\nto = 9.0\nresolution = 0.5",
            "key = \"array.columns\"\nfrom = 1\nto = 4",
            "key = \"led.reflection\"\nchoices = [\"lambertian\", \"specular\"]",
        ],
    );
    for (point, pitch, columns, word) in [
        ([0.0, 0.0, 0.0], 5.0, 1, "lambertian"),
        ([0.4, 0.49, 0.49], 6.5, 2, "lambertian"),
        ([0.45, 0.51, 0.5], 7.0, 3, "specular"),
        ([1.0, 1.0, 1.0], 9.0, 4, "specular"),
    ] {
        let settings = variables.settings(&point).expect("settings");
        assert_eq!(settings["array.pitch_mm"].as_float(), Some(pitch));
        assert_eq!(settings["array.columns"].as_integer(), Some(columns));
        assert_eq!(settings["led.reflection"].as_str(), Some(word));
    }
    // Whole numbers within bounds that are none, and their values are those of the design.
    let within =
        self::variables("bare-dome.toml", &["key = \"array.columns\"\nfrom = 1.4\nto = 3.4"]);
    for (at, columns) in [(0.0, 2), (0.4, 2), (0.6, 3), (1.0, 3)] {
        let settings = within.settings(&[at]).expect("settings");
        assert_eq!(settings["array.columns"].as_integer(), Some(columns));
        assert_eq!(within.coefficients(&[at]), [columns as f64]);
    }
    assert_eq!(variables.at_bounds(&[0.0, 0.5, 1.0]), ["array.pitch_mm at 5"]);
    // The design's own values: 8.3 mm, two columns, the second choice.
    let start = variables.start().expect("a start");
    for (found, expected) in start.iter().zip([0.825, 1.0 / 3.0, 0.75]) {
        assert!((found - expected).abs() < 1e-12, "{start:?}");
    }
}

#[test]
fn limits_that_are_broken_are_named() {
    let d3 = design("d3.toml").with(&Settings::new()).expect("valid");
    assert_eq!(limits("").broken(&d3), None);
    for (text, words) in [
        ("draft_deg = 3.0", &["limits.draft_deg", "below 3", "element"][..]),
        ("apex_deg = 100.0", &["limits.apex_deg", "below 100", "element"]),
        ("total_height_mm = 0.9", &["limits.total_height_mm", "above 0.9"]),
        ("ring_width_um = 120.0", &["limits.ring_width_um", "below 120"]),
        ("tip_radius_um = 1.0", &["limits.tip_radius_um", "below 1"]),
        ("valley_radius_um = 1.0", &["limits.valley_radius_um", "below 1"]),
    ] {
        let broken = limits(text).broken(&d3).expect(text);
        for word in words {
            assert!(broken.contains(word), "no `{word}` in {broken}");
        }
    }
}

#[test]
fn outlines_that_lean_are_refused_unless_allowed() {
    let file = design("bare-dome.toml");
    let rows = "meridian_mm = [[0.0, 1.0], [1.8, 0.8], [1.7, 0.0]]";
    let dome: toml::Table = toml::from_str(rows).expect("TOML");
    let settings = Settings::from([("dome".to_owned(), toml::Value::Table(dome))]);
    let leaning = file.with(&settings).expect("valid");
    let broken = limits("").broken(&leaning).expect("it leans");
    assert!(broken.contains("limits.overhang"), "{broken}");
    assert_eq!(limits("overhang = true").broken(&leaning), None);
}

/// Coefficients of heights that follow a sphere, and those of the profile that made a dome.
#[test]
fn heights_of_a_dome_give_it_again() {
    let freeform = "../gallery/d3-freeform/design.toml";
    for (name, knots, near_mm) in [("bare-dome.toml", 12, 2e-3), (freeform, 10, 1e-4)] {
        let height = format!("profile = \"height_mm\"\nknots = {knots}\nfrom = 0.0\nto = 1.5");
        let variables = variables(name, &[&height]);
        let point = variables.start().expect("a start");
        let settings = variables.settings(&point).expect("settings");
        let [before, after] = [Settings::new(), settings]
            .map(|settings| variables.source.with(&settings).expect("valid"));
        let (before, after) = (before.base().expect("round"), after.base().expect("round"));
        assert!((after.reach_mm() - before.reach_mm()).abs() < 1e-9);
        for k in 0..=20 {
            let radius = 1.6 * f64::from(k) / 20.0;
            let (a, b) = (before.height_at(radius), after.height_at(radius));
            assert!((a - b).abs() < near_mm, "{name} {radius}: {a} {b}");
        }
        let rise = (after.height_at(0.0) - after.height_at(1e-3)) / 1e-3;
        assert!(rise.abs() < 5e-3, "{rise}");
        let at = heights::abscissae(knots);
        assert!(at.len() == knots && at[0].abs() < 1e-12 && at.is_sorted());
    }
}

/// Rings stand on the dome of their own candidate: those of a former dome, some of which do not fit
/// it, do not refuse it.
#[test]
fn rings_follow_the_dome_that_varies_with_them() {
    let height = "profile = \"height_mm\"\nknots = 6\nfrom = 0.2\nto = 1.2";
    let variables = variables("d3.toml", &[height, INNER, OUTER]);
    let point = |heights: [f64; 6]| [&heights[..], &[0.3; 17], &[0.5; 17]].concat();
    let falling = point([0.9, 0.9, 0.8, 0.6, 0.4, 0.1]);
    let settings = variables.settings(&falling).expect("settings");
    variables.source.with(&settings).expect("a design");
    let resumed = variables.resumed(&settings, None).expect("variables");
    let settings = resumed.settings(&point([0.3, 0.3, 1.0, 1.0, 0.6, 0.1]));
    let settings = settings.expect("settings");
    let rising = resumed.source.with(&settings).expect("a design");
    let base = rising.base().expect("a dome");
    let steepest = base.slopes_deg([0.3, 0.8])[0];
    assert!(steepest < -30.0, "{steepest}");
    // The former rings cannot stand there.
    let mut dome_alone = settings;
    dome_alone.remove("elements.shapes");
    let refused = resumed.source.with(&dome_alone);
    let refused = refused.err().map(|error| error.to_string());
    let refused = refused.expect("no design");
    assert!(refused.contains("steeper than the dome"), "{refused}");
}

fn objective(terms: &[&str], constraints: &[&str]) -> Objective {
    let terms: Vec<TermKeys> =
        terms.iter().map(|text| toml::from_str(text).expect("TOML")).collect();
    let constraints: Vec<ConstraintKeys> =
        constraints.iter().map(|text| toml::from_str(text).expect("TOML")).collect();
    let design = design("bare-dome.toml");
    let objective = Objective::new(&terms, &constraints, &design, Path::new(""));
    objective.expect("an objective").0
}

#[test]
fn objectives_add_weighted_terms_and_their_replicates() {
    let objective = objective(
        &[
            "figure = \"uniformity\"\nweight = 2.0",
            "figure = \"extraction_efficiency\"\ngoal = \"minimise\"\nscale = 0.5",
            "figure = \"peak_angle_deg\"\ngoal = \"target\"\ntarget = 60.0\nscale = 5.0",
        ],
        &["figure = \"uniformity\"\nat_least = 0.8\nmargin = 2.0"],
    );
    let figure = |key: &str, value: f64, without: [f64; 2]| {
        (key.to_owned(), PairedFigure::new(value, without.to_vec()))
    };
    let figures = vec![
        figure("uniformity", 0.7, [0.69, 0.71]),
        figure("extraction_efficiency", 0.9, [0.91, 0.89]),
        figure("peak_angle_deg", 50.0, [55.0, 65.0]),
    ];
    let error = figures[0].1.entry.standard_error;
    let judged = objective.of_figures(figures);
    let sum = &judged.objective;
    assert!((sum.value - (-1.4 + 1.8 + 2.0)).abs() < 1e-12);
    for (found, expected) in sum.without.iter().zip([-1.38 + 1.82 + 1.0, -1.42 + 1.78 + 1.0]) {
        assert!((found - expected).abs() < 1e-12);
    }
    assert!((sum.standard_error() - spread(&sum.without)).abs() < 1e-15);
    assert!((judged.miss - (0.8 + 2.0 * error - 0.7) / 0.8).abs() < 1e-12);
}

/// What is said of a figure is said of the objective that it makes, and of its change.
#[test]
fn an_objective_is_between_two_ends_where_its_figures_are() {
    let objective = objective(
        &[
            "figure = \"uniformity\"\nweight = 2.0",
            "figure = \"peak_angle_deg\"\ngoal = \"target\"\ntarget = 60.0\nscale = 5.0",
        ],
        &[],
    );
    let judged = |uniformity: Estimate, held: f64, peak: f64| {
        let uniformity = PairedFigure {
            entry: FigureEntry::new(uniformity),
            without: vec![held - 0.01, held + 0.01],
        };
        let peak = PairedFigure::new(peak, vec![peak; 2]);
        let figures = [("uniformity", uniformity), ("peak_angle_deg", peak)];
        objective.of_figures(figures.map(|(key, figure)| (key.to_owned(), figure)).to_vec())
    };
    let resolved = judged(Estimate::new(0.7, 0.01), 0.7, 50.0);
    assert_eq!(objective.entry(&resolved).interval, None);
    let open = judged(Estimate::between(0.2, 0.8, 0.0), 0.5, 50.0);
    let [low, high] = open.figures[0].1.entry.interval.expect("not resolved");
    let found = objective.entry(&open).interval.expect("not resolved");
    assert!((found[0] - (2.0 - 2.0 * high)).abs() < 1e-12, "{found:?} {high}");
    assert!((found[1] - (2.0 - 2.0 * low)).abs() < 1e-12, "{found:?} {low}");

    // Replicates that hold one place do not contain that the values read another.
    let jumped = judged(Estimate::new(0.9, 0.01), 0.7, 50.0);
    let [low, high] = objective.change(&jumped, &resolved).interval.expect("not resolved");
    assert!(low < -0.4 && high > 0.0, "{low} {high}");
    assert!(jumped.objective.change(&resolved.objective).standard_error > 0.1);
    let moved = judged(Estimate::new(0.9, 0.01), 0.9, 45.0);
    let change = objective.change(&moved, &resolved);
    assert!(change.interval.is_none() && (change.value - 0.6).abs() < 1e-12, "{change:?}");
}

fn generation(number: usize) -> Generation {
    let candidate = |k: usize| Candidate {
        point: vec![0.1 * k as f64, 1.0 / 3.0],
        coefficients: vec![k as f64, 2.0],
        choices: BTreeMap::from([("a".to_owned(), "b.txt".into())]),
        value: (k > 0).then_some(-0.5 / 3.0),
        objective: (k > 0).then_some(-0.5 / 3.0),
        standard_error: (k > 0).then_some(0.01),
        interval: (k > 0).then_some([-0.3, 0.1]),
        figures: BTreeMap::from([(
            "uniformity".to_owned(),
            FigureEntry::new(Estimate::new(0.7, 0.01)),
        )]),
        feasible: k > 0,
        refused: (k == 0).then(|| "line 1\nline 2".to_owned()),
    };
    Generation {
        candidates: (0..2).map(candidate).collect(),
        end: GenerationEnd {
            stage: 1,
            generation: number,
            candidates: 2,
            paths: 4096,
            next_paths: 8192,
            noise: Some(0.7),
            tables: 0,
            seconds: 1.5,
        },
    }
}

fn points(generation: &Generation) -> Vec<Vec<f64>> {
    generation.candidates.iter().map(|c| c.point.clone()).collect()
}

/// Whole generations are read back, what follows the last of them is ignored.
#[test]
#[ignore = "slow: 7 s"]
fn logs_may_be_cut_at_any_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.jsonl");
    let all: Vec<Generation> = (1..=2).map(generation).collect();
    let mut ends = Vec::new();
    let mut log = Log::open(&path, "key", false).expect("a log");
    for generation in &all {
        log.add(generation).expect("written");
        ends.push(std::fs::metadata(&path).expect("a file").len() as usize);
    }
    let whole = std::fs::read(&path).expect("a log");
    for cut in 0..=whole.len() {
        std::fs::write(&path, &whole[..cut]).expect("cut");
        let mut log = Log::open(&path, "key", true).expect("a log");
        // A line without its end of line is whole.
        let expected = ends.iter().filter(|end| cut + 1 >= **end).count();
        for generation in &all[..expected] {
            let read = log.replayed(generation.end.generation, &points(generation));
            let read = read.expect("the same");
            assert_eq!(read.as_ref(), Some(generation), "{cut}");
        }
        let more = log.replayed(1, &points(&all[0])).expect("none");
        assert_eq!(more, None, "{cut}");
        for generation in &all[expected..] {
            log.add(generation).expect("written");
        }
        assert!(whole == std::fs::read(&path).expect("a log"), "{cut}");
    }
}

#[test]
fn logs_of_other_searches_are_refused_and_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.jsonl");
    let mut log = Log::open(&path, "key", false).expect("a log");
    log.add(&generation(1)).expect("written");
    let whole = std::fs::read(&path).expect("a log");
    let said = Log::open(&path, "other", true).err().expect("refused");
    assert!(format!("{said:#}").contains("log.jsonl"), "{said:#}");
    assert!(whole == std::fs::read(&path).expect("a log"));
    // The same key with other candidates is no log of this search either.
    let mut log = Log::open(&path, "key", true).expect("a log");
    assert!(log.replayed(1, &[vec![0.5, 0.5], vec![0.5, 0.6]]).is_err());
}

/// A search that made its selection for lack of time goes on from its last generation, and its log
/// becomes that of a search without an end.
#[test]
fn searches_ended_by_a_budget_go_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let [short, whole] = ["short.jsonl", "whole.jsonl"].map(|name| folder.path().join(name));
    for (path, numbers) in [(&short, &[1, 0][..]), (&whole, &[1, 2, 0])] {
        let mut log = Log::open(path, "key", false).expect("a log");
        for number in numbers {
            log.add(&generation(*number)).expect("written");
        }
    }
    let mut log = Log::open(&short, "key", true).expect("a log");
    let first = generation(1);
    let read = log.replayed(1, &points(&first)).expect("the same");
    assert_eq!(read, Some(first));
    for number in [2, 0] {
        let next = generation(number);
        let read = log.replayed(number, &points(&next)).expect("none");
        assert_eq!(read, None);
        log.add(&next).expect("written");
    }
    let [short, whole] = [short, whole].map(|path| std::fs::read(path).expect("a log"));
    assert!(short == whole);
}
