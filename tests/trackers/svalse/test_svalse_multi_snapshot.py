"""SVALSE and VALSE on several bins and snapshots, directional elements and planar arrays."""

import copy
from typing import Any

import numpy as np
import pytest
from svalse_scenes import (
    CIRCLE,
    ELEMENTS,
    FACING,
    MODELS,
    NAMES,
    OMNI,
    SEVERAL,
    SLOW,
    SPARSE,
    snapshots_of,
    wrapped,
)

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.scenarios import create, mean_gospa
from arrivals.trackers import SVALSE, VALSE
from arrivals.trackers.svalse.newton.solver import NewtonSolver, support_search
from arrivals.trackers.svalse.noise_initialization import noise_from_eigenvalues

every_model = pytest.mark.parametrize("model", MODELS, ids=NAMES)


# -- laws of the trackers -----------------------------------------------------------------------


@pytest.mark.parametrize("model", [CIRCLE, SEVERAL, ELEMENTS], ids=NAMES[:3])
def test_circle_turned_by_grid_steps_turns_every_angle(model: ArraySnapshot) -> None:
    """By whole steps of the grid on which components are born; see the next for others."""
    n = support_search(NewtonSolver(), model.manifold(), 1, with_prior=True).grid.n_points
    turn, doa = 2 * np.pi * 5 / n, np.array([[0.3, -2.0, 1.6]] * 4)
    other, z = turned(model, turn), snapshots_of(model, doa)
    a, b = SVALSE(model, SLOW).run(z), SVALSE(other, SLOW).run(z)
    assert a.iterations.tolist() == b.iterations.tolist()
    np.testing.assert_allclose(wrapped(b.doa - a.doa - turn), 0 * a.doa, atol=1e-7)


def turned(model: ArraySnapshot, turn: float) -> ArraySnapshot:
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    response = None if model.response is None else ElementResponse.first_order(FACING + turn, OMNI)
    return model.replace(array=SensorArray(model.array.positions @ R.T), response=response)


def test_circle_turned_by_any_angle_turns_the_estimates() -> None:
    """Up to the tolerance of Newton's steps; another start differs in some of 100 steps."""
    trial = create("circle", n_bins=3, n_steps=25).sample(np.random.default_rng(0))
    tracker = trial.tracker("svalse")
    assert isinstance(tracker, SVALSE)
    assert isinstance(tracker.measurement, ArraySnapshot)
    other = SVALSE(turned(tracker.measurement, 1.234), tracker.motion)
    a, b = tracker.run(trial.measurements), other.run(trial.measurements)
    same = a.n_found == b.n_found
    assert np.mean(same) >= 0.9
    for x, y, std in zip(a.doa[same], b.doa[same], a.std[same], strict=True):
        x, y = x[~np.isnan(x)], y[~np.isnan(y)]
        apart = np.abs(wrapped(x[:, None] + 1.234 - y)).min(axis=1, initial=9.0)
        assert (apart < 0.2 * np.nanmin(std)).all()


@every_model
def test_estimates_are_invariant_to_scale_and_common_phase(model: ArraySnapshot) -> None:
    z = snapshots_of(model, [[0.3, -0.9]] * 3)
    one, other = SVALSE(model, SLOW).run(z), SVALSE(model, SLOW).run(-3e5j * z)
    assert one.iterations.tolist() == other.iterations.tolist()
    np.testing.assert_allclose(one.doa, other.doa, atol=1e-9)
    np.testing.assert_allclose(other.noise, 9e10 * one.noise, rtol=1e-7)


@pytest.mark.parametrize("model", [SEVERAL, ELEMENTS], ids=["several", "elements"])
def test_missing_sensor_equals_the_array_without_it(model: ArraySnapshot) -> None:
    z = snapshots_of(model, [[0.3, -2.0]] * 3)
    gone = np.delete(np.arange(8), 3)
    response = None
    if model.response is not None:
        response = ElementResponse(model.response.gains[..., gone])
    fewer = model.replace(array=SensorArray(model.array.positions[gone]), response=response)
    damaged = z.copy()
    damaged[..., 3] = np.nan
    a, b = SVALSE(model, SLOW).run(damaged), SVALSE(fewer, SLOW).run(z[..., gone])
    assert a.n_found.tolist() == b.n_found.tolist()
    np.testing.assert_allclose(a.doa[:, :2], b.doa[:, :2], atol=1e-9)


def test_run_batch_equals_single_runs() -> None:
    """Missing sensors, missing measurements, zero data, and sequences of unequal length."""
    draws = [
        create("circle", n_bins=3, n_snapshots=2, n_steps=6).sample(np.random.default_rng(seed))
        for seed in range(5)
    ]
    data: list[list[Any]] = [list(trial.measurements) for trial in draws]
    data[0][3] = None
    data[1][2] = np.where(np.arange(8) == 6, np.nan, data[1][2])
    data[2][4] = np.zeros_like(data[2][4])
    data[3] = data[3][:4]
    for name in ("svalse", "valse"):
        tracker = draws[0].tracker(name)
        for z, run in zip(data, tracker.run_batch(data), strict=True):
            alone = copy.deepcopy(tracker).run(z)
            assert alone.n_found.tolist() == run.n_found.tolist()
            assert alone.iterations.tolist() == run.iterations.tolist()
            np.testing.assert_allclose(run.doa, alone.doa, atol=1e-9)
            np.testing.assert_allclose(run.noise, alone.noise, rtol=1e-8)


def test_mirrored_angle_is_reported_and_tracked_in_front() -> None:
    """A source moves to endfire and back."""
    doa = np.deg2rad([[80.0], [84.0], [88.0], [89.0], [86.0], [82.0], [78.0]])
    model = SPARSE.replace(array=SensorArray(0.45 * np.arange(8.0)))
    tracker = SVALSE(model, SLOW)
    run = tracker.run(snapshots_of(model, doa, noise=1e-3))
    assert (run.n_found == 1).all()
    np.testing.assert_allclose(np.rad2deg(run.doa[:, 0]), np.rad2deg(doa[:, 0]), atol=4.0)
    assert np.nanmax(np.abs(tracker.mu)) <= np.pi / 2


def test_floors_of_power_and_noise_hold() -> None:
    z = snapshots_of(SEVERAL, [[0.3, -2.0]], noise=1e-4)[0]
    tracker = VALSE(SEVERAL, solver=NewtonSolver(max_snr_db=10.0))
    tracker.update(z)
    power = (np.abs(z) ** 2).mean(axis=(1, 2))
    assert (tracker.bin_noise >= 0.1 * power * (1 - 1e-9)).all()
    weak = snapshots_of(SEVERAL, [[0.3]], noise=3.0, seed=1)[0]
    for floor, result in ((0.0, True), (1e3, False)):
        tracker = VALSE(SEVERAL, solver=NewtonSolver(power_floor=floor))
        tracker.update(weak)
        assert (tracker.estimate.n_found > 0) is result


def test_noise_of_many_snapshots_is_that_of_the_small_eigenvalues() -> None:
    rng = np.random.default_rng(0)
    for noise in (0.01, 1.0):
        model = CIRCLE.replace(n_snapshots=400, noise=noise)
        Y = model.snapshots(model.simulate([0.3, -2.0], rng.standard_normal((400, 2)) + 0j, rng))
        assert noise_from_eigenvalues(Y)[0] == pytest.approx(noise, rel=0.3)


# -- figures, small versions of benchmarks/any_array.py -----------------------------------------


@pytest.mark.parametrize(
    ("scenario", "numbers", "limit"),
    [
        ("circle", {"n_bins": 10, "snr_db": 10.0}, 4.8),
        ("circle", {"n_bins": 10, "snr_db": 0.0}, 12.0),
        ("circle", {"n_snapshots": 10, "snr_db": 10.0}, 4.8),
        ("grating", {"n_bins": 5, "n_sources": 2}, 0.34),
        ("grating", {"n_bins": 10, "hopping": True, "n_sources": 2}, 6.28),
    ],
)
def test_gospa_equals_the_specification(
    scenario: str, numbers: dict[str, Any], limit: float
) -> None:
    """Over six seeds 4.3, 10.7, 4.3, 0.20 and 2.0; the last limit is of whole posteriors."""
    draws = [create(scenario, **numbers).sample(np.random.default_rng(n)) for n in range(4)]
    runs = draws[0].tracker("svalse").run_batch([trial.measurements for trial in draws])
    result = [
        mean_gospa(np.rad2deg(t.truth), np.rad2deg(run.doa), c=10.0, period=360.0).total
        for t, run in zip(draws, runs, strict=True)
    ]
    assert np.mean(result) < limit


# -- caches, and arrays of few valid sensors ------------------------------------------------------


def test_one_valid_sensor_gives_noise_and_no_direction() -> None:
    model = ArraySnapshot(SensorArray.uca(8, radius=0.65), [1.0, 1.25], n_snapshots=3)
    rng = np.random.default_rng(0)
    z = rng.standard_normal((2, 3, 8)) + 1j * rng.standard_normal((2, 3, 8))
    z[:, :, 1:] = np.nan
    tracker = SVALSE(model)
    tracker.update(z)
    power = (np.abs(z[:, :, 0]) ** 2).mean(axis=1)
    assert tracker.estimate.doa.size == 0
    np.testing.assert_allclose(tracker.bin_noise, power)
    assert tracker.noise == pytest.approx(power.mean())


def test_support_search_is_built_once_for_each_set_of_sensors() -> None:
    for array in (SensorArray.ula(8, 0.5), SensorArray.uca(8, radius=0.65)):
        model = ArraySnapshot(array, 1.0, noise=0.01)
        z = model.simulate([0.3], np.ones((6, 1)), np.random.default_rng(0))
        z[:, 3] = np.nan
        support_search.cache_clear()
        SVALSE(model).run(z)
        assert support_search.cache_info().misses == 1


@pytest.mark.parametrize("name", ["max_components", "power_floor", "max_snr_db"])
def test_settings_are_kept_as_python_numbers(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(8, 0.5), 1.0)
    tracker = SVALSE(model).set_params(**{f"solver__{name}": np.int64(3)})
    assert type(getattr(tracker.solver, name)) is (int if name == "max_components" else float)
