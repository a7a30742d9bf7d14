"""Posterior of one angle whose log density is a trigonometric polynomial.

ln q(θ) = Re Σ cᵢ exp(jiθ) + const, i = 0..D. Every function here takes the coefficients c (the
constant c₀ is not looked at) and gives the moments Eᵢ = ⟨exp(jiθ)⟩, i = 0..D, and the mean of
exp(jθ) of the one von Mises density that stands for q in the next time step: as a rule E₁.
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
from arrivals.typing import Complex, Float, Int

AnglePosterior = Callable[[Complex], tuple[Complex, complex]]
LARGEST_GRID = 2048  # beyond it, windows about the modes are cheaper
FINEST_GRID = 1 << 18  # points at most where windows do not serve
NATS = 30.0  # what lies further below the top than this does not count


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
    sharpness = float(np.abs(c) @ _squares(len(c)))
    n_points = 2 * math.pi * 1.2 * math.sqrt(1 + sharpness)
    moments = _on_grid(c, n_points) if n_points <= LARGEST_GRID else _in_windows(c)
    return moments, moments[1]


@lru_cache(maxsize=64)
def _squares(n: int) -> Float:
    return np.arange(n, dtype=np.float64) ** 2


def _on_grid(c: Complex, n_points: float) -> Complex:
    """Moments by the trapezoidal rule: an inverse real FFT, an exponential, a real FFT."""
    n_points = 1 << max(8, int(max(n_points, 2 * len(c))).bit_length())
    log_q = np.fft.irfft(c, n_points, norm="forward")  # twice, but for the constant
    log_q -= log_q.max()
    log_q *= 0.5
    F = np.fft.rfft(np.exp(log_q, out=log_q))
    return np.asarray(F[: len(c)].conj() / F[0].real)


def _in_windows(c: Complex) -> Complex:
    """Moments by quadrature about each mode near the top: 37 points at 0.45 std, over 8.1 std.

    Falls back to the whole circle where windows overlap or q has not died away at their edges.
    """
    modes, heights, curvatures = _modes(c)
    near = heights > heights.max() - NATS
    centres, std = modes[near], 1 / np.sqrt(curvatures[near])
    theta = centres[:, None] + 0.45 * std[:, None] * np.arange(-18, 19)
    d = np.exp(1j * theta[..., None] * np.arange(len(c)))
    log_q = (d[..., 1:] @ c[1:]).real
    log_q -= log_q.max()
    gaps = np.diff(centres, append=centres[0] + 2 * np.pi)
    overlap = len(centres) > 1 and (gaps < 8.1 * (std + np.roll(std, -1))).any()
    if overlap or log_q[:, [0, -1]].max() > -22:
        return _on_grid(c, min(2 * math.pi / (0.45 * float(std.min())), FINEST_GRID))
    weight = std[:, None] * np.exp(log_q)
    return np.asarray(np.einsum("wp,wpi->i", weight / weight.sum(), d))


def _modes(c: Complex, within: float = NATS) -> tuple[Float, Float, Float]:
    """Places, heights and curvatures of the maxima near the top, by a grid and Newton's method."""
    i = np.arange(len(c))
    n_points = 1 << int(np.ceil(np.log2(8 * len(c))))
    log_q = np.fft.irfft(c, n_points, norm="forward") / 2
    left, right = np.roll(log_q, 1), np.roll(log_q, -1)
    # a peak between grid points may stand above both by an eighth of their neighbours' drop
    headroom = np.maximum(2 * log_q - left - right, 0)
    top = (log_q >= left) & (log_q > right) & (log_q + headroom >= log_q.max() - within)
    step = 2 * np.pi / n_points
    theta = np.asarray(np.flatnonzero(top) * step, dtype=np.float64)
    start = theta
    for _ in range(4):
        terms = np.exp(1j * np.multiply.outer(theta, i)) * c
        slope, curvature = -terms.imag @ i, terms.real @ i**2
        newton = slope / np.where(curvature > 0, curvature, np.inf)
        theta = np.clip(theta + newton, start - step, start + step)
    terms = np.exp(1j * np.multiply.outer(theta, i)) * c
    curvature = np.maximum(terms.real @ i**2, 1e-9)
    return theta, terms.real[:, 1:].sum(axis=-1), curvature


def top_mode(c: Complex) -> tuple[Complex, complex]:
    """Take the highest mode alone, as one von Mises density of its curvature.

    It starts new components: their density is sharpened by the next sweeps anyway.

    Examples
    --------
    >>> moments, mean = top_mode(np.array([0, 400j]))
    >>> float(np.angle(mean).round(6)), float(abs(mean).round(4))
    (-1.570796, 0.9987)
    """
    if not c[1:].any():
        return np.eye(1, len(c), dtype=np.complex128)[0], 0j
    modes, heights, curvatures = _modes(c, within=0.0)
    best = np.argmax(heights)
    moments = _von_mises(float(modes[best]), float(curvatures[best]), len(c))
    return moments, moments[1]


def _von_mises(mu: float, kappa: float, n: int) -> Complex:
    """Moments of one von Mises density: I_m(κ)/I_0(κ) exp(jmμ)."""
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
    eta, concentration = _factors(c)
    order = np.arange(2, len(c))
    if descending:
        order = order[np.argsort(-concentration[1:], kind="stable")]
    q = eta[:1]
    for m in order:
        angles = (np.angle(eta[m - 1]) + 2 * np.pi * np.arange(m)) / m
        q = np.add.outer(q, concentration[m - 1] * np.exp(1j * angles)).ravel()  # (39)
        q = _largest(q, size)
    kappa, mu = np.abs(q), np.angle(q)
    log_weight = log_i0(kappa)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()  # (42), (44)
    ratios = bessel_ratios(len(c) - 1, kappa)
    moments = np.einsum(
        "d,di->i", weight, ratios * np.exp(1j * np.multiply.outer(mu, np.arange(len(c))))
    )
    centre = np.angle(moments[1])
    off = np.angle(q * np.exp(-1j * centre))  # differences wrapped: (47) as printed breaks at ±π
    mean = weight @ off
    variance = weight @ (1 / np.maximum(kappa, 1e-300) + (off - mean) ** 2)
    return moments, complex(bessel_ratio(1 / variance) * np.exp(1j * centre))


def _largest(q: Complex, size: int) -> Complex:
    size_of = np.abs(q)
    keep = size_of > size_of.max() - NATS
    if keep.sum() > size:
        return np.asarray(q[np.argpartition(-size_of, size)[:size]])
    return np.asarray(q[keep]) if keep.any() else q[:1]


def _factors(c: Complex) -> tuple[Complex, Float]:
    """Parameters ηₘ, m = 1..D, of the wrapped factors, and concentrations κ̃ₘ of their modes."""
    eta = c[1:].conj()
    m = np.arange(1, len(c))
    return eta, mfold_concentration(np.abs(eta), m)


def nearest_modes(c: Complex) -> tuple[Complex, complex]:
    """Follow each mode of the highest factor through the nearest of the others: Heuristic 2."""
    eta, concentration = _factors(c)
    phase = np.angle(eta)
    N = int(np.flatnonzero(concentration)[-1]) + 1 if concentration.any() else 1
    q = concentration[N - 1] * np.exp(1j * (phase[N - 1] + 2 * np.pi * np.arange(N)) / N)
    for m in range(N - 1, 0, -1):
        turns = np.rint((m * np.angle(q) - phase[m - 1]) / (2 * np.pi))
        q = q + concentration[m - 1] * np.exp(1j * (phase[m - 1] + 2 * np.pi * turns) / m)
    best = q[np.argmax(np.abs(q))]
    mu, kappa = float(np.angle(best)), float(np.abs(best))
    i = np.arange(len(c))
    terms = (c * np.exp(1j * i * mu))[1:]
    slope, bend = -terms.imag @ i[1:], -(terms.real @ i[1:] ** 2)
    if bend < 0:
        mu, R = mu - slope / bend, np.exp(1 / (2 * bend))
        kappa = float(inverse_bessel_ratio(R))
    moments = _von_mises(mu, kappa, len(c))
    return moments, moments[1]
