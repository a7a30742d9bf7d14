"""Probabilities of detection and false alarm of one sensor and of a sensor network."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.typing import Float
from arrivals.validation import LARGEST, real


def exact_detection(false_alarm: ArrayLike, n_snapshots: ArrayLike, snr: ArrayLike) -> Float:
    """Return the exact probability of detection of one sensor.

    N e²/σ² is a Gamma variable of shape N: P_D = Q_Γ(N, Q_Γ⁻¹(N, P_FA) / (1 + SNR)), with the
    regularised upper incomplete gamma function. Set thresholds by this one.

    Parameters
    ----------
    false_alarm : array_like
        Probability of false alarm, P_FA.
    n_snapshots : array_like
        Number of snapshots, N.
    snr : array_like
        Power of the sources over that of the noise, at the sensor.

    Returns
    -------
    ndarray
        P_D, of the broadcast shape of the arguments.

    References
    ----------
    Kay, *Fundamentals of Statistical Signal Processing II: Detection Theory*, 1998, sec. 5.3.

    Examples
    --------
    >>> float(exact_detection(0.01, 50, 10 ** (-3 / 10)).round(3))
    0.742
    """
    from scipy.special import gammaincc, gammainccinv

    false_alarm, n_snapshots, snr = _arguments(false_alarm, n_snapshots, snr)
    return np.asarray(gammaincc(n_snapshots, gammainccinv(n_snapshots, false_alarm) / (1 + snr)))


def log_gaussian_detection(false_alarm: ArrayLike, n_snapshots: ArrayLike, snr: ArrayLike) -> Float:
    """Return P_D with ξ Gaussian: P_D = Q(Q⁻¹(P_FA) - √N ln(1 + SNR)); inaccurate in the tails.

    Parameters are those of `exact_detection`.

    Examples
    --------
    >>> float(log_gaussian_detection(0.01, 50, 10 ** (-3 / 10)).round(3))
    0.708
    """
    from scipy.special import ndtr, ndtri

    false_alarm, n_snapshots, snr = _arguments(false_alarm, n_snapshots, snr)
    shift = np.sqrt(n_snapshots) * np.log1p(snr)
    return np.asarray(ndtr(shift + ndtri(false_alarm)))


def amplitude_gaussian_detection(
    false_alarm: ArrayLike, n_snapshots: ArrayLike, snr: ArrayLike
) -> Float:
    """Return P_D with e Gaussian: γ = 1 + Q⁻¹(P_FA)/2√N, P_D = Q(2√N (γ/√(1+SNR) - 1)).

    Parameters are those of `exact_detection`.

    Examples
    --------
    >>> float(amplitude_gaussian_detection(0.01, 50, 10 ** (-3 / 10)).round(3))
    0.758
    """
    from scipy.special import ndtr, ndtri

    false_alarm, n_snapshots, snr = _arguments(false_alarm, n_snapshots, snr)
    root = 2 * np.sqrt(n_snapshots)
    threshold = 1 - ndtri(false_alarm) / root
    return np.asarray(ndtr(-root * (threshold / np.sqrt(1 + snr) - 1)))


def true_false_alarm(false_alarm: ArrayLike, n_snapshots: ArrayLike) -> tuple[Float, Float]:
    """Return the exact false-alarm probabilities of the two Gaussian thresholds.

    Returns
    -------
    log, amplitude : ndarray
        Of the thresholds on ξ and on e.

    Examples
    --------
    >>> [round(float(p), 4) for p in true_false_alarm(0.01, 50)]
    [0.0061, 0.0103]
    """
    from scipy.special import gammaincc, ndtri

    false_alarm, N, _ = _arguments(false_alarm, n_snapshots, 0.0)
    margin = -ndtri(false_alarm) / (2 * np.sqrt(N))
    log = gammaincc(N, N * np.exp(2 * margin))
    return np.asarray(log), np.asarray(gammaincc(N, N * (1 + margin) ** 2))


def network_detection(false_alarm: ArrayLike, weights: ArrayLike, snr: ArrayLike) -> Float:
    """Return the probability of detection of known sources by a sensor network.

    P_D ≈ Q(Q⁻¹(P_FA) - δ), δ² = Σ W (½ ln(1 + SNR))².

    Parameters
    ----------
    false_alarm : array_like
        Probability of false alarm, P_FA.
    weights : array_like, shape (..., n_sensors)
        W = 1/r of each sensor, r the variance of its reading.
    snr : array_like, shape (..., n_sensors)
        Power of the sources over that of the noise, at each sensor.

    Returns
    -------
    ndarray, shape (...)
        P_D.

    Examples
    --------
    >>> float(network_detection(0.01, np.full(100, 200.0), 10 ** (-13 / 10)).round(2))
    0.87
    """
    from scipy.special import ndtr, ndtri

    weights, snr = np.atleast_1d(real("weights", weights)), real("snr", snr)
    _, weights, snr = _arguments(0.5, weights, snr, "weights", 0.0)
    delta = np.sqrt((weights * (0.5 * np.log1p(snr)) ** 2).sum(axis=-1))
    false_alarm, _, _ = _arguments(false_alarm, 1.0, delta)
    return np.asarray(ndtr(delta + ndtri(false_alarm)))


def _arguments(
    false_alarm: ArrayLike,
    n: ArrayLike,
    snr: ArrayLike,
    name: str = "n_snapshots",
    least: float = 1.0,
) -> tuple[Float, Float, Float]:
    """Return the arguments as arrays, checked."""
    arrays = real("false_alarm", false_alarm), real(name, n), real("snr", snr)
    alarm, numbers, ratio = arrays
    if not ((alarm > 0) & (alarm < 1)).all():
        raise ValueError(f"false_alarm must lie in (0, 1); got {shown(alarm)}")
    if not ((numbers >= least) & (numbers < LARGEST)).all():
        raise ValueError(f"{name} must be finite and at least {least:g}; got {shown(numbers)}")
    if not ((ratio >= 0) & (ratio < LARGEST)).all():
        raise ValueError(f"snr must be finite and not negative; got {shown(ratio)}")
    try:
        np.broadcast(*arrays)
    except (ValueError, RuntimeError):
        shapes = f"{alarm.shape}, {numbers.shape} and {ratio.shape}"
        names = f"false_alarm, {name}, snr"
        raise ValueError(f"{names} must have shapes that fit; got {shapes}") from None
    return arrays
