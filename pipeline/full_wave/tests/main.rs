// SPDX-License-Identifier: MIT OR Apache-2.0
//! Full wave against series, laws and polygons.

mod corners;
mod cylinder;
mod finite_elements;
mod many_corners;
mod series;

use full_wave::Field;

/// Power of each source that leaves within `range` radians of z: half a turn, or a quarter above a
/// mirror, for all of it. With no loss it is what the source emits, which nothing enforces.
fn radiated(field: &Field, range: f64) -> Vec<f64> {
    let [left, right] = [[-range, 0.0], [0.0, range]].map(|side| field.bins(&side).remove(0));
    left.iter().zip(right).map(|(left, right)| left + right).collect()
}
