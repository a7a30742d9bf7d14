"""Errors of several positions at once: who stands for whom, and summaries that lost runs spare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import neper_to_db
from arrivals.typing import Float, Int
from arrivals.validation import one_of, positive, real

HUBER = 1.345  # deviations: 95 % efficient for Gaussian errors
FAR = 20.0  # m, of the share of lost sources
GONE = 1e6  # m, in place of an estimate that is not finite

Assignment = Literal["nearest", "one-to-one"]


@dataclass(frozen=True)
class HuberEstimate:
    """Robust mean and spread of errors.

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
        Any shape; in any unit.
    k : float
        Errors beyond k scales count linearly. The scale is the median absolute deviation.

    Raises
    ------
    ValueError
        If there is no error, or one is not finite.

    References
    ----------
    Huber, *Robust Statistics*, 1981, sec. 3.2 and 6.7; Cevher et al., ICASSP 2008, Table 1.

    Examples
    --------
    >>> found = huber([1.0, -1.0, 2.0, -2.0, 1000.0])
    >>> round(found.bias, 2), round(found.rms, 1)
    (1.0, 31.6)
    """
    from scipy.optimize import least_squares

    e = real("errors", errors).ravel()
    if e.size == 0 or not np.isfinite(e).all():
        raise ValueError(f"errors must be finite, at least one; got {e.tolist()}")
    middle = float(np.median(e))
    scale = float(np.median(np.abs(e - middle))) / 0.6745
    if scale == 0:
        return HuberEstimate(middle, float(np.sqrt(np.mean(e**2))))
    reach = positive("k", k) * scale
    found = least_squares(
        lambda m: e - m, [middle], lambda m: -np.ones((e.size, 1)), loss="huber", f_scale=reach
    )
    bias = float(found.x[0])
    weights = np.minimum(1.0, reach / np.maximum(np.abs(e - bias), 1e-300))
    return HuberEstimate(bias, float(np.sqrt((weights * e**2).sum() / weights.sum())))


def assign(theta: ArrayLike, truth: ArrayLike, how: Assignment = "nearest") -> Int:
    """Return, for each true position, the number of the estimate that stands for it.

    Parameters
    ----------
    theta : array_like, shape (n_found, 2)
        Estimates, m; at least as many as truths for "one-to-one".
    truth : array_like, shape (n_sources, 2)
        m.
    how : {"nearest", "one-to-one"}
        The paper's, which may take one estimate twice and so flatters merged solutions; or
        each once, of the least sum of distances.

    Examples
    --------
    >>> found, truth = [[0.0, 0.0], [90.0, 0.0]], [[1.0, 0.0], [10.0, 0.0]]
    >>> assign(found, truth), assign(found, truth, "one-to-one")
    (array([0, 0]), array([0, 1]))
    """
    apart = distances(theta, truth)
    if one_of("how", how, ("nearest", "one-to-one")) == "nearest":
        return np.asarray(apart.argmin(axis=0))
    from scipy.optimize import linear_sum_assignment

    if len(apart) < apart.shape[1]:
        raise ValueError(
            f"one-to-one wants an estimate for each of {apart.shape[1]}; got {len(apart)}"
        )
    rows, columns = linear_sum_assignment(apart)
    return np.asarray(rows[np.argsort(columns)])


def distances(theta: ArrayLike, truth: ArrayLike) -> Float:
    """Return distances (n_found, n_sources), m; very large where an estimate is not finite."""
    apart = np.linalg.norm(real("theta", theta)[:, None] - real("truth", truth), axis=-1)
    return np.where(np.isfinite(apart), np.minimum(apart, GONE), GONE)


@dataclass(frozen=True)
class Scores:
    """How well many runs did.

    Parameters
    ----------
    location_rms : float
        Huber's, of the x and y errors together, m.
    location_bias : float
        Length of Huber's mean of the x and y errors, m.
    amplitude_rms, amplitude_bias : float
        Huber's, dB.
    median, p90 : float
        Of the distances, m.
    lost : float
        Share of distances beyond 20 m.
    """

    location_rms: float
    location_bias: float
    amplitude_rms: float
    amplitude_bias: float
    median: float
    p90: float
    lost: float


def scores(
    theta: ArrayLike,
    truth: ArrayLike,
    u: ArrayLike,
    true_u: ArrayLike,
    how: Assignment = "nearest",
) -> Scores:
    """Summarise the errors of many runs, as the paper's Table 1 does and beyond.

    Parameters
    ----------
    theta, truth : array_like, shape (n_runs, n_sources, 2)
        Estimates and true positions, m.
    u, true_u : array_like, shape (n_runs, n_sources)
        Log amplitudes, Np.
    how : {"nearest", "one-to-one"}
        As in `assign`.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, Table 1.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> truth = rng.uniform(-50, 50, (200, 2, 2))
    >>> found = truth + rng.standard_normal(truth.shape)
    >>> round(scores(found, truth, truth[..., 0], truth[..., 0]).location_rms, 1)
    1.3
    """
    theta, truth = real("theta", theta), real("truth", truth)
    which = np.array([assign(t, s, how) for t, s in zip(theta, truth, strict=True)])
    found = np.take_along_axis(theta, which[..., None], axis=1)
    step = np.clip(np.nan_to_num(found - truth, nan=GONE), -GONE, GONE)
    far = np.hypot(step[..., 0], step[..., 1])
    x, y = huber(step[..., 0]), huber(step[..., 1])
    du = np.take_along_axis(real("u", u), which, axis=1) - real("true_u", true_u)
    level = huber(np.clip(np.nan_to_num(neper_to_db(du), nan=GONE), -GONE, GONE))
    return Scores(
        location_rms=float(np.hypot(x.rms, y.rms)),
        location_bias=float(np.hypot(x.bias, y.bias)),
        amplitude_rms=level.rms,
        amplitude_bias=level.bias,
        median=float(np.median(far)),
        p90=float(np.quantile(far, 0.9)),
        lost=float(np.mean(far > FAR)),
    )
