// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices: the action of an order on the two components of the electric vector.
//!
//! In: a solved [`Scattering`], an incident order. Out: for every order that leaves, the 2 × 2
//! complex matrix J with (E_s, E_p) out = J (E_s, E_p) in. Both pairs belong to the bases of
//! `docs/explanation/conventions.md`: s = z × k∥/|k∥| and p = s × k/|k| with the wave's own k;
//! phases are those at the top plane of the structure for waves in the top half-space and at its
//! bottom plane for waves in the bottom half-space.
//!
//! With every row multiplied by the root of its flux and divided by that of the incident wave, the
//! matrices of all channels make up a scattering matrix that is unitary without loss, and symmetric
//! but for signs: reversing a wave turns s into -s and leaves p, so that the elements between s and
//! p change sign in reciprocity, and in a mirror whose plane holds z \[Petit1980\].

use crate::error::Error;
use crate::scattering::Scattering;
use crate::wave::{Pol, Side};
use num_complex::Complex64;

/// A matrix over (out, in), s before p.
pub type Matrix = [[Complex64; 2]; 2];

/// The Jones matrix between one incident and one outgoing order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jones {
    /// Half-space that the wave leaves to.
    pub side: Side,
    /// Order of the wave.
    pub order: i32,
    /// Amplitude out (row) for a unit amplitude in (column), s before p.
    pub matrix: Matrix,
    /// Power through z = const by unit amplitude out, in s and in p, over that of the incident
    /// wave.
    pub flux: [f64; 2],
}

impl Jones {
    /// Amplitudes (s, p) of the order for incident amplitudes (s, p).
    pub fn apply(&self, incident: [Complex64; 2]) -> [Complex64; 2] {
        self.matrix.map(|row| row[0] * incident[0] + row[1] * incident[1])
    }

    /// Efficiencies in s and in p, for incident amplitudes (s, p) of any
    /// size but 0.
    pub fn efficiencies(&self, incident: [Complex64; 2]) -> [f64; 2] {
        let power = incident[0].norm_sqr() + incident[1].norm_sqr();
        let out = self.apply(incident);
        [0, 1].map(|q| self.flux[q] * out[q].norm_sqr() / power)
    }

    /// The matrix between waves of unit power through z = const: |element|² is an efficiency.
    pub fn power_normalised(&self) -> Matrix {
        [0, 1].map(|q| self.matrix[q].map(|element| element * self.flux[q].sqrt()))
    }
}

impl Scattering {
    /// The Jones matrix from one order to another; `None` if light cannot come by the one or does
    /// not leave by the other.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use rcwa::{Bloch, Side, Stack, Truncation, solve};
    ///
    /// // Glass under 60°: r_s = -0.42 and r_p = 0.0014 (p is measured along s × k).
    /// let (air, glass) = (Complex64::from(1.0), Complex64::from(1.5));
    /// let stack = Stack::new(0.55, 1.0, air, glass, Vec::new())?;
    /// let bloch = Bloch::from_angles(&stack, Side::Top, 60f64.to_radians(), 0.3);
    /// let scattering = solve(&stack, bloch, Truncation::new(2)?)?;
    /// let r = scattering.jones((Side::Top, 0), (Side::Top, 0)).expect("both propagate");
    /// assert!((r.matrix[0][0].re + 0.420_2).abs() < 1e-4 && r.matrix[0][1].norm() < 1e-12);
    /// # Ok::<(), rcwa::Error>(())
    /// ```
    pub fn jones(&self, from: (Side, i32), to: (Side, i32)) -> Option<Jones> {
        let (source, target) = (self.source(from.0, from.1)?, self.channel(to.0, to.1)?);
        let element = |q: Pol, p: Pol| self.amplitude((from.0, from.1, p), (to.0, to.1, q));
        let matrix = Pol::BOTH.map(|q| Pol::BOTH.map(|p| element(q, p)));
        Some(Jones {
            side: to.0,
            order: to.1,
            matrix,
            // Light only comes from half-spaces without loss, where both polarisations carry kz.
            flux: target.flux.map(|flux| flux / source.flux[0]),
        })
    }

    /// The Jones matrices of all orders that leave, top before bottom, by ascending order.
    ///
    /// # Errors
    /// Light cannot come by the order `from`.
    pub fn jones_of_all(&self, from: (Side, i32)) -> Result<Vec<Jones>, Error> {
        if self.source(from.0, from.1).is_none() {
            return Err(Error::Evanescent { order: from.1, side: from.0 });
        }
        let orders = Side::BOTH
            .into_iter()
            .flat_map(|side| self.orders(side).map(move |order| (side, order)));
        Ok(orders.filter_map(|to| self.jones(from, to)).collect())
    }
}
