"""The AR Kalman filter with QRD-RLS: its laws, and rows of the specification's table."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conformance_cases.autoregressive import spoilt
from filterpy.kalman import KalmanFilter

from arrivals.measurement_models import ArrayManifold, ArraySnapshot, LinearMeasurement, SensorArray
from arrivals.motion_models import (
    AutoregressiveSources,
    LinearMotion,
    RandomWalk,
    VonMisesWalk,
    yule_walker,
)
from arrivals.motion_models.companion_form import blocks
from arrivals.trackers import EKF, ARKalmanQRDRLS, Kalman, Run, create
from arrivals.trackers.autoregressive.initialization import placings
from arrivals.trackers.autoregressive.steady_state import exact_filter, fixed_gain, steady_filter
from arrivals.typing import Complex, Float

TWO = AutoregressiveSources([[0.772, -0.45], [0.96, -0.77]]).scaled(1.0)
THREE = AutoregressiveSources([[0.772, -0.45], [0.96, -0.77], [-1.2, -0.72]]).scaled(1.0)
DOA = np.deg2rad([-20.0, 30.0])
INWARDS = np.deg2rad([10.0, -10.0])


def model(*distances: float, snr_db: float = 10.0) -> ArraySnapshot:
    return ArraySnapshot(SensorArray.symmetric(distances), 1.0, noise=10 ** (-snr_db / 10))


def sources(motion: AutoregressiveSources, runs: int, n: int, seed: int = 0) -> Complex:
    """Draw sources, (runs, n, n_sources), after running in."""
    from scipy.signal import lfilter

    v = np.random.default_rng(seed).standard_normal((2, runs, n + 200, motion.n_sources))
    drive = np.sqrt(np.array(motion.noise) / motion.n_parts)
    w = drive * (v[0] if motion.real_valued else v[0] + 1j * v[1])
    rows = enumerate(motion.coefficients)
    s = [lfilter([1.0], [1.0, *(-a for a in row)], w[..., k], axis=1) for k, row in rows]
    return np.stack(s, axis=-1)[:, 200:].astype(complex)


def snapshots(measurement: ArraySnapshot, doa: Float, s: Complex, seed: int = 1) -> Complex:
    return measurement.simulate(np.broadcast_to(doa, s.shape), s, np.random.default_rng(seed))


def rmse_deg(runs: list[Run], doa: Float, first: int) -> float:
    wrong = np.array([run.doa[first:] for run in runs]) - doa[..., first:, :]
    return float(np.median(np.rad2deg(np.sqrt((wrong**2).mean(axis=(1, 2))))))


def fixed(doa: Float, n: int) -> Float:
    return np.tile(doa, (n, 1))


# -- laws of the filter ----------------------------------------------------------------------------


def belief(motion: AutoregressiveSources, manifold: ArrayManifold) -> dict[str, Any]:
    places = blocks(motion.orders, lag_by_lag=True)
    return {
        "x": np.zeros((motion.n_parts, places.dim)),
        "P": np.eye(places.dim),
        "F": places.transition(motion.padded),
        "Q": places.drive(np.array(motion.noise)),
        "A": manifold.real_steering(DOA).T,
        "r": np.array([[0.1]]),
    }


def composite_filter(parts: dict[str, Any], y: Float) -> tuple[Float, Float]:
    """Run filterpy's filter on real and imaginary parts."""
    n, (m, k) = len(parts["F"]), parts["A"].shape
    kf, two = KalmanFilter(2 * n, 2 * m), np.eye(2)
    kf.F, kf.Q, kf.P = np.kron(two, parts["F"]), np.kron(two, parts["Q"]) / 2, parts["P"]
    kf.P = np.kron(two, parts["P"]) / 2
    kf.H, kf.R = np.kron(two, parts["A"] @ np.eye(n)[:k]), 0.05 * np.eye(2 * m)
    means = []
    for row in y.reshape(-1, 2 * m):
        kf.predict()
        kf.update(row)
        means.append(kf.x.reshape(2, n))
    return np.reshape(means, (-1, n)), kf.P


def test_complex_filter_with_real_matrices_is_the_composite_real_one() -> None:
    parts = belief(TWO, ArrayManifold(SensorArray.symmetric([0.25]), 1.0))
    y = np.random.default_rng(0).standard_normal((40, 3))  # 20 snapshots
    X, P = exact_filter(parts["x"], parts["P"], y, parts["F"], parts["Q"], parts["A"], parts["r"])
    means, covariance = composite_filter(parts, y)
    np.testing.assert_allclose(X, means, atol=1e-12)
    np.testing.assert_allclose(np.kron(np.eye(2), P[-1]) / 2, covariance, atol=1e-12)


def test_steady_filter_is_the_exact_one_once_that_is_steady() -> None:
    parts = belief(TWO, ArrayManifold(SensorArray.symmetric([0.25, 0.5]), 1.0))
    y = np.random.default_rng(0).standard_normal((300, 5))
    given = [parts[name] for name in ("F", "Q", "A", "r")]
    _, P = steady_filter(parts["x"], parts["P"], y, *given)
    _, Ps = exact_filter(parts["x"], parts["P"], y, *given)
    np.testing.assert_allclose(P, Ps[-1], atol=1e-4 * np.abs(P).max())
    for _ in range(2):  # goes on from where it was
        X, P = steady_filter(parts["x"], P, y, *given)
    exact, Ps = exact_filter(parts["x"], P, y, *given)
    np.testing.assert_allclose(P, Ps[-1], atol=1e-10)
    np.testing.assert_allclose(X[-1], exact[-1], atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 5, 30])
def test_doubling_is_the_recursion(n: int) -> None:
    rng = np.random.default_rng(n)
    Phi, b, x = rng.standard_normal((3, 3)) / 3, rng.standard_normal((n, 3)), np.ones((1, 3))
    step, expected = x[0], []
    for row in b:
        step = Phi @ step + row
        expected.append(step)
    np.testing.assert_allclose(fixed_gain(x, Phi, b), expected, atol=1e-13)


def test_what_no_sensor_measured_is_predicted() -> None:
    parts = belief(TWO, ArrayManifold(SensorArray.symmetric([0.25]), 1.0))
    parts["x"] = np.ones((2, 6))
    y = np.full((2, 3), np.nan)
    given = [parts[name] for name in ("F", "Q", "A", "r")]
    X, P = exact_filter(parts["x"], parts["P"], y, *given)
    np.testing.assert_allclose(X, parts["x"] @ parts["F"].T)
    np.testing.assert_allclose(P[0], parts["F"] @ parts["F"].T + parts["Q"])


# -- laws of the tracker ---------------------------------------------------------------------------


def test_a_source_of_no_power_changes_nothing_for_the_others() -> None:
    array, n = model(0.25, 0.5), 1500
    z = snapshots(array, DOA, sources(TWO, 1, n)[0])
    silent = AutoregressiveSources([*TWO.coefficients, [0.5, 0.0]], [*np.array(TWO.noise), 1e-24])
    alone = ARKalmanQRDRLS(array, TWO, doa=DOA + 0.1).run(z)
    beside = ARKalmanQRDRLS(array, silent, doa=[*(DOA + 0.1), 0.9]).run(z)
    for name in ("doa", "amplitude", "coefficients", "driving_noise", "signals"):
        one, other = getattr(alone, name), getattr(beside, name)
        np.testing.assert_allclose(other[:, :2], one, atol=1e-6)


def test_units_of_the_samples_do_not_matter() -> None:
    z = snapshots(model(0.25), DOA, sources(TWO, 1, 600)[0])
    one = ARKalmanQRDRLS(model(0.25), TWO, doa=DOA + 0.1, gate=0.1, r_start=0.3).run(z)
    quiet = model(0.25).replace(noise=1e-7)
    other = ARKalmanQRDRLS(quiet, TWO.scaled(1e-6), doa=DOA + 0.1, gate=0.1, r_start=0.3).run(
        1e-3 * z
    )
    np.testing.assert_allclose(other.doa, one.doa, atol=1e-9)
    np.testing.assert_allclose(other.signals, 1e-3 * one.signals, atol=1e-12)


def test_run_gives_all_samples_and_the_estimate_those_at_the_ends() -> None:
    array = model(0.25)
    z = snapshots(array, DOA, sources(TWO, 1, 100)[0])
    tracker = ARKalmanQRDRLS(array, TWO, doa=DOA)
    first, second = tracker.run(z[:37]), tracker.run(z[37:])
    whole = ARKalmanQRDRLS(array, TWO, doa=DOA).run(z)
    np.testing.assert_allclose(second.signals, whole.signals[37:], atol=1e-12)
    np.testing.assert_allclose(first.signals[:30], whole.signals[:30], atol=1e-12)
    assert np.isfinite(first.signals).all()  # the last seven are provisional
    np.testing.assert_array_equal(whole.amplitude[29::30], whole.signals[29::30])
    np.testing.assert_array_equal(tracker.signals, whole.signals[60:90])
    assert whole.coefficients.shape == (100, 2, 2)
    np.testing.assert_array_equal(tracker.coefficients, whole.coefficients[-1])
    np.testing.assert_array_equal(tracker.driving_noise, whole.driving_noise[-1])
    assert (tracker.noise, tracker.power.shape) == (whole.noise[-1], (2,))
    assert whole.at(np.arange(100.0)).signals is whole.signals
    assert "signals" in dir(whole)


def test_batch_gives_the_signals_of_single_runs() -> None:
    array = model(0.25)
    z = snapshots(array, DOA, sources(TWO, 3, 100))
    z[1, 40:43, 1] = np.nan
    tracker = ARKalmanQRDRLS(array, TWO, doa=DOA)
    for one, many in zip(z, tracker.run_batch(z), strict=True):
        np.testing.assert_array_equal(
            ARKalmanQRDRLS(array, TWO, doa=DOA).run(one).signals, many.signals
        )
    located = ARKalmanQRDRLS(array, TWO)
    for one, many in zip(z, located.run_batch(z), strict=True):
        np.testing.assert_array_equal(ARKalmanQRDRLS(array, TWO).run(one).doa, many.doa)


def test_an_assigned_state_is_where_the_filter_goes_on() -> None:
    z = snapshots(model(0.25), DOA, sources(TWO, 1, 30)[0])
    tracker, other = (ARKalmanQRDRLS(model(0.25), TWO, doa=DOA) for _ in range(2))
    tracker.x = np.full(TWO.dim_x, 5.0)
    assert abs(tracker.run(z).signals[0] - other.run(z).signals[0]).max() > 0.05
    tracker.x = np.zeros(3)
    with pytest.raises(ValueError, match=r"x must have shape \(12,\)"):
        tracker.run(z)


def test_parameters_that_change_the_state_start_again_and_others_do_not() -> None:
    z = snapshots(model(0.25), DOA, sources(TWO, 1, 60)[0])
    tracker = ARKalmanQRDRLS(model(0.25), TWO, doa=DOA)
    tracker.run(z)
    kept = tracker.x
    assert tracker.set_params(forgetting=0.9).x is kept
    tracker.set_params(motion__real_valued=True)
    assert tracker.x.shape == (6,)
    assert not tracker.x.any()


# -- rows of the table of section 7, 8 runs each ---------------------------------------------------

ROWS: list[tuple[str, ArraySnapshot, float, dict[str, Any]]] = [
    ("SNR 30, λ .95", model(0.25, snr_db=30.0), 0.12, {"forgetting": 0.95}),
    ("SNR 10", model(0.25), 0.7, {"forgetting": 0.99}),
    ("SNR 1", model(0.25, snr_db=1.0), 2.0, {"forgetting": 0.99}),
    ("M = 3", model(0.25, 0.5, 0.75), 0.28, {"forgetting": 0.97}),
    ("d (.5, 4)", model(0.5, 4.0), 0.09, {"forgetting": 0.97}),
    ("d (.5, 1.5, 2.5)", model(0.5, 1.5, 2.5), 0.09, {"forgetting": 0.97}),
]


@pytest.mark.parametrize(("name", "array", "limit", "params"), ROWS, ids=[row[0] for row in ROWS])
def test_table_two_static_sources(
    name: str, array: ArraySnapshot, limit: float, params: dict[str, Any]
) -> None:
    s = sources(TWO, 8, 6000)
    runs = ARKalmanQRDRLS(array, TWO, doa=DOA + INWARDS, **params).run_batch(
        snapshots(array, DOA, s)
    )
    assert rmse_deg(runs, fixed(DOA, 6000), 3000) < limit
    if name in ("SNR 10", "SNR 30, λ .95"):
        found = np.array([run.signals for run in runs])[:, 3000:]
        nmse = (abs(found - s[:, 3000:]) ** 2).mean() / (abs(s[:, 3000:]) ** 2).mean()
        assert 10 * np.log10(nmse) < (-13.0 if name == "SNR 10" else -32.5)
        wrong = np.array([run.coefficients[3000:] for run in runs]) - TWO.padded
        assert np.sqrt((wrong**2).mean()) < 0.03
        assert np.mean([run.noise[-1] for run in runs]) == pytest.approx(array.noise, rel=0.1)


def test_table_three_sources_on_three_sensors() -> None:
    doa, array = np.deg2rad([-35.0, 5.0, 40.0]), model(0.5)
    off = np.deg2rad([3.0, -3.0, 3.0])
    tracker = ARKalmanQRDRLS(array, THREE, doa=doa + off, forgetting=0.99)
    runs = tracker.run_batch(snapshots(array, doa, sources(THREE, 8, 6000)))
    assert rmse_deg(runs, fixed(doa, 6000), 3000) < 0.4


def test_table_a_moving_source_is_followed_in_short_intervals() -> None:
    doa = np.deg2rad(np.stack([np.linspace(40, 0, 600), np.full(600, -20.0)], axis=-1))
    array = model(0.5, 1.0)
    tracker = ARKalmanQRDRLS(array, TWO, doa=doa[0] + INWARDS / 2, interval=3, forgetting=0.9)
    runs = tracker.run_batch(snapshots(array, doa, sources(TWO, 8, 600)))
    assert rmse_deg(runs, doa, 120) < 0.85


def test_repeats_halve_the_lag_behind_a_moving_source() -> None:
    doa = np.deg2rad(np.stack([np.linspace(40, 0, 6000), np.full(6000, -20.0)], axis=-1))
    array, s = model(0.25, 0.5, snr_db=30.0), sources(TWO, 2, 6000)
    z, start = snapshots(array, doa, s), doa[0] + INWARDS / 2
    ends = slice(29, None, 30)
    for inner, limit in ((1, 0.65), (4, 0.3)):
        tracker = ARKalmanQRDRLS(array, TWO, doa=start, forgetting=0.95, inner=inner)
        wrong = np.rad2deg(np.array([run.doa[ends] for run in tracker.run_batch(z)]) - doa[ends])
        assert np.sqrt((wrong[:, 40:] ** 2).mean()) < limit


# -- what the options are for ----------------------------------------------------------------------


def test_without_the_covariance_rows_noise_biases_the_directions() -> None:
    array, doa = model(0.25), fixed(DOA, 4500)
    z = snapshots(array, DOA, sources(TWO, 4, 4500))
    plain, right = (
        ARKalmanQRDRLS(array, TWO, doa=DOA, forgetting=0.99, correction=on).run_batch(z)
        for on in (False, True)
    )
    assert rmse_deg(plain, doa, 2250) > 2.0 > 0.7 > rmse_deg(right, doa, 2250)


def test_overstated_noise_is_learned_and_would_bias_if_it_were_not() -> None:
    doa, truth = fixed(DOA, 6000), model(0.25)
    z = snapshots(truth, DOA, sources(TWO, 4, 6000))
    wrong = truth.replace(noise=10 * truth.noise)
    learned, believed = (
        ARKalmanQRDRLS(wrong, TWO, doa=DOA, forgetting=0.99, adapt_noise=on).run_batch(z)
        for on in (True, False)
    )
    assert rmse_deg(learned, doa, 3000) < 0.75
    assert rmse_deg(believed, doa, 3000) > 2.0
    assert learned[0].noise[-1] == pytest.approx(truth.noise, rel=0.15)


def test_real_sources_are_heard_with_half_the_noise() -> None:
    real, array = TWO.replace(real_valued=True).scaled(1.0), model(0.25)
    s = sources(real, 4, 3000)
    z = snapshots(array, DOA, s)
    assert not s.imag.any()

    def nmse(motion: AutoregressiveSources) -> float:
        runs = ARKalmanQRDRLS(array, motion, doa=DOA).run_batch(z)
        found = np.array([run.signals for run in runs])[:, 1500:]
        return float(10 * np.log10((abs(found - s[:, 1500:]) ** 2).mean()))

    assert nmse(TWO) - nmse(real) == pytest.approx(2.8, abs=0.5)


def test_a_source_that_falls_silent_keeps_its_direction_and_shows_it() -> None:
    real, array = TWO.replace(real_valued=True).scaled(1.0), model(0.25, 0.5)
    s = sources(real, 1, 6000)[0]
    s[3000:4500, 0] = 0.0
    z = snapshots(array, DOA, s)
    params: dict[str, Any] = {"ridge": 5.0, "gate": 0.3, "adapt_drive": False}
    run = ARKalmanQRDRLS(array, real, doa=DOA + 0.05, **params).run(z)
    wrong = np.abs(np.rad2deg(run.doa - DOA))
    assert wrong[1500:].max() < 3.0
    assert (run.existence[3060:4490, 0] == 0).mean() > 0.95
    assert (run.existence[3060:4490, 1] == 1).mean() > 0.7
    params |= {"gate": 0.0, "ridge": 0.01}
    free = ARKalmanQRDRLS(array, real, doa=DOA + 0.05, **params).run(z)
    assert np.abs(np.rad2deg(free.doa - DOA))[3060:4490, 0].max() > 10.0
    assert np.isnan(free.existence).all()


def test_powers_are_learned_where_the_model_is_wrong_about_them() -> None:
    real, array = TWO.replace(real_valued=True).scaled(1.0), model(0.25, 0.5)
    z = snapshots(array, DOA, sources(real, 1, 9000)[0])
    params: dict[str, Any] = {"ridge": 5.0, "gate": 0.3, "adapt_drive": False}
    for wrong in (0.1, 10.0):
        tracker = ARKalmanQRDRLS(array, real.scaled(wrong), doa=DOA + 0.05, **params)
        run = tracker.run(z)
        assert tracker.power == pytest.approx(1.0, rel=0.7)
        assert np.abs(np.rad2deg(run.doa[6000:] - DOA)).max() < 2.0


def test_inflated_noise_helps_where_there_is_little_of_it() -> None:
    doa, array = np.deg2rad([-35.0, 5.0, 40.0]), model(0.5, snr_db=30.0)
    start = doa + np.deg2rad([3.0, -3.0, 3.0])
    z = snapshots(array, doa, sources(THREE, 4, 6000))
    slow, fast = (
        ARKalmanQRDRLS(array, THREE, doa=start, forgetting=0.99, r_start=r).run_batch(z)
        for r in (0.0, 0.3)
    )
    assert rmse_deg(fast, fixed(doa, 6000), 4500) < 0.5 * rmse_deg(slow, fixed(doa, 6000), 4500)


def test_wrong_ar_models_are_forgotten_where_sensors_outnumber_sources() -> None:
    z = snapshots(model(0.25, snr_db=30.0), DOA, sources(TWO, 2, 6000))
    swapped = AutoregressiveSources([*TWO.coefficients][::-1]).scaled(1.0)
    for motion in (AutoregressiveSources([[0.0, 0.0]] * 2), swapped):
        tracker = ARKalmanQRDRLS(model(0.25, snr_db=30.0), motion, doa=DOA + INWARDS)
        assert rmse_deg(tracker.run_batch(z), fixed(DOA, 6000), 3000) < 0.12


def test_orders_may_differ() -> None:
    mixed = AutoregressiveSources([[0.9], [0.96, -0.77]]).scaled(1.0)
    z = snapshots(model(0.25, 0.5), DOA, sources(mixed, 2, 6000))
    runs = ARKalmanQRDRLS(model(0.25, 0.5), mixed, doa=DOA + 0.1).run_batch(z)
    assert rmse_deg(runs, fixed(DOA, 6000), 3000) < 0.5
    for run in runs:
        np.testing.assert_allclose(run.coefficients[-1], mixed.padded, atol=0.1)
        assert (np.abs(run.coefficients[:, 0, 1]) < 1e-12).all()


# -- the start -------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", [TWO, THREE], ids=["two", "three"])
@pytest.mark.parametrize("distances", [(0.25,), (0.5, 1.5, 2.5)], ids=str)
def test_first_snapshots_tell_directions_and_labels(
    motion: AutoregressiveSources, distances: tuple[float, ...]
) -> None:
    doa = np.deg2rad([-35.0, 25.0, 5.0])[: motion.n_sources]
    array = model(*distances)
    z = snapshots(array, doa, sources(motion, 3, 60))
    tracker = ARKalmanQRDRLS(array, motion)
    assert tracker.estimate.n_found == 0
    for run in tracker.run_batch(z):
        assert run.n_found.tolist() == [0] * 59 + [motion.n_sources]
        assert np.isnan(run.signals[:59]).sum() == 0  # known once the directions are
        assert np.rad2deg(np.abs(run.doa[-1] - doa)).max() < 8.0
        assert run.label[0].tolist() == [-1] * motion.n_sources
        assert run.label[-1].tolist() == list(range(motion.n_sources))


def test_places_are_tried_once_where_models_are_equal() -> None:
    grid = np.arange(5.0)
    assert len(placings(TWO, grid)) == 20
    assert len(placings(AutoregressiveSources([[0.5]] * 3), grid)) == 10
    pair = placings(AutoregressiveSources([[0.5], [0.9], [0.5]]), grid)
    assert len(pair) == 30
    assert (pair[:, 0] < pair[:, 2]).all()


def test_silence_at_the_start_is_waited_for() -> None:
    array = model(0.25, 0.5)
    s = sources(TWO, 1, 600)[0]
    s[:200] = 0.0
    z = snapshots(array, DOA, s)
    z[100:160] = np.nan
    run = ARKalmanQRDRLS(array, TWO, gate=0.3).run(z)
    assert run.n_found[200] == 0
    assert np.isnan(run.signals[100]).all()
    assert np.abs(np.rad2deg(run.doa[-1] - DOA)).max() < 3.0
    never = ARKalmanQRDRLS(array, TWO, gate=0.3).run_batch([z[:130]] * 2)
    assert all(run.n_found.max() == 0 for run in never)


# -- missing ---------------------------------------------------------------------------------------


def test_missing_sensors_and_snapshots_cost_little() -> None:
    array, rng = model(0.25, 0.5), np.random.default_rng(3)
    z = snapshots(array, DOA, sources(TWO, 4, 6000))
    z[rng.random(z.shape) < 0.05] = np.nan
    z[:, 2000:2100] = np.nan
    runs = ARKalmanQRDRLS(array, TWO, doa=DOA + 0.1, forgetting=0.97).run_batch(z)
    assert rmse_deg(runs, fixed(DOA, 6000), 3000) < 0.7  # 0.33 without gaps
    np.testing.assert_array_equal(runs[0].doa[2010], runs[0].doa[2085])  # holds in the gap
    assert all(np.isfinite(run.signals).all() for run in runs)
    assert np.mean([run.noise[-1] for run in runs]) == pytest.approx(array.noise, rel=0.2)


def test_infinite_numbers_count_as_missing() -> None:
    z = snapshots(model(0.25), DOA, sources(TWO, 1, 60)[0])
    gone, wild = z.copy(), z.copy()
    gone[7, 1], wild[7, 1] = np.nan, complex(1e300, 0)
    one, other = (ARKalmanQRDRLS(model(0.25), TWO, doa=DOA).run(part) for part in (gone, wild))
    np.testing.assert_array_equal(one.doa, other.doa)


# -- what bad input gets ---------------------------------------------------------------------------


def made(**params: Any) -> ARKalmanQRDRLS:
    return ARKalmanQRDRLS(**{"measurement": model(0.25), "motion": TWO} | params)


WRONG: list[tuple[Callable[[], object], type[Exception], str]] = [
    (
        lambda: create("ar_kalman_qrd_rls", measurement="array"),
        TypeError,
        "measurement must be an ArraySnapshot; got 'array'",
    ),
    (
        lambda: made(motion=VonMisesWalk(3.0)),
        TypeError,
        "motion must be an AutoregressiveSources; got VonMisesWalk",
    ),
    (
        lambda: made(measurement=ArraySnapshot(SensorArray.ula(4, 0.5), 1.0), doa=DOA),
        ValueError,
        "must have a centre sensor",
    ),
    (
        lambda: made(measurement=ArraySnapshot(SensorArray.ula(4, 0.5), 1.0)),
        ValueError,
        "must have a centre sensor",
    ),
    (lambda: made(measurement=model(0.7)), ValueError, "at most half a wavelength, 0.5 m"),
    (lambda: made(interval=1), ValueError, "not be longer than the interval, 1 snapshots; got 2"),
    (lambda: made(doa=[0.1, 0.1]), ValueError, "two initial directions must be at least 1e-06 rad"),
    (lambda: made(doa=[0.1, 2.0]), ValueError, "within ±π/2 rad"),
    (lambda: made(doa=[0.1]), ValueError, r"doa must have shape \(2,\)"),
    (lambda: made(forgetting=1.0), ValueError, r"forgetting must lie in \(0, 1\)"),
    (lambda: made(gate=-1.0), ValueError, "gate"),
    (lambda: made(ridge=0.0), ValueError, "ridge"),
    (lambda: made(inner=0), ValueError, "inner"),
    (lambda: made(doa=DOA).update(np.zeros(4)), ValueError, r"shape \(3,\), one number a sensor"),
    (lambda: made(doa=DOA).run(np.full((2, 3), "a")), TypeError, "must hold complex numbers"),
    (lambda: made(doa=DOA).predict(dt=0.0), ValueError, "dt"),
]


@pytest.mark.parametrize(("call", "error", "message"), WRONG, ids=[w[2][:25] for w in WRONG])
def test_bad_input_is_told(
    call: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        call()


class ComplexMotion(RandomWalk):
    def F(self, x: Any = None, dt: float = 1.0) -> Any:
        return 1j * np.eye(self.n_dims)


class ComplexMeasurement(LinearMeasurement):
    def H(self, x: Any = None) -> Any:
        return 1j * super().H(x)


CURE = r"real numbers.*(stack real and imaginary parts|composite)"


@pytest.mark.parametrize("kind", [Kalman, EKF])
@pytest.mark.parametrize(
    "models",
    [
        (ComplexMotion(1.0, 1), LinearMeasurement([[1.0]], [[1.0]])),
        (RandomWalk(1.0, 1), ComplexMeasurement([[1.0]], [[1.0]])),
    ],
    ids=["transition", "measurement"],
)
def test_complex_matrices_of_a_model_are_refused_with_the_cure(kind: Any, models: Any) -> None:
    with pytest.raises(TypeError, match=f"of the (motion|measurement) must hold {CURE}"):
        kind(*models, x=[0.0], P=[[1.0]])


@pytest.mark.parametrize("name", ["F", "Q", "H", "R"])
def test_complex_matrices_of_one_step_are_refused_with_the_cure(name: str) -> None:
    tracker: Any = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[1.0]]), [0.0], [[1.0]])
    step = tracker.predict if name in "FQ" else tracker.update
    given = () if name in "FQ" else (1.0,)
    with pytest.raises(TypeError, match=f"{name} must hold {CURE}"):
        step(*given, **{name: [[1j]]})
    with pytest.raises(TypeError, match=CURE):
        LinearMotion([[1j]], [[1.0]])


def test_the_real_manifold_is_a_measurement_of_the_kalman_filter() -> None:
    parts = TWO.replace(real_valued=True)
    A = ArrayManifold(SensorArray.symmetric([0.25]), 1.0).real_steering(DOA).T
    H = np.zeros((3, parts.dim_x))
    H[:, parts.blocks.first] = A
    tracker = Kalman(
        parts, LinearMeasurement(H, 0.05 * np.eye(3)), np.zeros(6), parts.stationary_covariance()
    )
    s = sources(parts, 1, 400)[0]
    y = ArrayManifold(SensorArray.symmetric([0.25]), 1.0).transform(snapshots(model(0.25), DOA, s))
    found = parts.signals(tracker.run(y.real).x)
    assert 10 * np.log10((abs(found - s) ** 2).mean()) < -13.0


# -- speech, where the recordings are --------------------------------------------------------------


@pytest.mark.skipif("ARRIVALS_DATA" not in os.environ, reason="names the folder of the recordings")
def test_speech_is_followed_through_its_pauses() -> None:
    from scipy.io import wavfile

    folder = Path(os.environ["ARRIVALS_DATA"]) / "speech"
    both = [wavfile.read(folder / f"synth_count_{way}_8k.wav")[1] for way in ("up", "down")]
    n = min(map(len, both))
    s = np.stack([voice[:n] for voice in both], axis=-1) * 1.0
    s = (s - s.mean(axis=0)) / s.std(axis=0)
    a, q = zip(*(yule_walker(voice, 1) for voice in s.T), strict=True)
    motion = AutoregressiveSources([row.tolist() for row in a], q, real_valued=True)
    doa = np.deg2rad(np.stack([np.linspace(40, 0, n), np.full(n, -20.0)], axis=-1))
    array = model(0.25, 0.5)
    tracker = ARKalmanQRDRLS(
        array, motion, doa=doa[0] + INWARDS / 2, ar_forgetting=0.99, ridge=5.0, gate=0.3,
        adapt_drive=False,
    )  # fmt: skip
    run = tracker.run(snapshots(array, doa, s.astype(complex)))
    assert np.rad2deg(np.sqrt(((run.doa - doa)[3029::30] ** 2).mean())) < 1.14


def test_conformance_recordings_have_gaps_at_the_end_of_intervals() -> None:
    assert np.isnan(spoilt(TWO, 14)[-1]).all()
