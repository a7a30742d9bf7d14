"""Positions from several arrays beyond the scenes that `fused` was made for.

    python benchmarks/fusion_limits.py --seeds 100 110 --cells lines turns

Line arrays (two images of each bearing), sources that turn, echoes from a wall, more stations and
sources, steps at irregular times. GOSPA with p = 1 and a cut-off of 5 % of the map, against `step`.
"""

from __future__ import annotations

import argparse
import copy
import os
from dataclasses import dataclass, replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import joblib
import numpy as np
from station_fusion.draws import draw
from station_fusion.methods import fused, step
from station_fusion.scores import HEADER, Score, row, score

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import ConstantVelocity, CoordinatedTurn
from arrivals.scenarios.simulations.stations import StationsRadio, StationsTrial
from arrivals.scenarios.simulations.stations.base import StationsScenario
from arrivals.scenarios.simulations.stations.scenes import SPEED_OF_LIGHT
from arrivals.trackers import Run
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float

WAVELENGTH = SPEED_OF_LIGHT / 433e6


@dataclass(frozen=True)
class Lines(StationsRadio):
    """Lines of 8 sensors, half a wavelength apart, in place of circles."""

    @property
    def measurement(self) -> ArraySnapshot:
        """Line of 8 sensors."""
        return ArraySnapshot(SensorArray.ula(8, 0.5 * WAVELENGTH), WAVELENGTH, n_snapshots=10)


@dataclass(frozen=True)
class Turns(StationsRadio):
    """Sources that turn by 3 to 6 degrees a second for 10 to 20 s, twice."""

    def paths(self, positions: Float, rng: np.random.Generator) -> Float:
        """Draw paths with turns that stay on the map."""
        paths: list[Float] = []
        while len(paths) < self.n_sources:
            path = self._path(rng)
            inside = (path > 0.03 * self.size) & (path < 0.97 * self.size)
            least = 0.12 * self.size
            apart = [np.linalg.norm(path - other, axis=1).min() > least for other in paths]
            if inside.all() and all(apart):
                paths.append(path)
        return np.stack(paths, axis=1)

    def _path(self, rng: np.random.Generator) -> Float:
        rate = np.zeros(self.n_steps)
        for first in (10, 35):
            n = rng.integers(10, 20)
            rate[first : first + n] = rng.choice([-1, 1]) * np.deg2rad(rng.uniform(3, 6))
        heading = rng.uniform(-np.pi, np.pi) + np.cumsum(rate)
        speed = rng.uniform(*self.speed)
        velocity = speed * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        start = rng.uniform(0.2, 0.8, 2) * self.size
        return np.asarray(start + np.cumsum(velocity, axis=0))


@dataclass(frozen=True)
class Echoes(StationsRadio):
    """A wall behind each station reflects the first source, 6 dB weaker, from a fixed direction."""

    def sample(self, rng: np.random.Generator) -> StationsTrial:
        """Draw a trial with one false arrival a station."""
        trial = super().sample(rng)
        z = np.array(trial.measurements)
        wall = rng.uniform(-np.pi, np.pi, self.n_stations)
        w = rng.standard_normal((*z.shape[:3], 2)) @ [1, 1j] / np.sqrt(2)
        power = trial.power[..., 0] / 10**0.6
        model = self.measurement
        for s, azimuth in enumerate(wall):
            a = model.steering_vector(azimuth)
            z[:, s] += np.sqrt(power[:, s])[:, None, None] * w[:, s, :, None] * a
        return replace(trial, measurements=z)


CELLS: dict[str, StationsScenario] = {
    "lines": Lines(),
    "lines3": Lines(n_stations=3),
    "turns": Turns(n_sources=2),
    "echoes": Echoes(),
    "six_stations": StationsRadio(n_stations=6),
    "eight_stations": StationsRadio(n_stations=8),
    "six_sources": StationsRadio(n_stations=4, n_sources=6, snr_db=20.0),
    "six_by_six": StationsRadio(n_stations=6, n_sources=6, snr_db=20.0),
}


def compare(cell: str, seed: int) -> dict[str, Score]:
    """Return the scores of the forms of `fused`, and of `step`, on one draw."""
    one = draw(CELLS[cell], seed)
    runs = {"fused": fused(one), "step": step(one)}
    if cell == "turns":
        runs["fused, q = 2"] = fused(one, motion=ConstantVelocity(q=2.0))
        runs["fused, turn model"] = fused(one, motion=CoordinatedTurn(0.3, 1e-3))
    if cell == "six_stations":
        runs["fused, 2 of 3 steps"] = irregular(one.trial, seed)
    return {name: score(one.trial, run, ms, one.station_ms) for name, (run, ms) in runs.items()}


def irregular(trial: StationsTrial, seed: int) -> tuple[Run, float]:
    """Run `fused` on random steps only, each after the time since the last one."""
    rng = np.random.default_rng([seed, 1])
    tracker, passed = trial.tracker("fused"), 0.0
    recorder = RunRecorder(type(tracker.estimate))
    for t, z in enumerate(trial.measurements):
        passed += 1.0
        at = tracker
        if rng.random() < 2 / 3 or t == 0:
            tracker.predict(dt=passed)
            tracker.update(z)
            passed = 0.0
        else:
            at = copy.deepcopy(tracker)
            at.predict(dt=passed)
        recorder.add(at.estimate, at.x)
    return recorder.run(dt=1.0, elapsed=0.0), np.nan


def main() -> None:
    """Print a table for each cell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs=2, type=int, default=(100, 110), metavar=("A", "B"))
    parser.add_argument("--cells", nargs="*", default=list(CELLS), choices=CELLS, metavar="CELL")
    options = parser.parse_args()
    with joblib.Parallel(2) as parallel:
        for cell in options.cells:
            task = joblib.delayed(compare)
            results = parallel(task(cell, seed) for seed in range(*options.seeds))
            print(f"\n{cell}\n\n{HEADER}")
            for name in results[0]:
                reference = [each["step"] for each in results]
                print(row(name, [each[name] for each in results], reference), flush=True)


if __name__ == "__main__":
    main()
