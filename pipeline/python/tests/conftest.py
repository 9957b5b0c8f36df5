# SPDX-License-Identifier: MIT OR Apache-2.0
"""Paths of the repository, and the binary where there is one."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def binary() -> str:
    """The binary to compare with: BATWING_BINARY, or that of a release build."""
    found = os.environ.get("BATWING_BINARY") or str(ROOT / "target" / "release" / "batwing")
    if shutil.which(found) is None:
        pytest.skip("needs the binary: cargo build --release, or BATWING_BINARY")
    return found
