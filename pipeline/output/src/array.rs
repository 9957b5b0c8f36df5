// SPDX-License-Identifier: MIT OR Apache-2.0
//! Arrays in memory, in place of files.

use metrics::quantity::{Axis, Curve, Map, Quantity};

/// An array, as its `.npy` file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Name of the file without its ending, relative to the folder of the model.
    pub name: String,
    /// Lengths, the slowest first.
    pub shape: Vec<usize>,
    /// Numbers, the last dimension fastest.
    pub values: Vec<f64>,
    /// Axes of the last dimensions; none of curves and of the bins of a surface.
    pub axes: Vec<Axis>,
    /// Quantity of the values; none of curves.
    pub quantity: Option<Quantity>,
}

impl Array {
    pub(super) fn of_map(name: &str, map: &Map) -> Self {
        let axes = vec![map.rows().clone(), map.columns().clone()];
        Self {
            name: name.to_owned(),
            shape: [2].into_iter().chain(axes.iter().map(Axis::bins)).collect(),
            values: [map.value(), map.standard_error()].concat(),
            axes,
            quantity: Some(map.quantity().clone()),
        }
    }

    pub(super) fn of_curve(name: &str, curve: &Curve) -> Self {
        Self {
            name: name.to_owned(),
            shape: vec![3, curve.x().len()],
            values: [curve.x(), curve.value(), curve.standard_error()].concat(),
            axes: Vec::new(),
            quantity: None,
        }
    }
}
