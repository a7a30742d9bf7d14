"""Packings of disjoint sets against the enumeration of all of them."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.trackers.fusion.births.packings import packings

Sets = list[frozenset[tuple[int, int]]]
detections = st.tuples(st.integers(0, 2), st.integers(0, 2))
sets_of_detections = st.lists(st.frozensets(detections, min_size=2, max_size=3), max_size=8)
problems = sets_of_detections.flatmap(
    lambda sets: st.tuples(
        st.just(sets),
        st.lists(st.integers(1, 160).map(lambda n: n / 8), min_size=len(sets), max_size=len(sets)),
    )
)


def enumerated(members: Sets, weights: list[float], within: float) -> dict[tuple[int, ...], float]:
    """Return all packings within a difference of the best."""
    found = {}
    for size in range(len(members) + 1):
        for chosen in itertools.combinations(range(len(members)), size):
            union = frozenset().union(*(members[i] for i in chosen))
            if len(union) == sum(len(members[i]) for i in chosen):
                found[chosen] = sum(weights[i] for i in chosen)
    best = max(found.values())
    return {chosen: total for chosen, total in found.items() if total >= best - within}


def test_false_triple_across_three_true_ones_loses() -> None:
    true = [frozenset((s, j) for s in range(3)) for j in range(3)]
    false = frozenset((s, s) for s in range(3))
    pairs = [frozenset({(0, 1), (2, 0)}), frozenset({(1, 2), (2, 1)})]
    weights = np.array([12.0, 11.0, 10.0, 13.0, 3.0, 2.0]) + 3
    found = packings([*true, false, *pairs], weights)
    assert found == [((0, 1, 2), 42.0)]  # greedy: the false one and the pair, 22


@given(problems, st.floats(0, 20))
def test_packings_are_all_within_a_difference_of_the_best(
    problem: tuple[Sets, list[float]], within: float
) -> None:
    members, weights = problem
    found = packings(members, weights, within=within)
    as_sets = {tuple(sorted(chosen)): total for chosen, total in found}
    assert len(as_sets) == len(found)
    assert as_sets == enumerated(members, weights, within)  # eighths: sums are exact
    totals = [total for _, total in found]
    assert totals == sorted(totals, reverse=True)


@given(problems, st.integers(1, 30))
def test_packings_of_few_nodes_are_disjoint_and_at_least_as_good_as_greedy(
    problem: tuple[Sets, list[float]], max_nodes: int
) -> None:
    members, weights = problem
    greedy, taken = 0.0, frozenset[tuple[int, int]]()
    for i in sorted(range(len(weights)), key=lambda i: -weights[i]):
        if not members[i] & taken:
            greedy, taken = greedy + weights[i], taken | members[i]
    found = packings(members, weights, max_nodes=max_nodes)
    assert found[0][1] >= greedy
    for chosen, total in found:
        assert len(frozenset().union(*(members[i] for i in chosen))) == sum(
            len(members[i]) for i in chosen
        )
        assert total == sum(weights[i] for i in chosen)


def test_packings_without_sets_are_the_empty_one() -> None:
    assert packings([], []) == [((), 0.0)]


def test_packings_consider_the_heaviest_sets_alone() -> None:
    members = [frozenset({(0, j), (1, j)}) for j in range(6)]
    assert packings(members, [1.0, 6.0, 2.0, 5.0, 3.0, 4.0], max_sets=2, within=0.0) == [
        ((1, 3), 11.0)
    ]


def test_best_packing_of_a_crowded_step_is_exact() -> None:
    """All triples of five bearings at three stations: 125 sets, the best is an assignment."""
    rng = np.random.default_rng(3)
    triples = list(itertools.product(range(5), repeat=3))
    weights = rng.uniform(1, 12, len(triples))
    for k in range(5):
        weights[triples.index((k, k, k))] = 14.0 + k
    members = [frozenset(enumerate(triple)) for triple in triples]
    (chosen, total), *_ = packings(members, weights)
    assert sorted(triples[i] for i in chosen) == [(k, k, k) for k in range(5)]
    assert total == pytest.approx(80.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"weights": [1.0]}, r"weights must have shape \(2,\); got \(1,\)"),
        ({"weights": [1.0, 0.0]}, "weights must be finite and positive; got"),
        ({"weights": [1.0, np.nan]}, "weights must be finite and positive; got"),
        ({"weights": [1.0, np.inf]}, "weights must be finite and positive; got"),
        ({"max_sets": 0}, "max_sets must be at least 1; got 0"),
        ({"max_nodes": 2.5}, "max_nodes must be a whole number; got 2.5"),
        ({"within": -1.0}, "within must be finite and not negative; got -1.0"),
    ],
)
def test_packings_invalid_argument_raises(arguments: dict[str, Any], message: str) -> None:
    members = [frozenset({(0, 0), (1, 0)}), frozenset({(0, 1), (1, 1)})]
    arguments = {"weights": [1.0, 2.0]} | arguments
    with pytest.raises((TypeError, ValueError), match=message):
        packings(members, **arguments)
