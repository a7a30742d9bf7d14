"""The conformance checks themselves: each finds a fault, a valid tracker passes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from faulty_steps import STEP_FAULTS
from faulty_trackers import (
    FAULTS,
    NUMBERS,
    DropsAParameter,
    ReplacesItsModel,
    Smoother,
    WritesIntoItsArrays,
)

from arrivals.motion_models import BernoulliVonMises
from arrivals.parameters import FrozenModel
from arrivals.trackers import Tracker
from arrivals.trackers.conformance import CHECKS, check_tracker, difference

ALL_FAULTS = FAULTS + STEP_FAULTS


def test_faults_cover_all_checks() -> None:
    assert {name for _, name, _ in ALL_FAULTS} == {check.__name__ for check in CHECKS}


@pytest.mark.parametrize(
    ("make", "name", "message"), ALL_FAULTS, ids=[fault[0].__name__ for fault in ALL_FAULTS]
)
def test_check_fails_with_its_name(make: Callable[..., Tracker], name: str, message: str) -> None:
    check = next(check for check in CHECKS if check.__name__ == name)
    params: dict[str, Any] = {"gain": 0.25} if make is DropsAParameter else {}
    params |= {"motion": BernoulliVonMises()} if make is ReplacesItsModel else {}
    with pytest.raises(AssertionError, match=f"(?s)^{name}: .*({message})"):
        check(lambda: make(**params), NUMBERS)


def test_valid_tracker_passes_all_checks() -> None:
    check_tracker(Smoother, NUMBERS)
    check_tracker(lambda: Smoother(0.3, BernoulliVonMises()), list(NUMBERS))


def test_check_tracker_raises_the_first_failure() -> None:
    with pytest.raises(AssertionError, match=r"^earlier_results_are_not_modified"):
        check_tracker(WritesIntoItsArrays, NUMBERS)


def test_check_with_one_measurement_is_refused() -> None:
    with pytest.raises(AssertionError, match="requires at least two measurements"):
        CHECKS[0](Smoother, NUMBERS[:1])


class Part(FrozenModel):
    def __init__(self, number: float) -> None:
        self.number = number


def test_difference_compares_nested_values() -> None:
    a = {"parts": [Part(1.0), (np.nan, "text")], "rng": np.random.default_rng(1)}
    b = {"parts": [Part(1.0), (np.nan, "text")], "rng": np.random.default_rng(1)}
    assert difference(a, b) is None
    b["rng"].random()  # type: ignore[attr-defined]
    assert "rng.state" in str(difference(a, b))
    assert difference([Part(1.0)], [Part(2.0)]) == "value.0.number: 1.0 became 2.0"
    assert difference(np.zeros(2), np.zeros(3)) is not None
    assert difference(np.zeros(2), np.zeros(2, dtype=int)) is not None
    assert difference(1, 1.0) == "value: 1 became 1.0"
    assert difference({"a": 1}, {"b": 1}) == "value: ['a'] became ['b']"


def test_difference_of_cyclic_references_ends() -> None:
    a, b = Part(1.0), Part(1.0)
    a.other, b.other = b, a  # type: ignore[attr-defined]
    assert difference(a, b) is None
