"""Sources on a map that several arrays receive: radio, sound, and false crossings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.stations.base import StationsScenario
from arrivals.scenarios.simulations.stations.paths import ghost_paths
from arrivals.typing import Float

SPEED_OF_LIGHT, SPEED_OF_SOUND = 299_792_458.0, 343.0  # m/s


@register("stations_radio")
@dataclass(frozen=True)
class StationsRadio(StationsScenario):
    """Transmitters at 4 to 12 m/s on 1 km: 433 MHz, ten snapshots a step.

    Parameters
    ----------
    n_stations, n_sources : int
        As in `StationsScenario`.
    snr_db : float
        As in `StationsScenario`.
    n_steps, n_missing : int
        As in `StationsScenario`.
    heading_std, position_std : float
        As in `StationsScenario`.
    spread, separation : float
        As in `StationsScenario`.
    n_rss_sensors : int
        As in `StationsScenario`.

    Examples
    --------
    >>> trial = StationsRadio(n_sources=2, n_missing=1).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, int(np.isnan(trial.measurements).all(axis=(2, 3)).sum())
    ((60, 4, 10, 8), 20)
    """

    size = 1000.0
    speed = (4.0, 12.0)
    q = 0.05

    @property
    def measurement(self) -> ArraySnapshot:
        """Circle of 8 sensors of radius 0.65 λ."""
        wavelength = SPEED_OF_LIGHT / 433e6
        return ArraySnapshot(SensorArray.uca(8, 0.65 * wavelength), wavelength, n_snapshots=10)


@register("stations_sound")
@dataclass(frozen=True)
class StationsSound(StationsScenario):
    """Talkers at 0.3 to 1 m/s on 30 m: ten bins from 500 to 1500 Hz, one snapshot a step.

    Parameters
    ----------
    n_stations, n_sources : int
        As in `StationsScenario`.
    snr_db : float
        As in `StationsScenario`.
    n_steps, n_missing : int
        As in `StationsScenario`.
    heading_std, position_std : float
        As in `StationsScenario`.
    spread, separation : float
        As in `StationsScenario`.
    n_rss_sensors : int
        As in `StationsScenario`.

    Examples
    --------
    >>> trial = StationsSound().sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.cut_off
    ((60, 4, 10, 8), 1.5)
    """

    size = 30.0
    speed = (0.3, 1.0)
    q = 0.002

    @property
    def measurement(self) -> ArraySnapshot:
        """Circle of 8 microphones of radius 0.15 m."""
        wavelengths = SPEED_OF_SOUND / np.linspace(500, 1500, 10)
        return ArraySnapshot(SensorArray.uca(8, 0.15), wavelengths.tolist())


@register("stations_ghost")
@dataclass(frozen=True)
class StationsGhost(StationsRadio):
    """Transmitters at rest, each on a line from one station through one point.

    In every step bearings of as many stations as there are sources cross at that point, where no
    source is.

    Parameters
    ----------
    n_stations, n_sources : int
        As in `StationsScenario`; at most as many sources as stations.
    snr_db : float
        As in `StationsScenario`.
    n_steps, n_missing : int
        As in `StationsScenario`.
    heading_std, position_std : float
        As in `StationsScenario`.
    spread, separation : float
        As in `StationsScenario`.
    n_rss_sensors : int
        As in `StationsScenario`.

    Examples
    --------
    >>> StationsGhost().sample(np.random.default_rng(0)).truth.shape
    (60, 3, 2)
    """

    n_stations: int = 3
    n_sources: int = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.n_sources > self.n_stations:
            raise ValueError(
                f"n_sources must be at most n_stations, {self.n_stations}; got {self.n_sources}"
            )

    def paths(self, positions: Float, rng: np.random.Generator) -> Float:
        """Draw the sources, all of which are active."""
        stations = positions[: self.n_sources]
        return ghost_paths(self.square, stations, self.n_steps, self.separation, rng)
