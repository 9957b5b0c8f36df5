# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a grating to the light of a micro-structured LED package: RCWA, BSDF tables, ray traces.

Three levels:

- `batwing.rcwa`: gratings, their orders, whole hemispheres, near fields;
- `batwing.bsdf`: tables of diffraction orders and measured scattering, in the formats of other
  programs;
- `batwing.tracer`: designs as files or dicts, traced, varied, optimised.

The package installs the command `batwing` too (`batwing.cli.main`).
"""

from __future__ import annotations

from . import bsdf, cli, errors, rcwa, tracer
from ._native import VERSION as __version__
from ._native import set_threads, threads
from ._progress import set_progress
from .errors import (
    ConvergenceError,
    Error,
    FileError,
    InputError,
    InternalError,
    SolverError,
    UnitWarning,
)
from .tracer import optimise, reproduce, run, study, tolerance

__all__ = [
    "ConvergenceError",
    "Error",
    "FileError",
    "InputError",
    "InternalError",
    "SolverError",
    "UnitWarning",
    "__version__",
    "bsdf",
    "cli",
    "errors",
    "optimise",
    "rcwa",
    "reproduce",
    "run",
    "set_progress",
    "set_threads",
    "study",
    "threads",
    "tolerance",
    "tracer",
]
