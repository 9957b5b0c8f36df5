// SPDX-License-Identifier: MIT OR Apache-2.0
//! The far field of a results directory, as `batwing export` reads it.

use arrays::csv::write_npy;
use pipeline::commands::export::far_field::{as_it_stands, model};

#[test]
fn candela_of_results_are_taken_for_the_lumens_emitted() {
    let top = tempfile::tempdir().expect("a directory");
    let folder = top.path().join("W/geometric");
    std::fs::create_dir_all(&folder).expect("made");
    let is_lit = |i: usize| i < 45 * 36;
    let bins: Vec<f64> = (0..2 * 90 * 36)
        .map(|i| if is_lit(i) { 300.0 / std::f64::consts::TAU } else { 0.0 })
        .collect();
    write_npy(&folder.join("far_field.npy"), &[2, 90, 36], &bins).expect("written");
    let flux = || {
        let model = model(&folder).expect("a folder");
        as_it_stands(&folder, &model).map(|(far, _)| far.flux())
    };
    assert!((flux().expect("W/sr") / 300.0 - 1.0).abs() < 1e-9);
    let heading = "theta_deg,mean_over_azimuth_intensity_cd\n";
    std::fs::write(folder.join("far_field.csv"), heading).expect("written");
    let error = format!("{:#}", flux().expect_err("no results.json"));
    assert!(error.contains("expected emitted_lm of this model in `results.json`"), "{error}");
    let json =
        r#"{"designs": {"W": {"geometric": {"spectrum": {"emitted": {"emitted_lm": 320.0}}}}}}"#;
    std::fs::write(top.path().join("results.json"), json).expect("written");
    assert!((flux().expect("cd") / (300.0 / 320.0) - 1.0).abs() < 1e-9);
}
