// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering of light by a sphere that absorbs nothing: Mie's series.
//!
//! With x = π d n/λ, m = n_sphere/n, Riccati-Bessel functions ψ and ξ = ψ - iχ, and D_n the
//! logarithmic derivative of ψ_n at m x, the coefficients are \[Bohren, Huffman 1983, eq. 4.88\]
//!
//! a_n = ((D_n/m + n/x) ψ_n - ψ_{n-1})/((D_n/m + n/x) ξ_n - ξ_{n-1}),
//! b_n = ((m D_n + n/x) ψ_n - ψ_{n-1})/((m D_n + n/x) ξ_n - ξ_{n-1}).
//!
//! D by downward recurrence, ψ and χ upwards, as many terms as \[Wiscombe 1980\] takes. As the
//! sphere absorbs nothing, all three are real.
//!
//! \[Bohren, Huffman 1983\] C. F. Bohren, D. R. Huffman, *Absorption and Scattering of Light by
//! Small Particles*, chapter 4.
//!
//! \[Wiscombe 1980\] W. J. Wiscombe, *Improved Mie scattering algorithms*, Appl. Opt. 19, 1505.

use num_complex::Complex64;

use crate::error::{Error, check, positive};

/// A homogeneous sphere at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Diameter, µm.
    pub diameter_um: f64,
    /// Refractive index, real.
    pub index: f64,
}

/// The series of a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Mie {
    size: f64,
    relative_index: f64,
    /// a_n and b_n from n = 1 on.
    terms: Vec<[Complex64; 2]>,
}

impl Mie {
    /// Largest size parameter x.
    pub const MAX_SIZE: f64 = 1000.0;

    /// The series of a sphere in a medium of this index, for a wavelength in vacuum.
    ///
    /// # Errors
    /// Numbers that are not above 0, and a size parameter above [`Self::MAX_SIZE`].
    pub fn new(sphere: &Sphere, index: f64, wavelength_nm: f64) -> Result<Self, Error> {
        positive("diameter of a sphere, µm", sphere.diameter_um)?;
        positive("refractive index of a sphere", sphere.index)?;
        positive("refractive index around a sphere", index)?;
        positive("wavelength, nm", wavelength_nm)?;
        let size = std::f64::consts::PI * sphere.diameter_um * 1e3 * index / wavelength_nm;
        let expected = "at most 1000 (π · diameter · index around it/wavelength)";
        check("size parameter of a sphere", size, expected, size <= Self::MAX_SIZE)?;
        Ok(Self::of_size(size, sphere.index / index))
    }

    /// The series for size parameter `x` and relative index `m`.
    fn of_size(x: f64, m: f64) -> Self {
        let count = (x + 4.05 * x.cbrt() + 2.0).ceil() as usize;
        let y = m * x;
        // Well beyond y, below which the recurrence forgets nothing of how it began.
        let begin = count.max((y + 8.0 * y.cbrt()).ceil() as usize) + 16;
        let mut derivative = vec![0.0; begin + 1];
        for n in (1..=begin).rev() {
            let ratio = n as f64 / y;
            derivative[n - 1] = ratio - 1.0 / (derivative[n] + ratio);
        }
        // ψ_{n-1}, ψ_n and χ_{n-1}, χ_n.
        let mut psi = [x.cos(), x.sin()];
        let mut chi = [-x.sin(), x.cos()];
        let mut terms = Vec::with_capacity(count);
        for (n, derivative) in derivative.iter().enumerate().take(count + 1).skip(1) {
            let forward = (2 * n - 1) as f64 / x;
            psi = [psi[1], forward * psi[1] - psi[0]];
            chi = [chi[1], forward * chi[1] - chi[0]];
            let xi = [0, 1].map(|k| Complex64::new(psi[k], -chi[k]));
            let ratio = n as f64 / x;
            let term = |factor: f64| {
                let along = factor + ratio;
                (along * psi[1] - psi[0]) / (along * xi[1] - xi[0])
            };
            terms.push([term(derivative / m), term(derivative * m)]);
        }
        Self { size: x, relative_index: m, terms }
    }

    /// The bits of size parameter and relative index, from which all follows.
    pub(super) fn key(&self) -> [u64; 2] {
        [self.size.to_bits(), self.relative_index.to_bits()]
    }

    /// The size parameter.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Scattering cross section over π d²/4.
    pub fn scattering_efficiency(&self) -> f64 {
        let terms = (1..).zip(&self.terms);
        let sum: f64 =
            terms.map(|(n, [a, b])| f64::from(2 * n + 1) * (a.norm_sqr() + b.norm_sqr())).sum();
        2.0 / (self.size * self.size) * sum
    }

    /// Mean cosine of the scattering angle.
    pub fn mean_cosine(&self) -> f64 {
        let mut sum = 0.0;
        for (k, [a, b]) in self.terms.iter().enumerate() {
            let n = (k + 1) as f64;
            sum += (2.0 * n + 1.0) / (n * (n + 1.0)) * (a * b.conj()).re;
            if let Some([c, d]) = self.terms.get(k + 1) {
                sum += n * (n + 2.0) / (n + 1.0) * (a * c.conj() + b * d.conj()).re;
            }
        }
        4.0 / (self.size * self.size) * sum / self.scattering_efficiency()
    }

    /// (|S₁|² + |S₂|²)/2 at the angle of this cosine.
    pub fn intensity(&self, cosine: f64) -> f64 {
        let (mut before, mut pi) = (0.0, 1.0);
        let (mut s1, mut s2) = (Complex64::ZERO, Complex64::ZERO);
        for (k, [a, b]) in self.terms.iter().enumerate() {
            let n = (k + 1) as f64;
            let tau = n * cosine * pi - (n + 1.0) * before;
            let factor = (2.0 * n + 1.0) / (n * (n + 1.0));
            s1 += factor * (a * pi + b * tau);
            s2 += factor * (a * tau + b * pi);
            (before, pi) = (pi, ((2.0 * n + 1.0) * cosine * pi - (n + 1.0) * before) / n);
        }
        0.5 * (s1.norm_sqr() + s2.norm_sqr())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::phase::PhaseTable;

    /// Q_sca and g of W. J. Wiscombe, *Mie scattering calculations*, NCAR/TN-140+STR (1979), the
    /// tables of its test program, and Q_sca of the example of Bohren and Huffman's appendix A.
    #[test]
    fn efficiencies_and_mean_cosines_are_those_published() {
        for (m, x, efficiency, g) in [
            (0.75, 10.0, 2.232_265, 0.896_473),
            (0.75, 1000.0, 1.997_908, 0.844_944),
            (1.5, 10.0, 2.881_999, 0.742_913),
            (1.5, 100.0, 2.094_388, 0.818_246),
            (1.5, 1000.0, 2.013_945, 0.827_882),
        ] {
            let mie = Mie::of_size(x, m);
            let found = [mie.scattering_efficiency(), mie.mean_cosine()];
            let off = [found[0] - efficiency, found[1] - g].map(f64::abs);
            assert!(off[0] < 1e-6 && off[1] < 1e-6, "{m} {x} {found:?}");
        }
        let size = std::f64::consts::TAU * 0.525 / 0.6328;
        let example = Mie::of_size(size, 1.55).scattering_efficiency();
        assert!((example - 3.105_43).abs() < 1e-5, "{example}");
    }

    /// The table keeps the mean cosine, and the optical theorem holds: Q = 4 Re S(0)/x².
    #[test]
    fn the_table_of_a_sphere_has_its_mean_cosine() {
        for (m, x) in [(1.1, 0.2), (1.02, 3.0), (1.33, 20.0), (1.5, 100.0), (1.8, 400.0)] {
            let mie = Mie::of_size(x, m);
            let table = PhaseTable::of_sphere(&mie).expect("a table");
            let g = mie.mean_cosine();
            assert!((table.mean_cosine() - g).abs() < 1e-4, "{m} {x}: {} {g}", table.mean_cosine());
            let forward: f64 =
                (1..).zip(&mie.terms).map(|(n, [a, b])| f64::from(2 * n + 1) * (a + b).re).sum();
            let extinction = 2.0 / (x * x) * forward;
            assert!((extinction / mie.scattering_efficiency() - 1.0).abs() < 1e-10, "{m} {x}");
        }
    }
}
