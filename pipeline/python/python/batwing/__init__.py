# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a grating to the light of a micro-structured LED package: RCWA, BSDF tables, ray traces.

Three levels:

- `batwing.rcwa`: gratings, their orders, whole hemispheres, near fields;
- `batwing.bsdf`: tables of diffraction orders and measured scattering, in the formats of other
  programs;
- `batwing.simulate`: designs as files or dicts, traced, varied, optimised; `batwing.scene` builds
  them of Python objects, `batwing.live` shows them in a page that follows every change.

The package installs the command `batwing` too (`batwing.cli.main`).
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import _native, errors
from ._native import VERSION as __version__
from ._native import set_threads, threads
from ._progress import set_progress
from .errors import (
    ConvergenceError,
    ConvergenceWarning,
    DesignWarning,
    Error,
    FileError,
    InputError,
    InternalError,
    ReliefWarning,
    SolverError,
    UnitWarning,
)

if TYPE_CHECKING:
    from . import bsdf, cli, live, rcwa, scene, simulate
    from .simulate import optimise, reproduce, run, study, tolerance

# Scripts of jobs start the package, not the interpreter alone.
_native.set_program(_native.__file__, [sys.executable or "python3", "-m", "batwing"])

#: Modules that are imported when they are first used.
_MODULES = ("bsdf", "cli", "live", "rcwa", "scene", "simulate", "tracer")
#: Functions of `simulate` that are reached from here too.
_FUNCTIONS = ("optimise", "reproduce", "run", "study", "tolerance")

__all__ = [
    "ConvergenceError",
    "ConvergenceWarning",
    "DesignWarning",
    "Error",
    "FileError",
    "InputError",
    "InternalError",
    "ReliefWarning",
    "SolverError",
    "UnitWarning",
    "__version__",
    "bsdf",
    "cli",
    "errors",
    "live",
    "optimise",
    "rcwa",
    "reproduce",
    "run",
    "scene",
    "set_progress",
    "set_threads",
    "simulate",
    "study",
    "threads",
    "tolerance",
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name in _FUNCTIONS:
        return getattr(import_module(f"{__name__}.simulate"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
