"""A long run of one tracker: memory, finite numbers, covariance, and steps a second.

The measurements have gaps of up to 200 steps, single missing entries, loud and silent stretches;
steps have several lengths where the tracker takes them.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from fuzzing.tracker_cases import CASES
from fuzzing.trackers import wrong

ONE_STEP = ("ar_kalman_qrd_rls", "interpolation_ekf")  # a step is one sample
BEARINGS = ("ekf", "ukf", "particle")  # angles are neither loud nor silent
BLOCK, CHECK_EVERY, PARTS = 1000, 50, 10
GROWTH_MB = 8.0


def resident_mb() -> float:
    """Return the memory of the process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def stream(name: str, case: int, n_steps: int, seed: int) -> Iterator[tuple[Any, float]]:
    """Yield measurements, None in gaps, and lengths of steps."""
    rng = np.random.default_rng(seed)
    _, measurements = CASES[name][case]
    base = np.array(measurements)
    spread = 0.03 if name in BEARINGS else 0.05 * np.abs(base).mean()
    lengths = [1.0] if name in ONE_STEP else [0.5, 1.0, 1.0, 1.0, 2.0, 0.0, 1e-3]
    for start in range(0, n_steps, BLOCK):
        n = min(BLOCK, n_steps - start)
        z = base[np.arange(n) % len(base)] + spread * rng.standard_normal((n, *base.shape[1:]))
        z[rng.random(z.shape) < 0.01] = np.nan
        block = start // BLOCK
        if block % 5 == 1 and name not in BEARINGS:
            z[300:330] *= 10.0 ** rng.uniform(1, 6)  # loud
        if block % 7 == 2 and name not in BEARINGS:
            z[500:600] = 0.0
        gap = rng.integers(200) if block % 3 == 0 else 0
        for step, dt in enumerate(rng.choice(lengths, n).tolist()):
            yield (None if 700 <= step < 700 + gap else z[step]), dt


def soak(name: str, n_steps: int, seed: int = 0, case: int = 0) -> list[str]:
    """Run a tracker and print a line each tenth; return what was wrong."""
    make, _ = CASES[name][case]
    tracker: Any = make()
    faults: list[str] = []
    print(f"| {name}: steps | memory, MB | steps a second |\n|---|---|---|")
    memory, last = [resident_mb()], time.perf_counter()
    part = max(n_steps // PARTS, 1)
    for step, (z, dt) in enumerate(stream(name, case, n_steps, seed), start=1):
        tracker.predict(dt=dt)
        tracker.update(z)
        if step % CHECK_EVERY == 0 and (fault := wrong(tracker)):
            faults.append(f"step {step}: {fault}")
            if len(faults) > 5:
                break
        if step % part == 0:
            memory.append(resident_mb())
            now = time.perf_counter()
            print(f"| {step} | {memory[-1]:.1f} | {part / (now - last):.0f} |", flush=True)
            last = now
    growth = memory[-1] - memory[min(2, len(memory) - 1)]  # after caches are full
    if growth > GROWTH_MB:
        faults.append(f"memory grew by {growth:.1f} MB")
    return faults


def main() -> int:
    """Print the table of one tracker; the status is 1 if something was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tracker", choices=sorted(CASES))
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", type=int, default=0, help="which of the tracker's small cases")
    options = parser.parse_args()
    faults = soak(options.tracker, options.steps, options.seed, options.case)
    print("\n".join(faults) or "finite, symmetric, positive, flat")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
