// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ink over the place, traced, against what it must be in closed form.

use std::path::Path;

use metrics::Estimate;
use results::figure_entry::FigureEntry;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::film_table::{FilmTreatment, treatment};
use simulate::model::Model;
use simulate::scene_check;
use simulate::trace::observe;

/// Paths of a trace, by which powers without scatter are judged too.
const PATHS: u64 = 200_000;

/// Two packages with a clear dome each on a board under a mirror, which returns half of the light.
const CAVITY: &str = r#"
name = "cavity"
mirror = { kind = "lambertian", reflectance = 0.3, extent = "array" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing" }
dome = { sphere_radius_mm = 1.0, height_mm = 0.5, width_mm = 1.6 }
silicone = { index = 1.41 }
array = { columns = 2, rows = 1, pitch_mm = 3.0 }
receiver = { plane_height_mm = 4.0, bin_mm = 0.5 }
light = { wavelength_nm = 450.0 }
housing = { kind = "specular", reflectance = 1.0, height_mm = 5.0, distance_mm = 0.5 }
solids = [{ name = "lid", kind = "rectangle", per = "array", size_mm = [5.4, 2.4], position_mm = [0.0, 0.0, 2.0], surface = { kind = "lambertian", reflectance = 0.9 } }]
"#;

/// A beam straight up at x = 3.2 mm, y = 0.2 mm, over a black floor, through a film of index 1.5.
const BEAM: &str = r#"
name = "beam"
mirror = { kind = "absorbing", extent = "array" }
led = { size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 40.0 }
receiver = { plane_height_mm = 4.0, bin_mm = 1.0 }
light = { wavelength_nm = 450.0 }
sources = [{ name = "beam", kind = "cosine", exponent = 1e6, position_mm = [3.2, 0.2, 0.2] }]
films = [{ name = "film", z_mm = 1.0, thickness_mm = 0.1, medium = { index = 1.5 } }]
"#;

/// Accounts of the ledger, as shares of what is emitted, and how films are traced.
fn trace(text: &str, folder: &Path) -> (Vec<(String, FigureEntry)>, FilmTreatment) {
    let design = design::parse("ink.toml", text, folder).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    let interrupt = Interrupt::default();
    let surface = dome_surface(&design, Model::Geometric, None).expect("a surface");
    let env = RunContext::quiet(&interrupt, 41);
    let seen = observe(&design, &surface, PATHS, "", env).expect("a trace");
    assert!(seen.ledger().surplus().abs() < 1e-9);
    (seen.ledger().accounts.clone(), treatment(&design))
}

fn account(accounts: &[(String, FigureEntry)], name: &str) -> Estimate {
    let found = accounts.iter().find(|(known, _)| known == name);
    found.unwrap_or_else(|| panic!("{name} among {accounts:?}")).1.estimate()
}

/// Judges in standard errors whether two estimates are of one value.
fn agree(what: &str, one: Estimate, other: Estimate) {
    let error = one.standard_error.hypot(other.standard_error).max(2.0 / PATHS as f64);
    let off = (one.value - other.value) / error;
    assert!(off.abs() < 4.5, "{what}: {one:?}, {other:?}: {off}");
}

#[test]
fn fine_ink_is_the_mixture_of_ink_and_board() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("ink.csv"), "0.25,0.25\n0.25,0.25\n").expect("a picture");
    // Dots of a quarter of the area, far finer than the light on the board varies.
    let radius = 0.02 * (0.25 / std::f64::consts::PI).sqrt();
    let dots = format!("dots = {{ pitch_mm = 0.02, radius_mm = [[0.0, {radius}]] }}");
    let inks = ["picture_file = \"ink.csv\"".to_owned(), dots];
    let mixture = 0.25 * 0.95 + 0.75 * 0.3;
    let (even, _) = trace(&CAVITY.replace("= 0.3", &format!("= {mixture}")), folder.path());
    let (bare, _) = trace(CAVITY, folder.path());
    for ink in inks {
        let text = format!("{CAVITY}[[prints]]\non = \"mirror\"\nreflected = 0.95\n{ink}\n");
        let (printed, _) = trace(&text, folder.path());
        for name in
            ["escaped_up", "absorbed_by_lid", "absorbed_by_ground_mirror", "absorbed_by_bottom"]
        {
            agree(name, account(&printed, name), account(&even, name));
        }
        // The control: without ink the board takes far more.
        let [ink, none] = [&printed, &bare].map(|of| account(of, "absorbed_by_ground_mirror"));
        assert!(none.value - ink.value > 30.0 * none.standard_error, "{none:?} {ink:?}");
    }
}

#[test]
fn light_meets_ink_where_it_is() {
    // Dots about odd halves of a millimetre; the beam is 0.3 mm off the middle of one along x and y.
    let through = |radius_mm: &str, face: &str, at: &str| {
        let text = BEAM.replace("[3.2, 0.2, 0.2]", at);
        // What ink on the top sent back would go up elsewhere.
        let reflected = if face == "top" { 0.0 } else { 0.5 };
        let ink = format!(
            "[[prints]]\non = \"film.{face}\"\nreflected = {reflected:?}\ntransmitted = 0.0\n\
             dots = {{ pitch_mm = 1.0, radius_mm = {radius_mm} }}\n"
        );
        let (accounts, treatment) = trace(&format!("{text}{ink}"), Path::new(""));
        assert!(matches!(treatment, FilmTreatment::Traced(why) if why.contains("ink on film")));
        account(&accounts, "escaped_up").value
    };
    let plate = 0.96 / 1.04;
    let is_plate = |share: f64| (share - plate).abs() < 5.0 * (0.07 * 0.93 / PATHS as f64).sqrt();
    let beam = "[3.2, 0.2, 0.2]";
    assert!(is_plate(through("[[0.0, 0.4]]", "bottom", beam)));
    assert!(through("[[0.0, 0.45]]", "bottom", beam) <= 0.0);
    assert!(through("[[0.0, 0.45]]", "top", beam) <= 0.0);
    // Radii follow the distance from the package: 3.54 mm there.
    assert!(through("[[0.0, 0.5], [3.6, 0.43]]", "bottom", beam) <= 0.0);
    assert!(is_plate(through("[[0.0, 0.5], [3.4, 0.42]]", "bottom", beam)));
    assert!(through("[[0.0, 0.5], [3.4, 0.42]]", "bottom", "[1.2, 0.2, 0.2]") <= 0.0);
}

#[test]
fn pictures_lie_upright() {
    let folder = tempfile::tempdir().expect("a folder");
    // Ink in the quarter of low x and high y.
    std::fs::write(folder.path().join("ink.csv"), "1,0\n0,0\n").expect("a picture");
    let ink = "[[prints]]\non = \"film.bottom\"\nreflected = 0.0\npicture_file = \"ink.csv\"\n";
    for (at, is_dark) in [([-3.0, 2.0], true), ([3.0, 2.0], false), ([-3.0, -2.0], false)] {
        let text = BEAM.replace("[3.2, 0.2, 0.2]", &format!("[{:?}, {:?}, 0.2]", at[0], at[1]));
        let (accounts, _) = trace(&format!("{text}{ink}"), folder.path());
        let up = account(&accounts, "escaped_up").value;
        assert_eq!(up == 0.0, is_dark, "{at:?}: {up}");
    }
}

/// The mirrors under domes lie in the frame of the array: with ink on the half of large x alone, the
/// package that stands there loses light to its bottom, and the other loses none. Light is traced in
/// batches, and path by path where it carries its polarisation.
#[test]
fn ink_lies_under_the_packages_of_its_half() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("ink.csv"), "0,1\n").expect("a picture");
    for (lit, is_dark) in [("1, 0", false), ("0, 1", true)] {
        let [left, right] = lit.split_once(", ").map(|(a, b)| [a, b]).expect("two powers");
        let places = format!("-1.5 0 {left}\n1.5 0 {right}\n");
        std::fs::write(folder.path().join("places.csv"), places).expect("places");
        for light in ["", ", polarization = \"carried\""] {
            let text = format!(
                "name = \"halves\"\n\
                 mirror = {{ kind = \"lambertian\", reflectance = 1.0, extent = \"array\" }}\n\
                 led = {{ size_mm = [0.1, 0.1], height_mm = 0.1, reflectance = 1.0, reflection = \"specular\" }}\n\
                 dome = {{ sphere_radius_mm = 1.0, height_mm = 0.5, width_mm = 1.6 }}\n\
                 silicone = {{ index = 1.41 }}\n\
                 array = {{ positions_file = \"places.csv\", pitch_mm = 3.0, crossing = false }}\n\
                 receiver = {{ plane_height_mm = 4.0, bin_mm = 0.5 }}\n\
                 light = {{ wavelength_nm = 450.0{light} }}\n\
                 [[prints]]\non = \"mirror\"\nreflected = 0.0\npicture_file = \"ink.csv\"\n"
            );
            let (accounts, _) = trace(&text, folder.path());
            let lost = account(&accounts, "absorbed_by_bottom").value;
            assert!(if is_dark { lost > 0.02 } else { lost <= 0.0 }, "{lit} {light}: {lost}");
        }
    }
}

/// A film of index 1, at whose faces nothing happens, with a dye that emits nothing: of the density d it
/// lets exp(-0.1 a d) of a beam through.
fn dyed(density: &str, at: &str, folder: &Path) -> f64 {
    let dye = "[{ name = \"dye\", absorption_per_mm = 12.0, quantum_yield = 0.0, emission = { peak_nm = 600.0, fwhm_nm = 20.0 } }]";
    let text = BEAM
        .replace("index = 1.5", &format!("index = 1.0, luminophores = {dye}"))
        .replace("[3.2, 0.2, 0.2]", at)
        + &format!("[[prints]]\non = \"film\"\n{density}\n");
    let (accounts, treatment) = trace(&text, folder);
    assert!(matches!(treatment, FilmTreatment::Traced(why) if why.contains("density of film")));
    account(&accounts, "escaped_up").value
}

#[test]
#[ignore = "slow: 4 s"]
fn each_place_of_a_film_has_its_own_density() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("halves.csv"), "1,0.25\n").expect("a picture");
    std::fs::write(folder.path().join("equal.csv"), "0.625,0.625\n").expect("a picture");
    let is_of = |share: f64, density: f64| {
        let expected = (-1.2 * density).exp();
        let error = (expected * (1.0 - expected) / PATHS as f64).sqrt();
        assert!((share - expected).abs() <= 4.5 * error, "{density}: {share} {expected}");
    };
    let sides = ["[-3.2, 0.2, 0.2]", "[3.2, 0.2, 0.2]"];
    for (at, of_half) in sides.into_iter().zip([1.0, 0.25]) {
        is_of(dyed("picture_file = \"halves.csv\"", at, folder.path()), of_half);
        // The control.
        is_of(dyed("picture_file = \"equal.csv\"", at, folder.path()), 0.625);
    }
    // The beam is 0.42 mm off the middle of a dot.
    for (radius_mm, density) in [("0.45", 1.0), ("0.4", 0.0)] {
        let dots = format!("dots = {{ pitch_mm = 1.0, radius_mm = [[0.0, {radius_mm}]] }}");
        is_of(dyed(&dots, sides[1], folder.path()), density);
    }
}

#[test]
fn an_even_density_is_a_thinner_medium() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("even.csv"), "0.25,0.25\n0.25,0.25\n").expect("a picture");
    let film = |per_mm: f64, dye: f64| {
        format!(
            "films = [{{ name = \"film\", z_mm = 2.5, thickness_mm = 1.0, medium = {{ index = 1.5, \
             absorption_per_mm = 0.02, scattering_per_mm = {per_mm:?}, g = 0.5, luminophores = [{{ name = \
             \"dye\", absorption_per_mm = {dye:?}, quantum_yield = 0.9, emission = {{ peak_nm = 600.0, \
             fwhm_nm = 20.0 }} }}] }} }}]\ntrace = {{ films = \"traced\" }}\n"
        )
    };
    let cavity = |films: &str, density: &str| {
        let (lid, _) = CAVITY.split_once("solids = ").expect("a lid");
        trace(&format!("{lid}{films}{density}"), folder.path()).0
    };
    let density = "[[prints]]\non = \"film\"\npicture_file = \"even.csv\"\n";
    let printed = cavity(&film(8.0, 2.0), density);
    let thinner = cavity(&film(2.0, 0.5), "");
    for name in ["escaped_up", "absorbed_in_film", "absorbed_by_ground_mirror"] {
        agree(name, account(&printed, name), account(&thinner, name));
    }
    // The control: at the stated density less comes through.
    let [thin, full] = [&printed, &cavity(&film(8.0, 2.0), "")].map(|of| account(of, "escaped_up"));
    assert!(thin.value - full.value > 20.0 * full.standard_error, "{thin:?} {full:?}");
}
