"""Predict and update of a Gaussian belief, whatever makes its models linear."""

from __future__ import annotations

import math
from abc import abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.arguments import (
    check_shape,
    matrix_of,
    measurement_vector,
    missing_mask,
    models,
    noise_matrix,
)
from arrivals.trackers.gaussian.circular import add, wrapped
from arrivals.trackers.gaussian.equations import GaussianUpdate, predict_gaussian, update_gaussian
from arrivals.trackers.gaussian.filterpy_attributes import FilterpyAttributes
from arrivals.trackers.gaussian.linalg import Inverse, apply, inverse
from arrivals.trackers.gaussian.linearization import Linearization
from arrivals.typing import Bool, Float
from arrivals.validation import covariance, real


class FilterBase(FilterpyAttributes):
    """The two steps of a `KalmanType`, which see there."""

    def __init__(
        self, motion: MotionModel, measurement: MeasurementModel, x: ArrayLike, P: ArrayLike
    ) -> None:
        self.motion, self.measurement = models(motion, measurement)
        self.x, self.P = real("x", x), real("P", P)
        mean, _ = self.belief(fresh=True)
        H, R = self.measurement.H(mean), self.measurement.R
        for name, matrix in (("F", motion.F(mean)), ("Q", motion.Q()), ("H", H), ("R", R)):
            real(f"{name} of the {'motion' if name in 'FQ' else 'measurement'}", matrix)
        check_shape("H of the measurement", H, (self.dim_z, self.dim_x))
        check_shape("R of the measurement", R, (self.dim_z, self.dim_z))
        self.initialize_record()

    def initialize_record(self) -> None:
        """Set the attributes of the last step as before the first one."""
        n, m = self.dim_x, self.dim_z
        self.x_prior, self.x_post = self.x.copy(), self.x.copy()
        self.P_prior, self.P_post = self.P.copy(), self.P.copy()
        self._known_x, self._known_P, self._dt = self.x, self.P, 1.0
        self.K, self.S, self.SI = np.zeros((n, m)), np.zeros((m, m)), np.zeros((m, m))
        self.inv: Inverse = inverse
        self.jitter_count = 0
        self.record_missed()

    # What a method of this type defines

    @abstractmethod
    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return the motion as it looks near beliefs x (..., n), P (..., n, n), without Q."""

    @abstractmethod
    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return the measurement as it looks near beliefs x (..., n), P (..., n, n), without R."""

    # The two steps

    def predict(
        self,
        u: ArrayLike | None = None,
        *,
        dt: float = 1.0,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
        B: ArrayLike | None = None,
    ) -> None:
        """Move the belief: by the motion model, or for once by matrices of filterpy's names.

        Parameters
        ----------
        u : array_like, shape (dim_u,), optional
            Control input; None or 0 for none.
        dt : float
            Length of the step.
        F, Q : array_like, shape (n, n), optional
            In place of the motion model's function and noise.
        B : array_like, shape (n, dim_u), optional
            In place of the motion model's `control`.
        """
        x, P = self.belief()
        step = self.control_effect(u, B)
        x, P = self.predict_belief(x, P, dt, F, Q)
        if step is not None:
            x = add(x, step, self.state_motion.angles)
        self.set_belief(x, P)
        self._dt = dt
        self.x_prior, self.P_prior = self.x.copy(), P.copy()

    def update(
        self, z: ArrayLike | None, R: ArrayLike | None = None, H: ArrayLike | None = None
    ) -> None:
        """Correct the belief by a measurement.

        Parameters
        ----------
        z : array_like, shape (m,) or (m, 1), or float
            None or NaN where it is missing; the entries that are there are used.
        R : float or array_like, shape (m, m), optional
            In place of the measurement model's noise.
        H : array_like, shape (m, n), optional
            In place of the measurement model: z = H x + v.
        """
        x, P = self.belief()
        linear = None if H is None else matrix_of("H", H, self.dim_x)
        m = self.dim_z if linear is None else len(linear)
        z = None if z is None else measurement_vector(z, m)
        missing = missing_mask(z)
        if z is None or (missing is not None and missing.all()):
            self.record_missed()
        else:
            noise = self.measurement.R if R is None else noise_matrix(R, m)
            if linear is not None:
                check_shape("R", noise, (m, m))
            found = self.update_belief(x, P, z, missing, noise, linear)
            self.set_belief(found.x, found.P)
            self.record_update(z, found)
        self.x_post, self.P_post = self.x.copy(), self.P.copy()

    def predict_belief(
        self, x: Float, P: Float, dt: float, F: ArrayLike | None, Q: ArrayLike | None
    ) -> tuple[Float, Float]:
        """Return the predictions of beliefs x (..., n), P (..., n, n)."""
        near = self.linearize(x, P, dt, F)
        noise = self.state_motion.Q(dt) if Q is None else self.process_noise(Q)
        return near.mean, predict_gaussian(P, near.jacobian, near.noise(noise))

    def linearize(self, x: Float, P: Float, dt: float, F: ArrayLike | None) -> Linearization:
        """Return the linearization of the motion, or F in its place."""
        if F is None:
            return self.linearize_motion(x, P, dt)
        F = matrix_of("F", F, self.dim_x)
        check_shape("F", F, P.shape[-2:])
        return Linearization(apply(F, x), F)

    def update_belief(
        self, x: Float, P: Float, z: Float, missing: Bool | None, R: Float, H: Float | None = None
    ) -> GaussianUpdate:
        """Return beliefs (..., n) corrected by measurements (..., m), NaN where missing."""
        near = self.linearize_measurement(x, P) if H is None else Linearization(apply(H, x), H)
        if missing is not None:
            z = np.where(missing, near.mean, z)
        y = self.measurement.residual(z, near.mean) if H is None else z - near.mean
        found = update_gaussian(x, P, y, near.jacobian, near.noise(R), missing, self.inv)
        angles = self.state_motion.angles
        if angles or near.jittered:
            jittered = found.jittered + near.jittered
            found = found._replace(x=wrapped(found.x, angles), jittered=jittered)
        return found

    # The belief

    def belief(self, fresh: bool = False) -> tuple[Float, Float]:
        """Return mean (n,) and covariance, checked if they were assigned since the last call."""
        n = self.state_motion.dim_x
        if not fresh and self.x is self._known_x and self.P is self._known_P:
            return self.x.reshape(n), self.P
        x = real("x", self.x)
        if x.shape not in ((n,), (n, 1)):
            raise ValueError(f"x must have shape ({n},) or ({n}, 1); got {x.shape}")
        if not np.isfinite(x).all():
            raise ValueError(f"x must be finite; got {x.ravel().tolist()}")
        return x.reshape(n), covariance("P", self.P, n)

    def set_belief(self, x: Float, P: Float) -> None:
        """Take over a belief, shapes (n,) and (n, n), that is known to be sound: no checks."""
        self.x = self._known_x = x.reshape(np.shape(self.x))
        self.P = self._known_P = P

    def record_update(self, z: Float, found: GaussianUpdate) -> None:
        """Set the attributes of the last measurement."""
        shape = self._as_given(len(z))
        self.z, self.y = z.reshape(shape), found.y.reshape(shape)
        self.K, self.S, self.SI = found.K, found.S, found.SI
        self.log_likelihood = float(found.log_likelihood)
        self.mahalanobis = math.sqrt(max(float(found.square), 0.0))
        self.jitter_count += found.jittered

    def record_missed(self) -> None:
        """Set the attributes of the last measurement to those of a missing one."""
        shape = self._as_given(self.dim_z)
        self.z, self.y = np.full(shape, np.nan), np.zeros(shape)
        self.log_likelihood = self.mahalanobis = 0.0

    def _as_given(self, m: int) -> tuple[int, ...]:
        return (m,) if np.ndim(self.x) == 1 else (m, 1)

    def control_effect(self, u: ArrayLike | None, B: ArrayLike | None) -> Float | None:
        """Return B u, or None where no control is given."""
        if u is None or not np.any(u):
            return None
        u = real("u", u).ravel()
        B = self.B if B is None else np.asarray(B, dtype=np.float64)
        if B is None:
            raise ValueError("u needs a motion with a control matrix: LinearMotion(..., control=B)")
        if u.shape != (B.shape[1],):
            raise ValueError(f"u must have shape ({B.shape[1]},); got {u.shape}")
        return np.asarray(B @ u)

    def process_noise(self, Q: ArrayLike) -> Float:
        """Return Q, or Q times the unit matrix if it is a number."""
        n = self.dim_x
        return covariance("Q", np.multiply(np.eye(n), Q) if np.ndim(Q) == 0 else Q, n)
