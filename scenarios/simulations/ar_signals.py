"""Simulation of autoregressive source signals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.motion_models.autoregressive.companion_form import pole_radius, solve_lyapunov
from arrivals.typing import Complex, Float
from arrivals.validation import LARGEST, count, instance, items, one_of, real


def ar_signals(
    coefficients: Sequence[ArrayLike],
    noise: ArrayLike,
    n: int,
    rng: np.random.Generator,
    batch: tuple[int, ...] = (),
    *,
    complex_valued: bool = True,
) -> Complex | Float:
    """Draw stationary signals s(j) = Σ a_i s(j - i) + v(j) of several sources.

    Parameters
    ----------
    coefficients : sequence of array_like
        One list a_1 ... a_p for each source; orders may differ.
    noise : array_like, shape (n_sources,)
        Variances of the innovations v, circular if complex.
    n : int
        Number of time steps.
    rng : numpy.random.Generator
        Source of random numbers.
    batch : tuple of int
        Leading axes of independent draws.
    complex_valued : bool
        Circular complex signals, or real ones.

    Returns
    -------
    ndarray, shape (*batch, n, n_sources)
        Signals.

    Raises
    ------
    ValueError
        If a process is not stationary, or the numbers of sources or the variances do not fit.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> s = ar_signals([[0.772, -0.45], [0.96, -0.77]], [0.571, 0.287], 5000, rng)
    >>> s.shape, (abs(s) ** 2).mean(axis=0).round(1)
    ((5000, 2), array([1., 1.]))
    """
    orders = [np.atleast_1d(real("coefficients", a)) for a in items("coefficients", coefficients)]
    variances = real("noise", noise)
    count("n", n, maximum=10**7)
    if variances.shape != (len(orders),) or not ((variances >= 0) & (variances < LARGEST)).all():
        raise ValueError(
            f"noise must have one variance, not negative, for each of {len(orders)} sources; "
            f"got {shown(noise)}"
        )
    instance("rng", rng, np.random.Generator)
    batch = tuple(count("batch", n, minimum=0) for n in items("batch", batch))
    one_of("complex_valued", complex_valued, (True, False))
    parts = (2, *batch) if complex_valued else batch
    n_parts = 2 if complex_valued else 1
    signals = [
        _real_signal(a, q / n_parts, n, rng, parts) for a, q in zip(orders, variances, strict=True)
    ]
    s = np.stack(signals, axis=-1)
    return np.asarray(s[0] + 1j * s[1]) if complex_valued else s


def stationary_covariance(a: ArrayLike, q: float) -> Float:
    """Return the covariance of [s(j), ..., s(j - p + 1)], (p, p), of a stationary process.

    Raises
    ------
    ValueError
        If the process is not stationary: a root of the companion matrix is not inside the unit
        circle.

    Examples
    --------
    >>> stationary_covariance([0.5], 0.75)
    array([[1.]])
    >>> stationary_covariance([1.0], 1.0)
    Traceback (most recent call last):
    ValueError: roots of coefficients must be inside the unit circle; got modulus 1 of [1.0]
    """
    a = np.atleast_1d(real("coefficients", a))
    p = len(a)
    if a.ndim != 1 or p == 0 or not np.isfinite(a).all():
        raise ValueError(f"coefficients must be finite numbers a_1 ... a_p; got {shown(a)}")
    largest = float(pole_radius(a))
    if largest >= 1:
        raise ValueError(
            "roots of coefficients must be inside the unit circle; got modulus "
            f"{largest:.6g} of {shown(a)}"
        )
    F, Q = np.eye(p, k=-1), np.zeros((p, p))
    F[0], Q[0, 0] = a, q
    return solve_lyapunov(F, Q)


def _real_signal(
    a: Float, q: float, n: int, rng: np.random.Generator, batch: tuple[int, ...]
) -> Float:
    from scipy.linalg import hankel
    from scipy.signal import lfilter

    values, vectors = np.linalg.eigh(stationary_covariance(a, q))
    half = vectors * np.sqrt(np.maximum(values, 0))
    past = rng.standard_normal((*batch, len(a))) @ half.T  # s(-1), s(-2), ...
    v = np.sqrt(q) * rng.standard_normal((*batch, n))
    s, _ = lfilter([1.0], [1.0, *-a], v, axis=-1, zi=past @ hankel(a))
    return np.asarray(s)
