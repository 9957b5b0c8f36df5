# SPDX-License-Identifier: MIT OR Apache-2.0
"""A BSDF plug-in for Mitsuba 3 that samples tables of diffraction orders.

    python mitsuba_plugin.py        # compares a smooth table with `dielectric`; needs `pip install mitsuba`

Registered as `batwing`, with the parameter `filename` (a table of any format that `batwing.bsdf.read`
takes). The grooves run along the second tangent of the surface. Orders are discrete directions, so
that the lobes are of the kind *delta*: they are sampled, and evaluate to 0. Every variant of Mitsuba
works; samples are drawn on the CPU.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from batwing import bsdf


def register(mi: Any) -> None:
    """Registers the plug-in with the variant of Mitsuba that is set."""
    import drjit as dr

    def rows(vector: Any) -> Any:
        """A vector of Mitsuba as rows."""
        values = np.array(vector, dtype=np.float64)
        return values.reshape(1, 3) if values.ndim == 1 else values.T if values.shape[0] == 3 else values

    class Orders(mi.BSDF):  # type: ignore[misc,name-defined]
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
            wi = rows(si.wi)
            wi = wi / np.linalg.norm(wi, axis=1, keepdims=True)
            # Mitsuba's own random number seeds those of the table.
            seed = int(np.float64(np.ravel(np.array(sample1))[0]).view(np.uint64))
            drawn = self.table.sample(wi, seed=seed)
            n_here = np.where(wi[:, 2] > 0, 1.0, self.ratio)
            n_there = np.where(drawn.wo[:, 2] > 0, 1.0, self.ratio)
            weight = drawn.weight.copy()
            if ctx.mode == mi.TransportMode.Radiance:
                # Radiance over the square of the index is carried; powers are what the table holds.
                weight *= (n_here / n_there) ** 2
            found = dr.zeros(mi.BSDFSample3f)
            if dr.is_array_v(mi.Float):
                found.wo = mi.Vector3f(*(mi.Float(c.astype(np.float32)) for c in drawn.wo.T))
                power = mi.Float(weight.astype(np.float32))
                through = mi.Bool(drawn.transmitted)
                found.eta = mi.Float((n_there / n_here).astype(np.float32))
            else:
                found.wo = mi.Vector3f(*(float(c) for c in drawn.wo[0]))
                power, through = float(weight[0]), bool(drawn.transmitted[0])
                found.eta = float(n_there[0] / n_here[0])
            found.pdf = dr.select(mi.Mask(power > 0), mi.Float(1), mi.Float(0))
            reflection, transmission = +mi.BSDFFlags.DeltaReflection, +mi.BSDFFlags.DeltaTransmission
            found.sampled_type = dr.select(
                mi.Mask(through), mi.UInt32(transmission), mi.UInt32(reflection)
            )
            found.sampled_component = dr.select(mi.Mask(through), mi.UInt32(1), mi.UInt32(0))
            return found, mi.Spectrum(power) & active

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
        bsdf.build(smooth, 0.55, orders=4, kx_per_zone=4, ky=24).write(path)
        shares = compare(mi, path, {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    print("share transmitted at 30 degrees from inside:", shares)
    return 0


if __name__ == "__main__":
    sys.exit(main())
