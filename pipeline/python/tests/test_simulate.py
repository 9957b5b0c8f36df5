# SPDX-License-Identifier: MIT OR Apache-2.0
"""Designs: the same bits as the binary, standard errors, rays in and out."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import json
import math
import os
import pickle
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import batwing
from batwing import scene, simulate
from batwing.design import _parsed, _toml_text

FEW = 65_536


@pytest.fixture(scope="module")
def found(root: Path) -> simulate.Results:
    return simulate.run(root / "data/designs/d1.toml", model="geometric", paths=FEW, seed=5)


def test_results_are_those_of_the_binary(
    binary: str, root: Path, found: simulate.Results, tmp_path: Path
) -> None:
    command = [binary, "run", str(root / "data/designs/d1.toml"), "--model", "geometric", "--quiet"]
    subprocess.run([*command, "--paths", str(FEW), "--seed", "5", "--out", str(tmp_path)], check=True)
    theirs = json.loads((tmp_path / "results.json").read_text())
    assert found.raw["designs"] == theirs["designs"] and found.raw["files"] == []
    hashes = {file["file"]: file["sha256"] for file in theirs["files"]}
    design = root / "data/designs/d1.toml"
    mine = simulate.run(design, model="geometric", paths=FEW, seed=5, out=tmp_path / "mine")
    assert hashes == {file["file"]: file["sha256"] for file in mine.raw["files"]}
    # What is in memory is what the files hold.
    for results in (simulate.load(tmp_path), mine):
        same_arrays(results.model("geometric"), found.model("geometric"))


def same_arrays(one: simulate.Model, other: simulate.Model) -> None:
    """Arrays, maps and receivers, with their axes and units."""
    assert one.arrays.keys() == other.arrays.keys() >= {"far_field", "illuminance_cross_section"}
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(other.arrays[name], array)
    assert one.maps.keys() == other.maps.keys() == {"far_field", "illuminance"}
    assert one.receivers.keys() == other.receivers.keys()
    assert one.figures == other.figures and one.ledger == other.ledger
    assert one.colours.keys() == other.colours.keys()
    for name, xyz in one.colours.items():
        np.testing.assert_array_equal(other.colours[name], xyz)
    for name, receiver in one.receivers.items():
        assert (receiver.xyz is None) == (other.receivers[name].xyz is None)
        if receiver.xyz is not None:
            np.testing.assert_array_equal(other.receivers[name].xyz, receiver.xyz)
    maps = [(one.maps[name], other.maps[name]) for name in one.maps]
    maps += [(one.receivers[name], other.receivers[name]) for name in one.receivers]
    for here, there in maps:
        assert (here.quantity, here.unit) == (there.quantity, there.unit)
        np.testing.assert_array_equal(here.values, there.values)
        np.testing.assert_array_equal(here.standard_error, there.standard_error)
        assert [(a.name, a.unit) for a in here.axes] == [(a.name, a.unit) for a in there.axes]
        for a, b in zip(here.axes, there.axes):
            np.testing.assert_array_equal(a.edges, b.edges)


def test_a_run_without_out_writes_no_file(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.chdir(tmp_path)
    found = simulate.run(simulate.Design.template(), model="geometric", paths=4096, seed=5)
    assert found.folder is None and found.raw["seed"] == found.seed == 5
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
    found.verify()


def test_receivers_in_memory_are_those_of_files(tmp_path: Path) -> None:
    """Every kind of a receiver, with Stokes parameters too."""
    data = simulate.Design.template().data
    data["light"] = {**data["light"], "polarization": "carried"}
    size = {"position_mm": [0, 0, 3.0], "size_mm": [4, 2], "bins": [4, 3]}
    angles = {"theta_bin_deg": 15, "phi_bin_deg": 45}
    data["receivers"] = [
        {"name": "plane", "kind": "plane", **size},
        {"name": "stokes", "kind": "plane", "stokes": True, **size},
        {"name": "far", "kind": "far_field", **angles},
        {"name": "lamp", "kind": "c_gamma", **angles},
        {"name": "eye", "kind": "luminance", **size, **angles},
        {"name": "through", "kind": "surface", "surface": "dome"},
    ]
    here = simulate.run(data, model="geometric", paths=16_384).model("geometric")
    there = simulate.run(data, model="geometric", paths=16_384, out=tmp_path).model("geometric")
    assert len(here.receivers) == 6 and len(here.receivers["eye"].axes) == 4
    assert here.receivers["stokes"].values.shape == (4, 3, 4)
    for name, one in here.receivers.items():
        assert one.figures == there.receivers[name].figures
    same_arrays(there, here)


def test_a_spectrum_in_memory_is_that_of_files(tmp_path: Path) -> None:
    data = simulate.Design.template().data
    lines = {"kind": "lines", "wavelength_nm": [450.0, 550.0, 650.0], "power": [1.0, 2.0, 1.0]}
    data["light"] = {"spectrum": {**lines, "weighting": "photometric"}}
    here = simulate.run(data, model="geometric", paths=16_384).model("geometric")
    there = simulate.run(data, model="geometric", paths=16_384, out=tmp_path).model("geometric")
    same_arrays(there, here)
    assert here.raw["spectrum"] == there.raw["spectrum"]


def test_colours_in_memory_are_those_of_files(tmp_path: Path) -> None:
    """Two sources of two colours; Y is the illuminance."""
    data = simulate.Design.template().data
    data["light"] = {**data["light"], "weighting": "photometric"}
    beam = {"kind": "cosine", "exponent": 1.0}
    data["sources"] = [
        {"name": "blue", "position_mm": [-0.3, 0, 0.6], "wavelength_nm": 460.0, **beam},
        {"name": "red", "position_mm": [0.3, 0, 0.6], "wavelength_nm": 620.0, **beam},
    ]
    size = {"position_mm": [0, 0, 3.0], "size_mm": [4, 2], "bins": [4, 3]}
    data["receivers"] = [{"name": "plane", "kind": "plane", **size}]
    here = simulate.run(data, model="geometric", paths=16_384).model("geometric")
    there = simulate.run(data, model="geometric", paths=16_384, out=tmp_path).model("geometric")
    same_arrays(there, here)
    assert here.colours.keys() == {"illuminance", "far_field"}
    for name, xyz in here.colours.items():
        assert xyz.shape == (9, *here.maps[name].values.shape)
        np.testing.assert_allclose(xyz[1], here.maps[name].values, rtol=1e-9, atol=1e-9)
    plane = here.receivers["plane"]
    assert plane.xyz is not None and plane.xyz.shape == (9, 3, 4)
    x, y, z = plane.xyz[:3].sum(axis=(1, 2))
    assert plane.figures["u_prime"].value == pytest.approx(4 * x / (x + 15 * y + 3 * z))
    assert plane.figures["u_prime"].unit == "1"


def test_figures_have_errors_and_units(found: simulate.Results) -> None:
    assert list(found.models) == [("D1", "geometric_100um")]
    model = found.model("geometric")
    uniformity = model.figures["uniformity"]
    # So few paths leave it between two ends: no number stands for it but those.
    assert uniformity.interval and math.isnan(uniformity.value)
    assert 0.05 < uniformity.interval[0] < uniformity.estimate[0] < uniformity.interval[1] < 1
    assert 0 < uniformity.estimate[1] < 0.05
    beam = model.figures["beam_angle_deg"]
    assert beam.is_resolved and 0 < beam.standard_error < 5 < beam.value < 180
    assert f"{simulate.Figure(0.5, 0.25, '1', {}):+.2f}" == "+0.50 ± 0.25"
    assert model.figures["peak_angle_deg"].unit == "deg"
    total = sum(f.value for name, f in model.ledger.items() if name.startswith(("escaped", "absorbed", "lost")))
    assert total == pytest.approx(1.0, abs=1e-9)
    far = model.far_field()
    assert far is not None and far.intensity.shape == far.standard_error.shape
    upwards = far.theta_deg < 90
    width = np.radians(np.diff(far.theta_deg)[0])
    flux = (2 * np.pi * far.intensity * np.sin(np.radians(far.theta_deg)) * width)[upwards].sum()
    assert flux == pytest.approx(model.ledger["escaped_up"].value, rel=0.02)
    with pytest.raises(batwing.InputError, match="hybrid"):
        found.model("hybrid")


def test_results_are_saved_loaded_and_pickled(found: simulate.Results, tmp_path: Path) -> None:
    found.save(tmp_path / "kept")
    again = simulate.load(tmp_path / "kept")
    assert again.raw["designs"] == found.raw["designs"] and len(again.raw["files"]) > 10
    same_arrays(again.model("geometric"), found.model("geometric"))
    copied = pickle.loads(pickle.dumps(found))
    assert copied.raw == found.raw
    copied.save(tmp_path / "copied")
    assert simulate.load(tmp_path / "copied").raw == again.raw


def test_results_of_a_design_that_changed_are_not_saved(tmp_path: Path) -> None:
    design = tmp_path / "my.toml"
    design.write_text(simulate.Design.template().to_toml())
    found = simulate.run(design, model="geometric", paths=4096)
    design.write_text(simulate.Design.template().with_values({"led.reflectance": 0.1}).to_toml())
    with pytest.raises(batwing.FileError, match="my.toml: expected the SHA-256"):
        found.save(tmp_path / "kept")
    assert [path.name for path in tmp_path.iterdir()] == ["my.toml"]


def test_altered_and_missing_files_are_found(found: simulate.Results, tmp_path: Path) -> None:
    found.verify()
    found.save(tmp_path)
    simulate.load(tmp_path).verify()
    file = tmp_path / "D1/geometric_100um/far_field.csv"
    whole = file.read_bytes()
    file.write_bytes(whole.replace(b"0", b"1", 1))
    with pytest.raises(batwing.FileError, match="far_field.csv"):
        simulate.load(tmp_path).verify()
    file.unlink()
    with pytest.raises(batwing.FileError, match="far_field.csv"):
        simulate.load(tmp_path).verify()
    file.write_bytes(whole)
    results = tmp_path / "results.json"
    results.write_bytes(results.read_bytes().replace(b'"paths"', b'"Paths"', 1))
    with pytest.raises(batwing.FileError, match="results.json"):
        simulate.load(tmp_path).verify()


def test_a_dict_twice_gives_the_same_bytes_and_names_no_temporary_file(root: Path) -> None:
    design = simulate.Design.read(root / "data/designs/d1.toml")
    first = simulate.run(design, model="geometric", paths=FEW, seed=5, threads=1)
    again = simulate.run(design.data, model="geometric", paths=FEW, seed=5)
    assert first.raw == again.raw
    same_arrays(first.model("geometric"), again.model("geometric"))
    [entry] = first.raw["inputs"]
    text = design.to_toml().encode()
    assert entry == {"file": "design.toml", "sha256": hashlib.sha256(text).hexdigest()}


def test_a_dict_differs_from_its_file_in_no_figure(root: Path, found: simulate.Results) -> None:
    design = simulate.Design.read(root / "data/designs/d1.toml")
    same = simulate.run(design, model="geometric", paths=FEW, seed=5)
    of_dict, of_file = same.model("geometric"), found.model("geometric")
    assert of_dict.figures.keys() == of_file.figures.keys()
    for key, figure in of_file.figures.items():
        own = of_dict.figures[key]
        assert (own.value, own.standard_error) == (figure.value, figure.standard_error)
    assert of_dict.ledger == of_file.ledger
    for name, array in of_file.arrays.items():
        np.testing.assert_array_equal(of_dict.arrays[name], array)
    assert not same.comparisons()
    darker = design.with_values({"led.reflectance": 0.1})
    other = simulate.run(darker, model="geometric", paths=FEW, seed=5)
    name = "extraction_efficiency"
    assert other.model("geometric").figures[name].value < of_dict.figures[name].value
    assert design.data != darker.data


def test_published_figures_stand_beside_computed_ones(found: simulate.Results) -> None:
    assert not found.comparisons()
    # As `reproduce` writes them.
    model = found.model("geometric")
    figure = model.figures["uniformity"]
    figure = dataclasses.replace(figure, more={**figure.more, "published": 0.755})
    model = dataclasses.replace(model, figures={**model.figures, "uniformity": figure})
    (row,) = dataclasses.replace(found, models={("D1", "geometric_100um"): model}).comparisons()
    assert (row.design, row.model, row.figure) == ("D1", "geometric_100um", "uniformity")
    assert row.published == 0.755
    # Not resolved by so few paths: neither is the difference.
    assert row.computed.interval and math.isnan(row.difference)
    assert row.computed.interval[0] - 0.02 < 0.755 < row.computed.interval[1] + 0.02


def test_files_that_a_dict_names_lie_in_its_folder(root: Path, tmp_path: Path) -> None:
    (tmp_path / "places.txt").write_text("-3.0 0.0\n3.0 0.0\n")
    data = {**simulate.Design.template().data, "array": {"pitch_mm": 6.0, "positions_file": "places.txt"}}
    found = simulate.run(simulate.Design(data, str(tmp_path)), model="geometric", paths=16_384)
    assert [one["file"] for one in found.raw["inputs"]] == ["design.toml", str(tmp_path / "places.txt")]
    assert [path.name for path in tmp_path.iterdir()] == ["places.txt"]
    with pytest.raises(batwing.Error, match="places.txt"):
        simulate.Design(data).check()


def test_rays_go_out_and_come_in(root: Path, tmp_path: Path) -> None:
    design = simulate.Design.template()
    rays = simulate.trace_rays(design, paths=20_000, seed=3)
    assert rays.unit == "W" and len(rays.flux) > 10_000
    np.testing.assert_allclose(np.linalg.norm(rays.direction, axis=1), 1.0, atol=1e-5)
    escaped = simulate.run(design, model="geometric", paths=20_000, seed=3).model("geometric").ledger
    out = escaped["escaped_up"].value + escaped["escaped_down"].value
    assert rays.flux.sum(dtype=float) == pytest.approx(out, abs=0.02)
    formats: list[tuple[simulate.RayFormat, str]] = [
        ("tm25", "tm25ray"),
        ("ray", "ray"),
        ("zemax-ray", "sdf"),
    ]
    for format, ending in formats:
        path = tmp_path / f"rays.{ending}"
        rays.write(path, format)
        again = simulate.read_rays(path)
        np.testing.assert_allclose(again.position_mm, rays.position_mm, atol=1e-6)
        np.testing.assert_allclose(again.flux.sum(), rays.flux.sum(), rtol=1e-3)
    with pytest.raises(batwing.InputError, match="direction"):
        simulate.Rays(rays.position_mm, 2 * rays.direction, rays.flux).write(tmp_path / "x.tm25ray")
    with pytest.raises(batwing.InputError, match="position_mm"):
        simulate.Rays(rays.position_mm[:5], rays.direction, rays.flux).write(tmp_path / "x.tm25ray")


def test_a_tolerance_analysis_has_its_samples(root: Path, tmp_path: Path) -> None:
    file = root / "data/gallery/d3-by-rays/tolerance.toml"
    report = simulate.tolerance(file, samples=8, paths=16_384, seed=2)
    [table] = report.tables.values()
    assert {len(column) for column in table.values()} == {8}
    assert report.folder is None and report.seed == report.raw["seed"] == 2
    report.verify()


def test_a_study_has_its_table(tmp_path: Path) -> None:
    design = tmp_path / "my.toml"
    design.write_text(simulate.Design.template().to_toml())
    study = tmp_path / "study.toml"
    study.write_text(
        'name = "small"\ndescription = "one key"\ndesigns = ["my.toml"]\nmodels = ["geometric"]\n'
        "paths = 16_384\n[[factors]]\n"
        'name = "reflectance"\ndescription = "box"\nkey = "led.reflectance"\nvalues = [0.5, 0.9]\n'
    )
    report = simulate.study(study, out=tmp_path / "out")
    table = report.tables["study"]
    assert table["value"].dtype == np.float64 and (table["standard_error"] >= 0).all()
    assert report.folder == str(tmp_path / "out")


STUDY = {
    "name": "small",
    "models": ["geometric"],
    "paths": 4096,
    "factors": [{"name": "reflectance", "key": "led.reflectance", "values": [0.5, 0.9]}],
}
TOLERANCE = {
    "name": "spread",
    "samples": 8,
    "paths": 4096,
    "figures": ["extraction_efficiency"],
    "tolerances": [{"key": "led.reflectance", "deviation": 0.05}],
}


def small_scene(root: Path) -> Any:
    """The bare dome of the repository, as objects."""
    data = simulate.Design.read(root / "data/designs/bare-dome.toml").data
    return scene.Scene(**{**data, "led": scene.Led(**data["led"])})


def test_studies_problems_and_tolerances_are_paths_dicts_and_scenes_alike(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = small_scene(root)
    design = whole.design()
    text = design.to_toml()
    (tmp_path / "design.toml").write_text(text)
    problem = _parsed("problem", PROBLEM)
    commands: list[tuple[str, Callable[..., Any], dict[str, Any], str]] = [
        ("study", simulate.study, STUDY, "designs"),
        ("tolerance", simulate.tolerance, TOLERANCE, "design"),
        ("problem", simulate.optimise, problem, "design"),
    ]
    monkeypatch.chdir(tmp_path)
    for name, command, keys, key in commands:
        forms: list[Any] = ["design.toml", whole]
        if name == "study":
            forms += [design, design.data]
        given = [[one] if key == "designs" else one for one in forms]
        found = [command({**keys, key: one}, seed=3) for one in given]
        path = tmp_path / f"{name}.toml"
        path.write_text(_toml_text("x", {**keys, key: given[0]}))
        found.append(command(f"{name}.toml", seed=3))
        for one in found[1:]:
            assert one.raw == found[0].raw, name
        files = [entry["file"] for entry in found[0].raw.get("inputs", found[0].raw["files"])]
        assert not any("tmp" in file for file in files), files
        path.unlink()
    with pytest.raises(batwing.InputError, match=r"^study.toml: .*no-such-key"):
        simulate.study({**STUDY, "designs": [whole], "no-such-key": 1})
    with pytest.raises(batwing.InputError, match=r"^tolerance.toml: samples.*nan"):
        simulate.tolerance({**TOLERANCE, "design": whole, "samples": float("nan")})
    with pytest.raises(batwing.InputError, match="file: expected the path of a file or a dict"):
        simulate.study(7)  # type: ignore[arg-type]
    with pytest.raises(batwing.InputError, match="design: expected a path, a dict, a Design"):
        simulate.tolerance({**TOLERANCE, "design": 7})


def test_designs_of_one_study_that_are_no_files_are_told_apart(root: Path, tmp_path: Path) -> None:
    data = simulate.Design.read(root / "data/designs/bare-dome.toml").data
    (tmp_path / "places.txt").write_text("-3.0 0.0\n3.0 0.0\n")
    array = {"pitch_mm": 6.0, "positions_file": "places.txt"}
    there = simulate.Design({**data, "name": "there", "array": array}, str(tmp_path))
    designs = [data, {**data, "name": "other"}, there]
    report = simulate.study({**STUDY, "designs": designs, "factors": []})
    assert set(report.tables["study"]["design"]) == {data["name"], "other", "there"}


def test_the_name_of_a_design_is_no_path(tmp_path: Path) -> None:
    data = {**simulate.Design.template().data, "name": "../elsewhere"}
    with pytest.raises(batwing.InputError, match="^design.toml: name"):
        simulate.Design(data, str(tmp_path)).check()
    assert not list(tmp_path.iterdir())


PROBLEM = """
name = "closer"
design = "bare-dome.toml"
[[variables]]
key = "array.pitch_mm"
from = 4.5
to = 12.0
[[objective.terms]]
figure = "uniformity"
[[constraints]]
figure = "extraction_efficiency"
at_least = 0.5
[[stages]]
evaluations = 12
restarts = 2
population = 6
paths = 4096
most_paths = 4096
[verification]
paths = 65536
"""


def test_a_search_gives_figures_before_and_after(root: Path, tmp_path: Path, binary: str) -> None:
    shutil.copy(root / "data/designs/bare-dome.toml", tmp_path)
    problem = tmp_path / "problem.toml"
    problem.write_text(PROBLEM)
    found = simulate.optimise(problem, out=tmp_path / "mine")
    command = [binary, "optimise", str(problem), "--quiet", "--out", str(tmp_path / "theirs")]
    subprocess.run(command, check=True)
    theirs = (tmp_path / "theirs/optimise.json").read_bytes()
    assert (tmp_path / "mine/optimise.json").read_bytes() == theirs

    assert found.name == "closer" and found.folder == str(tmp_path / "mine")
    before, after = found.objective.before, found.objective.after
    assert before is not None and after.estimate[0] < before.estimate[0] and after.estimate[1] > 0
    change = found.figures["uniformity"].change
    assert change is not None and change.value > 2 * change.standard_error > 0
    # Percentages differ by points, as on the terminal.
    assert str(change).endswith(" points") and str(found.figures["uniformity"].after).endswith(" %")
    [constraint] = found.constraints
    assert constraint.met and constraint.value is not None and constraint.value.value > 0.5
    [pitch] = found.coefficients
    assert 4.5 <= pitch.found < pitch.start and found.design.data["array"]["pitch_mm"] == pitch.found
    [stage] = found.stages
    assert stage.candidates.sum() == stage.evaluations
    assert (stage.standard_error[np.isfinite(stage.best)] > 0).all() and not found.front
    again = simulate.run(found.design, model="geometric", paths=16_384)
    assert list(found.results.models)[1][0] == "closer" == list(again.models)[0][0]

    kept = simulate.optimise(problem)
    assert kept.raw == found.raw and kept.folder is None
    kept.verify()
    kept.save(tmp_path / "saved")
    assert (tmp_path / "saved/optimise.json").read_bytes() == theirs
    assert simulate.load(tmp_path / "saved").raw == found.results.raw
    assert pickle.loads(pickle.dumps(kept)).objective == found.objective


def test_a_front_has_its_designs(root: Path, tmp_path: Path) -> None:
    shutil.copy(root / "data/designs/bare-dome.toml", tmp_path)
    front = '[[objective.terms]]\nfigure = "extraction_efficiency"\n[[stages]]\nmethod = "nsga2"'
    text = PROBLEM.replace("[[stages]]", front).replace("restarts = 2", "restarts = 1")
    (tmp_path / "problem.toml").write_text(text)
    found = simulate.optimise(tmp_path / "problem.toml", out=tmp_path / "out")
    assert found.front
    for one, entry in zip(found.front, found.raw["front"]["designs"], strict=True):
        assert list(one.figures) == ["uniformity", "extraction_efficiency"]
        ends = [of.get("interval") for of in entry["figures"]]
        assert [of.interval and list(of.interval) for of in one.figures.values()] == ends
        assert all(figure.estimate[1] > 0 for figure in one.figures.values())
        assert one.design.data["array"]["pitch_mm"] == pytest.approx(one.coefficients[0])


def test_the_quick_reproduction_is_read(tmp_path: Path) -> None:
    folder = os.environ.get("BATWING_RESULTS")
    if folder is None:
        pytest.skip("needs BATWING_RESULTS, the folder of `batwing reproduce --quick`")
    found = simulate.load(folder)
    assert isinstance(found, simulate.Reproduction)
    found.verify()
    rows = found.comparisons()
    assert {row.design for row in rows} == {"D1", "D2", "D3"}
    # Few rays and coarse tables resolve some of them.
    resolved = [row for row in rows if row.computed.is_resolved]
    assert resolved and all(np.isfinite(row.difference) for row in resolved)
    assert "S1" in found.figure_3 and len(found.figure_4) == 3
    assert found.figure_6 is not None
    transmitted = found.figure_6.rcwa["share"].sum()
    assert transmitted == pytest.approx(1.0, abs=1e-3)
    assert found.figure_6.rays["share"].sum() == pytest.approx(1.0, abs=1e-3)

    # Tables and traces are those of its cache, where it has one.
    again = simulate.reproduce(quick=True, cache=Path(folder) / "cache", out=tmp_path)
    assert again.quick and again.raw == found.raw
    for name in ("hybrid_10um", "geometric_100um"):
        theirs = found.models["D1", name].arrays["far_field"]
        np.testing.assert_array_equal(again.models["D1", name].arrays["far_field"], theirs)


def test_the_former_name_warns() -> None:
    with pytest.warns(DeprecationWarning, match=r"batwing\.simulate"):
        former = importlib.import_module("batwing.tracer")
    assert former.run is simulate.run


def test_maps_carry_axes_and_units(found: simulate.Results) -> None:
    model = found.model("geometric")
    far, light = model.maps["far_field"], model.maps["illuminance"]
    assert [(axis.name, axis.unit) for axis in far.axes] == [("theta", "deg"), ("phi", "deg")]
    assert [(axis.name, axis.unit) for axis in light.axes] == [("y", "mm"), ("x", "mm")]
    for one in (far, light):
        assert one.values.shape == tuple(axis.middles.size for axis in one.axes)
    theta, phi = (np.radians(axis.edges) for axis in far.axes)
    solid_angles = -np.diff(np.cos(theta))[:, None] * np.diff(phi)
    upwards = far.axes[0].middles < 90
    up = (far.values * solid_angles)[upwards].sum()
    assert up == pytest.approx(model.ledger["escaped_up"].value, rel=1e-6)
    assert "W/W" == model.ledger["escaped_up"].unit and str(model.ledger["emitted"]) == "100 %"
    assert (light.quantity, light.unit) == ("irradiance", "W/mm²")
    text = repr(model).splitlines()
    assert len(text) <= 24 and max(len(line) for line in text) <= 100
    assert len(repr(found).splitlines()) <= 24 and "  uniformity: " in repr(found)
    data = pytest.importorskip("xarray") and far.to_xarray()
    assert data.value.attrs["units"] == far.unit and data.theta.attrs["units"] == "deg"


def test_keys_of_lists_are_set_by_number() -> None:
    data = {"solids": [{"name": "a", "size_mm": (1.0, 2.0)}, {"name": "b"}]}
    design = simulate.Design(data).with_values({"solids[2].radius_mm": 0.5, "solids.0.size_mm.1": 3.0})
    assert design.data["solids"] == [
        {"name": "a", "size_mm": [1.0, 3.0]},
        {"name": "b", "radius_mm": 0.5},
    ]
    assert data["solids"][1] == {"name": "b"}


def test_files_of_rays_keep_their_ending_and_no_negative_flux(tmp_path: Path) -> None:
    ones = np.ones(3, np.float32)
    rays = simulate.Rays(np.zeros((3, 3), np.float32), np.eye(3, dtype=np.float32), ones, 550.0)
    for ending in ("tm25ray", "ray", "sdf", "txt"):
        path = tmp_path / f"rays.{ending}"
        rays.write(path)
        np.testing.assert_allclose(simulate.read_rays(path).flux, ones)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(batwing.InputError, match="path: .*tm25ray, got .sdf"):
        rays.write(tmp_path / "wrong.sdf", "tm25")
    with pytest.raises(batwing.InputError, match="path: .*got .csv"):
        rays.write(tmp_path / "wrong.csv")
    dark = simulate.Rays(rays.position_mm, rays.direction, ones - np.float32(1.5) * (np.arange(3) == 1))
    with pytest.raises(batwing.InputError, match=r"flux: .*-0.5 at \[2\]"):
        dark.write(tmp_path / "dark.tm25ray")
    assert sorted(tmp_path.iterdir()) == before


def test_warnings_of_designs_are_python_warnings(
    root: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """At the line of the caller, in every run, and errors where a filter says so."""
    design = simulate.Design.read(root / "data/designs/d1.toml").with_values({"receiver.bin_mm": 0.7})
    for _ in range(2):
        with pytest.warns(batwing.DesignWarning, match=r"receiver\.bin_mm") as caught:
            simulate.run(design, model="geometric", paths=FEW)
        assert {Path(one.filename) for one in caught} == {Path(__file__)}
    with warnings.catch_warnings():
        warnings.simplefilter("error", batwing.DesignWarning)
        with pytest.raises(batwing.DesignWarning):
            simulate.run(design, model="geometric", paths=FEW)
    assert "warning" not in capfd.readouterr().err
