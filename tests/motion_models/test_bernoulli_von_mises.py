"""Birth and death of sources."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.motion_models import BernoulliVonMises, VonMisesWalk

steps = st.floats(0.01, 10)


probabilities = st.floats(0, 1)


@given(probabilities, probabilities, probabilities, st.integers(0, 6))
def test_existence_over_whole_steps_equals_the_chain_of_steps(
    p_activate: float, p_deactivate: float, existence: float, n: int
) -> None:
    model = BernoulliVonMises(148.0, p_activate, p_deactivate)
    chain = np.array([[1 - p_activate, p_activate], [p_deactivate, 1 - p_deactivate]])
    expected = np.array([1 - existence, existence]) @ np.linalg.matrix_power(chain, n)
    result = model.predict_existence(existence, dt=n)
    assert result == pytest.approx(expected[1], abs=1e-13)
    assert 0 <= result <= 1


@given(st.floats(0, 0.5), st.floats(0, 0.5), probabilities, steps, steps)
def test_existence_over_two_durations_equals_that_over_their_sum(
    p_activate: float, p_deactivate: float, existence: float, a: float, b: float
) -> None:
    model = BernoulliVonMises(148.0, p_activate, p_deactivate)
    result = model.predict_existence(model.predict_existence(existence, a), b)
    assert result == pytest.approx(model.predict_existence(existence, a + b), abs=1e-12)


def test_existence_converges_to_its_stationary_probability() -> None:
    model = BernoulliVonMises()
    np.testing.assert_allclose(model.predict_existence([[0.0], [1.0]], dt=500), 0.1 / 0.35)


def test_alternating_chain_refuses_half_steps() -> None:
    model = BernoulliVonMises(p_activate=0.9, p_deactivate=0.8)
    with pytest.raises(ValueError, match=r"dt must be whole .* exceeds 1; got dt=0\.5"):
        model.predict_existence(0.5, dt=0.5)
    with pytest.raises(ValueError, match="dt must be whole"):
        model.sample_active([True], np.random.default_rng(0), dt=2.5)


def test_existence_refuses_invalid_arguments() -> None:
    model = BernoulliVonMises()
    for wrong in (-0.1, 1.1, np.nan):
        with pytest.raises(ValueError, match=r"existence must lie in \[0, 1\]; got"):
            model.predict_existence(wrong)
    with pytest.raises(ValueError, match="dt must be finite and not negative; got inf"):
        model.predict_existence(0.5, dt=np.inf)
    with pytest.raises(ValueError, match=r"p_activate must lie in \[0, 1\]; got 2"):
        BernoulliVonMises(p_activate=2)


@pytest.mark.parametrize("dt", [0.0, 1.0, 2.5])
def test_sampled_switching_has_the_predicted_frequency(dt: float) -> None:
    model = BernoulliVonMises()
    before = np.tile([True, False], (20_000, 1))
    after = model.sample_active(before, np.random.default_rng(2), dt)
    assert after.dtype == bool
    expected = model.predict_existence([1.0, 0.0], dt)
    np.testing.assert_allclose(after.mean(axis=0), expected, atol=0.02)  # 5 standard errors
    assert before.all(axis=0).tolist() == [True, False]


def test_angle_motion_equals_that_of_the_walk() -> None:
    model, walk = BernoulliVonMises(kappa=20.0), VonMisesWalk(20.0)
    assert model.walk == walk
    np.testing.assert_array_equal(model.blur([3.0, 90.0], 0.5), walk.blur([3.0, 90.0], 0.5))
    np.testing.assert_array_equal(model.Q(2.0), walk.Q(2.0))
    x = np.array([[4.0], [1.0]])
    draws = [m.sample(x, np.random.default_rng(3), 2.0) for m in (model, walk)]
    np.testing.assert_array_equal(draws[0], draws[1])
