"""Beam power and channel levels of single steps, coarse enough to be computed while tracking."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import ArraySnapshot
from arrivals.trackers.beamforming.spectrum import mean_beam_power, scan_directions
from arrivals.typing import Complex, Float

N_DIRECTIONS = 91  # every 2 degrees of a line, every 4 of the circle
MAX_BINS = 16  # bins of which the beam is computed
MAX_SNAPSHOTS = 8  # snapshots, likewise
FLOOR_DB = -60.0  # lowest beam power
ELEVATIONS_DEG = (0.0, 20.0, 40.0, 60.0)  # of the beam of unknown elevations


class StepBeam:
    """Beam power of the steps of a tracker of directions.

    Every frequency has the same weight, so that low ones, whose beams are wide, do not cover the
    others. Noise is not whitened.

    Parameters
    ----------
    measurement : ArraySnapshot
        Array and wavelengths.

    Attributes
    ----------
    doa : ndarray, shape (n_directions,)
        Directions, rad.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0)
    >>> beam = StepBeam(model)
    >>> level = beam.level_db(model.steering_vector(np.deg2rad(30.0)))
    >>> float(np.rad2deg(beam.doa[level.argmax()]).round())
    30.0
    """

    def __init__(self, measurement: ArraySnapshot) -> None:
        self.doa = scan_directions(measurement.array, N_DIRECTIONS)
        self._shape = (measurement.n_bins, measurement.n_snapshots, measurement.array.n_sensors)
        n = min(MAX_BINS, measurement.n_bins)
        self._bins = np.unique(np.linspace(0, measurement.n_bins - 1, n).round().astype(int))
        waves = measurement.waves.only(self._bins)
        if measurement.unknowns == "sphere":
            waves = waves.replace(elevation=np.deg2rad(ELEVATIONS_DEG))
        self._steering = waves.steering(self.doa)

    def level_db(self, z: Complex) -> Float:
        """Return the beam power in each direction, dB re its maximum; the floor without data.

        Parameters
        ----------
        z : ndarray, shape (n_bins, n_snapshots, n_sensors)
            Snapshots of a step, axes of length one left out; NaN where missing.

        Returns
        -------
        ndarray, shape (n_directions,)
        """
        Y = z.reshape(self._shape)[self._bins]
        Y = Y[:, :: -(-Y.shape[1] // MAX_SNAPSHOTS)].swapaxes(1, 2)
        power = np.nansum(Y.real**2 + Y.imag**2, axis=(1, 2), keepdims=True)
        weighted = np.divide(Y, np.sqrt(power), out=np.full_like(Y, np.nan), where=power > 0)
        beam = mean_beam_power(self._steering, weighted)
        highest = beam.max()
        if not highest > 0:
            return np.full(len(self.doa), FLOOR_DB)
        return np.asarray(10 * np.log10(np.maximum(beam / highest, 10 ** (FLOOR_DB / 10))))


def channel_levels(z: Complex) -> Float:
    """Return the mean power of each channel of a step, dB; minus infinity without any.

    Parameters
    ----------
    z : ndarray, shape (..., n_channels)
        Snapshots; NaN where missing.

    Returns
    -------
    ndarray, shape (n_channels,)

    Examples
    --------
    >>> channel_levels(np.array([[1.0, 10.0, np.nan], [1.0, 10.0, np.nan]]) + 0j)
    array([  0.,  20., -inf])
    """
    rows = z.reshape(-1, z.shape[-1])
    power = rows.real**2 + rows.imag**2
    n_valid = np.maximum((~np.isnan(power)).sum(axis=0), 1)
    with np.errstate(divide="ignore"):
        return np.asarray(10 * np.log10(np.nansum(power, axis=0) / n_valid))
