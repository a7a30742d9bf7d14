"""Malformed arguments of the command line, in this process.

The folder of work is a temporary one, and no argument names a place outside it.
"""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.__main__ import main
from fuzzing.files import ARRAY, LEVELS, PLACES, folder
from fuzzing.judging import Call

TRACK = ["track", "tow.wav", "--array", "array.toml", "--frequency", "1000", "--window", "64",
         "--tracker", "cbf", "--quiet"]  # fmt: skip
CHOSEN = ["track", "tow.wav", "--array", "array.toml", "--quiet"]
SOUND = ["track", "tow.wav", "--array", "array.toml", "--tracker", "interpolation_ekf",
         "--band", "100", "900", "--set", "doa=0.1", "--quiet"]  # fmt: skip
RANGE = ["track", "tow.wav", "--array", "array.toml", "--frequency", "1000", "--window", "64",
         "--unknowns", "range", "--nearest", "2", "--quiet"]  # fmt: skip
LOCATE = ["locate", "levels.csv", "--sensors", "places.csv", "--quiet"]
COMMANDS: dict[str, list[str]] = {
    "track": TRACK,
    "track chosen": CHOSEN,
    "track samples": SOUND,
    "track range": RANGE,
    "locate": LOCATE,
    "list": ["list"],
    "demo": ["demo", "nothing", "--quiet"],
    "reproduce": ["reproduce", "nothing", "--quiet"],
}
OPTIONS: dict[str, tuple[str, ...]] = {
    "track": ("--frequency", "--frequencies", "--band", "--snapshots", "--snr",
              "--tracker", "--set", "--out", "--signals", "--rate", "--window", "--hop",
              "--variable", "--transpose", "--dtype", "--channels", "--quiet", "--array",
              "--nothing", "--unknowns", "--nearest", "--jsonl", "--late", "--live"),
    "locate": ("--sensors", "--alpha", "--sigma-db", "--floor-db", "--power-db", "--sources",
               "--tracker", "--out", "--speed", "--q", "--power-std-db", "--r-min", "--nothing"),
}  # fmt: skip
VALUES = (
    "", " ", "nan", "inf", "-inf", "-1", "0", "-0.0", "1", "2", "0.5", "1e-320", "1e139", "1e200",
    "1e400", "10000000000", "9" * 5000, "text", "a\nb", "\x00", "é", "\udcff", "1,5", "0x10", "1j",
    "None", "True", "[]", "()", "{}", "tow.wav", "array.toml", "levels.csv", "places.csv",
    "nothing.wav", "nothing/there.csv", "out.csv", "out.wav", "out.npy", "out.txt", "folder", ".",
    "sphere", "range", "cbf", "svalse", "kalman", "music", "rss_ml", "interpolation_ekf",
    "peaks_gnn", "int32", "self",
    "n_directions=1e9", "n_directions=0", "n_directions=10**9", "max_sources=None", "=", "a=b",
    "threshold_db=nan", "threshold_db=[1,2]", "motion__kappa=-1", "n_directions=" + "9" * 400,
    "doa=nan", "std=inf", "solver__tolerance='a'", "measurement=None", "n_directions=" + "[" * 300,
    "--", "-", "--help", "--out", "-h",
)  # fmt: skip


def kinds() -> list[str]:
    """Return the subcommands."""
    return list(COMMANDS)


def prepare(n_samples: int = 256) -> Path:
    """Return a folder with small valid inputs; only they are in it."""
    place = folder() / "work"
    (place / "folder").mkdir(parents=True, exist_ok=True)
    for entry in place.iterdir():
        if entry.is_file() or entry.is_symlink():
            entry.unlink()
    from scipy.io import wavfile

    phase = 0.25 * np.pi * np.arange(n_samples)[:, None] + 0.4 * np.arange(3)
    noise = np.random.default_rng(0).standard_normal(phase.shape)
    wavfile.write(place / "tow.wav", 8000, (8000 * np.cos(phase) + 100 * noise).astype("<i2"))
    (place / "array.toml").write_text(ARRAY)
    (place / "levels.csv").write_text(LEVELS)
    (place / "places.csv").write_text(PLACES)
    return place


def calls(kind: str, rng: np.random.Generator) -> Iterator[Call]:
    """Yield a command with one to three changed, added or dropped arguments."""
    arguments = list(COMMANDS[kind])
    for _ in range(int(rng.integers(1, 4))):
        chance = rng.random() if kind not in ("demo", "reproduce") else 0.0  # else they would run
        at = int(rng.integers(1, len(arguments) + 1))
        value = str(rng.choice(VALUES))
        if chance < 0.4:
            name = kind.partition(" ")[0]
            option = str(rng.choice(OPTIONS.get(name, ("--quiet", "--nothing"))))
            arguments += [option, value]
        elif chance < 0.75 and at < len(arguments):
            arguments[at] = value
        elif chance < 0.85 and at < len(arguments):
            del arguments[at]
        else:
            arguments.insert(at, value)
    text = " ".join(repr(argument)[1:-1][:40] for argument in arguments)
    yield Call(text, lambda: _run(arguments), None, (), _wrong, ())


def _run(arguments: list[str]) -> Any:
    """Run a command; return its status, its outputs and the files that it left."""
    place, before = prepare(), os.getcwd()
    given = sorted(os.listdir(place))
    out, err = io.StringIO(), io.StringIO()
    stdin = io.TextIOWrapper(io.BytesIO(b"\x01\x00" * 600))
    os.chdir(place)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), _as_stdin(stdin):
            try:
                status: Any = main(arguments)
            except SystemExit as error:  # of --help
                status = error.code or 0
    finally:
        os.chdir(before)
    return status, out.getvalue(), err.getvalue(), given, sorted(os.listdir(place))


@contextlib.contextmanager
def _as_stdin(stream: Any) -> Iterator[None]:
    import sys

    old, sys.stdin = sys.stdin, stream
    try:
        yield
    finally:
        sys.stdin = old


def _wrong(result: Any) -> str | None:
    """Return what is wrong with the end of a command, or None."""
    status, out, err, before, after = result
    new = sorted(set(after) - set(before))
    if status not in (0, 2):
        return f"status {status}"
    lines = [line for line in err.splitlines() if "Warning" not in line]
    if status == 2:
        messages = [line for line in lines if line.startswith("arrivals: ")]
        if len(messages) != 1:
            return f"{len(messages)} messages with status 2: {err!r:.200}"
        if "Traceback" in err:
            return f"traceback: {err!r:.200}"
        return f"an error left {new}" if new else None
    if any(name.endswith(".part") for name in new):
        return f"left {new}"
    cells = {cell for line in out.splitlines()[1:] for cell in line.split(",")}
    return "nan or inf in the table" if cells & {"nan", "inf", "-inf"} else None
