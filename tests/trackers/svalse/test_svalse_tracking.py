"""Components of SVALSE over time: labels, prediction, births and deaths."""

from typing import Any

import numpy as np
import pytest
from svalse_scenes import COORDINATE, LINE, short, tone

from arrivals.motion_models import BernoulliVonMises, VonMisesWalk
from arrivals.trackers import SVALSE, CoordinateSolver, NewtonSolver

# -- tracked components ------------------------------------------------------------------------


def test_label_follows_its_source_and_new_sources_have_new_labels() -> None:
    first, second = np.full(12, -0.4), np.where(np.arange(12) < 5, np.nan, 0.6)
    run = SVALSE(LINE).run(tone(np.stack([first, second], axis=1), noise=1e-3))
    of_first = run.label[np.abs(run.doa + 0.4) < 0.1]
    of_second = run.label[np.abs(run.doa - 0.6) < 0.1]
    assert len(of_first) == 12
    assert len(of_second) == 7
    assert set(of_first) == {0}
    assert len(set(of_second)) == 1
    assert of_second[0] > 0


def test_source_returning_after_a_long_gap_has_a_new_label() -> None:
    doa = np.where((np.arange(12) >= 4) & (np.arange(12) < 8), np.nan, 0.3)
    run = SVALSE(LINE).run(tone(np.stack([doa, np.full(12, -0.5)], axis=1), noise=1e-3))
    before = run.label[:4][np.abs(run.doa[:4] - 0.3) < 0.1]
    after = run.label[8:][np.abs(run.doa[8:] - 0.3) < 0.1]
    assert set(before).isdisjoint(after)


def test_prediction_equals_that_of_the_motion_model() -> None:
    motion = BernoulliVonMises(kappa=200.0, p_activate=0.2, p_deactivate=0.3)
    tracker = SVALSE(LINE, motion)
    tracker.predict()
    tracker.update(tone([0.3], 1e-3)[0])
    kappa, on = tracker.kappa[0], tracker.tracked
    tracker.predict()
    assert tracker.kappa[0] == pytest.approx(VonMisesWalk(200.0).blur(kappa))
    assert set(tracker.existence[on]) <= {0.7, 0.2}
    assert tracker.existence[0] == 0.7


def test_missing_measurements_widen_the_belief_until_the_source_ends() -> None:
    tracker = SVALSE(LINE)
    tracker.run(tone([[0.3]] * 3, 1e-3))
    std, result = [], []
    for _ in range(4):
        tracker.predict()
        tracker.update(None)
        result.append(tracker.estimate.n_found)
        std += tracker.estimate.std.tolist()
        assert tracker.estimate.label.tolist() == [0] * result[-1]
    assert result == [1, 1, 0, 0]  # existence 0.75, 0.5875, 0.48
    assert np.diff(std).min() > 0


def test_replacing_the_motion_model_between_steps_works() -> None:
    tracker = SVALSE(LINE)
    tracker.run(tone([[0.3]] * 2, 1e-3))
    tracker.motion = BernoulliVonMises(p_deactivate=1.0)
    tracker.predict()
    assert tracker.existence[0] == 0.0


@pytest.mark.parametrize("form", [{}, COORDINATE])
@pytest.mark.parametrize("p", [(0.0, 0.1), (0.25, 0.0), (0.25, 1.0), (1.0, 0.1)])
def test_certain_births_and_deaths_are_allowed(
    p: tuple[float, float], form: dict[str, Any]
) -> None:
    """Fig. 7: ρ of 0 and 1 force a component off and on."""
    motion = BernoulliVonMises(p_deactivate=p[0], p_activate=p[1])
    trial = short(5, 5, "svalse_fig6")
    run = SVALSE(LINE, motion, solver=NewtonSolver(max_iterations=60), **form).run(
        trial.measurements
    )
    if p[1] == 1.0:  # four sources; the Newton solver merges forced components and detects none
        assert run.n_found[1:].min() > (4 if form else 3)
    if p[1] == 0.0:
        assert run.label.max() < run.n_found[0]  # no new label after the first step
    if p[0] == 0.0:
        assert set(run.label[0][run.label[0] >= 0]) <= set(run.label[-1])


def test_certain_birth_is_the_limit_of_probable_birth() -> None:
    """Coordinate ascent, the paper's form; Fig. 7 (d) has a probability of 1."""
    trial = short(5, 5, "svalse_fig6")
    result = [
        SVALSE(
            LINE,
            BernoulliVonMises(p_activate=p),
            solver=CoordinateSolver(max_iterations=100),
        )
        .run(trial.measurements[:3]).doa
        for p in (1.0, 1 - 1e-12)
    ]  # fmt: skip
    assert result[0] == pytest.approx(result[1], abs=1e-3, nan_ok=True)


def test_crossing_sources_are_merged_into_one_while_they_are_too_near() -> None:
    z = tone([[0.0, np.deg2rad(1.0)]], noise=1e-7)
    apart = SVALSE(LINE, solver=NewtonSolver(merge=0.0)).run(z)
    merged = SVALSE(LINE).run(z)
    near = np.abs(np.subtract.outer(merged.doa[0], merged.doa[0]))
    assert apart.n_found[0] >= 2
    assert np.nanmin(near[near > 0], initial=1.0) > np.deg2rad(1.5)


def test_step_with_few_valid_sensors_keeps_the_tracks() -> None:
    z = tone([[-0.5, 0.1, 0.7]] * 6, noise=1e-3)
    for n_valid in (1, 2, 3, 5):
        damaged = z.copy()
        damaged[3, n_valid:] = np.nan
        run = SVALSE(LINE).run(damaged)
        assert set(run.label[5][run.label[5] >= 0]) == {0, 1, 2}
