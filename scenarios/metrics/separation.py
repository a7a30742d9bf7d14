"""Errors of separated source signals: NMSE and SDR."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import SMALLEST, numbers
from arrivals.typing import Complex, Float
from arrivals.validation import one_of


def nmse(truth: ArrayLike, estimate: ArrayLike, *, db: bool = False) -> Float:
    """Compute the error of each source's signal, normalised by its power.

    Parameters
    ----------
    truth, estimate : array_like, shape (..., n_steps, n_sources)
        True and estimated signals, real or complex, in the same order of sources.
    db : bool
        Return 10 log10 of the error.

    Returns
    -------
    ndarray, shape (..., n_sources)
        Σ|ŝ - s|² / Σ|s|², over the steps: 0 for exact signals, 1 for zeros.

    Raises
    ------
    ValueError
        If shapes differ, a number is not finite, or a true signal is zero throughout.

    Examples
    --------
    >>> nmse([[1.0], [1j]], [[1.1], [1j]])
    array([0.005])
    >>> nmse([[1.0], [1.0]], [[1.1], [0.9]], db=True).round(6)
    array([-20.])
    """
    s, s_hat = _signals(truth, estimate)
    ratio = _energy(s_hat - s) / _energy(s)
    return _decibels(ratio) if one_of("db", db, (False, True)) else ratio


def sdr(truth: ArrayLike, estimate: ArrayLike) -> Float:
    """Compute the signal-to-distortion ratio of each source, dB, invariant to scale and phase.

    Parameters
    ----------
    truth, estimate : array_like, shape (..., n_steps, n_sources)
        True and estimated signals, real or complex, in the same order of sources.

    Returns
    -------
    ndarray, shape (..., n_sources)
        10 log10 of |αs|² / |ŝ - αs|², α = sᴴŝ / sᴴs the best factor; -inf if ŝ is orthogonal to s,
        inf if it is proportional to s.

    Raises
    ------
    ValueError
        As in `nmse`.

    References
    ----------
    Le Roux, Wisdom, Erdogan and Hershey, "SDR - half-baked or well done?", ICASSP 2019, (3).

    Examples
    --------
    >>> sdr([[1.0], [1.0]], [[3.3j], [2.7j]]).round(6)
    array([20.])
    """
    s, s_hat = _signals(truth, estimate)
    alpha = (s.conj() * s_hat).sum(axis=-2, keepdims=True) / _energy(s)[..., None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = _energy(alpha * s) / _energy(s_hat - alpha * s)
    return _decibels(np.where(np.isnan(ratio), 0.0, ratio))  # 0/0: the estimate is zero


def _signals(truth: ArrayLike, estimate: ArrayLike) -> tuple[Complex | Float, Complex | Float]:
    s, s_hat = numbers("truth", truth), numbers("estimate", estimate)
    if s.shape != s_hat.shape or s.ndim < 2:
        raise ValueError(
            "truth and estimate must have the same shape (..., n_steps, n_sources); "
            f"got {s.shape} and {s_hat.shape}"
        )
    for name, signals in (("truth", s), ("estimate", s_hat)):
        if not np.isfinite(signals).all():
            raise ValueError(f"{name} must be finite; got NaN or infinity: leave out empty steps")
    if not (_energy(s) > SMALLEST).all():
        raise ValueError("truth must be nonzero for every source; got a signal of zeros")
    return s, s_hat


def _energy(s: Complex | Float) -> Float:
    return np.asarray((s.real**2 + s.imag**2).sum(axis=-2))


def _decibels(ratio: Float) -> Float:
    with np.errstate(divide="ignore"):
        return np.asarray(10 * np.log10(ratio))
