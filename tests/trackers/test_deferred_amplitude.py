"""Amplitudes of an estimate that are computed when they are read, and the state of a report."""

import copy
import pickle
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import ESPRIT, MUSIC, DirectionEstimate, DirectionTracker, RootMUSIC
from arrivals.trackers.conformance import difference
from arrivals.typing import Complex

MODEL = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=1e-2, n_snapshots=20)


def block() -> Complex:
    truth = np.tile([-0.4, 0.5], (1, 1))
    w = np.array([1.0, 1.0j]) * np.exp(2j * np.random.default_rng(1).random((1, 20, 2)))
    return np.asarray(MODEL.simulate(truth, w, np.random.default_rng(0))[0])


def deferred(made: list[int]) -> DirectionEstimate:
    """An estimate of one source that counts how often its amplitude is computed."""

    def amplitude() -> Complex:
        made.append(1)
        return np.array([3j])

    one = np.ones(1)
    return DirectionEstimate(0.5 * one, one, one, amplitude, np.array([7]))  # type: ignore[arg-type]


def test_amplitude_is_computed_once_and_only_if_read() -> None:
    made: list[int] = []
    estimate = deferred(made)
    assert estimate.n_found == 1
    assert estimate.doa == 0.5
    assert not made
    assert estimate.amplitude is estimate.amplitude
    assert estimate.rows()[0][-1] == pytest.approx(20 * np.log10(3))
    assert made == [1]


def test_estimate_with_deferred_amplitude_has_no_other_attributes() -> None:
    with pytest.raises(AttributeError, match="DirectionEstimate has no attribute 'range'"):
        deferred([]).range  # type: ignore[attr-defined]  # noqa: B018
    assert not hasattr(DirectionEstimate.empty(), "_amplitude")


def twice(amplitude: Complex) -> Complex:
    return 2 * amplitude


@pytest.mark.parametrize(
    "duplicate", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))]
)
def test_copies_have_numbers_and_equal_the_original(
    duplicate: Callable[[DirectionEstimate], DirectionEstimate],
) -> None:
    one = np.ones(1)
    function = partial(twice, np.array([3j]))
    estimate = DirectionEstimate(one, one, one, function, np.array([7]))  # type: ignore[arg-type]
    other = duplicate(estimate)
    assert vars(other).keys() == DirectionEstimate.per_source.keys() | {
        "converged", "iterations", "noise"
    }  # fmt: skip
    assert difference(estimate, other, "estimate") is None
    np.testing.assert_array_equal(other.amplitude, [6j])


@pytest.mark.parametrize("kind", [MUSIC, RootMUSIC, ESPRIT])
def test_amplitudes_and_state_do_not_depend_on_when_they_are_read(
    kind: type[MUSIC] | type[RootMUSIC] | type[ESPRIT],
) -> None:
    tracker, z = kind(MODEL, n_sources=2), block()
    tracker.update(z)
    estimate = tracker.estimate
    at_once = copy.deepcopy(tracker)
    expected = at_once.estimate.amplitude
    np.testing.assert_allclose(abs(expected), 1.0, atol=0.05)
    z[:] = 0.0  # the caller's array
    tracker.predict()
    assert np.isnan(tracker.x).all()
    np.testing.assert_array_equal(estimate.amplitude, expected)
    np.testing.assert_array_equal(at_once.x, estimate.doa)


def test_state_keeps_the_number_of_slots_of_its_report() -> None:
    read, unread = (MUSIC(MODEL, max_sources=3) for _ in range(2))
    for tracker in (read, unread):
        tracker.update(block())
    assert read.x.shape == (3,)
    for tracker in (read, unread):
        tracker.set_params(max_sources=5)
    np.testing.assert_array_equal(unread.x, read.x)
    assert unread.P.shape == (3, 3)
    unread.predict()
    assert unread.x.shape == (5,)


def test_state_that_is_assigned_is_kept_until_the_next_report() -> None:
    tracker: DirectionTracker = MUSIC(MODEL, n_sources=2)
    tracker.update(block())
    P = tracker.P
    tracker.x = np.zeros(2)
    assert tracker.P is P
    tracker.P = np.eye(2)
    np.testing.assert_array_equal(tracker.x, [0.0, 0.0])
    tracker.predict()
    assert not tracker.P.any()
