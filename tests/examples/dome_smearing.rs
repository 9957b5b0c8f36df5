// SPDX-License-Identifier: MIT OR Apache-2.0
//! Effect of angular binning on a dome: D1 on its own tables, each order moved to a random place in
//! its bin of direction, for several widths of bins. The incidence stays exact.
//!
//! `cargo run --release -p batwing-tests --example dome_smearing TABLES [PATHS]`, where TABLES
//! holds `band-1.bworders` to `band-17.bworders`.

#![expect(clippy::print_stdout, reason = "the table is what the program is run for")]

use std::path::Path;
use std::sync::Arc;

use bsdf::{Binned, Bsdf};

use files::cache::read_table;
use files::interrupt::Interrupt;
use files::run_context::RunContext;
use geometry::Meridian;
use simulate::scene::DomeSurface;
use simulate::trace::observe;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().expect("the folder of the tables");
    let paths: u64 = arguments.next().map_or(2_000_000, |n| n.parse().expect("a number of paths"));
    let design = design::embedded("d1.toml").expect("valid");
    let dome = *design.sphere().expect("a sphere");
    let tables: Vec<Arc<dyn Bsdf>> = (1..=17)
        .map(|band| {
            let path = Path::new(&folder).join(format!("band-{band}.bworders"));
            Arc::new(read_table(&path).expect("a table")) as Arc<dyn Bsdf>
        })
        .collect();
    let ends: Vec<f64> = (1..=17).map(|k| 0.1 * f64::from(k)).collect();
    let interrupt = Interrupt::install().expect("a handler");
    let env = RunContext::quiet(&interrupt, 1);
    for step in [0.0, 0.5, 1.0, 2.0, 5.0] {
        let spread = |table: &Arc<dyn Bsdf>| -> Arc<dyn Bsdf> {
            if step > 0.0 {
                Arc::new(Binned::new(Arc::clone(table), step))
            } else {
                Arc::clone(table)
            }
        };
        let bands = tables.iter().map(|table| Some(spread(table))).collect();
        let surface = DomeSurface::Banded(Meridian::banded(&dome, &ends), bands);
        let seen = observe(&design, &surface, paths, "D1", env).expect("a trace");
        let figures: Vec<String> = seen
            .figures(&design)
            .iter()
            .filter(|f| ["uniformity", "centre_to_peak", "extraction_efficiency"].contains(&f.key))
            .map(|f| {
                format!("{} {:.4} ± {:.4}", f.key, f.estimate.value, f.estimate.standard_error)
            })
            .collect();
        println!("cells of {step} degrees: {}", figures.join(", "));
    }
}
