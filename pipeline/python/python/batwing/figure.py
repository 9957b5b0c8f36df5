# SPDX-License-Identifier: MIT OR Apache-2.0
"""Figures of merit: numbers with standard errors, which terminal and arithmetic share."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field, fields
from numbers import Real
from typing import Any, Literal, Union

import numpy as np

from . import _checks, _native

__all__ = ["Figure", "Number", "Operand"]


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True)
class Figure:
    """A figure of merit with its standard error.

    It shows as on the terminal. Sums, differences, products, quotients, powers and `abs` of figures
    and numbers are figures; `sqrt()` is ``** 0.5``, also as `numpy.sqrt`. Errors are those of first
    order. Different figures are taken as independent, and what is computed of one figure twice is
    not: ``f - f`` is 0 without an error. Figures of one trace are not independent: the paired `change`
    of a search knows its own error. Where an operand is known between two ends alone, the result is
    an interval; there the ends of the others are as far away as the program has them: the bound of
    their bias and twice what is left of the standard error without it. A figure without a value, such as the angle of a peak that is noise, is
    no operand.

    ``<``, ``<=``, ``>`` and ``>=`` compare values, whatever the errors; a figure that is known between
    two ends alone is compared where both decide alike, and refused elsewhere. ``==`` with a number
    compares the value, with a figure all attributes. `round` and `float` give plain numbers.

    Attributes
    ----------
    value : float
        Best value; NaN of a figure that has none: one known between two ends alone, the angle of a
        peak that is noise. 0 with an `upper_bound` is what was not seen.
    standard_error : float
        One standard deviation, from leaving out one of 64 groups of paths at a time, together with
        `wavelength_error`; NaN where the figure is not resolved.
    unit : str
        `1`, `deg`, ...
    more : dict
        Further keys of docs/reference/results-schema.md, such as `published`.
    interval : (float, float) or None
        Ends of a figure that is known between them alone: value and error are not resolved.
    upper_bound : float or None
        Bound of a value of 0 that is no more than not seen, with 95 % confidence.
    wavelength_error : float
        The part of the standard error that sampling a spectrum adds; 0 of one wavelength.
    key : str
        Name in the results; empty for what was computed of figures.
    is_difference : bool
        True of a change of the figure, in which percentages differ by points.
    estimate : (float, float)
        Value and standard error as computed, also where they do not stand for the figure: the middle
        of what it may be, or noise.

    Examples
    --------
    >>> Figure(3.0, 0.3) - Figure(1.0, 0.4)
    2.00 ± 0.50
    >>> Figure(0.0, 1e-5, upper_bound=3e-5)
    below 3.0e-5 (not resolved)
    >>> f = Figure(4.0, 0.4)
    >>> (f + 1) / 5, f.sqrt(), f - f, 3.9 < f
    (1.000 ± 0.080, 2.00 ± 0.10, 0, True)
    """

    value: float
    standard_error: float
    unit: str = "1"
    more: dict[str, Any] = field(default_factory=dict)
    _: KW_ONLY
    interval: tuple[float, float] | None = None
    upper_bound: float | None = None
    wavelength_error: float = 0.0
    key: str = ""
    is_difference: bool = False
    estimate: tuple[float, float] = (math.nan, math.nan)
    #: Figures that this one is computed of, with its derivatives; none of one that is measured.
    _terms: tuple[tuple[Figure, float], ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        if math.isnan(self.estimate[0]):
            object.__setattr__(self, "estimate", (self.value, self.standard_error))
        if not self.is_resolved:
            object.__setattr__(self, "standard_error", math.nan)
            if self.upper_bound is None:
                object.__setattr__(self, "value", math.nan)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        # One NaN, so that copies are equal.
        self.__post_init__()

    @property
    def is_resolved(self) -> bool:
        """True where value and standard error stand for the figure."""
        return self.interval is None and self.upper_bound is None and self.has_value

    @property
    def has_value(self) -> bool:
        """False of the angle of a peak on the axis, or of one in the noise."""
        return "peak_place" not in self.more

    def __repr__(self) -> str:
        in_words = self.is_resolved or not self.has_value
        return str(self) if in_words else f"{self} (not resolved)"

    def __str__(self) -> str:
        return _native.shown_figure(
            *self.estimate,
            self.key,
            self.unit,
            self.interval,
            self.upper_bound,
            self.more.get("peak_place"),
            self.is_difference,
        )

    def __format__(self, spec: str) -> str:
        if not spec or not self.has_value:
            return str(self)
        if self.interval is not None:
            low, high = self.interval
            return f"{low:{spec}} to {high:{spec}}"
        if self.upper_bound is not None:
            return f"below {self.upper_bound:{spec}}"
        error = format(self.standard_error, spec.replace("+", ""))
        if not error.strip("0.e+-% "):
            if self.standard_error == 0.0:
                return f"{self.value:{spec}}"
            # Digits that show an error as 0 would claim that there is none.
            return _native.shown_figure(self.value, self.standard_error, "", "1", None, None, None)
        return f"{self.value:{spec}} ± {error}"

    def __float__(self) -> float:
        return self.value

    @property
    def _ends(self) -> tuple[float, float]:
        if self.interval is not None:
            return self.interval
        if self.upper_bound is not None:
            return self.value, self.upper_bound
        bias = float(self.more.get("bias_bound") or 0.0)
        half = bias + 2.0 * math.sqrt(max(self.standard_error**2 - bias**2 / 3.0, 0.0))
        return self.value - half, self.value + half

    def _operand(self, other: object, sign: str = "+") -> Figure | None:
        """`other` beside this figure; None of what is neither a figure nor a number."""
        if isinstance(other, Real):
            # A number has the unit of a sum, and none in a product.
            other = Figure(float(other), 0.0, self.unit if sign == "+" else "1")
        if not isinstance(other, Figure):
            return None
        for one in (self, other):
            if not one.has_value:
                _checks.refuse("operand", "a figure with a value", str(one))
        if sign == "+" and self.unit != other.unit:
            _checks.refuse("unit", f"that of the other figure, {self.unit}", other.unit)
        return other

    def _with(
        self,
        other: Operand,
        sign: Literal["+", "*", "/"],
        apply: Callable[[float, float], float],
        slopes: Callable[[float, float], tuple[float, float]],
    ) -> Figure:
        """`apply` of both; `slopes` are its derivatives, `sign` says what becomes of the units."""
        second = self._operand(other, sign)
        if second is None:
            return NotImplemented  # type: ignore[no-any-return]
        may_vanish = not second.is_resolved and second._ends[0] <= 0.0 <= second._ends[1]
        if sign == "/" and may_vanish:
            _checks.refuse("divisor", "a figure away from 0", str(second))
        value = apply(self.estimate[0], second.estimate[0])
        unit = _unit(self.unit, second.unit, sign)
        if self.is_resolved and second.is_resolved:
            return _computed(value, unit, zip((self, second), slopes(self.value, second.value)))
        if self is second and sign != "*":
            return _between(value, unit, [apply(end, end) for end in self._ends])
        return _between(value, unit, [apply(a, b) for a in self._ends for b in second._ends])

    def _of(
        self, apply: Callable[[float], float], slope: Callable[[float], float], unit: str
    ) -> Figure:
        """`apply`, monotonic on either side of 0, of this figure; `slope` is its derivative."""
        value = apply(self.estimate[0])
        if self.is_resolved:
            return _computed(value, unit, [(self, slope(self.value))])
        ends = self._ends
        turns = [0.0] if ends[0] < 0.0 < ends[1] else []
        return _between(value, unit, [apply(end) for end in (*ends, *turns)])

    def _compare(self, other: object, order: Callable[[float, float], bool]) -> bool:
        second = self._operand(other)
        if second is None:
            return NotImplemented  # type: ignore[no-any-return]
        ends = [(one.value,) if one.is_resolved else one._ends for one in (self, second)]
        answers = {order(a, b) for a in ends[0] for b in ends[1]}
        if len(answers) > 1:
            _checks.refuse("comparison", "figures whose order is resolved", f"{self} and {second}")
        return answers.pop()

    def __lt__(self, other: Operand) -> bool:
        return self._compare(other, operator.lt)

    def __le__(self, other: Operand) -> bool:
        return self._compare(other, operator.le)

    def __gt__(self, other: Operand) -> bool:
        return self._compare(other, operator.gt)

    def __ge__(self, other: Operand) -> bool:
        return self._compare(other, operator.ge)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Real):
            return self.value == float(other)
        if not isinstance(other, Figure):
            return NotImplemented
        names = [one.name for one in fields(self) if one.compare]
        return [getattr(self, name) for name in names] == [getattr(other, name) for name in names]

    def __hash__(self) -> int:
        return hash(self.value)

    def __add__(self, other: Operand) -> Figure:
        return self._with(other, "+", operator.add, lambda a, b: (1.0, 1.0))

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Figure:
        return self._with(other, "+", operator.sub, lambda a, b: (1.0, -1.0))

    def __rsub__(self, other: Number) -> Figure:
        return -self + other

    def __mul__(self, other: Operand) -> Figure:
        return self._with(other, "*", operator.mul, lambda a, b: (b, a))

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Figure:
        return self._with(other, "/", operator.truediv, lambda a, b: (1.0 / b, -a / b / b))

    def __rtruediv__(self, other: Number) -> Figure:
        return Figure(float(other), 0.0) / self

    def __neg__(self) -> Figure:
        return self * -1.0

    def __abs__(self) -> Figure:
        self._operand(0.0)
        if self.upper_bound is not None:
            return self
        return self._of(abs, lambda value: math.copysign(1.0, value), self.unit)

    def __pow__(self, exponent: Number) -> Figure:
        if not isinstance(exponent, Real):
            return NotImplemented
        power = _checks.number("exponent", float(exponent))
        self._operand(0.0)
        low, high = (self.value, self.value) if self.is_resolved else self._ends
        if low < 0.0 and not power.is_integer():
            _checks.refuse("base", f"a figure of at least 0 for the exponent {power:g}", str(self))
        if low <= 0.0 <= high and (power < 0.0 or self.is_resolved and 0.0 < power < 1.0):
            _checks.refuse("base", f"a figure away from 0 for the exponent {power:g}", str(self))
        unit = _power(self.unit, power)
        return self._of(
            lambda value: value**power,
            lambda value: power * value ** (power - 1.0) if power else 0.0,
            unit,
        )

    def sqrt(self) -> Figure:
        """The square root, which `numpy.sqrt` gives too."""
        return self**0.5

    def __round__(self, digits: int | None = None) -> float:
        return round(self.value, digits)

    @classmethod
    def of(cls, entry: Mapping[str, Any], unit: str = "1", key: str = "") -> Figure:
        """An estimate of a JSON file of the program."""
        own = ("value", "standard_error", "interval", "upper_bound")
        more = {k: v for k, v in entry.items() if k not in own}
        ends = entry.get("interval")
        of_wavelengths = abs(entry.get("wavelength_error", {}).get("value", 0.0))
        return cls(
            float(entry["value"]),
            math.hypot(entry["standard_error"], of_wavelengths),
            unit,
            more,
            interval=None if ends is None else (float(ends[0]), float(ends[1])),
            upper_bound=entry.get("upper_bound"),
            wavelength_error=of_wavelengths,
            key=key,
        )


Number = Union[float, np.floating[Any], np.integer[Any]]
Operand = Union[Figure, Number]


def _computed(value: float, unit: str, parts: Iterable[tuple[Figure, float]]) -> Figure:
    """A figure of others, each with the derivative by it; what they share counts once."""
    terms: dict[int, tuple[Figure, float]] = {}
    for part, slope in parts:
        for source, own in part._terms or ((part, 1.0),):
            before = terms.get(id(source), (source, 0.0))[1]
            terms[id(source)] = source, before + slope * own
    error = math.hypot(*(slope * one.standard_error for one, slope in terms.values()))
    of_wavelengths = math.hypot(*(slope * one.wavelength_error for one, slope in terms.values()))
    return Figure(
        value, error, unit, wavelength_error=of_wavelengths, _terms=tuple(terms.values())
    )


def _between(value: float, unit: str, ends: list[float]) -> Figure:
    """A figure that is known between two ends alone."""
    low, high = min(ends), max(ends)
    return Figure(value, 0.5 * (high - low) / math.sqrt(3.0), unit, interval=(low, high))


def _power(unit: str, power: float) -> str:
    """Unit of a power: that of the product of as many figures, where it is one."""
    if unit == "1" or power == 0.0:
        return "1"
    if power.is_integer() and power > 0.0:
        return " ".join([unit] * int(power))
    return f"({unit})^{power:g}" if " " in unit or "/" in unit else f"{unit}^{power:g}"


def _unit(first: str, second: str, sign: str) -> str:
    """Unit of a sum, product or quotient."""
    if sign == "+" or second == "1":
        return first
    if sign == "/":
        if first == second:
            return "1"
        return f"{first}/{second}" if first != "1" else f"1/{second}"
    return second if first == "1" else f"{first} {second}"
