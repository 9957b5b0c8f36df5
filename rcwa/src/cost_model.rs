// SPDX-License-Identifier: MIT OR Apache-2.0
//! The cost of a hemisphere in complex multiply-adds, and its memory, whatever machine runs it.
//!
//! In: an interface, directions and a resolution. Out: the multiply-adds of the steps of `stack`,
//! slice by slice and problem by problem, and those of the modes and interfaces that all ky of a
//! line share. The formula and what it leaves out stand in `docs/performance.md`; of factors and
//! products their n³ terms are counted.

use crate::expansion::real::FunctionSet;
use crate::guard::MATRICES;
use crate::hemisphere::{Directions, Interface, Resolution};
use crate::real_basis::RealBasis;
use crate::relief::NODES_OF_A_SLICE;
use crate::stack::arithmetic::THIN;
use crate::wave::Side;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Complex multiply-adds per N³ for the modes of a slice and the interface above it: two real
/// symmetric eigenproblems of 3 N³ real multiply-adds each (a quarter of that in complex ones),
/// nine real products of the same kind, seven complex ones.
const MODES_AND_INTERFACE: f64 = 2.0 * 3.0 / 4.0 + 9.0 / 4.0 + 7.0;

/// [`MODES_AND_INTERFACE`] on a self-mirror line: four real problems of half the size, products
/// within the halves (factors, inverses, A g, E⁻¹ f and two between modes: seven N³ over four),
/// seven for the interface, all real.
const STANDING_MODES_AND_INTERFACE: f64 = (4.0 * 3.0 / 8.0 + 7.0 / 4.0 + 7.0) / 4.0;

/// The same of both parities apart: the interface is within the halves too.
const PARITIES_MODES_AND_INTERFACE: f64 = (4.0 * 3.0 / 8.0 + (7.0 + 7.0) / 4.0) / 4.0;

/// The same of orders in real numbers: two problems and all products of full size.
const REAL_MODES_AND_INTERFACE: f64 = (2.0 * 3.0 + 7.0 + 7.0) / 4.0;

/// Multiply-adds per N for each row of the fields and each border with slanted walls, at one node
/// of a slice: a rank of seven by six products, and four points by four.
const CORRECTION: f64 = 7.0 * 6.0 + 4.0 * 4.0;

/// Complex multiply-adds per N³ with which the correction of a node is found: two inverses of 4/3
/// and four products. What the node makes of a sketch goes as N².
const FINDING: f64 = 2.0 * 4.0 / 3.0 + 4.0;

/// The same of both parities apart: three inverses and six products in each.
const FINDING_OF_PARITIES: f64 = (3.0 * 4.0 / 3.0 + 6.0) / 4.0 / 4.0;

/// Largest cache of a line, bytes.
const LARGEST_CACHE: f64 = 384.0 * 1024.0 * 1024.0;

/// Complex multiply-adds, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Operations {
    /// Of the steps that every (kx0, ky) takes by itself.
    pub problems: f64,
    /// Of modes and interfaces, which all ky of a line share.
    pub lines: f64,
}

impl Operations {
    /// All of them.
    pub fn total(&self) -> f64 {
        self.problems + self.lines
    }
}

/// Counts the operations of [`hemisphere`](crate::hemisphere::hemisphere()) for these directions at
/// this resolution: the table itself, without any search for the resolution.
///
/// ```
/// use num_complex::Complex64;
/// use rcwa::Truncation;
/// use rcwa::hemisphere::{Directions, Interface, Resolution};
/// use rcwa::cost_model::operations;
/// use rcwa::relief::{Polygon, Relief};
///
/// let (silicone, air) = (Complex64::from(1.41), Complex64::from(1.0));
/// let tooth = Polygon { index: silicone, points: vec![[0.0, 0.0], [5.0, 0.0], [4.0, 2.0]] };
/// let relief = Relief::new(5.0, 2.0, air, vec![tooth])?;
/// let plan = relief.slice_plan(16);
/// let interface = Interface { relief, wavelength: 0.55, n_top: silicone, n_bottom: air };
/// let directions = |count: u32| {
///     let ky = (0..count).map(|i| 0.1 * f64::from(i)).collect();
///     Directions { kx_per_zone: 2, ky }
/// };
/// let resolution = Resolution { truncation: Truncation::new(20)?, plan };
/// let counted = |ky| operations(&interface, &directions(ky), &resolution);
/// let (one, two) = (counted(1), counted(2));
/// // More ky cost no more modes.
/// assert!(two.problems > 1.9 * one.problems && two.lines == one.lines);
/// # Ok::<(), rcwa::Error>(())
/// ```
pub fn operations(
    interface: &Interface,
    directions: &Directions,
    resolution: &Resolution,
) -> Operations {
    let kept = resolution.truncation.count() as f64;
    // Of all runs that are extrapolated together.
    let slices = interface.mode_layers(resolution) as f64;
    let mut operations = Operations::default();
    let steepest = resolution.truncation.highest() as f64 * interface.order_spacing();
    let thinner = interface.n_top.norm_sqr().min(interface.n_bottom.norm_sqr());
    let runs = if interface.follows_walls() || resolution.plan.is_exact() { 1.0 } else { 2.0 };
    let thickness = TAU / interface.wavelength * interface.relief.depth() * runs / slices;
    // Layers from one choice of parameters to the next.
    let between_choices = |kx: f64, ky: f64| {
        let growth = (kx * kx + ky * ky - thinner).max(0.0).sqrt() * thickness;
        (THIN / growth).floor().clamp(1.0, slices)
    };
    let (nodes, borders) =
        if interface.follows_walls() { slanted_nodes(interface, resolution) } else { (0.0, 0.0) };
    let corrections = CORRECTION * borders;
    let stack = interface.stacks(resolution).ok().map(|(stack, _)| stack);
    for line in directions.lines() {
        let kx0 = directions.node(line) * interface.order_spacing();
        let kind = stack.as_ref().and_then(|stack| {
            let real = match directions.mirrored(line) {
                Some(at) => RealBasis::of_symmetric_line(stack, at, resolution.truncation),
                None => RealBasis::of_any_line(stack, kx0, resolution.truncation),
            };
            real.map(|line| line.parts()[0].kind)
        });
        let (one, modes, finding) = match kind {
            Some(FunctionSet::Parity) => {
                (0.25 * 0.25, PARITIES_MODES_AND_INTERFACE, FINDING_OF_PARITIES)
            }
            Some(FunctionSet::Standing) => (0.25, STANDING_MODES_AND_INTERFACE, 0.25 * FINDING),
            Some(FunctionSet::FourierOrders) => (0.25, REAL_MODES_AND_INTERFACE, 0.25 * FINDING),
            None => (1.0, MODES_AND_INTERFACE, FINDING),
        };
        for &ky in &directions.ky {
            let q = propagating(interface, resolution, Side::Bottom, [kx0, ky]) as f64 / kept;
            let each = per_slice(kept, q, between_choices(steepest, ky));
            let corrected = corrections * kept * 2.0 * kept * (1.0 + q);
            operations.problems += one * (slices * each + corrected);
        }
        operations.lines += (slices * modes + finding * nodes) * kept.powi(3);
    }
    operations
}

/// Bytes that [`hemisphere`](crate::hemisphere::hemisphere()) takes at once, about: the matrices of
/// all problems, which go through the slices side by side, both runs that are extrapolated, as
/// complex numbers.
///
/// ```
/// use rcwa::Truncation;
/// use rcwa::hemisphere::{Directions, Resolution};
/// use rcwa::cost_model::memory;
/// use rcwa::relief::shapes::{self, Materials};
///
/// let relief = shapes::step(10.0, 4.0, Materials::lossless(1.41, 1.0))?;
/// let resolution = Resolution { truncation: Truncation::new(50)?, plan: relief.slice_plan(24) };
/// let directions = Directions { kx_per_zone: 2, ky: vec![0.1, 0.2, 0.3] };
/// // Six problems, twice, of at least four matrices of (2 · 101)² complex numbers.
/// assert!(memory(&directions, &resolution) > 6.0 * 2.0 * 4.0 * 202.0 * 202.0 * 16.0);
/// # Ok::<(), rcwa::Error>(())
/// ```
pub fn memory(directions: &Directions, resolution: &Resolution) -> f64 {
    let runs = if resolution.plan.is_exact() { 1.0 } else { 2.0 };
    let problems = directions.lines().count() as f64 * directions.ky.len() as f64;
    let elements = (2.0 * resolution.truncation.count() as f64).powi(2);
    runs * problems * MATRICES * elements * size_of::<Complex64>() as f64
}

/// Bytes for [`solve_adaptive`](crate::incidence_grid::solve_adaptive()), its caches included.
/// Cost where slices follow the walls and every line is its own mirror image, one run in real numbers
/// takes a quarter of [`memory`].
pub fn memory_with_cache(
    interface: &Interface,
    directions: &Directions,
    resolution: &Resolution,
) -> f64 {
    let whole = memory(directions, resolution);
    let is_real = directions.lines().all(|line| directions.mirrored(line).is_some());
    if interface.follows_walls() && is_real && !resolution.plan.is_exact() {
        let lines = directions.lines().count() as f64;
        0.25 * whole + lines * cache_per_line(directions, resolution)
    } else {
        whole
    }
}

/// Bytes for the cache of a line: the part of [`memory`] that a run in real numbers does not need,
/// within bounds.
pub(crate) fn cache_per_line(directions: &Directions, resolution: &Resolution) -> f64 {
    if resolution.plan.is_exact() {
        return 0.0;
    }
    let left = 0.75 * memory(directions, resolution);
    (left / directions.lines().count() as f64).min(LARGEST_CACHE)
}

/// Nodes at which corrections are made, of all slices, and borders between materials at all of
/// them.
fn slanted_nodes(interface: &Interface, resolution: &Resolution) -> (f64, f64) {
    let slanted = resolution.plan.intervals().iter().filter(|i| i.slanted);
    slanted.fold((0.0, 0.0), |(nodes, borders), interval| {
        let segments = interface.relief.layer_at(0.5 * (interval.z0 + interval.z1));
        let ends = segments.first().zip(segments.last());
        let outer = ends.is_some_and(|(a, b)| a.index != b.index);
        let here = (NODES_OF_A_SLICE * interval.count) as f64;
        let each = segments.len() - 1 + usize::from(outer);
        (nodes + here, borders + here * each as f64)
    })
}

/// One slice of one problem: `kept` orders, the part `q` of which leaves into the bottom
/// half-space, parameters chosen anew after every `apart` slices.
fn per_slice(kept: f64, q: f64, apart: f64) -> f64 {
    // Of electric or magnetic coordinates; the latter are given where parameters were chosen last.
    let crossing = 0.75 * (1.0 + q);
    let choice = 1.0 / 3.0 + 1.0 + 2.0 * q + q * q;
    (2.0 * kept).powi(3) * (2.0 * crossing + (choice - crossing) / apart)
}

/// Orders among those kept that carry power away on a side.
fn propagating(
    interface: &Interface,
    resolution: &Resolution,
    side: Side,
    [kx0, ky]: [f64; 2],
) -> usize {
    let n: Complex64 = match side {
        Side::Top => interface.n_top,
        Side::Bottom => interface.n_bottom,
    };
    let spacing = interface.order_spacing();
    let carries = |&m: &i32| {
        let kx = kx0 + f64::from(m) * spacing;
        n.im != 0.0 || kx * kx + ky * ky < n.re * n.re
    };
    resolution.truncation.orders().filter(carries).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orders::Truncation;
    use crate::relief::{Polygon, Relief};

    fn interface(points: Vec<[f64; 2]>) -> Interface {
        let (silicone, air) = (Complex64::from(1.41), Complex64::from(1.0));
        let ridge = Polygon { index: silicone, points };
        Interface {
            relief: Relief::new(1.0, 0.4, air, vec![ridge]).unwrap(),
            wavelength: 0.55,
            n_top: silicone,
            n_bottom: air,
        }
    }

    #[test]
    fn one_slice_of_one_problem_is_the_formula() {
        // A rectangular ridge is one exact slice. At kx0 = 0.275 and ky = 0 the orders -2..1
        // propagate in air.
        let symmetric = interface(vec![[0.2, 0.0], [0.6, 0.0], [0.6, 0.4], [0.2, 0.4]]);
        // A ridge beside another one of unlike index is no mirror image.
        let beside = Polygon {
            index: Complex64::from(1.3),
            points: vec![[0.6, 0.0], [0.7, 0.0], [0.7, 0.4], [0.6, 0.4]],
        };
        let ridges = [symmetric.relief.polygons(), &[beside]].concat();
        let relief = Relief::new(1.0, 0.4, Complex64::from(1.0), ridges).unwrap();
        let interface = Interface { relief, ..symmetric.clone() };
        let resolution = Resolution {
            truncation: Truncation::new(3).unwrap(),
            plan: interface.relief.slice_plan(8),
        };
        let directions = Directions { kx_per_zone: 1, ky: vec![0.0] };
        let counted = operations(&interface, &directions, &resolution);
        let q: f64 = 4.0 / 7.0;
        // The line at half a zone is real: a quarter of the work.
        let expected = 14f64.powi(3) * (25.0 / 12.0 + 2.75 * q + q * q) / 4.0;
        assert!((counted.problems - expected).abs() < 1e-9 * expected);
        assert!((counted.lines - 10.25 / 4.0 * 343.0).abs() < 1e-9);
        // Parities apart: another quarter.
        let apart = operations(&symmetric, &directions, &resolution);
        assert!((apart.problems - 0.25 * expected).abs() < 1e-9 * expected);
        assert!((apart.lines - 5.0 / 4.0 * 343.0).abs() < 1e-9);
        // Three nodes to a zone have a line besides that is not its own mirror image: complex, or
        // real where the relief is one.
        let three = Directions { kx_per_zone: 3, ..directions };
        assert!(operations(&interface, &three, &resolution).problems > 4.0 * counted.problems);
        let more = operations(&symmetric, &three, &resolution).problems / apart.problems;
        assert!(more > 4.0 && more < 6.0, "{more}");
    }

    #[test]
    fn what_is_kept_is_bounded_and_counts_where_lines_are_real() {
        let interface = interface(vec![[0.0, 0.0], [0.9, 0.0], [0.5, 0.4]]);
        let with = |highest, kx_per_zone| {
            let resolution = Resolution {
                truncation: Truncation::new(highest).unwrap(),
                plan: interface.relief.slice_plan(12),
            };
            let directions = Directions { kx_per_zone, ky: vec![0.1; 40] };
            let whole = memory(&directions, &resolution);
            (whole, memory_with_cache(&interface, &directions, &resolution))
        };
        let (small, kept) = with(10, 2);
        assert!((kept - small).abs() < 1e-9 * small);
        let (large, kept) = with(200, 2);
        assert!((kept - 0.25 * large - 2.0 * LARGEST_CACHE).abs() < 1e-9 * large);
        // Three nodes to a zone have a line that is not its own mirror image.
        let (three, kept) = with(200, 3);
        assert!((kept - three).abs() < 1e-9 * three);
    }

    #[test]
    fn all_slices_count() {
        let interface = interface(vec![[0.0, 0.0], [0.9, 0.0], [0.5, 0.4]]);
        let at = |slices| {
            let resolution = Resolution {
                truncation: Truncation::new(6).unwrap(),
                plan: interface.relief.slice_plan(slices),
            };
            let directions = Directions { kx_per_zone: 2, ky: vec![0.1, 0.7] };
            operations(&interface, &directions, &resolution).problems
        };
        // Thinner ones are crossed with the same parameters more often.
        let more = at(24) / at(12);
        assert!(more > 1.5 && more < 2.0, "{more}");
        // Two problems on each of two lines.
        assert!(at(12) > 12.0 * 4.0 * 26f64.powi(3) * 25.0 / 48.0);
    }
}
