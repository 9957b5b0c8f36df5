#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Distances of hybrid and rays from full wave, beside those of rays in the smooth dome of the same size.

    python3 data/studies/full-wave/run.py [FOLDER]

From the root of the repository. Prints a table and writes it into FOLDER as full-wave.csv and full-wave.svg after
every row; rows that lie there are kept. Hours on two cores, most of it for the last rows. The binary is
target/release/batwing, or the one that BATWING names.
"""

import csv
import json
import math
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
BATWING = os.environ.get("BATWING", str(ROOT / "target/release/batwing"))
WAVELENGTH_UM = 0.55
DESIGNS = {
    "d1": "designs/d1.toml",
    "d2": "designs/d2.toml",
    "d3": "designs/d3.toml",
    "d3-by-waves": "gallery/d3-by-waves/design.toml",
}
COLOURS = {"d1": "#00798c", "d2": "#d1495b", "d3": "#edae49", "d3-by-waves": "#66a182"}
MODELS = ("hybrid", "rays", "smooth")
# Design, offset of the LED from the axis in mm, rings a side, their width in µm; small domes first.
ROWS = [(design, 0.0, 8, 2) for design in DESIGNS] + [("d1", 0.4, 8, 3)]
ROWS += [(design, 0.0, 16, 2) for design in ("d1", "d2", "d3")]
ROWS += [(design, 0.0, 8, 5) for design in DESIGNS]
ROWS += [(design, 0.0, 34, 2) for design in ("d1", "d2")]
ROWS += [(design, 0.0, 8, 10) for design in ("d1", "d2", "d3")]
ROWS += [("d1", 0.0, 8, 20), ("d1", 0.0, 34, 10), ("d2", 0.0, 34, 10)]
ROWS += [("d1", 0.0, 170, 10), ("d2", 0.0, 170, 10)]


def design_file(folder, name, offset_mm):
    """The design, with its LED off the axis where that is asked for."""
    path = ROOT / "data" / DESIGNS[name]
    if not offset_mm:
        return path
    text = path.read_text()
    moved = text.replace("[led]", f"[led]\noffset_mm = [{offset_mm}, 0.0]", 1)
    file = folder / f"{name}-{offset_mm}.toml"
    file.write_text(moved.replace(f'name = "{name.upper()}"', f'name = "{name}-off-axis"', 1))
    return file


def distances(folder, name, offset_mm, rings, width_um):
    """The row of one comparison, in percent of the largest bin."""
    at = folder / f"{name}-{rings}x{width_um}{f'-{offset_mm}' if offset_mm else ''}"
    if not (at / "full_wave.json").is_file():
        command = [BATWING, "--quiet", "full-wave", str(design_file(folder, name, offset_mm)), "--rings",
                   str(rings), "--ring-width-um", str(width_um), "--paths", "1e6", "--out", str(at)]
        # 1e-4 of the largest bin is far below chance, as is 1e-3 for the widest dome.
        radius_um = rings * width_um
        if radius_um > 1000:
            command += ["--tolerance", "1e-3", "--nodes", "6", "--sources", "120"]
        elif radius_um > 100:
            command += ["--tolerance", "1e-4", "--sources", "60" if radius_um > 300 else "360"]
        subprocess.run(command, check=True)
    file = json.loads((at / "full_wave.json").read_text())
    own, smooth = file["comparison"], file["baseline"]
    row = {"design": name, "offset_mm": offset_mm, "rings": rings, "width_um": width_um, "sources": file["sources"],
           "balance": max(own["balance"], smooth["balance"])}
    # A model that misses more light than its error has neither distances nor figures.
    squares = {f"{distance['model']}_{distance['bin_deg']:g}_deg": distance for distance in own["distances"]}
    squares |= {f"smooth_{distance['bin_deg']:g}_deg": distance for distance in smooth["distances"]
                if distance["model"] == "rays"}
    none = {"square": None, "square_error": None}
    widths = [wide["bin_deg"] for wide in own["far_fields"][0]["wide"]]
    for key in (f"{model}_{width:g}_deg" for model in MODELS for width in widths):
        row |= root(key, **squares.get(key, none))
    for model in ("hybrid", "rays"):
        pair = [squares.get(f"{of}_2.5_deg") for of in (model, "smooth")]
        row |= root(f"{model}_above_smooth", **(above(*pair) if all(pair) else none))
    for model, fields in (("hybrid", own), ("rays", own), ("smooth", smooth)):
        is_known = f"{model}_2.5_deg" in squares
        row[f"{model}_2.5_deg_within_80"] = (
            100 * within(fields, model.replace("smooth", "rays"), 2.5, 80.0) if is_known else "")
    for field in own["far_fields"]:
        for key in ("centre_to_peak", "centre_to_peak_error"):
            row[f"{field['model']}_{key}"] = 100 * field["figures"][key] if field["figures"] else ""
    return row


def above(distance, smooth):
    """The excess of one mean square over another."""
    return {"square": distance["square"] - smooth["square"],
            "square_error": math.hypot(distance["square_error"], smooth["square_error"])}


def root(key, square, square_error, **_):
    """The root of a mean square in percent and its error, or what it is below with none, as the program states
    it; nothing of none."""
    error = square_error
    if square is None:
        return {key: "", f"{key}_error": ""}
    if square > 2 * error:
        return {key: 100 * math.sqrt(square), f"{key}_error": 50 * error / math.sqrt(square)}
    return {key: 100 * math.sqrt(max(square, 0) + 2 * error), f"{key}_error": ""}


def within(comparison, model, width_deg, most_deg):
    """The r.m.s. distance of a model, chance included, in bins whose middle is less than an angle from the axis,
    over the largest bin."""
    fields = {field["model"]: field["bins"] for field in comparison["far_fields"]}
    together = round(width_deg / (180 / len(fields["full_wave"])))
    bins = {name: [sum(fine[i:i + together]) for i in range(0, len(fine), together)]
            for name, fine in fields.items()}
    pairs = zip(bins[model], bins["full_wave"])
    near = [one - other for k, (one, other) in enumerate(pairs)
            if abs((k + 0.5) * width_deg - 90) < most_deg]
    return math.sqrt(sum(d * d for d in near) / len(near)) / max(bins["full_wave"])


def panel(rows, left, title, label, ends, ticks, place):
    """Marks of one panel from `left` on: distances over `place` of a row, on a logarithmic axis."""
    width, bottom, top, most = 300, 400, 60, 12.0
    low, high = (math.log(end) for end in ends)

    def at(x, percent):
        return (left + (math.log(x) - low) / (high - low) * width, bottom - percent / most * (bottom - top))

    marks = [f'<text x="{left}" y="{top - 18}">{title}</text>',
             f'<text x="{left + width / 2}" y="{bottom + 48}" text-anchor="middle">{label}</text>']
    for tick in ticks:
        x, y = at(tick, 0)
        marks += [f'<text x="{x:.1f}" y="{y + 22}" text-anchor="middle">{tick}</text>',
                  f'<path d="M{x:.1f} {y}V{top}" stroke="#ddd"/>']
    for percent in range(0, 13, 2):
        _, y = at(ends[0], percent)
        marks += [f'<text x="{left - 10}" y="{y + 5:.1f}" text-anchor="end">{percent}</text>',
                  f'<path d="M{left} {y:.1f}H{left + width}" stroke="#ddd"/>']
    for row in rows:
        colour = COLOURS[row["design"]]
        beside = 6 * (list(DESIGNS).index(row["design"]) - 1.5)
        heights = [at(place(row), row[f"{model}_2.5_deg"])[1] for model in MODELS]
        x = at(place(row), 0)[0] + beside
        marks.append(f'<path d="M{x:.1f} {heights[0]:.1f}V{heights[1]:.1f}" stroke="{colour}"/>')
        for y, fill, model in zip(heights, (colour, "#fff", "#bbb"), MODELS):
            pen = f'fill="{fill}" stroke="{colour if model != "smooth" else "#555"}" stroke-width="2"'
            if row[f"{model}_2.5_deg_error"] == "":
                marks.append(f'<path d="M{x - 6:.1f} {y:.1f}h12l-6 10z" {pen}/>')
            elif model == "smooth":
                marks.append(f'<path d="M{x - 6:.1f} {y:.1f}h12" {pen}/>')
            else:
                marks.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" {pen}/>')
    return marks


def picture(rows, file):
    """Distances of hybrid (filled), rays (open) and rays in the smooth dome (grey bars) over the width and the
    number of rings, as SVG; triangles are bounds."""
    rows = [row for row in rows if not row["offset_mm"] and all(row[f"{model}_2.5_deg"] != "" for model in MODELS)]
    marks = panel([row for row in rows if row["rings"] == 8], 70, "8 rings a side",
                  "ring width / wavelength", (3, 45), (4, 6, 10, 18, 36), lambda row: row["width_um"] / WAVELENGTH_UM)
    left = 430
    for width_um in (2, 10):
        of_width = [row for row in rows if row["width_um"] == width_um]
        if len({row["rings"] for row in of_width}) > 1:
            marks += panel(of_width, left, f"rings of {width_um / WAVELENGTH_UM:.2g} wavelengths", "rings a side",
                           (6, 220), (8, 16, 34, 170), lambda row: row["rings"])
            left += 360
    legend = left - 20
    for k, (name, colour) in enumerate(COLOURS.items()):
        x, y = legend, 70 + 24 * k
        marks += [f'<circle cx="{x}" cy="{y}" r="5" fill="{colour}" stroke="{colour}" stroke-width="2"/>',
                  f'<circle cx="{x + 16}" cy="{y}" r="5" fill="#fff" stroke="{colour}" stroke-width="2"/>',
                  f'<text x="{x + 30}" y="{y + 5}">{name}</text>']
    words = ("filled: hybrid", "open: rays", "bar: smooth dome", "triangle: below")
    marks += [f'<text x="{legend - 5}" y="{180 + 18 * k}">{line}</text>' for k, line in enumerate(words)]
    marks += ['<text transform="translate(22 230) rotate(-90)" text-anchor="middle">'
              "distance from full wave (% of the largest bin)</text>"]
    width = legend + 130
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} 470" '
                    f'font-family="DejaVu Sans, sans-serif" font-size="14"><rect width="{width}" '
                    'height="470" fill="#fff"/>' + "".join(marks) + "</svg>\n")


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "full-wave")
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for row in ROWS:
        rows.append(distances(folder, *row))
        print(*(f"{v:.3g}" if isinstance(v, float) else v for v in rows[-1].values()), flush=True)
        with open(folder / "full-wave.csv", "w", newline="") as out:
            table = csv.DictWriter(out, rows[0].keys())
            table.writeheader()
            table.writerows(rows)
        picture(rows, folder / "full-wave.svg")


if __name__ == "__main__":
    main()
