"""Memory of `run` over 100 000 steps of 15 sensors, and of its result."""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import create
from arrivals.typing import Complex


def snapshots(model: ArraySnapshot, n_steps: int, gaps: bool) -> Iterator[Complex]:
    """Yield snapshots of two sources one by one, so that the input takes no memory.

    With gaps, a random half of the sensors is missing from every other step.
    """
    rng = np.random.default_rng(0)
    for n in range(n_steps):
        z = model.simulate([0.3, -0.5], rng.standard_normal(2), rng)
        if gaps and n % 2:
            z[rng.random(len(z)) < 0.5] = np.nan
        yield z


def main() -> None:
    """Print the peak memory of the process before and after."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--trackers", nargs="+", default=["cbf", "svalse"])
    parser.add_argument("--gaps", action="store_true", help="missing sensors")
    parser.add_argument("--circle", action="store_true", help="32 sensors in place of the line")
    options = parser.parse_args()
    line, circle = SensorArray.ula(15, spacing=0.5), SensorArray.uca(32, radius=2.0)
    model = ArraySnapshot(circle if options.circle else line, wavelength=1.0, noise=0.01)
    for name in options.trackers:
        create(name, measurement=model).run(snapshots(model, 2, options.gaps))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        started = time.process_time()
        run = create(name, measurement=model).run(snapshots(model, options.steps, options.gaps))
        cpu = time.process_time() - started
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        arrays = [*run.fields.values(), run.x, run.n_found, run.time]
        result = sum(array.nbytes for array in arrays) / 2**20
        print(
            f"{name}: {len(run)} steps, {cpu:.0f} s CPU, result {result:.0f} MB, "
            f"process {before:.0f} MB before, peak {peak:.0f} MB"
        )


if __name__ == "__main__":
    main()
