# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scenes of packages, solids, sources and receivers, built of Python objects.

Every object is a table of the design file (docs/reference/design-file.md), and its fields are the
keys of that table. A field that is None is not written, so that the program's own default holds.
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

import os
from collections.abc import Mapping, Sequence
from dataclasses import InitVar, dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt

from . import _checks
from .design import Design, PathLike
from .errors import FileError

__all__ = [
    "Array",
    "Box",
    "CGamma",
    "Chip",
    "Cosine",
    "Cylinder",
    "Disc",
    "Dome",
    "FarFieldReceiver",
    "Isotropic",
    "Lambertian",
    "Led",
    "Light",
    "Luminance",
    "Medium",
    "Mesh",
    "Meridian",
    "MeridianDome",
    "MeshDome",
    "Mirror",
    "Plane",
    "RayFile",
    "Receiver",
    "Rectangle",
    "Reflector",
    "Scatter",
    "Scene",
    "Solid",
    "Source",
    "Sphere",
    "SurfaceFlux",
    "Table",
    "write_mesh",
]

Vector = Sequence[float]
Reflection = Literal["specular", "lambertian", "mixed", "absorbing"]
Scattering = Literal["lambertian", "gaussian", "file"]
Extent = Literal["array", "package"]
Arrangement = Literal["square", "hexagonal"]
Weighting = Literal["radiometric", "photometric"]
LightPolarisation = Literal["unpolarised", "carried"]
LengthUnit = Literal["um", "mm", "cm", "m", "inch"]
Normal = Literal["+z", "-z", "+x", "-x", "+y", "-y"]


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True)
class Table:
    """A table of the design file."""

    #: Value of the key `kind`, where the table has one that the class decides.
    kind_word: ClassVar[str | None] = None
    #: Keys of fields that are called otherwise.
    keys: ClassVar[Mapping[str, str]] = {}

    def to_dict(self) -> dict[str, Any]:
        """Keys and values of the table."""
        found = {} if self.kind_word is None else {"kind": self.kind_word}
        for one in fields(self):
            value = getattr(self, one.name)
            if value is not None:
                found[self.keys.get(one.name, one.name)] = _plain(value)
        return found


def _plain(value: Any) -> Any:
    if isinstance(value, Table):
        return value.to_dict()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return os.fspath(value) if isinstance(value, os.PathLike) else value


@dataclass(frozen=True)
class Medium(Table):
    """What light passes: `[silicone]`, and `medium` of a solid."""

    index: float | None = None
    absorption_per_mm: float | None = None
    material_file: PathLike | None = None


@dataclass(frozen=True)
class Reflector(Table):
    """An opaque surface: `surface` of a solid. `kind` is `specular`, `lambertian`, `mixed` or `absorbing`."""

    kind: Reflection
    reflectance: float | None = None
    specular_fraction: float | None = None
    substrate: Mapping[str, Any] | None = None
    coating: Sequence[Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class Mirror(Reflector):
    """The plane z = 0: `[mirror]`. `extent` is `array` or `package`."""

    extent: Extent | None = None


@dataclass(frozen=True)
class Scatter(Table):
    """A diffuser: `scatter` of a solid or sheet. `kind` is `lambertian`, `gaussian` or `file`."""

    kind: Scattering
    transmitted: float | None = None
    reflected: float | None = None
    width_deg: float | None = None
    reflected_width_deg: float | None = None
    file: PathLike | None = None
    inner: Sequence[PathLike] | None = None
    outer: Sequence[PathLike] | None = None
    between: Literal["fixed", "shifted"] | None = None


@dataclass(frozen=True)
class Dome(Table):
    """A truncated sphere on a short cylinder: `[dome]`."""

    sphere_radius_mm: float
    height_mm: float
    width_mm: float
    coating: Sequence[Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class MeridianDome(Table):
    """A dome by its generating curve: rows (r, z), (r, z, bulge) or (r, z, r_c, z_c)."""

    meridian_mm: Sequence[Vector]
    coating: Sequence[Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class MeshDome(Table):
    """A dome by a file of triangles; see `write_mesh`."""

    mesh: PathLike
    mesh_unit: LengthUnit
    coating: Sequence[Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class Led(Table):
    """The box on the bottom: `[led]`. It emits from its top where the scene has no sources."""

    size_mm: Vector
    height_mm: float
    reflection: Reflection
    reflectance: float | None = None
    specular_fraction: float | None = None
    offset_mm: Vector | None = None
    tilt_deg: Vector | None = None
    power_w: float | None = None
    power_lm: float | None = None


@dataclass(frozen=True)
class Array(Table):
    """Places of the packages: `[array]`."""

    pitch_mm: float | Sequence[float]
    columns: int | None = None
    rows: int | None = None
    arrangement: Arrangement | None = None
    positions_file: PathLike | None = None
    crossing: bool | None = None


@dataclass(frozen=True)
class Light(Table):
    """The light of all sources that state none of their own: `[light]`."""

    keys = {"polarisation": "polarization"}
    wavelength_nm: float | None = None
    spectrum: Mapping[str, Any] | None = None
    weighting: Weighting | None = None
    polarisation: LightPolarisation | None = None
    polarization: InitVar[LightPolarisation | None] = None

    def __post_init__(self, polarization: LightPolarisation | None) -> None:
        if polarization is not None:
            object.__setattr__(self, "polarisation", polarization)


@dataclass(frozen=True, kw_only=True)
class _Placed(Table):
    """What every solid and sheet has."""

    per: Extent | None = None
    position_mm: Vector | None = None
    medium: Medium | None = None
    surface: Reflector | None = None
    scatter: Scatter | None = None
    coating: Sequence[Mapping[str, Any]] | None = None
    optical_contact: str | Sequence[str] | None = None


@dataclass(frozen=True)
class Solid(_Placed):
    """A solid or a sheet of `[[solids]]`: it has a `medium`, a `surface` or a `scatter`."""

    name: str


@dataclass(frozen=True)
class Box(Solid):
    """A box of lengths along x, y, z."""

    kind_word = "box"
    size_mm: Vector
    rotation_deg: Vector | None = None


@dataclass(frozen=True)
class Cylinder(Solid):
    """A cylinder; its axis is z unless given."""

    kind_word = "cylinder"
    radius_mm: float
    height_mm: float
    axis: Vector | None = None


@dataclass(frozen=True)
class Sphere(Solid):
    """A ball."""

    kind_word = "sphere"
    radius_mm: float


@dataclass(frozen=True)
class Meridian(Solid):
    """A body of revolution: rows as of `MeridianDome`, from the axis back to the axis."""

    kind_word = "meridian"
    meridian_mm: Sequence[Vector]
    axis: Vector | None = None


@dataclass(frozen=True)
class Mesh(Solid):
    """A solid by a file of triangles; see `write_mesh`."""

    kind_word = "mesh"
    mesh: PathLike
    mesh_unit: LengthUnit
    rotation_deg: Vector | None = None


@dataclass(frozen=True)
class Rectangle(Solid):
    """A flat sheet of lengths along x and y, without thickness."""

    kind_word = "rectangle"
    size_mm: Vector
    rotation_deg: Vector | None = None


@dataclass(frozen=True)
class Disc(Solid):
    """A flat round sheet, without thickness."""

    kind_word = "disc"
    radius_mm: float
    axis: Vector | None = None


@dataclass(frozen=True, kw_only=True)
class _Emitting(Table):
    """What every source has."""

    power: float | None = None
    wavelength_nm: float | None = None
    spectrum: Mapping[str, Any] | None = None
    light: str | None = None


@dataclass(frozen=True)
class Source(_Emitting):
    """What emits, in every package: `[[sources]]`."""

    name: str


@dataclass(frozen=True)
class Isotropic(Source):
    """A point that emits the same into all directions."""

    kind_word = "isotropic"
    position_mm: Vector
    inside: str | None = None


@dataclass(frozen=True)
class Cosine(Source):
    """A point whose intensity goes with a power of the cosine to its normal."""

    kind_word = "cosine"
    position_mm: Vector
    exponent: float
    normal: Vector | None = None
    inside: str | None = None


@dataclass(frozen=True)
class Lambertian(Source):
    """A rectangle that emits on one side by the cosine law."""

    kind_word = "rectangle"
    position_mm: Vector
    size_mm: Vector
    normal: Vector | None = None
    inside: str | None = None


@dataclass(frozen=True)
class Chip(Source):
    """Top and sides of the box: powers of the top and of the sides to +x, -x, +y, -y."""

    kind_word = "chip"
    face_powers: Vector


@dataclass(frozen=True)
class RayFile(Source):
    """A file of rays or of a far field; `Rays.write` makes one of arrays."""

    kind_word = "file"
    position_mm: Vector
    file: PathLike
    inside: str | None = None
    rotation_deg: Vector | None = None


@dataclass(frozen=True, kw_only=True)
class _Reading(Table):
    """What every receiver has."""

    only: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Receiver(_Reading):
    """What counts light: `[[receivers]]`. `only` selects which."""

    name: str


@dataclass(frozen=True)
class Plane(Receiver):
    """Irradiance on a rectangle."""

    kind_word = "plane"
    position_mm: Vector
    size_mm: Vector
    bins: Sequence[int]
    normal: Normal | None = None
    stokes: bool | None = None
    spot_mm: float | None = None


@dataclass(frozen=True)
class FarFieldReceiver(Receiver):
    """Intensity over theta and phi."""

    kind_word = "far_field"
    theta_bin_deg: float
    phi_bin_deg: float
    stokes: bool | None = None


@dataclass(frozen=True)
class CGamma(Receiver):
    """Intensity on C-gamma planes."""

    kind_word = "c_gamma"
    theta_bin_deg: float
    phi_bin_deg: float
    stokes: bool | None = None


@dataclass(frozen=True)
class Luminance(Receiver):
    """Radiance on a rectangle by place and direction."""

    kind_word = "luminance"
    position_mm: Vector
    size_mm: Vector
    bins: Sequence[int]
    theta_bin_deg: float
    phi_bin_deg: float
    normal: Normal | None = None
    stokes: bool | None = None
    theta_max_deg: float | None = None
    spot_mm: float | None = None


@dataclass(frozen=True)
class SurfaceFlux(Receiver):
    """Flux on the surfaces of one name."""

    kind_word = "surface"
    surface: str


@dataclass(frozen=True)
class Scene(Table):
    """A whole design.

    Parameters
    ----------
    name : str
        Names results.
    led, mirror, array, light : Led, Mirror, Array, Light
        The box, the bottom, the places of the packages, and the light.
    dome : Dome, MeridianDome or MeshDome, optional
        The encapsulant; without it the package is a bare box.
    silicone : Medium, optional
        What the dome is made of; goes with `dome`.
    solids, sources, receivers : sequence, optional
        Further bodies, emitters and receivers.
    description : str, optional
        One line for people.
    others : dict, optional
        Further tables as in the design file, such as ``{"receiver": {"plane_height_mm": 4.0}}``.
    """

    name: str
    led: Led
    mirror: Mirror
    array: Array
    light: Light
    dome: Dome | MeridianDome | MeshDome | None = None
    silicone: Medium | None = None
    solids: Sequence[Solid] | None = None
    sources: Sequence[Source] | None = None
    receivers: Sequence[Receiver] | None = None
    description: str | None = None
    others: Mapping[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Keys and values of the design file."""
        found = super().to_dict()
        others = found.pop("others", {})
        for key in others:
            if key in found:
                _checks.refuse(f"others.{key}", "a table that the scene has no field for", key)
        return {**found, **others}

    def design(self, folder: PathLike | None = None) -> Design:
        """The design, which names files relative to `folder` [default: the working directory]."""
        return Design(self.to_dict(), None if folder is None else os.fspath(folder))


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
