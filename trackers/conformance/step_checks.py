"""Checks of the arguments of a step: time step and control input."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from arrivals.trackers.base import Tracker
from arrivals.trackers.conformance.comparison import assert_same
from arrivals.trackers.conformance.stepping import (
    MakeTracker,
    Measurements,
    copy_state,
    half_way,
    named_check,
)

INVALID_TIME_STEPS = (np.nan, np.inf, -1.0, "x", 1j, 10**400, None)
INVALID_CONTROLS = (np.nan, np.inf, "x", [np.nan])


@named_check
def invalid_time_step_changes_nothing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that such a `dt` is a ValueError or TypeError without a change."""
    tracker, _ = half_way(make, measurements)
    calls: dict[str, Callable[[Any], object]] = {
        "predict": lambda dt: tracker.predict(dt=dt),
        "run": lambda dt: tracker.run(measurements, dt),
        "run_batch": lambda dt: tracker.run_batch([measurements], dt),
    }
    for name, call in calls.items():
        for dt in INVALID_TIME_STEPS:
            assert_refused_without_change(tracker, call, dt, f"{name}(dt={dt!r})"[:60])


@named_check
def invalid_control_changes_nothing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that such a control, or one that a method does not have, is refused."""
    tracker, _ = half_way(make, measurements)
    has_control = getattr(tracker, "dim_u", 0) > 0
    for u in INVALID_CONTROLS if has_control else (*INVALID_CONTROLS, 1.0, [0.5]):
        assert_refused_without_change(tracker, tracker.predict, u, f"predict({u!r})")
    for none in (None, 0, 0.0):
        tracker.predict(none)


def assert_refused_without_change(
    tracker: Tracker, call: Callable[[Any], object], value: Any, what: str
) -> None:
    """Raise an AssertionError unless a call raises such an error and changes nothing."""
    before = copy_state(tracker)
    try:
        call(value)
    except (ValueError, TypeError):
        assert_same(before, copy_state(tracker), f"after {what}")
    else:
        raise AssertionError(f"{what} was accepted")
