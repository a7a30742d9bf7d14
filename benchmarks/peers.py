"""CPU time of this library beside that of its peers: the whole table, interleaved in one run.

    python benchmarks/peers.py [--only beamforming subspace] [--rounds 9]

Ours and the peer's take turns; the ratio is the median over the rounds of the CPU time of one over
the other. Peers that are not installed are named, and left out: `pip install -e ".[bench]"`.
"""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import time
import warnings
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from peer_jobs import Job
from peer_jobs.figures import figures

SHORTEST = 0.05  # s of CPU in which a job is repeated, in each round
PEERS = ("filterpy", "simdkalman", "stonesoup", "pyroomacoustics", "acoular", "doa-py",
         "soundfile", "scipy", "numpy")  # fmt: skip


class Timed(NamedTuple):
    """CPU time of a job, s, by this library and by the peer, and the ratio."""

    ours: float
    peer: float
    ratio: float


def modules() -> list[str]:
    """Return the modules of jobs: those that have a function `jobs`."""
    folder = Path(__file__).with_name("peer_jobs")
    return sorted(
        path.stem for path in folder.glob("*.py") if "def jobs(" in path.read_text("utf-8")
    )


def timed(job: Job, rounds: int) -> Timed:
    """Return the medians over rounds in which this library and the peer take turns."""
    n_ours, n_peer = _repetitions(job.ours), _repetitions(job.peer)
    rows = [(_cpu(job.ours, n_ours), _cpu(job.peer, n_peer)) for _ in range(rounds)]
    ours, peer = np.array(rows).T
    return Timed(float(np.median(ours)), float(np.median(peer)), float(np.median(ours / peer)))


def _repetitions(work: Callable[[], object]) -> int:
    for _ in range(2):  # what is made once, or at the second step
        work()
    return max(1, int(SHORTEST / max(_cpu(work, 1), 1e-6)))


def _cpu(work: Callable[[], object], n: int) -> float:
    started = time.process_time()
    for _ in range(n):
        work()
    return (time.process_time() - started) / n


def rows(names: list[str], rounds: int) -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| job | ours, ms | peer, ms | ratio | wanted | met | peer |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for name in names:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of peers
            for job in importlib.import_module(f"peer_jobs.{name}").jobs():
                t = timed(job, rounds if _is_short(job) else min(rounds, 3))
                met = "yes" if t.ratio <= job.limit else "**no**"
                yield (
                    f"| {job.name} | {1e3 * t.ours:.4g} | {1e3 * t.peer:.4g} | {t.ratio:.2f} | "
                    f"{job.limit:g} | {met} | {job.peer_name} |"
                )


def _is_short(job: Job) -> bool:
    """Return True if a job takes less than a second."""
    return _cpu(job.ours, 1) < 1.0


def versions() -> str:
    """Return the versions of Python, of this library and of the peers, and those left out."""
    known, missing = [f"Python {platform.python_version()}"], []
    for name in ("arrivals", *PEERS):
        try:
            known.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    left_out = f"\n\nNot installed, left out: {', '.join(missing)}." if missing else ""
    half = len(known) // 2
    return f"Versions: {', '.join(known[:half])},\n{', '.join(known[half:])}.{left_out}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=modules(), default=modules())
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--no-figures", action="store_true", help="without those of no peer")
    options = parser.parse_args()
    for line in rows(options.only, options.rounds):
        print(line, flush=True)
    if not options.no_figures:
        print("\n| figure | value | wanted | met |\n| --- | --- | --- | --- |")
        for figure in figures():
            met = "yes" if figure.value <= figure.limit else "**no**"
            value = f"{figure.value:.3g} {figure.unit}"
            print(f"| {figure.name} | {value} | {figure.limit:g} | {met} |", flush=True)
    print(f"\n{versions()}")


if __name__ == "__main__":
    main()
