"""Steps of PAST and, for incomplete snapshots, PETRELS: recursive least squares for a subspace.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995, and of Chi, Eldar and Calderbank, "PETRELS: parallel subspace
estimation and tracking by recursive least squares from partial observations", IEEE Trans. Signal
Process. 61(23), 2013.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.linalg import lapack
from arrivals.typing import Bool, Complex, Float

TINY = 1e-290  # an energy above zero
MIN_RELATIVE_EIGENVALUE = 1e-6  # below, eigenvectors by a Gram matrix lose digits
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
    if not isinstance(beta, float):
        beta = np.asarray(beta)[..., None, None]
    product: Any = np.dot if W.ndim == 2 else np.matmul  # a third of the time on a small matrix
    y = y[..., None]
    # zᴴ = yᴴ W
    zH = product(y.conj().swapaxes(-1, -2), W)
    z = zH.conj().swapaxes(-1, -2)
    # hᴴ = zᴴ P
    hH = product(zH, P)
    # g = h / (β + zᴴh)
    gH = hH / (beta + product(hH, z).real)
    # P = Tri{P - h gᴴ} / β; the Hermitian part, since rounding would grow as β⁻ⁿ
    P = (P - hH.conj().swapaxes(-1, -2) * gH) * (0.5 / beta)
    P = P + P.conj().swapaxes(-1, -2)
    # W = W + (y - W z) gᴴ
    return W + (y - product(W, z)) * gH, P


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
    trace = P.trace(axis1=-2, axis2=-1).real
    if np.all(trace < limit) if P.ndim > 2 else trace < limit:
        return P
    return np.asarray(P * np.minimum(1.0, limit / trace)[..., None, None])


def with_dimensions(W: Complex, P: Complex, n: int) -> tuple[Complex, Complex]:
    """Return W and P of n dimensions, zero in those added.

    Examples
    --------
    >>> [each.shape for each in with_dimensions(np.ones((5, 1)), np.ones((1, 1)), 2)]
    [(5, 2), (2, 2)]
    """
    if W.shape[-1] == n:
        return W, P
    axes, added = [(0, 0)] * (W.ndim - 2), (0, n - W.shape[-1])
    return np.pad(W, [*axes, (0, 0), added]), np.pad(P, [*axes, added, added])


def subspace_eigenvectors(W: Complex, P: Complex, *, complete: bool) -> tuple[Float, Complex]:
    """Return eigenvalues, falling, and eigenvectors of W P⁻¹Wᴴ.

    Parameters
    ----------
    W, P : ndarray
        As in `past_step`.
    complete : bool
        True to append a basis of the complement to the eigenvectors.

    Returns
    -------
    values : ndarray, shape (..., L)
        Those of the subspace, L the smaller of its dimension and the number of sensors.
    vectors : ndarray, shape (..., n_sensors, L or n_sensors)

    Examples
    --------
    >>> W = np.array([[0.6], [0.8]])
    >>> values, vectors = subspace_eigenvectors(W, np.array([[0.25]]), complete=True)
    >>> values.round(6), vectors.shape
    (array([4.]), (2, 2))
    """
    if W.ndim == 2 and not complete:
        values, vectors = _eigenvectors_by_gram(W, P)
        if len(values) and values[-1] > MIN_RELATIVE_EIGENVALUE * values[0]:
            return values, vectors
    L = min(W.shape[-2:])
    Q, R = np.linalg.qr(W, mode="complete" if complete else "reduced")
    R = R[..., :L, :]
    RH = R.conj().swapaxes(-1, -2)
    try:
        S = R @ np.linalg.solve(P, RH)
    except np.linalg.LinAlgError:  # a leap of the level by many orders: P has lost its rank
        S = R @ np.linalg.pinv(P, hermitian=True) @ RH
    values, rotation = np.linalg.eigh((S + S.conj().swapaxes(-1, -2)) / 2)
    inside = Q[..., :L] @ rotation[..., ::-1]
    vectors = np.concatenate([inside, Q[..., L:]], axis=-1) if complete else inside
    return values[..., ::-1], vectors


def _eigenvectors_by_gram(W: Complex, P: Complex) -> tuple[Float, Complex]:
    """Return what `subspace_eigenvectors` does, in a third of the time; nothing if it fails.

    Eigenvectors of W P⁻¹Wᴴ are W a, where WᴴW a = λ P a and aᴴP a = 1.
    """
    values, a, failed = lapack().zhegvd(W.conj().T.dot(W), P)
    if failed or not values[0] > 0:
        return np.zeros(0), W[:, :0]
    return values[::-1], (W.dot(a) / np.sqrt(values))[:, ::-1]
