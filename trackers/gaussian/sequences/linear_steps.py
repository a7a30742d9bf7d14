"""Steps of a Kalman filter over sequences, whose covariances do not depend on the numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from arrivals.trackers.gaussian.arguments import check_finite
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.trackers.gaussian.equations import predict_gaussian
from arrivals.trackers.gaussian.gains import Gain, kalman_gain
from arrivals.trackers.gaussian.linalg import apply
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter

MOST_KNOWN = 64  # covariances: constant models come back to one of the last few, bit by bit


class StepCovariances(NamedTuple):
    """Covariance after the prediction of a step, and the gain of its update."""

    P: Float
    gain: Gain


class LinearSteps:
    """Steps of a linear filter with constant models.

    The same covariance with the same missing numbers leads to the same gain, which is computed
    once: for all sequences of a batch, and for all steps after the covariance has settled.

    Parameters
    ----------
    tracker : GaussianFilter
        With linear models; it is not changed.
    dt : float
        Length of a step.

    Examples
    --------
    >>> import numpy as np
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.motion_models import RandomWalk
    >>> from arrivals.trackers import Kalman
    >>> tracker = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[2.0]]), [0.0], [[1.0]])
    >>> steps = LinearSteps(tracker, 1.0)
    >>> covariances = steps.covariances(np.eye(1), None)
    >>> steps.mean(np.zeros((2, 1)), np.array([[3.0], [4.0]]), None, covariances)[1]
    array([[1.5],
           [2. ]])
    """

    def __init__(self, tracker: GaussianFilter, dt: float) -> None:
        x, _ = tracker.belief()
        self.tracker, self.angles = tracker, tracker.state_angles
        motion, measurement = tracker.held_motion, tracker.held_measurement
        self.F, self.Q = motion.F(x, dt), motion.Q(dt)
        self.H, self.R = measurement.H(x), measurement.R
        self._known: dict[tuple[bytes, bytes], StepCovariances] = {}

    def covariances(self, P: Float, missing: Bool | None) -> StepCovariances:
        """Return those of a step from P (n, n), with missing entries (m,), None if there are none.

        They are shared: not for writing.
        """
        key = P.tobytes(), b"" if missing is None else missing.tobytes()
        known = self._known.get(key)
        if known is None:
            # P = F P F' + Q   (4.20)
            predicted = predict_gaussian(P, self.F, self.Q, self.tracker.fading)
            check_finite(predicted.diagonal(), predicted)
            # K = P H' S^-1,  P = (I - K H) P (I - K H)' + K R K'   (4.21)
            gain = kalman_gain(predicted, self.H, self.R, missing, self.tracker.inv)
            if len(self._known) == MOST_KNOWN:
                del self._known[next(iter(self._known))]
            known = self._known[key] = StepCovariances(predicted, gain)
        return known

    def mean(
        self, x: Float, z: Float, missing: Bool | None, covariances: StepCovariances
    ) -> tuple[Float, Float]:
        """Return the means (..., n) after the prediction and after the update by z (..., m)."""
        # x = F x   (4.20)
        predicted = apply(self.F, x)
        # y = z - H x   (4.21)
        y = self.tracker.innovation(z, apply(self.H, predicted), missing, plain=False)
        # x = x + K y   (4.21)
        return predicted, wrapped(predicted + apply(covariances.gain.K, y), self.angles)
