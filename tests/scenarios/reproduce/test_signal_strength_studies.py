"""Studies of the statistic of signal strength, of moving sources, and of networks."""

from typing import Any

import numpy as np
import pytest

from arrivals.scenarios import create
from arrivals.scenarios.reproduce.claims import Verdict
from arrivals.scenarios.reproduce.paper_claims import verdicts_of
from arrivals.scenarios.reproduce.rss.trials import draws
from arrivals.scenarios.reproduce.signal_strength import doppler as moving
from arrivals.scenarios.reproduce.signal_strength import envelope_decisions as env
from arrivals.scenarios.reproduce.signal_strength import network as net
from arrivals.scenarios.reproduce.signal_strength.drive_by import (
    EnvelopeLaw,
    drive_by,
    envelope,
    envelope_law,
)
from arrivals.scenarios.reproduce.signal_strength.envelope import envelope_study
from arrivals.scenarios.reproduce.signal_strength.graphs import draw_graph, model_graph, separable
from arrivals.scenarios.reproduce.signal_strength.range_estimates import (
    AMPLITUDE,
    ENERGY,
    LOG,
    Errors,
    distribution_distance,
    range_bound,
    range_errors,
)
from arrivals.scenarios.simulations.signal_strength import Table1K3
from arrivals.trackers.rss.inference.joint_posterior import Prior

RNG = np.random.default_rng(0)


def holds(verdicts: list[Verdict], part: str) -> list[bool | None]:
    return [one.holds for one in verdicts if part in one.claim.text]


def test_envelope_of_the_synthetic_sound_is_circular_gaussian_and_uncorrelated_far_apart() -> None:
    law = envelope_law(300, np.random.default_rng(1))
    assert min(law.p_gaussian, law.p_circular, law.p_uncorrelated) > 0.01
    assert law.correlation[1] > 3 * law.limit  # adjacent segments are correlated


def test_a_steady_sinusoid_is_not_gaussian_and_remains_correlated() -> None:
    sound = [np.cos(2 * np.pi * 1100 * np.arange(13 * 120) / 48e3 + phase)
             for phase in RNG.uniform(0, 2 * np.pi, 300)]  # fmt: skip
    z = np.array([envelope(one) for one in sound])
    assert np.abs(z).std() < 0.1 * np.abs(z).mean()
    assert np.abs((z[:, 0].conj() * z[:, 6]).mean()) > 0.9 * np.mean(np.abs(z) ** 2)


def test_dominant_frequency_of_the_sound_is_that_of_the_resonance() -> None:
    power = np.abs(np.fft.rfft(drive_by(48_000, np.random.default_rng(0)))) ** 2
    smooth = np.convolve(power, np.ones(101) / 101, "same")
    assert abs(float(smooth.argmax()) - 1100) < 100


@pytest.mark.parametrize("n_snapshots", [50, 100])
def test_range_errors_have_the_bias_of_second_order(n_snapshots: int) -> None:
    # signal alone: E R/R0 - 1 is 3/8N, 5/8N and 7/8N; the noise, a twelfth of it, adds to these
    bias = [float(range_errors(form, n_snapshots, np.random.default_rng(0)).error.mean())
            for form in (LOG, AMPLITUDE, ENERGY)]  # fmt: skip
    expected = np.array([3, 5, 7]) / (8 * n_snapshots)
    np.testing.assert_allclose(bias, expected, rtol=0.3)
    error = range_errors(LOG, n_snapshots, np.random.default_rng(0)).error
    assert error.std() == pytest.approx(range_bound(n_snapshots), rel=0.05)


def test_distances_of_the_forms_fall_with_the_number_of_snapshots() -> None:
    distances = [distribution_distance(LOG, N) for N in (1, 8, 100)]
    np.testing.assert_allclose(distances, [0.150, 0.049, 0.013], atol=1e-3)


def test_claims_on_the_statistic_follow_their_numbers() -> None:
    report = envelope_study(12, 0)
    verdicts = verdicts_of("rss-envelope", report.results)
    assert len(report.rows) == 21
    assert list(report.figures) == ["fig2", "detection", "range"]
    assert holds(verdicts, "differ by at most 0.05") == [True]
    assert holds(verdicts, "bias of the range") == [True, True]
    tone = EnvelopeLaw(1e-9, 0.5, 1e-9, report.results.law.correlation, report.results.law.samples)
    worse = report.results._replace(law=tone, detected=(0.5, 0.6, 0.01))
    verdicts = verdicts_of("rss-envelope", worse)
    assert holds(verdicts, "circular Gaussian") == [False]
    assert holds(verdicts, "uncorrelated") == [False]
    assert holds(verdicts, "simulated") == [False]


def test_stated_errors_are_judged_by_their_distance_from_the_truth() -> None:
    error = RNG.standard_normal((200, 2))
    true, small = Errors(error, np.ones((200, 2))), Errors(error, np.full((200, 2), 0.2))
    positions = {("one", 50): true, ("other", 50): small}
    results = env.EnvelopeResults({}, positions, {}, {}, None, (0, 0, 0))  # type: ignore[arg-type]
    decisions = [env.better_stated(*names, 50)(results)
                 for names in (("one", "other"), ("other", "one"))]  # fmt: skip
    assert [one.holds for one in decisions if one is not None] == [True, False]


def test_doppler_study_has_a_lead_where_the_factor_is_ignored() -> None:
    report = moving.doppler(2, 0)
    results = report.results
    assert len(report.rows) == 9
    assert results[30, moving.IGNORED].lead.mean() > 2
    assert abs(results[30, moving.USED].lead.mean()) < 0.5
    same = {key: moving.DopplerErrors(*[np.array([1.0, 1.01, 0.99])] * 3) for key in results}
    verdicts = verdicts_of("rss-doppler", same)
    assert holds(verdicts, "can be ignored") == [True] * 3
    assert holds(verdicts, "own velocity lowers") == [None] * 3


def test_network_claims_follow_the_errors_and_count_messages() -> None:
    same = np.array([1.0, 1.01, 0.99])
    results = {form: net.NetworkErrors(same, same, same, same) for form in net.forms()}
    verdicts = verdicts_of("rss-network", results)
    assert [one.holds for one in verdicts] == [True, None, None, True]
    worse = net.NetworkErrors(2 * same, same, same, same)
    verdicts = verdicts_of("rss-network", {**results, (net.CELLS, 4): worse})
    assert [one.holds for one in verdicts] == [True, None, None, False]
    assert [net.numbers_sent(net.CELLS, n, 1) for n in (1, 2, 4)] == [0, 7, 21]


def test_graph_has_the_names_of_the_models_and_its_latent_nodes_are_entangled() -> None:
    nodes = model_graph()
    assert set(Prior._fields) < set(nodes)
    assert {parent for node in nodes.values() for parent in node.parents} <= set(nodes)
    problem = draws(Table1K3(), 1, 0).problem
    assert not separable(problem, 0.1, 1.0)  # given the readings
    assert separable(problem._replace(W=0 * problem.W), 0.1, 1.0)  # without them
    trial: Any = create("rss_table1_k3").sample(np.random.default_rng(0))
    assert len(draw_graph(trial).axes) == 3
