"""Methods and scores of benchmarks/fusion.py on exact bearings and short draws."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from station_fusion.draws import Bearings, StationDraw, draw
from station_fusion.heat_map import HeatMap
from station_fusion.intersections import BearingTable, Intersections
from station_fusion.methods import fused, step
from station_fusion.pairs import PairClusters
from station_fusion.scores import HEADER, row, score

from arrivals.scenarios.bounds import posterior_bound
from arrivals.scenarios.metrics.registry import METRICS
from arrivals.scenarios.simulations import StationsRadio, StationsTrial
from arrivals.typing import Float

VARIANCE = np.deg2rad(0.2) ** 2
SOURCES = np.array([[300.0, 300.0], [700.0, 420.0], [450.0, 720.0]])


def trial_of(n_stations: int = 4) -> StationsTrial:
    scene = StationsRadio(n_stations=n_stations, n_sources=3, n_steps=12)
    return scene.sample(np.random.default_rng(0))


def bearings_of(trial: StationsTrial, sources: Float) -> list[Bearings]:
    """Return exact bearings, those of each station in another order."""
    found: list[Bearings] = []
    for n, station in enumerate(trial.stations):
        d = np.roll(sources, n, axis=0) - station.position
        found.append((np.arctan2(d[:, 1], d[:, 0]), np.full(len(d), VARIANCE)))
    return found


def by_x(positions: Float) -> Float:
    return np.asarray(positions[np.argsort(positions[:, 0])])


@cache
def short_draw() -> StationDraw:
    return draw(StationsRadio(n_missing=1, n_steps=12), seed=3)


@pytest.mark.parametrize("n_stations", [3, 4, 6])
def test_intersections_of_exact_bearings_are_the_sources(n_stations: int) -> None:
    trial = trial_of(n_stations)
    estimate = Intersections(trial).step(bearings_of(trial, SOURCES))
    np.testing.assert_allclose(by_x(estimate.position), by_x(SOURCES), atol=1e-5)


def test_intersections_use_each_bearing_once_and_need_three() -> None:
    trial = trial_of()
    found = bearings_of(trial, SOURCES)
    one_less: list[Bearings] = [None, None, *found[2:]]
    assert len(Intersections(trial).step(one_less).position) >= 3  # pairs are all there is
    azimuth, variance = found[0] or ((), ())
    extra: list[Bearings] = [(np.append(azimuth, -2.0), np.append(variance, VARIANCE)), *found[1:]]
    assert Intersections(trial).step(extra).n_found == 3
    alone: list[Bearings] = [found[0], *[(np.zeros(0), np.zeros(0))] * 3]
    assert Intersections(trial).step(alone).n_found == 0
    assert Intersections(trial).step([None] * 4).n_found == 0


def test_bearing_table_pairs_are_of_two_stations() -> None:
    table = BearingTable.of([(np.array([0.0, 0.05]), np.ones(2)), None, (np.ones(1), np.ones(1))])
    np.testing.assert_array_equal(table.pairs(0.1), [[0, -1, 0], [1, -1, 0]])
    assert np.isinf(table.of_members(np.array([0, -1, 0]))[1]).tolist() == [False, True, False]


def test_pair_clusters_keep_labels_and_end_after_three_misses() -> None:
    trial = trial_of()
    method, nothing = PairClusters(trial), (np.zeros(0), np.zeros(0))
    runs = [method.step(bearings_of(trial, SOURCES[:2] + 2.0 * t)) for t in range(6)]
    assert runs[0].n_found == 0  # two hits
    np.testing.assert_allclose(by_x(runs[-1].position), SOURCES[:2] + 10.0, atol=1.0)
    labels = [each.label.tolist() for each in runs[1:]]
    assert labels == [labels[0]] * 5
    n_left = [method.step([nothing] * 4).n_found for _ in range(3)]
    assert n_left == [2, 2, 0]


def test_heat_map_has_a_peak_at_a_single_source() -> None:
    trial = StationsRadio(n_sources=1, n_steps=3, snr_db=30).sample(np.random.default_rng(0))
    estimate = HeatMap(trial).step(list(trial.measurements[0]), 1)
    assert np.linalg.norm(estimate.position[0] - trial.truth[0, 0]) < 20


def test_jpda_of_stone_soup_follows_exact_bearings() -> None:
    pytest.importorskip("stonesoup")
    from station_fusion.stone_soup import StoneSoupJPDA

    trial = trial_of(3)
    method = StoneSoupJPDA(trial)
    runs = [method.step(bearings_of(trial, SOURCES + 2.0 * t)) for t in range(6)]
    np.testing.assert_allclose(by_x(runs[-1].position), by_x(SOURCES + 10.0), atol=1.0)
    assert [each.n_found for each in runs] == [0, 0, 0, 3, 3, 3]
    assert runs[-1].label.tolist() == runs[-2].label.tolist()


def test_replayed_directions_give_the_run_of_the_stations_trackers() -> None:
    one = short_draw()
    replayed, _ = fused(one)
    direct = one.trial.tracker("fused").run(one.trial.measurements)
    np.testing.assert_allclose(replayed.position, direct.position)
    np.testing.assert_array_equal(replayed.label, direct.label)
    assert [found is None for found in one.bearings[5]] == [False, True, False, False]


def test_score_agrees_with_the_metrics_and_the_bound() -> None:
    one = short_draw()
    run, ms = step(one)
    result = score(one.trial, run, ms, one.station_ms)
    names = ("gospa", "distance", "missed", "false")
    assert result.gospa == pytest.approx([METRICS[name](one.trial, run) for name in names])
    assert result.square.mean() / 2 == pytest.approx(METRICS["nees"](one.trial, run))
    trial = one.trial
    drawn = trial.true_stations, trial.truth, trial.power, trial.motion
    largest = np.nanmax(np.trace(posterior_bound(*drawn, trial.P0), axis1=2, axis2=3))
    assert result.bound.max() <= np.sqrt(largest)
    assert row("step", [result, result], [result, result]).count("|") == HEADER.count("|") / 2
