"""SVALSE and VALSE beyond the conformance list."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from svalse_scenes import COORDINATE, LINE, MIXTURE, gospa_deg, short, tone

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.manifold import Reference
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios import create
from arrivals.trackers import SVALSE, VALSE, NewtonSolver

# -- laws of section 12.6 ---------------------------------------------------------------------


@settings(deadline=None, max_examples=8)
@given(st.floats(-8, 8), st.floats(0, 6.28), st.sampled_from([{}, COORDINATE, MIXTURE]))
def test_estimates_are_invariant_to_scale_and_common_phase(
    log10: float, phase: float, form: dict[str, Any]
) -> None:
    trial = short(1, 2)
    tracker = SVALSE(LINE, **form)
    one, other = tracker.run_batch(
        [trial.measurements, trial.measurements * 10**log10 * np.exp(1j * phase)]
    )
    np.testing.assert_allclose(other.doa, one.doa, atol=1e-8)
    assert other.iterations.tolist() == one.iterations.tolist()


@pytest.mark.parametrize("form", [{}, COORDINATE, MIXTURE])
@pytest.mark.parametrize("reference", ["first", "middle"])
def test_conjugation_mirrors_every_direction(form: dict[str, Any], reference: Any) -> None:
    trial = short(2, 3)
    tracker = SVALSE(LINE, reference=reference, **form)
    one, other = tracker.run_batch([trial.measurements, trial.measurements.conj()])
    np.testing.assert_allclose(-other.doa, one.doa, atol=1e-8)
    np.testing.assert_array_equal(other.label, one.label)


def test_reversed_line_mirrors_every_direction() -> None:
    """The reversed line receives from -β the snapshot that the line receives from β."""
    trial = short(3, 3)
    reversed_line = LINE.replace(array=SensorArray(-LINE.array.positions))
    one = SVALSE(LINE).run(trial.measurements)
    other = SVALSE(reversed_line).run(trial.measurements)
    np.testing.assert_allclose(-other.doa, one.doa, atol=1e-9)


def test_array_shifted_along_its_line_has_equal_estimates() -> None:
    trial = short(3, 3)
    moved = LINE.replace(array=SensorArray(LINE.array.positions + 12.3))
    one, other = SVALSE(LINE).run(trial.measurements), SVALSE(moved).run(trial.measurements)
    np.testing.assert_allclose(other.doa, one.doa, atol=1e-9)
    np.testing.assert_allclose(np.abs(other.amplitude), np.abs(one.amplitude), atol=1e-9)


@pytest.mark.parametrize("dead", [[0], [7], [3, 4, 14]])
def test_missing_sensor_equals_the_array_without_it(dead: list[int]) -> None:
    z = short(4, 3).measurements.copy()
    z[:, dead] = [np.nan, np.inf, complex(0, np.nan)][: len(dead)]
    without = LINE.replace(array=LINE.array.without(dead))
    one = SVALSE(LINE).run(z)
    other = SVALSE(without).run(np.delete(z, dead, axis=1))
    np.testing.assert_allclose(one.doa, other.doa, atol=1e-12)
    np.testing.assert_allclose(one.amplitude, other.amplitude, atol=1e-12)


@pytest.mark.parametrize("reference", ["first", "middle"])
def test_amplitudes_reproduce_the_snapshot(reference: Reference) -> None:
    model = LINE.replace(array=SensorArray.ula(14, 0.5, missing=[2]))
    y = tone([-0.6, 0.1, 0.9], noise=1e-8, model=model)[0]
    tracker = VALSE(model, reference=reference, solver=NewtonSolver(tolerance=1e-8))
    tracker.update(y)
    result = tracker.estimate
    a = model.array.steering_vector(result.doa, 1.0)
    np.testing.assert_allclose(result.amplitude @ a, y, atol=1e-3)


@pytest.mark.parametrize(
    ("scale", "n_found"), [(1e-200, 0), (1e-130, 1), (1e130, 1), (1e200, 0), (np.inf, 0)]
)
def test_data_beyond_the_limits_of_floats_are_missing(scale: float, n_found: int) -> None:
    z = tone([0.3], noise=1e-3)[0]
    for tracker in (SVALSE(LINE), VALSE(LINE)):
        tracker.update(np.full(15, np.inf) if scale == np.inf else z * scale)
        assert tracker.estimate.n_found == n_found


# -- detected sources ----------------------------------------------------------------------------


def test_asymmetric_scene_has_the_steering_sign() -> None:
    run = SVALSE(LINE).run(tone([[0.2, 0.9]] * 3, noise=1e-3))
    np.testing.assert_allclose(np.sort(run.doa[-1, :2]), [0.2, 0.9], atol=5e-3)


def test_snapshot_without_noise_has_one_source_and_no_warning() -> None:
    z = LINE.array.steering_vector(np.full(5, 0.4), 1.0)
    run = SVALSE(LINE).run(z)
    assert run.n_found.tolist() == [1] * 5
    np.testing.assert_allclose(run.doa[:, 0], 0.4, atol=1e-6)


@pytest.mark.parametrize("n_sensors", [2, 3, 4, 8])
def test_arrays_of_few_and_even_numbers_of_sensors_run(n_sensors: int) -> None:
    model = LINE.replace(array=SensorArray.ula(n_sensors, spacing=0.5))
    for tracker in (SVALSE(model), SVALSE(model, **COORDINATE), SVALSE(model, **MIXTURE),
                    VALSE(model), VALSE(model, **COORDINATE)):  # fmt: skip
        if isinstance(tracker, SVALSE) or n_sensors > 2:  # no lags to estimate the noise from
            run = tracker.run(tone([[0.3]] * 4, noise=1e-4, model=model))
            assert run.n_found.max() <= n_sensors - 1
            np.testing.assert_allclose(run.doa[-1, 0], 0.3, atol=0.05)


def test_zero_data_are_missing_without_a_warning() -> None:
    z = tone([0.1], 1e-3)[0]
    run = SVALSE(LINE).run([np.zeros(15), z, np.zeros(15)])
    assert run.n_found.tolist() == [0, 1, 1]
    np.testing.assert_array_equal(run.std, SVALSE(LINE).run([None, z, None]).std)


def test_line_with_gaps_resolves_by_its_whole_aperture() -> None:
    """Six sensors with high sidelobes: 11 of 20 seeds with the Newton solver, 16 with the other."""
    array = SensorArray(np.array([0, 1, 4, 9, 11, 14]) * 0.5)  # a sparse ruler
    model = LINE.replace(array=array)
    run = SVALSE(model, **COORDINATE).run(tone([[-0.10, 0.05]] * 6, noise=1e-4, model=model))
    np.testing.assert_allclose(np.sort(run.doa[-1, :2]), [-0.10, 0.05], atol=0.01)
    array = SensorArray(np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 11, 14, 15, 19]) * 0.5)
    model = LINE.replace(array=array)
    doa = [-0.6, -0.1, 0.0, 0.7]
    for tracker in (SVALSE(model), SVALSE(model, **COORDINATE)):
        run = tracker.run(tone([doa] * 6, noise=1e-4, model=model))
        np.testing.assert_allclose(np.sort(run.doa[-1, :4]), doa, atol=0.01)


def test_unphysical_angles_below_half_a_wavelength_are_not_reported() -> None:
    close = ArraySnapshot(SensorArray.ula(16, spacing=0.2), wavelength=1.0)
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((30, 16)) + 1j * rng.standard_normal((30, 16))
    tracker = SVALSE(close)
    beyond = 0
    for z in noise:
        tracker.predict()
        tracker.update(z)
        theta = tracker.mu[tracker.tracked]
        beyond += (np.abs(theta) > 2 * np.pi * 0.2 + 0.5).sum()
        doa = tracker.estimate.doa
        assert np.isfinite(doa).all()
        assert (np.abs(doa) <= np.pi / 2).all()
    assert beyond > 0  # there was something to leave out


def test_source_at_endfire_is_reported_at_endfire() -> None:
    close = ArraySnapshot(SensorArray.ula(16, spacing=0.25), wavelength=1.0)
    run = SVALSE(close).run(tone([[np.pi / 2]] * 10, noise=0.03, model=close))
    assert (run.n_found >= 1).all()
    assert (run.doa[:, 0] > np.deg2rad(75)).all()
    assert np.isfinite(run.std[:, 0]).all()


def test_prediction_outside_the_physical_range_is_not_reported() -> None:
    close = ArraySnapshot(SensorArray.ula(16, spacing=0.2), wavelength=1.0)
    tracker = SVALSE(close)
    tracker.run(tone([[0.3]] * 2, noise=1e-3, model=close))
    outside = tracker.mu.copy()
    outside[0] = 3.0  # 2π d/λ is 1.26
    tracker.mu = outside
    tracker.predict()
    assert tracker.estimate.n_found == 0


# -- reported estimates ---------------------------------------------------------------------


def test_existence_and_standard_deviations_follow_the_noise() -> None:
    z = tone([[-0.5, 0.5]] * 10, noise=1e-4)
    z += 0.2 * tone([[1.1]] * 10, noise=1e-9, seed=1)
    run = SVALSE(LINE).run(z)
    faint = SVALSE(LINE).run(z + tone([[]] * 10, noise=0.05, seed=2))
    is_strong, is_weak = np.abs(faint.amplitude) > 0.5, np.abs(faint.amplitude) < 0.4
    assert np.abs(run.amplitude[run.label >= 0]).min() == pytest.approx(0.2, abs=0.05)
    assert faint.existence[is_strong].min() > np.median(faint.existence[is_weak])
    loud = VALSE(LINE).run(tone([[0.4]] * 20, noise=0.1)).std[:, 0]
    quiet = VALSE(LINE).run(tone([[0.4]] * 20, noise=0.001)).std[:, 0]
    np.testing.assert_allclose(np.median(loud) / np.median(quiet), 10, rtol=0.3)


def test_standard_deviation_of_a_single_source_is_consistent() -> None:
    """The marginal one does not depend on the sensor at which amplitudes are counted."""
    errors = {}
    references: list[Reference] = ["middle", "first"]
    for reference in references:
        tracker = VALSE(LINE, reference=reference, solver=NewtonSolver(tolerance=1e-6))
        run = tracker.run(tone([[0.4]] * 200, noise=0.02))
        best = np.nanargmin(np.abs(run.doa - 0.4), axis=1)[:, None]
        error = np.take_along_axis(run.doa - 0.4, best, axis=1)
        std = np.take_along_axis(run.std, best, axis=1)
        errors[reference] = float(np.sqrt(np.mean((error / std) ** 2)))
    assert 0.9 < errors["middle"] < 1.2
    assert errors["first"] == pytest.approx(errors["middle"], rel=0.01)


def test_step_that_does_not_converge_is_reported() -> None:
    z = short(0, 1).measurements
    run = SVALSE(LINE, solver=NewtonSolver(max_iterations=3)).run(z)
    assert run.converged.tolist() == [False]
    assert run.iterations.tolist() == [3]
    assert SVALSE(LINE).run(z).converged.all()


def test_limit_cycle_of_merging_is_stopped_and_reported() -> None:
    """Two sources half a degree apart: the search reactivates what merging removes."""
    z = tone([[0.0, np.deg2rad(0.5)]] * 5, noise=1e-3)
    run = SVALSE(LINE, BernoulliVonMises(), **COORDINATE).run(z)
    assert run.iterations[~run.converged].tolist() == pytest.approx([120, 120], abs=10)
    assert run.converged.sum() == 3
    assert SVALSE(LINE).run(z).converged.all()  # the Newton solver cannot cycle: its record rises


def test_components_without_power_at_0_db_remain_and_the_step_is_reported() -> None:
    """Section 12.4 attributes these steps to merging, but no components merge in them.

    Tracked components without a source share a variance τ that converges to zero, and with it the
    evidence against them: their prior odds of 3 to 1 keep them active at decreasing power.
    """
    trial = create("svalse_scenario2", snr_db=0.0, n_steps=20).sample(np.random.default_rng(4))
    tracker = trial.tracker("svalse", motion=BernoulliVonMises(), **COORDINATE)
    runs = [
        tracker.set_params(solver__merge=m).run_batch([trial.measurements])[0] for m in (0.0, 0.026)
    ]
    for run in runs:
        starved = ~run.converged
        assert starved.sum() >= 3
        assert run.iterations[starved].min() == 500
        power = np.nansum(np.abs(run.amplitude[starved]) ** 2, axis=1) * 15
        assert (power < 0.1 * run.noise[starved]).all()


# -- golden figures, small versions of benchmarks/svalse_figures.py ---------------------------


@pytest.mark.parametrize(
    ("name", "svalse", "walk", "valse"),
    [
        ("svalse_fig4", 6.3, 5.4, 14.4),
        ("svalse_fig5", 3.2, 3.15, 4.8),
        ("svalse_fig6", 2.8, 2.6, 5.1),
    ],
)
def test_coordinate_ascent_on_figures_4_to_6(
    name: str, svalse: float, walk: float, valse: float
) -> None:
    """Limits of the 20-seed means, widened by two standard deviations of a run."""
    trial = create(name).sample(np.random.default_rng(1))
    means = [
        gospa_deg(trial, tracker.run(trial.measurements))
        for tracker in (
            SVALSE(LINE, BernoulliVonMises(), **COORDINATE),
            SVALSE(LINE, BernoulliVonMises()),
            VALSE(LINE, **COORDINATE),
        )
    ]
    assert means[0] < svalse + 1.0
    assert means[1] < walk + 0.8
    assert means[2] < valse + 1.0
    assert means[0] < 0.9 * means[2]


@pytest.mark.parametrize("span", [100, 257, 400])
def test_long_sparse_lines_run(span: int) -> None:
    places = np.unique(
        np.concatenate([[0, 1, span], np.random.default_rng(1).integers(2, span, 10)])
    )
    model = LINE.replace(array=SensorArray(0.5 * places))
    z = tone([[0.2]] * 2, noise=1e-3, model=model)
    for tracker in (SVALSE(model), VALSE(model)):
        np.testing.assert_allclose(tracker.run(z).doa[:, 0], 0.2, atol=0.01)
