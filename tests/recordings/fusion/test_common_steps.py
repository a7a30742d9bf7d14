"""Steps of common time: laws of the nearest step, of grids, and of steps of tables."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.recordings.fusion.common_steps import (
    grid,
    interval,
    members,
    nearest_steps,
    table_steps,
)

TIMES = st.lists(st.floats(-50, 50), min_size=1, max_size=20)


@given(TIMES, TIMES, st.floats(0.01, 5))
def test_nearest_step_is_that_of_a_search_through_all(
    time: list[float], steps: list[float], half: float
) -> None:
    at, middles = np.array(time), np.unique(steps)
    found = nearest_steps(at, middles, half)
    distance = np.abs(at[:, None] - middles)
    inside = distance.min(axis=1) <= half * (1 + 1e-9)
    np.testing.assert_array_equal(found >= 0, inside)
    chosen = distance[np.flatnonzero(inside), found[inside]]
    np.testing.assert_array_equal(chosen, distance.min(axis=1)[inside])


def test_nearest_step_without_steps_is_none() -> None:
    np.testing.assert_array_equal(nearest_steps(np.ones(2), np.zeros(0), 1.0), [-1, -1])


@given(
    st.lists(st.tuples(st.floats(-5, 5), st.integers(1, 30)), min_size=1, max_size=4),
    st.floats(0.1, 3),
)
def test_stations_of_one_duration_lose_no_step_and_use_none_twice(
    stations: list[tuple[float, int]], duration: float
) -> None:
    times = [np.asarray(start + duration * np.arange(n), float) for start, n in stations]
    steps = grid(times, duration)
    taken = members(times, steps, duration)
    assert taken.shape == (len(steps), len(times))
    for k, own in enumerate(times):
        which = np.flatnonzero(taken[:, k] >= 0)
        np.testing.assert_array_equal(taken[which, k], np.arange(len(own)))
        assert (np.abs(steps[which] - own) <= duration / 2 * (1 + 1e-6)).all()


def test_station_with_shorter_steps_gives_the_nearest_of_several() -> None:
    short, long = np.arange(0.25, 4, 0.5), np.arange(0.5, 4, 1.0)
    taken = members([long, short + 0.05], long, 1.0)
    np.testing.assert_array_equal(taken[:, 1], [0, 2, 4, 6])


def test_grid_of_too_many_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="must have at most 10000000 steps in all; got 1000000001"):
        grid([np.array([0.0, 1e9])], 1.0)


def test_common_times_are_steps_and_scattered_ones_are_put_in_intervals() -> None:
    common = np.repeat([0.0, 1.0, 1.5, 9.0], 2)
    steps, at, duration = table_steps(common, np.tile([0, 1], 4), None)
    np.testing.assert_array_equal(steps, [0, 1, 1.5, 9])
    np.testing.assert_array_equal(at, np.repeat([0, 1, 2, 3], 2))
    assert duration == 1.0
    one, other = np.arange(10.0), np.arange(10.0) + 0.31
    time, station = np.concatenate([one, other]), np.repeat([0, 1], 10)
    steps, at, duration = table_steps(time, station, None)
    assert (len(steps), duration) == (10, 1.0)
    np.testing.assert_array_equal(at, np.tile(np.arange(10), 2))
    assert len(table_steps(time, station, 5.0)[0]) == 3
    assert interval(np.zeros(3), np.arange(3)) == 1.0


@given(st.lists(st.tuples(st.floats(0, 100), st.integers(0, 3)), min_size=1, max_size=30),
       st.floats(0.1, 10))  # fmt: skip
def test_rows_of_a_step_of_a_table_are_within_one_duration(
    rows: list[tuple[float, int]], duration: float
) -> None:
    time, station = np.array([t for t, _ in rows]), np.array([s for _, s in rows])
    steps, at, _ = table_steps(time, station, duration)
    assert (np.diff(steps) > 0).all()
    for step in range(len(steps)):
        assert np.ptp(time[at == step]) <= duration * (1 + 1e-6)
        assert steps[step] == pytest.approx(time[at == step].mean())
