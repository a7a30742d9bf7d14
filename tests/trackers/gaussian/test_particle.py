"""The particle filter against grids and the Kalman filter; resampling; chance; refusals."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, LinearMeasurement, SensorArray
from arrivals.motion_models import ConstantVelocity, RandomWalk, VonMisesWalk
from arrivals.motion_models.von_mises import log_density
from arrivals.trackers import Kalman, Particle
from arrivals.trackers.conformance import difference
from arrivals.trackers.gaussian.particle import systematic_resample
from arrivals.typing import Float

LINE = ArraySnapshot(SensorArray.ula(4, spacing=0.5), wavelength=1.0, noise=2.0)
CIRCLE = ArraySnapshot(SensorArray.uca(5, radius=0.3), wavelength=1.0, noise=2.0)
WALK, SEEN = RandomWalk(0.2, 2), LinearMeasurement(np.eye(2), 0.3 * np.eye(2))


def grid_posterior(zs: Any, walk: VonMisesWalk, start: float, variance: float) -> complex:
    """⟨exp(jβ)⟩ after the last snapshot, on 720 points of the circle."""
    grid = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    away = (grid - start + np.pi) % (2 * np.pi) - np.pi
    turns = 2 * np.pi * np.arange(-1, 2)[:, None]
    p = np.exp(-((away + turns) ** 2) / (2 * variance)).sum(axis=0)
    step = np.exp(log_density(grid[:, None], grid, walk.step()))
    for z in zs:
        p = step @ (p / p.sum())
        log = CIRCLE.log_likelihood(z, grid[:, None])
        p = p * np.exp(log - log.max())
    return complex(np.sum(p * np.exp(1j * grid)) / p.sum())


def test_raw_snapshots_on_a_circle_are_the_grids_posterior() -> None:
    walk = VonMisesWalk(40.0)
    zs = CIRCLE.simulate(np.full((4, 1), 3.0), [1.0], np.random.default_rng(1))
    tracker = Particle(walk, CIRCLE, [-3.0], [[0.5]], n_particles=20000, rng=2)
    tracker.run(zs)
    expected = grid_posterior(zs, walk, -3.0, 0.5)
    found = complex(tracker.weights @ np.exp(1j * tracker.particles[:, 0]))
    assert abs(found - expected) < 0.02
    assert abs(np.exp(1j * tracker.x[0]) - expected / abs(expected)) < 0.05


def test_linear_gaussian_posterior_is_kalmans() -> None:
    particle = Particle(WALK, SEEN, [0.0, 1.0], np.eye(2), n_particles=20000, rng=0)
    kalman = Kalman(WALK, SEEN, [0.0, 1.0], np.eye(2))
    for z in ([0.5, 1.5], [np.nan, 1.0], None, [1.0, np.nan]):
        for tracker in (particle, kalman):
            tracker.predict()
            tracker.update(z)
        np.testing.assert_allclose(particle.x, kalman.x, atol=0.04)
        np.testing.assert_allclose(particle.P, kalman.P, atol=0.04)
        assert particle.log_likelihood == pytest.approx(kalman.log_likelihood, abs=0.05)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=40), st.integers(0, 1000))
def test_each_index_is_drawn_its_share_to_less_than_one(weights: list[float], seed: int) -> None:
    if sum(weights) > 0:
        share = np.array(weights) / sum(weights)
        drawn = systematic_resample(share, np.random.default_rng(seed))
        assert len(drawn) == len(share)
        counts = np.bincount(drawn, minlength=len(share))
        assert np.abs(counts - len(share) * share).max() < 1 + 1e-9
        assert (np.diff(drawn) >= 0).all()


def test_few_effective_particles_are_drawn_anew() -> None:
    always, never = (
        Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 50, rng=0, resample_below=share)
        for share in (1.0, 0.0)
    )
    for tracker in (always, never):
        tracker.update([1.0, 1.0])
    np.testing.assert_array_equal(always.weights, 1 / 50)
    assert np.ptp(never.weights) > 0
    np.testing.assert_array_equal(always.x, never.x)


# Chance


def moved(tracker: Particle) -> Float:
    return tracker.run(np.ones((3, 2))).x


def test_a_seed_repeats_and_a_generator_goes_on() -> None:
    def make(rng: Any) -> Particle:
        return Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 30, rng=rng)

    np.testing.assert_array_equal(moved(make(3)), moved(make(3)))
    np.testing.assert_array_equal(moved(make(3)), moved(make(np.random.default_rng(3))))
    shared = np.random.default_rng(3)
    assert not np.array_equal(moved(make(shared)), moved(make(shared)))


def test_copies_and_clones_of_one_with_a_generator() -> None:
    from sklearn.base import clone

    tracker = Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 30, rng=np.random.default_rng(5))
    copied, cloned = copy.deepcopy(tracker), clone(tracker)
    expected = moved(Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 30, rng=5))
    for each in (tracker, copied, cloned):
        np.testing.assert_array_equal(moved(each), expected)


def test_another_seed_starts_anew_and_the_same_does_not() -> None:
    tracker = Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 30, rng=5)
    tracker.predict()
    state = tracker._generator.bit_generator.state
    tracker.set_params(rng=5)
    assert tracker._generator.bit_generator.state == state
    tracker.set_params(rng=6)
    assert tracker._generator.bit_generator.state != state


def test_assigned_beliefs_are_drawn_from() -> None:
    tracker = Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 5000, rng=5)
    tracker.predict()
    tracker.x, tracker.P = np.array([50.0, 60.0]), 4 * np.eye(2)
    tracker.predict()
    np.testing.assert_allclose(tracker.x, [50, 60], atol=0.2)
    np.testing.assert_allclose(tracker.P, 4.2 * np.eye(2), atol=0.4)


# Refusals


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"x": [0.0]}, ValueError, r"x must have shape \(2,\); got \(1,\)"),
        ({"x": [0.0, np.nan]}, ValueError, "x must be finite"),
        ({"P": [[1, 2], [0, 1]]}, ValueError, "P must be symmetric"),
        ({"n_particles": 0}, ValueError, "n_particles must be at least 1"),
        ({"resample_below": 2.0}, ValueError, r"resample_below must lie in \[0, 1\]"),
        ({"rng": "dice"}, TypeError, "rng|SeedSequence|seed"),
        ({"motion": None}, TypeError, "motion must be a MotionModel"),
    ],
)
def test_bad_parameters_are_refused(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    params: dict[str, Any] = {
        "motion": WALK,
        "measurement": SEEN,
        "x": [0.0, 0.0],
        "P": np.eye(2),
        "rng": 0,
    }
    with pytest.raises(error, match=message):
        Particle(**(params | change))


def test_refused_calls_leave_everything() -> None:
    tracker = Particle(WALK, SEEN, [0.0, 0.0], np.eye(2), 30, rng=0)
    refused: list[tuple[Callable[[], object], type[Exception], str]] = [
        (lambda: tracker.predict(1.0), ValueError, "takes no control input"),
        (lambda: tracker.update([1.0]), ValueError, r"z must have shape \(2,\)"),
        (lambda: tracker.update([1j, 1j]), TypeError, "need a model with log_likelihood"),
    ]
    for call, error, message in refused:
        before = copy.deepcopy(vars(tracker))
        with pytest.raises(error, match=message):
            call()
        assert difference(before, vars(tracker)) is None


def test_wrong_snapshots_leave_everything() -> None:
    tracker = Particle(VonMisesWalk(9.0), LINE, [0.0], [[1.0]], 30, rng=0)
    before = copy.deepcopy(vars(tracker))
    with pytest.raises(ValueError, match="one number a sensor"):
        tracker.update(np.ones(5, dtype=complex))
    assert difference(before, vars(tracker)) is None


def test_velocity_states_run_too() -> None:
    motion, seen = ConstantVelocity(0.1), LinearMeasurement(np.eye(4)[::2], 0.1 * np.eye(2))
    run = Particle(motion, seen, np.zeros(4), np.eye(4), 500, rng=1).run([[1.0, 1.0], None])
    assert run.x.shape == (2, 4)
    np.testing.assert_allclose(run.P, run.P.swapaxes(1, 2))
