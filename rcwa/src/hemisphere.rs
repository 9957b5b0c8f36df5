// SPDX-License-Identifier: MIT OR Apache-2.0
//! All directions of incidence at once: efficiencies of every order over the hemispheres on both
//! sides.
//!
//! Directions are nodes of kx, P to a Brillouin zone, times a list of ky ≥ 0: kx_i = i (λ/Λ)/P for
//! even P, (i + ½) (λ/Λ)/P for odd P, so that as many nodes as possible are their own mirror image
//! (0 and half a zone), which real arithmetic solves. All kx_i with the same i mod P belong to one
//! Bloch wavevector, so P lines of scattering problems hold every kx; and by reciprocity, S(-k) =
//! Sᵀ(k), the nodes at -kx need no problem of their own: half the lines do. Efficiencies do not
//! depend on the sign of ky.
//!
//! Slices of dielectric reliefs follow their slanted walls ([`crate::relief`], theory section 4).
//! Other reliefs are cut into stairs, which converge as the square of their thickness h once they
//! are too fine to diffract (a stair no longer than half a wavelength in the medium). Efficiencies
//! on s and on 4/3 s slices are extrapolated to h = 0, (16 fine - 9 coarse)/7. This keeps every
//! sum, so that energy stays exact, and leaves an error of the order h⁴.

mod matrices;

pub use matrices::{Matrices, hemisphere_matrices};

use crate::error::{Error, Limit};
use crate::guard;
use crate::orders::SymmetricBloch;
use crate::orders::Truncation;
use crate::progress::Progress;
use crate::real_basis::solve::LineCache;
use crate::relief::{Relief, SlicePlan, extrapolate, is_dielectric, slanted_wall_layers};
use crate::scattering::Scattering;
use crate::solve::Line;
use crate::stack::Stack;
use crate::wave::{Pol, Side};
use num_complex::Complex64;
use rayon::prelude::*;

/// A relief between two half-spaces, lit at one wavelength.
#[derive(Clone, Debug)]
pub struct Interface {
    /// The relief, with its materials.
    pub relief: Relief,
    /// Vacuum wavelength, in the unit of the relief.
    pub wavelength: f64,
    /// Index above, from which z = 0 is reached.
    pub n_top: Complex64,
    /// Index below.
    pub n_bottom: Complex64,
}

impl Interface {
    /// The stack of layers on a plan of slices.
    ///
    /// # Errors
    /// The errors of [`Stack::new`].
    pub fn stack(&self, plan: &SlicePlan) -> Result<Stack, Error> {
        guard::check_slices(plan.count())?;
        Stack::new(
            self.wavelength,
            self.relief.period(),
            self.n_top,
            self.n_bottom,
            self.relief.layers(plan),
        )
    }

    /// True where slices follow its slanted walls: where all its media are dielectrics.
    pub fn follows_walls(&self) -> bool {
        self.indices().into_iter().all(is_dielectric)
    }

    /// The stacks of a resolution: one that follows the slanted walls, or two of stairs, whose
    /// efficiencies are extrapolated.
    ///
    /// # Errors
    /// The errors of [`Stack::new`].
    pub fn stacks(&self, resolution: &Resolution) -> Result<(Stack, Option<Stack>), Error> {
        if let Some(stack) = self.wall_following_stack(&resolution.plan)? {
            return Ok((stack, None));
        }
        let (coarse, fine) = resolution.plans();
        let fine = fine.map(|plan| self.stack(&plan)).transpose()?;
        Ok((self.stack(&coarse)?, fine))
    }

    /// The stack that follows the slanted walls, if all media are dielectrics.
    pub(crate) fn wall_following_stack(&self, plan: &SlicePlan) -> Result<Option<Stack>, Error> {
        if !self.follows_walls() {
            return Ok(None);
        }
        guard::check_slices(plan.count())?;
        let layers = slanted_wall_layers(&self.relief, plan);
        let (period, n_top, n_bottom) = (self.relief.period(), self.n_top, self.n_bottom);
        Stack::with_wall_corrections(self.wavelength, period, n_top, n_bottom, layers).map(Some)
    }

    /// Indices of all media, each once.
    pub(crate) fn indices(&self) -> Vec<Complex64> {
        let mut all = vec![self.n_top, self.n_bottom, self.relief.background()];
        all.extend(self.relief.polygons().iter().map(|polygon| polygon.index));
        distinct(all)
    }

    /// Layers that a problem passes at a resolution, those of both runs if two are extrapolated.
    pub fn layers(&self, resolution: &Resolution) -> usize {
        if self.follows_walls() {
            let intervals = resolution.plan.intervals();
            intervals.iter().map(|i| if i.slanted { 2 * i.count } else { 1 }).sum()
        } else {
            let (coarse, fine) = resolution.plans();
            coarse.count() + fine.map_or(0, |f| f.count())
        }
    }

    /// Layers whose modes a line needs at a resolution: both halves of a slice have the same.
    pub(crate) fn mode_layers(&self, resolution: &Resolution) -> usize {
        if self.follows_walls() { resolution.plan.count() } else { self.layers(resolution) }
    }

    /// Spacing of the orders in kx, λ/Λ.
    pub fn order_spacing(&self) -> f64 {
        self.wavelength / self.relief.period()
    }

    /// # Errors
    /// Fewer orders than propagate.
    fn check_orders(&self, truncation: Truncation) -> Result<(), Error> {
        let (got, propagating) = (truncation.highest(), self.highest_order());
        if got < propagating {
            return Err(Error::TooFewOrders { got, propagating });
        }
        Ok(())
    }

    /// Highest order of any direction, from either side.
    pub fn highest_order(&self) -> usize {
        let highest = |n: Complex64| {
            if n.im == 0.0 { n.re / self.order_spacing() + 0.5 } else { 0.0 }
        };
        highest(self.n_top).max(highest(self.n_bottom)).floor() as usize
    }
}

/// The indices without those that repeat an earlier one.
pub(crate) fn distinct(all: impl IntoIterator<Item = Complex64>) -> Vec<Complex64> {
    all.into_iter().fold(Vec::new(), |mut found, index| {
        if !found.contains(&index) {
            found.push(index);
        }
        found
    })
}

/// Nodes of the directions of incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Directions {
    /// Nodes of kx in one Brillouin zone, ≥ 1.
    pub kx_per_zone: usize,
    /// Nodes of ky, ≥ 0, in units of k0.
    pub ky: Vec<f64>,
}

/// Resolution of the relief: orders and slices.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolution {
    /// Orders kept.
    pub truncation: Truncation,
    /// Slices; where two runs are extrapolated, those of the coarser one before they are raised to
    /// multiples of three.
    pub plan: SlicePlan,
}

impl Resolution {
    /// The two plans whose results are extrapolated where slanted sides are not followed: multiples
    /// of three slices between kinks, and four for every three. The second is `None` where one
    /// slice is exact.
    pub fn plans(&self) -> (SlicePlan, Option<SlicePlan>) {
        if self.plan.is_exact() {
            (self.plan.clone(), None)
        } else {
            let coarse = self.plan.raised(3);
            let fine = coarse.thirds(4);
            (coarse, Some(fine))
        }
    }

    /// The error of a search that ends here, where `limit` is exhausted and `estimate` is left of
    /// the part `allowed` of the tolerance.
    pub(crate) fn not_converged(
        &self,
        limit: Limit,
        tolerance: f64,
        allowed: f64,
        estimate: f64,
    ) -> Error {
        let (truncation, slices) = (self.truncation.highest(), self.plan.count());
        Error::NotConverged { limit, tolerance, allowed, estimate, truncation, slices }
    }
}

/// One incident wave and where its power goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Incidence {
    /// Half-space that it comes from.
    pub side: Side,
    /// Number i of its kx node; negative for kx < 0.
    pub kx_index: i64,
    /// Number of the ky node.
    pub ky_index: usize,
    /// Polarisation.
    pub pol: Pol,
    /// (side, order relative to its own, efficiency), summing to 1 without loss.
    pub efficiencies: Vec<(Side, i32, f64)>,
}

/// Efficiencies over the hemispheres.
#[derive(Clone, Debug)]
pub struct Hemisphere {
    /// Every incident wave.
    pub incidences: Vec<Incidence>,
    /// Largest |R + T - 1| of any scattering problem (of R + T - 1 with loss).
    pub worst_balance: f64,
    /// Scattering problems solved, counting both runs.
    pub problems: usize,
}

impl Directions {
    /// Nodes of kx lie this part of their spacing beside 0: 0 for an even number to a zone, ½ for
    /// an odd one.
    pub fn offset(&self) -> f64 {
        if self.kx_per_zone.is_multiple_of(2) { 0.0 } else { 0.5 }
    }

    /// kx of a node, in units of the spacing of the orders.
    pub fn node(&self, kx_index: i64) -> f64 {
        (kx_index as f64 + self.offset()) / self.kx_per_zone as f64
    }

    /// Number of the node at -kx.
    fn mirror(&self, kx_index: i64) -> i64 {
        if self.kx_per_zone.is_multiple_of(2) { -kx_index } else { -1 - kx_index }
    }

    /// Nodes from 0 to half a zone, each of which is a Bloch wavevector to solve.
    pub(crate) fn lines(&self) -> std::ops::RangeInclusive<i64> {
        0..=(self.kx_per_zone / 2) as i64
    }

    /// Solves all ky of a line.
    fn solve(
        &self,
        line: i64,
        problems: Line<'_>,
        cache: &mut LineCache,
    ) -> Result<Vec<Scattering>, Error> {
        match self.mirrored(line) {
            Some(at) => problems.solve_symmetric(at, &self.ky, cache),
            None => problems.solve_at(self.node(line) * problems.order_spacing(), &self.ky),
        }
    }

    /// The self-mirror wavevector of a line, if it has one.
    pub(crate) fn mirrored(&self, line: i64) -> Option<SymmetricBloch> {
        let twice = 2 * line + i64::from(!self.kx_per_zone.is_multiple_of(2));
        if twice == 0 {
            Some(SymmetricBloch::Centre)
        } else if twice == self.kx_per_zone as i64 {
            Some(SymmetricBloch::Edge)
        } else {
            None
        }
    }
}

/// The total that [`hemisphere`] reports to [`Progress`]: layers times problems.
pub fn work(interface: &Interface, directions: &Directions, resolution: &Resolution) -> usize {
    directions.lines().count() * directions.ky.len() * interface.layers(resolution)
}

/// Solves an interface for all directions.
///
/// # Errors
/// The errors of [`crate::solve()`]; [`Error::Stopped`] if `progress` says so; too few orders for what
/// propagates.
pub fn hemisphere(
    interface: &Interface,
    directions: &Directions,
    resolution: &Resolution,
    progress: &Progress<'_>,
) -> Result<Hemisphere, Error> {
    BlochLines::new(interface, directions, resolution, 0)?.solve(&directions.ky, progress)
}

/// The lines of an interface at a resolution, solved for more and more ky.
pub(crate) struct BlochLines {
    truncation: Truncation,
    kx_per_zone: usize,
    stacks: (Stack, Option<Stack>),
    /// Number and cache of each line.
    numbered: Vec<(i64, LineCache)>,
}

impl BlochLines {
    /// For these nodes of kx, with a cache of so many bytes for each line.
    pub(crate) fn new(
        interface: &Interface,
        directions: &Directions,
        resolution: &Resolution,
        bytes: usize,
    ) -> Result<Self, Error> {
        interface.check_orders(resolution.truncation)?;
        let stacks = interface.stacks(resolution)?;
        // Only lines of one run keep transfers.
        let bytes = if stacks.1.is_some() { 0 } else { bytes };
        let with_cache = |line| (line, LineCache::with_capacity(bytes));
        Ok(Self {
            truncation: resolution.truncation,
            kx_per_zone: directions.kx_per_zone,
            stacks,
            numbered: directions.lines().map(with_cache).collect(),
        })
    }

    /// Replaces the lines by those half-way between them, which twice as many kx to a zone add.
    pub(crate) fn refine_kx(&mut self) {
        let of = |kx_per_zone: usize| Directions { kx_per_zone, ky: Vec::new() };
        self.kx_per_zone *= 2;
        self.numbered = of(self.kx_per_zone)
            .lines()
            .filter(|line| line % 2 == 1)
            .map(|line| (line, LineCache::none()))
            .collect();
    }

    /// Solves for all directions with these ky.
    pub(crate) fn solve(
        &mut self,
        ky: &[f64],
        progress: &Progress<'_>,
    ) -> Result<Hemisphere, Error> {
        let directions = Directions { kx_per_zone: self.kx_per_zone, ky: ky.to_vec() };
        let truncation = self.truncation;
        let stacks = &self.stacks;
        // Lines go side by side, and so do both stacks. Those within the zone are complex.
        let lines = self.numbered.len().min(rayon::current_num_threads());
        let workers = lines * (1 + usize::from(stacks.1.is_some()));
        guard::check(truncation, [stacks.0.layers().len(), ky.len(), workers], false)?;
        let solved: Vec<Hemisphere> = self
            .numbered
            .par_iter_mut()
            .map(|(line, cache)| {
                let run = |stack: &Stack, cache: &mut LineCache| {
                    let problems = Line::new(stack, truncation, progress);
                    directions.solve(*line, problems, cache)
                };
                let (coarse, fine) = match stacks {
                    (only, None) => (run(only, cache)?, None),
                    (coarse, Some(fine)) => {
                        let (coarse, fine) = rayon::join(
                            || run(coarse, &mut LineCache::none()),
                            || run(fine, &mut LineCache::none()),
                        );
                        (coarse?, Some(fine?))
                    }
                };
                Ok(collect(&coarse, fine.as_deref(), *line, &directions))
            })
            .collect::<Result<_, Error>>()?;
        Ok(solved.into_iter().fold(
            Hemisphere { incidences: Vec::new(), worst_balance: 0.0, problems: 0 },
            |mut all, mut line| {
                all.incidences.append(&mut line.incidences);
                all.worst_balance = all.worst_balance.max(line.worst_balance);
                all.problems += line.problems;
                all
            },
        ))
    }
}

/// [`Scattering::efficiency_in`] of one run, or extrapolated from two on s and 4/3 s slices.
pub(crate) fn efficiency_of_runs(
    coarse: &Scattering,
    fine: Option<&Scattering>,
    from: (Side, i32, Pol),
    to: (Side, i32),
    pol: Pol,
) -> f64 {
    let one = coarse.efficiency_in(from, to, pol);
    fine.map_or(one, |fine| extrapolate(one, fine.efficiency_in(from, to, pol), 3.0))
}

/// Sets negative efficiencies of an extrapolation to 0 and scales the others to keep the sum.
pub(crate) fn clip_negative<'a>(efficiencies: impl Iterator<Item = &'a mut f64>) {
    let mut efficiencies: Vec<&mut f64> = efficiencies.collect();
    if efficiencies.iter().all(|e| **e >= 0.0) {
        return;
    }
    let before: f64 = efficiencies.iter().map(|e| **e).sum();
    for efficiency in &mut efficiencies {
        **efficiency = f64::max(**efficiency, 0.0);
    }
    let after: f64 = efficiencies.iter().map(|e| **e).sum();
    if after > 0.0 {
        for efficiency in efficiencies {
            *efficiency *= before / after;
        }
    }
}

fn collect(
    coarse: &[Scattering],
    fine: Option<&[Scattering]>,
    line: i64,
    directions: &Directions,
) -> Hemisphere {
    let mut incidences = Vec::new();
    let mut worst_balance = 0.0_f64;
    for (ky_index, scattering) in coarse.iter().enumerate() {
        let finer = fine.map(|f| &f[ky_index]);
        for run in std::iter::once(scattering).chain(finer) {
            worst_balance = worst_balance.max(run.worst_balance().map_or(0.0, |w| w.3.abs()));
        }
        let efficiency = |from: (Side, i32, Pol), to: (Side, i32), pol: Pol| {
            efficiency_of_runs(scattering, finer, from, to, pol)
        };
        let node = |m: i32| line + directions.kx_per_zone as i64 * i64::from(m);
        let mut push = |side, kx_index, pol, mut efficiencies: Vec<(Side, i32, f64)>| {
            clip_negative(efficiencies.iter_mut().map(|e| &mut e.2));
            incidences.push(Incidence { side, kx_index, ky_index, pol, efficiencies });
        };
        for side in Side::BOTH {
            for m in scattering.sources(side) {
                for pol in Pol::BOTH {
                    let mut direct = Vec::new();
                    let mut reciprocal = Vec::new();
                    for other in Side::BOTH {
                        for n in scattering.orders(other) {
                            let both = Pol::BOTH;
                            let to = both
                                .iter()
                                .map(|&p| efficiency((side, m, pol), (other, n), p))
                                .sum();
                            direct.push((other, n - m, to));
                            // Reciprocity: (side, -kx_m) to (other, -kx_n) equals (other, kx_n) to
                            // (side, kx_m).
                            if scattering.source(other, n).is_some() {
                                let from = both
                                    .iter()
                                    .map(|&p| efficiency((other, n, p), (side, m), pol))
                                    .sum();
                                reciprocal.push((other, m - n, from));
                            }
                        }
                    }
                    push(side, node(m), pol, direct);
                    if directions.mirrored(line).is_none() {
                        push(side, directions.mirror(node(m)), pol, reciprocal);
                    }
                }
            }
        }
    }
    let problems = coarse.len() + fine.map_or(0, <[Scattering]>::len);
    Hemisphere { incidences, worst_balance, problems }
}
