"""CPU time of SVALSE and VALSE on Fig. 4, one run on one core, and of the imports."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from arrivals.scenarios import create
from arrivals.trackers import CoordinateSolver

FORMS: list[tuple[str, dict[str, Any]]] = [
    ("svalse", {}),
    ("valse", {}),
    ("svalse", {"engine": "coordinate"}),
    ("valse", {"engine": "coordinate"}),
    (
        "svalse",
        {
            "solver": CoordinateSolver(tolerance=1e-6, max_iterations=5000),
            "reference": "first",
        },
    ),
    ("svalse", {"solver": CoordinateSolver(posterior="mixture")}),
]


def steps() -> None:
    """Print CPU per step and per iteration, the median of five runs after a warm-up."""
    trial = create("svalse_fig4").sample(np.random.default_rng(1))
    print(
        "| tracker | iterations a step | CPU ms a step | CPU ms an iteration |\n|---|---|---|---|"
    )
    for name, params in FORMS:
        trial.tracker(name, **params).run(trial.measurements[:2])
        times = []
        for _ in range(5 if not params else 1):
            tracker = trial.tracker(name, **params)
            started = time.process_time()
            run = tracker.run(trial.measurements)
            times.append(time.process_time() - started)
        cpu, iterations = 1e3 * np.median(times), run.iterations.sum()
        what = ", ".join([name, *(f"{key}={value}" for key, value in params.items())])
        print(f"| {what} | {iterations / 50:.0f} | {cpu / 50:.1f} | {cpu / iterations:.2f} |")


def imports() -> None:
    """Print CPU of the imports, the median of seven fresh processes, beside numpy's alone."""
    print("\n| import | CPU s |\n|---|---|")
    for what in ("numpy", "arrivals", "arrivals.trackers", "arrivals.scenarios"):
        code = (
            f"import time; t = time.process_time(); import {what}; print(time.process_time() - t)"
        )
        took = [
            float(
                subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
            )
            for _ in range(7)
        ]
        print(f"| {what} | {np.median(took):.2f} |")


if __name__ == "__main__":
    steps()
    imports()
