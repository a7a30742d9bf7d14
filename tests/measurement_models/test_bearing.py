"""Linear measurements and bearings: Jacobians, wrapping, equality, refusals."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import Bearing, LinearMeasurement, MeasurementModel
from arrivals.parameters import FrozenModel
from arrivals.typing import Float

PLACES = np.array([[0.0, 0.0], [10.0, -3.0], [-4.0, 7.0]])
coordinates = st.floats(-50, 50)


def slope(model: MeasurementModel, x: Float, step: float = 1e-6) -> Float:
    steps = step * np.eye(x.size)
    return model.residual(model.h(x + steps), model.h(x - steps)).T / (2 * step)


@given(coordinates, coordinates)
def test_bearing_jacobian_equals_numerical_slope(px: float, py: float) -> None:
    x = np.array([px, 1.0, py, -1.0, 0.2])
    model = Bearing(PLACES, 0.01)
    if np.hypot(*(PLACES - x[[0, 2]]).T).min() > 0.5:
        np.testing.assert_allclose(model.H(x), slope(model, x), atol=1e-6)


@given(st.floats(-np.pi, np.pi), coordinates, coordinates)
def test_rotated_scene_rotates_the_bearings(turn: float, px: float, py: float) -> None:
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    x = np.array([px, py])
    one, other = (Bearing(places, 0.01, (0, 1)) for places in (PLACES, PLACES @ R.T))
    if np.hypot(*(PLACES - x).T).min() > 0.5:
        change = one.residual(other.h(R @ x), one.h(x))
        np.testing.assert_allclose(one.residual(change, turn), 0, atol=1e-9)


@given(st.floats(-20, 20), st.floats(-20, 20))
def test_residual_is_wrapped(a: float, b: float) -> None:
    d = Bearing(PLACES[:1], 0.01).residual([a], [b])
    assert -np.pi <= d[0] <= np.pi
    assert np.cos(d[0] - (a - b)) == pytest.approx(1.0)


def test_bearings_accept_leading_axes_and_any_state_layout() -> None:
    x = np.random.default_rng(0).normal(size=(2, 5, 4))
    wide = Bearing(PLACES, 0.01)
    narrow = Bearing(PLACES, 0.01, position=(0, 1))
    np.testing.assert_array_equal(wide.h(x), narrow.h(x[..., [0, 2]]))
    assert wide.h(x).shape == (2, 5, 3)
    assert narrow.H(x[0, 0, :2]).shape == (3, 2)


def test_bearing_at_the_sensor_position_has_zero_slope() -> None:
    assert not Bearing(PLACES[:1], 0.01, (0, 1)).H([0.0, 0.0]).any()


MODELS: list[FrozenModel] = [
    LinearMeasurement([[1.0, 2.0]], [[3.0]]),
    Bearing(PLACES, 0.01),
    Bearing(PLACES, np.diag([0.1, 0.2, 0.3]), position=(0, 1)),
]


@pytest.mark.parametrize("model", MODELS, ids=["linear", "variance", "covariance"])
def test_models_with_equal_numbers_are_equal(model: Any) -> None:
    twin = type(model)(**model.get_params())
    assert twin == model
    assert hash(twin) == hash(model)
    assert pickle.loads(pickle.dumps(model)) == model
    assert copy.deepcopy(model) is model
    assert FrozenModel.from_dict(model.to_dict()) == model
    assert model != "another"
    assert len({model, twin, *MODELS}) == 3
    model.R[0, 0] = 99.0
    assert twin == model


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Bearing([1.0, 2.0], 0.1), "sensor_positions must be a matrix"),
        (lambda: Bearing([[1.0, 2.0, 3.0]], 0.1), r"must have shape \(n, 2\); got \(1, 3\)"),
        (lambda: Bearing(PLACES, 0.0), "noise must be finite and positive; got 0"),
        (lambda: Bearing(PLACES, np.eye(2)), r"noise must have shape \(3, 3\); got \(2, 2\)"),
        (lambda: Bearing(PLACES, 0.1, (1, 1)), r"position must name two entries.*\(1, 1\)"),
        (lambda: Bearing(PLACES, 0.1).h([1.0]), r"shape \(..., n\), n > 1; got \(1,\)"),
        (
            lambda: Bearing(PLACES, 0.1).H(np.zeros((2, 4))),
            r"x must have shape \(n,\); got \(2, 4\)",
        ),
        (lambda: LinearMeasurement([[1.0]], np.eye(2)), r"noise must have shape \(1, 1\)"),
        (lambda: LinearMeasurement([[1.0]], [[-1.0]]), "noise must have no negative eigenvalue"),
        (lambda: LinearMeasurement([[np.nan]], [[1.0]]), "matrix must be finite"),
    ],
)
def test_invalid_parameters_are_refused(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
