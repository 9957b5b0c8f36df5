// SPDX-License-Identifier: MIT OR Apache-2.0
//! Energy at many orders and slices, on the grating on which public solvers lose it: a silicone
//! triangle 10 µm wide and 3 µm high at 550 nm.
//!
//! Solves random Bloch wavevectors at 321 orders and 512 slices (or what the arguments say), every
//! direction that they hold, from both sides, in s and p, and prints the largest |R + T - 1|.
//!
//! ```sh
//! cargo run --release -p batwing-rcwa --example energy -- 321 512 1 3
//! ```
//!
//! Arguments: orders, slices, kx0, ky for each of them. The wavevectors are the same in every run.
//! With `tables` as a fifth argument the lines are those of tables, kx0 = 0 and half an order
//! spacing by turns, in real arithmetic, on layers that follow the slanted sides, as many as
//! slices.

#![expect(clippy::print_stdout, reason = "a program that prints its result")]

use num_complex::Complex64;
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::{Pol, Side, SymmetricBloch, Truncation, solve_line, solve_symmetric_line};

const WAVELENGTH: f64 = 0.55;
const PERIOD: f64 = 10.0;
const SILICONE: f64 = 1.41;

/// Numbers in 0..1 that look random [SplitMix64 of Steele, Lea and Flood].
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let as_tables = words.last().is_some_and(|word| word == "tables");
    if as_tables {
        words.pop();
    }
    let mut numbers = Vec::new();
    for word in words {
        numbers.push(word.parse::<usize>()?);
    }
    let [orders, slices, lines, each] = match numbers[..] {
        [] => [321, 512, 1, 3],
        [orders, slices, lines, each] => [orders, slices, lines, each],
        _ => return Err("expected four numbers: orders, slices, kx0, ky for each of them".into()),
    };
    let relief = shapes::triangle(PERIOD, [5.0, 3.0], Materials::lossless(SILICONE, 1.0))?;
    let truncation = Truncation::new(orders / 2)?;
    let plan = relief.slice_plan(if as_tables { slices / 2 } else { slices });
    let interface = Interface {
        relief,
        wavelength: WAVELENGTH,
        n_top: SILICONE.into(),
        n_bottom: Complex64::ONE,
    };
    let stack = if as_tables {
        interface.stacks(&Resolution { truncation, plan })?.0
    } else {
        interface.stack(&plan)?
    };
    let mut random = Numbers(1);
    let (mut waves, mut worst, mut at) = (0, 0.0_f64, String::new());
    for line in 0..lines {
        let mut kx0 = random.next() * WAVELENGTH / PERIOD;
        let ky: Vec<f64> = (0..each).map(|_| SILICONE * random.next()).collect();
        let solved = if as_tables {
            let at = [SymmetricBloch::Centre, SymmetricBloch::Edge][line % 2];
            kx0 = at.kx0(&stack);
            solve_symmetric_line(&stack, at, &ky, truncation, &no_progress)?
        } else {
            solve_line(&stack, kx0, &ky, truncation, &no_progress)?
        };
        for scattering in solved {
            for side in [Side::Top, Side::Bottom] {
                for order in scattering.orders(side) {
                    for pol in Pol::BOTH {
                        let from = (side, order, pol);
                        let kept = scattering.total(from, Side::Top)
                            + scattering.total(from, Side::Bottom);
                        waves += 1;
                        if (kept - 1.0).abs() > worst {
                            worst = (kept - 1.0).abs();
                            at = format!("{from:?} at ({kx0:.4}, {:.4})", scattering.bloch().ky);
                        }
                    }
                }
            }
        }
    }
    println!(
        "{} orders, {slices} slices, {} wavevectors, {waves} incident waves: |R + T - 1| at most {worst:.1e}, {at}",
        truncation.count(),
        lines * each
    );
    Ok(())
}
