# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rigorous coupled-wave analysis of one-dimensional gratings, in any mount, from either side.

Lengths are in micrometres, angles in degrees. The grating vector is x, the grooves run along y, z
points from the top half-space to the bottom one. Light from the top at polar angle theta and
azimuth phi has the wavevector n (sin theta cos phi, sin theta sin phi) in units of 2 pi/wavelength.
An index n + ik with k >= 0 absorbs. s is the polarisation along z x k, p that along s x k.

Many directions at once are sorted by their Bloch wavevector: directions that are orders of each
other, or that share kx, share the work.

Examples
--------
A silicone sawtooth of 1 micrometre period under light from the silicone at two angles:

>>> from batwing import rcwa
>>> relief = rcwa.Relief.triangle(1.0, (0.9, 0.3), ridge=1.41, groove=1.0)
>>> grating = rcwa.Grating(relief, top=1.41, bottom=1.0)
>>> found = rcwa.solve(grating, 0.55, [0.0, 20.0], orders=12, slices=32)
>>> found.reflected.shape == (2, found.orders_reflected.size)
True
>>> bool(abs(found.total_reflected + found.total_transmitted - 1).max() < 1e-10)
True
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _show
from ._checks import Floats

if TYPE_CHECKING:
    from typing_extensions import TypeAlias

__all__ = [
    "Grating",
    "Hemisphere",
    "Jones",
    "Material",
    "NearField",
    "Polygon",
    "Relief",
    "Solution",
    "hemisphere",
    "jones",
    "near_field",
    "solve",
    "solve_case",
]

Complexes = npt.NDArray[np.complex128]
Integers = npt.NDArray[np.int64]
Index: TypeAlias = "Union[float, complex, Material]"

#: Highest order that the solver keeps.
MOST_ORDERS = 2000
#: Slices to a wavelength of depth where neither slices nor a tolerance are given.
SLICES_PER_WAVELENGTH = 24.0
_POLARISATIONS = ("s", "p", "unpolarised", "both")
_SIDES = ("top", "bottom")


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
        Text of a material file of refractiveindex.info.

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
        """A material file of refractiveindex.info.

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
        Corners (x, z) in order, either sense.
    """

    material: Material
    points_um: Floats

    def __init__(self, material: Index, points_um: npt.ArrayLike) -> None:
        points = _checks.floats("points_um", points_um)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
            _checks.refuse("points_um", "at least 3 corners, shape (n, 2)", _checks.describe(points))
        object.__setattr__(self, "points_um", points)
        object.__setattr__(self, "material", _material("material", material))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Polygon):
            return NotImplemented
        same = np.array_equal(self.points_um, other.points_um)
        return same and self.material == other.material

    def __hash__(self) -> int:
        return hash((self.material, self.points_um.tobytes()))


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
        put(self, "polygons", tuple(polygons))

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
        cls, period_um: float, apex_um: Sequence[float], ridge: Index, groove: Index
    ) -> Relief:
        """A triangle on the chord from (0, 0) to (period, 0) with its apex (x, z)."""
        apex = _checks.floats("apex_um", apex_um)
        if apex.shape != (2,):
            _checks.refuse("apex_um", "(x, z)", _checks.describe(apex))
        corners = [[0.0, 0.0], [_checks.length("period_um", period_um), 0.0], apex.tolist()]
        return cls.polygon(period_um, np.array(corners), ridge, groove)

    @classmethod
    def steps(cls, tread_um: float, riser_um: float, ridge: Index, groove: Index) -> Relief:
        """Steps seen along their slope: a right triangle whose hypotenuse is the period."""
        tread, riser = _checks.length("tread_um", tread_um), _checks.length("riser_um", riser_um)
        chord = math.hypot(tread, riser)
        apex = (tread * (tread / chord), riser * (tread / chord))
        return cls.triangle(chord, apex, ridge, groove)

    @classmethod
    def sinusoid(
        cls, period_um: float, depth_um: float, ridge: Index, groove: Index, sides: int = 64
    ) -> Relief:
        """z = depth (1 - cos 2 pi x/period)/2 as a polygon of `sides` straight pieces, 4 or more."""
        count = _checks.whole("sides", sides, 4, 4096)
        period, depth = _checks.length("period_um", period_um), _checks.length("depth_um", depth_um)
        number = np.arange(count + 1)
        # Through the nearer end, so that both halves have the very same heights.
        half_turn = np.pi * np.minimum(number, count - number) / count
        points = np.stack([period * number / count, depth * np.sin(half_turn) ** 2], axis=1)
        return cls.polygon(period, points, ridge, groove)

    def plot(self, ax: Any = None) -> Any:
        """Draws the cross-section with matplotlib; returns the axes."""
        return _show.relief(self, ax)


class _Prepared:
    """Native interfaces of a grating by wavelength, and resolutions found; no part of its value."""

    def __init__(self) -> None:
        self.interfaces: dict[float, _native.Interface] = {}
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
    """

    relief: Relief
    top: Material
    bottom: Material
    _prepared: _Prepared = field(repr=False, compare=False)

    def __init__(self, relief: Relief, top: Index, bottom: Index) -> None:
        if not isinstance(relief, Relief):
            _checks.refuse("relief", "a Relief", _checks.describe(relief))
        put = object.__setattr__
        put(self, "relief", relief)
        put(self, "top", _material("top", top))
        put(self, "bottom", _material("bottom", bottom))
        put(self, "_prepared", _Prepared())

    def _at(self, wavelength_um: float) -> _native.Interface:
        known = self._prepared.interfaces
        found = known.get(wavelength_um)
        if found is None:
            relief = self.relief
            _checks.one_unit(relief.period_um, wavelength_um)
            found = _native.Interface(
                relief.period_um,
                relief.depth_um,
                relief.background.index(wavelength_um),
                [(p.material.index(wavelength_um), p.points_um.tolist()) for p in relief.polygons],
                wavelength_um,
                self.top.index(wavelength_um),
                self.bottom.index(wavelength_um),
            )
            if len(known) >= 64:
                known.clear()
            known[wavelength_um] = found
        return found

    def _index(self, side: str, wavelength_um: float) -> complex:
        return (self.top if side == "top" else self.bottom).index(wavelength_um)

    def _ky_nodes(self, wavelength: float, ky: npt.ArrayLike | int) -> Floats:
        """Nodes along the grooves, of their number or as given; half-spaces must not absorb."""
        indices = [self._index(side, wavelength) for side in _SIDES]
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
        orders = _checks.whole("orders", orders, 0, MOST_ORDERS)
        if slices is not None:
            return orders, _checks.whole("slices", slices, 1, 1_000_000), None
        usual = self._prepared.slices.get(wavelength)
        if usual is None:
            depth = self.relief.depth_um / wavelength
            exact = self._at(wavelength).is_exact()
            usual = 1 if exact else math.ceil(SLICES_PER_WAVELENGTH * depth) + 2
            self._prepared.slices[wavelength] = usual
        return orders, usual, None


@dataclass(frozen=True, eq=False)
class Solution:
    """Efficiencies of all orders for one or many directions of incidence.

    Arrays begin with the shape of the directions. With polarisation `both` an axis of two, s and p,
    comes next. The last axis runs over `orders_reflected` or `orders_transmitted`. Orders that do
    not propagate have an efficiency of 0.

    Attributes
    ----------
    wavelength_um : float
        Vacuum wavelength.
    theta_deg, phi_deg : ndarray
        Directions of incidence.
    polarisation : str
        `s`, `p`, `unpolarised` or `both`.
    side : str
        Half-space that the light comes from.
    orders_reflected, orders_transmitted : ndarray of int
        Diffraction orders, 0 that of the mirror.
    reflected, transmitted : ndarray
        Power of each order per incident power.
    reflected_te, transmitted_te : ndarray
        The part of it in s.
    jones_reflected, jones_transmitted : ndarray, shape (..., order, 2, 2), or None
        Electric amplitudes (s, p) out by (s, p) in.
    orders, slices : int
        Highest order kept and slices of the relief.
    estimated_error : float or None
        Estimated error where a tolerance was given.
    energy_residual : float
        Largest \\|R + T - 1\\|; of R + T - 1 with loss.
    bloch_wavevectors : int
        Scattering problems solved for all directions.
    """

    wavelength_um: float
    theta_deg: Floats
    phi_deg: Floats
    polarisation: str
    side: str
    orders_reflected: Integers
    orders_transmitted: Integers
    reflected: Floats
    transmitted: Floats
    reflected_te: Floats
    transmitted_te: Floats
    jones_reflected: Complexes | None
    jones_transmitted: Complexes | None
    orders: int
    slices: int
    estimated_error: float | None
    energy_residual: float
    bloch_wavevectors: int
    _grating: Grating = field(repr=False, compare=False)

    @property
    def total_reflected(self) -> Floats:
        """Share reflected, all orders together."""
        return np.asarray(self.reflected.sum(axis=-1))

    @property
    def total_transmitted(self) -> Floats:
        """Share transmitted, all orders together."""
        return np.asarray(self.transmitted.sum(axis=-1))

    @property
    def absorbed(self) -> Floats:
        """Share absorbed."""
        return np.asarray(1.0 - self.total_reflected - self.total_transmitted)

    def directions(self, which: str = "transmitted") -> tuple[Floats, Floats]:
        """Polar angle from the normal and azimuth of every order, degrees; NaN if it is evanescent.

        Parameters
        ----------
        which : {'reflected', 'transmitted'}
            Which orders.
        """
        which = _checks.choice("which", which, ("reflected", "transmitted"))
        here = self._grating._index(self.side, self.wavelength_um).real
        there = "bottom" if self.side == "top" else "top"
        n = here if which == "reflected" else self._grating._index(there, self.wavelength_um).real
        orders = self.orders_reflected if which == "reflected" else self.orders_transmitted
        kx, ky = _wavevector(here, self.theta_deg, self.phi_deg)
        spacing = self.wavelength_um / self._grating.relief.period_um
        kx = kx[..., np.newaxis] + orders * spacing
        ky = np.broadcast_to(ky[..., np.newaxis], kx.shape)
        with np.errstate(invalid="ignore"):
            theta = np.degrees(np.arcsin(np.hypot(kx, ky) / n))
        phi = np.where(np.isfinite(theta), np.degrees(np.arctan2(ky, kx)), np.nan)
        return theta, phi

    def to_xarray(self) -> Any:
        """The arrays as an `xarray.Dataset` with units in `attrs`."""
        return _show.solution_dataset(self)

    def plot(self, ax: Any = None) -> Any:
        """Efficiencies over the order, or over the angle for many directions; returns the axes."""
        return _show.solution(self, ax)

    def _repr_html_(self) -> str:
        return _show.html(self)


def _wavevector(n: float, theta_deg: Floats, phi_deg: Floats) -> tuple[Floats, Floats]:
    tangential = n * np.sin(np.radians(theta_deg))
    phi = np.radians(phi_deg)
    return tangential * np.cos(phi), tangential * np.sin(phi)


def _rows(n: float, theta_deg: Floats, phi_deg: Floats) -> tuple[Floats, Floats, Floats]:
    """kx, ky and azimuth of all directions as lists; one direction without NumPy's overhead."""
    if theta_deg.ndim == 0:
        azimuth = math.radians(phi_deg)
        tangential = n * math.sin(math.radians(theta_deg))
        kx, ky = tangential * math.cos(azimuth), tangential * math.sin(azimuth)
        return np.array([kx]), np.array([ky]), np.array([azimuth])
    along, across = _wavevector(n, theta_deg, phi_deg)
    return np.ravel(along), np.ravel(across), np.radians(np.ravel(phi_deg))


def _direction(theta_deg: npt.ArrayLike, phi_deg: npt.ArrayLike) -> tuple[Floats, Floats]:
    if type(theta_deg) is float and type(phi_deg) is float and -90.0 < theta_deg < 90.0:
        if math.isfinite(phi_deg):
            return np.array(theta_deg), np.array(phi_deg)
    theta, phi = _checks.floats("theta_deg", theta_deg), _checks.floats("phi_deg", phi_deg)
    if np.abs(theta).max() >= 90.0:
        _checks.refuse("theta_deg", "angles above -90 and below 90 degrees", float(np.abs(theta).max()))
    if theta.shape == phi.shape:
        return theta, phi
    try:
        theta, phi = np.broadcast_arrays(theta, phi)
    except ValueError:
        _checks.refuse(
            "phi_deg", f"a shape that fits {theta.shape} of theta_deg", _checks.describe(phi)
        )
    return theta, phi


def _combined(values: Floats, polarisation: str) -> Floats:
    """Efficiencies (n, order, in, out) of the polarisation that is asked for: (n, [in,] order, out)."""
    if polarisation == "both":
        return values.transpose(0, 2, 1, 3)
    if polarisation == "unpolarised":
        mean: Floats = 0.5 * (values[:, :, 0] + values[:, :, 1])
        return mean
    return values[:, :, 0 if polarisation == "s" else 1]


def solve(
    grating: Grating,
    wavelength_um: float,
    theta_deg: npt.ArrayLike = 0.0,
    phi_deg: npt.ArrayLike = 0.0,
    polarisation: str = "unpolarised",
    *,
    orders: int | None = None,
    slices: int | None = None,
    tolerance: float | None = None,
    side: str = "top",
    jones: bool = False,
    threads: int | None = None,
) -> Solution:
    """Efficiencies of all orders for one direction or arrays of directions.

    Parameters
    ----------
    grating : Grating
        The grating.
    wavelength_um : float
        Vacuum wavelength, micrometres.
    theta_deg, phi_deg : array_like
        Polar angle, -90 to 90 degrees, in the medium that the light comes from, and azimuth from the
        grating vector. They are broadcast against each other.
    polarisation : {'s', 'p', 'unpolarised', 'both'}
        Polarisation of the incident light; `both` keeps s and p apart.
    orders : int, optional
        Highest order kept: orders -M..M about the Bloch wavevector in the first Brillouin zone.
    slices : int, optional
        Slices of a relief with slanted walls [default: 24 to a wavelength of depth].
    tolerance : float, optional
        In place of orders: largest error of an efficiency of these directions, 1e-8 to 0.1
        [default: 1e-3], as of `batwing grating`.
    side : {'top', 'bottom'}
        Half-space that the light comes from; its index is real.
    jones : bool
        Whether Jones matrices are wanted too; not for metals with slanted walls.
    threads : int, optional
        Threads of this call; results do not depend on them.

    Returns
    -------
    Solution
        Efficiencies of all orders.

    Raises
    ------
    batwing.InputError
        An argument out of its range, fewer orders than propagate, more than fit into memory.
    batwing.ConvergenceError
        A tolerance out of reach.

    Notes
    -----
    Slices follow slanted walls of dielectrics. Other slanted walls are cut into stairs of two
    heights and extrapolated. Theory: docs/explanation/theory.md.

    Examples
    --------
    Fresnel reflection of a bare interface at normal incidence is 4 %:

    >>> from batwing import rcwa
    >>> glass = rcwa.Grating(rcwa.Relief(1.0, 0.1, 1.0), top=1.0, bottom=1.5)
    >>> round(float(rcwa.solve(glass, 0.55, orders=2).total_reflected), 6)
    0.04
    """
    wavelength = _checks.length("wavelength_um", wavelength_um)
    theta, phi = _direction(theta_deg, phi_deg)
    if polarisation not in _POLARISATIONS:
        _checks.choice("polarisation", polarisation, _POLARISATIONS)
    if side not in _SIDES:
        _checks.choice("side", side, _SIDES)
    threads = _checks.threads(threads)
    interface = grating._at(wavelength)
    if orders is None:
        # The search counts every efficiency of these directions.
        if slices is not None:
            _checks.refuse("slices", "orders beside them", "none")
        order = slice_count = 0
        tolerance = 1e-3 if tolerance is None else _checks.number("tolerance", tolerance)
    else:
        order, slice_count, _ = grating._resolve(wavelength, orders, slices, tolerance, threads)
    kx, ky, azimuth = _rows(grating._index(side, wavelength).real, theta, phi)
    shape = theta.shape
    upper, lower, matrices, residual, problems, found = interface.solve(
        side == "top",
        kx,
        ky,
        azimuth,
        order,
        slice_count,
        tolerance,
        jones,
        threads,
    )
    order, slice_count, error = found
    if side == "bottom":
        upper, lower = lower, upper
        matrices = None if matrices is None else (matrices[1], matrices[0])
    outer = (*shape, 2) if polarisation == "both" else shape
    reflected, transmitted = _combined(upper[1], polarisation), _combined(lower[1], polarisation)
    reflected = reflected.reshape(*outer, *reflected.shape[-2:])
    transmitted = transmitted.reshape(*outer, *transmitted.shape[-2:])
    return Solution(
        wavelength_um=wavelength,
        theta_deg=theta,
        phi_deg=phi,
        polarisation=polarisation,
        side=side,
        orders_reflected=np.arange(upper[0], upper[0] + upper[1].shape[1]),
        orders_transmitted=np.arange(lower[0], lower[0] + lower[1].shape[1]),
        reflected=reflected[..., 0] + reflected[..., 1],
        transmitted=transmitted[..., 0] + transmitted[..., 1],
        reflected_te=reflected[..., 0],
        transmitted_te=transmitted[..., 0],
        jones_reflected=None if matrices is None else matrices[0][1].reshape(*shape, -1, 2, 2),
        jones_transmitted=None if matrices is None else matrices[1][1].reshape(*shape, -1, 2, 2),
        orders=order,
        slices=slice_count,
        estimated_error=error,
        energy_residual=residual,
        bloch_wavevectors=problems,
        _grating=grating,
    )


@dataclass(frozen=True, eq=False)
class Jones:
    """Jones matrices of all orders.

    Attributes
    ----------
    theta_deg, phi_deg : ndarray
        Directions of incidence.
    orders_reflected, orders_transmitted : ndarray of int
        Diffraction orders.
    reflected, transmitted : ndarray, shape (..., order, 2, 2)
        Electric amplitudes (s, p) out by (s, p) in; phases belong to the plane z = 0 for waves in the
        top half-space and to z = depth for those in the bottom one.
    """

    theta_deg: Floats
    phi_deg: Floats
    orders_reflected: Integers
    orders_transmitted: Integers
    reflected: Complexes
    transmitted: Complexes


def jones(
    grating: Grating,
    wavelength_um: float,
    theta_deg: npt.ArrayLike = 0.0,
    phi_deg: npt.ArrayLike = 0.0,
    *,
    orders: int | None = None,
    slices: int | None = None,
    tolerance: float | None = None,
    side: str = "top",
    threads: int | None = None,
) -> Jones:
    """Jones matrices of all orders; arguments and errors as those of `solve`.

    Returns
    -------
    Jones
        Complex amplitudes of the electric vector.

    Examples
    --------
    Glass under 60 degrees reflects s with an amplitude of -0.42:

    >>> from batwing import rcwa
    >>> glass = rcwa.Grating(rcwa.Relief(1.0, 0.1, 1.0), top=1.0, bottom=1.5)
    >>> found = rcwa.jones(glass, 0.55, 60.0, 17.0, orders=4)
    >>> zero = int(np.flatnonzero(found.orders_reflected == 0)[0])
    >>> r = found.reflected[zero]
    >>> bool(abs(abs(r[0, 0]) - 0.4202) < 1e-4 and abs(r[0, 1]) < 1e-12)
    True
    """
    found = solve(
        grating,
        wavelength_um,
        theta_deg,
        phi_deg,
        orders=orders,
        slices=slices,
        tolerance=tolerance,
        side=side,
        jones=True,
        threads=threads,
    )
    assert found.jones_reflected is not None and found.jones_transmitted is not None
    return Jones(
        found.theta_deg,
        found.phi_deg,
        found.orders_reflected,
        found.orders_transmitted,
        found.jones_reflected,
        found.jones_transmitted,
    )


@dataclass(frozen=True, eq=False)
class Hemisphere:
    """Efficiencies for all directions of both hemispheres on a grid of wavevectors.

    Attributes
    ----------
    wavelength_um : float
        Vacuum wavelength.
    from_top : ndarray of bool, shape (n,)
        Whether the light of a node comes from the top.
    kx, ky : ndarray, shape (n,)
        Its tangential wavevector in units of 2 pi/wavelength; ky >= 0.
    theta_deg, phi_deg : ndarray, shape (n,)
        Its direction.
    orders_top, orders_bottom : ndarray of int
        Orders relative to the incident one that leave into the top and the bottom half-space.
    to_top, to_bottom : ndarray, shape (n, 2, order)
        Power of each order per incident power, for s and p.
    orders, slices : int
        Highest order kept and slices.
    energy_residual : float
        Largest \\|R + T - 1\\|.
    bloch_wavevectors : int
        Scattering problems solved.
    """

    wavelength_um: float
    from_top: npt.NDArray[np.bool_]
    kx: Floats
    ky: Floats
    theta_deg: Floats
    phi_deg: Floats
    orders_top: Integers
    orders_bottom: Integers
    to_top: Floats
    to_bottom: Floats
    orders: int
    slices: int
    energy_residual: float
    bloch_wavevectors: int

    def to_xarray(self) -> Any:
        """The arrays as an `xarray.Dataset` with units in `attrs`."""
        return _show.hemisphere_dataset(self)

    def plot(self, ax: Any = None) -> Any:
        """Share transmitted from the top over (kx, ky); returns the axes."""
        return _show.hemisphere(self, ax)

    def _repr_html_(self) -> str:
        return _show.html(self)


def hemisphere(
    grating: Grating,
    wavelength_um: float,
    *,
    kx_per_zone: int = 4,
    ky: npt.ArrayLike | int = 24,
    orders: int | None = None,
    slices: int | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
) -> Hemisphere:
    """Efficiencies for all directions of incidence from both sides.

    Parameters
    ----------
    grating : Grating
        The grating; both half-spaces have real indices.
    wavelength_um : float
        Vacuum wavelength, micrometres.
    kx_per_zone : int
        Nodes of kx to one order spacing wavelength/period.
    ky : int or array_like
        Number of nodes along the grooves, or the nodes: ascending, at least 0.
    orders, slices, tolerance, threads
        As those of `solve`.

    Returns
    -------
    Hemisphere
        Efficiencies at every node.

    Raises
    ------
    batwing.InputError
        An argument out of its range, more orders than fit into memory.
    """
    wavelength = _checks.length("wavelength_um", wavelength_um)
    kx_per_zone = _checks.whole("kx_per_zone", kx_per_zone, 1, 4096)
    threads = _checks.threads(threads)
    interface = grating._at(wavelength)
    nodes = grating._ky_nodes(wavelength, ky)
    order, slice_count, _ = grating._resolve(wavelength, orders, slices, tolerance, threads)
    from_top, kx, ky_of, upper, lower, residual, problems = interface.hemisphere(
        kx_per_zone, nodes, order, slice_count, threads
    )
    n = np.where(from_top, *(grating._index(side, wavelength).real for side in _SIDES))
    return Hemisphere(
        wavelength_um=wavelength,
        from_top=from_top,
        kx=kx,
        ky=ky_of,
        theta_deg=np.degrees(np.arcsin(np.minimum(np.hypot(kx, ky_of) / n, 1.0))),
        phi_deg=np.degrees(np.arctan2(ky_of, kx)),
        orders_top=np.arange(upper[0], upper[0] + upper[1].shape[1]),
        orders_bottom=np.arange(lower[0], lower[0] + lower[1].shape[1]),
        to_top=upper[1].sum(axis=-1).transpose(0, 2, 1),
        to_bottom=lower[1].sum(axis=-1).transpose(0, 2, 1),
        orders=order,
        slices=slice_count,
        energy_residual=residual,
        bloch_wavevectors=problems,
    )


@dataclass(frozen=True, eq=False)
class NearField:
    """Fields of one incident wave of unit amplitude on a grid of points at y = 0.

    Attributes
    ----------
    x_um, z_um : ndarray
        The grid.
    electric, magnetic : ndarray, shape (z, x, 3)
        Complex vectors; H is multiplied by the impedance of free space.
    index : ndarray, shape (z, x)
        Index n + ik at each point.
    flux : ndarray, shape (z,)
        Power through each plane per incident power, in the sense of the incident wave.
    total_reflected, total_transmitted : float
        Shares of the incident power.
    """

    x_um: Floats
    z_um: Floats
    electric: Complexes
    magnetic: Complexes
    index: Complexes
    flux: Floats
    total_reflected: float
    total_transmitted: float

    @property
    def intensity(self) -> Floats:
        """\\|E\\|^2, shape (z, x); 1 in the incident wave."""
        return np.asarray((np.abs(self.electric) ** 2).sum(axis=-1))

    @property
    def poynting(self) -> Floats:
        """Mean Poynting vector, shape (z, x, 3); n/2 long in a unit wave."""
        return np.asarray(0.5 * np.cross(self.electric, self.magnetic.conj()).real)

    def to_xarray(self) -> Any:
        """The arrays as an `xarray.Dataset` with units in `attrs`."""
        return _show.near_field_dataset(self)

    def plot(self, ax: Any = None) -> Any:
        """The intensity as an image; returns the axes."""
        return _show.near_field(self, ax)

    def _repr_html_(self) -> str:
        return _show.html(self)


def near_field(
    grating: Grating,
    wavelength_um: float,
    theta_deg: float = 0.0,
    phi_deg: float = 0.0,
    polarisation: str = "s",
    *,
    x_um: npt.ArrayLike | None = None,
    z_um: npt.ArrayLike | None = None,
    orders: int | None = None,
    slices: int | None = None,
    side: str = "top",
    threads: int | None = None,
) -> NearField:
    """Fields in and near the grating for one incident wave.

    Parameters
    ----------
    grating : Grating
        The grating.
    wavelength_um : float
        Vacuum wavelength, micrometres.
    theta_deg, phi_deg : float
        Direction of incidence, as in `solve`.
    polarisation : {'s', 'p'}
        Polarisation of the incident wave.
    x_um, z_um : array_like, optional
        Points [default: 256 over one period; 256 from a wavelength above to one below the relief].
    orders : int, optional
        Highest order kept [default: half as many again as propagate].
    slices : int, optional
        Slices [default: 24 to a wavelength of depth].
    side : {'top', 'bottom'}
        Half-space that the light comes from.
    threads : int, optional
        Threads of this call.

    Returns
    -------
    NearField
        Electric and magnetic field at every point.

    Raises
    ------
    batwing.InputError
        An argument out of its range; too many points.
    """
    wavelength = _checks.length("wavelength_um", wavelength_um)
    theta, phi = _checks.number("theta_deg", theta_deg), _checks.number("phi_deg", phi_deg)
    theta, phi = (float(a) for a in _direction(theta, phi))
    polarisation = _checks.choice("polarisation", polarisation, ("s", "p"))
    side = _checks.choice("side", side, _SIDES)
    interface = grating._at(wavelength)
    relief = grating.relief
    if orders is None:
        highest = interface.highest_order()
        orders = highest + max(math.ceil(highest / 2), 8)
    order, slice_count, _ = grating._resolve(wavelength, orders, slices, None, threads)
    if x_um is None:
        x = (np.arange(256) + 0.5) / 256 * relief.period_um
    else:
        x = np.ascontiguousarray(np.atleast_1d(_checks.floats("x_um", x_um)))
    if z_um is None:
        z = np.linspace(-wavelength, relief.depth_um + wavelength, 256)
    else:
        z = np.ascontiguousarray(np.atleast_1d(_checks.floats("z_um", z_um)))
    for key, axis in (("x_um", x), ("z_um", z)):
        if axis.ndim != 1:
            _checks.refuse(key, "a list of positions", _checks.describe(axis))
    if x.size * z.size > 20_000_000:
        _checks.refuse("x_um", "at most 20000000 points in all", x.size * z.size)
    kx, ky = _wavevector(grating._index(side, wavelength).real, np.asarray(theta), np.asarray(phi))
    amplitudes = (1.0 + 0j, 0j) if polarisation == "s" else (0j, 1.0 + 0j)
    electric, magnetic, index, flux, reflected, transmitted = interface.field(
        side == "top",
        (float(kx), float(ky), math.radians(phi)),
        amplitudes,
        x,
        z,
        order,
        slice_count,
        _checks.threads(threads),
    )
    return NearField(x, z, electric, magnetic, index, flux, reflected, transmitted)


def solve_case(case: dict[str, Any] | str | os.PathLike[str], threads: int | None = None) -> dict[str, Any]:
    """One case of `batwing grating`, with the numbers that the command prints.

    Parameters
    ----------
    case : dict or path
        The case: docs/reference/command-line.md, `batwing grating`.
    threads : int, optional
        Threads of this call.

    Returns
    -------
    dict
        Keys as those of the command's JSON.

    Raises
    ------
    batwing.InputError
        A key of the case that is missing, unknown or out of its range.
    """
    if isinstance(case, dict):
        name, text = "case", json.dumps(case)
    else:
        name, text = os.fspath(case), _checks.text(case)
    solved: dict[str, Any] = json.loads(_native.solve_case(name, text, _checks.threads(threads)))
    warning = solved.pop("warning")
    if warning:
        _show.warn(str(warning))
    return solved

