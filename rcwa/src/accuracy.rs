// SPDX-License-Identifier: MIT OR Apache-2.0
//! Orders and slices for a tolerance: the only searches for a resolution.
//!
//! In: a structure, the light that is asked for, a tolerance. Out: a [`Resolution`] and the error
//! left there. `hemisphere` asks for all directions of a table, `waves` for single directions
//! and lists of them. Both follow one rule. A result is compared with others of more or fewer
//! orders or slices; the change is continued by the law that errors obey (`Law`) and must come
//! below the tolerance. Every efficiency asked for then is within the tolerance of the limit of
//! infinitely many orders and slices; of a hemisphere, whose directions nobody asks for one by one,
//! in the distance [`hemisphere_change`]. What does not settle within the work allowed is refused,
//! or comes with an error above the tolerance and the [`Limit`](crate::error::Limit) that was met.
//!
//! [`Resolution`]: crate::hemisphere::Resolution

mod hemisphere;
mod law;
mod waves;

pub use hemisphere::hemisphere_change;
pub use waves::{
    ErrorParts, Found, NOTHING_KNOWN, Structure, Waves, converge_waves, error_at, first_resolution,
    settle_slices, unsettled,
};

use crate::error::Error;
use crate::hemisphere::{Interface, Resolution};
use crate::progress::Progress;
use hemisphere::{MIN_CLAIM, Probe, SampleEfficiencies};
use law::{HEMISPHERE_SAFETY, WAVES_SAFETY};

/// Smallest tolerance accepted: below it round-off of many layers is in the way.
pub const MIN_TOLERANCE: f64 = 1e-8;
/// Largest tolerance accepted.
pub const MAX_TOLERANCE: f64 = 0.1;

/// Refuses a tolerance that no search takes.
///
/// # Errors
/// One below [`MIN_TOLERANCE`] or above [`MAX_TOLERANCE`].
pub fn check_tolerance(got: f64) -> Result<(), Error> {
    let (smallest, largest) = (MIN_TOLERANCE, MAX_TOLERANCE);
    if (smallest..=largest).contains(&got) {
        Ok(())
    } else {
        Err(Error::Tolerance { smallest, largest, got })
    }
}

/// Orders and slices with which the transmittance from any direction, s or p, is within `tolerance`
/// (by [`hemisphere_change`]), and single orders within three times that (root mean square over the
/// waves of the largest one of each); with the estimated error of the former. In tests the true
/// error stays within the tolerance and within 1.5 times the estimate.
///
/// # Errors
/// A tolerance out of range; half-spaces that both absorb; no convergence within the range; those
/// of the solver.
pub fn converge_hemisphere(
    interface: &Interface,
    tolerance: f64,
    progress: &Progress<'_>,
) -> Result<(Resolution, f64), Error> {
    check_tolerance(tolerance)?;
    let probe = Probe::new(interface, tolerance, progress);
    let structure = Structure::Relief(interface);
    if !structure.is_of_stairs() {
        return hemisphere::search(&probe);
    }
    // Most of a hemisphere swings less about the limit than single waves do.
    let distance = |a: &SampleEfficiencies, b: &SampleEfficiencies| {
        HEMISPHERE_SAFETY / WAVES_SAFETY * a.distance(b)
    };
    let waves = Waves {
        solve: &|at: &Resolution| probe.by_stairs(at),
        distance: &distance,
        highest_order: interface.highest_order(),
        first: None,
    };
    let found = converge_waves(structure, &waves, tolerance, progress)?.within(tolerance)?;
    Ok((found.resolution, found.errors.sum().max(MIN_CLAIM * tolerance)))
}

/// Largest difference of any component: the distance in which single numbers are asked for.
pub fn largest_change(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
