"""Capon's minimum-variance distortionless beamformer on a running covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.block_scan import (
    part_in_use,
    root_mean_amplitudes,
    scan_responses,
    strongest,
    whitened_covariance,
    whitened_responses,
)
from arrivals.trackers.beamforming.cbf import CBF
from arrivals.trackers.beamforming.covariance import (
    RunningCovariance,
    diagonal_loading,
    used_data,
)
from arrivals.trackers.registry import register
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import positive, probability

MIN_INVERSE = 1e-300  # of a power: an element response may vanish


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


def mean_capon_power(A: Complex, R: Complex) -> Float:
    """Return the mean of 1 / aᴴR⁻¹a over the bins, the largest over a nuisance.

    Parameters
    ----------
    A : ndarray, shape (n_nuisance, n_bins, n_sensors, n_directions)
        Responses.
    R : ndarray, shape (n_bins, n_sensors, n_sensors)
        Covariances, not singular.

    Returns
    -------
    ndarray, shape (n_directions,)
        A plane wave of root mean amplitude w has nearly w² in its direction.

    Examples
    --------
    >>> mean_capon_power(np.ones((1, 2, 4, 1)), np.stack([np.eye(4), 3 * np.eye(4)]))
    array([0.5])
    """
    return np.asarray(_capon_solution(A, R)[1].mean(axis=1).max(axis=0))


def _capon_solution(A: Complex, R: Complex) -> tuple[Complex, Float]:
    """Return R⁻¹a and 1 / aᴴR⁻¹a, (n_nuisance, n_bins, n_directions)."""
    solved = np.linalg.inv(R) @ A
    inverse = (A.real * solved.real + A.imag * solved.imag).sum(axis=2)
    return solved, np.asarray(1 / np.maximum(inverse, MIN_INVERSE))


@register("mvdr")
class MVDR(RunningCovariance, CBF):
    """Peaks of Capon's spectrum of a covariance with exponential forgetting.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of one angle or of azimuth and elevation; of its noise, only the coherence is
        used. With several bins the spectrum is the mean of theirs, each direction at the slowness
        or elevation of the largest mean.
    loading : float
        Added to the diagonal of the covariance, relative to the mean power of a sensor.
    forgetting : float
        Weight of the past after one unit of time; the covariance averages about
        1 / (1 - forgetting) snapshots.
    n_directions : int, optional
        Scan directions: over ±90° for a line, over the circle, or on the sphere. If None, 361,
        every half degree of a line; on the sphere one in 2 by 2 degrees: 10313, on a half 5157.
    threshold_db : float
        Peaks more than this below the highest are not reported, dB.
    max_sources : int, optional
        Maximum number of peaks; the number of sensors if None.

    Attributes
    ----------
    covariance : ndarray, shape ([n_bins,] n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products, of each bin if there are several.
    grid : ScanGrid
        Scan directions.
    doa_grid, power : ndarray, shape (n_directions,)
        Scan directions, on the sphere their azimuths, rad, and Capon's spectrum of the last step,
        NaN before the first; a wave of amplitude w has nearly |w|².

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. The refined peak has a variance above zero; the zero
    variance of the paper is that of peaks on a grid that contained the true directions. Missing
    sensors are completed by their expected values; a sensor with less than 0.3 of the data of the
    others is left out.

    References
    ----------
    Capon, "High-resolution frequency-wavenumber spectrum analysis", Proc. IEEE 57(8), 1969. Several
    bins: Salvati, Drioli and Foresti, "Incoherent frequency fusion for broadband steered response
    power algorithms in noisy environments", IEEE Signal Process. Lett. 21(5), 2014.

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
        n_directions: int | None = None,
        threshold_db: float = 10.0,
        max_sources: int | None = None,
    ) -> None:
        self.loading = positive("loading", loading)
        self.forgetting = probability("forgetting", forgetting)
        super().__init__(
            measurement,
            n_directions=n_directions,
            threshold_db=threshold_db,
            max_sources=max_sources,
        )

    def reset(self) -> None:
        """Return to the state after construction: no snapshot, no direction."""
        self.reset_covariance(self.measurement.array.n_sensors, self.measurement.n_bins)
        super().reset()

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Apply forgetting; report no direction until the next measurement."""
        super().predict(u, dt=dt)
        self.apply_forgetting(dt)

    def add_data(self, z: Complex) -> None:
        """Add the snapshots of a step to the covariance."""
        model = self.measurement
        self.fit_covariance(model.array.n_sensors, model.n_bins)
        if model.is_plain:
            self.add_snapshot(z)
        else:
            self.add_block(model.with_all_axes(z))

    def spectrum(self, A: Complex, z: Complex) -> Float:
        """Return Capon's spectrum of the covariance."""
        sensors = self.sensors_with_data()
        A = A if sensors.all() else A[:, sensors]
        return capon_power(A, self._loaded_covariance(sensors))

    def block_spectrum(self, Y: Complex, directions: Float | None = None) -> Float:
        """Return the mean of Capon's spectra of the bins."""
        sensors, bins = used_data(self.data_weights())
        if not sensors.any():
            return np.zeros(len(self.doa_grid) if directions is None else directions.shape[1])
        model = part_in_use(self.measurement, sensors, bins)
        if directions is None:
            A = scan_responses(model, self.grid).A
        else:
            A = whitened_responses(model, directions)
        return mean_capon_power(A, self._loaded_covariance(sensors, bins))

    def block_amplitudes(self, directions: Float, Y: Complex) -> Complex:
        """Return the root of the mean of |wᴴy|², w = R⁻¹a / aᴴR⁻¹a, over bins and snapshots.

        A slowness or elevation is that of the spectrum. Snapshots with missing sensors are left
        out; if no other is there, the least-squares fit.
        """
        sensors, bins = used_data(self.data_weights())
        Y = Y[:, sensors] if bins is None else Y[np.ix_(bins, sensors)]
        is_complete: Bool = np.asarray(~np.isnan(Y).any(axis=1))
        model = part_in_use(self.measurement, sensors, bins)
        if not directions.size or not is_complete.any():
            return root_mean_amplitudes(model, directions, Y)
        y = model.whitening() @ np.where(is_complete[:, None], Y, 0)
        R = self._loaded_covariance(sensors, bins)
        solved, power = _capon_solution(whitened_responses(model, directions), R)
        w = strongest(solved * power[:, :, None], power.mean(axis=1))
        output = np.swapaxes(w.conj(), 1, 2) @ y
        if self.measurement.is_single:
            return np.asarray(output[0, :, 0])
        power = (output.real**2 + output.imag**2).sum(axis=(0, 2)) / is_complete.sum()
        return np.asarray(np.sqrt(power) + 0j)

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

    def _loaded_covariance(self, sensors: Bool, bins: Bool | None = None) -> Complex:
        R = self.mean_covariance(sensors, bins)
        if self.measurement.coherence is not None:
            R = whitened_covariance(part_in_use(self.measurement, sensors, bins), R)
        return np.asarray(diagonal_loading(R, self.loading), dtype=np.complex128)
