"""Models some of whose matrices were assigned to a filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel, WrappedMeasurement
from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.linear import LinearMotion
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.typing import Float
from arrivals.validation import state


@dataclass(frozen=True, eq=False)
class ReplacedMotion(MotionModel):
    """A motion model with other matrices than its own; they hold for steps of any length.

    Parameters
    ----------
    motion : MotionModel
        The model.
    transition : ndarray, shape (dim_x, dim_x), optional
        F of steps of one unit of time, instead of the model's function.
    noise : ndarray, shape (dim_x, dim_x), optional
        Q of every step.
    control : ndarray, shape (dim_x, dim_u), optional
        B.

    Examples
    --------
    >>> from arrivals.motion_models import VonMisesWalk
    >>> motion = ReplacedMotion(VonMisesWalk(9.0), noise=np.array([[0.25]]))
    >>> motion.Q(0.5), motion.angles
    (array([[0.25]]), (0,))
    """

    motion: MotionModel
    transition: Float | None = None
    noise: Float | None = None
    control: Float | None = None

    @property
    def dim_x(self) -> int:
        """That of the model."""
        return self.motion.dim_x

    @property
    def state_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return self.motion.state_names

    @property
    def angles(self) -> tuple[int, ...]:
        """Those of the model."""
        return self.motion.angles

    @property
    def is_linear(self) -> bool:
        """True if the function is a matrix."""
        return self.transition is not None or self.motion.is_linear

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt`, without noise: (..., dim_x) -> (..., dim_x)."""
        if self.transition is None:
            return self.motion.f(x, dt)
        return wrapped(np.asarray(state(x, self.dim_x) @ self.F(x, dt).T), self.angles)

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the Jacobian of `f` at one state, (dim_x, dim_x)."""
        if self.transition is None:
            return self.motion.F(x, dt)
        if dt != 1:
            raise ValueError(f"dt must be 1 where F was assigned; got {dt}: assign F of the step")
        return self.transition.copy()

    def Q(self, dt: float = 1.0) -> Float:
        """Return the covariance of the noise of a step, (dim_x, dim_x)."""
        return self.motion.Q(dt) if self.noise is None else self.noise.copy()


@dataclass(frozen=True, eq=False)
class ReplacedNoise(WrappedMeasurement):
    """A measurement model with another noise than its own.

    Parameters
    ----------
    measurement : MeasurementModel
        The model.
    noise : ndarray, shape (dim_z, dim_z)
        R.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> ReplacedNoise(Bearing([[0.0, 0.0]], noise=0.01), np.array([[4.0]])).R
    array([[4.]])
    """

    noise: Float

    @property
    def R(self) -> Float:
        """A copy of `noise`."""
        return self.noise.copy()

    def for_state(self, names: Sequence[str]) -> MeasurementModel:
        """Return the model for states with these names, with this noise."""
        measurement = self.measurement.for_state(names)
        return self if measurement is self.measurement else ReplacedNoise(measurement, self.noise)


def replace_motion(motion: MotionModel, changes: dict[str, Any], dt: float = 1.0) -> MotionModel:
    """Return a motion model with other matrices: a `LinearMotion` where nothing else is needed.

    Parameters
    ----------
    motion : MotionModel
        The model.
    changes : dict of str to ndarray
        New matrices by the names F, Q and B.
    dt : float
        Length of the step that an old Q is taken of, where F is new.

    Returns
    -------
    MotionModel
        The changed model.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk
    >>> replace_motion(LinearMotion([[1.0]], [[2.0]]), {"Q": np.eye(1)}).noise
    array([[1.]])
    >>> replace_motion(RandomWalk(1.0, 1), {"Q": 9.0 * np.eye(1)}).Q(0.5)
    array([[9.]])
    """
    old: dict[str, Any] = {"B": getattr(motion, "control", None)}
    if type(motion) is LinearMotion:
        old |= {"F": motion.transition, "Q": motion.noise}
    if isinstance(motion, ReplacedMotion):
        old |= {"F": motion.transition, "Q": motion.noise}
        motion = motion.motion
    new = old | changes
    F, Q, B = new.get("F"), new.get("Q"), new["B"]
    if F is not None and not motion.angles:
        return LinearMotion(F, motion.Q(dt) if Q is None else Q, B, motion.state_names)
    return ReplacedMotion(motion, F, Q, B)


def replace_measurement(measurement: MeasurementModel, changes: dict[str, Any]) -> MeasurementModel:
    """Return a measurement model with another H, then linear, or another R.

    Parameters
    ----------
    measurement : MeasurementModel
        The model.
    changes : dict of str to ndarray
        New matrices by the names H and R.

    Returns
    -------
    MeasurementModel
        The changed model.

    Examples
    --------
    >>> replace_measurement(LinearMeasurement([[1.0]], [[1.0]]), {"H": np.array([[2.0]])}).matrix
    array([[2.]])
    """
    R = changes.get("R", measurement.R)
    if "H" in changes:
        return LinearMeasurement(changes["H"], R)
    if type(measurement) is LinearMeasurement:
        return LinearMeasurement(measurement.matrix, R)
    if isinstance(measurement, ReplacedNoise):
        measurement = measurement.measurement
    return ReplacedNoise(measurement, R)
