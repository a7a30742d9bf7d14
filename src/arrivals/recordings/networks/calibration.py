"""Loss exponent, offsets and shadowing of a measured network, by a transmitter of known path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import LogGains, LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.fill_values import warn_fill_values
from arrivals.recordings.networks.network import Network
from arrivals.typing import Float, Int
from arrivals.validation import positive

N_ITERATIONS = 3  # of scale and fit
MIN_SIGMA = 1e-3  # Np, of readings without noise


@dataclass(frozen=True, eq=False)
class Calibration:
    """Propagation and sensor offsets, estimated from readings of a known transmitter.

    Parameters
    ----------
    alpha : float
        Loss exponent.
    log_amplitude : float
        u of the transmitter, Np.
    offsets : ndarray, shape (n_sensors,)
        Log gains, Np, shrunk to 0 for few readings; 0 without readings.
    sigma : float
        Shadowing: standard deviation of the readings, Np.
    n_readings : ndarray of int, shape (n_sensors,)
    r_min : float
        Floor of the range, m.
    offset_std : float
        Prior standard deviation of an offset, Np.
    """

    alpha: float
    log_amplitude: float
    offsets: Float
    sigma: float
    n_readings: Int
    r_min: float
    offset_std: float

    def model(
        self, sensors: Float, *, floor_db: float | None = None, position: tuple[int, int] = (0, 2)
    ) -> LogNormalRSS:
        """Return the model of readings at sensor positions (n_sensors, 2), m.

        The readings of uncalibrated sensors have the variance of an unknown offset added.

        Parameters
        ----------
        sensors : ndarray, shape (n_sensors, 2)
        floor_db : float, optional
            Noise floor of all sensors, dB, offsets included.
        position : tuple of two int
            As in `LogNormalRSS`.
        """
        unknown = self.n_readings == 0
        sigma = np.hypot(self.sigma, np.where(unknown, self.offset_std, 0.0))
        floor = None if floor_db is None else db_to_neper(floor_db) - self.offsets
        return LogNormalRSS(
            sensors,
            sigma,
            alpha=self.alpha,
            gains=LogGains(self.offsets),
            log_noise=floor,
            r_min=self.r_min,
            position=position,
        )


def calibrate(
    network: Network,
    *,
    r_min: float | None = None,
    offset_std_db: float = 7.0,
    floor_db: float | None = None,
) -> Calibration:
    """Fit exponent, offsets and shadowing by a robust regression on the log distance.

    ξ = u + offset - ½α log R, Huber's loss by scipy, with a ridge penalty on the offsets.

    Parameters
    ----------
    network : Network
        With the true positions of one transmitter.
    r_min : float, optional
        Floor of the range, m; a hundredth of the extent of the sensors if None, at most 20 m.
    offset_std_db : float
        Prior standard deviation of an offset, dB: the ridge.
    floor_db : float, optional
        Noise floor, dB; readings below it plus 3 dB are excluded.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        If the network lacks the true positions of one source, or has too few readings.

    Examples
    --------
    >>> from arrivals.measurement_models import neper_to_db
    >>> rng = np.random.default_rng(0)
    >>> sensors, truth = rng.uniform(-500, 500, (8, 2)), rng.uniform(-500, 500, (200, 1, 2))
    >>> distance = np.hypot(*np.moveaxis(truth - sensors, -1, 0))
    >>> rss_db = -20 - 30 * np.log10(distance) + 5 * rng.standard_normal(distance.shape)
    >>> network = Network(tuple("abcdefgh"), np.arange(200.0), rss_db,
    ...                 np.broadcast_to(sensors, (200, 8, 2)), truth)
    >>> fitted = calibrate(network)
    >>> round(fitted.alpha, 1), float(neper_to_db(fitted.sigma).round(1))
    (3.0, 5.0)
    """
    if network.truth is None or network.truth.shape[1] != 1:
        raise ValueError("network must have the true positions of one transmitter")
    warn_fill_values(network.rss_db)
    r_min = min(20.0, network.extent / 100) if r_min is None else positive("r_min", r_min)
    ridge = float(db_to_neper(positive("offset_std_db", offset_std_db)))
    distance = np.linalg.norm(network.truth - network.sensors, axis=-1)
    log_range = np.log(np.maximum(distance, r_min))
    valid = np.isfinite(network.rss_db) & np.isfinite(log_range)
    if floor_db is not None:
        valid &= network.rss_db > floor_db + 3.0
    sensor = np.nonzero(valid)[1]
    if len(sensor) < 10:
        raise ValueError(f"network must have at least 10 readings; got {len(sensor)}")
    xi, log_range = network.readings[valid], log_range[valid]
    x, sigma = _regression(xi, log_range, sensor, len(network.name), ridge)
    n_readings = np.bincount(sensor, minlength=len(network.name))
    return Calibration(float(x[1]), float(x[0]), x[2:], sigma, n_readings, r_min, ridge)


def _regression(
    xi: Float, log_range: Float, sensor: Int, n_sensors: int, ridge: float
) -> tuple[Float, float]:
    """Return u, α and the offsets, and the standard deviation of the residuals."""
    from scipy.optimize import least_squares
    from scipy.sparse import coo_matrix, vstack

    n = len(xi)
    rows = np.tile(np.arange(n), 3)
    columns = np.concatenate([np.zeros(n, dtype=int), np.ones(n, dtype=int), 2 + sensor])
    values = np.concatenate([np.ones(n), -0.5 * log_range, np.ones(n)])
    A = coo_matrix((values, (rows, columns)), shape=(n, 2 + n_sensors)).tocsr()
    each = np.arange(n_sensors)
    penalty = coo_matrix((np.ones(n_sensors), (each, 2 + each)), shape=(n_sensors, 2 + n_sensors))
    x, sigma = np.zeros(2 + n_sensors), 1.0
    x[1] = 2.0
    for _ in range(N_ITERATIONS):
        B = vstack([A / sigma, penalty / ridge]).tocsr()
        y = np.concatenate([xi / sigma, np.zeros(n_sensors)])
        # a fresh copy: scipy weighs the Jacobian of a robust loss in place
        fit = least_squares(
            lambda x, B=B, y=y: B @ x - y, x, lambda x, B=B: B.copy(), loss="huber",
            f_scale=1.345, tr_solver="lsmr",
        )  # fmt: skip
        if not fit.success or not np.isfinite(fit.x).all():
            raise ValueError(f"network must have readings that determine the fit: {fit.message}")
        x = fit.x
        residual = xi - A @ x
        scale = float(np.median(np.abs(residual - np.median(residual)))) / 0.6745
        sigma = max(scale, MIN_SIGMA)
    return x, max(float(np.std(residual)), MIN_SIGMA)
