# SPDX-License-Identifier: MIT OR Apache-2.0
"""The guide for users: every piece of code runs as written, with fewer paths."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from batwing import simulate


def pieces(text: str) -> list[str]:
    """Indented blocks of code of a page; commands of a shell are left out."""
    blocks = re.findall(r"(?:^    .*\n|^\n(?=    ))+", text, re.M)
    code = [re.sub(r"^    ", "", block, flags=re.M).strip("\n") + "\n" for block in blocks]
    return [one for one in code if not re.match(r"pip |BATWING", one)]


def test_the_code_of_the_guide_runs(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(root / "data")
    simulate.run(simulate.Design.template(), model="geometric", paths=4096, out="out")
    code = pieces((root / "docs/guide/python.md").read_text(encoding="utf-8"))
    assert len(code) >= 8
    names: dict[str, Any] = {}
    for one in code:
        exec(compile(one.replace("1_000_000", "20_000"), "docs/guide/python.md", "exec"), names)
    assert names["above"].values.shape == (40, 40) and names["change"].value > 0
    assert simulate.Design.read("better.toml").data == names["found"].design.data
