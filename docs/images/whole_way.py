#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Makes `whole-way.png` of the README: one package, its far field, and a panel of 24 of them.

    whole_way.py BATWING WORK

BATWING is the program and WORK a folder for what it computes, some twenty minutes on two cores; a second call
draws what is there. Needs matplotlib. The package is D1 of the paper with 20 lm; the panel adds white walls, a
diffusing plate and two crossed prism films."""

import json
import pathlib
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILMS = """
[housing]
kind = "lambertian"
reflectance = 0.95
inner_size_mm = [49.8, 33.2]
height_mm = 8.0
floor = { kind = "lambertian", reflectance = 0.95 }

[[films]]
name = "plate"
z_mm = 4.0
thickness_mm = 1.5
medium = { index = 1.49, absorption_per_mm = 0.001 }
top = { kind = "lambertian", transmitted = 0.6, reflected = 0.4 }

[[films]]
name = "lower_prisms"
thickness_mm = 0.2
medium = { index = 1.586 }
top = { kind = "prisms", pitch_um = 50.0, tip_radius_um = 1.0 }

[[films]]
name = "upper_prisms"
gap_mm = 0.01
thickness_mm = 0.2
medium = { index = 1.586 }
top = { kind = "prisms", pitch_um = 50.0, tip_radius_um = 1.0, direction_deg = 90.0 }

[[receivers]]
name = "display"
kind = "luminance"
position_mm = [0.0, 0.0, 7.0]
size_mm = [49.8, 33.2]
bins = [30, 20]
theta_bin_deg = 20.0
theta_max_deg = 20.0
phi_bin_deg = 360.0
"""
BLUE, ORANGE, GREY = "#0072b2", "#e69f00", "#5f5f66"


def compute(batwing, work):
    package = (ROOT / "data/designs/d1.toml").read_text(encoding="utf-8")
    package = package.replace("\n[array]", "power_lm = 20.0\n\n[array]", 1)
    array = package.replace("columns = 2\nrows = 2", "columns = 6\nrows = 4")
    walls = FILMS.split("\n[[films]]")[0]
    # Without films the light is read where the plate would stand.
    bare = array.replace("plane_height_mm = 3.0", "plane_height_mm = 4.0") + walls
    panel = array.replace("plane_height_mm = 3.0", "plane_height_mm = 7.0") + FILMS
    for name, text in (("package", package), ("bare", bare), ("panel", panel)):
        (work / f"{name}.toml").write_text(text.replace('name = "D1"', f'name = "{name}"'), encoding="utf-8")

    def run(*arguments):
        subprocess.run([batwing, *arguments], cwd=work, check=True)

    for model in ("geometric", "hybrid"):
        if not (work / model).exists():
            run("run", "package.toml", "--model", model, "--paths", "8388608", "--out", model)
    for name, paths in (("bare", "4194304"), ("panel", "1048576")):
        if not (work / name).exists():
            run("run", f"{name}.toml", "--model", "geometric", "--paths", paths, "--out", name)
    run("rays", "package.toml", "--model", "geometric", "--count", "90", "--out", "rays")


def draw_package(axes, work):
    drawing = json.loads((work / "geometric/package/geometric_100um/package.json").read_text())["drawing"]
    half = np.array([point[:2] for part in drawing["dome_mm"] for point in part])
    half = half[: np.argmin(half[:, 1]) + 1]
    whole = np.vstack([half[::-1] * [-1, 1], half])
    axes.fill(*whole.T, facecolor="#e6eff7", edgecolor="none")
    axes.plot(*whole.T, color="#30597a", linewidth=1.0)
    (rays,) = (work / "rays").glob("*.json")
    for path in json.loads(rays.read_text())["paths"]:
        points = [vertex["point_mm"] for vertex in path["vertices"]]
        if along := path.get("leaves_along"):
            points.append([p + 9.0 * d for p, d in zip(points[-1], along)])
        points = np.array(points)
        axes.plot(points[:, 0], points[:, 2], color=ORANGE, linewidth=0.5, alpha=0.8)
    width, _, height = drawing["led_mm"]
    axes.fill([-width / 2, width / 2, width / 2, -width / 2], [0, 0, height, height], color="#3fe0d0", zorder=3)
    axes.plot([-2.6, 2.6], [-0.03, -0.03], color="#8a97a3", linewidth=4, solid_capstyle="butt")
    axes.set(xlim=(-2.6, 2.6), ylim=(-0.2, 3.0), aspect="equal", xlabel="x (mm)", ylabel="z (mm)")
    axes.set_title("1  Package: dome with 17 steps", loc="left")


def draw_far_field(axes, work):
    for model, colour, words in (
        ("geometric_100um", ORANGE, "rays"),
        ("hybrid_10um", BLUE, "rays and diffraction"),
    ):
        csv = work / model.split("_")[0] / "package" / model / "far_field.csv"
        table = np.genfromtxt(csv, delimiter=",", names=True)
        angle, value = np.radians(table["theta_deg"]), table["mean_over_azimuth_luminous_intensity_cd"]
        kept = angle < np.pi / 2
        angle = np.concatenate([-angle[kept][::-1], angle[kept]])
        value = np.concatenate([value[kept][::-1], value[kept]]) / 4
        axes.plot(angle, value, color=colour, linewidth=1.8, label=words)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetalim(-np.pi / 2, np.pi / 2)
    axes.set_rlabel_position(90)
    axes.grid(color="#d6d6db", linewidth=0.6)
    axes.set_title("2  Far field of one package (cd)", loc="left", y=0.93)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 0.06), ncol=2, frameon=False)


def draw_panel(axes, work):
    folder = "{0}/{0}/geometric_100um/".format
    behind = np.load(work / folder("panel") / "receivers/display.npy")[0, :, :, 0, 0]
    without = np.load(work / folder("bare") / "illuminance.npy")[0]
    # Within the walls, which stand 498 by 332 bins apart.
    rows, columns = ((size - kept) // 2 for size, kept in zip(without.shape, (332, 498)))
    without = without[rows:-rows, columns:-columns]
    # Each over its mean, on its side of the middle.
    half = without.shape[1] // 2
    for values, low, high in (
        (without[:, :half] / without.mean(), -24.9, 0.0),
        (behind[:, behind.shape[1] // 2 :] / behind.mean(), 0.0, 24.9),
    ):
        image = axes.imshow(
            values, origin="lower", extent=(low, high, -16.6, 16.6), vmin=0.0, vmax=1.8, cmap="inferno",
            interpolation="nearest",
        )
    axes.axvline(0.0, color="white", linewidth=1.2)
    axes.set(xlim=(-24.9, 24.9), ylim=(-16.6, 16.6), xlabel="x (mm)", ylabel="y (mm)")
    axes.set_title("3  Panel: without films | behind them (mean = 1)", loc="left")
    plt.colorbar(image, ax=axes, fraction=0.031, pad=0.02)


def main(batwing, work):
    work = pathlib.Path(work).resolve()
    work.mkdir(parents=True, exist_ok=True)
    compute(batwing, work)
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10.5, "axes.titleweight": "bold", "axes.edgecolor": GREY})
    figure = plt.figure(figsize=(13.0, 3.7))
    draw_package(figure.add_axes((0.045, 0.13, 0.28, 0.76)), work)
    draw_far_field(figure.add_axes((0.365, -0.03, 0.24, 1.0), projection="polar"), work)
    draw_panel(figure.add_axes((0.67, 0.13, 0.285, 0.76)), work)
    figure.savefig(ROOT / "docs/images/whole-way.png", dpi=110)


main(*sys.argv[1:])
