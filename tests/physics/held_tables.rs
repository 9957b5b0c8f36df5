// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables held in memory for many designs, beside those of single designs.

use arrays::cache::Cache;
use batwing_tests::traces::design;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::model_traces::ModelTraces;
use simulate::tables::tables;
use simulate::trace::observe;
use simulate::trace_plan::DomeChoice;

#[test]
#[ignore = "nightly: solves 40 coarse tables (60 s)"]
fn nightly_held_tables_are_those_of_the_design_and_are_solved_once() {
    let [d1, d2] = ["d1.toml", "d2.toml"].map(|name| {
        let mut design = design(name);
        design.hybrid.tolerance = 0.1;
        design.hybrid.ky_count = Some(4);
        design.trace.paths = 64_000;
        design
    });
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Cache::new(folder.path().to_path_buf());
    let interrupt = Interrupt::default();
    let context = RunContext::quiet(&interrupt, 7);
    let mut traces = ModelTraces::of_search(&cache);
    let hybrid = DomeChoice::Model(Model::Hybrid);
    let held = traces.observe(&d1, hybrid, "", context).expect("a trace");
    assert_eq!(traces.tables_solved(), 17);
    let again = traces.observe(&d1, hybrid, "", context).expect("a trace");
    assert_eq!(held.far_field, again.far_field);
    assert_eq!(traces.tables_solved(), 17);
    // D2 has other shapes on its six innermost bands.
    traces.observe(&d2, hybrid, "", context).expect("a trace");
    assert_eq!(traces.tables_solved(), 23);

    let own = tables(&[&d1], None, None, context).expect("tables").remove(0);
    let surface = dome_surface(&d1, Model::Hybrid, Some(&own)).expect("a surface");
    let single = observe(&d1, &surface, d1.trace.paths, "", context).expect("a trace");
    // The same paths; their groups are merged for the search.
    for (a, b) in held.far_field.total().iter().zip(single.far_field.total()) {
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}
