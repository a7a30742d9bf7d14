"""Estimates of azimuth and elevation, or direction and range: rows, runs, files and states."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from two_unknowns import GivenEstimates, range_estimate, run_of, sphere_estimate

from arrivals.recordings.stream import track_live
from arrivals.trackers import DirectionEstimate, RangeEstimate, SphereEstimate

SPHERE = "step,time_s,label,doa_deg,std_deg,elevation_deg,elevation_std_deg,existence,level_db\n"
RANGE = "step,time_s,label,doa_deg,std_deg,range_m,range_std_m,existence,level_db\n"
DIRECTIONS = [
    sphere_estimate([30, -170], [60, -5]),
    sphere_estimate([], []),
    sphere_estimate(31, 61),
]
RANGES = [range_estimate([-20, 40], [50, np.inf]), range_estimate(-21, 48)]
CASES = [
    (DIRECTIONS, SphereEstimate, SPHERE,
     "0,0,0,30,1,60,1,0.9,20\n0,0,1,-170,1,-5,1,0.9,20\n2,2,0,31,1,61,1,0.9,20\n"),
    (RANGES, RangeEstimate, RANGE,
     "0,0,0,-20,1,50,5,0.9,20\n0,0,1,40,1,,,0.9,20\n1,1,0,-21,1,48,4.8,0.9,20\n"),
]  # fmt: skip


@pytest.mark.parametrize(("estimates", "kind", "header", "rows"), CASES)
def test_tracks_file_has_columns_of_the_second_unknown(
    estimates: list[DirectionEstimate], kind: type, header: str, rows: str, tmp_path: Path
) -> None:
    run_of(estimates, kind).to_csv(tmp_path / "tracks.csv")
    assert (tmp_path / "tracks.csv").read_text() == header + rows


@pytest.mark.parametrize(("estimates", "kind", "header", "rows"), CASES)
def test_stream_writes_the_lines_of_the_tracks_file(
    estimates: list[DirectionEstimate], kind: type, header: str, rows: str
) -> None:
    written: list[str] = []
    tracker = GivenEstimates(*estimates, kind=kind)
    steps = [(float(n), np.array(n, complex)) for n in range(len(estimates))]
    assert track_live(tracker, steps, written.append) == len(steps)
    assert "".join(written) == header + rows


@pytest.mark.parametrize(("estimates", "kind"), [case[:2] for case in CASES])
def test_run_returns_every_recorded_estimate(
    estimates: list[DirectionEstimate], kind: type
) -> None:
    run = run_of(estimates, kind)
    for step, estimate in enumerate(estimates):
        again = run.estimate(step)
        assert type(again) is kind
        for name, value in vars(estimate).items():
            np.testing.assert_array_equal(getattr(again, name), value)


@pytest.mark.parametrize("kind", [SphereEstimate, RangeEstimate])
def test_run_without_steps_has_all_fields(kind: type[DirectionEstimate], tmp_path: Path) -> None:
    run = GivenEstimates(kind=kind).run([])
    assert set(kind.per_source) <= set(run.fields)
    run.to_csv(tmp_path / "tracks.csv")
    assert (tmp_path / "tracks.csv").read_text() in (SPHERE, RANGE)


def test_state_has_both_unknowns_of_each_slot_and_blocks_of_covariance() -> None:
    tracker = GivenEstimates(range_estimate([-20, 40], [50, np.inf]), kind=RangeEstimate)
    tracker.update(0)
    expected = [np.deg2rad(-20), 1 / 50, np.deg2rad(40), 0, np.nan, np.nan]
    np.testing.assert_allclose(tracker.x, expected)
    np.testing.assert_allclose(np.diag(tracker.P)[:2], [np.deg2rad(1) ** 2, (0.1 / 50) ** 2])
    assert not tracker.P[4:].any()
    tracker.predict()
    assert (tracker.x.shape, tracker.estimate.n_found) == ((6,), 0)


def test_covariance_of_azimuth_comes_first_in_the_state() -> None:
    covariance = np.array([[[4.0, 1.0], [1.0, 9.0]]])
    flat = replace(sphere_estimate(40, 20), covariance=covariance)
    tracker = GivenEstimates(flat, kind=SphereEstimate)
    tracker.update(0)
    np.testing.assert_allclose(tracker.x[:2], np.deg2rad([40, 20]))
    np.testing.assert_array_equal(tracker.P[:2, :2], [[9.0, 1.0], [1.0, 4.0]])


def test_deviations_that_are_not_estimated_are_empty_cells(tmp_path: Path) -> None:
    nan = np.full(1, np.nan)
    estimate = replace(
        sphere_estimate(0, 0, [-1]), std=nan, existence=nan, covariance=np.full((1, 2, 2), np.nan)
    )
    run_of([estimate], SphereEstimate).to_csv(tmp_path / "tracks.csv")
    assert (tmp_path / "tracks.csv").read_text() == SPHERE + "0,0,-1,0,,0,,,20\n"
