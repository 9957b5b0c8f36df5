from collections.abc import Callable
from typing import final

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_Complexes = npt.NDArray[np.complex128]
_Half = tuple[int, _Floats]
_ComplexHalf = tuple[int, _Complexes]
_Part = tuple[
    bool, bool, list[float], list[float], list[tuple[list[float], list[float], _Floats]]
]
_NamedArray = tuple[str, _Floats, list[tuple[str, str, list[float]]], tuple[str, str] | None]

__all__ = [
    "Interface",
    "Surface",
    "USUAL_RATIOS",
    "VERSION",
    "build_table",
    "call",
    "command",
    "design_cell",
    "design_schema",
    "discard_pending",
    "floating_ridges",
    "free_bytes",
    "ky_nodes",
    "material_indices",
    "new_design",
    "panic",
    "ray_endings",
    "read_rays",
    "run",
    "set_program",
    "set_progress",
    "set_threads",
    "shown_figure",
    "solve_case",
    "threads",
    "toml_of_json",
    "unit_symbol",
    "wait",
    "write_rays",
]

USUAL_RATIOS: tuple[float, float]
VERSION: str

def command(arguments: list[str]) -> int: ...
def call(
    arguments: list[str], texts: dict[str, str] | None = None, folder: str | None = None
) -> None: ...
def run(
    arguments: list[str], texts: dict[str, str] | None = None, folder: str | None = None
) -> tuple[str, list[tuple[str, list[_NamedArray]]]]: ...
def design_schema() -> str: ...
def discard_pending() -> None: ...
def set_program(file: str, words: list[str]) -> None: ...
def new_design(name: str) -> str: ...
def set_threads(threads: int | None) -> None: ...
def threads() -> int: ...
def set_progress(function: Callable[[int, int, bool], None] | None) -> None: ...
def ky_nodes(top: float, bottom: float, count: int) -> list[float]: ...
def toml_of_json(text: str) -> str: ...
def wait(seconds: float, deaf: bool = False, threads: int | None = None) -> None: ...
def free_bytes() -> float: ...
def shown_figure(
    value: float,
    standard_error: float,
    key: str,
    unit: str,
    interval: tuple[float, float] | None,
    upper_bound: float | None,
    peak_place: str | None,
    is_difference: bool = False,
) -> str: ...
def unit_symbol(unit: str) -> str: ...
def ray_endings() -> list[tuple[str, list[str]]]: ...
def panic() -> None: ...
def solve_case(name: str, text: str, threads: int | None) -> str: ...
def floating_ridges(
    period: float,
    depth: float,
    around: tuple[int, int, int],
    polygons: list[tuple[int, str, list[list[float]]]],
) -> tuple[list[str], str] | None: ...
def material_indices(text: str, wavelengths_um: list[float]) -> list[complex]: ...
def read_rays(path: str) -> tuple[npt.NDArray[np.float32], bool, float | None]: ...
def write_rays(
    path: str, format: str, rows: npt.NDArray[np.float32], wavelength_nm: float | None
) -> tuple[int, float]: ...
@final
class Interface:
    def __new__(
        cls,
        period: float,
        depth: float,
        background: complex,
        polygons: list[tuple[complex, list[list[float]]]],
        wavelength: float,
        n_top: complex,
        n_bottom: complex,
    ) -> Interface: ...
    def highest_order(self) -> int: ...
    def is_exact(self) -> bool: ...
    def converge(self, tolerance: float, threads: int | None) -> tuple[int, int, float]: ...
    def solve(
        self,
        top: bool,
        kx: _Floats,
        ky: _Floats,
        azimuth: _Floats,
        orders: int,
        slices: int,
        estimate: bool,
        tolerance: float | None,
        jones: bool,
        threads: int | None,
    ) -> tuple[
        _Half,
        _Half,
        tuple[_ComplexHalf, _ComplexHalf] | None,
        float,
        int,
        tuple[int, int, int, float | None],
        str | None,
    ]: ...
    def hemisphere(
        self,
        kx_per_zone: int,
        ky: _Floats,
        orders: int,
        slices: int,
        threads: int | None,
    ) -> tuple[npt.NDArray[np.bool_], _Floats, _Floats, _Half, _Half, float, int]: ...
    def field(
        self,
        top: bool,
        wavevector: tuple[float, float, float],
        amplitudes: tuple[complex, complex],
        x: _Floats,
        z: _Floats,
        orders: int,
        slices: int,
        threads: int | None,
    ) -> tuple[_Complexes, _Complexes, _Complexes, _Floats, float, float]: ...

@final
class Surface:
    @staticmethod
    def read(
        path: str, indices: tuple[float, float], shifted: bool, inner: bool
    ) -> Surface: ...
    @staticmethod
    def from_cells(parts: list[_Part], indices: tuple[float, float], shifted: bool) -> Surface: ...
    @staticmethod
    def from_bytes(bytes: bytes) -> Surface: ...
    def to_bytes(self) -> bytes: ...
    def header(self) -> str | None: ...
    def indices(self) -> list[float]: ...
    def lobes(
        self, wi: _Floats, threads: int | None
    ) -> tuple[
        npt.NDArray[np.int64],
        _Floats,
        _Floats,
        npt.NDArray[np.int32],
        npt.NDArray[np.bool_],
    ]: ...
    def albedo(self, wi: _Floats, threads: int | None) -> _Floats: ...
    def sample(
        self, wi: _Floats, seed: int, threads: int | None
    ) -> tuple[_Floats, _Floats, npt.NDArray[np.int32], npt.NDArray[np.bool_]]: ...
    def write(
        self,
        path: str,
        format: str,
        incidence_deg: float,
        azimuth_deg: float,
        scatter_deg: float,
        samples: int,
        tree_log2: int,
        wavelength_nm: float | None,
        threads: int | None,
    ) -> list[tuple[str, str]]: ...

def build_table(
    interface: Interface,
    tolerance: float,
    resolution: tuple[int, int] | None,
    kx_per_zone: int | None,
    ky: _Floats | None,
    threads: int | None,
) -> Surface: ...
def design_cell(
    name: str, text: str, folder: str, ring: int
) -> tuple[float, float, float, float, list[tuple[float, list[list[float]]]], float]: ...
