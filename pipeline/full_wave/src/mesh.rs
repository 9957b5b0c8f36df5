// SPDX-License-Identifier: MIT OR Apache-2.0
//! Panels of an outline, its corners, and the images that symmetry and mirror make.

use crate::outline::{Curve, Outline, Segment, Surroundings};
use crate::panel::{Panel, Reflection};
use std::f64::consts::FRAC_PI_4;

/// Panels of one corner on either side of it.
pub(crate) const PER_SIDE: usize = 2;

/// A place where two pieces meet, with two panels of one length on either side.
#[derive(Clone, Debug)]
pub(crate) struct Corner {
    /// Length of each of its panels.
    pub panel: f64,
    /// Angle by which the outline turns, positive to the left.
    pub turn: f64,
    /// Curvature before and after.
    pub curvature: [f64; 2],
    /// Its panels in the order of travel; `None` stands for an image of the one opposite.
    pub panels: [Option<usize>; 2 * PER_SIDE],
    /// Reflection that maps the corner to itself.
    pub reflection: Option<Reflection>,
}

/// Panels of the part of the outline that symmetry leaves over.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    pub panels: Vec<Panel>,
    /// Corner that a panel belongs to.
    pub corner_of: Vec<Option<usize>>,
    pub corners: Vec<Corner>,
    /// Reflections whose images make the whole outline, and the mirror's.
    pub images: Vec<Reflection>,
}

impl Mesh {
    /// Panels at most `longest` long, of the right half where the outline is symmetric.
    pub fn new(outline: &Outline, longest: f64) -> Self {
        let half = outline.right_half();
        let mut images = vec![Reflection::IDENTITY];
        if half.is_some() {
            images.push(Reflection { x: true, z: false });
        }
        if outline.surroundings == Surroundings::Mirror {
            images.extend(images.clone().into_iter().map(|image| Reflection { z: true, ..image }));
        }
        let folded = half.is_some();
        let chain = half.unwrap_or_else(|| outline.segments.clone());
        let closed = outline.surroundings == Surroundings::Free && !folded;
        let across = Reflection { x: true, z: false };
        let up = Reflection { x: false, z: true };
        // The reflections that continue the chain before its begin and after its end.
        let ends = match outline.surroundings {
            Surroundings::Free => [across, across],
            Surroundings::Mirror => [up, if folded { across } else { up }],
        };
        Self::of_chain(&chain, closed, ends, images, longest)
    }

    fn of_chain(
        chain: &[Segment],
        closed: bool,
        ends: [Reflection; 2],
        images: Vec<Reflection>,
        longest: f64,
    ) -> Self {
        let count = chain.len();
        // Corner i stands before piece i; an open chain has one more at its end.
        let corner_panel: Vec<f64> = (0..=count)
            .map(|i| {
                let before = if i > 0 { Some(&chain[i - 1]) } else { chain.last() };
                let before = before.filter(|_| i > 0 || closed);
                let after = if i < count { Some(&chain[i]) } else { chain.first() };
                let after = after.filter(|_| i < count || closed);
                let room = before
                    .into_iter()
                    .chain(after)
                    .map(|s| (0.25 * s.length).min(longest_of(s.curve.curvature, longest)))
                    .fold(longest, f64::min);
                // Few lengths make few kinds of corner.
                longest * 0.5_f64.powi((longest / room).log2().ceil() as i32)
            })
            .collect();
        let vertices: Vec<[f64; 2]> = chain.iter().map(|s| s.curve.origin).collect();
        let mut mesh =
            Self { panels: Vec::new(), corner_of: Vec::new(), corners: Vec::new(), images };
        let mut firsts = Vec::with_capacity(count);
        for (number, segment) in chain.iter().enumerate() {
            firsts.push(mesh.panels.len());
            let [near, far] = [corner_panel[number], corner_panel[number + 1]];
            let longest = longest_of(segment.curve.curvature, longest);
            let others: Vec<[f64; 2]> = vertices
                .iter()
                .enumerate()
                .filter(|&(i, _)| i != number && i != (number + 1) % count)
                .map(|(_, vertex)| *vertex)
                .collect();
            let breaks = breaks(segment, [near, far], longest, &others);
            for pair in breaks.windows(2) {
                mesh.panels.push(Panel::new(number, segment.curve, pair[0], pair[1]));
            }
        }
        mesh.corner_of = vec![None; mesh.panels.len()];
        for i in 0..count + usize::from(!closed) {
            let after = (i < count).then(|| firsts[i]);
            let before = match i {
                0 if closed => Some(mesh.panels.len()),
                0 => None,
                _ => Some(firsts.get(i).copied().unwrap_or(mesh.panels.len())),
            };
            let into = before.map(|end| mesh.panels[end - 1].curve_end());
            let out = after.map(|first| mesh.panels[first].curve_start());
            let reflection = match (into, out) {
                (None, _) => Some(ends[0]),
                (_, None) => Some(ends[1]),
                _ => None,
            };
            // The image of a way out is a way in, and the reverse.
            let image = |(tangent, curvature): ([f64; 2], f64)| {
                let [x, z] = reflection.unwrap_or(Reflection::IDENTITY).of(tangent);
                ([-x, -z], curvature)
            };
            let (Some(into), Some(out)) = (into.or(out.map(image)), out.or(into.map(image))) else {
                continue;
            };
            let ([ax, az], [bx, bz]) = (into.0, out.0);
            let panels = [
                before.map(|end| end - 2),
                before.map(|end| end - 1),
                after,
                after.map(|first| first + 1),
            ];
            for panel in panels.into_iter().flatten() {
                mesh.corner_of[panel] = Some(mesh.corners.len());
            }
            mesh.corners.push(Corner {
                panel: corner_panel[i],
                turn: (ax * bz - az * bx).atan2(ax * bx + az * bz),
                curvature: [into.1, out.1],
                panels,
                reflection,
            });
        }
        mesh
    }

    /// True if the kernels from panel `source`, reflected, to panel `target` are those of one
    /// corner, which its compressed block holds.
    pub fn is_one_corner(&self, target: usize, source: usize, image: Reflection) -> bool {
        match (self.corner_of[target], self.corner_of[source]) {
            (Some(a), Some(b)) if a == b => {
                image == Reflection::IDENTITY || Some(image) == self.corners[a].reflection
            }
            _ => false,
        }
    }
}

impl Panel {
    fn curve_end(&self) -> ([f64; 2], f64) {
        (self.curve.tangent(self.end), self.curve.curvature)
    }

    fn curve_start(&self) -> ([f64; 2], f64) {
        (self.curve.tangent(self.start), self.curve.curvature)
    }
}

/// Longest panel of a curve: at most an eighth of a turn.
fn longest_of(curvature: f64, longest: f64) -> f64 {
    longest.min(FRAC_PI_4 / curvature.abs())
}

/// Returns where the panels of a piece begin and end: two at either corner, then panels as long as
/// they are far from it until they are `longest`, and equal ones between. Where a vertex of another
/// piece is nearer than a panel is long, the panel is halved.
fn breaks(segment: &Segment, corner: [f64; 2], longest: f64, others: &[[f64; 2]]) -> Vec<f64> {
    let length = segment.length;
    let ends = corner.map(|panel| {
        let mut ends = vec![0.0, panel, 2.0 * panel];
        while let Some(&end) = ends.last()
            && end < longest
            && 2.0 * end < 0.5 * length
        {
            ends.push(2.0 * end);
        }
        ends
    });
    let last = |ends: &[f64]| ends.last().copied().unwrap_or(0.0);
    let (from, to) = (last(&ends[0]), length - last(&ends[1]));
    let longest_between = longest.min(from).min(length - to);
    let count = ((to - from) / longest_between - 1e-9).ceil().max(0.0) as usize;
    let between = (1..count).map(|i| from + (to - from) * i as f64 / count as f64);
    let mut coarse: Vec<f64> = ends[0].iter().copied().chain(between).collect();
    // Without a panel between them the two ends meet.
    let skip = usize::from(count == 0);
    coarse.extend(ends[1].iter().rev().skip(skip).map(|end| length - end));
    let mut breaks = vec![0.0];
    for (i, pair) in coarse.windows(2).enumerate() {
        let at_corner = i < PER_SIDE || i + PER_SIDE + 1 >= coarse.len();
        split(&segment.curve, (pair[0], pair[1]), !at_corner, others, &mut breaks);
    }
    breaks
}

fn split(
    curve: &Curve,
    (start, end): (f64, f64),
    may_split: bool,
    others: &[[f64; 2]],
    breaks: &mut Vec<f64>,
) {
    let own = end - start;
    let [x, z] = curve.point(0.5 * (start + end));
    if may_split && others.iter().any(|v| (v[0] - x).hypot(v[1] - z) < own) {
        let mid = 0.5 * (start + end);
        split(curve, (start, mid), true, others, breaks);
        split(curve, (mid, end), true, others, breaks);
    } else {
        breaks.push(end);
    }
}
