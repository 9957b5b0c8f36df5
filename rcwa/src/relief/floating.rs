// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ridges of the material of a half-space that do not stand on it: a relief upside down.

use super::geometry::{extent, sides};
use crate::wave::Side;

/// Lengths below this part of the cell are none.
const SLACK: f64 = 1e-9;
/// Part of the period, and of its own box, that a layer covers.
const WHOLE: f64 = 0.999_999;

/// One period of a relief by its materials.
#[derive(Clone, Copy, Debug)]
pub struct Ridges<'a, M> {
    /// Length of the period.
    pub period: f64,
    /// Extent along z.
    pub depth: f64,
    /// What fills the rest.
    pub background: &'a M,
    /// Material and corners of every polygon.
    pub polygons: &'a [(M, &'a [[f64; 2]])],
    /// Materials of the top and the bottom half-space.
    pub half_spaces: [&'a M; 2],
}

impl<M: PartialEq> Ridges<'_, M> {
    /// The first polygon whose material is that of a half-space on which none of its material
    /// stands, with those half-spaces. A layer over the whole period floats by right, and so does
    /// what rests on another material.
    pub fn floating(&self) -> Option<(usize, Vec<Side>)> {
        self.polygons.iter().enumerate().find_map(|(number, (material, points))| {
            if material == self.background || self.is_layer(points) {
                return None;
            }
            let alike = Side::BOTH.into_iter().filter(|s| self.half_spaces[s.number()] == material);
            let alike: Vec<Side> = alike.collect();
            let mut like_it = self.polygons.iter().filter(|other| other.0 == *material);
            let stands = like_it.any(|(_, points)| {
                self.rests(material, points) || alike.iter().any(|&side| self.stands(points, side))
            });
            (!alike.is_empty() && !stands).then_some((number, alike))
        })
    }

    /// True where a side of the polygon lies in the plane of a half-space.
    fn stands(&self, points: &[[f64; 2]], side: Side) -> bool {
        let slack = SLACK * self.depth.max(self.period);
        let plane = if side == Side::Top { 0.0 } else { self.depth };
        let is_there = |point: [f64; 2]| (point[1] - plane).abs() <= slack;
        sides(points).any(|(a, b)| is_there(a) && is_there(b) && (a[0] - b[0]).abs() > slack)
    }

    /// True where a level side of a polygon of `material` lies on that of a polygon of another.
    fn rests(&self, material: &M, points: &[[f64; 2]]) -> bool {
        let slack = SLACK * self.depth.max(self.period);
        let is_other = |other: &M| other != material && other != self.background;
        let others = self.polygons.iter().filter(|(other, _)| is_other(other));
        others.flat_map(|(_, points)| level_sides(points, slack)).any(|(from, to)| {
            level_sides(points, slack).any(|(a, b)| {
                let low = a[0].min(b[0]).max(from[0].min(to[0]));
                let high = a[0].max(b[0]).min(from[0].max(to[0]));
                (a[1] - from[1]).abs() <= slack && high - low > slack
            })
        })
    }

    /// True for a rectangle over the whole period.
    fn is_layer(&self, points: &[[f64; 2]]) -> bool {
        let size = |axis: usize| {
            let (low, high) = extent(points.iter().map(|p| p[axis]));
            high - low
        };
        let area: f64 = sides(points).map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum();
        size(0) >= WHOLE * self.period && area.abs() >= WHOLE * size(0) * size(1)
    }
}

/// The sides of a polygon whose ends differ by no more than `slack` in height.
fn level_sides(points: &[[f64; 2]], slack: f64) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    sides(points).filter(move |(a, b)| (a[1] - b[1]).abs() <= slack)
}

/// Warning of ridges of this name that float.
pub fn floating_words(ridges: &str, half_spaces: &[Side]) -> String {
    let names: Vec<&str> = half_spaces.iter().map(|side| side.name()).collect();
    format!(
        "the ridges of {ridges} float: none stands on the {} half-space, which is of the same material",
        names.join(" or ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which half-spaces the ridges of material 2 on `above` and `below`, in 1, miss.
    fn missed(points: &[[f64; 2]], above: u8, below: u8) -> Option<Vec<Side>> {
        let ridges = Ridges {
            period: 1.0,
            depth: 0.3,
            background: &1,
            polygons: &[(2, points)],
            half_spaces: [&above, &below],
        };
        ridges.floating().map(|(number, sides)| {
            assert_eq!(number, 0);
            sides
        })
    }

    #[test]
    fn a_triangle_with_its_tip_on_its_own_half_space_floats() {
        let upside_down = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.3]];
        let upright = [[0.0, 0.3], [1.0, 0.3], [0.5, 0.0]];
        assert_eq!(missed(&upside_down, 1, 2), Some(vec![Side::Bottom]));
        assert_eq!(missed(&upright, 1, 2), None);
        assert_eq!(missed(&upside_down, 2, 1), None);
        assert_eq!(missed(&upright, 2, 1), Some(vec![Side::Top]));
        // Of a third material, or between two half-spaces of one, it stands as it may.
        assert_eq!(missed(&upside_down, 1, 3), None);
        assert_eq!(missed(&upside_down, 2, 2), None);
        let layer = [[0.0, 0.1], [1.0, 0.1], [1.0, 0.2], [0.0, 0.2]];
        assert_eq!(missed(&layer, 1, 2), None);
    }

    #[test]
    fn a_ridge_on_a_layer_of_another_material_stands() {
        let ridge = [[0.2, 0.0], [0.6, 0.0], [0.6, 0.2], [0.2, 0.2]];
        let layer = [[0.0, 0.2], [1.0, 0.2], [1.0, 0.3], [0.0, 0.3]];
        let half_spaces = [&1, &2];
        for (of_layer, expected) in [(3, None), (1, Some((0, vec![Side::Bottom])))] {
            let polygons = [(2, &ridge[..]), (of_layer, &layer[..])];
            let ridges = Ridges {
                period: 1.0,
                depth: 0.3,
                background: &1,
                polygons: &polygons,
                half_spaces,
            };
            assert_eq!(ridges.floating(), expected);
        }
    }
}
