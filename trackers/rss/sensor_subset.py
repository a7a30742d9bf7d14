"""Updates by a subset of the sensors, or by one cell of sensors after the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.path_loss import slopes
from arrivals.messages import shown
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.typing import Bool, Float, Int
from arrivals.validation import items

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker


def of_best_sensors(problem: JointPosterior, n: int, choice: str) -> JointPosterior:
    """Return a batch of problems with the readings of the n best sensors at the prior means.

    Parameters
    ----------
    problem : JointPosterior
        With one batch axis.
    n : int
    choice : {"information", "nearest"}
        One after the other by the expected decrease of the entropy; or nearest to a source.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, section 5: future work.
    """
    if n >= problem.W.shape[-1]:
        return problem
    used = (most_informative if choice == "information" else nearest)(problem, n)
    return problem._replace(W=np.where(used, problem.W, 0.0))


def nearest(problem: JointPosterior, n: int) -> Bool:
    """Return which n sensors with readings are nearest to a source, (n_batch, n_sensors).

    The sources take turns.
    """
    square = problem.propagation.offsets(problem.prior.theta).square
    square = np.where(problem.W[..., None, :] > 0, square, np.inf)
    rank = square.argsort(axis=-1).argsort(axis=-1).min(axis=-2)
    order = rank.argsort(axis=-1, kind="stable")
    used = np.zeros(problem.W.shape, dtype=np.bool_)
    np.put_along_axis(used, order[..., :n], True, axis=-1)
    return used


def most_informative(problem: JointPosterior, n: int) -> Bool:
    """Return which n sensors are expected to decrease the entropy most, (n_batch, n_sensors).

    Each is chosen after the others: the gain of a sensor is ½ log(1 + W gᵀ C g), with the
    gradient g of its reading and the covariance C that the sensors before it leave.
    """
    prior, rows = problem.prior, np.arange(len(problem.W))
    G = slopes(problem.propagation.levels(prior.mu, prior.theta), problem.propagation.alpha)
    C = np.linalg.inv(problem.prior_precision())
    used = np.zeros(problem.W.shape, dtype=np.bool_)
    for _ in range(n):
        gain = problem.W * np.einsum("bmi,bij,bmj->bm", G, C, G, optimize=True)
        best = np.where(used, -1.0, gain).argmax(axis=-1)
        used[rows, best] = True
        w, g = problem.W[rows, best], G[rows, best]
        Cg = (C @ g[..., None])[..., 0]
        scale = w / (1 + w * (g * Cg).sum(axis=-1))
        # C = C - C g g' C W / (1 + W g' C g)
        C = C - scale[:, None, None] * Cg[:, :, None] * Cg[:, None, :]
    return used


def update_by_cells(tracker: RSSTracker, z: ArrayLike | None, cells: Sequence[ArrayLike]) -> None:
    """Update a tracker by one cell of sensors after the other.

    Each cell needs its own readings and the posterior of the cell before it: means and
    covariances of the sources, seven numbers for each power and position. The cells linearise at
    different points, and covariances between sources are not passed on, so the result differs from
    that of all sensors together.

    Parameters
    ----------
    tracker : RSSTracker
        With a constant number of sources; it has the posterior of the last cell with readings
        afterwards, and the sum of the log likelihoods.
    z : array_like, shape (n_sensors,), or None
        Readings, Np; NaN where missing, None if all are.
    cells : sequence of array_like
        Indices of the sensors of each cell.

    Raises
    ------
    ValueError
        If a sensor is in two cells, a sensor does not exist, the readings have another shape, or
        sources may appear or have to be found: their detection needs all sensors.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, section 5: future work.

    Examples
    --------
    >>> from arrivals.measurement_models import LogNormalRSS
    >>> from arrivals.motion_models import RandomWalk
    >>> from arrivals.trackers import RSSVB
    >>> rss = LogNormalRSS(np.random.default_rng(0).uniform(-60, 60, (40, 2)), position=(0, 1))
    >>> tracker = RSSVB(RandomWalk(q=1.0), rss, [[-20.0, 15.0]], 100.0 * np.eye(2))
    >>> z = rss.draw([9.2], [[-25.0, 10.0]], np.random.default_rng(1))
    >>> update_by_cells(tracker, z, [range(20), range(20, 40)])
    >>> tracker.estimate.position.round(0)
    array([[-25.,  10.]])
    """
    n = tracker.measurement.dim_z
    readings, parts = tracker.vector(z), _disjoint(cells, n)
    if tracker.births or not len(tracker.tracks.label):
        got = "births" if tracker.births else "none"
        raise ValueError(f"tracker must have a constant number of sources, at least 1; got {got}")
    parts = [part for part in parts if not np.isnan(readings[part]).all()]
    if not parts:
        tracker.update(None)
        return
    total, elapsed = 0.0, tracker.elapsed
    for part in parts:
        own: Float = np.full(n, np.nan)
        own[part] = readings[part]
        tracker.elapsed = elapsed  # all cells are of one step
        tracker.update(own)
        total += tracker.log_likelihood
    tracker.log_likelihood = total


def _disjoint(cells: Sequence[ArrayLike], n_sensors: int) -> list[Int]:
    """Return the sensors of each cell; raise a ValueError if they are not sets of sensors."""
    parts = [np.asarray(cell) for cell in items("cells", cells)]
    wanted = f"cells must be lists of sensors, 0 to {n_sensors - 1}"
    if not parts:
        raise ValueError(f"{wanted}; got none")
    for part in parts:
        whole = part.ndim == 1 and part.dtype.kind in "iu"
        if not whole or part.size == 0 or part.min() < 0 or part.max() >= n_sensors:
            raise ValueError(f"{wanted}; got {shown(part)}")
    every = np.concatenate(parts)
    if len(np.unique(every)) < len(every):
        raise ValueError(f"cells must not share sensors; got {shown(every)}")
    return [part.astype(np.int64) for part in parts]
