"""Estimates, runs, the tracks file and missing measurements."""

import dataclasses
import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from recording_tracker import EchoTracker, directions

from arrivals.files import atomic_write
from arrivals.measurements import is_missing
from arrivals.trackers import (
    DirectionEstimate,
    Estimate,
    PositionEstimate,
    Run,
)
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float

# estimates and their rows


def test_direction_row_is_in_degrees_and_db() -> None:
    estimate = DirectionEstimate(
        doa=np.deg2rad([30.0, -90.0, 5.0]),
        std=np.deg2rad([1.0, np.nan, 0.0]),
        existence=np.array([0.9, np.nan, 1.0]),
        amplitude=np.array([10j, complex(np.nan, np.nan), 0.0]),
        label=np.array([4, -1, 7]),
    )
    expected = [(4, 30, 1, 0.9, 20), (-1, -90, np.nan, np.nan, np.nan), (7, 5, 0, 1, -np.inf)]
    np.testing.assert_allclose(estimate.rows(), expected, rtol=1e-12)
    assert estimate.columns == ("label", "doa_deg", "std_deg", "existence", "level_db")
    assert set(estimate.per_step()) == {"converged", "iterations", "noise"}
    with pytest.raises(dataclasses.FrozenInstanceError):
        estimate.doa = np.zeros(3)  # type: ignore[misc]


def positions(n: int) -> PositionEstimate:
    return PositionEstimate(
        position=np.array([[1.0, 2.0], [3.0, 4.0]])[:n],
        covariance=np.array([[[4.0, 3.0], [3.0, 9.0]], [[1.0, 0.0], [0.0, 1.0]]])[:n],
        log_amplitude=np.array([np.log(10.0), 0.0])[:n],
        existence=np.array([0.5, np.nan])[:n],
        label=np.array([0, 1])[:n],
    )


def test_position_row_has_deviations_and_correlation() -> None:
    assert positions(2).columns == (
        "label", "x_m", "y_m", "std_x_m", "std_y_m", "corr", "existence", "level_db",
    )  # fmt: skip
    expected = [(0, 1, 2, 2, 3, 0.5, 0.5, 20), (1, 3, 4, 1, 1, 0, np.nan, 0)]
    np.testing.assert_allclose(positions(2).rows(), expected)
    assert positions(0).rows() == []


def test_estimate_without_rows_is_not_implemented() -> None:
    @dataclass(frozen=True, eq=False)
    class Levels(Estimate):
        level: Float
        per_source = {"level": np.nan}  # noqa: RUF012

    assert Levels(np.zeros(3)).n_found == 3
    with pytest.raises(NotImplementedError):
        Levels(np.zeros(3)).rows()


# runs


def test_run_is_padded_with_nan() -> None:
    run = EchoTracker().run([[0.1, 0.2], None, [0.3], [0.1, 0.2, 0.3]], dt=0.5)
    nan = np.nan
    np.testing.assert_array_equal(
        run.doa, [[0.1, 0.2, nan], [nan] * 3, [0.3, nan, nan], [0.1, 0.2, 0.3]]
    )
    np.testing.assert_array_equal(run.label, [[0, 1, -1], [-1] * 3, [0, -1, -1], [0, 1, 2]])
    assert run.label.dtype.kind == "i"
    assert np.isnan(run.amplitude[1]).all()
    assert run.n_found.tolist() == [2, 0, 1, 3]
    assert run.time.tolist() == [0.0, 0.5, 1.0, 1.5]
    assert run.x.ravel().tolist() == [0.5, 1.0, 1.5, 2.0]
    assert run.converged.tolist() == [True] * 4
    assert (run.n_steps, len(run), run.elapsed > 0) == (4, 4, True)
    assert {"doa", "label", "noise", "time"} <= set(dir(run))
    with pytest.raises(AttributeError, match="run has no attribute 'position'"):
        _ = run.position


@pytest.mark.parametrize("n_steps", [1, 15, 16, 17, 100])
def test_run_returns_every_recorded_estimate(n_steps: int) -> None:
    rng = np.random.default_rng(n_steps)
    given = [
        directions(rng.normal(size=n), converged=bool(n % 2), iterations=int(n), noise=float(n))
        for n in rng.integers(0, 6, n_steps)
    ]
    recorder = RunRecorder(DirectionEstimate)
    for estimate in given:
        recorder.add(estimate, np.zeros(1))
    run = recorder.run(dt=1.0, elapsed=0.0)
    for step, estimate in enumerate(given):
        again = run.estimate(step)
        assert isinstance(again, DirectionEstimate)
        for name, value in vars(estimate).items():
            np.testing.assert_array_equal(getattr(again, name), value, strict=True)
        assert type(again.converged) is bool
    pickled = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(pickled.doa, run.doa)


def test_run_of_positions() -> None:
    recorder = RunRecorder(PositionEstimate)
    for n in (0, 2, 1):
        recorder.add(positions(n), np.zeros(4))
    run = recorder.run(dt=1.0, elapsed=0.0)
    assert run.position.shape == (3, 2, 2)
    assert run.covariance.shape == (3, 2, 2, 2)
    assert np.isnan(run.covariance[2, 1]).all()
    np.testing.assert_array_equal(run.estimate(1).rows(), positions(2).rows())


def test_run_without_steps_has_all_fields(tmp_path: Path) -> None:
    run = EchoTracker().run([])
    assert (len(run), run.n_found.shape, run.doa.shape[0], run.label.dtype.kind) == (
        0,
        (0,),
        0,
        "i",
    )
    assert run.converged.shape == run.noise.shape == (0,)
    run.to_csv(tmp_path / "tracks.csv")
    assert (tmp_path / "tracks.csv").read_text() == HEADER


def test_run_does_not_keep_spare_memory() -> None:
    run = EchoTracker().run([[0.1]] * 17)
    assert run.doa.base is None
    assert run.doa.shape == (17, 1)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan])
def test_dt_must_be_positive(dt: float) -> None:
    with pytest.raises(ValueError, match="dt must be finite and positive"):
        EchoTracker().run([[0.1]], dt=dt)


def test_run_batch_starts_every_sequence_from_the_present_state() -> None:
    tracker = EchoTracker()
    tracker.predict()
    one, two = tracker.run_batch([[[0.1], [0.2]], [None]])
    assert one.x.ravel().tolist() == [2.0, 3.0]
    assert two.x.ravel().tolist() == [2.0]
    assert tracker.x.tolist() == [1.0]


# the tracks file

HEADER = "step,time_s,label,doa_deg,std_deg,existence,level_db\n"


def tracks() -> Run:
    return EchoTracker().run([np.deg2rad([30.0, -10.0]), None, [1 / 3]], dt=0.25)


def test_tracks_file(tmp_path: Path) -> None:
    path = tmp_path / "tracks.csv"
    tracks().to_csv(path)
    assert path.read_bytes().decode() == (
        HEADER
        + "0,0,0,30,3,0.5,0\n"
        + "0,0,1,-10,-1,0.5,20\n"
        + "2,0.5,0,19.0985932,1.90985932,0.5,0\n"
    )
    assert list(tmp_path.iterdir()) == [path]


def test_tracks_file_of_positions(tmp_path: Path) -> None:
    recorder = RunRecorder(PositionEstimate)
    recorder.add(positions(2), np.zeros(4))
    recorder.run(dt=1.0, elapsed=0.0).to_csv(str(tmp_path / "tracks.csv"))
    assert (tmp_path / "tracks.csv").read_text() == (
        "step,time_s,label,x_m,y_m,std_x_m,std_y_m,corr,existence,level_db\n"
        "0,0,0,1,2,2,3,0.5,0.5,20\n"
        "0,0,1,3,4,1,1,0,,0\n"
    )


def test_tracks_file_with_other_times(tmp_path: Path) -> None:
    run = tracks()
    run.to_csv(tmp_path / "tracks.csv", time=[10.0, 20.0, 30.5])
    times = [line.split(",")[1] for line in (tmp_path / "tracks.csv").read_text().splitlines()]
    assert times == ["time_s", "10", "10", "30.5"]
    assert run.time.tolist() == [0.0, 0.25, 0.5]
    with pytest.raises(ValueError, match=r"time must have shape \(3,\); got \(2,\)"):
        run.to_csv(tmp_path / "other.csv", time=[1.0, 2.0])
    assert not (tmp_path / "other.csv").exists()


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_to_csv_after_an_error_keeps_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    path = tmp_path / "tracks.csv"
    path.write_text("old")
    run = tracks()

    def rows(self: Run) -> Iterator[tuple[Any, ...]]:
        yield (0, 0.0, 0, 1.0, 1.0, 1.0, 1.0)
        assert len(list(tmp_path.iterdir())) == 2  # the new one is being written beside it
        raise error

    monkeypatch.setattr(Run, "rows", rows)
    with pytest.raises(type(error)):
        run.to_csv(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_atomic_write_makes_the_file_when_complete(tmp_path: Path) -> None:
    path = tmp_path / "new.txt"
    with atomic_write(path) as file:
        file.write("half\n")
        file.flush()
        assert not path.exists()
    assert path.read_text() == "half\n"


def test_to_csv_with_missing_folder_raises_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"the folder does not exist: .*nowhere"):
        tracks().to_csv(tmp_path / "nowhere" / "tracks.csv")


def test_to_csv_to_a_folder_raises(tmp_path: Path) -> None:
    (tmp_path / "tracks.csv").mkdir()
    with pytest.raises(OSError, match=r"tracks\.csv"):
        tracks().to_csv(tmp_path / "tracks.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["tracks.csv"]


# missing measurements


@pytest.mark.parametrize(
    "z",
    [
        None,
        np.nan,
        [np.nan, None],
        np.full((2, 3), np.nan),
        complex(np.nan, 0.0),
        np.inf,
        np.ma.masked_array(np.ones(3), mask=True),
    ],
)
def test_is_missing_of_none_and_all_nan_is_true(z: ArrayLike | None) -> None:
    assert is_missing(z)


@pytest.mark.parametrize("z", [0.0, [np.nan, 1.0], [], [True], 3, 1j])
def test_is_missing_of_other_values_is_false(z: ArrayLike) -> None:
    assert not is_missing(z)
