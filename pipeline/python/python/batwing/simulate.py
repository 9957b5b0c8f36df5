# SPDX-License-Identifier: MIT OR Apache-2.0
"""Designs of LED packages: traced, varied, optimised, toleranced; and rays as arrays.

A design is the path of a design file (docs/reference/design-file.md), a dict of the same keys, a
`Design`, or a `batwing.scene.Scene`. A study, problem or tolerance file is a path, or a dict of its
keys that names such a design. Results are those of the command of the same name, to the last
bit for the same seed.

Examples
--------
>>> from batwing import simulate
>>> design = simulate.Design.template("my-package")
>>> found = simulate.run(design, model="geometric", paths=20_000, seed=7)
>>> figure = found.model("geometric").figures["extraction_efficiency"]
>>> 0.0 < figure.standard_error < 0.1 < figure.value < 1.0
True
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, get_args

from . import _checks, _native, _progress
from .design import Design, DesignLike, FileLike, PathLike, stated, stated_file
from .optimisation import (
    Change,
    Coefficient,
    Constraint,
    FrontDesign,
    Optimisation,
    Stage,
    read_optimisation,
)
from .rays import RayFormat, Rays, read_rays
from .results import (
    Axis,
    Comparison,
    FarField,
    Figure,
    Map,
    Model,
    Orders,
    Receiver,
    Report,
    Reproduction,
    Results,
    in_memory,
    load,
    read_report,
    read_reproduction,
    read_results,
)

__all__ = [
    "Axis",
    "Change",
    "Coefficient",
    "Comparison",
    "Constraint",
    "Design",
    "FarField",
    "Figure",
    "FrontDesign",
    "Map",
    "Model",
    "ModelName",
    "Optimisation",
    "Orders",
    "RayFormat",
    "Rays",
    "Receiver",
    "Report",
    "Reproduction",
    "Results",
    "Stage",
    "load",
    "optimise",
    "read_rays",
    "reproduce",
    "run",
    "study",
    "tolerance",
    "trace_rays",
]

ModelName = Literal["geometric", "fine", "control", "hybrid", "all"]
RayModelName = Literal["geometric", "hybrid"]


def __dir__() -> list[str]:
    return sorted(__all__)


@contextlib.contextmanager
def _folder(out: PathLike | None) -> Iterator[tuple[Path, bool]]:
    """The folder for results, and whether it is a temporary one."""
    if out is not None:
        yield Path(out), False
        return
    with tempfile.TemporaryDirectory(prefix="batwing-") as folder:
        yield Path(folder) / "out", True


def _options(
    seed: int, cache: PathLike | None, threads: int | None, **values: object
) -> list[str]:
    options = ["--seed", str(_checks.whole("seed", seed, 0, 2**64 - 1))]
    if not _progress.is_shown():
        options.append("--quiet")
    threads = _checks.threads(threads)
    values = {**values, "cache": cache, "threads": threads or _native.threads()}
    for name, value in values.items():
        if value is True:
            options.append(f"--{name.replace('_', '-')}")
        elif value is not None and value is not False:
            text = os.fspath(value) if isinstance(value, os.PathLike) else str(value)
            options += [f"--{name.replace('_', '-')}", text]
    return options


def run(
    design: DesignLike,
    *,
    model: ModelName = "all",
    paths: int | None = None,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    until_error: str | None = None,
    most_paths: int | None = None,
    threads: int | None = None,
) -> Results:
    """Traces a design.

    Parameters
    ----------
    design : path, dict, Design or Scene
        The design.
    model : {'geometric', 'fine', 'control', 'hybrid', 'all'}
        How to compute it.
    paths : int, optional
        Paths to trace [default: those of the design].
    seed : int
        The same seed gives the same results to the last bit, on any number of threads.
    out : path, optional
        Folder for the files [default: none is written, and the results are in memory].
    cache : path, optional
        Folder that keeps tables for later runs, and finished groups of paths of a run that was
        stopped.
    until_error : str, optional
        Trace on until the standard error of a figure is at most this, such as ``"uniformity=0.1%"``;
        of its value ``"flux_up=1%"`` or ``"uniformity=1%rel"``.
    most_paths : int, optional
        With `until_error`: begin no batch beyond so many paths.
    threads : int, optional
        Threads of this call.

    Returns
    -------
    Results
        Figures with standard errors, far fields, maps, receivers.

    Raises
    ------
    batwing.InputError
        A key of the design, or an argument, that cannot be used.
    batwing.FileError
        A file that cannot be read or written.
    """
    model = _checks.choice("model", model, get_args(ModelName))
    options = _options(
        seed,
        cache,
        threads,
        model=model,
        paths=paths,
        until_error=until_error,
        most_paths=most_paths,
    )
    name, texts, place = stated(design)
    words = ["run", name, *options]
    if out is None:
        return in_memory(words, texts, place)
    _native.call([*words, "--out", os.fspath(out)], texts, place)
    return read_results(Path(out), keep=False)


def reproduce(
    *,
    quick: bool = False,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Reproduction:
    """Computes the paper's tables and figures; arguments as those of `run`.

    Parameters
    ----------
    quick : bool
        Coarser tables and fewer paths.

    Returns
    -------
    Reproduction
        All models of all designs, and the light of single elements.
    """
    options = _options(seed, cache, threads, quick=quick)
    with _folder(out) as (folder, keep):
        _native.call(["reproduce", "--out", str(folder), *options])
        return read_reproduction(folder, keep)


@contextlib.contextmanager
def _file_command(
    name: str, file: FileLike, out: PathLike | None, options: list[str]
) -> Iterator[tuple[Path, bool]]:
    """Runs a command on a file or dict; gives the folder of its results as `_folder` does."""
    path, texts = stated_file("problem.toml" if name == "optimise" else f"{name}.toml", file)
    with _folder(out) as (folder, keep):
        _native.call([name, path, "--out", str(folder), *options], texts)
        yield folder, keep


def study(
    file: FileLike,
    *,
    paths: int | None = None,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Report:
    """Varies keys of designs (docs/guide/studies.md); arguments as those of `run`.

    Parameters
    ----------
    file : path or dict
        Study file; under `designs` of a dict stand designs as `run` takes them.
    """
    options = _options(seed, cache, threads, paths=paths)
    with _file_command("study", file, out, options) as (folder, keep):
        return read_report(folder, keep, "study")


def optimise(
    file: FileLike,
    *,
    budget: str | None = None,
    resume: bool = False,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Optimisation:
    """Searches the design that a problem file asks for (docs/guide/optimisation.md).

    Parameters
    ----------
    file : path or dict
        Problem file; under `design` of a dict stands a design as `run` takes it.
    budget : str, optional
        Time for the search, such as ``"6min"``.
    resume : bool
        Go on with the log in `out`.

    Returns
    -------
    Optimisation
        The design found, verified figures before and after, the stages of the search.
    """
    options = _options(seed, cache, threads, budget=budget, resume=resume)
    with _file_command("optimise", file, out, options) as (folder, keep):
        return read_optimisation(folder, keep)


def tolerance(
    file: FileLike,
    *,
    samples: int | None = None,
    paths: int | None = None,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Report:
    """What deviations of real packages do to a design (docs/guide/tolerances.md).

    Parameters
    ----------
    file : path or dict
        Tolerance file; under `design` of a dict stands a design as `run` takes it.
    samples : int, optional
        Packages to draw.
    """
    options = _options(seed, cache, threads, samples=samples, paths=paths)
    with _file_command("tolerance", file, out, options) as (folder, keep):
        return read_report(folder, keep, "tolerance")


def trace_rays(
    design: DesignLike,
    *,
    model: RayModelName = "geometric",
    paths: int | None = None,
    seed: int = 1,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Rays:
    """Rays that leave a package; arguments as those of `run`.

    Parameters
    ----------
    model : {'geometric', 'hybrid'}
        How the relief is traced.

    Returns
    -------
    Rays
        Starts on the package, directions, power of each.
    """
    model = _checks.choice("model", model, get_args(RayModelName))
    options = _options(seed, cache, threads, model=model, paths=paths)
    name, texts, place = stated(design)
    with tempfile.TemporaryDirectory(prefix="batwing-") as folder:
        target = Path(folder) / "rays.tm25ray"
        words = ["export", name, "--format", "tm25", "--out", str(target), *options]
        _native.call(words, texts, place)
        return read_rays(target)
