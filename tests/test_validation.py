"""Checks of arguments: what is accepted, and messages of one line."""

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.messages import LONGEST, shown
from arrivals.motion_models import (
    AutoregressiveSources,
    BernoulliVonMises,
    CombinedMotion,
    ConstantVelocity,
    CoordinatedTurn,
    DelayWalk,
    FunctionMotion,
    LinearMotion,
    MotionModel,
    RandomWalk,
    VonMisesWalk,
)
from arrivals.validation import (
    LARGEST,
    count,
    covariance,
    not_negative,
    number,
    one_of,
    positive,
    real,
    time_step,
)

HUGE = 10**400
ANYTHING = st.one_of(
    st.none(),
    st.text(),
    st.binary(),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.decimals(),
    st.fractions(),
    st.lists(st.lists(st.floats())),
    st.dictionaries(st.text(), st.floats()),
    st.just(HUGE**20),
    st.just(np.full((30, 30), np.nan)),
    st.just(np.ma.masked_all((2, 2))),  # type: ignore[no-untyped-call]
    st.just(object()),
)


class Unprintable:
    def __repr__(self) -> str:
        raise RuntimeError("two\nlines")


@given(ANYTHING)
def test_value_in_a_message_is_one_short_line(value: Any) -> None:
    text = shown(value)
    assert 0 < len(text) <= LONGEST
    assert len(text.splitlines()) == 1


def test_value_whose_repr_fails_is_shown_by_its_type() -> None:
    assert "Unprintable" in shown(Unprintable())


@given(ANYTHING)
def test_scalar_is_returned_or_refused_in_one_line(value: Any) -> None:
    checks: list[Callable[[str, Any], Any]] = [
        number, positive, not_negative, count, real, lambda name, v: covariance(name, v, 2),
        lambda name, v: one_of(name, v, ("a", True, None)),
    ]  # fmt: skip
    refused: list[Exception] = []
    for check in checks:
        try:
            check("gain", value)
        except (ValueError, TypeError) as error:
            refused.append(error)
    assert {type(error) for error in refused} <= {ValueError, TypeError}
    assert [error for error in refused if not str(error).startswith("gain must ")] == []
    assert [error for error in refused if len(str(error).splitlines()) > 1] == []


@pytest.mark.parametrize(
    "value",
    [Decimal("0.5"), Fraction(1, 2), np.timedelta64(1, "s"), np.True_, True, "1", None, [1.0], 1j],
)
def test_what_is_no_float_or_int_is_no_number(value: Any) -> None:
    with pytest.raises(TypeError, match=r"^dt must be a number; got "):
        time_step(value)


@pytest.mark.parametrize("value", [1, 1.0, np.int8(1), np.uint64(1), np.float16(1), np.float32(1)])
def test_time_step_takes_numbers_of_any_type(value: Any) -> None:
    assert time_step(value) == 1.0
    assert type(time_step(value)) is float


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1e-300, 1e31, HUGE, np.float32("nan")])
def test_time_step_refuses_what_is_not_finite_negative_or_endless(value: Any) -> None:
    with pytest.raises(ValueError, match=r"^dt must be "):
        time_step(value)


def test_time_step_of_negative_zero_is_zero() -> None:
    assert np.copysign(1.0, time_step(-0.0)) == np.copysign(1.0, not_negative("q", -0.0)) == 1.0


@pytest.mark.parametrize("value", [1e-300, 5e-324, LARGEST, 1e308, HUGE])
def test_scale_whose_square_is_not_finite_or_zero_is_refused(value: Any) -> None:
    with pytest.raises(ValueError, match=r"^kappa must be (from 1e-140 to|at most) 1e\+140"):
        positive("kappa", value)


def test_count_beyond_what_can_be_counted_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^n must be at most 1000000000; got 1000000000000"):
        count("n", 10**30)
    with pytest.raises(ValueError, match=r"^n_dims must be at most 1000"):
        RandomWalk(1.0, n_dims=10**6)


def test_masked_and_ragged_parameters_are_refused() -> None:
    with pytest.raises(ValueError, match="x must not be masked"):
        real("x", np.ma.array([1.0, 2.0], mask=[True, False]))
    with pytest.raises(ValueError, match="x must have rows of one length"):
        real("x", [[1.0], [1.0, 2.0]])
    np.testing.assert_array_equal(real("x", np.ma.array([1.0, 2.0])), [1.0, 2.0])


# motion models: the length of a step

WALKS: list[MotionModel] = [
    RandomWalk(0.1),
    ConstantVelocity(0.1),
    CoordinatedTurn(0.1, 0.1),
    VonMisesWalk(50.0),
    BernoulliVonMises(),
    LinearMotion([[0.9]], [[0.1]]),
    AutoregressiveSources([[0.5]]),
    FunctionMotion(lambda x, dt: x, Q=lambda dt: dt * np.eye(1)),
    CombinedMotion(RandomWalk(0.1, 1), DelayWalk(0.1)),
]


@pytest.mark.parametrize("dt", [np.nan, np.inf, -1.0, HUGE, "1", None, [1.0], np.ones(2), 1j])
@pytest.mark.parametrize("model", WALKS, ids=lambda model: type(model).__name__)
def test_motion_refuses_a_step_before_it_draws(model: MotionModel, dt: Any) -> None:
    rng, x = np.random.default_rng(0), np.full(model.dim_x, 0.3)
    before = rng.bit_generator.state
    for call in (model.f, lambda x, dt: model.Q(dt), lambda x, dt: model.sample(x, rng, dt)):
        with pytest.raises((ValueError, TypeError), match=r"^dt must be "):
            call(x, dt)
    assert rng.bit_generator.state == before


def test_combined_motion_draws_nothing_if_a_part_refuses_the_step() -> None:
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    both = CombinedMotion(RandomWalk(0.1, 1), LinearMotion([[0.9]], [[0.1]]))
    with pytest.raises(ValueError, match="dt must be 1"):
        both.sample([0.0, 0.0], rng, dt=2.0)
    assert rng.bit_generator.state == before


@pytest.mark.parametrize("rng", [None, 0, "generator", np.random])
@pytest.mark.parametrize("model", WALKS, ids=lambda model: type(model).__name__)
def test_motion_draws_from_a_generator_only(model: MotionModel, rng: Any) -> None:
    with pytest.raises(TypeError, match=r"^rng must be a Generator; got "):
        model.sample(np.full(model.dim_x, 0.3), rng)
