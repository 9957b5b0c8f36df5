# SPDX-License-Identifier: MIT OR Apache-2.0
"""BSDFs over cells of direction, from arrays, rows and functions, as the native half takes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from . import _checks
from ._checks import Floats

#: Polar angles of `wo` on one side, azimuths, and values of shape (theta, phi).
Half = tuple[Floats, Floats, Floats]
#: By polar angle and azimuth of `wi`, and whether `wo` is on the inner side.
Nodes = dict[tuple[float, float], dict[bool, Half]]
#: Light from the inner side, transmitted; polar angles and azimuths of `wi`, and the halves of all.
Part = tuple[bool, bool, list[float], list[float], list[tuple[list[float], list[float], Floats]]]

#: Bytes of a value of a function with the directions that it takes, and of one that is kept.
POINT_BYTES, VALUE_BYTES = 150.0, 24.0


def angles(key: str, value: npt.ArrayLike, most: float) -> Floats:
    """Ascending angles from 0 on."""
    found = np.atleast_1d(_checks.floats(key, value))
    inside = found.ndim == 1 and 0.0 <= found.min() and found.max() <= most
    if not inside or (np.diff(found) <= 0.0).any():
        _checks.refuse(key, f"ascending angles from 0 to {most:g} degrees", str(found))
    return found


def step(key: str, value: float, whole: float) -> float:
    """A step that divides the range."""
    found = _checks.length(key, value)
    count = whole / found
    if count < 0.5 or abs(count - round(count)) > 1e-9 * count:
        _checks.refuse(key, f"degrees that divide {whole:g}", found)
    return found


def _sides(theta: Floats) -> dict[bool, npt.NDArray[np.bool_]]:
    """Where angles lie on the outer and on the inner side; 90 degrees end each side that has others."""
    found = {}
    if (theta < 90.0).any():
        found[False] = theta <= 90.0
    if (theta > 90.0).any():
        found[True] = theta >= 90.0
    return found


def _halves(theta: Floats, phi: Floats, values: Floats) -> dict[bool, Half]:
    """Values apart by the side of `wo`."""
    return {inner: (theta[own], phi, values[own]) for inner, own in _sides(theta).items()}


def of_values(values: Floats, grids: tuple[Floats, Floats, Floats, Floats]) -> Nodes:
    """Nodes of an array over polar angles and azimuths of `wi` and `wo`."""
    if (values < 0.0).any():
        place = np.unravel_index(int(np.argmin(values)), values.shape)
        got = f"{float(values[place])} at {_checks.entry(*place)}"
        _checks.refuse("values", "numbers of at least 0", got)
    wi_theta, wi_phi, wo_theta, wo_phi = grids
    if values.ndim == 3:
        values = values[:, np.newaxis]
    shape = tuple(grid.size for grid in grids)
    if values.shape != shape:
        _checks.refuse("values", f"an array of shape {shape}", _checks.describe(values))
    return {
        (float(theta), float(phi)): _halves(wo_theta, wo_phi, values[i, j])
        for i, theta in enumerate(wi_theta)
        for j, phi in enumerate(wi_phi)
    }


def of_rows(rows: Floats) -> Nodes:
    """Nodes of rows in any order: angles of `wi`, those of `wo`, value."""
    if rows.ndim != 2 or rows.shape[1] != 5:
        expected = "rows of wi_theta_deg, wi_phi_deg, wo_theta_deg, wo_phi_deg, value"
        _checks.refuse("rows", expected, _checks.describe(rows))
    low, high = np.zeros(5), np.array([180.0, 360.0, 180.0, 360.0, np.inf])
    outside = np.argwhere((rows < low) | (rows > high))
    if outside.size:
        place = tuple(outside[0])
        expected = "polar angles from 0 to 180, azimuths from 0 to 360, values from 0"
        _checks.refuse("rows", expected, f"{float(rows[place])} at {_checks.entry(*place)}")
    nodes: Nodes = {}
    incidences, which = np.unique(rows[:, :2], axis=0, return_inverse=True)
    for number, (theta, phi) in enumerate(incidences):
        own = rows[which.ravel() == number]
        node = nodes[float(theta), float(phi)] = {}
        for inner, side in _sides(own[:, 2]).items():
            node[inner] = _grid(f"rows with wi at [{theta:g}, {phi:g}]", own[side])
    for pole in (0.0, 180.0):
        along = [place for place in nodes if place[0] == pole]
        others = {phi for theta, phi in nodes if theta != pole and (theta < 90.0) == (pole < 90.0)}
        if len(along) == 1 and others:
            node = nodes.pop(along[0])
            nodes.update({(pole, phi): node for phi in others})
    return nodes


def _grid(key: str, rows: Floats) -> Half:
    """Rows of one side as a grid; one row along the normal stands for all azimuths."""
    along = np.isin(rows[:, 2], (0.0, 180.0))
    if along.sum() == 1 and along.size > 1:
        others = np.unique(rows[~along, 3])
        repeated = np.repeat(rows[along], others.size, axis=0)
        repeated[:, 3] = others
        rows = np.concatenate([rows[~along], repeated])
    rows = rows[np.lexsort((rows[:, 3], rows[:, 2]))]
    thetas, phis = np.unique(rows[:, 2]), np.unique(rows[:, 3])
    grid = np.stack(np.meshgrid(thetas, phis, indexing="ij"), axis=-1).reshape(-1, 2)
    if grid.shape != rows[:, 2:4].shape or (rows[:, 2:4] != grid).any():
        expected = f"each of {thetas.size} polar angles of wo at each of {phis.size} azimuths once"
        _checks.refuse(key, expected, f"{rows.shape[0]} rows")
    return thetas, phis, rows[:, 4].reshape(thetas.size, phis.size)


def of_function(
    function: Callable[[Floats, Floats], npt.ArrayLike],
    incidence: float,
    turn: float | None,
    scatter: float,
) -> Nodes:
    """Nodes of a function of `wi` and `wo` in steps of angle; a value is the mean of its cell."""
    rings, columns, turns = round(180.0 / scatter), round(360.0 / scatter), round(360.0 / (turn or 360.0))
    each = 4.0 * POINT_BYTES + 2.0 * (90.0 / incidence + 1.0) * turns * VALUE_BYTES
    _checks.memory("scatter_deg", rings * columns, each, "cells of wo")
    polar = np.append(np.arange(0.0, 88.5, incidence), 89.0)
    azimuths = [k * (turn or 0.0) for k in range(turns)]
    theta = np.asarray((np.arange(rings) + 0.5) * scatter, dtype=np.float64)
    phi = np.asarray(np.arange(columns) * scatter, dtype=np.float64)
    wo = _points(theta, phi, scatter)

    def values(theta_deg: float, phi_deg: float, wo: Floats) -> Floats:
        wi = np.tile(_direction(np.radians(theta_deg), np.radians(phi_deg)), (len(wo), 1))
        found = _checks.floats("function", function(wi, wo))
        if found.shape != (len(wo),):
            _checks.refuse("function", f"an array of shape ({len(wo)},)", _checks.describe(found))
        if (found < 0.0).any():
            worst = int(np.argmin(found))
            got = f"{float(found[worst])} for wi = {wi[worst]}, wo = {wo[worst]}"
            _checks.refuse("function", "numbers of at least 0", got)
        return found

    if turn is None:
        _check_azimuth(values, wo)
    return {
        (float(angle), azimuth): _halves(
            theta, phi, values(angle, azimuth, wo).reshape(*phi.shape, *theta.shape, 4).mean(-1).T
        )
        for angle in (*polar, *(180.0 - polar))
        for azimuth in azimuths
    }


def _direction(theta: Floats | float, phi: Floats | float) -> Floats:
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def _points(theta: Floats, phi: Floats, scatter: float) -> Floats:
    """Four directions in each cell, azimuth by azimuth: Gauss's rule in sin² theta and in phi."""
    node = np.array([-0.5, 0.5]) / np.sqrt(3.0)
    low, high = (np.sin(np.radians(theta + part * scatter)) ** 2 for part in (-0.5, 0.5))
    sine = np.sqrt((0.5 * (low + high))[:, np.newaxis] + (high - low)[:, np.newaxis] * node)
    angle = np.where(theta[:, np.newaxis] < 90.0, np.arcsin(sine), np.pi - np.arcsin(sine))
    around = np.radians(phi[:, np.newaxis] + node * scatter)
    both = np.broadcast_arrays(angle[np.newaxis, :, :, np.newaxis], around[:, np.newaxis, np.newaxis, :])
    return _direction(*both).reshape(-1, 3)


def _check_azimuth(values: Callable[[float, float, Floats], Floats], wo: Floats) -> None:
    """Refuses a function that does not turn with the incidence."""
    cos, sin = np.cos(1.0), np.sin(1.0)
    turned = wo @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    for angle in (35.0, 145.0):
        once, again = values(angle, 0.0, wo), values(angle, float(np.degrees(1.0)), turned)
        if not np.allclose(once, again, rtol=1e-6, atol=1e-9 * float(once.max())):
            expected = "a step of the azimuth of wi, with which the function changes"
            _checks.refuse("azimuth_deg", expected, "none")


def parts(nodes: Nodes) -> list[Part]:
    """Nodes by side and transport, polar angles from the normal of each side."""
    found: list[Part] = []
    if any(place[0] == 90.0 for place in nodes):
        _checks.refuse("wi", "polar angles below or above 90 degrees", "90")
    for inner in (False, True):
        own = {place: node for place, node in nodes.items() if (place[0] > 90.0) == inner}
        thetas, phis = (sorted({place[axis] for place in own}) for axis in (0, 1))
        if inner:
            thetas.reverse()
        places = [(theta, phi) for theta in thetas for phi in phis]
        for below in (False, True):
            halves = [own[place][below] for place in places if below in own.get(place, {})]
            if not halves:
                continue
            side = f"wi on the {_side(inner)} side, wo on the {_side(below)} side"
            if len(halves) != len(places):
                expected = f"each of {len(thetas)} polar angles of wi at each of {len(phis)} azimuths"
                _checks.refuse(side, expected, f"{len(halves)} directions")
            if phis[-1] - phis[0] >= 360.0:
                _checks.refuse(side, "azimuths of wi below 360 degrees", phis[-1])
            cells = [_upper(side, half, below) for half in halves]
            polar = [180.0 - theta if inner else theta for theta in thetas]
            found.append((inner, inner != below, polar, phis, cells))
    if not found:
        _checks.refuse("wo", "polar angles below or above 90 degrees", "90")
    return found


def _side(inner: bool) -> str:
    return "inner" if inner else "outer"


def _upper(side: str, half: Half, below: bool) -> tuple[list[float], list[float], Floats]:
    """Cells of a half in the upper hemisphere, azimuth by azimuth."""
    theta, phi, values = half
    if phi.size > 1 and phi[-1] - phi[0] <= (179.0 if phi.size == 2 else 180.0):
        got = f"{phi[0]:g} to {phi[-1]:g}"
        _checks.refuse(side, "azimuths of wo around the whole circle", got)
    if below:
        theta, values = 180.0 - theta[::-1], values[::-1]
    return theta.tolist(), phi.tolist(), np.ascontiguousarray(values.T).ravel()
