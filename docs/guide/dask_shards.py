#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Shares a batwing command among the workers of Dask, and merges the shards.

    python dask_shards.py --shards 8 --workers 2 -- reproduce --quick --out results --cache cache

On one machine this starts a LocalCluster. With --scheduler ADDRESS it joins a running one, such as
that of dask-jobqueue, whose workers see the same directories. A worker that dies loses nothing but
the piece at hand: Dask runs its shard again, and the shard finds its finished pieces in the cache.
"""

import argparse
import json
import subprocess
import sys

from dask.distributed import Client, LocalCluster, as_completed

WORTH_REPEATING = 75


def compute(batwing, command, shard, threads):
    """Computes one shard; returns the exit code and what was said.

    Raises where the shard is worth repeating, so that Dask does so.
    """
    words = [batwing, *command, "--shard", shard, "--threads", str(threads), "--quiet"]
    done = subprocess.run(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode == WORTH_REPEATING:
        raise RuntimeError(done.stderr.strip())
    return done.returncode, done.stderr.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shards", type=int, required=True)
    parser.add_argument("--workers", type=int, default=2, help="processes of a LocalCluster")
    parser.add_argument("--threads", type=int, default=1, help="threads of a shard")
    parser.add_argument("--scheduler", help="address of a running scheduler")
    parser.add_argument("--batwing", default="batwing", help="the program, on every worker")
    parser.add_argument("command", nargs="+", help="the command, after --")
    options = parser.parse_args()

    if options.scheduler:
        client = Client(options.scheduler)
    else:
        # A shard is a process of its own: one at a time for each worker.
        client = Client(LocalCluster(n_workers=options.workers, threads_per_worker=1))
    with client:
        shards = [f"{number}/{options.shards}" for number in range(options.shards)]
        # pure=False: a result is the files that a shard leaves, not what it returns.
        left = client.map(
            lambda shard: compute(options.batwing, options.command, shard, options.threads),
            shards,
            pure=False,
            retries=3,
        )
        names = dict(zip(left, shards))
        failed = False
        for future in as_completed(left):
            try:
                code, said = future.result()
            except RuntimeError as error:
                code, said = WORTH_REPEATING, str(error)
            print(f"shard {names[future]}: exit code {code}{': ' + said if said else ''}", flush=True)
            failed = failed or code not in (0, WORTH_REPEATING)
    if failed:
        sys.exit(1)
    plan = subprocess.run(
        [options.batwing, "plan", "--json", "--shards", str(options.shards), "--", *options.command],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    job = json.loads(plan.stdout)["job"]
    sys.exit(subprocess.run([options.batwing, "merge", job]).returncode)


if __name__ == "__main__":
    main()
