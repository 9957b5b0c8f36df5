// SPDX-License-Identifier: MIT OR Apache-2.0
//! What quadrature misses of the double layer next to a corner.
//!
//! In: the nodes. Out: for every node, the double layer of density 1 on the two sides next to its
//! own, in the static limit, less what the quadrature makes of it. The kernel on one side of a
//! corner seen from a node on the other is a peak as wide as the node is near, and next to the
//! corner narrower than the steps. Since the field is continuous, what is missed is this number
//! times the field at the node, which goes onto the diagonal; what is still missed falls off with
//! the field's variation over the peak \[Kress1990\]. The exact value is the angle under which the
//! side is seen from end to end, over 2π.

use super::nodes::{Node, Nodes};
use std::f64::consts::TAU;

/// For every node, the double layer of the two sides next to its own: the angle under which it sees them
/// in turns, less what the quadrature computes.
pub(super) fn missed(nodes: &Nodes) -> Vec<f64> {
    let sides = nodes.origins.len();
    let step = TAU / nodes.list.len() as f64;
    let mut of_side: Vec<Vec<&Node>> = vec![Vec::new(); sides];
    for node in &nodes.list {
        if let Some(side) = node.side {
            of_side[side].push(node);
        }
    }
    nodes
        .list
        .iter()
        .map(|node| {
            let Some(side) = node.side else { return 0.0 };
            [-1, 1]
                .into_iter()
                .map(|neighbour| {
                    let far = side as i32 + neighbour;
                    let (other, image) =
                        (far.rem_euclid(sides as i32) as usize, far.div_euclid(sides as i32));
                    let seen = angle(nodes, node, other, image, &of_side[other]) / TAU;
                    let computed: f64 =
                        of_side[other].iter().map(|s| step * layer(nodes, node, s, image)).sum();
                    seen - computed
                })
                .sum()
        })
        .collect()
}

/// Static double layer of a node in the image `image`, times its length per parameter: n·(x -
/// y)/(2π |x - y|²).
fn layer(nodes: &Nodes, at: &Node, source: &Node, image: i32) -> f64 {
    let [dx, dz] = nodes.difference(at, source, image);
    // Not the square of the distance: next to a corner it would underflow.
    let r = dx.hypot(dz);
    (source.normal[0] * (dx / r) + source.normal[1] * (dz / r)) * (source.speed / r) / TAU
}

/// Signed angle under which a side of these nodes is seen from a node, from end to end; an arc may be
/// seen under more than half a turn, so that its nodes lead there.
fn angle(nodes: &Nodes, from: &Node, side: usize, image: i32, of_side: &[&Node]) -> f64 {
    let sight = |place: &Node| {
        let [dx, dz] = nodes.difference(from, place, image);
        let r = dx.hypot(dz);
        [-dx / r, -dz / r]
    };
    let corner = |number: usize| {
        let sides = nodes.origins.len();
        let lap = (number / sides) as i32;
        sight(&Node { offset: [0.0; 2], origin: number % sides, lap, ..*from })
    };
    let mut path = vec![corner(side)];
    if of_side.iter().any(|node| node.bend != 0.0) {
        path.extend(of_side.iter().map(|node| sight(node)));
    }
    path.push(corner(side + 1));
    let turn =
        |a: [f64; 2], b: [f64; 2]| (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
    path.windows(2).map(|ends| turn(ends[0], ends[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::super::nodes::Fineness;
    use super::super::outline::Outline;
    use super::*;

    #[test]
    fn quadrature_misses_nothing_but_next_to_corners() {
        let outline = Outline::corners(10.0, &[[0.0, 0.0], [6.0, 4.0]]).expect("an outline");
        let nodes = Nodes::new(&outline, 1.41, Fineness::default(), 1000).expect("nodes");
        let missed = missed(&nodes);
        let from_end = |i: usize| {
            let mates = nodes.list.iter().enumerate().filter(|n| n.1.side == nodes.list[i].side);
            let (first, last) = mates.fold((usize::MAX, 0), |(f, l), (j, _)| (f.min(j), l.max(j)));
            (i - first).min(last - i)
        };
        for (i, value) in missed.iter().enumerate() {
            match from_end(i) {
                0 => assert!(value.abs() > 1e-3, "node {i}: {value:e}"),
                1..40 => assert!(value.abs() < 0.5, "node {i}: {value:e}"),
                _ => assert!(value.abs() < 1e-9, "node {i}: {value:e}"),
            }
        }
    }
}
