"""Trial of several stations: measurements, truth, and nominal and true stations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot, LogNormalRSS, Station
from arrivals.motion_models import ConstantVelocity
from arrivals.scenarios.base import Trial
from arrivals.trackers.rss.settings import AmplitudePrior
from arrivals.typing import Float


@dataclass(frozen=True, eq=False, kw_only=True)
class StationsTrial(Trial):
    """One draw of sources and of the snapshots of several stations.

    Parameters
    ----------
    measurements : ndarray, shape (n_steps, n_stations, ...), or list of lists
        Snapshots, NaN where a station is missing; with signal strength lists of the stations'
        snapshots and the readings, Np.
    truth : ndarray, shape (n_steps, n_sources, 2)
        Positions, m; NaN while a source is inactive.
    measurement : ArraySnapshot
        Measurement model of every station.
    motion : ConstantVelocity
        Motion model of the sources.
    stations, true_stations : tuple of Station
        Stations with their nominal positions and headings, which trackers have, and the true ones.
    power : ndarray, shape (n_steps, n_stations, n_sources)
        Mean power of the sources at one sensor; NaN where a station is missing or a source is
        inactive.
    area : (float, float, float, float)
        Smallest x and y, and largest x and y, m.
    speed_std : float
        Standard deviation of a new source's velocity, each coordinate, m/s.
    rss : LogNormalRSS, optional
        Model of the readings.
    amplitude : AmplitudePrior, optional
        Prior of the sources' levels in the readings.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> trial = create("stations_radio", n_stations=3).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.truth.shape, trial.cut_off
    ((60, 3, 10, 8), (60, 4, 2), 50.0)
    """

    measurements: Any
    measurement: ArraySnapshot
    motion: ConstantVelocity
    stations: tuple[Station, ...]
    true_stations: tuple[Station, ...]
    power: Float
    area: tuple[float, float, float, float]
    speed_std: float
    rss: LogNormalRSS | None = None
    amplitude: AmplitudePrior | None = None

    @property
    def size(self) -> float:
        """Longer side of the area, m."""
        x0, y0, x1, y1 = self.area
        return max(x1 - x0, y1 - y0)

    @property
    def P0(self) -> Float:
        """Covariance of the state x, vx, y, vy of a new source: anywhere in the area, (4, 4)."""
        return np.diag([self.size, self.speed_std] * 2) ** 2

    def tracker_arguments(self) -> dict[str, Any]:
        """Return models, stations and area by the names of a tracker's parameters."""
        own = {"stations": self.stations, "area": self.area, "speed_std": self.speed_std}
        if self.rss is not None:
            own |= {"rss": self.rss, "amplitude": self.amplitude}
        return super().tracker_arguments() | own
