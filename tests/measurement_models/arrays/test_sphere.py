"""Unit vectors, azimuth and elevation, great circles, and the Fibonacci grid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models.arrays.sphere import (
    azimuth_elevation,
    fibonacci_sphere,
    great_circle,
    unit_vectors,
)

azimuths = st.floats(-np.pi, np.pi, exclude_max=True)
elevations = st.floats(-1.57, 1.57)


@given(azimuths, elevations)
def test_azimuth_elevation_is_the_inverse_of_unit_vectors(azimuth: float, elevation: float) -> None:
    back = azimuth_elevation(unit_vectors(azimuth, elevation))
    np.testing.assert_allclose(back[1], elevation, atol=1e-12)
    turn = (back[0] - azimuth + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) * np.cos(elevation) < 1e-12
    assert -np.pi <= back[0] < np.pi


@given(azimuths, elevations, azimuths, elevations)
def test_great_circle_is_the_haversine_distance(
    az1: float, el1: float, az2: float, el2: float
) -> None:
    haversine = np.sin((el1 - el2) / 2) ** 2 + (
        np.cos(el1) * np.cos(el2) * np.sin((az1 - az2) / 2) ** 2
    )
    apart = great_circle(unit_vectors(az1, el1), unit_vectors(az2, el2))
    assert apart == pytest.approx(2 * np.arcsin(np.sqrt(min(haversine, 1.0))), abs=3e-8)


def test_great_circle_of_nearly_equal_vectors_keeps_all_digits() -> None:
    assert great_circle(*unit_vectors(0.0, [0.3, 0.3 + 1e-10])) == pytest.approx(1e-10, rel=1e-5)


def test_azimuth_of_the_negative_x_axis_is_minus_pi() -> None:
    assert azimuth_elevation([-1.0, 0.0, 0.0])[0] == -np.pi


@pytest.mark.parametrize("upper", [False, True])
def test_fibonacci_sphere_neighbours_are_evenly_apart(upper: bool) -> None:
    n = 400
    u = fibonacci_sphere(n, upper)
    np.testing.assert_allclose(np.linalg.norm(u, axis=1), 1)
    apart = great_circle(u[:, None], u[None]) + 10 * np.eye(n)
    spacing = np.sqrt((2 if upper else 4) * np.pi / n)
    assert 0.7 * spacing < apart.min(axis=1).min()
    assert apart.min(axis=1).max() < 1.05 * spacing
    rng = np.random.default_rng(0)
    elsewhere = rng.standard_normal((2000, 3))
    elsewhere[:, 2] = np.abs(elsewhere[:, 2]) if upper else elsewhere[:, 2]
    assert great_circle(elsewhere[:, None], u[None]).min(axis=1).max() < spacing


def test_fibonacci_sphere_without_points_is_refused() -> None:
    with pytest.raises(ValueError, match="n must be"):
        fibonacci_sphere(0)
