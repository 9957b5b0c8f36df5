// SPDX-License-Identifier: MIT OR Apache-2.0
//! No ray is lost in closed bodies, many paths at a time and one by one, from whichever start. The
//! bench `leaks` does the same with as many rays as one likes.

#[path = "common/closed.rs"]
mod closed;
use crate::common::{assert_none_lost, single};
use tracer::{Control, Settings, run, run_rays};

#[test]
#[ignore = "nightly: a million rays in every closed body (34 s)"]
fn nightly_no_ray_of_a_million_is_lost_in_any_closed_body() {
    for (name, body) in closed::bodies(20_000) {
        let scene = single(body);
        let settings = Settings::new(1_000_000, 5);
        let together = run(&scene, &[], &settings).unwrap();
        let mut left = 0_u64;
        let alone = run_rays(&scene, &settings, Control::default(), |_, _| {
            left += 1;
            Ok(())
        })
        .unwrap();
        for (way, outcome) in [("together", &together), ("one by one", &alone)] {
            let ledger = &outcome.total.ledger;
            assert_none_lost(&format!("{name}, {way}"), outcome);
            assert!(ledger.imbalance().abs() < 1e-9, "{name}, {way}");
            assert!(outcome.hits > outcome.paths, "{name}, {way}");
        }
        // Both ways are the same light.
        let absorbed = |o: &tracer::Outcome| o.mean(|t| t.ledger.absorbed());
        let (a, b) = (absorbed(&together), absorbed(&alone));
        let error = a.standard_error.hypot(b.standard_error) + 1e-12;
        assert!((a.value - b.value).abs() < 5.0 * error, "{name}: {a:?} {b:?}");
        let closed =
            name.contains("planes") || name.contains("rectangles") || name.contains("shells");
        assert_eq!(closed, left == 0, "{name}: {left} rays left");
    }
}
