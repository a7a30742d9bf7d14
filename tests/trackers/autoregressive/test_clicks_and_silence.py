"""AR Kalman filter on real data: clicks, silence between words, dead sensors, gaps."""

from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import DOA, TWO, make_tracker, snapshots, sources, symmetric_array

from arrivals.motion_models import AutoregressiveSources
from arrivals.trackers import ARKalmanQRDRLS
from arrivals.typing import Complex, Float

ARRAY = symmetric_array(0.25, 0.5)
N = 600


def recording(seed: int = 0) -> Complex:
    return snapshots(ARRAY, DOA, sources(TWO, 1, N, seed)[0])


def tracker(**params: Any) -> ARKalmanQRDRLS:
    return make_tracker(ARRAY, TWO, **({"doa": DOA + 0.1} | params))


def error_deg(made: ARKalmanQRDRLS) -> float:
    return float(np.rad2deg(np.abs(made.estimate.doa - DOA)).max())


def lowest_eigenvalue(P: Float) -> float:
    return float(np.linalg.eigvalsh(P)[0] / np.abs(P).max())


@pytest.mark.parametrize("interval", [2, 3, 5, 30])
@pytest.mark.parametrize("exponent", [3, 6, 9])
def test_click_leaves_a_positive_covariance_and_the_directions(
    interval: int, exponent: int
) -> None:
    made, z = tracker(interval=interval), recording()
    z[200] *= 10.0**exponent
    for row in z[:400]:
        made.predict()
        made.update(row)
        assert lowest_eigenvalue(made.P) >= 0
    assert error_deg(made) < 2.0
    assert np.trace(made.P) < 2 * np.trace(TWO.stationary_covariance())


@pytest.mark.parametrize("at", [0, 25, 59])
@pytest.mark.parametrize("sensor", [slice(None), 2])
def test_click_during_acquisition(at: int, sensor: Any) -> None:
    made, z = tracker(doa=None), recording(1)
    z[at, sensor] *= 1e6
    made.run(z)
    assert error_deg(made) < 1.5


def test_click_equals_a_missing_snapshot() -> None:
    z = recording()
    missing = z.copy()
    z[100], missing[100] = 1e5 * z[100], np.nan
    np.testing.assert_array_equal(tracker().run(z).doa, tracker().run(missing).doa)


@pytest.mark.parametrize("level", [1e3, 1e-3])
def test_level_that_stays_is_no_click(level: float) -> None:
    z = recording()
    z[300:] *= level
    made = tracker()
    made.run(z)
    assert made.belief is not None
    assert made.belief.active.any() == (level > 1)
    assert error_deg(made) < 1.5


@pytest.mark.parametrize("level", [0.0, 1e-5])
@pytest.mark.parametrize("real_valued", [False, True])
def test_silence_keeps_directions_and_models(level: float, real_valued: bool) -> None:
    motion = AutoregressiveSources(TWO.coefficients, real_valued=real_valued).scaled(1.0)
    z = snapshots(ARRAY, DOA, sources(motion, 1, N, 3)[0])
    made = make_tracker(ARRAY, motion, doa=DOA + 0.1)
    made.run(z[:300])
    before = made.estimate
    made.run(np.tile(level * z[:60], (40, 1)))
    after = made.estimate
    np.testing.assert_allclose(after.doa, before.doa, atol=np.deg2rad(0.5))
    np.testing.assert_allclose(after.coefficients, before.coefficients, atol=0.1)
    assert (after.innovation_variance > 0.3 * before.innovation_variance).all()
    assert lowest_eigenvalue(made.P) >= 0
    made.run(z[300:])
    assert error_deg(made) < 2.0


def test_digital_silence_widens_the_state_to_the_prior() -> None:
    made = tracker()
    made.run(recording()[:300])
    before = np.trace(made.P)
    made.run(np.zeros((300, 5)))
    assert np.trace(made.P) > 10 * before
    assert lowest_eigenvalue(made.P) >= 0


def test_sensor_of_zeros_is_missing_with_one_warning() -> None:
    z, missing = recording(), recording()
    z[150:, 1], missing[150:, 1] = 0, np.nan
    with pytest.warns(UserWarning, match="channel 1 has zeros") as caught:
        found = tracker().run(z)
    assert len(caught) == 1
    np.testing.assert_array_equal(found.doa, tracker().run(missing).doa)


def test_steps_equal_run_and_batch_with_clicks_and_silence() -> None:
    z = recording()
    z[100], z[200:260], z[301, 2], z[302] = 1e7, 0.0, np.inf, np.nan
    made = tracker()
    for row in z:
        made.predict()
        made.update(row)
    run, batch = tracker().run(z), tracker().run_batch([z, z[::-1]])[0]
    np.testing.assert_allclose(run.doa[-1], made.estimate.doa, atol=1e-12)
    np.testing.assert_allclose(batch.doa, run.doa, atol=1e-9)
