"""PeaksGNN: assignment, initiation and termination of tracks, equality with Kalman."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, LinearMeasurement, SensorArray
from arrivals.motion_models import ConstantVelocity, RandomWalk
from arrivals.scenarios import create, mean_gospa
from arrivals.trackers import CBF, Kalman, PeaksGNN
from arrivals.trackers import create as create_tracker
from arrivals.trackers.multi_target.track_bank import nearest

LINE = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-4)
CIRCLE = ArraySnapshot(SensorArray.uca(9, radius=0.5), wavelength=1.0, noise=1e-4)
GRIDS = st.integers(0, 3).flatmap(
    lambda n: st.integers(0, 3).flatmap(
        lambda m: st.lists(
            st.lists(st.floats(-8, 8), min_size=m, max_size=m), min_size=n, max_size=n
        ).map(lambda rows: np.array(rows).reshape(n, m))
    )
)


@given(GRIDS)
def test_nearest_has_most_pairs_and_then_the_smallest_sum(residual: np.ndarray) -> None:
    n, m = residual.shape
    track, measurement = nearest(residual, np.ones(n), gate=3.0)
    mine = (-len(track), sum(residual[track, measurement] ** 2))
    # a track may have no measurement
    wide = np.pad(residual, ((0, 0), (0, n)), constant_values=np.inf)
    ways = []
    for chosen in permutations(range(m + n), n):
        kept = [wide[i, j] ** 2 for i, j in enumerate(chosen) if abs(wide[i, j]) <= 3.0]
        ways.append((-len(kept), sum(kept)))
    best = min(ways)
    assert mine[0] == best[0]
    assert mine[1] == pytest.approx(best[1])


def test_single_track_equals_kalman_on_the_peaks() -> None:
    doa = np.deg2rad(np.linspace(10, 25, 12))[:, None]
    z = LINE.simulate(doa, 1.0, np.random.default_rng(0))
    peaks = CBF(LINE, max_sources=1).run(z).doa[:, 0]
    tracker = PeaksGNN(LINE, detector=CBF(LINE, max_sources=1), std=0.05, speed_std=0.02)
    run = tracker.run(z)
    measurement = LinearMeasurement([[1.0, 0.0]], [[0.05**2]])
    motion = ConstantVelocity(1e-5, n_dims=1)
    P = np.diag([0.05**2, 0.02**2])
    kalman = Kalman(motion, measurement, x=[peaks[0], 0.0], P=P).run(peaks[1:])
    np.testing.assert_allclose(run.doa[1:, 0], kalman.x[:, 0], atol=1e-12)
    assert run.std[-1, 0] == pytest.approx(float(np.sqrt(kalman.fields["P"][-1][0, 0])))
    assert set(run.label[1:, 0]) == {0}


def test_track_is_confirmed_coasts_and_is_terminated() -> None:
    on = np.array([1, 1, 1, 0, 0, 0, 0, 1], dtype=bool)
    doa = np.where(on, 0.3, np.nan)[:, None]
    z = LINE.replace(noise=1e-8).simulate(doa, 1.0, np.random.default_rng(1))
    z[~on] = 0.0
    run = PeaksGNN(LINE, detector=CBF(LINE, max_sources=1), confirm_steps=2, patience=2).run(z)
    assert run.n_found.tolist() == [0, 1, 1, 1, 1, 0, 0, 0]


def test_source_that_crosses_pi_keeps_its_label() -> None:
    doa = np.linspace(3.0, 3.3, 10)[:, None]  # across ±π
    z = CIRCLE.simulate(doa, 1.0, np.random.default_rng(2))
    detector = CBF(CIRCLE, max_sources=1)
    run = PeaksGNN(CIRCLE, detector=detector, motion=RandomWalk(1e-3, n_dims=1)).run(z)
    assert set(run.label[1:, 0]) == {0}
    off = (run.doa[1:, 0] - doa[1:, 0] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < 0.1


def test_track_beyond_90_degrees_of_a_line_is_terminated() -> None:
    doa = np.deg2rad(np.linspace(76, 88, 4))[:, None]
    z = LINE.simulate(doa, 1.0, np.random.default_rng(3))
    tracker = PeaksGNN(LINE, detector=CBF(LINE, max_sources=1), patience=50)
    tracker.run(z)
    assert tracker.estimate.n_found == 1
    for _ in range(40):
        tracker.predict()
        assert (np.abs(tracker.estimate.doa) <= np.pi / 2).all()
    assert tracker.estimate.n_found == 0


def test_peaks_gnn_has_smaller_gospa_than_cbf() -> None:
    scores = []
    for seed in range(3):
        trial = create("svalse_fig4").sample(np.random.default_rng(seed))
        truth = np.rad2deg(trial.truth)
        runs = [trial.tracker(name).run(trial.measurements) for name in ("cbf", "peaks_gnn")]
        scores.append([mean_gospa(truth, np.rad2deg(run.doa), c=10.0).total for run in runs])
    cbf, gnn = np.mean(scores, axis=0)
    assert gnn < 0.8 * cbf


def test_changed_detector_is_used_from_the_next_step() -> None:
    tracker = PeaksGNN(LINE)
    z = LINE.simulate([0.3], 1.0, np.random.default_rng(4))
    tracker.set_params(detector="mvdr")
    tracker.predict()
    tracker.update(z)
    assert type(tracker.active_detector).__name__ == "MVDR"
    tracker.set_params(max_sources=3)
    tracker.predict()
    assert tracker.x.shape == (3,)


@pytest.mark.parametrize("name", ["cbf", "mvdr", "sbl", "ssbl", "peaks_gnn"])
def test_reset_returns_to_the_state_after_construction(name: str) -> None:
    z = LINE.simulate(np.full((4, 1), 0.3), 1.0, np.random.default_rng(5))
    tracker = create_tracker(name, measurement=LINE)
    first = tracker.run(z)
    tracker.reset()  # type: ignore[attr-defined]  # of direction trackers
    assert tracker.estimate.n_found == 0
    np.testing.assert_array_equal(tracker.run(z).doa, first.doa)


@pytest.mark.parametrize(
    ("params", "error", "message"),
    [
        ({"detector": "ekf"}, ValueError, "got 'ekf', which requires motion, measurement, x, P"),
        ({"detector": "cbff"}, ValueError, "did you mean cbf"),
        ({"motion": 3}, TypeError, "motion must be a MotionModel"),
        ({"std": 0.0}, ValueError, "std must be finite and positive"),
        ({"patience": -1}, ValueError, "patience must be at least 0"),
    ],
)
def test_invalid_parameters_are_refused(
    params: dict[str, object], error: type, message: str
) -> None:
    with pytest.raises(error, match=message):
        PeaksGNN(LINE, **params)  # type: ignore[arg-type]  # on purpose
