"""Arguments of SVALSE, VALSE and their solvers."""

from typing import Any

import numpy as np
import pytest
from svalse_scenes import LINE, tone

from arrivals.motion_models import VonMisesWalk
from arrivals.trackers import SVALSE, CoordinateSolver, NewtonSolver

# -- rejected arguments ------------------------------------------------------------------------


def test_grid_wider_than_half_a_wavelength_warns_of_two_ambiguous_directions() -> None:
    with pytest.warns(UserWarning, match=r"directions -90\.0 and 53\.1 degrees are ambiguous"):
        SVALSE(LINE.replace(wavelength=0.9))


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"motion": VonMisesWalk(100.0)}, "motion must be a BernoulliVonMises"),
        (
            {"measurement": LINE.array},
            "measurement must be a DirectionMeasurement; got SensorArray",
        ),
        ({"reference": "last"}, "reference must be one of 'middle', 'first'"),
        ({"engine": "slow"}, "engine must be one of 'newton', 'fast', 'coordinate'"),
        ({"solver": "fast"}, "solver must be a NewtonSolver or a CoordinateSolver; got 'fast'"),
    ],
)
def test_invalid_arguments_are_rejected(params: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        SVALSE(**{"measurement": LINE} | params)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"tolerance": 0.0}, "tolerance must be finite and positive"),
        ({"max_iterations": 2.5}, "max_iterations must be a whole number"),
        ({"merge": -1.0}, "merge must be finite and not negative"),
        ({"max_components": 0}, "max_components must be at least 1"),
        ({"tempering": 0.5}, "tempering must be at least 1; got 0.5"),
        ({"power_floor": -1.0}, "power_floor must be finite and not negative"),
        ({"max_snr_db": 0.0}, "max_snr_db must be finite and positive"),
        ({"snr_db": -3.0}, "snr_db must be finite and positive"),
    ],
)
def test_settings_of_solvers_outside_their_range_are_rejected(
    settings: dict[str, Any], message: str
) -> None:
    for kind in (NewtonSolver, CoordinateSolver):
        with pytest.raises((ValueError, TypeError), match=message):
            kind(**settings)


def test_settings_of_one_solver_outside_their_range_are_rejected() -> None:
    with pytest.raises(ValueError, match=r"kl_weight must lie in \[0, 1\]"):
        NewtonSolver(kl_weight=1.5)
    with pytest.raises(ValueError, match="posterior must be one of 'quadrature', 'mixture'"):
        CoordinateSolver(posterior="laplace")  # type: ignore[arg-type]


def test_engine_selects_a_solver_with_the_shared_settings() -> None:
    tracker = SVALSE(LINE, engine="coordinate", solver=NewtonSolver(tolerance=1e-3, kl_weight=1.0))
    assert tracker.solver == CoordinateSolver(tolerance=1e-3)
    assert tracker.engine is None
    tracker.set_params(solver__posterior="mixture", engine="coordinate")
    assert tracker.solver == CoordinateSolver(tolerance=1e-3, posterior="mixture")
    assert tracker.set_params(engine="fast").solver == NewtonSolver(tolerance=1e-3)


def test_posterior_selects_that_of_coordinate_ascent() -> None:
    tracker = SVALSE(LINE, engine="coordinate", posterior="mixture")
    assert tracker.solver == CoordinateSolver(posterior="mixture")
    assert tracker.posterior is None
    with pytest.raises(ValueError, match="posterior must be None without coordinate ascent"):
        SVALSE(LINE, posterior="mixture")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("kl", "'kl_weight' of 'solver'"),
        ("tolerance", "'tolerance' of 'solver'"),
        ("carry", "called 'memory'"),
    ],
)
def test_old_argument_is_refused_with_its_new_name(old: str, new: str) -> None:
    arguments: dict[str, Any] = {old: 1.0}
    with pytest.raises(TypeError, match=f"SVALSE has no parameter '{old}': it is now {new}"):
        SVALSE(LINE, **arguments)


def test_snapshots_of_the_wrong_shape_or_kind_leave_the_belief_unchanged() -> None:
    tracker = SVALSE(LINE)
    tracker.run(tone([[0.3]] * 2, 1e-3))
    mu, estimate = tracker.mu, tracker.estimate
    for bad in (np.ones(14), np.ones((1, 15)), 3.0, np.array(["a"] * 15), [[1.0], [2.0, 3.0]]):
        with pytest.raises((ValueError, TypeError), match="z must h"):
            tracker.update(bad)
    assert tracker.mu is mu
    assert tracker.estimate is estimate
