"""Posterior of one angle whose log density is a trigonometric polynomial.

ln q(θ) = Re Σ cᵢ exp(jiθ) + const, i = 0..D. Every posterior here takes the coefficients c, of
which the constant c₀ has no effect, and returns the moments Eᵢ = ⟨exp(jiθ)⟩, i = 0..D, and the
mean of exp(jθ) of the one von Mises density that replaces q in the next time step: as a rule E₁.
Equation numbers are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from arrivals.motion_models.bessel import (
    bessel_ratio,
    bessel_ratios,
    inverse_bessel_ratio,
    log_i0,
)
from arrivals.motion_models.von_mises import mfold_concentration
from arrivals.trackers.svalse.coordinate.windowed_quadrature import (
    MAX_LOG_DROP,
    find_modes,
    integrate_windows,
    mode_grid_size,
)
from arrivals.typing import Complex, Float, Int

AnglePosterior = Callable[[Complex], tuple[Complex, complex]]
MAX_PLAIN_GRID = 2048  # points; beyond them windows about the modes are cheaper
MAX_GRID = 1 << 18  # points at most where windows fail
MIN_CURVATURE = 1e-9  # of the logarithm of a density at its mode


def fold(eta: Complex, harmonics: Int, degree: int) -> Complex:
    """Return the one-sided coefficients of Re(ηᴴ a(θ)), a_k = exp(jkθ), k in `harmonics`.

    Re(η*ₖ exp(jkθ)) of a negative k is that of ηₖ exp(j|k|θ).

    Examples
    --------
    >>> fold(np.array([1j, 5, 2]), np.array([-1, 0, 1]), 1)
    array([5.-0.j, 2.+1.j])
    """
    two_sided = np.zeros(2 * degree + 1, dtype=np.complex128)
    two_sided[harmonics] = eta.conj()  # negative k from the end
    c = two_sided[: degree + 1]
    c[1:] += two_sided[:degree:-1].conj()
    return c


def unfold(moments: Complex, harmonics: Int) -> Complex:
    """Return ⟨exp(jkθ)⟩ for k in `harmonics`, of either sign, from those of 0, 1, 2...

    Examples
    --------
    >>> unfold(np.array([1, 0.5j]), np.array([-1, 0, 1]))
    array([0.-0.5j, 1.+0.j , 0.+0.5j])
    """
    two_sided = np.concatenate([moments, moments[:0:-1].conj()])  # negative k from the end
    return np.asarray(two_sided[harmonics])


def quadrature(c: Complex) -> tuple[Complex, complex]:
    """Integrate directly: the trapezoidal rule on the circle is spectrally accurate (sec. 4.3).

    Examples
    --------
    >>> moments, mean = quadrature(np.array([0, 4.0]))
    >>> float(moments[1].real.round(6)), complex(mean).real.__round__(6)  # I1(4)/I0(4)
    (0.863523, 0.863523)
    """
    n_points = grid_size(float(np.abs(c) @ squares(len(c))))
    if n_points > MAX_PLAIN_GRID and (moments := window_moments(c)) is not None:
        return moments, moments[1]
    moments = grid_moments(c, n_points)
    return moments, moments[1]


def grid_size(sharpness: float) -> float:
    """Return how many points resolve a density of at most this curvature of its logarithm."""
    return min(2 * math.pi * 1.2 * math.sqrt(1 + sharpness), MAX_GRID)


@lru_cache(maxsize=64)
def squares(n: int) -> Float:
    """Return 0, 1, 4, ..., (n - 1)²."""
    return np.arange(n, dtype=np.float64) ** 2


def grid_moments(c: Complex, n_points: float) -> Complex:
    """Return moments by the trapezoidal rule on n_points or more: an inverse FFT, exp, an FFT."""
    log_q = log_density(c, 1 << max(8, int(max(n_points, 2 * len(c))).bit_length()))
    log_q -= log_q.max()
    F = np.fft.rfft(np.exp(log_q, out=log_q))
    return np.asarray(F[: len(c)].conj() / F[0].real)


def log_density(c: Complex, n_points: int) -> Float:
    """Return Re Σ cᵢ exp(jiθ), up to a constant, at 2π i / n_points."""
    log_q = np.fft.irfft(c, n_points, norm="forward")  # twice, except for the constant
    log_q *= 0.5
    return log_q


def window_moments(c: Complex) -> Complex | None:
    """Return moments by quadrature about each mode near the top; None where that fails."""
    log_q = log_density(c, mode_grid_size(len(c)))
    windows = integrate_windows(c[None], log_q[None], len(c))
    return None if windows is None else np.einsum("wp,wpi->i", windows.weight, windows.powers)


def top_mode(c: Complex) -> tuple[Complex, complex]:
    """Return the highest mode as one von Mises density of its curvature.

    It initializes new components, whose density the next iterations sharpen anyway.

    Examples
    --------
    >>> moments, mean = top_mode(np.array([0, 400j]))
    >>> float(np.angle(mean).round(6)), float(abs(mean).round(4))
    (-1.570796, 0.9987)
    """
    if not c[1:].any():
        return np.eye(1, len(c), dtype=np.complex128)[0], 0j
    modes = find_modes(c[None], log_density(c, mode_grid_size(len(c)))[None], within=0.0)
    best = np.argmax(modes.height)
    kappa = max(float(modes.curvature[best]), MIN_CURVATURE)
    moments = von_mises_moments(float(modes.theta[best]), kappa, len(c))
    return moments, moments[1]


def von_mises_moments(mu: float, kappa: float, n: int) -> Complex:
    """Return the n moments of one von Mises density: I_m(κ)/I_0(κ) exp(jmμ)."""
    return np.asarray(bessel_ratios(n - 1, kappa) * np.exp(1j * mu * np.arange(n)))


def mixture(c: Complex, *, descending: bool = False, size: int = 1000) -> tuple[Complex, complex]:
    """Multiply the factors as mixtures of von Mises densities: Heuristic 1, (38)-(48).

    Parameters
    ----------
    c : ndarray, shape (D + 1,)
    descending : bool
        Take the factors by falling concentration, as VALSE does, instead of by rising index.
    size : int
        Components kept at each stage.
    """
    eta, concentration = factors(c)
    order = np.arange(2, len(c))
    if descending:
        order = order[np.argsort(-concentration[1:], kind="stable")]
    q = eta[:1]
    for m in order:
        # (38), (40)
        angles = (np.angle(eta[m - 1]) + 2 * np.pi * np.arange(m)) / m
        # (39)
        q = np.add.outer(q, concentration[m - 1] * np.exp(1j * angles)).ravel()
        q = largest(q, size)
    kappa, mu = np.abs(q), np.angle(q)
    # (42), (44)
    log_weight = log_i0(kappa)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    # â = Σ c_d I_m(κ_d)/I_0(κ_d) exp(jmμ_d)
    i = np.arange(len(c))
    powers = bessel_ratios(len(c) - 1, kappa) * np.exp(1j * np.multiply.outer(mu, i))
    moments = np.einsum("d,di->i", weight, powers)
    # (46)-(48), differences wrapped: (47) as printed fails at ±π
    centre = np.angle(moments[1])
    offset = np.angle(q * np.exp(-1j * centre))
    mean = weight @ offset
    variance = weight @ (1 / np.maximum(kappa, 1e-300) + (offset - mean) ** 2)
    return moments, complex(bessel_ratio(1 / variance) * np.exp(1j * centre))


def largest(q: Complex, size: int) -> Complex:
    """Return the `size` largest of the parameters q, without those 30 below the largest."""
    kappa = np.abs(q)
    keep = kappa > kappa.max() - MAX_LOG_DROP
    if keep.sum() > size:
        return np.asarray(q[np.argpartition(-kappa, size)[:size]])
    return np.asarray(q[keep]) if keep.any() else q[:1]


def factors(c: Complex) -> tuple[Complex, Float]:
    """Return ηₘ, m = 1..D, of the wrapped factors, and concentrations κ̃ₘ of their modes (40)."""
    eta = c[1:].conj()
    m = np.arange(1, len(c))
    return eta, mfold_concentration(np.abs(eta), m)


def nearest_modes(c: Complex) -> tuple[Complex, complex]:
    """Add to each mode of the highest factor the nearest of every other factor: Heuristic 2."""
    eta, concentration = factors(c)
    phase = np.angle(eta)
    N = int(np.flatnonzero(concentration)[-1]) + 1 if concentration.any() else 1
    q = concentration[N - 1] * np.exp(1j * (phase[N - 1] + 2 * np.pi * np.arange(N)) / N)
    for m in range(N - 1, 0, -1):
        turns = np.rint((m * np.angle(q) - phase[m - 1]) / (2 * np.pi))
        q = q + concentration[m - 1] * np.exp(1j * (phase[m - 1] + 2 * np.pi * turns) / m)
    best = q[np.argmax(np.abs(q))]
    mu, kappa = float(np.angle(best)), float(np.abs(best))
    # one Newton step on g(θ) = Re(ηᴴ a(θ))
    i = np.arange(len(c))
    terms = (c * np.exp(1j * i * mu))[1:]
    slope, bend = -terms.imag @ i[1:], -(terms.real @ i[1:] ** 2)
    if bend < 0:
        mu, R = mu - slope / bend, np.exp(1 / (2 * bend))
        kappa = float(inverse_bessel_ratio(R))
    moments = von_mises_moments(mu, kappa, len(c))
    return moments, moments[1]
