# SPDX-License-Identifier: MIT OR Apache-2.0
"""Checks of arguments. Each message names the argument, what was expected and what was found."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from . import _native
from .errors import FileError, InputError, UnitWarning

Word = TypeVar("Word", bound=str)
Wanted = TypeVar("Wanted")
Floats = npt.NDArray[np.float64]


def refuse(key: str, expected: str, got: object) -> NoReturn:
    """Raises `InputError` with the parts of its message."""
    text = got if isinstance(got, str) else repr(got)
    raise InputError(f"{key}: expected {expected}, got {text}", key, text, expected)


def describe(value: Any) -> str:
    """Shape and dtype of an array, or its type."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape} and dtype {value.dtype}"
    kind, text = type(value).__name__, repr(value)
    return f"{kind} {text}" if len(text) <= 100 and "\n" not in text else f"a {kind}"


def instance(key: str, value: Any, wanted: type[Wanted], what: str) -> Wanted:
    """An object of a class of this package."""
    if not isinstance(value, wanted):
        refuse(key, what, describe(value))
    return value


def floats(key: str, value: Any) -> Floats:
    """A finite float64 array of at least one element; views stay views.

    Parameters
    ----------
    key : str
        Name of the argument.
    value : array_like
        Real numbers.
    """
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):
        refuse(key, "real numbers", describe(value))
    if array.dtype.kind not in "fiu":
        refuse(key, "real numbers (dtype float64)", describe(array if array.ndim else value))
    result: Floats = array.astype(np.float64, copy=False)
    if result.size == 0:
        refuse(key, "at least one element", describe(array))
    if not np.isfinite(result).all():
        if result.ndim == 0:
            refuse(key, "a finite number", repr(float(result)))
        at = np.unravel_index(int(np.argmin(np.isfinite(result))), result.shape)
        refuse(key, "finite numbers", f"{float(result[at])} at {entry(*at)}")
    return result


def entry(*index: int | np.integer[Any]) -> str:
    """Place of an entry of a list or an array in messages, which count from 1 as designs do."""
    return f"[{', '.join(str(int(i) + 1) for i in index)}]"


def number(key: str, value: Any) -> float:
    """A finite number."""
    if type(value) is float and value - value == 0.0:
        return value
    array = floats(key, value)
    if array.ndim != 0:
        refuse(key, "one number", describe(array))
    return float(array)


def length(key: str, value: Any) -> float:
    """A finite number above 0."""
    result = number(key, value)
    if result <= 0.0:
        refuse(key, "a length above 0", result)
    return result


def whole(key: str, value: Any, low: int, high: int) -> int:
    """A whole number from `low` to `high`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        refuse(key, f"a whole number from {low} to {high}", describe(value))
    if not low <= value <= high:
        refuse(key, f"a whole number from {low} to {high}", int(value))
    return int(value)


def choice(key: str, value: Word, allowed: Sequence[str]) -> Word:
    """One of a few words."""
    if value not in allowed:
        words = ", ".join(allowed[:-1]) + f" or {allowed[-1]}"
        refuse(key, words, value)
    return value


def memory(key: str, count: int, bytes_each: float, what: str = "directions") -> None:
    """Refuses more elements than fit into the free memory."""
    needed = count * bytes_each
    if needed < 1e8:
        return
    free = _native.free_bytes()
    if needed > free:
        most, room = f"{free / bytes_each:.2g} {what}", f"{free / 2**30:.1f} GiB of free memory"
        refuse(key, f"at most {most}, which fit into {room}", str(count))


def plain(name: str, value: Any, key: str = "") -> Any:
    """Dicts, lists, text and finite numbers of a value whose place in `name` is `key`."""

    def place(part: object) -> str:
        return f"{key}.{part}" if key else str(part)

    def wrong(expected: str) -> NoReturn:
        got = describe(value)
        raise InputError(f"{name}: {key}: expected {expected}, got {got}", key, got, expected)

    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if hasattr(value, "to_dict"):
        value = value.to_dict()
    if isinstance(value, Mapping):
        for one in value:
            if not isinstance(one, str):
                got = describe(one)
                message = f"{name}: {place(one)}: expected text as a key, got {got}"
                raise InputError(message, place(one), got, "text as a key")
        return {one: plain(name, inner, place(one)) for one, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(name, inner, key + entry(number)) for number, inner in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, float) and not np.isfinite(value):
        wrong("a finite number")
    if value is None:
        wrong("a value, or no such key")
    if not isinstance(value, (bool, int, float, str)):
        wrong("a real number, text, a list, a dict or an array")
    return value


def vectors(key: str, value: Any) -> Floats:
    """Unit vectors as rows of a contiguous array of shape (n, 3)."""
    array = floats(key, value)
    if array.ndim == 1 and array.shape == (3,):
        array = array[np.newaxis]
    if array.ndim != 2 or array.shape[1] != 3:
        refuse(key, "unit vectors, shape (n, 3)", describe(array))
    lengths = np.sqrt(np.einsum("ij,ij->i", array, array))
    worst = int(np.argmax(np.abs(lengths - 1.0)))
    if abs(float(lengths[worst]) - 1.0) > 1e-6:
        refuse(key, "unit vectors", f"a length of {float(lengths[worst]):.6g} at {entry(worst)}")
    return np.ascontiguousarray(array / lengths[:, np.newaxis])


def threads(value: int | None) -> int | None:
    """A number of threads, or none for the default."""
    return None if value is None else whole("threads", value, 1, 1024)


def one_unit(period: float, wavelength: float) -> None:
    """Warns of a period and a wavelength that are probably in different units."""
    ratio = period / wavelength
    least, most = _native.USUAL_RATIOS
    if not least <= ratio <= most:
        warnings.warn(
            f"a period of {period:g} beside a wavelength of {wavelength:g}: both are in micrometres, "
            f"and their ratio {ratio:g} suggests that one is in another unit",
            UnitWarning,
            stacklevel=4,
        )


def text(path: str | os.PathLike[str]) -> str:
    """Text of a file in UTF-8."""
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        name = os.fspath(path)
        raise FileError(f"{name}: cannot read it: {error}", name, str(error), "a text file") from error
