"""Motion on circles of unknown curvature."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.linear import ConstantVelocity
from arrivals.typing import Float
from arrivals.validation import not_negative, state, time_step


@dataclass(frozen=True)
class CoordinatedTurn(MotionModel):
    """A position in the plane whose velocity turns at a rate that is part of the state.

    Parameters
    ----------
    q : float
        Spectral density of the acceleration.
    q_turn : float
        Variance gained by the turn rate per unit of time.

    Raises
    ------
    ValueError
        If `q` or `q_turn` is negative or not finite.

    Notes
    -----
    Shapes: states (..., 5), [x, vx, y, vy, ω]; ω > 0 turns anticlockwise. Units: with lengths in m
    and time in s, ω in rad/s, `q` in m²/s³, `q_turn` in rad²/s³.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    sec. 11.7; the noise is that of `ConstantVelocity`.

    Examples
    --------
    A quarter of a circle:

    >>> CoordinatedTurn(q=0.1, q_turn=0.01).f([0.0, 1.0, 0.0, 0.0, np.pi / 2]).round(4)
    array([0.6366, 0.    , 0.6366, 1.    , 1.5708])
    """

    q: float
    q_turn: float

    def __post_init__(self) -> None:
        not_negative("q", self.q)
        not_negative("q_turn", self.q_turn)

    @property
    def dim_x(self) -> int:
        """Position and velocity in the plane, and the turn rate."""
        return 5

    @property
    def state_names(self) -> tuple[str, ...]:
        """x, vx, y, vy, turn_rate."""
        return "x", "vx", "y", "vy", "turn_rate"

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt` on their circles: (..., 5) -> (..., 5)."""
        px, vx, py, vy, omega = np.moveaxis(state(x, 5), -1, 0)
        dt = time_step(dt)
        c, s = np.cos(omega * dt), np.sin(omega * dt)
        along, across = _chord(omega, dt)
        return np.stack(
            [
                px + along * vx - across * vy,
                c * vx - s * vy,
                py + across * vx + along * vy,
                s * vx + c * vy,
                omega,
            ],
            axis=-1,
        )

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the Jacobian of `f` at one state, (5, 5)."""
        x, dt = state(x, 5), time_step(dt)
        if x.ndim != 1:
            raise ValueError(f"x must have shape (5,); got {x.shape}")
        _, vx, _, vy, omega = x
        c, s = np.cos(omega * dt), np.sin(omega * dt)
        along, across = _chord(omega, dt)
        d_along, d_across = _chord_slope(omega, dt)
        return np.array(
            [
                [1, along, 0, -across, d_along * vx - d_across * vy],
                [0, c, 0, -s, -dt * (s * vx + c * vy)],
                [0, across, 1, along, d_across * vx + d_along * vy],
                [0, s, 0, c, dt * (c * vx - s * vy)],
                [0, 0, 0, 0, 1],
            ],
            dtype=np.float64,
        )

    def Q(self, dt: float = 1.0) -> Float:
        """Return the noise of `ConstantVelocity`, and q_turn dt on the turn rate."""
        Q, dt = np.zeros((5, 5)), time_step(dt)
        Q[:4, :4] = ConstantVelocity(self.q).Q(dt)
        Q[4, 4] = self.q_turn * dt
        return Q


def _chord(omega: Float, dt: float) -> tuple[Float, Float]:
    """Return sin(ωt)/ω and (1 - cos ωt)/ω; sinc (of numpy, in half turns) is smooth at ω = 0."""
    turn = omega * dt
    return dt * np.sinc(turn / np.pi), dt * turn / 2 * np.sinc(turn / (2 * np.pi)) ** 2


def _chord_slope(omega: float, dt: float) -> tuple[float, float]:
    """Return the derivatives of `_chord` with respect to ω."""
    turn = omega * dt
    sinc, half = np.sinc(turn / np.pi), np.sinc(turn / (2 * np.pi))
    if abs(turn) < 0.5:  # cos - sinc cancels: Taylor's series
        t2 = turn**2
        d_along = turn * (-1 / 3 + t2 * (1 / 30 - t2 * (1 / 840 - t2 * (1 / 45360 - t2 / 3991680))))
    else:
        d_along = (np.cos(turn) - sinc) / turn
    return dt**2 * d_along, dt**2 * (sinc - half**2 / 2)
