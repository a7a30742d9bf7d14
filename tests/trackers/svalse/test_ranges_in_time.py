"""SVALSE with ranges from step to step: steps of any length, walks that hardly move."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.trackers import SVALSE
from arrivals.typing import Complex

LINE = SensorArray.ula(16, 0.5)
WALK = BernoulliVonMises(sigma_doa=0.02)


def measured(model: ArraySnapshot, n_steps: int, distance: float) -> Complex:
    """Return measurements of one source that stands still."""
    w = np.ones((n_steps, model.n_snapshots, 1) if model.n_snapshots > 1 else (n_steps, 1))
    doa = np.full((n_steps, 1), 0.2)
    rng = np.random.default_rng(0)
    return model.simulate(doa, w, rng, distance=np.full((n_steps, 1), distance))


@pytest.mark.parametrize("nearest", [None, 4.0])
def test_two_steps_widen_a_range_as_one_of_twice_the_length(nearest: float | None) -> None:
    model = ArraySnapshot(LINE, 1.0, n_snapshots=4, noise=1e-3, unknowns="range", nearest=nearest)
    tracker: Any = SVALSE(model, WALK)
    tracker.update(measured(model, 1, 15.0)[0])
    assert np.isfinite(tracker.estimate.range).all()
    once, twice = copy.deepcopy(tracker), copy.deepcopy(tracker)
    once.predict(dt=2.0)
    for _ in range(2):
        twice.predict()
    np.testing.assert_allclose(once.kappa[0], twice.kappa[0], rtol=1e-4, atol=1e-2)
    assert once.kappa[0, 2] < 0.7 * tracker.kappa[0, 2]


@pytest.mark.parametrize("walk_range", [None, 1e-3, 0.0])
@pytest.mark.parametrize("predicts", [True, False])
def test_curved_wave_stays_curved_however_certain(walk_range: float | None, predicts: bool) -> None:
    """Of a curvature with less uncertainty than that of the prior of a plane wave."""
    model = ArraySnapshot(LINE, 1.0, n_snapshots=10, noise=1e-3, unknowns="range")
    tracker: Any = SVALSE(model, WALK.replace(walk_range=walk_range))
    ranges = []
    for z in measured(model, 6, 30.0):
        if predicts:
            tracker.predict()
        tracker.update(z)
        ranges.append(tracker.estimate.range)
    np.testing.assert_allclose(np.array(ranges), np.full((6, 1), 30.0), rtol=0.02)
