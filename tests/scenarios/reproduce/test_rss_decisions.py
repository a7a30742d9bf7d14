"""Decisions on the claims of the paper on signal strength, from fabricated results."""

from typing import Any

import numpy as np
import pytest

from arrivals.scenarios.metrics.position_errors import PositionErrors
from arrivals.scenarios.reproduce.claims import Verdict
from arrivals.scenarios.reproduce.paper_claims import verdicts_of
from arrivals.scenarios.reproduce.rss import decisions as rss
from arrivals.scenarios.reproduce.rss.convergence import LocalMaxima
from arrivals.scenarios.reproduce.rss.published_values import SEVEN, THREE
from arrivals.scenarios.reproduce.rss.table_1 import table1
from arrivals.scenarios.reproduce.rss.timing import CYCLE, DIFFERENCES, SEARCH
from arrivals.scenarios.reproduce.signal_strength.paper_claims import CLAIMS as SIGNAL_STRENGTH

N = 200
RNG = np.random.default_rng(0)
NORMAL = RNG.standard_normal((N, 3, 2))
EMPTY = rss.Table1Results({}, {}, {}, {}, {}, {}, {})


def errors(std: float, bias: float = 0.0) -> PositionErrors:
    position = std * NORMAL + bias
    return PositionErrors(position, position[..., 0])


def fabricated(**changes: Any) -> rss.Table1Results:
    """Return results in which Algorithm 1 is worse and ours better than ML."""
    std = {"vb_literal": 3.0, "vb": 1.0, "lm": 2.0}
    flags = np.arange(N) < 0.8 * N
    values: dict[str, Any] = {
        "errors": {(THREE, name): errors(one) for name, one in std.items()},
        "power": {(THREE, name): 80 + one * NORMAL[..., 0] for name, one in std.items()},
        "settled": {(THREE, "vb_literal"): flags, (THREE, "vb"): ~flags},
        "jumped": {(THREE, "vb_literal"): flags, (THREE, "vb"): flags & False},
        "maxima": {
            (THREE, "vb_literal"): LocalMaxima(flags, ~flags),
            (THREE, "vb"): LocalMaxima(flags & False, ~flags),
            (THREE, "lm"): LocalMaxima(np.arange(N) < 0.5 * N, np.arange(N) < 0.1 * N),
        },
    }
    return EMPTY._replace(**values | changes)


def holds(both: Any, results: rss.Table1Results) -> list[bool | None]:
    """Return the decisions by the paper's form and by ours."""
    decisions = [decide(results) for decide in both]
    return [None if one is None else one.holds for one in decisions]


@pytest.mark.parametrize("metric", ["location_rms", "amplitude_rms", "power_std"])
def test_accuracy_is_decided_by_both_forms(metric: str) -> None:
    assert holds(rss.smaller(metric, THREE, True), fabricated()) == [False, True]
    assert holds(rss.smaller(metric, THREE, False), fabricated()) == [True, False]


def test_equal_errors_are_not_decided_and_the_paper_stands_beside_ours() -> None:
    same = {(THREE, name): errors(1.0) for name in ("vb_literal", "vb")}
    other = PositionErrors(NORMAL[::-1], NORMAL[::-1, :, 0])
    results = fabricated(errors=same | {(THREE, "lm"): other})
    assert holds(rss.smaller("location_rms", THREE, True), results) == [None, None]
    decision = rss.smaller("location_rms", THREE, True)[0](results)
    assert decision is not None
    assert "paper 8.47 and 14.1" in decision.numbers


def test_bias_is_compared_without_its_sign() -> None:
    biased = {(SEVEN, name): errors(0.1, bias) for name, bias in
              {"vb_literal": -2.0, "vb": 0.0, "lm": 1.0}.items()}  # fmt: skip
    both = rss.smaller("amplitude_bias", SEVEN, False)
    assert holds(both, fabricated(errors=biased)) == [True, False]


def test_jackknife_is_the_standard_error_of_a_mean() -> None:
    x = RNG.standard_normal(1000)
    mean, error = rss.jackknife(lambda rows: float(x[rows].mean()), 1000)
    assert mean == pytest.approx(x.mean())
    assert error == pytest.approx(x.std() / np.sqrt(1000), rel=0.4)  # of 25 groups
    assert np.isnan(rss.jackknife(lambda rows: 1.0, 1)[1])


def test_shares_of_trials() -> None:
    results = fabricated()
    assert holds(rss.mostly("settled", THREE), results) == [True, False]
    assert holds(rss.seldom("jumped", THREE), results) == [False, None]  # 200 do not show 1 in 100
    many = {(THREE, "vb"): np.zeros(2000, dtype=bool)}
    assert holds(rss.seldom("jumped", THREE), fabricated(jumped=many)) == [None, True]
    assert holds(rss.more_stuck(THREE), results) == [False, True]
    assert holds([rss.hidden(THREE)], results) == [True]
    always = {(THREE, "vb_literal"): np.ones(N, dtype=bool), (THREE, "vb"): np.arange(N) > 0}
    assert holds(rss.always("converged", THREE), fabricated(converged=always)) == [None, False]


def test_few_cycles_are_as_good_where_the_error_is_at_most_a_tenth_larger() -> None:
    few = {(THREE, f"{name} {rss.FEW}"): errors(3.0) for name in ("vb", "vb_literal")}
    results = fabricated(errors={**fabricated().errors, **few})
    assert holds(rss.as_good_after_few(THREE), results) == [True, False]


def test_times() -> None:
    ms = {("vb_literal", 1): 1.0, ("vb_literal", 5): 2.0, ("vb_literal", 50): 20.0}
    times = {(f"{CYCLE} {name}", K): np.array([value, 2 * value])
             for (name, K), value in ms.items()}  # fmt: skip
    times |= {(f"{CYCLE} vb", K): np.array([5.0]) for K in (1, 5, 50)}
    times |= {(DIFFERENCES, 1): np.array([8.0]), (SEARCH, 1): np.array([1.0])}
    times |= {(DIFFERENCES, K): np.array([float(K**5)]) for K in (5, 50)}
    results = fabricated(times=times)
    assert holds(rss.faster(1), results) == [True, False]
    assert holds(rss.linear(), results) == [True, True]
    assert holds(rss.exponential(), results) == [True, None]


def test_a_study_without_results_decides_nothing_and_entries_are_once_there() -> None:
    keys = [(claim.study, claim.place, claim.text) for claim in SIGNAL_STRENGTH]
    assert len(set(keys)) == len(keys)
    assert all(claim.place and claim.source == "paper" for claim in SIGNAL_STRENGTH)
    assert not [one for one in verdicts_of("rss", EMPTY) if one.holds is not None]


def test_table_1_has_rows_claims_and_a_figure() -> None:
    report = table1(2, 0, quick=True)
    assert len({row[:2] for row in report.rows}) == len(report.rows) == 16
    assert len(report.shown) <= 8
    assert list(report.figures) == ["fig4"]
    verdicts: list[Verdict] = verdicts_of("rss", report.results)
    assert all(one.by_paper or one.by_ours for one in verdicts if "maxima" not in one.claim.text)
