// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lines in real arithmetic: self-mirror lines, and all lines of a mirror-symmetric stack.
//!
//! At kx0 = 0 and at half a zone the orders come in pairs ±κ, and the fields of a lossless
//! structure are real but for fixed factors: reversal of time, together with y → -y, leaves exp(i
//! ky y) alone. In the basis of √2 cos κx and √2 sin κx
//!
//! - Ex = ex,   Ey = -i ey,   Hy = i hy,   -Hx = hx
//!
//! with real ex, ey, hy, hx. The matrices of a layer, its modes and all products are then real: a
//! quarter of the work. A stack that is its own mirror image about one centre gives more:
//!
//! - on these lines the two parities, cosines in Ex and Hy with sines in Ey and Hx or the reverse,
//!   are solved apart, which takes another quarter;
//! - on all others reversal of time together with x → -x and y → -y leaves the wavevector alone,
//!   and in orders about the centre Ex = ex, Ey = ey, Hy = i hy, -Hx = i hx are real.
//!
//! Complex numbers enter only where the half-spaces are matched to the orders that propagate
//! (`half_space`). The method is that of the R matrix and of the logarithmic derivative in
//! scattering theory [Manolopoulos1986]. Real relations have poles (standing waves between the
//! planes), so the parameters change wherever one is near ([`crate::stack::propagate`]).

mod half_space;
pub(crate) mod solve;

use crate::expansion::FieldGroup;
use crate::expansion::real::RealFunctions;
use crate::fourier::{is_symmetric_about, symmetry_centres};
use crate::orders::wavevectors;
use crate::orders::{Bloch, SymmetricBloch, Truncation};
use crate::relief::{Wall, is_dielectric};
use crate::stack::Stack;
use crate::stack::arithmetic::THIN;
use crate::wave::Side;

/// Layers that take more slabs than this are left to complex arithmetic.
const MOST_SLABS: f64 = 4.0;

/// Products of the components of two normals that count as equal.
const SAME_NORMAL: f64 = 1e-9;

/// The real functions of a line.
pub(crate) struct RealBasis {
    /// Solved apart.
    parts: Vec<RealFunctions>,
    /// Every order kept and its kx, ascending; κ of the functions to the last bit.
    orders: Vec<(i32, f64)>,
}

impl RealBasis {
    /// Of a self-mirror line, if real arithmetic applies.
    pub(crate) fn of_symmetric_line(
        stack: &Stack,
        at: SymmetricBloch,
        truncation: Truncation,
    ) -> Option<Self> {
        let all = RealFunctions::standing(at, truncation.highest(), stack.period_per_wavelength());
        if !applies(stack, all.steepest()) {
            return None;
        }
        Some(Self::of_pairs(&all, at, centre(stack)))
    }

    /// Of all standing waves, apart if there is a centre.
    fn of_pairs(all: &RealFunctions, at: SymmetricBloch, centre: Option<f64>) -> Self {
        // One order alone has no sine.
        let is_paired = all.functions_of(FieldGroup::X).len() > 1;
        let parts = match centre.filter(|_| is_paired) {
            Some(centre) => all.parities(centre).to_vec(),
            None => vec![all.clone()],
        };
        Self { parts, orders: all.pairs(at) }
    }

    /// Of any line, with the orders -M..=M, if the stack is its own mirror image and real
    /// arithmetic applies.
    pub(crate) fn of_any_line(stack: &Stack, kx0: f64, truncation: Truncation) -> Option<Self> {
        let ratio = stack.period_per_wavelength();
        let kx = wavevectors(Bloch::new(kx0, 0.0), ratio, truncation);
        let steepest = kx.iter().fold(0.0_f64, |most, k| most.max(k.abs()));
        if !applies(stack, steepest) {
            return None;
        }
        let centre = centre(stack)?;
        if kx0 == 0.0 {
            let at = SymmetricBloch::Centre;
            let all = RealFunctions::standing(at, truncation.highest(), ratio);
            return Some(Self::of_pairs(&all, at, Some(centre)));
        }
        Some(Self {
            parts: vec![RealFunctions::orders(&kx, centre)],
            orders: truncation.orders().zip(kx.iter().copied()).collect(),
        })
    }

    pub(crate) fn parts(&self) -> &[RealFunctions] {
        &self.parts
    }

    /// Every order kept and its kx, ascending.
    pub(crate) fn orders(&self) -> &[(i32, f64)] {
        &self.orders
    }
}

/// True where there is no loss, no metal and no layer that is thick for waves of this in-plane
/// wavevector.
fn applies(stack: &Stack, steepest: f64) -> bool {
    Side::BOTH.into_iter().all(|side| is_dielectric(stack.index(side)))
        && stack.layers().iter().all(|layer| {
            layer.segments.iter().all(|s| is_dielectric(s.index))
                && steepest * stack.optical_thickness(layer) <= MOST_SLABS * THIN
        })
}

/// The place (a fraction of the period) about which a stack is its own mirror image, slanted walls
/// included; `None` if there is none.
fn centre(stack: &Stack) -> Option<f64> {
    let patterned = stack.layers().iter().find(|l| l.uniform_index().is_none());
    let Some(layer) = patterned else {
        return Some(0.0);
    };
    let all = symmetry_centres(&layer.segments);
    all.into_iter().find(|&centre| {
        let sections = stack.wall_corrections().iter().flatten();
        let layers = stack.layers().iter().map(|layer| &layer.segments);
        layers
            .chain(sections.clone().map(|section| &section.segments))
            .all(|segments| is_symmetric_about(segments, centre))
            && sections.map(|section| &section.borders).all(|walls| are_mirrored(walls, centre))
    })
}

/// True where every wall has its mirror image about `centre` among `walls`, whose places have been
/// compared.
fn are_mirrored(walls: &[Wall], centre: f64) -> bool {
    let distance = |a: f64, b: f64| ((a - b) - (a - b).round()).abs();
    walls.iter().all(|wall| {
        let image = 2.0 * centre - wall.x;
        let nearest =
            walls.iter().min_by(|a, b| distance(a.x, image).total_cmp(&distance(b.x, image)));
        nearest.is_some_and(|other| {
            (other.xx - wall.xx).abs() < SAME_NORMAL && (other.xz + wall.xz).abs() < SAME_NORMAL
        })
    })
}

#[cfg(test)]
mod tests;
