"""Checks and conversions of complex snapshots."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurements import LARGEST, numbers, rows
from arrivals.typing import Bool, Complex, Float

MISSING = complex(np.nan, np.nan)
LOUDEST = 300.0  # power of a sensor over the expected one: 25 dB


def to_snapshot(z: ArrayLike | None, measurement: ArraySnapshot) -> Complex:
    """Return one snapshot as complex numbers, a copy; NaN where it is missing.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(2, spacing=0.5), wavelength=1.0)
    >>> to_snapshot(None, model), to_snapshot([1.0, 2j], model)
    (array([nan+nanj, nan+nanj]), array([1.+0.j, 0.+2.j]))
    """
    n = measurement.array.n_sensors
    if type(z) is np.ndarray and z.shape == (n,) and z.dtype == np.complex128 and z.all():
        return z.copy()  # the usual case; `to_real_rows` leaves huge numbers out
    return measurement.snapshot(z)


def to_snapshots(measurements: Iterable[ArrayLike | None], measurement: ArraySnapshot) -> Complex:
    """Return snapshots as complex numbers, (n_steps, n_sensors)."""
    n = measurement.array.n_sensors
    if not isinstance(measurements, np.ndarray) or measurements.shape[1:] != (n,):
        each = [to_snapshot(z, measurement) for z in rows("measurements", measurements)]
        return np.array(each, np.complex128).reshape(-1, n)
    z = numbers("measurements", measurements).astype(np.complex128)
    for k in np.flatnonzero((z == 0).any(axis=-1)):
        z[k] = measurement.snapshot(z[k])
    return z


def without_clicks(y: Float, n_parts: int, power: Float) -> Float:
    """Return transformed snapshots, NaN where one is far louder than its neighbours.

    Parameters
    ----------
    y : ndarray, shape (..., n_snapshots * n_parts, n_sensors)
        Real rows of successive snapshots.
    n_parts : int
    power : ndarray, shape (...)
        Power expected at one sensor. Beyond `LOUDEST` times that, and times the level of the
        quieter half of the snapshots, a snapshot is missing.

    Examples
    --------
    >>> y = np.array([[1.0, -1.0], [1e6, 1e6], [2.0, 1.0]])
    >>> without_clicks(y, 1, np.array(1.0))[:, 0]
    array([ 1., nan,  2.])
    """
    level = np.fmax.reduce(y * y, axis=-1)  # of the loudest sensor
    if not (np.fmax.reduce(level, axis=-1, initial=0.0) > LOUDEST * power).any():
        return y  # the usual case
    level = level.reshape(*level.shape[:-1], -1, n_parts)
    level = np.nan_to_num(level.max(axis=-1))
    quiet = np.sort(level, axis=-1)[..., (level.shape[-1] - 1) // 2]
    loud = level > (LOUDEST * np.maximum(power, quiet))[..., None]
    return np.where(np.repeat(loud, n_parts, axis=-1)[..., None], np.nan, y)


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
    parts = np.stack([y.real, y.imag][:n_parts], axis=-2)
    return np.asarray(parts.reshape(*y.shape[:-2], -1, y.shape[-1]), dtype=np.float64)


def completes_interval(z: Complex) -> Bool:
    """Return True where snapshots (..., n_sensors), the last of an interval, have valid data.

    Examples
    --------
    >>> completes_interval(np.array([[np.nan, 1j], [np.nan, np.nan]]))
    array([ True, False])
    """
    return np.asarray((np.abs(z) < LARGEST).any(axis=-1))
