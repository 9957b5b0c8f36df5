# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures and tables of results, with matplotlib and xarray where they are installed."""

from __future__ import annotations

import base64
import html as escapes
import io
import os
import sys
import warnings
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import DesignWarning

if TYPE_CHECKING:
    from .bsdf import Table
    from .optimisation import Optimisation
    from .rcwa import Hemisphere, Jones, NearField, Relief, Solution
    from .results import Map, Results

#: Size of what `repr` gives: a part of a screen.
LINES, COLUMNS = 24, 100


def warn(message: str, category: type[Warning] = UserWarning) -> None:
    """A warning of the program, at the line that called the package."""
    own = os.path.dirname(__file__)
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and (
        os.path.dirname(frame.f_code.co_filename) == own
        or os.path.basename(frame.f_code.co_filename) == "contextlib.py"
    ):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)


def warn_of_design(messages: list[str]) -> None:
    """Warnings on a design or a table."""
    for message in messages:
        warn(message, DesignWarning)


def _xarray() -> Any:
    try:
        import xarray
    except ImportError as error:
        raise ImportError("to_xarray() needs the package xarray: pip install xarray") from error
    return xarray


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("plot() needs the package matplotlib: pip install matplotlib") from error
    import sys

    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        return pyplot.subplots(layout="constrained")[1]
    return Figure(figsize=(5.0, 3.2), layout="constrained").add_subplot()


def _fields(result: Any) -> list[tuple[str, str]]:
    """Names of the fields that are shown, each with its value in a line."""
    found = []
    for name, one in result.__dataclass_fields__.items():
        if name.startswith("_") or not one.repr:
            continue
        value = getattr(result, name)
        if isinstance(value, np.ndarray):
            text = f"{value:.6g}" if value.ndim == 0 else f"{value.dtype} {value.shape}"
        elif isinstance(value, dict):
            text = ", ".join("/".join(map(str, k)) if isinstance(k, tuple) else str(k) for k in value)
        elif isinstance(value, tuple) and value and hasattr(value[0], "__dataclass_fields__"):
            text = f"{len(value)} of {type(value[0]).__name__}"
        else:
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
        found.append((name, text))
    return found


def _figures(result: Any) -> list[tuple[str, str]]:
    """Figures in the fields of a result, the forms of uniformity last."""
    models = getattr(result, "models", {(): result})
    found = [
        (name, f"{'/'.join(key)} {name}" if len(models) > 1 else name, figure)
        for key, model in models.items()
        for name, figure in getattr(model, "figures", {}).items()
    ]
    found.sort(key=lambda one: one[0].startswith(("cell_", "diagonal_", "segment_")))
    return [(label, str(getattr(figure, "after", figure))) for _, label, figure in found]


def brief(result: Any) -> str:
    """Fields and figures of a result on less than a screen."""
    lines = [type(result).__name__]
    for name, text in _fields(result) + _figures(result):
        first, *rest = text.splitlines() or [""]
        lines += [f"  {name}: {first}", *(f"    {line}" for line in rest)]
    if len(lines) > LINES:
        lines[LINES - 1 :] = [f"  ... and {len(lines) - LINES + 1} lines more"]
    cut = (one if len(one) <= COLUMNS else one[: COLUMNS - 3] + "..." for one in lines)
    return "\n".join(cut)


def html(result: Any) -> str:
    """Its fields as a table, and its picture where matplotlib is installed."""
    rows = []
    for name, text in _fields(result) + _figures(result):
        cells = f"<td><code>{escapes.escape(name)}</code></td><td>{escapes.escape(text)}</td>"
        rows.append(f"<tr>{cells}</tr>")
    table = f"<b>batwing.{type(result).__name__}</b><table>{''.join(rows)}</table>"
    picture = _png(result)
    return table if picture is None else f'{table}<img src="data:image/png;base64,{picture}">'


def _png(result: Any) -> str | None:
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return None
    figure = Figure(figsize=(5.0, 3.2), layout="constrained")
    result.plot(figure.add_subplot())
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=90)
    return base64.b64encode(buffer.getvalue()).decode()


def relief(value: Relief, ax: Any) -> Any:
    """Polygons of three periods."""
    ax = _axes(ax)
    for period in range(3):
        for number, polygon in enumerate(value.polygons):
            x, z = polygon.points_um.T
            ax.fill(x + period * value.period_um, z, f"C{number}", alpha=0.6)
    ax.set(xlabel="x (µm)", ylabel="z (µm)", aspect="equal")
    ax.invert_yaxis()
    return ax


def solution(value: Solution, ax: Any) -> Any:
    """Efficiencies of one direction over the order, of many over their number."""
    ax = _axes(ax)
    if value.reflected.ndim == 1:
        for number, name in enumerate(("transmitted", "reflected")):
            orders, power = getattr(value, f"orders_{name}"), getattr(value, name)
            style = {"linefmt": f"C{number}-", "markerfmt": f"C{number}o", "basefmt": " "}
            ax.stem(orders, power, label=name, **style)
        ax.set(xlabel="order", ylabel="efficiency")
    else:
        single = value.theta_deg.ndim == 1 and value.reflected.ndim == 2
        label, x = "direction", np.arange(value.total_reflected.size, dtype=float)
        if single and np.ptp(value.theta_deg) > 0:
            label, x = "theta (°)", value.theta_deg
        elif single and np.ndim(value.wavelength_um) == 1:
            label, x = "wavelength (µm)", np.asarray(value.wavelength_um)
        ax.plot(x, np.ravel(value.total_transmitted), label="transmitted")
        ax.plot(x, np.ravel(value.total_reflected), label="reflected")
        ax.set(xlabel=label, ylabel="share of the power")
    ax.legend()
    return ax


def hemisphere(value: Hemisphere, ax: Any) -> Any:
    """Share transmitted from the top, unpolarised."""
    ax = _axes(ax)
    top = value.from_top
    shown = value.to_bottom[top].sum(axis=-1).mean(axis=-1)
    points = ax.scatter(value.kx[top], value.ky[top], c=shown, s=6, vmin=0, vmax=1)
    ax.figure.colorbar(points, ax=ax, label="transmitted from the top")
    ax.set(xlabel="kx (2π/λ)", ylabel="ky (2π/λ)", aspect="equal")
    return ax


def near_field(value: NearField, ax: Any) -> Any:
    """The intensity."""
    ax = _axes(ax)
    image = ax.pcolormesh(value.x_um, value.z_um, value.intensity, shading="nearest")
    ax.figure.colorbar(image, ax=ax, label="|E|² per incident")
    ax.set(xlabel="x (µm)", ylabel="z (µm)", aspect="equal")
    ax.invert_yaxis()
    return ax


def table(value: Table, ax: Any) -> Any:
    """Albedo over the angle, unpolarised, from both sides."""
    ax = _axes(ax)
    theta = np.linspace(0.0, 89.0, 90)
    for name, sign in (("inner", -1.0), ("outer", 1.0)):
        wi = np.stack([np.sin(np.radians(theta)), 0 * theta, sign * np.cos(np.radians(theta))], 1)
        found = value.albedo(wi)
        ax.plot(theta, found.transmitted.mean(axis=-1), label=f"transmitted from {name}")
        ax.plot(theta, found.reflected.mean(axis=-1), "--", label=f"reflected from {name}")
    ax.set(xlabel="theta (°)", ylabel="share of the power")
    ax.legend()
    return ax


def results(value: Results, ax: Any) -> Any:
    """Mean far field of every model with its standard error."""
    ax = _axes(ax)
    for key, model in value.models.items():
        far = model.far_field()
        if far is not None:
            name = "/".join(key)
            ax.errorbar(far.theta_deg, far.intensity, far.standard_error, lw=1, label=name)
    ax.set(xlabel="theta (°)", ylabel="intensity (1/sr)")
    ax.legend()
    return ax


def optimisation(value: Optimisation, ax: Any) -> Any:
    """Best objective of every generation over the candidates so far, and the verified one."""
    ax = _axes(ax)
    done = 0
    for number, stage in enumerate(value.stages, 1):
        tried = done + np.cumsum(stage.candidates)
        label = f"stage {number}, best of a generation"
        ax.errorbar(tried, stage.best, stage.standard_error, fmt=".-", lw=1, label=label)
        done = int(tried[-1]) if tried.size else done
    for name, figure in (("before", value.objective.before), ("after", value.objective.after)):
        if figure is not None:
            style = "--" if name == "before" else "-"
            ax.axhline(figure.value, color="k", ls=style, lw=0.8, label=f"verified, {name}")
            if figure.interval is not None:
                ax.axhspan(*figure.interval, color="k", alpha=0.08, lw=0.0)
    ax.set(xlabel="candidates", ylabel="objective")
    ax.legend(fontsize="small")
    return ax


def _directions(value: Solution | Jones) -> tuple[tuple[str, ...], dict[str, Any]]:
    names = tuple(f"direction_{i}" for i in range(value.theta_deg.ndim))
    if value.theta_deg.ndim == 1:
        names = ("direction",)
    wavelength = np.asarray(value.wavelength_um)
    coordinates: dict[str, Any] = {
        "wavelength": (names if wavelength.ndim else (), wavelength, {"units": "micrometre"}),
        "theta": (names, value.theta_deg, {"units": "degree"}),
        "phi": (names, value.phi_deg, {"units": "degree"}),
        "order_reflected": value.orders_reflected,
        "order_transmitted": value.orders_transmitted,
    }
    return names, coordinates


def _amplitudes(
    names: tuple[str, ...], jones: Iterable[tuple[str, Any]], coordinates: dict[str, Any]
) -> dict[str, Any]:
    """Variables of the Jones matrices of the reflected and the transmitted orders."""
    unit = {"units": "incident amplitude", "long_name": "electric amplitude out by in"}
    found = {
        name: ((*names, f"order_{name.split('_')[-1]}", "out", "in"), values, unit)
        for name, values in jones
        if values is not None
    }
    if found:
        coordinates.update({"out": ["s", "p"], "in": ["s", "p"]})
    return found


def jones_dataset(value: Jones) -> Any:
    """Jones matrices over directions and order."""
    names, coordinates = _directions(value)
    both = (("reflected", value.reflected), ("transmitted", value.transmitted))
    return _xarray().Dataset(_amplitudes(names, both, coordinates), coordinates)


def solution_dataset(value: Solution) -> Any:
    """Efficiencies over directions, polarisation and order."""
    names, coordinates = _directions(value)
    outer = names
    if value.polarisation == "both":
        outer = (*names, "polarisation")
        coordinates["polarisation"] = ["s", "p"]
    unit = {"units": "1", "long_name": "power per incident power"}
    variables = {
        "reflected": ((*outer, "order_reflected"), value.reflected, unit),
        "transmitted": ((*outer, "order_transmitted"), value.transmitted, unit),
        "reflected_te": ((*outer, "order_reflected"), value.reflected_te, unit),
        "transmitted_te": ((*outer, "order_transmitted"), value.transmitted_te, unit),
    }
    both = (("jones_reflected", value.jones_reflected), ("jones_transmitted", value.jones_transmitted))
    variables |= _amplitudes(names, both, coordinates)
    attributes = {
        "polarisation": value.polarisation,
        "side": value.side,
        "method": value.method,
        "orders": value.orders,
        "slices": value.slices,
        "nodes": value.nodes,
        "energy_residual": value.energy_residual,
    }
    if value.estimated_error is not None:
        attributes["estimated_error"] = value.estimated_error
    return _xarray().Dataset(variables, coordinates, attributes)


def hemisphere_dataset(value: Hemisphere) -> Any:
    """Efficiencies over nodes, polarisation and order."""
    unit = {"units": "1", "long_name": "power per incident power"}
    variables = {
        "to_top": (("node", "polarisation", "order_top"), value.to_top, unit),
        "to_bottom": (("node", "polarisation", "order_bottom"), value.to_bottom, unit),
    }
    coordinates = {
        "wavelength": ((), value.wavelength_um, {"units": "micrometre"}),
        "from_top": ("node", value.from_top),
        "theta": ("node", value.theta_deg, {"units": "degree"}),
        "phi": ("node", value.phi_deg, {"units": "degree"}),
        "kx": ("node", value.kx, {"units": "2 pi/wavelength"}),
        "ky": ("node", value.ky, {"units": "2 pi/wavelength"}),
        "polarisation": ["s", "p"],
        "order_top": value.orders_top,
        "order_bottom": value.orders_bottom,
    }
    attributes = {
        "orders": value.orders,
        "slices": value.slices,
        "energy_residual": value.energy_residual,
    }
    return _xarray().Dataset(variables, coordinates, attributes)


def near_field_dataset(value: NearField) -> Any:
    """Fields over z, x and component."""
    axes = ("z", "x", "component")
    variables = {
        "electric": (axes, value.electric, {"units": "incident amplitude"}),
        "magnetic": (axes, value.magnetic, {"units": "incident amplitude"}),
        "intensity": (("z", "x"), value.intensity, {"units": "1"}),
        "index": (("z", "x"), value.index, {"units": "1"}),
    }
    coordinates = {
        "wavelength": ((), value.wavelength_um, {"units": "micrometre"}),
        "theta": ((), value.theta_deg, {"units": "degree"}),
        "phi": ((), value.phi_deg, {"units": "degree"}),
        "z": ("z", value.z_um, {"units": "micrometre"}),
        "x": ("x", value.x_um, {"units": "micrometre"}),
        "component": ["x", "y", "z"],
    }
    attributes = {"polarisation": value.polarisation, "side": value.side}
    return _xarray().Dataset(variables, coordinates, attributes)


def map_dataset(value: Map) -> Any:
    """Value and standard error over the middles of the bins."""
    names = tuple(axis.name for axis in value.axes)
    # Stokes parameters come before the axes; the six bins of a surface have no axis.
    before = ("stokes", "bin")[: value.values.ndim - len(names)] if names else ("bin",)
    attributes = {"units": value.unit, "long_name": value.quantity}
    variables = {
        "value": ((*before, *names), value.values, attributes),
        "standard_error": ((*before, *names), value.standard_error, attributes),
    }
    coordinates: dict[str, Any] = {
        axis.name: (axis.name, axis.middles, {"units": axis.unit}) for axis in value.axes
    }
    if "stokes" in before:
        coordinates["stokes"] = ["I", "Q", "U", "V"]
    return _xarray().Dataset(variables, coordinates)


def curve_dataset(
    axis: str, places: Any, unit: str, values: Mapping[str, Any], unit_of_values: str
) -> Any:
    """Values over places on an axis."""
    attributes = {"units": unit_of_values}
    variables = {name: (axis, one, attributes) for name, one in values.items()}
    return _xarray().Dataset(variables, {axis: (axis, places, {"units": unit})})


def table_dataset(columns: Mapping[str, Any]) -> Any:
    """Columns over rows."""
    return _xarray().Dataset({name: ("row", column) for name, column in columns.items()})


def results_dataset(value: Results) -> Any:
    """Figures of all models with their standard errors, NaN of those that are not resolved."""
    frames: dict[str, Any] = {}
    keys = list(value.models)
    names = sorted({name for model in value.models.values() for name in model.figures})
    for name in names:
        found = [value.models[key].figures.get(name) for key in keys]
        units = {"units": next((f.unit for f in found if f is not None), "")}
        values = [np.nan if f is None else f.value for f in found]
        errors = [np.nan if f is None else f.standard_error for f in found]
        frames[name] = ("model", values, units)
        frames[f"{name}_standard_error"] = ("model", errors, units)
        ends = [f.interval or (np.nan, np.nan) if f is not None else (np.nan, np.nan) for f in found]
        if not np.isnan(ends).all():
            frames[f"{name}_interval"] = (("model", "end"), ends, units)
        bounds = [np.nan if f is None or f.upper_bound is None else f.upper_bound for f in found]
        if not np.isnan(bounds).all():
            frames[f"{name}_upper_bound"] = ("model", bounds, units)
    return _xarray().Dataset(frames, {"model": ["/".join(key) for key in keys]})
