// SPDX-License-Identifier: MIT OR Apache-2.0
//! Near fields: E and H at any point in and around a structure, for one incident wave.
//!
//! In: a [`Stack`], one [`Incident`] wave, a [`Grid`] of points. Out: complex E and H at each of
//! them, and the power through every plane z = const. Only this module looks inside: everything
//! else of the crate needs the waves that leave, and no more.
//!
//! On a plane the tangential Fourier coefficients are E = N t, H = (1 - N) t with t = E + H. A
//! passive structure has Re(Eᴴ H) ≥ 0, so that N is bounded by 1 whatever lies below: |t|² ≥ |E|² +
//! |H|².
//!
//! Going up, `slab` carries N through slices so thin that nothing grows by more than a few e-folds.
//! Going down, t below a slice follows from t above it by a matrix that does not grow either. Any
//! thickness is so stable, at the cost of one inverse a slice. Some states on the way up are saved,
//! the others computed again.
//!
//! Inside a layer the normal displacement and not Ex is summed and then divided by ε(x), since it
//! is what is continuous at the walls; so Ex has its jumps where they belong and does not ring
//! \[Lalanne1998\]. Lengths are in the unit of the stack, E in that of the incident amplitudes, H
//! with an impedance of free space of 1.

mod evaluate;
mod planes;
mod slab;
mod waves;

use crate::error::Error;
use crate::guard;
use crate::orders::{Bloch, Truncation, channels};
use crate::progress::Progress;
use crate::relief::Layer;
use crate::stack::Stack;
use crate::wave::{Pol, Side};
use num_complex::Complex64;

/// The wave that falls on the structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Half-space that it comes from.
    pub side: Side,
    /// Order at the Bloch wavevector.
    pub order: i32,
    /// Amplitudes of its electric vector in s and in p, with their phase at the first plane of the
    /// structure.
    pub amplitudes: [Complex64; 2],
}

impl Incident {
    /// Order 0 from `side`, of unit amplitude.
    pub fn unit(side: Side, pol: Pol) -> Self {
        let mut amplitudes = [Complex64::ZERO; 2];
        amplitudes[pol.number()] = Complex64::ONE;
        Self { side, order: 0, amplitudes }
    }
}

/// Points: every x with every z, at y = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Places along the grating vector, any; the structure repeats with its period.
    pub x: Vec<f64>,
    /// Depths below the top plane of the structure; negative ones lie in the top half-space.
    pub z: Vec<f64>,
}

/// The field at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index n + ik there.
    pub index: Complex64,
    /// Ex, Ey, Ez.
    pub electric: [Complex64; 3],
    /// Hx, Hy, Hz.
    pub magnetic: [Complex64; 3],
}

impl Sample {
    /// |E|².
    pub fn intensity(&self) -> f64 {
        self.electric.iter().map(Complex64::norm_sqr).sum()
    }

    /// Mean of the Poynting vector over time, ½ Re(E × H*); that of a plane wave of unit amplitude
    /// in a medium of index n is n/2 long.
    pub fn poynting(&self) -> [f64; 3] {
        let (e, h) = (self.electric, self.magnetic.map(|h| h.conj()));
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| 0.5 * (e[i] * h[j] - e[j] * h[i]).re)
    }
}

/// Fields on a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// The points.
    pub grid: Grid,
    /// Samples, all x of the first z first.
    pub samples: Vec<Sample>,
    /// Power through the plane at each z, in the sense in which the incident wave travels, per
    /// incident power.
    pub flux: Vec<f64>,
    /// Share of the power that goes back to where the wave came from.
    pub reflected: f64,
    /// Share of the power that passes the last plane of the structure.
    pub transmitted: f64,
}

/// The fields of one incident wave on a grid.
///
/// ```
/// use num_complex::Complex64;
/// use rcwa::field::{Grid, Incident, field};
/// use rcwa::relief::Layer;
/// use rcwa::no_progress;
/// use rcwa::{Bloch, Pol, Side, Stack, Truncation};
///
/// // A quarter wave of index √1.5 on glass: nothing comes back, so |E|² is 1 down to it.
/// let film = Layer::uniform(0.25 * 0.6 / 1.5f64.sqrt(), 1.5f64.sqrt().into())?;
/// let stack = Stack::new(0.6, 1.0, Complex64::from(1.0), Complex64::from(1.5), vec![film])?;
/// let incident = Incident::unit(Side::Top, Pol::S);
/// let grid = Grid { x: vec![0.0], z: vec![-3.0, -0.4, 0.0] };
/// let bloch = Bloch::from_angles(&stack, Side::Top, 0.0, 0.0);
/// let field = field(&stack, bloch, Truncation::new(0)?, &incident, grid, &no_progress)?;
/// assert!(field.samples.iter().all(|s| (s.intensity() - 1.0).abs() < 1e-12));
/// assert!((field.transmitted - 1.0).abs() < 1e-12);
/// # Ok::<(), rcwa::Error>(())
/// ```
///
/// # Errors
/// A Bloch wavevector or a position that is not finite, amplitudes that are not finite or all 0, an
/// incident order that does not propagate, eigenproblems that fail; [`Error::Stopped`] if
/// `progress`, which counts layers, once or twice each, says so.
pub fn field(
    stack: &Stack,
    bloch: Bloch,
    truncation: Truncation,
    incident: &Incident,
    grid: Grid,
    progress: &Progress<'_>,
) -> Result<Field, Error> {
    check(bloch, incident, &grid)?;
    guard::check(truncation, [stack.layers().len(), 1, 1], false)?;
    guard::check_matrices(truncation, planes::matrices(stack, truncation))?;
    let depth: f64 = stack.layers().iter().map(|l| l.thickness).sum();
    match incident.side {
        Side::Top => from_top(stack, bloch, truncation, incident, grid, progress),
        Side::Bottom => {
            // Seen in the mirror z → depth - z, light comes from the top, and p, which is s × k,
            // has changed its sign.
            let mirror = in_mirror(stack)?;
            let [s, p] = incident.amplitudes;
            let image = Incident { side: Side::Top, amplitudes: [s, -p], ..*incident };
            let z = grid.z.iter().map(|z| depth - z).collect();
            let seen = Grid { x: grid.x.clone(), z };
            let at_bottom = |error| match error {
                Error::Evanescent { order, .. } => Error::Evanescent { order, side: Side::Bottom },
                other => other,
            };
            let mut found =
                from_top(&mirror, bloch, truncation, &image, seen, progress).map_err(at_bottom)?;
            for sample in &mut found.samples {
                let ([ex, ey, ez], [hx, hy, hz]) = (sample.electric, sample.magnetic);
                sample.electric = [ex, ey, -ez];
                sample.magnetic = [-hx, -hy, hz];
            }
            Ok(Field { grid, ..found })
        }
    }
}

fn check(bloch: Bloch, incident: &Incident, grid: &Grid) -> Result<(), Error> {
    bloch.check()?;
    let [s, p] = incident.amplitudes;
    let power = s.norm_sqr() + p.norm_sqr();
    if !(power.is_finite() && power > 0.0) {
        return Err(Error::Amplitudes { s, p });
    }
    match grid.x.iter().chain(&grid.z).find(|v| !v.is_finite()) {
        Some(&got) => Err(Error::Position { got }),
        None => Ok(()),
    }
}

fn in_mirror(stack: &Stack) -> Result<Stack, Error> {
    let layers: Vec<Layer> = stack.layers().iter().rev().cloned().collect();
    Stack::new(
        stack.wavelength(),
        stack.period(),
        stack.index(Side::Bottom),
        stack.index(Side::Top),
        layers,
    )
}

fn from_top(
    stack: &Stack,
    bloch: Bloch,
    truncation: Truncation,
    incident: &Incident,
    grid: Grid,
    progress: &Progress<'_>,
) -> Result<Field, Error> {
    let refused = Error::Evanescent { order: incident.order, side: Side::Top };
    let ratio = stack.period_per_wavelength();
    let n = stack.index(Side::Top);
    if n.im != 0.0 {
        return Err(refused);
    }
    let open = channels(n, ratio, bloch, truncation.orders());
    let Some(channel) = open.iter().find(|c| c.order == incident.order) else {
        return Err(refused);
    };
    let waves = waves::Waves::new(stack, bloch, truncation);
    let power = channel.kz.re * incident.amplitudes.iter().map(Complex64::norm_sqr).sum::<f64>();
    let mut points = evaluate::Points::new(stack, &waves, &grid, power);
    let tangential = planes::solve(stack, &waves, incident, &mut points, progress)?;
    Ok(Field {
        reflected: waves.upward_power(&open, incident, &tangential.top) / power,
        transmitted: tangential.bottom.power() / power,
        samples: points.samples,
        flux: points.flux,
        grid,
    })
}
