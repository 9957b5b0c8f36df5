// SPDX-License-Identifier: MIT OR Apache-2.0
//! RCWA against boundary integrals on the paper's rings, in planar mount, at one Bloch wavevector.
//!
//! The two methods share only the corners of the relief. The boundary integrals are more accurate
//! by many digits, as their energy balance shows, which nothing in them enforces. The tolerances
//! are the error of RCWA at these orders and slices, about the same in TE and TM with slanted
//! walls.

use batwing_tests::solver_comparison::{KX0, RINGS, by_integrals, by_rcwa, difference, ring};
use batwing_tests::tables::resolution;
use gratings::boundary_integral::{Fineness, Grating};
use rcwa::{Pol, Side};

#[test]
#[ignore = "nightly: four rings by two methods (10 s)"]
fn nightly_both_solvers_agree_on_the_rings() {
    for (file, band) in RINGS {
        let (ring, interface) = ring(file, band).expect("a ring");
        let (top, bottom) = (interface.n_top.re, interface.n_bottom.re);
        let grating = Grating::of_relief(&interface.relief, interface.wavelength, top, bottom)
            .expect("a surface");
        let exact = grating.solve(KX0, Fineness::default()).expect("a solution");
        assert!(exact.worst_balance() < 1e-9, "{file} {ring}: {:.1e}", exact.worst_balance());
        assert!(reflected_totally(&exact) > 5, "{file} {ring}: waves beyond the critical angle");
        let resolution = resolution(&interface, 20, 96).expect("a resolution");
        let approximate = by_rcwa(&interface, KX0, &resolution).expect("efficiencies");
        for (pol, order, mean_square, transmitted) in
            [(Pol::S, 2.5e-3, 1e-4, 1e-3), (Pol::P, 2.5e-3, 1e-4, 1e-3)]
        {
            let got = difference(&exact, &approximate, pol);
            assert!(
                got.order < order && got.mean_square < mean_square && got.transmitted < transmitted,
                "{file} {ring}, {pol:?}: {got:?}"
            );
        }
    }
}

/// Incident waves from the silicone whose own angle is beyond the critical one.
fn reflected_totally(solution: &gratings::boundary_integral::Solution) -> usize {
    solution.orders(Side::Top).iter().filter(|o| o.kx.abs() > 1.0).count()
}

#[test]
#[ignore = "slow: 5 s"]
fn half_as_many_nodes_again_change_no_digit_that_is_relied_on() {
    let (_, interface) = ring("d1.toml", 8).expect("a ring");
    let (solution, moved) = by_integrals(&interface, 0.0291).expect("a solution");
    assert!(
        moved < 1e-10 && solution.worst_balance() < 1e-10,
        "{moved:.1e}, {:.1e}",
        solution.worst_balance()
    );
}
