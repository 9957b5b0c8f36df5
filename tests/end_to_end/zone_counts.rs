// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones --compare-zones`: one picture in several numbers of zones.

use crate::support::binary::batwing;
use crate::zone_colours::{folder, star, value, write_png, zones};

/// Power and missing light of each number of zones are those of a command of its own; so is the halo of the
/// fewest, whose places are those of all.
#[test]
fn numbers_of_zones_are_compared_in_one_command() {
    let folder = folder();
    let at = folder.path();
    let mut pixels = star(at);
    let line = "--picture star.png --levels max --contrast 1000 --distance 600";
    let found = zones(at, &format!("{line} --compare-zones 1x1 --compare-zones 1x3"), "all");
    let counts = found["by_zones"].as_array().expect("numbers of zones");
    for (zones_of, count) in ["1x1", "1x3", "3x3"].into_iter().zip(counts) {
        let alone = zones(at, &format!("{line} --zones {zones_of}"), zones_of);
        assert_eq!(count["zones"], alone["zones"]);
        // The halo lies in or beside the bright one of the fewest zones, here anywhere.
        for name in ["contrast", "hidden"].iter().filter(|_| zones_of == "1x1") {
            assert_eq!(count[name], alone["halo"][name], "{zones_of}: {name}");
        }
        for name in ["missing", "power_share"] {
            assert_eq!(count[name], alone["colour"][name], "{zones_of}: {name}");
        }
        assert!(alone.get("by_zones").is_none() && alone.get("halo_hidden_from").is_none());
    }
    assert_eq!(counts.len(), 3);
    assert_eq!(found["halo_hidden_from"]["share"], 0.95);
    // In the same places more zones light less black.
    let contrast = |k: usize| value(&counts[k]["contrast"]);
    assert!(contrast(0) > contrast(1) && contrast(1) > contrast(2), "{counts:?}");
    // All zones shine: the same light, whatever their number.
    for pixel in (0..36).filter(|k| k % 2 == 0 && k / 6 % 2 == 0) {
        pixels[3 * pixel..][..3].fill(255);
    }
    write_png(&at.join("rows.png"), 6, &pixels);
    let flat = line.replace("star", "rows");
    let flat = zones(at, &format!("{flat} --compare-zones 1x1"), "flat");
    let counts = flat["by_zones"].as_array().expect("numbers of zones");
    for name in ["contrast", "hidden"] {
        let [few, many] = [0, 1].map(|k| value(&counts[k][name]));
        assert!((few - many).abs() < 1e-9 * few, "{name}: {few} {many}");
    }
    std::fs::create_dir(at.join("pictures")).expect("a folder");
    for name in ["a.png", "b.png"] {
        write_png(&at.join("pictures").join(name), 6, &pixels);
    }
    for (options, says) in [
        (
            "--picture star.png --levels max --compare-zones 2x2",
            "--compare-zones 2x2: --zones: expected columns and rows that divide 3 x 3",
        ),
        ("--picture star.png --levels max --compare-zones 3x3", "got 3 x 3 again"),
        ("--picture star.png --levels max --compare-zones 1x1 --direct", "--compare-zones"),
        (
            "--picture pictures --levels max --compare-zones 1x1",
            "--compare-zones: expected one --picture, got a folder of 2",
        ),
        (
            "--pattern some.csv --compare-zones 1x1",
            "--compare-zones: expected --levels RULE and --picture FILE",
        ),
        (
            "--picture star.png --levels percentile=80 --compare-zones 1x1",
            "lights one of 1 x 1 zones, got drives of 0 alone",
        ),
    ] {
        let line = format!("zones rgb.toml {options} --receiver front --quiet --out refused");
        let output = batwing(at).args(line.split_whitespace()).output().expect("run");
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && words.contains(says), "{words}");
        assert!(!at.join("refused/zones.csv").exists(), "{options}");
    }
}
