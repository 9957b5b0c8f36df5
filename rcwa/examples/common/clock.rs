// SPDX-License-Identifier: MIT OR Apache-2.0
//! The clock of the examples that time the solver.

use std::error::Error;

/// Seconds of CPU that all threads of this process have had, by the scheduler's account.
pub fn cpu_seconds() -> Result<f64, Box<dyn Error>> {
    let mut nanoseconds = 0.0;
    for task in std::fs::read_dir("/proc/self/task")? {
        let text = std::fs::read_to_string(task?.path().join("schedstat"))?;
        let first = text.split_whitespace().next().ok_or("empty schedstat")?;
        nanoseconds += first.parse::<f64>()?;
    }
    Ok(1e-9 * nanoseconds)
}
