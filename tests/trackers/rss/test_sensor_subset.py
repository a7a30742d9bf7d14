"""Updates by a subset of the sensors, and by cells that exchange posteriors."""

from typing import Any

import numpy as np
import pytest

from arrivals.scenarios import create
from arrivals.scenarios.reproduce.rss.trials import draws
from arrivals.scenarios.simulations.signal_strength import Table1K3
from arrivals.trackers import RSSVB, VariationalSolver
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.sensor_subset import most_informative, nearest, update_by_cells
from arrivals.typing import Bool

PROBLEM = draws(Table1K3(), 4, 0).problem
TRIAL: Any = create("rss_crossing").sample(np.random.default_rng(0))


def entropy_gain(problem: JointPosterior, used: Bool) -> float:
    """Return log|J| with the readings of some sensors, of the first row."""
    levels = problem.propagation.levels(problem.prior.mu, problem.prior.theta)
    J = problem._replace(W=np.where(used, problem.W, 0.0)).information(levels)
    return float(np.linalg.slogdet(J)[1][0])


def tracker(**solver: Any) -> Any:
    return TRIAL.tracker("rss_vb", solver=VariationalSolver(**solver))


@pytest.mark.parametrize("choose", [nearest, most_informative])
def test_n_sensors_with_readings_are_chosen(choose: Any) -> None:
    W = PROBLEM.W.copy()
    W[:, ::2] = 0
    used = choose(PROBLEM._replace(W=W), 9)
    assert (used.sum(axis=1) == 9).all()
    assert not used[:, ::2].any()


def test_information_gains_more_than_nearness_and_than_chance() -> None:
    rng = np.random.default_rng(0)
    gain = entropy_gain(PROBLEM, most_informative(PROBLEM, 9))
    assert gain > entropy_gain(PROBLEM, nearest(PROBLEM, 9))
    for _ in range(20):
        chance = np.zeros(PROBLEM.W.shape, dtype=np.bool_)
        chance[:, rng.choice(100, 9, replace=False)] = True
        assert gain > entropy_gain(PROBLEM, chance)


def test_first_sensor_has_the_largest_gain_of_all() -> None:
    first = most_informative(PROBLEM, 1)
    gains = [entropy_gain(PROBLEM, np.arange(100) == i) for i in range(100)]
    assert first[0].argmax() == int(np.argmax(gains))


def test_sources_take_turns_with_the_nearest_sensors() -> None:
    square = PROBLEM.propagation.offsets(PROBLEM.prior.theta).square
    used = nearest(PROBLEM, 3)
    closest = square.argmin(axis=-1)
    assert all(used[b, closest[b]].all() for b in range(4))


def test_all_sensors_are_the_default() -> None:
    usual, all_used = (tracker(**solver).run(TRIAL.measurements[:5]).position
                       for solver in ({}, {"sensors_used": 100}))  # fmt: skip
    np.testing.assert_array_equal(usual, all_used)


def test_subset_is_followed_step_by_step_and_in_a_batch_and_its_fit_is_of_the_subset() -> None:
    one = tracker(sensors_used=20)
    each = one.run(TRIAL.measurements[:5])
    batch = tracker(sensors_used=20).run_batch([TRIAL.measurements[:5]] * 2)
    np.testing.assert_allclose(batch[0].position, each.position, atol=1e-9)
    assert np.nanmax(np.linalg.norm(each.position[-1] - TRIAL.truth[4], axis=-1)) < 2
    assert not np.asarray(each.fields["diverged"]).any()


def test_readings_of_other_sensors_have_no_effect() -> None:
    z = TRIAL.measurements[0]
    first, second = tracker(sensors_used=15), tracker(sensors_used=15)
    problem = first.joint_posterior(first.source_beliefs().select(None), first.observe(z))
    changed = np.where(problem.W[0] > 0, z, z + 1.0)
    first.update(z)
    second.update(changed)
    np.testing.assert_array_equal(first.x, second.x)


def test_one_cell_is_an_update_and_several_are_near_it() -> None:
    z = TRIAL.measurements[0]
    whole, one, four = (tracker() for _ in range(3))
    whole.update(z)
    update_by_cells(one, z, [range(100)])
    np.testing.assert_array_equal(one.x, whole.x)
    assert one.log_likelihood == whole.log_likelihood
    update_by_cells(four, z, [range(start, 100, 4) for start in range(4)])
    miss = np.linalg.norm(four.estimate.position - whole.estimate.position, axis=1)
    assert miss.max() < 2.0
    assert four.log_likelihood == pytest.approx(whole.log_likelihood, abs=10)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([[0, 1], [1, 2]], "cells must not share sensors"),
        ([], "cells must be lists of sensors, 0 to 99; got none"),
        ([[0], []], "cells must be lists of sensors, 0 to 99; got"),
        ([[0, 100]], "cells must be lists of sensors, 0 to 99; got"),
        ([[-1]], "cells must be lists of sensors, 0 to 99; got"),
        ([[0.5]], "cells must be lists of sensors, 0 to 99; got"),
        ([0, 1], "cells must be lists of sensors, 0 to 99; got"),
    ],
)
def test_cells_are_disjoint_sets_of_sensors(cells: Any, message: str) -> None:
    own = tracker()
    before = own.x
    with pytest.raises(ValueError, match=message):
        update_by_cells(own, TRIAL.measurements[0], cells)
    assert own.x is before


def test_cell_without_readings_is_left_out() -> None:
    z = TRIAL.measurements[0].copy()
    z[50:] = np.nan
    halves, whole = tracker(), tracker()
    update_by_cells(halves, z, [range(50), range(50, 100)])
    whole.update(z)
    np.testing.assert_array_equal(halves.x, whole.x)
    assert halves.elapsed == whole.elapsed == 0
    assert halves.diagnostics.iterations == whole.diagnostics.iterations > 0


@pytest.mark.parametrize(
    ("params", "got"),
    [({"births": True}, "births"), ({"x0": None, "n_sources": 1, "P0": np.eye(4)}, "none")],
)
def test_cells_need_sources(params: dict[str, Any], got: str) -> None:
    searching = RSSVB(**{**TRIAL.tracker_arguments(), **params})
    with pytest.raises(ValueError, match=f"a constant number of sources, at least 1; got {got}"):
        update_by_cells(searching, TRIAL.measurements[0], [range(50)])


def test_readings_of_cells_have_one_number_a_sensor() -> None:
    with pytest.raises(ValueError, match=r"z must have shape \(100,\) or \(100, 1\); got \(99,\)"):
        update_by_cells(tracker(), TRIAL.measurements[0][:99], [range(10)])


def test_missing_readings_of_cells_are_a_missing_measurement() -> None:
    cells, whole = tracker(), tracker()
    update_by_cells(cells, None, [range(50), range(50, 100)])
    whole.update(None)
    np.testing.assert_array_equal(cells.x, whole.x)


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"covariance": "modes"}, "covariance must be 'joint' or 'factor' .*the general form"),
        ({"sensors_used": 9}, "sensors_used must be None .*the general form"),
    ],
)
def test_published_form_names_the_general_form(params: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        VariationalSolver(refresh="literal", **params)
    with pytest.raises(ValueError, match="the general form"):
        VariationalSolver.as_printed().replace(**params)


def test_as_printed_is_a_form_of_the_tracker() -> None:
    printed = RSSVB(**{**TRIAL.tracker_arguments(), "solver": VariationalSolver.as_printed()})
    printed.update(TRIAL.measurements[0])
    assert printed.diagnostics.iterations == 30
