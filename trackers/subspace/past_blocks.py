"""PAST over the snapshots of a block: by arrays, or compiled by numba where it is installed.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np

from arrivals.trackers.subspace.past_steps import TINY, limited_trace, past_step
from arrivals.trackers.svalse.newton.compiled.compiler import compiled, compiler_error
from arrivals.typing import Complex

Steps = Callable[[Complex, Complex, Complex], None]


def past_steps(
    W: Complex, P: Complex, Y: Complex, beta: float, energy: float, max_trace: float
) -> tuple[Complex, Complex, float]:
    """Return W, P and the energy after successive snapshots of equal weight.

    Parameters
    ----------
    W, P : ndarray
        As in `past_step`, of one bin.
    Y : ndarray, shape (n_snapshots, n_sensors)
        Snapshots without gaps.
    beta : float
        Weight of the data before the first.
    energy : float
        Weighted sum of ‖y‖² before.
    max_trace : float
        Largest trace of P, relative to the energy.

    Examples
    --------
    >>> W, P = np.array([[1.0], [0.0]]), np.eye(1)
    >>> past_steps(W, P, np.array([[3.0, 4.0]] * 200), 1.0, 0.0, 1e12)[0].round(2).ravel()
    array([0.6, 0.8])
    """
    last_energy = beta * energy + float(np.vdot(Y, Y).real)
    if P.trace().real / beta >= max_trace / max(last_energy, TINY):
        return _limited_steps(W, P, Y, beta, energy, max_trace)
    # The trace of P falls with each snapshot and is not limited. P / β, then steps of weight 1
    WH = np.array(W.conj().T, dtype=np.complex128, order="C")
    P = np.array(P / beta, dtype=np.complex128, order="C")
    steps = compiled_steps() or steps_by_arrays
    steps(WH, P, np.asarray(Y, dtype=np.complex128, order="C"))
    return WH.conj().T, (P + P.conj().T) / 2, last_energy


def _limited_steps(
    W: Complex, P: Complex, Y: Complex, beta: float, energy: float, max_trace: float
) -> tuple[Complex, Complex, float]:
    """Return what `past_steps` does, with a limited trace of P after each snapshot."""
    for y, power in zip(Y, (Y.real**2 + Y.imag**2).sum(axis=1).tolist(), strict=True):
        W, P = past_step(W, P, y, beta)
        energy = beta * energy + power
        P = limited_trace(P, max_trace / max(energy, TINY))
        beta = 1.0
    return W, P, energy


def steps_by_arrays(WH: Complex, P: Complex, Y: Complex) -> None:
    """Update Wᴴ and P by snapshots of weight 1, in place: Table I.

    Parameters
    ----------
    WH : ndarray of complex, shape (n_sources, n_sensors)
    P : ndarray of complex, shape (n_sources, n_sources)
    Y : ndarray of complex, shape (n_snapshots, n_sensors)

    Examples
    --------
    >>> WH, P, Y = np.array([[1.0 + 0j, 0.0]]), np.eye(1) + 0j, np.array([[3.0 + 0j, 4.0]] * 200)
    >>> steps_by_arrays(WH, P, Y)
    >>> WH.real.round(2)
    array([[0.6, 0.8]])
    """
    n = Y.shape[1]
    # both updates are one: [Wᴴ, P] + g ([yᴴ, 0] - zᴴ [Wᴴ, P])
    both = np.concatenate([WH, P], axis=1)
    target = np.concatenate([Y.conj(), np.zeros((len(Y), len(P)))], axis=1)
    for y, row in zip(Y, target, strict=True):
        # z = Wᴴ y
        z = both[:, :n].dot(y)
        projected = z.conj().dot(both)
        # hᴴ = zᴴ P
        h = projected[n:].conj()
        # g = h / (1 + zᴴh)
        g = h / (1.0 + np.vdot(z, h).real)
        both += g[:, None] * (row - projected)
    WH[:], P[:] = both[:, :n], both[:, n:]


def steps_by_entries(WH: Complex, P: Complex, Y: Complex) -> None:
    """Update Wᴴ and P as `steps_by_arrays` does, entry by entry: for a compiler.

    Examples
    --------
    >>> WH, P, Y = np.array([[1.0 + 0j, 0.0]]), np.eye(1) + 0j, np.array([[3.0 + 0j, 4.0]] * 200)
    >>> steps_by_entries(WH, P, Y)
    >>> WH.real.round(2)
    array([[0.6, 0.8]])
    """
    n_sources, n_sensors = WH.shape
    z, h = np.empty(n_sources, np.complex128), np.empty(n_sources, np.complex128)
    for y in Y:
        # z = Wᴴ y
        for k in range(n_sources):
            z[k] = 0.0
            for m in range(n_sensors):
                z[k] += WH[k, m] * y[m]
        # h = P z,  divisor = 1 + zᴴh
        divisor = 1.0
        for k in range(n_sources):
            h[k] = 0.0
            for i in range(n_sources):
                h[k] += P[k, i] * z[i]
            divisor += (z[k].conjugate() * h[k]).real
        # Wᴴ = Wᴴ + g (y - W z)ᴴ,  g = h / divisor
        for m in range(n_sensors):
            error = y[m].conjugate()
            for k in range(n_sources):
                error -= z[k].conjugate() * WH[k, m]
            for k in range(n_sources):
                WH[k, m] += h[k] * error / divisor
        # P = P - g hᴴ
        for k in range(n_sources):
            for i in range(n_sources):
                P[k, i] -= h[k] * h[i].conjugate() / divisor


@cache
def compiled_steps() -> Steps | None:
    """Return `steps_by_entries` compiled by numba; None if it cannot be used.

    Warns
    -----
    RuntimeWarning
        Once, if numba is installed but cannot be used.
    """
    error = compiler_error()
    if error is None:
        try:
            return compiled(steps_by_entries)
        except Exception as failure:  # such as of a file system without a place for the cache
            error = str(failure)
    if error:
        warnings.warn(f"numba cannot be used, so PAST runs on arrays: {error}", RuntimeWarning, 2)
    return None
