"""Prints the tables of the study and draws its map from the results of run.sh.

    python3 table.py RESULTS [MAP.png]

The map needs Matplotlib."""

import json
import pathlib
import sys

OS = {"d1": "OS1 (D1)", "d2": "OS2 (D2)", "d3": "OS3 (D3)"}


def results(folder):
    for path in sorted(pathlib.Path(folder).glob("*/full_wave.json")):
        design, size = path.parent.name.rsplit("-", 1)
        rings, width = size.split("x")
        yield design, int(rings), float(width), json.loads(path.read_text())


def distance(found, model, width):
    """Distance in percent without its noise, and twice the noise, below which nothing is resolved."""
    d = next(
        d
        for d in found["comparison"]["distances"]
        if d["model"] == model and d["bin_deg"] == width
    )
    beyond = max(d["rms"] ** 2 - d["noise"] ** 2, 0.0) ** 0.5
    return 100 * beyond, 200 * d["noise"], 100 * d["rms"]


def words(found, model, width):
    beyond, noise, rms = distance(found, model, width)
    return f"{beyond:.1f}" if rms > noise else f"< {noise:.1f}"


def tables(folder):
    print("| design | rings | um | sources | hybrid 2.5 | rays 2.5 | hybrid 5 | rays 5 | balance |")
    rows = list(results(folder))
    for design, rings, width, found in rows:
        cells = [words(found, model, b) for b in (2.5, 5.0) for model in ("hybrid", "rays")]
        balance = f"{found['comparison']['balance']:.0e}"
        print("|", design, "|", rings, "|", f"{width:g}", "|", found["sources"], "|", end=" ")
        print(" | ".join(cells), "|", balance, "|")
    for design, rings, width, found in rows:
        for row in found.get("separated", []):
            again = row["met_again"]
            print(
                f"{design} {rings} x {width:g} {row['variant']:24}",
                *(f"{100 * row[key]:5.2f}" for key in ("rms", "rms_mirror_as_power", "noise")),
                "" if again is None else f"{100 * again:.1f}",
            )


def draw(folder, out):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.2), layout="constrained")
    found = [(d, n, w / 0.55, f) for d, n, w, f in results(folder) if d in OS]
    for (design, name), colour in zip(OS.items(), ("#0072b2", "#d55e00", "#009e73")):
        for model, line, marker in (("hybrid", "-", "o"), ("rays", ":", "s")):
            eight = sorted((w, distance(f, model, 2.5)) for d, n, w, f in found if d == design and n == 8)
            axes.plot(
                [w for w, _ in eight],
                [d[0] for _, d in eight],
                line,
                marker=marker,
                color=colour,
                label=f"{name}, {model}",
            )
            for d, n, w, f in found:
                if d == design and n != 8:
                    value = distance(f, model, 2.5)[0]
                    axes.plot([w], [value], marker, color=colour, mfc="white")
                    axes.annotate(str(n), (w, value), xytext=(5, 3), textcoords="offset points", fontsize=7)
    axes.set_xscale("log")
    ticks = (3, 5, 10, 20, 50, 100)
    axes.set_xticks(ticks, [str(t) for t in ticks])
    axes.minorticks_off()
    axes.set_ylim(0)
    axes.set_xlabel("ring width over wavelength (8 rings a side; open: as many as stated)")
    axes.set_ylabel("distance from full wave, % of the largest bin")
    axes.legend(fontsize=8)
    figure.savefig(out, dpi=130)


if __name__ == "__main__":
    tables(sys.argv[1])
    if len(sys.argv) > 2:
        draw(sys.argv[1], sys.argv[2])
