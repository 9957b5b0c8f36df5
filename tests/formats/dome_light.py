# SPDX-License-Identifier: MIT OR Apache-2.0
"""Mitsuba 3 traces light through an exported dome: what leaves it, by direction, with standard errors.

The scene is that of one package: the closed mesh as dielectric, the reflector inside of its bottom, the LED box with a Lambertian top. Seen from far away in
parallel projection, the mean radiance times the area of the picture is the intensity in that direction. For every ring of polar angle each of several batches takes one direction
at random (even in solid angle), so that batches are independent and unbiased, and their spread is the standard error.
"""

import numpy as np

SIZE = 48
SAMPLES = 4


def mirror(reflectance):
    return {"type": "conductor", "material": "none", "specular_reflectance": {"type": "rgb", "value": reflectance}}


def scene_of(mitsuba, mesh, design):
    """Of the tables of a design and the file of its dome; all lengths in mm."""
    transform = mitsuba.ScalarTransform4f
    led, reflector = design["led"], design["mirror"]
    half_x, half_y = (0.5 * size for size in led["size_mm"])
    height = led["height_mm"]
    box = mirror(led["reflectance"])
    # A hair inside of the bottom, so that no ray meets both.
    rim = 0.5 * design["dome"]["width_mm"]
    scene = {
        "type": "scene",
        "dome": {"type": "obj", "filename": str(mesh), "face_normals": True,
                 "bsdf": {"type": "dielectric", "int_ior": design["silicone"]["index"], "ext_ior": 1.0}},
        "bottom": {"type": "disk", "to_world": transform().translate([0, 0, 1e-4]).scale(rim - 1e-4), "bsdf": mirror(reflector["reflectance"])},
        "top": {"type": "rectangle", "to_world": transform().translate([0, 0, height]).scale([half_x, half_y, 1]), "bsdf": box,
                "emitter": {"type": "area", "radiance": 1.0}},
    }
    for k, (out, away, along) in enumerate([([1, 0, 0], half_x, half_y), ([-1, 0, 0], half_x, half_y), ([0, 1, 0], half_y, half_x), ([0, -1, 0], half_y, half_x)]):
        place = transform().translate([away * out[0], away * out[1], 0.5 * height]) @ transform().look_at([0, 0, 0], out, [0, 0, 1])
        scene[f"side{k}"] = {"type": "rectangle", "to_world": place @ transform().scale([along, 0.5 * height, 1]), "bsdf": box}
    # For radiance 1 within the silicone, W.
    return mitsuba.load_dict(scene), 4 * np.pi * half_x * half_y


def intensities(mitsuba, mesh, design, rings, batches, seed=1):
    """W/sr for 1 W emitted, shape (batch, ring), in equal rings of polar angle from 0 to 90 degrees."""
    scene, emitted = scene_of(mitsuba, mesh, design)
    integrator = mitsuba.load_dict({"type": "path", "max_depth": 500, "rr_depth": 500})
    transform = mitsuba.ScalarTransform4f
    half = 0.6 * design["dome"]["width_mm"]
    edges = np.cos(np.linspace(0, 0.5 * np.pi, rings + 1))
    draw = np.random.default_rng(seed)
    found = np.zeros((batches, rings))
    for batch in range(batches):
        for ring in range(rings):
            z = draw.uniform(edges[ring + 1], edges[ring])
            phi = draw.uniform(0, 2 * np.pi)
            r = np.sqrt(1 - z * z)
            towards = [5 * half * r * np.cos(phi), 5 * half * r * np.sin(phi), 5 * half * z]
            look = transform().look_at(towards, [0, 0, 0], [-np.sin(phi), np.cos(phi), 0]).scale([half, half, 1])
            sensor = mitsuba.load_dict({
                "type": "orthographic", "to_world": look, "sampler": {"type": "independent"},
                "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}, "component_format": "float32"},
            })
            picture = mitsuba.render(scene, sensor=sensor, integrator=integrator, seed=int(draw.integers(2**31)), spp=SAMPLES)
            found[batch, ring] = 4 * half * half * np.array(picture)[:, :, 0].mean() / emitted
    return found, 2 * np.pi * (edges[:-1] - edges[1:])
