# SPDX-License-Identifier: MIT OR Apache-2.0
"""Bad input: an exception that names argument, got and expected; never a panic."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import batwing
from batwing import _native, bsdf, rcwa, simulate


def grating(period: float = 1.0) -> rcwa.Grating:
    return rcwa.Grating(rcwa.Relief.lamellar(period, 0.2, 0.5, 1.5, 1.0), 1.0, 1.5)


def solve(**arguments: Any) -> rcwa.Solution:
    return rcwa.solve(grating(), **{"wavelength_um": 0.55, "orders": 8, **arguments})


CASES: list[tuple[str, Callable[[], object], str, str]] = [
    ("nan", lambda: solve(theta_deg=float("nan")), "theta_deg", "nan"),
    ("nan in array", lambda: solve(theta_deg=[0.0, float("nan")]), "theta_deg", "nan at [2]"),
    ("nan in matrix", lambda: solve(theta_deg=[[0.0], [float("nan")]]), "theta_deg", "nan at [2, 1]"),
    ("infinity", lambda: solve(phi_deg=float("inf")), "phi_deg", "inf"),
    ("empty", lambda: solve(theta_deg=np.empty(0)), "theta_deg", "shape (0,)"),
    ("text", lambda: solve(theta_deg="steep"), "theta_deg", "steep"),
    ("complex", lambda: solve(theta_deg=np.array([1j])), "theta_deg", "complex128"),
    ("objects", lambda: solve(theta_deg=np.array([None])), "theta_deg", "object"),
    ("shapes", lambda: solve(theta_deg=np.zeros(3), phi_deg=np.zeros(4)), "phi_deg", "shape (4,)"),
    ("grazing", lambda: solve(theta_deg=90.0), "theta_deg", "90.0"),
    ("wavelength", lambda: solve(wavelength_um=-0.5), "wavelength_um", "-0.5"),
    ("wavelengths", lambda: solve(wavelength_um=np.ones(2), theta_deg=np.zeros(3)), "wavelength_um", "(2,)"),
    ("polarisation", lambda: solve(polarisation="TE"), "polarisation", "TE"),
    ("side", lambda: solve(side="left"), "side", "left"),
    ("orders", lambda: solve(orders=-1), "orders", "-1"),
    ("many orders", lambda: solve(orders=10**9), "orders", "1000000000"),
    ("real orders", lambda: solve(orders=8.5), "orders", "8.5"),
    ("both", lambda: solve(tolerance=1e-3), "tolerance", "8"),
    ("tolerance", lambda: solve(orders=None, tolerance=0.5), "tolerance", "0.5"),
    ("slices", lambda: solve(orders=None, slices=4), "slices", "none"),
    ("threads", lambda: solve(threads=0), "threads", "0"),
    ("set_threads", lambda: batwing.set_threads(5000), "threads", "5000"),
    ("gain", lambda: rcwa.Material.constant(1.5 - 0.1j), "value", "(1.5-0.1j)"),
    ("fill", lambda: rcwa.Relief.lamellar(1.0, 0.2, 1.5, 1.5, 1.0), "fill", "1.5"),
    ("points", lambda: rcwa.Relief.polygon(1, [[0, 0], [1, 1]], 1.5, 1.0), "points_um", "(2, 2)"),
    ("hemisphere ky", lambda: rcwa.hemisphere(grating(), 0.55, ky=[0.3, 0.1], orders=8), "ky", "(2,)"),
    ("missing design", lambda: simulate.run("no-such.toml"), "no-such.toml", ""),
    ("design type", lambda: simulate.run(7), "design", "int 7"),  # type: ignore[arg-type]
    ("model", lambda: simulate.run({}, model="hybird"), "model", "hybird"),  # type: ignore[arg-type]
    ("design nan", lambda: simulate.run({"led": {"x": float("nan")}}), "design.toml: led.x", "nan"),
    ("design none", lambda: simulate.run({"led": {"x": None}}), "design.toml: led.x", "None"),
    ("design complex", lambda: simulate.run({"l": [0, {"x": 1j}]}), "design.toml: l[2].x", "1j"),
    ("design key", lambda: simulate.run({"led": {3: 1}}), "design.toml: led.3", "int 3"),
    ("case nan", lambda: rcwa.solve_case({"period": [1.0, float("nan")]}), "case: period[2]", "nan"),
    ("case none", lambda: rcwa.solve_case({"period": None}), "case: period", "None"),
    ("array nan", lambda: simulate.Design({"x": np.array([0, np.nan])}).to_toml(), "x[2]", "nan"),
    ("no entry", lambda: simulate.Design({"l": [1]}).with_values({"l.1": 2}), "l.1", "1"),
    ("base", lambda: rcwa.Relief.triangle(1.0, (0.5, 0.2), 1.5, 1.0, base="left"), "base", "left"),  # type: ignore[arg-type]
    ("not a polygon", lambda: rcwa.Relief(1.0, 0.2, 1.0, [3]), "polygons[1]", "int 3"),  # type: ignore[list-item]
    ("two spellings", lambda: solve(polarisation="s", polarization="p"), "polarization", "s"),
    ("wavelength 0", lambda: solve(wavelength_um=[0.5, 0.0]), "wavelength_um", "0.0"),
    ("a relief", lambda: rcwa.solve(grating().relief, 0.55), "grating", "a Relief"),  # type: ignore[arg-type]
    ("no grating", lambda: rcwa.hemisphere(None, 0.55), "grating", "NoneType None"),  # type: ignore[arg-type]
    ("a dict", lambda: rcwa.near_field({"a": 1}, 0.55), "grating", "dict {'a': 1}"),  # type: ignore[arg-type]
    ("amplitudes", lambda: rcwa.jones("x", [0.5, 0.6]), "grating", "str 'x'"),  # type: ignore[arg-type]
    ("table of a relief", lambda: bsdf.build(grating().relief, 0.55), "grating", "a Relief"),  # type: ignore[arg-type]
    ("no table", lambda: bsdf.compare(3, 4), "first", "int 3"),  # type: ignore[arg-type]
    ("a case", lambda: rcwa.solve_case(5), "case", "int 5"),  # type: ignore[arg-type]
    ("unknown key", lambda: rcwa.solve_case({"periodd": 1}), "periodd", "no such key"),
    ("flat pattern", lambda: simulate.zones({}, [0, 1]), "pattern", "shape (2,)"),
    ("pattern nan", lambda: simulate.zones({}, [[0, np.nan]]), "pattern", "nan at [1, 2]"),
    ("bright", lambda: simulate.zones({}, [[0, 1.5]]), "pattern", "1.5 at [1, 2]"),
    ("white", lambda: simulate.zones({}, [[1]], white=[0.3, 0.3, 0.4]), "white", "shape (3,)"),
    ("zones", lambda: simulate.zones({}, [[1]], zones=(0, 1)), "zones", "0"),
    ("counts", lambda: simulate.zones({}, [[1]], compare_zones=[(0, 1)]), "compare_zones", "0"),
    ("packages", lambda: simulate.zones({}, [[1]], packages=5), "packages", "int 5"),  # type: ignore[arg-type]
    ("fine zones", lambda: simulate.zones({}, [[1]], model="all"), "model", "all"),  # type: ignore[arg-type]
    ("section", lambda: simulate.full_wave(3), "design", "int 3"),  # type: ignore[arg-type]
    ("missing table", lambda: bsdf.read("no-such.bworders"), "no-such.bworders", ""),
    ("missing folder", lambda: simulate.load("no-such-folder"), "no-such-folder", ""),
]


@pytest.mark.parametrize("name, call, key, got", CASES, ids=[case[0] for case in CASES])
def test_bad_input_names_argument_got_and_expected(
    name: str, call: Callable[[], object], key: str, got: str
) -> None:
    with pytest.raises(batwing.Error) as caught:
        call()
    error = caught.value
    assert key in str(error), str(error)
    assert got in str(error), str(error)
    if got:
        assert error.key is not None and error.expected is not None, str(error)
    assert type(error) is not batwing.InternalError
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.key, again.got) == (str(error), error.key, error.got)


def test_a_key_of_a_design_is_named() -> None:
    design = simulate.Design.template().with_values({"led.reflectance": 7})
    with pytest.raises(batwing.InputError) as caught:
        design.check()
    assert caught.value.key == "led.reflectance" and caught.value.got == "7"
    assert "1" in str(caught.value.expected)


@pytest.mark.parametrize(
    "key, value, said",
    [
        ("led.reflectance", "x", "led.reflectance: expected a number"),
        ("led.reflectanc", 0.5, "led.reflectanc: no such key"),
        ("ledd", {"size_mm": 3}, "ledd: no such key"),
        ("solids", [{"name": "a", "kind": "sphere"}], "solids[1].radius_mm: expected a value"),
    ],
)
def test_dicts_cite_their_keys_and_no_lines(key: str, value: Any, said: str) -> None:
    """The text that was made of a dict is nothing that its author has seen."""
    design = simulate.Design.template().with_values({key: value})
    problem = {"name": "p", "design": design, "variables": [{"key": "array.pitch_mm", "too": 1}]}
    for call in (
        design.check,
        lambda: simulate.run(design.data),
        lambda: simulate.full_wave(design),
        lambda: simulate.zones(design, [[1.0]]),
        lambda: design.ring(1),
    ):
        with pytest.raises(batwing.InputError) as caught:
            call()
        assert str(caught.value).startswith(f"design.toml: {said}"), str(caught.value)
        assert caught.value.key == said.split(":")[0]
    with pytest.raises(batwing.InputError, match=r"problem.toml: variables\[1\].too: no such key"):
        simulate.optimise(problem)


def test_files_keep_their_lines(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("name = 3\n")
    with pytest.raises(batwing.InputError, match="bad.toml: line 1, column 8: name: expected a text"):
        simulate.run(tmp_path / "bad.toml")


def test_fewer_orders_than_propagate_are_refused() -> None:
    with pytest.raises(batwing.InputError, match="propagate"):
        rcwa.solve(grating(10.0), 0.55, orders=3)


def test_directions_beyond_memory_are_refused_before_anything_is_computed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table = bsdf.build(grating(), 0.55, orders=8, kx_per_zone=2, ky=4)
    monkeypatch.setattr(_native, "free_bytes", lambda: 2.0**30)
    # Views of one number: directions that take no memory themselves.
    many = np.broadcast_to(np.float64(10.0), 50_000_000)
    wi = np.broadcast_to(np.array([0.0, 0.0, -1.0]), (50_000_000, 3))
    calls: list[tuple[str, Callable[[], object]]] = [
        ("theta_deg", lambda: solve(phi_deg=many)),
        ("wi", lambda: table.lobes(wi)),
        ("wi", lambda: table.sample(wi)),
        ("wi", lambda: table.albedo(wi)),
    ]
    for key, call in calls:
        with pytest.raises(batwing.InputError, match=f"{key}: .*GiB") as caught:
            call()
        assert caught.value.got == "50000000"
    with pytest.raises(batwing.InputError, match="x_um: .*GiB"):
        rcwa.near_field(grating(), 0.55, x_um=np.linspace(0, 1, 4000), z_um=np.linspace(0, 1, 4000))


def test_orders_beyond_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    ky = np.linspace(0, 0.9, 3000)
    with pytest.raises(batwing.InputError, match="GiB|operations"):
        rcwa.hemisphere(grating(), 0.55, ky=ky, orders=2000)


@pytest.mark.parametrize("period, wavelength", [(10_000.0, 0.55), (10.0, 550.0)])
def test_units_that_differ_by_a_thousand_give_a_warning(period: float, wavelength: float) -> None:
    with pytest.warns(batwing.UnitWarning, match="another unit"):
        grating(period).highest_order(wavelength)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        grating(10.0).highest_order(0.55)


def test_views_and_other_dtypes_are_taken() -> None:
    theta = np.linspace(0, 60, 12)
    whole = solve(theta_deg=theta)
    strided = solve(theta_deg=theta[::3])
    np.testing.assert_array_equal(strided.total_reflected, whole.total_reflected[::3])
    flipped = solve(theta_deg=np.asfortranarray(theta.reshape(3, 4)))
    np.testing.assert_array_equal(flipped.total_reflected.ravel(), whole.total_reflected)
    single = solve(theta_deg=np.array([30], dtype=np.int32))
    assert single.reflected.shape[0] == 1


def test_vectors_of_another_length_are_refused(tmp_path: Path) -> None:
    table = bsdf.build(grating(), 0.55, orders=8, kx_per_zone=2, ky=4)
    for wi, got in (([[0, 0, 2.0]], "length of 2"), (np.zeros((2, 2)), "shape (2, 2)")):
        with pytest.raises(batwing.InputError, match="wi: expected unit vectors") as caught:
            table.lobes(wi)
        assert got in str(caught.value)
    with pytest.raises(batwing.Error, match="format"):
        table.write(tmp_path / "table.zip")
