"""Where one more source would explain most: a look at every place of a grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import offsets
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.typing import Float, Int

CANDIDATES = 3  # minima over the grid that are followed
ENOUGH = 2000  # sensors to look at a grid with, evenly taken from all
CHUNK = 2_000_000  # numbers held at once while a grid is scanned


@dataclass(frozen=True, eq=False)
class NewSourcePrior:
    """What is known of a source that nobody has seen yet.

    Parameters
    ----------
    mu, v : float
        Mean, Np, and variance, Np², of its log amplitude.
    centre : ndarray, shape (2,)
        Mean of its position, m.
    std : float
        Standard deviation of each coordinate, m.
    step : float
        Of the grid on which it is looked for, m.
    """

    mu: float
    v: float
    centre: Float
    std: float
    step: float

    @classmethod
    def among(
        cls,
        sensors: Float,
        mu: float,
        v: float,
        std: float | None = None,
        step: float | None = None,
    ) -> NewSourcePrior:
        """Return what sensors (n_sensors, 2) tell: sources may be where the sensors are.

        Examples
        --------
        >>> round(NewSourcePrior.among(np.array([[0.0, 0.0], [60.0, 80.0]]), 9.0, 0.1).std, 2)
        35.36
        """
        centre = sensors.mean(axis=0)
        spread = float(np.sqrt(np.square(sensors - centre).mean()))
        std = (spread if spread > 0 else 1.0) if std is None else std
        return cls(mu, v, centre, std, std / 5 if step is None else step)

    @cached_property
    def grid(self) -> Float:
        """Places to look at, (n_places, 2): the square of two standard deviations."""
        n = int(np.ceil(2 * self.std / self.step))
        axis = self.step * np.arange(-n, n + 1)
        east, north = np.meshgrid(axis, axis)
        return np.asarray(self.centre + np.stack([east.ravel(), north.ravel()], axis=-1))

    @cached_property
    def powers(self) -> Float:
        """Log amplitudes to look for, Np: seven, three standard deviations either side."""
        return np.asarray(self.mu + np.sqrt(self.v) * np.arange(-3.0, 4.0))

    def prior(self, n: int) -> Prior:
        """Return the prior of n such sources, without a batch axis."""
        P = np.eye(2) / self.std**2
        return Prior(
            np.full(n, self.mu), np.full(n, 1 / self.v), np.tile(self.centre, (n, 1)),
            np.tile(P, (n, 1, 1)),
        )  # fmt: skip


def scan(
    problem: JointPosterior, log_sigma: Float, new: NewSourcePrior
) -> list[tuple[float, Float]]:
    """Return log amplitudes and places of sources whose addition lowers Σ W r² most.

    Parameters
    ----------
    problem : Problem
        Without a batch axis.
    log_sigma : ndarray, shape (n_sensors,)
        Levels without it; -inf for none.
    new : Newcomers
        Where to look.

    Returns
    -------
    list of (float, ndarray of shape (2,))
        The lowest minima over the grid, the lowest first.
    """
    heard = np.flatnonzero(problem.W > 0)
    heard = heard[:: max(1, len(heard) // ENOUGH)]
    xi, W, floor = problem.xi[heard], problem.W[heard], 2 * log_sigma[heard]
    field = problem.field
    sensors = field.sensors[heard]
    gain = np.zeros(len(problem.W)) + np.atleast_2d(field.log_gain)[0]
    powers = 2 * new.powers[:, None] + 2 * gain[heard]
    cost = np.empty((len(new.grid), len(powers)))
    size = max(1, CHUNK // powers.size)
    for first in range(0, len(cost), size):
        places = slice(first, first + size)
        seen = offsets(new.grid[places], sensors, field.r_min)
        loss = field.alpha * seen.log_range
        r = xi - 0.5 * np.logaddexp(floor, powers - loss[:, None])
        cost[places] = (r * r) @ W
    found = minima(cost.min(axis=1))[:CANDIDATES]
    return [(float(new.powers[cost[k].argmin()]), new.grid[k]) for k in found]


def minima(cost: Float) -> Int:
    """Return the indices of the local minima over a square grid, (n²,), the lowest first.

    Examples
    --------
    >>> minima(np.array([1.0, 2.0, 3.0, 2.0, 3.0, 3.0, 3.0, 3.0, 0.0]))
    array([8, 0])
    """
    n = round(len(cost) ** 0.5)
    framed = np.pad(cost.reshape(n, n), 1, constant_values=np.inf)
    around = np.lib.stride_tricks.sliding_window_view(framed, (3, 3)).min(axis=(-2, -1))
    low = np.flatnonzero(cost <= around.ravel())
    return low[np.argsort(cost[low], kind="stable")]
