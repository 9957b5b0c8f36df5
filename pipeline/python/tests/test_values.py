# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tables of values, rows and functions: closed forms, files of other programs, refusals."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import batwing
from batwing import bsdf

THETA, PHI = np.arange(5.0, 90.0, 10.0), np.arange(0.0, 360.0, 20.0)
EVERY = np.array([[0.6, 0.0, 0.8], [0.0, 0.28, 0.96], [0.0, 0.0, 1.0]])
BELOW = EVERY * [1.0, 1.0, -1.0]


def white(reflectance: float, incidences: int = 2) -> np.ndarray:
    return np.full((incidences, THETA.size, PHI.size), reflectance / np.pi)


def wall(values: Any, **options: Any) -> bsdf.Table:
    defaults = {"wi_theta_deg": [0.0, 80.0], "wo_theta_deg": THETA, "wo_phi_deg": PHI}
    return bsdf.from_values(values, **{**defaults, **options})


@pytest.mark.filterwarnings("ignore::batwing.DesignWarning")
def test_a_white_wall_reflects_its_share_by_the_cosine() -> None:
    table = wall(white(0.6))
    np.testing.assert_allclose(table.albedo(EVERY).reflected, 0.6, rtol=1e-12)
    assert (table.albedo(EVERY).transmitted == 0.0).all()
    assert (table.albedo(BELOW).reflected == 0.0).all()
    drawn = table.sample(np.repeat(EVERY[:1], 100_000, axis=0), seed=3)
    cosine = drawn.wo[drawn.weight > 0.0, 2]
    # Of 100 000 paths 0.6; the mean cosine of Lambert's law is 2/3, its variance 1/18.
    assert abs(cosine.size / 100_000 - 0.6) < 4.5 * np.sqrt(0.24 / 100_000)
    assert abs(cosine.mean() - 2 / 3) < 4.5 / np.sqrt(18 * cosine.size)


@pytest.mark.filterwarnings("ignore::batwing.DesignWarning")
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_grids_that_reach_the_horizon_stay_on_their_side(side: float) -> None:
    theta = np.arange(0.0, 91.0, 10.0) if side > 0.0 else np.arange(90.0, 181.0, 10.0)
    table = wall(np.full((2, 10, PHI.size), 0.6 / np.pi), wo_theta_deg=theta)
    albedo = table.albedo(EVERY)
    np.testing.assert_allclose(albedo.reflected, 0.6 * (side > 0.0), rtol=1e-12)
    np.testing.assert_allclose(albedo.transmitted, 0.6 * (side < 0.0), rtol=1e-12)


def test_what_is_not_known_is_said_in_python_warnings(tmp_path: Path) -> None:
    with pytest.warns(batwing.DesignWarning, match="values: nothing is given .* inner side"):
        table = wall(white(0.6))
    table.write(tmp_path / "wall.bsdf", "zemax", scatter_deg=5.0, samples=1)
    [file] = [one for one in tmp_path.glob("*.bsdf") if "outer" in one.name and "reflec" in one.name]
    with pytest.warns(batwing.DesignWarning, match="nothing is given"):
        bsdf.read(file)


def test_transmission_of_the_other_side_follows_by_reciprocity() -> None:
    """Of light from the denser side the share is less by the square of the index."""
    through = 180.0 - THETA[::-1]
    with pytest.warns(batwing.DesignWarning, match="reciprocity"):
        table = wall(white(0.9), wo_theta_deg=through, indices=(1.5, 1.0))
    np.testing.assert_allclose(table.albedo(EVERY).transmitted, 0.9, rtol=1e-12)
    np.testing.assert_allclose(table.albedo(BELOW).transmitted, 0.9 / 1.5**2, rtol=1e-6)


def glossy(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Phong's lobe about the mirror direction, normalised for light along the normal: 0.7 of it from
    the outer side, 0.2 from the inner one; and 0.1 through."""
    mirrored = wi * [-1.0, -1.0, 1.0]
    cosine = np.clip((mirrored * wo).sum(axis=1), 0.0, 1.0)
    same = wi[:, 2] * wo[:, 2] > 0.0
    lobe = np.where(wi[:, 2] > 0.0, 0.7, 0.2) * 12 / (2 * np.pi) * cosine**10
    return np.where(same, lobe, 0.1 / np.pi)


def test_functions_have_the_power_of_their_integrals() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = bsdf.from_function(glossy, scatter_deg=5.0)
    for side, share in ((1.0, 0.7), (-1.0, 0.2)):
        albedo = table.albedo(np.array([[0.0, 0.0, side]]))
        np.testing.assert_allclose(albedo.reflected, share, rtol=1e-4)
        np.testing.assert_allclose(albedo.transmitted, 0.1, rtol=1e-12)
        # At any azimuth the lobe lies about the mirror direction.
        for azimuth in (0.3, 2.0):
            at = np.array([np.sin(0.5) * np.cos(azimuth), np.sin(0.5) * np.sin(azimuth), np.cos(0.5)])
            wi = at * [1.0, 1.0, side]
            lobes = table.lobes(wi)
            back = ~lobes.transmitted
            mean = (lobes.power[back, :1] * lobes.wo[back]).sum(axis=0)
            mean /= np.linalg.norm(mean)
            along = mean[:2] @ -at[:2] / np.hypot(*at[:2])
            assert along == pytest.approx(np.hypot(*mean[:2]), abs=2e-3) and mean[2] * side > 0.5


def test_functions_of_the_azimuth_keep_it() -> None:
    def brushed(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        share = 0.4 + 0.3 * np.cos(2.0 * np.arctan2(wi[:, 1], wi[:, 0]))
        return np.where(wi[:, 2] * wo[:, 2] > 0.0, share / np.pi, 0.0)

    with pytest.raises(batwing.InputError, match="azimuth_deg: expected a step") as caught:
        bsdf.from_function(brushed)
    assert caught.value.key == "azimuth_deg"
    table = bsdf.from_function(brushed, azimuth_deg=45.0, scatter_deg=10.0, incidence_deg=30.0)
    for phi, share in ((0.0, 0.7), (45.0, 0.4), (90.0, 0.1), (202.5, 0.55)):
        at = np.radians(phi)
        wi = np.array([0.5 * np.cos(at), 0.5 * np.sin(at), np.sqrt(0.75)])
        np.testing.assert_allclose(table.albedo(wi).reflected, share, rtol=1e-9)


def rows_of(function: Callable[..., np.ndarray]) -> np.ndarray:
    """Rows of both sides at three polar angles of each, in no order."""
    wi_theta = np.array([0.0, 30.0, 60.0, 120.0, 150.0, 180.0])
    grid = np.meshgrid(wi_theta, [0.0], np.r_[THETA, 180.0 - THETA[::-1]], PHI, indexing="ij")
    angles = np.stack([one.ravel() for one in grid], axis=1)
    a, b, c, d = np.radians(angles).T
    wi = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=1)
    wo = np.stack([np.sin(c) * np.cos(d), np.sin(c) * np.sin(d), np.cos(c)], axis=1)
    rows = np.column_stack([angles, function(wi, wo)])
    return np.asarray(np.random.default_rng(5).permutation(rows))


def test_rows_in_any_order_are_the_values_of_their_grid() -> None:
    rows = rows_of(glossy)
    ordered = rows[np.lexsort(rows[:, 3::-1].T)]
    wi_theta, wo_theta = np.unique(rows[:, 0]), np.unique(rows[:, 2])
    values = ordered[:, 4].reshape(6, 1, 18, 18)
    first = bsdf.from_rows(rows)
    second = bsdf.from_values(values, wi_theta_deg=wi_theta, wo_theta_deg=wo_theta, wo_phi_deg=PHI)
    for wi in (EVERY, BELOW):
        one, other = first.lobes(wi), second.lobes(wi)
        np.testing.assert_array_equal(one.wo, other.wo)
        np.testing.assert_array_equal(one.power, other.power)


def test_one_row_along_the_normal_stands_for_all_azimuths() -> None:
    azimuths, polar = np.arange(0.0, 360.0, 90.0), [0.0, 20.0, 40.0, 60.0, 80.0]
    grid = np.meshgrid([0.0, 45.0], azimuths, polar, azimuths, indexing="ij")
    angles = np.stack([one.ravel() for one in grid], axis=1)
    values = 0.1 + 0.1 * np.cos(np.radians(angles[:, 2])) * (1.0 + 0.2 * (angles[:, 0] > 0.0))
    rows = np.column_stack([angles, values])
    again = (rows[:, 0] == 0.0) & (rows[:, 1] > 0.0) | (rows[:, 2] == 0.0) & (rows[:, 3] > 0.0)
    with pytest.warns(batwing.DesignWarning, match="inner side"):
        every, fewer = bsdf.from_rows(rows), bsdf.from_rows(rows[~again])
    one, other = every.lobes(EVERY), fewer.lobes(EVERY)
    np.testing.assert_array_equal(one.wo, other.wo)
    np.testing.assert_array_equal(one.power, other.power)


def test_a_file_of_the_same_values_is_the_same_surface(tmp_path: Path) -> None:
    """Klems' matrix of WINDOW by hand is long; LightTools' text holds our cells, turned by 90 degrees."""
    rows = rows_of(glossy)
    table = bsdf.from_rows(rows)
    lines = ["Symmetry Asymmetric", "SpectralContent Monochrome", f"ScatterAzimuth {PHI.size}"]
    lines += [" ".join(map(str, PHI)), f"ScatterRadial {THETA.size}", " ".join(map(str, THETA))]
    lines.append("DataBegin")
    for theta in np.unique(rows[:, 0]):
        for below in (False, True):
            half = rows[(rows[:, 0] == theta) & ((rows[:, 2] > 90.0) == below)]
            polar = 180.0 - half[:, 2] if below else half[:, 2]
            # Azimuth 0 of the file is at -90 degrees here, on our grid of 20 degrees at 10 of it.
            turned = (half[:, 3] + 80.0) % 360.0
            half = half[np.lexsort((polar, turned))]
            at = 180.0 - theta if theta > 90.0 else theta
            wi = np.array([np.sin(np.radians(theta)), 0.0, np.cos(np.radians(theta))])
            albedo = table.albedo(wi)
            power = albedo.transmitted if (theta > 90.0) != below else albedo.reflected
            side = "Back" if theta > 90.0 else "Front"
            kind = "BTDF" if (theta > 90.0) != below else "BRDF"
            lines += [f"AOI {at}", "POI 280", f"Side {side}", "Wavelength 550", f"ScatterType {kind}"]
            lines += [f"TIS {power[0, 0]:.12f}", " ".join(map(str, half[:, 4]))]
    lines.append("DataEnd")
    (tmp_path / "by-hand.bsdf").write_text("\n".join(lines) + "\n")
    other = bsdf.read(tmp_path / "by-hand.bsdf")
    for wi in (EVERY, BELOW):
        one, two = table.albedo(wi), other.albedo(wi)
        np.testing.assert_allclose(one.reflected, two.reflected, rtol=1e-9)
        np.testing.assert_allclose(one.transmitted, two.transmitted, rtol=1e-9)


@pytest.mark.parametrize("format, ending", [("lighttools", "bsdf"), ("tensortree", "xml")])
def test_tables_of_values_become_files(tmp_path: Path, format: bsdf.TableFormat, ending: str) -> None:
    table = bsdf.from_function(glossy, scatter_deg=5.0)
    path = tmp_path / f"glossy.{ending}"
    table.write(path, format, scatter_deg=5.0, azimuth_deg=90.0, samples=4)
    compared = bsdf.compare(table, bsdf.read(path), side="outer", theta_deg=[0.0, 30.0], cells=8)
    assert np.abs(compared.albedo_difference).max() < 0.01 and compared.distance.max() < 0.3


HALF = white(0.6)[:, :, :10]
BAD: list[tuple[str, Callable[[], object], str, str]] = [
    ("shape", lambda: wall(white(0.6, 3)), "values", "(3, 1, 9, 18)"),
    ("negative", lambda: wall(white(-0.6)), "values", "at [1, 1, 1]"),
    ("nan", lambda: wall(white(np.nan)), "values", "nan"),
    ("gain", lambda: wall(white(1.3)), "values", "1.300000"),
    ("order", lambda: wall(white(0.6), wi_theta_deg=[80.0, 0.0]), "wi_theta_deg", "80"),
    ("beyond", lambda: wall(white(0.6), wi_theta_deg=[0.0, 181.0]), "wi_theta_deg", "181"),
    ("half", lambda: wall(HALF, wo_phi_deg=PHI[:10]), "azimuths of wo", "0 to 180"),
    ("indices", lambda: wall(white(0.6), indices=(1.0, 1.0, 1.0)), "indices", "[1. 1. 1.]"),
    ("index", lambda: wall(white(0.6), indices=(0.0, 1.0)), "indices", "[0. 1.]"),
    ("grazing", lambda: wall(white(0.6), wi_theta_deg=[0.0, 90.0]), "wi", "90"),
    ("edge", lambda: bsdf.from_rows([[0, 0, 90, 0, 0.1]]), "wo", "90"),
    ("between", lambda: wall(white(0.6), between="x"), "between", "x"),
    ("columns", lambda: bsdf.from_rows(np.zeros((2, 4))), "rows", "(2, 4)"),
    ("range", lambda: bsdf.from_rows([[0, -5, 0, 0, 0.1]]), "rows", "-5.0 at [1, 2]"),
    ("missing", lambda: bsdf.from_rows(rows_of(glossy)[1:]), "rows with wi at", "161 rows"),
    ("twice", lambda: bsdf.from_rows([[0, 0, 5, 0, 0.1]] * 2), "rows with wi at [0, 0]", "2 rows"),
    (
        "one side",
        lambda: bsdf.from_rows([[0, 0, 5, 0, 0.1], [30, 0, 5, 0, 0.1], [30, 0, 175, 0, 0.1]]),
        "wi on the outer side, wo on the inner side",
        "1 directions",
    ),
    ("below", lambda: bsdf.from_function(lambda wi, wo: wo[:, 2]), "function", "-0.99"),
    ("text", lambda: bsdf.from_function(lambda wi, wo: "x"), "function", "'x'"),
    ("a number", lambda: bsdf.from_function(lambda wi, wo: 1.0), "function", "shape ()"),
    ("step", lambda: bsdf.from_function(glossy, scatter_deg=7.0), "scatter_deg", "7.0"),
    ("fine", lambda: bsdf.from_function(glossy, scatter_deg=1e-4), "scatter_deg", "GiB"),
]


@pytest.mark.parametrize("name, call, key, got", BAD, ids=[case[0] for case in BAD])
def test_tables_that_cannot_be_are_refused(
    name: str, call: Callable[[], object], key: str, got: str
) -> None:
    with pytest.raises(batwing.InputError) as caught:
        call()
    assert key in str(caught.value) and got in str(caught.value), str(caught.value)
    assert caught.value.key is not None and caught.value.expected is not None
