"""Local maxima of spectra against the definition, direction by direction."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from arrivals.trackers.beamforming import local_maxima

LEVELS = st.lists(st.sampled_from([0.0, 1.0, 2.0, 3.0]), min_size=3, max_size=8)


@given(LEVELS, st.booleans(), st.sampled_from([0.0, 1.5]))
def test_local_maxima_exceed_the_one_before_and_reach_the_one_after(
    level: list[float], circular: bool, rise: float
) -> None:
    n = len(level)
    if circular:
        around = [(level[k - 1], level[(k + 1) % n]) for k in range(n)]
    else:  # even about the ends
        even = [level[1], *level, level[-2]]
        around = [(even[k], even[k + 2]) for k in range(n)]
    expected = [
        x > before + rise and x >= after for x, (before, after) in zip(level, around, strict=True)
    ]
    power = np.array(level)
    found = local_maxima(power, circular=circular, joined=False, rise=rise)
    np.testing.assert_array_equal(found, expected)
    several = local_maxima(np.stack([power, power]), circular=circular, joined=False, rise=rise)
    np.testing.assert_array_equal(several, [expected, expected])


@given(LEVELS)
def test_joined_ends_are_one_maximum_at_most(level: list[float]) -> None:
    apart = local_maxima(np.array(level), circular=False, joined=False)
    joined = local_maxima(np.array(level), circular=False, joined=True)
    np.testing.assert_array_equal(joined[1:-1], apart[1:-1])
    assert joined[[0, -1]].sum() <= min(1, apart[[0, -1]].sum())
    inner, ends = max(level[1], level[-2]), max(level[0], level[-1])
    if ends > inner:
        assert joined[0 if level[0] >= level[-1] else -1]
