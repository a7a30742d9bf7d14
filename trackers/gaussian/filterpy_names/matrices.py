"""The models of a filter, and their matrices under filterpy's names, which can be assigned."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.arguments import (
    control_matrix,
    covariance_matrix,
    finite_matrix,
)
from arrivals.trackers.gaussian.filterpy_names.replaced_models import (
    replace_measurement,
    replace_motion,
)
from arrivals.typing import Float

OF_MOTION, OF_MEASUREMENT = ("F", "Q", "B"), ("H", "R")


class FollowsTheState(np.ndarray[Any, np.dtype[np.float64]]):
    """A Jacobian at the present state, read-only: writing to it raises with the cure.

    Examples
    --------
    >>> F = follows_the_state(np.eye(2))
    >>> F[0, 1] = 0.5
    Traceback (most recent call last):
    ValueError: F and H of nonlinear models follow the state: assign a matrix, tracker.F = ...
    """

    def __setitem__(self, key: Any, value: Any) -> None:
        if not self.flags.writeable:
            raise ValueError(
                "F and H of nonlinear models follow the state: assign a matrix, tracker.F = ..."
            )
        super().__setitem__(key, value)  # of a copy

    def __repr__(self) -> str:
        return repr(np.asarray(self))


def follows_the_state(matrix: Float) -> FollowsTheState:
    """Return a read-only view of a matrix.

    Examples
    --------
    >>> follows_the_state(np.eye(1))
    array([[1.]])
    """
    view = matrix.view(FollowsTheState)
    view.setflags(write=False)
    return view


class ModelMatrices:
    """Motion and measurement model of a filter, and F, Q, B, H, R of them.

    An assigned matrix replaces the model by one that has this matrix. An array that was read or
    assigned belongs to the filter, as in filterpy: what is written into it holds from the next
    step on.

    Attributes
    ----------
    held_motion, held_measurement : MotionModel, MeasurementModel
        The models, as of the last step.
    held_angles : tuple of int
        Entries of the state of the motion that are angles.
    handed : dict of str to tuple
        Arrays that a user may write to, and their bytes when they were last read.
    last_dt : float
        Length of the last step.
    """

    x: Float
    held_motion: MotionModel
    held_angles: tuple[int, ...]
    held_measurement: MeasurementModel
    handed: dict[str, tuple[Float, bytes]]
    last_dt: float
    linear_only = False  # True where models are linear even if they do not say so
    fading = 1.0  # factor of F P F', above 1 for a fading memory

    @property
    def alpha(self) -> float:
        """Factor of fading memory: 1, none, unless a filter has one."""
        return 1.0

    @property
    def motion(self) -> MotionModel:
        """Motion of the state."""
        self.take_back()
        return self.held_motion

    @motion.setter
    def motion(self, motion: MotionModel) -> None:
        self.hold_motion(motion)
        self._forget(OF_MOTION)

    @property
    def measurement(self) -> MeasurementModel:
        """Measurement of a state."""
        self.take_back()
        return self.held_measurement

    @measurement.setter
    def measurement(self, measurement: MeasurementModel) -> None:
        self.held_measurement = measurement
        self._forget(OF_MEASUREMENT)

    def hold_motion(self, motion: MotionModel) -> None:
        """Set the model of the next step."""
        self.held_motion, self.held_angles = motion, motion.angles

    @property
    def state_motion(self) -> MotionModel:
        """Motion of the whole state: `motion`, unless a method adds entries to the state."""
        return self.held_motion

    @property
    def dim_x(self) -> int:
        """Number of entries of the state."""
        return self.state_motion.dim_x

    @property
    def dim_z(self) -> int:
        """Number of entries of a measurement."""
        return self.held_measurement.dim_z

    @property
    def dim_u(self) -> int:
        """Number of control inputs."""
        return 0 if self.B is None else int(self.B.shape[1])

    @property
    def F(self) -> Float:
        """Jacobian of the motion at the present mean, for the length of the last step."""
        linear = self.linear_only or self.state_motion.is_linear
        return self._matrix("F", self._present_F, linear)

    @F.setter
    def F(self, F: ArrayLike) -> None:
        self._assign("F", F)

    def _present_F(self) -> Float:
        return self.state_motion.F(np.ravel(self.x), self.last_dt)

    @property
    def Q(self) -> Float:
        """Noise of the motion, for the length of the last step."""
        return self._matrix("Q", lambda: self.state_motion.Q(self.last_dt))

    @Q.setter
    def Q(self, Q: ArrayLike) -> None:
        self._assign("Q", Q)

    @property
    def B(self) -> Float | None:
        """Control matrix of the motion, None if it has none."""
        control = getattr(self.state_motion, "control", None)
        return None if control is None else self._matrix("B", lambda: control)

    @B.setter
    def B(self, B: ArrayLike | None) -> None:
        self._assign("B", B)

    @property
    def H(self) -> Float:
        """Jacobian of the measurement at the present mean."""
        linear = self.linear_only or self.held_measurement.is_linear
        return self._matrix("H", lambda: self.held_measurement.H(np.ravel(self.x)), linear)

    @H.setter
    def H(self, H: ArrayLike) -> None:
        self._assign("H", H)

    @property
    def R(self) -> Float:
        """Noise of the measurement."""
        return self._matrix("R", lambda: self.held_measurement.R)

    @R.setter
    def R(self, R: ArrayLike) -> None:
        self._assign("R", R)

    @property
    def u(self) -> float:
        """Zero: a control input is an argument of `predict`."""
        return 0.0

    @u.setter
    def u(self, u: ArrayLike | None) -> None:
        if u is not None and np.any(u):
            raise AttributeError(f"u must be passed to each step, predict(u); got {u}")

    def take_back(self) -> None:
        """Replace the models where a matrix was written to since the last step."""
        if not self.handed:
            return
        written = {
            name: array for name, (array, raw) in self.handed.items() if array.tobytes() != raw
        }
        if written:
            self._replace(written)

    def read_again(self, dt: float) -> None:
        """Note the length of a step; forget F and Q that were read for another one."""
        self.last_dt = dt
        for name, read in (("F", self._present_F), ("Q", lambda: self.state_motion.Q(dt))):
            if name in self.handed and read().tobytes() != self.handed[name][1]:
                self._forget((name,))

    def _matrix(self, name: str, read: Any, writeable: bool = True) -> Float:
        """Return a matrix of a model: always the same array, if it does not follow the state."""
        if name in self.handed:
            return self.handed[name][0]
        array = np.array(read(), dtype=np.float64)
        if not writeable or (name in OF_MOTION and self.state_motion is not self.held_motion):
            return follows_the_state(array)
        self._hand_out({name: array})
        return array

    def _assign(self, name: str, value: Any) -> None:
        if name in OF_MOTION and self.state_motion is not self.held_motion:
            kind = type(self).__name__
            raise AttributeError(f"{name} of {kind} cannot be assigned: assign motion")
        array = self._checked(name, value)
        if name == "B" and array is None:
            self.motion = replace_motion(self.motion, {"B": None})
        else:
            self._replace({name: array})

    def _replace(self, changes: dict[str, Any]) -> None:
        """Replace models by ones with other matrices, given as arrays that a user may keep."""
        checked = {name: self._checked(name, array) for name, array in changes.items()}
        of_motion = {name: checked[name] for name in OF_MOTION if name in checked}
        of_measurement = {name: checked[name] for name in OF_MEASUREMENT if name in checked}
        motion, measurement = self.held_motion, self.held_measurement
        if of_motion:
            motion = replace_motion(motion, of_motion, self.last_dt)
        if of_measurement:
            measurement = replace_measurement(measurement, of_measurement)
        self.hold_motion(motion)
        self.held_measurement = measurement
        self._hand_out(changes)

    def _checked(self, name: str, value: Any) -> Any:
        """Return a matrix as an array of its shape, the value itself if it is one."""
        n, m = self.dim_x, self.dim_z
        if name == "Q":
            return covariance_matrix(name, value, n)
        if name == "R":
            return covariance_matrix(name, value, m)
        if name == "B":
            return control_matrix(value, n)
        if name == "H":
            return finite_matrix(name, np.atleast_2d(value), m, n)
        return finite_matrix(name, value, n, n)

    def _hand_out(self, arrays: dict[str, Float]) -> None:
        self.handed = self.handed | {name: (each, each.tobytes()) for name, each in arrays.items()}

    def _forget(self, names: tuple[str, ...]) -> None:
        handed = vars(self).get("handed", {})
        self.handed = {name: each for name, each in handed.items() if name not in names}
