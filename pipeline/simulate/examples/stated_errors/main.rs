// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prints scatter over stated error of every figure of a design traced by rays, and how often its
//! 95 % intervals hold the figure of all paths.
//!
//! `cargo run --release -p batwing-simulate --example stated_errors -- DESIGN PATHS SEEDS`

#![expect(clippy::print_stdout, reason = "a table on the terminal is what it is for")]

mod scatter;

use std::path::Path;

use crate::scatter::over_seeds;
use anyhow::{Context as _, Result};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, paths, seeds] = &arguments[..] else {
        anyhow::bail!("expected DESIGN PATHS SEEDS");
    };
    let number =
        |text: &String| text.parse::<f64>().with_context(|| format!("not a number: {text}"));
    let design = design::load(Path::new(file))?;
    let all = over_seeds(&design, number(paths)? as u64, number(seeds)? as u64);
    println!(
        "| figure | resolved | mean | scatter | stated | ratio | all paths | intervals hold it |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for f in &all {
        let [bounds, holding] = f.bounds;
        println!(
            "| {} | {}/{} | {:.5} | {:.2e} | {:.2e} | {:.3} | {:.5} | {holding}/{bounds} |",
            f.key,
            f.resolved,
            f.seeds,
            f.mean,
            f.deviation,
            f.stated,
            f.ratio(),
            f.truth,
        );
    }
    let resolved: Vec<_> = all.iter().filter(|f| f.is_resolved()).collect();
    let far = |ratio: f64| ratio.ln().abs();
    let worst = resolved.iter().max_by(|a, b| far(a.ratio()).total_cmp(&far(b.ratio())));
    let worst = worst.map_or_else(String::new, |f| format!("{:.2}, {}", f.ratio(), f.key));
    let coverage = all.iter().map(scatter::Scatter::coverage_of_intervals).fold(1.0, f64::min);
    println!(
        "\nresolved: {}; worst ratio: {worst}; not resolved: {}; least coverage: {coverage:.2}",
        resolved.len(),
        all.len() - resolved.len(),
    );
    Ok(())
}
