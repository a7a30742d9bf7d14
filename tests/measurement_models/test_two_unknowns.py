"""Snapshots of sources with elevations or ranges: responses, likelihoods, and refusals."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.measurement_models.arrays.sphere import unit_vectors
from arrivals.measurement_models.manifolds.line_phase import FresnelLine
from arrivals.measurement_models.manifolds.manifold import is_point_manifold
from arrivals.measurement_models.manifolds.phase import DirectionCosines
from arrivals.measurement_models.manifolds.spherical_line import SphericalLine
from arrivals.measurement_models.manifolds.tangent_plane import TangentPlanes
from arrivals.trackers import create

SPACE = SensorArray(np.random.default_rng(1).normal(size=(6, 3)))
FLAT = SensorArray(np.c_[np.random.default_rng(2).normal(size=(6, 2)), np.full(6, 2.0)])
CIRCLE = SensorArray.uca(8, 0.65)
LINE = SensorArray(np.array([0.0, 0.4, 1.1, 2.0, 2.3, 3.1]) + 5.0)
MODELS: dict[str, Any] = {
    "circle": ArraySnapshot(CIRCLE, 1.0, unknowns="sphere"),
    "flat": ArraySnapshot(FLAT, [1.0, 1.3], unknowns="sphere"),
    "space": ArraySnapshot(SPACE, [1.0, 1.3], n_snapshots=2, unknowns="sphere"),
    "near": ArraySnapshot(LINE, 1.0, unknowns="range", nearest=2.0),
    "far": ArraySnapshot(LINE, 1.0, n_snapshots=3, unknowns="range"),
}
every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
AZIMUTH, ELEVATION, DISTANCE = np.array([0.4, -1.1]), np.array([0.3, 0.9]), np.array([3.0, 60.0])


def second(model: ArraySnapshot) -> dict[str, Any]:
    if model.unknowns == "sphere":
        return {"elevation": ELEVATION}
    return {"distance": DISTANCE if model.nearest else 1e3 * DISTANCE}


# responses


@pytest.mark.parametrize("name", ["circle", "flat", "space"])
def test_steering_vector_of_an_elevation_is_that_of_a_plane_wave(name: str) -> None:
    model = MODELS[name]
    n, p = unit_vectors(AZIMUTH, ELEVATION), model.array.positions
    path = n[:, : p.shape[1]] @ p.T
    expected = np.exp(2j * np.pi * path[:, None] / np.array(model.wavelengths)[:, None])
    a = model.steering_vector(AZIMUTH, ELEVATION).reshape(expected.shape)
    np.testing.assert_allclose(a, expected, atol=1e-12)
    level = model.steering_vector(AZIMUTH, 0 * AZIMUTH)
    np.testing.assert_allclose(level, model.steering_vector(AZIMUTH), atol=1e-12)


@pytest.mark.parametrize("array", [SPACE, FLAT, CIRCLE])
def test_steering_vector_of_a_distance_is_a_spherical_wave(array: SensorArray) -> None:
    model = ArraySnapshot(array, 1.0)
    p = np.c_[array.positions, np.zeros((array.n_sensors, 3 - array.dim))]
    centre = p.mean(axis=0)
    n = unit_vectors(AZIMUTH, ELEVATION)
    r = np.linalg.norm((centre + DISTANCE[:, None] * n)[:, None] - p, axis=2)
    plane = (n @ centre)[:, None]
    R = DISTANCE[:, None]
    expected = R / r * np.exp(2j * np.pi * (R - r + plane))
    a = model.steering_vector(AZIMUTH, ELEVATION, DISTANCE)
    np.testing.assert_allclose(a, expected, atol=1e-10)
    far = model.steering_vector(AZIMUTH, ELEVATION, np.array([np.inf, 1e9]))
    np.testing.assert_allclose(far, model.steering_vector(AZIMUTH, ELEVATION), atol=1e-6)


def test_spherical_wave_on_a_line_is_that_of_the_line_in_space() -> None:
    line = ArraySnapshot(LINE, [1.0, 1.4])
    space = ArraySnapshot(SensorArray(np.c_[0 * LINE.positions, LINE.positions]), [1.0, 1.4])
    a = line.steering_vector(AZIMUTH, distance=DISTANCE)  # counted from broadside, the x axis
    np.testing.assert_allclose(a, space.steering_vector(AZIMUTH, distance=DISTANCE), atol=1e-10)


@every_model
def test_manifold_recovers_amplitudes_from_waves(model: ArraySnapshot) -> None:
    manifold: Any = model.manifold()
    given = second(model)
    x = manifold.from_doa(AZIMUTH, next(iter(given.values())))
    a, _ = manifold.at(x)
    shape = [n for n in (model.n_bins, model.n_snapshots) if n > 1]
    amplitude = np.array([2.0, -1j])
    for k in range(2):
        wave = model.wave(
            AZIMUTH[k : k + 1],
            np.broadcast_to(amplitude[k], (*shape, 1)),
            **{name: each[k : k + 1] for name, each in given.items()},
        )
        Y = model.snapshots(wave)
        w = (a[:, k].conj()[:, None] @ Y)[:, 0] / manifold.n_sensors
        np.testing.assert_allclose(a[:, k, :, None] * w[:, None], Y, atol=1e-3)
        back = manifold.to_amplitude(w[0, :1], x[:, k : k + 1])
        expected = amplitude[k] if model.n_bins == 1 else abs(amplitude[k])
        np.testing.assert_allclose(back, expected, rtol=1e-3)


def test_fresnel_form_is_of_second_order_in_the_inverse_range() -> None:
    model = MODELS["far"]
    manifold: Any = model.manifold()
    loss = []
    for distance in (30.0, 60.0, 120.0):
        R = np.full(2, distance)
        a = manifold.at(manifold.from_doa(AZIMUTH, R))[0][0]
        b = model.steering_vector(AZIMUTH, distance=R)
        phase = np.angle(b / a)
        phase -= phase.mean(axis=1, keepdims=True)
        loss.append(np.abs((phase + np.pi) % (2 * np.pi) - np.pi).max())
    assert loss[0] / loss[1] == pytest.approx(4, rel=0.15)
    assert loss[1] / loss[2] == pytest.approx(4, rel=0.15)


@every_model
def test_inactive_sources_and_shapes_of_draws(model: ArraySnapshot) -> None:
    given = {name: np.stack([each, each]) for name, each in second(model).items()}
    doa = np.array([AZIMUTH, [AZIMUTH[0], np.nan]])
    for each in given.values():
        each[1, 1] = np.nan
    w = np.ones((2, *model.shape[:-1], 2))
    wave = model.wave(doa, w, **given)
    assert wave.shape == (2, *model.shape)
    alone = model.wave(
        doa[1, :1], w[1, ..., :1], **{name: each[1, :1] for name, each in given.items()}
    )
    np.testing.assert_allclose(wave[1], alone)
    z = model.simulate(doa, w, np.random.default_rng(0), **given)
    noise = model.simulate(doa * np.nan, w, np.random.default_rng(0))
    np.testing.assert_allclose(z - wave, noise)


# likelihood


@every_model
def test_log_likelihood_is_that_of_the_joint_gaussian(model: ArraySnapshot) -> None:
    given = second(model)
    rng = np.random.default_rng(0)
    z = rng.normal(size=model.shape) + 1j * rng.normal(size=model.shape)
    a = model.steering_vector(AZIMUTH, **given).reshape(2, model.n_bins, -1)
    rows = z.reshape(model.n_bins, model.n_snapshots, -1)
    expected = 0.0
    for f in range(model.n_bins):
        C = model.power * a[:, f].T @ a[:, f].conj() + model.noise * np.eye(a.shape[2])
        for y in rows[f]:
            quadratic = (y.conj() @ np.linalg.solve(C, y)).real
            expected += -quadratic - np.linalg.slogdet(np.pi * C)[1]
    assert model.log_likelihood(z, AZIMUTH, **given) == pytest.approx(expected)
    stacked = {name: np.stack([each, each[::-1]]) for name, each in given.items()}
    both = model.log_likelihood(z, np.stack([AZIMUTH, AZIMUTH[::-1]]), **stacked)
    np.testing.assert_allclose(both, expected)


@every_model
def test_log_likelihood_of_known_amplitudes_is_that_of_the_noise(model: ArraySnapshot) -> None:
    given, w = second(model), np.ones((*MODELS["circle"].shape[:-1], 2))
    z = model.wave(AZIMUTH, np.ones((*model.shape[:-1], 2)), **given)
    most = model.log_likelihood(z, AZIMUTH, np.ones((*model.shape[:-1], 2)), **given)
    assert most == pytest.approx(-np.prod(model.shape) * np.log(np.pi * model.noise))
    other = model.log_likelihood(z, AZIMUTH + 0.1, np.ones((*model.shape[:-1], 2)), **given)
    assert other < most
    assert w.shape[-1] == 2


# models


def test_manifold_of_each_model_is_the_one_for_its_array() -> None:
    kinds = [DirectionCosines, DirectionCosines, TangentPlanes, SphericalLine, FresnelLine]
    assert [type(model.manifold()) for model in MODELS.values()] == kinds
    assert [model.half_space for model in MODELS.values()] == [True, True, False, False, False]
    assert is_point_manifold(MODELS["flat"].manifold())
    assert not ArraySnapshot(CIRCLE, 1.0).half_space


def test_nearest_is_a_quarter_of_the_fraunhofer_distance_by_default() -> None:
    array, wavelength = SensorArray.ula(16, 0.08), 343 / 2000
    limit = 2 * 1.2**2 / wavelength / 4
    default, far, near = (
        ArraySnapshot(array, wavelength, unknowns="range", nearest=nearest).manifold()
        for nearest in (None, 1.001 * limit, 0.3)
    )
    assert isinstance(default, FresnelLine)
    assert default.curvature_std == pytest.approx(1 / limit)
    assert isinstance(far, FresnelLine)
    assert far.curvature_std == pytest.approx(1 / (1.001 * limit))
    assert isinstance(near, SphericalLine)
    assert near.max_inverse == pytest.approx(1 / 0.3)


@every_model
def test_observed_snapshots_have_the_manifold_of_valid_sensors(model: ArraySnapshot) -> None:
    z = model.wave(AZIMUTH, np.ones((*model.shape[:-1], 2)), **second(model))
    z[..., 2] = np.nan
    observed = model.observe(z)
    assert observed is not None
    assert observed.manifold is model.manifold().without([2])


@every_model
def test_models_survive_dictionaries_and_pickle(model: ArraySnapshot) -> None:
    assert ArraySnapshot.from_dict(model.to_dict()) == model
    assert pickle.loads(pickle.dumps(model)) == model


def test_ambiguity_is_that_of_plane_waves_on_a_line_and_none_on_the_sphere() -> None:
    sparse = SensorArray.ula(8, 1.0)
    pair = ArraySnapshot(sparse, 1.0, unknowns="range").ambiguity()
    assert pair == ArraySnapshot(sparse, 1.0).ambiguity()
    assert MODELS["circle"].ambiguity() is None


# refusals


@pytest.mark.parametrize(
    ("array", "arguments", "message"),
    [
        (LINE, {"unknowns": "both"}, "unknowns must be .*; got 'both'"),
        (LINE, {"unknowns": "sphere"}, "array must be in a plane or in space .*; got a line"),
        (np.c_[np.arange(4.0), np.arange(4.0)], {"unknowns": "sphere"}, "must not be collinear"),
        (np.eye(3)[:1] * np.arange(4.0)[:, None], {"unknowns": "sphere"}, "collinear"),
        (np.eye(2), {"unknowns": "sphere"}, "at least 4 sensors .*; got 2"),
        (np.eye(3), {"unknowns": "sphere"}, "at least 4 sensors .*; got 3"),
        (CIRCLE, {"unknowns": "range"}, "must be a line, .*; got sensors in 2 dimensions"),
        (np.arange(2.0), {"unknowns": "range"}, "at least 3 sensors .*; got 2"),
        (LINE, {"unknowns": "range", "nearest": -1.0}, "nearest must be finite and positive"),
        (LINE, {"unknowns": "range", "nearest": np.nan}, "nearest must be finite and positive"),
        (LINE, {"nearest": 3.0}, "nearest must be None unless unknowns='range'; got 'azimuth'"),
        (CIRCLE, {"unknowns": "sphere", "nearest": 3.0}, "nearest must be None unless"),
        (LINE, {"unknowns": "range", "nearest": 0.7}, "quarter of the array's extent of 3.1 m"),
        (CIRCLE, {"unknowns": "sphere", "slowness": [1.0, 1.1]}, "slowness must be None"),
        (CIRCLE, {"unknowns": "sphere", "elevation": [0.0, 0.1]}, "elevation must be None"),
        (
            CIRCLE,
            {"unknowns": "sphere", "noise_coherence": "diffuse"},
            "noise_coherence must be 'white'",
        ),
        (
            LINE,
            {"unknowns": "range", "noise_coherence": np.eye(6)},
            "noise_coherence must be 'white'",
        ),
        (
            CIRCLE,
            {"unknowns": "sphere", "response": ElementResponse.first_order(np.arange(8.0))},
            "response must be None",
        ),
    ],
)
def test_unknowns_that_an_array_cannot_give_are_refused_in_one_line(
    array: Any, arguments: dict[str, Any], message: str
) -> None:
    array = array if isinstance(array, SensorArray) else SensorArray(array)
    with pytest.raises(ValueError, match=message) as error:
        ArraySnapshot(array, 1.0, **arguments)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("unknowns", ["sphere", "range"])
def test_array_that_resolves_too_many_points_is_refused_in_one_line(unknowns: Any) -> None:
    array = SPACE if unknowns == "sphere" else LINE
    with pytest.raises(ValueError, match="array must resolve at most 65536") as error:
        ArraySnapshot(array, 1e-9, unknowns=unknowns).manifold()
    assert "\n" not in str(error.value)


def test_slab_is_never_narrower_than_the_spike() -> None:
    manifold: Any = ArraySnapshot(LINE, 1.0, unknowns="range", nearest=1e100).manifold()
    assert manifold.slab_precision == manifold.spike_precision


def test_nearest_of_a_quarter_of_the_extent_is_accepted() -> None:
    """16 microphones 8 cm apart: 1.2 m, in floating point a little more."""
    model = ArraySnapshot(SensorArray.ula(16, 0.08), 0.17, unknowns="range", nearest=0.3)
    assert model.nearest == 0.3


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.steering_vector(0.1, elevation=0.2), "elevation must be None for a line"),
        (lambda m: m.steering_vector([0.1], distance=[0.0]), "distance must be positive"),
        (lambda m: m.steering_vector([0.1], distance=[np.nan]), "distance must be positive"),
        (lambda m: m.wave([0.1, 0.2], [1, 1], distance=[1.0]), "distance must have the shape"),
        (lambda m: m.h([0.1, 1.0, 0.0]), "Gaussian interface requires unknowns='azimuth'"),
        (lambda m: m.H([0.1, 1.0, 0.0]), "Gaussian interface requires unknowns='azimuth'"),
        (lambda m: m.for_likelihood(("doa",)), "unknowns='azimuth'; got 'range'"),
        (lambda m: m.angle_manifold(), "directions of one angle; got a manifold of 2 unknowns"),
        (lambda m: m.plain_wavelength("esprit"), "esprit requires unknowns='azimuth'"),
        (lambda m: m.manifold("first"), "reference must be 'middle' with two unknowns"),
        (lambda m: m.manifold("last"), "reference must be"),
    ],
)
def test_arguments_that_do_not_fit_two_unknowns_are_refused(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        call(MODELS["near"])
    assert "\n" not in str(error.value)


ONE_SOURCE = {"n_sources": 1}
METHODS = {
    "esprit": ONE_SOURCE,
    "root_music": ONE_SOURCE,
    "past": ONE_SOURCE,
    "sbl": {},
    "ssbl": {},
}


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("key", ["near", "circle"])
def test_methods_of_one_unknown_refuse_two_in_one_line(name: str, key: str) -> None:
    with pytest.raises((ValueError, TypeError), match="unknowns") as error:
        create(name, measurement=MODELS[key], **METHODS[name])
    assert "\n" not in str(error.value)
