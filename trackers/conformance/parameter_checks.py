"""Checks of parameters, configurations and models of a tracker."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

from arrivals.parameters import Configurable, FrozenModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.conformance.comparison import assert_same, require
from arrivals.trackers.conformance.stepping import (
    MakeTracker,
    Measurements,
    copy_belief,
    copy_state,
    half_way,
    named_check,
    run_steps,
)


@named_check
def constructor_accepts_its_parameters(make: MakeTracker, measurements: Measurements) -> None:
    """Check that the constructor accepts the result of `get_params` and makes an equal tracker."""
    params = make().get_params(deep=False)
    rebuilt = type(make())(**params)
    assert_same(params, rebuilt.get_params(deep=False), "parameters")
    assert_same(
        run_steps(make(), measurements),
        run_steps(rebuilt, measurements),
        "the rebuilt one, step",
    )


@named_check
def setting_own_parameters_changes_nothing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `set_params` with the present values changes neither belief nor results."""
    for deep in (False, True):
        tracker, rest = half_way(make, measurements)
        expected = run_steps(copy.deepcopy(tracker), rest)
        before = copy_belief(tracker)
        changed = tracker.set_params(**tracker.get_params(deep=deep))
        require(changed is tracker, "set_params must return the tracker itself")
        assert_same(before, copy_belief(tracker), "after set_params")
        assert_same(expected, run_steps(tracker, rest), "after set_params, step")


@named_check
def unknown_parameter_is_refused(make: MakeTracker, measurements: Measurements) -> None:
    """Check that an unknown name, of the tracker or a part, is a ValueError without a change."""
    tracker, _ = half_way(make, measurements)
    before = copy_state(tracker)
    parts = [
        f"{name}__"
        for name, part in tracker.get_params(deep=False).items()
        if isinstance(part, Configurable)
    ]
    for part in ["", *parts]:
        name = f"{part}no_such_parameter"
        assert_refused(tracker.set_params, f"set_params({name}=1)", **{name: 1})
        assert_same(before, copy_state(tracker), f"after set_params({name}=1)")


def assert_refused(call: Callable[..., object], what: str, **params: Any) -> None:
    """Raise an AssertionError unless a call raises a ValueError."""
    try:
        call(**params)
    except ValueError:
        return
    raise AssertionError(f"{what} was accepted")


@named_check
def sklearn_clone_is_equal(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `sklearn.base.clone` makes a tracker with equal parameters and results."""
    from sklearn.base import clone

    fresh = clone(make())
    assert_same(run_steps(make(), measurements), run_steps(fresh, measurements), "the clone, step")
    tracker, _ = half_way(make, measurements)
    assert_same(tracker.get_params(deep=False), clone(tracker).get_params(deep=False), "parameters")


@named_check
def configuration_survives_json(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `from_dict` of `to_dict`, through JSON, makes a tracker with the same output."""
    config = json.loads(json.dumps(make().to_dict()))
    rebuilt = Tracker.from_dict(config)
    require(type(rebuilt) is type(make()), f"{type(make())} became {type(rebuilt)}")
    assert_same(
        run_steps(make(), measurements),
        run_steps(rebuilt, measurements),
        "the rebuilt one, step",
    )
    config["no_such_parameter"] = 1
    assert_refused(Tracker.from_dict, "from_dict with an unknown parameter", config=config)


@named_check
def models_are_not_modified(make: MakeTracker, measurements: Measurements) -> None:
    """Check that steps of a tracker do not change its models."""
    tracker = make()
    parts = {k: v for k, v in tracker.get_params(deep=False).items() if isinstance(v, FrozenModel)}
    numbers = copy.deepcopy({name: part.to_dict() for name, part in parts.items()})
    run_steps(tracker, measurements)
    for name, part in parts.items():
        require(getattr(tracker, name) is part, f"{name} was replaced")
        assert_same(numbers[name], part.to_dict(), name)
        require(copy.deepcopy(part) is part, f"{name} must return itself from deepcopy")
