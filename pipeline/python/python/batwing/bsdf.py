# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scattering of surfaces: tables of diffraction orders, and measured tables of other programs.

The frame of a surface is x across the grooves, y along them, z the outward normal. The *inner* side
is that of z < 0 (the top half-space of a grating), the *outer* side that of z > 0. `wi` points
towards where light came from, `wo` to where it goes; both are unit vectors away from the surface.
Powers are per incident power.

Examples
--------
>>> import numpy as np
>>> from batwing import bsdf, rcwa
>>> relief = rcwa.Relief.triangle(1.0, (0.9, 0.3), ridge=1.41, groove=1.0)
>>> grating = rcwa.Grating(relief, top=1.41, bottom=1.0)
>>> table = bsdf.build(grating, 0.55, orders=8, slices=8, kx_per_zone=2, ky=8)
>>> wi = np.array([[0.0, 0.0, -1.0]])
>>> found = table.albedo(wi)
>>> bool(abs(found.reflected + found.transmitted - 1).max() < 1e-5)
True
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _nodes, _show
from ._checks import Floats
from .gratings import Grating

__all__ = [
    "Albedo",
    "Comparison",
    "Lobes",
    "Samples",
    "Table",
    "TableFormat",
    "WrittenFile",
    "build",
    "compare",
    "convert",
    "from_function",
    "from_rows",
    "from_values",
    "read",
]

#: Order of a lobe that is no diffraction order.
NO_ORDER = -(2**31)
TableFormat = Literal[
    "bworders", "json", "npz", "zemax", "lighttools", "speos", "klems", "tensortree"
]
TableSide = Literal["inner", "outer"]
LobeMotion = Literal["fixed", "shifted"]
_ENDINGS: dict[str, TableFormat] = {".bworders": "bworders", ".json": "json", ".npz": "npz"}
#: Bytes of a direction in arrays and in the solver, and of each of its lobes.
DIRECTION_BYTES, LOBE_BYTES = 200.0, 250.0


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True, eq=False)
class Albedo:
    """Power that leaves a surface per incident power.

    Attributes
    ----------
    reflected, transmitted : ndarray, shape (n, 2)
        For incident s and p.
    """

    reflected: Floats
    transmitted: Floats

    __repr__ = _show.brief


@dataclass(frozen=True, eq=False)
class Lobes:
    """All lobes of light from n directions, those of one direction after those of another.

    Attributes
    ----------
    offsets : ndarray of int, shape (n + 1,)
        The lobes of direction i are those from offsets[i] to offsets[i + 1].
    wo : ndarray, shape (m, 3)
        Direction of each lobe.
    power : ndarray, shape (m, 2)
        Its power for incident s and p.
    order : ndarray of int, shape (m,)
        Diffraction order, `NO_ORDER` where it is none.
    transmitted : ndarray of bool, shape (m,)
        Whether it leaves on the other side.
    """

    offsets: npt.NDArray[np.int64]
    wo: Floats
    power: Floats
    order: npt.NDArray[np.int32]
    transmitted: npt.NDArray[np.bool_]

    __repr__ = _show.brief


@dataclass(frozen=True, eq=False)
class Samples:
    """One outgoing direction for each incident one, drawn for unpolarised light.

    Attributes
    ----------
    wo : ndarray, shape (n, 3)
        Directions; 0 where the light is absorbed.
    weight : ndarray, shape (n,)
        Factors on the power, 0 where it is absorbed.
    order : ndarray of int, shape (n,)
        Diffraction orders, `NO_ORDER` where it is none.
    transmitted : ndarray of bool, shape (n,)
        Whether the light leaves on the other side.
    """

    wo: Floats
    weight: Floats
    order: npt.NDArray[np.int32]
    transmitted: npt.NDArray[np.bool_]

    __repr__ = _show.brief


@dataclass(frozen=True)
class WrittenFile:
    """A file that was written, and what its cells lose of the orders (as the command says it)."""

    path: Path
    loss: dict[str, Any]


class Table:
    """A surface that scatters: a table of diffraction orders, or of measured cells.

    Tables are made by `build`, `read`, `from_values`, `from_rows` and `from_function`. They can be
    pickled where they hold orders, and used from several threads.
    """

    __slots__ = ("_surface",)

    def __init__(self, surface: _native.Surface) -> None:
        if not isinstance(surface, _native.Surface):
            _checks.refuse("surface", "what batwing.bsdf.build or read gives", _checks.describe(surface))
        self._surface = surface

    def __reduce__(self) -> tuple[Any, tuple[bytes]]:
        return _from_bytes, (self._surface.to_bytes(),)

    @property
    def header(self) -> dict[str, Any] | None:
        """Origin, errors and grid of a table of orders; None for measured cells."""
        text = self._surface.header()
        return None if text is None else dict(json.loads(text))

    @property
    def indices(self) -> tuple[float, float]:
        """Refractive index of the inner and of the outer side."""
        inner, outer = self._surface.indices()
        return inner, outer

    def lobes(self, wi: npt.ArrayLike, threads: int | None = None) -> Lobes:
        """All lobes of light from each direction; arguments and errors as those of `sample`."""
        found = self._surface.lobes(self._directions(wi, lobes=True), _checks.threads(threads))
        return Lobes(*found)

    def albedo(self, wi: npt.ArrayLike, threads: int | None = None) -> Albedo:
        """Power reflected and transmitted; arguments and errors as those of `sample`."""
        found = self._surface.albedo(self._directions(wi), _checks.threads(threads))
        return Albedo(found[:, 0], found[:, 1])

    def evaluate(self, wi: npt.ArrayLike, threads: int | None = None) -> Lobes:
        """The same as `lobes`: the scattering of orders is a list of directions and powers."""
        return self.lobes(wi, threads)

    def sample(self, wi: npt.ArrayLike, seed: int = 1, threads: int | None = None) -> Samples:
        """Draws one outgoing direction for each incident one.

        Parameters
        ----------
        wi : array_like, shape (n, 3)
            Unit vectors towards where the light came from.
        seed : int
            The same seed gives the same directions on any number of threads.
        threads : int, optional
            Threads of this call.

        Raises
        ------
        batwing.InputError
            Another shape or dtype, vectors of another length than 1.
        """
        seed = _checks.whole("seed", seed, 0, 2**64 - 1)
        return Samples(*self._surface.sample(self._directions(wi), seed, _checks.threads(threads)))

    def _directions(self, wi: npt.ArrayLike, lobes: bool = False) -> Floats:
        """Unit vectors as rows, no more than fit into memory with what comes of them."""
        count = np.size(wi) // 3
        each = DIRECTION_BYTES
        if lobes and count > 10_000:
            probe = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
            each += 2.0 * LOBE_BYTES * float(np.diff(self._surface.lobes(probe, None)[0]).max())
        _checks.memory("wi", count, each)
        return _checks.vectors("wi", wi)

    def write(
        self,
        path: str | os.PathLike[str],
        format: TableFormat | None = None,
        *,
        incidence_deg: float = 10.0,
        azimuth_deg: float = 30.0,
        scatter_deg: float = 1.0,
        samples: int = 64,
        tree_log2: int = 5,
        wavelength_nm: float | None = None,
        threads: int | None = None,
    ) -> list[WrittenFile]:
        """Writes the table.

        Parameters
        ----------
        path : path
            File to write; Zemax and Speos tables become several files beside it.
        format : str, optional
            `bworders`, `json`, `npz` (orders), `zemax`, `lighttools`, `speos`, `klems`, `tensortree`
            (cells) [default: by the ending of the path].
        incidence_deg, azimuth_deg, scatter_deg : float
            Steps of tables on angles: of the polar angle and the azimuth of incidence, and of the
            scattered directions.
        samples : int
            Incidences over which the power of each node is averaged.
        tree_log2 : int
            Logarithm of the cells of a tensor tree along one coordinate.
        wavelength_nm : float, optional
            Stated in the file [default: that of a table of orders].
        threads : int, optional
            Threads of this call.

        Returns
        -------
        list of WrittenFile
            The files, each with what its cells lose.

        Raises
        ------
        batwing.InputError
            A format that does not suit the table, steps that do not fit.
        batwing.FileError
            A file that cannot be written.
        """
        target = Path(path)
        chosen: str = _ENDINGS.get(target.suffix, target.suffix) if format is None else format
        written = self._surface.write(
            str(target),
            _checks.choice("format", chosen, get_args(TableFormat)),
            _checks.length("incidence_deg", incidence_deg),
            _checks.length("azimuth_deg", azimuth_deg),
            _checks.length("scatter_deg", scatter_deg),
            _checks.whole("samples", samples, 1, 1024),
            _checks.whole("tree_log2", tree_log2, 1, 7),
            wavelength_nm,
            _checks.threads(threads),
        )
        return [WrittenFile(Path(file), json.loads(loss)) for file, loss in written]

    save = write

    def plot(self, ax: Any = None) -> Any:
        """Albedo over the angle of incidence from both sides; returns the axes."""
        return _show.table(self, ax)

    def __repr__(self) -> str:
        header = self.header
        inner, outer = self.indices
        if header is None:
            return f"<batwing.bsdf.Table of measured cells between indices {inner:g} and {outer:g}>"
        return f"<batwing.bsdf.Table of {header['entries']} orders between indices {inner:g} and {outer:g}>"


def _from_bytes(data: bytes) -> Table:
    return Table(_native.Surface.from_bytes(data))


def build(
    grating: Grating,
    wavelength_um: float,
    *,
    tolerance: float | None = None,
    orders: int | None = None,
    slices: int | None = None,
    kx_per_zone: int | None = None,
    ky: int | npt.ArrayLike | None = None,
    threads: int | None = None,
) -> Table:
    """Solves a grating over both hemispheres and makes a table of it.

    Parameters
    ----------
    grating : Grating
        Its half-spaces have real indices; the top one becomes the inner side.
    wavelength_um : float
        Vacuum wavelength, micrometres.
    tolerance : float, optional
        Error of hemispherical shares, from which orders, slices and grid follow [default: 1e-3].
    orders, slices : int, optional
        Resolution of the solver, in place of that of the tolerance.
    kx_per_zone : int, optional
        Nodes of kx to one order spacing [default: by the tolerance].
    ky : int or array_like, optional
        Number of nodes along the grooves, or the nodes, with `kx_per_zone` [default: by the
        tolerance].
    threads : int, optional
        Threads of this call; the table does not depend on them.

    Returns
    -------
    Table
        A table of diffraction orders.

    Raises
    ------
    batwing.InputError
        An argument out of its range, an absorbing half-space, too much memory.
    batwing.ConvergenceError
        A tolerance out of reach.
    """
    _checks.instance("grating", grating, Grating, "a batwing.rcwa.Grating")
    wavelength = _checks.length("wavelength_um", wavelength_um)
    aim = 1e-3 if tolerance is None else _checks.number("tolerance", tolerance)
    interface = grating._at(wavelength)
    resolution = None
    if orders is not None:
        order, slice_count, _ = grating._resolve(wavelength, orders, slices, None, threads)
        resolution = (order, slice_count)
    elif slices is not None:
        _checks.refuse("slices", "orders beside them", "none")
    nodes = None
    if ky is not None:
        if kx_per_zone is None:
            _checks.refuse("ky", "kx_per_zone beside it", "none")
        nodes = grating._ky_nodes(wavelength, ky)
    zone = None if kx_per_zone is None else _checks.whole("kx_per_zone", kx_per_zone, 1, 4096)
    found = _native.build_table(
        interface, aim, resolution, zone, nodes, _checks.threads(threads)
    )
    return Table(found)


def read(
    path: str | os.PathLike[str],
    *,
    indices: Sequence[float] = (1.0, 1.0),
    between: LobeMotion = "fixed",
    side: TableSide = "outer",
) -> Table:
    """Reads a table of any format that the program reads.

    Parameters
    ----------
    path : path
        `.bworders`, `.json`, `.npz`; Zemax, LightTools and Speos BSDF; WINDOW and Radiance XML.
    indices : (float, float)
        Index of the inner and outer side of a measured surface.
    between : {'fixed', 'shifted'}
        Whether lobes of measured cells stay, or move with the incident light, between its nodes.
    side : {'outer', 'inner'}
        Where the light of a Zemax or Speos file comes from.

    Raises
    ------
    batwing.FileError
        A file that cannot be read.
    batwing.InputError
        A file that does not keep to its format; the message says line or byte, what was expected and
        what stands there.
    """
    inner, outer, shifted = _between(indices, between)
    side = _checks.choice("side", side, get_args(TableSide))
    return Table(_native.Surface.read(os.fspath(path), (inner, outer), shifted, side == "inner"))


def _between(indices: Sequence[float], between: LobeMotion) -> tuple[float, float, bool]:
    """Index of the inner and the outer side, and whether lobes are shifted."""
    both = _checks.floats("indices", indices)
    if both.shape != (2,) or both.min() <= 0.0:
        _checks.refuse("indices", "two numbers above 0, of the inner and the outer side", str(both))
    shifted = _checks.choice("between", between, get_args(LobeMotion)) == "shifted"
    return float(both[0]), float(both[1]), shifted


def from_values(
    values: npt.ArrayLike,
    *,
    wi_theta_deg: npt.ArrayLike,
    wo_theta_deg: npt.ArrayLike,
    wo_phi_deg: npt.ArrayLike,
    wi_phi_deg: npt.ArrayLike = 0.0,
    indices: Sequence[float] = (1.0, 1.0),
    between: LobeMotion = "fixed",
) -> Table:
    """A table of BSDFs on grids of angles, with the checks of the files of other programs.

    Polar angles count from the outward normal: those below 90 degrees are on the outer side, those
    above on the inner side. Where `wi` and `wo` are on one side, the value belongs to reflection, else
    to transmission; what is left out scatters nothing, or follows by reciprocity as in files. A value
    holds half-way to its neighbours in `wo`. Between directions of `wi` powers are interpolated.

    Parameters
    ----------
    values : array_like, shape (wi_theta, wi_phi, wo_theta, wo_phi)
        Power per incident power, solid angle and cosine of `wo`, 1/sr; without the axis of `wi_phi`
        where that is one.
    wi_theta_deg, wo_theta_deg : array_like
        Polar angles, 0 to 180 degrees, ascending.
    wi_phi_deg : array_like
        Azimuths, 0 to below 360 degrees; one stands for all, with which the scattering turns.
    wo_phi_deg : array_like
        Azimuths around the whole circle, 0 to 360 degrees, ascending.
    indices : (float, float)
        Index of the inner and outer side.
    between : {'fixed', 'shifted'}
        Whether lobes stay, or move with the incident light, between its directions.

    Raises
    ------
    batwing.InputError
        Angles out of order, values below 0, NaN, powers above 1.

    Examples
    --------
    A white wall of the reflectance 0.6:

    >>> theta, phi = np.arange(2.5, 90, 5), np.arange(0, 360, 30)
    >>> values = np.full((2, theta.size, phi.size), 0.6 / np.pi)
    >>> wall = from_values(values, wi_theta_deg=[0, 80], wo_theta_deg=theta, wo_phi_deg=phi)
    >>> wall.albedo(np.array([[0.0, 0.6, 0.8]])).reflected.round(6)
    array([[0.6, 0.6]])
    """
    grids = (
        _nodes.angles("wi_theta_deg", wi_theta_deg, 180.0),
        _nodes.angles("wi_phi_deg", wi_phi_deg, 360.0),
        _nodes.angles("wo_theta_deg", wo_theta_deg, 180.0),
        _nodes.angles("wo_phi_deg", wo_phi_deg, 360.0),
    )
    return _of_nodes(_nodes.of_values(_checks.floats("values", values), grids), indices, between)


def from_rows(
    rows: npt.ArrayLike, *, indices: Sequence[float] = (1.0, 1.0), between: LobeMotion = "fixed"
) -> Table:
    """A table of measured rows; angles, values and other arguments are those of `from_values`.

    Parameters
    ----------
    rows : array_like, shape (n, 5)
        Polar angle and azimuth of `wi`, those of `wo`, and the BSDF in 1/sr, in any order. For each
        direction of `wi`, the rows of one side of `wo` have each of their polar angles at each of
        their azimuths. Along the normal one azimuth stands for all, of `wi` and of `wo`.
    """
    return _of_nodes(_nodes.of_rows(_checks.floats("rows", rows)), indices, between)


def from_function(
    function: Callable[[Floats, Floats], npt.ArrayLike],
    *,
    incidence_deg: float = 5.0,
    azimuth_deg: float | None = None,
    scatter_deg: float = 2.0,
    indices: Sequence[float] = (1.0, 1.0),
    between: LobeMotion = "fixed",
) -> Table:
    """A table of a BSDF by formula; other arguments are those of `from_values`.

    Parameters
    ----------
    function : callable
        BSDF in 1/sr of unit vectors `wi` and `wo`, arrays of shape (n, 3): an array of shape (n,). It
        is called for `wi` and `wo` on both sides: z > 0 is the outer one.
    incidence_deg, azimuth_deg : float
        Steps of the polar angle and azimuth of `wi` [default: one azimuth, with which the scattering
        turns].
    scatter_deg : float
        Steps of polar angle and azimuth of `wo`: a cell holds the mean of four points, weighted by
        their cosine.

    Raises
    ------
    batwing.InputError
        A step that does not divide its range; values below 0, NaN; powers above 1; a function that
        changes with the azimuth, without `azimuth_deg`.

    Examples
    --------
    A diffuser of glossy transmission, which reflects nothing:

    >>> def glossy(wi, wo):
    ...     through = np.where(wi[:, 2] * wo[:, 2] < 0, 1.0, 0.0)
    ...     return through * 0.5 * 9 / (2 * np.pi) * np.abs(wo[:, 2]) ** 7
    >>> found = from_function(glossy, scatter_deg=5).albedo(np.array([[0.0, 0.0, 1.0]]))
    >>> found.transmitted.round(4)
    array([[0.5, 0.5]])
    """
    incidence = _nodes.step("incidence_deg", incidence_deg, 90.0)
    turn = None if azimuth_deg is None else _nodes.step("azimuth_deg", azimuth_deg, 360.0)
    scatter = _nodes.step("scatter_deg", scatter_deg, 90.0)
    return _of_nodes(_nodes.of_function(function, incidence, turn, scatter), indices, between)


def _of_nodes(nodes: _nodes.Nodes, indices: Sequence[float], between: LobeMotion) -> Table:
    inner, outer, shifted = _between(indices, between)
    return Table(_native.Surface.from_cells(_nodes.parts(nodes), (inner, outer), shifted))


def convert(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    format: TableFormat | None = None,
    **steps: Any,
) -> list[WrittenFile]:
    """Reads one file and writes it in another format; `steps` are arguments of `Table.write`."""
    return read(source).write(target, format, **steps)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two surfaces under the same light.

    Attributes
    ----------
    theta_deg : ndarray, shape (n,)
        Polar angles of incidence, measured from the normal of the side.
    side : str
        Side that the light comes from.
    albedo_difference : ndarray, shape (n, 2)
        Second less first: total power reflected, and transmitted, unpolarised.
    distance : ndarray, shape (n,)
        Half the sum of the absolute differences of power in cells of direction: 0 for the same
        distribution, 1 for none in common.
    """

    theta_deg: Floats
    side: TableSide
    albedo_difference: Floats
    distance: Floats

    __repr__ = _show.brief


def compare(
    first: Table,
    second: Table,
    *,
    side: TableSide = "inner",
    theta_deg: npt.ArrayLike | None = None,
    phi_deg: float = 0.0,
    cells: int = 24,
    threads: int | None = None,
) -> Comparison:
    """Compares the scattering of two surfaces.

    Parameters
    ----------
    first, second : Table
        The surfaces.
    side : {'inner', 'outer'}
        Where the light comes from.
    theta_deg : array_like, optional
        Polar angles of incidence, 0 to 89 degrees [default: every 5 degrees].
    phi_deg : float
        Azimuth of `wi`.
    cells : int
        Cells of equal width across each of the tangential components of `wo`, for the distance.
    threads : int, optional
        Threads of this call.
    """
    for key, table in (("first", first), ("second", second)):
        _checks.instance(key, table, Table, "a batwing.bsdf.Table")
    side = _checks.choice("side", side, get_args(TableSide))
    theta = np.atleast_1d(
        np.arange(0.0, 90.0, 5.0) if theta_deg is None else _checks.floats("theta_deg", theta_deg)
    )
    count = _checks.whole("cells", cells, 1, 512)
    phi = np.radians(_checks.number("phi_deg", phi_deg))
    sine, cosine = np.sin(np.radians(theta)), np.cos(np.radians(theta))
    z = -cosine if side == "inner" else cosine
    wi = np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1)
    pictures, albedos = [], []
    for surface in (first, second):
        lobes = surface.lobes(wi, threads)
        power = lobes.power.mean(axis=1)
        which = np.repeat(np.arange(theta.size), np.diff(lobes.offsets))
        bins = np.clip(((lobes.wo[:, :2] + 1) / 2 * count).astype(int), 0, count - 1)
        picture = np.zeros((theta.size, 2, count, count))
        np.add.at(picture, (which, lobes.transmitted.astype(int), bins[:, 0], bins[:, 1]), power)
        pictures.append(picture)
        albedos.append(picture.sum(axis=(2, 3)))
    difference = np.abs(pictures[1] - pictures[0]).sum(axis=(1, 2, 3))
    return Comparison(theta, side, albedos[1] - albedos[0], 0.5 * difference)
