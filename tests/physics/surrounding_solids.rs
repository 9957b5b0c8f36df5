// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packages within a solid of the array: slabs, energy, relief in a medium other than air.
//!
//! Sources: Fresnel's formulas with all inner reflections; the same solid by package and by array;
//! index matching; conservation of energy.

use std::path::Path;

use tempfile::tempdir;

use batwing_tests::judgement::{PATHS, account, alike, close};
use design::Design;
use metrics::jackknife;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::cells::band_cells;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::tables::{keys, tables};
use simulate::trace::observe;

const DOMED: &str = include_str!("../../data/designs/bare-dome.toml");
const RELIEF: &str = include_str!("../../data/designs/d1.toml");

/// A box in air, all black: what the sources send is what arrives.
const BARE: &str = r#"
name = "bare"
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5, plane_height_mm = 4.0 }
light = { wavelength_nm = 550.0 }
"#;

fn parse(text: &str, folder: &Path) -> Design {
    let design = design::parse("slab.toml", text, folder).unwrap_or_else(|e| panic!("{e}"));
    scene_check::check(&design).unwrap_or_else(|e| panic!("{e:#}"));
    design
}

fn traced(design: &Design, model: Model, paths: u64) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 31);
    let solved = (model == Model::Hybrid).then(|| {
        let found = tables(&[design], None, None, env).expect("tables");
        found.into_iter().next().expect("one design")
    });
    let surface = dome_surface(design, model, solved.as_ref()).expect("a surface");
    observe(design, &surface, paths, "", env).expect("a trace")
}

fn trace(text: &str) -> Observation {
    traced(&parse(text, Path::new("")), Model::Geometric, PATHS)
}

/// A box from the bottom to `height` of `width` by `width` about `x`.
fn slab(per: &str, [x, width, height]: [f64; 3], medium: &str) -> String {
    format!(
        "[[solids]]\nname = \"slab\"\nkind = \"box\"\nper = {per:?}\nposition_mm = [{x:?}, 0.0, {:?}]\nsize_mm = [{width:?}, {width:?}, {height:?}]\nmedium = {medium}\n",
        0.5 * height
    )
}

const GLASS: &str = "{ index = 1.52, absorption_per_mm = 0.02 }";

fn domed(columns: usize, rows: usize, more: &str) -> String {
    let array = |key: &str, count: usize| format!("{key} = {count}");
    let text = DOMED
        .replace("columns = 2", &array("columns", columns))
        .replace("rows = 2", &array("rows", rows));
    assert!(text.contains(&array("columns", columns)) && text.contains(&array("rows", rows)));
    format!("{text}\n{more}")
}

#[test]
#[ignore = "slow: 7 s"]
fn a_slab_around_one_package_is_the_same_by_package_and_by_array() {
    let of = |per: &str| trace(&domed(1, 1, &slab(per, [0.0, 7.0, 1.6], GLASS)));
    let (package, array) = (of("package"), of("array"));
    for name in [
        "out_of_domes",
        "back_into_domes",
        "escaped_up",
        "absorbed_by_bottom",
        "absorbed_by_box_top",
        "absorbed_by_ground_mirror",
        "absorbed_by_floor",
        "absorbed_in_slab",
    ] {
        alike(name, account(&package, name), account(&array, name));
    }
    assert!(account(&array, "absorbed_in_slab").value > 0.02);
    assert!(array.ledger().surplus().abs() < 1e-9);
    for bin in 0..package.far_field.group(0).len() {
        let [a, b] = [&package, &array].map(|o| jackknife(&o.far_field, |all| all[bin]));
        alike("direction", a, b);
    }
}

#[test]
#[ignore = "slow: 7 s"]
fn a_dome_of_the_index_of_the_slab_is_not_seen() {
    // Whatever its height: only its bottom and its box are.
    let silicone = "{ index = 1.41 }";
    let of = |height: &str| {
        let text = domed(2, 2, &slab("array", [0.0, 18.0, 1.6], silicone));
        let high = text.replace("height_mm = 1.0", &format!("height_mm = {height}"));
        trace(&high)
    };
    let (low, high) = (of("1.0"), of("1.4"));
    for name in
        ["escaped_up", "absorbed_by_bottom", "absorbed_by_box_top", "absorbed_by_ground_mirror"]
    {
        alike(name, account(&low, name), account(&high, name));
    }
    assert!(low.far_field != high.far_field, "the same draws");
    let leaked = account(&low, "lost_leaked_out_of_a_closed_body");
    assert!(leaked.value < 1e-9, "{leaked:?}");
}

/// A beam straight up from within the slab over a black bottom: what its top sends back goes out by
/// its underside, or up again.
#[test]
fn what_leaves_a_slab_follows_its_index_at_every_wavelength() {
    let folder = tempdir().expect("a folder");
    let glass =
        "DATA:\n  - type: tabulated nk\n    data: |\n        0.42 1.90 0\n        0.70 1.40 0\n";
    std::fs::write(folder.path().join("glass.yml"), glass).expect("written");
    let beam = "[[sources]]\nname = \"beam\"\nkind = \"cosine\"\nexponent = 1e6\nposition_mm = [2.0, 0.0, 1.0]\ninside = \"slab\"\n";
    let medium = "{ material_file = \"glass.yml\" }";
    let text = format!("{BARE}{beam}{}", slab("array", [0.0, 40.0, 2.0], medium));
    let design = parse(&text, folder.path());
    for (nm, n) in [(420.0, 1.9_f64), (700.0, 1.4)] {
        let tuned = design.at(nm).expect("covered");
        let seen = traced(&tuned, Model::Geometric, PATHS);
        let r = ((n - 1.0) / (n + 1.0)).powi(2);
        close("up", account(&seen, "escaped_up"), 1.0 / (1.0 + r));
        close("down", account(&seen, "absorbed_by_floor"), r / (1.0 + r));
    }
    // In a package that stands beside the slab the source does not lie in it.
    let beside = text.replace("position_mm = [0.0, 0.0, 1.0]", "position_mm = [30.0, 0.0, 1.0]");
    let beside = design::parse("slab.toml", &beside, folder.path()).expect("valid by itself");
    let said = scene_check::check(&beside).expect_err("not in the slab").to_string();
    assert!(said.contains("sources[1].inside = \"slab\"") && said.contains("\"air\""), "{said}");
}

#[test]
fn an_array_in_a_slab_keeps_all_power_and_adds_up_over_packages() {
    let only = |k: usize| {
        format!(
            "[[receivers]]\nname = \"of{k}\"\nkind = \"far_field\"\ntheta_bin_deg = 90.0\nphi_bin_deg = 360.0\nonly = {{ packages = [{k}] }}\n"
        )
    };
    let last = |name: &str, surface: &str| {
        format!(
            "[[receivers]]\nname = \"{name}\"\nkind = \"far_field\"\ntheta_bin_deg = 90.0\nphi_bin_deg = 360.0\nonly = {{ last_surface = \"{surface}\" }}\n"
        )
    };
    let receivers: String = (1..=4).map(only).collect();
    let receivers = format!(
        "{receivers}{}{}{}[[receivers]]\nname = \"through\"\nkind = \"surface\"\nsurface = \"dome\"\n",
        last("slab", "slab"),
        last("ground", "ground mirror"),
        last("dome", "dome")
    );
    let seen =
        trace(&domed(2, 2, &format!("{}{receivers}", slab("array", [0.0, 13.0, 1.6], GLASS))));
    assert!(seen.ledger().surplus().abs() < 1e-9);
    let sum = |number: usize| jackknife(&seen.receivers[number], |all| all[..2].iter().sum());
    let up = account(&seen, "escaped_up");
    let four: f64 = (0..4).map(|k| sum(k).value).sum();
    assert!((four - up.value).abs() < 1e-9, "{four} {up:?}");
    // All four stand alike.
    for k in 1..4 {
        alike("package", sum(0), sum(k));
    }
    // Whatever leaves met the slab or the ground last, never a dome.
    let [of_slab, ground, dome] = [4, 5, 6].map(|number| sum(number).value);
    assert!((of_slab + ground - up.value).abs() < 1e-9 && dome <= 0.0 && ground > 0.0);
    // Light goes into the domes of neighbours within the slab: more comes back than in one alone.
    let into = |seen: &Observation| account(seen, "back_into_domes");
    let alone = trace(
        &domed(2, 2, &format!("{}\n", slab("array", [0.0, 13.0, 1.6], GLASS)))
            .replace("pitch_mm", "crossing = false\npitch_mm"),
    );
    assert!(alone.ledger().surplus().abs() < 1e-9);
    assert!(into(&seen).value > into(&alone).value + 10.0 * into(&seen).standard_error);
}

#[test]
fn packages_apart_see_the_slab_and_not_each_other() {
    let apart = |text: &str| {
        trace(
            &text
                .replace("pitch_mm", "crossing = false\npitch_mm")
                .replace("extent = \"array\"", "extent = \"package\""),
        )
    };
    // One of two, and the same one by itself at the end of the slab.
    let two = apart(&domed(2, 1, &slab("array", [0.0, 18.0, 1.6], GLASS)));
    let one = apart(&domed(1, 1, &slab("array", [4.15, 18.0, 1.6], GLASS)));
    for name in ["escaped_up", "absorbed_by_bottom", "absorbed_in_slab", "back_into_domes"] {
        alike(name, account(&two, name), account(&one, name));
    }
}

#[test]
fn some_packages_may_stand_in_the_slab_and_others_in_the_air() {
    let text = domed(2, 1, &slab("array", [-4.0, 7.0, 1.6], GLASS));
    let seen = trace(&text);
    assert!(seen.ledger().surplus().abs() < 1e-9);
    let names = seen.ledger().accounts;
    let domes = names.iter().filter(|(name, _)| name == "absorbed_by_dome");
    assert_eq!(domes.count(), 1, "{names:?}");
    assert!(account(&seen, "absorbed_in_slab").value > 0.01);
    // Polarisation changes no sum.
    let carried = text.replace("[light]", "[light]\npolarization = \"carried\"");
    assert!(carried != text);
    assert!(trace(&carried).ledger().surplus().abs() < 1e-9);
}

/// Relief in a solid around each package, or around all of them.
fn relief(solid: &str) -> String {
    let open = ["kx_per_zone", "ky_count", "tolerance"];
    let stated = RELIEF.lines().filter(|line| !open.iter().any(|key| line.starts_with(key)));
    format!("{}\n{solid}", stated.collect::<Vec<_>>().join("\n"))
}

#[test]
fn orders_are_judged_by_what_the_relief_stands_in() {
    let stated = |orders: usize, solid: &str| {
        let text =
            relief(solid).replacen("[hybrid]\n", &format!("[hybrid]\norders = {orders}\n"), 1);
        design::parse("potted.toml", &text, Path::new(""))
            .map_err(anyhow::Error::from)
            .and_then(|design| scene_check::check(&design))
            .map_err(|error| error.to_string())
    };
    let dense = slab("array", [0.0, 30.0, 1.6], "{ index = 1.6 }");
    // Ring 165 has a period of 17.58 um: 45 orders propagate in silicone, 51 at index 1.6.
    assert_eq!(stated(48, ""), Ok(()));
    assert_eq!(stated(51, &dense), Ok(()));
    let refused = stated(50, &dense).expect_err("too few");
    for words in ["potted.toml: hybrid.orders = 50", "at least 51", "ring 165"] {
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
#[ignore = "nightly: 14 s"]
fn nightly_relief_has_tables_for_what_it_stands_in() {
    let lens = "[[solids]]\nname = \"lens\"\nkind = \"cylinder\"\nposition_mm = [0.0, 0.0, 1.0]\nradius_mm = 2.5\nheight_mm = 2.0\nmedium = { index = 1.2 }\n";
    let around = slab("array", [0.0, 30.0, 1.6], "{ index = 1.2 }");
    let [air, own, common] = ["", lens, &around].map(|solid| parse(&relief(solid), Path::new("")));
    let index = |design: &Design| {
        let cells = band_cells(design);
        let cell = cells.into_iter().flatten().next().expect("a relief");
        [cell.inner_index, cell.background_index].map(f64::to_bits)
    };
    assert_eq!(
        [index(&air), index(&own)],
        [[1.41_f64, 1.0], [1.41, 1.2]].map(|pair| pair.map(f64::to_bits))
    );
    assert_eq!(index(&own), index(&common));
    // One table serves both, another the air.
    assert_eq!(keys(&own), keys(&common));
    assert!(keys(&air).iter().zip(keys(&own)).all(|(a, b)| *a != b));

    // Rays on the relief and rays in its unit cells, which know the medium, see the same
    // extraction; in the air it is another.
    let up = |design: &Design, model: Model| account(&traced(design, model, PATHS), "escaped_up");
    let [fine, control] = [Model::Fine, Model::Control].map(|m| up(&common, m).value);
    let other = up(&air, Model::Control).value;
    assert!((fine - control).abs() < 0.01, "{fine} {control}");
    assert!((other - control).abs() > 0.02, "{other} {control}");

    // Silicone in a solid of its own index scatters nothing: the hybrid is the smooth dome.
    let same = slab("array", [0.0, 30.0, 1.6], "{ index = 1.41 }");
    let quick = relief(&same)
        .replace("rings_per_band = 10", "rings_per_band = 34")
        .replace("[hybrid]", "[hybrid]\nky_count = 6\nkx_per_zone = 2\ntolerance = 0.02");
    let same = parse(&quick, Path::new(""));
    let [hybrid, smooth] = [Model::Hybrid, Model::Control].map(|m| traced(&same, m, PATHS));
    for name in ["escaped_up", "absorbed_by_bottom", "out_of_domes"] {
        alike(name, account(&hybrid, name), account(&smooth, name));
    }

    // Tables of files are for air, and all packages stand in one medium.
    let refused = |text: &str| {
        let design = design::parse("d1.toml", text, Path::new("")).expect("valid by itself");
        scene_check::check(&design).expect_err("refused").to_string()
    };
    let half =
        slab("array", [-8.0, 14.0, 1.6], "{ index = 1.2 }").replace("14.0, 14.0", "14.0, 30.0");
    let said = refused(&relief(&half));
    assert!(
        said.contains("d1.toml: solids") && said.contains("\"slab\"") && said.contains("\"air\""),
        "{said}"
    );
}
