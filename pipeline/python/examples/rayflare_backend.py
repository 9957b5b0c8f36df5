# SPDX-License-Identifier: MIT OR Apache-2.0
"""A back-end for RayFlare: its redistribution matrices of one-dimensional gratings by batwing.

`install()` replaces RayFlare's function for one wavelength of its method `inkstone`, so that
`options.RCWA_method = "inkstone"` computes with batwing. Every other part of RayFlare stays: bins,
symmetry, files. A layer is uniform, or has rectangles as long as the unit cell along y. One layer may
absorb; absorption profiles are not computed.

RayFlare 2.0.1 takes sin phi for the x component of orders' wavevectors, inkstone measures phi from x.
Orders of a grating along x then get directions of a grating along y, and power of those that do not
propagate there is left out. `ORDERS_AS_RAYFLARE` keeps that, for comparison.

    python rayflare_backend.py      # compares both, prints times; needs `pip install rayflare`
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from batwing import rcwa

#: Nanometres, RayFlare's unit, in micrometres.
NM = 1e-3
#: Whether directions of orders are those of RayFlare 2.0.1, or those of the grating equation.
ORDERS_AS_RAYFLARE = False


def grating(
    geometry: list[Any], layers: Any, shapes: Any, names: list[str], widths: Any, size: Any
) -> rcwa.Grating:
    """RayFlare's layers as a relief: permittivities of layers and shapes, widths in nanometres."""
    (period, skew), (across, length) = size
    if skew != 0 or across != 0:
        raise ValueError(f"size: expected vectors along x and y, got {size}")
    index = np.sqrt(np.asarray(layers, dtype=complex))
    of_shape = dict(zip(names, np.sqrt(np.asarray(shapes, dtype=complex))))
    polygons: list[rcwa.Polygon] = []
    top = 0.0

    def rectangle(x0: float, x1: float, bottom: float, n: complex) -> None:
        corners = np.array([[x0, top], [x1, top], [x1, bottom], [x0, bottom]]) * NM
        polygons.append(rcwa.Polygon(rcwa.Material.constant(n), corners))

    for number in range(1, len(widths) - 1):
        bottom = top + widths[number]
        rectangle(0.0, period, bottom, complex(index[number]))
        for shape in geometry[number] or []:
            half = shape["halfwidths"]
            if shape["type"] != "rectangle" or shape.get("angle", 0) or 2 * half[1] < length:
                raise ValueError(f"layer {number}: expected rectangles as long as the cell, got {shape}")
            x = shape["center"][0]
            rectangle(x - half[0], x + half[0], bottom, complex(of_shape[str(shape["mat"])]))
        top = bottom
    relief = rcwa.Relief(period * NM, top * NM, rcwa.Material.constant(1.0), tuple(polygons))
    return rcwa.Grating(relief, complex(index[0].real), complex(index[-1]))


def one_wavelength(
    wl: float,
    geom_list: Any,
    l_oc: Any,
    s_oc: Any,
    s_names: Any,
    pol: Any,
    theta: Any,
    phi: Any,
    widths: Any,
    size: Any,
    orders: int,
    phi_sym: float,
    theta_intv: Any,
    phi_intv: Any,
    angle_vector_0: Any,
    s4_options: Any = None,
    layer_details: Any = False,
    side: int = 1,
    dist: Any = None,
) -> Any:
    """Stands for RayFlare's function of the same arguments: R, T, absorption by layer, matrices."""
    from rayflare.rigorous_coupled_wave_analysis.rcwa import fold_phi
    from sparse import COO

    if side != 1 or dist is not None:
        raise ValueError("expected light from the front without profiles")
    structure = grating(geom_list, l_oc, s_oc, s_names, widths, size)
    found = rcwa.solve(
        structure, wl * NM, theta, phi, "both", orders=(orders - 1) // 2, slices=len(widths)
    )
    weight = np.abs(np.asarray(pol, dtype=complex)) ** 2
    weight = weight / weight.sum()
    reflected = np.einsum("nqm,q->nm", found.reflected, weight)
    transmitted = np.einsum("nqm,q->nm", found.transmitted, weight)
    count, bins = len(theta), len(angle_vector_0)
    matrix = np.zeros((bins, count))
    n = np.sqrt(complex(l_oc[0])).real
    tangential = n * np.sin(np.radians(theta))
    fx, fy = tangential * np.cos(np.radians(phi)), tangential * np.sin(np.radians(phi))
    if ORDERS_AS_RAYFLARE:
        fx, fy = fy, fx
    step = wl / size[0][0]
    for powers, numbers, permittivity, leaves in (
        (reflected, found.orders_reflected, l_oc[0], False),
        (transmitted, found.orders_transmitted, l_oc[-1], True),
    ):
        kx = fx[:, None] + numbers * step
        ky = np.broadcast_to(fy[:, None], kx.shape)
        with np.errstate(invalid="ignore", divide="ignore"):
            kz = np.sqrt(permittivity - kx**2 - ky**2 + 0j)
            polar = np.real(np.arccos(kz / np.sqrt(kx**2 + ky**2 + kz**2)))
            ratio = kx / ky if ORDERS_AS_RAYFLARE else ky / kx
            azimuth = fold_phi(np.nan_to_num(np.arctan(ratio)), phi_sym)
        powers = np.where(kz.real > 0, powers, 0.0)
        if leaves:
            polar = np.pi - polar
        polar[polar == 0] = 1e-10
        azimuth[azimuth == 0] = 1e-10
        polar_bin = np.digitize(polar, theta_intv, right=True) - 1
        for i, j in zip(*np.nonzero(powers > 1e-16)):
            number = polar_bin[i, j]
            offset = np.digitize(azimuth[i, j], phi_intv[number], right=True) - 1
            matrix[np.argmin(np.abs(angle_vector_0 - number)) + offset, i] += powers[i, j]
    r, t = reflected.sum(axis=1), transmitted.sum(axis=1)
    absorbing = [i for i in range(len(widths) - 2) if abs(complex(l_oc[i + 1]).imag) > 0]
    absorbed = np.zeros((count, len(widths) - 2))
    if absorbing:
        if len(absorbing) > 1:
            raise ValueError(f"expected one absorbing layer, got {len(absorbing)}")
        absorbed[:, absorbing[0]] = 1 - r - t
    return r, t, absorbed.T, COO.from_numpy(matrix), COO.from_numpy(np.zeros_like(matrix))


def install() -> None:
    """Makes RayFlare's method `inkstone` compute with batwing."""
    from rayflare.rigorous_coupled_wave_analysis import rcwa as theirs

    theirs.RCWA_wl_inkstone = one_wavelength


def compare(orders: int = 31, bins: int = 8) -> tuple[float, float, float, float]:
    """One lamellar grating by both, with RayFlare's directions of orders.

    Returns
    -------
    tuple of float
        Largest difference of R and T; of any element of the matrices; seconds of inkstone, of batwing.
    """
    from rayflare.angles import make_angle_vector
    from rayflare.rigorous_coupled_wave_analysis import rcwa as theirs

    theta_edges, phi_edges, angles = make_angle_vector(bins, np.pi, 0.25)
    incident = angles[: len(angles) // 2]
    ridge = {
        "type": "rectangle",
        "mat": "ridge",
        "center": (250.0, 20.0),
        "halfwidths": [120.0, 20.0],
        "angle": 0,
    }
    arguments: dict[str, Any] = {
        "wl": 800.0,
        "geom_list": [{}, [ridge], {}],
        "l_oc": np.array([1.0, 1.0, 2.25], dtype=complex),
        "s_oc": np.array([2.25], dtype=complex),
        "s_names": ["ridge"],
        "pol": (1, 0),
        "theta": np.degrees(incident[:, 1]),
        "phi": np.degrees(incident[:, 2]),
        "widths": [np.inf, 300.0, np.inf],
        "size": ((500.0, 0.0), (0.0, 40.0)),
        "orders": orders,
        "phi_sym": np.pi,
        "theta_intv": theta_edges,
        "phi_intv": phi_edges,
        "angle_vector_0": angles[:, 0],
    }
    global ORDERS_AS_RAYFLARE
    ORDERS_AS_RAYFLARE = True
    times, results = [], []
    for function in (theirs.RCWA_wl_inkstone, one_wavelength):
        rest = {"S4_options": None} if function is theirs.RCWA_wl_inkstone else {}
        began = time.perf_counter()
        results.append(function(**arguments, **rest))
        times.append(time.perf_counter() - began)
    difference = max(
        float(np.abs(results[0][0] - results[1][0]).max()),
        float(np.abs(results[0][1] - results[1][1]).max()),
    )
    ORDERS_AS_RAYFLARE = False
    matrices = float(np.abs(results[0][3].todense() - results[1][3].todense()).max())
    return difference, matrices, times[0], times[1]


if __name__ == "__main__":
    largest, element, inkstone, own = compare()
    print(f"largest difference of R and T: {largest:.1e}, of an element of the matrices: {element:.1e}")
    print(f"inkstone {inkstone:.3f} s, batwing {own:.3f} s: {inkstone / own:.0f} times as fast")
