"""Capon's beamformer: minimum variance without distortion, on a running covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.cbf import CBF
from arrivals.trackers.beamforming.covariance import RunningCovariance
from arrivals.trackers.registry import register
from arrivals.typing import Complex, Float
from arrivals.validation import instance, positive, probability


def loaded(R: Complex | Float, loading: float) -> Complex | Float:
    """Return covariances (..., N, N) with `loading` times their mean power on the diagonal.

    Examples
    --------
    >>> loaded(np.ones((2, 2)), 0.5)
    array([[1.5, 1. ],
           [1. , 1.5]])
    """
    n = R.shape[-1]
    power = np.trace(R, axis1=-2, axis2=-1).real / n
    return np.asarray(R + loading * power[..., None, None] * np.eye(n))


def capon_power(A: Complex, R: Complex) -> Float:
    """Return 1 / aᴴR⁻¹a of steering vectors A, (n_directions, n_sensors).

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
    """Peaks of Capon's spectrum, of a covariance that forgets.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array of isotropic sensors, one look a step; its noise is not used.
    loading : float
        Added to the diagonal of the covariance, in mean powers of a sensor.
    forgetting : float
        Weight that the past keeps from step to step; the covariance is that of the last
        1 / (1 - forgetting) snapshots or so.
    n_directions, threshold_db, max_sources
        As in `CBF`.

    Attributes
    ----------
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.
    doa_grid, power
        As in `CBF`; `power` is Capon's, of a wave of amplitude w nearly |w|².

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. The refined peak is what has a variance: the zero
    variance that the paper found is that of peaks on a grid that held the truth. Each pair of
    sensors is averaged over the snapshots in which both were heard.

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
        self._know_nothing(measurement.array.n_sensors)
        super().__init__(
            measurement,
            n_directions=n_directions,
            threshold_db=threshold_db,
            max_sources=max_sources,
        )

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Let the past fade; report nothing until something is heard."""
        super().predict(u, dt=dt)
        self._fade(dt)

    def spectrum(self, A: Complex, z: Complex) -> Float:
        """Add a snapshot to the covariance, and return Capon's spectrum."""
        self._add(z)
        if not self.covariance.any():
            return np.zeros(len(A))
        return capon_power(A, self._loaded())

    def beam(self, A: Complex, z: Complex) -> Complex:
        """Return wᴴz, w = R⁻¹a / aᴴR⁻¹a over the sensors that were heard."""
        if len(A) == 0:
            return np.zeros(0, dtype=np.complex128)
        heard = ~np.isnan(z)
        R, A = self._loaded()[np.ix_(heard, heard)], A[:, heard]
        return np.asarray(A.conj() @ np.linalg.solve(R, z[heard]) * capon_power(A, R))

    def _loaded(self) -> Complex:
        return np.asarray(loaded(self._mean(), self.loading), dtype=np.complex128)
