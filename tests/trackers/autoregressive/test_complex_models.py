"""Complex models of autoregressive sources in the real Kalman filter and EKF."""

from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import DOA, TWO, snapshots, sources, symmetric_array

from arrivals.measurement_models import ArrayManifold, LinearMeasurement, SensorArray
from arrivals.motion_models import LinearMotion, RandomWalk
from arrivals.trackers import EKF, Kalman


class ComplexMotion(RandomWalk):
    def F(self, x: Any = None, dt: float = 1.0) -> Any:
        return 1j * np.eye(self.n_dims)


class ComplexMeasurement(LinearMeasurement):
    def H(self, x: Any = None) -> Any:
        return 1j * super().H(x)


REMEDY = r"real numbers.*(stack real and imaginary parts|composite)"


@pytest.mark.parametrize("kind", [Kalman, EKF])
@pytest.mark.parametrize(
    "models",
    [
        (ComplexMotion(1.0, 1), LinearMeasurement([[1.0]], [[1.0]])),
        (RandomWalk(1.0, 1), ComplexMeasurement([[1.0]], [[1.0]])),
    ],
    ids=["transition", "measurement"],
)
def test_complex_matrix_of_a_model_raises_with_remedy(kind: Any, models: Any) -> None:
    with pytest.raises(TypeError, match=f"of the (motion|measurement) must hold {REMEDY}"):
        kind(*models, x=[0.0], P=[[1.0]])


@pytest.mark.parametrize("name", ["F", "Q", "H", "R"])
def test_complex_matrix_of_one_step_raises_with_remedy(name: str) -> None:
    tracker: Any = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[1.0]]), [0.0], [[1.0]])
    step = tracker.predict if name in "FQ" else tracker.update
    given = () if name in "FQ" else (1.0,)
    with pytest.raises(TypeError, match=f"{name} must hold {REMEDY}"):
        step(*given, **{name: [[1j]]})
    with pytest.raises(TypeError, match=REMEDY):
        LinearMotion([[1j]], [[1.0]])


def test_kalman_filter_with_the_real_manifold_estimates_signals() -> None:
    parts = TWO.replace(real_valued=True)
    A = ArrayManifold(SensorArray.symmetric([0.25]), 1.0).real_steering(DOA).T
    H = np.zeros((3, parts.dim_x))
    H[:, parts.layout.first] = A
    tracker = Kalman(
        parts, LinearMeasurement(H, 0.05 * np.eye(3)), np.zeros(6), parts.stationary_covariance()
    )
    s = sources(parts, 1, 400)[0]
    y = ArrayManifold(SensorArray.symmetric([0.25]), 1.0).transform(
        snapshots(symmetric_array(0.25), DOA, s)
    )
    result = parts.signals(tracker.run(y.real).x)
    assert 10 * np.log10((abs(result - s) ** 2).mean()) < -13.0
