// SPDX-License-Identifier: MIT OR Apache-2.0
//! Unpolarised plane waves from both sides, and where the power of each goes.

use anyhow::{Result, ensure};
use rcwa::no_progress;
use rcwa::{
    Pol, Scattering, Side, Stack, SymmetricBloch, Truncation, solve_line, solve_symmetric_line,
};

/// Width of a bin of direction, degrees.
pub const BIN_DEG: f64 = 2.0;
/// Bins from -90° to 90°.
pub const BINS: usize = 90;

/// Values of ky and their weights in a quadrature.
#[derive(Debug, Clone)]
pub struct Lines {
    /// Wavevectors along the grooves, units of k0.
    pub ky: Vec<f64>,
    /// Weights that add up to the length of the range.
    pub weight: Vec<f64>,
}

impl Lines {
    /// Five nodes of Gauss's rule from 0 to 1: beyond ky = 1, that of grazing waves in air, nothing
    /// passes.
    pub fn passing() -> Self {
        let (root, part) = (2.0 * f64::sqrt(10.0 / 7.0), 13.0 * f64::sqrt(70.0));
        let (near, far) = (f64::sqrt(5.0 - root) / 3.0, f64::sqrt(5.0 + root) / 3.0);
        let (of_near, of_far) = ((322.0 + part) / 900.0, (322.0 - part) / 900.0);
        let nodes = [
            (-far, of_far),
            (-near, of_near),
            (0.0, 128.0 / 225.0),
            (near, of_near),
            (far, of_far),
        ];
        Self {
            ky: nodes.iter().map(|n| 0.5 + 0.5 * n.0).collect(),
            weight: nodes.iter().map(|n| 0.5 * n.1).collect(),
        }
    }
}

/// An incident wave, half s and half p, and the shares of its power.
#[derive(Debug, Clone, PartialEq)]
pub struct Wave {
    /// Where it comes from.
    pub side: Side,
    /// Number of its ky.
    pub line: usize,
    /// Its kx in units of the spacing of the supercell's orders, λ/(KΛ).
    pub node: i32,
    /// Its angle to the normal in the plane across the grooves, degrees.
    pub angle_deg: f64,
    /// Flux that it stands for in diffuse light, in any unit.
    pub weight: f64,
    /// Share that does not pass.
    pub reflected: f64,
    /// Share that passes into each bin of the angle to the normal in the plane across the grooves.
    pub transmitted: Vec<f64>,
}

impl Wave {
    fn place(&self) -> (Side, usize, i32) {
        (self.side, self.line, self.node)
    }

    /// Share that passes.
    pub fn passes(&self) -> f64 {
        self.transmitted.iter().sum()
    }
}

/// How the orders of one Bloch wavevector are numbered among the waves of a supercell.
struct Numbering {
    /// Node of order 0.
    first: i32,
    /// Nodes from order to order.
    step: i32,
    /// Nodes lie so far apart in kx, units of k0.
    spacing: f64,
}

impl Numbering {
    fn node(&self, order: i32) -> i32 {
        self.first + self.step * order
    }

    fn angle_deg(&self, (stack, side): (&Stack, Side), order: i32, ky: f64) -> f64 {
        let kx = f64::from(self.node(order)) * self.spacing;
        let n = stack.index(side).re;
        let kz = f64::max(0.0, n * n - kx * kx - ky * ky).sqrt();
        kx.atan2(kz).to_degrees()
    }
}

/// Every wave of the problems of one Bloch wavevector.
fn read(
    stack: &Stack,
    solved: &[Scattering],
    lines: &Lines,
    numbering: &Numbering,
    waves: &mut Vec<Wave>,
) {
    for (line, scattering) in solved.iter().enumerate() {
        let angle = |side, order| numbering.angle_deg((stack, side), order, lines.ky[line]);
        for (side, other) in [(Side::Top, Side::Bottom), (Side::Bottom, Side::Top)] {
            for from in scattering.orders(side) {
                let share = |to: Side, order: i32| -> f64 {
                    let of = |pol| scattering.efficiency((side, from, pol), (to, order));
                    0.5 * Pol::BOTH.into_iter().map(of).sum::<f64>()
                };
                let mut transmitted = vec![0.0; BINS];
                for to in scattering.orders(other) {
                    let bin = (angle(other, to) + 90.0) / BIN_DEG;
                    transmitted[(bin as usize).min(BINS - 1)] += share(other, to);
                }
                waves.push(Wave {
                    side,
                    line,
                    node: numbering.node(from),
                    angle_deg: angle(side, from),
                    weight: lines.weight[line],
                    reflected: scattering.orders(side).map(|m| share(side, m)).sum(),
                    transmitted,
                });
            }
        }
    }
}

/// All waves of a supercell of `teeth` periods with orders -`highest`..=`highest` for each of them.
///
/// # Errors
/// Those of the solver.
pub fn supercell(stack: &Stack, teeth: usize, highest: usize, lines: &Lines) -> Result<Vec<Wave>> {
    ensure!(!teeth.is_multiple_of(2), "an odd number of teeth, got {teeth}");
    let truncation = Truncation::new(teeth * highest + teeth / 2)?;
    let solved =
        solve_symmetric_line(stack, SymmetricBloch::Centre, &lines.ky, truncation, &no_progress)?;
    let numbering = Numbering { first: 0, step: 1, spacing: 1.0 / stack.period_per_wavelength() };
    let mut waves = Vec::new();
    read(stack, &solved, lines, &numbering, &mut waves);
    waves.sort_by_key(Wave::place);
    Ok(waves)
}

/// The waves of a supercell of `teeth` periods on a grating of one tooth.
///
/// # Errors
/// Those of the solver.
pub fn grating(stack: &Stack, teeth: usize, highest: usize, lines: &Lines) -> Result<Vec<Wave>> {
    let truncation = Truncation::new(highest)?;
    let spacing = 1.0 / (stack.period_per_wavelength() * teeth as f64);
    let by = (teeth / 2) as i32;
    let mut waves = Vec::new();
    for first in -by..=by {
        let solved = if first == 0 {
            let at = SymmetricBloch::Centre;
            solve_symmetric_line(stack, at, &lines.ky, truncation, &no_progress)?
        } else {
            let kx0 = f64::from(first) * spacing;
            solve_line(stack, kx0, &lines.ky, truncation, &no_progress)?
        };
        let numbering = Numbering { first, step: teeth as i32, spacing };
        read(stack, &solved, lines, &numbering, &mut waves);
    }
    waves.sort_by_key(Wave::place);
    Ok(waves)
}

/// What one tooth does: K times what a supercell with one tooth and K - 1 periods of plane does,
/// less K - 1 times what a plane does. The shares of a wave still add up to 1; in the direction of
/// the plane's own ray they may be negative, by what the tooth takes away.
///
/// # Panics
/// If the two are not the same waves.
pub fn of_one_tooth(with_plane: &[Wave], plane: &[Wave], teeth: usize) -> Vec<Wave> {
    assert_eq!(with_plane.len(), plane.len(), "results of the same waves");
    let teeth = teeth as f64;
    let of = |x: f64, y: f64| teeth * x - (teeth - 1.0) * y;
    let wave = |(x, y): (&Wave, &Wave)| Wave {
        reflected: of(x.reflected, y.reflected),
        transmitted: x.transmitted.iter().zip(&y.transmitted).map(|(&x, &y)| of(x, y)).collect(),
        ..x.clone()
    };
    with_plane.iter().zip(plane).map(wave).collect()
}
