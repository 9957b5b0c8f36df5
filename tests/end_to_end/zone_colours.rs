// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones` in colours: channels, whites, sub-pixels, levels from pictures, films.

use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use arrays::npy;
use batwing_tests::read;
use formats::level_image::{ColourImage, png_of_rgb};
use metrics::colour_matching;
use metrics::gamut::BT709;
use metrics::transfer::Transfer;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, run_text};
use crate::zones::boxed;

/// Wavelengths and power of the dies, and transmittance of the sub-pixels at the same wavelengths.
const DIES: [(&str, [f64; 3], [f64; 3]); 3] = [
    ("red", [610.0, 630.0, 650.0], [0.0, 1.0, 0.0]),
    ("green", [500.0, 530.0, 560.0], [0.0, 1.0, 0.0]),
    ("blue", [440.0, 455.0, 470.0], [0.0, 1.0, 0.0]),
];
const FILTERS: [[[f64; 6]; 2]; 3] = [
    [[400.0, 570.0, 590.0, 610.0, 650.0, 700.0], [0.01, 0.01, 0.15, 0.30, 0.30, 0.30]],
    [[400.0, 480.0, 500.0, 560.0, 600.0, 700.0], [0.005, 0.05, 0.28, 0.28, 0.01, 0.005]],
    [[400.0, 430.0, 480.0, 500.0, 540.0, 700.0], [0.26, 0.26, 0.20, 0.05, 0.005, 0.005]],
];

/// 3 x 3 packages of three dies in a white box, before a panel.
pub fn coloured() -> String {
    let die = |(k, (name, nm, power)): (usize, &(&str, [f64; 3], [f64; 3]))| {
        format!(
            "[[sources]]\nname = \"{name} die\"\nchannel = \"{name}\"\nkind = \"rectangle\"\n\
             position_mm = [{}, 0.0, 0.15]\nsize_mm = [0.1, 0.1]\n\
             spectrum = {{ kind = \"table\", samples = 1, wavelength_nm = {nm:?}, power = {power:?} }}\n\n",
            0.15 * (k as f64 - 1.0)
        )
    };
    let filter = |[nm, share]: &[[f64; 6]; 2]| {
        format!("[[panel.sub_pixels]]\nwavelength_nm = {nm:?}\ntransmittance = {share:?}\n\n")
    };
    let dies: String = DIES.iter().enumerate().map(die).collect();
    let filters: String = FILTERS.iter().map(filter).collect();
    boxed(3).replace("power_lm = 8.0", "power_w = 0.03, electrical_w = 0.09")
        + &dies
        + "[panel]\ncontrast = 1e9\n\n"
        + &filters
}

pub fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    write("rgb.toml", &coloured());
    write("full.csv", &"1,1,1\n".repeat(3));
    write("dark.csv", &"0,0,0\n".repeat(3));
    write("some.csv", "1,0.5,0\n0,0.2,0\n0.3,0,1\n");
    folder
}

/// Runs `zones` in `folder` on kept responses; the results in `out`.
pub fn zones(folder: &Path, line: &str, out: &str) -> Value {
    let line = format!(
        "zones rgb.toml {line} --paths 20000 --receiver front --quiet --cache kept --out {out}"
    );
    batwing(folder).args(line.split_whitespace()).assert().success();
    serde_json::from_str(&read(folder.join(out).join("zones.json"))).expect("JSON")
}

/// X, Y and Z of a map.
fn xyz(folder: &Path, file: &str) -> Vec<f64> {
    let bytes = std::fs::read(folder.join(file)).expect("an array");
    npy::read::<f64>(&bytes).expect("X, Y and Z").1
}

/// A column of `zones.csv`.
fn column(folder: &Path, out: &str, name: &str) -> Vec<f64> {
    let text = read(folder.join(out).join("zones.csv"));
    let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let place = rows.next().expect("names").iter().position(|cell| *cell == name).expect(name);
    rows.map(|row| row[place].parse().expect("a number")).collect()
}

pub fn value(entry: &Value) -> f64 {
    entry["value"].as_f64().expect("a number")
}

/// A PNG of `columns` pixels a row, the top first.
pub fn write_png(path: &Path, columns: usize, rgb: &[u8]) {
    std::fs::write(path, png_of_rgb(columns, rgb).expect("whole rows")).expect("written");
}

/// Writes `star.png`: one white pixel of 6 x 6.
pub fn star(folder: &Path) -> Vec<u8> {
    let mut pixels = vec![0; 3 * 36];
    pixels[3 * 14..][..3].fill(255);
    write_png(&folder.join("star.png"), 6, &pixels);
    pixels
}

#[test]
fn channels_add_up_to_the_whole() {
    let folder = folder();
    let at = folder.path();
    // A panel picture is needed beside patterns by channel, and asks for nothing here.
    let picture = "--picture full.csv";
    let one = |lit: &str| {
        let file = |name: &str| if name == lit { "some.csv" } else { "dark.csv" };
        let patterns = DIES.map(|(name, ..)| format!("--pattern {name}={}", file(name)));
        let found = zones(at, &format!("{} {picture}", patterns.join(" ")), lit);
        let share = found["colour"]["power_share"].as_f64().expect("a share");
        // Each die emits a third, in zones whose mean drive is a third.
        assert!((share - 1.0 / 9.0).abs() < 1e-12, "{share}");
        xyz(at, &format!("{lit}/backlight_xyz.npy"))
    };
    let parts = DIES.map(|(name, ..)| one(name));
    let found = zones(at, &format!("--pattern some.csv {picture}"), "all");
    let whole = xyz(at, "all/backlight_xyz.npy");
    for (k, whole) in whole.iter().enumerate() {
        let sum: f64 = parts.iter().map(|part| part[k]).sum();
        assert!((sum - whole).abs() <= 1e-12 * whole.abs(), "{k}: {sum} {whole}");
    }
    // Symmetric about x alone: a response for each of nine packages, 9 · 0.09 W at full drive.
    assert_eq!(found["responses"], 9);
    let power = found["colour"]["power_w"].as_f64().expect("W");
    assert!((power - 0.27).abs() < 1e-12, "{power}");
    // One channel is the luminance of the map.
    let y = &whole[whole.len() / 3..2 * whole.len() / 3];
    let bytes = std::fs::read(at.join("all/backlight.npy")).expect("a map");
    let map = npy::read::<f64>(&bytes).expect("levels").1;
    assert!(y.iter().zip(&map).all(|(a, b)| (a - b).abs() < 1e-9 * b), "Y is no luminance");
}

/// Colours of single channels behind the open panel are integrals over spectrum and filters.
#[test]
fn channels_have_the_colours_of_their_spectra_behind_the_filters() {
    let folder = folder();
    let found = zones(folder.path(), "--pattern full.csv", "out");
    let line = |x: f64, [a, b]: [f64; 2], [u, v]: [f64; 2]| u + (v - u) * (x - a) / (b - a);
    for (k, (name, nm, power)) in DIES.iter().enumerate() {
        let mut sum = [0.0; 3];
        for step in 0..10_000 {
            let x = nm[0] + (nm[2] - nm[0]) * (f64::from(step) + 0.5) / 1e4;
            let half = usize::from(x > nm[1]);
            let light = line(x, [nm[half], nm[half + 1]], [power[half], power[half + 1]]);
            let passed: f64 = FILTERS
                .iter()
                .map(|[rows, share]| {
                    let i = rows.iter().rposition(|row| *row <= x).expect("covered");
                    line(x, [rows[i], rows[i + 1]], [share[i], share[i + 1]])
                })
                .sum();
            let matching = colour_matching::xyz(x);
            (0..3).for_each(|k| sum[k] += light * passed * matching[k]);
        }
        let whole: f64 = sum.iter().sum();
        let channel = &found["colour"]["channels"][k];
        assert_eq!(channel["name"], *name);
        for (axis, expected) in [sum[0] / whole, sum[1] / whole].into_iter().enumerate() {
            let got = value(&channel["light"]["xy"][axis]);
            assert!((got - expected).abs() < 2e-5, "{name}: {got} {expected}");
        }
    }
    // White is the sum of the channels.
    let colours = found["colour"]["channels"].as_array().expect("channels").iter();
    let colours = colours.map(|channel| &channel["light"]).chain([&found["colour"]["white"]]);
    let mut lights: Vec<[f64; 3]> = colours
        .map(|light| {
            let [x, y] = [0, 1].map(|k| value(&light["xy"][k]));
            [x / y, 1.0, (1.0 - x - y) / y].map(|v| v * value(&light["luminance"]))
        })
        .collect();
    let white = lights.pop().expect("white");
    for k in 0..3 {
        let sum: f64 = lights.iter().map(|light| light[k]).sum();
        assert!((sum - white[k]).abs() < 1e-9 * white[k], "{sum} {white:?}");
    }
    let gamut = found["colour"]["gamut"].as_array().expect("standards");
    assert_eq!(gamut.len(), 3);
    assert!(gamut.iter().all(|of| value(&of["xy"][1]) > 0.3 && value(&of["xy"][1]) <= 1.0));
    // Dies at 1 before the same panel in a run: all its figures of the panel are these.
    let run = run_text(folder.path(), "run", &coloured(), "run", &["--paths", "100000"]);
    let run = run.expect("results");
    let front = &run["designs"]["boxed"]["geometric"]["receivers"]["front"];
    let white = &found["colour"]["white"];
    let mut pairs = vec![
        ("white_u_prime".to_owned(), &white["uv"][0]),
        ("white_v_prime".to_owned(), &white["uv"][1]),
    ];
    for (of, standard) in gamut.iter().zip(["bt2020", "dci_p3", "bt709"]) {
        for plane in ["xy", "uv"] {
            pairs.push((format!("coverage_{standard}_{plane}"), &of[plane][1]));
        }
    }
    for (name, ours) in pairs {
        let [(ours, error), (other, noise)] = [ours, &front[&name]].map(estimate);
        assert!(error > 0.0 && noise > 0.0, "{name}: {front}");
        assert!((ours - other).abs() < 3.5 * error.hypot(noise), "{name}: {ours} {other}");
    }
}

#[test]
fn a_white_has_the_most_light_that_its_channels_give() {
    let folder = folder();
    let at = folder.path();
    let found = zones(at, "--pattern full.csv --white 0.3127,0.3290", "d65");
    let channels = found["colour"]["channels"].as_array().expect("channels");
    let levels: Vec<f64> =
        channels.iter().map(|channel| channel["level"].as_f64().expect("a level")).collect();
    assert!(levels.iter().all(|level| (0.0..=1.0).contains(level)), "{levels:?}");
    assert!(levels.contains(&1.0) && levels.iter().any(|level| *level < 0.9), "{levels:?}");
    for (axis, expected) in [0.3127, 0.3290].into_iter().enumerate() {
        let got = value(&found["colour"]["white"]["xy"][axis]);
        assert!((got - expected).abs() < 1e-12, "{got}");
    }
    let by_name = zones(at, "--pattern full.csv --white 6504K", "kelvin");
    let cct = value(&by_name["colour"]["white"]["cct"]);
    assert!((cct - 6504.0).abs() < 5.0, "{cct}");
    // Control: without it, all channels at 1 have another white and more light.
    let native = zones(at, "--pattern full.csv", "native");
    let luminance = |found: &Value| value(&found["colour"]["white"]["luminance"]);
    let [all, some] = [&native, &found].map(luminance);
    assert!(all > some, "{all} {some}");
    assert!((value(&native["colour"]["white"]["xy"][0]) - 0.3127).abs() > 0.005);
}

/// What the panel can show is the picture to a quantum, whatever the backlight; what it cannot is
/// missing.
#[test]
fn the_panel_shows_the_picture_that_it_is_given() {
    let folder = folder();
    let at = folder.path();
    let pixels: Vec<u8> =
        (0..18u8 * 12).flat_map(|k| [40 + k % 18 * 5, 30 + k / 18 * 8, 140 - k % 18 * 5]).collect();
    write_png(&at.join("film.png"), 18, &pixels);
    let line = "--pattern full.csv --picture film.png --white 6504K";
    let found = zones(at, line, "shown");
    let (image, _) = ColourImage::read(&at.join("shown/panel_picture.png")).expect("a picture");
    let (wanted, _) = ColourImage::read(&at.join("film.png")).expect("a picture");
    assert_eq!((image.columns, image.rows), (18, 12));
    for (k, (shown, wanted)) in image.levels.iter().zip(&wanted.levels).enumerate() {
        let is_near = (0..3).all(|c| shown[c].abs_diff(wanted[c]) <= 257);
        assert!(is_near, "pixel {k}: {shown:?} {wanted:?}");
    }
    let share = |found: &Value, key: &str| value(&found["colour"][key]);
    assert!(share(&found, "missing") < 1e-6 && share(&found, "leaking") < 1e-6, "{found}");
    assert_eq!(found["colour"]["picture"], "BT.709, sRGB");
    // A tenth of the backlight does not do.
    std::fs::write(at.join("dim.csv"), "0.1,0.1,0.1\n".repeat(3)).expect("written");
    let dim = zones(at, &line.replace("full", "dim"), "dim");
    assert!(share(&dim, "missing") > 0.1, "{dim}");
    // Light that is stated as such.
    let linear = zones(at, &format!("{line} --transfer linear --gamut bt2020"), "linear");
    assert_eq!(linear["colour"]["picture"], "BT.2020, linear");
}

/// BT.709 with D65, as IEC 61966-2-1 prints it.
const TO_XYZ: [[f64; 3]; 3] =
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];

/// A rule in words, and what it makes of what pixels need.
type Rule = (&'static str, fn(&[f64]) -> f64);

/// Levels by hand: what the pixels of a zone need by the matrix that the results state.
#[test]
fn levels_follow_from_the_picture_by_their_formula() {
    let folder = folder();
    let at = folder.path();
    let numbers = (0..36u32).flat_map(|k| [k * 7, k * 53 % 251, k * 101 % 241]);
    let pixels: Vec<u8> = numbers.map(|number| number as u8).collect();
    write_png(&at.join("film.png"), 6, &pixels);
    let line = "--picture film.png --transfer linear --white 6504K";
    let rules: [Rule; 4] = [
        ("max", |n| n.iter().copied().fold(0.0, f64::max)),
        ("mean", |n| n.iter().sum::<f64>() / 4.0),
        ("rms", |n| (n.iter().map(|n| n * n).sum::<f64>() / 4.0).sqrt()),
        ("percentile=50", |n| {
            let mut n = n.to_vec();
            n.sort_by(f64::total_cmp);
            n[1]
        }),
    ];
    for (rule, level) in rules {
        let found = zones(at, &format!("{line} --levels {rule}"), rule);
        let stated = &found["colour"]["levels"];
        assert_eq!((&stated["rule"], &stated["by_channel"]), (&rule.into(), &true.into()));
        for (c, (name, ..)) in DIES.iter().enumerate() {
            let drives = column(at, rule, &format!("drive_{name}"));
            for (zone, drive) in drives.iter().enumerate() {
                // Zones and pixels of a PNG both begin at the top.
                let needs = [0, 1, 2, 3].map(|k| {
                    let (i, j) = (2 * (zone % 3) + k % 2, 2 * (zone / 3) + k / 2);
                    let rgb = [0, 1, 2].map(|c| f64::from(pixels[3 * (6 * j + i) + c]) / 255.0);
                    let row = |row: [f64; 3]| (0..3).map(|k| row[k] * rgb[k]).sum::<f64>();
                    let xyz = TO_XYZ.map(row);
                    let n = |k: usize| stated["matrix"][c][k].as_f64().expect("a number") * xyz[k];
                    (n(0) + n(1) + n(2)).clamp(0.0, 1.0)
                });
                let expected = level(&needs);
                assert!(
                    (drive - expected).abs() < 2e-3,
                    "{rule} {name} {zone}: {drive} {expected}"
                );
            }
        }
    }
    // Half of the power that the levels take.
    let whole = zones(at, &format!("{line} --levels max"), "whole");
    let share = whole["colour"]["power_share"].as_f64().expect("a share");
    let limit = format!("{line} --levels max --power-limit {}", 0.5 * share);
    let half = zones(at, &limit, "half");
    let found = half["colour"]["power_share"].as_f64().expect("a share");
    assert!((found - 0.5 * share).abs() < 1e-12, "{found} {share}");
    let [before, after] = ["whole", "half"].map(|out| column(at, out, "drive_green"));
    assert!(before.iter().zip(&after).all(|(a, b)| (0.5 * a - b).abs() < 1e-12));
}

/// The eye's own glare hides more of the halo where the panel has more contrast, and in an older eye.
#[test]
fn the_eye_hides_a_part_of_the_halo() {
    let folder = folder();
    let at = folder.path();
    let mut pixels = star(at);
    let line = "--picture star.png --levels max";
    let seen = |contrast: f64, age: f64, out: &str| {
        zones(at, &format!("{line} --contrast {contrast} --distance 600 --age {age}"), out)
    };
    let found = [(30.0, 25.0), (30.0, 70.0), (1000.0, 25.0), (1e6, 25.0)]
        .map(|(contrast, age)| seen(contrast, age, &format!("eye-{contrast}-{age}")));
    let [poor, old, better, best] = found.each_ref().map(|found| value(&found["halo"]["hidden"]));
    assert!(poor > 0.0 && poor < old && old < 1.0, "{poor} {old}");
    assert!(poor < better && better <= best && best > 0.999, "{poor} {better} {best}");
    assert_eq!(found[1]["halo"]["viewing"]["age_years"], 70.0);
    // Halo and greys have the colour of the panel's light; nothing is said of an eye without a place.
    let colour = &found[0]["colour"];
    assert!((0.0..0.1).contains(&value(&colour["halo_uv"])), "{colour}");
    assert!((0.0..0.1).contains(&value(&colour["white_difference"])), "{colour}");
    assert!(zones(at, line, "blind")["halo"].get("hidden").is_none());
    // A sky that is nowhere black has no halo: its picture goes, and the answer and the page say so.
    assert!(at.join("blind/halo.png").exists() && at.join("blind/error.png").exists());
    pixels.chunks_mut(3).filter(|pixel| pixel[0] == 0).for_each(|pixel| {
        pixel.copy_from_slice(&[2, 2, 6]);
    });
    write_png(&at.join("sky.png"), 6, &pixels);
    let sky = zones(at, &line.replace("star", "sky"), "blind");
    assert!(sky["halo"].is_null() && at.join("blind/error.png").exists());
    assert!(!at.join("blind/halo.png").exists() && !sky.to_string().contains("halo.png"));
    for (out, says) in [("blind", true), ("eye-30-25", false)] {
        batwing(at).args(["report", out, "--quiet"]).assert().success();
        let page = read(at.join(out).join("report.html"));
        assert_eq!(page.contains("picture of the halo"), says, "{out}");
        assert_eq!(
            page.contains("what the panel shows where the picture is black"),
            !says,
            "{out}"
        );
    }
}

/// Several pictures: a row each, as each by itself, from responses that are traced once.
#[test]
fn a_film_is_a_row_for_each_picture() {
    let folder = folder();
    let at = folder.path();
    std::fs::create_dir(at.join("frames")).expect("a folder");
    let frame = |k: u8| -> Vec<u8> { (0..36).flat_map(|p| [p * k, 6 * p, 200 - p * k]).collect() };
    for k in [1, 2] {
        write_png(&at.join(format!("frames/{k}.png")), 6, &frame(k));
    }
    zones(at, "--picture frames --levels mean", "film");
    let text = read(at.join("film/film.csv"));
    let rows: Vec<Vec<&str>> = text.lines().map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 3, "{text}");
    assert_eq!((rows[1][0], rows[2][0]), ("1.png", "2.png"));
    let alone = zones(at, "--picture frames/2.png --levels mean", "alone");
    let cell = |row: usize, name: &str| -> f64 {
        let place = rows[0].iter().position(|cell| *cell == name).expect(name);
        rows[row][place].parse().expect("a number")
    };
    let share = alone["colour"]["power_share"].as_f64().expect("a share");
    assert!((cell(2, "power_share") - share).abs() < 1e-12, "{text}");
    assert!((cell(1, "power_share") - share).abs() > 1e-6, "{text}");
    for name in ["panel_mean_luminance", "panel_largest_zone_luminance"] {
        let [value, error] =
            ["", "_standard_error"].map(|of| cell(1, &format!("{name}{of}_cd_per_m2")));
        assert!(error > 0.0 && error < 0.2 * value, "{name}: {value} {error}");
    }
    let missing = &alone["colour"]["missing"];
    assert!((cell(2, "missing") - value(missing)).abs() < 1e-12);
    let error = missing["standard_error"].as_f64().expect("an error");
    assert!(cell(2, "missing_standard_error") > 0.0 && error > 0.0);
    let [of_film, by_itself] = ["film/film/2.png", "alone/panel_picture.png"]
        .map(|file| std::fs::read(at.join(file)).expect("a picture"));
    assert!(of_film == by_itself);
    let page = |folder: &str| {
        batwing(at).args(["report", folder, "--out", "page.html"]).assert().success();
        read(at.join("page.html"))
    };
    let [film, single] = ["film", "alone"].map(page);
    for word in
        ["id=\"film\"", "1: 1.png</figcaption>", "2: 2.png</figcaption>", ">Power share (%)<"]
    {
        assert!(film.contains(word) && !single.contains(word), "{word}");
    }
}

/// Pictures of an earlier, longer film do not lie beside those of a later one.
#[test]
fn a_shorter_film_leaves_no_frames_of_a_longer_one() {
    let folder = folder();
    let at = folder.path();
    std::fs::create_dir(at.join("frames")).expect("a folder");
    for k in 1..=3 {
        write_png(&at.join(format!("frames/{k}.png")), 6, &[80 * k; 3 * 36]);
    }
    zones(at, "--picture frames --levels mean", "film");
    std::fs::write(at.join("film/film/own.png"), "a file of the user").expect("written");
    assert!(at.join("film/film/3.png").is_file());
    std::fs::remove_file(at.join("frames/3.png")).expect("removed");
    zones(at, "--picture frames --levels mean", "film");
    let is_file = |name: &str| at.join("film").join(name).is_file();
    let frames = ["film/1.png", "film/2.png", "film/3.png", "film/own.png"];
    assert_eq!(frames.map(is_file), [true, true, false, true]);
    // One design without colours leaves nothing of it but what the user put there.
    let of_colours =
        ["film.csv", "seen.png", "panel_picture.png", "backlight_xyz.npy", "panel_xyz.npy"];
    assert_eq!(of_colours.map(is_file), [true; 5]);
    std::fs::write(at.join("rgb.toml"), boxed(3)).expect("written");
    std::fs::write(at.join("film/own.csv"), "a file of the user").expect("written");
    zones(at, "--pattern full.csv", "film");
    assert_eq!(of_colours.map(is_file), [false; 5]);
    assert_eq!(frames.map(is_file), [false, false, false, true]);
    assert!(is_file("own.csv") && is_file("zones.csv"));
}

/// A grey picture that states sRGB is decoded as such, one that states nothing is light; so they are on
/// a panel without sub-pixels too.
#[test]
fn grey_pictures_are_what_they_state() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("boxed.toml"), boxed(3)).expect("written");
    let grey = |name: &str, level: u8, is_srgb: bool| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 3, 3);
        encoder.set_color(png::ColorType::Grayscale);
        if is_srgb {
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        }
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[level; 9]).expect("pixels");
        writer.finish().expect("written");
        std::fs::write(at.join(name), bytes).expect("written");
    };
    // 188 of 255 in sRGB is half of the light, 128 of 255.
    grey("srgb.png", 188, true);
    grey("plain.png", 188, false);
    grey("light.png", 128, false);
    let mean = |design: &str, name: &str| {
        let line = format!(
            "zones {design} --pattern full.csv --picture {name} --paths 20000 --receiver front --quiet --cache kept --out out"
        );
        batwing(at).args(line.split_whitespace()).assert().success();
        let text = read(at.join("out/zones.csv"));
        let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let names = rows.next().expect("names");
        let is_panel = |name: &&str| name.starts_with("panel_") && !name.contains("standard_error");
        let place = names.iter().position(is_panel).expect("a column");
        rows.map(|row| row[place].parse::<f64>().expect("a number")).sum::<f64>()
    };
    for design in ["rgb.toml", "boxed.toml"] {
        let [srgb, plain, light] =
            ["srgb.png", "plain.png", "light.png"].map(|name| mean(design, name));
        assert!((srgb / light - 1.0).abs() < 0.01, "{design}: {srgb} {light}");
        assert!(plain > 1.2 * srgb, "{design}: {plain} {srgb}");
    }
}

/// Grey needs no primaries: green and blue, whose white lies outside BT.709, show shares of it.
#[test]
fn grey_pictures_are_shares_of_a_white_outside_the_primaries() {
    let folder = folder();
    let at = folder.path();
    let text = coloured();
    let dies: Vec<&str> = text.split("[[sources]]").collect();
    std::fs::write(at.join("rgb.toml"), [dies[0], dies[2], dies[3]].join("[[sources]]"))
        .expect("written");
    // Darker than the darkest bin of the backlight.
    let grey = [0.1, 0.2, 0.3, 0.15, 0.25, 0.05, 0.2, 0.125, 0.3];
    let rows = grey.chunks(3).map(|row| format!("{},{},{}\n", row[0], row[1], row[2]));
    std::fs::write(at.join("grey.csv"), rows.collect::<String>()).expect("written");
    let found = zones(at, "--pattern full.csv --picture grey.csv", "shown");
    let colour = &found["colour"];
    let white = [0, 1].map(|k| value(&colour["white"]["xy"][k]));
    assert!(!BT709.hold(white), "{white:?}");
    assert_eq!(colour["picture"], "grey, linear");
    // Two dies make nearly one line of colours, from which noise may move a bin.
    for key in ["missing", "leaking"] {
        assert!(value(&colour[key]) < 5e-3, "{key}: {colour}");
    }
    let panel = xyz(at, "shown/panel_xyz.npy");
    let [x, y, z] = [0, 1, 2].map(|k| &panel[k * panel.len() / 3..][..panel.len() / 3]);
    for (k, (x, (y, z))) in x.iter().zip(y.iter().zip(z)).enumerate() {
        let sum = x + y + z;
        let is_white = (x / sum - white[0]).abs() < 5e-3 && (y / sum - white[1]).abs() < 5e-3;
        assert!(is_white, "bin {k}: {x} {y} {z} {white:?}");
    }
    let (image, _) = ColourImage::read(&at.join("shown/panel_picture.png")).expect("a picture");
    for (shown, light) in image.levels.iter().zip(grey.chunks(3).rev().flatten()) {
        let expected = (255.0 * Transfer::Srgb.level(*light)).round() as i32;
        assert!(shown.iter().all(|level| (i32::from(level / 257) - expected).abs() <= 3));
    }
    // Zones of a pixel each need its level in both channels.
    let found = zones(at, "--picture grey.csv --levels mean", "levels");
    assert!(found["colour"]["levels"]["matrix"].is_array());
    for name in ["drive_green", "drive_blue"] {
        let drives = column(at, "levels", name);
        let is_near = |(drive, grey): (&f64, &f64)| (drive - grey).abs() < 1e-5;
        assert!(drives.iter().zip(&grey).all(is_near), "{name}: {drives:?}");
    }
    // Control: the same in colours is held to their primaries.
    write_png(&at.join("rgb.png"), 3, &[90; 27]);
    let line = "zones rgb.toml --pattern full.csv --picture rgb.png --receiver front --out refused";
    let said = batwing(at).args(line.split_whitespace()).assert().failure();
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(said.contains("`rgb.png`: --gamut: expected primaries about the white"), "{said}");
}

/// Another filter needs no other response.
#[test]
fn filters_of_the_panel_keep_the_responses() {
    let folder = folder();
    let at = folder.path();
    let [[nm, share], ..] = FILTERS;
    let rows = |factor: f64| -> String {
        let row = |(nm, share): (&f64, f64)| format!("{nm},{}\n", factor * share);
        nm.iter().zip(share).map(row).collect::<Vec<String>>().concat()
    };
    let inner = format!("wavelength_nm = {nm:?}\ntransmittance = {share:?}\n");
    let text = coloured();
    assert!(text.contains(&inner));
    std::fs::write(at.join("rgb.toml"), text.replace(&inner, "file = \"red.csv\"\n"))
        .expect("written");
    let of = |factor: f64| {
        std::fs::write(at.join("red.csv"), rows(factor)).expect("written");
        let found = zones(at, "--pattern full.csv", "out");
        let responses = xyz(at, "out/backlight_xyz.npy");
        (responses, kept(at), value(&found["colour"]["white"]["luminance"]))
    };
    let (dim, bright) = (of(0.8), of(1.0));
    assert_eq!(dim.1, 9);
    assert!(dim.0 == bright.0 && dim.1 == bright.1);
    assert!(bright.2 > 1.01 * dim.2, "{} {}", dim.2, bright.2);
    // Control: other walls need responses of their own.
    let text = read(at.join("rgb.toml"));
    let other =
        text.replace("reflectance = 0.8\nheight_mm = 4.0", "reflectance = 0.7\nheight_mm = 4.0");
    assert_ne!(text, other);
    std::fs::write(at.join("rgb.toml"), other).expect("written");
    assert_eq!(of(1.0).1, 18);
}

/// Kept responses.
pub fn kept(folder: &Path) -> usize {
    std::fs::read_dir(folder.join("kept/responses")).expect("responses").count()
}

/// White of a window and of a zone is no brighter than full white, power is the share of the zones,
/// and a panel that closes better has a better checkerboard.
#[test]
fn test_patterns_have_their_powers_and_contrasts() {
    let folder = folder();
    let at = folder.path();
    let of = |contrast: f64| {
        let line =
            format!("--pattern full.csv --white 6504K --test-patterns --contrast {contrast}");
        zones(at, &line, &format!("c{contrast}"))
    };
    let [poor, good] = [100.0, 10_000.0].map(of);
    let patterns = &poor["colour"]["test_patterns"];
    let white = value(&poor["colour"]["white"]["luminance"]);
    // A window of a tenth lies within the middle one of 3 x 3 zones.
    for name in ["window", "zone"] {
        let share = patterns[name]["power_share"].as_f64().expect("a share");
        assert!((share - 1.0 / 9.0).abs() < 1e-12, "{share}");
        let luminance = value(&patterns[name]["luminance"]);
        assert!(luminance > 0.2 * white && luminance < white, "{name}: {luminance} {white}");
    }
    // A box without a panel's limits shows nearly the colour of white at all drives.
    let (shift, error) = estimate(&patterns["grey_ramp"]);
    assert!(error > 0.0 && shift < 0.02 + 3.0 * error, "{shift} {error}");
    let [poor, good] =
        [&poor, &good].map(|of| value(&of["colour"]["test_patterns"]["checkerboard"]));
    // Black lets through one hundredth of its own backlight, less than that of white zones.
    assert!(poor > 0.001 && poor < 0.01, "{poor}");
    assert!((good - 0.01 * poor).abs() < 0.05 * good, "{poor} {good}");
    assert!(of(50.0)["colour"]["stated_white"].is_array());
    assert!(zones(at, "--pattern full.csv", "plain")["colour"].get("test_patterns").is_none());
}

/// What noise adds to missing and leaking light is within the errors: pictures as bright as the
/// backlight, of few and of many paths.
#[test]
fn the_noise_of_few_paths_is_within_the_errors_of_missing_light() {
    let folder = folder();
    let at = folder.path();
    let of = |paths: u32| {
        let line = format!(
            "zones rgb.toml --pattern full.csv --white 6504K --paths {paths} --receiver front --quiet --out p{paths}"
        );
        batwing(at).args(line.split_whitespace()).assert().success();
        let found: Value =
            serde_json::from_str(&read(at.join(format!("p{paths}/zones.json")))).expect("JSON");
        let entry = &found["colour"]["missing"];
        (value(entry), entry["standard_error"].as_f64().expect("an error"))
    };
    let (few, many) = (of(4000), of(64_000));
    assert!(few.1 > 2.0 * many.1, "{few:?} {many:?}");
    assert!((few.0 - many.0).abs() < 3.0 * few.1.hypot(many.1), "{few:?} {many:?}");
}

#[test]
fn a_run_states_the_light_of_each_channel() {
    let folder = tempdir().expect("a folder");
    let run = run_text(folder.path(), "rgb", &coloured(), "out", &["--paths", "9000"]);
    let run = run.expect("results");
    let by_channel = &run["designs"]["boxed"]["geometric"]["spectrum"]["by_channel"];
    let sum: f64 = DIES
        .iter()
        .map(|(name, ..)| {
            let channel = &by_channel[name];
            assert!(channel["power_ledger"].is_object(), "{by_channel}");
            channel["emitted_w"].as_f64().expect("W")
        })
        .sum();
    // Nine packages of 30 mW.
    assert!((sum - 0.27).abs() < 1e-12, "{sum}");
    // Control: dies of one channel have none.
    let one = DIES
        .iter()
        .fold(coloured(), |text, (name, ..)| text.replace(&format!("channel = \"{name}\"\n"), ""));
    let run = run_text(folder.path(), "one", &one, "one", &["--paths", "9000"]).expect("results");
    assert!(run["designs"]["boxed"]["geometric"]["spectrum"].get("by_channel").is_none());
}
