# SPDX-License-Identifier: MIT OR Apache-2.0
"""Arithmetic and order of figures, against closed forms and differences."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import batwing
from batwing.simulate import Figure

F, G = Figure(4.0, 0.4), Figure(3.0, 0.3, wavelength_error=0.1)
BETWEEN = Figure(0.0, 1.0, "deg", interval=(-1.0, 2.0))
DARK = Figure(0.0, 1e-5, upper_bound=3e-5)


@pytest.mark.parametrize("kind", [float, np.float64, np.float32, Figure])
def test_figures_compare_by_value(kind: Any) -> None:
    def value(number: float) -> Any:
        return Figure(number, 0.5) if kind is Figure else kind(number)

    assert F > value(3.5) and F >= value(4) and not F < value(4) and F <= value(4)
    assert value(3.5) < F and value(4) <= F and not value(4) > F and value(4.5) >= F
    assert (kind is Figure) != (F == value(4) and value(4) == F and F != value(3.5))
    assert not F < F and F <= F and sorted([F, G, F]) == [G, F, F] and max(G, F) is F
    assert len({F, G, Figure(4.0, 0.4)}) == 2 and F != Figure(4.0, 0.5) and F != "4"


def test_what_lies_between_two_ends_is_compared_where_both_agree() -> None:
    assert BETWEEN < 2.5 and BETWEEN >= -1.0 and Figure(-2.0, 0.1, "deg") < BETWEEN
    assert DARK < 1e-3 and sorted([F, DARK])[0] is DARK
    peak = Figure.of({"value": 2.5, "standard_error": 1.0, "peak_place": "on_axis"}, "deg")
    calls: list[tuple[Callable[[], object], str]] = [
        (lambda: BETWEEN < 0.5, "comparison"),
        (lambda: BETWEEN > BETWEEN, "comparison"),
        (lambda: DARK < 1e-5, "comparison"),
        (lambda: BETWEEN < F, "unit"),
        (lambda: peak > 1.0, "operand"),
        (lambda: abs(peak), "operand"),
        (lambda: peak**2, "operand"),
    ]
    for compare, key in calls:
        with pytest.raises(batwing.InputError) as caught:
            compare()
        assert caught.value.key == key
    with pytest.raises(TypeError):
        F < "3"  # type: ignore[operator]


def test_a_figure_beside_itself_has_no_error_of_its_own() -> None:
    for got, value, error in [
        (F - F, 0.0, 0.0),
        (F / F, 1.0, 0.0),
        ((F + G) - F, 3.0, 0.3),
        ((F * G) / G, 4.0, 0.4),
        (F + F, 8.0, 0.8),
        (F * F - F**2, 0.0, 0.0),
        (2.0 * G - G - G, 0.0, 0.0),
    ]:
        assert got.value == pytest.approx(value) and got.standard_error == pytest.approx(error)
    assert (F - F).standard_error == 0.0 and (F / F).standard_error == 0.0
    # Two figures of the same numbers are not one.
    assert (F - Figure(4.0, 0.4)).standard_error == pytest.approx(0.4 * np.sqrt(2))
    assert (G - G).wavelength_error == 0.0 and (2 * G).wavelength_error == 0.2
    assert (BETWEEN - BETWEEN).interval == (0.0, 0.0)
    # Ends of a resolved operand: two errors away; of one with a bias its bound and two errors without it.
    plain, picked = Figure(1.0, 0.1, "deg"), Figure(1.0, 0.2, "deg", more={"bias_bound": 0.3})
    assert (BETWEEN + plain).interval == pytest.approx((-0.2, 3.2))
    assert (BETWEEN + picked).interval == pytest.approx((-0.5, 3.5))
    both, first, _ = pickle.loads(pickle.dumps((F - G, F, G)))
    assert (both - first).standard_error == pytest.approx(0.3)


@pytest.mark.parametrize(
    "expression",
    [
        lambda f, g: (f * g - f) / (f + 2 * g),
        lambda f, g: f**3 / g - 1 / (f * g) ** 2,
        lambda f, g: abs(-f * g) ** 0.5 + f**-1.5 * g,
        lambda f, g: (f - g) ** 0 + (g - f) ** 3,
    ],
)
def test_errors_are_those_of_differences(expression: Callable[[Any, Any], Any]) -> None:
    found = expression(F, G)
    step = 1e-5
    by_f = (expression(4 + step, 3.0) - expression(4 - step, 3.0)) / (2 * step)
    by_g = (expression(4.0, 3 + step) - expression(4.0, 3 - step)) / (2 * step)
    assert found.value == pytest.approx(expression(4.0, 3.0))
    assert found.standard_error == pytest.approx(np.hypot(0.4 * by_f, 0.3 * by_g), rel=1e-6)
    assert found.wavelength_error == pytest.approx(abs(0.1 * by_g), rel=1e-6, abs=1e-9)


def test_powers_roots_and_sizes() -> None:
    root: Any = F.sqrt()
    assert root.value == 2.0 and root.standard_error == pytest.approx(0.1)
    operand: Any = F
    assert np.sqrt(operand) == root and isinstance(np.abs(-operand), Figure) and abs(-F) == Figure(4.0, 0.4)
    assert round(Figure(0.75314, 1e-3), 3) == 0.753 and round(F) == 4
    length = Figure(2.0, 0.1, "mm")
    assert (length**2).unit == (length * length).unit and (length**-1).unit == "mm^-1"
    assert abs(length * -1).unit == "mm" and (length**0).unit == "1"
    assert (BETWEEN**2).interval == (0.0, 4.0) and abs(BETWEEN).interval == (0.0, 2.0)
    assert abs(DARK) is DARK and DARK.sqrt().interval == pytest.approx((0.0, np.sqrt(3e-5)))


@pytest.mark.parametrize(
    "base, exponent",
    [(Figure(-1.0, 0.1), 0.5), (Figure(0.0, 0.1), 0.5), (Figure(0.0, 0.1), -1), (BETWEEN, -2)],
)
def test_powers_that_tell_nothing_are_refused(base: Figure, exponent: float) -> None:
    with pytest.raises(batwing.InputError, match="base: expected a figure") as caught:
        base**exponent
    assert caught.value.got == str(base)
    with pytest.raises(batwing.InputError, match="exponent"):
        F ** float("inf")
    with pytest.raises(TypeError):
        F**F  # type: ignore[operator]
