"""Means, intervals, paired differences, tables and figures of a study."""

from pathlib import Path

import numpy as np
import pytest
from small_studies import SHORT, small

from arrivals.plots.study import plot_metric
from arrivals.scenarios import Study, monte_carlo
from arrivals.scenarios.experiments.batch import Row
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.experiments.results_file import Results
from arrivals.scenarios.simulations import PairsInTurn


def study_of(values: dict[str, list[float]]) -> Study:
    """Return a study with given values."""
    config = {"scenarios": {"only": {}}, "methods": [{"label": label} for label in values],
              "metrics": {"gospa": ""}}  # fmt: skip
    results = Results(config, None)
    results.add(
        Row("only", run, label, "gospa", value)
        for label, column in values.items()
        for run, value in enumerate(column)
    )
    return Study(results)


def test_means_and_paired_differences_match_hand_calculation() -> None:
    study = study_of({"a": [1.0, 2.0, 3.0, np.nan], "b": [2.0, 4.0, 1.0, 9.0]})
    assert study.mean("gospa", "a") == 2.0
    assert study.spread("gospa", "a") == 1.0
    difference = study.paired("gospa", "a", "b")
    assert difference.mean == pytest.approx(-1 / 3)
    assert (difference.n_below, difference.n_runs) == (2, 3)
    assert difference.error == pytest.approx(np.std([-1, -2, 2], ddof=1) / 3**0.5)
    assert [line["n_runs"] for line in study.summary()] == [3, 4]


def test_bootstrap_interval_covers_the_mean_of_normal_draws() -> None:
    draws = np.random.default_rng(0).normal(3.0, 1.0, (60, 30))
    ends = np.array([study_of({"a": row.tolist()}).interval("gospa", "a") for row in draws])
    assert 0.85 <= ((ends[:, 0] < 3.0) & (ends[:, 1] > 3.0)).mean() <= 1.0
    assert np.diff(ends).mean() == pytest.approx(2 * 1.96 / 30**0.5, rel=0.12)
    assert study_of({"a": [2.0, 2.0]}).interval("gospa", "a") == (2.0, 2.0)
    assert np.isnan(study_of({"a": [2.0]}).interval("gospa", "a")).all()


def test_csv_rows_are_tidy_and_sorted(tmp_path: Path) -> None:
    study = compute_study(SHORT, ["mvdr", "cbf"], 3, 0, StudySettings(["gospa"], batch=1))
    study.to_csv(tmp_path / "rows.csv")
    lines = (tmp_path / "rows.csv").read_text().splitlines()
    assert lines[0] == "case,run,method,metric,value,note"
    assert len(lines) == 1 + 2 * 3 * 2 * 2
    assert [line.split(",")[:3] for line in lines[1:4:2]] == [
        ["fig6", "0", m] for m in ("mvdr", "cbf")
    ]


def test_unknown_metric_method_and_case_are_rejected() -> None:
    study = monte_carlo(SHORT["fig6"], ["cbf"], 1, metrics=["gospa", "nees"])
    with pytest.raises(ValueError, match="nees is not defined: cbf: "):
        study.mean("nees", "cbf")
    with pytest.raises(
        ValueError, match=r"no run of 'cbf' has the metric 'rmse': known: cpu_ms, gospa, nees"
    ):
        study.mean("rmse", "cbf")
    with pytest.raises(ValueError, match="method must be one of 'cbf'; got 'mvdr'"):
        study.mean("gospa", "mvdr")
    with pytest.raises(ValueError, match="case must be one of"):
        small(1).mean("gospa", "cbf")


def test_plot_metric_shows_means_and_bounds() -> None:
    cases = {f"{snr:g}": PairsInTurn(n_steps=2, snr_db=snr) for snr in (0.0, 20.0)}
    study = monte_carlo(cases, ["cbf", "peaks_gnn"], 3, metrics=["gospa", "nees"])
    ax = plot_metric(study, "gospa", x="snr_db", bound={"0": 3.0, "20": 1.0})
    drawn = {line.get_label(): line for line in ax.get_lines()}
    assert np.asarray(drawn["bound"].get_xydata()).tolist() == [[0, 3], [20, 1]]
    means = [study.mean("gospa", "peaks_gnn", case) for case in cases]
    curves = [np.asarray(line.get_ydata()).tolist() for line in ax.get_lines()]
    assert means in curves
    assert plot_metric(study, "gospa").get_xticklabels()[1].get_text() == "20"
    with pytest.raises(ValueError, match=r"no 'snr': did you mean snr_db\?"):
        plot_metric(study, "gospa", x="snr")
    with pytest.raises(ValueError, match="nees is not defined"):
        plot_metric(study, "nees", methods=["cbf"])
