"""Several bins and snapshots a step: subspace methods, mvdr, sbl and ssbl."""

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.trackers import MUSIC, MVDR, PAST, SBL, Run, create
from arrivals.trackers.beamforming.covariance import used_data
from arrivals.trackers.beamforming.incomplete import PatternSums
from arrivals.trackers.beamforming.source_number import mdl, number_of_sources
from arrivals.trackers.sparse_bayes import FixedPointSolver
from arrivals.typing import Complex

SUBSPACE = ("music", "root_music", "esprit", "past")
COVARIANCE = ("music", "root_music", "esprit", "mvdr")
ALL = (*SUBSPACE, "mvdr", "sbl", "ssbl")
LINE = ArraySnapshot(SensorArray.ula(6, 0.5), [1.0, 1.3, 1.7, 0.8], noise=0.01, n_snapshots=5)
CIRCLE = ArraySnapshot(SensorArray.uca(6, 0.5), [1.0, 1.3, 1.7], noise=0.01, n_snapshots=5)
ONE_BIN = LINE.replace(wavelength=1.0)
DOA = [-0.5, 0.3]
QUICK: dict[str, Any] = {"n_directions": 181, "solver": FixedPointSolver(max_iterations=60)}


def sources(
    model: ArraySnapshot, doa: list[float] = DOA, n_steps: int = 8, seed: int = 0
) -> Complex:
    """Return steps of independent Gaussian sources."""
    rng = np.random.default_rng(seed)
    w = rng.standard_normal((n_steps, *model.shape[:-1], len(doa), 2)) @ np.array([1, 1j])
    return model.simulate(np.tile(doa, (n_steps, 1)), w / np.sqrt(2), rng)


def last_doa(name: str, model: ArraySnapshot, z: Complex, **params: Any) -> Any:
    """Return the directions after the last step, in rising order."""
    if "sbl" in name:
        params |= QUICK
    run = create(name, measurement=model, **params).run(z)
    return np.sort(run.doa[-1][~np.isnan(run.doa[-1])])


def single(run: Run, step: int) -> Any:
    doa = run.doa[step]
    return doa[~np.isnan(doa)]


@pytest.mark.parametrize("model", [LINE, CIRCLE], ids=["line", "circle"])
@pytest.mark.parametrize("name", ALL)
def test_two_sources_are_found_in_blocks(name: str, model: ArraySnapshot) -> None:
    if model is CIRCLE and name in ("root_music", "esprit", "past"):
        model = CIRCLE.replace(array=LINE.array)
    params = QUICK if "sbl" in name else {}
    run = create(name, measurement=model, **params).run(sources(model))
    order = np.argsort(single(run, -1))
    np.testing.assert_allclose(single(run, -1)[order], DOA, atol=0.02)
    np.testing.assert_allclose(abs(run.amplitude[-1][:2]), 1.0, atol=0.25)


@pytest.mark.parametrize("model", [LINE, ONE_BIN], ids=["bins", "one bin"])
@pytest.mark.parametrize("name", [*COVARIANCE, "past"])
def test_step_of_snapshots_equals_steps_of_one_without_forgetting(
    name: str, model: ArraySnapshot
) -> None:
    z = sources(model)
    z[2, ..., 1, 3] = np.nan  # a sensor in one snapshot
    each = np.moveaxis(z, -2, 1).reshape(-1, *model.replace(n_snapshots=1).shape)
    whole = create(name, measurement=model, forgetting=1.0)
    apart = create(name, measurement=model.replace(n_snapshots=1), forgetting=1.0)
    whole.run(z)
    apart.run(each)
    np.testing.assert_allclose(whole.x, apart.x, atol=1e-9)


@pytest.mark.parametrize("name", ALL)
def test_order_of_bins_does_not_matter(name: str) -> None:
    z, order = sources(LINE), np.array([2, 0, 3, 1])
    other = LINE.replace(wavelength=np.array(LINE.wavelengths)[order])
    expected = last_doa(name, LINE, z)
    np.testing.assert_allclose(last_doa(name, other, z[:, order]), expected, atol=1e-6)


@pytest.mark.parametrize("name", ALL)
def test_bins_without_data_equal_a_model_of_the_others(name: str) -> None:
    z = sources(LINE)
    expected = last_doa(name, LINE.replace(wavelength=LINE.wavelengths[1:3]), z[:, 1:3])
    gaps = z.copy()
    gaps[:, 0], gaps[:, 3] = np.nan, 0.0
    np.testing.assert_allclose(last_doa(name, LINE, gaps), expected, atol=1e-4)
    gaps[:, 2] = np.nan  # one of several is left
    expected = last_doa(name, LINE.replace(wavelength=LINE.wavelengths[1]), z[:, 1])
    np.testing.assert_allclose(last_doa(name, LINE, gaps), expected, atol=1e-4)


@pytest.mark.parametrize("name", ALL)
def test_sensor_without_data_equals_an_array_without_it(name: str) -> None:
    z = sources(LINE)
    fewer = LINE.replace(array=LINE.array.without([1]))
    expected = last_doa(name, fewer, np.delete(z, 1, axis=-1))
    z[..., 1] = np.nan
    np.testing.assert_allclose(last_doa(name, LINE, z), expected, atol=1e-4)


@pytest.mark.parametrize("name", ALL)
def test_random_gaps_hardly_change_directions(name: str) -> None:
    z = sources(LINE, n_steps=12)
    rng = np.random.default_rng(3)
    z[rng.random(z.shape[:-1]) < 0.2] = np.nan  # bins of snapshots
    z[5, 1, :, 2] = np.nan  # a sensor in one bin
    np.testing.assert_allclose(last_doa(name, LINE, z), DOA, atol=0.015)


@pytest.mark.parametrize("name", [*COVARIANCE, "sbl", "ssbl"])
def test_batch_equals_single_runs(name: str) -> None:
    params = QUICK if "sbl" in name else {}
    tracker = create(name, measurement=LINE, **params)
    sequences = [sources(LINE, n_steps=3, seed=seed) for seed in (1, 2)]
    sequences[1][1, 2] = np.nan
    for run, z in zip(tracker.run_batch(sequences), sequences, strict=True):
        fresh = create(name, measurement=LINE, **params).run(z)
        np.testing.assert_allclose(run.doa, fresh.doa, atol=1e-9)


# independent answers


def brute_force_music(model: ArraySnapshot, z: Complex, K: int) -> Any:
    """Return the normalized MUSIC spectrum of steps (n, F, N, M) on 361 directions of a line."""
    grid = np.linspace(-np.pi / 2, np.pi / 2, 361)
    total = np.zeros(361)
    for f, wavelength in enumerate(model.wavelengths):
        Y = z[:, f].reshape(-1, z.shape[-1])
        E = np.linalg.svd(Y.T)[0][:, K:]
        x = model.array.positions[:, 0]
        a = np.exp(2j * np.pi / wavelength * np.outer(x, np.sin(grid)))
        power = 1 / (np.abs(E.conj().T @ a) ** 2).sum(axis=0)
        total += power / power.max()
    return grid, total / len(model.wavelengths)


def test_music_equals_brute_force() -> None:
    z = sources(LINE)
    tracker = MUSIC(LINE, 2, forgetting=1.0)
    tracker.run(z)
    grid, expected = brute_force_music(LINE, z, 2)
    np.testing.assert_allclose(tracker.doa_grid, grid)
    np.testing.assert_allclose(tracker.power, expected, rtol=1e-6)


def test_mvdr_equals_the_mean_of_capon_powers() -> None:
    z = sources(CIRCLE)
    tracker = MVDR(CIRCLE, forgetting=1.0, loading=0.05)
    tracker.run(z)
    powers = []
    for f in range(CIRCLE.n_bins):
        Y = z[:, f].reshape(-1, 6)
        R = Y.T @ Y.conj() / len(Y)
        R += 0.05 * np.trace(R).real / 6 * np.eye(6)
        a = CIRCLE.array.steering_vector(tracker.doa_grid, CIRCLE.wavelengths[f])
        powers.append(1 / np.einsum("gm,mn,gn->g", a.conj(), np.linalg.inv(R), a).real)
    np.testing.assert_allclose(tracker.power, np.mean(powers, axis=0), rtol=1e-9)


def test_number_of_sources_minimizes_the_sum_of_the_criterion() -> None:
    values = np.array([[9.0, 1.3, 1.0, 0.8], [9.0, 8.0, 1.0, 0.9], [5.0, 1.4, 1.1, 1.0]])
    expected = np.sum([mdl(each, 40) for each in values], axis=0).argmin()
    assert number_of_sources(values, 40, joint=True) == expected


@pytest.mark.parametrize("name", SUBSPACE)
def test_sources_of_different_bins_are_found_with_the_number_given(name: str) -> None:
    model = LINE.replace(wavelength=[1.0, 1.1, 1.2, 1.3], noise=1e-3)
    rng = np.random.default_rng(1)
    w = rng.standard_normal((8, 4, 5, 2, 2)) @ np.array([1, 1j])
    w[:, :2, :, 0], w[:, 2:, :, 1] = 0.0, 0.0  # each source in two of the bins
    z = model.simulate(np.tile(DOA, (8, 1)), w, rng)
    np.testing.assert_allclose(last_doa(name, model, z, n_sources=2), DOA, atol=0.02)


@pytest.mark.parametrize("name", ["root_music", "esprit", "past"])
def test_directions_beyond_the_alias_limit_of_most_bins_are_found(name: str) -> None:
    model = LINE.replace(wavelength=[1.0, 0.55, 0.47, 0.62, 0.7, 0.8])
    z = sources(model, [-0.9, 0.3], n_steps=20)
    np.testing.assert_allclose(last_doa(name, model, z), [-0.9, 0.3], atol=0.01)


@pytest.mark.parametrize("name", ["root_music", "esprit"])
def test_errors_of_bins_are_near_the_bound(name: str) -> None:
    """Standard deviation of the mean of independent bins, by the bound of each."""
    model = LINE.replace(wavelength=np.linspace(1.0, 2.0, 12), noise=0.1)
    rng = np.random.default_rng(5)
    errors, x = [], LINE.array.positions[:, 0]
    for _ in range(60):
        w = np.exp(2j * np.pi * rng.random((12, 5, 1)))
        z = model.simulate([0.3], w, rng)
        errors.append(last_doa(name, model, z[None], n_sources=1)[0] - 0.3)
    # J = 2 N / noise Σ_f (2π/λ_f cos β)² Σ x²
    k = 2 * np.pi / np.array(model.wavelengths) * np.cos(0.3)
    bound = np.sqrt(1 / (2 * 5 / 0.1 * (k**2).sum() * ((x - x.mean()) ** 2).sum()))
    assert 0.8 * bound < np.sqrt(np.mean(np.square(errors))) < 1.5 * bound


# second unknowns, elements, noise


@pytest.mark.parametrize("name", ["music", "mvdr"])
def test_slowness_and_elevation_are_scanned(name: str) -> None:
    for unknown in ({"slowness": [0.8, 1.0, 1.25]}, {"elevation": [0.0, 0.6435]}):
        model = CIRCLE.replace(**unknown)
        true = CIRCLE.replace(wavelength=[w * 1.25 for w in CIRCLE.wavelengths])
        np.testing.assert_allclose(last_doa(name, model, sources(true)), DOA, atol=0.02)
        assert create(name, measurement=model).run(sources(true)).amplitude[-1, 0].real < 1.3


@pytest.mark.parametrize("name", ["music", "mvdr", "sbl", "ssbl"])
@pytest.mark.parametrize("n_snapshots", [1, 4])
def test_directional_elements_are_scanned(name: str, n_snapshots: int) -> None:
    facing = 2 * np.pi * np.arange(6) / 6
    model = ArraySnapshot(
        CIRCLE.array, 1.0, 1e-3, n_snapshots=n_snapshots,
        response=ElementResponse.first_order(facing, 0.6),
    )  # fmt: skip
    doa = last_doa(name, model, sources(model, [-1.2, 0.9], n_steps=30))
    np.testing.assert_allclose(doa, [-1.2, 0.9], atol=0.03)


@pytest.mark.parametrize("name", ["music", "mvdr", "sbl", "ssbl"])
def test_coherent_noise_is_whitened(name: str) -> None:
    array = SensorArray.uca(6, 0.12)
    model = ArraySnapshot(array, [1.0, 1.3, 0.7], 0.3, n_snapshots=20, noise_coherence="diffuse")
    z = sources(model, [0.9], n_steps=4)
    params: dict[str, Any] = {"max_sources": 1} if name != "music" else {"n_sources": 1}
    assert last_doa(name, model, z, **params) == pytest.approx(0.9, abs=0.1)
    z[..., 2] = np.nan
    fewer = model.replace(array=array.without([2]))
    expected = last_doa(name, fewer, np.delete(z, 2, axis=-1), **params)
    np.testing.assert_allclose(last_doa(name, model, z, **params), expected, atol=1e-5)
    matrix = model.replace(noise_coherence=model.coherence)
    np.testing.assert_allclose(last_doa(name, matrix, z, **params), expected, atol=1e-5)


def test_mdl_in_diffuse_noise_finds_no_source_once_whitened() -> None:
    array = SensorArray.uca(6, 0.12)
    model = ArraySnapshot(array, [1.0, 1.3], n_snapshots=50, noise_coherence="diffuse")
    z = model.simulate(np.full((4, 1), np.nan), 0.0, np.random.default_rng(0))
    assert MUSIC(model, forgetting=1.0).run(z).n_found[-1] == 0
    assert MUSIC(model.replace(noise_coherence="white")).run(z).n_found[-1] > 0


# parts


def test_used_data_keeps_the_larger_part() -> None:
    weights = np.ones((4, 3))
    weights[0, 1] = 0.0
    assert [np.asarray(mask).tolist() for mask in used_data(weights)] == [
        [True] * 3,
        [False, *[True] * 3],
    ]
    weights[:3, 1] = 0.0
    assert [np.asarray(mask).tolist() for mask in used_data(weights)] == [
        [True, False, True],
        [True] * 4,
    ]
    sensors, bins = used_data(np.zeros((4, 3)))
    assert not sensors.any()
    assert bins is not None
    assert not bins.any()


def test_sums_of_a_block_equal_those_of_its_snapshots() -> None:
    z = sources(LINE)[0]
    z[1, 2, 3] = z[0, :, 1] = z[3, 4] = np.nan
    block = PatternSums.empty(6, 4).add(z)
    for f in range(4):
        alone = PatternSums.empty(6)
        for y in z[f][~np.isnan(z[f]).all(axis=1)]:
            alone = alone.add(y)
        np.testing.assert_allclose(block.sensor_weights[f], alone.sensor_weights)
        np.testing.assert_allclose(block.products[:, f].sum(axis=0), alone.products.sum(axis=0))
    sensors = np.arange(6) != 1
    R = block.mean_covariance(sensors, np.array([True, True, False, True]))
    for f, each in zip((0, 1, 3), R, strict=True):
        alone = PatternSums.empty(6).add(z[f])
        expected = alone.mean_covariance(sensors)
        np.testing.assert_allclose(each, expected, atol=2e-3 * np.abs(expected).max())


def test_sbl_of_a_block_model_equals_rows_of_one_bin() -> None:
    z = sources(ONE_BIN)[0]
    block, rows = SBL(ONE_BIN), SBL(ONE_BIN.replace(n_snapshots=1))
    block.update(z)
    rows.update(z)
    np.testing.assert_allclose(block.gamma, rows.gamma, rtol=1e-6)
    np.testing.assert_allclose(block.estimate.std, rows.estimate.std, rtol=1e-4)


def test_sbl_without_a_peak_above_the_threshold_reports_none() -> None:
    for model in (LINE, ONE_BIN, ONE_BIN.replace(n_snapshots=1)):
        assert SBL(model, threshold=1.0).run(sources(model, n_steps=1)).n_found[0] == 0


def test_interval_counts_snapshots() -> None:
    z = sources(ONE_BIN, n_steps=6)
    found = MUSIC(ONE_BIN, 2, interval=15).run(z)
    assert found.n_found.tolist() == [0, 0, 2, 2, 2, 2]
    np.testing.assert_array_equal(found.doa[2], found.doa[4])
    assert not np.array_equal(found.doa[4], found.doa[5])


def test_measurement_of_another_number_of_bins_restarts() -> None:
    for name in (*SUBSPACE, "mvdr"):
        tracker = create(name, measurement=LINE)
        tracker.run(sources(LINE))
        tracker.set_params(measurement=ONE_BIN)
        doa = tracker.run(sources(ONE_BIN, n_steps=40)).doa[-1]
        assert np.sort(doa[~np.isnan(doa)]) == pytest.approx(DOA, abs=0.02)


# invalid arguments


@pytest.mark.parametrize("name", ["root_music", "esprit", "past"])
def test_lines_that_do_not_suit_are_refused_in_one_line(name: str) -> None:
    for model, message in (
        (CIRCLE, "requires a line of sensors on a uniform grid"),
        (LINE.replace(wavelength=[0.9, 0.8]), r"wavelength must be at least 1 m.* got 0\.9"),
        (LINE.replace(slowness=[0.9, 1.1]), "slowness must be None for a method of a uniform grid"),
        (LINE.replace(noise_coherence="diffuse"), "noise_coherence must be 'white'"),
    ):
        with pytest.raises(ValueError, match=message) as caught:
            create(name, measurement=model)
        assert "\n" not in str(caught.value)


def test_other_unsuitable_models_are_refused() -> None:
    for name in ("sbl", "ssbl"):
        with pytest.raises(ValueError, match="slowness and elevation must be None"):
            create(name, measurement=CIRCLE.replace(elevation=[0.0, 0.5]))
    diffuse = LINE.replace(noise_coherence="diffuse")
    with pytest.raises(ValueError, match="noise_coherence must be 'white' with smoothing"):
        MUSIC(diffuse, smoothing=4)
    with pytest.raises(ValueError, match="noise_coherence must be 'white' for past"):
        PAST(diffuse, method="music")
    with pytest.raises(ValueError, match=r"z must have shape \(4, 5, 6\)"):
        MVDR(LINE).update(np.ones((4, 5)))
