"""Ratios of modified Bessel functions, and their inverse, for concentrations from 0 to inf.

A(κ) = I₁(κ)/I₀(κ) is the mean resultant length of a von Mises density. All take leading axes.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.typing import Float
from arrivals.validation import count, real

# scipy.special takes longer to import than the package itself, so functions import it when called.

_LARGE = 500.0  # from here on expansions in 1/κ beat the quotient of Bessel functions
_NARROW = 2e-3  # and likewise in 1 - A; κ is 250 there


def log_i0(kappa: ArrayLike) -> Float:
    """Return ln I₀(κ), which stays finite where I₀ overflows.

    Parameters
    ----------
    kappa : array_like, shape (...)
        Concentrations.

    Returns
    -------
    ndarray, shape (...)

    Examples
    --------
    >>> log_i0([0.0, 1e4]).round(4)
    array([   0.    , 9994.4759])
    """
    from scipy.special import i0e

    kappa = np.abs(kappa, dtype=np.float64)
    return np.asarray(np.log(i0e(np.minimum(kappa, 1e300))) + kappa)


def bessel_ratio(kappa: ArrayLike) -> Float:
    """Return the mean resultant length of von Mises densities, A(κ) = I₁(κ)/I₀(κ).

    Parameters
    ----------
    kappa : array_like, shape (...)
        Concentrations.

    Returns
    -------
    ndarray, shape (...)
        Within 1e-15 of A; beyond κ = 500 within the last bit.

    References
    ----------
    Mardia and Jupp, *Directional Statistics*, 2000, sec. 3.5.4.

    Examples
    --------
    >>> bessel_ratio([0.0, 1.0, 1000.0, np.inf]).round(6)
    array([0.     , 0.44639, 0.9995 , 1.     ])
    """
    from scipy.special import i0e, i1e

    kappa = np.asarray(kappa, dtype=np.float64)
    near = np.minimum(kappa, _LARGE)
    ratio = np.asarray(i1e(near) / i0e(near))
    if (kappa > _LARGE).any():
        ratio = np.where(kappa > _LARGE, 1 - _circular_variance(kappa), ratio)
    return ratio


def log_bessel_ratio(kappa: ArrayLike) -> Float:
    """Return ln A(κ) without loss of digits where A is near 1.

    Convolving densities multiplies their A, so this is the scale on which spreads add:
    -2 ln A is the variance of a wrapped normal density with the same first moment.

    Parameters
    ----------
    kappa : array_like, shape (...)
        Concentrations, not negative.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If a concentration is negative.

    Examples
    --------
    >>> log_bessel_ratio([0.0, 1e12])
    array([   -inf, -5.e-13])
    """
    kappa = concentrations(kappa)
    with np.errstate(divide="ignore"):
        log_ratio = np.asarray(np.log(bessel_ratio(np.minimum(kappa, _LARGE))))
    if (kappa > _LARGE).any():
        log_ratio = np.where(kappa > _LARGE, np.log1p(-_circular_variance(kappa)), log_ratio)
    return log_ratio


def inverse_bessel_ratio(ratio: ArrayLike) -> Float:
    """Return the concentration whose mean resultant length is given, κ = A⁻¹(R).

    Parameters
    ----------
    ratio : array_like, shape (...)
        Mean resultant lengths R in [0, 1].

    Returns
    -------
    ndarray, shape (...)
        Concentrations, to 1e-12 relative to the exact inverse of each R; inf where R = 1.

    Raises
    ------
    ValueError
        If an R lies outside [0, 1], or is NaN.

    References
    ----------
    The iteration starts from the approximation of Banerjee, Dhillon, Ghosh and Sra, "Clustering on
    the unit hypersphere using von Mises-Fisher distributions", JMLR 6, 2005.

    Examples
    --------
    >>> inverse_bessel_ratio([0.0, 0.5, 0.999, 1.0]).round(3)
    array([  0.   ,   1.159, 500.25 ,     inf])
    """
    ratio = np.asarray(ratio, dtype=np.float64)
    if not ((ratio >= 0) & (ratio <= 1)).all():
        raise ValueError(f"a mean resultant length must lie in [0, 1]; got {shown(ratio)}")
    return _concentration(ratio, 1 - ratio)


def bessel_ratios(n: int, kappa: ArrayLike) -> Float:
    """Return I_m(κ)/I₀(κ) for m = 0..n, the trigonometric moments of centred densities.

    Backward continued fraction r_m = κ/(2m + κ r_{m+1}) with r_m = I_m/I_{m-1}, then products.

    Parameters
    ----------
    n : int
        Highest order, not negative.
    kappa : array_like, shape (...)
        Concentrations.

    Returns
    -------
    ndarray, shape (..., n + 1)
        To 1e-12 relative.

    References
    ----------
    NIST *Digital Library of Mathematical Functions*, 10.33.1. The fraction starts from an expansion
    for large orders (10.41(ii)) at one where its error does not show, however large κ.

    Examples
    --------
    >>> bessel_ratios(3, [0.0, 10.0]).round(4)
    array([[1.    , 0.    , 0.    , 0.    ],
           [1.    , 0.9486, 0.8103, 0.6245]])
    """
    n = count("n", n, minimum=0)
    kappa = np.minimum(kappa, 1e150, dtype=np.float64)  # its square must not overflow
    square = kappa * kappa
    top = max(n + 8, 24)
    tail = _scaled_ratio(top, kappa)  # κ r_{m+1}
    for m in range(top, n, -1):
        tail = square / (2 * m + tail)
    ratios = np.ones((n + 1, *kappa.shape))
    for m in range(n, 0, -1):
        denominator = 2 * m + tail
        ratios[m] = kappa / denominator
        tail = square / denominator
    return np.moveaxis(np.multiply.accumulate(ratios), 0, -1)


def concentrations(kappa: ArrayLike) -> Float:
    """Return concentrations as floats; a negative one is refused."""
    kappa = real("kappa", kappa)
    if (kappa < 0).any():
        raise ValueError(f"kappa must not be negative; got {shown(kappa)}")
    return kappa


def _circular_variance(kappa: Float) -> Float:
    """Return 1 - A(κ) for κ >= 500 by the expansion in 1/κ of A' = 1 - A² - A/κ."""
    x = 1 / np.maximum(kappa, _LARGE)
    return np.asarray(x * (1 / 2 + x * (1 / 8 + x * (1 / 8 + x * (25 / 128 + x * 13 / 32)))))


def from_log_ratio(log_ratio: Float) -> Float:
    """Return A⁻¹ of a ratio given by its logarithm."""
    return _concentration(np.exp(log_ratio), -np.expm1(log_ratio))


def blurred(kappa: ArrayLike, step: Float, n_steps: float) -> Float:
    """Return κ' of a density after steps of a concentration: A(κ') = A(κ) A(κ_step)^n.

    Examples
    --------
    >>> blurred([0.0, 100.0, np.inf], np.array(100.0), 1.0).round(2)
    array([  0.  ,  50.25, 100.  ])
    """
    of_step = log_bessel_ratio(step) if step.ndim else _log_ratio_of(float(step))
    return from_log_ratio(log_bessel_ratio(kappa) + n_steps * of_step)


@lru_cache(maxsize=64)  # a walk has one step concentration at all times
def _log_ratio_of(kappa: float) -> Float:
    return log_bessel_ratio(kappa)


def _concentration(ratio: Float, variance: Float) -> Float:
    """Return A⁻¹(R), given both R and 1 - R so that neither end loses digits."""
    near = np.minimum(ratio, 1 - _NARROW)
    kappa = np.maximum(near * (2 - near * near) / (1 - near * near), 1e-300)
    for _ in range(2):
        kappa = _halley(kappa, near)
    if (variance < _NARROW).any():
        v = variance  # the expansion of `_circular_variance`, inverted
        series = 1 / 2 + v * (1 / 4 + v * (3 / 8 + v * (15 / 16 + v * (111 / 32 + v * 1095 / 64))))
        with np.errstate(divide="ignore", over="ignore"):
            kappa = np.where(v < _NARROW, series / v, kappa)
    return np.asarray(kappa * (ratio > 0))


def _halley(kappa: Float, ratio: Float) -> Float:
    """Return a root improved to third order of A(κ) = R: Halley, A' = 1 - A² - A/κ."""
    A = bessel_ratio(kappa)
    slope = 1 - A * A - A / kappa
    newton = (A - ratio) / slope
    half_curvature = (A / kappa / slope - 1) / (2 * kappa) - A  # A''/2A'
    return np.asarray(kappa - newton / (1 - newton * half_curvature))


def _scaled_ratio(nu: int, kappa: Float) -> Float:
    """Return κ I_{ν+1}(κ)/I_ν(κ), uniformly in κ for large ν.

    w = κ I_ν'/I_ν = ν + κ I_{ν+1}/I_ν solves κw' + w² = κ² + ν². In powers of 1/s, s² = κ² + ν²,
    with u = κ²/s²: w = s - u/2 + (u/2 - 5u²/8)/s - ...; here s - ν = κ²/(s + ν).
    """
    s = np.hypot(nu, kappa)
    u = (kappa / s) ** 2
    w4 = u * (u * (221 / 16 - u * 1105 / 128) - 47 / 8) + 1 / 2
    w3 = u * (9 / 4 - u * 15 / 8) - 1 / 2
    w2 = 1 / 2 - u * 5 / 8
    return np.asarray(kappa * kappa / (s + nu) + u * (-1 / 2 + (w2 + (w3 + w4 / s) / s) / s))
