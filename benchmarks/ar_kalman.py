"""Accuracy of the AR Kalman filter with QRD-RLS on simulated sources and speech, and its speed.

Errors are medians over the runs of the RMSE, all sources together, at the ends of the intervals
after the first half (moving sources: after the fifth). Initial directions are off to alternate
sides: the first, third ... source to the right and the others to the left, or vice versa.
"""

from __future__ import annotations

import argparse
import copy
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import AutoregressiveSources, yule_walker
from arrivals.trackers import ARKalmanQRDRLS, Run
from arrivals.trackers.autoregressive import NoiseSettings, RegressionSettings
from arrivals.trackers.autoregressive.steady_state import steady_filter
from arrivals.typing import Complex, Float

TWO = ([0.772, -0.45], [0.96, -0.77])
BROAD = (*TWO, [-1.2, -0.72], [-0.6, -0.5])
NARROW = tuple([2 * 0.97 * np.cos(2 * np.pi * f), -(0.97**2)] for f in (0.05, 0.15, 0.28, 0.40))
THIRD = ([0.7, -0.4, 0.2], [0.9, -0.7, -0.1])


@dataclass(frozen=True)
class Case:
    """A row of the table: scene, settings of the tracker, and limit of the median."""

    name: str
    limit: float
    snr_db: float = 10.0
    forgetting: float = 0.99
    distances: tuple[float, ...] = (0.25,)
    doa: tuple[float, ...] = (-20.0, 30.0)
    end: float | None = None  # of the first source
    sources: tuple[list[float], ...] = TWO
    models: tuple[list[float], ...] | None = None
    offset: float = 10.0
    interval: int = 30
    params: dict[str, Any] = field(default_factory=dict)
    sides: tuple[int, ...] = (1, -1)


def moving(name: str, limit: float, **others: Any) -> Case:
    return Case(name, limit, doa=(40.0, -20.0), end=0.0, offset=5.0, **others)


CASES = [
    Case("SNR 30, λ .95", 0.12, 30, 0.95),
    Case("SNR 30, λ .99", 0.10, 30),
    Case("SNR 10", 0.7, 10),
    Case("SNR 5", 1.2, 5),
    Case("SNR 1", 2.0, 1),
    *[
        Case(f"M = {M}, λ .97", limit, 10, 0.97, tuple(m / 4 for m in range(1, M + 1)))
        for M, limit in ((1, 1.0), (2, 0.45), (3, 0.28), (4, 0.2))
    ],
    Case("d (.5, 1.5, 2.5), λ .97, started inwards", 0.09, 10, 0.97, (0.5, 1.5, 2.5),
         sides=(1,)),
    Case("the same, started apart", 0.09, 10, 0.97, (0.5, 1.5, 2.5), sides=(-1,)),
    Case("the same, 5° off", 0.09, 10, 0.97, (0.5, 1.5, 2.5), offset=5.0),
    Case("d (.5, 4), λ .97", 0.09, 10, 0.97, (0.5, 4.0)),
    moving("moving, N 3, d (.5, 1)", 0.85, forgetting=0.9, distances=(0.5, 1.0), interval=3),
    moving("moving, N 3, d .5", 2.3, forgetting=0.9, distances=(0.5,), interval=3),
    moving("moving, N 30, d (.5, 1)", 0.2, snr_db=30, forgetting=0.95, distances=(0.5, 1.0)),
    moving("moving, N 30, d .5", 1.0, snr_db=30, forgetting=0.95, distances=(0.5,)),
    *[
        moving(f"moving, d (.25, .5), inner {inner}", limit, snr_db=30, forgetting=0.95,
               distances=(0.25, 0.5), params={"inner": inner})
        for inner, limit in ((1, 0.65), (2, 0.42), (4, 0.3), (8, 0.27))
    ],
    Case("AR(3), order 3, SNR 30, λ .95", 0.12, 30, 0.95, sources=THIRD),
    *[
        Case(f"AR(2), order {p}, λ .95", 1.3, 10, 0.95, models=([0.5, *[0.0] * (p - 1)],) * 2)
        for p in (1, 2, 3, 5)
    ],
    *[
        Case(f"{D}° apart", 0.7, doa=(10 - D / 2, 10 + D / 2), offset=D / 4)
        for D in (20, 10, 5, 3)
    ],
    Case("3 sources, 3 sensors, d .5", 0.4, distances=(0.5,), doa=(-35.0, 5.0, 40.0),
         sources=BROAD[:3], offset=3.0),
    Case("3 sources, 3 sensors, d .25", 0.9, doa=(-35.0, 5.0, 40.0), sources=BROAD[:3],
         offset=3.0),
    Case("4 narrow sources, 3 sensors", 0.8, forgetting=0.98, doa=(-45.0, -10.0, 20.0, 55.0),
         sources=NARROW, offset=5.0),
    Case("4 broad sources, 3 sensors", 2.2, forgetting=0.98, doa=(-45.0, -10.0, 20.0, 55.0),
         sources=BROAD, offset=5.0),
]  # fmt: skip


def unit(coefficients: tuple[list[float], ...]) -> AutoregressiveSources:
    return AutoregressiveSources(coefficients).scaled(1.0)


def signals(motion: AutoregressiveSources, n: int, runs: int, rng: np.random.Generator) -> Complex:
    """Draw complex stationary sources, (runs, n, n_sources)."""
    from scipy.signal import lfilter

    parts = rng.standard_normal((2, runs, n + 300, motion.n_sources))
    v = (parts[0] + 1j * parts[1]) * np.sqrt(np.array(motion.noise) / 2)
    each = [lfilter([1.0], [1.0, *(-a for a in row)], v[..., k], axis=1)
            for k, row in enumerate(motion.coefficients)]  # fmt: skip
    return np.stack(each, axis=-1)[:, 300:]


def received(model: ArraySnapshot, doa: Float, s: Complex, rng: np.random.Generator) -> Complex:
    """Return noisy snapshots of sources (runs, n, n_sources) at `doa` (n, n_sources), rad."""
    z = np.einsum("rtk,tkm->rtm", s, model.array.steering_vector(doa, model.wavelength))
    noise = rng.standard_normal((*z.shape, 2)) @ np.array([1, 1j])
    return np.asarray(z + np.sqrt(model.noise / 2) * noise)


def directions(case: Case, n: int) -> Float:
    doa = np.tile(np.deg2rad(case.doa), (n, 1))
    if case.end is not None:
        doa[:, 0] = np.deg2rad(np.linspace(case.doa[0], case.end, n))
    return doa


def simulate(case: Case, runs: int, seed: int = 0) -> tuple[list[Run], Float, Complex]:
    """Return the runs, the directions (n, n_sources), and the sources."""
    rng, n = np.random.default_rng(seed), 200 * case.interval
    motion = unit(case.sources)
    array = SensorArray.symmetric(case.distances)
    model = ArraySnapshot(array, wavelength=1.0, noise=10 ** (-case.snr_db / 10))
    doa, s = directions(case, n), signals(motion, n, runs, rng)
    z = received(model, doa, s, rng)
    alternate = (-1.0) ** np.arange(motion.n_sources)
    done: dict[int, Run] = {}
    for k, side in enumerate(case.sides):
        mine = range(k, runs, len(case.sides))
        tracker = ARKalmanQRDRLS(
            model,
            motion if case.models is None else unit(case.models),
            doa=doa[0] + np.deg2rad(case.offset) * side * alternate,
            interval=case.interval,
            regression=RegressionSettings(forgetting=case.forgetting),
            **case.params,
        )
        done |= dict(zip(mine, tracker.run_batch(z[list(mine)]), strict=True))
    return [done[k] for k in range(runs)], doa, s


def errors(case: Case, runs: list[Run], doa: Float) -> Float:
    """Return the RMSE of each run, degrees."""
    ends = slice(case.interval * (101 if case.end is None else 41) - 1, None, case.interval)
    wrong = np.array([run.doa[ends] for run in runs]) - doa[ends]
    return np.asarray(np.rad2deg(np.sqrt((wrong**2).mean(axis=(1, 2)))))


def nmse_db(runs: list[Run], s: Complex) -> float:
    """Return the median error of the sources after half of the time, dB."""
    half = s.shape[1] // 2
    wrong = np.array([run.signals for run in runs])[:, half:] - s[:, half:]
    ratio = (abs(wrong) ** 2).mean(axis=1) / (abs(s[:, half:]) ** 2).mean(axis=1)
    return float(10 * np.log10(np.median(ratio)))


Line = tuple[str, str, float, bool]


def table(runs: int) -> Iterator[Line]:
    for case in CASES:
        done, doa, s = simulate(case, runs)
        rmse = errors(case, done, doa)
        low, high = np.percentile(rmse, [10, 90])
        median = float(np.median(rmse))
        yield case.name, f"{median:.3f} [{low:.2f}, {high:.2f}]", case.limit, median < case.limit
        if case.name in ("SNR 30, λ .95", "SNR 10"):
            limit = -32.5 if case.snr_db == 30 else -13.0
            level = nmse_db(done, s)
            yield f"{case.name}: NMSE, dB", f"{level:.1f}", limit, level < limit
        if case.name == "SNR 10":
            wrong = (
                np.array([run.coefficients[3000:] for run in done]) - unit(TWO).coefficient_matrix
            )
            rms = float(np.sqrt((wrong**2).mean()))
            yield f"{case.name}: AR coefficients", f"{rms:.3f}", 0.03, rms < 0.03


# -- speech ----------------------------------------------------------------------------------------

SPEECH = {"en": (1.0, 1.1, 1.4), "synth": (0.95, 0.95, 1.33)}


def voices(folder: Path, name: str) -> Float:
    """Return the two voices of a pair at unit power, (n, 2)."""
    from scipy.io import wavfile

    both = [wavfile.read(folder / f"{name}_count_{way}_8k.wav")[1] for way in ("up", "down")]
    n = min(map(len, both))
    s = np.stack([voice[:n] for voice in both], axis=-1).astype(np.float64)
    s = s - s.mean(axis=0)
    return np.asarray(s / s.std(axis=0))


def speech(folder: Path, seeds: int = 6) -> Iterator[Line]:
    """One voice moving from 40 to 0 degrees, the other at -20; powers are estimated online."""
    model = ArraySnapshot(SensorArray.symmetric([0.25, 0.5]), wavelength=1.0)
    for name, limits in SPEECH.items():
        s = voices(folder, name)
        n = len(s)
        doa = np.deg2rad(np.stack([np.linspace(40, 0, n), np.full(n, -20.0)], axis=-1))
        for (snr_db, limit), order in product(zip((30, 10, 5), limits, strict=True), (1, 2)):
            a, q = zip(*(yule_walker(voice, order) for voice in s.T), strict=True)
            motion = AutoregressiveSources([row.tolist() for row in a], q, real_valued=True)
            noisy = model.replace(noise=10 ** (-snr_db / 10))
            rmse = []
            for seed in range(seeds):
                rng = np.random.default_rng(seed)
                tracker = ARKalmanQRDRLS(
                    noisy, motion, doa=doa[0] + np.deg2rad(rng.choice([-10, 10], 2)),
                    gate=0.3, regression=RegressionSettings(ar_forgetting=0.99, ridge=5.0),
                    noise=NoiseSettings(adapt_process_noise=False),
                )  # fmt: skip
                run = tracker.run(received(noisy, doa, s[None].astype(complex), rng)[0])
                wrong = (run.doa - doa)[100 * 30 + 29 :: 30]
                rmse.append(np.rad2deg(np.sqrt((wrong**2).mean())))
            median = float(np.median(rmse))
            what = f"speech {name}, SNR {snr_db}, p = {order}"
            yield what, f"{median:.2f} (worst {max(rmse):.2f})", 1.2 * limit, median < 1.2 * limit


# -- speed -----------------------------------------------------------------------------------------


def speed() -> Iterator[Line]:
    """CPU of an interval of 30 snapshots: 2 sources of order 2, 3 sensors."""
    case = Case("", 0.0)
    rng, n, N = np.random.default_rng(0), 3000, 30
    motion = unit(TWO)
    model = ArraySnapshot(SensorArray.symmetric([0.25]), wavelength=1.0, noise=0.1)
    z = received(model, directions(case, n), signals(motion, n, 40, rng), rng)
    tracker = ARKalmanQRDRLS(model, motion, doa=np.deg2rad([-25.0, 35.0]), interval=N)
    given = filter_arguments(tracker, z[0])
    times = {
        "filterpy": cpu_time(lambda: filterpy(tracker, z[0]), n / N, 3),
        "kalman": cpu_time(lambda: filtered(given), n / N, 9),
        "run": cpu_time(lambda: copy.deepcopy(tracker).run(z[0]), n / N, 9),
        "loop": cpu_time(lambda: step_by_step(copy.deepcopy(tracker), z[0]), n / N, 5),
        "batch": cpu_time(lambda: tracker.run_batch(z), n / N * len(z), 3),
    }
    ratio = times["kalman"] / times["filterpy"]
    yield (f"Kalman part {times['kalman']:.3f} ms, filterpy {times['filterpy']:.3f} ms: ratio",
           f"{ratio:.3f}", 0.25, ratio <= 0.25)  # fmt: skip
    yield "whole tracker by run, ms", f"{times['run']:.3f}", 1.0, times["run"] <= 1.0
    yield "by predict and update, ms", f"{times['loop']:.3f}", 1.0, times["loop"] <= 1.0
    yield "run_batch of 40, ms per run", f"{times['batch']:.3f}", 0.3, times["batch"] <= 0.3


def cpu_time(work: Callable[[], object], n: float, repeats: int) -> float:
    """Return the least CPU time of `work` over the repeats, ms per n-th part."""
    best = np.inf
    for _ in range(repeats):
        started = time.process_time()
        work()
        best = min(best, time.process_time() - started)
    return 1e3 * best / n


def matrices(tracker: ARKalmanQRDRLS) -> tuple[Float, ...]:
    layout, motion = tracker.layout, tracker.motion
    Q = layout.process_noise(np.array(motion.noise))
    A = tracker.manifold.real_steering(tracker.estimate.doa).T
    return layout.transition(motion.coefficient_matrix), Q, A


def filter_arguments(tracker: ARKalmanQRDRLS, z: Complex) -> list[Any]:
    """Return the arguments of the steady filter in each interval of a run."""
    given: list[Any] = []

    def recorder(*arguments: Any) -> tuple[Float, Float]:
        given.append(arguments)
        return steady_filter(*arguments)

    with mock.patch("arrivals.trackers.autoregressive.interval_filter.steady_filter", recorder):
        copy.deepcopy(tracker).run(z)
    return given


def filtered(given: list[Any]) -> None:
    for arguments in given:
        steady_filter(*arguments)


def filterpy(tracker: ARKalmanQRDRLS, z: Complex) -> None:
    """Filter by filterpy, real and imaginary parts stacked."""
    from filterpy.kalman import KalmanFilter

    F, Q, A = matrices(tracker)
    n, m = len(F), len(A)
    kf = KalmanFilter(2 * n, 2 * m)
    two = np.eye(2)
    kf.F, kf.Q, kf.P = np.kron(two, F), np.kron(two, Q / 2), np.eye(2 * n) / 2
    kf.H, kf.R = np.kron(two, A @ np.eye(n)[: A.shape[1]]), 0.05 * np.eye(2 * m)
    y = tracker.manifold.transform(z)
    for row in np.concatenate([y.real, y.imag], axis=1):
        kf.predict()
        kf.update(row)


def step_by_step(tracker: ARKalmanQRDRLS, z: Complex) -> None:
    for snapshot in z:
        tracker.predict()
        tracker.update(snapshot)


def show(lines: Iterator[Line]) -> None:
    print("\n| | ours | limit | passes |\n|---|---|---|---|")
    for what, ours, limit, passes in lines:
        print(f"| {what} | {ours} | {limit:.3g} | {'yes' if passes else '**no**'} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--speech", type=Path, metavar="DIR",
                        help="folder of the voices (that in ARRIVALS_DATA)")  # fmt: skip
    parser.add_argument("--only", choices=("table", "speech", "speed"))
    options = parser.parse_args()
    folder = options.speech
    if folder is None and "ARRIVALS_DATA" in os.environ:
        folder = Path(os.environ["ARRIVALS_DATA"]) / "speech"
    if options.only in (None, "table"):
        show(table(options.runs))
    if options.only == "speech" and folder is None:
        parser.error("give --speech DIR, or set ARRIVALS_DATA")
    if options.only in (None, "speech") and folder is not None:
        show(speech(folder))
    if options.only in (None, "speed"):
        show(speed())


if __name__ == "__main__":
    main()
