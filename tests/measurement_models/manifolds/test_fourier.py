"""Any array as a Fourier series: equal to the array's response; ambiguous directions."""

import json
import pickle
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.fourier import FourierManifold, fourier_manifold
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.typing import Complex, Float

CIRCLE = SensorArray.uca(8, radius=0.65)
PLANE = SensorArray(np.random.default_rng(1).normal(size=(6, 2)))
SPACE = SensorArray(np.random.default_rng(2).normal(size=(6, 3)))
SQUARE = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
SPARSE = SensorArray(np.array([0.0, 0.7, 1.9, 4.1, 5.0]))
MEASURED = ElementResponse(
    np.random.default_rng(3).normal(size=(2, 9, 6))
    + 1j * np.random.default_rng(4).normal(size=(9, 6))
)
MODELS = {
    "circle": ArraySnapshot(CIRCLE, 1.0),
    "plane, bins": ArraySnapshot(PLANE, [1.0, 1.3, 2.2]),
    "space, snapshots": ArraySnapshot(SPACE, 1.1, n_snapshots=3),
    "line, bins": ArraySnapshot(SPARSE, [1.0, 1.7]),
    "line in doa": ArraySnapshot(SensorArray.ula(7, 0.5), 1.0, angle="doa"),
    "measured": ArraySnapshot(PLANE, [1.0, 1.3], response=MEASURED),
    "cardioids": ArraySnapshot(PLANE, 1.0, response=ElementResponse.first_order(np.arange(6.0))),
    "slowness": ArraySnapshot(PLANE, [1.0, 1.3], slowness=[0.8, 1.0, 1.2]),
    "elevation": ArraySnapshot(SPACE, 1.0, elevation=[0.0, 0.4, 0.8]),
}
every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())


def directions(model: ArraySnapshot, n: int = 41) -> Float:
    end = np.pi / 2 if model.array.dim == 1 else np.pi
    return np.linspace(-end, end, n)


# the series


@every_model
@pytest.mark.parametrize("reference", ["middle", "first"])
def test_series_equals_the_response_up_to_a_phase(model: ArraySnapshot, reference: Any) -> None:
    manifold = model.angle_manifold(reference)
    assert isinstance(manifold, FourierManifold)
    doa = directions(model)
    exact = model.waves.steering(doa)
    result = manifold.steering(manifold.from_doa(doa))
    np.testing.assert_allclose(np.abs(result), np.abs(exact), atol=1e-7)
    turn = (result * exact.conj()).sum(axis=2, keepdims=True)
    turn /= np.abs(turn)
    np.testing.assert_allclose(result, exact * turn, atol=1e-7)


@pytest.mark.parametrize("radius", [0.3, 0.65, 2.0, 5.0])
def test_series_of_a_circle_is_short_and_exact(radius: float) -> None:
    """Specification: about 2πr/λ plus 10 to 25 harmonics, errors below 4e-10."""
    array = SensorArray.uca(9, radius)
    manifold = ArraySnapshot(array, 1.0).angle_manifold()
    assert manifold.harmonics.max() <= 2 * np.pi * radius + 25
    theta = np.random.default_rng(0).uniform(-np.pi, np.pi, 200)
    error = manifold.steering(theta)[0, 0].T - array.steering_vector(theta, 1.0)
    assert np.abs(error).max() < 4e-8


@every_model
def test_norm_squared_equals_that_of_the_response(model: ArraySnapshot) -> None:
    manifold = model.angle_manifold()
    theta = directions(model)
    exact = (np.abs(manifold.steering(theta)) ** 2).sum(axis=2)  # (S, F, n)
    norm = manifold.norm_squared()
    if isinstance(norm, float):
        np.testing.assert_allclose(exact, norm, rtol=1e-6)
    else:
        d = np.exp(1j * np.multiply.outer(np.arange(norm.shape[2]), theta))
        np.testing.assert_allclose((norm @ d).real, exact, rtol=1e-6, atol=1e-7)


@every_model
def test_to_amplitude_refers_to_the_origin(model: ArraySnapshot) -> None:
    manifold, doa = model.angle_manifold(), np.array([0.4])
    w = manifold.to_amplitude([2j], doa)
    if model.n_bins == 1 and not model.slowness and not model.elevation:
        response = 2j * manifold.steering(doa)[0, 0, :, 0]
        np.testing.assert_allclose(w * model.steering_vector(0.4), response, atol=1e-7)
    else:
        np.testing.assert_allclose(w, [2.0])


@every_model
def test_manifold_without_sensors_and_bins_equals_that_of_the_smaller_array(
    model: ArraySnapshot,
) -> None:
    manifold = model.angle_manifold()
    part = manifold.without([0, 3])
    assert manifold.without([]) is manifold
    assert part.n_sensors == model.array.n_sensors - 2
    a, b = manifold.steering([0.3])[..., 0], part.steering([0.3])[..., 0]
    ratio = b / np.delete(a, [0, 3], axis=2)  # the phase centre has moved
    np.testing.assert_allclose(ratio, np.repeat(ratio[..., :1], ratio.shape[2], axis=2), atol=1e-6)
    if model.n_bins > 1:
        one = manifold.only([1])
        assert one.n_bins == 1
        np.testing.assert_allclose(one.steering([0.3])[:, 0], manifold.steering([0.3])[:, 1],
                                   atol=1e-7)  # fmt: skip


def test_to_doa_of_a_line_folds_angles_to_the_front() -> None:
    manifold = ArraySnapshot(SPARSE, [1.0, 1.7]).angle_manifold()
    assert manifold.front_back_ambiguous
    theta = np.deg2rad([0.0, 80.0, 100.0, 180.0, -100.0, 260.0])
    np.testing.assert_allclose(
        np.rad2deg(manifold.to_doa(theta)), [0, 80, 80, 0, -80, -80], atol=1e-9
    )
    back = manifold.steering(np.pi - theta)
    np.testing.assert_allclose(manifold.steering(theta), back, atol=1e-6)


@pytest.mark.parametrize(
    ("model", "fast"),
    [
        (ArraySnapshot(SensorArray.ula(5, 0.5), 1.0), True),
        (ArraySnapshot(SensorArray.ula(5, 0.5, missing=[1]), 1.0, n_snapshots=4), True),
        (ArraySnapshot(SensorArray.ula(5, 0.5), 0.9), False),
        (ArraySnapshot(SensorArray.ula(5, 0.5), [1.0, 2.0]), False),
        (ArraySnapshot(SensorArray.ula(5, 0.5), 1.0, slowness=[1.0, 1.1]), False),
        (ArraySnapshot(SensorArray.ula(5, 0.5), 1.0, angle="doa"), False),
        (ArraySnapshot(SensorArray(np.sqrt([0.0, 0.2, 0.7, 1.9])), 1.0), False),
    ],
)
def test_electrical_angle_requires_a_grid_within_half_a_wavelength(
    model: ArraySnapshot, fast: bool
) -> None:
    assert isinstance(model.angle_manifold(), UniformLineManifold) is fast


# models


@every_model
def test_model_makes_the_round_trip_of_pickle_json_and_configuration(model: ArraySnapshot) -> None:
    assert pickle.loads(pickle.dumps(model)) == model
    again = ArraySnapshot.from_dict(json.loads(json.dumps(model.to_dict())))
    assert again == model
    assert hash(again) == hash(model)
    assert fourier_manifold(again.waves) is fourier_manifold(model.waves)


def test_responses_equal_parts_of_the_gaussian_interface() -> None:
    model = MODELS["cardioids"]
    x, steps = np.array([0.4, 1.2, -0.7]), 1e-6 * np.eye(3)
    slope = (model.h(x + steps) - model.h(x - steps)).T / 2e-6
    np.testing.assert_allclose(model.H(x), slope, atol=1e-7)


# several snapshots


@every_model
def test_measurement_has_the_shape_of_the_model(model: ArraySnapshot) -> None:
    rng = np.random.default_rng(0)
    z = model.simulate(np.zeros((5, 2)), 1.0, rng)
    assert z.shape == (5, *model.shape)
    Y = model.snapshots(z[0])
    assert Y.shape == (model.n_bins, model.array.n_sensors, model.n_snapshots)
    assert np.array_equal(np.swapaxes(Y, 1, 2).reshape(model.shape), z[0])


def test_simulated_snapshots_without_noise_equal_the_waves() -> None:
    model = ArraySnapshot(PLANE, [1.0, 1.3], n_snapshots=3, noise=1e-30)
    w = np.random.default_rng(0).normal(size=(4, 2, 3, 2)) + 0j
    doa = np.array([[0.1, np.nan], [0.2, 1.0], [0.3, 1.0], [0.4, -2.0]])
    z = model.simulate(doa, w, np.random.default_rng(1))
    a = model.steering_vector(np.nan_to_num(doa))  # (4, 2 sources, F, M)
    on = ~np.isnan(doa)[:, None, None]
    np.testing.assert_allclose(z, np.einsum("tfnk,tkfm->tfnm", w * on, a), atol=1e-12)


def test_likelihood_of_several_snapshots_is_the_product() -> None:
    several = ArraySnapshot(PLANE, [1.0, 1.3], n_snapshots=2, noise=0.3, power=2.0)
    z = several.simulate([0.4, -1.0], 1.0, np.random.default_rng(0))
    z[1, 0, 2] = np.nan
    doa = np.array([[0.4, -1.0], [0.5, 2.0]])
    alone = sum(
        ArraySnapshot(PLANE, wavelength, noise=0.3, power=2.0).log_likelihood(z[f, n], doa)
        for f, wavelength in enumerate([1.0, 1.3])
        for n in range(2)
    )
    np.testing.assert_allclose(several.log_likelihood(z, doa), alone, rtol=1e-12)


def test_likelihood_averages_over_an_unknown_slowness() -> None:
    slow = ArraySnapshot(PLANE, 1.0, noise=0.3, slowness=[0.8, 1.0])
    z = ArraySnapshot(PLANE, 1.0, noise=0.3).simulate([0.4], 1.0, np.random.default_rng(0))
    doa = np.array([[0.4], [2.0]])
    each = [ArraySnapshot(PLANE, 1 / s, noise=0.3).log_likelihood(z, doa) for s in (0.8, 1.0)]
    result = slow.log_likelihood(z, doa)
    np.testing.assert_allclose(result, logsumexp(each, axis=0) - np.log(2), rtol=1e-12)


def test_elevated_waves_have_shorter_ground_phases_and_height_phases() -> None:
    waves = PlaneWaves(SPACE, (1.0,), elevation=(0.5,))
    u = np.array([np.cos(0.5) * np.cos(0.3), np.cos(0.5) * np.sin(0.3), np.sin(0.5)])
    expected = np.exp(2j * np.pi * SPACE.positions @ u)
    np.testing.assert_allclose(waves.steering([0.3])[0, 0, :, 0], expected, atol=1e-12)


# what is ambiguous, and what is refused


def coherence(model: ArraySnapshot, pair: tuple[float, float]) -> float:
    a = model.waves.steering(np.array(pair))[0]
    b: Complex = a / np.linalg.norm(a, axis=1, keepdims=True)
    return float(np.mean(np.abs((b[..., 0].conj() * b[..., 1]).sum(axis=1)) ** 2))


@pytest.mark.parametrize(
    ("model", "is_ambiguous"),
    [
        (ArraySnapshot(SensorArray.ula(8, 2.0), 1.0), True),
        (ArraySnapshot(SensorArray.ula(8, 0.7), 1.0), True),
        (ArraySnapshot(SensorArray.ula(8, 0.7), [1.0, 1.3]), False),
        (ArraySnapshot(SensorArray.ula(8, 0.49), 1.0, angle="doa"), False),
        (ArraySnapshot(SensorArray.ula(8, 0.5), 1.0, angle="doa"), False),
        (ArraySnapshot(SPARSE, 1.0), False),
        (ArraySnapshot(CIRCLE, 1.0), False),
        (ArraySnapshot(SensorArray(SQUARE), 0.9), True),
        (ArraySnapshot(SensorArray(SQUARE), [0.9, 2.1]), False),
        (ArraySnapshot(SensorArray(SQUARE), 2.1), False),
    ],
)
def test_ambiguity_returns_a_pair_of_equal_response(
    model: ArraySnapshot, is_ambiguous: bool
) -> None:
    pair = model.ambiguity()
    assert (pair is not None) is is_ambiguous
    if pair is not None:
        assert coherence(model, pair) > 0.99
        assert abs(pair[0] - pair[1]) > 0.1


def test_ambiguity_of_a_sparse_line_is_at_endfire() -> None:
    pair = ArraySnapshot(SensorArray.ula(8, 0.8), 1.0).ambiguity()
    assert pair is not None
    np.testing.assert_allclose(
        np.rad2deg(pair), [-90, np.rad2deg(np.arcsin(1 / 0.8 - 1))], atol=0.5
    )


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (
            SensorArray(np.array([[0.0, 1.0], [2.0, 3.0]])),
            "at least 3 sensors for azimuths; got 2",
        ),
        (SensorArray(np.array([1.0])), "at least 2 sensors for directions; got 1"),
        (
            SensorArray(np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]])),
            r"collinear \(3 sensors\): azimuths 30 and 330 degrees are ambiguous",
        ),
        (
            SensorArray(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 5.0], [3.0, 3.0, 2.0]])),
            "array is collinear",
        ),
    ],
)
def test_arrays_without_identifiable_directions_are_refused(
    array: SensorArray, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        ArraySnapshot(array, 1.0).angle_manifold()


def test_directional_elements_resolve_front_and_back() -> None:
    row = SensorArray(np.array([[0.0, 0.0], [0.4, 0.0], [0.8, 0.0]]))
    model = ArraySnapshot(row, 1.0, response=ElementResponse.first_order([1.0, 2.0, -1.0]))
    assert model.angle_manifold().n_sensors == 3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wavelength": []}, "wavelength must name at least one bin"),
        ({"wavelength": [1.0, -1.0]}, "wavelength must be finite and positive; got -1"),
        ({"n_snapshots": 0}, "n_snapshots must be at least 1"),
        ({"angle": "polar"}, "angle must be one of 'auto', 'doa'"),
        ({"slowness": []}, "slowness must be a list of finite numbers"),
        ({"slowness": [-1.0]}, "slowness must be finite and positive"),
        ({"elevation": [2.0]}, "elevation must lie within ±π/2"),
        ({"elevation": [0.1], "slowness": [1.0]}, "slowness must be None if elevation is set"),
        ({"array": SPARSE, "elevation": [0.1]}, "elevation must be None for a line"),
        ({"response": 3.0}, "response must be an ElementResponse"),
        ({"response": ElementResponse.first_order([0.0])}, r"\(8 sensors\); got \(4, 1\)"),
        (
            {
                "response": ElementResponse(np.ones((3, 5, 8), dtype=complex)),
                "wavelength": [1.0, 2.0],
            },
            r"\(8 sensors, 2 bins\); got \(3, 5, 8\)",
        ),
        ({"array": SPARSE, "response": ElementResponse.first_order([0.0] * 5)}, "in a plane"),
    ],
)
def test_invalid_parameters_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        MODELS["circle"].replace(**changes)


def test_measurements_of_the_wrong_shape_are_refused() -> None:
    model = ArraySnapshot(CIRCLE, [1.0, 1.2], n_snapshots=3)
    with pytest.raises(ValueError, match=r"shape \(2, 3, 8\), one number a sensor in every bin"):
        model.snapshot(np.ones((3, 2, 8)))
    with pytest.raises(ValueError, match="must have one snapshot a step at one wavelength"):
        model.h([0.1, 1.0, 0.0])
    with pytest.raises(ValueError, match="a second unknown"):
        MODELS["elevation"].H([0.1, 1.0, 0.0])
