"""Linear measurements and bearings: Jacobians, wrapping, equality, refusals."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from arrivals.measurement_models import Bearing, LinearMeasurement, MeasurementModel
from arrivals.measurement_models.arrays.sphere import unit_vectors
from arrivals.motion_models import ConstantVelocity
from arrivals.parameters import FrozenModel
from arrivals.trackers import EKF, UKF
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


@given(coordinates, coordinates, coordinates)
def test_h_and_its_jacobian_together_equal_each_alone(px: float, py: float, pz: float) -> None:
    flat, spatial = Bearing([[0.0, 0.0]], 0.1), Bearing([[0.0, 0.0, 0.0]], 0.1)
    for model, x in ((flat, np.array([px, py])), (spatial, np.array([px, py, pz]))):
        h, H = model.h_and_H(x)
        np.testing.assert_array_equal(h, model.h(x))
        np.testing.assert_array_equal(H, model.H(x))


@pytest.mark.parametrize("shape", [(2, 4), (4, 1), (), (1,)])
def test_h_and_its_jacobian_of_no_single_state_are_refused_as_by_the_jacobian(
    shape: tuple[int, ...],
) -> None:
    model, x = Bearing([[0.0, 0.0], [9.0, 0.0]], 0.1), np.ones(shape)
    with pytest.raises(ValueError, match="must have shape") as alone:
        model.H(x)
    with pytest.raises(ValueError, match="must have shape") as together:
        model.h_and_H(x)
    assert str(together.value) == str(alone.value)


def test_h_and_its_jacobian_of_a_subclass_are_those_it_defines() -> None:
    class Biased(Bearing):
        def h(self, x: ArrayLike) -> Float:
            return super().h(x) + 1.0

    h, _ = Biased([[0.0, 0.0]], 0.1).h_and_H(np.array([1.0, 0.0]))
    np.testing.assert_array_equal(h, [1.0])


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


SPATIAL = np.array([[0.0, 0.0, 0.0], [10.0, -3.0, 1.0], [-4.0, 7.0, 20.0]])


@given(coordinates, coordinates, coordinates)
def test_jacobian_in_space_equals_numerical_slope(px: float, py: float, pz: float) -> None:
    x = np.array([px, 1.0, py, -1.0, pz, 0.2])
    model = Bearing(SPATIAL, 0.01)
    if np.hypot(*(SPATIAL[:, :2] - x[[0, 2]]).T).min() > 0.5:
        np.testing.assert_allclose(model.H(x), slope(model, x), atol=1e-6)


@given(coordinates, coordinates, coordinates)
def test_angles_in_space_point_from_each_sensor_to_the_position(
    px: float, py: float, pz: float
) -> None:
    x = np.array([px, py, pz])
    azimuth, elevation = Bearing(SPATIAL, 0.01).h(x).reshape(3, 2).T
    delta = x - SPATIAL
    distance = np.linalg.norm(delta, axis=1, keepdims=True)
    far = distance[:, 0] > 1e-6
    found = distance * unit_vectors(azimuth, elevation)
    np.testing.assert_allclose(found[far], delta[far], rtol=1e-9, atol=1e-9)


@given(st.floats(-np.pi, np.pi), coordinates, coordinates, coordinates)
def test_turn_about_the_vertical_axis_turns_azimuths_alone(
    turn: float, px: float, py: float, pz: float
) -> None:
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    x = np.array([px, py, pz])
    one, other = (Bearing(places, 0.01) for places in (SPATIAL, SPATIAL @ R.T))
    if np.hypot(*(SPATIAL - x)[:, :2].T).min() > 0.5:
        change = one.residual(other.h(R @ x), one.h(x))
        np.testing.assert_allclose(one.residual(change, [turn, 0] * 3), 0, atol=1e-9)


def test_azimuths_in_space_equal_those_in_the_plane() -> None:
    x = np.random.default_rng(0).normal(size=(2, 5, 6))
    flat = Bearing(SPATIAL[:, :2], 0.01, position=(0, 2))
    spatial = Bearing(SPATIAL, 0.01)
    np.testing.assert_array_equal(spatial.h(x)[..., ::2], flat.h(x))
    assert spatial.h(x).shape == (2, 5, 6)
    names = ("x", "vx", "y", "vy", "z", "vz")
    assert spatial.for_state(names).position == (0, 2, 4)
    assert (flat.dim_z, spatial.dim_z, spatial.R.shape) == (3, 6, (6, 6))
    with pytest.raises(TypeError, match="Bearing needs 'z'; got 'x', 'y'"):
        spatial.for_state(("x", "y"))


@pytest.mark.parametrize("height", [-7.0, 7.0])
def test_azimuth_straight_above_the_sensor_has_zero_slope(height: float) -> None:
    model = Bearing(SPATIAL[:1], 0.01)
    for x in ([0.0, 0.0, height], [1e-200, 0.0, height], [1e-9, -1e-9, height]):
        H = model.H(x)
        assert np.isfinite(H).all()
        assert np.abs(H[0]).max() <= 1e9 / abs(height)
        np.testing.assert_allclose(H[1, :2], 0, atol=1 / abs(height) + 1e-12)
    assert not model.H([0.0, 0.0, height]).any()
    assert not model.H([0.0, 0.0, 0.0]).any()
    np.testing.assert_allclose(model.h([0.0, 0.0, height]), [0, np.sign(height) * np.pi / 2])


@pytest.mark.parametrize("kind", [EKF, UKF])
def test_filters_find_a_position_in_space_as_filterpy_does(kind: type[EKF | UKF]) -> None:
    model = Bearing(SPATIAL, np.deg2rad(1.0) ** 2)
    walk, rng = ConstantVelocity(q=0.01, n_dims=3), np.random.default_rng(1)
    x, P = np.array([4.0, 0.3, 30.0, -0.5, 5.0, 0.2]), np.diag([4.0, 0.1] * 3)
    truth = [walk.F(dt=float(t)) @ x for t in range(1, 21)]
    z = np.array([model.sample(each, rng) for each in truth])
    tracker = kind(walk, model, x + 1.0, P)
    run = tracker.run(z)
    assert np.linalg.norm(run.x[-1, ::2] - truth[-1][::2]) < 1.0
    if kind is EKF:
        theirs = ExtendedKalmanFilter(dim_x=6, dim_z=model.dim_z)
        theirs.x, theirs.P, theirs.F, theirs.Q, theirs.R = x + 1.0, P, walk.F(), walk.Q(), model.R
        for each in z:
            theirs.predict()
            theirs.update(each, model.H, model.h, residual=model.residual)
    else:
        points = MerweScaledSigmaPoints(6, alpha=0.5, beta=2.0, kappa=0.0)
        theirs = UnscentedKalmanFilter(6, model.dim_z, 1.0, fx=walk.f, hx=model.h, points=points)
        theirs.x, theirs.P, theirs.Q, theirs.R = x + 1.0, P, walk.Q(), model.R
        for each in z:
            theirs.predict()
            theirs.update(each)
    # filterpy's UKF takes no new sigma points after the prediction
    np.testing.assert_allclose(run.x[-1], theirs.x, atol=1e-9 if kind is EKF else 0.05)


def test_bearing_at_the_sensor_position_has_zero_slope() -> None:
    assert not Bearing(PLACES[:1], 0.01, (0, 1)).H([0.0, 0.0]).any()


MODELS: list[FrozenModel] = [
    LinearMeasurement([[1.0, 2.0]], [[3.0]]),
    Bearing(PLACES, 0.01),
    Bearing(PLACES, np.diag([0.1, 0.2, 0.3]), position=(0, 1)),
    Bearing(SPATIAL, 0.01, position=(0, 1, 2)),
]


@pytest.mark.parametrize("model", MODELS, ids=["linear", "variance", "covariance", "space"])
def test_models_with_equal_numbers_are_equal(model: Any) -> None:
    twin = type(model)(**model.get_params())
    assert twin == model
    assert hash(twin) == hash(model)
    assert pickle.loads(pickle.dumps(model)) == model
    assert copy.deepcopy(model) is model
    assert FrozenModel.from_dict(model.to_dict()) == model
    assert model != "another"
    assert len({model, twin, *MODELS}) == 4
    model.R[0, 0] = 99.0
    assert twin == model


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Bearing([1.0, 2.0], 0.1), "sensor_positions must be a matrix"),
        (lambda: Bearing([[1.0]], 0.1), r"must have shape \(n, 2\) or \(n, 3\); got \(1, 1\)"),
        (lambda: Bearing(SPATIAL, np.eye(3)), r"noise must have shape \(6, 6\); got \(3, 3\)"),
        (lambda: Bearing(SPATIAL, 0.1, (0, 1)), r"position must name three entries.*\(0, 1\)"),
        (lambda: Bearing(SPATIAL, 0.1).h([1.0, 2.0]), r"shape \(..., n\), n > 2; got \(2,\)"),
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
