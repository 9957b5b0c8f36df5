# SPDX-License-Identifier: MIT OR Apache-2.0
"""Power by angle of line sources in a small toothed dome on a mirror, by finite elements: the values of
finite_elements.rs.

    pip install ngsolve==6.2.2608 && python finite_elements.py

Nodal elements of high order in half a disc, a perfectly matched layer around it, elements that shrink towards the
corners. A source is cut off smoothly around its place, so that the field that is left has no singularity; the field
on a half circle outside the dome, continued by the mirror, is a series of Hankel functions that gives the far field.
"""

import sys

import numpy as np
from netgen.occ import Axes, Circle, Face, Glue, OCCGeometry, Wire, WorkPlane, X, Y, Z
from ngsolve import (BilinearForm, BoundaryFromVolumeCF, CoefficientFunction, GridFunction, H1, IfPos, LinearForm, Mesh,
                     dx, exp, grad, pml, sqrt, x, y)
from scipy.special import hankel1

WAVELENGTH, INDEX = 0.55, 1.41
SOURCES = [(0.0, 1.5), (-1.1, 1.2)]
DOME = [(3.0, 0.0), (3.0, 1.6), (2.2, 1.5), (2.4, 2.4), (1.0, 2.4), (1.0, 3.0), (-1.0, 3.0), (-1.0, 2.4), (-2.4, 2.4),
        (-2.2, 1.5), (-3.0, 1.6), (-3.0, 0.0)]
READ, LAYER, END = 3.9, 4.1, 5.2
K = 2 * np.pi / WAVELENGTH


def mesh_of(longest, at_corners):
    def half_disc(radius):
        plane = WorkPlane().MoveTo(radius, 0).Direction(0, 1).Arc(radius, 180).Close()
        return plane.Face()

    plane = WorkPlane().MoveTo(*DOME[0])
    for point in DOME[1:]:
        plane = plane.LineTo(*point)
    dome = plane.Close().Face()
    dome.faces.name = "dome"
    inner, outer = half_disc(LAYER), half_disc(END)
    layer, air = outer - inner, inner - dome
    layer.faces.name, air.faces.name = "layer", "air"
    for vertex in dome.vertices:
        if vertex.p[1] > 0.1:
            vertex.maxh = at_corners
    whole = Glue([dome, air, layer])
    for edge in whole.edges:
        if abs(edge.center[1]) < 1e-9:
            edge.name = "mirror"
    whole.faces["dome"].maxh = longest / INDEX
    mesh = Mesh(OCCGeometry(whole, dim=2).GenerateMesh(maxh=longest, grading=0.3))
    mesh.Curve(6)
    mesh.SetPML(pml.Radial(origin=(0, 0), rad=LAYER, alpha=1j), "layer")
    return mesh


def hankel(z):
    """H0 and H1 as coefficient functions: values at the points of integration come from a table, so they are
    interpolated in no way but by a spline of their phase and modulus."""
    from ngsolve import BSpline
    knots = np.linspace(0.2 * K * INDEX, 1.1 * K * INDEX, 4000)
    out = []
    for order in (0, 1):
        values = hankel1(order, knots)
        parts = []
        for part in (values.real, values.imag):
            from scipy.interpolate import make_interp_spline
            spline = make_interp_spline(knots, part, k=5)
            parts.append(BSpline(6, list(spline.t), list(spline.c))(z))
        out.append(parts[0] + 1j * parts[1])
    return out


def solve(mesh, order, te):
    p = {"dome": 1.0 if te else 1 / INDEX**2, "air": 1.0, "layer": 1.0}
    q = {"dome": K**2 * (INDEX**2 if te else 1.0), "air": K**2, "layer": K**2}
    p, q = mesh.MaterialCF(p), mesh.MaterialCF(q)
    space = H1(mesh, order=order, complex=True, dirichlet="mirror" if te else "")
    u, v = space.TnT()
    form = BilinearForm(p * grad(u) * grad(v) * dx - q * u * v * dx, symmetric=True).Assemble()
    inverse = form.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    field = GridFunction(space)
    powers = []
    for sx, sy in SOURCES:
        r = sqrt((x - sx)**2 + (y - sy)**2)
        a, b = 0.3, 1.0
        t = (r - a) / (b - a)
        # Smooth to the fourth derivative.
        first = -630 * t**4 * (1 - t)**4 / (b - a)
        second = -630 * 4 * t**3 * (1 - t)**3 * (1 - 2 * t) / (b - a)**2
        h0, h1 = hankel(K * INDEX * r)
        wave, slope = 0.25j * h0, -0.25j * K * INDEX * h1
        density = (1.0 if te else 1 / INDEX**2) * (2 * first * slope + (second + first / r) * wave)
        density = IfPos(r - a, IfPos(b - r, density, 0), 0)
        right = LinearForm(space)
        right += (-1) * (-density) * v * dx("dome", bonus_intorder=12)
        right.Assemble()
        field.vec.data = inverse * right.vec
        powers.append(far(mesh, field, te))
    return powers, space.ndof


def far(mesh, field, te):
    """Power in bins of 5 degrees from the left horizon to the right one, over what the source emits in an endless
    medium of the index of the dome."""
    count = 512
    azimuths = (np.arange(count) + 0.5) * np.pi / count
    values = np.array([field(mesh(READ * np.cos(t), READ * np.sin(t))) for t in azimuths])
    whole = np.concatenate([values, (-1 if te else 1) * values[::-1]])
    angles = np.concatenate([azimuths, 2 * np.pi - azimuths[::-1]])
    most = int(K * READ + 12)
    orders = np.arange(-most, most + 1)
    amplitudes = np.array([np.mean(whole * np.exp(-1j * m * angles)) / hankel1(m, K * READ) for m in orders])
    nodes, weights = np.polynomial.legendre.leggauss(16)
    bins = []
    for k in range(36):
        # From z towards x: azimuth = 90 degrees - angle.
        angle = np.radians(-90 + 5 * (k + 0.5 + 0.5 * nodes))
        wave = np.exp(1j * np.outer(np.pi / 2 - angle, orders)) @ (amplitudes * (-1j)**orders)
        density = 8 / np.pi * np.abs(wave)**2 * (1.0 if te else INDEX**2)
        bins.append(np.sum(weights * density) * np.radians(2.5))
    return np.array(bins)


def main():
    longest, at_corners, order = (float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])) if len(sys.argv) > 3 \
        else (0.25, 0.01, 6)
    mesh = mesh_of(longest, at_corners)
    for te in (True, False):
        powers, unknowns = solve(mesh, order, te)
        for source, bins in enumerate(powers):
            print("TE" if te else "TM", "source", source, "unknowns", unknowns, "power", bins.sum())
            print(", ".join(f"{value:.6f}" for value in bins))


if __name__ == "__main__":
    main()
