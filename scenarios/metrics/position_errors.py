"""Errors of several positions: assignment, Huber's M-estimates and summaries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import neper_to_db
from arrivals.messages import shown
from arrivals.typing import Float, Int
from arrivals.validation import LARGEST, SMALLEST, one_of, positive, real, shaped

HUBER = 1.345  # deviations: 95 % efficient for Gaussian errors
LOST_DISTANCE = 20.0  # m: sources beyond it are counted as lost
MAX_DISTANCE = 1e6  # m, of estimates that are not finite

Assignment = Literal["nearest", "one-to-one"]


@dataclass(frozen=True)
class HuberEstimate:
    """Robust mean and root mean square of errors.

    Parameters
    ----------
    bias : float
        Huber's M-estimate of the mean.
    rms : float
        Root of the weighted mean square, with the weights of that estimate.
    """

    bias: float
    rms: float


def huber(errors: ArrayLike, k: float = HUBER) -> HuberEstimate:
    """Return Huber's M-estimate of location, by scipy's robust loss, and the RMS of its weights.

    Parameters
    ----------
    errors : array_like
        Errors of any shape, in any unit.
    k : float
        Errors beyond k scales count linearly. The scale is the median absolute deviation.

    Returns
    -------
    HuberEstimate
        Mean and root mean square.

    Raises
    ------
    ValueError
        If `errors` is empty or not finite.

    References
    ----------
    Huber, *Robust Statistics*, 1981, sec. 3.2 and 6.7; Cevher et al., ICASSP 2008, Table 1.

    Examples
    --------
    >>> estimate = huber([1.0, -1.0, 2.0, -2.0, 1000.0])
    >>> round(estimate.bias, 2), round(estimate.rms, 1)
    (1.0, 31.6)
    """
    from scipy.optimize import least_squares

    e = real("errors", errors).ravel()
    if e.size == 0 or not (np.abs(e) < LARGEST).all():
        raise ValueError(f"errors must be finite, at least one; got {shown(e)}")
    median = float(np.median(e))
    scale = float(np.median(np.abs(e - median))) / 0.6745
    if scale < SMALLEST:
        return HuberEstimate(median, float(np.sqrt(np.mean(e**2))))
    limit = positive("k", k) * scale
    fit = least_squares(
        lambda m: e - m, [median], lambda m: -np.ones((e.size, 1)), loss="huber", f_scale=limit
    )
    bias = float(fit.x[0])
    weights = np.minimum(1.0, limit / np.maximum(np.abs(e - bias), 1e-300))
    return HuberEstimate(bias, float(np.sqrt((weights * e**2).sum() / weights.sum())))


def assign(theta: ArrayLike, truth: ArrayLike, how: Assignment = "nearest") -> Int:
    """Return the index of the estimate that is assigned to each true position.

    Parameters
    ----------
    theta : array_like, shape (n_estimates, 2)
        Estimates, m; at least n_sources for "one-to-one".
    truth : array_like, shape (n_sources, 2)
        True positions, m.
    how : {"nearest", "one-to-one"}
        The paper's assignment, which may use one estimate twice and so favours merged solutions;
        or each estimate once, with the smallest sum of distances.

    Returns
    -------
    ndarray of int, shape (n_sources,)
        Rows of `theta`.

    Raises
    ------
    ValueError
        If "one-to-one" has too few estimates.

    Examples
    --------
    >>> theta, truth = [[0.0, 0.0], [90.0, 0.0]], [[1.0, 0.0], [10.0, 0.0]]
    >>> assign(theta, truth), assign(theta, truth, "one-to-one")
    (array([0, 0]), array([0, 1]))
    """
    distance = distances(theta, truth)
    if one_of("how", how, ("nearest", "one-to-one")) == "nearest":
        return np.asarray(distance.argmin(axis=0))
    from scipy.optimize import linear_sum_assignment

    if len(distance) < distance.shape[1]:
        raise ValueError(
            f"theta must have at least {distance.shape[1]} rows for one-to-one; got {len(distance)}"
        )
    rows, columns = linear_sum_assignment(distance)
    return np.asarray(rows[np.argsort(columns)])


def distances(theta: ArrayLike, truth: ArrayLike) -> Float:
    """Return distances (n_estimates, n_sources), m, at most `MAX_DISTANCE`, also of NaN."""
    theta, truth = real("theta", theta), real("truth", truth)
    if (
        not theta.ndim == truth.ndim == 2
        or not theta.shape[1] == truth.shape[1] == 2
        or not len(theta)
    ):
        raise ValueError(
            "theta and truth must have shapes (n_estimates, 2) and (n_sources, 2), one or more; "
            f"got {theta.shape} and {truth.shape}"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        distance = np.linalg.norm(theta[:, None] - truth, axis=-1)
    return np.where(np.isfinite(distance), np.minimum(distance, MAX_DISTANCE), MAX_DISTANCE)


@dataclass(frozen=True)
class Scores:
    """Summary of the errors of many runs.

    Parameters
    ----------
    location_rms : float
        Huber's RMS of the x and y errors together, m.
    location_bias : float
        Length of Huber's mean of the x and y errors, m.
    amplitude_rms, amplitude_bias : float
        Huber's RMS and mean of the amplitude errors, dB.
    median, p90 : float
        Quantiles of the distances, m.
    lost : float
        Fraction of distances beyond 20 m.
    """

    location_rms: float
    location_bias: float
    amplitude_rms: float
    amplitude_bias: float
    median: float
    p90: float
    lost: float


@dataclass(frozen=True, eq=False)
class PositionErrors:
    """Errors of the estimates that are assigned to the sources of many runs.

    Parameters
    ----------
    position : ndarray, shape (n_runs, n_sources, 2)
        Errors of x and y, m.
    amplitude : ndarray, shape (n_runs, n_sources)
        Errors of the amplitudes, dB.
    """

    position: Float
    amplitude: Float

    @classmethod
    def of(
        cls, theta: ArrayLike, truth: ArrayLike, u: ArrayLike, true_u: ArrayLike,
        how: Assignment = "nearest",
    ) -> PositionErrors:  # fmt: skip
        """Return the errors of estimates; the arguments are those of `scores`."""
        theta, truth = real("theta", theta), real("truth", truth)
        if theta.ndim != 3 or truth.ndim != 3 or len(theta) != len(truth) or not truth.size:
            raise ValueError(
                "theta and truth must have shape (n_runs, n_sources, 2), not empty; "
                f"got {theta.shape} and {truth.shape}"
            )
        u, true_u = shaped("u", u, *theta.shape[:2]), shaped("true_u", true_u, *truth.shape[:2])
        index = np.array([assign(t, s, how) for t, s in zip(theta, truth, strict=True)])
        error = _bounded(np.take_along_axis(theta, index[..., None], axis=1) - truth)
        du = np.take_along_axis(u, index, axis=1) - true_u
        return cls(error, _bounded(neper_to_db(du)))

    def runs(self, rows: ArrayLike) -> PositionErrors:
        """Return the errors of some of the runs."""
        index = np.asarray(rows)
        return PositionErrors(self.position[index], self.amplitude[index])

    @property
    def distance(self) -> Float:
        """Distances of the estimates from the sources, m, (n_runs, n_sources)."""
        return np.asarray(np.hypot(self.position[..., 0], self.position[..., 1]))

    def summary(self) -> Scores:
        """Return the statistics of all runs."""
        x, y = huber(self.position[..., 0]), huber(self.position[..., 1])
        level = huber(self.amplitude)
        return Scores(
            location_rms=float(np.hypot(x.rms, y.rms)),
            location_bias=float(np.hypot(x.bias, y.bias)),
            amplitude_rms=level.rms,
            amplitude_bias=level.bias,
            median=float(np.median(self.distance)),
            p90=float(np.quantile(self.distance, 0.9)),
            lost=float(np.mean(self.distance > LOST_DISTANCE)),
        )


def scores(
    theta: ArrayLike,
    truth: ArrayLike,
    u: ArrayLike,
    true_u: ArrayLike,
    how: Assignment = "nearest",
) -> Scores:
    """Summarise the errors of many runs by the statistics of the paper's Table 1, and quantiles.

    Parameters
    ----------
    theta, truth : array_like, shape (n_runs, n_sources, 2)
        Estimates and true positions, m.
    u, true_u : array_like, shape (n_runs, n_sources)
        Log amplitudes, Np.
    how : {"nearest", "one-to-one"}
        As in `assign`.

    Returns
    -------
    Scores
        Robust statistics and quantiles.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, Table 1.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> truth = rng.uniform(-50, 50, (200, 2, 2))
    >>> theta = truth + rng.standard_normal(truth.shape)
    >>> round(scores(theta, truth, truth[..., 0], truth[..., 0]).location_rms, 1)
    1.3
    """
    return PositionErrors.of(theta, truth, u, true_u, how).summary()


def _bounded(error: Float) -> Float:
    """Return errors within ± `MAX_DISTANCE`; NaN becomes the upper end."""
    return np.clip(np.nan_to_num(error, nan=MAX_DISTANCE), -MAX_DISTANCE, MAX_DISTANCE)
