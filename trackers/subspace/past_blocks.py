"""PAST over the snapshots of a block, compiled by numba where it is installed.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np

from arrivals.trackers.compiler import compiled, compiler_error
from arrivals.trackers.subspace.past_steps import TINY, limited_trace, past_step
from arrivals.typing import Complex

Steps = Callable[[Complex, Complex], None]


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
    >>> past_steps(W, P, np.array([[3.0, 4.0]] * 200), 1.0, 0.0, 1e12)[0].real.round(2).ravel()
    array([0.6, 0.8])
    """
    last_energy = beta * energy + float(np.vdot(Y, Y).real)
    if P.trace().real / beta >= max_trace / max(last_energy, TINY):
        return _limited_steps(W, P, Y, beta, energy, max_trace)
    # the trace of P falls with each snapshot and is not limited; [Wᴴ, P / β], then weights of 1
    n_sensors = len(W)
    WP = np.concatenate([W.conj().T, P / beta], axis=1, dtype=np.complex128)
    padded = np.zeros((len(Y), WP.shape[1]), dtype=np.complex128)
    padded[:, :n_sensors] = Y
    (compiled_steps() or unit_steps)(WP, padded)
    P = WP[:, n_sensors:]
    return WP[:, :n_sensors].conj().T, (P + P.conj().T) / 2, last_energy


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


def unit_steps(WP: Complex, Y: Complex) -> None:
    """Update [Wᴴ, P] by snapshots of weight 1, in place: Table I. numba can compile it.

    Parameters
    ----------
    WP : ndarray of complex, shape (n_sources, n_sensors + n_sources)
        Wᴴ, and beside it P.
    Y : ndarray of complex, shape (n_snapshots, n_sensors + n_sources)
        Snapshots, and zeros beside them.

    Examples
    --------
    >>> WP, Y = np.array([[1.0 + 0j, 0.0, 1.0]]), np.array([[3.0 + 0j, 4.0, 0.0]] * 200)
    >>> unit_steps(WP, Y)
    >>> WP[:, :2].real.round(2)
    array([[0.6, 0.8]])
    """
    n_sensors = WP.shape[1] - WP.shape[0]
    for t in range(len(Y)):  # numba takes rows by index for contiguous
        # z = Wᴴ y,  [(W z)ᴴ, hᴴ] = zᴴ [Wᴴ, P]
        z = WP.dot(Y[t])
        projected = z.conj().dot(WP)
        # g = h / (1 + zᴴh)
        h = projected[n_sensors:].conj()
        g = h / (1.0 + np.vdot(z, h).real)
        # Wᴴ = Wᴴ + g (y - W z)ᴴ,  P = P - g hᴴ
        WP += g.reshape(-1, 1) * (Y[t].conj() - projected)


@cache
def compiled_steps() -> Steps | None:
    """Return `unit_steps` compiled by numba; None if it cannot be used.

    Warns
    -----
    RuntimeWarning
        Once, if numba is installed but cannot be used.
    """
    error = compiler_error()
    if error is None:
        try:
            return compiled(unit_steps)
        except Exception as failure:  # such as of a file system without a place for the cache
            error = str(failure)
    if error:
        warnings.warn(f"numba cannot be used, so PAST runs on arrays: {error}", RuntimeWarning, 2)
    return None
