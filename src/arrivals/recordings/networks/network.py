"""Measured sensor networks: positions and readings over time."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.measurements import real_numbers
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class Network:
    """Readings of named sensors over time.

    Parameters
    ----------
    name : tuple of str
        Names of the sensors.
    time : ndarray, shape (n_steps,)
        Times of the steps, s.
    rss_db : ndarray, shape (n_steps, n_sensors)
        Levels, dB or dBm; NaN where missing.
    sensors : ndarray, shape (n_steps, n_sensors, 2)
        Positions, m; NaN where there is no reading.
    truth : ndarray, shape (n_steps, n_sources, 2), optional
        True positions of the sources, m, where they are known.
    plane : LocalPlane, optional
        Plane of the positions where they were given by latitude and longitude.
    start : float, optional
        Time 0 in seconds since 1970-01-01 UTC, where the readings have dates.

    Examples
    --------
    >>> sensors = np.array([[0.0, 0.0], [50.0, 0.0]])
    >>> network = Network.fixed(["a", "b"], sensors, [[-60.0, -72.0], [-61.0, np.nan]])
    >>> network.readings.round(2)
    array([[-6.91, -8.29],
           [-7.02,   nan]])
    """

    name: tuple[str, ...]
    time: Float
    rss_db: Float
    sensors: Float
    truth: Float | None = None
    plane: LocalPlane | None = None
    start: float | None = None

    def __post_init__(self) -> None:
        for key in ("time", "rss_db", "sensors", "truth"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, real_numbers(key, getattr(self, key)))
        repeated = sorted(name for name, n in Counter(self.name).items() if n > 1)
        if repeated:
            raise ValueError(f"name must have no duplicates; got {repeated[0]!r} twice")
        shape = (self.time.size, len(self.name))
        if self.time.ndim != 1:
            raise ValueError(f"time must have shape (n_steps,); got {self.time.shape}")
        for name, expected in (("rss_db", shape), ("sensors", (*shape, 2))):
            got = getattr(self, name).shape
            if got != expected:
                raise ValueError(f"{name} must have shape {expected}; got {got}")
        if not np.isfinite(self.time).all():
            raise ValueError(f"time must be finite; got NaN in step {np.isnan(self.time).argmax()}")
        got = (len(self), 0, 2) if self.truth is None else self.truth.shape
        if len(got) != 3 or got[::2] != (len(self), 2):
            raise ValueError(f"truth must have shape ({len(self)}, n_sources, 2); got {got}")
        valid = np.isfinite(self.rss_db)
        if not valid.any():
            raise ValueError("rss_db must have a valid reading; all are missing")
        unplaced = valid & ~np.isfinite(self.sensors).all(axis=-1)
        if unplaced.any():
            step, sensor = np.argwhere(unplaced)[0]
            raise ValueError(
                f"{self.name[sensor]!r} has a reading, but no position, in step {step}"
            )

    @classmethod
    def fixed(
        cls, name: Sequence[str], positions: Float, rss_db: Any, time: Float | None = None
    ) -> Network:
        """Return a network of sensors that do not move, positions (n_sensors, 2), m."""
        rss_db = real_numbers("rss_db", rss_db)
        positions = real_numbers("positions", positions)
        sensors = np.broadcast_to(positions, (len(rss_db), *np.shape(positions)))
        distinct = {tuple(position) for position in positions.tolist()}
        if len(distinct) < len(positions):
            warnings.warn("two sensors have the same position", stacklevel=2)
        time = np.arange(len(rss_db), dtype=np.float64) if time is None else time
        return cls(tuple(name), time, rss_db, sensors)

    @property
    def readings(self) -> Float:
        """Levels as log amplitudes, Np, (n_steps, n_sensors)."""
        return db_to_neper(self.rss_db)

    @property
    def extent(self) -> float:
        """Extent of the sensors, the larger of x and y, m; 1 m if they share a position."""
        positions = self.sensors[np.isfinite(self.sensors).all(axis=-1)]
        return float(np.ptp(positions, axis=0).max()) or 1.0

    def __len__(self) -> int:
        return len(self.time)

    def select(self, steps: Any) -> Network:
        """Return the network at some of the steps."""
        parts = {name: getattr(self, name) for name in ("time", "rss_db", "sensors", "truth")}
        return replace(
            self, **{name: part[steps] for name, part in parts.items() if part is not None}
        )

    def readings_at(self, step: int, model: LogNormalRSS) -> tuple[LogNormalRSS, Float]:
        """Return the model with the sensor positions of one step, and its readings, Np.

        Parameters
        ----------
        step : int
        model : LogNormalRSS
            With one entry for each sensor of the network.

        Returns
        -------
        model : LogNormalRSS
        z : ndarray, shape (n_sensors,)
        """
        positions = self.sensors[step]
        is_finite = np.isfinite(positions).all(axis=-1, keepdims=True)
        return model.replace(sensors=np.where(is_finite, positions, 0.0)), self.readings[step]
