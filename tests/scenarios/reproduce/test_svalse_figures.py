"""Shortened studies of SVALSE's paper: tables, claims, figures and the results page."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import arrivals
from arrivals import scenarios
from arrivals.scenarios import Scenario, Study
from arrivals.scenarios.reproduce import studies as reproduce
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.studies import RUNS, STUDIES
from arrivals.scenarios.reproduce.svalse import any_array as reproduce_any_array
from arrivals.scenarios.reproduce.svalse import figures_4_to_7 as reproduce_svalse
from arrivals.scenarios.reproduce.svalse import figures_8_to_10 as reproduce_svalse_snr
from arrivals.scenarios.reproduce.svalse import forms
from arrivals.scenarios.reproduce.svalse.decisions import OFF_GRID, results_of
from arrivals.scenarios.reproduce.svalse.forms import FAST
from arrivals.scenarios.reproduce.svalse.published_values import ACTIVATION, PAPER, REBUILT, SWEEP
from arrivals.scenarios.reproduce.swellex96 import figures_11_12 as reproduce_swellex


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the studies' scenarios one step long."""

    def create(name: str, **params: Any) -> Scenario:
        return scenarios.create(name, **{"n_steps": 1} | params)

    for module in (reproduce_svalse, reproduce_svalse_snr):
        monkeypatch.setattr(module, "create", create)
    reproduce_svalse_snr.sweep.cache_clear()


def table(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("number", [4, 7])
def test_study_writes_table_claims_and_figures(number: int, tmp_path: Path) -> None:
    name = f"svalse-fig{number}"
    written = reproduce.reproduce(name, tmp_path, runs=2, quick=True)
    assert {path.name for path in written} >= {f"{name}.csv", f"{name}.md", f"{name}-tracks.png"}
    rows = table(tmp_path / f"{name}.csv")
    if number == 4:
        assert [row["method"] for row in rows] == list(FAST)
        known = {row["method"]: row["rebuilt"] for row in rows}
        assert float(known["svalse"]) == REBUILT["svalse_fig4"]["svalse"].gospa
        assert known["peaks_gnn"] == ""
    else:
        assert [float(row["paper's run"]) for row in rows] == [
            *(known.paper for known in ACTIVATION.values()),
            PAPER["svalse_fig6"]["valse"],
        ]
        (path,) = (tmp_path / "runs").glob("study-*.csv")
        params = [method["params"] for method in Study.read(path).config["methods"]]
        assert [one["motion"]["p_activate"] for one in params[:5]] == [0.1, 0.1, 0.0, 1.0, 0.1]
        assert all(one["solver"]["type"].endswith(":CoordinateSolver") for one in params)
    page = (tmp_path / f"{name}.md").read_text()
    assert "**Claims of the paper**" in page
    assert "**Checks of these programs**" in page
    assert list((tmp_path / "runs").glob("study-*.csv"))


@pytest.mark.usefixtures("short")
def test_sweep_is_computed_once_for_three_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forms, "FAST", ("sbl", "ssbl", "valse", "svalse"))
    reproduce.reproduce("svalse-fig9", tmp_path, runs=2, quick=True)
    rows = table(tmp_path / "svalse-fig9.csv")
    assert [row["SNR, dB"] for row in rows] == [f"{snr}" for snr in range(0, 45, 5)]
    assert [float(row["sbl rebuilt"]) for row in rows] == [
        four[0][0] for four in SWEEP["svalse_scenario2"].values()
    ]
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()}
    monkeypatch.setattr(reproduce_svalse_snr, "SCENES", {"svalse_scenario2": "six"})
    reproduce_svalse_snr.sweep.cache_clear()
    report = reproduce_svalse_snr.fig10(2, 0, tmp_path / "runs", quick=True)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()} == before
    ssbl = list(report.columns).index("ssbl")
    assert [row[ssbl] for row in report.rows] == [
        pytest.approx(float(row["ssbl rmse"]), abs=1e-7) for row in rows
    ]


@pytest.mark.usefixtures("short")
def test_certain_births_as_printed_are_one_run_of_the_full_study(tmp_path: Path) -> None:
    report = reproduce_svalse.fig7(2, 0, tmp_path)
    last = [row[0] for row in report.rows[-2:]]
    assert last == [forms.PRINTED_7D, forms.UNMERGED_7D]
    assert all(len(row) == len(report.columns) for row in report.rows)
    assert len(report.results["gospa", forms.PRINTED_7D, ""]) == 1


@pytest.mark.usefixtures("short")
def test_paper_forms_have_fewer_runs_at_high_snr_of_the_same_draws(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reproduce_svalse_snr, "SNR_DB", (0.0, 40.0))
    monkeypatch.setattr(reproduce_svalse_snr, "SLOW_RUNS", 1)
    study = reproduce_svalse_snr.sweep("svalse_scenario1", 2, 0, None, False)
    runs = {case: list(study.values("gospa", "svalse paper's form", case)) for case in study.cases}
    assert runs == {"0": [0, 1], "40": [0]}
    assert list(study.values("gospa", "svalse", "40")) == [0, 1]
    values = results_of(study)["gospa", "valse paper's form", "40"]
    np.testing.assert_array_equal(np.isnan(values), [False, True])
    assert "paper's form from 15 dB on: 1" in reproduce_svalse_snr.numbers(2, quick=False)


@pytest.mark.usefixtures("short")
def test_sources_off_the_grid_are_cases_at_high_snr(tmp_path: Path) -> None:
    study = reproduce_svalse_snr.off_grid("svalse_scenario1", 1, 0, tmp_path)
    assert tuple(study.cases) == OFF_GRID
    assert study.methods == ["ssbl", "svalse", "svalse paper's form"]
    truth = scenarios.create("svalse_scenario1", n_steps=1, offset_deg=0.25).sample(
        np.random.default_rng(0)
    )
    np.testing.assert_allclose(np.rad2deg(truth.truth), [[-2.75, 2.25, 60.25]])


@pytest.mark.usefixtures("short")
def test_panels_are_lettered_as_in_the_paper(tmp_path: Path) -> None:
    report = reproduce_svalse.fig4(1, 0, tmp_path, quick=False)
    figure = report.figures["tracks"]
    titles = [ax.get_title() for ax in figure.axes[:6]]
    assert [title[:3] for title in titles[:5]] == ["(a)", "(b)", "(c)", "(d)", "(e)"]
    assert titles[1].endswith("valse as printed")
    legend = figure.axes[3].get_legend()
    assert legend is not None
    curves = legend.get_texts()
    assert sum("(paper 4.87°)" in curve.get_text() for curve in curves) == 1
    assert figure.legends[0].get_texts()[0].get_text() == "truth"
    bars = [ax for ax in figure.axes if ax.get_ylabel() == "beam power, dB re maximum"]
    assert len(bars) == 1
    columns = list(report.columns)
    rows = {row[0]: row for row in report.rows}
    assert all(len(row) == len(columns) for row in report.rows)
    for column in ("label switches", "track length", "NEES", "in 68 %", "in 95 %"):
        assert np.isnan(rows["cbf"][columns.index(column)])
    assert rows["svalse"][columns.index("NEES")] > 0
    assert {"valse as printed, run 0", "svalse as printed, run 0"} < set(rows)


def test_every_table_of_directions_includes_the_baselines() -> None:
    for methods in (FAST, reproduce_swellex.METHODS):
        assert set(methods) >= {"cbf", "peaks_gnn", "sbl", "ssbl", "valse", "svalse"}
    labels = {case.label for case in reproduce_any_array.CASES if not case.params.get("memory")}
    assert {c.label for c in reproduce_any_array.CASES if c.method == "peaks_gnn"} == labels


def test_claims_on_any_array_use_paired_differences() -> None:
    results = {
        (case.label, case.method): np.array([0.0, 0.1, 0.2])
        + (1.0 if case.method == "svalse" and not case.params else 2.0)
        for case in reproduce_any_array.CASES
    }
    verdicts = [claim.decide(results) for claim in reproduce_any_array.CLAIMS]
    assert len(verdicts) == len(reproduce_any_array.ORDER)
    assert verdicts[0].holds
    assert verdicts[-1].holds is False
    assert "-1.00 ± 0.00" in verdicts[0].line()


def brief(runs: int, seed: int) -> Report:
    calls.append(runs)
    return Report(f"Brief, {runs}", ["a"], [(1.0,)], ["A remark."])


calls: list[int] = []


def test_reproduce_all_writes_every_study_and_one_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        reproduce, "STUDIES", {"one": f"{__name__}:brief", "two": f"{__name__}:brief"}
    )
    monkeypatch.setattr(reproduce, "RUNS", {"two": (30, 3)})
    monkeypatch.chdir(tmp_path)
    page = Path("page.md")
    written = reproduce.reproduce("all", tmp_path / "out", quick=True, seed=7, page=page)
    names = ["one.csv", "one.md", "two.csv", "two.md", "one.csv", "two.csv", "page.md"]
    assert [path.name for path in written] == names  # tables twice: beside the page too
    text = page.read_text()
    assert "    arrivals reproduce all --quick --seed 7 --out out --page page.md\n" in text
    assert text.index("### Brief, 10\n") < text.index("### Brief, 3\n")
    assert text.count("A remark.") == 2
    assert "`arrivals reproduce two`, seed 7, 3 runs, arrivals " in text
    assert str(tmp_path) not in text


def test_reproduce_all_skips_finished_studies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        reproduce, "STUDIES", {"one": f"{__name__}:brief", "two": f"{__name__}:brief"}
    )
    calls.clear()
    first = reproduce.reproduce("all", tmp_path, runs=2)
    page = first[-1].read_text()
    assert reproduce.reproduce("all", tmp_path, runs=2) == first
    assert calls == [2, 2]
    assert first[-1].read_text() == page
    (tmp_path / "two.csv").unlink()
    reproduce.reproduce("all", tmp_path, runs=2)
    reproduce.reproduce("one", tmp_path, runs=2)  # a single study is always run
    assert calls == [2, 2, 2, 2]
    reproduce.reproduce("all", tmp_path, runs=2, seed=1)
    monkeypatch.setattr(arrivals, "__version__", "9.9.9")  # with the same code
    reproduce.reproduce("all", tmp_path, runs=2, seed=1)
    assert len(calls) == 6
    monkeypatch.setattr(reproduce, "code_mark", lambda: "other")
    reproduce.reproduce("all", tmp_path, runs=2, seed=1)
    assert len(calls) == 8


def test_studies_with_special_numbers_of_runs_exist() -> None:
    assert set(RUNS) <= set(STUDIES)


def test_page_that_is_a_folder_is_rejected_before_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduce, "STUDIES", {"one": f"{__name__}:brief"})
    before = len(calls)
    with pytest.raises(IsADirectoryError, match="page must be a file"):
        reproduce.reproduce("one", tmp_path / "out", quick=True, page=tmp_path)
    assert len(calls) == before
