"""Checks of missing data: masks, huge numbers, channels without data, long gaps."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.trackers.base import Tracker
from arrivals.trackers.conformance.comparison import assert_near, assert_same, require
from arrivals.trackers.conformance.stepping import (
    MakeTracker,
    Measurements,
    named_check,
    run_step,
    run_steps,
)

LONG_GAP = 200  # steps


@named_check
def masked_and_huge_numbers_are_missing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that masked, infinite and huge numbers, and None in a list, count as NaN."""
    data = as_numbers(measurements)
    for steps in (slice(None), slice(1, 2)):  # throughout, and in one step
        expected = run_steps(make(), with_channel(data, np.nan, steps))
        for other in (np.inf, -1e200):
            found = run_steps(make(), with_channel(data, other, steps))
            assert_same(expected, found, f"{other:g} in place of NaN, step")
        hidden = with_channel(data, 1e3, steps)
        masked = np.ma.masked_array(hidden, np.isnan(with_channel(data, np.nan, steps)))
        assert_same(expected, run_steps(make(), masked), "masked in place of NaN, step")
        lists = masked.tolist()  # None where masked
        assert_same(expected, run_steps(make(), lists), "None in place of NaN, step")
        run = make().run(masked)
        assert_same(np.array([step["x"] for step in expected]), run.x, "x of the run of masked")


@named_check
def channel_of_zeros_is_missing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a sensor of an array with zeros alone in a step counts as NaN, with a warning."""
    if array_of(make()) is None:
        return
    data = as_numbers(measurements)
    spans = (slice(None), slice(1, 2)) if np.iscomplexobj(data) else (slice(None),)
    for steps in spans:  # a single sample of a sound may well be zero
        expected = run_steps(make(), with_channel(data, np.nan, steps))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            found = run_steps(make(), with_channel(data, 0.0, steps))
        assert_same(expected, found, "zero in place of NaN, step")


@named_check
def missing_channel_equals_array_without_it(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a sensor that is always NaN has the estimates of an array without it."""
    data, tracker = as_numbers(measurements), make()
    smaller = without_first_sensor(tracker)
    if smaller is None:
        return
    expected = [sources(smaller, z[..., 1:]) for z in data]
    found = [sources(tracker, z) for z in with_channel(data, np.nan, slice(None))]
    for n, (one, other) in enumerate(zip(expected, found, strict=True)):
        assert_near(one, other, f"estimate of step {n}")


@named_check
def estimate_widens_or_ends_in_a_gap(make: MakeTracker, measurements: Measurements) -> None:
    """Check that after a long gap there is no source, or the variances are larger."""
    tracker = make()
    run_steps(tracker, measurements)
    before = mean_variance(tracker)
    for _ in range(LONG_GAP):
        run_step(tracker, None)
    after, n_found = mean_variance(tracker), tracker.estimate.n_found
    require(
        n_found == 0 or after > before,
        f"{n_found} sources after {LONG_GAP} missing steps, mean variance {before} became {after}",
    )


def as_numbers(measurements: Measurements) -> NDArray[Any]:
    """Return measurements as one array of floats or complex numbers."""
    data = np.array(measurements)
    return data.astype(np.result_type(data, np.float64))


def with_channel(data: NDArray[Any], value: float, steps: slice) -> NDArray[Any]:
    """Return measurements with a value in place of the first number of the last axis."""
    changed = data.copy()
    if data.ndim == 1:
        changed[steps] = value
    else:
        changed[steps, ..., 0] = value
    return changed


def array_of(tracker: Tracker) -> SensorArray | None:
    """Return the array whose sensors are the last axis of a measurement, if any."""
    array = getattr(getattr(tracker, "measurement", None), "array", None)
    return array if isinstance(array, SensorArray) else None


def without_first_sensor(tracker: Tracker) -> Tracker | None:
    """Return such a tracker for the array without its first sensor; None if there is none."""
    array = array_of(tracker)
    if array is None:
        return None
    params = tracker.get_params(deep=False)
    response = getattr(params["measurement"], "response", None)
    less = {} if response is None else {"response": response.without([0])}
    parts = {name: each for name, each in params.items() if isinstance(each, Tracker)}
    params |= {name: without_first_sensor(each) for name, each in parts.items()}
    try:
        params["measurement"] = params["measurement"].replace(array=array.without([0]), **less)
        return type(tracker)(**params)
    except ValueError:  # the method requires the whole array
        return None


def sources(tracker: Tracker, z: Any) -> dict[str, Any]:
    """Return the fields of each source after a step."""
    run_step(tracker, z)
    return {name: getattr(tracker.estimate, name) for name in tracker.estimate.per_source}


def mean_variance(tracker: Tracker) -> float:
    """Return the mean variance of the entries of the state that are not NaN."""
    used = ~np.isnan(tracker.x.ravel())
    return float(np.diag(tracker.P)[used].mean()) if used.any() else 0.0
