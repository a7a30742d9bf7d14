"""Base of scenes in which several arrays receive sources on a map."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from arrivals.measurement_models import (
    ArraySnapshot,
    LogNormalRSS,
    Station,
    db_to_neper,
)
from arrivals.motion_models import ConstantVelocity
from arrivals.scenarios.base import Scenario
from arrivals.scenarios.simulations.line_arrays import complex_normal
from arrivals.scenarios.simulations.stations.paths import (
    SquareMap,
    activity,
    moving_paths,
)
from arrivals.scenarios.simulations.stations.trial import StationsTrial
from arrivals.trackers.rss.settings import AmplitudePrior
from arrivals.typing import Complex, Float
from arrivals.validation import count, not_negative, number, positive

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])  # of 1 or 4 stations
TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.05], [0.45, 1.0]])  # of 2 or 3
POSITION_SCATTER = 0.02  # of the size, standard deviation of stations about their places
NEAREST = 0.03  # of the size: power does not grow below
CUT_OFF = 0.05  # of the size
MAX_STEPS, MAX_SOURCES, MAX_STATIONS = 100, 6, 8
MAX_SNR_DB = 300
RING = 0.4  # of the size, radius of the RSS sensors about the centre
SHADOWING_DB, LEVEL_STD_DB, ALPHA = 4.0, 3.0, 3.0


@dataclass(frozen=True)
class StationsScenario(Scenario):
    """Sources on a square map, received by circles of 8 sensors; some begin or end in between.

    Amplitudes are circular normal, new in each snapshot and bin; powers decay as 1/R². Stations
    are near the corners of a square or triangle about the centre, with headings of any direction.
    Of 60 steps of 1 s, the second source ends after 38 to 51, the third begins after 8 to 19, and
    the fourth is active from 15 to 44.

    Parameters
    ----------
    n_stations, n_sources : int
        Numbers of stations, at most 8, and of sources, at most 6.
    snr_db : float
        Power of a source half the size of the map away over that of the noise, at one sensor, dB.
    n_steps : int
        Number of time steps of 1 s, at most 100.
    n_missing : int
        Number of stations, from the second on, without measurements in the middle third.
    heading_std, position_std : float
        Standard deviations of unknown constant errors of the headings, rad, and of each coordinate
        of the stations' positions, m; the tracker knows the deviations.
    spread : float
        Side of the square of stations, of the size; 1 for stations at the corners of the map.
    separation : float
        Smallest distance of two sources, of the size.
    n_rss_sensors : int
        Number of sensors of signal strength, in a ring: 4 dB of shadowing, α = 3, levels of
        sources known to 3 dB, the noise is the level of a source at the size of the map.
    """

    truth_unit = "m"
    size: ClassVar[float]
    speed: ClassVar[tuple[float, float]]
    q: ClassVar[float]
    n_stations: int = 4
    n_sources: int = 4
    snr_db: float = 10.0
    n_steps: int = 60
    n_missing: int = 0
    heading_std: float = 0.0
    position_std: float = 0.0
    spread: float = 0.55
    separation: float = 0.12
    n_rss_sensors: int = 0

    def __post_init__(self) -> None:
        count("n_stations", self.n_stations, maximum=MAX_STATIONS)
        count("n_sources", self.n_sources, maximum=MAX_SOURCES)
        count("n_steps", self.n_steps, maximum=MAX_STEPS)
        count("n_missing", self.n_missing, minimum=0, maximum=self.n_stations - 1)
        count("n_rss_sensors", self.n_rss_sensors, minimum=0, maximum=1000)
        if not abs(number("snr_db", self.snr_db)) <= MAX_SNR_DB:
            raise ValueError(f"snr_db must be within ±{MAX_SNR_DB}; got {self.snr_db}")
        for name in ("heading_std", "position_std", "separation"):
            not_negative(name, getattr(self, name))
        positive("spread", self.spread)

    @property
    @abstractmethod
    def measurement(self) -> ArraySnapshot:
        """Measurement model of every station."""

    @property
    def square(self) -> SquareMap:
        """The map."""
        return SquareMap(self.size, self.speed, ConstantVelocity(self.q))

    @property
    def network(self) -> LogNormalRSS | None:
        """Measurement model of the signal strength, if there are such sensors."""
        if not self.n_rss_sensors:
            return None
        phi = 2 * np.pi * np.arange(self.n_rss_sensors) / self.n_rss_sensors
        ring = 0.5 + RING * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        return LogNormalRSS(
            self.size * ring,
            float(db_to_neper(SHADOWING_DB)),
            alpha=ALPHA,
            log_noise=float(-ALPHA / 2 * np.log(self.size)),
            r_min=0.01 * self.size,
            position=(0, 2),
        )

    def paths(self, positions: Float, rng: np.random.Generator) -> Float:
        """Draw the sources, (n_steps, n_sources, 2), m; NaN while inactive.

        Parameters
        ----------
        positions : ndarray, shape (n_stations, 2)
            Positions of the stations, m.
        rng : numpy.random.Generator
            Source of random numbers.
        """
        paths = moving_paths(self.square, self.n_sources, self.n_steps, self.separation, rng)
        paths[~activity(self.n_sources, self.n_steps, rng)] = np.nan
        return paths

    def sample(self, rng: np.random.Generator) -> StationsTrial:
        """Draw one trial."""
        positions = self.size * (0.5 + self.spread * (corners(self.n_stations) - 0.5))
        positions = positions + rng.normal(0, POSITION_SCATTER * self.size, positions.shape)
        headings = rng.uniform(-np.pi, np.pi, self.n_stations)
        truth = self.paths(positions, rng)
        true_headings = headings + self.heading_std * rng.standard_normal(headings.shape)
        true_positions = positions + self.position_std * rng.standard_normal(positions.shape)
        true_stations = self._stations(true_positions, true_headings)
        power, z = self._snapshots(truth, true_stations, rng)
        rss = self.network
        level_std = float(db_to_neper(LEVEL_STD_DB))
        return StationsTrial(
            measurements=z if rss is None else self._with_readings(z, rss, truth, rng),
            truth=truth,
            measurement=self.measurement,
            motion=self.square.motion,
            stations=self._stations(positions, headings),
            true_stations=true_stations,
            power=power,
            area=(0.0, 0.0, self.size, self.size),
            speed_std=0.7 * self.speed[1],
            rss=rss,
            amplitude=None if rss is None else AmplitudePrior(0.0, level_std**2, drift=0.0),
            cut_off=CUT_OFF * self.size,
        )

    def _stations(self, positions: Float, headings: Float) -> tuple[Station, ...]:
        deviations = {"heading_std": self.heading_std, "position_std": self.position_std}
        model = self.measurement
        return tuple(
            Station(model, place, float(heading), name=str(n + 1), **deviations)
            for n, (place, heading) in enumerate(zip(positions, headings, strict=True))
        )

    def _snapshots(
        self, truth: Float, stations: tuple[Station, ...], rng: np.random.Generator
    ) -> tuple[Float, Complex]:
        """Draw powers (n_steps, n_stations, n_sources) and snapshots of the stations."""
        model, far = self.measurement, 0.5 * self.size
        d = truth[:, None] - np.stack([station.position for station in stations])[:, None]
        azimuth = np.arctan2(d[..., 1], d[..., 0])
        each = [station.from_map(azimuth[:, n]) for n, station in enumerate(stations)]
        doa = np.stack(each, axis=1)
        r = np.maximum(np.linalg.norm(d, axis=-1), NEAREST * self.size)
        power = 10 ** (self.snr_db / 10) * (far / r) ** 2
        w = complex_normal(rng, (*doa.shape[:2], *model.shape[:-1], doa.shape[-1]))
        axes = tuple(range(2, 1 + len(model.shape)))  # bins, snapshots
        z = model.simulate(doa, np.sqrt(np.expand_dims(np.nan_to_num(power), axes)) * w, rng)
        middle = slice(self.n_steps // 3, 2 * self.n_steps // 3)
        missing = slice(1, 1 + self.n_missing)
        z[middle, missing] = power[middle, missing] = np.nan
        return power, z

    def _with_readings(
        self, z: Complex, rss: LogNormalRSS, truth: Float, rng: np.random.Generator
    ) -> list[list[Complex | Float]]:
        """Draw the readings, and return each step as snapshots and readings."""
        active = ~np.isnan(truth[..., 0])
        u = float(db_to_neper(LEVEL_STD_DB)) * rng.standard_normal(truth.shape[1])
        theta = np.where(active[..., None], truth, 0.0)
        readings = rss.draw(np.where(active, u, -np.inf), theta, rng)
        return [[*snapshots, xi] for snapshots, xi in zip(z, readings, strict=True)]


def corners(n: int) -> Float:
    """Return n corners of the unit square, of a triangle in it, or of a polygon around it.

    Examples
    --------
    >>> corners(3)
    array([[0.  , 0.  ],
           [1.  , 0.05],
           [0.45, 1.  ]])
    >>> corners(6).round(2)[0]
    array([1.21, 0.5 ])
    """
    if n in (1, 4):
        return SQUARE[:n]
    if n < 4:
        return TRIANGLE[:n]
    phi = 2 * np.pi * np.arange(n) / n
    return np.asarray(0.5 + np.sqrt(0.5) * np.stack([np.cos(phi), np.sin(phi)], axis=-1))
