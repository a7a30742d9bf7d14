"""Noise that is coherent between sensors: whitening, likelihood, simulation, validation."""

import json
import pickle
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from arrivals.measurement_models import ArraySnapshot, SensorArray, composite
from arrivals.measurement_models.arrays.noise_coherence import NoiseCoherence
from arrivals.measurement_models.manifolds.fourier import fourier_manifold
from arrivals.measurement_models.manifolds.manifold import angle_manifold
from arrivals.measurement_models.manifolds.whitened import WhitenedManifold, norm_series
from arrivals.trackers import SVALSE, VALSE
from arrivals.typing import Complex

CIRCLE = SensorArray.uca(6, 0.3)
LINE = SensorArray.ula(5, 0.3, missing=[1])
SPACE = SensorArray(np.random.default_rng(2).normal(size=(5, 3)))
BINS = [1.0, 1.3, 2.5]


def random_coherence(n_bins: int, n_sensors: int, seed: int = 0) -> Complex:
    parts = np.random.default_rng(seed).normal(size=(2, n_bins, n_sensors, 2 * n_sensors))
    X = parts[0] + 1j * parts[1]
    C = X @ np.swapaxes(X.conj(), 1, 2)
    scale = np.sqrt(np.diagonal(C, axis1=1, axis2=2).real)
    return np.asarray(C / scale[:, :, None] / scale[:, None])


def some_models() -> list[ArraySnapshot]:
    several: dict[str, Any] = {"wavelength": BINS, "n_snapshots": 4, "noise": 0.4, "power": 2.0}
    matrices = random_coherence(3, 6)
    return [
        ArraySnapshot(CIRCLE, **several, noise_coherence="diffuse", white=0.2),
        ArraySnapshot(CIRCLE, **several, noise_coherence=matrices),
        ArraySnapshot(LINE, **several, noise_coherence="diffuse"),
        ArraySnapshot(SPACE, **several, noise_coherence="diffuse", elevation=[0.0, 0.4]),
        ArraySnapshot(LINE, 1.0, noise=0.4, power=2.0, noise_coherence=random_coherence(1, 4)[0]),
    ]


MODELS = some_models()
every_model = pytest.mark.parametrize("model", MODELS, ids=range(len(MODELS)))


def coherence(model: ArraySnapshot) -> Complex:
    assert model.coherence is not None
    M = model.array.n_sensors
    return np.broadcast_to(model.coherence.per_bin, (model.n_bins, M, M))


def measurement(model: ArraySnapshot, seed: int = 0, gaps: bool = False) -> Complex:
    rng = np.random.default_rng(seed)
    z = model.simulate([0.4, -0.9], rng.normal(size=2) + 1j, rng)
    if gaps:
        z[rng.random(z.shape) < 0.2] = np.nan
    return z


# the matrices


def test_diffuse_coherence_is_the_mean_over_directions_of_the_sphere() -> None:
    height = (np.arange(400) + 0.5) / 200 - 1  # areas of a sphere are equal for equal heights
    azimuth = 2 * np.pi * np.arange(400) / 400
    flat = np.sqrt(1 - height**2)[:, None]
    u = np.stack(
        np.broadcast_arrays(flat * np.cos(azimuth), flat * np.sin(azimuth), height[:, None]), -1
    )
    a = np.exp(2j * np.pi / 1.3 * (u.reshape(-1, 3) @ SPACE.positions.T))
    model = ArraySnapshot(SPACE, 1.3, noise_coherence="diffuse", white=0.25)
    expected = 0.75 * (a.T @ a.conj()) / len(a) + 0.25 * np.eye(5)
    assert_allclose(coherence(model)[0], expected, atol=1e-4)


@every_model
def test_whitening_of_some_sensors_makes_their_noise_white(model: ArraySnapshot) -> None:
    sensors = np.arange(model.array.n_sensors) != 1
    L, G = model.whitening(sensors), coherence(model)[:, sensors][:, :, sensors]
    identity = np.broadcast_to(np.eye(len(G[0])), G.shape)
    assert_allclose(L @ G @ np.swapaxes(L.conj(), 1, 2), identity, atol=1e-12)
    assert model.whitening(sensors).base is model.whitening(sensors.copy()).base


@every_model
def test_simulated_noise_is_white_after_whitening(model: ArraySnapshot) -> None:
    n = 6000
    z = model.simulate(np.full((n, 1), np.nan), 0.0, np.random.default_rng(1))
    rows = z.reshape(n, model.n_bins, model.n_snapshots, -1)
    white = np.swapaxes(rows, 2, 3)
    white = model.whitening() @ white  # (n, F, M, N)
    R = np.einsum("tfin,tfjn->fij", white, white.conj()) / (n * model.n_snapshots)
    # entries are known to 0.4 / sqrt(6000) = 0.005
    assert_allclose(R, np.broadcast_to(0.4 * np.eye(R.shape[-1]), R.shape), atol=0.03)
    by_time = np.einsum("tfin,tfim->nm", white, white.conj()) / n / model.n_bins / R.shape[-1]
    assert_allclose(by_time, 0.4 * np.eye(model.n_snapshots), atol=0.03)


# likelihood and the Gaussian interface


def brute_force(model: ArraySnapshot, z: Complex, doa: list[float]) -> float:
    """scipy's joint Gaussian of all numbers that are there, a mean over the nuisance."""
    n = model.n_bins * model.n_snapshots
    rows = z.reshape(n, -1)
    A = model.waves.steering(np.array(doa))  # (n_nuisance, F, M, K)
    logs = []
    for nuisance in A:
        total = 0.0
        for i, (f, _) in enumerate(product(range(model.n_bins), range(model.n_snapshots))):
            there = ~np.isnan(rows[i])
            if not there.any():
                continue
            S = model.power * nuisance[f] @ nuisance[f].conj().T
            S = (S + model.noise * coherence(model)[f])[np.ix_(there, there)] / 2
            joint = np.block([[S.real, -S.imag], [S.imag, S.real]])
            normal = multivariate_normal(np.zeros(len(joint)), joint)
            total += float(normal.logpdf(composite(rows[i, there])))
        logs.append(total)
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))


@every_model
@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize("doa", [[0.3], [0.3, -1.1]])
def test_log_likelihood_equals_the_joint_gaussian(
    model: ArraySnapshot, gaps: bool, doa: list[float]
) -> None:
    z = measurement(model, 3, gaps)
    expected = brute_force(model, z, doa)
    assert model.log_likelihood(z, doa) == pytest.approx(expected, rel=1e-10)
    batch = model.log_likelihood(z, [[doa, [1.0] * len(doa)]] * 3)
    assert batch[2, 0] == pytest.approx(expected, rel=1e-10)


@every_model
@pytest.mark.parametrize("gaps", [False, True])
def test_log_likelihood_of_known_amplitudes_equals_the_gaussian_of_the_noise(
    model: ArraySnapshot, gaps: bool
) -> None:
    z = measurement(model, 3, gaps)
    doa, w = np.array([0.3, 0.9]), np.array([1.0, 2j])
    e = composite((z - model.wave(doa, w)).ravel())
    there = ~np.isnan(e)
    normal = multivariate_normal(np.zeros(there.sum()), model.R[np.ix_(there, there)])
    expected = normal.logpdf(e[there])
    assert model.log_likelihood(z, doa, w) == pytest.approx(expected, rel=1e-10)
    both = np.reshape([w, w], (2, *[1] * (len(model.shape) - 1), 2))
    assert model.log_likelihood(z, [doa, doa], both)[1] == pytest.approx(expected, rel=1e-10)


# manifolds and observed snapshots


@every_model
def test_manifold_and_norm_are_those_of_whitened_waves(model: ArraySnapshot) -> None:
    theta = np.linspace(-3, 3, 50)
    manifold = model.angle_manifold()
    expected = model.whitening() @ fourier_manifold(model.waves).steering(theta)
    assert_allclose(manifold.steering(theta), expected, atol=1e-7)
    series = np.asarray(manifold.norm_squared())
    d = np.exp(1j * np.multiply.outer(np.arange(series.shape[-1]), theta))
    assert_allclose((series @ d).real, (np.abs(expected) ** 2).sum(axis=2), rtol=1e-6)


def test_norm_series_of_random_coefficients() -> None:
    rng = np.random.default_rng(0)
    G = rng.normal(size=(2, 3, 4, 7)) + 1j * rng.normal(size=(2, 3, 4, 7))
    theta = np.array([0.1, 2.0, -1.3])
    a = G @ np.exp(1j * np.multiply.outer(np.arange(-3, 4), theta))
    c = norm_series(G)
    values = (c @ np.exp(1j * np.multiply.outer(np.arange(c.shape[-1]), theta))).real
    assert_allclose(values, (np.abs(a) ** 2).sum(axis=2), rtol=1e-12)


@pytest.mark.parametrize("model", MODELS[:4], ids=range(4))
def test_missing_sensors_and_bins_leave_the_model_without_them(model: ArraySnapshot) -> None:
    z = measurement(model)
    z[1], z[:, 2] = np.nan, np.nan
    z[..., 3] = np.nan
    observed = model.observe(z)
    assert observed is not None
    noise = NoiseCoherence(coherence(model)).without([3]).only([0, 2])
    bins = [BINS[0], BINS[2]]
    less = model.replace(
        array=model.array.without([3]), wavelength=bins, n_snapshots=3, noise_coherence=noise
    )
    other = less.observe(np.delete(np.delete(np.delete(z, 1, 0), 2, 1), 3, 2))
    assert other is not None
    assert_allclose(observed.snapshots, other.snapshots, rtol=1e-12)
    theta = np.linspace(-3, 3, 9)
    one, two = (angle_manifold("test", each.manifold) for each in (observed, other))
    assert_allclose(one.steering(theta), two.steering(theta), atol=1e-9, rtol=1e-9)
    again = model.observe(z)
    assert again is not None
    assert again.manifold is observed.manifold


@every_model
def test_observed_wave_without_noise_is_that_of_the_manifold(model: ArraySnapshot) -> None:
    quiet = model.replace(noise=1e-30)
    z = quiet.simulate([0.7], 1.0, np.random.default_rng(0))
    observed = quiet.observe(z, reference="first")
    assert observed is not None
    a = angle_manifold("test", observed.manifold).steering([0.7])[0, :, :, 0]
    assert_allclose(
        np.abs((a[..., None].conj() * observed.snapshots).sum(axis=1)),
        np.broadcast_to((np.abs(a) ** 2).sum(axis=1)[:, None], (model.n_bins, model.n_snapshots)),
        rtol=1e-6,
    )


# methods


def hand_whitened(model: ArraySnapshot, z: Complex) -> tuple[Complex, WhitenedManifold]:
    """Return whitened data, and the manifold of a hand-made response."""
    L = np.linalg.inv(np.linalg.cholesky(coherence(model)))
    base = fourier_manifold(model.waves)
    G = L @ base.coefficients
    n = 4 * G.shape[-1]
    theta = 2 * np.pi * np.arange(n) / n
    power = (np.abs(G @ np.exp(1j * np.multiply.outer(base.harmonics, theta))) ** 2).sum(axis=2)
    series = np.fft.fft(power) / n
    series[..., 1:] *= 2
    norm = series[..., : n // 2]
    manifold = WhitenedManifold(model.waves, "middle", G, norm, NoiseCoherence(coherence(model)))
    Y = np.swapaxes(z.reshape(model.n_bins, model.n_snapshots, -1), 1, 2)
    return L @ Y, manifold


@pytest.mark.parametrize("model", MODELS[:3], ids=range(3))
@pytest.mark.parametrize("method", [SVALSE, VALSE])
def test_posterior_equals_that_of_hand_whitened_data(model: ArraySnapshot, method: Any) -> None:
    z = model.replace(noise=0.01).simulate([0.4, -0.9], [1.0, 1.5j], np.random.default_rng(0))
    tracker = method(model)
    tracker.predict()
    tracker.update(z)
    posterior = tracker.solver.solve(*hand_whitened(model, z), None)
    order = np.argsort(tracker.estimate.doa)
    assert_allclose(tracker.estimate.doa[order], [-0.9, 0.4], atol=0.05)
    assert_allclose(np.abs(tracker.estimate.amplitude[order]), [1.5, 1.0], rtol=0.1)
    assert_allclose(np.sort(tracker.estimate.doa), np.sort(posterior.theta), atol=1e-6)


def test_svalse_with_white_share_one_equals_white_noise() -> None:
    white = ArraySnapshot(CIRCLE, BINS, n_snapshots=4, noise=0.1)
    diffuse = white.replace(noise_coherence="diffuse", white=1.0)
    assert_array_equal(coherence(diffuse), np.broadcast_to(np.eye(6), (3, 6, 6)))
    rng = np.random.default_rng(0)
    z = white.simulate(np.full((8, 1), 0.4), 1.0, rng)
    z[3, :, :, 2] = np.nan
    one, other = (method(model).run(z) for method in (SVALSE,) for model in (white, diffuse))
    assert_allclose(one.doa, other.doa, atol=1e-6)
    assert_allclose(white.log_likelihood(z[3], [0.2]), diffuse.log_likelihood(z[3], [0.2]))
    assert_allclose(
        white.replace(n_snapshots=1, wavelength=1.0).R,
        diffuse.replace(n_snapshots=1, wavelength=1.0).R,
        atol=1e-15,
    )


def test_svalse_in_diffuse_noise_alone_finds_no_source() -> None:
    small = SensorArray.uca(6, 0.05, speed=343.0)
    bins = [small.wavelength(f) for f in range(400, 2000, 200)]
    room = ArraySnapshot(small, bins, n_snapshots=8, noise_coherence="diffuse")
    z = room.simulate(np.full((20, 1), np.nan), 0.0, np.random.default_rng(0))
    found, found_in_white = (
        np.isfinite(SVALSE(model).run(z).doa).sum()
        for model in (room, room.replace(noise_coherence="white"))
    )
    assert found == 0  # in each of 5 seeds, where white noise left 60 to 74
    assert found_in_white > 20


# parameters


@every_model
def test_model_keeps_its_coherence_in_copies(model: ArraySnapshot) -> None:
    config = json.loads(json.dumps(model.to_dict()))
    same = [pickle.loads(pickle.dumps(model)), model.replace(), ArraySnapshot.from_dict(config)]
    same.append(ArraySnapshot(**model.get_params(deep=False)))
    for other in same:
        assert other == model
        assert hash(other) == hash(model)
        assert_array_equal(coherence(other), coherence(model))
    white = model.replace(noise_coherence="white")
    assert white != model
    assert white.coherence is None
    assert white.get_params()["noise_coherence"] == "white"


BAD: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"noise_coherence": "pink"}, ValueError, "must be 'white', 'diffuse' or an array; got 'pink'"),
    ({"noise_coherence": None}, ValueError, r"must have shape \(n_sensors, n_sensors\) or .*\(\)"),
    ({"noise_coherence": np.eye(3)}, ValueError, r"shape \(6, 6\) or \(1, 6, 6\); got \(3, 3\)"),
    ({"noise_coherence": np.ones((2, 3))}, ValueError, r"\(n_bins, n_.*; got \(2, 3\)"),
    ({"noise_coherence": [np.eye(6)] * 2}, ValueError, r"\(1, 6, 6\); got \(2, 6, 6\)"),
    ({"noise_coherence": np.full((6, 6), np.nan)}, ValueError, "must be finite; got NaN"),
    ({"noise_coherence": 2 * np.eye(6)}, ValueError, "must have ones on the diagonal; got 2.0"),
    ({"noise_coherence": np.tri(6)}, ValueError, "must be Hermitian; got entries 1 off"),
    ({"noise_coherence": np.ones((6, 6))}, ValueError, "must be positive definite; got an eigenv"),
    ({"noise_coherence": 2 * np.eye(6) - 1}, ValueError, "must be positive definite; got"),
    ({"noise_coherence": [["a"] * 6] * 6}, TypeError, "noise_coherence must be numbers"),
    ({"noise_coherence": [[1.0], [1.0, 2.0]]}, ValueError, "must have rows of one length"),
    ({"noise_coherence": "diffuse", "white": 0.0}, ValueError, r"white must lie in \[1e-08, 1\]"),
    ({"noise_coherence": "diffuse", "white": 1e-9}, ValueError, r"white must lie in \[1e-08, 1\]"),
    ({"white": 1.5}, ValueError, "got 1.5"),
    ({"white": "much"}, TypeError, "white must be a number"),
]


@pytest.mark.parametrize(("parameters", "kind", "message"), BAD)
def test_coherence_that_is_none_raises(
    parameters: dict[str, Any], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=message) as caught:
        ArraySnapshot(CIRCLE, 1.0, **parameters)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("close", [SensorArray.ula(8, 1e-3), SensorArray.uca(6, 0.01)])
def test_smallest_white_share_has_finite_whitening(close: SensorArray) -> None:
    model = ArraySnapshot(close, [1.0, 30.0], noise_coherence="diffuse", white=1e-8)
    assert np.isfinite(model.whitening()).all()
