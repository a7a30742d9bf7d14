"""Study of the report on joint tracking: decisions from fabricated results, scores, pictures."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from arrivals.scenarios.reproduce import studies
from arrivals.scenarios.reproduce.ar_kalman import decisions as ar
from arrivals.scenarios.reproduce.ar_kalman import figures_1_to_9
from arrivals.scenarios.reproduce.ar_kalman.experiments import (
    INNER,
    LITERAL,
    OURS,
    REPORT,
    cases,
    start_of,
)
from arrivals.scenarios.reproduce.ar_kalman.own_claims import ACCEPTED, within_limits
from arrivals.scenarios.reproduce.ar_kalman.paper_claims import CLAIMS as AUTOREGRESSIVE
from arrivals.scenarios.reproduce.ar_kalman.plots import draw_array, draw_pacf
from arrivals.scenarios.reproduce.ar_kalman.scores import (
    Results,
    hold_last,
    pacf_of_voices,
    scores,
    unlabelled_rmse,
)
from arrivals.scenarios.reproduce.decisions import Both, Decide
from arrivals.scenarios.reproduce.paper_claims import CLAIMS
from arrivals.scenarios.reproduce.pictures import save_picture
from arrivals.scenarios.reproduce.studies import reproduce
from arrivals.typing import Float

JITTER = np.array([0.0, 0.1, -0.1, 0.05, -0.05, 0.0])


def holds(decide: Decide | None, results: Results) -> bool | None:
    assert decide is not None
    decision = decide(results)
    assert decision is not None
    return decision.holds


def both(decides: Both, results: Results) -> tuple[bool | None, bool | None]:
    return holds(decides[0], results), holds(decides[1], results)


def fabricated(
    metric: str, part: str, ours: float, report: float
) -> dict[tuple[str, str, str], Float]:
    return {(metric, OURS, part): ours + JITTER, (metric, REPORT, part): report + JITTER}


def test_claims_are_decided_by_the_reports_form_and_by_ours() -> None:
    one, two = fabricated("rmse", "a", 1.0, 3.0), fabricated("rmse", "b", 2.0, 2.5)
    assert both(ar.under("rmse", 2.5, "a"), one) == (False, True)
    assert both(ar.under("rmse", 3.0, "a"), one) == (None, True)
    assert both(ar.under("rmse", 1.5, "a", "b"), one | two) == (False, False)  # the worst counts
    assert both(ar.lower("rmse", "a", "b"), one | two) == (False, True)
    assert both(ar.fails(2.5, "a"), one) == (True, False)
    assert both(ar.same("rmse", "a", "b"), one | two) == (True, False)
    assert both(ar.doubles("rmse", "b", "a"), one | two) == (False, None)
    past = {("rmse", "past", "a"): 2.0 + JITTER[:4]}
    assert both(ar.better_than("past", "a"), one | past) == (False, True)
    near = fabricated("rmse", "c", 1.25, 1.0)
    assert both(ar.same("rmse", "c", "a"), one | near) == (False, None)


def test_numbers_name_their_parts() -> None:
    results = fabricated("rmse", "a", 1.0, 3.0) | fabricated("rmse", "b", 2.0, 2.5)
    results |= fabricated("ar error", "a", 1.0, 1.0) | fabricated("ar error", "b", 4.0, 4.0)
    numbers = {
        decide(results).numbers  # type: ignore[union-attr]  # all parts are there
        for decide in (
            ar.under("rmse", 2.5, "a", "b")[1],
            ar.lower("rmse", "a", "b")[1],
            ar.grows_more("b", "a")[1],
        )
    }
    assert numbers == {
        "a: 1 ± 0.03; b: 2 ± 0.03 degrees",
        "a: 1; b: 2 degrees, paired difference -1.00 ± 0.00",
        "the error grows by 1.00 octaves of the directions, 2.00 of the AR models, "
        "difference -1.00 ± 0.01",
    }


def test_few_runs_do_not_decide_shares_and_limits() -> None:
    failed = {("rmse", OURS, "a"): np.array([9.0, 9.0, 9.0, 1.0])}
    assert holds(ar.fails(2.5, "a")[1], failed) is None
    medians = {("rmse", OURS, name): 0.5 * limit * np.ones(8) for name, limit in ACCEPTED.items()}
    assert holds(within_limits, medians)
    assert holds(within_limits, {key: runs[:4] for key, runs in medians.items()}) is None
    medians["rmse", OURS, "M = 2"] *= np.repeat([1.0, 9.0], 4)
    assert holds(within_limits, medians) is None
    medians["rmse", OURS, "M = 2"] = np.full(8, 9.0)
    assert holds(within_limits, medians) is False


def test_bias_spread_and_growth() -> None:
    bias, spread = fabricated("bias", "a", 0.1, -3.0), fabricated("spread", "a", 1.0, 1.0)
    assert both(ar.mainly_bias("a"), bias | spread) == (True, False)
    models = {("ar error", form, part): 1.0 + JITTER for form in (OURS, REPORT) for part in "ab"}
    errors = fabricated("rmse", "a", 1.0, 8.0) | fabricated("rmse", "b", 1.0, 1.0)
    assert both(ar.grows_more("a", "b"), models | errors) == (True, None)
    whole = fabricated("spread", "M = 2", 1.0, 2.0)
    inner = {("spread", INNER[OURS], "M = 2"): 3 + JITTER,
             ("spread", INNER[REPORT], "M = 2"): 1 + JITTER}  # fmt: skip
    assert both(ar.averaging(), whole | inner) == (False, True)


def test_literal_form_time_and_order() -> None:
    results = {("rmse", LITERAL, "a"): 6.0 + JITTER, ("rmse", LITERAL, "b"): 4.0 + JITTER}
    assert holds(ar.literal_fails(5.0, "a"), results)
    assert holds(ar.literal_fails(5.0, "a", "b"), results) is False
    timed = {("cpu ms", OURS, "a"): np.array([1.0, 1.1]),
             ("cpu ms", REPORT, "a"): np.array([9.0, 9.1]),
             ("duration ms", "", "a"): np.array([3.75])}  # fmt: skip
    assert both(ar.in_real_time("a"), timed) == (False, True)
    timed["cpu ms", OURS, "a"] = np.array([3.0, 3.0])
    assert holds(ar.in_real_time("a")[1], timed) is None
    decision = ar.order_of_voices(pacf_of_voices())
    assert decision is not None
    assert decision.holds is False
    assert "orders 20 and 20" in decision.numbers


def test_claims_are_left_out_without_their_parts() -> None:
    for claim in (*AUTOREGRESSIVE, *(one for one in CLAIMS if one.study == "ar-kf")):
        assert claim.decide({}).holds is None
    unknown = {("rmse", OURS, "a"): np.array([np.nan, 1.0])}
    assert ar.under("rmse", 1.0, "a")[1](unknown) is None


def test_scores_split_errors_into_bias_and_spread() -> None:
    case = next(part for part in cases() if part.name == "10 dB")
    trial = case.scene.sample(np.random.default_rng(0))
    n = len(trial.truth)
    wave = np.sqrt(2) * np.tile([1.0, -1.0], n // 60 + 1).repeat(30)[:n, None]
    motion: Any = trial.motion
    run: Any = SimpleNamespace(
        doa=trial.truth + np.deg2rad(np.array([0.0, 2.0]) + wave),
        signals=2 * np.asarray(trial.signals),
        coefficients=np.tile(motion.coefficient_matrix + 0.1, (n, 1, 1)),
    )
    found = scores([trial], [run], case)
    assert found["bias"][0] == pytest.approx(2.0, abs=0.1)
    assert found["spread"][0] == pytest.approx(np.sqrt(2), abs=0.1)
    assert found["rmse"][0] == pytest.approx(2.0, abs=0.1)
    assert found["ar error"][0] == pytest.approx(0.1)


def test_parts_are_unique_and_cover_all_figures_and_forms() -> None:
    parts = cases()
    assert len({part.name for part in parts}) == len(parts)
    assert {part.figure for part in parts} == {0, 1, 3, 4, 5, 6, 7, 8, 9}  # Fig. 2 is of part 1
    wide = next(part for part in parts if part.name == "M = 4")
    assert LITERAL not in wide.forms()  # pairs beyond half a wavelength
    assert [part.n_compared(4) for part in parts[:3]] == [4, 1, 4]
    assert np.isnan(unlabelled_rmse(None, "past", parts[1]))  # type: ignore[arg-type]  # no trial
    np.testing.assert_allclose(start_of([0.2, -0.1], 1.0), [0.2 + np.pi / 180, -0.1 - np.pi / 180])


def test_hold_last_fills_missing_directions() -> None:
    filled = hold_last(np.array([[np.nan, 0.2], [0.3, np.nan], [np.nan, np.nan]]))
    np.testing.assert_array_equal(filled, [[0.0, 0.2], [0.3, 0.2], [0.3, 0.2]])


def test_sketches_are_of_the_models() -> None:
    parts = cases()
    figure = draw_array(parts[0].scene, next(p for p in parts if p.name == "M = 4").scene)
    titles = [ax.get_title() for ax in figure.axes]
    assert titles == ["M = 1: 1 pair and the centre, 3 sensors",
                      "M = 4: 4 pairs and the centre, 9 sensors"]  # fmt: skip
    pacf = draw_pacf(pacf_of_voices())
    labels = [text.get_text() for text in pacf.axes[0].get_legend().get_texts()]  # type: ignore[union-attr]
    assert labels[:2] == ["voice 1: order 20", "voice 2: order 20"]


def test_study_writes_table_claims_and_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = [case._replace(scene=case.scene.replace(n_intervals=110))
             for case in cases() if case.name in ("30 dB", "N = 3, d = .5, .5")]  # fmt: skip
    monkeypatch.setattr(figures_1_to_9, "cases", lambda: short)
    origins: dict[str, str] = {}

    def save(figure: Figure, path: Path, origin: str) -> None:
        origins[path.stem] = origin
        save_picture(figure, path, origin)

    monkeypatch.setattr(studies, "save_picture", save)
    written = reproduce("ar-kf", tmp_path, runs=2)
    names = ["array", "fig1", "fig2", "fig3", "pacf"]
    assert [path.name for path in written[2:]] == [f"ar-kf-{name}.png" for name in names]
    page = (tmp_path / "ar-kf.md").read_text()
    assert page.count("\n| ") == 2 + len(short)
    assert page.count("* Fig. 1: the AR coefficients converge") == 1
    assert origins["ar-kf-array"].startswith("sketch of the sensors, no data")
    assert "lines: run 0; bands: 10 to 90 % of 2 runs" in origins["ar-kf-fig3"]
    left_out = next(line for line in page.splitlines() if "Fig. 7" in line)
    assert "**Not decided**" in left_out  # of figures that were not run
