"""Likelihoods of complex snapshots, and complex vectors as real ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel, SelectedEntries, locate
from arrivals.measurements import numbers
from arrivals.typing import Bool, Complex, Float


def composite(z: ArrayLike) -> Float:
    """Return complex vectors (..., n) as real ones (..., 2n): [Re; Im].

    Parameters
    ----------
    z : array_like of complex, shape (..., n)
        Snapshots, say.

    Returns
    -------
    ndarray, shape (..., 2n)

    Examples
    --------
    >>> composite([1 + 2j, 3 - 4j])
    array([ 1.,  3.,  2., -4.])
    """
    z = np.atleast_1d(numbers("z", z))
    return np.concatenate([z.real, z.imag], axis=-1)


def from_composite(z: ArrayLike, shape: tuple[int, ...]) -> Complex | Float:
    """Return a measurement of this shape, made complex again if it is composite.

    Examples
    --------
    >>> from_composite([1.0, 3.0, 2.0, -4.0], (2,))
    array([1.+2.j, 3.-4.j])
    """
    z, n = numbers("z", z), int(np.prod(shape))
    if z.shape == shape or z.shape != (2 * n,) or np.iscomplexobj(z):
        return z
    return np.asarray(z[:n] + 1j * z[n:]).reshape(shape)


def log_known(
    z: Complex, expected: Complex, noise: float, whitening: Complex | None = None
) -> Float:
    """Return ln CN(z; expected, noise Γ) of one measurement at expected ones (..., *z.shape).

    Entries that are NaN in z are left out. `whitening` is as in `log_marginal`.

    Examples
    --------
    >>> log_known(np.array([1j, np.nan]), np.zeros((3, 2), dtype=complex), noise=1.0).round(4)
    array([-2.1447, -2.1447, -2.1447])
    """
    there = ~np.isnan(z)
    e, log_det = z - expected, 0.0
    if whitening is not None:
        F, M = len(whitening), z.shape[-1]
        rows = np.where(there, e, 0).reshape(*e.shape[: e.ndim - z.ndim], F, -1, M, 1)
        e = (whitening @ rows).reshape(e.shape)
        log_det = float(_log_det(whitening, there.reshape(F, -1, M)).sum())
    e = e[..., there]
    energy = (e.real**2 + e.imag**2).sum(axis=-1)
    return np.asarray(log_det - there.sum() * np.log(np.pi * noise) - energy / noise)


def log_marginal(
    Y: Complex, a: Complex, noise: float, power: float, whitening: Complex | None = None
) -> Float:
    """Return ln p(Y) of sources of unknown amplitudes w ~ CN(0, power), averaged over responses.

    y ~ CN(0, power Σ a aᴴ + noise Γ) for every bin and snapshot, entries that are NaN left out.

    Parameters
    ----------
    Y : ndarray of complex, shape (n_bins, n_sensors, n_snapshots)
        One measurement.
    a : ndarray of complex, shape (n_nuisance, n_bins, n_sensors, ..., n_sources)
        Responses to the directions, for each equally probable value of a second parameter.
    noise, power : float
        Variances of the noise of one sensor and of the amplitudes.
    whitening : ndarray of complex, shape (n_bins, n_snapshots or 1, n_sensors, n_sensors), optional
        L, L Γ Lᴴ = I, of the sensors with data, zero for the others; Γ = I if None.

    Returns
    -------
    ndarray, shape (...)

    Examples
    --------
    >>> log_marginal(np.ones((1, 2, 1)), np.ones((1, 1, 2, 3, 1)), noise=0.5, power=2.0).round(4)
    array([-3.5448, -3.5448, -3.5448])
    """
    n_dims = a.ndim - 4  # of the leading axes of the directions
    A = np.moveaxis(a, 2, -1)[:, :, None]  # (n_nuisance, n_bins, 1, ..., n_sources, n_sensors)
    y = np.moveaxis(Y, 1, 2).reshape(Y.shape[0], Y.shape[2], *[1] * n_dims, Y.shape[1])
    log_det: Float | float = 0.0
    if whitening is not None:
        there = ~np.isnan(y)
        W = whitening.reshape(*whitening.shape[:2], *[1] * n_dims, *whitening.shape[2:])
        y = np.where(there, (W @ np.where(there, y, 0)[..., None])[..., 0], np.nan)
        A, log_det = A @ np.swapaxes(W, -1, -2), _log_det(W, there)
    each = _log_gaussian(y, A, noise, power) + log_det
    total = each.sum(axis=(1, 2))  # over bins and snapshots
    top = total.max(axis=0)
    return np.asarray(top + np.log(np.exp(total - top).mean(axis=0)))


def _log_det(W: Complex, there: Bool) -> Float:
    """Return ln |det L|² of triangular L (..., M, M) of the sensors with data (..., M): (...)."""
    diagonal = np.where(there, np.diagonal(W, axis1=-2, axis2=-1).real, 1.0)
    return np.asarray(2 * np.log(diagonal).sum(axis=-1))


def _log_gaussian(Y: Complex, A: Complex, noise: float, power: float) -> Float:
    """Return ln CN(y; 0, power Σ a aᴴ + noise I), y (..., M), A (..., K, M); NaN left out."""
    there = ~np.isnan(Y)
    n, y = there.sum(axis=-1), np.where(there, Y, 0)
    A = A * there[..., None, :]
    K = A.shape[-2]
    # matrix determinant lemma and Woodbury: only K x K matrices are factored
    G = A.conj() @ np.swapaxes(A, -1, -2) + noise / power * np.eye(K)
    b = (A.conj() @ y[..., None])[..., 0]
    explained = np.einsum("...k,...k->...", b.conj(), np.linalg.solve(G, b[..., None])[..., 0])
    log_det = np.linalg.slogdet(G)[1] + K * np.log(power / noise)
    energy = (y.real**2 + y.imag**2).sum(axis=-1)
    return np.asarray(-n * np.log(np.pi * noise) - log_det - (energy - explained.real) / noise)


class StateSnapshot(SelectedEntries):
    """A model of snapshots whose `log_likelihood` takes whole states.

    `entries` are those of the direction, and of the parts of the amplitude if it is in the state.
    """

    def log_likelihood(self, z: ArrayLike, x: ArrayLike) -> Float:
        """Return ln p(z | x) at states (..., n): (...)."""
        own = self.select(x)
        w = own[..., 1:2] + 1j * own[..., 2:3] if len(self.entries) > 1 else None
        model: Any = self.measurement
        likelihood: Float = model.log_likelihood(z, own[..., :1], w)
        return likelihood


def of_state(model: MeasurementModel, names: Sequence[str]) -> StateSnapshot:
    """Return a model of snapshots for states with a direction, with its amplitude or without.

    Raises
    ------
    TypeError
        If the state has no direction, or only one part of the amplitude.
    """
    alone = "doa" in names and not set(names) & set(model.needs[1:])
    entries = (names.index("doa"),) if alone else locate(model, names)
    return StateSnapshot(model, entries, tuple(names))
