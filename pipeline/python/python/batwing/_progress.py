# SPDX-License-Identifier: MIT OR Apache-2.0
"""Progress of long calls as a bar of tqdm."""

from __future__ import annotations

import importlib
from typing import Any

from . import _native

_shown = False


def set_progress(shown: bool) -> None:
    """Shows the progress of calls of more than half a second, or not (the default).

    Solvers show a bar of tqdm, in terminals and notebooks. Commands such as `run` report on the
    standard error of the process.

    Parameters
    ----------
    shown : bool
        Whether to show it.

    Raises
    ------
    ImportError
        If tqdm is not installed.
    """
    global _shown
    if not shown:
        _native.set_progress(None)
        _shown = False
        return
    try:
        tqdm: Any = importlib.import_module("tqdm.auto").tqdm
    except ImportError as error:
        raise ImportError("set_progress() needs the package tqdm: pip install tqdm") from error
    bar: Any = None

    def report(done: int, total: int, ended: bool) -> None:
        nonlocal bar
        if done == 0 and bar is None:
            return
        if bar is None:
            bar = tqdm(total=total or None, unit="layer", leave=False)
        bar.update(done - bar.n)
        if ended:
            bar.close()
            bar = None

    _native.set_progress(report)
    _shown = True


def is_shown() -> bool:
    """Whether progress is shown."""
    return _shown
