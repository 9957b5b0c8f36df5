# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scenes of Python objects: the keys are those of the design file, and light does what it must."""

from __future__ import annotations

import dataclasses
import inspect
import json
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import batwing
from batwing import scene, simulate


def tables(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Properties of all tables of a schema, each kind of a table by itself."""
    if "properties" in schema:
        yield schema["properties"]
    below = [*schema.get("properties", {}).values(), *filter(None, [schema.get("items")])]
    for one in (*below, *schema.get("oneOf", []), *schema.get("anyOf", [])):
        yield from tables(one)


def keys(table: type[scene.Table]) -> set[str]:
    spelled = {"polarisation": "polarization", "from_": "from", "pass_": "pass"}
    names = {one.name for one in dataclasses.fields(table)}
    return {spelled.get(name, name) for name in names} | set(table._tag)


def test_every_table_of_the_design_file_has_a_class_with_all_its_keys() -> None:
    command = [sys.executable, "-m", "batwing", "schema", "design"]
    schema = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    classes: list[Any] = [getattr(scene, name) for name in scene.__all__]
    classes = [one for one in classes if inspect.isclass(one) and one is not scene.Table]
    known = [keys(one) for one in classes]
    found = list(tables(schema))
    assert len(found) > 150 and len(known) > 40
    for properties in found:
        assert any(set(properties) <= one for one in known), sorted(properties)
    every = set().union(*found)
    assert set().union(*known) == every


@pytest.mark.parametrize(
    "name, expected",
    [
        ("Array", "pitch_mm"),
        ("Box", "name size_mm"),
        ("Chip", "name face_powers"),
        ("Coating", "thickness_nm"),
        ("Cosine", "name position_mm exponent"),
        ("Cylinder", "name radius_mm height_mm"),
        ("Dome", "sphere_radius_mm height_mm width_mm"),
        ("Led", "size_mm height_mm reflection reflectance specular_fraction"),
        ("Light", "wavelength_nm"),
        ("Medium", "index absorption_per_mm"),
        ("Mesh", "name mesh mesh_unit"),
        ("Mirror", "kind reflectance specular_fraction"),
        ("Plane", "name position_mm size_mm bins"),
        ("RayFile", "name position_mm file"),
        ("Scatter", "kind transmitted reflected"),
        ("Scene", "name"),
        ("Sphere", "name radius_mm"),
        ("SurfaceFlux", "name surface"),
    ],
)
def test_keys_that_are_given_by_position_keep_their_order(name: str, expected: str) -> None:
    parameters = inspect.signature(getattr(scene, name)).parameters.values()
    by_position = [one.name for one in parameters if one.kind is one.POSITIONAL_OR_KEYWORD]
    assert by_position == expected.split()


def test_classes_say_what_their_keys_mean() -> None:
    assert "radius_mm : float\n    Radius, mm" in (scene.Sphere.__doc__ or "")
    assert "kind : {'specular', 'lambertian', 'absorbing', 'mixed'}" in (scene.Mirror.__doc__ or "")
    with pytest.raises(TypeError, match="radius_um"):
        scene.Sphere("ball", radius_um=500.0)
    with pytest.raises(TypeError, match="radius_mm"):
        scene.Sphere("ball")


def built(**more: Any) -> Any:
    """A small black box on a black bottom, far below the plane of the figures."""
    more.setdefault("receiver", scene.Receiver(plane_height_mm=8.0))
    return scene.Scene(
        "built",
        led=scene.Led((0.1, 0.1), 0.05, "absorbing"),
        mirror=scene.Mirror("absorbing", extent="array"),
        array=scene.Array(pitch_mm=40.0, columns=1, rows=1),
        light=scene.Light(wavelength_nm=550.0),
        **more,
    )


def run(whole: Any, paths: int = 131_072) -> simulate.Model:
    return simulate.run(whole.design(), paths=paths, seed=3).model("geometric")


def point(**more: Any) -> list[scene.Table]:
    return [scene.Isotropic("point", position_mm=(0, 0, 2.0), **more)]


def test_half_of_the_light_of_a_point_goes_up() -> None:
    up = run(built(sources=point())).ledger["escaped_up"]
    assert up.value == pytest.approx(0.5, abs=4 * up.standard_error + 1e-3)


def test_a_sphere_about_a_point_absorbs_by_beer_and_lambert() -> None:
    glass = scene.Medium(index=1.0, absorption_per_mm=0.5)
    ball = scene.Sphere("ball", position_mm=(0, 0, 2), radius_mm=1.0, medium=glass)
    found = run(built(solids=[ball], sources=point(inside="ball"))).ledger["absorbed_in_ball"]
    assert found.value == pytest.approx(1 - np.exp(-0.5), abs=4 * found.standard_error + 1e-7)


def test_a_plate_reflects_by_fresnel() -> None:
    """A collimated-enough spot under a plate: 4 % twice, with what goes to and fro."""
    plate = scene.Box("plate", position_mm=(0, 0, 4), size_mm=(30, 30, 1), medium=scene.Medium(1.5))
    spot = [scene.Cosine("spot", position_mm=(0, 0, 2), exponent=100_000.0)]
    up = run(built(solids=[plate], sources=spot)).ledger["escaped_up"]
    r = 0.04
    assert up.value == pytest.approx((1 - r) / (1 + r), abs=4 * up.standard_error + 1e-4)


def cube() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    faces = [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]  # fmt: skip
    return corners, np.array(faces)


def test_a_mesh_does_what_the_same_box_does(tmp_path: Path) -> None:
    scene.write_mesh(tmp_path / "cube.obj", *cube())
    medium = scene.Medium(1.5, absorption_per_mm=0.1)
    place: dict[str, Any] = {"position_mm": (0, 0, 4), "medium": medium}
    mesh = built(solids=[scene.Mesh("cube", "cube.obj", "mm", **place)], sources=point())
    box = run(built(solids=[scene.Box("cube", (2, 2, 2), **place)], sources=point()))
    found = simulate.run(mesh.design(tmp_path), paths=131_072, seed=3).model("geometric")
    for name in ("escaped_up", "absorbed_in_cube"):
        one, other = found.ledger[name], box.ledger[name]
        error = np.hypot(one.standard_error, other.standard_error)
        assert abs(one.value - other.value) < 4 * error + 1e-9


def test_a_dome_with_sheets_and_receivers_is_one_design() -> None:
    whole = scene.Scene(
        "dome",
        led=scene.Led((1.0, 1.0), 0.35, "mixed", reflectance=0.86, specular_fraction=0.5),
        mirror=scene.Mirror("specular", 0.95, extent="package"),
        array=scene.Array(8.0, columns=2, rows=1),
        light=scene.Light(wavelength_nm=550.0),
        dome=scene.Dome(sphere_radius_mm=2.0, height_mm=1.2, width_mm=3.6),
        silicone=scene.Medium(1.41),
        solids=[
            scene.Disc(
                "sheet", radius_mm=1.0, position_mm=(0, 0, 2), scatter=scene.Scatter("lambertian", 0.6, 0.3)
            ),
            scene.Rectangle(
                "fence", (2, 2), per="array", position_mm=(0, 0, 1.5), rotation_deg=(0, 90, 0),
                surface=scene.Reflector("lambertian", 0.9),
            ),
        ],
        receivers=[
            scene.Plane("above", position_mm=(0, 0, 4), size_mm=(20, 12), bins=(10, 6)),
            scene.SurfaceFlux("through", surface="dome"),
            scene.CGamma("lamp", theta_bin_deg=5, phi_bin_deg=15),
        ],
        receiver={"plane_height_mm": 3.5},
    )  # fmt: skip
    found = run(whole, paths=65_536)
    above = found.receivers["above"]
    assert above.values.shape == above.standard_error.shape == (6, 10)
    assert (above.standard_error > 0).all()
    assert [(axis.name, axis.unit) for axis in above.axes] == [("y", "mm"), ("x", "mm")]
    np.testing.assert_allclose(above.axes[1].edges[[0, -1]], [-10, 10])
    mean = above.figures["mean"]
    assert mean.value == pytest.approx(above.values.mean(), rel=1e-9) and mean.unit == above.unit
    assert found.receivers["lamp"].axes[0].name == "gamma" and not found.receivers["through"].axes
    assert simulate.run(whole, model="geometric", paths=65_536, seed=3).model("geometric").figures
    assert simulate.Design(whole.to_dict()).to_toml() == whole.design().to_toml()


@pytest.mark.parametrize("table", [scene.Light, scene.Hybrid])
def test_polarisation_has_two_spellings(table: Any) -> None:
    word = "carried" if table is scene.Light else "s"
    one, other = table(polarisation=word), table(polarization=word)
    assert one == other and one.to_dict() == {"polarization": word}
    assert one.polarisation == one.polarization == other.polarization == word
    assert table(polarization="unpolarized") == table(polarisation="unpolarised")
    assert dataclasses.replace(one, polarisation=None).polarization is None
    assert pickle.loads(pickle.dumps(one)) == one
    with pytest.raises(batwing.InputError, match="polarization"):
        table(polarisation=word, polarization=word)


def test_designs_take_both_spellings() -> None:
    """Keys and words of dicts and files."""
    data = simulate.Design.template().data
    spelled: list[dict[str, str]] = [
        {"polarization": "unpolarised"},
        {"polarisation": "unpolarised"},
        {"polarization": "unpolarized"},
    ]
    for light in spelled:
        simulate.Design({**data, "light": {**data["light"], **light}}).check()


def test_no_default_is_written() -> None:
    assert scene.Sphere("ball", 0.5).to_dict() == {"kind": "sphere", "name": "ball", "radius_mm": 0.5}


def test_bad_scenes_are_refused_by_the_program(tmp_path: Path) -> None:
    with pytest.raises(batwing.InputError) as caught:
        built(solids=[scene.Sphere("ball", -0.5, medium=scene.Medium(1.5))]).design().check()
    assert "radius_mm" in str(caught.value) and caught.value.got == "-0.5"
    with pytest.raises(batwing.InputError, match="Sphere: radius_mm"):
        scene.Sphere("ball", float("nan")).to_dict()
    corners, faces = cube()
    for bad in (faces + 8, faces[:0], faces.astype(float), faces[:, :2]):
        with pytest.raises(batwing.InputError, match="triangles"):
            scene.write_mesh(tmp_path / "bad.obj", corners, bad)
    with pytest.raises(batwing.InputError, match="corners"):
        scene.write_mesh(tmp_path / "bad.obj", corners[:, :2], faces)
    with pytest.raises(batwing.InputError, match="obj"):
        scene.write_mesh(tmp_path / "bad.stl", corners, faces)
    with pytest.raises(batwing.FileError, match="cannot write"):
        scene.write_mesh(tmp_path / "none/bad.obj", corners, faces)
    assert not list(tmp_path.iterdir())
