"""Scan grids: peaks on a line, the circle and the sphere."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import (
    fibonacci_sphere,
    great_circle,
    unit_vectors,
)
from arrivals.trackers import find_peaks, refine_peaks
from arrivals.trackers.beamforming.model_grid import scan_grid, sphere_grid
from arrivals.trackers.beamforming.scan_grid import AngleGrid, inverse_level, log_level
from arrivals.trackers.beamforming.sphere_grid import SphereGrid
from arrivals.typing import Float

UP = (0.0, 0.0, 1.0)
WHOLE, HALF = sphere_grid(3000, None), sphere_grid(1500, UP)
azimuths = st.floats(-np.pi, np.pi)


def bumps(*centres: Float, width: float = 0.25) -> Callable[[Float], Float]:
    """Return a sum of peaks at unit vectors, the later ones lower."""
    heights = 1.0 - 0.1 * np.arange(len(centres))

    def power_at(directions: Float) -> Float:
        u = unit_vectors(*directions)
        squares = [(1 - u @ each) / width**2 for each in centres]
        return np.asarray(sum(h * np.exp(-s) for h, s in zip(heights, squares, strict=True)))

    return power_at


@pytest.mark.parametrize("grid", [WHOLE, HALF])
def test_neighbours_are_near_in_all_directions(grid: SphereGrid) -> None:
    u, ring = grid.points, grid.ring
    distance = great_circle(u[:, None], ring)
    assert distance.min() > 0.5 * grid.step
    assert distance.max() < 2.1 * grid.step
    # directions to the neighbours surround each one
    middle = (ring - (ring @ u[..., None]) * u[:, None]).mean(axis=1)
    assert np.linalg.norm(middle, axis=1).max() < 0.6 * grid.step


def test_neighbours_across_the_edge_are_mirror_images() -> None:
    below = HALF.ring[..., 2] < 0
    assert below.any(axis=1).sum() > 50
    original = HALF.points[HALF.neighbours.T]
    np.testing.assert_allclose((HALF.ring * [1, 1, -1])[below], original[below], atol=1e-15)
    np.testing.assert_array_equal(HALF.ring[~below], original[~below])


@settings(max_examples=30)
@given(azimuths, st.floats(-1.0, 1.0), azimuths)
def test_peaks_are_found_to_a_fraction_of_the_step(az: float, height: float, turn: float) -> None:
    one, upright = unit_vectors(az, np.arcsin(height) + np.array([0.0, np.pi / 2]))
    other = Rotation.from_rotvec(turn * one).apply(upright)
    power_at = bumps(one, other)
    directions, power = WHOLE.peaks(power_at(WHOLE.directions), log_level, power_at, 5)
    assert directions.shape == (2, 2)
    found = unit_vectors(*directions)
    errors = great_circle(found, [one, other])
    assert np.rad2deg(errors.max()) < 0.2
    np.testing.assert_allclose(power, [1.0, 0.9], atol=1e-3)
    assert WHOLE.peaks(power_at(WHOLE.directions), log_level, power_at, 1)[0].shape == (2, 1)


@settings(max_examples=20)
@given(azimuths, st.floats(0.0, 0.2))
def test_peak_at_the_edge_of_a_half_is_found_once(az: float, elevation: float) -> None:
    one, image = unit_vectors(az, elevation), unit_vectors(az, -elevation)

    def power_at(directions: Float) -> Float:
        u = unit_vectors(*directions)
        return np.exp(40 * (u @ one - 1)) + np.exp(40 * (u @ image - 1))

    directions, power = HALF.peaks(power_at(HALF.directions), log_level, power_at, 5)
    assert directions.shape == (2, 1)
    assert directions[1, 0] >= 0
    assert power[0] >= power_at(np.array([[az], [elevation]]))[0] * (1 - 1e-3)


def test_spectrum_without_a_peak_has_none() -> None:
    flat = np.ones(len(WHOLE.doa))
    for power in (flat, 0 * flat):
        directions, values = WHOLE.peaks(power, log_level, lambda each: each[0] * 0 + 1, 3)
        assert (directions.shape, values.shape) == ((2, 0), (0,))


def test_two_equal_neighbours_are_one_peak() -> None:
    power = np.zeros(len(WHOLE.doa))
    first = 700
    power[[first, WHOLE.neighbours[0, first]]] = 1.0
    assert len(WHOLE.local_maxima(power)) == 1


@pytest.mark.parametrize("circular", [True, False])
def test_grid_of_one_angle_equals_find_and_refine_peaks(circular: bool) -> None:
    doa = np.linspace(-np.pi, np.pi, 90, endpoint=False) if circular else np.linspace(-1, 1, 90)
    power = np.random.default_rng(0).random(90) + 0.1
    grid = AngleGrid(doa[None], circular)
    peaks = find_peaks(power, circular=circular)[:4]
    directions, values = grid.peaks(power, log_level, log_level, 4)
    np.testing.assert_array_equal(directions[0], refine_peaks(doa, power, peaks))
    np.testing.assert_array_equal(values, power[peaks])
    other = grid.peaks(power, inverse_level, log_level, 4)[0]
    assert np.abs(other - directions).max() < doa[1] - doa[0]


def test_default_grid_has_two_degrees_and_the_half_of_the_plane() -> None:
    flat = ArraySnapshot(SensorArray.uca(5, 0.4), 1.0, unknowns="sphere")
    assert len(scan_grid(flat).doa) == 5157
    assert len(scan_grid(flat.replace(unknowns="azimuth")).doa) == 361
    space = flat.replace(array=SensorArray(0.4 * fibonacci_sphere(6)))
    assert len(scan_grid(space).doa) == 10313
    assert scan_grid(space) is scan_grid(space.replace())
    with pytest.raises(ValueError, match="n_directions must be at least 50; got 20"):
        scan_grid(space, 20)


def test_grid_of_a_tilted_plane_lies_above_it() -> None:
    square = np.array([[0.0, 0, 0], [0.5, 0, 0], [0, 0.5, 0], [0.5, 0.5, 0]])
    turn = Rotation.from_euler("xz", [0.6, 0.4])
    array = SensorArray(turn.apply(square))
    grid = scan_grid(ArraySnapshot(array, 1.0, unknowns="sphere"), 500)
    assert isinstance(grid, SphereGrid)
    assert grid.normal is not None
    np.testing.assert_allclose(grid.normal, turn.apply([0, 0, 1]), atol=1e-12)
    assert (grid.points @ turn.apply([0, 0, 1])).min() > 0
    np.testing.assert_allclose(np.linalg.norm(grid.points, axis=1), 1, atol=1e-12)
