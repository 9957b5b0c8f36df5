# SPDX-License-Identifier: MIT OR Apache-2.0
"""Power by angle of line sources in a small toothed dome on a mirror, by finite elements: the values of
finite_elements.rs.

    pip install ngsolve==6.2.2608 scipy && python finite_elements.py [LONGEST AT_CORNERS ORDER]

Nodal elements of high order in half a disc, at most LONGEST and at the corners AT_CORNERS long (µm), and a perfectly
matched layer about it. A source is cut off smoothly about its place, so that the field that is left has no
singularity. The field on a half circle outside the dome, continued by the mirror, is a series of Hankel functions,
which gives the far field.
"""

import sys

import numpy as np
from netgen.occ import Glue, OCCGeometry, WorkPlane
from ngsolve import BilinearForm, BSpline, GridFunction, H1, IfPos, LinearForm, Mesh, dx, grad, pml, sqrt, x, y
from scipy.interpolate import make_interp_spline
from scipy.special import hankel1

WAVELENGTH, INDEX = 0.55, 1.41
K = 2 * np.pi / WAVELENGTH
SOURCES = [(0.0, 1.5), (-1.1, 1.2)]
DOME = [(3.0, 0.0), (3.0, 1.6), (2.2, 1.5), (2.4, 2.4), (1.0, 2.4), (1.0, 3.0), (-1.0, 3.0), (-1.0, 2.4), (-2.4, 2.4),
        (-2.2, 1.5), (-3.0, 1.6), (-3.0, 0.0)]
# Radii of the circle of the far field, and of both ends of the layer.
READ, LAYER, END = 3.9, 4.1, 5.2
# Distances from a source between which it is cut off.
FROM, TO = 0.3, 1.0


def mesh_of(longest, at_corners):
    def half_disc(radius):
        return WorkPlane().MoveTo(radius, 0).Direction(0, 1).Arc(radius, 180).Close().Face()

    plane = WorkPlane().MoveTo(*DOME[0])
    for point in DOME[1:]:
        plane = plane.LineTo(*point)
    dome = plane.Close().Face()
    inner, outer = half_disc(LAYER), half_disc(END)
    air, layer = inner - dome, outer - inner
    for name, part in (("dome", dome), ("air", air), ("layer", layer)):
        part.faces.name = name
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


def hankel(order, z):
    """The Hankel function as a spline of fifth order."""
    knots = np.linspace(0.9 * FROM, 1.1 * TO, 4000) * K * INDEX
    values = hankel1(order, knots)
    splines = [make_interp_spline(knots, part, k=5) for part in (values.real, values.imag)]
    real, imaginary = (BSpline(6, list(spline.t), list(spline.c))(z) for spline in splines)
    return real + 1j * imaginary


def solve(mesh, order, te):
    weight = 1.0 if te else 1 / INDEX**2
    p = mesh.MaterialCF({"dome": weight, "air": 1.0, "layer": 1.0})
    q = mesh.MaterialCF({"dome": weight * (K * INDEX)**2, "air": K**2, "layer": K**2})
    space = H1(mesh, order=order, complex=True, dirichlet="mirror" if te else "")
    u, v = space.TnT()
    form = BilinearForm(p * grad(u) * grad(v) * dx - q * u * v * dx, symmetric=True).Assemble()
    inverse = form.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    field = GridFunction(space)
    for source_x, source_y in SOURCES:
        r = sqrt((x - source_x)**2 + (y - source_y)**2)
        t = (r - FROM) / (TO - FROM)
        # Derivatives of the cut, which is smooth to its fourth.
        first = -630 * t**4 * (1 - t)**4 / (TO - FROM)
        second = -2520 * t**3 * (1 - t)**3 * (1 - 2 * t) / (TO - FROM)**2
        wave, slope = 0.25j * hankel(0, K * INDEX * r), -0.25j * K * INDEX * hankel(1, K * INDEX * r)
        density = weight * (2 * first * slope + (second + first / r) * wave)
        density = IfPos(r - FROM, IfPos(TO - r, density, 0), 0)
        right = LinearForm(density * v * dx("dome", bonus_intorder=12)).Assemble()
        field.vec.data = inverse * right.vec
        yield power(mesh, field, te)


def power(mesh, field, te):
    """Power in bins of 5 degrees from the left horizon to the right one, over what the source emits in an endless
    medium of the index of the dome."""
    azimuths = (np.arange(512) + 0.5) * np.pi / 512
    values = np.array([field(mesh(READ * np.cos(t), READ * np.sin(t))) for t in azimuths])
    whole = np.concatenate([values, (-1 if te else 1) * values[::-1]])
    angles = np.concatenate([azimuths, 2 * np.pi - azimuths[::-1]])
    most = int(K * READ + 12)
    orders = np.arange(-most, most + 1)
    amplitudes = np.array([np.mean(whole * np.exp(-1j * m * angles)) / hankel1(m, K * READ) for m in orders])
    nodes, weights = np.polynomial.legendre.leggauss(16)
    bins = []
    for k in range(36):
        # From z towards x.
        angle = np.radians(-90 + 5 * (k + 0.5 + 0.5 * nodes))
        wave = np.exp(1j * np.outer(np.pi / 2 - angle, orders)) @ (amplitudes * (-1j)**orders)
        density = 8 / np.pi * np.abs(wave)**2 * (1.0 if te else INDEX**2)
        bins.append(np.sum(weights * density) * np.radians(2.5))
    return bins


def main():
    longest, at_corners, order = sys.argv[1:] if len(sys.argv) > 1 else (0.2, 0.005, 7)
    mesh = mesh_of(float(longest), float(at_corners))
    for te in (True, False):
        for bins in solve(mesh, int(order), te):
            print("TE" if te else "TM", ", ".join(f"{value:.5f}" for value in bins))


if __name__ == "__main__":
    main()
