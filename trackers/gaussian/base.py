"""Base class of Gaussian filters: belief, predict, update, and filterpy's attributes."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurements import LARGEST
from arrivals.messages import shown
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import (
    belief_arrays,
    check_finite,
    check_models,
    control_effect,
    control_input,
    control_matrix,
    covariance_matrix,
    is_number,
    matrix_with_columns,
    measurement_and_mask,
    overrides,
)
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.trackers.gaussian.equations import GaussianUpdate, likelihood
from arrivals.trackers.gaussian.filterpy_names.attributes import DeclaredAttributes
from arrivals.trackers.gaussian.filterpy_names.matrices import ModelMatrices
from arrivals.trackers.gaussian.linalg import Inverse, inverse
from arrivals.trackers.gaussian.linearization import (
    Linearization,
    predict_belief,
    update_belief,
    warn_if_far_from_linear,
)
from arrivals.trackers.gaussian.sequences.batches import run_batch
from arrivals.trackers.gaussian.sequences.filtering import batch_filter
from arrivals.trackers.gaussian.sequences.smoothing import rts_smoother
from arrivals.typing import Bool, Float
from arrivals.validation import real, shaped, time_step


class GaussianFilter(ModelMatrices, DeclaredAttributes, Tracker):
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
    iterations, warned = 1, False  # linearizations of a measurement; that it is far from linear

    def __init__(
        self, motion: MotionModel, measurement: MeasurementModel, x: ArrayLike, P: ArrayLike
    ) -> None:
        self.motion, self.measurement = check_models(motion, measurement)
        self.x, self.P = real("x", x), real("P", P)  # a number becomes a matrix
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

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "P" and is_number(value):
            value = covariance_matrix("P", value, self.dim_x)
        if name == "inv" and not callable(value):
            raise TypeError(f"inv must be callable; got {shown(value)}")
        super().__setattr__(name, value)

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
        if type(dt) is not float or dt != self.last_dt:
            dt = time_step(dt)
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
            update = self.update_belief(x, P, z, missing, R, H)
            self.record_update(z, update)
            if H is None:
                warn_if_far_from_linear(self, z, missing, R, update.S)

    def add_control(self, x: Float, u: ArrayLike | None, B: ArrayLike | None) -> Float:
        """Return x + B u, angles in [-π, π)."""
        if u is None:
            return x  # the usual case
        control = control_input(u)
        if control is None:
            return x
        B = getattr(self.state_motion, "control", None) if B is None else control_matrix(B, len(x))
        return wrapped(x + control_effect(control, B), self.state_angles)

    def innovation(self, z: Float, z_pred: Float, missing: Bool | None, plain: bool) -> Float:
        """Return z - z_pred, 0 where missing: the model's residual, a difference if `plain`."""
        if missing is not None:
            z = np.where(missing, z_pred, z)
        if plain or not overrides(type(self.held_measurement), MeasurementModel, "residual"):
            return z - z_pred
        return self.held_measurement.residual(z, z_pred)

    def belief(self) -> tuple[Float, Float]:
        """Return mean (n,) and covariance, checked if they were assigned since the last call."""
        if self.handed:
            self.take_back()
        if self.x is self._known_x and self.P is self._known_P:
            return self.x if self.x.ndim == 1 else self.x.reshape(-1), self.P
        return belief_arrays(self.x, self.P, self.dim_x)

    def set_belief(self, x: Float, P: Float) -> None:
        """Set a belief, shapes (n,) and (n, n), without the checks of an assigned one."""
        if type(self.x) is not np.ndarray or self.x.ndim > 1:
            x = x.reshape(np.shape(self.x))
        own = vars(self)  # faster than assignments, which are checked
        own["x"] = own["_known_x"] = x
        own["P"] = own["_known_P"] = P

    def check_measurement(
        self, z: ArrayLike | None, R: ArrayLike | None, H: Float | None
    ) -> tuple[Float, Bool | None, Float] | None:
        """Return a measurement (m,), its missing mask and its noise; None if all is missing."""
        m = self.held_measurement.dim_z if H is None else len(H)
        usual = type(z) is np.ndarray and z.shape == (m,) and z.dtype == np.float64
        if usual and math.hypot(*z.tolist()) < LARGEST:  # type: ignore[union-attr]  # an array
            values, missing = z.copy(), None  # type: ignore[union-attr]
        else:
            values, missing = measurement_and_mask(z, m)
        if missing is not None and missing.all():
            return None
        R = self.held_measurement.R if R is None else covariance_matrix("R", R, m)
        return values, missing, R if H is None else shaped("R", R, m, m)

    def initialize_record(self) -> None:
        """Set the attributes of the last step as before the first one."""
        n, m = self.dim_x, self.dim_z
        self.x_prior, self.P_prior = self.x.copy(), self.P.copy()
        self._known_x, self._known_P, self.last_dt = self.x, self.P, 1.0
        self.K, self.S, self.SI = np.zeros((n, m)), np.zeros((m, m)), np.zeros((m, m))
        self.inv: Inverse = inverse
        self.jitter_count = 0
        self.record_missed()

    def record_prediction(self, x: Float, P: Float, dt: float) -> None:
        """Set the belief and the attributes of the last prediction."""
        if not math.hypot(*P.diagonal().tolist(), *x.tolist()) < LARGEST:
            check_finite(x, P)
        self.set_belief(x, P)
        own = vars(self)
        own["x_prior"], own["P_prior"] = self.x.copy(), P.copy()
        if dt != self.last_dt:
            self.read_again(dt)

    def record_update(self, z: Float, update: GaussianUpdate) -> None:
        """Set the belief and the attributes of the last measurement."""
        angles = self.state_angles
        log_likelihood = float(update.log_likelihood)
        if not math.isfinite(log_likelihood):
            check_finite(update.x, update.P)
        x, P, column = wrapped(update.x, angles) if angles else update.x, update.P, False
        if type(self.x) is not np.ndarray or self.x.ndim > 1:
            x, column = x.reshape(np.shape(self.x)), np.ndim(self.x) > 1
        own = vars(self)
        own["x"] = own["_known_x"] = x
        own["P"] = own["_known_P"] = P
        own["x_post"], own["P_post"] = x.copy(), P.copy()
        own["z"], own["y"] = (z[:, None], update.y[:, None]) if column else (z, update.y)
        own["K"], own["S"], own["SI"] = update.K, update.S, update.SI
        own["log_likelihood"] = log_likelihood
        own["mahalanobis"] = math.sqrt(max(float(update.square), 0.0))
        own["jitter_count"] += update.jittered

    def record_missed(self) -> None:
        """Set the attributes of the last measurement to those of a missing one."""
        shape = (self.dim_z,) if np.ndim(self.x) == 1 else (self.dim_z, 1)
        self.z, self.y = np.full(shape, np.nan), np.zeros(shape)
        self.log_likelihood = self.mahalanobis = 0.0
        self.x_post, self.P_post = np.array(self.x), np.array(self.P)

    @property
    def state_angles(self) -> tuple[int, ...]:
        """Entries of the state that are angles."""
        return self.held_angles

    @property
    def likelihood(self) -> float:
        """Likelihood of the last measurement, at least the smallest positive float."""
        return likelihood(self.log_likelihood)

    @property
    def estimate(self) -> StateEstimate:
        """Mean and covariance."""
        return StateEstimate(np.array(self.x, dtype=np.float64).ravel(), np.array(self.P))
