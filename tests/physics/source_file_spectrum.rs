// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[files.source]` with the spectrum of its file: against `[[sources]]`, spectral tables,
//! refusals.
//!
//! Source: the same rays under `[[sources]]`, files written byte by byte
//! (`batwing_tests::ray_files`).

use batwing_tests::ray_files::dome::{
    DOME, agree, fan, folder, parse, seen, source, write_two_tables,
};
use batwing_tests::ray_files::{Says, write, write_lighttools};
use design::Design;
use metrics::jackknife;

/// `[files.source]` with these further keys.
fn led(file: &str, keys: &str) -> String {
    format!("[files.source]\nfile = \"{file}\"\n{keys}\n")
}

#[test]
fn the_file_of_the_box_shines_as_a_source_of_that_file_does() {
    let folder = folder();
    let at = folder.path();
    let nm = [450.0, 532.0, 632.8];
    let rays = fan(3000, |k| nm[k % 3]);
    write(&at.join("all.tm25ray"), &Says::PerRay, true, &rays);
    write(&at.join("none.tm25ray"), &Says::Nothing, true, &rays);
    let of = |table: &str| parse(&format!("{DOME}{table}"), at);
    let own = source("all", "all.tm25ray", "").replace("0.0, 0.5]", "0.0, 0.350001]");
    let (led_all, own) = (of(&led("all.tm25ray", "")), of(&own));
    let lights = |design: &Design| design.lights.clone().expect("lights of the file").lights;
    let [a, b] = [&led_all, &own].map(|design| lights(design).remove(0).light.rule(1));
    assert!(a == b && a.len() == 3, "{a:?} {b:?}");
    let by_file = seen(&led_all, 1);
    agree("the box and a source", &by_file, &seen(&own, 2));
    // Said aloud it is the same; the design's light is that of a file that says nothing.
    let aloud = seen(&of(&led("all.tm25ray", "light = \"file\"")), 1);
    assert_eq!(aloud.far_field, by_file.far_field);
    let over = of(&led("all.tm25ray", "light = \"design\""));
    assert!(over.lights.is_none());
    let over = seen(&over, 1);
    let silent = seen(&of(&led("none.tm25ray", "")), 1);
    assert!(over.far_field == silent.far_field && over.powers == silent.powers);
    assert!(over.far_field != by_file.far_field);
}

#[test]
fn the_box_shines_in_every_spectral_table_of_its_file() {
    let folder = folder();
    let at = folder.path();
    let rays = write_two_tables(&at.join("both.tm25ray"));
    let two = DOME.replace("columns = 1", "crossing = false, columns = 2");
    let receivers = ["1", "2", "1, 2"].map(|packages| {
        format!(
            "[[receivers]]\nname = \"of {packages}\"\nkind = \"far_field\"\ntheta_bin_deg = 90.0\nphi_bin_deg = 360.0\nonly = {{ packages = [{packages}], max_bounces = 1 }}\n"
        )
        .replace("\"of ", "\"of")
        .replace(", 2\"", "-2\"")
    });
    let text = format!("{two}{}{}", receivers.concat(), led("both.tm25ray", "samples = 1"));
    let design = parse(&text, at);
    let flux = |number: f32| -> f64 {
        let own = rays.iter().filter(|ray| ray.colour.to_bits() == number.to_bits());
        own.map(|ray| f64::from(ray.flux)).sum()
    };
    let lights = &design.lights.as_ref().expect("lights").lights;
    let emitted: Vec<f64> = lights.iter().map(|light| light.emitted_w).collect();
    for (emitted, number) in emitted.iter().zip([1.0, 2.0]) {
        let share = flux(number) / (flux(1.0) + flux(2.0));
        assert!((emitted - share).abs() < 1e-6, "{emitted} {share}");
    }
    assert!(emitted.len() == 2 && lights.iter().all(|light| light.sources == ["LED"]));
    // Whatever number of lights a package has, its light is told from its neighbour's.
    let seen = seen(&design, 5);
    let of = |k: usize| jackknife(&seen.receivers[k], |p| p.iter().sum());
    let [first, second, both] = [of(0), of(1), of(2)];
    assert!((first.value + second.value - both.value).abs() < 1e-12);
    let error = first.standard_error.hypot(second.standard_error);
    assert!(
        first.value > 0.2 && (first.value - second.value).abs() < 5.0 * error,
        "{first:?} {second:?}"
    );
}

#[test]
fn light_that_the_file_of_the_box_has_not_is_refused_by_its_key() {
    let folder = folder();
    let at = folder.path();
    let far = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 1\n0 45 90\n0\n1 1 1\n";
    std::fs::write(at.join("far.ies"), far).expect("written");
    let mut rays = fan(20, |k| 500.0 + k as f32);
    write(&at.join("none.tm25ray"), &Says::Nothing, true, &rays);
    write_lighttools(&at.join("good.ray"), &rays);
    rays[16].colour = f32::NAN;
    write_lighttools(&at.join("bad.ray"), &rays);
    for (file, keys, words) in [
        (
            "none.tm25ray",
            "light = \"file\"",
            "files.source.light = \"file\": expected \"design\": \"none.tm25ray\" says nothing of wavelengths",
        ),
        ("far.ies", "light = \"file\"", "files.source.file = \"far.ies\": expected a file of rays"),
        ("far.ies", "samples = 3", "files.source.file = \"far.ies\": expected a file of rays"),
        ("good.ray", "samples = 4", "files.source.samples = 4: expected one of 1, 3, 7"),
        (
            "good.ray",
            "samples = 3\nlight = \"design\"",
            "files.source.samples = 3: expected no such key",
        ),
        (
            "bad.ray",
            "",
            "files.source.file = \"bad.ray\": expected a file whose wavelengths lie from 10 to 100000 nm, got NaN nm for ray 17",
        ),
        (
            "good.ray",
            "light = \"other\"",
            "files.source.light: expected design or file, got \"other\"",
        ),
    ] {
        let text = format!("{DOME}{}", led(file, keys));
        let message = design::parse("bad.toml", &text, at).expect_err(words).to_string();
        assert!(
            message.starts_with("bad.toml: ") && message.contains(words) && !message.contains('\n'),
            "{message}"
        );
    }
    for (file, keys) in
        [("far.ies", ""), ("far.ies", "light = \"design\""), ("bad.ray", "light = \"design\"")]
    {
        let design = parse(&format!("{DOME}{}", led(file, keys)), at);
        assert!(design.lights.is_none(), "{file} {keys}");
    }
}
