// SPDX-License-Identifier: MIT OR Apache-2.0
//! Materials: handbook values, each formula written out by hand, files good and bad.

#![expect(
    clippy::float_cmp,
    reason = "values that are passed through unchanged must come out unchanged"
)]

use approx::assert_abs_diff_eq;
use num_complex::Complex64;

use super::{Formula, Material, MaterialError, RefractiveIndex};

const BK7: [f64; 7] = [
    0.0,
    1.039_612_12,
    0.006_000_698_67,
    0.231_792_344,
    0.020_017_914_4,
    1.010_469_45,
    103.560_653,
];
const SILICA: [f64; 7] =
    [0.0, 0.696_166_3, 0.068_404_3, 0.407_942_6, 0.116_241_4, 0.897_479_4, 9.896_161];

fn n_of(formula: Formula, coefficients: &[f64], wavelength: f64) -> f64 {
    let material = Material::formula(formula, coefficients, [0.1, 10.0]).unwrap();
    material.index_at(wavelength).unwrap().n()
}

#[test]
fn k_slightly_below_zero_is_an_error_of_measurement() {
    let of = |kind: &str, rows: &str| {
        let text = format!("DATA:\n  - type: tabulated {kind}\n    data: |\n{rows}");
        Material::from_yaml(&text)
    };
    let metal = of("nk", "      0.4 1.5 -0.004\n      0.8 1.5 0.004\n").unwrap();
    assert_eq!(metal.index_at(0.4).unwrap().k(), 0.0);
    assert_eq!(metal.lowest_k(), -0.004);
    // Linear between the rows: 0 in the middle, 0.002 at three quarters.
    assert!((metal.index_at(0.7).unwrap().k() - 0.002).abs() < 1e-12);
}

#[test]
fn a_negative_value_matters_where_it_is_used() {
    let text = "DATA:\n  - type: tabulated nk\n    data: |\n      0.4 1.5 -0.02\n      0.6 1.5 0\n      0.8 0 0\n";
    let material = Material::from_yaml(text).unwrap();
    assert_eq!(material.index_at(0.6).unwrap().n(), 1.5);
    for (wavelength, got) in [(0.4, "[1.5, -0.02]"), (0.8, "[0, 0]")] {
        let said = material.index_at(wavelength).unwrap_err().to_string();
        let expected = format!(
            "at {wavelength} micrometres the data give {got}: expected n >= 0 and k >= -0.01, not both 0"
        );
        assert_eq!(said, expected);
    }
}

#[test]
fn rows_are_sorted_and_those_of_one_wavelength_merged() {
    let rows =
        [[0.6, 1.6, 0.2], [0.5, 1.5, 0.1], [0.7, 1.7, 0.3], [0.7, 1.7, 0.5], [0.9, 1.9, 0.5]];
    let material = Material::tabulated(&rows).unwrap();
    for (wavelength, n, k) in [(0.55, 1.55, 0.15), (0.7, 1.7, 0.4), (0.8, 1.8, 0.45)] {
        let index = material.index_at(wavelength).unwrap();
        assert_abs_diff_eq!(index.n(), n, epsilon = 1e-12);
        assert_abs_diff_eq!(index.k(), k, epsilon = 1e-12);
    }
    let said = material.repairs();
    assert_eq!(
        said,
        [
            "1 row out of order, now sorted, the first at 0.5 micrometres",
            "1 row of several for one wavelength, now their mean, the first at 0.7 micrometres"
        ]
    );
    assert!(Material::tabulated(&rows[1..3]).unwrap().repairs().is_empty());
}

#[test]
fn handbook_indices_come_out() {
    // Schott's sheet for N-BK7: d, F and C lines.
    for (formula, coefficients, wavelength, index) in [
        (Formula::Sellmeier2, &BK7[..], 0.587_561_8, 1.51680),
        (Formula::Sellmeier, &SILICA[..], 0.587_561_8, 1.45846),
        (Formula::Sellmeier2, &BK7[..], 0.486_132_7, 1.52238),
        (Formula::Sellmeier2, &BK7[..], 0.656_272_5, 1.51432),
    ] {
        let n = n_of(formula, coefficients, wavelength);
        assert_abs_diff_eq!(n, index, epsilon = 5e-6);
    }
}

#[test]
fn every_formula_is_what_its_definition_says() {
    let (l, l2) = (0.7_f64, 0.49_f64);
    let cases = [
        (Formula::Sellmeier, vec![0.1, 1.0, 0.2], (1.1 + l2 / (l2 - 0.04)).sqrt()),
        (Formula::Sellmeier2, vec![0.1, 1.0, 0.2], (1.1 + l2 / (l2 - 0.2)).sqrt()),
        (
            Formula::Polynomial,
            vec![2.0, 0.3, -2.0, 0.1, 3.0],
            (2.0 + 0.3 / l2 + 0.1 * l * l2).sqrt(),
        ),
        (
            Formula::Mixed,
            vec![2.0, 0.1, 1.0, 0.3, 2.0, 0.2, 0.0, 0.2, 1.0, -0.05, 2.0],
            (2.0 + 0.1 * l / (l2 - 0.09) + 0.2 / (l2 - 0.2) - 0.05 * l2).sqrt(),
        ),
        (Formula::Cauchy, vec![1.4, 0.01, -2.0, 0.002, -4.0], 1.4 + 0.01 / l2 + 0.002 / (l2 * l2)),
        (
            Formula::Gases,
            vec![0.0, 0.05, 238.0, 0.001, 57.0],
            1.0 + 0.05 / (238.0 - 1.0 / l2) + 0.001 / (57.0 - 1.0 / l2),
        ),
        (
            Formula::Herzberger,
            vec![3.4, 0.1, 0.01, -1e-3, 2e-4, -3e-5],
            3.4 + 0.1 / (l2 - 0.028) + 0.01 / (l2 - 0.028).powi(2) - 1e-3 * l2 + 2e-4 * l2 * l2
                - 3e-5 * l2.powi(3),
        ),
        (Formula::Exotic, vec![2.0, 0.02, 0.03, 0.02, 1.5, 0.9], {
            (2.0 + 0.02 / (l2 - 0.03) + 0.02 * (l - 1.5) / ((l - 1.5) * (l - 1.5) + 0.9)).sqrt()
        }),
    ];
    for (formula, coefficients, expected) in cases {
        assert_abs_diff_eq!(n_of(formula, &coefficients, l), expected, epsilon = 1e-14);
    }
    // Formula 8 in the form in which it is defined.
    let n2 = n_of(Formula::Retro, &[0.4, 0.1, 0.02, -0.01], l).powi(2);
    let right = 0.4 + 0.1 * l2 / (l2 - 0.02) - 0.01 * l2;
    assert_abs_diff_eq!((n2 - 1.0) / (n2 + 2.0), right, epsilon = 1e-14);
}

#[test]
fn numbers_name_the_formulas_from_1_to_9() {
    assert_eq!(Formula::from_number(1), Some(Formula::Sellmeier));
    assert_eq!(Formula::from_number(9), Some(Formula::Exotic));
    assert_eq!(Formula::from_number(0), None);
    assert_eq!(Formula::from_number(10), None);
}

#[test]
fn indices_of_no_passive_material_are_refused() {
    for (n, k) in [(0.0, 0.0), (-1.0, 0.0), (1.0, -0.1), (f64::NAN, 0.0), (1.0, f64::INFINITY)] {
        assert!(RefractiveIndex::new(n, k).is_err(), "{n} {k}");
    }
}

#[test]
fn tables_are_exact_at_their_rows_and_linear_between() {
    let table = Material::tabulated(&[[0.4, 1.5, 0.1], [0.5, 1.3, 0.3], [0.7, 1.4, 0.0]]).unwrap();
    assert_eq!(table.index_at(0.5).unwrap(), RefractiveIndex::new(1.3, 0.3).unwrap());
    assert_eq!(table.index_at(0.7).unwrap(), RefractiveIndex::new(1.4, 0.0).unwrap());
    let between = table.index_at(0.55).unwrap();
    assert_abs_diff_eq!(between.n(), 1.325, epsilon = 1e-15);
    assert_abs_diff_eq!(between.k(), 0.225, epsilon = 1e-15);
}

#[test]
fn outside_the_data_is_an_error_that_names_the_range_and_the_wavelength() {
    let table = Material::tabulated(&[[0.4, 1.5, 0.0], [0.7, 1.4, 0.0]]).unwrap();
    let error = table.index_at(0.9).unwrap_err();
    assert_eq!(error.to_string(), "the data cover 0.4 to 0.7 micrometres, got the wavelength 0.9");
    for bad in [0.0, -0.5, f64::NAN, f64::INFINITY] {
        assert!(matches!(table.index_at(bad), Err(MaterialError::Wavelength { .. })));
    }
    let constant = Material::constant(RefractiveIndex::new(1.41, 0.0).unwrap());
    assert_eq!(constant.index_at(1e4).unwrap().n(), 1.41);
}

#[test]
fn a_formula_without_a_real_root_is_an_error_not_a_nan() {
    let pole = Material::formula(Formula::Sellmeier, &[0.0, 1.0, 0.5], [0.1, 1.0]).unwrap();
    for wavelength in [0.5, 0.45] {
        let error = pole.index_at(wavelength).unwrap_err();
        assert_eq!(error, MaterialError::NoIndex { formula: Formula::Sellmeier, wavelength });
    }
}

#[test]
fn wrong_coefficients_and_ranges_are_refused() {
    for (formula, count) in [
        (Formula::Sellmeier, 4),
        (Formula::Mixed, 7),
        (Formula::Herzberger, 2),
        (Formula::Retro, 5),
        (Formula::Exotic, 5),
        (Formula::Cauchy, 0),
    ] {
        let error = Material::formula(formula, &vec![1.0; count], [0.4, 0.7]).unwrap_err();
        assert!(matches!(error, MaterialError::Coefficients { got, .. } if got == count));
    }
    let error = Material::formula(Formula::Cauchy, &[1.4, f64::NAN, -2.0], [0.4, 0.7]).unwrap_err();
    assert!(matches!(error, MaterialError::Coefficient { place: 2, .. }));
    for range in [[0.0, 1.0], [1.0, 0.5], [0.5, f64::INFINITY], [f64::NAN, 1.0]] {
        let error = Material::formula(Formula::Cauchy, &[1.4], range).unwrap_err();
        assert!(matches!(error, MaterialError::Range { .. }));
    }
}

const FILE: &str = "\u{feff}# a comment
REFERENCES: |
    1) Somebody.
    DATA: this is text
COMMENTS: \"20 °C, see
  above: below\"
DATA:
  - type: formula 2 # Sellmeier
    wavelength_range: 0.3 2.5
    coefficients: 0 1.03961212 0.00600069867 0.231792344 0.0200179144
      1.01046945 103.560653
  - type: tabulated k
    data: |
        0.300 2.8607E-06

        0.700 8.9305E-09
SPECS:
    thermal_dispersion:
      - type: \"Schott formula\"
        coefficients: 1 2
";

#[test]
fn a_file_with_formula_and_table_gives_both_over_the_common_range() {
    let glass = Material::from_yaml(FILE).unwrap();
    assert_eq!(glass.range_um(), [0.3, 0.7]);
    let index = glass.index_at(0.5).unwrap();
    assert_abs_diff_eq!(index.n(), n_of(Formula::Sellmeier2, &BK7, 0.5), epsilon = 1e-15);
    assert_abs_diff_eq!(index.k(), 0.5 * (2.8607e-6 + 8.9305e-9), epsilon = 1e-20);
    let windows = Material::from_yaml(&FILE.replace('\n', "\r\n")).unwrap();
    assert_eq!(windows, glass);
}

#[test]
fn older_and_flatter_spellings_are_read() {
    let old = "DATA:\n- type: \"formula 5\"\n  range: 0.4 0.8\n  coefficients: 1.4 0.01 -2\n";
    let material = Material::from_yaml(old).unwrap();
    assert_abs_diff_eq!(material.index_at(0.5).unwrap().n(), 1.44, epsilon = 1e-15);
    let nk = "DATA:\n  - type: tabulated nk\n    data: |\n      0.4 1.5 0.1\n      0.8 1.6 0.2\n";
    let material = Material::from_yaml(nk).unwrap();
    assert_abs_diff_eq!(material.index_at(0.6).unwrap().k(), 0.15, epsilon = 1e-15);
    let n = "DATA:\n  -\n    type: tabulated n\n    data: |\n      0.4 1.5\n      0.8 1.6\n";
    let material = Material::from_yaml(n).unwrap();
    assert_eq!(material.index_at(0.8).unwrap(), RefractiveIndex::new(1.6, 0.0).unwrap());
}

fn assert_refused(text: &str, says: &str) {
    let message = Material::from_yaml(text).expect_err(text).to_string();
    assert!(message.contains(says), "{text}\ngave: {message}\nnot: {says}");
}

#[test]
fn files_of_a_wrong_form_are_refused_with_the_line() {
    for (text, says) in [
        ("", "the key DATA of a YAML file of refractiveindex.info is missing"),
        ("DATA:\n", "gives n is missing"),
        ("DATA: 5\n", "line 1: expected a list below DATA:, got \"5\""),
        ("nonsense\n", "line 1: expected KEY:"),
        ("DATA:\n    stray\n", "line 2: expected an entry that begins"),
        ("DATA:\n  - type: measured\n", "got \"measured\""),
        (
            "DATA:\n  - type: formula 12\n    coefficients: 1\n",
            "formula 1 to formula 9, got \"formula 12\"",
        ),
        ("DATA:\n  - data: |\n      0.4 1 1\n", "type in an entry of DATA is missing"),
        ("DATA:\n  - type: tabulated nk\n", "data of a table is missing"),
        ("DATA:\n\t- type: tabulated n\n", "spaces, not tabs"),
    ] {
        assert_refused(text, says);
    }
}

#[test]
fn broken_tables_are_refused_with_the_row() {
    for (rows, says) in [
        ("", "DATA entry at line 2: a table needs at least one row"),
        ("      0.4 1.5\n", "line 4: expected a row of 3 numbers, got \"0.4 1.5\""),
        ("      0.4 1.5 x\n", "line 4: expected a row of 3 numbers"),
        ("      0.4 NaN 0\n", "row 1: expected finite numbers, got NaN"),
        ("      0.4 1.5 0\n      0.5 1.5 inf\n", "row 2: expected finite numbers, got inf"),
        ("      -0.4 1.5 0\n", "wavelength must be finite and above 0 micrometres, got -0.4"),
        ("      0.4 1.5 0\n   stray\n", "line 5: expected a key in line with the others"),
        ("      0.4 1.5 0\n    data: |\n", "line 5: data is given a second time"),
        ("      0.4 1.5 0\n    unit: nm\n", "line 5: expected one of the keys type"),
        (
            "      0.4 1.5 0\n  - type: tabulated k\n    data: |\n      0.4 0\n",
            "k is given a second time",
        ),
        ("      0.4 1.5 0\nDATA:\n", "line 5: DATA is given a second time"),
    ] {
        assert_refused(&format!("DATA:\n  - type: tabulated nk\n    data: |\n{rows}"), says);
    }
}

#[test]
fn broken_formulas_are_refused_with_the_cause() {
    for (keys, says) in [
        ("    coefficients: 0 1 0.1\n", "wavelength_range of a formula is missing"),
        ("    range: 0.4 0.8\n", "coefficients of a formula is missing"),
        ("    range: 0.4\n    coefficients: 0 1 0.1\n", "two numbers"),
        ("    range: 0.8 0.4\n    coefficients: 0 1 0.1\n", "got 0.8 to 0.4"),
        ("    range: 0.4 0.8\n    coefficients: 0 1\n", "takes 1, 3, 5, ... coefficients, got 2"),
        ("    range: 0.4 0.8\n    coefficients: 0 1 a\n", "line 4: expected a number, got \"a\""),
        (
            "    range: 0.4 0.5\n    coefficients: 0 1 0.1\n  - type: tabulated k\n    data: |\n      0.6 0\n",
            "got 0.6 to 0.5",
        ),
    ] {
        assert_refused(&format!("DATA:\n  - type: formula 1\n{keys}"), says);
    }
}

#[test]
fn the_files_that_come_with_the_project_are_read() {
    let n_at = |text: &str, wavelength: f64| {
        let index = Material::from_yaml(text).unwrap().index_at(wavelength).unwrap();
        (index.n(), index.k())
    };
    let (glass, _) = n_at(include_str!("../../../data/materials/n-bk7.yml"), 0.587_561_8);
    assert_abs_diff_eq!(glass, 1.5168, epsilon = 1e-5);
    let (silica, _) = n_at(include_str!("../../../data/materials/fused-silica.yml"), 0.587_561_8);
    assert_abs_diff_eq!(silica, 1.4585, epsilon = 5e-5);
    assert_eq!(n_at(include_str!("../../../data/materials/silicone-1p41.yml"), 0.55), (1.41, 0.0));
    let (n, k) = n_at(include_str!("../../../data/materials/silver.yml"), 0.55);
    assert!(n > 0.05 && n < 0.06 && k > 3.586 && k < 3.858);
    // Normal incidence from silicone: the mirror the package has, a little better than its 95 %.
    let r = (Complex64::from(1.41) - Complex64::new(n, k))
        / (Complex64::from(1.41) + Complex64::new(n, k));
    assert_abs_diff_eq!(r.norm_sqr(), 0.977, epsilon = 0.003);
}

/// Two glasses of a catalogue, the first as its maker prints it, the second broken before numbers.
const CATALOGUE: &str = "CC own
NM N-BK7 2 517642.251 1.5168 64.17 0 1
GC step 0.5 available
ED 7.1 8.3 2.51 -0.0009 0
CD 1.039612120E+00 6.000698670E-03 2.317923440E-01 2.001791440E-02 1.010469450E+00 1.035606530E+02
LD 3.00000E-01 2.50000E+00
IT 2.90000E-01 0.00000E+00 2.50000E+01
IT 3.00000E-01 5.00000E-02 2.50000E+01
IT 7.00000E-01 9.96000E-01 2.50000E+01
NM Broken 13 0 1.773870 47.25 0
CD 3.072647260E+000 -1.318313270E-002 -1.358074820E-004
2.561441510E-002 4.992342780E-004 4.168055520E-006
7.016629180E-007 0 0 0
LD 0.4 0.7
";

/// Every formula against n_d (of KRS-5 n at 1 µm, Rodney and Malitson 1956) as makers state it.
#[test]
fn catalogues_give_the_index_that_they_state_and_the_absorption() {
    let glass = Material::from_text(CATALOGUE, Some("n-bk7")).unwrap();
    assert_eq!(glass.range_um(), [0.3, 0.7]);
    assert_abs_diff_eq!(glass.index_at(0.587_561_8).unwrap().n(), 1.5168, epsilon = 1e-6);
    // k of the same glass on refractiveindex.info.
    assert_abs_diff_eq!(glass.index_at(0.3).unwrap().k(), 2.8607e-6, epsilon = 5e-11);
    let broken = Material::from_text(CATALOGUE, Some("Broken")).unwrap();
    assert_abs_diff_eq!(broken.index_at(0.587_561_8).unwrap().n(), 1.77387, epsilon = 1e-6);
    assert_eq!(broken.index_at(0.5).unwrap().k(), 0.0);
    for (formula, coefficients, wavelength, expected) in [
        (1, "2.417473 -8.685888e-3 1.396835e-2 6.180845e-4 -5.274288e-5 3.679696e-6", D, 1.568_151),
        (
            3,
            "1.85362871 1.21652879e-2 6.64999251e-5 -2.66759682e-3 -1.29306852e-7 -2.88756685e-7",
            D,
            1.891_717,
        ),
        (5, "1.57410327 1.39786149e-2 8.3004511e-4", D, 1.603_233),
        (6, "0.8559 3.45744e-3 0.8391 1.9881e-2 9e-4 3.88090e-2 0.6845 49.07002500", D, 1.658_643),
        (7, "2.7405 0.0184 0.0179 0.0155", D, 1.670_737),
        (8, "2.81418 0.87968 9.253764e-2 7.11e-3", D, 2.003_385),
        (9, "3.1399 1.3786 2.941e-2 3.861 225.9009", D, 2.154_291),
        (
            10,
            "2.417473 -8.685888e-3 1.396835e-2 6.180845e-4 -5.274288e-5 3.679696e-6 0 0",
            D,
            1.568_151,
        ),
        (
            11,
            "1.8293958 0.0225 1.6675593 0.0625 1.1210424 0.1225 0.04513366 0.2025 12.380234 27089.8681",
            1.0,
            2.446_20,
        ),
        (
            12,
            "3.30328439 -1.45196022e-2 3.83186238e-2 1.82646612e-3 -9.04598096e-5 1.51789935e-5 1.69313476e-5 0",
            D,
            1.850_260,
        ),
    ] {
        let text = format!("NM ONE {formula} 0 1.5\nCD {coefficients}\nLD 0.5 2\n");
        let index = Material::from_text(&text, None).unwrap().index_at(wavelength).unwrap();
        assert_abs_diff_eq!(index.n(), expected, epsilon = 5e-6);
    }
}

/// The yellow line of helium, µm.
const D: f64 = 0.587_561_8;

#[test]
fn columns_of_the_database_are_read() {
    let blocks = "\u{feff}wl,n\n0.4,1.53\n0.55,1.52\n0.7,1.51\n\nwl,k\n0.4,1e-7\n0.6,3e-7\n";
    let glass = Material::from_text(blocks, None).unwrap();
    assert_eq!(glass.range_um(), [0.4, 0.6]);
    let index = glass.index_at(0.5).unwrap();
    assert_abs_diff_eq!(index.n(), 1.53 - 0.01 / 1.5, epsilon = 1e-12);
    assert_abs_diff_eq!(index.k(), 2e-7, epsilon = 1e-18);
    let beside = Material::from_text("# mine\nwl;k;n\n0.4;0.1;1.5\n0.6;0.3;1.7\n", None).unwrap();
    assert_abs_diff_eq!(beside.index_at(0.5).unwrap().k(), 0.2, epsilon = 1e-12);
}

#[test]
fn broken_catalogues_and_columns_are_refused_with_the_line() {
    let one = |lines: &str| format!("NM A 2 0 1.5\n{lines}");
    for (text, glass, says) in [
        (CATALOGUE.into(), None, "expected the name of one of 2 glasses, N-BK7, Broken, got none"),
        (CATALOGUE.into(), Some("BK7"), "2 glasses, N-BK7, Broken, got BK7"),
        (FILE.into(), Some("A"), "expected a catalogue, which has lines NM, for a glass, got A"),
        (one("LD 0.3 2\n"), None, "the line CD of a glass is missing"),
        (one("CD 1 0.1\n"), None, "the line LD of a glass is missing"),
        (one("CD 1 0.1\nLD 0.3\n"), None, "the two wavelengths of the line LD is missing"),
        (one("CD 1 x\nLD 0.3 2\n"), None, "line 2: expected numbers, got \"x\""),
        (
            "NM A 4 0 1.5\nCD 1\nLD 1 2\n".into(),
            None,
            "line 1: expected a formula from 1 to 13 but 4",
        ),
        (
            one("CD 1 0.1\nLD 0.3 2\nIT 0.3 0.5 10\nIT 0.4 0 10\nIT 0.5 0.5 10\n"),
            None,
            "line 5: expected an internal transmittance above 0 between others, got \"0\"",
        ),
        ("wl,x\n0.4,1\n".into(), None, "line 1: expected a heading wl,n or wl,k or wl,n,k"),
        ("wl,n\n0.4,1,2\n".into(), None, "line 2: expected as many numbers as the heading"),
        ("wl,k\n0.4,1\n".into(), None, "a row below wl,n is missing"),
    ] {
        let message = Material::from_text(&text, glass).expect_err(&text).to_string();
        assert!(message.contains(says), "{text}\ngave: {message}\nnot: {says}");
    }
}
