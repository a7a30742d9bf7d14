"""Kinds of malformed values that once came through as another error, or as a wrong number."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import (
    ArraySnapshot,
    LinearMeasurement,
    LogNormalRSS,
    SensorArray,
)
from arrivals.motion_models import RandomWalk
from arrivals.trackers import IMM, PAST, RSSVB, Kalman, Tracker
from arrivals.trackers.autoregressive.settings import NoiseSettings, RegressionSettings
from arrivals.trackers.interpolation.variants import Variant
from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.trackers.rss.inference.solution import Marginals

ARRAY = np.eye(3)
ANY: Any = ARRAY
WALK, RSS = RandomWalk(1.0), LogNormalRSS(10.0 * np.eye(4)[:, :2], position=(0, 1))


def imm(M: Any) -> IMM:
    position = LinearMeasurement([[1.0]], [[0.01]])
    slow, fast = (Kalman(RandomWalk(q, 1), position, [0.0], [[1.0]]) for q in (1e-4, 1.0))
    return IMM([slow, fast], mu=[0.5, 0.5], M=M)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: imm(np.full((2, 2), 1e308)), "M must hold probabilities; got"),
        (lambda: Variant(aligned=ANY), "aligned must be one of False, True; got"),
        (lambda: Tracker.from_dict({"type": ARRAY}), "there is no tracker '[[1.0"),
        (lambda: Tracker.from_dict({"type": -(10**5000)}), "there is no tracker 'an int'"),
        (lambda: Tracker.from_dict({"cups": ARRAY}), "config must be a dictionary"),
        (lambda: RSSVB(WALK, RSS, np.zeros((0, 2)), np.eye(2)), "x0 must have at least one source"),
        (lambda: SourceBeliefs.from_state(np.zeros(3), ARRAY * 1e300, 2), "P must be finite"),
    ],
)
def test_malformed_values_are_refused_in_one_line(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: IMM({1.0, 2.0}, mu=[0.5, 0.5], M=np.eye(2)), "filters must be a sequence; got {"),  # type: ignore[arg-type]
        (lambda: RegressionSettings(correction=ANY), "correction must be a bool; got"),
        (lambda: NoiseSettings(adapt_process_noise=ANY), "adapt_process_noise must be a bool; got"),
    ],
)
def test_values_of_another_type_are_refused_in_one_line(
    call: Callable[[], object], message: str
) -> None:
    with pytest.raises(TypeError, match=re.escape(message)) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_belief_after_any_gap_has_the_moments_of_its_update() -> None:
    P = np.diag([1e25, 1e25, 1.0])[None]
    before = SourceBeliefs(np.zeros((1, 3)), P, np.zeros(1), np.ones(1))
    moments = Marginals(np.ones(1), np.diag([0.1, 0.2])[None])
    after = before.updated(np.zeros(1), np.array([[1.0, 2.0]]), moments, (0, 1), RandomWalk(1.0, 3))
    np.testing.assert_allclose(after.P[0], np.diag([0.1, 0.2, 1.0]))
    np.testing.assert_array_equal(after.x, [[1.0, 2.0, 0.0]])


def test_past_resumes_with_incomplete_snapshots_after_it_has_forgotten_all() -> None:
    model = ArraySnapshot(SensorArray.ula(6, spacing=0.5), wavelength=1.0)
    tracker = PAST(model, n_sources=1)
    z = model.array.steering_vector(0.3, 1.0)
    tracker.update(np.where(np.arange(6) == 2, np.nan, z))
    tracker.predict(dt=2.0**31)
    tracker.update(np.where(np.arange(6) == 4, np.nan, z))
    assert np.isfinite(tracker.energy)
