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
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, Union, get_args

import numpy as np
import numpy.typing as npt

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
    Zones,
    in_memory,
    load,
    read_report,
    read_reproduction,
    read_results,
    read_zones,
)
from .section import Distance, FullWave, Section, SectionFarField, read_full_wave

__all__ = [
    "Axis",
    "Change",
    "Coefficient",
    "Comparison",
    "Constraint",
    "Design",
    "Distance",
    "FarField",
    "Figure",
    "FrontDesign",
    "FullWave",
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
    "Section",
    "SectionFarField",
    "Stage",
    "Zones",
    "full_wave",
    "load",
    "optimise",
    "read_rays",
    "reproduce",
    "run",
    "study",
    "tolerance",
    "trace_rays",
    "zones",
]

ModelName = Literal["geometric", "fine", "control", "hybrid", "all"]
ZonesModelName = Literal["geometric", "fine", "control", "hybrid"]
RayModelName = Literal["geometric", "hybrid"]
#: Levels from 0 to 1, the top row first, or the path of such a file.
Levels = Union[PathLike, npt.ArrayLike]


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


def zones(
    design: DesignLike,
    pattern: Levels | Mapping[str, Levels] | None = None,
    *,
    white: npt.ArrayLike | None = None,
    levels: str | None = None,
    power_limit: float | None = None,
    transfer: str | None = None,
    gamut: str | None = None,
    zones: tuple[int, int] | None = None,
    compare_zones: Sequence[tuple[int, int]] = (),
    packages: tuple[int, int] | None = None,
    receiver: str | None = None,
    contrast: float | None = None,
    picture: Levels | None = None,
    distance: float | None = None,
    age: float | None = None,
    pigment: float | None = None,
    test_patterns: bool = False,
    model: ZonesModelName = "geometric",
    direct: bool = False,
    paths: int | None = None,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Zones:
    """Dims the zones of a backlight (docs/guide/backlight.md); other arguments as those of `run`.

    Parameters
    ----------
    pattern : array_like or path
        Drives of the zones from 0 to 1, shape (rows, columns), the first row at the top; or a file of
        them, text or a PNG, of which an RGB one drives channels called red, green and blue; or one by the
        name of each channel.
    white : array_like or str, optional
        x and y of the white of the panel at full drive, shape (2,), or its temperature such as "6504K".
    levels : str, optional
        In place of a pattern the rule by which a picture gives the drives: "max", "mean", "rms" or
        "percentile=P".
    power_limit : float, optional
        Largest power of these drives over that of full white [default: 1].
    transfer, gamut : str, optional
        Of a picture on sub-pixels: "srgb", "linear", "pq" or "gamma=G", and "bt709", "dci-p3" or
        "bt2020".
    zones, packages : (int, int), optional
        Columns and rows of zones [default: one for each package], and of packages for which those of
        the design stand [default: those of the design].
    compare_zones : sequence of (int, int), optional
        Other numbers of zones in which the halo of the picture is compared, under `by_zones` of the results;
        needs `levels`.
    receiver : str, optional
        Plane or luminance receiver [default: the plane of `receiver`].
    contrast : float, optional
        Largest over smallest transmittance of the panel [default: that of the design, else 5000].
    picture : array_like or path, optional
        What the panel shows [default: the pattern]: an array of levels as light, shape (rows, columns); a
        file of them, an RGB PNG on a panel of sub-pixels, or a folder of PNGs. Arrays have no colours.
    distance, age, pigment : float, optional
        An eye at this distance in mm, whose own glare hides a part of the halo; its age in years
        [default: 25] and pigment, 0 black to 1.2 light blue [default: 0.5].
    test_patterns : bool
        Also show a white window of 10 % of the area, a single zone, a checkerboard of zones and a grey ramp.
    direct : bool
        Also trace the pattern itself, and compare.

    Returns
    -------
    Zones
        Figures of the backlight and of the panel, maps, a table of the zones.
    """
    name, own, place = stated(design)
    texts = dict(own)
    options = _options(
        seed,
        cache,
        threads,
        model=_checks.choice("model", model, get_args(ZonesModelName)),
        white=_white(white),
        levels=levels,
        power_limit=power_limit,
        transfer=transfer,
        gamut=gamut,
        picture=None if picture is None else _levels("picture", picture, texts),
        zones=_columns_and_rows("zones", zones),
        packages=_columns_and_rows("packages", packages),
        receiver=receiver,
        contrast=contrast,
        distance=distance,
        age=age,
        pigment=pigment,
        test_patterns=test_patterns,
        direct=direct,
        paths=paths,
    )
    for other in compare_zones:
        options.append(f"--compare-zones={_columns_and_rows('compare_zones', other)}")
    of_channels = pattern if isinstance(pattern, Mapping) else {"": pattern}
    for channel, one in of_channels.items():
        if one is not None:
            key = f"pattern {channel}".strip()
            file = _levels(key, one, texts)
            options += ["--pattern", f"{channel}={file}" if channel else file]
    with _folder(out) as (folder, keep):
        _native.call(["zones", name, "--out", str(folder), *options], texts, place)
        return read_zones(folder, keep)


def _white(value: npt.ArrayLike | None) -> str | None:
    """x and y, or a temperature, as they are written."""
    if value is None or isinstance(value, str):
        return value
    both = _checks.floats("white", value)
    if both.shape != (2,):
        _checks.refuse("white", "x and y, shape (2,), or a temperature", _checks.describe(both))
    return ",".join(repr(float(one)) for one in both)


def _levels(key: str, value: Levels, texts: dict[str, str]) -> str:
    """The name of a file of levels; those of an array go into `texts`."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    levels = _checks.floats(key, value)
    if levels.ndim != 2:
        _checks.refuse(key, "levels of shape (rows, columns)", _checks.describe(levels))
    outside = np.argwhere((levels < 0.0) | (levels > 1.0))
    if outside.size:
        place = tuple(outside[0])
        _checks.refuse(key, "levels from 0 to 1", f"{levels[place]} at {_checks.entry(*place)}")
    # No path of a file: texts come before files.
    name = f"{key} of the call.csv"
    texts[name] = "\n".join(",".join(map(repr, row)) for row in levels.tolist())
    return name


def _columns_and_rows(key: str, value: tuple[int, int] | None) -> str | None:
    if value is None:
        return None
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        _checks.refuse(key, "numbers of columns and rows", _checks.describe(value))
    columns, rows = (_checks.whole(key, number, 1, 10_000) for number in value)
    return f"{columns}x{rows}"


def full_wave(
    design: DesignLike,
    *,
    rings: int | None = None,
    ring_width_um: float | None = None,
    scale: float | None = None,
    sources: int | None = None,
    tolerance: float | None = None,
    nodes: float | None = None,
    memory_gib: float | None = None,
    paths: int | None = None,
    seed: int = 1,
    out: PathLike | None = None,
    threads: int | None = None,
) -> FullWave:
    """Compares rays and hybrid with Maxwell's equations in the section of a dome
    (docs/explanation/validity.md); other arguments as those of `run`.

    Parameters
    ----------
    rings : int, optional
        Rings from the axis to the rim [default: as many as ten minutes and the memory allow, at most
        those of the design].
    ring_width_um : float, optional
        Width of a ring [default: `hybrid.element_width_um`].
    scale : float, optional
        In its place: the whole dome, with the rings as designed, times this factor.
    sources : int, optional
        Line sources over the chip [default: 360].
    tolerance : float, optional
        Error of full wave over the largest bin of a source, 1e-10 to 1e-3 [default: 1e-5].
    nodes : float, optional
        Nodes of full wave to a wavelength in the dome [default: those that the tolerance needs].
    memory_gib : float, optional
        Memory for full wave [default: 60 % of what is free].
    paths : int, optional
        Paths of rays and of the hybrid, for each polarisation [default: 2e6].

    Returns
    -------
    FullWave
        Far fields by three models, their distances, and those of the smooth dome of this size.
    """
    options = _options(
        seed,
        None,
        threads,
        rings=rings,
        ring_width_um=ring_width_um,
        scale=scale,
        sources=sources,
        tolerance=tolerance,
        nodes=nodes,
        memory_gib=memory_gib,
        paths=paths,
    )
    name, texts, place = stated(design)
    with _folder(out) as (folder, keep):
        _native.call(["full-wave", name, "--out", str(folder), *options], texts, place)
        return read_full_wave(folder, keep)


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
