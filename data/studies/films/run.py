#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Uniformity of an endless backlight before and behind a diffusing plate and two crossed prism films.

    python3 data/studies/films/run.py [FOLDER]

From the root of the repository. One package stands between walls that mirror, so that the cell repeats
without end. Films are traced by a table, which FOLDER/cache keeps. Prints figures and writes films.csv,
films.svg and tables.md, the tables of docs/explanation/films.md; some 45 minutes on two idle cores. What
FOLDER holds is not traced again. The binary is target/release/batwing, or the one that BATWING names.
"""

import csv
import json
import os
import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[3]
BATWING = os.environ.get("BATWING", str(ROOT / "target/release/batwing"))
DESIGNS = {
    "bare-chip": None,
    "bare-dome": "designs/bare-dome.toml",
    "d1": "designs/d1.toml",
    "d2": "designs/d2.toml",
    "d3": "designs/d3.toml",
    "half-distance": "gallery/half-distance/design.toml",
}
PITCHES_MM = (5.0, 8.3, 12.0)
PLANES_MM = (1.5, 3.0)
STACKS = ("none", "weak plate", "plate")
# Reflected and transmitted share of the plate's upper face.
PLATES = {"weak plate": (0.15, 0.85), "plate": (0.4, 0.6)}
# Films smooth what needs fewer bins then.
BINS = {"none": 24, "weak plate": 12, "plate": 12}
PATHS = {"none": 2_097_152, "weak plate": 2_621_440, "plate": 2_621_440}


def written(value):
    """A value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {written(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return json.dumps(value)


def cell(name, pitch_mm, plane_mm, stack):
    """The design of one cell."""
    file = DESIGNS[name] or "designs/bare-dome.toml"
    design = tomllib.loads((ROOT / "data" / file).read_text())
    if DESIGNS[name] is None:
        del design["dome"], design["silicone"]
    for key in ("receivers", "far_field", "description"):
        design.pop(key, None)
    design["name"] = name
    design["array"] = {"columns": 1, "rows": 1, "pitch_mm": pitch_mm}
    above = 0.0
    if stack != "none":
        reflected, transmitted = PLATES[stack]
        scatter = {"kind": "lambertian", "transmitted": transmitted, "reflected": reflected}
        prisms = {"thickness_mm": 0.2, "medium": {"index": 1.586}}
        design["films"] = [
            {"name": "plate", "z_mm": plane_mm, "thickness_mm": 1.5, "medium": {"index": 1.49},
             "top": scatter},
            {"name": "lower", **prisms, "top": {"kind": "prisms"}},
            {"name": "upper", **prisms, "top": {"kind": "prisms", "direction_deg": 90.0}},
        ]
        above = 2.0
    design["housing"] = {
        "kind": "specular", "reflectance": 1.0, "inner_size_mm": [pitch_mm, pitch_mm],
        "height_mm": plane_mm + above + 1.0,
    }
    bin_mm = pitch_mm / BINS[stack]
    design["receiver"] = {
        "plane_height_mm": plane_mm + above, "bin_mm": bin_mm, "smoothing_sigma_mm": 0.0,
        "area_mm": [pitch_mm, pitch_mm],
    }
    design["trace"] = {"paths": PATHS[stack], "sampling": "sobol", "max_interactions": 10_000}
    return "\n".join(f"{key} = {written(value)}" for key, value in design.items()) + "\n"


def figures(folder):
    """Figures of the one model of a run: value, standard error, and the interval where that is all."""
    run = json.loads((folder / "results.json").read_text())
    (design,) = run["designs"].values()
    (model,) = design.values()
    found = {key: model[key] for key in ("area_valley_to_peak", "area_variation")}
    found["up"] = model["power_ledger"]["escaped_up"]
    return {key: (entry["value"], entry["standard_error"], entry.get("interval"))
            for key, entry in found.items()}


def row_of(folder, name, pitch_mm, plane_mm, stack):
    """A row of films.csv from the results in a folder."""
    found = figures(folder)
    row = {"design": name, "pitch_mm": pitch_mm, "plane_mm": plane_mm, "stack": stack, "paths": PATHS[stack]}
    for key, (value, error, interval) in found.items():
        low, high = interval or ("", "")
        row |= {key: value, f"{key}_error": error, f"{key}_from": low, f"{key}_to": high}
    return row


def picture(rows, file):
    """Uniformity behind the films over that before them, as SVG."""
    colours = {"weak plate": "#d1495b", "plate": "#00798c"}
    width, height, margin = 640, 520, 70
    before = {(row["design"], row["pitch_mm"], row["plane_mm"]): row["area_valley_to_peak"]
              for row in rows if row["stack"] == "none"}

    def at(x, y):
        return margin + x * (width - 2 * margin), height - margin - y * (height - 2 * margin)

    marks = []
    for k in range(6):
        part = k / 5
        (x, low), (left, y) = at(part, 0), at(0, part)
        marks += [f'<text x="{x}" y="{low + 22}" text-anchor="middle">{part:.1f}</text>',
                  f'<text x="{left - 10}" y="{y + 5}" text-anchor="end">{part:.1f}</text>',
                  f'<path d="M{left} {y}H{at(1, 0)[0]}M{x} {low}V{at(0, 1)[1]}" stroke="#ddd"/>']
    for row in rows:
        if row["stack"] in colours:
            x, y = at(before[row["design"], row["pitch_mm"], row["plane_mm"]], row["area_valley_to_peak"])
            marks.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{colours[row["stack"]]}"/>')
    for k, (name, colour) in enumerate(colours.items()):
        marks += [f'<circle cx="{margin + 12}" cy="{20 + 20 * k}" r="5" fill="{colour}"/>',
                  f'<text x="{margin + 24}" y="{25 + 20 * k}">{name} and crossed prism films</text>']
    marks += [f'<text x="{width / 2}" y="{height - 18}" text-anchor="middle">min/max before the films</text>',
              f'<text transform="translate(20 {height / 2}) rotate(-90)" text-anchor="middle">min/max behind them</text>']
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
                    f'font-family="DejaVu Sans, sans-serif" font-size="14"><rect width="{width}" '
                    f'height="{height}" fill="#fff"/>' + "".join(marks) + "</svg>\n")


def shown(row):
    """Min/max as text: a range where it is not resolved, its error behind films."""
    value, error, low, high = (row[f"area_valley_to_peak{end}"] for end in ("", "_error", "_from", "_to"))
    if low != "":
        digits = 3 if high - low < 0.05 else 2
        return f"{low:.{digits}f}–{high:.{digits}f}"
    return f"{value:.3f}" if row["stack"] == "none" else f"{value:.4f} ± {error:.4f}"


def tables(rows):
    """A Markdown table of designs over pitch and height for each stack."""
    by_cell = {(row["stack"], row["design"], row["pitch_mm"], row["plane_mm"]): row for row in rows}
    cells = [(pitch_mm, plane_mm) for pitch_mm in PITCHES_MM for plane_mm in PLANES_MM]
    lines = []
    for stack in STACKS:
        heads = ["design", *(f"{pitch_mm:g}, {plane_mm:g}" for pitch_mm, plane_mm in cells)]
        lines += [stack, "", "| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
        lines += ["| " + " | ".join([name, *(shown(by_cell[stack, name, *cell]) for cell in cells)]) + " |"
                  for name in DESIGNS]
        lines.append("")
    return "\n".join(lines)


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "films")
    rows = []
    for name in DESIGNS:
        for pitch_mm in PITCHES_MM:
            for plane_mm in PLANES_MM:
                for stack in STACKS:
                    at = folder / f"{name}-{pitch_mm}-{plane_mm}-{stack.replace(' ', '-')}"
                    if not (at / "results.json").is_file():
                        at.mkdir(parents=True, exist_ok=True)
                        (at / "cell.toml").write_text(cell(name, pitch_mm, plane_mm, stack))
                        command = [BATWING, "--quiet", "run", str(at / "cell.toml"), "--model", "geometric",
                                   "--cache", str(folder / "cache"), "--out", str(at)]
                        subprocess.run(command, check=True)
                    row = row_of(at, name, pitch_mm, plane_mm, stack)
                    rows.append(row)
                    print(*row.values(), flush=True)
    with open(folder / "films.csv", "w", newline="") as out:
        table = csv.DictWriter(out, rows[0].keys())
        table.writeheader()
        table.writerows(rows)
    (folder / "tables.md").write_text(tables(rows))
    picture(rows, folder / "films.svg")


if __name__ == "__main__":
    main()
