"""Decisions on the claims of SVALSE's paper from fabricated results; metrics; factor graph."""

import inspect
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios import create
from arrivals.scenarios.base import Trial
from arrivals.scenarios.reproduce.claims import counts
from arrivals.scenarios.reproduce.paper_claims import verdicts_of
from arrivals.scenarios.reproduce.svalse import decisions as sv
from arrivals.scenarios.reproduce.svalse.factor_graph import (
    BELIEF_PROPAGATION,
    SCHEDULE,
    VARIABLES,
    draw_factor_graph,
    factors,
)
from arrivals.scenarios.reproduce.svalse.forms import (
    PRINTED_7D,
    STARTS,
    UNMERGED_7D,
    start_label,
)
from arrivals.scenarios.reproduce.svalse.paper_claims import CLAIMS as SVALSE
from arrivals.scenarios.reproduce.svalse.step_metrics import STEP_METRICS, gospa_steps
from arrivals.scenarios.reproduce.swellex96.decisions import SCORES, SeaResults
from arrivals.scenarios.reproduce.swellex96.field import FieldFacts
from arrivals.scenarios.reproduce.swellex96.paper_claims import CLAIMS as AT_SEA
from arrivals.trackers import CoordinateSolver, Run
from arrivals.typing import Float

JITTER = np.array([0.0, 0.1, -0.1, 0.05, -0.05, 0.0])


def fabricated(**gospa: float) -> dict[tuple[str, str, str], Float]:
    """Return GOSPA of six runs by method, "_paper" for the paper's form."""
    names = {name: sv.paper_form(name.removesuffix("_paper")) if name.endswith("_paper") else name
             for name in gospa}  # fmt: skip
    return {("gospa", names[name], ""): mean + n * JITTER
            for n, (name, mean) in enumerate(gospa.items())}  # fmt: skip


def test_claim_is_decided_by_both_forms() -> None:
    results = fabricated(svalse=1.0, valse=2.0, svalse_paper=3.0, valse_paper=2.5)
    by_paper, by_ours = sv.lower("gospa", "svalse", "valse")
    paper, ours = by_paper(results), by_ours(results)
    assert paper is not None
    assert ours is not None
    assert (paper.holds, ours.holds) == (False, True)
    assert ours.numbers == "SVALSE: 1; VALSE: 2 degrees, paired difference -1.00 ± 0.03"


def test_claims_are_left_out_without_their_methods_and_not_decided_within_the_error() -> None:
    by_paper, by_ours = sv.lower("gospa", "svalse", "valse")
    assert by_paper(fabricated(svalse=1.0, valse=1.0)) is None
    undecided = by_ours(fabricated(svalse=1.0, valse=1.001))
    assert undecided is not None
    assert undecided.holds is None
    empty = [verdict for claim in SVALSE if (verdict := claim.decide({})).holds is not None]
    assert not empty


def test_runs_that_failed_are_left_out_of_the_pairs() -> None:
    results = fabricated(svalse=1.0, valse=2.0)
    results["gospa", "valse", ""][0] = np.nan
    decision = sv.lower("gospa", "svalse", "valse")[1](results)
    assert decision is not None
    assert decision.holds


def test_average_over_cases_is_of_all_of_them() -> None:
    results: Any = {("rmse", "svalse", case): n + JITTER for n, case in enumerate(sv.LOW)}
    mean = sv.values(results, "rmse", "svalse", sv.LOW)
    assert mean is not None
    np.testing.assert_allclose(mean, 0.5 + JITTER)
    assert sv.values(results, "rmse", "svalse", (*sv.LOW, "10")) is None


@pytest.mark.parametrize(("value", "holds"), [(5.0, True), (5.3, False)])
def test_published_value_is_compared_with_the_spread_of_runs(value: float, holds: bool) -> None:
    decision = sv.published("gospa", "svalse", value)(fabricated(valse=0.0, svalse_paper=5.0))
    assert decision is not None
    assert decision.holds == holds
    few = {key: runs[:2] for key, runs in fabricated(valse=0.0, svalse_paper=5.0).items()}
    assert sv.published("gospa", "svalse", value)(few) is None


def test_limits_convergence_and_the_largest_part() -> None:
    results = {
        ("number_bias", "svalse", "0"): JITTER - 1,
        ("converged", "svalse", "0"): np.array([1.0, 0.9]),
        ("converged", "svalse", "5"): np.ones(2),
        ("missed", "svalse", "0"): JITTER + 5,
        ("distance", "svalse", "0"): np.ones(6),
        ("false", "svalse", "0"): np.ones(6),
    }
    decisions = [
        both[1](results)
        for both in (
            sv.below_limit("number_bias", "svalse", 0.0, "0"),
            sv.above_limit("number_bias", "svalse", 0.0, "0"),
            sv.mostly("missed", ("distance", "false"), "svalse", "0"),
            sv.always_converges("svalse"),
        )
    ]
    given = [decision for decision in decisions if decision is not None]
    assert [decision.holds for decision in given] == [True, False, True, False]
    assert given[-1].numbers == "in 97.5% of the steps, at worst 95.0% at 0 dB"


@pytest.mark.parametrize(("gospa", "holds"), [(24.0, True), (20.0, False)])
def test_certain_births_as_printed_are_compared_with_the_paper(gospa: float, holds: bool) -> None:
    results = {("gospa", label, ""): np.array([value]) for label, value in (
        (PRINTED_7D, gospa), (UNMERGED_7D, 36.0), (sv.PANELS[3], 17.0))}  # fmt: skip
    decision = sv.as_printed_7d(results)
    assert decision is not None
    assert decision.holds == holds
    assert f"as printed {gospa:.2f} degrees" in decision.numbers
    results.pop(("gospa", PRINTED_7D, ""))
    assert sv.as_printed_7d(results) is None


@pytest.mark.parametrize(("mean", "words"), [(-0.5, "0.5 ± 0.029 sources too few"),
                                             (0.5, "0.5 ± 0.029 sources too many")])  # fmt: skip
def test_number_of_sources_is_too_low_or_too_high(mean: float, words: str) -> None:
    results = {("number_bias", "svalse", "0"): mean + JITTER}
    decision = sv.below_limit("number_bias", "svalse", 0.0, "0", unit="too few or many")[1](results)
    assert decision is not None
    assert decision.holds == (mean < 0)
    assert decision.numbers == words


def test_shares_are_percentages_with_the_names_of_their_methods() -> None:
    results = {("found", "valse", ""): 0.7 + JITTER / 10, ("found", "svalse", ""): np.full(6, 0.9)}
    decision = sv.lower("found", "valse", "svalse", unit="% of them")[1](results)
    assert decision is not None
    assert decision.numbers.startswith("VALSE: 70; SVALSE: 90 % of them, paired difference -20.")
    limited = sv.below_limit("found", "svalse", 0.95, unit="% are found")[1](results)
    assert limited is not None
    assert limited.numbers == "90 ± 0 % are found"


def test_noise_that_starts_elsewhere_is_compared_with_20_db_by_both_forms() -> None:
    results = {("started, missed", start_label(snr_db, ours), ""): snr_db + JITTER + 5 * ours * n
               for ours in (False, True) for n, snr_db in enumerate(STARTS)}  # fmt: skip
    decisions = [decide(results) for decide in sv.starts("missed", STARTS[2], "degrees")]
    given = [decision for decision in decisions if decision is not None]
    assert [decision.holds for decision in given] == [True, True]
    assert given[1].numbers.startswith("VALSE from 20 dB: 25; VALSE from 40 dB: 50 degrees")
    high = sv.starts("missed", STARTS[0], "degrees")[0](results)
    assert high is not None
    assert high.holds is False
    quick = {key: runs for key, runs in results.items() if "by ours" in key[1]}
    assert sv.starts("missed", STARTS[2], "degrees")[0](quick) is None


@pytest.mark.parametrize(("shift", "width", "holds"), [(0.1, 1.05, True), (0.3, 1.0, False),
                                                       (0.1, 0.8, False)])  # fmt: skip
def test_mixture_is_judged_by_means_and_widths(shift: float, width: float, holds: bool) -> None:
    results = {
        ("shift", "mixture", ""): np.full(5, shift),
        ("width", "mixture", ""): np.full(5, width),
    }
    decision = sv.mixture_is_accurate(results)
    assert decision is not None
    assert decision.holds == holds
    assert f"means {shift:.2f} deviations off" in decision.numbers
    assert sv.mixture_is_accurate({}) is None


def test_captions_of_fig_7_are_judged_by_gospa_and_rmse() -> None:
    captions = [
        claim for claim in SVALSE if claim.study == "svalse-fig7" and "in one run" in claim.text
    ]
    texts = [claim.text for claim in captions]
    assert len(captions) == 8
    assert "RMSE of 5.36 degrees in one run with p_d 0.25, p_a 0" in texts
    results = {("rmse", sv.PANELS[2], ""): 5.36 + JITTER}
    decided = [claim.text for claim in captions if claim.decide(results).holds]
    assert decided == ["RMSE of 5.36 degrees in one run with p_d 0.25, p_a 0"]


def test_every_entry_of_the_table_is_once_there_and_names_its_place() -> None:
    keys = [(claim.study, claim.place, claim.text) for claim in (*SVALSE, *AT_SEA)]
    assert len(set(keys)) == len(keys)
    assert all(claim.place and claim.source == "paper" for claim in (*SVALSE, *AT_SEA))


def test_claims_on_the_field_by_its_facts() -> None:
    scores = {name: np.full((3, len(SCORES)), mean) + 0.01 * np.arange(3)[:, None]
              for method, mean in {"svalse": 1.0, "valse": 2.0, "cbf": 3.0}.items()
              for name in (method, sv.paper_form(method))}  # fmt: skip
    facts = FieldFacts(
        0.004, 0.003, 0.97, 0.94, (-12.0, -18.0), 18.0, 11.0, 0.9, (16.0, 23.0, -19.0, -27.0), 208,
        0.86, ("BSBSBSBS", "BSBSBS", "BSBS", "BSB"), (0.25, 0.74, 1.4), 0.93, 0.8, 0.9,
        (0.6, 0.6, 2.0),
    )  # fmt: skip
    verdicts = verdicts_of("swellex96", SeaResults(scores, facts))
    failed = [verdict.claim.text for verdict in verdicts if verdict.holds is False]
    assert failed == ["BSR and BSBR arrive from 15 and -17 degrees: steps 220 to 250"]
    assert counts(verdicts)["paper"] == [13, 1, 0]
    of_field = [verdict for verdict in verdicts if verdict.claim.by_paper is None][:10]
    assert all("by ours (simulated field: " in verdict.line() for verdict in of_field)
    worse = facts._replace(beyond_critical=0.1, many_bounces=0.3, pair_gap=(2.0, 3.0, 4.0))
    verdicts = verdicts_of("swellex96", SeaResults(scores, worse))
    assert counts(verdicts)["paper"] == [10, 4, 0]
    (sentence,) = [verdict.line() for verdict in verdicts if "21.6" in verdict.claim.text]
    assert "10.0% of the power is from beyond it, median of steps 1 to 350" in sentence


def run_of(doa_deg: list[list[float]], like: Run) -> Run:
    """Return a run with these directions in place of a run's own."""
    doa = np.full((len(like), max(len(doa_deg[0]), like.doa.shape[1])), np.nan)
    doa[:, : len(doa_deg[0])] = np.deg2rad(doa_deg)
    fields = dict(like.fields) | {"doa": doa}
    return replace(like, fields=fields, n_found=(~np.isnan(doa)).sum(axis=1))


def test_step_metrics_of_a_stopped_source_near_endfire() -> None:
    scenario = create("svalse_fig4", n_steps=3)
    drawn = scenario.sample(np.random.default_rng(0))
    truth = np.deg2rad([[60.0, 0.0], [60.0, np.nan], [60.0, np.nan]])
    trial = Trial(drawn.measurements, truth, drawn.measurement, drawn.motion)
    found = [[61.0, 0.0], [0.5, np.nan], [61.0, np.nan]]
    run = run_of(found, trial.tracker("cbf").run(trial.measurements))
    metrics = {name: metric(trial, run) for name, metric in STEP_METRICS.items()}
    np.testing.assert_allclose(gospa_steps(trial, run), [1.0, 10.0, 1.0])
    assert metrics["gospa_std"] == pytest.approx(np.std([1.0, 10.0, 1.0]))
    assert metrics["found_near_endfire"] == pytest.approx(2 / 3)
    assert metrics["ghosts"] == 1.0
    assert metrics["number_bias"] == pytest.approx(0.0)


def test_schedule_has_the_order_of_the_solver() -> None:
    source = inspect.getsource(CoordinateSolver.solve)
    inner = [one.method.__name__ for one in SCHEDULE if one.kind != BELIEF_PROPAGATION]
    places = [source.index(f".{name}(") for name in inner]
    assert places == sorted(places)


def test_graph_has_the_parameters_of_the_motion_and_messages_along_its_edges() -> None:
    motion = BernoulliVonMises(kappa=50.0, p_activate=0.3)
    parts = factors(motion)
    assert "κ = 50" in parts["walk"].label
    assert "p_a = 0.3" in parts["chain"].label
    for operation in SCHEDULE:
        for first, last in operation.messages:
            factor, variable = (first, last) if last in VARIABLES else (last, first)
            part = parts[factor.removeprefix("next ")]
            assert variable in (*part.variables, part.earlier)
    texts = [text.get_text() for text in draw_factor_graph(motion).axes[0].texts]
    assert sum("κ = 50" in text for text in texts) == 2
