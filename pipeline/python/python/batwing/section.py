# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section of a dome by rays, hybrid and Maxwell's equations, and how far they lie apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _show
from .figure import Figure
from .results import Files, read_files

__all__ = ["Distance", "FullWave", "Section", "SectionFarField", "read_full_wave"]

Array = npt.NDArray[np.float64]


def __dir__() -> list[str]:
    return sorted(__all__)


@dataclass(frozen=True, eq=False)
class SectionFarField:
    """Far field of a section, mean of both polarisations.

    Attributes
    ----------
    theta_deg : ndarray
        Middles of the bins, -90 to 90 degrees.
    share, standard_error : ndarray
        Share of the emitted power in each bin.
    missing : float
        Power that is in no bin.
    peak_deg : (float, float) or None
        Ends of the peak on either side, in bins of 5 degrees; None where more light is missing than
        the error.
    centre_to_peak : Figure or None
        Bins beside the axis over the largest.
    """

    theta_deg: Array
    share: Array
    standard_error: Array
    missing: float
    peak_deg: tuple[float, float] | None
    centre_to_peak: Figure | None

    __repr__ = _show.brief

    def to_xarray(self) -> Any:
        """Shares and errors as an `xarray.Dataset` over theta."""
        values = {"share": self.share, "standard_error": self.standard_error}
        return _show.curve_dataset("theta", self.theta_deg, "degree", values, "1")


@dataclass(frozen=True)
class Distance:
    """Distance of a model from full wave in bins of one width, over full wave's largest bin.

    Attributes
    ----------
    rms, largest, l1 : float
        Root mean square and largest of the differences; sum of the absolute ones, of shares.
    noise : float
        A root mean square of this size is noise.
    square : Figure
        Mean square without the noise.
    """

    rms: float
    largest: float
    l1: float
    noise: float
    square: Figure


@dataclass(frozen=True, eq=False)
class Section:
    """Models of one section.

    Attributes
    ----------
    rings : int
        Rings from the axis to the rim.
    radius_um : float
        Radius of the section.
    unknowns : int
        Those of a matrix of full wave.
    balance : float
        Largest difference of emitted and radiated power of a source in full wave, per emitted power.
    far_fields : dict of SectionFarField
        By model: `full_wave`, `hybrid`, `rays`.
    distances : dict of Distance
        By model and width of the bins in degrees.
    """

    rings: int
    radius_um: float
    unknowns: int
    balance: float
    far_fields: dict[str, SectionFarField]
    distances: dict[tuple[str, float], Distance]

    __repr__ = _show.brief


@dataclass(frozen=True, eq=False, kw_only=True)
class FullWave(Files):
    """Results of `full_wave`.

    Attributes
    ----------
    verdict : str
        How far hybrid and rays lie from full wave, as a sentence.
    comparison : Section
        The dome of the design.
    baseline : Section or None
        The smooth dome of this size; None where the design is smooth itself.
    """

    verdict: str
    comparison: Section
    baseline: Section | None

    __repr__ = _show.brief


def _far_field(entry: Mapping[str, Any], bin_deg: float) -> SectionFarField:
    share, error = np.array(entry["bins"]), np.array(entry["errors"])
    figures = entry["figures"]
    return SectionFarField(
        theta_deg=np.asarray(-90.0 + bin_deg * (np.arange(share.size) + 0.5), dtype=np.float64),
        share=share,
        standard_error=error,
        missing=entry["missing"],
        peak_deg=None if figures is None else tuple(figures["peak_deg"]),
        centre_to_peak=None
        if figures is None
        else Figure(figures["centre_to_peak"], figures["centre_to_peak_error"], key="centre_to_peak"),
    )


def _section(entry: Mapping[str, Any], bin_deg: float) -> Section:
    numbers = ("rms", "largest", "l1", "noise")
    return Section(
        **{key: entry[key] for key in ("rings", "radius_um", "unknowns", "balance")},
        far_fields={one["model"]: _far_field(one, bin_deg) for one in entry["far_fields"]},
        distances={
            (one["model"], one["bin_deg"]): Distance(
                **{key: one[key] for key in numbers},
                square=Figure(one["square"], one["square_error"]),
            )
            for one in entry["distances"]
        },
    )


def read_full_wave(folder: Path, keep: bool) -> FullWave:
    """What `full-wave` wrote into a folder; `keep` reads all files into memory."""
    files = read_files(folder, keep, "full_wave.json")
    raw = files["raw"]
    baseline = raw["baseline"]
    return FullWave(
        verdict=raw["verdict"],
        comparison=_section(raw["comparison"], raw["bin_deg"]),
        baseline=None if baseline is None else _section(baseline, raw["bin_deg"]),
        **files,
    )
