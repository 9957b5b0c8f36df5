// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray files with wavelengths: refraction, spectral tables, lumens, shared wavelengths, refusals.
//!
//! Sources: Snell's law and Fresnel's formulas; TM-25 and LightTools files written byte by byte
//! (`batwing_tests::ray_files`).

use tempfile::tempdir;

use batwing_tests::ray_files::dome::{DOME, agree, fan, folder, index, parse, seen, source};
use batwing_tests::ray_files::{Ray, Says, write, write_lighttools};
use batwing_tests::workspace;
use design::Design;
use design::schema;
use design::spectrum::lights::Colour;
use metrics::jackknife;
use simulate::observation::Observation;

use crate::support::binary::{batwing, json};

/// Three rays of `file`, which the table `table` of a design names, leave a hemisphere in three
/// directions, each with its share of the flux.
fn a_ball_of_glass_deviates_every_colour(file: &str, table: &str) {
    let folder = folder();
    // One start and one direction, three colours.
    let x = 1.1;
    let colours = [(430.0, 1.0), (550.0, 2.0), (700.0, 1.0)];
    let rays: Vec<Ray> = colours
        .iter()
        .map(|&(nm, flux)| Ray {
            position: [x as f32, 0.0, 0.0],
            direction: [0.0, 0.0, 1.0],
            flux,
            colour: nm as f32,
        })
        .collect();
    let path = folder.path().join(file);
    if file.ends_with(".tm25ray") {
        write(&path, &Says::PerRay, true, &rays);
    } else {
        write_lighttools(&path, &rays);
    }
    let bin = 0.25;
    let receiver = format!(
        "[[receivers]]\nname = \"first\"\nkind = \"far_field\"\ntheta_bin_deg = {bin:?}\nphi_bin_deg = 90.0\nonly = {{ max_bounces = 1 }}\n"
    );
    let design = parse(&format!("{DOME}{receiver}{table}"), folder.path());
    let lights = design.lights.as_ref().expect("lights of the file");
    assert!(
        matches!(&lights.lights[..], [light] if matches!(&light.light, Colour::Rays(r) if r.wavelengths == 3))
    );
    let seen = seen(&design, 3);
    let totals = seen.receivers[0].total().to_vec();
    let mut expected = vec![0.0; totals.len()];
    let mut bins = Vec::new();
    for (nm, flux) in colours {
        // The ray goes up at x: the normal there leans by α, sin α = x / R; it leaves at β, sin β =
        // n sin α, and so leans outwards by β - α.
        let n = index(nm);
        let sin_a = f64::from(x as f32) / 2.0;
        let (a, b) = (sin_a.asin(), (n * sin_a).asin());
        let [rs, rp] = [
            (n * a.cos() - b.cos()) / (n * a.cos() + b.cos()),
            (a.cos() - n * b.cos()) / (a.cos() + n * b.cos()),
        ];
        let transmitted = 1.0 - 0.5 * (rs * rs + rp * rp);
        let theta = (b - a).to_degrees();
        // Azimuth 0, at the border of two bins: either takes the light.
        let row = (theta / bin).floor() as usize;
        bins.push(row);
        expected[4 * row] += f64::from(flux) / 4.0 * transmitted;
    }
    assert!(bins[0] > bins[1] + 3 && bins[1] > bins[2] + 3, "{bins:?}");
    for row in 0..totals.len() / 4 {
        let got = jackknife(&seen.receivers[0], |p| p[4 * row..4 * row + 4].iter().sum());
        let want: f64 = expected[4 * row..4 * row + 4].iter().sum();
        let error = got.standard_error.max(1e-12);
        assert!((got.value - want).abs() < 5.0 * error, "{row}: {got:?} for {want}");
        assert!(want > 0.0 || got.value == 0.0, "{row}: {got:?}");
    }
}

#[test]
fn a_ball_of_glass_deviates_every_colour_by_snells_law() {
    for file in ["three.tm25ray", "three.ray"] {
        a_ball_of_glass_deviates_every_colour(file, &source("beam", file, ""));
        // The rays start where `[files.source]` has its middle.
        a_ball_of_glass_deviates_every_colour(
            file,
            &format!("[files.source]\nfile = \"{file}\"\n"),
        );
    }
}

#[test]
fn rays_of_many_colours_are_those_of_files_of_one_colour_each() {
    let folder = folder();
    let at = folder.path();
    let nm = [450.0, 532.0, 632.8];
    let rays = fan(3000, |k| nm[k % 3]);
    let mut apart = String::new();
    let whole: f32 = rays.iter().map(|ray| ray.flux).sum();
    for (k, nm) in nm.iter().enumerate() {
        let own: Vec<Ray> = rays.iter().skip(k).step_by(3).copied().collect();
        let file = format!("{k}.tm25ray");
        // One says its wavelength in the header, one with each ray, one is told it.
        let (says, keys) = match k {
            0 => (Says::One(*nm), String::new()),
            1 => (Says::PerRay, "light = \"file\"\n".to_owned()),
            _ => (Says::Nothing, "wavelength_nm = 632.8\n".to_owned()),
        };
        write(&at.join(&file), &says, true, &own);
        let part: f32 = own.iter().map(|ray| ray.flux).sum();
        let keys = format!("{keys}power = {:?}", part / whole);
        apart += &source(&format!("part {k}"), &file, &keys);
    }
    write(&at.join("all.tm25ray"), &Says::PerRay, true, &rays);
    let together = parse(&format!("{DOME}{}", source("all", "all.tm25ray", "")), at);
    let apart = parse(&format!("{DOME}{apart}"), at);
    let nodes = |design: &Design| {
        let lights = &design.lights.as_ref().expect("lights").lights;
        let rules = lights.iter().flat_map(|light| {
            let rule = light.light.rule(1).into_iter();
            rule.map(|(nm, weight)| (nm, weight * light.emitted_w))
        });
        rules.collect::<Vec<_>>()
    };
    for (a, b) in nodes(&together).iter().zip(nodes(&apart)) {
        assert!((a.0 - b.0).abs() + (a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
    }
    agree("by wavelength", &seen(&together, 1), &seen(&apart, 2));
    // The design's light passes the file's over, and differs.
    let over = parse(&format!("{DOME}{}", source("all", "all.tm25ray", "light = \"design\"")), at);
    assert!(over.lights.is_none());
    let told =
        parse(&format!("{DOME}{}", source("all", "all.tm25ray", "wavelength_nm = 550.0")), at);
    assert!(told.lights.is_none());
    let [over, told] = [&over, &told].map(|design| seen(design, 1));
    assert_eq!(over.far_field, told.far_field);
}

#[test]
fn rays_of_one_colour_are_bit_for_bit_those_of_the_design() {
    let folder = folder();
    let at = folder.path();
    let rays = fan(500, |_| 550.0);
    for (name, says) in [("n", Says::Nothing), ("o", Says::One(550.0)), ("p", Says::PerRay)] {
        write(&at.join(format!("{name}.tm25ray")), &says, true, &rays);
    }
    let of = |name: &str| {
        let design = parse(&format!("{DOME}{}", source("s", &format!("{name}.tm25ray"), "")), at);
        assert!(design.lights.is_none(), "{name}");
        seen(&design, 4)
    };
    let [a, b, c] = ["n", "o", "p"].map(of);
    assert!(a.far_field == b.far_field && a.powers == b.powers);
    assert!(a.far_field == c.far_field && a.powers == c.powers);
}

#[test]
fn lumens_of_rays_become_watts_by_their_wavelengths() {
    let folder = folder();
    let at = folder.path();
    let colours: [(f32, f64); 3] = [(450.0, 0.038), (550.0, 0.994_950_1), (650.0, 0.107)];
    let in_watts = fan(900, |k| colours[k % 3].0);
    let in_lumens: Vec<Ray> = in_watts
        .iter()
        .enumerate()
        .map(|(k, ray)| Ray {
            flux: (f64::from(ray.flux) * 683.0 * colours[k % 3].1) as f32,
            ..*ray
        })
        .collect();
    write(&at.join("w.tm25ray"), &Says::PerRay, true, &in_watts);
    write(&at.join("lm.tm25ray"), &Says::PerRay, false, &in_lumens);
    for weighting in ["radiometric", "photometric"] {
        let lit = DOME.replace(
            "wavelength_nm = 550.0",
            &format!("wavelength_nm = 550.0, weighting = \"{weighting}\""),
        );
        let [w, lm] = ["w", "lm"].map(|name| {
            let design =
                parse(&format!("{lit}{}", source("s", &format!("{name}.tm25ray"), "")), at);
            let lights = design.lights.expect("lights");
            (lights.emitted_lm(), lights.lights[0].light.rule(1))
        });
        // By hand: Σ P V / Σ P, each colour with a third of the rays.
        let power =
            |c: usize| in_watts.iter().skip(c).step_by(3).map(|r| f64::from(r.flux)).sum::<f64>();
        let watts: f64 = (0..3).map(power).sum();
        let seen: f64 = (0..3).map(|c| power(c) * colours[c].1).sum();
        for (emitted, rule) in [w, lm] {
            assert!((emitted - 683.0 * seen / watts).abs() < 1e-5 * emitted, "{emitted}");
            for (c, (nm, weight)) in rule.into_iter().enumerate() {
                let share = match weighting {
                    "radiometric" => power(c) / watts,
                    _ => power(c) * colours[c].1 / seen,
                };
                let stated = f64::from(colours[c].0);
                assert!((nm - stated).abs() + (weight - share).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn spectral_tables_of_a_file_are_spectra_of_its_rays() {
    let folder = folder();
    let at = folder.path();
    let blue = vec![[440.0, 1.0], [460.0, 3.0]];
    let red = vec![[620.0, 1.0], [640.0, 1.0], [660.0, 0.0]];
    let rays = fan(1000, |k| if k % 4 == 0 { 2.0 } else { 1.0 });
    let tables = Says::Tables(vec![blue.clone(), red, blue.clone()]);
    write(&at.join("both.tm25ray"), &tables, true, &rays);
    let flux = |part: &[Ray]| part.iter().map(|ray| f64::from(ray.flux)).sum::<f64>();
    let mut apart = String::new();
    let told = "spectrum = { kind = \"table\", wavelength_nm = [620.0, 640.0, 660.0], power = [1.0, 1.0, 0.0], samples = 3 }";
    for (number, says, keys) in
        [(1.0_f32, Says::Table(blue), "samples = 3"), (2.0, Says::Nothing, told)]
    {
        let own: Vec<Ray> =
            rays.iter().filter(|ray| ray.colour.to_bits() == number.to_bits()).copied().collect();
        let file = format!("{number}.tm25ray");
        write(&at.join(&file), &says, true, &own);
        let keys = format!("power = {:?}\n{keys}", flux(&own) / flux(&rays));
        apart += &source(&format!("table {number}"), &file, &keys);
    }
    let both = parse(&format!("{DOME}{}", source("both", "both.tm25ray", "samples = 3")), at);
    let apart = parse(&format!("{DOME}{apart}"), at);
    let lights = |design: &Design| design.lights.as_ref().expect("lights").lights.clone();
    assert_eq!((lights(&both).len(), lights(&apart).len()), (2, 2));
    for (a, b) in lights(&both).iter().zip(lights(&apart)) {
        assert_eq!(a.light.rule(3), b.light.rule(3));
        assert!((a.emitted_w - b.emitted_w).abs() < 1e-9);
    }
    agree("by table", &seen(&both, 1), &seen(&apart, 2));
}

#[test]
fn many_wavelengths_are_shared_by_a_few() {
    let folder = folder();
    let at = folder.path();
    let mild = "DATA:\n  - type: tabulated n\n    data: |\n        0.4 1.55\n        0.8 1.45\n";
    std::fs::write(at.join("mild.yml"), mild).expect("written");
    let dome = DOME.replace("glass.yml", "mild.yml")
        + "far_field = { bin_deg = 5.0, azimuth_bin_deg = 45.0, centre_deg = 10.0, peak_fit_deg = 10.0 }\n";
    // Colours that go with the direction: an average over directions would not do. So many rays
    // that bins do not see single ones.
    let rays = fan(200_000, |k| 420.0 + 0.0018 * k as f32);
    write(&at.join("many.tm25ray"), &Says::PerRay, true, &rays);
    let of = |samples: usize, seed: u64| {
        let keys = format!("samples = {samples}");
        let mut design = parse(&format!("{dome}{}", source("s", "many.tm25ray", &keys)), at);
        design.trace.sampling = schema::Sampling::Random;
        let lights = design.lights.as_ref().expect("lights");
        assert_eq!(lights.lights[0].light.rule(samples).len(), samples);
        seen(&design, seed)
    };
    let [one, few, fine] = [of(1, 1), of(15, 2), of(31, 3)];
    agree("15 of many wavelengths", &few, &fine);
    // All rays at the median wavelength are refracted elsewhere.
    let part = |o: &Observation| jackknife(&o.far_field, |p| p[..8 * 4].iter().sum());
    let [one, fine] = [&one, &fine].map(part);
    let error = one.standard_error.hypot(fine.standard_error);
    assert!((one.value - fine.value).abs() > 5.0 * error, "{one:?} {fine:?}");
}

/// What a header says, whether flux is in W, the colour of ray 17, keys of the source, and words of
/// the message.
fn refused() -> Vec<(Says, bool, f32, &'static str, &'static str)> {
    vec![
        (
            Says::PerRay,
            true,
            f32::NAN,
            "",
            "got NaN nm for ray 17; light = \"design\" passes the file's over",
        ),
        (Says::PerRay, true, 0.0, "", "wavelengths lie from 10 to 100000 nm, got 0 nm for ray 17"),
        (Says::PerRay, true, -450.0, "", "got -450 nm for ray 17"),
        (Says::PerRay, false, 300.0, "", "wavelengths from 360 to 830 nm only"),
        (Says::PerRay, true, 900.0, "", "for light of 900 nm from s"),
        (Says::One(f32::NAN), true, 0.0, "", "got NaN nm for all rays"),
        (Says::One(0.0), true, 0.0, "", "got 0 nm for all rays"),
        (
            Says::Nothing,
            true,
            0.0,
            "light = \"file\"",
            "sources[1].light = \"file\": expected \"design\": \"bad.tm25ray\" says nothing of wavelengths",
        ),
        (
            Says::Table(vec![[500.0, 0.0], [510.0, 0.0]]),
            true,
            0.0,
            "",
            "spectral table 1: power with power above 0",
        ),
        (
            Says::Table(vec![[500.0, 1.0], [510.0, -1.0]]),
            true,
            0.0,
            "",
            "spectral table 1: power with finite numbers from 0 to 1e30, got -1",
        ),
        (
            Says::Tables(vec![vec![[500.0, 1.0], [510.0, 1.0]]]),
            true,
            0.0,
            "",
            "rays that name one of the 1 spectral tables, got number 500 for ray 1",
        ),
        (
            Says::PerRay,
            true,
            500.0,
            "samples = 4",
            "sources[1].samples = 4: expected one of 1, 3, 7",
        ),
        (
            Says::PerRay,
            true,
            500.0,
            "samples = 3\ntolerance = 0.1",
            "sources[1].samples = beside `tolerance`",
        ),
        (
            Says::PerRay,
            true,
            500.0,
            "samples = 3\nlight = \"design\"",
            "sources[1].samples = 3: expected no such key",
        ),
    ]
}

#[test]
fn wavelengths_that_are_none_are_refused_with_the_ray() {
    let folder = folder();
    let at = folder.path();
    let rays = |colour: f32| {
        let mut rays = fan(20, |k| 500.0 + k as f32);
        rays[16].colour = colour;
        rays
    };
    let lm = |says: &Says| format!("{says:?}");
    for (says, radiant, colour, keys, words) in refused() {
        write(&at.join("bad.tm25ray"), &says, radiant, &rays(colour));
        let text = format!("{DOME}{}", source("s", "bad.tm25ray", keys));
        let message = match design::parse("bad.toml", &text, at) {
            Ok(_) => panic!("accepted: {} {colour}", lm(&says)),
            Err(error) => error.to_string(),
        };
        assert!(message.contains(words) && !message.contains('\n'), "{}: {message}", lm(&says));
        // Whatever the file says, the design's light can be taken.
        let text = format!("{DOME}{}", source("s", "bad.tm25ray", "light = \"design\""));
        assert!(design::parse("good.toml", &text, at).is_ok(), "{}", lm(&says));
    }
}

#[test]
fn an_example_shines_in_three_lights_and_is_drawn_in_them() {
    let folder = tempdir().expect("a folder");
    let design = workspace().join("data/designs/rgb-dome.toml");
    let design = design.to_str().expect("UTF-8");
    let flags = ["run", design, "--paths", "64000", "--out", "r"];
    let run = json(folder.path(), &flags);
    let spectrum = &run["designs"]["rgb-dome"]["geometric"]["spectrum"];
    let lights = spectrum["light"]["sources"].as_array().expect("a list");
    let names: Vec<&str> = lights.iter().filter_map(|l| l["sources"][0].as_str()).collect();
    assert_eq!(names, ["red", "green", "blue"]);
    assert_eq!(spectrum["units"]["intensity"], "cd");
    let page = json(folder.path(), &["report", "r"]);
    assert!(page.is_object(), "{page}");

    json(folder.path(), &["rays", design, "--count", "40", "--out", "p"]);
    let paths = folder.path().join("p/rgb-dome-geometric-rays.json");
    let paths = std::fs::read_to_string(paths).expect("paths");
    let paths: serde_json::Value = serde_json::from_str(&paths).expect("JSON");
    let paths = paths["paths"].as_array().expect("a list");
    // Radiant powers of 1.6, 1.4 and 1.
    let of = |nm: std::ops::Range<f64>| {
        let nm_of = |path: &serde_json::Value| path["wavelength_nm"].as_f64().expect("nm");
        paths.iter().filter(|path| nm.contains(&nm_of(path))).count()
    };
    assert_eq!([of(600.0..650.0), of(480.0..590.0), of(454.0..456.0)], [16, 14, 10]);

    let out = ["export", design, "--format", "ies", "--out", "x.ies"];
    let refused = batwing(folder.path()).args(out).output().expect("it runs");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && said.contains("expected"), "{said}");
    assert!(!folder.path().join("x.ies").exists());
}
