# SPDX-License-Identifier: MIT OR Apache-2.0
"""Gratings: materials, reliefs of polygons, and the half-spaces above and below them."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias, Union, get_args

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _show
from ._checks import Floats
from .errors import ReliefWarning

__all__ = ["Base", "Grating", "Index", "Material", "Polygon", "Relief", "Side"]

Side = Literal["top", "bottom"]
Base = Side

#: Highest order that the solver keeps.
MAX_ORDERS = 2000
#: Slices to a wavelength of depth where neither slices nor a tolerance are given.
SLICES_PER_WAVELENGTH = 24.0


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True)
class Material:
    """A refractive index n + ik, constant or with dispersion.

    Parameters
    ----------
    name : str
        For pictures and messages.
    value : complex, optional
        The index at every wavelength.
    yaml : str, optional
        Text of a file of refractiveindex.info, or of a catalogue of one glass.

    Examples
    --------
    >>> Material.constant(1.41).index(0.55)
    (1.41+0j)
    """

    name: str
    value: complex | None = None
    yaml: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if (self.value is None) == (self.yaml is None):
            _checks.refuse("material", "a value or the text of a file, one of them", "both or none")
        if self.value is not None:
            _index_of("value", self.value)

    @classmethod
    def constant(cls, index: float | complex, name: str = "") -> Material:
        """The same index at every wavelength."""
        return cls(name or f"n = {complex(index):g}", complex(index))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Material:
        """A material file: YAML or CSV of refractiveindex.info, or a glass catalogue of one glass.

        Raises
        ------
        batwing.FileError
            If the file cannot be read.
        """
        return cls(Path(path).stem, None, _checks.text(path))

    @classmethod
    def tabulated(
        cls, wavelength_um: npt.ArrayLike, n: npt.ArrayLike, k: npt.ArrayLike = 0.0
    ) -> Material:
        """A table of wavelengths in micrometres, ascending, with n and k at each."""
        rows = np.broadcast_arrays(
            _checks.floats("wavelength_um", wavelength_um),
            _checks.floats("n", n),
            _checks.floats("k", k),
        )
        lines = ["DATA:", "  - type: tabulated nk", "    data: |"]
        lines += [f"        {w!r} {a!r} {b!r}" for w, a, b in zip(*(r.tolist() for r in rows))]
        return cls("table", None, "\n".join(lines) + "\n")

    def _is_same(self, other: Material) -> bool:
        return (self.value, self.yaml) == (other.value, other.yaml)

    def index(self, wavelength_um: float) -> complex:
        """Index n + ik at a vacuum wavelength in micrometres.

        Raises
        ------
        batwing.InputError
            A wavelength outside the data.
        """
        if self.value is not None:
            return self.value
        assert self.yaml is not None
        return _native.material_indices(self.yaml, [_checks.length("wavelength_um", wavelength_um)])[0]


Index: TypeAlias = Union[float, complex, Material]


def _index_of(key: str, value: Any) -> complex:
    try:
        index = complex(value)
    except (TypeError, ValueError):
        _checks.refuse(key, "a refractive index or a Material", _checks.describe(value))
    passive = math.isfinite(index.real) and index.real >= 0 and math.isfinite(index.imag)
    if not (passive and index.imag >= 0 and index != 0):
        _checks.refuse(key, "an index n + ik with n >= 0, k >= 0, not both 0", index)
    return index


def _material(key: str, value: Index) -> Material:
    if isinstance(value, Material):
        return value
    return Material.constant(_index_of(key, value))


@dataclass(frozen=True, init=False, eq=False)
class Polygon:
    """A closed outline of one material.

    Parameters
    ----------
    material : Material
        What it is made of.
    points_um : ndarray, shape (n, 2)
        Corners (x, z) in order, either sense; a copy that cannot be written.
    """

    material: Material
    points_um: Floats

    def __init__(self, material: Index, points_um: npt.ArrayLike) -> None:
        points = _checks.floats("points_um", points_um)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
            _checks.refuse("points_um", "at least 3 corners, shape (n, 2)", _checks.describe(points))
        points = points.copy()
        points.setflags(write=False)
        object.__setattr__(self, "points_um", points)
        object.__setattr__(self, "material", _material("material", material))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Polygon):
            return NotImplemented
        same = np.array_equal(self.points_um, other.points_um)
        return same and self.material == other.material

    def __hash__(self) -> int:
        return hash((self.material, self.points_um.tobytes()))

    def __reduce__(self) -> tuple[type[Polygon], tuple[Material, Floats]]:
        # Arrays forget when they are copied that they cannot be written.
        return Polygon, (self.material, self.points_um)

    __repr__ = _show.brief


@dataclass(frozen=True, init=False)
class Relief:
    """One period of a relief: polygons in a background.

    Parameters
    ----------
    period_um : float
        Length of a period along x.
    depth_um : float
        Extent along z; polygons lie within 0 to this.
    background : Material
        What fills the rest.
    polygons : tuple of Polygon
        Later ones lie over earlier ones.
    """

    period_um: float
    depth_um: float
    background: Material
    polygons: tuple[Polygon, ...]
    #: True where nobody said on which half-space the ridges stand.
    _is_base_assumed: bool = field(default=False, init=False, repr=False, compare=False)

    def __init__(
        self,
        period_um: float,
        depth_um: float,
        background: Index,
        polygons: Sequence[Polygon] = (),
    ) -> None:
        put = object.__setattr__
        put(self, "period_um", _checks.length("period_um", period_um))
        put(self, "depth_um", _checks.length("depth_um", depth_um))
        put(self, "background", _material("background", background))
        for number, polygon in enumerate(polygons):
            if not isinstance(polygon, Polygon):
                _checks.refuse(f"polygons{_checks.entry(number)}", "a Polygon", _checks.describe(polygon))
        put(self, "polygons", tuple(polygons))

    __repr__ = _show.brief

    @classmethod
    def polygon(
        cls, period_um: float, points_um: npt.ArrayLike, ridge: Index, groove: Index
    ) -> Relief:
        """One polygon of `ridge` in `groove`; the depth is its largest z."""
        outline = Polygon(_material("ridge", ridge), points_um)
        depth = float(outline.points_um[:, 1].max())
        return cls(period_um, depth, _material("groove", groove), (outline,))

    @classmethod
    def lamellar(
        cls, period_um: float, depth_um: float, fill: float, ridge: Index, groove: Index
    ) -> Relief:
        """A ridge from x = 0 over the share `fill` of the period, 0 < fill < 1."""
        if not 0.0 < _checks.number("fill", fill) < 1.0:
            _checks.refuse("fill", "a share between 0 and 1", fill)
        x, z = fill * _checks.length("period_um", period_um), _checks.length("depth_um", depth_um)
        return cls.polygon(period_um, np.array([[0, 0], [x, 0], [x, z], [0, z]]), ridge, groove)

    @classmethod
    def triangle(
        cls,
        period_um: float,
        apex_um: Sequence[float],
        ridge: Index,
        groove: Index,
        *,
        base: Base | None = None,
    ) -> Relief:
        """A triangle whose base is the whole period, with its apex at (x, height above the base).

        Parameters
        ----------
        period_um : float
            Length of the base.
        apex_um : (float, float)
            x of the apex, and its height above the base.
        ridge, groove : Material or complex
            What the triangle is made of, and what lies beside it.
        base : {'top', 'bottom'}, optional
            Half-space on which the base stands: `top` for ridges of the top half-space, such as the
            silicone of a dome; `bottom` for ridges on a substrate [default: `top`, with a warning
            where the ridges are of another material].
        """
        apex = _checks.floats("apex_um", apex_um)
        if apex.shape != (2,):
            _checks.refuse("apex_um", "(x, height)", _checks.describe(apex))
        corners = [[0.0, 0.0], [_checks.length("period_um", period_um), 0.0], apex.tolist()]
        return cls._on(base, period_um, np.array(corners), ridge, groove)

    @classmethod
    def _on(
        cls, base: Base | None, period_um: float, points: Floats, ridge: Index, groove: Index
    ) -> Relief:
        """A polygon of corners (x, height) on a half-space."""
        if base is not None and _checks.choice("base", base, get_args(Base)) == "bottom":
            points = np.stack([points[:, 0], points[:, 1].max() - points[:, 1]], axis=1)
        made = cls.polygon(period_um, points, ridge, groove)
        object.__setattr__(made, "_is_base_assumed", base is None)
        return made

    @classmethod
    def steps(
        cls,
        tread_um: float,
        riser_um: float,
        ridge: Index,
        groove: Index,
        *,
        base: Base | None = None,
    ) -> Relief:
        """Steps seen along their slope: a right triangle whose hypotenuse is the period.

        `base` is the half-space on which they stand, as of `triangle`.
        """
        tread, riser = _checks.length("tread_um", tread_um), _checks.length("riser_um", riser_um)
        chord = math.hypot(tread, riser)
        apex = (tread * (tread / chord), riser * (tread / chord))
        return cls.triangle(chord, apex, ridge, groove, base=base)

    @classmethod
    def sinusoid(
        cls,
        period_um: float,
        depth_um: float,
        ridge: Index,
        groove: Index,
        sides: int = 64,
        *,
        base: Base | None = None,
    ) -> Relief:
        """Ridges of height depth (1 - cos 2 pi x/period)/2 above their base.

        They are a polygon of `sides` straight pieces, 4 or more; `base` is the half-space on which
        they stand, as of `triangle`.
        """
        count = _checks.whole("sides", sides, 4, 4096)
        period, depth = _checks.length("period_um", period_um), _checks.length("depth_um", depth_um)
        number = np.arange(count + 1)
        # Through the nearer end, so that both halves have the very same heights.
        half_turn = np.pi * np.minimum(number, count - number) / count
        points = np.stack([period * number / count, depth * np.sin(half_turn) ** 2], axis=1)
        return cls._on(base, period, points, ridge, groove)

    def _floating(self, top: Material, bottom: Material) -> tuple[list[str], str] | None:
        """Half-spaces of whose material ridges are that do not stand there, and the warning."""
        known: list[Material] = []

        def number(material: Material) -> int:
            for place, one in enumerate(known):
                if one._is_same(material):
                    return place
            known.append(material)
            return len(known) - 1

        around = (number(self.background), number(top), number(bottom))
        each = [(number(p.material), p.material.name, p.points_um.tolist()) for p in self.polygons]
        return _native.floating_ridges(self.period_um, self.depth_um, around, each)

    def plot(self, ax: Any = None) -> Any:
        """Draws the cross-section with matplotlib; returns the axes."""
        return _show.relief(self, ax)


class _Prepared:
    """Native interfaces of a grating by wavelength, and resolutions found; no part of its value."""

    def __init__(self) -> None:
        self.interfaces: dict[float, _native.Interface] = {}
        self.losses: dict[float, bool] = {}
        self.resolutions: dict[tuple[float, float], tuple[int, int, float]] = {}
        self.slices: dict[float, int] = {}

    def __reduce__(self) -> tuple[type[_Prepared], tuple[()]]:
        return _Prepared, ()

    def __deepcopy__(self, memo: Any) -> _Prepared:
        return _Prepared()


@dataclass(frozen=True, init=False)
class Grating:
    """A relief between two half-spaces.

    Parameters
    ----------
    relief : Relief
        The relief.
    top, bottom : Material or complex
        Half-spaces above z = 0 and below z = depth.

    Warns
    -----
    batwing.ReliefWarning
        Ridges of the material of a half-space that do not stand on it; ridges of another material
        than the top half-space whose base is not stated.
    """

    relief: Relief
    top: Material
    bottom: Material
    _prepared: _Prepared = field(init=False, repr=False, compare=False)

    def __init__(self, relief: Relief, top: Index, bottom: Index) -> None:
        if not isinstance(relief, Relief):
            _checks.refuse("relief", "a Relief", _checks.describe(relief))
        put = object.__setattr__
        put(self, "relief", relief)
        put(self, "top", _material("top", top))
        put(self, "bottom", _material("bottom", bottom))
        put(self, "_prepared", _Prepared())
        floating = relief._floating(self.top, self.bottom)
        ridge = relief.polygons[0].material if relief._is_base_assumed else self.top
        if floating is None and not ridge._is_same(self.top):
            warnings.warn(
                f"the ridges of {ridge.name} stand on the top half-space, since no base is stated: "
                "base='top' or 'bottom' of Relief.triangle, steps or sinusoid states it",
                ReliefWarning,
                stacklevel=2,
            )
        if floating is not None:
            sides, words = floating
            warnings.warn(
                f"{words}; base={sides[-1]!r} of Relief.triangle, steps or sinusoid places them there",
                ReliefWarning,
                stacklevel=2,
            )

    __repr__ = _show.brief

    def _residual(self, wavelength_um: float, residual: float, *powers: Floats) -> float:
        """\\|R + T - 1\\| of a solver; with loss, of powers (direction, order, ...) what exceeds 1."""
        if not self._prepared.losses[wavelength_um]:
            return residual
        total = sum(one.sum(axis=(1, -1)) for one in powers)
        return max(float(np.max(total)) - 1.0, 0.0)

    def _at(self, wavelength_um: float) -> _native.Interface:
        known = self._prepared.interfaces
        found = known.get(wavelength_um)
        if found is None:
            relief = self.relief
            _checks.one_unit(relief.period_um, wavelength_um)
            around = [m.index(wavelength_um) for m in (relief.background, self.top, self.bottom)]
            inside = [polygon.material.index(wavelength_um) for polygon in relief.polygons]
            found = _native.Interface(
                relief.period_um,
                relief.depth_um,
                around[0],
                [(n, p.points_um.tolist()) for n, p in zip(inside, relief.polygons)],
                wavelength_um,
                *around[1:],
            )
            if len(known) >= 64:
                known.clear()
            known[wavelength_um] = found
            self._prepared.losses[wavelength_um] = any(n.imag > 0.0 for n in around + inside)
        return found

    def _index(self, side: str, wavelength_um: float) -> complex:
        return (self.top if side == "top" else self.bottom).index(wavelength_um)

    def _ky_nodes(self, wavelength: float, ky: npt.ArrayLike | int) -> Floats:
        """Nodes along the grooves, of their number or as given; half-spaces must not absorb."""
        indices = [self._index(side, wavelength) for side in get_args(Side)]
        if any(n.imag != 0 for n in indices):
            _checks.refuse("grating", "half-spaces without loss", f"indices {indices}")
        if isinstance(ky, (int, np.integer)):
            count = _checks.whole("ky", ky, 1, 100_000)
            return np.asarray(_native.ky_nodes(indices[0].real, indices[1].real, count))
        nodes = np.ascontiguousarray(np.atleast_1d(_checks.floats("ky", ky)))
        if nodes.ndim != 1 or nodes[0] < 0 or (np.diff(nodes) <= 0).any():
            _checks.refuse("ky", "an ascending list of numbers of at least 0", _checks.describe(nodes))
        return nodes

    def highest_order(self, wavelength_um: float) -> int:
        """Highest order that propagates from any direction on either side."""
        return self._at(_checks.length("wavelength_um", wavelength_um)).highest_order()

    def resolution(
        self, wavelength_um: float, tolerance: float, threads: int | None = None
    ) -> tuple[int, int, float]:
        """Orders and slices for a tolerance over both hemispheres.

        Parameters
        ----------
        wavelength_um : float
            Vacuum wavelength.
        tolerance : float
            Error of the share transmitted that 99 of 100 directions stay below, 1e-8 to 0.1. A
            single direction or order may be off by three times that.
        threads : int, optional
            Threads to compute with.

        Returns
        -------
        orders, slices : int
            Highest order and slices to pass to `solve`.
        estimated_error : float
            Estimated error of the share transmitted.

        Raises
        ------
        batwing.ConvergenceError
            If the tolerance is out of reach.
        """
        wavelength = _checks.length("wavelength_um", wavelength_um)
        key = (wavelength, _checks.number("tolerance", tolerance))
        known = self._prepared.resolutions
        if key not in known:
            known[key] = self._at(wavelength).converge(key[1], _checks.threads(threads))
        return known[key]

    def _resolve(
        self,
        wavelength: float,
        orders: int | None,
        slices: int | None,
        tolerance: float | None,
        threads: int | None,
    ) -> tuple[int, int, float | None]:
        if orders is None:
            if slices is not None:
                _checks.refuse("slices", "orders beside them", "none")
            return self.resolution(wavelength, 1e-3 if tolerance is None else tolerance, threads)
        if tolerance is not None:
            _checks.refuse("tolerance", "no orders beside it", orders)
        orders = _checks.whole("orders", orders, 0, MAX_ORDERS)
        if slices is not None:
            return orders, _checks.whole("slices", slices, 1, 1_000_000), None
        usual = self._prepared.slices.get(wavelength)
        if usual is None:
            depth = self.relief.depth_um / wavelength
            exact = self._at(wavelength).is_exact()
            usual = 1 if exact else math.ceil(SLICES_PER_WAVELENGTH * depth) + 2
            self._prepared.slices[wavelength] = usual
        return orders, usual, None
