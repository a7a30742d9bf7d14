"""Charts of points: moves and offsets, walks, distances, and the fields of estimates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from point_manifolds import (
    MANIFOLDS,
    WAVES,
    azimuths,
    covariances,
    every_manifold,
    has_elevation,
    points,
    second_unknown,
    steps,
)

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sphere import great_circle
from arrivals.measurement_models.manifolds.line_phase import fresnel_line

two_unknowns = [name for name, m in MANIFOLDS.items() if m.n_unknowns == 2]

# the chart


@every_manifold
def test_offset_is_the_inverse_of_a_small_move(m: Any) -> None:
    x = points(m)
    step = 1e-4 * np.random.default_rng(0).normal(size=(m.n_unknowns, 4))
    offset, slope = m.offset(m.move(x, step), x)
    np.testing.assert_allclose(offset, step, atol=1e-9)
    if slope is not None:
        np.testing.assert_allclose(np.moveaxis(slope, -1, 0), [np.eye(2)] * 4, atol=1e-7)


@pytest.mark.parametrize("angle", [0.5, 1.4, 1.7, 2.9])
def test_offset_on_the_sphere_has_the_slope_that_is_stated(angle: float) -> None:
    m, h = MANIFOLDS["sphere"], 1e-6
    mean = points(m)
    step = np.random.default_rng(0).normal(size=(2, 4))
    x = m.move(mean, angle / m.unit[0] * step / np.linalg.norm(step, axis=0))
    _, slope = m.offset(x, mean)
    for j in range(2):
        up, down = (m.offset(m.move(x, steps(m, j, side * h)), mean)[0] for side in (1, -1))
        np.testing.assert_allclose((up - down) / (2 * h), slope[:, j], rtol=1e-6, atol=1e-7)


def test_offset_on_the_sphere_grows_as_far_as_the_opposite_direction() -> None:
    m = MANIFOLDS["sphere"]
    angles = np.linspace(0.0, np.pi, 40)
    x = m.move(np.repeat(points(m, 1), 40, axis=1), np.stack([angles, 0 * angles]) / m.unit[0])
    length = np.linalg.norm(m.offset(x, points(m, 1))[0], axis=0) * m.unit[0]
    assert (np.diff(length) > 0).all()
    assert length[-1] == pytest.approx(2.0)


def test_moves_on_the_sphere_are_great_circles_with_orthonormal_tangents() -> None:
    m = MANIFOLDS["sphere"]
    x = points(m)
    step = np.random.default_rng(0).normal(size=(2, 4))
    moved = m.move(x, step)
    apart = great_circle(m.direction(x).T, m.direction(moved).T)
    np.testing.assert_allclose(apart, m.unit[0] * np.linalg.norm(step, axis=0))
    rows = np.moveaxis(moved.reshape(3, 3, 4), 2, 0)
    np.testing.assert_allclose(rows @ rows.swapaxes(1, 2), [np.eye(3)] * 4, atol=1e-12)
    np.testing.assert_allclose(m.move(m.move(x, 0.3 * step), 0.7 * step), moved, atol=1e-12)


@every_manifold
def test_distance_is_the_angle_between_directions(m: Any) -> None:
    x = points(m)
    apart = m.distance(x[None], x)[0]
    u = m.direction(x).T
    if m.n_sensors and u.shape[1] == 1:
        expected = np.abs(np.subtract.outer(*2 * [np.arcsin(u[:, 0])]))
    else:
        expected = great_circle(u[:, None], u[None])
    np.testing.assert_allclose(apart, expected, atol=3e-8)


@every_manifold
def test_walk_is_a_step_of_its_variance_along_the_sphere(m: Any) -> None:
    """Monte Carlo: the mean square of the angle between before and after, over one axis."""
    x, std, rng = points(m)[:, 1:3], 1e-3, np.random.default_rng(0)
    Q = m.walk(x, std**2, 1e-12)
    assert Q.shape == (m.n_unknowns * (m.n_unknowns + 1) // 2, 2)
    full = Q[None] if m.n_unknowns == 1 else Q[np.array([[0, 1], [1, 2]])]
    draws = np.linalg.cholesky(np.moveaxis(full, 2, 0)) @ rng.normal(size=(2, m.n_unknowns, 20000))
    before = np.repeat(x, 20000, axis=1)
    moved = m.move(before, np.concatenate(list(draws), axis=1))
    n_axes = 2 if m.direction(x).shape[0] == 3 and m.n_unknowns == 2 else 1
    u, v = m.direction(before).T, m.direction(moved).T
    angle = great_circle(u, v) if u.shape[1] == 3 else np.arcsin(v) - np.arcsin(u)
    angle = angle.ravel()
    np.testing.assert_allclose((angle.reshape(2, -1) ** 2).mean(axis=1), n_axes * std**2, rtol=0.05)


# the estimate


@every_manifold
def test_located_returns_the_directions_that_points_were_made_of(m: Any) -> None:
    fields = m.located(points(m), 1e-4 * covariances(m))
    np.testing.assert_allclose(fields["doa"], azimuths(m))
    if m.n_unknowns == 2:
        second = fields["elevation" if has_elevation(m) else "range"]
        np.testing.assert_allclose(second, second_unknown(m))


@pytest.mark.parametrize("name", two_unknowns)
def test_located_covariance_is_that_of_moved_points(name: str) -> None:
    m = MANIFOLDS[name]
    x = points(m)[:, 1:2]
    S = 1e-6 * covariances(m)[:, :1]
    fields = m.located(x, S)
    full = S[np.array([[0, 1], [1, 2]]), 0]
    draws = np.linalg.cholesky(full) @ np.random.default_rng(0).normal(size=(2, 40000))
    cloud = m.located(m.move(np.repeat(x, 40000, axis=1), draws), np.repeat(S, 40000, axis=1))
    if "range" in fields:
        values = np.stack([cloud["doa"], 1 / cloud["range"]])
        deviation = np.std(cloud["range"])
        np.testing.assert_allclose(fields["range_std"], deviation, rtol=0.03)
    else:
        values = np.stack([cloud["elevation"], np.cos(fields["elevation"]) * cloud["doa"]])
        np.testing.assert_allclose(fields["std"], np.std(cloud["doa"]), rtol=0.03)
    scale = np.sqrt(np.diag(fields["covariance"][0]))
    np.testing.assert_allclose(
        np.cov(values) / np.outer(scale, scale),
        fields["covariance"][0] / np.outer(scale, scale),
        atol=0.03,
    )


def test_range_within_three_deviations_of_a_plane_wave_is_infinite() -> None:
    for name in ("fresnel", "spherical"):
        m = MANIFOLDS[name]
        x = np.array([[0.1, 0.1], [2.9, 3.1]])
        fields = m.located(x, np.array([[0.01, 0.01], [0.0, 0.0], [1.0, 1.0]]))
        np.testing.assert_array_equal(np.isinf(fields["range"]), [True, False])
        np.testing.assert_array_equal(np.isnan(fields["range_std"]), [True, False])


@pytest.mark.parametrize("name", ["sine", "square", "tilted", "fresnel", "spherical"])
def test_points_exist_within_three_deviations_of_the_domain(name: str) -> None:
    m = MANIFOLDS[name]
    std = 0.01
    x = np.zeros((m.n_unknowns, 3))
    x[0] = np.array([0.5, 1.02, 1.04]) / m.unit[0]
    S = np.zeros((m.n_unknowns * (m.n_unknowns + 1) // 2, 3))
    S[0] = (std / m.unit[0]) ** 2
    assert m.exists(x, S).tolist() == [True, True, False]


def test_sine_beyond_endfire_on_a_uniform_grid_is_its_image() -> None:
    """Half a wavelength: sin β = 1.1 has the response of -0.9, at whatever curvature."""
    m = fresnel_line(PlaneWaves(SensorArray.ula(8, 0.5), (1.0,)), 0.1)
    one, image = (np.array([[u / m.unit[0]], [1.5]]) for u in (1.1, -0.9))
    a, b = m.at(one)[0][0, 0], m.at(image)[0][0, 0]
    assert abs(np.vdot(a, b)) == pytest.approx(8)
    np.testing.assert_allclose(m.move(one, np.zeros((2, 1))), image)


@pytest.mark.parametrize("name", MANIFOLDS)
def test_amplitudes_are_those_of_the_wave_at_the_origin(name: str) -> None:
    m = MANIFOLDS[name].only([0])
    x, w = points(m), np.array([1.0, 2j, -1.5, 0.5 + 0.5j])
    p = m.waves.array.positions
    k, centre = 2 * np.pi / WAVES[0], np.array(m.centre)
    u = m.direction(x)[: p.shape[1]].T
    if name == "spherical":
        distance = np.linspace(4.0, 20.0, 4)[:, None]
        r = np.sqrt(distance**2 - 2 * distance * (u * (p[:, 0] - centre)) + (p[:, 0] - centre) ** 2)
        wave = distance / r * np.exp(1j * k * (distance - r + u * centre))
    elif name == "fresnel":
        c, q = (x[1] * m.unit[1])[:, None], p[:, 0] - centre
        wave = np.exp(1j * k * (u * p[:, 0] - c * q**2 / 2))
    else:
        wave = np.exp(1j * k * u @ p.T)
    for sensors in ([], [1, 4]):
        some = m.without(sensors)
        a = some.at(x)[0][0]
        received = np.delete(w[:, None] * wave, sensors, axis=1)
        fitted = (a.conj() * received).sum(axis=1) / some.n_sensors
        size = np.linalg.norm(received / w[:, None], axis=1) / np.sqrt(some.n_sensors)
        if name == "spherical":
            np.testing.assert_allclose(np.abs(fitted), np.abs(w) * size, rtol=1e-9)
        np.testing.assert_allclose(some.to_amplitude(fitted, x), w, rtol=1e-9)


@every_manifold
def test_amplitudes_of_several_bins_have_a_size_alone(m: Any) -> None:
    if m.n_bins == 1:
        return
    amplitude = m.to_amplitude(np.array([2j, -1, 1, 1]), points(m))
    assert (amplitude.imag == 0).all()
    assert (amplitude.real > 0).all()
