"""Reliability of stated existence, scenes for coverage, their study and plots."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.plots.calibration import plot_coverage, plot_reliability
from arrivals.scenarios import create, monte_carlo, reliability
from arrivals.scenarios.metrics import METRICS
from arrivals.scenarios.reproduce.studies import reproduce
from arrivals.scenarios.reproduce.svalse import calibration
from arrivals.scenarios.reproduce.svalse.calibration_scenes import SCENES, Coverage

statements = st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=60)


@given(statements, st.integers(1, 12))
def test_scores_equal_their_definitions(pairs: list[tuple[float, bool]], bins: int) -> None:
    p, y = (np.array(each, dtype=float) for each in zip(*pairs, strict=True))
    result = reliability(p, y.astype(bool), bins=bins)
    assert result.brier == pytest.approx(np.mean((p - y) ** 2), abs=1e-12)
    assert result.table.count.sum() == len(p)
    total = result.table.count @ result.table.stated
    assert total == pytest.approx(p.sum())
    assert result.table.count @ result.table.observed == pytest.approx(y.sum())
    distance = np.abs(result.table.observed - result.table.stated)
    assert result.ece == pytest.approx(result.table.count @ distance / len(p))
    assert result.ece >= abs(p.mean() - y.mean()) - 1e-12


def test_true_probabilities_are_reliable() -> None:
    rng = np.random.default_rng(0)
    p = rng.random(20_000)
    result = reliability(p, rng.random(20_000) < p)
    assert result.ece < 0.02
    assert result.brier == pytest.approx(1 / 6, abs=0.01)  # the mean of p (1 - p)
    assert result.log_score == pytest.approx(0.5, abs=0.01)


def test_no_statement_has_no_score() -> None:
    result = reliability([], np.zeros(0, dtype=bool))
    assert np.isnan([result.ece, result.brier, result.log_score]).all()
    assert result.table.count.size == 0


@pytest.mark.parametrize(
    ("existence", "hit", "message"),
    [
        ([0.5, 1.5], [True, True], r"existence must lie in \[0, 1\]; got \[1.5\]"),
        ([0.5, np.nan], [True, True], r"existence must lie in \[0, 1\]; got \[nan\]"),
        ([0.5], [True, True], r"existence and hit must have one shape"),
        ([0.5], [0.3], "hit must hold True or False"),
    ],
)
def test_bad_statements_are_refused(existence: list[float], hit: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        reliability(existence, hit)


def test_metrics_of_a_study() -> None:
    names = ["ece", "brier", "log_score", "coverage50", "coverage68", "coverage90", "coverage95"]
    study = monte_carlo(create("walk", n_steps=20), ["svalse"], runs=2, metrics=names)
    values = [study.mean(name, "svalse") for name in names]
    assert values[0] < 0.1
    assert (np.diff(values[3:]) >= 0).all()


def test_existence_that_is_not_stated_is_refused() -> None:
    trial = create("walk", n_steps=20).sample(np.random.default_rng(0))
    run = trial.tracker("music").run(trial.measurements)
    with pytest.raises(ValueError, match="does not estimate probabilities of existence"):
        METRICS["ece"](trial, run)


def test_walks_take_steps_of_their_deviation_within_bounds() -> None:
    trial = create("walk", n_sources=10, n_steps=400).sample(np.random.default_rng(0))
    doa = np.rad2deg(trial.truth)
    assert np.abs(doa).max() <= 75
    assert np.diff(np.sort(doa[0])).min() >= 12
    assert np.diff(doa, axis=0).std() == pytest.approx(1.5, rel=0.05)


def test_switching_sources_follow_the_chain() -> None:
    trial = create("switch", n_steps=3000).sample(np.random.default_rng(0))
    active = ~np.isnan(trial.truth)
    started = active[1:][~active[:-1]].mean()
    stopped = 1 - active[1:][active[:-1]].mean()
    assert [started, stopped] == pytest.approx([0.1, 0.25], abs=0.01)
    assert active[0].all()


def test_too_many_walks_are_refused() -> None:
    with pytest.raises(ValueError, match="n_sources must be at most 10; got 11"):
        create("walk", n_sources=11)


def test_study_writes_table_claims_and_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(calibration, "SCENES", [SCENES[0], SCENES[-1]])
    written = reproduce("calibration", tmp_path, runs=2)
    names = {path.name for path in written}
    assert {"calibration.csv", "calibration-coverage.png", "calibration-reliability.png"} <= names
    page = (tmp_path / "calibration.md").read_text()
    assert page.count("0 dB | ") == 2
    assert "existence at 10 dB and more" in page


def test_plots_show_shares_and_intervals() -> None:
    table = reliability([0.9] * 8 + [0.2] * 2, [True] * 7 + [False] * 3).table
    ax = plot_reliability(table, label="some")
    assert len(ax.containers) == 1
    plot_reliability(table, label="others", ax=ax)
    assert len(ax.containers) == 2
    with pytest.raises(ValueError, match="covered must have one share for each of 2 levels"):
        plot_coverage({"walk": [0.5]}, [0.5, 0.9])


@pytest.mark.parametrize("doas", [(), 5.0, [[1.0, 2.0]], (91.0,), (np.nan,)])
def test_static_directions_beyond_endfire_are_refused(doas: Any) -> None:
    with pytest.raises(ValueError, match=r"doas must be directions in \[-90, 90\] degrees; got"):
        create("static", doas=doas)


def stated(share: float, runs: int) -> calibration.Statements:
    """Return statements of which a share of every run is within 68 and 95 % intervals."""
    error = np.tile(np.where(np.arange(100) < 100 * share, 0.1, 9.0), runs)
    of = np.repeat(np.arange(runs), 100)
    hit = np.ones(len(of), dtype=bool)
    return calibration.Statements(
        error, np.ones(len(of)), 0.99 * hit, hit, np.linspace(1.0, 1.2, runs), of, of
    )


@pytest.mark.parametrize(("share", "holds"), [(0.90, True), (0.5, False), (0.80, None)])
def test_coverage_is_not_decided_at_its_limit(share: float, holds: bool | None) -> None:
    limits = Coverage((0.80, 0.95), (0.80, 0.95))
    pooled = {SCENES[0]: calibration.Paired(*[stated(share, 8)] * 2)}
    decision = calibration.covers(SCENES[0], limits, 0, pooled)
    if holds is None:  # every run at the limit, give or take one error
        some = stated(share, 8)
        some.error[[0, 180]] = 9.0, 0.1
        pooled = {SCENES[0]: calibration.Paired(some, some)}
        decision = calibration.covers(SCENES[0], limits, 0, pooled)
    assert decision is not None
    assert decision.holds is holds
    assert decision.numbers.startswith("of 68 %")


def test_limits_of_ours_are_checks_in_plain_words() -> None:
    assert {claim.source for claim in calibration.CLAIMS} == {"check"}
    words = " ".join(claim.text for claim in calibration.CLAIMS)
    assert not [
        word for word in ("brier", "log_score", "n_sources", "doas", "ECE") if word in words
    ]
    pooled = {SCENES[0]: calibration.Paired(*[stated(0.7, 8)] * 2)}
    assert calibration.existence_score("brier", 0.007, pooled).holds
    change = calibration.changes(SCENES[0], 0.1, pooled)
    assert change is not None
    assert change.holds
    assert "degrees" in change.numbers
    few = {SCENES[0]: calibration.Paired(*[stated(0.7, 2)] * 2)}  # as in a quick study
    assert calibration.existence_score("brier", 0.0, few).holds is None
    change = calibration.changes(SCENES[0], -1.0, few)
    assert change is not None
    assert change.holds is None


def test_coverage_has_bars_and_a_legend_with_its_unit() -> None:
    ax = plot_coverage({"walk": [0.67, 0.95]}, [0.68, 0.95], errors={"walk": [0.02, 0.01]})
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["68 %", "95 %"]
    assert "two standard errors" in legend.get_title().get_text()
