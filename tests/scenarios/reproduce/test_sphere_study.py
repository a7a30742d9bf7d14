"""The study of azimuth and elevation: its table and claims, on short scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from arrivals.scenarios.reproduce import sphere as study
from arrivals.scenarios.simulations import SourcesOnSphere


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "PROTOTYPE", {("tetra4", 1, 10): ((2.8, 3.9),)})
    monkeypatch.setattr(study, "SNR_DB", (20.0,))
    monkeypatch.setattr(study, "N_STEPS", 8)


@pytest.mark.usefixtures("short")
def test_sphere_report_has_parts_that_sum_to_gospa_beside_the_prototype() -> None:
    report = study.sphere(2, 0)
    named = [dict(zip(report.columns, row, strict=True)) for row in report.rows]
    assert [row["method"] for row in named] == list(study.METHODS)
    assert [row["prototype"] for row in named] == [2.8, 3.9]
    for row in named:
        assert row["scene"] == "tetra4, 1 x 10, 20 dB"
        assert row["GOSPA"] == pytest.approx(row["distance"] + row["missed"] + row["false"])
        assert 0.5 < row["median bound"] < 5
    assert np.isnan(named[1]["label changes"])
    assert set(report.figures) == {"sky"}


def test_prototype_has_all_arrays_data_and_levels() -> None:
    assert len(study.PROTOTYPE) == 18
    assert {key[1:] for key in study.PROTOTYPE} == set(study.DATA)
    assert {len(figures) for figures in study.PROTOTYPE.values()} == {len(study.SNR_DB)}


def test_median_bound_is_that_of_the_amplitudes_of_the_draw() -> None:
    """Ten times the noise widens the bound of the same draw by √10."""
    quiet, loud = (
        study.score(SourcesOnSphere("tetra4", snr_db, n_steps=4), 0)[0][study.BOUND]
        for snr_db in (30.0, 20.0)
    )
    assert loud / quiet == pytest.approx(np.sqrt(10))


def results(svalse: float, valse: float) -> dict[tuple[str, str], Any]:
    """Scores of three runs in which GOSPA differs by 0.1; half a degree off, of 1 expected."""
    found = {}
    for key in study.PROTOTYPE:
        for method, total in zip(study.METHODS, (svalse, valse), strict=True):
            scores = np.zeros((3, 7))
            scores[:, study.TOTAL] = total + 0.1 * np.arange(3)
            scores[:, study.ERROR], scores[:, study.BOUND] = total / 4, 1.0
            scores[:, study.CHANGES] = total
            found[study.name_of(*key, 20.0), method] = scores
    return found


def test_claims_compare_means_and_hold_within_limits() -> None:
    verdicts = [claim.decide(results(2.0, 4.0)) for claim in study.CLAIMS]
    assert [verdict.holds for verdict in verdicts] == [True] * 8
    assert "paired difference -2.00 ± 0.00" in verdicts[0].line()
    assert "2.10 degrees, 3.6 allowed" in verdicts[3].line()


def test_claims_do_not_hold_beyond_limits() -> None:
    verdicts = [claim.decide(results(5.0, 4.0)) for claim in study.CLAIMS]
    assert [verdict.holds for verdict in verdicts] == [False] * 8
