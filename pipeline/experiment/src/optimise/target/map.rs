// SPDX-License-Identifier: MIT OR Apache-2.0
//! A target map: relative illuminance over the plane, and how far a trace is from it.

use anyhow::{Result, ensure};

use metrics::lit::LitBins;
use results::paired_figure::PairedFigure;
use simulate::observation::Observation;

use super::rows;

/// Relative illuminance at the nodes of a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct MapTarget {
    /// Columns of the grid, ascending, mm.
    x_mm: Vec<f64>,
    /// Rows of the grid, ascending, mm.
    y_mm: Vec<f64>,
    /// Row by row.
    values: Vec<f64>,
}

impl MapTarget {
    /// Lines of x and y in mm from the middle of the array and an illuminance in any unit, one for
    /// each node of a grid, in any order.
    ///
    /// # Errors
    /// A line that is no such row, nodes that make no grid.
    pub fn parse(text: &str) -> Result<Self> {
        let expected = "x and y in mm and an illuminance of at least 0";
        let mut rows = rows::read(text, expected, |_, row: [f64; 3]| {
            row.into_iter().all(f64::is_finite) && row[2] >= 0.0
        })?;
        rows.sort_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
        let places = |k: usize| {
            let mut all: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        let (x_mm, y_mm) = (places(0), places(1));
        let nodes = y_mm.iter().flat_map(|y| x_mm.iter().map(|x| [*x, *y]));
        let is_grid = rows.len() == x_mm.len() * y_mm.len()
            && rows.iter().zip(nodes).all(|(row, node)| row[..2] == node);
        ensure!(
            is_grid && x_mm.len() >= 2 && y_mm.len() >= 2,
            "expected each node of a grid once, at least 2 by 2, got {} nodes at {} values of x and {} of y",
            rows.len(),
            x_mm.len(),
            y_mm.len()
        );
        let values: Vec<f64> = rows.iter().map(|row| row[2]).collect();
        ensure!(values.iter().any(|value| *value > 0.0), "expected some light, got 0 everywhere");
        Ok(Self { x_mm, y_mm, values })
    }

    /// Illuminance at a point, bilinear between nodes; none beyond the grid.
    fn at(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let (i, a) = between(&self.x_mm, x)?;
        let (j, b) = between(&self.y_mm, y)?;
        let row = |j: usize| {
            let at = j * self.x_mm.len() + i;
            (1.0 - a) * self.values[at] + a * self.values[at + 1]
        };
        Some((1.0 - b) * row(j) + b * row(j + 1))
    }

    /// Root mean square difference of the map from the target over the lit bins whose middles lie on
    /// the grid, both scaled to the same mean; 1 is the root mean square of the target.
    ///
    /// # Errors
    /// No such bins, or none with light in the target.
    pub fn distance(&self, seen: &Observation, lit: Option<&LitBins>) -> Result<PairedFigure> {
        let counted = |bin: usize| lit.map_or(1.0, |lit| lit.counted[bin]);
        let bins = (0..seen.grid.columns * seen.grid.rows).filter(|bin| counted(*bin) > 0.0);
        let bins = bins.filter_map(|k| Some((k, self.at(seen.grid.middle_mm(k))?)));
        let (bins, target): (Vec<usize>, Vec<f64>) = bins.unzip();
        ensure!(
            target.iter().any(|target| *target > 0.0),
            "illuminance_distance: expected bins of the plane where the target has light, got none"
        );
        let light = seen.illuminance.map(|map| bins.iter().map(|bin| map[*bin]).collect());
        let weights: Vec<f64> = bins.iter().map(|bin| counted(*bin)).collect();
        Ok(super::distance(&light, &target, &weights))
    }
}

/// The node before `v`, and the fraction of the way to the next; none beyond the ends.
fn between(nodes: &[f64], v: f64) -> Option<(usize, f64)> {
    let last = nodes.len() - 1;
    if !(nodes[0]..=nodes[last]).contains(&v) {
        return None;
    }
    let before = nodes.partition_point(|node| *node <= v).clamp(1, last) - 1;
    let fraction = (v - nodes[before]) / (nodes[before + 1] - nodes[before]);
    Some((before, fraction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_bilinear_between_nodes_and_end_with_the_grid() {
        // 1 + 2 x + 3 y + 4 x y at the nodes, in any order.
        let text = "x y E\n2, 1, 16\n0, 0, 1\n0, 1, 4 # corner\n2, 0, 5\n";
        let target = MapTarget::parse(text).expect("a grid");
        for (at, expected) in [
            ([0.0, 0.0], Some(1.0)),
            ([1.0, 0.5], Some(6.5)),
            ([2.0, 1.0], Some(16.0)),
            ([2.0, 0.25], Some(7.75)),
            ([2.1, 0.5], None),
            ([1.0, -0.1], None),
        ] {
            assert_eq!(target.at(at), expected, "{at:?}");
        }
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        for (text, word) in [
            ("0 0 1\n1 0 1\n0 1 1\n", "3 nodes"),
            ("0 0 1\n1 0 1\n", "1 of y"),
            ("0 0 1\n1 0 1\n0 1 1\n1 1 1\n1 1 2\n", "5 nodes"),
            ("0 0 0\n1 0 0\n0 1 0\n1 1 0\n", "some light"),
            ("0 0 1\n1 0 -1\n", "line 2"),
            ("0 0 1\n1 0\n", "line 2"),
            ("", "0 nodes"),
        ] {
            let error = MapTarget::parse(text).expect_err(text).to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
