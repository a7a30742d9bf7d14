"""CPU time beside filterpy's, in one run, the two taking turns. Prints ratios and versions."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from importlib.metadata import version

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from filterpy.common import Saver
from filterpy.kalman import ExtendedKalmanFilter, IMMEstimator, KalmanFilter

from arrivals.measurement_models import Bearing, LinearMeasurement
from arrivals.motion_models import ConstantVelocity, LinearMotion
from arrivals.trackers import EKF, IMM, Kalman
from arrivals.trackers.recorder import Recorder

Step = Callable[[], object]

WALK = ConstantVelocity(q=0.1)
F, Q, H = WALK.F(), WALK.Q(), np.eye(4)[::2]
X, P = np.array([5.0, 0.1, 4.0, -0.1]), np.eye(4)
SEEN = LinearMeasurement(H, np.eye(2))
BEARING = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=0.01)
Z, ANGLES = np.array([5.0, 4.0]), BEARING.h(X)


def theirs(q: float = 1.0) -> KalmanFilter:
    kf = KalmanFilter(4, 2)
    kf.x, kf.P, kf.F, kf.Q, kf.H = X, P, F, q * Q, H
    return kf


def ours(q: float = 1.0) -> Kalman:
    return Kalman(LinearMotion(F, q * Q), SEEN, X, P)


def kalman() -> tuple[Step, Step]:
    """Predict and update with the log-likelihood: 4 states, 2 measurements."""

    def step(tracker: KalmanFilter | Kalman) -> float:
        tracker.predict()
        tracker.update(Z)
        return float(tracker.log_likelihood)

    kf, tracker = theirs(), ours()
    return lambda: step(kf), lambda: step(tracker)


def ekf() -> tuple[Step, Step]:
    """Bearings of two sensors; ours with the likelihood, filterpy's without, same h and H."""
    filter_ = ExtendedKalmanFilter(4, 2)
    filter_.x, filter_.P, filter_.F, filter_.Q, filter_.R = X, P, F, Q, BEARING.R
    tracker = EKF(WALK, BEARING, X, P)

    def step() -> None:
        filter_.predict()
        filter_.update(ANGLES, BEARING.H, BEARING.h, residual=BEARING.residual)

    def our_step() -> None:
        tracker.predict()
        tracker.update(ANGLES)

    return step, our_step


def imm() -> tuple[Step, Step]:
    """Two Kalman filters."""
    mu, M = np.array([0.5, 0.5]), np.array([[0.95, 0.05], [0.05, 0.95]])
    one, other = IMMEstimator([theirs(), theirs(9.0)], mu, M), IMM([ours(), ours(9.0)], mu, M)

    def step(tracker: IMMEstimator | IMM) -> None:
        tracker.predict()
        tracker.update(Z)

    return lambda: step(one), lambda: step(other)


def recording() -> tuple[Step, Step]:
    """Record one step."""
    kf, tracker = theirs(), ours()
    saver = Saver(kf)
    recorder = Recorder(type(tracker.estimate))
    return saver.save, lambda: recorder.add(tracker.estimate, tracker.x)


def batch(n_filters: int = 100, n_steps: int = 20) -> tuple[Step, Step]:
    """Run 100 filters over 20 steps: theirs one by one, ours as one batch."""
    tracker = ours()
    zs = np.random.default_rng(0).normal(Z, 1.0, (n_filters, n_steps, 2))

    def loop() -> None:
        for sequence in zs:
            kf = theirs()
            for z in sequence:
                kf.predict()
                kf.update(z)

    return loop, lambda: tracker.run_batch(zs)


def cpu(step: Step, repeats: int) -> float:
    """Return CPU seconds of a call."""
    started = time.process_time()
    for _ in range(repeats):
        step()
    return (time.process_time() - started) / repeats


def compare(pair: tuple[Step, Step], repeats: int, rounds: int = 15) -> tuple[float, float, float]:
    """Return CPU seconds of both and the ratio of ours to theirs, medians over the rounds."""
    for step in pair:
        cpu(step, max(repeats // 5, 1))
    times = np.array([[cpu(step, repeats) for step in pair] for _ in range(rounds)])
    one, other = np.median(times, axis=0)
    return float(one), float(other), float(np.median(times[:, 1] / times[:, 0]))


def main() -> None:
    rows: list[tuple[str, tuple[Step, Step], int, float]] = [
        ("kalman, with log-likelihood", kalman(), 500, 0.5),
        ("ekf on bearings, ours with likelihood", ekf(), 500, 1.6),
        ("imm of two", imm(), 200, 0.6),
        ("recording a step", recording(), 200, 0.3),
        ("100 filters, 20 steps, as a batch", batch(), 1, 0.1),
    ]
    peers = ", ".join(f"{name} {version(name)}" for name in ("numpy", "filterpy"))
    print(f"CPU time of one core; {peers}\n")
    print("| what | filterpy, us | ours, us | ratio | wanted |\n|---|---|---|---|---|")
    for what, pair, repeats, wanted in rows:
        one, other, ratio = compare(pair, repeats)
        print(f"| {what} | {1e6 * one:.1f} | {1e6 * other:.1f} | {ratio:.3f} | {wanted} |")


if __name__ == "__main__":
    main()
