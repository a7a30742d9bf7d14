"""Tracks of `fused`: laws, gaps, lines, late waves, mixed stations, changed parameters."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, LogNormalRSS, SensorArray, Station
from arrivals.motion_models import ConstantVelocity, MotionModel, RandomWalk, VonMisesWalk
from arrivals.trackers import (
    SVALSE,
    AmplitudePrior,
    BearingDetection,
    Fused,
    GlobalHypotheses,
    PeaksGNN,
)
from arrivals.typing import Float

PLACES = np.array([[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0], [0.0, 1000.0]])
MOTION = ConstantVelocity(q=0.05)
START = np.array([[300.0, 400.0], [700.0, 450.0]])
SPEED = np.array([[5.0, 2.0], [-4.0, 3.0]])
STD = np.deg2rad(1.0)


def paths(n_steps: int = 20) -> Float:
    return np.asarray(START + np.arange(n_steps)[:, None, None] * SPEED)


def bearings(truth: Float, places: Float = PLACES, seed: int = 0) -> list[list[Any]]:
    """Return steps of azimuths with errors of 1 degree, and their variances."""
    rng = np.random.default_rng(seed)
    d = truth[:, None] - places[:, None]
    azimuth = np.arctan2(d[..., 1], d[..., 0]) + STD * rng.standard_normal(d.shape[:-1])
    return [[(each, np.full(each.size, STD**2)) for each in step] for step in azimuth]


def stations(places: Float = PLACES, **options: Any) -> list[Station]:
    return [Station(None, place, **options) for place in places]


def fused(places: Float = PLACES, **options: Any) -> Fused:
    return Fused(MOTION, stations(places), **({"speed_std": 6.0} | options))


def mean_error(position: Float, truth: Float) -> float:
    d = np.linalg.norm(position[:, None] - truth, axis=-1)
    return float(d.min(axis=0).mean())


def test_run_of_two_sources_has_two_labels_at_their_places() -> None:
    run = fused().run(bearings(paths()))
    assert (run.n_found[2:] == 2).all()
    assert {tuple(sorted(row[:2])) for row in run.label[2:]} == {(0, 1)}
    assert mean_error(run.position[-1], paths()[-1]) < 10
    assert np.abs(np.sort(run.velocity[-1], axis=0) - np.sort(SPEED, axis=0)).max() < 2.5
    assert (run.received[5:, :2] > 0.9).all()


def test_turned_and_shifted_map_turns_and_shifts_tracks() -> None:
    turn, shift = 0.7, np.array([300.0, -5000.0])
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    z = bearings(paths())
    one = fused(area=(-1000.0, -1000.0, 2000.0, 2000.0)).run(z).position
    turned = [[(a + turn, v) for a, v in step] for step in z]
    area = (-2000.0, -7000.0, 4000.0, -3000.0)
    other = fused(PLACES @ R.T + shift, area=area).run(turned).position
    # the sizes of the areas differ, which changes the odds of births, not the estimates
    assert other[5:] == pytest.approx(one[5:] @ R.T + shift, rel=1e-3)


def test_stations_in_reverse_order_give_the_same_sources() -> None:
    z = bearings(paths())
    one = fused().run(z)
    other = fused(PLACES[::-1]).run([step[::-1] for step in z])
    assert (one.n_found[1:] == other.n_found[1:]).all()
    d = np.linalg.norm(one.position[-1][:, None] - other.position[-1], axis=-1)
    assert d.min(axis=1).max() < 1.0


def test_gap_of_all_stations_keeps_labels_and_widens() -> None:
    z = bearings(paths())
    run = fused().run([*z[:10], *[None] * 5, *z[15:]])
    assert set(run.label[-1]) == set(run.label[9])
    spread = np.trace(run.covariance[[9, 13]], axis1=-2, axis2=-1)
    assert (spread[1] > spread[0]).all()
    assert (run.existence[13] < run.existence[9]).all()


def test_missing_station_counts_neither_for_nor_against_a_track() -> None:
    z = bearings(paths())
    silent = [[*step[:3], None] for step in z]
    found = fused().run(silent)
    assert (found.n_found[2:] == 2).all()
    assert (found.received[..., 3] == 0).all()
    empty = [[*step[:3], ([], [])] for step in z]
    assert fused().run(empty).existence[2:4, :2].max() < found.existence[2:4, :2].min()


def test_source_that_ends_is_dropped_and_a_new_one_has_a_new_label() -> None:
    truth = paths(30)
    z = bearings(truth[:, :1], seed=1)
    later = bearings(truth[:, 1:], seed=2)
    run = fused().run([*z[:12], *[[([], [])] * 4] * 5, *later[17:]])
    assert run.n_found[11] == 1
    assert run.n_found[16] == 0
    assert run.n_found[-1] == 1
    assert run.label[-1, 0] not in run.label[:12]


def test_false_bearings_give_no_track() -> None:
    rng = np.random.default_rng(5)
    z = [
        [(rng.uniform(-np.pi, np.pi, rng.poisson(0.5)), STD**2) for _ in PLACES] for _ in range(60)
    ]
    assert fused().run(z).n_found.mean() < 0.1


def test_update_bearings_equals_update_of_stations_without_a_model() -> None:
    one, other = fused(), fused()
    for z in bearings(paths(5)):
        one.predict()
        one.update(z)
        other.predict()
        other.update_bearings(z)
    assert one.estimate.position == pytest.approx(other.estimate.position, rel=1e-12)


def test_heading_errors_are_estimated() -> None:
    turn = np.deg2rad([2.0, -1.5, 1.0, -2.0])
    truth = paths(60) - [150.0, 100.0]
    z = [[(a - e, v) for (a, v), e in zip(step, turn, strict=True)] for step in bearings(truth)]
    unaware = Fused(MOTION, stations(), speed_std=6.0).run(z)
    aware = Fused(MOTION, stations(heading_std=np.deg2rad(2.0)), speed_std=6.0)
    run = aware.run(z)
    assert mean_error(run.position[-1], truth[-1]) < mean_error(unaware.position[-1], truth[-1])
    tracks = aware.bank.hypotheses[0].tracks
    std = np.sqrt(tracks.P[0].diagonal()[[4, 7, 10, 13]])
    assert (np.abs(tracks.x[0, [4, 7, 10, 13]] - turn) < 3 * std).all()
    assert (std < np.deg2rad(1.6)).all()


def test_late_waves_are_followed_back_to_the_source() -> None:
    speed, velocity = 343.0, SPEED + np.array([[10.0, 0.0], [0.0, 8.0]])
    truth = START + np.arange(25)[:, None, None] * velocity
    steps = []
    for step in truth:
        row = []
        for place in PLACES:
            lag = np.zeros(2)
            for _ in range(20):  # |p - v τ - s| = c τ
                lag = np.linalg.norm(step - velocity * lag[:, None] - place, axis=1) / speed
            d = step - velocity * lag[:, None] - place
            row.append((np.arctan2(d[:, 1], d[:, 0]), np.full(2, STD**2)))
        steps.append(row)
    late = Fused(MOTION, stations(wave_speed=speed), speed_std=15.0).run(steps)
    prompt = Fused(MOTION, stations(), speed_std=15.0).run(steps)
    assert mean_error(late.position[-1], truth[-1]) < 5
    assert mean_error(prompt.position[-1], truth[-1]) > 20


def array_stations(array: SensorArray) -> tuple[list[Station], list[Any], Float]:
    """Return stations with an array, and their snapshots of two sources at rest."""
    model = ArraySnapshot(array, 1.0, noise=0.01, n_snapshots=10)
    made = [Station(model, place, 0.4 * s) for s, place in enumerate(PLACES)]
    rng = np.random.default_rng(3)
    steps: list[Any] = []
    for _ in range(12):
        step = []
        for station in made:
            d = START - station.position
            amplitude = rng.standard_normal((10, 2)) + 1j * rng.standard_normal((10, 2))
            doa = station.from_map(np.arctan2(d[:, 1], d[:, 0]))
            step.append(model.simulate(doa, amplitude, rng))
        steps.append(step)
    return made, steps, START


@pytest.mark.parametrize("array", [SensorArray.uca(8, 0.65), SensorArray.ula(8, 0.5)], ids=str)
def test_snapshots_of_circles_and_lines_give_positions(array: SensorArray) -> None:
    made, steps, truth = array_stations(array)
    run = Fused(MOTION, made, speed_std=1.0).run(steps)
    assert run.n_found[-1] == 2
    assert mean_error(run.position[-1], truth) < 5


def test_trackers_of_stations_may_differ_and_are_copied() -> None:
    made, steps, truth = array_stations(SensorArray.uca(8, 0.65))
    models: list[Any] = [station.measurement for station in made]
    given = [SVALSE(models[0]), PeaksGNN(models[1]), SVALSE(models[2]), PeaksGNN(models[3])]
    run = Fused(MOTION, made, given, speed_std=1.0).run(steps)
    assert mean_error(run.position[-1], truth) < 10
    assert all(tracker.estimate.n_found == 0 for tracker in given)


def test_feedback_finds_what_the_tracker_of_a_station_misses() -> None:
    made, steps, _ = array_stations(SensorArray.uca(8, 0.65))
    models: list[Any] = [station.measurement for station in made]
    given = [PeaksGNN(models[0], max_sources=1), *(SVALSE(each) for each in models[1:])]
    with_it, without = (
        Fused(MOTION, made, copy.deepcopy(given), speed_std=1.0, feedback=feedback).run(steps)
        for feedback in (True, False)
    )
    assert (with_it.received[4:, :2, 0] > 0.5).all()
    assert (without.received[4:, :2, 0] < 0.5).any()


def rss_model(log_noise: float | None = -9.0) -> LogNormalRSS:
    ring = 500 + 450 * np.array([[np.cos(a), np.sin(a)] for a in np.arange(8) * np.pi / 4])
    return LogNormalRSS(ring, 0.3, alpha=3.0, log_noise=log_noise, r_min=10.0)


def test_one_station_with_signal_strength_finds_a_position() -> None:
    rss, rng = rss_model(), np.random.default_rng(0)
    truth = START[:1]
    z = [
        [step[0], rss.draw([0.0], truth, rng)]
        for step in bearings(np.repeat(truth[None], 30, axis=0), PLACES[:1])
    ]
    prior = AmplitudePrior(mean=0.0, variance=0.1)
    tracker = Fused(MOTION, stations(PLACES[:1]), rss=rss, amplitude=prior, speed_std=1.0)
    run = tracker.run(z)
    assert run.n_found[-1] == 1
    assert mean_error(run.position[-1], truth) < 60
    assert np.isfinite(run.log_amplitude[-1, 0])


def test_missing_readings_leave_bearings_alone() -> None:
    z = bearings(paths(8))
    with_rss = fused(rss=rss_model(), amplitude=AmplitudePrior(mean=0.0))
    run = with_rss.run([[*step, None] for step in z])
    assert run.position[3:] == pytest.approx(
        fused(area=(-500.0, -500, 1500, 1500)).run(z).position[3:], rel=1e-3
    )


def test_random_walk_without_velocity_reports_none() -> None:
    z = bearings(np.repeat(START[None], 8, axis=0))
    run = Fused(RandomWalk(q=1.0), stations()).run(z)
    assert mean_error(run.position[-1], START) < 15
    assert np.isnan(run.velocity).all()


def test_set_params_keeps_tracks_unless_the_state_changes() -> None:
    tracker = fused()
    tracker.run(bearings(paths(6)))
    tracker.set_params(detection__clutter=0.5)
    tracker.predict()
    assert tracker.estimate.n_found == 2
    tracker.set_params(stations=stations(heading_std=0.01))
    tracker.predict()
    assert tracker.estimate.n_found == 0


def test_csv_names_numbers_of_stations(tmp_path: Path) -> None:
    fused().run(bearings(paths(4))).to_csv(tmp_path / "tracks.csv")
    lines = (tmp_path / "tracks.csv").read_text().splitlines()
    assert lines[0] == (
        "step,time_s,label,x_m,y_m,std_x_m,std_y_m,corr,vx_mps,vy_mps,existence,level_db,heard"
    )
    assert lines[-1].endswith(",1+2+3+4")


def made_with(**options: Any) -> Fused:
    motion: MotionModel = options.pop("motion", MOTION)
    places = options.pop("stations", stations())
    return Fused(motion, places, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stations": stations()[:1]}, "stations must be at least two without rss; got 1"),
        ({"stations": stations()[:1] * 2}, "stations must have different positions"),
        ({"stations": [1, 2]}, "stations must be a Station"),
        ({"motion": VonMisesWalk(100.0)}, "motion must have the entries x and y"),
        ({"area": (0.0, 0.0, 0.0, 1.0)}, "area must be"),
        ({"rss": rss_model(None)}, "rss must have log_noise"),
        ({"trackers": "kalman"}, "trackers must be of directions; got 'kalman'"),
        ({"trackers": [None]}, "trackers must be one a station, 4; got 1"),
        ({"speed_std": -1.0}, "speed_std must be finite and positive"),
        ({"amplitude": AmplitudePrior(mean=[1.0, 2.0])}, "amplitude must have one mean"),
    ],
)
def test_invalid_argument_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        made_with(**options)


@pytest.mark.parametrize(
    ("z", "message"),
    [
        ([None] * 3, "z must have one entry a station, 4; got 3"),
        ([([0.1], [0.0]), None, None, None], "variances must lie in"),
        ([([0.1],), None, None, None], "bearings must be azimuths and variances"),
        ([([[0.1]], [0.1]), None, None, None], "azimuths must have shape"),
    ],
)
def test_invalid_measurement_is_refused(z: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fused().update(z)


def test_sphere_of_a_station_is_refused() -> None:
    model = ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, unknowns="sphere")
    with pytest.raises(ValueError, match="stations must have unknowns='azimuth'; got 'sphere'"):
        made_with(stations=[Station(model, place) for place in PLACES])


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="p_detect must lie in"):
        BearingDetection(p_detect=1.0)
    with pytest.raises(ValueError, match="max_tracks must be at least 1"):
        GlobalHypotheses(max_tracks=0)
