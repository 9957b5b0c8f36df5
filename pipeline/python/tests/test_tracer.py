# SPDX-License-Identifier: MIT OR Apache-2.0
"""Designs: the same bits as the binary, standard errors, rays in and out."""

from __future__ import annotations

import json
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import batwing
from batwing import tracer

FEW = 65_536


@pytest.fixture(scope="module")
def found(root: Path) -> tracer.Results:
    return tracer.run(root / "data/designs/d1.toml", model="geometric", paths=FEW, seed=5)


def test_results_are_those_of_the_binary(
    binary: str, root: Path, found: tracer.Results, tmp_path: Path
) -> None:
    command = [binary, "run", str(root / "data/designs/d1.toml"), "--model", "geometric", "--quiet"]
    subprocess.run([*command, "--paths", str(FEW), "--seed", "5", "--out", str(tmp_path)], check=True)
    theirs = json.loads((tmp_path / "results.json").read_text())
    assert found.raw["designs"] == theirs["designs"]
    hashes = {file["file"]: file["sha256"] for file in theirs["files"]}
    assert hashes == {file["file"]: file["sha256"] for file in found.raw["files"]}


def test_figures_have_errors_and_units(found: tracer.Results) -> None:
    assert list(found.models) == [("D1", "geometric_100um")]
    model = found.model("geometric")
    uniformity = model.figures["uniformity"]
    assert 0 < uniformity.standard_error < 0.05 < uniformity.value < 1
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


def test_results_are_saved_loaded_and_pickled(found: tracer.Results, tmp_path: Path) -> None:
    found.save(tmp_path / "kept")
    again = tracer.load(tmp_path / "kept")
    assert again.raw == found.raw
    for name, array in found.model("geometric").arrays.items():
        np.testing.assert_array_equal(again.model("geometric").arrays[name], array)
    assert pickle.loads(pickle.dumps(found)).raw == found.raw


def test_a_dict_is_the_same_design_as_its_file(root: Path, found: tracer.Results) -> None:
    design = tracer.Design.read(root / "data/designs/d1.toml")
    same = tracer.run(design, model="geometric", paths=FEW, seed=5)
    # Published figures stand beside those of the paper's own file alone.
    for key, figure in found.model("geometric").figures.items():
        own = same.model("geometric").figures[key]
        assert (own.value, own.standard_error) == (figure.value, figure.standard_error)
    darker = design.with_values({"led.reflectance": 0.1})
    other = tracer.run(darker, model="geometric", paths=FEW, seed=5)
    name = "extraction_efficiency"
    assert other.model("geometric").figures[name].value < same.model("geometric").figures[name].value
    assert design.data != darker.data


def test_rays_go_out_and_come_in(root: Path, tmp_path: Path) -> None:
    design = tracer.Design.template()
    rays = tracer.trace_rays(design, paths=20_000, seed=3)
    assert rays.unit == "W" and len(rays.flux) > 10_000
    np.testing.assert_allclose(np.linalg.norm(rays.direction, axis=1), 1.0, atol=1e-5)
    escaped = tracer.run(design, model="geometric", paths=20_000, seed=3).model("geometric").ledger
    out = escaped["escaped_up"].value + escaped["escaped_down"].value
    assert rays.flux.sum(dtype=float) == pytest.approx(out, abs=0.02)
    for format, ending in (("tm25", "tm25ray"), ("ray", "ray"), ("zemax-ray", "sdf")):
        path = tmp_path / f"rays.{ending}"
        rays.write(path, format)
        again = tracer.read_rays(path)
        np.testing.assert_allclose(again.position_mm, rays.position_mm, atol=1e-6)
        np.testing.assert_allclose(again.flux.sum(), rays.flux.sum(), rtol=1e-3)
    with pytest.raises(batwing.InputError, match="direction"):
        tracer.Rays(rays.position_mm, 2 * rays.direction, rays.flux).write(tmp_path / "x.tm25ray")
    with pytest.raises(batwing.InputError, match="position_mm"):
        tracer.Rays(rays.position_mm[:5], rays.direction, rays.flux).write(tmp_path / "x.tm25ray")


def test_a_tolerance_analysis_has_its_samples(root: Path, tmp_path: Path) -> None:
    file = root / "data/gallery/d3-by-rays/tolerance.toml"
    report = tracer.tolerance(file, samples=8, paths=16_384, seed=2)
    [table] = report.tables.values()
    assert {len(column) for column in table.values()} == {8}
    assert report.folder is None and report.data["seed"] == 2


def test_a_study_has_its_table(tmp_path: Path) -> None:
    design = tmp_path / "my.toml"
    design.write_text(tracer.Design.template().to_toml())
    study = tmp_path / "study.toml"
    study.write_text(
        'name = "small"\ndescription = "one key"\ndesigns = ["my.toml"]\nmodels = ["geometric"]\n'
        "paths = 16_384\n[[factors]]\n"
        'name = "reflectance"\ndescription = "box"\nkey = "led.reflectance"\nvalues = [0.5, 0.9]\n'
    )
    report = tracer.study(study, out=tmp_path / "out")
    table = report.tables["study"]
    assert table["value"].dtype == np.float64 and (table["standard_error"] >= 0).all()
    assert report.folder == str(tmp_path / "out")


def test_the_name_of_a_design_is_no_path(tmp_path: Path) -> None:
    data = {**tracer.Design.template().data, "name": "../elsewhere"}
    with pytest.raises(batwing.InputError, match="name"):
        tracer.Design(data, str(tmp_path)).check()
    assert not list(tmp_path.iterdir())
    with pytest.raises(batwing.FileError, match="cannot write the design"):
        tracer.Design(data, str(tmp_path / "missing")).check()


def test_a_design_that_was_found_knows_its_folder(tmp_path: Path) -> None:
    (tmp_path / "optimise.json").write_text("{}")
    (tmp_path / "design.toml").write_text(tracer.Design.template().to_toml())
    design = tracer._report(tmp_path, False, "optimise").design
    assert design is not None and design.folder == str(tmp_path.resolve())
