"""Association by belief propagation against the sum over all associations."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from arrivals.trackers.fusion.stations.association import associate
from arrivals.typing import Float

small = st.tuples(st.integers(1, 3), st.integers(1, 3))
odds_values = st.one_of(st.just(0.0), st.floats(1e-3, 30.0))
odds_tables = small.flatmap(lambda shape: arrays(np.float64, shape, elements=odds_values))


def enumerated(odds: Float) -> tuple[Float, float]:
    """Return exact probabilities and log evidence: the sum over all associations."""
    n_tracks, n_detections = odds.shape
    total, marginal = 0.0, np.zeros_like(odds)
    for choice in itertools.product(range(-1, n_detections), repeat=n_tracks):
        pairs = [(i, j) for i, j in enumerate(choice) if j >= 0]
        if len({j for _, j in pairs}) == len(pairs):
            weight = float(np.prod([odds[pair] for pair in pairs]))
            total += weight
            for pair in pairs:
                marginal[pair] += weight
    return marginal / total, float(np.log(total))


def test_associate_of_golden_odds() -> None:
    probabilities, log_evidence = associate([[4.0, 1.0, 0.1], [2.0, 3.0, 0.0]])
    expected = [
        [0.635301354383577, 0.0856396022002955, 0.02536900394692068],
        [0.13637761009413688, 0.6057041831121696, 0.0],
    ]
    np.testing.assert_allclose(probabilities, expected, rtol=1e-9)
    assert float(log_evidence) == pytest.approx(3.203778284370619, rel=1e-9)
    exact, log_exact = enumerated(np.array([[4.0, 1.0, 0.1], [2.0, 3.0, 0.0]]))
    assert np.abs(probabilities - exact).max() < 0.032
    assert log_exact == pytest.approx(3.242592351485517)


@given(arrays(np.float64, st.integers(1, 6), elements=st.floats(0, 1e6)), st.booleans())
def test_associate_of_one_row_or_column_is_exact(odds: Float, as_row: bool) -> None:
    table = odds[None] if as_row else odds[:, None]
    probabilities, log_evidence = associate(table)
    np.testing.assert_allclose(probabilities, table / (1 + odds.sum()), rtol=1e-9)
    np.testing.assert_allclose(log_evidence, np.log1p(odds.sum()), rtol=1e-9, atol=1e-12)


def test_associate_of_a_chain_without_loops_is_exact() -> None:
    odds = np.array([[2.0, 5.0, 0.0], [0.0, 1.5, 0.7], [0.0, 0.0, 3.0]])
    exact, log_exact = enumerated(odds)
    probabilities, log_evidence = associate(odds, tol=1e-12)
    np.testing.assert_allclose(probabilities, exact, atol=1e-9)
    assert float(log_evidence) == pytest.approx(log_exact, abs=1e-9)


@given(odds_tables)
def test_associate_is_near_the_sum_over_all_associations(odds: Float) -> None:
    exact, log_exact = enumerated(odds)
    probabilities, log_evidence = associate(odds)
    # 20,000 random tables of such odds: at most 0.19, and from -0.46 to 0
    assert np.abs(probabilities - exact).max() < 0.25
    assert -0.6 < log_evidence - log_exact < 1e-4
    assert ((probabilities > 0) <= (odds > 0)).all()


@given(small.flatmap(lambda s: arrays(np.float64, s, elements=st.floats(0, 1e9))))
def test_associate_uses_each_track_and_each_detection_once(odds: Float) -> None:
    probabilities, _ = associate(odds)
    assert probabilities.min() >= 0
    assert probabilities.sum(axis=0).max() <= 1 + 1e-12
    assert probabilities.sum(axis=1).max() <= 1 + 1e-12


@given(odds_tables, st.randoms(use_true_random=False))
def test_associate_follows_a_permutation(odds: Float, random: Any) -> None:
    rows, columns = list(range(odds.shape[0])), list(range(odds.shape[1]))
    random.shuffle(rows)
    random.shuffle(columns)
    probabilities, log_evidence = associate(odds)
    permuted, same = associate(odds[np.ix_(rows, columns)])
    np.testing.assert_allclose(permuted, probabilities[np.ix_(rows, columns)], atol=1e-12)
    assert float(same) == pytest.approx(float(log_evidence), abs=1e-12)


def test_batch_of_problems_equals_each_by_itself() -> None:
    odds = np.random.default_rng(1).lognormal(0, 3, (5, 2, 4, 3))  # of very different convergence
    probabilities, log_evidence = associate(odds)
    assert (probabilities.shape, log_evidence.shape) == ((5, 2, 4, 3), (5, 2))
    for index in np.ndindex(5, 2):
        one, log_one = associate(odds[index])
        np.testing.assert_allclose(probabilities[index], one, rtol=1e-12)
        assert float(log_evidence[index]) == pytest.approx(float(log_one), abs=1e-12)


def test_tracks_and_detections_without_odds_change_nothing() -> None:
    odds = np.array([[4.0, 1.0], [2.0, 3.0]])
    padded = np.zeros((3, 4))
    padded[np.ix_([0, 2], [1, 3])] = odds
    probabilities, log_evidence = associate(padded)
    one, log_one = associate(odds)
    np.testing.assert_allclose(probabilities[np.ix_([0, 2], [1, 3])], one)
    assert probabilities.sum() == pytest.approx(one.sum())
    assert float(log_evidence) == pytest.approx(float(log_one))


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0), (2, 0, 4), (0, 2, 3)])
def test_associate_without_pairs_is_empty_and_certain(shape: tuple[int, ...]) -> None:
    probabilities, log_evidence = associate(np.zeros(shape))
    assert probabilities.shape == shape
    np.testing.assert_array_equal(log_evidence, np.zeros(shape[:-2]))


def test_associate_of_huge_odds_is_finite() -> None:
    probabilities, log_evidence = associate([[1e100, 1e100], [1e100, 1.0]])
    np.testing.assert_allclose(probabilities, [[0, 1], [1, 0]], atol=1e-12)
    assert float(log_evidence) == pytest.approx(200 * np.log(10))


@pytest.mark.parametrize(
    ("odds", "message"),
    [
        ([1.0, 2.0], r"odds must have shape \(..., n_tracks, n_detections\); got \(2,\)"),
        ([[-1.0]], r"odds must lie in \[0, 1e\+140\]; got \[\[-1.0\]\]"),
        ([[np.nan]], r"odds must lie in"),
        ([[np.inf]], r"odds must lie in"),
        ([[1j]], r"odds must hold real numbers"),
    ],
)
def test_associate_invalid_odds_raises(odds: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        associate(odds)
