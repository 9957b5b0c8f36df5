# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tables: energy, reciprocity of evaluation and samples, files, and those of the binary."""

from __future__ import annotations

import json
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import batwing
from batwing import bsdf, rcwa, simulate


def grating() -> rcwa.Grating:
    relief = rcwa.Relief.triangle(2.0, (1.7, 0.6), ridge=1.41, groove=1.0)
    return rcwa.Grating(relief, top=1.41, bottom=1.0)


@pytest.fixture(scope="module")
def table() -> bsdf.Table:
    return bsdf.build(grating(), 0.55, orders=10, slices=8, kx_per_zone=4, ky=12)


def directions(count: int, side: float, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    phi, cosine = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.05, 1, count)
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), side * cosine], axis=1)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_power_is_kept_and_lobes_obey_the_grating_equation(table: bsdf.Table, side: float) -> None:
    wi = directions(200, side)
    albedo = table.albedo(wi)
    np.testing.assert_allclose(albedo.reflected + albedo.transmitted, 1.0, atol=2e-6)
    lobes = table.evaluate(wi)
    which = np.repeat(np.arange(200), np.diff(lobes.offsets))
    n_in, n_out = (1.41, 1.0) if side < 0 else (1.0, 1.41)
    n = np.where(lobes.transmitted, n_out, n_in)
    expected = -n_in * wi[which, 0] + lobes.order * 0.55 / 2.0
    np.testing.assert_allclose(n * lobes.wo[:, 0], expected, atol=1e-9)
    np.testing.assert_allclose(n * lobes.wo[:, 1], -n_in * wi[which, 1], atol=1e-9)


def test_the_table_holds_what_the_solver_gives(table: bsdf.Table) -> None:
    """At a node of the grid: kx = ky = 0."""
    found = rcwa.solve(grating(), 0.55, 0.0, polarisation="both", orders=10, slices=8)
    lobes = table.lobes(np.array([[0.0, 0.0, -1.0]]))
    for order, power, through in zip(lobes.order, lobes.power, lobes.transmitted):
        orders = found.orders_transmitted if through else found.orders_reflected
        values = found.transmitted if through else found.reflected
        np.testing.assert_allclose(power, values[:, orders == order][:, 0], atol=1e-6)


def test_samples_have_the_powers_of_lobes(table: bsdf.Table) -> None:
    wi = np.repeat(directions(1, -1.0, seed=8), 100_000, axis=0)
    drawn = table.sample(wi, seed=11)
    lobes = table.lobes(wi[:1])
    for order, power, through in zip(lobes.order, lobes.power.mean(axis=1), lobes.transmitted):
        share = ((drawn.order == order) & (drawn.transmitted == through)).mean()
        assert abs(share - power) < 4.5 * np.sqrt(max(power * (1 - power), 1e-6) / 100_000)
    for threads in (1, 2):
        again = table.sample(wi, seed=11, threads=threads)
        np.testing.assert_array_equal(again.wo, drawn.wo)
    assert (table.sample(wi, seed=12).wo != drawn.wo).any()


def test_files_hold_the_same_table(table: bsdf.Table, tmp_path: Path) -> None:
    wi = directions(50, -1.0)
    for ending in ("bworders", "json", "npz"):
        path = tmp_path / f"table.{ending}"
        table.save(path)
        again = bsdf.read(path)
        np.testing.assert_array_equal(again.lobes(wi).power, table.lobes(wi).power)
    np.testing.assert_array_equal(
        pickle.loads(pickle.dumps(table)).lobes(wi).power, table.lobes(wi).power
    )
    header = table.header
    assert header is not None and header["header"]["truncation"] == 10


@pytest.mark.parametrize("format, ending", [("klems", "xml"), ("tensortree", "xml"), ("lighttools", "bsdf")])
def test_other_programs_get_the_same_power(
    table: bsdf.Table, tmp_path: Path, format: bsdf.TableFormat, ending: str
) -> None:
    path = tmp_path / f"table.{ending}"
    written = table.write(path, format, scatter_deg=3.0, azimuth_deg=45.0, samples=4)
    assert [file.path for file in written] == [path]
    measured = bsdf.read(path, indices=(1.41, 1.0))
    assert measured.header is None
    compared = bsdf.compare(table, measured, theta_deg=[0.0, 20.0, 40.0], cells=6)
    assert np.abs(compared.albedo_difference).max() < 0.15
    assert compared.distance.max() < 0.6
    with pytest.raises(batwing.InputError, match="orders"):
        pickle.dumps(measured)


def test_a_table_is_at_no_distance_from_itself(table: bsdf.Table) -> None:
    same = bsdf.compare(table, table)
    assert (same.distance == 0).all() and (same.albedo_difference == 0).all()
    smooth = rcwa.Grating(rcwa.Relief(2.0, 0.1, 1.0), 1.41, 1.0)
    other = bsdf.build(smooth, 0.55, orders=8, kx_per_zone=2, ky=8)
    assert bsdf.compare(table, other).distance.max() > 0.3


def test_build_gives_the_table_of_the_binary(binary: str, root: Path, tmp_path: Path) -> None:
    """The relief of a ring of a design: every efficiency to the last bit."""
    file = root / "data/designs/d1.toml"
    command = [binary, "bsdf", str(file), "--rings", "15", "--tolerance", "2e-2"]
    done = subprocess.run([*command, "--no-cache", "--quiet", "--out", str(tmp_path)], capture_output=True)
    assert done.returncode == 0, done.stderr
    [path] = tmp_path.glob("*.bworders")
    theirs = bsdf.read(path)
    ring, wavelength = simulate.Design.read(file).ring(15)
    ours = bsdf.build(ring, wavelength, tolerance=2e-2, kx_per_zone=2)
    ours.write(tmp_path / "ours.npz")
    theirs.write(tmp_path / "theirs.npz")
    with np.load(tmp_path / "ours.npz") as a, np.load(tmp_path / "theirs.npz") as b:
        assert set(a.files) == set(b.files)
        for name in a.files:
            if name != "header":
                np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def test_tables_in_nanometres_are_written_with_their_wavelength(
    table: bsdf.Table, tmp_path: Path
) -> None:
    table.write(tmp_path / "um.json")
    text = json.loads((tmp_path / "um.json").read_text())
    text["header"]["length_unit"] = "nm"
    for key in ("period", "wavelength"):
        text["grid"][key] *= 1000.0
    (tmp_path / "nm.json").write_text(json.dumps(text))
    table.write(tmp_path / "um.xml", "klems", samples=1)
    bsdf.read(tmp_path / "nm.json").write(tmp_path / "nm.xml", "klems", samples=1)
    first, second = ((tmp_path / name).read_text() for name in ("um.xml", "nm.xml"))
    wavelengths = [[line for line in t.splitlines() if "avelength" in line] for t in (first, second)]
    assert wavelengths[0] and wavelengths[0] == wavelengths[1]


def test_absorption_is_no_residual_of_energy() -> None:
    relief = rcwa.Relief.lamellar(0.5, 0.1, 0.5, 1.5 + 0.3j, 1.0)
    lossy = bsdf.build(rcwa.Grating(relief, 1.5, 1.0), 0.6, orders=6, kx_per_zone=2, ky=4)
    albedo = lossy.albedo(np.array([[0.0, 0.0, -1.0]]))
    assert (albedo.reflected + albedo.transmitted < 0.95).all()
    header = lossy.header
    assert header is not None and header["header"]["energy_residual"] < 1e-9
