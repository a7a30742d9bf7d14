"""Differences, sums and moments of states some of whose entries are angles."""

from __future__ import annotations

import numpy as np

from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.gaussian.linalg import multiplication, transposed
from arrivals.typing import Float

Angles = tuple[int, ...]


def wrapped(x: Float, angles: Angles) -> Float:
    """Return states (..., n) with their angles in [-π, π).

    Examples
    --------
    >>> wrapped(np.array([4.0, 4.0]), (1,)).round(4)
    array([ 4.    , -2.2832])
    """
    if not angles:
        return x
    x = np.array(x, dtype=np.float64)
    x[..., angles] = wrap(x[..., angles])
    return x


def difference(x1: Float, x2: Float, angles: Angles = ()) -> Float:
    """Return x1 - x2 of states (..., n), angles in [-π, π).

    Examples
    --------
    >>> difference(np.array([3.1, 3.1]), np.array([-3.1, -3.1]), (1,)).round(4)
    array([ 6.2   , -0.0832])
    """
    return wrapped(x1 - x2, angles)


def add(x: Float, step: Float, angles: Angles = ()) -> Float:
    """Return x + step of states (..., n), angles in [-π, π).

    Examples
    --------
    >>> add(np.array([3.0]), np.array([1.0]), (0,)).round(4)
    array([-2.2832])
    """
    return wrapped(x + step, angles)


def mean(points: Float, weights: Float, angles: Angles = ()) -> Float:
    """Return the mean of points (..., m, n), by differences from the first of them.

    Examples
    --------
    >>> mean(np.array([[3.1], [-3.1]]), np.array([0.5, 0.5]), (0,)).round(4)
    array([-3.1416])
    """
    origin = points[..., :1, :]
    steps = difference(points, origin, angles)
    return add(origin[..., 0, :], (weights[..., None, :] @ steps)[..., 0, :], angles)


def circular_mean(points: Float, weights: Float, angles: Angles = ()) -> Float:
    """Return the mean of points (m, n); for angles, the direction of their mean vector.

    Examples
    --------
    >>> circular_mean(np.array([[3.1, 1.0], [-3.1, 3.0]]), np.array([0.5, 0.5]), (0,)).round(4)
    array([-3.1416,  2.    ])
    """
    centre = np.asarray(weights @ points)
    if angles:
        vectors = weights @ np.exp(1j * points[:, angles])
        centre[..., angles] = wrap(np.angle(vectors))
    return centre


def weighted_covariance(steps: Float, weights: Float) -> Float:
    """Return Σ w d dᵀ of differences d (..., m, n) from a mean.

    Examples
    --------
    >>> weighted_covariance(np.array([[1.0], [-1.0]]), np.array([0.5, 0.5]))
    array([[1.]])
    """
    dot = multiplication(steps)
    return dot(transposed(weights[..., :, None] * steps), steps)


def mixture(
    means: Float, covariances: Float, weights: Float, angles: Angles = ()
) -> tuple[Float, Float]:
    """Return means and covariances of Gaussian mixtures of the same m components.

    x = Σ wᵢ xᵢ, P = Σ wᵢ (Pᵢ + (xᵢ-x)(xᵢ-x)ᵀ), by differences from the component of most weight.

    Parameters
    ----------
    means : ndarray, shape (m, n)
    covariances : ndarray, shape (m, n, n)
    weights : ndarray, shape (..., m)
        Weights of each mixture.
    angles : tuple of int
        Entries that are angles.

    Returns
    -------
    means, covariances : ndarray, shapes (..., n), (..., n, n)

    Examples
    --------
    >>> x, P = mixture(np.array([[3.0], [-3.0]]), np.ones((2, 1, 1)), np.array([0.5, 0.5]), (0,))
    >>> x.round(4), P.round(4)
    (array([-3.1416]), array([[1.02]]))
    """
    m, n = means.shape
    heaviest = weights.reshape(-1, m).sum(axis=0).argmax() if angles else 0
    origin = means[heaviest]
    steps = difference(means, origin, angles)
    shift = weights.dot(steps)
    within = weights.dot(covariances.reshape(m, n * n)).reshape(*shift.shape, n)
    between = weighted_covariance(steps - shift[..., None, :], weights)
    return add(origin, shift, angles), within + between
