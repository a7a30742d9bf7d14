"""filterpy's names for what the models of a tracker say."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.equations import likelihood
from arrivals.typing import Float


class FilterpyAttributes(Tracker):
    """A tracker with two models, whose matrices it shows as they are now."""

    motion: MotionModel
    measurement: MeasurementModel
    log_likelihood: float
    _dt: float

    @property
    def state_motion(self) -> MotionModel:
        """How the whole state moves: `motion`, unless a method puts more into the state."""
        return self.motion

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
