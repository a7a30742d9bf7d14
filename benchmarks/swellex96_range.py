"""SVALSE with range on the simulated SWellEx-96 tow, by settings: GOSPA, ranges and time.

Steps 1 to 350 of the study `swellex96`, fields of modes and of rays. The first row has plane waves;
`p` is the prior probability that a wave is curved, `dB` the `max_snr_db` of the solver.
"""

from __future__ import annotations

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from arrivals.scenarios.metrics.gospa import mean_gospa
from arrivals.scenarios.reproduce.swellex96.figures_11_12 import BLOCKS, strong_directions
from arrivals.scenarios.reproduce.swellex96.ranges import LATE, MODELS, path_ranges, scores
from arrivals.scenarios.simulations.swellex96 import TowPastLine
from arrivals.trackers import NewtonSolver

SETTINGS: tuple[tuple[float, float | None] | None, ...] = (
    None, (0.2, None), (0.2, 15.0), (0.2, 10.0), (0.05, 15.0), (0.5, 15.0),
)  # fmt: skip


def row(scenario: TowPastLine, setting: tuple[float, float | None] | None, draws: int) -> list[str]:
    """Return GOSPA by block, CPU ms a step, and the scores of the ranges in steps 251 to 350."""
    step, g, found, cpu = np.arange(1, 351), [], [], 0.0
    for draw in range(draws):
        trial = scenario.sample(np.random.default_rng([0, draw]))
        tracker = trial.tracker("svalse")
        if setting is not None:
            solver = NewtonSolver(curved_probability=setting[0], max_snr_db=setting[1])
            curved = scenario.measurement.replace(unknowns="range")
            tracker = trial.tracker("svalse", measurement=curved, solver=solver)
        started = time.process_time()
        run = tracker.run(trial.measurements)
        cpu += time.process_time() - started
        truth, doa = np.rad2deg(trial.truth), strong_directions(run)
        g.append([mean_gospa(truth[a - 1 : b], doa[a - 1 : b], c=10.0).total for a, b in BLOCKS])
        if setting is not None:
            found.append(path_ranges(run, trial, step))
    cells = [f"{mean:.2f}" for mean in np.mean(g, axis=0)[1:]]
    cells.append(f"{1e3 * cpu / draws / len(step):.1f}")
    if found:
        late = scores(found, LATE)
        cells += [f"{late.found:.0f}", f"{late.ratio:.2f}", f"{late.error:.1f}", f"{late.nees:.1f}"]
    return cells + ["-"] * (9 - len(cells))


def main() -> None:
    """Print a table for each model of the field."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=4, metavar="N", help="draws of the noise (4)")
    draws = parser.parse_args().draws
    for model in MODELS[::-1]:
        columns = ("1-100", "101-200", "201-250", "251-350", "CPU ms a step", "paths with a range",
                   "median ratio", "median error, %", "NEES")  # fmt: skip
        print(f"| {model} | {' | '.join(columns)} |")
        print("|" + " --- |" * 10)
        for setting in SETTINGS:
            name = "plane" if setting is None else "p {}, {} dB".format(*setting)
            scenario = TowPastLine(model=model)  # type: ignore[arg-type]  # one of MODELS
            print(f"| {name} | {' | '.join(row(scenario, setting, draws))} |", flush=True)


if __name__ == "__main__":
    main()
