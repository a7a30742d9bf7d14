"""Methods of the comparison: from a draw to a run of positions and the CPU time of a step."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from arrivals.trackers import PositionEstimate, Run
from arrivals.trackers.run import RunRecorder
from station_fusion.draws import Replay, StationDraw
from station_fusion.heat_map import HeatMap
from station_fusion.intersections import Intersections
from station_fusion.pairs import PairClusters
from station_fusion.stone_soup import StoneSoupJPDA

Method = Callable[[StationDraw], tuple[Run, float]]


def _timed(estimates: Iterator[PositionEstimate]) -> tuple[Run, float]:
    """Return the run of estimates, one a step, and CPU ms a step."""
    recorder, n = RunRecorder(PositionEstimate), 0
    started = time.process_time()
    for estimate in estimates:
        recorder.add(estimate, np.zeros(0))
        n += 1
    elapsed = time.process_time() - started
    return recorder.run(dt=1.0, elapsed=elapsed), 1e3 * elapsed / n


def step(draw: StationDraw) -> tuple[Run, float]:
    """Intersect the bearings of each step alone."""
    method = Intersections(draw.trial)
    return _timed(method.step(found) for found in draw.bearings)


def pairs(draw: StationDraw) -> tuple[Run, float]:
    """Cluster crossings of pairs, before nearest-neighbour Kalman filters."""
    method = PairClusters(draw.trial)
    return _timed(method.step(found) for found in draw.bearings)


def heat_map(draw: StationDraw) -> tuple[Run, float]:
    """Find as many peaks of summed spectra as there are sources."""
    method, n = HeatMap(draw.trial), len(draw.trial.stations)
    numbers = (~np.isnan(draw.trial.truth[..., 0])).sum(axis=1)
    steps = zip(draw.trial.measurements, numbers, strict=True)
    return _timed(method.step(list(z[:n]), int(k)) for z, k in steps)


def jpda(draw: StationDraw) -> tuple[Run, float]:
    """Run JPDA of Stone Soup, begun by `step`."""
    method = StoneSoupJPDA(draw.trial)
    return _timed(method.step(found) for found in draw.bearings)


def fused(draw: StationDraw, **settings: Any) -> tuple[Run, float]:
    """Run the library's tracker on directions of the stations that are computed before."""
    trackers = [Replay(draw, n) for n in range(len(draw.trial.stations))]
    tracker = draw.trial.tracker("fused", **{"trackers": trackers} | settings)
    started = time.process_time()
    run = tracker.run(draw.trial.measurements)
    return run, 1e3 * (time.process_time() - started) / len(run)


METHODS: dict[str, Method] = {
    "fused": fused,
    "step": step,
    "pairs": pairs,
    "heat_map": heat_map,
    "jpda": jpda,
}
