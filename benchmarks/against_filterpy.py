"""CPU time of filters compared with filterpy and Stone Soup, interleaved in one run.

Prints ratios and versions. Stone Soup needs `pip install "arrivals[bench]"`.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from filterpy.common import Saver
from filterpy.kalman import ExtendedKalmanFilter, IMMEstimator, KalmanFilter

from arrivals.measurement_models import Bearing, LinearMeasurement
from arrivals.motion_models import ConstantVelocity, LinearMotion
from arrivals.trackers import EKF, IMM, Kalman
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float

Step = Callable[[], object]

WALK = ConstantVelocity(q=0.1)
F, Q, H = WALK.F(), WALK.Q(), np.eye(4)[::2]
X, P = np.array([5.0, 0.1, 4.0, -0.1]), np.eye(4)
POSITION = LinearMeasurement(H, np.eye(2))
BEARING = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=0.01)
Z, ANGLES = np.array([5.0, 4.0]), BEARING.h(X)


def theirs(q: float = 1.0) -> KalmanFilter:
    kf = KalmanFilter(4, 2)
    kf.x, kf.P, kf.F, kf.Q, kf.H = X, P, F, q * Q, H
    return kf


def ours(q: float = 1.0) -> Kalman:
    return Kalman(LinearMotion(F, q * Q), POSITION, X, P)


def kalman() -> tuple[Step, Step]:
    """Predict and update with the log-likelihood: 4 states, 2 measurements."""

    def step(tracker: KalmanFilter | Kalman) -> float:
        tracker.predict()
        tracker.update(Z)
        return float(tracker.log_likelihood)

    kf, tracker = theirs(), ours()
    return lambda: step(kf), lambda: step(tracker)


def ekf() -> tuple[Step, Step]:
    """Bearings of two sensors, same h and H; with the likelihood, filterpy without it."""
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
    recorder = RunRecorder(type(tracker.estimate))
    return saver.save, lambda: recorder.add(tracker.estimate, tracker.x)


def batch(n_filters: int = 100, n_steps: int = 20) -> tuple[Step, Step]:
    """Run 100 filters over 20 steps: filterpy one by one, this library as one batch."""
    tracker = ours()
    zs = np.random.default_rng(0).normal(Z, 1.0, (n_filters, n_steps, 2))

    def loop() -> None:
        for sequence in zs:
            kf = theirs()
            for z in sequence:
                kf.predict()
                kf.update(z)

    return loop, lambda: tracker.run_batch(zs)


def soup(ekf: bool) -> Step:
    """Predict and update of Stone Soup's Kalman filter, or of its EKF on two bearings.

    Without the likelihood; the EKF computes Jacobians by differences. Each step starts from the
    update before, because Stone Soup caches by object.
    """
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.measurement.nonlinear import (
        Cartesian2DToBearing,
        CombinedReversibleGaussianMeasurementModel,
    )
    from stonesoup.models.transition.linear import LinearGaussianTimeInvariantTransitionModel
    from stonesoup.predictor.kalman import ExtendedKalmanPredictor, KalmanPredictor
    from stonesoup.types.array import StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import ExtendedKalmanUpdater, KalmanUpdater

    walk = LinearGaussianTimeInvariantTransitionModel(transition_matrix=F, covariance_matrix=Q)
    position: Any = LinearGaussian(ndim_state=4, mapping=(0, 2), noise_covar=np.eye(2))
    predictor, updater, z = KalmanPredictor(walk), KalmanUpdater(position, use_joseph_cov=True), Z
    if ekf:
        bearings = [
            Cartesian2DToBearing(4, (0, 2), noise_covar=[[0.01]], translation_offset=place[:, None])
            for place in BEARING.sensor_positions
        ]
        position = CombinedReversibleGaussianMeasurementModel(bearings)
        predictor, updater, z = (
            ExtendedKalmanPredictor(walk),
            ExtendedKalmanUpdater(position),
            ANGLES,
        )
    state = GaussianState(StateVector(X), P)
    detection = Detection(StateVector(z), measurement_model=position)

    def step() -> None:
        nonlocal state
        state = updater.update(SingleHypothesis(predictor.predict(state), detection))
        state.hypothesis = None  # otherwise it references all past states

    return step


def cpu(step: Step, repeats: int) -> float:
    """Return CPU seconds of a call."""
    started = time.process_time()
    for _ in range(repeats):
        step()
    return (time.process_time() - started) / repeats


def compare(steps: list[Step], repeats: int, rounds: int = 15) -> tuple[Float, Float]:
    """Return CPU seconds of each and its ratio to the first, medians over the rounds."""
    for step in steps:
        cpu(step, max(repeats // 5, 1))
    times = np.array([[cpu(step, repeats) for step in steps] for _ in range(rounds)])
    return np.median(times, axis=0), np.median(times / times[:, :1], axis=0)


def main() -> None:
    has_soup = find_spec("stonesoup") is not None
    rows: list[tuple[str, tuple[Step, Step], int, float]] = [
        ("kalman, with log-likelihood", kalman(), 500, 0.5),
        ("ekf on bearings, arrivals with likelihood", ekf(), 500, 1.6),
        ("imm of two", imm(), 200, 0.6),
        ("recording a step", recording(), 200, 0.3),
        ("100 filters, 20 steps, as a batch", batch(), 1, 0.1),
    ]
    soups = {rows[0][0]: soup(ekf=False), rows[1][0]: soup(ekf=True)} if has_soup else {}
    names = ("numpy", "filterpy", "stonesoup") if has_soup else ("numpy", "filterpy")
    print(f"CPU time of one core; {', '.join(f'{each} {version(each)}' for each in names)}\n")
    print("| step | library | us | ratio to filterpy | limit |\n|---|---|---|---|---|")
    for name, pair, repeats, limit in rows:
        steps = [*pair, *([soups[name]] if name in soups else [])]
        (theirs_s, ours_s, *soup_s), (_, ratio, *soup_ratio) = compare(steps, repeats)
        print(f"| {name} | filterpy | {1e6 * theirs_s:.1f} | 1 | |")
        print(f"| | arrivals | {1e6 * ours_s:.1f} | {ratio:.3f} | {limit} |")
        for seconds, times in zip(soup_s, soup_ratio, strict=True):
            print(f"| | Stone Soup | {1e6 * seconds:.1f} | {times:.3f} | |")
    if not has_soup:
        print('\nStone Soup is not installed; its rows are left out: pip install "arrivals[bench]"')


if __name__ == "__main__":
    main()
