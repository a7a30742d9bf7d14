"""SVALSE and VALSE on circles, sparse lines, directional elements, and several snapshots a step."""

import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios import Trial, create, mean_gospa
from arrivals.trackers import CBF, SVALSE, VALSE, CoordinateSolver, NewtonSolver, Run
from arrivals.typing import Complex, Float

CIRCLE = ArraySnapshot(SensorArray.uca(8, radius=0.65), wavelength=1.0)
SEVERAL = CIRCLE.replace(wavelength=[1.0, 1.3], n_snapshots=3)
MIXTURE = CoordinateSolver(posterior="mixture")
SLOW = BernoulliVonMises(sigma_doa=np.deg2rad(3.0))


def snapshots_of(
    model: ArraySnapshot, doa: ArrayLike, noise: float = 1e-3, seed: int = 0
) -> Complex:
    """Measurements of sources with amplitudes ~ CN(0, 1) kept off zero, in every snapshot."""
    rng = np.random.default_rng(seed)
    doa = np.atleast_2d(np.asarray(doa, dtype=float))
    shape = (len(doa), *model.shape[:-1], doa.shape[1])
    w = np.exp(2j * np.pi * rng.random(shape)) * rng.uniform(0.7, 1.3, shape)
    return model.replace(noise=noise).simulate(doa, w, rng)


def short(seed: int = 0, n_steps: int = 4, **numbers: Any) -> Trial:
    return create("circle", n_steps=n_steps, **numbers).sample(np.random.default_rng(seed))


def total(trial: Trial, run: Run) -> float:
    truth, result = np.rad2deg(trial.truth), np.rad2deg(run.doa)
    return mean_gospa(truth, result, c=10.0, period=360.0).total


def wrapped(angle: Any) -> Float:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


# -- laws ---------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=6)
@given(st.floats(-7, 7), st.integers(0, 99))
def test_turning_array_and_sources_turns_every_angle_of_coordinate_ascent(
    turn: float, seed: int
) -> None:
    """Specification, section 11: 3e-15 rad and equal iterations; tolerance wider."""
    rng = np.random.default_rng(seed)
    places = rng.normal(size=(6, 2)) * 0.6
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    one, other = (ArraySnapshot(SensorArray(p), 1.0) for p in (places, places @ R.T))
    z = snapshots_of(one, [[0.3, -2.0]] * 3, noise=0.01, seed=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # some layouts drawn are ambiguous
        a, b = (SVALSE(model, SLOW, engine="coordinate").run(z) for model in (one, other))
    assert a.iterations.tolist() == b.iterations.tolist()
    np.testing.assert_allclose(wrapped(b.doa - a.doa - turn), 0 * a.doa, atol=1e-7)


@pytest.mark.parametrize("model", [CIRCLE, SEVERAL], ids=["one snapshot", "several"])
@pytest.mark.parametrize("factor", [1e-7, 3e6 * np.exp(2j)])
def test_estimates_are_invariant_to_scale_and_common_phase(
    model: ArraySnapshot, factor: complex
) -> None:
    z = snapshots_of(model, [[0.3, -2.0, 3.1]] * 3, noise=0.02)
    one, other = SVALSE(model, SLOW).run_batch([z, factor * z])
    np.testing.assert_allclose(other.doa, one.doa, atol=1e-8)
    assert other.iterations.tolist() == one.iterations.tolist()


@pytest.mark.parametrize("model", [CIRCLE, SEVERAL], ids=["one snapshot", "several"])
def test_missing_sensor_equals_the_array_without_it(model: ArraySnapshot) -> None:
    z = snapshots_of(model, [[0.3, -2.0]] * 3, noise=0.02)
    z[..., 2] = np.nan
    without = model.replace(array=model.array.without([2]))
    one = SVALSE(model, SLOW).run(z)
    other = SVALSE(without, SLOW).run(np.delete(z, 2, axis=-1))
    np.testing.assert_allclose(one.doa, other.doa, atol=1e-12)
    np.testing.assert_allclose(one.amplitude, other.amplitude, atol=1e-12)


def test_estimates_are_invariant_to_the_order_of_bins_and_snapshots() -> None:
    z = snapshots_of(SEVERAL, [[0.3, -2.0]] * 3, noise=0.05)
    turned = SEVERAL.replace(wavelength=SEVERAL.wavelengths[::-1])
    one, other = SVALSE(SEVERAL, SLOW).run(z), SVALSE(turned, SLOW).run(z[:, ::-1, [2, 0, 1]])
    np.testing.assert_allclose(one.doa, other.doa, atol=1e-9)


def test_missing_bin_and_snapshot_equal_the_model_without_them() -> None:
    z = snapshots_of(SEVERAL, [[0.3, -2.0]] * 3, noise=0.05)
    part = SEVERAL.replace(wavelength=1.3, n_snapshots=2)
    expected = SVALSE(part, SLOW).run(z[:, 1, 1:])
    gaps = z.copy()
    gaps[:, 0], gaps[:, :, 0] = np.nan, np.nan
    np.testing.assert_allclose(SVALSE(SEVERAL, SLOW).run(gaps).doa, expected.doa, atol=1e-12)
    damaged = z.copy()
    damaged[:, 0], damaged[:, :, 0] = 0, np.nan
    np.testing.assert_allclose(SVALSE(SEVERAL, SLOW).run(damaged).doa, expected.doa, atol=1e-12)


def test_tempering_by_the_number_of_snapshots_equals_one_snapshot() -> None:
    """The same snapshot ten times over, counted once: equal support and angles."""
    z = snapshots_of(CIRCLE, [[0.3, -2.0]], noise=0.05)
    ten = CIRCLE.replace(n_snapshots=10)
    one, other = VALSE(CIRCLE), VALSE(ten, solver=NewtonSolver(tempering=10.0, power_floor=0.0))
    one.update(z[0])
    other.update(np.repeat(z, 10, axis=0))
    np.testing.assert_allclose(other.estimate.doa, one.estimate.doa, atol=1e-6)
    assert (other.estimate.std < one.estimate.std).all()  # the noise of ten is known better


@pytest.mark.parametrize("reference", ["middle", "first"])
def test_fourier_and_electrical_form_of_a_line_agree(reference: Any) -> None:
    line = ArraySnapshot(SensorArray.ula(11, 0.5), 1.0)
    z = snapshots_of(line, [[-0.7, 0.1, 0.9]] * 4, noise=1e-3)
    motion = BernoulliVonMises(sigma_doa=np.deg2rad(1.5))
    settings: dict[str, Any] = {"engine": "coordinate", "reference": reference}
    one = SVALSE(line, motion, **settings).run(z)
    other = SVALSE(line.replace(angle="doa"), motion, **settings).run(z)
    for step in (1, 2, 3):  # the first has no memory, and either may split a source in it
        a, b = one.estimate(step), other.estimate(step)
        order, other_order = np.argsort(a.doa), np.argsort(b.doa)  # type: ignore[attr-defined]
        for name, rtol in (("doa", 5e-3), ("std", 0.1), ("amplitude", 0.02)):
            result, expected = getattr(b, name)[other_order], getattr(a, name)[order]
            np.testing.assert_allclose(result, expected, rtol=rtol)


def test_whole_posterior_and_von_mises_density_of_a_line_agree() -> None:
    """Specification, section 11: 5.57 and 5.57 on Fig. 4; its directions are unambiguous."""
    trial = create("svalse_fig4", n_steps=6).sample(np.random.default_rng(1))
    never = trial.motion.replace(still=0.0)  # stops
    one = trial.tracker("svalse", engine="coordinate", motion=never).run(trial.measurements)
    other = trial.tracker("svalse", memory="posterior", motion=never).run(trial.measurements)
    np.testing.assert_allclose(np.sort(other.doa[:, :4]), np.sort(one.doa[:, :4]), atol=0.05)


def test_amplitudes_reproduce_the_snapshot() -> None:
    array = SensorArray(CIRCLE.array.positions + np.array([3.0, -2.0]))
    model = ArraySnapshot(array, 1.0)
    z = snapshots_of(model, [[0.3, -2.0]], noise=1e-8)[0]
    tracker = VALSE(model, solver=NewtonSolver(tolerance=1e-8))
    tracker.update(z)
    result = tracker.estimate
    np.testing.assert_allclose(result.amplitude @ model.steering_vector(result.doa), z, atol=1e-3)


# -- detected sources ------------------------------------------------------------------------------


def test_label_is_constant_through_180_degrees() -> None:
    doa = np.deg2rad(160 + 3 * np.arange(14.0))[:, None]
    run = SVALSE(CIRCLE, SLOW).run(snapshots_of(CIRCLE, doa))
    track = np.where(run.label == 0, run.doa, np.nan)[:, 0]
    np.testing.assert_allclose(wrapped(track - doa[:, 0]), 0, atol=0.05)
    assert track.min() < -2.9 < 2.9 < track.max()


def test_near_sources_across_180_degrees_are_merged() -> None:
    z = snapshots_of(CIRCLE, [np.deg2rad([179.6, -179.6])] * 3, noise=1e-7)
    near = SVALSE(CIRCLE, SLOW).run(z).doa
    gaps = np.abs(wrapped(near[:, :, None] - near[:, None])) + 9 * np.eye(near.shape[1])
    assert np.nanmin(gaps) >= np.deg2rad(1.5)


def test_zero_data_are_missing() -> None:
    z = snapshots_of(SEVERAL, [[0.3]] * 4)
    z[[0, 2]] = 0
    run = SVALSE(SEVERAL, SLOW).run(z)
    expected = SVALSE(SEVERAL, SLOW).run([None, z[1], None, z[3]])
    assert run.n_found.tolist() == [0, 1, 1, 1]
    np.testing.assert_array_equal(run.doa, expected.doa)


def test_snapshot_without_noise_has_one_source() -> None:
    run = SVALSE(SEVERAL, SLOW).run(snapshots_of(SEVERAL, [[0.3]] * 3, noise=1e-30))
    assert run.n_found.tolist() == [1] * 3
    np.testing.assert_allclose(run.doa, 0.3, atol=1e-5)


def test_unknown_slowness_is_estimated_and_tracked() -> None:
    grid = [0.7, 0.85, 1.0, 1.15]
    truth = CIRCLE.replace(wavelength=[1.0 / 0.85, 1.3 / 0.85], n_snapshots=3)
    model = SEVERAL.replace(slowness=grid)
    tracker = SVALSE(model, SLOW)
    run = tracker.run(snapshots_of(truth, [[0.3]] * 4, noise=0.05))
    np.testing.assert_allclose(run.doa[:, 0], 0.3, atol=0.03)
    assert np.argmax(tracker.nuisance[0]) == 1
    before = tracker.nuisance[0]
    tracker.predict()
    np.testing.assert_allclose(tracker.nuisance[0, 1] / before[1], 0.9, atol=0.02)
    np.testing.assert_allclose(tracker.nuisance.sum(axis=1), 1)


def test_unknown_elevation_is_estimated() -> None:
    array = SensorArray(np.random.default_rng(5).normal(size=(8, 3)) * 0.6)
    model = ArraySnapshot(array, [1.0, 1.3], elevation=[0.0, 0.5, 1.0])
    a = model.waves.steering([0.3])[1, :, :, 0]  # of the second value
    rng = np.random.default_rng(0)
    z = rng.standard_normal((4, 2, 1)) * a + 0.05 * rng.standard_normal((4, 2, 8))
    tracker = SVALSE(model, SLOW)
    run = tracker.run(z)
    np.testing.assert_allclose(run.doa[1:, 0], 0.3, atol=0.02)
    assert np.argmax(tracker.nuisance[0]) == 1


def test_one_frequency_a_step_is_ambiguous_until_others_follow() -> None:
    """Section 11: hopping; here one source, seen from the tenth step on."""
    forms: dict[str, dict[str, Any]] = {
        "fast": {},
        "von_mises": {"engine": "coordinate"},
        "posterior": {"memory": "posterior"},
    }
    result: dict[str, list[float]] = {form: [] for form in forms}
    scene = create("grating", n_bins=10, hopping=True, n_steps=25)
    for seed in range(2):
        trial = scene.sample(np.random.default_rng(seed))
        for form, totals in result.items():
            tracker = trial.tracker(
                "svalse",
                motion=trial.motion.replace(still=0.0),
                solver=NewtonSolver(max_iterations=60),
                **forms[form],
            )
            run = tracker.run(trial.measurements)
            late = mean_gospa(np.rad2deg(trial.truth[10:]), np.rad2deg(run.doa[10:]), c=10.0)
            totals.append(late.total)
    assert np.mean(result["fast"]) < 1.0
    assert np.mean(result["posterior"]) < 4.0
    assert np.mean(result["posterior"]) <= np.mean(result["von_mises"]) + 1.0


def test_several_frequencies_resolve_the_ambiguity_at_once() -> None:
    trial = create("grating", n_bins=5, n_steps=6, n_sources=2).sample(np.random.default_rng(0))
    run = trial.tracker("svalse").run(trial.measurements)
    g = mean_gospa(np.rad2deg(trial.truth), np.rad2deg(run.doa), c=10.0)
    assert g.total < 0.6


def test_number_of_sources_needs_the_right_element_responses() -> None:
    counts: dict[bool, list[bool]] = {}
    for known in (True, False):
        trial = create("cardioids", known=known, n_steps=15).sample(np.random.default_rng(0))
        counts[known] = []
        for z in trial.measurements:
            tracker = trial.tracker("svalse")
            tracker.update(z)
            counts[known].append(tracker.estimate.n_found == 2)
    assert np.mean(counts[True]) > 0.7
    assert np.mean(counts[False]) < 0.5


# -- golden figures, small versions of benchmarks/any_array.py --------------------------------


@pytest.mark.parametrize(
    ("numbers", "svalse", "valse"),
    [({}, 6.7, 12.6), ({"n_snapshots": 10}, 1.8, 2.9), ({"n_bins": 10}, 2.0, 2.7)],
    ids=["one snapshot", "ten snapshots", "ten bins"],
)
def test_gospa_on_the_circle_at_20_db(numbers: dict[str, Any], svalse: float, valse: float) -> None:
    """The specification's means of whole runs; single runs of 20 steps scatter by a quarter."""
    trial = short(0, 20, **numbers)
    ours = total(trial, trial.tracker("svalse").run(trial.measurements))
    alone = total(
        trial, trial.tracker("valse", solver=NewtonSolver(merge=0.026)).run(trial.measurements)
    )
    assert ours < 1.4 * svalse
    assert alone < 1.4 * valse
    assert ours < 1.1 * alone
    beam = total(trial, CBF(trial.measurement, threshold_db=3.0).run(trial.measurements))  # type: ignore[arg-type]
    assert ours < 0.6 * beam


# -- rejected arguments and warnings -------------------------------------------------------------


def test_sparse_line_warns_of_two_ambiguous_directions() -> None:
    model = ArraySnapshot(SensorArray.ula(8, 2.0), 1.0)
    for kind in (SVALSE, VALSE):
        with pytest.warns(UserWarning, match=r"directions -90\.0 and -30\.0 degrees are ambiguous"):
            kind(model)


@pytest.mark.parametrize(
    ("model", "params", "message"),
    [
        (
            CIRCLE,
            {"solver": MIXTURE},
            "requires a line on a uniform grid, at one wavelength; got .*: the general form is "
            'posterior="quadrature"',
        ),
        (
            ArraySnapshot(SensorArray.ula(8, 0.5), [1.0, 1.1]),
            {"solver": MIXTURE},
            "at one wavelength; got .*: the general form",
        ),
        (CIRCLE, {"memory": "all"}, "memory must be one of 'von_mises', 'posterior'"),
        (
            ArraySnapshot(SensorArray.ula(8, 0.5), 1.0, n_snapshots=2),
            {"solver": MIXTURE},
            "requires one snapshot a step; got 2 at 1 wavelengths: the general form",
        ),
        (
            ArraySnapshot(SensorArray.ula(8, 0.5), 1.0),
            {"solver": MIXTURE, "memory": "posterior"},
            'requires memory="von_mises"; got memory="posterior": the general form is',
        ),
        (ArraySnapshot(SensorArray.uca(2, 0.5), 1.0), {}, "at least 3 sensors"),
    ],
)
def test_incompatible_parts_are_rejected(
    model: ArraySnapshot, params: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        SVALSE(model, SLOW, **params)


def test_rejected_measurement_leaves_the_belief_unchanged() -> None:
    tracker = SVALSE(SEVERAL, SLOW)
    tracker.run(snapshots_of(SEVERAL, [[0.3]] * 2))
    before = {name: getattr(tracker, name) for name in ("mu", "bin_noise", "nuisance", "estimate")}
    turns = snapshots_of(SEVERAL, [[0.3]])[0]
    turns.reshape(6, 8)[np.arange(8) % 6, np.arange(8)] = np.nan
    for bad in (np.ones(8), np.ones((3, 2, 8)), turns):
        with pytest.raises(ValueError, match="z must have"):
            tracker.update(bad)
    assert all(getattr(tracker, name) is value for name, value in before.items())


def test_step_with_few_valid_sensors_counts_as_missing() -> None:
    z = snapshots_of(SEVERAL, [[-0.5, 1.0, 2.5]] * 6)
    z[3, ..., 2:] = np.nan
    run = SVALSE(SEVERAL, SLOW).run(z)
    assert run.iterations[3] == 0
    assert set(run.label[5][run.label[5] >= 0]) == {0, 1, 2}
