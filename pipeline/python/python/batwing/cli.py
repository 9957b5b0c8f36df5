# SPDX-License-Identifier: MIT OR Apache-2.0
"""The command `batwing` as a function."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from types import FrameType
from typing import NoReturn

from . import _native

__all__ = ["main", "program"]


def __dir__() -> list[str]:
    return sorted(__all__)


#: Exit code after Ctrl-C: 128 and the number of its signal.
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line, as the binary `batwing` does, and returns its exit code.

    It neither ends the process nor changes what Python does with signals. Output goes to the
    standard streams of the process.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments after the name of the program [default: those of the process].

    Returns
    -------
    int
        0, or that of the error: 1 for a refused input, 2 for a command line that cannot be parsed,
        130 after Ctrl-C, 75 where that stopped a shard or a merge.

    Examples
    --------
    >>> from batwing import cli
    >>> cli.main(["check", "no-such-file.toml", "--quiet"])
    1
    """
    sys.stdout.flush()
    sys.stderr.flush()
    try:
        return _native.command(list(sys.argv[1:] if arguments is None else arguments))
    except KeyboardInterrupt:
        return INTERRUPTED


def _end(number: int, _frame: FrameType | None) -> NoReturn:
    raise SystemExit(128 + number)


def program() -> NoReturn:
    """The installed command: runs the command line of the process and ends it.

    SIGTERM stops it as Ctrl-C does. No file that is not whole stays.
    """
    signal.signal(signal.SIGTERM, _end)
    try:
        sys.exit(main())
    finally:
        _native.discard_pending()
