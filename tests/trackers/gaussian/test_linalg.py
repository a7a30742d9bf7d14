"""Inverse and determinant of the covariance of an innovation, in closed form and by factors."""

import numpy as np
import pytest

from arrivals.trackers.gaussian.linalg import inverse, inverse_and_log_det
from arrivals.typing import Float


def correlated(correlation: float, scale: float) -> Float:
    return scale * np.array([[4.0, 2 * correlation], [2 * correlation, 1.0]])


@pytest.mark.parametrize("correlation", [0.0, -0.3, 0.99, 0.99999, 1 - 1e-12])
@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_two_entries_equal_numpy(correlation: float, scale: float) -> None:
    S = correlated(correlation, scale)
    same, SI, half_log_det, jittered = inverse_and_log_det(S)
    assert same is S
    assert jittered == 0
    # rounding of S, magnified by its condition
    tolerance = 1e-14 / (1 - correlation**2)
    np.testing.assert_allclose(SI, np.linalg.inv(S), rtol=tolerance)
    expected = 0.5 * np.log(1 - correlation**2) + np.log(2 * scale)
    assert half_log_det == pytest.approx(expected, rel=1e-13, abs=tolerance)


@pytest.mark.parametrize("scale", [1e-170, 1e170])  # the determinant is out of range
def test_two_entries_out_of_the_range_of_their_product_equal_numpy(scale: float) -> None:
    S = correlated(0.5, scale)
    _, SI, half_log_det, _ = inverse_and_log_det(S)
    np.testing.assert_allclose(SI * scale, np.linalg.inv(correlated(0.5, 1.0)), rtol=1e-13)
    expected = 0.5 * np.log(0.75) + np.log(2) + np.log(scale)
    assert half_log_det == pytest.approx(expected, rel=1e-13)


def test_singular_covariance_is_jittered_and_an_indefinite_one_is_refused() -> None:
    S, SI, _, jittered = inverse_and_log_det(np.ones((2, 2)))
    assert jittered == 1
    np.testing.assert_allclose(S @ SI, np.eye(2), atol=1e-6)
    for bad in ([[1.0, 2.0], [2.0, 1.0]], [[-1.0, 0.0], [0.0, -1.0]]):
        with pytest.raises(ValueError, match="must be positive semidefinite"):
            inverse_and_log_det(np.array(bad))


def test_assigned_inverse_is_called() -> None:
    called = []

    def other(S: Float) -> Float:
        called.append(S)
        return inverse(S)

    S = correlated(0.3, 1.0)
    one, two = inverse_and_log_det(S, other), inverse_and_log_det(S)
    assert called == [S]
    np.testing.assert_allclose(one[1], two[1], rtol=1e-14)
    assert one[2] == pytest.approx(two[2], rel=1e-13)


@pytest.mark.parametrize("shape", [(1, 1), (3, 3), (5, 2, 2)])
def test_other_shapes_equal_numpy(shape: tuple[int, ...]) -> None:
    A = np.random.default_rng(0).standard_normal(shape)
    S = A @ A.mT + np.eye(shape[-1])
    _, SI, half_log_det, _ = inverse_and_log_det(S)
    np.testing.assert_allclose(SI, np.linalg.inv(S), rtol=1e-11)
    np.testing.assert_allclose(half_log_det, 0.5 * np.linalg.slogdet(S)[1], rtol=1e-12)
