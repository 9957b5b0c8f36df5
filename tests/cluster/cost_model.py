#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cost model of sharded jobs, from one core to 10,000: where a job stops scaling and why.

    cost_model.py BATWING [DESIGN.toml]

`batwing plan` counts the operations of all rings of the design; the job is that of twenty such
designs at eight wavelengths, all rings, and a trace in four models of each. Seconds of a piece are
those by which `batwing` deals (measured on one core), the rest are the constants below.
"""

import heapq
import json
import subprocess
import sys
import tempfile

# As in pipeline/simulate/src/job.rs.
OPERATIONS_PER_SECOND = 1.5e9
TABLE_SECONDS = 0.4
PATHS_PER_SECOND = 2e6
UNIT_SECONDS = 0.002
GROUPS = 64

# Measured on two cores: start of a shard until its first piece; results of one trace (maps,
# pictures, far fields); bytes of a group and of a table.
START_SECONDS = 0.2
RESULT_SECONDS = 0.35
GROUP_BYTES = 265e3
TABLE_BYTES = 2.5e6

# A cluster of the usual kind: tasks that the scheduler starts in a second, bytes and files that the
# shared file system takes in a second, bytes that one node takes.
STARTS_PER_SECOND = 100.0
SHARED_BYTES_PER_SECOND = 5e9
SHARED_FILES_PER_SECOND = 2e4
NODE_BYTES_PER_SECOND = 5e8

DESIGNS = 20
WAVELENGTHS_NM = [450, 480, 510, 540, 570, 600, 630, 660]
MODELS = 4
PATHS = 20e6


def operations_of_rings(batwing, design):
    """Multiply-adds of each ring: with as many shards as rings, each shard has one."""
    with tempfile.TemporaryDirectory() as folder:
        words = [batwing, "plan", "--json", "--shards", "1000", "--"]
        words += ["bsdf", design, "--rings", "all", "--out", folder]
        plan = json.loads(subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout)
    return [shard["operations"] for shard in plan["shards"] if shard["tables"] == 1]


def deal(costs, count):
    """Cost of the tables of each shard: the largest first, each to the shard with the least."""
    least = [(0.0, shard) for shard in range(count)]
    for cost in sorted(costs, reverse=True):
        sofar, shard = heapq.heappop(least)
        heapq.heappush(least, (sofar + cost, shard))
    return sorted(sofar for sofar, _ in least)


def level(loads, more):
    """The cost up to which `more` fills the shards."""
    below = 0.0
    for number, load in enumerate(loads):
        below += load
        filled = (more + below) / (number + 1)
        if number + 1 == len(loads) or filled <= loads[number + 1]:
            return filled
    return more


def simulate(tables, groups, group_seconds, count):
    """Seconds of a job on `count` cores by their causes."""
    loads = deal(tables, count)
    compute = max(loads[-1], level(loads, groups * group_seconds))
    if count > groups + len(tables):
        compute = max(compute, max(tables), group_seconds)
    traces = groups / GROUPS
    written = groups * GROUP_BYTES + len(tables) * TABLE_BYTES
    files = groups + len(tables)
    # A quarter of the traces is the hybrid's; its shards read all tables of their design.
    hybrid = traces / MODELS
    share = hybrid * GROUPS * group_seconds / (sum(tables) + groups * group_seconds)
    readers = min(hybrid * GROUPS, hybrid + count * share)
    read = readers * len(tables) / hybrid * TABLE_BYTES
    shared = (written + read) / min(SHARED_BYTES_PER_SECOND, count * NODE_BYTES_PER_SECOND)
    return {
        "compute": compute,
        "start": START_SECONDS + count / STARTS_PER_SECOND,
        "files": shared + files / SHARED_FILES_PER_SECOND,
        "merge": written / NODE_BYTES_PER_SECOND + traces * RESULT_SECONDS,
    }


def main():
    batwing = sys.argv[1]
    design = sys.argv[2] if len(sys.argv) > 2 else "data/designs/d1.toml"
    rings = operations_of_rings(batwing, design)
    # Orders go as 1/λ, operations as their cube, slices as the root of the height in waves.
    tables = [
        TABLE_SECONDS + operations * (550.0 / nm) ** 3.5 / OPERATIONS_PER_SECOND
        for operations in rings
        for nm in WAVELENGTHS_NM
        for _ in range(DESIGNS)
    ]
    groups = DESIGNS * len(WAVELENGTHS_NM) * MODELS * GROUPS
    group_seconds = UNIT_SECONDS + PATHS / GROUPS / PATHS_PER_SECOND
    work = sum(tables) + groups * group_seconds
    print(f"{len(tables)} tables, {groups} groups of paths, {work / 3600:.1f} core hours;")
    print(f"largest table {max(tables):.1f} s\n")
    print(" cores     total s   compute    start    files    merge  efficiency  with merge")
    for count in [1, 2, 8, 64, 256, 1000, 2000, 4000, 10000]:
        parts = simulate(tables, groups, group_seconds, count)
        total = sum(parts.values())
        shards = total - parts["merge"]
        print(
            f"{count:>6}  {total:>10.0f}  {parts['compute']:>8.0f} {parts['start']:>8.1f}"
            f" {parts['files']:>8.1f} {parts['merge']:>8.0f}  {work / count / shards:>10.2f}"
            f"  {work / count / total:>10.2f}"
        )


if __name__ == "__main__":
    main()
