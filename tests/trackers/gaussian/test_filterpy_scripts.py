"""Scripts for filterpy that run here with another import."""

import copy
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import filterpy.kalman
import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise, Saver
from sklearn.base import clone

import arrivals.trackers.filterpy as ours
from arrivals.trackers import EKF, UKF, Kalman
from arrivals.typing import Float

STATIONS = np.array([[0.0, 0.0], [30.0, 0.0]])


def noise(seed: int, *shape: int) -> Float:
    return np.random.default_rng(seed).normal(size=shape)


def falling_stone(library: Any) -> Any:
    kf = library.KalmanFilter(dim_x=2, dim_z=1, dim_u=1)
    kf.x = np.array([[100.0], [0.0]])
    kf.F = np.array([[1.0, 0.1], [0.0, 1.0]])
    kf.B = np.array([[0.005], [0.1]])
    kf.u = 0.0
    kf.H[0, 0] = 1.0
    kf.P *= 25
    kf.R *= 4
    kf.Q = Q_discrete_white_noise(dim=2, dt=0.1, var=0.5)
    saver = Saver(kf)
    for z in 100 - 4.9 * (0.1 * np.arange(20)) ** 2 + 2 * noise(0, 20):
        kf.predict(np.array([[-9.81]]))
        kf.update(z)
        kf.Q *= 0.99
        saver.save()
    saver.to_array()
    means, covariances, _, _ = kf.batch_filter(noise(1, 5, 1, 1))
    smooth, *_ = kf.rts_smoother(means, covariances)
    return saver.x, saver.P, saver.mahalanobis, smooth, kf.log_likelihood, kf.dim_u


def two_modes(library: Any) -> Any:
    def member(q: float) -> Any:
        kf = library.KalmanFilter(dim_x=4, dim_z=2)
        kf.F[0, 1] = kf.F[2, 3] = 1.0
        kf.H[0, 0] = kf.H[1, 2] = 1.0
        kf.Q[:2, :2] = kf.Q[2:, 2:] = Q_discrete_white_noise(2, 1.0, q)
        kf.Q[:2, 2:] = kf.Q[2:, :2] = 0.0
        kf.P = np.eye(4) * 10
        return kf

    switch = np.array([[0.9, 0.1], [0.2, 0.8]])
    bank = library.IMMEstimator([member(1e-3), member(1.0)], [0.5, 0.5], switch)
    states = []
    for z in np.cumsum(noise(2, 15, 2, 1), axis=0):
        bank.predict()
        bank.update(z)
        states.append((bank.x.copy(), bank.mu.copy()))
    return [x for x, _ in states], [mu for _, mu in states], bank.P


def distances(x: Float) -> Any:
    return np.hypot(*(x[[0, 2]] - STATIONS).T)


def slopes(x: Float) -> Any:
    H = np.zeros((2, 4))
    H[:, ::2] = (x[[0, 2]] - STATIONS) / distances(x)[:, None]
    return H


def ranges(library: Any) -> Any:
    ekf = library.ExtendedKalmanFilter(dim_x=4, dim_z=2)
    ekf.x = np.array([5.0, 1.0, 9.0, 0.0])
    ekf.F = np.eye(4)
    ekf.F[0, 1] = ekf.F[2, 3] = 1.0
    ekf.R *= 0.1
    ekf.Q = np.zeros((4, 4))
    ekf.Q[1, 1] = ekf.Q[3, 3] = 0.01
    for k in range(12):
        ekf.predict()
        ekf.update(distances(np.array([6.0 + k, 1.0, 10.0, 0.0])), slopes, distances)
    return ekf.x, ekf.P, ekf.K, ekf.y, ekf.likelihood


class Braking(SimpleNamespace):
    """Adds a prediction of its own to an extended filter."""

    @staticmethod
    def of(library: Any) -> Any:
        class Filter(library.ExtendedKalmanFilter):  # type: ignore[misc]  # of either library
            x: Any

            def predict_x(self, u: Any = 0) -> None:
                self.x = np.array([self.x[0] + self.x[1], 0.8 * self.x[1]])

        return Filter(2, 1)


def own_prediction(library: Any) -> Any:
    ekf = Braking.of(library)
    ekf.x, ekf.F = np.array([0.0, 4.0]), np.array([[1.0, 1.0], [0.0, 0.8]])
    for z in noise(3, 6):
        ekf.predict()
        ekf.update(z + 8.0, lambda x: np.array([[1.0, 0.0]]), lambda x: x[:1])
    return ekf.x, ekf.P, ekf.x_prior, ekf.P_prior


def unscented(library: Any) -> Any:
    points = library.MerweScaledSigmaPoints(2, alpha=0.5, beta=2.0, kappa=0.0)
    ukf = library.UnscentedKalmanFilter(
        dim_x=2, dim_z=1, dt=0.5, hx=lambda x, c=1.0: np.array([c * np.sin(x[0])]),
        fx=lambda x, dt, drag=0.0: np.array([x[0] + dt * x[1], (1 - drag) * x[1]]), points=points,
    )  # fmt: skip
    ukf.x, ukf.P, ukf.R = np.array([0.1, 0.2]), 0.1 * np.eye(2), np.array([[0.02]])
    ukf.Q = Q_discrete_white_noise(2, 0.5, 0.01)
    for k, z in enumerate(0.5 + 0.1 * noise(4, 8)):
        ukf.predict(**({"drag": 0.1} if k == 3 else {"dt": 0.25} if k == 5 else {}))
        ukf.update(z, **({"c": 1.1} if k == 4 else {"R": 0.1} if k == 6 else {}))
    means, covariances = ukf.batch_filter(0.5 + 0.1 * noise(5, 4))
    return ukf.x, ukf.P, ukf.S, means, covariances


SCRIPTS = [falling_stone, two_modes, ranges, own_prediction, unscented]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda each: each.__name__)
def test_script_gives_the_numbers_of_filterpy(script: Callable[[Any], Any]) -> None:
    libraries: list[ModuleType] = [filterpy.kalman, ours]
    for a, b in zip(*map(script, libraries), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


def test_other_name_of_filterpy_raises() -> None:
    with pytest.raises(AttributeError, match="has no 'MMAEFilterBank'; it has ExtendedKalman"):
        _ = ours.MMAEFilterBank


def test_filter_without_measurement_function_raises() -> None:
    with pytest.raises(TypeError, match="HJacobian and Hx, or assign measurement"):
        ours.ExtendedKalmanFilter(2, 1).update(1.0)
    ekf = ours.ExtendedKalmanFilter(2, 1)
    ekf.R *= 2
    with pytest.raises(TypeError, match="HJacobian and Hx, or assign measurement"):
        ekf.update(1.0)
    ekf.H[0, 0] = 1.0
    ekf.update(1.0)
    assert ekf.x[0] == pytest.approx(1 / 3)


def test_control_input_without_matrix_raises() -> None:
    kf = ours.KalmanFilter(2, 1, dim_u=1)
    assert kf.dim_u == 1
    with pytest.raises(ValueError, match="motion must have a control matrix"):
        kf.predict(1.0)


class Stuck(ours.ExtendedKalmanFilter):
    """Has a prediction that fails."""

    def predict_x(self, u: Any = None) -> None:
        self.x = self.x + 1
        raise ArithmeticError


def test_own_prediction_that_raises_changes_nothing() -> None:
    ekf = Stuck(2, 1)
    before = dict(vars(ekf))
    with pytest.raises(ArithmeticError):
        ekf.predict()
    assert all(vars(ekf)[name] is value for name, value in before.items())


def test_configuration_and_clone_have_models() -> None:
    kf = ours.KalmanFilter(2, 1)
    kf.F[0, 1] = 0.5
    copies = [Kalman.from_dict(kf.to_dict()), clone(kf)]
    assert all(type(each) is Kalman and each.F[0, 1] == 0.5 for each in copies)
    kf.set_params(measurement__matrix=[[1.0, 0.0]])
    assert kf.H.tolist() == [[1.0, 0.0]]
    assert ours.ExtendedKalmanFilter.plain is EKF


@pytest.mark.parametrize(
    ("named", "message"),
    [
        ({"points": None}, "points must be MerweScaledSigmaPoints or Julier"),
        ({"x_mean_fn": np.mean}, "x_mean_fn must be None.*angles"),
        ({"colour": 1}, "has no argument 'colour'"),
    ],
)
def test_unscented_filter_refuses_what_it_does_not_use(named: Any, message: str) -> None:
    points = ours.MerweScaledSigmaPoints(1, 0.5, 2.0, 0.0)
    arguments = {"dim_x": 1, "dim_z": 1, "dt": 1.0, "hx": abs, "fx": max, "points": points} | named
    with pytest.raises(TypeError, match=message):
        ours.UnscentedKalmanFilter(**arguments)


def test_unscented_filter_takes_new_functions_and_its_own_step_length() -> None:
    points = ours.JulierSigmaPoints(1, kappa=2.0)
    ukf = ours.UnscentedKalmanFilter(1, 1, 0.5, lambda x: x, lambda x, dt: x + dt, points)
    theirs = filterpy.kalman.UnscentedKalmanFilter(
        1, 1, 0.5, lambda x: 2 * x, lambda x, dt: x - dt, points
    )
    ukf.fx, ukf.hx = theirs.fx, theirs.hx
    for f in (ukf, theirs):
        f.predict()
        f.update(np.array([0.3]))
    np.testing.assert_allclose(ukf.x, theirs.x)
    assert ours.UnscentedKalmanFilter.plain is UKF
    with pytest.raises(TypeError, match="UT must be None"):
        ukf.predict(UT=max)  # type: ignore[arg-type]
    members: list[Any] = [ukf, copy.deepcopy(ukf)]
    bank = ours.IMMEstimator(members, [0.5, 0.5], np.eye(2))
    bank.predict()
    assert ukf.last_dt == 0.5
    with pytest.raises(ValueError, match="dt must be 1 for UnscentedKalmanFilter"):
        bank.predict(dt=2.0)
