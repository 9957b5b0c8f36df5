# SPDX-License-Identifier: MIT OR Apache-2.0
"""A design seen live: the page of `batwing explore`, also within a notebook."""

from __future__ import annotations

import html as escapes
import subprocess
import sys
import tempfile
import weakref
from pathlib import Path
from types import TracebackType

from . import design as designs
from .errors import FileError, InputError

__all__ = ["Explorer", "explore"]


def __dir__() -> list[str]:
    return sorted(__all__)


# Time that the page may take to end, s.
_GRACE = 5


def _end(process: subprocess.Popen[str], scratch: Path | None) -> None:
    process.terminate()
    try:
        process.wait(_GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.stdout is not None:
        process.stdout.close()
    if scratch is not None:
        scratch.unlink(missing_ok=True)


class Explorer:
    """A page in which a design is turned, until `stop` or the end of the process.

    In a notebook it shows the page. It is made by `explore` and by `Design.explore`.

    Attributes
    ----------
    address : str
        Address of the page, on this machine alone.
    file : pathlib.Path
        The design file that the page edits; it changes where the page saves it.
    """

    def __init__(self, file: Path, scratch: Path | None = None) -> None:
        words = [sys.executable, "-m", "batwing", "--quiet", "explore", str(file), "--no-open"]
        self.file = file
        with tempfile.TemporaryFile("w+", encoding="utf-8") as messages:
            # Ctrl-C in the notebook stops a cell, not the page.
            self._process = subprocess.Popen(
                words,
                stdout=subprocess.PIPE,
                stderr=messages,
                text=True,
                encoding="utf-8",
                start_new_session=True,
            )
            assert self._process.stdout is not None
            self.address = self._process.stdout.readline().strip()
            if not self.address:
                _end(self._process, scratch)
                messages.seek(0)
                raise InputError(messages.read().strip() or "the page could not be shown")
        self._end = weakref.finalize(self, _end, self._process, scratch)

    def __repr__(self) -> str:
        return f"Explorer({str(self.file)!r}, {self.address})"

    def _repr_html_(self) -> str:
        address = escapes.escape(self.address)
        return f'<iframe src="{address}" style="width:100%;height:900px;border:0"></iframe>'

    def design(self) -> designs.Design:
        """The design as the page last saved it."""
        return designs.Design.read(self.file)

    def stop(self) -> None:
        """Ends the page."""
        self._end()

    def __enter__(self) -> Explorer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()


def explore(design: designs.PathLike | designs.Design) -> Explorer:
    """Shows a design in a page in which its numbers are turned and its light is seen at once.

    Parameters
    ----------
    design : path or Design
        A design file, which the page edits, or a design. That is written into a file of its folder,
        which goes when the page ends: `Explorer.design` reads what the page saved before.

    Returns
    -------
    Explorer
        Its last value in a cell of a notebook shows the page there.

    Raises
    ------
    batwing.InputError
        A file that is no design.
    """
    if not isinstance(design, designs.Design):
        return Explorer(Path(design))
    design.check()
    try:
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=design.folder, suffix=".toml", delete=False
        ) as file:
            file.write(design.to_toml())
    except OSError as error:
        raise FileError(f"{design.folder or '.'}: expected a folder to write into: {error}") from error
    return Explorer(Path(file.name), Path(file.name))
