// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing run --until-error` from end to end: it stops where the error is small enough, gives the same bytes on any number of threads, and refuses what
//! is no figure, no error, or no single wavelength.

use std::path::Path;

use batwing_tests::binary::batwing;
use batwing_tests::runs::contents;
use serde_json::Value;
use tempfile::tempdir;

fn run(folder: &Path, flags: &[&str]) -> (bool, String) {
    let output = batwing(folder)
        .args(["run", "d1.toml", "--model", "geometric", "--paths", "30000"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.success(), said)
}

#[test]
fn paths_are_added_until_the_figure_is_known() {
    let folder = tempdir().expect("a folder");
    let designs = batwing_tests::workspace().join("data/designs");
    for name in ["d1.toml", "d1-white.toml"] {
        std::fs::copy(designs.join(name), folder.path().join(name)).expect("copied");
    }
    for (out, threads) in [("one", "1"), ("two", "2")] {
        let flags = [
            "--until-error",
            "extraction_efficiency=0.05%",
            "--out",
            out,
            "--threads",
            threads,
        ];
        let (good, said) = run(folder.path(), &flags);
        assert!(good, "{said}");
    }
    assert_eq!(
        contents(&folder.path().join("one")),
        contents(&folder.path().join("two"))
    );
    let text = std::fs::read(folder.path().join("one/results.json")).expect("results.json");
    let results: Value = serde_json::from_slice(&text).expect("JSON");
    let model = &results["designs"]["D1"]["geometric_100um"];
    let error = model["extraction_efficiency"]["standard_error"]
        .as_f64()
        .expect("a number");
    assert!(error <= 5e-4, "{error}");
    let until = &model["until_error"];
    assert_eq!(
        (&until["figure"], &until["reached"]),
        (&"extraction_efficiency".into(), &true.into())
    );
    let batches = until["batches"].as_u64().expect("a number");
    // 64 groups of 469 paths a batch.
    assert!(
        batches > 1 && model["paths"].as_u64() == Some(batches * 64 * 469),
        "{model}"
    );

    let (good, said) = run(
        folder.path(),
        &[
            "--until-error",
            "uniformity=1e-6",
            "--most-paths",
            "70000",
            "--out",
            "few",
        ],
    );
    assert!(
        good && said.contains("uniformity is known to") && said.contains("--most-paths"),
        "{said}"
    );

    for (flags, word) in [
        (
            &["--until-error", "brightness=1"][..],
            "expected FIGURE=ERROR",
        ),
        (&["--until-error", "uniformity=0"], "above 0"),
        (&["--most-paths", "5000"], "--until-error"),
    ] {
        let (good, said) = run(folder.path(), flags);
        assert!(!good && said.contains(word), "{said}");
    }
    let output = batwing(folder.path())
        .args(["run", "d1-white.toml", "--until-error", "uniformity=1%"])
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && said.contains("light.spectrum"),
        "{said}"
    );
    assert!(!folder.path().join("results").exists());
}
