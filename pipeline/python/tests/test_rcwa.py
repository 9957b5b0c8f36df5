# SPDX-License-Identifier: MIT OR Apache-2.0
"""Physics against closed forms and laws, and one direction against many."""

from __future__ import annotations

import copy
import json
import pickle
import subprocess
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import batwing
from batwing import rcwa

WAVELENGTH = 0.55


def bare(n1: complex, n2: complex) -> rcwa.Grating:
    """An interface without relief."""
    return rcwa.Grating(rcwa.Relief(1.0, 0.1, n1), n1, n2)


def sawtooth() -> rcwa.Grating:
    return rcwa.Grating(rcwa.Relief.triangle(2.0, (1.7, 0.6), ridge=1.41, groove=1.0), 1.41, 1.0)


def fresnel(n1: complex, n2: complex, theta: np.ndarray) -> np.ndarray:
    """Reflectance in s and p [Born and Wolf, 1.5.2]."""
    cos1 = np.cos(theta)
    cos2 = np.sqrt(1 - (n1 / n2 * np.sin(theta)) ** 2 + 0j)
    s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2)
    p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2)
    return np.stack([np.abs(s) ** 2, np.abs(p) ** 2], axis=-1)


@pytest.mark.parametrize("n2", [1.5, 1.41, 0.2 + 3.1j])
def test_a_bare_interface_reflects_as_fresnel_says(n2: complex) -> None:
    theta = np.linspace(0, 85, 18)
    found = rcwa.solve(bare(1.0, n2), WAVELENGTH, theta, 33.0, "both", orders=3)
    expected = fresnel(1.0, n2, np.radians(theta))
    np.testing.assert_allclose(found.total_reflected, expected, atol=1e-12)


def test_a_slab_reflects_as_airy_says() -> None:
    n, d = 1.7, 0.31
    slab = rcwa.Relief.polygon(1.0, np.array([[0, 0], [1, 0], [1, d], [0, d]]), n, 1.0)
    theta = np.array([0.0, 30.0, 60.0])
    found = rcwa.solve(rcwa.Grating(slab, 1.0, 1.0), WAVELENGTH, theta, 0.0, "both", orders=3)
    cos1, cos2 = np.cos(np.radians(theta)), np.sqrt(1 - (np.sin(np.radians(theta)) / n) ** 2)
    phase = 2 * np.pi * n * d * cos2 / WAVELENGTH
    r = np.stack([(cos1 - n * cos2) / (cos1 + n * cos2), (n * cos1 - cos2) / (n * cos1 + cos2)], -1)
    whole = r * (1 - np.exp(2j * phase))[:, None] / (1 - r**2 * np.exp(2j * phase)[:, None])
    np.testing.assert_allclose(found.total_reflected, np.abs(whole) ** 2, atol=1e-12)


def test_fine_lamellae_are_an_effective_medium() -> None:
    """Period far below the wavelength: n_s^2 = mean of n^2, 1/n_p^2 = mean of 1/n^2 [Rytov 1956]."""
    fill, n, depth = 0.4, 1.5, 0.2
    period = WAVELENGTH / 40
    grating = rcwa.Grating(rcwa.Relief.lamellar(period, depth, fill, n, 1.0), 1.0, n)
    found = rcwa.solve(grating, WAVELENGTH, polarisation="both", orders=20)
    effective = [
        np.sqrt(fill * n**2 + 1 - fill),
        1 / np.sqrt(fill / n**2 + 1 - fill),
    ]
    for got, index in zip(found.total_reflected, effective):
        phase = 2 * np.pi * index * depth / WAVELENGTH
        r1, r2 = (1 - index) / (1 + index), (index - n) / (index + n)
        r = (r1 + r2 * np.exp(2j * phase)) / (1 + r1 * r2 * np.exp(2j * phase))
        assert abs(got - abs(r) ** 2) < 2e-3


def test_energy_is_kept_from_both_sides_and_order_directions_obey_the_grating_equation() -> None:
    grating = sawtooth()
    theta, phi = np.meshgrid(np.linspace(-70, 70, 9), [0.0, 25.0, 90.0])
    ends: list[tuple[rcwa.Side, float, float]] = [("top", 1.41, 1.0), ("bottom", 1.0, 1.41)]
    for side, n_in, n_out in ends:
        found = rcwa.solve(grating, WAVELENGTH, theta, phi, orders=14, slices=12, side=side)
        total = found.total_reflected + found.total_transmitted
        np.testing.assert_allclose(total, 1.0, atol=1e-10)
        assert found.reflected.shape == (3, 9, found.orders_reflected.size)
        out, azimuth = found.directions("transmitted")
        kx = n_in * np.sin(np.radians(theta)) * np.cos(np.radians(phi))
        order = int(found.orders_transmitted[0])
        there = n_out * np.sin(np.radians(out[..., 0])) * np.cos(np.radians(azimuth[..., 0]))
        expected = kx + order * WAVELENGTH / 2.0
        propagates = np.isfinite(there)
        np.testing.assert_allclose(there[propagates], expected[propagates], atol=1e-12)
        assert (found.transmitted[~np.isfinite(out)] == 0).all()
        assert (found.transmitted[np.isfinite(out)] > 0).mean() > 0.9


def test_many_directions_are_those_one_by_one() -> None:
    grating = sawtooth()
    rng = np.random.default_rng(5)
    theta, phi = rng.uniform(-80, 80, 40), rng.uniform(0, 360, 40)
    together = rcwa.solve(grating, WAVELENGTH, theta, phi, "both", orders=16, slices=8)
    for i in range(0, 40, 7):
        alone = rcwa.solve(grating, WAVELENGTH, theta[i], phi[i], "both", orders=16, slices=8)
        shift = int(alone.orders_reflected[0] - together.orders_reflected[0])
        part = together.reflected[i, :, shift : shift + alone.orders_reflected.size]
        np.testing.assert_allclose(part, alone.reflected, atol=1e-9)


def test_directions_of_one_bloch_wavevector_are_solved_once() -> None:
    grating = sawtooth()
    spacing = WAVELENGTH / 2.0
    kx = 0.07 + spacing * np.arange(-3, 3)
    theta = np.degrees(np.arcsin(kx / 1.41))
    found = rcwa.solve(grating, WAVELENGTH, theta, orders=12, slices=6)
    assert found.bloch_wavevectors == 1
    np.testing.assert_allclose(found.total_reflected + found.total_transmitted, 1.0, atol=1e-10)
    # And those at -kx by reciprocity.
    both = rcwa.solve(grating, WAVELENGTH, np.concatenate([theta, -theta]), orders=12, slices=6)
    assert both.bloch_wavevectors == 1
    alone = rcwa.solve(grating, WAVELENGTH, -theta[1], orders=14, slices=6)
    near = both.total_transmitted[theta.size + 1] - alone.total_transmitted
    assert abs(near) < 2e-4


def test_jones_matrices_give_the_efficiencies() -> None:
    grating = sawtooth()
    theta, phi = np.array([10.0, -35.0, 20.0]), np.array([0.0, 40.0, -70.0])
    found = rcwa.solve(grating, WAVELENGTH, theta, phi, "both", orders=14, slices=8, jones=True)
    assert found.jones_reflected is not None
    out, _ = found.directions("reflected")
    flux = np.cos(np.radians(out)) / np.cos(np.radians(theta))[:, None]
    power = (np.abs(found.jones_reflected) ** 2).sum(axis=-2) * np.nan_to_num(flux)[..., None]
    np.testing.assert_allclose(power.transpose(0, 2, 1), found.reflected, atol=1e-9)


def test_the_sign_of_ky_changes_cross_polarisation_alone() -> None:
    grating = sawtooth()
    up = rcwa.jones(grating, WAVELENGTH, 30.0, 40.0, orders=14, slices=8)
    down = rcwa.jones(grating, WAVELENGTH, 30.0, -40.0, orders=14, slices=8)
    signs = np.array([[1, -1], [-1, 1]])
    np.testing.assert_allclose(up.transmitted, down.transmitted * signs, atol=1e-10)


def test_at_normal_incidence_s_turns_with_the_azimuth() -> None:
    grating = sawtooth()
    along = rcwa.solve(grating, WAVELENGTH, 0.0, 0.0, "both", orders=14, slices=8)
    across = rcwa.solve(grating, WAVELENGTH, 0.0, 90.0, "both", orders=14, slices=8)
    np.testing.assert_allclose(along.reflected, across.reflected[::-1], atol=1e-9)
    assert np.abs(along.reflected[0] - along.reflected[1]).max() > 1e-4


def test_the_near_field_keeps_the_flux() -> None:
    field = rcwa.near_field(sawtooth(), WAVELENGTH, 20.0, 10.0, "p", slices=8)
    np.testing.assert_allclose(field.flux, field.total_transmitted, atol=1e-8)
    assert field.electric.shape == (256, 256, 3)
    mean = field.poynting[-1, :, 2].mean() / (1.41 / 2) / np.cos(np.radians(20.0))
    assert abs(mean - field.total_transmitted) < 1e-6


def test_the_hemisphere_is_the_same_as_its_directions() -> None:
    grating = sawtooth()
    every = rcwa.hemisphere(grating, WAVELENGTH, kx_per_zone=2, ky=5, orders=12, slices=6)
    top = every.from_top & (every.theta_deg < 89)
    found = rcwa.solve(
        grating, WAVELENGTH, every.theta_deg[top], every.phi_deg[top], "both", orders=12, slices=6
    )
    np.testing.assert_allclose(
        found.total_transmitted, every.to_bottom[top].sum(axis=-1), atol=1e-9
    )
    assert found.bloch_wavevectors <= every.bloch_wavevectors


def test_a_tolerance_is_kept() -> None:
    grating = sawtooth()
    theta = np.array([0.0, 20.0, -50.0])
    coarse = rcwa.solve(grating, WAVELENGTH, theta, tolerance=1e-3)
    fine = rcwa.solve(grating, WAVELENGTH, theta, orders=60, slices=60)
    assert np.abs(coarse.total_transmitted - fine.total_transmitted).max() < 1e-3
    assert coarse.estimated_error is not None and coarse.estimated_error <= 1e-3


def test_a_tolerance_is_kept_below_half_a_wavelength() -> None:
    relief = rcwa.Relief.lamellar(0.6, 0.4, 0.6, ridge=3.48, groove=1.0)
    found = rcwa.solve(rcwa.Grating(relief, 1.0, 1.0), 1.2, 10.0, polarisation="both")
    assert abs(float(found.total_transmitted[1]) - 0.3274) < 1e-3


def test_cases_are_those_of_the_command(binary: str, tmp_path: Path) -> None:
    case = {
        "wavelength": 0.55,
        "period": 1.3,
        "n_top": [1.41, 0.0],
        "n_bottom": [1.0, 0.0],
        "relief": {
            "depth": 0.4,
            "background": [1.0, 0.0],
            "polygons": [{"n": [1.41, 0.0], "points": [[0, 0], [1.3, 0], [1.1, 0.4]]}],
        },
        "theta_deg": 12.0,
        "phi_deg": 30.0,
        "pol": "p",
        "tolerance": 1e-3,
    }
    path = tmp_path / "case.json"
    path.write_text(json.dumps(case))
    said = subprocess.run([binary, "grating", path], capture_output=True, check=True, text=True)
    assert rcwa.solve_case(path) == json.loads(said.stdout)
    assert rcwa.solve_case(case) == json.loads(said.stdout)
    grating = rcwa.Grating(
        rcwa.Relief.triangle(1.3, (1.1, 0.4), ridge=1.41, groove=1.0), 1.41, 1.0
    )
    found = rcwa.solve(grating, 0.55, 12.0, 30.0, "p", tolerance=1e-4)
    assert abs(float(found.total_reflected) - json.loads(said.stdout)["R_total"]) < 1e-3


def test_reliefs_of_metal_are_extrapolated_and_lose_energy() -> None:
    relief = rcwa.Relief.sinusoid(0.8, 0.1, 0.2 + 3.1j, 1.0, sides=16, base="bottom")
    grating = rcwa.Grating(relief, 1.0, 0.2 + 3.1j)
    found = rcwa.solve(grating, 0.6, [0.0, 15.0], polarisation="p", orders=12, slices=8)
    assert (found.absorbed > 0).all() and (found.absorbed < 1).all()
    with pytest.raises(batwing.InputError, match="jones"):
        rcwa.solve(grating, 0.6, orders=12, slices=8, jones=True)
    with pytest.raises(batwing.InputError, match="side: expected"):
        rcwa.solve(grating, 0.6, orders=12, slices=8, side="bottom")


def test_materials_with_dispersion() -> None:
    glass = rcwa.Material.tabulated([0.4, 0.6], [1.6, 1.5])
    assert glass.index(0.5) == pytest.approx(1.55)
    grating = rcwa.Grating(rcwa.Relief(1.0, 0.1, 1.0), 1.0, glass)
    r = float(rcwa.solve(grating, 0.6, orders=2).total_reflected)
    assert r == pytest.approx(0.04, abs=1e-12)
    with pytest.raises(batwing.Error, match="0.7"):
        rcwa.solve(grating, 0.7, orders=2)


@pytest.mark.parametrize("phi", [45.0, 90.0, 180.0])
@pytest.mark.parametrize("theta", [2e-16, -2e-16, 1e-14])
def test_s_and_p_beside_normal_incidence_are_those_at_normal_incidence(
    theta: float, phi: float
) -> None:
    grating = rcwa.Grating(rcwa.Relief.lamellar(1.3, 0.4, 0.5, 2.0, 1.0), 2.0, 1.0)
    normal, beside = (
        rcwa.solve(grating, 0.55, t, phi, polarisation="s", orders=10) for t in (0.0, theta)
    )
    np.testing.assert_allclose(beside.transmitted, normal.transmitted, atol=1e-12)


def test_ridges_stand_on_the_half_space_that_is_named() -> None:
    """Glass ridges on glass, light from air: the mirror image of silicone's from silicone."""
    shapes: dict[str, Callable[[rcwa.Base], rcwa.Relief]] = {
        "triangle": lambda base: rcwa.Relief.triangle(0.4, (0.2, 0.5), 1.5, 1.0, base=base),
        "sinusoid": lambda base: rcwa.Relief.sinusoid(0.4, 0.5, 1.5, 1.0, base=base),
        "steps": lambda base: rcwa.Relief.steps(0.3, 0.4, 1.5, 1.0, base=base),
    }
    for name, shape in shapes.items():
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            standing = rcwa.Grating(shape("bottom"), top=1.0, bottom=1.5)
            hanging = rcwa.Grating(shape("top"), top=1.5, bottom=1.0)
        from_air = rcwa.solve(standing, WAVELENGTH, orders=12)
        upside_down = rcwa.solve(hanging, WAVELENGTH, orders=12, side="bottom")
        r = float(from_air.total_reflected)
        assert r == pytest.approx(float(upside_down.total_reflected), abs=1e-9), name
        # Tapered ridges reflect less than the bare interface, 4 %.
        assert r < 0.035, name
        with pytest.warns(batwing.ReliefWarning, match="base='bottom'"):
            floating = rcwa.Grating(shape("top"), top=1.0, bottom=1.5)
        assert abs(float(rcwa.solve(floating, WAVELENGTH, orders=12).total_reflected) - r) > 0.01


def test_a_base_that_nobody_states_is_said_where_it_is_a_guess() -> None:
    """Metal triangles on glass: the half-spaces do not tell which way up they are."""
    metal, groove = 0.8 + 6.0j, 1.0
    with pytest.warns(batwing.ReliefWarning, match="top half-space, since no base is stated"):
        rcwa.Grating(rcwa.Relief.triangle(0.4, (0.2, 0.5), metal, groove), 1.0, 1.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for base in get_args(rcwa.Base):
            rcwa.Grating(rcwa.Relief.triangle(0.4, (0.2, 0.5), metal, groove, base=base), 1.0, 1.5)
        rcwa.Grating(rcwa.Relief.triangle(0.4, (0.2, 0.5), 1.41, groove), 1.41, 1.0)
    one, other = (rcwa.Relief.triangle(0.4, (0.2, 0.5), 1.41, 1.0, base=b) for b in ("top", None))
    assert one == other


def test_given_orders_state_their_error() -> None:
    """Silver in TM by stairs, beside the C method of Chandezon; and a dielectric."""
    known = {-1: 0.278582, 0: 0.440264, 1: 0.268048}
    relief = rcwa.Relief.sinusoid(1 / 1.2, 0.1, 0.0562 + 4.2776j, 1.0, sides=24, base="bottom")
    grating = rcwa.Grating(relief, top=1.0, bottom=0.0562 + 4.2776j)
    found = rcwa.solve(grating, 0.633, 10.0, polarisation="p", orders=14, threads=1)
    shares = dict(zip(found.orders_reflected.tolist(), found.reflected.tolist()))
    off = max(abs(shares[order] - share) for order, share in known.items())
    assert found.estimated_error is not None and off < found.estimated_error < 1
    coarse = rcwa.solve(sawtooth(), WAVELENGTH, 20.0, orders=8)
    fine = rcwa.solve(sawtooth(), WAVELENGTH, 20.0, orders=40, slices=60, estimate=False)
    assert fine.estimated_error is None and coarse.estimated_error is not None
    assert abs(coarse.total_reflected - fine.total_reflected) < coarse.estimated_error < 0.1


def test_metal_to_a_tolerance_is_solved_by_boundary_integrals() -> None:
    """Aluminium in the mount of Littrow: the value of tests/physics/boundary_integral.rs."""
    depth, metal = 0.25767016473231424, 0.7 + 5.7j
    points = [[0.0, depth], [0.7441070388230842, 0.0], [1 / 1.2, depth]]
    relief = rcwa.Relief(1 / 1.2, depth, 1.0, [rcwa.Polygon(metal, points)])
    grating = rcwa.Grating(relief, top=1.0, bottom=metal)
    found = rcwa.solve(grating, 0.5461, 19.12680840778394, polarisation="both", tolerance=1e-3)
    assert found.method == "boundary integral" and found.nodes > 20
    assert (found.orders, found.slices) == (0, 0)
    assert found.estimated_error is not None and found.estimated_error <= 1e-3
    littrow = found.reflected[..., list(found.orders_reflected).index(-1)]
    np.testing.assert_allclose(littrow, [0.66542, 0.89119], atol=1e-3)
    assert rcwa.solve(grating, 0.5461, 10.0, orders=6, slices=4).method == "orders"


def test_a_case_upside_down_is_warned_of() -> None:
    triangle = {"n": [1.5, 0], "points": [[0, 0], [1, 0], [0.5, 0.3]]}
    case = {
        "n_top": [1, 0],
        "n_bottom": [1.5, 0],
        "period": 1.0,
        "wavelength": 0.633,
        "theta_deg": 20,
        "pol": "p",
        "N": 8,
        "relief": {"background": [1, 0], "depth": 0.3, "polygons": [triangle]},
    }
    with pytest.warns(UserWarning, match="bottom half-space"):
        rcwa.solve_case(case)


def test_ridges_that_touch_nothing_of_their_own_are_said() -> None:
    box = np.array([[0.1, 0.2], [0.3, 0.2], [0.3, 0.6], [0.1, 0.6]])
    floating = rcwa.Relief(0.5, 0.8, 1.0, [rcwa.Polygon(1.5, box)])
    with pytest.warns(batwing.ReliefWarning, match="float"):
        rcwa.Grating(floating, 1.0, 1.5)
    layer = np.array([[0, 0.2], [0.5, 0.2], [0.5, 0.4], [0, 0.4]])
    quiet = [
        (floating, 1.0, 2.0),
        (rcwa.Relief(0.5, 0.8, 1.0, [rcwa.Polygon(1.5, box + [0, 0.2])]), 1.0, 1.5),
        (rcwa.Relief(0.5, 0.8, 2.0, [rcwa.Polygon(1.5, layer)]), 1.0, 1.5),
        (rcwa.Relief.lamellar(0.5, 0.3, 0.5, 1.5, 1.0), 1.0, 1.5),
        (rcwa.Relief(1.0, 0.1, 1.0), 1.0, 1.5),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for relief, top, bottom in quiet:
            rcwa.Grating(relief, top, bottom)


def test_a_relief_keeps_what_it_was_made_of() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.4]])
    relief = rcwa.Relief.polygon(1.0, points, 1.41, 1.0)
    grating = rcwa.Grating(relief, 1.41, 1.0)
    before = rcwa.solve(grating, WAVELENGTH, orders=8).reflected
    points[2, 1] = 0.1
    for one in (relief, pickle.loads(pickle.dumps(relief)), copy.deepcopy(relief)):
        with pytest.raises(ValueError, match="read-only"):
            one.polygons[0].points_um[2, 1] = 0.1
        again = rcwa.solve(rcwa.Grating(one, 1.41, 1.0), WAVELENGTH, orders=8).reflected
        np.testing.assert_array_equal(again, before)


def test_absorption_is_no_residual_of_energy() -> None:
    relief = rcwa.Relief.lamellar(0.5, 0.1, 0.5, 0.2 + 3j, 1.0)
    lossy = rcwa.Grating(relief, 1.0, 1.5)
    found = rcwa.solve(lossy, 0.6, [0.0, 30.0], polarisation="both", orders=12)
    assert (found.absorbed > 0.01).all()
    assert found.energy_residual < 1e-9
    every = rcwa.hemisphere(lossy, 0.6, kx_per_zone=2, ky=3, orders=12)
    assert every.energy_residual < 1e-9
    total = (every.to_top.sum(axis=-1) + every.to_bottom.sum(axis=-1)).max()
    assert total < 0.999


def test_wavelengths_broadcast_beside_angles() -> None:
    glass = rcwa.Material.tabulated([0.4, 0.7], [1.55, 1.5])
    grating = rcwa.Grating(rcwa.Relief.lamellar(1.0, 0.3, 0.5, glass, 1.0), 1.0, glass)
    wavelengths, theta = np.array([0.6, 0.45, 0.6, 0.5]), np.array([0.0, 25.0, -40.0])
    found = rcwa.solve(
        grating, wavelengths[:, None], theta, 10.0, polarisation="both", orders=10, jones=True
    )
    assert found.total_reflected.shape == (4, 3, 2)
    np.testing.assert_allclose(found.total_reflected + found.total_transmitted, 1.0, atol=1e-9)
    out, azimuth = found.directions("reflected")
    for i, wavelength in enumerate(wavelengths):
        alone = rcwa.solve(grating, wavelength, theta, 10.0, polarisation="both", orders=10, jones=True)
        first = int(alone.orders_reflected[0] - found.orders_reflected[0])
        own = slice(first, first + alone.orders_reflected.size)
        np.testing.assert_array_equal(found.reflected[i][..., own], alone.reflected)
        np.testing.assert_array_equal(found.reflected_te[i][..., own], alone.reflected_te)
        assert found.jones_reflected is not None and alone.jones_reflected is not None
        np.testing.assert_array_equal(found.jones_reflected[i][:, own], alone.jones_reflected)
        np.testing.assert_array_equal(out[i][:, own], alone.directions("reflected")[0])
    pairs = rcwa.jones(grating, wavelengths[:3], theta, orders=10)
    assert pairs.reflected.shape[:1] == (3,)
    np.testing.assert_array_equal(found.wavelength_um[:, 0], wavelengths)  # type: ignore[index]


def test_both_spellings_are_taken() -> None:
    one = rcwa.solve(sawtooth(), WAVELENGTH, 20.0, polarization="p", orders=14, slices=4)
    other = rcwa.solve(sawtooth(), WAVELENGTH, 20.0, polarisation="p", orders=14, slices=4)
    assert one.polarisation == "p"
    np.testing.assert_array_equal(one.reflected, other.reflected)
