// SPDX-License-Identifier: MIT OR Apache-2.0
//! Any list of directions, solved by Bloch wavevectors.
//!
//! Directions whose kx differ by a whole number of order spacings λ/Λ are orders of one Bloch
//! wavevector, and all ky of one kx share the modes of every layer. So directions are sorted into
//! lines of kx in the first Brillouin zone, and each line is solved once for its different ky.
//! Efficiencies do not depend on the sign of ky. Without loss, reciprocity, S(-k) = Sᵀ(k), gives
//! those at -kx too, so that lines at kx ≥ 0 are enough ([`hemisphere`](mod@crate::hemisphere)).

use crate::accuracy::{Found, Structure, Waves, converge_waves, error_at};
use crate::error::Error;
use crate::guard;
use crate::hemisphere::{Interface, Resolution, clip_negative, efficiency_of_runs};
use crate::jones::Matrix;
use crate::orders::{Bloch, SymmetricBloch, Truncation};
use crate::progress::Progress;
use crate::scattering::Scattering;
use crate::solve::{highest_order, solve, solve_line, solve_symmetric_line};
use crate::stack::Stack;
use crate::wave::{Pol, Side};
use rayon::prelude::*;

/// Wavevectors closer than this, in order spacings or in k0, are one: rounding of angles.
const SAME: f64 = 1e-12;

/// Tangential wavevectors up to this, in k0, are normal incidence: s and p of its own azimuth then,
/// since lines round components of about [`SAME`].
const NORMAL: f64 = 1e-9;

/// Direction of a wave that falls on the structure.
#[derive(Debug, Clone, Copy)]
pub struct Direction {
    /// Across the grooves, in k0.
    pub kx: f64,
    /// Along the grooves, in k0.
    pub ky: f64,
    /// Azimuth that stands for the plane of incidence at normal incidence, radians.
    pub azimuth: f64,
}

/// Half-space, order relative to the incident one, efficiency `[in][out]` over s and p.
pub type Efficiency = (Side, i32, [[f64; 2]; 2]);

/// Orders of one direction.
#[derive(Debug, Clone, Default)]
pub struct DirectionOrders {
    /// Efficiencies of all orders that propagate.
    pub efficiencies: Vec<Efficiency>,
    /// Half-space, relative order, Jones matrix of electric amplitudes, where it is asked for.
    pub jones: Vec<(Side, i32, Matrix)>,
}

/// Request for the orders of directions.
#[derive(Clone, Copy)]
pub struct LinesRequest<'a> {
    /// One stack, or two that are extrapolated.
    pub stacks: &'a (Stack, Option<Stack>),
    /// Orders kept.
    pub truncation: Truncation,
    /// Half-space that light comes from; without loss.
    pub side: Side,
    /// True where Jones matrices are wanted; of one stack alone.
    pub jones: bool,
}

/// A direction as an order of a line.
struct Member {
    direction: usize,
    /// Order at the line's wavevector, or at the mirrored one.
    order: i32,
    mirrored: bool,
    /// True for ky below 0.
    negative: bool,
}

/// All directions of one kx0.
struct Line {
    /// In order spacings.
    kx: f64,
    ky: Vec<(f64, Vec<Member>)>,
}

/// Solution of a list of directions.
#[derive(Debug, Clone)]
pub struct SolvedDirections {
    /// Orders, in the sequence of the directions.
    pub orders: Vec<DirectionOrders>,
    /// Largest |R + T - 1|; of R + T - 1 with loss.
    pub balance: f64,
    /// Bloch wavevectors solved, of both stacks.
    pub problems: usize,
}

/// Sorts directions into lines; with `fold` those at -kx are given by the lines at kx.
fn lines(directions: &[Direction], spacing: f64, fold: bool) -> Vec<Line> {
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
    ) -> Result<Vec<Scattering>, Error> {
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

/// Number of ky of one line that are solved at once.
fn ky_at_once(request: LinesRequest<'_>, lines: &[Line]) -> Result<usize, Error> {
    let workers = rayon::current_num_threads().min(lines.len()).max(1);
    let runs = 1 + usize::from(request.stacks.1.is_some());
    let all_ky = lines.iter().map(|line| line.ky.len()).sum();
    guard::problems_at_once(request.truncation, all_ky, workers * runs)
}

/// Highest order of the lines and of their directions.
fn highest_of(stack: &Stack, lines: &[Line]) -> usize {
    let spacing = stack.wavelength() / stack.period();
    let each = lines.iter().flat_map(|line| line.ky.iter().map(move |ky| (line.kx, ky)));
    each.map(|(kx, (ky, members))| {
        let own = members.iter().map(|m| m.order.unsigned_abs() as usize).max();
        highest_order(stack, Bloch::new(kx * spacing, *ky)).max(own.unwrap_or(0))
    })
    .max()
    .unwrap_or(0)
}

/// Lines of a stack for these directions.
fn lines_of(stack: &Stack, directions: &[Direction], jones: bool) -> Vec<Line> {
    let is_clear = Side::BOTH.iter().all(|&side| stack.index(side).im == 0.0);
    lines(directions, stack.wavelength() / stack.period(), is_clear && !jones)
}

/// Directions that are to be known to a tolerance.
#[derive(Clone)]
pub struct ToleranceRequest<'a> {
    /// Structure.
    pub interface: &'a Interface,
    /// Half-space that light comes from; without loss.
    pub side: Side,
    /// Directions of the light.
    pub directions: &'a [Direction],
    /// Largest error of an efficiency of any order, in s and in p.
    pub tolerance: f64,
    /// Result of an earlier [`first_resolution`](crate::accuracy::first_resolution), if there is
    /// one.
    pub first: Option<Resolution>,
}

/// Solves directions to a tolerance, or as well as the work allowed lets it.
///
/// # Errors
/// The errors of [`converge_waves`] and [`solve_directions`].
pub fn converge_directions(
    request: &ToleranceRequest<'_>,
    progress: &Progress<'_>,
) -> Result<Found<SolvedDirections>, Error> {
    let &ToleranceRequest { interface, side, directions, tolerance, .. } = request;
    let first = request.first.clone();
    let expect = |_| ();
    with_waves(interface, (side, directions), first, (&expect, progress), |structure, waves| {
        converge_waves(structure, waves, tolerance, progress)
    })
}

/// Error of directions that are solved at a resolution, as [`error_at`]; `expect` is told the layers of
/// each finer solution as it begins.
///
/// # Errors
/// The errors of [`solve_directions`].
pub fn error_of_directions(
    interface: &Interface,
    incident: (Side, &[Direction]),
    at: &Resolution,
    solved: &SolvedDirections,
    expect: &dyn Fn(usize),
    progress: &Progress<'_>,
) -> Result<f64, Error> {
    with_waves(interface, incident, None, (expect, progress), |structure, waves| {
        error_at(structure, waves, at, solved)
    })
}

/// Gives `judge` the waves of these directions, with a resolution to begin with.
fn with_waves<R>(
    interface: &Interface,
    (side, directions): (Side, &[Direction]),
    first: Option<Resolution>,
    (expect, progress): (&dyn Fn(usize), &Progress<'_>),
    judge: impl FnOnce(Structure<'_>, &Waves<'_, SolvedDirections>) -> Result<R, Error>,
) -> Result<R, Error> {
    let flat = interface.stack(&interface.relief.slice_plan(1))?;
    let solve = |at: &Resolution| {
        let stacks = &interface.stacks(at)?;
        let truncation = at.truncation;
        let request = LinesRequest { stacks, truncation, side, jones: false };
        solve_directions(request, directions, expect, progress)
    };
    let waves = Waves {
        solve: &solve,
        distance: &largest_difference,
        highest_order: highest_of(&flat, &lines_of(&flat, directions, false)),
        first,
    };
    judge(Structure::Relief(interface), &waves)
}

/// Largest difference of an efficiency of any order, of its parts in s and p or of their sum.
fn largest_difference(a: &SolvedDirections, b: &SolvedDirections) -> f64 {
    let changes = a.orders.iter().zip(&b.orders);
    changes.map(|(a, b)| efficiency_change(&a.efficiencies, &b.efficiencies)).fold(0.0, f64::max)
}

/// Largest difference of an efficiency between two lists, of its parts in s and p or of their sum;
/// orders that only one of them has count in full.
fn efficiency_change(a: &[Efficiency], b: &[Efficiency]) -> f64 {
    let find = |list: &[Efficiency], like: &Efficiency| {
        let same = |o: &&Efficiency| (o.0, o.1) == (like.0, like.1);
        list.iter().find(same).map_or([[0.0; 2]; 2], |o| o.2)
    };
    let differences = a.iter().chain(b).flat_map(|o| {
        let (a, b) = (find(a, o), find(b, o));
        [0, 1].map(|p| {
            let [s, p] = [a[p][0] - b[p][0], a[p][1] - b[p][1]];
            s.abs().max(p.abs()).max((s + p).abs())
        })
    });
    differences.fold(0.0, f64::max)
}

/// Solves all directions; the number of layers to pass goes to `expect`, those passed go to
/// `progress`.
///
/// # Errors
/// Fewer orders than propagate, more than fit into memory, a direction that does not propagate, and
/// those of the solver.
pub fn solve_directions(
    request: LinesRequest<'_>,
    directions: &[Direction],
    expect: &dyn Fn(usize),
    progress: &Progress<'_>,
) -> Result<SolvedDirections, Error> {
    let LinesRequest { stacks, truncation, jones, .. } = request;
    let stack = &stacks.0;
    let lines = lines_of(stack, directions, jones);
    let propagating = highest_of(stack, &lines);
    if propagating > truncation.highest() {
        return Err(Error::TooFewOrders { got: truncation.highest(), propagating });
    }
    let at_once = ky_at_once(request, &lines)?;
    let all_ky: usize = lines.iter().map(|line| line.ky.len()).sum();
    let layers = stacks.0.layers().len() + stacks.1.as_ref().map_or(0, |s| s.layers().len());
    expect(layers * all_ky);
    let solved: Vec<LineSolution> = lines
        .par_iter()
        .map(|line| solve_one_line(request, directions, line, at_once, progress))
        .collect::<Result<_, _>>()?;
    let mut all = SolvedDirections {
        orders: vec![DirectionOrders::default(); directions.len()],
        balance: 0.0,
        problems: 0,
    };
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
    orders: Vec<(usize, DirectionOrders)>,
    balance: f64,
    problems: usize,
}

fn solve_one_line(
    request: LinesRequest<'_>,
    directions: &[Direction],
    line: &Line,
    at_once: usize,
    progress: &Progress<'_>,
) -> Result<LineSolution, Error> {
    let LinesRequest { stacks, truncation, side, jones, .. } = request;
    let mut result = LineSolution { orders: Vec::new(), balance: 0.0, problems: 0 };
    for part in line.ky.chunks(at_once) {
        let ky: Vec<f64> = part.iter().map(|(ky, _)| *ky).collect();
        let coarse = line.solve(&stacks.0, &ky, truncation, progress)?;
        let fine = stacks
            .1
            .as_ref()
            .map(|stack| line.solve(stack, &ky, truncation, progress))
            .transpose()?;
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
                let orders = orders.ok_or(Error::Evanescent { order: 0, side })?;
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
) -> Option<DirectionOrders> {
    let m = member.order;
    coarse.source(side, m)?;
    let efficiency = |from: (Side, i32, Pol), to: (Side, i32), pol: Pol| {
        efficiency_of_runs(coarse, fine, from, to, pol)
    };
    let mut orders = DirectionOrders::default();
    for other in Side::BOTH {
        for n in coarse.orders(other) {
            if member.mirrored {
                if coarse.source(other, n).is_none() {
                    continue;
                }
                let from = |p, q| efficiency((other, n, q), (side, m), p);
                let all = Pol::BOTH.map(|p| Pol::BOTH.map(|q| from(p, q)));
                orders.efficiencies.push((other, m - n, all));
            } else {
                let to = |p, q| efficiency((side, m, p), (other, n), q);
                let all = Pol::BOTH.map(|p| Pol::BOTH.map(|q| to(p, q)));
                orders.efficiencies.push((other, n - m, all));
            }
        }
    }
    for p in 0..2 {
        clip_negative(orders.efficiencies.iter_mut().flat_map(|order| &mut order.2[p]));
    }
    if jones {
        let sign = if member.negative { -1.0 } else { 1.0 };
        for found in coarse.jones_of_all((side, m)).ok()? {
            let mut matrix = found.matrix;
            // The mirror y -> -y turns s into -s.
            matrix[0][1] *= sign;
            matrix[1][0] *= sign;
            orders.jones.push((found.side, found.order - m, matrix));
        }
    }
    Some(orders)
}
