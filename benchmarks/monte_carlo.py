"""The runner of studies: overhead, speed-up by a second process, memory over many runs.

Limits: two processes at least 1.7 times one, overhead under 5 % of the trackers' time, memory flat.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time

from arrivals.scenarios import create, monte_carlo
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.simulations import SixSources

TRACKERS = ["cbf", "peaks_gnn", "sbl", "ssbl", "valse", "svalse"]
MEMORY = """
import resource
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.simulations import SixSources
settings = StudySettings(out={out!r}, batch=50)
compute_study(SixSources(n_steps=2), ["cbf"], {runs}, 0, settings)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def overhead(runs: int) -> None:
    """Print processor time of the runner beside that of the trackers."""
    monte_carlo(SixSources(n_steps=2), TRACKERS, 1)  # imports
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    study = monte_carlo("svalse_fig4", TRACKERS, runs)
    spent = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
    trackers = sum(50e-3 * study.array("cpu_ms", method).sum() for method in TRACKERS)
    share = spent / trackers - 1
    print(f"overhead: {spent:.1f} s, of which trackers {trackers:.1f} s: {100 * share:.1f} % "
          f"(limit 5 %: {'pass' if share < 0.05 else 'FAIL'})", flush=True)  # fmt: skip


def two_processes(runs: int) -> None:
    """Print the wall-clock time of one process and of two."""
    scenario, took = create("svalse_fig6"), {}
    for n_jobs in (1, 2):
        starting = StudySettings(batch=1, n_jobs=n_jobs)
        compute_study(scenario, ["cbf"], 4, 0, starting)  # starts the processes
        started = time.perf_counter()
        monte_carlo(scenario, ["ssbl", "svalse"], runs, metrics=["gospa"], n_jobs=n_jobs)
        took[n_jobs] = time.perf_counter() - started
    ratio = took[1] / took[2]
    print(f"{runs} runs: one process {took[1]:.0f} s, two {took[2]:.0f} s, {ratio:.2f} times "
          f"(limit 1.7: {'pass' if ratio >= 1.7 else 'FAIL'})", flush=True)  # fmt: skip


def memory() -> None:
    """Print the peak memory of studies of few and of many runs."""
    used = {}
    for runs in (100, 1000, 10_000):
        with tempfile.TemporaryDirectory() as folder:
            script = MEMORY.format(runs=runs, out=folder)
            done = subprocess.run(
                [sys.executable, "-c", script], capture_output=True, text=True, check=True
            )
        used[runs] = int(done.stdout) / 1024
        print(f"{runs} runs: {used[runs]:.1f} MB", flush=True)


def main() -> None:
    """Print the three measurements."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    runs = parser.parse_args().runs
    overhead(max(2, runs // 20))
    memory()
    two_processes(runs)


if __name__ == "__main__":
    main()
