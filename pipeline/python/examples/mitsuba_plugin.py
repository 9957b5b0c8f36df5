# SPDX-License-Identifier: MIT OR Apache-2.0
"""A BSDF plug-in for Mitsuba 3 that samples tables of diffraction orders.

    python mitsuba_plugin.py        # compares a smooth table with `dielectric`; needs `pip install mitsuba`

Registered as `batwing`, with the parameter `filename` (a table of any format that `batwing.bsdf.read`
takes). The grooves run along the second tangent of the surface. Orders are discrete directions, so
that the lobes are of the kind *delta*: they are sampled, and evaluate to 0. The scalar variants of Mitsuba
are served; those that compile loops cannot call Python in them.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from batwing import bsdf


def register(mi: Any) -> None:
    """Registers the plug-in with the scalar variant of Mitsuba that is set."""
    if not mi.variant().startswith("scalar"):
        raise ValueError(f"variant: expected a scalar one, got {mi.variant()}")

    class Orders(mi.BSDF):  # type: ignore[misc]
        """Scattering by a table of orders; z of the local frame points to the outer side."""

        def __init__(self, properties: Any) -> None:
            mi.BSDF.__init__(self, properties)
            self.table = bsdf.read(properties["filename"])
            inner, outer = self.table.indices
            self.ratio = inner / outer
            flags = mi.BSDFFlags
            self.m_components = [
                flags.DeltaReflection | flags.FrontSide | flags.BackSide,
                flags.DeltaTransmission | flags.FrontSide | flags.BackSide | flags.NonSymmetric,
            ]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def sample(
            self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> tuple[Any, Any]:
            wi = np.array([si.wi.x, si.wi.y, si.wi.z], dtype=np.float64)
            # Mitsuba's own random numbers seed those of the table.
            seed = np.float64(sample1 + 2 * sample2.x).view(np.uint64)
            drawn = self.table.sample(wi / np.linalg.norm(wi), seed=int(seed))
            wo, weight = drawn.wo[0], float(drawn.weight[0])
            n_here, n_there = (1.0 if z > 0 else self.ratio for z in (wi[2], wo[2]))
            found = mi.BSDFSample3f()
            found.wo = mi.Vector3f(*wo.tolist())
            found.eta = n_there / n_here
            found.pdf = float(weight > 0)
            through = bool(drawn.transmitted[0])
            flags = mi.BSDFFlags
            found.sampled_type = +(flags.DeltaTransmission if through else flags.DeltaReflection)
            found.sampled_component = int(through)
            if ctx.mode == mi.TransportMode.Radiance:
                # Radiance over the square of the index is carried; powers are what the table holds.
                weight *= (n_here / n_there) ** 2
            return found, mi.Spectrum(weight if active else 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            return mi.Spectrum(0), mi.Float(0)

        def to_string(self) -> str:
            return f"Orders[{self.table!r}]"

    mi.register_bsdf("batwing", Orders)


def compare(mi: Any, filename: str, other: dict[str, Any], count: int = 20_000) -> dict[str, float]:
    """Mean share transmitted of a table and of another plug-in from the inner side at 30 degrees."""
    context = mi.BSDFContext(mi.TransportMode.Importance)
    wi = [np.sin(np.radians(30.0)), 0.0, -np.cos(np.radians(30.0))]
    rng = np.random.default_rng(1)
    shares = {}
    for name, scene in (("batwing", {"type": "batwing", "filename": filename}), ("other", other)):
        plugin = mi.load_dict(scene)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*wi)
        passed = 0.0
        for first, second, third in rng.uniform(size=(count, 3)):
            found, weight = plugin.sample(context, si, float(first), mi.Point2f(second, third))
            if found.wo.z > 0:
                passed += float(np.ravel(np.array(weight))[0])
        shares[name] = passed / count
    return shares


def furnace(mi: Any, filename: str) -> float:
    """Mean radiance of a surface under a sky of radiance 1 from both sides."""
    camera = mi.ScalarTransform4f().look_at([0, 0, 6], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 8},
            "sensor": {
                "type": "perspective",
                "fov": 10,
                "to_world": camera,
                "film": film,
                "sampler": {"type": "independent", "sample_count": 64},
            },
            "sky": {"type": "constant", "radiance": 1.0},
            "surface": {"type": "rectangle", "bsdf": {"type": "batwing", "filename": filename}},
        }
    )
    return float(np.array(mi.render(scene)).mean())


def main() -> int:
    """A smooth surface by both."""
    import tempfile
    from pathlib import Path

    import mitsuba as mi

    from batwing import rcwa

    mi.set_variant("scalar_rgb")
    register(mi)
    smooth = rcwa.Grating(rcwa.Relief(1.0, 0.1, 1.0), top=1.5, bottom=1.0)
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "smooth.bworders")
        bsdf.build(smooth, 0.55, orders=4, kx_per_zone=64, ky=24).write(path)
        radiance = furnace(mi, path)
        shares = compare(mi, path, {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    print("share transmitted at 30 degrees from inside:", shares)
    # Radiance over the square of the index is kept: R + T/1.5^2 at normal incidence.
    expected = 0.04 + 0.96 / 1.5**2
    print(f"radiance under a sky of 1: {radiance:.4f}, expected {expected:.4f}")
    # Means of 20,000 draws, each 0 or 1.
    error = np.sqrt(2 * shares["other"] * (1 - shares["other"]) / 20_000)
    agree = abs(shares["batwing"] - shares["other"]) < 4 * error
    return 0 if agree and abs(radiance - expected) < 0.01 else 1


if __name__ == "__main__":
    sys.exit(main())
