"""A direction and the complex amplitude of its source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.von_mises import VonMisesWalk
from arrivals.typing import Float
from arrivals.validation import instance, not_negative, state, time_step


@dataclass(frozen=True)
class DirectionAmplitudeWalk(MotionModel):
    """A von Mises walk of the direction β, and a random walk of the complex amplitude w.

    The motion of one source for the Gaussian interface of `ArraySnapshot`.

    Parameters
    ----------
    direction : VonMisesWalk
        Motion of the direction.
    amplitude_noise : float
        Variance that the complex amplitude gains per unit of time; half of it in each part.

    Raises
    ------
    TypeError
        If `direction` is not a `VonMisesWalk`.
    ValueError
        If `amplitude_noise` is negative or not finite.

    Notes
    -----
    Shapes: states (..., 3), [β, Re w, Im w]. Units: rad and those of the amplitude.

    Examples
    --------
    >>> walk = DirectionAmplitudeWalk(VonMisesWalk(kappa=100.0), amplitude_noise=0.02)
    >>> walk.Q().diagonal().round(4)
    array([0.0101, 0.01  , 0.01  ])
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray, composite
    >>> from arrivals.trackers import EKF
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> tracker = EKF(walk, model, x=[0.1, 1.0, 0.0], P=np.diag([0.01, 0.5, 0.5]))
    >>> run = tracker.run([composite(model.array.steering_vector(0.2, 1.0))] * 5)
    >>> run.x[-1].round(1) + 0.0
    array([0.2, 1. , 0. ])
    """

    direction: VonMisesWalk
    amplitude_noise: float

    def __post_init__(self) -> None:
        instance("direction", self.direction, VonMisesWalk)
        not_negative("amplitude_noise", self.amplitude_noise)

    @property
    def dim_x(self) -> int:
        """Direction, real and imaginary part of the amplitude."""
        return 3

    @property
    def state_names(self) -> tuple[str, ...]:
        """doa, amplitude_re, amplitude_im."""
        return "doa", "amplitude_re", "amplitude_im"

    @property
    def angles(self) -> tuple[int, ...]:
        """The direction."""
        return (0,)

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states with wrapped directions: (..., 3) -> (..., 3)."""
        x = state(x, 3)
        return np.concatenate([self.direction.f(x[..., :1], dt), x[..., 1:]], axis=-1)

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the identity, (3, 3)."""
        time_step(dt)
        return np.eye(3)

    def Q(self, dt: float = 1.0) -> Float:
        """Return the variances of the step of the direction and of each part of the amplitude."""
        part = self.amplitude_noise / 2 * time_step(dt)
        return np.diag([self.direction.Q(dt)[0, 0], part, part])

    def sample(self, x: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Float:
        """Draw states after `dt`; directions take von Mises steps."""
        x = state(x, 3)
        scale = np.sqrt(abs(self.amplitude_noise) / 2 * time_step(dt))
        doa = self.direction.sample(x[..., :1], rng, dt)
        return np.concatenate([doa, rng.normal(x[..., 1:], scale)], axis=-1)
