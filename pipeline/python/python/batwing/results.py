# SPDX-License-Identifier: MIT OR Apache-2.0
"""Results of commands: figures with standard errors, arrays, and the files that hold them."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _checks, _native, _show
from .design import PathLike
from .errors import FileError
from .figure import Figure

__all__ = [
    "Axis",
    "Comparison",
    "FarField",
    "Figure",
    "Files",
    "Map",
    "Model",
    "Orders",
    "Receiver",
    "Report",
    "Reproduction",
    "Results",
    "Zones",
    "in_memory",
    "load",
    "read_files",
    "read_report",
    "read_reproduction",
    "read_results",
    "read_zones",
]

Array = npt.NDArray[np.float64]

#: Bytes of an image among which its attributes stand.
HEAD_BYTES = 1 << 20


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis of bins.

    Attributes
    ----------
    name, unit : str
        Such as `theta` in `deg`, `x` in `mm`.
    edges : ndarray
        Edges of the bins, one more than there are bins.
    """

    name: str
    unit: str
    edges: Array

    __repr__ = _show.brief

    @property
    def middles(self) -> Array:
        """Middles of the bins."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))


@dataclass(frozen=True, eq=False)
class Map:
    """A quantity over the bins of axes.

    Attributes
    ----------
    values, standard_error : ndarray
        Over the axes in their order; with Stokes parameters I, Q, U, V before them.
    axes : tuple of Axis
        Axes of the arrays; none of the six bins of a surface.
    quantity, unit : str
        Such as `irradiance` in `W/mm²`.
    """

    values: Array
    standard_error: Array
    axes: tuple[Axis, ...]
    quantity: str
    unit: str

    __repr__ = _show.brief

    def to_xarray(self) -> Any:
        """Values and errors as an `xarray.Dataset` over the middles of the bins."""
        return _show.map_dataset(self)


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

    __repr__ = _show.brief

    def to_xarray(self) -> Any:
        """Intensity and error as an `xarray.Dataset` over theta."""
        values = {"intensity": self.intensity, "standard_error": self.standard_error}
        return _show.curve_dataset("theta", self.theta_deg, "degree", values, "1/sr")


@dataclass(frozen=True, eq=False)
class Receiver(Map):
    """Bins of a receiver of the design.

    Attributes
    ----------
    figures : dict of Figure
        Flux, mean and extremes of the bins, their ratio; of a surface its six fluxes.
    about : dict
        Its entry in `results.json`.
    xyz : ndarray or None
        (9, ...): X, Y and Z (CIE 1931) of the bins, then the covariances XX, XY, XZ, YY, YZ and ZZ of
        their errors; None in light of one wavelength.
    """

    figures: dict[str, Figure]
    about: dict[str, Any] = field(repr=False)
    xyz: Array | None = field(default=None, repr=False)

    __repr__ = _show.brief


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
    maps : dict of Map
        `far_field` over theta and phi, `illuminance` over y and x.
    arrays : dict of ndarray
        `far_field` (2, theta, phi), `far_field_mean` (3, theta), `illuminance` (2, y, x), ...: values
        before standard errors.
    receivers : dict of Receiver
        Receivers of the design by name.
    raw : dict
        The object of `results.json`.
    colours : dict of ndarray
        `illuminance` (9, y, x) and `far_field` (9, theta, phi): X, Y and Z (CIE 1931), then the
        covariances XX, XY, XZ, YY, YZ and ZZ of their errors. Empty in light of one wavelength.
    """

    figures: dict[str, Figure]
    ledger: dict[str, Figure]
    paths: int
    maps: dict[str, Map]
    arrays: dict[str, Array]
    receivers: dict[str, Receiver]
    raw: dict[str, Any] = field(repr=False)
    colours: dict[str, Array] = field(default_factory=dict, repr=False)

    __repr__ = _show.brief

    def far_field(self) -> FarField | None:
        """The azimuthal mean of the far field, where the model has one."""
        mean = self.arrays.get("far_field_mean")
        return None if mean is None else FarField(mean[0], mean[1], mean[2])


def _estimates(
    entries: Mapping[str, Any], units: Mapping[str, Any], otherwise: str = "1"
) -> dict[str, Figure]:
    found = {}
    for name, entry in entries.items():
        if isinstance(entry, dict) and {"value", "standard_error"} <= entry.keys():
            found[name] = Figure.of(entry, units.get(name, otherwise), name)
    return found


def _axis(entry: Mapping[str, Any]) -> Axis:
    # Files of receivers call the name of an axis its quantity.
    name = entry["name"] if "name" in entry else entry["quantity"]
    return Axis(name, entry["unit"], np.array(entry["edges"], dtype=float))


def _map(image: Path, both: Array) -> Map | None:
    """A map with the axes that its image states in the text attribute `batwing`."""
    head = image.read_bytes()[:HEAD_BYTES] if image.exists() else b""
    before, found, rest = head.partition(b"batwing\0string\0")
    if not found:
        return None
    size = int.from_bytes(rest[:4], "little")
    about = json.loads(rest[4 : 4 + size])
    axes = _axis(about["rows"]), _axis(about["columns"])
    unit = _native.unit_symbol(about["unit"])
    return Map(both[0], both[1], axes, about["quantity"], unit)


def _units_of_bins(unit: str) -> dict[str, str]:
    """Units of the figures of a receiver whose bins have this one."""
    of_bins = dict.fromkeys(("mean", "min", "max"), unit)
    ratios = dict.fromkeys(("min_to_max", "nine_points", "thirteen_points"), "W/W")
    return {**of_bins, **ratios, **dict.fromkeys(("u_prime", "v_prime", "duv"), "1"), "cct_k": "k"}


def _receiver(
    both: Array, axes: tuple[Axis, ...], about: dict[str, Any], xyz: Array | None
) -> Receiver:
    units = _units_of_bins(about["unit"])
    figures = _estimates(about, units, about.get("flux_unit", about["unit"]))
    return Receiver(both[0], both[1], axes, about["quantity"], about["unit"], figures, about, xyz)


#: Folder of the arrays of colours, in that of a model.
_COLOUR = "colour"


def _receiver_of_files(about: dict[str, Any], folder: Path, mode: Any) -> Receiver | None:
    listed = [Path(file) for file in about.get("files", [])]
    files = {file.suffix: folder / file for file in listed if file.parts[0] != _COLOUR}
    if ".npy" not in files:
        return None
    both = np.load(files[".npy"], mmap_mode=mode)
    axes: tuple[Axis, ...] = ()
    if ".json" in files:
        axes = tuple(map(_axis, json.loads(_checks.text(files[".json"]))["axes"]))
    of_colours = [file for file in listed if file.parts[0] == _COLOUR and file.suffix == ".npy"]
    xyz = np.load(folder / of_colours[0], mmap_mode=mode) if of_colours else None
    return _receiver(both, axes, about, xyz)


def _model(
    raw: dict[str, Any],
    arrays: dict[str, Array],
    maps: Mapping[str, Map | None],
    receivers: Mapping[str, Receiver | None],
    colours: dict[str, Array],
) -> Model:
    units = raw.get("units", {})
    return Model(
        figures=_estimates(raw, units),
        ledger=_estimates(raw.get("power_ledger", {}), {}, units.get("power_ledger", "W/W")),
        paths=int(raw["paths"]),
        maps={name: one for name, one in maps.items() if one is not None},
        arrays=arrays,
        receivers={name: one for name, one in receivers.items() if one is not None},
        raw=raw,
        colours=colours,
    )


def _model_of_files(raw: dict[str, Any], folder: Path, keep: bool) -> Model:
    mode: Any = None if keep else "r"
    arrays = {p.stem: np.load(p, mmap_mode=mode) for p in sorted(folder.glob("*.npy"))}
    maps = {name: _map(folder / f"{name}.exr", both) for name, both in arrays.items()}
    entries = raw.get("receivers", {}).items()
    receivers = {name: _receiver_of_files(about, folder, mode) for name, about in entries}
    of_colours = sorted((folder / _COLOUR).glob("*.npy"))
    colours = {path.stem: np.load(path, mmap_mode=mode) for path in of_colours}
    return _model(raw, arrays, maps, receivers, colours)


#: Folder of the arrays of receivers, in that of a model and in that of colours.
_OF_RECEIVERS = "receivers/"


def _model_in_memory(raw: dict[str, Any], named: list[_native._NamedArray]) -> Model:
    arrays: dict[str, Array] = {}
    maps: dict[str, Map | None] = {}
    receivers: dict[str, Receiver | None] = {}
    of_colours = f"{_COLOUR}/"
    colours = {
        name.removeprefix(of_colours): xyz for name, xyz, *_ in named if name.startswith(of_colours)
    }
    for name, both, edges, about in named:
        if name.startswith(of_colours):
            continue
        axes = tuple(Axis(axis, unit, np.array(ends)) for axis, unit, ends in edges)
        if name.startswith(_OF_RECEIVERS):
            name = name.removeprefix(_OF_RECEIVERS)
            xyz = colours.pop(_OF_RECEIVERS + name, None)
            receivers[name] = _receiver(both, axes, raw["receivers"][name], xyz)
            continue
        arrays[name] = both
        if about is not None:
            maps[name] = Map(both[0], both[1], axes, *about)
    return _model(raw, arrays, maps, receivers, colours)


@dataclass(frozen=True, eq=False, kw_only=True)
class Files:
    """The JSON file of a command, and the files beside it.

    Attributes
    ----------
    raw : dict
        The JSON file.
    seed : int
        Seed of all random numbers.
    folder : str or None
        Where the files are; None of results in memory.
    """

    raw: dict[str, Any] = field(repr=False)
    seed: int
    folder: str | None = None
    _name: str = field(repr=False)
    _files: dict[str, bytes] | None = field(default=None, repr=False)
    _command: tuple[list[str], dict[str, str], str | None] | None = field(default=None, repr=False)

    __repr__ = _show.brief

    def save(self, folder: PathLike) -> None:
        """Writes all files into a folder, which `load` and `batwing report` read.

        Results that `run` left in memory are traced again for that, with the same seed and to the
        same bits; `out` of `run` writes while it traces.

        Raises
        ------
        batwing.FileError
            A design, or a file that it names, that has changed since.
        """
        target = Path(folder)
        if self._command is not None:
            words, texts, place = self._command
            for entry in self.raw["inputs"]:
                if entry["file"] not in texts:
                    self._compare(entry["file"], self._content(entry["file"]), entry["sha256"])
            _native.call([*words, "--out", os.fspath(target)], texts, place)
            return
        if self._files is None:
            assert self.folder is not None
            shutil.copytree(self.folder, target, dirs_exist_ok=True)
            return
        for name, content in self._files.items():
            path = target / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)

    def verify(self) -> None:
        """Checks by their SHA-256 that all files, if there are any, are as they were written.

        Raises
        ------
        batwing.FileError
            A file that is missing or altered; the first one.
        """
        if self._command is not None:
            return
        # The hash of the JSON file is that of its text without the hash itself.
        text = self._content(self._name).rstrip()
        text = re.sub(rb'("content_sha256"\s*:\s*")[^"]*', rb"\1", text, count=1)
        self._compare(self._name, text, self.raw["content_sha256"])
        for entry in self.raw["files"]:
            self._compare(entry["file"], self._content(entry["file"]), entry["sha256"])

    def _content(self, name: str) -> bytes:
        if self._files is not None and name in self._files:
            return self._files[name]
        path = Path(self.folder or "", name)
        try:
            return path.read_bytes()
        except OSError as error:
            why = error.strerror or str(error)
            raise FileError(f"{path}: cannot read it: {why}", str(path), why, "a file") from error

    def _compare(self, name: str, content: bytes, expected: str) -> None:
        got = hashlib.sha256(content).hexdigest()
        if got != expected:
            path = str(Path(self.folder or "", name))
            message = f"{path}: expected the SHA-256 {expected} of {self._name}, got {got}"
            raise FileError(message, path, got, expected)


def read_files(folder: Path, keep: bool, name: str) -> dict[str, Any]:
    """Fields of `Files`, of the folder that a command wrote; `keep` reads all files into memory."""
    raw = json.loads(_checks.text(folder / name))
    files = None
    if keep:
        paths = [path for path in folder.rglob("*") if path.is_file()]
        paths = [path for path in paths if ".batwing-cache" not in path.parts]
        files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(paths)}
    seed, place = int(raw["seed"]), None if keep else str(folder)
    return {"raw": raw, "seed": seed, "folder": place, "_name": name, "_files": files}


@dataclass(frozen=True)
class Comparison:
    """A figure beside the published one.

    Attributes
    ----------
    design, model, figure : str
        Its place in the results.
    computed : Figure
        With the standard error of the trace.
    published : float
        The published value.
    """

    design: str
    model: str
    figure: str
    computed: Figure
    published: float

    @property
    def difference(self) -> float:
        """Computed less published."""
        return self.computed.value - self.published


@dataclass(frozen=True, eq=False, kw_only=True)
class Results(Files):
    """Results of `run` and `reproduce`: `results.json` and what lies beside it.

    Attributes
    ----------
    models : dict of Model
        By (design, model), such as ``("D1", "geometric_100um")``.
    """

    models: dict[tuple[str, str], Model]

    __repr__ = _show.brief

    def model(self, name: str) -> Model:
        """The one model whose key begins with `name`, such as `geometric` or `hybrid`."""
        found = [model for key, model in self.models.items() if key[1].startswith(name)]
        if len(found) != 1:
            names = ", ".join("/".join(key) for key in self.models)
            _checks.refuse("name", f"the beginning of one model of {names}", name)
        return found[0]

    def comparisons(self) -> tuple[Comparison, ...]:
        """Every figure that the paper gives, in the order of `models`."""
        return tuple(
            Comparison(design, model, name, figure, float(figure.more["published"]))
            for (design, model), entry in self.models.items()
            for name, figure in entry.figures.items()
            if "published" in figure.more
        )

    def to_xarray(self) -> Any:
        """Figures of all models as an `xarray.Dataset`."""
        return _show.results_dataset(self)

    def plot(self, ax: Any = None) -> Any:
        """Mean far field of every model; returns the axes."""
        return _show.results(self, ax)

    def _repr_html_(self) -> str:
        return _show.html(self)


@dataclass(frozen=True, eq=False)
class Orders:
    """Orders of a table at normal incidence, and single directions of ray optics.

    Attributes
    ----------
    ring, band : int
        The ring whose unit cell is solved, and its band.
    rcwa, rays : dict of ndarray
        Columns `side` (`reflected`, `transmitted`), `theta_deg` and `share`; `rcwa` has `order` too.
    """

    ring: int
    band: int
    rcwa: dict[str, npt.NDArray[Any]]
    rays: dict[str, npt.NDArray[Any]]

    __repr__ = _show.brief


@dataclass(frozen=True, eq=False, kw_only=True)
class Reproduction(Results):
    """Results of `reproduce`.

    Attributes
    ----------
    quick : bool
        Whether tables were coarser and paths fewer.
    figure_3, figure_4 : dict of FarField
        Light of single elements of the paper's figures 3 and 4, by their labels.
    figure_6 : Orders or None
        Orders of one unit cell, the paper's figure 6.
    """

    quick: bool
    figure_3: dict[str, FarField]
    figure_4: dict[str, FarField]
    figure_6: Orders | None

    __repr__ = _show.brief


def _curves(raw: Mapping[str, Any], name: str) -> dict[str, FarField]:
    curves = raw["figures"].get(name, {}).get("curves", [])
    keys = ("theta_deg", "intensity_w_per_sr", "standard_error_w_per_sr")
    return {one["label"]: FarField(*(np.array(one[key]) for key in keys)) for one in curves}


def _orders(raw: Mapping[str, Any]) -> Orders | None:
    entry = raw["figures"].get("figure_6")
    if entry is None:
        return None

    def columns(rows: list[dict[str, Any]]) -> dict[str, npt.NDArray[Any]]:
        return {key: np.array([row[key] for row in rows]) for key in (rows[0] if rows else ())}

    return Orders(entry["ring"], entry["band"], columns(entry["rcwa"]), columns(entry["rays"]))


def read_results(folder: Path, keep: bool) -> Results:
    """What `run` wrote into a folder; `keep` reads all files into memory."""
    files = read_files(folder, keep, "results.json")
    return Results(models=_models(files["raw"], folder, keep), **files)


def read_reproduction(folder: Path, keep: bool) -> Reproduction:
    """What `reproduce` wrote into a folder; `keep` reads all files into memory."""
    files = read_files(folder, keep, "results.json")
    raw = files["raw"]
    return Reproduction(
        models=_models(raw, folder, keep),
        quick=bool(raw["quick"]),
        figure_3=_curves(raw, "figure_3"),
        figure_4=_curves(raw, "figure_4"),
        figure_6=_orders(raw),
        **files,
    )


def _models(raw: Mapping[str, Any], folder: Path, keep: bool) -> dict[tuple[str, str], Model]:
    models = {}
    for group in ("designs", "references"):
        for design, entries in raw.get(group, {}).items():
            for key, entry in entries.items():
                if isinstance(entry, dict) and "paths" in entry:
                    models[design, key] = _model_of_files(entry, folder / design / key, keep)
    return models


def in_memory(words: list[str], texts: dict[str, str], folder: str | None) -> Results:
    """Results of a command line of `run` without files."""
    text, found = _native.run(words, texts, folder)
    raw, arrays = json.loads(text), dict(found)
    models = {
        (design, key): _model_in_memory(entry, arrays[key])
        for design, entries in raw["designs"].items()
        for key, entry in entries.items()
    }
    command = words, texts, folder
    return Results(
        models=models, raw=raw, seed=int(raw["seed"]), _name="results.json", _command=command
    )


def load(folder: PathLike) -> Results:
    """Results of `batwing run` or `batwing reproduce` from their folder. Arrays are mapped, not read.

    Returns
    -------
    Results
        A `Reproduction` where `reproduce` wrote them.

    Raises
    ------
    batwing.FileError
        A folder without `results.json`.
    """
    path = Path(folder)
    if (path / "summary.md").exists():
        return read_reproduction(path, keep=False)
    return read_results(path, keep=False)


@dataclass(frozen=True, eq=False, kw_only=True)
class Report(Files):
    """Results of `study` and `tolerance`.

    Attributes
    ----------
    tables : dict of dict of ndarray
        Columns of its CSV files; numbers as float64 (NaN where a cell is empty), text as str.
    """

    tables: dict[str, dict[str, npt.NDArray[Any]]]

    __repr__ = _show.brief

    def to_xarray(self, table: str) -> Any:
        """The columns of a table as an `xarray.Dataset` over its rows."""
        table = _checks.choice("table", table, sorted(self.tables))
        return _show.table_dataset(self.tables[table])


@dataclass(frozen=True, eq=False, kw_only=True)
class Zones(Report):
    """Results of `zones`.

    Attributes
    ----------
    figures : dict of Figure
        At full drive `white`, the mean over the panel, and `min`, `max`, `min_to_max`, ... of its bins;
        of what the panel shows `halo_black`, `halo_bright` and `halo_contrast`, where black lies
        beside bright.
    radii_mm : dict of Figure
        Where the light of one zone falls to a share, such as 0.5, of its largest ring; None where the
        rings do not tell.
    maps : dict of Map
        `backlight`, and `panel` behind the panel, over y and x.
    xyz : dict of ndarray
        X, Y and Z of both, shape (3, y, x), in the unit of the maps; of designs with channels or a
        panel of sub-pixels.
    """

    figures: dict[str, Figure]
    radii_mm: dict[float, Figure | None]
    maps: dict[str, Map]
    xyz: dict[str, Array]

    __repr__ = _show.brief


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


def _written(folder: Path, raw: dict[str, Any], suffix: str) -> list[Path]:
    """The files of this ending beside the results; where these list files, no others."""
    listed = {one["file"] for one in raw.get("files", [])}
    return [
        path for path in sorted(folder.glob(f"*{suffix}")) if not listed or path.name in listed
    ]


def read_report(folder: Path, keep: bool, name: str) -> Report:
    """What `study` or `tolerance` wrote into a folder; `keep` reads all files into memory."""
    files = read_files(folder, keep, f"{name}.json")
    tables = {path.stem: _columns(path) for path in _written(folder, files["raw"], ".csv")}
    return Report(tables=tables, **files)


def read_zones(folder: Path, keep: bool) -> Zones:
    """What `zones` wrote into a folder; `keep` reads all files into memory."""
    report = read_report(folder, keep, "zones")
    raw, unit = report.raw, report.raw["unit"]
    halo = {f"halo_{key}": entry for key, entry in (raw["halo"] or {}).items()}
    units = {**_units_of_bins(unit), "white": unit, "halo_black": unit, "halo_bright": unit}
    arrays = {path.stem: np.load(path) for path in _written(folder, raw, ".npy")}
    xyz = {name[:-4]: array for name, array in arrays.items() if name.endswith("_xyz")}
    maps = {name: _map(folder / f"{name}.exr", array) for name, array in arrays.items()}
    radii = raw["light_spread"]["radii"]
    return Zones(
        **{one.name: getattr(report, one.name) for one in fields(report)},
        figures=_estimates({"white": raw["white"], **raw["uniformity"], **halo}, units),
        radii_mm={
            one["share"]: one["radius_mm"] and Figure.of(one["radius_mm"], "mm") for one in radii
        },
        maps={name: one for name, one in maps.items() if one is not None},
        xyz=xyz,
    )
