#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Shares a quick reproduction among two workers of Dask, kills one of them in the middle, and
compares the merged results with those of one command.

    dask_kill.py BATWING FOLDER [WHOLE]

Needs `distributed`. FOLDER is emptied. WHOLE are results of `reproduce --quick` with their cache in
`cache`, if there are such already.
"""

import filecmp
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

SHARDS = 8
GUIDE = pathlib.Path(__file__).resolve().parents[2] / "docs/guide/dask_shards.py"


def parent(process):
    """The parent of a process; 0 if it has ended."""
    try:
        text = pathlib.Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return 0
    return int(text.rsplit(")", 1)[1].split()[1])


def worker_of_a_shard(root):
    """A worker below process `root` that computes a shard, if there is one yet."""
    for name in os.listdir("/proc"):
        if not name.isdigit():
            continue
        try:
            words = pathlib.Path(f"/proc/{name}/cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if b"--shard" not in words or b"--" in words:
            continue
        worker = above = parent(name)
        while above > 1:
            if above == root:
                return worker
            above = parent(above)
    return None


def tree(root):
    return {path.relative_to(root) for path in root.rglob("*") if path.is_file()}


def main():
    batwing, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    command = ["reproduce", "--quick", "--out"]
    if len(sys.argv) > 3:
        whole = pathlib.Path(sys.argv[3])
    else:
        whole = folder / "whole"
        at = [whole, "--cache", whole / "cache", "--quiet"]
        begin = time.monotonic()
        subprocess.run([batwing, *command, *at], cwd=folder, check=True)
        print(f"one command: {time.monotonic() - begin:.1f} s", flush=True)

    begin = time.monotonic()
    guide = [sys.executable, GUIDE, "--batwing", batwing, "--shards", str(SHARDS), "--workers", "2"]
    at = ["shared", "--cache", "shared/cache"]
    dask = subprocess.Popen([*guide, "--", *command, *at], cwd=folder)
    worker = None
    while worker is None:
        assert dask.poll() is None, "Dask ended before a shard began"
        time.sleep(0.05)
        worker = worker_of_a_shard(dask.pid)
    time.sleep(1.0)
    os.kill(worker, signal.SIGKILL)
    print(f"killed worker {worker}", flush=True)
    assert dask.wait() == 0, dask.returncode
    print(f"{SHARDS} shards and their merge: {time.monotonic() - begin:.1f} s", flush=True)

    shared = folder / "shared"
    assert tree(whole) == tree(shared), tree(whole) ^ tree(shared)
    for path in tree(whole):
        assert filecmp.cmp(whole / path, shared / path, shallow=False), path
    print("two workers, one of them killed, leave the bytes of one command")


if __name__ == "__main__":
    main()
