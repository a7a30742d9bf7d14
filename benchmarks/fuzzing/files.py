"""Damaged files: mutations of small valid ones of every format that is read.

Everything is written into one temporary folder of the process.
"""

from __future__ import annotations

import atexit
import functools
import io
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.networks import read_network
from arrivals.recordings.readers import read
from arrivals.scenarios.experiments.monte_carlo import monte_carlo
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.simulations.sampled_source import InterpolationTone
from fuzzing.judging import Call

SAMPLES = np.round(np.random.default_rng(0).standard_normal((64, 3)), 3)
LEVELS = "time_s,a,b,c\n0,-60,-62.5,\n1,-61,-63,-59\n2,-60.5,-62,-58\n"
LONG = "time_s,sensor,rss_db\n0,a,-60\n0,b,-61\n1,c,-59\n1,a,-60.5\n"
DATES = (
    "timestamp,BSSID,tag,dBm\n2026-05-01T12:00:00.25Z,a,t,-60\n2026-05-01T12:00:00.5Z,b,t,-61\n"
    "2026-05-01T12:00:01.125Z,c,t,-59\n2026-05-01T12:00:01.5Z,a,t,-60.5\n"
)
SURVEY = "WigleWifi-1.6,model=x\nMAC,FirstSeen,RSSI,CurrentLatitude,CurrentLongitude\n" + "".join(
    f"02:00:00:00:00:00,2026-05-01 12:00:0{k},{-50 - k},60.17{k},24.94{k**2 % 7}\n"
    for k in range(5)
)
PLACES = "name,x_m,y_m\na,0,0\nb,10,0\nc,4,9\n"
ARRAY = 'kind = "ula"\nn_sensors = 3\nspacing = 0.17\nspeed = 343.0\nmissing = []\n'
POSITIONS = 'kind = "positions"\npositions = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.2]]\nspeed = 343.0\n'
CELLS = (
    b"", b"nan", b"inf", b"-1e999", b"1e400", b"1e200", b"text", b"1,5", b"1;5", b"0x10", b"1_000",
    b"\xff\xfe", b"\xef\xbb\xbf", b"\x00", b"\r", b"\n\n", b'"', b"'", b"[", b"{", b"9" * 5000,
    b"true", b"-1", b"1e-400", b"\xc3\xa9", b"\xe9", b"1+2j", b"=", b"#", b"[[]]", b"[" * 2000,
    b"a.b", b",,,",
)  # fmt: skip
WORDS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


@functools.cache
def folder() -> Path:
    """Return the temporary folder of this process."""
    path = Path(tempfile.mkdtemp(prefix="arrivals-fuzz-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


def _saved(save: Callable[..., object], *arrays: Any, **named: Any) -> bytes:
    buffer = io.BytesIO()
    save(buffer, *arrays, **named)
    return buffer.getvalue()


@functools.cache
def valid(kind: str) -> bytes:
    """Return a small valid file."""
    if kind.startswith("wav"):
        from scipy.io import wavfile

        dtype = {"wav": "<i2", "wav float": "<f4", "wav 8": "u1"}[kind]
        counts = (SAMPLES * 20 + 100).astype(dtype)
        return _saved(lambda file, data: wavfile.write(file, 8000, data), counts)
    if kind == "npy":
        return _saved(np.save, SAMPLES)
    if kind == "npz":
        return _saved(np.savez, samples=SAMPLES, rate=8000.0)
    if kind == "npz small":
        return _saved(np.savez_compressed, samples=SAMPLES, rate=8000.0)
    if kind.startswith("mat"):
        from scipy.io import savemat

        contents = {"samples": SAMPLES, "fs": 8000.0, "note": "a text", "parts": {"a": [1.0, 2.0]}}
        return _saved(savemat, contents, do_compression=kind == "mat small")
    if kind == "network npz":
        rss, places = SAMPLES - 60.0, np.arange(6.0).reshape(3, 2)
        return _saved(np.savez, rss_db=rss, sensor_xy=places, time=np.arange(64.0))
    if kind == "study":
        path = folder() / "valid-study.csv"
        scenario = InterpolationTone(n_steps=5, n_sensors=3)
        monte_carlo(scenario, ["interpolation_ekf"], runs=2, out=path)
        return path.read_bytes()
    return TEXTS[kind].encode()


TEXTS = {
    "csv": "time,a,b\n" + "".join(f"{n / 8},{n % 3},{n % 5}.5\n" for n in range(40)),
    "txt": "".join(f"{n % 3}\t{n % 5}.5\t1e-3\n" for n in range(40)),
    "csv complex": "".join(f"{n % 3}+1j;{n % 5}.5-2j\n" for n in range(40)),
    "array": ARRAY,
    "array positions": POSITIONS,
    "network": LEVELS,
    "network long": LONG,
    "network dates": DATES,
    "network survey": SURVEY,
    "sensors": PLACES,
}
BINARY = ("wav", "wav float", "wav 8", "npy", "npz", "npz small", "network npz", "mat", "mat small")


def kinds() -> list[str]:
    """Return the kinds of files."""
    return [*BINARY, *TEXTS, "study"]


def mutated(rng: np.random.Generator, content: bytes, is_text: bool) -> tuple[bytes, str]:
    """Return a damaged copy of a file, and what was done to it."""
    data, done = bytearray(content), []
    for _ in range(int(rng.integers(1, 4))):
        how = int(rng.integers(9 if is_text else 7))
        at = int(rng.integers(len(data))) if data else 0
        if how == 0 and data:
            data[at] ^= 1 << int(rng.integers(8))
        elif how == 1:
            del data[at:]
        elif how == 2:
            data[at : at + int(rng.integers(1, 9))] = rng.bytes(int(rng.integers(0, 9)))
        elif how == 3:
            n = int(rng.integers(1, 60))
            data[at:at] = data[at : at + n]
        elif how == 4:
            del data[at : at + int(rng.integers(1, 60))]
        elif how in (5, 6) and not is_text:  # sizes and types at the start are whole words
            at = int(rng.integers(min(len(data), 400) + 1)) // 2 * 2
            word, size = int(rng.choice(WORDS)), int(rng.choice([1, 2, 4, 8]))
            order = "little" if rng.random() < 0.8 else "big"
            data[at : at + size] = (word % 256**size).to_bytes(size, order)
        else:
            cell = CELLS[int(rng.integers(len(CELLS)))]
            end = at + int(rng.integers(0, 6))
            data[at:end] = cell
            how = 7
        done.append(f"{how}@{at}")
    return bytes(data), ",".join(done)


def calls(kind: str, rng: np.random.Generator) -> Iterator[Call]:
    """Yield the reading of a damaged file; now and then of an empty, absent or random one."""
    content, done = mutated(rng, valid(kind), kind not in BINARY)
    chance = rng.random()
    if chance < 0.02:
        content, done = (b"", "empty") if chance < 0.01 else (rng.bytes(300), "random bytes")
    path = folder() / f"damaged.{_suffix(kind)}"
    path.write_bytes(content)
    yield Call(f"{kind} {done}", lambda: _read(kind, path), None, (), _check,
               allowed=(ValueError, TypeError, OSError))  # fmt: skip


def _suffix(kind: str) -> str:
    first, _, _ = kind.partition(" ")
    return {"array": "toml", "network": "npz" if kind == "network npz" else "csv",
            "sensors": "csv", "study": "csv"}.get(first, first)  # fmt: skip


def _read(kind: str, path: Path) -> Any:
    if kind.startswith("array"):
        return SensorArray.from_toml(path)
    if kind == "study":
        return Study.read(path).summary()
    if kind == "network npz":
        return read_network(path)
    if kind.startswith("network"):
        places = folder() / "places.csv"
        places.write_text(PLACES)
        return read_network(path, None if kind == "network survey" else places)
    if kind == "sensors":
        levels = folder() / "levels.csv"
        levels.write_text(LEVELS)
        return read_network(levels, path)
    return read(path, rate=None if kind != "txt" else 100.0)


def _check(result: Any) -> str | None:
    """Return what is wrong with what was read."""
    for name in ("samples", "rss_db", "positions"):
        value = getattr(result, name, None)
        if isinstance(value, np.ndarray) and value.dtype.kind in "fc" and np.isinf(value).any():
            return f"silent inf in {name}"
    return None
