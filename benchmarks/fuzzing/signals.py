"""Processes that are killed or interrupted at a random moment of their work.

A child is forked, so that a signal arrives in the work and not in the imports.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

from arrivals.__main__ import main
from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import RandomWalk
from arrivals.scenarios.experiments.monte_carlo import monte_carlo
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.simulations.sampled_source import InterpolationTone
from arrivals.trackers import Kalman, Run
from fuzzing.command_line import prepare
from fuzzing.files import folder
from fuzzing.judging import Call

TRACK = ["track", "tow.wav", "--array", "array.toml", "--frequency", "1000", "--window", "64",
         "--tracker", "mvdr", "--quiet", "--out", "out.csv"]  # fmt: skip
N_RUNS = 15


def kinds() -> list[str]:
    """Return what happens to what."""
    return ["kill a table", "kill a study", "interrupt track"]


@cache
def _table() -> Run:
    model = LinearMeasurement([[1.0]], [[1.0]])
    z = np.random.default_rng(0).standard_normal((2000, 1))
    return Kalman(RandomWalk(0.1, 1), model, [0.0], [[1.0]]).run(z)


@cache
def _lines() -> bytes:
    """Return the complete table."""
    path = folder() / "complete.csv"
    _table().to_csv(path)
    return path.read_bytes()


def _study(path: Path) -> Study:
    scenario = InterpolationTone(n_steps=8, n_sensors=3)
    return monte_carlo(scenario, ["interpolation_ekf"], N_RUNS, out=path)


def _values(study: Study) -> dict[int, float]:
    method, metric = study.methods[0], next(iter(study.config["metrics"]))
    return study.values(metric, method)


@cache
def _expected() -> dict[int, float]:
    return _values(_study(folder() / "complete-study.csv"))


def _write_tables(path: Path) -> int:
    while True:
        _table().to_csv(path)


def _write_study(path: Path) -> int:
    _study(path)
    return 0


def _track() -> int:
    os.chdir(folder() / "work")
    return main(TRACK)


def signalled(work: Callable[[], int], number: int, after: float) -> tuple[int, str]:
    """Fork a child that works, send it a signal; return its status and its standard error."""
    reader, writer = os.pipe()
    errors = folder() / "errors.txt"
    child = os.fork()
    if child == 0:
        status = 99
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sink = os.open(errors, os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
            os.dup2(sink, 2)
            os.write(writer, b"1")
            status = work()
        except KeyboardInterrupt:
            status = 130
        finally:
            os._exit(status)
    os.read(reader, 1)
    time.sleep(after)
    os.kill(child, number)
    _, status = os.waitpid(child, 0)
    os.close(reader)
    os.close(writer)
    return status, errors.read_text(errors="replace")


def calls(kind: str, rng: np.random.Generator) -> Iterator[Call]:
    """Yield one child that is killed or interrupted, and what it left."""
    path, after = folder() / "killed.csv", float(rng.uniform(0.0, 0.06))
    if kind == "kill a table":
        _lines()
        path.unlink(missing_ok=True)
        yield Call(f"kill -9 after {after:.3f} s of writing a table",
                   lambda: signalled(lambda: _write_tables(path), signal.SIGKILL, after),
                   check=lambda _: _wrong_table(path))  # fmt: skip
    elif kind == "kill a study":
        _expected()
        path.unlink(missing_ok=True)
        yield Call(f"kill -9 after {after:.3f} s of a study",
                   lambda: signalled(lambda: _write_study(path), signal.SIGKILL, after),
                   check=lambda _: _wrong_study(path))  # fmt: skip
    else:
        place = prepare(n_samples=60_000)
        after *= 2
        yield Call(f"interrupt after {after:.3f} s of tracking",
                   lambda: signalled(_track, signal.SIGINT, after),
                   check=lambda result: _wrong_interrupt(place, *result))  # fmt: skip


def _wrong_table(path: Path) -> str | None:
    if path.exists() and path.read_bytes() != _lines():
        return "half a table under its final name"
    _table().to_csv(path)
    left = [entry.name for entry in path.parent.iterdir() if entry.name.endswith(".part")]
    return f"parts left after the next table: {len(left)}" if left else None


def _wrong_study(path: Path) -> str | None:
    """Return what is wrong with a study that goes on after the kill."""
    if path.exists() and path.stat().st_size:
        Study.read(path).summary()
    return None if _values(_study(path)) == _expected() else "another result after the kill"


def _wrong_interrupt(place: Path, status: int, errors: str) -> str | None:
    new = {entry.name for entry in place.iterdir()} - {
        "tow.wav", "array.toml", "levels.csv", "places.csv", "folder",
    }  # fmt: skip
    code = os.waitstatus_to_exitcode(status)
    if code not in (0, 130) or "Traceback" in errors:
        return f"status {code} after an interrupt: {errors:.200}"
    if code == 130 and new:
        return f"an interrupt left {sorted(new)}"
    return None if code == 130 or new == {"out.csv"} else f"left {sorted(new)}"
