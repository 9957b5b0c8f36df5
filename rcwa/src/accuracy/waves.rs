// SPDX-License-Identifier: MIT OR Apache-2.0
//! Orders and slices for single directions, and lists of them.
//!
//! The search raises the highest order M and the slices in turns, each until its error is within
//! its part of the tolerance or well below that of the other, and keeps the finest result. The
//! error of that one follows from the last change by the slowest law that errors obey.
//!
//! Dielectric reliefs begin at the resolution of a table, which leaves up to twenty times its
//! tolerance in single orders of single directions; their slices follow their walls. Other
//! structures begin with the orders that propagate. Efficiencies swing about their limit while
//! orders are added, and those of every second or third order may lie on curves of their own; so M
//! is compared with the last two steps and with its neighbours. Work is counted, not timed, so that
//! the result is the same on every machine.

mod stairs;

use super::hemisphere::fine_enough;
use super::law::{
    Law, NEIGHBOURS, ORDERS_EXPONENT, SLICES_EXPONENT, TOGETHER_EXPONENT, WAVES_SAFETY,
    corner_exponent, followed_law,
};
use super::{check_tolerance, converge_hemisphere};
use crate::error::{Error, Limit};
use crate::hemisphere::{Interface, Resolution, distinct};
use crate::orders::Truncation;
use crate::progress::Progress;
use crate::relief::SlicePlan;
use crate::solve::rounding_error;
use crate::stack::Stack;
use crate::wave::Side;
use num_complex::Complex64;

/// Ratio of the orders of a step.
const ORDERS_STEP: f64 = 1.28;
/// Ratio of the slices.
const SLICES_STEP: f64 = 4.0 / 3.0;
/// Law of slices.
const SLICES: Law = Law { exponent: SLICES_EXPONENT, safety: WAVES_SAFETY };
/// Law of what orders and stairs leave together.
const TOGETHER: Law = Law { exponent: TOGETHER_EXPONENT, safety: WAVES_SAFETY };
/// Steps of the orders that a result is compared with, where walls are not followed.
const STEPS: usize = 2;
/// Part of the tolerance that slices may take; orders may take the rest.
const SLICES_PART: f64 = 0.4;
/// Stated error above which results say next to nothing.
const UNSETTLED: f64 = 0.5;
/// Stated error from which results say nothing.
pub const NOTHING_KNOWN: f64 = 1.0;
/// Ratio at which one error is well below the other.
const WELL_BELOW: f64 = 0.2;
/// Smallest tolerance of the hemisphere that the search begins with.
const FIRST_TOLERANCE: f64 = 1e-4;
/// Work of one search, in real eigenproblems of size 1, and of a complex one relative to that.
const MAX_WORK: f64 = 2e10;
const COMPLEX: f64 = 10.0;
/// Part of it after which a search over stairs may end, and that stairs of given orders may take.
const WORK_IN_VAIN: f64 = 0.125;
/// Evaluations that a search makes whatever they cost, where it must return an estimate.
const FREE: usize = 3;
/// Slices beyond which none are tried, per wavelength of depth.
const MAX_SLICES_PER_WAVELENGTH: f64 = 2000.0;

/// A structure between two half-spaces.
#[derive(Clone, Copy, Debug)]
pub enum Structure<'a> {
    /// Layers, solved as they are.
    Layers(&'a Stack),
    /// A relief, to be cut into slices.
    Relief(&'a Interface),
}

/// Given waves: the function that solves them at a resolution, and the distance of two answers.
pub struct Waves<'a, A> {
    /// Solves the waves; of layers the plan of slices is empty.
    pub solve: &'a (dyn Fn(&Resolution) -> Result<A, Error> + 'a),
    /// Largest difference of any efficiency asked for.
    pub distance: &'a (dyn Fn(&A, &A) -> f64 + 'a),
    /// Highest order that propagates.
    pub highest_order: usize,
    /// Result of an earlier [`first_resolution`], if there is one.
    pub first: Option<Resolution>,
}

/// Errors by their origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorParts {
    /// Left by the orders.
    pub orders: f64,
    /// Left by the slices.
    pub slices: f64,
    /// Left by orders and stairs together.
    pub together: f64,
}

impl ErrorParts {
    /// Error of all parts.
    pub fn sum(self) -> f64 {
        self.orders + self.slices + self.together
    }
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Found<A> {
    /// Orders and slices.
    pub resolution: Resolution,
    /// The answer there.
    pub answer: A,
    /// Estimated errors.
    pub errors: ErrorParts,
    /// Limit that ended the search before its aim.
    pub limit: Option<Limit>,
}

impl<A> Found<A> {
    /// Reason why the error is above `tolerance`, where it is; of so many slices.
    pub fn missed(&self, tolerance: f64, slices: usize) -> Option<String> {
        let (errors, limit) = (self.errors, self.limit?);
        if errors.sum() <= tolerance {
            return None;
        }
        let part = |error: f64, by: String| match error {
            0.0 => None,
            e if e.is_infinite() => Some(format!("an unknown one by {by}")),
            e => Some(format!("{e:.1e} by {by}")),
        };
        let highest = self.resolution.truncation.highest();
        let parts = [
            part(errors.orders, format!("orders -{highest}..{highest}")),
            part(errors.slices, format!("{slices} slice{}", if slices == 1 { "" } else { "s" })),
            part(errors.together, "both together".into()),
        ];
        Some(format!(
            "tolerance: {tolerance:e} was not reached within the {limit} that one case may take; reached: an error of {}",
            parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
        ))
    }

    /// The result, if its error is within the tolerance.
    ///
    /// # Errors
    /// [`Error::NotConverged`] otherwise.
    pub fn within(self, tolerance: f64) -> Result<Self, Error> {
        let estimate = self.errors.sum();
        if estimate <= tolerance {
            return Ok(self);
        }
        let limit = self.limit.unwrap_or(Limit::Work);
        Err(self.resolution.not_converged(limit, tolerance, tolerance, estimate))
    }
}

/// Resolution that searches over waves of a dielectric relief begin with, that of a table; `None`
/// where slices follow no walls.
///
/// # Errors
/// The errors of [`converge_hemisphere`].
pub fn first_resolution(
    interface: &Interface,
    tolerance: f64,
    progress: &Progress<'_>,
) -> Result<Option<Resolution>, Error> {
    let Some(interface) = Structure::Relief(interface).followed() else {
        return Ok(None);
    };
    let loose = tolerance.max(FIRST_TOLERANCE);
    converge_hemisphere(interface, loose, progress).map(|(resolution, _)| Some(resolution))
}

/// Solves `waves` to `tolerance`, or as well as the work allowed lets it.
///
/// # Errors
/// The errors of the solver, and of the search over the hemisphere that dielectric reliefs begin with;
/// [`Error::NotConverged`] where the first step is beyond a limit.
pub fn converge_waves<A>(
    structure: Structure<'_>,
    waves: &Waves<'_, A>,
    tolerance: f64,
    progress: &Progress<'_>,
) -> Result<Found<A>, Error> {
    check_tolerance(tolerance)?;
    let table = match (&waves.first, structure) {
        (Some(first), _) => Some(first.clone()),
        (None, Structure::Relief(interface)) => first_resolution(interface, tolerance, progress)?,
        (None, Structure::Layers(_)) => None,
    };
    let (manner, first) = if let Some(table) = table {
        (Manner::FollowedWalls, table)
    } else {
        let truncation = Truncation::new(waves.highest_order + 2)?;
        (Manner::Stairs, structure.first_resolution(truncation))
    };
    let mut search = Search::new(structure, waves, manner, tolerance, first)?;
    let halt = search.run().err();
    search.found(halt)
}

/// Solves `waves` with the given orders on as many slices as leave no more than `aim`, or no more
/// than `part` of what the orders leave, in the distance `decisive`; or as many as the work allowed
/// lets it. Slices are stairs, whatever the relief.
///
/// # Errors
/// The errors of the solver.
pub fn settle_slices<A>(
    structure: Structure<'_>,
    waves: &Waves<'_, A>,
    orders: usize,
    (aim, part): (f64, f64),
    decisive: &dyn Fn(&A, &A) -> f64,
) -> Result<Found<A>, Error> {
    let first = structure.first_resolution(Truncation::new(orders)?);
    let deciding = Waves { distance: decisive, first: None, ..*waves };
    let mut search = Search::new(structure, &deciding, Manner::GivenOrders, aim, first)?;
    let mut before = None;
    let mut halt = None;
    if !search.at.plan.is_exact() {
        let aim = aim.max(part * search.look_ahead(&deciding)?);
        halt = search.raise_slices(aim, &mut before).err();
    }
    search.errors.orders = search.look_ahead(waves)?;
    if let Some((answer, ratio)) = before {
        let change = (waves.distance)(&answer, &search.answer);
        search.errors.slices = SLICES.left_by_finer(change, ratio);
    }
    search.found(halt)
}

/// Error of `answer` at a resolution, from a third more orders and slices; infinite where these
/// cannot be solved.
///
/// # Errors
/// The errors of the solver.
pub fn error_at<A>(
    structure: Structure<'_>,
    waves: &Waves<'_, A>,
    at: &Resolution,
    answer: &A,
) -> Result<f64, Error> {
    let law = Law { exponent: structure.orders_exponent(), safety: WAVES_SAFETY };
    // Stairs are raised to multiples of three.
    let own = if structure.is_of_stairs() { at.plan.raised(3) } else { at.plan.clone() };
    match left_by_coarser(waves, law, at, &own.scaled(SLICES_STEP), answer) {
        Err(error) if error.limit().is_some() => Ok(f64::INFINITY),
        left => left,
    }
}

/// Error of `answer` by a third more orders on these slices.
fn left_by_coarser<A>(
    waves: &Waves<'_, A>,
    law: Law,
    at: &Resolution,
    plan: &SlicePlan,
    answer: &A,
) -> Result<f64, Error> {
    let order = at.truncation.highest();
    let more = order + order.div_ceil(3).max(1);
    let truncation = Truncation::new(more)?;
    let finer = (waves.solve)(&Resolution { truncation, plan: plan.clone() })?;
    Ok(law.left_by_coarser((waves.distance)(answer, &finer), order as f64 / more as f64))
}

/// Warning of results whose error is such that they say next to nothing.
pub fn unsettled(error: f64, highest: usize) -> Option<String> {
    (error > UNSETTLED).then(|| {
        format!(
            "not settled: with more orders and slices an efficiency changes by about {error:.1e}; these are results of orders -{highest}..{highest} alone"
        )
    })
}

impl<'a> Structure<'a> {
    /// The relief, if slices follow its slanted walls.
    fn followed(self) -> Option<&'a Interface> {
        match self {
            Self::Relief(interface) if interface.follows_walls() => {
                (!interface.relief.slice_plan(1).is_exact()).then_some(interface)
            }
            _ => None,
        }
    }

    fn indices(self) -> Vec<Complex64> {
        match self {
            Self::Relief(interface) => interface.indices(),
            Self::Layers(stack) => distinct(
                Side::BOTH
                    .map(|side| stack.index(side))
                    .into_iter()
                    .chain(stack.layers().iter().flat_map(|l| l.segments.iter().map(|s| s.index))),
            ),
        }
    }

    /// True for a relief whose slanted walls are stairs, whatever their number.
    pub fn is_of_stairs(self) -> bool {
        match self {
            Self::Relief(interface) => {
                !interface.follows_walls() && !interface.relief.slice_plan(1).is_exact()
            }
            Self::Layers(_) => false,
        }
    }

    /// Power of 1/M by which errors of the orders fall where walls are not followed.
    fn orders_exponent(self) -> f64 {
        let most = if self.is_of_stairs() { TOGETHER_EXPONENT } else { ORDERS_EXPONENT };
        corner_exponent(&self.indices()).min(most)
    }

    fn is_lossless(self) -> bool {
        self.indices().iter().all(|n| n.im == 0.0)
    }

    /// Spacing of the orders in kx, λ/Λ.
    fn order_spacing(self) -> f64 {
        match self {
            Self::Relief(interface) => interface.order_spacing(),
            Self::Layers(stack) => 1.0 / stack.period_per_wavelength(),
        }
    }

    /// Some slices between two kinks: with fewer than three a step of the search changes little.
    fn first_resolution(self, truncation: Truncation) -> Resolution {
        let plan = match self {
            Self::Layers(_) => SlicePlan::none(),
            Self::Relief(interface) => {
                let kinks = interface.relief.slice_plan(1).count();
                let depth = interface.relief.depth() / interface.wavelength;
                interface.relief.slice_plan(((8.0 * depth).ceil() as usize + 8).max(3 * kinks))
            }
        };
        Resolution { truncation, plan }
    }

    /// Orders and slices beyond which none are tried.
    fn limits(self, highest_order: usize) -> (usize, usize) {
        let slices = match self {
            Self::Layers(_) => 0,
            Self::Relief(interface) => {
                let kinks = interface.relief.slice_plan(1).count();
                let depth = interface.relief.depth() / interface.wavelength;
                (MAX_SLICES_PER_WAVELENGTH * depth).ceil() as usize + 4000 + 10 * kinks
            }
        };
        ((8 * highest_order + 400).min(Truncation::MAX), slices)
    }
}

/// End of a search: a failed evaluation or a limit.
enum Halt {
    Failed(Error),
    Limit(Limit),
}

/// Slices of a relief, and what is to be found.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Manner {
    /// Slices follow the walls of a dielectric; one run.
    FollowedWalls,
    /// Stairs, two runs extrapolated; also layers and vertical walls, which need no slices.
    Stairs,
    /// Slices as the caller solves them; the orders are given.
    GivenOrders,
}

/// A search in progress: the finest result so far, and what is left of its error.
struct Search<'a, A> {
    structure: Structure<'a>,
    waves: &'a Waves<'a, A>,
    tolerance: f64,
    manner: Manner,
    orders_law: Law,
    /// Highest order and number of slices allowed.
    limits: (usize, usize),
    /// Work of an eigenproblem relative to one of real numbers of the same size.
    weight: f64,
    /// Evaluations allowed whatever they cost.
    free: usize,
    max_work: f64,
    spent: f64,
    at: Resolution,
    answer: A,
    /// Earlier steps, the last one first: of the orders on the same slices, or of orders and stairs.
    steps: Vec<(usize, usize, A)>,
    /// True where the error of the orders comes from as many steps and neighbours as it takes.
    is_settled: bool,
    errors: ErrorParts,
}

impl<'a, A> Search<'a, A> {
    fn new(
        structure: Structure<'a>,
        waves: &'a Waves<'a, A>,
        manner: Manner,
        tolerance: f64,
        first: Resolution,
    ) -> Result<Self, Error> {
        let exponent = match (structure, manner) {
            (Structure::Relief(interface), Manner::FollowedWalls) => {
                followed_law(interface, tolerance).exponent
            }
            _ => structure.orders_exponent(),
        };
        let at = match manner {
            Manner::Stairs => Resolution { plan: first.plan.raised(3), ..first },
            _ => first,
        };
        let weight = if structure.is_lossless() { 1.0 } else { COMPLEX };
        let spent = weight * work(structure, &at);
        let free = if manner == Manner::Stairs { 0 } else { FREE };
        if free == 0 && spent > MAX_WORK {
            return Err(at.not_converged(Limit::Work, tolerance, tolerance, f64::INFINITY));
        }
        let unknown = |counts: bool| if counts { f64::INFINITY } else { 0.0 };
        let is_exact = at.plan.is_exact();
        Ok(Self {
            structure,
            waves,
            tolerance,
            manner,
            orders_law: Law { exponent, safety: WAVES_SAFETY },
            limits: structure.limits(waves.highest_order),
            weight,
            free,
            max_work: if manner == Manner::GivenOrders && structure.is_of_stairs() {
                WORK_IN_VAIN * MAX_WORK
            } else {
                MAX_WORK
            },
            spent,
            answer: (waves.solve)(&at)?,
            at,
            steps: Vec::new(),
            is_settled: false,
            errors: ErrorParts {
                orders: f64::INFINITY,
                slices: unknown(!is_exact),
                together: unknown(!is_exact && manner == Manner::Stairs),
            },
        })
    }

    /// Raises orders and slices until the error of all is within the tolerance.
    fn run(&mut self) -> Result<(), Halt> {
        if self.manner == Manner::Stairs && !self.at.plan.is_exact() {
            return self.raise_stairs_and_orders();
        }
        let slices_aim = SLICES_PART * self.tolerance;
        self.raise_slices(slices_aim, &mut None)?;
        loop {
            self.raise_slices(slices_aim.max(WELL_BELOW * self.errors.orders), &mut None)?;
            let orders_aim = self.tolerance - self.errors.slices;
            self.raise_orders(orders_aim.max(WELL_BELOW * self.errors.slices))?;
            if self.errors.orders <= orders_aim && self.errors.slices <= slices_aim {
                return Ok(());
            }
        }
    }

    /// Raises slices until their error is at most `aim`; leaves the last answer before and the
    /// ratio of slices.
    fn raise_slices(&mut self, aim: f64, before: &mut Option<(A, f64)>) -> Result<(), Halt> {
        while self.errors.slices > aim {
            let plan = self.more_slices();
            let ratio = self.at.plan.count() as f64 / plan.count() as f64;
            let answer = self.step(Resolution { plan, ..self.at.clone() })?;
            let change = (self.waves.distance)(&answer, &self.answer);
            self.errors.slices = SLICES.left_by_finer(change, ratio);
            self.steps.clear();
            *before = Some((answer, ratio));
        }
        Ok(())
    }

    /// Raises orders until their error is at most `aim`.
    fn raise_orders(&mut self, aim: f64) -> Result<(), Halt> {
        loop {
            if self.errors.orders <= aim && self.is_settled {
                return Ok(());
            }
            if self.errors.orders <= aim && self.steps.len() >= STEPS {
                self.compare_neighbours()?;
                self.is_settled = true;
            } else {
                self.step_orders()?;
            }
        }
    }

    /// Raises the orders once; their error follows from the changes since the last steps.
    fn step_orders(&mut self) -> Result<(), Halt> {
        let order = self.at.truncation.highest();
        let at = Resolution { truncation: self.more_orders()?, ..self.at.clone() };
        let answer = self.step(at)?;
        self.steps.insert(0, (order, self.at.plan.count(), answer));
        let is_followed = self.manner == Manner::FollowedWalls;
        self.steps.truncate(if is_followed { 1 } else { STEPS });
        self.is_settled = is_followed;
        let finest = self.at.truncation.highest() as f64;
        let left = self.steps.iter().map(|(order, _, answer)| {
            let change = (self.waves.distance)(answer, &self.answer);
            self.orders_law.left_by_finer(change, *order as f64 / finest)
        });
        let rounding = rounding_error(self.structure.order_spacing(), self.at.truncation);
        self.errors.orders = left.fold(rounding, f64::max);
        Ok(())
    }

    /// Counts the distance to the orders just below as an error.
    fn compare_neighbours(&mut self) -> Result<(), Halt> {
        let highest = self.at.truncation.highest();
        for order in highest.saturating_sub(NEIGHBOURS)..highest {
            let truncation = Truncation::new(order).map_err(Halt::Failed)?;
            let answer = self.evaluate(&Resolution { truncation, ..self.at.clone() })?;
            let swing = WAVES_SAFETY * (self.waves.distance)(&answer, &self.answer);
            self.errors.orders = self.errors.orders.max(swing);
        }
        Ok(())
    }

    /// Error of the orders by a third more of them.
    fn look_ahead(&self, waves: &Waves<'_, A>) -> Result<f64, Error> {
        left_by_coarser(waves, self.orders_law, &self.at, &self.at.plan, &self.answer)
    }

    fn more_orders(&self) -> Result<Truncation, Halt> {
        let order = self.at.truncation.highest();
        let raised = ((order as f64 * ORDERS_STEP).ceil() as usize).max(order + 1);
        Truncation::new(raised).map_err(|_| Halt::Limit(Limit::Orders))
    }

    /// The next plan of slices; of stairs that are extrapolated in multiples of three.
    fn more_slices(&self) -> SlicePlan {
        let plan = self.at.plan.scaled(SLICES_STEP);
        match self.manner {
            Manner::Stairs => plan.raised(3),
            _ => self.fine_enough(plan, self.at.truncation),
        }
    }

    /// The plan, fine enough for its orders where slices follow the walls.
    fn fine_enough(&self, plan: SlicePlan, truncation: Truncation) -> SlicePlan {
        match (self.structure, self.manner) {
            (Structure::Relief(interface), Manner::FollowedWalls) => {
                fine_enough(interface, &plan, truncation, self.tolerance)
            }
            _ => plan,
        }
    }

    /// Goes on to another resolution; returns the answer at the present one.
    fn step(&mut self, at: Resolution) -> Result<A, Halt> {
        let at = Resolution { plan: self.fine_enough(at.plan, at.truncation), ..at };
        let answer = self.evaluate(&at)?;
        self.at = at;
        Ok(std::mem::replace(&mut self.answer, answer))
    }

    fn evaluate(&mut self, at: &Resolution) -> Result<A, Halt> {
        let work = self.weight * work(self.structure, at);
        let limit = if at.truncation.highest() > self.limits.0 {
            Some(Limit::Orders)
        } else if at.plan.count() > self.limits.1 && !at.plan.is_exact() {
            Some(Limit::Slices)
        } else if self.free == 0 && self.spent + work > self.max_work {
            Some(Limit::Work)
        } else {
            None
        };
        if let Some(limit) = limit {
            return Err(Halt::Limit(limit));
        }
        self.free = self.free.saturating_sub(1);
        self.spent += work;
        (self.waves.solve)(at)
            .map_err(|error| error.limit().map_or(Halt::Failed(error), Halt::Limit))
    }

    fn found(self, halt: Option<Halt>) -> Result<Found<A>, Error> {
        let limit = match halt {
            Some(Halt::Failed(error)) => return Err(error),
            Some(Halt::Limit(limit)) => Some(limit),
            None => None,
        };
        let Self { at, answer, errors, .. } = self;
        Ok(Found { resolution: at, answer, errors, limit })
    }
}

/// Work of an evaluation, in real eigenproblems of size 1.
fn work(structure: Structure<'_>, at: &Resolution) -> f64 {
    let layers = match structure {
        Structure::Layers(stack) => stack.layers().len(),
        Structure::Relief(interface) => interface.layers(at),
    };
    (at.truncation.count() as f64).powi(3) * layers as f64
}
