# SPDX-License-Identifier: MIT OR Apache-2.0
"""Zones and full wave: the results of the commands, and what they mean."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import batwing
from batwing import simulate

DRIVES = np.array([[1.0, 0.2, 0.0], [0.0, 0.7, 0.1]])


def boxed() -> simulate.Design:
    """3 x 2 LEDs in a white box; walls half a pitch beyond."""
    length, white = [18.0, 12.0], {"kind": "lambertian", "reflectance": 0.8}
    return simulate.Design(
        {
            "name": "boxed",
            "mirror": {**white, "extent": "array"},
            "led": {
                "size_mm": [0.5, 0.5],
                "height_mm": 0.15,
                "reflectance": 0.8,
                "reflection": "lambertian",
            },
            "array": {"columns": 3, "rows": 2, "pitch_mm": 6.0},
            "light": {"wavelength_nm": 550.0},
            "receiver": {"plane_height_mm": 4.5, "bin_mm": 1.0, "smoothing_sigma_mm": 0.0},
            "housing": {**white, "height_mm": 4.0, "inner_size_mm": length, "floor": white},
            "trace": {"paths": 20_000},
        }
    )


@pytest.fixture(scope="module")
def dimmed() -> simulate.Zones:
    return simulate.zones(boxed(), DRIVES, direct=True, seed=3)


def test_zones_are_what_a_direct_trace_gives(dimmed: simulate.Zones) -> None:
    direct = dimmed.raw["direct"]
    # Six degrees of freedom: 99.9 %.
    assert direct["zones"] == 6 and direct["chi_square"] < 22.5
    table = dimmed.tables["zones"]
    np.testing.assert_array_equal(table["drive"], DRIVES.ravel())
    assert (table["row"][0], table["y_mm"][0]) == (1, 3.0)
    backlight, panel = dimmed.maps["backlight"], dimmed.maps["panel"]
    # The map reaches half a pitch beyond the packages.
    assert backlight.values.shape == panel.values.shape == (18, 24)
    assert [axis.name for axis in backlight.axes] == ["y", "x"] and backlight.unit == dimmed.raw["unit"]
    # Means of the map over the zones are those of the table, whose first row is the top.
    means = backlight.values[3:-3, 3:-3].reshape(2, 6, 3, 6).mean(axis=(1, 3))[::-1]
    [column] = [name for name in table if name.startswith("backlight") and "error" not in name]
    np.testing.assert_allclose(table[column], means.ravel(), rtol=1e-6)
    # A panel passes a share from 1/5000 to 1, and ends with the packages.
    inside = np.s_[3:-3, 3:-3]
    share = panel.values[inside] / backlight.values[inside]
    assert (share <= 1 + 1e-12).all() and (share >= (1 - 1e-12) / 5000).all()
    assert panel.values.sum() == pytest.approx(panel.values[inside].sum())


def test_figures_of_zones_have_units_and_errors(dimmed: simulate.Zones) -> None:
    figures = dimmed.figures
    assert figures["white"].unit == figures["halo_black"].unit == dimmed.raw["unit"]
    assert figures["min"] <= figures["white"] <= figures["max"]
    ratio = figures["halo_black"] / figures["halo_bright"]
    assert figures["halo_contrast"].value == pytest.approx(ratio.value) and ratio.unit == "1"
    assert dimmed.radii_mm.keys() == {0.5, 0.1, 0.01}
    known = [radius for radius in dimmed.radii_mm.values() if radius is not None]
    assert known and all(radius.unit == "mm" and radius.standard_error > 0.0 for radius in known)
    assert str(figures["white"]) in repr(dimmed)
    pytest.importorskip("xarray")
    data = dimmed.to_xarray("zones")
    np.testing.assert_array_equal(data.drive, DRIVES.ravel())
    assert dimmed.maps["panel"].to_xarray().value.dims == ("y", "x")
    with pytest.raises(batwing.InputError, match="table: expected light_spread or zones"):
        dimmed.to_xarray("rows")


def test_zones_in_colour_are_arrays_of_xyz() -> None:
    """Channels of three lines before sub-pixels that pass all: X, Y and Z of a line are in its ratio."""
    data = boxed().data
    data["light"] = {"wavelength_nm": 550.0, "weighting": "photometric"}
    data["sources"] = [
        {
            "name": name,
            "channel": name,
            "kind": "rectangle",
            "position_mm": [0.0, 0.0, 0.15],
            "size_mm": [0.1, 0.1],
            "wavelength_nm": nm,
        }
        for name, nm in (("red", 630.0), ("blue", 450.0), ("green", 530.0))
    ]
    clear = {"wavelength_nm": [400, 700], "transmittance": [0.3, 0.3]}
    data["panel"] = {"sub_pixels": [clear, clear, clear]}
    dark = np.zeros_like(DRIVES)
    pattern = {"red": DRIVES, "blue": dark, "green": dark}
    found = simulate.zones(
        simulate.Design(data), pattern, picture=DRIVES, test_patterns=True, seed=3
    )
    assert found.raw["colour"]["test_patterns"]["zone"]["power_share"] == pytest.approx(1 / 6)
    assert found.xyz.keys() == found.maps.keys() == {"backlight", "panel"}
    # Numbers of any kind are a white, which two channels cannot give.
    del data["sources"][2], pattern["green"]
    for white in (np.array([0.3127, 0.329]), [np.float64(0.3127), 0.329], (0.3127, 0.329)):
        with pytest.raises(batwing.InputError, match="expected a design with three channels"):
            simulate.zones(simulate.Design(data), pattern, picture=DRIVES, white=white)
    x, y, z = found.xyz["backlight"]
    np.testing.assert_allclose(y, found.maps["backlight"].values, rtol=1e-9)
    # CIE 1931 at 630 nm: 0.6424, 0.2650, 0.0000.
    lit = y > 0.0
    np.testing.assert_allclose(x[lit] / y[lit], 0.6424 / 0.2650, rtol=1e-3)
    assert (z[lit] < 1e-3 * y[lit]).all()
    np.testing.assert_array_equal(found.tables["zones"]["drive_red"], DRIVES.ravel())


def test_zones_of_files_and_arrays_are_those_of_the_binary(
    binary: str, dimmed: simulate.Zones, tmp_path: Path
) -> None:
    (tmp_path / "design.toml").write_text(boxed().to_toml())
    (tmp_path / "pattern.csv").write_text("1.0,0.2,0.0\n0.0,0.7,0.1")
    command = [binary, "zones", "design.toml", "--pattern", "pattern.csv", "--direct", "--seed", "3"]
    subprocess.run([*command, "--quiet", "--out", "out"], check=True, cwd=tmp_path)
    theirs = json.loads((tmp_path / "out/zones.json").read_text())
    hashes = [[one["sha256"] for one in raw["inputs"]] for raw in (theirs, dimmed.raw)]
    assert hashes[0] == hashes[1]
    # Pictures name their inputs, which the call has without a file.
    own = {key: value for key, value in dimmed.raw.items() if key not in ("inputs", "files", "content_sha256")}
    assert {key: theirs[key] for key in own} == own
    dimmed.save(tmp_path / "saved")
    for name in ("zones.csv", "panel.npy"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "saved" / name).read_bytes()
    dimmed.verify()
    again = simulate.zones(
        tmp_path / "design.toml",
        tmp_path / "pattern.csv",
        picture=DRIVES,
        zones=(3, 2),
        out=tmp_path / "own",
        seed=3,
    )
    np.testing.assert_array_equal(again.maps["panel"].values, dimmed.maps["panel"].values)
    assert again.raw["direct"] is None and [one["file"] for one in again.raw["inputs"]][-1] == "picture of the call.csv"
    with pytest.raises(batwing.InputError, match="pattern of the call"):
        simulate.zones(boxed(), DRIVES[:, :2])


def test_full_wave_of_a_small_section(root: Path) -> None:
    design = simulate.Design.read(root / "data/designs/d1.toml")
    found = simulate.full_wave(
        design, rings=2, ring_width_um=2.0, paths=20_000, sources=4, tolerance=1e-4
    )
    dome = found.comparison
    assert dome.rings == 2 and dome.radius_um == pytest.approx(4.0) and dome.balance < 1e-5
    assert dome.far_fields.keys() == {"full_wave", "hybrid", "rays"}
    for far in dome.far_fields.values():
        assert far.theta_deg[0] == -89.75 and far.share.sum() == pytest.approx(1.0, abs=1e-3)
        assert far.missing < 1e-3
    distance = dome.distances["rays", 2.5]
    rays, waves = (dome.far_fields[name].share.reshape(-1, 5).sum(axis=1) for name in ("rays", "full_wave"))
    difference = rays - waves
    assert distance.l1 == pytest.approx(np.abs(difference).sum(), rel=0.02)
    assert distance.rms == pytest.approx(np.sqrt((difference**2).mean()) / waves.max(), rel=0.02)
    # Noise is what the mean square exceeds that of the distance itself by.
    assert distance.square.value == pytest.approx(distance.rms**2 - distance.noise**2, rel=1e-9)
    assert found.baseline is not None and found.baseline.rings == 2 and "rays" in found.verdict
    pytest.importorskip("xarray")
    assert dome.far_fields["rays"].to_xarray().share.attrs["units"] == "1"
