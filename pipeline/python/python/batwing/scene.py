# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scenes of packages, solids, sources and receivers, built of Python objects.

The classes are made of the schema of the design file (``batwing schema design``), so every table
of docs/reference/design-file.md has one, and its fields are the keys of that table. A field that is
None is not written, so that the program's own default holds; a dict stands for any table.
`Scene.design` gives the `Design`, which the program checks like any other. Lengths are in
millimetres, angles in degrees, z = 0 is the bottom of the package.

Examples
--------
A glass ball above a bare LED, and what passes a plane above it:

>>> from batwing import scene, simulate
>>> ball = scene.Sphere("ball", position_mm=(0, 0, 1.2), radius_mm=0.5, medium=scene.Medium(1.5))
>>> built = scene.Scene(
...     "ball",
...     led=scene.Led(size_mm=(0.5, 0.5), height_mm=0.2, reflectance=0.8, reflection="lambertian"),
...     mirror=scene.Mirror("specular", 0.95, extent="array"),
...     array=scene.Array(pitch_mm=4.0, columns=1, rows=1),
...     light=scene.Light(wavelength_nm=550.0),
...     solids=[ball],
...     receivers=[scene.Plane("above", position_mm=(0, 0, 3), size_mm=(2, 2), bins=(4, 4))],
... )
>>> found = simulate.run(built.design(), paths=20_000).model("geometric")
>>> found.receivers["above"].values.shape
(4, 4)
"""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, make_dataclass
from keyword import iskeyword
from pathlib import Path
from types import GenericAlias
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _native
from .design import Design, PathLike
from .errors import FileError

#: Names of classes whose tables, or kinds of them, are not named as they are; as `tables` names them.
_NAMES = {
    "silicone": "Medium",
    "dome.sphere": "Dome",
    "solids.surface": "Reflector",
    "sources.rectangle": "Lambertian",
    "sources.file": "RayFile",
    "sources.table": "TableSource",
    "receivers.far_field": "FarFieldReceiver",
    "receivers.surface": "SurfaceFlux",
    "files.bands": "BandFile",
    "files.mirror": "MirrorFile",
    "files.source": "SourceFile",
}
#: Keys that are given by position too, where these are not the keys that the table needs.
_BY_POSITION = {
    "Led": ("size_mm", "height_mm", "reflection", "reflectance", "specular_fraction"),
    "Light": ("wavelength_nm",),
    "Medium": ("index", "absorption_per_mm"),
    "Meridian": ("name", "meridian_mm"),
    "Mirror": ("kind", "reflectance", "specular_fraction"),
    "Reflector": ("kind", "reflectance", "specular_fraction"),
    "Scatter": ("kind", "transmitted", "reflected"),
    "Scene": ("name",),
}


def __dir__() -> list[str]:
    return sorted(__all__)


def _field(key: str) -> str:
    """Name of the field of a key: `polarisation`, `from_`."""
    if key == "polarization":
        return "polarisation"
    return f"{key}_" if iskeyword(key) else key


def _key(name: str) -> str:
    """Key of a field."""
    return "polarization" if name == "polarisation" else name.rstrip("_")


@dataclass(frozen=True)
class Table:
    """A table of the design file."""

    #: Key and word of its kind, where the class stands for one of several.
    _tag: ClassVar[Mapping[str, str]] = {}

    def to_dict(self) -> dict[str, Any]:
        """Keys and values of the table."""
        found: dict[str, Any] = dict(self._tag)
        for one in fields(self):
            value, key = getattr(self, one.name), _key(one.name)
            if value is not None:
                found[key] = _checks.plain(type(self).__name__, value, key)
        return found


class _Whole(Table):
    """The table of all tables."""

    def design(self, folder: PathLike | None = None) -> Design:
        """The design, which names files relative to `folder` [default: the working directory]."""
        return Design(self.to_dict(), None if folder is None else os.fspath(folder))


#: Subscripts of these are computed.
_LITERAL: Any = Literal
_UNION: Any = Union
_SIMPLE = {"number": float, "integer": int, "boolean": bool, "string": str}

_Schema = Mapping[str, Any]


def _camel(word: str) -> str:
    return "".join(part[0].upper() + part[1:] for part in word.split("_"))


def _words(schema: _Schema) -> str:
    return " ".join(schema.get("description", "").split())


class _Maker:
    """Makes the classes of a schema: one for tables of the same name and keys."""

    def __init__(self, schema: _Schema) -> None:
        self.classes: dict[str, type[Table]] = {}
        self.make([schema], "", "Scene", {})

    def value(self, schema: _Schema, place: str, is_entry: bool = False) -> tuple[Any, str]:
        """Type of a value and its name; `place` is its dotted key, without numbers of entries."""
        forms = schema.get("oneOf", schema.get("anyOf", []))
        choices = [one["const"] for one in forms if "const" in one] or schema.get("enum")
        if choices:
            return _LITERAL[tuple(choices)], "{" + ", ".join(map(repr, choices)) + "}"
        if schema.get("type") == "array":
            entry, name = self.value(schema["items"], place, True)
            return GenericAlias(Sequence, (entry,)), f"sequence of {name}"
        if forms and "properties" not in forms[0]:
            types, names = zip(*(self.value(one, place) for one in forms))
            return _UNION[types], " or ".join(names)
        if forms or "properties" in schema:
            made = self.tables(forms or [schema], place, is_entry)
            words = [one.__name__ for one in made] + ["dict"]
            return _UNION[(*made, Mapping[str, Any])], " or ".join(words)
        if schema["type"] == "string":
            return PathLike, "str or path"
        return _SIMPLE[schema["type"]], _SIMPLE[schema["type"]].__name__

    def tables(self, forms: list[_Schema], place: str, is_entry: bool) -> list[type[Table]]:
        """Classes of a table: one for each kind of an entry of a list, or without a word."""
        last = place.rpartition(".")[2]
        tag = next((key for key, one in forms[0]["properties"].items() if "const" in one), None)
        if len(forms) == 1 or (tag is not None and not is_entry):
            return [self.make(forms, place, _NAMES.get(place, _camel(last)), {})]
        made = []
        for form in forms:
            title = form["title"]
            name = _camel(title) if tag else _camel(title) + _camel(last)
            name = _NAMES.get(f"{place}.{title}", name)
            made.append(self.make([form], place, name, {tag: title} if tag else {}))
        return made

    def make(
        self, forms: list[_Schema], place: str, name: str, tag: Mapping[str, str]
    ) -> type[Table]:
        """The class of a table whose kinds are told apart by a key of it."""
        keys: dict[str, list[_Schema]] = {}
        for form in forms:
            for key, one in form["properties"].items():
                keys.setdefault(key, []).append(form)
        keys = {key: one for key, one in keys.items() if key not in tag}
        names = {_field(key) for key in keys}
        known = self.classes.get(name)
        if known is not None and {one.name for one in fields(known)} != names:
            name = _camel(place.partition(".")[0]) + name
            known = self.classes.get(name)
        if known is not None:
            return known
        needed = [key for key in forms[0].get("required", []) if key in keys]
        needed = [key for key in needed if all(key in form["required"] for form in forms)]
        by_position = _BY_POSITION.get(name, tuple(needed))
        others = sorted(set(keys) - set(by_position), key=lambda key: (key not in needed, key))
        parts: list[Any] = []
        doc = [_words(forms[0]) if len(forms) == 1 else f"`{place}` of the design file.", ""]
        doc += ["Parameters", "----------"]
        for key in (*by_position, *others):
            kind, word, meaning = self.key(key, keys[key], len(forms), f"{place}.{key}".strip("."))
            own = field(kw_only=True) if key not in by_position else field()
            if key not in needed:
                kind, word = Optional[kind], f"{word}, optional"
                own = field(default=None, kw_only=key not in by_position)
            parts.append((_field(key), kind, own))
            doc += [f"{_field(key)} : {word}", f"    {meaning}"]
        bases = (Table,) if place else (_Whole,)
        about = {"__doc__": "\n".join(doc), "__module__": __name__, "_tag": tag}
        made = make_dataclass(name, parts, bases=bases, namespace=about, frozen=True)
        self.classes[name] = _both_spellings(made)
        return made

    def key(
        self, key: str, forms: list[_Schema], count: int, place: str
    ) -> tuple[Any, str, str]:
        """Type of a key, its name and what the key means, of the kinds that have it."""
        each = [form["properties"][key] for form in forms]
        if "const" in each[0]:
            kind, word = self.value({"enum": [one["const"] for one in each]}, place)
            said = [f"`{one['const']}`: {_words(form)}" for one, form in zip(each, forms)]
            return kind, word, " ".join(said)
        kind, word = self.value(each[0], place)
        of = "" if len(forms) == count else f"Of {', '.join(form['title'] for form in forms)}. "
        return kind, word, of + _words(each[0])


def _both_spellings(table: type[Table]) -> type[Table]:
    """The class, which takes and has `polarization` too where it has `polarisation`."""
    if "polarisation" not in {one.name for one in fields(table)}:
        return table
    own: Any = table.__init__

    @functools.wraps(own)
    def init(self: Table, *values: Any, **keys: Any) -> None:
        if "polarization" in keys:
            if "polarisation" in keys:
                _checks.refuse("polarization", "no polarisation beside it", keys["polarisation"])
            keys["polarisation"] = keys.pop("polarization")
        if keys.get("polarisation") == "unpolarized":
            keys["polarisation"] = "unpolarised"
        own(self, *values, **keys)

    setattr(table, "__init__", init)
    setattr(table, "polarization", property(lambda self: self.polarisation))
    return table


_CLASSES = _Maker(json.loads(_native.design_schema())).classes
globals().update(_CLASSES)
__all__ = ["Table", "write_mesh", *_CLASSES]

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...


def write_mesh(path: PathLike, corners: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
    """Writes triangles as an OBJ file for `Mesh` and `MeshDome`.

    Parameters
    ----------
    path : path
        File to write; its name ends in `.obj`.
    corners : array_like, shape (n, 3)
        Corners, in any unit; the scene states it.
    triangles : array_like of int, shape (m, 3)
        Numbers of the corners of each triangle, from 0, counterclockwise seen from outside.

    Raises
    ------
    batwing.InputError
        Another shape, corners that are not finite, numbers that no corner has.
    batwing.FileError
        A file that cannot be written.
    """
    points = _checks.floats("corners", corners)
    if points.ndim != 2 or points.shape[1] != 3:
        _checks.refuse("corners", "shape (n, 3)", _checks.describe(points))
    faces = np.asarray(triangles)
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        _checks.refuse("triangles", "whole numbers of shape (m, 3)", _checks.describe(faces))
    if faces.size == 0 or faces.min() < 0 or faces.max() >= len(points):
        got = f"{faces.min()} to {faces.max()}" if faces.size else "none"
        _checks.refuse("triangles", f"numbers from 0 to {len(points) - 1}", got)
    lines = ["v {!r} {!r} {!r}".format(*row) for row in points.tolist()]
    lines += ["f {} {} {}".format(*row) for row in (faces + 1).tolist()]
    target = Path(path)
    if target.suffix.lower() != ".obj":
        _checks.refuse("path", "a name that ends in .obj", str(target))
    try:
        target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        why = error.strerror or str(error)
        raise FileError(f"{target}: cannot write it: {why}", str(target), why, "a file") from error
