"""AR Kalman filter with QRD-RLS: stated deviations of the directions."""

from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import DOA, TWO, make_tracker, snapshots, sources, symmetric_array

from arrivals.trackers.autoregressive.direction_covariance import direction_std

ENDS = slice(29, None, 30)
SCENES: list[tuple[tuple[float, ...], float, dict[str, Any]]] = [
    ((0.25, 0.5), 10.0, {}),
    ((0.25, 0.5), 20.0, {"forgetting": 0.95}),
    ((0.25,), 10.0, {}),
    ((0.25,), 30.0, {"inner": 4}),
    ((0.25, 0.5), 10.0, {"ridge": 5.0}),
]


@pytest.mark.parametrize(("distances", "snr_db", "params"), SCENES)
def test_errors_of_still_sources_have_the_stated_deviation(
    distances: tuple[float, ...], snr_db: float, params: dict[str, Any]
) -> None:
    array = symmetric_array(*distances, snr_db=snr_db)
    tracker = make_tracker(array, doa=DOA, doa_std=1e-3, **params)
    runs = tracker.run_batch(snapshots(array, DOA, sources(TWO, 20, 2400)))
    z = np.array([(run.doa - DOA)[ENDS] / run.std[ENDS] for run in runs])[:, 30:]
    assert 0.75 < (z**2).mean() < 1.3
    assert 0.90 < (abs(z) < 1.96).mean() < 0.985


def test_errors_of_initial_directions_are_stated_until_they_are_forgotten() -> None:
    rng, array, z = np.random.default_rng(0), symmetric_array(0.25), []
    all_snapshots = snapshots(array, DOA, sources(TWO, 16, 900))
    for one in all_snapshots:
        tracker = make_tracker(array, doa=DOA + 0.05 * rng.standard_normal(2))
        run = tracker.run(one)
        z.append((run.doa - DOA)[ENDS] / run.std[ENDS])
    assert 0.6 < (np.array(z)[:, :5] ** 2).mean() < 1.5
    assert run.std[0] == pytest.approx(0.05, rel=0.01)  # stated from the start
    assert (run.std[-1] < 0.5 * run.std[0]).all()


def test_deviation_grows_in_a_gap_of_all_sensors_or_of_all_pairs_and_stays_finite() -> None:
    array = symmetric_array(0.25)
    whole = snapshots(array, DOA, sources(TWO, 1, 2400))[0]
    for sensors in (slice(None), 0):  # without its first sensor the array has no pair
        z = whole.copy()
        z[900:1500, sensors] = np.nan
        std = make_tracker(array, doa=DOA).run(z).std[ENDS]
        assert np.isfinite(std).all()
        assert (std > 0).all()
        assert (np.diff(std[31:49], axis=0) > 0).all()
        assert (std[-1] < 0.5 * std[49]).all()
    z[900:] = np.nan
    std = make_tracker(array, doa=DOA).run(np.concatenate([z] + 2 * [z[900:]])).std
    assert std.max() < np.pi / 2
    missing = make_tracker(array, doa=DOA).run(np.full((300, 3), np.nan)).std
    assert np.ptp(missing, axis=0).max() == 0.0  # no data yet: that of the start


def test_deviation_of_an_inactive_source_grows() -> None:
    array, s = symmetric_array(0.25, 0.5), sources(TWO, 1, 1800)
    s[:, 900:, 0] = 0.0
    tracker = make_tracker(array, doa=DOA, gate=0.3)
    run = tracker.run(snapshots(array, DOA, s)[0])
    assert run.existence[-1].tolist() == [0.0, 1.0]
    assert run.std[-1, 0] > 1.5 * run.std[899, 0]
    assert run.std[-1, 1] < 1.5 * run.std[899, 1]


def test_batch_and_steps_state_the_deviation_of_a_run() -> None:
    array = symmetric_array(0.25)
    z = snapshots(array, DOA, sources(TWO, 2, 300))
    z[1, 100:140] = np.nan
    tracker = make_tracker(array)  # directions from the first snapshots
    batch = tracker.run_batch(z)
    for one, run in zip(z, batch, strict=True):
        tracker.restart()
        np.testing.assert_allclose(tracker.run(one).std, run.std, rtol=1e-9)
        tracker.restart()
        for snapshot in one:
            tracker.predict()
            tracker.update(snapshot)
        np.testing.assert_allclose(tracker.estimate.std, run.std[-1], rtol=1e-9)
    assert np.isnan(batch[0].std[:59]).all()
    assert np.isfinite(batch[0].std[59:]).all()


def test_deviation_is_that_of_the_sine_over_the_cosine_and_finite_at_the_end_of_the_line() -> None:
    doa = np.array([0.0, 0.5, -1.0])
    np.testing.assert_allclose(direction_std(1e-8 * np.eye(3), doa), 1e-4 / np.cos(doa), rtol=1e-6)
    assert 0 < direction_std(1e-8 * np.eye(1), np.array([np.pi / 2]))[0] < 0.01
    assert direction_std(1e4 * np.eye(1), np.array([0.3]))[0] == pytest.approx(np.pi / 2)
