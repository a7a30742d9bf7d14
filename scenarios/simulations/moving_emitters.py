"""Moving emitters in a sensor network: crossing tracks, births and deaths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.motion_models import ConstantVelocity, MotionModel
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.signal_strength import RSSScenario, lattice
from arrivals.trackers.rss.settings import AmplitudePrior
from arrivals.typing import Float
from arrivals.validation import count


@dataclass(frozen=True)
class MovingSources(RSSScenario):
    """Sources on straight tracks.

    Parameters
    ----------
    n_sources, n_sensors, n_snapshots : int
        As in `RSSScenario`.
    radius : float, optional
        As in `RSSScenario`.
    alpha, noise_db, power_db, power_std_db : float
        As in `RSSScenario`.
    n_steps : int
        Number of time steps, of 1 s.
    q : float
        Noise density of the tracker's `ConstantVelocity`, m²/s³.
    """

    n_steps: int = 40
    q: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        count("n_steps", self.n_steps)

    @property
    def motion(self) -> MotionModel:
        """Constant velocity with acceleration noise."""
        return ConstantVelocity(self.q)


@dataclass(frozen=True)
class StartedSources(MovingSources):
    """Moving sources whose number and initial positions the tracker is given, with an error.

    Parameters
    ----------
    start_std, speed_std : float
        Standard deviations of the initial state, m and m/s; the initial velocity is zero.
    """

    start_std: float = 5.0
    speed_std: float = 2.5

    def start(self, truth: Float, rng: np.random.Generator) -> tuple[Float | None, Float]:
        """Draw initial positions with an error, and zero velocities."""
        x0 = np.zeros((self.n_sources, 4))
        x0[:, ::2] = truth[0] + self.start_std * rng.standard_normal(truth[0].shape)
        return x0, np.diag([self.start_std, self.speed_std] * 2) ** 2


@register("rss_crossing")
@dataclass(frozen=True)
class CrossingSources(StartedSources):
    """Sources at 2 to 2.5 m/s from all sides that pass the centre, and each other, within 10 m.

    Parameters
    ----------
    n_sources, n_sensors, n_snapshots : int
        As in `RSSScenario`.
    radius : float, optional
        As in `RSSScenario`.
    alpha, noise_db, power_db, power_std_db : float
        As in `RSSScenario`.
    n_steps : int
        As in `MovingSources`.
    q : float
        As in `MovingSources`.
    start_std, speed_std : float
        Standard deviations of the initial state, m and m/s; the initial velocity is zero.

    Examples
    --------
    >>> CrossingSources().sample(np.random.default_rng(0)).truth.shape
    (40, 3, 2)
    """

    def positions(self, rng: np.random.Generator) -> Float:
        """Draw the tracks."""
        K = self.n_sources
        phi = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(K) / K
        along = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        across = np.stack([-np.sin(phi), np.cos(phi)], axis=-1)
        t = np.arange(self.n_steps) - (self.n_steps - 1) / 2
        travel = np.multiply.outer(t, rng.uniform(2.0, 2.5, K))
        return np.asarray(travel[..., None] * along + rng.uniform(-5, 5, K)[:, None] * across)


@register("rss_walk")
@dataclass(frozen=True)
class WalkingSources(StartedSources):
    """Sources that move and vary in power as the tracker assumes: a scene to read coverage in.

    Parameters
    ----------
    n_sources, n_sensors, n_snapshots : int
        As in `RSSScenario`.
    radius : float, optional
        As in `RSSScenario`.
    alpha, noise_db, power_db, power_std_db : float
        As in `RSSScenario`.
    n_steps : int
        As in `MovingSources`.
    q : float
        As in `MovingSources`.
    apart : float
        Spacing of the initial positions, m.
    start_std, speed_std : float
        Standard deviations of the tracker's initial state, m and m/s.

    Examples
    --------
    >>> WalkingSources().sample(np.random.default_rng(0)).log_amplitude.shape
    (30, 3)
    """

    n_steps: int = 30
    q: float = 0.02
    apart: float = 90.0
    start_std: float = 3.0
    speed_std: float = 0.5

    def positions(self, rng: np.random.Generator) -> Float:
        """Draw the tracks."""
        F, Q = self.motion.F(np.zeros(4), 1.0), self.motion.Q(1.0)
        x = np.zeros((self.n_steps, self.n_sources, 4))
        x[0, :, ::2] = lattice(self.n_sources, self.apart, centred=False)
        x[0, :, 1::2] = self.speed_std * rng.standard_normal((self.n_sources, 2))
        for step in range(1, self.n_steps):
            noise = rng.multivariate_normal(np.zeros(4), Q, self.n_sources)
            x[step] = x[step - 1] @ F.T + noise
        return np.asarray(x[..., ::2])

    def log_amplitudes(self, rng: np.random.Generator) -> Float:
        """Draw random walks of u, Np, (n_steps, n_sources)."""
        steps = np.sqrt(AmplitudePrior().drift) * rng.standard_normal(
            (self.n_steps, self.n_sources)
        )
        steps[0] = super().log_amplitudes(rng)
        return np.cumsum(steps, axis=0)


@register("rss_birth_death")
@dataclass(frozen=True)
class BirthsAndDeaths(MovingSources):
    """Sources at 1 m/s with unknown births and deaths.

    Parameters
    ----------
    n_sources, n_sensors, n_snapshots : int
        As in `RSSScenario`.
    radius : float, optional
        As in `RSSScenario`.
    alpha, noise_db, power_db, power_std_db : float
        As in `RSSScenario`.
    n_steps : int
        As in `MovingSources`.
    q : float
        As in `MovingSources`.
    apart : float
        Spacing of the centres of the tracks, m.

    Notes
    -----
    Every source is active for half to nine tenths of the time, the first from the start.

    Examples
    --------
    >>> truth = BirthsAndDeaths().sample(np.random.default_rng(0)).truth
    >>> np.isfinite(truth[::20, :, 0]).sum(axis=1)
    array([1, 4, 4])
    """

    n_sources: int = 4
    n_steps: int = 60
    apart: float = 60.0

    def positions(self, rng: np.random.Generator) -> Float:
        """Draw the tracks, and the steps in which the sources are active."""
        K, T = self.n_sources, self.n_steps
        centres = lattice(K, self.apart, centred=True)
        rotation = rng.uniform(0, 2 * np.pi)
        c, s = np.cos(rotation), np.sin(rotation)
        phi = rng.uniform(0, 2 * np.pi, K)
        t = np.arange(T) - (T - 1) / 2
        travel = 0.5 * np.multiply.outer(t, np.stack([np.cos(phi), np.sin(phi)], axis=-1))
        truth = centres @ np.array([[c, s], [-s, c]]) + travel
        length = rng.uniform(0.5, 0.9, K) * T
        first = np.floor(rng.uniform(0, T - length))
        first[0] = 0
        on = (np.arange(T)[:, None] >= first) & (np.arange(T)[:, None] < first + length)
        truth[~on] = np.nan
        return np.asarray(truth)

    def start(self, truth: Float, rng: np.random.Generator) -> tuple[Float | None, Float]:
        """Return the covariance of a new source, without initial states."""
        return None, np.diag([100.0, 1.0, 100.0, 1.0])
