"""The filterpy contract, D1 to D13, for the interpolation-delay filter."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from filterpy.common import Saver
from filterpy.kalman import IMMEstimator, MMAEFilterBank

from arrivals.measurement_models import ArraySamples, SensorArray, Tones
from arrivals.motion_models import DelayDrift, DelayWalk
from arrivals.scenarios.simulations.sampled_source import InterpolationBand, InterpolationTone
from arrivals.trackers import IMM
from arrivals.trackers.interpolation import VARIANTS, InterpolationEKF
from arrivals.typing import Float

TONE = InterpolationTone(n_steps=40)
BAND = InterpolationBand(n_steps=40, n_sensors=5)
NAMES = (
    *("x_prior", "P_prior", "x_post", "P_post", "z", "y", "S", "SI", "K"),
    *("F", "Q", "H", "R", "B", "dim_x", "dim_z", "dim_u"),
    *("likelihood", "log_likelihood", "mahalanobis"),
)
MARKOV = np.array([[0.95, 0.05], [0.05, 0.95]])


def made(
    variant: str = "C", motion: Any = None, acquisition: int = 25, **settings: Any
) -> InterpolationEKF:
    """Make a tracker; `settings` replace those of the variant."""
    return InterpolationEKF(
        TONE.measurement,
        DelayWalk(1e-4) if motion is None else motion,
        variant=VARIANTS[variant].replace(**settings),
        doa=0.9,
        acquisition=acquisition,
    )


def samples(seed: int = 0) -> Float:
    return np.asarray(TONE.sample(np.random.default_rng(seed)).measurements)


def shapes(tracker: InterpolationEKF) -> dict[str, tuple[int, ...]]:
    return {name: np.shape(getattr(tracker, name)) for name in NAMES}


@pytest.mark.parametrize("variant", list(VARIANTS))
def test_d1_column_state_has_equal_results(variant: str) -> None:
    flat, column = made(variant), made(variant)
    column.x = column.x[:, None]
    for z in samples()[:12]:
        for tracker in (flat, column):
            tracker.predict()
            tracker.update(z)
    assert column.x.shape == (flat.dim_x, 1)
    assert column.y.shape == column.z.shape == (10, 1)
    np.testing.assert_array_equal(column.x[:, 0], flat.x)
    np.testing.assert_array_equal(column.y[:, 0], flat.y)


def test_d1_assigned_belief_is_used_by_the_next_call() -> None:
    tracker, other = made(), made()
    for k, z in enumerate(samples()[:10]):
        tracker.predict()
        other.predict()
        if k == 5:
            tracker.x, tracker.P = np.array([0.3]), np.array([[0.2]])
            other.x, other.P = np.array([0.3]), np.array([[0.2]])
        tracker.update(z)
        other.update(z)
    assert abs(tracker.x[0] - made().run(samples()[:10]).x[-1, 0]) > 1e-6
    np.testing.assert_array_equal(tracker.x, other.x)
    tracker.P = np.array([[-1.0]])
    with pytest.raises(ValueError, match="P must"):
        tracker.predict()


def test_d2_no_control() -> None:
    one, other, third = made(), made(), made()
    one.predict()
    other.predict(0)
    third.predict(None, dt=1.0)
    assert one.P == other.P == third.P
    with pytest.raises(ValueError, match="control"):
        one.predict(1.0)


@pytest.mark.parametrize("shape", [(10,), (10, 1)])
def test_d3_snapshot_of_every_shape_is_accepted(shape: tuple[int, ...]) -> None:
    one, other = made(), made()
    for z in samples()[:10]:
        one.update(z)
        other.update(z.reshape(shape).tolist())
    np.testing.assert_array_equal(one.x, other.x)


@pytest.mark.parametrize("variant", ["B", "Bw", "E", "phasor"])
def test_d3_update_with_R_is_one_vector_update(variant: str) -> None:
    one, other, noisy = (made(variant, sequential_update=False) for _ in range(3))
    for z in samples()[:12]:
        other.predict()
        other.update(z)
        noisy.predict()
        noisy.update(z, R=1e12)
        one.predict()
        fresh = copy.deepcopy(one)
        fresh.update(z)
        before = copy.deepcopy(one)
        before.update(z)
        before.set_belief(one.x, one.P)
        one.update(z, R=before.R)
        np.testing.assert_allclose(one.x, fresh.x, atol=1e-12)
        np.testing.assert_allclose(one.P, fresh.P, atol=1e-12)
        one = fresh
    assert noisy.x[0] == pytest.approx(made().x[0], abs=1e-6)
    with pytest.raises(ValueError, match="R must"):
        other.update(samples()[0], R=np.eye(3))
    np.testing.assert_array_equal(other.x, one.x)


def test_d3_update_with_H_is_another_measurement() -> None:
    tracker = made(motion=DelayDrift(1e-8))
    before = tracker.P[0, 0]
    tracker.update([1.5], R=1e-9, H=[[1.0, 0.0]])
    assert tracker.x[0] == pytest.approx(1.5, abs=1e-6)
    assert tracker.P[0, 0] < 1e-8 < before
    assert tracker.buffer.n_snapshots == 0


@pytest.mark.parametrize("variant", list(VARIANTS))
@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("missing", [None, np.nan, np.full(10, np.nan)])
def test_d4_missing_snapshot_sets_the_attributes(variant: str, column: bool, missing: Any) -> None:
    tracker = made(variant)
    if column:
        tracker.x = tracker.x[:, None]
    tracker.run(samples()[:9])
    tracker.predict()
    tracker.update(missing)
    shape = (10, 1) if column else (10,)
    assert tracker.y.shape == tracker.z.shape == shape
    assert np.isnan(tracker.z).all()
    assert not tracker.y.any()
    assert tracker.log_likelihood == 0.0
    np.testing.assert_array_equal(tracker.x_post, tracker.x)
    np.testing.assert_array_equal(tracker.P_post, tracker.P)


@pytest.mark.parametrize("variant", list(VARIANTS))
def test_d5_attributes_have_final_shapes_from_the_start(variant: str) -> None:
    tracker = made(variant)
    first = shapes(tracker)
    for z in samples()[:8]:
        tracker.predict()
        assert shapes(tracker) == first
        tracker.update(z)
        assert shapes(tracker) == first
    n = tracker.dim_x
    assert first["S"] == first["R"] == (10, 10)
    assert first["H"] == (10, n)
    assert first["K"] == (n, 10)
    np.testing.assert_allclose(tracker.S @ tracker.SI, np.eye(10), atol=1e-9)


@pytest.mark.parametrize("variant", ["B", "Bw", "E", "phasor"])
def test_d5_gain_times_residual_is_the_change_of_x(variant: str) -> None:
    tracker = made(variant, sequential_update=False)
    tracker.run(samples()[:10])
    for z in samples()[10:20]:
        tracker.predict()
        tracker.update(z)
        step = tracker.x_post - tracker.x_prior
        np.testing.assert_allclose(tracker.K @ tracker.y, step, atol=1e-12)


@pytest.mark.parametrize("variant", ["B", "C", "D"])
def test_d5_gain_times_residual_of_several_baselines_is_the_change_to_first_order(
    variant: str,
) -> None:
    tracker = made(variant)
    tracker.run(samples()[:20])
    for z in samples()[20:]:
        tracker.predict()
        tracker.update(z)
        step = tracker.x_post - tracker.x_prior
        off = tracker.K @ tracker.y - step
        assert abs(off[0]) < 0.1 * np.sqrt(tracker.P_prior[0, 0])


def test_d5_residuals_of_two_taps_equal_those_of_the_model() -> None:
    tracker, z = made("B"), samples()
    tracker.run(z[:10])
    tracker.predict()
    tracker.update(z[10])
    model = tracker.assembly.final.baseline_models[0]  # type: ignore[union-attr]  # of "B"
    scaled = z[:11, np.argsort(TONE.measurement.grid_index)] / np.sqrt(
        TONE.measurement.power or 1.0
    )
    now, X = model.split(scaled)
    grid_index = TONE.measurement.grid_index
    expected = np.concatenate([[0.0], now - model.h(tracker.x_prior, X)])[grid_index]
    np.testing.assert_allclose(tracker.y, expected, atol=1e-12)


def test_d6_saver_makes_arrays() -> None:
    tracker = made("E2", acquisition=6)
    saver = Saver(tracker)
    for z in samples()[:10]:
        tracker.predict()
        tracker.update(z)
        saver.save()
    saver.to_array()
    assert saver.x.shape == (10, tracker.dim_x)
    assert saver.S.shape == (10, 10, 10)


def pair() -> list[InterpolationEKF]:
    return [made(motion=DelayWalk(q)) for q in (1e-8, 1e-2)]


@pytest.mark.parametrize("bank", [IMMEstimator, IMM])
def test_d7_imm_of_two_speeds_prefers_the_slow_one(bank: Any) -> None:
    steady = bank(pair(), [0.5, 0.5], MARKOV)
    for z in samples():
        steady.predict()
        steady.update(z)
    assert steady.mu[0] > 0.6
    doa = TONE.measurement.doa(np.ravel(steady.x)[0])
    assert np.rad2deg(doa) == pytest.approx(TONE.doa_deg, abs=3.0)


def test_d7_mmae_of_two_speeds_prefers_the_slow_one() -> None:
    filters = [made(motion=DelayWalk(q)) for q in (1e-8, 1e-1)]
    for tracker in filters:
        tracker.x = tracker.x[:, None]
    bank = MMAEFilterBank(filters, [0.5, 0.5], dim_x=1)
    for z in samples():
        bank.predict()
        bank.update(z)
    assert bank.p[0] > 0.9


def test_d9_batch_filter_equals_run_and_smoother_reduces_the_error() -> None:
    z = [*samples()[:20], None, *samples()[21:]]
    tracker = made("B", motion=DelayWalk(1e-5))
    means, covariances, _, _ = tracker.batch_filter(z)
    np.testing.assert_array_equal(means, made("B", motion=DelayWalk(1e-5)).run(z).x)
    x, P, K, _ = tracker.rts_smoother(means, covariances)
    assert (P[:, 0, 0] <= covariances[:, 0, 0] + 1e-15).all()
    truth = float(TONE.measurement.delay(np.deg2rad(TONE.doa_deg)))
    assert abs(x[0, 0] - truth) < abs(means[0, 0] - truth)
    assert K.shape == (40, 1, 1)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda t: pickle.loads(pickle.dumps(t))])
def test_d12_copies_continue_with_equal_results(again: Any) -> None:
    tracker = made("E2", acquisition=5)
    tracker.run(samples()[:3])
    other = again(tracker)
    np.testing.assert_array_equal(tracker.run(samples()[3:]).x, other.run(samples()[3:]).x)
    np.testing.assert_array_equal(tracker.y, other.y)


def positions() -> Float:
    return np.array([[0.0], [3.5], [0.5], [2.0], [1.0]])


def test_line_with_gaps_has_residuals_in_the_order_of_its_sensors() -> None:
    """Line with gaps, sensors in any order: `y` has the order of `z`."""
    array = SensorArray(positions(), speed=1000.0)
    model = ArraySamples(array, rate=1000.0, correlation=Tones(0.2), snr_db=20.0, power=0.5)
    tracker = InterpolationEKF(model, variant=VARIANTS["B"].replace(extrapolate=True), doa=0.3)
    lag = model.grid_index * model.delay(0.4)
    for k in range(8):
        tracker.predict()
        tracker.update(np.cos(0.4 * np.pi * (k - lag)))
    assert tracker.y.shape == (5,)
    known = np.isin(model.grid_index - 1, model.grid_index)
    np.testing.assert_array_equal(tracker.H[:, 0] != 0, known)


def test_band_likelihood_is_largest_at_the_true_noise() -> None:
    z = BAND.sample(np.random.default_rng(1)).measurements
    total = []
    for off in (-10.0, 0.0, 10.0):
        snr_db = BAND.measurement.snr_db + off
        variant = VARIANTS["Bw"].replace(offsets=range(-3, 5))
        model = BAND.measurement.replace(snr_db=snr_db)
        tracker = InterpolationEKF(model, variant=variant, doa=0.9)
        value = 0.0
        for row in z:
            tracker.predict()
            tracker.update(row)
            value += tracker.log_likelihood
        total.append(value)
    assert max(total) == total[1]


def test_run_batch_with_none_equals_single_runs() -> None:
    z = [*samples()[:5], None, *samples()[6:12]]
    run = made().run_batch([z, z])[1]
    np.testing.assert_allclose(run.x, made().run(z).x, atol=1e-12)
