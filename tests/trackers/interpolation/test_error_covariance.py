"""Stated deviations of pairwise updates: equal to the spread of scores and of errors."""

from typing import Any

import numpy as np
import pytest

from arrivals.motion_models import DelayWalk
from arrivals.scenarios.reproduce.interpolation.trials import draws
from arrivals.scenarios.simulations.sampled_source import InterpolationBand, InterpolationTone
from arrivals.trackers.interpolation import VARIANTS, InterpolationEKF
from arrivals.trackers.interpolation.error_covariance import ScoreTable, score_moments

TONE, BAND = InterpolationTone(doa_deg=35.0), InterpolationBand(doa_deg=35.0)


@pytest.mark.parametrize("scene", [TONE, BAND])
@pytest.mark.parametrize("variant", ["Bw", "C"])
def test_noise_is_the_variance_of_simulated_scores(scene: Any, variant: str) -> None:
    """The sum of the scores of many snapshots, at the true delay, over 200 records."""
    settings = VARIANTS[variant].replace(extrapolate=True)
    assembly = InterpolationEKF(scene.measurement, variant=settings).assembly
    models = list(assembly.final.baseline_models)  # type: ignore[union-attr]  # pairwise
    delay = float(scene.measurement.delay(np.deg2rad(35.0)))
    frames = draws(scene, 200, 0)[..., ::-1]
    score, information = np.zeros(200), np.zeros(200)
    for k in range(5, 95):
        for model in models:
            z, X = model.split(frames, k)
            (c, slope), R = model.linearise(delay)
            H = model.baseline * (X @ slope)
            score += (H * (z - X @ c)).sum(axis=-1) / R
            information += (H * H).sum(axis=-1) / R
    noise, slope, _ = score_moments(models, np.array([delay]))
    assert score.var() / information.mean() == pytest.approx(noise[0], rel=0.3)  # 10 % each sigma
    assert slope[0] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("scene", [TONE, BAND])
def test_std_covers_the_errors_and_P_does_not(scene: Any) -> None:
    """A start at the truth with a narrow prior; 200 records."""
    start = np.deg2rad(35.0)
    tracker = InterpolationEKF(scene.measurement, doa=start, std=np.deg2rad(3.0))
    runs = tracker.run_batch(draws(scene, 200, 1))
    z = np.array([(run.doa[-1, 0] - start) / run.std[-1, 0] for run in runs])
    assert 0.8 < (z * z).mean() < 1.3
    own = tracker.trajectory(draws(scene, 200, 1))[1][:, -1, 0, 0]
    own_std = scene.measurement.doa_std(scene.measurement.delay(start), np.sqrt(own))
    assert np.mean([run.std[-1, 0] for run in runs]) < 0.85 * own_std.mean()


def test_independent_residuals_leave_the_covariance_of_the_filter() -> None:
    one = np.ones((1, 2))
    table = ScoreTable(np.array([-1.0, 1.0]), one, one[:, 0], None)
    prior, P, x = np.array([[0.4, 0.1], [0.1, 0.3]]), np.zeros((2, 2)), np.zeros(2)
    k = prior[:, 0] / (prior[0, 0] + 0.2)  # a measurement of the delay, of variance 0.2
    P = prior - np.outer(k, prior[0])
    np.testing.assert_allclose(table.updated(prior, prior, x, P, 0), P, atol=1e-15)


def test_assigned_covariance_is_stated() -> None:
    tracker = InterpolationEKF(TONE.measurement, DelayWalk(1e-5), doa=0.6)
    for z in draws(TONE, 1, 2)[0][:20]:
        tracker.predict()
        tracker.update(z)
    assert tracker.error.variance < tracker.P[0, 0]
    tracker.P = np.array([[0.01]])
    expected = TONE.measurement.doa_std(tracker.x[0], 0.1)
    assert tracker.estimate.std[0] == pytest.approx(float(expected))
