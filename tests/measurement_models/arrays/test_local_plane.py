"""Tests of the plane of latitudes and longitudes: round trip, geodesics, errors."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from arrivals.measurement_models.arrays.local_plane import LocalPlane

angles = st.tuples(st.floats(-90, 90), st.floats(-180, 180))
metres = st.floats(-6e5, 6e5)


@given(angles, metres, metres)
@example((60.0, 25.0), 1e-161, 0.0)
def test_plane_is_a_round_trip(origin: tuple[float, float], x: float, y: float) -> None:
    plane = LocalPlane(*origin)
    back = plane.to_xy(*plane.to_lat_lon(x, y))
    np.testing.assert_allclose(back, (x, y), rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("distance", "largest"), [(1e3, 1e-6), (1e4, 1e-4), (3e4, 1e-3), (1e5, 0.02), (9e5, 11.0)]
)
def test_plane_has_the_distances_and_azimuths_of_geodesics(distance: float, largest: float) -> None:
    geod = pytest.importorskip("pyproj").Geod(ellps="WGS84")
    azimuth = np.linspace(-180, 180, 37)
    truth = distance * np.stack([np.sin(np.deg2rad(azimuth)), np.cos(np.deg2rad(azimuth))])
    for lat in (-60.0, 0.0, 45.0, 89.9):
        many = [np.full(37, value) for value in (10.0, lat, distance)]
        lon, far, _ = geod.fwd(many[0], many[1], azimuth, many[2])
        error = np.linalg.norm(LocalPlane(lat, 10.0).to_xy(far, lon) - truth, axis=0)
        assert error.max() < largest


@pytest.mark.parametrize(("radius", "largest"), [(1e4, 4.2e-7), (1e5, 4.2e-5)])
def test_plane_has_other_distances_slightly_too_long(radius: float, largest: float) -> None:
    geod = pytest.importorskip("pyproj").Geod(ellps="WGS84")
    azimuth, (i, j) = np.linspace(-180, 170, 36), np.triu_indices(36, 1)
    for lat in (-60.0, 0.0, 45.0, 89.9):
        many = [np.full(36, value) for value in (10.0, lat, radius)]
        lon, far, _ = geod.fwd(many[0], many[1], azimuth, many[2])
        x = np.array(LocalPlane(lat, 10.0).to_xy(far, lon))
        true = geod.inv(lon[i], far[i], lon[j], far[j])[2]
        excess = np.linalg.norm(x[:, i] - x[:, j], axis=0) / true - 1
        assert excess.min() > -1e-9
        assert 0.9 * largest < excess.max() < largest


def test_plane_around_positions_crosses_the_date_line() -> None:
    plane = LocalPlane.around([0.0, 0.0, np.nan], [179.9, -179.9, 3.0])
    x, y = plane.to_xy([0.0, 0.0, np.nan], [179.9, -179.9, 3.0])
    np.testing.assert_allclose(x, [-11131.95, 11131.95, np.nan], atol=0.01)
    np.testing.assert_allclose(y, [0.0, 0.0, np.nan], atol=1e-6)


def test_plane_north_of_the_equator_has_the_metres_of_a_degree() -> None:
    x, y = LocalPlane(45.0, 0.0).to_xy([45.5, 44.5], 0.0)
    assert float(y[0] - y[1]) == pytest.approx(111131.8, abs=1.0)  # a degree at 45°
    np.testing.assert_allclose(x, 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("lat", "lon", "message"),
    [
        (91.0, 0.0, r"lat must lie within ±90 degrees; got 91"),
        (0.0, -361.0, r"lon must lie within ±360 degrees; got -361"),
        ([60.0, 0.0], [24.0, 0.0], "without a fix, or swapped columns"),
        (np.nan, 0.0, "must contain a position"),
    ],
)
def test_plane_refuses_positions_that_are_not_of_one_place(
    lat: object, lon: object, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        LocalPlane.around(lat, lon).to_xy(lat, lon)  # type: ignore[arg-type]
