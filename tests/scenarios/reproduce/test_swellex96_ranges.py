"""Ranges of the tow, and directions far from every path: facts, scores and decisions."""

from __future__ import annotations

import numpy as np
import pytest

from arrivals.scenarios.reproduce.paper_claims import verdicts_of
from arrivals.scenarios.reproduce.swellex96 import decisions as sea
from arrivals.scenarios.reproduce.swellex96 import ranges as study
from arrivals.scenarios.reproduce.swellex96.decisions import SeaResults, mudstone_reflects
from arrivals.scenarios.reproduce.swellex96.ranges import PathRanges, RangeScores, scores
from arrivals.scenarios.reproduce.swellex96.strays import StrayFacts, beam_peaks, stray_facts
from arrivals.scenarios.simulations.swellex96 import TowPastLine, track

RANGES = tuple(track()["range_m"][279:286].tolist())  # steps 280 to 286, near the closest one


def test_ranges_by_rays_are_the_ships_near_the_closest_approach() -> None:
    found = study.ranges_of_draw("rays", 1, 0, np.arange(280, 292))
    settled = found.step > 284  # waves are plane at first
    assert np.isfinite(found.ratio[settled]).mean() > 0.7
    assert abs(np.nanmedian(found.ratio[settled]) - 1) < 0.15
    with_range = np.isfinite(found.ratio)
    np.testing.assert_array_equal(with_range, np.isfinite(found.error))
    # a longer range has a smaller 1/R
    assert np.all((found.ratio[with_range] > 1) == (found.error[with_range] < 0))


def test_scores_of_ranges_use_the_steps_of_the_block() -> None:
    ratio = np.array([5.0, 0.8, 1.0, 1.2, np.nan])
    draw = PathRanges(np.array([200, 251, 300, 350, 350]), ratio, np.array([9, 1, 0, 1, np.nan]))
    late = scores([draw, draw], (251, 350))
    assert late[:2] == (3.0, 1.0)
    assert late.low == pytest.approx(0.8)
    assert late.high == pytest.approx(1.2)
    assert late.error == pytest.approx(20.0)
    assert late.nees == pytest.approx(2 / 3)
    assert late.share == pytest.approx(75.0)
    assert scores([draw], (1, 100)).share == 0
    assert np.isnan(scores([draw], (1, 100)).ratio)


def test_study_of_ranges_has_a_row_for_each_field_and_block(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(study, "step_numbers", lambda runs: np.arange(281, 285))
    report = study.ranges(1, 0)
    assert [row[:2] for row in report.rows[:3]] == [
        ("rays", "101-200"), ("rays", "201-250"), ("rays", "251-350"),
    ]  # fmt: skip
    assert len(report.rows) == 6
    assert all(len(row) == len(report.columns) for row in report.rows)
    assert [ax.get_title() for ax in report.figures["track"].axes] == [
        "field by rays", "field by modes",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("error", "ratio", "far", "held"),
    [
        (8.0, 1.02, 12.0, [True, True, True]),
        (13.0, 1.02, 12.0, [False, True, True]),
        (8.0, 1.2, 12.0, [True, False, True]),
        (8.0, 0.8, 60.0, [True, False, False]),
    ],
)
def test_claims_on_ranges(error: float, ratio: float, far: float, held: list[bool]) -> None:
    late = RangeScores(100.0, ratio, 0.9, 1.1, error, 1.0, 85.0)
    results = {(model, block): late for model in study.MODELS for block in study.BLOCKS}
    results["modes", study.BLOCKS[0]] = late._replace(share=far)
    assert [verdict.holds for verdict in verdicts_of("swellex96-range", results)] == held


# directions far from every path


def test_beam_peaks_of_two_waves_are_their_directions_unless_one_is_weak() -> None:
    scenario = TowPastLine(ranges=RANGES[:2])
    a, b = scenario.measurement.steering_vector(np.deg2rad([-20.0, 10.0]))
    peaks = beam_peaks(scenario, np.stack([a + 0.8 * b, a + 0.2 * b]))
    np.testing.assert_allclose(peaks[0][~np.isnan(peaks[0])], [-20, 10], atol=0.5)
    np.testing.assert_allclose(peaks[1][~np.isnan(peaks[1])], [-20], atol=0.5)


def test_stray_directions_are_those_far_from_every_path() -> None:
    scenario = TowPastLine(ranges=RANGES)
    paths = np.rad2deg(scenario.truth())
    peaks = beam_peaks(scenario, scenario.field())
    facts = stray_facts(scenario, {"paths": [paths], "peaks": [peaks, peaks]})
    assert facts.estimates["paths"] == (0.0, 0.0)
    found, share = facts.estimates["peaks"]
    assert found == pytest.approx(facts.peaks)
    assert share == 1.0
    assert facts.without_mudstone < facts.peaks


def test_claims_on_stray_directions_and_blocks() -> None:
    d = 0.01 * np.arange(4)[:, None]
    plane, curved = np.full((4, 4), 8.0), np.array([8.0, 7.8, 7.5, 6.0]) + d - d.mean()
    blocks = {"svalse": plane, sea.WITH_RANGE: curved}
    strays = StrayFacts(1.6, 0.9, {sea.WITH_RANGE: (1.8, 0.6)})
    results = SeaResults({}, None, blocks, strays)  # type: ignore[arg-type]  # not of the field
    pair = sea.WITH_RANGE, "svalse"
    for decision in (
        sea.never_above(*pair, results),
        sea.late_below(*pair, results),
        mudstone_reflects(results),
        sea.strays_are_peaks(sea.WITH_RANGE, results),
    ):
        assert decision is not None
        assert decision.holds
    worse = results._replace(
        blocks=blocks | {sea.WITH_RANGE: curved + np.array([0.2, 0, 0, 3])},
        strays=StrayFacts(1.6, 1.5, {sea.WITH_RANGE: (1.8, 0.4)}),
    )
    for decision in (
        sea.never_above(*pair, worse),
        sea.late_below(*pair, worse),
        mudstone_reflects(worse),
        sea.strays_are_peaks(sea.WITH_RANGE, worse),
    ):
        assert decision is not None
        assert decision.holds is False
    empty = SeaResults({}, None)  # type: ignore[arg-type]  # not of the field
    assert mudstone_reflects(empty) is None
    assert sea.never_above(*pair, empty) is None
