# SPDX-License-Identifier: MIT OR Apache-2.0
"""Designs of LED packages as objects: read, altered, checked."""

from __future__ import annotations

import copy
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Union

import numpy as np

from . import _checks, _native
from .errors import FileError
from .rcwa import Grating, Material, Polygon, Relief

if TYPE_CHECKING:
    from typing_extensions import TypeAlias

__all__ = ["NAME", "Design", "DesignLike", "PathLike", "StatedDesign", "read_toml", "stated"]

PathLike: TypeAlias = "Union[str, os.PathLike[str]]"

#: Name in messages and under `inputs` of results of a design that is no file.
NAME = "design.toml"


def read_toml(path: PathLike) -> dict[str, Any]:
    """The tables of a TOML file."""
    return _parsed(os.fspath(path), _checks.text(path))


def _parsed(name: str, text: str) -> dict[str, Any]:
    # The standard library reads TOML from Python 3.11 on.
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{name}: expected TOML: {error}", name, str(error), "TOML") from error


@dataclass(frozen=True)
class Design:
    """A design as a dict of the keys of a design file.

    Parameters
    ----------
    data : dict
        Keys and values as in docs/reference/design-file.md.
    folder : path, optional
        Where the files lie that the design names [default: the working directory].
    """

    data: dict[str, Any]
    folder: str | None = None

    @classmethod
    def read(cls, path: PathLike) -> Design:
        """The design of a file.

        Raises
        ------
        batwing.FileError
            A file that cannot be read or is no TOML.
        """
        return cls(read_toml(path), str(Path(path).resolve().parent))

    @classmethod
    def template(cls, name: str = "my-package") -> Design:
        """The design that `batwing new` writes to start from."""
        return cls(_parsed(f"{name}.toml", _native.new_design(name)))

    def with_values(self, values: Mapping[str, Any]) -> Design:
        """A copy with some keys set, such as ``{"led.reflectance": 0.6}``."""
        data = copy.deepcopy(self.data)
        for key, value in values.items():
            *path, last = key.split(".")
            table = data
            for part in path:
                table = table.setdefault(part, {})
                if not isinstance(table, dict):
                    _checks.refuse(key, f"{part} to be a table", _checks.describe(table))
            table[last] = value
        return Design(data, self.folder)

    def to_toml(self) -> str:
        """The text of the design file."""
        return _toml_text(self.data)

    def ring(self, number: int) -> tuple[Grating, float]:
        """The unit cell of one ring of the relief, and the wavelength in micrometres.

        Parameters
        ----------
        number : int
            Ring, from 1, from the axis.

        Returns
        -------
        grating : batwing.rcwa.Grating
            The silicone is on top.
        wavelength_um : float
            Wavelength of the design.

        Raises
        ------
        batwing.InputError
            A ring that the design does not have, or a smooth one.
        """
        number = _checks.whole("number", number, 1, 1_000_000)
        period, depth, around, inner, polygons, wavelength = _native.design_cell(
            NAME, self.to_toml(), self.folder or "", number
        )
        background = Material.constant(around)
        outlines = tuple(
            Polygon(Material.constant(index), np.array(points)) for index, points in polygons
        )
        relief = Relief(period, depth, background, outlines)
        return Grating(relief, Material.constant(inner), background), wavelength

    def check(self) -> None:
        """Checks the design.

        Raises
        ------
        batwing.InputError
            The first key that is wrong, with what was found and what was expected.
        """
        _native.call(["check", NAME, "--quiet"], self.to_toml(), self.folder)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    _checks.refuse("design", "numbers, text, lists, dicts and arrays", _checks.describe(value))


def _toml_text(data: Mapping[str, Any]) -> str:
    try:
        text = json.dumps(data, default=_plain, allow_nan=False)
    except ValueError:
        _checks.refuse("design", "finite numbers", "nan or infinity")
    return _native.toml_of_json(text)


DesignLike: TypeAlias = "Union[PathLike, Mapping[str, Any], Design]"


class StatedDesign(NamedTuple):
    """What a command is told of a design.

    Attributes
    ----------
    name : str
        Path of its file, or `NAME`.
    text : str or None
        TOML of a design that is no file.
    folder : str or None
        Where the files lie that the text names.
    """

    name: str
    text: str | None = None
    folder: str | None = None


def stated(design: DesignLike) -> StatedDesign:
    """A path, a dict or a `Design` as commands take it."""
    if isinstance(design, (str, os.PathLike)):
        return StatedDesign(os.fspath(design))
    if not isinstance(design, (Mapping, Design)):
        _checks.refuse("design", "a path, a dict or a Design", _checks.describe(design))
    if not isinstance(design, Design):
        design = Design(dict(design))
    return StatedDesign(NAME, design.to_toml(), design.folder)
