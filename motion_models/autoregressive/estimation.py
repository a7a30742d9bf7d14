"""Autoregressive models of a signal: Yule-Walker, partial autocorrelation, order."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import numbers
from arrivals.typing import Complex, Float
from arrivals.validation import count


def autocovariance(signal: ArrayLike, n_lags: int) -> Float:
    """Return the biased autocovariances c_0 ... c_n of signals without their means.

    Parameters
    ----------
    signal : array_like, shape (..., n_samples)
        Real or complex; of complex ones, the real part of the autocovariance.
    n_lags : int

    Returns
    -------
    ndarray, shape (..., n_lags + 1)

    Raises
    ------
    ValueError
        If a signal has no more samples than lags, is not finite, or is constant.

    Examples
    --------
    >>> autocovariance([1.0, -1.0, 1.0, -1.0], 1)
    array([ 1.  , -0.75])
    """
    x = _signal(signal)
    n = x.shape[-1]
    if n <= count("n_lags", n_lags, minimum=0):
        raise ValueError(f"signal must have more than {n_lags} samples for {n_lags} lags; got {n}")
    x = x - x.mean(axis=-1, keepdims=True)
    products = [(x[..., k:] * x[..., : n - k].conj()).real.sum(axis=-1) for k in range(n_lags + 1)]
    c = np.stack(products, axis=-1) / n
    if not (c[..., 0] > 0).all():
        raise ValueError("signal must vary; got a constant")
    return np.asarray(c)


def yule_walker(signal: ArrayLike, order: int) -> tuple[Float, Float]:
    """Return the AR model with the signal's own autocovariances up to its order.

    Parameters
    ----------
    signal : array_like, shape (..., n_samples)
        Samples, real or complex.
    order : int
        Number of coefficients.

    Returns
    -------
    coefficients : ndarray, shape (..., order)
    noise : ndarray, shape (...)
        Innovation variance.

    Raises
    ------
    ValueError
        If the order is longer than the signal, or the signal constant.

    Notes
    -----
    statsmodels' ``yule_walker(x, p, method="mle")``, which gives the root of `noise`.

    References
    ----------
    Hayes, *Statistical Digital Signal Processing and Modeling*, 1996, sec. 5.2.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> s = np.zeros(5000)
    >>> for j in range(1, 5000):
    ...     s[j] = 0.8 * s[j - 1] + rng.standard_normal()
    >>> a, q = yule_walker(s, 1)
    >>> a.round(2), q.round(2)
    (array([0.8]), np.float64(0.99))
    """
    c = autocovariance(signal, count("order", order))
    return _levinson(c)[-1]


def partial_autocorrelation(signal: ArrayLike, n_lags: int) -> Float:
    """Return the partial autocorrelations κ_1 ... κ_n, by Levinson and Durbin's recursion.

    Parameters
    ----------
    signal : array_like, shape (..., n_samples)
    n_lags : int

    Returns
    -------
    ndarray, shape (..., n_lags)

    Notes
    -----
    statsmodels' ``pacf(x, n, method="ldb")`` from lag 1 on.

    Examples
    --------
    >>> partial_autocorrelation([1.0, -1.0, 1.0, -1.0], 1)
    array([-0.75])
    """
    c = autocovariance(signal, count("n_lags", n_lags))
    return np.stack([a[..., -1] for a, _ in _levinson(c)], axis=-1)


def select_order(signal: ArrayLike, highest: int) -> int:
    """Return the largest lag whose partial autocorrelation is significant; 0 if none is.

    Parameters
    ----------
    signal : array_like, shape (n_samples,)
        Samples, real or complex.
    highest : int
        Largest order to consider.

    Returns
    -------
    int

    Notes
    -----
    |κ| > 1.96 / √n holds for 5 % of the lags of white noise. In whole recordings of speech all
    lags are significant.

    Examples
    --------
    >>> select_order(np.random.default_rng(0).standard_normal(1000), 4)
    0
    """
    x = _signal(signal)
    if x.ndim != 1:
        raise ValueError(f"signal must have shape (n_samples,); got {x.shape}")
    kappa = partial_autocorrelation(x, highest)
    significant = np.flatnonzero(np.abs(kappa) > 1.96 / np.sqrt(len(x)))
    return int(significant[-1]) + 1 if len(significant) else 0


def _levinson(c: Float) -> list[tuple[Float, Float]]:
    """Return coefficients and noise of the orders 1 ... n from autocovariances (..., n + 1)."""
    a, E, steps = c[..., :0], c[..., 0], []
    for k in range(1, c.shape[-1]):
        kappa = (c[..., k] - (a * c[..., k - 1 : 0 : -1]).sum(axis=-1)) / E
        a = np.concatenate([a - kappa[..., None] * a[..., ::-1], kappa[..., None]], axis=-1)
        E = E * (1 - kappa**2)
        steps.append((a, E))
    return steps


def _signal(signal: ArrayLike) -> Float | Complex:
    x = numbers("signal", signal)
    if x.ndim == 0 or not np.isfinite(x).all():
        what = "one number" if x.ndim == 0 else "some that are not"
        raise ValueError(f"signal must hold finite samples, (..., n_samples); got {what}")
    return x
