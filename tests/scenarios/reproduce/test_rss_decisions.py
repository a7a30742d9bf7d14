"""Decisions on the claims of the paper on signal strength, from fabricated results."""

from typing import Any

import numpy as np
import pytest

from arrivals.scenarios.metrics.position_errors import PositionErrors
from arrivals.scenarios.reproduce.claims import Verdict
from arrivals.scenarios.reproduce.paper_claims import verdicts_of
from arrivals.scenarios.reproduce.rss import convergence
from arrivals.scenarios.reproduce.rss import convergence_decisions as ends
from arrivals.scenarios.reproduce.rss import decisions as rss
from arrivals.scenarios.reproduce.rss import time_decisions as timed
from arrivals.scenarios.reproduce.rss.convergence import LocalMaxima, ModeSteps
from arrivals.scenarios.reproduce.rss.operations import cycle_operations, search_operations
from arrivals.scenarios.reproduce.rss.published_values import SEVEN, THREE
from arrivals.scenarios.reproduce.rss.table_1 import table1
from arrivals.scenarios.reproduce.rss.timing import CYCLE, DIFFERENCES, SEARCH
from arrivals.scenarios.reproduce.signal_strength.paper_claims import CLAIMS as SIGNAL_STRENGTH

N = 200
RNG = np.random.default_rng(0)
NORMAL = RNG.standard_normal((N, 3, 2))
EMPTY = rss.Table1Results({}, {}, {}, {}, {}, {}, {}, {}, {}, {})


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
        "diverged": {
            (THREE, "vb_literal"): flags,
            (THREE, "vb"): flags & False,
            (THREE, "lm"): np.arange(N) < 0.5 * N,
        },
        "unmoved": {(THREE, DIFFERENCES): flags, (THREE, "lm"): flags & False},
        "steps": {(THREE, "vb_literal"): 200.0 * flags, (THREE, "vb"): 0.0 * flags},
        "modes": {THREE: ModeSteps(np.zeros(N), np.where(flags, 200.0, 0.0))},
        "maxima": {
            (THREE, "vb_literal"): LocalMaxima(flags, np.zeros(N)),
            (THREE, "vb"): LocalMaxima(flags & False, np.zeros(N)),
            (THREE, "lm"): LocalMaxima(np.arange(N) < 0.5 * N, RNG.random(N)),
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
    assert decision.numbers.startswith("VB ")
    assert "the paper has 8.47 and 14.1 m" in decision.numbers


def test_bias_is_compared_without_its_sign() -> None:
    biased = {(SEVEN, name): errors(0.1, bias) for name, bias in
              {"vb_literal": -2.0, "vb": 0.0, "lm": 1.0}.items()}  # fmt: skip
    both = rss.smaller("amplitude_bias", SEVEN, False)
    assert holds(both, fabricated(errors=biased)) == [True, False]


def test_competitive_is_at_most_a_fifth_worse_beyond_the_spread() -> None:
    assert holds(rss.competitive(THREE), fabricated()) == [False, True]
    near = {(THREE, "vb"): errors(1.2), (THREE, "lm"): PositionErrors(NORMAL[::-1], NORMAL[..., 0])}
    assert holds(rss.competitive(THREE), fabricated(errors=near)) == [None, None]


def test_shares_of_trials() -> None:
    results = fabricated()
    assert holds(ends.mostly("settled", THREE), results) == [True, False]
    assert holds(ends.more_stuck(THREE), results) == [False, True]
    assert holds(ends.more_divergent(THREE), results) == [True, False]
    assert holds(ends.without_direction(THREE), results) == [True, False]
    always = {(THREE, "vb_literal"): np.ones(N, dtype=bool), (THREE, "vb"): np.arange(N) > 0}
    assert holds(ends.always("converged", THREE), fabricated(converged=always)) == [None, False]
    jumps = [ends.jumps_mostly(THREE, name) for name in ("vb_literal", "vb")]
    assert holds(jumps, results) == [True, False]


def test_mode_search_is_compared_with_that_without_the_prior() -> None:
    assert holds([ends.stable_by_prior(THREE)], fabricated()) == [True]
    same = {THREE: ModeSteps(np.zeros(N), np.zeros(N))}
    assert holds([ends.stable_by_prior(THREE)], fabricated(modes=same)) == [None]


def test_detection_is_ranked_without_a_threshold() -> None:
    results = fabricated()
    assert holds(ends.visible(THREE), results) == [True, None]  # ours has no diverged trial
    assert holds(ends.harder(THREE), results) == [True, None]
    blind = {(THREE, "vb_literal"): np.zeros(N)}  # half of the pairs
    assert holds(ends.visible(THREE), fabricated(steps=blind))[0] is False
    stuck = LocalMaxima(np.arange(N) < 0.5 * N, np.zeros(N))
    same = fabricated(steps=blind, maxima={(THREE, "lm"): stuck})
    assert holds(ends.harder(THREE), same)[0] is None
    assert "0 of 200 trials" in str(ends.visible(THREE)[1](results))


def test_estimates_outside_the_sensors_have_diverged() -> None:
    theta = np.array([[[0.0, 129.0]], [[0.0, 131.0]], [[np.nan, 0.0]]])
    assert convergence.diverged(theta, 100.0).tolist() == [False, True, True]


def test_few_cycles_are_as_good_where_the_error_is_at_most_a_tenth_larger() -> None:
    few = {(THREE, f"{name} {rss.FEW}"): errors(3.0) for name in ("vb", "vb_literal")}
    results = fabricated(errors={**fabricated().errors, **few})
    assert holds(ends.as_good_after_few(THREE), results) == [True, False]


def ms(value: float) -> Any:
    return value * np.array([1.0, 1.02, 0.98])


def test_times_decide_with_the_operations() -> None:
    times = {(f"{CYCLE} {name}", K): ms(K) for name in ("vb", "vb_literal") for K in (1, 5, 50)}
    times |= {(DIFFERENCES, 1): ms(1.5), (SEARCH, 1): ms(1.0)}
    times |= {(DIFFERENCES, 50): ms(400.0), (SEARCH, 50): ms(10.0)}
    times |= {(name, 5): ms(5.0) for name in (DIFFERENCES, SEARCH)}
    results = fabricated(times=times)
    assert holds(timed.faster(1, 5.0), results) == [False, False]
    assert holds(timed.faster(50, 2.0), results) == [True, None]  # fewer operations, more time
    assert holds(timed.linear(), results) == [True, True]
    assert holds(timed.exponential(), results) == [False, False]
    fast = {**times, (DIFFERENCES, 1): ms(10.0)}  # but not by operations
    assert holds(timed.faster(1, 5.0), fabricated(times=fast))[0] is None
    one = {key: value[:1] for key, value in times.items()}
    assert holds(timed.faster(50, 2.0), fabricated(times=one)) == [None, None]


def test_operations_are_linear_for_a_cycle_and_quadratic_by_differences() -> None:
    cycle = [cycle_operations(K, 400) for K in (100, 1000)]
    assert cycle[1] / cycle[0] == pytest.approx(10, rel=0.01)
    search = [search_operations(K, 400, differences=True) for K in (100, 1000)]
    assert search[1] / search[0] == pytest.approx(100, rel=0.01)
    assert search_operations(1, 400, differences=True) < 2 * cycle_operations(1, 400)


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
