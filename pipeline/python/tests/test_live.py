# SPDX-License-Identifier: MIT OR Apache-2.0
"""The live view from Python."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from pathlib import Path

import pytest

import batwing
from batwing.live import explore
from batwing.simulate import Design


def test_a_design_is_shown_until_it_is_stopped(tmp_path: Path) -> None:
    design = Design(Design.template("own").data, str(tmp_path))
    with design.explore() as page:
        with urllib.request.urlopen(page.address + "state") as answer:
            state = json.load(answer)
        assert state["name"] == "own" and state["saved"]
        assert page.address in page._repr_html_()
        assert page.design().data["name"] == "own"
        assert page.file.exists()
    assert not page.file.exists()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(page.address + "state")


def test_what_is_no_design_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text("name = 3\n")
    with pytest.raises(batwing.InputError, match="bad.toml"):
        explore(file)
    with pytest.raises(batwing.InputError, match="array.pitch_mm"):
        Design.template("own").with_values({"array.pitch_mm": -1}).explore()
