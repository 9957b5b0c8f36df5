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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _show
from ._checks import Floats
from .errors import ConvergenceWarning
from .gratings import Base, Grating, Index, Material, Polygon, Relief, Side

__all__ = [
    "Base",
    "Grating",
    "Hemisphere",
    "Index",
    "Jones",
    "Material",
    "NearField",
    "Polarisation",
    "Polygon",
    "Relief",
    "Side",
    "Solution",
    "hemisphere",
    "jones",
    "near_field",
    "solve",
    "solve_case",
]

Complexes = npt.NDArray[np.complex128]
Integers = npt.NDArray[np.int64]
Polarisation = Literal["s", "p", "unpolarised", "both"]
LinearPolarisation = Literal["s", "p"]
Orders = Literal["reflected", "transmitted"]
Method = Literal["orders", "boundary integral", "both"]

#: Bytes of a direction, and of each of its orders in one half-space: directions and lines, lists of
#: orders of the runs that a search compares, and the arrays of the result.
DIRECTION_BYTES, ORDER_BYTES, JONES_BYTES = 500.0, 200.0, 200.0
#: Bytes of a point of a near field: two vectors and an index, in the solver and as arrays.
POINT_BYTES = 300.0


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True, eq=False)
class Solution:
    """Efficiencies of all orders for one or many directions of incidence.

    Arrays begin with the shape of the directions. With polarisation `both` an axis of two, s and p,
    comes next. The last axis runs over `orders_reflected` or `orders_transmitted`. Orders that do
    not propagate have an efficiency of 0.

    Attributes
    ----------
    wavelength_um : float or ndarray
        Vacuum wavelength; of several wavelengths that of every direction.
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
    method : str
        How it was solved: `orders`, `boundary integral`, or `both` of several wavelengths.
    orders, slices : int
        Highest order kept and slices of the relief; of several wavelengths the largest; 0 by boundary
        integrals.
    nodes : int
        Nodes on a period of the surface, of boundary integrals; 0 by orders.
    estimated_error : float or None
        Largest error of an efficiency, estimated; of several wavelengths the largest. Infinite where
        nothing finer can be solved, None with ``estimate=False``.
    energy_residual : float
        Largest \\|R + T - 1\\|. With loss the largest R + T - 1, or 0 where none is above 0; what is
        missing is `absorbed`.
    bloch_wavevectors : int
        Scattering problems solved for all directions.
    """

    wavelength_um: float | Floats
    theta_deg: Floats
    phi_deg: Floats
    polarisation: Polarisation
    side: Side
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
    nodes: int
    estimated_error: float | None
    energy_residual: float
    bloch_wavevectors: int
    _grating: Grating = field(repr=False, compare=False)

    __repr__ = _show.brief

    @property
    def method(self) -> Method:
        """How it was solved."""
        if self.nodes == 0:
            return "orders"
        return "both" if self.slices > 0 or self.orders > 0 else "boundary integral"

    @property
    def total_reflected(self) -> Floats:
        """Share reflected, all orders together."""
        return np.asarray(self.reflected.sum(axis=-1))

    @property
    def total_transmitted(self) -> Floats:
        """Share transmitted, all orders together."""
        return np.asarray(self.transmitted.sum(axis=-1))

    @property
    def polarization(self) -> Polarisation:
        """Another spelling of `polarisation`."""
        return self.polarisation

    @property
    def absorbed(self) -> Floats:
        """Share absorbed."""
        return np.asarray(1.0 - self.total_reflected - self.total_transmitted)

    def _real_index(self, side: Side) -> Floats:
        """Real part of the index of a half-space at the wavelength of every direction."""
        wavelengths = np.asarray(self.wavelength_um)
        distinct, which = np.unique(wavelengths, return_inverse=True)
        indices = np.array([self._grating._index(side, float(w)).real for w in distinct])
        return np.asarray(indices[which].reshape(wavelengths.shape))

    def directions(self, which: Orders = "transmitted") -> tuple[Floats, Floats]:
        """Polar angle from the normal and azimuth of every order, degrees; NaN if it is evanescent.

        Parameters
        ----------
        which : {'reflected', 'transmitted'}
            Which orders.
        """
        which = _checks.choice("which", which, get_args(Orders))
        here = self._real_index(self.side)
        there: Side = "bottom" if self.side == "top" else "top"
        n = here if which == "reflected" else self._real_index(there)
        orders = self.orders_reflected if which == "reflected" else self.orders_transmitted
        kx, ky = _wavevector(here, self.theta_deg, self.phi_deg)
        spacing = np.asarray(self.wavelength_um) / self._grating.relief.period_um
        kx = kx[..., np.newaxis] + orders * spacing[..., np.newaxis]
        ky = np.broadcast_to(ky[..., np.newaxis], kx.shape)
        with np.errstate(invalid="ignore"):
            theta = np.degrees(np.arcsin(np.hypot(kx, ky) / n[..., np.newaxis]))
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


def _wavevector(n: float | Floats, theta_deg: Floats, phi_deg: Floats) -> tuple[Floats, Floats]:
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
    steepest = max(float(theta.max()), -float(theta.min()))
    if steepest >= 90.0:
        _checks.refuse("theta_deg", "angles above -90 and below 90 degrees", steepest)
    if theta.shape == phi.shape:
        return theta, phi
    try:
        theta, phi = np.broadcast_arrays(theta, phi)
    except ValueError:
        _checks.refuse(
            "phi_deg", f"a shape that fits {theta.shape} of theta_deg", _checks.describe(phi)
        )
    return theta, phi


def _chosen(
    polarisation: Polarisation | LinearPolarisation,
    polarization: Polarisation | LinearPolarisation | None,
    default: str,
    allowed: Sequence[str],
) -> Any:
    """The polarisation under either spelling."""
    if polarization is not None:
        if polarisation != default:
            _checks.refuse("polarization", "no polarisation beside it", polarisation)
        polarisation = polarization
    chosen: str = polarisation
    return _checks.choice("polarisation", "unpolarised" if chosen == "unpolarized" else chosen, allowed)


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
    wavelength_um: npt.ArrayLike,
    theta_deg: npt.ArrayLike = 0.0,
    phi_deg: npt.ArrayLike = 0.0,
    polarisation: Polarisation = "unpolarised",
    *,
    orders: int | None = None,
    slices: int | None = None,
    tolerance: float | None = None,
    side: Side = "top",
    jones: bool = False,
    estimate: bool = True,
    threads: int | None = None,
    polarization: Polarisation | None = None,
) -> Solution:
    """Efficiencies of all orders for one direction or arrays of directions and wavelengths.

    Parameters
    ----------
    grating : Grating
        The grating.
    wavelength_um : array_like
        Vacuum wavelength, micrometres. Each is solved by itself.
    theta_deg, phi_deg : array_like
        Polar angle, -90 to 90 degrees, in the medium that the light comes from, and azimuth from the
        grating vector. Wavelengths and angles are broadcast against each other.
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
    estimate : bool
        With `orders`: whether a third more orders and slices are solved too, which takes some three
        times the time of the rest and gives the estimated error.
    threads : int, optional
        Threads of this call; results do not depend on them.
    polarization : str, optional
        Another spelling of `polarisation`.

    Returns
    -------
    Solution
        Efficiencies of all orders.

    Raises
    ------
    batwing.InputError
        An argument out of its range, fewer orders than propagate, more than fit into memory.
    batwing.ConvergenceError
        A tolerance of which nothing is reached.

    Warns
    -----
    batwing.ConvergenceWarning
        A tolerance that is not reached: the best result, with its error; given orders whose error is
        above 0.5.

    Notes
    -----
    Slices follow slanted walls of dielectrics. Other slanted walls are cut into stairs of two
    heights and extrapolated; to a tolerance boundary integrals come first there, and where orders miss
    it, if the relief is one surface between the half-spaces, all directions lie in the plane across the
    grooves and `jones` is not asked for. Theory: docs/explanation/theory.md.

    Examples
    --------
    Fresnel reflection of a bare interface at normal incidence is 4 %:

    >>> from batwing import rcwa
    >>> glass = rcwa.Grating(rcwa.Relief(1.0, 0.1, 1.0), top=1.0, bottom=1.5)
    >>> round(float(rcwa.solve(glass, 0.55, orders=2).total_reflected), 6)
    0.04
    """
    _checks.instance("grating", grating, Grating, "a batwing.rcwa.Grating")
    theta, phi = _direction(theta_deg, phi_deg)
    polarisation = _chosen(polarisation, polarization, "unpolarised", get_args(Polarisation))
    side = _checks.choice("side", side, get_args(Side))
    threads = _checks.threads(threads)
    if type(wavelength_um) is not float and np.ndim(wavelength_um) > 0:
        return _solve_wavelengths(
            grating,
            _checks.floats("wavelength_um", wavelength_um),
            theta,
            phi,
            {
                "polarisation": polarisation,
                "orders": orders,
                "slices": slices,
                "tolerance": tolerance,
                "side": side,
                "jones": jones,
                "estimate": estimate,
                "threads": threads,
            },
        )
    wavelength = _checks.length("wavelength_um", wavelength_um)
    interface = grating._at(wavelength)
    _guard(grating, wavelength, theta.size, jones)
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
    upper, lower, matrices, residual, problems, found, warning = interface.solve(
        side == "top",
        kx,
        ky,
        azimuth,
        order,
        slice_count,
        estimate,
        tolerance,
        jones,
        threads,
    )
    order, slice_count, nodes, error = found
    if warning is not None:
        _show.warn(warning, ConvergenceWarning)
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
        nodes=nodes,
        estimated_error=error,
        energy_residual=grating._residual(wavelength, residual, upper[1], lower[1]),
        bloch_wavevectors=problems,
        _grating=grating,
    )


def _guard(grating: Grating, wavelength: float, directions: int, jones: bool) -> None:
    """Refuses more directions than fit into memory."""
    if directions < 10_000:
        return
    spacing = wavelength / grating.relief.period_um
    widest = max(grating._index(side, wavelength).real for side in get_args(Side))
    each = DIRECTION_BYTES + (ORDER_BYTES + JONES_BYTES * jones) * 2 * (2 * widest / spacing + 1)
    _checks.memory("theta_deg", directions, each)


def _solve_wavelengths(
    grating: Grating, wavelengths: Floats, theta: Floats, phi: Floats, options: dict[str, Any]
) -> Solution:
    """The solutions of all wavelengths in one, over orders of any of them."""
    if (wavelengths <= 0.0).any():
        _checks.refuse("wavelength_um", "lengths above 0", float(wavelengths.min()))
    try:
        wavelengths, theta, phi = np.broadcast_arrays(wavelengths, theta, phi)
    except ValueError:
        _checks.refuse(
            "wavelength_um",
            f"a shape that fits {theta.shape} of the angles",
            _checks.describe(wavelengths),
        )
    _guard(grating, float(wavelengths.min()), wavelengths.size, options["jones"])
    distinct, which = np.unique(wavelengths.ravel(), return_inverse=True)
    members = [np.flatnonzero(which == number) for number in range(distinct.size)]
    theta_flat, phi_flat = theta.ravel(), phi.ravel()
    found = [
        solve(grating, float(one), theta_flat[rows], phi_flat[rows], **options)
        for one, rows in zip(distinct, members)
    ]

    def joined(name: str) -> Any:
        """Values over all directions; 0 for orders that do not propagate."""
        parts = [getattr(one, name) for one in found]
        if parts[0] is None:
            return None
        at = f"orders_{name.replace('jones_', '').replace('_te', '')}"
        axis = -3 if name.startswith("jones") else -1
        orders = _orders_of(found, at)
        shape = list(parts[0].shape)
        shape[0], shape[axis] = wavelengths.size, orders.size
        whole = np.zeros(shape, parts[0].dtype)
        for one, rows, part in zip(found, members, parts):
            own = getattr(one, at)
            if own.size:
                first = int(own[0] - orders[0])
                place = np.moveaxis(whole, axis, 1)
                place[rows, first : first + own.size] = np.moveaxis(part, axis, 1)
        return whole.reshape(*wavelengths.shape, *shape[1:])

    errors = [one.estimated_error for one in found if one.estimated_error is not None]
    names = ("reflected", "transmitted", "reflected_te", "transmitted_te")
    return Solution(
        wavelength_um=wavelengths,
        theta_deg=theta,
        phi_deg=phi,
        polarisation=options["polarisation"],
        side=options["side"],
        orders_reflected=_orders_of(found, "orders_reflected"),
        orders_transmitted=_orders_of(found, "orders_transmitted"),
        **{name: joined(name) for name in names},
        jones_reflected=joined("jones_reflected"),
        jones_transmitted=joined("jones_transmitted"),
        orders=max(one.orders for one in found),
        slices=max(one.slices for one in found),
        nodes=max(one.nodes for one in found),
        estimated_error=max(errors, default=None),
        energy_residual=max(one.energy_residual for one in found),
        bloch_wavevectors=sum(one.bloch_wavevectors for one in found),
        _grating=grating,
    )


def _orders_of(found: Sequence[Solution], name: str) -> Integers:
    """All orders of some solutions."""
    own = np.concatenate([getattr(one, name) for one in found])
    return np.arange(own.min(), own.max() + 1) if own.size else own


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
    wavelength_um : float or ndarray
        Vacuum wavelength, as of `Solution`.
    """

    theta_deg: Floats
    phi_deg: Floats
    orders_reflected: Integers
    orders_transmitted: Integers
    reflected: Complexes
    transmitted: Complexes
    wavelength_um: float | Floats

    __repr__ = _show.brief

    def to_xarray(self) -> Any:
        """The arrays as an `xarray.Dataset` with units in `attrs`."""
        return _show.jones_dataset(self)


def jones(
    grating: Grating,
    wavelength_um: npt.ArrayLike,
    theta_deg: npt.ArrayLike = 0.0,
    phi_deg: npt.ArrayLike = 0.0,
    *,
    orders: int | None = None,
    slices: int | None = None,
    tolerance: float | None = None,
    side: Side = "top",
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
        estimate=False,
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
        found.wavelength_um,
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
        Largest \\|R + T - 1\\|; with loss as of `Solution`.
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

    __repr__ = _show.brief

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
    _checks.instance("grating", grating, Grating, "a batwing.rcwa.Grating")
    wavelength = _checks.length("wavelength_um", wavelength_um)
    kx_per_zone = _checks.whole("kx_per_zone", kx_per_zone, 1, 4096)
    threads = _checks.threads(threads)
    interface = grating._at(wavelength)
    nodes = grating._ky_nodes(wavelength, ky)
    order, slice_count, _ = grating._resolve(wavelength, orders, slices, tolerance, threads)
    from_top, kx, ky_of, upper, lower, residual, problems = interface.hemisphere(
        kx_per_zone, nodes, order, slice_count, threads
    )
    n = np.where(from_top, *(grating._index(side, wavelength).real for side in get_args(Side)))
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
        energy_residual=grating._residual(wavelength, residual, upper[1], lower[1]),
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
    wavelength_um, theta_deg, phi_deg : float
        The incident wave.
    polarisation, side : str
        `s` or `p`, and the half-space that it comes from.
    """

    x_um: Floats
    z_um: Floats
    electric: Complexes
    magnetic: Complexes
    index: Complexes
    flux: Floats
    total_reflected: float
    total_transmitted: float
    wavelength_um: float
    theta_deg: float
    phi_deg: float
    polarisation: LinearPolarisation
    side: Side

    __repr__ = _show.brief

    @property
    def polarization(self) -> LinearPolarisation:
        """Another spelling of `polarisation`."""
        return self.polarisation

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
    polarisation: LinearPolarisation = "s",
    *,
    x_um: npt.ArrayLike | None = None,
    z_um: npt.ArrayLike | None = None,
    orders: int | None = None,
    slices: int | None = None,
    side: Side = "top",
    threads: int | None = None,
    polarization: LinearPolarisation | None = None,
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
    polarization : {'s', 'p'}, optional
        Another spelling of `polarisation`.

    Returns
    -------
    NearField
        Electric and magnetic field at every point.

    Raises
    ------
    batwing.InputError
        An argument out of its range; too many points.
    """
    _checks.instance("grating", grating, Grating, "a batwing.rcwa.Grating")
    wavelength = _checks.length("wavelength_um", wavelength_um)
    theta, phi = _checks.number("theta_deg", theta_deg), _checks.number("phi_deg", phi_deg)
    theta, phi = (float(a) for a in _direction(theta, phi))
    polarisation = _chosen(polarisation, polarization, "s", get_args(LinearPolarisation))
    side = _checks.choice("side", side, get_args(Side))
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
    _checks.memory("x_um", x.size * z.size, POINT_BYTES, "points")
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
    incident = (wavelength, theta, phi, polarisation, side)
    return NearField(x, z, electric, magnetic, index, flux, reflected, transmitted, *incident)


def solve_case(
    case: Mapping[str, Any] | str | os.PathLike[str], threads: int | None = None
) -> dict[str, Any]:
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
    if isinstance(case, Mapping):
        name, text = "case", json.dumps(_checks.plain("case", case))
    elif not isinstance(case, (str, os.PathLike)):
        _checks.refuse("case", "the path of a file or a dict", _checks.describe(case))
    else:
        name, text = os.fspath(case), _checks.text(case)
    solved: dict[str, Any] = json.loads(_native.solve_case(name, text, _checks.threads(threads)))
    for warning in solved.pop("warnings"):
        _show.warn(str(warning))
    return solved

