"""Filters read the entries of a state by name."""

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import Bearing, LinearMeasurement, Phasor
from arrivals.motion_models import ConstantVelocity, LinearMotion, RandomWalk
from arrivals.trackers import EKF, IMM, UKF, GaussianFilter, Kalman, Particle

BEARING = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=1e-3)
PHASOR = Phasor(3, 0.1, frequency=0.25)
WALK = ConstantVelocity(q=0.1)
X, P = np.array([4.0, 0.1, 6.0, 0.2]), np.eye(4)


def make(kind: Any, motion: Any, measurement: Any, x: Any, P: Any) -> Any:
    return kind(motion, measurement, x, P, **({"rng": 1} if kind is Particle else {}))


@pytest.mark.parametrize("kind", [EKF, UKF, Particle])
def test_position_is_where_the_motion_names_it(kind: Any) -> None:
    tracker = make(kind, WALK, BEARING, X, P)
    assert tracker.measurement.position == (0, 2)
    swapped = LinearMotion(np.eye(3), np.eye(3), names=("y", "bias", "x"))
    assert make(kind, swapped, BEARING, X[:3], np.eye(3)).measurement.position == (2, 0)


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF, Particle])
def test_measurement_of_a_missing_entry_raises_type_error(kind: Any) -> None:
    with pytest.raises(TypeError, match="Phasor needs 'delay'; got 'x', 'vx', 'y', 'vy'"):
        make(kind, WALK, PHASOR, X, P)


def test_imm_has_the_check_of_its_members() -> None:
    members = [EKF(ConstantVelocity(q), BEARING, X, P) for q in (0.1, 1.0)]
    tracker = IMM(members, [0.5, 0.5], np.full((2, 2), 0.5))
    tracker.predict()
    tracker.update(BEARING.for_state(WALK.state_names).h(X))
    assert np.isfinite(tracker.x).all()


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_sizes_are_checked_where_entries_have_no_names(kind: type[GaussianFilter]) -> None:
    unnamed = LinearMotion(np.eye(3), np.eye(3))
    with pytest.raises(ValueError, match=r"H of the measurement must have shape \(1, 3\)"):
        kind(unnamed, LinearMeasurement([[1.0, 0.0]], [[1.0]]), np.zeros(3), np.eye(3))


def test_measurement_by_state_names_remains_after_set_params_and_configuration() -> None:
    tracker = EKF(WALK, BEARING, X, P)
    tracker.set_params(motion__q=1.0)
    assert tracker.measurement == BEARING.for_state(WALK.state_names)
    copy = EKF.from_dict(tracker.to_dict())
    assert copy.measurement == tracker.measurement


class Unmarked(RandomWalk):
    """A linear model whose `is_linear` is False."""

    @property
    def is_linear(self) -> bool:
        return False


class Curved(RandomWalk):
    @property
    def is_linear(self) -> bool:
        return False

    def f(self, x: Any, dt: float = 1.0) -> Any:
        return np.square(x)


def test_kalman_evaluates_models_whose_is_linear_is_false() -> None:
    position = LinearMeasurement(np.eye(2), np.eye(2))
    Kalman(Unmarked(1.0), position, [0.0, 0.0], np.eye(2)).predict()
    with pytest.raises(TypeError, match=r"motion must be linear; got Curved.*: use ekf or ukf"):
        Kalman(Curved(1.0), position, [0.0, 0.0], np.eye(2))
