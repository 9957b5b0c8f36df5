# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the package does to its process: signals, threads, forks, panics, pickles, import time."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import batwing
from batwing import _native, cli, rcwa


def grating() -> rcwa.Grating:
    return rcwa.Grating(rcwa.Relief.triangle(2.0, (1.7, 0.6), ridge=1.41, groove=1.0), 1.41, 1.0)


def reflectance(theta: float) -> float:
    return float(rcwa.solve(grating(), 0.55, theta, orders=12, slices=6).total_reflected)


@pytest.fixture
def answered() -> Iterator[None]:
    """Ctrl-C as in a terminal; background jobs of a shell ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt_after(seconds: float) -> None:
    threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT)).start()


def test_ctrl_c_answers_within_a_second_and_leaves_the_interpreter_sane(answered: None) -> None:
    interrupt_after(0.3)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _native.wait(30.0)
    assert time.monotonic() - began < 1.3
    interrupt_after(0.3)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        rcwa.solve(grating(), 0.55, np.linspace(-80, 80, 20_000), 31.0, orders=60, slices=60)
    assert time.monotonic() - began < 1.3
    assert reflectance(10.0) > 0
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_call_after_ctrl_c_waits_for_no_deaf_work(answered: None) -> None:
    interrupt_after(0.3)
    with pytest.raises(KeyboardInterrupt):
        _native.wait(6.0, deaf=True, threads=1)
    began = time.monotonic()
    _native.wait(0.1, threads=1)
    assert time.monotonic() - began < 2.0


def test_the_command_after_ctrl_c_returns_its_code() -> None:
    line = (
        "import os, signal, threading, batwing.cli as cli\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "code = cli.main(['bsdf', 'd1.toml', '--rings', '75', '--tolerance', '1e-5', '--no-cache',"
        " '--quiet'])\n"
        "print('still here', code)\n"
    )
    folder = os.path.join(os.path.dirname(__file__), "..", "..", "..", "data", "designs")
    done = subprocess.run(
        [sys.executable, "-c", line], capture_output=True, text=True, cwd=folder, timeout=60
    )
    assert done.stdout == "still here 130\n", done


def test_the_command_starts_the_package_and_ends_with_the_codes_of_the_guide(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    line = ["submit", "--slurm", "--shards", "2", "--", "reproduce", "--quick", "--out", str(out)]
    assert cli.main([*line, "--cache", str(tmp_path / "cache")]) == 0
    script = (out / "slurm" / "shards.sh").read_text()
    assert f"exec {sys.executable} -m batwing reproduce" in script
    version = subprocess.run(
        [sys.executable, "-m", "batwing", "--version"], capture_output=True, text=True, check=True
    )
    assert version.stdout.startswith("batwing ")


def started(before: str, words: list[str]) -> subprocess.Popen[str]:
    """Starts the command in a process, and waits a second from when Python has imported it."""
    line = before + "from batwing.cli import program; print('ready', flush=True); program()"
    words = [sys.executable, "-c", line, *words]
    child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "ready\n"
    time.sleep(1.0)
    return child


@pytest.mark.skipif(os.name != "posix", reason="no signals here")
@pytest.mark.parametrize(("stop", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_signals_end_the_command_and_leave_no_partial_file(
    tmp_path: Path, root: Path, stop: signal.Signals, code: int
) -> None:
    # Python takes over Ctrl-C unless a shell has it ignored.
    before = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    design = str(root / "data" / "designs" / "d1.toml")
    words = ["bsdf", design, "--rings", "75", "--tolerance", "1e-5", "--cache", str(tmp_path)]
    child = started(before, [*words, "--quiet"])
    child.send_signal(stop)
    assert child.wait(60) == code
    assert not list(tmp_path.rglob("*.partial"))


@pytest.mark.skipif(os.name != "posix", reason="no signals here")
def test_a_shard_that_is_stopped_ends_with_its_own_code(tmp_path: Path) -> None:
    words = ["reproduce", "--quick", "--out", str(tmp_path / "out"), "--shard", "0/2", "--quiet"]
    words += ["--cache", str(tmp_path / "cache"), "--threads", "1"]
    child = started("", words)
    child.send_signal(signal.SIGTERM)
    assert child.wait(60) == 75


def test_other_threads_run_meanwhile() -> None:
    counted = 0

    def count() -> None:
        nonlocal counted
        until = time.monotonic() + 0.4
        while time.monotonic() < until:
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    _native.wait(0.5)
    thread.join()
    assert counted > 10_000


def test_a_panic_becomes_an_exception() -> None:
    with pytest.raises(batwing.InternalError, match="asked to"):
        _native.panic()
    assert reflectance(10.0) > 0


def test_results_are_the_same_from_many_threads_and_on_any_number_of_them() -> None:
    theta = np.linspace(-60, 60, 16)
    alone = [reflectance(t) for t in theta]
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(reflectance, theta)) == alone
    for threads in (1, 2, 3):
        found = rcwa.solve(grating(), 0.55, theta, 20.0, orders=12, slices=6, threads=threads)
        first = rcwa.solve(grating(), 0.55, theta, 20.0, orders=12, slices=6)
        np.testing.assert_array_equal(found.reflected, first.reflected)
    batwing.set_threads(1)
    assert batwing.threads() == 1
    batwing.set_threads(None)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_other_processes_compute_too(method: str) -> None:
    theta = [0.0, 10.0]
    alone = [reflectance(t) for t in theta]
    with multiprocessing.get_context(method).Pool(2) as pool:
        assert pool.map_async(reflectance, theta).get(60) == alone


def test_gratings_and_results_can_be_pickled_and_copied() -> None:
    found = rcwa.solve(grating(), 0.55, [0.0, 10.0], orders=12, slices=6)
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again.reflected, found.reflected)
    np.testing.assert_array_equal(again.directions()[0], found.directions()[0])
    assert copy.deepcopy(found).slices == found.slices
    assert pickle.loads(pickle.dumps(grating())) == grating() and hash(grating()) == hash(grating())
    other = rcwa.Grating(rcwa.Relief.lamellar(2.0, 0.6, 0.5, 1.41, 1.0), 1.41, 1.0)
    assert other != grating()


def test_the_command_is_a_function(capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == 0
    assert capfd.readouterr().out.startswith("batwing ")
    assert cli.main(["rum"]) == 2
    assert "did you mean run?" in capfd.readouterr().err
    assert cli.main(["check", "missing.toml"]) == 1
    assert "missing.toml" in capfd.readouterr().err
    # Again: nothing of a command stays in the process.
    assert cli.main(["schema"]) == 0
    assert '"$schema"' in capfd.readouterr().out


def test_import_takes_less_than_that_of_numpy() -> None:
    line = (
        "import time\n"
        "a = time.perf_counter(); import numpy; b = time.perf_counter()\n"
        "import batwing; print((time.perf_counter() - b) / (b - a))"
    )
    ratios = [
        float(subprocess.run([sys.executable, "-c", line], capture_output=True, check=True).stdout)
        for _ in range(3)
    ]
    assert min(ratios) < 1.0


def test_progress_goes_to_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    reports: list[tuple[int, int, bool]] = []
    _native.set_progress(lambda done, total, ended: reports.append((done, total, ended)))
    try:
        theta = np.linspace(-80, 80, 24)
        rcwa.solve(grating(), 0.55, theta, 31.0, orders=30, slices=12, threads=1)
    finally:
        _native.set_progress(None)
    done = [report[0] for report in reports]
    assert len(reports) > 2 and done == sorted(done) and reports[-1][2]
    assert done[-1] == reports[-1][1]
    pytest.importorskip("tqdm")
    batwing.set_progress(True)
    rcwa.solve(grating(), 0.55, theta, 31.0, orders=30, slices=12, threads=1)
    batwing.set_progress(False)
