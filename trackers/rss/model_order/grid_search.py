"""Grid search for one additional source."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import offsets
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.settings import GridSearch
from arrivals.typing import Float, Int

MAX_MINIMA = 3  # minima over the grid that are refined
MAX_SENSORS = 2000  # in a grid search, taken at equal spacing from all
CHUNK_SIZE = 2_000_000  # numbers in one array of the grid search


@dataclass(frozen=True, eq=False)
class NewSourcePrior:
    """Prior of a source that has not been detected yet.

    Parameters
    ----------
    mu, v : float
        Mean, Np, and variance, Np², of its log amplitude.
    centre : ndarray, shape (2,)
        Mean of its position, m.
    std : float
        Standard deviation of each coordinate, m.
    step : float
        Step of the search grid, m.
    """

    mu: float
    v: float
    centre: Float
    std: float
    step: float

    @classmethod
    def among(
        cls, sensors: Float, mu: float, v: float, search: GridSearch = GridSearch()
    ) -> NewSourcePrior:
        """Return the prior of a source in the area of the sensors (n_sensors, 2).

        Examples
        --------
        >>> round(NewSourcePrior.among(np.array([[0.0, 0.0], [60.0, 80.0]]), 9.0, 0.1).std, 2)
        35.36
        """
        centre = sensors.mean(axis=0)
        std, step = search.area_std, search.grid_step
        if std is None:
            std = float(np.sqrt(np.square(sensors - centre).mean())) or 1.0
        return cls(mu, v, centre, std, std / 5 if step is None else step)

    @cached_property
    def grid(self) -> Float:
        """Positions of the grid, (n_points, 2): a square of two standard deviations each way."""
        n = int(np.ceil(2 * self.std / self.step))
        axis = self.step * np.arange(-n, n + 1)
        east, north = np.meshgrid(axis, axis)
        return np.asarray(self.centre + np.stack([east.ravel(), north.ravel()], axis=-1))

    @cached_property
    def log_amplitudes(self) -> Float:
        """Log amplitudes of the grid, Np: seven, up to three standard deviations each way."""
        return np.asarray(self.mu + np.sqrt(self.v) * np.arange(-3.0, 4.0))

    def prior(self, n: int) -> Prior:
        """Return the prior of n such sources, without a batch axis."""
        P = np.eye(2) / self.std**2
        return Prior(
            np.full(n, self.mu), np.full(n, 1 / self.v), np.tile(self.centre, (n, 1)),
            np.tile(P, (n, 1, 1)),
        )  # fmt: skip


def grid_search(
    problem: JointPosterior, log_sigma: Float, new: NewSourcePrior
) -> list[tuple[float, Float]]:
    """Return log amplitudes and positions of sources whose addition lowers Σ W r² most.

    Parameters
    ----------
    problem : JointPosterior
        Without a batch axis.
    log_sigma : ndarray, shape (n_sensors,)
        Levels without the additional source, Np; -inf for none.
    new : NewSourcePrior
        Grid of positions and log amplitudes.

    Returns
    -------
    list of (float, ndarray of shape (2,))
        The lowest local minima over the grid in ascending order.
    """
    valid = np.flatnonzero(problem.W > 0)
    valid = valid[:: max(1, len(valid) // MAX_SENSORS)]
    xi, W, floor = problem.xi[valid], problem.W[valid], 2 * log_sigma[valid]
    propagation = problem.propagation
    sensors = propagation.sensors[valid]
    gain = np.zeros(len(problem.W)) + np.atleast_2d(propagation.log_gain)[0]
    powers = 2 * new.log_amplitudes[:, None] + 2 * gain[valid]
    cost = np.empty((len(new.grid), len(powers)))
    size = max(1, CHUNK_SIZE // powers.size)
    for first in range(0, len(cost), size):
        points = slice(first, first + size)
        loss = propagation.alpha * offsets(new.grid[points], sensors, propagation.r_min).log_range
        r = xi - 0.5 * np.logaddexp(floor, powers - loss[:, None])
        cost[points] = (r * r) @ W
    lowest = local_minima(cost.min(axis=1))[:MAX_MINIMA]
    return [(float(new.log_amplitudes[cost[k].argmin()]), new.grid[k]) for k in lowest]


def local_minima(cost: Float) -> Int:
    """Return the indices of the local minima over a square grid, (n²,), in ascending order.

    Examples
    --------
    >>> local_minima(np.array([1.0, 2.0, 3.0, 2.0, 3.0, 3.0, 3.0, 3.0, 0.0]))
    array([8, 0])
    """
    n = round(len(cost) ** 0.5)
    framed = np.pad(cost.reshape(n, n), 1, constant_values=np.inf)
    around = np.lib.stride_tricks.sliding_window_view(framed, (3, 3)).min(axis=(-2, -1))
    low = np.flatnonzero(cost <= around.ravel())
    return low[np.argsort(cost[low], kind="stable")]
