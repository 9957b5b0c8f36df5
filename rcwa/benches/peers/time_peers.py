#!/usr/bin/env python3.11
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times this solver beside public ones on one grating: equal orders and slices, then equal accuracy. See README.md.

Makes a virtual environment, installs requirements.txt into it, and runs every solver in a process of its own, one thread each, in rounds:
ours, then every peer on one direction of that round. Times are CPU times of the process. Prints a table and writes JSON.
"""

import argparse
import json
import os
import platform
import random
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
WORKSPACE = HERE.parent.parent.parent
SINGLE = {name: "1" for name in ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
CORRECT = 1e-8  # |R + T - 1| of a solver that keeps the energy
NEAR = 2e-3  # difference from us that product rules and sampled walls explain at 121 orders


def worker(name, job):
    """In the environment: one solver, one structure; prints JSON."""
    import contextlib
    import io
    import warnings

    warnings.simplefilter("ignore")
    from solvers import SOLVERS

    solver = SOLVERS[name]()
    report = {"rule": solver.rule}
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        # Imports and libraries' own beginnings are not timed.
        solver.direction(solver.build(5, 2), 10.0, 20.0)
        start = time.process_time()
        structure = solver.build(job["orders"], job["slices"])
        built = time.process_time()
        report["shares"] = solver.direction(structure, *job["direction"])
        solved = time.process_time()
        report["build_seconds"] = built - start
        report["direction_seconds"] = solved - built
        if job["bloch"] and hasattr(solver, "bloch"):
            theta, phi = job["direction"]
            start = time.process_time()
            # Another Bloch wavevector, so that nothing is left from the one before.
            report["bloch_incident_orders"] = solver.bloch(structure, theta, phi + 1.0)
            report["bloch_seconds"] = time.process_time() - start
    print(json.dumps(report))


def environment(folder):
    """Python of a virtual environment that has the requirements."""
    python = folder / "bin" / "python"
    done = folder / "installed.txt"
    wanted = (HERE / "requirements.txt").read_text()
    if not (done.exists() and done.read_text() == wanted):
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "-r", HERE / "requirements.txt"], check=True)
        done.write_text(wanted)
    return python


def run(command, seconds=1200):
    """Standard output as JSON, or why there is none."""
    environment = {**os.environ, **SINGLE, "PYTHONPATH": str(HERE)}
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=seconds, check=True)
    except subprocess.TimeoutExpired:
        return {"failure": f"took more than {seconds} s"}
    except subprocess.CalledProcessError as error:
        return {"failure": (error.stderr.strip().splitlines() or ["no message"])[-1]}
    return json.loads(done.stdout.strip() if done.stdout.lstrip().startswith("{") else done.stdout.splitlines()[-1])


def ours(program, orders, slices, *more):
    return run([program, "--orders", str(orders), "--slices", str(slices), *more])


def median(rows, key):
    values = [row[key] for row in rows if key in row]
    return statistics.median(values) if values else None


def processor():
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else platform.machine()}, {len(names)} processors"


def residual(rows):
    worst = 0.0
    for row in rows:
        for reflected, transmitted in row.get("shares", []):
            wrong = abs(reflected + transmitted - 1.0)
            # What is no number counts as the largest there is.
            worst = max(worst, wrong if wrong <= sys.float_info.max else sys.float_info.max)
    return worst


def departure(rows, samples):
    """Largest difference of R or T from ours at the same directions."""
    worst = 0.0
    for row, sample in zip(rows, samples):
        for pol, (reflected, transmitted) in zip("sp", row.get("shares", [])):
            mine = sample["shares"][pol]
            worst = max(worst, abs(reflected - mine["reflected"]), abs(transmitted - mine["transmitted"]))
    return worst


def equal_resolution(options, python, program):
    from solvers import SOLVERS, tangential

    chance = random.Random(1)
    directions = [(chance.uniform(2.0, 80.0), chance.uniform(3.0, 87.0)) for _ in range(options.rounds)]
    hemispheres, peers = [], {name: [] for name in SOLVERS if name in options.peers}
    for round_, direction in enumerate(directions):
        kx, ky = tangential(*direction)
        hemispheres.append(ours(program, options.orders, options.slices, "--sample", f"{kx!r}:{ky!r}"))
        for name, rows in peers.items():
            # One that loses energy, or fails, is not timed again.
            if rows and ("failure" in rows[0] or residual(rows) > CORRECT):
                continue
            job = {"orders": options.orders, "slices": options.slices, "direction": direction, "bloch": True}
            rows.append(run([python, __file__, "--worker", name, "--job", json.dumps(job)]))
            print(f"round {round_ + 1}: {name}: {rows[-1]}", file=sys.stderr, flush=True)
    samples = [h["sample"][0] for h in hemispheres]
    count = hemispheres[0]["directions"]
    rows = []
    for name, found in peers.items():
        paired = [(p, h) for p, h in zip(found, hemispheres) if "direction_seconds" in p]
        row = {
            "solver": name,
            "rule": median_text(found),
            "failure": next((p["failure"] for p in found if "failure" in p), None),
            "worst_energy_residual": residual(found),
            "largest_difference_from_ours": departure(found, samples),
            "correct": bool(paired) and residual(found) <= CORRECT and departure(found, samples) <= NEAR,
            "build_seconds": median(found, "build_seconds"),
            "seconds_per_direction": median(found, "direction_seconds"),
            "seconds_per_bloch_wavevector": median(found, "bloch_seconds"),
        }
        if row["correct"]:
            # Grouped: as many Bloch wavevectors as we solve.
            ratios = [count * p["direction_seconds"] / h["cpu_seconds"] for p, h in paired]
            row["hours_by_direction"] = count * row["seconds_per_direction"] / 3600
            row["ratio_by_direction"] = statistics.median(ratios)
            grouped = [
                h["problems"] * p["bloch_seconds"] / h["cpu_seconds"] for p, h in paired if "bloch_seconds" in p
            ]
            if grouped:
                row["minutes_grouped"] = hemispheres[0]["problems"] * row["seconds_per_bloch_wavevector"] / 60
                row["ratio_grouped"] = statistics.median(grouped)
        rows.append(row)
    mine = {
        "cpu_seconds": median(hemispheres, "cpu_seconds"),
        "directions": count,
        "problems": hemispheres[0]["problems"],
        "seconds_per_direction": median(hemispheres, "cpu_seconds_per_direction"),
        "single_direction_seconds": median(hemispheres, "single_direction_cpu_seconds"),
        "worst_energy_residual": max(h["worst_energy_residual"] for h in hemispheres),
    }
    scalene = ours(program, options.orders, options.slices, "--apex", "7.3")
    mine["cpu_seconds_scalene"] = scalene["cpu_seconds"]
    return {"ours": mine, "peers": rows}


def median_text(rows):
    return next((row["rule"] for row in rows if "rule" in row), None)


def equal_accuracy(options, python, program, fastest):
    from solvers import tangential

    table = ours(program, 53, 3, "--tolerance", repr(options.tolerance))["table"]
    row = {"tolerance": options.tolerance, "ours": table}
    if fastest:
        job = {
            "orders": options.accurate_orders,
            "slices": options.accurate_slices,
            "direction": (25.0, 40.0),
            "bloch": True,
        }
        kx, ky = tangential(*job["direction"])
        # What is nearly the limit: the error of 512 slices is an eighth of that of 192.
        truth = ours(program, 141, 512, "--what", "sample", "--sample", f"{kx!r}:{ky!r}")["sample"]
        found = run([python, __file__, "--worker", fastest, "--job", json.dumps(job)])
        row |= {"peer": fastest, "peer_orders": job["orders"], "peer_slices": job["slices"], "peer_result": found}
        if "direction_seconds" in found:
            row["peer_error"] = departure([found], truth)
            mine = table["cpu_seconds_per_direction"]
            row["ratio"] = found["direction_seconds"] / mine
            if "bloch_seconds" in found:
                row["ratio_grouped"] = found["bloch_seconds"] / found["bloch_incident_orders"] / mine
    return row


def show(report):
    mine = report["equal_resolution"]["ours"]
    print(f"ours: {mine['cpu_seconds']:.2f} s for {mine['directions']} directions ({mine['problems']} problems), "
          f"{mine['single_direction_seconds']:.3f} s for one alone, energy to {mine['worst_energy_residual']:.0e}; "
          f"scalene {mine['cpu_seconds_scalene']:.2f} s")
    print(f"{'solver':10} {'energy':>8} {'ours-its':>8} {'s/dir.':>8} {'s/Bloch':>8} {'by dir.':>8} {'grouped':>8}")
    for row in report["equal_resolution"]["peers"]:
        def cell(key, form):
            return format(row[key], form) if row.get(key) is not None else "-"

        print(f"{row['solver']:10} {cell('worst_energy_residual', '8.0e')} {cell('largest_difference_from_ours', '8.0e')} "
              f"{cell('seconds_per_direction', '8.2f')} {cell('seconds_per_bloch_wavevector', '8.2f'):>8} "
              f"{cell('ratio_by_direction', '8.0f'):>8} {cell('ratio_grouped', '8.0f'):>8}"
              + (f"  {row['failure']}" if row["failure"] else ""))
    accuracy = report["equal_accuracy"]
    if "ratio" in accuracy:
        print(f"to {accuracy['tolerance']}: ours {accuracy['ours']['cpu_seconds_per_direction'] * 1e3:.2f} ms a direction, search "
              f"included; {accuracy['peer']} {accuracy['peer_result']['direction_seconds']:.1f} s, off by {accuracy['peer_error']:.0e}; "
              f"ratio {accuracy['ratio']:.0f}, grouped {accuracy.get('ratio_grouped', float('nan')):.0f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--orders", type=int, default=121)
    parser.add_argument("--slices", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=3, help="paired runs; medians are given")
    parser.add_argument("--tolerance", type=float, default=1e-3)
    parser.add_argument("--accurate-orders", type=int, default=81, help="orders a peer needs for the tolerance")
    parser.add_argument("--accurate-slices", type=int, default=192, help="slices it needs")
    parser.add_argument("--peers", type=lambda text: text.split(","), default="inkstone,A_FMM,torcwa,rcwa,meent,grcwa,nannos".split(","))
    parser.add_argument("--venv", type=Path, default=WORKSPACE / "target" / "peers-python")
    parser.add_argument("--out", type=Path, default=WORKSPACE / "target" / "peers.json")
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    parser.add_argument("--job", type=json.loads, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        return worker(options.worker, options.job)
    python = environment(options.venv)
    if Path(sys.prefix).resolve() != options.venv.resolve():
        return os.execv(python, [str(python), __file__, *sys.argv[1:]])
    build = ["cargo", "build", "--release", "-p", "batwing-rcwa", "--example", "hemisphere_time"]
    subprocess.run(build, check=True, cwd=WORKSPACE)
    target = Path(os.environ.get("CARGO_TARGET_DIR", WORKSPACE / "target"))
    program = target / "release" / "examples" / "hemisphere_time"
    from importlib.metadata import version

    report = {
        "machine": processor(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in [*options.peers, "numpy", "scipy"]},
        "orders": options.orders,
        "slices": options.slices,
        "rounds": options.rounds,
        "equal_resolution": equal_resolution(options, python, program),
    }
    correct = [row for row in report["equal_resolution"]["peers"] if row["correct"]]
    fastest = min(correct, key=lambda row: row["seconds_per_direction"])["solver"] if correct else None
    report["equal_accuracy"] = equal_accuracy(options, python, program, fastest)
    temporary = options.out.with_suffix(".part")
    temporary.write_text(json.dumps(report, indent=1) + "\n")
    temporary.rename(options.out)
    show(report)


if __name__ == "__main__":
    main()
