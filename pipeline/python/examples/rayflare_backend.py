# SPDX-License-Identifier: MIT OR Apache-2.0
"""A back-end for RayFlare: its redistribution matrices of one-dimensional gratings by batwing.

`install()` replaces RayFlare's function for one wavelength of its method `inkstone`, so that
`options.RCWA_method = "inkstone"` computes with batwing. Every other part of RayFlare stays: bins,
symmetry, files. A layer is uniform, or has rectangles as long as the unit cell along y. One layer may
absorb; absorption profiles are not computed.

    python rayflare_backend.py      # compares both, prints times; needs `pip install rayflare`
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from batwing import rcwa

#: Nanometres, RayFlare's unit, in micrometres.
NM = 1e-3


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
    # RayFlare's azimuth of an order: that of (ky, kx), folded.
    n = np.sqrt(complex(l_oc[0])).real
    tangential = n * np.sin(np.radians(theta))
    fx, fy = tangential * np.sin(np.radians(phi)), tangential * np.cos(np.radians(phi))
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
            azimuth = fold_phi(np.nan_to_num(np.arctan(kx / ky)), phi_sym)
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


def compare(orders: int = 11, bins: int = 12) -> tuple[float, float, float]:
    """One lamellar grating by both: largest difference of the matrices, and both times in seconds."""
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
        "l_oc": np.array([1.0, 1.0, 2.25]),
        "s_oc": np.array([2.25]),
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
    return difference, times[0], times[1]


if __name__ == "__main__":
    largest, inkstone, own = compare()
    print(f"largest difference of R and T: {largest:.1e}")
    print(f"inkstone {inkstone:.3f} s, batwing {own:.3f} s: {inkstone / own:.0f} times as fast")
