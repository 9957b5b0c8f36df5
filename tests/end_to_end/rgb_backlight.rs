// SPDX-License-Identifier: MIT OR Apache-2.0
//! The shipped RGB backlight and the commands of its guide.

use serde_json::Value;
use tempfile::tempdir;

use batwing_tests::{read, workspace};
use metrics::chromaticity;

use crate::support::binary::batwing;
use crate::zone_colours::{kept, value, write_png};

/// The shipped design and the commands of its guide, of few paths.
#[test]
#[ignore = "slow: 5 s"]
fn the_commands_of_the_guide_run_on_the_shipped_design() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let page = read(workspace().join("docs/guide/rgb-backlight.md")).replace("\\\n", " ");
    let commands: Vec<&str> =
        page.lines().filter_map(|line| line.strip_prefix("    batwing ")).collect();
    assert_eq!(commands.len(), 4, "{commands:?}");
    std::fs::create_dir(at.join("frames")).expect("a folder");
    for name in ["film.png", "frames/1.png", "frames/2.png"] {
        let pixels: Vec<u8> =
            (0..48 * 27).flat_map(|k| [0, 200 * u8::from(k % 97 == 5), 0]).collect();
        write_png(&at.join(name), 48, &pixels);
    }
    for command in commands {
        let is_zones = command.starts_with("zones");
        let few: &[&str] = if is_zones { &["--paths", "1000", "--cache", "kept"] } else { &[] };
        batwing(at).args(command.split_whitespace()).args(few).assert().success();
    }
    let found: Value = serde_json::from_str(&read(at.join("white/zones.json"))).expect("JSON");
    for (axis, expected) in
        chromaticity::white_of(6504.0).expect("daylight").into_iter().enumerate()
    {
        let got = value(&found["colour"]["white"]["xy"][axis]);
        assert!((got - expected).abs() < 1e-9, "{got} {expected}");
    }
    // What stands for a larger array says so in the errors of colours.
    for key in ["missing", "leaking", "white_difference"] {
        assert!(found["colour"][key]["bias_bound"].as_f64().is_some_and(|b| b > 0.0), "{key}");
    }
    assert!(found["colour"]["white"]["luminance"]["bias_bound"].as_f64().is_some_and(|b| b > 0.0));
    assert_eq!(read(at.join("film/film.csv")).lines().count(), 3);
}

/// The shipped file itself, small.
#[test]
#[ignore = "slow: 5 s"]
fn the_shipped_design_runs_as_it_is() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let design = workspace().join("data/designs/rgb-backlight.toml");
    let design = design.to_str().expect("a path");
    batwing(at).args(["check", design]).assert().success();
    std::fs::write(at.join("some.csv"), "1,0\n0,0\n").expect("written");
    let line = "--pattern some.csv --packages 8x8 --zones 2x2 --receiver display --white 6504K --paths 1000 --quiet --out out";
    batwing(at).args(["zones", design]).args(line.split_whitespace()).assert().success();
    let found: Value = serde_json::from_str(&read(at.join("out/zones.json"))).expect("JSON");
    assert_eq!(found["traced_packages"], serde_json::json!([8, 8]));
    assert!(value(&found["white"]) > 0.0 && found["colour"]["gamut"].as_array().is_some());
}

/// 144 x 81 packages before a picture of 3840 x 2160, from kept responses.
#[test]
#[ignore = "nightly: 144 x 81 packages in three channels (a minute)"]
fn nightly_a_large_rgb_backlight_shows_a_large_picture() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let design = workspace().join("data/designs/rgb-backlight.toml");
    let size = [3840, 2160];
    // A tenth of each zone of 48 x 27 is white.
    let pixel = |k: usize| {
        let [i, j] = [k % size[0] % 80, k / size[0] % 80];
        [255 * u8::from(i < 8 && j < 64); 3]
    };
    let pixels: Vec<u8> = (0..size[0] * size[1]).flat_map(pixel).collect();
    write_png(&at.join("film.png"), size[0], &pixels);
    let line = "--picture film.png --levels max --white 6504K --packages 144x81 --zones 48x27 --receiver display --paths 2000 --quiet --cache kept";
    let run = |out: &str| -> Value {
        let design = design.to_str().expect("a path");
        let line = format!("{line} --out {out}");
        batwing(at).args(["zones", design]).args(line.split_whitespace()).assert().success();
        serde_json::from_str(&read(at.join(out).join("zones.json"))).expect("JSON")
    };
    let first = run("first");
    let responses = kept(at);
    let again = run("again");
    assert_eq!((kept(at), &again["white"]), (responses, &first["white"]));
    assert_eq!(again["packages"], serde_json::json!([144, 81]));
    // All zones are lit in full; missing and leaking light are shares.
    let power = again["colour"]["power_share"].as_f64().expect("a share");
    assert!((power - 1.0).abs() < 1e-6, "{power}");
    for key in ["missing", "leaking"] {
        assert!((0.0..0.5).contains(&value(&again["colour"][key])), "{key}");
    }
    let luminance = value(&again["colour"]["white"]["luminance"]);
    assert!((10.0..1e6).contains(&luminance), "{luminance}");
}
