# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rays as arrays, and files of rays."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _show
from .design import PathLike

__all__ = ["RayFormat", "RayUnit", "Rays", "read_rays"]

RayFormat = Literal["tm25", "ray", "ray-text", "speos-ray", "zemax-ray", "zemax-ray-text"]
RayUnit = Literal["W", "lm"]


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of a file or of a trace.

    Attributes
    ----------
    position_mm : ndarray of float32, shape (n, 3)
        Where they start.
    direction : ndarray of float32, shape (n, 3)
        Unit vectors.
    flux : ndarray of float32, shape (n,)
        Power of each ray in `unit`.
    wavelength_nm : ndarray of float32, shape (n,), or float or None
        Wavelength of each, one of all, or none.
    unit : str
        `W` or `lm`.
    """

    position_mm: npt.NDArray[np.float32]
    direction: npt.NDArray[np.float32]
    flux: npt.NDArray[np.float32]
    wavelength_nm: npt.NDArray[np.float32] | float | None = None
    unit: RayUnit = "W"

    __repr__ = _show.brief

    def write(self, path: PathLike, format: RayFormat | None = None) -> None:
        """Writes a ray file, which sources of designs read (`sources`, docs/reference/design-file.md).

        Parameters
        ----------
        path : path
            File to write.
        format : {'tm25', 'ray', 'ray-text', 'speos-ray', 'zemax-ray', 'zemax-ray-text'}, optional
            Its format, whose ending the path has [default: the first of them with that ending].
            Wavelengths of each ray go into Speos and Zemax files alone.

        Raises
        ------
        batwing.InputError
            Arrays of other shapes, values that are not finite, flux below 0, an ending of another
            format, what the format has no place for.
        """
        word = _format(path, format)
        count = len(np.atleast_1d(self.flux))
        rows = np.full((count, 8), np.nan, dtype=np.float32)
        for key, columns in (("position_mm", slice(0, 3)), ("direction", slice(3, 6))):
            array = _checks.floats(key, getattr(self, key))
            if array.shape != (count, 3):
                _checks.refuse(key, f"shape ({count}, 3)", _checks.describe(array))
            rows[:, columns] = array
        _checks.vectors("direction", self.direction)
        flux = np.atleast_1d(_checks.floats("flux", self.flux))
        if flux.ndim != 1:
            _checks.refuse("flux", "shape (n,)", _checks.describe(flux))
        if (flux < 0).any():
            first = int(np.argmax(flux < 0))
            _checks.refuse("flux", "powers of at least 0", f"{float(flux[first])} at {_checks.entry(first)}")
        rows[:, 6] = flux
        one: float | None = None
        if self.wavelength_nm is not None:
            wavelengths = _checks.floats("wavelength_nm", self.wavelength_nm)
            if wavelengths.ndim == 0 or (wavelengths == wavelengths.flat[0]).all():
                one = float(wavelengths.flat[0])
            elif wavelengths.shape == (count,):
                rows[:, 7] = wavelengths
            else:
                expected = f"one number or shape ({count},)"
                _checks.refuse("wavelength_nm", expected, _checks.describe(wavelengths))
        if self.unit != "W":
            _checks.refuse("unit", "W", self.unit)
        _native.write_rays(os.fspath(path), word, rows, one)


def _format(path: PathLike, format: RayFormat | None) -> str:
    """The format of a file, which its ending does not contradict."""
    ending = Path(path).suffix.lower().removeprefix(".")
    endings = dict(_native.ray_endings())
    if format is not None:
        own = endings[_checks.choice("format", format, get_args(RayFormat))]
        if ending not in own:
            _checks.refuse("path", f"an ending of {format}, .{' or .'.join(own)}", f".{ending}")
        return format
    found = next((word for word, own in endings.items() if ending in own), None)
    if found is None:
        every = sorted({f".{one}" for own in endings.values() for one in own})
        _checks.refuse("path", f"an ending of {', '.join(every)}", f".{ending}")
    return found


def read_rays(path: PathLike) -> Rays:
    """Reads a ray file: TM-25, LightTools, Speos or Zemax.

    Raises
    ------
    batwing.InputError
        A file that does not keep to its format.
    """
    rows, radiant, one = _native.read_rays(os.fspath(path))
    own = rows[:, 7] if np.isfinite(rows[:, 7]).any() else None
    wavelength = own if own is not None else one
    return Rays(rows[:, :3], rows[:, 3:6], rows[:, 6], wavelength, "W" if radiant else "lm")
