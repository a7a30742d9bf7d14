"""Steps of a tracker under test, and copies of its belief and state."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from numpy.typing import ArrayLike, NDArray

from arrivals.trackers.base import Tracker
from arrivals.trackers.conformance.comparison import require

MakeTracker: TypeAlias = Callable[[], Tracker]
Measurements: TypeAlias = Sequence[ArrayLike] | NDArray[Any]
Check: TypeAlias = Callable[[MakeTracker, Measurements], None]


def named_check(check: Check) -> Check:
    """Decorate a check so that every failure, including exceptions, starts with its name."""

    @functools.wraps(check)
    def run(make: MakeTracker, measurements: Measurements) -> None:
        try:
            require(len(measurements) >= 2, "requires at least two measurements")
            check(make, copy.deepcopy(measurements))
        except AssertionError as error:
            raise AssertionError(f"{check.__name__}: {error}") from None
        except Exception as error:
            kind = type(error).__name__
            raise AssertionError(f"{check.__name__}: raised {kind}: {error}") from error

    return run


def run_step(tracker: Tracker, z: ArrayLike | None) -> dict[str, Any]:
    """Predict, update, and return a copy of the belief."""
    tracker.predict()
    tracker.update(z)
    return copy_belief(tracker)


def run_steps(tracker: Tracker, measurements: Measurements) -> list[dict[str, Any]]:
    """Return copies of the beliefs after each measurement."""
    return [run_step(tracker, z) for z in measurements]


def copy_belief(tracker: Tracker) -> dict[str, Any]:
    """Return a copy of `x`, `P` and the estimate."""
    return copy.deepcopy({"x": tracker.x, "P": tracker.P, "estimate": tracker.estimate})


def copy_state(tracker: Tracker) -> dict[str, Any]:
    """Return a copy of all attributes."""
    return copy.deepcopy(vars(tracker))


def half_way(make: MakeTracker, measurements: Measurements) -> tuple[Tracker, Measurements]:
    """Return a tracker after the first half of the measurements, and the second half."""
    half = (len(measurements) + 1) // 2
    tracker = make()
    run_steps(tracker, measurements[:half])
    return tracker, measurements[half:]
