"""The real manifold of a symmetric array."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArrayManifold, ArraySnapshot, SensorArray, composite

ARRAYS = [SensorArray.symmetric([m / 4 for m in range(1, M + 1)]) for M in (1, 2, 3, 4)]
every_size = pytest.mark.parametrize("array", ARRAYS, ids=lambda a: f"M{a.n_sensors // 2}")


@every_size
def test_transformed_response_is_real_and_equals_the_formula(array: SensorArray) -> None:
    manifold, doa = ArrayManifold(array, 1.0), np.linspace(-1.5, 1.5, 61)
    turned = manifold.transform(array.steering_vector(doa, 1.0))
    assert abs(turned.imag).max() < 1e-15
    np.testing.assert_allclose(turned.real, manifold.real_steering(doa), atol=2e-15)
    np.testing.assert_array_equal(manifold.real_steering(doa)[:, manifold.centre], 1.0)


@every_size
def test_transformation_is_unitary(array: SensorArray) -> None:
    T = ArrayManifold(array, 1.0).T
    np.testing.assert_allclose(T.conj().T @ T, np.eye(array.n_sensors), atol=1e-15)


@given(st.floats(-1.5, 1.5))
def test_doa_inverts_phases(doa: float) -> None:
    manifold = ArrayManifold(SensorArray.symmetric([0.5, 1.5, 2.5]), 1.0)
    a = manifold.real_steering(doa)
    known = manifold.doa(np.arctan2(a[4:], a[:3]))
    assert np.sin(known) == pytest.approx(np.sin(doa), abs=1e-12)


def test_doa_weights_pairs_by_least_squares() -> None:
    manifold = ArrayManifold(SensorArray.symmetric([0.25, 0.5, 0.75]), 1.0)
    d, rng = manifold.distances, np.random.default_rng(0)
    phi = manifold.phases(0.4) + 0.05 * rng.standard_normal((1000, 3))
    fitted = np.linalg.lstsq(2 * np.pi * d[:, None], phi.T, rcond=None)[0][0]
    np.testing.assert_allclose(np.sin(manifold.doa(phi)), fitted, atol=1e-12)


def test_manifold_is_invariant_to_sensor_order_and_array_position() -> None:
    places = np.array([0.5, -0.25, 0.0, 0.25, -0.5])
    manifold = ArrayManifold(SensorArray(places), 1.0)
    a = manifold.array.steering_vector(0.7, 1.0)
    np.testing.assert_allclose(manifold.transform(a), manifold.real_steering(0.7), atol=1e-15)
    shifted = ArrayManifold(SensorArray(places + 3.0), 1.0)
    z = shifted.array.steering_vector(0.7, 1.0)
    np.testing.assert_allclose(shifted.transform(z / z[2]), manifold.real_steering(0.7), atol=1e-14)


def test_gaussian_interface_equals_transformed_snapshots() -> None:
    array = SensorArray.symmetric([0.2, 0.45])
    manifold, snapshot = ArrayManifold(array, 1.0, noise=0.3), ArraySnapshot(array, 1.0, noise=0.3)
    x = np.array([0.4, 1.0, -0.5])
    raw = snapshot.h(x)
    turned = manifold.transform(raw[:5] + 1j * raw[5:])
    np.testing.assert_allclose(manifold.h(x), composite(turned), atol=1e-14)
    step = 1e-6 * np.eye(3)
    slope = (manifold.h(x + step) - manifold.h(x - step)).T / 2e-6
    np.testing.assert_allclose(manifold.H(x), slope, atol=1e-8)
    np.testing.assert_array_equal(manifold.R, snapshot.R)
    assert manifold.h(np.tile(x, (2, 3, 1))).shape == (2, 3, manifold.dim_z)


WRONG: list[tuple[Callable[[], object], type[Exception], str]] = [
    (
        lambda: ArrayManifold(SensorArray.ula(4, 0.6), 1.0),
        ValueError,
        "at most a quarter wavelength, 0.25 m, from the centre; got 0.3 m",
    ),
    (
        lambda: ArrayManifold(SensorArray(np.zeros(1)), 1.0),
        ValueError,
        "array must have a pair of sensors; got 1",
    ),
    (
        lambda: ArrayManifold(SensorArray(np.array([-0.5, 0.0, 0.4])), 1.0),
        ValueError,
        "symmetric about its centre at 0 m; got sensors at -0.5 and 0.4 m",
    ),
    (lambda: ArrayManifold(SensorArray.uca(5, 0.5), 1.0), ValueError, "must be a line"),
    (
        lambda: ArrayManifold(SensorArray.symmetric([0.6, 1.0]), 1.0),
        ValueError,
        "at most half a wavelength, 0.5 m, from the centre; got 0.6 m",
    ),
    (lambda: ArrayManifold(SensorArray.symmetric([0.5]), -1.0), ValueError, "wavelength"),
    (lambda: ArrayManifold("array", 1.0), TypeError, "must be a SensorArray"),  # type: ignore[arg-type]
    (lambda: ArrayManifold(ARRAYS[1], 1.0).doa([0.1]), ValueError, r"shape \(\.\.\., 2\)"),
]


@pytest.mark.parametrize(("call", "error", "message"), WRONG, ids=[w[2][:25] for w in WRONG])
def test_invalid_input_raises_with_message(
    call: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        call()
