"""Base class of Gaussian filters: belief, predict, update, and filterpy's attributes."""

from __future__ import annotations

import math
from abc import abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import (
    belief_arrays,
    check_models,
    control_effect,
    covariance_matrix,
    matrix_with_columns,
    measurement_and_mask,
    overrides,
)
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.trackers.gaussian.equations import GaussianUpdate, likelihood
from arrivals.trackers.gaussian.linalg import Inverse, inverse
from arrivals.trackers.gaussian.linearization import Linearization, predict_belief, update_belief
from arrivals.trackers.gaussian.smoothing import batch_filter, rts_smoother, run_batch
from arrivals.typing import Bool, Float
from arrivals.validation import real, shaped


class GaussianFilter(Tracker):
    """Base class of filters with one mean and covariance, under filterpy's names.

    A subclass defines `linearize_motion` and `linearize_measurement`.

    Parameters
    ----------
    motion : MotionModel
        Motion of the state.
    measurement : MeasurementModel
        Measurement of a state of that motion.
    x : array_like, shape (n,) or (n, 1)
        Initial mean; it keeps its number of axes. A column makes columns of `y` and `z` too.
    P : array_like, shape (n, n)
        Initial covariance.

    Attributes
    ----------
    x_prior, P_prior, x_post, P_post : ndarray
        Belief after the last `predict` and after the last `update`.
    z, y : ndarray, shape (m,) or (m, 1)
        Last measurement, NaN where it was missing, and its residual, 0 there.
    K, S, SI : ndarray, shapes (n, m), (m, m), (m, m)
        Gain, covariance of the residual and its inverse.
    log_likelihood, mahalanobis : float
        Log likelihood and Mahalanobis distance of the last measurement; 0 if it was missing.
    inv : callable
        Inverts S; `linalg.inverse`, unless another is assigned.
    jitter_count : int
        How often `linalg.JITTER` was added to a covariance.

    Raises
    ------
    TypeError
        If a part is not a model, or the measurement reads an entry that the state lacks.
    ValueError
        If the models' sizes differ, or `x` or `P` does not fit them.

    Examples
    --------
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.motion_models import RandomWalk
    >>> from arrivals.trackers import EKF
    >>> tracker = EKF(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[2.0]]), [0.0], [[1.0]])
    >>> tracker.predict()
    >>> tracker.update(3.0)
    >>> tracker.x, tracker.P, tracker.y, tracker.K
    (array([1.5]), array([[1.]]), array([3.]), array([[0.5]]))
    """

    former_names = ("KalmanType",)

    motion: MotionModel
    measurement: MeasurementModel

    def __init__(
        self, motion: MotionModel, measurement: MeasurementModel, x: ArrayLike, P: ArrayLike
    ) -> None:
        self.motion, self.measurement = check_models(motion, measurement)
        self.x, self.P = real("x", x), real("P", P)
        mean, _ = belief_arrays(self.x, self.P, self.dim_x)
        n, m = self.dim_x, self.dim_z
        shaped("F of the motion", self.motion.F(mean), n, n)
        shaped("Q of the motion", self.motion.Q(), n, n)
        shaped("H of the measurement", self.measurement.H(mean), m, n)
        shaped("R of the measurement", self.measurement.R, m, m)
        self.initialize_record()

    @abstractmethod
    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return the motion, without Q, linearized at beliefs x (..., n), P (..., n, n)."""

    @abstractmethod
    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return the measurement, without R, linearized at beliefs x (..., n), P (..., n, n)."""

    # Predict and update; the functions of other modules take the filter as their first argument

    predict_belief = predict_belief
    update_belief = update_belief
    batch_filter = batch_filter
    rts_smoother = rts_smoother
    run_batch = run_batch

    def predict(
        self,
        u: ArrayLike | None = None,
        *,
        dt: float = 1.0,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
        B: ArrayLike | None = None,
    ) -> None:
        """Predict mean and covariance.

        Parameters
        ----------
        u : array_like, shape (dim_u,), optional
            Control input; None or 0 for none.
        dt : float
            Length of the step.
        F, Q : array_like, shape (n, n), optional
            Replace the motion model's function and noise in this step.
        B : array_like, shape (n, dim_u), optional
            Replaces the motion model's `control` in this step.
        """
        x, P = self.belief()
        x, P = self.predict_belief(x, P, dt, F, Q)
        self.record_prediction(self.add_control(x, u, B), P, dt)

    def update(
        self, z: ArrayLike | None, R: ArrayLike | None = None, H: ArrayLike | None = None
    ) -> None:
        """Update mean and covariance by a measurement.

        Parameters
        ----------
        z : array_like, shape (m,) or (m, 1), or float
            None or NaN where it is missing; the valid entries are used.
        R : float or array_like, shape (m, m), optional
            Replaces the measurement model's noise in this update.
        H : array_like, shape (m, n), optional
            Replaces the measurement model in this update: z = H x + v.
        """
        x, P = self.belief()
        H = None if H is None else matrix_with_columns("H", H, self.dim_x)
        measured = self.check_measurement(z, R, H)
        if measured is None:
            self.record_missed()
        else:
            z, missing, R = measured
            self.record_update(z, self.update_belief(x, P, z, missing, R, H))

    def add_control(self, x: Float, u: ArrayLike | None, B: ArrayLike | None) -> Float:
        """Return x + B u, angles in [-π, π)."""
        if u is None or not np.any(u):
            return x
        return wrapped(x + control_effect(u, self.B if B is None else B), self.state_angles)

    def innovation(self, z: Float, z_pred: Float, missing: Bool | None, plain: bool) -> Float:
        """Return z - z_pred, 0 where missing: the model's residual, a difference if `plain`."""
        if missing is not None:
            z = np.where(missing, z_pred, z)
        if plain or not overrides(type(self.measurement), MeasurementModel, "residual"):
            return z - z_pred
        return self.measurement.residual(z, z_pred)

    def belief(self) -> tuple[Float, Float]:
        """Return mean (n,) and covariance, checked if they were assigned since the last call."""
        if self.x is self._known_x and self.P is self._known_P:
            return self.x.reshape(-1), self.P
        return belief_arrays(self.x, self.P, self.dim_x)

    def set_belief(self, x: Float, P: Float) -> None:
        """Set a belief, shapes (n,) and (n, n), without the checks of an assigned one."""
        self.x = self._known_x = x.reshape(np.shape(self.x))
        self.P = self._known_P = P

    def check_measurement(
        self, z: ArrayLike | None, R: ArrayLike | None, H: Float | None
    ) -> tuple[Float, Bool | None, Float] | None:
        """Return a measurement (m,), its missing mask and its noise; None if all is missing."""
        m = self.dim_z if H is None else len(H)
        values, missing = np.array(z), None
        usual = values.shape == (m,) and values.dtype == np.float64
        if not (usual and values.dot(values) < np.inf):
            values, missing = measurement_and_mask(z, m)
            if missing is not None and missing.all():
                return None
        R = self.measurement.R if R is None else covariance_matrix("R", R, m)
        return values, missing, R if H is None else shaped("R", R, m, m)

    def initialize_record(self) -> None:
        """Set the attributes of the last step as before the first one."""
        n, m = self.dim_x, self.dim_z
        self.x_prior, self.P_prior = self.x.copy(), self.P.copy()
        self._known_x, self._known_P, self._dt = self.x, self.P, 1.0
        self.K, self.S, self.SI = np.zeros((n, m)), np.zeros((m, m)), np.zeros((m, m))
        self.inv: Inverse = inverse
        self.jitter_count = 0
        self.record_missed()

    def record_prediction(self, x: Float, P: Float, dt: float) -> None:
        """Set the belief and the attributes of the last prediction."""
        self.set_belief(x, P)
        self._dt = dt
        self.x_prior, self.P_prior = self.x.copy(), P.copy()

    def record_update(self, z: Float, update: GaussianUpdate) -> None:
        """Set the belief and the attributes of the last measurement."""
        angles = self.state_angles
        self.set_belief(wrapped(update.x, angles) if angles else update.x, update.P)
        shape = (len(z),) if self.x.ndim == 1 else (len(z), 1)
        self.z, self.y = z.reshape(shape), update.y.reshape(shape)
        self.K, self.S, self.SI = update.K, update.S, update.SI
        self.log_likelihood = float(update.log_likelihood)
        self.mahalanobis = math.sqrt(max(float(update.square), 0.0))
        self.jitter_count += update.jittered
        self.x_post, self.P_post = self.x.copy(), self.P.copy()

    def record_missed(self) -> None:
        """Set the attributes of the last measurement to those of a missing one."""
        shape = (self.dim_z,) if np.ndim(self.x) == 1 else (self.dim_z, 1)
        self.z, self.y = np.full(shape, np.nan), np.zeros(shape)
        self.log_likelihood = self.mahalanobis = 0.0
        self.x_post, self.P_post = self.x.copy(), self.P.copy()

    @property
    def state_motion(self) -> MotionModel:
        """Motion of the whole state: `motion`, unless a method adds entries to the state."""
        return self.motion

    @property
    def state_angles(self) -> tuple[int, ...]:
        """Entries of the state that are angles."""
        motion = self.state_motion
        return motion.angles if overrides(type(motion), MotionModel, "angles") else ()

    @property
    def dim_x(self) -> int:
        """Number of entries of the state."""
        return self.state_motion.dim_x

    @property
    def dim_z(self) -> int:
        """Number of entries of a measurement."""
        return self.measurement.dim_z

    @property
    def dim_u(self) -> int:
        """Number of control inputs."""
        return 0 if self.B is None else int(self.B.shape[1])

    @property
    def F(self) -> Float:
        """Jacobian of the motion at the present mean, for the length of the last step."""
        return self.state_motion.F(np.ravel(self.x), self._dt)

    @property
    def Q(self) -> Float:
        """Noise of the motion, for the length of the last step."""
        return self.state_motion.Q(self._dt)

    @property
    def B(self) -> Float | None:
        """Control matrix of the motion, None if it has none."""
        control: Float | None = getattr(self.state_motion, "control", None)
        return control

    @property
    def H(self) -> Float:
        """Jacobian of the measurement at the present mean."""
        return self.measurement.H(np.ravel(self.x))

    @property
    def R(self) -> Float:
        """Noise of the measurement."""
        return self.measurement.R

    @property
    def likelihood(self) -> float:
        """Likelihood of the last measurement, at least the smallest positive float."""
        return likelihood(self.log_likelihood)

    @property
    def estimate(self) -> StateEstimate:
        """Mean and covariance."""
        return StateEstimate(np.array(self.x, dtype=np.float64).ravel(), np.array(self.P))
