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
SEARCHED_SENSORS = 2000  # of a search for sources, taken at equal spacing from all
CHUNK_SIZE = 30_000  # numbers in one array of the grid search: a few fit into the cache
AMPLITUDE_STEP = 0.35  # Np, 3 dB: largest step between the amplitudes that the search starts from
MAX_AMPLITUDES = 201
MAX_EXPONENT = 340.0  # of powers over those of the readings: 1500 dB
AMPLITUDE_STEPS = 3  # Gauss-Newton steps from there


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
        """Log amplitudes of the grid, Np: up to three standard deviations each way."""
        std = np.sqrt(self.v)
        n = int(min(MAX_AMPLITUDES, 2 * np.ceil(max(3.0, 3.0 * std / AMPLITUDE_STEP)) + 1))
        return np.asarray(self.mu + np.linspace(-3.0, 3.0, n) * std)

    def prior(self, n: int) -> Prior:
        """Return the prior of n such sources, without a batch axis."""
        P = np.eye(2) / self.std**2
        return Prior(
            np.full(n, self.mu), np.full(n, 1 / self.v), np.tile(self.centre, (n, 1)),
            np.tile(P, (n, 1, 1)),
        )  # fmt: skip


def thinning(n_sensors: int) -> int:
    """Return the step between the sensors of a search: between 2000 and 4000 of them, or all.

    Examples
    --------
    >>> thinning(3999), thinning(100_000)
    (1, 50)
    """
    return max(1, n_sensors // SEARCHED_SENSORS)


def thinned(problem: JointPosterior) -> JointPosterior:
    """Return a problem without a batch axis at some sensors; itself if there are not too many."""
    step = thinning(problem.W.shape[-1])
    if step == 1:
        return problem
    rows = slice(None, None, step)
    propagation = problem.propagation.at_sensors(rows)
    return problem._replace(propagation=propagation, xi=problem.xi[rows], W=problem.W[rows])


def grid_search(
    problem: JointPosterior, log_sigma: Float, new: NewSourcePrior
) -> list[tuple[float, Float]]:
    """Return log amplitudes and positions of sources whose addition raises L most.

    Parameters
    ----------
    problem : JointPosterior
        Without a batch axis.
    log_sigma : ndarray, shape (n_sensors,)
        Levels without the additional source, Np; -inf for none.
    new : NewSourcePrior
        Grid of positions, and prior.

    Returns
    -------
    list of (float, ndarray of shape (2,))
        The best amplitudes at the lowest local minima over the grid, in ascending order.
    """
    valid = np.flatnonzero(problem.W > 0)
    valid = valid[:: thinning(len(valid))]
    propagation = problem.propagation
    gain = np.zeros(len(problem.W)) + np.atleast_2d(propagation.log_gain)[0]
    readings = problem.xi[valid], problem.W[valid], log_sigma[valid]
    grid = new.grid
    u, cost = np.empty(len(grid)), np.empty(len(grid))
    size = max(1, CHUNK_SIZE // len(valid))
    for first in range(0, len(grid), size):
        points = slice(first, first + size)
        geometry = offsets(grid[points], propagation.sensors[valid], propagation.r_min)
        loss = 0.5 * propagation.alpha * geometry.log_range - gain[valid]
        u[points], cost[points] = best_amplitudes(*readings, loss, new)
    cost += np.square((grid - new.centre) / new.std).sum(axis=-1)
    lowest = local_minima(cost)[:MAX_MINIMA]
    return [(float(u[k]), grid[k]) for k in lowest]


def best_amplitudes(
    xi: Float, W: Float, floor: Float, loss: Float, new: NewSourcePrior
) -> tuple[Float, Float]:
    """Return the log amplitudes u that minimize Σ W r² + (u - μ)²/v, and the minima.

    Parameters
    ----------
    xi, W, floor : ndarray, shape (n_sensors,)
        Readings, Np, their weights, and the levels without the source, Np.
    loss : ndarray, shape (n_points, n_sensors)
        Log amplitude lost on the path, Np.
    new : NewSourcePrior

    Returns
    -------
    u, cost : ndarray, shape (n_points,)

    Examples
    --------
    Without noise the minimum is a weighted mean:

    >>> prior = NewSourcePrior(mu=0.0, v=1e9, centre=np.zeros(2), std=1.0, step=1.0)
    >>> xi, none = np.array([1.0, 3.0]), np.full(2, -np.inf)
    >>> u, cost = best_amplitudes(xi, np.ones(2), none, np.zeros((1, 2)), prior)
    >>> u.round(6), cost.round(6)
    (array([2.]), array([2.]))
    """
    if np.isneginf(floor).all():
        # u = (Σ W (ξ + loss) + μ/v) / (Σ W + 1/v)
        u = ((xi + loss) @ W + new.mu / new.v) / (W.sum() + 1 / new.v)
        return u, np.square(xi + loss - u[:, None]) @ W + (u - new.mu) ** 2 / new.v
    # powers over those of the readings, e^{2ξ}: of the levels without the source, and of a source
    # of amplitude μ, so that each amplitude takes one logarithm
    noise, gain = bounded_exp(2 * (floor - xi)), bounded_exp(2 * (new.mu - xi - loss))

    total, log_total, new_total, new_log_total, work = np.empty((5, *gain.shape))  # made once

    def cost_at(u: Float, total: Float, log_total: Float) -> Float:
        np.multiply(bounded_exp(2 * (u - new.mu))[:, None], gain, out=total)
        total += noise
        # r = -½ ln total
        np.square(np.log(total, out=log_total), out=work)
        return np.asarray(0.25 * (work @ W) + (u - new.mu) ** 2 / new.v)

    starts = new.log_amplitudes
    costs = np.stack([cost_at(start, total, log_total) for start in starts[:, None]])
    u = starts[costs.argmin(axis=0)]
    cost = cost_at(u, total, log_total)
    for _ in range(AMPLITUDE_STEPS):
        lam = np.multiply(bounded_exp(2 * (u - new.mu))[:, None], gain, out=work)
        lam /= total
        # Gauss-Newton: Δu = (Σ W λ r + (μ - u)/v) / (Σ W λ² + 1/v)
        gradient = -0.5 * np.multiply(lam, log_total, out=new_total) @ W + (new.mu - u) / new.v
        step = gradient / (np.square(lam, out=lam) @ W + 1 / new.v)
        after = cost_at(u + step, new_total, new_log_total)
        lower = after < cost
        u, cost = np.where(lower, u + step, u), np.where(lower, after, cost)
        np.copyto(total, new_total, where=lower[:, None])
        np.copyto(log_total, new_log_total, where=lower[:, None])
    return u, cost


def bounded_exp(x: Float) -> Float:
    """Return the exponentials, of numbers within ±MAX_EXPONENT: two of them have a product.

    Examples
    --------
    >>> bounded_exp(np.array([0.0, 1e9])).round(-146)
    array([0.0e+000, 4.6e+147])
    """
    return np.exp(np.maximum(np.minimum(x, MAX_EXPONENT), -MAX_EXPONENT))


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
