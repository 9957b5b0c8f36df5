#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Kills shards and merges at random moments, and compares what repetition leaves with the bytes of
the uninterrupted command.

    kills.py BATWING FOLDER [--kills 200] [--seed 1] [--tmpfs]

Blows: SIGKILL or SIGTERM of a shard, of a merge, two shards of one number at once of which one is
killed, and, with --tmpfs (root), a file system that is full. After each round every shard is
repeated until it is done, and the job merged: the tree of results and cache must be that of the
uninterrupted command, with no partial file. FOLDER is emptied.
"""

import argparse
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import time

WORTH_REPEATING = 75
# A shard that has not set its handler yet ends by SIGTERM itself.
ENDED = {0, WORTH_REPEATING, -signal.SIGKILL, -signal.SIGTERM}

STUDY = """
name = "kills"
designs = ["d1.toml"]
models = ["geometric", "hybrid"]
paths = 64000

[base.set]
"hybrid.tolerance" = 0.05
"hybrid.kx_per_zone" = 2
"hybrid.ky_count" = 6

[[factors]]
name = "box"
key = "led.reflectance"
values = [0.5, 0.7, 0.9]
"""

PROBLEM = """
name = "closer"
design = "bare-dome.toml"

[[variables]]
key = "array.pitch_mm"
from = 4.5
to = 12.0

[[objective.terms]]
figure = "uniformity"

[[stages]]
evaluations = 48
restarts = 1
population = 6

[verification]
paths = 640_000
"""


def content(path):
    """The bytes of a file; of the log of a search, without what depends on time."""
    content = path.read_bytes()
    return re.sub(rb'"(seconds|tables)":[0-9.e-]+', b"", content) if path.name == "log.jsonl" else content


class Campaign:
    def __init__(self, batwing, folder, chance):
        self.batwing, self.folder, self.chance = batwing, folder, chance
        self.faults = {}

    def words(self, command, place, *more):
        at = ["--out", f"{place}/out", "--cache", f"{place}/cache"]
        return [self.batwing, *command, *at, "--quiet", "--threads", "1", *more]

    def start(self, words):
        return subprocess.Popen(
            words, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )

    def fault(self, name):
        self.faults[name] = self.faults.get(name, 0) + 1

    def kill(self, process, within, name):
        """Kills the process within so many seconds; counts the fault if it was alive."""
        time.sleep(self.chance.uniform(0, within))
        if process.poll() is None:
            hard = self.chance.random() < 0.8
            process.send_signal(signal.SIGKILL if hard else signal.SIGTERM)
            self.fault(name)
        said = process.communicate()[1]
        assert process.returncode in ENDED, (process.args, process.returncode, said)

    def finish(self, words):
        """Repeats until it is done."""
        for _ in range(5):
            process = self.start(words)
            said = process.communicate()[1]
            if process.returncode == 0:
                return
            assert process.returncode == WORTH_REPEATING, (words, process.returncode, said)
        raise AssertionError(f"{words} is never done: {said}")

    def round(self, command, seconds, most):
        """One job, up to `most` faults at it, and its comparison with the whole."""
        place = "shared"
        count = self.chance.choice([1, 2, 3, 5, 8])
        shards = [self.words(command, place, "--shard", f"{i}/{count}") for i in range(count)]
        merge = [self.batwing, "merge", f"{place}/out", "--quiet"]
        for _ in range(most):
            shard = self.chance.choice(shards)
            kind = self.chance.random()
            if kind < 0.6:
                self.kill(self.start(shard), seconds / count, "shard")
            elif kind < 0.8:
                twin = self.start(shard)
                self.kill(self.start(shard), seconds / count, "one of two shards of one number")
                self.kill(twin, seconds, "the other")
            elif os.path.exists(self.folder / place / "out/job.json"):
                self.kill(self.start(merge), 0.2, "merge of an incomplete job")
        for shard in self.chance.sample(shards, len(shards)):
            self.finish(shard)
        while True:
            process = self.start(merge)
            if self.chance.random() < 0.5:
                self.kill(process, 2.0, "merge")
            else:
                said = process.communicate()[1]
                assert process.returncode in ENDED, said
            if process.returncode == 0:
                break
            if process.returncode == WORTH_REPEATING or not self.is_job(place):
                break
        if self.is_job(place):
            self.finish(merge)
        self.compare(place, command)
        shutil.rmtree(self.folder / place)

    def is_job(self, place):
        return os.path.exists(self.folder / place / "out/job.json")

    def compare(self, place, command):
        def tree(root):
            paths = sorted(p for p in root.rglob("*") if p.is_file())
            # A merge that was killed once its results were whole may leave pieces.
            return {p.relative_to(root) for p in paths if "jobs" not in p.parts}

        whole, shared = self.folder / command[0], self.folder / place
        left = tree(shared)
        assert left == tree(whole), left ^ tree(whole)
        for path in left:
            assert content(whole / path) == content(shared / path), path

    def full_disk(self, command, kilobytes):
        """A cache on a file system that is full, then is not."""
        place = self.folder / "shared"
        (place / "cache").mkdir(parents=True)
        mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(place / "cache")]
        subprocess.run(mount, check=True)
        try:
            words = self.words(command, "shared", "--shard", "0/1")
            process = self.start(words)
            said = process.communicate()[1]
            assert process.returncode == WORTH_REPEATING, (process.returncode, said)
            assert "No space left" in said, said
            self.fault("full disk")
            remount = ["mount", "-o", "remount,size=4g", str(place / "cache")]
            subprocess.run(remount, check=True)
            self.finish(words)
            self.finish([self.batwing, "merge", "shared/out", "--quiet"])
            self.compare("shared", command)
        finally:
            subprocess.run(["umount", str(place / "cache")], check=True)
            shutil.rmtree(place)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("batwing", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tmpfs", action="store_true")
    options = parser.parse_args()
    shutil.rmtree(options.folder, ignore_errors=True)
    options.folder.mkdir(parents=True)
    data = pathlib.Path(__file__).resolve().parents[2] / "data/designs"
    design = (data / "d1.toml").read_text()
    coarse = "tolerance = 0.05\nkx_per_zone = 2\nky_count = 6"
    lines = [coarse if l.startswith("tolerance ") else l for l in design.splitlines()]
    design = "\n".join(l for l in lines if not l.startswith(("kx_per_zone", "ky_count")) or "\n" in l)
    # Relief on two elements alone, so that a job takes seconds.
    design = design.replace("to = 17", "to = 2", 1).replace(
        "[[elements.shapes]]",
        '[[elements.shapes]]\nfrom = 3\nto = 17\ntype = "smooth"\n\n[[elements.shapes]]',
        1,
    )
    (options.folder / "d1.toml").write_text(design + "\n")
    (options.folder / "study.toml").write_text(STUDY)
    (options.folder / "problem.toml").write_text(PROBLEM)
    shutil.copy(data / "bare-dome.toml", options.folder)
    campaign = Campaign(str(options.batwing.resolve()), options.folder, random.Random(options.seed))
    commands = [
        ["run", "d1.toml", "--paths", "640000"],
        ["bsdf", "d1.toml", "--rings", "5,15"],
        ["study", "study.toml"],
        ["optimise", "problem.toml"],
    ]
    times = []
    for command in commands:
        begin = time.monotonic()
        campaign.finish(campaign.words(command, command[0]))
        times.append(time.monotonic() - begin)
        print(f"{' '.join(command)}: {times[-1]:.1f} s", flush=True)
    if options.tmpfs:
        for command, kilobytes in zip(commands, [2048, 128, 128, 64]):
            campaign.full_disk(command, kilobytes)
            print(f"full disk: {' '.join(command)}: same bytes", flush=True)
    begin = time.monotonic()
    rounds = 0
    while sum(campaign.faults.values()) < options.kills:
        number = rounds % len(commands)
        campaign.round(commands[number], times[number], 8)
        rounds += 1
        faults = sum(campaign.faults.values())
        print(f"round {rounds}: {commands[number][0]}, {faults} faults, same bytes", flush=True)
    seconds = time.monotonic() - begin
    print(json.dumps({"rounds": rounds, "faults": campaign.faults, "seconds": round(seconds)}))


if __name__ == "__main__":
    sys.exit(main())
