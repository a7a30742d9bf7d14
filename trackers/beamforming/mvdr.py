"""Capon's minimum-variance distortionless beamformer on a running covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.cbf import CBF
from arrivals.trackers.beamforming.covariance import RunningCovariance, diagonal_loading
from arrivals.trackers.registry import register
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import instance, positive, probability


def capon_power(A: Complex, R: Complex) -> Float:
    """Return Capon's spectrum 1 / aᴴR⁻¹a.

    Parameters
    ----------
    A : ndarray, shape (n_directions, n_sensors)
        Rows a(β).
    R : ndarray, shape (n_sensors, n_sensors)
        Covariance, not singular.

    Returns
    -------
    ndarray, shape (n_directions,)
        A plane wave of amplitude w without noise has |w|² in its direction.

    References
    ----------
    Capon, "High-resolution frequency-wavenumber spectrum analysis", Proc. IEEE 57(8), 1969, (13).

    Examples
    --------
    >>> capon_power(np.ones((1, 4)), 2 * np.eye(4))
    array([0.5])
    """
    solved = np.linalg.solve(R, A.T)
    return np.asarray(1 / (A.conj() * solved.T).sum(axis=-1).real)


@register("mvdr")
class MVDR(RunningCovariance, CBF):
    """Peaks of Capon's spectrum of a covariance with exponential forgetting.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array of isotropic sensors, one bin and one snapshot per step; its noise is not used.
    loading : float
        Added to the diagonal of the covariance, relative to the mean power of a sensor.
    forgetting : float
        Weight of the past after one unit of time; the covariance averages about
        1 / (1 - forgetting) snapshots.
    n_directions : int
        Scan directions: over ±90° for a line (361: every half degree), else over the circle.
    threshold_db : float
        Peaks more than this below the highest are not reported, dB.
    max_sources : int, optional
        Maximum number of peaks; the number of sensors if None.

    Attributes
    ----------
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.
    doa_grid, power : ndarray, shape (n_directions,)
        Scan directions, rad, and Capon's spectrum of the last step, NaN before the first; a wave
        of amplitude w has nearly |w|².

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. The refined peak has a variance above zero; the zero
    variance of the paper is that of peaks on a grid that contained the true directions. Missing
    sensors are completed by their expected values; a sensor with less than 0.3 of the data of the
    others is left out.

    References
    ----------
    Capon, "High-resolution frequency-wavenumber spectrum analysis", Proc. IEEE 57(8), 1969.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(10, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> z = model.simulate(np.full((50, 1), 0.5), 1.0, np.random.default_rng(0))
    >>> MVDR(model, max_sources=1).run(z).doa[-1].round(2)
    array([0.5])
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        loading: float = 0.01,
        forgetting: float = 0.96,
        n_directions: int = 361,
        threshold_db: float = 10.0,
        max_sources: int | None = None,
    ) -> None:
        self.loading = positive("loading", loading)
        self.forgetting = probability("forgetting", forgetting)
        instance("measurement", measurement, ArraySnapshot).plain_wavelength("mvdr")
        super().__init__(
            measurement,
            n_directions=n_directions,
            threshold_db=threshold_db,
            max_sources=max_sources,
        )

    def reset(self) -> None:
        """Return to the state after construction: no snapshot, no direction."""
        self.reset_covariance(self.measurement.array.n_sensors)
        super().reset()

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Apply forgetting; report no direction until the next measurement."""
        super().predict(u, dt=dt)
        self.apply_forgetting(dt)

    def spectrum(self, A: Complex, z: Complex) -> Float:
        """Add a snapshot to the covariance, and return Capon's spectrum."""
        self.add_snapshot(z)
        sensors = self.sensors_with_data()
        A = A if sensors.all() else A[:, sensors]
        return capon_power(A, self._loaded_covariance(sensors))

    def scanned_sensors(self, z: Complex) -> Bool:
        """Return the sensors of the spectrum: those with enough data."""
        return self.sensors_with_data()

    def amplitudes(self, A: Complex, z: Complex) -> Complex:
        """Return wᴴz, w = R⁻¹a / aᴴR⁻¹a over the sensors with valid data."""
        if len(A) == 0:
            return np.zeros(0, dtype=np.complex128)
        sensors = self.sensors_with_data()
        valid = ~np.isnan(z) & sensors
        kept = valid[sensors]
        R, A = self._loaded_covariance(sensors)[np.ix_(kept, kept)], A[:, valid]
        return np.asarray(A.conj() @ np.linalg.solve(R, z[valid]) * capon_power(A, R))

    def _loaded_covariance(self, sensors: Bool) -> Complex:
        R = diagonal_loading(self.mean_covariance(sensors), self.loading)
        return np.asarray(R, dtype=np.complex128)
