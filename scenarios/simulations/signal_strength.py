"""Several sources in a sensor network: the simulations of the paper on signal strength.

The paper omits target positions, number of snapshots and noise. Our reading: 100 sensors, uniform
in a disc of 100 m; 50 snapshots; noise 40 dB; targets on a triangle of side 30 m, or at the centre
and the corners of a hexagon of 50 m.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from arrivals.measurement_models import AveragedEnvelope, LogNormalRSS, db_to_neper
from arrivals.motion_models import MotionModel, RandomWalk
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.trackers.rss.settings import AmplitudePrior
from arrivals.typing import Bool, Float
from arrivals.validation import count, number, one_of, positive

MAX_SOURCES, MAX_SENSORS = 50, 100_000
Start = Literal["prior", "random", "near"]


@dataclass(frozen=True, eq=False)
class RSSTrial(Trial):
    """One draw of positions, powers and readings, with the prior of a tracker.

    Parameters
    ----------
    measurements, truth : ndarray
        As in `Trial`; readings in Np.
    measurement : LogNormalRSS
        As in `Trial`.
    motion : MotionModel
        As in `Trial`.
    log_amplitude : ndarray, shape (n_sources,) or (n_steps, n_sources)
        True u, Np.
    x0 : ndarray, shape (n_sources, n), or None
        Initial states; None for an unknown number of sources.
    P0 : ndarray, shape (n, n)
        Covariance of an initial state.
    mu0, v0 : float
        Mean and variance of the log amplitudes, Np and Np².
    """

    measurement: LogNormalRSS
    log_amplitude: Float
    x0: Float | None
    P0: Float
    mu0: float
    v0: float

    def tracker_arguments(self) -> dict[str, Any]:
        """Return models and priors by the names of a tracker's parameters."""
        amplitude = AmplitudePrior(mean=self.mu0, variance=self.v0)
        prior = {"x0": self.x0, "P0": self.P0, "amplitude": amplitude}
        return super().tracker_arguments() | prior


@dataclass(frozen=True)
class RSSScenario(Scenario):
    """Sources in a disc of sensors.

    Parameters
    ----------
    n_sources : int
        Number of sources, at most 50.
    n_sensors : int
        Number of sensors, at most 100 000.
    radius : float, optional
        Radius of the disc of sensors, m. If None, 100 m for up to 18 sources, and the same area
        per source for more.
    n_snapshots : int
        Number of snapshots N of a reading.
    alpha : float
        Path-loss exponent.
    noise_db, power_db, power_std_db : float
        Noise, and mean and standard deviation of the sources' powers, dB.
    """

    truth_unit = "m"
    n_sources: int = 3
    n_sensors: int = 100
    radius: float | None = None
    n_snapshots: int = 50
    alpha: float = 2.0
    noise_db: float = 40.0
    power_db: float = 80.0
    power_std_db: float = 3.0

    def __post_init__(self) -> None:
        for name, largest in (("n_sources", MAX_SOURCES), ("n_sensors", MAX_SENSORS)):
            if count(name, getattr(self, name)) > largest:
                raise ValueError(f"{name} must be at most {largest}; got {getattr(self, name)}")
        if self.radius is not None:
            positive("radius", self.radius)
        number("noise_db", self.noise_db)
        number("power_db", self.power_db)
        positive("power_std_db", self.power_std_db)

    @property
    def disc(self) -> float:
        """Radius of the disc of sensors, m."""
        if self.radius is not None:
            return self.radius
        return 100.0 * max(1.0, float(np.sqrt(self.n_sources / 18)))

    @property
    @abstractmethod
    def motion(self) -> MotionModel:
        """Motion model of the sources."""

    @abstractmethod
    def positions(self, rng: np.random.Generator) -> Float:
        """Draw positions, (n_steps, n_sources, 2), m; NaN while a source is inactive."""

    @abstractmethod
    def start(self, truth: Float, rng: np.random.Generator) -> tuple[Float | None, Float]:
        """Draw the initial states of a tracker, and return them with their covariance."""

    def network(self, rng: np.random.Generator) -> LogNormalRSS:
        """Draw the sensors."""
        return self.measurement(in_disc(rng, (self.n_sensors,), self.disc))

    def measurement(self, sensors: Float) -> LogNormalRSS:
        """Return the measurement model of sensors at given positions (n_sensors, 2), m."""
        return LogNormalRSS(
            sensors,
            AveragedEnvelope(self.n_snapshots),
            alpha=self.alpha,
            log_noise=float(db_to_neper(self.noise_db)),
            position=(0, 1) if self.motion.dim_x == 2 else (0, 2),
        )

    @property
    def mu0(self) -> float:
        """Mean of the log amplitudes, Np."""
        return float(db_to_neper(self.power_db))

    @property
    def v0(self) -> float:
        """Variance of the log amplitudes, Np²."""
        return float(db_to_neper(self.power_std_db)) ** 2

    def log_amplitudes(self, rng: np.random.Generator) -> Float:
        """Draw constant u of the sources, Np, (n_sources,)."""
        return np.asarray(self.mu0 + np.sqrt(self.v0) * rng.standard_normal(self.n_sources))

    def sample(self, rng: np.random.Generator) -> RSSTrial:
        """Draw one trial."""
        model, truth = self.network(rng), self.positions(rng)
        u = self.log_amplitudes(rng)
        active: Bool = np.isfinite(truth[..., 0])
        theta = np.where(active[..., None], truth, 0.0)
        z = model.draw(np.where(active, u, -np.inf), theta, rng)
        x0, P0 = self.start(truth, rng)
        return RSSTrial(z, truth, model, self.motion, u, x0, P0, self.mu0, self.v0)


def in_disc(rng: np.random.Generator, shape: tuple[int, ...], radius: float) -> Float:
    """Draw points uniformly in a disc around the origin, (*shape, 2).

    Examples
    --------
    >>> bool((np.hypot(*in_disc(np.random.default_rng(0), (50,), 3.0).T) <= 3.0).all())
    True
    """
    r = radius * np.sqrt(rng.random(shape))
    phi = 2 * np.pi * rng.random(shape)
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)


def lattice(n: int, spacing: float, centred: bool) -> Float:
    """Return the n points of a triangular lattice that are nearest to the origin, (n, 2).

    Parameters
    ----------
    n : int
        Number of points.
    spacing : float
        Distance between neighbours, m.
    centred : bool
        Whether the origin is a point of the lattice, or the centre of a triangle.

    Examples
    --------
    >>> np.hypot(*lattice(7, 50.0, centred=True).T).round(6)
    array([ 0., 50., 50., 50., 50., 50., 50.])
    >>> np.hypot(*lattice(3, 30.0, centred=False).T).round(3)
    array([17.321, 17.321, 17.321])
    """
    k = np.arange(-n, n + 1)
    i, j = (axis.ravel() for axis in np.meshgrid(k, k))
    points = spacing * np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=-1)
    if not centred:
        points = points - spacing * np.array([0.5, np.sqrt(1 / 12)])
    return points[np.argsort(np.hypot(*points.T).round(6), kind="stable")[:n]]


@dataclass(frozen=True)
class FixedSources(RSSScenario):
    """Static sources on a triangular lattice, one reading a sensor.

    Parameters
    ----------
    n_sources, n_sensors, n_snapshots : int
        As in `RSSScenario`.
    radius : float, optional
        As in `RSSScenario`.
    alpha, noise_db, power_db, power_std_db : float
        As in `RSSScenario`.
    spacing : float
        Distance between neighbours, m.
    prior_std : float
        Standard deviation of the position prior, each coordinate, m.
    start_at : {"prior", "random", "near"}
        Distribution of the prior's mean, which is the start of the search: around the truth with
        `prior_std`, uniform in the disc, or uniform within half its radius.
    """

    spacing: float = 30.0
    prior_std: float = 20.0
    start_at: Start = "prior"

    centred = False

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("spacing", self.spacing)
        positive("prior_std", self.prior_std)
        one_of("start_at", self.start_at, ("prior", "random", "near"))

    @property
    def motion(self) -> MotionModel:
        """Random walk without noise."""
        return RandomWalk(q=0.0)

    def positions(self, rng: np.random.Generator) -> Float:
        """Return the points of the lattice."""
        return lattice(self.n_sources, self.spacing, self.centred)[None]

    def start(self, truth: Float, rng: np.random.Generator) -> tuple[Float | None, Float]:
        """Draw the prior's mean."""
        return self.starts(truth[0], rng), self.prior_std**2 * np.eye(2)

    def starts(self, theta: Float, rng: np.random.Generator) -> Float:
        """Draw means of the prior for positions (..., n_sources, 2)."""
        if self.start_at == "prior":
            return np.asarray(theta + self.prior_std * rng.standard_normal(theta.shape))
        radius = self.disc * (1.0 if self.start_at == "random" else 0.5)
        return in_disc(rng, theta.shape[:-1], radius)


@register("rss_table1_k3")
@dataclass(frozen=True)
class Table1K3(FixedSources):
    """Three close sources: a triangle of side 30 m; the prior is 20 m off, or random.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, Fig. 4 (a)-(d) and Table 1.

    Examples
    --------
    >>> trial = Table1K3().sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.truth.shape
    ((1, 100), (1, 3, 2))
    >>> tracker = trial.tracker("rss_vb")
    >>> tracker.update(trial.measurements[0])
    >>> tracker.estimate.position.shape
    (3, 2)
    """


@register("rss_table1_k7")
@dataclass(frozen=True)
class Table1K7(FixedSources):
    """Seven sources: the centre and the corners of a hexagon of 50 m; the prior is 10 m off.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, Fig. 4 (e)-(h) and Table 1.
    """

    n_sources: int = 7
    spacing: float = 50.0
    prior_std: float = 10.0

    centred = True
