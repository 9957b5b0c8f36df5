// SPDX-License-Identifier: MIT OR Apache-2.0
//! Photometric files: what is written comes back, what others write is understood, what is wrong is
//! named.

use std::sync::Arc;

use crate::common::source_power_by_direction;
use formats::eulumdat::layout as eulumdat;
use formats::fields::photometric_text;
use formats::ies::layout as ies;
use tracer::glam::DVec3;
use tracer::{Distribution, Emission, FarField, random};

/// Lopsided intensities at 10 degrees, to 0.001.
/// Lamps of an EULUMDAT file.
fn lamp_set(count: i32, flux: f64, watts: f64) -> eulumdat::Lamps {
    eulumdat::Lamps { count, flux, watts }
}

fn table() -> Distribution {
    let thetas: Vec<f64> = (0..=18).map(|k| f64::from(k) * 10.0).collect();
    let phis: Vec<f64> = (0..12).map(|k| f64::from(k) * 30.0).collect();
    let value = |t: f64, p: f64| {
        let (t, p) = (t.to_radians(), p.to_radians());
        let i = 100.0 * (1.0 + t.cos()) * (1.0 + 0.3 * (p - 0.5).cos() * t.sin());
        (i * 1e3).round() / 1e3
    };
    let values = phis.iter().flat_map(|p| thetas.iter().map(move |t| value(*t, *p))).collect();
    Distribution::new(&thetas, &phis, values).unwrap()
}

fn differ(a: &Distribution, b: &Distribution) -> f64 {
    let mut rng = random::stream(5, 0);
    (0..2000)
        .map(|_| random::isotropic(&mut rng))
        .map(|d| (a.intensity(d) - b.intensity(d)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn an_ies_file_comes_back_relative_and_absolute() {
    for (lumens, absolute) in [(1500.0, false), (-1.0, true)] {
        let keywords = vec![("TEST".to_owned(), "T 1".to_owned())];
        let written = ies::Ies::from_distribution(&table(), keywords, lumens, 3.5);
        let text = ies::write(&written);
        assert!(text.lines().all(|l| l.len() <= 132));
        let read = ies::read(&text).unwrap();
        assert_eq!(read, written);
        assert_eq!((read.is_absolute(), ies::write(&read)), (absolute, text));
        assert!(differ(&read.distribution().unwrap(), &table()) < 1e-4);
    }
}

#[test]
fn an_ldt_file_comes_back_relative_and_absolute() {
    for (lamps, absolute) in [(1, false), (-1, true)] {
        let texts = ["maker", "1", "dome", "2", "dome.ldt", "today"].map(str::to_owned);
        let written =
            eulumdat::Ldt::from_distribution(&table(), texts, lamp_set(lamps, 2000.0, 3.5));
        let text = eulumdat::write(&written);
        let read = eulumdat::read(&text).unwrap();
        assert_eq!((read.is_absolute(), eulumdat::write(&read)), (absolute, text));
        let back = read.distribution().unwrap();
        assert!(differ(&back, &table()) < 1e-4);
        let ratio = 100.0 * table().flux() / 2000.0;
        assert!((read.ratios[1] / ratio - 1.0).abs() < 1e-4, "{:?}", read.ratios);
    }
}

/// A file of the layout of LM-63-1995 as luminaire makers write it, in quadrants, with a multiplier
/// and odd line breaks.
const QUADRANTS: &str = "IESNA:LM-63-1995\r\n[TEST] 1\r\n[MANUFAC] x\r\nTILT=INCLUDE\r\n1\r\n2\r\n0 90\r\n1.0 0.9\r\n\
1 1000 2 3 3 1 2 0.1 0.2\r\n0\r\n0.9 1.0 20\r\n0,\t45 90\r\n0 45 90\r\n100 80 0\r\n100 60\r\n0\r\n100 40 10\r\n";

#[test]
fn symmetries_are_unfolded() {
    let table = ies::read(QUADRANTS).unwrap().distribution().unwrap();
    // Multiplier 2, ballast factor 0.9; C45 at gamma 45 in all quadrants.
    for phi in [45.0_f64, 135.0, 225.0, 315.0] {
        let (t, p) = (45_f64.to_radians(), phi.to_radians());
        let d = DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos());
        assert!((table.intensity(d) - 108.0).abs() < 1e-9);
    }
    let side = DVec3::new(0.0, -1.0, 1e-12).normalize();
    assert!((table.intensity(side) - 18.0).abs() < 1e-6);

    // EULUMDAT: intensities that name their plane, in every symmetry.
    for (symmetry, stored) in [
        (0, vec![0, 45, 90, 135, 180, 225, 270, 315]),
        (2, vec![0, 45, 90, 135, 180]),
        (3, vec![270, 315, 0, 45, 90]),
        (4, vec![0, 45, 90]),
        (1, vec![0]),
    ] {
        let mut lines: Vec<String> = ["x", "1"].map(str::to_owned).to_vec();
        lines.extend([symmetry.to_string(), "8".into(), "45".into(), "2".into(), "90".into()]);
        lines.extend(["r", "n", "1", "f", "d"].map(str::to_owned));
        lines.extend(vec!["0".to_owned(); 9]);
        lines.extend(
            ["100", "80", "1", "0", "1", "1", "LED", "1000", "", "", "9"].map(str::to_owned),
        );
        lines.extend(vec!["0".to_owned(); 10]);
        lines.extend((0..8).map(|k| (k * 45).to_string()));
        lines.extend(["0".to_owned(), "90".to_owned()]);
        for plane in &stored {
            lines.extend(["50".to_owned(), (10 + plane).to_string()]);
        }
        let file = eulumdat::read(&lines.join("\n")).unwrap();
        let table = file.distribution().unwrap();
        for plane in (0_i32..360).step_by(45) {
            let image = match symmetry {
                0 => plane,
                1 => 0,
                2 => plane.min(360 - plane),
                3 => (180 - plane + 360) % 360,
                _ => plane.min(360 - plane).min((180 - plane).abs()),
            };
            let image = if symmetry == 3 && stored.contains(&plane) { plane } else { image };
            let p = f64::from(plane).to_radians();
            let d = DVec3::new(p.cos(), p.sin(), 0.0);
            let got = table.intensity(d);
            assert!((got - f64::from(10 + image)).abs() < 1e-6, "{symmetry} {plane}: {got}");
        }
    }
}

#[test]
fn photometric_files_that_are_wrong_are_named() {
    let good = ies::write(&ies::Ies::from_distribution(&table(), Vec::new(), 1500.0, 1.0));
    for (from, to, message) in [
        ("TILT=NONE", "TILT=lamp.tlt", "TILT=INCLUDE, got `TILT=lamp.tlt`"),
        ("TILT=NONE", "", "expected a line TILT=NONE, got the end of the file"),
        ("1 1500 1", "1 1500,5 1", "a number with a decimal point, got `1500,5`, with a comma"),
        ("1 1500 1", "1 nan 1", "lumens per lamp: a finite number, got `nan`"),
        ("0 10 20", "0 20 10", "a vertical angle: above 20, at most 180 degrees, got `10`"),
        ("\r\n200 ", "\r\n-200 ", "a candela value: 0 or more, up to 1e30, got `-200`"),
        ("\r\n200 ", "\r\n", "candela values (13 x 19), got 246"),
        (
            " 19 13 ",
            " 20 13 ",
            "expected 293 numbers behind the input watts, for 20 vertical and 13 horizontal angles with 13 x 20 candela values, got 279",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let got = ies::read(&good.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(got.contains(message) && got.starts_with("line "), "{from}: {got}");
    }
    let texts = Default::default();
    let good = eulumdat::write(&eulumdat::Ldt::from_distribution(
        &table(),
        texts,
        lamp_set(1, 1000.0, 1.0),
    ));
    for (from, to, message) in [
        (
            "\r\n1000\r\n",
            "\r\n1000,0\r\n",
            "line 29: expected flux of the lamps: a number with a decimal point",
        ),
        ("\r\n30\r\n60\r\n", "\r\n60\r\n30\r\n", "a C angle: above 60"),
        (
            "\r\n30\r\n60\r\n",
            "\n30\r\n60\r\n",
            "line 43: expected every line to end in CR LF, as line 1 does, got LF",
        ),
        ("\r\n200\r\n", "\r\ninf\r\n", "an intensity: a finite number, got `inf`"),
        ("\r\n200\r\n", "\r\n", "an intensity: a number, got ``"),
        ("\r\n200\r\n", "\r\n200\r\n7\r\n", "the end of the file after 228 intensities"),
    ] {
        assert!(good.contains(from), "{from}");
        let bad = good.replacen(from, to, 1);
        let got = eulumdat::read(&bad).unwrap_err().to_string();
        assert!(got.contains(message), "{from}: {got}");
    }
    // Older files have names in Latin-1.
    assert_eq!(photometric_text(b"f\xfcr").unwrap(), "für");
    assert!(photometric_text(b"\xff\xfea\0").is_err());
}

#[test]
fn far_fields_that_no_lamp_or_symmetry_makes_are_named() {
    for (from, to, expected) in [
        ("3 3 1 2", "3 3 2 2", "line 9: expected photometric type: 1 (C"),
        (
            "\r\n0 45 90\r\n",
            "\r\n0 45 80\r\n",
            "line 13: expected horizontal angles: one alone, or 0 to 90, 180 or 360, or 90 to 270 degrees, got 0 to 80",
        ),
        ("\r\n0 45 90\r\n", "\r\n0 1e-7 90\r\n", "line 13: expected a horizontal angle: above 0"),
        (
            "\r\n100 80 0\r\n100 60\r\n0\r\n100 40 10\r\n",
            "\r\n0 0 0\r\n0 0\r\n0\r\n0 0 0\r\n",
            "line 17: expected intensities of a far field",
        ),
        ("100 40 10", "100 1e308 10", "line 17: expected a candela value: 0 or more, up to 1e30"),
        ("TEST] 1\r\n", "TEST] 1\n", "line 2: expected every line to end in CR LF"),
    ] {
        assert!(QUADRANTS.contains(from), "{from}");
        let bad = QUADRANTS.replacen(from, to, 1);
        let got = ies::read(&bad).unwrap_err().to_string();
        assert!(got.contains(expected), "{from}: {got}");
    }
}

/// LM-63 before 2002 lets a comma alone separate numbers. The lamp has 2π ∫ I sin γ dγ of two straight
/// pieces: 294.593 lm.
#[test]
fn commas_between_numbers_separate_them() {
    let text = |commas: [&str; 2]| {
        let [head, rows] = commas;
        format!(
            "IESNA91\n[TEST] A\n[MANUFAC] B\nTILT=NONE\n{}\n1{head}1{head}10\n0{rows}45{rows}90\n0\n100{rows}70{rows}0\n",
            ["1", "1000", "1", "3", "1", "1", "2", "0", "0", "0"].join(head)
        )
    };
    for commas in [[" ", " "], [", ", ", "], [" ", ","], [",", ","], [" , ", ",\n"]] {
        let read = ies::read(&text(commas)).unwrap_or_else(|error| panic!("{commas:?}: {error}"));
        let flux = read.distribution().unwrap().flux();
        assert!((flux / 294.593 - 1.0).abs() < 1e-5, "{commas:?}: {flux}");
    }
    // A point tells that commas are no decimal ones, and then of what else is wrong.
    let wrong = text([",", ","]).replace("100,70", "100.0,70.5,3");
    let said = ies::read(&wrong).unwrap_err().to_string();
    assert!(said.contains("3 candela values"), "{said}");
    let decimal = text([" ", " "]).replace("100 70", "100,5 70,25");
    let said = ies::read(&decimal).unwrap_err().to_string();
    assert!(said.contains("a number with a decimal point, got `100,5`"), "{said}");
}

#[test]
fn what_is_odd_and_usable_is_a_warning() {
    // Lamps with less light than the intensities add up to: both numbers are told.
    let dim = ies::read(&QUADRANTS.replacen("1 1000 2", "1 200 2", 1)).unwrap();
    let flux = dim.distribution().unwrap().flux();
    assert!(
        dim.warnings[0].starts_with(&format!(
            "the intensities add up to {flux:.6} lm, more than the 180 lm that the file states"
        )),
        "{:?}",
        dim.warnings
    );
    let texts = Default::default();
    let good = eulumdat::write(&eulumdat::Ldt::from_distribution(
        &table(),
        texts,
        lamp_set(1, 1000.0, 1.0),
    ));
    let dim = eulumdat::read(&good).unwrap();
    assert!(dim.warnings[0].contains("more than the 1000 lm"), "{:?}", dim.warnings);
    // Absolute photometry has no lamps to compare with.
    let absolute = eulumdat::read(&good.replacen("\r\n1\r\nLED", "\r\n-1\r\nLED", 1));
    assert!(absolute.unwrap().warnings.is_empty());
    // Version lines: as the standards have them, as a commercial program writes them, and others.
    for (version, known) in [
        ("IESNA91", true),
        ("IESNA:LM-63-95", true),
        ("IES:LM-63-2019", true),
        ("IESNA:LM-63-2050", false),
        ("IES", false),
    ] {
        let text = QUADRANTS.replacen("IESNA:LM-63-1995", version, 1);
        let read = ies::read(&text).unwrap();
        assert_eq!(read.version, version);
        assert_eq!(read.warnings.is_empty(), known, "{version}");
    }
}

#[test]
fn one_of_several_sets_of_lamps_is_read() {
    let texts = Default::default();
    let one = eulumdat::Ldt::from_distribution(&table(), texts, lamp_set(1, 2000.0, 20.0));
    let lines = eulumdat::write(&one);
    let mut lines: Vec<&str> = lines.split("\r\n").collect();
    lines[25] = "2";
    lines.splice(32..32, ["3", "LED warm", "4000", "3000", "1B", "30"]);
    let two = lines.join("\r\n");
    for (number, flux, watts) in [(1, 2000.0, 20.0), (2, 4000.0, 30.0)] {
        let set = eulumdat::read_lamp_set(&two, number).unwrap();
        assert_eq!((set.flux, set.watts, set.lamp_sets), (flux, watts, 2));
        let light = set.distribution().unwrap().flux() / table().flux();
        assert!((light / (flux / 2000.0) - 1.0).abs() < 1e-6, "{light}");
    }
    assert_eq!(eulumdat::read(&two).unwrap().lamps, 1);
    for number in [0, 3] {
        let got = eulumdat::read_lamp_set(&two, number).unwrap_err().to_string();
        assert!(got.starts_with("line 26: expected a set of lamps from 1 to 2"), "{got}");
    }
}

#[test]
fn a_source_emits_what_its_file_says() {
    let text = ies::write(&ies::Ies::from_distribution(&table(), Vec::new(), 1500.0, 1.0));
    let read = ies::read(&text).unwrap().distribution().unwrap();
    let watts = source_power_by_direction(Emission::Table(Arc::new(read.clone())));
    let far = FarField::new(10.0, 30.0).unwrap();
    for (bin, got) in watts.iter().enumerate() {
        // Power of the bin by a midpoint sum over 8 x 8 parts, of 1 W in all.
        let mut expected = 0.0;
        for i in 0..8 {
            for j in 0..8 {
                let theta = (far.theta_deg(bin / 12) + (f64::from(i) - 3.5) * 1.25).to_radians();
                let phi = (far.phi_deg(bin % 12) + (f64::from(j) - 3.5) * 3.75).to_radians();
                let d = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                expected += read.intensity(d) * theta.sin();
            }
        }
        expected *= 1.25_f64.to_radians() * 3.75_f64.to_radians() / read.flux();
        let error = (expected / 200_000.0).sqrt().max(5e-6);
        assert!((got - expected).abs() < 5.0 * error + 1e-3 * expected, "{bin}: {got} {expected}");
    }
}
