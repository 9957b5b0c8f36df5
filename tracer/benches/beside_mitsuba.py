#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Paths per CPU-second of the tracer and of Mitsuba 3, one thread each, by turns in one run, with the power that leaves upwards by both.

    python3 tracer/benches/beside_mitsuba.py [--rounds 5] [--paths 10000000] [--mesh | --judge]

Needs mitsuba 3.9.1 (`pip install mitsuba==3.9.1`) and a libLLVM; installs nothing. Builds the example `throughput` first.

The scene is the cap of radius 2 about z = -1 over a mirror of reflectance 0.95 at z = 0, of index 1.41, with a 1 x 1 Lambertian source at z = 0.35.
Mitsuba gets the same loop, written in its own array language and compiled by it: analytic sphere and disk, its own Fresnel and refraction,
weights, all or nothing below a weight of 0.1, bins of 1 x 5 degrees; single precision, which is what these variants compute in. With --mesh both trace a
mesh of 200,000 triangles instead of the sphere. With --judge three far fields are compared row by row: behind the package with 17 steps, side and box; of a dome with a point
inside between Lambertian walls; of a point in two absorbing balls, one in the other, over a Lambertian disc (scenes `walled` and `nested` of the example). CPU seconds of this process and of the tracer's; compilation is left out by a first
round that does not count.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_mono")

ROOT = Path(__file__).resolve().parents[2]
BINS = (180, 72)
INDEX = 1.41


def turned(name, points, rings, sides):
    """The mesh of a tip, points[0], and below it rings of `sides` vertices."""
    k = np.arange(sides)
    after = (k + 1) % sides
    faces = [np.stack([0 * k, 1 + k, 1 + after], axis=-1)]
    for r in range(rings - 1):
        a, b = 1 + r * sides, 1 + (r + 1) * sides
        faces.append(np.stack([a + k, b + k, b + after], axis=-1))
        faces.append(np.stack([a + k, b + after, a + after], axis=-1))
    faces = np.concatenate(faces)
    mesh = mi.Mesh(name, len(points), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = points.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


def cap_mesh(triangles):
    """The mesh of the bench: rings of latitude, halved diagonals, without the base."""
    sides = int(math.sqrt(2.0 * triangles))
    rings = (triangles // sides + 1) // 2
    polar = math.pi / 3 * np.arange(1, rings + 1) / rings
    azimuth = 2 * math.pi * np.arange(sides) / sides
    ring = np.stack(
        [
            2 * np.sin(polar)[:, None] * np.cos(azimuth),
            2 * np.sin(polar)[:, None] * np.sin(azimuth),
            2 * np.cos(polar)[:, None] - 1 + 0 * azimuth,
        ],
        axis=-1,
    ).reshape(-1, 3)
    points = np.concatenate([[[0.0, 0.0, 1.0]], ring])
    return turned("dome", points, rings, sides)


def steps_mesh(steps=17, sides=720):
    """The staircase of the bench with its upright side, turned: rings of `sides` vertices."""
    height = lambda r: math.sqrt(4.0 - r * r) - 1.0
    rim = [1.7 * k / steps for k in range(steps + 1)]
    line = [(0.0, height(0.0))]
    for k in range(steps):
        line += [(rim[k + 1], height(rim[k])), (rim[k + 1], height(rim[k + 1]))]
    line.append((1.7, 0.0))
    azimuth = 2 * math.pi * np.arange(sides) / sides
    rings = [np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z + 0 * azimuth], axis=-1) for r, z in line[1:]]
    points = np.concatenate([[[0.0, 0.0, line[0][1]]], *rings])
    return turned("steps", points, len(rings), sides)


@dr.syntax
def trace_package(scene, bottom, box, paths, bins, seed):
    """Traces paths through a package with a bottom of 0.95 and a box of 0.86 until they meet nothing more; returns the surfaces met."""
    rng = mi.PCG32(size=paths, initstate=seed)
    x, y = rng.next_float32() - 0.5, rng.next_float32() - 0.5
    d = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    ray = mi.Ray3f(mi.Point3f(x, y, 0.3501), d)
    weight, active, bounce = mi.Float(1), mi.Bool(True), mi.UInt32(0)
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.Minimal, False, active)
        hit = si.is_valid() & active
        mirror = hit & ((si.shape == bottom) | (si.shape == box))
        cos_i = -dr.dot(ray.d, si.n)
        r, cos_t, _, eta_ti = mi.fresnel(cos_i, INDEX)
        normal = dr.select(cos_i < 0, -si.n, si.n)
        reflected = mirror | (hit & (rng.next_float32() < r))
        out = eta_ti * ray.d + normal * (eta_ti * dr.abs(cos_i) - dr.abs(cos_t))
        back = ray.d + 2 * dr.abs(cos_i) * normal
        reflectance = dr.select(si.shape == bottom, mi.Float(0.95), mi.Float(0.86))
        kept = weight * reflectance
        dies = mirror & (kept < 0.1) & (rng.next_float32() >= reflectance)
        weight = dr.select(mirror & (kept >= 0.1), kept, weight)
        gone = active & ~hit
        theta = dr.minimum(mi.UInt32(dr.safe_acos(ray.d.z) * (18 / math.pi)), 17)
        dr.scatter_add(bins, weight, theta, gone)
        bounce += dr.select(hit, mi.UInt32(1), mi.UInt32(0))
        active = hit & ~dies & (bounce < 10_000)
        ray = si.spawn_ray(dr.normalize(dr.select(reflected, back, out)))
    return bounce


class Setup:
    """A scene for `trace_mixed`: shapes by what they do, media by number."""

    def __init__(self, source, begins, absorptions):
        self.source, self.begins, self.absorptions = source, begins, absorptions
        # (shape, index inside over index outside, medium inside, medium outside), (shape, reflectance) twice.
        self.interfaces, self.mirrors, self.diffuse = [], [], []
        self.shapes = {"type": "scene"}

    def add(self, shape, kind, *what):
        shape = mi.load_dict(shape)
        self.shapes[f"shape_{len(self.shapes)}"] = shape
        kind.append((mi.ShapePtr(shape), *what))


def walled():
    """A cap over a mirror with a point inside, on a Lambertian floor between four Lambertian walls."""
    to = mi.ScalarTransform4f
    setup = Setup([0.0, 0.0, 0.35], 1, [0.0, 0.0])
    setup.add({"type": "sphere", "center": [0, 0, -1], "radius": 2.0}, setup.interfaces, INDEX, 1, 0)
    setup.add({"type": "disk", "to_world": to().scale([math.sqrt(3.0)] * 2 + [1.0])}, setup.mirrors, 0.95)
    # Just below the mirror, since shapes that coincide are met by chance; the lower part of the sphere is out of reach but for this gap.
    setup.add({"type": "rectangle", "to_world": to().translate([0, 0, -2e-4]).scale([3.0, 3.0, 1.0])}, setup.diffuse, 0.8)
    for turn in range(4):
        upright = to().rotate([0, 0, 1], 90 * turn).translate([3.0, 0, 0.75]).rotate([0, 1, 0], -90).scale([0.7502, 3.0, 1.0])
        setup.add({"type": "rectangle", "to_world": upright}, setup.diffuse, 0.7)
    return setup


def nested():
    """Absorbing balls, one in the other, over a Lambertian disc, with a point in the inner one."""
    to = mi.ScalarTransform4f
    setup = Setup([0.3, 0.0, 0.6], 2, [0.0, 0.2, 0.05])
    setup.add({"type": "sphere", "center": [0, 0, 0], "radius": 2.0}, setup.interfaces, INDEX, 1, 0)
    setup.add({"type": "sphere", "center": [0, 0, 0.4], "radius": 0.8}, setup.interfaces, 1.8 / INDEX, 2, 1)
    setup.add({"type": "disk", "to_world": to().translate([0, 0, -2.5]).scale([6.0, 6.0, 1.0])}, setup.diffuse, 0.7)
    return setup


@dr.syntax
def trace_mixed(scene, setup, absorptions, paths, bins, seed):
    """Traces paths of an isotropic point until they meet nothing more; roulette below a weight of 0.1."""
    rng = mi.PCG32(size=paths, initstate=seed)
    d = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    x, y, z = setup.source
    ray = mi.Ray3f(mi.Point3f(dr.full(mi.Float, x, paths), y, z), d)
    weight, active, bounce, medium = mi.Float(1), mi.Bool(True), mi.UInt32(0), mi.UInt32(setup.begins)
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.Minimal, False, active)
        hit = si.is_valid() & active
        gone = active & ~hit
        theta = dr.minimum(mi.UInt32(dr.safe_acos(ray.d.z) * (18 / math.pi)), 17)
        dr.scatter_add(bins, weight, theta, gone)
        cos_i = -dr.dot(ray.d, si.n)
        normal = dr.select(cos_i < 0, -si.n, si.n)
        eta, inside, outside = mi.Float(1), mi.UInt32(0), mi.UInt32(0)
        for shape, ratio, inner, outer in setup.interfaces:
            this = si.shape == shape
            eta = dr.select(this, ratio, eta)
            inside, outside = dr.select(this, inner, inside), dr.select(this, outer, outside)
        reflectance, mirror, diffuse = mi.Float(1), mi.Bool(False), mi.Bool(False)
        for shape, value in setup.mirrors:
            this = si.shape == shape
            mirror, reflectance = mirror | this, dr.select(this, value, reflectance)
        for shape, value in setup.diffuse:
            this = si.shape == shape
            diffuse, reflectance = diffuse | this, dr.select(this, value, reflectance)
        r, cos_t, _, eta_ti = mi.fresnel(cos_i, eta)
        back = mirror | (rng.next_float32() < r)
        refracted = eta_ti * ray.d + normal * (eta_ti * dr.abs(cos_i) - dr.abs(cos_t))
        reflected = ray.d + 2 * dr.abs(cos_i) * normal
        lambertian = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
        onward = dr.select(diffuse, mi.Frame3f(normal).to_world(lambertian), dr.select(back, reflected, refracted))
        kept = weight * reflectance * dr.exp(-dr.gather(mi.Float, absorptions, medium) * si.t)
        dies = (kept < 0.1) & (rng.next_float32() * 0.1 >= kept)
        weight = dr.select(hit, dr.maximum(kept, 0.1), weight)
        passes = hit & ~diffuse & ~back
        medium = dr.select(passes, dr.select(cos_i > 0, inside, outside), medium)
        bounce += dr.select(hit, mi.UInt32(1), mi.UInt32(0))
        active = hit & ~dies & (bounce < 10_000)
        ray = si.spawn_ray(dr.normalize(onward))
    return bounce


def judge_mixed(example, name, setup, paths):
    """Compares the far field of a scene of `trace_mixed`."""
    scene = mi.load_dict(setup.shapes)
    absorptions = mi.Float(setup.absorptions)

    def once(paths, bins, seed):
        return trace_mixed(scene, setup, absorptions, paths, bins, seed)

    compare(example, name, name, once, paths)


def judge_steps(example, paths):
    """Compares the far field behind 17 steps, exact here and turned from 720 sides there."""
    disk = mi.load_dict({"type": "disk", "to_world": mi.ScalarTransform4f().scale([1.7, 1.7, 1.0])})
    to_box = mi.ScalarTransform4f().translate([0, 0, 0.175]).scale([0.5, 0.5, 0.175])
    cube = mi.load_dict({"type": "cube", "to_world": to_box})
    scene = mi.load_dict({"type": "scene", "dome": steps_mesh(), "bottom": disk, "box": cube})
    bottom, box = mi.ShapePtr(disk), mi.ShapePtr(cube)

    def once(paths, bins, seed):
        return trace_package(scene, bottom, box, paths, bins, seed)

    compare(example, "stepped-17", "17 steps", once, paths)


def compare(example, scene, name, once, paths):
    """Compares the far field of a scene of the example with what `once` bins, in rows of 10 degrees by chi-square."""
    dr.set_thread_count(1)
    batches = []
    for seed in range(32):
        bins = dr.zeros(mi.Float, 18)
        dr.eval(once(paths // 32, bins, mi.UInt64(seed)), bins)
        batches.append(np.array(bins).astype(float) / (paths // 32))
    theirs, their_errors = np.mean(batches, axis=0), np.std(batches, axis=0, ddof=1) / math.sqrt(32)
    ours = json.loads(subprocess.check_output([example, scene, str(paths)]))
    rows, errors = np.array(ours["rows"]), np.array(ours["row_errors"])
    lit = rows > 1e-4
    off = (rows - theirs)[lit] / np.hypot(errors, their_errors)[lit]
    chi2, freedom = float((off**2).sum()), int(lit.sum())
    print(
        f"{name}, rows of 10 degrees: chi-square {chi2:.1f} of {freedom}, largest departure {abs(off).max():.1f} standard errors; "
        f"upwards {rows[:9].sum():.5f} and {theirs[:9].sum():.5f} +- {math.hypot(ours['escaped_up_error'], np.std([b[:9].sum() for b in batches], ddof=1) / math.sqrt(32)):.5f}"
    )
    if chi2 > freedom + 5 * math.sqrt(2 * freedom):
        sys.exit(f"{name}: the far fields differ")


@dr.syntax
def trace(scene, mirror_shape, paths, bins, seed):
    """Traces `paths` paths and adds their weights to `bins`."""
    rng = mi.PCG32(size=paths, initstate=seed)
    x, y = rng.next_float32() - 0.5, rng.next_float32() - 0.5
    d = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    ray = mi.Ray3f(mi.Point3f(x, y, 0.35), d)
    weight, active, bounce = mi.Float(1), mi.Bool(True), mi.UInt32(0)
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.Minimal, False, active)
        hit = si.is_valid() & active
        mirror = hit & (si.shape == mirror_shape)
        cos_i = -dr.dot(ray.d, si.n)
        r, cos_t, _, eta_ti = mi.fresnel(cos_i, INDEX)
        normal = dr.select(cos_i < 0, -si.n, si.n)
        reflected = mirror | (hit & (rng.next_float32() < r))
        # Snell's law about the normal that faces the ray.
        out = eta_ti * ray.d + normal * (eta_ti * dr.abs(cos_i) - dr.abs(cos_t))
        back = ray.d + 2 * dr.abs(cos_i) * normal
        # The mirror keeps 0.95 of the weight, or below 0.1 all or nothing.
        kept = weight * 0.95
        dies = mirror & (kept < 0.1) & (rng.next_float32() >= 0.95)
        weight = dr.select(mirror & (kept >= 0.1), kept, weight)
        # What is refracted leaves a convex body for good and is binned.
        leaves = hit & ~reflected
        theta = dr.minimum(mi.UInt32(dr.safe_acos(out.z) * (BINS[0] / math.pi)), BINS[0] - 1)
        phi = dr.atan2(out.y, out.x)
        phi = dr.select(phi < 0, phi + 2 * math.pi, phi) * (BINS[1] / (2 * math.pi))
        phi = dr.minimum(mi.UInt32(phi), BINS[1] - 1)
        dr.scatter_add(bins, weight, theta * BINS[1] + phi, leaves)
        bounce += 1
        active = hit & reflected & ~dies & (bounce < 10_000)
        ray = si.spawn_ray(dr.normalize(back))
    return bounce


def mitsuba_run(paths, mesh):
    """A function of a seed that traces `paths` paths and returns the power that goes upwards per path."""
    dr.set_thread_count(1)
    rim = math.sqrt(3.0)
    sphere = {"type": "sphere", "center": [0, 0, -1], "radius": 2.0}
    disk = mi.load_dict({"type": "disk", "to_world": mi.ScalarTransform4f().scale([rim, rim, 1.0])})
    dome = cap_mesh(200_000) if mesh else sphere
    scene = mi.load_dict({"type": "scene", "dome": dome, "mirror": disk})
    mirror_shape = mi.ShapePtr(disk)

    def once(seed):
        bins = dr.zeros(mi.Float, BINS[0] * BINS[1])
        dr.eval(trace(scene, mirror_shape, paths, bins, mi.UInt64(seed)), bins)
        dr.sync_thread()
        return float(np.array(bins).astype(float).reshape(BINS)[: BINS[0] // 2].sum()) / paths

    return once


def tracer_example():
    """The path of the example, built."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    subprocess.run(
        ["cargo", "build", "--release", "-q", "-p", "batwing-tests", "--example", "throughput"], cwd=ROOT, check=True
    )
    return target / "release" / "examples" / "throughput"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--paths", type=int, default=10_000_000)
    parser.add_argument("--mesh", action="store_true")
    parser.add_argument("--judge", action="store_true", help="compare three far fields, untimed")
    arguments = parser.parse_args()
    example = tracer_example()
    if arguments.judge:
        judge_steps(example, arguments.paths)
        judge_mixed(example, "walled", walled(), arguments.paths)
        judge_mixed(example, "nested", nested(), arguments.paths)
        return
    chunk = min(arguments.paths, 4_000_000)
    once = mitsuba_run(chunk, arguments.mesh)
    once(0)
    rows = []
    for round_number in range(1, arguments.rounds + 1):
        begin = time.process_time()
        turns = max(1, arguments.paths // chunk)
        up = sum(once(round_number * 1000 + turn) for turn in range(turns)) / turns
        peer = turns * chunk / (time.process_time() - begin)
        scene = "mesh" if arguments.mesh else "smooth"
        ours = json.loads(subprocess.check_output([example, scene, str(arguments.paths)]))
        rows.append((ours["paths_per_cpu_second"], peer))
        print(
            f"round {round_number}: tracer {ours['paths_per_cpu_second']:.3e}, Mitsuba llvm_ad_mono {peer:.3e} paths a CPU-second, "
            f"ratio {ours['paths_per_cpu_second'] / peer:.2f}; upwards {ours['escaped_up']:.5f} +- {ours['escaped_up_error']:.5f} and {up:.5f}"
        )
    ratios = sorted(ours / peer for ours, peer in rows)
    print(f"median ratio {ratios[len(ratios) // 2]:.2f} over {len(rows)} rounds, one thread each")


if __name__ == "__main__":
    main()
