// SPDX-License-Identifier: MIT OR Apache-2.0
//! Memory that a computation may take.

use anyhow::ensure;
use rcwa::cost_model;
use rcwa::hemisphere::{Directions, Resolution};

/// Where the system does not say how much is free.
const ASSUMED: f64 = 8.0 * 1024.0 * 1024.0 * 1024.0;

/// Bytes that are free.
pub fn free_bytes() -> f64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"));
    let kib = line.and_then(|line| line.trim().split(' ').next()?.parse::<f64>().ok());
    kib.map_or(ASSUMED, |kib| kib * 1024.0)
}

/// Refuses a hemisphere beyond the free memory.
///
/// # Errors
/// Memory needed and free.
pub fn fits(directions: &Directions, resolution: &Resolution) -> anyhow::Result<()> {
    let (needed, free) = (cost_model::memory(directions, resolution), free_bytes());
    let gib = f64::from(1 << 30);
    ensure!(
        needed <= free,
        "orders: expected as many as fit into {:.1} GiB of free memory, got {} with {} ky, which take {:.1} GiB",
        free / gib,
        resolution.truncation.highest(),
        directions.ky.len(),
        needed / gib
    );
    Ok(())
}
