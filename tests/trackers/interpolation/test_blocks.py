"""Blocks of snapshots, and quantities of an update that are computed when they are read."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from arrivals.motion_models import DelayWalk
from arrivals.scenarios.simulations.sampled_source import InterpolationTone
from arrivals.trackers.interpolation import VARIANTS, InterpolationEKF
from arrivals.typing import Float

TONE = InterpolationTone(n_steps=40)
NAMES = (
    *("x", "P", "x_prior", "P_prior", "x_post", "P_post", "z", "y", "S", "SI", "K", "F", "Q"),
    *("H", "R", "dim_x", "dim_z", "dim_u", "likelihood", "log_likelihood", "mahalanobis"),
)


def made(variant: str = "C") -> InterpolationEKF:
    return InterpolationEKF(TONE.measurement, DelayWalk(1e-4), variant=VARIANTS[variant], doa=0.9)


def samples(seed: int = 0) -> Float:
    return np.asarray(TONE.sample(np.random.default_rng(seed)).measurements)


@pytest.mark.parametrize("gap", ["none", "snapshots", "at the end", "all"])
@pytest.mark.parametrize("variant", list(VARIANTS))
def test_run_of_an_array_equals_run_of_its_rows(variant: str, gap: str) -> None:
    z = samples()
    rows = {"none": slice(0), "snapshots": slice(9, 14), "at the end": slice(-3, None)}
    z[rows.get(gap, slice(None))] = np.nan
    block, steps = made(variant), made(variant)
    ours, theirs = block.run(z), steps.run(list(z))
    for name in ("doa", "std", "x", "time", "label", "existence", "converged", "iterations"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)
    for name in NAMES:
        a, b = (getattr(tracker, name) for tracker in (block, steps))
        np.testing.assert_array_equal(a, b, err_msg=name)
    after = samples(1)  # the buffers are the same too
    np.testing.assert_array_equal(block.run(after).x, steps.run(list(after)).x)


@pytest.mark.parametrize("variant", list(VARIANTS))
@pytest.mark.parametrize("again", [copy.deepcopy, lambda t: pickle.loads(pickle.dumps(t))])
def test_quantities_of_an_update_are_those_of_that_update_whenever_read(
    variant: str, again: Any
) -> None:
    names = ("y", "K", "S", "SI", "log_likelihood", "likelihood", "mahalanobis")
    read, late = made(variant), made(variant)
    for z in samples():
        for tracker in (read, late):
            tracker.predict()
            tracker.update(z)
        now = {name: np.array(getattr(read, name)) for name in names}
    late = again(late)
    late.motion, late.gate = DelayWalk(0.5), None  # of the next step
    late.predict()
    for name in names:
        np.testing.assert_array_equal(getattr(late, name), now[name], err_msg=name)


def test_assigned_quantities_of_an_update_are_kept_until_the_next_one() -> None:
    tracker = made()
    for z in samples():
        tracker.predict()
        tracker.update(z)
    S, gain = copy.deepcopy(tracker).S, np.full(tracker.K.shape, 7.0)
    tracker.update(samples(1)[0])
    tracker.K = gain
    assert tracker.K is gain
    assert not np.array_equal(tracker.S, S)
    tracker.update(None)
    assert tracker.K is gain
    assert not tracker.y.any()
    tracker.update(samples(1)[1])
    assert tracker.K is not gain
