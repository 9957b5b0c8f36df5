// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cases read as published, and a refusal for each way of being wrong.

#![expect(clippy::float_cmp, reason = "values read must be those written")]

use num_complex::Complex64;
use serde_json::{Value, json};

use super::{Accuracy, Case, Polarization, Structure};

fn good() -> Value {
    json!({
        "wavelength": 0.55, "period": 1, "n_top": [1.41, 0], "n_bottom": [0.22, 6.71],
        "layers_top_to_bottom": [
            {"thickness": 0.3, "segments": [
                {"x0": 0, "x1": 0.3, "n": [1.41, 0]}, {"x0": 0.3, "x1": 1, "n": [1, 0]}]},
            {"thickness": 0.1, "segments": [{"x0": 0, "x1": 1, "n": [1, 0]}]}
        ],
        "theta_deg": 30, "phi_deg": 40.5, "pol": "s", "N": 20, "mount": "conical"
    })
}

fn with_relief() -> Value {
    let mut case = good();
    case.as_object_mut().unwrap().remove("layers_top_to_bottom");
    case["relief"] = json!({
        "depth": 0.4, "background": [1, 0],
        "polygons": [{"n": [1.41, 0], "points": [[0, 0], [1, 0], [0.8, 0.4]]}]
    });
    case
}

fn parse(case: &Value) -> anyhow::Result<Case> {
    Case::parse("case.json", &case.to_string())
}

#[test]
fn a_case_of_layers_is_read_as_it_stands() {
    let case = parse(&good()).unwrap();
    assert_eq!(case.n_bottom, Complex64::new(0.22, 6.71));
    assert_eq!(case.polarization, Polarization::S);
    assert_eq!(case.accuracy, Accuracy::Orders(20));
    let Structure::Layers(layers) = &case.structure else { panic!("not layers") };
    assert_eq!(layers.len(), 2);
    assert_eq!(layers[0].segments.len(), 2);
    assert_eq!(layers[0].segments[1].index, Complex64::from(1.0));
    assert!(layers[1].uniform_index().is_some());
}

#[test]
fn a_layer_of_no_thickness_is_checked_and_dropped() {
    let mut case = good();
    case["layers_top_to_bottom"][0]["thickness"] = json!(0);
    let Structure::Layers(layers) = parse(&case).unwrap().structure else { panic!("not layers") };
    assert_eq!(layers.len(), 1);
    assert!(layers[0].uniform_index().is_some());
    case["layers_top_to_bottom"][0]["segments"][0]["n"] = json!([0, 0]);
    assert!(parse(&case).is_err());
}

#[test]
fn a_reference_case_is_read_through_its_inputs() {
    let wrapped = json!({"id": "x", "inputs": good(), "outputs": {}, "tolerance": {"abs": 1e-9}});
    assert_eq!(parse(&wrapped).unwrap(), parse(&good()).unwrap());
}

#[test]
fn a_relief_with_a_tolerance_is_read() {
    let mut case = with_relief();
    case.as_object_mut().unwrap().remove("N");
    case["tolerance"] = json!(1e-3);
    case["pol"] = json!("unpolarized");
    let case = parse(&case).unwrap();
    assert_eq!(case.accuracy, Accuracy::Tolerance(1e-3));
    assert_eq!(case.polarization, Polarization::Unpolarised);
    let Structure::Relief(relief) = &case.structure else { panic!("not a relief") };
    assert_eq!(relief.polygons()[0].points[2], [0.8, 0.4]);
}

#[test]
fn azimuth_and_mount_may_be_absent() {
    let mut case = good();
    case.as_object_mut().unwrap().retain(|k, _| k != "phi_deg" && k != "mount");
    assert_eq!(parse(&case).unwrap().phi_deg, 0.0);
}

#[test]
fn jones_matrices_are_asked_for_by_a_flag() {
    let mut case = good();
    assert!(!parse(&case).expect("valid").jones);
    case["jones"] = json!(true);
    assert!(parse(&case).expect("valid").jones);
    assert_refused(good(), "/jones", json!("yes"), "true or false");
}

#[test]
fn the_classical_mount_allows_the_plane_across_the_grooves_only() {
    let mut case = good();
    case["mount"] = json!("classical");
    for (phi, allowed) in [(0.0, true), (180.0, true), (-180.0, true), (30.0, false), (90.0, false)]
    {
        case["phi_deg"] = json!(phi);
        assert_eq!(parse(&case).is_ok(), allowed, "{phi}");
    }
}

#[test]
fn negative_polar_angles_are_the_other_side() {
    let mut case = good();
    case["theta_deg"] = json!(-60);
    assert_eq!(parse(&case).unwrap().theta_deg, -60.0);
}

/// The message for `case` with the value at `pointer` replaced (or removed, if null).
fn refusal(mut case: Value, pointer: &str, value: Value) -> String {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let parent = if parent.is_empty() { &mut case } else { case.pointer_mut(parent).unwrap() };
    match (parent, value) {
        (Value::Object(map), Value::Null) => drop(map.remove(key)),
        (Value::Object(map), value) => drop(map.insert(key.into(), value)),
        (list, value) => list[key.parse::<usize>().unwrap()] = value,
    }
    parse(&case).expect_err(pointer).to_string()
}

fn assert_refused(case: Value, pointer: &str, value: Value, says: &str) {
    let message = refusal(case, pointer, value);
    assert!(message.starts_with("case.json: ") && message.contains(says), "{message}\nnot: {says}");
}

#[test]
fn wrong_lengths_and_indices_are_refused() {
    for (pointer, value, says) in [
        ("/wavelength", json!(0), "case.json: wavelength: expected a length above 0, got 0"),
        ("/wavelength", json!("550 nm"), "wavelength: expected a number, got \"550 nm\""),
        ("/wavelength", Value::Null, "wavelength: expected a value, got none"),
        ("/period", json!(-1), "period: expected a length above 0, got -1"),
        (
            "/n_top",
            json!([0, 0]),
            "n_top: expected [n, k] with n >= 0 and k >= 0, not both 0, at most 1e6, got [0.0, 0.0]",
        ),
        ("/n_top", json!([1.41, 0.1]), "n_top: expected [n, 0] with n > 0"),
        ("/n_top", json!([0, 2]), "n_top: expected [n, 0] with n > 0"),
        ("/n_bottom", json!([-1, 0]), "n_bottom: expected [n, k]"),
        ("/n_bottom", json!([1, -0.5]), "n_bottom: expected [n, k]"),
        ("/n_bottom", json!([1, null]), "n_bottom[2]: expected a number, got null"),
        ("/n_bottom", json!(1.5), "n_bottom: expected a list, got 1.5"),
        ("/n_bottom", json!([1]), "n_bottom: expected a list of 2 numbers, got 1"),
    ] {
        assert_refused(good(), pointer, value, says);
    }
}

#[test]
fn wrong_directions_polarisations_and_orders_are_refused() {
    for (pointer, value, says) in [
        (
            "/theta_deg",
            json!(90),
            "theta_deg: expected an angle above -90 and below 90 degrees, got 90",
        ),
        ("/theta_deg", json!(-90.0), "theta_deg: expected an angle above -90 and below 90"),
        ("/theta_deg", Value::Null, "theta_deg: expected a value, got none"),
        ("/phi_deg", json!("0"), "phi_deg: expected a number, got \"0\""),
        ("/pol", json!("TE"), "pol: expected one of s, p, unpolarised, unpolarized, got \"TE\""),
        ("/N", json!(-1), "N: expected a whole number from 0, got -1"),
        ("/N", json!(1.5), "got 1.5"),
        ("/N", json!(1501), "N: expected a whole number from 0 to 1500, got 1501"),
        ("/N", Value::Null, "N: expected either N or tolerance, got neither"),
        ("/tolerance", json!(1e-3), "N: expected either N or tolerance, got both"),
        ("/mount", json!("polar"), "mount: expected classical or conical, got \"polar\""),
        ("/slant", json!(1), "slant: no such key, expected one of wavelength, period,"),
        (
            "/relief",
            with_relief()["relief"].clone(),
            "expected either layers_top_to_bottom, relief or profile, got several",
        ),
        (
            "/layers_top_to_bottom",
            Value::Null,
            "either layers_top_to_bottom, relief or profile, got none",
        ),
        (
            "/layers_top_to_bottom",
            json!({}),
            "layers_top_to_bottom: expected a list, got a JSON object",
        ),
    ] {
        assert_refused(good(), pointer, value, says);
    }
}

#[test]
fn wrong_layers_are_refused() {
    let segments = "/layers_top_to_bottom/0/segments";
    let at = |tail: &str| format!("{segments}/{tail}");
    for (pointer, value, says) in [
        (
            "/layers_top_to_bottom/1",
            json!(3),
            "layers_top_to_bottom[2]: expected a JSON object, got 3",
        ),
        (
            "/layers_top_to_bottom/1/thickness",
            json!(-0.1),
            "layers_top_to_bottom[2].thickness: expected a length from 0, got -0.1",
        ),
        (
            "/layers_top_to_bottom/1/depth",
            json!(1),
            "layers_top_to_bottom[2].depth: no such key, expected thickness or segments",
        ),
        (segments, json!([]), "layers_top_to_bottom[1].segments: segments must cover the period"),
        (&at("0/n"), json!([0, 0]), "layers_top_to_bottom[1].segments[1].n: expected [n, k]"),
        (
            &at("0/x1"),
            json!(0.4),
            "layers_top_to_bottom[1].segments: segments must cover the period from 0 to 1 without gap or overlap: segment 2 should begin at 0.4, begins at 0.3",
        ),
        (&at("0/x1"), json!(0.3 - 2e-12), "segment 2 should begin at"),
        (&at("0/x0"), json!(0.1), "segment 1 should begin at 0, begins at 0.1"),
        (&at("1/x1"), json!(0.9), "the last one ends at 0.9"),
        (&at("1/x1"), json!(1.1), "the last one ends at 1.1"),
        (&at("1/x1"), json!(0.2), "segment 2: x1 must lie beyond x0"),
        (&at("1/x1"), json!("1"), "segments[2].x1: expected a number"),
        (&at("1/colour"), json!(1), "segments[2].colour: no such key, expected one of x0, x1, n"),
    ] {
        assert_refused(good(), pointer, value, says);
    }
}

#[test]
fn wrong_reliefs_are_refused() {
    let polygon = "/relief/polygons/0";
    let at = |tail: &str| format!("{polygon}/{tail}");
    for (pointer, value, says) in [
        ("/relief/depth", json!(0), "relief.depth: expected a length above 0, got 0"),
        ("/relief/background", json!([0, 0]), "relief.background: expected [n, k]"),
        (
            "/relief/slices",
            json!(3),
            "relief.slices: no such key, expected one of depth, background, polygons",
        ),
        ("/relief/polygons", json!(1), "relief.polygons: expected a list, got 1"),
        (&at("n"), json!([-1, 0]), "relief.polygons[1].n: expected [n, k]"),
        (
            &at("points/1"),
            json!([1]),
            "relief.polygons[1].points[2]: expected a list of 2 numbers, got 1",
        ),
        (
            &at("points/1"),
            json!([1, 0.5]),
            "relief.polygons: polygon 1, point 2: z must lie in 0 to the depth 0.4, got 0.5",
        ),
        (&at("points/1"), json!([16.5, 0]), "may be at most 16 periods (16) wide, got 16.5"),
        (&at("points"), json!([[0, 0], [1, 0]]), "needs at least 3 different points, got 2"),
        (
            &at("points"),
            json!([[0, 0], [1, 0.4], [1, 0], [0, 0.4]]),
            "must not cross or touch itself",
        ),
    ] {
        assert_refused(with_relief(), pointer, value, says);
    }
    let message = refusal(with_relief(), "/N", Value::Null);
    assert!(message.contains("got neither"), "{message}");
    let mut case = with_relief();
    case.as_object_mut().unwrap().remove("N");
    for tolerance in [json!(0), json!(1e-9), json!(0.2), json!(-1e-3), json!("small")] {
        let message = refusal(case.clone(), "/tolerance", tolerance);
        assert!(message.contains("tolerance: expected a number"), "{message}");
    }
}

#[test]
fn text_that_is_no_object_or_no_json_is_refused() {
    for (text, says) in [
        ("{\"wavelength\": NaN}", "bad.json: is not valid JSON: expected value at line 1"),
        ("{\"wavelength\": 1e999}", "bad.json: is not valid JSON: number out of range"),
        ("", "bad.json: is not valid JSON: EOF"),
        ("[1]", "bad.json: the file: expected a JSON object, got 1"),
        ("3", "bad.json: the file: expected a JSON object, got 3"),
        ("{\"wavelength\": 1}", "bad.json: period: expected a value, got none"),
        ("{\"inputs\": 3}", "bad.json: inputs: expected a JSON object, got 3"),
        (
            "{\"N\": 3, \"relief\": {\"depth\": 1, \"depth\": 2}}",
            "bad.json: relief.depth: expected this key once, got it twice at line 1",
        ),
        ("{\"inputs\": {}, \"N\": 3}", "bad.json: N: expected this key inside inputs"),
    ] {
        let message = Case::parse("bad.json", text).expect_err(text).to_string();
        assert!(message.starts_with(says), "{message}\nnot: {says}");
    }
}

#[test]
fn a_missing_file_is_named() {
    let error = Case::read(std::path::Path::new("no/such/case.json")).unwrap_err();
    assert!(
        format!("{error:#}")
            .starts_with("no/such/case.json: expected a case of a grating, cannot read it: "),
        "{error:#}"
    );
}

#[test]
fn every_reference_case_at_a_finite_number_of_orders_is_taken_as_it_stands() {
    let mut read = 0;
    for text in [
        include_str!("../../../../data/reference/published.json"),
        include_str!("../../../../data/reference/truncated.json"),
    ] {
        let file: Value = serde_json::from_str(text).unwrap();
        for reference in file["cases"].as_array().unwrap() {
            let id = reference["id"].as_str().unwrap();
            if id.starts_with("reticolo/") || id.starts_with("truncated/") {
                let case = Case::parse(id, &reference.to_string()).unwrap();
                let orders = reference["inputs"]["N"].as_u64().unwrap() as usize;
                assert_eq!(case.accuracy, Accuracy::Orders(orders), "{id}");
                read += 1;
            }
        }
    }
    assert_eq!(read, 35 + 40);
}
