"""What trackers of directions report in a gap and after it."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import MUSIC, SVALSE, PeaksGNN, create
from arrivals.trackers.multi_target import TrackBank
from arrivals.typing import Complex

LINE = ArraySnapshot(SensorArray.ula(9, spacing=0.5), wavelength=1.0, noise=1e-2)
WITHOUT_STD = ["cbf", "mvdr", "music", "root_music", "esprit", "past", "sbl", "ssbl"]


def two_sources(n: int) -> Complex:
    rng = np.random.default_rng(0)
    phases = np.exp(2j * np.pi * rng.random((n, 2)))
    return LINE.simulate(np.full((n, 2), [0.5, -0.4]), phases, rng)


@pytest.mark.parametrize("name", WITHOUT_STD)
def test_method_without_std_reports_nothing_in_a_gap_and_resumes(name: str) -> None:
    z = list(two_sources(10 if name in ("sbl", "ssbl") else 20))
    run = create(name, measurement=LINE, max_sources=3).run([*z, None, np.zeros(9), z[0]])
    assert run.n_found[-4] > 0
    assert run.n_found[-3:-1].tolist() == [0, 0]
    assert run.n_found[-1] > 0


def test_directions_are_held_between_intervals_but_not_across_a_gap() -> None:
    z = list(two_sources(11))
    run = MUSIC(LINE, n_sources=2, interval=4).run([*z[:6], None, *z[6:]])
    assert run.n_found.tolist() == [0, 0, 0, 2, 2, 2, 0, 0, 2, 2, 2, 2]
    np.testing.assert_array_equal(run.doa[4], run.doa[3])


def test_peaks_gnn_ends_tracks_after_its_patience() -> None:
    z = list(two_sources(8))
    tracker = PeaksGNN(LINE, detector="mvdr", patience=3)
    assert tracker.run(z).n_found[-1] >= 2
    assert (tracker.run([None] * 3).n_found >= 2).all()
    assert tracker.run([None] * 2).n_found.tolist() == [0, 0]


def test_peaks_gnn_ends_a_track_wider_than_a_uniform_direction() -> None:
    tracker = PeaksGNN(LINE, patience=10**6)
    tracker.run(two_sources(8))
    run = tracker.run([None] * 300)
    assert np.nanmax(run.std) <= np.pi / np.sqrt(12)
    assert run.n_found[-1] == 0
    assert not tracker.bank.used.any()


def test_predicted_track_counts_a_step_without_a_detection() -> None:
    from arrivals.motion_models import RandomWalk

    bank = TrackBank.empty(2, 1).add(np.array([0.3]), np.eye(1))
    bank = bank.predict(RandomWalk(0.1, n_dims=1), 1.0)
    assert bank.misses.tolist() == [1, 0]
    assert bank.update(np.array([0]), np.array([0.1]), 0.1).misses.tolist() == [0, 0]


def test_std_of_svalse_is_at_most_that_of_a_uniform_direction() -> None:
    for model, limit in (
        (LINE, np.pi / np.sqrt(12)),
        (ArraySnapshot(SensorArray.uca(7, 0.5), 1.0, noise=0.01), 2 * np.pi / np.sqrt(12)),
    ):
        tracker = SVALSE(model)
        tracker.run(model.simulate([[0.3]] * 3, 1.0, np.random.default_rng(0)))
        tracker.kappa, tracker.existence = 0 * tracker.kappa, np.ones_like(tracker.existence)
        tracker.report_prior()
        assert 0 < tracker.estimate.std.max() <= limit
