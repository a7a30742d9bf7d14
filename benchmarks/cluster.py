"""Study on a local dask cluster: throughput of 1 and 2 workers, and with one worker killed.

Scheduler and workers are separate processes, started by their command lines. Needs
arrivals[cluster].
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sysconfig
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from typing import Any

from arrivals.scenarios import Study, create, monte_carlo

DASK = Path(sysconfig.get_path("scripts")) / "dask"
TRACKERS = ["cbf", "ssbl", "svalse"]


@contextmanager
def cluster(n_workers: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Start a scheduler and workers as the backend of joblib."""
    from distributed import Client
    from joblib import parallel_config

    with tempfile.TemporaryDirectory() as folder:
        where = str(Path(folder) / "scheduler.json")
        common = ["--scheduler-file", where, "--no-dashboard"]
        commands = [["scheduler", "--port", "0"]]
        commands += [["worker", "--nthreads", "1", "--no-nanny"]] * n_workers
        quiet: dict[str, Any] = {"cwd": folder, "stdout": subprocess.DEVNULL,
                                 "stderr": subprocess.DEVNULL,
                                 "env": os.environ | {"OPENBLAS_NUM_THREADS": "1"}}  # fmt: skip
        started = [subprocess.Popen([DASK, c[0], *common, *c[1:]], **quiet) for c in commands]
        try:
            with Client(scheduler_file=where) as client, parallel_config(backend="dask"):
                client.wait_for_workers(n_workers, timeout=60)
                yield started[1:]
        finally:
            for process in reversed(started):  # workers before their scheduler
                stop(process)


def stop(process: subprocess.Popen[bytes]) -> None:
    """Terminate a process, or kill it after 10 s."""
    process.terminate()
    try:
        process.wait(timeout=10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def numbers(study: Study) -> list[tuple[Any, ...]]:
    """Return the reproducible rows."""
    return [row[:5] for row in study.rows() if row.metric != "cpu_ms"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    runs = parser.parse_args().runs
    scenario = create("svalse_fig6")
    options: dict[str, Any] = {"metrics": ["gospa"], "batch": 1}
    monte_carlo(scenario, TRACKERS, 2, **options)  # imports
    started = time.perf_counter()
    here = monte_carlo(scenario, TRACKERS, runs, **options)
    print("| where | runs a second | equal numbers |\n|---|---|---|")
    alone = time.perf_counter() - started
    print(f"| this process | {runs / alone:.2f} | |", flush=True)
    for n_workers in (1, 2):
        with cluster(n_workers):
            monte_carlo(scenario, TRACKERS, 2 * n_workers, **options)
            started = time.perf_counter()
            study = monte_carlo(scenario, TRACKERS, runs, **options)
            took = time.perf_counter() - started
        same = numbers(study) == numbers(here)
        print(f"| {n_workers} worker(s) | {runs / took:.2f} | {same} |", flush=True)
    with cluster(2) as workers:
        started = time.perf_counter()
        Timer(took / 3, workers[0].kill).start()
        study = monte_carlo(scenario, TRACKERS, runs, **options)
        took = time.perf_counter() - started
    same = numbers(study) == numbers(here)
    print(f"| 2 workers, one killed after a third | {runs / took:.2f} | {same} |")


if __name__ == "__main__":
    main()
