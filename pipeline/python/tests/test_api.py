# SPDX-License-Identifier: MIT OR Apache-2.0
"""Names that a user sees: what `dir` shows, type hints, and pictures in text of one screen."""

from __future__ import annotations

import importlib
import inspect
import pickle
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import batwing
from batwing import bsdf, rcwa, simulate

MODULES = [
    importlib.import_module(f"batwing.{name}")
    for name in (
        "bsdf", "cli", "design", "errors", "figure", "gratings", "optimisation", "rays", "rcwa", "results",
        "scene", "simulate",
    )
]  # fmt: skip


def functions(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """Public functions, and the methods of public classes."""
    for name in module.__all__:
        one = getattr(module, name)
        if inspect.isfunction(one):
            yield name, one
        elif inspect.isclass(one):
            yield name, one
            for key, method in vars(one).items():
                method = getattr(method, "__func__", getattr(method, "fget", method))
                if inspect.isfunction(method) and not key.startswith("__"):
                    yield f"{name}.{key}", method


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_modules_show_their_public_names_alone(module: ModuleType) -> None:
    assert dir(module) == sorted(module.__all__)
    assert not {"np", "json", "os", "MAX_ORDERS"} & set(dir(module))
    for name in module.__all__:
        getattr(module, name)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_type_hints_resolve_and_name_the_words_of_options(module: ModuleType) -> None:
    assert list(functions(module))
    for name, one in functions(module):
        hints = get_type_hints(one)
        # numpydoc: `key : {'one', 'other'}` lists the words that `key` takes.
        for keys, words in re.findall(r"^ *([\w, ]+) : \{('[^}]*)\}", one.__doc__ or "", re.M):
            for key in keys.split(", "):
                literal = [
                    part for part in (hints[key], *get_args(hints[key])) if get_origin(part) is Literal
                ]
                listed = set(re.findall(r"'([^']+)'", words))
                assert literal and listed <= set(get_args(literal[0])), f"{name}: {key}"


def test_results_fit_on_a_screen() -> None:
    relief = rcwa.Relief.sinusoid(8.0, 2.0, 1.41, 1.0)
    grating = rcwa.Grating(relief, 1.41, 1.0)
    shown = [
        relief,
        grating,
        rcwa.solve(grating, 0.55, np.linspace(-80, 80, 33), orders=30, slices=2),
        rcwa.Grating(rcwa.Relief(1.0, 0.1, 1.0), 1.0, 1.5),
        bsdf.Albedo(np.zeros((2000, 2)), np.zeros((2000, 2))),
        simulate.Design.template(),
        simulate.Rays(*(np.zeros((3, 3), np.float32),) * 2, np.zeros(3, np.float32)),
    ]
    for one in shown:
        text = repr(one)
        lines = text.splitlines()
        assert text.startswith(type(one).__name__) and len(lines) <= 24, text
        assert max(map(len, lines)) <= 100, text


def test_figures_are_numbers_with_errors() -> None:
    a, b = simulate.Figure(3.0, 0.3, "deg"), simulate.Figure(2.0, 0.4, "deg")
    for got, value, error, unit in [
        (a + b, 5.0, 0.5, "deg"),
        (a - b, 1.0, 0.5, "deg"),
        (2 - a, -1.0, 0.3, "deg"),
        (2 * a, 6.0, 0.6, "deg"),
        (a / 2, 1.5, 0.15, "deg"),
        (a / b, 1.5, 1.5 * np.hypot(0.1, 0.2), "1"),
        (a * b, 6.0, 6.0 * np.hypot(0.1, 0.2), "deg deg"),
        (1 / b, 0.5, 0.1, "1/deg"),
        (sum([a, b]) / 2, 2.5, 0.25, "deg"),
    ]:
        assert isinstance(got, simulate.Figure)
        assert (got.value, got.standard_error) == pytest.approx((value, error))
        assert got.unit == unit and got.is_resolved
    assert float(a) == 3.0 and np.array([a, b], dtype=float).tolist() == [3.0, 2.0]
    with pytest.raises(batwing.InputError, match="unit"):
        a + simulate.Figure(1.0, 0.1, "lm")
    with pytest.raises(TypeError):
        a + "3"  # type: ignore[operator]


def test_figures_that_are_not_resolved_stay_so() -> None:
    """As the terminal shows them, and in what is computed of them."""
    entry = {"value": 20.0, "standard_error": 0.0, "interval": [17.5, 22.5]}
    peak = simulate.Figure.of(entry, "deg", "peak_angle_deg")
    assert peak.interval == (17.5, 22.5) and not peak.is_resolved
    # What is no value cannot be taken for one.
    assert np.isnan([peak.value, peak.standard_error, float(peak)]).all()
    assert peak.estimate == (20.0, 0.0)
    assert pickle.loads(pickle.dumps(peak)).estimate == (20.0, 0.0)
    assert str(peak) == "17.5 to 22.5 °" and f"{peak:.2f}" == "17.50 to 22.50"
    assert (peak * 2 + 1).interval == (36.0, 46.0)
    assert (1 / peak).interval == pytest.approx((1 / 22.5, 1 / 17.5))
    dark = simulate.Figure.of({"value": 0.0, "standard_error": 1e-5, "upper_bound": 3e-5}, "W")
    assert str(dark) == "below 3.0e-5 W" and f"{dark:.1e}" == "below 3.0e-05"
    assert (1 - dark).interval == (1 - 3e-5, 1.0)
    with pytest.raises(batwing.InputError, match="divisor"):
        peak / dark
    share = simulate.Figure.of({"value": 0.7531, "standard_error": 0.0012}, "1", "uniformity")
    assert repr(share) == "75.31 ± 0.12 %"
    colour = simulate.Figure.of({"value": 0.0041, "standard_error": 0.0002}, "1", "cell_colour_difference")
    assert repr(colour) == "0.00410 ± 0.00020"
    axial = simulate.Figure.of(
        {"value": 2.5, "standard_error": 1.0, "peak_place": "on_axis"}, "deg", "peak_angle_deg"
    )
    assert str(axial) == repr(axial) == "none (maximum on axis)" and not axial.has_value
    with pytest.raises(batwing.InputError, match="operand"):
        axial + 1.0
    assert repr(peak) == "17.5 to 22.5 ° (not resolved)"
    assert repr(dark) == "below 3.0e-5 W (not resolved)"
    assert "± 0" not in f"{peak} {peak!r} {peak * 2:.1f} {dark:.3f} {dark!r}"


def test_no_format_shows_an_error_as_0() -> None:
    small = simulate.Figure(0.5, 1e-4)
    assert f"{small:.5f}" == "0.50000 ± 0.00010"
    assert f"{small:.2f}" == str(small) and "± 0.00 " not in f"{small:.2f} "
    assert f"{simulate.Figure(0.5, 0.0):.2f}" == "0.50"
    # One form in a column: a fraction beside fractions, an angle without its unit beside angles.
    exact = simulate.Figure(0.5, 1e-4, key="uniformity")
    assert str(exact) == "50.000 ± 0.010 %" and f"{exact:.2f}" == "0.50000 ± 0.00010"
    assert f"{simulate.Figure(20.0, 1e-4, 'deg'):.2f}" == "20.00000 ± 0.00010"


def test_the_error_of_a_figure_holds_that_of_the_wavelengths() -> None:
    entry = {
        "value": 0.75,
        "standard_error": 0.003,
        "wavelength_error": {"value": -0.004, "standard_error": 1e-4},
    }
    figure = simulate.Figure.of(entry, "1", "uniformity")
    assert figure.standard_error == pytest.approx(0.005) and figure.wavelength_error == 0.004
    assert figure.more["wavelength_error"]["standard_error"] == 1e-4
    assert str(figure) == "75.00 ± 0.50 %" and f"{figure:.3f}" == "0.750 ± 0.005"
    twice = 2 * figure
    assert (twice.standard_error, twice.wavelength_error) == pytest.approx((0.01, 0.008))
    assert twice.wavelength_error == pytest.approx(0.008)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64, np.uint8])
def test_numpy_scalars_are_numbers_beside_figures(kind: Any) -> None:
    figure, two = simulate.Figure(3.0, 0.3, "deg"), kind(2)
    for got, value, error, unit in [
        (figure + two, 5.0, 0.3, "deg"),
        (two + figure, 5.0, 0.3, "deg"),
        (figure - two, 1.0, 0.3, "deg"),
        (two - figure, -1.0, 0.3, "deg"),
        (figure * two, 6.0, 0.6, "deg"),
        (two * figure, 6.0, 0.6, "deg"),
        (figure / two, 1.5, 0.15, "deg"),
        (two / figure, 2 / 3, 2 / 30, "1/deg"),
    ]:
        assert isinstance(got, simulate.Figure), type(got)
        assert (got.value, got.standard_error) == pytest.approx((value, error)) and got.unit == unit
    with pytest.raises(TypeError):
        figure * np.complex128(1j)  # type: ignore[operator]
