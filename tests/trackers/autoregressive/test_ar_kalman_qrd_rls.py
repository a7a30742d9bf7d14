"""AR Kalman filter with QRD-RLS: invariances, initialization, missing data, invalid input."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import (
    DOA,
    THREE,
    TWO,
    constant,
    make_tracker,
    rmse_deg,
    snapshots,
    sources,
    symmetric_array,
)
from conformance_cases.autoregressive import with_gaps

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import AutoregressiveSources, VonMisesWalk
from arrivals.trackers import ARKalmanQRDRLS, create
from arrivals.trackers.autoregressive.initialization import direction_hypotheses


def test_source_without_power_leaves_other_estimates_unchanged() -> None:
    array, n = symmetric_array(0.25, 0.5), 1500
    z = snapshots(array, DOA, sources(TWO, 1, n)[0])
    with_inactive = AutoregressiveSources(
        [*TWO.coefficients, [0.5, 0.0]], [*np.array(TWO.noise), 1e-24]
    )
    alone = make_tracker(array, TWO, doa=DOA + 0.1).run(z)
    both = make_tracker(array, with_inactive, doa=[*(DOA + 0.1), 0.9]).run(z)
    for name in ("doa", "amplitude", "coefficients", "innovation_variance", "signals"):
        one, other = getattr(alone, name), getattr(both, name)
        np.testing.assert_allclose(other[:, :2], one, atol=1e-6)


def test_scale_of_the_samples_leaves_directions_unchanged() -> None:
    z = snapshots(symmetric_array(0.25), DOA, sources(TWO, 1, 600)[0])
    one = make_tracker(symmetric_array(0.25), TWO, doa=DOA + 0.1, gate=0.1, r_start=0.3).run(z)
    quiet = symmetric_array(0.25).replace(noise=1e-7)
    other = make_tracker(quiet, TWO.scaled(1e-6), doa=DOA + 0.1, gate=0.1, r_start=0.3).run(
        1e-3 * z
    )
    np.testing.assert_allclose(other.doa, one.doa, atol=1e-9)
    np.testing.assert_allclose(other.signals, 1e-3 * one.signals, atol=1e-12)


def test_run_returns_all_samples_and_estimate_those_at_interval_ends() -> None:
    array = symmetric_array(0.25)
    z = snapshots(array, DOA, sources(TWO, 1, 100)[0])
    tracker = make_tracker(array, TWO, doa=DOA)
    first, second = tracker.run(z[:37]), tracker.run(z[37:])
    whole = make_tracker(array, TWO, doa=DOA).run(z)
    np.testing.assert_allclose(second.signals, whole.signals[37:], atol=1e-12)
    np.testing.assert_allclose(first.signals[:30], whole.signals[:30], atol=1e-12)
    assert np.isfinite(first.signals).all()  # the last seven are provisional
    np.testing.assert_array_equal(whole.amplitude[29::30], whole.signals[29::30])
    np.testing.assert_array_equal(tracker.signals, whole.signals[60:90])
    assert whole.coefficients.shape == (100, 2, 2)
    np.testing.assert_array_equal(tracker.coefficients, whole.coefficients[-1])
    np.testing.assert_array_equal(tracker.innovation_variance, whole.innovation_variance[-1])
    assert (tracker.noise_variance, tracker.power.shape) == (whole.noise[-1], (2,))
    assert whole.at(np.arange(100.0)).signals is whole.signals
    assert "signals" in dir(whole)


def test_run_batch_equals_single_runs() -> None:
    array = symmetric_array(0.25)
    z = snapshots(array, DOA, sources(TWO, 3, 100))
    z[1, 40:43, 1] = np.nan
    tracker = make_tracker(array, TWO, doa=DOA)
    for one, many in zip(z, tracker.run_batch(z), strict=True):
        np.testing.assert_array_equal(
            make_tracker(array, TWO, doa=DOA).run(one).signals, many.signals
        )
    located = make_tracker(array, TWO)
    for one, many in zip(z, located.run_batch(z), strict=True):
        np.testing.assert_array_equal(make_tracker(array, TWO).run(one).doa, many.doa)


def test_assigned_state_is_used_by_the_next_interval() -> None:
    z = snapshots(symmetric_array(0.25), DOA, sources(TWO, 1, 30)[0])
    tracker, other = (make_tracker(symmetric_array(0.25), TWO, doa=DOA) for _ in range(2))
    tracker.x = np.full(TWO.dim_x, 5.0)
    assert abs(tracker.run(z).signals[0] - other.run(z).signals[0]).max() > 0.05
    tracker.x = np.zeros(3)
    with pytest.raises(ValueError, match=r"x must have shape \(12,\)"):
        tracker.run(z)


def test_set_params_restarts_only_if_the_state_changes_shape() -> None:
    z = snapshots(symmetric_array(0.25), DOA, sources(TWO, 1, 60)[0])
    tracker = make_tracker(symmetric_array(0.25), TWO, doa=DOA)
    tracker.run(z)
    kept = tracker.x
    assert tracker.set_params(regression__forgetting=0.9).x is kept
    tracker.set_params(motion__real_valued=True)
    assert tracker.x.shape == (6,)
    assert not tracker.x.any()


# -- initialization --------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", [TWO, THREE], ids=["two", "three"])
@pytest.mark.parametrize("distances", [(0.25,), (0.5, 1.5, 2.5)], ids=str)
def test_acquisition_estimates_directions_and_labels(
    motion: AutoregressiveSources, distances: tuple[float, ...]
) -> None:
    doa = np.deg2rad([-35.0, 25.0, 5.0])[: motion.n_sources]
    array = symmetric_array(*distances)
    z = snapshots(array, doa, sources(motion, 3, 60))
    tracker = make_tracker(array, motion)
    assert tracker.estimate.n_found == 0
    for run in tracker.run_batch(z):
        assert run.n_found.tolist() == [0] * 59 + [motion.n_sources]
        assert np.isnan(run.signals[:59]).sum() == 0  # estimated once the directions are known
        assert np.rad2deg(np.abs(run.doa[-1] - doa)).max() < 8.0
        assert run.label[0].tolist() == [-1] * motion.n_sources
        assert run.label[-1].tolist() == list(range(motion.n_sources))


def test_direction_hypotheses_of_equal_models_are_unique() -> None:
    grid = np.arange(5.0)
    assert len(direction_hypotheses(TWO, grid)) == 20
    assert len(direction_hypotheses(AutoregressiveSources([[0.5]] * 3), grid)) == 10
    pair = direction_hypotheses(AutoregressiveSources([[0.5], [0.9], [0.5]]), grid)
    assert len(pair) == 30
    assert (pair[:, 0] < pair[:, 2]).all()


def test_acquisition_waits_for_power_above_the_gate() -> None:
    array = symmetric_array(0.25, 0.5)
    s = sources(TWO, 1, 600)[0]
    s[:200] = 0.0
    z = snapshots(array, DOA, s)
    z[100:160] = np.nan
    run = make_tracker(array, TWO, gate=0.3).run(z)
    assert run.n_found[200] == 0
    assert np.isnan(run.signals[100]).all()
    assert np.abs(np.rad2deg(run.doa[-1] - DOA)).max() < 3.0
    never = make_tracker(array, TWO, gate=0.3).run_batch([z[:130]] * 2)
    assert all(run.n_found.max() == 0 for run in never)


# -- missing data ----------------------------------------------------------------------------------


def test_missing_sensors_and_snapshots_increase_the_error_little() -> None:
    array, rng = symmetric_array(0.25, 0.5), np.random.default_rng(3)
    z = snapshots(array, DOA, sources(TWO, 4, 6000))
    z[rng.random(z.shape) < 0.05] = np.nan
    z[:, 2000:2100] = np.nan
    runs = make_tracker(array, TWO, doa=DOA + 0.1, forgetting=0.97).run_batch(z)
    assert rmse_deg(runs, constant(DOA, 6000), 3000) < 0.7  # 0.33 without gaps
    np.testing.assert_array_equal(runs[0].doa[2010], runs[0].doa[2085])  # constant in the gap
    assert all(np.isfinite(run.signals).all() for run in runs)
    assert np.mean([run.noise[-1] for run in runs]) == pytest.approx(array.noise, rel=0.2)


def test_infinite_numbers_count_as_missing() -> None:
    z = snapshots(symmetric_array(0.25), DOA, sources(TWO, 1, 60)[0])
    with_nan, with_huge = z.copy(), z.copy()
    with_nan[7, 1], with_huge[7, 1] = np.nan, complex(1e300, 0)
    one, other = (
        make_tracker(symmetric_array(0.25), TWO, doa=DOA).run(part)
        for part in (with_nan, with_huge)
    )
    np.testing.assert_array_equal(one.doa, other.doa)


# -- invalid input ---------------------------------------------------------------------------------


def made(**params: Any) -> ARKalmanQRDRLS:
    return make_tracker(**{"measurement": symmetric_array(0.25), "motion": TWO} | params)


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
        lambda: made(measurement=ArraySnapshot(SensorArray.ula(4, 0.6), 1.0), doa=DOA),
        ValueError,
        "at most a quarter wavelength",
    ),
    (
        lambda: made(measurement=ArraySnapshot(SensorArray(np.array([0.0, 0.2, 0.3])), 1.0)),
        ValueError,
        "must be symmetric about its centre",
    ),
    (
        lambda: made(measurement=symmetric_array(0.7)),
        ValueError,
        "half a wavelength, 0.5 m",
    ),
    (lambda: made(interval=1), ValueError, "must be at most the interval, 1 snapshots; got 2"),
    (lambda: made(doa=[0.1, 0.1]), ValueError, "doa must be at least 1e-06 rad apart"),
    (lambda: made(doa=[0.1, 2.0]), ValueError, "within ±π/2 rad"),
    (lambda: made(doa=[0.1]), ValueError, r"doa must have shape \(2,\)"),
    (lambda: made(forgetting=1.0), ValueError, r"forgetting must lie in \(0, 1\)"),
    (lambda: made(gate=-1.0), ValueError, "gate"),
    (lambda: made(ridge=0.0), ValueError, "ridge"),
    (lambda: made(inner=0), ValueError, "inner"),
    (lambda: made(doa=DOA).update(np.zeros(4)), ValueError, r"shape \(3,\), one number a sensor"),
    (
        lambda: made(doa=DOA).run(np.full((2, 3), "a")),
        TypeError,
        "must hold numbers, NaN for a missing",
    ),
    (lambda: made(doa=DOA).predict(dt=-1.0), ValueError, "dt must be finite and not negative"),
    (lambda: made(doa=DOA).predict(dt=np.nan), ValueError, "dt must be finite"),
    (lambda: made(doa=DOA).predict(1.0), ValueError, "u must be None or 0"),
]


@pytest.mark.parametrize(("call", "error", "message"), WRONG, ids=[w[2][:25] for w in WRONG])
def test_invalid_input_raises_with_message(
    call: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        call()


def test_conformance_recordings_end_with_a_missing_snapshot() -> None:
    assert np.isnan(with_gaps(TWO, 14)[-1]).all()
