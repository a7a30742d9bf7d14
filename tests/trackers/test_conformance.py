"""Every registered tracker passes the conformance checks.

The cases are in `tests/helpers/conformance_cases`; a new tracker gets a line in the list of its
family.
"""

import pytest
from conformance_cases.autoregressive import TRACKERS as AUTOREGRESSIVE
from conformance_cases.directions import TRACKERS as DIRECTIONS
from conformance_cases.fusion import TRACKERS as FUSION
from conformance_cases.gaussian import TRACKERS as GAUSSIAN
from conformance_cases.interpolation import TRACKERS as INTERPOLATION
from conformance_cases.rss import TRACKERS as RSS
from conformance_cases.subspace import TRACKERS as SUBSPACE

from arrivals.trackers import available, find
from arrivals.trackers.conformance import CHECKS, Check, MakeTracker, Measurements

TRACKERS = [*DIRECTIONS, *GAUSSIAN, *INTERPOLATION, *AUTOREGRESSIVE, *SUBSPACE, *RSS, *FUSION]
IDS = [f"{name}-{n}" for n, (name, _, _) in enumerate(TRACKERS)]
N_SOURCES = [2] * len(DIRECTIONS) + [1] * (len(TRACKERS) - len(DIRECTIONS))

every_tracker = pytest.mark.parametrize(("name", "make", "measurements"), TRACKERS, ids=IDS)


# forms that refer to the middle of the whole array, where a missing sensor is not one left out
REFER_TO_THE_MIDDLE = "missing_channel_equals_array_without_it"


def refers_to_the_middle(name: str, make: MakeTracker) -> bool:
    """Return whether phases or ranges count from the middle of the sensors."""
    unknowns = getattr(getattr(make(), "measurement", None), "unknowns", "azimuth")
    has_two = name in ("svalse", "valse") and unknowns != "azimuth"
    return name == "interpolation_ekf" or has_two


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@every_tracker
def test_conforms(
    name: str,
    make: MakeTracker,
    measurements: Measurements,
    check: Check,
    request: pytest.FixtureRequest,
) -> None:
    if check.__name__ == REFER_TO_THE_MIDDLE and refers_to_the_middle(name, make):
        request.applymarker(pytest.mark.xfail)
    check(make, measurements)


@pytest.mark.parametrize(
    ("case", "n_sources"), list(zip(TRACKERS, N_SOURCES, strict=True)), ids=IDS
)
def test_case_has_the_named_tracker_and_detects_sources(
    case: tuple[str, MakeTracker, Measurements], n_sources: int
) -> None:
    name, make, measurements = case
    assert type(make()) is find(name)
    assert make().run(measurements).n_found.max() >= n_sources


def test_every_built_in_tracker_is_in_the_list() -> None:
    ours = {name for name in available() if find(name).__module__.startswith("arrivals.")}
    assert ours == {name for name, _, _ in TRACKERS}
