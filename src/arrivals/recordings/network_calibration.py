"""Exponent, offsets and shadowing of a measured network, from one transmitter at known places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.recordings.networks import Network
from arrivals.typing import Float, Int
from arrivals.validation import positive

ROUNDS = 3  # of scale and fit


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a network's readings of a known transmitter tell of path and sensors.

    Parameters
    ----------
    alpha : float
        Loss exponent.
    log_amplitude : float
        u of the transmitter, Np.
    offsets : ndarray, shape (n_sensors,)
        Log gains, Np, shrunk to 0 where readings are few; 0 where there are none.
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
        """Return the model of readings at places (n_sensors, 2), m.

        Readings of sensors that were never calibrated have the variance of an unknown offset
        added.

        Parameters
        ----------
        sensors : ndarray, shape (n_sensors, 2)
        floor_db : float, optional
            Level on which quiet sensors sit, dB, whatever their offset.
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
            offsets=self.offsets,
            log_noise=floor,
            r_min=self.r_min,
            position=position,
        )


def calibrate(
    network: Network,
    *,
    r_min: float = 20.0,
    offset_std_db: float = 7.0,
    floor_db: float | None = None,
) -> Calibration:
    """Fit exponent, offsets and shadowing by a robust regression on the log distance.

    ξ = u + offset - ½α log R, Huber's loss by scipy, the offsets held by a ridge.

    Parameters
    ----------
    network : Network
        With the true positions of one transmitter.
    r_min : float
        Floor of the range, m.
    offset_std_db : float
        Standard deviation that offsets are expected to have, dB: the ridge.
    floor_db : float, optional
        Readings within one deviation of this level, dB, are left out: noise, not signal.

    Raises
    ------
    ValueError
        If the network has not the truth of one source, or too few readings.

    Examples
    --------
    >>> from arrivals.measurement_models import neper_to_db
    >>> rng = np.random.default_rng(0)
    >>> places, truth = rng.uniform(-500, 500, (8, 2)), rng.uniform(-500, 500, (200, 1, 2))
    >>> far = np.hypot(*np.moveaxis(truth - places, -1, 0))
    >>> rss_db = -20 - 30 * np.log10(far) + 5 * rng.standard_normal(far.shape)
    >>> known = Network(tuple("abcdefgh"), np.arange(200.0), rss_db,
    ...                 np.broadcast_to(places, (200, 8, 2)), truth)
    >>> found = calibrate(known)
    >>> round(found.alpha, 1), float(neper_to_db(found.sigma).round(1))
    (3.0, 5.0)
    """
    if network.truth is None or network.truth.shape[1] != 1:
        raise ValueError("calibration wants the true positions of one transmitter")
    ridge = float(db_to_neper(positive("offset_std_db", offset_std_db)))
    far = np.linalg.norm(network.truth - network.sensors, axis=-1)
    log_range = np.log(np.maximum(far, positive("r_min", r_min)))
    heard = np.isfinite(network.rss_db) & np.isfinite(log_range)
    if floor_db is not None:
        heard &= network.rss_db > floor_db + 3.0
    sensor = np.nonzero(heard)[1]
    if len(sensor) < 10:
        raise ValueError(f"calibration wants ten readings at least; got {len(sensor)}")
    xi, log_range = network.readings[heard], log_range[heard]
    x, sigma = _regression(xi, log_range, sensor, len(network.name), ridge)
    n_readings = np.bincount(sensor, minlength=len(network.name))
    return Calibration(float(x[1]), float(x[0]), x[2:], sigma, n_readings, r_min, ridge)


def _regression(
    xi: Float, log_range: Float, sensor: Int, n_sensors: int, ridge: float
) -> tuple[Float, float]:
    """Return u, α and the offsets, and the deviation of what is left."""
    from scipy.optimize import least_squares
    from scipy.sparse import coo_matrix, vstack

    n = len(xi)
    rows = np.tile(np.arange(n), 3)
    columns = np.concatenate([np.zeros(n, dtype=int), np.ones(n, dtype=int), 2 + sensor])
    values = np.concatenate([np.ones(n), -0.5 * log_range, np.ones(n)])
    A = coo_matrix((values, (rows, columns)), shape=(n, 2 + n_sensors)).tocsr()
    each = np.arange(n_sensors)
    hold = coo_matrix((np.ones(n_sensors), (each, 2 + each)), shape=(n_sensors, 2 + n_sensors))
    x, sigma = np.zeros(2 + n_sensors), 1.0
    x[1] = 2.0
    for _ in range(ROUNDS):
        B = vstack([A / sigma, hold / ridge]).tocsr()
        y = np.concatenate([xi / sigma, np.zeros(n_sensors)])
        x = least_squares(
            lambda x, B=B, y=y: B @ x - y, x, lambda x, B=B: B, loss="huber",
            f_scale=1.345, tr_solver="lsmr",
        ).x  # fmt: skip
        left = xi - A @ x
        sigma = float(np.median(np.abs(left - np.median(left)))) / 0.6745
    return x, float(np.std(left))
