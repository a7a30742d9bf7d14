"""Particle filter against grids and the Kalman filter; resampling, random numbers, errors."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from arrivals.measurement_models import ArraySnapshot, LinearMeasurement, SensorArray
from arrivals.motion_models import ConstantVelocity, RandomWalk, VonMisesWalk
from arrivals.motion_models.von_mises import log_density
from arrivals.trackers import Kalman, Particle
from arrivals.trackers.conformance import difference
from arrivals.trackers.gaussian.particle import log_normal, systematic_resample
from arrivals.typing import Float

LINE = ArraySnapshot(SensorArray.ula(4, spacing=0.5), wavelength=1.0, noise=2.0)
CIRCLE = ArraySnapshot(SensorArray.uca(5, radius=0.3), wavelength=1.0, noise=2.0)
WALK, POSITION = RandomWalk(0.2, 2), LinearMeasurement(np.eye(2), 0.3 * np.eye(2))


def grid_posterior(zs: Any, walk: VonMisesWalk, start: float, variance: float) -> complex:
    """Return ⟨exp(jβ)⟩ after the last snapshot, on 720 points of the circle."""
    grid = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    away = (grid - start + np.pi) % (2 * np.pi) - np.pi
    turns = 2 * np.pi * np.arange(-1, 2)[:, None]
    p = np.exp(-((away + turns) ** 2) / (2 * variance)).sum(axis=0)
    step = np.exp(log_density(grid[:, None], grid, walk.step_concentration()))
    for z in zs:
        p = step @ (p / p.sum())
        log = CIRCLE.log_likelihood(z, grid[:, None])
        p = p * np.exp(log - log.max())
    return complex(np.sum(p * np.exp(1j * grid)) / p.sum())


def test_particle_posterior_of_complex_snapshots_equals_grid() -> None:
    walk = VonMisesWalk(40.0)
    zs = CIRCLE.simulate(np.full((4, 1), 3.0), [1.0], np.random.default_rng(1))
    tracker = Particle(walk, CIRCLE, [-3.0], [[0.5]], n_particles=20000, rng=2)
    tracker.run(zs)
    expected = grid_posterior(zs, walk, -3.0, 0.5)
    result = complex(tracker.weights @ np.exp(1j * tracker.particles[:, 0]))
    assert abs(result - expected) < 0.02
    assert abs(np.exp(1j * tracker.x[0]) - expected / abs(expected)) < 0.05


def test_particle_linear_gaussian_posterior_equals_kalman() -> None:
    particle = Particle(WALK, POSITION, [0.0, 1.0], np.eye(2), n_particles=20000, rng=0)
    kalman = Kalman(WALK, POSITION, [0.0, 1.0], np.eye(2))
    for z in ([0.5, 1.5], [np.nan, 1.0], None, [1.0, np.nan]):
        for tracker in (particle, kalman):
            tracker.predict()
            tracker.update(z)
        np.testing.assert_allclose(particle.x, kalman.x, atol=0.04)
        np.testing.assert_allclose(particle.P, kalman.P, atol=0.04)
        assert particle.log_likelihood == pytest.approx(kalman.log_likelihood, abs=0.05)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=40), st.integers(0, 1000))
def test_resampled_counts_are_within_one_of_the_weights(weights: list[float], seed: int) -> None:
    if sum(weights) > 0:
        share = np.array(weights) / sum(weights)
        indices = systematic_resample(share, np.random.default_rng(seed))
        assert len(indices) == len(share)
        counts = np.bincount(indices, minlength=len(share))
        assert np.abs(counts - len(share) * share).max() < 1 + 1e-9
        assert (np.diff(indices) >= 0).all()


def test_particle_resamples_few_effective_particles() -> None:
    always, never = (
        Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 50, rng=0, resample_below=share)
        for share in (1.0, 0.0)
    )
    for tracker in (always, never):
        tracker.update([1.0, 1.0])
    np.testing.assert_array_equal(always.weights, 1 / 50)
    assert np.ptp(never.weights) > 0
    np.testing.assert_array_equal(always.x, never.x)


# Random numbers


def run_states(tracker: Particle) -> Float:
    return tracker.run(np.ones((3, 2))).x


def test_particle_seed_repeats_and_generator_continues() -> None:
    def make(rng: Any) -> Particle:
        return Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 30, rng=rng)

    np.testing.assert_array_equal(run_states(make(3)), run_states(make(3)))
    np.testing.assert_array_equal(run_states(make(3)), run_states(make(np.random.default_rng(3))))
    shared = np.random.default_rng(3)
    assert not np.array_equal(run_states(make(shared)), run_states(make(shared)))


def test_particle_copies_and_clones_continue_the_generator() -> None:
    from sklearn.base import clone

    tracker = Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 30, rng=np.random.default_rng(5))
    copied, cloned = copy.deepcopy(tracker), clone(tracker)
    expected = run_states(Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 30, rng=5))
    for each in (tracker, copied, cloned):
        np.testing.assert_array_equal(run_states(each), expected)


def test_particle_new_seed_restarts_the_generator() -> None:
    tracker = Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 30, rng=5)
    tracker.predict()
    state = tracker._generator.bit_generator.state
    tracker.set_params(rng=5)
    assert tracker._generator.bit_generator.state == state
    tracker.set_params(rng=6)
    assert tracker._generator.bit_generator.state != state


def test_particle_assigned_belief_is_sampled() -> None:
    tracker = Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 5000, rng=5)
    tracker.predict()
    tracker.x, tracker.P = np.array([50.0, 60.0]), 4 * np.eye(2)
    tracker.predict()
    np.testing.assert_allclose(tracker.x, [50, 60], atol=0.2)
    np.testing.assert_allclose(tracker.P, 4.2 * np.eye(2), atol=0.4)


# Errors


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"x": [0.0]}, ValueError, r"x must have shape \(2,\); got \(1,\)"),
        ({"x": [0.0, np.nan]}, ValueError, "x must be finite"),
        ({"P": [[1, 2], [0, 1]]}, ValueError, "P must be symmetric"),
        ({"n_particles": 0}, ValueError, "n_particles must be at least 1"),
        ({"resample_below": 2.0}, ValueError, r"resample_below must lie in \[0, 1\]"),
        ({"rng": "dice"}, TypeError, "rng must be"),
        ({"rng": np.ones((1, 2))}, TypeError, "rng must be"),  # a np.matrix crashes numpy
        ({"motion": None}, TypeError, "motion must be a MotionModel"),
    ],
)
def test_invalid_parameters_raise(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    params: dict[str, Any] = {
        "motion": WALK,
        "measurement": POSITION,
        "x": [0.0, 0.0],
        "P": np.eye(2),
        "rng": 0,
    }
    with pytest.raises(error, match=message):
        Particle(**(params | change))


def test_invalid_calls_leave_the_filter_unchanged() -> None:
    tracker = Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 30, rng=0)
    calls: list[tuple[Callable[[], object], type[Exception], str]] = [
        (lambda: tracker.predict(1.0), ValueError, "u must be None or 0 for a method"),
        (lambda: tracker.predict(np.nan), ValueError, "u must be None or 0 for a method"),
        (lambda: tracker.predict(dt=-1.0), ValueError, "dt must be finite and not negative"),
        (lambda: tracker.predict(dt=np.nan), ValueError, "dt must be finite and not negative"),
        (lambda: tracker.update([1.0]), ValueError, r"z must have shape \(2,\)"),
        (
            lambda: tracker.update([1j, 1j]),
            TypeError,
            "where z is complex; got Linear",
        ),
    ]
    for call, error, message in calls:
        before, state = copy.deepcopy(vars(tracker)), tracker.generator_state
        with pytest.raises(error, match=message):
            call()
        assert difference(before, vars(tracker)) is None
        assert tracker.generator_state == state


class Bursting(RandomWalk):
    """Fails after it has drawn random numbers."""

    def sample(self, x: Any, rng: np.random.Generator, dt: float = 1.0) -> Float:
        return np.where(rng.random(np.shape(x)) < 2, np.inf, x)


def test_error_after_random_numbers_were_drawn_restores_the_generator() -> None:
    tracker = Particle(Bursting(0.1, 2), POSITION, [0.0, 0.0], 1.0, 30, rng=0)
    state, x = tracker.generator_state, tracker.x
    with np.errstate(invalid="ignore"), pytest.raises(ValueError, match="belief must stay finite"):
        tracker.predict()
    assert tracker.generator_state == state
    assert tracker.x is x


def test_particle_masked_and_infinite_numbers_are_missing() -> None:
    a, b = (Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 50, rng=0) for _ in range(2))
    a.update([np.nan, 1.0])
    b.update(np.ma.array([7.0, 1.0], mask=[True, False]))
    np.testing.assert_array_equal(a.x, b.x)
    b.update(np.array([np.inf, None]))
    np.testing.assert_array_equal(a.x, b.x)


def test_particle_invalid_snapshot_leaves_it_unchanged() -> None:
    tracker = Particle(VonMisesWalk(9.0), LINE, [0.0], [[1.0]], 30, rng=0)
    before = copy.deepcopy(vars(tracker))
    with pytest.raises(ValueError, match="one number a sensor"):
        tracker.update(np.ones(5, dtype=complex))
    assert difference(before, vars(tracker)) is None


def test_particle_runs_with_velocity_states() -> None:
    motion, position = ConstantVelocity(0.1), LinearMeasurement(np.eye(4)[::2], 0.1 * np.eye(2))
    run = Particle(motion, position, np.zeros(4), np.eye(4), 500, rng=1).run([[1.0, 1.0], None])
    assert run.x.shape == (2, 4)
    np.testing.assert_allclose(run.P, run.P.swapaxes(1, 2))


@pytest.mark.parametrize("rng", [None, np.timedelta64(1, "s")])
def test_seed_that_is_no_whole_number_is_refused(rng: Any) -> None:
    with pytest.raises(TypeError, match="rng must be a numpy Generator or a whole number"):
        Particle(WALK, POSITION, [0.0, 0.0], np.eye(2), 30, rng=rng)


def test_log_normal_equals_the_density_of_scipy() -> None:
    rng = np.random.default_rng(0)
    A, y = rng.normal(size=(3, 3)), rng.normal(size=(5, 3))
    R = A @ A.T + np.eye(3)
    expected = multivariate_normal(np.zeros(3), R).logpdf(y)
    np.testing.assert_allclose(log_normal(y, R), expected, rtol=1e-12)
