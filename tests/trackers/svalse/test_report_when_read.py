"""Reports of SVALSE's prediction, which are computed when they are read."""

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import SVALSE, VALSE
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.svalse.prediction import joined, stacked
from arrivals.trackers.svalse.report_when_read import PredictedReport
from arrivals.typing import Complex

MODEL = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-2)


def snapshots(n_steps: int) -> Complex:
    truth = np.array([-0.4, 0.5]) + 0.01 * np.arange(n_steps)[:, None]
    return np.asarray(MODEL.simulate(truth, [1.0, 1.0j], np.random.default_rng(0)))


def predicted() -> SVALSE:
    """A tracker of two sources, after a prediction of which nothing has been read."""
    tracker = SVALSE(MODEL)
    for z in snapshots(4):
        tracker.predict()
        tracker.update(z)
    tracker.predict(dt=2.0)
    return tracker


def reported(tracker: SVALSE) -> dict[str, object]:
    return {"x": tracker.x, "P": tracker.P, "noise": tracker.noise} | vars(tracker.estimate)


@pytest.mark.parametrize(
    "duplicate", [copy.copy, copy.deepcopy, lambda tracker: pickle.loads(pickle.dumps(tracker))]
)
def test_copy_between_prediction_and_reading_reports_the_same(
    duplicate: Callable[[SVALSE], SVALSE],
) -> None:
    tracker = predicted()
    other = duplicate(tracker)
    np.testing.assert_equal(reported(other), reported(tracker))
    expected = reported(tracker)
    other.predict()
    np.testing.assert_equal(reported(tracker), expected)
    tracker.predict()
    np.testing.assert_equal(reported(other), reported(tracker))


def test_predicted_report_has_the_predicted_directions_and_wider_deviations() -> None:
    tracker = predicted()
    run, estimate = SVALSE(MODEL).run(snapshots(4)), tracker.estimate
    np.testing.assert_allclose(estimate.doa, run.doa[3, :2], atol=0.02)
    assert (estimate.std > run.std[3, :2]).all()
    assert np.isnan(estimate.amplitude).all()
    np.testing.assert_array_equal(estimate.label, run.label[3, :2])
    np.testing.assert_array_equal(tracker.x[:2], estimate.doa)
    np.testing.assert_array_equal(np.diagonal(tracker.P)[:2], estimate.std**2)
    assert tracker.estimate is estimate


def test_report_after_a_belief_was_assigned_or_written_into_is_that_of_the_prediction() -> None:
    expected = reported(predicted())
    assigned, written = predicted(), predicted()
    assigned.mu, assigned.kappa = np.zeros(15), np.ones(15)
    written.mu[:], written.kappa[:], written.existence[:] = 0.0, 1.0, 0.0
    np.testing.assert_equal(reported(assigned), expected)
    np.testing.assert_equal(reported(written), expected)


def test_run_computes_the_report_of_a_prediction_only_where_data_are_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, original = [], PredictedReport.estimate

    def counted(report: PredictedReport) -> DirectionEstimate:
        made.append(report)
        return original(report)

    monkeypatch.setattr(PredictedReport, "estimate", counted)
    z = snapshots(6)
    z[3] = np.nan
    run = SVALSE(MODEL).run(z)
    assert len(made) == 1
    assert run.n_found[3] == 2


def test_reading_between_prediction_and_update_does_not_change_the_update() -> None:
    read, unread = predicted(), predicted()
    reported(read)
    z = snapshots(5)[4]
    read.update(z)
    unread.update(z)
    np.testing.assert_equal(reported(unread), reported(read))


@pytest.mark.parametrize("kind", [SVALSE, VALSE])
def test_reset_after_a_prediction_reports_no_direction(kind: type[VALSE]) -> None:
    tracker = kind(MODEL)
    tracker.update(snapshots(1)[0])
    tracker.predict()
    tracker.reset()
    assert tracker.estimate.n_found == 0
    assert np.isnan(tracker.x).all()
    assert not tracker.P.any()


def test_stacked_and_joined_single_arrays_equal_numpys() -> None:
    one = np.arange(3.0)
    alone = stacked([one])
    np.testing.assert_array_equal(alone, np.stack([one]))
    assert not np.shares_memory(alone, one)
    np.testing.assert_array_equal(joined([one]), np.concatenate([one]))
