// SPDX-License-Identifier: MIT OR Apache-2.0
//! A small folder of results, made here: what the page holds of it, and what is refused.

use std::path::{Path, PathBuf};

use bsdf::{Bsdf, Grid, OrderEfficiency, Side, SmoothInterface, TableHeader};
use serde_json::json;
use tempfile::TempDir;

use super::*;
use arrays::{csv, exr};
use metrics::quantity::{Axis, Curve, Map, Quantity, Unit};
use runtime::content_hash::{self, sha256_hex};

/// A name that would be markup if it were not escaped.
const NAME: &str = "D<1>";
const HASH: &str = "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";

/// A smooth interface as a table: order 0 has all.
fn smooth_table() -> bsdf::OrderTable {
    let grid = Grid {
        period: 2.0,
        wavelength: 0.55,
        index_inner: 1.41,
        index_outer: 1.0,
        kx_per_zone: 2,
        ky: Grid::ky_nodes(1.41, 1.0, 3),
    };
    let smooth = SmoothInterface::new(1.41, 1.0).expect("valid");
    let rows: Vec<_> = grid
        .rows(|side, kx, ky, polarisation| {
            let n = grid.index(side);
            let sign = if side == Side::Inner { -1.0 } else { 1.0 };
            let z = (n * n - kx * kx - ky * ky).sqrt() * sign;
            let albedo = smooth.albedo(glam::DVec3::new(-kx, -ky, z) / n, polarisation);
            vec![
                OrderEfficiency::new(side, 0, albedo.reflected),
                OrderEfficiency::new(side.opposite(), 0, albedo.transmitted),
            ]
        })
        .collect();
    let header = TableHeader {
        length_unit: "um".to_owned(),
        truncation: 9,
        slices: 4,
        ..TableHeader::default()
    };
    bsdf::OrderTable::build(header, grid, rows).expect("valid")
}

fn write_model(folder: &Path) {
    let intensity = Quantity::new("intensity", Unit::WattPerSteradian);
    let theta: Vec<f64> = (0..90).map(|i| f64::from(2 * i + 1)).collect();
    let curve = |label: &str| {
        let value = theta.iter().map(|t| t.to_radians().cos().abs()).collect();
        Curve::new(label, theta.clone(), value, vec![0.01; 90]).expect("valid")
    };
    let curves = ["mean over azimuth", "azimuth 0°", "azimuth 45°"].map(curve);
    let position = Quantity::new("theta", Unit::Degree);
    csv::write_curves_csv(&folder.join("far_field.csv"), &position, &intensity, &curves)
        .expect("written");
    let axis = |name: &str| {
        Axis::uniform(Quantity::new(name, Unit::Millimetre), -5.0, 5.0, 10).expect("valid")
    };
    let irradiance = Quantity::new("irradiance", Unit::WattPerSquareMillimetre);
    let value = (0..100).map(f64::from).collect();
    let map = Map::new(irradiance, axis("y"), axis("x"), value, vec![0.5; 100]).expect("valid");
    exr::write_map(&folder.join("illuminance.exr"), &map, &json!({})).expect("written");
}

/// A folder `results` with one hybrid, and a folder `tables` with its table.
struct Fixture {
    root: TempDir,
    results: Value,
}

impl Fixture {
    fn new() -> Self {
        let root = tempfile::tempdir().expect("a folder");
        let model = root.path().join("results").join(NAME).join("hybrid_10um");
        write_model(&model);
        let file = |name: &str| {
            let bytes = std::fs::read(model.join(name)).expect("readable");
            json!({"file": format!("{NAME}/hybrid_10um/{name}"), "sha256": sha256_hex(&bytes)})
        };
        let estimate = |value: f64| json!({"value": value, "standard_error": 0.01});
        let mut uniformity = estimate(0.773);
        uniformity["published"] = json!(0.744);
        let mut hybrid = json!({
            "peak_angle_deg": estimate(25.0), "peak_angle_parabola_deg": estimate(24.2), "centre_to_peak": estimate(0.4),
            "uniformity": uniformity,
            "power_ledger": {"emitted": estimate(1.0), "escaped_up": estimate(0.95), "absorbed_by_floor": estimate(0.05)},
            "counters": {"surfaces_per_path": 2.3},
            "paths": 600_000,
            "units": {"peak_angle_deg": "deg", "peak_angle_parabola_deg": "deg", "centre_to_peak": "1", "uniformity": "1", "power_ledger": "W/W", "surfaces_per_path": "1"},
        });
        hybrid["tables"] = json!([{
            "band": 1, "ring": 5, "period_um": 2.0, "depth_um": 0.2, "orders": 9, "slices": 4, "estimated_error": 1e-3,
            "energy_residual": 1e-12, "kx_per_zone": 2, "ky": 3, "grid_error": null, "kx_error": 3e-4, "sha256": HASH,
        }]);
        let mut designs = json!({});
        designs[NAME] = json!({"hybrid_10um": hybrid});
        let results = json!({
            "schema_version": results::SCHEMA_VERSION,
            "content_sha256": "",
            "program": {"name": "batwing", "version": "0.0.0"},
            "quick": true, "quick_note": "coarse & quick", "seed": 7,
            "inputs": [{"file": "d.toml", "sha256": HASH}],
            "files": [file("far_field.csv"), file("illuminance.exr")],
            "published_source": "A <paper>",
            "designs": designs, "references": {}, "figures": {},
        });
        let tables = root.path().join("tables");
        arrays::order_tables::write_table(
            &tables.join(format!("{HASH}.bworders")),
            &smooth_table(),
        )
        .expect("written");
        let fixture = Self { root, results };
        fixture.store();
        fixture
    }

    fn directory(&self) -> PathBuf {
        self.root.path().join("results")
    }

    fn store(&self) {
        let path = self.directory().join("results.json");
        let text = self.results.to_string();
        let digits = content_hash::hashes(&text).map(|h| h.0).unwrap_or_default();
        let empty = format!("\"{}\":\"\"", content_hash::KEY);
        let text = text.replacen(&empty, &empty.replace("\"\"", &format!("\"{digits}\"")), 1);
        std::fs::write(path, text).expect("written");
    }

    fn page(&self) -> Result<Page> {
        let folder = Folder::open(&self.directory())?;
        let tables = self.root.path().join("tables");
        page(&folder, &Source::new(Some(&tables), &self.directory())?)
    }

    /// The whole message with which the folder is refused.
    fn refusal(&self) -> String {
        format!("{:#}", self.page().expect_err("refused"))
    }

    /// The refusal after a change of `results.json`, which is undone.
    fn refusal_after(&mut self, change: impl FnOnce(&mut Value)) -> String {
        let before = self.results.clone();
        change(&mut self.results);
        self.store();
        let refusal = self.refusal();
        self.results = before;
        self.store();
        refusal
    }
}

/// A change of `results.json`.
type Change = Box<dyn FnOnce(&mut Value)>;

fn data_of(html: &str) -> Value {
    let begin = "<script type=\"application/json\" id=\"data\">";
    let (_, rest) = html.split_once(begin).expect("data");
    let (text, _) = rest.split_once("</script>").expect("an end");
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn a_design_of_which_nothing_was_asked_states_what_it_reached() {
    let mut fixture = Fixture::new();
    let boxed = |html: &str| html.split("<div class=\"verdict\"").nth(1).map(str::to_owned);
    let asked = fixture.page().expect("a page").html;
    assert!(boxed(&asked).is_some_and(|text| text.contains("0 of 1 asked are met")));
    let figure = fixture.results.pointer_mut(&format!("/designs/{NAME}/hybrid_10um/uniformity"));
    figure.and_then(Value::as_object_mut).expect("a figure").remove("published");
    fixture.store();
    let html = fixture.page().expect("a page").html;
    let text = boxed(&html).expect("a box");
    let text = text.split("</div>").next().expect("its text");
    assert!(!text.contains("asked") && text.contains("<dd>77.3 ± 1.0 %</dd>"), "{text}");
    // No study of convergence, no second model: no part for them.
    assert!(!html.contains("id=\"compared\"") && !html.contains("id=\"paper\""));
}

/// Figures in lumens, of a receiver and of the ledger.
#[test]
fn the_verdict_states_the_error_of_any_figure_and_tables_hold_absolute_ones() {
    let mut fixture = Fixture::new();
    let figure = |value: f64| json!({"value": value, "standard_error": 0.01 * value});
    let flux =
        |share: f64| json!({"value": 80.0 * share, "standard_error": 0.8 * share, "unit": "lm"});
    let mut up = flux(1.0);
    up["per_package"] = flux(0.5);
    let emitted = |share: f64| json!({"emitted_w": 0.3 * share, "emitted_lm": 100.0 * share});
    let absolute = json!({
        "packages": 2, "emitted": emitted(1.0), "emitted_per_package": emitted(0.5),
        "figures": {"flux_up": up},
    });
    let plate = json!({
        "kind": "luminance", "quantity": "luminance", "unit": "cd/m²", "flux_unit": "lm", "files": [],
        "flux": figure(70.0), "mean": figure(9000.0),
    });
    for (key, asked, name, wanted, reached) in [
        ("escaped_up", 0.02, "escaped up", "at most 2 %", "1 %"),
        ("flux_up", 1.0, "flux, up", "at most 1 lm", "0.8 lm"),
        ("flux.plate", 0.01, "plate, flux", "at most 1 %", "0.7 %"),
        ("mean.plate", 100.0, "plate, mean", "at most 100 cd/m²", "90 cd/m²"),
    ] {
        let model = &mut fixture.results["designs"][NAME]["hybrid_10um"];
        model["absolute"] = absolute.clone();
        model["receivers"] = json!({"plate": plate});
        model["until_error"] =
            json!({"figure": key, "error": asked, "reached": true, "batches": 1});
        fixture.store();
        let html = fixture.page().expect("a page").html.replace("&#x2f;", "/");
        let row = format!(
            "<th scope=\"row\">error of {name}</th><td data-label=\"asked\">{wanted}</td><td data-label=\"reached\">{reached}</td>"
        );
        assert!(html.contains(&row), "no {row}");
        let cell = "<td data-label=\"hybrid, 10 µm\"><span class=\"value\">";
        for (name, value) in [
            ("flux, up", "80.00 ± 0.80 lm"),
            ("flux, up, one package", "40.00 ± 0.40 lm"),
            ("plate, mean", "9000 ± 90 cd/m²"),
        ] {
            let row = format!("<th scope=\"row\">{name}</th>{cell}{value}</span>");
            assert!(html.contains(&row), "no {row}");
        }
        assert!(html.contains("<a href=\"#receivers\">Receivers</a>"));
    }
}

#[test]
fn notes_do_not_repeat_their_heading() {
    assert_eq!(sentence("quick run: fewer rays"), "Fewer rays.");
    assert_eq!(sentence("Fewer rays."), "Fewer rays.");
}

#[test]
fn a_source_is_named_for_figures_that_are_compared_with_it() {
    let mut fixture = Fixture::new();
    let figure = fixture
        .results
        .pointer_mut(&format!("/designs/{NAME}/hybrid_10um/uniformity"))
        .and_then(Value::as_object_mut);
    let published = figure.expect("a figure").remove("published");
    assert!(published.is_some());
    fixture.store();
    let html = fixture.page().expect("a page").html;
    assert!(!html.contains("A &lt;paper&gt;") && html.contains("<dt>seed</dt>"));
}

/// A model that an earlier run computed has the seed of that run.
#[test]
fn every_model_has_its_own_seed() {
    let mut fixture = Fixture::new();
    fixture.results["designs"][NAME]["hybrid_10um"]["seed"] = 9.into();
    fixture.store();
    let html = fixture.page().expect("a page").html;
    assert!(html.contains(", seed 9, quick run") && html.contains("<dt>seed</dt><dd>9</dd>"));
    assert!(html.contains("<td>600\u{202f}000</td><td>9</td>"), "no seed beside the paths");
}

#[test]
fn the_page_holds_what_the_folder_holds() {
    let fixture = Fixture::new();
    let page = fixture.page().expect("a page");
    let html = &page.html;
    assert_eq!(page.tables, (1, 1));
    for words in [
        "<td data-label=\"peak angle (°)\"><span class=\"value\">25.000 ± 0.010</span><small class=\"wrap\">by a parabola 24.200 ± 0.010</small></td>",
        "<td data-label=\"uniformity (%)\"><span class=\"value\">77.3 ± 1.0</span><small>published 74.4</small><small><b>+2.9</b></small>",
        "<strong>Quick run.</strong> Coarse &amp; quick.",
        "<td data-label=\"asked\">74.4 ± 2 %, published</td><td data-label=\"reached\">77.3 ± 1.0 %</td><td data-label=\"verdict\"><b>not resolved</b></td>",
        "<dt>seed</dt><dd>7</dd>",
        "600\u{202f}000",
        HASH,
        "A &lt;paper&gt;",
        "<th scope=\"col\">error, kx</th>",
        "<td>3.0e-4</td>",
    ] {
        assert!(html.contains(words), "no {words}");
    }
    let data = data_of(html);
    let model = &data["models"][0];
    assert_eq!(model["design"], NAME);
    assert_eq!(model["label"], "hybrid, 10 µm");
    assert_eq!(model["farField"]["curves"].as_array().map(Vec::len), Some(3));
    assert_eq!(model["farField"]["curves"][0]["value"][0], json!(0.99985));
    assert_eq!(model["map"]["fullValue"], json!(99.0));
    let lines = data["orders"]["tables"][HASH]["lines"].as_array().expect("lines");
    // Three ky, of which one is beyond the air's rim: that of 0 and one more, from both sides.
    assert!(lines.len() >= 4 && lines[0]["ky"] == json!(0.0), "{lines:?}");
}

#[test]
fn shares_in_the_page_are_those_of_the_table() {
    let page = Fixture::new().page().expect("a page");
    let data = data_of(&page.html);
    let line = &data["orders"]["tables"][HASH]["lines"][0];
    let kx = line["kx"].as_array().expect("kx");
    let normal = kx.iter().position(|x| x == &json!(0.0)).expect("kx = 0");
    let spans: Vec<i64> = line["spans"]
        .as_array()
        .expect("spans")
        .iter()
        .map(|v| v.as_i64().expect("whole"))
        .collect();
    // Orders before the node: s and p of all nodes in front of it, then the inner ones below order
    // 0.
    let before: i64 = (0..normal).map(|i| 2 * (spans[4 * i + 1] + spans[4 * i + 3])).sum();
    let place = before + spans[4 * normal + 1] - spans[4 * normal + 2];
    let text = line["shares"].as_str().expect("letters");
    let bytes = decoded(text);
    let stored = u16::from_le_bytes([bytes[2 * place as usize], bytes[2 * place as usize + 1]]);
    let share = (f64::from(stored) / pack::STEPS).powi(2);
    // Fresnel at normal incidence.
    let expected = 4.0 * 1.41 / (2.41f64 * 2.41);
    assert!((share - expected).abs() < 2e-5, "{share} {expected}");
}

/// Base 64, read by its definition.
fn decoded(text: &str) -> Vec<u8> {
    let alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let bits: Vec<u8> = text
        .chars()
        .filter_map(|c| alphabet.find(c))
        .flat_map(|v| (0..6).rev().map(move |b| (v >> b & 1) as u8))
        .collect();
    bits.chunks_exact(8).map(|byte| byte.iter().fold(0, |a, b| a << 1 | b)).collect()
}

#[test]
fn the_page_needs_nothing_else_and_is_small() {
    let html = Fixture::new().page().expect("a page").html;
    assert!(html.len() < LIMIT);
    for outside in ["http://", "https://", "src=", "@import", "url(", "fetch("] {
        let found = html.matches(outside).count();
        // The namespace of SVG is a name, no address; clip paths are within the page.
        let allowed = match outside {
            "http://" => html.matches("http://www.w3.org/2000/svg").count(),
            "url(" => html.matches("url(#").count(),
            _ => 0,
        };
        assert_eq!(found, allowed, "{outside}");
    }
    assert!(!html.contains("<D<1>") && !html.contains(">D<1>"), "names are escaped");
    assert_eq!(html.matches("</script>").count(), 2);
    assert_eq!(html, Fixture::new().page().expect("a page").html, "the same bytes");
}

#[test]
fn a_page_too_large_is_refused() {
    let mut fixture = Fixture::new();
    let long = "x".repeat(LIMIT);
    let refusal = fixture.refusal_after(|r| r["published_source"] = long.into());
    assert!(refusal.contains("more than 6000000"), "{refusal}");
}

#[test]
fn folders_that_are_none_are_refused() {
    let root = tempfile::tempdir().expect("a folder");
    let message = |path: &Path| format!("{:#}", Folder::open(path).expect_err("refused"));
    let nothing = message(&root.path().join("nothing"));
    assert!(nothing.contains("nothing`: expected a directory of results"), "{nothing}");
    let empty = message(root.path());
    assert!(
        empty.contains("results.json`; expected a directory written by `reproduce`, `run`, `optimise`, `study`, `tolerance`, `full-wave`, `zones` or `bsdf --films`"),
        "{empty}"
    );
    let file = root.path().join("results.json");
    std::fs::write(&file, "{\"seed\": 1").expect("written");
    assert!(message(&file).contains("expected a directory of results, got a file"));
    let cut = message(root.path());
    assert!(cut.contains("results.json` is no usable JSON"), "{cut}");
}

#[test]
fn other_versions_missing_keys_and_wrong_types_are_named() {
    let mut fixture = Fixture::new();
    let drop_key = |key: &'static str| {
        move |r: &mut Value| {
            r.as_object_mut().expect("an object").remove(key);
        }
    };
    let cases: [(Change, &str); 9] = [
        (
            Box::new(|r| r["schema_version"] = 1.into()),
            "results.json`: schema_version: expected 4, got 1; run the design again",
        ),
        (Box::new(drop_key("schema_version")), "schema_version: expected a value, got none"),
        (Box::new(drop_key("content_sha256")), "content_sha256: expected a value, got none"),
        (Box::new(drop_key("files")), "files: expected a value, got none"),
        (
            Box::new(|r| r["seed"] = "one".into()),
            "seed: expected a whole number from 0, got \"one\"",
        ),
        (
            Box::new(|r| r["designs"][NAME]["hybrid_10um"]["uniformity"]["value"] = Value::Null),
            "designs.D<1>.hybrid_10um.uniformity.value: expected a number, got null",
        ),
        (Box::new(|r| r["designs"] = json!({})), "designs: expected at least one design, got none"),
        (
            Box::new(|r| r["files"] = json!([r["files"][1]])),
            "files: expected `D<1>/hybrid_10um/far_field.csv`, which",
        ),
        (
            Box::new(|r| r["files"][0]["file"] = "../d.toml".into()),
            "files[1].file: expected a path under the folder, got \"../d.toml\"",
        ),
    ];
    for (change, words) in cases {
        let refusal = fixture.refusal_after(change);
        assert!(refusal.contains(words), "no `{words}` in: {refusal}");
    }
    fixture.page().expect("good again");
}

#[test]
fn every_key_that_the_page_needs_is_missed() {
    let mut fixture = Fixture::new();
    let model = format!("/designs/{NAME}/hybrid_10um");
    let of_model = format!("designs.{NAME}.hybrid_10um");
    let value = ": expected a value, got none".to_owned();
    let missed = |place: &str, key: &str| (place.to_owned(), key.to_owned(), value.clone());
    let mut cases = Vec::new();
    for key in
        ["program", "quick", "quick_note", "seed", "inputs", "designs", "references", "figures"]
    {
        cases.push(missed("", key));
    }
    for (place, keys) in [
        ("/program", &["name", "version"][..]),
        ("/inputs/0", &["file", "sha256"]),
        ("/files/0", &["file", "sha256"]),
    ] {
        cases.extend(keys.iter().map(|key| missed(place, key)));
    }
    for (below, keys) in [
        (
            "",
            &[
                "peak_angle_deg",
                "centre_to_peak",
                "uniformity",
                "power_ledger",
                "counters",
                "paths",
                "units",
            ][..],
        ),
        ("/uniformity", &["value", "standard_error"]),
        ("/power_ledger", &["emitted"]),
        ("/power_ledger/escaped_up", &["value", "standard_error"]),
        ("/counters", &["surfaces_per_path"]),
        (
            "/tables/0",
            &[
                "band",
                "ring",
                "period_um",
                "depth_um",
                "orders",
                "slices",
                "estimated_error",
                "energy_residual",
                "kx_per_zone",
                "ky",
                "sha256",
            ],
        ),
    ] {
        cases.extend(keys.iter().map(|key| missed(&format!("{model}{below}"), key)));
    }
    for account in ["escaped_up", "absorbed_by_floor"] {
        cases.push((
            format!("{model}/power_ledger"),
            account.to_owned(),
            format!("{of_model}.power_ledger: expected accounts that add up to what was emitted, 1, got 0."),
        ));
    }
    for (place, key, words) in cases {
        let refusal = fixture.refusal_after(|r| {
            let of = r.pointer_mut(&place).and_then(Value::as_object_mut);
            let removed = of.and_then(|object| object.remove(&key));
            assert!(removed.is_some(), "{place}/{key}");
        });
        let named = if words == value {
            let below = place.replacen(&model, &of_model, 1).replace('/', ".");
            let below = below.trim_start_matches('.').replace(".0", "[1]");
            format!("results.json`: {below}{}{key}{words}", if below.is_empty() { "" } else { "." })
        } else {
            words
        };
        assert!(refusal.contains(&named), "no `{named}` in: {refusal}");
    }
    fixture.page().expect("good again");
}

#[test]
fn altered_results_are_refused() {
    let fixture = Fixture::new();
    let path = fixture.directory().join("results.json");
    let text = std::fs::read_to_string(&path).expect("readable");
    for altered in [
        text.replacen("25.0", "24.0", 1),
        text.replacen("uniformity", "uniformty", 1),
        text.replacen("content_sha256\":\"", "content_sha256\":\"0", 1),
    ] {
        assert_ne!(altered, text);
        std::fs::write(&path, altered).expect("written");
        let refusal = fixture.refusal();
        for words in ["content_sha256", "results.json` was altered after the run"] {
            assert!(refusal.contains(words), "no `{words}` in: {refusal}");
        }
    }
}

#[test]
fn altered_and_missing_files_are_named() {
    let fixture = Fixture::new();
    let path = fixture.directory().join(NAME).join("hybrid_10um").join("far_field.csv");
    let text = std::fs::read_to_string(&path).expect("readable");
    std::fs::write(&path, text.replacen("0.01", "0.02", 1)).expect("written");
    let altered = fixture.refusal();
    for words in ["files[1].sha256", "far_field.csv` was altered", "expected", "got"] {
        assert!(altered.contains(words), "no `{words}` in: {altered}");
    }
    std::fs::remove_file(&path).expect("removed");
    let missing = fixture.refusal();
    assert!(missing.contains("files[1].file: cannot read"), "{missing}");
    assert!(missing.contains("far_field.csv`, which belongs to these results"), "{missing}");
}

#[test]
fn tables_missing_damaged_or_others_are_named_or_left_out() {
    let mut fixture = Fixture::new();
    let key = "designs.D<1>.hybrid_10um.tables[1]";
    let refusal = fixture.refusal_after(|r| {
        r["designs"][NAME]["hybrid_10um"]["tables"][0]["slices"] = 5.into();
    });
    assert!(refusal.contains(&format!("{key}.slices: expected 4 as `")), "{refusal}");
    let refusal = fixture.refusal_after(|r| {
        r["designs"][NAME]["hybrid_10um"]["tables"][0]["sha256"] = "../x".into();
    });
    assert!(
        refusal.contains(&format!("{key}.sha256: expected 64 hexadecimal digits")),
        "{refusal}"
    );

    let path = fixture.root.path().join("tables").join(format!("{HASH}.bworders"));
    let bytes = std::fs::read(&path).expect("readable");
    std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("written");
    let damaged = fixture.refusal();
    assert!(damaged.contains("is no usable table"), "{damaged}");
    std::fs::remove_file(&path).expect("removed");
    let missing = fixture.refusal();
    assert!(missing.contains(&format!("{key}.sha256: expected the table `")), "{missing}");

    // Not asked for by name, they are left out and the page says so.
    let folder = Folder::open(&fixture.directory()).expect("good");
    let source = Source::new(None, &fixture.directory()).expect("a place");
    let without = page(&folder, &source).expect("a page");
    assert_eq!(without.tables, (0, 1));
    assert!(without.html.contains("None of the 1 tables that the results list were found"));
    let nowhere = Source::new(Some(Path::new("/nowhere/at/all")), &fixture.directory());
    assert!(
        format!("{:#}", nowhere.expect_err("refused")).contains("--tables: expected a directory")
    );
}

#[test]
fn studies_of_convergence_are_taken_in() {
    let fixture = Fixture::new();
    let errors = json!({"rms": 1e-3, "percentile_99": 2e-3, "max": 3e-3, "flux_weighted_mean": 5e-4, "diffuse": 1e-4, "largest_order": 4e-3});
    let point = |orders: u32| json!({"orders": orders, "slices": 8, "errors": errors, "operations_per_problem": 1e9, "seconds": 0.5});
    let study = json!({
        "design": "D1", "ring": 75, "period_um": 10.8, "depth_um": 5.0, "wavelength_um": 0.55, "tolerance": 2e-3,
        "study": {"plan": {"fixed_slices": 8, "fixed_orders": 35, "reference_orders": 60, "reference_slices": 40},
            "incident_waves": 40, "by_orders": [point(30), point(40)], "by_slices": []},
    });
    let path = fixture.directory().join("D1-ring-075-convergence.json");
    std::fs::write(&path, study.to_string()).expect("written");
    let html = fixture.page().expect("a page").html;
    for words in [
        "D1, ring 75 (period 10.8000 µm, depth 5.000 µm)",
        "Orders, on 8 slices, against M = 60",
        "largest of any order, at 30: 4.00e-3",
    ] {
        assert!(html.contains(words), "no {words}");
    }
    std::fs::write(&path, study.to_string().replace("\"rms\"", "\"mean\"")).expect("written");
    let refusal = fixture.refusal();
    assert!(
        refusal.contains(
            "D1-ring-075-convergence.json`: study.by_orders[1].errors: missing field `rms`"
        ),
        "{refusal}"
    );
}
