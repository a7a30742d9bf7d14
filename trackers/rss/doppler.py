"""Doppler's factor of the amplitudes, by the velocities of the beliefs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import (
    PropagationModel,
    doppler_log_gain,
)
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.rss.belief import Entries
from arrivals.typing import Float

FASTEST = 0.5  # of the waves: a velocity beyond it is shortened


class Doppler(NamedTuple):
    """Factor of moving sources, β of (1), which the paper leaves out after it.

    Parameters
    ----------
    entries : tuple of two int
        Entries of a state that are the velocity.
    speed : float
        Speed of the waves, m/s.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (1).
    """

    entries: Entries
    speed: float

    @classmethod
    def of(cls, motion: MotionModel, wave_speed: float, births: bool) -> Doppler:
        """Return the factor of a motion model.

        Raises
        ------
        ValueError
            If the motion has no velocity, or sources may appear.

        Examples
        --------
        >>> from arrivals.motion_models import ConstantVelocity, RandomWalk
        >>> Doppler.of(ConstantVelocity(q=1.0), 340.0, births=False)
        Doppler(entries=(1, 3), speed=340.0)
        >>> Doppler.of(RandomWalk(q=1.0), 340.0, births=False)
        Traceback (most recent call last):
        ValueError: motion must have vx and vy for wave_speed; got RandomWalk: use ConstantVelocity
        """
        names = motion.state_names
        if not {"vx", "vy"} <= set(names):
            got = type(motion).__name__
            raise ValueError(
                f"motion must have vx and vy for wave_speed; got {got}: use ConstantVelocity"
            )
        if births:
            raise ValueError(f"wave_speed must be None where sources may appear; got {wave_speed}")
        return cls((names.index("vx"), names.index("vy")), wave_speed)

    def applied(self, propagation: PropagationModel, theta: Float, x: Float) -> PropagationModel:
        """Return a propagation model with the gains of moving sources.

        Parameters
        ----------
        propagation : PropagationModel
            Of the sensors, without a batch axis.
        theta, x : ndarray, shape (n_batch, n_sources, 2), (n_batch, n_sources, n)
            Positions, m, and states.
        """
        velocity, limit = x[..., self.entries], FASTEST * self.speed
        length = np.linalg.norm(velocity, axis=-1, keepdims=True)
        v = velocity * (limit / np.maximum(length, limit))
        gain = doppler_log_gain(v, theta, propagation.sensors, self.speed)
        return propagation._replace(log_gain=propagation.log_gain + gain)


def check_doppler(motion: MotionModel, wave_speed: float | None, births: bool) -> None:
    """Raise a ValueError where a wave speed is given and the motion has no factor for it."""
    if wave_speed is not None:
        Doppler.of(motion, wave_speed, births)
