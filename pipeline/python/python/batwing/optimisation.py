# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a search found: the design, its figures before and after, and the way there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _show
from .design import Design
from .results import Figure, Files, Results, read_files, read_results

__all__ = [
    "Change",
    "Coefficient",
    "Constraint",
    "FrontDesign",
    "Optimisation",
    "Stage",
    "read_optimisation",
]

Array = npt.NDArray[np.float64]


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True)
class Change:
    """A figure of the design at the beginning and of the design found, both verified.

    Attributes
    ----------
    before : Figure or None
        At the beginning, where it can be judged.
    after : Figure
        Of the design found.
    change : Figure or None
        Their difference, paired by groups of paths.
    """

    before: Figure | None
    after: Figure
    change: Figure | None = None


@dataclass(frozen=True)
class Constraint:
    """A constraint of the problem.

    Attributes
    ----------
    figure : str
        What it bounds.
    at_least, at_most : float or None
        Its bounds.
    margin : float
        Standard errors by which it is to be met.
    value : Figure or None
        Verified value.
    met : bool
        Whether the verified value meets it with the margin.
    """

    figure: str
    at_least: float | None
    at_most: float | None
    margin: float
    value: Figure | None
    met: bool


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a variable.

    Attributes
    ----------
    variable : str
        Key, or profile with the number of the coefficient.
    start, found : float
        At the start of the last stage, and where the search ended; units of the design.
    sensitivity : Figure or None
        Change of the objective for one unit.
    """

    variable: str
    start: float
    found: float
    sensitivity: Figure | None


@dataclass(frozen=True, eq=False)
class Stage:
    """A search and its generations.

    Attributes
    ----------
    model, method : str
        Model of its traces; how candidates are chosen.
    evaluations : int
        Candidates traced or refused.
    cut_short : bool
        Whether the budget of time ended it.
    candidates, paths : ndarray of int, shape (generations,)
        Candidates of each generation, and paths of each of its traces.
    best, standard_error : ndarray, shape (generations,)
        Least objective of each generation; NaN where nothing was traced.
    feasible : ndarray of bool, shape (generations,)
        Whether that candidate meets the constraints.
    """

    model: str
    method: str
    evaluations: int
    cut_short: bool
    candidates: npt.NDArray[np.int64]
    paths: npt.NDArray[np.int64]
    best: Array
    standard_error: Array
    feasible: npt.NDArray[np.bool_]

    __repr__ = _show.brief


@dataclass(frozen=True, eq=False)
class FrontDesign:
    """A design of a Pareto front.

    Attributes
    ----------
    design : Design
        The design.
    coefficients : ndarray
        Coefficients of the variables, in the order of `Optimisation.coefficients`.
    figures : dict of Figure
        The two figures, verified.
    feasible : bool
        Whether it meets the constraints.
    """

    design: Design
    coefficients: Array
    figures: dict[str, Figure]
    feasible: bool

    __repr__ = _show.brief


@dataclass(frozen=True, eq=False, kw_only=True)
class Optimisation(Files):
    """Results of `optimise`.

    Attributes
    ----------
    name : str
        Of the problem and of the design found.
    design : Design
        The design found.
    objective : Change
        What was minimised.
    in_search : float or None
        Best value that the search saw; None where the start was selected.
    bias_of_search : Figure or None
        Objective by fresh paths in the settings of the search, less `in_search`: searches pick what
        noise flatters.
    figures : dict of Change
        All figures of both designs, and the others of objective and constraints.
    constraints : tuple of Constraint
        In the order of the problem.
    coefficients : tuple of Coefficient
        Of the last stage.
    stages : tuple of Stage
        In their order.
    front : tuple of FrontDesign
        The Pareto front by its first figure; empty where none was sought.
    active_limits : tuple of str
        Limits at which the design stands.
    results : Results
        Both designs as of `run`.
    """

    name: str
    design: Design
    objective: Change
    in_search: float | None
    bias_of_search: Figure | None
    figures: dict[str, Change]
    constraints: tuple[Constraint, ...]
    coefficients: tuple[Coefficient, ...]
    stages: tuple[Stage, ...]
    front: tuple[FrontDesign, ...]
    active_limits: tuple[str, ...]
    results: Results

    __repr__ = _show.brief

    def plot(self, ax: Any = None) -> Any:
        """Best objective of every generation beside the verified one; returns the axes."""
        return _show.optimisation(self, ax)

    def _repr_html_(self) -> str:
        return _show.html(self)


def _figure(entry: Mapping[str, Any] | None, key: str = "") -> Figure | None:
    return None if entry is None else Figure.of(entry, key=key)


def _change(entry: Mapping[str, Any], key: str = "") -> Change:
    after = Figure.of(entry["after"], key=key)
    change = _figure(entry.get("change"), key)
    change = None if change is None else replace(change, is_difference=True)
    return Change(_figure(entry["before"], key), after, change)


def _stage(entry: Mapping[str, Any]) -> Stage:
    generations = entry["generations"]

    def column(key: str) -> Array:
        return np.array([np.nan if g[key] is None else g[key] for g in generations], dtype=float)

    return Stage(
        model=entry["model"],
        method=entry["method"],
        evaluations=entry["evaluations"],
        cut_short=entry["cut_short"],
        candidates=column("candidates").astype(np.int64),
        paths=column("paths").astype(np.int64),
        best=column("best"),
        standard_error=column("standard_error"),
        feasible=np.array([g["feasible"] for g in generations], dtype=bool),
    )


def _front(
    entry: Mapping[str, Any] | None, folder: Path, keep: bool
) -> tuple[FrontDesign, ...]:
    if entry is None:
        return ()
    return tuple(
        FrontDesign(
            _design(folder / one["design"], keep),
            np.array(one["coefficients"], dtype=float),
            {k: Figure.of(of, key=k) for k, of in zip(entry["figures"], one["figures"])},
            one["feasible"],
        )
        for one in entry["designs"]
    )


def _design(path: Path, keep: bool) -> Design:
    found = Design.read(path)
    # A temporary folder is gone when the design is used.
    return Design(found.data) if keep else found


def read_optimisation(folder: Path, keep: bool) -> Optimisation:
    """What `optimise` wrote into a folder; `keep` reads all files into memory."""
    files = read_files(folder, keep, "optimise.json")
    raw = files["raw"]
    objective = raw["objective"]
    bounds = ("figure", "at_least", "at_most", "margin", "met")
    ends = ("variable", "start", "found")
    return Optimisation(
        name=raw["name"],
        design=_design(folder / "design.toml", keep),
        objective=_change(objective),
        in_search=objective["in_search"],
        bias_of_search=_figure(objective["bias_of_search"]),
        figures={key: _change(entry, key) for key, entry in raw["figures"].items()},
        constraints=tuple(
            Constraint(value=_figure(one["value"], one["figure"]), **{key: one[key] for key in bounds})
            for one in raw["constraints"]
        ),
        coefficients=tuple(
            Coefficient(sensitivity=_figure(one["sensitivity"]), **{key: one[key] for key in ends})
            for one in raw["coefficients"]
        ),
        stages=tuple(map(_stage, raw["stages"])),
        front=_front(raw["front"], folder, keep),
        active_limits=tuple(raw["active_limits"]),
        results=read_results(folder, keep),
        **files,
    )
