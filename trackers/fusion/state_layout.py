"""Entries of a track's state: motion, log amplitude, errors of the stations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import Station
from arrivals.measurement_models.station import StationEntries
from arrivals.motion_models import MotionModel
from arrivals.trackers.gaussian.equations import predict_gaussian
from arrivals.trackers.rss.belief import transition_matrices
from arrivals.trackers.rss.settings import AmplitudePrior
from arrivals.typing import Float

TURN_RATE_STD = 0.05  # rad/s, of a new track
OTHER_STD = 1.0  # of entries of the motion that are neither position, velocity nor turn rate


@dataclass(frozen=True, eq=False)
class StateLayout:
    """Entries of the state of a track, and the state of a new one.

    Parameters
    ----------
    motion : MotionModel
        Its entries come first.
    position : (int, int)
        Entries that are x and y.
    velocity : (int, int) or None
        Entries that are their velocities.
    amplitude : int or None
        Entry that is the log amplitude, Np.
    errors : tuple of (int or None)
        First of the three entries with the errors of each station: heading, x, y.
    mean, variance : ndarray, shape (n,)
        State of a new track at the origin, before its position is known.
    drift : float
        Variance that the log amplitude gains per unit of time, Np².

    Examples
    --------
    >>> from arrivals.motion_models import ConstantVelocity
    >>> stations = [Station(None, [0.0, 0.0], heading_std=0.02), Station(None, [9.0, 0.0])]
    >>> layout = StateLayout.of(ConstantVelocity(q=0.1), stations, speed_std=2.0)
    >>> layout.position, layout.errors, layout.variance
    ((0, 2), (4, None), array([0.e+00, 4.e+00, 0.e+00, 4.e+00, 4.e-04, 0.e+00, 0.e+00]))
    """

    motion: MotionModel
    position: tuple[int, int]
    velocity: tuple[int, int] | None
    amplitude: int | None
    errors: tuple[int | None, ...]
    mean: Float
    variance: Float
    drift: float

    @classmethod
    def of(
        cls,
        motion: MotionModel,
        stations: Sequence[Station],
        speed_std: float,
        amplitude: AmplitudePrior | None = None,
    ) -> StateLayout:
        """Return the layout of a motion model with the errors of stations.

        Parameters
        ----------
        motion : MotionModel
            With the entries x and y.
        stations : sequence of Station
            Those with errors have three entries each.
        speed_std : float
            Standard deviation of each coordinate of a new track's velocity, m/s.
        amplitude : AmplitudePrior, optional
            Prior of the log amplitude where signal strength is measured.

        Raises
        ------
        TypeError
            If the motion model has no x or y.
        """
        names = list(motion.state_names)
        for name in ("x", "y"):
            if name not in names:
                raise TypeError(f"motion must have the entries x and y; got {tuple(names)}")
        if amplitude is not None and "log_amplitude" not in names:
            names.append("log_amplitude")
        n, errors = len(names), []
        for station in stations:
            errors.append(n if station.has_errors else None)
            n += 3 * station.has_errors
        mean, variance = np.zeros(n), np.zeros(n)
        std = {"x": 0.0, "y": 0.0, "vx": speed_std, "vy": speed_std, "turn_rate": TURN_RATE_STD}
        variance[: len(names)] = [std.get(name, OTHER_STD) ** 2 for name in names]
        u = None
        if amplitude is not None:
            u = names.index("log_amplitude")
            mean[u], variance[u] = float(amplitude.mean), float(amplitude.variance)  # type: ignore[arg-type]
        for first, station in zip(errors, stations, strict=True):
            if first is not None:
                place = station.position_std**2
                variance[first : first + 3] = station.heading_std**2, place, place
        velocity = (
            (names.index("vx"), names.index("vy")) if "vx" in names and "vy" in names else None
        )
        return cls(
            motion, (names.index("x"), names.index("y")), velocity, u, tuple(errors),
            mean, variance, 0.0 if amplitude is None else amplitude.drift,
        )  # fmt: skip

    @property
    def n(self) -> int:
        """Number of entries."""
        return len(self.mean)

    @property
    def first_error(self) -> int:
        """First entry that is an error of a station; `n` if there is none."""
        return next((e for e in self.errors if e is not None), self.n)

    def of_station(self, s: int) -> StationEntries:
        """Return the entries that a station reads."""
        return StationEntries(self.position, self.velocity, self.errors[s])

    def predicted(self, x: Float, P: Float, dt: float) -> tuple[Float, Float]:
        """Return means (..., n) and covariances (..., n, n) after `dt`.

        Only the entries of the motion move; the log amplitude walks, errors are constant.
        """
        m = self.motion.dim_x
        F, Q = np.zeros((*x.shape[:-1], self.n, self.n)), np.zeros((self.n, self.n))
        F[...] = np.eye(self.n)
        F[..., :m, :m] = transition_matrices(self.motion, x[..., :m], dt)
        Q[:m, :m] = self.motion.Q(dt)
        if self.amplitude is not None and self.amplitude >= m:
            Q[self.amplitude, self.amplitude] = self.drift * dt
        # x = f(x), P = F P F' + Q
        moved = x.copy()
        moved[..., :m] = self.motion.f(x[..., :m], dt)
        return moved, predict_gaussian(P, F, Q)
