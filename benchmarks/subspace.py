"""Subspace methods: static and moving pairs against the specification's figures, and speed.

Accuracy: the median RMSE over runs, degrees, from the 100th interval on (the 40th where a source
moves), scored by best assignment, since the methods label nothing. A figure agrees within 25 %, or
one unit of its last digit: it is a median of 40 runs of other draws.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.metadata import version

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.scenarios import ar_signals, best_assignment_rmse
from arrivals.trackers import MUSIC, PAST
from arrivals.trackers.subspace.base import Subspaces
from arrivals.trackers.subspace.esprit import esprit_angles
from arrivals.trackers.subspace.line_bins import uniform_line
from arrivals.trackers.subspace.music_spectrum import SpectrumSearch
from arrivals.trackers.subspace.past_steps import past_step
from arrivals.trackers.subspace.root_music import root_music_angles
from arrivals.typing import Complex, Float

COEFFICIENTS, NOISE = ([0.772, -0.45], [0.96, -0.77]), (0.571, 0.287)
INTERVALS = 200


@dataclass(frozen=True)
class Case:
    """Two AR(2) sources, intervals of `length` snapshots, and the specification's figures."""

    what: str
    distances: tuple[float, ...]
    snr_db: float
    forgetting: float
    known: dict[str, float]
    doa_deg: tuple[float, float] = (-20.0, 30.0)
    length: int = 30
    moving: bool = False

    def truth(self) -> Float:
        """Return directions of the snapshots, degrees, (n_steps, 2)."""
        n_steps = INTERVALS * self.length
        doa = np.tile(np.array(self.doa_deg), (n_steps, 1))
        if self.moving:
            doa[:, 1] = np.linspace(40.0, 0.0, n_steps)
        return doa


def cases() -> Iterator[Case]:
    """Iterate over the rows of section 7 with figures for the subspace methods."""

    def both(esprit: float, past: float) -> dict[str, float]:
        return {"esprit": esprit, "past": past}

    yield Case("3 sensors, 30 dB, λ .95", (0.25,), 30, 0.95, both(0.26, 0.26))
    yield Case("3 sensors, 30 dB, λ .99", (0.25,), 30, 0.99, both(0.11, 0.11))
    for snr, esprit, past in ((10, 1.12, 1.09), (5, 2.07, 1.94), (1, 3.60, 3.07)):
        yield Case(f"3 sensors, {snr} dB, λ .99", (0.25,), snr, 0.99, both(esprit, past))
    for n, esprit, root in ((2, 0.47, 0.43), (3, 0.25, 0.22), (4, 0.22, 0.15)):
        distances = tuple(0.25 * np.arange(1, n + 1))
        known = {"esprit": esprit, "root_music": root}
        yield Case(f"{2 * n + 1} sensors, 10 dB, λ .97", distances, 10, 0.97, known)
    yield Case("3 sensors, 10 dB, λ .95", (0.25,), 10, 0.95, both(2.68, 2.61))
    apart = ((20, 3.0, 2.7), (10, 7.0, 4.6), (5, 32.0, 8.3), (3, 49.0, 21.0))
    for gap, esprit, past in apart:
        doa = (10 - gap / 2, 10 + gap / 2)
        what = f"3 sensors, {gap}° apart, 10 dB, λ .99"
        yield Case(what, (0.25,), 10, 0.99, both(esprit, past), doa_deg=doa)
    for gap, esprit in ((20, 0.26), (10, 0.53), (5, 1.07), (3, 1.68)):
        doa = (10 - gap / 2, 10 + gap / 2)
        what = f"3 sensors, {gap}° apart, 30 dB, λ .99"
        yield Case(what, (0.25,), 30, 0.99, {"esprit": esprit}, doa_deg=doa)
    what = "5 sensors d=(.5,1), 40° to 0°, "
    fast = Case(what + "10 dB, λ .9, N 3", (0.5, 1.0), 10, 0.9, both(0.62, 0.63), moving=True)
    yield replace(fast, length=3)
    yield Case(what + "30 dB, λ .95", (0.5, 1.0), 30, 0.95, {"esprit": 0.10}, moving=True)
    what = "5 sensors d=(.25,.5), 40° to 0°, 30 dB, λ .95"
    yield Case(what, (0.25, 0.5), 30, 0.95, {"esprit": 0.13}, moving=True)


def snapshots(
    case: Case, runs: int, rng: np.random.Generator
) -> tuple[UniformLineManifold, Complex]:
    """Return the line, and snapshots (n_runs, n_intervals, length, n_sensors)."""
    noise = 10 ** (-case.snr_db / 10)
    model = ArraySnapshot(SensorArray.symmetric(case.distances), wavelength=1.0, noise=noise)
    s = ar_signals(COEFFICIENTS, NOISE, INTERVALS * case.length, rng, (runs,))
    y = model.simulate(np.deg2rad(case.truth()), s, rng)
    return uniform_line(model), y.reshape(runs, INTERVALS, case.length, -1)


def eigenvectors(y: Complex, forgetting: float) -> Complex:
    """Return eigenvectors of the running covariance at the ends of intervals, values falling."""
    length = y.shape[2]
    w = forgetting ** np.arange(length - 1, -1, -1.0)
    blocks = np.swapaxes(w[:, None] * y, -1, -2) @ y.conj()
    R = np.zeros_like(blocks)
    for n in range(y.shape[1]):
        R[:, n] = blocks[:, n] + (forgetting**length * R[:, n - 1] if n else 0)
    return np.asarray(np.linalg.eigh(R)[1][..., ::-1])


def past_bases(y: Complex, forgetting: float) -> Complex:
    """Return orthonormal bases by PAST at the ends of intervals, all runs at once."""
    runs, intervals, length, m = y.shape
    W = np.broadcast_to(np.eye(m, 2, dtype=complex), (runs, m, 2))
    P = np.broadcast_to(np.eye(2, dtype=complex), (runs, 2, 2))
    bases = np.empty((runs, intervals, m, 2), dtype=complex)
    for n in range(intervals):
        for j in range(length):
            W, P = past_step(W, P, y[:, n, j], forgetting)
        bases[:, n] = np.linalg.qr(W)[0]
    return bases


def errors(case: Case, runs: int, rng: np.random.Generator) -> dict[str, float]:
    """Return the median RMSE of each method, degrees."""
    line, y = snapshots(case, runs, rng)
    V, W = eigenvectors(y, case.forgetting), past_bases(y, case.forgetting)
    order = np.argsort(line.grid_index)
    first, second = order[:-1], order[1:]
    theta = {
        "esprit": esprit_angles(V[..., :2], first, second),
        "past": esprit_angles(W, first, second),
        "root_music": root_music_angles(V[..., 2:], line.grid_index, 2),
    }
    start = 40 if case.moving else 100
    median = {}
    for method, angle in theta.items():
        doa = np.rad2deg(np.arcsin(np.clip(angle / line.step, -1, 1)))[:, start:]
        at_ends = case.truth()[case.length - 1 :: case.length]
        truth = np.broadcast_to(at_ends[start:], doa.shape)
        median[method] = float(np.median(best_assignment_rmse(truth, doa)))
    return median


def accuracy(runs: int) -> None:
    """Print section 7's columns of the subspace methods."""
    print("| case | esprit | past + esprit | root_music | specification | agrees |")
    print("|---|---|---|---|---|---|")
    total = off = 0
    for n, case in enumerate(cases()):
        ours = errors(case, runs, np.random.default_rng([0, n]))
        agrees = [close(ours[method], figure) for method, figure in case.known.items()]
        known = ", ".join(f"{method} {figure:g}" for method, figure in case.known.items())
        numbers = " | ".join(f"{value:.2f}" for value in ours.values())
        verdict = "yes" if all(agrees) else "**no**"
        print(f"| {case.what} | {numbers} | {known} | {verdict} |")
        total, off = total + len(agrees), off + agrees.count(False)
    print(f"\n{total - off} of {total} figures agree, {runs} runs.")


def close(ours: float, known: float) -> bool:
    return abs(ours - known) <= max(0.25 * known, 0.01)


# -- speed -------------------------------------------------------------------------------------


def clock(jobs: dict[str, Callable[[], object]], n: int) -> dict[str, float]:
    """Return CPU of each job, µs: the least of 15 rounds in which they take turns."""
    best = dict.fromkeys(jobs, np.inf)
    for _ in range(15):
        for what, job in jobs.items():
            started = time.process_time()
            for _ in range(n):
                job()
            best[what] = min(best[what], 1e6 * (time.process_time() - started) / n)
    return best


def two_sources(model: ArraySnapshot, n: int) -> Complex:
    rng = np.random.default_rng(0)
    doa = np.tile(np.deg2rad([-20.0, 30.0]), (n, 1))
    return model.simulate(doa, ar_signals(COEFFICIENTS, NOISE, n, rng), rng)


def past_speed() -> None:
    """Print CPU of `past` per interval of 30 snapshots."""
    print("\n| past, 2 sources, interval of 30 | CPU ms an interval | wanted | met |")
    print("|---|---|---|---|")
    for n_sensors in (3, 5, 15):
        model = ArraySnapshot(SensorArray.ula(n_sensors, 0.25), wavelength=1.0)
        y = two_sources(model, 300)
        tracker = PAST(model, n_sources=2, interval=30)
        ms = clock({"run": lambda t=tracker, y=y: t.run(y)}, 2)["run"] / 1e3 / 10  # type: ignore[misc]
        print(f"| {n_sensors} sensors | {ms:.2f} | 1.50 | {'yes' if ms <= 1.5 else '**no**'} |")


def music_speed(n_snapshots: int = 50) -> None:
    """Print CPU time of one estimate of directions beside that of pyroomacoustics."""
    try:
        import pyroomacoustics
    except ImportError:
        print('\npyroomacoustics is not installed: pip install -e ".[bench]"')
        return
    c, frequency, n_fft, rate = 343.0, 1000.0, 16, 8000.0
    array = SensorArray.ula(15, c / frequency / 2)
    model = ArraySnapshot(array, c / frequency, noise=0.1)
    y = two_sources(model, n_snapshots)
    positions = np.stack([array.positions[:, 0], np.zeros(15)])
    grid = np.linspace(0, np.pi, 361)  # counted from endfire
    peer = pyroomacoustics.doa.MUSIC(positions, rate, n_fft, c=c, num_src=2, azimuth=grid)
    spectra = np.zeros((15, n_fft // 2 + 1, n_snapshots), dtype=complex)
    bin_ = round(frequency * n_fft / rate)
    spectra[:, bin_] = y.T
    search = SpectrumSearch(array, c / frequency, 361)
    tracker = MUSIC(model, n_sources=2)
    tracker.run(y)

    def theirs() -> Float:
        peer.locate_sources(spectra, freq_bins=[bin_])
        return np.sort(np.pi / 2 - peer.azimuth_recon)

    def ours() -> Float:
        vectors = np.linalg.eigh(y.T @ y.conj() / n_snapshots)[1][:, ::-1]
        return np.sort(search.directions(Subspaces(vectors[:, :2], vectors[:, 2:]))[0])

    def step() -> None:
        tracker.predict()
        tracker.update(y[-1])

    if np.abs(theirs() - ours()).max() > np.deg2rad(0.5):  # their grid, and no refinement
        raise RuntimeError(f"directions differ: {np.rad2deg([theirs(), ours()])}")
    us = clock({"theirs": theirs, "ours": ours, "step": step}, 20)
    print(
        f"\n| MUSIC, 15 sensors, 361 directions, {n_snapshots} snapshots; numpy "
        f"{np.__version__} | CPU µs | ratio | wanted | met |\n|---|---|---|---|---|"
    )
    print(f"| pyroomacoustics {version('pyroomacoustics')} | {us['theirs']:.0f} | 1 | | |")
    lines = {"ours": "the same block", "step": "tracker: predict, update, directions"}
    for what, text in lines.items():
        ratio = us[what] / us["theirs"]
        met = "yes" if ratio <= 0.35 else "**no**"
        print(f"| ours, {text} | {us[what]:.0f} | {ratio:.2f} | 0.35 | {met} |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--only", choices=("accuracy", "speed"))
    options = parser.parse_args()
    if options.only != "speed":
        accuracy(options.runs)
    if options.only != "accuracy":
        past_speed()
        music_speed()


if __name__ == "__main__":
    main()
