// SPDX-License-Identifier: MIT OR Apache-2.0
//! The guard of memory and work before every solution: what ends in an allocation that fails, or takes
//! days of one processor, is refused.

use crate::error::Error;
use crate::orders::Truncation;
use num_complex::Complex64;

/// Matrices (2N)² of a problem's state: four whole ones, and six by or to the waves of the bottom
/// half-space, of which half are taken to propagate.
pub(crate) const MATRICES: f64 = 7.0;

/// Most slices of a relief.
pub const MAX_SLICES: usize = 100_000;
/// Bytes below which the system is not asked.
const LITTLE: f64 = 256.0 * 1024.0 * 1024.0;
/// Matrices (2N)² of modes and workspaces, beside those of each problem.
const SHARED: f64 = 9.0;
/// Most work of one solution: the cube of the orders kept, for the modes of each layer and for each
/// problem in it. Some days of one processor.
const MAX_WORK: f64 = 1e14;

/// Number in a file of the system, after `key`.
#[expect(clippy::disallowed_methods, reason = "the system states its memory in such files")]
fn stated(file: &str, key: &str) -> Option<f64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Bytes that a process may still take: those free in the machine, in its control group and in its
/// address space; infinite where the system tells nothing.
pub fn free_bytes() -> f64 {
    let machine = stated("/proc/meminfo", "MemAvailable:");
    let machine = machine.map_or(f64::INFINITY, |kib| kib * 1024.0);
    let difference = |limit: Option<f64>, used: Option<f64>| Some(limit? - used?);
    // Pages of files are given back when they are needed.
    let cached = stated("/sys/fs/cgroup/memory.stat", "inactive_file ").unwrap_or(0.0);
    let group = difference(
        stated("/sys/fs/cgroup/memory.max", ""),
        stated("/sys/fs/cgroup/memory.current", "").map(|used| used - cached),
    );
    let own = difference(
        stated("/proc/self/limits", "Max address space"),
        stated("/proc/self/status", "VmSize:").map(|kib| kib * 1024.0),
    );
    [group, own].into_iter().flatten().fold(machine, f64::min).max(0.0)
}

/// Refuses to solve so many problems of these orders in so many layers, by so many workers at once;
/// those in real numbers take half of the memory.
pub(crate) fn check(
    truncation: Truncation,
    [layers, problems, workers]: [usize; 3],
    is_real: bool,
) -> Result<(), Error> {
    let work = (truncation.count() as f64).powi(3) * layers as f64 * (1.0 + problems as f64);
    if work > MAX_WORK {
        return Err(Error::Work { highest: truncation.highest(), layers, work, max: MAX_WORK });
    }
    let of_problems = MATRICES * problems as f64 * if is_real { 0.5 } else { 1.0 };
    check_matrices(truncation, workers as f64 * (of_problems + SHARED))
}

/// Problems of these orders that each of so many workers solves at once, `all` if there is room:
/// half of the free memory is theirs.
pub(crate) fn problems_at_once(
    truncation: Truncation,
    all: usize,
    workers: usize,
) -> Result<usize, Error> {
    let of = |problems: usize| bytes(truncation, MATRICES * problems as f64 + SHARED);
    if of(all) * workers as f64 <= LITTLE {
        return Ok(all);
    }
    check_matrices(truncation, workers as f64 * (MATRICES + SHARED))?;
    let matrices = 0.5 * free_bytes() / workers as f64 / bytes(truncation, 1.0);
    Ok(((matrices - SHARED) / MATRICES).max(1.0) as usize)
}

/// Bytes of matrices of (2N)² complex numbers.
fn bytes(truncation: Truncation, matrices: f64) -> f64 {
    matrices * (2.0 * truncation.count() as f64).powi(2) * size_of::<Complex64>() as f64
}

/// Refuses so many matrices of (2N)² complex numbers.
pub(crate) fn check_matrices(truncation: Truncation, matrices: f64) -> Result<(), Error> {
    let needed_bytes = bytes(truncation, matrices);
    if needed_bytes <= LITTLE {
        return Ok(());
    }
    let (free_bytes, got) = (free_bytes(), truncation.highest());
    if needed_bytes <= free_bytes {
        return Ok(());
    }
    let max_orders = ((free_bytes / needed_bytes).sqrt() * got as f64) as usize;
    Err(Error::Memory { max_orders, free_bytes, got })
}

/// Refuses so many slices.
pub(crate) fn check_slices(got: usize) -> Result<(), Error> {
    if got <= MAX_SLICES { Ok(()) } else { Err(Error::Slices { got, max: MAX_SLICES }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_can_do_is_refused() {
        let orders = |m| Truncation::new(m).unwrap();
        assert!(check(orders(40), [30, 200, 2], true).is_ok());
        assert!(matches!(check(orders(2000), [1, 1_000_000, 1], true), Err(Error::Work { .. })));
        assert!(matches!(check(orders(50), [1, 10_000_000, 1], false), Err(Error::Memory { .. })));
        assert!(check_slices(MAX_SLICES).is_ok());
        assert!(matches!(check_slices(usize::MAX), Err(Error::Slices { .. })));
        assert!(free_bytes() > 0.0);
    }
}
