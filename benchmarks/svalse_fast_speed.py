"""CPU of SVALSE's Newton solver: single runs, 64 sensors, a circle, batches; array calls.

A step is the minimum of some repeats, then the mean over the steps is taken, to exclude other load
of the machine. The median over repeats stands beside it.
"""

from __future__ import annotations

import argparse
import copy
import os
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from svalse_fast import ELECTRICAL, FIGURES, PAPER, row

from arrivals.measurement_models import ArraySnapshot
from arrivals.scenarios import create
from arrivals.trackers import SVALSE, Tracker
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.charts.angle_chart import LOG_2PI
from arrivals.trackers.svalse.newton.elbo import evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.step import newton_step
from arrivals.typing import Complex, Float


def draw(name: str, seeds: range, **scenario: int) -> tuple[ArraySnapshot, Complex, Float]:
    """Return the array, the snapshots (n_seeds, n_steps, n_sensors) and directions of a run."""
    trials = [create(name, **scenario).sample(np.random.default_rng(seed)) for seed in seeds]
    model = trials[0].measurement
    assert isinstance(model, ArraySnapshot)
    z = np.stack([trial.measurements for trial in trials]).astype(np.complex128)
    return model, z, trials[0].truth


def cpu(make: Callable[[], Tracker], z: Complex) -> Float:
    """Return the CPU of each step, ms."""
    tracker, took = make(), []
    for y in z:
        started = time.process_time()
        tracker.predict()
        tracker.update(y)
        took.append(1e3 * (time.process_time() - started))
    return np.array(took)


def single(repeats: int) -> None:
    """CPU of a step, interleaved with coordinate ascent."""
    for name in FIGURES:
        model, z, _ = draw(name, range(1, 2))

        def newton(model: ArraySnapshot = model) -> SVALSE:
            return SVALSE(model, ELECTRICAL)

        def slow(model: ArraySnapshot = model) -> SVALSE:
            return SVALSE(model, ELECTRICAL, **PAPER)

        times, others = [], []
        for n in range(repeats):
            times.append(cpu(newton, z[0]))
            if n < 2:
                others.append(cpu(slow, z[0, :15]))
        ours, theirs = np.min(times, axis=0), np.min(others, axis=0).mean()
        median = float(np.median(np.mean(times, axis=1)))
        what = f"{name}: CPU ms a step (median over repeats {median:.2f})"
        row(what, f"{ours.mean():.2f}", "<= 3", bool(ours.mean() <= 3))
        ratio = theirs / ours[:15].mean()
        what = f"{name}: coordinate ascent takes {theirs:.0f} ms, ratio"
        row(what, f"{ratio:.0f}", ">= 15", bool(ratio >= 15))


def many(repeats: int) -> None:
    """CPU of a step with 64 sensors: six sources, 20 dB."""
    model, z, _ = draw("svalse_fig4", range(1, 2), n_sensors=64, n_steps=30)
    best = np.min([cpu(lambda: SVALSE(model), z[0]) for _ in range(repeats)], axis=0)
    what = f"64 sensors: CPU ms a step (first step {best[0]:.1f})"
    row(what, f"{best.mean():.2f}", "<= 10", bool(best.mean() <= 10))


def around(repeats: int) -> None:
    """CPU of a step on a circle of 8 sensors with ten frequency bins, 20 dB."""
    trial = create("circle", n_bins=10).sample(np.random.default_rng(1))
    z = trial.measurements.astype(np.complex128)
    best = np.min([cpu(lambda: trial.tracker("svalse"), z) for _ in range(repeats)], axis=0)
    what = "circle of 8, ten bins: CPU ms a step"
    row(what, f"{best.mean():.2f}", "<= 6", bool(best.mean() <= 6))


def batch(n: int, repeats: int) -> None:
    """CPU of a step and run in a batch, and its agreement with single runs."""
    for name in FIGURES:
        model, z, _ = draw(name, range(1, n + 1))
        tracker = SVALSE(model, ELECTRICAL)
        best = np.full(z.shape[1], np.inf)
        for _ in range(repeats):
            copies = [copy.deepcopy(tracker) for _ in range(n)]
            for t in range(z.shape[1]):
                started = time.process_time()
                tracker.step_batch(copies, list(z[:, t]), 1.0)
                best[t] = min(best[t], 1e3 * (time.process_time() - started) / n)
        what = f"{name}: batch of {n}, CPU ms a step and run"
        row(what, f"{best.mean():.2f}", "<= 0.6", bool(best.mean() <= 0.6))
        off = 0.0
        for y, run in zip(z[:10], tracker.run_batch(z[:10]), strict=True):
            alone = copy.deepcopy(tracker).run(y)
            same = alone.doa.shape == run.doa.shape
            off = max(off, float(np.nanmax(np.abs(alone.doa - run.doa)))) if same else np.inf
        row(f"{name}: batch minus single runs, rad", f"{off:.0e}", "<= 1e-9", off <= 1e-9)


class Counted(np.ndarray):
    """An array that counts its operations."""

    calls = 0

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Count a ufunc."""
        return self._counted(getattr(ufunc, method), inputs, options)

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> Any:
        """Count any other function."""
        return self._counted(function, inputs, options)

    @classmethod
    def _counted(cls, function: Any, inputs: Any, options: Any) -> Any:
        cls.calls += 1

        def plain(value: Any) -> Any:
            if isinstance(value, tuple | list):
                return type(value)(map(plain, value))
            return value.view(np.ndarray) if isinstance(value, cls) else value

        result = function(*plain(tuple(inputs)), **{k: plain(v) for k, v in options.items()})
        if isinstance(result, np.ndarray):
            return result.view(cls)
        if isinstance(result, tuple):
            values = [r.view(cls) if isinstance(r, np.ndarray) else r for r in result]
            return type(result)(*values) if hasattr(result, "_fields") else tuple(values)
        return result


def calls() -> None:
    """Array calls of one Newton step, six components, without and with learning the noise."""
    model, z, truth = draw("svalse_fig4", range(1, 2))
    manifold, y = model.angle_manifold(), z[0, :1]
    components = Components.zeros(1, 6)
    components.mu[0] = manifold.from_doa(truth[0])
    components.variance[0], components.kl_constant[0] = 1e-3, LOG_2PI
    given: list[Any] = [
        (y / np.sqrt((np.abs(y) ** 2).mean()))[:, None, :, None], components, np.array([6]),
        np.full((1, 1), 0.01), np.full((1, 1), 0.2), np.zeros(1),
    ]  # fmt: skip
    response = ExpectedResponse(manifold)
    counted: list[Any] = [Components(each.packed.view(Counted)) if isinstance(each, Components)
               else each.view(Counted) for each in given]  # fmt: skip
    state = evaluate(response, *counted)
    for estimate_nu in (False, True):
        Counted.calls = 0
        newton_step(response, state, np.array([estimate_nu]))
        what = f"array calls of a Newton step {'with' if estimate_nu else 'without'} ν and τ"
        row(what, f"{Counted.calls}", "", None)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=60, help="runs in a batch (60)")
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    print("| what | ours | limit | |\n|---|---|---|---|")
    single(options.repeats)
    many(options.repeats)
    around(options.repeats)
    batch(options.runs, min(options.repeats, 3))
    calls()


if __name__ == "__main__":
    main()
