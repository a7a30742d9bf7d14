"""One draw of a scene with the directions and bearings of its stations, shared by all methods."""

from __future__ import annotations

import time
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.simulations.stations import StationsTrial
from arrivals.scenarios.simulations.stations.base import StationsScenario
from arrivals.trackers import DirectionEstimate, DirectionTracker, create
from arrivals.trackers.fusion.stations.single_step_bearings import bearings
from arrivals.typing import Float

Bearings: TypeAlias = tuple[Float, Float] | None  # azimuths, rad, and variances, rad²
INFLATION = 1.3**2  # of variances


class StationDraw(NamedTuple):
    """A trial with the results of its stations.

    Parameters
    ----------
    trial : StationsTrial
        The draw.
    directions : list of list of DirectionEstimate or None
        By step and station; None where a station is missing.
    bearings : list of list of (ndarray, ndarray) or None
        Azimuths on the map, rad, and variances, rad², by step and station.
    station_ms : float
        CPU time of all stations' trackers, ms a step.
    """

    trial: StationsTrial
    directions: list[list[DirectionEstimate | None]]
    bearings: list[list[Bearings]]
    station_ms: float


def draw(scenario: StationsScenario, seed: int, tracker: str = "svalse") -> StationDraw:
    """Draw a trial, and run a tracker of directions at every station."""
    trial = scenario.sample(np.random.default_rng(seed))
    started = time.process_time()
    tracked = [_tracked(trial, n, tracker) for n in range(len(trial.stations))]
    ms = 1e3 * (time.process_time() - started) / len(trial.truth)
    directions = [list(step) for step in zip(*tracked, strict=True)]
    found = [
        [_bearings(trial, t, n, estimate) for n, estimate in enumerate(step)]
        for t, step in enumerate(directions)
    ]
    return StationDraw(trial, directions, found, ms)


def _tracked(trial: StationsTrial, n: int, name: str) -> list[DirectionEstimate | None]:
    """Return the directions of station n in every step."""
    tracker = create(name, measurement=trial.measurement)
    assert isinstance(tracker, DirectionTracker)
    found: list[DirectionEstimate | None] = []
    for step in trial.measurements:
        is_missing = bool(np.isnan(step[n]).all())
        tracker.predict()
        tracker.update(None if is_missing else step[n])
        found.append(None if is_missing else tracker.estimate)
    return found


def _bearings(trial: StationsTrial, t: int, n: int, estimate: DirectionEstimate | None) -> Bearings:
    if estimate is None:
        return None
    doa, covariance, _ = bearings(trial.measurement, trial.measurements[t][n], estimate.doa)
    return trial.stations[n].to_map(doa)[..., 0], INFLATION * covariance.diagonal()


class Replay(DirectionTracker):
    """Tracker of a station that reports the directions found before for the same snapshots."""

    def __init__(self, draw: StationDraw, station: int) -> None:
        self.draw, self.station = draw, station
        self._known = {
            step[station].tobytes(): estimates[station]
            for step, estimates in zip(draw.trial.measurements, draw.directions, strict=True)
        }
        self.reset()

    @property
    def n_slots(self) -> int:
        """Largest number of directions."""
        return 20

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Do nothing."""

    def update(self, z: ArrayLike | None) -> None:
        """Report what was found for these snapshots."""
        estimate = None if z is None else self._known[np.asarray(z).tobytes()]
        if estimate is not None:
            self.report_estimate(estimate)

    def __deepcopy__(self, memo: dict[int, object]) -> Replay:
        other = Replay.__new__(Replay)
        other.__dict__.update(self.__dict__)
        return other
