// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe: half-space below, then modes, interface and thickness of every layer, half-space
//! above.
//!
//! A Bloch wavevector in, the scattering matrix of all its propagating orders out. All ky of one
//! kx0 share the modes and interfaces. Where symmetry allows it, `real_basis` takes the
//! same steps in real numbers.

use crate::error::Error;
use crate::expansion::FourierOrders;
use crate::guard;
use crate::modes;
use crate::orders::{
    Bloch, Channel, SymmetricBloch, Truncation, channels, highest_propagating, wavevectors,
};
use crate::progress::{Progress, beyond, no_progress};
use crate::real_basis::RealBasis;
use crate::real_basis::solve::{LineCache, RealSolutions, solve_real};
use crate::scattering::{ENERGY_TOLERANCE, Scattering};
use crate::stack::Stack;
use crate::stack::recursion::carry_to_top;
use crate::stack::state::State;
use crate::stack::transfer_cache::TransferCache;
use crate::wave::Side;
use rayon::prelude::*;

/// Solves one Bloch wavevector: all directions of incidence that share it, from both sides, in s
/// and p.
///
/// # Errors
/// Wavevectors that are not finite, eigenproblems that fail, an energy balance that does not close.
pub fn solve(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Result<Scattering, Error> {
    let line = Line::new(stack, truncation, &no_progress);
    Ok(line.solve(&[bloch])?.remove(0))
}

/// Solves several ky at one kx0; the modes of the layers are found once for all of them.
///
/// # Errors
/// The errors of [`solve`]; [`Error::Stopped`] if `progress` says so.
pub fn solve_line(
    stack: &Stack,
    kx0: f64,
    ky: &[f64],
    truncation: Truncation,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    Line::new(stack, truncation, progress).solve_at(kx0, ky)
}

/// Solves a line at a Bloch wavevector that is its own mirror image: in real arithmetic, several
/// times as fast, where there is no loss, no metal and no thick layer, otherwise as [`solve_line`]. At [`SymmetricBloch::Edge`] real arithmetic keeps the orders -M-1..=M.
///
/// # Errors
/// The errors of [`solve_line`].
pub fn solve_symmetric_line(
    stack: &Stack,
    at: SymmetricBloch,
    ky: &[f64],
    truncation: Truncation,
    progress: &Progress<'_>,
) -> Result<Vec<Scattering>, Error> {
    Line::new(stack, truncation, progress).solve_symmetric(at, ky, &mut LineCache::none())
}

/// Highest order that propagates in either half-space: the least truncation that keeps every order
/// of light.
pub fn highest_order(stack: &Stack, bloch: Bloch) -> usize {
    let of = |side| highest_propagating(stack.index(side), stack.period_per_wavelength(), bloch);
    of(Side::Top).max(of(Side::Bottom))
}

/// Largest rounding of the squared wavevectors of the orders with which a stack is solved.
const MAX_ROUNDING: f64 = 1e-5;

/// Error of an efficiency over that rounding, at most; 300 was found on 161 orders.
const LOST_BY_ROUNDING: f64 = 300.0;

/// Rounding of (M λ/Λ)², beside which ε of about 1 stands in the eigenproblems.
fn rounding(order_spacing: f64, truncation: Truncation) -> f64 {
    f64::EPSILON * (truncation.highest() as f64 * order_spacing).powi(2)
}

/// Bound of the error that rounding of the orders' wavevectors leaves.
pub(crate) fn rounding_error(order_spacing: f64, truncation: Truncation) -> f64 {
    LOST_BY_ROUNDING * rounding(order_spacing, truncation)
}

/// Settings shared by all ky of one kx0.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    stack: &'a Stack,
    truncation: Truncation,
    progress: &'a Progress<'a>,
}

impl<'a> Line<'a> {
    /// For light from both sides.
    pub(crate) fn new(
        stack: &'a Stack,
        truncation: Truncation,
        progress: &'a Progress<'a>,
    ) -> Self {
        Self { stack, truncation, progress }
    }

    /// Spacing of the orders in kx, λ/Λ.
    pub(crate) fn order_spacing(self) -> f64 {
        self.stack.wavelength() / self.stack.period()
    }

    /// # Errors
    /// A wavevector that is not finite; orders of which rounding leaves too few digits.
    fn check(self, blochs: &[Bloch]) -> Result<(), Error> {
        blochs.iter().try_for_each(|bloch| bloch.check())?;
        let rounding = rounding(self.order_spacing(), self.truncation);
        let is_patterned = self.stack.layers().iter().any(|l| l.uniform_index().is_none());
        if rounding <= MAX_ROUNDING || !is_patterned {
            return Ok(());
        }
        Err(Error::Rounding {
            highest: self.truncation.highest(),
            period_per_wavelength: self.stack.period_per_wavelength(),
            rounding: LOST_BY_ROUNDING * rounding,
        })
    }

    /// Solves all ky at one kx0.
    pub(crate) fn solve_at(self, kx0: f64, ky: &[f64]) -> Result<Vec<Scattering>, Error> {
        let blochs: Vec<Bloch> = ky.iter().map(|&ky| Bloch::new(kx0, ky)).collect();
        self.solve(&blochs)
    }

    /// Solves `blochs`, which share kx0 and any ky: in real numbers where the stack is its own
    /// mirror image.
    fn solve(self, blochs: &[Bloch]) -> Result<Vec<Scattering>, Error> {
        let Some(first) = blochs.first() else {
            return Ok(Vec::new());
        };
        self.check(blochs)?;
        match RealBasis::of_any_line(self.stack, first.kx0, self.truncation) {
            Some(basis) => self.solve_in_real_basis(&basis, blochs, &mut LineCache::none()),
            None => self.solve_in_orders(blochs),
        }
    }

    /// Solves a self-mirror kx0, with what earlier calls for the same line have left in the cache.
    pub(crate) fn solve_symmetric(
        self,
        at: SymmetricBloch,
        ky: &[f64],
        cache: &mut LineCache,
    ) -> Result<Vec<Scattering>, Error> {
        let kx0 = at.kx0(self.stack);
        let blochs: Vec<Bloch> = ky.iter().map(|&ky| Bloch::new(kx0, ky)).collect();
        self.check(&blochs)?;
        match RealBasis::of_symmetric_line(self.stack, at, self.truncation) {
            Some(basis) => self.solve_in_real_basis(&basis, &blochs, cache),
            None => self.solve(&blochs),
        }
    }

    /// Solves in complex numbers, in the orders themselves, whatever the stack.
    fn solve_in_orders(self, blochs: &[Bloch]) -> Result<Vec<Scattering>, Error> {
        let (stack, truncation) = (self.stack, self.truncation);
        let Some(first) = blochs.first() else {
            return Ok(Vec::new());
        };
        guard::check(truncation, [stack.layers().len(), blochs.len(), 1], false)?;
        let kx = wavevectors(*first, stack.period_per_wavelength(), truncation);
        let mut fields: Vec<Fields> =
            blochs.iter().map(|&bloch| Fields::above_bottom(stack, &kx, bloch)).collect();
        let states = fields.iter_mut().map(|fields| &mut fields.state).collect();
        let cache = &mut TransferCache::none();
        carry_to_top(stack, states, &FourierOrders(&kx), cache, self.progress)?;
        fields.into_par_iter().map(|fields| fields.match_top(stack, &kx)).collect()
    }

    /// Solves in real numbers, and in orders what these cannot answer. Layers are reported once.
    fn solve_in_real_basis(
        self,
        basis: &RealBasis,
        blochs: &[Bloch],
        cache: &mut LineCache,
    ) -> Result<Vec<Scattering>, Error> {
        guard::check(self.truncation, [self.stack.layers().len(), blochs.len(), 1], true)?;
        let solved = match solve_real(self.stack, basis, blochs, cache, self.progress)? {
            RealSolutions::Each(solved) => solved,
            RealSolutions::NoModes { reported } => {
                let progress = &beyond(self.progress, reported);
                return Line { progress, ..self }.solve_in_orders(blochs);
            }
        };
        let unsolved = blochs.iter().zip(&solved).filter(|(_, s)| s.is_none());
        let unsolved: Vec<Bloch> = unsolved.map(|(&bloch, _)| bloch).collect();
        let progress = &beyond(self.progress, usize::MAX);
        let mut rest = Line { progress, ..self }.solve_in_orders(&unsolved)?.into_iter();
        Ok(solved.into_iter().filter_map(|scattering| scattering.or_else(|| rest.next())).collect())
    }
}

/// The fields (3.1) of one ky, in orders, with the channels of both half-spaces.
struct Fields {
    bloch: Bloch,
    top: Vec<Channel>,
    bottom: Vec<Channel>,
    state: State,
}

impl Fields {
    /// Just above the bottom half-space.
    fn above_bottom(stack: &Stack, kx: &[f64], bloch: Bloch) -> Self {
        let ratio = stack.period_per_wavelength();
        let highest = (kx.len() / 2) as i32;
        let orders = -highest..=highest;
        let [top, bottom] =
            Side::BOTH.map(|side| channels(stack.index(side), ratio, bloch, orders.clone()));
        let n = stack.index(Side::Bottom);
        Self { state: State::at_bottom(n, kx, bloch, &bottom), bloch, top, bottom }
    }

    /// Matches the fields just below the top half-space to its waves, and checks the energy
    /// balance.
    fn match_top(self, stack: &Stack, kx: &[f64]) -> Result<Scattering, Error> {
        let n = stack.index(Side::Top);
        let channels = [self.top, self.bottom];
        let scattering = Scattering::match_top(&self.state, n, kx, self.bloch, channels);
        check_energy(stack, kx, &scattering)?;
        Ok(scattering)
    }
}

/// R + T must be 1 without loss and must not exceed 1 with it, whatever the truncation.
fn check_energy(stack: &Stack, kx: &[f64], scattering: &Scattering) -> Result<(), Error> {
    let Some((side, order, pol, residual)) = scattering.worst_balance() else {
        return Ok(());
    };
    let excess = if stack.is_lossless() { residual.abs() } else { residual };
    if excess <= ENERGY_TOLERANCE {
        return Ok(());
    }
    let (layer, mode_residual) = worst_modes(stack, kx)?;
    Err(Error::Energy {
        layer,
        order,
        pol,
        side,
        ky: scattering.bloch().ky,
        residual,
        allowed: ENERGY_TOLERANCE,
        mode_residual,
    })
}

/// The layer with the least accurate modes, and their residual.
fn worst_modes(stack: &Stack, kx: &[f64]) -> Result<(usize, f64), Error> {
    let mut worst = (0, 0.0);
    for (number, layer) in stack.layers().iter().enumerate() {
        let residual = modes::residual(layer, kx)?;
        if residual > worst.1 {
            worst = (number, residual);
        }
    }
    Ok(worst)
}

/// The same recipe for one ky without any shortcut: no symmetry, no layers together, no families
/// apart.
#[cfg(test)]
pub(crate) fn solve_plainly(
    stack: &Stack,
    bloch: Bloch,
    truncation: Truncation,
) -> Result<Scattering, Error> {
    use crate::modes::{Basis, CorrectionStep, VerticalLayer};
    use crate::stack::interface::InterfaceMatrices;
    use crate::stack::propagate::LayerStep;

    let kx = wavevectors(bloch, stack.period_per_wavelength(), truncation);
    let orders = FourierOrders(&kx);
    let half_space = Basis::fourier([kx.len(); 2]);
    let mut below = half_space.clone();
    let mut fields = Fields::above_bottom(stack, &kx, bloch);
    for (layer, sections) in stack.bottom_up() {
        let modes = modes::modes(layer, &kx)?; // (1.1)
        let vertical = VerticalLayer::new(&orders, &layer.segments, &modes.basis);
        let flow = |section: &crate::relief::WallCorrection| {
            let height = stack.in_waves(section.height);
            CorrectionStep::new(&orders, section, &vertical, height)
        };
        let step = LayerStep {
            interface: Some(InterfaceMatrices::new(&modes.basis, &below)), // (3.2)
            modes: &modes,
            corrections: sections.iter().map(flow).collect::<Result<_, Error>>()?, // (4.1)
            thickness: stack.optical_thickness(layer),
        };
        step.pass(&mut fields.state); // (3.3)
        below = modes.basis;
    }
    let interface = InterfaceMatrices::new(&half_space, &below);
    fields.state.cross(&interface);
    fields.match_top(stack, &kx)
}
