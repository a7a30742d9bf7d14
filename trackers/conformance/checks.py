"""Checks that every tracker passes, those of other packages included.

Each check takes a function that makes a fresh tracker and a few valid measurements, and raises an
AssertionError with the difference. With pytest, one test per check:

    @pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
    def test_conforms(check):
        check(lambda: MyTracker(...), measurements)

and without, `check_tracker(lambda: MyTracker(...), measurements)`.
"""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.base import Tracker
from arrivals.trackers.conformance.belief_checks import (
    belief_has_mean_and_covariance,
    estimate_is_a_frozen_record,
)
from arrivals.trackers.conformance.comparison import assert_near, assert_same, require
from arrivals.trackers.conformance.missing_checks import (
    channel_of_zeros_is_missing,
    estimate_widens_or_ends_in_a_gap,
    masked_and_huge_numbers_are_missing,
    missing_channel_equals_array_without_it,
)
from arrivals.trackers.conformance.parameter_checks import (
    configuration_survives_json,
    constructor_accepts_its_parameters,
    models_are_not_modified,
    setting_own_parameters_changes_nothing,
    sklearn_clone_is_equal,
    unknown_parameter_is_refused,
)
from arrivals.trackers.conformance.step_checks import (
    invalid_control_changes_nothing,
    invalid_time_step_changes_nothing,
)
from arrivals.trackers.conformance.stepping import (
    Check,
    MakeTracker,
    Measurements,
    copy_belief,
    copy_state,
    half_way,
    named_check,
    run_step,
    run_steps,
)


@named_check
def same_input_gives_same_output(make: MakeTracker, measurements: Measurements) -> None:
    """Check that two interleaved trackers and a third one agree bit by bit."""
    one, two = make(), make()
    turns = [(run_step(one, z), run_step(two, z)) for z in measurements]
    for n, (first, second) in enumerate(turns):
        assert_same(first, second, f"step {n} of two interleaved trackers")
    assert_same(
        [first for first, _ in turns], run_steps(make(), measurements), "a later tracker, step"
    )


@named_check
def missing_measurement_keeps_belief(make: MakeTracker, measurements: Measurements) -> None:
    """Check that None or NaN, at the first or a later step, does not change the belief."""
    for missing in (None, np.nan, np.full(np.shape(measurements[0]), np.nan)):
        for tracker in (make(), half_way(make, measurements)[0]):
            tracker.update(missing)
            tracker.predict()
            before = copy_sources(tracker)
            tracker.update(missing)
            assert_same(before, copy_sources(tracker), f"after update({missing})")
            run_steps(tracker, measurements)


def copy_sources(tracker: Tracker) -> dict[str, Any]:
    """Return a copy of the belief, without the per-step fields of the estimate."""
    estimate = tracker.estimate
    sources = {name: getattr(estimate, name) for name in estimate.per_source}
    return copy.deepcopy({"x": tracker.x, "P": tracker.P, "estimate": sources})


@named_check
def pickled_tracker_continues_like_the_original(
    make: MakeTracker, measurements: Measurements
) -> None:
    """Check that a tracker pickled half-way continues with the same results."""
    tracker, rest = half_way(make, measurements)
    loaded = pickle.loads(pickle.dumps(tracker))
    assert_same(copy_belief(tracker), copy_belief(loaded), "after pickling")
    assert_same(run_steps(tracker, rest), run_steps(loaded, rest), "after pickling, step")


@named_check
def deep_copy_is_independent(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a deep copy has the same results and does not change the original."""
    tracker, rest = half_way(make, measurements)
    before = copy_state(tracker)
    copied = run_steps(copy.deepcopy(tracker), rest)
    assert_same(before, copy_state(tracker), "the original, after steps of its copy")
    assert_same(copied, run_steps(tracker, rest), "after copying, step")


@named_check
def run_equals_the_predict_update_loop(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `run` has the results and the final state of the loop of predict and update."""
    with_gaps = [None, *measurements, None]
    looped, tracker = make(), make()
    steps = [run_step(looped, z) for z in with_gaps]
    run = tracker.run(with_gaps)
    assert_same(len(steps), len(run), "number of steps")
    for n, step in enumerate(steps):
        assert_same(step["x"], run.x[n], f"x of step {n}")
        assert_same(step["estimate"], run.estimate(n), f"estimate of step {n}")
    assert_same(copy_belief(looped), copy_belief(tracker), "after the run")
    require(len(make().run([])) == 0, "a run without measurements must have no steps")


@named_check
def batch_equals_single_runs(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `run_batch` equals single runs from the present state, to 1e-9."""
    tracker, _ = half_way(make, measurements)
    before = copy_state(tracker)
    batch = [list(measurements), list(measurements)[::-1]]
    runs = list(tracker.run_batch(batch))
    assert_same(before, copy_state(tracker), "after run_batch")
    assert_same(len(batch), len(runs), "number of runs")
    for n, sequence in enumerate(batch):
        single = copy.deepcopy(tracker).run(sequence)
        assert_near(dict(single.fields), dict(runs[n].fields), f"run {n} of the batch")
        assert_near({"x": single.x}, {"x": runs[n].x}, f"run {n} of the batch")


@named_check
def earlier_results_are_not_modified(make: MakeTracker, measurements: Measurements) -> None:
    """Check that later steps do not write into results of earlier ones."""
    tracker = make()
    kept: list[dict[str, Any]] = []
    copies: list[dict[str, Any]] = []

    def keep() -> None:
        kept.append({"x": tracker.x, "P": tracker.P, "estimate": tracker.estimate})
        copies.append(copy.deepcopy(kept[-1]))

    keep()
    for z in measurements:
        tracker.predict()
        keep()
        tracker.update(z)
        keep()
    assert_same(copies, kept, "earlier results, half step")


@named_check
def measurement_is_neither_modified_nor_kept(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `update` neither modifies a measurement nor keeps its array."""
    expected = run_steps(make(), copy.deepcopy(measurements))
    tracker = make()
    for n, z in enumerate(measurements):
        buffer = np.array(z)
        tracker.predict()
        tracker.update(buffer)
        assert_same(np.array(z), buffer, f"measurement {n}")
        buffer[...] = 0
        assert_same(
            expected[n], copy_belief(tracker), f"step {n}, after the measurement's array was reused"
        )


@named_check
def invalid_measurement_changes_nothing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that wrong shapes and text are a ValueError or TypeError without a change."""
    shape = np.shape(measurements[0]) or (1,)
    longer = (*shape[:-1], shape[-1] + 1)
    bad: dict[str, ArrayLike] = {
        "one value too many": np.ones(longer),
        "two measurements at once": np.ones((2, *longer)),
        "text": "text",
        "an array of text": np.full(shape, "text"),
    }
    for tracker in (make(), half_way(make, measurements)[0]):
        tracker.predict()
        before = copy_state(tracker)
        for what, z in bad.items():
            try:
                tracker.update(z)
            except (ValueError, TypeError):
                assert_same(before, copy_state(tracker), f"after {what}")
            else:
                raise AssertionError(f"{what} was accepted: update({z!r})")


@named_check
def filterpy_saver_works(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `filterpy.common.Saver` records `x` and `P` as arrays."""
    from filterpy.common import Saver

    tracker = make()
    saver = Saver(tracker, save_current=True)
    beliefs = [copy_belief(tracker)]
    for z in measurements:
        beliefs.append(run_step(tracker, z))
        saver.save()
    saver.to_array()
    for name in ("x", "P"):
        assert_same(np.array([belief[name] for belief in beliefs]), getattr(saver, name), name)


CHECKS: tuple[Check, ...] = (
    belief_has_mean_and_covariance,
    same_input_gives_same_output,
    missing_measurement_keeps_belief,
    estimate_is_a_frozen_record,
    pickled_tracker_continues_like_the_original,
    deep_copy_is_independent,
    run_equals_the_predict_update_loop,
    batch_equals_single_runs,
    earlier_results_are_not_modified,
    measurement_is_neither_modified_nor_kept,
    constructor_accepts_its_parameters,
    setting_own_parameters_changes_nothing,
    unknown_parameter_is_refused,
    sklearn_clone_is_equal,
    configuration_survives_json,
    invalid_measurement_changes_nothing,
    models_are_not_modified,
    filterpy_saver_works,
    masked_and_huge_numbers_are_missing,
    channel_of_zeros_is_missing,
    missing_channel_equals_array_without_it,
    estimate_widens_or_ends_in_a_gap,
    invalid_time_step_changes_nothing,
    invalid_control_changes_nothing,
)


def check_tracker(make: MakeTracker, measurements: Measurements) -> None:
    """Run all checks on a tracker.

    Parameters
    ----------
    make : callable
        Returns a fresh tracker, always the same.
    measurements : array_like, shape (n_steps, ...), or sequence
        A few valid measurements, at least two.

    Raises
    ------
    AssertionError
        If a check fails; the message starts with its name.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> model = ArraySnapshot(SensorArray.ula(4, spacing=0.5), wavelength=1.0)
    >>> check_tracker(lambda: CBF(model), [[1, 1, 1, 1], [1, 1j, -1, -1j]])
    """
    for check in CHECKS:
        check(make, measurements)
