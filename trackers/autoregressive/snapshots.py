"""Checks and conversions of complex snapshots."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurements import LARGEST
from arrivals.typing import Bool, Complex, Float

MISSING = complex(np.nan, np.nan)


def to_snapshot(z: ArrayLike | None, n: int) -> Complex:
    """Return one snapshot of n sensors as complex numbers, a copy; NaN if it is missing.

    Examples
    --------
    >>> to_snapshot(None, 2), to_snapshot([1.0, 2j], 2)
    (array([nan+nanj, nan+nanj]), array([1.+0.j, 0.+2.j]))
    """
    array = np.asarray(np.nan if z is None else z)
    if array.dtype.kind not in "biufc":
        raise TypeError(f"a snapshot must hold complex numbers; got {array.dtype}")
    if array.ndim == 0 and np.isnan(array):
        return np.full(n, MISSING)
    if array.shape != (n,):
        raise ValueError(
            f"a snapshot must have shape ({n},), one number a sensor; got {array.shape}"
        )
    return np.array(array, dtype=np.complex128)


def to_snapshots(measurements: Iterable[ArrayLike | None], n: int) -> Complex:
    """Return snapshots of n sensors as complex numbers, (n_steps, n)."""
    if isinstance(measurements, np.ndarray) and measurements.shape[1:] == (n,):
        if measurements.dtype.kind not in "biufc":
            raise TypeError(f"snapshots must hold complex numbers; got {measurements.dtype}")
        return measurements.astype(np.complex128)
    return np.array([to_snapshot(z, n) for z in measurements], np.complex128).reshape(-1, n)


def to_real_rows(z: Complex, manifold: ArrayManifold, n_parts: int) -> Float:
    """Return transformed snapshots y_T = Tᴴ y (5) as real rows, NaN where missing.

    Parameters
    ----------
    z : ndarray, shape (..., n_snapshots, n_sensors)
        Not finite where missing.
    manifold : ArrayManifold
    n_parts : int
        2, or 1 to leave the imaginary part out.

    Returns
    -------
    ndarray, shape (..., n_snapshots * n_parts, n_sensors)
        Both rows of a pair are missing if one of its sensors is.
    """
    valid = np.abs(z) < LARGEST
    has_gaps = not valid.all()
    y = manifold.transform(np.where(valid, z, 0) if has_gaps else z)
    if has_gaps:
        y[(~valid @ (manifold.T != 0)) > 0] = complex(np.nan, np.nan)
    rows = np.stack([y.real, y.imag][:n_parts], axis=-2)
    return np.asarray(rows.reshape(*y.shape[:-2], -1, y.shape[-1]), dtype=np.float64)


def completes_interval(z: Complex) -> Bool:
    """Return True where snapshots (..., n_sensors), the last of an interval, have valid data.

    Examples
    --------
    >>> completes_interval(np.array([[np.nan, 1j], [np.nan, np.nan]]))
    array([ True, False])
    """
    return np.asarray(np.isfinite(z).any(axis=-1))
