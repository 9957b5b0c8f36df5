// SPDX-License-Identifier: MIT OR Apache-2.0
//! Any list of directions, solved by Bloch wavevectors.
//!
//! Directions whose kx differ by a whole number of order spacings λ/Λ are orders of one Bloch
//! wavevector, and all ky of one kx share the modes of every layer. So directions are sorted into
//! lines of kx in the first Brillouin zone, and each line is solved once for its different ky.
//! Efficiencies do not depend on the sign of ky. Without loss, reciprocity, S(-k) = Sᵀ(k), gives
//! those at -kx too, so that lines at kx ≥ 0 are enough (`rcwa::hemisphere`).

use anyhow::ensure;
use num_complex::Complex64;
use rayon::prelude::*;
use rcwa::relief::extrapolate;
use rcwa::solve::highest_order;
use rcwa::{
    Bloch, Pol, Progress, Scattering, Side, Stack, SymmetricBloch, Truncation, solve, solve_line,
    solve_symmetric_line,
};

use crate::memory::free_bytes;

/// Wavevectors closer than this, in order spacings or in k0, are one: rounding of angles.
const SAME: f64 = 1e-12;

/// Tangential wavevectors up to this, in k0, are normal incidence: s and p of its own azimuth then,
/// since lines round components of about [`SAME`].
const NORMAL: f64 = 1e-9;

/// Bytes that are taken without looking at how many are free.
const LITTLE: f64 = 256e6;

/// One wave that falls on the structure.
#[derive(Debug, Clone, Copy)]
pub struct Incident {
    /// Across the grooves, in k0.
    pub kx: f64,
    /// Along the grooves, in k0.
    pub ky: f64,
    /// Azimuth that stands for the plane of incidence at normal incidence, radians.
    pub azimuth: f64,
}

/// The orders of one direction.
#[derive(Debug, Clone, Default)]
pub struct Orders {
    /// Half-space, order relative to the incident one, efficiency [in][out] over s and p.
    pub efficiencies: Vec<(usize, i32, [[f64; 2]; 2])>,
    /// Half-space, order, matrix [out][in] of electric amplitudes.
    pub jones: Vec<(usize, i32, [[Complex64; 2]; 2])>,
}

/// The structure, where light comes from, and what is asked.
#[derive(Clone, Copy)]
pub struct Request<'a> {
    /// One stack, or two that are extrapolated.
    pub stacks: &'a (Stack, Option<Stack>),
    /// Orders kept.
    pub truncation: Truncation,
    /// Where light comes from.
    pub side: Side,
    /// Whether Jones matrices are wanted; of one stack alone.
    pub jones: bool,
}

/// A direction as an order of a line.
struct Member {
    direction: usize,
    /// Its order at the line's wavevector, or at the mirrored one.
    order: i32,
    mirrored: bool,
    /// Whether its ky is below 0.
    negative: bool,
}

/// All directions of one kx0.
struct Line {
    /// In order spacings.
    kx: f64,
    ky: Vec<(f64, Vec<Member>)>,
}

/// Solution with the largest |R + T - 1| of the problems and their number.
pub struct Solved {
    /// In the order of the directions.
    pub orders: Vec<Orders>,
    /// Largest |R + T - 1|; of R + T - 1 with loss.
    pub balance: f64,
    /// Bloch wavevectors solved, of both stacks.
    pub problems: usize,
}

fn side_number(side: Side) -> usize {
    usize::from(side == Side::Bottom)
}

/// Sorts directions into lines; with `fold` those at -kx are given by the lines at kx.
fn lines(directions: &[Incident], spacing: f64, fold: bool) -> Vec<Line> {
    let mut placed: Vec<(f64, f64, Member)> = directions
        .iter()
        .enumerate()
        .map(|(direction, incident)| {
            let kx = incident.kx / spacing;
            let order = kx.round();
            let rest = kx - order;
            // Both ends of the zone are one wavevector.
            let (order, rest) = if rest < -0.5 + SAME { (order - 1.0, 0.5) } else { (order, rest) };
            let mirrored = fold && rest < -SAME;
            let (order, rest) = if mirrored { (-order, -rest) } else { (order, rest) };
            let member =
                Member { direction, order: order as i32, mirrored, negative: incident.ky < 0.0 };
            (rest, incident.ky.abs(), member)
        })
        .collect();
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lines: Vec<Line> = Vec::new();
    let mut at_ky: Vec<(f64, Member)> = Vec::new();
    let mut first = f64::NAN;
    for (kx, ky, member) in placed {
        if (kx - first).abs() > SAME || first.is_nan() {
            if !at_ky.is_empty() {
                lines.push(Line::new(first, std::mem::take(&mut at_ky)));
            }
            first = kx;
        }
        at_ky.push((ky, member));
    }
    if !at_ky.is_empty() {
        lines.push(Line::new(first, at_ky));
    }
    lines
}

impl Line {
    fn new(kx: f64, mut members: Vec<(f64, Member)>) -> Self {
        members.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ky: Vec<(f64, Vec<Member>)> = Vec::new();
        for (value, member) in members {
            match ky.last_mut() {
                Some((last, members)) if value - *last <= SAME => members.push(member),
                _ => ky.push((value, vec![member])),
            }
        }
        Self { kx, ky }
    }

    fn solve(
        &self,
        stack: &Stack,
        ky: &[f64],
        truncation: Truncation,
        progress: &Progress<'_>,
    ) -> Result<Vec<Scattering>, rcwa::Error> {
        if self.kx.abs() <= SAME {
            solve_symmetric_line(stack, SymmetricBloch::Centre, ky, truncation, progress)
        } else if (self.kx - 0.5).abs() <= SAME {
            solve_symmetric_line(stack, SymmetricBloch::Edge, ky, truncation, progress)
        } else {
            let spacing = stack.wavelength() / stack.period();
            solve_line(stack, self.kx * spacing, ky, truncation, progress)
        }
    }
}

/// Bytes of the matrices of one ky: four of (2N)² complex numbers, and as many beside them.
fn bytes_per_ky(truncation: Truncation) -> f64 {
    8.0 * (2.0 * truncation.count() as f64).powi(2) * 16.0
}

/// Solves all directions; the number of layers to pass goes to `expect`, those passed go to
/// `progress`.
///
/// # Errors
/// Fewer orders than propagate, more than fit into memory, a direction that does not propagate, and
/// those of the solver.
pub fn solve_all(
    request: Request<'_>,
    directions: &[Incident],
    expect: &dyn Fn(usize),
    progress: &Progress<'_>,
) -> anyhow::Result<Solved> {
    let Request { stacks, truncation, side, jones, .. } = request;
    let stack = &stacks.0;
    let spacing = stack.wavelength() / stack.period();
    let index = stack.index(side);
    ensure!(
        index.im == 0.0 && index.re > 0.0,
        "side: expected a half-space of real index, since light comes from it, got [{}, {}]",
        index.re,
        index.im
    );
    let lossless = [stack.index(Side::Top), stack.index(Side::Bottom)].iter().all(|n| n.im == 0.0);
    let lines = lines(directions, spacing, lossless && !jones);
    for line in &lines {
        for (ky, members) in &line.ky {
            let needed = highest_order(stack, Bloch::new(line.kx * spacing, *ky));
            let own = members.iter().map(|m| m.order.unsigned_abs() as usize).max();
            let needed = needed.max(own.unwrap_or(0));
            if needed > truncation.highest() {
                return Err(rcwa::Error::TooFewOrders {
                    got: truncation.highest(),
                    propagating: needed,
                }
                .into());
            }
        }
    }
    let workers = rayon::current_num_threads().min(lines.len()).max(1);
    let per_ky = bytes_per_ky(truncation) * (1 + usize::from(stacks.1.is_some())) as f64;
    let all_ky: usize = lines.iter().map(|line| line.ky.len()).sum();
    let at_once = if per_ky * all_ky as f64 > LITTLE {
        let free = free_bytes();
        ensure!(
            per_ky <= free,
            "orders: expected at most {:.0} in {:.1} GiB of free memory, got {}",
            (free / per_ky).sqrt() * truncation.highest() as f64,
            free / f64::from(1 << 30),
            truncation.highest()
        );
        (free / per_ky / workers as f64).max(1.0) as usize
    } else {
        all_ky
    };
    let layers = stacks.0.layers().len() + stacks.1.as_ref().map_or(0, |s| s.layers().len());
    expect(layers * all_ky);
    let solved: Vec<LineSolution> = lines
        .into_par_iter()
        .map(|line| of_line(request, directions, line, at_once, progress))
        .collect::<Result<_, _>>()?;
    let mut all =
        Solved { orders: vec![Orders::default(); directions.len()], balance: 0.0, problems: 0 };
    for line in solved {
        all.balance = all.balance.max(line.balance);
        all.problems += line.problems;
        for (direction, orders) in line.orders {
            all.orders[direction] = orders;
        }
    }
    Ok(all)
}

struct LineSolution {
    orders: Vec<(usize, Orders)>,
    balance: f64,
    problems: usize,
}

fn of_line(
    request: Request<'_>,
    directions: &[Incident],
    line: Line,
    at_once: usize,
    progress: &Progress<'_>,
) -> Result<LineSolution, rcwa::Error> {
    let Request { stacks, truncation, side, jones, .. } = request;
    let mut result = LineSolution { orders: Vec::new(), balance: 0.0, problems: 0 };
    for part in line.ky.chunks(at_once) {
        let ky: Vec<f64> = part.iter().map(|(ky, _)| *ky).collect();
        let coarse = line.solve(&stacks.0, &ky, truncation, progress)?;
        let fine = stacks.1.as_ref();
        let fine = fine.map(|stack| line.solve(stack, &ky, truncation, progress)).transpose()?;
        for run in coarse.iter().chain(fine.iter().flatten()) {
            let balance = run.worst_balance().map_or(0.0, |worst| worst.3.abs());
            result.balance = result.balance.max(balance);
            result.problems += 1;
        }
        for (number, (_, members)) in part.iter().enumerate() {
            let pair = (&coarse[number], fine.as_ref().map(|fine| &fine[number]));
            for member in members {
                let incident = directions[member.direction];
                let normal = incident.kx.hypot(incident.ky) <= NORMAL;
                let orders = if normal && incident.azimuth != 0.0 {
                    // s and p turn with the plane of incidence.
                    let at = |stack: &Stack| {
                        let mut bloch = Bloch::new(0.0, 0.0);
                        bloch.azimuth_at_normal = incident.azimuth;
                        solve(stack, bloch, truncation)
                    };
                    let coarse = at(&stacks.0)?;
                    let fine = stacks.1.as_ref().map(at).transpose()?;
                    read(&coarse, fine.as_ref(), side, member, jones)
                } else {
                    read(pair.0, pair.1, side, member, jones)
                };
                let orders = orders.ok_or(rcwa::Error::Evanescent { order: 0, side })?;
                result.orders.push((member.direction, orders));
            }
        }
    }
    Ok(result)
}

/// The orders of one direction; `None` if it is not among those that light can come by.
fn read(
    coarse: &Scattering,
    fine: Option<&Scattering>,
    side: Side,
    member: &Member,
    jones: bool,
) -> Option<Orders> {
    let m = member.order;
    coarse.source(side, m)?;
    let share = |from: (Side, i32, Pol), to: (Side, i32), pol: Pol| {
        let one = coarse.efficiency_in(from, to, pol);
        fine.map_or(one, |fine| extrapolate(one, fine.efficiency_in(from, to, pol), 3.0))
    };
    let mut orders = Orders::default();
    for other in Side::BOTH {
        for n in coarse.orders(other) {
            let number = side_number(other);
            if member.mirrored {
                if coarse.source(other, n).is_none() {
                    continue;
                }
                let from = |p, q| share((other, n, q), (side, m), p);
                let all = Pol::BOTH.map(|p| Pol::BOTH.map(|q| from(p, q)));
                orders.efficiencies.push((number, m - n, all));
            } else {
                let to = |p, q| share((side, m, p), (other, n), q);
                let all = Pol::BOTH.map(|p| Pol::BOTH.map(|q| to(p, q)));
                orders.efficiencies.push((number, n - m, all));
            }
        }
    }
    clip_negative(&mut orders.efficiencies);
    if jones {
        let sign = if member.negative { -1.0 } else { 1.0 };
        for found in coarse.jones_of_all((side, m)).ok()? {
            let mut matrix = found.matrix;
            // The mirror y -> -y turns s into -s.
            matrix[0][1] *= sign;
            matrix[1][0] *= sign;
            orders.jones.push((side_number(found.side), found.order - m, matrix));
        }
    }
    Some(orders)
}

/// Sets negative efficiencies of an extrapolation to 0 and scales the others to keep the sum of
/// each incident polarisation.
fn clip_negative(orders: &mut [(usize, i32, [[f64; 2]; 2])]) {
    for p in 0..2 {
        let sum = |orders: &[(usize, i32, [[f64; 2]; 2])]| -> f64 {
            orders.iter().flat_map(|o| o.2[p]).sum()
        };
        if orders.iter().all(|o| o.2[p].iter().all(|e| *e >= 0.0)) {
            continue;
        }
        let before = sum(orders);
        for efficiency in orders.iter_mut().flat_map(|o| &mut o.2[p]) {
            *efficiency = efficiency.max(0.0);
        }
        let after = sum(orders);
        if after > 0.0 {
            for efficiency in orders.iter_mut().flat_map(|o| &mut o.2[p]) {
                *efficiency *= before / after;
            }
        }
    }
}
