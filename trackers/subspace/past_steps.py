"""Steps of PAST and, for incomplete snapshots, PETRELS: recursive least squares for a subspace.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995, and of Chi, Eldar and Calderbank, "PETRELS: parallel subspace
estimation and tracking by recursive least squares from partial observations", IEEE Trans. Signal
Process. 61(23), 2013.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Bool, Complex

MAX_TRACE_RATIO = 1e12  # of the matrix of a sensor without data, relative to the common one


def past_step(W: Complex, P: Complex, y: Complex, beta: ArrayLike) -> tuple[Complex, Complex]:
    """Return W and P after one snapshot: algorithm PAST, Table I.

    Parameters
    ----------
    W : ndarray, shape (..., n_sensors, n_sources)
        Basis of the signal subspace, nearly orthonormal.
    P : ndarray, shape (..., n_sources, n_sources)
        Inverse of the weighted sum of z zᴴ, z = Wᴴy.
    y : ndarray, shape (..., n_sensors)
        Snapshot.
    beta : float or array_like, shape (...)
        Weight of the past.

    Returns
    -------
    W : ndarray, shape (..., n_sensors, n_sources)
        Updated basis.
    P : ndarray, shape (..., n_sources, n_sources)
        Updated inverse.

    References
    ----------
    Yang, table I.

    Examples
    --------
    >>> W, P = np.array([[1.0], [0.0]]), np.eye(1)
    >>> for _ in range(20):
    ...     W, P = past_step(W, P, np.array([3.0, 4.0]), 0.9)
    >>> W.round(3).ravel()
    array([0.6, 0.8])
    """
    beta = np.asarray(beta)[..., None, None]
    y = y[..., None]
    # z = Wᴴ y
    z = W.conj().swapaxes(-1, -2) @ y
    # h = P z
    h = P @ z
    hH = h.conj().swapaxes(-1, -2)
    # g = h / (β + zᴴh)
    gH = hH / (beta + (hH @ z).real)
    # P = Tri{P - g hᴴ} / β; the Hermitian part, since rounding would grow as β⁻ⁿ
    P = (P - h * gH) / (2 * beta)
    P = P + P.conj().swapaxes(-1, -2)
    # W = W + (y - W z) gᴴ
    return W + (y - W @ z) * gH, P


@dataclass(frozen=True, eq=False)
class SensorInverses:
    """The matrix P of each sensor, (..., n_sensors, K, K): of z zᴴ while it had data."""

    P: Complex

    def restarted(self, sensors: Bool, variance: ArrayLike) -> SensorInverses:
        """Return matrices of which those of some sensors are multiples of the identity."""
        initial = np.asarray(variance)[..., None, None, None] * np.eye(self.P.shape[-1])
        return SensorInverses(np.where(sensors[:, None, None], initial, self.P))

    def extended(self, n_sources: int, variance: ArrayLike) -> SensorInverses:
        """Return matrices of more dimensions, those added with a variance and uncorrelated."""
        old = self.P.shape[-1]
        P = np.zeros((*self.P.shape[:-2], n_sources, n_sources), dtype=np.complex128)
        P[..., :old, :old] = self.P
        added = np.arange(old, n_sources)
        P[..., added, added] = np.asarray(variance)[..., None, None]
        return SensorInverses(P)


def incomplete_step(
    W: Complex,
    P: Complex,
    rows: SensorInverses,
    y: Complex,
    valid: Bool,
    beta: ArrayLike,
    noise: ArrayLike,
) -> tuple[Complex, Complex, SensorInverses, Complex]:
    """Return W, P and the sensors' P after a snapshot with missing sensors, and z.

    Parameters
    ----------
    W : ndarray, shape (..., n_sensors, n_sources)
        Basis of the signal subspace.
    P : ndarray, shape (..., n_sources, n_sources)
        Inverse of the weighted sum of z zᴴ.
    rows : SensorInverses
        The same for each sensor, over the snapshots in which it had data.
    y : ndarray, shape (..., n_sensors)
        Snapshot.
    valid : ndarray of bool, shape (n_sensors,)
        Sensors with data.
    beta : float or array_like, shape (...)
        Weight of the past.
    noise : float or array_like, shape (...)
        Weighted sum of the noise power of a sensor.

    Returns
    -------
    tuple of ndarray, ndarray, SensorInverses, ndarray
        W, P, P of the sensors, and the coordinates z of the snapshot.

    Examples
    --------
    >>> W, P, rows = np.array([[1.0], [0.0]]), np.eye(1), SensorInverses(np.ones((2, 1, 1)))
    >>> for valid in ([True, True], [True, False], [False, True]) * 10:
    ...     y = np.where(valid, [3.0, 4.0], 0.0)
    ...     W, P, rows, z = incomplete_step(W, P, rows, y, np.array(valid), 0.9, 1e-3)
    >>> (W[1] / W[0]).real.round(1)
    array([1.3])
    """
    beta, noise = np.asarray(beta)[..., None, None], np.asarray(noise)[..., None, None]
    W_o = W[..., valid, :]
    W_oH = W_o.conj().swapaxes(-1, -2)
    # z = (W_oᴴ W_o)⁻¹ W_oᴴ y_o   (6), the least squares weighed against the power of z
    z = np.linalg.solve(W_oH @ W_o + noise * P, W_oH @ y[..., valid, None])
    h = P @ z
    hH = h.conj().swapaxes(-1, -2)
    new_P = (P - h * hH / (beta + (hH @ z).real)) / beta
    # the same for the row of each sensor with data   (10)-(12)
    R = rows.P
    H = (R @ z[..., None, :, :])[..., 0]  # (..., n_sensors, n_sources)
    gain = H.conj() / (beta + (H.conj() @ z).real)
    updated = R - H[..., None] * gain[..., None, :]
    updated = np.where(valid[:, None, None], updated, R) / beta[..., None]
    W = W + np.where(valid[:, None], y[..., None] - W @ z, 0) * gain
    limit = MAX_TRACE_RATIO * np.trace(new_P, axis1=-2, axis2=-1).real
    of_sensors = np.asarray(updated + updated.conj().swapaxes(-1, -2), dtype=np.complex128) / 2
    new_P = np.asarray((new_P + new_P.conj().swapaxes(-1, -2)) / 2, dtype=np.complex128)
    rows = SensorInverses(limited_trace(of_sensors, limit[..., None]))
    return W, new_P, rows, np.asarray(z[..., 0], np.complex128)


def limited_trace(P: Complex, limit: ArrayLike) -> Complex:
    """Return matrices (..., n, n), scaled down where their trace is above a limit.

    Examples
    --------
    >>> limited_trace(np.diag([3.0, 1.0 + 0j]), 2.0).real
    array([[1.5, 0. ],
           [0. , 0.5]])
    """
    trace = np.trace(P, axis1=-2, axis2=-1).real
    if (trace < limit).all():
        return P
    return np.asarray(P * np.minimum(1.0, limit / trace)[..., None, None])
