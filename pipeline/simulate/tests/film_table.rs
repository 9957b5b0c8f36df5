// SPDX-License-Identifier: MIT OR Apache-2.0
//! Films by the table of the whole stack against films traced one by one.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use design::Design;
use design::schema::FilmTracing;
use metrics::Estimate;
use results::ModelResult;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::film_table::{FilmTreatment, treatment};
use simulate::model::Model;
use simulate::model_writer::{Destination, ModelWriter, Output};
use simulate::observation::Observation;
use simulate::run::Run;
use simulate::trace::observe;

/// Four LEDs on a white board between walls.
const BOX: &str = r#"
name = "stack"
mirror = { kind = "BOARD", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.5, 0.4], height_mm = 0.15, reflection = "lambertian", reflectance = 0.8 }
array = { columns = 2, rows = 2, pitch_mm = 6.0 }
housing = { WALLS, height_mm = 8.0 }
receiver = { plane_height_mm = 7.0, bin_mm = 1.5, average = "none" }
far_field = { bin_deg = 10.0, azimuth_bin_deg = 45.0 }

[[receivers]]
name = "luminance"
kind = "luminance"
position_mm = [0.0, 0.0, 7.0]
size_mm = [12.0, 12.0]
bins = [2, 2]
theta_bin_deg = 30.0
phi_bin_deg = 360.0

[[receivers]]
name = "axis"
kind = "luminance"
position_mm = [1.0, 0.0, 6.9]
size_mm = [8.0, 8.0]
bins = [1, 1]
theta_bin_deg = 15.0
theta_max_deg = 15.0
phi_bin_deg = 360.0
"#;

const LINE: &str = "light = { wavelength_nm = 550.0 }\n";
const CARRIED: &str = "light = { wavelength_nm = 550.0, polarization = \"carried\" }\n";
const BLUE: &str = r#"
[light]
step_nm = 30.0
[light.spectrum]
kind = "lines"
weighting = "photometric"
wavelength_nm = [450.0]
power = [1.0]
"#;

const PLATE: &str = r#"
[[films]]
name = "plate"
z_mm = 4.0
thickness_mm = 1.0
medium = { index = 1.49, scattering_per_mm = 2.6, g = 0.8, absorption_per_mm = 0.02 }
"#;
const DOTS: &str = r#"
[[films]]
name = "dots"
thickness_mm = 0.1
[films.medium]
index = 1.5
scattering_per_mm = 3.0
g = 0.5
[[films.medium.luminophores]]
name = "green"
absorption_per_mm = [[400, 4.0], [450, 3.2], [510, 1.5], [560, 0.0]]
quantum_yield = 0.9
emission = { peak_nm = 540, fwhm_nm = 40 }
"#;
const SHEETS: &str = r#"
[[films]]
name = "recycler"
thickness_mm = 0.2
medium = { index = 1.0 }
top = { kind = "polariser", axis_deg = 0.0, pass = { transmittance = 0.90, reflectance = 0.06 }, block = { transmittance = 0.03, reflectance = 0.94 } }

[[films]]
name = "panel"
thickness_mm = 0.3
medium = { index = 1.0 }
top = { kind = "polariser", axis_deg = 0.0, pass = { transmittance = [[0.0, 0.3], [40.0, 0.25], [80.0, 0.1]] } }
"#;

/// A milky plate, glue, a filter in contact, prisms in contact and haze in air.
const LAMINATE: &str = r#"
[[films]]
name = "glue"
gap_mm = 0.0
thickness_mm = 0.05
medium = { index = 1.41 }

[[films]]
name = "base"
gap_mm = 0.0
thickness_mm = 0.2
medium = { index = 1.65 }
bottom = { kind = "filter", transmittance = [[0.0, 0.9], [80.0, 0.7]], reflectance = 0.05 }

[[films]]
name = "prisms"
gap_mm = 0.0
thickness_mm = 0.1
medium = { index = 1.586 }
top = { kind = "prisms" }

[[films]]
name = "cover"
thickness_mm = 0.2
medium = { index = 1.5 }
bottom = { kind = "haze", total_transmittance = 0.9, haze = 0.6, scattered_width_deg = 30.0 }
"#;

/// Films with free edges.
fn small(films: &str) -> String {
    films.replace("thickness_mm", "size_mm = [9.0, 9.0]\nthickness_mm")
}

/// Crossed prisms, the lower ones along this direction.
fn prisms(z: &str, direction_deg: f64) -> String {
    let film = |name: &str, z: &str, direction_deg: f64| {
        format!(
            "[[films]]\nname = \"{name}\"\n{z}thickness_mm = 0.125\nmedium = {{ index = 1.586 }}\n\
             top = {{ kind = \"prisms\", direction_deg = {direction_deg:?} }}\n"
        )
    };
    film("lower", z, direction_deg) + &film("upper", "", direction_deg + 90.0)
}

/// A film with these two faces, over another.
fn faces(top: &str, bottom: &str) -> String {
    format!(
        "[[films]]\nname = \"relief\"\nthickness_mm = 0.2\nmedium = {{ index = 1.5 }}\n\
         top = {{ {top} }}\nbottom = {{ {bottom} }}\n"
    )
}

fn parsed(walls: &str, parts: &[&str]) -> Design {
    parsed_over("lambertian", walls, parts)
}

fn parsed_over(board: &str, walls: &str, parts: &[&str]) -> Design {
    // Keys of the top come before tables.
    let (keys, tables): (Vec<&str>, Vec<&str>) =
        parts.iter().partition(|part| !part.trim_start().starts_with('['));
    let share =
        if walls == "periodic" || walls == "absorbing" { "" } else { ", reflectance = 1.0" };
    let walls = format!("kind = {walls:?}{share}, inner_size_mm = [12.0, 12.0]");
    let lit = BOX.replace("BOARD", board).replace("WALLS", &walls);
    let text =
        lit.replacen("[[receivers]]", &(keys.concat() + "[[receivers]]"), 1) + &tables.concat();
    design::parse("own.toml", &text, Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

fn seen(design: &Design, paths: u64, seed: u64) -> Observation {
    let interrupt = Interrupt::default();
    let context = RunContext::quiet(&interrupt, seed);
    let surface = dome_surface(design, Model::Geometric, None).expect("no dome");
    observe(design, &surface, paths, "", context).expect("a trace")
}

/// Values and stated errors of a figure or an account over seeds.
#[derive(Default)]
struct OverSeeds(Vec<[f64; 2]>);

impl OverSeeds {
    fn mean(&self) -> f64 {
        self.0.iter().map(|[value, _]| value).sum::<f64>() / self.0.len() as f64
    }

    fn scatter(&self) -> f64 {
        let squares: f64 = self.0.iter().map(|[value, _]| (value - self.mean()).powi(2)).sum();
        (squares / (self.0.len() - 1) as f64).sqrt()
    }

    fn stated(&self) -> f64 {
        let squares: f64 = self.0.iter().map(|[_, error]| error * error).sum();
        (squares / self.0.len() as f64).sqrt()
    }
}

/// All resolved figures, and accounts that light reaches.
fn over_seeds(design: &Design, paths: u64, seeds: u64) -> BTreeMap<String, OverSeeds> {
    let mut all: BTreeMap<String, OverSeeds> = BTreeMap::new();
    for seed in 1..=seeds {
        let seen = seen(design, paths, seed);
        let figures = seen.estimates(design, |_| true);
        let figures = figures.into_iter().filter(|figure| figure.entry.ends().is_none());
        let figures = figures.filter(|figure| figure.entry.peak_place.is_off_axis());
        for figure in figures {
            let pair = [figure.entry.value, figure.entry.standard_error];
            all.entry(figure.key.into_owned()).or_default().0.push(pair);
        }
        for (account, share) in seen.ledger().accounts {
            if share.value > 1e-3 {
                all.entry(format!("account {account}"))
                    .or_default()
                    .0
                    .push([share.value, share.standard_error]);
            }
        }
    }
    all.retain(|_, over| over.0.len() as u64 == seeds);
    all
}

/// Seeds; a ratio of scatter and stated error has a standard error of 11 %.
const SEEDS: u64 = 40;
/// From 0.8 to 1.25, three of these beyond it.
const BAND: std::ops::Range<f64> = 0.55..1.65;
/// Largest difference of means in standard errors, of some four hundred.
const MOST: f64 = 4.5;

/// Asserts that figures, accounts and errors by table are those of films traced one by one.
fn assert_same(name: &str, design: &Design, paths: u64) {
    let FilmTreatment::Table(stack) = treatment(design) else { panic!("{name}: no table") };
    let table = stack.table(std::slice::from_ref(design), &[]).expect("films");
    let is_reciprocal = !["white", "laminate", "free edges"].iter().any(|word| name.contains(word));
    assert_eq!(table.looks_back(), is_reciprocal, "{name}");
    let mut traced = design.clone();
    traced.trace.films = FilmTracing::Traced;
    let by_table = over_seeds(design, paths, SEEDS);
    let by_film = over_seeds(&traced, paths, SEEDS);
    // Where no light takes an outcome of the table, both are the same to the bit.
    let up = |runs: &BTreeMap<String, OverSeeds>| runs["account escaped_up"].0.clone();
    assert_ne!(up(&by_table), up(&by_film), "{name}");
    let mut wrong = Vec::new();
    let mut compared = 0;
    for (key, table) in &by_table {
        let ratio = table.scatter() / table.stated();
        if table.stated() > 1e-12 && !BAND.contains(&ratio) {
            wrong.push(format!("{key}: scatter over stated error {ratio:.2}"));
        }
        let Some(films) = by_film.get(key) else { continue };
        let error = table.scatter().hypot(films.scatter()) / (SEEDS as f64).sqrt();
        let off = (table.mean() - films.mean()) / error.max(1e-12);
        compared += 1;
        if off.abs() > MOST {
            let (a, b) = (table.mean(), films.mean());
            wrong.push(format!("{key}: {a} by table, {b} film by film, {off:.1} errors"));
        }
    }
    assert!(compared > 12, "{name}: {compared}");
    assert!(by_table.contains_key("mean.axis"), "{name}: {:?}", by_table.keys());
    assert!(wrong.is_empty(), "{name}:\n{}", wrong.join("\n"));
}

#[test]
#[ignore = "slow: two stacks over 40 seeds, by table and film by film (30 s)"]
fn tables_of_stacks_see_what_is_traced_film_by_film() {
    assert_same("conversion", &parsed("specular", &[BLUE, PLATE, DOTS]), 6_400);
    let all = parsed("periodic", &[CARRIED, PLATE, &prisms("", 10.0), SHEETS]);
    assert_same("all", &all, 6_400);
}

#[test]
#[ignore = "nightly: thirteen stacks over 40 seeds, by table and film by film (300 s)"]
fn nightly_tables_of_more_stacks_see_what_is_traced_film_by_film() {
    let same = |name: &str, (walls, parts): (&str, &[&str]), paths: u64| {
        assert_same(name, &parsed(walls, parts), paths);
    };
    let turned = prisms("", 10.0);
    same("turned prisms", ("periodic", &[LINE, PLATE, &turned]), 12_800);
    same("polarisers", ("periodic", &[CARRIED, PLATE, SHEETS]), 12_800);
    same("carried between walls", ("lambertian", &[CARRIED, PLATE, &turned, SHEETS]), 3_200);
    same("plate between walls", ("lambertian", &[LINE, PLATE]), 12_800);
    same("plate between black walls", ("absorbing", &[LINE, PLATE]), 12_800);
    let (plate, laminate) = (small(PLATE), small(LAMINATE));
    same("films with free edges", ("lambertian", &[LINE, &plate, &laminate]), 12_800);
    let turned = small(&turned);
    same("prisms between edges", ("lambertian", &[LINE, &plate, &turned]), 12_800);
    let converting = [BLUE, PLATE, LAMINATE, DOTS];
    same("conversion in a laminate between walls", ("lambertian", &converting), 3_200);
    same("plate between mirrors", ("specular", &[LINE, PLATE]), 12_800);
    let reliefs = faces(
        "kind = \"microlenses\", cell = \"hexagonal\", height_um = 15.0, base_um = 45.0, direction_deg = 10.0",
        "kind = \"pyramids\", pressed_in = true, apex_deg = 100.0, direction_deg = 55.0",
    );
    same("reliefs", ("periodic", &[LINE, PLATE, &reliefs]), 12_800);
    same("laminate", ("specular", &[LINE, PLATE, LAMINATE]), 12_800);
    let white = "[[films]]\nname = \"white\"\nz_mm = 4.0\nthickness_mm = 1.0\nmedium = { index = 1.49 }\n\
                 top = { kind = \"lambertian\", transmitted = 0.85, reflected = 0.15 }\n";
    let straight = prisms("", 0.0);
    for (name, plate) in
        [("turbid plate over a mirror", PLATE), ("white plate over a mirror", white)]
    {
        let design = parsed_over("specular", "specular", &[LINE, plate, &straight]);
        assert_same(name, &design, 25_600);
    }
}

/// Light into a narrow cone that has been near the ends of films is read forwards, and all other as a sight:
/// none twice, none never.
#[test]
fn light_near_ends_is_read_in_one_way() {
    const FEW: u64 = 4;
    let (plate, turned) = (small(PLATE), small(&prisms("", 10.0)));
    let design = parsed("lambertian", &[LINE, &plate, &turned]);
    let FilmTreatment::Table(stack) = treatment(&design) else { panic!("no table") };
    assert!(stack.table(std::slice::from_ref(&design), &[]).expect("films").looks_back());
    let mut traced = design.clone();
    traced.trace.films = FilmTracing::Traced;
    let [by_table, by_film] = [&design, &traced]
        .map(|design| over_seeds(design, 12_800, FEW).remove("mean.axis").expect("light"));
    let error = by_table.stated().hypot(by_film.stated()) / (FEW as f64).sqrt();
    let (table, films) = (by_table.mean(), by_film.mean());
    assert!(error < 0.1 * films, "{error} of {films}");
    assert!((table - films).abs() < 4.0 * error, "{table} by table, {films} film by film, {error}");
}

/// What keeps a stack from a table is said.
#[test]
fn stacks_that_no_table_fits_are_traced_and_say_why() {
    let said = |parts: &[&str]| match treatment(&parsed("lambertian", parts)) {
        FilmTreatment::NoFilms => "no films".to_owned(),
        FilmTreatment::Table(_) => "table".to_owned(),
        FilmTreatment::Traced(why) => why,
    };
    let narrow = PLATE.replace("plate", "small").replace("z_mm = 4.0", "size_mm = [5.0, 5.0]");
    let receiver = |keys: &str| format!("[[receivers]]\nname = \"own\"\n{keys}\n");
    let between = receiver(
        "kind = \"plane\"\nposition_mm = [0.0, 0.0, 5.005]\nsize_mm = [2.0, 2.0]\nbins = [1, 1]",
    );
    let on_film = receiver("kind = \"surface\"\nsurface = \"plate\"");
    let on_walls = receiver("kind = \"surface\"\nsurface = \"wall\"");
    let past = receiver("kind = \"surface\"\nsurface = \"box_top\"\nonly = { max_bounces = 3 }");
    let solid = "[[solids]]\nname = \"post\"\nkind = \"sphere\"\nper = \"array\"\nradius_mm = 0.1\n\
                 position_mm = [0.0, 0.0, 4.5]\nsurface = { kind = \"absorbing\" }\n";
    let spot = "[[sources]]\nname = \"spot\"\nkind = \"cosine\"\nexponent = 50.0\n\
                position_mm = [0.0, 0.0, 0.5]\n";
    let sheet = |angles: &str, values: &str| {
        format!(
            "[[sources]]\nname = \"spot\"\nkind = \"table\"\nposition_mm = [0.0, 0.0, 0.5]\n\
             angle_deg = {angles}\nintensity = {values}\n"
        )
    };
    let upper = prisms("", 0.0);
    let lowest = prisms("z_mm = 4.0\n", 0.0);
    for (parts, words) in [
        (vec![LINE], "no films"),
        (vec![LINE, PLATE], "table"),
        (vec![LINE, PLATE, "trace = { films = \"traced\" }\n"], "trace.films"),
        (vec![LINE, PLATE, &narrow], "film \"small\" has lengths of its own"),
        (vec![LINE, PLATE, &upper, &between], "receiver \"own\" lies between films"),
        (vec![LINE, PLATE, &on_film], "receiver \"own\" lies between films, on one"),
        (vec![LINE, PLATE, &past], "receiver \"own\" asks for the past"),
        (vec![LINE, PLATE, solid], "solid \"post\" stands in, between or against films"),
        (vec![LINE, PLATE, &on_walls], "on the walls"),
        (vec![LINE, PLATE, spot], "the light of source \"spot\" is narrow"),
        (vec![LINE, PLATE, &sheet("[0, 15, 20]", "[1, 1, 0]")], "the light of source \"spot\""),
        (vec![LINE, PLATE, &sheet("[0, 60, 90]", "[1, 0.6, 0]")], "table"),
        // Prisms send light of an LED back to it: by cells its top would absorb a third too little.
        (vec![LINE, &lowest], "the lowest film \"lower\" does not diffuse"),
    ] {
        let why = said(&parts);
        assert!(why.contains(words), "{parts:?}: {why}");
    }
}

/// Squares are mirrored each 45°, hexagons each 30°; mirrors need planes along x and y.
#[test]
fn reliefs_leave_the_mirror_planes_that_they_have() {
    let described = |top: &str, bottom: &str| {
        let design = parsed("specular", &[LINE, PLATE, &faces(top, bottom)]);
        treatment(&design).describe().expect("films")
    };
    let (own, other) =
        ("(with two mirror planes, mirrored by", "(with two mirror planes, film by film");
    for (cell, direction_deg, words) in [
        ("square", 0.0, own),
        ("square", 45.0, own),
        ("square", 30.0, other),
        ("hexagonal", 30.0, own),
        ("hexagonal", -90.0, own),
        ("hexagonal", 45.0, other),
    ] {
        let top = format!("kind = \"cones\", cell = \"{cell}\", direction_deg = {direction_deg:?}");
        let alone = described(&top, "kind = \"lambertian\", transmitted = 1.0, reflected = 0.0");
        assert!(alone.contains(words), "{top}: {alone}");
    }
    let turned = described(
        "kind = \"pyramids\", direction_deg = 20.0",
        "kind = \"microlenses\", radius_um = 40.0",
    );
    assert!(turned.contains("(alike after half a turn"), "{turned}");
}

/// What is kept of a table changes no bit, nor does the number of threads.
#[test]
fn kept_outcomes_and_threads_change_no_bit() {
    let design = parsed("specular", &[LINE, PLATE, &prisms("", 0.0)]);
    let first = seen(&design, 12_800, 7);
    // The parts are in the memory of the process by now.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let again = pool.install(|| seen(&design, 12_800, 7));
    assert_eq!(first.far_field, again.far_field);
    assert_eq!(first.powers, again.powers);
    // More paths begin with the same outcomes, and fewer are those of before.
    let more = seen(&design, 25_600, 7);
    assert_ne!(first.powers, more.powers);
    assert_eq!(first.powers, seen(&design, 12_800, 7).powers);
    let ledger = more.ledger();
    assert!(ledger.surplus().abs() < 1e-9, "{}", ledger.surplus());
}

/// Writes nothing.
struct NoFiles;

impl ModelWriter for NoFiles {
    fn draws_package(&self) -> bool {
        false
    }

    fn write(
        &self,
        _: Output,
        _: &mut ModelResult,
        _: &mut Cow<'_, Observation>,
        _: RunContext,
    ) -> anyhow::Result<()> {
        Ok(())
    }
}

/// What cells of the table add to each figure of a run.
fn film_table_errors(parts: &[&str]) -> BTreeMap<String, Option<Estimate>> {
    let mut design = parsed("lambertian", parts);
    design.trace.paths = 12_800;
    let interrupt = Interrupt::default();
    let lights = design.all_lights();
    let run = Run { design: &design, lights: lights.as_deref(), stopping_rule: None, cache: None };
    let to = Destination { out: Path::new(""), writer: &NoFiles };
    let context = RunContext::quiet(&interrupt, 5);
    let result = run.model(Model::Geometric, None, to, context).expect("a run");
    let figures = result.figures.into_iter();
    figures.map(|figure| (figure.key.into_owned(), figure.entry.film_table_error)).collect()
}

/// Lumens at one wavelength are those of a line, which go the way of spectra: the errors of their shapes
/// are those of watts. Light traced film by film, the control, has none.
#[test]
fn cells_of_a_table_have_an_error_in_any_light() {
    let lumens = "light = { wavelength_nm = 550.0, weighting = \"photometric\" }\n";
    let watts = film_table_errors(&[LINE, PLATE]);
    let valley = |errors: &BTreeMap<String, Option<Estimate>>| errors["centre_to_peak"];
    assert!(valley(&watts).is_some_and(|error| error.standard_error > 0.0), "{watts:?}");
    assert_eq!(film_table_errors(&[lumens, PLATE]), watts);
    let lines = BLUE.replace("[450.0]", "[450.0, 610.0]").replace("[1.0]", "[1.0, 2.0]");
    assert!(valley(&film_table_errors(&[PLATE, &lines.replace("step_nm = 30.0", "")])).is_some());
    let traced = film_table_errors(&[lumens, PLATE, "trace = { films = \"traced\" }\n"]);
    assert!(traced.values().all(Option::is_none), "{traced:?}");
}
