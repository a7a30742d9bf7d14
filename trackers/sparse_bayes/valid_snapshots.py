"""Snapshots of a step with valid data, for sparse Bayesian learning."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.covariance import used_data
from arrivals.typing import Bool, Complex, Float


class ValidSnapshots(NamedTuple):
    """Snapshots of the valid sensors, ([n_bins,] n_valid, n_snapshots), and the masks of both.

    The bins, (n_bins,), are None for plain snapshots, which have no such axis. `scale` brings
    bins to equal power, (n_valid_bins, 1, 1).
    """

    Y: Complex
    valid_sensors: Bool
    bins: Bool | None = None
    scale: Float | float = 1.0


def valid_block(model: ArraySnapshot, Y: Complex) -> ValidSnapshots | None:
    """Return the bins and sensors of a step with valid data, whitened; zero if missing.

    Parameters
    ----------
    model : ArraySnapshot
        Model of the snapshots.
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        Snapshots, NaN where a sensor is missing.

    Returns
    -------
    ValidSnapshots or None
        None if fewer than two sensors have data, or all are zero.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(3, 0.2), [1.0, 1.2])
    >>> Y = np.array([[1.0, 1.0, np.nan], [2.0, 2.0, np.nan]])[..., None] + 0j
    >>> block = valid_block(model, Y)
    >>> block.valid_sensors, block.scale.ravel().round(3)
    (array([ True,  True, False]), array([1.581, 0.791]))
    """
    valid = ~np.isnan(Y)
    has_data: Bool = np.asarray(valid.any(axis=1, keepdims=True))  # (n_bins, 1, n_snapshots)
    is_complete = (valid | ~has_data).all(axis=2) & has_data.any(axis=2)
    sensors, bins = used_data(np.asarray(is_complete, dtype=np.float64))
    if bins is None or not bins.any() or sensors.sum() < 2:
        return None
    y = np.where(has_data, Y, 0)[:, sensors]
    power = (y.real**2 + y.imag**2).sum(axis=(1, 2)) / np.maximum(has_data.sum(axis=(1, 2)), 1)
    bins = np.asarray(bins & (power > 0))
    if not bins.any():
        return None
    y = model.whitening(sensors)[bins] @ y[bins] if model.coherence is not None else y[bins]
    # equal power of the bins, and of the missing snapshots that of the others
    share = has_data[bins].mean(axis=(1, 2))
    scale = np.sqrt(power[bins].mean() / (power[bins] * share))[:, None, None]
    return ValidSnapshots(y, sensors, bins, scale)
