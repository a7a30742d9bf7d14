"""Received levels of several sources whose power falls as R^-α, and their gradients."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.decibels import neper_to_db
from arrivals.typing import Float

FARTHEST = 40.0  # Np, 347 dB: values beyond are in another unit


class Offsets(NamedTuple):
    """Offsets of the sources from the sensors; all (..., n_sources, n_sensors).

    Parameters
    ----------
    dx, dy : ndarray
        Source minus sensor, m.
    square : ndarray
        R², not below R_min², m².
    floor : float
        R_min², m².
    """

    dx: Float
    dy: Float
    square: Float
    floor: float

    @property
    def inverse(self) -> Float:
        """1/R², 0 where the floor acts and the level has no slope."""
        return np.asarray((self.square > self.floor) / self.square)

    @property
    def log_range(self) -> Float:
        """Natural logarithm of the floored range."""
        return np.asarray(0.5 * np.log(self.square))


def offsets(theta: Float, sensors: Float, r_min: float) -> Offsets:
    """Return the offsets of positions from sensors.

    Parameters
    ----------
    theta : ndarray, shape (..., n_sources, 2)
        Positions of sources, m.
    sensors : ndarray, shape (..., n_sensors, 2)
        Positions of sensors, m.
    r_min : float
        Floor of the range, m.

    Examples
    --------
    >>> geometry = offsets(np.array([[3.0, 4.0]]), np.array([[0.0, 0.0], [3.0, 4.0]]), 1.0)
    >>> geometry.square, geometry.inverse
    (array([[25.,  1.]]), array([[0.04, 0.  ]]))
    """
    dx = theta[..., 0, None] - sensors[..., None, :, 0]
    dy = theta[..., 1, None] - sensors[..., None, :, 1]
    square = dx * dx
    square += dy * dy
    floor = r_min * r_min
    np.maximum(square, floor, out=square)
    return Offsets(dx, dy, square, floor)


class Levels(NamedTuple):
    """Levels at sensors, and the responsibilities of the sources.

    Parameters
    ----------
    log_sigma : ndarray, shape (..., n_sensors)
        log σ_y, Np.
    responsibilities : ndarray, shape (..., n_sources, n_sensors)
        λ: the part of each source in the power at each sensor.
    offsets : Offsets
    """

    log_sigma: Float
    responsibilities: Float
    offsets: Offsets


def levels(
    u: Float,
    theta: Float,
    sensors: Float,
    alpha: float,
    log_noise: float | Float,
    r_min: float,
    log_gain: float | Float = 0.0,
) -> Levels:
    """Return log σ_y = ½ log(Σ e^{2u} R^-α + σ_n²) and the responsibilities λ, by softmax.

    Parameters
    ----------
    u : ndarray, shape (..., n_sources)
        Log amplitudes at 1 m, Np.
    theta : ndarray, shape (..., n_sources, 2)
        Positions, m.
    sensors : ndarray, shape (..., n_sensors, 2)
        m.
    alpha : float
        Loss exponent of the power.
    log_noise : float or ndarray, shape (..., n_sensors)
        Log amplitude of the noise, Np; -inf for none.
    r_min : float
        Floor of the range, m.
    log_gain : float or ndarray, shape (n_sensors,) or (n_sources, n_sensors)
        Known log gains, such as Doppler's, Np.

    Returns
    -------
    Levels
        Without sources and noise, levels are -inf.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (1), (9).

    Examples
    --------
    Two equal sources at 2 m, without noise: half each, and 3 dB more than one.

    >>> two = levels(np.zeros(2), np.array([[2.0, 0], [0, 2]]), np.zeros((1, 2)), 2.0, -np.inf, 1.0)
    >>> two.responsibilities.round(6).ravel(), float((two.log_sigma[0] + np.log(2)) / np.log(2))
    (array([0.5, 0.5]), 0.5)
    """
    geometry = offsets(theta, sensors, r_min)
    power = 2 * (u[..., None] + log_gain) - 0.5 * alpha * np.log(geometry.square)
    noise: Float = 2.0 * np.asarray(log_noise)
    top = np.maximum(power.max(axis=-2, initial=-np.inf), noise)
    top = np.where(np.isneginf(top), 0.0, top)
    # differences first: the logarithms themselves may overflow
    responsibilities = np.exp(power - top[..., None, :])
    total = responsibilities.sum(axis=-2) + np.exp(noise - top)
    responsibilities /= np.maximum(total, np.finfo(np.float64).tiny)[..., None, :]
    with np.errstate(divide="ignore"):
        log_sigma = 0.5 * (top + np.log(total))
    return Levels(log_sigma, responsibilities, geometry)


class PropagationModel(NamedTuple):
    """Sensors and propagation parameters, for `levels`.

    Parameters
    ----------
    sensors : ndarray, shape (..., n_sensors, 2)
    alpha : float
    log_noise : float or ndarray, shape (..., n_sensors)
    r_min : float
    log_gain : float or ndarray
        As in `levels`, or (n_batch, n_sources, n_sensors). Leading axes are those of a batch that
        has its own sensors each.
    """

    sensors: Float
    alpha: float = 2.0
    log_noise: float | Float = -np.inf
    r_min: float = 1.0
    log_gain: float | Float = 0.0

    def levels(self, u: Float, theta: Float) -> Levels:
        """Return log σ_y and responsibilities of sources (..., n_sources), (..., n_sources, 2)."""
        return levels(u, theta, self.sensors, self.alpha, self.log_noise, self.r_min, self.log_gain)

    def offsets(self, theta: Float) -> Offsets:
        """Return the offsets of positions (..., n_sources, 2) from the sensors."""
        return offsets(theta, self.sensors, self.r_min)

    def select(self, rows: Any) -> PropagationModel:
        """Return the model at some rows of a batch."""
        noise, gain = np.asarray(self.log_noise), np.asarray(self.log_gain)
        return self._replace(
            sensors=self.sensors[rows] if self.sensors.ndim > 2 else self.sensors,
            log_noise=noise[rows] if noise.ndim > 1 else self.log_noise,
            log_gain=gain[rows] if gain.ndim > 2 else self.log_gain,
        )

    def at_sensors(self, rows: Any) -> PropagationModel:
        """Return the model of some of the sensors, without a batch axis."""
        noise, gain = self.log_noise, self.log_gain
        return self._replace(
            sensors=self.sensors[rows],
            log_noise=np.asarray(noise)[rows] if np.ndim(noise) else noise,
            log_gain=np.asarray(gain)[..., rows] if np.ndim(gain) else gain,
        )


def slopes(predicted: Levels, alpha: float) -> Float:
    """Return the gradients of log σ_y: λ with respect to u, -½αλ d/R² to positions.

    Returns
    -------
    ndarray, shape (..., n_sensors, 3 n_sources)
        In the order u₁..u_K, x₁, y₁, .. x_K, y_K.

    References
    ----------
    The same, gradient of (1).

    Examples
    --------
    >>> one = levels(np.zeros(1), np.array([[2.0, 0.0]]), np.zeros((1, 2)), 3.0, -np.inf, 1.0)
    >>> slopes(one, alpha=3.0)
    array([[ 1.  , -0.75, -0.  ]])
    """
    lam, geometry = predicted.responsibilities, predicted.offsets
    *lead, K, M = lam.shape
    slope = -0.5 * alpha * lam * geometry.inverse
    G = np.empty((*lead, 3 * K, M))
    G[..., :K, :] = lam
    G[..., K::2, :] = slope * geometry.dx
    G[..., K + 1 :: 2, :] = slope * geometry.dy
    return np.swapaxes(G, -1, -2)


def doppler_log_gain(
    velocity: ArrayLike, theta: ArrayLike, sensors: ArrayLike, speed: float
) -> Float:
    """Return the log gains of moving monopoles: -2 log(1 - (v/c) cos ψ), Np.

    Parameters
    ----------
    velocity, theta : array_like, shape (..., 2)
        Velocities, m/s, and positions, m, of sources.
    sensors : array_like, shape (n_sensors, 2)
        m.
    speed : float
        Speed c of the waves, m/s.

    Returns
    -------
    ndarray, shape (..., n_sensors)
        For `paths` of `LogGains`.

    Raises
    ------
    ValueError
        If a source is not slower than the waves.

    References
    ----------
    Morse and Ingard, *Theoretical Acoustics*, 1968, sec. 11.2; the paper leaves it out.

    Examples
    --------
    Straight at the sensor, and away from it, at 5 m/s in air:

    >>> gain = doppler_log_gain([[5.0, 0.0]], [[0.0, 0.0]], [[50.0, 0.0], [-50.0, 0.0]], 340.0)
    >>> (gain / np.log(10) * 20).round(2)
    array([[ 0.26, -0.25]])
    """
    v, positions = np.asarray(velocity, dtype=np.float64), np.asarray(sensors, dtype=np.float64)
    path = positions - np.asarray(theta, dtype=np.float64)[..., None, :]
    distance = np.maximum(np.linalg.norm(path, axis=-1), np.finfo(np.float64).tiny)
    towards = (path * v[..., None, :]).sum(axis=-1) / distance
    if not np.linalg.norm(v, axis=-1).max(initial=0.0) < speed:
        raise ValueError(f"sources must be slower than the waves, {speed} m/s; got {v.tolist()}")
    return np.asarray(-2 * np.log1p(-towards / speed))


def check_unit(z: Float, xi: Float, log_noise: float, std: float) -> None:
    """Raise a ValueError if readings are in another unit than neper, by their size.

    Parameters
    ----------
    z, xi : ndarray, shape (..., n_sensors)
        Readings, and the same without offsets and bias, Np; NaN where missing.
    log_noise, std : float
        Largest log amplitude of the noise, and standard deviation of readings, Np.
    """
    low, high = (np.nan, np.nan) if np.isnan(z).all() else (np.nanmin(z), np.nanmax(z))
    worst = low if low < -FARTHEST else high
    if low < -FARTHEST or high > FARTHEST:
        raise ValueError(
            f"readings are in neper, within ±{FARTHEST:g}; got {worst:g}: "
            "convert dB and dBm by db_to_neper"
        )
    if np.nanmin(xi, initial=np.inf) < log_noise - 5 * std - 5.0:
        raise ValueError(
            f"a reading lies {neper_to_db(log_noise - np.nanmin(xi)):.0f} dB below "
            "the noise: readings are in neper, convert dB and dBm by db_to_neper"
        )
