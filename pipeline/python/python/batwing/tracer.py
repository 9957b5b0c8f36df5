# SPDX-License-Identifier: MIT OR Apache-2.0
"""Designs of LED packages: traced, varied, optimised, toleranced; and rays as arrays.

A design is the path of a design file (docs/reference/design-file.md), a dict of the same keys, or a
`Design`. Results are those of the command of the same name, to the last bit for the same seed.

Examples
--------
>>> from batwing import tracer
>>> design = tracer.Design.template("my-package")
>>> found = tracer.run(design, model="geometric", paths=20_000, seed=7)
>>> figure = found.model("geometric").figures["extraction_efficiency"]
>>> 0.0 < figure.standard_error < 0.1 < figure.value < 1.0
True
"""

from __future__ import annotations

import contextlib
import copy
import csv
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _progress, _show
from .errors import FileError
from .rcwa import Grating, Material, Polygon, Relief

if TYPE_CHECKING:
    from typing_extensions import TypeAlias

__all__ = [
    "Design",
    "FarField",
    "Figure",
    "Model",
    "Rays",
    "Receiver",
    "Report",
    "Results",
    "load",
    "optimise",
    "read_rays",
    "reproduce",
    "run",
    "study",
    "tolerance",
    "trace_rays",
]

Array = npt.NDArray[np.float64]
PathLike: TypeAlias = "Union[str, os.PathLike[str]]"

_MODELS = ("geometric", "fine", "control", "hybrid", "all")
_RAY_FORMATS = {
    "tm25": ".tm25ray",
    "ray": ".ray",
    "speos-ray": ".ray",
    "zemax-ray": ".sdf",
}


def _toml(path: PathLike) -> dict[str, Any]:
    return _parsed(os.fspath(path), _checks.text(path))


def _parsed(name: str, text: str) -> dict[str, Any]:
    # The standard library reads TOML from Python 3.11 on.
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{name}: expected TOML: {error}", name, str(error), "TOML") from error


@dataclass(frozen=True)
class Design:
    """A design as a dict of the keys of a design file.

    Parameters
    ----------
    data : dict
        Keys and values as in docs/reference/design-file.md.
    folder : path, optional
        Where the files lie that the design names; by itself they need absolute paths.
    """

    data: dict[str, Any]
    folder: str | None = None

    @classmethod
    def read(cls, path: PathLike) -> Design:
        """The design of a file.

        Raises
        ------
        batwing.FileError
            A file that cannot be read or is no TOML.
        """
        return cls(_toml(path), str(Path(path).resolve().parent))

    @classmethod
    def template(cls, name: str = "my-package") -> Design:
        """The design that `batwing new` writes to start from."""
        return cls(_parsed(f"{name}.toml", _native.new_design(name)))

    def with_values(self, values: Mapping[str, Any]) -> Design:
        """A copy with some keys set, such as ``{"led.reflectance": 0.6}``."""
        data = copy.deepcopy(self.data)
        for key, value in values.items():
            *path, last = key.split(".")
            table = data
            for part in path:
                table = table.setdefault(part, {})
                if not isinstance(table, dict):
                    _checks.refuse(key, f"{part} to be a table", _checks.describe(table))
            table[last] = value
        return Design(data, self.folder)

    def to_toml(self) -> str:
        """The text of the design file."""
        return _toml_text(self.data)

    def ring(self, number: int) -> tuple[Grating, float]:
        """The unit cell of one ring of the relief, and the wavelength in micrometres.

        Parameters
        ----------
        number : int
            Ring, from 1, from the axis.

        Returns
        -------
        grating : batwing.rcwa.Grating
            The silicone is on top.
        wavelength_um : float
            Wavelength of the design.

        Raises
        ------
        batwing.InputError
            A ring that the design does not have, or a smooth one.
        """
        with _file_of(self) as path:
            period, depth, around, inner, polygons, wavelength = _native.design_cell(
                path, _checks.whole("number", number, 1, 1_000_000)
            )
        background = Material.constant(around)
        outlines = tuple(
            Polygon(Material.constant(index), np.array(points)) for index, points in polygons
        )
        relief = Relief(period, depth, background, outlines)
        return Grating(relief, Material.constant(inner), background), wavelength

    def check(self) -> None:
        """Checks the design.

        Raises
        ------
        batwing.InputError
            The first key that is wrong, with what was found and what was expected.
        """
        with _file_of(self) as path:
            _native.call(["check", path, "--quiet"])


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    _checks.refuse("design", "numbers, text, lists, dicts and arrays", _checks.describe(value))


def _toml_text(data: Mapping[str, Any]) -> str:
    try:
        text = json.dumps(data, default=_plain, allow_nan=False)
    except ValueError:
        _checks.refuse("design", "finite numbers", "nan or infinity")
    return _native.toml_of_json(text)


DesignLike: TypeAlias = "Union[PathLike, Mapping[str, Any], Design]"


@contextlib.contextmanager
def _file_of(design: DesignLike) -> Iterator[str]:
    """The path of a file that holds the design, for as long as the context lasts."""
    if isinstance(design, (str, os.PathLike)):
        yield os.fspath(design)
        return
    if not isinstance(design, (Mapping, Design)):
        _checks.refuse("design", "a path, a dict or a Design", _checks.describe(design))
    if not isinstance(design, Design):
        design = Design(dict(design))
    text = design.to_toml()
    # Beside the files that it names.
    place = "a temporary folder" if design.folder is None else design.folder
    try:
        handle, path = tempfile.mkstemp(prefix=".batwing-", suffix=".toml", dir=design.folder)
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        why = error.strerror or str(error)
        message = f"{place}: cannot write the design there: {why}"
        raise FileError(message, place, why, "a folder to write to") from error
    try:
        yield path
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)


@dataclass(frozen=True)
class Figure:
    """A figure of merit with its standard error.

    Attributes
    ----------
    value, standard_error : float
        One standard deviation, from leaving out one of 64 groups of paths at a time.
    unit : str
        `1`, `deg`, ...
    more : dict
        Further keys of docs/reference/results-schema.md, such as `published`.
    """

    value: float
    standard_error: float
    unit: str
    more: dict[str, Any]

    def __format__(self, spec: str) -> str:
        return f"{self.value:{spec}} ± {self.standard_error:{spec}}"


@dataclass(frozen=True, eq=False)
class FarField:
    """Azimuthal mean of the intensity.

    Attributes
    ----------
    theta_deg : ndarray
        Middles of the bins.
    intensity, standard_error : ndarray
        Power per steradian, per emitted power.
    """

    theta_deg: Array
    intensity: Array
    standard_error: Array


@dataclass(frozen=True, eq=False)
class Receiver:
    """Bins of a receiver of the design.

    Attributes
    ----------
    values, standard_error : ndarray
        Over the axes that docs/reference/results-schema.md lists.
    about : dict
        Kind, quantity, units and flux.
    """

    values: Array
    standard_error: Array
    about: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Model:
    """What one model of one design gave.

    Attributes
    ----------
    figures : dict of Figure
        Figures of merit.
    ledger : dict of Figure
        Where the emitted power went.
    paths : int
        Paths traced.
    arrays : dict of ndarray
        `far_field` (2, theta, phi), `far_field_mean` (3, theta), `illuminance` (2, y, x), ...: values
        before standard errors.
    receivers : dict of Receiver
        Receivers of the design by name.
    raw : dict
        The object of `results.json`.
    """

    figures: dict[str, Figure]
    ledger: dict[str, Figure]
    paths: int
    arrays: dict[str, Array]
    receivers: dict[str, Receiver]
    raw: dict[str, Any] = field(repr=False)

    def far_field(self) -> FarField | None:
        """The azimuthal mean of the far field, where the model has one."""
        mean = self.arrays.get("far_field_mean")
        return None if mean is None else FarField(mean[0], mean[1], mean[2])


@dataclass(frozen=True, eq=False)
class Results:
    """Results of `run` and `reproduce`.

    Attributes
    ----------
    seed : int
        Seed of all random numbers.
    models : dict of Model
        By (design, model), such as ``("D1", "geometric_100um")``.
    raw : dict
        The whole `results.json`.
    folder : str or None
        Where the files are; None for results of a temporary folder.
    """

    seed: int
    models: dict[tuple[str, str], Model]
    raw: dict[str, Any] = field(repr=False)
    folder: str | None = None
    _files: dict[str, bytes] | None = field(default=None, repr=False)

    def model(self, name: str) -> Model:
        """The one model whose key begins with `name`, such as `geometric` or `hybrid`."""
        found = [model for key, model in self.models.items() if key[1].startswith(name)]
        if len(found) != 1:
            names = ", ".join("/".join(key) for key in self.models)
            _checks.refuse("name", f"the beginning of one model of {names}", name)
        return found[0]

    def save(self, folder: PathLike) -> None:
        """Writes all files into a folder, which `load` and `batwing report` read."""
        target = Path(folder)
        if self._files is None:
            assert self.folder is not None
            shutil.copytree(self.folder, target, dirs_exist_ok=True)
            return
        for name, content in self._files.items():
            path = target / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)

    def to_xarray(self) -> Any:
        """Figures of all models as an `xarray.Dataset`."""
        return _show.results_dataset(self)

    def plot(self, ax: Any = None) -> Any:
        """Mean far field of every model; returns the axes."""
        return _show.results(self, ax)

    def _repr_html_(self) -> str:
        return _show.html(self)


def _figure(entry: Mapping[str, Any], unit: str) -> Figure:
    more = {k: v for k, v in entry.items() if k not in ("value", "standard_error")}
    return Figure(float(entry["value"]), float(entry["standard_error"]), unit, more)


def _estimates(entries: Mapping[str, Any], units: Mapping[str, Any]) -> dict[str, Figure]:
    found = {}
    for name, entry in entries.items():
        if isinstance(entry, dict) and {"value", "standard_error"} <= entry.keys():
            unit = units.get(name, "1")
            found[name] = _figure(entry, unit if isinstance(unit, str) else "1")
    return found


def _model(raw: dict[str, Any], folder: Path, keep: bool) -> Model:
    mode: Any = None if keep else "r"
    arrays = {p.stem: np.load(p, mmap_mode=mode) for p in sorted(folder.glob("*.npy"))}
    units = raw.get("units", {})
    receivers = {}
    for name, about in raw.get("receivers", {}).items():
        files = [folder / file for file in about.get("files", []) if file.endswith(".npy")]
        if files:
            both = np.load(files[0], mmap_mode=mode)
            receivers[name] = Receiver(both[0], both[1], about)
    return Model(
        figures=_estimates(raw, units),
        ledger=_estimates(raw.get("power_ledger", {}), {}),
        paths=int(raw["paths"]),
        arrays=arrays,
        receivers=receivers,
        raw=raw,
    )


def _read(folder: Path, keep: bool) -> Results:
    raw = json.loads(_checks.text(folder / "results.json"))
    models = {}
    for group in ("designs", "references"):
        for design, entries in raw.get(group, {}).items():
            for key, entry in entries.items():
                if isinstance(entry, dict) and "paths" in entry:
                    models[design, key] = _model(entry, folder / design / key, keep)
    files = None
    if keep:
        paths = [path for path in folder.rglob("*") if path.is_file()]
        paths = [path for path in paths if ".batwing-cache" not in path.parts]
        files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    return Results(int(raw["seed"]), models, raw, None if keep else str(folder), files)


def load(folder: PathLike) -> Results:
    """Results of `batwing run` or `batwing reproduce` from their folder. Arrays are mapped, not read.

    Raises
    ------
    batwing.FileError
        A folder without `results.json`.
    """
    return _read(Path(folder), keep=False)


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
    model: str = "all",
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
    design : path, dict or Design
        The design.
    model : {'geometric', 'fine', 'control', 'hybrid', 'all'}
        How to compute it.
    paths : int, optional
        Paths to trace [default: those of the design].
    seed : int
        The same seed gives the same results to the last bit, on any number of threads.
    out : path, optional
        Folder for the files [default: none is left; the results keep them].
    cache : path, optional
        Folder that keeps tables and finished groups of paths for later runs.
    until_error : str, optional
        Trace on until the standard error of a figure is at most this, such as ``"uniformity=0.1%"``.
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
    model = _checks.choice("model", model, _MODELS)
    options = _options(
        seed,
        cache,
        threads,
        model=model,
        paths=paths,
        until_error=until_error,
        most_paths=most_paths,
    )
    with _file_of(design) as path, _folder(out) as (folder, keep):
        _native.call(["run", path, "--out", str(folder), *options])
        return _read(folder, keep)


def reproduce(
    *,
    quick: bool = False,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Results:
    """Computes the paper's tables and figures; arguments as those of `run`.

    Parameters
    ----------
    quick : bool
        Coarser tables and fewer paths.
    """
    options = _options(seed, cache, threads, quick=quick)
    with _folder(out) as (folder, keep):
        _native.call(["reproduce", "--out", str(folder), *options])
        return _read(folder, keep)


@dataclass(frozen=True, eq=False)
class Report:
    """Results of `study`, `optimise` and `tolerance`.

    Attributes
    ----------
    data : dict
        The JSON file of the command.
    tables : dict of dict of ndarray
        Columns of its CSV files; numbers as float64 (NaN where a cell is empty), text as str.
    results : Results or None
        Full results of the designs that `optimise` verified.
    design : Design or None
        The design that `optimise` found.
    folder : str or None
        Where the files are; None for results of a temporary folder.
    """

    data: dict[str, Any] = field(repr=False)
    tables: dict[str, dict[str, npt.NDArray[Any]]] = field(repr=False)
    results: Results | None = None
    design: Design | None = None
    folder: str | None = None


def _columns(path: Path) -> dict[str, npt.NDArray[Any]]:
    with path.open(newline="", encoding="utf-8") as file:
        heading, *rows = list(csv.reader(file))
    columns: dict[str, npt.NDArray[Any]] = {}
    for number, name in enumerate(heading):
        cells = [row[number] for row in rows]
        try:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            columns[name] = np.array(cells)
    return columns


def _report(folder: Path, keep: bool, name: str) -> Report:
    data = json.loads(_checks.text(folder / f"{name}.json"))
    tables = {path.stem: _columns(path) for path in sorted(folder.glob("*.csv"))}
    results = _read(folder, keep) if (folder / "results.json").exists() else None
    design = folder / "design.toml"
    found = None
    if design.exists():
        found = Design(_toml(design)) if keep else Design.read(design)
    return Report(data, tables, results, found, None if keep else str(folder))


def _file_command(
    name: str, file: PathLike, out: PathLike | None, options: list[str]
) -> Report:
    if not isinstance(file, (str, os.PathLike)):
        _checks.refuse("file", "the path of a file", _checks.describe(file))
    with _folder(out) as (folder, keep):
        _native.call([name, os.fspath(file), "--out", str(folder), *options])
        return _report(folder, keep, name)


def study(
    file: PathLike,
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
    file : path
        Study file.
    """
    return _file_command("study", file, out, _options(seed, cache, threads, paths=paths))


def optimise(
    file: PathLike,
    *,
    budget: str | None = None,
    resume: bool = False,
    seed: int = 1,
    out: PathLike | None = None,
    cache: PathLike | None = None,
    threads: int | None = None,
) -> Report:
    """Searches the design that a problem file asks for (docs/guide/optimisation.md).

    Parameters
    ----------
    file : path
        Problem file.
    budget : str, optional
        Time for the search, such as ``"6min"``.
    resume : bool
        Go on with the log in `out`.
    """
    options = _options(seed, cache, threads, budget=budget, resume=resume)
    return _file_command("optimise", file, out, options)


def tolerance(
    file: PathLike,
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
    file : path
        Tolerance file.
    samples : int, optional
        Packages to draw.
    """
    options = _options(seed, cache, threads, samples=samples, paths=paths)
    return _file_command("tolerance", file, out, options)


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of a file or of a trace.

    Attributes
    ----------
    position_mm : ndarray of float32, shape (n, 3)
        Where they start.
    direction : ndarray of float32, shape (n, 3)
        Unit vectors.
    flux : ndarray of float32, shape (n,)
        Power of each ray in `unit`.
    wavelength_nm : ndarray of float32, shape (n,), or float or None
        Wavelength of each, one of all, or none.
    unit : str
        `W` or `lm`.
    """

    position_mm: npt.NDArray[np.float32]
    direction: npt.NDArray[np.float32]
    flux: npt.NDArray[np.float32]
    wavelength_nm: npt.NDArray[np.float32] | float | None = None
    unit: str = "W"

    def write(self, path: PathLike, format: str = "tm25") -> None:
        """Writes a ray file, which sources of designs read (`sources`, docs/reference/design-file.md).

        Parameters
        ----------
        path : path
            File to write.
        format : {'tm25', 'ray', 'speos-ray', 'zemax-ray'}
            Its format; wavelengths of each ray go into Speos and Zemax files alone.

        Raises
        ------
        batwing.InputError
            Arrays of other shapes, values that are not finite, what the format has no place for.
        """
        count = len(np.atleast_1d(self.flux))
        rows = np.full((count, 8), np.nan, dtype=np.float32)
        for key, columns in (("position_mm", slice(0, 3)), ("direction", slice(3, 6))):
            array = _checks.floats(key, getattr(self, key))
            if array.shape != (count, 3):
                _checks.refuse(key, f"shape ({count}, 3)", _checks.describe(array))
            rows[:, columns] = array
        _checks.vectors("direction", self.direction)
        rows[:, 6] = _checks.floats("flux", self.flux)
        one: float | None = None
        if self.wavelength_nm is not None:
            wavelengths = _checks.floats("wavelength_nm", self.wavelength_nm)
            if wavelengths.ndim == 0 or (wavelengths == wavelengths.flat[0]).all():
                one = float(wavelengths.flat[0])
            elif wavelengths.shape == (count,):
                rows[:, 7] = wavelengths
            else:
                expected = f"one number or shape ({count},)"
                _checks.refuse("wavelength_nm", expected, _checks.describe(wavelengths))
        if self.unit != "W":
            _checks.refuse("unit", "W", self.unit)
        _native.write_rays(os.fspath(path), _checks.choice("format", format, list(_RAY_FORMATS)), rows, one)


def read_rays(path: PathLike) -> Rays:
    """Reads a ray file: TM-25, LightTools, Speos or Zemax.

    Raises
    ------
    batwing.InputError
        A file that does not keep to its format.
    """
    rows, radiant, one = _native.read_rays(os.fspath(path))
    own = rows[:, 7] if np.isfinite(rows[:, 7]).any() else None
    wavelength = own if own is not None else one
    return Rays(rows[:, :3], rows[:, 3:6], rows[:, 6], wavelength, "W" if radiant else "lm")


def trace_rays(
    design: DesignLike,
    *,
    model: str = "geometric",
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
    model = _checks.choice("model", model, ("geometric", "hybrid"))
    options = _options(seed, cache, threads, model=model, paths=paths)
    with _file_of(design) as path, tempfile.TemporaryDirectory(prefix="batwing-") as folder:
        target = Path(folder) / "rays.tm25ray"
        _native.call(["export", path, "--format", "tm25", "--out", str(target), *options])
        return read_rays(target)
