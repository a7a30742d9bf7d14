"""GOSPA, OSPA and RMSE: brute force over all assignments, axioms, worked examples."""

from collections.abc import Iterator
from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.scenarios.metrics.gospa import (
    Gospa,
    gospa,
    mean_gospa,
    mean_rmse,
    ospa,
    rmse,
)
from arrivals.scenarios.metrics.unlabelled_rmse import best_assignment_rmse

ANGLES = st.lists(st.floats(-90, 90), max_size=4)
POINTS = st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), max_size=4)
CUTS = st.floats(0.1, 100)
EXPONENTS = st.sampled_from([1.0, 1.5, 2.0, 3.0])
LAW = settings(deadline=None)  # the first call imports scipy.optimize
ALPHAS = st.sampled_from([0.5, 1.0, 1.7, 2.0])


def assignments(n: int, m: int) -> Iterator[list[tuple[int, int]]]:
    """Yield every set of disjoint pairs, of any size."""
    for k in range(min(n, m) + 1):
        for rows in combinations(range(n), k):
            for columns in permutations(range(m), k):
                yield list(zip(rows, columns, strict=True))


def brute_gospa(truth: list[float], estimate: list[float], c: float, p: float) -> float:
    best = min(
        sum(abs(truth[i] - estimate[j]) ** p for i, j in pairs)
        + c**p / 2 * (len(truth) + len(estimate) - 2 * len(pairs))
        for pairs in assignments(len(truth), len(estimate))
    )
    return float(best ** (1 / p))


def brute_cut(small: list[float], large: list[float], c: float, p: float) -> float:
    """Return the smallest sum of min(d, c)^p over the assignments of the smaller set."""
    costs = (
        sum(min(abs(a - b), c) ** p for a, b in zip(small, chosen, strict=True))
        for chosen in permutations(large, len(small))
    )
    return float(min(costs))


@LAW
@given(ANGLES, ANGLES, CUTS, EXPONENTS)
def test_gospa_is_the_best_of_all_assignments(
    truth: list[float], estimate: list[float], c: float, p: float
) -> None:
    assert gospa(truth, estimate, c, p).total == pytest.approx(brute_gospa(truth, estimate, c, p))


@LAW
@given(ANGLES, ANGLES, CUTS, EXPONENTS, ALPHAS)
def test_gospa_and_ospa_follow_their_definitions(
    truth: list[float], estimate: list[float], c: float, p: float, alpha: float
) -> None:
    small, large = sorted([truth, estimate], key=len)
    cut, surplus = brute_cut(small, large, c, p), len(large) - len(small)
    total = gospa(truth, estimate, c, p, alpha).total
    assert total == pytest.approx((cut + c**p * surplus / alpha) ** (1 / p))
    mean = (cut + c**p * surplus) / max(1, len(large))
    assert ospa(truth, estimate, c, p) == pytest.approx(mean ** (1 / p))


@LAW
@given(ANGLES, ANGLES, CUTS)
def test_rmse_is_the_best_of_all_assignments(
    truth: list[float], estimate: list[float], c: float
) -> None:
    best = min(
        sum((truth[i] - estimate[j]) ** 2 for i, j in pairs) + c**2 * (len(truth) - len(pairs))
        for pairs in assignments(len(truth), len(estimate))
    )
    assert rmse(truth, estimate, c) == pytest.approx(np.sqrt(best / max(1, len(truth))))


@LAW
@given(POINTS, POINTS, CUTS, EXPONENTS, ALPHAS)
def test_gospa_parts_add_up_and_swap_with_the_sets(
    a: list[tuple[float, float]], b: list[tuple[float, float]], c: float, p: float, alpha: float
) -> None:
    forward, reverse = gospa(a, b, c, p, alpha), gospa(b, a, c, p, alpha)
    assert forward.total**p == pytest.approx(forward.distance + forward.missed + forward.false)
    assert forward.total == pytest.approx(reverse.total)
    assert forward.missed - forward.false == pytest.approx(reverse.false - reverse.missed)
    assert ospa(a, b, c, p) == pytest.approx(ospa(b, a, c, p))


@LAW
@given(POINTS, POINTS, POINTS, CUTS, EXPONENTS, ALPHAS)
def test_gospa_and_ospa_satisfy_the_triangle_inequality(
    x: list[tuple[float, float]],
    y: list[tuple[float, float]],
    z: list[tuple[float, float]],
    c: float,
    p: float,
    alpha: float,
) -> None:
    def d(a: list[tuple[float, float]], b: list[tuple[float, float]]) -> float:
        return gospa(a, b, c, p, alpha).total

    assert d(x, z) <= (d(x, y) + d(y, z)) * (1 + 1e-9) + 1e-9
    assert ospa(x, z, c, p) <= (ospa(x, y, c, p) + ospa(y, z, c, p)) * (1 + 1e-9) + 1e-9


@LAW
@given(POINTS, POINTS, st.randoms(use_true_random=False), CUTS)
def test_metrics_are_invariant_to_the_order_of_points(
    a: list[tuple[float, float]],
    b: list[tuple[float, float]],
    random: np.random.Generator,
    c: float,
) -> None:
    mixed = list(b)
    random.shuffle(mixed)
    assert gospa(a, b, c).total == pytest.approx(gospa(a, mixed, c).total)
    assert rmse(a, b, c) == pytest.approx(rmse(a, mixed, c), abs=1e-9)
    assert gospa(mixed, b, c).total == 0


@LAW
@given(ANGLES, ANGLES, st.lists(st.integers(-3, 3), min_size=4, max_size=4))
def test_gospa_with_period_is_invariant_to_full_turns(
    truth: list[float], estimate: list[float], turns: list[int]
) -> None:
    turned = [f + 360 * n for f, n in zip(estimate, turns, strict=False)]
    expected = gospa(truth, estimate, c=10, period=360)
    assert gospa(truth, turned, c=10, period=360).total == pytest.approx(expected.total, abs=1e-9)
    assert expected.total == pytest.approx(gospa(truth, estimate, c=10).total)  # within half a turn


@LAW
@given(ANGLES, ANGLES, st.integers(0, 3))
def test_rows_with_nan_are_ignored(truth: list[float], estimate: list[float], n: int) -> None:
    padded = np.r_[np.full(n, np.nan), estimate]
    assert gospa(truth, padded, c=10) == gospa(truth, estimate, c=10)
    assert rmse(padded, truth, c=10) == rmse(estimate, truth, c=10)


@pytest.mark.parametrize("unit", [1.0, np.pi / 180])
def test_metrics_match_worked_examples_of_the_specification(unit: float) -> None:
    truth, estimate, c = unit * np.array([10, 20, 40]), unit * np.array([11, 26, 70]), 10 * unit
    parts = gospa(truth, estimate, c)
    assert (parts.total / unit, parts.distance / unit) == pytest.approx((17, 7))
    assert (parts.missed / unit, parts.false / unit) == pytest.approx((5, 5))
    assert rmse(truth, estimate, c) / unit == pytest.approx(np.sqrt(137 / 3))
    assert gospa(truth, [], c).total / unit == pytest.approx(15)
    assert rmse(truth, [], c) / unit == pytest.approx(10)
    assert (gospa([], estimate[:2], c).total / unit, rmse([], estimate, c)) == pytest.approx(
        (10, 0)
    )


def test_gospa_pair_at_the_cut_off_is_not_matched() -> None:
    assert gospa([0], [10], c=10) == Gospa(10, 0, 5, 5)
    assert gospa([0], [10], c=10, alpha=1) == Gospa(10, 0, 5, 5)
    assert gospa([0, 0], [0], c=10, alpha=1) == Gospa(10, 0, 10, 0)


def test_metrics_of_two_empty_sets_are_zero() -> None:
    assert gospa([], [], c=1) == Gospa(0, 0, 0, 0)
    assert ospa([], np.empty((0, 2)), c=1) == 0
    assert gospa([[1, 2]], [], c=4).total == 2


def test_metrics_wrap_angles_with_a_period() -> None:
    assert gospa([np.pi - 0.01], [-np.pi], c=1, period=2 * np.pi).distance == pytest.approx(0.01)
    assert rmse([np.pi - 0.01], [-np.pi], c=1) == 1


def test_mean_metrics_average_over_steps() -> None:
    truth = np.array([[0.0, 50.0], [1.0, np.nan]])
    estimate = [[2.0], []]
    assert mean_gospa(truth, estimate, c=10) == Gospa(6, 1, 5, 0)
    assert mean_rmse(truth, estimate, c=10) == pytest.approx((np.sqrt(52) + 10) / 2)
    positions = np.zeros((3, 2, 2))
    assert mean_gospa(positions, positions + np.array([3, 4]), c=10, p=2).distance == 50


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"c": 0}, "c must be finite and positive; got 0"),
        ({"c": np.inf}, "c must be finite and positive; got inf"),
        ({"p": 0.5}, "p must be finite and at least 1; got 0.5"),
        ({"alpha": 2.5}, r"alpha must lie in \(0, 2\]; got 2.5"),
        ({"period": -1}, "period must be finite and positive; got -1"),
        ({"estimate": [[1.0, 2.0]]}, "must have the same dimension; got 1 and 2"),
        ({"estimate": [np.inf]}, "estimate must be finite, or NaN for absent points"),
        ({"truth": 1.0}, r"truth must have shape \(n,\) or \(n, dim\); got \(\)"),
    ],
)
def test_gospa_invalid_argument_is_rejected(arguments: dict[str, float], message: str) -> None:
    good = {"truth": [1.0], "estimate": [2.0], "c": 10}
    with pytest.raises(ValueError, match=message):
        gospa(**(good | arguments))  # type: ignore[arg-type]


def test_other_metrics_reject_invalid_arguments() -> None:
    with pytest.raises(ValueError, match="c must be"):
        rmse([1], [1], c=-1)
    with pytest.raises(ValueError, match="p must be"):
        ospa([1], [1], c=1, p=np.inf)
    with pytest.raises(ValueError, match="same number of steps, >= 1; got 1 and 2"):
        mean_rmse([[1]], [[1], [2]], c=1)
    with pytest.raises(ValueError, match=">= 1; got 0 and 0"):
        mean_gospa([], [], c=1)


@LAW
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.sampled_from([None, 1.0, 360.0]))
def test_best_assignment_is_the_best_of_all_permutations(
    seed: int, n_sources: int, period: float | None
) -> None:
    rng = np.random.default_rng(seed)
    truth, estimate = rng.uniform(-400, 400, (2, 3, 2, n_sources))

    def squares(t: np.ndarray, f: np.ndarray) -> float:
        difference = np.abs(t - f) % (period or np.inf)
        return float((np.minimum(difference, (period or np.inf) - difference) ** 2).sum())

    for run in range(3):
        total = sum(
            min(squares(t, f[list(order)]) for order in permutations(range(n_sources)))
            for t, f in zip(truth[run], estimate[run], strict=True)
        )
        ours = best_assignment_rmse(truth, estimate, period)
        assert ours[run] == pytest.approx(np.sqrt(total / 2 / n_sources), abs=1e-9)


def test_best_assignment_rmse_requires_finite_angles_of_fixed_number() -> None:
    with pytest.raises(ValueError, match="n_steps, n_sources"):
        best_assignment_rmse([1.0, 2.0], [1.0, 2.0])
    with pytest.raises(ValueError, match=r"got \(1, 2\) and \(1, 1\)"):
        best_assignment_rmse([[1.0, 2.0]], [[1.0]])
    with pytest.raises(ValueError, match="use rmse for missed sources"):
        best_assignment_rmse([[1.0, 2.0]], [[1.0, np.nan]])
    with pytest.raises(ValueError, match="period must be finite and positive"):
        best_assignment_rmse([[1.0]], [[1.0]], period=0)


@LAW
@given(POINTS, POINTS, CUTS, EXPONENTS)
def test_gospa_of_arrays_equals_that_of_lists(
    truth: list[tuple[float, float]],
    estimate: list[tuple[float, float]],
    c: float,
    p: float,
) -> None:
    arrays = [np.array(each).reshape(-1, 2) for each in (truth, estimate)]
    padded = [np.vstack([each, np.full((1, 2), np.nan)]) for each in arrays]
    plain = gospa(arrays[0], arrays[1], c, p)
    assert plain == gospa(padded[0], padded[1], c, p)
    np.testing.assert_array_equal(arrays[0], np.array(truth).reshape(-1, 2))  # not written into
