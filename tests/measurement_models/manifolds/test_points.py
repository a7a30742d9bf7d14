"""Responses as functions of points: derivatives, means, candidates, and fewer sensors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from point_manifolds import (
    MANIFOLDS,
    SPACE,
    SQUARE,
    WAVES,
    covariances,
    every_manifold,
    points,
    steps,
)

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sphere import unit_vectors
from arrivals.measurement_models.manifolds.line_phase import fresnel_line
from arrivals.measurement_models.manifolds.manifold import is_angle_manifold, is_point_manifold
from arrivals.measurement_models.manifolds.phase import direction_cosines
from arrivals.measurement_models.manifolds.tangent_plane import tangent_planes

# the response


@every_manifold
def test_at_equals_the_response_without_spread(m: Any) -> None:
    x = points(m)
    a, gram = m.at(x)
    rows = m.responses(x[None], 0 * covariances(m)[None])[0]
    np.testing.assert_allclose(rows[:, 0], a, atol=1e-13)
    np.testing.assert_allclose((np.abs(a) ** 2).sum(axis=-1), m.n_sensors)
    d = m.n_unknowns
    first = rows[:, 1 : 1 + d]
    pairs = [(i, j) for i in range(d) for j in range(i, d)]
    products = [(first[:, i].conj() * first[:, j]).real.sum(axis=-1) for i, j in pairs]
    np.testing.assert_allclose(
        np.stack(products, 1), np.broadcast_to(gram, (m.n_bins, len(pairs), 4)), atol=1e-12
    )


@every_manifold
def test_responses_are_batched_over_leading_axes(m: Any) -> None:
    x, S = points(m), covariances(m)
    many = m.responses(np.stack([x, x[:, ::-1]]), np.stack([S, S[:, ::-1]]))
    d = m.n_unknowns
    assert many.shape == (2, m.n_bins, 1 + d + d * (d + 1) // 2, 4, m.n_sensors)
    np.testing.assert_allclose(many[1, :, :, ::-1], many[0])


@every_manifold
def test_first_derivatives_are_those_of_the_mean_response(m: Any) -> None:
    """Exact but for spherical waves, where the third derivative of the path is left out."""
    x, h = points(m), 1e-5
    S = covariances(m) * (0.1 if m is MANIFOLDS["spherical"] else 1.0)
    rows = m.responses(x[None], S[None])[0]
    tolerance = 5e-3 if m is MANIFOLDS["spherical"] else 1e-8
    for i in range(m.n_unknowns):
        up, down = (
            m.responses(m.move(x, steps(m, i, side * h))[None], S[None])[0, :, 0]
            for side in (1, -1)
        )
        np.testing.assert_allclose((up - down) / (2 * h), rows[:, 1 + i], atol=tolerance)


@every_manifold
def test_second_derivatives_are_those_of_the_response_without_spread(m: Any) -> None:
    x, S, h, d = points(m), 0 * covariances(m), 1e-4, m.n_unknowns
    rows = m.responses(x[None], S[None])[0]
    pairs = [(i, j) for i in range(d) for j in range(i, d)]
    for row, (i, j) in enumerate(pairs):
        total = sum(
            one * two * m.at(m.move(x, steps(m, i, one * h) + steps(m, j, two * h)))[0]
            for one in (1, -1)
            for two in (1, -1)
        )
        np.testing.assert_allclose(total / (4 * h * h), rows[:, 1 + d + row], atol=2e-6)


@every_manifold
def test_mean_response_is_that_of_a_gaussian_around_the_point(m: Any) -> None:
    """By Gauss-Hermite quadrature: exact for linear phases, to second order in S for others."""
    d = m.n_unknowns
    node, weight = np.polynomial.hermite_e.hermegauss(12)
    nodes = np.stack([each.ravel() for each in np.meshgrid(*d * [node])])
    weights = np.prod([each.ravel() for each in np.meshgrid(*d * [weight])], axis=0)
    x, S = points(m), covariances(m)
    for k in range(4):
        full = S[:, k : k + 1] if d == 1 else S[np.array([[0, 1], [1, 2]]), k]
        spread = np.linalg.cholesky(full) @ nodes
        start = np.repeat(x[:, k : k + 1], len(weights), axis=1)
        a, _ = m.at(start + spread if m.is_linear else m.move(start, spread))
        expected = (weights[:, None] * a).sum(axis=1) / weights.sum()
        mean = m.responses(x[None], S[None])[0, :, 0, k]
        np.testing.assert_allclose(mean, expected, atol=1e-10 if m.is_linear else 5e-3)


@every_manifold
def test_phases_are_uncorrelated_with_the_unknowns_and_units_turn_them_by_one_radian(
    m: Any,
) -> None:
    if m is MANIFOLDS["spherical"]:
        x = m.from_doa(np.zeros(1), np.full(1, 1e9))  # in the far field, where units are defined
    else:
        x = points(m)
    rows = m.responses(x[None], 0 * covariances(m, x.shape[1])[None])[0]
    slopes = (rows[:, 1 : 1 + m.n_unknowns] / rows[:, :1]).imag
    np.testing.assert_allclose(slopes.mean(axis=-1), 0, atol=1e-9)
    square = (slopes**2).mean(axis=(0, 3))
    if m is MANIFOLDS["sphere"]:  # all three axes together
        n, positions = m.direction(x), SPACE.positions - SPACE.positions.mean(axis=0)
        along = (
            m.unit[0] * (2 * np.pi / np.array(WAVES))[:, None, None] * (n.T @ positions.T)
        ) ** 2
        square = (square.sum(axis=0) + along.mean(axis=(0, 2))) / 3
    np.testing.assert_allclose(square, 1, rtol=1e-6)


# candidates


@every_manifold
def test_candidates_cover_the_domain_and_carry_its_measure(m: Any) -> None:
    candidates = m.candidates()
    assert m.candidates() is candidates
    assert candidates.points.shape[0] == m.point_size
    rng = np.random.default_rng(0)
    u = rng.normal(size=(200, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    if m.direction(candidates.points).shape[0] == 1:
        x = m.from_doa(np.arcsin(u[:, 0]))
    elif m.n_unknowns == 1:
        x = m.from_doa(np.arctan2(u[:, 1], u[:, 0]))
    else:
        x = m.from_doa(np.arctan2(u[:, 1], u[:, 0]), np.arcsin(u[:, 2]))
    a, b = m.at(x)[0], m.at(candidates.points)[0]
    coherence = np.abs(np.einsum("fgm,fhm->fgh", a.conj(), b)).mean(axis=0) / m.n_sensors
    assert coherence.max(axis=1).min() > 0.85


def test_candidates_of_spherical_waves_reach_the_nearest_range() -> None:
    m = MANIFOLDS["spherical"]
    x = m.candidates().points
    assert (x[1] * m.unit[1]).max() == pytest.approx(0.3)
    assert m.candidates().precision[2] == pytest.approx((m.unit[1] / 0.15) ** 2)


# fewer sensors and bins


@every_manifold
def test_manifold_of_fewer_sensors_keeps_points_and_is_cached(m: Any) -> None:
    x = points(m)
    some = m.without([1, 4])
    assert some is m.without(np.array([1, 4]))
    assert some.unit == m.unit
    assert hash(some) == hash(m.without([1, 4]))
    assert some.n_sensors == m.n_sensors - 2
    a = np.delete(m.at(x)[0], [1, 4], axis=-1)
    b = some.at(x)[0]
    turn = b / a
    np.testing.assert_allclose(turn, turn[..., :1] * np.ones_like(a), rtol=1e-9)
    assert m.without([]) is m
    if m.n_bins > 1:
        assert m.only([1]) is m.only([1])
        np.testing.assert_allclose(m.only([1]).at(x)[0][0], m.at(x)[0][1])


@every_manifold
def test_manifolds_of_points_are_no_series(m: Any) -> None:
    assert is_point_manifold(m)
    assert not is_angle_manifold(m)


# the array in space


def test_rotated_array_has_the_responses_of_rotated_directions() -> None:
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    one, other = (
        MANIFOLDS["sphere"],
        tangent_planes(PlaneWaves(SensorArray(SPACE.positions @ turn.T), WAVES)),
    )
    x = points(one)
    turned = (turn @ x.reshape(3, 3, 4).transpose(0, 1, 2)).reshape(9, 4)
    np.testing.assert_allclose(
        one.responses(x[None], covariances(one)[None]),
        other.responses(turned[None], covariances(one)[None]),
        atol=1e-12,
    )


def test_planar_array_in_space_is_that_in_a_plane() -> None:
    flat = direction_cosines(
        PlaneWaves(SensorArray(np.c_[SQUARE.positions, np.full(16, 7.0)]), (1.0,))
    )
    plain = MANIFOLDS["square"]
    assert flat.unit == pytest.approx(plain.unit)
    np.testing.assert_allclose(flat.frame, np.eye(3), atol=1e-12)
    x = points(plain)
    np.testing.assert_allclose(flat.at(x)[0], plain.at(x)[0], atol=1e-9)


def test_tilted_plane_has_directions_on_the_side_of_its_normal() -> None:
    m = MANIFOLDS["tilted"]
    x = m.candidates().points
    np.testing.assert_allclose(m.frame[2], [-0.8, 0.0, 0.6], atol=1e-12)
    assert (m.frame[2] @ m.direction(x) >= 0).all()
    fields = m.located(x, np.zeros((3, x.shape[1])))
    u = unit_vectors(fields["doa"], fields["elevation"])
    np.testing.assert_allclose(u.T, m.direction(x), atol=1e-12)
    np.testing.assert_allclose(m.from_doa(fields["doa"], fields["elevation"]), x, atol=1e-9)


# golden numbers of the specification, section 11


def test_golden_numbers_of_planar_arrays() -> None:
    square = np.array([[0.0, 0.0], [0.0, 0.5], [0.5, 0.0], [0.5, 0.5]])
    small = direction_cosines(PlaneWaves(SensorArray(square), (1.0,)))
    assert small.unit == pytest.approx(2 * (0.63661977,))
    np.testing.assert_allclose(small.gram[0, :, 0], [4, 0, 4], atol=1e-12)
    assert small.candidates().points.shape == (2, 37)
    m = MANIFOLDS["square"]
    x = m.from_doa(np.deg2rad([30, 110]), np.deg2rad([40, 75]))
    np.testing.assert_allclose(
        (x * m.scale).T, [[0.663414, 0.383022], [-0.088521, 0.243210]], atol=1e-6
    )
    Q = m.walk(x, np.deg2rad(1) ** 2) * m.unit[0] ** 2 * 1e6
    golden = [[170.5498, 302.2304], [-77.4040, 6.5582], [259.9282, 286.5989]]
    np.testing.assert_allclose(Q, golden, atol=1e-4)


def test_golden_units_of_curved_lines() -> None:
    m = fresnel_line(PlaneWaves(SensorArray.ula(16, 0.5), (1.0,)), 0.05)
    assert m.unit == pytest.approx((0.069051, 0.067387), abs=1e-6)


@pytest.mark.parametrize("turn", [0.0, 0.4])
@pytest.mark.parametrize("shear", [0.0, 0.25])
def test_points_beyond_the_rim_move_to_their_images_within(turn: float, shear: float) -> None:
    """Of a lattice with a gap, in any orientation; with a sensor left out, too."""
    axis = 0.5 * np.arange(4)
    p = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)[1:] @ [[1.0, 0.0], [shear, 1.0]]
    p = p @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    m = direction_cosines(PlaneWaves(SensorArray(p), (1.0,)))
    uv = np.random.default_rng(0).uniform(-1.3, 1.3, (2, 200))
    x = uv / m.scale
    moved = m.without([2]).move(x, np.zeros_like(x))
    radius, after = np.hypot(*uv), np.hypot(*(moved * m.scale))
    near = radius < 1.05  # perhaps a source on the horizon, by noise
    np.testing.assert_array_equal(moved[:, near], x[:, near])
    changed = (moved != x).any(axis=0)
    assert (after[changed] <= 1).all()
    assert changed.sum() > 20
    one, other = m.at(x)[0], m.at(moved)[0]
    np.testing.assert_allclose(np.abs((one.conj() * other).sum(axis=-1)), m.n_sensors)


@pytest.mark.parametrize("missing", [[], [3], [1, 3, 5, 7]])
def test_sines_beyond_one_move_to_their_images_of_the_whole_line(missing: list[int]) -> None:
    m = fresnel_line(PlaneWaves(SensorArray.ula(9, 0.45), (1.0,)), 0.05).without(missing)
    sine = np.array([0.4, 1.05, 1.15, -1.3, 2.0])
    x = np.stack([sine, 0 * sine]) / m.scale
    moved = m.move(x, np.zeros_like(x)) * m.scale
    period = 1 / 0.45
    np.testing.assert_allclose(moved[0], [0.4, 1.05, 1.15 - period, period - 1.3, 2 - period])


def test_sensors_off_a_lattice_and_several_bins_have_no_images() -> None:
    for array, wavelengths in ((SensorArray.uca(8, 0.65), (1.0,)), (SQUARE, (1.0, 1.1))):
        m = direction_cosines(PlaneWaves(array, wavelengths))
        x = np.array([[1.2], [0.3]]) / m.scale
        np.testing.assert_array_equal(m.move(x, np.zeros((2, 1))), x)
