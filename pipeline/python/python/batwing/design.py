# SPDX-License-Identifier: MIT OR Apache-2.0
"""Designs of LED packages as objects: read, altered, checked."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeAlias, Union, runtime_checkable

import numpy as np

from . import _checks, _native, _show, live
from .errors import FileError
from .gratings import Grating, Material, Polygon, Relief

__all__ = [
    "NAME",
    "Design",
    "DesignLike",
    "FileLike",
    "PathLike",
    "StatedDesign",
    "read_toml",
    "stated",
    "stated_file",
]


def __dir__() -> list[str]:
    return sorted(__all__)


PathLike: TypeAlias = Union[str, os.PathLike[str]]

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

    __repr__ = _show.brief

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
        """A copy with some keys set, such as ``{"led.reflectance": 0.6}``.

        Entries of lists stand in brackets from 1: ``{"solids[1].radius_mm": 0.5}``. Names of entries,
        which studies take, are not known here.

        Raises
        ------
        batwing.InputError
            An entry that a list does not have, a key below a number or text.
        """
        data = _checks.plain(NAME, self.data)
        for key, value in values.items():
            *path, last = re.sub(r"\[(\d+)\]", lambda m: f".{int(m[1]) - 1}", key).split(".")
            table: Any = data
            for number, part in enumerate(path):
                if isinstance(table, list):
                    table = table[_entry(key, part, table)]
                else:
                    table = table.setdefault(part, {})
                if not isinstance(table, (dict, list)):
                    before = ".".join(path[: number + 1])
                    _checks.refuse(key, f"{before} to be a table or a list", _checks.describe(table))
            table[_entry(key, last, table) if isinstance(table, list) else last] = value
        return Design(data, self.folder)

    def to_toml(self) -> str:
        """The text of the design file."""
        return _toml_text(NAME, self.data)

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
        _native.call(["check", NAME, "--quiet"], {NAME: self.to_toml()}, self.folder)

    def explore(self) -> live.Explorer:
        """Shows the design in a page in which its numbers are turned: `batwing.live.explore`."""
        return live.explore(self)


def _entry(key: str, part: str, entries: list[Any]) -> int:
    if not (part.isdecimal() and int(part) < len(entries)):
        got = int(part) + 1 if part.lstrip("-").isdecimal() else part
        _checks.refuse(key, f"an entry of a list from [1] to [{len(entries)}]", got)
    return int(part)


def _toml_text(name: str, data: Mapping[str, Any]) -> str:
    return _native.toml_of_json(json.dumps(_checks.plain(name, data)))


@runtime_checkable
class _Scene(Protocol):
    """`batwing.scene.Scene`."""

    def design(self) -> Design: ...


DesignLike: TypeAlias = Union[PathLike, Mapping[str, Any], Design, _Scene]
FileLike: TypeAlias = Union[PathLike, Mapping[str, Any]]


class StatedDesign(NamedTuple):
    """What a command is told of a design.

    Attributes
    ----------
    name : str
        Path of its file, or `NAME`.
    texts : dict of str
        TOML of a design that is no file, by its name.
    folder : str or None
        Where the files lie that the text names.
    """

    name: str
    texts: dict[str, str] = {}
    folder: str | None = None


def stated(design: DesignLike) -> StatedDesign:
    """A path, a dict, a `Design` or a scene as commands take it."""
    if isinstance(design, (str, os.PathLike)):
        return StatedDesign(os.fspath(design))
    if isinstance(design, _Scene):
        design = design.design()
    if not isinstance(design, (Mapping, Design)):
        _checks.refuse("design", "a path, a dict, a Design or a Scene", _checks.describe(design))
    if not isinstance(design, Design):
        design = Design(dict(design))
    return StatedDesign(NAME, {NAME: design.to_toml()}, design.folder)


def stated_file(name: str, file: FileLike) -> tuple[str, dict[str, str]]:
    """Name of a study, problem or tolerance file as commands take it, and texts in place of files.

    Under `design` and `designs` of a dict stands what `stated` takes. A dict is called `name`;
    files that it names lie in the working directory.
    """
    if isinstance(file, (str, os.PathLike)):
        return os.fspath(file), {}
    if not isinstance(file, Mapping):
        _checks.refuse("file", "the path of a file or a dict", _checks.describe(file))
    data, texts = dict(file), dict[str, str]()
    if "design" in data:
        data["design"] = _named(data["design"], texts)
    if isinstance(data.get("designs"), (list, tuple)):
        paths = {os.fspath(one) for one in data["designs"] if isinstance(one, (str, os.PathLike))}
        data["designs"] = [_named(one, texts, paths) for one in data["designs"]]
    texts[name] = _toml_text(name, data)
    return name, texts


def _named(design: DesignLike, texts: dict[str, str], taken: Collection[str] = ()) -> str:
    """The name of a design in a file; one that is no file goes into `texts`."""
    name, own, folder = stated(design)
    if not own:
        return name
    stem, ending = os.path.splitext(os.path.join(folder or "", name))
    path, number = stem + ending, 1
    while path in texts or path in taken:
        number += 1
        path = f"{stem}-{number}{ending}"
    texts[path] = own[name]
    return path
