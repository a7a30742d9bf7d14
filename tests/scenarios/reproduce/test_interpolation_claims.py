"""Claims on the interpolation-delay filter, decided from fabricated results."""

from typing import Any

import numpy as np
import pytest

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.interpolation import decisions as itp
from arrivals.scenarios.reproduce.interpolation import own_claims, table_1, table_2
from arrivals.scenarios.reproduce.interpolation.convergence import LENGTHS, settling_lengths
from arrivals.scenarios.reproduce.interpolation.forms import by_both, by_scan
from arrivals.scenarios.reproduce.interpolation.paper_claims import CLAIMS as INTERPOLATION
from arrivals.scenarios.reproduce.interpolation.trials import SOURCES, draws, scan_records
from arrivals.typing import Float

RNG = np.random.default_rng(0)
ALL = (*INTERPOLATION, *own_claims.CLAIMS)


def ends(source: str = "tone", **stds: float) -> dict[tuple[Any, ...], Float]:
    """Draw 200 final directions around the truth, by method."""
    return {
        (source, method, doa): doa + std * RNG.standard_normal(200)
        for method, std in stds.items()
        for doa in table_1.ANGLES
    }


def test_verdict_follows_the_papers_loop_and_the_default() -> None:
    results = ends(frozen=0.1, B=5.0, conventional=0.3, C=0.5, E2=0.1)
    for doa in table_1.ANGLES:
        results["tone", "literal", doa] = np.full(200, doa - 30.0)
    (claim,) = (c for c in INTERPOLATION if c.text.startswith("a tone (narrow band): the mean"))
    verdict = claim.decide(results)
    assert verdict.by_paper is not None
    assert verdict.holds
    assert verdict.by_paper.numbers.startswith("frozen: error ")
    assert "as printed literal: error -30.00" in verdict.by_paper.numbers
    (claim,) = (c for c in INTERPOLATION if c.text.startswith("a tone (narrow band): the variance "
                "is less"))  # fmt: skip
    verdict = claim.decide(results)
    assert verdict.by_paper is not None
    assert verdict.by_ours is not None
    assert verdict.by_paper.holds
    assert verdict.by_ours.holds is False
    assert verdict.by_ours.numbers.startswith("C ")
    assert "; E2 " in verdict.by_ours.numbers
    assert verdict.by_ours.numbers.endswith("degrees²: holds")


def test_coupled_tones_decide_and_a_tone_stands_beside_them() -> None:
    results = ends(frozen=0.1, C=0.1, conventional=0.1)
    for key, values in ends("qpc", frozen=0.1, C=0.1, conventional=0.1).items():
        results[key] = values + 10.0
    wanted: dict[str, Any] = {"source": "qpc", "beside": "tone", "low": -5.0, "high": 5.0}
    for decide in (
        *by_both(itp.percentage_within, **wanted),
        *by_scan(itp.percentage_within, "conventional", **wanted),
    ):
        decision = decide(results)
        assert decision is not None
        assert decision.holds is False
    decision = by_both(itp.percentage_within, **wanted)[0](results)
    assert decision is not None
    assert "; on a tone frozen " in decision.numbers


@pytest.mark.parametrize(("factor", "holds"), [(1.0, False), (1.5, True)])
def test_lower_variance_compares_within_a_factor(factor: float, holds: bool) -> None:
    results = ends(B=1.0)
    for doa in table_1.ANGLES:
        results["tone", "mvdr", doa] = doa + (results["tone", "B", doa] - doa) * 0.9
    decision = itp.lower_variance("B", results, source="tone", than="mvdr", factor=factor)
    assert decision is not None
    assert decision.holds is holds


def test_zero_variance_must_be_that_of_all_cases() -> None:
    results = ends(mvdr=0.0)
    decision = itp.zero_variance("mvdr", results)
    assert decision is not None
    assert decision.holds
    results["tone", "mvdr", 75.0] = np.array([75.0, 76.0])
    for cases, holds in (((), False), ((15.0, 30.0), True)):
        decision = itp.zero_variance("mvdr", results, cases=cases)
        assert decision is not None
        assert decision.holds is holds
    few = {key: values[: itp.ENOUGH - 1] for key, values in ends(mvdr=0.0).items()}
    decision = itp.zero_variance("mvdr", few)
    assert decision is not None
    assert decision.holds is None


def test_percentages_and_variances_near_a_limit_are_not_decided() -> None:
    results = ends(B=1.0)
    wide = itp.variances_within("B", results, source="tone", low=0.1, high=10.0)
    edge = itp.variances_within("B", results, source="tone", low=0.1, high=1.0)
    assert wide is not None
    assert edge is not None
    assert wide.holds
    assert edge.holds is not True
    for low, holds in ((-50.0, True), (20.0, False)):
        decision = itp.percentage_within("B", results, source="tone", low=low, high=50.0)
        assert decision is not None
        assert decision.holds is holds


def test_published_means_of_the_same_trials_hold() -> None:
    results = ends(mvdr=0.0, B=0.2)
    results |= {("tone", "wide", doa): values for (_, name, doa), values in
                ends(wide=20.0).items() if name == "wide"}  # fmt: skip
    for method, published, holds in (
        ("mvdr", "mvdr", True), ("B", "proposed", False), ("wide", "mvdr", None)
    ):  # fmt: skip
        decision = itp.published_means(
            method, results, published=table_1.PAPER[published], source="tone"
        )
        assert decision is not None
        assert decision.holds is holds


@pytest.mark.parametrize(("near", "holds"), [(90, True), (52, None), (20, False)])
def test_convergence_is_that_of_most_trials(near: int, holds: bool | None) -> None:
    errors = np.where(np.arange(100) < near, 0.5, 9.0)
    decision = itp.converges("B", {("end", 30.0, 5.0, "B"): errors}, doa=30.0, snr_db=5.0)
    assert decision is not None
    assert decision.holds is holds


def test_errors_are_compared_in_pairs() -> None:
    one = RNG.standard_normal(50)
    results = {("fig8", 5.0, "B"): 1.1 * one, ("fig8", 5.0, "mvdr"): one}
    results |= {("fig8", 5.0, "CRB"): np.full(50, 1.0)}
    decision = itp.rms_below("B", results, than="mvdr", cases=[("fig8", 5.0)])
    assert decision is not None
    assert decision.holds is False
    bound = itp.near_bound("mvdr", results, cases=[("fig8", 5.0)])
    assert bound is not None
    assert itp.smaller("B", results, than="E", cases=[("fig8", 5.0)], unit="degrees") is None
    for factor, holds in ((1.0, False), (1.25, True)):  # 1.21 times the variance
        decision = itp.variance_below(
            "B", results, than="mvdr", cases=[("fig8", 5.0)], factor=factor
        )
        assert decision is not None
        assert decision.holds is holds
    assert itp.variance_below("B", results, than="mvdr", cases=[("fig8", 0.0)]) is None


def test_variance_leaves_out_the_bias() -> None:
    one = RNG.standard_normal(50)
    results = {("fig8", 5.0, "C"): 3 + 0.5 * one, ("fig8", 5.0, "mvdr"): one}
    lower = itp.variance_below("C", results, than="mvdr", cases=[("fig8", 5.0)])
    error = itp.rms_below("C", results, than="mvdr", cases=[("fig8", 5.0)])
    assert lower is not None
    assert error is not None
    assert (lower.holds, error.holds) == (True, False)
    far = {("fig8", 5.0, "C"): 40 + one, ("fig8", 5.0, "mvdr"): one}  # beyond the cut-off
    same = itp.variance_below("C", far, than="mvdr", cases=[("fig8", 5.0)], factor=1.1)
    assert same is not None
    assert same.holds


def test_small_differences_of_times_decide_nothing() -> None:
    for ratio, holds in ((0.9, None), (0.5, True), (2.0, False)):
        results = {("C", "all sensors", "together"): ratio * np.array([1.0, 1.001, 0.999]),
                   ("mvdr", table_2.RECORD, "together"): np.ones(3)}  # fmt: skip
        decision = table_2.faster("C", results, than="mvdr", reading=table_2.RECORD)
        assert decision is not None
        assert decision.holds is holds


def test_settling_lengths_count_from_the_last_large_error() -> None:
    errors = np.zeros((3, len(LENGTHS)))
    errors[1, 2], errors[2, -1] = -1.5, 3.0
    np.testing.assert_array_equal(settling_lengths(errors), [4, 10, 200])


@pytest.mark.parametrize("claim", ALL, ids=lambda claim: claim.text[:60])
def test_claims_without_results_are_left_out(claim: Claim) -> None:
    if getattr(claim.by_paper, "func", None) is table_2.fewer_operations:
        pytest.skip("decided by counting")
    assert claim.decide({}).holds is None


@pytest.mark.parametrize("method", table_2.SCANS)
@pytest.mark.parametrize("reading", table_2.READINGS)
def test_timed_scans_find_the_same_directions(method: Any, reading: str) -> None:
    scenario = SOURCES["tone"]
    samples = draws(scenario, 6, 0)
    found = table_2.final_scans(samples, method=method, reading=reading)
    expected = scan_records(scenario, samples, method, refine=False)
    np.testing.assert_allclose(found, expected, atol=1.0 + 1e-9)  # a maximum between two degrees
    assert np.median(np.abs(found - expected)) < 1e-9


def test_operations_grow_with_spectra() -> None:
    for method in table_2.SCANS:
        once, always = (table_2.operations(method, reading) for reading in table_2.READINGS)
        assert table_2.operations("frozen", "every sensor") < once < always
