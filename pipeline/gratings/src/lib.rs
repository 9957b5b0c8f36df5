// SPDX-License-Identifier: MIT OR Apache-2.0
//! Single gratings: cases from files, their solution with an error, convergence and near field of the relief
//! of a ring.
//!
//! In: a grating case or the unit cell of a ring. Out: efficiencies of all orders with their error, fields, and
//! the sweep over orders and slices; of one
//! surface between two media by boundary integrals too. What the commands `grating`, `converge` and `near-field` print comes from
//! here, and the Python package calls it.
//!
//! | module | holds |
//! |---|---|
//! | [`grating_case`], [`grating`] | grating cases and their solution |
//! | [`boundary_integral`], [`methods`] | the second method, and the choice between both |
//! | [`interface`] | the cell of a ring for the solver, its efficiencies for a table of orders |
//! | [`convergence`], [`near_field`] | convergence and near field of single rings |

pub mod boundary_integral;
pub mod convergence;
pub mod grating;
pub mod grating_case;
pub mod interface;
pub mod methods;
pub mod near_field;

/// Cell of a ring of the steps that the tests solve: those of 10 µm on a dome of 3.4 mm.
#[cfg(test)]
fn cell_of_ring(ring: usize) -> geometry::Cell {
    use geometry::profile::{Elements, Rounding, Shape, SphericalDome};

    let dome = SphericalDome { sphere_radius_mm: 2.0, height_mm: 1.0, radius_mm: 1.7 };
    let shapes = vec![Shape::Os1; 170];
    let rings = Elements { width_mm: 0.01, shapes, rounding: Rounding::default() };
    geometry::ring_cell(&dome, &rings, ring, 1.41).expect("valid").expect("a step")
}
