# SPDX-License-Identifier: MIT OR Apache-2.0
"""Progress of long calls as a bar of tqdm."""

from __future__ import annotations

import importlib
import threading
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
    # Each call reports from its own thread.
    bars: dict[int, Any] = {}

    def report(done: int, total: int, ended: bool) -> None:
        call = threading.get_ident()
        bar = bars.get(call)
        if bar is None:
            if done == 0:
                return
            bar = bars[call] = tqdm(total=total or None, unit="layer", leave=False)
        bar.update(done - bar.n)
        if ended:
            bars.pop(call).close()

    _native.set_progress(report)
    _shown = True


def is_shown() -> bool:
    """Whether progress is shown."""
    return _shown
