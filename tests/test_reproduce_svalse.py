"""The studies of SVALSE's paper, cut short: their tables, claims and pictures."""

import csv
from pathlib import Path
from typing import Any

import pytest

from arrivals.scenarios import base, reproduce, reproduce_svalse, reproduce_svalse_snr
from arrivals.scenarios.reproduce import RUNS, STUDIES, Report
from arrivals.scenarios.svalse_figures import ACTIVATION, REBUILT, SWEEP


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenarios of one step."""

    def create(name: str, **params: Any) -> base.Scenario:
        return base.create(name, **{"n_steps": 1} | params)

    for module in (reproduce_svalse, reproduce_svalse_snr):
        monkeypatch.setattr(module, "create", create)
    reproduce_svalse_snr.sweep.cache_clear()


def table(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("number", [4, 7])
def test_scenes_make_table_claims_and_pictures(number: int, tmp_path: Path) -> None:
    name = f"svalse-fig{number}"
    written = reproduce.reproduce(name, tmp_path, runs=2, quick=True)
    assert {path.name for path in written} >= {f"{name}.csv", f"{name}.md", f"{name}-tracks.png"}
    rows = table(tmp_path / f"{name}.csv")
    if number == 4:
        assert [row["method"] for row in rows] == list(reproduce_svalse.FAST)
        known = {row["method"]: row["rebuilt"] for row in rows}
        assert float(known["svalse"]) == REBUILT["svalse_fig4"]["svalse"].gospa
        assert known["peaks_gnn"] == ""
    else:
        assert [float(row["paper's run"]) for row in rows] == [
            known.paper for known in ACTIVATION.values()
        ]
    page = (tmp_path / f"{name}.md").read_text()
    assert "Holds: " in page or "Does not hold: " in page
    assert list((tmp_path / "runs").glob("study-*.csv"))


@pytest.mark.usefixtures("short")
def test_sweeps_are_computed_once_for_three_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduce_svalse, "FAST", ("sbl", "ssbl", "valse", "svalse"))
    reproduce.reproduce("svalse-fig9", tmp_path, runs=2, quick=True)
    rows = table(tmp_path / "svalse-fig9.csv")
    assert len(rows) == 9 * 4
    sbl = [row for row in rows if row["method"] == "sbl"]
    assert [float(row["rebuilt"]) for row in sbl] == [
        four[0][0] for four in SWEEP["svalse_scenario2"].values()
    ]
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()}
    monkeypatch.setattr(reproduce_svalse_snr, "SCENES", {"svalse_scenario2": "six"})
    reproduce_svalse_snr.sweep.cache_clear()
    report = reproduce_svalse_snr.fig10(2, 0, tmp_path / "runs", quick=True)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()} == before
    assert [row[3] for row in report.rows] == [
        pytest.approx(float(row["RMSE"]), abs=1e-7) for row in rows
    ]


def brief(runs: int, seed: int) -> Report:
    return Report(f"Brief, {runs}", ["a"], [(1.0,)], ["Holds: it is brief."])


def test_all_writes_every_study_and_one_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        reproduce, "STUDIES", {"one": f"{__name__}:brief", "two": f"{__name__}:brief"}
    )
    monkeypatch.setattr(reproduce, "RUNS", {"two": (30, 3)})
    monkeypatch.chdir(tmp_path)
    page = Path("page.md")
    written = reproduce.reproduce("all", tmp_path / "out", quick=True, seed=7, page=page)
    assert [path.name for path in written] == ["one.csv", "one.md", "two.csv", "two.md", "page.md"]
    text = page.read_text()
    assert "    arrivals reproduce all --quick --seed 7 --page page.md\n" in text
    assert text.index("## Brief, 10") < text.index("## Brief, 3\n")
    assert text.count("Holds: it is brief.") == 2


def test_every_study_of_other_runs_exists() -> None:
    assert set(RUNS) <= set(STUDIES)
